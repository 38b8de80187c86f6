"""How closed contacts and rough joints go on: sticking, sliding or open.

The modes of the contacts follow from the complementarity of accelerations, those of rough joints
that are at rest from a search among their modes that begins with what was, all with the
accelerations and forces of the kernels: what sticks has less friction than it could, what begins to
slide does so in the sense of its acceleration. That is the step of a semismooth Newton method on
τ = proj(τ − r α), the projection onto |τ| ≤ φ(λ); where it cycles all 3ᵐ modes are tried.

Pfeiffer, Glocker (1996), 6; Facchinei, Pang: Finite-Dimensional Variational Inequalities (2003), 7.
"""

from __future__ import annotations

import itertools

import numpy as np

from mbody.analysis.contact.contact_laws import ClosedContacts, decide_modes
from mbody.analysis.contact.unilateral import SENSES, Rows
from mbody.analysis.dynamics.contact_impacts import responses_to, touch_rows
from mbody.analysis.dynamics.modal_motion import ModalMotion
from mbody.system.rank import dense, rank_of

__all__ = ["STILL", "by_enumeration", "decide", "near_touches"]

Array = np.ndarray

#: Slower than this, as a part of the swiftest motion, does not move.
STILL = 1e-11
#: Modes of so many rough joints at rest are all tried.
MOST_JOINTS = 7
#: A reserve of friction, and an acceleration, below this part of their size is none.
ROUNDING = 1e-10
#: Rows that depend on others by less than this part are dependent.
DEPENDENT = 1e-9


def near_touches(motion: ModalMotion, rows: Rows) -> list[int]:
    """Touches whose gap is none, within the ends of their edges; rows of the present state."""
    uni, near = motion.uni, motion.near
    within = uni.within_edges(rows, motion.work, near, STILL * motion.speed)
    found = {int(n) for n in np.flatnonzero((np.abs(uni.gaps(rows)) <= near) & within)}
    return sorted((found | motion.closing.closed) - motion.closing.opened - motion.beyond)


def decide(motion: ModalMotion) -> str:
    """Set the modes that go on from the present state, with its derivative and page; returns the
    verdict: "", "indeterminate" or "inconsistent".
    """
    uni, closing = motion.uni, motion.closing
    q = motion.y.copy()
    count = len(uni.touches)
    motion.load()
    rows = uni.read(motion.work)
    slow = STILL * motion.speed
    pairs, undecided = list[str](), list[int]()
    for m, pair in enumerate(uni.rough):
        rate = rows.rate[pair.tangent]
        # rates of pins are angular
        unit = motion.system.length if uni.angular[pair.tangent] else 1.0
        if count + m in closing.sliding:
            pairs.append(_slip(closing.sliding[count + m]))
            undecided.append(m)
        elif count + m in closing.stopped or abs(rate) * unit <= slow:
            pairs.append("stick")
            undecided.append(m)
        else:
            pairs.append(_slip(rate))
    for m, sense in _led(motion, undecided, pairs).items():
        pairs[m] = _slip(sense)
        undecided.remove(m)
    tried: set[tuple[str, ...]] = set()
    while tuple(pairs) not in tried:
        tried.add(tuple(pairs))
        verdict = _with_pairs(motion, q, pairs)
        if verdict == "inconsistent":
            return verdict
        wrong = _wrong(motion, undecided)
        if not wrong:
            return verdict
        for m, mode in wrong.items():
            pairs[m] = mode
    return by_enumeration(motion, q, pairs, undecided)


def _led(motion: ModalMotion, undecided: list[int], pairs: list[str]) -> dict[int, float]:
    """Senses in which rough joints at rest go on that drivers lead: their accelerations do not
    depend on friction. A row that keeps one at rest would contradict those of the drivers.
    """
    uni, system, n = motion.uni, motion.system, motion.system.coordinates
    if not (system.drivers and undecided):
        return {}
    free = rank_of(dense(system, motion.work)[1]).motions
    moving = ["slip+" if m in undecided else mode for m, mode in enumerate(pairs)]
    touches = len(uni.touches)
    motion.set_modes(["open"] * touches, moving, np.zeros((touches, 2), dtype=bool))
    motion.evaluate()
    motion.load()
    rows, a = uni.read(motion.work), motion.K[0, n : 2 * n]
    found = {}
    for m in undecided:
        tangent = uni.rough[m].tangent
        row = rows.block[tangent] * system.coordinate_units
        if np.linalg.norm(free @ row) > DEPENDENT * np.linalg.norm(row):
            continue
        ahead, size = _acceleration(rows, tangent, a)
        if abs(ahead) > ROUNDING * size:
            found[m] = ahead
    return found


def _acceleration(rows: Rows, tangent: int, a: Array) -> tuple[float, float]:
    """The acceleration of sliding along a row, and the size of its parts."""
    row, gamma = rows.block[tangent], float(rows.gamma[tangent])
    return float(row @ a) - gamma, float(np.abs(row * a).max()) + abs(gamma)


