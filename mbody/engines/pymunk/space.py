"""A mechanism as a pymunk space: bodies at their mass centres, joints, drivers, native loads."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from mbody.core import tolerances as tol
from mbody.engines.balance import BodyState, Inexpressible, applied_forces, geometry_of
from mbody.engines.independent_reading import reading
from mbody.errors import ModelError
from mbody.kernels.finished_instants import each_load
from mbody.model.driver import AngleDriver, CoordinateDriver, DistanceDriver
from mbody.model.joints import Distance, Fixed, PinSlot, Prismatic, Revolute, Rolling
from mbody.model.loads import Damper, Force, Gravity, Spring, Torque, TorsionDamper, TorsionSpring
from mbody.system.system import System

# -- Constraints and springs of a pymunk space, with the directions in which their impulses act
# pymunk returns the size of an impulse but not its direction. So every constraint has its own
# columns: the effect of each unit impulse on all bodies. The impulses are then found from the
# momenta.

Array = np.ndarray


def place(pose: Array, body: int, position: tuple[float, float]) -> Array:
    """World place (2,) of a position on a body from its mass centre; pose (bodies, 3)."""
    x, y, theta = pose[body]
    c, s = math.cos(theta), math.sin(theta)
    return np.array([x + c * position[0] - s * position[1], y + s * position[0] + c * position[1]])


@dataclass(eq=False)
class ImpulseConstraint:
    """One constraint of the space.

    `owner`: Name of the joint or driver that it belongs to.
    `kind`: "pin", "slot", "rod", "turn" or "contact".
    `native`: pymunk.Constraint, or tuple of pymunk.Shape
    `i`, `j`: Bodies; the ground is the last.
    `position_i`, `position_j`: Places from the mass centres in link axes [length].
    `torque_at`: Reference place on j of torques, where it differs from position_j [length].
    `normal`: Of a slot or a contact line: direction in axes of i [rad].
    `radius`: Of a rolling wheel [length].
    `target`: Value that a slot, a rod or a turn keeps.
    `half_length`: Half the length of a slot.
    """

    owner: str
    kind: str
    native: Any
    i: int
    j: int
    position_i: tuple[float, float] = (0.0, 0.0)
    position_j: tuple[float, float] = (0.0, 0.0)
    torque_at: tuple[float, float] | None = None
    normal: float = 0.0
    radius: float = 0.0
    target: float = 0.0
    half_length: float = 0.0

    def forces(self, pose: Array) -> Array:
        """Force and torque of each unit impulse on body j, about the reference place
        (impulses, 3).
        """
        units = self.units(pose)
        if self.torque_at is not None:
            x, y = place(pose, self.j, self.position_j) - place(pose, self.j, self.torque_at)
            units[:, 2] += x * units[:, 1] - y * units[:, 0]
        return units

    def units(self, pose: Array) -> Array:
        """Unit wrenches of the constraint about the point where the impulse acts, (rows, 3)."""
        if self.kind == "turn":
            return np.array([[0.0, 0.0, 1.0]])
        if self.kind == "slot":
            beta = pose[self.i, 2] + self.normal
            return np.array([[math.cos(beta), math.sin(beta), 0.0]])
        if self.kind == "rod":
            separation = place(pose, self.j, self.position_j) - place(pose, self.i, self.position_i)
            return np.array([[*(separation / max(float(np.hypot(*separation)), tol.TINY)), 0.0]])
        return np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])

    def columns(self, pose: Array) -> Array:
        """Effect of each unit impulse on all bodies (impulses, bodies, 3), torques about mass
        centres.
        """
        unit = self.units(pose)
        at_i, at_j = self._points(pose)
        columns = np.zeros((len(unit), len(pose), 3))
        for sign, body, point in ((1.0, self.j, at_j), (-1.0, self.i, at_i)):
            x, y = point - pose[body, :2]
            columns[:, body] += sign * unit
            columns[:, body, 2] += sign * (x * unit[:, 1] - y * unit[:, 0])
        return columns

    def _points(self, pose: Array) -> tuple[Array, Array]:
        """Points of action of the impulse, on i and on j."""
        on_i, on_j = place(pose, self.i, self.position_i), place(pose, self.j, self.position_j)
        if self.kind == "slot":
            normal = self.units(pose)[0, :2]
            on_i = on_j - normal * (normal @ (on_j - on_i) - self.target)
        elif self.kind == "contact":
            beta = pose[self.i, 2] + self.normal
            normal = np.array([math.cos(beta), math.sin(beta)])
            on_i = on_j = on_j - self.radius * normal
        return on_i, on_j

    def aim(self, value: float, h: float) -> None:
        """Set the value that the constraint has at the end of the next step.

        pymunk first moves the bodies and then corrects their rates: the rates of this step move
        them in the next.
        """
        self.target = value
        if self.kind == "slot":
            self.native.groove_a, self.native.groove_b = self.groove()
        elif self.kind == "rod":
            self.native.distance = value
        else:
            a, b = self.native.a, self.native.b
            angle = b.angle - a.angle + h * (b.angular_velocity - a.angular_velocity)
            # a motor of pymunk turns a against b
            self.native.rate = -(value - angle) / h

    def groove(self) -> tuple[tuple[float, float], tuple[float, float]]:
        """Both ends of a slot in axes of i, from its mass centre."""
        c, s = math.cos(self.normal), math.sin(self.normal)
        x, y = self.position_i[0] + self.target * c, self.position_i[1] + self.target * s
        return (x - self.half_length * s, y + self.half_length * c), (
            x + self.half_length * s,
            y - self.half_length * c,
        )


@dataclass(eq=False)
class SpringImpulse:
    """A spring or damper of the space, and the sign of its impulse by the motion."""

    part: ImpulseConstraint
    sign: Callable[[Array, Array], float]

    def impulse(self, pose: Array, vel: Array) -> Array:
        """Impulse of the last step on all bodies (bodies, 3)."""
        size = math.copysign(self.part.native.impulse, self.sign(pose, vel))
        return np.asarray(size * self.part.columns(pose)[0])


def stretched(part: ImpulseConstraint, free_value: float, stiffness: float) -> SpringImpulse:
    """A spring of length or angle: its impulse on j is opposite to the extension."""

    def sign(pose: Array, vel: Array) -> float:
        if part.kind == "turn":
            return -stiffness * float(pose[part.j, 2] - pose[part.i, 2] - free_value)
        separation = place(pose, part.j, part.position_j) - place(pose, part.i, part.position_i)
        return -stiffness * float(np.hypot(*separation) - free_value)

    return SpringImpulse(part, sign)


def damped(part: ImpulseConstraint) -> SpringImpulse:
    """A damper of length or angle: its impulse on j is opposite to the rate."""

    def sign(pose: Array, vel: Array) -> float:
        return -float((part.columns(pose)[0] * vel).sum())

    return SpringImpulse(part, sign)


#: Half the length of a slot, and of a line for rolling, in model lengths.
GUIDE_HALF_LENGTH = 100.0
#: Friction of wheels that do not slip.
STICKING_FRICTION = 1e6


def inexpressible(system: System) -> tuple[Inexpressible, ...]:
    """Joints, couplings and drivers that pymunk has no constraint for."""
    found = []
    for joint in system.mechanism.joints:
        if isinstance(joint, Rolling):
            offset = np.hypot(*reading(system).arm(joint, "j"))
            line = joint.on_radius is None and joint.i.body == "ground"
            if not line or offset > tol.PYMUNK_WHEEL_CENTRED * system.length:
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

    `system`: Of one design.
    `lump`: Artificial mass in place of zero [mass], and with the square of the model length for an
      inertia of zero; pymunk needs both.
    `iterations`: Of the solver at every step.

    `mass` (bodies, 3): Mass, mass and inertia of every body, artificial ones included.
    `lumped`: Bodies with an artificial mass.
    `parts`: Constraints of joints and drivers.
    `motors`: Those of the drivers, in the order of the description; none for what is not
      expressible.
    `drags`: Dampers of bodies with an artificial mass, and their coefficients: they are applied as
      forces, since pymunk's own dampers ignore all other constraints of the two bodies.
    `over`: Loads that pymunk does not have, by their numbers: they are applied with the values from
      mbody.
    """

    def __init__(self, system: System, lump: float, iterations: int) -> None:
        import pymunk

        self.pymunk, self.system = pymunk, system
        self.at = reading(system)
        self.half_length = GUIDE_HALF_LENGTH * system.length
        self.space = pymunk.Space()
        self.space.iterations, self.space.collision_slop = iterations, 0.0
        self.count = len(system.mechanism.bodies)
        self.mass, self.lumped = self._masses(lump)
        self.bodies = [pymunk.Body(float(m), float(i)) for m, _, i in self.mass]
        self.space.add(*self.bodies)
        self.everything = [*self.bodies, self.space.static_body]
        self.parts: list[ImpulseConstraint] = []
        self.motors: list[ImpulseConstraint | None] = []
        self.springs: list[SpringImpulse] = []
        self.drags: list[tuple[ImpulseConstraint, float]] = []
        self.over: tuple[int, ...] = ()
        self.rolling = 0
        left_out = {one.element for one in inexpressible(system)}
        for joint in system.mechanism.joints:
            if joint.name not in left_out:
                self._join(joint)
        for driver in system.mechanism.drivers:
            self.motors.append(None if driver.name in left_out else self._motor(driver))
        for n, load in enumerate(system.mechanism.loads):
            self._load(n, load)

    @property
    def adopted(self) -> tuple[str, ...]:
        """Names of the loads that are applied with the values from mbody."""
        return tuple(self.system.mechanism.loads[n].name for n in self.over)

    def _masses(self, lump: float) -> tuple[Array, tuple[str, ...]]:
        own = reading(self.system).masses.copy()
        least = lump * np.array([1.0, 1.0, self.system.length**2])
        none = own == 0.0
        own[none] = np.broadcast_to(least, own.shape)[none]
        bodies = self.system.mechanism.bodies
        return own, tuple(b.name for b, row in zip(bodies, none, strict=True) if row.any())

    # -- joints ----------------------------------------------------------------------------------

    def _ends(self, element: Any) -> dict[str, Any]:
        """Bodies and body-fixed positions of an element's two places."""
        index = self.system.bodies
        return {
            "i": index[element.i.body],
            "j": index[element.j.body],
            "position_i": tuple(float(part) for part in self.at.arm(element, "i")),
            "position_j": tuple(float(part) for part in self.at.arm(element, "j")),
        }

    def _add(self, native: Any) -> Any:
        # the position error of a step is corrected in the next one; a soft correction would change
        # forces
        native.error_bias = 0.0
        self.space.add(native)
        return native

    def _add_constraint(self, owner: str, kind: str, make: Any, **ends: Any) -> ImpulseConstraint:
        part = ImpulseConstraint(owner, kind, None, **ends, half_length=self.half_length)
        part.native = self._add(make(self.everything[part.i], self.everything[part.j], part))
        self.parts.append(part)
        return part

    def _pin(self, owner: str, **ends: Any) -> ImpulseConstraint:
        make = self.pymunk.PivotJoint
        return self._add_constraint(
            owner, "pin", lambda a, b, p: make(a, b, p.position_i, p.position_j), **ends
        )

    def _slot(self, owner: str, **ends: Any) -> ImpulseConstraint:
        def make(a: Any, b: Any, part: ImpulseConstraint) -> Any:
            first, last = part.groove()
            return self.pymunk.GrooveJoint(a, b, first, last, part.position_j)

        return self._add_constraint(owner, "slot", make, **ends)

    def _rod(self, owner: str, length: float, **ends: Any) -> ImpulseConstraint:
        def make(a: Any, b: Any, part: ImpulseConstraint) -> Any:
            rod = self.pymunk.PinJoint(a, b, part.position_i, part.position_j)
            rod.distance = length
            return rod

        return self._add_constraint(owner, "rod", make, **ends, target=length)

    def _angle(self, owner: str, angle: float, **ends: Any) -> ImpulseConstraint:
        make = self.pymunk.GearJoint
        return self._add_constraint(owner, "turn", lambda a, b, p: make(a, b, angle, 1.0), **ends)

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
        pressed = tol.PYMUNK_WHEEL_PRESSED * radius
        wheel = self.pymunk.Circle(b, radius + pressed, ends["position_j"])
        (x, y), c, s = ends["position_i"], math.cos(normal), math.sin(normal)
        dx, dy = self.half_length * s, self.half_length * c
        line = (x - dx, y + dy), (x + dx, y - dy)
        base = self.pymunk.Segment(a, *line, 0.0)
        self.rolling += 1
        only = 1 << self.rolling
        for shape in (base, wheel):
            shape.friction = STICKING_FRICTION
            shape.filter = self.pymunk.ShapeFilter(categories=only, mask=only)
        self.space.add(base, wheel)
        # the penetration remains: resolving it would be a motion without force
        self.space.collision_slop = max(2.0 * pressed, self.space.collision_slop)
        part = ImpulseConstraint(
            joint.name, "contact", (base, wheel), **ends, normal=normal, radius=radius
        )
        self.parts.append(part)

    # -- drivers ---------------------------------------------------------------------------------

    def _motor(self, driver: Any) -> ImpulseConstraint:
        match driver:
            case AngleDriver():
                index = self.system.bodies
                ends = {"i": index[driver.relative_to], "j": index[driver.body]}
                make = self.pymunk.SimpleMotor
                return self._add_constraint(
                    driver.name, "turn", lambda a, b, p: make(a, b, 0.0), **ends
                )
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
                free_value = float(at[f"{name}.free_length"] - at[f"{name}.preload"] / k)
                self._spring(
                    ImpulseConstraint(name, "rod", None, **self._ends(load)), free_value, k, 0.0
                )
            case Damper(law=None):
                c = float(at[f"{name}.coefficient"])
                self._spring(ImpulseConstraint(name, "rod", None, **self._ends(load)), 0.0, 0.0, c)
            case TorsionSpring(law=None) if at[f"{name}.stiffness"] != 0.0:
                k = float(at[f"{name}.stiffness"])
                free_value = float(at[f"{name}.free_angle"] - at[f"{name}.preload"] / k)
                self._spring(self._rotation_constraint(load), free_value, k, 0.0)
            case TorsionDamper(law=None):
                self._spring(
                    self._rotation_constraint(load), 0.0, 0.0, float(at[f"{name}.coefficient"])
                )
            case _:
                self.over = (*self.over, n)

    def _rotation_constraint(self, load: Any) -> ImpulseConstraint:
        i, j = (self.system.bodies[body] for body in load.bodies)
        return ImpulseConstraint(load.name, "turn", None, i, j)

    def _spring(
        self, part: ImpulseConstraint, free_value: float, stiffness: float, damping: float
    ) -> None:
        light = {self.system.bodies[name] for name in self.lumped}
        if damping and light & {part.i, part.j}:
            self.drags.append((part, damping))
            return
        a, b = self.everything[part.i], self.everything[part.j]
        if part.kind == "rod":
            ends = (a, b, part.position_i, part.position_j)
            part.native = self.pymunk.DampedSpring(*ends, free_value, stiffness, damping)
        else:
            # pymunk measures the angle of a from b
            part.native = self.pymunk.DampedRotarySpring(a, b, -free_value, stiffness, damping)
        self.space.add(part.native)
        self.springs.append(stretched(part, free_value, stiffness) if stiffness else damped(part))


