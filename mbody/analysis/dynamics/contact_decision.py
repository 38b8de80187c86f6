"""How closed contacts and frictional joints go on: sticking, sliding or open.

All of them are one problem of complementarity (`mbody.analysis.contact.friction_problem`), whose
solutions are modes. These are set, and verified by the forces and accelerations of the kernels:
what presses does so, what is open does not approach, what sticks has less friction than it could,
what begins to slide does so in the direction of its acceleration. Modes that are not verified are
changed where they disagree; that is the step of a semismooth Newton method on τ = proj(τ − r α).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mbody.analysis.contact.complementarity import (
    ClosedContacts,
    FrictionProblem,
    FrictionSolution,
    JointFriction,
    Limits,
    Tangent,
    cone,
    decide_modes,
    impact_impulses,
)
from mbody.analysis.contact.unilateral import SLIP_SIGNS, Overlap, Rows, Unilateral, deepest_overlap
from mbody.analysis.dynamics.interruptions import works_of_drivers
from mbody.analysis.dynamics.modal_motion import ModalMotion, force_size, multipliers_at
from mbody.analysis.dynamics.shared_friction import shared_friction
from mbody.core import tolerances as tol
from mbody.errors import ModelError, SolveError
from mbody.kernels.friction import REACHED_PART
from mbody.kernels.layout import Work
from mbody.system.rank import dense, dense_rates, rank_of
from mbody.system.system import System

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


def responses_to(uni: Unilateral, work: Work, block: Array, sticking: Array | None = None) -> Array:
    """How velocities change by an impulse along each row: M⁻¹ blockᵀ, (coordinates, rows), as far
    as joints allow; `sticking` are further rows that hold, (rows, coordinates).

    N (Nᵀ M N)⁻¹ Nᵀ, N the free directions: bodies without mass are ordinary where joints guide
    them.
    """
    system, n = uni.system, block.shape[1]
    scale = system.coordinate_units
    G = dense(system, work)[1]
    if sticking is not None and len(sticking):
        size = np.linalg.norm(sticking * scale, axis=1, keepdims=True)
        G = np.vstack([G, sticking * scale / np.where(size > 0.0, size, 1.0)])
    motions = rank_of(G).motions if len(G) else np.eye(n)
    if not len(motions):
        return np.zeros((n, len(block)))
    inertia = (motions * (system.mass[:n, 0] * scale**2)) @ motions.T
    along = motions @ (block * scale).T
    if np.linalg.cond(inertia) < 1.0 / tol.INERTIA_NONE_CONTACT:
        response = np.linalg.solve(inertia, along)
    else:
        response = np.linalg.lstsq(inertia, along, rcond=tol.INERTIA_NONE_CONTACT)[0]
    return np.asarray(scale[:, None] * (motions.T @ response))


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
    points = [uni.contact_points[k] for k in closed]
    Y = responses_to(uni, work, W, sticking)
    friction = np.array([one.friction for one in points])
    contacts = ClosedContacts(W @ Y, friction, np.where(friction > 0.0, 0.0, 1.0))
    restitution = np.array([0.0 if still else one.restitution for one in points])
    newton = np.array([one.law == "newton" for one in points])
    impulse = impact_impulses(
        contacts, rates, restitution, newton, without_collision=without_collision
    )
    if impulse is None:
        return None
    jump, m = Y @ impulse, len(closed)
    mean = rates + 0.5 * (W @ jump)
    gained = impulse * mean
    moved = impulse * (W @ work.v[: W.shape[1], 0] - rates)
    left = uni.system.mass[: len(jump), 0] * jump - W.T @ impulse
    nu = dense_rates(uni.system, work)
    driven = works_of_drivers(uni.system, work, left, nu, sticking)
    return Impact(jump, impulse, rates[:m], gained[:m] + gained[m:], moved[:m], driven)


def refuse_driven_impact(uni: Unilateral, work: Work, hit: list[int]) -> None:
    """Refuse an impact of what drivers lead."""
    system = uni.system
    W = contact_rows(uni, uni.read(work), hit)[0][: len(hit)]
    sizes = np.linalg.norm(W * system.coordinate_units, axis=1)
    moved = np.linalg.norm(responses_to(uni, work, W) / system.coordinate_units[:, None], axis=0)
    usual = float(system.mass[: W.shape[1], 0].max()) * system.length**2
    for k, number in enumerate(hit):
        if not moved[k] * usual > tol.CONTACT_DRIVEN * sizes[k]:
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
    # what slides faster than it strikes goes on to
    stuck = [k for k in range(m, 2 * m) if abs(rates[k]) <= np.abs(rates[:m]).max()]
    rows = [*range(m), *stuck]
    Y = responses_to(uni, work, W[rows])
    impulse, work_done = np.zeros(2 * m), np.zeros(2 * m)
    impulse[rows] = np.linalg.lstsq(
        W[rows] @ Y, -rates[rows], rcond=tol.CONTACT_IMPULSES_DEPENDENT
    )[0]
    jump = Y @ impulse[rows]
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

    `problem`: Torques and angular accelerations by the model length.
    `closed`: Contact points of the normals.
    `owners`: Of every tangent its contact point, or the number of contact points and that of its
      frictional joint.
    """

    problem: FrictionProblem
    closed: list[int]
    owners: list[int]


