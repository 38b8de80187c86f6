"""What bodies touch at a position, and which of it determines where they are."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from mbody.analysis.contact.unilateral import Touch, Unilateral
from mbody.kernels.layout import Work
from mbody.model.element import listed
from mbody.system.rank import dense, rank_of
from mbody.system.system import System

__all__ = ["ContactChoice"]

Array = np.ndarray

#: A gap that is none, in model lengths.
TIGHT = 1e-6
#: A gap that is closed where nothing else determines the position, in model lengths.
NEAR = 0.05
#: A gap that is no contact that was meant, in model lengths.
FAR = 10.0
#: Rows that differ by less are the same.
SAME = 1e-9


@dataclass(frozen=True)
class _Candidate:
    """A touch that may be closed: its number, its gap in model lengths, its dimensionless row."""

    touch: int
    gap: float
    row: Array


class ContactChoice:
    """What is closed at the position of a workspace, whose signals are set.

    Attributes
    ----------
    work : Work
    places : dict
        By contact the numbers of its places that are closed.
    rolls : set of str
        Contacts that roll.
    notes : list of str
        What was not touching.
    """

    def __init__(self, system: System, work: Work, free: int) -> None:
        self.system, self.work, self.free = system, work, free
        self.places: dict[str, list[int]] = defaultdict(list)
        self.notes: list[str] = []
        self.rolls: set[str] = set()
        self.uni = Unilateral(system)
        self.rows = self.uni.read(work)
        self.G = dense(system, work)[1]
        if self._left(self.G) <= free:
            return
        within = self.uni.within_edges(self.rows, work, NEAR * system.length, 0.0)
        gaps = self.uni.gaps(self.rows) / system.length
        candidates = [
            _Candidate(n, abs(float(gaps[n])), self._row(self.uni.touches[n].normal))
            for n in np.flatnonzero(within & ~self.uni.one_way & (np.abs(gaps) <= NEAR)).tolist()
        ]
        candidates.sort(key=lambda one: one.gap)
        for one in candidates:
            tight = one.gap <= TIGHT
            if tight or not free:
                self._close(one, tight)
        for name in list(self.places):
            self._roll(name)

    def _left(self, G: Array) -> int:
        """How many motions rows leave."""
        return rank_of(G).free

    def _row(self, number: int) -> Array:
        """One row that can be on or off, dimensionless."""
        unit = 1.0 if self.uni.angular[number] else 1.0 / self.system.length
        own = self.rows.block[number] / self.uni.units[number]
        return np.asarray(unit * own * self.system.coordinate_units)

    def _close(self, one: _Candidate, tight: bool) -> None:
        """Close a place; one that is only near where it takes a motion that nothing else takes."""
        size = float(np.linalg.norm(one.row))
        same = np.abs(np.abs(self.G @ one.row) - size * np.linalg.norm(self.G, axis=1))
        if (same <= SAME * size).any():
            return  # the same row is there
        more = np.vstack([self.G, one.row])
        if not tight and self._left(more) == self._left(self.G):
            return
        self.G = more
        name = self.uni.touches[one.touch].name
        first = next(n for n, touch in enumerate(self.uni.touches) if touch.name == name)
        self.places[name].append(one.touch - first)
        if not tight:
            gap = one.gap * self.system.length
            unit = self.system.mechanism.units.length
            self.notes.append(
                f"contact '{name}' is {gap:.3g} {unit} open where the guess puts its bodies, and "
                "is closed: begin with them touching to choose yourself"
            )

    def _roll(self, name: str) -> None:
        """Let a rough wheel roll where it could slip by a motion that nothing else takes."""
        own = [touch for touch in self.uni.touches if touch.name == name]
        closed = [own[n] for n in self.places[name]]
        if self._left(self.G) <= self.free or not all(map(_can_roll, closed)):
            return
        more = np.vstack([self.G, *(self._row(touch.tangent) for touch in closed)])
        if self._left(self.G) - self._left(more) == len(closed):
            self.G = more
            self.rolls.add(name)

    @property
    def left(self) -> int:
        """How many motions are left."""
        return self._left(self.G)

    @property
    def remedy(self) -> str:
        """What contacts could do where a motion is left."""
        if self.left <= self.free:
            return ""
        touches, gaps = self.uni.touches, self.uni.gaps(self.rows)
        unit = self.system.mechanism.units.length
        for n in np.argsort(np.abs(gaps)).tolist():
            one, gap = touches[n], abs(float(gaps[n]))
            if one.name in self.places or self.uni.one_way[n] or gap > FAR * self.system.length:
                continue
            size = gap / self.uni.unit_of(n)
            unit = "rad" if self.uni.angular[one.normal] else unit
            return f", or begin with '{one.name}' touching, which is {size:.4g} {unit} open"
        rough = [name for name in self.places if self._rubs(name)]
        if not rough:
            return ""
        return (
            f", or follow it by simulate, which decides whether friction of {listed(rough)} "
            "holds it"
        )

    def _rubs(self, name: str) -> bool:
        own = [touch for touch in self.uni.touches if touch.name == name]
        return name not in self.rolls and any(touch.static > 0.0 for touch in own)

    @property
    def key(self) -> tuple[tuple[str, tuple[int, ...], bool], ...]:
        """What is closed, in the order of the names."""
        return tuple(
            (name, tuple(sorted(self.places[name])), name in self.rolls)
            for name in sorted(self.places)
        )

    def elements(self, rolls_from: Mapping[str, tuple[float, ...]]) -> list[Any]:
        """The contacts with what is closed of them; where those that roll do so from."""
        of = {one.name: one for one in self.system.mechanism.contacts}
        return [
            replace(of[name], closed=places, rolls_from=rolls_from[name] if rolls else ())
            for name, places, rolls in self.key
        ]


def _can_roll(touch: Touch) -> bool:
    return touch.tangent >= 0 and touch.spot.round and touch.friction > 0.0
