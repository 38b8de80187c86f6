"""How closed contacts and rough joints go on: sticking, sliding or open.

All of them are one problem of complementarity (`mbody.analysis.contact.friction_problem`), whose
solutions are modes. These are set, and verified by the forces and accelerations of the kernels:
what presses does so, what is open does not approach, what sticks has less friction than it could,
what begins to slide does so in the sense of its acceleration. Modes that are not verified are
changed where they disagree; that is the step of a semismooth Newton method on τ = proj(τ − r α).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mbody.analysis.contact.friction_problem import FrictionSolution, decide_modes
from mbody.analysis.contact.joint_friction import JointFriction
from mbody.analysis.contact.unilateral import SENSES, Rows
from mbody.analysis.dynamics.contact_impacts import responses_to
from mbody.analysis.dynamics.friction_model import FrictionModel, force_size, model_of
from mbody.analysis.dynamics.modal_motion import ModalMotion
from mbody.analysis.dynamics.shared_friction import shared_friction
from mbody.kernels.friction import REACHED_PART
from mbody.system.rank import dense

__all__ = ["STILL", "Verdict", "decide", "near_touches"]

Array = np.ndarray

#: Slower than this, as a part of the swiftest motion, does not move; slower than the other one
#: rests where what has stopped lets nothing else move.
STILL, SLOWED = 1e-11, 1e-7
#: Reserves of friction, forces and accelerations below this part of the greatest are none.
ROUNDING = 1e-9
#: Rows that depend on others by less than this part are dependent.
DEPENDENT = 1e-9
#: A force below this part of the greatest is none.
NO_FORCE = 1e-12
#: Changes of modes that the kernels do not verify, at most.
CHANGES = 30


@dataclass(frozen=True)
class Verdict:
    """What was found of the modes that go on.

    Attributes
    ----------
    consistent : bool
        Whether there are any.
    several : bool
        Whether there are others with other accelerations.
    complete : bool
        Whether all sets of modes were tried.
    """

    consistent: bool
    several: bool = False
    complete: bool = True


@dataclass(frozen=True, eq=False)
class _DecisionState:
    """What is closed and at rest where modes are decided.

    Attributes
    ----------
    y : array
        The state.
    closed : list of int
        Touches.
    sliding, resting : arrays (touches,), (rough joints,)
        Signs of the rates of what slides, zero of what is at rest.
    """

    y: Array
    closed: list[int]
    sliding: Array
    resting: Array


def near_touches(motion: ModalMotion, rows: Rows) -> list[int]:
    """Touches whose gap is none, within the ends of their edges; rows of the present state."""
    uni, near = motion.uni, motion.near
    within = uni.within_edges(rows, motion.work, near, STILL * motion.speed)
    found = {int(n) for n in np.flatnonzero((np.abs(uni.gaps(rows)) <= near) & within)}
    return sorted((found | motion.closing.closed) - motion.closing.opened - motion.beyond)


def decide(motion: ModalMotion) -> Verdict:
    """Set the modes that go on from the present state, with its derivative and page."""
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
        if _changed(motion, now, model, one):
            return Verdict(True, several, complete)
    return Verdict(False, complete=complete)


def _instant(motion: ModalMotion) -> _DecisionState:
    uni, closing, count = motion.uni, motion.closing, len(motion.uni.touches)
    motion.load()
    rows = uni.read(motion.work)
    slow, approach = STILL * motion.speed, uni.approach(rows)
    closed = [
        k for k in near_touches(motion, rows) if abs(approach[k]) <= slow or k in closing.closed
    ]
    tangents = [t.tangent for t in uni.touches] + [p.tangent for p in uni.rough]
    speeds = _speeds(motion, tangents, rows.rate)
    still = np.abs(speeds) <= slow
    still[list(closing.stopped)] = True
    if closing.stopped:
        rests = [k for k in np.flatnonzero(still) if k >= count or k in closed]
        left = _speeds(motion, tangents, _held_rates(motion, rows, [tangents[k] for k in rests]))
        still |= (np.abs(speeds) <= SLOWED * motion.speed) & (
            np.abs(left) <= np.maximum(slow, SLOWED * np.abs(speeds))
        )
    senses = np.where(still, 0.0, np.sign(speeds))
    for n, sense in closing.sliding.items():
        senses[n] = sense
    return _DecisionState(motion.y.copy(), closed, senses[:count], senses[count:])


def _speeds(motion: ModalMotion, tangents: list[int], rates: Array) -> Array:
    """Rates along the tangents, those of pins, which are angular, by the model length; zero of
    ropes.
    """
    unit = np.where(motion.uni.angular, motion.system.length, 1.0)
    return np.array([rates[row] * unit[row] if row >= 0 else 0.0 for row in tangents])


def _held_rates(motion: ModalMotion, rows: Rows, held: list[int]) -> Array:
    """Rates of all rows that would be left if some were stopped: what was located as stopped moves
    by rounding, and others with it.
    """
    held = [row for row in held if row >= 0]
    W = rows.block[held]
    Y = responses_to(motion.uni, motion.work, W)
    stops = np.linalg.pinv(W @ Y, rcond=DEPENDENT, hermitian=True) @ rows.rate[held]
    return np.asarray(rows.rate - rows.block @ (Y @ stops))


def _model(motion: ModalMotion, now: _DecisionState) -> FrictionModel:
    """The problem, from what the kernels find with all contacts open and no joint stuck."""
    pairs = [_mode(sense) for sense in now.resting]
    motion.y[:] = now.y
    none = np.zeros(len(motion.uni.touches), dtype=bool)
    open_ones = ["open"] * len(motion.uni.touches)
    motion.set_modes(open_ones, pairs, np.column_stack([none, none]), np.zeros(len(pairs)))
    motion.evaluate()
    return model_of(motion, now.closed, now.sliding, now.resting)


def _mode(sense: float) -> str:
    return "slip+" if sense > 0.0 else "slip-" if sense < 0.0 else "stick"


def _modes(
    motion: ModalMotion, model: FrictionModel, one: FrictionSolution
) -> tuple[list[str], list[str]]:
    """Modes of all touches and rough joints by a solution."""
    count = len(motion.uni.touches)
    normal, tangential = one.modes()
    found = {number: mode for number, mode in zip(model.owners, tangential, strict=True)}
    modes = ["open"] * count
    for number, state in zip(model.closed, normal, strict=True):
        if state == "closed":
            modes[number] = found.get(number, "slip+")  # smooth: its sense changes nothing
    return modes, [found[count + m] for m in range(len(motion.uni.rough))]


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
    on, held = _independent(motion, now, modes, pairs, pressing)
    motion.set_modes(modes, pairs, on, held)
    motion.evaluate()


def _changed(
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
    """Touches and, after these, rough joints whose modes are not consistent with the forces and
    accelerations of the kernels, and better ones.
    """
    uni, n, count = motion.uni, motion.system.coordinates, len(motion.uni.touches)
    page, a = motion.page[:, 0], motion.K[0, n : 2 * n]
    motion.load()
    rows, found = uni.read(motion.work), dict[int, str]()
    reached = motion.system.friction_rows.start + REACHED_PART
    if len(motion.layout.friction_kind) and page[reached] < 1.0:
        return {count + len(uni.rough): "jams"}
    force = ROUNDING * force_size(motion)
    followers = {k for group in motion.groups.values() for k in group[1:]}

    def ahead(row: int, sense: float = 1.0) -> bool:
        """Whether the acceleration along a row is that way, or none."""
        parts = np.append(rows.block[row] * a, rows.gamma[row])
        along = float(parts[:-1].sum() - parts[-1])
        unit = motion.system.length if uni.angular[row] else 1.0
        size = max(float(np.abs(parts).max()), model.problem.greatest / unit)
        return sense * along >= -ROUNDING * size

    for k in now.closed:
        touch, mode = uni.touches[k], motion.modes[k]
        if mode == "open":
            if not ahead(touch.normal, touch.spot.sense):
                found[k] = "stick" if touch.static > 0.0 and not now.sliding[k] else "slip+"
                if now.sliding[k]:
                    found[k] = _mode(now.sliding[k])
            continue
        if mode == "idle" or touch.static == 0.0:
            if uni.pressing(page, touch) < -force:
                found[k] = "open"
            continue
        if uni.pressing(page, touch) < -force:
            found[k] = "open"
        elif mode == "stick" and k not in followers:
            group = motion.groups.get(k, [k])
            most = sum(uni.touches[j].static * uni.pressing(page, uni.touches[j]) for j in group)
            own = float(uni.multiplier(page, touch.tangent))
            if abs(own) > most + force:
                found.update(dict.fromkeys(group, _mode(own)))
        elif mode in SENSES and not now.sliding[k] and not ahead(touch.tangent, SENSES[mode]):
            found[k] = "stick"
    for m, pair in enumerate(uni.rough):
        mode = motion.pairs[m]
        if mode == "stick":
            own = float(uni.multiplier(page, pair.tangent))
            unit = motion.system.length if uni.angular[pair.tangent] else 1.0
            law = JointFriction(motion.system, motion.work, pair.pair)
            x, y = uni.pressing_pair(page, pair)
            if abs(own) > law.size(x, y, float(np.sign(own)))[0] + force * unit:
                found[count + m] = _mode(own)
        elif not now.resting[m] and not ahead(pair.tangent, SENSES[mode]):
            found[count + m] = "stick"
    motion.shared = shared_friction(motion)
    if motion.shared is not None and found:
        open_ones = motion.shared.members | motion.shared.pressing
        motion.load()
        if (
            found.keys() & open_ones
            and motion.shared.reserve(motion, page, motion.work).least >= -force
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
    """Which rows do not depend on others: of touches (touches, 2), normal and tangent, those that
    press first, then of rough joints that stick, last of touches without force. Sets the groups of
    touches that stick by one row.
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
        if part <= DEPENDENT:
            return False
        kept.append(left / part)
        return True

    def along_one_row(one: int, other: int) -> bool:
        """Whether two touches of the same bodies slide together, as corners on one edge do."""
        first, second = (rows.block[uni.touches[k].tangent] * scale for k in (one, other))
        both = float(np.linalg.norm(first)) * float(np.linalg.norm(second))
        same = abs(float(first @ second)) >= (1.0 - DEPENDENT) * both
        return same and set(uni.bodies[one]) == set(uni.bodies[other])

    for row in dense(system, motion.work)[1]:
        independent(row)
    on = np.zeros((len(uni.touches), 2), dtype=bool)
    held = np.zeros(len(uni.rough), dtype=bool)
    motion.groups = {}
    closed = sorted((k for k in now.closed if modes[k] != "open"), key=lambda k: -pressing[k])
    least = NO_FORCE * max(pressing.values(), default=0.0)
    for k in closed:
        if pressing[k] > least:
            on[k, 0] = independent(rows.block[uni.touches[k].normal] * scale)
    for k in sorted(closed):
        if modes[k] != "stick" or not on[k, 0]:
            continue
        if independent(rows.block[uni.touches[k].tangent] * scale):
            on[k, 1] = True
            motion.groups[k] = [k]
        else:
            leader = next((one for one in motion.groups if along_one_row(one, k)), None)
            if leader is not None:
                motion.groups[leader].append(k)
    for m, mode in enumerate(pairs):
        if mode == "stick":
            held[m] = independent(rows.block[uni.rough[m].tangent] * scale)
    for k in closed:
        if pressing[k] <= least:
            on[k, 0] = independent(rows.block[uni.touches[k].normal] * scale)
    return on, held
