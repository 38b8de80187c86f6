"""Contacts in MuJoCo: geoms on the bodies of an exported file, and the pairs that touch."""

from __future__ import annotations

import math
from collections.abc import Iterator
from xml.etree import ElementTree as ET

from mbody.engines.independent_reading import reading
from mbody.engines.mjcf.exported import Exported, numbers, safe
from mbody.engines.opinion import Inexpressible
from mbody.engines.shape_outlines import Outline, not_as_rigid_contacts, outlines
from mbody.model.contact import Contact, Rope
from mbody.system.system import System

__all__ = ["inexpressible_contacts", "with_geoms"]

#: Radius of what has none, and thickness of segments, in model lengths.
POINT, BAR = 1e-8, 0.05
#: Half the width of a segment across the plane, in model lengths.
WIDE = 10.0
#: Greatest impedance that MuJoCo allows for a constraint.
HARD = 0.9999


def inexpressible_contacts(system: System) -> Iterator[Inexpressible]:
    """Contacts that MuJoCo cannot model."""
    yield from not_as_rigid_contacts(system.mechanism, "MuJoCo")
    at = reading(system)
    for one in system.mechanism.contacts:
        if not isinstance(one, Contact):
            continue
        if one.static is not None and at[f"{one.name}.static"] != at[f"{one.name}.friction"]:
            why = "MuJoCo has one coefficient of friction, none of its own for what sticks"
            yield Inexpressible(one.name, why)
        kinds = {part.kind for part in outlines(at, one)}
        if "line" not in kinds and ("polygon" in kinds or kinds == {"segment"}):
            why = "MuJoCo has spheres for the corners of a polygon, which touch lines only"
            yield Inexpressible(one.name, why)


def with_geoms(made: Exported) -> tuple[str, dict[str, tuple[str, ...]]]:
    """The text of the file with its contacts, and the names of the pairs of each contact.

    Discs are spheres, corners and points very small ones, lines planes, segments boxes; ropes are
    tendons with a greatest length.
    """
    root = ET.fromstring(made.text)
    writer = _Geoms(made, root)
    for one in made.system.mechanism.contacts:
        if isinstance(one, Rope):
            writer.rope(one)
        elif isinstance(one, Contact):
            writer.contact(one)
    for flag in root.iter("flag"):
        flag.attrib.pop("contact", None)
    option = root.find("option")
    assert option is not None
    option.set("cone", "elliptic")
    option.set("integrator", "Euler")
    return ET.tostring(root, encoding="unicode"), writer.pairs


class _Geoms:
    def __init__(self, made: Exported, root: ET.Element) -> None:
        self.made, self.root, self.at = made, root, reading(made.system)
        self.bodies = {one.get("name"): one for one in root.iter("body")}
        self.origin = {"ground": (0.0, 0.0)}
        for name, branch in made.hung:
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
                ET.SubElement(
                    section,
                    "pair",
                    name=found[-1],
                    geom1=a,
                    geom2=b,
                    condim="3" if mu else "1",
                    friction=f"{mu!r} {mu!r} 0 0 0",
                    solimp=f"{HARD} {HARD} 0.001 0.5 2",
                )
        self.pairs[one.name] = tuple(found)

    def rope(self, one: Rope) -> None:
        """A tendon between the two ends."""
        sites = []
        for side in ("i", "j"):
            body = one.places()[side].body
            place = self._place(body, tuple(float(part) for part in self.at.arm(one, side)))
            sites.append(f"{one.name}.{side}")
            ET.SubElement(self.bodies[safe(body)], "site", name=sites[-1], pos=place)
        section = self.root.find("tendon")
        if section is None:
            section = ET.SubElement(self.root, "tendon")
        longest = numbers(self.made.scale.length, float(self.at[f"{one.name}.length"]))
        made = ET.SubElement(
            section,
            "spatial",
            name=one.name,
            limited="true",
            range=f"0 {longest}",
            solimplimit=f"{HARD} {HARD} 0.001 0.5 2",
        )
        for site in sites:
            ET.SubElement(made, "site", site=site)

    def _place(self, body: str, at: tuple[float, ...]) -> str:
        ox, oy = self.origin[body]
        return numbers(self.made.scale.length, at[0] - ox, at[1] - oy, 0.0)

    def _geoms(self, place: str, outline: Outline) -> list[str]:
        key = outline.body, place
        if key not in self.there:
            self.there[key] = list(self._added(place, outline))
        return self.there[key]

    def _added(self, place: str, outline: Outline) -> Iterator[str]:
        size, unit = self.made.system.length, self.made.scale.length
        if outline.kind == "line":
            # the plane's third axis is its normal, to the left of the line
            normal = -math.sin(outline.direction), math.cos(outline.direction), 0.0
            far = {"size": "0 0 1", "zaxis": numbers(1.0, *normal)}
            yield self._geom(place, outline, "plane", outline.points[0], far)
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
        given["pos"] = self._place(outline.body, at)
        ET.SubElement(self.bodies[safe(outline.body)], "geom", {**given, **more})
        return name
