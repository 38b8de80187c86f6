"""Places on bodies that shapes of a live page are drawn at, as they follow from the numbers."""

from __future__ import annotations

import math
import random
import re
from dataclasses import dataclass
from typing import Any

import numpy as np

from mbody.analysis.driven.kinematics import kinematics
from mbody.analysis.initial.close_loops import close_loops
from mbody.errors import ModelError, SolveError
from mbody.image.changeable import Changeable
from mbody.model.element import Numbers
from mbody.model.joints import PinSlot, Prismatic
from mbody.model.loads import ReciprocatingCylinder
from mbody.model.numbers import dimension_named
from mbody.quantities.units import DIMENSIONS
from mbody.solution.solution import Solution
from mbody.solution.tracing import Recording, Untraceable
from mbody.system.polar_points import polar_points
from mbody.system.system import System
from mbody.views.carriers import on
from mbody.views.guides import guide, travel
from mbody.views.pose import Pose
from mbody.views.record import SceneSketch
from mbody.views.scene import Scene, sketched

__all__ = ["SAME", "Anchor", "Anchors"]

Array = np.ndarray

#: Directions of markers, such as those of guides.
MARKER = re.compile(r"\.(i|j|at|axis)\.angle$")
#: Change of a length, in parts of that of the model, and of an angle: large beside rounding, small
#: beside what would make other shapes.
STEP = 1e-6
#: Two changes are the same, in parts of the greatest change: what is left out is of second order.
SAME = 1e-3
#: Analyses of driven motion.
DRIVEN = ("kinematics", "kinetostatics", "statics")
#: Instants of the motion for which the shapes are made again, those of guides among them.
INSTANTS = 13


@dataclass
class Anchor:
    """A place on a body, in axes at its mass centre: in the scene, and in both sets of numbers."""

    body: str
    made: Any
    shown: Array
    base: Array
    other: Array
    key: str = ""

    @property
    def moved(self) -> Array:
        """The change between the sets."""
        return np.asarray(self.other - self.base)


