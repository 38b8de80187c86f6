"""Frames of a film as pixels, painted by the renderer that paints our pictures."""

from __future__ import annotations

import functools
import math
from typing import Any

import numpy as np

from mbody.views.film_frames import ABOVE, MARGIN, FilmSet
from mbody.views.film_names import film_names
from mbody.views.labels import drawable
from mbody.views.style import FONTS, INK, MATHS, PAPER, SIZE, SOFT

__all__ = ["arrow_corners", "painted"]

Array = np.ndarray


def painted(film: FilmSet, frame: int) -> Array:
    """One frame as an array (height, width, 3) of bytes."""
    canvas = _Canvas(film.width, film.height)
    for track in film.paths.values():
        canvas.line(film.pixels(track), SOFT, 1.1 * film.point, (5.0, 3.5))
    for n in range(len(film.scenes) - 1, -1, -1):
        for shape, points in film.shapes(frame, n):
            look, faded = shape.look, 0.3 if n else 1.0
            width = look.width * film.point
            dashes = () if look.dashes == "-" else tuple(d * width for d in look.dashes[1])
            if shape.kind == "circle":
                points = _circle(points[0], shape.radius * film.scale)
            if look.halo:
                canvas.line(points, PAPER, width + 2.4 * film.point, (), faded)
            edge = "none" if not look.width else look.edge
            closed = shape.kind != "line"
            canvas.shape(
                points, look.fill if closed else "none", edge, width, dashes, closed, faded
            )
    for one in film.arrows:
        place, vector = film.pixels(one.place[frame]), one.vector[frame]
        if np.hypot(*vector) > 2.5 and np.isfinite(vector).all():
            canvas.shape(arrow_corners(place, vector, film.point), one.color, PAPER, 0.8, (), True)
    for name in film_names(film):
        if np.isfinite(name.at[frame, 0]):
            canvas.text(name.text, name.at[frame], name.color, name.size, italic=name.italic)
    top = film.height - MARGIN
    canvas.text(
        drawable_title(film.title()), (MARGIN, top), INK, 0.1 * film.title_size(), left=True
    )
    canvas.text(film.instant(frame), (MARGIN, top - 0.5 * ABOVE), SOFT, 1.4, left=True)
    _scales(canvas, film)
    return canvas.pixels()


def drawable_title(text: str) -> str:
    """A title without mathematics."""
    return text.replace("$", r"\$")


def _scales(canvas: _Canvas, film: FilmSet) -> None:
    """Scales of lengths and arrows in the lower left corner."""
    x, y = float(MARGIN), 20.0
    length, text = film.scale_bar()
    bar = [
        (x, y + 4),
        (x, y - 4),
        (x, y),
        (x + length, y),
        (x + length, y + 4),
        (x + length, y - 4),
    ]
    canvas.line(np.array(bar), SOFT, 1.3)
    x = canvas.text(text, (x + length + 7.0, y), SOFT, 1.3, left=True) + 18.0
    for long, text, color in film.scales:
        corners = arrow_corners(np.array([x, y]), np.array([long, 0.0]), film.point)
        canvas.shape(corners, color, color, 0.3, (), True)
        x = canvas.text(text, (x + long + 7.0, y), color, 1.3, left=True) + 18.0


def arrow_corners(place: Array, vector: Array, point: float) -> Array:
    """The outline of an arrow from a place, in pixels."""
    length = float(np.hypot(*vector))
    u = vector / length
    n = np.array([-u[1], u[0]])
    head, half = min(8.0 * point, 0.6 * length), 0.85 * point
    neck = length - head
    parts = [(0, half), (neck, half), (neck, 0.4 * head), (length, 0.0)]
    parts += [(a, -b) for a, b in reversed(parts[:3])]
    return np.array([place + a * u + b * n for a, b in parts])


def _circle(centre: Array, radius: float) -> Array:
    angles = np.linspace(0.0, math.tau, max(24, min(180, int(radius))), endpoint=False)
    return np.asarray(centre + radius * np.column_stack([np.cos(angles), np.sin(angles)]))


