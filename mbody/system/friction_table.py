"""Where the rough pairs of a mechanism are among its rows."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from typing import Any

from mbody.kernels.friction_laws import BY_RATES, FRICTION_KINDS
from mbody.kernels.layout import integers
from mbody.model.constraint import Constraint
from mbody.model.element import Element
from mbody.model.primitives import FrictionPrimitive

__all__ = ["friction_table"]


def friction_table(
    pairs: Sequence[tuple[Constraint, FrictionPrimitive]],
    owners: Sequence[tuple[Element, int]],
    place: Mapping[int, int],
    switched: Sequence[int],
) -> dict[str, Any]:
    """Columns of the layout, a line a rough pair, in the order of the description.

    Parameters
    ----------
    pairs : sequence
        Each with its element; those of one element follow each other.
    owners : sequence
        The element of every primitive, and which of its primitives it is: first its own rows, then
        the tangent rows of its pairs.
    place : mapping
        The place of a primitive's node in the elimination order.
    switched : sequence of int
        Primitives that are switched.
    """
    number = {(one.name, part): e for e, (one, part) in enumerate(owners)}
    rows = Counter(one.name for one, _ in owners)
    left = Counter(element.name for element, _ in pairs)
    tangents = []
    for element, _ in pairs:
        part = rows[element.name] - left[element.name]
        tangents.append(switched.index(number[element.name, part]))
        left[element.name] -= 1
    pressing = [place[number[element.name, pair.presses]] for element, pair in pairs]
    return {
        "friction_kind": integers([FRICTION_KINDS.index(pair.kind) for _, pair in pairs]),
        "friction_node": integers(pressing),
        "friction_tangent": integers(tangents),
        "senses": BY_RATES,
    }
