"""The drawing of a mechanism: lines and shapes in its own units, sizes in points."""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from mbody.core.tolerances import TINY
from mbody.views.labels import FreePlaces, Label, below_line, drawable, extent, places_around
from mbody.views.pose import GROUND_CARRIER, Carrier, Pose, on
from mbody.views.shapes import arc, box, direction, hatching, unique
from mbody.views.style import GROUND, INK, LINK, PAPER, SIZE, Z

if TYPE_CHECKING:
    from matplotlib.axes import Axes


# -- Surfaces: the paper of matplotlib, or a record of the shapes themselves -------------------

Array = np.ndarray


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
