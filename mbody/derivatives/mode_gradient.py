"""Derivatives of frequencies, damping, shapes and stiffnesses of small motions at a rest position.

A root s of (s² M + s C + K) u = 0 with the left vector w, wᵀ (s² M + s C + K) = 0, has

    ds/dp = −wᵀ (s² M′ + s C′ + K′) u / (wᵀ (2 s M + C) u),

where it is simple. Its shape moves by du, of which a multiple of u has no say in ratios:

    (s² M + s C + K) du + (2 s M + C) u ds = −(s² M′ + s C′ + K′) u dp,   ūᵀ du = 0.

M′, C′ and K′, and those of the ways T that coordinates go with the leaders, are differences over
four places, at each of which the rest position is found once more. The amplitude of an angle, or of
x or y of a point, is a = T u, and a ratio a/b has the size |a/b| and the phase arg(a/b).

F. Tisseur, K. Meerbergen: The quadratic eigenvalue problem, SIAM Review 43 (2001), 2.3 and 4.2.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from mbody.analysis.driven.statics import statics
from mbody.analysis.equilibria.equilibrium import Equilibrium
from mbody.analysis.linear.linearize import Linearization, linearize
from mbody.analysis.linear.mode_amplitudes import ModePlace, mode_place, rates_at
from mbody.analysis.linear.modes import Mode, modes
from mbody.derivatives.driven_instants import DrivenInstants
from mbody.derivatives.gradient_result import Gradient, per
from mbody.derivatives.named_numbers import number_sizes, unit_of
from mbody.derivatives.rest_instants import RestInstants
from mbody.errors import ModelError, SolveError, brief
from mbody.model.element import listed
from mbody.quantities.units import DIMENSIONS
from mbody.solution.doubts import inherited
from mbody.solution.places import link_poses

__all__ = ["mode_gradient"]

Array = np.ndarray

#: Step of the differences, as a part of the size of a number: matrices are exact to 1e-11.
PART = 1e-3
#: A root is simple where wᵀ (2 s M + C) u is more than this part of what it is made of.
SIMPLE = 1e-6
#: Newton steps to the rest position beside, at most, and the last of them in model lengths.
STEPS, LAST = 12, 1e-12
#: What is measured of a mode, by number, and of the stiffness, by leaders.
OF_MODE = re.compile(r"\s*(\w+)\s*\(\s*(\d+)\s*\)\s*")
OF_SHAPE = re.compile(r"\s*(ratio|phase)\s*\(\s*(\d+)\s*,\s*([\w.]+)\s*,\s*([\w.]+)\s*\)\s*")
OF_LEADERS = re.compile(r"\s*stiffness\s*\(\s*([^,()]+?)\s*(?:,\s*([^,()]+?)\s*)?\)\s*")
KINDS = {
    "frequency": "angular velocity",
    "natural_frequency": "angular velocity",
    "hertz": "frequency",
    "decay_rate": "frequency",
    "damping_ratio": "",
}


@dataclass(frozen=True)
class _Wanted:
    """One measure: of mode `number`, or the stiffness between two leaders; of a shape the
    amplitudes of two places.
    """

    name: str
    kind: str
    number: int = 0
    leaders: tuple[int, int] = (0, 0)
    places: tuple[ModePlace, ...] = ()


def mode_gradient(rest: Equilibrium, measure: Any, by: Mapping[str, str]) -> Gradient:
    """Derivatives of measures of the modes at a rest position by numbers, names by those given.

    Raises
    ------
    ModelError
        For a measure that is none of modes, or a mode or leader that is not there.
    SolveError
        As `linearize`.
    """
    names = list(by.values())
    beside = _BesideRest(rest, names)
    linear = linearize(beside.instants.driven, at=beside.run, free=beside.drivers)
    (found,) = modes(beside.instants.driven, at=beside.run, free=beside.drivers)
    wanted = _wanted(measure, linear, len(found))
    places = list(dict.fromkeys(place for one in wanted for place in one.places))
    sizes = number_sizes(beside.instants.driven, names)
    jacobian, notes = np.zeros((len(wanted), len(names))), list[str]()
    for k, name in enumerate(names):
        changes, why = None, "the rest position beside it is not found, or other bodies lead there"
        try:
            changes = beside.changes(name, PART * (sizes[k] or 1.0), linear, places)
        except (ModelError, SolveError) as error:
            why = str(error)
        if changes is None:
            jacobian[:, k] = np.nan
            notes.append(f"there is no derivative by '{name}': {why}")
            continue
        for row, one in enumerate(wanted):
            if one.kind == "stiffness":
                jacobian[row, k] = changes[2][one.leaders]
            elif one.places:
                ways = [changes[3][places.index(place)] for place in one.places]
                jacobian[row, k] = _of_shape(found[one.number], linear, changes, ways, one)
            else:
                jacobian[row, k] = _of_root(found[one.number], linear, changes, one.kind)
    for row, one in enumerate(wanted):
        if one.kind != "stiffness" and np.isnan(jacobian[row]).all():
            why = "where others meet it or it begins to oscillate"
            if one.places:
                why += ", or an amplitude is zero"
            notes.append(
                f"'{one.name}' has no derivative: its root is not simple, or is zero, {why}"
            )
    notes.append(
        "M, C and K of small motions are differenced over four places: derivatives have some 8 "
        "figures"
    )
    units = {given: unit_of(rest.solution.mechanism, name) for given, name in by.items()}
    of = {one.name: _unit(one, linear) for one in wanted}
    return Gradient(
        value={one.name: _value(one, linear, found) for one in wanted},
        by=tuple(by),
        jacobian=jacobian,
        units={one: {n: per(of[one], unit) for n, unit in units.items()} for one in of},
        at=dict.fromkeys(of),
        measured=of,
        **inherited(found, notes=notes),
    )


class _BesideRest:
    """The linear equations at one rest position, and at that of other numbers beside it."""

    def __init__(self, rest: Equilibrium, names: Sequence[str]) -> None:
        self.instants = RestInstants(rest, names)
        self.drivers = self.instants.drivers
        self.laws = [f"{name}.law.value" for name in self.drivers]
        self.run = self.instants.run
        self.poses = link_poses(rest.solution)
        driven = self.instants.driven
        turns = [driven.length if motion.turns else 1.0 for motion in rest.motions]
        self.unit = driven.length / np.array(turns)

    def linear(self, numbers: Mapping[str, float]) -> Linearization | None:
        """M, C and K where the loads balance with other numbers; None where that is not found."""
        system = self.instants.driven.with_values(dict(numbers))
        place = np.array([float(system.values[law]) for law in self.laws])
        for _ in range(STEPS):
            system = system.with_values(dict(zip(self.laws, place.tolist(), strict=True)))
            self.run = statics(system, t=[float(self.instants.run.t[0])], guess=self.poses)
            whole = DrivenInstants(self.run, self.laws).at(np.zeros(1, dtype=int), False)
            efforts = [whole.effort(name) for name in self.drivers]
            e = np.array([one.value[0] for one in efforts])
            step = np.linalg.solve(np.array([one.tangents[0] for one in efforts]), -e)
            place = place + step
            if np.abs(step / self.unit).max() <= LAST:
                break
        else:
            return None
        return linearize(system, at=self.run, free=self.drivers)

    def changes(
        self, name: str, step: float, linear: Linearization, places: Sequence[ModePlace]
    ) -> list[Array] | None:
        """Derivatives of M, C, K and the ways of places (places, free) by a number; None where what
        is beside it does not compare.
        """
        value, ends = float(self.instants.driven.values[name]), []
        for k in (-2, -1, 1, 2):
            one = self.linear({name: value + k * step})
            if one is None or one.leaders != linear.leaders:
                return None
            ends.append((one.mass, one.damping, one.stiffness, _ways(one, places)))
        return [
            (8.0 * (up - near) - (most - low)) / (12.0 * step)
            for low, near, up, most in zip(*ends, strict=True)
        ]


def _ways(linear: Linearization, places: Sequence[ModePlace]) -> Array:
    """What places do for unit rates of the leaders (places, free)."""
    solution, rates = linear.solution, linear.rates
    found = [rates_at(solution, rates, place) for place in places]
    return np.array(found).reshape(len(places), len(rates))


def _simple(mode: Mode, linear: Linearization) -> Array | None:
    """The left vector of a root that is simple."""
    s, u = mode.eigenvalue, mode.amplitudes
    M, C, K = linear.mass, linear.damping, linear.stiffness
    left: Array = np.linalg.svd((s * s * M + s * C + K).T)[2][-1].conj()
    below = left @ (2.0 * s * M + C) @ u
    size = float(np.abs(left) @ (2.0 * abs(s) * np.abs(M) + np.abs(C)) @ np.abs(u))
    if s == 0.0 or not abs(below) > SIMPLE * size:
        return None
    sizes = np.linalg.svd(s * s * M + s * C + K, compute_uv=False)
    return None if len(sizes) > 1 and not sizes[-2] > SIMPLE * sizes[0] else left


def _of_root(mode: Mode, linear: Linearization, changes: Sequence[Array], kind: str) -> float:
    """The derivative of what is measured of a mode; NaN of a root that is not simple."""
    s, u, left = mode.eigenvalue, mode.amplitudes, _simple(mode, linear)
    if left is None:
        return np.nan
    below = left @ (2.0 * s * linear.mass + linear.damping) @ u
    change = complex(-(left @ (s * s * changes[0] + s * changes[1] + changes[2]) @ u) / below)
    size = abs(s)
    along = (s.conjugate() * change).real / size
    if kind == "decay_rate":
        return -change.real
    if kind == "damping_ratio":
        return -change.real / size + s.real * along / size**2
    if kind == "natural_frequency":
        return along if s.imag else 0.0
    return change.imag / (2.0 * np.pi if kind == "hertz" else 1.0)


def _of_shape(
    mode: Mode,
    linear: Linearization,
    changes: Sequence[Array],
    ways: Sequence[Array],
    one: _Wanted,
) -> float:
    """The derivative of a ratio of amplitudes, or of the phase between them, from those of the ways
    of both; NaN of a root that is not simple, and of amplitudes that are zero.
    """
    s, u, n = mode.eigenvalue, mode.amplitudes, len(linear.motions)
    a, b = (_amplitude(mode, linear, place) for place in one.places)
    if _simple(mode, linear) is None or not a or not b:
        return np.nan
    bordered = np.zeros((n + 1, n + 1), dtype=complex)
    bordered[:n, :n] = s * s * linear.mass + s * linear.damping + linear.stiffness
    bordered[:n, n] = (2.0 * s * linear.mass + linear.damping) @ u
    bordered[n, :n] = u.conj()
    right = np.append(-(s * s * changes[0] + s * changes[1] + changes[2]) @ u, 0.0)
    du = np.linalg.solve(bordered, right)[:n]
    more = [
        u @ change + du @ way for change, way in zip(ways, _ways(linear, one.places), strict=True)
    ]
    relative = more[0] / a - more[1] / b
    return float(relative.imag if one.kind == "phase" else abs(a / b) * relative.real)


def _amplitude(mode: Mode, linear: Linearization, place: ModePlace) -> complex:
    """The amplitude of a place; what is rounding is zero."""
    (ways,) = _ways(linear, [place])
    found = complex(mode.amplitudes @ ways)
    # lengths by the model length, so that no unit has a say in what is zero
    unit = np.array([linear.solution.system.length] * 2 + [1.0])
    size = float(np.abs(mode.amplitudes) @ np.abs(linear.rates / unit).max(axis=(1, 2)))
    size *= unit[place.key]
    return found if abs(found) > SIMPLE * size else 0.0


def _wanted(measure: Any, linear: Linearization, count: int) -> list[_Wanted]:
    """The measures, checked."""
    given: Any = {"frequency(1)": "frequency(1)"} if measure is None else measure
    given = [given] if isinstance(given, str) else given
    pairs = given if isinstance(given, Mapping) else {one: one for one in given}
    found, leaders = [], list(linear.leaders)
    for name, text in pairs.items():
        mode = OF_MODE.fullmatch(text) if isinstance(text, str) else None
        mode = mode if mode and mode[1] in KINDS else None
        shape = OF_SHAPE.fullmatch(text) if isinstance(text, str) else None
        if one := mode or shape:
            if not 1 <= int(one[2]) <= count:
                raise ModelError(f"gradient: '{text}': there are modes 1 to {count}", str(name))
            parts = shape.groups()[2:] if shape else ()
            machine = linear.solution.mechanism
            places = tuple(mode_place(machine, part, f"gradient: '{text}': ") for part in parts)
            found.append(_Wanted(name, one[1], int(one[2]) - 1, places=places))
            continue
        pair = OF_LEADERS.fullmatch(text) if isinstance(text, str) else None
        if pair is None or not {pair[1], pair[2] or pair[1]} <= set(leaders):
            raise ModelError(
                f"gradient: {brief(text)} is no measure of modes: give {listed(KINDS)} with the "
                f"number of a mode, such as frequency(1), ratio(1, {leaders[0]}.x, "
                f"{leaders[0]}.angle) or phase of two amplitudes, or stiffness({leaders[0]}) of "
                f"what leads a free motion: {listed(leaders)}",
                str(name),
            )
        both = leaders.index(pair[1]), leaders.index(pair[2] or pair[1])
        found.append(_Wanted(name, "stiffness", leaders=both))
    return found


def _value(one: _Wanted, linear: Linearization, found: Any) -> float:
    if one.kind == "stiffness":
        return float(linear.stiffness[one.leaders])
    mode: Mode = found[one.number]
    if one.places:
        a, b = (_amplitude(mode, linear, place) for place in one.places)
        if not b:
            raise ModelError(
                f"gradient: '{one.name}' divides by an amplitude that is zero: in mode "
                f"{one.number + 1} it does not move; take another one",
                one.name,
            )
        return float(np.angle(a / b)) if one.kind == "phase" else abs(a / b)
    return float(
        {
            "frequency": mode.frequency,
            "natural_frequency": mode.natural_frequency,
            "hertz": mode.hertz,
            "decay_rate": mode.decay_rate,
            "damping_ratio": mode.damping_ratio,
        }[one.kind]
    )


def _unit(one: _Wanted, linear: Linearization) -> str:
    units = linear.solution.mechanism.units
    if one.kind == "stiffness":
        i, j = (linear.motions[k].turns for k in one.leaders)
        effort = units.of(DIMENSIONS["torque" if i else "force"])
        return f"{effort}/{'rad' if j else units.length}"
    if one.kind == "phase":
        return "rad"
    if one.kind == "ratio":
        a, b = ("rad" if place.turns else units.length for place in one.places)
        return "" if a == b else f"{a}/{b}"
    return units.of(DIMENSIONS[KINDS[one.kind]]) if KINDS[one.kind] else ""
