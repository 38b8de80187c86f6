"""The style of all pictures: colours, widths and sizes.

The colours are from the palette of M. Okabe and K. Ito, which colour-blind people can distinguish;
they also differ in lightness, so that they can be distinguished in print.
"""

from __future__ import annotations

import functools
import io
import re
import textwrap
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from mbody.errors import ModelError
from mbody.files.writing import writing
from mbody.solution.doubts import inherited

if TYPE_CHECKING:
    from matplotlib.figure import Figure


INK = "#26323f"  # outlines of links, pins, text
LINK = "#dde5ec"  # fill of links
PLATE = "#eaeff4"  # fill of plates
WHEEL = "#f3f6f9"  # behind the links
GROUND = "#59636e"  # supports, rails, hatching
SOFT = "#7d8894"  # paths, scales, notes
LOAD = "#d55e00"
FORCE = "#0072b2"
DRIVER = "#00795a"
POLE = "#8f2d6b"
PAPER = "#ffffff"

#: Curves of a plot, in this order; the dashes distinguish them without colours.
CURVES = (
    ("#0072b2", "-"),
    ("#d55e00", (0, (6, 1.5))),
    ("#00795a", (0, (4, 1.2, 1.2, 1.2))),
    ("#26323f", (0, (1.4, 1.2))),
    ("#cc79a7", (0, (8, 1.5, 1.5, 1.5, 1.5, 1.5))),
    ("#e69f00", (0, (2.5, 1))),
)

#: Both are part of matplotlib, so that a picture is the same on every machine.
FONTS = ["STIXGeneral", "DejaVu Sans"]
MATHS = "stix"

#: Sizes in points.
SIZE = {
    "width": 330.0,  # of the mechanism in a picture, at most
    "height": 230.0,
    "margin": 12.0,
    "link": 4.2,  # half the width of a link
    "pin": 3.6,
    "block": 11.0,  # half the length of a slider
    "support": 13.0,  # height of the triangle below a ground pin
    "hatch": 4.5,
    "arrow": 74.0,  # the longest
    "arc": 19.0,  # radius of the arrow of a motor
    "text": 9.5,
    "title": 11.5,
}

#: Layers, from bottom to top.
Z = {
    "ring": 1.0,
    "wheel": 1.5,
    "plate": 2.0,
    "path": 2.5,
    "ground": 2.7,
    "link": 3.0,
    "block": 4.0,
    "pin": 6.0,
    "arrow": 7.0,
    "text": 9.0,
}


# -- The style of our pictures, and their content in each format -------------------------------


def styled() -> Any:
    """A context with the fonts and lines of our pictures, independent of the user's settings."""
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


def content_of(figure: Figure, ending: str) -> bytes:
    """The content of a picture file in a format."""
    nameless: dict[str, Any] = {
        "svg": {"Date": None, "Creator": None},
        "png": {"Software": None},
        "pdf": {"CreationDate": None, "Creator": None, "Producer": None},
    }
    content = io.BytesIO()
    with styled():
        figure.savefig(content, format=ending, dpi=200, metadata=nameless[ending])
    whole = content.getvalue()
    return _shortened(whole.decode("utf-8")).encode("utf-8") if ending == "svg" else whole


def _shortened(svg: str) -> str:
    """The drawing a third smaller: outlines to a hundredth of a point, no superfluous spaces.

    >>> _shortened('<path d="M 1.23456 0.5 z" transform="scale(0.012345)"/>')
    '<path d="M1.23 0.5z" transform="scale(0.012345)"/>'
    """

    def shorter(path: re.Match[str]) -> str:
        outline = re.sub(r"(\.\d\d)\d+", r"\1", path[1])
        return 'd="' + re.sub(r"\s*([A-Za-z])\s*", r"\1", outline) + '"'

    return re.sub(r'\bd="([^"]*)"', shorter, svg)


# -- matplotlib, loaded for the first picture, and the picture files ---------------------------

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


#: Size of sentences below a picture [points], and how many there are at most.
BELOW, SENTENCES = 7.0, 4


def said_below(
    figure: Figure, *results: Any, of: Iterable[Any] = (), notes: Iterable[str] = ()
) -> Figure:
    """The figure with doubts of results, and what is known of the forces of which it shows
    quantities, in small lines below it.
    """
    said = inherited(*results, of=of, notes=notes)
    doubts = {one.message for one in said["doubts"]}
    sentences = [f"in doubt: {one}" if one in doubts else one for one in said["notes"]]
    if not sentences:
        return figure
    wide, tall = figure.get_size_inches()
    letters = max(40, int(wide * 72.0 / (0.5 * BELOW)))
    texts = [one.replace("$", r"\$") for one in sentences[:SENTENCES]]
    lines = [line for one in texts for line in textwrap.wrap(one, letters)]
    more = (1.35 * len(lines) + 1.0) * BELOW / 72.0
    places = [(axes, axes.get_position()) for axes in figure.axes]
    figure.set_size_inches(wide, tall + more)
    part = tall / (tall + more)
    for axes, at in places:
        axes.set_position((at.x0, 1.0 - (1.0 - at.y0) * part, at.width, at.height * part))
    figure.text(
        BELOW / 72.0 / wide,
        0.5 * BELOW / 72.0 / (tall + more),
        "\n".join(lines),
        size=BELOW,
        color=SOFT,
        va="bottom",
        linespacing=1.35,
        gid="notes",
    )
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
    whole = content_of(figure, ending)
    with writing(path, binary=True) as file:
        file.write(whole)
