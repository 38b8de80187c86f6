"""Placement of labels: near what they name, away from lines, pins and other labels."""

from __future__ import annotations

import functools
import io
import itertools
import math
import re
import textwrap
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from mbody.core.tolerances import DRAWN_DIRECTION_LEAST, TINY
from mbody.errors import ModelError
from mbody.files.tables import writing
from mbody.solution.doubts import inherited
from mbody.views.shapes import direction

if TYPE_CHECKING:
    from matplotlib.figure import Figure


# -- The style of all pictures: colours, widths and sizes --------------------------------------
#
# The colours are from the palette of M. Okabe and K. Ito, which colour-blind people can
# distinguish; they also differ in lightness, so that they can be distinguished in print.

INK = "#26323f"  # outlines of links, pins, text
LINK = "#dde5ec"  # fill of links
PLATE = "#eaeff4"  # fill of plates
WHEEL = "#f3f6f9"  # behind the links
GROUND = "#59636e"  # supports, rails, hatching
SOFT = "#7d8894"  # paths, scales, notes
LOAD = "#d55e00"
FORCE = "#0072b2"
DRIVER = "#00795a"
POLE = "#8f2d6b"
PAPER = "#ffffff"

#: Curves of a plot, in this order; the dashes distinguish them without colours.
CURVES = (
    ("#0072b2", "-"),
    ("#d55e00", (0, (6, 1.5))),
    ("#00795a", (0, (4, 1.2, 1.2, 1.2))),
    ("#26323f", (0, (1.4, 1.2))),
    ("#cc79a7", (0, (8, 1.5, 1.5, 1.5, 1.5, 1.5))),
    ("#e69f00", (0, (2.5, 1))),
)

#: Both are part of matplotlib, so that a picture is the same on every machine.
FONTS = ["STIXGeneral", "DejaVu Sans"]
MATHS = "stix"

#: Sizes in points.
SIZE = {
    "width": 330.0,  # of the mechanism in a picture, at most
    "height": 230.0,
    "margin": 12.0,
    "link": 4.2,  # half the width of a link
    "pin": 3.6,
    "block": 11.0,  # half the length of a slider
    "support": 13.0,  # height of the triangle below a ground pin
    "hatch": 4.5,
    "arrow": 74.0,  # the longest
    "arc": 19.0,  # radius of the arrow of a motor
    "text": 9.5,
    "title": 11.5,
}

#: Layers, from bottom to top.
Z = {
    "ring": 1.0,
    "wheel": 1.5,
    "plate": 2.0,
    "path": 2.5,
    "ground": 2.7,
    "link": 3.0,
    "block": 4.0,
    "pin": 6.0,
    "arrow": 7.0,
    "text": 9.0,
}


# -- The style of our pictures, and their content in each format -------------------------------


def styled() -> Any:
    """A context with the fonts and lines of our pictures, independent of the user's settings."""
    try:
        import matplotlib.style
    except ImportError:
        raise ModelError(
            "a picture needs matplotlib, which is not installed: pip install matplotlib"
        ) from None
    ours: dict[str, Any] = {
        "font.family": FONTS,
        "font.size": SIZE["text"],
        "mathtext.fontset": MATHS,
        "svg.fonttype": "path",
        "svg.hashsalt": "mbody",
        "axes.unicode_minus": True,
    }
    return matplotlib.style.context(["default", ours])


def content_of(figure: Figure, ending: str) -> bytes:
    """The content of a picture file in a format."""
    nameless: dict[str, Any] = {
        "svg": {"Date": None, "Creator": None},
        "png": {"Software": None},
        "pdf": {"CreationDate": None, "Creator": None, "Producer": None},
    }
    content = io.BytesIO()
    with styled():
        figure.savefig(content, format=ending, dpi=200, metadata=nameless[ending])
    whole = content.getvalue()
    return _shortened(whole.decode("utf-8")).encode("utf-8") if ending == "svg" else whole


