"""Formulas of measured quantities, from their text and the oracle's own geometry."""

from __future__ import annotations

import re
from typing import Any

from mbody.engines.independent_reading import evaluated
from mbody.laws import MeasuredFormula
from mbody.model.element import Marker
from mbody.model.joints import Revolute

__all__ = ["formula_at"]


def formula_at(
    reference: Any, law: MeasuredFormula, x: float, t: float, q: Any, v: Any, own: Any
) -> float:
    """The value of a formula.

    Parameters
    ----------
    reference : Geometry
        The oracle of the mechanism.
    law : MeasuredFormula
    x, t : float
        What the element's law is of, and the time.
    q, v : arrays (3n + 3,)
        Positions and rates, those of the ground too.
    own : mapping
        Values of inputs and of own states.

    Raises
    ------
    NotImplementedError
        For a quantity that the oracle does not measure.
    """
    machine = reference.mechanism
    scope = machine.parameters.scope().names
    names: dict[str, Any] = {
        name: float(one.value) for name, one in scope.items() if name not in machine.curves
    }
    names |= {"t": t, "x": x, **own}
    text = law.text
    for n, name in enumerate(sorted(set(law.variables), key=len, reverse=True)):
        if "." in name:
            text = re.sub(rf"(?<![\w.]){re.escape(name)}(?![\w.])", f"own_{n}_", text)
            names[f"own_{n}_"] = _quantity(reference, name, q, v, t)
    found = evaluated(text, names, machine)
    if found is None:
        raise NotImplementedError(f"it does not read the formula '{law.text}'")
    return float(found[0])


def _quantity(reference: Any, name: str, q: Any, v: Any, t: float) -> float:
    """A quantity by its dotted name, from positions and rates."""
    owner, _, key = name.rpartition(".")
    element, _, point = owner.partition(".")
    if element in reference.index:
        x, y, angle = reference.pose(q, element)
        vx, vy, omega = reference.pose(v, element)
        if point:
            at = point if point != "origin" else (0.0, 0.0)
            px, py = reference.place(q, Marker(element, at))
            vx, vy, x, y = vx - omega * (py - y), vy + omega * (px - x), px, py
        values = {"x": x, "y": y, "angle": angle, "vx": vx, "vy": vy, "omega": omega}
        return float(values[key])
    one: Any = reference.mechanism[element]
    if one.role == "driver" and key in ("value", "rate"):
        return float(one.law.derivatives(t)[0 if key == "value" else 1])
    if hasattr(one, "body") and key in ("angle", "rate"):
        rows = q if key == "angle" else v
        return float(reference.pose(rows, one.body)[2] - reference.pose(rows, one.by)[2])
    if isinstance(one, Revolute) and key in ("angle", "rate"):
        rows = q if key == "angle" else v
        i, j = (reference.pose(rows, marker.body)[2] for marker in (one.i, one.j))
        return float(j - i)
    if one.role == "load" and key in ("length", "rate"):
        _, length, rate = reference.stretch(q, v, one)
        return length if key == "length" else rate
    raise NotImplementedError(f"it does not measure '{name}'")
