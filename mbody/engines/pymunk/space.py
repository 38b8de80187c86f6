"""A mechanism as a pymunk space: bodies at their mass centres, joints, drivers, native loads."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from mbody.engines.independent_reading import reading
from mbody.engines.opinion import Inexpressible
from mbody.engines.pymunk.impulses import ImpulseConstraint, SpringImpulse, damped, stretched
from mbody.model.driver import AngleDriver, CoordinateDriver, DistanceDriver
from mbody.model.joints import Distance, Fixed, PinSlot, Prismatic, Revolute, Rolling
from mbody.model.loads import Damper, Force, Gravity, Spring, Torque, TorsionDamper, TorsionSpring
from mbody.system.system import System

__all__ = ["PRESSED", "Space", "inexpressible"]

Array = np.ndarray

#: Half the length of a slot, and of a line for rolling, in model lengths.
REACH = 100.0
#: Enlargement of a rolling wheel so that it touches, as a part of its radius.
PRESSED = 1e-7
#: Greatest eccentricity of a wheel's mass centre, in model lengths: beyond it the steps would lift
#: the wheel.
CENTRED = 1e-12
#: Friction of wheels that do not slip.
ROUGH = 1e6


def inexpressible(system: System) -> tuple[Inexpressible, ...]:
    """Joints, couplings and drivers that pymunk has no constraint for."""
    found = []
    for joint in system.mechanism.joints:
        if isinstance(joint, Rolling):
            arm = np.hypot(*reading(system).arm(joint, "j"))
            line = joint.on_radius is None and joint.i.body == "ground"
            if not line or arm > CENTRED * system.length:
                why = (
                    "pymunk's contacts are lost where a wheel does not roll on a straight line at "
                    "rest"
                )
                found.append((joint.name, why))
        elif not isinstance(joint, Revolute | Prismatic | Fixed | PinSlot | Distance | Rolling):
            what = type(joint).__name__
            found.append((joint.name, f"pymunk has no constraint like a {what}"))
    for driver in system.mechanism.drivers:
        if not isinstance(driver, AngleDriver | CoordinateDriver | DistanceDriver):
            what = type(driver).__name__
            found.append((driver.name, f"pymunk has no constraint like a {what}"))
    for coupling in system.mechanism.couplings:
        found.append(
            (coupling.name, "pymunk's constraints connect two bodies, this one connects more")
        )
    return tuple(Inexpressible(*one) for one in found)


class Space:
    """The pymunk space of a system.

    Parameters
    ----------
    system : System
        Of one design.
    lump : float
        Stand-in for a mass of zero [mass], and with the square of the model length for an inertia
        of zero; pymunk needs both.
    iterations : int
        Of the solver at every step.

    Attributes
    ----------
    mass : array (bodies, 3)
        Mass, mass and inertia of every body, stand-ins included.
    lumped : tuple of str
        Bodies with a stand-in.
    parts : list of ImpulseConstraint
        Constraints of joints and drivers.
    drives : list of ImpulseConstraint
        Those of the drivers, in the order of the description; none for what is not expressible.
    springs : list of SpringImpulse
    drags : list of (ImpulseConstraint, float)
        Dampers of bodies with a stand-in, and their coefficients: they are applied as forces, since
        pymunk's own dampers ignore all other constraints of the two bodies.
    over : tuple of int
        Loads that pymunk does not have, by their numbers: they are applied with the values from
        mbody.
    """

    def __init__(self, system: System, lump: float, iterations: int) -> None:
        import pymunk

        self.pymunk, self.system = pymunk, system
        self.at = reading(system)
        self.reach = REACH * system.length
        self.space = pymunk.Space()
        self.space.iterations, self.space.collision_slop = iterations, 0.0
        self.count = len(system.mechanism.bodies)
        self.mass, self.lumped = self._masses(lump)
        self.bodies = [pymunk.Body(float(m), float(i)) for m, _, i in self.mass]
        self.space.add(*self.bodies)
        self.everything = [*self.bodies, self.space.static_body]
        self.parts: list[ImpulseConstraint] = []
        self.drives: list[ImpulseConstraint | None] = []
        self.springs: list[SpringImpulse] = []
        self.drags: list[tuple[ImpulseConstraint, float]] = []
        self.over: tuple[int, ...] = ()
        self.rolling = 0
        left_out = {one.element for one in inexpressible(system)}
        for joint in system.mechanism.joints:
            if joint.name not in left_out:
                self._join(joint)
        for driver in system.mechanism.drivers:
            self.drives.append(None if driver.name in left_out else self._drive(driver))
        for n, load in enumerate(system.mechanism.loads):
            self._load(n, load)

    def _masses(self, lump: float) -> tuple[Array, tuple[str, ...]]:
        own = reading(self.system).masses.copy()
        least = lump * np.array([1.0, 1.0, self.system.length**2])
        none = own == 0.0
        own[none] = np.broadcast_to(least, own.shape)[none]
        bodies = self.system.mechanism.bodies
        return own, tuple(b.name for b, row in zip(bodies, none, strict=True) if row.any())

    # -- joints ----------------------------------------------------------------------------------

    def _ends(self, element: Any) -> dict[str, Any]:
        """Bodies and arms of an element's two places."""
        index = self.system.bodies
        return {
            "i": index[element.i.body],
            "j": index[element.j.body],
            "arm_i": tuple(float(part) for part in self.at.arm(element, "i")),
            "arm_j": tuple(float(part) for part in self.at.arm(element, "j")),
        }

    def _add(self, native: Any) -> Any:
        # the position error of a step is corrected in the next one; a soft correction would change
        # forces
        native.error_bias = 0.0
        self.space.add(native)
        return native

    def _part(self, owner: str, kind: str, make: Any, **ends: Any) -> ImpulseConstraint:
        part = ImpulseConstraint(owner, kind, None, **ends, reach=self.reach)
        part.native = self._add(make(self.everything[part.i], self.everything[part.j], part))
        self.parts.append(part)
        return part

    def _pin(self, owner: str, **ends: Any) -> ImpulseConstraint:
        make = self.pymunk.PivotJoint
        return self._part(owner, "pin", lambda a, b, p: make(a, b, p.arm_i, p.arm_j), **ends)

    def _slot(self, owner: str, **ends: Any) -> ImpulseConstraint:
        def make(a: Any, b: Any, part: ImpulseConstraint) -> Any:
            first, last = part.groove()
            return self.pymunk.GrooveJoint(a, b, first, last, part.arm_j)

        return self._part(owner, "slot", make, **ends)

    def _rod(self, owner: str, length: float, **ends: Any) -> ImpulseConstraint:
        def make(a: Any, b: Any, part: ImpulseConstraint) -> Any:
            rod = self.pymunk.PinJoint(a, b, part.arm_i, part.arm_j)
            rod.distance = length
            return rod

        return self._part(owner, "rod", make, **ends, target=length)

    def _angle(self, owner: str, angle: float, **ends: Any) -> ImpulseConstraint:
        make = self.pymunk.GearJoint
        return self._part(owner, "turn", lambda a, b, p: make(a, b, angle, 1.0), **ends)

    def _join(self, joint: Any) -> None:
        ends, name = self._ends(joint), joint.name
        beta = [float(self.at.angle(joint, side)) for side in ("i", "j")]
        match joint:
            case Revolute():
                self._pin(name, **ends)
            case Fixed():
                self._pin(name, **ends)
                self._angle(name, beta[0] - beta[1], **ends)
            case Prismatic():
                self._slot(name, **_decoupled(ends, beta), normal=beta[0] + 0.5 * math.pi)
                self._angle(name, beta[0] - beta[1], **ends)
            case PinSlot():
                self._slot(name, **ends, normal=beta[0] + 0.5 * math.pi)
            case Distance():
                self._rod(name, float(self.at[f"{name}.length"]), **ends)
            case Rolling():
                self._roll(joint, beta[0] + 0.5 * math.pi, ends)

    def _roll(self, joint: Any, normal: float, ends: dict[str, Any]) -> None:
        """A circle that collides with one line only."""
        radius = float(self.at[f"{joint.name}.radius"])
        a, b = self.everything[ends["i"]], self.everything[ends["j"]]
        pressed = PRESSED * radius
        wheel = self.pymunk.Circle(b, radius + pressed, ends["arm_j"])
        (x, y), c, s = ends["arm_i"], math.cos(normal), math.sin(normal)
        x_reach, y_reach = self.reach * s, self.reach * c
        line = (x - x_reach, y + y_reach), (x + x_reach, y - y_reach)
        base = self.pymunk.Segment(a, *line, 0.0)
        self.rolling += 1
        only = 1 << self.rolling
        for shape in (base, wheel):
            shape.friction = ROUGH
            shape.filter = self.pymunk.ShapeFilter(categories=only, mask=only)
        self.space.add(base, wheel)
        # the penetration remains: resolving it would be a motion without force
        self.space.collision_slop = max(2.0 * pressed, self.space.collision_slop)
        part = ImpulseConstraint(
            joint.name, "contact", (base, wheel), **ends, normal=normal, radius=radius
        )
        self.parts.append(part)

    # -- drivers ---------------------------------------------------------------------------------

    def _drive(self, driver: Any) -> ImpulseConstraint:
        match driver:
            case AngleDriver():
                index = self.system.bodies
                ends = {"i": index[driver.relative_to], "j": index[driver.body]}
                make = self.pymunk.SimpleMotor
                return self._part(driver.name, "turn", lambda a, b, p: make(a, b, 0.0), **ends)
            case CoordinateDriver():
                beta = float(self.at.angle(driver, "i"))
                return self._slot(driver.name, **self._ends(driver), normal=beta)
            case _:
                return self._rod(driver.name, self.system.length, **self._ends(driver))

    # -- loads -----------------------------------------------------------------------------------

    def _load(self, n: int, load: Any) -> None:
        """Build the loads that pymunk has; others are listed in `over`."""
        name, at = load.name, self.at
        match load:
            case Gravity() | Torque() | Force():
                pass  # by their laws, step by step
            case Spring(law=None) if at[f"{name}.stiffness"] != 0.0:
                k = float(at[f"{name}.stiffness"])
                rest = float(at[f"{name}.free_length"] - at[f"{name}.preload"] / k)
                self._spring(ImpulseConstraint(name, "rod", None, **self._ends(load)), rest, k, 0.0)
            case Damper(law=None):
                c = float(at[f"{name}.coefficient"])
                self._spring(ImpulseConstraint(name, "rod", None, **self._ends(load)), 0.0, 0.0, c)
            case TorsionSpring(law=None) if at[f"{name}.stiffness"] != 0.0:
                k = float(at[f"{name}.stiffness"])
                rest = float(at[f"{name}.free_angle"] - at[f"{name}.preload"] / k)
                self._spring(self._turning(load), rest, k, 0.0)
            case TorsionDamper(law=None):
                self._spring(self._turning(load), 0.0, 0.0, float(at[f"{name}.coefficient"]))
            case _:
                self.over = (*self.over, n)

    def _turning(self, load: Any) -> ImpulseConstraint:
        i, j = (self.system.bodies[body] for body in load.bodies)
        return ImpulseConstraint(load.name, "turn", None, i, j)

    def _spring(
        self, part: ImpulseConstraint, rest: float, stiffness: float, damping: float
    ) -> None:
        light = {self.system.bodies[name] for name in self.lumped}
        if damping and light & {part.i, part.j}:
            self.drags.append((part, damping))
            return
        a, b = self.everything[part.i], self.everything[part.j]
        if part.kind == "rod":
            ends = (a, b, part.arm_i, part.arm_j)
            part.native = self.pymunk.DampedSpring(*ends, rest, stiffness, damping)
        else:
            # pymunk measures the angle of a from b
            part.native = self.pymunk.DampedRotarySpring(a, b, -rest, stiffness, damping)
        self.space.add(part.native)
        self.springs.append(stretched(part, rest, stiffness) if stiffness else damped(part))


def _decoupled(ends: dict[str, Any], beta: list[float]) -> dict[str, Any]:
    """Ends of a slider with its slot through the mass centre of i, and its pin on the normal
    through the mass centre of j.

    pymunk's groove solves for both components of a force and then drops the one along the slot.
    This diverges where mass and inertia couple the components; at these places they do not.
    """
    i, j = (
        -arm[0] * math.sin(angle) + arm[1] * math.cos(angle)
        for arm, angle in zip((ends["arm_i"], ends["arm_j"]), beta, strict=True)
    )
    across = (-math.sin(beta[1]) * (j - i), math.cos(beta[1]) * (j - i))
    return ends | {"arm_i": (0.0, 0.0), "arm_j": across, "torque_at": ends["arm_j"]}
