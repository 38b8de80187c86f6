"""Exact derivatives of measured quantities of an analysis."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from mbody.analysis.driven.driven import ANALYSES, requested_instants, revolving_driver, statics
from mbody.analysis.dynamics.simulate import simulate
from mbody.analysis.equilibria.equilibrium import Equilibrium, equilibrium
from mbody.analysis.linear.linearize import Linearization, linearize
from mbody.analysis.linear.modes import Mode, ModePlace, mode_place, modes, rates_at
from mbody.analysis.position.assembly_analysis import as_system
from mbody.core import tolerances as tol
from mbody.core.presentation import Presented
from mbody.derivatives.driven_instants import DrivenInstants, EquilibriumInstants
from mbody.derivatives.dual_solution import (
    checked_names,
    dimension_of_number,
    influential,
    natural_sizes,
    number_sizes,
    unit_of,
)
from mbody.derivatives.free_instants import MotionInstants, motion_instants
from mbody.derivatives.mode_record import with_formulas_of_the_instant
from mbody.derivatives.reduced_measures import Derived, derived, instants_of
from mbody.errors import ModelError, SolveError, brief
from mbody.model.element import listed, takes_one_design
from mbody.model.loads import PistonPressure, ReciprocatingCylinder
from mbody.model.mechanism import Mechanism
from mbody.model.simulation import Measure
from mbody.quantities.units import DIMENSIONS
from mbody.solution.declared_result import ColumnTable, Sentence, Value
from mbody.solution.doubts import Inherited, inherited
from mbody.solution.histories import link_poses
from mbody.solution.solution import Solution
from mbody.sweeps.job import MeasuredColumn, Measures, columns_of
from mbody.system.system import System, lock

# -- Measured quantities with their derivatives ------------------------------------------------


@dataclass(frozen=True)
class EventGradient:
    """When something happens in a motion, an `EventRecord`, with derivatives.

    `name`, `contact`: As of the record.
    `by`: Derivatives of the time by number; NaN where there is none.
    """

    name: str
    contact: str
    t: float
    by: dict[str, float]


@dataclass(frozen=True, eq=False, repr=False)
class Gradient(Inherited):
    """Measured quantities with their derivatives.

    `value`: By measure: a float, or an array (instants,).
    `by`: The numbers.
    `jacobian` (measures, numbers), or (measures, instants, numbers): Derivatives in the units of
      the mechanism and of the measures; NaN where redundant loops do not close with another number,
      and at instants without forces or with limits, which a note says.
    `units`: By measure, then by number: the unit of the derivative.
    `at`: By measure the time of the instant that was taken, of a greatest or least value and of one
      instant; None where all instants count.
    `measured`: By measure its unit.
    `events`: Of a motion over time: when what happens in it does.
    `status`, `doubts`: Of the result.
    `notes`: Where there is no derivative, measures that no number changes or that are made of
      forces which are not unique, and the doubts.
    """

    value: dict[str, Any]
    by: tuple[str, ...]
    jacobian: np.ndarray
    units: dict[str, dict[str, str]]
    at: dict[str, float | None]
    measured: dict[str, str]
    events: tuple[EventGradient, ...] = ()
    _rows: dict[str, int] = field(default_factory=dict)

    def __post_init__(self) -> None:
        object.__setattr__(self, "_rows", {name: n for n, name in enumerate(self.value)})
        lock(self)

    def __getitem__(self, measure: str) -> dict[str, Any]:
        """The derivatives of one measure by name: floats, or arrays (instants,)."""
        if measure not in self._rows:
            raise ModelError(
                f"there is no measure {measure!r} here (there are: {listed(self.value)})",
                str(measure),
            )
        row = self.jacobian[self._rows[measure]]
        parts = row if row.ndim == 1 else row.T
        whole = (float(part) if row.ndim == 1 else part for part in parts)
        return dict(zip(self.by, whole, strict=True))

    def __repr__(self) -> str:
        shape = " × ".join(str(size) for size in self.jacobian.shape)
        return f"Gradient({listed(self.value)} by {len(self.by)} numbers: {shape})"


def per(unit: str, by: str) -> str:
    """Unit of a quotient."""
    if not by:
        return unit
    below = f"({by})" if any(letter in by for letter in "·/ ") else by
    return f"{unit or '1'}/{below}"


# -- Derivatives of a motion beside differences, where what jumps on the way cannot be seen ----
# Users' functions, valves and pressures by tables may jump anywhere. Along one direction in all the
# numbers the derivatives are compared with differences of motions at four places.

Array = np.ndarray


def may_jump_unseen(system: System) -> list[str]:
    """Elements that may jump where nothing shows it."""
    own = [name for name, function in system.functions if function is not None]
    valves = (ReciprocatingCylinder, PistonPressure)
    own += [load.name for load in system.mechanism.loads if isinstance(load, valves)]
    own += [one.name for one in system.mechanism.controllers]
    return list(dict.fromkeys(own))


def compared_with_differences(
    found: Gradient,
    system: System,
    by: Sequence[str],
    columns: Sequence[MeasuredColumn],
    run_of: Callable[[System, float], Solution],
    rtol: float,
) -> Gradient:
    """The gradient; NaN, and a note, of measures that change otherwise.

    by: dotted names, in the order of the gradient; run_of: the motion of a system with an rtol.
    """
    fine = max(tol.DERIVATIVE_MOTION_FINER * rtol, tol.DERIVATIVE_MOTION_FINEST)
    sizes = np.array([name in system.values for name in by]) * number_sizes(system, by)
    sizes[np.isnan(found.jacobian).any(axis=tuple(range(found.jacobian.ndim - 1)))] = 0.0
    # both signs, so that numbers that act alike do not always act together
    change = tol.DIFFERENCE_STEP_NUMBERS * sizes * np.where(np.arange(len(by)) % 2, -0.7, 1.0)
    if not change.any():
        return found
    names = listed(may_jump_unseen(system))
    try:
        ends = [
            _measured(system, by, k * change, columns, lambda other: run_of(other, fine))
            for k in (-2, -1, 1, 2)
        ]
    except (ModelError, SolveError):
        note = f"{names} may jump on the way, which differences of motions could not rule out"
        return replace(found, notes=(*found.notes, note))
    jacobian, notes = found.jacobian.copy(), list(found.notes)
    for k, column in enumerate(columns):
        low, down, up, most = (np.asarray(one[k]) for one in ends)
        wide, narrow = 0.5 * (most - low), up - down
        rows = np.nan_to_num(jacobian[k])
        difference = np.abs(2.0 * rows @ change - narrow)
        scale = 2.0 * np.abs(rows * change).sum(axis=-1)
        limit = tol.DERIVATIVE_ALLOWED * np.maximum(
            scale, np.abs(narrow)
        ) + tol.DERIVATIVE_BANDS * np.abs(wide - narrow)
        # below the noise of the motions nothing can be said
        noise = (
            tol.DERIVATIVE_ERRORS
            * fine
            * np.abs(np.asarray(found.value[column.name])).max(initial=0.0)
        )
        if (difference > np.maximum(limit, noise)).any():
            jacobian[k] = np.nan
            notes.append(
                f"'{column.name}' has no derivative: differences of motions are others, as "
                f"{names} jump on the way, or change fast"
            )
    return replace(found, jacobian=jacobian, notes=tuple(notes))


def _measured(
    system: System,
    by: Sequence[str],
    change: Array,
    columns: Sequence[MeasuredColumn],
    run_of: Callable[[System], Solution],
) -> list[Array]:
    moved = {
        name: float(system.values[name]) + float(more)
        for name, more in zip(by, change, strict=True)
        if more
    }
    run = run_of(system.with_values(moved))
    return [np.asarray(instants_of(run, column).value) for column in columns]


# -- Derivatives of small vibrations: frequencies, damping, shapes, stiffnesses ----------------
# A root s of (s² M + s C + K) u = 0 with the left vector w, wᵀ (s² M + s C + K) = 0, has
#
#     ds/dp = −wᵀ (s² M′ + s C′ + K′) u / (wᵀ (2 s M + C) u),
#
# where it is simple. Its shape moves by du, of which a multiple of u has no say in ratios:
#
#     (s² M + s C + K) du + (2 s M + C) u ds = −(s² M′ + s C′ + K′) u dp,   ūᵀ du = 0.
#
# M′, C′ and K′, and those of the motions T of coordinates with the leaders, are differences over
# four places, at each of which the equilibrium is found once more. The amplitude of an angle, or
# of x or y of a point, is a = T u, and a ratio a/b has the size |a/b| and the phase arg(a/b).
#
# F. Tisseur, K. Meerbergen: The quadratic eigenvalue problem, SIAM Review 43 (2001), 2.3 and 4.2.

#: Newton steps to the equilibrium beside, at most.
STEPS = 12
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
class _ModalMeasure:
    """One measure: of mode `number`, or the stiffness between two leaders; of a shape the
    amplitudes of two places.
    """

    name: str
    kind: str
    number: int = 0
    leaders: tuple[int, int] = (0, 0)
    places: tuple[ModePlace, ...] = ()


def mode_gradient(balanced: Equilibrium, measure: Any, by: Mapping[str, str]) -> Gradient:
    """Derivatives of measures of the modes at an equilibrium by numbers, names by those given."""
    names = list(by.values())
    equilibrium = _PerturbedEquilibrium(balanced, names)
    linear = linearize(equilibrium.instants.driven, at=equilibrium.run, free=equilibrium.drivers)
    (found,) = modes(equilibrium.instants.driven, at=equilibrium.run, free=equilibrium.drivers)
    wanted = _wanted(measure, linear, len(found))
    places = list(dict.fromkeys(place for one in wanted for place in one.places))
    sizes = natural_sizes(equilibrium.instants.driven, names)
    jacobian, notes = np.zeros((len(wanted), len(names))), list[str]()
    for k, name in enumerate(names):
        changes, why = None, "the rest position beside it is not found, or other bodies lead there"
        try:
            changes = equilibrium.changes(
                name, tol.DIFFERENCE_STEP_FOURTH_ORDER * sizes[k], linear, places
            )
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
                motions = [changes[3][places.index(place)] for place in one.places]
                jacobian[row, k] = _of_shape(found[one.number], linear, changes, motions, one)
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
    units = {given: unit_of(balanced.solution.mechanism, name) for given, name in by.items()}
    unit_by_name = {one.name: _unit(one, linear) for one in wanted}
    return Gradient(
        value={one.name: _value(one, linear, found) for one in wanted},
        by=tuple(by),
        jacobian=jacobian,
        units={
            one: {n: per(unit_by_name[one], unit) for n, unit in units.items()}
            for one in unit_by_name
        },
        at=dict.fromkeys(unit_by_name),
        measured=unit_by_name,
        **inherited(found, notes=notes),
    )


class _PerturbedEquilibrium:
    """The linear equations at one equilibrium, and at that of other numbers beside it."""

    def __init__(self, balanced: Equilibrium, names: Sequence[str]) -> None:
        self.instants = EquilibriumInstants(balanced, names)
        self.drivers = self.instants.drivers
        self.laws = [f"{name}.law.value" for name in self.drivers]
        self.run = self.instants.run
        self.poses = link_poses(balanced.solution)
        driven = self.instants.driven
        scales = [driven.length if motion.turns else 1.0 for motion in balanced.motions]
        self.unit = driven.length / np.array(scales)

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
            if np.abs(step / self.unit).max() <= tol.EQUILIBRIUM_LAST_STEP:
                break
        else:
            return None
        return linearize(system, at=self.run, free=self.drivers)

    def changes(
        self, name: str, step: float, linear: Linearization, places: Sequence[ModePlace]
    ) -> list[Array] | None:
        """Derivatives of M, C, K and the motions of places (places, free) by a number; None where
        what is beside it does not compare.
        """
        value, ends = float(self.instants.driven.values[name]), []
        for k in (-2, -1, 1, 2):
            one = self.linear({name: value + k * step})
            if one is None or one.leaders != linear.leaders:
                return None
            ends.append((one.mass, one.damping, one.stiffness, _motions_of(one, places)))
        return [
            (8.0 * (up - down) - (most - low)) / (12.0 * step)
            for low, down, up, most in zip(*ends, strict=True)
        ]


def _motions_of(linear: Linearization, places: Sequence[ModePlace]) -> Array:
    """Rates of coordinates for unit rates of the leading bodies, (places, free)."""
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
    if s == 0.0 or not abs(below) > tol.DERIVATIVE_ROOT_SIMPLE * size:
        return None
    sizes = np.linalg.svd(s * s * M + s * C + K, compute_uv=False)
    return (
        None if len(sizes) > 1 and not sizes[-2] > tol.DERIVATIVE_ROOT_SIMPLE * sizes[0] else left
    )


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
    motions: Sequence[Array],
    one: _ModalMeasure,
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
        u @ change + du @ motion
        for change, motion in zip(motions, _motions_of(linear, one.places), strict=True)
    ]
    relative = more[0] / a - more[1] / b
    return float(relative.imag if one.kind == "phase" else abs(a / b) * relative.real)


def _amplitude(mode: Mode, linear: Linearization, place: ModePlace) -> complex:
    """The amplitude of a place; what is rounding is zero."""
    (motions,) = _motions_of(linear, [place])
    found = complex(mode.amplitudes @ motions)
    # lengths by those of the parts, so that no unit has a say in what is zero
    unit = linear.solution.system.coordinate_units.reshape(-1, 3)
    size = float(np.abs(mode.amplitudes) @ np.abs(linear.rates / unit).max(axis=(1, 2)))
    size *= unit[linear.solution.system.bodies[place.body], place.key]
    return found if abs(found) > tol.DERIVATIVE_ROOT_SIMPLE * size else 0.0


def _wanted(measure: Any, linear: Linearization, count: int) -> list[_ModalMeasure]:
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
            found.append(_ModalMeasure(name, one[1], int(one[2]) - 1, places=places))
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
        found.append(_ModalMeasure(name, "stiffness", leaders=both))
    return found


def _value(one: _ModalMeasure, linear: Linearization, found: Any) -> float:
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


def _unit(one: _ModalMeasure, linear: Linearization) -> str:
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


#: The analysis of motions over time.
MOTION = "simulate"
#: That of equilibria.
EQUILIBRIUM = "equilibrium"
#: That of small motions about them.
SMALL = "modes"


def gradient(
    model: Mechanism | System,
    measure: Measures | None = None,
    by: Sequence[str] | str | None = None,
    analysis: str = "kinetostatics",
    **options: Any,
) -> Gradient:
    """Exact derivatives of measured quantities by numbers of the description.

    Parameters
    ----------
    model : Mechanism or System
        Of one design.
    measure : str, Measure, list or dict of them
        As of `sweep`: formulas of histories such as ``"A.force"``, or measures of the mechanism by
        name; in ``peak(…)``, ``max(…)``, ``min(…)``, ``rms(…)``, ``mean(…)``, ``integral(…)``,
        ``first(…)``, ``last(…)`` or ``at(…, instant)`` the instants become one number. By default
        the measures of the mechanism.
    by : list of str, optional
        Dotted names of numbers (``"crank.A.x"``, ``"coupler.mass"``, ``"motor.law.speed"``) and
        parameters; by default all that have no formula.
    analysis : str
        "kinetostatics", "kinematics", "statics", "simulate", "equilibrium" or "modes".
    **options
        The instants: ``t``, ``drive``, ``turn``, ``instants``, ``guess`` as of the analysis, or
        ``at``, ``over`` as of `Instants`; by default those of the mechanism itself. Of "simulate"
        its own: ``until``, ``start``, ``rtol``, ``instants``, ``times`` and others; of
        "equilibrium" ``position``, the number of the equilibrium, 0 by default, ``free``,
        ``starts`` and ``t``, as of "modes". Measures of "modes" are ``frequency(1)``,
        ``natural_frequency(1)``, ``hertz(1)``, ``damping_ratio(1)`` and ``decay_rate(1)`` of a mode
        of that position, slow ones first, ``ratio(1, rod.x, bar.angle)`` and ``phase(…)`` of two
        amplitudes of a mode, and ``stiffness(crank)`` or ``stiffness(crank, arm)`` of what leads
        free motions.

    Returns
    -------
    Gradient
        Values and derivatives by name, with units; notes where there is no derivative.

    Raises
    ------
    ModelError
        For a number that there is not, or that a formula makes of others; for measures of which
        some are histories and others are not; for a batch; for a motion whose
        beginning follows from guesses.
    SolveError
        As of the analysis; where redundant loops do not close with other numbers.

    Notes
    -----
    The equations of the analysis are solved once more in dual numbers, which carry derivatives
    through every operation: no differences are taken, so there is no step to choose. Only users'
    own functions, controllers that take plain floats only and the matrices of small motions are
    differenced, which a note says. A motion
    over time is integrated once more together with the variational equations, at the same rtol; its
    instants are held, and so is what ``start`` says. Where contacts, friction, events and jumps of
    formulas change it the saltation matrix is applied;
    NaN and a note where that has no derivative. An equilibrium moves by the implicit function
    theorem. Where the description prescribes the beginning,
    ``"start.crank.angle"`` and others are numbers too. The derivative of a greatest value is that
    at its instant (envelope theorem); where two instants share the greatest value a note says so.
    The model length, by which errors are made dimensionless, is held.

    Source: A. Griewank and A. Walther, *Evaluating Derivatives*, SIAM 2008, chapter 3 (forward
    mode), chapter 15 (implicit functions); R. Leine and H. Nijmeijer, *Dynamics and Bifurcations of
    Non-Smooth Mechanical Systems*, 2004, 7 (saltation).

    Examples
    --------
    >>> import mbody
    >>> machine = mbody.gallery.load("norton_fourbar")
    >>> g = mbody.gradient(machine, {"pin": "peak(A.force)"}, ["crank.A.x"], turn="motor")
    >>> round(g.value["pin"], 4), round(g["pin"]["crank.A.x"], 4), g.units["pin"]["crank.A.x"]
    (169.5305, 187.5089, 'lbf/in')
    """
    system = as_system(model)
    takes_one_design("gradient", system.batch)
    if analysis == MOTION:
        return _of_motion(system, measure, by, options)
    if analysis == EQUILIBRIUM:
        return _of_equilibrium(system, measure, by, options)
    if analysis == SMALL:
        return mode_gradient(_equilibrium(system, options), measure, checked_names(system, by))
    wanted = requested_instants(system, analysis, options, "gradient", [MOTION, EQUILIBRIUM, SMALL])
    checked_names(system, by)
    columns_of(system.mechanism, measure, "gradient")
    return gradient_at(wanted.analysed(system), measure, by, wanted.revolving)


def _of_motion(
    system: System,
    measure: Measures | None,
    by: Sequence[str] | str | None,
    options: Mapping[str, Any],
) -> Gradient:
    """The gradient of a motion over time."""
    given = options.get("start") is not None
    names = checked_names(system, by, starts=not given)
    columns = columns_of(system.mechanism, measure, "gradient")
    for name in ("guess", "rates"):
        if options.get(name) is not None:
            raise ModelError(
                f"gradient: derivatives of a motion with {name} are not there: prescribe the start "
                "in the simulation of the mechanism, or give start, a result"
            )
    system = with_formulas_of_the_instant(system)
    run = simulate(system, **options)
    instants = motion_instants(run, list(names.values()), given)
    found = gradient_of(run, columns, names, instants=instants)
    if not may_jump_unseen(system):
        return found
    return compared_with_differences(
        found,
        system,
        list(names.values()),
        columns,
        lambda other, rtol: simulate(other, **{**options, "rtol": rtol}),
        run.initial_states[0].request.settings.rtol,
    )


def _of_equilibrium(
    system: System,
    measure: Measures | None,
    by: Sequence[str] | str | None,
    options: Mapping[str, Any],
) -> Gradient:
    """The gradient of an equilibrium."""
    names = checked_names(system, by)
    columns = columns_of(system.mechanism, measure, "gradient")
    balanced = _equilibrium(system, options)
    return gradient_of(
        balanced.solution, columns, names, instants=EquilibriumInstants(balanced, names.values())
    )


def _equilibrium(system: System, options: Mapping[str, Any]) -> Equilibrium:
    """One equilibrium, number `position` of them."""
    found = equilibrium(system, **{name: x for name, x in options.items() if name != "position"})
    which = options.get("position", 0)
    if not isinstance(which, int) or not -len(found) <= which < len(found):
        raise ModelError(
            f"gradient: there is no rest position {brief(which)} of '{system.mechanism.name}', "
            f"they are 0 to {len(found) - 1}"
        )
    if len(system.layout.friction_kind):
        raise ModelError(
            f"gradient: '{system.mechanism.name}' rests by friction, at any place of a band: there "
            "is no one position to be differentiated; leave out the friction"
        )
    return found[which]


def gradient_at(
    run: Solution, measure: Measures | None, by: Sequence[str] | str | None, turn: Any = ""
) -> Gradient:
    """The gradient of measures of a result; `turn` as of the analysis, or of `Instants.over`."""
    names = checked_names(run.system, by)
    columns = columns_of(run.mechanism, measure, "gradient")
    return gradient_of(run, columns, names, revolving_driver(run.system, turn))


def gradient_of(
    run: Solution,
    columns: Iterable[MeasuredColumn],
    by: Mapping[str, str],
    revolving: str = "",
    instants: DrivenInstants | MotionInstants | EquilibriumInstants | None = None,
) -> Gradient:
    """Derivatives of the measures `columns` of a result by numbers, as `checked_names` has them;
    `instants`: by default those of a driven motion.
    """
    columns, names = tuple(columns), list(by.values())
    histories = [one.name for one in columns if not one.by and len(run.t) > 1]
    if histories and len(histories) < len(columns):
        reduced = next(one.name for one in columns if one.by)
        raise ModelError(
            f"gradient: '{histories[0]}' is a history of {len(run.t)} instants, '{reduced}' one "
            "number: give each a reduction such as peak(…) or mean(…), or none"
        )
    if instants is None:
        instants = DrivenInstants(run, names, revolving)
    choices = [instants_of(run, one) for one in columns]
    needed = np.unique(np.concatenate([choice.needed for choice in choices]))
    whole = instants.at(needed, any(choice.loads for choice in choices))
    found = {
        column.name: derived(whole, needed, column, choice)
        for column, choice in zip(columns, choices, strict=True)
    }
    record: Any = whole.record
    lost = needed[instants.without_derivative(needed, record)]
    found |= {
        column.name: _where_there_is_one(run, column, found[column.name], choice.needed, lost)
        for column, choice in zip(columns, choices, strict=True)
    }
    notes = [note for one in found.values() for note in one.notes]
    notes += _without_rounding(run.system, names, found)
    notes += _differenced(run.system)
    notes += _without(run, by, instants.unclosed, found)
    notes += instants.notes
    units = {name: unit_of(run.mechanism, number) for name, number in by.items()}
    return Gradient(
        value={name: one.value for name, one in found.items()},
        by=tuple(by),
        jacobian=np.array([one.row for one in found.values()]),
        units={
            name: {number: per(one.unit, unit) for number, unit in units.items()}
            for name, one in found.items()
        },
        at={name: one.at for name, one in found.items()},
        measured={name: one.unit for name, one in found.items()},
        events=tuple(
            EventGradient(
                one.name, one.contact, one.t, dict(zip(by, one.row.tolist(), strict=True))
            )
            for one in instants.events
        ),
        **inherited(run, of=columns, notes=notes),
    )


def _without_rounding(system: System, names: Sequence[str], found: dict[str, Derived]) -> list[str]:
    """Make the row of a measure that none of the numbers changes zero; a note of each."""
    still = [
        name
        for name, one in found.items()
        if not np.isnan(one.row).any()
        and not influential(system, names, np.asarray(one.value), one.row).any()
    ]
    for name in still:
        found[name] = replace(found[name], row=0.0 * found[name].row)
    return [f"none of the numbers changes '{name}': its row is zero" for name in still]


def _differenced(system: System) -> list[str]:
    """A note where users' own functions are differenced."""
    own = dict.fromkeys(name for name, function in system.functions if function is not None)
    if not own:
        return []
    return [
        f"functions of your own, of {listed(own)}, are differenced: derivatives through them have "
        "some 9 figures"
    ]


