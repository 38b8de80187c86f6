"""The writer of MJCF: a mechanism as a model file of MuJoCo, which Pinocchio reads too."""

from __future__ import annotations

import functools
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any
from xml.etree import ElementTree as ET
from xml.sax.saxutils import quoteattr

import numpy as np

from mbody.analysis.initial.close_loops import close_loops
from mbody.analysis.initial.initial_state import initial_state_of
from mbody.analysis.position.assembly_analysis import as_system
from mbody.core import tolerances as tol
from mbody.engines.balance import Inexpressible, follows_formula, signals_of, smooth_alone
from mbody.engines.mjcf_contacts import (
    PLAIN,
    ContactGeoms,
    inexpressible_contacts,
    linear_law,
    numbers,
    safe,
    unwritable_contacts,
)
from mbody.engines.oracle.friction import has_friction
from mbody.engines.spanning_tree import (
    Branch,
    MarkerFrame,
    Tree,
    marker_frame,
    spanning_tree,
    tree_motion,
)
from mbody.errors import ModelError
from mbody.laws import Constant
from mbody.model.contact import Contact, Rope
from mbody.model.coupling import AngleCoupling
from mbody.model.driver import AngleDriver, CoordinateDriver, DistanceDriver
from mbody.model.element import Element
from mbody.model.joints import (
    Clutch,
    Distance,
    Fixed,
    FrictionForce,
    Gear,
    Joint,
    PinSlot,
    Prismatic,
    Revolute,
)
from mbody.model.loads import Damper, Force, Gravity, Spring, Torque, TorsionDamper, TorsionSpring
from mbody.model.mechanism import Mechanism
from mbody.model.numbers import number_in
from mbody.model.states import expanded
from mbody.quantities.units import UnitSystem
from mbody.solution.solution import Solution
from mbody.system.system import System

# -- The exported file with its coordinates, units, and numbers as text ------------------------


@dataclass(frozen=True)
class Scale:
    """SI units in one unit of a mechanism."""

    length: float
    mass: float
    time: float

    @staticmethod
    def of(units: UnitSystem) -> Scale:
        """Those of a unit system."""
        return Scale(*(float(units.unit(key).ratio) for key in ("length", "mass", "time")))

    @property
    def force(self) -> float:
        """Newtons."""
        return self.mass * self.length / self.time**2

    @property
    def torque(self) -> float:
        """Newton metres; joules."""
        return self.force * self.length


@dataclass(frozen=True)
class FileCoordinate:
    """One coordinate of the file.

    `name`: Of its joint in the file.
    `of`: Branch of the tree that has the coordinate.
    `which`: Index in the branch: 0; for a free branch 0, 1, 2 for x, y, angle.
    `slides`: Whether it is a displacement, not an angle.
    `direction`: Of a displacement: on the body [rad], for a free branch in the world.
    """

    name: str
    of: Branch
    which: int = 0
    slides: bool = False
    direction: float = 0.0


