"""Instant centres in a drawing: marks, symbols, and the lines of Aronhold and Kennedy."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from mbody.engineering.kennedy_lines import kennedy_lines
from mbody.views.frame import rounded_number
from mbody.views.shapes import direction
from mbody.views.style import PAPER, POLE, Z

if TYPE_CHECKING:
    from mbody.engineering.instant_centres import InstantCentre, InstantCentres
    from mbody.views.pose import Pose
    from mbody.views.sketch import Sketch

__all__ = ["PolesShown", "book_symbol", "shown_poles"]

Array = np.ndarray

#: How far from the mechanism a centre is drawn, as a part of its diagonal.
AWAY = 0.75
#: With more centres than this only those that a joint or the ground has are drawn and have lines.
MANY = 15
#: With more places than this they have no symbols: these would cover each other.
NAMED = 50
#: Centres at infinity, and such as are none, that are said below a picture.
SAID = 6
#: Length of the arrow to a centre at infinity [points].
ARROW = 34.0


def book_symbol(text: str) -> str:
    """The symbol of a centre as in books.

    >>> book_symbol("I13")
    '$I_{13}$'
    """
    return f"${text[0]}_{{{text[1:]}}}$"


@dataclass(frozen=True)
class PolesShown:
    """Which centres of an instant are drawn.

    Attributes
    ----------
    centres : InstantCentres
    near : list of list of InstantCentre
        Those within the picture, the ones at one point together.
    words : list of str
        What is said of those that are not.
    """

    centres: InstantCentres
    pose: Pose
    near: list[list[InstantCentre]]
    words: list[str]

    @property
    def places(self) -> list[Array]:
        """One of each group."""
        return [self.place(group[0]) for group in self.near]

    def place(self, one: InstantCentre) -> Array:
        """Where a centre is."""
        return np.array([one.x[self.pose.k], one.y[self.pose.k]])

    def mark(self, sketch: Sketch) -> None:
        """Draw the lines below, the centres and their symbols above."""
        self._lines(sketch)
        for group in self.near:
            place = self.place(group[0])
            kept = [one for one in group if one.permanence != "instantaneous"]
            names = sorted((self.centres.symbol(one) for one in group), key=_number)
            text = ", ".join(book_symbol(name) for name in names)
            gid = f"pole:{names[0]}"
            if kept:
                sketch.disc(
                    place, 0.34 * sketch.size("pin"), POLE, POLE, 0.5, Z["pin"] + 0.2, name=gid
                )
            else:
                radius = max(0.62 * sketch.size("pin"), 2.0 * sketch.unit)
                sketch.disc(place, radius, POLE, PAPER, 0.9, Z["pin"] + 0.2, name=gid)
            if len(self.near) > NAMED:
                continue
            away = place - sketch.pose.middle
            wanted = (
                math.atan2(away[1], away[0]) if np.hypot(*away) > sketch.unit else 0.5 * math.pi
            )
            gap = (1.0 if kept else 0.7) * sketch.size("pin") + 3.0 * sketch.unit
            label = sketch.label(
                text, place, wanted, gap, turn=0.6, color=POLE, name=f"label:{gid}"
            )
            label.italic = False

    def _lines(self, sketch: Sketch) -> None:
        """Through each constructed centre the lines on which it is found."""
        near = {one.bodies for group in self.near for one in group}
        thin = len(self.centres) > MANY
        drawn: list[tuple[Array, Array]] = []
        for line in kennedy_lines(self.centres, sketch.pose.mechanism, self.pose.k):
            if line.pair not in near or (thin and "ground" not in line.pair):
                continue
            ends = self._ends(line.pair, line.through, near, sketch)
            if ends is not None:
                _join(drawn, ends, sketch.unit)
        for n, ends in enumerate(drawn):
            dashes = (0, (7, 3))
            sketch.line(
                ends,
                0.75,
                POLE,
                Z["path"] + 0.05,
                dashes=dashes,
                weight=0.35,
                name=f"kennedy:{n + 1}",
            )

    def _ends(
        self,
        pair: tuple[str, str],
        through: tuple[tuple[str, str], tuple[str, str]],
        near: set[tuple[str, str]],
        sketch: Sketch,
    ) -> tuple[Array, Array] | None:
        """The part of a line between centres that are drawn, a little longer."""
        k = self.pose.k
        at = [self.place(self.centres[pair])]
        for other in through:
            one = self.centres[other]
            if one.kind[k] == "finite" and one.bodies in near:
                at.append(self.place(one))
            elif one.kind[k] == "infinite":
                at.append(at[0] + ARROW * sketch.unit * direction(float(one.direction[k])))
        if len(at) < 2:
            return None
        whole = np.array(at)
        far = whole - whole[0]
        way = far[int(np.argmax(np.hypot(*far.T)))]
        length = float(np.hypot(*way))
        if length < sketch.unit:
            return None
        u = way / length
        along = far @ u
        more = 9.0 * sketch.unit
        return whole[0] + (along.min() - more) * u, whole[0] + (along.max() + more) * u


def _shown_number(value: float, length: float) -> str:
    return rounded_number(value if abs(value) > 1e-9 * length else 0.0)


def _number(symbol: str) -> tuple[int, str]:
    return len(symbol), symbol


def _join(lines: list[tuple[Array, Array]], ends: tuple[Array, Array], unit: float) -> None:
    """Add a line; what lies on one line with it becomes one with it."""
    start, end = ends
    for old in list(lines):
        way = old[1] - old[0]
        u = way / max(float(np.hypot(*way)), 1e-300)
        n = np.array([-u[1], u[0]])
        off = max(abs(float((place - old[0]) @ n)) for place in (start, end))
        part = sorted([float((start - old[0]) @ u), float((end - old[0]) @ u)])
        length = float(np.hypot(*way))
        if off < unit and part[0] < length and part[1] > 0.0:
            start, end = old[0] + min(part[0], 0.0) * u, old[0] + max(part[1], length) * u
            lines[:] = [line for line in lines if line is not old]
    lines.append((start, end))


def shown_poles(centres: InstantCentres, pose: Pose, corners: Array) -> PolesShown:
    """Choose the centres that a picture shows.

    Parameters
    ----------
    centres : InstantCentres
    pose : Pose
    corners : array (2, 2)
        The rectangle around the mechanism.
    """
    k, machine = pose.k, pose.mechanism
    middle = corners.mean(axis=0)
    half = 0.5 * np.ptp(corners, axis=0) + AWAY * float(np.hypot(*np.ptp(corners, axis=0)))
    few = len(centres) <= MANY
    groups: list[list[InstantCentre]] = []
    left, outside = [], []
    for one in centres.pairs:
        if one.kind[k] != "finite":
            continue
        place = np.array([one.x[k], one.y[k]])
        if not (few or "ground" in one.bodies or one.permanence != "instantaneous"):
            left.append(one)
            continue
        if (np.abs(place - middle) > half).any():
            at = ", ".join(_shown_number(float(part), pose.system.length) for part in place)
            outside.append(f"{centres.symbol(one)} at ({at})")
            continue
        for group in groups:
            there = np.array([group[0].x[k], group[0].y[k]])
            if np.hypot(*(there - place)) <= 1e-9 * pose.system.length + 1e-9 * np.hypot(*place):
                group.append(one)
                break
        else:
            groups.append([one])
    words = [text for text in centres.sentences(k) if "one point" not in text]
    if len(words) > SAID + 1:
        words.sort(key=lambda text: "against ground" not in text)
        rest = (
            f"{len(words) - SAID} more centres are at infinity, or are none: mbody poles has them"
        )
        words = [*words[:SAID], rest]
    words = [*centres.notes, *words]
    if outside:
        unit = machine.units.of("length")
        words.append(f"outside this picture: {', '.join(outside)} {unit}")
    if left:
        words.append(
            f"{len(left)} more centres of moving links are not drawn: mbody poles has them all"
        )
    if len(groups) > NAMED:
        words.append(f"centres at {len(groups)} places, too near for symbols: mbody poles has them")
    return PolesShown(centres, pose, groups, words)
