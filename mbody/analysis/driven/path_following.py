"""Running the kernels over the instants of one system: the scalar path, the lanes, the stops."""

from __future__ import annotations

import functools
import math
import weakref
from collections.abc import Callable, Hashable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from mbody.analysis.driven.time_grid import TimeGrid, by_time, check_laws
from mbody.analysis.position.assembly_analysis import check_determined, closed, raise_user_error
from mbody.analysis.position.closed_position import ClosedPosition, vanishing
from mbody.core import tolerances as tol
from mbody.core.lanes import LANES, aligned
from mbody.errors import SolveError
from mbody.kernels.continuation import (
    BRANCH_UNSURE,
    BY_DRIVER,
    BY_INSTANT,
    BY_TIME,
    CHANGE_POINTS,
    DONE,
    INSTANTS,
    PROGRESS,
    REACHED,
    STEPS,
    STUCK,
    UNBALANCED,
    DrivenPath,
    PathOutput,
    branch_distance,
    follow,
)
from mbody.kernels.layout import PER_PRIMITIVE, Work
from mbody.kernels.loop_closure import violation
from mbody.model.model_notes import kept_states, left_out, may_be_one_sided
from mbody.solution.histories import BranchDistance, Record, reported_certificate, with_fields
from mbody.solution.solution import Solution
from mbody.system.system import System, too_large

if TYPE_CHECKING:
    from mbody.analysis.driven.contact_report import OneSidedForce
    from mbody.kernels.continuation_lanes import LanesOutput
    from mbody.solution.doubts import Doubt
    from mbody.straight_line.pieces import LaneInstants
    from mbody.straight_line.programs import MotionCall, StraightLineCode
    from mbody.system.pivoting import PivotChoices

# -- The numbers of Φ_q at positions, by which pivots are chosen (`mbody.system.pivoting`) -----


def blocks_at(system: System, places: np.ndarray) -> list[np.ndarray]:
    """The blocks of Φ_q at positions (positions, coordinates)."""
    blocks, sample = [], system.work()
    for q in places:
        sample.q[: len(q), 0] = q
        violation(system.runtime(), sample)
        blocks.append(sample.block[:, 0].copy())
    return blocks


def workspaces_at(system: System, place: np.ndarray) -> tuple[Work, Work]:
    """Workspaces near a position (coordinates,), and a little off, of other numbers."""
    samples = []
    for shift in (0.0, 0.1):
        sample = system.work()
        sample.q[: len(place), 0] = place + shift * np.sin(np.arange(len(place)))
        sample.par[:] += shift * np.cos(np.arange(len(sample.par)))[:, None]
        violation(system.runtime(), sample)
        samples.append(sample)
    return samples[0], samples[1]


# -- The machine code of one topology alone, for systems that were assembled with it -----------

#: By system and kind of analysis the code and its first numbers; code is not sent elsewhere.
_codes: weakref.WeakKeyDictionary[
    System, dict[Hashable, tuple[StraightLineCode, np.ndarray] | None]
] = weakref.WeakKeyDictionary()


def own_motion_call(
    system: System, pivots: PivotChoices, work: Work, instants: LaneInstants, *, joined: bool
) -> MotionCall | None:
    """The call of the system's code that follows all lanes, as `follow_lanes` does, from the
    positions in `work`; None where the system has no such code. Where lanes are pieces of one
    motion, they are `joined`.
    """
    # auxiliary states of designs differ between lanes, and the code has one first number for all
    if not system.machine_code or (system.batch is not None and system.layout.owns):
        return None
    from mbody.straight_line.programs import MotionCall, straight_line_code

    codes = _codes.setdefault(system, {})
    kind = instants.mode, instants.with_forces, instants.at_rest
    if kind not in codes:
        code = straight_line_code(system.layout, pivots, instants.path, work, pieces=True)
        codes[kind] = None if code is None else (code, code.first_numbers(work))
    found = codes[kind]
    if found is None:
        return None
    code, initial = found
    return MotionCall(code, work, instants, system.record_rows, initial, joined=joined)


# -- Record of a branch: distance to other branches, change points passed ----------------------

#: Change points that a note names, and elements of each.
NAMED, ELEMENTS = 4, 8


@dataclass(frozen=True)
class ChangePoint:
    """A change point: path parameter, and a position close to it."""

    s: float
    q: np.ndarray


