"""Pinocchio 4: joint angles of a tree, loops by `constraintDynamics`, steps by scipy's DOP853.

The third row of a point constraint is empty in a plane, so that the default `ProximalSettings`
(μ = 0, one iteration) give NaN: μ = 1e-10 with up to 20 iterations here. Without loops `aba`.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from benchmarks.frame import Engine
from benchmarks.peers.stepping import TOLERANCES, dop853, rk4
from benchmarks.planar import GROUND, Planar, absolute

__all__ = ["Pinocchio", "engine", "fixed"]


class Pinocchio:
    """Model, data and the slope of the state (relative angles, then their rates)."""

    def __init__(self, machine: Planar, *, stabilise: float = 0.0) -> None:
        import pinocchio as pin

        self.pin, self.machine, self.tree = pin, machine, machine.tree()
        self.model = pin.Model()
        self.model.gravity.linear = np.array([0.0, machine.gravity, 0.0])
        self.joint: dict[int, int] = {GROUND: 0}
        for body in self.tree.order:
            self._add(body)
        self.data = self.model.createData()
        self.constraints = pin.StdVec_RigidConstraintModel()
        self.forces = pin.StdVec_RigidConstraintData()
        for i, j, on_i, on_j in self.tree.loops:
            places = [self._place(i, on_i), self._place(j, on_j)]
            loop = pin.RigidConstraintModel(
                pin.ContactType.CONTACT_3D,
                self.model,
                self.joint[i],
                places[0],
                self.joint[j],
                places[1],
                pin.ReferenceFrame.LOCAL,
            )
            loop.m_baumgarte_parameters.Kp = stabilise**2
            loop.m_baumgarte_parameters.Kd = 2.0 * stabilise
            self.constraints.append(loop)
            self.forces.append(loop.createData())
        if self.tree.loops:
            pin.initConstraintDynamics(self.model, self.data, self.constraints, self.forces)
        self.proximal = pin.ProximalSettings(1e-12, 1e-12, 1e-10, 20)
        self.tau = np.zeros(machine.bodies)
        self.slope = self._slope()
        angle, rate = machine.relative(self.tree)
        self.start = np.concatenate([angle, rate])

    def _add(self, body: int) -> None:
        pin, tree, machine = self.pin, self.tree, self.machine
        parent, (x, y) = tree.parent[body], tree.on_own[body]
        place = self._place(parent, tree.on_parent[body])
        name = f"body{body}"
        self.joint[body] = self.model.addJoint(self.joint[parent], pin.JointModelRZ(), place, name)
        own = machine.inertia[body]
        inertia = pin.Inertia(
            machine.mass[body], np.array([-x, -y, 0.0]), np.diag([own / 2, own / 2, own])
        )
        self.model.appendBodyToJoint(self.joint[body], inertia, pin.SE3.Identity())

    def _place(self, body: int, point: tuple[float, float]) -> Any:
        """A place on a body from the frame of its joint, whose axes are the body's."""
        own = (0.0, 0.0) if body == GROUND else self.tree.on_own[body]
        return self.pin.SE3(np.eye(3), np.array([point[0] - own[0], point[1] - own[1], 0.0]))

    def _slope(self) -> Callable[[float, np.ndarray], np.ndarray]:
        pin, n = self.pin, self.machine.bodies
        model, data, tau = self.model, self.data, self.tau
        constraints, forces, proximal = self.constraints, self.forces, self.proximal
        loads = self._loads()

        def tree(t: float, y: np.ndarray) -> np.ndarray:
            out = np.empty(2 * n)
            out[:n] = y[n:]
            out[n:] = pin.aba(model, data, y[:n], y[n:], tau)
            return out

        def loops(t: float, y: np.ndarray) -> np.ndarray:
            if loads is not None:
                loads(y)
            out = np.empty(2 * n)
            out[:n] = y[n:]
            out[n:] = pin.constraintDynamics(
                model, data, y[:n], y[n:], tau, constraints, forces, proximal
            )
            return out

        return loops if self.tree.loops else tree

    def _loads(self) -> Callable[[np.ndarray], None] | None:
        """Torques on bodies once for all; springs from the ground to a body that hangs on it."""
        position = {body: n for n, body in enumerate(self.tree.order)}
        for body, torque in self.machine.torques:
            while body != GROUND:
                self.tau[position[body]] += torque
                body = self.tree.parent[body]
        springs = []
        for spring in self.machine.springs:
            if spring.i != GROUND or self.tree.parent[spring.j] != GROUND:
                raise TypeError("springs from the ground to a body that is pinned to it, only")
            joint, own = self.tree.on_parent[spring.j], self.tree.on_own[spring.j]
            arm = (spring.on_j[0] - own[0], spring.on_j[1] - own[1])
            far = (spring.on_i[0] - joint[0], spring.on_i[1] - joint[1])
            springs.append((position[spring.j], arm, far, spring.stiffness, spring.free_length))
        if not springs:
            return None
        held = self.tau.copy()

        def loads(y: np.ndarray) -> None:
            for at, (ax, ay), (fx, fy), stiffness, free in springs:
                c, s = math.cos(y[at]), math.sin(y[at])
                px, py = c * ax - s * ay, s * ax + c * ay
                length = math.hypot(fx - px, fy - py)
                pull = stiffness * (1.0 - free / length)
                self.tau[at] = held[at] + pull * (px * fy - py * fx)

        return loads

    def project(self, y: np.ndarray) -> np.ndarray:
        """Least change of the angles, twice, then of the rates, that closes the loops."""
        pin, n = self.pin, self.machine.bodies
        q, v = y[:n].copy(), y[n:].copy()
        for turn in range(3):
            pin.computeJointJacobians(self.model, self.data, q)
            jacobian, gap = self._gaps()
            if turn < 2:
                q += np.linalg.lstsq(jacobian, gap, rcond=1e-10)[0]
        v -= np.linalg.lstsq(jacobian, jacobian @ v, rcond=1e-10)[0]
        return np.concatenate([q, v])

    def _gaps(self) -> tuple[np.ndarray, np.ndarray]:
        """Rows x and y of every loop: velocity of the place on i against j, and gap from i to j."""
        n = self.machine.bodies
        jacobian, gap = np.zeros((2 * len(self.tree.loops), n)), []
        origin = np.array([frame.translation[:2] for frame in self.data.oMi])
        for k, (loop, pin) in enumerate(zip(self.constraints, self.tree.loops)):
            ends = []
            places = (loop.joint1_placement, loop.joint2_placement)
            for body, place, sign in zip((pin.i, pin.j), places, (1.0, -1.0)):
                point = self.data.oMi[self.joint[body]].act(place.translation)[:2]
                ends.append(point)
                while body != GROUND:
                    at = self.joint[body]
                    x, y = point - origin[at]
                    jacobian[2 * k : 2 * k + 2, at - 1] += sign * np.array([-y, x])
                    body = self.tree.parent[body]
            gap.append(ends[1] - ends[0])
        return jacobian, np.concatenate(gap)

    def state(self, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Absolute angles and rates."""
        n = self.machine.bodies
        return absolute(self.tree, y[:n]), absolute(self.tree, y[n:])


def fixed(machine: Planar, until: float, counts: Sequence[int], stabilise: float) -> Engine:
    """RK4 with Baumgarte's terms, which pass singular positions where a controlled step stalls."""
    made = Pinocchio(machine, stabilise=stabilise)

    def prepare(count: int) -> Callable[[], np.ndarray]:
        return lambda: rk4(made.slope, made.start, until, count)

    return Engine(f"Pinocchio + RK4 + Baumgarte {stabilise:g}", list(counts), prepare, made.state)


def engine(machine: Planar, until: float, *, project: bool = False) -> Engine:
    """Pinocchio with scipy's DOP853, with or without a projection after each step."""
    made = Pinocchio(machine)
    name = "Pinocchio + DOP853" + (" + projection" if project else "")

    def prepare(rtol: float) -> Callable[[], np.ndarray]:
        onto = made.project if project else None
        return lambda: dop853(made.slope, made.start, until, rtol, onto)

    return Engine(name, TOLERANCES, prepare, made.state)
