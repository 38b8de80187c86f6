"""Forces that no equation decides: the set that is reported, whether a force is unique, its range.

Where rows of contacts, ropes, joints and friction depend on each other, forces are open. Reported
are those whose least limit is kept by most, of several such ones the least, which
`mbody.kernels.force_programs` finds by linear programs. Ends of ranges where limits bend, those of
pins and guides, are attained; the range may be wider.
"""

from __future__ import annotations

import itertools
import threading
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from mbody.core import tolerances as tol
from mbody.kernels import force_programs as kernels
from mbody.kernels.force_programs import COMBINATIONS, OpenForces, open_forces_memory
from mbody.kernels.layout import Layout, Work
from mbody.kernels.linear_program import LinearProgram, linear_program, linear_program_memory
from mbody.model.element import listed
from mbody.solution.doubts import Doubt
from mbody.system.system import System

Array = np.ndarray
#: Whose limits are, and the sign of the sliding, 0 of normal forces.
Owners = list[tuple[int, float]]


class _ProgramMemory(threading.local):
    """Memory of the kernels of every size, for each thread."""

    def __init__(self) -> None:
        self.of = dict[tuple[int, ...], tuple[OpenForces, LinearProgram]]()


_memory = _ProgramMemory()


def greatest(aim: Array, A: Array, b: Array) -> tuple[int, Array, Array]:
    """What was found of a linear program (`mbody.kernels.linear_program`), the x with the greatest
    aim · x within A x ≤ b, and the multipliers of these limits.

    >>> found, x, loads = greatest(np.ones(1), np.array([[1.0], [-1.0]]), np.array([2.0, 0.0]))
    >>> found, float(x[0]), loads.tolist()
    (0, 2.0, [1.0, 0.0])
    """
    P = linear_program_memory(len(aim), len(b))
    P.aim[:], P.A[:], P.b[:] = aim, A, b
    return linear_program(P), P.x, P.load


def open_forces(*size: int) -> tuple[OpenForces, LinearProgram]:
    """Memory of the kernels of this thread for so many coordinates, forces, linear limits and pairs
    of limits that bend.
    """
    if size not in _memory.of:
        _memory.of[size] = open_forces_memory(*size)
    return _memory.of[size]


# -- Limits ------------------------------------------------------------------------------------


@dataclass(frozen=True, eq=False)
class BentLimit:
    """Friction of a joint, at most a law of both multipliers that press it.

    `owner`: Whose it is.
    `friction`: Number of its force.
    `pressing`: Numbers of both multipliers, −1 of none.
    `kind`, `arm` (6,): Of the law, and its numbers of sliding forwards and back.
    `length`: By which friction is divided, so that it is a force.
    """

    owner: int
    friction: int
    pressing: tuple[int, int]
    kind: int
    arm: Array
    length: float


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

    def at(self, forces: Array) -> Array:
        """Values of the lines."""
        return np.asarray(self.lines @ forces + self.given)

    def all_count(self, part: OpenPart) -> bool:
        """Whether the margins of all limits of a part count."""
        lines = part.limits[part.limits < len(self.weights)]
        return bool((self.weights[lines] > 0.0).all())

    def loaded(self, coordinates: int, forces: Array) -> tuple[OpenForces, LinearProgram]:
        """Memory of the kernels with these limits and forces."""
        S, P = open_forces(coordinates, len(forces), len(self.lines), len(self.bent))
        S.force[:], S.line[:], S.given[:] = forces, self.lines, self.given
        S.relative[:], S.counts[:] = self.relative, self.weights
        for n, one in enumerate(self.bent):
            S.bent[n] = one.friction, *one.pressing, one.kind
            S.arm[n], S.length[n] = one.arm, one.length
        return S, P


def pressing_rows(system: System, node: int) -> tuple[int, int]:
    """Numbers of both multipliers of a node among the rows of joints and drivers, −1 of none."""
    primitive, number, _ = system.row_table
    at = np.flatnonzero(system.layout.primitive_node[primitive] == node)
    found = dict(zip(number[at].tolist(), at.tolist(), strict=True))
    return found.get(0, -1), found.get(1, -1)


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


@dataclass(frozen=True, eq=False)
class Margin:
    """The greatest least margin of a part.

    `least`: As a part of what must be carried.
    `y` (k,): Where, in forces.
    `active`: Whose limits stop it, with the sign of the sliding.
    """

    least: float
    y: Array
    active: list[tuple[int, float]]


