"""How closed contacts and frictional joints go on: sticking, sliding or open.

All of them are one problem of complementarity (`mbody.analysis.contact.friction_problem`), whose
solutions, each certified by its residual, are modes. The rows of the modes that go on are set as
far as they do not depend on others.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from mbody.analysis.contact.friction_problem import (
    ClosedContacts,
    FrictionProblem,
    FrictionSolution,
    JointFriction,
    Tangent,
    arresting_impulses,
    cone,
)
from mbody.analysis.contact.unilateral import SLIP_SIGNS, Overlap, Rows, Unilateral, deepest_overlap
from mbody.analysis.dynamics.interruptions import works_of_drivers
from mbody.analysis.dynamics.modal_motion import ModalMotion, multipliers_at
from mbody.analysis.dynamics.shared_friction import shared_friction
from mbody.core import tolerances as tol
from mbody.errors import ModelError, SolveError
from mbody.kernels.complementarity import row_responses
from mbody.kernels.friction import REACHED_PART
from mbody.kernels.layout import PER_PRIMITIVE, Work
from mbody.model.element import listed
from mbody.system.rank import dense, dense_rates

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


#: By how much motions without mass are softer to impulses than their artificial mass says.
MASSLESS = 1e6


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


# -- The problem of contacts and frictional joints at the present instant of a motion --------------
# Forces and accelerations are those that the kernels found with some modes; how they change by
# forces along the rows of what may open or slide follows from dense matrices of rows and masses.


@dataclass(frozen=True, eq=False)
class FrictionModel:
    """The problem, and whose its parts are.

    `problem`: Of pins torques and angular accelerations.
    `closed`: Contact points of the normals.
    `owners`: Of every tangent its contact point, or the number of contact points and that of its
      frictional joint.
    """

    problem: FrictionProblem
    closed: list[int]
    owners: list[int]


def _lasting(uni: Unilateral) -> list[tuple[int, float]]:
    """Pairs that teeth press apart: their numbers and directions."""
    L, par = uni.layout, uni.system.par
    kinds = range(len(L.friction_kind))
    return [
        (f, float(par[int(L.friction_par[f]) + 4, 0])) for f in kinds if uni.separates_wheels(f)
    ]


def model_of(
    motion: ModalMotion, closed: Sequence[int], sliding: Array, joint_sliding: Array
) -> FrictionModel:
    """The problem at the state, derivative and record of a motion, whose modes may be any.
    `sliding` (contacts,), `joint_sliding` (pairs,): signs of the sliding velocities, zero at rest.
    """
    uni, system, n = motion.uni, motion.system, motion.system.coordinates
    work, record, a = motion.work, motion.record[:, 0], motion.K[0, n : 2 * n]
    motion.load()
    rows = uni.read(work)
    points = [uni.contact_points[k] for k in closed]
    m, count = len(closed), len(uni.contact_points)
    W, _ = contact_rows(uni, rows, list(closed))
    frictional = [k for k in range(m) if points[k].static > 0.0]
    # of every tangent its row among those of the active set, its pair, its slip sign, its owner
    pairs = [
        (one.tangent, one.pair, joint_sliding[k], count + k)
        for k, one in enumerate(uni.friction_joints)
    ]
    pairs += [
        (int(uni.layout.friction_tangent[f]), f, slip_sign, -1) for f, slip_sign in _lasting(uni)
    ]
    tangent_rows = [row for row, *_ in pairs]
    every = np.vstack([W[:m], W[[m + k for k in frictional]], rows.block[tangent_rows]])
    gamma = np.concatenate(
        [
            [one.candidate.sign * rows.gamma[one.normal] for one in points],
            [rows.gamma[points[k].tangent] for k in frictional],
            rows.gamma[tangent_rows],
        ]
    )
    rates = rows.rate[tangent_rows]
    viscous = [
        system.par[int(uni.layout.friction_par[f]) + 3, 0] * rate
        for rate, (_, f, *_) in zip(rates, pairs, strict=True)
    ]
    forces = np.concatenate(
        [
            [uni.pressing(record, one) for one in points],
            [-uni.multiplier(record, points[k].tangent) for k in frictional],
            [v - uni.multiplier(record, row) for (row, *_), v in zip(pairs, viscous, strict=True)],
        ]
    )
    tangents = []
    for k in frictional:
        one, slip_sign = points[k], sliding[closed[k]]
        kinetic = cone(k, one.friction, slip_sign)
        rests = not slip_sign and one.static != one.friction
        tangents.append(replace(cone(k, one.static), begun=kinetic) if rests else kinetic)
    laws = [
        JointFriction(system, work, f, rate if slip_sign else None)
        for rate, (_, f, slip_sign, _) in zip(rates, pairs, strict=True)
    ]
    kinetic_laws = [JointFriction(system, work, f, 0.0) for _, f, *_ in pairs]
    noise = tol.CONTACT_ACCELERATION_ROUNDING * _terms(motion, every, gamma)
    response = responses_to(uni, work, every, softer=1.0)
    for law, slower, (_, _, slip_sign, _) in zip(laws, kinetic_laws, pairs, strict=True):
        at, node = np.array(multipliers_at(system, record, law.node)), 2 * law.node
        by = response.multipliers[node : node + 2]
        tangent = Tangent(-1, sliding=slip_sign, law=(law, at, by))
        if not slip_sign and not np.array_equal(law.arm, slower.arm):
            tangent = replace(tangent, begun=Tangent(-1, law=(slower, at, by)))
        tangents.append(tangent)
    problem = FrictionProblem(
        m, tuple(tangents), every @ a - gamma, response.delassus, forces, noise, response.soft
    )
    owners = [closed[k] for k in frictional] + [owner for *_, owner in pairs]
    return FrictionModel(problem, list(closed), owners)


def _terms(motion: ModalMotion, rows: Array, gamma: Array) -> Array:
    """Sums of the terms of which accelerations along rows (rows, coordinates) are made."""
    system, n, record = motion.system, motion.system.coordinates, motion.record[:, 0]
    primitive, number, _ = system.row_table
    _, G = dense(system, motion.work)
    own = record[3 * n + PER_PRIMITIVE * primitive + number] / system.row_units
    joints = np.abs(G.T) @ np.abs(own) / system.coordinate_units
    terms = np.abs(motion.K[0, n : 2 * n]) + coordinate_weights(motion.uni, motion.work) * joints
    return np.asarray(np.abs(rows) @ terms + np.abs(gamma))


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


@dataclass(frozen=True, eq=False)
class _DecisionState:
    """State, closed contacts and velocities at rest at which modes are decided.

    `y`: The state.
    `closed`: Contact points.
    `sliding`, `joint_sliding` (points,) (frictional joints,): Signs of the rates of what slides,
      zero of what is at rest.
    """

    y: Array
    closed: list[int]
    sliding: Array
    joint_sliding: Array


def closed_points(motion: ModalMotion, rows: Rows) -> list[int]:
    """Contact points whose gap is none, within the ends of their edges; rows of the present
    state.
    """
    uni, gap_tolerance = motion.uni, motion.gap_tolerance
    within = uni.within_edges(
        rows, motion.work, gap_tolerance, tol.RATE_NONE_FRICTION * motion.speeds
    )
    found = {int(n) for n in np.flatnonzero((np.abs(uni.gaps(rows)) <= gap_tolerance) & within)}
    return sorted((found | motion.transition.closed) - motion.transition.opened - motion.beyond)


def decide(motion: ModalMotion) -> Verdict:
    """Set the modes that go on from the present state, with its derivative and record."""
    now = _instant(motion)
    model = _model(motion, now)
    found, complete = model.problem.solutions(begins=True)
    reached = motion.system.friction_rows.start + REACHED_PART
    for one in found:
        modes, pairs = _modes(motion, model, one)
        _set(motion, now, modes, pairs, one)
        # what slides may jam though its modes are consistent, or friction that is followed from
        # none reach another solution
        follows = not len(motion.layout.friction_kind) or motion.record[reached, 0] >= 1.0
        if follows and _goes_on(motion, now, modes, pairs) and _keeps_apart(motion, now, modes):
            motion.shared = shared_friction(motion)
            return Verdict(True, len(found) > 1, complete)
    return Verdict(False, complete=complete)


def _goes_on(motion: ModalMotion, now: _DecisionState, modes: list[str], pairs: list[str]) -> bool:
    """Whether what begins to slide does so in the direction of its acceleration by the kernels."""
    uni, n = motion.uni, motion.system.coordinates
    # of what is smooth the direction changes nothing
    points = [k for k, one in enumerate(uni.contact_points) if one.static > 0.0]
    begins = [(uni.contact_points[k].tangent, modes[k], now.sliding[k]) for k in points]
    begins += [
        (one.tangent, mode, slides)
        for one, mode, slides in zip(uni.friction_joints, pairs, now.joint_sliding, strict=True)
    ]
    begun = [
        (row, SLIP_SIGNS[mode]) for row, mode, slides in begins if mode in SLIP_SIGNS and not slides
    ]
    if not begun:
        return True
    motion.load()
    rows, a = uni.read(motion.work), motion.K[0, n : 2 * n]
    for row, slip_sign in begun:
        parts = np.append(rows.block[row] * a, -rows.gamma[row])
        if slip_sign * parts.sum() < -tol.FORCE_NONE * np.abs(parts).sum():
            return False
    return True


def _keeps_apart(motion: ModalMotion, now: _DecisionState, modes: list[str]) -> bool:
    """Whether what opens goes apart by the kernels, where the problem has lost the heavy beside the
    light.
    """
    uni, n = motion.uni, motion.system.coordinates
    if ratio_of_masses(uni, now.closed) <= tol.MASSES_LOST:
        return True
    motion.load()
    rows, a = uni.read(motion.work), motion.K[0, n : 2 * n]
    opened = [uni.contact_points[k] for k in now.closed if modes[k] == "open"]
    parts = [
        one.candidate.sign * np.append(rows.block[one.normal] * a, -rows.gamma[one.normal])
        for one in opened
    ]
    return all(one.sum() >= -tol.FORCE_NONE * np.abs(one).sum() for one in parts)


def _instant(motion: ModalMotion) -> _DecisionState:
    uni, transition, count = motion.uni, motion.transition, len(motion.uni.contact_points)
    motion.load()
    rows = uni.read(motion.work)
    velocity_tolerance, approach = tol.RATE_NONE_FRICTION * motion.speeds, uni.approach(rows)
    closed = [
        k
        for k in closed_points(motion, rows)
        if abs(approach[k]) <= velocity_tolerance[k] or k in transition.closed
    ]
    tangents = [t.tangent for t in uni.contact_points] + [p.tangent for p in uni.friction_joints]
    speeds = _speeds(motion, tangents, rows.rate)
    still = np.abs(speeds) <= velocity_tolerance
    still[list(transition.stopped)] = True
    if transition.stopped:
        sticking = [k for k in np.flatnonzero(still) if k >= count or k in closed]
        left = _speeds(
            motion, tangents, _rates_when_stopped(motion, rows, [tangents[k] for k in sticking])
        )
        still |= (np.abs(speeds) <= tol.RATE_NONE_STOPPED * motion.speeds) & (
            np.abs(left) <= np.maximum(velocity_tolerance, tol.RATE_NONE_STOPPED * np.abs(speeds))
        )
    slip_signs = np.where(still, 0.0, np.sign(speeds))
    for n, slip_sign in transition.sliding.items():
        slip_signs[n] = slip_sign
    return _DecisionState(motion.y.copy(), closed, slip_signs[:count], slip_signs[count:])


def _speeds(motion: ModalMotion, tangents: list[int], rates: Array) -> Array:
    """Rates along the tangents, those of pins, angular, by the model length; zero of ropes."""
    unit = np.where(motion.uni.angular, motion.system.length, 1.0)
    return np.array([rates[row] * unit[row] if row >= 0 else 0.0 for row in tangents])


def _rates_when_stopped(motion: ModalMotion, rows: Rows, stopped: list[int]) -> Array:
    """Rates of all rows that would be left if some were stopped: what was located as stopped moves
    by rounding, and others with it.
    """
    stopped = [row for row in stopped if row >= 0]
    W = rows.block[stopped]
    response = responses_to(motion.uni, motion.work, W)
    stops = response.motion @ arresting_impulses(response.delassus, rows.rate[stopped])
    return np.asarray(rows.rate + rows.block @ stops)


def _model(motion: ModalMotion, now: _DecisionState) -> FrictionModel:
    """The problem, from what the kernels find with all contacts open and joints without
    friction.
    """
    pairs = ["stick"] * len(now.joint_sliding)
    motion.y[:] = now.y
    none = np.zeros(len(motion.uni.contact_points), dtype=bool)
    open_ones = ["open"] * len(motion.uni.contact_points)
    motion.set_modes(open_ones, pairs, np.column_stack([none, none]), np.zeros(len(pairs)))
    motion.evaluate()
    return model_of(motion, now.closed, now.sliding, now.joint_sliding)


def _modes(
    motion: ModalMotion, model: FrictionModel, one: FrictionSolution
) -> tuple[list[str], list[str]]:
    """Modes of all contact points and frictional joints by a solution."""
    count = len(motion.uni.contact_points)
    normal, tangential = one.modes()
    found = {number: mode for number, mode in zip(model.owners, tangential, strict=True)}
    modes = ["open"] * count
    for number, state in zip(model.closed, normal, strict=True):
        if state == "closed":
            modes[number] = found.get(number, "slip+")  # smooth: its direction changes nothing
    return modes, [found[count + m] for m in range(len(motion.uni.friction_joints))]


def _set(
    motion: ModalMotion,
    now: _DecisionState,
    modes: list[str],
    pairs: list[str],
    one: FrictionSolution,
) -> None:
    """Set modes, with the rows that do not depend on others, and evaluate."""
    problem, size = one.problem, np.abs(one.forces)
    terms = np.abs(problem.without) + np.abs(problem.delassus) @ size
    # of what a light body presses against a heavy one its own motion tells
    presses = np.diag(problem.delassus) * size > tol.CONTACT_FORCE_NONE * terms
    pressing = dict(zip(now.closed, one.forces * presses, strict=False))
    motion.y[:] = now.y
    motion.load()
    on, sticking = _independent(motion, now, modes, pairs, pressing)
    motion.set_modes(modes, pairs, on, sticking)
    motion.evaluate()


def _independent(
    motion: ModalMotion,
    now: _DecisionState,
    modes: list[str],
    pairs: list[str],
    pressing: dict[int, float],
) -> tuple[Array, Array]:
    """Which rows do not depend on others: of contact points (points, 2), normal and tangent, those
    that press first, then of frictional joints that stick, last of contact points without force,
    which is none in `pressing`.
    Sets the groups of contact points that stick by one row.
    """
    uni, system = motion.uni, motion.system
    scale, rows = system.coordinate_units, motion.uni.read(motion.work)
    kept: list[Array] = []

    def independent(row: Array) -> bool:
        size = float(np.linalg.norm(row))
        if size == 0.0:
            return False
        left = row / size
        for _ in range(2):
            for one in kept:
                left = left - (one @ left) * one
        part = float(np.linalg.norm(left))
        if part <= tol.ROWS_DEPENDENT:
            return False
        kept.append(left / part)
        return True

    def along_one_row(one: int, other: int) -> bool:
        """Whether two contact points of the same bodies slide together, as corners on one edge
        do.
        """
        first, second = (rows.block[uni.contact_points[k].tangent] * scale for k in (one, other))
        both = float(np.linalg.norm(first)) * float(np.linalg.norm(second))
        same = abs(float(first @ second)) >= (1.0 - tol.ROWS_DEPENDENT) * both
        return same and set(uni.bodies[one]) == set(uni.bodies[other])

    for row in dense(system, motion.work)[1]:
        independent(row)
    on = np.zeros((len(uni.contact_points), 2), dtype=bool)
    sticking = np.zeros(len(uni.friction_joints), dtype=bool)
    motion.groups = {}
    closed = sorted((k for k in now.closed if modes[k] != "open"), key=lambda k: -pressing[k])
    for k in closed:
        if pressing[k] > 0.0:
            on[k, 0] = independent(rows.block[uni.contact_points[k].normal] * scale)
    for k in sorted(closed):
        if modes[k] != "stick" or not on[k, 0]:
            continue
        if independent(rows.block[uni.contact_points[k].tangent] * scale):
            on[k, 1] = True
            motion.groups[k] = [k]
        else:
            owner = next((one for one in motion.groups if along_one_row(one, k)), None)
            if owner is not None:
                motion.groups[owner].append(k)
    for m, mode in enumerate(pairs):
        if mode == "stick":
            sticking[m] = independent(rows.block[uni.friction_joints[m].tangent] * scale)
    for k in closed:
        if pressing[k] <= 0.0:
            on[k, 0] = independent(rows.block[uni.contact_points[k].normal] * scale)
    return on, sticking
