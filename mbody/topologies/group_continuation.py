"""Linkages of one topology through their motion, on lanes; one that cannot go there alone.

A linkage has a lane of its own where there are many, else several with a piece of its motion each.
Inside, lengths are parts of each linkage's longest link, and the motion takes τ = 0 to 1: with φ
the angle of the driver at τ = 1 and ω its rate, time is T τ with T = φ/ω.
"""

from __future__ import annotations

import functools
from dataclasses import dataclass, replace

import numpy as np

from mbody.analysis.driven.runner import PathEnded, Runner, followed_lanes
from mbody.analysis.driven.time_grid import BY_TIME, TimeGrid
from mbody.analysis.position.closed_position import ClosedPosition
from mbody.core.lanes import LANES, aligned
from mbody.errors import SolveError
from mbody.kernels.continuation_lanes import LanePath
from mbody.kernels.layout import Work
from mbody.kernels.linkage_lanes import (
    LinkageBatch,
    branch_distances,
    follow_linkages,
    linkage_rows,
)
from mbody.kernels.output import PER_PRIMITIVE
from mbody.system.pivoting import lane_workspace
from mbody.system.system import System
from mbody.topologies.plan import TopologyPlan

__all__ = ["LinkageGroup", "follow_group"]

#: Greatest coordinate to which corrections are relative, in longest links and radians.
REACH = 10.0
#: Rate of a link beside that of the driver from which on it is a dead centre that is near.
RUNS_AWAY = 1e3
#: Pieces of a motion must meet within this, in longest links and radians.
SEAM = 1e-8


@dataclass(frozen=True, eq=False)
class LinkageGroup:
    """Linkages of one topology, all in canonical order.

    Attributes
    ----------
    plan : TopologyPlan
    par, mass, q : arrays (rows, linkages)
    arm : array (2·joints, linkages)
    length : array (linkages,)
        The longest link of each, in its own unit.
    row : array (linkages,)
        Where the results of each are.
    column : array (linkages, numbers)
        And those of each of its numbers.
    at_rest : bool
        Whether it is statics.
    """

    plan: TopologyPlan
    par: np.ndarray
    mass: np.ndarray
    q: np.ndarray
    arm: np.ndarray
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
            rest = count % LANES
            pieces = LANES // rest if 0 < rest <= LANES // 2 else 1
            whole = everyone if pieces == 1 else everyone[: count - rest]
            alone = self._pieces(whole, 1) if whole.size else whole
            if pieces > 1:
                alone = np.append(alone, self._pieces(everyone[count - rest :], pieces))
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
            reach=REACH,
            with_forces=True,
            at_rest=group.at_rest,
        )
        followed = followed_lanes(np.empty((1, 1, 1)))
        lanes = lane_workspace(plan.pivots, LANES)
        follow_linkages(plan.system.layout, *plan.pivots, work, lanes, path, followed, batch)
        failed = (batch.failed != 0.0).reshape(-1, pieces).any(axis=1) | lost
        if pieces > 1:
            shape = (len(start), len(linkages), pieces)
            gap = batch.q.reshape(shape)[:, :, :-1] - start.reshape(shape)[:, :, 1:]
            failed |= ~(np.abs(gap).max(axis=(0, 2)) <= SEAM)
        self._margins(batch, failed)
        return linkages[failed]

    def _batch(
        self, linkages: np.ndarray, first: np.ndarray, count: np.ndarray, q: np.ndarray
    ) -> LinkageBatch:
        """The bundle of all pieces of these linkages."""
        group, pieces = self.group, len(first)
        numbers, many = group.column.shape[1], len(linkages) * pieces
        arm = group.arm
        return LinkageBatch(
            par=group.par,
            mass=group.mass,
            arm=arm,
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
            arms=aligned(len(arm), LANES),
            lengths=aligned(1, LANES),
            page=aligned(numbers + PER_PRIMITIVE, LANES),
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
            found = runner.seeds(self._start(linkage), grid, REACH)
        except (PathEnded, SolveError):
            return None
        return found[:, : self.system.coordinates].T

    def _alone(self, linkage: int) -> None:
        """One linkage on the scalar path, with shorter steps where they are needed."""
        group, row = self.group, int(self.group.row[linkage])
        runner, start = Runner(self.system, self.analysis), self._start(linkage)
        try:
            found = runner.scalar(start, self._grid(self.tau), design=linkage, reach=REACH)
        except PathEnded as stuck:
            self._fail(row, self._why(stuck, start.work, linkage), stuck.place)
            return
        except SolveError:
            self._fail(row, "its reactions are not determined: a position is singular", 0.0)
            return
        page = self._page(found[:, :, 0], linkage)
        self.output[row][:, group.column[linkage]] = page
        nearest = runner.branches.distance
        self.margins[row] = np.nan if nearest is None else nearest.least

    def _why(self, stuck: PathEnded, work: Work, linkage: int) -> str:
        """Why a motion ended: at a dead centre something moves without bound by the driver, at the
        last place, the first of those behind.
        """
        L, size = self.system.layout, len(work.q)
        laws = L.law_par[L.primitive_signal[self.group.plan.drivers] // 3]
        turn = float(np.abs(self.group.par[laws + 1, linkage]).max())
        fastest = np.abs(work.past[size : size + self.system.coordinates, 0]).max()
        if not stuck.done:
            return "its joints do not close where they are given"
        if fastest > RUNS_AWAY * turn:
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

    def _page(self, found: np.ndarray, linkage: int) -> np.ndarray:
        """What is kept of all instants, from all rows of the kernel (instants, rows)."""
        plan, n3 = self.group.plan, self.system.coordinates
        arm, length = self.group.arm[:, linkage], self.group.length[linkage]
        nodes, drivers = plan.graph.joints, len(plan.drivers)
        kept = np.zeros((len(found), linkage_rows(nodes, plan.places.shape[1], drivers)))
        q = np.concatenate([found[:, :n3], np.zeros((len(found), 3))], axis=1)
        for n, b in enumerate(plan.bodies.tolist()):
            x, y, angle = q[:, 3 * b], q[:, 3 * b + 1], q[:, 3 * b + 2]
            c, s = np.cos(angle), np.sin(angle)
            kept[:, 2 * n] = length * (x + c * arm[2 * n] - s * arm[2 * n + 1])
            kept[:, 2 * n + 1] = length * (y + s * arm[2 * n] + c * arm[2 * n + 1])
        for e, (i, j) in enumerate(plan.force_at.tolist()):
            first = 3 * n3 + PER_PRIMITIVE * e
            force = found[:, first + 2 : first + 4]
            for place, sign in ((i, -1.0), (j, 1.0)):
                if place >= 0:
                    kept[:, 2 * (nodes + place) : 2 * (nodes + place) + 2] += sign * force
        for n, e in enumerate(plan.drivers.tolist()):
            kept[:, n - drivers] = length * found[:, 3 * n3 + PER_PRIMITIVE * e + 4]
        return kept