def _loaded(
    columns: Array, forces: Array, own: Array, limits: ForceLimits
) -> tuple[OpenForces, LinearProgram]:
    S, P = limits.loaded(len(columns), forces)
    S.column[:], S.own[:] = columns, own
    return S, P


def _parts(S: OpenForces, count: int) -> list[OpenPart]:
    """Those that were found."""
    units, found = S.unit.copy(), []
    for n in range(count):
        mine = slice(S.first[n], S.first[n + 1])
        moving = np.flatnonzero(S.moves[n])
        free = (S.free[mine] * units).T.copy()
        found.append(OpenPart(free, S.start[mine].copy(), moving, float(S.size[n]), units))
    return found


def free_parts(columns: Array, forces: Array, own: Array, limits: ForceLimits) -> list[OpenPart]:
    """Forces in balance with themselves, those among which none of `own` is left out.

    `columns` (coordinates, forces): Generalised forces of each: (x, y, torque about the mass
      centre) of every body.
    `forces` (forces,): Present ones.
    `own` (forces,): Which are of contacts and friction.
    """
    S, _ = _loaded(columns, forces, own, limits)
    return _parts(S, kernels.parts_of_forces(S))


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
    S, P = _loaded(columns, forces, own, limits)
    count, owners = kernels.share_forces(S, P, tol.FORCES_ROOM_MOST, True), limits.every_owner()
    parts, margins = _parts(S, count), []
    for n in range(count):
        y = S.y[S.first[n] : S.first[n + 1]].copy()
        margins.append(
            Margin(float(S.least[n]), y, [owners[k] for k in np.flatnonzero(S.active[n])])
        )
    moved = S.free[: S.count[COMBINATIONS]].T @ S.y[: S.count[COMBINATIONS]]
    return forces + S.unit * moved, parts, margins


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
            room = least > tol.FORCES_ADMISSIBLE and self.limits.all_count(part)
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
    S, P = limits.loaded(0, forces)
    count = part.free.shape[1]
    S.first[:2], S.unit[:], S.size[0] = (0, count), part.units, part.size
    S.free[:count], S.start[:count] = part.free.T / part.units, part.start
    S.moves[0] = 0
    S.moves[0, part.limits] = 1
    return S.y[:count].copy() if kernels.far_end(S, P, 0, np.ascontiguousarray(aim)) else None


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
        shape, by = by.shape[1:], by.reshape(len(by), len(self.sets))
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
        found = dict[tuple[int, bytes], tuple[ForceSet, Array]]()
        by = by.reshape(len(by), len(self.sets))
        for k, own in enumerate(self.sets):
            if own is not None and np.abs(some := by[: own.free, k]).max(initial=0.0) > none:
                found.setdefault((id(own), some.tobytes()), (own, some))
        return list(found.values())


def forces_of_designs(each: Sequence[SharedResult | None], instants: int) -> SharedResult | None:
    """Those of the designs of a batch, each over so many instants."""
    named = next((one.named for one in each if one is not None), None)
    if named is None:
        return None
    sets = [one.sets if one is not None else (None,) * instants for one in each]
    return SharedResult(tuple(itertools.chain.from_iterable(sets)), named, len(each))


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


def primitive_numbers(
    layout: Layout, work: Work, multipliers: Array, which: Array | None = None
) -> Array:
    """Numbers of primitives as records keep them, (primitives, PER_PRIMITIVE, …), by their
    multipliers (primitives, 2, …) at the position in a workspace: of the first, or of `which`.
    """
    L, which = layout, np.arange(len(multipliers)) if which is None else which
    at = 12 * L.written_node[which, None] + 6 + np.arange(6)
    rows = work.block[at, 0].reshape(-1, 2, 3, *(1,) * (multipliers.ndim - 2))
    force = -(rows[:, 0] * multipliers[:, :1] + rows[:, 1] * multipliers[:, 1:])
    j, arm = 2 * L.primitive_j[which], L.primitive_arm[which]
    c, s = work.turn[j, 0], work.turn[j + 1, 0]
    ax, ay = work.par[arm, 0], work.par[arm + 1, 0]
    px, py = _wide(c * ax - s * ay, force[:, 0]), _wide(s * ax + c * ay, force[:, 0])
    force[:, 2] -= px * force[:, 1] - py * force[:, 0]
    return np.concatenate([multipliers, force], axis=1)


def _wide(values: Array, like: Array) -> Array:
    """Values (n,) beside (n, …)."""
    return values.reshape(-1, *(1,) * (like.ndim - 1))
