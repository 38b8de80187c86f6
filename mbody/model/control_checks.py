"""Checks of what formulas name: inputs and states, and of what controllers set."""

from __future__ import annotations

from collections.abc import Container, Sequence

from mbody.errors import ModelError, brief
from mbody.model.controller import Controller
from mbody.model.element import Element, listed
from mbody.model.inputs import Input
from mbody.quantities import FUNCTIONS, VARIABLES

__all__ = ["check_formula_name", "check_sets"]


def check_formula_name(element: Element, parameters: Container[str]) -> None:
    """Refuse a name that formulas have for something else.

    Raises
    ------
    ModelError
    """
    name, what = element.name, ""
    if name in parameters:
        what = "a parameter"
    elif name in (*FUNCTIONS, *VARIABLES, "pi"):
        what = "a function, a variable or pi"
    if what:
        raise ModelError(
            f"'{name}' is the name of {what} in formulas: choose another name for the "
            f"{element.role}",
            name,
        )


def check_sets(
    controller: Controller, inputs: Sequence[Input], others: Sequence[Controller]
) -> None:
    """Refuse a controller of inputs that are not there, or that another one sets.

    Raises
    ------
    ModelError
    """
    known = [one.name for one in inputs]
    taken = {name: one.name for one in others for name in one.sets}
    for name in controller.sets:
        if name not in known:
            raise ModelError(
                f"'{controller.name}' sets {brief(name)}, which is no input (there are: "
                f"{listed(known)}): add Input(...) before it",
                controller.name,
            )
        if name in taken:
            raise ModelError(
                f"'{controller.name}' sets '{name}', which '{taken[name]}' sets already: give "
                "each controller inputs of its own, and add them in a formula",
                controller.name,
            )
