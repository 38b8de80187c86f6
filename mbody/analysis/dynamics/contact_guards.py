"""What is positive as long as the modes of contacts and rough joints hold, and its values."""

from __future__ import annotations

import numpy as np

from mbody.analysis.contact.unilateral import SENSES
from mbody.analysis.dynamics.located import Guard
from mbody.analysis.dynamics.modal_motion import ModalMotion
from mbody.kernels.friction import DETERMINANT
from mbody.kernels.loop_closure import laws_of_time

__all__ = ["guard_sizes", "guard_values", "guards_of"]

Array = np.ndarray


def guards_of(motion: ModalMotion) -> list[Guard]:
    """What is to be watched in the present modes."""
    found, touches = list[Guard](), motion.uni.touches
    followers = {n for group in motion.groups.values() for n in group[1:]}
    for n, (touch, mode) in enumerate(zip(touches, motion.modes, strict=True)):
        if mode == "open":
            kind = "lock" if motion.uni.one_way[n] else "enter" if n in motion.beyond else "close"
            found.append(Guard(kind, n))
            continue
        if mode == "idle":
            continue
        found.append(Guard("open", n))
        edge = touch.spot.edge
        if edge is not None and np.isfinite(edge[2]):
            found.append(Guard("edge", n))
        if touch.static == 0.0:
            continue
        if mode == "stick" and n not in followers:
            found.append(Guard("slip", n))
        elif mode in SENSES:
            found.append(Guard("stop", n))
    for m, mode in enumerate(motion.pairs, start=len(touches)):
        found.append(Guard("stop" if mode in SENSES else "slip", m))
    if motion.work.sense[: len(motion.layout.friction_kind), 0].any():
        found.append(Guard("paradox"))
    return found


def guard_values(motion: ModalMotion, t: Array, pages: Array, guards: list[Guard]) -> Array:
    """Values (guards, instants) by times and pages (instants, rows, 1)."""
    n, uni, probe = motion.system.coordinates, motion.uni, motion.probe
    found = np.empty((len(guards), len(pages)))
    for m, page in enumerate(pages[:, :, 0]):
        probe.q[:n, 0], probe.v[:n, 0] = page[:n], page[n : 2 * n]
        probe.time[0, 0] = t[m]
        laws_of_time(motion.layout, probe)
        rows = uni.read(probe)
        gaps, approach, along = (
            uni.gaps(rows),
            uni.approach(rows),
            uni.along(probe).min(axis=1, initial=np.inf),
        )
        for k, guard in enumerate(guards):
            kind, number = guard.kind, guard.number
            if kind == "close":
                found[k, m] = gaps[number]
            elif kind == "lock":
                found[k, m] = approach[number]
            elif kind == "open":
                found[k, m] = uni.pressing(page, uni.touches[number])
            elif kind in ("edge", "enter"):
                found[k, m] = along[number] if kind == "edge" else -along[number]
            elif kind == "stop":
                tangent, sense = _sliding_row(motion, number)
                found[k, m] = sense * rows.rate[tangent]
            elif kind == "slip":
                found[k, m] = _reserve(motion, page, number)
            else:
                found[k, m] = page[motion.system.friction_rows.start + DETERMINANT]
    return found


def _sliding_row(motion: ModalMotion, number: int) -> tuple[int, float]:
    """The tangent row of what slides, and its sense."""
    touches = motion.uni.touches
    if number < len(touches):
        return touches[number].tangent, SENSES[motion.modes[number]]
    m = number - len(touches)
    return motion.uni.rough[m].tangent, SENSES[motion.pairs[m]]


def _reserve(motion: ModalMotion, page: Array, number: int) -> float:
    """How much more friction what sticks could have."""
    uni, touches = motion.uni, motion.uni.touches
    if number >= len(touches):
        pair = uni.rough[number - len(touches)]
        force = abs(uni.multiplier(page, pair.tangent))
        return uni.limit(page, pair, motion.probe) - float(force)
    group = motion.groups.get(number, [number])
    most = sum(touches[k].static * uni.pressing(page, touches[k]) for k in group)
    return float(most - abs(uni.multiplier(page, touches[number].tangent)))


def guard_sizes(motion: ModalMotion) -> list[float]:
    """What the values of the guards are compared with."""
    system, n = motion.system, motion.system.coordinates
    inertia = system.mass[:n, 0] * motion.K[0, n : 2 * n] / motion.scale[:n]
    forces = motion.page[3 * n : system.friction_rows.start]
    force = max(float(np.abs(part).max(initial=0.0)) for part in (inertia, forces))
    lengths = dict.fromkeys(("close", "edge", "enter"), system.length)
    kinds = {**lengths, "stop": motion.speed, "lock": motion.speed, "paradox": 1.0}
    return [kinds.get(guard.kind, force) for guard in motion.guards]