@dataclass(frozen=True)
class Exported:
    """A mechanism as a model file.

    `text`: The file, in SI units.
    `not_expressible`: Elements, or what they do besides, that it has no words for, and why.
    `without`: Those of these that are not in the file at all, not even as what they would be
      without friction and always closed.
    `notes`: Differences between the file and the mechanism.
    `columns`: Its coordinates in order; all are zero at the start.
    `artificial_masses`: Bodies that have no mass or inertia in the mechanism and a very small one
      in the file.
    `laws`: Field of the law, by the name of the element of an actuator.
    `built`: Names of all elements in the file.
    `reversed`: Torsion springs whose angle has the opposite sign in the file.
    `hung`: (name in the file, branch) of every body, and of the second halves of bodies.
    `start`: The pose where all coordinates are zero.
    """

    text: str
    not_expressible: tuple[Inexpressible, ...]
    without: tuple[Inexpressible, ...]
    notes: tuple[str, ...]
    columns: tuple[FileCoordinate, ...]
    artificial_masses: tuple[str, ...]
    laws: dict[str, str]
    built: frozenset[str]
    reversed: frozenset[str]
    hung: tuple[tuple[str, Branch], ...]
    system: System
    start: Solution
    scale: Scale

    def motion(self, run: Solution) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Coordinates of the file, rates and accelerations (instants, columns) of a run, in SI
        units.
        """
        tree = Tree(tuple(column.of for column in self.columns), (), ())
        units = np.array([self.scale.length if one.slides else 1.0 for one in self.columns])
        q, v, a = (_selected(part, self.columns) for part in tree_motion(tree, run))
        first = _selected(tree_motion(tree, self.start)[0], self.columns)[-1]
        time = self.scale.time
        return (q - first) * units, v * units / time, a * units / time**2

    def __str__(self) -> str:
        return self.text


def _selected(whole: np.ndarray, columns: tuple[FileCoordinate, ...]) -> np.ndarray:
    """Select the coordinate of each column from those of its branch."""
    ends = np.cumsum([column.of.freedom for column in columns])
    index = [
        int(end) - column.of.freedom + column.which
        for end, column in zip(ends, columns, strict=True)
    ]
    return whole[:, index]


def branch_coordinates(branch: Branch) -> tuple[FileCoordinate, ...]:
    """The coordinates of a branch of the tree."""
    if branch.kind == "free":
        name = branch.body
        return (
            FileCoordinate(f"{name}.x", branch, 0, True, 0.0),
            FileCoordinate(f"{name}.y", branch, 1, True, 0.5 * math.pi),
            FileCoordinate(f"{name}.angle", branch, 2),
        )
    if branch.joint is None or branch.kind == "fixed":
        return ()
    if branch.kind == "prismatic":
        return (FileCoordinate(branch.joint.name, branch, 0, True, branch.on_body.angle),)
    return (FileCoordinate(branch.joint.name, branch),)


def placed(x: float, y: float, theta: float, at: tuple[float, float]) -> tuple[float, float]:
    """The world place [length] of a place on a body at (x, y) with the angle theta."""
    c, s = math.cos(theta), math.sin(theta)
    return x + c * at[0] - s * at[1], y + s * at[0] + c * at[1]


# -- The document of an MJCF file: its sections, and the tree of bodies with their joints ------


class MjcfDocument:
    """One file while it is written: sections, bodies, coordinates.

    `fix_drivers`: Whether constraints fix the driven coordinates.
    `smooth`: Whether it is without contacts, limits, damping of joints, and motors of inputs.
    `pose`: (x, y, θ) of every body at the start, by name.
    `parts`: Sections of the file by tag.
    `inside`: The element of every body, by its name in the file.
    `columns`: Coordinates of the file.
    """

    def __init__(self, system: System, start: Solution, fix_drivers: bool, smooth: bool) -> None:
        self.system, self.machine, self.start = system, system.mechanism, start
        self.fix_drivers, self.smooth = fix_drivers, smooth
        self.scale = Scale.of(self.machine.units)
        self.tree = spanning_tree(system)
        self.pose = {
            name: np.array([start[name].x[-1], start[name].y[-1], start[name].angle[-1]])
            for name in system.bodies
        }
        self.artificial_masses: list[str] = []
        self.hung: list[tuple[str, Branch]] = []
        self.columns: list[FileCoordinate] = []
        self.root = ET.Element("mujoco", model=self.machine.name)
        self.parts = {
            key: ET.Element(key)
            for key in [
                "option",
                "default",
                "worldbody",
                "contact",
                "tendon",
                "equality",
                "actuator",
            ]
        }
        # all bodies are inside one body of the world: Pinocchio 4.1 reads only one
        ground = ET.SubElement(self.parts["worldbody"], "body", name="ground")
        self.inside: dict[str, ET.Element] = {"ground": ground}
        #: Origin of each body's frame in the file, from its mass centre in link axes.
        self.origin = {"ground": (0.0, 0.0)}

    def frame_of(self, body: str, x: float, y: float) -> tuple[float, float]:
        """A place [length] from the mass centre, in the body's frame of the file."""
        ox, oy = self.origin[body]
        return x - ox, y - oy

    def body(
        self, branch: Branch, name: str, columns: tuple[FileCoordinate, ...], share: float = 1.0
    ) -> None:
        """A body with its joints and its share of the mass, on its parent."""
        parent, own = branch.parent, branch.body
        place = (branch.on_body.x, branch.on_body.y)
        self.origin[name] = place
        (px, py, rotation), (x, y, theta) = self.pose[parent], self.pose[own]
        ox, oy = self.origin[parent]
        frame = placed(x, y, theta, place)
        parent_frame = placed(px, py, rotation, (ox, oy))
        dx, dy = frame[0] - parent_frame[0], frame[1] - parent_frame[1]
        c, s = math.cos(rotation), math.sin(rotation)
        half = 0.5 * (theta - rotation)
        made = ET.SubElement(
            self.inside[parent],
            "body",
            name=safe(name),
            pos=numbers(self.scale.length, c * dx + s * dy, c * dy - s * dx, 0.0),
            quat=numbers(1.0, math.cos(half), 0.0, 0.0, math.sin(half)),
        )
        self.inside[name] = made
        self.hung.append((name, branch))
        mass, inertia = self._inertia(own)
        cg = self.frame_of(name, 0.0, 0.0)
        moment = share * inertia * self.scale.mass * self.scale.length**2
        ET.SubElement(
            made,
            "inertial",
            pos=numbers(self.scale.length, *cg, 0.0),
            mass=numbers(self.scale.mass, share * mass),
            diaginertia=numbers(moment, 0.5, 0.5, 1.0),
        )
        for column in columns:
            self._joint(made, column, theta)
            self.columns.append(column)

    def _joint(self, made: ET.Element, column: FileCoordinate, theta: float) -> None:
        """A hinge about z at the frame, or a slide along a direction on the body."""
        given = {"name": column.name, "type": "slide" if column.slides else "hinge"}
        if column.slides:
            direction = column.direction - (theta if column.of.kind == "free" else 0.0)
            given["axis"] = numbers(1.0, math.cos(direction), math.sin(direction), 0.0)
        else:
            given["axis"] = "0 0 1"
        ET.SubElement(made, "joint", given)

    def _inertia(self, body: str) -> tuple[float, float]:
        """Mass and inertia [of the mechanism]; very small ones where there are none."""
        b, own = self.system.bodies[body], self.system.mass[:, 0]
        moving = own[: self.system.coordinates]
        greatest = float(moving[0::3].max()) or 1.0
        widest = float(moving[2::3].max()) or greatest * self.system.length**2
        mass, inertia = float(own[3 * b]), float(own[3 * b + 2])
        if (mass <= 0.0 or inertia <= 0.0) and body not in self.artificial_masses:
            self.artificial_masses.append(body)
        if mass and not inertia:
            # more than the least that MuJoCo accepts
            least = 1e-14 / (self.scale.mass * self.scale.length**2)
            return mass, max(tol.MUJOCO_ARTIFICIAL_INERTIA * mass * self.system.length**2, least)
        return (
            mass or tol.MUJOCO_ARTIFICIAL_MASS * greatest,
            inertia or tol.MUJOCO_ARTIFICIAL_MASS * widest,
        )


# -- Joints that close loops, in MJCF: constraints, tendons, second halves of bodies -----------


