"""The function `linkages`: motion and all forces of many linkages of different topology."""

from __future__ import annotations

import functools
from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor, as_completed
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from mbody.analysis.driven.path_following import PathEnded, Runner, lanes_output
from mbody.analysis.driven.time_grid import TimeGrid, memory
from mbody.analysis.dynamics.interruptions import counted
from mbody.analysis.position.closed_position import ClosedPosition
from mbody.core.lanes import LANES, aligned
from mbody.core.tolerances import DEAD_CENTRE_RATE, PATH_SEAM
from mbody.errors import ModelError, SolveError
from mbody.kernels.continuation import BY_TIME
from mbody.kernels.continuation_lanes import (
    LanePath,
    LinkageBatch,
    branch_distances,
    follow_linkages,
    linkage_rows,
)
from mbody.kernels.layout import PER_PRIMITIVE, Work
from mbody.model.element import whole_number
from mbody.quantities.formula import PlainNumbers
from mbody.system.pivoting import lane_workspace
from mbody.system.system import System
from mbody.topologies.plan import (
    CanonicalOrder,
    Graph,
    LinkageArrays,
    TopologyPlan,
    canonical_order,
    graph_of,
    linkage_arrays,
    planned,
    row_bytes,
)

# -- Linkages of one topology through their motion, on lanes; one that cannot go there alone ---
# A linkage has a lane of its own where there are many, else several with a piece of its motion
# each. Inside, lengths are parts of each linkage's longest link, and the motion takes τ = 0 to 1:
# with φ the angle of the driver at τ = 1 and ω its rate, time is T τ with T = φ/ω.

#: Greatest coordinate to which corrections are relative, in longest links and radians.
COORDINATE_NORM = 10.0


@dataclass(frozen=True, eq=False)
class LinkageGroup:
    """Linkages of one topology, all in canonical order.

    `par`, `mass`, `q` (rows, linkages)
    `positions` (2·joints, linkages)
    `length` (linkages,): The longest link of each, in its own unit.
    `row` (linkages,): Where the results of each are.
    `column` (linkages, numbers): And those of each of its numbers.
    `at_rest`: Whether it is statics.
    """

    plan: TopologyPlan
    par: np.ndarray
    mass: np.ndarray
    q: np.ndarray
    positions: np.ndarray
    length: np.ndarray
    row: np.ndarray
    column: np.ndarray
    at_rest: bool


def follow_group(
    group: LinkageGroup, output: np.ndarray, margins: np.ndarray
) -> dict[int, tuple[str, float]]:
    """Fill `output` (all linkages, instants, columns) and the margins (all linkages,); of each that
    failed its row, with why and the τ where.
    """
    continuation = _GroupContinuation(group, output, margins)
    continuation.on_lanes()
    return continuation.failures


