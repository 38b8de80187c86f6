"""First rates of a motion: those that are given, zero where nothing is said, and what has to move.

A rate that a start leaves out is zero: vx and vy of the origin of a body's axes, and omega. Where
that does not fit Φ_q v = ν and the rates that are given, P v = p, what is left out changes, in each
part of bodies that rows join for itself:

1. bodies that need not turn do not,
2. bodies that do not turn and need not move rest,
3. of all velocities left those are taken that make Σ ½ m |Δv|² + ½ I Δω² least, Δ being the change
   of a body's mass centre and of its rotation. Bodies without mass or inertia follow with the least
   rates that the others leave them.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from mbody.analysis.singular.singular_positions import Prescribed
from mbody.core import tolerances as tol
from mbody.errors import SolveError
from mbody.kernels.layout import Work
from mbody.system.rank import dense, dense_rates, rank_of, shortest
from mbody.system.system import System

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
