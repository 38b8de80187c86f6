"""Formulas that are compiled when a mechanism is closed, for they may measure all that it has."""

from __future__ import annotations

from mbody.errors import ModelError
from mbody.model.state_quantities import Described, measured_names
from mbody.model.states import State
from mbody.model.stop import Stop
from mbody.quantities import Formula, FormulaError

__all__ = ["compiled_state", "compiled_stop"]


def compiled_state(machine: Described, state: State) -> tuple[State, dict[str, Formula]]:
    """An own state with its rate as a law, and what the numbers of that were made of.

    Raises
    ------
    ModelError
        For a rate that measures what is not there, or whose units do not fit.
    """
    names = state.rate.names if isinstance(state.rate, Formula) else frozenset[str]()
    try:
        quantities = measured_names(machine, names)
    except FormulaError as error:
        raise ModelError(f"'{state.name}': rate: {error}", state.name) from None
    return state.compiled(machine.parameters.scope(), quantities)


def compiled_stop(machine: Described, stop: Stop) -> tuple[Stop, dict[str, Formula]]:
    """A stop with its formula as a law, and what the numbers of that were made of.

    Raises
    ------
    ModelError
        For a formula that measures what is not there, or what is no coordinate.
    """
    try:
        quantities = measured_names(machine, stop.names(machine.measures))
    except FormulaError as error:
        raise ModelError(f"stop '{stop.name}': {error}", stop.name) from None
    return stop.compiled(machine.parameters.scope(), machine.measures, quantities)