def joint_multipliers(system: System, work: Work, changes: Array, accelerations: Array) -> Array:
    """How the multipliers of all nodes change, (2 nodes, forces), by generalised forces `changes`
    (coordinates, forces) that change accelerations so: those of least norm where rows of joints are
    redundant.
    """
    _, G = dense(system, work)
    n = G.shape[1]
    left = changes - system.mass[:n] * accelerations
    scaled = np.linalg.pinv(G.T, rcond=tol.SINGULAR_VALUE_ZERO) @ (
        left * system.coordinate_units[:, None]
    )
    primitive, row, _ = system.row_table
    found = np.zeros((2 * system.layout.nodes, changes.shape[1]))
    found[2 * system.layout.primitive_node[primitive] + row] = system.row_units[:, None] * scaled
    return found


def _limits(
    law: JointFriction, at: tuple[float, float], change: Array, forces: Array, unit: float
) -> Limits:
    """Limits of a joint whose multipliers (2,) at `forces` are known, and their change (2, all)."""

    def limits(now: Array) -> tuple[Array, Array, Array, Array]:
        x, y = np.moveaxis(np.array(at) + (now - forces) @ change.T, -1, 0)
        found = list[Array]()
        for slip_sign in (1.0, -1.0):
            size, by_x, by_y = (np.asarray(part)[..., None] for part in law.size(x, y, slip_sign))
            found += [unit * size[..., 0], unit * (by_x * change[0] + by_y * change[1])]
        return found[0], found[2], found[1], found[3]

    return limits


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
    frictional = [k for k in range(m) if points[k].tangent >= 0 and points[k].static > 0.0]
    # of every tangent its row among those of the active set, its pair, its slip sign, its owner
    pairs = [
        (one.tangent, one.pair, joint_sliding[k], count + k)
        for k, one in enumerate(uni.friction_joints)
    ]
    pairs += [
        (int(uni.layout.friction_tangent[f]), f, slip_sign, -1) for f, slip_sign in _lasting(uni)
    ]
    unit = np.array([system.length if uni.angular[row] else 1.0 for row, *_ in pairs])
    tangent_rows = [row for row, *_ in pairs]
    every = np.vstack(
        [W[:m], W[[m + k for k in frictional]], unit[:, None] * rows.block[tangent_rows]]
    )
    gamma = np.concatenate(
        [
            [one.candidate.sign * rows.gamma[one.normal] for one in points],
            [rows.gamma[points[k].tangent] for k in frictional],
            unit * rows.gamma[tangent_rows],
        ]
    )
    viscous = [
        system.par[int(uni.layout.friction_par[f]) + 3, 0] * rows.rate[row] for row, f, *_ in pairs
    ]
    forces = np.concatenate(
        [
            [uni.pressing(record, one) for one in points],
            [-uni.multiplier(record, points[k].tangent) for k in frictional],
            [
                (v - uni.multiplier(record, row)) / u
                for (row, *_), v, u in zip(pairs, viscous, unit, strict=True)
            ],
        ]
    )
    Y = responses_to(uni, work, every)
    tangents = []
    for k in frictional:
        one, slip_sign = points[k], sliding[closed[k]]
        tangents.append(cone(len(every), k, one.friction if slip_sign else one.static, slip_sign))
    if pairs:
        changes = joint_multipliers(system, work, every.T, Y)
    for (row, f, slip_sign, _), u in zip(pairs, unit, strict=True):
        law = JointFriction(system, work, f, rows.rate[row] if slip_sign else None)
        at, node = multipliers_at(system, record, law.node), 2 * law.node
        limits = _limits(law, at, changes[node : node + 2], forces, 1.0 / u)
        tangents.append(Tangent(limits, slip_sign, linear=law.by_law))
    D = every @ Y
    heavy = float(np.diag(D).max(initial=0.0)) * force_size(motion)
    owners = [closed[k] for k in frictional] + [owner for *_, owner in pairs]
    problem = FrictionProblem(m, tuple(tangents), every @ a - gamma, D, forces, 1e-3 * heavy)
    return FrictionModel(problem, list(closed), owners)


