"""The opinion of the oracle on a motion with contacts."""

from __future__ import annotations

import math

import numpy as np

from mbody.engines.comparison import Comparison
from mbody.engines.opinion import Opinion
from mbody.engines.oracle.contact_motion import RTOL, DenseContactMotion
from mbody.engines.oracle.friction import rubs
from mbody.engines.oracle.reference import Reference
from mbody.engines.oracle.touching import OracleTouching
from mbody.model.joint_contacts import contacts_of
from mbody.solution.solution import Solution
from mbody.system.system import System

__all__ = ["contact_opinion"]

Array = np.ndarray

#: Tolerance of a motion that has none of its own, and the least difference that is expected: of
#: where events are located, in parts of the motion.
OWN_RTOL, LEAST = 1e-8, 1e-9
#: Times by which the error of a motion of our tolerance may exceed that of the oracle's by it.
MARGIN = 20.0
#: Events that the oracle may leave out: what is decided at the first instant, and where infinitely
#: many impacts end.
UNTIMED = ("rest", "indeterminate", "inconsistent", "paradox")


def contact_opinion(system: System, run: Solution) -> Opinion:
    """Positions at all instants, and the instants of the events.

    Raises
    ------
    NotImplementedError
        For what the oracle has not: friction of joints, own states, drivers that are released.
    """
    machine = system.mechanism
    if any(contacts_of(joint) for joint in machine.joints):
        raise NotImplementedError("it has no limits of joints and none that separate")
    if any(rubs(joint) for joint in machine.joints):
        raise NotImplementedError("it has no friction of joints in motions over time")
    if machine.groups or machine.states or machine.inputs or machine.controllers:
        raise NotImplementedError("it follows contacts without groups, own states and controllers")
    if machine.simulation is not None and machine.simulation.release:
        raise NotImplementedError("it follows contacts without drivers that are released")
    own = machine.simulation.rtol if machine.simulation is not None else OWN_RTOL
    sharp, coarse = (_motion(system, run, rtol) for rtol in (RTOL, max(own, 10.0 * RTOL)))
    comparison = Comparison()
    comparison.size("place", system.length)
    comparison.size("angle", 1.0)
    (q, times), (rough, late) = sharp, coarse
    apart: dict[str, Array] = {}
    for n, body in enumerate(machine.bodies):
        for part, key in enumerate(("x", "y", "angle")):
            kind = "angle" if key == "angle" else "place"
            theirs = q[:, 3 * n + part]
            comparison.add(kind, f"{body.name}.{key}", getattr(run[body.name], key), theirs)
            off = np.abs(rough[:, 3 * n + part] - theirs)
            apart[kind] = np.maximum(apart.get(kind, 0.0), off)
    # an error that has come in once may grow and stays
    limits: dict[str, Array | float] = {
        kind: LEAST + MARGIN * np.maximum.accumulate(off) / comparison.top(kind)
        for kind, off in apart.items()
    }
    for event in run.events:
        if event.contact and event.name not in UNTIMED and event.t > run.t[0]:
            nearest = float(times[np.abs(times - event.t).argmin()]) if len(times) else math.nan
            comparison.add("instant", f"{event.contact}: {event.name}", event.t, nearest)
    span = float(run.t[-1] - run.t[0])
    comparison.size("instant", span)
    shift = max((float(np.abs(late - one).min()) for one in times), default=0.0) if len(late) else 0
    limits["instant"] = LEAST + MARGIN * shift / (comparison.top("instant") or 1.0)
    kinds = comparison.kinds
    why = f"error of a motion of the tolerance {own:g}, as the oracle has it with that"
    rows = comparison.rows({kind: limits[kind] for kind in kinds}, dict.fromkeys(kinds, why))
    note = f"all modes of the contacts were tried at {len(times) + 1} instants"
    return Opinion("oracle", tuple(rows), (), (note,))


def _motion(system: System, run: Solution, rtol: float) -> tuple[Array, Array]:
    """Coordinates at the instants of the result, and when modes change."""
    reference = Reference(system.mechanism)
    dense = DenseContactMotion(
        reference,
        OracleTouching(reference, system.mechanism.contacts),
        tuple(driver.name for driver in system.drivers),
        rtol,
    )
    bodies = system.mechanism.bodies
    q, v = (
        np.array([float(getattr(run[body.name], key)[0]) for body in bodies for key in keys])
        for keys in (("x", "y", "angle"), ("vx", "vy", "omega"))
    )
    found, _ = dense.motion(q, v, run.t)
    return found, np.array([event.t for event in dense.events if event.t > run.t[0]])
