"""Running the kernels over the instants of one system: the scalar path, the lanes, the stops."""

from __future__ import annotations

import functools
from typing import Any

import numpy as np

from mbody.analysis.driven.branch_record import BranchRecord, meeting
from mbody.analysis.driven.contacts import (
    OneSidedForce,
    check_fits,
    low_between,
    one_sided,
    one_sided_force,
    pulled,
)
from mbody.analysis.driven.dead_centres import DeadCentre
from mbody.analysis.driven.diagnosis import valueless
from mbody.analysis.driven.motion_pieces import (
    MANY,
    MotionPieces,
    borrowed_pieces,
    instants_on_lanes,
)
from mbody.analysis.driven.own_machine_code import own_motion_call
from mbody.analysis.driven.pivot_samples import blocks_at, workspaces_near
from mbody.analysis.driven.table_extrapolation import extrapolated
from mbody.analysis.driven.time_grid import (
    BY_DRIVER,
    BY_INSTANT,
    BY_TIME,
    TimeGrid,
    by_time,
    check_laws,
)
from mbody.analysis.driven.uniqueness import open_note, open_reactions
from mbody.analysis.position.assembly_analysis import raise_user_error
from mbody.analysis.position.closed_position import ClosedPosition
from mbody.analysis.position.vanishing_distances import vanishing
from mbody.core.lanes import LANES, aligned
from mbody.errors import SolveError
from mbody.kernels.continuation import (
    BRANCH_UNSURE,
    CHANGE_POINTS,
    DONE,
    INSTANTS,
    PROGRESS,
    REACHED,
    STEPS,
    STUCK,
    UNBALANCED,
    DrivenPath,
    FollowedPath,
    follow,
)
from mbody.kernels.continuation_lanes import (
    FAILED,
    FOUND,
    SHARED,
    FollowedLanes,
    follow_lanes,
)
from mbody.model.remarks import kept_states, left_out, remarks
from mbody.solution.certificate import changed
from mbody.solution.histories import Record
from mbody.solution.solution import Solution
from mbody.straight_line.lane_instants import LaneInstants
from mbody.system.pivoting import PivotChoices, choose_pivots, lane_workspace
from mbody.system.rank import dense, too_large
from mbody.system.system import System

__all__ = ["PathEnded", "Runner", "followed_lanes"]

