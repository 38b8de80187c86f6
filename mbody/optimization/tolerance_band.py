"""How far each number of an optimum may go alone."""

from __future__ import annotations

import numpy as np

from mbody.optimization.start_designs import Screen

__all__ = ["tolerance_band"]

#: Places on the way to a bound, and halvings between two of them.
PLACES, HALVINGS = 24, 20


def tolerance_band(
    screen: Screen,
    x: np.ndarray,
    bounds: tuple[np.ndarray, np.ndarray],
    sizes: np.ndarray,
    loss: float,
) -> np.ndarray:
    """From where to where each number may go while the others are held: (numbers, 2).

    Places between the optimum and each bound are judged, denser near the optimum; the first one
    that is too bad is then approached by halving. All numbers go side by side.

    Parameters
    ----------
    x : array (numbers,)
        The optimum.
    sizes : array (aims + limits,)
        Sizes of aims and limits, by which a loss is measured.
    loss : float
        The part of these by which an aim may get worse and a limit be broken.
    """
    n, aims = len(x), len(screen.aims)
    ends = np.concatenate([bounds[0], bounds[1]])
    who = np.tile(np.arange(n), 2)
    values, margins = screen.judged(x[None])
    if not np.isfinite(values).all():
        return np.column_stack([x, x])
    worst = values[0] + loss * sizes[:aims]
    least = np.minimum(margins[0], 0.0) - loss * sizes[aims:]

    def good(parts: np.ndarray) -> np.ndarray:
        """Whether designs so far on their ways, (2 numbers, places), are good enough."""
        designs = np.tile(x, (parts.size, 1))
        own = np.repeat(who, parts.shape[1])
        way = (ends - x[who])[:, None] * parts
        designs[np.arange(parts.size), own] += way.reshape(-1)
        values, margins = screen.judged(designs)
        with np.errstate(invalid="ignore"):
            fine = (values <= worst).all(axis=1) & (margins >= least).all(axis=1)
        return np.asarray(fine.reshape(parts.shape))

    places = np.linspace(0.0, 1.0, PLACES + 1)[1:] ** 3
    fine = good(np.tile(places, (2 * n, 1)))
    first = np.where(fine.all(axis=1), PLACES, (~fine).argmax(axis=1))
    known = np.append(0.0, places)
    low, high = known[first], known[np.minimum(first + 1, PLACES)]
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        fine = good(middle[:, None])[:, 0]
        low, high = np.where(fine, middle, low), np.where(fine, high, middle)
    found = x[who] + low * (ends - x[who])
    return np.column_stack([found[:n], found[n:]])
