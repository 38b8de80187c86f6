"""Symbols of couplings: ropes between places, belts between wheels, lines between what turns."""

from __future__ import annotations

import itertools
import math
from functools import singledispatch
from typing import TYPE_CHECKING, Any

import numpy as np

from mbody.model.coupling import Coupling
from mbody.views.bounds import pulleys
from mbody.views.carriers import between, on
from mbody.views.labels import symbolic
from mbody.views.pose import heading
from mbody.views.shapes import direction
from mbody.views.style import INK, SOFT, WHEEL, Z

if TYPE_CHECKING:
    from mbody.views.sketch import Sketch

__all__ = ["coupling_symbol"]

Array = np.ndarray

#: More parts of a rope than these are not drawn side by side.
PARTS = 6


@singledispatch
def coupling_symbol(coupling: Coupling, sketch: Sketch) -> None:
    """Ropes for distances, as many side by side as the factor says; wheels of the radii for angles
    among lengths, with a belt where they are two; thin lines between what else turns together.
    """
    look: dict[str, Any]
    ends = _ropes(sketch, coupling)
    wheels = pulleys(coupling, sketch.pose)
    turning = {n: coupling.parts[n].bodies[1] for n in wheels}
    hubs = [sketch.pose.fixed(turning[n], centre) for n, (centre, _) in wheels.items()]
    for n, (centre, radius) in wheels.items():
        if radius > sketch.size("pin"):
            name = f"pulley:{coupling.name}.{n}"
            with sketch.carried(on(turning[n])):
                sketch.disc(centre, radius, WHEEL, INK, 1.1, Z["wheel"], name=name, weight=0.5)
    named = f"belt:{coupling.name}"
    centres = [centre for centre, _ in wheels.values()]
    belt = _belt(sketch, coupling, list(wheels.values()))
    if belt:
        for n, side in enumerate(belt):
            with sketch.carried(between(*hubs)):
                sketch.line(side, 1.3, INK, Z["wheel"] + 0.2, name=f"{named}:{n}" if n else named)
    else:
        n = 0
        for pair, ends_of in zip(itertools.pairwise(centres), itertools.pairwise(hubs)):
            if np.hypot(*(pair[1] - pair[0])):
                look = {"dashes": (0, (5, 2)), "name": "" if n else named}
                n += 1
                with sketch.carried(between(*ends_of)):
                    sketch.line(pair, 0.9, SOFT, Z["path"], **look)
    places = [*ends, *centres]
    if places:
        middle = np.mean(places[:2], axis=0)
        way = places[min(1, len(places) - 1)] - places[0]
        wanted, gap = heading(way) + math.pi / 2.0, 5.0 * sketch.unit
        look = {"italic": True, "name": f"coupling:{coupling.name}"}
        body = next(name for term in coupling.parts for name in term.bodies if name != "ground")
        with sketch.carried(on(body)):
            sketch.label(symbolic(coupling.name), middle, wanted, gap, turn=0.3, **look)


def _ropes(sketch: Sketch, coupling: Coupling) -> list[Array]:
    """Draw the lengths; returns their places."""
    found: list[Array] = []
    for n, term in enumerate(coupling.parts):
        if not term.ends:
            continue
        i, j = (sketch.pose.place(coupling, f"{n}.{side}") for side in "ij")
        found += [i, j]
        if not np.hypot(*(j - i)):
            continue
        name = f"rope:{coupling.name}.{n}"
        sites = [sketch.pose.site(coupling, f"{n}.{side}") for side in "ij"]
        if not term.distance:
            look: dict[str, Any] = {"dashes": (0, (7, 2, 1.5, 2)), "name": name}
            with sketch.carried(between(*sites)):
                sketch.line([i, j], 0.9, SOFT, Z["path"], **look)
            continue
        across = direction(heading(j - i) + math.pi / 2.0)
        parts = min(max(round(abs(sketch.pose.number(coupling, f"{n}.factor"))), 1), PARTS)
        for k in range(parts):
            aside = (k - 0.5 * (parts - 1)) * 2.8 * sketch.unit * across
            own = f"{name}:{k}" if k else name
            with sketch.carried(between(*sites)):
                sketch.line([i + aside, j + aside], 1.2, INK, Z["link"] - 0.1, name=own)
        for place, marker in zip((i, j), term.ends, strict=True):
            with sketch.carried(on(marker.body)):
                sketch.disc(place, 0.6 * sketch.size("pin"), z=Z["pin"] - 0.1, weight=0.3)
            if marker.body == "ground":
                sketch.support(place, [i + j - place], f"{coupling.name}.{n}")
    return found


def _belt(sketch: Sketch, coupling: Coupling, wheels: list[tuple[Array, float]]) -> list[Array]:
    """The two straight parts of a belt on two wheels: open where they turn one way, else crossed;
    none where it is no belt.
    """
    if len(wheels) != 2 or len(coupling.parts) != 2 or not coupling.lengths:
        return []
    (a, r), (b, s) = wheels
    way = b - a
    length = float(np.hypot(*way))
    first, second = (sketch.pose.number(coupling, f"{n}.factor") for n in range(2))
    crossed = first * second > 0.0
    part = (r + s if crossed else r - s) / max(length, 1e-300)
    if abs(part) >= 1.0:
        return []
    found = []
    for side in (1.0, -1.0):
        u = direction(heading(way) + side * math.acos(part))
        found.append(np.array([a + r * u, b + (-s if crossed else s) * u]))
    return found
