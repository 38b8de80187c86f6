"""Users' joints and loads in kernels: one call a lane, and derivatives by differences.

A user's function takes (t, side i, side j, parameters) and fills results. Of dual numbers it gets
the values; the tangents of its results are differences of four calls along each tangent of its
arguments, with an error of the fourth power of the step, some 1e-11 of the greatest.
"""

from __future__ import annotations

import numpy as np

from mbody.core.callbacks import call_user
from mbody.core.decorators import inline, njit
from mbody.core.dual_number import value
from mbody.core.duals import entry, lane_at, put_entry, rounds, tangent, tangents, with_tangent
from mbody.kernels.law_values import STEP

__all__ = ["user_numbers"]

#: Numbers of the time and both sides; the parameters follow.
STATE = 17


@njit
def user_numbers(W, w, handle, i, j, first, size, results):
    """Scratch rows ← what a user's function gives for its parameters from row `first` on; NaN where
    it raised, the caller finds the exception.
    """
    for m in range(rounds(W.scratch, w)):
        lane = lane_at(m, w)
        set_arguments(W, i, j, first, size, lane, 0, 0.0)
        call(W, handle, size, results)
        for n in range(results):
            put_entry(W.scratch, n, W.user_results[n], lane)
        for k in range(tangents(w)):
            h = step(W, i, j, first, size, lane, k)
            if h == 0.0:
                continue
            for part in range(4):
                # places h, −h, 2 h, −2 h and their weights
                far = 2.0 if part > 1 else 1.0
                way = 1.0 if part % 2 == 0 else -1.0
                weight = way * (8.0 if part < 2 else -1.0) / (12.0 * h)
                set_arguments(W, i, j, first, size, lane, k, way * far * h)
                call(W, handle, size, results)
                for n in range(results):
                    x = entry(W.scratch, n, lane)
                    change = tangent(x, k) + weight * W.user_results[n]
                    put_entry(W.scratch, n, with_tangent(x, k, change), lane)


@inline
def set_arguments(W, i, j, first, size, lane, k, h):
    """The arguments of the function, moved by h along tangent k."""
    x = W.user_arguments
    x[0] = moved(W.time, 0, lane, k, h)
    for end in range(2):
        b = i if end == 0 else j
        o = 1 + 8 * end
        for n in range(3):
            x[o + n] = moved(W.q, 3 * b + n, lane, k, h)
            x[o + 5 + n] = moved(W.v, 3 * b + n, lane, k, h)
        if h == 0.0:
            x[o + 3] = value(entry(W.turn, 2 * b, lane))
            x[o + 4] = value(entry(W.turn, 2 * b + 1, lane))
        else:
            x[o + 3], x[o + 4] = np.cos(x[o + 2]), np.sin(x[o + 2])
    for n in range(size):
        x[STATE + n] = moved(W.par, first + n, lane, k, h)


@inline
def call(W, handle, size, results):
    """Call the function; NaN where it raises."""
    if call_user(handle, W.user_arguments[: STATE + size], W.user_results[:results]) != 0:
        for n in range(results):
            W.user_results[n] = np.nan


@inline
def moved(array, row, lane, k, h):
    """A number moved by h along its tangent k."""
    x = entry(array, row, lane)
    return value(x) + h * tangent(x, k)


@njit
def step(W, i, j, first, size, lane, k):
    """A step along tangent k by which no argument changes by more than `STEP` of its size; zero
    where none changes.
    """
    length = value(entry(W.size, 0, lane))
    rate = relative(W.time, 0, lane, k, 1.0)
    for end in range(2):
        b = i if end == 0 else j
        for n in range(3):
            unit = 1.0 if n == 2 else length
            rate = max(rate, relative(W.q, 3 * b + n, lane, k, unit))
            rate = max(rate, relative(W.v, 3 * b + n, lane, k, unit))
    for n in range(size):
        rate = max(rate, relative(W.par, first + n, lane, k, 0.0))
    return STEP / rate if rate > 0.0 else 0.0


@inline
def relative(array, row, lane, k, unit):
    """Tangent k of a number as a part of its size, or of the unit if that is greater."""
    x = entry(array, row, lane)
    size, change = max(abs(value(x)), unit), abs(tangent(x, k))
    if size > 0.0:
        return change / size
    return change