#: Changes of modes that the kernels do not verify, at most.
CHANGES = 30


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
        rows, motion.work, gap_tolerance, tol.RATE_NONE_FRICTION * motion.speed
    )
    found = {int(n) for n in np.flatnonzero((np.abs(uni.gaps(rows)) <= gap_tolerance) & within)}
    return sorted((found | motion.transition.closed) - motion.transition.opened - motion.beyond)


def decide(motion: ModalMotion) -> Verdict:
    """Set the modes that go on from the present state, with its derivative and record."""
    now = _instant(motion)
    model = _model(motion, now)
    found, complete = decide_modes(model.problem)
    several = len(found) > 1
    for one in found:
        modes, pairs = _modes(motion, model, one)
        _set(motion, now, modes, pairs, one)
        if not _wrong(motion, now, model):
            return Verdict(True, several, complete)
    for one in found:
        if _agreeing_modes(motion, now, model, one):
            return Verdict(True, several, complete)
    return Verdict(False, complete=complete)


def _instant(motion: ModalMotion) -> _DecisionState:
    uni, transition, count = motion.uni, motion.transition, len(motion.uni.contact_points)
    motion.load()
    rows = uni.read(motion.work)
    velocity_tolerance, approach = tol.RATE_NONE_FRICTION * motion.speed, uni.approach(rows)
    closed = [
        k
        for k in closed_points(motion, rows)
        if abs(approach[k]) <= velocity_tolerance or k in transition.closed
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
        still |= (np.abs(speeds) <= tol.RATE_NONE_STOPPED * motion.speed) & (
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
    Y = responses_to(motion.uni, motion.work, W)
    stops = np.linalg.pinv(W @ Y, rcond=tol.ROWS_DEPENDENT, hermitian=True) @ rows.rate[stopped]
    return np.asarray(rows.rate - rows.block @ (Y @ stops))


def _model(motion: ModalMotion, now: _DecisionState) -> FrictionModel:
    """The problem, from what the kernels find with all contacts open and no joint stuck."""
    pairs = [_mode(slip_sign) for slip_sign in now.joint_sliding]
    motion.y[:] = now.y
    none = np.zeros(len(motion.uni.contact_points), dtype=bool)
    open_ones = ["open"] * len(motion.uni.contact_points)
    motion.set_modes(open_ones, pairs, np.column_stack([none, none]), np.zeros(len(pairs)))
    motion.evaluate()
    return model_of(motion, now.closed, now.sliding, now.joint_sliding)


def _mode(slip_sign: float) -> str:
    return "slip+" if slip_sign > 0.0 else "slip-" if slip_sign < 0.0 else "stick"


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
    pressing = dict(zip(now.closed, one.forces, strict=False))
    motion.y[:] = now.y
    motion.load()
    on, sticking = _independent(motion, now, modes, pairs, pressing)
    motion.set_modes(modes, pairs, on, sticking)
    motion.evaluate()


def _agreeing_modes(
    motion: ModalMotion, now: _DecisionState, model: FrictionModel, one: FrictionSolution
) -> bool:
    """Change modes that forces and accelerations disagree with until none does."""
    modes, pairs = _modes(motion, model, one)
    tried = set[tuple[str, ...]]()
    for _ in range(CHANGES):
        if (*modes, *pairs) in tried:
            return False
        tried.add((*modes, *pairs))
        _set(motion, now, modes, pairs, one)
        wrong = _wrong(motion, now, model)
        if not wrong:
            return True
        for n, mode in wrong.items():
            if n < len(modes):
                modes[n] = mode
            elif n - len(modes) < len(pairs):
                pairs[n - len(modes)] = mode
    return False


def _wrong(motion: ModalMotion, now: _DecisionState, model: FrictionModel) -> dict[int, str]:
    """Contact points and, after these, frictional joints whose modes are not consistent with the
    forces and accelerations of the kernels, and better ones.
    """
    uni, n, count = motion.uni, motion.system.coordinates, len(motion.uni.contact_points)
    record, a = motion.record[:, 0], motion.K[0, n : 2 * n]
    motion.load()
    rows, found = uni.read(motion.work), dict[int, str]()
    reached = motion.system.friction_rows.start + REACHED_PART
    if len(motion.layout.friction_kind) and record[reached] < 1.0:
        return {count + len(uni.friction_joints): "jams"}
    force = tol.FORCE_NONE * force_size(motion)
    sharing = {k for group in motion.groups.values() for k in group[1:]}

    def ahead(row: int, slip_sign: float = 1.0) -> bool:
        """Whether the acceleration along a row is that way, or none."""
        parts = np.append(rows.block[row] * a, rows.gamma[row])
        along = float(parts[:-1].sum() - parts[-1])
        unit = motion.system.length if uni.angular[row] else 1.0
        size = max(float(np.abs(parts).max()), model.problem.greatest / unit)
        return slip_sign * along >= -tol.FORCE_NONE * size

    for k in now.closed:
        point, mode = uni.contact_points[k], motion.modes[k]
        if mode == "open":
            if not ahead(point.normal, point.candidate.sign):
                found[k] = "stick" if point.static > 0.0 and not now.sliding[k] else "slip+"
                if now.sliding[k]:
                    found[k] = _mode(now.sliding[k])
            continue
        if mode == "redundant" or point.static == 0.0:
            if uni.pressing(record, point) < -force:
                found[k] = "open"
            continue
        if uni.pressing(record, point) < -force:
            found[k] = "open"
        elif mode == "stick" and k not in sharing:
            group = motion.groups.get(k, [k])
            most = sum(
                uni.contact_points[j].static * uni.pressing(record, uni.contact_points[j])
                for j in group
            )
            own = float(uni.multiplier(record, point.tangent))
            if abs(own) > most + force:
                found.update(dict.fromkeys(group, _mode(own)))
        elif (
            mode in SLIP_SIGNS and not now.sliding[k] and not ahead(point.tangent, SLIP_SIGNS[mode])
        ):
            found[k] = "stick"
    for m, pair in enumerate(uni.friction_joints):
        mode = motion.pairs[m]
        if mode == "stick":
            own = float(uni.multiplier(record, pair.tangent))
            unit = motion.system.length if uni.angular[pair.tangent] else 1.0
            law = JointFriction(motion.system, motion.work, pair.pair)
            x, y = uni.pressing_pair(record, pair)
            if abs(own) > law.size(x, y, float(np.sign(own)))[0] + force * unit:
                found[count + m] = _mode(own)
        elif not now.joint_sliding[m] and not ahead(pair.tangent, SLIP_SIGNS[mode]):
            found[count + m] = "stick"
    motion.shared = shared_friction(motion)
    if motion.shared is not None and found:
        open_ones = motion.shared.members | motion.shared.pressing
        motion.load()
        if (
            found.keys() & open_ones
            and motion.shared.reserve(motion, record, motion.work).least >= -force
        ):
            found = {k: mode for k, mode in found.items() if k not in open_ones}
    return found


def _independent(
    motion: ModalMotion,
    now: _DecisionState,
    modes: list[str],
    pairs: list[str],
    pressing: dict[int, float],
) -> tuple[Array, Array]:
    """Which rows do not depend on others: of contact points (points, 2), normal and tangent, those
    that press first, then of frictional joints that stick, last of contact points without force.
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
    least = tol.CONTACT_FORCE_NONE * max(pressing.values(), default=0.0)
    for k in closed:
        if pressing[k] > least:
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
        if pressing[k] <= least:
            on[k, 0] = independent(rows.block[uni.contact_points[k].normal] * scale)
    return on, sticking
