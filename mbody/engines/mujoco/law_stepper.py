"""Runge-Kutta steps of MuJoCo under laws of time, with drivers and loads set at every stage."""

from __future__ import annotations

from typing import Any

import numpy as np

from mbody.analysis.position.assembly_analysis import raise_user_error
from mbody.engines.mjcf.exported import Exported, safe
from mbody.kernels.load_breakdown import each_load
from mbody.model.driver import Driver
from mbody.model.loads import Force

__all__ = ["LawStepper"]

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
        self.taken = [n for n, one in enumerate(loads) if one.name not in made.built]
        self.bodies = [model.body(safe(body.name)).id for body in system.mechanism.bodies]
        self.motion = np.zeros((1, 3 * system.coordinates))
        self.work = system.work()
        self.output = np.empty((1, len(loads), system.coordinates))
        self.angles = np.array([made.start[one.name].angle[-1] for one in system.mechanism.bodies])

    def apply(self, t: float) -> None:
        """Apply them to the bodies at a time [of the mechanism]."""
        if not self.taken:
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
            # an angle is the sum of the hinges that turn the body: whole turns count
            q[n, 2] = self.angles[n] + about[2] @ data.qpos
            v[n, :2] = along[:2] @ data.qvel * scale.time / scale.length
            v[n, 2] = about[2] @ data.qvel * scale.time
        each_load(system.runtime(), self.work, self.motion, np.array([t]), self.output)
        raise_user_error(system)
        parts = self.output[0].reshape(-1, len(self.bodies), 3)[self.taken].sum(axis=0)
        for b, (fx, fy, torque) in zip(self.bodies, parts, strict=True):
            force, moment = scale.force * np.array([fx, fy, 0.0]), scale.torque * torque
            data.xfrc_applied[b] = [*force, 0.0, 0.0, moment]
