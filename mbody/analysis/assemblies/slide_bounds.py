"""How far places can slide while loops close: bounds that hold for all angles.

In a loop Σ P e^{iα} + Σ s Q e^{iα} + B = 0 the other arms are never longer than Σ|P| + |B|. One
displacement in a loop is no greater than that; several in known directions follow from linear
equations with such right-hand sides. Where directions of several turn, they may become parallel
and displacements have no bound.
"""

from __future__ import annotations

import numpy as np

__all__ = ["REACH", "slide_bounds"]

#: Displacements without a bound are searched up to so many times the size of the rows.
REACH = 4.0
#: Least part of the size of the rows to which one is searched; by how much bounds are widened.
LEAST, WIDER = 1e-2, 1.0 + 1e-9
#: Least singular value of directions that are not parallel.
PARALLEL = 1e-7


def slide_bounds(
    loops: np.ndarray, slides: np.ndarray, rest: np.ndarray, along: list[int], scale: float
) -> tuple[np.ndarray, bool]:
    """Greatest displacements (slides,), and whether they hold for all positions.

    Parameters
    ----------
    loops, slides : complex arrays (loops, directions), (loops, slides)
        P and Q.
    rest : complex array (loops,)
    along : list of int
        The direction of each slide, -1 where it is known.
    scale : float
        Size of the rows.

    Examples
    --------
    A slide along x and another along y close an arm of 2:

    >>> P, Q, B = np.array([[2.0 + 0j]]), np.array([[1.0, 1j]]), np.array([0j])
    >>> slide_bounds(P, Q, B, [-1, -1], 2.0)[0].round(6).tolist()
    [2.0, 2.0]
    """
    arms = np.abs(loops).sum(axis=1) + np.abs(rest)
    size = np.abs(slides)
    found = np.full(slides.shape[1], np.nan)
    going_on = True
    while going_on:
        going_on = False
        for n in range(len(arms)):
            left = np.flatnonzero((size[n] > 0.0) & np.isnan(found))
            if len(left) == 1:
                others = float(np.nansum(size[n] * np.where(np.isnan(found), 0.0, found)))
                found[left[0]] = (arms[n] + others) / size[n, left[0]]
                going_on = True
    left = np.flatnonzero(np.isnan(found))
    if len(left) and all(along[m] < 0 for m in left):
        found[left] = _by_equations(arms, slides, found, left)
    proven = bool(np.isfinite(found).all())
    reach = np.where(np.isfinite(found), found, REACH * scale)
    return WIDER * np.maximum(reach, LEAST * scale), proven


def _by_equations(
    arms: np.ndarray, slides: np.ndarray, found: np.ndarray, left: np.ndarray
) -> np.ndarray:
    """Bounds of slides in known directions; NaN where these are parallel."""
    others = arms + np.abs(slides) @ np.nan_to_num(found)
    A = np.concatenate([slides[:, left].real, slides[:, left].imag])
    if np.linalg.matrix_rank(A, tol=PARALLEL) < len(left):
        return np.full(len(left), np.nan)
    return np.asarray(np.abs(np.linalg.pinv(A)) @ np.concatenate([others, others]))
