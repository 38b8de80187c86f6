"""The machine code of one topology alone, for systems that were assembled with it."""

from __future__ import annotations

import weakref
from collections.abc import Hashable

import numpy as np

from mbody.kernels.layout import Work
from mbody.straight_line.lane_instants import LaneInstants
from mbody.straight_line.programs import StraightLineCode, straight_line_code
from mbody.system.pivoting import PivotChoices
from mbody.system.system import System

__all__ = ["follow_by_own_code"]

#: By system and kind of analysis the code and its first numbers; code is not sent elsewhere.
_codes: weakref.WeakKeyDictionary[
    System, dict[Hashable, tuple[StraightLineCode, np.ndarray] | None]
] = weakref.WeakKeyDictionary()


def follow_by_own_code(
    system: System, pivots: PivotChoices, work: Work, instants: LaneInstants
) -> tuple[np.ndarray, np.ndarray] | None:
    """Follow all lanes, as `follow_lanes` does, by the code of the system: (steps, rows, lanes),
    and what is found of each lane, (FOUND, lanes); None where the system has no such code.
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
    return code.follow_motion(work, instants, system.page_rows, initial)
