"""A mechanism as a model of Pinocchio: its tree of joints, and planar views of the results."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from mbody.engines.independent_reading import reading
from mbody.engines.load_forces import BodyState
from mbody.engines.spanning_tree import Branch, MarkerFrame, Tree
from mbody.model.body import SecondMoments, SlenderRod
from mbody.model.loads import CentrifugalField
from mbody.system.system import System

Array = np.ndarray


def placement(at: MarkerFrame) -> Any:
    """The SE(3) placement of a frame in the plane."""
    import pinocchio as pin

    c, s = math.cos(at.angle), math.sin(at.angle)
    turn = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    return pin.SE3(turn, np.array([at.x, at.y, 0.0]))


class PinocchioModel:
    """The same mechanism in Pinocchio: one chain of its joints for each branch of the tree.

    A free branch is two prismatic joints and a revolute one, so that the coordinates are separate.
    A weld is a revolute joint with angle zero, whose effort is the torque of the weld; or, lumped,
    both bodies are one. A rotating plane has a first revolute joint about its axis, so that
    centrifugal forces are computed by Pinocchio from the inertias in space.
    """

    def __init__(
        self, system: System, tree: Tree, spin: CentrifugalField | None = None, lumped: bool = False
    ) -> None:
        import pinocchio as pin

        self.system, self.tree, self.pin = system, tree, pin
        self.model = pin.Model()
        self.model.gravity.linear = np.zeros(3)
        self.placed: dict[str, tuple[int, Any]] = {"ground": (0, pin.SE3.Identity())}
        self.joint_of: dict[str, int] = {}
        columns: list[int] = []
        self.fixed: list[int] = []
        self.spun = spin is not None
        if spin is not None:
            self._spin(spin)
        for branch in tree.branches:
            self._add_branch(branch, lumped, columns)
        #: Indices of the tree's coordinates among those of the model; they have no actuators.
        self.columns = np.array(columns, dtype=np.int64)
        joints = sorted(self.model.joints.tolist()[1:], key=lambda joint: joint.idx_v)
        #: Whether a coordinate is an angle.
        self.turns = np.array([joint.shortname() == "JointModelRZ" for joint in joints], bool)
        self.frames = {
            name: self.model.addFrame(pin.Frame(f"on {name}", *place, pin.FrameType.OP_FRAME))
            for name, place in self.placed.items()
        }
        self.data = self.model.createData()

    def _spin(self, field: CentrifugalField) -> None:
        """A first joint about the axis in the plane; the ground rotates with it."""
        at = reading(self.system)
        x, y = at.place(field, "axis")
        place = placement(MarkerFrame(float(x), float(y), float(at.angle(field, "axis"))))
        pin = self.pin
        joint = self.model.addJoint(0, pin.JointModelRX(), place, "the turning plane")
        self.placed["ground"] = joint, place.inverse()

    def _add_branch(self, branch: Branch, lumped: bool, columns: list[int]) -> None:
        """The joints of a branch, and the inertia of its body."""
        pin, (parent, place) = self.pin, self.placed[branch.parent]
        here, back = place * placement(branch.on_parent), placement(branch.on_body).inverse()
        kinds = {"revolute": "RZ", "prismatic": "PX", "fixed": "" if lumped else "RZ"}
        kind = kinds.get(branch.kind, "PX PY RZ")
        for name in kind.split():
            made = getattr(pin, f"JointModel{name}")()
            parent = self.model.addJoint(parent, made, here, f"{branch.body} {name}")
            here = pin.SE3.Identity()
            column = self.model.joints[parent].idx_v
            (self.fixed if branch.kind == "fixed" else columns).append(column)
        place = here * back
        self.placed[branch.body] = parent, place
        self.joint_of[branch.body] = parent
        self.model.appendBodyToJoint(parent, self._inertia(branch.body), place)

    def _inertia(self, name: str) -> Any:
        """Inertia in space: flat, from its `spread`, else half of its moment about both axes."""
        at = reading(self.system)
        (mass, moment), values = at.mass(name), at.values
        spread = getattr(self.system.mechanism[name], "spread", None)
        xx = yy = 0.5 * moment
        xy = 0.0
        if isinstance(spread, SlenderRod):
            angle = float(values[f"{name}.spread.angle"])
            xx, yy = moment * math.cos(angle) ** 2, moment * math.sin(angle) ** 2
            xy = moment * math.cos(angle) * math.sin(angle)
        elif isinstance(spread, SecondMoments):
            xx, yy, xy = (float(values[f"{name}.spread.{key}"]) for key in ("xx", "yy", "xy"))
        flat = np.array([[yy, -xy, 0.0], [-xy, xx, 0.0], [0.0, 0.0, moment]])
        return self.pin.Inertia(mass, np.zeros(3), flat)

    def full(self, part: Array, plane: float = 0.0) -> Array:
        """Coordinates of the tree among those of the model, welds zero."""
        found = np.zeros(self.model.nv)
        found[self.columns] = part
        if self.spun:
            found[0] = plane
        return found

    def at(self, q: Array, v: Array, a: Array, gravity: Array, plane: float = 0.0) -> Instant:
        """Kinematics at an instant from coordinates of the tree; `plane` is the speed of the
        plane.
        """
        self.model.gravity.linear = np.array([*gravity, 0.0])
        return Instant(self, self.full(q), self.full(v, plane), self.full(a))


@dataclass(frozen=True)
class BodyKinematics(BodyState):
    """One body as Pinocchio has it: position, rates, accelerations (3,), Jacobian (3, n).

    `turns` is the angle with whole turns, as the coordinates of the joints add up.
    """

    turns: float
    acceleration: Array
    jacobian: Array

    @property
    def whole_angle(self) -> float:
        """The angle with whole turns."""
        return self.turns

    def acceleration_at(self, arm: Array) -> Array:
        """Acceleration (2,) of the body's point at an arm in world axes."""
        across, w = np.array([-arm[1], arm[0]]), self.velocity[2]
        return np.asarray(self.acceleration[:2] + self.acceleration[2] * across - w * w * arm)

    def generalized_force(self, force: Array, torque: float, at: Array) -> Array:
        """Generalised force (n,) of a force at a place of the world and a torque."""
        return np.asarray(self.wrench(force, torque, at) @ self.jacobian)


