"""Ranges over boxes, many at a time: of a cosine, of a product, and a cosine inverted.

NumPy does not round outwards; each range is widened by `WIDEN` of its size instead, which is some
thousand times the rounding of what is added up.
"""

from __future__ import annotations

import numpy as np

__all__ = ["WIDEN", "cosine_range", "first_within", "products"]

#: By what ranges are widened, as a part of the size of what is added up.
WIDEN = 1e-12
TURN = 2.0 * np.pi


def cosine_range(low: np.ndarray, high: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Least and greatest cosine between two angles [rad], exact up to `WIDEN`.

    >>> [round(float(end), 6) for end in cosine_range(np.array(-0.5), np.array(0.2))]
    [0.877583, 1.0]
    """
    a, b = np.cos(low), np.cos(high)
    least, greatest = np.minimum(a, b), np.maximum(a, b)
    greatest = np.where(np.floor(high / TURN) > np.floor(low / TURN), 1.0, greatest)
    behind, ahead = (low - np.pi) / TURN, (high - np.pi) / TURN
    least = np.where(np.floor(ahead) > np.floor(behind), -1.0, least)
    return least - WIDEN, greatest + WIDEN


def first_within(start: np.ndarray, near: np.ndarray, far: np.ndarray) -> np.ndarray:
    """The least angle t ≥ start whose size, taken within half a turn, is between near and far,
    0 ≤ near ≤ far ≤ π.

    >>> float(first_within(np.array(0.1), np.array(0.5), np.array(1.0)))
    0.5
    """
    turns = TURN * np.floor((start + np.pi) / TURN)
    t = start - turns
    beyond = np.where(t <= far, t, TURN - far)
    inside = np.where(t < near, near, beyond)
    behind = np.where(t <= -near, t, inside)
    return np.asarray(np.where(t < -far, -far, behind) + turns)


def products(
    a: tuple[np.ndarray, np.ndarray], b: tuple[np.ndarray, np.ndarray]
) -> tuple[np.ndarray, np.ndarray]:
    """Least and greatest product of a number in the range `a` and one in the range `b`."""
    every = a[0] * b[0], a[0] * b[1], a[1] * b[0], a[1] * b[1]
    least = np.minimum(np.minimum(every[0], every[1]), np.minimum(every[2], every[3]))
    greatest = np.maximum(np.maximum(every[0], every[1]), np.maximum(every[2], every[3]))
    return least, greatest
