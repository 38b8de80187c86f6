"""All designs of a batch, one a lane; a lane that fails goes the scalar path.

First positions, the grid of the lanes and their path are those of sweeps
(`mbody.analysis.driven.batch_continuation`). The kernel is another one: a batch keeps every row of
all instants as the kernel writes them, with the distance from other branches, a sweep only the rows
that are measured, of all designs in one call. Of 64 four-bars at 361 instants, on one core, a
position takes 163 ns here and 224 ns with all rows by the kernel of sweeps; there it takes 95 ns
with one row.
"""

from __future__ import annotations

import warnings
import weakref
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from mbody.analysis.driven.path_following import Runner, lanes_output
from mbody.analysis.driven.time_grid import TimeGrid
from mbody.analysis.position.assembly_analysis import (
    check_determined,
    check_fit,
    rounding,
    set_driver_values,
)
from mbody.analysis.position.closed_position import (
    ClosedDesigns,
    ClosedPosition,
    ambiguous,
    close_in_stages,
)
from mbody.analysis.position.design_results import DesignFailures, common_fields, partial_ending
from mbody.core import tolerances as tol
from mbody.core.lanes import LANES, aligned
from mbody.errors import ModelWarning, SolveError
from mbody.kernels.continuation import BY_DRIVER, BY_TIME
from mbody.kernels.continuation_lanes import Designs, LanePath, follow_designs
from mbody.kernels.layout import PER_PRIMITIVE, Work
from mbody.model.model_notes import may_be_one_sided
from mbody.solution.checks import BranchPlace
from mbody.solution.doubts import NAMED
from mbody.solution.histories import (
    DesignReport,
    Record,
    reported_certificate,
)
from mbody.solution.shared_forces import forces_of_designs
from mbody.solution.solution import Solution
from mbody.straight_line.programs import StraightLineCode, straight_line_code
from mbody.system.pivoting import PivotChoices, diagonal_blocks, lane_workspace
from mbody.system.rank import dense
from mbody.system.system import System, too_large, with_numbers_of

# -- Designs of one topology over equal instants, on lanes -------------------------------------
# Designs go side by side, one a lane. What is shared (the pivots, the pose that all begin from, the
# size by which corrections are judged) comes from the description alone, and a group of lanes holds
# the same designs wherever a batch is cut: so the numbers do not depend on how it is cut.


@dataclass(frozen=True, eq=False)
class BatchSetup:
    """Settings and first position that all designs of a batch share.

    `grid`: The instants.
    `pose` (coordinates + 3,): Closed position of the description at the first instant, from which
      all designs are closed.
    `origin` (parameters,): The numbers of the description, as kernels take them.
    `small`, `position_norm`: Rounding of a closed position, and the greatest coordinate, in model
      lengths and radians.
    `straight`: Whether there are so many designs that straight-line code pays
      (`mbody.straight_line.programs`).
    """

    analysis: str
    grid: TimeGrid
    pose: np.ndarray
    origin: np.ndarray
    small: float
    position_norm: float
    pivots: PivotChoices
    straight: bool = False


#: The straight-line code of every setup; machine code is not sent to other machines.
_codes: weakref.WeakKeyDictionary[BatchSetup, StraightLineCode | None] = weakref.WeakKeyDictionary()


def batch_setup(runner: Runner, start: ClosedPosition, grid: TimeGrid) -> BatchSetup | None:
    """The setup of a system of one design; None where its designs must go one by one."""
    if not runner.fits_lanes(start, grid):
        return None
    pivots = runner.pivots_along(start, grid)
    if pivots is None:
        return None
    return BatchSetup(
        runner.analysis,
        grid,
        start.work.q[:, 0].copy(),
        runner.system.par[:, 0].copy(),
        float(rounding(runner.system, start.work.q[:, 0])),
        runner.position_norm(start, grid),
        pivots,
    )


def closed_poses(
    system: System, grid: TimeGrid, pose: np.ndarray, origin: np.ndarray, small: float
) -> ClosedDesigns:
    """Every design closed at the first instant from the one pose of the numbers `origin`, to
    corrections below `small`; see `close_in_stages`.
    """
    designs = int(system.batch or 0)
    first = grid.first(system)
    values = np.tile([first.get(d.name, np.nan) for d in system.drivers], (designs, 1))
    return close_in_stages(
        system, float(grid.t[0]), values, pose, origin, small, tol.PIVOT_SUSPICIOUS
    )


def in_all_lanes(grid: TimeGrid) -> np.ndarray:
    """The instants of a grid, in every lane all of them: (instants, lanes)."""
    return np.repeat(np.arange(len(grid.s))[:, None], LANES, axis=1)


