"""The opinion of the oracle on forces of a driven motion that keeps contacts closed.

Its own gaps, normals and sliding rates at our positions; then one dense system of all rows, with
friction as a part of the normal force of what slides, and as an unknown of what rolls.
"""

from __future__ import annotations

import math

import numpy as np

from mbody.engines.comparison import Comparison
from mbody.engines.opinion import Opinion
from mbody.engines.oracle.friction import rubs
from mbody.engines.oracle.reference import Reference
from mbody.engines.oracle.touching import OracleTouching
from mbody.solution.own_histories import own_history
from mbody.solution.solution import Solution
from mbody.system.system import System

__all__ = ["closed_contact_opinion"]

Array = np.ndarray

#: Expected difference, in ε times the condition of the equations.
OPERATIONS = 20_000.0
#: Instants that are compared, evenly over the run.
INSTANTS = 25
#: A gap that is closed, in model lengths, and a rate that is none, as a part of the swiftest.
CLOSED, RESTS = 1e-8, 1e-11


def closed_contact_opinion(system: System, run: Solution) -> Opinion:
    """Gaps, and all forces, at some instants.

    Raises
    ------
    NotImplementedError
        For what the oracle has not: friction of joints, stops and limits.
    """
    if any(rubs(joint) for joint in system.mechanism.joints):
        raise NotImplementedError("it has no friction of joints beside contacts")
    check = _ClosedCheck(system, run)
    count = len(run)
    instants = np.unique(np.linspace(0, count - 1, min(count, INSTANTS)).round().astype(int))
    for k in instants.tolist():
        check.at(k)
    return check.opinion(instants)


class _ClosedCheck:
    """Forces of the oracle, instant by instant."""

    def __init__(self, system: System, run: Solution) -> None:
        self.system, self.run, machine = system, run, system.mechanism
        self.reference = Reference(machine)
        self.closed = [one for one in machine.contacts if one.closed]
        self.touching = OracleTouching(self.reference, self.closed)
        self.scale = np.tile([1.0, 1.0, 1.0 / system.length], len(machine.bodies))
        self.conditions: list[float] = []
        self.gaps: list[dict[str, float]] = []
        self.efforts: list[dict[str, float]] = []
        self.pressing: list[dict[str, float]] = []
        self.reactions: list[dict[str, Array]] = []
        self.loads: list[float] = []

    def _state(self, keys: tuple[str, ...], k: int) -> Array:
        bodies = self.system.mechanism.bodies
        return np.array([float(getattr(self.run[b.name], key)[k]) for b in bodies for key in keys])

    def at(self, k: int) -> None:
        """The forces at an instant, by our motion."""
        oracle, touching, machine = self.reference, self.touching, self.system.mechanism
        t, q = float(self.run.t[k]), self._state(("x", "y", "angle"), k)
        still = np.zeros_like(q)
        v = a = still
        if self.run.analysis != "statics":
            v = self._state(("vx", "vy", "omega"), k)
            a = self._state(("ax", "ay", "alpha"), k)
        oracle.own = {
            one.name: float(own_history(self.run, one.name)[k])
            for one in (*machine.inputs, *machine.states)
        }
        gaps = touching.gaps(q)
        near = np.abs(gaps) <= CLOSED * self.system.length
        names = [spot.name for spot in touching.spots]
        count, W, rates = len(names), touching.rows(q), np.real(touching.rates(q, v))
        rolls = {one.name: one.rolls for one in self.closed}
        swift, columns, owners = float(np.abs(v).max(initial=0.0)), [], []
        for n in np.flatnonzero(near).tolist():
            slides = abs(rates[count + n]) > RESTS * swift and not rolls[names[n]]
            mu = touching.spots[n].friction * math.copysign(1.0, rates[count + n]) * slides
            columns.append(W[n] - mu * W[count + n])
            owners.append(names[n])
            if rolls[names[n]]:
                columns.append(W[count + n])
                owners.append("")
        g = oracle.phi_q(q, t)
        A = np.vstack([-g, *columns]).T * self.scale[:, None]
        f = oracle.applied(q, v, t)
        right = (oracle.mass_matrix() @ a - f) * self.scale
        found, _, _, sizes = np.linalg.lstsq(A, right, rcond=1e-12)
        kept = sizes[sizes > 1e-12 * sizes[0]]
        self.conditions.append(float(sizes[0] / kept[-1]))
        lam, normal = found[: len(g)], found[len(g) :]
        self.efforts.append({d.name: -float(lam[oracle.rows[d.name]][0]) for d in machine.drivers})
        self.reactions.append(oracle.reactions(q, t, lam))
        press = {one.name: 0.0 for one in self.closed}
        for name, force in zip(owners, normal, strict=True):
            if name:
                press[name] += float(force)
        self.pressing.append(press)
        least = {one.name: math.inf for one in self.closed}
        for name, gap in zip(names, gaps, strict=True):
            least[name] = min(least[name], abs(float(gap)))
        self.gaps.append(least)
        self.loads.append(float(np.abs(np.append(right, self.scale * f)).max(initial=0.0)))

    def opinion(self, instants: Array) -> Opinion:
        """All of it beside ours."""
        run, comparison = self.run, Comparison()
        comparison.size("place", self.system.length)
        for one in self.closed:
            theirs = [gaps[one.name] for gaps in self.gaps]
            comparison.add("place", f"{one.name}: gap", np.zeros(len(instants)), theirs)
        for one in self.closed:
            ours = run.contact(one.name)[instants]
            theirs = [press[one.name] for press in self.pressing]
            comparison.add("force", f"{one.name}.contact", ours, theirs)
        for driver in self.system.mechanism.drivers:
            kind, theirs = driver.effort_dimension, [one[driver.name] for one in self.efforts]
            comparison.add(kind, f"{driver.name}.effort", run.effort(driver.name)[instants], theirs)
        for joint in self.system.mechanism.joints:
            own = run.reaction(joint.name)
            for n, key in enumerate(("fx", "fy", "torque")):
                theirs = [float(one[joint.name][n]) for one in self.reactions]
                kind = "torque" if n == 2 else "force"
                ours = getattr(own, key)[instants]
                if own.unique is not None and own.unique[n]:
                    comparison.add(kind, f"{joint.name}.{key}", ours, theirs)
        comparison.size("force", self.loads)
        comparison.size("torque", self.system.length * comparison.top("force"))
        limit = OPERATIONS * float(np.finfo(float).eps) * np.array(self.conditions)
        why = f"rounding times the condition of its equations, {max(self.conditions):.3g}"
        kinds = comparison.kinds
        rows = comparison.rows(dict.fromkeys(kinds, limit), dict.fromkeys(kinds, why))
        return Opinion("oracle", tuple(rows), (), ())
