"""Checks of what users give to functions, each with the one form of its sentence."""

from __future__ import annotations

import operator
from typing import Any

from mbody.errors import ModelError, brief


def whole_number(name: str, value: Any, least: int = 1, most: int | None = None) -> int:
    """A whole number within bounds.

    >>> whole_number("turns", 2, 1, 1000)
    2
    >>> whole_number("sweep: threads", 0)
    Traceback (most recent call last):
    mbody.errors.ModelError: sweep: threads must be a whole number from 1 on, not 0
    """
    try:
        number = least - 1 if isinstance(value, bool) else operator.index(value)
    except TypeError:
        number = least - 1
    if number < least or (most is not None and number > most):
        span = f"{least} on" if most is None else f"{least} to {most}"
        raise ModelError(f"{name} must be a whole number from {span}, not {brief(value)}")
    return number


def takes_one_design(verb: str, batch: int | None) -> None:
    """Refuse a system of several designs. `batch`: Their number, None of a single one.

    >>> takes_one_design("simulate", None)
    """
    if batch is not None:
        raise ModelError(f"{verb} takes one design: choose one of the batch with design(n)")
