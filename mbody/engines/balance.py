"""The balance of a result by plain arithmetic: Newton and Euler of every body, virtual power, laws.

Motion, reactions and efforts are taken from the result. Loads are computed again from their laws
where possible. Σ F = m a, Σ M = I α of every free body;  Σ (f − M a)·v + Σ effort·rate = 0.
"""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np

from mbody.analysis.driven.forces_on_several import acting_on_several, coupled
from mbody.analysis.driven.free_body import driven
from mbody.engines.comparison import Comparison
from mbody.engines.formula_loads import follows_formula
from mbody.engines.gear_contacts import MESHING, constraint_rates
from mbody.engines.independent_reading import laws_of, reading
from mbody.engines.load_forces import BodyState, gravity_of, has_force_law, wrenches
from mbody.engines.opinion import Opinion
from mbody.engines.pressing_stops import without_pressing_stops
from mbody.model.driver import AngleDriver
from mbody.model.element import listed
from mbody.model.loads import Gravity
from mbody.solution.checks import each_load_of
from mbody.solution.contact_forces import acting_contacts
from mbody.solution.solution import Solution
from mbody.system.system import System

__all__ = ["opinion"]

Array = np.ndarray

#: A part of the speed that forces would give that is none, as in the residuals of results.
STILL = 1e-12
#: Residual of Newton's method at its end: over the gallery at most 5e-13 of the greatest force.
EXPECTED = 5e-12


def opinion(system: System, run: Solution) -> Opinion:
    """The balance of forces and of power for a result."""
    run, notes = without_pressing_stops(run)
    loads, taken = _loads(system, run)
    n, count = len(system.mechanism.bodies), len(run)
    mass = reading(system).masses
    motion = np.zeros((3, count, n, 3))
    for b, name in enumerate(run):
        keys = (("x", "y", "angle"), ("vx", "vy", "omega"), ("ax", "ay", "alpha"))
        for order, row in enumerate(keys):
            for part, key in enumerate(row):
                motion[order, :, b, part] = getattr(run[name], key)
    inertia = mass * motion[2] * (run.analysis != "statics")
    joints, size = _joints(system, run, motion[0])
    left = loads + joints - inertia
    comparison = Comparison()
    length = system.length
    parts = [size, np.abs(loads).max(axis=(1, 2), initial=0.0)]
    comparison.size("force", np.array([*parts[0], *np.abs(loads[..., :2]).ravel()]))
    comparison.size("force", inertia[..., :2])
    comparison.size("torque", np.abs(np.concatenate([loads[..., 2], inertia[..., 2]])))
    comparison.size("torque", length * comparison.top("force"))
    for b, body in enumerate(system.mechanism.bodies):
        for part, key in enumerate(("fx", "fy", "torque")):
            kind = "torque" if part == 2 else "force"
            comparison.add(kind, f"{body.name}: sum of {key}", np.zeros(count), left[:, b, part])
    if run.stepped is not None:
        notes.append("power is not compared: forces are means of steps, rates are of their ends")
    elif run.analysis != "statics":
        _power(system, run, (loads, inertia), motion[1], comparison)
    _laws(system, run, comparison)
    _meshing(system, run, comparison)
    why = "residual of Newton's method, and rounding of sums"
    expected: dict[str, Array | float] = dict.fromkeys(comparison.kinds, EXPECTED)
    reasons = dict.fromkeys(comparison.kinds, why)
    if run.stepped is not None:
        arms = comparison.top("force") / comparison.top("torque") * _passed_in_a_step(run)
        expected["torque"] = EXPECTED + arms
        reasons["torque"] = "contacts of a step act in its middle, bodies are at its end"
    rows = comparison.rows(expected, reasons)
    if taken:
        notes.append(f"taken from our result as forces: {listed(taken)}")
    return Opinion("balance", tuple(rows), (), tuple(notes))


def _loads(system: System, run: Solution) -> tuple[Array, list[str]]:
    """All loads on the bodies (instants, bodies, 3), and names of those taken from our result."""
    loads, names = system.mechanism.loads, [body.name for body in system.mechanism.bodies]
    mass = reading(system).masses[:, 0]
    found = np.zeros((len(run), len(names), 3))
    taken = [
        one.name
        for one in loads
        if not has_force_law(one) and (type(one) is not Gravity or follows_formula(one))
    ]
    for k in range(len(run)):
        t = float(run.t[k])
        found[k, :, :2] = mass[:, None] * gravity_of(system, t)
        poses: dict[str, Any] = {"ground": BodyState(np.zeros(2), 0.0, np.zeros(3))}
        for name in names:
            one = run[name]
            place = np.array([one.x[k], one.y[k]])
            rates = np.array([one.vx[k], one.vy[k], one.omega[k]])
            poses[name] = BodyState(place, float(one.angle[k]), rates)
        for load in loads:
            if has_force_law(load):
                for body, wrench in wrenches(system, load, poses, t).items():
                    found[k, names.index(body)] += wrench
        if taken:
            whole = each_load_of(run, k)
            for n, load in enumerate(loads):
                if load.name in taken:
                    found[k] += whole[n]
    return found, taken