class _GroupContinuation:
    """The motion of one group."""

    def __init__(self, group: LinkageGroup, output: np.ndarray, margins: np.ndarray) -> None:
        self.group, self.output, self.margins = group, output, margins
        self.failures: dict[int, tuple[str, float]] = {}
        self.analysis = "statics" if group.at_rest else "kinetostatics"
        self.tau = np.linspace(0.0, 1.0, output.shape[1])

    @functools.cached_property
    def system(self) -> System:
        """All linkages as a batch, for those that go alone."""
        group = self.group
        count = group.par.shape[1]
        return replace(group.plan.system, par=group.par, mass=group.mass, batch=count)

    def on_lanes(self) -> None:
        """All linkages: those that fill the lanes whole, the others in pieces."""
        count = self.group.par.shape[1]
        everyone = np.arange(count)
        if self.group.plan.pivots is None or len(self.tau) < 3:
            alone = everyone
        else:
            remainder = count % LANES
            pieces = LANES // remainder if 0 < remainder <= LANES // 2 else 1
            whole = everyone if pieces == 1 else everyone[: count - remainder]
            alone = self._pieces(whole, 1) if whole.size else whole
            if pieces > 1:
                alone = np.append(alone, self._pieces(everyone[count - remainder :], pieces))
        for linkage in alone.tolist():
            self._alone(linkage)

    def _pieces(self, linkages: np.ndarray, pieces: int) -> np.ndarray:
        """So many pieces of each; gives those linkages that cannot go this way."""
        group, instants = self.group, len(self.tau)
        pieces = min(pieces, (instants - 1) // 2)
        steps = -(-(instants - 1) // pieces)
        first = steps * np.arange(pieces)
        first = first[first < instants - 1]
        pieces = len(first)
        start = group.q[:, np.repeat(linkages, pieces)].copy()
        lost = np.zeros(len(linkages), dtype=bool)
        if pieces > 1:
            grid = self._grid(self.tau[first])
            for n, linkage in enumerate(linkages.tolist()):
                seeds = self._seeds(linkage, grid)
                lost[n] = seeds is None
                if seeds is not None:
                    start[: len(seeds), n * pieces : (n + 1) * pieces] = seeds
        index = first[np.arange(LANES) % pieces][None, :] + np.arange(steps + 1)[:, None]
        s = self.tau[np.minimum(index, instants - 1)]
        ends = np.minimum(first + steps, instants - 1)
        batch = self._batch(linkages, first, ends - first + 1, start.copy())
        plan, work = group.plan, group.plan.system.work(LANES)
        assert plan.pivots is not None
        path = LanePath(
            mode=BY_TIME,
            s=s,
            t=s,
            given=np.zeros((2, LANES)),
            position_norm=COORDINATE_NORM,
            with_forces=True,
            at_rest=group.at_rest,
        )
        path_output = lanes_output(np.empty((1, 1, 1)))
        lanes = lane_workspace(plan.pivots, LANES)
        follow_linkages(plan.system.layout, *plan.pivots, work, lanes, path, path_output, batch)
        failed = (batch.failed != 0.0).reshape(-1, pieces).any(axis=1) | lost
        if pieces > 1:
            shape = (len(start), len(linkages), pieces)
            gap = batch.q.reshape(shape)[:, :, :-1] - start.reshape(shape)[:, :, 1:]
            failed |= ~(np.abs(gap).max(axis=(0, 2)) <= PATH_SEAM)
        self._margins(batch, failed)
        return linkages[failed]

    def _batch(
        self, linkages: np.ndarray, first: np.ndarray, count: np.ndarray, q: np.ndarray
    ) -> LinkageBatch:
        """The bundle of all pieces of these linkages."""
        group, pieces = self.group, len(first)
        numbers, many = group.column.shape[1], len(linkages) * pieces
        positions = group.positions
        return LinkageBatch(
            par=group.par,
            mass=group.mass,
            arm=positions,
            node=group.plan.bodies,
            force_at=group.plan.force_at,
            driver=group.plan.drivers,
            length=group.length,
            member=np.repeat(linkages, pieces),
            first=np.tile(first, len(linkages)),
            count=np.tile(count, len(linkages)),
            q=q,
            failed=np.zeros(many),
            greatest=np.zeros(many),
            nearest=np.zeros_like(q),
            arms=aligned(len(positions), LANES),
            lengths=aligned(1, LANES),
            record=aligned(numbers + PER_PRIMITIVE, LANES),
            output=self.output,
            row=group.row,
            column=group.column,
        )

    def _margins(self, batch: LinkageBatch, failed: np.ndarray) -> None:
        """The margin of each linkage: its distance from another branch where the determinant of a
        block is least.
        """
        distances = np.full(len(batch.member), np.inf)
        system = self.group.plan.system
        branch_distances(system.layout, system.work(), batch, distances)
        # the piece with the least determinant, so that it does not matter into how many it is cut
        pieces = batch.greatest.reshape(len(failed), -1)
        worst = np.where(np.isfinite(pieces), pieces, -1.0).argmax(axis=1)
        least = np.sqrt(np.maximum(distances, 0.0)).reshape(pieces.shape)
        linkage = batch.member.reshape(pieces.shape)[:, 0]
        good = np.flatnonzero(~failed)
        self.margins[self.group.row[linkage[good]]] = least[good, worst[good]]

    def _grid(self, tau: np.ndarray) -> TimeGrid:
        return TimeGrid(BY_TIME, tau, tau, np.zeros((1, len(self.group.plan.drivers), 3)))

    def _work(self, linkage: int) -> Work:
        return self.system.work(designs=linkage)

    def _start(self, linkage: int) -> ClosedPosition:
        work = self._work(linkage)
        work.q[:, 0] = self.group.q[:, linkage]
        return ClosedPosition(work)

    def _seeds(self, linkage: int, grid: TimeGrid) -> np.ndarray | None:
        """Positions at the instants of a grid, (coordinates, instants), on a likely branch."""
        runner = Runner(self.system, self.analysis)
        try:
            found = runner.seeds(self._start(linkage), grid, COORDINATE_NORM)
        except (PathEnded, SolveError):
            return None
        return found[:, : self.system.coordinates].T

    def _alone(self, linkage: int) -> None:
        """One linkage on the scalar path, with shorter steps where they are needed."""
        group, row = self.group, int(self.group.row[linkage])
        runner, start = Runner(self.system, self.analysis), self._start(linkage)
        try:
            found = runner.scalar(start, self._grid(self.tau), position_norm=COORDINATE_NORM)
        except PathEnded as stuck:
            self._fail(row, self._why(stuck, start.work, linkage), stuck.place)
            return
        except SolveError:
            self._fail(row, "its reactions are not determined: a position is singular", 0.0)
            return
        record = self._linkage_record(found[:, :, 0], linkage)
        self.output[row][:, group.column[linkage]] = record
        nearest = runner.branches.distance
        self.margins[row] = np.nan if nearest is None else nearest.least

    def _why(self, stuck: PathEnded, work: Work, linkage: int) -> str:
        """Why a motion ended: at a dead centre something moves without bound by the driver, at the
        last place, the first of those behind.
        """
        L, size = self.system.layout, len(work.q)
        laws = L.law_par[L.primitive_signal[self.group.plan.drivers] // 3]
        driver_range = float(np.abs(self.group.par[laws + 1, linkage]).max())
        fastest = np.abs(work.past[size : size + self.system.coordinates, 0]).max()
        if not stuck.done:
            return "its joints do not close where they are given"
        if fastest > DEAD_CENTRE_RATE * driver_range:
            return f"dead centre: its {self._driver} cannot turn it further"
        if stuck.unsure:
            return "branches of its motion meet there, on which it goes on is not certain"
        return "its motion cannot be followed further"

    @property
    def _driver(self) -> str:
        return "driver" if len(self.group.plan.drivers) == 1 else "drivers"

    def _fail(self, row: int, why: str, tau: float) -> None:
        self.failures[row] = why, tau
        self.output[row] = np.nan
        self.margins[row] = np.nan

    def _linkage_record(self, found: np.ndarray, linkage: int) -> np.ndarray:
        """Records of all instants, from all rows of the kernel: (instants, rows)."""
        plan, n3 = self.group.plan, self.system.coordinates
        positions, length = self.group.positions[:, linkage], self.group.length[linkage]
        nodes, drivers = plan.graph.joints, len(plan.drivers)
        kept = np.zeros((len(found), linkage_rows(nodes, plan.places.shape[1], drivers)))
        q = np.concatenate([found[:, :n3], np.zeros((len(found), 3))], axis=1)
        for n, b in enumerate(plan.bodies.tolist()):
            x, y, angle = q[:, 3 * b], q[:, 3 * b + 1], q[:, 3 * b + 2]
            c, s = np.cos(angle), np.sin(angle)
            kept[:, 2 * n] = length * (x + c * positions[2 * n] - s * positions[2 * n + 1])
            kept[:, 2 * n + 1] = length * (y + s * positions[2 * n] + c * positions[2 * n + 1])
        for e, (i, j) in enumerate(plan.force_at.tolist()):
            first = 3 * n3 + PER_PRIMITIVE * e
            force = found[:, first + 2 : first + 4]
            for place, sign in ((i, -1.0), (j, 1.0)):
                if place >= 0:
                    kept[:, 2 * (nodes + place) : 2 * (nodes + place) + 2] += sign * force
        for n, e in enumerate(plan.drivers.tolist()):
            kept[:, n - drivers] = length * found[:, 3 * n3 + PER_PRIMITIVE * e + 4]
        return kept


#: Linkages of one topology that are prepared at once.
BLOCK = 4096
#: A linkage is far from the origin where its first joint is so many times as far as it is large.
DISTANCE_FACTOR = 1e3
#: Greatest number, in units of the longest link, the time of the motion and force: kernels
#: compare squares of products of two of them.
MOST = 1e60
EXTREME = (
    "its lengths, masses, speed and gravity are too far apart in size to compute with: give them "
    "in other units"
)


@dataclass(frozen=True, eq=False)
class Linkages:
    """Positions, forces and torques of many linkages; NaN where a linkage failed, or has no more
    joints or links.

    Attributes
    ----------
    angle : array (linkages, instants)
        Of the driven link from where it is given [rad]; (linkages, instants, drivers) where
        ``driver`` is given so.
    positions : array (linkages, instants, joints, 2)
        Of every joint [length].
    forces : array (linkages, instants, links, places, 2)
        Force on each link at each of its joints [force], by all others that meet there.
    torque : array (linkages, instants)
        Of the driver on the driven link [force·length]; shape as of `angle`.
    margin : array (linkages,)
        The least distance from a singular position over the motion, a number from 0 to 1.
    topology : array of int (linkages,)
        Equal numbers are equal topologies; −1 where a linkage has none.
    failures : dict
        In a sentence why, by the number of each linkage that has no results.
    """

    angle: np.ndarray
    positions: np.ndarray
    forces: np.ndarray
    torque: np.ndarray
    margin: np.ndarray
    topology: np.ndarray
    failures: dict[int, str]

    def __len__(self) -> int:
        return len(self.torque)

    def __str__(self) -> str:
        good = len(self) - len(self.failures)
        known = len(np.unique(self.topology[self.topology >= 0]))
        topologies = "1 topology" if known == 1 else f"{known} topologies"
        lines = [
            f"{len(self)} linkages of {topologies}, {self.torque.shape[1]} instants: {good} moved, "
            f"{len(self.failures)} failed"
        ]
        # sentences without their places
        kinds = Counter(why.partition(" (at ")[0] for why in self.failures.values())
        lines += [f"  {count} failed: {why}" for why, count in kinds.most_common()]
        return "\n".join(lines)


def linkages(
    arrays: Mapping[str, Any],
    *,
    instants: int = 200,
    turn: PlainNumbers = 2.0 * np.pi,
    speed: PlainNumbers = 1.0,
    gravity: tuple[float, float] = (0.0, 0.0),
    threads: int = 1,
    progress: Callable[[int, int], None] | bool | None = None,
) -> Linkages:
    """Motion, forces on every link and driver torque of many linkages of any topology: inverse
    dynamics of data sets, atlases and searches over topologies.

    Parameters
    ----------
    arrays : mapping
        By name, a row for each linkage, rows filled up with −1, and NaN where they are numbers:

        ``joints`` (linkages, joints, 2), positions at the start [length];
        ``links`` (linkages, links, places) of int, the joints of each link;
        ``ground`` (linkages, any number) of int, joints fixed to the ground;
        ``driver`` (linkages,) of int, the link that is driven, or (linkages, drivers), a link for
        each driver;
        optional ``mass``, ``inertia`` (linkages, links) and ``cg`` (linkages, links, 2), the mass
        centre at the start, by default uniform bars of unit mass a length;
        optional ``slides`` (linkages, slides, 2) of int, a joint and the link along whose line it
        slides, −1 for the ground (a joint −1 is no slide), and ``directions`` (linkages, slides),
        of these lines at the start [rad]; a line goes through its joint at the start.
    instants : int
        How many, at equal angles of the driver, both ends included.
    turn : float or array
        By how much the driver turns [rad], (linkages,), or each of them, (linkages, drivers), in
        the same time; 0 for one that is fixed, but not for the first.
    speed : float or array (linkages,)
        The constant rate of the first [rad/time]; 0 for statics.
    gravity : pair of float
        Acceleration (x, y) [length/time²].
    threads : int
    progress : callable or bool, optional
        Called with the number of finished linkages and of all; True shows it on standard error.

    Returns
    -------
    Linkages
        Positions, forces, torque, distance from singular positions; failed ones with reasons.

    Raises
    ------
    ModelError
        For arrays of a wrong shape or type, numbers that are none, or more than the memory holds.

    Notes
    -----
    Equal graphs, whatever their numbering, share one symbolic phase and go side by side on lanes.
    What fails leaves all others as they are. Forces are those of `kinetostatics` (there is one
    source of the physics), and the same to rounding however linkages are cut into calls.

    Examples
    --------
    A four-bar:

    >>> import mbody
    >>> found = mbody.linkages({
    ...     "joints": [[(0, 0), (1, 0), (3, 2), (4, 0)]],
    ...     "links": [[(0, 1), (1, 2), (2, 3)]],
    ...     "ground": [(0, 3)],
    ...     "driver": [0],
    ... })
    >>> found.positions.shape, found.forces.shape, found.failures
    ((1, 200, 4, 2), (1, 200, 3, 2, 2), {})
    """
    made, moved_by = _moved_to_origin(linkage_arrays(arrays))
    count, nodes = made.joints.shape[:2]
    instants = whole_number("instants", instants, 2)
    threads = whole_number("threads", threads)
    drivers = made.driver.shape[1]
    motion = _Motion(
        _per_driver(turn, made.driver.shape), _per_linkage("speed", speed, count), _pair(gravity)
    )
    if (motion.turn[:, :1] == 0.0).any():
        raise ModelError("turn is 0: the driver must turn, give an angle [rad]")
    bars, places = made.links.shape[1:]
    columns = 2 * nodes + 2 * bars * places + drivers
    wanted, there = 8.0 * count * instants * columns, memory()
    if wanted > there:
        raise ModelError(
            f"{count} linkages at {instants} instants take {wanted / 1e9:.3g} GB, this machine has "
            f"{there / 1e9:.3g} GB of memory: give fewer at a time, or write a data set"
        )
    output = np.empty((count, instants, columns))  # filled, or with NaN, linkage by linkage
    margins, topology = np.full(count, np.nan), np.full(count, -1)
    failures = dict(made.failures)
    work = _Work(made, motion, output, margins, topology, failures)
    seen = counted("linkages") if progress is True else progress or None
    done = len(failures)
    for size in work.follow_all(threads):
        done += size
        if seen is not None:
            seen(done, count)
    # joints of the ground stay where they are, those without a link too
    positions = output[:, :, : 2 * nodes].reshape(count, instants, nodes, 2)
    which, joint = np.nonzero(made.ground & np.isnan(positions[:, 0, :, 0]))
    positions[which, :, joint] = made.joints[which, None, joint]
    output[list(failures)] = np.nan
    for n, place in moved_by.items():
        positions[n] += place
    forces = output[:, :, 2 * nodes : columns - drivers].reshape(count, instants, bars, places, 2)
    angle = np.linspace(0.0, 1.0, instants)[:, None] * motion.turn[:, None]
    angle[np.broadcast_to(made.driver[:, None] < 0, angle.shape)] = np.nan
    torque = output[:, :, columns - drivers :]
    if np.ndim(arrays["driver"]) == 1:
        angle, torque = angle[:, :, 0], torque[:, :, 0]
    return Linkages(
        angle, positions, forces, torque, margins, topology, dict(sorted(failures.items()))
    )


@dataclass(frozen=True, eq=False)
class _Motion:
    """Turns of every driver (linkages, drivers), rates of the first, and gravity."""

    turn: np.ndarray
    speed: np.ndarray
    gravity: np.ndarray


@dataclass(eq=False)
class _Work:
    """All linkages of one call, by topology, and where their results go."""

    made: LinkageArrays
    motion: _Motion
    output: np.ndarray
    margins: np.ndarray
    topology: np.ndarray
    failures: dict[int, str]

    def follow_all(self, threads: int) -> Iterator[int]:
        """Follow everything; gives how many linkages are done, time and again."""
        made = self.made
        good = np.setdiff1d(np.arange(len(made)), np.fromiter(self.failures, int))
        if not good.size:
            return
        order = canonical_order(made)
        known, number = np.unique(row_bytes(order.table)[good], return_inverse=True)
        sorted_rows = good[np.argsort(number, kind="stable")]
        ends = np.cumsum(np.bincount(number))
        shape = (
            made.joints.shape[1],
            *made.links.shape[1:],
            made.driver.shape[1],
            made.slides.shape[1],
        )
        # the least first row of each topology numbers it
        lots = [
            (graph_of(known[n].tobytes(), shape), lot[at : at + BLOCK])
            for n, lot in enumerate(np.split(sorted_rows, ends[:-1]))
            for at in range(0, len(lot), BLOCK)
        ]
        for n, lot in enumerate(np.split(sorted_rows, ends[:-1])):
            self.topology[lot] = n
        if threads == 1:
            for graph, lot in lots:
                self._lot(graph, lot, order)
                yield len(lot)
            return
        pool = ThreadPoolExecutor(threads, thread_name_prefix="mbody")
        try:
            waiting = {pool.submit(self._lot, *one, order): len(one[1]) for one in lots}
            for future in as_completed(waiting):
                future.result()
                yield waiting[future]
        finally:
            pool.shutdown(wait=True, cancel_futures=True)

    def _lot(self, graph: Graph, lot: np.ndarray, order: CanonicalOrder) -> None:
        """Linkages of one topology."""
        plan = planned(graph)
        if not lot.size:
            return
        if isinstance(plan, str):
            self.failures.update(dict.fromkeys(lot.tolist(), plan))
            return
        made, motion = self.made, self.motion
        joints = made.joints[lot[:, None], order.joints[lot, : graph.joints]]
        with np.errstate(over="ignore"):
            vectors = joints[:, plan.sides[0]] - joints[:, plan.sides[1]]
            length = np.hypot(vectors[..., 0], vectors[..., 1]).max(axis=1)
        flat = lot[~(length > 0.0)]
        if flat.size:
            self.failures.update(dict.fromkeys(flat.tolist(), "its links have no length"))
            self._lot(graph, lot[length > 0.0], order)
            return
        stationary = motion.speed[lot] == 0.0
        if stationary.any() and not stationary.all():
            self._lot(graph, lot[stationary], order)
            self._lot(graph, lot[~stationary], order)
            return
        at_rest = bool(stationary.all())
        with np.errstate(all="ignore"):
            group = self._group(graph, plan, lot, order, length, at_rest)
        fits = _sizes(group) <= MOST
        if not fits.all():
            self.failures.update(dict.fromkeys(lot[~fits].tolist(), EXTREME))
            self._lot(graph, lot[fits], order)
            return
        if group.column.shape[1] < self.output.shape[2]:
            self.output[lot] = np.nan  # joints or links that are not there
        failed = follow_group(group, self.output, self.margins)
        for n, (why, tau) in failed.items():
            angle = np.degrees(tau * motion.turn[n, 0])
            first = "its driver" if len(graph.drivers) == 1 else "its first driver"
            self.failures[n] = f"{why} (at {angle:.4g} deg of {first})" if tau else why

    def _group(
        self,
        graph: Graph,
        plan: TopologyPlan,
        lot: np.ndarray,
        order: CanonicalOrder,
        length: np.ndarray,
        at_rest: bool,
    ) -> LinkageGroup:
        """The numbers of linkages of one topology as kernels take them."""
        made, motion = self.made, self.motion
        row, own = lot[:, None], order.joints[lot, : graph.joints]
        links = order.links[lot, : len(graph.links)]
        slides = order.slides[lot, : len(graph.slides)]
        # the time in which τ goes from 0 to 1; masses so that forces are in their own units
        turn = motion.turn[lot, : len(graph.drivers)]
        time = turn[:, 0] / np.where(at_rest, 1.0, motion.speed[lot])
        unit = length / time**2
        masses = np.stack([made.mass[row, links], made.inertia[row, links]], axis=2)
        masses *= unit[:, None, None]
        masses[..., 1] /= length[:, None] ** 2
        cg = made.cg[row, links] / length[:, None, None]
        joints = made.joints[row, own] / length[:, None, None]
        prescribed = np.column_stack([turn, *(motion.gravity[:, None] / unit)])
        par, mass, q = plan.numbers(joints, cg, masses, made.directions[row, slides], prescribed)
        columns = self._columns(plan, order, lot, own, links)
        positions = plan.body_fixed_positions(joints, cg)
        return LinkageGroup(plan, par, mass, q, positions, length, lot, columns, at_rest)

    def _columns(
        self,
        plan: TopologyPlan,
        order: CanonicalOrder,
        lot: np.ndarray,
        own: np.ndarray,
        links: np.ndarray,
    ) -> np.ndarray:
        """Places of the numbers of an instant: (linkages, numbers)."""
        nodes, places = self.made.joints.shape[1], self.made.links.shape[2]
        link, place = plan.places
        at = order.places[lot[:, None], link, place]
        first = [2 * own, 2 * (nodes + links[:, link] * places + at)]
        pairs = np.concatenate(first, axis=1)[:, :, None] + np.arange(2)
        many = self.made.driver.shape[1]
        torque = self.output.shape[2] - many + np.arange(len(plan.drivers))
        torques = np.broadcast_to(torque, (len(lot), len(torque)))
        return np.concatenate([pairs.reshape(len(lot), -1), torques], axis=1)


def _moved_to_origin(made: LinkageArrays) -> tuple[LinkageArrays, dict[int, np.ndarray]]:
    """The linkages, those that are far from the origin moved to it, and by how much: coordinates
    would have no figures left for the lengths of the links.
    """
    if not made.joints.size:
        return made, {}
    place = made.joints[:, 0]
    with np.errstate(invalid="ignore", over="ignore"):
        extent = np.abs(made.joints - place[:, None]).max(axis=(1, 2))
        distance = np.abs(place).max(axis=1)
        which = np.flatnonzero((distance > DISTANCE_FACTOR * extent) & np.isfinite(distance))
    if not which.size:
        return made, {}
    joints, cg = made.joints.copy(), made.cg.copy()
    joints[which] -= place[which, None]
    cg[which] -= place[which, None]
    moved = dict(zip(which.tolist(), place[which].copy(), strict=True))
    return replace(made, joints=joints, cg=cg), moved


def _sizes(group: LinkageGroup) -> np.ndarray:
    """The greatest number of each linkage, (linkages,): infinite where one is none."""
    parts = (group.par, group.mass, group.q, group.positions)
    found = np.max([np.abs(part).max(axis=0, initial=0.0) for part in parts], axis=0)
    return np.where(np.isfinite(found), found, np.inf)


def _per_driver(value: Any, shape: tuple[int, ...]) -> np.ndarray:
    """The turn of each driver, of one number a linkage the same for all."""
    if np.ndim(value) < 2:
        return np.repeat(_per_linkage("turn", value, shape[0])[:, None], shape[1], axis=1)
    found = np.asarray(value)
    if found.shape != shape or found.dtype.kind not in "iuf" or not np.isfinite(found).all():
        raise ModelError(
            f"turn must be a finite number, one for each of {shape[0]} linkages, or an array "
            f"{shape}, one for each driver"
        )
    return found.astype(np.float64)


def _per_linkage(name: str, value: Any, count: int) -> np.ndarray:
    """A number for each linkage."""
    try:
        found = np.broadcast_to(np.asarray(value, dtype=np.float64), (count,))
    except (TypeError, ValueError):
        raise ModelError(f"{name} must be a number, or one for each of {count} linkages") from None
    if not np.isfinite(found).all():
        raise ModelError(f"{name} must be finite")
    return found


def _pair(value: Any) -> np.ndarray:
    try:
        found = np.asarray(value, dtype=np.float64)
    except (TypeError, ValueError):
        found = np.zeros(0)
    if found.shape != (2,) or not np.isfinite(found).all():
        raise ModelError(f"gravity must be a pair of numbers (x, y), not {value!r}")
    return found
