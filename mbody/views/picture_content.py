"""The style of our pictures, and their content in each format."""

from __future__ import annotations

import io
import re
from typing import TYPE_CHECKING, Any

from mbody.errors import ModelError
from mbody.views.style import FONTS, MATHS, SIZE

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["content_of", "styled"]


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
    """The same drawing, a third smaller: outlines to a hundredth of a point, no superfluous spaces.

    >>> _shortened('<path d="M 1.23456 0.5 z" transform="scale(0.012345)"/>')
    '<path d="M1.23 0.5z" transform="scale(0.012345)"/>'
    """

    def shorter(path: re.Match[str]) -> str:
        outline = re.sub(r"(\.\d\d)\d+", r"\1", path[1])
        return 'd="' + re.sub(r"\s*([A-Za-z])\s*", r"\1", outline) + '"'

    return re.sub(r'\bd="([^"]*)"', shorter, svg)
