"""How closed contacts and frictional joints go on: sticking, sliding or open; impacts.

Modes are decided by `mbody.kernels.contact_modes`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mbody.analysis.contact.unilateral import Overlap, Unilateral, deepest_overlap
from mbody.analysis.dynamics.modal_motion import ModalMotion
from mbody.analysis.dynamics.shared_friction import shared_friction
from mbody.core import tolerances as tol
from mbody.errors import ModelError, SolveError
from mbody.kernels.contact_modes import NONE, SEVERAL, closed_at
from mbody.kernels.layout import Work
from mbody.kernels.mode_problem import TRIED
from mbody.model.element import listed

Array = np.ndarray

# -- Impacts of closed contacts, and overlaps at the beginning ---------------------------------


@dataclass(frozen=True, eq=False)
class Impact:
    """An impact.

    `jump` (coordinates,): By which the velocities change.
    `impulses` (2 points,): Normal ones, then tangential ones.
    `gained` (points,): Kinetic energy by each, below zero where it took.
    `moved` (points,): What the motion of each gave, of stops that move.
    `driven`: What drivers gave, by name, of those that lead bodies at that instant.
    `energy` (3,): Of the whole impact, see `mbody.kernels.contact_impacts`.
    """

    jump: Array
    impulses: Array
    gained: Array
    moved: Array
    driven: dict[str, float]
    energy: Array


def strike(motion: ModalMotion, closed: list[int], kind: int) -> Impact | None:
    """An impact of closed contact points at the state in the workspace, of a kind of
    `mbody.kernels.contact_impacts`; None where it has no solution.
    """
    motion.memory.impact.held[:] = 0
    if motion.memory.strike(motion, closed, kind) == NONE:
        return None
    return impact_of(motion)


def impact_of(motion: ModalMotion) -> Impact:
    """The impact that the kernels have just found."""
    I, drivers = motion.memory.impact, motion.uni.system.drivers
    closed = np.flatnonzero(motion.memory.modes.touches)
    driven = {one.name: work for one, work in zip(drivers, I.driven.tolist(), strict=True)}
    return Impact(
        I.jump.copy(),
        np.concatenate([I.normal[closed], I.tangential[closed]]),
        I.gained[closed],
        I.moved[closed],
        driven,
        I.energy.copy(),
    )


def ratio_of_masses(uni: Unilateral, closed: list[int]) -> float:
    """The greatest ratio of masses that are joined to what touches at some contact points."""
    bodies = {int(b) for k in closed for b in uni.bodies[k] if b < uni.layout.bodies}
    return float(uni.unevenness[sorted(bodies)].max(initial=0.0))


def lost_by_masses(uni: Unilateral, closed: list[int]) -> str:
    """Why rounding decides what goes on at closed contact points; empty where it does not."""
    ratio = ratio_of_masses(uni, closed)
    if ratio <= tol.MASSES_LOST:
        return ""
    names = listed(list(dict.fromkeys(uni.contact_points[k].name for k in closed)))
    return (
        f"the accelerations at {names} are lost in rounding: masses that touch differ by a factor "
        f"of {ratio:.2g}, more than numbers carry; take masses that differ by less than "
        f"{tol.MASSES_LOST:.0e}"
    )


def refuse_driven_impact(motion: ModalMotion, hit: list[int]) -> None:
    """Refuse an impact of what drivers lead, that has just been found to have no solution."""
    D, place = motion.memory.problem[0].delassus, motion.memory.modes.place
    for number in hit:
        if not D[place[number], place[number]] > 0.0:
            name = motion.uni.contact_points[number].name
            raise SolveError(
                f"nothing that strikes '{name}' is free to rebound: it follows drivers alone; take "
                "them off, or record when it is reached by an Event",
                name,
            )


def first_overlap(uni: Unilateral, work: Work, gap_tolerance: float) -> list[int]:
    """The contact points that are closed at the beginning; refuses shapes that overlap."""
    rows = uni.read(work)
    found = deepest_overlap(uni, rows, work, gap_tolerance)
    if found is not None:
        raise _overlap(uni, work, found)
    within = uni.within_edges(rows, work, gap_tolerance, 0.0)
    return [n for n, gap in enumerate(uni.gaps(rows)) if abs(gap) <= gap_tolerance and within[n]]


def _overlap(uni: Unilateral, work: Work, found: Overlap) -> ModelError:
    machine = uni.system.mechanism
    j = uni.bodies[found.contact_point][1]
    x, y, angle = work.q[3 * j : 3 * j + 3, 0]
    ax, ay = (float(part) for part in uni.contact_points[found.contact_point].candidate.position)
    place = (
        float(x + np.cos(angle) * ax - np.sin(angle) * ay),
        float(y + np.sin(angle) * ax + np.cos(angle) * ay),
    )
    (one,) = (one for one in machine.contacts if one.name == found.contact)
    sentence = one.overlapping(found.depth, place, uni.system.values, machine.units)
    return ModelError(sentence, one.described_as)


# -- The decision ------------------------------------------------------------------------------


@dataclass(frozen=True)
class Verdict:
    """Consistency and uniqueness of the modes that continue.

    `consistent`: Whether there are any.
    `several`: Whether there are others with other accelerations.
    `complete`: Whether all sets of modes were tried.
    """

    consistent: bool
    several: bool = False
    complete: bool = True


def closed_points(motion: ModalMotion) -> list[int]:
    """Contact points whose gap is none, within the ends of their edges, at the position and
    velocities in the workspace.
    """
    uni, M = motion.uni, motion.memory.take(motion)
    closed_at(motion.layout, motion.work, motion.motion.stepping, uni.table, M)
    return [int(k) for k in np.flatnonzero(M.touches)]


def decide(motion: ModalMotion) -> Verdict:
    """Set the modes that go on from the present state, with its derivative and record."""
    found = motion.memory.decide(motion)
    motion.take_modes()
    complete = bool(motion.memory.problem[0].count[TRIED])
    if found == NONE:
        return Verdict(False, complete=complete)
    motion.shared = shared_friction(motion)
    return Verdict(True, found == SEVERAL, complete)
