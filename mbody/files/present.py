"""Which data belong to which result."""

from __future__ import annotations

from functools import singledispatch
from typing import Any

from mbody.analysis.inverse.answers import Answer
from mbody.files import answers, results
from mbody.solution.solution import Solution

__all__ = ["data"]


@singledispatch
def data(result: Any, angle: str = "deg") -> dict[str, Any]:
    """A result as plain lists and texts, ready for JSON.

    Raises
    ------
    TypeError
        For what has no such form.
    """
    raise TypeError(f"an object of the type {type(result).__name__} has no data")


data.register(Solution, results.data)
data.register(Answer, answers.answer_data)