def _where_there_is_one(
    run: Solution, column: MeasuredColumn, one: Derived, needed: np.ndarray, lost: np.ndarray
) -> Derived:
    """A measure, its derivatives NaN where an instant that it is taken from has none."""
    single = one.at is not None
    gone = np.isin(needed[:1] if single else needed, lost)
    if not gone.any():
        return one
    k = int(needed[int(gone.argmax())])
    history = one.row.ndim == 2
    row = np.where(gone[:, None] if history else gone.any(), np.nan, one.row)
    when = f"{float(run.t[k]):.6g} {run.mechanism.units.time}"
    said = f"'{column.name}' has no derivative at t = {when}: the result has no "
    said += "forces there, or a limit, as at a change point; take other instants"
    return replace(one, row=row, notes=(said,) if single else (*one.notes, said))


def _without(
    run: Solution, by: Mapping[str, str], unclosed: set[str], found: dict[str, Derived]
) -> list[str]:
    """Leave numbers out with which redundant loops do not close; refuse to where all are such."""
    gone = [name for name, number in by.items() if number in unclosed]
    if not gone:
        return []
    sentence = (
        f"'{run.mechanism.name}' closes redundant loops, or has wheels that fit, only with the "
        f"numbers that it has of {listed(gone)}: there is no derivative by one of them alone; vary "
        "those that fit together by a parameter"
    )
    if len(gone) == len(by):
        raise SolveError(sentence, gone[0])
    places = [n for n, name in enumerate(by) if name in gone]
    for name, one in found.items():
        row = one.row.copy()
        row[..., places] = np.nan
        found[name] = replace(one, row=row)
    return [sentence]


