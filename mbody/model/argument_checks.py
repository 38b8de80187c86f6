"""Checks of what users give to functions, each with the one form of its sentence."""

from __future__ import annotations

import difflib
import operator
from collections.abc import Iterable
from typing import Any

from mbody.errors import ModelError, brief
from mbody.model.element import listed

#: Of more names than these a sentence names some.
MOST_NAMES = 8


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


def unknown_name(
    what: str, name: Any, known: Iterable[Any], *, use: str = "", more: str = ""
) -> ModelError:
    """The error of a name that a mechanism or a result does not have; of many names that it has,
    those that are spelled most like it come first.

    `known`: Names, or what has them.
    `use`: What it is wanted for, as " to draw".
    `more`: The end of the sentence.

    >>> str(unknown_name("driver", "moter", ["motor", "pump"]))
    "there is no driver 'moter' (there are: 'motor', 'pump')"
    >>> str(unknown_name("sweep: pin", "pin", [f"P{n}" for n in range(20)] + ["pins"]))[:59]
    "sweep: there is no pin 'pin' (there are: 'pins', 'P0', 'P1'"
    """
    verb, colon, noun = what.rpartition(": ")
    names = [getattr(one, "name", one) for one in known]
    if len(names) > MOST_NAMES and isinstance(name, str):
        close = difflib.get_close_matches(name[:60], names, 3)
        names.sort(key=lambda one: close.index(one) if one in close else len(close))
    return ModelError(
        f"{verb}{colon}there is no {noun} {brief(name)}{use} (there are: {listed(names)}){more}",
        str(name),
    )
