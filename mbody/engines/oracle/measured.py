"""Formulas of measured quantities, from their text and the oracle's own geometry."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from mbody.engines.independent_reading import evaluated
from mbody.laws import MeasuredFormula
from mbody.model.driver import AngleDriver, DistanceDriver
from mbody.model.element import Marker
from mbody.model.joints import Revolute
from mbody.model.loads import Damper, Spring

__all__ = ["formula_at", "formula_of_positions"]


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
    known = {"t": t, "x": x, **own}
    return float(_value(reference, law, known, lambda name: _quantity(reference, name, q, v, t)))


def formula_of_positions(
    reference: Any, law: MeasuredFormula, q: Any, t: Any, own: Mapping[str, Any]
) -> Any:
    """The value of what a driver follows, at positions (3n + 3, …) and a time that are floats,
    complex numbers or jets.

    Raises
    ------
    NotImplementedError
        For a quantity that is no angle and no place.
    """
    return _value(reference, law, {"t": t, **own}, lambda name: _position(reference, name, q))


def _value(
    reference: Any, law: MeasuredFormula, known: Mapping[str, Any], measure: Callable[[str], Any]
) -> Any:
    """A formula whose dotted names `measure` gives."""
    machine = reference.mechanism
    scope = machine.parameters.scope().names
    names: dict[str, Any] = {
        name: float(one.value) for name, one in scope.items() if name not in machine.curves
    }
    names |= known
    text = law.text
    for n, name in enumerate(sorted(set(law.variables), key=len, reverse=True)):
        if "." in name:
            text = re.sub(rf"(?<![\w.]){re.escape(name)}(?![\w.])", f"own_{n}_", text)
            names[f"own_{n}_"] = measure(name)
    found = evaluated(text, names, machine)
    if found is None:
        raise NotImplementedError(f"it does not read the formula '{law.text}'")
    return found[0]


def _position(reference: Any, name: str, q: Any) -> Any:
    """An angle, a place or a distance by its dotted name."""
    owner, _, key = name.rpartition(".")
    element, _, point = owner.partition(".")
    if element in reference.index and key in ("x", "y", "angle"):
        x, y, angle = reference.pose(q, element)
        if point:
            x, y = reference.place(q, Marker(element, point if point != "origin" else (0.0, 0.0)))
        return {"x": x, "y": y, "angle": angle}[key]
    one: Any = next((e for e in reference.mechanism if e.name == element), None)
    if isinstance(one, Revolute) and key == "angle":
        return reference.pose(q, one.j.body)[2] - reference.pose(q, one.i.body)[2]
    if isinstance(one, AngleDriver) and key == "value":
        return reference.pose(q, one.body)[2] - reference.pose(q, one.relative_to)[2]
    if isinstance(one, DistanceDriver | Spring | Damper) and key in ("value", "length"):
        (xi, yi), (xj, yj) = reference.place(q, one.i), reference.place(q, one.j)
        return np.sqrt((xj - xi) ** 2 + (yj - yi) ** 2)
    raise NotImplementedError(f"it does not measure '{name}'")


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
