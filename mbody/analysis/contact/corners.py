"""Corners that meet: which of the edges about them two bodies touch on.

A corner on an edge is at the end of that edge where it meets another corner. Several edges run
through both corners, and their gaps are all zero there. Convex bodies are apart as long as one of
these gaps does not close: their distance is the greatest of the gaps, so that its
rate is the greatest of their rates. What slides over the end of a table or from one segment of a
floor to the next strikes none of the edges that it meets there. An edge keeps a corner off only
where both edges of that corner are on its free side: the sides of boxes of one width, one upon the
other, do not hold each other.

Gilbert, Johnson, Keerthi (1988); Ericson: Real-Time Collision Detection (2005), 5.5.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mbody.model.contact_spots import Spot

__all__ = ["Corners"]

Array = np.ndarray

#: A corner: its body, and its place in this one.
Corner = tuple[str, float, float]

#: Sine of the angle below which one edge goes straight on from another.
STRAIGHT = 1e-9


@dataclass(frozen=True)
class _EdgeEnd:
    """An end of an edge: number of the touch, 0 where the edge begins and 1 where it ends, its
    direction, its corner, and the corner that touches the edge.
    """

    touch: int
    end: int
    direction: tuple[float, float]
    corner: Corner
    other: Corner


class Corners:
    """The edges that run through the same two corners, of the touches of a system.

    Parameters
    ----------
    spots : sequence of Spot
        Where bodies may touch.
    length : float
        Model length.
    """

    def __init__(self, spots: Sequence[Spot], length: float) -> None:
        ends = [end for n, spot in enumerate(spots) for end in _ends(n, spot, length)]
        at: dict[Corner, list[_EdgeEnd]] = defaultdict(list)
        for one in ends:
            at[one.corner].append(one)
        # at a corner that points inwards bodies strike either edge, and it touches nothing itself
        buried = {corner for corner, about in at.items() if not _points_outwards(about)}
        meeting: dict[frozenset[Corner], list[int]] = defaultdict(list)
        for one in ends:
            pair = frozenset({one.corner, one.other})
            if not pair & buried:
                meeting[pair].append(one.touch)
        #: Touches by corners that point inwards, or that an edge goes straight on over.
        self.never = np.zeros(len(spots), dtype=bool)
        self.never[[one.touch for one in ends if one.other in buried]] = True
        #: Of a touch and an end of its edge, the touches whose edges run through both corners.
        self.others = {
            (one.touch, one.end): meeting.get(frozenset({one.corner, one.other}), [])
            for one in ends
        }
        #: Touches that may be at ends of their edges; the same edges with the corners beside those
        #: of these touches.
        self.ended, self.beside = _corners_beside(ends)

    def passed(self, gaps: Array, rates: Array, along: Array, near: float, slow: float) -> Array:
        """Which touches are none, (touches,): by what is no corner, at a corner what is behind the
        edge but for that corner, and what approaches an edge there while another one keeps both
        bodies apart.

        Parameters
        ----------
        gaps, rates : arrays (touches,)
            Gaps and what they grow by.
        along : array (touches, 2)
            Distances from both ends of the edge, positive between them.
        near, slow : float
            A gap, and a rate, that is none.
        """
        found = self.never.copy()
        at_end = (np.abs(along) <= near).any(axis=1)
        if at_end.any():
            behind = at_end[self.ended] & (gaps[self.beside] < -near)
            found[self.ended[behind]] = True
        for n in np.flatnonzero(rates < -slow):
            for end in np.flatnonzero(np.abs(along[n]) <= near):
                found[n] |= any(
                    gaps[m] >= -near and rates[m] > rates[n] + slow
                    for m in self.others.get((int(n), int(end)), ())
                )
        return found


def _ends(n: int, spot: Spot, length: float) -> list[_EdgeEnd]:
    """Both ends of the edge of a touch where corners touch edges."""
    if spot.edge is None or spot.round or not np.isfinite(spot.edge[2]):
        return []
    (x, y), (ux, uy), along = spot.edge
    # rows of edges begin at the body of the edge
    other = _corner(spot.normal.j, spot.arm, length)
    return [
        _EdgeEnd(n, end, (ux, uy), _corner(spot.normal.i, place, length), other)
        for end, place in enumerate(((x, y), (x + along * ux, y + along * uy)))
    ]


def _corners_beside(ends: list[_EdgeEnd]) -> tuple[Array, Array]:
    """Of touches by a corner and on an edge that ends, both as numbers: each, and the touch on the
    same edge of a corner that an edge joins to that one.
    """
    edges: dict[int, list[Corner]] = defaultdict(list)
    for one in ends:
        edges[one.touch].append(one.corner)
    joined: dict[Corner, set[Corner]] = defaultdict(set)
    for a, b in edges.values():
        joined[a].add(b)
        joined[b].add(a)
    touch_of = {(*edges[one.touch], one.other): one.touch for one in ends}
    pairs = {
        (n, touch_of[a, b, beside])
        for (a, b, corner), n in touch_of.items()
        for beside in joined[corner]
        if (a, b, beside) in touch_of
    }
    found = np.array(sorted(pairs), dtype=np.int64).reshape(-1, 2)
    return found[:, 0], found[:, 1]


def _corner(body: str, place: tuple[float, float], length: float) -> Corner:
    x, y = (round(float(part) / length, 12) + 0.0 for part in place)
    return body, x, y


def _points_outwards(about: list[_EdgeEnd]) -> bool:
    """Whether the edges at a corner, free on their left, turn to the right there."""
    for one in about:
        for two in about:
            if one.end == 1 and two.end == 0:
                (ax, ay), (bx, by) = one.direction, two.direction
                turn = ax * by - ay * bx
                if turn > STRAIGHT or (turn > -STRAIGHT and ax * bx + ay * by > 0.0):
                    return False
    return True
