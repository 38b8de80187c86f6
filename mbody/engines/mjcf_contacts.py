"""Contacts in MJCF: shapes of bodies as geoms, the pairs that touch, and ropes as tendons."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any
from xml.etree import ElementTree as ET

from mbody.core.tolerances import MUJOCO_IMPEDANCE
from mbody.engines.balance import Inexpressible, Outline, not_as_rigid_contacts, outlines
from mbody.engines.independent_reading import reading
from mbody.engines.spanning_tree import Branch
from mbody.laws import MeasuredFormula
from mbody.model.contact import Contact, Rope
from mbody.quantities.evaluate import postfix_value
from mbody.system.system import System

# -- Formulas of inputs as actuators: laws that are linear in one input and in a coordinate ----

#: The key of what does not depend on a variable.
PLAIN = ""


@dataclass(frozen=True)
class LinearLaw:
    """A sum of variables with factors and of a constant, kept between two bounds."""

    parts: dict[str, float]
    low: float = -math.inf
    high: float = math.inf

    @property
    def constant(self) -> float | None:
        """Its value, where it has no variable."""
        return self.parts.get(PLAIN, 0.0) if set(self.parts) <= {PLAIN} else None

    @property
    def is_bounded(self) -> bool:
        """Whether a bound is finite."""
        return math.isfinite(self.low) or math.isfinite(self.high)

    def times(self, factor: float) -> LinearLaw:
        """The law times a number."""
        ends = sorted((self.low * factor, self.high * factor)) if factor else (0.0, 0.0)
        return LinearLaw({key: factor * part for key, part in self.parts.items()}, *ends)

    def plus(self, other: LinearLaw, sign: float = 1.0) -> LinearLaw | None:
        """The sum with another; None where both have variables and one is bounded."""
        if (
            other.constant is None
            and self.constant is None
            and (self.is_bounded or other.is_bounded)
        ):
            return None
        first, second = (self, other.times(sign))
        if first.constant is not None:
            first, second = second, first
        shift = second.constant if second.constant is not None else 0.0
        keys = {**first.parts, **second.parts}
        parts = {key: first.parts.get(key, 0.0) + second.parts.get(key, 0.0) for key in keys}
        return LinearLaw(parts, first.low + shift, first.high + shift)


def linear_law(law: MeasuredFormula, curves: Mapping[str, Any]) -> LinearLaw | None:
    """A formula as a linear law, None where it is none; `curves`: what it may call.

    >>> operations = ("variable", "* constant", "+ constant")
    >>> linear_law(MeasuredFormula("2*u - 1", operations, ("u",), (2, -1)), {})
    LinearLaw(parts={'u': 2.0, '': -1.0}, low=-inf, high=inf)
    """

    def applied(operation: str, *given: LinearLaw | None) -> LinearLaw | None:
        laws = [one for one in given if one is not None]
        if len(laws) < len(given):
            return None
        if operation == "negative":
            return laws[0].times(-1.0)
        return _binary(operation, *laws) if len(laws) == 2 else None

    constants = (LinearLaw({PLAIN: float(one)}) for one in law.constants)
    variables = (LinearLaw({name: 1.0}) for name in law.variables)
    found: LinearLaw | None = postfix_value(law.operations, constants, variables, applied, curves)
    return found


def _binary(operation: str, a: LinearLaw, b: LinearLaw) -> LinearLaw | None:
    """The result of an operation on two laws, None where it is not linear."""
    if operation in ("+", "-"):
        return a.plus(b, 1.0 if operation == "+" else -1.0)
    if operation in ("*", "min", "max") and b.constant is None:
        a, b = b, a
    value = b.constant
    if value is None:
        return None
    if operation == "*":
        return a.times(value)
    if operation == "/" and value:
        return a.times(1.0 / value)
    if operation == "min":
        return LinearLaw(a.parts, min(a.low, value), min(a.high, value))
    if operation == "max":
        return LinearLaw(a.parts, max(a.low, value), max(a.high, value))
    return None


# -- Numbers and names as text in MJCF ---------------------------------------------------------


def numbers(unit: float, *values: float) -> str:
    """Numbers times a unit, as text with all digits; rounding errors of the greatest become zero.

    >>> numbers(2.0, 0.5, -1.0, 1e-20)
    '1 -2 0'
    """
    least = 1e-16 * max(map(abs, values))
    kept = (value if abs(value) > least else 0.0 for value in values)
    return " ".join(repr(float(unit * value) + 0.0).removesuffix(".0") for value in kept)


def safe(body: str) -> str:
    """The name of a body in the file, where ``world`` is the ground's.

    >>> safe("crank"), safe("world")
    ('crank', 'world.body')
    """
    return "world.body" if body == "world" else body


HARD = f"{MUJOCO_IMPEDANCE} {MUJOCO_IMPEDANCE} 0.001 0.5 2"
#: Radius of what has none, and thickness of segments, in model lengths.
POINT, BAR = 1e-8, 0.05
#: Half the width of a segment across the plane, in model lengths.
WIDE = 10.0


def unwritable_contacts(system: System) -> Iterator[Inexpressible]:
    """Contacts, and joints that separate, without a counterpart in MuJoCo."""
    yield from not_as_rigid_contacts(system.mechanism, "MuJoCo")
    at = reading(system)
    for one in system.mechanism.contacts:
        if isinstance(one, Contact):
            parts = outlines(at, one)
            kinds = {part.kind for part in parts}
            if any(part.kind == "line" and part.body != "ground" for part in parts):
                yield Inexpressible(one.name, "MuJoCo has planes on the ground only")
            elif "line" not in kinds and ("polygon" in kinds or kinds == {"segment"}):
                why = "MuJoCo has spheres for the corners of a polygon, which touch lines only"
                yield Inexpressible(one.name, why)


def inexpressible_contacts(system: System) -> Iterator[Inexpressible]:
    """Contacts that MuJoCo cannot model as they are."""
    yield from unwritable_contacts(system)
    at = reading(system)
    for one in system.mechanism.contacts:
        static = one.static if isinstance(one, Contact) else None
        if static is not None and at[f"{one.name}.static"] != at[f"{one.name}.friction"]:
            why = "MuJoCo has one coefficient of friction, none of its own for what sticks"
            yield Inexpressible(one.name, why)


class ContactGeoms:
    """Writes the contacts of a mechanism into the elements of a file.

    `hung`: (name in the file, branch) of every body. `unit`: Metres in a unit of length.
    `more`: Attributes of pairs and of the limits of ropes.
    """

    def __init__(
        self,
        system: System,
        hung: Sequence[tuple[str, Branch]],
        unit: float,
        root: ET.Element,
        **more: str,
    ) -> None:
        self.system, self.unit, self.root, self.at = system, unit, root, reading(system)
        self.more = more
        self.bodies = {one.get("name"): one for one in root.iter("body")}
        self.origin = {"ground": (0.0, 0.0)}
        for name, branch in hung:
            self.origin[name] = branch.on_body.x, branch.on_body.y
        self.pairs: dict[str, tuple[str, ...]] = {}
        self.there: dict[tuple[str, str], list[str]] = {}

    def contact(self, one: Contact) -> None:
        """All pairs of a contact."""
        i, j = outlines(self.at, one)
        mu = float(self.at[f"{one.name}.friction"])
        first, second = self._geoms(one.i, i), self._geoms(one.j, j)
        section = self.root.find("contact")
        if section is None:
            section = ET.SubElement(self.root, "contact")
        found: list[str] = []
        for a in first:
            for b in second:
                found.append(f"{one.name}:{len(found)}")
                given = {"name": found[-1], "geom1": a, "geom2": b}
                given |= {"condim": "3" if mu else "1", "friction": f"{mu!r} {mu!r} 0 0 0"}
                ET.SubElement(section, "pair", {**given, "solimp": HARD, **self.more})
        self.pairs[one.name] = tuple(found)

    def rope(self, one: Rope) -> None:
        """A tendon between the two ends."""
        sites = []
        for side in ("i", "j"):
            body = one.places()[side].body
            place = self._position_text(body, tuple(float(part) for part in self.at.arm(one, side)))
            sites.append(f"{one.name}.{side}")
            ET.SubElement(self.bodies[safe(body)], "site", name=sites[-1], pos=place)
        section = self.root.find("tendon")
        if section is None:
            section = ET.SubElement(self.root, "tendon")
        longest = numbers(self.unit, float(self.at[f"{one.name}.length"]))
        given = {"name": one.name, "limited": "true", "range": f"0 {longest}"}
        given |= {f"{key}limit": value for key, value in {"solimp": HARD, **self.more}.items()}
        made = ET.SubElement(section, "spatial", given)
        for site in sites:
            ET.SubElement(made, "site", site=site)

    def _position_text(self, body: str, at: tuple[float, ...]) -> str:
        ox, oy = self.origin[body]
        return numbers(self.unit, at[0] - ox, at[1] - oy, 0.0)

    def _geoms(self, place: str, outline: Outline) -> list[str]:
        key = outline.body, place
        if key not in self.there:
            self.there[key] = list(self._added(place, outline))
        return self.there[key]

    def _added(self, place: str, outline: Outline) -> Iterator[str]:
        size, unit = self.system.length, self.unit
        if outline.kind == "line":
            # the plane's third axis is its normal, to the left of the line
            normal = -math.sin(outline.direction), math.cos(outline.direction), 0.0
            plane = {"size": "0 0 1", "zaxis": numbers(1.0, *normal)}
            yield self._geom(place, outline, "plane", outline.points[0], plane)
            return
        if outline.kind == "segment":
            (ax, ay), (bx, by) = outline.points
            length = math.hypot(bx - ax, by - ay)
            # its upper side is the segment
            mx, my = 0.5 * (ax + bx), 0.5 * (ay + by)
            mx += BAR * size * (by - ay) / length
            my -= BAR * size * (bx - ax) / length
            half = 0.5 * math.atan2(by - ay, bx - ax)
            given = {
                "size": numbers(unit, 0.5 * length, BAR * size, WIDE * size),
                "quat": numbers(1.0, math.cos(half), 0.0, 0.0, math.sin(half)),
            }
            yield self._geom(place, outline, "box", (mx, my), given)
            return
        radius = {"size": numbers(unit, outline.radius or POINT * size)}
        for n, corner in enumerate(outline.points):
            yield self._geom(f"{place}:{n}", outline, "sphere", corner, radius)

    def _geom(
        self, name: str, outline: Outline, kind: str, at: tuple[float, float], more: dict[str, str]
    ) -> str:
        given = {"name": name, "type": kind, "mass": "0", "contype": "0", "conaffinity": "0"}
        given["pos"] = self._position_text(outline.body, at)
        ET.SubElement(self.bodies[safe(outline.body)], "geom", {**given, **more})
        return name
