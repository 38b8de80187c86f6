"""Loads and drivers in MJCF: tendons and actuators."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from mbody.engines.formula_loads import follows_formula
from mbody.engines.mjcf.elements import SAME, ClosureWriter
from mbody.engines.mjcf.exported import numbers
from mbody.engines.spanning_tree import marker_frame
from mbody.laws import Constant
from mbody.model.driver import AngleDriver, CoordinateDriver, DistanceDriver
from mbody.model.element import Element
from mbody.model.joints import Prismatic
from mbody.model.loads import Damper, Force, Gravity, Spring, Torque, TorsionDamper, TorsionSpring

__all__ = ["ElementWriter"]


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
            self._no(load, "its law is a formula of measured quantities, which MJCF has not")
        elif kind is Gravity and not self.varies(load, ("x", "y")):
            self.built.add(name)
        elif kind is Gravity:
            self._no(load, "gravity varies with time, in MJCF it is constant")
        elif kind in (Force, Torque):
            self._given(load)
        elif kind in (Spring, Damper, TorsionSpring, TorsionDamper) and load.law is None:
            turning = kind in (TorsionSpring, TorsionDamper)
            unit = self.scale.torque if turning else self.scale.force / self.scale.length
            if kind in (Damper, TorsionDamper):
                given = {
                    "damping": numbers(unit * self.scale.time, float(at[f"{name}.coefficient"]))
                }
                self._tendon(load, turning, given, 1.0)
            else:
                self._spring(load, turning, unit)
        elif getattr(load, "law", None) is not None:
            self._no(load, "its force has a law, in MJCF springs and dampers are linear")
        else:
            self._no(load, f"MJCF has no load that is a {kind.__name__}")

    def _spring(self, load: Any, turning: bool, unit: float) -> None:
        """A spring as a tendon: F = k (l − l₀) with the preload in l₀."""
        at, name = self.system.numbers, load.name
        stiffness, preload = (float(at[f"{name}.{key}"]) for key in ("stiffness", "preload"))
        if stiffness <= 0.0:
            self._no(load, f"its stiffness is {stiffness:g}, a tendon of MJCF needs a positive one")
            return
        rest = -preload / stiffness
        if turning:
            pose = self.document.pose
            rest += float(at[f"{name}.free_angle"]) - (pose[load.body][2] - pose[load.by][2])
        else:
            rest = (rest + float(at[f"{name}.free_length"])) * self.scale.length
        # a negative rest length would mean that of the start: the angle gets the opposite sign
        sign = -1.0 if turning and rest < 0.0 else 1.0
        if sign < 0.0:
            self.reversed.add(name)
        if rest < 0.0 and not turning:
            self._no(
                load,
                "its preload pulls at every length; a tendon of MJCF has no negative rest length",
            )
            return
        given = {"stiffness": numbers(unit, stiffness), "springlength": numbers(sign, rest)}
        self._tendon(load, turning, given, sign)

    def _tendon(self, load: Any, turning: bool, given: dict[str, str], sign: float) -> None:
        if not turning:
            self._line(load, **given)
            return
        turns = {key: sign * part for key, part in self._turns(load.body, load.by).items()}
        if not self._sum(load.name, turns, **given):
            self._no(load, "its bodies do not turn against each other")

    def _given(self, load: Any) -> None:
        """A force or a torque as an actuator: with its value where that is constant."""
        name = load.name
        value = float(self.system.law_of(load, "value")(0.0))
        unit = self.scale.force if type(load) is Force else self.scale.torque
        given = {}
        if self.varies(load, ("value",)):
            tag = "motor"
            self.laws[name] = "value"
            self.notes.append(f"'{name}' is a motor, its law of time is not in the file")
        else:
            tag = "general"
            # its control is added to the value, so that a control of 0 leaves it
            given = {"biastype": "affine", "gainprm": "1", "biasprm": numbers(unit, value, 0, 0)}
        if type(load) is Torque:
            if not self._turned(load, tag, load.body, load.by, given):
                self.laws.pop(name, None)
                self._no(load, "its bodies do not turn against each other")
            return
        at = marker_frame(self.system, load, "at")
        angle = float(self.system.numbers[f"{name}.angle"])
        self._put(load.at.body, f"{name}.at", (at.x, at.y), at.angle if load.follows else 0.0)
        if not load.follows:
            given["refsite"] = self._world()
        gear = numbers(1.0, math.cos(angle), math.sin(angle), 0, 0, 0, 0)
        self._part("actuator", tag, name, site=f"{name}.at", gear=gear, **given)

    def _world(self) -> str:
        """A site with the axes of the world, for directions."""
        ground = self.document.inside["ground"]
        if not any(site.get("name") == "ground" for site in ground.findall("site")):
            self._put("ground", "ground", (0.0, 0.0))
        return "ground"

    def _turned(
        self, element: Element, tag: str, body: str, base: str, given: dict[str, str]
    ) -> bool:
        """An actuator of the angle of a body from another; False where nothing turns."""
        turns = self._turns(body, base)
        if not turns:
            return False
        if list(turns.values()) == [1.0]:
            self._part("actuator", tag, element.name, joint=next(iter(turns)), **given)
        else:
            self._sum(element.name, turns)
            self._part("actuator", tag, element.name, tendon=element.name, **given)
        return True

    # -- drivers ---------------------------------------------------------------------------------

    def _driver(self, driver: Any) -> None:
        """A motor of the driven coordinate, without the law."""
        done, name = True, driver.name
        if type(driver) is AngleDriver:
            done = self._turned(driver, "motor", driver.body, driver.relative_to, {})
        elif type(driver) is DistanceDriver:
            self._line(driver)
            self._part("actuator", "motor", name, tendon=name)
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
        self._part("actuator", "motor", driver.name, site=site, refsite=world, gear=gear)
        return True

    def _fixed(self, name: str) -> bool:
        """A constraint that fixes the coordinate of a motor; False where there is none."""
        motor = self.document.parts["actuator"][-1]
        for key in ("joint", "tendon"):
            if motor.get(key):
                self._part("equality", key, name, **{f"{key}1": str(motor.get(key))})
                return True
        return False

    def _slid(self, driver: CoordinateDriver) -> bool:
        """A motor of a slide that has the driven direction; False where there is none."""
        base = self.document.pose[driver.i.body][2] + marker_frame(self.system, driver, "i").angle
        for column in self.document.columns:
            branch = column.of
            if not column.way or branch.kind != "prismatic":
                continue
            pair = (branch.parent, branch.body)
            if pair not in ((driver.i.body, driver.j.body), (driver.j.body, driver.i.body)):
                continue
            heading = self.document.pose[branch.body][2] + column.direction
            along = np.cos(heading - base)
            if abs(abs(along) - 1.0) > SAME or type(branch.joint) is not Prismatic:
                continue
            sign = round(float(along)) * (1.0 if pair[0] == driver.i.body else -1.0)
            name = column.name
            self._part("actuator", "motor", driver.name, joint=name, gear=numbers(1.0, sign))
            return True
        return False
