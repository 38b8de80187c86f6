"""The modes that a motion goes on with where it was interrupted: kept, checked and set again."""

from __future__ import annotations

import math

import numpy as np

from mbody.analysis.contact.unilateral import SENSES, Unilateral
from mbody.analysis.dynamics.located import Guard
from mbody.analysis.dynamics.shared_friction import SharedFriction
from mbody.kernels.layout import Work
from mbody.solution.restart import ModalState
from mbody.system.system import System

__all__ = ["fresh_guards", "set_switched", "shared_of", "unfit_modes"]

#: Words for modes; and of guards that may begin at zero.
WORDS = ("open", "idle", "stick", *SENSES)
GUARDS = ("close", "lock", "open", "edge", "enter", "slip", "share", "stop", "paradox")


def set_switched(uni: Unilateral, work: Work, found: ModalState) -> np.ndarray:
    """Set rows, anchors, phases and senses of a workspace; returns which rows are on."""
    on, senses = np.array(found.on), np.zeros(len(uni.layout.friction_kind))
    pairs = [one.pair for one in uni.touches] + [one.pair for one in uni.rough]
    for pair, mode in zip(pairs, (*found.modes, *found.pairs), strict=True):
        if mode in SENSES and pair >= 0:
            senses[pair] = SENSES[mode]
    work.anchor[: len(on), 0] = found.anchor
    for row, phase in zip(uni.phase_rows, found.phases, strict=True):
        work.par[row, 0] = phase
    uni.set_rows(work, on, senses)
    return on


def shared_of(found: ModalState) -> SharedFriction | None:
    """What sticks with forces that no equation decides."""
    if not found.shared:
        return None
    normals, sticking, joints, members, pressing = found.shared
    return SharedFriction(normals, sticking, joints, frozenset(members), frozenset(pressing))


def fresh_guards(found: ModalState) -> dict[Guard, float]:
    """Guards that begin at zero, with what is rounding of theirs."""
    return {Guard(kind, number): least for kind, number, least in found.fresh}


def unfit_modes(system: System, found: ModalState) -> str | None:
    """What is wrong with modes that are said to be of a system; None where nothing is."""
    uni = Unilateral(system)
    touches, every = len(uni.touches), len(uni.touches) + len(uni.rough)
    sizes = {
        "modes": touches,
        "pairs": len(uni.rough),
        "on": len(uni),
        "anchor": len(uni),
        "phases": len(uni.phase_rows),
        "page": system.page_rows,
        "lost": len(system.mechanism.contacts),
    }
    for name, size in sizes.items():
        if len(getattr(found, name)) != size:
            return f"'{name}' has not {size} parts"
    words = all(one in WORDS for one in (*found.modes, *found.pairs))
    kinds = all(kind in GUARDS for kind, _, _ in found.fresh)
    if not words or not kinds:
        return "it has modes that there are not"
    numbers = [*found.on, *found.anchor, *found.phases, *found.page, *found.lost]
    numbers += [least for *_, least in found.fresh] + [when for _, when in found.struck]
    if not all(math.isfinite(one) for one in numbers):
        return "its modes have what is no finite number"
    if found.shared and len(found.shared) != 5:
        return "'shared' has not five parts"
    named = [*found.closed, *found.beyond, *(one for one, _ in found.struck)]
    named += [one for part in (*found.groups, *found.shared) for one in part]
    named += [one for _, one, _ in found.fresh]
    if not all(0 <= one < max(every, 1) for one in named):
        return "its modes name what is not there"
    return None
