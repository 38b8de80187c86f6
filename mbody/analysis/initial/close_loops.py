"""The verb `close_loops`: one consistent position, and velocities, from a rough guess."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from mbody.analysis.driven.time_grid import DriverValues, time_grid
from mbody.analysis.position.assembly_analysis import (
    as_system,
    closed,
    each_design,
    raise_user_error,
)
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
from mbody.model.element import listed
from mbody.model.mechanism import Mechanism
from mbody.model.numbers import number_in
from mbody.quantities.formula import Number
from mbody.solution.histories import Record
from mbody.solution.solution import Solution
from mbody.system.rank import dense, dense_rates, rank_of, shortest
from mbody.system.system import System, too_large

# -- First rates of a motion: those that are given, zero where nothing is said, and what has to
#    move --------------------------------------------------------------------------------------
#
# A rate that a start leaves out is zero: vx and vy of the origin of a body's axes, and omega. Where
# that does not fit Φ_q v = ν and the rates that are given, P v = p, what is left out changes, in
# each part of bodies that rows join for itself:
#
# 1. bodies that need not turn do not,
# 2. bodies that do not turn and need not move rest,
# 3. of all velocities left those are taken that make Σ ½ m |Δv|² + ½ I Δω² least, Δ being the
#    change of a body's mass centre and of its rotation. Bodies without mass or inertia follow with
#    the least rates that the others leave them.

Array = np.ndarray

#: Rates that a sentence names.
NAMED = 4
#: The rates of a body, of which a start may give some.
KEYS = ("omega", "vx", "vy")
#: Weights that no two bodies share: what they leave at zero is zero for any weights.
GOLDEN = 0.5 * (5.0**0.5 - 1.0)


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


def rates_of(system: System, q: Array, prescribed: Sequence[Prescribed]) -> Rates:
    """Conditions of what is prescribed, at a position (coordinates,)."""
    P, p = np.zeros((len(prescribed), system.coordinates)), np.zeros(len(prescribed))
    for n, rate in enumerate(prescribed):
        P[n], p[n] = rate.row(system, q), rate.value
        p[n] /= rate.unit(system)
    return Rates(prescribed, P, p)


@dataclass(frozen=True, eq=False)
class FirstRates:
    """Velocities that joints and drivers allow, as near to the rates as may be, without units of
    length.

    `v` (coordinates,)
    `met` (rates,): The rates that are prescribed, as they are met.
    `rows` (rows,): What the rates as they are given leave of the rows; zero where all agree.
    `fast` (rates,): The fastest rate of the part that each is of.
    `moved`: Rates that nothing gives and that are not zero, of bodies that joints leave a choice.
    """

    v: Array
    given: Rates
    met: Array
    rows: Array
    fast: Array
    moved: tuple[Prescribed, ...]


def first_rates(
    system: System, work: Work, prescribed: Sequence[Prescribed], G: Array | None = None
) -> FirstRates:
    """Velocities with the prescribed rates at the position in a workspace, its signals set; with
    Φ_q there without units, where it is known.
    """
    q = work.q[: system.coordinates, 0].copy()
    given = rates_of(system, q, prescribed)
    G = dense(system, work)[1] if G is None else G
    nu = dense_rates(system, work)
    v = left_out_rates(system, q, prescribed)
    met, rows, fast = given.p.copy(), np.zeros(len(G)), np.zeros(len(given.p))
    moved = list[Prescribed]()
    for part in _parts(system, G, nu, given, v):
        if not part.solve():  # drivers themselves do not agree
            raise no_velocities(system, nu)
        v[part.columns], met[part.given], rows[part.rows] = part.v, part.met, part.off
        fast[part.given] = part.fast
        moved += _moved(system, q, v, part, prescribed)
    return FirstRates(v, given, met, rows, fast, tuple(moved))


def settled(
    system: System, q: Array, prescribed: Sequence[Prescribed], v: Array, N: Array
) -> Array:
    """The velocities v + y N (coordinates,) in which what is prescribed leaves least to move; N
    (motions, coordinates), without units of length.
    """
    if not len(N):
        return v
    inertia = _inertia(system)
    wanted = left_out_rates(system, q, prescribed)
    turning = _left_turning(system, prescribed)
    return _settled(v, np.linalg.qr(N.T)[0].T, wanted, inertia, turning)


def left_out_rates(system: System, q: Array, prescribed: Sequence[Prescribed]) -> Array:
    """Velocities (coordinates,), without units of length, with the prescribed rates and else zero,
    as if every body were free.
    """
    v = np.zeros(system.coordinates)
    for one in sorted(prescribed, key=lambda one: KEYS.index(one.key)):
        # omega first: the mass centre goes round the origin
        row, first = one.row(system, q), 3 * system.bodies[one.body]
        if one.key == "omega":
            v[first + 2] = one.value
            for k, key in enumerate(KEYS[1:]):
                v[first + k] = -Prescribed(one.body, key, 0.0).row(system, q)[first + 2] * one.value
            continue
        k = KEYS.index(one.key) - 1
        v[first + k] = one.value / one.unit(system) - row[first + 2] * v[first + 2]
    return v


def _inertia(system: System) -> Array:
    """Masses and moments of inertia of coordinates without units of length, (coordinates,)."""
    return np.asarray(system.mass[: system.coordinates, 0] * system.coordinate_units**2)


def _left_turning(system: System, prescribed: Sequence[Prescribed]) -> Array:
    """Coordinates of rotation whose rates nothing gives, (coordinates,) of bool."""
    found = np.zeros(system.coordinates, dtype=bool)
    found[2::3] = True
    found[[3 * system.bodies[one.body] + 2 for one in prescribed if one.key == "omega"]] = False
    return found


# -- Parts of bodies that rows join, each solved for itself ------------------------------------


@dataclass(eq=False)
class _Part:
    """Bodies that rows join, with its own length: that of the moment arms of its rows.

    `columns`, `rows`, `given`: Its coordinates, rows, and prescribed rates.
    `wanted` (columns,): The rates if every body were free.
    """

    columns: Array
    rows: Array
    given: Array
    G: Array
    nu: Array
    P: Array
    p: Array
    wanted: Array
    inertia: Array
    turning: Array

    def solve(self) -> bool:
        """Sets `v`, `met`, `off`, `fast`, and `open`, what joints and rates leave free (motions,
        columns), `free`, what joints alone do; False where drivers contradict each other.
        """
        A, b = np.vstack([self.G, self.P]), np.append(self.nu, self.p)
        self.v, self.met, self.off = self.wanted.copy(), self.p, np.zeros(len(self.nu))
        self.fast = _greatest(b, self.v)
        self.open = self.free = np.zeros((0, len(self.v)))
        left = b - A @ self.v
        if not left.any():
            return True
        v = self.v + self._shortest(A, left)
        off = A @ v - b
        self.fast = _greatest(b, v)
        if np.abs(off).max(initial=0.0) > tol.VELOCITIES_AGREE * self.fast:
            plain = np.linalg.lstsq(A, b, rcond=tol.SINGULAR_VALUE_ZERO)[0]
            self.off = (A @ plain - b)[: len(self.nu)]
            v = self._shortest(self.G, self.nu)
            if np.abs(self.G @ v - self.nu).max(initial=0.0) > tol.RATES_CONTRADICT * self.fast:
                return False
            v = self._nearest(v)
            self.met = self.P @ v
        self.free, self.open = self._null(self.G), self._null(A)
        if len(self.open):
            scale = self._scale
            v = scale * _settled(
                v / scale, self.open, self.wanted / scale, self.inertia * scale**2, self.turning
            )
        self.v = v + 0.0  # no zero is below zero
        return True

    @property
    def _scale(self) -> Array:
        """Sizes of coordinates: of rotations one by the greatest moment arm of the rows."""
        A = np.vstack([self.G, self.P])
        arms, ways = np.abs(A[:, 2::3]), np.maximum(np.abs(A[:, 0::3]), np.abs(A[:, 1::3]))
        arm = float(arms[ways.any(axis=1)].max(initial=0.0))
        scale = np.ones(A.shape[1])
        scale[2::3] = 1.0 / arm if arm > 0.0 else 1.0
        return scale

    def _scaled(self, A: Array) -> tuple[Array, Array]:
        """Rows in sizes of coordinates, of length one, and these lengths."""
        A = A * self._scale
        lengths = np.linalg.norm(A, axis=1)
        lengths[lengths == 0.0] = 1.0
        return A / lengths[:, None], lengths

    def _shortest(self, A: Array, b: Array) -> Array:
        A, lengths = self._scaled(A)
        return np.asarray(
            self._scale * np.linalg.lstsq(A, b / lengths, rcond=tol.SINGULAR_VALUE_ZERO)[0]
        )

    def _null(self, A: Array) -> Array:
        """Null vectors (motions, columns) in sizes of coordinates."""
        return rank_of(self._scaled(A)[0]).motions

    def _nearest(self, v: Array) -> Array:
        """What joints and drivers impose holds, as in v, rates as nearly as may be."""
        _, sizes, vt = np.linalg.svd(self.G)
        free = vt[int((sizes > tol.SINGULAR_VALUE_ZERO * sizes.max(initial=tol.TINY)).sum()) :]
        return v + shortest(self.P @ free.T, self.p - self.P @ v, tol.SINGULAR_VALUE_ZERO) @ free


def _greatest(*rates: Array) -> float:
    return max(float(np.abs(one).max(initial=0.0)) for one in rates)


def _parts(system: System, G: Array, nu: Array, given: Rates, wanted: Array) -> Iterator[_Part]:
    """The parts that something moves."""
    bodies = len(wanted) // 3
    of_row = (G != 0.0).reshape(len(G), bodies, 3).any(axis=2)
    of_rate = (given.P != 0.0).reshape(len(given.P), bodies, 3).any(axis=2)
    number = np.arange(bodies)
    for touched in of_row:
        own = np.unique(number[touched])
        if len(own) > 1:
            number[np.isin(number, own)] = own[0]
    inertia, turning = _inertia(system), _left_turning(system, given.prescribed)
    off = np.abs(nu - G @ wanted) > 0.0
    moving = {int(number[own.argmax()]) for own in (*of_row[off], *of_rate)}
    if nu[~of_row.any(axis=1)].any():
        raise no_velocities(system, nu)
    for n in sorted(moving):
        own = number == n
        columns = np.flatnonzero(np.repeat(own, 3))
        rows, rates = np.flatnonzero(of_row @ own), np.flatnonzero(of_rate @ own)
        yield _Part(
            columns,
            rows,
            rates,
            G[np.ix_(rows, columns)],
            nu[rows],
            given.P[np.ix_(rates, columns)],
            given.p[rates],
            wanted[columns],
            inertia[columns],
            turning[columns],
        )


# -- What is left open: nothing turns or moves that need not, else the least kinetic energy ----


def _settled(v: Array, N: Array, wanted: Array, inertia: Array, turning: Array) -> Array:
    """Velocities v + y N nearest to what is wanted; N (motions, coordinates) orthonormal."""
    bodies = len(v) // 3
    weight = 1.0 + np.repeat(np.arange(1, bodies + 1) * GOLDEN % 1.0, 3)
    columns = np.flatnonzero(turning)
    columns = columns[_still(v, N, weight, columns)]
    v, N = _least(v, N, columns, weight, np.zeros_like(v))
    # what does not turn moves as one point
    still = np.repeat(v[2::3] == 0.0, 3) & (np.arange(len(v)) % 3 < 2)
    columns = np.flatnonzero(still)
    rests = _still(v - wanted, N, weight, columns)
    rests = np.repeat(rests.reshape(-1, 2).all(axis=1), 2)
    v, N = _least(v, N, columns[rests], weight, wanted)
    heavy = inertia > 0.0
    v, N = _least(v, N, np.flatnonzero(heavy), np.sqrt(inertia), wanted)
    return _least(v, N, np.flatnonzero(~heavy), np.ones_like(v), wanted)[0]


def _still(v: Array, N: Array, weight: Array, columns: Array) -> Array:
    """Which coordinates need not move, whatever the others weigh: (columns,) of bool."""
    found, _ = _least(v, N, columns, weight, np.zeros_like(v))
    return np.asarray(np.abs(found[columns]) <= tol.RATE_NONE * np.abs(found).max(initial=0.0))


def _least(v: Array, N: Array, columns: Array, weight: Array, wanted: Array) -> tuple[Array, Array]:
    """The velocities v + y N that make Σ (weight (v − wanted))² least over some coordinates, and
    the motions that leave these as they are.
    """
    # what does not move has no part, not even by rounding times the mass of a heavy body
    moving = columns[np.abs(N[:, columns]).max(axis=0, initial=0.0) > tol.RATE_NONE_MECHANISM]
    if moving.size:
        u, sizes, vt = np.linalg.svd(N[:, moving].T)
        rank = int((sizes > tol.SINGULAR_VALUE_ZERO).sum())
        own = weight[moving] / weight[moving].max()
        z = np.linalg.lstsq(own[:, None] * u[:, :rank], own * (wanted - v)[moving], rcond=None)[0]
        v, N = v + ((z / sizes[:rank]) @ vt[:rank]) @ N, vt[rank:] @ N
    # what is as wanted is so exactly
    near = np.abs(v - wanted)[columns] <= tol.RATE_NONE_MECHANISM * np.abs(v).max(initial=0.0)
    v = v.copy()
    v[columns[near]] = wanted[columns[near]]
    return v, N


# -- Sentences ---------------------------------------------------------------------------------


def _moved(
    system: System, q: Array, v: Array, part: _Part, prescribed: Sequence[Prescribed]
) -> list[Prescribed]:
    """Rates of a part that nothing gives and that are not zero, of bodies that joints and rates
    leave a choice; what drivers impose is no choice.
    """
    if not len(part.open):
        return []
    found = list[Prescribed]()
    said = {(one.body, one.key) for one in prescribed}
    names = {n: name for name, n in system.bodies.items() if name != "ground"}
    open_ = np.abs(part.open).max(axis=0).reshape(-1, 3).max(axis=1) > tol.RATE_NONE_MOTION
    unit = part._scale
    for n in np.unique(part.columns[np.repeat(open_, 3)] // 3).tolist():
        for key in KEYS:
            one = Prescribed(names[n], key, 0.0)
            row = one.row(system, q)[part.columns]
            rate, size = float(row @ v[part.columns]), float(np.abs(v[part.columns] / unit).max())
            free = np.abs(part.free @ (row * unit)).max(initial=0.0) > tol.RATE_NONE_MOTION
            moves = abs(rate) > tol.RATE_NONE_MOTION * size * np.abs(row * unit).max()
            if moves and free and (names[n], key) not in said:
                found.append(Prescribed(names[n], key, rate * one.unit(system)))
                if key == "omega":  # which says enough of a body
                    break
    return found


def moved_note(system: System, moved: Sequence[Prescribed]) -> tuple[str, ...]:
    """A sentence of rates that nothing gives and that cannot be zero."""
    if not moved:
        return ()
    texts = ", ".join(one.with_value(system, one.value) for one in moved[:NAMED])
    more = f" and {len(moved) - NAMED} more" if len(moved) > NAMED else ""
    return (
        f"the rates that the start leaves out are zero but for {texts}{more}: zero does not fit "
        "joints, drivers and the rates that are given there, and those of least kinetic energy do",
    )


def no_velocities(system: System, nu: Array) -> SolveError:
    """The sentence of drivers that no velocities follow; nu (rows,) without units of length."""
    # what moves at all are drivers: the fastest is the one to speak of
    name = system.owners[system.row_table[0][int(np.abs(nu).argmax())]][0].name
    return SolveError(
        f"no velocities agree with '{name}' at this position: it is at a dead centre, or "
        "drivers contradict each other; close the loops elsewhere",
        name,
    )


# -- First velocities by prescribed rates, on a branch of the motion ---------------------------


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
BODIES_NAMED = 3


@each_design
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
    more = f", and {len(parts) - BODIES_NAMED} more" if len(parts) > BODIES_NAMED else ""
    return (
        f"rates: {', '.join(parts[:BODIES_NAMED])}{more}: joints and drivers do not allow all that "
        "were requested; the nearest were taken",
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
