"""A drawing kept as plain shapes in the axes of what carries them, so that it can move."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from mbody.solution.places import moved
from mbody.views.carriers import GROUND_CARRIER, Carrier
from mbody.views.labels import Label, Places
from mbody.views.pose import Pose
from mbody.views.sketch import Sketch
from mbody.views.surface import Look

__all__ = ["KeptLabel", "KeptShape", "ShapeRecord", "SceneSketch"]

Array = np.ndarray

#: Instants at which the sides of a support are looked at.
SIDES = 25
#: With more bodies than this arcs and names are not kept clear of what is drawn.
CROWDED = 60


@dataclass(frozen=True)
class KeptShape:
    """One shape in the axes of its carrier.

    Attributes
    ----------
    kind : str
        "line", "polygon" or "circle".
    points : array (n, 2), or (n, 3) of what stretches
        Of a circle its centre.
    radius : float
        Of a circle.
    sense : (quantity, sign) or None
        The shape is there while the quantity has that sign.
    """

    kind: str
    carrier: Carrier
    points: Array
    look: Look
    radius: float = 0.0
    sense: tuple[str, float] | None = None


@dataclass
class KeptLabel:
    """A name near a place that moves.

    Attributes
    ----------
    anchor : array (1, 2) or (1, 3)
        In the axes of the carrier.
    way : array (2,)
        Unit vector from the anchor to the name; (0, 0) where it is written on the anchor.
    turns : bool
        Whether the way turns with the carrier.
    gap : float
        Least distance.
    """

    text: str
    carrier: Carrier
    anchor: Array
    way: Array
    gap: float
    kind: str
    of: str
    color: str
    italic: bool = False
    turns: bool = False


@dataclass
class ShapeRecord:
    """A surface that keeps what is drawn on it."""

    pose: Pose
    carrier: Carrier = GROUND_CARRIER
    sense: tuple[str, float] | None = None
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
        kept = self.carrier.kept(points, self.pose.run, self.pose.k)
        self.shapes.append(KeptShape(kind, self.carrier, kept, look, radius, self.sense))


class _Anywhere(Places):
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
        turn: float = 1.0,
        **look: Any,
    ) -> Label:
        """A name at a place that moves; its number, which would change, is left out."""
        carrier, place = self.record.carrier, np.asarray(anchor, dtype=float)
        shown = text.partition(" = ")[0]
        way = np.array([np.cos(wanted), np.sin(wanted)])
        kept = carrier.kept(place[None], self.pose.run, self.pose.k)
        color, italic = str(look.get("color", "")), bool(look.get("italic", False))
        of = str(look.get("name", "")) or shown
        self.names.append(KeptLabel(shown, carrier, kept, way, gap, "element", of, color, italic))
        return Label(shown, [])

    def roomy(self, place: Array, others: list[Array]) -> float:
        """Down, up, left or right [rad], the side on which the links are least in the whole
        motion.
        """
        pose = self.pose
        bodies = [name for name, nodes in pose.nodes.items() if nodes is others]
        if not bodies:
            return super().roomy(place, others)
        local = [pose.fixed(bodies[0], node) for node in others]
        instants = sorted({round(k) for k in np.linspace(0, len(pose.run) - 1, SIDES)})
        tracks = [moved(pose.run, one)[instants] for one in local]
        choices = {-math.pi / 2.0: 0.0, math.pi / 2.0: 0.2, math.pi: 0.3, 0.0: 0.3}

        def crowd(angle: float) -> float:
            total = 0.0
            for track in tracks:
                way = track - place
                length = np.hypot(*way.T)
                along = way @ (math.cos(angle), math.sin(angle)) / np.maximum(length, 1e-300)
                near = length > self.unit
                total += float(np.mean(np.maximum(0.0, along - 0.6) * near))
            return total

        return min(choices, key=lambda angle: round(crowd(angle) + choices[angle], 3))

    def pin(self, place: Array, label: str) -> None:
        """A pin; several that are at one place in the whole motion are drawn once."""
        before = len(self.pins)
        super().pin(place, label)
        if len(self.pins) > before:
            self.pinned.append((*self.pins[-1], self.record.carrier))
