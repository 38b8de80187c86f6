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
from mbody.kernels.loop_closure import laws_of_time

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
    n, uni, probe = motion.system.coordinates, motion.uni, motion.probe
    found = np.empty((len(guards), len(pages)))
    flush, slow = FLUSH * motion.system.length, STILL * motion.speed
    by_position = list[int]()
    for k, guard in enumerate(guards):
        if _follows_from_pages(motion, guard):
            found[k] = _by_pages(motion, pages[:, :, 0], guard)
        else:
            by_position.append(k)
    kinds = {guards[k].kind for k in by_position}
    with_rows, with_edges = not kinds <= set(ALONG), not kinds.isdisjoint(("close", *ALONG))
    # while nothing moves what follows from the position alone is as it was
    still = not motion.system.drivers and kinds <= set(PLACES)
    for m, page in enumerate(pages[:, :, 0] if by_position else ()):
        if still and m > 0 and (page[: 2 * n] == pages[m - 1, : 2 * n, 0]).all():
            found[by_position, m] = found[by_position, m - 1]
            continue
        probe.q[:n, 0], probe.v[:n, 0] = page[:n], page[n : 2 * n]
        probe.time[0, 0] = t[m]
        laws_of_time(motion.layout, probe)
        if with_rows:
            rows = uni.read(probe)
            gaps, approach = uni.gaps(rows), uni.approach(rows)
        if with_edges:
            along = uni.along(probe).min(axis=1, initial=np.inf)
        for k in by_position:
            kind, number = guards[k].kind, guards[k].number
            if kind == "close":
                # past its ends it is as far from there as it is from them
                found[k, m] = max(gaps[number], -along[number] - motion.near)
                on_one_line = abs(gaps[number]) <= flush and abs(approach[number]) <= slow
                if on_one_line and guards[k] not in motion.fresh:
                    # what leaves its edge does so first
                    found[k, m] = max(motion.near - along[number], -flush)
            elif kind == "lock":
                found[k, m] = approach[number]
            elif kind in ("edge", "enter"):
                found[k, m] = along[number] if kind == "edge" else -along[number]
            elif kind == "stop":
                tangent, sense = _sliding_row(motion, number)
                found[k, m] = sense * rows.rate[tangent]
            elif kind == "slip":
                found[k, m] = _reserve(motion, page, number)
            elif motion.shared is not None:
                found[k, m] = motion.shared.reserve(motion, page, probe).least
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