class BranchRecord:
    """Least distance from other branches and the change points passed, gathered over all pieces of
    one analysis.

    `least`: Square of the least distance.
    `t`: The instant of it.
    """

    def __init__(self, system: System) -> None:
        self.system = system
        self.least, self.t = math.inf, math.nan
        self.change_points: list[ChangePoint] = []

    @property
    def distance(self) -> BranchDistance | None:
        """Least branch distance and its instant; None where no path was followed."""
        if not math.isfinite(self.least):
            return None
        return BranchDistance(math.sqrt(max(self.least, 0.0)), self.t)

    def record_path(self, grid: TimeGrid, nearest: np.ndarray, passed: np.ndarray) -> None:
        """Adds the record of `follow` on a piece: nearest (3,), change points (n, 1 +
        coordinates).
        """
        least, s, k = nearest.tolist()
        if least < self.least:
            self.least = least
            self.t = s if grid.mode == BY_TIME else float(grid.t[min(int(k), len(grid.t) - 1)])
        same = tol.PATH_PLACE_SAME * max(float(np.ptp(grid.s)), tol.TINY)
        known = np.array([one.s for one in self.change_points])
        for row in passed:
            if not (np.abs(known - row[0]) <= same).any():
                self.change_points.append(ChangePoint(float(row[0]), row[1:].copy()))

    def on_lanes(
        self, found: np.ndarray, t: np.ndarray, workspace_at: Callable[[int, int], Work]
    ) -> None:
        """Adds the record of `follow_lanes`, (FOUND, lanes); t (steps, lanes); `workspace_at` gives
        a workspace at the position of a step and a lane.
        """
        from mbody.kernels.continuation_lanes import FAILED, GREATEST, GREATEST_AT

        greatest = found[GREATEST]
        if found[FAILED].any():
            greatest = np.where(found[FAILED] == 0.0, greatest, -math.inf)
        lane = int(greatest.argmax())
        if greatest[lane] == -math.inf:
            return
        k = int(found[GREATEST_AT, lane])
        least = branch_distance(self.system.runtime(), workspace_at(k, lane), 0.0)
        if least < self.least:
            self.least, self.t = least, float(t[k, lane])

    def notes(self, place: Callable[[ChangePoint], str]) -> list[str]:
        """Sentences of the change points; `place` says where one is."""
        if not self.change_points:
            return []
        named = self.change_points[:NAMED]
        names = dict.fromkeys(name for one in named for name in self.meeting_at(one))
        listing = "; ".join(place(one) for one in named)
        more = len(self.change_points) - NAMED
        listing += f"; and {more} more" if more > 0 else ""
        which = (
            "a change point"
            if len(self.change_points) == 1
            else f"{len(self.change_points)} change points"
        )
        where = f", in {', '.join(repr(name) for name in names)}" if names else ""
        return [
            f"the motion goes on smoothly through {which}, where branches meet{where}: at {listing}"
        ]

    def meeting_at(self, one: ChangePoint) -> list[str]:
        """Names of the elements whose rows depend on each other at a change point."""
        work = self.system.work()
        work.q[: self.system.coordinates, 0] = one.q
        return meeting(self.system, work)


def meeting(system: System, work: Work) -> list[str]:
    """Names of the elements whose rows become dependent at a position, those with the
    greatest shares; none of a system that is too large for dense matrices.
    """
    from mbody.system.rank import dense

    if too_large(system):
        return []
    u, sizes, _ = np.linalg.svd(dense(system, work)[1])
    if not np.isfinite(sizes).all() or not len(sizes):
        return []
    shares: dict[str, float] = {}
    for e, part in zip(system.row_table[0], np.abs(u[:, len(sizes) - 1]), strict=True):
        name = system.owners[int(e)][0].name
        shares[name] = max(shares.get(name, 0.0), float(part))
    top = max(shares.values())
    return [name for name, part in shares.items() if part >= tol.PARTICIPATION_ELEMENT * top][
        :ELEMENTS
    ]


# -- A single motion in pieces of equal length, one a lane -------------------------------------
# Pieces begin at positions of the same motion that are found by large steps on the scalar path; the
# last instant of a piece is the first of the next one, where they must meet. Of some thousand
# instants the arrays and tables around the kernels took as long to make as the kernels ran: they
# are kept, and a call borrows them, so that threads do not share them.

#: Instants from which lanes pay for their first positions.
MANY = 6 * LANES
#: Kinds of motion of a system of which the memory is kept, the last ones.
KEPT = 4
#: Instants up to which it is kept: beside longer motions it takes no time to make.
LONGEST = 50_000