#: Positions of a motion at which its pivots are examined, and numbers of Φ_q there, at most.
SAMPLES, NUMBERS = 721, 4_000_000
#: Change points of one motion that are distinguished.
CHANGES = 256
#: Rate of a body beside that of the driver from which on it is a dead centre that is near.
RUNS_AWAY = 1e3
#: Lanes must meet within this, in model lengths and radians.
SEAM = 1e-8
#: Samples of forces that have one sense: of a whole motion, and of a step.
OF_ALL, OF_A_STEP = 200, 8
#: Unbalanced part of the loads above which there is no equilibrium.
UNBALANCED_PART = 1e-7


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

    def __init__(self, system: System, analysis: str, unbalanced: float = UNBALANCED_PART) -> None:
        self.system, self.analysis, self.unbalanced = system, analysis, unbalanced
        self.with_forces = analysis != "kinematics"
        self.at_rest = analysis == "statics"
        self.layout = system.runtime()
        self.rows = system.page_rows
        self.branches = BranchRecord(system)
        #: Steps of the last motion on the scalar path.
        self.steps = 0

    def reach(self, start: ClosedPosition, grid: TimeGrid) -> float:
        """Greatest coordinate in model lengths and radians, to which rounding is relative."""
        turned = np.abs(grid.s).max() if grid.mode == BY_DRIVER else 0.0
        return float(1.0 + max(self.system.extent(start.work.q[:, 0]), turned))

    def scalar(
        self,
        start: ClosedPosition,
        grid: TimeGrid,
        *,
        with_forces: bool | None = None,
        reach: float | None = None,
        design: int = 0,
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
            reach=self.reach(start, grid) if reach is None else reach,
        )
        progress = np.zeros(PROGRESS)
        followed = FollowedPath(
            output=output,
            progress=progress,
            nearest=np.zeros(3),
            passed=np.empty((CHANGES, 1 + self.system.coordinates)),
        )
        code = follow(self.layout, start.work, path, followed)
        start.work.q[:] = q
        if monitored:
            count = min(int(progress[CHANGE_POINTS]), CHANGES)
            self.branches.followed(grid, followed.nearest, followed.passed[:count], design)
        self.steps = int(progress[STEPS])
        if code != DONE:
            raise PathEnded(code, progress, output)
        unbalanced = float(progress[UNBALANCED])
        if with_forces and not unbalanced < self.unbalanced:
            raise_user_error(self.system)
            if np.isnan(unbalanced):
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
        self, start: ClosedPosition, grid: TimeGrid, reach: float | None = None
    ) -> np.ndarray:
        """Motion without forces and without a certain branch: (instants, rows)."""
        return self.scalar(start, grid, with_forces=False, reach=reach, monitored=False)[:, :, 0]

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
        reach, kind = self.reach(start, grid), (self.with_forces, self.at_rest)
        with borrowed_pieces(self.system, grid, reach, *kind) as pieces:
            return self._on_pieces(pieces, start, grid)

    def _on_pieces(
        self, pieces: MotionPieces, start: ClosedPosition, grid: TimeGrid
    ) -> np.ndarray | None:
        # a seed on another branch is none that the lane before it meets
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
        if not pieces.gap(ends) <= SEAM * pieces.instants.reach:
            return None
        near = functools.partial(pieces.near, output, ends)
        self.branches.on_lanes(found, pieces.instants.t, near)
        return output

    def fits_lanes(self, start: ClosedPosition, grid: TimeGrid) -> bool:
        """Whether lanes can follow the motion: by laws or one driver, without redundant rows and
        without plain Python.
        """
        regular = not (start.regularization or self.system.has_user_code)
        return regular and grid.mode != BY_INSTANT

    def lane_instants(self, grid: TimeGrid, index: np.ndarray, reach: float) -> LaneInstants:
        """What the drivers prescribe in every lane, by the instants of the grid that it takes:
        (steps, lanes).
        """
        return instants_on_lanes(grid, index, reach, self.with_forces, self.at_rest)

    def on_lanes(self, work: Any, instants: LaneInstants) -> tuple[np.ndarray, np.ndarray]:
        """Follow all lanes from the positions in `work`: (steps, rows, lanes), and what the kernel
        found of each lane, (FOUND, lanes).
        """
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
        followed = followed_lanes(np.empty((len(instants.s), self.rows | 1, LANES)))
        numbers = lane_workspace(pivots, LANES)
        follow_lanes(self.layout, *pivots, work, numbers, instants.path, followed)
        return followed.output[:, : self.rows], followed.found

    def pivots(self, places: np.ndarray) -> PivotChoices | None:
        """Pivots of the square Φ_q, chosen once for a topology by some positions, (coordinates,
        positions).
        """

        def chosen() -> PivotChoices | None:
            near = workspaces_near(self.system, places[:, 0])
            return choose_pivots(self.layout, *near, blocks_at(self.system, places.T))

        found: PivotChoices | None = self.system.once("pivots", chosen)
        return found

    def pivots_along(self, start: ClosedPosition, grid: TimeGrid) -> PivotChoices | None:
        """Pivots that are good all along a motion, where there are such."""
        n = self.system.coordinates
        count = max(2, min(len(grid.s), SAMPLES, NUMBERS // n**2))
        some = np.unique(np.linspace(0, len(grid.s) - 1, count).astype(np.int64))
        try:
            found = self.seeds(start, grid.take(some))[:, :n]
        except PathEnded:
            found = start.work.q[:n].T
        near = workspaces_near(self.system, start.work.q[:n, 0])
        return choose_pivots(self.layout, *near, blocks_at(self.system, found))

    def solution(
        self, start: ClosedPosition, grid: TimeGrid, record: Record, status: str = "completed"
    ) -> Solution:
        """What was computed, as the user gets it; wheels that do not fit are an error."""
        dependencies = open_reactions(self.system, start.rank) if start.regularization else None
        machine, own = self.system.mechanism, self.system.first_states[:, 0]
        notes = [*start.notes, *self.system.once("remarks", lambda: remarks(machine))]
        left = "left out", self.analysis
        notes += self.system.once(left, lambda: left_out(machine, self.analysis))
        if machine.states and self.analysis != "kinematics":
            starts = {one.name: float(z) for one, z in zip(machine.states, own, strict=True)}
            notes += kept_states(machine, starts, self.analysis)
        notes += open_note(dependencies) if start.regularization and self.with_forces else ()
        found = Solution(
            system=self.system,
            analysis=self.analysis,
            t=grid.t,
            record=record,
            given=None if grid.mode == BY_TIME else grid.given,
            regularization=start.regularization,
            dependencies=dependencies,
            notes=(*notes, *self.branches.notes(lambda one: self.where(one.s, grid, one.design))),
            status=status,
            branch=self.branches.distance,
        )
        check_fits(found)
        beyond = tuple(extrapolated(found))
        # without a look at residuals: forces that are missing may be reported later
        return changed(found, doubts=beyond) if beyond else found

    def pulled(self, start: ClosedPosition, grid: TimeGrid, found: Solution) -> list[str]:
        """Sentences of contacts that pull and ropes that push, over the instants of `found`, and,
        where these lie on a motion over time that the grid follows, between them.
        """
        sided = one_sided(self.system) if self.with_forces else []
        times, between = found.t, None
        if sided and grid.mode == BY_TIME and self.system.batch is None and len(times) > 1:
            between = self._between(start, grid, found, sided)
        return pulled(found, between) if sided else []

    def _between(
        self, start: ClosedPosition, grid: TimeGrid, found: Solution, sided: list[Any]
    ) -> dict[str, OneSidedForce] | None:
        """Forces of contacts and ropes between the instants: evenly, so many a step of the motion,
        then again where three of them show that they may fall lower.
        """
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

    def explain(
        self, stuck: PathEnded, start: ClosedPosition, grid: TimeGrid, design: int = 0
    ) -> SolveError:
        """The sentence of a path that ended: a user's function, a law, a dead centre."""
        system = self.system
        raise_user_error(system)
        if grid.mode == BY_TIME:
            check_laws(system, grid.t)
        so_far = None
        if stuck.done and system.batch is None:
            record = Record([stuck.output[: stuck.done]], stuck.done, batch=False)
            part = grid.take(np.arange(stuck.done))
            so_far = self.solution(start, part, record, f"stopped: after {stuck.done} instants")
        driver = (system.leaders or system.drivers)[0]
        where = self.place(driver, stuck.place, grid, design)
        body = driver.bodies[1]
        if not too_large(system):
            one = system if system.batch is None else system.design(design)
            q = start.work.past[: system.coordinates, 0]
            gone = vanishing(one, q, f"{where} of '{body}'")
            if gone is not None:
                gone.solution = so_far
                return gone
        singular = stuck.code == STUCK and (stuck.unsure or self._singular(start))
        if singular and not self._runs_away(start, driver, stuck.place, grid, design):
            work = system.work()
            work.q[:] = start.work.past[: len(work.q)]
            names = ", ".join(repr(name) for name in meeting(system, work))
            remedy = "stop before, or change a length so that they stay apart"
            if abs(stuck.place - grid.s[stuck.done]) <= 1e-3 * np.ptp(grid.s):
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

    def _runs_away(
        self, start: ClosedPosition, driver: Any, s: float, grid: TimeGrid, design: int
    ) -> bool:
        """Whether something moves without bound by the driver at the last place, as it does at a
        dead centre, and not where branches only meet.
        """
        system, size = self.system, len(start.work.q)
        rate = 1.0
        if driver not in system.leaders:
            return False
        if grid.mode == BY_TIME:
            rate = float(system.law_of(driver, design=design).derivatives(s)[1])
        elif grid.mode == BY_INSTANT:
            rate = float(np.abs(grid.chords).max())
        fastest = system.extent(start.work.past[size : size + system.coordinates, 0])
        unit = driver.unit(system.length)
        return bool(fastest > RUNS_AWAY * abs(rate) / unit)

    def where(self, s: float, grid: TimeGrid, design: int = 0) -> str:
        """A place of the path in words: of the first driver, with its body."""
        driver = (self.system.leaders or self.system.drivers)[0]
        return f"{self.place(driver, s, grid, design)} of '{driver.bodies[1]}'"

    def _singular(self, start: ClosedPosition) -> bool:
        """Whether Φ_q is nearly singular at the last place that was reached."""
        if too_large(self.system):
            return True
        work = start.work
        q = work.q.copy()
        work.q[:] = work.past[: len(q)]
        sizes = np.linalg.svd(dense(self.system, work)[1], compute_uv=False)
        work.q[:] = q
        return bool(sizes[-1] < 1e-3 * sizes[0])

    def place(self, driver: Any, s: float, grid: TimeGrid, design: int = 0) -> str:
        """Value of a driver at path parameter s, with its unit, and the time."""
        value, time = s, ""
        if driver not in self.system.leaders:
            return f"t = {s:.6g} {self.system.mechanism.units.time}"
        if grid.mode == BY_TIME:
            value = self.system.law_of(driver, design=design)(s)
            time = f", t = {s:.6g} {self.system.mechanism.units.time},"
        elif grid.mode == BY_INSTANT:
            value = float(np.interp(s, grid.s, grid.given[:, 0, 0]))
        if driver.angular:
            return f"{np.degrees(value):.4g} deg{time}"
        return f"{value:.6g} {self.system.mechanism.units.length}{time}"


def followed_lanes(output: np.ndarray) -> FollowedLanes:
    """Where the kernels of lanes put what they find."""
    return FollowedLanes(
        output=output, found=aligned(FOUND, LANES), shared=np.zeros(SHARED, dtype=np.int64)
    )
