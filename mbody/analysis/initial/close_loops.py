"""The verb `close_loops`: one consistent position, and velocities, from a rough guess."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from mbody.analysis.driven.time_grid import DriverValues, time_grid
from mbody.analysis.initial.first_rates import (
    Rates,
    first_rates,
    moved_note,
    no_velocities,
    rates_of,
    settled,
)
from mbody.analysis.position.assembly_analysis import as_system, closed, raise_user_error
from mbody.analysis.position.closed_position import ClosedPosition
from mbody.analysis.singular.singular_positions import (
    Prescribed,
    Singular,
    along,
    fits,
    frame,
    is_flat,
    nearest,
    nearest_words,
    norm,
    onto,
    place_words,
    singular,
    solutions,
    tangent,
    undecided,
    values_of,
)
from mbody.core import tolerances as tol
from mbody.errors import ModelError, SolveError
from mbody.kernels.layout import Work
from mbody.kernels.loop_closure import project
from mbody.model.body import Guesses
from mbody.model.element import listed, takes_one_design
from mbody.model.mechanism import Mechanism
from mbody.model.numbers import number_in
from mbody.quantities.types import Number
from mbody.solution.histories import Record
from mbody.solution.solution import Solution
from mbody.system.rank import dense, dense_rates, shortest
from mbody.system.system import System, too_large

# -- First velocities by prescribed rates, on a branch of the motion ---------------------------

Array = np.ndarray

#: Elements of a contradiction that are named.
PRESCRIBED = 4


def fitting_rates(
    system: System, work: Work, prescribed: Sequence[Prescribed], whole: float = 0.0
) -> tuple[Array, tuple[str, ...]]:
    """Velocities (coordinates,) that have the rates, and notes. `whole`: How long the motion goes
    on, in which what moves by no more than rounding is at rest.
    """
    found = first_rates(system, work, prescribed)
    scale, asked, fast = system.coordinate_units, found.given.p, found.fast
    lacking, notes = np.abs(found.met - asked), moved_note(system, found.moved)
    if not lacking.any():
        return scale * found.v, notes
    rests = lacking * whole <= tol.START_MOTION_ROUNDING
    if (rests | (lacking <= tol.VELOCITY_ROUNDING * fast)).all():
        if rests.all():
            return scale * found.v, notes
        return scale * found.v, (*_fitted(system, prescribed, found.met - asked), *notes)
    unmet = np.flatnonzero((lacking > tol.VELOCITIES_AGREE * fast) & ~rests).tolist()
    part = np.abs(found.rows)
    part /= part.max(initial=tol.TINY)
    # equal parts in the order of the rows: their last digits are the processor's
    taking = dict.fromkeys(
        system.owners[system.row_table[0][n]][0].name
        for n in np.argsort(-part.round(6), kind="stable")
        if part[n] > tol.PARTICIPATION
    )
    fitted = listed_rates(system, [prescribed[n] for n in unmet], found.met[unmet])
    numbers = ", ".join(f"{prescribed[n].value:.6g}" for n in unmet[:PRESCRIBED])
    raise SolveError(
        f"the rates of the start do not fit {_elements(list(taking))}: the nearest velocities that "
        f"fit have {fitted}, not {numbers}; give those, or leave out rates that follow from others",
        next(iter(taking), None),
    )


def branch_rates(
    system: System, here: Singular, t: float, q: Array, prescribed: Sequence[Prescribed]
) -> tuple[Array, tuple[str, ...]]:
    """Velocities (coordinates,) of the one branch that has the rates at a singular position."""
    given = rates_of(system, q, prescribed)
    if here.steady and not given.p.any():
        return np.zeros(len(q)), ()
    points, complete, flat = _points(here, given)
    if len(points) == 1 and complete:
        v, open_motions = _velocity(here, given, points[0]), _open_motions(here, given, points[0])
        return here.rows.scale * settled(system, q, prescribed, v, open_motions), ()
    if points:
        raise _several(system, here, t, given, points, complete)
    nearest = _rounded(here, given)
    if nearest is not None:
        v = here.rows.scale * _velocity(here, given, nearest, exact=False)
        words = nearest_words(system, here, nearest).removeprefix("; the nearest are ")
        return v, (f"the rates of the start were fitted to a branch of the motion: {words}",)
    if not flat:
        raise undecided(system, t)
    raise _none(system, here, t, given)


def _conditions(here: Singular, given: Rates) -> tuple[Array, Array]:
    """The rates, and that of the clock, as conditions on y."""
    P, p = given.P @ here.directions.T, given.p
    if here.clock.any():
        P, p = np.vstack([P, here.clock]), np.append(p, 1.0)
    return P, p


def _points(here: Singular, given: Rates) -> tuple[list[Array], bool, bool]:
    """y of every branch that has the rates, the place of the start looked at."""
    P, p = _conditions(here, given)
    base = shortest(P, p, tol.SINGULAR_VALUE_DEAD_CENTRE)
    # away from the singular position rates of first order are off by as much
    away = norm(here.y)
    if (
        np.abs(P @ base - p).max(initial=0.0)
        > (tol.VELOCITIES_AGREE + 10.0 * away) * np.abs(p).max()
    ):
        return [], True, True
    found = solutions(here.A, P, P @ base)
    points = [y for y in found.points if fits(here, tangent(here.A, y))]
    if not points and away:
        nearest = onto(here.A, base, here.clock)
        if nearest is not None and norm(nearest - base) <= 10.0 * away * norm(base):
            points = [nearest] if fits(here, tangent(here.A, nearest)) else []
    return points, found.complete, found.flat


def _velocity(here: Singular, given: Rates, y: Array, *, exact: bool = True) -> Array:
    """Rates (coordinates,) without units at the place of the start, beside the singular one."""
    T = tangent(here.A, y)
    place = along(T, here) if is_flat(here.A, T) else np.zeros(len(y))
    if not place.any():
        return np.asarray(y @ here.directions)
    _, directions = frame(here, T, place)
    if not exact:
        return np.asarray((T @ y) @ directions)
    P, p = given.P @ directions.T, given.p
    if here.clock.any():
        P, p = np.vstack([P, T @ here.clock]), np.append(p, 1.0)
    return np.asarray(shortest(P, p, tol.SINGULAR_VALUE_DEAD_CENTRE) @ directions)


def _open_motions(here: Singular, given: Rates, y: Array) -> Array:
    """Motions (motions, coordinates) along the branch of y that the rates leave free."""
    T = tangent(here.A, y)
    if not is_flat(here.A, T):
        return np.zeros((0, given.P.shape[1]))
    place = along(T, here)
    directions = frame(here, T, place)[1] if place.any() else T @ here.directions
    rows = directions @ given.P.T
    if here.clock.any():
        rows = np.column_stack([rows, T @ here.clock])
    u, sizes, _ = np.linalg.svd(rows)
    rank = int((sizes > tol.SINGULAR_VALUE_DEAD_CENTRE).sum())
    return np.asarray(u[:, rank:].T @ directions)


def _rounded(here: Singular, given: Rates) -> Array | None:
    """Velocities of a branch that differ from the rates by rounding of digits; None of none."""
    P, p = _conditions(here, given)
    base = shortest(P, p, tol.SINGULAR_VALUE_DEAD_CENTRE)
    nearest = onto(here.A, base, here.clock)
    if nearest is None or not fits(here, tangent(here.A, nearest)):
        return None
    return (
        nearest
        if np.abs(P @ nearest - p).max() <= tol.BRANCH_VELOCITIES_SAME * np.abs(p).max()
        else None
    )


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
    texts = [
        one.with_value(system, _units(system, one, value))
        for one, value in zip(prescribed[:PRESCRIBED], values, strict=False)
    ]
    return ", ".join(texts) + (
        f" and {len(prescribed) - PRESCRIBED} more" if len(prescribed) > PRESCRIBED else ""
    )


def _units(system: System, rate: Prescribed, value: float) -> float:
    return float(value) * rate.unit(system)


def _elements(names: list[str]) -> str:
    return listed(names, PRESCRIBED) or "the joints"


def _several(
    system: System, here: Singular, t: float, given: Rates, points: list[Array], complete: bool
) -> SolveError:
    rates = values_of(system, here, [_velocity(here, given, y) for y in points], given.prescribed)
    count = f"{len(points)}" if complete else f"at least {len(points)}"
    texts = ", ".join(one.with_value(system, one.value) for one in given.prescribed[:PRESCRIBED])
    what = f"have the rates that are given ({texts})" if texts else "follow the drivers"
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
            texts = ", ".join(
                one.with_value(system, one.value) for one in left.prescribed[:PRESCRIBED]
            )
            return SolveError(
                f"{where}; with {texts or 'the drivers'}, {name} can be {values}, not "
                f"{given.prescribed[n].value:.6g}: give a rate that a motion has",
                given.prescribed[n].body,
            )
    P, p = _conditions(here, given)
    base = shortest(P, p, tol.SINGULAR_VALUE_DEAD_CENTRE)
    return SolveError(f"{where}{nearest_words(system, here, nearest(here, base))}")


#: Bodies that a note names.
NAMED = 3


def close_loops(
    model: Mechanism | System,
    t: float = 0.0,
    *,
    drive: DriverValues | None = None,
    guess: Guesses | None = None,
    rates: Mapping[str, Number] | None = None,
) -> Solution:
    """Close the loops from a rough guess: position analysis, initial assembly; velocities too.

    Free degrees of freedom stay as near to the guess as the loops allow (least weighted change).

    Parameters
    ----------
    model : Mechanism or System
        With or without drivers.
    t : float
        Time at which drivers and laws are taken.
    drive : mapping, optional
        Value, or (value, rate), of drivers by name instead of their laws.
    guess : mapping, optional
        By body, instead of its own guess: angle [rad], or (x, y, angle) of the link axes.
    rates : mapping, optional
        Angular velocity of bodies [rad/time]; where joints and drivers do not allow all of them,
        the nearest that they allow, and a note says so. All other rates are zero where that
        fits; where it does not, what has to move has the least kinetic energy, and a note.

    Returns
    -------
    Solution
        One instant with positions and velocities.

    Raises
    ------
    SolveError
        When the loops cannot close: with the smallest gap and where; when no velocities agree with
        the drivers.

    Examples
    --------
    >>> import mbody
    >>> run = close_loops(mbody.makers.four_bar(1, 3, 2, 3.5), drive={"motor": 1.0})
    >>> run.checks.constraint < 1e-12
    True
    """
    system = as_system(model)
    takes_one_design("close_loops", system.batch)
    request = time_grid(system, t, drive, None, None)
    if len(request.s) != 1:
        raise ModelError("close_loops takes one instant: give one time and one value a driver")
    first = request.first(system)
    start = closed(system, float(request.t[0]), first, guess)
    work = start.work
    if rates is not None and not isinstance(rates, Mapping):
        raise ModelError(f'rates must be a dict such as {{"crank": 2.0}}, not {rates!r}')
    prescribed = list[Prescribed]()
    for name, rate in (rates or {}).items():
        if name not in system.bodies or name == "ground":
            raise ModelError(f"there is no moving body {name!r} to give a rate", str(name))
        omega = number_in(system.mechanism, rate, "angular velocity", name, "rate")
        prescribed.append(Prescribed(name, "omega", omega))
        if too_large(system):
            work.v[3 * system.bodies[name] + 2] = omega
    if drive:
        for n, row in enumerate(system.layout.driver_row):
            work.signal[row + 1] = request.given[0, n, 1]
    project(system.runtime(), work, start.regularization)
    raise_user_error(system)
    n3, notes = system.coordinates, tuple(start.notes)
    here = _singular(system, start, float(request.t[0]), prescribed)
    if here is not None:
        q = work.q[:n3, 0].copy()
        work.v[:n3, 0], more = branch_rates(system, here, float(request.t[0]), q, prescribed)
        notes = (*notes, *more)
    else:
        G = _check_velocities(system, work)
        more = ()
        if not too_large(system) and (system.rows < n3 or prescribed or start.regularization):
            found = first_rates(system, work, prescribed, G)
            work.v[:n3, 0] = system.coordinate_units * found.v
            more = moved_note(system, found.moved)
        notes = (*notes, *_unmet(system, work, prescribed), *more)
    block = np.zeros((1, system.record_rows, 1))
    block[0, :n3], block[0, n3 : 2 * n3] = work.q[:n3], work.v[:n3]
    return Solution(
        system=system,
        analysis="close_loops",
        t=request.t,
        record=Record([block], 1, batch=False),
        given=request.given if drive else None,
        regularization=start.regularization,
        notes=notes,
    )


def _singular(
    system: System, start: ClosedPosition, t: float, rates: Sequence[Prescribed]
) -> Singular | None:
    """The singular position that a start is at, where velocities depend on its branches."""
    work = start.work
    still = not np.abs(work.v[: system.coordinates]).max(initial=0.0)
    moving = any(one.value for one in rates) or not still
    if not moving or not (start.regularization or start.ratio < tol.PIVOT_SUSPECT):
        return None
    own = system.work()
    own.q[:], own.signal[:], own.time[:] = work.q, work.signal, work.time
    return singular(system, own, t, tol.SINGULAR_DISTANCE_PRECISE)


def _unmet(system: System, work: Work, rates: Sequence[Prescribed]) -> tuple[str, ...]:
    """A sentence of rotations that are not as they were requested."""
    greatest = max((abs(one.value) for one in rates), default=0.0)
    unit = system.mechanism.units.of("angular velocity")
    now = {one.body: float(work.v[3 * system.bodies[one.body] + 2, 0]) for one in rates}
    parts = [
        f"'{one.body}' turns at {now[one.body]:.6g} {unit}, not at {one.value:.6g}"
        for one in rates
        if abs(now[one.body] - one.value) > tol.RATE_MET * greatest
    ]
    if not parts:
        return ()
    more = f", and {len(parts) - NAMED} more" if len(parts) > NAMED else ""
    return (
        f"rates: {', '.join(parts[:NAMED])}{more}: joints and drivers do not allow all that were "
        "requested; the nearest were taken",
    )


def _check_velocities(system: System, work: Work) -> np.ndarray | None:
    """Refuse velocities that the constraints do not allow, as of a driver at its dead centre;
    returns Φ_q without units (rows, coordinates), None of what is too large or has no rows.
    """
    if too_large(system) or not system.rows:
        return None
    G = dense(system, work)[1]
    nu = dense_rates(system, work)
    v = work.v[: system.coordinates, 0] / system.coordinate_units
    residual = np.abs(G @ v - nu)
    if residual.max() > tol.RATES_CONTRADICT * max(np.abs(nu).max(), np.abs(v).max()):
        raise no_velocities(system, nu)
    return G