def with_middle(grid: TimeGrid) -> tuple[TimeGrid, slice]:
    """The grid for lanes, and which of its instants are those of the grid. Between two instants
    there is one more: two alone do not show how the determinants bend.
    """
    if len(grid.s) != 2:
        return grid, slice(None)
    s = np.array([grid.s[0], grid.s.mean(), grid.s[1]])
    if grid.mode != BY_DRIVER:
        return TimeGrid(grid.mode, s, s, grid.given), slice(None, None, 2)
    t = np.array([grid.t[0], grid.t.mean(), grid.t[1]])
    given = np.stack([grid.given[0], grid.given.mean(axis=0), grid.given[1]])
    return TimeGrid(grid.mode, s, t, given), slice(None, None, 2)


def on_lanes(
    system: System, setup: BatchSetup, poses: np.ndarray, wanted: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Rows of all instants: (rows, designs, instants), and which designs can be trusted. `poses`
    (designs, coordinates + 3), `wanted` (rows,).
    """
    runner = Runner(system, setup.analysis)
    grid, kept = with_middle(setup.grid)
    output = np.empty((len(wanted), len(poses), len(grid.s)))
    path = runner.lane_instants(grid, in_all_lanes(grid), setup.position_norm).path
    q = np.ascontiguousarray(poses.T)
    designs = _designs(system.par, system.mass, q, wanted)
    code = _code(system, setup, path)
    if code is None:
        _follow(system, setup, path, designs, output)
    else:
        code.follow_designs(system.layout, system.work(LANES), path, designs, output)
        _again(system, setup, path, designs, output)
    return output[:, :, kept], designs.failed == 0.0


def _designs(par: np.ndarray, mass: np.ndarray, q: np.ndarray, wanted: np.ndarray) -> Designs:
    record = aligned(len(wanted) + PER_PRIMITIVE, LANES)
    return Designs(
        par=par, mass=mass, q=q, wanted=wanted, record=record, failed=np.empty(q.shape[1])
    )


def _follow(
    system: System, setup: BatchSetup, path: LanePath, designs: Designs, output: np.ndarray
) -> None:
    """Follow designs by the kernel that serves all topologies: output (rows, designs, instants)."""
    work, numbers = system.work(LANES), lane_workspace(setup.pivots, LANES)
    path_output = lanes_output(output)
    follow_designs(system.layout, *setup.pivots, work, numbers, path, path_output, designs)


def _code(system: System, setup: BatchSetup, path: LanePath) -> StraightLineCode | None:
    """The straight-line code of a setup where it pays, found or made when it is first needed."""
    if not setup.straight:
        return None
    if setup not in _codes:
        work = system.work(LANES)
        _codes[setup] = straight_line_code(system.layout, setup.pivots, path, work)
    return _codes[setup]


def _again(
    system: System, setup: BatchSetup, path: LanePath, designs: Designs, output: np.ndarray
) -> None:
    """Follow the designs that failed once more by the kernel, each with all of its group of lanes,
    so that their numbers do not depend on how a batch is cut.
    """
    failed = np.flatnonzero(designs.failed)
    if not len(failed):
        return
    members = (np.unique(failed // LANES)[:, None] * LANES + np.arange(LANES)).ravel()
    members = members[members < len(designs.failed)]
    numbers = (designs.par, designs.mass, designs.q)
    par, mass, q = (np.ascontiguousarray(rows[:, members]) for rows in numbers)
    fewer = _designs(par, mass, q, designs.wanted)
    found = np.empty((len(output), len(members), output.shape[2]))
    _follow(system, setup, path, fewer, found)
    place = np.searchsorted(members, failed)
    output[:, failed], designs.failed[failed] = found[:, place], fewer.failed[place]


# -- All designs of a batch as results, those that lanes cannot follow each alone ----------------


def of_designs(
    system: System,
    analysed: Callable[[System], Any],
    pose: np.ndarray | None,
    failures: DesignFailures,
) -> Solution:
    """Every design, as it would be analysed alone, on the branch of the first that has a first
    position, and with its closed contacts: on lanes where these can follow it. `analysed` of a
    design: how it is analysed alone (`mbody.analysis.driven.driven`). A design that fails takes
    nothing from the others; `failures`: those that did before.
    """
    designs, reference = int(system.batch or 0), -1
    for reference in range(designs):
        if reference not in failures:
            with failures.of(reference):
                first = analysed(system.design(reference))
                start = first.closed(pose)
                break
    failures.refuse_all(designs)
    # contacts are closed by each design's own first position
    contacts, grid, before = bool(first.notes), first.grid, first.before
    lanes = not contacts and first.runner.fits_lanes(start, grid)
    try:
        check_determined(first.system, start, first.analysis)
    except SolveError:
        lanes = False  # each says for itself what is wrong
    given, system = system, with_numbers_of(first.system, system.values) if contacts else system
    runner, par = Runner(system, first.analysis), system.par.copy()
    pose = start.work.q[:, 0].copy()
    own = _ambiguous(first, pose)
    said = [note for note in start.notes if note not in own]
    poses, good = np.tile(pose, (designs, 1)), np.zeros(designs, dtype=bool)
    if lanes:
        origin = system.par[:, reference].copy()
        closed_at = closed_poses(system, grid, pose, origin, rounding(system, pose))
        poses, good = closed_at.poses, closed_at.good
        good[list(failures)] = False

    def of_design(n: int) -> Any:
        if n == reference:
            return first
        # the gaps of contacts are those where the guesses put its own bodies
        one = replace(first, system=system.design(n), notes=first.notes[:1])
        other = analysed(given.design(n)) if contacts else one
        if _closed_places(other.system) != _closed_places(system):
            return one
        par[:, n] = other.system.par[:, 0]  # where it rolls from
        return other

    each, common = says_of_each(system, runner.analysis), None
    blocks, reports, elsewhere = list[np.ndarray](), list[DesignReport | None](), list[str]()
    for low in range(0, designs, LANES):
        chosen = np.minimum(np.arange(low, low + LANES), designs - 1)
        output = np.empty((len(grid.s), runner.rows, LANES))
        branches: dict[int, BranchPlace | None] = {}
        if good[chosen].any():
            output, branches = _side_by_side(runner, start, grid, poses, chosen)
        for lane, design in enumerate(range(low, min(low + LANES, designs))):
            sound = good[design] and lane in branches
            if sound and common is not None and not each:
                reports.append(common._replace(branch=branches[lane]))
                continue
            reports.append(None)
            with failures.of(design):
                if design in failures:
                    raise failures[design]
                one = of_design(design)
                if sound:
                    record = Record([output[:, :, lane : lane + 1]], len(grid.s), batch=False)
                    begin = _begun(one, poses[design], said) if design != reference else start
                    found = one.reported(begin, record)
                else:
                    closed = poses[design] if good[design] else None
                    one, begin = one, start
                    if design != reference:
                        one, begin = _beside(one, pose, said, closed)
                    same = begin.straight or _same_branch(system, start.work, begin.work)
                    found = one.followed(begin)
                    elsewhere += [] if same else [str(design)]
                output[before:, :, lane] = found.record.table(slice(None))
                said_of = report(found)
                if sound:
                    common = said_of = said_of._replace(branch=branches[lane])
                reports[-1] = said_of
            if design in failures:
                output[:, :, lane] = np.nan
        blocks.append(output[before:])
    failures.refuse_all(designs)
    notes = _said_elsewhere(elsewhere)
    grid = grid.take(np.arange(before, len(grid.s)))
    record = Record(blocks, designs, batch=True)
    system = replace(system, par=par) if contacts else system
    return joined(system, runner.analysis, grid, record, reports, notes, failures)


def _ambiguous(one: Any, pose: np.ndarray) -> list[str]:
    """What is not certain of a first position (coordinates + 3,)."""
    values = set_driver_values(
        one.system, one.system.work(), float(one.grid.t[0]), one.grid.first(one.system)
    )
    return ambiguous(one.system, pose, values)


def _begun(one: Any, pose: np.ndarray, said: list[str]) -> ClosedPosition:
    """A first position (coordinates + 3,) that lanes closed, with what is to be noted of it and
    was `said` of that from which it was closed.
    """
    check_fit(one.system, pose)
    found = ClosedPosition(one.system.work(), notes=[*said, *_ambiguous(one, pose)])
    found.work.q[:, 0] = pose
    return found


def _beside(
    one: Any, pose: np.ndarray, said: list[str], closed: np.ndarray | None
) -> tuple[Any, ClosedPosition]:
    """The analysis of a design, and its first position on the branch of a pose (coordinates + 3,):
    by its guesses where they lead there. `closed`: Where lanes closed it from that pose.
    """
    own: ClosedPosition | None = None
    why = DesignFailures()
    with why.of(0), warnings.catch_warnings():
        warnings.simplefilter("ignore", ModelWarning)
        own = one.closed(None)

    def is_own(q: np.ndarray) -> bool:
        return own is not None and one.system.extent(own.work.q[:, 0] - q) < tol.POSITION_SAME

    if own is not None and closed is not None and is_own(closed):
        return one, own
    try:
        # the other starts are those from which its guesses led nowhere
        near = one.closed(pose) if own is not None else one.closed(pose, attempts=1)
    except SolveError:
        if own is None:
            raise why[0] from None
        return one, one.closed(None)
    if own is not None and is_own(near.work.q[:, 0]):
        return one, own
    near.notes += [*said, *_ambiguous(one, near.work.q[:, 0])]
    return replace(one, notes=one.notes[:1]), near


def _closed_places(system: System) -> list[Any]:
    """What is closed of the contacts of a system."""
    return [(one.name, one.closed, one.rolls) for one in system.mechanism.contacts]


def says_of_each(system: System, analysis: str) -> bool:
    """Whether the notes and doubts of an analysis depend on the numbers of a design, beside those
    of residuals.
    """
    machine = system.mechanism
    return bool(
        machine.contacts
        or machine.states
        or len(system.layout.friction_kind)
        or system.has_limited_laws
        or (analysis != "kinematics" and may_be_one_sided(machine))
        or any(joint.spaced or joint.limited for joint in machine.joints)
        or any(load.by_angle and load.free for load in machine.loads)
    )


def joined(
    system: System,
    analysis: str,
    grid: TimeGrid,
    record: Record,
    reports: Sequence[DesignReport | None],
    notes: tuple[str, ...] = (),
    failures: DesignFailures | None = None,
) -> Solution:
    """The result of all designs, of those that failed without a report."""
    failures = DesignFailures() if failures is None else failures
    sound = [one for one in reports if one is not None]
    branches = {n: one.branch for n, one in enumerate(reports) if one is not None}
    places = {n: one for n, one in branches.items() if isinstance(one, BranchPlace)}
    nearest = max(places, key=lambda n: places[n].closeness) if places else None
    branch = None if nearest is None else places[nearest].distance(system.design(nearest))
    return Solution(
        system=system,
        analysis=analysis,
        t=grid.t,
        record=record,
        given=None if grid.mode == BY_TIME else grid.given,
        notes=notes,
        status=partial_ending("failed", failures, len(reports)),
        shared=forces_of_designs([one and one.shared for one in reports], len(grid.s)),
        reports=tuple(one or failures[n] for n, one in enumerate(reports)),
        **common_fields([*sound, DesignReport(branch=branch)]),
    )


def report(found: Solution) -> DesignReport:
    """What is said of a design."""
    own = {name: getattr(found, name) for name in DesignReport._fields[3:]}
    return DesignReport(**vars(reported_certificate(found)), **own)


def _side_by_side(
    runner: Runner,
    start: ClosedPosition,
    grid: TimeGrid,
    poses: np.ndarray,
    chosen: np.ndarray,
) -> tuple[np.ndarray, dict[int, BranchPlace | None]]:
    """Designs on lanes: (instants, rows, lanes), and of each lane that can be trusted where it came
    nearest to another branch.
    """
    system, n = runner.system, runner.system.coordinates
    grid, kept = with_middle(grid)
    instants = runner.lane_instants(grid, in_all_lanes(grid), runner.position_norm(start, grid))
    work = system.work(LANES, chosen)
    work.q[:n] = poses[chosen, :n].T
    output, found = runner.on_lanes(work, instants)
    branches = dict[int, BranchPlace | None]()
    for lane, failed, greatest, at in zip(range(LANES), *found[:3].tolist(), strict=True):
        if not failed:
            k, branches[lane] = int(at), None
            if greatest > -np.inf:
                place = output[k, :n, lane].copy()
                branches[lane] = BranchPlace(greatest, float(instants.t[k, lane]), place)
    return output[kept], branches


def _said_elsewhere(designs: list[str]) -> tuple[str, ...]:
    """A note of the designs that are on another branch than the first one."""
    if not designs:
        return ()
    which = "1 design is" if len(designs) == 1 else f"{len(designs)} designs are"
    named = ", ".join(designs[:NAMED]) + (", …" if designs[NAMED:] else "")
    note = (
        f"{which} closed on another branch than the first one: {named}; "
        "analyse them alone, with a guess"
    )
    warnings.warn(note, ModelWarning, stacklevel=6)
    return (note,)


def _same_branch(system: System, one: Work, other: Work) -> bool:
    """Whether no Assur group has determinants of different sign at two positions; not where that
    cannot be decided: Φ_q is not square, or too large.
    """
    if system.rows != system.coordinates or too_large(system):
        return False
    first, second = dense(system, one)[1], dense(system, other)[1]
    blocks = diagonal_blocks((first != 0.0) | (second != 0.0))
    if blocks is None:
        return False
    for block in range(blocks.max() + 1):
        group = np.ix_(blocks[0] == block, blocks[1] == block)
        if np.linalg.slogdet(first[group])[0] * np.linalg.slogdet(second[group])[0] <= 0.0:
            return False
    return True