# -- Sensitivities: numbers by their effect on a measured quantity -----------------------------


def _part(found: Sensitivity, key: str) -> dict[str, Any]:
    """One part of all derivatives."""
    return {name: row[key] for name, row in found.by.items()}


@dataclass(frozen=True)
class Sensitivity(Inherited, Presented):
    """Derivatives of one measured quantity, those of most weight first.

    `by`: By number: ``{"derivative", "unit", "relative"}``, the last in per cent per per cent, None
      where the number or the quantity is zero.
    `numbers`, `number_units`: The present values of the numbers.
    `at`: Time of the instant that was taken; None where all count.
    `status`, `doubts`, `notes`: Of the result, and where there is no derivative.
    """

    model: str
    measure: str
    unit: str
    value: float
    by: dict[str, dict[str, Any]]
    numbers: dict[str, float]
    number_units: dict[str, str]
    at: float | None
    time_unit: str

    declared = (
        "measure value unit by at",
        Sentence(
            lambda found: (
                f"{found.measure} = {found.value:.6g} {found.unit}".rstrip()
                + ("" if found.at is None else f" at t = {found.at:.6g} {found.time_unit}")
            )
        ),
        ColumnTable(
            (
                Value("", "value", "each", "numbers"),
                Value("", "unit", "text", "number_units"),
                Value("", "derivative", "each", lambda found: _part(found, "derivative")),
                Value("", "unit", "text", lambda found: _part(found, "unit")),
                Value("", "% per %", "", lambda found: _part(found, "relative")),
            ),
            "NUMBERS",
        ),
    )


