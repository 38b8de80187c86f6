"""Placement of labels: near what they name, away from lines, pins and other labels."""

from __future__ import annotations

import functools
import itertools
import math
import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from mbody.core.tolerances import DRAWN_DIRECTION_LEAST, TINY
from mbody.views.shapes import direction
from mbody.views.style import FONTS, INK, MATHS, SIZE

Array = np.ndarray

#: Number of directions of a label from a point.
AROUND = 24
#: Cost of a label on a line of its own height, and on another label as a whole.
ON_LINE, ON_LABEL = 3.0, 40.0


@dataclass
class Label:
    """A text and its possible places.

    `spots`: Centres of the text, and the cost of the place itself.
    """

    text: str
    spots: list[tuple[float, float, float]]
    size: float = SIZE["text"]
    color: str = INK
    italic: bool = False
    name: str = ""
    at: tuple[float, float] = (0.0, 0.0)
    covers: bool = False


def extent(text: str, size: float, italic: bool = False) -> tuple[float, float]:
    """Width and height of a text in points.

    >>> width, height = extent("coupler", 10.0)
    >>> 20.0 < width < 45.0, 5.0 < height < 12.0
    (True, True)
    """
    width, height, _ = _measured(text, size, italic)
    return width, height


def below_line(text: str, size: float, italic: bool = False) -> bool:
    """Whether a part of a text is below its line, as of a p or an index.

    >>> below_line("coupler", 10.0), below_line("$O_{2}$", 10.0), below_line("crank", 10.0)
    (True, True, False)
    """
    return _measured(text, size, italic)[2] < -0.1 * size


@functools.cache
def _measured(text: str, size: float, italic: bool) -> tuple[float, float, float]:
    """Width, height and least ordinate above the line of a text in points."""
    from matplotlib.font_manager import FontProperties
    from matplotlib.textpath import TextPath

    font = FontProperties(
        family=FONTS, style="italic" if italic else "normal", math_fontfamily=MATHS
    )
    if not text.strip():
        return 0.0, 0.0, 0.0
    width, height, low = _outlined(TextPath((0, 0), drawable(text), size=size, prop=font))
    return width, max(height, 0.7 * size), low


def _outlined(path: Any) -> tuple[float, float, float]:
    """Width, height and least ordinate of a path of matplotlib: its `get_extents`, for all curves
    at once.
    """
    points, codes = np.asarray(path.vertices), np.asarray(path.codes)
    curved = np.flatnonzero(codes == path.CURVE3)
    if not len(points) or (codes == path.CURVE4).any():
        box = path.get_extents()
        return float(box.width), float(box.height), float(box.y0)
    control, end = curved[::2], curved[1::2]
    a, b, c = points[control - 1], points[control], points[end]
    second_difference = a - 2.0 * b + c
    t = (a - b) / np.where(
        second_difference == 0.0, np.inf, second_difference
    )  # where the curve turns back, by axis
    t = np.clip(t, 0.0, 1.0)
    extrema = (1.0 - t) ** 2 * a + 2.0 * t * (1.0 - t) * b + t**2 * c
    on_line = codes != path.CLOSEPOLY
    on_line[control] = False
    all_points = np.concatenate([points[on_line], extrema])
    width, height = np.ptp(all_points, axis=0).tolist()
    return width, height, float(all_points[:, 1].min())


def symbolic(name: str) -> str:
    r"""A name as in books: a letter with an index in italics, others unchanged.

    >>> symbolic("O2"), symbolic("F_P"), symbolic("motor"), symbolic("cost $")
    ('$O_{2}$', '$F_{P}$', 'motor', 'cost \\$')
    """
    if re.fullmatch(r"[A-Za-z]_?[0-9]*|[A-Za-z]_[A-Za-z]", name):
        letter, index = name[0], name[1:].lstrip("_")
        return f"${letter}_{{{index}}}$" if index else f"${letter}$"
    return name.replace("$", r"\$")


_SMALL = re.compile(r"[⁻⁰¹²³⁴⁵⁶⁷⁸⁹]+")
_LOWERED = str.maketrans("⁻⁰¹²³⁴⁵⁶⁷⁸⁹", "-0123456789")


def drawable(text: str) -> str:
    r"""A text with signs that its fonts have: if a part of it is mathematics, all of it uses the
    mathematics font, which has no thin spaces and raised digits.

    >>> drawable("20\u2009000 N"), drawable("$T_{12}$ = 20\u2009000 N"), drawable("$F$ = 5·10⁻⁷ N")
    ('20\u2009000 N', '$T_{12}$ = 20$\\,$000 N', '$F$ = 5·10$^{-7}$ N')
    """
    if not re.search(r"(?<!\\)\$", text):
        return text
    raised = _SMALL.sub(lambda part: f"$^{{{part[0].translate(_LOWERED)}}}$", text)
    return raised.replace("\u2009", r"$\,$")


def together(names: Sequence[str]) -> str:
    """The names of pins at one place, those of one letter under it.

    >>> together(["A1", "A2"]), together(["A", "O2"])
    ('$A_{1,2}$', '$A$, $O_{2}$')
    """
    parts = [re.fullmatch(r"([A-Za-z])([0-9]+)", name) for name in names]
    letters = {part and part[1] for part in parts}
    if len(names) > 1 and len(letters) == 1 and None not in letters:
        return f"${letters.pop()}_{{{','.join(part[2] for part in parts if part)}}}$"
    return ", ".join(symbolic(name) for name in names)


