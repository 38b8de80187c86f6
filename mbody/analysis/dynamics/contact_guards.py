"""What is positive as long as the modes of contacts and rough joints hold, and its values."""

from __future__ import annotations

import numpy as np

from mbody.analysis.contact.joint_friction import JointFriction
from mbody.analysis.contact.unilateral import SENSES
from mbody.analysis.dynamics.contact_decision import STILL
from mbody.analysis.dynamics.friction_model import force_size
from mbody.analysis.dynamics.located import Guard
from mbody.analysis.dynamics.modal_motion import ModalMotion
from mbody.kernels.friction import DETERMINANT
from mbody.kernels.friction_laws import FRICTION_KINDS

__all__ = ["guard_sizes", "guard_values", "guards_of"]

Array = np.ndarray

#: Guards that follow from positions and rates.
PLACES = ("close", "lock", "edge", "enter", "stop")
#: Guards that follow from where a touch is along its edge.
ALONG = ("edge", "enter")
#: Edges of which one is this near to the line of the other, in model lengths, lie on one line.
FLUSH = 1e-14


def guards_of(motion: ModalMotion) -> list[Guard]:
    """What is to be watched in the present modes."""
    found, touches = list[Guard](), motion.uni.touches
    shared = motion.shared.members if motion.shared is not None else frozenset[int]()
    pressing = motion.shared.pressing if motion.shared is not None else frozenset[int]()
    followers = {n for group in motion.groups.values() for n in group[1:]}
    for n, (touch, mode) in enumerate(zip(touches, motion.modes, strict=True)):
        if mode == "open":
            kind = "lock" if motion.uni.one_way[n] else "enter" if n in motion.beyond else "close"
            found.append(Guard(kind, n))
            continue
        if touch.spot.ends:
            found.append(Guard("edge", n))
        if mode == "idle":
            continue
        if n not in pressing:
            found.append(Guard("open", n))
        if touch.static == 0.0:
            continue
        if mode == "stick":
            if n not in followers and n not in shared:
                found.append(Guard("slip", n))
        elif mode in SENSES:
            found.append(Guard("stop", n))
    for m, mode in enumerate(motion.pairs, start=len(touches)):
        if mode in SENSES or m not in shared:
            found.append(Guard("stop" if mode in SENSES else "slip", m))
    if shared or pressing:
        found.append(Guard("share", min(shared | pressing)))
    if motion.work.sense[: len(motion.layout.friction_kind), 0].any():
        found.append(Guard("paradox"))
    return found


def guard_values(motion: ModalMotion, t: Array, pages: Array, guards: list[Guard]) -> Array:
    """Values (guards, instants) by times and pages (instants, rows, 1)."""
    found, flat = np.empty((len(guards), len(pages))), pages[:, :, 0]
    by_position, one_by_one = list[int](), list[int]()
    for k, guard in enumerate(guards):
        if _follows_from_pages(motion, guard):
            found[k] = _by_pages(motion, flat, guard)
        elif guard.kind in PLACES:
            by_position.append(k)
        else:
            one_by_one.append(k)
    if by_position:
        chosen = [guards[k] for k in by_position]
        new = np.ones(len(flat), dtype=bool)
        if not motion.system.drivers:
            # while nothing moves what follows from the position alone is as it was
            places = flat[:, : 2 * motion.system.coordinates]
            new[1:] = (places[1:] != places[:-1]).any(axis=1)
        values = _by_positions(motion, t[new], flat[new], chosen)
        found[by_position] = values[:, np.cumsum(new) - 1]
    for m, page in enumerate(flat if one_by_one else ()):
        motion.uni.read_at(motion.probe, t[m : m + 1], page[None])
        for k in one_by_one:
            if guards[k].kind == "slip":
                found[k, m] = _reserve(motion, page, guards[k].number)
            elif motion.shared is not None:
                found[k, m] = motion.shared.reserve(motion, page, motion.probe).least
    return found


