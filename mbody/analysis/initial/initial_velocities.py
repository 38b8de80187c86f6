"""First velocities by rates that are prescribed: rates that fit joints and drivers, and belong to a
branch of the motion where the position is singular.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mbody.analysis.initial.unsaid_rates import unsaid_rates
from mbody.analysis.singular.branch_sentences import (
    nearest_words,
    place_words,
    undecided,
    values_of,
)
from mbody.analysis.singular.branches import SAID, along, fits, frame, nearest, norm, onto
from mbody.analysis.singular.prescribed_values import Prescribed
from mbody.analysis.singular.quadratic_cones import is_flat, solutions, tangent
from mbody.analysis.singular.singular_positions import Singular
from mbody.errors import SolveError
from mbody.kernels.layout import Work
from mbody.model.element import listed
from mbody.system.rank import dense, dense_rates, shortest
from mbody.system.system import System

__all__ = ["branch_rates", "fitting_rates", "nearest_rates", "no_velocities"]

Array = np.ndarray

#: A singular value below this part of the greatest is zero.
ZERO = 1e-9
#: What agrees, and what differs by rounding of four digits, as parts of the fastest rate.
AGREES, ROUNDED = 1e-9, 1e-3
#: A row takes part in a contradiction with this part of the greatest; elements that are named.
TAKES_PART, NAMED = 0.1, 4


@dataclass(frozen=True, eq=False)
class Rates:
    """Prescribed rates, as conditions P v = p on velocities without units of length."""

    prescribed: Sequence[Prescribed]
    P: Array
    p: Array

    def without(self, n: int) -> Rates:
        """All but one."""
        left = [k for k in range(len(self.p)) if k != n]
        return Rates([self.prescribed[k] for k in left], self.P[left], self.p[left])


@dataclass(frozen=True, eq=False)
class NearestRates:
    """Velocities that are as near to rates as joints and drivers allow, without units of length.

    Attributes
    ----------
    v : array (coordinates,)
    given : Rates
    met : array (rates,)
        What the rates are; those that are given, where all agree.
    rows : array (rows,)
        What the rates as they are given leave of the rows; zero where all agree.
    fast : float
        The fastest rate.
    """

    v: Array
    given: Rates
    met: Array
    rows: Array
    fast: float


def rates_of(system: System, q: Array, prescribed: Sequence[Prescribed]) -> Rates:
    """Conditions of what is prescribed, at a position (coordinates,)."""
    P, p = np.zeros((len(prescribed), system.coordinates)), np.zeros(len(prescribed))
    for n, rate in enumerate(prescribed):
        P[n], p[n] = rate.row(system, q), rate.value
        p[n] /= rate.unit(system)
    return Rates(prescribed, P, p)


def fitting_rates(
    system: System, work: Work, prescribed: Sequence[Prescribed]
) -> tuple[Array, tuple[str, ...]]:
    """Velocities (coordinates,) that have the rates and move least beside, and notes.

    Parameters
    ----------
    work : Work
        A workspace at a closed position, its signals set.

    Raises
    ------
    SolveError
        Where joints and drivers do not allow the rates.
    """
    near = nearest_rates(system, work, prescribed)
    scale, off, met = system.coordinate_units, near.rows, near.met
    if met is near.given.p:
        return scale * near.v, unsaid_rates(system, work, near.v, near.given.P)
    asked, fast = near.given.p, near.fast
    changed = [n for n in range(len(prescribed)) if abs(met[n] - asked[n]) > AGREES * fast]
    if np.abs(met - asked).max() <= ROUNDED * fast:
        return scale * near.v, _fitted(system, prescribed, met - asked)
    part = np.abs(off)
    part /= part.max(initial=1e-300)
    # equal parts in the order of the rows: their last digits are the processor's
    taking = dict.fromkeys(
        system.owners[system.row_table[0][n]][0].name
        for n in np.argsort(-part.round(6), kind="stable")
        if part[n] > TAKES_PART
    )
    fitted = listed_rates(system, [prescribed[n] for n in changed], met[changed])
    shown = ", ".join(f"{prescribed[n].value:.6g}" for n in changed[:NAMED])
    raise SolveError(
        f"the rates of the start do not fit {_elements(list(taking))}: the nearest velocities that "
        f"fit have {fitted}, not {shown}; give those, or leave out rates that follow from others",
        next(iter(taking), None),
    )


def nearest_rates(system: System, work: Work, prescribed: Sequence[Prescribed]) -> NearestRates:
    """Velocities that joints and drivers allow, as near to the rates as may be, that move least
    beside.

    Raises
    ------
    SolveError
        Where drivers themselves do not agree.
    """
    q = work.q[: system.coordinates, 0].copy()
    given = rates_of(system, q, prescribed)
    G = dense(system, work)[1]
    nu = dense_rates(system, work)
    A, b = np.vstack([G, given.P]), np.append(nu, given.p)
    v = np.linalg.lstsq(A, b, rcond=ZERO)[0]
    off = A @ v - b
    fast = max(float(np.abs(b).max(initial=0.0)), float(np.abs(v).max(initial=0.0)))
    if np.abs(off).max(initial=0.0) <= AGREES * fast:
        return NearestRates(v, given, given.p, np.zeros(len(G)), fast)
    # what joints and drivers impose holds, rates as nearly as may be
    own = np.linalg.lstsq(G, nu, rcond=ZERO)[0]
    _, sizes, vt = np.linalg.svd(G)
    free = vt[int((sizes > ZERO * sizes.max(initial=1e-300)).sum()) :]
    way = shortest(given.P @ free.T, given.p - given.P @ own, ZERO)
    v = own + way @ free
    if np.abs(G @ v - nu).max(initial=0.0) > 1e-6 * fast:  # drivers themselves do not agree
        raise no_velocities(system, nu)
    return NearestRates(v, given, given.P @ v, off[: len(G)], fast)


def branch_rates(
    system: System, here: Singular, t: float, q: Array, prescribed: Sequence[Prescribed]
) -> tuple[Array, tuple[str, ...]]:
    """Velocities (coordinates,) of the one branch that has the rates at a singular position.

    Raises
    ------
    SolveError
        Where no branch has the rates, or several have: with the rate that distinguishes them.
    """
    given = rates_of(system, q, prescribed)
    if here.steady and not given.p.any():
        return np.zeros(len(q)), ()
    points, complete, flat = _points(here, given)
    if len(points) == 1 and complete:
        return here.rows.scale * _velocity(here, given, points[0]), ()
    if points:
        raise _several(system, here, t, given, points, complete)
    near = _rounded(here, given)
    if near is not None:
        v = here.rows.scale * _velocity(here, given, near, exact=False)
        words = nearest_words(system, here, near).removeprefix("; the nearest are ")
        return v, (f"the rates of the start were fitted to a branch of the motion: {words}",)
    if not flat:
        raise undecided(system, t)
    raise _none(system, here, t, given)


def _conditions(here: Singular, given: Rates) -> tuple[Array, Array]:
    """The rates, and that of the clock, as conditions on y."""
    P, p = given.P @ here.ways.T, given.p
    if here.clock.any():
        P, p = np.vstack([P, here.clock]), np.append(p, 1.0)
    return P, p


def _points(here: Singular, given: Rates) -> tuple[list[Array], bool, bool]:
    """y of every branch that has the rates, the place of the start looked at."""
    P, p = _conditions(here, given)
    base = shortest(P, p, 1e-7)
    # away from the singular position rates of first order are off by as much
    away = norm(here.y)
    if np.abs(P @ base - p).max(initial=0.0) > (AGREES + 10.0 * away) * np.abs(p).max():
        return [], True, True
    found = solutions(here.A, P, P @ base)
    points = [y for y in found.points if fits(here, tangent(here.A, y))]
    if not points and away:
        near = onto(here.A, base, here.clock)
        if near is not None and norm(near - base) <= 10.0 * away * norm(base):
            points = [near] if fits(here, tangent(here.A, near)) else []
    return points, found.complete, found.flat


def _velocity(here: Singular, given: Rates, y: Array, *, exact: bool = True) -> Array:
    """Rates (coordinates,) without units at the place of the start, beside the singular one."""
    T = tangent(here.A, y)
    place = along(T, here) if is_flat(here.A, T) else np.zeros(len(y))
    if not place.any():
        return np.asarray(y @ here.ways)
    _, ways = frame(here, T, place)
    if not exact:
        return np.asarray((T @ y) @ ways)
    P, p = given.P @ ways.T, given.p
    if here.clock.any():
        P, p = np.vstack([P, T @ here.clock]), np.append(p, 1.0)
    return np.asarray(shortest(P, p, 1e-7) @ ways)


def _rounded(here: Singular, given: Rates) -> Array | None:
    """Velocities of a branch that differ from the rates by rounding of digits; None of none."""
    P, p = _conditions(here, given)
    base = shortest(P, p, 1e-7)
    near = onto(here.A, base, here.clock)
    if near is None or not fits(here, tangent(here.A, near)):
        return None
    return near if np.abs(P @ near - p).max() <= SAID * np.abs(p).max() else None


# -- sentences --------------------------------------------------------------------------------


def _fitted(system: System, prescribed: Sequence[Prescribed], off: Array) -> tuple[str, ...]:
    """By how much rates were changed."""
    worst = int(np.abs(off).argmax())
    size = _units(system, prescribed[worst], abs(float(off[worst])))
    unit = prescribed[worst].unit_name(system)
    return (
        f"the rates of the start were fitted to joints and drivers: by {size:.2g} {unit} at most, "
        f"of {prescribed[worst].name}",
    )


def listed_rates(system: System, prescribed: Sequence[Prescribed], values: Array) -> str:
    """Such as "block.vx = 0.1 m/s, belt.vx = 0.1 m/s"."""
    shown = [
        one.with_value(system, _units(system, one, value))
        for one, value in zip(prescribed[:NAMED], values, strict=False)
    ]
    return ", ".join(shown) + (
        f" and {len(prescribed) - NAMED} more" if len(prescribed) > NAMED else ""
    )


def _units(system: System, rate: Prescribed, value: float) -> float:
    return float(value) * rate.unit(system)


def _elements(names: list[str]) -> str:
    return listed(names, NAMED) or "the joints"


def _several(
    system: System, here: Singular, t: float, given: Rates, points: list[Array], complete: bool
) -> SolveError:
    rates = values_of(system, here, [_velocity(here, given, y) for y in points], given.prescribed)
    count = f"{len(points)}" if complete else f"at least {len(points)}"
    shown = ", ".join(one.with_value(system, one.value) for one in given.prescribed[:NAMED])
    what = f"have the rates that are given ({shown})" if shown else "follow the drivers"
    ask = "a rate that tells" if len(rates) == 1 else "rates that tell"
    return SolveError(
        f"the start of '{system.mechanism.name}' at {place_words(system, t)} is a singular "
        f"position, where branches of the motion meet, and {count} of them {what}: give {ask} "
        f"them apart, {', '.join(rates)}",
        rates[0].partition(".")[0],
    )


def _none(system: System, here: Singular, t: float, given: Rates) -> SolveError:
    where = (
        f"no motion of '{system.mechanism.name}' has the rates of the start: its position at "
        f"{place_words(system, t)} is singular, where joints allow those rates to first order "
        "only"
    )
    for n in range(len(given.p) - 1, -1, -1):
        left = given.without(n)
        if not left.p.any() and here.steady:
            continue
        points, complete, _ = _points(here, left)
        if points and complete:
            vs = [_velocity(here, left, y) for y in points]
            (rate,) = values_of(system, here, vs, left.prescribed, given.prescribed[n])
            name, _, values = rate.partition(" = ")
            shown = ", ".join(one.with_value(system, one.value) for one in left.prescribed[:NAMED])
            return SolveError(
                f"{where}; with {shown or 'the drivers'}, {name} can be {values}, not "
                f"{given.prescribed[n].value:.6g}: give a rate that a motion has",
                given.prescribed[n].body,
            )
    P, p = _conditions(here, given)
    base = shortest(P, p, 1e-7)
    return SolveError(f"{where}{nearest_words(system, here, nearest(here, base))}")


def no_velocities(system: System, nu: Array) -> SolveError:
    """The sentence of drivers that no velocities follow; nu (rows,) without units of length."""
    # what moves at all are drivers: the fastest is the one to speak of
    name = system.owners[system.row_table[0][int(np.abs(nu).argmax())]][0].name
    return SolveError(
        f"no velocities agree with '{name}' at this position: it is at a dead centre, or "
        "drivers contradict each other; close the loops elsewhere",
        name,
    )
