"""The shaking force and moment of a mechanism on its frame."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mbody.analysis.driven.forces_on_several import acting_on_several, coupled
from mbody.analysis.driven.free_body import driven
from mbody.errors import ModelError
from mbody.model.driver import Driver
from mbody.model.element import Marker, as_marker
from mbody.solution.checks import loaded, one_design
from mbody.solution.contact_forces import acting_contacts
from mbody.solution.doubts import Inherited, inherited
from mbody.solution.places import reaction_torque
from mbody.solution.solution import Solution, as_solution
from mbody.system.read_only import lock

__all__ = ["ShakingForce", "shaking_force"]

Array = np.ndarray


@dataclass(frozen=True, eq=False)
class ShakingForce(Inherited):
    """Resultant on the frame, world axes: arrays (instants,).

    Attributes
    ----------
    fx, fy, moment : arrays (instants,)
        Sum of the forces of joints, couplings, drivers and loads on the frame; the moment is about
        the given place.
    fx_inertia, fy_inertia, moment_inertia : arrays (instants,)
        The same by d'Alembert, from the motion: inertia forces and loads of all bodies.

    Examples
    --------
    >>> import mbody
    >>> rotor = mbody.Mechanism("rotor", ground={"O": (0.0, 0.0)})
    >>> rotor.add(mbody.Body("wheel", mass=2.0, cg=(0.1, 0.0)))
    >>> rotor.add(mbody.Revolute("O", "ground.O", "wheel"))
    >>> rotor.add(mbody.AngleDriver("motor", "wheel", "10 rad/s*t"))
    >>> found = mbody.engineering.shaking_force(mbody.kinetostatics(rotor), "ground.O")
    >>> round(float(found.fx[0]), 9)  # m e ω²
    20.0
    """

    fx: Array
    fy: Array
    moment: Array
    fx_inertia: Array
    fy_inertia: Array
    moment_inertia: Array

    def __post_init__(self) -> None:
        lock(self)

    @property
    def magnitude(self) -> Array:
        """√(fx² + fy²)."""
        return np.hypot(self.fx, self.fy)

    @property
    def direction(self) -> Array:
        """Angle of the force from the world's x axis, 0 … 2π [rad]."""
        return np.mod(np.arctan2(self.fy, self.fx), 2.0 * np.pi)


def shaking_force(run: Solution, about: Marker | str = "ground") -> ShakingForce:
    """Force and moment of a mechanism on its frame: shaking force, shaking moment.

    F = Σ reactions on the ground = Σ (−m a_G) + Σ loads from outside;  M about a place likewise.

    Parameters
    ----------
    run : Solution
        Of one design, with forces.
    about : Marker or str
        Place on the ground about which the moment is taken, such as ``"ground.O2"``; by default the
        origin.

    Returns
    -------
    ShakingForce
        By the reactions, and by the motion: two independent ways, apart from the loads.

    Raises
    ------
    ModelError
        For a run without forces, a batch, or a place on a moving body.

    Notes
    -----
    Loads between a body and the ground, as the pressure on a piston and its cylinder, cancel in the
    frame. Weights and forces from outside are part of it where there are any: for the force of
    inertia alone, analyse the mechanism without them.

    Source: R. L. Norton, *Design of Machinery*, section 11.8: F_s = F21 + F41, M_s = T21 + R × F41.

    Examples
    --------
    >>> import mbody
    >>> run = mbody.kinetostatics(mbody.makers.four_bar(1, 3, 2, 3.5, masses=(1, 3, 2), speed=9.0))
    >>> found = shaking_force(run, "ground.O2")
    >>> bool(abs(found.fx - found.fx_inertia)[0] < 1e-12 * found.magnitude[0])
    True
    """
    run = as_solution(run)
    if not run.has_forces:
        raise ModelError(f"{run.analysis} computes no forces: use kinetostatics")
    one_design(run, "the shaking force is of one design")
    marker = as_marker(about, "shaking force", "about")
    if marker.body != "ground":
        raise ModelError(
            f"the shaking moment is taken about a place on the ground, not on '{marker.body}': "
            'name one such as "ground.O2"'
        )
    place = run.point(marker)
    forces = np.array([loaded(run, k).force[:, 0].reshape(-1, 3) for k in range(len(run))])
    joints = _by_joints(run, place.x, place.y) + _about(forces[:, -1], -place.x, -place.y)
    motion = _about(forces[:, -1], -place.x, -place.y)
    for n, body in enumerate(run.mechanism.bodies):
        there, inertia = run[body.name], np.column_stack(run.inertia(body.name))
        motion = motion + _about(forces[:, n] + inertia, there.x - place.x, there.y - place.y)
    return ShakingForce(*joints.T, *motion.T, **inherited(run))


def _about(force: Array, x: Array, y: Array) -> Array:
    """(Fx, Fy, T) (instants, 3) of a force at (x, y) from the reference place of the moment."""
    moment = force[:, 2] + x * force[:, 1] - y * force[:, 0]
    return np.column_stack([force[:, :2], moment])


def _by_joints(run: Solution, x: Array, y: Array) -> Array:
    """Forces of joints, couplings and drivers on the ground, (instants, 3), about (x, y)."""
    total = np.zeros((len(run), 3))
    for joint in run.mechanism.joints:
        ends = joint.i.body, joint.j.body
        if "ground" not in ends:
            continue
        force, place = run.reaction(joint.name, on="ground"), run.point(joint.j)
        torque = reaction_torque(run, joint, -force.fx, -force.fy, force.torque)
        at_place = np.column_stack([force.fx, force.fy, torque])
        total += _about(at_place, place.x - x, place.y - y)
    for contact in acting_contacts(run):
        if "ground" in contact.bodies:
            force = run.reaction(contact.name, on="ground")
            total += _about(np.column_stack([force.fx, force.fy, force.torque]), -x, -y)
    for element, bodies in acting_on_several(run):
        # internal forces have the sum zero: the ground has the opposite of the moving bodies
        if "ground" not in bodies:
            continue
        rows = np.array([coupled(run, element.name, k) for k in range(len(run))])
        for body in bodies:
            if body != "ground":
                part = rows[:, run.system.bodies[body]]
                total -= _about(part, run[body].x - x, run[body].y - y)
    for driver in run.system.leaders:
        if "ground" in driver.bodies:
            total += _by_driver(run, driver, x, y)
    return total


def _by_driver(run: Solution, driver: Driver, x: Array, y: Array) -> Array:
    """The same of one driver."""
    force = driven(run, driver.name) * (1.0 if driver.bodies[1] == "ground" else -1.0)
    if "j" not in driver.places():
        return force
    px, py = run.reaction_point(driver.name)
    return _about(force, px - x, py - y)
