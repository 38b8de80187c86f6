"""A run replayed in MuJoCo: its instants, and forces on bodies there."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from mbody.engines.load_forces import PointForce, applied_forces
from mbody.engines.mjcf.writer import Exported, safe
from mbody.engines.spanning_tree import MarkerFrame, marker_frame
from mbody.model.loads import Damper, Force, Spring, Torque, TorsionDamper, TorsionSpring
from mbody.solution.checks import each_load_of

if TYPE_CHECKING:
    from mbody.solution.solution import Solution


Array = np.ndarray

#: Inertias below this part of the greatest, and lengths below this part of the model length, are 0.
LIGHT = 1e-9


class Replay:
    """A model of MuJoCo, set to the instants of a run one after the other.

    The small masses of massless bodies are removed; forward dynamics then needs an invertible mass
    matrix, `movable`.
    """

    def __init__(self, made: Exported, run: Solution) -> None:
        import mujoco

        self.mj, self.made, self.run = mujoco, made, run
        self.model: Any = mujoco.MjModel.from_xml_string(made.text)
        self.model.opt.jacobian = mujoco.mjtJacobian.mjJAC_DENSE
        # no constraint stabilisation: rounding errors of the run must not cause forces
        if self.model.neq:
            self.model.eq_solref[:] = -1e-6
        self.data: Any = mujoco.MjData(self.model)
        self.q, self.v, self.a = made.motion(run)
        if run.analysis == "statics":
            self.v, self.a = 0.0 * self.v, 0.0 * self.a
        machine = made.system.mechanism
        self.elements = {one.name: one for one in machine}
        self.own = [one for one in machine.loads if one.name in made.built]
        self.taken = [n for n, one in enumerate(run.mechanism.loads) if one.name not in made.built]
        self.bodies = {name: self.model.body(safe(name)).id for name in made.system.bodies}
        self.step = -1
        without_stand_ins(made, self.model)

    def at(self, step: int) -> None:
        """Set one instant: positions, velocities, accelerations, loads."""
        data = self.data
        data.qpos[:], data.qvel[:] = self.q[step], self.v[step]
        data.time = self.run.t[step] * self.made.scale.time
        data.xfrc_applied[:] = 0.0
        self.step = step
        self.controls(float(self.run.t[step]))
        # the parts of mj_forward that do not divide by the mass
        mj = self.mj
        for stage in (
            mj.mj_kinematics,
            mj.mj_comPos,
            mj.mj_tendon,
            mj.mj_makeM,
            mj.mj_transmission,
        ):
            stage(self.model, data)
        mj.mj_makeConstraint(self.model, data)
        mj.mj_fwdVelocity(self.model, data)
        mj.mj_fwdActuation(self.model, data)

    def controls(self, t: float) -> None:
        """Set the loads that vary with time [of the mechanism]; drivers have no effort."""
        system, scale = self.made.system, self.made.scale
        for load in self.own:
            if load.name in self.made.laws:
                unit = scale.force if isinstance(load, Force) else scale.torque
                value = unit * float(system.law_of(load, "value")(t))
                self.data.ctrl[self.model.actuator(load.name).id] = value

    # -- places and directions by MuJoCo's state --------------------------------------------------

    def point(self, body: str, at: MarkerFrame) -> Array:
        """The world place [m] of a frame on a body."""
        return self.place(body, at.x, at.y)

    def place(self, body: str, x: float, y: float) -> Array:
        """The world place [m] of a place from the mass centre in link axes [of the mechanism]."""
        b, unit = self.bodies[body], self.made.scale.length
        if body == "ground":
            return np.array([x, y]) * unit
        turn = self.data.xmat[b].reshape(3, 3)[:2, :2]
        return np.asarray(self.data.xipos[b][:2] + turn @ (np.array([x, y]) * unit))

    def end(self, element: Any, side: str) -> Array:
        """The world place [m] of an end of an element."""
        at = marker_frame(self.made.system, element, side)
        return self.place(element.places()[side].body, at.x, at.y)

    def direction(self, body: str, angle: float) -> Array:
        """A direction on a body, in the world."""
        turn = self.data.xmat[self.bodies[body]].reshape(3, 3)[:2, :2]
        return np.asarray(turn @ [np.cos(angle), np.sin(angle)])

    def forces(self, element: Any, value: float) -> list[PointForce]:
        """Forces of an element on its bodies, where its force or torque [SI] is `value`."""
        return applied_forces(self.made.system, element, value, self.point, self.direction)

    def loads(self) -> list[PointForce]:
        """Forces of the loads in the file, except gravity, by MuJoCo."""
        model, data, found = self.model, self.data, []
        for load in self.own:
            kind = type(load)
            if kind in (Spring, Damper, TorsionSpring, TorsionDamper):
                t = model.tendon(load.name).id
                rest = model.tendon_lengthspring[t][0]
                pull = model.tendon_stiffness[t] * (data.ten_length[t] - rest)
                pull += model.tendon_damping[t] * data.ten_velocity[t]
                sign = -1.0 if load.name in self.made.reversed else 1.0
                found += self.forces(load, -sign * float(pull))
            elif kind in (Force, Torque):
                found += self.forces(load, float(data.actuator_force[model.actuator(load.name).id]))
        return found

    def reported_loads(self) -> list[PointForce]:
        """Forces of the loads that are not in the file, from the run at this instant."""
        if not self.taken:
            return []
        scale, machine, found = self.made.scale, self.run.mechanism, []
        parts = each_load_of(self.run, self.step)[self.taken].sum(axis=0)
        for body, (fx, fy, torque) in zip(machine.bodies, parts, strict=True):
            place = self.place(body.name, 0.0, 0.0)
            force = scale.force * np.array([fx, fy])
            found.append(PointForce(body.name, place, force, float(scale.torque * torque)))
        return found

    # -- forces on bodies, and on coordinates ----------------------------------------------------

    def apply(self, wrenches: list[PointForce]) -> None:
        """Apply forces to the bodies."""
        for one in wrenches:
            self.add_force(self.bodies[one.body], one.at, one.force, one.torque)

    def add_force(self, b: int, at: Array, force: Array, torque: float) -> None:
        """Apply a force at a place of the world and a torque to body b of MuJoCo."""
        arm = at - self.data.xipos[b][:2]
        turn = torque + arm[0] * force[1] - arm[1] * force[0]
        self.data.xfrc_applied[b] += [*force, 0.0, 0.0, 0.0, turn]

    def find_joint_forces(self) -> None:
        """Compute the forces of the tree's joints in MuJoCo, from the applied wrenches."""
        model, data = self.model, self.data
        # constraints and springs are applied as wrenches: they must not be counted twice
        data.efc_force[:] = 0.0
        kept = model.tendon_stiffness.copy(), model.tendon_damping.copy()
        model.tendon_stiffness[:] = model.tendon_damping[:] = 0.0
        self.mj.mj_rnePostConstraint(model, data)
        model.tendon_stiffness[:], model.tendon_damping[:] = kept

    def weld(self, n: int, x: Array) -> tuple[int, int, Array, Array, float]:
        """Two bodies of weld n, its place, the force and torque on the first, from its forces x."""
        model, data, mj = self.model, self.data, self.mj
        sites = model.eq_obj1id[n], model.eq_obj2id[n]
        one, other = (int(model.site_bodyid[site]) for site in sites)
        turns = []
        for site in sites:
            jacobian = np.zeros((3, model.nv))
            mj.mj_jacSite(model, data, None, jacobian, site)
            turns.append(jacobian[2])
        # MuJoCo's row is a part of the difference of the angles, at present half of it
        apart = turns[0] - turns[1]
        row = self.rows()[data.efc_id == n][5]
        square = float(apart @ apart)
        share = float(row @ apart) / square if square else 0.0
        return one, other, data.site_xpos[sites[1]][:2].copy(), x[:2], share * float(x[5])

    def on_coordinates(self) -> Array:
        """Generalised forces of the wrenches applied to the bodies."""
        total, mj = np.zeros(self.model.nv), self.mj
        for b in range(1, self.model.nbody):
            wrench = self.data.xfrc_applied[b]
            if wrench.any():
                mj.mj_applyFT(
                    self.model, self.data, wrench[:3], wrench[3:], self.data.xipos[b], b, total
                )
        return total

    @property
    def movable(self) -> bool:
        """Whether the mass matrix without stand-ins is regular at the first instant."""
        self.at(0)
        full, root = self.mass(), self.made.system.length * self.made.scale.length
        units = np.array([1.0 if column.way else 1.0 / root for column in self.made.columns])
        size = np.linalg.eigvalsh(full * np.outer(units, units))
        return bool(size[0] > LIGHT * size[-1])

    def mass(self) -> Array:
        """The mass matrix of the coordinates."""
        full = np.zeros((self.model.nv, self.model.nv))
        self.mj.mj_fullM(self.model, self.data, full)
        return full

    def rows(self) -> Array:
        """Jacobian of all constraints (rows, coordinates)."""
        found = np.asarray(self.data.efc_J).reshape(self.data.nefc, self.model.nv).copy()
        # rows of bodies that cannot move relative to each other: rounding
        size = min(1.0, self.made.system.length * self.made.scale.length)
        found[np.linalg.norm(found, axis=1) < LIGHT * size] = 0.0
        return found

    def planar(self) -> Array:
        """Which rows constrain planar motion: two of a point, three of six of a weld."""
        kept = np.ones(self.data.nefc, dtype=bool)
        for n in range(self.model.neq):
            mine = np.flatnonzero(self.data.efc_id == n)
            kept[mine[2:5]] = False
        return kept

    def driving(self, driver: Any) -> Array:
        """Generalised force of a unit effort of a driver, by its motor if it has one."""
        data, full = self.data, np.zeros(self.model.nv)
        if driver.name not in self.made.laws:
            before = data.xfrc_applied.copy()
            data.xfrc_applied[:] = 0.0
            self.apply(self.forces(driver, 1.0))
            full = self.on_coordinates()
            data.xfrc_applied[:] = before
            return full
        n = self.model.actuator(driver.name).id
        part = slice(data.moment_rowadr[n], data.moment_rowadr[n] + data.moment_rownnz[n])
        full[data.moment_colind[part]] = data.actuator_moment[part]
        return full


def without_stand_ins(made: Exported, model: Any) -> None:
    """Remove the small masses and inertias of massless bodies."""
    system = made.system
    for name, branch in made.hung:
        b, own = model.body(safe(name)).id, 3 * system.bodies[branch.body]
        if system.mass[own, 0] == 0.0:
            model.body_mass[b] = 0.0
        if system.mass[own + 2, 0] == 0.0:
            model.body_inertia[b] = 0.0