class ClosureWriter:
    """Writes joints and couplings that close loops, and the tendons and sites of all elements.

    `refused` and `notes` list what is missing; `laws` has the field of a law that the actuator of
    an element cannot have; `built` are the names of the elements in the file.
    """

    def __init__(self, document: MjcfDocument) -> None:
        self.document, self.system = document, document.system
        self.machine, self.scale = document.machine, document.scale
        self.refused: list[Inexpressible] = []
        self.notes: list[str] = []
        self.laws: dict[str, str] = {}
        self.built: set[str] = {b.joint.name for b in document.tree.branches if b.joint}
        #: Torsion springs whose angle has the opposite sign in the file.
        self.reversed: set[str] = set()
        self.cut: list[tuple[Joint, str]] = []
        #: The input that is the control of an actuator.
        self.controls: dict[str, str] = {}

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

    def _add_element(self, key: str, tag: str, name: str, **given: str) -> ET.Element:
        self.built.add(name)
        return ET.SubElement(self.document.parts[key], tag, {"name": name, **given})

    # -- joints that close loops -----------------------------------------------------------------

    def _constraint(self, element: Any) -> None:
        """A joint or coupling that is not in the tree."""
        name = element.name
        if type(element) is Revolute:
            self._connect(element)
        elif type(element) is Fixed:
            one, other = (self._site(element, side, rotated=True) for side in ("i", "j"))
            self._add_element("equality", "weld", name, site1=one, site2=other)
        elif type(element) is Distance:
            self._line(element)
            self._add_element("equality", "tendon", name, tendon1=name)
        elif type(element) is Gear:
            self._gear(element)
        elif type(element) is AngleCoupling:
            terms = [
                (factor * float(self.system.numbers[f"{name}.{n}.factor"] / term.factor), *bodies)
                for n, term in enumerate(element.parts)
                for factor, bodies in ((term.factor, term.bodies),)
            ]
            self._couple_angles(element, terms)
        elif not self.document.smooth and type(element) in (Clutch, FrictionForce):
            self._constant_friction(element)
        else:
            kind = type(element).__name__
            self._no(element, f"MJCF has no constraint that is a {kind}: the motion is freer there")

    def _constant_friction(self, element: Any) -> None:
        """The friction of a clutch or a packing, where its size is constant."""
        name, turns = element.name, type(element) is Clutch
        law = getattr(element, element.size)
        if not isinstance(law, Constant) or float(self.system.numbers[f"{name}.static"]) != 1.0:
            self._no(element, "friction in MJCF is constant and the same where it sticks")
            return
        value = max(float(self.system.law_of(element, element.size)(0.0)), 0.0)
        loss = numbers(self.scale.torque if turns else self.scale.force, value)
        if turns:
            hinges = self._hinges(element.j.body, element.i.body)
            if not self._sum(name, hinges, frictionloss=loss):
                self._no(element, "its bodies do not turn against each other")
        elif column := self.slide_along(element):
            self._joint_of(column[0]).set("frictionloss", loss)
            self.built.add(name)
        else:
            self._no(element, "no slide of the file has its direction")

    def _joint_of(self, column: FileCoordinate) -> ET.Element:
        joints = self.document.parts["worldbody"].iter("joint")
        return next(joint for joint in joints if joint.get("name") == column.name)

    def attributes(self) -> list[Inexpressible]:
        """Write limits and damping of the joints in the tree; what joints do besides and MJCF has
        not.
        """
        found, tree = [], {b.joint.name: b for b in self.document.tree.branches if b.joint}
        for joint in self.machine.joints:
            lost = self._joint_attributes(joint, tree.get(joint.name))
            if lost and isinstance(joint, Clutch | FrictionForce):
                continue
            if lost:
                found.append(Inexpressible(joint.name, ", ".join(lost)))
        return found

    def _joint_attributes(self, joint: Any, branch: Branch | None) -> list[str]:
        """What a joint does besides and MJCF has not; the rest is written."""
        at, name, lost = self.system.numbers, joint.name, []
        plain = branch is not None and type(joint) in (Revolute, Prismatic)
        column = next((c for c in self.document.columns if c.of is branch), None)
        damped = plain and getattr(joint, "viscous", None) is not None
        if damped and column:
            angular = type(joint) is Revolute
            unit = self.scale.torque if angular else self.scale.force / self.scale.length
            damping = numbers(unit * self.scale.time, float(at[f"{name}.viscous"]))
            self._joint_of(column).set("damping", damping)
        viscous_alone = damped and getattr(joint, "friction", None) is None
        if has_friction(joint) and not viscous_alone:
            lost.append("its friction, which follows the reaction")
        if joint.limited:
            ends = joint.limits if plain and column and not joint.can_separate else None
            if ends is None or None in ends or branch is None or column is None:
                lost.append("its limits" + ("" if plain else ", of a joint that closes a loop"))
            else:
                self._limits(joint, branch, column)
                if joint.restitution is not None and float(at[f"{name}.restitution"]):
                    lost.append("its restitution: limits of MuJoCo do not rebound")
        if joint.can_separate:
            lost.append("that it separates")
        return lost

    def _limits(self, joint: Any, branch: Branch, column: FileCoordinate) -> None:
        """The range of a joint, from the start."""
        key = "angle" if type(joint) is Revolute else "travel"
        now = float(np.ravel(self.document.start.measure(f"{joint.name}.{key}"))[-1])
        unit = 1.0 if key == "angle" else self.scale.length
        ends = [
            (float(self.system.numbers[f"{joint.name}.limits.{end}"]) - now) * unit
            for end in ("low", "high")
        ]
        ends = [-ends[1], -ends[0]] if branch.reversed else ends
        self._joint_of(column).set("range", numbers(1.0, *ends))

    def slide_along(self, element: Any) -> tuple[FileCoordinate, float] | None:
        """The slide of the file that has the direction of an element's guide, and its sign."""
        base = self.document.pose[element.i.body][2]
        base += marker_frame(self.system, element, "i").angle
        for column in self.document.columns:
            branch = column.of
            if not column.slides or type(branch.joint) is not Prismatic:
                continue
            pair = (branch.parent, branch.body)
            ends = (element.i.body, element.j.body)
            if branch.kind != "prismatic" or pair not in (ends, ends[::-1]):
                continue
            heading = self.document.pose[branch.body][2] + column.direction
            along = float(np.cos(heading - base))
            if abs(abs(along) - 1.0) <= tol.POINT_SAME:
                return column, round(along) * (1.0 if pair[0] == element.i.body else -1.0)
        return None

    def _connect(self, joint: Revolute) -> None:
        """Two coincident places, given by the place at the start on one of the bodies."""
        # by bodies and not by sites: Pinocchio 4.1 reads a site of the ground as the origin
        sides = "ij" if joint.i.body != "ground" else "ji"
        at = marker_frame(self.system, joint, sides[0])
        one, other = (safe(getattr(joint, side).body) for side in sides)
        place = self.document.frame_of(getattr(joint, sides[0]).body, at.x, at.y)
        anchor = numbers(self.scale.length, *place, 0.0)
        self._add_element("equality", "connect", joint.name, body1=one, body2=other, anchor=anchor)

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
        slider = Branch(joint.j.body, joint.i.body, "prismatic", joint, i, j)
        if type(joint) is Prismatic:
            columns = [FileCoordinate(joint.name, here, 0, True, ends[1].angle)]
        else:
            # the slot has the direction: displacement before the rotation of the pin, or after it
            hinge = Branch(body, other, "revolute", joint, *ends)
            slide = f"{joint.name}.way"
            columns = [FileCoordinate(f"{joint.name}.turn", hinge)]
            if forward:
                heading = self.document.pose[joint.i.body][2] + i.angle
                direction = heading - self.document.pose[body][2]
                columns.insert(0, FileCoordinate(slide, slider, 0, True, direction))
            else:
                columns.append(FileCoordinate(slide, slider, 0, True, i.angle + math.pi))
        self.document.body(here, name, tuple(columns), self.shares[body])
        self.document.origin.setdefault(body, (0.0, 0.0))
        sites = []
        for part in (name, body):
            site = f"{name}.{'half' if part == name else 'rest'}"
            self._put(part, site, (ends[1].x, ends[1].y))
            sites.append(site)
        self._add_element("equality", "weld", joint.name, site1=sites[0], site2=sites[1])

    def _under_pin(self, joint: Joint, i: MarkerFrame, j: MarkerFrame) -> MarkerFrame:
        """The place of a slot that coincides with its pin at the start."""
        x, y, theta = self.document.pose[joint.i.body]
        at_i, at_j = placed(x, y, theta, (i.x, i.y)), (j.x, j.y)
        c, s = math.cos(theta + i.angle), math.sin(theta + i.angle)
        along = c * (at_j[0] - at_i[0]) + s * (at_j[1] - at_i[1])
        return MarkerFrame(
            i.x + along * math.cos(i.angle), i.y + along * math.sin(i.angle), i.angle
        )

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
        self._couple_angles(gear, terms)
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
            for joint, own, other in ((one, *ends) for one in pins for ends in ("ij", "ji")):
                on, to = getattr(joint, own).body, getattr(joint, other).body
                px, py = self.system.numbers.arm(joint, own)
                at_place = abs(px - x) + abs(py - y) <= tol.POINT_SAME * self.system.length
                if on == name and at_place and to not in found:
                    found.add(to)
                    pending.append((to, self.system.numbers.arm(joint, other)))
        return found

    def _couple_angles(self, element: Element, terms: Sequence[tuple[float, str, str]]) -> None:
        """Σ factor · angle of a body from another is constant."""
        parts: dict[str, float] = {}
        for factor, base, body in terms:
            for name, sign in self._hinges(body, base).items():
                parts[name] = parts.get(name, 0.0) + factor * sign
        if not self._sum(element.name, parts):
            self._no(element, "none of its angles can change in the tree of bodies")
            return
        self._add_element("equality", "tendon", element.name, tendon1=element.name)

    # -- tendons and places ----------------------------------------------------------------------

    def _hinges(self, body: str, base: str) -> dict[str, float]:
        """Hinges whose sum is the angle of a body from another, with their signs."""
        parts: dict[str, float] = {}
        for name, sign in ((body, 1.0), (base, -1.0)):
            while name != "ground":
                branch = self.document.tree.branch(name)
                for column in self.document.columns:
                    if not column.slides and column.of is branch:
                        parts[column.name] = parts.get(column.name, 0.0) + sign
                name = branch.parent
        return {name: sign for name, sign in parts.items() if sign}

    def _sum(self, name: str, parts: dict[str, float], **given: str) -> bool:
        """A fixed tendon: a weighted sum of hinges; False where there is none."""
        kept = {key: factor for key, factor in parts.items() if abs(factor) > 0.0}
        if not kept:
            return False
        made = self._add_element("tendon", "fixed", name, **given)
        for key, factor in kept.items():
            ET.SubElement(made, "joint", joint=key, coef=numbers(1.0, factor))
        return True

    def _line(self, element: Element, **given: str) -> None:
        """A spatial tendon between the two places of an element."""
        sites = [self._site(element, side) for side in ("i", "j")]
        made = self._add_element("tendon", "spatial", element.name, **given)
        for site in sites:
            ET.SubElement(made, "site", site=site)

    def _site(self, element: Element, side: str, *, rotated: bool = False) -> str:
        """The name of a new site at a place of an element."""
        at, name = marker_frame(self.system, element, side), f"{element.name}.{side}"
        body = element.places()[side].body
        self._put(body, name, (at.x, at.y), at.angle if rotated else 0.0)
        return name

    def _put(self, body: str, name: str, at: tuple[float, float], angle: float = 0.0) -> None:
        given = {"name": name}
        given["pos"] = numbers(self.scale.length, *self.document.frame_of(body, *at), 0.0)
        if angle:
            given["quat"] = numbers(1.0, math.cos(0.5 * angle), 0.0, 0.0, math.sin(0.5 * angle))
        ET.SubElement(self.document.inside[body], "site", given)


