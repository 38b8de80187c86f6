"""Dynamics by Pinocchio: efforts of a known motion, accelerations from loads, and free motions."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from mbody.analysis.driven.free_body import coupled
from mbody.core import tolerances as tol
from mbody.engines.balance import NATIVE, BodyState, gravity_of, wrenches
from mbody.engines.independent_reading import reading
from mbody.engines.spanning_tree import (
    CUT_JOINTS,
    Branch,
    ConstraintRow,
    MarkerFrame,
    Tree,
    constraint_rows,
    marker_frame,
    tree_motion,
)
from mbody.model.body import SecondMoments, SlenderRod
from mbody.model.joints import Fixed, Revolute
from mbody.model.loads import CentrifugalField, Gravity
from mbody.solution.checks import each_load_of
from mbody.solution.solution import Solution
from mbody.system.system import System

# -- A mechanism as a model of Pinocchio: its tree of joints, and planar views of the results --

Array = np.ndarray


def placement(at: MarkerFrame) -> Any:
    """The SE(3) placement of a frame in the plane."""
    import pinocchio as pin

    c, s = math.cos(at.angle), math.sin(at.angle)
    rotation = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    return pin.SE3(rotation, np.array([at.x, at.y, 0.0]))


class PinocchioModel:
    """Pinocchio model of a mechanism: one chain of its joints for each branch of the tree.

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
        self.revolute = np.array([joint.shortname() == "JointModelRZ" for joint in joints], bool)
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

    `unwrapped_angle` is the angle with whole revolutions, as the coordinates of the joints add up.
    """

    unwrapped_angle: float
    acceleration: Array
    jacobian: Array

    @property
    def whole_angle(self) -> float:
        """The angle with whole revolutions."""
        return self.unwrapped_angle

    def acceleration_at(self, relative: Array) -> Array:
        """Acceleration (2,) of body's point at a position from the mass centre in world axes."""
        across, w = np.array([-relative[1], relative[0]]), self.velocity[2]
        return np.asarray(self.acceleration[:2] + self.acceleration[2] * across - w * w * relative)

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
        unwrapped = self._unwrapped_angles()
        self.bodies = {name: self._pose(n, unwrapped[name]) for name, n in twin.frames.items()}

    def _unwrapped_angles(self) -> dict[str, float]:
        """Angles of the bodies with whole revolutions: the sum of the joint angles."""
        angles, model = {"ground": 0.0}, self.twin.model
        for branch in self.twin.tree.branches:
            angle = angles[branch.parent] + branch.on_parent.angle - branch.on_body.angle
            if branch.kind in ("revolute", "free"):
                angle += self.q[model.joints[self.twin.joint_of[branch.body]].idx_q]
            angles[branch.body] = angle
        return angles

    def _pose(self, frame: int, unwrapped: float) -> BodyKinematics:
        pin, model, data = self.twin.pin, self.twin.model, self.twin.data
        axes = pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
        placed = data.oMf[frame]
        velocity = pin.getFrameVelocity(model, data, frame, axes).vector
        acceleration = pin.getFrameClassicalAcceleration(model, data, frame, axes).vector
        whole = pin.getFrameJacobian(model, data, frame, axes).reshape(6, model.nv)
        rotation = placed.rotation
        return BodyKinematics(
            placed.translation[:2].copy(),
            math.atan2(rotation[1, 0], rotation[0, 0]),
            velocity[[0, 1, 5]],
            unwrapped,
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
            rotation = twin.data.oMi[joint].rotation
            local = pin.Force(
                rotation.T @ np.array([fx, fy, 0.0]), rotation.T @ np.array([0, 0, torque])
            )
            centre = pin.SE3(np.eye(3), place.translation)
            forces[joint] = forces[joint] + centre.act(local)
        return np.array(pin.rnea(twin.model, twin.data, self.q, self.v, self.a, forces))

    def joint_force(self, body: str, at: Array) -> Array:
        """Force and torque (3,), world axes and about a place, on a body by its parent, after the
        last `inverse`.
        """
        joint = self.twin.joint_of[body]
        placed, force = self.twin.data.oMi[joint], self.twin.data.f[joint]
        rotation = placed.rotation
        fx, fy, _ = rotation @ force.linear
        torque = (rotation @ force.angular)[2]
        ax, ay = placed.translation[:2] - at
        return np.array([fx, fy, torque + ax * fy - ay * fx])


def adopted_loads(system: System) -> tuple[list[str], CentrifugalField | None]:
    """Names of loads whose forces are taken from our result, and the load that rotates the
    plane.
    """
    loads = system.mechanism.loads
    fields = [load for load in loads if type(load) is CentrifugalField]
    spin = fields[0] if len(fields) == 1 else None
    native = (*NATIVE, Gravity)
    names = [load.name for load in loads if type(load) not in native and load is not spin]
    return names, spin


@dataclass
class Forces:
    """Results of Pinocchio at one instant.

    `reactions`: By joint (3,): force and torque on body j by body i at the place on j, world axes.
    `efforts`: By driver.
    `residual`: The greatest residual effort in a joint without actuator [force].
    `condition`, `rank`: Of C, without redundant constraints.
    `needed`: The greatest force: of τ₀, of a load, of a mass [force].
    `given`: Value, rate, acceleration of every driver (3,), by Pinocchio's kinematics.
    `gaps`: Of every cut joint (3,): its gap, and the rates of it; lengths by the model length.
    """

    reactions: dict[str, Array] = field(default_factory=dict)
    efforts: dict[str, float] = field(default_factory=dict)
    residual: float = 0.0
    condition: float = 1.0
    rank: int = 0
    needed: float = 0.0
    given: dict[str, Array] = field(default_factory=dict)
    gaps: dict[str, Array] = field(default_factory=dict)


class Inverse:
    """Forces of a run's motion, instant by instant.

    `system`: The system that Pinocchio models.
    `run`: The run with the motion.
    """

    def __init__(self, system: System, tree: Tree, run: Solution) -> None:
        self.system, self.tree, self.run = system, tree, run
        self.adopted, self.spin = adopted_loads(system)
        self.twin = PinocchioModel(system, tree, self.spin)
        self.loop_joints = [j for j in (*tree.cuts, *tree.others) if isinstance(j, CUT_JOINTS)]
        self.others = [e for e in tree.others if not isinstance(e, CUT_JOINTS)]
        self.q, self.v, self.a = tree_motion(tree, run)
        if run.analysis == "statics":
            self.v, self.a = np.zeros_like(self.v), np.zeros_like(self.a)

    def at(self, k: int) -> tuple[Instant, Forces]:
        """Kinematics and forces at an instant."""
        t = float(self.run.t[k])
        speed = self.plane_speed(self.twin, self.q[k], t)
        gravity = gravity_of(self.system, t)
        now = self.twin.at(self.q[k], self.v[k], self.a[k], gravity, speed)
        acting = self.acting(now, k)
        return now, self._solved(now, k, acting)

    def plane_speed(self, twin: PinocchioModel, q: Array, t: float) -> float:
        """The speed of a rotating plane; from a momentum with Pinocchio's own moment of inertia."""
        if self.spin is None:
            return 0.0
        law = reading(self.system).law(self.spin, self.spin.given)
        if self.spin.given == "speed":
            return float(law(t))
        whole = twin.pin.crba(twin.model, twin.data, twin.full(q))[0, 0]
        whole += float(reading(self.system)[f"{self.spin.name}.inertia"])
        return float(law(t)) / whole if whole else 0.0

    def acting(self, now: Instant, k: int) -> dict[str, Array]:
        """Wrenches of loads, and of joints from our result, about the mass centres by body."""
        found = self.native(now, float(self.run.t[k]))
        if self.adopted:
            whole = each_load_of(self.run, k)
            for n, load in enumerate(self.system.mechanism.loads):
                if load.name in self.adopted:
                    for name, b in self.system.bodies.items():
                        if name != "ground":
                            found[name] += whole[n, b]
        for element in self.others:
            for body, wrench in self._ours(element, now, k).items():
                found[body] += wrench
        found.pop("ground", None)
        return found

    def native(self, now: Instant, t: float) -> dict[str, Array]:
        """Wrenches of the loads with force laws here, about the mass centres by body."""
        found = {name: np.zeros(3) for name in now.bodies}
        for load in self.system.mechanism.loads:
            if type(load) in NATIVE:
                for body, wrench in wrenches(self.system, load, now.bodies, t).items():
                    found[body] += wrench
        return found

    def _ours(self, element: Any, now: Instant, k: int) -> dict[str, Array]:
        """Wrenches of a joint or coupling from our result."""
        if not hasattr(element, "i"):
            every = coupled(self.run, element.name, k)
            names = [name for name in self.system.bodies if name != "ground"]
            return {name: every[self.system.bodies[name]] for name in names}
        found = self.run.reaction(element.name)
        place = np.array([part[k] for part in self.run.reaction_point(element.name)])
        force, torque = np.array([found.fx[k], found.fy[k]]), float(found.torque[k])
        i, j = element.i.body, element.j.body
        return {
            j: now.bodies[j].wrench(force, torque, place),
            i: now.bodies[i].wrench(-force, -torque, place),
        }

    def _solved(self, now: Instant, k: int, acting: dict[str, Array]) -> Forces:
        system, twin = self.system, self.twin
        rows = {
            e.name: constraint_rows(system, e, now.bodies)
            for e in (*self.loop_joints, *system.drivers)
        }
        flat = [row for some in rows.values() for row in some]
        needed = now.inverse(acting)
        # forces and torques are scaled by the model length
        scale = np.where(twin.revolute[twin.columns], 1.0 / system.length, 1.0)
        unit = np.array([system.length if row.torque else 1.0 for row in flat])
        C = np.zeros((len(scale), len(flat)))
        for n, row in enumerate(flat):
            C[:, n] = row.jacobian[twin.columns] * scale * unit[n]
        wanted = needed[twin.columns] * scale
        found, sizes = _minimum_norm(C, wanted)
        found_forces = Forces(residual=float(np.abs(C @ found - wanted).max(initial=0.0)))
        found_forces.needed = max(
            float(np.abs(wanted).max(initial=0.0)), self._greatest(now, acting)
        )
        found_forces.rank = len(sizes)
        found_forces.condition = float(sizes[0] / sizes[-1]) if len(sizes) else 1.0
        x = found * unit
        whole = {name: wrench.copy() for name, wrench in acting.items()}
        for row, size in zip(flat, x, strict=True):
            _add_force(whole, now, row, float(size))
        now.inverse(whole)
        sizes_of = iter(x.tolist())
        for name, some in rows.items():
            parts = [next(sizes_of) for _ in some]
            if name in system.primitives_of and name in {d.name for d in system.drivers}:
                found_forces.efforts[name] = parts[0]
                found_forces.given[name] = np.array([some[0].value, some[0].rate, some[0].change])
            else:
                found_forces.reactions[name] = sum(
                    (
                        size * np.array([*row.force, row.torque])
                        for row, size in zip(some, parts, strict=True)
                    ),
                    np.zeros(3),
                )
                found_forces.gaps[name] = self._gap(name, some)
        self._in_tree(now, found_forces)
        return found_forces

    def _greatest(self, now: Instant, acting: dict[str, Array]) -> float:
        """The greatest load, weight or inertia force."""
        field = float(np.abs(self.twin.model.gravity.linear).max())
        top = 0.0
        for name, wrench in acting.items():
            mass, _ = reading(self.system).mass(name)
            acceleration_scale = float(np.abs(now.bodies[name].acceleration[:2]).max()) + field
            top = max(
                top,
                mass * acceleration_scale,
                *np.abs(wrench / [1.0, 1.0, self.system.length]).tolist(),
            )
        return top

    def _gap(self, name: str, rows: list[ConstraintRow]) -> Array:
        """The gap of a cut joint: the greatest of its rows, lengths by the model length."""
        length = reading(self.system).values.get(f"{name}.length", 0.0)
        worst = np.zeros(3)
        for row in rows:
            unit = 1.0 if row.torque else self.system.length
            parts = np.array([row.value - length, row.rate, row.change]) / unit
            worst = np.where(np.abs(parts) > np.abs(worst), parts, worst)
        return worst

    def _in_tree(self, now: Instant, found_forces: Forces) -> None:
        """Add the forces of the joints of the tree, on j at the place on j."""
        for branch in self.tree.branches:
            if branch.joint is None:
                continue
            j = branch.parent if branch.reversed else branch.body
            pose = now.bodies[j]
            place = pose.place + pose.relative_position(
                branch.on_parent if branch.reversed else branch.on_body
            )
            force = now.joint_force(branch.body, place)
            found_forces.reactions[branch.joint.name] = -force if branch.reversed else force


def _minimum_norm(C: Array, wanted: Array) -> tuple[Array, Array]:
    """Minimum-norm least-squares x, and the singular values that are not zero."""
    if not C.size:
        return np.zeros(C.shape[1]), np.zeros(0)
    u, s, vt = np.linalg.svd(C, full_matrices=False)
    rank = int((s > tol.LEAST_SQUARES_RANK * s.max(initial=0.0)).sum())
    x = vt[:rank].T @ ((u[:, :rank].T @ wanted) / s[:rank])
    # one refinement, for the rounding error of the decomposition
    x += vt[:rank].T @ ((u[:, :rank].T @ (wanted - C @ x)) / s[:rank])
    return x, s[:rank]


def _add_force(whole: dict[str, Array], now: Instant, row: ConstraintRow, size: float) -> None:
    """Add a multiplier's force on j, and its opposite on i."""
    for body, sign in ((row.j, size), (row.i, -size)):
        if body != "ground":
            force, torque = sign * row.force, sign * row.torque
            whole[body] = whole[body] + now.bodies[body].wrench(force, torque, row.place)


# -- Forward dynamics by Pinocchio: accelerations from loads and efforts -----------------------
# If all loops are closed by pins and welds and every body has inertia, the accelerations are
# computed by `constraintDynamics` of Pinocchio with its proximal solver. Otherwise M, the bias
# forces and the constraint rows are from Pinocchio, and the saddle-point system [M Jᵀ; J 0] is
# solved here.

#: Of the proximal solver: absolute and relative accuracy, regularisation, iterations. Empty rows of
#: planar loops need the regularisation; without it Pinocchio returns NaN.
PROXIMAL = (1e-14, 1e-14, 1e-10, 100)


class Undetermined(Exception):
    """The accelerations are not determined; the text is the reason."""


class Forward:
    """Accelerations at the instants of a run, and in any other state.

    `inverse`: The same mechanism, whose loads act here too.
    """

    def __init__(self, inverse: Inverse) -> None:
        self.inverse, self.system, self.tree = inverse, inverse.system, inverse.tree
        self.twin = PinocchioModel(self.system, self.tree, lumped=True)
        pin = self.twin.pin
        self.pinned = all(type(joint) in (Revolute, Fixed) for joint in inverse.loop_joints)
        self.models, self.datas = (
            pin.StdVec_RigidConstraintModel(),
            pin.StdVec_RigidConstraintData(),
        )
        if self.pinned:
            for joint in inverse.loop_joints:
                self.models.append(self._loop(joint))
                self.datas.append(self.models[-1].createData())
        self.proximal = pin.ProximalSettings(*PROXIMAL)
        pin.initConstraintDynamics(self.twin.model, self.twin.data, self.models, self.datas)
        self.scale = np.where(self.twin.revolute, 1.0, self.system.length)

    def _loop(self, joint: Any) -> Any:
        """A cut joint as Pinocchio's own constraint."""
        pin, twin = self.twin.pin, self.twin
        ends = []
        for side in ("i", "j"):
            carrier, place = twin.placed[getattr(joint, side).body]
            ends += [carrier, place * placement(marker_frame(self.system, joint, side))]
        kind = pin.ContactType.CONTACT_6D if isinstance(joint, Fixed) else None
        kind = kind or pin.ContactType.CONTACT_3D
        return pin.RigidConstraintModel(kind, twin.model, *ends, pin.ReferenceFrame.LOCAL)

    def now(self, q: Array, v: Array, t: float) -> Instant:
        """Kinematics without accelerations."""
        return self.twin.at(q, v, np.zeros_like(q), gravity_of(self.system, t))

    def gravity(self, t: float, part: float = 1.0) -> None:
        """Sets the gravity of a time, or another part of it."""
        self.twin.model.gravity.linear = np.array([*(part * gravity_of(self.system, t)), 0.0])

    def at(self, k: int) -> tuple[Array, float]:
        """Accelerations of the tree (freedoms,) at an instant of the run under its efforts, and
        their rounding error: ε times the condition, times the accelerations by the loads alone
        [rad/time², lengths by the model length].
        """
        inverse = self.inverse
        t = float(inverse.run.t[k])
        now = self.now(inverse.q[k], inverse.v[k], t)
        efforts = self.load_efforts(now, inverse.acting(now, k), t)
        for driver in self.system.drivers:
            (row,) = constraint_rows(self.system, driver, now.bodies)
            efforts += float(inverse.run.effort(driver.name)[k]) * row.jacobian
        return self.solved(now, efforts)

    def load_efforts(self, now: Instant, acting: dict[str, Array], t: float) -> Array:
        """Generalised forces of the loads, with those of a rotating plane."""
        efforts = np.zeros(self.twin.model.nv)
        for name, wrench in acting.items():
            efforts += wrench @ now.bodies[name].jacobian
        inverse = self.inverse
        if inverse.spin is not None:
            # the part of the bias forces by the rotation
            twin, q = inverse.twin, now.q[self.twin.columns]
            speed = inverse.plane_speed(twin, q, t)
            still = np.zeros_like(q)
            bias = [
                twin.pin.nonLinearEffects(
                    twin.model, twin.data, twin.full(q), twin.full(still, plane)
                )[twin.columns]
                for plane in (speed, 0.0)
            ]
            efforts[self.twin.columns] -= bias[0] - bias[1]
        return efforts

    def solved(
        self, now: Instant, efforts: Array, driven: Sequence[tuple[ConstraintRow, float]] = ()
    ) -> tuple[Array, float]:
        """Accelerations under efforts, with given accelerations of drivers; and their rounding
        error.

        Raises Undetermined where bodies without inertia have free accelerations.
        """
        pin, twin, size = self.twin.pin, self.twin, self.scale
        M = np.array(pin.crba(twin.model, twin.data, now.q))
        M = (np.triu(M) + np.triu(M, 1).T) * np.outer(size, size)
        top = float(np.abs(M).max(initial=0.0)) or 1.0
        bias = np.array(pin.nonLinearEffects(twin.model, twin.data, now.q, now.v))
        rows = [
            (row, 0.0)
            for joint in self.inverse.loop_joints
            for row in constraint_rows(self.system, joint, now.bodies)
        ]
        rows += driven
        unit = np.array([1.0 if row.torque else self.system.length for row, _ in rows])
        J = np.array([row.jacobian * size for row, _ in rows]).reshape(len(rows), len(size))
        J /= unit[:, None]
        u, s, vt = np.linalg.svd(np.block([[M / top, J.T], [J, np.zeros((len(J), len(J)))]]))
        kept = s > tol.COMPARISON_EIGENVALUE_NONE * s.max(initial=0.0)
        if np.abs(vt[~kept][:, : len(size)]).max(initial=0.0) > tol.COMPARISON_FORCE_UNIQUE:
            raise Undetermined("free accelerations of bodies without inertia")
        wanted = np.array([change - row.change for row, change in rows]) / unit
        right = np.concatenate([(efforts - bias) * size / top, wanted])
        condition = float(s[kept].max(initial=1.0) / s[kept].min(initial=1e300))
        rounding = tol.MACHINE_EPSILON * condition * float(np.abs(right).max(initial=0.0))
        if self.pinned and not driven and self.massive(M / top):
            return self.proximal_solved(now, efforts), rounding
        x = np.zeros(len(right))
        K = (u * s) @ vt
        for _ in range(2):  # the second is a refinement
            x += vt[kept].T @ ((u[:, kept].T @ (right - K @ x)) / s[kept])
        return (x[: len(size)] * size)[twin.columns], rounding

    @staticmethod
    def massive(M: Array) -> bool:
        """Whether every motion of the tree has inertia."""
        return bool(np.linalg.eigvalsh(M).min(initial=1.0) > tol.COMPARISON_EIGENVALUE_NONE)

    def proximal_solved(self, now: Any, efforts: Array) -> Array:
        """Accelerations by Pinocchio's own solver; `now` has its q and v."""
        twin = self.twin
        a = twin.pin.constraintDynamics(
            twin.model, twin.data, now.q, now.v, efforts, self.models, self.datas, self.proximal
        )
        return np.array(a)[twin.columns]


# -- A free motion integrated with Pinocchio's accelerations and scipy's integrator of order 8 -
# The expected error is measured: the sensitivity of the motion to a small relative change of the
# forces (by a second motion), times the errors of both sides. Ours is the energy balance; theirs is
# the gap of their loops, which are not stabilised.

#: Most bodies times evaluations of a motion: some seconds.
MOST = 50_000


@dataclass(frozen=True)
class IntegratedMotion:
    """A motion integrated with Pinocchio.

    `q` (instants, freedoms): Coordinates of the tree at the first instants of the run.
    `growth` (instants,): Change of the motion, lengths by the model length, per relative change of
      the forces.
    `gap`: Gap of the loops at the end, lengths by the model length.
    `why`: Why it ended before the run's end; empty where it did not.
    """

    q: Array
    growth: Array
    gap: float
    why: str


def integrate(forward: Forward, conditions: Array) -> IntegratedMotion:
    """The motion from the run's first instant on; `conditions` are those of its loops."""
    run = forward.inverse.run
    count, why = len(run), ""
    worse = np.flatnonzero(
        conditions > tol.COMPARISON_CONDITION_WORSE * conditions.min(initial=np.inf)
    )
    if worse.size:
        count, why = int(worse[0]), "the loops are near a singular position there"
    hits = [one.t for one in run.events if one.after is not None]
    if hits and hits[0] <= run.t[count - 1]:
        count = int(np.searchsorted(run.t, hits[0]))
        why = f"'{run.events[0].name}' is hit there"
    steps = _Steps(forward)
    found = steps.along(run.t[:count], tol.RTOL_COMPARISON, 0.0)
    coarse = _Steps(forward).along(
        run.t[: len(found)], tol.RTOL_COMPARISON_ROUGH, tol.COMPARISON_FORCES_INCREASE
    )
    if len(found) < count:
        why = "it takes too long"
    found = found[: len(coarse)]
    unit = forward.scale[forward.twin.columns]
    difference = (
        np.abs((coarse[: len(found)] - found) / unit).max(axis=1, initial=0.0)
        / tol.COMPARISON_FORCES_INCREASE
    )
    gap = max((steps.gap(q) for q in found[-1:]), default=0.0)
    growth = np.maximum.accumulate(difference)
    last = int(np.searchsorted(growth, tol.COMPARISON_AMPLIFICATION))
    if last < len(found):
        why = "from there on the smallest error changes the motion"
    return IntegratedMotion(found[:last], growth[:last], gap, why)


@dataclass(frozen=True)
class _Now:
    """Coordinates without kinematics."""

    q: Array
    v: Array


class _Steps:
    """One motion."""

    def __init__(self, forward: Forward) -> None:
        self.forward, self.inverse, self.system = forward, forward.inverse, forward.system
        self.more, self.evaluations = 0.0, 0
        loads = self.system.mechanism.loads
        self.plain = (
            forward.pinned
            and not self.system.drivers
            and self.inverse.spin is None
            and not any(type(load) in NATIVE for load in loads)
        )
        twin = forward.twin
        M = twin.pin.crba(twin.model, twin.data, twin.full(self.inverse.q[0])).copy()
        M = (np.triu(M) + np.triu(M, 1).T) * np.outer(forward.scale, forward.scale)
        self.massive = forward.massive(M / (np.abs(M).max(initial=0.0) or 1.0))

    def along(self, times: Array, tolerance: float, more: float) -> Array:
        """Coordinates at the times, up to the work limit."""
        from scipy.integrate import DOP853

        if not len(times):
            return np.zeros((0, self.inverse.q.shape[1]))
        self.more = more
        size = self.inverse.q.shape[1]
        begin = np.concatenate([self.inverse.q[0], self.inverse.v[0]])
        unit = np.tile(self.forward.scale[self.forward.twin.columns], 2)
        found = [begin[:size]]
        if len(times) > 1:
            solver = DOP853(
                self.rates, times[0], begin, times[-1], rtol=tolerance, atol=tolerance * unit
            )
            most = MOST / max(1, len(self.system.mechanism.bodies))
            while solver.status == "running" and self.evaluations < most:
                if solver.step() is not None:
                    break
                inside = solver.dense_output()
                while len(found) < len(times) and times[len(found)] <= solver.t:
                    found.append(inside(times[len(found)])[:size])
        return np.array(found)

    def rates(self, t: float, y: Array) -> Array:
        """(v, a) of (q, v)."""
        self.evaluations += 1
        forward, twin = self.forward, self.forward.twin
        q, v = np.split(y, 2)
        if self.plain and self.massive:
            now: Any = _Now(twin.full(q), twin.full(v))
            forward.gravity(t, 1.0 + self.more)
            return np.concatenate([v, forward.proximal_solved(now, np.zeros(twin.model.nv))])
        instant = forward.now(q, v, t)
        acting = self.inverse.native(instant, t)
        acting.pop("ground", None)
        efforts = (1.0 + self.more) * forward.load_efforts(instant, acting, t)
        forward.gravity(t, 1.0 + self.more)
        driven = [
            (constraint_rows(self.system, driver, instant.bodies)[0], self._change(driver, t))
            for driver in self.system.drivers
        ]
        if forward.pinned and not driven and self.massive:
            return np.concatenate([v, forward.proximal_solved(instant, efforts)])
        return np.concatenate([v, forward.solved(instant, efforts, driven)[0]])

    def _change(self, driver: Any, t: float) -> float:
        """The acceleration by a driver's law."""
        return float(reading(self.system).law(driver).derivatives(t)[2])

    def gap(self, q: Array) -> float:
        """The greatest gap of the loops."""
        instant: Instant = self.forward.now(q, np.zeros_like(q), 0.0)
        worst = 0.0
        for joint in self.inverse.loop_joints:
            length = float(reading(self.system).values.get(f"{joint.name}.length", 0.0))
            for row in constraint_rows(self.system, joint, instant.bodies):
                unit = 1.0 if row.torque else self.system.length
                worst = max(worst, abs(row.value - length) / unit)
        return worst
