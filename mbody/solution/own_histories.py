"""Histories of inputs and of own states, and the rows of a result that kernels take again."""

from __future__ import annotations

from typing import Any

import numpy as np

from mbody.model.mechanism import Mechanism
from mbody.solution.result import Result

__all__ = ["motion_at", "motion_rows", "own_history", "shown_states"]

Array = np.ndarray


def shown_states(mechanism: Mechanism) -> list[Any]:
    """The own states that tables and sheets have: not those that only add up energies, which are in
    the account of energy.
    """
    return [one for one in mechanism.states if not getattr(one, "accounts", False)]


def motion_rows(solution: Result) -> Array:
    """q, v, a, own states and inputs: (instants, 9·bodies + …), or (designs, …) of a batch."""
    parts = [solution.record.table(rows) for rows in _kept_rows(solution)]
    return np.concatenate(parts, axis=-1) if len(parts) > 1 else parts[0]


def motion_at(solution: Result, instants: Array, design: int = 0) -> Array:
    """The same of one design at some instants, by their numbers: (instants, 9·bodies + …)."""
    parts = [solution.record.at(rows, instants, design) for rows in _kept_rows(solution)]
    return np.concatenate(parts, axis=-1) if len(parts) > 1 else parts[0]


def _kept_rows(solution: Result) -> list[slice]:
    """Where q, v and a are kept, and own states and inputs, if there are any."""
    system = solution.system
    own = system.own_rows
    return [slice(0, 3 * system.coordinates), *([own] if own.start < own.stop else [])]


def own_history(solution: Result, name: str) -> Array:
    """An own state or an input, by its name: (instants,), or (designs, instants) of a batch."""
    system = solution.system
    machine = system.mechanism
    names = [one.name for one in (*machine.states, *machine.inputs)]
    return solution.record.take(system.own_rows.start + names.index(name))
