"""Where the places of joints are in the world, and where their axes point, at one position."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from mbody.errors import SolveError
from mbody.model.element import Element, Marker
from mbody.system.system import System


def place(system: System, q: np.ndarray, element: Element, side: str) -> np.ndarray:
    """World place (2,) of the end `side` ("i" or "j") of an element, by the system's numbers."""
    marker = element.place(side)
    x, y, angle = q[3 * system.bodies[marker.body] :][:3]
    ax, ay = system.numbers.arm(element, side)
    c, s = np.cos(angle), np.sin(angle)
    return np.array([x + c * ax - s * ay, y + s * ax + c * ay], dtype=float)


def direction(system: System, q: np.ndarray, element: Element, side: str) -> float:
    """Angle [rad] of the marker's x axis at the end `side` of an element, from the world's."""
    marker: Marker = getattr(element, side)
    turned = q[3 * system.bodies[marker.body] + 2]
    return float(turned + system.numbers.angle(element, side))


# -- Distances that become zero: there a row of Φ_q, a unit vector along the distance, has none

#: A motion that fails where a distance is this part of the model length fails because of it.
CLOSE = 1e-3
#: A motion that goes on where a distance is this part has lost its way there.
GONE = 1e-7


def vanishing(system: System, q: np.ndarray, when: str, close: float = CLOSE) -> SolveError | None:
    """The sentence of a motion that cannot go on since a distance becomes zero; None where none
    does.

    Such as "t = 2 s".
    """
    whole = np.append(q[: system.coordinates], np.zeros(3))
    found = [
        (
            math.dist(place(system, whole, element, i), place(system, whole, element, j)),
            element,
            i,
            j,
        )
        for element, i, j in _distances(system)
    ]
    if not found:
        return None
    least, element, i, j = min(found, key=lambda one: one[0])
    if not least < close * system.length:
        return None
    bodies = " and ".join(f"'{element.place(side).body}'" for side in (i, j))
    unit = system.mechanism.units.length
    return SolveError(
        f"the motion cannot go on at {when}: the distance that '{element.name}' measures between "
        f"{bodies} comes down to {least:.2g} {unit}, and at 0 it has no direction; "
        "stop before, or move one of its places aside",
        element.name,
    )


def _distances(system: System) -> Iterator[tuple[Element, str, str]]:
    """Elements that keep or count distances, with the names of both ends."""
    machine = system.mechanism
    for element in (*machine.joints, *machine.drivers, *machine.couplings):
        for i, j in element.distances():
            yield element, i, j
