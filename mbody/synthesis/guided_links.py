"""The link that carries the point of a path, or the plane that takes poses."""

from __future__ import annotations

import numpy as np

from mbody.model.body import Body

__all__ = ["carrier"]


def carrier(
    name: str, length: float, point: complex, direction: float, plane: float | None
) -> Body:
    """The link from A to B with its point P, at a rough direction.

    Its axes are at A, with x to B; or, where `plane` is a number, those of the plane that is
    guided: at P, turned from them by that angle [rad].

    >>> carrier("coupler", 2.0, 1.0 + 1.0j, 0.0, None).points["P"]
    (1.0, 1.0)
    >>> carrier("coupler", 2.0, 1.0 + 1.0j, 0.0, 0.0).points["A"]
    (-1.0, -1.0)
    """
    places = {"A": 0.0 + 0.0j, "B": complex(length), "P": complex(point)}
    if plane is not None:
        back = np.exp(-1j * plane)
        places = {key: (place - point) * back for key, place in places.items()}
        direction += plane
    points = {key: (float(place.real), float(place.imag)) for key, place in places.items()}
    return Body(name, points=points, guess=float(direction))