# -- Loads and drivers in MJCF: tendons and actuators ------------------------------------------


class ElementWriter(ClosureWriter):
    """Writes all elements of a file except its tree of bodies."""

    def write(self) -> None:
        """Write every joint that closes a loop, every coupling, load and driver."""
        for joint, body in self.cut:
            self._half(joint, body)
        tree = self.document.tree
        for element in (*tree.cuts, *tree.others):
            if element.name not in self.built:
                self._constraint(element)
        for load in self.machine.loads:
            self._load(load)
        for driver in self.machine.drivers:
            self._driver(driver)

    @staticmethod
    def varies(element: Any, fields: tuple[str, ...]) -> bool:
        """Whether a law of an element is not constant."""
        laws = [getattr(element, field) for field in fields]
        return not all(law is None or isinstance(law, Constant) for law in laws)

    def _load(self, load: Any) -> None:
        kind, name, at = type(load), load.name, self.system.numbers
        if follows_formula(load):
            why = self._signal(load)
            if why:
                self._no(load, why)
        elif kind is Gravity and not self.varies(load, ("x", "y")):
            self.built.add(name)
        elif kind is Gravity:
            self._no(load, "gravity varies with time, in MJCF it is constant")
        elif kind in (Force, Torque):
            self._applied_load(load)
        elif kind in (Spring, Damper, TorsionSpring, TorsionDamper) and load.law is None:
            angular = kind in (TorsionSpring, TorsionDamper)
            unit = self.scale.torque if angular else self.scale.force / self.scale.length
            if kind in (Damper, TorsionDamper):
                given = {
                    "damping": numbers(unit * self.scale.time, float(at[f"{name}.coefficient"]))
                }
                self._tendon(load, angular, given, 1.0)
            else:
                self._spring(load, angular, unit)
        elif getattr(load, "law", None) is not None:
            self._no(load, "its force has a law, in MJCF springs and dampers are linear")
        else:
            self._no(load, f"MJCF has no load that is a {kind.__name__}")

    def _spring(self, load: Any, angular: bool, unit: float) -> None:
        """A spring as a tendon: F = k (l − l₀) with the preload in l₀."""
        at, name = self.system.numbers, load.name
        stiffness, preload = (float(at[f"{name}.{key}"]) for key in ("stiffness", "preload"))
        if stiffness <= 0.0:
            self._no(load, f"its stiffness is {stiffness:g}, a tendon of MJCF needs a positive one")
            return
        free_length = -preload / stiffness
        if angular:
            pose = self.document.pose
            free_length += float(at[f"{name}.free_angle"]) - (pose[load.body][2] - pose[load.by][2])
        else:
            free_length = (free_length + float(at[f"{name}.free_length"])) * self.scale.length
        # a negative rest length would mean that of the start: the angle gets the opposite sign
        sign = -1.0 if angular and free_length < 0.0 else 1.0
        if sign < 0.0:
            self.reversed.add(name)
        if free_length < 0.0 and not angular:
            self._no(
                load,
                "its preload pulls at every length; a tendon of MJCF has no negative rest length",
            )
            return
        given = {"stiffness": numbers(unit, stiffness), "springlength": numbers(sign, free_length)}
        self._tendon(load, angular, given, sign)

    def _tendon(self, load: Any, angular: bool, given: dict[str, str], sign: float) -> None:
        if not angular:
            self._line(load, **given)
            return
        hinges = {key: sign * part for key, part in self._hinges(load.body, load.by).items()}
        if not self._sum(load.name, hinges, **given):
            self._no(load, "its bodies do not turn against each other")

    def _applied_load(self, load: Any) -> None:
        """A force or a torque as an actuator: with its value where that is constant."""
        name = load.name
        value = float(self.system.law_of(load, "value")(0.0))
        unit = self.scale.force if type(load) is Force else self.scale.torque
        if self.varies(load, ("value",)):
            if self._actuator(load, "motor", {}):
                self.laws[name] = "value"
                self.notes.append(f"'{name}' is a motor, its law of time is not in the file")
            return
        # its control is added to the value, so that a control of 0 leaves it
        bias = numbers(unit, value, 0, 0)
        self._actuator(load, "general", {"biastype": "affine", "gainprm": "1", "biasprm": bias})

    def _actuator(self, load: Any, tag: str, given: dict[str, str], gain: float = 1.0) -> bool:
        """An actuator that pushes a place, or turns a body; False where nothing turns."""
        name = load.name
        if type(load) is Torque:
            more = {} if gain == 1.0 else {"gear": numbers(1.0, gain)}
            if not self._angle_actuator(load, tag, load.body, load.by, {**given, **more}):
                self._no(load, "its bodies do not turn against each other")
                return False
            return True
        at = marker_frame(self.system, load, "at")
        angle = float(self.system.numbers[f"{name}.angle"])
        self._put(load.at.body, f"{name}.at", (at.x, at.y), at.angle if load.follows else 0.0)
        if not load.follows:
            given = {**given, "refsite": self._world()}
        gear = numbers(1.0, gain * math.cos(angle), gain * math.sin(angle), 0, 0, 0, 0)
        self._add_element("actuator", tag, name, site=f"{name}.at", gear=gear, **given)
        return True

    def _signal(self, load: Any) -> str:
        """A force or a torque by a formula of an input as an actuator with that control; why it is
        none, else.
        """
        if self.document.smooth:
            return "its law is a formula of measured quantities, which MJCF has not"
        if type(load) not in (Force, Torque):
            return f"MJCF has no {type(load).__name__} by a formula"
        whole: Any = self.system.law_of(load, "value")
        formula = functools.partial(self.system.law_of, field="formula")
        law = linear_law(expanded(whole, self.machine, formula), self.machine.curves)
        inputs = {one.name: one for one in self.machine.inputs}
        used = [key for key in (law.parts if law else ()) if key in inputs]
        measured = {key for key in (law.parts if law else ()) if key not in inputs} - {PLAIN}
        if law is None or len(used) > 1:
            return "its formula is not linear in one input, which an actuator of MJCF is"
        ends = (load.body, load.by) if type(load) is Torque else ("", "")
        gains = [law.parts.get(f"{ends[0]}.{key}", 0.0) for key in ("angle", "omega")]
        wanted = {f"{ends[0]}.{key}": g for key, g in zip(("angle", "omega"), gains, strict=True)}
        if ends[1] != "ground":
            wanted |= {f"{ends[1]}.{key.partition('.')[2]}": -g for key, g in wanted.items()}
        if measured - wanted.keys() or any(law.parts.get(k, 0.0) != g for k, g in wanted.items()):
            return "its formula measures more than the angle and the rate that it acts on"
        unit = self.scale.torque if type(load) is Torque else self.scale.force
        gain, name = 0.0, load.name
        if used:
            dimension = inputs[used[0]].dimension
            own = self.machine.units.unit(dimension).factor if dimension is not None else 1.0
            gain = law.parts[used[0]] * unit / own
        pose = self.document.pose
        turned = pose[ends[0]][2] - pose[ends[1]][2] if any(gains) else 0.0
        bias = [law.parts.get(PLAIN, 0.0) + gains[0] * turned, gains[0], gains[1] * self.scale.time]
        given = {}
        if law.is_bounded:
            # a bound that is none is far beyond the other
            far = 2.0 * max(abs(v) for v in (law.low, law.high) if math.isfinite(v)) + 1.0
            bounds = (max(law.low, -far), min(law.high, far))
            given["forcerange"] = numbers(unit, *bounds)
        if any(bias) or law.is_bounded:
            given |= {"biastype": "affine", "biasprm": numbers(unit, *bias), "gainprm": repr(gain)}
            written = self._actuator(load, "general", given)
        else:
            written = self._actuator(load, "motor", given, gain)
        if written and used:
            self.controls[name] = used[0]
            self.notes.append(f"'{name}' is a motor, its control is the input '{used[0]}' in SI")
        return ""

    def _world(self) -> str:
        """A site with the axes of the world, for directions."""
        ground = self.document.inside["ground"]
        if not any(site.get("name") == "ground" for site in ground.findall("site")):
            self._put("ground", "ground", (0.0, 0.0))
        return "ground"

    def _angle_actuator(
        self, element: Element, tag: str, body: str, base: str, given: dict[str, str]
    ) -> bool:
        """An actuator of the angle of a body from another; False where nothing turns."""
        hinges = self._hinges(body, base)
        if not hinges:
            return False
        if list(hinges.values()) == [1.0]:
            self._add_element("actuator", tag, element.name, joint=next(iter(hinges)), **given)
        else:
            self._sum(element.name, hinges)
            self._add_element("actuator", tag, element.name, tendon=element.name, **given)
        return True

    # -- drivers ---------------------------------------------------------------------------------

    def _driver(self, driver: Any) -> None:
        """A motor of the driven coordinate, without the law."""
        done, name = True, driver.name
        if type(driver) is AngleDriver:
            done = self._angle_actuator(driver, "motor", driver.body, driver.relative_to, {})
        elif type(driver) is DistanceDriver:
            self._line(driver)
            self._add_element("actuator", "motor", name, tendon=name)
        elif type(driver) is CoordinateDriver:
            done = self._slid(driver) or self._pushed(driver)
        if not done:
            self._no(driver, "no joint or place of the file has its coordinate")
            return
        if self.document.fix_drivers and not self._fixed(name):
            self._no(driver, "no constraint of MJCF fixes a place along a direction of the world")
            return
        self.laws[name] = "law"
        self.notes.append(f"'{name}' is a motor, its law of time is not in the file")

    def _pushed(self, driver: CoordinateDriver) -> bool:
        """A motor that pushes a place along a direction of the ground; False for another body's."""
        if driver.i.body != "ground":
            return False
        at, base = marker_frame(self.system, driver, "j"), marker_frame(self.system, driver, "i")
        site, world = f"{driver.name}.j", self._world()
        self._put(driver.j.body, site, (at.x, at.y))
        gear = numbers(1.0, math.cos(base.angle), math.sin(base.angle), 0, 0, 0, 0)
        self._add_element("actuator", "motor", driver.name, site=site, refsite=world, gear=gear)
        return True

    def _fixed(self, name: str) -> bool:
        """A constraint that fixes the coordinate of a motor; False where there is none."""
        motor = self.document.parts["actuator"][-1]
        for key in ("joint", "tendon"):
            if motor.get(key):
                self._add_element("equality", key, name, **{f"{key}1": str(motor.get(key))})
                return True
        return False

    def _slid(self, driver: CoordinateDriver) -> bool:
        """A motor of a slide that has the driven direction; False where there is none."""
        found = self.slide_along(driver)
        if found is None:
            return False
        column, sign = found
        self._add_element(
            "actuator", "motor", driver.name, joint=column.name, gear=numbers(1.0, sign)
        )
        return True


