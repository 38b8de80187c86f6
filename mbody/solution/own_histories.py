"""Histories of inputs and of own states, and the rows of a result that kernels take again."""

from __future__ import annotations

from typing import Any

import numpy as np

from mbody.model.mechanism import Mechanism
from mbody.solution.result import Result

__all__ = ["motion_rows", "own_history", "shown_states"]

Array = np.ndarray


def shown_states(mechanism: Mechanism) -> list[Any]:
    """The own states that tables and sheets have: not those that only add up energies, which are in
    the account of energy.
    """
    return [one for one in mechanism.states if not getattr(one, "accounts", False)]


def motion_rows(solution: Result) -> Array:
    """q, v, a, own states and inputs: (instants, 9·bodies + …), or (designs, …) of a batch."""
    system = solution.system
    motion, own = solution.record.table(slice(0, 3 * system.coordinates)), system.own_rows
    if own.start == own.stop:
        return motion
    return np.concatenate([motion, solution.record.table(own)], axis=-1)


def own_history(solution: Result, name: str) -> Array:
    """An own state or an input, by its name: (instants,), or (designs, instants) of a batch."""
    system = solution.system
    machine = system.mechanism
    names = [one.name for one in (*machine.states, *machine.inputs)]
    return solution.record.take(system.own_rows.start + names.index(name))