@functools.lru_cache(maxsize=512)
def _text(text: str, size: float, italic: bool = False) -> tuple[Any, tuple[float, float], Any]:
    """The outline of a text, its width and height in pixels, and its corners."""
    from matplotlib.font_manager import FontProperties
    from matplotlib.textpath import TextPath

    look: dict[str, Any] = {"style": "italic" if italic else "normal"}
    font = FontProperties(family=FONTS, math_fontfamily=MATHS, **look)
    path = TextPath((0, 0), drawable(text), size=SIZE["text"] * size, prop=font)
    box = path.get_extents()
    extent = (float(box.width), max(float(box.height), 0.7 * SIZE["text"] * size))
    return path, extent, (float(box.x0), float(box.x1), float(box.y0), float(box.y1))


class _Canvas:
    """Paths on an array of bytes, y up."""

    def __init__(self, width: int, height: int) -> None:
        from matplotlib.backends.backend_agg import RendererAgg

        made: Any = RendererAgg
        self.renderer: Any = made(width, height, 72.0)
        self.size = (width, height)
        corners = np.array([(0, 0), (width, 0), (width, height), (0, height)], dtype=float)
        self.shape(corners, PAPER, "none", 0.0, (), True)

    def shape(
        self,
        points: Array,
        fill: str,
        edge: str,
        width: float,
        dashes: tuple[float, ...] = (),
        closed: bool = False,
        faded: float = 1.0,
    ) -> None:
        """An outline, filled or not."""
        from matplotlib.path import Path

        codes = None
        points = np.asarray(points, dtype=float)
        if closed:
            points = np.vstack([points, points[:1]])
            codes = [Path.MOVETO, *[Path.LINETO] * (len(points) - 2), Path.CLOSEPOLY]
        self._draw(Path(points, codes), fill, edge, width, dashes, faded)

    def line(
        self,
        points: Array,
        color: str,
        width: float,
        dashes: tuple[float, ...] = (),
        faded: float = 1.0,
    ) -> None:
        """A line; NaN interrupts it."""
        self.shape(points, "none", color, width, dashes, False, faded)

    def text(
        self,
        text: str,
        at: Any,
        color: str,
        size: float,
        *,
        italic: bool = False,
        left: bool = False,
    ) -> float:
        """A text about a place, or from it; returns its right end."""
        from matplotlib.transforms import Affine2D

        if not text.strip():
            return float(at[0])
        path, (wide, _), (x0, x1, y0, y1) = _text(text, round(size, 3), italic)
        x = float(at[0]) - (x0 if left else 0.5 * (x0 + x1))
        base = 0.5 * (y0 + y1) if not left else 0.32 * SIZE["text"] * size
        y = float(at[1]) - base
        move = Affine2D().translate(x, y)
        self._draw(path, PAPER, PAPER, 3.0, (), 1.0, move)
        self._draw(path, color, "none", 0.0, (), 1.0, move)
        return float(at[0]) + (wide if left else 0.5 * wide)

    def _draw(
        self,
        path: Any,
        fill: str,
        edge: str,
        width: float,
        dashes: tuple[float, ...],
        faded: float,
        move: Any = None,
    ) -> None:
        from matplotlib.colors import to_rgb
        from matplotlib.transforms import IdentityTransform

        gc = self.renderer.new_gc()
        gc.set_linewidth(width if edge != "none" else 0.0)
        if edge != "none":
            gc.set_foreground(edge)
        gc.set_alpha(faded)
        gc.set_joinstyle("round")
        gc.set_capstyle("round" if not dashes else "butt")
        if dashes:
            gc.set_dashes(0, list(dashes))
        gc.set_antialiased(True)
        face = None if fill == "none" else to_rgb(fill)
        self.renderer.draw_path(gc, path, move or IdentityTransform(), face)
        gc.restore()

    def pixels(self) -> Array:
        """The array (height, width, 3)."""
        return np.asarray(self.renderer.buffer_rgba())[:, :, :3].copy()
