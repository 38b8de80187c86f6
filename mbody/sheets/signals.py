"""The tables of inputs and of own states on a sheet."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from mbody.model.own_equations import OwnState
from mbody.quantities.units import DIMENSIONS
from mbody.sheets.text_table import Column, number, table
from mbody.solution.own_histories import own_history, shown_states

if TYPE_CHECKING:
    from mbody.solution.solution import Solution

__all__ = ["signals"]


def signals(solution: Solution) -> list[list[str]]:
    """Two tables: inputs, and own states with the formulas of their rates; of many instants the
    least and the greatest, empty where there are none.
    """
    machine = solution.mechanism
    states = shown_states(machine)
    rates = [_rate(one) for one in states]
    return [
        _table(solution, "INPUTS", machine.inputs, []),
        _table(solution, "STATES", states, [Column("rate", rates, text=True)]),
    ]


def _rate(state: Any) -> str:
    """The formula of a rate, as it was written; none of a state that an element brings."""
    if isinstance(state, OwnState):
        return ""
    return str(getattr(state.rate, "text", state.rate))


def _table(solution: Solution, title: str, own: Any, more: list[Column]) -> list[str]:
    """The table of some elements."""
    if not own or solution.record.batch:
        return []
    least, greatest, units = [], [], []
    for one in own:
        values, unit = own_history(solution, one.name), ""
        if one.dimension == DIMENSIONS["angle"]:
            values, unit = np.degrees(values), "deg"
        elif one.dimension is not None:
            unit = solution.mechanism.units.of(one.dimension)
        least.append(number(np.fmin.reduce(values)))
        greatest.append(number(np.fmax.reduce(values)))
        units.append(unit)
    columns = [
        Column(title, [one.name for one in own], text=True),
        Column("least", least),
        Column("greatest", greatest),
        Column("unit", units, text=True),
        *more,
    ]
    if len(solution) == 1:
        columns[1:3] = [Column("value", least)]
    return table(columns)