def _passed_in_a_step(run: Solution) -> Array:
    """How far bodies are, at most, from where they were when contacts of a step with impulses acted
    on them (instants,): half a step of two bodies, and the overlap of their shapes.
    """
    stepped = run.stepped
    if stepped is None or run.restart is None:
        return np.zeros(len(run))
    speed = np.max([np.hypot(run[name].vx, run[name].vy) for name in run], axis=0)
    overlap = [
        float(np.max(-stepped.numbers[low:high, 6], initial=0.0))
        for low, high in itertools.pairwise(stepped.first)
    ]
    passed: Array = run.restart.way.step * speed + np.array(overlap)
    return passed


def _joints(system: System, run: Solution, pose: Array) -> tuple[Array, Array]:
    """Forces of joints, couplings and drivers on the bodies (instants, bodies, 3), and the greatest
    of them at every instant.
    """
    index = system.bodies
    found, size = np.zeros(pose.shape), np.zeros(len(run))

    def act(element: Any, force: Array, torque: Array, place: Any) -> None:
        for body, sense in ((element.bodies[1], 1.0), (element.bodies[0], -1.0)):
            if body == "ground":
                continue
            b = index[body]
            dx, dy = place[0] - pose[:, b, 0], place[1] - pose[:, b, 1]
            found[:, b, 0] += sense * force[0]
            found[:, b, 1] += sense * force[1]
            found[:, b, 2] += sense * (torque + dx * force[1] - dy * force[0])
        size[:] = np.maximum(size, np.hypot(*force))

    # of a motion over time contacts are in the place of joints that can separate
    moving = run.analysis == "simulate"
    for joint in system.mechanism.joints:
        if moving and joint.can_separate:
            continue
        one = run.reaction(joint.name)
        place = run.reaction_point(joint.name)
        act(joint, np.array([one.fx, one.fy]), one.torque, place)
    for driver in system.leaders:
        fx, fy, torque = driven(run, driver.name).T
        ahead = "j" in driver.places()
        place = (
            run.reaction_point(driver.name) if ahead else (np.zeros(len(run)), np.zeros(len(run)))
        )
        act(driver, np.array([fx, fy]), torque, place)
    for contact in acting_contacts(run):
        one, body = run.reaction(contact.name), contact.bodies[1]
        # its torque is about the mass centre of j
        centre = (0.0, 0.0) if body == "ground" else (run[body].x, run[body].y)
        act(contact, np.array([one.fx, one.fy]), one.torque, centre)
    for element, _ in acting_on_several(run):
        for k in range(len(run)):
            found[k] += coupled(run, element.name, k)[: pose.shape[1]]
    return found, size


def _laws(system: System, run: Solution, comparison: Comparison) -> None:
    """Compare angle, rate and acceleration of driven bodies with the laws."""
    parts = (("angle", 1.0), ("omega", 0.0), ("alpha", 0.0))
    for driver in system.drivers:
        by_law = laws_of(system, run, driver)
        if by_law is None or not isinstance(driver, AngleDriver):
            continue
        body, base = run[driver.body], run[driver.relative_to]
        for n, (key, least) in enumerate(parts[: 1 if run.analysis == "statics" else 3]):
            kind = f"driven {key}"
            comparison.size(kind, np.append(by_law[n], least))
            if comparison.sizes[kind] > 0.0:
                ours = getattr(body, key) - getattr(base, key)
                comparison.add(kind, f"{driver.name}: {key} by its law", ours, by_law[n])


def _meshing(system: System, run: Solution, comparison: Comparison) -> None:
    """Rate and acceleration of the constraints of gears, racks, wheels, cams, couplings: both
    are 0.
    """
    if run.analysis == "statics":
        return
    machine = system.mechanism
    moving = run.analysis == "simulate"  # in which joints that can separate do
    joints = [
        joint
        for joint in machine.joints
        if isinstance(joint, MESHING) and not (moving and joint.can_separate)
    ]
    for element in (*joints, *machine.couplings):
        for n, (first, second, *sizes) in enumerate(constraint_rates(system, run, element)):
            for key, part, size in (("rate", first, sizes[0]), ("acceleration", second, sizes[1])):
                kind = f"{element.name} {key}"
                comparison.size(kind, size)
                if comparison.sizes[kind] > 0.0:
                    name = f"{element.name}: {key} of row {n}"
                    comparison.add(kind, name, np.zeros(len(run)), part)


def _power(
    system: System,
    run: Solution,
    forces: tuple[Array, Array],
    rates: Array,
    comparison: Comparison,
) -> None:
    """Power of loads, inertia and drivers: their sum is 0, since ideal joints do no work."""
    loads, inertia = forces
    terms = (loads - inertia) * rates
    given = [run.measure(f"{d.name}.power") for d in system.drivers]
    whole = terms.sum(axis=(1, 2)) + sum(given, np.zeros(len(run)))
    for one in forces:  # where a body is free, one is the other to rounding
        comparison.size("power", one * rates)
    for part in given:
        comparison.size("power", part)
    for loss in run.losses.values():
        whole -= loss
        comparison.size("power", loss)
    if not comparison.sizes["power"] > 0.0:
        return
    # what is slower than this part of the speed that its forces would give it is at rest
    units = np.array([1.0, 1.0, system.length])
    top = float(np.abs(loads / units).max(initial=0.0))
    whole_mass = float(system.mass[: system.coordinates : 3].sum())
    if whole_mass > 0.0:
        comparison.size("power", STILL * top * np.sqrt(top * system.length / whole_mass))
    comparison.add("power", "power", np.zeros(len(run)), whole)
