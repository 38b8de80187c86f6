"""The machine code of one topology alone, for systems that were assembled with it."""

from __future__ import annotations

import weakref
from collections.abc import Hashable

import numpy as np

from mbody.kernels.layout import Work
from mbody.straight_line.lane_instants import LaneInstants
from mbody.straight_line.programs import MotionCall, StraightLineCode, straight_line_code
from mbody.system.pivoting import PivotChoices
from mbody.system.system import System

__all__ = ["own_motion_call"]

#: By system and kind of analysis the code and its first numbers; code is not sent elsewhere.
_codes: weakref.WeakKeyDictionary[
    System, dict[Hashable, tuple[StraightLineCode, np.ndarray] | None]
] = weakref.WeakKeyDictionary()


def own_motion_call(
    system: System, pivots: PivotChoices, work: Work, instants: LaneInstants, *, joined: bool
) -> MotionCall | None:
    """The call of the system's code that follows all lanes, as `follow_lanes` does, from the
    positions in `work`; None where the system has no such code. Where lanes are pieces of one
    motion, they are `joined`.
    """
    # own states of designs differ between lanes, and the code has one first number for all
    if not system.machine_code or (system.batch is not None and system.layout.owns):
        return None
    codes = _codes.setdefault(system, {})
    kind = instants.mode, instants.with_forces, instants.at_rest
    if kind not in codes:
        code = straight_line_code(system.layout, pivots, instants.path, work, pieces=True)
        codes[kind] = None if code is None else (code, code.first_numbers(work))
    found = codes[kind]
    if found is None:
        return None
    code, initial = found
    return MotionCall(code, work, instants, system.page_rows, initial, joined=joined)
