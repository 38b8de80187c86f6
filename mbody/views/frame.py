"""The frame of a drawing: title, instant, scale, key of the arrows, and the figure's size."""

from __future__ import annotations

import math
import textwrap
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from mbody.core.tolerances import ROUND_NUMBER_SLACK
from mbody.model.driver import AngleDriver
from mbody.model.loads import Gravity
from mbody.quantities.evaluate import place_in_turn
from mbody.summaries.text_table import cut
from mbody.views.labels import Label, extent
from mbody.views.pose import heading
from mbody.views.shapes import box
from mbody.views.style import DRIVER, FORCE, INK, LOAD, PAPER, SIZE, SOFT, Z

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from mbody.quantities.output_units import OutputUnits
    from mbody.solution.solution import Solution
    from mbody.views.pose import Pose
    from mbody.views.sketch import Sketch


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
