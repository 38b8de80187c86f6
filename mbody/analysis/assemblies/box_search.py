"""All real roots of the rows of a group, with a certificate.

Boxes of unknowns are shrunk by the rows, as they are and preconditioned by the inverse of the
Jacobian at the middle; excluded where a row cannot vanish; cut by Krawczyk's operator. Newton's
method goes from the middle to a root, and where Krawczyk's operator maps a box about that root,
which covers the whole box at hand, into its inside, there is one root in it and no other
(ε-inflation: Rump 1999). What remains is halved.

Source: R. E. Moore, R. B. Kearfott, M. J. Cloud, *Introduction to Interval Analysis*, SIAM 2009,
chapter 8.
"""

from __future__ import annotations

import cmath
from copy import copy
from dataclasses import dataclass
from fractions import Fraction
from math import lcm

import numpy as np

from mbody.analysis.assemblies.linkage import Group, Linkage, NotCovered, State
from mbody.core.tolerances import (
    BOX_COEFFICIENT_NONE,
    BOX_INFLATED,
    BOX_INFLATED_LEAST,
    BOX_RATIO_SAME,
    BOX_ROOTS_SAME,
    BOX_SIZE_LEAST,
    BOX_SPARE_ROWS_OPEN,
    BOX_WIDENING_ROUNDING,
    BOX_WIDER,
    BOX_WIDTH_NARROW,
    BOX_WIDTH_SMALLEST,
    SINGULAR_VALUE_BOX_ROOT,
    SINGULAR_VALUE_PARALLEL,
    SINGULAR_VALUE_PRECONDITIONER,
)

# -- Ranges over boxes, many at a time: of a cosine, of a product, and a cosine inverted -------
# NumPy does not round outwards; each range is widened by `BOX_WIDENING_ROUNDING` of its size
# instead, which is some thousand times the rounding of what is added up.

REVOLUTION = 2.0 * np.pi


