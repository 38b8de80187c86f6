"""Result of reading another program's file."""

from __future__ import annotations

import itertools
import math
import re
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

from mbody.core.tolerances import FILE_PLACES_SAME
from mbody.errors import ModelError
from mbody.laws import ConstantSpeed, Law, Table
from mbody.model.body import Body
from mbody.model.coupling import AngleCoupling, CouplingTerm
from mbody.model.driver import AngleDriver, CoordinateDriver, DistanceDriver
from mbody.model.element import Element, Marker
from mbody.model.joints import Distance, Fixed, Gear, PinSlot, Prismatic, Revolute
from mbody.model.mechanism import Mechanism
from mbody.quantities.units import unit_system


@dataclass(frozen=True)
class Imported:
    """A model from another program's file.

    `mechanism`: What was read.
    `form`: The format of the file, such as ``"PMKS"``.
    `notes`: What was assumed where the file does not say it, and all that it has and the model has
      not.
    """

    mechanism: Mechanism
    form: str
    notes: tuple[str, ...] = ()


# -- A linkage as it is drawn: links and joints in the axes of the ground, at one position -----
# Programs that draw linkages keep no link axes: their files have joints at places of the drawing.
# Here every link has the axes of the ground at that position, so that all angles count from the
# drawing and the loops are closed as they are drawn.

GROUND = "ground"
#: Signs of a name that another program gave.
LONGEST = 60

Place = tuple[float, float]


def seen(text: Any) -> str:
    """Words of a file for a sentence: short, and without what cannot be printed.

    >>> seen("a" * 50)
    "'aaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaa…'"
    """
    words = str(text)
    short = words if len(words) <= 40 else f"{words[:40]}…"
    return f"'{short}'" if short.isprintable() else repr(short)


def plain_name(text: str) -> str:
    """A name that may stand in formulas, from one of another program.

    >>> plain_name("swing arm"), plain_name("2nd"), plain_name("…")
    ('swing_arm', 'n2nd', '')
    """
    plain = re.sub(r"\W+", "_", text).strip("_")[:LONGEST]
    return f"n{plain}" if plain[:1].isdigit() else plain


def refusal(element: str, why: str) -> ModelError:
    """The error of a file with an element that is not read."""
    return ModelError(f"{element}: {why}")


def number_of(value: Any, element: str, what: str) -> float:
    """A finite number of a file."""
    try:
        found = math.nan if isinstance(value, bool) else float(value)
    except (TypeError, ValueError, OverflowError):
        found = math.nan
    if not math.isfinite(found):
        raise refusal(element, f"{what} is {seen(value)}, it must be a finite number")
    return found


def letters(n: int) -> str:
    """The n-th of A, B, … Z, AA, AB and so on.

    >>> letters(0), letters(25), letters(26)
    ('A', 'Z', 'AA')
    """
    text = ""
    n += 1
    while n:
        n, remainder = divmod(n - 1, 26)
        text = chr(65 + remainder) + text
    return text


def back_and_forth(places: list[float], speed: float) -> Table:
    """A law that goes from place to place at a constant speed, again and again.

    >>> float(back_and_forth([1.0, 3.0, 1.0], 2.0)(0.25))
    1.5
    """
    x = [0.0]
    for here, there in itertools.pairwise(places):
        x.append(x[-1] + abs(there - here) / speed)
    return Table(x, places, periodic=True, interpolation="linear")


def origin(form: str, position: str) -> str:
    """The note of an imported mechanism."""
    return f"from a file of {form}; angles count from {position}"


