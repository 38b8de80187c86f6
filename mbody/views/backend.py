"""matplotlib, loaded for the first picture, and the picture files."""

from __future__ import annotations

import functools
from pathlib import Path
from typing import TYPE_CHECKING, Any

from mbody.errors import ModelError
from mbody.files.writing import writing
from mbody.views.picture_content import content_of, styled

if TYPE_CHECKING:
    from matplotlib.figure import Figure


__all__ = ["blank", "check_ending", "save", "styled"]

ENDINGS = ("svg", "png", "pdf")


def blank() -> Figure:
    """An empty figure without a window; notebooks can show it."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure: Any = Figure(facecolor="white")
    FigureCanvasAgg(figure)
    vars(figure)["_repr_mimebundle_"] = functools.partial(_in_a_notebook, figure)
    return figure


def _in_a_notebook(figure: Figure, include: Any = None, exclude: Any = None) -> dict[str, str]:
    """A drawing as SVG: sharp, and without a server."""
    return {"image/svg+xml": content_of(figure, "svg").decode("utf-8")}


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
    whole = content_of(figure, ending)
    with writing(path, binary=True) as file:
        file.write(whole)
