"""The document of an MJCF file: its sections, and the tree of bodies with their joints."""

from __future__ import annotations

import math
from xml.etree import ElementTree as ET

import numpy as np

from mbody.engines.mjcf.exported import FileCoordinate, Scale, numbers, placed, safe
from mbody.engines.spanning_tree import Branch, spanning_tree
from mbody.solution.solution import Solution
from mbody.system.system import System

__all__ = ["POINT", "STAND_IN", "Document"]

#: A body without mass gets this part of the greatest mass: MuJoCo cannot move a massless body.
STAND_IN = 1e-9
#: The same for the inertia of a point mass, which moves with its place in any case.
POINT = 1e-13


class Document:
    """One file while it is written: sections, bodies, coordinates.

    Attributes
    ----------
    fix_drivers : bool
        Whether constraints fix the driven coordinates.
    pose : dict
        (x, y, θ) of every body at the start, by name.
    parts : dict
        Sections of the file by tag.
    inside : dict
        The element of every body, by its name in the file.
    columns : list of FileCoordinate
        Coordinates of the file.
    """

    def __init__(self, system: System, start: Solution, fix_drivers: bool) -> None:
        self.system, self.machine, self.start = system, system.mechanism, start
        self.fix_drivers = fix_drivers
        self.scale = Scale.of(self.machine.units)
        self.tree = spanning_tree(system)
        self.pose = {
            name: np.array([start[name].x[-1], start[name].y[-1], start[name].angle[-1]])
            for name in system.bodies
        }
        self.stand_ins: list[str] = []
        self.hung: list[tuple[str, Branch]] = []
        self.columns: list[FileCoordinate] = []
        self.root = ET.Element("mujoco", model=self.machine.name)
        self.parts = {
            key: ET.Element(key)
            for key in ("option", "default", "worldbody", "tendon", "equality", "actuator")
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
        (px, py, turn), (x, y, theta) = self.pose[parent], self.pose[own]
        ox, oy = self.origin[parent]
        far = placed(x, y, theta, place)
        near = placed(px, py, turn, (ox, oy))
        dx, dy = far[0] - near[0], far[1] - near[1]
        c, s = math.cos(turn), math.sin(turn)
        half = 0.5 * (theta - turn)
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
        given = {"name": column.name, "type": "slide" if column.way else "hinge"}
        if column.way:
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
        if (mass <= 0.0 or inertia <= 0.0) and body not in self.stand_ins:
            self.stand_ins.append(body)
        if mass and not inertia:
            # more than the least that MuJoCo accepts
            least = 1e-14 / (self.scale.mass * self.scale.length**2)
            return mass, max(POINT * mass * self.system.length**2, least)
        return mass or STAND_IN * greatest, inertia or STAND_IN * widest
