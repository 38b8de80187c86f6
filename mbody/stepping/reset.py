"""States that a user sets: the nearest one that joints and drivers allow, and how far it is."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from mbody.analysis.freedom.free_motions import free_motions
from mbody.analysis.initial.initial_positions import fitted_places
from mbody.analysis.initial.initial_velocities import branch_rates, nearest_rates
from mbody.analysis.position.assembly_analysis import closed, raise_user_error
from mbody.analysis.singular.branches import BESIDE
from mbody.analysis.singular.prescribed_values import Prescribed
from mbody.analysis.singular.singular_positions import SUSPECT, singular
from mbody.errors import ModelError, SolveError, brief
from mbody.kernels.layout import Work
from mbody.kernels.loop_closure import laws_of_time
from mbody.model.element import listed
from mbody.model.numbers import number_in
from mbody.model.simulation import STATE
from mbody.system.rank import dense, rank_of, too_large
from mbody.system.system import System

__all__ = ["Nearest", "nearest_state", "prescribed_values"]

Array = np.ndarray

#: Places and angles, all others being rates.
PLACES = ("x", "y", "angle")
#: Steps, in model lengths and radians, by which a position is led from where it is to where it
#: shall be, so that it stays on its branch.
LED = 0.2
#: What differs by less, as a part of one model length or radian, or of the fastest rate, is met.
MET = 1e-9
#: What is given leaves a leader free where its row has this part that is independent.
FREE = 1e-3
#: Values that a sentence names.
NAMED = 3


@dataclass(frozen=True, eq=False)
class Nearest:
    """A state that joints and drivers allow.

    Attributes
    ----------
    q, v : arrays (coordinates,)
    far : float
        The greatest difference of a place from what it was to be, in model lengths and radians.
    notes : tuple of str
        What is not as it was to be.
    regularization : float
        Of redundant rows; zero where there are none.
    """

    q: Array
    v: Array
    far: float
    notes: tuple[str, ...]
    regularization: float


def prescribed_values(system: System, given: Any) -> list[Prescribed]:
    """Values by name, ``{"crank": {"angle": 0.5}}`` or ``{"crank.angle": 0.5}``, as numbers.

    Raises
    ------
    ModelError
        For a name that there is not, and what is no number.
    """
    example = '{"crank": {"angle": 0.5, "omega": 2.0}}'
    if not isinstance(given, Mapping):
        raise ModelError(
            f"reset takes a state, or positions and rates by name such as {example}, not "
            f"{brief(given)}"
        )
    found = []
    for name, value in given.items():
        body, parts = name, value
        if isinstance(name, str) and not isinstance(value, Mapping):
            body, _, key = name.rpartition(".")
            parts = {key: value}
        if not isinstance(parts, Mapping) or body not in system.bodies or body == "ground":
            known = listed(one.name for one in system.mechanism.bodies)
            raise ModelError(
                f"reset: there is no body {brief(body or name)} (there are: {known}); give "
                f"positions and rates by name, such as {example}",
                str(body or name),
            )
        for key, one in parts.items():
            if key not in STATE:
                raise ModelError(
                    f"reset: '{body}' has no {key!r} to set (it has: {', '.join(STATE)})", body
                )
            number = number_in(system.mechanism, one, STATE[key], "reset", f"{body}.{key}")
            found.append(Prescribed(body, key, number))
    return found


def nearest_state(system: System, t: float, base: Array, given: Sequence[Prescribed]) -> Nearest:
    """The state nearest to prescribed values. Leaders of free motions that these leave free stay
    where they are in the position `base` (coordinates,), and rest; all else follows.

    Raises
    ------
    ModelError
        For a mechanism too large for dense matrices.
    SolveError
        Where the loops do not close near it, or no velocities agree.
    """
    if too_large(system):
        raise ModelError(
            f"reset: '{system.mechanism.name}' has {system.rows} rows, too many for positions by "
            "name: set a state that a simulator had"
        )
    places = [one for one in given if one.key in PLACES]
    rates = [one for one in given if one.key not in PLACES]
    work = system.work()
    work.time[:] = t
    laws_of_time(system.runtime(), work)
    raise_user_error(system)
    work.q[: system.coordinates, 0] = base
    kept = _kept(system, work, base, places, rates=False)
    q, off = _led(system, work, t, base, (*places, *kept))
    off = off[: len(places)]
    start = closed(system, t, {}, pose=np.append(q, np.zeros(3)))
    q = start.work.q[: system.coordinates, 0].copy()
    here = None
    if start.regularization or start.ratio < SUSPECT:
        own = system.work()
        own.q[:], own.signal[:], own.time[:] = start.work.q, start.work.signal, start.work.time
        here = singular(system, own, t, BESIDE)
    notes: tuple[str, ...] = ()
    if here is None:
        still = _kept(system, start.work, q, rates, rates=True)
        near = nearest_rates(system, start.work, (*rates, *still))
        v = system.coordinate_units * near.v
        lacking, fast = (near.met - near.given.p)[: len(rates)], near.fast
    else:
        v, notes = branch_rates(system, here, t, q, rates)
        lacking, fast = np.zeros(len(rates)), 1.0
    wrong = [(one, -part) for one, part in zip(places, off, strict=True) if abs(part) > MET]
    wrong += [
        (one, part) for one, part in zip(rates, lacking, strict=True) if abs(part) > MET * fast
    ]
    if wrong:
        notes = (*notes, _sentence(system, wrong))
    return Nearest(
        q, v, float(np.abs(off).max(initial=0.0)), (*start.notes, *notes), start.regularization
    )


def _kept(
    system: System, work: Work, q: Array, given: Sequence[Prescribed], *, rates: bool
) -> list[Prescribed]:
    """What leaders of free motions keep, their places or rates of zero: those that what is given
    leaves free.
    """
    own = rank_of(dense(system, work)[1]).motions
    found: list[Prescribed] = []
    rows = np.array([one.row(system, q) for one in given]).reshape(-1, system.coordinates) @ own.T
    free = free_motions(system, np.append(q, np.zeros(3)), own) if len(own) else ()
    for motion in free:
        vx, vy, _ = motion.rates[motion.leader]
        place, rate = "angle", "omega"
        if not motion.turns:
            place, rate = ("x", "vx") if abs(vx) >= abs(vy) else ("y", "vy")
        one = Prescribed(motion.leader, rate if rates else place, 0.0)
        if not rates:
            one = replace(one, value=one.at(system, q) * one.unit(system))
        row = one.row(system, q) @ own.T
        left = row if not len(rows) else row - np.linalg.lstsq(rows.T, row, rcond=1e-9)[0] @ rows
        if np.abs(left).max() > FREE * np.abs(row).max():
            found.append(one)
            rows = np.vstack([rows, row])
    return found


def _led(
    system: System, work: Work, t: float, base: Array, places: Sequence[Prescribed]
) -> tuple[Array, Array]:
    """The position, and how far places are from what they were to be: it is led there from `base`
    so that it stays on its branch.
    """
    q, ground = base, np.zeros(3)
    starts = [one.at(system, q) * one.unit(system) for one in places]
    ways = [one.value - start for one, start in zip(places, starts, strict=True)]
    sizes = (abs(way) / one.unit(system) for one, way in zip(places, ways, strict=True))
    count, off = max(1, math.ceil(max(sizes, default=0.0) / LED)), np.zeros(len(places))
    for n in range(1, count + 1):
        spots = [
            Prescribed(one.body, one.key, one.value if n == count else start + n / count * way)
            for one, start, way in zip(places, starts, ways, strict=True)
        ]
        found = fitted_places(system, work, spots, np.append(q, ground))
        if found is None:
            shown = ", ".join(one.with_value(system, one.value) for one in places[:NAMED])
            unit = system.mechanism.units.time
            raise SolveError(
                f"reset: the loops of '{system.mechanism.name}' do not close near {shown or 'it'} "
                f"at t = {t:.6g} {unit}: give values that its joints allow",
                places[0].body if places else None,
            )
        q, off = found.q[: system.coordinates], found.off
    return q, off


def _sentence(system: System, wrong: Sequence[tuple[Prescribed, float]]) -> str:
    """What is not as it was to be, in the units of the user."""
    shown = [
        f"{one.with_value(system, one.value + part * one.unit(system))}, not "
        f"{one.with_value(system, one.value).partition(' = ')[2]}"
        for one, part in wrong[:NAMED]
    ]
    more = f", and {len(wrong) - NAMED} more" if len(wrong) > NAMED else ""
    return (
        f"the reset does not fit joints and drivers: the nearest state that fits was taken, with "
        f"{'; '.join(shown)}{more}"
    )