class MotionPieces:
    """The memory of one call, for all motions of a system that have as many instants and reach as
    far.

    `index` (steps, lanes): Which instant every lane takes at every step; the last step is the next
      lane's first.
    `instants`: What the drivers prescribe at them.
    `seeds` (coordinates, lanes): First positions of all lanes.
    """

    def __init__(
        self, system: System, grid: TimeGrid, position_norm: float, with_forces: bool, at_rest: bool
    ) -> None:
        # not the system itself: it is freed when nobody else has it
        self._layout = system.runtime()
        self.index = _pieces(len(grid.s))
        self.instants = instants_on_lanes(grid, self.index, position_norm, with_forces, at_rest)
        first = grid.take(self.index[0])
        self._path = DrivenPath(
            mode=grid.mode,
            s=first.s,
            t=first.t,
            given=first.given,
            chords=np.zeros((1, 1)),
            with_forces=False,
            at_rest=at_rest,
            monitored=False,
            regularization=0.0,
            position_norm=position_norm,
        )
        rows, n = system.record_rows, system.coordinates
        self._follow = PathOutput(
            output=np.empty((LANES, rows, 1)),
            progress=np.zeros(PROGRESS),
            nearest=np.zeros(3),
            passed=np.empty((1, 1 + n)),
        )
        self.seeds = self._follow.output[:, :n, 0].T
        self._workspace = system.work()
        self._lengths = 1.0 / system.coordinate_units[:, None]
        self._machine_code: MotionCall | None = None
        self._tried = False

    def take(self, grid: TimeGrid) -> None:
        """Take the numbers of another grid of the same kind."""
        first, s, t = self.index[0], self.instants.s, self.instants.t
        for all_of_them, lanes, seeds in ((grid.s, s, self._path.s), (grid.t, t, self._path.t)):
            all_of_them.take(self.index, out=lanes, mode="clip")
            all_of_them.take(first, out=seeds, mode="clip")
            if grid.t is grid.s and t is s and self._path.t is self._path.s:
                break
        if grid.mode == BY_DRIVER:
            self.instants.given[:] = _rates(grid, self.index)
            self._path.given[:] = grid.given[first]

    def find_seeds(self, start: ClosedPosition) -> bool:
        """Find the first positions of all lanes, on a likely branch; False where the path ends."""
        q = start.work.q.copy()
        self._follow.progress[:] = 0.0
        code = follow(self._layout, start.work, self._path, self._follow)
        start.work.q[:] = q
        return bool(code == DONE)

    def own_code(self, system: System, pivots: PivotChoices) -> MotionCall | None:
        """The machine code of the system for this kind of motion, where it has one."""
        if system.machine_code and not self._tried:
            work = system.work(LANES)
            self._machine_code = own_motion_call(system, pivots, work, self.instants, joined=True)
            self._tried = True
        if self._machine_code is not None:
            self._machine_code.q[: len(self.seeds)] = self.seeds
        return self._machine_code

    def gap(self, ends: np.ndarray) -> float:
        """Distance of the ends of pieces, (rows, lanes), from where the next ones begin, in model
        lengths and radians.
        """
        gaps = ends[: len(self.seeds), :-1] - self.seeds[:, 1:]
        gaps *= self._lengths
        return float(np.abs(gaps, out=gaps).max())

    def workspace_at(self, output: np.ndarray, ends: np.ndarray, k: int, lane: int) -> Work:
        """A workspace at the position of a step and a lane, of (steps, rows, lanes) without the
        last step and of that, (rows, lanes).
        """
        n = len(self.seeds)
        found = ends[:n, lane] if k == len(output) else output[k, :n, lane]
        self._workspace.q[:n, 0] = found
        return self._workspace


#: Memory that is not in use, by system and kind of motion.
_free_pieces: weakref.WeakKeyDictionary[System, dict[Hashable, list[MotionPieces]]] = (
    weakref.WeakKeyDictionary()
)


@contextmanager
def borrowed_pieces(
    system: System, grid: TimeGrid, position_norm: float, with_forces: bool, at_rest: bool
) -> Iterator[MotionPieces]:
    """The pieces of a motion for one call."""
    kinds = _free_pieces.setdefault(system, {})
    key = grid.mode, len(grid.s), position_norm, with_forces, at_rest
    free = kinds.get(key)
    if free is None:
        # of a list, which is made at once: other threads may keep others meanwhile
        for old in list(kinds)[: max(len(kinds) - KEPT + 1, 0)]:
            kinds.pop(old, None)
        free = kinds[key] = []
    try:
        pieces = free.pop()
        pieces.take(grid)
    except IndexError:
        pieces = MotionPieces(system, grid, position_norm, with_forces, at_rest)
    yield pieces
    if len(grid.s) <= LONGEST:
        free.append(pieces)


def instants_on_lanes(
    grid: TimeGrid, index: np.ndarray, position_norm: float, with_forces: bool, at_rest: bool
) -> LaneInstants:
    """Prescribed driver values and rates in every lane at the grid's instants `index`, (steps,
    lanes).
    """
    from mbody.straight_line.pieces import LaneInstants

    given = np.zeros((2, LANES))
    if grid.mode == BY_DRIVER:
        given = np.ascontiguousarray(_rates(grid, index))
    s = grid.s.take(index)
    t = s if grid.t is grid.s else grid.t.take(index)
    return LaneInstants(
        mode=grid.mode,
        s=s,
        t=t,
        given=given,
        position_norm=position_norm,
        with_forces=with_forces,
        at_rest=at_rest,
    )


def _rates(grid: TimeGrid, index: np.ndarray) -> Any:
    """Rate and acceleration of the one driver: (2·steps, lanes)."""
    rates = grid.given[index, 0, 1:]
    return rates.transpose(0, 2, 1).reshape(-1, index.shape[1])


