"""A film as SVG, which browsers play without scripts (SMIL)."""

from __future__ import annotations

from html import escape
from typing import Any

import numpy as np

from mbody.views.film_frames import MARGIN, FilmSet
from mbody.views.film_names import FilmName, film_names
from mbody.views.film_raster import arrow_corners
from mbody.views.page_data import text_runs
from mbody.views.style import INK, PAPER, SOFT

__all__ = ["film_svg"]

Array = np.ndarray

SERIF = "STIX Two Text, Cambria, Georgia, Times New Roman, serif"
SANS = "system-ui, Segoe UI, Roboto, Arial, sans-serif"


def film_svg(film: FilmSet, seconds: float) -> str:
    """The text of the file.

    Parameters
    ----------
    film : FilmSet
    seconds : float
        Of one round; it goes on without end.
    """
    wide, tall = film.width, film.height
    title = escape(film.title())
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {wide} {tall}" width="{wide}" '
        f'height="{tall}" role="img" aria-label="{title}">',
        f"<title>{title}</title>",
        f'<rect width="{wide}" height="{tall}" fill="{PAPER}"/>',
        _text(film.title(), MARGIN, MARGIN + 6, INK, film.title_size(), "start", SANS),
    ]
    still = film.stretches[0]
    count = len(still)
    timing = f'dur="{seconds:.3f}s" repeatCount="indefinite"'
    closed = not np.isclose(film.at[0][-1], len(film.main.run) - 1)
    # the last frame of what closes on itself leads to the first
    order = [*range(count), 0] if closed else list(range(count))
    for track in film.paths.values():
        line = _path(_down(film, film.pixels(track)), False)
        look = f'stroke="{SOFT}" stroke-width="{1.1 * film.point:.2f}" stroke-dasharray="6 4"'
        parts.append(f'<path d="{line}" fill="none" {look}/>')
    for n in range(len(film.scenes) - 1, -1, -1):
        parts.append(f'<g opacity="{0.3 if n else 1}" stroke-linejoin="round">')
        parts += _shapes(film, n, order, timing)
        parts.append("</g>")
    for one in film.arrows:
        parts += _arrow(film, one, order, timing)
    for name in film_names(film):
        parts.append(_name(film, name, order, timing))
    parts += _scales(film)
    parts.append("</svg>\n")
    return "\n".join(parts)


def _down(film: FilmSet, pixels: Array) -> Array:
    """Pixels with y down."""
    return np.column_stack([pixels[..., 0], film.height - pixels[..., 1]])


def _path(points: Array, closed: bool) -> str:
    text, pen = "", False
    for x, y in points.tolist():
        if x != x:
            pen = False
            continue
        text += f"{'L' if pen else 'M'}{x:.1f} {y:.1f}"
        pen = True
    return text + ("Z" if closed else "")


def _look(film: FilmSet, shape: Any) -> str:
    look = shape.look
    width = look.width * film.point
    fill = "none" if shape.kind == "line" else look.fill
    found = f'fill="{fill}" stroke="{look.edge if look.width else "none"}"'
    found += f' stroke-width="{width:.2f}" stroke-linecap="round"'
    if look.dashes != "-":
        found += f' stroke-dasharray="{" ".join(f"{d * width:.1f}" for d in look.dashes[1])}"'
    return found


def _shapes(film: FilmSet, n: int, order: list[int], timing: str) -> list[str]:
    """Shapes in groups that follow their carriers; what stretches has an outline for each frame."""
    scene, found = film.scenes[n], []
    last: Any = None
    for shape in scene.shapes:
        if film.left_out(shape):
            continue
        carrier = shape.carrier
        axes = film.carried[n][carrier]
        if carrier.stretches:
            if last is not None:
                found.append("</g></g>")
                last = None
            lines = [
                _path(
                    _down(film, film.pixels(carrier.shown(shape.points, axes, k))),
                    shape.kind == "polygon",
                )
                for k in order
            ]
            values = ";".join(lines)
            found.append(
                f'<path {_look(film, shape)}><animate attributeName="d" values="{values}" '
                f"{timing}/></path>"
            )
            continue
        if carrier != last:
            if last is not None:
                found.append("</g></g>")
            found.append(_carried(film, axes, order, timing))
            last = carrier
        shown = ""
        if shape.sense:
            states = ";".join("visible" if film.there(shape, n)[k] else "hidden" for k in order)
            shown = f'<animate attributeName="visibility" values="{states}" {timing}/>'
        # in the axes of the carrier, y down
        own = shape.points * (film.scale, -film.scale)
        if shape.kind == "circle":
            (x, y), r = own[0], shape.radius * film.scale
            at = f'cx="{x:.2f}" cy="{y:.2f}" r="{r:.2f}"'
            found.append(f"<circle {at} {_look(film, shape)}>{shown}</circle>")
        else:
            line = _path(own, shape.kind == "polygon")
            found.append(f'<path d="{line}" {_look(film, shape)}>{shown}</path>')
    if last is not None:
        found.append("</g></g>")
    return found


