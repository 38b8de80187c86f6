"""A free motion integrated with Pinocchio's accelerations and scipy's integrator of order 8.

The expected error is measured: the sensitivity of the motion to a small relative change of the
forces (by a second motion), times the errors of both sides. Ours is the energy balance; theirs is
the gap of their loops, which are not stabilised.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from mbody.engines.cut_constraints import constraint_rows
from mbody.engines.independent_reading import reading
from mbody.engines.load_forces import NATIVE
from mbody.engines.pinocchio.forward import Forward
from mbody.engines.pinocchio.model import Instant

__all__ = ["IntegratedMotion", "integrate"]

Array = np.ndarray

#: Relative and absolute tolerances of the motion, and of the second one.
RTOL, ROUGH = 1e-12, 1e-9
#: Relative increase of the forces in the second motion.
MORE = 1e-6
#: Most bodies times evaluations of a motion: some seconds.
MOST = 50_000
#: Ratio of the condition of the loops to the least one that counts as a singular position.
WORSE = 8.0
#: Greatest amplification of errors at which motions are compared.
SENSITIVE = 1e4


@dataclass(frozen=True)
class IntegratedMotion:
    """A motion integrated with Pinocchio.

    Attributes
    ----------
    q : array (instants, freedoms)
        Coordinates of the tree at the first instants of the run.
    growth : array (instants,)
        Change of the motion, lengths by the model length, per relative change of the forces.
    gap : float
        Gap of the loops at the end, lengths by the model length.
    why : str
        Why it ended before the run's end; empty where it did not.
    """

    q: Array
    growth: Array
    gap: float
    why: str


def integrate(forward: Forward, conditions: Array) -> IntegratedMotion:
    """The motion from the run's first instant on; `conditions` are those of its loops."""
    run = forward.inverse.run
    count, why = len(run), ""
    worse = np.flatnonzero(conditions > WORSE * conditions.min(initial=np.inf))
    if worse.size:
        count, why = int(worse[0]), "the loops are near a singular position there"
    hits = [one.t for one in run.events if one.after is not None]
    if hits and hits[0] <= run.t[count - 1]:
        count = int(np.searchsorted(run.t, hits[0]))
        why = f"'{run.events[0].name}' is hit there"
    steps = _Steps(forward)
    found = steps.along(run.t[:count], RTOL, 0.0)
    beside = _Steps(forward).along(run.t[: len(found)], ROUGH, MORE)
    if len(found) < count:
        why = "it takes too long"
    found = found[: len(beside)]
    unit = forward.scale[forward.twin.columns]
    apart = np.abs((beside[: len(found)] - found) / unit).max(axis=1, initial=0.0) / MORE
    gap = max((steps.gap(q) for q in found[-1:]), default=0.0)
    growth = np.maximum.accumulate(apart)
    last = int(np.searchsorted(growth, SENSITIVE))
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
            apart = float(reading(self.system).values.get(f"{joint.name}.length", 0.0))
            for row in constraint_rows(self.system, joint, instant.bodies):
                unit = 1.0 if row.torque else self.system.length
                worst = max(worst, abs(row.value - apart) / unit)
        return worst
