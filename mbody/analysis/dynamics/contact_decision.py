"""How closed contacts and frictional joints go on: sticking, sliding or open; impacts.

Modes are decided by `mbody.kernels.contact_modes`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mbody.analysis.contact.friction_problem import ClosedContacts, arresting_impulses
from mbody.analysis.contact.unilateral import Overlap, Rows, Unilateral, deepest_overlap
from mbody.analysis.dynamics.interruptions import works_of_drivers
from mbody.analysis.dynamics.modal_motion import ModalMotion
from mbody.analysis.dynamics.shared_friction import shared_friction
from mbody.core import tolerances as tol
from mbody.errors import ModelError, SolveError
from mbody.kernels.complementarity import row_responses
from mbody.kernels.contact_decision import TRIED
from mbody.kernels.contact_modes import MASSLESS, NONE, SEVERAL, closed_at
from mbody.kernels.layout import Work
from mbody.model.element import listed
from mbody.system.rank import dense_rates

Array = np.ndarray

# -- Impacts of closed contacts, and overlaps at the beginning ---------------------------------


@dataclass(frozen=True, eq=False)
class Impact:
    """An impact.

    `jump` (coordinates,): By which the velocities change.
    `impulses` (2 points,): Normal ones, then tangential ones.
    `before` (points,): Rates of the gaps before it, of those that were closed.
    `gained` (points,): Kinetic energy by each, below zero where it took.
    `moved` (points,): What the motion of each gave, of stops that move.
    `driven`: What drivers gave, by name, of those that lead bodies at that instant.
    """

    jump: Array
    impulses: Array
    before: Array
    gained: Array
    moved: Array
    driven: dict[str, float]


@dataclass(frozen=True, eq=False)
class Responses:
    """How velocities and joints respond to a unit impulse along each of some rows.

    `motion` (coordinates, rows): Changes of velocities, as far as joints allow.
    `multipliers` (2 nodes, rows): Changes of the multipliers of all nodes.
    `delassus` (rows, rows): Changes along the rows; zero of what joints and drivers lead.
    `soft` (rows,): Its diagonal without joints.
    """

    motion: Array
    multipliers: Array
    delassus: Array
    soft: Array


def responses_to(uni: Unilateral, work: Work, block: Array, softer: float = MASSLESS) -> Responses:
    """Responses to rows (rows, coordinates) by the factor of the joints at the position of a
    workspace, without rows of contacts and sticking joints; accelerations have artificial masses,
    impulses none.
    """
    L, n = uni.layout, block.shape[1]
    slip_signs, on = work.slip_sign[: len(L.friction_kind), 0], work.on[: len(uni), 0].copy()
    uni.set_rows(work, np.zeros(len(uni)), slip_signs)
    rows = np.ascontiguousarray(block)
    motion, nodes = np.zeros((len(rows), n)), np.zeros((len(rows), 2 * L.nodes))
    row_responses(L, work, rows, motion, nodes, uni.regularization, uni.refinements, softer)
    uni.set_rows(work, on, slip_signs)
    weights = coordinate_weights(uni, work)
    # of what has no mass what replaces it says nothing: what it is a part of does
    replaced = uni.system.mass[:n, 0] * weights < 0.5
    soft = rows**2 @ np.where(replaced, tol.ARTIFICIAL_MASS * weights, weights)
    D = rows @ motion.T
    D = 0.5 * (D + D.T)
    led = np.diag(D) <= tol.CONTACT_ROW_LED * soft
    D[led], D[:, led] = 0.0, 0.0
    return Responses(motion.T, nodes.T, D, soft)


def coordinate_weights(uni: Unilateral, work: Work) -> Array:
    """Inverse masses and inertias (coordinates,) of one slot of each body, with artificial ones
    where there are none.
    """
    places = 3 * uni.layout.body_slot[: uni.layout.bodies, None] + np.arange(3)
    return np.asarray(work.weight[places, 0].ravel())


def contact_rows(uni: Unilateral, rows: Rows, closed: list[int]) -> tuple[Array, Array]:
    """Rows (2 m, coordinates) of gaps and of sliding of some contact points, and their rates."""
    n3 = rows.block.shape[1]
    found, rates = np.zeros((2 * len(closed), n3)), np.zeros(2 * len(closed))
    for k, number in enumerate(closed):
        point = uni.contact_points[number]
        found[k] = point.candidate.sign * rows.block[point.normal]
        rates[k] = point.candidate.sign * rows.rate[point.normal]
        if point.tangent >= 0:
            found[len(closed) + k] = rows.block[point.tangent]
            rates[len(closed) + k] = rows.rate[point.tangent]
    return found, rates


def strike(
    uni: Unilateral,
    work: Work,
    closed: list[int],
    *,
    still: bool = False,
    sticking: Array | None = None,
    without_collision: bool = False,
) -> Impact | None:
    """An impact of closed contact points at the state in the workspace; None where it has no
    solution. `sticking` (rows, coordinates).
    """
    W, rates = contact_rows(uni, uni.read(work), closed)
    points, v = [uni.contact_points[k] for k in closed], work.v[: W.shape[1], 0].copy()
    held, n = np.zeros((0, W.shape[1])) if sticking is None else sticking, len(W)
    every = responses_to(uni, work, np.vstack([W, held]))
    Y, D = every.motion[:, :n], every.delassus[:n, :n]
    if len(held):
        # what sticks takes its part of every impulse
        across = every.delassus[:n, n:]
        taken = [arresting_impulses(every.delassus[n:, n:], one) for one in across]
        Y, D = Y + every.motion[:, n:] @ np.transpose(taken), D + across @ np.transpose(taken)
    friction = np.array([one.friction for one in points])
    noise = tol.CONTACT_ACCELERATION_ROUNDING * (np.abs(W) @ np.abs(v))
    contacts = ClosedContacts(D, friction, noise)
    restitution = np.array([0.0 if still else one.restitution for one in points])
    newton = np.array([one.law == "newton" for one in points])
    impulse = contacts.impulses(rates, restitution, newton, without_collision=without_collision)
    if impulse is None:
        return None
    jump, m = Y @ impulse, len(closed)
    mean = rates + 0.5 * (W @ jump)
    gained = impulse * mean
    moved = impulse * (W @ v - rates)
    left = uni.system.mass[: len(jump), 0] * jump - W.T @ impulse
    nu = dense_rates(uni.system, work)
    driven = works_of_drivers(uni.system, work, left, nu, sticking)
    return Impact(jump, impulse, rates[:m], gained[:m] + gained[m:], moved[:m], driven)


def taken_by_artificial_masses(
    uni: Unilateral, work: Work, found: Impact, W: Array, before: Array
) -> tuple[float, float]:
    """Energy that what replaces missing masses takes of an impact along rows W, and the terms of
    what is exchanged. `before` (coordinates,): velocities.
    """
    share = np.repeat(work.share[uni.layout.body_slot[: uni.layout.bodies], 0], 3)
    weight, mean = share * coordinate_weights(uni, work), before + 0.5 * found.jump
    none = uni.system.mass[: len(before), 0] * weight < 0.5
    momentum = np.where(none, found.jump / (MASSLESS * weight), 0.0)
    return float(momentum @ mean), float(np.abs(found.impulses) @ (np.abs(W) @ np.abs(mean)))


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


def refuse_driven_impact(uni: Unilateral, work: Work, hit: list[int]) -> None:
    """Refuse an impact of what drivers lead."""
    W = contact_rows(uni, uni.read(work), hit)[0][: len(hit)]
    D = responses_to(uni, work, W).delassus
    for k, number in enumerate(hit):
        if not D[k, k] > 0.0:
            name = uni.contact_points[number].name
            raise SolveError(
                f"nothing that strikes '{name}' is free to rebound: it follows drivers alone; take "
                "them off, or record when it is reached by an Event",
                name,
            )


def arrest(uni: Unilateral, work: Work, closed: list[int]) -> Impact:
    """The gaps of closed contact points neither open nor close any more, nor does what stuck begin
    to slide: impulses of least norm where contact points depend on each other.
    """
    W, rates = contact_rows(uni, uni.read(work), closed)
    m = len(closed)
    # what opens, or slides, faster than it strikes goes on to
    fastest = -rates[:m].min()
    rows = [k for k in range(m) if rates[k] <= fastest]
    rows += [m + k for k in rows if abs(rates[m + k]) <= fastest]
    response = responses_to(uni, work, W[rows])
    impulse, work_done = np.zeros(2 * m), np.zeros(2 * m)
    impulse[rows] = arresting_impulses(response.delassus, rates[rows])
    jump = response.motion @ impulse[rows]
    work_done[rows] = impulse[rows] * (rates[rows] + 0.5 * (W[rows] @ jump))
    # what stops that move and drivers give is rounding by then
    return Impact(jump, impulse, rates[:m], work_done[:m] + work_done[m:], np.zeros(m), {})


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
