"""The model length, by which lengths and angles are compared with each other."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any, cast

if TYPE_CHECKING:
    from mbody.model.element import Numbers
    from mbody.model.mechanism import Mechanism

__all__ = ["model_length"]

#: The unit of length serves a model without arms whose other lengths are within this factor of it.
FAR = 10.0


def model_length(mechanism: Mechanism, at: Numbers) -> float:
    """The longest arm on a moving body, else another distance, as between the centres of gears or
    of a cam and its roller, else one; of blocks on springs and of balls that are far from one it is
    the greatest length of those.
    """
    moving, fixed = [0.0], [0.0]
    for element in mechanism.constraints:
        for key, marker in element.places().items():
            arm = math.hypot(*(float(part) for part in at.arm(element, key)))
            (fixed if marker.body == "ground" else moving).append(arm)
    apart = [abs(float(joint.apart(at))) for joint in mechanism.joints]
    known = max(moving) or max(fixed) or max(apart, default=0.0)
    if known:
        return known
    ways = (_own_lengths(mechanism, at), _places(mechanism, at))
    sizes = (max(map(abs, lengths), default=0.0) for lengths in ways)
    other = next((size for size in sizes if size), 1.0)
    return 1.0 if 1.0 / FAR <= other <= FAR else other


def _own_lengths(mechanism: Mechanism, at: Numbers) -> Iterator[float]:
    """Lengths of loads and radii of shapes: they do not depend on where the origin is."""
    for load in mechanism.loads:
        for field in dataclasses.fields(cast(Any, load)):
            given = field.metadata.get("dimension") == "length"
            if given and getattr(load, field.name) is not None:
                yield float(at[f"{load.name}.{field.name}"])
    for body in mechanism.bodies:
        for name, shape in body.shapes.items():
            if hasattr(shape, "radius"):
                yield float(at[f"{body.name}.{name}.radius"])


def _places(mechanism: Mechanism, at: Numbers) -> Iterator[float]:
    """How far from the origin loads act, and bodies are guessed to be and begin."""
    for load in mechanism.loads:
        for key in load.places():
            yield math.hypot(*(float(part) for part in at.arm(load, key)))
    for body in mechanism.bodies:
        if body.guess is not None:
            yield from _numbers(body.guess.x, body.guess.y)
    if mechanism.simulation is not None:
        for start in mechanism.simulation.start.values():
            yield from _numbers(start.get("x"), start.get("y"))


def _numbers(*given: Any) -> Iterator[float]:
    yield from (float(part) for part in given if isinstance(part, float))
