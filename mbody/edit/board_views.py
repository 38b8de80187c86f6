"""Views of the board, kept beside the model as NAME.board.toml: camera, and a picture below."""

from __future__ import annotations

import contextlib
import functools
import itertools
import math
import tomllib
from pathlib import Path
from typing import Any

import numpy as np

from mbody.errors import ModelError, brief
from mbody.files.model.read import text_of

#: End of the file beside the model, and the greatest picture in bytes.
VIEWS, MOST = ".board.toml", 30_000_000
#: The keys of each view; lengths and places in units of the model, the angle in degrees.
KEYS = {"camera": ("x", "y", "unit"), "underlay": ("x", "y", "width", "angle", "opacity")}
#: Kinds of pictures by how their files begin; what can carry scripts is none of them.
PICTURES = {b"\x89PNG\r\n\x1a\n": "image/png", b"\xff\xd8\xff": "image/jpeg"}
#: Entities of a DXF that are drawn, how many, of how many bytes; the part of its size that a chord
#: may be off a curve.
DRAWN = ("LINE", "ARC", "CIRCLE", "ELLIPSE", "LWPOLYLINE", "POLYLINE", "SPLINE")
LINES, LARGEST, OFF = 20_000, 6_000_000, 5e-4


def views_file(model: Path) -> Path:
    """The file of the views of a model.

    >>> views_file(Path("press.toml")).name
    'press.board.toml'
    """
    return model.with_name(model.stem + VIEWS)


def read_views(model: Path | None) -> dict[str, Any]:
    """The views of a model; a file that makes no sense counts as none."""
    with contextlib.suppress(OSError, ValueError, LookupError, TypeError, RecursionError):
        if model is not None:
            tree = tomllib.loads(text_of(views_file(model)))
            return {name: checked_view(name, tree[name]) for name in KEYS if name in tree}
    return {}


def checked_view(name: str, given: Any) -> dict[str, Any]:
    """A view with finite numbers.

    >>> checked_view("camera", {"x": 1, "y": 2, "unit": 0.5, "more": "no"})
    {'x': 1.0, 'y': 2.0, 'unit': 0.5}
    """
    found: dict[str, Any] = {"file": str(given["file"])} if name == "underlay" else {}
    for key in KEYS[name]:
        found[key] = float(given[key])
        if not math.isfinite(found[key]):
            raise ValueError(f"{key} is no finite number")
    return found


def picture_of(file: Path) -> tuple[bytes, str]:
    """A picture and its type, by what is in it and not by its name."""
    is_dxf, found = file.suffix.lower() == ".dxf", file.stat() if file.is_file() else None
    if found is not None and found.st_size <= (LARGEST if is_dxf else MOST):
        return _picture(file, found.st_mtime_ns, is_dxf)
    size = (LARGEST if is_dxf else MOST) / 1e6
    raise ModelError(f"{brief(file.name)} is no picture of at most {size:g} MB: make it smaller")


@functools.lru_cache(1)
def _picture(file: Path, changed: int, is_dxf: bool) -> tuple[bytes, str]:
    if is_dxf:
        return dxf_picture(file), "image/svg+xml"
    content = file.read_bytes()
    for head, kind in PICTURES.items():
        if content.startswith(head):
            return content, kind
    raise ModelError(f"{brief(file.name)} is no picture: give one in PNG or JPEG, or a DXF")


def dxf_picture(file: Path) -> bytes:
    """The lines of a DXF as an SVG of our own making, which has nothing but numbers."""
    import ezdxf.filemanagement
    import ezdxf.lldxf.const
    from ezdxf.path import make_path

    lines: list[list[tuple[float, float]]] = []
    with contextlib.suppress(OSError, ValueError, TypeError, ezdxf.lldxf.const.DXFError):
        every = (
            e for e in ezdxf.filemanagement.readfile(file).modelspace() if e.dxftype() in DRAWN
        )
        paths = [make_path(one) for one in itertools.islice(every, LINES)]
        corners = [v for path in paths for v in path.control_vertices()]
        size = max(np.ptp([(v.x, v.y) for v in corners], axis=0), default=0.0)
        for shape in paths if 0.0 < size < math.inf else ():
            lines.append([(v.x, 0.0 - v.y) for v in shape.flattening(OFF * size)])
    if not lines:
        raise ModelError(f"{brief(file.name)} has no lines that could be drawn: save it as DXF R12")
    return svg_of(lines)


def svg_of(lines: list[list[tuple[float, float]]]) -> bytes:
    """Lines as an SVG."""
    x, y = zip(*itertools.chain(*lines), strict=True)
    wide, tall = max(x) - min(x) or 1.0, max(y) - min(y) or 1.0
    path = "".join("M" + "L".join(f"{a:.6g} {b:.6g}" for a, b in line) for line in lines)
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="{min(x)} {min(y)} {wide} {tall}" '
        f'width="1000" height="{1000 * tall / wide}"><path d="{path}" fill="none" '
        f'stroke="#777" stroke-width="{wide / 500}"/></svg>'
    ).encode()
