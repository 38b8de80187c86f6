"""Inputs of one motion: histories that `simulate` is given in the place of the described values."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from mbody.errors import ModelError, brief
from mbody.laws import Table
from mbody.model.closed_mechanism import with_element
from mbody.model.element import listed
from mbody.model.evaluation import resolved
from mbody.model.inputs import Input
from mbody.model.mechanism import Mechanism
from mbody.quantities import dimension_text
from mbody.system.assembler import assemble
from mbody.system.other_numbers import with_numbers_of
from mbody.system.system import System

__all__ = ["with_inputs"]


def with_inputs(system: System, inputs: Any, first: float, until: float) -> System:
    """The system whose inputs follow other histories.

    Parameters
    ----------
    system : System
        One design.
    inputs : mapping
        By name a number or text, a law of time, a function of time; a pair (t, u) of rows, joined
        by straight lines; or one row, spread evenly over the motion.
    first, until : float
        The times between which the motion goes on.

    Raises
    ------
    ModelError
        For an input that is not there, what is no history, and units that do not fit.
    """
    if not isinstance(inputs, Mapping):
        raise ModelError(f'inputs must be a table such as {{"u": 2.0}}, not {brief(inputs)}')
    machine = system.mechanism
    known = {one.name: one for one in machine.inputs}
    for name, given in inputs.items():
        if name not in known:
            raise ModelError(
                f"there is no input {brief(name)} (there are: {listed(known)})", str(name)
            )
        setters = [one.name for one in machine.controllers if name in one.sets]
        if setters:
            raise ModelError(
                f"input '{name}' is set by the controller '{setters[0]}': leave it out", name
            )
        machine = with_element(machine, _followed(machine, known[name], given, first, until))
    if machine is system.mechanism:
        return system
    own = {f"{name}." for name in inputs}
    kept = {k: v for k, v in system.values.items() if not k.startswith(tuple(own))}
    return with_numbers_of(assemble(machine), kept)


def _followed(machine: Mechanism, declared: Input, given: Any, first: float, until: float) -> Input:
    """The input with that history."""
    name = declared.name
    if isinstance(given, tuple) and len(given) == 2:
        given = _table(name, *given)
    elif isinstance(given, list | np.ndarray):
        row = np.asarray(given, dtype=object)
        if row.ndim != 1 or row.size < 2:
            raise ModelError(
                f"input '{name}': a history is a row of at least two numbers, spread over the "
                f"motion, or a pair (t, u) of rows, not of shape {row.shape}",
                name,
            )
        given = _table(name, np.linspace(first, until, row.size), given)
    scope = machine.parameters.scope()
    new = Input(name, given).measured(scope)
    if None not in (new.dimension, declared.dimension) and new.dimension != declared.dimension:
        assert new.dimension is not None and declared.dimension is not None
        raise ModelError(
            f"input '{name}' is {dimension_text(declared.dimension)}, the history is "
            f"{dimension_text(new.dimension)}: give it in a unit of the former",
            name,
        )
    made, _, _ = resolved(Input(name, new.value, declared.dimension), scope, lambda names: {})
    return made


def _table(name: str, t: Any, u: Any) -> Table:
    """A history by points, joined by straight lines; its ends last."""
    try:
        return Table(t, u, interpolation="linear", outside="hold")
    except ModelError as error:
        raise ModelError(f"input '{name}': {str(error).removeprefix('Table: ')}", name) from None
