"""Inverse dynamics by Pinocchio: every effort and every joint force of a known motion.

The recursive Newton–Euler algorithm computes the efforts τ₀ that the tree would need for the
motion. Its joints have no actuators, so the forces of the cut joints and of the drivers must
produce them: C x = τ₀, where a column of C is the generalised force of a unit of one of them. With
x known, a second run of the algorithm, with these forces applied, returns the forces in the joints
of the tree.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from mbody.analysis.driven.forces_on_several import coupled
from mbody.engines.cut_constraints import CUT_JOINTS, ConstraintRow, constraint_rows
from mbody.engines.independent_reading import reading
from mbody.engines.load_forces import NATIVE, gravity_of, wrenches
from mbody.engines.pinocchio.model import Instant, PinocchioModel
from mbody.engines.spanning_tree import Tree, tree_motion
from mbody.model.loads import CentrifugalField, Gravity
from mbody.solution.checks import each_load_of
from mbody.solution.solution import Solution
from mbody.system.system import System

__all__ = ["Forces", "Inverse", "taken_from_run"]

Array = np.ndarray

#: Singular values of C below this part of the greatest count as zero: redundant constraints.
NONE = 1e-10


def taken_from_run(system: System) -> tuple[list[str], CentrifugalField | None]:
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

    Attributes
    ----------
    reactions : dict
        By joint (3,): force and torque on body j by body i at the place on j, world axes.
    efforts : dict
        By driver.
    residual : float
        The greatest residual effort in a joint without actuator [force].
    condition, rank : float, int
        Of C, without redundant constraints.
    needed : float
        The greatest force: of τ₀, of a load, of a mass [force].
    given : dict
        Value, rate, acceleration of every driver (3,), by Pinocchio's kinematics.
    gaps : dict
        Of every cut joint (3,): its gap, and the rates of it; lengths by the model length.
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

    Parameters
    ----------
    system : System
        The system that Pinocchio models.
    run : Solution
        The run with the motion.
    """

    def __init__(self, system: System, tree: Tree, run: Solution) -> None:
        self.system, self.tree, self.run = system, tree, run
        self.taken, self.spin = taken_from_run(system)
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
        if self.taken:
            whole = each_load_of(self.run, k)
            for n, load in enumerate(self.system.mechanism.loads):
                if load.name in self.taken:
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
        scale = np.where(twin.turns[twin.columns], 1.0 / system.length, 1.0)
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
            swift = float(np.abs(now.bodies[name].acceleration[:2]).max()) + field
            top = max(top, mass * swift, *np.abs(wrench / [1.0, 1.0, self.system.length]).tolist())
        return top

    def _gap(self, name: str, rows: list[ConstraintRow]) -> Array:
        """The gap of a cut joint: the greatest of its rows, lengths by the model length."""
        apart = reading(self.system).values.get(f"{name}.length", 0.0)
        worst = np.zeros(3)
        for row in rows:
            unit = 1.0 if row.torque else self.system.length
            parts = np.array([row.value - apart, row.rate, row.change]) / unit
            worst = np.where(np.abs(parts) > np.abs(worst), parts, worst)
        return worst

    def _in_tree(self, now: Instant, found_forces: Forces) -> None:
        """Add the forces of the joints of the tree, on j at the place on j."""
        for branch in self.tree.branches:
            if branch.joint is None:
                continue
            j = branch.parent if branch.reversed else branch.body
            pose = now.bodies[j]
            place = pose.place + pose.arm(branch.on_parent if branch.reversed else branch.on_body)
            force = now.joint_force(branch.body, place)
            found_forces.reactions[branch.joint.name] = -force if branch.reversed else force


def _minimum_norm(C: Array, wanted: Array) -> tuple[Array, Array]:
    """Minimum-norm least-squares x, and the singular values that are not zero."""
    if not C.size:
        return np.zeros(C.shape[1]), np.zeros(0)
    u, s, vt = np.linalg.svd(C, full_matrices=False)
    rank = int((s > NONE * s.max(initial=0.0)).sum())
    x = vt[:rank].T @ ((u[:, :rank].T @ wanted) / s[:rank])
    # one refinement, for the rounding error of the decomposition
    x += vt[:rank].T @ ((u[:, :rank].T @ (wanted - C @ x)) / s[:rank])
    return x, s[:rank]


def _add_force(whole: dict[str, Array], now: Instant, row: ConstraintRow, size: float) -> None:
    """Add a multiplier's force on j, and its opposite on i."""
    for body, sense in ((row.j, size), (row.i, -size)):
        if body != "ground":
            force, torque = sense * row.force, sense * row.torque
            whole[body] = whole[body] + now.bodies[body].wrench(force, torque, row.place)