@functools.lru_cache(maxsize=16)
def _pieces(count: int) -> np.ndarray:
    """Which instant every lane takes at every step."""
    steps = -(-count // LANES)
    index = steps * np.arange(LANES)[None, :] + np.arange(steps + 1)[:, None]
    return np.minimum(index, count - 1)


#: Positions of a motion at which its pivots are examined, and numbers of Φ_q there, at most.
SAMPLES, NUMBERS = 721, 4_000_000
#: Change points of one motion that are distinguished.
CHANGES = 256
#: Calls of one Python function of a law that a motion makes at most, and more for every instant: a
#: derivative that is none would have it go on by the shortest steps.
CALLS, CALLS_OF_INSTANT = 200_000, 1000
#: Samples of forces that have one direction: of a whole motion, and of a step.
OF_ALL, OF_A_STEP = 200, 8


class PathEnded(Exception):
    """The path could not be followed to an instant of the grid."""

    def __init__(self, code: int, progress: np.ndarray, output: np.ndarray) -> None:
        super().__init__(code)
        self.code, self.output = code, output
        self.done, self.place = int(progress[INSTANTS]), float(progress[REACHED])
        #: whether it is the branch that is uncertain from there on
        self.unsure = bool(progress[BRANCH_UNSURE])


class Runner:
    """One analysis of one system over one grid of instants.

    Where the reactions leave more of the loads than the part `unbalanced`, it is an error.
    """

    def __init__(
        self, system: System, analysis: str, unbalanced: float = tol.LOADS_UNBALANCED
    ) -> None:
        self.system, self.analysis, self.unbalanced = system, analysis, unbalanced
        self.with_forces = analysis != "kinematics"
        self.at_rest = analysis == "statics"
        self.layout = system.runtime()
        self.rows = system.record_rows
        self.branches = BranchRecord(system)
        #: Steps of the last motion on the scalar path.
        self.steps = 0

    def position_norm(self, start: ClosedPosition, grid: TimeGrid) -> float:
        """Greatest coordinate in model lengths and radians, to which rounding is relative."""
        driver_range = np.abs(grid.s).max() if grid.mode == BY_DRIVER else 0.0
        return float(1.0 + max(self.system.extent(start.work.q[:, 0]), driver_range))

    def scalar(
        self,
        start: ClosedPosition,
        grid: TimeGrid,
        *,
        with_forces: bool | None = None,
        position_norm: float | None = None,
        monitored: bool = True,
    ) -> np.ndarray:
        """All instants of the grid on the scalar path: (instants, rows, 1); `monitored` makes sure
        of the branch.

        Raises `PathEnded` where the path ends; leaves the position in `start` as it was.
        """
        q = start.work.q.copy()
        output = np.empty((len(grid.s), self.rows, 1))
        with_forces = self.with_forces if with_forces is None else with_forces
        path = DrivenPath(
            mode=grid.mode,
            s=grid.s,
            t=grid.t,
            given=grid.given,
            chords=grid.chords if grid.mode == BY_INSTANT else np.zeros((1, 1)),
            with_forces=with_forces,
            at_rest=self.at_rest,
            monitored=monitored,
            regularization=start.regularization,
            position_norm=self.position_norm(start, grid)
            if position_norm is None
            else position_norm,
        )
        progress = np.zeros(PROGRESS)
        path_output = PathOutput(
            output=output,
            progress=progress,
            nearest=np.zeros(3),
            passed=np.empty((CHANGES, 1 + self.system.coordinates)),
        )
        calls = [one for _, one in self.system.law_calls]
        for one in calls:
            one.count, one.most = 0, CALLS + CALLS_OF_INSTANT * len(grid.s)
        code = follow(self.layout, start.work, path, path_output)
        for one in calls:
            one.most = math.inf
        start.work.q[:] = q
        if monitored:
            count = min(int(progress[CHANGE_POINTS]), CHANGES)
            self.branches.record_path(grid, path_output.nearest, path_output.passed[:count])
        self.steps = int(progress[STEPS])
        if code != DONE:
            raise PathEnded(code, progress, output)
        unbalanced = float(progress[UNBALANCED])
        if with_forces and not unbalanced < self.unbalanced:
            raise_user_error(self.system)
            if np.isnan(unbalanced):
                from mbody.analysis.driven.diagnosis import valueless

                n = self.system.coordinates
                k = int(np.flatnonzero(np.isnan(output[:, 3 * n :, 0]).any(axis=1))[0])
                q, v = output[k, :n, 0], output[k, n : 2 * n, 0]
                raise valueless(self.system, start.work, float(grid.t[k]), q, v)
            raise SolveError(
                f"reactions leave {unbalanced:.2g} of the loads of '{self.system.mechanism.name}' "
                "unbalanced: its position is singular, or it can still move"
            )
        return output

    def seeds(
        self, start: ClosedPosition, grid: TimeGrid, position_norm: float | None = None
    ) -> np.ndarray:
        """Motion without forces and without a certain branch: (instants, rows)."""
        return self.scalar(
            start, grid, with_forces=False, position_norm=position_norm, monitored=False
        )[:, :, 0]

    def record(self, start: ClosedPosition, grid: TimeGrid) -> Record:
        """All instants of the grid, on lanes where that pays, else on the scalar path.

        Raises `PathEnded` where the path ends.
        """
        block = self._lanes(start, grid)
        if block is None:
            block = self.scalar(start, grid)
        return Record([block], len(grid.s), batch=False)

    def _lanes(self, start: ClosedPosition, grid: TimeGrid) -> np.ndarray | None:
        """All instants on lanes: (steps, rows, lanes), one lane after the other; None where that
        does not pay.

        A lane that cannot be trusted goes the scalar path; where lanes do not meet, there is None.
        """
        fits = len(grid.s) >= MANY and self.fits_lanes(start, grid)
        if not fits or self.system.plans.get("pivots", ()) is None:
            return None
        position_norm, kind = self.position_norm(start, grid), (self.with_forces, self.at_rest)
        with borrowed_pieces(self.system, grid, position_norm, *kind) as pieces:
            return self._on_pieces(pieces, start, grid)

    def _on_pieces(
        self, pieces: MotionPieces, start: ClosedPosition, grid: TimeGrid
    ) -> np.ndarray | None:
        # a seed on another branch is none that the lane before it meets
        from mbody.kernels.continuation_lanes import FAILED

        pivots = self.pivots(pieces.seeds) if pieces.find_seeds(start) else None
        if pivots is None:
            return None
        n, own = self.system.coordinates, pieces.own_code(self.system, pivots)
        if own is not None:
            output, ends, found = own(), own.ends, own.found
        else:
            work = self.system.work(LANES)
            work.q[:n] = pieces.seeds
            output, found = self._by_kernel(work, pieces.instants, pivots)
            output, ends = output[:-1], output[-1]
        for lane in np.flatnonzero(found[FAILED]):
            piece = ClosedPosition(self.system.work(), start.regularization)
            piece.work.q[:n, 0] = pieces.seeds[:, lane]
            try:
                whole = self.scalar(piece, grid.take(pieces.index[:, lane]))[:, :, 0]
            except PathEnded:
                return None
            output[:, :, lane], ends[:, lane] = whole[:-1], whole[-1]
        if not pieces.gap(ends) <= tol.PATH_SEAM * pieces.instants.position_norm:
            return None
        workspace_at = functools.partial(pieces.workspace_at, output, ends)
        self.branches.on_lanes(found, pieces.instants.t, workspace_at)
        return output

    def fits_lanes(self, start: ClosedPosition, grid: TimeGrid) -> bool:
        """Whether lanes can follow the motion: by laws or one driver, without redundant rows and
        without plain Python.
        """
        alone = self.system.has_user_code or self.system.has_loops
        regular = not (start.regularization or alone)
        return regular and grid.mode != BY_INSTANT

    def lane_instants(
        self, grid: TimeGrid, index: np.ndarray, position_norm: float
    ) -> LaneInstants:
        """Prescribed driver values and rates in every lane at the grid's instants `index`, (steps,
        lanes).
        """
        return instants_on_lanes(grid, index, position_norm, self.with_forces, self.at_rest)

    def on_lanes(self, work: Any, instants: LaneInstants) -> tuple[np.ndarray, np.ndarray]:
        """Follow all lanes from the positions in `work`: (steps, rows, lanes), and what the kernel
        found of each lane, (FOUND, lanes).
        """
        from mbody.kernels.continuation_lanes import FOUND

        pivots = self.pivots(work.q[: self.system.coordinates])
        if pivots is None:  # every lane goes the scalar path
            shape = len(instants.s), self.rows, LANES
            return np.empty(shape), np.ones((FOUND, LANES))
        own = own_motion_call(self.system, pivots, work, instants, joined=False)
        if own is not None:
            return own(), own.found
        return self._by_kernel(work, instants, pivots)

    def _by_kernel(
        self, work: Any, instants: LaneInstants, pivots: PivotChoices
    ) -> tuple[np.ndarray, np.ndarray]:
        # an odd number of rows: one row of all steps is read without cache lines that collide
        from mbody.kernels.continuation_lanes import follow_lanes
        from mbody.system.pivoting import lane_workspace

        path_output = lanes_output(np.empty((len(instants.s), self.rows | 1, LANES)))
        numbers = lane_workspace(pivots, LANES)
        follow_lanes(self.layout, *pivots, work, numbers, instants.path, path_output)
        return path_output.output[:, : self.rows], path_output.found

    def pivots(self, places: np.ndarray) -> PivotChoices | None:
        """Pivots of the square Φ_q, chosen once for a topology by some positions, (coordinates,
        positions).
        """
        from mbody.system.pivoting import choose_pivots

        def chosen() -> PivotChoices | None:
            workspaces = workspaces_at(self.system, places[:, 0])
            return choose_pivots(self.layout, *workspaces, blocks_at(self.system, places.T))

        found: PivotChoices | None = self.system.once("pivots", chosen)
        return found

    def pivots_along(self, start: ClosedPosition, grid: TimeGrid) -> PivotChoices | None:
        """Pivots that are good all along a motion, where there are such."""
        from mbody.system.pivoting import choose_pivots

        n = self.system.coordinates
        count = max(2, min(len(grid.s), SAMPLES, NUMBERS // n**2))
        some = np.unique(np.linspace(0, len(grid.s) - 1, count).astype(np.int64))
        try:
            found = self.seeds(start, grid.take(some))[:, :n]
        except PathEnded:
            found = start.work.q[:n].T
        workspaces = workspaces_at(self.system, start.work.q[:n, 0])
        return choose_pivots(self.layout, *workspaces, blocks_at(self.system, found))

    def solution(
        self, start: ClosedPosition, grid: TimeGrid, record: Record, status: str = "completed"
    ) -> Solution:
        """The `Solution` of the computed instants, with its notes and doubts; wheels that do not
        fit raise an error.
        """
        dependencies: dict[str, list[bool]] | None = None
        redundant: tuple[str, ...] = ()
        if start.regularization:
            from mbody.analysis.driven.diagnosis import open_note, open_reactions

            dependencies = open_reactions(self.system, start.rank)
            closed = [one.name for one in self.system.mechanism.contacts if one.closed]
            redundant = open_note(dependencies, closed) if self.with_forces else ()
        machine, own = self.system.mechanism, self.system.first_states[:, 0]
        notes = [*start.notes]
        left = "left out", self.analysis
        notes += self.system.once(left, lambda: left_out(machine, self.analysis))
        if machine.states and self.analysis != "kinematics":
            starts = {one.name: float(z) for one, z in zip(machine.states, own, strict=True)}
            notes += kept_states(machine, starts, self.analysis)
        notes += redundant
        found = Solution(
            system=self.system,
            analysis=self.analysis,
            t=grid.t,
            record=record,
            given=None if grid.mode == BY_TIME else grid.given,
            regularization=start.regularization,
            dependencies=dependencies,
            notes=(*notes, *self.branches.notes(lambda one: self.where(one.s, grid))),
            status=status,
            branch=self.branches.distance,
        )
        if any(joint.spaced for joint in machine.joints):
            from mbody.analysis.driven.contact_report import check_fits

            check_fits(found)
        if not self.system.has_limited_laws:
            return found
        from mbody.analysis.driven.law_doubts import law_doubts

        beyond = tuple(law_doubts(found))
        # without a look at residuals: forces that are missing may be reported later
        return with_fields(found, doubts=beyond) if beyond else found

    def pulled(self, start: ClosedPosition, grid: TimeGrid, found: Solution) -> list[str]:
        """Sentences of contacts that pull and ropes that push, over the instants of `found`, and,
        where these lie on a motion over time that the grid follows, between them.
        """
        if not (self.with_forces and may_be_one_sided(self.system.mechanism)):
            return []
        from mbody.analysis.driven.contact_report import one_sided, pulled

        sided = one_sided(self.system)
        times, between = found.t, None
        if sided and grid.mode == BY_TIME and len(times) > 1:
            between = self._between(start, grid, found, sided)
        return pulled(found, between) if sided else []

    def _between(
        self, start: ClosedPosition, grid: TimeGrid, found: Solution, sided: list[Any]
    ) -> dict[str, OneSidedForce] | None:
        """Forces of contacts and ropes between the instants: evenly, so many a step of the motion,
        then again where three of them show that they may fall lower.
        """
        from mbody.analysis.driven.contact_report import OneSidedForce, low_between, one_sided_force

        low, high = float(found.t.min()), float(found.t.max())
        if not high > low:
            return None
        count, run = max(OF_ALL, OF_A_STEP * self.steps), found
        if len(found.t) < count:
            even = np.linspace(low, high, count)
            run = self._sampled(start, grid, np.unique(np.append(found.t, even))) or found
        forces = {one.name: one_sided_force(run, one) for one in sided}
        lowest = [low_between(one.t, one.force) for one in forces.values()]
        closer = np.unique(np.concatenate(lowest))
        more = self._sampled(start, grid, closer) if closer.size else None
        if more is not None:
            for one in sided:
                a, b = forces[one.name], one_sided_force(more, one)
                parts = (("t", a.t, b.t), ("force", a.force, b.force), ("size", a.size, b.size))
                forces[one.name] = OneSidedForce(**{key: np.append(*both) for key, *both in parts})
        return forces

    def _sampled(self, start: ClosedPosition, grid: TimeGrid, t: np.ndarray) -> Solution | None:
        """The motion at other times than those of a grid by time, which it begins like; None where
        it cannot be followed to them.
        """
        begin = float(grid.t[0])
        other = by_time(self.system, np.ascontiguousarray(np.append(begin, t)))
        steps = self.steps
        try:
            record = self.record(start, other)
        except (PathEnded, SolveError):
            return None
        finally:
            self.steps = steps
        run = Solution(
            self.system, self.analysis, other.t, record, None, regularization=start.regularization
        )
        return run.take(np.arange(1, len(other.s)))

    def explain(self, stuck: PathEnded, start: ClosedPosition, grid: TimeGrid) -> SolveError:
        """The sentence of a path that ended: a user's function, a law, a dead centre."""
        from mbody.analysis.driven.dead_centres import DeadCentre
        from mbody.analysis.driven.law_doubts import derivative_doubts

        system = self.system
        doubts = derivative_doubts(system)
        if doubts:
            raise SolveError(doubts[0].message, doubts[0].elements[0])
        raise_user_error(system)
        if grid.mode == BY_TIME:
            check_laws(system, grid.t)
        so_far = None
        if stuck.done:
            record = Record([stuck.output[: stuck.done]], stuck.done, batch=False)
            part = grid.take(np.arange(stuck.done))
            so_far = self.solution(start, part, record, f"stopped: after {stuck.done} instants")
        driver = (system.independent_drivers or system.drivers)[0]
        where = self.place(driver, stuck.place, grid)
        body = driver.bodies[1]
        if not too_large(system):
            q = start.work.past[: system.coordinates, 0]
            gone = vanishing(system, q, f"{where} of '{body}'")
            if gone is not None:
                gone.solution = so_far
                return gone
        singular = stuck.code == STUCK and (stuck.unsure or self._singular(start))
        if singular and not self._runs_away(start, driver, stuck.place, grid):
            work = system.work()
            work.q[:] = start.work.past[: len(work.q)]
            names = ", ".join(repr(name) for name in meeting(system, work))
            remedy = "stop before, or change a length so that they stay apart"
            if abs(stuck.place - grid.s[stuck.done]) <= tol.PATH_STUCK_AT_INSTANT * np.ptp(grid.s):
                remedy = "leave that instant out, the motion goes through there between others"
            return SolveError(
                f"branches of '{system.mechanism.name}' meet at {where} of '{body}', driven by "
                f"'{driver.name}', in {names}: on which of them the motion goes on is not certain; "
                f"{remedy}",
                driver.name,
                so_far,
            )
        if singular:
            size = len(start.work.q)
            rates = np.abs(start.work.past[size + 2 : size + system.coordinates : 3, 0])
            rates[system.bodies[body]] = 0.0
            fastest = system.mechanism.bodies[int(rates.argmax())].name
            sentence = (
                f"dead centre at {where} of '{body}': driver '{driver.name}' cannot drive it any "
                "further"
            )
            return DeadCentre(sentence, f"drive '{fastest}', or stop before", driver, so_far)
        sentence = (
            f"the motion of '{system.mechanism.name}' cannot be followed beyond {where} of "
            f"'{body}': does the law of '{driver.name}' jump there?"
        )
        return SolveError(sentence, driver.name, so_far)

    def _runs_away(self, start: ClosedPosition, driver: Any, s: float, grid: TimeGrid) -> bool:
        """Whether something moves without bound by the driver at the last place, as it does at a
        dead centre, and not where branches only meet.
        """
        system, size = self.system, len(start.work.q)
        rate = 1.0
        if driver not in system.independent_drivers:
            return False
        if grid.mode == BY_TIME:
            rate = float(system.law_of(driver).derivatives(s)[1])
        elif grid.mode == BY_INSTANT:
            rate = float(np.abs(grid.chords).max())
        fastest = system.extent(start.work.past[size : size + system.coordinates, 0])
        unit = driver.unit(system.length)
        return bool(fastest > tol.DEAD_CENTRE_RATE * abs(rate) / unit)

    def where(self, s: float, grid: TimeGrid) -> str:
        """A place of the path in words: of the first driver, with its body."""
        driver = (self.system.independent_drivers or self.system.drivers)[0]
        return f"{self.place(driver, s, grid)} of '{driver.bodies[1]}'"

    def _singular(self, start: ClosedPosition) -> bool:
        """Whether Φ_q is nearly singular at the last place that was reached."""
        from mbody.system.rank import dense

        if too_large(self.system):
            return True
        work = start.work
        q = work.q.copy()
        work.q[:] = work.past[: len(q)]
        sizes = np.linalg.svd(dense(self.system, work)[1], compute_uv=False)
        work.q[:] = q
        return bool(sizes[-1] < tol.SINGULAR_VALUE_PATH * sizes[0])

    def place(self, driver: Any, s: float, grid: TimeGrid) -> str:
        """Value of a driver at path parameter s, with its unit, and the time."""
        value, time = s, ""
        if driver not in self.system.independent_drivers:
            return f"t = {s:.6g} {self.system.mechanism.units.time}"
        if grid.mode == BY_TIME:
            value = self.system.law_of(driver)(s)
            time = f", t = {s:.6g} {self.system.mechanism.units.time},"
        elif grid.mode == BY_INSTANT:
            value = float(np.interp(s, grid.s, grid.given[:, 0, 0]))
        if driver.angular:
            return f"{np.degrees(value):.4g} deg{time}"
        return f"{value:.6g} {self.system.mechanism.units.length}{time}"


def lanes_output(output: np.ndarray) -> LanesOutput:
    """Where the kernels of lanes put what they find."""
    from mbody.kernels.continuation_lanes import FOUND, SHARED, LanesOutput

    return LanesOutput(
        output=output, found=aligned(FOUND, LANES), shared=np.zeros(SHARED, dtype=np.int64)
    )


# -- Change points: instants at which branches meet, reached as limits from both sides ---------
# There Φ_q loses rank although the motion goes on smoothly, as in a parallelogram whose links are
# all in line. Such an instant is replaced by eight places around it, which are followed like any
# other and interpolated from to the eighth order. Forces that have no limit are not given there,
# NaN, and the result says so.

#: The places, in steps; odd, so that none is the change point itself.
PLACES = np.array([-7.0, -5.0, -3.0, -1.0, 1.0, 3.0, 5.0, 7.0])
#: Lagrange's weights at zero.
WEIGHTS = np.array([-5.0, 49.0, -245.0, 1225.0, 1225.0, -245.0, 49.0, -5.0]) / 2048.0
#: Most change points in one sweep, and those that a sentence names.
MOST, NAMED_INSTANTS = 32, 4


def through_change_points(
    runner: Runner, start: ClosedPosition, grid: TimeGrid, singular: set[int], error: SolveError
) -> Solution:
    """The whole sweep, with the `singular` instants taken as limits; `error` is raised where they
    turn out to be no change points."""
    if grid.mode not in (BY_TIME, BY_DRIVER):
        raise error
    while True:
        spread, places = _spread(runner, grid, singular, error)
        beginning = _beginning(runner, start, spread, error) if 0 in singular else start
        try:
            block = runner.scalar(beginning, spread)
            break
        except PathEnded as stuck:
            k = int(np.searchsorted(places, stuck.done, side="right")) - 1
            inside = k in singular
            off = abs(stuck.place - grid.s[k])
            if inside or len(singular) >= MOST or off > tol.PATH_STUCK_AT_INSTANT * np.ptp(grid.s):
                raise error from None
            singular = singular | {k}
            error = runner.explain(stuck, beginning, spread)
    merged = np.empty((len(grid.s), block.shape[1], 1))
    missing: dict[int, list[str]] = {}
    for k in range(len(grid.s)):
        if k in singular:
            around = block[places[k] : places[k] + len(PLACES)]
            merged[k] = np.tensordot(WEIGHTS, around, 1)
            primitives = _without_limit(runner, around, error)
            for e in primitives:
                first = 3 * runner.system.coordinates + PER_PRIMITIVE * e
                merged[k, first : first + PER_PRIMITIVE] = np.nan
            if primitives:
                missing[k] = list(
                    dict.fromkeys(runner.system.owners[e][0].name for e in primitives)
                )
        else:
            merged[k] = block[places[k]]
    found = runner.solution(beginning, grid, Record([merged], len(grid.s), batch=False))
    note = f"{len(singular)} of {len(grid.s)} instants are change points, given as limits"
    # what the residuals show is not computed yet: residuals know of no forces that are missing
    said = reported_certificate(found)
    doubts = (*said.doubts, *((_incomplete(runner, grid, missing),) if missing else ()))
    return with_fields(found, notes=(*said.notes, note), doubts=doubts)


def _incomplete(runner: Runner, grid: TimeGrid, missing: dict[int, list[str]]) -> Doubt:
    """Doubt about forces without a value, from the names of their elements by instant."""
    from mbody.solution.doubts import Doubt

    names = list(dict.fromkeys(name for found in missing.values() for name in found))
    places = [runner.where(float(grid.s[k]), grid) for k in missing]
    listing = "; ".join(places[:NAMED_INSTANTS])
    listing += f"; and {len(places) - NAMED_INSTANTS} more" if len(places) > NAMED_INSTANTS else ""
    return Doubt(
        "incomplete",
        f"forces grow without bound towards change points of '{runner.system.mechanism.name}' and "
        f"are not given there: at {listing}: those of "
        f"{', '.join(repr(name) for name in names)}",
        float(grid.t[min(missing)]),
        tuple(names),
    )


def _spread(
    runner: Runner, grid: TimeGrid, singular: set[int], error: SolveError
) -> tuple[TimeGrid, np.ndarray]:
    """The grid with eight places for each singular instant, and where each instant begins in it."""
    index: list[int] = []
    shift: list[float] = []
    places: list[int] = []
    for k in range(len(grid.s)):
        places.append(len(index))
        step = _step(runner, grid, k, error) if k in singular else 0.0
        offsets = PLACES * step if k in singular else np.zeros(1)
        index += [k] * len(offsets)
        shift += offsets.tolist()
    moved = grid.take(np.array(index))
    s = moved.s + np.array(shift)
    if grid.mode == BY_TIME:
        return TimeGrid(grid.mode, s, s, moved.given), np.array(places)
    moved.given[:, 0, 0] = s
    return TimeGrid(grid.mode, s, moved.t, moved.given), np.array(places)


def _step(runner: Runner, grid: TimeGrid, k: int, error: SolveError) -> float:
    """Change of the path parameter by which the fastest driver moves by STEP."""
    system = runner.system
    rates = [1.0] * len(system.independent_drivers)
    if grid.mode == BY_TIME:
        rates = [
            abs(system.law_of(d).derivatives(grid.s[k])[1]) for d in system.independent_drivers
        ]
    units = [d.unit(system.length) for d in system.independent_drivers]
    speed = max((r / u for r, u in zip(rates, units, strict=True)), default=0.0)
    if speed == 0.0:
        raise error
    return tol.PATH_DIFFERENCE_STEP / speed


def _beginning(
    runner: Runner, start: ClosedPosition, spread: TimeGrid, error: SolveError
) -> ClosedPosition:
    """A regular position at the first place, closed from the singular one."""
    system = runner.system
    pose = start.work.q[:, 0].copy()
    try:
        beginning = closed(system, float(spread.t[0]), spread.first(system), None, pose=pose)
        check_determined(system, beginning, runner.analysis)
    except SolveError:
        raise error from None
    beginning.notes[:] = start.notes
    return beginning


def _without_limit(runner: Runner, around: np.ndarray, error: SolveError) -> list[int]:
    """Primitives whose forces grow without bound towards the middle of the places.

    `error` is raised where the motion does.
    """
    inner, outer = np.abs(around[4] - around[3]), np.abs(around[5] - around[2])
    size = np.empty_like(inner)
    n, primitives = runner.system.coordinates, len(runner.system.owners)
    # rounding is distinguished from growth by the greatest number of the same sort
    for rows in (slice(0, n), slice(n, 2 * n), slice(2 * n, 3 * n), slice(3 * n, None)):
        size[rows] = np.abs(around[:, rows]).max(initial=0.0)
    growing = (inner > 0.8 * outer + 1e-5 * size)[:, 0]
    if growing[: 3 * n].any():
        raise error
    return np.flatnonzero(
        growing[3 * n :][: PER_PRIMITIVE * primitives].reshape(-1, PER_PRIMITIVE).any(axis=1)
    ).tolist()
