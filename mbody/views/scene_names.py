"""Where names stand in a moving picture: the places that are free in most of the motion."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from mbody.views.carriers import Carrier, on
from mbody.views.labels import together
from mbody.views.links import places
from mbody.views.record import KeptLabel, KeptShape
from mbody.views.shapes import direction, hull, unique
from mbody.views.style import INK, SIZE

if TYPE_CHECKING:
    from mbody.solution.solution import Solution
    from mbody.views.record import SceneSketch

__all__ = ["named"]

Array = np.ndarray

#: With more bodies than this there are no names: they would hide the mechanism.
NAMED = 24
#: Directions of a name from its place, and instants at which they are tried.
AROUND, TRIED = 16, 9
#: Width of a letter, in parts of the height of the text.
LETTER = 0.55


def named(sketch: SceneSketch, shapes: Sequence[KeptShape]) -> list[KeptLabel]:
    """The names of pins, elements and links, each at its best place."""
    run = sketch.pose.run
    if len(run.mechanism.bodies) > NAMED:
        return []
    labels = [*_pins(sketch), *sketch.names]
    instants = sorted({round(k) for k in np.linspace(0, len(run) - 1, TRIED)})
    lines = _obstacles(run, shapes, instants, 0.35 * SIZE["text"] * sketch.unit)
    taken: list[tuple[Array, Array]] = []
    for label in labels:
        _turn(label, sketch, lines, taken, instants)
    for body in run.mechanism.bodies:
        labels.append(_of_link(sketch, body.name, lines, taken, instants))
    return labels


def _pins(sketch: SceneSketch) -> list[KeptLabel]:
    found = []
    for place, names, carrier in sketch.pinned:
        if names:
            anchor = carrier.kept(place[None], sketch.pose.run, sketch.pose.k)
            way = direction(0.5 * math.pi)
            gap = sketch.size("pin") + 1.5 * sketch.unit
            of = f"pin:{names[0]}"
            kept = KeptLabel(together(names), carrier, anchor, way, gap, "pin", of, INK, True)
            found.append(kept)
    return found


def _dotted(line: Array, step: float) -> Array:
    """Points on a line, about a step apart."""
    parts = [line[:1]]
    for a, b in itertools.pairwise(line):
        if not np.isfinite(a + b).all():
            continue  # an interrupted line
        count = min(int(np.hypot(*(b - a)[-2:]) / step) + 1, 60) if len(a) == 2 else 5
        parts.append(a + (b - a) * (np.arange(1, count + 1) / count)[:, None])
    dotted = np.concatenate(parts)
    return np.asarray(dotted[np.isfinite(dotted).all(axis=1)])


def _obstacles(
    run: Solution, shapes: Sequence[KeptShape], instants: Sequence[int], step: float
) -> Array:
    """Points on every outline: (instants, points, 2)."""
    axes: dict[Carrier, tuple[Array, Array, Array]] = {}
    found = []
    for shape in shapes:
        if shape.kind == "circle" and len(shape.points) == 1:
            ring = np.array([direction(a) for a in np.linspace(0.0, math.tau, 33)])
            if shape.carrier.stretches:
                continue
            kept = shape.points + shape.radius * ring
        else:
            kept = shape.points
            if shape.kind == "polygon":
                kept = np.vstack([kept, kept[:1]])
            kept = _dotted(kept, step)
        if not len(kept):
            continue
        if shape.carrier not in axes:
            axes[shape.carrier] = shape.carrier.axes(run)
        own = axes[shape.carrier]
        found.append(np.array([shape.carrier.shown(kept, own, k) for k in instants]))
    return np.concatenate(found, axis=1) if found else np.zeros((len(instants), 0, 2))


def _extent(sketch: SceneSketch, text: str) -> Array:
    """Half the width and height of a name, about."""
    letters = len(text.replace("$", "").replace("_", "").replace("{", "").replace("}", ""))
    size = SIZE["text"] * sketch.unit
    return 0.5 * np.array([LETTER * size * max(letters, 1) + 0.3 * size, 0.9 * size])


def _cost(middles: Array, half: Array, lines: Array, taken: Sequence[tuple[Array, Array]]) -> float:
    """How much a name (instants, 2) would cover."""
    away = np.abs(lines - middles[:, None, :])
    inside = (away < half * 1.05).all(axis=2)
    total = 0.25 * float(inside.sum()) / len(middles)
    for other, size in taken:
        over = (np.abs(other - middles) < half + size).all(axis=1)
        total += 20.0 * float(over.mean())
    return total


def _turn(
    label: KeptLabel,
    sketch: SceneSketch,
    lines: Array,
    taken: list[tuple[Array, Array]],
    instants: Sequence[int],
) -> None:
    """Turn a name about its place to where it covers least."""
    axes = label.carrier.axes(sketch.pose.run)
    anchors = np.array([label.carrier.shown(label.anchor, axes, k)[0] for k in instants])
    half = _extent(sketch, label.text)
    first, best = math.atan2(label.way[1], label.way[0]), np.inf
    chosen, at = label.way, anchors
    for n in range(AROUND):
        angle = first + math.tau * n / AROUND
        u = direction(angle)
        reach = label.gap + min(half[0] / max(abs(u[0]), 1e-9), half[1] / max(abs(u[1]), 1e-9))
        middles = anchors + reach * u
        cost = _cost(middles, half, lines, taken) + 0.6 * (1.0 - math.cos(angle - first))
        if round(cost, 6) < best:
            best, chosen, at = round(cost, 6), u, middles
    label.way = chosen
    taken.append((at, half))


def _of_link(
    sketch: SceneSketch,
    body: str,
    lines: Array,
    taken: list[tuple[Array, Array]],
    instants: Sequence[int],
) -> KeptLabel:
    """The name of a link beside one of its edges, which it turns with."""
    carrier, pose = on(body), sketch.pose
    nodes = unique(places(sketch, body), 0.5 * sketch.size("pin"))
    half = _extent(sketch, body)
    if len(nodes) < 2:
        place = np.array([nodes[0] if nodes else pose.centre(body)])
        anchor = carrier.kept(place, pose.run, pose.k)
        gap = 0.9 * sketch.size("block")
        way = direction(-0.5 * math.pi)
        label = KeptLabel(body, carrier, anchor, way, gap, "link", f"link:{body}", INK)
        _turn(label, sketch, lines, taken, instants)
        return label
    corners = carrier.kept(hull(nodes, 1e-3 * sketch.size("link")), pose.run, pose.k)
    axes = carrier.axes(pose.run)
    gap = sketch.size("link") + 1.5 * sketch.unit
    options = []
    for a, b in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        u = (b - a) / max(float(np.hypot(*(b - a))), 1e-300)
        for part in (0.5, 0.35, 0.65):
            options.append((a + part * (b - a), np.array([u[1], -u[0]]), abs(part - 0.5)))
    if len(corners) > 2:
        options.append((corners.mean(axis=0), np.zeros(2), -0.2))
    best, chosen = np.inf, options[0]
    at = np.zeros((len(instants), 2))
    for option in options:
        spot, normal, cost = option
        middles = []
        for k in instants:
            place = carrier.shown(spot[None], axes, k)[0]
            n = carrier.shown(normal[None], axes, k)[0] - axes[0][k]
            middles.append(place + n * (gap * normal.any() + float(half @ np.abs(n))))
        whole = _cost(np.array(middles), half, lines, taken) + cost
        if round(whole, 6) < best:
            best, chosen, at = round(whole, 6), option, np.array(middles)
    taken.append((at, half))
    return KeptLabel(
        body,
        carrier,
        chosen[0][None],
        chosen[1],
        gap,
        "link",
        f"link:{body}",
        INK,
        turns=True,
    )