def sensitivity(
    run: Solution, measure: str | Measure, by: Sequence[str] | None = None
) -> Sensitivity:
    """The table of one measured quantity of a result; see `Solution.sensitivity`.

    >>> import mbody
    >>> run = mbody.kinetostatics(mbody.gallery.load("norton_fourbar"))
    >>> found = run.sensitivity("A.force", ["crank.A.x", "coupler.weight"])
    >>> list(found.by)
    ['crank.A.x', 'coupler.weight']
    """
    if run.analysis not in ANALYSES:
        raise ModelError(
            f"sensitivity is of kinematics, kinetostatics and statics, not of {run.analysis}"
        )
    if run.record.batch:
        raise ModelError("sensitivity is of one design: analyse one of the batch, system.design(n)")
    columns = columns_of(run.mechanism, [measure], "sensitivity")
    names = checked_names(run.system, by, "sensitivity")
    return sensitivity_of(run, gradient_of(run, columns, names), names, by is None)


def sensitivity_of(
    run: Solution, found: Gradient, by: Mapping[str, str], only_those_that_count: bool
) -> Sensitivity:
    """The table of the one measure of a gradient; without rows of zeros where it `only` has those
    that count.
    """
    ((measure, value),) = found.value.items()
    if np.size(value) > 1:
        raise ModelError(
            f"sensitivity: '{measure}' is a history of {len(run.t)} instants: say how it becomes "
            f"one number, such as peak({measure})"
        )
    rows: dict[str, dict[str, Any]] = {}
    numbers, number_units, units = dict[str, float](), dict[str, str](), run.mechanism.data_units
    row = found.jacobian[0]
    counts = influential(run.system, list(by.values()), np.asarray(value), row)
    for (name, derivative), count in zip(found[measure].items(), counts, strict=True):
        if math.isnan(derivative) or (only_those_that_count and not count):
            continue
        own = float(run.system.values[by[name]])
        relative = derivative * own / value if own and value else None
        dimension = dimension_of_number(run.mechanism, by[name])
        size, number_units[name] = units.size(dimension), units.of(dimension)
        numbers[name] = float(units.converted(own, dimension))
        unit = per(found.measured[measure], number_units[name])
        rows[name] = {"derivative": derivative * size, "unit": unit, "relative": relative}
    order = sorted(rows, key=lambda name: _weight(rows[name]), reverse=True)
    return Sensitivity(
        model=run.mechanism.name,
        measure=measure,
        unit=found.measured[measure],
        value=value,
        by={name: rows[name] for name in order},
        numbers={name: numbers[name] for name in order},
        number_units={name: number_units[name] for name in order},
        at=found.at[measure],
        time_unit=run.mechanism.units.time,
        **inherited(found, notes=found.notes),
    )


def _weight(row: dict[str, Any]) -> float:
    relative = row["relative"]
    return -1.0 if relative is None or math.isnan(relative) else abs(relative)