def _carried(film: FilmSet, axes: tuple[Array, Array, Array], order: list[int], timing: str) -> str:
    """The opening of a group that moves with a carrier."""
    origin = _down(film, film.pixels(axes[0]))[order]
    # angles go on without jumps, so that nothing turns back between two frames
    angles = -np.degrees(np.unwrap(np.arctan2(axes[1][order, 1], axes[1][order, 0])))
    if np.ptp(origin, axis=0).max() < 1e-6 and np.ptp(angles) < 1e-6:
        (x, y), turn = origin[0], angles[0]
        return f'<g transform="translate({x:.2f} {y:.2f})"><g transform="rotate({turn:.3f})">'
    moves = ";".join(f"{x:.2f} {y:.2f}" for x, y in origin.tolist())
    turns = ";".join(f"{a:.3f}" for a in angles.tolist())
    transform = '<animateTransform attributeName="transform"'
    return (
        f'<g>{transform} type="translate" values="{moves}" {timing}/>'
        f'<g>{transform} type="rotate" values="{turns}" {timing}/>'
    )


def _arrow(film: FilmSet, one: Any, order: list[int], timing: str) -> list[str]:
    lines = []
    for k in order:
        place, vector = film.pixels(one.place[k]), one.vector[k]
        long = float(np.hypot(*vector))
        # an outline of as many corners in every frame, which a browser can move
        vector = vector if np.isfinite(long) and long > 1e-3 else np.array([1e-3, 0.0])
        corners = arrow_corners(place, vector, film.point)
        lines.append(_path(_down(film, corners), True))
    found = [
        f'<path fill="{one.color}"><animate attributeName="d" values="{";".join(lines)}" '
        f"{timing}/></path>"
    ]
    return found


def _moving_text(
    text: str, moves: str, color: str, size: int, italic: bool, timing: str, shown: str
) -> str:
    style = "italic" if italic else "normal"
    return (
        f'<g><animateTransform attributeName="transform" type="translate" values="{moves}" '
        f'{timing}/>{shown}<text font-family="{SERIF}" font-size="{size}" font-style="{style}" '
        f'fill="{color}" text-anchor="middle" stroke="{PAPER}" stroke-width="3" '
        f'paint-order="stroke">{_runs(text)}</text></g>'
    )


def _runs(text: str) -> str:
    return "".join(
        f'<tspan font-size="10" dy="3">{escape(part)}</tspan><tspan dy="-3">\u200b</tspan>'
        if how == "sub"
        else f"<tspan>{escape(part)}</tspan>"
        for part, how in text_runs(text)
    )


def _name(film: FilmSet, name: FilmName, order: list[int], timing: str) -> str:
    """A name that moves; in frames without room for it, it is hidden where it was."""
    there = np.isfinite(name.at[:, 0])
    if not there.any():
        return ""
    near = np.flatnonzero(there)
    at = name.at[near[np.clip(np.searchsorted(near, order, "right") - 1, 0, None)]]
    moves = ";".join(f"{x:.1f} {film.height - y + 4.5:.1f}" for x, y in at.tolist())
    italic = name.italic or name.text.startswith("$")
    shown = ""
    if not there.all():
        states = ";".join("visible" if there[k] else "hidden" for k in order)
        shown = f'<animate attributeName="visibility" values="{states}" {timing}/>'
    return _moving_text(name.text, moves, name.color, 14, italic, timing, shown)


def _text(text: str, x: float, y: float, color: str, size: float, anchor: str, family: str) -> str:
    return (
        f'<text x="{x:.1f}" y="{y:.1f}" fill="{color}" font-size="{size:.3g}" '
        f'text-anchor="{anchor}" font-family="{family}">{escape(text)}</text>'
    )


def _scales(film: FilmSet) -> list[str]:
    x, y = float(MARGIN), film.height - 20.0
    length, text = film.scale_bar()
    bar = f"M{x} {y - 4}V{y + 4}M{x} {y}H{x + length:.1f}M{x + length:.1f} {y - 4}V{y + 4}"
    found = [f'<path d="{bar}" fill="none" stroke="{SOFT}" stroke-width="1.3"/>']
    found.append(_text(text, x + length + 7, y + 4, SOFT, 13, "start", SANS))
    x += length + 7 + 8.0 * len(text) + 16
    for long, words, color in film.scales:
        corners = arrow_corners(np.array([x, 20.0]), np.array([long, 0.0]), film.point)
        found.append(f'<path d="{_path(_down(film, corners), True)}" fill="{color}"/>')
        found.append(_text(words, x + long + 7, y + 4, color, 13, "start", SANS))
        x += long + 7 + 8.0 * len(words) + 16
    return found
