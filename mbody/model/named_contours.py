"""Contours by the names of curves of a mechanism."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from mbody.errors import ModelError, brief
from mbody.laws.smooth_contour import Contour, contour_of
from mbody.model.element import listed


def contour_named(names: Any, curves: Mapping[str, Any], place: str) -> Contour:
    """The contour by the named curves of a mechanism; `place`: the dotted name of its shape.

    Raises ModelError for curves that are not there, or make none.
    """
    body, _, key = place.partition(".")
    named = (names,) if isinstance(names, str) else names
    known = isinstance(named, tuple) and all(isinstance(name, str) for name in named)
    if not known or len(named) != (1 if isinstance(names, str) else 2):
        raise ModelError(
            f"'{body}': {key}.curve is {brief(names)}: name one curve of the mechanism, y of x, or "
            "two, x and y of one number",
            body,
        )
    for name in named:
        if name not in curves:
            raise ModelError(
                f"'{body}': {key} names the curve {brief(name)}, which is not there (there "
                f"are: {listed(curves)}): add it to the curves of the mechanism",
                body,
            )
    return contour_of(named, tuple(curves[name].law for name in named))