def _decoupled(ends: dict[str, Any], beta: list[float]) -> dict[str, Any]:
    """Ends of a slider with its slot through the mass centre of i, and its pin on the normal
    through the mass centre of j.

    pymunk's groove solves for both components of a force and then drops the one along the slot.
    This diverges where mass and inertia couple the components; at these places they do not.
    """
    i, j = (
        -position[0] * math.sin(angle) + position[1] * math.cos(angle)
        for position, angle in zip((ends["position_i"], ends["position_j"]), beta, strict=True)
    )
    across = (-math.sin(beta[1]) * (j - i), math.cos(beta[1]) * (j - i))
    return ends | {"position_i": (0.0, 0.0), "position_j": across, "torque_at": ends["position_j"]}


# -- Steps of a pymunk space, and the constraint forces from the momenta of its bodies ---------
# A step of pymunk moves the bodies with their rates, and then finds the impulses for the new
# positions. So the forces of the step from t are those at t + h.


class SpaceStepper:
    """Integrates a space and returns positions, rates, accelerations and forces. `over` (bodies,
    3).
    """

    def __init__(
        self,
        space: Space,
        driver_targets: Callable[[Array], Array],
        over: Array | None = None,
        clock: float = 0.0,
        last: float = np.inf,
    ) -> None:
        self.space, self.driver_targets, self.system = space, driver_targets, space.system
        self.clock, self.last = clock, last
        self.further = np.zeros((space.count, 3)) if over is None else over
        machine = self.system.mechanism
        self.gravity = [load for load in machine.loads if isinstance(load, Gravity)]
        self.pushes = [load for load in machine.loads if isinstance(load, Torque | Force)]
        self.pushed = bool(self.pushes or space.over or space.drags or self.further.any())
        if space.over:
            self.layout, self.work = self.system.runtime(), self.system.work()
            self.motion = np.zeros((1, 3 * self.system.coordinates))
            self.each = np.empty((1, len(machine.loads), self.system.coordinates))

    # -- state -----------------------------------------------------------------------------------

    def put(self, pose: Array, vel: Array) -> None:
        """Set positions and rates of all bodies, arrays (bodies, 3)."""
        for body, (x, y, angle), (vx, vy, omega) in zip(
            self.space.bodies, pose.tolist(), vel.tolist(), strict=True
        ):
            body.position, body.angle = (x, y), angle
            body.velocity, body.angular_velocity = (vx, vy), omega
            self.space.space.reindex_shapes_for_body(body)

    def state(self) -> tuple[Array, Array]:
        """Positions and rates, each (bodies, 3)."""
        both = [
            (*body.position, body.angle, *body.velocity, body.angular_velocity)
            for body in self.space.bodies
        ]
        rows = np.array(both)
        return rows[:, :3], rows[:, 3:]

    # -- stepping --------------------------------------------------------------------------------

    def go(self, t: float, h: float, steps: int) -> Array:
        """Take steps of h from t on; returns the row of `_result` of the last."""
        times: Array = t + h * np.arange(1, steps + 1)
        targets = self.driver_targets(times + h).T
        times = times + self.clock
        gravity = np.zeros((steps, 2))
        for load in self.gravity:
            for n, field in enumerate("xy"):
                gravity[:, n] += _value(reading(self.system).law(load, field), times, self.last)
        laws = [reading(self.system).law(load, "value") for load in self.pushes]
        pushes = [_value(law, times, self.last) for law in laws]
        driven = [(n, part) for n, part in enumerate(self.space.motors) if part is not None]
        native = self.space.space
        steady = not np.ptp(gravity, axis=0).any()
        native.gravity = tuple(gravity[-1].tolist())
        for k in range(steps):
            for n, part in driven:
                part.aim(float(targets[k, n]), h)
            if not steady:
                native.gravity = tuple(gravity[k].tolist())
            if self.pushed or k == steps - 1:
                pose, vel = self.state()
                wrench = self._wrench(times[k], pose + h * vel, vel, [p[k] for p in pushes])
                for body, (fx, fy, torque) in zip(self.space.bodies, wrench.tolist(), strict=True):
                    body.force, body.torque = (fx, fy), torque
            native.step(h)
        return self._result(h, vel, wrench, gravity[-1])

    def _wrench(self, t: float, pose: Array, vel: Array, pushes: list[Any]) -> Array:
        """Applied forces on every body (bodies, 3) at its mass centre, without gravity."""
        space, index = self.space, self.system.bodies
        everywhere, rates = (np.vstack([part, np.zeros(3)]) for part in (pose, vel))
        found = np.zeros((space.count + 1, 3))
        found[:-1] = self.further
        names = {"ground", *(name for load in self.pushes for name in load.bodies)}
        states = {
            name: BodyState(everywhere[b, :2], float(everywhere[b, 2]), rates[b])
            for name, b in ((name, index[name]) for name in names)
        }
        geometry = geometry_of(states)
        for load, value in zip(self.pushes, pushes, strict=True):
            for one in applied_forces(self.system, load, value, *geometry):
                found[index[one.body]] += states[one.body].wrench(one.force, one.torque, one.at)
        for part, coefficient in space.drags:
            column = part.columns(everywhere)[0]
            found -= coefficient * (column * rates).sum() * column
        if space.over:
            n = self.system.coordinates
            self.motion[0, :n], self.motion[0, n : 2 * n] = pose.ravel(), vel.ravel()
            each_load(self.layout, self.work, self.motion, np.array([t]), self.each)
            parts = self.each[0].reshape(-1, space.count, 3)
            found[:-1] += parts[list(space.over)].sum(axis=0)
        return found[:-1]

    # -- results ---------------------------------------------------------------------------------

    def _result(self, h: float, before: Array, wrench: Array, gravity: Array) -> Array:
        """Positions, rates and accelerations (bodies, 3) each; of every part (parts, 4) force and
        torque on its body j, and its first impulse over h; all as one row.

        The impulses of the joints follow from the change of momentum of all bodies.
        """
        space = self.space
        pose, vel = self.state()
        everywhere = np.vstack([pose, np.zeros(3)])
        rates = np.vstack([vel, np.zeros(3)])
        change = (vel - before) / h
        left = space.mass * change - wrench
        left[:, :2] -= space.mass[:, :2] * gravity
        for spring in space.springs:
            left -= spring.impulse(everywhere, rates)[:-1] / h
        units = [part.forces(everywhere) for part in space.parts]
        columns = [part.columns(everywhere)[:, :-1] for part in space.parts]
        scale = np.array([1.0, 1.0, 1.0 / self.system.length])
        found = np.zeros((len(space.parts), 4))
        if not np.isfinite(left).all():
            found[:] = np.nan
        elif columns:
            A = (np.concatenate(columns) * scale).reshape(-1, 3 * space.count).T
            sizes = np.maximum(np.linalg.norm(A, axis=0), tol.TINY)
            impulses = (
                np.linalg.lstsq(A / sizes, (left * scale).ravel(), rcond=tol.LEAST_SQUARES_RANK)[0]
                / sizes
            )
            first = 0
            for n, unit in enumerate(units):
                found[n, :3] = impulses[first : first + len(unit)] @ unit
                found[n, 3] = impulses[first]
                first += len(unit)
        return np.concatenate([pose.ravel(), vel.ravel(), change.ravel(), found.ravel()])


def of_system(system: System, times: Array, last: float) -> Array:
    """Values of the drivers (drivers, times) by their laws."""
    values = [_value(reading(system).law(d), times, last) for d in system.drivers]
    return np.array(values).reshape(len(system.drivers), len(times))


def _value(law: Any, times: Array, last: float) -> Array:
    """A law at times; times after the last are replaced by it where the law has no value."""
    try:
        return np.broadcast_to(law(times), len(times))
    except ModelError:
        # a step goes beyond the end of a table: the last rates are not needed
        return np.broadcast_to(law(np.minimum(times, last)), len(times))
