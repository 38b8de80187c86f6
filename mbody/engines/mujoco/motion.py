"""Free motions by MuJoCo: accelerations at an instant, and trajectories by its integrator."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from mbody.analysis.dynamics.simulate import simulate
from mbody.analysis.position.assembly_analysis import raise_user_error
from mbody.core import tolerances as tol
from mbody.engines.balance import Inexpressible, PointForce, Row, applied_forces
from mbody.engines.mjcf import Exported, to_mjcf
from mbody.engines.mjcf_contacts import safe
from mbody.engines.spanning_tree import MarkerFrame, marker_frame
from mbody.errors import ModelError, SolveError
from mbody.kernels.finished_instants import each_load
from mbody.model.body import Body
from mbody.model.driver import Driver
from mbody.model.element import listed
from mbody.model.joints import Distance
from mbody.model.loads import Damper, Force, Spring, Torque, TorsionDamper, TorsionSpring
from mbody.solution.checks import each_load_of

if TYPE_CHECKING:
    from mbody.solution.solution import Solution


# -- A run replayed in MuJoCo: its instants, and forces on bodies there ------------------------

Array = np.ndarray


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
        self.adopted = [
            n for n, one in enumerate(run.mechanism.loads) if one.name not in made.built
        ]
        self.bodies = {name: self.model.body(safe(name)).id for name in made.system.bodies}
        self.step = -1
        without_artificial_masses(made, self.model)

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
        rotation = self.data.xmat[b].reshape(3, 3)[:2, :2]
        return np.asarray(self.data.xipos[b][:2] + rotation @ (np.array([x, y]) * unit))

    def end(self, element: Any, side: str) -> Array:
        """The world place [m] of an end of an element."""
        at = marker_frame(self.made.system, element, side)
        return self.place(element.places()[side].body, at.x, at.y)

    def direction(self, body: str, angle: float) -> Array:
        """A direction on a body, in the world."""
        rotation = self.data.xmat[self.bodies[body]].reshape(3, 3)[:2, :2]
        return np.asarray(rotation @ [np.cos(angle), np.sin(angle)])

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
                free_length = model.tendon_lengthspring[t][0]
                pull = model.tendon_stiffness[t] * (data.ten_length[t] - free_length)
                pull += model.tendon_damping[t] * data.ten_velocity[t]
                sign = -1.0 if load.name in self.made.reversed else 1.0
                found += self.forces(load, -sign * float(pull))
            elif kind in (Force, Torque):
                found += self.forces(load, float(data.actuator_force[model.actuator(load.name).id]))
        return found

    def reported_loads(self) -> list[PointForce]:
        """Forces of the loads that are not in the file, from the run at this instant."""
        if not self.adopted:
            return []
        scale, machine, found = self.made.scale, self.run.mechanism, []
        parts = each_load_of(self.run, self.step)[self.adopted].sum(axis=0)
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
        relative = at - self.data.xipos[b][:2]
        moment = torque + relative[0] * force[1] - relative[1] * force[0]
        self.data.xfrc_applied[b] += [*force, 0.0, 0.0, 0.0, moment]

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
        angular = []
        for site in sites:
            jacobian = np.zeros((3, model.nv))
            mj.mj_jacSite(model, data, None, jacobian, site)
            angular.append(jacobian[2])
        # MuJoCo's row is a part of the difference of the angles, at present half of it
        difference = angular[0] - angular[1]
        row = self.rows()[data.efc_id == n][5]
        square = float(difference @ difference)
        share = float(row @ difference) / square if square else 0.0
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
        """Whether the mass matrix without artificial masses is regular at the first instant."""
        self.at(0)
        full, root = self.mass(), self.made.system.length * self.made.scale.length
        units = np.array([1.0 if column.slides else 1.0 / root for column in self.made.columns])
        size = np.linalg.eigvalsh(full * np.outer(units, units))
        return bool(size[0] > tol.COMPARISON_INERTIA_NONE * size[-1])

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
        found[np.linalg.norm(found, axis=1) < tol.COMPARISON_INERTIA_NONE * size] = 0.0
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


def without_artificial_masses(made: Exported, model: Any) -> None:
    """Remove the small masses and inertias of massless bodies."""
    system = made.system
    for name, branch in made.hung:
        b, own = model.body(safe(name)).id, 3 * system.bodies[branch.body]
        if system.mass[own, 0] == 0.0:
            model.body_mass[b] = 0.0
        if system.mass[own + 2, 0] == 0.0:
            model.body_inertia[b] = 0.0


# -- Runge-Kutta steps of MuJoCo under laws of time, with drivers and loads set at every stage -

#: Stages and weights of the classical Runge-Kutta method of order 4.
STAGES = (0.0, 0.5, 0.5, 1.0)
WEIGHTS = (1.0, 2.0, 2.0, 1.0)


class LawStepper:
    """An integrator for a model of MuJoCo whose drivers are constraints with laws of time.

    `mj_step` cannot evaluate laws within a step. So accelerations are computed by `mj_forward` at
    the stages of the same method of order 4, with the laws set before each.
    """

    def __init__(self, made: Exported, model: Any, data: Any) -> None:
        import mujoco

        self.forward, self.made, self.model, self.data = mujoco.mj_forward, made, model, data
        system, scale = made.system, made.scale
        self.loads, self.driven = [], []
        self.reported = _ReportedLoads(made, model, data)
        begin = float(data.time) / scale.time
        for name, field in made.laws.items():
            element: Any = system.mechanism[name]
            law = system.law_of(element, field)
            if isinstance(element, Driver):
                unit = element.unit(scale.length)
                # a slide may have the opposite sign of its driver
                unit *= float(model.actuator_gear[model.actuator(name).id][0])
                self.driven.append((model.eq(name).id, law, unit, float(law(begin))))
            else:
                unit = scale.force if isinstance(element, Force) else scale.torque
                self.loads.append((model.actuator(name).id, law, unit))

    def advance(self, h: float, count: int) -> None:
        """Take `count` steps of h [s]."""
        data = self.data
        for _ in range(count):
            t, q, v = float(data.time), data.qpos.copy(), data.qvel.copy()
            rates, changes = np.zeros_like(v), np.zeros_like(v)
            speed, change = v, np.zeros_like(v)
            for stage, weight in zip(STAGES, WEIGHTS, strict=True):
                data.time = t + stage * h
                data.qpos[:], data.qvel[:] = q + stage * h * speed, v + stage * h * change
                speed = data.qvel.copy()
                change = self._accelerations()
                rates += weight * speed
                changes += weight * change
            data.qpos[:], data.qvel[:] = q + h / 6.0 * rates, v + h / 6.0 * changes
            data.time = t + h

    def _accelerations(self) -> np.ndarray:
        """Accelerations at the state and time of the data.

        The reference acceleration of a constraint is −b ẋ − k d (x − c). With
        c = f + (b ḟ + f̈)/(k d) it is f̈ − b (ẋ − ḟ) − k d (x − f), for the law f.
        """
        model, data, scale = self.model, self.data, self.made.scale
        t = float(data.time) / scale.time
        for n, law, unit in self.loads:
            data.ctrl[n] = unit * float(law(t))
        for n, law, unit, begin in self.driven:
            value, rate, change = (float(part) for part in law.derivatives(t))
            pull, damping = (-float(part) for part in model.eq_solref[n])
            most = float(model.eq_solimp[n][1])
            # as MuJoCo computes them: k = pull/d², b = damping/d
            k, b = pull / most**2, damping / most
            ahead = (b * rate / scale.time + change / scale.time**2) / (k * most)
            model.eq_data[n][0] = unit * (value - begin + ahead)
        self.reported.apply(t)
        self.forward(model, data)
        return np.array(data.qacc)


class _ReportedLoads:
    """Loads that MuJoCo does not have, computed by mbody from the state of MuJoCo."""

    def __init__(self, made: Exported, model: Any, data: Any) -> None:
        import mujoco

        self.mj, self.made, self.model, self.data = mujoco, made, model, data
        system = made.system
        loads = system.mechanism.loads
        self.adopted = [n for n, one in enumerate(loads) if one.name not in made.built]
        self.bodies = [model.body(safe(body.name)).id for body in system.mechanism.bodies]
        self.motion = np.zeros((1, 3 * system.coordinates))
        self.work = system.work()
        self.output = np.empty((1, len(loads), system.coordinates))
        self.angles = np.array([made.start[one.name].angle[-1] for one in system.mechanism.bodies])

    def apply(self, t: float) -> None:
        """Apply them to the bodies at a time [of the mechanism]."""
        if not self.adopted:
            return
        model, data, scale, system = self.model, self.data, self.made.scale, self.made.system
        self.mj.mj_kinematics(model, data)
        self.mj.mj_comPos(model, data)
        n3 = system.coordinates
        q, v = self.motion[0, :n3].reshape(-1, 3), self.motion[0, n3 : 2 * n3].reshape(-1, 3)
        along, about = np.zeros((3, model.nv)), np.zeros((3, model.nv))
        for n, b in enumerate(self.bodies):
            self.mj.mj_jacBodyCom(model, data, along, about, b)
            q[n, :2] = data.xipos[b][:2] / scale.length
            # an angle is the sum of the hinges that turn the body: whole revolutions count
            q[n, 2] = self.angles[n] + about[2] @ data.qpos
            v[n, :2] = along[:2] @ data.qvel * scale.time / scale.length
            v[n, 2] = about[2] @ data.qvel * scale.time
        each_load(system.runtime(), self.work, self.motion, np.array([t]), self.output)
        raise_user_error(system)
        parts = self.output[0].reshape(-1, len(self.bodies), 3)[self.adopted].sum(axis=0)
        for b, (fx, fy, torque) in zip(self.bodies, parts, strict=True):
            force, moment = scale.force * np.array([fx, fy, 0.0]), scale.torque * torque
            data.xfrc_applied[b] = [*force, 0.0, 0.0, moment]


#: Steps of the coarsest of three runs in the shortest characteristic time of the motion.
STEPS = 100
#: Steps of the finest run, at most.
MOST = 80_000
#: Coordinates at which a step takes twice the time, so that the most steps are halved.
MANY = 20
#: The same where laws of time are evaluated at every stage of a step.
MOST_GUIDED = 12_000


def motion_rows(
    made: Exported, run: Solution, seen: Solution
) -> tuple[list[Row], list[Inexpressible], list[str]]:
    """Rows of accelerations and of the motion; what cannot be compared; notes."""
    machine = made.system.mechanism
    if not Replay(made, seen).movable:
        why = "its motion: MuJoCo cannot move massless bodies, nor very light ones under loads"
        light = made.artificial_masses or (min(machine.bodies, key=_mass_in(made)).name,)
        return [], [Inexpressible(name, why) for name in light], []
    rods = [joint.name for joint in machine.joints if type(joint) is Distance]
    why = "accelerations at an instant: MuJoCo neglects the rotation rate of a tendon"
    refused = [Inexpressible(name, why) for name in rods]
    rows = [] if rods or machine.drivers else _accelerations(Replay(made, seen))
    exported = to_mjcf(made.system, made.start, fix_drivers=True, smooth=True)
    drivers = {driver.name for driver in machine.drivers}
    loose = [one for one in exported.without if one.element in drivers]
    if loose:
        return rows, [*refused, *loose], []
    impacts = [one.t for one in run.events if one.after is not None]
    notes: list[str] = []
    if impacts:
        run = run.take(np.flatnonzero(run.t < impacts[0]))
        notes.append(f"the motion is compared up to the first impact, at t = {impacts[0]:g}")
    if len(run) < 2:
        return rows, refused, notes
    return rows + _trajectories(exported, run, notes), refused, notes


def _mass_in(made: Exported) -> Callable[[Body], float]:
    return lambda body: float(made.system.mass[3 * made.system.bodies[body.name], 0])


def _accelerations(replay: Replay) -> list[Row]:
    """Accelerations of every coordinate, by MuJoCo's solver of soft constraints.

    Its force f satisfies (A + R) f = b with the regularisation R. Rigid constraints have A f = b,
    so the error of the accelerations is −M⁻¹Jᵀ A⁻¹ R f.
    """
    replay.model.opt.tolerance, replay.model.opt.iterations = 0.0, 200
    theirs, soft = np.zeros_like(replay.a), np.zeros_like(replay.a)
    for step in range(len(replay.run)):
        replay.at(step)
        replay.apply(replay.reported_loads())
        replay.mj.mj_forward(replay.model, replay.data)
        theirs[step] = replay.data.qacc
        if replay.data.nefc:
            J, inverse = replay.rows(), np.linalg.inv(replay.mass())
            given = replay.data.efc_R * replay.data.efc_force
            soft[step] = (
                inverse
                @ J.T
                @ np.linalg.pinv(J @ inverse @ J.T, rcond=tol.LEAST_SQUARES_RANK)
                @ given
            )
    units = np.array(
        [replay.made.scale.length if one.slides else 1.0 for one in replay.made.columns]
    ) / (replay.made.scale.time**2)
    ours, theirs, soft = replay.a / units, theirs / units, soft / units
    slides = np.array([column.slides for column in replay.made.columns])
    rates = replay.v / (units * replay.made.scale.time)
    found = []
    for n, column in enumerate(replay.made.columns):
        alike = slides == column.slides
        top = max(float(np.abs(ours[:, alike]).max()), float(np.abs(rates[:, alike]).max() ** 2))
        worst = int(np.abs(ours[:, n] - theirs[:, n]).argmax())
        pair = float(ours[worst, n]), float(theirs[worst, n])
        top = top or 1.0
        expected = 1.5 * float(np.abs(soft[:, n]).max()) / top + tol.COMPARISON_ROUNDING
        found.append(
            Row(
                f"{column.name}.acceleration",
                *pair,
                abs(pair[0] - pair[1]) / top,
                expected,
                "softness of its constraints, by their regularisation R and forces",
            )
        )
    return found


def _trajectories(made: Exported, run: Solution, notes: list[str]) -> list[Row]:
    """Positions, angles and energies along the motion, by three runs with halved steps."""
    h = _step(made, run)
    count = np.maximum(np.ceil(np.diff(run.t) * made.scale.time / h).astype(int), 1)
    with_laws = _needs_laws(made)
    most = (MOST_GUIDED if with_laws else MOST) / (1.0 + len(made.columns) / MANY)
    while 4 * count.sum() > most and count.max() > 1:
        count = np.maximum(count // 2, 1)
    runs = [_integrated(made, run, count * 2**n) for n in range(3)]
    ours, off = _our_histories(made, run)
    steps = int(count.sum())
    own = "RK4 on MuJoCo's accelerations" if with_laws else "MuJoCo's RK4"
    notes.append(f"motion by {own} in {steps}, {2 * steps} and {4 * steps} steps")
    found = []
    reason = "its step size: twice the change by halved steps, and our own error"
    for key, mine in ours.items():
        coarse, middle, fine = (one[key] for one in runs)
        top = max(float(np.abs(ours[k]).max()) for k in ours if _kind(k) == _kind(key)) or 1.0
        last = float(np.abs(fine - middle).max())
        before = float(np.abs(middle - coarse).max())
        difference = np.abs(mine - fine)
        worst = int(difference.argmax())
        # at order one, as with soft constraints, the remaining error is at most the last change
        band = 2.0 * max(last, 0.0 if before > last else before) / top
        expected = band + off[key] / top + tol.COMPARISON_ROUNDING
        found.append(
            Row(
                key,
                float(mine[worst]),
                float(fine[worst]),
                float(difference[worst]) / top,
                expected,
                reason,
            )
        )
    unsettled = [row.quantity for row in found if row.expected > tol.COMPARISON_COARSE]
    if unsettled:
        notes.append(
            f"{listed(unsettled)}: halved steps still change them by more than "
            f"{tol.COMPARISON_COARSE:g} of the greatest, "
            "so that agreement proves little: use a shorter time"
        )
    return found


def _needs_laws(made: Exported) -> bool:
    """Whether laws or loads must be set at every stage of a step."""
    return bool(made.laws) or any(
        load.name not in made.built for load in made.system.mechanism.loads
    )


def _kind(key: str) -> str:
    kind = key.rpartition(".")[2]
    return "place" if kind in ("x", "y") else kind


def _step(made: Exported, run: Solution) -> float:
    """A first step [s], by the fastest rate of the motion."""
    length, rate = made.system.length, 0.0
    for body in made.system.mechanism.bodies:
        one = run[body.name]
        quick = np.abs(one.omega).max(), np.hypot(one.vx, one.vy).max() / length
        sudden = np.abs(one.alpha).max(), np.hypot(one.ax, one.ay).max() / length
        rate = max(rate, *map(float, quick), *(math.sqrt(float(part)) for part in sudden))
    span = float(run.t[-1] - run.t[0])
    return made.scale.time / max(STEPS * rate, 200.0 / span)


def _our_histories(made: Exported, run: Solution) -> tuple[dict[str, Array], dict[str, float]]:
    """Our own histories, and their error by a second run with a smaller tolerance."""
    ours = _histories(run)
    try:
        again = simulate(
            run.system,
            float(run.t[-1]),
            start=run.take([0]),
            times=run.t,
            rtol=tol.RTOL_COMPARISON,
            events=(),
        )
        sharp = _histories(again)
        off = {key: float(np.abs(ours[key] - sharp[key]).max()) for key in ours}
    except (ModelError, SolveError):
        off = dict.fromkeys(ours, 0.0)
    return ours, off


def _histories(run: Solution) -> dict[str, Array]:
    system = run.system
    found: dict[str, Array] = {}
    kinetic = np.zeros(len(run))
    for body in run.mechanism.bodies:
        one, b = run[body.name], 3 * system.bodies[body.name]
        mass, inertia = system.mass[b, 0], system.mass[b + 2, 0]
        kinetic += 0.5 * (mass * (one.vx**2 + one.vy**2) + inertia * one.omega**2)
        found |= {f"{body.name}.{key}": getattr(one, key) for key in ("x", "y", "angle")}
    return found | {"motion.energy": kinetic}


def _integrated(made: Exported, run: Solution, count: Array) -> dict[str, Array]:
    """The motion by MuJoCo, with `count` steps between the instants."""
    import mujoco

    model: Any = mujoco.MjModel.from_xml_string(made.text)
    without_artificial_masses(made, model)
    data = mujoco.MjData(model)
    model.opt.tolerance, model.opt.iterations = tol.MUJOCO_SOLVER_FINE, 5
    model.opt.enableflags |= int(mujoco.mjtEnableBit.mjENBL_ENERGY)
    # failed steps must be visible: no automatic reset
    model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_AUTORESET)
    _, v, _ = made.motion(run.take([0]))
    data.qvel[:] = v[0]
    scale, names = made.scale, [body.name for body in made.system.mechanism.bodies]
    data.time = float(run.t[0]) * scale.time
    stepper = LawStepper(made, model, data) if _needs_laws(made) else None
    bodies = [model.body(safe(name)).id for name in names]
    table = np.zeros((len(run), 3 * len(names) + 1))
    angles = np.array([run[name].angle[0] for name in names])
    for n in range(len(run)):
        if n:
            h = float(run.t[n] - run.t[n - 1]) * scale.time / int(count[n - 1])
            model.opt.timestep = h
            if model.neq:
                k = 0.5 / h**2
                model.eq_solref[:] = -k, -0.1 * math.sqrt(k)
            if stepper:
                stepper.advance(h, int(count[n - 1]))
            else:
                mujoco.mj_step(model, data, int(count[n - 1]))
        mujoco.mj_forward(model, data)
        place = data.xipos[bodies][:, :2] / scale.length
        axes = data.xmat[bodies].reshape(-1, 9)
        heading = np.arctan2(axes[:, 3], axes[:, 0])
        angles = angles + np.remainder(heading - angles + np.pi, 2.0 * np.pi) - np.pi
        table[n, :-1] = np.column_stack([place, angles]).reshape(-1)
        table[n, -1] = data.energy[1] / scale.torque
    keys = [f"{name}.{key}" for name in names for key in ("x", "y", "angle")]
    return dict(zip([*keys, "motion.energy"], table.T, strict=True))