#: Steps in the shortest characteristic time of the start: of an oscillation, a revolution, a
#: passage.
STEPS = 500


def to_mjcf(
    model: Mechanism | System,
    start: Solution | None = None,
    *,
    fix_drivers: bool = False,
    smooth: bool = False,
) -> Exported:
    """A mechanism as MJCF, the model files of MuJoCo: a tree of bodies, and constraints that close
    its loops.

    Parameters
    ----------
    model : Mechanism or System
        Of one design.
    start : Solution, optional
        Its last instant is the pose of the file, where all coordinates are zero. By default the
        start of the mechanism's own simulation, or the pose found by `close_loops` (always for a
        System).
    fix_drivers : bool
        Whether constraints fix the driven coordinates, in addition to the motors.
    smooth : bool
        Whether to leave out contacts, limits, damping and constant friction of joints, and motors
        of inputs, as the cross-check does, which has these by other ways.

    Returns
    -------
    Exported
        `text` is the file, in SI units; `not_expressible` and `notes` list what is not in it.

    Raises
    ------
    ModelError
        For a batch.
    SolveError
        Where the loops do not close.

    Notes
    -----
    Revolute, prismatic and fixed joints form the tree, as hinges and slides; those that close loops
    are ``<connect>`` and ``<weld>``. A prismatic or pin-in-slot joint that closes a loop is a tree
    joint of a second half of its body, welded to the first: the masses remain exact. Rods, springs
    and dampers are tendons, gears and couplings of angles constraints on tendons. Drivers are
    motors without their laws.

    MuJoCo's constraints are springs: those here have ω = 0.7/h of the file's time step h.

    Examples
    --------
    >>> import mbody
    >>> made = to_mjcf(mbody.makers.four_bar(1, 3, 2, 3.5, masses=(1, 1, 1)))
    >>> made.text.count("<joint name"), made.text.count("<connect "), made.not_expressible
    (3, 1, ())
    """
    system = as_system(model)
    if system.batch is not None:
        raise ModelError(
            f"a file has one design, this is a batch of {system.batch} designs: export one of "
            "them, system.design(n)"
        )
    machine = system.mechanism
    if start is None and machine.simulation is not None and not isinstance(model, System):
        start = initial_state_of(system, machine.simulation)
    elif start is None:
        start = close_loops(system)
    described = model if isinstance(model, Mechanism) else machine
    return MjcfWriter(system, start, described, fix_drivers=fix_drivers, smooth=smooth).export()


