"""The force polygon of a free body: its forces tip to tail, back to the start."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from mbody.views.acting import ROUNDING
from mbody.views.frame import rounded_number
from mbody.views.labels import Label
from mbody.views.pose import heading
from mbody.views.style import PAPER, SIZE, Z

if TYPE_CHECKING:
    from collections.abc import Sequence

    from mbody.analysis.driven.free_body import FreeBody
    from mbody.views.acting import Acting
    from mbody.views.sketch import Sketch

__all__ = ["closing_words", "arrow_scale", "dashed_arrow", "force_polygon", "in_order"]

Array = np.ndarray

#: Points: a polygon that is narrower has its sides beside each other, so far apart.
FLAT, APART = 5.0, 6.0
#: Strokes of d'Alembert's forces.
DASHES = (0, (4.0, 2.2))


def in_order(forces: Sequence[Acting]) -> list[Acting]:
    """By direction, counter-clockwise from the first: then the polygon is convex."""
    vectors = [force.force for force in forces if force.force is not None]
    if not vectors:
        return []
    first = heading(vectors[0])

    def turn(force: Acting) -> float:
        # what differs by rounding from the first direction is not a turn away
        return round((heading(force.force) - first) % math.tau, 9) % round(math.tau, 9)

    return sorted(forces, key=turn)


def force_polygon(sketch: Sketch, forces: Sequence[Acting], scale: float) -> float:
    """Draw the polygon, in points per unit of force; the gap that is left to the start [force].

    The last side begins where the one before it ends, as the numbers are: that it ends at the start
    is seen, not assumed.
    """
    ordered = in_order(forces)
    sides = np.array([force.force for force in ordered])
    corners = scale * np.vstack([np.zeros(2), np.cumsum(sides, axis=0)])
    flat, across = _flat(corners)
    # beside each other only those that are long enough to be seen
    seen = [n for n, side in enumerate(sides) if scale * float(np.hypot(*side)) >= 2.0]
    middle = corners.mean(axis=0)
    for n, force in enumerate(ordered):
        rank = seen.index(n) - 0.5 * (len(seen) - 1) if n in seen else 0.0
        shift = rank * APART * across if flat else np.zeros(2)
        tail, tip = corners[n] + shift, corners[n + 1] + shift
        way = tip - tail
        length = float(np.hypot(*way))
        if length < 2.0:
            continue
        dashed_arrow(sketch, tail, tip, force, name=f"side:{force.gid}")
        n_side = np.array([way[1], -way[0]]) / length
        half = 0.5 * (tail + tip)
        out = n_side if float(n_side @ (half - middle)) >= 0.0 else -n_side
        if flat:
            out = _free_side(corners, seen, n, across)
        _label(sketch, force, tail, way, out)
    if not flat:
        sketch.disc(corners[0], 1.5, PAPER, weight=0.0)
    gap = corners[-1] - corners[0]
    sketch.write()
    return float(np.hypot(*gap)) / scale


def _label(sketch: Sketch, force: Acting, tail: Array, way: Array, out: Array) -> None:
    """The name of a side, outside the polygon."""
    label = Label(force.text, [], color=force.color, name=f"label:{force.gid}")
    width, height = sketch.places.measured(label)
    for side, cost in ((out, 0.0), (-out, 1.0)):
        for part in (0.5, 0.4, 0.6, 0.25, 0.75, 0.1, 0.9):
            for ring in range(4):
                far = 2.0 + 8.0 * ring + 0.5 * (width * abs(side[0]) + height * abs(side[1]))
                x, y = tail + part * way + far * side
                own = cost + 0.6 * ring + 0.5 * abs(part - 0.5)
                label.spots.append((float(x), float(y), own))
    sketch.labels.append(label)


def _free_side(corners: Array, seen: list[int], n: int, across: Array) -> Array:
    """The side of an arrow among parallel ones on which fewer lie beside its middle."""
    along = np.array([across[1], -across[0]])
    half = 0.5 * float((corners[n] + corners[n + 1]) @ along)
    beside = {1.0: 0, -1.0: 0}
    for other in seen:
        ends = sorted(float(corners[k] @ along) for k in (other, other + 1))
        if other != n and ends[0] <= half <= ends[1]:
            beside[1.0 if other > n else -1.0] += 1
    return across if beside[1.0] < beside[-1.0] or n == max(seen) else -across


def _flat(corners: Array) -> tuple[bool, Array]:
    """Whether all corners are nearly on one line, and the direction across it."""
    away = corners - corners[0]
    far = away[int(np.argmax(np.hypot(*away.T)))]
    length = float(np.hypot(*far))
    if length == 0.0:
        return True, np.array([0.0, 1.0])
    across = np.array([-far[1], far[0]]) / length
    return float(np.ptp(corners @ across)) < FLAT, across


def dashed_arrow(
    sketch: Sketch, tail: Array, tip: Array, force: Acting, *, name: str, width: float = 1.8
) -> None:
    """A straight arrow with a filled head, dashed for d'Alembert's forces."""
    way = tip - tail
    length = float(np.hypot(*way))
    if length < 1e-3 * sketch.unit:
        return
    u = way / length
    n, head = np.array([-u[1], u[0]]), min(8.0 * sketch.unit, 0.6 * length)
    dashes = DASHES if force.dashed else "-"
    end, z = tip - 0.8 * head * u, Z["arrow"]
    sketch.line([tail, end], width + 2.0, PAPER, z - 0.2, weight=0.0)
    sketch.line([tail, end], width, force.color, z, name=name, dashes=dashes, weight=2.0)
    corners = [tip, tip - head * u + 0.38 * head * n, tip - head * u - 0.38 * head * n]
    sketch.shape(corners, force.color, force.color, 0.4, z + 0.1, name=f"{name}.head", weight=2.0)


def closing_words(free: FreeBody, gap: float) -> list[str]:
    """The sums that must vanish, as parts of the greatest force and of its moment."""
    greatest = max((one.force for one in free), default=0.0)
    if not greatest:
        return []
    x0, y0 = free.solution[free.body].x[free.instant], free.solution[free.body].y[free.instant]
    moments = [one.torque + (one.x - x0) * one.fy - (one.y - y0) * one.fx for one in free]
    # a force through G has no moment: its distance says how large rounding may be
    parts = [abs(one.torque) + math.hypot(one.x - x0, one.y - y0) * one.force for one in free]
    force = f"ΣF = {rounded_number(float(f'{gap / greatest:.1e}'))} of the greatest force"
    turning = f"{abs(math.fsum(moments)) / max(max(parts), 1e-300):.1e}"
    said = f"ΣM about G = {rounded_number(float(turning))} of the greatest moment"
    through = max(parts) <= ROUNDING * greatest * free.solution.system.length
    return [force, "ΣM about G = 0: all forces pass through G" if through else said]


def arrow_scale(forces: Sequence[Acting], longest: float = SIZE["arrow"]) -> float:
    """Points per unit of force, so that the greatest is `longest`."""
    sizes = [float(np.hypot(*force.force)) for force in forces if force.force is not None]
    return longest / max(sizes) if sizes and max(sizes) > 0.0 else 0.0
