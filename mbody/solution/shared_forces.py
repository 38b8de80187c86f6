"""Forces that no equation decides: the set that is reported, whether a force is unique, its range.

Where rows of contacts, ropes, joints and friction depend on each other, all forces f₀ + Z y balance
the bodies alike, Z the forces that are in balance with themselves. Admissible are those that keep
every limit g(f) ≥ 0: what presses, a friction that is not exceeded. Of these the one is reported
whose least limit is kept by most,

    max θ,   g(f₀ + Z y) ≥ θ,

and of several such ones the least. All is without dimensions, in each part that hangs together by
itself: arms by its own longest, forces by those that must be carried there. The limits of contacts
are linear. Those of pins, ρ |R|, and of guides bend outwards: their tangents lie within them, so
that what a program with tangents finds is admissible, and it is repeated with tangents there; ends
of ranges that are found so are attained, the range may be wider.

Limit analysis: Drucker, Prager, Greenberg (1952). Redundant reactions: Wojtyra and Frączek (2013).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from mbody.core import tolerances as tol
from mbody.kernels.layout import Layout, Work
from mbody.model.element import listed
from mbody.solution.doubts import Doubt

Array = np.ndarray

#: Exchanges of a linear program, at most, by its rows and unknowns.
EXCHANGES = 6
#: Linear programs with tangents of limits that bend, at most.
PASSES = 8
#: Directions, as parts of a turn, from which pressing forces of bent limits are tried besides.
TURNS = (0.5, 0.25, 0.75, 0.125, 0.875, 0.375, 0.625)


# -- Programs of few unknowns ------------------------------------------------------------------


def linear_program(aim: Array, A: Array, b: Array) -> tuple[Array, Array] | None:
    """x of the greatest aim · x with A x ≤ b, b ≥ 0, and the multipliers of the rows; None where
    there is no bound. `aim` (n,), `A` (rows, n).

    A simplex tableau whose first n exchanges bring the free x into the basis; what it finds is
    verified by its multipliers, and left to HiGHS where rounding has spoilt it.

    >>> x, loads = linear_program(np.ones(1), np.array([[1.0], [-1.0]]), np.array([2.0, 0.0]))
    >>> float(x[0]), loads.tolist()
    (2.0, [1.0, 0.0])
    """
    rows, n = A.shape
    table = np.zeros((rows + 1, n + 1))
    table[:rows, :n], table[:rows, n], table[rows, :n] = A, b, aim
    basic, other = np.arange(n, n + rows), np.arange(n)
    for step in range(EXCHANGES * (rows + n)):
        gain = np.where(other < n, np.abs(table[rows, :n]), table[rows, :n])
        better = np.flatnonzero(gain > tol.LINEAR_PROGRAM_ZERO)
        if not len(better):
            x, loads = np.zeros(n), np.zeros(rows)
            x[basic[basic < n]] = table[:rows, n][basic < n]
            loads[other[other >= n] - n] = -table[rows, :n][other >= n]
            spoilt = max(
                float((A @ x - b).max(initial=0.0)), float(np.abs(loads @ A - aim).max(initial=0.0))
            )
            return (
                (x, np.maximum(loads, 0.0))
                if spoilt <= tol.CONTACT_FORCE_NONE
                else _highs(aim, A, b)
            )
        # at first the steepest, later by number, so that it cannot cycle
        early = step < 2 * (rows + n)
        k = better[np.argmax(gain[better]) if early else np.argmin(other[better])]
        column = table[:rows, k] * (1.0 if table[rows, k] > 0.0 else -1.0)
        stops = np.flatnonzero((column > tol.LINEAR_PROGRAM_ZERO) & (basic >= n))
        if not len(stops):
            return None
        ratio = table[stops, n] / column[stops]
        equal = stops[ratio <= ratio.min() + tol.LINEAR_PROGRAM_ZERO]
        r = equal[np.argmax(column[equal]) if early else np.argmin(basic[equal])]
        pivot, row, mine = table[r, k], table[r] / table[r, k], table[:, k].copy()
        table -= np.outer(mine, row)
        table[r], table[:, k] = row, -mine / pivot
        table[r, k] = 1.0 / pivot
        basic[r], other[k] = other[k], basic[r]
    return _highs(aim, A, b)


def _highs(aim: Array, A: Array, b: Array) -> tuple[Array, Array] | None:
    """`linear_program` by HiGHS."""
    from scipy.optimize import linprog

    found = linprog(-aim, A_ub=A, b_ub=b, bounds=(None, None), method="highs")
    if found.status != 0:
        return None
    return np.asarray(found.x), -np.asarray(found.ineqlin.marginals)


def _greatest(G: Array, g: Array, weight: Array, most: float) -> tuple[float, Array, Array] | None:
    """θ, y and multipliers of the greatest θ ≤ `most` with g + G y ≥ weight θ."""
    rows, k = G.shape
    if k == 1:
        return _on_a_line(G[:, 0], g, weight, most)
    A = np.block([[-G, weight[:, None]], [np.zeros((1, k)), np.ones((1, 1))]])
    begin = min(float(g[weight > 0.0].min(initial=most)), most)
    b = np.maximum(np.append(g - weight * begin, most - begin), 0.0)
    found = linear_program(np.append(np.zeros(k), 1.0), A, b)
    return None if found is None else (begin + float(found[0][-1]), found[0][:-1], found[1][:rows])


def _on_a_line(a: Array, g: Array, weight: Array, most: float) -> tuple[float, Array, Array] | None:
    """`_greatest` of one unknown: the highest place of the lower envelope of lines."""
    i, j = np.triu_indices(len(a), 1)
    with np.errstate(divide="ignore", invalid="ignore"):
        meet = (weight[j] * g[i] - weight[i] * g[j]) / (weight[i] * a[j] - weight[j] * a[i])
        y = np.concatenate([[0.0], meet, (weight * most - g) / a])
    y = y[np.isfinite(y)]
    lines, own = g[:, None] + a[:, None] * y, weight > 0.0
    height = np.minimum(lines[own].min(axis=0, initial=np.inf), most)
    size = np.abs(g).max(initial=0.0) + np.abs(a[:, None] * y).max(axis=0, initial=0.0)
    if not own.all():
        low = lines[~own].min(axis=0) < -tol.CONTACT_FORCE_SETTLED * size
        height = np.where(low, -np.inf, height)
    n = int(np.argmax(height))
    if not np.isfinite(height[n]):
        return None
    theta, slack = float(height[n]), lines[:, n] - weight * height[n]
    on = (slack <= tol.CONTACT_FORCE_SETTLED * size[n]) & (a != 0.0) & (theta < most)
    return theta, y[[n]], on.astype(float)


def _least(G: Array, h: Array, wanted: Array) -> Array | None:
    """The nearest y to `wanted` with G y ≥ h, where some are (Lawson and Hanson, 23.4)."""
    from scipy.optimize import nnls

    if G.shape[1] == 1:
        a = G[:, 0]
        with np.errstate(divide="ignore"):
            ends = h / a
        low, high = ends[a > 0.0].max(initial=-np.inf), ends[a < 0.0].min(initial=np.inf)
        return np.clip(wanted, low, max(low, high))
    level = h - G @ wanted
    if (level <= 0.0).all():
        return wanted
    E, aim = np.vstack([G.T, level]), np.append(np.zeros(G.shape[1]), 1.0)
    left = E @ nnls(E, aim)[0] - aim
    return wanted - left[:-1] / left[-1] if left[-1] < -tol.SINGULAR_VALUE_SHARED_FRICTION else None


# -- Limits ------------------------------------------------------------------------------------


@dataclass(frozen=True, eq=False)
class BentLimit:
    """Friction of a joint, at most a law of both multipliers that press it.

    `owner`: Whose it is.
    `friction`: Number of its force.
    `pressing` (2, forces): Both multipliers, by all forces.
    `law`: φ and its derivatives by both multipliers and the sign of the sliding.
    `length`: By which friction is divided, so that it is a force.
    """

    owner: int
    friction: int
    pressing: Array
    law: Callable[[float, float, float], tuple[Any, Any, Any]]
    length: float

    def tangents(self, forces: Array, turn: float = 0.0) -> tuple[Array, Array]:
        """Gradients (2, forces) and values (2,) at `forces`, of sliding forwards and back; tangents
        at multipliers turned by so much.
        """
        here = self.pressing @ forces
        c, s = np.cos(turn), np.sin(turn)
        x, y = c * here[0] - s * here[1], s * here[0] + c * here[1]
        lines, values = np.zeros((2, len(forces))), np.zeros(2)
        for n, sign in enumerate((1.0, -1.0)):
            size, by_x, by_y = (float(part) for part in self.law(float(x), float(y), sign))
            lines[n] = by_x * self.pressing[0] + by_y * self.pressing[1]
            lines[n, self.friction] += sign
            size += by_x * (here[0] - x) + by_y * (here[1] - y)
            values[n] = size + sign * forces[self.friction]
        return lines / self.length, values / self.length


@dataclass(frozen=True, eq=False)
class ForceLimits:
    """What must not be negative: `lines` · forces + `given`, and the reserves of `bent`.

    `owners`: Of every line whose it is, and the sign of the sliding (0 of a normal force).
    `given` (lines,)
    `relative` (lines,): Whether a line is a part of its own limit, no force.
    `weights` (lines,): Whether its margin counts; of what has no friction at present it does not.
    """

    owners: list[tuple[int, float]]
    lines: Array
    given: Array
    relative: Array
    weights: Array
    bent: tuple[BentLimit, ...] = ()

    def every_owner(self) -> list[tuple[int, float]]:
        """Those of all lines and tangents."""
        more = [(one.owner, sign) for one in self.bent for sign in (1.0, -1.0)]
        return [*self.owners, *more]

    def at(self, forces: Array, turn: float = 0.0) -> tuple[Array, Array]:
        """Gradients (limits, forces) and values (limits,) at forces (forces,)."""
        every = [(self.lines, self.lines @ forces + self.given)]
        every += [one.tangents(forces, turn) for one in self.bent]
        lines, values = zip(*every, strict=True)
        return np.vstack(lines), np.concatenate(values)

    def sizes(self, part: OpenPart) -> tuple[Array, Array]:
        """By what the limits of a part are divided, and their weights."""
        none = np.zeros(2 * len(self.bent), dtype=bool)
        relative = np.append(self.relative, none)[part.limits]
        weights = np.append(self.weights, ~none)[part.limits]
        return np.where(relative, 1.0, part.size), weights

    def support(self, count: int) -> Array:
        """Which forces each limit depends on: (limits, forces) of bool."""
        found = [self.lines != 0.0]
        for one in self.bent:
            own = (one.pressing != 0.0).any(axis=0)
            own[one.friction] = True
            found.append(np.array([own, own]))
        return np.vstack(found).reshape(-1, count)


class Lines:
    """Limits that are added one after the other."""

    def __init__(self, count: int) -> None:
        self.count, self.owners = count, list[tuple[int, float]]()
        self.rows, self.given, self.counts = list[Array](), list[float](), list[float]()
        self.bent = list[BentLimit]()

    def add(
        self,
        owner: tuple[int, float],
        parts: dict[int, float],
        given: float = 0.0,
        counts: float = 1.0,
    ) -> None:
        """A line with these parts, by the number of the force; whether its margin counts."""
        row = np.zeros(self.count)
        for n, part in parts.items():
            row[n] += part
        self.owners.append(owner)
        self.rows.append(row)
        self.given.append(given)
        self.counts.append(counts)

    def made(self) -> ForceLimits:
        """All of them."""
        rows = np.array(self.rows).reshape(len(self.rows), self.count)
        given, counts = np.array(self.given), np.array(self.counts)
        return ForceLimits(self.owners, rows, given, given != 0.0, counts, tuple(self.bent))


def no_limits(count: int) -> ForceLimits:
    """Of so many forces that may be any."""
    return Lines(count).made()


# -- Forces in balance with themselves ---------------------------------------------------------


@dataclass(frozen=True, eq=False)
class OpenPart:
    """Forces in balance with themselves that hang together, by limits too.

    `free` (forces, k): Of all forces, with their units; orthonormal in units of the part.
    `start` (k,): The least forces that balance the same, from the present ones.
    `limits`: Numbers of the limits that move.
    `size`: The greatest force that must be carried.
    `units` (forces,): By what forces are divided, so that they are alike.
    """

    free: Array
    start: Array
    limits: Array
    size: float
    units: Array


def _components(joined: Array) -> list[Array]:
    """Numbers that hang together, by a symmetric matrix of bool; none of what hangs nowhere."""
    label = np.arange(len(joined))
    for _ in range(len(joined)):
        low = np.where(joined, label, len(joined)).min(axis=1, initial=len(joined))
        now = np.minimum(label, low)
        if (now == label).all():
            break
        label = now
    return [np.flatnonzero(label == n) for n in np.unique(label) if joined[n].any()]


def _nothing_moves(columns: Array, scale: Array) -> Array:
    """Combinations of columns that vanish: (columns, k), orthonormal."""
    whole = columns / scale
    _, sizes, vt = np.linalg.svd(whole)
    least = tol.SINGULAR_VALUE_SHARED_FRICTION * max(1.0, float(sizes.max(initial=0.0)))
    return np.asarray(vt[int((sizes > least).sum()) :].T)


def free_parts(columns: Array, forces: Array, own: Array, limits: ForceLimits) -> list[OpenPart]:
    """Forces in balance with themselves, those among which none of `own` is left out.

    Parameters
    ----------
    columns : array (coordinates, forces)
        Generalised forces of each: (x, y, torque about the mass centre) of every body.
    forces : array (forces,)
        Present ones.
    own : array (forces,)
        Which are of contacts and friction.
    """
    torque = np.arange(len(columns)) % 3 == 2
    acts = (columns != 0.0).reshape(len(columns) // 3, 3, -1).any(axis=1)
    units, Z = np.ones(columns.shape[1]), np.zeros((columns.shape[1], 0))
    acting = acts.astype(float)
    for which in _components(acting.T @ acting > 0.0):
        mine = columns[:, which]
        plain = np.hypot.reduce(mine[~torque])
        arms = np.abs(mine[torque]).max(axis=0, initial=0.0)
        linear = plain > 0.0
        ratio = arms[linear] / plain[linear]
        length = float(ratio.max(initial=0.0)) or 1.0
        mine = np.where(torque[:, None], mine / length, mine)
        units[which] = 1.0 / np.linalg.norm(mine, axis=0)
        found = np.zeros((columns.shape[1], 0))
        some = _nothing_moves(mine, 1.0 / units[which])
        found = np.zeros((columns.shape[1], some.shape[1]))
        found[which] = some
        Z = np.hstack([Z, found])
    if Z.shape[1] and not own.all():
        _, sizes, vt = np.linalg.svd(Z[own])
        Z = Z @ vt[: int((sizes > tol.SINGULAR_VALUE_SHARED_FRICTION).sum())].T
    if not Z.shape[1]:
        return []
    P, support = Z @ Z.T, limits.support(len(forces))
    touched = np.abs(P) > tol.SINGULAR_VALUE_SHARED_FRICTION
    moving = touched.any(axis=1)
    coupled = (support & moving).astype(float)
    joined = touched | (coupled.T @ coupled > 0.0)
    parts = []
    for which in _components(joined) if Z.shape[1] > 1 else [np.flatnonzero(moving)]:
        own_ones = Z
        if Z.shape[1] > 1:
            values, vectors = np.linalg.eigh(P[np.ix_(which, which)])
            own_ones = np.zeros((len(forces), int((values > 0.5).sum())))
            own_ones[which] = vectors[:, values > 0.5]
        mine = np.flatnonzero((support & moving)[:, which].any(axis=1))
        start = -own_ones.T @ (forces / units)
        least = forces / units + own_ones @ start
        near = support[mine].any(axis=0) | moving & np.isin(np.arange(len(forces)), which)
        size = float(np.abs(least[near]).max(initial=0.0))
        size = size or float(np.abs(forces / units)[near].max(initial=0.0))
        free = own_ones * units[:, None]
        parts.append(OpenPart(free, start, mine, max(size, tol.TINY), units))
    return parts


@dataclass(frozen=True, eq=False)
class Margin:
    """The greatest least margin of a part.

    `least`: Dimensionless, at most `most`.
    `y` (k,): Where, in forces.
    `active`: Whose limits stop it, with the sign of the sliding.
    `wedged`: Whether nothing but the size of forces that is sought stops it.
    """

    least: float
    y: Array
    active: list[tuple[int, float]]
    wedged: bool = False


def greatest_margin(
    part: OpenPart, limits: ForceLimits, forces: Array, most: float, *, settle: bool = True
) -> Margin:
    """The y of a part with the greatest least margin; with `settle` the least of several such."""

    def within(room: float, turn: float = 0.0) -> Margin:
        return _within(part, limits, forces, (most, room), 2.0 * np.pi * turn, settle)

    found = within(tol.FORCES_ROOM_MOST)
    if limits.bent and found.least < 0.0:
        for turn in TURNS:
            other = within(tol.FORCES_ROOM_MOST, turn)
            found = other if other.least > found.least else found
    if found.wedged and settle:
        small = within(tol.FORCES_ROOM)
        found = small if small.least >= 0.0 else found
    return found


def _within(
    part: OpenPart,
    limits: ForceLimits,
    forces: Array,
    bounds: tuple[float, float],
    turn: float,
    settle: bool,
) -> Margin:
    """The same of margins and forces up to `bounds`, as parts of the force that must be carried,
    from tangents at pressing forces that are turned by so much.
    """
    (most, room), k, owners = bounds, part.free.shape[1], limits.every_owner()
    scale, weight = limits.sizes(part)
    plain = part.free / part.units[:, None]
    touched = np.linalg.norm(plain, axis=1) > tol.SINGULAR_VALUE_SHARED_FRICTION
    there = (forces / part.units + plain @ part.start)[touched] / part.size
    box, room_left = (
        np.vstack([-plain[touched], plain[touched]]),
        np.append(room - there, room + there),
    )
    weight = np.append(weight, np.zeros(len(box)))
    best, z, rows = Margin(-np.inf, np.zeros(k), [], False), np.zeros(k), len(part.limits)
    here = None if turn else -part.start / part.size
    for n in range(PASSES):
        y = part.start + part.size * (z if n or here is None else here)
        lines, values = limits.at(forces + part.free @ y, 0.0 if n else turn)
        G = lines[part.limits] @ part.free * (part.size / scale)[:, None]
        G[np.abs(G) <= tol.CONTACT_FORCE_NONE] = 0.0
        g = values[part.limits] / scale - G @ ((y - part.start) / part.size)
        G, g = np.vstack([G, box]), np.append(g, room_left)
        found = _greatest(G, g, weight, most)
        if found is None:
            break
        theta, at, loads = found
        if theta <= best.least + tol.CONTACT_FORCE_SETTLED:
            break
        moves = loads > tol.LINEAR_PROGRAM_MULTIPLIER * float(loads.max(initial=0.0))
        wedged = bool(moves[rows:].any())
        if settle:
            at = _settled(G, g, theta * weight, at, moves, np.zeros(k))
        z = at
        active = [owners[i] for i, some in zip(part.limits, moves, strict=False) if some]
        best = Margin(theta, part.start + part.size * z, active, wedged)
        if not limits.bent:
            break
    return best


def _settled(G: Array, g: Array, least: Array, y: Array, moves: Array, wanted: Array) -> Array:
    """Of all places with these margins (limits,) that nearest to `wanted`."""
    tight = G[moves]
    if len(y) == 1 and len(tight):
        return y
    _, sizes, vt = np.linalg.svd(tight)
    Q = vt[int((sizes > tol.SINGULAR_VALUE_SHARED_FRICTION).sum()) :].T
    if not Q.shape[1]:
        return y
    other = np.linalg.norm(G @ Q, axis=1) > tol.SINGULAR_VALUE_SHARED_FRICTION
    slack = g + G @ y - least
    found = _least(G[other] @ Q, -tol.CONTACT_FORCE_NONE - slack[other], Q.T @ (wanted - y))
    if found is None:
        return y
    at = y + Q @ found
    kept = float((g + G @ at - least).min(initial=np.inf))
    return at if kept >= min(0.0, float(slack.min())) - tol.CONTACT_FORCE_SETTLED else y


# -- What is reported, and its ranges ----------------------------------------------------------


@dataclass(frozen=True, eq=False)
class ForceSet:
    """All admissible forces of one instant, from those that are reported.

    `forces` (forces,): Reported.
    `limits`: Their limits.
    `parts`: Combinations that are free.
    `least` (parts,): Greatest least margins, as parts of the forces that must be carried.
    `active`: Whose limits are the nearest, with the sign of the sliding, where one is exceeded.
    `rows` (rows,), `changes` (rows, free): Numbers of primitives, and how they change by all
      combinations.
    """

    forces: Array
    limits: ForceLimits
    parts: tuple[OpenPart, ...]
    least: Array
    active: tuple[tuple[int, float], ...]
    rows: Array
    changes: Array
    _ends: dict[bytes, tuple[float, float]] = field(default_factory=dict)

    @property
    def free(self) -> int:
        """Number of combinations."""
        return self.changes.shape[1]

    def placed(self, place: Array) -> ForceSet:
        """The same in a system whose numbers of primitives are elsewhere: (rows of all,)."""
        return replace(self, rows=place[self.rows])

    def change(self, row: int) -> Array:
        """How a number of a primitive changes by all combinations: (free,)."""
        n = int(np.searchsorted(self.rows, row))
        there = n < len(self.rows) and self.rows[n] == row
        return self.changes[n] if there else np.zeros(self.free)

    def unique(self, by: Array) -> bool | None:
        """Whether a force that changes so by the combinations is determined; None if not known."""
        found: bool | None = True
        for part, least, own in self._by_part(by):
            if not np.abs(own).max(initial=0.0) > 0.0:
                continue
            room = least > tol.FORCES_ADMISSIBLE and self.limits.sizes(part)[1].all()
            if room or least < -tol.FORCES_ADMISSIBLE:
                return False  # there is room on all sides, or none
            low, high = self._range(part, own)
            if high - low > tol.FORCES_UNIQUE * part.size * float(np.linalg.norm(own)):
                return False
            if self.limits.bent:
                found = None
        return found

    def range(self, by: Array) -> tuple[float, float]:
        """By how much less and more than what is reported it may be; infinite without a bound, no
        numbers where none is admissible.
        """
        low = high = 0.0
        for part, least, own in self._by_part(by):
            if np.abs(own).max(initial=0.0) > 0.0:
                if least < -tol.FORCES_ADMISSIBLE:
                    return np.nan, np.nan
                ends = self._range(part, own)
                low, high = low + ends[0], high + ends[1]
        return low, high

    def _by_part(self, by: Array) -> list[tuple[OpenPart, float, Array]]:
        first, found = 0, []
        for part, least in zip(self.parts, self.least, strict=True):
            own = by[first : first + part.free.shape[1]]
            first += len(own)
            found.append((part, float(least), own))
        return found

    def _range(self, part: OpenPart, by: Array) -> tuple[float, float]:
        key = by.tobytes()
        if key not in self._ends:
            self._ends[key] = self._end(part, -by), self._end(part, by)
        less, more = self._ends[key]
        return -less, more

    def _end(self, part: OpenPart, aim: Array) -> float:
        """The greatest change of aim · y within the limits."""
        y = _end_within(part, self.limits, self.forces, aim)
        return np.inf if y is None else float(aim @ y)


def _end_within(part: OpenPart, limits: ForceLimits, forces: Array, aim: Array) -> Array | None:
    """The y within the limits at which aim · y is greatest, by tangents where they bend; None
    without a bound.
    """
    y, best = np.zeros(part.free.shape[1]), 0.0
    scale, _ = limits.sizes(part)
    size = float(np.linalg.norm(aim))
    for _ in range(PASSES):
        lines, values = limits.at(forces + part.free @ y)
        G = lines[part.limits] @ part.free * (part.size / scale)[:, None]
        G[np.abs(G) <= tol.CONTACT_FORCE_NONE] = 0.0
        g = np.maximum(values[part.limits] / scale, 0.0) - G @ (y / part.size)
        if len(y) == 1:
            at = _far(G[:, 0] * np.sign(aim[0]), g)
            reached = None if at is None else np.array([at * np.sign(aim[0])])
        else:
            found = linear_program(aim / size, -G, np.maximum(g + G @ (y / part.size), 0.0))
            reached = None if found is None else found[0] + y / part.size
        if reached is None:
            return None
        gained = float(aim @ reached) * part.size
        if gained <= best + tol.CONTACT_FORCE_SETTLED * size * part.size:
            break
        y, best = reached * part.size, gained
        if not limits.bent:
            break
    return y


def moved_within(parts: Sequence[OpenPart], limits: ForceLimits, forces: Array) -> Array:
    """Combinations (free,) of all parts that lead to other forces within the limits: between the
    far ends of two directions, which no component shares with what is there.
    """
    found = []
    for part in parts:
        count = part.free.shape[1]
        ends = []
        for n in (1, 2):
            aim = np.cos(n * np.arange(1.0, count + 1.0))
            both: list[Array | None] = [None, None]
            if len(part.limits):
                both = [_end_within(part, limits, forces, sign * aim) for sign in (1.0, -1.0)]
            most = float(np.abs(forces / part.units).max(initial=0.0)) or 1.0
            far = [max(part.size, most) * aim if y is None else y for y in both]
            ends.append(max(far, key=lambda y: float(np.linalg.norm(y))))
        found.append(0.7 * ends[0] + 0.3 * ends[1])
    return np.concatenate(found) if found else np.zeros(0)


def _far(a: Array, g: Array) -> float | None:
    """The greatest y with g + a y ≥ 0; None without one."""
    falls = a < 0.0
    return float((g[falls] / -a[falls]).min()) if falls.any() else None


def reported(
    columns: Array, forces: Array, own: Array, limits: ForceLimits
) -> tuple[Array, list[OpenPart], list[Margin]]:
    """The forces that are reported, the parts that are free, and their margins; see `free_parts`.

    Three feet of a table whose load is in the middle of two:

    >>> feet = np.array([[0.0, 0.0, 0.0], [1.0, 1.0, 1.0], [-1.0, 0.0, 1.0]])
    >>> lines = Lines(3)
    >>> for n in range(3):
    ...     lines.add((n, 0.0), {n: 1.0})
    >>> forces = np.array([6.0, 0.0, 6.0])
    >>> found, parts, margins = reported(feet, forces, np.ones(3, dtype=bool), lines.made())
    >>> found.round(12).tolist(), round(margins[0].least * parts[0].size, 12)
    ([4.0, 4.0, 4.0], 4.0)
    """
    parts = free_parts(columns, forces, own, limits)
    margins = [greatest_margin(one, limits, forces, tol.FORCES_ROOM_MOST) for one in parts]
    changed = sum(
        (p.free @ m.y for p, m in zip(parts, margins, strict=True)), np.zeros(len(forces))
    )
    return forces + changed, parts, margins


@dataclass(frozen=True, eq=False)
class SharedResult:
    """Forces of a result that no equation decides.

    `sets`: All admissible ones of every instant, of a batch of those of one design after the other;
      None where they are determined.
    `named`: Names of the owners of their limits, by number.
    `designs`: Of a batch.
    """

    sets: tuple[ForceSet | None, ...]
    named: tuple[str, ...] = ()
    designs: int = 0

    def take(self, index: Array) -> SharedResult:
        """Some of the instants."""
        return SharedResult(tuple(self.sets[k] for k in index), self.named)

    @property
    def free(self) -> int:
        """The greatest number of combinations that are free."""
        return max((one.free for one in self.sets if one is not None), default=0)

    def change(self, row: int) -> Array:
        """How a number of a primitive changes by the combinations: (free, instants), of a batch
        (free, designs, instants).
        """
        found = np.zeros((self.free, len(self.sets)))
        for k, one in enumerate(self.sets):
            if one is not None:
                found[: one.free, k] = one.change(row)
        return found.reshape(self.free, self.designs, -1) if self.designs else found

    def unique(self, by: Array, none: float) -> bool | None:
        """Whether what changes so, as `change` has it, is determined at all instants; changes up
        to `none` are rounding.
        """
        found: bool | None = True
        for own, some in self._distinct(by, none):
            one = own.unique(some)
            if one is False:
                return False
            found = None if one is None else found
        return found

    def range(self, by: Array, none: float) -> tuple[Array, Array]:
        """By how much it may be less and more: two arrays (instants,), or (designs, instants)."""
        shape, by = by.shape[1:], by.reshape(len(by), -1)
        ends = np.zeros((2, len(self.sets)))
        known = dict[tuple[int, bytes], tuple[float, float]]()
        for k, own in enumerate(self.sets):
            some = by[: own.free, k] if own is not None else np.zeros(0)
            if own is None or not np.abs(some).max(initial=0.0) > none:
                continue
            key = id(own), some.tobytes()
            if key not in known:
                known[key] = own.range(some)
            ends[:, k] = known[key]
        return ends[0].reshape(shape), ends[1].reshape(shape)

    def _distinct(self, by: Array, none: float) -> list[tuple[ForceSet, Array]]:
        """Sets with a change that is not none; of instants that are alike once."""
        found, by = dict[tuple[int, bytes], tuple[ForceSet, Array]](), by.reshape(len(by), -1)
        for k, own in enumerate(self.sets):
            if own is not None and np.abs(some := by[: own.free, k]).max(initial=0.0) > none:
                found.setdefault((id(own), some.tobytes()), (own, some))
        return list(found.values())


def joined_forces(
    parts: Sequence[tuple[SharedResult | None, Array, Array]],
) -> SharedResult | None:
    """Those of parts of a motion: each, the instants that are kept (instants,) of bool, and where
    the numbers of its primitives are in the whole.
    """
    sets, named = list[ForceSet | None](), tuple[str, ...]()
    for shared, keep, place in parts:
        if shared is None:
            sets += [None] * int(keep.sum())
            continue
        moved = {id(own): own.placed(place) for own in shared.sets if own is not None}
        sets += [moved.get(id(shared.sets[k])) for k in np.flatnonzero(keep)]
        named = shared.named
    return SharedResult(tuple(sets), named) if any(one is not None for one in sets) else None


def inadmissible(solution: Any) -> list[Doubt]:
    """A doubt where no forces that were found keep all limits."""
    worst, when, owners = 0.0, 0, set[int]()
    count = 0
    for k, own in enumerate(solution.shared.sets if solution.shared is not None else ()):
        least = float(own.least.min(initial=0.0)) if own is not None else 0.0
        if own is None or least >= -tol.FORCES_ADMISSIBLE:
            continue
        when = when if count else k
        count += 1
        owners |= {number for number, _ in own.active}
        worst = min(worst, least)
    if not count:
        return []
    names = [solution.shared.named[n] for n in sorted(owners)]
    names = list(dict.fromkeys(names))
    instants, every = len(solution.t), len(solution.shared.sets)
    t, unit = float(solution.t[when % instants]), solution.mechanism.units.time
    many = f"at {count} of {every} instants, first " if every > 1 else ""
    return [
        Doubt(
            "inadmissible",
            f"no forces were found that keep all limits of {listed(names)} {many}at t = {t:.6g} "
            f"{unit}: they are exceeded by {-worst:.2g} of what is carried there; do not rely on "
            "these forces, and look whether it would begin to move",
            t,
            tuple(names),
        )
    ]


def primitive_numbers(layout: Layout, work: Work, multipliers: Array) -> Array:
    """Numbers of primitives as records keep them, (primitives, PER_PRIMITIVE, …), by their
    multipliers (primitives, 2, …) at the position in a workspace.
    """
    L, count = layout, len(multipliers)
    at = 12 * L.written_node[:count, None] + 6 + np.arange(3)
    x, y = multipliers[:, 0], multipliers[:, 1]
    fx, fy, torque = (
        -(_wide(work.block[at[:, n], 0], x) * x + _wide(work.block[at[:, n] + 3, 0], y) * y)
        for n in range(3)
    )
    j, arm = 2 * L.primitive_j[:count], L.primitive_arm[:count]
    c, s = work.turn[j, 0], work.turn[j + 1, 0]
    ax, ay = work.par[arm, 0], work.par[arm + 1, 0]
    px, py = _wide(c * ax - s * ay, x), _wide(s * ax + c * ay, x)
    return np.stack([x, y, fx, fy, torque - (px * fy - py * fx)], axis=1)


def _wide(values: Array, like: Array) -> Array:
    """Values (n,) beside (n, …)."""
    return values.reshape(-1, *(1,) * (like.ndim - 1))
