"""Global search for paths: shapes of mechanisms side by side, each with its best place and timing.

A coupler curve is linear in three complex numbers, C = c + α E + β G: E = e^{is} is the direction
of the crank, G that of the link that carries the point, both by the shape alone; α holds the size
and the direction of the frame, β the point. So only the ratios of lengths are searched; for every
shape and every timing the three numbers are the solution of a linear least-squares problem
(variable projection: G. Golub, V. Pereyra, SIAM J. Numer. Anal. 10 (1973) 413-432).
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from mbody.synthesis.linkage_kinds import Kind

__all__ = ["INSTANTS", "PathDemand", "PlacedCurve", "best_shapes", "timings"]

#: Positions of the crank in a turn at which curves are known to the search.
INSTANTS = 180
#: How much of a turn an open path without timing may take, in degrees.
SPANS = (20, 40, 60, 90, 120, 150, 180, 240, 300)
#: Of phases of open paths every third is tried.
STRIDE = 3
#: Numbers of one block of shapes, timings and points.
BLOCK = 2_000_000
#: Least share of what C, E and G have in common by which α and β are told apart.
DISTINCT = 1e-10


@dataclass(frozen=True, eq=False)
class PathDemand:
    """Points of a path.

    Attributes
    ----------
    points : array (points,)
        Complex.
    timing : array (points,) or None
        Angles of the crank, of which the differences count.
    closed : bool
        Whether the path returns to its first point, which is given once.
    low, high : array
        Bounds of the numbers of the kind.
    """

    points: np.ndarray
    timing: np.ndarray | None
    closed: bool
    low: np.ndarray
    high: np.ndarray


@dataclass(frozen=True, eq=False)
class PlacedCurve:
    """A design: a row of numbers, crank angles in space at the points, sense; its error."""

    error: float
    x: np.ndarray
    theta: np.ndarray
    sense: float


def timings(
    points: np.ndarray, timing: np.ndarray | None, closed: bool, turn: float = 2.0 * np.pi
) -> np.ndarray:
    """Timings that are tried, as instants of a turn, (timings, points); they may exceed the turn,
    which may be another range of the driver.
    """
    count, whole = len(points), np.arange(INSTANTS)[:, None]
    if timing is not None:
        return whole + np.rint(timing / turn * INSTANTS).astype(int)
    chords = np.abs(np.diff(points, append=points[:1]))
    if not closed:
        chords = chords[:-1]
    shares = [np.arange(count) / (count if closed else count - 1)]
    shares.append(np.concatenate([[0.0], np.cumsum(chords)])[:count] / chords.sum())
    spans = (360,) if closed else SPANS
    first = whole if closed else whole[::STRIDE]
    steps = [np.rint(span / 360 * INSTANTS * share) for span in spans for share in shares]
    rows = np.unique(np.array([sign * row for row in steps for sign in (1, -1)]), axis=0)
    return (first[:, None, :] + rows.astype(int)[None, :, :]).reshape(-1, count)


def best_shapes(
    kind: Kind, demand: PathDemand, shapes: Iterable[tuple[float, np.ndarray]], keep: int
) -> list[PlacedCurve]:
    """The best of some shapes, given for each sense, by their errors and by how far their numbers
    are beyond the bounds.
    """
    order = timings(demand.points, demand.timing, demand.closed)
    s = np.arange(INSTANTS) * (2.0 * np.pi / INSTANTS)
    crank = np.exp(1j * s)[order % INSTANTS]
    block = max(1, BLOCK // order.size)
    found: list[tuple[float, PlacedCurve]] = []
    for sense, own in shapes:
        for low in range(0, len(own), block):
            part = own[low : low + block]
            carrier = kind.curves(part, sense, s)[:, order % INSTANTS]
            error, fit = _fitted(demand.points, crank, carrier)
            x, frame = kind.placed(part[:, None, :], s, fit)
            beyond = np.maximum(demand.low - x, 0.0) + np.maximum(x - demand.high, 0.0)
            score = error + np.square(beyond).sum(axis=-1)
            best = np.where(np.isfinite(score), score, np.inf).argmin(axis=1)
            for n, k in enumerate(best):
                theta = order[k] * (2.0 * np.pi / INSTANTS) + frame[n, k]
                one = PlacedCurve(float(error[n, k]), x[n, k], theta, sense)
                found.append((float(score[n, k]), one))
    found = [pair for pair in found if np.isfinite(pair[0])]
    found.sort(key=lambda pair: pair[0])
    return [one for _, one in found[:keep]]


def _fitted(
    points: np.ndarray, crank: np.ndarray, carrier: np.ndarray
) -> tuple[np.ndarray, tuple[np.ndarray, np.ndarray, np.ndarray]]:
    """Least squares of C = c + α E + β G for E (timings, points), G (shapes, timings, points): the
    sum of squared distances, and c, α, β, each (shapes, timings).
    """
    count = len(points)
    middle = points.mean()
    goal = points - middle
    e_mean, g_mean = crank.mean(axis=-1), carrier.mean(axis=-1)
    back = crank.conj()
    h11 = count - count * np.abs(e_mean) ** 2
    h22 = count - count * np.abs(g_mean) ** 2
    h12 = np.einsum("tn,dtn->dt", back, carrier) - count * e_mean.conj() * g_mean
    b1, b2 = back @ goal, carrier.conj() @ goal
    with np.errstate(all="ignore"):
        determinant = h11 * h22 - np.abs(h12) ** 2
        determinant[determinant < DISTINCT * count**2] = np.nan
        alpha = (h22 * b1 - h12 * b2) / determinant
        beta = (h11 * b2 - h12.conj() * b1) / determinant
        error = np.sum(np.abs(goal) ** 2) - (b1.conj() * alpha + b2.conj() * beta).real
    c = middle - alpha * e_mean - beta * g_mean
    return np.maximum(error, 0.0), (c, alpha, beta)
