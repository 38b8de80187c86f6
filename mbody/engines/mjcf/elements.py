"""Joints that close loops, in MJCF: constraints, tendons, second halves of bodies."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any
from xml.etree import ElementTree as ET

from mbody.engines.mjcf.document import Document
from mbody.engines.mjcf.exported import FileCoordinate, numbers, placed, safe
from mbody.engines.opinion import Inexpressible
from mbody.engines.spanning_tree import Branch, MarkerFrame, Tree, marker_frame
from mbody.model.coupling import AngleCoupling
from mbody.model.element import Element
from mbody.model.joints import Distance, Fixed, Gear, Joint, PinSlot, Prismatic, Revolute

__all__ = ["ClosureWriter", "SAME"]

#: Angles and sites closer than this [rad, model lengths] are the same.
SAME = 1e-9


class ClosureWriter:
    """Writes joints and couplings that close loops, and the tendons and sites of all elements.

    `refused` and `notes` list what is missing; `laws` has the field of a law that the actuator of
    an element cannot have; `built` are the names of the elements in the file.
    """

    def __init__(self, document: Document) -> None:
        self.document, self.system = document, document.system
        self.machine, self.scale = document.machine, document.scale
        self.refused: list[Inexpressible] = []
        self.notes: list[str] = []
        self.laws: dict[str, str] = {}
        self.built: set[str] = {b.joint.name for b in document.tree.branches if b.joint}
        #: Torsion springs whose angle has the opposite sign in the file.
        self.reversed: set[str] = set()
        self.cut: list[tuple[Joint, str]] = []

    def halves(self, tree: Tree) -> dict[str, int]:
        """Number of further parts of each body, for the sliding joints that close loops."""
        sliding = [j for j in (*tree.cuts, *tree.others) if isinstance(j, (Prismatic, PinSlot))]
        found: dict[str, int] = {}
        for joint in sliding:
            body = joint.i.body if joint.j.body == "ground" else joint.j.body
            self.cut.append((joint, body))
            found[body] = found.get(body, 0) + 1
        self.shares = {body: 1.0 / (1 + count) for body, count in found.items()}
        return found

    def _no(self, element: Element, why: str) -> None:
        self.refused.append(Inexpressible(element.name, why))

    def _part(self, key: str, tag: str, name: str, **given: str) -> ET.Element:
        self.built.add(name)
        return ET.SubElement(self.document.parts[key], tag, {"name": name, **given})

    # -- joints that close loops -----------------------------------------------------------------

    def _constraint(self, element: Any) -> None:
        """A joint or coupling that is not in the tree."""
        name = element.name
        if type(element) is Revolute:
            self._connect(element)
        elif type(element) is Fixed:
            one, other = (self._site(element, side, turned=True) for side in ("i", "j"))
            self._part("equality", "weld", name, site1=one, site2=other)
        elif type(element) is Distance:
            self._line(element)
            self._part("equality", "tendon", name, tendon1=name)
        elif type(element) is Gear:
            self._gear(element)
        elif type(element) is AngleCoupling:
            terms = [
                (factor * float(self.system.numbers[f"{name}.{n}.factor"] / term.factor), *bodies)
                for n, term in enumerate(element.parts)
                for factor, bodies in ((term.factor, term.bodies),)
            ]
            self._turns_coupled(element, terms)
        else:
            kind = type(element).__name__
            self._no(element, f"MJCF has no constraint that is a {kind}: the motion is freer there")

    def _connect(self, joint: Revolute) -> None:
        """Two coincident places, given by the place at the start on one of the bodies."""
        # by bodies and not by sites: Pinocchio 4.1 reads a site of the ground as the origin
        sides = "ij" if joint.i.body != "ground" else "ji"
        at = marker_frame(self.system, joint, sides[0])
        one, other = (safe(getattr(joint, side).body) for side in sides)
        place = self.document.frame_of(getattr(joint, sides[0]).body, at.x, at.y)
        anchor = numbers(self.scale.length, *place, 0.0)
        self._part("equality", "connect", joint.name, body1=one, body2=other, anchor=anchor)

    def _half(self, joint: Joint, body: str) -> None:
        """The second half of a body, on the other side of a sliding joint, welded to the
        first half.
        """
        name = f"{body}.{joint.name}"
        i, j = marker_frame(self.system, joint, "i"), marker_frame(self.system, joint, "j")
        other = joint.j.body if body == joint.i.body else joint.i.body
        forward = body == joint.j.body
        if not forward and type(joint) is PinSlot:
            i = self._under_pin(joint, i, j)
        ends = (i, j) if forward else (j, i)
        here = Branch(body, other, "prismatic", joint, *ends, not forward)
        way = Branch(joint.j.body, joint.i.body, "prismatic", joint, i, j)
        if type(joint) is Prismatic:
            columns = [FileCoordinate(joint.name, here, 0, True, ends[1].angle)]
        else:
            # the slot has the direction: displacement before the rotation of the pin, or after it
            turn = Branch(body, other, "revolute", joint, *ends)
            slide = f"{joint.name}.way"
            columns = [FileCoordinate(f"{joint.name}.turn", turn)]
            if forward:
                heading = self.document.pose[joint.i.body][2] + i.angle
                direction = heading - self.document.pose[body][2]
                columns.insert(0, FileCoordinate(slide, way, 0, True, direction))
            else:
                columns.append(FileCoordinate(slide, way, 0, True, i.angle + math.pi))
        self.document.body(here, name, tuple(columns), self.shares[body])
        self.document.origin.setdefault(body, (0.0, 0.0))
        sites = []
        for part in (name, body):
            site = f"{name}.{'half' if part == name else 'rest'}"
            self._put(part, site, (ends[1].x, ends[1].y))
            sites.append(site)
        self._part("equality", "weld", joint.name, site1=sites[0], site2=sites[1])

    def _under_pin(self, joint: Joint, i: MarkerFrame, j: MarkerFrame) -> MarkerFrame:
        """The place of a slot that coincides with its pin at the start."""
        x, y, theta = self.document.pose[joint.i.body]
        near, far = placed(x, y, theta, (i.x, i.y)), (j.x, j.y)
        c, s = math.cos(theta + i.angle), math.sin(theta + i.angle)
        way = c * (far[0] - near[0]) + s * (far[1] - near[1])
        return MarkerFrame(i.x + way * math.cos(i.angle), i.y + way * math.sin(i.angle), i.angle)

    def _gear(self, gear: Gear) -> None:
        """A gear pair by angles: R_i θ_i + R_j θ_j − (R_i + R_j) θ_c is constant, c the carrier."""
        carrier = self._carrier(gear)
        if carrier is None:
            self._no(
                gear,
                "MJCF couples angles, and no body has both centres on revolute joints: the line "
                "of centres has no angle in the file",
            )
            return
        ri, rj = (float(radius) for radius in gear.radii(self.system.numbers))
        scale = self.scale.length
        terms = [(ri * scale, carrier, gear.i.body), (rj * scale, carrier, gear.j.body)]
        self._turns_coupled(gear, terms)
        self.notes.append(
            f"'{gear.name}' couples angles: its motion and its torques are those of the gear pair, "
            "the force at the teeth does not load the bearings"
        )

    def _carrier(self, gear: Gear) -> str | None:
        """A body to which the centres of both wheels are pinned, directly or through others."""
        one, other = (
            self._pinned(getattr(gear, side).body, self.system.numbers.arm(gear, side))
            for side in ("i", "j")
        )
        both = sorted((one & other) - {gear.i.body, gear.j.body})
        return both[0] if both else None

    def _pinned(self, body: str, place: tuple[Any, Any]) -> set[str]:
        """Bodies that revolute joints connect to a body at one place."""
        found, pending = {body}, [(body, place)]
        pins = [joint for joint in self.machine.joints if type(joint) is Revolute]
        while pending:
            name, (x, y) = pending.pop()
            for joint, own, far in ((one, *ends) for one in pins for ends in ("ij", "ji")):
                on, to = getattr(joint, own).body, getattr(joint, far).body
                px, py = self.system.numbers.arm(joint, own)
                near = abs(px - x) + abs(py - y) <= SAME * self.system.length
                if on == name and near and to not in found:
                    found.add(to)
                    pending.append((to, self.system.numbers.arm(joint, far)))
        return found

    def _turns_coupled(self, element: Element, terms: Sequence[tuple[float, str, str]]) -> None:
        """Σ factor · angle of a body from another is constant."""
        parts: dict[str, float] = {}
        for factor, base, body in terms:
            for name, sign in self._turns(body, base).items():
                parts[name] = parts.get(name, 0.0) + factor * sign
        if not self._sum(element.name, parts):
            self._no(element, "none of its angles can change in the tree of bodies")
            return
        self._part("equality", "tendon", element.name, tendon1=element.name)

    # -- tendons and places ----------------------------------------------------------------------

    def _turns(self, body: str, base: str) -> dict[str, float]:
        """Hinges whose sum is the angle of a body from another, with their signs."""
        parts: dict[str, float] = {}
        for name, sign in ((body, 1.0), (base, -1.0)):
            while name != "ground":
                branch = self.document.tree.branch(name)
                for column in self.document.columns:
                    if not column.way and column.of is branch:
                        parts[column.name] = parts.get(column.name, 0.0) + sign
                name = branch.parent
        return {name: sign for name, sign in parts.items() if sign}

    def _sum(self, name: str, parts: dict[str, float], **given: str) -> bool:
        """A fixed tendon: a weighted sum of hinges; False where there is none."""
        kept = {key: factor for key, factor in parts.items() if abs(factor) > 0.0}
        if not kept:
            return False
        made = self._part("tendon", "fixed", name, **given)
        for key, factor in kept.items():
            ET.SubElement(made, "joint", joint=key, coef=numbers(1.0, factor))
        return True

    def _line(self, element: Element, **given: str) -> None:
        """A spatial tendon between the two places of an element."""
        sites = [self._site(element, side) for side in ("i", "j")]
        made = self._part("tendon", "spatial", element.name, **given)
        for site in sites:
            ET.SubElement(made, "site", site=site)

    def _site(self, element: Element, side: str, *, turned: bool = False) -> str:
        """The name of a new site at a place of an element."""
        at, name = marker_frame(self.system, element, side), f"{element.name}.{side}"
        body = element.places()[side].body
        self._put(body, name, (at.x, at.y), at.angle if turned else 0.0)
        return name

    def _put(self, body: str, name: str, at: tuple[float, float], angle: float = 0.0) -> None:
        given = {"name": name}
        given["pos"] = numbers(self.scale.length, *self.document.frame_of(body, *at), 0.0)
        if angle:
            given["quat"] = numbers(1.0, math.cos(0.5 * angle), 0.0, 0.0, math.sin(0.5 * angle))
        ET.SubElement(self.document.inside[body], "site", given)
