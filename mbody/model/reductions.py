"""Reductions of a measured history to one number: peak, rms, integral and others."""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from mbody.errors import ModelError, brief

__all__ = [
    "OVER_TIME",
    "REDUCTIONS",
    "Reduced",
    "check_times",
    "in_time",
    "integrand",
    "mean_over",
    "mean_weights",
    "outermost",
    "reduce_history",
]

Array = np.ndarray


def in_time(t: Array) -> bool:
    """Whether time goes one way over the instants t (…, instants), of every design, and passes.

    >>> in_time(np.array([0.0, 0.1, 0.1, 0.4])), in_time(np.zeros(3)), in_time(np.zeros(1))
    (True, False, False)
    """
    step = np.diff(t)
    passes = t[..., -1] != t[..., 0]
    return bool(np.all(passes) and (np.all(step >= 0.0) or np.all(step <= 0.0)))


def mean_weights(t: Array) -> Array:
    """Weights of the instants t (…, instants) in a mean over the motion; their sum is 1.

    By the trapezoidal rule over time. Where no time passes, as over positions of a driver that has
    no rate, steps from one instant to the next count the same.

    >>> mean_weights(np.array([0.0, 1.0, 4.0]))
    array([0.125, 0.5  , 0.375])
    >>> mean_weights(np.zeros(3))
    array([0.25, 0.5 , 0.25])
    """
    count = t.shape[-1]
    if count == 1:
        return np.ones(t.shape)
    over = t if in_time(t) else np.broadcast_to(np.arange(float(count)), t.shape)
    step = np.diff(over)
    none = np.zeros((*t.shape[:-1], 1))
    weights = np.concatenate([step, none], axis=-1) + np.concatenate([none, step], axis=-1)
    return np.asarray(weights / weights.sum(axis=-1, keepdims=True))


def mean_over(a: Array, t: Array) -> Array:
    """The mean of values (…, instants) over the motion, by `mean_weights`.

    >>> float(mean_over(np.array([0.0, 1.0, 4.0]), np.array([0.0, 1.0, 4.0])))  # ∫ t dt / 4
    2.0
    """
    return np.asarray((a * mean_weights(t)).sum(axis=-1))


#: Reductions of values at the instants t, in s, the last axis, to one number. Means are those over
#: the motion, so that no result depends on where a grid of times is fine. An integral is that
#: by the trapezoidal rule of what `integrand` makes, the quantity times 1 s.
REDUCTIONS: dict[str, Callable[[Array, Array], Array]] = {
    "max": lambda a, t: a.max(axis=-1),
    "min": lambda a, t: a.min(axis=-1),
    "peak": lambda a, t: np.abs(a).max(axis=-1),
    "span": lambda a, t: a.max(axis=-1) - a.min(axis=-1),
    "rms": lambda a, t: np.sqrt(mean_over(np.square(a), t)),
    "mean": mean_over,
    "integral": lambda a, t: np.trapezoid(a, t, axis=-1),
    "first": lambda a, t: a[..., 0],
    "last": lambda a, t: a[..., -1],
}

#: Those that depend on the times of the instants.
OVER_TIME = ("rms", "mean", "integral")


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


def reduce_history(by: str, instant: int, history: Array, t: Array) -> Array:
    """A history (…, instants) at the times t, in s, reduced; as it is where `by` is empty.

    Raises
    ------
    ModelError
        For an integral over instants between which no time passes.

    >>> float(reduce_history("span", 0, np.array([1.0, -2.0, 4.0]), np.arange(3.0)))
    6.0
    """
    if by == "at":
        return np.asarray(history[..., instant])
    check_times(by, t)
    return np.asarray(REDUCTIONS[by](history, t)) if by else history


def check_times(by: str, t: Array) -> None:
    """Refuse an integral over instants between which no time passes.

    Raises
    ------
    ModelError
        For one instant, or times that do not increase.
    """
    if by != "integral":
        return
    if t.shape[-1] < 2 or not (t[..., -1] > t[..., 0]).all() or (np.diff(t) < 0.0).any():
        raise ModelError(
            f"integral: no time passes over the instants, {t.shape[-1]} of them: give times, as t, "
            "or a turn of a driver that has a rate; mean(…) needs none"
        )


def integrand(of: str) -> str:
    """The history of which an integral over time is the reduction: with the dimension that the
    integral has.

    >>> integrand("motor.power")
    '(motor.power)*(1 s)'
    """
    return f"({of})*(1 s)"


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