class Anchors:
    """The anchors of a scene, for its numbers and for two sets that differ at random."""

    def __init__(
        self, scene: Scene, data: dict[str, Any], changeable: Changeable, names: list[str]
    ) -> None:
        self.scene, self.data, self.changeable = scene, data, changeable
        self.system: System = changeable.system
        self.shown = SceneSketch(Pose(scene.run, 0), scene.unit, scene.small)
        chance = random.Random(2)
        steps = {name: self._step(name) * chance.uniform(0.5, 1.5) for name in names}
        steps = {name: step for name, step in steps.items() if step}
        # directions of markers turn shapes, for which there are no rules
        self.turns = {name: step for name, step in steps.items() if MARKER.search(name)}
        self.steps = {name: step for name, step in steps.items() if name not in self.turns}
        self.other_system = self._changed(self.steps)
        self.driven = len(scene.run) > 1 and scene.run.analysis in DRIVEN
        try:
            self.base, self.other = self._made(self.system), self._made(self.other_system)
        except (ModelError, SolveError):  # other numbers move the ends of its range
            self.driven = False
            self.base, self.other = self._made(self.system), self._made(self.other_system)
        recording = Recording(changeable.rules)
        self.recording, self.values = recording, changeable.values(dict(recording.inputs))
        machine = self.system.mechanism
        self.traced = Numbers(self.values, polar_points(machine), machine.bodies)
        self.targets: list[Any] = []
        self.anchors: list[Anchor] = []
        self.guides: list[dict[str, Any]] = []
        self.spans: list[tuple[int, int]] = []
        self.radii: dict[str, int] = {}
        self._find_anchors()
        most = max((float(np.abs(one.moved).max()) for one in self.anchors), default=0.0)
        self.same = SAME * max(most, STEP * 0.1 * self.system.length)

    def _step(self, name: str) -> float:
        """A small change of a number; none of one that is zero and no length and no angle."""
        value = abs(float(self.system.values[name]))
        dimension = dimension_named(self.system.mechanism, name)
        if dimension == DIMENSIONS["length"]:
            return STEP * max(value, 0.1 * self.system.length)
        return STEP if dimension == DIMENSIONS["angle"] else STEP * value

    def _changed(self, changes: dict[str, float]) -> System:
        return self.system.with_values(
            {name: float(self.system.values[name]) + by for name, by in changes.items()}
        )

    def _made(self, system: System) -> SceneSketch:
        """The scene for some numbers, with a motion as that of the scene where it is driven."""
        return sketched(Pose(self._run(system), 0), self.scene.unit, self.scene.small)

    def _run(self, system: System) -> Solution:
        run = self.scene.run
        drivers = system.mechanism.drivers
        if not self.driven:
            return close_loops(system)
        index = np.unique(np.round(np.linspace(0, len(run) - 1, INSTANTS)).astype(np.int64))
        if np.ptp(run.t) > 0.0 or not drivers:
            return kinematics(system, t=run.t[index])
        # the ends of a range are dead centres, which other numbers move
        index = np.unique(
            np.round(np.linspace(0.1, 0.9, INSTANTS) * (len(run) - 1)).astype(np.int64)
        )
        drive = {one.name: run.driven(one.name)[0][index] for one in drivers}
        return kinematics(system, drive=drive)

    # -- anchors ----------------------------------------------------------------------------------

    def _add(self, body: str, made: Any, plain: Any, key: str = "") -> int:
        """An anchor: traced, and as the numbers (shown, base, other) have it."""
        try:
            for part in made if made is not None else ():
                self.recording.place_of(part)
        except Untraceable:
            made = None
        shown, base, other = (np.array(one, dtype=float) for one in plain)
        self.anchors.append(Anchor(body, made, shown, base, other, key))
        return len(self.anchors) - 1

    def _find_anchors(self) -> None:
        machine = self.system.mechanism
        sets = self.system.numbers, self.system.numbers, self.other_system.numbers
        for element in machine:
            for side, marker in element.places().items():
                made = self.traced.arm(element, side)
                plain = [one.arm(element, side) for one in sets]
                self._add(marker.body, made, plain, f"{element.name}.{side}")
        for body in (*machine.bodies, machine.ground):
            for point in body.points:
                made, *plain = (_place(one, body.name, point) for one in (self.traced, *sets))
                self._add(body.name, made, plain, f"{body.name}.{point}")
            self._add(body.name, (0.0, 0.0), [(0.0, 0.0)] * 3, body.name)
        for joint in machine.joints:
            if isinstance(joint, (Prismatic, PinSlot)):
                self._guide(joint)
        for load in machine.loads:
            if isinstance(load, ReciprocatingCylinder):
                self._cylinder(load)

    def _key(self, key: str) -> int:
        return next(n for n, one in enumerate(self.anchors) if one.key == key)

    def _guide(self, joint: Prismatic | PinSlot) -> None:
        """Both ends of a guide, which are those of the way in the whole motion."""
        body, rail, slides = guide(joint)
        ends = []
        for sketch in (self.shown, self.base, self.other):
            world = np.array(travel(sketch, joint))
            ends.append(on(body).kept(world, sketch.pose.run, sketch.pose.k))
        low, high = (
            self._add(body, None, [one[n] for one in ends], f"{joint.name}:{n}") for n in (0, 1)
        )
        more = (
            2.1 * self.base.size("block")
            if isinstance(joint, Prismatic)
            else 2.2 * self.base.size("pin")
        )
        self.guides.append(
            {
                "ends": [low, high],
                "rail": self._key(f"{joint.name}.{rail}"),
                "slides": self._key(f"{joint.name}.{slides}"),
                "angle": self._target(self.traced.angle(joint, rail)),
                "more": more,
            }
        )
        self.spans.append((low, high))

    def _cylinder(self, load: ReciprocatingCylinder) -> None:
        """Head, mouth and piston, as `mbody.views.cylinders.barrel` has them."""
        block = self.base.size("block")

        def made(values: Any, numbers: Numbers) -> list[Any]:
            near, far, spare = (
                values[f"{load.name}.{key}"] for key in ("near", "far", "clearance")
            )
            plain = self.system.values
            sense = math.copysign(1.0, plain[f"{load.name}.near"] - plain[f"{load.name}.far"])
            near, far, thick = sense * near, sense * far, 0.3 * block
            ahead = near - far + spare + thick + 1.3 * block
            if sense * plain[f"{load.name}.near"] < 0.0:
                ahead = np.maximum(np.minimum(ahead, -near - spare - thick), 0.0)
            angle, (x, y) = numbers.angle(load, "i"), numbers.arm(load, "i")
            c, s = sense * np.cos(angle), sense * np.sin(angle)
            head, mouth = near + ahead + spare + thick, far + ahead - spare - thick
            return [
                (x + head * c, y + head * s),
                (x + mouth * c, y + mouth * s),
                (ahead * c, ahead * s),
            ]

        traced = made(self.values, self.traced)
        own = made(self.system.values, self.system.numbers)
        other = made(self.other_system.values, self.other_system.numbers)
        found = [
            self._add(body, traced[n], [own[n], own[n], other[n]], f"{load.name}:{n}")
            for n, body in enumerate((load.i.body, load.i.body, f"{load.name}.piston"))
        ]
        self._add(f"{load.name}.piston", (0.0, 0.0), [(0.0, 0.0)] * 3)
        self.spans.append((found[0], found[1]))

    def _target(self, value: Any) -> int:
        self.targets.append(value)
        return len(self.targets) - 1

    def _of(self, body: str) -> list[int]:
        return [n for n, one in enumerate(self.anchors) if one.body == body]

    def _nearest(self, body: str, at: Array) -> int:
        return min(self._of(body), key=lambda n: float(np.hypot(*(self.anchors[n].shown - at))))


def _place(numbers: Numbers, body: str, point: str) -> tuple[Any, Any]:
    """A named point from the mass centre of its body."""
    (x, y), (cx, cy) = numbers.point(f"{body}.{point}"), numbers.point(f"{body}.cg")
    return x - cx, y - cy
