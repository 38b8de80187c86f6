"""Where the places of joints are in the world, and where their axes point, at one position."""

from __future__ import annotations

import numpy as np

from mbody.model.element import Element, Marker
from mbody.system.system import System

__all__ = ["direction", "place"]


def place(system: System, q: np.ndarray, element: Element, side: str) -> np.ndarray:
    """World place (2,) of the end `side` ("i" or "j") of an element, by the system's numbers.

    Parameters
    ----------
    q : array (coordinates + 3,)
        Coordinates of the mass centres, the ground last; angles in rad.
    """
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
