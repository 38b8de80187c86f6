"""Singular positions ahead of a motion: the position itself, and whether the constraints hold
there.

At such a position x the rows lose rank: Uᵀ G N = 0, with U and N those left and right singular
vectors of G = Φ_q that belong to the rows that become dependent. Where Uᵀ Φ is zero too
branches cross there, a change point, and a motion runs on smoothly through it. Where it is not, ε,
the branches pass each other by √ε, and each turns away in a bend that narrow. Drivers make time one
more coordinate, so that a dead centre, where a driver cannot go on, is no such position.

`mbody.analysis.singular.singular_positions` looks for a position where loops close as well, by new
singular vectors in every iteration. Here Uᵀ Φ is left open, for it tells a crossing from a bend,
and the vectors of the first position serve all iterations: a motion looks ahead at many steps.

A motion remembers the positions that it met, for it meets them again. The memory is its own and
goes on with it: were it that of the mechanism, a motion would depend on those before it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from mbody.analysis.singular.singular_positions import ConstraintRows
from mbody.core import tolerances as tol
from mbody.model.element import listed
from mbody.system.system import System, too_large

Array = np.ndarray

#: Iterations towards a change point.
ROUNDS = 16
#: Parts of the distance that is requested, on which rows may be found to stay independent.
HORIZONS = (1.0, 0.3, 0.1)
#: Singular positions that a motion remembers.
KNOWN = 64
#: Joints, and instants, that a sentence names.
MOST = 4


@dataclass(frozen=True)
class Crossing:
    """A change point on the way.

    `t`: When it is met.
    `elements`: The joints whose rows become dependent there.
    `place`, `direction` (coordinates,): The position, lengths by the model length, and the
      direction in which the motion runs to it.
    `seen`: When it was seen, how far away it was along the way, and how fast that changed.
    """

    t: float
    elements: tuple[str, ...]
    place: Array
    direction: Array
    seen: tuple[float, float, float]

    def passed(self, t: float, x: Array, v: Array) -> Crossing | None:
        """The crossing with its instant from both sides, where a motion at x with the rates v
        (coordinates,) has it behind; else None.
        """
        s, rate = float((x - self.place) @ self.direction), float(v @ self.direction)
        start, first, first_rate = self.seen
        if not s > 0.0 > first:
            return None
        h = t - start
        # Hermite's cubic through both places and rates
        cubic = [
            2.0 * (first - s) + h * (first_rate + rate),
            3.0 * (s - first) - h * (2.0 * first_rate + rate),
            h * first_rate,
            first,
        ]
        roots = np.roots(cubic)
        inside = roots.real[
            (np.abs(roots.imag) < tol.ROOT_REAL_FINE) & (roots.real >= 0.0) & (roots.real <= 1.0)
        ]
        return replace(self, t=start + h * float(inside[0]) if len(inside) else self.t)


@dataclass(frozen=True, eq=False)
class MetPosition:
    """A singular position.

    `x` (coordinates,): The position, lengths by the model length.
    `U` (rows, dependencies): Rows that depend on each other there.
    `left`: What they leave of Φ.
    """

    x: Array
    U: Array
    left: float


@dataclass(frozen=True)
class Ahead:
    """Time without a singular position from now on, and the crossing that follows.

    `clear`: Rows stay independent so long from now on.
    `crossing`: The change point that the motion meets.
    `closest_time`: Where branches pass each other without meeting, when the motion is in the bend.
    `elements`: The joints whose rows become dependent, where there are any.
    `met`: The positions to remember.
    """

    clear: float = 0.0
    crossing: Crossing | None = None
    closest_time: float = np.inf
    elements: tuple[str, ...] = ()
    met: tuple[MetPosition, ...] = ()


class _TimedRows:
    """`ConstraintRows` with time, in `unit`, as one more coordinate where there are drivers."""

    def __init__(self, system: System, t: float, unit: float) -> None:
        self.system, self.rows, self.unit = system, ConstraintRows.at_time(system, t), unit
        self.driven = bool(system.drivers)

    def at(self, x: Array) -> tuple[Array, Array]:
        """Φ (rows,) and its derivatives (rows, ·) at x."""
        rows = self.rows
        if not self.driven:
            rows.at(x)
            return rows.phi, rows.G
        sides = []
        for side in (tol.DIFFERENCE_STEP_INPUTS, -tol.DIFFERENCE_STEP_INPUTS, 0.0):
            rows.at(x[:-1], None, (x[-1] + side) * self.unit)
            sides.append(rows.phi)
        return rows.phi, np.column_stack(
            [rows.G, (sides[0] - sides[1]) / (2.0 * tol.DIFFERENCE_STEP_INPUTS)]
        )


def packed_positions(met: Sequence[MetPosition]) -> Array:
    """Singular positions packed as one row of numbers, for files."""
    parts = [np.concatenate([[one.U.shape[1]], one.x, one.U.ravel(), [one.left]]) for one in met]
    return np.concatenate(parts) if parts else np.zeros(0)


def unpacked_positions(system: System, numbers: Array) -> tuple[MetPosition, ...]:
    """The positions that were packed."""
    found: list[MetPosition] = []
    n, rows, at = system.coordinates, system.rows, 0
    while at < len(numbers):
        count = numbers[at]
        if not (1.0 <= count <= rows and count == round(count)):
            raise ValueError("dependent rows are no count")
        end = at + 2 + n + rows * int(count)
        if end > len(numbers) or len(found) == KNOWN:
            raise ValueError("a position is cut off")
        x, U = numbers[at + 1 : at + 1 + n], numbers[at + 1 + n : end - 1]
        found.append(MetPosition(x.copy(), U.reshape(rows, -1).copy(), float(numbers[end - 1])))
        at = end
    return tuple(found)


def look_ahead(
    system: System,
    t: float,
    state: tuple[Array, Array, Array],
    step: float,
    regularized: bool,
    met: tuple[MetPosition, ...] = (),
) -> Ahead:
    """Singular position ahead of a motion in state (t, q, v). `q`, `v` (coordinates,)."""
    found = _ahead(system, t, state, step, regularized, met)
    return replace(found, met=found.met or met)


def _ahead(
    system: System,
    t: float,
    state: tuple[Array, Array, Array],
    step: float,
    regularized: bool,
    met: tuple[MetPosition, ...],
) -> Ahead:
    q, v, a = state
    if too_large(system):
        return Ahead()
    scale = system.coordinate_units
    speed = float(np.linalg.norm(v / scale))
    if not speed > 0.0:
        return Ahead()
    rows = _TimedRows(system, t, 1.0 / speed)
    x, direction, bent = q / scale, v / (scale * speed), a / (scale * speed**2)
    if rows.driven:
        x, direction, bent = np.append(x, 0.0), np.append(direction, 1.0), np.append(bent, 0.0)
    within = speed * step
    found = None if rows.driven else _known(met, x, 8.0 * within)
    if found is None:
        G = rows.at(x)[1]
        if not len(G):  # nothing but contacts, none of which holds
            return Ahead()
        parts = np.linalg.svd(G)
        sizes = parts[1]
        rank = (
            int((sizes > tol.SINGULAR_VALUE_ZERO * sizes[0]).sum()) if regularized else len(sizes)
        )
        n = len(q)
        least = (
            np.linalg.svd(G[:, :n], compute_uv=False)[rank - 1] if rows.driven else sizes[rank - 1]
        )
        for part in HORIZONS:
            distance = part * within
            ahead = rows.at(x + distance * direction + 0.5 * distance**2 * bent)[1]
            if least > tol.INDEPENDENCE_CERTAIN * _at_most(ahead[:, :n] - G[:, :n]):
                return Ahead(clear=part * step)
        found = _nearest(rows, x, rank, parts, 8.0 * within)
        if found is None:
            return Ahead()
        # of a driven mechanism time is a coordinate, which does not come again
        if not rows.driven and len(met) < KNOWN:
            met = (*met, found)
    elements = _owners(system, found.U)
    # what nothing joins to the dependent rows may be anywhere then
    on = _joined(system, found.U, len(x))
    gone, direction, bent = (np.where(on, part, 0.0) for part in (found.x - x, direction, bent))
    square = float(direction @ direction)
    if not square > 0.0:
        return Ahead(elements=elements, met=met)
    distance, along = float(np.linalg.norm(gone)), float(gone @ direction) / square
    when = t + (along - 0.5 * along**2 * float(bent @ direction) / square) / speed
    if found.left > tol.LOOP_CLOSURE_CORRECTION * (1.0 + float(np.abs(x).max())):
        return Ahead(closest_time=max(when, t), elements=elements, met=met)
    missed = float(np.linalg.norm(gone - along * direction - 0.5 * along**2 * bent))
    if missed > tol.SINGULARITY_BESIDE_PATH * distance and distance > tol.POSITION_SAME:
        return Ahead(elements=elements, met=met)
    n = len(q)
    place, direction = found.x[:n], direction[:n]
    seen = t, float((x[:n] - place) @ direction), float(v / scale @ direction)
    crossing = Crossing(when, elements, place, direction, seen)
    return Ahead(crossing=crossing, elements=elements, met=met)


def _known(met: Sequence[MetPosition], x: Array, radius: float) -> MetPosition | None:
    """A singular position within the radius about x that was met before."""
    angles = np.tile([False, False, True], len(x) // 3)
    for one in met:
        revolutions = 2.0 * np.pi * np.round((x - one.x) / (2.0 * np.pi)) * angles
        if np.linalg.norm(one.x + revolutions - x) < radius:
            return MetPosition(one.x + revolutions, one.U, one.left)
    return None


def _nearest(
    rows: _TimedRows, x: Array, rank: int, parts: tuple[Array, Array, Array], radius: float
) -> MetPosition | None:
    """The singular position within the radius about x, if there is one."""
    sizes = parts[1][:rank]
    small = int((sizes < tol.SINGULAR_VALUE_MAY_VANISH * sizes[0]).sum())
    above = np.append(sizes[0], sizes)[rank - small : rank]
    # how many vanish together: where the gap to the next one is widest
    for place in np.argsort(-above / sizes[rank - small :])[:2]:
        found = _singular(rows, x, rank - (small - int(place)), parts, radius)
        if found is not None:
            return found
    return None


def _singular(
    rows: _TimedRows, x: Array, kept: int, parts: tuple[Array, Array, Array], radius: float
) -> MetPosition | None:
    """The position near x where all but so many rows become dependent, by a simplified
    Newton method; None where it does not come to one within the radius.

    In the singular vectors at x, what elimination of the rows that stay independent leaves of G.
    """
    u, sizes, vt = parts
    start, last, flat = x, np.inf, None
    for n in range(ROUNDS):
        phi, G = rows.at(x)
        B, c = u.T @ G @ vt.T, u.T @ phi
        try:
            eliminated = np.linalg.solve(
                B[:kept, :kept], np.column_stack([B[:kept, kept:], c[:kept]])
            )
        except np.linalg.LinAlgError:
            return None
        along, off = eliminated[:, :-1], eliminated[:, -1]
        left = B[kept:, kept:] - B[kept:, :kept] @ along
        worst = float(np.abs(left).max(initial=0.0)) / sizes[0]
        if (
            worst <= tol.SINGULAR_VALUE_ZERO
            and np.abs(off).max(initial=0.0) <= tol.SINGULAR_VALUE_ZERO
        ):
            U = u[:, kept:] - u[:, :kept] @ np.linalg.solve(B[:kept, :kept].T, B[kept:, :kept].T)
            return MetPosition(x, U, float(np.linalg.norm(c[kept:] - B[kept:, :kept] @ off)))
        if n > 2 and worst > 0.7 * last:
            return None
        if flat is None or worst > 0.2 * last:
            curvatures = [
                _between(u[:, kept:], rows.at(x + d)[1] - rows.at(x - d)[1], vt[kept:])
                for d in tol.DIFFERENCE_STEP_INPUTS * vt[kept:]
            ]
            flat = _inverse(
                np.array(curvatures).reshape(len(curvatures), -1)
                / (2.0 * tol.DIFFERENCE_STEP_INPUTS)
            )
        last = worst
        z = -np.einsum("an,n->a", flat, left.ravel())
        x = x + z @ vt[kept:] - (off + along @ z) @ vt[:kept]
        if not np.linalg.norm(x - start) <= radius:
            return None
    return None


def _inverse(F: Array) -> Array:
    """The inverse of Fᵀ in the sense of least squares, F (unknowns, equations): one for several
    iterations.
    """
    return np.asarray(
        np.linalg.pinv(np.einsum("an,bn->ab", F, F), tol.LEAST_SQUARES_RANK_FINE, hermitian=True)
        @ F
    )


def _between(U: Array, G: Array, N: Array) -> Array:
    """Uᵀ G Nᵀ of a matrix with few entries: libraries of dense algebra stall beside other jobs."""
    row, column = np.nonzero(G)
    if not len(row):
        return np.zeros((U.shape[1], len(N)))
    begin = np.flatnonzero(np.diff(row, prepend=-1))
    own = np.add.reduceat(G[row, column][:, None] * N.T[column], begin, axis=0)
    return np.asarray(np.einsum("ra,rb->ab", U[row[begin]], own))


def _at_most(G: Array) -> float:
    """A bound of the greatest singular value: the root of both norms by sums."""
    size = np.abs(G)
    return float(np.sqrt(size.sum(axis=0).max() * size.sum(axis=1).max()))


def _dependent(U: Array) -> Array:
    """Numbers of the rows that take part in dependencies U (rows, ·), those most first."""
    part = np.linalg.norm(U, axis=1)
    return np.argsort(-part)[: int((part > tol.PARTICIPATION * part.max()).sum())]


def _owners(system: System, U: Array) -> tuple[str, ...]:
    """Joints and drivers of the rows that take part in dependencies, those most first."""
    names = [system.owners[system.row_table[0][n]][0].name for n in _dependent(U)]
    return tuple(dict.fromkeys(names))


def _joined(system: System, U: Array, count: int) -> Array:
    """Which of so many coordinates, time the one behind those of the bodies, are of parts whose
    rows take part in dependencies.
    """
    L = system.layout
    primitive = system.row_table[0][_dependent(U)]
    bodies = np.concatenate([L.primitive_i[primitive], L.primitive_j[primitive]])
    found = np.ones(count, dtype=bool)
    parts = L.body_part[bodies[bodies < L.bodies]]
    found[: system.coordinates] = np.isin(system.coordinate_part, parts)
    return found


def crossing_note(crossings: list[Crossing], unit: str) -> str:
    """The sentence of change points that were passed, in the order of time."""
    times = [f"{one.t:.6g}" for one in crossings[:MOST]]
    more = f" and {len(crossings) - MOST} times more" if len(crossings) > MOST else ""
    elements = dict.fromkeys(name for one in crossings for name in one.elements)
    point = "a change point" if len(crossings) == 1 else "change points"
    return (
        f"at t = {', '.join(times)} {unit}{more} the motion passes {point}, where the rows of "
        f"{listed(elements, MOST)} depend on each other and branches meet: it goes on smoothly"
    )
