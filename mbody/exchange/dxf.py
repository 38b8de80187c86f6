"""DXF: the links and cams of a mechanism as drawings for CAD and for cutting."""

from __future__ import annotations

import importlib
import io
import re
from dataclasses import dataclass
from typing import Any

import numpy as np

from mbody.errors import ModelError, SolveError
from mbody.exchange.part_outlines import PartOutline, parts_of
from mbody.model.joints import Gear
from mbody.model.mechanism import Mechanism
from mbody.quantities.number import evaluated, number
from mbody.quantities.types import Number
from mbody.quantities.units import unit_system
from mbody.system.assembler import assemble

__all__ = ["PartDrawing", "to_dxf"]

#: Codes of $INSUNITS.
UNITS = {"in": 1, "ft": 2, "mm": 4, "cm": 5, "m": 6}
#: The layer of what is not cut: names, pitch circles, directions.
MARKS = "marks"
#: Parts of the mean distance of places on a link: the width of bars; of that, of holes.
WIDTH, HOLE = 0.2, 0.4


@dataclass(frozen=True)
class PartDrawing:
    """The text of a drawing, and what it assumes."""

    text: str
    notes: tuple[str, ...] = ()


def to_dxf(
    mechanism: Mechanism, width: Number | None = None, hole: Number | None = None
) -> PartDrawing:
    """All links side by side, each a block in its own axes, on a layer of its name.

    Parameters
    ----------
    mechanism : Mechanism
    width, hole : float or str, optional
        Of bars, and the diameter of holes for pins without `pin_radius` [length], which a model
        does not have: by default a fifth of the mean extent of links, and 0.4 of that.

    Returns
    -------
    PartDrawing
        `text` and `notes`.

    Raises
    ------
    ModelError
        For a width or a diameter that is not positive, or a hole that is wider than the bar.
    SolveError
        Where ezdxf is not installed.

    Notes
    -----
    Circles are holes, at the places of pins; bars have round ends about them. A cam is its contour
    in 1440 points, to be cut as it is. Bodies with shapes have the edges of these. The layer
    ``marks`` has names, named points, pitch circles, rollers and the lines of guides.

    Examples
    --------
    >>> import mbody
    >>> drawing = to_dxf(mbody.gallery.load("norton_fourbar"), width=1.0, hole=0.5)
    >>> drawing.text.count("coupler") > 0
    True
    """
    try:
        ezdxf: Any = importlib.import_module("ezdxf")
    except ImportError:
        raise SolveError(
            "a drawing in DXF needs the package ezdxf, which is not installed: pip install ezdxf"
        ) from None
    system = assemble(mechanism)
    notes = []
    unit = mechanism.units.length
    broad = _length(mechanism, width, "width")
    if broad is None:
        broad = WIDTH * _span(parts_of(system, 1.0, 1.0))
        notes.append(f"bars are {broad:.4g} {unit} wide: the model does not say how wide")
    bore = _length(mechanism, hole, "hole")
    if bore is None:
        bore = HOLE * broad
        notes.append(f"holes without a pin_radius have a diameter of {bore:.4g} {unit}")
    for what, value in (("the width of bars", broad), ("the diameter of holes", bore)):
        if not (np.isfinite(value) and value > 0.0):
            raise ModelError(f"{what} is {value:g} {unit}: it must be positive")
    if bore >= broad:
        raise ModelError(
            f"holes of {bore:g} {unit} do not fit into bars of {broad:g} {unit}: give wider bars"
        )
    scale = 1.0
    if unit not in UNITS:
        scale = unit_system(mechanism.units).unit("length").factor * 1e3
        notes.append("lengths are in mm")
    parts = [part for part in parts_of(system, broad, bore) if _drawn(part)]
    if any(isinstance(joint, Gear) for joint in mechanism.joints):
        notes.append("wheels are pitch circles, without teeth")
    text = _written(ezdxf, parts, broad, scale, UNITS.get(unit, UNITS["mm"]))
    return PartDrawing(text, tuple(notes))


def _length(mechanism: Mechanism, given: Number | None, field: str) -> float | None:
    """A length in the units of the mechanism."""
    if given is None:
        return None
    value = number(given, "length", "drawing", field)
    return float(evaluated(value, mechanism.parameters.scope(), "drawing", field))


def _span(parts: list[PartOutline]) -> float:
    """The mean extent of the places on a link."""
    spans, sizes = [], []
    for part in parts:
        places = np.array([*(c for c, _ in part.holes), *part.marks.values()]).reshape(-1, 2)
        if len(places) > 1:
            spans.append(float(np.hypot(*np.ptp(places, axis=0))))
        round_ones = [2.0 * radius for _, radius in part.circles]
        wide = [float(np.ptp([p[:2] for p in c.points], axis=0).max()) for c in part.contours]
        sizes += [*round_ones, *wide]
    found = [span for span in spans if span > 0.0] or sizes
    return float(np.mean(found)) if found else 1.0


def _drawn(part: PartOutline) -> bool:
    return bool(part.holes or part.contours or part.edges or part.circles)


def _written(ezdxf: Any, parts: list[PartOutline], width: float, scale: float, units: int) -> str:
    document = ezdxf.new("R2010")
    document.units = units
    document.layers.add(MARKS, color=8)
    extents = importlib.import_module("ezdxf.bbox").extents
    space, across, gap = document.modelspace(), 0.0, width * scale
    taken = {MARKS.lower(), "0", "defpoints"}
    for n, part in enumerate(parts):
        layer = _layer(part.name, taken)
        document.layers.add(layer, color=1 + n % 6)
        block = document.blocks.new(layer)
        _draw(block, part, layer, scale)
        box = extents(block)
        at = across - box.extmin.x, -box.extmin.y
        space.add_blockref(layer, at, dxfattribs={"layer": layer})
        name = {"layer": MARKS, "height": 0.5 * gap}
        space.add_text(part.name, dxfattribs=name).set_placement((across, -gap))
        # a letter is about as wide as 0.4 of a bar
        across += max(box.size.x, 0.4 * gap * len(part.name)) + gap
    stream = io.StringIO()
    document.write(stream)
    return stream.getvalue()


def _layer(name: str, taken: set[str]) -> str:
    """A name that a layer may have."""
    plain = re.sub(r'[<>/\\":;?*|=`,]', "_", name)
    while plain.lower() in taken:
        plain += "_"
    taken.add(plain.lower())
    return plain


def _draw(block: Any, part: PartOutline, layer: str, scale: float) -> None:
    edge, mark = {"layer": layer}, {"layer": MARKS}
    for (x, y), radius in (*part.holes, *part.edges):
        block.add_circle((x * scale, y * scale), radius * scale, dxfattribs=edge)
    for contour in part.contours:
        points = [(x * scale, y * scale, bulge) for x, y, bulge in contour.points]
        block.add_lwpolyline(points, format="xyb", close=contour.closed, dxfattribs=edge)
    for (x, y), radius in part.circles:
        block.add_circle((x * scale, y * scale), radius * scale, dxfattribs=mark)
    for start, end in part.lines:
        block.add_line(np.multiply(start, scale), np.multiply(end, scale), dxfattribs=mark)
    for x, y in part.marks.values():
        block.add_point((x * scale, y * scale), dxfattribs=mark)