class DrawnLinkage:
    """Links, joints and motors, one by one; then a `Mechanism`."""

    def __init__(self, name: str, form: str, units: str) -> None:
        self.name, self.form, self.units = name, form, units
        self.notes: list[str] = []
        self._points: dict[str, dict[str, Place]] = {GROUND: {}}
        self._elements: list[Element] = []
        self._used_names = {GROUND}

    @property
    def length_unit(self) -> str:
        """That of all its numbers."""
        return unit_system(self.units).of("length")

    @property
    def links(self) -> tuple[str, ...]:
        """The moving links."""
        return tuple(self._points)[1:]

    def _named(self, wanted: str) -> str:
        """A name that may stand in formulas, of one element alone."""
        plain = plain_name(wanted) or "link"
        name, n = plain, 2
        while name in self._used_names:
            name, n = f"{plain}_{n}", n + 1
        self._used_names.add(name)
        return name

    def link(self, wanted: str) -> str:
        """A new moving link, and the name that it has."""
        name = self._named(wanted)
        self._points[name] = {}
        if name != wanted:
            self.notes.append(f"the link {seen(wanted)} is named {name}")
        return name

    def point(self, link: str, label: str, at: Place) -> str:
        """A named point of a link; the dotted name that it has."""
        points = self._points[link]
        plain = re.sub(r"\W+", "_", label) or "P"
        name, n = plain, 2
        while points.get(name, at) != at:
            name, n = f"{plain}_{n}", n + 1
        points[name] = at
        return f"{link}.{name}"

    def note_keys(self, element: str, given: Iterable[Any], known: Iterable[str]) -> None:
        """A note on what an element of the file has besides what is known."""
        if others := sorted({str(key) for key in given} - set(known)):
            self.notes.append(f"not taken of {element}: {', '.join(map(seen, others))}")

    def _marker(self, link: str, label: str, at: Place, angle: float) -> Marker:
        """A place with a direction."""
        return Marker(link, self.point(link, label, at).rpartition(".")[2], angle)

    def _joint_name(self, label: str) -> str:
        """A name of a joint; a note where a link has the one of the file."""
        name = self._named(label)
        if label in self._points and label != GROUND:
            self.notes.append(f"the joint {seen(label)} is named {name}")
        return name

    def pin(self, label: str, i: str, j: str, at: Place) -> None:
        """A pin of two links."""
        places = self.point(i, label, at), self.point(j, label, at)
        self._elements.append(Revolute(self._joint_name(label), *places))

    def weld(self, label: str, i: str, j: str, at: Place) -> None:
        """Two links that are one."""
        places = self.point(i, label, at), self.point(j, label, at)
        self._elements.append(Fixed(self._joint_name(label), *places))

    def slide(self, label: str, i: str, j: str, at: Place, angle: float) -> None:
        """A slider on a guide of link i with that direction [rad]."""
        ends = self._marker(i, label, at, angle), self._marker(j, label, at, angle)
        self._elements.append(Prismatic(self._joint_name(label), *ends))

    def slot(self, label: str, i: str, j: str, at: Place, angle: float) -> None:
        """A pin of link j in a slot of link i with that direction [rad]."""
        slot, pin = self._marker(i, label, at, angle), self.point(j, label, at)
        self._elements.append(PinSlot(self._joint_name(label), slot, pin))

    def arc(self, label: str, i: str, j: str, at: Place, centre: Place) -> None:
        """A pin of link j in a slot of link i that is an arc about a centre."""
        ends = self.point(i, f"{label}_centre", centre), self.point(j, label, at)
        self._elements.append(
            Distance(self._joint_name(label), *ends, length=math.dist(at, centre))
        )

    def gears(self, label: str, i: str, j: str, centres: tuple[Place, Place], touch: Place) -> None:
        """Two wheels whose pitch circles touch at a place of the line of their centres."""
        (a, b), distance = centres, math.dist(*centres)
        radii = math.dist(a, touch), math.dist(b, touch)
        size = max(radii)
        internal = abs(abs(radii[0] - radii[1]) - distance) <= FILE_PLACES_SAME * size
        if not internal and abs(sum(radii) - distance) > FILE_PLACES_SAME * size:
            raise refusal(
                f"the gear joint {label}",
                f"it is {radii[0]:g} and {radii[1]:g} from the centres of {i} and {j}, which are "
                f"{distance:g} apart: it must be where the pitch circles touch, on the line of the "
                "centres",
            )
        if not distance > FILE_PLACES_SAME * size or min(radii) <= FILE_PLACES_SAME * size:
            raise refusal(f"the gear joint {label}", "wheels about one place do not touch")
        places = self.point(i, f"{label}_i", a), self.point(j, f"{label}_j", b)
        phase = math.atan2(b[1] - a[1], b[0] - a[0])
        self._elements.append(
            Gear(
                self._joint_name(label),
                *places,
                radius_i=radii[0],
                radius_j=radii[1],
                internal=internal,
                phase=phase,
            )
        )

    def ratio(self, label: str, terms: list[tuple[float, str, str]]) -> None:
        """Angles whose sum with factors stays: (factor, link, measured from) each."""
        parts = [CouplingTerm(k, angle=link, relative_to=base) for k, link, base in terms]
        self._elements.append(AngleCoupling(self._joint_name(label), parts))

    def rotate(self, i: str, j: str, speed: float) -> None:
        """A motor that turns link j, measured from link i, at a speed [rad/s]."""
        self.rotate_by(i, j, ConstantSpeed(0.0, speed))

    def rotate_by(self, i: str, j: str, law: Law) -> None:
        """A motor whose angle from the drawn one follows a law."""
        self._elements.append(AngleDriver(self._named("motor"), j, law, relative_to=i))

    def push(self, label: str, i: str, j: str, at: Place, angle: float, speed: float) -> None:
        """A motor that moves a point of link j along a direction of link i [rad]."""
        ends = self._marker(i, label, at, angle), self._marker(j, label, at, 0.0)
        law = ConstantSpeed(0.0, speed)
        self._elements.append(CoordinateDriver(self._named("motor"), *ends, law))

    def stretch(self, label: str, i: str, j: str, law: Law) -> None:
        """A cylinder between two points, whose length follows a law."""
        self._elements.append(DistanceDriver(self._named(label), i, j, law))

    def imported(self) -> Imported:
        """The mechanism."""
        if not self.links:
            raise ModelError("the file has no link that moves")
        note = origin(self.form, "the position that is drawn")
        made = Mechanism(self.name, units=self.units, ground=self._points[GROUND], note=note)
        made.add(*(Body(link, points=self._points[link]) for link in self.links))
        made.add(*self._elements)
        return Imported(made, self.form, tuple(self.notes))
