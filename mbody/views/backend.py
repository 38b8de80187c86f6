"""matplotlib, loaded for the first picture, and the picture files."""

from __future__ import annotations

import io
import re
from pathlib import Path
from typing import TYPE_CHECKING, Any

from mbody.errors import ModelError
from mbody.files.writing import writing
from mbody.views.style import FONTS, MATHS, SIZE

if TYPE_CHECKING:
    from matplotlib.figure import Figure


__all__ = ["blank", "check_ending", "content", "save", "styled"]

ENDINGS = ("svg", "png", "pdf")


def styled() -> Any:
    """A context with the fonts and lines of our pictures, independent of the user's settings.

    Raises
    ------
    ModelError
        Where matplotlib is not installed.
    """
    try:
        import matplotlib.style
    except ImportError:
        raise ModelError(
            "a picture needs matplotlib, which is not installed: pip install matplotlib"
        ) from None
    ours: dict[str, Any] = {
        "font.family": FONTS,
        "font.size": SIZE["text"],
        "mathtext.fontset": MATHS,
        "svg.fonttype": "path",
        "svg.hashsalt": "mbody",
        "axes.unicode_minus": True,
    }
    return matplotlib.style.context(["default", ours])


def blank() -> Figure:
    """An empty figure without a window; notebooks can show it."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(facecolor="white")
    FigureCanvasAgg(figure)
    return figure


def check_ending(path: Any) -> str:
    """The format by the ending of a file.

    >>> check_ending("turn.SVG")
    'svg'
    """
    try:
        ending = Path(path).suffix[1:].lower()
    except TypeError:
        raise ModelError(f"a path must be text or path-like, not {path!r}") from None
    if ending not in ENDINGS:
        raise ModelError(
            f"cannot write '{path}': a picture is a file that ends in .svg, .png or .pdf"
        )
    return ending


def save(figure: Figure, path: Any) -> None:
    """Write a picture, in the format by the ending of the file.

    The same picture is the same file, byte by byte, with one version of matplotlib.

    Parameters
    ----------
    figure : matplotlib.figure.Figure
        Of `draw` or `plot`, or any other.
    path : str or path-like
        A file that ends in .svg, .png or .pdf; one that exists is replaced.

    Raises
    ------
    ModelError
        For another ending, or a place where no file can be written.
    """
    ending = check_ending(path)
    whole = content(figure, ending)
    with writing(path, binary=True) as file:
        file.write(whole)


def content(figure: Figure, ending: str) -> bytes:
    """A picture as the content of a file, the same every time.

    >>> content(blank(), "svg")[:5]
    b'<?xml'
    """
    nameless: dict[str, Any] = {
        "svg": {"Date": None, "Creator": None},
        "png": {"Software": None},
        "pdf": {"CreationDate": None, "Creator": None, "Producer": None},
    }
    found = io.BytesIO()
    with styled():
        figure.savefig(found, format=ending, dpi=200, metadata=nameless[ending])
    whole = found.getvalue()
    return _shortened(whole.decode("utf-8")).encode("utf-8") if ending == "svg" else whole


def _shortened(svg: str) -> str:
    """The same drawing, a third smaller: outlines to a hundredth of a point, no superfluous spaces.

    >>> _shortened('<path d="M 1.23456 0.5 z" transform="scale(0.012345)"/>')
    '<path d="M1.23 0.5z" transform="scale(0.012345)"/>'
    """

    def shorter(path: re.Match[str]) -> str:
        outline = re.sub(r"(\.\d\d)\d+", r"\1", path[1])
        return 'd="' + re.sub(r"\s*([A-Za-z])\s*", r"\1", outline) + '"'

    return re.sub(r'\bd="([^"]*)"', shorter, svg)
