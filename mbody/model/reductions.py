"""Reductions of a measured history to one number: peak, rms, span and others."""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from mbody.errors import ModelError, brief

__all__ = ["REDUCTIONS", "Reduced", "outermost", "reduce_history"]

Array = np.ndarray

#: Reductions from the instants, the last axis, to one number.
REDUCTIONS: dict[str, Callable[[Array], Array]] = {
    "max": lambda a: a.max(axis=-1),
    "min": lambda a: a.min(axis=-1),
    "peak": lambda a: np.abs(a).max(axis=-1),
    "span": lambda a: a.max(axis=-1) - a.min(axis=-1),
    "rms": lambda a: np.sqrt(np.square(a).mean(axis=-1)),
    "mean": lambda a: a.mean(axis=-1),
    "first": lambda a: a[..., 0],
    "last": lambda a: a[..., -1],
}


class Reduced(NamedTuple):
    """A formula in two parts.

    Attributes
    ----------
    by : str
        A name in `REDUCTIONS`, or "at"; empty where there is none.
    of : str
        What is reduced.
    instant : int
        Of "at".
    """

    by: str
    of: str
    instant: int = 0


def reduce_history(by: str, instant: int, history: Array) -> Array:
    """A history (…, instants) reduced; as it is where `by` is empty.

    >>> float(reduce_history("span", 0, np.array([1.0, -2.0, 4.0])))
    6.0
    """
    if by == "at":
        return np.asarray(history[..., instant])
    return np.asarray(REDUCTIONS[by](history)) if by else history


def outermost(text: str) -> Reduced:
    """The reduction of a formula, the formula in it, and the instant of "at".

    Raises
    ------
    ModelError
        For "at" without the number of an instant.

    >>> outermost("peak(A.force)")
    Reduced(by='peak', of='A.force', instant=0)
    >>> outermost("max(A.fx, A.fy)").by
    ''
    """
    match = re.fullmatch(r"\s*(\w+)\s*\((.*)\)\s*", text, re.DOTALL)
    if match is None or match[1] not in (*REDUCTIONS, "at"):
        return Reduced("", text.strip())
    parts, depth, part = [], 0, ""
    for letter in match[2]:
        depth += {"(": 1, ")": -1}.get(letter, 0)
        if depth < 0:  # the last bracket closes another one
            return Reduced("", text.strip())
        if letter == "," and depth == 0:
            parts.append(part)
            part = ""
        else:
            part += letter
    parts = [one.strip() for one in (*parts, part)]
    if match[1] == "at":
        if len(parts) != 2 or not re.fullmatch(r"-?\d{1,9}", parts[1]):
            raise ModelError(
                f"{brief(text)}: at takes a quantity and the number of an instant, as in "
                "at(A.force, 0)"
            )
        return Reduced("at", parts[0], int(parts[1]))
    if len(parts) != 1:  # the greater of two quantities, at every instant
        return Reduced("", text.strip())
    return Reduced(match[1], parts[0])