def cosine_range(low: np.ndarray, high: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Least and greatest cosine between two angles [rad], exact up to `BOX_WIDENING_ROUNDING`.

    >>> [round(float(end), 6) for end in cosine_range(np.array(-0.5), np.array(0.2))]
    [0.877583, 1.0]
    """
    a, b = np.cos(low), np.cos(high)
    least, greatest = np.minimum(a, b), np.maximum(a, b)
    greatest = np.where(np.floor(high / REVOLUTION) > np.floor(low / REVOLUTION), 1.0, greatest)
    behind, ahead = (low - np.pi) / REVOLUTION, (high - np.pi) / REVOLUTION
    least = np.where(np.floor(ahead) > np.floor(behind), -1.0, least)
    return least - BOX_WIDENING_ROUNDING, greatest + BOX_WIDENING_ROUNDING


def first_within(
    start: np.ndarray, least_angle: np.ndarray, greatest_angle: np.ndarray
) -> np.ndarray:
    """The least angle t ≥ start whose size, taken within half a revolution, is between near and
    far, 0 ≤ near ≤ far ≤ π.

    >>> float(first_within(np.array(0.1), np.array(0.5), np.array(1.0)))
    0.5
    """
    revolutions = REVOLUTION * np.floor((start + np.pi) / REVOLUTION)
    t = start - revolutions
    beyond = np.where(t <= greatest_angle, t, REVOLUTION - greatest_angle)
    inside = np.where(t < least_angle, least_angle, beyond)
    behind = np.where(t <= -least_angle, t, inside)
    return np.asarray(np.where(t < -greatest_angle, -greatest_angle, behind) + revolutions)


def products(
    a: tuple[np.ndarray, np.ndarray], b: tuple[np.ndarray, np.ndarray]
) -> tuple[np.ndarray, np.ndarray]:
    """Least and greatest product of a number in the range `a` and one in the range `b`."""
    every = a[0] * b[0], a[0] * b[1], a[1] * b[0], a[1] * b[1]
    least = np.minimum(np.minimum(every[0], every[1]), np.minimum(every[2], every[3]))
    greatest = np.maximum(np.maximum(every[0], every[1]), np.maximum(every[2], every[3]))
    return least, greatest


# -- Bounds of slider displacements in closed loops, for all angles ----------------------------
# In a loop Σ P e^{iα} + Σ s Q e^{iα} + B = 0 the other vectors are never longer than Σ|P| + |B|.
# One displacement in a loop is no greater than that; several in known directions follow from linear
# equations with such right-hand sides. Where directions of several turn, they may become parallel
# and displacements have no bound.

#: Displacements without a bound are searched up to so many times the size of the rows.
DISPLACEMENT_SEARCHED = 4.0


def slide_bounds(
    loops: np.ndarray, slides: np.ndarray, constant: np.ndarray, along: list[int], scale: float
) -> tuple[np.ndarray, bool]:
    """Greatest displacements (slides,), and whether they hold for all positions. P (loops,
    directions), Q (loops, slides), `constant` (loops,), complex; `along`: the direction of each
    slide, −1 where it is known.

    Examples
    --------
    A slide along x and another along y close a vector of 2:

    >>> P, Q, B = np.array([[2.0 + 0j]]), np.array([[1.0, 1j]]), np.array([0j])
    >>> slide_bounds(P, Q, B, [-1, -1], 2.0)[0].round(6).tolist()
    [2.0, 2.0]
    """
    sizes = np.abs(loops).sum(axis=1) + np.abs(constant)
    size = np.abs(slides)
    found = np.full(slides.shape[1], np.nan)
    going_on = True
    while going_on:
        going_on = False
        for n in range(len(sizes)):
            left = np.flatnonzero((size[n] > 0.0) & np.isnan(found))
            if len(left) == 1:
                others = float(np.nansum(size[n] * np.where(np.isnan(found), 0.0, found)))
                found[left[0]] = (sizes[n] + others) / size[n, left[0]]
                going_on = True
    left = np.flatnonzero(np.isnan(found))
    if len(left) and all(along[m] < 0 for m in left):
        found[left] = _by_equations(sizes, slides, found, left)
    proven = bool(np.isfinite(found).all())
    displacement_bound = np.where(np.isfinite(found), found, DISPLACEMENT_SEARCHED * scale)
    return BOX_WIDER * np.maximum(displacement_bound, BOX_SIZE_LEAST * scale), proven


def _by_equations(
    sizes: np.ndarray, slides: np.ndarray, found: np.ndarray, left: np.ndarray
) -> np.ndarray:
    """Bounds of slides in known directions; NaN where these are parallel."""
    others = sizes + np.abs(slides) @ np.nan_to_num(found)
    A = np.concatenate([slides[:, left].real, slides[:, left].imag])
    if np.linalg.matrix_rank(A, tol=SINGULAR_VALUE_PARALLEL) < len(left):
        return np.full(len(left), np.nan)
    return np.asarray(np.abs(np.linalg.pinv(A)) @ np.concatenate([others, others]))


# -- Loop-closure equations of one group, in which every angle stands in a single cosine -------
# With complex coefficients, rows are the real parts of
#
#     Σ_d P_rd e^{iρ_d α_d} + Σ_m s_m Q_rm e^{iρ α_c(m)} + B_r = 0,
#
# d over directions, s_m the displacements on slides. A linear combination of rows has the same
# form, and the range of each of its terms over a box is exact, so that preconditioning
# overestimates nothing but the sum.

#: Denominators of gear ratios up to which all revolutions of the wheels are searched.
TEETH = 400

Box = tuple[np.ndarray, np.ndarray]


class LoopRows:
    """The rows of one group as arrays, and their ranges over boxes (boxes, unknowns).

    `angles`, `slides`: Unknowns: angles first.
    `revolutions` (angles,): How many revolutions of each angle are searched.
    `scale`: Size of the rows [length].
    `units` (unknowns,): What of each weighs as a radian: 1, of displacements the size of the rows.
    `displacement_bound` (slides,): Displacements that are searched.
    `bounded`: Whether no position lies beyond them.
    """

    def __init__(
        self,
        loops: np.ndarray,
        slides: np.ndarray,
        constant: np.ndarray,
        angle_index: list[int],
        ratio: list[float],
        along: list[int],
    ) -> None:
        negative = np.array(ratio) < 0.0
        self.angle_index, self.ratio = (
            np.array(angle_index, dtype=int),
            np.abs(np.array(ratio, dtype=float)),
        )
        self.along = along
        self.P = np.concatenate([loops, -1j * loops])
        self.Q = np.concatenate([slides, -1j * slides])
        self.P[:, negative] = self.P[:, negative].conj()
        for m, d in enumerate(along):
            if d >= 0 and negative[d]:
                self.Q[:, m] = self.Q[:, m].conj()
        self.B = np.concatenate([constant.real, constant.imag])
        self.angles, self.slides = 1 + max(angle_index, default=-1), slides.shape[1]
        self.revolutions = np.ones(self.angles)
        for v, parts in self._ratios().items():
            self.revolutions[v] = lcm(*(part.denominator for part in parts))
        self.scale = float(np.abs(loops).sum() + np.abs(constant).sum()) or 1.0
        self.units = np.concatenate([np.ones(self.angles), np.full(self.slides, self.scale)])
        self.displacement_bound, self.bounded = slide_bounds(
            loops, slides, constant, along, self.scale
        )

    def _ratios(self) -> dict[int, list[Fraction]]:
        found: dict[int, list[Fraction]] = {}
        for v, ratio in zip(self.angle_index, self.ratio, strict=True):
            part = Fraction(float(ratio)).limit_denominator(TEETH)
            if abs(float(part) - ratio) > BOX_RATIO_SAME:
                raise NotCovered(f"a ratio of angles, {ratio:.6g}, has no small numbers of teeth")
            found.setdefault(int(v), []).append(part)
        return found

    def extended(self, P: np.ndarray, Q: np.ndarray, B: np.ndarray, along: list[int]) -> LoopRows:
        """Other rows of the same angles, with numbers more: coefficients by row, not by loop."""
        made = copy(self)
        made.P, made.Q, made.B, made.along = P, Q, B, along
        made.slides = Q.shape[1]
        made.units = np.concatenate([self.units, np.ones(made.slides - self.slides)])
        return made

    @property
    def unknowns(self) -> int:
        """Angles and displacements."""
        return self.angles + self.slides

    def _units(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """e^{iρα} of directions (points, directions), and of the slides."""
        e = np.exp(1j * self.ratio * x[:, self.angle_index])
        t = np.ones((len(x), self.slides), dtype=complex)
        for m, d in enumerate(self.along):
            if d >= 0:
                t[:, m] = e[:, d]
        return e, t

    def values(self, x: np.ndarray) -> np.ndarray:
        """f (points, rows) [length] at points (points, unknowns)."""
        e, t = self._units(x)
        s = x[:, self.angles :]
        return np.asarray((e @ self.P.T).real + ((t * s) @ self.Q.T).real + self.B)

    def jacobian(self, x: np.ndarray) -> np.ndarray:
        """∂f/∂x (points, rows, unknowns)."""
        e, t = self._units(x)
        J = np.zeros((len(x), len(self.B), self.unknowns))
        for d, v in enumerate(self.angle_index):
            J[:, :, v] += self.ratio[d] * (1j * self.P[:, d] * e[:, None, d]).real
        J[:, :, self.angles :] = (self.Q * t[:, None, :]).real
        for m, d in enumerate(self.along):
            if d >= 0:
                rotated = (1j * self.Q[:, m] * t[:, None, m]).real
                s = x[:, None, self.angles + m]
                J[:, :, self.angle_index[d]] += self.ratio[d] * s * rotated
        return J

    def inverse(self, x: np.ndarray, none: float) -> np.ndarray:
        """The inverse of ∂f/∂x (points, unknowns, rows), without singular values below a part of
        the greatest.
        """
        return np.linalg.pinv(self.jacobian(x) * self.units, rcond=none) * self.units[:, None]

    def _arguments(self, box: Box) -> Box:
        """Ranges of ρα by direction."""
        return self.ratio * box[0][:, self.angle_index], self.ratio * box[1][:, self.angle_index]

    def _slide_cosines(self, q: np.ndarray, m: int, arguments: Box) -> Box:
        """Range of Re(q e^{iρα}) of slide m, q (boxes, rows)."""
        d = self.along[m]
        if d < 0:
            return q.real, q.real
        shift, size = np.angle(q), np.abs(q)
        low, high = cosine_range(arguments[0][:, None, d] + shift, arguments[1][:, None, d] + shift)
        return size * low, size * high

    def derivatives(self, Y: np.ndarray, box: Box) -> Box:
        """Ranges of Y ∂f/∂x over boxes: (boxes, n, unknowns), Y (boxes, n, rows)."""
        arguments = self._arguments(box)
        P = 1j * (Y @ self.P)
        shift, size = np.angle(P), np.abs(P)
        a, b = cosine_range(arguments[0][:, None] + shift, arguments[1][:, None] + shift)
        low = np.zeros((*P.shape[:2], self.unknowns))
        high = np.zeros_like(low)
        for d, v in enumerate(self.angle_index):
            low[:, :, v] += self.ratio[d] * size[:, :, d] * a[:, :, d]
            high[:, :, v] += self.ratio[d] * size[:, :, d] * b[:, :, d]
        for m, d in enumerate(self.along):
            q, column = Y @ self.Q[:, m], self.angles + m
            low[:, :, column], high[:, :, column] = self._slide_cosines(q, m, arguments)
            if d >= 0:
                rotated = self._slide_cosines(1j * q, m, arguments)
                own = products(rotated, (box[0][:, None, column], box[1][:, None, column]))
                low[:, :, self.angle_index[d]] += self.ratio[d] * own[0]
                high[:, :, self.angle_index[d]] += self.ratio[d] * own[1]
        return low, high

    def cut(self, Y: np.ndarray, box: Box, alive: np.ndarray, open_by: float = 0.0) -> np.ndarray:
        """Shrink boxes, in place, by the rows Y f = 0; `alive` marks those that may hold a root.

        LoopRows may be open by `open_by` of their size.
        """
        lo, hi = box
        arguments = self._arguments(box)
        P, constant = Y @ self.P, Y @ self.B
        size, shift = np.abs(P), np.angle(P)
        a, b = cosine_range(arguments[0][:, None] + shift, arguments[1][:, None] + shift)
        low, high = size * a, size * b
        cosines = [self._slide_cosines(Y @ self.Q[:, m], m, arguments) for m in range(self.slides)]
        sliding = [
            products(c, (lo[:, None, self.angles + m], hi[:, None, self.angles + m]))
            for m, c in enumerate(cosines)
        ]
        total = np.abs(low).sum(2) + np.abs(high).sum(2) + np.abs(constant)
        least, greatest = low.sum(2) + constant, high.sum(2) + constant
        for p in sliding:
            total += np.abs(p[0]) + np.abs(p[1])
            least, greatest = least + p[0], greatest + p[1]
        slack = BOX_WIDENING_ROUNDING * total + open_by * self.scale * np.abs(Y).sum(2)
        least, greatest = least - slack, greatest + slack
        alive = alive & ((least <= 0.0) & (greatest >= 0.0)).all(1)
        # of each term what the others leave:  −(greatest − high) ≤ term ≤ −(least − low)
        strong = size > BOX_COEFFICIENT_NONE * total[:, :, None]
        left = low - least[:, :, None], high - greatest[:, :, None]
        self._cut_angles(box, left, np.where(strong, size, 0.0), shift)
        for m, (cosine, own) in enumerate(zip(cosines, sliding, strict=True)):
            none = BOX_COEFFICIENT_NONE * total / self.units[self.angles + m]
            self._cut_slide(box, m, cosine, (own[1] - greatest, own[0] - least), none)
        return alive & (lo <= hi).all(1)

    def _cut_angles(self, box: Box, left: Box, size: np.ndarray, shift: np.ndarray) -> None:
        """Shrink angles by size cos(ρα + shift) within what the other terms leave."""
        lo, hi = box
        strong = size > 0.0
        divisor = np.where(strong, size, 1.0)
        top, bottom = left[0] / divisor, left[1] / divisor
        top, bottom = np.where(strong, top, 1.0), np.where(strong, bottom, -1.0)
        empty = (top < -1.0 - BOX_WIDENING_ROUNDING) | (bottom > 1.0 + BOX_WIDENING_ROUNDING)
        least_angle = np.maximum(np.arccos(np.clip(top, -1.0, 1.0)) - BOX_WIDENING_ROUNDING, 0.0)
        greatest_angle = np.minimum(
            np.arccos(np.clip(bottom, -1.0, 1.0)) + BOX_WIDENING_ROUNDING, np.pi
        )
        least_angle, greatest_angle = (
            np.where(empty, 0.0, least_angle),
            np.where(empty, np.pi, greatest_angle),
        )
        from_low = (self.ratio * lo[:, self.angle_index])[:, None] + shift
        from_high = -(self.ratio * hi[:, self.angle_index])[:, None] - shift
        below = (first_within(from_low, least_angle, greatest_angle) - shift).max(
            1
        ) - BOX_WIDENING_ROUNDING
        above = (
            -(first_within(from_high, least_angle, greatest_angle) + shift).max(1)
            + BOX_WIDENING_ROUNDING
        )
        for d, v in enumerate(self.angle_index):
            dead = empty[:, :, d].any(1)
            lo[:, v] = np.where(dead, np.inf, np.maximum(lo[:, v], below[:, d] / self.ratio[d]))
            hi[:, v] = np.minimum(hi[:, v], above[:, d] / self.ratio[d])

    def _cut_slide(self, box: Box, m: int, cosine: Box, left: Box, none: np.ndarray) -> None:
        """Shrink a displacement by s · cosine within what the other terms leave, where the cosine
        keeps its sign and is more than `none`.
        """
        lo, hi = box
        column = self.angles + m
        positive, negative = cosine[0] > none, cosine[1] < -none
        one, other = np.where(negative, -cosine[1], cosine[0]), cosine[1]
        other = np.where(negative, -cosine[0], other)
        sound = positive | negative
        one, other = np.where(sound, one, 1.0), np.where(sound, other, 1.0)
        low = np.where(negative, -left[1], left[0])
        high = np.where(negative, -left[0], left[1])
        least = np.minimum(low / one, low / other)
        greatest = np.maximum(high / one, high / other)
        margin = BOX_WIDENING_ROUNDING * (self.units[column] + np.abs(least) + np.abs(greatest))
        least = np.where(sound, least - margin, -np.inf).max(1)
        greatest = np.where(sound, greatest + margin, np.inf).min(1)
        lo[:, column] = np.maximum(lo[:, column], least)
        hi[:, column] = np.minimum(hi[:, column], greatest)

    def krawczyk(self, Y: np.ndarray, middle: np.ndarray, box: Box) -> Box:
        """Krawczyk's operator about `middle`, with the ranges of the derivatives over the boxes."""
        low, high = self.derivatives(Y, box)
        one = np.eye(self.unknowns)[None]
        step = np.einsum("bij,bj->bi", Y, self.values(middle))
        away = (box[0] - middle)[:, None, :], (box[1] - middle)[:, None, :]
        p = products((one - high, one - low), away)
        slack = BOX_WIDENING_ROUNDING * (
            np.abs(p[0]).sum(2) + np.abs(p[1]).sum(2) + np.abs(middle) + self.units
        )
        # the rounding of f goes through Y
        slack += BOX_WIDENING_ROUNDING * 1e-3 * self.scale * np.abs(Y).sum(2)
        return middle - step + p[0].sum(2) - slack, middle - step + p[1].sum(2) + slack


@dataclass
class _Edge:
    """One pair: p_j − p_i + Σ terms + Σ slides + constant = 0."""

    i: int
    j: int
    terms: dict[int, complex]
    slides: dict[int, complex]
    constant: complex = 0j


class GroupRows:
    """The rows of a group for one state of what is solved before it.

    `names`: Unknown angles, by the names of `Linkage.variable`.
    `slide_of`: The number of the displacement of a slide, by its pair.
    `free`: The number of the displacement that is the value of a released driver of a length, -1
      without one.
    """

    def __init__(
        self, linkage: Linkage, group: Group, state: State, stages: tuple[int, ...] = ()
    ) -> None:
        self.linkage, self.group, self.state = linkage, group, state
        # how many pairs are used at most for the tree, stage by stage
        self.stages = stages or (len(group.pairs),)
        self.names = list(group.angles)
        for p in group.pairs:
            pair = linkage.pairs[p]
            if pair.kind == "rod" and linkage.variable[pair.rod] not in (
                *self.names,
                *state[0],
                -1,
            ):
                self.names.append(linkage.variable[pair.rod])
        self.directions: dict[tuple[int, float], int] = {}
        self.along: list[int] = []
        self.slide_of: dict[int, int] = {}
        self.free = -1
        self.edges = [self._edge(p) for p in group.pairs]
        order, loops = self._loops()
        self.order = order
        A = np.zeros((len(loops), len(self.directions)), dtype=complex)
        S = np.zeros((len(loops), len(self.along)), dtype=complex)
        B = np.zeros(len(loops), dtype=complex)
        for n, loop in enumerate(loops):
            for k, sign in loop.items():
                edge = self.edges[k]
                B[n] += sign * edge.constant
                for d, c in edge.terms.items():
                    A[n, d] += sign * c
                for m, c in edge.slides.items():
                    S[n, m] += sign * c
        position = {v: n for n, v in enumerate(self.names)}
        angle_numbers = [position[v] for v, _ in self.directions]
        missing = sorted(set(range(len(self.names))) - set(angle_numbers))
        if missing:
            raise NotCovered(f"no loop says the angle of '{linkage.names[self.names[missing[0]]]}'")
        ratio = [r for _, r in self.directions]
        self.rows = LoopRows(A, S, B, angle_numbers, ratio, self.along)

    def _edge(self, p: int) -> _Edge:
        pair = self.linkage.pairs[p]
        edge = _Edge(pair.i, pair.j, {}, {})
        self._add(edge, pair.j, pair.position_j)
        self._add(edge, pair.i, -pair.position_i)
        if pair.free:
            along = pair.rod if pair.kind == "rod" else pair.i
            direction, factor = self._unit(along)
            edge.slides[len(self.along)] = -factor * (1.0 if pair.kind == "rod" else pair.axis)
            self.free = len(self.along)
            self.along.append(direction)
        elif pair.kind == "rod":
            self._add(edge, pair.rod, -pair.value)
        elif pair.kind == "slide":
            self._add(edge, pair.i, -pair.value * pair.axis)
        if pair.kind == "slide":
            self.slide_of[p] = len(self.along)
            direction, factor = self._unit(pair.i)
            edge.slides[len(self.along)] = -1j * pair.axis * factor
            self.along.append(direction)
        for body, sign in ((pair.j, 1.0), (pair.i, -1.0)):
            if body not in self.group.bodies:
                edge.constant += sign * self.state[1][body]
        edge.i = edge.i if edge.i in self.group.bodies else -1
        edge.j = edge.j if edge.j in self.group.bodies else -1
        return edge

    def _unit(self, k: int) -> tuple[int, complex]:
        """Direction among those of the rows, -1 where it is known, and a factor."""
        linkage = self.linkage
        v, offset = linkage.variable[k], linkage.offset[k]
        if v in self.names:
            key = v, linkage.ratio[k]
            return self.directions.setdefault(key, len(self.directions)), cmath.exp(1j * offset)
        return -1, cmath.exp(1j * linkage.angle(k, self.state[0]))

    def _add(self, edge: _Edge, k: int, vector: complex) -> None:
        if vector == 0j:
            return
        direction, factor = self._unit(k)
        if direction < 0:
            edge.constant += vector * factor
        else:
            edge.terms[direction] = edge.terms.get(direction, 0j) + vector * factor

    def _loops(self) -> tuple[list[tuple[int, int, int, float]], list[dict[int, float]]]:
        """A spanning tree from what is known, as (body, from, edge, sign), and the loops that the
        other edges close, as signs of edges.
        """
        paths: dict[int, dict[int, float]] = {-1: {}}
        order: list[tuple[int, int, int, float]] = []
        used: set[int] = set()
        for last in self.stages:
            going = True
            while going:
                going = False
                for k, edge in enumerate(self.edges[:last]):
                    if k in used or (edge.i in paths) == (edge.j in paths):
                        continue
                    ahead = edge.i in paths
                    new, old, sign = (edge.j, edge.i, -1.0) if ahead else (edge.i, edge.j, 1.0)
                    paths[new] = dict(paths[old])
                    paths[new][k] = paths[new].get(k, 0.0) + sign
                    order.append((new, old, k, sign))
                    used.add(k)
                    going = True
        loops = []
        for k, edge in enumerate(self.edges):
            if k in used:
                continue
            total = {k: 1.0}
            for node, sign in ((edge.j, 1.0), (edge.i, -1.0)):
                for e, s in paths[node].items():
                    total[e] = total.get(e, 0.0) + sign * s
            loops.append({e: s for e, s in total.items() if s})
        return order, loops

    def solved(self, x: np.ndarray) -> State:
        """The state with what this group adds, at its unknowns (unknowns,)."""
        angles = dict(self.state[0]) | {v: float(x[n]) for n, v in enumerate(self.names)}
        places = dict(self.state[1])
        slides = x[len(self.names) :]
        units = {d: cmath.exp(1j * ratio * angles[v]) for (v, ratio), d in self.directions.items()}
        found = {-1: 0j}
        for new, old, k, sign in self.order:
            edge = self.edges[k]
            total = edge.constant + sum(c * units[d] for d, c in edge.terms.items())
            for m, c in edge.slides.items():
                unit = 1.0 if self.along[m] < 0 else units[self.along[m]]
                total += c * float(slides[m]) * unit
            found[new] = found[old] + sign * total
        places |= {b: p for b, p in found.items() if b >= 0}
        return angles, places


#: So many narrow boxes are no isolated roots.
MANY = 600
#: Of the bound of a displacement, what weighs as a radian.
QUARTER = 4.0
NEWTON = 7


@dataclass(frozen=True)
class BoxRoots:
    """Roots found in a box, and the boxes left undecided.

    `points` (roots, unknowns)
    `low`, `high` (open, unknowns): Boxes neither excluded nor settled.
    `boxes`: How many were examined.
    `spent`: Whether it stopped because the number of boxes allowed was spent.
    """

    points: np.ndarray
    low: np.ndarray
    high: np.ndarray
    boxes: int
    spent: bool = False


def all_roots(rows: LoopRows, most: int, displacement_bound: np.ndarray | None = None) -> BoxRoots:
    """All real roots, angles within their revolutions, displacements up to `displacement_bound`
    (slides,), by default those of the rows; after `most` boxes the others are left open.
    """
    return _BoxSearch(rows, most, displacement_bound).run()


class _BoxSearch:
    def __init__(self, rows: LoopRows, most: int, displacement_bound: np.ndarray | None) -> None:
        self.rows, self.most = rows, most
        self.displacement_bound = (
            rows.displacement_bound if displacement_bound is None else displacement_bound
        )
        n = rows.unknowns
        self.weight = np.concatenate([np.ones(rows.angles), QUARTER / self.displacement_bound])
        self.points = np.empty((0, n))
        self.open: list[Box] = []

    def run(self) -> BoxRoots:
        rows, n = self.rows, self.rows.unknowns
        if not n:
            closes = (
                np.abs(rows.values(np.zeros((1, 0)))).max(initial=0.0)
                <= BOX_SPARE_ROWS_OPEN * rows.scale
            )
            return BoxRoots(np.zeros((int(closes), 0)), np.empty((0, 0)), np.empty((0, 0)), 0)
        if not rows.angles and len(rows.B) == n:
            only = self._linear()
            if only is not None:
                return BoxRoots(only, np.empty((0, n)), np.empty((0, n)), 1)
        half = np.concatenate([np.pi * rows.revolutions, self.displacement_bound])[None]
        lo, hi, count, spent = -half, half.copy(), 0, False
        while len(lo):
            count += len(lo)
            spent = count > self.most
            narrow = ((hi - lo) * self.weight).max(1).min() < BOX_WIDTH_NARROW and len(lo) > MANY
            if spent or narrow:
                self.open.append((lo, hi))
                break
            lo, hi = self._shrunk((lo, hi))
            if len(lo):
                lo, hi = self._unsettled((lo, hi))
            if len(lo):
                lo, hi = self._halved((lo, hi))
        low = np.concatenate([np.empty((0, n)), *(box[0] for box in self.open)])
        high = np.concatenate([np.empty((0, n)), *(box[1] for box in self.open)])
        return BoxRoots(self.points, low, high, count, spent)

    def _linear(self) -> np.ndarray | None:
        """The one root (1, slides) of slides in known directions; None where these are parallel."""
        zero = np.zeros((1, self.rows.slides))
        J = self.rows.jacobian(zero)[0]
        if np.linalg.svd(J, compute_uv=False)[-1] < SINGULAR_VALUE_PRECONDITIONER:
            return None
        return -np.linalg.solve(J, self.rows.values(zero)[0])[None]

    def _shrunk(self, box: Box) -> Box:
        rows = self.rows
        lo, hi = box
        every = np.repeat(np.eye(len(rows.B))[None], len(lo), 0)
        alive = self._cut(every, (lo, hi))
        lo, hi = lo[alive], hi[alive]
        for _ in range(2):
            if not len(lo):
                break
            middle = 0.5 * (lo + hi)
            Y = rows.inverse(middle, SINGULAR_VALUE_PRECONDITIONER)
            alive = self._cut(Y, (lo, hi))
            lo, hi, middle, Y = lo[alive], hi[alive], middle[alive], Y[alive]
            if not len(lo):
                break
            if len(rows.B) <= rows.unknowns:
                middle = np.clip(middle, lo, hi)
                a, b = rows.krawczyk(Y, middle, (lo, hi))
                lo, hi = np.maximum(lo, a), np.minimum(hi, b)
                alive = (lo <= hi).all(1)
                lo, hi = lo[alive], hi[alive]
        return lo, hi

    def _cut(self, Y: np.ndarray, box: Box) -> np.ndarray:
        """Shrink boxes, in place, by the rows Y f = 0; which may hold a root."""
        rows = self.rows
        spare = BOX_SPARE_ROWS_OPEN if len(rows.B) > rows.unknowns else 0.0
        return rows.cut(Y, box, np.ones(len(box[0]), dtype=bool), spare)

    def _unsettled(self, box: Box) -> Box:
        """Boxes that are not covered by a box with one root, which is kept."""
        rows, (lo, hi) = self.rows, box
        x = self._newton(0.5 * (lo + hi))
        half_width = BOX_INFLATED * np.maximum(np.abs(x - lo), np.abs(x - hi))
        half_width += BOX_INFLATED_LEAST * rows.units
        testable = np.isfinite(x).all(1) & (half_width * self.weight < 2.0).all(1)
        settled = np.zeros(len(lo), dtype=bool)
        if testable.any():
            points, half = x[testable], half_width[testable]
            Y = rows.inverse(points, SINGULAR_VALUE_BOX_ROOT)
            a, b = rows.krawczyk(Y, points, (points - half, points + half))
            good = ((a > points - half) & (b < points + half)).all(1)
            settled[np.flatnonzero(testable)[good]] = True
            for root in points[good]:
                # with rows to spare a root of their combinations may be none of their own
                if np.abs(rows.values(root[None])).max() <= BOX_SPARE_ROWS_OPEN * rows.scale:
                    self._keep(root)
        return lo[~settled], hi[~settled]

    def _newton(self, x: np.ndarray) -> np.ndarray:
        rows = self.rows
        for _ in range(NEWTON):
            inverse = rows.inverse(x, SINGULAR_VALUE_BOX_ROOT)
            step = np.einsum("bij,bj->bi", inverse, rows.values(x))
            x = x - np.clip(step, -1.0 / self.weight, 1.0 / self.weight)
        return x

    def _keep(self, root: np.ndarray) -> None:
        angles = self.rows.angles
        away = self.points - root
        period = 2.0 * np.pi * self.rows.revolutions
        away[:, :angles] -= period * np.round(away[:, :angles] / period)
        if not len(away) or (np.abs(away) * self.weight).max(1).min() > BOX_ROOTS_SAME:
            self.points = np.concatenate([self.points, root[None]])

    def _halved(self, box: Box) -> Box:
        lo, hi = box
        width = (hi - lo) * self.weight
        tiny = width.max(1) < BOX_WIDTH_SMALLEST
        if tiny.any():
            # Krawczyk's operator may have shrunk a box to a point after the rows were looked at
            low, high = lo[tiny], hi[tiny]
            alive = self._cut(np.repeat(np.eye(len(self.rows.B))[None], len(low), 0), (low, high))
            self.open.append((low[alive], high[alive]))
        lo, hi, width = lo[~tiny], hi[~tiny], width[~tiny]
        widest, every = width.argmax(1), np.arange(len(lo))
        half = 0.5 * (lo[every, widest] + hi[every, widest])
        first, second = hi.copy(), lo.copy()
        first[every, widest] = second[every, widest] = half
        return np.concatenate([lo, second]), np.concatenate([first, hi])