def _by_positions(motion: ModalMotion, t: Array, pages: Array, guards: list[Guard]) -> Array:
    """Values (guards, instants) of what follows from positions and rates: times, pages (instants,
    rows).
    """
    n, uni, probe = motion.system.coordinates, motion.uni, motion.probe
    found, kinds = np.empty((len(guards), len(t))), {guard.kind for guard in guards}
    flush, slow = FLUSH * motion.system.length, STILL * motion.speed
    if not kinds <= set(ALONG):
        rows = uni.read_at(probe, t, pages)
        gaps, approaches = uni.gaps(rows), uni.approach(rows)
    if not kinds.isdisjoint(("close", *ALONG)):
        q = np.tile(probe.q[:, 0], (len(t), 1))
        q[:, :n] = pages[:, :n]
        along = uni.along_at(q).min(axis=-1, initial=np.inf)
    for k, (kind, number) in enumerate((guard.kind, guard.number) for guard in guards):
        if kind == "close":
            gap, way = gaps[:, number], along[:, number]
            # past its ends it is as far from there as it is from them
            found[k] = np.maximum(gap, -way - motion.near)
            if guards[k] not in motion.fresh:
                # what leaves its edge does so first
                on_one_line = (np.abs(gap) <= flush) & (np.abs(approaches[:, number]) <= slow)
                found[k, on_one_line] = np.maximum(motion.near - way, -flush)[on_one_line]
        elif kind == "lock":
            found[k] = approaches[:, number]
        elif kind in ALONG:
            found[k] = along[:, number] if kind == "edge" else -along[:, number]
        else:
            tangent, sense = _sliding_row(motion, number)
            found[k] = sense * rows.rate[:, tangent]
    return found


def _follows_from_pages(motion: ModalMotion, guard: Guard) -> bool:
    """Whether the value needs nothing but what is kept of an instant."""
    if guard.kind != "slip" or guard.number < len(motion.uni.touches):
        return guard.kind in ("open", "slip", "paradox")
    f = motion.uni.rough[guard.number - len(motion.uni.touches)].pair
    kind = FRICTION_KINDS[int(motion.layout.friction_kind[f])]
    return kind not in ("torque", "force", "follower")


def _by_pages(motion: ModalMotion, pages: Array, guard: Guard) -> Array:
    """Values by pages (instants, rows)."""
    if guard.kind == "paradox":
        return np.asarray(pages[:, motion.system.friction_rows.start + DETERMINANT])
    if guard.kind == "open":
        return np.asarray(motion.uni.pressing(pages, motion.uni.touches[guard.number]))
    return np.asarray(_reserve(motion, pages, guard.number))


def _sliding_row(motion: ModalMotion, number: int) -> tuple[int, float]:
    """The tangent row of what slides, and its sense."""
    touches = motion.uni.touches
    if number < len(touches):
        return touches[number].tangent, SENSES[motion.modes[number]]
    m = number - len(touches)
    return motion.uni.rough[m].tangent, SENSES[motion.pairs[m]]


def _reserve(motion: ModalMotion, pages: Array, number: int) -> Array:
    """How much more friction what sticks could have, by pages (…, rows)."""
    uni, touches = motion.uni, motion.uni.touches
    if number >= len(touches):
        pair = uni.rough[number - len(touches)]
        force = uni.multiplier(pages, pair.tangent)
        law = JointFriction(motion.system, motion.probe, pair.pair)
        x, y = uni.pressing_pair(pages, pair)
        # limits differ with the sense, as of band brakes: the nearer one, without a jump at zero
        ahead, back = law.size(x, y, 1.0)[0] - force, law.size(x, y, -1.0)[0] + force
        return np.asarray(np.minimum(ahead, back))
    group = motion.groups.get(number, [number])
    most = np.sum([touches[k].static * uni.pressing(pages, touches[k]) for k in group], axis=0)
    return np.asarray(most - np.abs(uni.multiplier(pages, touches[number].tangent)))


def guard_sizes(motion: ModalMotion) -> list[float]:
    """What the values of the guards are compared with."""
    force = force_size(motion)
    lengths = dict.fromkeys(("close", "edge", "enter"), motion.system.length)
    kinds = {**lengths, "stop": motion.speed, "lock": motion.speed, "paradox": 1.0}
    return [kinds.get(guard.kind, force) for guard in motion.guards]
