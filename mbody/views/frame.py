"""The frame of a drawing: title, instant, scale, key of the arrows, and the figure's size."""

from __future__ import annotations

import math
import textwrap
from typing import TYPE_CHECKING, Any

import numpy as np

from mbody.model.driver import AngleDriver
from mbody.model.loads import Gravity
from mbody.views.labels import Label
from mbody.views.mode_bars import MODES
from mbody.views.mode_marks import mark
from mbody.views.style import FORCE, INK, LOAD, SIZE, SOFT, Z

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from mbody.views.pose import Pose
    from mbody.views.sketch import Sketch

__all__ = ["captions", "framed", "key_row", "nice", "rounded_number"]

Array = np.ndarray

#: Modes that have one word in the key of a picture, where the mark has the way.
SLIDES = ("slip+", "slip-")


def nice(value: float) -> float:
    """The greatest of 1, 2, 5, 10, 20 … that is not above a positive value.

    >>> nice(7.3), nice(0.21), nice(1.0)
    (5.0, 0.2, 1.0)
    """
    power = 10.0 ** math.floor(math.log10(value) + 1e-9)
    digit = max(d for d in (1.0, 2.0, 5.0) if d * power <= value * (1.0 + 1e-9))
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
    """Add title, scale and key, and set the size of the figure.

    Parameters
    ----------
    figure : matplotlib.figure.Figure
    sketch : Sketch
        Everything else is drawn on it.
    arrows : (length of a unit of force, greatest force, colour), optional
        The scale of the arrows; None where there are none.
    """
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
    values = []
    for driver in pose.mechanism.drivers:
        value = float(pose.run.driven(driver.name)[0][pose.k])
        if isinstance(driver, AngleDriver):
            degrees = math.degrees(value)
            values.append(f"{driver.body} at {rounded_number(round(degrees, 6) + 0.0)}°")
        else:
            length = pose.mechanism.units.of("length")
            values.append(f"{driver.name} at {rounded_number(value)} {length}")
    values.append(f"t = {rounded_number(pose.t)} {pose.mechanism.units.of('time')}")
    near = [one.name for one in pose.run.events if _nearest(pose, one.t)]
    values += list(dict.fromkeys(near))[:3]
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


def _key(
    sketch: Sketch, x: float, y: float, wide: float, arrows: tuple[float, float, str] | None
) -> float:
    """Scale, key of the arrows and direction of gravity in a row; returns its right end."""
    unit, units = sketch.unit, sketch.pose.mechanism.units
    length = nice(max(0.22 * wide, 40.0 * unit))
    tick = 2.5 * unit
    bar = [(x, y + tick), (x, y - tick), (x, y), (x + length, y), (x + length, y + tick)]
    sketch.line([*bar, (x + length, y - tick)], 1.0, SOFT, Z["text"], name="scale", weight=0.0)
    x = _key_text(sketch, x + length, y, f"{rounded_number(length)} {units.of('length')}", SOFT)
    if arrows is not None:
        scale, greatest, color = arrows
        force = nice(0.7 * greatest)
        x += 14.0 * unit
        sketch.arrow((x, y), (x + scale * force, y), color, width=1.6, name="key")
        x = _key_text(
            sketch, x + scale * force, y, f"{rounded_number(force)} {units.of('force')}", color
        )
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
    shown = dict.fromkeys("slip+" if mode in SLIDES else mode for mode in sketch.modes)
    for mode in shown:
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
