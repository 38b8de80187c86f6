"""Zeros of the residual force on a surface of closed positions, each of them, by division of its
charts.

Around every place of a cover its tangent plane is a chart y of the surface, and the residual force
is a function G(y) of two components there; around a point where a load jumps, as of a spring whose
ends meet, the chart is polar; where they meet in a curve, both sides of it are known
(`surface_cells`). A cell of a chart is excluded where some direction separates zero from G at its
corners by more than the error of linear interpolation, which second differences of G bound; it
holds one zero at most where J⁻¹ ∂G/∂y, J being the mean Jacobian matrix of the cell, differs from
the identity by less than one. Other cells are divided.

Charts are divided together, so that the residual force is evaluated at many points at once.

A cell in which a chart ends is left to another only where that leads to the same positions; where
none does, small charts go on. So do they where the border of a chart lies on no other. A zero
counts for a chart that leads to it: another sheet may lie above the same place of a tangent plane.

On a closed surface the winding numbers of G around zeros and jumps sum up to the Euler
characteristic, which is even: so their number is even where each is one. Each border across which
the loads drive inward takes one from the characteristic.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field

import numpy as np

from mbody.analysis.equilibria.position_surface import (
    FINEST,
    Cover,
    JumpPoint,
    LoadEnds,
    PolarChart,
    SurfaceSamples,
    TangentChart,
    chart_positions,
    ends_of,
    hold,
    may_meet,
    meetings,
    without_whole_revolutions,
)
from mbody.analysis.position.tangent_space import Array, Place
from mbody.core import tolerances as tol

# -- Zeros of the residual force on a surface: Newton's method from many points of charts at once --

#: Newton steps in a cell.
ITERATIONS = 15

Polish = Callable[[Place], "Place | None"]
Corner = tuple[int, int]


@dataclass(frozen=True, eq=False)
class Zero:
    """A zero, and whether the stiffness is singular there."""

    place: Place
    name: Array
    singular: bool


@dataclass(frozen=True, eq=False)
class SoughtCell:
    """A cell in which a zero is sought, and coordinates to begin from."""

    chart: TangentChart
    y: Array
    corner: Corner
    size: int


class SurfaceZeros:
    """All that were found on a surface."""

    def __init__(self, cover: Cover, polish: Polish) -> None:
        self.cover, self.polish = cover, polish
        self.every: list[Zero] = []
        self._names = np.empty((0, len(cover.nodes[0].name)))

    def search(self, sought: Sequence[SoughtCell]) -> None:
        """Keep the zeros to which Newton's method leads from points of cells, if it does not lead
        further away than a cell is long.
        """
        if not sought:
            return
        many, scale = self.cover.many, self.cover.scale
        found = chart_positions([one.chart for one in sought], np.array([one.y for one in sought]))
        ended = list[tuple[int, Place]]()
        left, which = np.flatnonzero(found.good), np.flatnonzero(found.good)
        for n in range(ITERATIONS + 1):
            if not left.size:
                break
            places = many.places(found, which)
            if n == ITERATIONS:
                ended += zip(left.tolist(), places, strict=True)
                break
            kept = [
                k
                for k, (one, place) in enumerate(zip(left.tolist(), places, strict=True))
                if np.isfinite(place.force).all() and self._is_adjacent(sought[one], place.q)
            ]
            left, places = left[kept], [places[k] for k in kept]
            if not left.size:
                break
            q, motions, rows, force, residual = (
                np.array([getattr(place, name) for place in places])
                for name in ("q", "motions", "rows", "force", "residual")
            )
            K = many.stiffness(q, motions, rows, force)
            steady = np.isfinite(K).all(axis=(1, 2))
            left, q, motions = left[steady], q[steady], motions[steady]
            step = np.einsum(
                "nab,nb->na",
                np.linalg.pinv(K[steady], rcond=tol.LEAST_SQUARES_RANK_FINE),
                residual[steady],
            )
            found = many.closed(q + scale * np.einsum("na,nac->nc", step, motions), motions)
            short = found.good & (np.linalg.norm(step, axis=1) < tol.CELL_STEP_NEAR)
            ends = np.flatnonzero(short)
            ended += zip(left[ends].tolist(), many.places(found, ends), strict=True)
            which = np.flatnonzero(found.good & ~short)
            left = left[which]
        for _, place in sorted(ended, key=lambda pair: pair[0]):
            self._keep(place)

    def _is_adjacent(self, sought: SoughtCell, q: Array) -> bool:
        at = sought.chart.grid(self.cover.seen(sought.chart.node, q))
        return bool(np.abs((at - sought.corner) / sought.size - 0.5).max() <= 1.5)

    def _keep(self, nearby: Place) -> None:
        """Keep the zero beside a place where it is new."""
        if not np.isfinite(nearby.force).all() or self._is_known(self.cover.name(nearby.q)):
            return
        place = self.polish(nearby)
        if place is None or len(place.motions) != 2:
            return
        name = self.cover.name(place.q)
        if not self._is_known(name):
            sizes = np.linalg.svd(self.cover.manifold.stiffness(place))[1]
            self.every.append(
                Zero(place, name, bool(sizes[-1] <= tol.CELL_STIFFNESS_SINGULAR * sizes[0]))
            )
            self._names = np.vstack([self._names, name])

    def _is_known(self, name: Array) -> bool:
        return bool((np.abs(self._names - name).max(axis=1) <= tol.POSITION_SAME_FINE).any())

    def known(self, chart: TangentChart, corner: Corner, size: int, margin: float) -> Zero | None:
        """A zero that was found in a cell, or beside it by a part of its size."""
        self.read([chart])
        for zero, at in chart.zeros:
            if np.abs((at - corner) / size - 0.5).max() <= 0.5 + margin:
                return zero
        return None

    def read(self, charts: Iterable[TangentChart]) -> None:
        """Let charts know the zeros that they lead to, and where these are on their grids: all
        that were found meanwhile at once, on rows without end hundreds.
        """
        new = [chart for chart in dict.fromkeys(charts) if chart.zeros_read < len(self.every)]
        pairs = list[tuple[TangentChart, Zero]]()
        for chart in new:
            distance = np.abs(self._names[chart.zeros_read :] - chart.node.name).max(axis=1)
            nearby = np.flatnonzero(distance <= 4.0 * chart.node.radius) + chart.zeros_read
            pairs += [(chart, self.every[n]) for n in nearby]
            chart.zeros_read = len(self.every)
        holding = hold([chart for chart, _ in pairs], np.array([one.place.q for _, one in pairs]))
        for (chart, zero), leads in zip(pairs, holding.tolist(), strict=True):
            if leads:
                at = chart.grid(self.cover.seen(chart.node, zero.place.q))
                chart.zeros.append((zero, at))


# -- Cells of charts, many at once: in which of them the residual force has no zero, or a single one
# A cell is excluded where some direction separates zero from the residual force at its corners by
# more than the error of linear interpolation, which second differences bound. Where the ends of a
# load come close within a cell its direction is not known between the corners: there what is left
# of the residual force must be separated from zero by more than the load may give in any direction.
# Of a load whose ends meet in a curve that goes through the cell both sides are known: where it
# outweighs the others, there is no zero beside the curve.

#: Directions among which one that separates zero is sought.
DIRECTIONS = 32

_ANGLES = np.arange(DIRECTIONS) * (2.0 * np.pi / DIRECTIONS)
UNIT_CIRCLE = np.column_stack([np.cos(_ANGLES), np.sin(_ANGLES)])


def _quarters(grid: Array) -> Array:
    """The corners (cells, 4, 2, 2, …) of the four parts of cells (cells, 3, 3, …)."""
    parts = [grid[:, m : m + 2, n : n + 2] for m in (0, 1) for n in (0, 1)]
    return np.stack(parts, axis=1)


def _second_differences(grid: Array) -> tuple[Array, Array]:
    """Second differences (cells, 3, …) along both axes of cells (cells, 3, 3, …)."""
    return (
        grid[:, 1, :] - 0.5 * (grid[:, 0, :] + grid[:, 2, :]),
        grid[:, :, 1] - 0.5 * (grid[:, :, 0] + grid[:, :, 2]),
    )


def _separated(corners: Array, second_differences: Sequence[Array]) -> Array:
    """By how much each direction separates zero from what corners (parts, 2, 2, 2) interpolate:
    (parts, directions); errors are a quarter of the bends of a cell twice as long.
    """
    least = (corners.reshape(len(corners), 4, 2) @ UNIT_CIRCLE.T).min(axis=1)
    return np.asarray(least - _error(second_differences))


def _error(second_differences: Sequence[Array]) -> Array:
    every = [
        np.abs(second_difference @ UNIT_CIRCLE.T).max(axis=1)
        for second_difference in second_differences
    ]
    return np.asarray(0.25 * tol.SURFACE_ERROR_SURE * sum(every))


class ChartCells:
    """The quarters of some cells whose nine samples are known: (cells, 4) each.

    `empty`: Whether there is no zero, those on a nonsmooth line left out.
    `single`: Whether there is one zero at most.
    `part` (cells, 4, 2): Where the interpolation has its zero, in parts of the quarter from its
      corner on.
    `outside`: Whether that is too far away to be in a quarter that has one at most.
    `inward`: The number of a load, among those that are sharp, that drives to its nonsmooth line
      from both sides of a quarter in which the residual force along the nonsmooth line has a zero;
      −1 of none.
    `rotating` (cells, 4, loads): Loads whose direction is not known between the corners.
    """

    def __init__(
        self,
        samples: SurfaceSamples,
        charts: Sequence[TangentChart],
        numbers: Array,
        creased: Array,
    ) -> None:
        self.samples, self.creased = samples, creased
        grid = samples.residual[numbers]
        corners, second_differences = _quarters(grid), _second_differences(grid)
        shape = corners.shape[:2]
        flat = corners.reshape(-1, 2, 2, 2)
        every = [
            np.repeat(second_difference, 4, axis=0) for second_difference in second_differences
        ]
        self._ends(charts, numbers, shape)
        clear = ~self.rotating.any(axis=-1)
        gaps = _separated(flat, every).max(axis=1).reshape(shape)
        self.empty = clear & (gaps > 0.0)
        self.inward = np.full(shape, -1)
        self._linear(flat, every, shape)
        self.single &= clear & ~self.empty
        self._nonsmooth_lines(numbers, np.argwhere(~clear))

    def _ends(self, charts: Sequence[TangentChart], numbers: Array, shape: tuple[int, ...]) -> None:
        """Which loads turn quickly."""
        grid = self.samples.ends[numbers]  # (cells, 3, 3, loads, 2)
        loads = grid.shape[3]
        ends = _quarters(grid)
        self.rotating = np.zeros((*shape, loads), dtype=bool)
        self.crossed = np.zeros((*shape, loads), dtype=bool)
        if not (loads and len(grid)):
            return
        along = [np.linalg.norm(np.diff(ends, axis=n), axis=-1).max(axis=(2, 3)) for n in (2, 3)]
        moved = np.hypot(*along)
        for n, chart in enumerate(charts):
            moved[n] = chart.is_small_rotation(ends[n], moved[n])
        lengths = np.linalg.norm(ends, axis=-1)
        self.rotating = moved > lengths.min(axis=(2, 3))
        for load in np.flatnonzero(self.creased):
            d = ends[..., load, :].reshape(*shape, 4, 2)
            long = lengths[..., load].reshape(*shape, 4)
            u = d / np.maximum(long, tol.TINY)[..., None]
            line = np.take_along_axis(u, long.argmax(axis=-1)[..., None, None], axis=2)
            across = np.abs(u[..., 0] * line[..., 1] - u[..., 1] * line[..., 0])
            on_line = (
                (across <= tol.SURFACE_ENDS_ONE_LINE) | (long <= tol.SURFACE_ENDS_NONSMOOTH)
            ).all(axis=-1)
            signed = (d * line).sum(axis=-1)
            whole = np.einsum("cijx,cqx->cqij", grid[:, :, :, load], line[:, :, 0])
            bent = [
                np.abs(second_difference).max(axis=1).reshape(shape)
                for second_difference in _second_differences(whole.reshape(-1, 3, 3))
            ]
            least = signed.min(axis=-1) - 0.25 * tol.SURFACE_ERROR_SURE * (bent[0] + bent[1])
            crossing = on_line & (least > 0.0)
            self.rotating[..., load] &= ~crossing
            self.crossed[..., load] = on_line & ~crossing & self.rotating[..., load]

    def _linear(
        self, corners: Array, second_differences: Sequence[Array], shape: tuple[int, ...]
    ) -> None:
        """Where the mean Jacobian matrix J shows one zero at most: J⁻¹ ∂G/∂y near the identity."""
        count = len(corners)
        along = corners[:, 1, :] - corners[:, 0, :], corners[:, :, 1] - corners[:, :, 0]
        J = np.stack([mean_derivative.mean(axis=1) for mean_derivative in along], axis=-1)
        top = np.abs(J).max(axis=(1, 2))
        good = np.abs(np.linalg.det(J)) > tol.CELL_DETERMINANT_NONE * top**2
        B = np.zeros_like(J)
        B[good] = np.linalg.inv(J[good])
        errors, off = [], []
        for mean_derivative, second_difference, unit in zip(
            along, second_differences, np.eye(2), strict=True
        ):
            error = tol.SURFACE_ERROR_SURE * np.linalg.norm(
                np.einsum("nkx,nyx->nky", second_difference, B), axis=2
            ).max(axis=1)
            deviation = np.einsum("nkx,nyx->nky", mean_derivative, B) - unit
            errors.append(error)
            off.append(np.linalg.norm(deviation, axis=2).max(axis=1) + error)
        differs = np.hypot(*off)
        single = good & (differs <= tol.CELL_ONE_ZERO)
        part = np.full((count, 2), 0.5)
        on = single.copy()
        for _ in range(8):
            x, z = part[on, 0], part[on, 1]
            weights = np.stack([(1.0 - x) * (1.0 - z), (1.0 - x) * z, x * (1.0 - z), x * z], axis=1)
            value = np.einsum("nk,nkx->nx", weights, corners[on].reshape(-1, 4, 2))
            part[on] -= np.einsum("nyx,nx->ny", B[on], value)
            on[on] = np.abs(part[on] - 0.5).max(axis=1) <= 2.0
        # by how much the zero may be beside that of the interpolation
        shift = 0.25 * sum(errors) / np.maximum(1.0 - differs, 1.0 - tol.CELL_ONE_ZERO)
        outside = np.abs(part - 0.5).max(axis=1) > 0.5 + np.maximum(tol.CELL_ZERO_FOLLOWED, shift)
        self.single = single.reshape(shape)
        self.part = part.reshape(*shape, 2)
        self.outside = outside.reshape(shape)

    def _nonsmooth_lines(self, numbers: Array, which: Array) -> None:
        """Exclude quarters in which directions of loads are not known; those with the same loads
        together.
        """
        along = self.samples.load_ends.along
        sets = self.rotating[which[:, 0], which[:, 1]]
        for own in np.unique(sets, axis=0):
            rotating = np.flatnonzero(own)
            if along[rotating].all():
                self._lines_in_set(numbers, which[(sets == own).all(axis=1)], rotating)

    def _lines_in_set(self, numbers: Array, which: Array, rotating: Array) -> None:
        """Decides quarters of cells, (quarters, 2), in which some loads rotate fast."""
        samples = self.samples
        nine = numbers[which[:, 0]]
        four = _quarters(nine)[np.arange(len(nine)), which[:, 1]].reshape(-1, 4)
        remaining = samples.residual[nine] - samples.own[nine][:, :, :, rotating].sum(axis=3)
        error = _error(_second_differences(remaining))
        corners = samples.residual[four] - samples.own[four][:, :, rotating].sum(axis=2)
        part = corners @ UNIT_CIRCLE.T
        force = samples.force[nine.reshape(-1, 9)][:, :, rotating]
        spread = np.ptp(force, axis=1)
        # what a load may give in each direction: F |derivatives · w|
        derivatives = samples.derivatives[four][:, :, rotating]
        sizes = np.linalg.norm(derivatives @ UNIT_CIRCLE.T, axis=3).max(axis=1)
        most = (force.max(axis=1) + tol.SURFACE_ERROR_SURE * spread)[:, :, None] * sizes
        empty = (part.min(axis=1) - error - most.sum(axis=1) > 0.0).any(axis=1)
        for k, load in enumerate(rotating):
            ends = samples.ends[four][:, :, load]
            long = np.linalg.norm(ends, axis=2)
            off = long > tol.SURFACE_ENDS_NONSMOOTH
            line = ends[np.arange(len(ends)), long.argmax(axis=1)]
            signed = np.einsum("nkx,nx->nk", ends, line)
            own = samples.own[four][:, :, load]
            given = np.sign(signed)[:, :, None] * (own @ UNIT_CIRCLE.T)
            given = np.where(off[:, :, None], given, np.inf).min(axis=1)
            given = given - tol.SURFACE_ERROR_SURE * spread[:, k, None] * sizes[:, k]
            others = np.abs(part).max(axis=1) + error + most.sum(axis=1) - most[:, k]
            outweighs = self.crossed[which[:, 0], which[:, 1], load] & ~empty
            outweighs &= (given - others > 0.0).any(axis=1)
            empty |= outweighs
            u = ends / np.maximum(long, tol.TINY)[:, :, None]
            pull = np.einsum("nka,nkax,nkx->nk", u, derivatives[:, :, k], own)
            inward = outweighs & ((pull < 0.0) | ~off).all(axis=1)
            for n in np.flatnonzero(inward):
                across = derivatives[n, :, k].mean(axis=0).T @ line[n]
                if _meets(signed[n], corners[n], across):
                    self.inward[tuple(which[n])] = load
        self.empty[which[empty, 0], which[empty, 1]] = True


def _meets(signed: Array, corners: Array, across: Array) -> bool:
    """Whether the residual force along a nonsmooth line, interpolated between four corners (4,) and
    (4, 2), has a zero on it within them, or beside them by a tenth.
    """
    values = np.column_stack([signed, corners @ [-across[1], across[0]]])
    a, b, c, d = values
    J = 0.5 * np.column_stack([c + d - a - b, b + d - a - c])
    top = np.abs(J).max(axis=1)
    if abs(np.linalg.det(J)) <= tol.CELL_DETERMINANT_NONE * float(top.prod()):
        return True
    part = 0.5 - np.linalg.solve(J, values.mean(axis=0))
    return bool(np.abs(part - 0.5).max() <= 0.6)


#: Cells of a chart at which Newton's method is tried where nothing is certain yet, a power of two:
#: zeros of rows without end are met there.
TRIED = FINEST // 2**3
#: Cells down to which a chart that does not reach their corners is divided, whether other charts go
#: on there or not, and those at which its end is followed no further.
FOLDED, RIM = FINEST // 2, FINEST // 2**6
#: Number of charts that go on where others end.
PATCHES = 600
#: By how much charts overlap beyond halfway to their neighbours.
OVERLAP = 1.15
#: The part of the radius of a polar chart within which other charts leave their cells to it.
WITHIN_DISC = 0.9
#: Cells around a finest one in which nothing is certain, where a zero is sought.
LEFT = FINEST // 2**6
#: Places that are kept at most because nothing is certain there.
DOUBTS = 3
#: Evaluations of the residual force at most.
MOST = 20_000
#: Places on the circle on which the winding number around a jump begins, and how often the arc
#: between neighbours is halved.
CIRCLE, HALVINGS = 16, 16


@dataclass
class SurfaceRoots:
    """Equilibria and doubtful positions found on a surface.

    `equilibria`: Where the residual force is zero.
    `jumps`: Beside a place towards which loads drive from all sides, and which no position
      balances.
    `unsure`: Where no number of zeros is certain.
    `index`: Sum of the winding numbers of the residual force around jumps of the loads.
    `creased`: Whether loads jump in curves, along which zeros have no winding number.
    """

    equilibria: list[Place] = field(default_factory=list)
    jumps: list[Place] = field(default_factory=list)
    unsure: list[Place] = field(default_factory=list)
    index: int = 0
    creased: bool = False


def surface_roots(cover: Cover, polish: Polish) -> SurfaceRoots:
    """All zeros of the residual force on a covered surface."""
    return _SurfaceIsolation(cover, polish).found


@dataclass(frozen=True, eq=False)
class _Cell:
    chart: TangentChart
    corner: Corner

    def parts(self, half: int) -> list[_Cell]:
        i, j = self.corner
        return [_Cell(self.chart, (i + m * half, j + n * half)) for m in (0, 1) for n in (0, 1)]

    def points(self, half: int) -> list[Corner]:
        i, j = self.corner
        return [(i + m * half, j + n * half) for m in range(3) for n in range(3)]


class _SurfaceIsolation:
    def __init__(self, cover: Cover, polish: Polish) -> None:
        self.cover = cover
        self.found = SurfaceRoots()
        self.zeros = SurfaceZeros(cover, polish)
        self.charts: dict[int, TangentChart] = {}
        self.patches: list[TangentChart] = []
        ends = ends_of(cover)
        meets = may_meet(cover, ends)
        # what neighbours show of the residual force says nothing of a load that turns between them
        open_ = np.flatnonzero(meets.any(axis=1) | ~cover.excluded()).tolist()
        met = meetings(cover, ends, open_, meets)
        self.points, self.creased = met.points, np.array(met.creased, dtype=bool)
        self.found.creased = bool(self.creased.any())
        self.ends = LoadEnds(cover.manifold.system, met.sharp)
        self.samples = SurfaceSamples(cover, self.ends)
        self.isolate(open_)
        self.found.equilibria = [zero.place for zero in self.zeros.every]

    def isolate(self, open_: list[int]) -> None:
        """Find the zeros around some places of the cover."""
        for point in self.points:
            self.around(point)
        new = [self.chart_of(n) for n in open_]
        begun = 0
        while new:
            self.examine(new)
            if self.samples.count > MOST:
                self.doubt(new[0].node.place.q)
                return
            self.surround(new)
            new, begun = self.patches[begun:], len(self.patches)

    def surround(self, charts: Sequence[TangentChart]) -> None:
        """Go on by small charts where the border of one lies on no other."""
        sought = list[tuple[TangentChart, Array]]()
        middle = FINEST // 2
        for chart in charts:
            if self.cover.full or chart.node in self.cover.rim:
                continue
            ends = (0, middle, FINEST)
            for point in itertools.product(ends, ends):
                number = chart.samples.get(point)
                if point == (middle, middle) or number is None:
                    continue
                q = self.samples.q[number]
                if np.isfinite(q).all() and not self.cover.has_run_away(q):
                    sought.append((chart, q))
        for (chart, q), known in zip(sought, self.on_others(sought), strict=True):
            if not (known or self.on_patch(chart, q) or self.patch(chart, q)):
                self.doubt(q)

    def examine(self, charts: Sequence[TangentChart]) -> list[TangentChart]:
        """Find the zeros of charts; those of which their number is not certain."""
        self.jumps = {chart: self.jumps_on(chart) for chart in charts}
        self.left: dict[TangentChart, Array] = {}
        cells, size = [_Cell(chart, (0, 0)) for chart in charts], FINEST
        while cells and self.samples.count <= MOST:
            cells, size = self.divide(cells, size), size // 2
        # what was not divided any more
        for cell in cells:
            number = cell.chart.samples.get(cell.corner)
            if number is not None and self.samples.leads(np.array([number]))[0]:
                self.left.setdefault(cell.chart, self.samples.q[number])
        for q in self.left.values():
            self.doubt(q)
        return list(self.left)

    def jumps_on(self, chart: TangentChart) -> list[JumpPoint]:
        """The jumps that a chart leads to; one of another sheet above the same place has nothing
        to do with this one.
        """
        if isinstance(chart, PolarChart):
            return []
        names = [np.abs(self.cover.name(one.q) - chart.node.name).max() for one in self.points]
        nearby = [n for n, distance in enumerate(names) if distance < 4.0 * chart.node.radius]
        return [self.points[n] for n in nearby if chart.holds(self.points[n].q)]

    def doubt(self, q: Array) -> None:
        """Keep a position where no number of zeros is certain; of some beside each other one,
        and of many a few."""
        if len(self.found.unsure) < DOUBTS:
            self.keep_new(q, self.found.unsure, tol.SURFACE_SPACING)

    def keep_new(self, q: Array, places: list[Place], distance: float) -> None:
        """Keep a position among places if its name differs from theirs by more than `distance`."""
        name = self.cover.name(q)
        if all(np.abs(name - self.cover.name(other.q)).max() > distance for other in places):
            place = self.cover.manifold.place(q)
            places += [place] if place is not None else []

    def sampled(self, cells: Sequence[_Cell], half: int) -> Array:
        """Numbers of the nine samples of cells: (cells, 3, 3)."""
        points = [cell.points(half) for cell in cells]
        new = dict.fromkeys(
            (cell.chart, point)
            for cell, own in zip(cells, points, strict=True)
            for point in own
            if point not in cell.chart.samples
        )
        if new:
            y = np.array([chart.y(*point) for chart, point in new])
            numbers = self.samples.add([chart for chart, _ in new], y)
            for (chart, point), number in zip(new, numbers.tolist(), strict=True):
                chart.samples[point] = number
        every = [
            [cell.chart.samples[point] for point in own]
            for cell, own in zip(cells, points, strict=True)
        ]
        return np.array(every).reshape(-1, 3, 3)

    def divide(self, cells: list[_Cell], size: int) -> list[_Cell]:
        """Find the zeros of cells, `size` finest cells long; the quarters that stay open."""
        half = size // 2
        numbers = self.sampled(cells, half)
        whole = np.isfinite(self.samples.residual[numbers]).all(axis=(1, 2, 3))
        onward = self.ended([cells[n] for n in np.flatnonzero(~whole)], size)
        cells = [cells[n] for n in np.flatnonzero(whole)]
        if not cells:
            return onward
        charts = [cell.chart for cell in cells]
        known = ChartCells(self.samples, charts, numbers[whole], self.creased)
        self.keep_inward(known, numbers[whole])
        open_ = [
            (cells[n].parts(half)[k], known.single[n, k], known.outside[n, k], known.part[n, k])
            for n, k in np.argwhere(~known.empty)
        ]
        open_ = [one for one in open_ if not self.in_disc_of_jump(one[0], half)]
        charts = [
            cell.chart
            for cell, single, outside, _ in open_
            if (not outside if single else half == TRIED)
        ]
        sought, doubtful = list[SoughtCell](), list[tuple[_Cell, bool]]()
        self.zeros.read(charts)
        for cell, single, outside, part in open_:
            if single and outside:
                continue
            chart, corner = cell.chart, cell.corner
            if single:
                doubtful.append((cell, True))
                if self.zeros.known(chart, corner, half, tol.CELL_ZERO_WITHIN) is None:
                    i, j = corner + half * np.clip(part, 0.0, 1.0)
                    sought.append(SoughtCell(chart, chart.y(i, j), corner, half))
                continue
            doubtful.append((cell, False))
            if half == TRIED and self.zeros.known(chart, corner, half, 1.0) is None:
                i, j = np.add(corner, 0.5 * half)
                sought.append(SoughtCell(chart, chart.y(i, j), corner, half))
        self.zeros.search(sought)
        left = list[_Cell]()
        self.zeros.read(charts)
        for cell, single in doubtful:
            if (
                single
                and self.zeros.known(cell.chart, cell.corner, half, tol.CELL_ZERO_WITHIN)
                is not None
            ):
                continue
            if half == TRIED:
                zero = self.zeros.known(cell.chart, cell.corner, half, 1.0)
                if zero is not None and zero.singular:
                    continue
            left.append(cell)
        if half > 1:
            return onward + left
        self.leave(left)
        return onward

    def keep_inward(self, known: ChartCells, numbers: Array) -> None:
        """Keep places on nonsmooth lines to which loads drive from both sides."""
        for n, k in np.argwhere(known.inward >= 0):
            self.keep_new(
                self.samples.q[numbers[n, k // 2, k % 2]],
                self.found.jumps,
                tol.SURFACE_NONSMOOTH_SAME,
            )

    def leave(self, cells: Iterable[_Cell]) -> None:
        """Keep finest cells in which nothing is certain, and the zeros near them, if there are."""
        sought = list[SoughtCell]()
        for cell in cells:
            chart, (i, j) = cell.chart, cell.corner
            around = i - LEFT // 2, j - LEFT // 2
            if self.zeros.known(chart, around, LEFT, 0.0) is None:
                sought.append(SoughtCell(chart, chart.y(i + 0.5, j + 0.5), around, LEFT))
            self.left.setdefault(chart, self.samples.q[chart.samples[cell.corner]])
        self.zeros.search(sought)

    def ended(self, cells: list[_Cell], size: int) -> list[_Cell]:
        """Leave cells in which charts end to others, where these go on; the parts of those that
        are divided.
        """
        half, onward = size // 2, list[_Cell]()
        sought = list[_Cell]()
        for cell in cells:
            # no other chart looks into the disc of a polar one
            if size < FOLDED and not isinstance(cell.chart, PolarChart):
                sought.append(cell)
            elif half > RIM:
                onward += cell.parts(half)
            elif isinstance(cell.chart, PolarChart):
                self.left.setdefault(cell.chart, cell.chart.node.place.q)
            else:
                self.close(cell, half)
        reached = [self.reached(cell, half) for cell in sought]
        every = [(cell.chart, q) for cell, own in zip(sought, reached, strict=True) for q in own]
        holders = iter(self.holding(every))
        for cell, own in zip(sought, reached, strict=True):
            others = [next(holders) for _ in own]
            # charts that were examined before may have left it meanwhile
            if all(any(chart.left_open(at) for chart, at in one) for one in others):
                cell.chart.left.append((cell.corner, size))
            elif half > RIM:
                onward += cell.parts(half)
            else:
                self.close(cell, half)
        return onward

    def close(self, cell: _Cell, half: int) -> None:
        """Go on by small charts where one ends within a small cell, and no other goes on."""
        chart = cell.chart
        reached = self.reached(cell, half)
        sought = [(chart, q) for q in reached]
        for q, known in zip(reached, self.on_others(sought), strict=True):
            if not (known or self.on_patch(chart, q) or self.patch(chart, q)):
                self.left[chart] = q
        chart.left.append((cell.corner, 2 * half))

    def patch(self, chart: TangentChart, q: Array) -> bool:
        """Add a small chart around a position on another; whether there may be one more."""
        place = self.cover.manifold.place(q) if len(self.patches) < PATCHES else None
        if place is None or len(place.motions) != 2:
            return False
        half_width = tol.CHART_WIDTH_MOST
        while half_width > tol.CHART_WIDTH_LEAST:
            node = self.cover.node(place, chart.node.frame, half_width)
            corner = np.full(2, half_width)
            patch = TangentChart(self.cover, node, -corner, corner)
            if patch.is_level():
                self.patches.append(patch)
                return True
            half_width *= 0.5
        return False

    def reached(self, cell: _Cell, half: int) -> list[Array]:
        """The positions at the points of a cell to which its chart leads."""
        numbers = np.array([cell.chart.samples[point] for point in cell.points(half)])
        return list(self.samples.q[numbers[self.samples.leads(numbers)]])

    def candidates(
        self, sought: Sequence[tuple[TangentChart, Array]]
    ) -> list[list[tuple[TangentChart, Array]]]:
        """Other charts above whose rectangles positions are, the nearest first, and where."""
        every = list[list[tuple[TangentChart, Array]]]([] for _ in sought)
        if not sought:
            return every
        cover = self.cover
        q = np.array([one for _, one in sought])
        names = cover.name(q)
        k, n, distance = cover.within(names, 2.0 * tol.SURFACE_SPACING)
        order = np.lexsort((distance, k))
        number = np.unique(n)
        charts = [self.chart_of(int(one)) for one in number]
        k, which = k[order], np.searchsorted(number, n[order])
        if self.patches:
            both = np.meshgrid(np.arange(len(q)), np.arange(len(self.patches)), indexing="ij")
            k = np.append(k, both[0].ravel())
            which = np.append(which, both[1].ravel() + len(charts))
            charts += self.patches
        origin = np.array([chart.node.place.q for chart in charts])
        frames = np.array([chart.node.frame for chart in charts])
        low = np.array([chart.low for chart in charts])
        step = np.array([chart.step for chart in charts])
        displacement = without_whole_revolutions((q[k] - origin[which]) / cover.scale)
        at = (np.einsum("nfc,nc->nf", frames[which], displacement) - low[which]) / step[which]
        inside = ((at >= 0.0) & (at <= FINEST)).all(axis=1)
        for number_, chart, own in zip(k[inside], which[inside], at[inside], strict=True):
            if charts[chart] is not sought[number_][0]:
                every[number_].append((charts[chart], own))
        return every

    def holding(
        self, sought: Sequence[tuple[TangentChart, Array]]
    ) -> list[list[tuple[TangentChart, Array]]]:
        """Which other charts lead to positions, and where on their grids these are."""
        every = self.candidates(sought)
        charts = [other for own in every for other, _ in own]
        positions = [q for (_, q), own in zip(sought, every, strict=True) for _ in own]
        leading = iter(hold(charts, np.array(positions)).tolist())
        return [[one for one in own if next(leading)] for own in every]

    def on_others(self, sought: Sequence[tuple[TangentChart, Array]]) -> list[bool]:
        """Whether positions are on other charts, in no cell that these left."""
        every = [
            [one for one in own if one[0].left_open(one[1])] for own in self.candidates(sought)
        ]
        found, n = [False] * len(sought), 0
        left = [k for k, own in enumerate(every) if own]
        while left:
            charts = [every[k][n][0] for k in left]
            leading = hold(charts, np.array([sought[k][1] for k in left]))
            for k, own in zip(left, leading.tolist(), strict=True):
                found[k] = own
            n += 1
            left = [k for k in left if not found[k] and n < len(every[k])]
        return found

    def on_patch(self, chart: TangentChart, q: Array) -> bool:
        """Whether a position is on one of the small charts."""
        for other in self.patches:
            at = other.grid(self.cover.seen(other.node, q))
            if other is not chart and other.left_open(at) and other.holds(q):
                return True
        return False

    def chart_of(self, number: int) -> TangentChart:
        """The chart around a place of the cover."""
        if number not in self.charts:
            bounds = self.cover.box(number, OVERLAP)
            self.charts[number] = TangentChart(self.cover, self.cover.nodes[number], *bounds)
        return self.charts[number]

    def in_disc_of_jump(self, cell: _Cell, size: int) -> bool:
        """Whether a cell lies within the disc of a jump, which has a chart of its own."""
        points = self.jumps[cell.chart]
        if not points:
            return False
        i, j = cell.corner
        corners = [cell.chart.samples[i + m, j + n] for m in (0, size) for n in (0, size)]
        return any(self.in_disc(point, self.samples.q[corners]) for point in points)

    def in_disc(self, point: JumpPoint, ends: Array) -> bool:
        """Whether positions are within the disc around a jump."""
        offsets = self.cover.seen(point.node, ends) - point.y
        return bool(np.linalg.norm(offsets, axis=1).max() < WITHIN_DISC * point.radius)

    def around(self, point: JumpPoint) -> None:
        """The zeros in the disc around a jump, and the winding number there."""
        chart = PolarChart(self.cover, point, self.ends)
        if self.examine([chart]):
            return
        angles = [float(n) for n in np.arange(CIRCLE + 1) * (FINEST / CIRCLE)]
        residuals = list(self.on_circle(chart, angles))
        for _ in range(HALVINGS):
            rotations = _rotations(np.array(residuals))
            wide = np.flatnonzero(~(np.abs(rotations) < tol.JUMP_ANGLE)).tolist()
            if not wide:
                break
            middles = [0.5 * (angles[n] + angles[n + 1]) for n in wide]
            new = self.on_circle(chart, middles)
            for n, angle, residual in reversed(list(zip(wide, middles, new, strict=True))):
                angles.insert(n + 1, angle)
                residuals.insert(n + 1, residual)
        whole = float(_rotations(np.array(residuals)).sum())
        if not np.isfinite(whole):
            return
        self.found.index += round(whole / (2.0 * np.pi))
        outward = np.array([chart.y(0, angle) for angle in angles]) - point.y
        found = chart_positions([chart], chart.y(0, 0)[None])
        if found.good[0] and (np.sum(outward * np.array(residuals), axis=1) < 0.0).all():
            self.found.jumps += self.cover.many.places(found, [0])

    def on_circle(self, chart: PolarChart, angles: list[float]) -> Array:
        """The residual force on the innermost circle of a polar chart: (angles, 2)."""
        y = np.array([chart.y(0, angle) for angle in angles])
        numbers = self.samples.add([chart] * len(y), y)
        return self.samples.residual[numbers]


def _rotations(residuals: Array) -> Array:
    """Angles between neighbouring residual forces (places, 2) of a circle: (places − 1,)."""
    a, b = residuals[:-1], residuals[1:]
    return np.arctan2(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0], (a * b).sum(axis=1))
