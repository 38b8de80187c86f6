"""The drawing of a mechanism: lines and shapes in its own units, sizes in points."""

from __future__ import annotations

import math
import textwrap
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from mbody.core.tolerances import ROUND_NUMBER_SLACK, TINY
from mbody.model.driver import AngleDriver
from mbody.model.loads import Gravity
from mbody.quantities.evaluate import place_in_turn
from mbody.summaries.text_table import cut
from mbody.views.labels import (
    DRIVER,
    FORCE,
    GROUND,
    INK,
    LINK,
    LOAD,
    PAPER,
    SIZE,
    SOFT,
    FreePlaces,
    Label,
    Z,
    below_line,
    drawable,
    extent,
    places_around,
)
from mbody.views.shapes import (
    GROUND_CARRIER,
    Carrier,
    Pose,
    arc,
    box,
    direction,
    hatching,
    heading,
    on,
    unique,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from mbody.quantities.output_units import OutputUnits
    from mbody.solution.solution import Solution


# -- The frame of a drawing: title, instant, scale, key of the arrows, and the figure's size ---

# -- Marks of contact modes, told apart without colours ----------------------------------------

Array = np.ndarray


def mark(sketch: Sketch, place: Array, mode: str, normal: Array, name: str) -> None:
    """The mark of a mode at a place, with the normal on j: a filled square sticks, an open circle
    slides, with the direction of j beside it, a ring with a dot rolls, a dashed circle is open.
    """
    size, z = sketch.size("pin"), Z["pin"] + 0.3
    if mode == "open":
        dashes = (0, (2.0, 1.6))
        sketch.disc(place, 0.8 * size, "none", SOFT, 0.9, z, name=name, dashes=dashes, weight=0.3)
    elif mode == "stick":
        corners = box(place, 0.78 * size, 0.78 * size, heading(normal))
        sketch.shape(corners, INK, PAPER, 0.7, z, name=name)
    elif mode == "roll":
        sketch.disc(place, 0.95 * size, PAPER, INK, 1.1, z, name=name)
        sketch.disc(place, 0.4 * size, INK, INK, 0.3, z + 0.01, name=name, weight=0.0)
    else:
        sketch.disc(place, 0.8 * size, PAPER, INK, 1.1, z, name=name)
        _sliding(sketch, place, normal, 1.0 if mode == "slip+" else -1.0, name)


def _sliding(sketch: Sketch, place: Array, normal: Array, sign: float, name: str) -> None:
    """A half arrow beside the mark, on the side of j, the direction in which j slides over i."""
    size = sketch.size("pin")
    u = sign * np.array([normal[1], -normal[0]])
    tail = place + 1.5 * size * normal - 1.6 * size * u
    tip = tail + 3.4 * size * u
    barb = tip - 1.3 * size * u + 0.85 * size * normal
    sketch.line([tail, tip, barb], 0.9, INK, Z["pin"] + 0.3, name=name, weight=0.4)


# -- Bars of contact modes below a plot --------------------------------------------------------

#: What has more modes than this shows those that change most often.
MOST = 16
#: Inches from bar to bar, and the part of it that the bar fills.
BAR, FILLED = 0.21, 0.72
#: Letters of a name beside its bar.
LETTERS = 13
#: Nearer than this part of the axis two marks of events are one.
MARK_SPACING = 0.004

#: Words, fill, edge and hatching of each mode, in the order of the key; the hatching distinguishes
#: them without colours.
MODES: dict[str, tuple[str, str, str, str]] = {
    "open": ("open", PAPER, SOFT, ""),
    "stick": ("sticks", "#5b6875", INK, ""),
    "roll": ("rolls", "#a9d5c8", DRIVER, "ooo"),
    "slip+": ("slides +", "#cfe3f1", FORCE, "////"),
    "slip-": ("slides −", "#f7dcc6", LOAD, "\\\\\\\\"),
}


@dataclass(frozen=True)
class ModeSpan:
    """From where to where on the axis a mode lasts."""

    low: float
    high: float
    mode: str


@dataclass(frozen=True)
class ModeRow:
    """The modes of a contact or a frictional joint over the axis.

    `spans`: Without gaps, from the first instant to the last.
    `impacts`: Where it was struck.
    """

    name: str
    spans: tuple[ModeSpan, ...]
    impacts: tuple[float, ...] = ()


def mode_rows(run: Solution, x: Array | None = None) -> tuple[list[ModeRow], int]:
    """The modes of every contact and frictional joint of a result, and how many are left out. `x`
    (instants,).

    A mode begins at the event that was located between two instants, else in the middle between
    them.

    >>> import mbody
    >>> machine = mbody.Mechanism("wheel")
    >>> machine.add(
    ...     mbody.Body("wheel", mass=2.0, cg=(0.1, 0.0)),
    ...     mbody.Revolute("O", "ground", "wheel", friction=0.1, pin_radius=0.01),
    ...     mbody.AngleDriver("motor", "wheel", mbody.laws.ConstantSpeed(0.0, 10.0)),
    ... )
    >>> [row.spans for row in mode_rows(mbody.kinetostatics(machine, t=[0.0, 1.0]))[0]]
    [(ModeSpan(low=0.0, high=1.0, mode='slip+'),)]
    """
    places = np.asarray(run.t if x is None else x, dtype=float)
    names = [] if run.analysis == "statics" else list(run.modes or run.losses)
    rows = [_row(run, name, places) for name in names]
    if len(rows) <= MOST:
        return rows, 0
    numbers = sorted(range(len(rows)), key=lambda n: -len(rows[n].spans))[:MOST]
    return [rows[n] for n in sorted(numbers)], len(rows) - MOST


def _row(run: Solution, name: str, x: Array) -> ModeRow:
    own = [event for event in run.events if event.contact == name]
    times = np.array(sorted(event.t for event in own))
    words, t = run.mode(name), run.t
    ends, modes = [float(x[0])], [words[0]]
    for k in range(len(words) - 1):
        if words[k + 1] == words[k]:
            continue
        between = times[(times >= t[k]) & (times <= t[k + 1])]
        part = (between[-1] - t[k]) / (t[k + 1] - t[k]) if between.size and t[k + 1] > t[k] else 0.5
        ends.append(float(x[k] + part * (x[k + 1] - x[k])))
        modes.append(words[k + 1])
    ends.append(float(x[-1]))
    pairs = zip(ends[:-1], ends[1:], modes, strict=True)
    spans = tuple(ModeSpan(low, high, mode) for low, high, mode in pairs)
    struck = [event.t for event in own if event.name in ("impact", "rest") and event.t <= t[-1]]
    return ModeRow(name, spans, tuple(float(v) for v in np.interp(struck, t, x)))


def mode_bars(axes: Axes, rows: Sequence[ModeRow], left_out: int = 0) -> None:
    """Draw bars from top to bottom, with the names beside them and a tick at every impact.

    Axes of a figure in the style of our pictures; its x axis is that of the panels above.
    """
    from matplotlib.patches import Rectangle

    axes.set_ylim(len(rows), 0.0)
    for n, row in enumerate(rows):
        for k, span in enumerate(row.spans):
            _, fill, edge, hatch = MODES[span.mode]
            low, high = sorted((span.low, span.high))
            look: dict[str, Any] = {"fc": fill, "ec": edge, "lw": 0.7, "hatch": hatch}
            if span.mode == "open":
                look |= {"ls": (0, (3, 2))}
            bar = Rectangle((low, n + 0.5 * (1.0 - FILLED)), high - low, FILLED, zorder=2.0, **look)
            bar.set_gid(f"mode:{row.name}:{k}:{span.mode}")
            axes.add_patch(bar)
        _impacts(axes, row, n)
    axes.set_yticks([n + 0.5 for n in range(len(rows))])
    axes.set_yticklabels([cut(row.name, LETTERS).replace("$", r"\$") for row in rows])
    axes.tick_params(axis="y", length=0.0, labelcolor=INK, pad=3.0)
    for side in ("top", "right", "left"):
        axes.spines[side].set_visible(False)
    axes.spines["bottom"].set_color(SOFT)
    if left_out:
        text = f"and {left_out} more, which change less often"
        look = {"size": 0.85 * SIZE["text"], "color": SOFT, "ha": "right", "va": "bottom"}
        axes.text(1.0, 1.02, text, transform=axes.transAxes, **look)


def _impacts(axes: Axes, row: ModeRow, n: int) -> None:
    """A triangle above the bar at every impact; those without number are some."""
    if not row.impacts:
        return
    ends = [row.spans[0].low, row.spans[-1].high]
    spacing = MARK_SPACING * abs(ends[1] - ends[0])
    drawn: list[float] = []
    for x in sorted(row.impacts):
        if not drawn or x - drawn[-1] >= spacing:
            drawn.append(x)
    axes.plot(
        drawn,
        [n + 0.12] * len(drawn),
        ls="none",
        marker="v",
        ms=3.6,
        mfc=INK,
        mec=PAPER,
        mew=0.4,
        zorder=4.0,
        clip_on=False,
        gid=f"impacts:{row.name}",
    )


def mode_key(axes: Axes, rows: Sequence[ModeRow], wide: float) -> None:
    """The key of the bars in axes of their own without a frame, `wide` inches; only of what is
    there.
    """
    from matplotlib.patches import Rectangle

    axes.set_axis_off()
    axes.set_xlim(0.0, wide)
    axes.set_ylim(0.0, 1.0)
    there = {span.mode for row in rows for span in row.spans}
    x, size = 0.0, 0.9 * SIZE["text"]
    text: dict[str, Any] = {"size": size, "color": INK, "va": "center_baseline"}
    for mode, (words, fill, edge, hatch) in MODES.items():
        if mode not in there:
            continue
        dashes: Any = (0, (3, 2)) if mode == "open" else "-"
        look: dict[str, Any] = {"fc": fill, "ec": edge, "lw": 0.7, "hatch": hatch, "ls": dashes}
        axes.add_patch(Rectangle((x, 0.15), 0.28, 0.7, gid=f"key:{mode}", **look))
        axes.text(x + 0.34, 0.5, words, **text)
        x += 0.34 + extent(words, size)[0] / 72.0 + 0.2
    if any(row.impacts for row in rows):
        axes.plot([x + 0.06], [0.5], ls="none", marker="v", ms=4.2, color=INK, gid="key:impact")
        axes.text(x + 0.16, 0.5, "impact", **text)


#: Modes that have one word in the key of a picture, where the mark has the direction.
SLIDES = ("slip+", "slip-")


def nice(value: float) -> float:
    """The greatest of 1, 2, 5, 10, 20 … that is not above a positive value.

    >>> nice(7.3), nice(0.21), nice(1.0)
    (5.0, 0.2, 1.0)
    """
    power = 10.0 ** math.floor(math.log10(value) + ROUND_NUMBER_SLACK)
    digit = max(d for d in (1.0, 2.0, 5.0) if d * power <= value * (1.0 + ROUND_NUMBER_SLACK))
    return float(f"{digit * power:.6g}")


_RAISED = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


def rounded_number(value: float) -> str:
    """A number for a label, four significant digits.

    >>> rounded_number(-8722.339), rounded_number(80.0), rounded_number(5e-7)
    ('−8722', '80', '5·10⁻⁷')
    """
    if value and not 1e-3 <= abs(value) < 1e7:
        digits, power = f"{value:.3e}".split("e")
        text = f"{float(digits):g}·10{str(int(power)).translate(_RAISED)}"
    elif abs(value) >= 1e4:  # thousands parted by thin spaces
        text = f"{float(f'{value:.4g}'):,.0f}".replace(",", "\u2009")
    else:
        text = f"{value + 0.0:.4g}"
    return text.replace("-", "−")


def framed(figure: Figure, sketch: Sketch, arrows: tuple[float, float, str] | None) -> None:
    """Add title, scale and key, and set the size of the figure."""
    unit, margin = sketch.unit, SIZE["margin"] * sketch.unit
    left, bottom = sketch.low
    right, top = sketch.high
    y = bottom - 20.0 * unit
    end = _key(sketch, left, y, right - left, arrows)
    lines = _title(sketch)
    wide = max(sketch.wide(text, size) for text, size, _ in lines)
    right = max(right, end, left + wide)
    y = top + 14.0 * unit
    for text, size, color in reversed(lines):
        look: dict[str, Any] = {"ha": "left", "va": "baseline"}
        sketch.text((left, y), Label(text, [], size=size, color=color), **look)
        y += 1.3 * size * unit
    top = y - 0.5 * SIZE["title"] * unit
    low = np.array([left, bottom - 26.0 * unit]) - margin
    high = np.array([right, top]) + margin
    axes = sketch.axes
    axes.set_xlim(low[0], high[0])
    axes.set_ylim(low[1], high[1])
    axes.set_aspect("equal")
    figure.set_size_inches(*((high - low) / unit / 72.0))


def _title(sketch: Sketch) -> list[tuple[str, float, str]]:
    """Lines (text, size, colour): the name of the mechanism, and its instant."""
    pose = sketch.pose
    width = max(330.0, (sketch.high[0] - sketch.low[0]) / sketch.unit)
    letters = int(width / (0.5 * SIZE["title"]))
    names = textwrap.wrap(pose.mechanism.name.replace("$", r"\$"), letters)
    values, units = [], pose.mechanism.shown
    for driver in pose.mechanism.drivers:
        value = float(pose.run.driven(driver.name)[0][pose.k])
        if isinstance(driver, AngleDriver):
            degrees = rounded_number(round(place_in_turn(value), 6) + 0.0)
            values.append(f"{driver.body} at {degrees}°")
        else:
            values.append(f"{driver.name} at {rounded(value, 'length', units)}")
    values.append(f"t = {rounded(pose.t, 'time', units)}")
    events = [one.name for one in pose.run.events if _nearest(pose, one.t)]
    values += list(dict.fromkeys(events))[:3]
    lines = [(name, SIZE["title"], INK) for name in names]
    return [*lines, (", ".join(values).replace("$", r"\$"), 0.9 * SIZE["text"], SOFT)]


def _nearest(pose: Pose, t: float) -> bool:
    """Whether no other instant of the run is nearer to a time, as that of an event."""
    return len(pose.run) > 1 and int(np.argmin(np.abs(pose.run.t - t))) == pose.k


def captions(sketch: Sketch) -> tuple[str, str]:
    """The name of the mechanism in one line, and its instant."""
    *names, (instant, _, _) = _title(sketch)
    return " ".join(name for name, _, _ in names), instant


def key_row(
    sketch: Sketch, axes: Any, y: float, wide: float, arrows: tuple[float, float, str] | None
) -> None:
    """Scale and key of a sketch on other axes of the same scale, from their left edge."""
    key = type(sketch)(axes, sketch.pose, sketch.unit, sketch.small)
    key.modes, key.enlarged = sketch.modes, sketch.enlarged
    _key(key, 0.0, y, wide, arrows)


def rounded(value: float, dimension: str, units: OutputUnits) -> str:
    """A value in units of the model for a label, in the unit that is shown.

    >>> from mbody.quantities.output_units import read_by_people
    >>> from mbody.quantities.units import unit_system
    >>> rounded(860220.0, "power", read_by_people(unit_system("mm-N-s")))
    '860.2 W'
    """
    return f"{rounded_number(float(units.converted(value, dimension)))} {units.of(dimension)}"


def key_size(most: float, dimension: str, units: OutputUnits) -> tuple[float, str]:
    """A round value that is not above `most`, for a scale: in units of the model, and as text."""
    size = units.size(dimension)
    value = nice(most / size) * size
    return value, rounded(value, dimension, units)


def _key(
    sketch: Sketch, x: float, y: float, wide: float, arrows: tuple[float, float, str] | None
) -> float:
    """Scale, key of the arrows and direction of gravity in a row; returns its right end."""
    unit, units = sketch.unit, sketch.pose.mechanism.shown
    length, text = key_size(max(0.22 * wide, 40.0 * unit), "length", units)
    tick = 2.5 * unit
    bar = [(x, y + tick), (x, y - tick), (x, y), (x + length, y), (x + length, y + tick)]
    sketch.line([*bar, (x + length, y - tick)], 1.0, SOFT, Z["text"], name="scale", weight=0.0)
    x = _key_text(sketch, x + length, y, text, SOFT)
    if arrows is not None:
        scale, greatest, color = arrows
        force, text = key_size(0.7 * greatest, "force", units)
        x += 14.0 * unit
        sketch.arrow((x, y), (x + scale * force, y), color, width=1.6, name="key")
        x = _key_text(sketch, x + scale * force, y, text, color)
    for load in () if sketch.kinematic else sketch.pose.mechanism.loads:
        if isinstance(load, Gravity):
            pull = np.array([sketch.pose.law(load, key) for key in "xy"])
            if pull.any():
                x += 18.0 * unit
                half = 8.0 * unit * pull / np.hypot(*pull)
                middle = np.array([x, y])
                name = f"gravity:{load.name}"
                sketch.arrow(middle - half, middle + half, LOAD, width=1.6, name=name)
                x = _key_text(sketch, x + abs(half[0]), y, "$g$", LOAD)
    return _modes(sketch, x, y)


def _modes(sketch: Sketch, x: float, y: float) -> float:
    """The marks of modes with their words, and by how much friction circles are drawn larger."""
    if sketch.enlarged != 1.0:
        x += 16.0 * sketch.unit
        size = 4.5 * sketch.unit
        sketch.disc((x, y), size, "none", FORCE, 0.9, Z["text"], name="key:circles", weight=0.0)
        words = f"friction circles {rounded_number(sketch.enlarged)} : 1"
        x = _key_text(sketch, x + size, y, words, FORCE)
    words_of = {mode: look[0] for mode, look in MODES.items()} | dict.fromkeys(SLIDES, "slides")
    names = dict.fromkeys("slip+" if mode in SLIDES else mode for mode in sketch.modes)
    for mode in names:
        x += 16.0 * sketch.unit
        mark(sketch, np.array([x, y]), mode, np.array([0.0, 1.0]), f"key:{mode}")
        gap = 3.0 * sketch.size("pin") if mode in SLIDES else sketch.size("pin")
        x = _key_text(sketch, x + gap, y, words_of[mode], SOFT)
    return x


def _key_text(sketch: Sketch, x: float, y: float, text: str, color: str) -> float:
    """A text in the key; returns its right end."""
    x += 5.0 * sketch.unit
    label = Label(text, [], size=0.9 * SIZE["text"], color=color)
    sketch.text((x, y), label, ha="left", va="center_baseline")
    return x + sketch.wide(text, label.size)


# -- Several instants beside each other, in cells of one size and one scale --------------------

#: Points: the width of a page of cells, gaps, the height of a caption.
PAGE, GAP, CAPTION = 760.0, 18.0, 18.0


def in_strip(
    figure: Figure,
    sketches: Sequence[Sketch],
    arrows: tuple[float, float, str] | None,
    texts: Sequence[str] = (),
) -> None:
    """Lay out drawings that are finished."""
    first, unit = sketches[0], sketches[0].unit
    low = np.min([sketch.low for sketch in sketches], axis=0)
    high = np.max([sketch.high for sketch in sketches], axis=0)
    wide, tall = (high - low) / unit
    columns = max(1, min(len(sketches), int((PAGE + GAP) // (wide + GAP))))
    rows = math.ceil(len(sketches) / columns)
    margin, head, foot = SIZE["margin"], 1.6 * SIZE["title"] + 8.0, 30.0
    whole = columns * wide + (columns - 1) * GAP + 2.0 * margin
    height = rows * (tall + CAPTION) + (rows - 1) * GAP + head + foot + 2.0 * margin
    title = captions(first)
    whole = max(whole, 2.0 * margin + first.wide(title[0], SIZE["title"]) / unit, 340.0)
    figure.set_size_inches(whole / 72.0, height / 72.0)
    look: dict[str, Any] = {"ha": "left", "va": "baseline"}
    y = height - margin - SIZE["title"]
    figure.text(margin / whole, y / height, title[0], size=SIZE["title"], color=INK, **look)
    for n, sketch in enumerate(sketches):
        row, column = divmod(n, columns)
        x = margin + column * (wide + GAP)
        y = height - margin - head - row * (tall + CAPTION + GAP) - CAPTION
        text = texts[n] if texts else captions(sketch)[1]
        figure.text(x / whole, (y + 5.0) / height, text, size=SIZE["text"], color=SOFT, **look)
        sketch.axes.set_position((x / whole, (y - tall) / height, wide / whole, tall / height))
        sketch.axes.set_xlim(low[0], high[0])
        sketch.axes.set_ylim(low[1], high[1])
    key = figure.add_axes((margin / whole, 0.0, 1.0 - margin / whole, foot / height), label="key")
    key.set_axis_off()
    key.set_xlim(0.0, (whole - margin) * unit)
    key.set_ylim(0.0, foot * unit)
    key_row(first, key, 0.4 * foot * unit, wide * unit, arrows)


# -- Surfaces: the paper of matplotlib, or a record of the shapes themselves -------------------


@dataclass(frozen=True)
class Look:
    """How a shape is drawn.

    `width`: Of its outline, in points.
    `edge`, `fill`: Colours of the style, or "none".
    `z`: Its layer; greater ones lie above.
    `name`: By which it is found in a figure and in an SVG file.
    `dashes`: In widths of the line.
    `halo`: Whether a line is parted by white from what lies below.
    """

    width: float
    edge: str = INK
    fill: str = "none"
    z: float = Z["link"]
    name: str = ""
    dashes: Any = "-"
    halo: bool = False


class Surface(Protocol):
    """The four shapes of which every picture is made, in the units of the mechanism."""

    carrier: Carrier
    sign_condition: tuple[str, float] | None

    def line(self, points: Array, look: Look) -> None:
        """A line through points (n, 2); NaN interrupts it."""

    def polygon(self, corners: Array, look: Look) -> None:
        """A closed outline."""

    def circle(self, centre: Array, radius: float, look: Look) -> None:
        """A circle."""

    def text(self, at: Any, label: Label, **more: Any) -> None:
        """A text at a place."""


class PaperSurface:
    """Shapes as artists on an Axes."""

    def __init__(self, axes: Any) -> None:
        self.axes: Axes = axes
        self.carrier = GROUND_CARRIER
        self.sign_condition: tuple[str, float] | None = None

    def line(self, points: Array, look: Look) -> None:
        """A line through points."""
        from matplotlib.lines import Line2D

        z = look.z
        common: dict[str, Any] = {"solid_capstyle": "round", "solid_joinstyle": "round"}
        if look.halo:
            under = Line2D(*points.T, lw=look.width + 2.4, color=PAPER, zorder=z, **common)
            self.axes.add_artist(under)
        drawn = Line2D(
            *points.T, lw=look.width, color=look.edge, ls=look.dashes, zorder=z, **common
        )
        self._keep(drawn, look.name)
        self.axes.add_artist(drawn)

    def polygon(self, corners: Array, look: Look) -> None:
        """A closed outline, filled."""
        from matplotlib.patches import Polygon

        colors: dict[str, Any] = {"fc": look.fill, "ec": look.edge, "lw": look.width}
        drawn = Polygon(corners, closed=True, zorder=look.z, joinstyle="round", **colors)
        self._keep(drawn, look.name)
        self.axes.add_artist(drawn)

    def circle(self, centre: Array, radius: float, look: Look) -> None:
        """A circle of a radius in the units of the mechanism."""
        from matplotlib.patches import Circle

        colors: dict[str, Any] = {"fc": look.fill, "ec": look.edge, "lw": look.width}
        place = float(centre[0]), float(centre[1])
        drawn = Circle(place, radius, zorder=look.z, ls=look.dashes, **colors)
        self._keep(drawn, look.name)
        self.axes.add_artist(drawn)

    def text(self, at: Any, label: Label, **more: Any) -> None:
        """A text at a place, on white where it covers something."""
        low = below_line(label.text, label.size, label.italic)
        drawn = self.axes.text(
            float(at[0]),
            float(at[1]),
            drawable(label.text),
            **{
                "size": label.size,
                "color": label.color,
                "style": "italic" if label.italic else "normal",
                "ha": "center",
                # matplotlib leaves room below the line also where nothing is below it
                "va": "center" if low else "center_baseline",
                "zorder": Z["text"],
                **more,
            },
        )
        if label.covers:
            drawn.set_bbox({"fc": PAPER, "ec": "none", "alpha": 0.8, "pad": 0.6})
        self._keep(drawn, label.name)

    def _keep(self, artist: Any, name: str) -> None:
        """A name by which the artist is found in the figure and in an SVG file."""
        artist.set_clip_on(False)  # nothing lies outside, and files are shorter without
        if name:
            artist.set_gid(name)


@dataclass
class Rail:
    """A line of the ground that sliders or wheels run on, from one end to the other."""

    start: Array
    end: Array
    name: str


class Sketch:
    """Shapes on an Axes, obstacles of labels, and the limits of the drawing.

    `pose`: The instant that is drawn.
    `unit`: Length of a point (1/72 in) in the units of the mechanism.
    `small`: Factor by which symbols are smaller, where the links are short.
    `kinematic`: Whether loads and mass centres are left out.
    """

    #: Whether the whole motion is drawn, not one instant of it.
    lasting = False
    kinematic = False

    def __init__(
        self, axes: Any, pose: Pose, unit: float, small: float, surface: Surface | None = None
    ) -> None:
        self.axes, self.pose, self.unit, self.small = axes, pose, unit, small
        self.surface: Surface = surface or PaperSurface(axes)
        self.places = FreePlaces(unit)
        self.labels: list[Label] = []
        self.pins: list[tuple[Array, list[str]]] = []
        # the numbers of pins by squares as wide as one hides another
        self.pin_cells: dict[tuple[float, float], list[int]] = {}
        self.supports: list[Array] = []
        self.blocks: list[tuple[Array, float]] = []
        self.arcs: list[Array] = []
        self.rails: list[Rail] = []
        self.edges: dict[str, Array] = {}
        self.centres: list[Array] = []
        self.low, self.high = np.full(2, np.inf), np.full(2, -np.inf)
        #: Length of a unit of force; how much larger friction circles are drawn; modes that have
        #: marks: for the key.
        self.force_scale, self.enlarged = 0.0, 1.0
        self.modes: list[str] = []

    def size(self, name: str) -> float:
        """A size of the style, in the units of the mechanism."""
        return SIZE[name] * self.small * self.unit

    # -- carriers of shapes --------------------------------------------------------------------

    @contextmanager
    def carried(self, carrier: Carrier) -> Iterator[None]:
        """Context whose drawings move with a body, or between two; a picture of one instant does
        not need it, one of the whole motion does.
        """
        before, self.surface.carrier = self.surface.carrier, carrier
        try:
            yield
        finally:
            self.surface.carrier = before

    @contextmanager
    def where_sign(self, quantity: str, sign: float) -> Iterator[None]:
        """Context whose drawings are shown while a quantity has that sign, in a moving picture;
        always where it is "".
        """
        before = self.surface.sign_condition
        self.surface.sign_condition = (quantity, sign) if quantity else None
        try:
            yield
        finally:
            self.surface.sign_condition = before

    # -- shapes -------------------------------------------------------------------------------

    def line(
        self,
        points: Any,
        width: float = 1.2,
        color: str = INK,
        z: float = Z["link"],
        *,
        name: str = "",
        dashes: Any = "-",
        weight: float = 1.0,
        halo: bool = False,
    ) -> None:
        """A line through points; labels keep clear of it by its `weight`."""
        points = np.asarray(points, dtype=float)
        look = Look(width=width, edge=color, z=z, name=name, dashes=dashes, halo=halo)
        self.surface.line(points, look)
        self._seen(points)
        if weight:
            self.places.stroke(points, 0.5 * width * self.unit, weight)

    def strokes(self, lines: list[Array], z: float, weight: float = 0.6) -> None:
        """Thin lines of the ground, as one artist."""
        gap = np.full((1, 2), np.nan)
        whole = np.vstack([part for line in lines for part in (line, gap)])
        self.line(whole, 0.7, GROUND, z, weight=0.0)
        for line in lines:
            self.places.stroke(line, 0.35 * self.unit, weight)

    def shape(
        self,
        corners: Any,
        fill: str = LINK,
        edge: str = INK,
        width: float = 1.1,
        z: float = Z["link"],
        *,
        name: str = "",
        weight: float = 1.0,
    ) -> None:
        """A closed outline, filled."""
        corners = np.asarray(corners, dtype=float)
        self.surface.polygon(corners, Look(width=width, edge=edge, fill=fill, z=z, name=name))
        self._seen(corners)
        if weight:
            self.places.stroke(np.vstack([corners, corners[:1]]), 0.5 * width * self.unit, weight)

    def disc(
        self,
        centre: Any,
        radius: float,
        fill: str = PAPER,
        edge: str = INK,
        width: float = 1.2,
        z: float = Z["pin"],
        *,
        name: str = "",
        dashes: Any = "-",
        weight: float = 1.0,
    ) -> None:
        """A circle of a radius in the units of the mechanism."""
        look = Look(width=width, edge=edge, fill=fill, z=z, name=name, dashes=dashes)
        self.surface.circle(np.asarray(centre, dtype=float), radius, look)
        self._seen(np.array([np.asarray(centre) - radius, np.asarray(centre) + radius]))
        if weight:
            outline = arc(centre, radius, 0.0, math.tau)
            if radius < 8.0 * self.unit:
                outline = np.array([centre, centre], dtype=float)
                self.places.stroke(outline, radius, 5.0 * weight)
            else:
                self.places.stroke(outline, 0.5 * width * self.unit, weight)

    def arrow(self, tail: Any, tip: Any, color: str, *, width: float = 1.9, name: str = "") -> None:
        """A straight arrow with a filled head."""
        tail, tip = np.asarray(tail, dtype=float), np.asarray(tip, dtype=float)
        length = math.hypot(*(tip - tail))
        head = min(8.0 * self.unit, 0.6 * length)
        u = (tip - tail) / max(length, TINY)
        self.line([tail, tip - 0.8 * head * u], width, color, Z["arrow"], name=name, halo=True)
        self._head(tip, u, head, color, name and f"{name}.head")

    def curved(
        self, centre: Any, radius: float, start: float, end: float, color: str, *, name: str = ""
    ) -> None:
        """An arrow on an arc from one angle to another [rad]."""
        self.bent(arc(centre, radius, start, end), color, name=name)

    def bent(self, line: Array, color: str, *, name: str = "") -> None:
        """An arrow along a line of many points, its head at the last."""
        steps = np.hypot(*np.diff(line, axis=0).T)
        length = np.concatenate([[0.0], np.cumsum(steps)])
        head = min(7.5 * self.unit, 0.5 * length[-1])

        def at(distance: float) -> Array:
            return np.array([np.interp(distance, length, part) for part in line.T])

        end = length[-1] - 0.8 * head
        shaft = np.vstack([line[length < end], at(end)])
        self.line(shaft, 1.7, color, Z["arrow"], name=name, halo=True)
        # the head lies along the chord of its own length, so that it does not protrude
        tip, back = line[-1], at(length[-1] - head)
        u = (tip - back) / max(math.hypot(*(tip - back)), TINY)
        self._head(tip, u, head, color, name and f"{name}.head")

    def _head(self, tip: Array, u: Array, head: float, color: str, name: str) -> None:
        n = np.array([-u[1], u[0]])
        corners = [tip, tip - head * u + 0.38 * head * n, tip - head * u - 0.38 * head * n]
        self.shape(corners, color, color, 0.4, Z["arrow"] + 0.1, name=name)

    # -- parts of every mechanism --------------------------------------------------------------

    def pin(self, place: Array, label: str) -> None:
        """A pin; several at one place are drawn once, with all their names."""
        spacing = 0.5 * self.size("pin")
        column, row = float(place[0] // spacing), float(place[1] // spacing)
        cells = [(column + i, row + j) for i in (-1, 0, 1) for j in (-1, 0, 1)]
        for n in sorted(n for cell in cells for n in self.pin_cells.get(cell, ())):
            other, names = self.pins[n]
            if np.hypot(*(other - place)) < spacing:
                if label and label not in names:
                    names.append(label)
                return
        self.pin_cells.setdefault((column, row), []).append(len(self.pins))
        self.pins.append((place, [label] if label else []))
        self.disc(place, self.size("pin"), name=f"pin:{label}")

    def support(self, place: Array, others: list[Array], name: str) -> None:
        """The ground below a pin: a triangle on a hatched line, on the side with the most
        free space.
        """
        if any(np.hypot(*(place - there)) < self.size("pin") for there in self.supports):
            return
        self.supports.append(place)
        height = self.size("support")
        down = self.roomy(place, others)
        u, n = direction(down), direction(down + math.pi / 2.0)
        foot = place + height * u
        corners = [place, foot + 0.62 * height * n, foot - 0.62 * height * n]
        self.shape(corners, PAPER, GROUND, 1.1, Z["ground"], name=f"support:{name}")
        self.ground(foot - 0.95 * height * n, foot + 0.95 * height * n)

    def rail(self, start: Array, end: Array, name: str, margin: float = 0.0) -> None:
        """A line of the ground, drawn with all those that lie on one line with it and are not
        farther from it than `margin`, as one.
        """
        u = (end - start) / max(float(np.hypot(*(end - start))), TINY)
        for old in self.rails:
            v = (old.end - old.start) / max(float(np.hypot(*(old.end - old.start))), TINY)
            aside = abs(float(v[0] * (start - old.start)[1] - v[1] * (start - old.start)[0]))
            if u @ v < 1.0 - 1e-9 or aside > 0.3 * self.unit:
                continue
            first, last = float((start - old.start) @ v), float((end - old.start) @ v)
            length = float((old.end - old.start) @ v)
            if first <= length + margin and last >= -margin:
                old.start, old.end = (
                    old.start + min(first, 0.0) * v,
                    old.start + max(last, length) * v,
                )
                return
        self.rails.append(Rail(start, end, name))

    def lay(self) -> None:
        """Draw the rails."""
        for rail in self.rails:
            self.ground(rail.start, rail.end, name=rail.name)

    def roomy(self, place: Array, others: list[Array]) -> float:
        """Down, up, left or right [rad]: down, unless links lie there and another side is free."""
        offsets = [other - place for other in unique(others, self.unit)]
        offsets = [
            offset / np.hypot(*offset) for offset in offsets if np.hypot(*offset) > self.unit
        ]
        lines = [math.atan2(offset[1], offset[0]) for offset in offsets]
        # a plate lies between its corners
        inside = np.sum(offsets, axis=0) if len(offsets) > 1 else np.zeros(2)

        def crowd(angle: float) -> float:
            between = max(0.0, float(inside @ direction(angle)))
            return sum(max(0.0, math.cos(line - angle) - 0.6) for line in lines) + 0.3 * between

        choices = {-math.pi / 2.0: 0.0, math.pi / 2.0: 0.2, math.pi: 0.3, 0.0: 0.3}
        return min(choices, key=lambda angle: round(crowd(angle) + choices[angle], 3))

    def ground(self, start: Any, end: Any, *, name: str = "") -> None:
        """A line of the ground, hatched on its right."""
        self.line([start, end], 1.3, GROUND, Z["ground"], name=name)
        depth = SIZE["hatch"] * self.small * self.unit
        self.strokes(hatching(start, end, depth, 1.05 * depth), Z["ground"])

    def block(self, place: Array, angle: float, name: str) -> None:
        """A slider."""
        half = self.size("block")
        corners = box(place, half, 0.6 * half, angle)
        self.blocks.append((place, angle))
        ends = np.array(
            [place - 0.4 * half * direction(angle), place + 0.4 * half * direction(angle)]
        )
        self.places.stroke(ends, 0.6 * half, 3.0)
        self.shape(corners, LINK, INK, 1.1, Z["block"], name=f"block:{name}")

    # -- labels -------------------------------------------------------------------------------

    def label(
        self,
        text: str,
        anchor: Any,
        wanted: float,
        gap: float,
        *,
        rotation_cost: float = 1.0,
        **look: Any,
    ) -> Label:
        """A text near a point, best in the direction `wanted` [rad], at least `gap` from it."""
        made = Label(text, [], **look)
        width, height = (self.unit * part for part in FreePlaces.measured(made))
        made.spots = places_around(anchor, (width, height), gap, wanted, rotation_cost)
        self.labels.append(made)
        return made

    def write(self) -> None:
        """Place all labels and write them."""
        self.places.set(self.labels)
        for label in self.labels:
            self.text(label.at, label)
            width, height = (self.unit * part for part in FreePlaces.measured(label))
            half = 0.5 * np.array([width, height])
            self._seen(np.array([label.at - half, label.at + half]))

    def text(self, at: Any, label: Label, **more: Any) -> None:
        """A text at a place, on white where it covers something."""
        self.surface.text(at, label, **more)

    def wide(self, text: str, size: float) -> float:
        """The width of a text in the units of the mechanism."""
        return self.unit * extent(text, size)[0]

    def _seen(self, points: Array) -> None:
        self.low = np.fmin(self.low, np.nanmin(points, axis=0))
        self.high = np.fmax(self.high, np.nanmax(points, axis=0))


# -- Drawings kept as plain shapes in the axes of their carriers -------------------------------

#: Instants at which the sides of a support are looked at.
SIDES = 25
#: With more bodies than this arcs and names are not kept clear of what is drawn.
CROWDED = 60


@dataclass(frozen=True)
class KeptShape:
    """One shape in the axes of its carrier.

    `kind`: "line", "polygon" or "circle".
    `points` (n, 2) (n, 3): Of a circle its centre.
    `radius`: Of a circle.
    `sign_condition`: The shape is there while the quantity has that sign.
    """

    kind: str
    carrier: Carrier
    points: Array
    look: Look
    radius: float = 0.0
    sign_condition: tuple[str, float] | None = None


@dataclass
class KeptLabel:
    """A name near a place that moves.

    `anchor` (1, 2) (1, 3): In the axes of the carrier.
    `direction` (2,): Unit vector from the anchor to the name; (0, 0) where it is written on the
      anchor.
    `turns`: Whether the direction turns with the carrier.
    `gap`: Least distance.
    """

    text: str
    carrier: Carrier
    anchor: Array
    direction: Array
    gap: float
    kind: str
    of: str
    color: str
    italic: bool = False
    rotates: bool = False


@dataclass
class ShapeRecord:
    """A surface that keeps what is drawn on it."""

    pose: Pose
    carrier: Carrier = GROUND_CARRIER
    sign_condition: tuple[str, float] | None = None
    shapes: list[KeptShape] = field(default_factory=list)

    def line(self, points: Array, look: Look) -> None:
        """A line through points."""
        self._keep("line", points, look)

    def polygon(self, corners: Array, look: Look) -> None:
        """A closed outline."""
        self._keep("polygon", corners, look)

    def circle(self, centre: Array, radius: float, look: Look) -> None:
        """A circle."""
        self._keep("circle", centre[None], look, radius)

    def text(self, at: Any, label: Label, **more: Any) -> None:
        """Texts are kept by the sketch, with what they name."""

    def _keep(self, kind: str, points: Array, look: Look, radius: float = 0.0) -> None:
        kept = self.carrier.kept(points, self.pose)
        self.shapes.append(KeptShape(kind, self.carrier, kept, look, radius, self.sign_condition))


class _Anywhere(FreePlaces):
    """No place is taken: with many bodies the search for free ones would take minutes."""

    def stroke(self, line: Array, half: float, weight: float = 1.0) -> None:
        """Forget a line."""


class SceneSketch(Sketch):
    """A sketch whose shapes and names are kept for the whole motion."""

    lasting = True

    def __init__(self, pose: Pose, unit: float, small: float) -> None:
        self.record = ShapeRecord(pose)
        super().__init__(None, pose, unit, small, self.record)
        if len(pose.mechanism.bodies) > CROWDED:
            self.places = _Anywhere(unit)
        self.names: list[KeptLabel] = []
        self.pinned: list[tuple[Array, list[str], Carrier]] = []

    def label(
        self,
        text: str,
        anchor: Any,
        wanted: float,
        gap: float,
        *,
        rotation_cost: float = 1.0,
        **look: Any,
    ) -> Label:
        """A name at a place that moves; its number, which would change, is left out."""
        carrier, place = self.record.carrier, np.asarray(anchor, dtype=float)
        name = text.partition(" = ")[0]
        outward = np.array([np.cos(wanted), np.sin(wanted)])
        kept = carrier.kept(place[None], self.pose)
        color, italic = str(look.get("color", "")), bool(look.get("italic", False))
        owner = str(look.get("name", "")) or name
        self.names.append(
            KeptLabel(name, carrier, kept, outward, gap, "element", owner, color, italic)
        )
        return Label(name, [])

    def roomy(self, place: Array, others: list[Array]) -> float:
        """Down, up, left or right [rad], the side on which the links are least in the whole
        motion.
        """
        pose = self.pose
        bodies = [name for name, nodes in pose.nodes.items() if nodes is others]
        if not bodies:
            return super().roomy(place, others)
        u, v = on(bodies[0]).kept(np.array(others).reshape(-1, 2), pose).T[:, :, None]
        instants = sorted({round(k) for k in np.linspace(0, len(pose.run) - 1, SIDES)})
        body = pose.body(bodies[0])
        c, s = np.cos(body.angle[instants]), np.sin(body.angle[instants])
        dx = body.x[instants] + c * u - s * v - place[0]  # (nodes, instants)
        dy = body.y[instants] + s * u + c * v - place[1]
        length = np.hypot(dx, dy)
        choices = {-math.pi / 2.0: 0.0, math.pi / 2.0: 0.2, math.pi: 0.3, 0.0: 0.3}

        def crowd(angle: float) -> float:
            along = (dx * math.cos(angle) + dy * math.sin(angle)) / np.maximum(length, TINY)
            return float((np.maximum(0.0, along - 0.6) * (length > self.unit)).mean(axis=1).sum())

        return min(choices, key=lambda angle: round(crowd(angle) + choices[angle], 3))

    def pin(self, place: Array, label: str) -> None:
        """A pin; several that are at one place in the whole motion are drawn once."""
        before = len(self.pins)
        super().pin(place, label)
        if len(self.pins) > before:
            self.pinned.append((*self.pins[-1], self.record.carrier))