class MjcfWriter:
    """The writer of one file."""

    def __init__(
        self,
        system: System,
        start: Solution,
        described: Mechanism,
        *,
        fix_drivers: bool,
        smooth: bool,
    ) -> None:
        self.document = MjcfDocument(system, start, fix_drivers, smooth)
        self.system, self.machine, self.start = system, system.mechanism, start
        self.touches = False
        #: With its groups of contacts, which the system has one by one.
        self.described = described
        self.scale = self.document.scale

    def export(self) -> Exported:
        """The whole file."""
        elements = ElementWriter(self.document)
        halves = elements.halves(self.document.tree)
        for branch in self.document.tree.branches:
            share = 1.0 / (1 + halves.get(branch.body, 0))
            self.document.body(branch, branch.body, branch_coordinates(branch), share)
        elements.write()
        besides = list(smooth_alone(self.described))
        if not self.document.smooth:
            besides = [*elements.attributes(), *self._contacts()]
        self._options()
        self._rods()
        self.document.root.append(ET.Element("compiler", angle="radian", autolimits="true"))
        for part in self.document.parts.values():
            if len(part) or part.attrib:
                self.document.root.append(part)
        made = self._exported(elements, besides)
        self._keyframe(made, elements.controls)
        head = self._head(made)
        return Exported(
            **{**vars(made), "text": "\n".join([*head, *_lines(self.document.root)]) + "\n"}
        )

    def _contacts(self) -> list[Inexpressible]:
        """Write the contacts and ropes; those that are not, and what they do besides."""
        system, at = self.system, self.system.numbers
        names = {one.name for one in system.mechanism.contacts}
        without = {one.element: one.why for one in unwritable_contacts(system)}
        lost = {name: why for name, why in without.items() if name in names}
        besides = {one.element: one.why for one in inexpressible_contacts(system)}
        besides = {name: f"its static friction: {why}" for name, why in besides.items()}
        more = {"solref": numbers(1.0, 2.0 * self.step(), 1.0)}
        root = ET.Element("mujoco")
        root.extend([self.document.parts[key] for key in ("worldbody", "tendon", "contact")])
        writer = ContactGeoms(system, self.document.hung, self.scale.length, root, **more)
        for one in system.mechanism.contacts:
            if one.name in lost:
                continue
            if isinstance(one, Rope):
                writer.rope(one)
            elif isinstance(one, Contact):
                writer.contact(one)
                self.touches = True
                if float(at[f"{one.name}.restitution"]):
                    besides[one.name] = "its restitution: contacts of MuJoCo do not rebound"
        found = {name: why for name, why in besides.items() if name in names} | lost
        groups = [group.name for group in self.described.groups]
        return [
            Inexpressible(next((g for g in groups if name.startswith(f"{g}_")), name), why)
            for name, why in found.items()
        ]

    def _exported(self, elements: ElementWriter, besides: list[Inexpressible]) -> Exported:
        # MuJoCo counts coordinates in the order of the file
        order = [joint.get("name") for joint in self.document.parts["worldbody"].iter("joint")]
        self.document.columns.sort(key=lambda column: order.index(column.name))
        notes = list(elements.notes)
        if self.document.artificial_masses:
            notes.append(
                f"{', '.join(repr(one) for one in self.document.artificial_masses)}: without mass "
                "or inertia; the file has very small ones "
                f"({tol.MUJOCO_ARTIFICIAL_MASS:g} of the greatest, "
                f"{tol.MUJOCO_ARTIFICIAL_INERTIA:g} for point masses), since MuJoCo cannot move a "
                "massless body; where loads act on these alone its steps are unstable: give them "
                "masses before the file is run freely"
            )
        controls = set(elements.controls.values())
        signals = (one for one in signals_of(self.machine) if one.element not in controls)
        without = (*elements.refused, *signals)
        named = {one.element for one in without}
        more = dict.fromkeys(one for one in besides if one.element not in named)
        return Exported(
            text="",
            not_expressible=(*without, *more),
            without=without,
            notes=tuple(notes),
            columns=tuple(self.document.columns),
            artificial_masses=tuple(self.document.artificial_masses),
            laws=elements.laws,
            built=frozenset(elements.built | {b.name for b in self.machine.bodies}),
            reversed=frozenset(elements.reversed),
            hung=tuple(self.document.hung),
            system=self.system,
            start=self.start,
            scale=self.scale,
        )

    def step(self) -> float:
        """A time step [s] that resolves the motion at the start: a round number."""
        scale, moving = self.scale, self.start
        bodies = [body.name for body in self.machine.bodies]
        rates = [abs(float(moving[name].omega[-1])) for name in bodies]
        speeds = [
            math.hypot(moving[n].vx[-1], moving[n].vy[-1]) / self.system.length for n in bodies
        ]
        pull = math.hypot(*self.gravity()) / (self.system.length * scale.length)
        rate = max([*(r / scale.time for r in rates + speeds), math.sqrt(pull), 1e-3])
        simulation = self.machine.simulation
        if simulation is not None:
            until = number_in(self.machine, simulation.until, "time", "simulation", "until")
            rate = max(rate, 1.0 / (until * scale.time))
        return float(f"{min(1.0 / (STEPS * rate), 0.01):.0e}")

    def gravity(self) -> tuple[float, float]:
        """Constant gravity [m/s²], all loads of it together."""
        unit = self.scale.length / self.scale.time**2
        loads = [one for one in self.machine.loads if isinstance(one, Gravity)]
        fields = [
            tuple(self.system.law_of(load, key) for key in ("x", "y"))
            for load in loads
            if load.name not in self._varying and not follows_formula(load)
        ]
        x, y = (unit * sum(float(pair[n](0.0)) for pair in fields) for n in (0, 1))
        return x, y

    @property
    def _varying(self) -> set[str]:
        """Names of gravity loads that vary with time."""
        fields = [one for one in self.machine.loads if isinstance(one, Gravity)]
        return {one.name for one in fields if ElementWriter.varies(one, ("x", "y"))}

    def _options(self) -> None:
        h = self.step()
        k = 0.5 / h**2
        x, y = self.gravity()
        option = self.document.parts["option"]
        option.set("timestep", numbers(1.0, h))
        option.set("integrator", "Euler" if self.touches else "RK4")
        option.set("gravity", numbers(1.0, x, y, 0.0))
        if self.touches:
            option.set("cone", "elliptic")
        else:
            ET.SubElement(option, "flag", contact="disable")
        hard = f"{tol.MUJOCO_IMPEDANCE} {tol.MUJOCO_IMPEDANCE} 0.001 0.5 2"
        if not self.document.smooth:
            soon, default = numbers(1.0, 2.0 * h, 1.0), self.document.parts["default"]
            for tag in ("joint", "tendon"):
                given = {"solreflimit": soon, "solreffriction": soon}
                given |= {"solimplimit": hard, "solimpfriction": hard}
                ET.SubElement(default, tag, given)
        ET.SubElement(
            self.document.parts["default"],
            "equality",
            solref=numbers(1.0, -k, -0.1 * math.sqrt(k)),
            solimp=hard,
        )

    def _rods(self) -> None:
        """Capsules between the joints of every body, for display only."""
        places: dict[str, list[tuple[float, float]]] = {}
        for joint in self.machine.joints:
            for side in ("i", "j"):
                body = getattr(joint, side).body
                if body != "ground":
                    x, y = self.system.numbers.arm(joint, side)
                    places.setdefault(body, []).append((float(x), float(y)))
        scale = self.scale.length
        for body, own in places.items():
            for (ax, ay), (bx, by) in pairwise(own):
                if math.hypot(bx - ax, by - ay) < 1e-6 * self.system.length:
                    continue
                ends = (
                    *self.document.frame_of(body, ax, ay),
                    0.0,
                    *self.document.frame_of(body, bx, by),
                    0.0,
                )
                ET.SubElement(
                    self.document.inside[body],
                    "geom",
                    type="capsule",
                    fromto=numbers(scale, *ends),
                    size=numbers(scale, 0.02 * self.system.length),
                    mass="0",
                    contype="0",
                    conaffinity="0",
                )

    def _keyframe(self, made: Exported, controls: dict[str, str]) -> None:
        """The start: all coordinates zero, their rates, and the values of inputs."""
        if not self.document.columns:
            return
        _, v, _ = made.motion(self.start.take([len(self.start) - 1]))
        frames = ET.SubElement(self.document.root, "keyframe")
        zero = " ".join(["0"] * len(self.document.columns))
        key = ET.SubElement(frames, "key", name="start", qpos=zero, qvel=numbers(1.0, *v[0]))
        if controls:
            own = (str(one.get("name")) for one in self.document.parts["actuator"])
            key.set("ctrl", numbers(1.0, *(self._control(controls.get(name)) for name in own)))

    def _control(self, name: str | None) -> float:
        """The value [SI] of an input at the start."""
        if name is None:
            return 0.0
        one: Any = self.machine[name]
        unit = self.machine.units.unit(one.dimension).factor if one.dimension else 1.0
        return unit * float(self.system.law_of(one, "value")(float(self.start.t[-1])))

    def _head(self, made: Exported) -> Iterator[str]:
        units = self.machine.units
        missing = [f"not in this file: {one.element}: {one.why}" for one in made.not_expressible]
        lines = [
            f"{self.machine.name}: written by mbody, in SI units (m, kg, s, rad); the mechanism's "
            f"own are {units.name}.",
            "All coordinates are zero at the start; key 'start' has the rates.",
            *made.notes,
            *missing,
        ]
        for line in lines:
            yield f"<!-- {line.replace('--', '—')} -->"


def _lines(root: ET.Element) -> Iterator[str]:
    """The file line by line; without recursion, since chains of bodies may be long."""
    stack: list[Any] = [(root, 0)]
    while stack:
        node, depth = stack.pop()
        if isinstance(node, str):
            yield node
            continue
        space = "  " * min(depth, 40)
        given = "".join(f" {key}={quoteattr(value)}" for key, value in node.attrib.items())
        if not len(node):
            yield f"{space}<{node.tag}{given}/>"
            continue
        yield f"{space}<{node.tag}{given}>"
        stack.append((f"{space}</{node.tag}>", depth))
        stack += [(child, depth + 1) for child in reversed(node)]
