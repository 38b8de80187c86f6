"""Zeros of the drive on a surface of closed positions, each of them, by division of its charts.

Around every place of a cover its tangent plane is a chart y of the surface, and the drive is a
function G(y) of two components there; around a point where a load jumps, as of a spring whose ends
meet, the chart is polar. A cell of a chart is excluded where some direction separates zero from G
at its corners by more than the error of linear interpolation, which second differences of G bound;
it holds one zero at most where J⁻¹ ∂G/∂y, J being the mean Jacobian matrix of the cell, differs
from the identity by less than one. Other cells are divided.

A cell in which a chart ends is left to another only where that leads to the same positions; where
none does, small charts go on. So do they where the border of a chart lies on no other. A zero
counts for a chart that leads to it: another sheet may lie above the same place of a tangent plane.

On a closed surface the winding numbers of G around zeros and jumps sum up to the Euler
characteristic, which is even: so their number is even where each is one. Each border across which
the loads drive inward takes one from the characteristic.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from mbody.analysis.equilibria.jump_points import JumpPoint, jump_points, may_meet
from mbody.analysis.equilibria.surface_charts import FINEST, PolarChart, TangentChart
from mbody.analysis.equilibria.surface_cover import SPACING, Cover, CoverNode
from mbody.analysis.position.tangent_space import Array, Place

__all__ = ["SurfaceRoots", "surface_roots"]

#: Cells of a chart at which Newton's method is tried where nothing is certain yet, a power of two:
#: zeros of rows without end are met there.
TRIED = FINEST // 2**3
#: Cells down to which a chart that does not reach their corners is divided, whether other charts go
#: on there or not, and those at which its end is followed no further.
FOLDED, RIM = FINEST // 2, FINEST // 2**6
#: Half the width of charts that go on where others end, at most and at least, and their number.
WIDEST, NARROWEST, PATCHES = 0.2, 1e-3, 600
#: The error of interpolation, as a multiple of what second differences show.
SURE = 2.0
#: Directions among which one that separates zero is sought.
DIRECTIONS = 32
#: Difference from the identity below which a cell holds one zero at most.
ALONE = 0.9
#: How far outside its cell, in parts of it, a zero of the interpolation is followed at least, and
#: one that was found counts for it.
FOLLOWED, WITHIN = 0.6, 0.3
#: The part of the radius of a polar chart within which other charts leave their cells to it.
WITHIN_DISC = 0.9
#: Cells around a finest one in which nothing is certain, where a zero is sought.
LEFT = FINEST // 2**6
#: Places that are kept at most because nothing is certain there.
DOUBTS = 3
#: Evaluations of the drive at most.
MOST = 20_000
#: A stiffness with a singular value below this part of the greatest is singular, and zeros whose
#: names differ by less than this are one.
SINGULAR, SAME = 1e-7, 1e-7
#: Newton steps in a cell, and the length of one after which the search's own method ends it.
ITERATIONS, NEAR = 15, 1e-6
#: Places on the circle on which the winding number around a jump begins, the greatest angle between
#: the drives of neighbours, and how often their arc is halved.
CIRCLE, ANGLE, HALVINGS = 16, 1.0, 16

Polish = Callable[[Place], "Place | None"]
Corner = tuple[int, int]


@dataclass
class SurfaceRoots:
    """What a surface showed.

    Attributes
    ----------
    rests : list of Place
        Where the drive is zero.
    jumps : list of Place
        Beside a place towards which loads drive from all sides, and which no position balances.
    unsure : list of Place
        Where no number of zeros is certain.
    index : int
        Sum of the winding numbers of the drive around jumps of the loads.
    """

    rests: list[Place] = field(default_factory=list)
    jumps: list[Place] = field(default_factory=list)
    unsure: list[Place] = field(default_factory=list)
    index: int = 0


def surface_roots(cover: Cover, polish: Polish) -> SurfaceRoots:
    """All zeros of the drive on a covered surface.

    Parameters
    ----------
    polish : callable
        The rest position that is nearest to a place close by; None where there is none.
    """
    return _SurfaceIsolation(cover, polish).found


@dataclass
class _Zero:
    place: Place
    name: Array
    singular: bool


class _SurfaceIsolation:
    def __init__(self, cover: Cover, polish: Polish) -> None:
        self.cover, self.polish = cover, polish
        self.found = SurfaceRoots()
        self.zeros: list[_Zero] = []
        self.charts: dict[CoverNode, TangentChart] = {}
        self.patches: list[TangentChart] = []
        self.spent = 0
        self.chart: TangentChart | None = None
        self.read, self.listed = 0, list[tuple[_Zero, Array]]()
        angles = np.arange(DIRECTIONS) * (2.0 * np.pi / DIRECTIONS)
        self.ways = np.column_stack([np.cos(angles), np.sin(angles)])
        # what neighbours show of the drive says nothing of a load that turns between them
        open_ = [node for node in cover.nodes if not cover.excluded(node) or may_meet(cover, node)]
        self.points, self.sharp = jump_points(cover, open_)
        self.isolate(open_)
        self.found.rests = [zero.place for zero in self.zeros]

    def isolate(self, open_: list[CoverNode]) -> None:
        """Find the zeros around some places of the cover."""
        for point in self.points:
            self.around(point)
        for node in open_:
            self.examine(self.chart_of(node))
            if self.spent > MOST:
                self.doubt(node.place)
                return
        for node in open_:
            self.surround(self.chart_of(node))
        for patch in self.patches:  # grows on the way
            self.examine(patch)
            self.surround(patch)
            if self.spent > MOST:
                self.doubt(patch.node.place)
                return

    def surround(self, chart: TangentChart) -> None:
        """Go on by small charts where the border of one lies on no other."""
        if self.cover.full or chart.node in self.cover.rim:
            return
        for i, j in itertools.product((0, FINEST // 2, FINEST), repeat=2):
            place = chart.places.get((i, j))
            if place is None or (2 * i, 2 * j) == (FINEST, FINEST) or self.cover.far(place.q):
                continue
            if not (self.on_other(chart, place.q) or self.patch(chart, place)):
                self.doubt(place)

    def examine(self, chart: TangentChart) -> bool:
        """Find the zeros of a chart; whether their number is certain."""
        # one of another sheet above the same place has nothing to do with this one
        self.near = [
            point
            for point in self.points
            if np.abs(self.cover.name(point.q) - chart.node.name).max() < 4.0 * chart.node.reach
            and not isinstance(chart, PolarChart)
            and chart.holds(point.q)
        ]
        self.left: Place | None = None
        self.divide(chart, (0, 0), FINEST)
        self.spent += chart.evaluations
        if self.left is not None:
            self.doubt(self.left)
        return self.left is None

    def doubt(self, place: Place) -> None:
        """Keep a place where no number of zeros is certain; of some beside each other one,
        and of many a few."""
        name = self.cover.name(place.q)
        others = [self.cover.name(other.q) for other in self.found.unsure]
        new = all(np.abs(name - other).max() > SPACING for other in others)
        if new and len(others) < DOUBTS:
            self.found.unsure.append(place)

    def divide(self, chart: TangentChart, corner: Corner, size: int) -> None:
        """Find the zeros of a cell from a corner on, `size` finest cells long."""
        if self.spent + chart.evaluations > MOST:
            return
        half = size // 2
        i, j = corner
        grid = np.array(
            [[chart.drive(i + m * half, j + n * half) for n in range(3)] for m in range(3)]
        )
        parts = list(itertools.product(range(2), repeat=2))
        if not np.isfinite(grid).all():
            if self.go_on(chart, corner, size):
                chart.left.append((corner, size))
                return
            if half <= RIM:
                self.close(chart, corner, size)
                return
            for m, n in parts:
                self.divide(chart, (i + m * half, j + n * half), half)
            return
        bends = (
            grid[1, :] - 0.5 * (grid[0, :] + grid[2, :]),
            grid[:, 1] - 0.5 * (grid[:, 0] + grid[:, 2]),
        )
        for m, n in parts:
            cell, at = grid[m : m + 2, n : n + 2], (i + m * half, j + n * half)
            if self.beside_jump(chart, at, half):
                continue
            resolved = chart.resolved(*at, half)
            if resolved and self.excluded(cell, bends):
                continue
            if resolved and self.alone(chart, cell, bends, at, half):
                continue
            if half == TRIED and self.tried(chart, at, half):
                continue
            if half > 1:
                self.divide(chart, at, half)
            else:
                self.leave(chart, at)

    def leave(self, chart: TangentChart, at: Corner) -> None:
        """Keep a finest cell in which nothing is certain, and the zero near it, if there is one."""
        around = at[0] - LEFT // 2, at[1] - LEFT // 2
        y = chart.y(at[0] + 0.5, at[1] + 0.5)
        if self.known(chart, around, LEFT, 0.0) is None:
            self.search(chart, y, around, LEFT)
        self.left = chart.place(y)

    def go_on(self, chart: TangentChart, corner: Corner, size: int) -> bool:
        """Whether other charts go on where one ends within a cell."""
        if size >= FOLDED:
            return False
        if isinstance(chart, PolarChart):
            return False  # no other looks into its disc
        return all(self.on_other(chart, place.q) for place in self.places_of(chart, corner, size))

    def close(self, chart: TangentChart, corner: Corner, size: int) -> None:
        """Go on by small charts where one ends within a small cell, and no other goes on."""
        if isinstance(chart, PolarChart):
            self.left = chart.node.place
            return
        for place in self.places_of(chart, corner, size):
            if not (self.on_other(chart, place.q) or self.patch(chart, place)):
                self.left = place
        chart.left.append((corner, size))

    def patch(self, chart: TangentChart, place: Place) -> bool:
        """Add a small chart around a place of another; whether there may be one more."""
        if len(self.patches) == PATCHES:
            return False
        half_width = WIDEST
        while half_width > NARROWEST:
            node = self.cover.node(place, chart.node.frame, half_width)
            patch = TangentChart(self.cover, node, self.sharp)
            patch.resize(half_width)
            if patch.is_level():
                self.patches.append(patch)
                return True
            half_width *= 0.5
        return False

    def places_of(self, chart: TangentChart, corner: Corner, size: int) -> list[Place]:
        """The positions at the points of a cell to which its chart leads."""
        (i, j), half = corner, size // 2
        points = [(i + m * half, j + n * half) for m in range(3) for n in range(3)]
        return [chart.places[point] for point in points if point in chart.places]

    def on_other(self, chart: TangentChart, q: Array) -> bool:
        """Whether a position is on another chart."""
        apart = self.cover.near(self.cover.name(q))
        near = np.flatnonzero(apart < 2.0 * SPACING)
        nodes = [self.cover.nodes[n] for n in near[np.argsort(apart[near])]]
        charts = [*self.patches, *(self.chart_of(node) for node in nodes)]
        return any(other.takes(q) for other in charts if other is not chart)

    def chart_of(self, node: CoverNode) -> TangentChart:
        """The chart around a place."""
        if node not in self.charts:
            self.charts[node] = TangentChart(self.cover, node, self.sharp)
        return self.charts[node]

    def beside_jump(self, chart: TangentChart, corner: Corner, size: int) -> bool:
        """Whether a cell lies within the disc of a jump, which has a chart of its own."""
        if not self.near:
            return False
        i, j = corner
        ends = [chart.places[i + m, j + n].q for m in (0, size) for n in (0, size)]
        return any(self.in_disc(point, ends) for point in self.near)

    def in_disc(self, point: JumpPoint, ends: list[Array]) -> bool:
        """Whether positions are within the disc around a jump."""
        ways = [self.cover.seen(point.node, q) - point.y for q in ends]
        return bool(np.linalg.norm(ways, axis=1).max() < WITHIN_DISC * point.radius)

    def excluded(self, cell: Array, bends: tuple[Array, Array]) -> bool:
        """Whether a direction separates zero from the drive; errors are a quarter of the bends of
        a cell twice as long.
        """
        least = (cell.reshape(4, 2) @ self.ways.T).min(axis=0)
        error = sum(np.abs(bend @ self.ways.T).max(axis=0) for bend in bends)
        return bool((least > 0.25 * SURE * error).any())

    def alone(
        self,
        chart: TangentChart,
        cell: Array,
        bends: tuple[Array, Array],
        corner: Corner,
        size: int,
    ) -> bool:
        """Whether a cell holds no zero, or a single one, which is found."""
        along = cell[1, :] - cell[0, :], cell[:, 1] - cell[:, 0]
        J = np.column_stack([way.mean(axis=0) for way in along])
        if abs(np.linalg.det(J)) <= 1e-12 * float(np.abs(J).max()) ** 2:
            return False
        B = np.linalg.inv(J)
        errors = [SURE * np.linalg.norm(bend @ B.T, axis=1).max() for bend in bends]
        off = [
            np.linalg.norm(way @ B.T - unit, axis=1).max() + error
            for way, error, unit in zip(along, errors, np.eye(2), strict=True)
        ]
        differs = float(np.hypot(*off))
        if differs > ALONE:
            return False
        part = np.array([0.5, 0.5])
        for _ in range(8):
            weights = np.outer([1.0 - part[0], part[0]], [1.0 - part[1], part[1]])
            part = part - B @ np.tensordot(weights, cell, 2)
            if np.abs(part - 0.5).max() > 2.0:
                break
        # by how much the zero may be beside that of the interpolation
        shift = 0.25 * sum(errors) / (1.0 - differs)
        if np.abs(part - 0.5).max() > 0.5 + max(FOLLOWED, shift):
            return True
        if self.known(chart, corner, size, WITHIN) is None:
            i, j = corner + size * np.clip(part, 0.0, 1.0)
            self.search(chart, chart.y(i, j), corner, size)
        return self.known(chart, corner, size, WITHIN) is not None

    def tried(self, chart: TangentChart, corner: Corner, size: int) -> bool:
        """Whether a search from the middle of a cell ends at a singular zero in it or beside it."""
        known = self.known(chart, corner, size, 1.0)
        if known is None:
            i, j = np.add(corner, 0.5 * size)
            self.search(chart, chart.y(i, j), corner, size)
            known = self.known(chart, corner, size, 1.0)
        return known is not None and known.singular

    def search(self, chart: TangentChart, y: Array, corner: Corner, size: int) -> None:
        """Keep the zero to which Newton's method leads from a point of a cell, if it does not lead
        further away than the cell is long.
        """
        manifold, here = self.cover.manifold, chart.place(y)
        for _ in range(ITERATIONS):
            if here is None or len(here.motions) != 2:
                return
            off = (chart.grid(self.cover.seen(chart.node, here.q)) - corner) / size
            if np.abs(off - 0.5).max() > 1.5:
                return
            K = manifold.stiffness(here)
            if not np.isfinite(K).all():
                return
            step = np.linalg.lstsq(K, here.drive, rcond=1e-12)[0]
            here = manifold.moved(here, step @ here.motions)
            if np.linalg.norm(step) < NEAR:
                break
        place = None if here is None else self.polish(here)
        if place is None:
            return
        name = self.cover.name(place.q)
        if all(np.abs(zero.name - name).max() > SAME for zero in self.zeros):
            sizes = np.linalg.svd(manifold.stiffness(place))[1]
            self.zeros.append(_Zero(place, name, bool(sizes[-1] <= SINGULAR * sizes[0])))

    def known(self, chart: TangentChart, corner: Corner, size: int, beside: float) -> _Zero | None:
        """A zero that was found in a cell, or beside it by a part of its size."""
        for zero, at in self.on_chart(chart):
            if np.abs((at - corner) / size - 0.5).max() <= 0.5 + beside:
                return zero
        return None

    def on_chart(self, chart: TangentChart) -> list[tuple[_Zero, Array]]:
        """The zeros that a chart leads to, and where they are on its grid."""
        if chart is not self.chart:
            self.chart, self.read, self.listed = chart, 0, []
        for zero in self.zeros[self.read :]:
            beside = np.abs(zero.name - chart.node.name).max() <= 4.0 * chart.node.reach
            if beside and chart.holds(zero.place.q):
                at = chart.grid(self.cover.seen(chart.node, zero.place.q))
                self.listed.append((zero, at))
        self.read = len(self.zeros)
        return self.listed

    def around(self, point: JumpPoint) -> None:
        """The zeros in the disc around a jump, and the winding number there."""
        chart = PolarChart(self.cover, point, self.sharp)
        if not self.examine(chart):
            return
        angles = [float(n) for n in np.arange(CIRCLE + 1) * (FINEST / CIRCLE)]
        drives = [chart.value(chart.y(0, angle)) for angle in angles]
        turns, n = 0.0, 0
        while n < len(angles) - 1:
            a, b = drives[n], drives[n + 1]
            turn = float(np.arctan2(a[0] * b[1] - a[1] * b[0], a @ b))
            if not abs(turn) < ANGLE and angles[n + 1] - angles[n] > FINEST / CIRCLE / 2**HALVINGS:
                angles.insert(n + 1, 0.5 * (angles[n] + angles[n + 1]))
                drives.insert(n + 1, chart.value(chart.y(0, angles[n + 1])))
                continue
            turns += turn
            n += 1
        if not np.isfinite(turns):
            return
        self.found.index += round(turns / (2.0 * np.pi))
        outward = np.array([chart.y(0, angle) for angle in angles]) - point.y
        place = chart.place(chart.y(0, 0))
        if place is not None and (np.sum(outward * np.array(drives), axis=1) < 0.0).all():
            self.found.jumps.append(place)
