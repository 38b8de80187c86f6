"""Steps of a pymunk space, and the constraint forces from the momenta of its bodies.

A step of pymunk moves the bodies with their rates, and then finds the impulses for the new
positions. So the forces of the step from t are those at t + h.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from mbody.engines.independent_reading import reading
from mbody.engines.load_forces import BodyState, applied_forces, geometry_of
from mbody.engines.pymunk.space import Space
from mbody.errors import ModelError
from mbody.kernels.load_breakdown import each_load
from mbody.model.loads import Force, Gravity, Torque
from mbody.system.system import System

__all__ = ["SpaceStepper", "of_system"]

Array = np.ndarray


class SpaceStepper:
    """Integrates a space and returns positions, rates, accelerations and forces.

    Parameters
    ----------
    space : Space
    drive : callable
        Values of all drivers (drivers, times) at times.
    over : array (bodies, 3), optional
        Further forces on the bodies at their mass centres, as of joints that pymunk does not have.
    clock : float
        Offset of the time in the laws of loads, where steps count from 0.
    last : float
        Time after which laws may have no values.
    """

    def __init__(
        self,
        space: Space,
        drive: Callable[[Array], Array],
        over: Array | None = None,
        clock: float = 0.0,
        last: float = np.inf,
    ) -> None:
        self.space, self.drive, self.system = space, drive, space.system
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
        targets = self.drive(times + h).T
        times = times + self.clock
        gravity = np.zeros((steps, 2))
        for load in self.gravity:
            for n, field in enumerate("xy"):
                gravity[:, n] += _value(reading(self.system).law(load, field), times, self.last)
        laws = [reading(self.system).law(load, "value") for load in self.pushes]
        pushes = [_value(law, times, self.last) for law in laws]
        aimed = [(n, part) for n, part in enumerate(self.space.drives) if part is not None]
        native = self.space.space
        steady = not np.ptp(gravity, axis=0).any()
        native.gravity = tuple(gravity[-1].tolist())
        for k in range(steps):
            for n, part in aimed:
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
            sizes = np.maximum(np.linalg.norm(A, axis=0), 1e-300)
            impulses = np.linalg.lstsq(A / sizes, (left * scale).ravel(), rcond=1e-10)[0] / sizes
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