class Instant:
    """Kinematics of a twin at one instant; velocities are without the rotation of the plane."""

    def __init__(self, twin: PinocchioModel, q: Array, v: Array, a: Array) -> None:
        self.twin, self.q, self.v, self.a = twin, q, v, a
        pin, model, data = twin.pin, twin.model, twin.data
        rates = v.copy()
        if twin.spun:
            rates[0] = 0.0
        pin.forwardKinematics(model, data, q, rates, a)
        pin.computeJointJacobians(model, data, q)
        pin.updateFramePlacements(model, data)
        turns = self._turns()
        self.bodies = {name: self._pose(n, turns[name]) for name, n in twin.frames.items()}

    def _turns(self) -> dict[str, float]:
        """Angles of the bodies with whole turns: the sum of the joint angles."""
        angles, model = {"ground": 0.0}, self.twin.model
        for branch in self.twin.tree.branches:
            angle = angles[branch.parent] + branch.on_parent.angle - branch.on_body.angle
            if branch.kind in ("revolute", "free"):
                angle += self.q[model.joints[self.twin.joint_of[branch.body]].idx_q]
            angles[branch.body] = angle
        return angles

    def _pose(self, frame: int, turns: float) -> BodyKinematics:
        pin, model, data = self.twin.pin, self.twin.model, self.twin.data
        axes = pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
        placed = data.oMf[frame]
        velocity = pin.getFrameVelocity(model, data, frame, axes).vector
        acceleration = pin.getFrameClassicalAcceleration(model, data, frame, axes).vector
        whole = pin.getFrameJacobian(model, data, frame, axes).reshape(6, model.nv)
        turn = placed.rotation
        return BodyKinematics(
            placed.translation[:2].copy(),
            math.atan2(turn[1, 0], turn[0, 0]),
            velocity[[0, 1, 5]],
            turns,
            acceleration[[0, 1, 5]],
            whole[[0, 1, 5]],
        )

    def inverse(self, wrenches: dict[str, Array]) -> Array:
        """Efforts (n,) by the recursive Newton–Euler algorithm, under wrenches (3,) about mass
        centres, world axes, by body. The joint forces remain in the data.
        """
        twin, pin = self.twin, self.twin.pin
        forces = pin.StdVec_Force()
        for _ in range(twin.model.njoints):
            forces.append(pin.Force.Zero())
        for name, (fx, fy, torque) in wrenches.items():
            joint, place = twin.placed[name]
            turn = twin.data.oMi[joint].rotation
            local = pin.Force(turn.T @ np.array([fx, fy, 0.0]), turn.T @ np.array([0, 0, torque]))
            centre = pin.SE3(np.eye(3), place.translation)
            forces[joint] = forces[joint] + centre.act(local)
        return np.array(pin.rnea(twin.model, twin.data, self.q, self.v, self.a, forces))

    def joint_force(self, body: str, at: Array) -> Array:
        """Force and torque (3,), world axes and about a place, on a body by its parent, after the
        last `inverse`.
        """
        joint = self.twin.joint_of[body]
        placed, force = self.twin.data.oMi[joint], self.twin.data.f[joint]
        turn = placed.rotation
        fx, fy, _ = turn @ force.linear
        torque = (turn @ force.angular)[2]
        ax, ay = placed.translation[:2] - at
        return np.array([fx, fy, torque + ax * fy - ay * fx])