def places_around(
    anchor: Any, size: tuple[float, float], gap: float, wanted: float, rotation_cost: float = 1.0
) -> list[tuple[float, float, float]]:
    """Places around a point at the distance `gap`, best in the direction `wanted` [rad]."""
    found = []
    for ring in range(4):
        for n in range(AROUND):
            angle = wanted + math.tau * n / AROUND
            u = direction(angle)
            distance = gap * (1.0 + 0.9 * ring) + min(
                0.5 * size[0] / max(abs(u[0]), DRAWN_DIRECTION_LEAST),
                0.5 * size[1] / max(abs(u[1]), DRAWN_DIRECTION_LEAST),
            )
            x, y = np.asarray(anchor) + distance * u
            cost = rotation_cost * 0.5 * (1.0 - math.cos(angle - wanted)) + 1.2 * ring
            found.append((float(x), float(y), cost))
    return found


@dataclass
class FreePlaces:
    """Obstacles, and labels that are placed one after another.

    `unit`: Length of a point (1/72 in) in the units of the mechanism.
    """

    unit: float
    strokes: list[tuple[float, float, float, float, float, float]] = field(default_factory=list)
    boxes: list[tuple[float, float, float, float]] = field(default_factory=list)

    def stroke(self, line: Array, half: float, weight: float = 1.0) -> None:
        """Add a line as an obstacle, `half` its width."""
        for a, b in itertools.pairwise(line):
            ends = float(a[0]), float(a[1]), float(b[0]), float(b[1])
            self.strokes.append((*ends, half, weight))

    def set(self, labels: Sequence[Label]) -> None:
        """Put each label at the place of least cost, in order."""
        for label in labels:
            width, height = (self.unit * part for part in self.measured(label))
            # rounded, so that rounding errors do not decide between equal costs
            costs = np.round(self.costs(np.array(label.spots), width, height), 6)
            x, y, own = label.spots[best := int(np.argmin(costs))]
            label.at, label.covers = (x, y), costs[best] > own + 0.05
            self.boxes.append((x, y, 0.5 * width, 0.5 * height))

    @staticmethod
    def measured(label: Label) -> tuple[float, float]:
        """Width and height of a label in points, with a margin."""
        width, height = extent(label.text, label.size, label.italic)
        return width + 4.0, height + 2.0

    def costs(self, spots: Array, width: float, height: float) -> Array:
        """The costs of places (spots, 3): the lines and labels that the text would cover."""
        x, y, total = spots[:, :1], spots[:, 1:2], spots[:, 2].copy()
        if self.strokes:
            lines = self._lines()
            along = _inside(lines, x, y, 0.5 * width + lines[:, 4], 0.5 * height + lines[:, 4])
            total += ON_LINE * np.sum(lines[:, 5] * along, axis=1) / height
        if self.boxes:
            boxes = np.array(self.boxes)
            dx = np.minimum(x + 0.5 * width, boxes[:, 0] + boxes[:, 2])
            dx -= np.maximum(x - 0.5 * width, boxes[:, 0] - boxes[:, 2])
            dy = np.minimum(y + 0.5 * height, boxes[:, 1] + boxes[:, 3])
            dy -= np.maximum(y - 0.5 * height, boxes[:, 1] - boxes[:, 3])
            # of the smaller of the two: a long text may not hide a short one
            smaller = np.minimum(width * height, 4.0 * boxes[:, 2] * boxes[:, 3])
            covered = np.clip(dx, 0.0, None) * np.clip(dy, 0.0, None) / smaller
            total += ON_LABEL * covered.sum(axis=1)
        return total

    def crowd(self, places: Sequence[Array], size: float) -> float:
        """The cost of squares of a size about some places, as a sum."""
        return float(self.costs(np.array([(*at, 0.0) for at in places]), size, size).sum())

    def _lines(self) -> Array:
        if len(self.strokes) != len(self._stroke_array):
            self._stroke_array = np.array(self.strokes)
        return self._stroke_array

    _stroke_array: Array = field(default_factory=lambda: np.zeros((0, 6)), repr=False)


def _inside(lines: Array, x: Array, y: Array, half_x: Array, half_y: Array) -> Array:
    """How much of each line lies within rectangles about (x, y), each (places, 1): (places, lines)
    (Liang and Barsky 1984).
    """
    offset = lines[:, 2:4] - lines[:, :2]
    enter, leave = np.zeros(1), np.ones(1)
    for k, (middle, half) in enumerate(((x, half_x), (y, half_y))):
        start = lines[:, k] - middle
        parallel = np.abs(offset[:, k]) < TINY
        component = np.where(parallel, 1.0, offset[:, k])
        first, last = (-half - start) / component, (half - start) / component
        first, last = np.minimum(first, last), np.maximum(first, last)
        outside = parallel & (np.abs(start) > half)
        first, last = np.where(parallel, -np.inf, first), np.where(parallel, np.inf, last)
        first = np.where(outside, np.inf, first)
        enter, leave = np.maximum(enter, first), np.minimum(leave, last)
    length = np.hypot(offset[:, 0], offset[:, 1])
    # a line that is shorter than wide counts by its width
    return np.clip(leave - enter, 0.0, None) * np.maximum(length, lines[:, 4])
