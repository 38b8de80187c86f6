"""Centrodes, inflection circles and circles of curvature in a drawing."""

from __future__ import annotations

import itertools
import math
from typing import TYPE_CHECKING

import numpy as np

from mbody.engineering.instant_centres import centrodes
from mbody.engineering.path_curvature import inflection_circle, path_curvature
from mbody.views.frame import rounded_number
from mbody.views.labels import symbolic
from mbody.views.style import DRIVE, LOAD, POLE, SOFT, Z

if TYPE_CHECKING:
    from mbody.solution.solution import Solution
    from mbody.views.sketch import Sketch

__all__ = ["mark_centrodes", "mark_curvature", "mark_inflection"]

Array = np.ndarray

DASHES = (0, (8, 2, 1.5, 2))
#: Of a circle of curvature, how much is drawn to each side [rad], and of its radius at most in
#: parts of the picture.
ARC, LARGE = 0.9, 1.2


def mark_centrodes(sketch: Sketch, whole: Solution, body: str, corners: Array) -> None:
    """The fixed and the moving centrode of a body over a motion, as far as the picture reaches."""
    pose = sketch.pose
    found = centrodes(whole, body)
    turned = np.exp(1j * pose.angle(body))
    moving = complex(*pose.centre(body)) + turned * (found.moving_x + 1j * found.moving_y)
    fixed = found.fixed_x + 1j * found.fixed_y
    for name, curve, color in (("fixed", fixed, POLE), ("moving", moving, LOAD)):
        line = _within(np.column_stack([curve.real, curve.imag]), corners)
        if np.isfinite(line[:, 0]).sum() < 2:
            continue
        dashes = "-" if name == "fixed" else (0, (5, 2))
        sketch.line(
            line, 1.1, color, Z["path"] + 0.1, dashes=dashes, weight=0.0, name=f"{name}:{body}"
        )
        _avoided(sketch, line)
        inside = line[np.isfinite(line[:, 0])]
        end = inside[int(np.argmax(inside[:, 1]))]
        sketch.label(f"{name} centrode", end, 0.5 * math.pi, 3.0 * sketch.unit, color=color)


def mark_inflection(sketch: Sketch, body: str, corners: Array) -> str:
    """The inflection circle of a body as far as the picture reaches, with its instant centre P and
    its inflection pole J; a sentence about it.
    """
    k, run = sketch.pose.k, sketch.pose.run
    found = inflection_circle(run, body)
    pole = np.array([found.pole_x[k], found.pole_y[k]])
    other = np.array([found.x[k], found.y[k]])
    diameter = float(found.diameter[k])
    if not np.isfinite(diameter):
        return f"{body} does not turn there: its inflection circle is a line at infinity"
    size = f"{rounded_number(diameter)} {sketch.pose.mechanism.units.of('length')}"
    words = f"inflection circle of {body}: diameter {size}"
    line = _within(_circle(0.5 * (pole + other), 0.5 * diameter), corners)
    if np.isfinite(line).any():
        sketch.line(
            line, 1.1, DRIVE, Z["path"] + 0.2, name=f"inflection:{body}", weight=0.0, dashes=DASHES
        )
        _avoided(sketch, line)
    dot = 0.5 * sketch.size("pin")
    for place, text in ((pole, "P"), (other, "J")):
        if ((place < corners[0]) | (place > corners[1])).any():
            at = ", ".join(rounded_number(float(part)) for part in place)
            words += f", the {'instant centre' if text == 'P' else 'inflection pole'} at ({at})"
            continue
        sketch.disc(place, dot, DRIVE, DRIVE, 0.5, Z["pin"] + 0.3, name=f"{text}:{body}")
        away = place - 0.5 * (pole + other)
        sketch.label(
            f"${text}$", place, math.atan2(away[1], away[0]), dot + 3.0 * sketch.unit, color=DRIVE
        )
    return words


def mark_curvature(sketch: Sketch, point: str, corners: Array) -> str:
    """The circle of curvature of the path of a point, and its radius; a sentence about it."""
    k, run = sketch.pose.k, sketch.pose.run
    found = path_curvature(run, point)
    place = sketch.pose.point(point)
    radius, bend = float(found.radius[k]), float(found.curvature[k])
    if not np.isfinite(bend):
        return f"{point} stands still: its path has a cusp, or ends, there"
    if not np.isfinite(found.centre_x[k]):
        return f"the path of {point} is straight there (a point of inflection, or a line)"
    unit = sketch.pose.mechanism.units.of("length")
    words = f"path of {point}: radius of curvature {rounded_number(radius)} {unit}"
    centre = np.array([found.centre_x[k], found.centre_y[k]])
    wide = float(np.hypot(*(corners[1] - corners[0])))
    about = math.atan2(*(place - centre)[::-1])
    reach = min(ARC, 0.25 * wide / radius)
    angles = np.linspace(about - reach, about + reach, 61)
    line = centre + radius * np.column_stack([np.cos(angles), np.sin(angles)])
    sketch.line(line, 1.3, LOAD, Z["path"] + 0.3, name=f"curvature:{point}", weight=0.5)
    if radius > LARGE * wide:
        return f"{words}, its centre outside this picture"
    sketch.line(
        [place, centre],
        0.8,
        SOFT,
        Z["path"] + 0.2,
        dashes=(0, (3, 2)),
        weight=0.3,
        name=f"radius:{point}",
    )
    sketch.disc(
        centre, 0.45 * sketch.size("pin"), LOAD, LOAD, 0.4, Z["pin"] + 0.1, name=f"centre:{point}"
    )
    away = centre - place
    name = symbolic(point.partition(".")[2] or point).strip("$")
    text = f"$C_{{{name}}}$" if len(name) == 1 else f"centre of {point}"
    sketch.label(text, centre, math.atan2(away[1], away[0]), 4.0 * sketch.unit, color=LOAD)
    return words


def _circle(centre: Array, radius: float) -> Array:
    """A circle in steps that stay fine where only a part of a large one is seen."""
    angles = np.linspace(0.0, 2.0 * math.pi, 2881)
    return np.asarray(centre + radius * np.column_stack([np.cos(angles), np.sin(angles)]))


def _within(line: Array, corners: Array) -> Array:
    """A line without what lies outside a rectangle."""
    outside = ((line < corners[0]) | (line > corners[1])).any(axis=1)
    return np.where(outside[:, None], np.nan, line)


def _avoided(sketch: Sketch, line: Array) -> None:
    """Let labels keep clear of a line with gaps."""
    for a, b in itertools.pairwise(line[:: max(1, len(line) // 360)]):
        if np.isfinite([a, b]).all():
            sketch.places.stroke(np.array([a, b]), 0.5 * sketch.unit, 0.4)