def _shortened(svg: str) -> str:
    """The drawing a third smaller: outlines to a hundredth of a point, no superfluous spaces.

    >>> _shortened('<path d="M 1.23456 0.5 z" transform="scale(0.012345)"/>')
    '<path d="M1.23 0.5z" transform="scale(0.012345)"/>'
    """

    def shorter(path: re.Match[str]) -> str:
        outline = re.sub(r"(\.\d\d)\d+", r"\1", path[1])
        return 'd="' + re.sub(r"\s*([A-Za-z])\s*", r"\1", outline) + '"'

    return re.sub(r'\bd="([^"]*)"', shorter, svg)


# -- matplotlib, loaded for the first picture, and the picture files ---------------------------

ENDINGS = ("svg", "png", "pdf")


def blank() -> Figure:
    """An empty figure without a window; notebooks can show it."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure: Any = Figure(facecolor="white")
    FigureCanvasAgg(figure)
    vars(figure)["_repr_mimebundle_"] = functools.partial(_in_a_notebook, figure)
    return figure


def _in_a_notebook(figure: Figure, include: Any = None, exclude: Any = None) -> dict[str, str]:
    """A drawing as SVG: sharp, and without a server."""
    return {"image/svg+xml": content_of(figure, "svg").decode("utf-8")}


#: Size of sentences below a picture [points], and how many there are at most.
BELOW, SENTENCES = 7.0, 4


def said_below(
    figure: Figure, *results: Any, of: Iterable[Any] = (), notes: Iterable[str] = ()
) -> Figure:
    """The figure with doubts of results, and what is known of the forces of which it shows
    quantities, in small lines below it.
    """
    said = inherited(*results, of=of, notes=notes)
    doubts = {one.message for one in said["doubts"]}
    sentences = [f"in doubt: {one}" if one in doubts else one for one in said["notes"]]
    if not sentences:
        return figure
    wide, tall = figure.get_size_inches()
    letters = max(40, int(wide * 72.0 / (0.5 * BELOW)))
    texts = [one.replace("$", r"\$") for one in sentences[:SENTENCES]]
    lines = [line for one in texts for line in textwrap.wrap(one, letters)]
    more = (1.35 * len(lines) + 1.0) * BELOW / 72.0
    places = [(axes, axes.get_position()) for axes in figure.axes]
    figure.set_size_inches(wide, tall + more)
    part = tall / (tall + more)
    for axes, at in places:
        axes.set_position((at.x0, 1.0 - (1.0 - at.y0) * part, at.width, at.height * part))
    figure.text(
        BELOW / 72.0 / wide,
        0.5 * BELOW / 72.0 / (tall + more),
        "\n".join(lines),
        size=BELOW,
        color=SOFT,
        va="bottom",
        linespacing=1.35,
        gid="notes",
    )
    return figure


def check_ending(path: Any) -> str:
    """The format by the ending of a file.

    >>> check_ending("turn.SVG")
    'svg'
    """
    try:
        ending = Path(path).suffix[1:].lower()
    except TypeError:
        raise ModelError(f"a path must be text or path-like, not {path!r}") from None
    if ending not in ENDINGS:
        raise ModelError(
            f"cannot write '{path}': a picture is a file that ends in .svg, .png or .pdf"
        )
    return ending


def save(figure: Figure, path: Any) -> None:
    """Write a picture, in the format by the ending of the file.

    The same picture is the same file, byte by byte, with one version of matplotlib.

    Parameters
    ----------
    figure : matplotlib.figure.Figure
        Of `draw` or `plot`, or any other.
    path : str or path-like
        A file that ends in .svg, .png or .pdf; one that exists is replaced.

    Raises
    ------
    ModelError
        For another ending, or a place where no file can be written.
    """
    ending = check_ending(path)
    whole = content_of(figure, ending)
    with writing(path, binary=True) as file:
        file.write(whole)


Array = np.ndarray

# Places and costs stand a second time in `viewer/names.mjs`, since a page places labels while its
# reader zooms; a test runs both on the same data.

#: Directions of a label from a point, and rings of them.
AROUND, RINGS = 24, 7
#: Cost of a label on a line of its own height, on another label as a whole, in a moving picture of
#: another place than in the frame before, and of a label that is cut off.
ON_LINE, ON_LABEL, MOVED, CUT = 3.0, 200.0, 0.5, 3.0
#: Weights of arrows and pins, and of outlines, in a moving picture.
ARROW_WEIGHT, OUTLINE_WEIGHT = 0.3, 0.1
#: Part of a label that others may cover before a moving picture leaves it out, and before it is
#: shown again.
COVERED, CLEAR = 0.25, 0.1


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


Spots = list[tuple[float, float, float]]


def places_around(
    anchor: Any, size: tuple[float, float], gap: float, wanted: float, rotation_cost: float = 1.0
) -> Spots:
    """Places around a point at the distance `gap`, best in the direction `wanted` [rad]."""
    found = []
    for ring in range(RINGS):
        for n in range(AROUND):
            angle = wanted + math.tau * n / AROUND
            u = direction(angle)
            distance = gap * (1.0 + 0.9 * ring) + _to_edge(size, u)
            x, y = np.asarray(anchor) + distance * u
            cost = rotation_cost * 0.5 * (1.0 - math.cos(angle - wanted)) + 1.2 * ring
            found.append((float(x), float(y), cost))
    return found


def _to_edge(size: tuple[float, float], u: Array) -> float:
    """Distance from the middle of a rectangle to its edge in a direction."""
    least = DRAWN_DIRECTION_LEAST
    return float(min(0.5 * size[k] / max(abs(u[k]), least) for k in (0, 1)))


def places_alongside(anchor: Array, size: tuple[float, float], gap: float, normal: Array) -> Spots:
    """Places beside an edge, on the side of its normal or the other, and along it."""
    x, y = normal.tolist()
    distance = gap + 0.5 * (size[0] * abs(x) + size[1] * abs(y))
    slide, found = size[0] * abs(y) + size[1] * abs(x), []
    for side in (1.0, -1.0):
        for part in (0.0, 0.5, -0.5, 1.0, -1.0):
            a, b = side * distance, part * slide
            cost = 0.6 * (side < 0.0) + 0.5 * abs(part)
            found.append((float(anchor[0] + a * x + b * y), float(anchor[1] + a * y - b * x), cost))
    return found


def places_within(anchor: Array, size: tuple[float, float]) -> Spots:
    """Places on a plate, or somewhat aside."""
    moves = ((0.0, 0.0), (0.0, 1.1), (0.0, -1.1), (0.7, 0.0), (-0.7, 0.0))
    x, y = map(float, anchor)
    return [(x + a * size[0], y + b * size[1], 0.5 * bool(a or b)) for a, b in moves]


def places_by_arrow(tail: Array, vector: Array, size: tuple[float, float]) -> Spots:
    """Places at the tip of an arrow, or beside its shaft."""
    u = vector / math.hypot(*vector)
    across = np.array([-u[1], u[0]])
    clear, half = _to_edge(size, u), 0.5 * float(np.abs(across) @ size)
    found = []
    for more, cost in ((4.0, 0.0), (17.0, 0.7)):
        x, y = tail + vector + (more + clear) * u
        found.append((float(x), float(y), cost))
    for more, cost in ((4.0, 0.4), (15.0, 0.6)):
        for part in (0.9, 0.55):
            for side in (1.0, -1.0):
                x, y = tail + part * vector + side * (more + half) * across
                found.append((float(x), float(y), cost + 0.3 * (1.0 - part)))
    return found


@dataclass
class FreePlaces:
    """Obstacles, and labels that are placed one after another.

    `unit`: Length of a point (1/72 in) in the units of the mechanism.
    `canvas`: Width and height, from a corner at zero, beyond which a label is cut off.
    """

    unit: float
    canvas: tuple[float, float] | None = None
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
            best, cost, _ = self.best(label.spots, width, height)
            x, y, own = label.spots[best]
            label.at, label.covers = (x, y), cost > own + 0.05
            self.occupy(x, y, width, height)

    def best(
        self, spots: Spots, width: float, height: float, last: int = -1
    ) -> tuple[int, float, float]:
        """The place of least cost, its cost, and how much of it other labels cover; `last` is the
        place that the label had.
        """
        at = np.array(spots)
        covered = self.covered(at, width, height)
        costs = self.costs(at, width, height) + MOVED * ((np.arange(len(at)) != last) & (last >= 0))
        if self.canvas is not None:
            half = 0.5 * np.array([width, height])
            costs += CUT * ((at[:, :2] < half) | (at[:, :2] > self.canvas - half)).any(axis=1)
        # rounded, so that rounding errors do not decide between equal costs
        costs = np.round(costs, 6)
        best = int(np.argmin(costs))
        return best, float(costs[best]), float(covered[best])

    def occupy(self, x: float, y: float, width: float, height: float) -> None:
        """Add a label as an obstacle."""
        self.boxes.append((x, y, 0.5 * width, 0.5 * height))

    @staticmethod
    def measured(label: Label) -> tuple[float, float]:
        """Width and height of a label in points, with a margin."""
        width, height = extent(label.text, label.size, label.italic)
        return width + 4.0, height + 2.0

    def costs(self, spots: Array, width: float, height: float) -> Array:
        """The costs of places (spots, 3): the lines and labels that the text would cover."""
        x, y = spots[:, :1], spots[:, 1:2]
        total = spots[:, 2] + ON_LABEL * self.covered(spots, width, height)
        lines = self._lines_near(x, y, width, height)
        if len(lines):
            along = _inside(lines, x, y, 0.5 * width + lines[:, 4], 0.5 * height + lines[:, 4])
            total += ON_LINE * np.sum(lines[:, 5] * along, axis=1) / height
        return np.asarray(total)

    def covered(self, spots: Array, width: float, height: float) -> Array:
        """How much of a label other labels cover at each place."""
        if not self.boxes:
            return np.zeros(len(spots))
        x, y, boxes = spots[:, :1], spots[:, 1:2], np.array(self.boxes)
        dx = np.minimum(x + 0.5 * width, boxes[:, 0] + boxes[:, 2])
        dx -= np.maximum(x - 0.5 * width, boxes[:, 0] - boxes[:, 2])
        dy = np.minimum(y + 0.5 * height, boxes[:, 1] + boxes[:, 3])
        dy -= np.maximum(y - 0.5 * height, boxes[:, 1] - boxes[:, 3])
        # of the smaller of the two: a long text may not hide a short one
        smaller = np.minimum(width * height, 4.0 * boxes[:, 2] * boxes[:, 3])
        covered = np.clip(dx, 0.0, None) * np.clip(dy, 0.0, None) / smaller
        return np.asarray(covered.sum(axis=1))

    def crowd(self, places: Sequence[Array], size: float) -> float:
        """The cost of squares of a size about some places, as a sum."""
        return float(self.costs(np.array([(*at, 0.0) for at in places]), size, size).sum())

    def _lines_near(self, x: Array, y: Array, width: float, height: float) -> Array:
        """The lines that a label at one of these places can cover."""
        if len(self.strokes) != len(self._stroke_array):
            self._stroke_array = np.array(self.strokes)
        lines, near = self._stroke_array, np.ones(len(self.strokes), dtype=bool)
        for k, (at, size) in enumerate(((x, width), (y, height))):
            more = 0.5 * size + lines[:, 4]
            near &= np.maximum(lines[:, k], lines[:, k + 2]) >= at.min() - more
            near &= np.minimum(lines[:, k], lines[:, k + 2]) <= at.max() + more
        return np.asarray(lines[near])

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
