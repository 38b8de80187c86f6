"""What shapes are drawn on: the paper of matplotlib, or a record of the shapes themselves."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from mbody.views.carriers import GROUND_CARRIER, Carrier
from mbody.views.labels import Label, below_line, drawable
from mbody.views.style import INK, PAPER, Z

if TYPE_CHECKING:
    from matplotlib.axes import Axes

__all__ = ["Look", "PaperSurface", "Surface"]

Array = np.ndarray


@dataclass(frozen=True)
class Look:
    """How a shape is drawn.

    Attributes
    ----------
    width : float
        Of its outline, in points.
    edge, fill : str
        Colours of the style, or "none".
    z : float
        Its layer; greater ones lie above.
    name : str
        By which it is found in a figure and in an SVG file.
    dashes : "-" or (offset, (on, off, …))
        In widths of the line.
    halo : bool
        Whether a line is parted by white from what lies below.
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
    sense: tuple[str, float] | None

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
        self.sense: tuple[str, float] | None = None

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
