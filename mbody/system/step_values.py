"""Values of recorded formulas on arrays, by NumPy."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from mbody.laws.base import FloatArray
from mbody.laws.kernels import evaluate
from mbody.model.primitives import Signal
from mbody.quantities.numpy_operations import ONE, TWO
from mbody.system.formula_steps import StepList

__all__ = ["step_values"]

#: Which of (f, f′, f″) of a curve a step is.
BENDS = ("law", "law rate", "law bend")


def step_values(
    steps: StepList, goals: Sequence[int], read: Callable[..., Any], shape: tuple[int, ...]
) -> list[FloatArray]:
    """The numbers at some places of a list of steps, each of that shape.

    Parameters
    ----------
    steps : StepList
    goals : sequence of int
        The places.
    read : callable
        The values of what a step reads, but of a parameter: of ("time",), ("position", body, axis)
        and so on, see `StepList`.
    shape : tuple of int
    """
    known: dict[int, Any] = {}
    with np.errstate(all="ignore"):
        for place in steps.needed(goals):
            kind, *rest = steps.steps[place]
            taken = [known[one] for one in steps.taken(place)]
            if kind == "parameter":
                known[place] = steps.numbers[rest[0]]
            elif kind in BENDS:
                known[place] = _curve(steps.laws[rest[0]], BENDS.index(kind), taken, shape)
            elif kind in ONE:
                known[place] = ONE[kind](*taken)
            elif kind in TWO:
                known[place] = TWO[kind](*taken)
            else:
                known[place] = read(kind, *rest)
    return [np.broadcast_to(np.asarray(known[goal], dtype=float), shape) for goal in goals]


def _curve(signal: Signal, order: int, taken: list[Any], shape: tuple[int, ...]) -> FloatArray:
    """A curve, or a derivative of it, with the numbers that it has there."""
    law: Any = signal.law
    places = [
        np.ascontiguousarray(np.broadcast_to(one, shape), dtype=float).reshape(-1) for one in taken
    ]
    if len(places) == 2 or law.kind == "user":
        table = law.raw(*places)
    else:
        table = np.empty((places[0].size, 3))
        par = np.array(signal.parameters, dtype=float).reshape(-1, 1)
        evaluate(law.code, par, 0, len(par), 0, law.table(), 0, places[0], table)
    values: FloatArray = table[:, order].reshape(shape)
    return values