def by_enumeration(motion: ModalMotion, y: Array, pairs: list[str], undecided: list[int]) -> str:
    """All modes of the rough joints at rest, where the search has come back to where it was."""
    if len(undecided) > MOST_JOINTS:
        return "inconsistent"
    found = []
    for modes in itertools.product(("stick", "slip+", "slip-"), repeat=len(undecided)):
        trial = list(pairs)
        for m, mode in zip(undecided, modes, strict=True):
            trial[m] = mode
        if _with_pairs(motion, y, trial) != "inconsistent" and not _wrong(motion, undecided):
            found.append((trial, motion.K[0].copy()))
    if not found:
        return "inconsistent"
    verdict = _with_pairs(motion, y, found[0][0])
    size = max(float(np.abs(found[0][1]).max()), 1e-300)
    several = any(np.abs(one[1] - found[0][1]).max() > 1e-7 * size for one in found)
    return "indeterminate" if several else verdict


def _wrong(motion: ModalMotion, undecided: list[int]) -> dict[int, str]:
    """Rough joints whose mode is not consistent with forces and accelerations, and a better one."""
    uni, n = motion.uni, motion.system.coordinates
    page, a = motion.page[:, 0], motion.K[0, n : 2 * n]
    motion.load()
    rows = uni.read(motion.work)
    found: dict[int, str] = {}
    for m in undecided:
        pair, mode = uni.rough[m], motion.pairs[m]
        force = float(uni.multiplier(page, pair.tangent))
        if mode == "stick":
            most = float(uni.limit(page, pair, motion.work))
            if abs(force) > most * (1.0 + ROUNDING):
                found[m] = _slip(force)
            continue
        ahead, size = _acceleration(rows, pair.tangent, a)
        if SENSES[mode] * ahead < -ROUNDING * size:
            found[m] = "stick"
    return found


def _slip(sense: float) -> str:
    return "slip+" if sense > 0.0 else "slip-"


def _with_pairs(motion: ModalMotion, y: Array, pairs: list[str]) -> str:
    """Modes of the contacts for given modes of the rough joints, all set and evaluated."""
    uni, closing, n = motion.uni, motion.closing, motion.system.coordinates
    motion.y[:] = y
    motion.set_modes(["open"] * len(uni.touches), pairs, np.zeros(len(uni.touches), dtype=bool))
    motion.evaluate()
    motion.load()
    rows = uni.read(motion.work)
    closed = near_touches(motion, rows)
    slow = STILL * motion.speed
    approach = uni.approach(rows)
    closed = [k for k in closed if abs(approach[k]) <= slow or k in closing.closed]
    if not closed:
        return ""
    held = [
        rows.block[p.tangent] for p, mode in zip(uni.rough, pairs, strict=True) if mode == "stick"
    ]
    W, rates = touch_rows(uni, rows, closed)
    Y = responses_to(uni, motion.work, W, np.array(held).reshape(-1, n))
    m, a = len(closed), motion.K[0, n : 2 * n]
    touches = [uni.touches[k] for k in closed]
    gamma = np.array(
        [t.spot.sense * rows.gamma[t.normal] for t in touches]
        + [rows.gamma[t.tangent] if t.tangent >= 0 else 0.0 for t in touches]
    )
    free = W @ a - gamma
    sliding = np.where(np.abs(rates[m:]) <= slow, 0.0, np.sign(rates[m:]))
    for k, number in enumerate(closed):
        sliding[k] = closing.sliding.get(number, sliding[k])
        if number in closing.stopped:
            sliding[k] = 0.0
    friction = np.array(
        [t.friction if s else t.static for t, s in zip(touches, sliding, strict=True)]
    )
    smooth = friction == 0.0
    senses = np.where(smooth & (sliding == 0.0), 1.0, sliding)
    found = decide_modes(ClosedContacts(W @ Y, friction, senses), free[:m], free[m:])
    if found.verdict == "inconsistent":
        return found.verdict
    modes = ["open"] * len(uni.touches)
    for k, number in enumerate(closed):
        modes[number] = found.modes[k]
    on = _independent(motion, W, closed, found.modes, found.pressing, held)
    motion.y[:] = y
    motion.set_modes(modes, pairs, on)
    motion.evaluate()
    return found.verdict


def _independent(
    motion: ModalMotion,
    W: Array,
    closed: list[int],
    modes: tuple[str, ...],
    pressing: Array,
    held: list[Array],
) -> Array:
    """Which touches have rows that do not depend on others: (touches, 2), normal and tangent; those
    that press first. Sets the groups of touches that stick by one row, and what is idle.
    """
    system, m = motion.system, len(closed)
    scale = system.coordinate_units
    base = [*dense(system, motion.work)[1], *(row * scale for row in held)]
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

    for row in base:
        independent(row)
    on = np.zeros((len(motion.uni.touches), 2), dtype=bool)
    motion.groups = {}
    for k in sorted(range(m), key=lambda k: -pressing[k]):
        if modes[k] != "open":
            on[closed[k], 0] = independent(W[k] * scale)
    for k in range(m):
        if modes[k] != "stick" or not on[closed[k], 0]:
            continue
        number = closed[k]
        if independent(W[m + k] * scale):
            on[number, 1] = True
            motion.groups[number] = [number]
        else:
            pair = set(motion.uni.bodies[number])
            leader = next(
                (one for one in motion.groups if set(motion.uni.bodies[one]) == pair), None
            )
            if leader is not None:
                motion.groups[leader].append(number)
    return on
