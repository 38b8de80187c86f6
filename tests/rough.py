"""Mechanisms with friction in their joints, and the same instants by dense equations."""

from dataclasses import replace

import numpy as np

import mbody
from mbody import Body, CoordinateDriver, Force, Mechanism, PinSlot, Prismatic, Revolute
from mbody.engines.oracle.friction import DenseFriction
from mbody.engines.oracle.reference import Reference
from mbody.laws import ConstantSpeed

CRANK, ROD, FORCE = 0.05, 0.2, 1000.0


def roughened(machine, change, name=None):
    """The same mechanism with other joints: `change` gives fields by joint, {} for no change."""
    copy = Mechanism(
        name or machine.name, units=machine.units, g=machine.g, ground=machine.ground.points
    )
    copy.add(*(replace(element, **change(element)) for element in machine))
    return copy


def rough(machine, mu=0.1, radius=0.01, length=None, **more):
    """Friction in all pins and slides."""

    def change(element):
        if isinstance(element, Revolute):
            return {"friction": mu, "pin_radius": radius, **more}
        if isinstance(element, Prismatic):
            return {"friction": mu, "length": length, **more}
        return {"friction": mu, **more} if isinstance(element, PinSlot) else {}

    return roughened(machine, change)


def slider_crank(mu=0.1, radius=0.01, *, masses=(0.0, 0.0, 0.0), speed=10.0, length=None, **more):
    """That of the references: a force of 1000 N on the slider in −x, friction in all joints."""
    machine = mbody.makers.slider_crank(CRANK, ROD, masses=masses, start=0.1, speed=speed)
    machine.add(Force("load", "slider.B", FORCE, angle=np.pi))
    return rough(machine, mu, radius, length, **more)


def drawer(mu, length=0.2, height=None, speed=1.0, a=0.2, force=10.0):
    """Pulled at a distance a from its middle."""
    machine = Mechanism("drawer", units="SI", ground={"O": (0.0, 0.0)})
    machine.add(
        Body("drawer", mass=1.0, points={"C": (0.0, 0.0), "P": (0.0, a)}),
        Prismatic("guide", "ground.O", "drawer.C", friction=mu, length=length, height=height),
        CoordinateDriver("pull", "ground.O", "drawer.P", ConstantSpeed(0.0, speed)),
        Force("load", "drawer.C", force, angle=np.pi),
    )
    return machine


def motion_at(run, k):
    """q, v, a (3n,) of an instant."""
    bodies = list(run)
    keys = (("x", "y", "angle"), ("vx", "vy", "omega"), ("ax", "ay", "alpha"))
    return [np.array([getattr(run[b], f)[k] for b in bodies for f in fields]) for fields in keys]


def dense_at(run, k, **how):
    """The dense equations of an instant of a result."""
    return DenseFriction(Reference(run.mechanism), *motion_at(run, k), float(run.t[k]), **how)


def difference(run, k, **how):
    """Greatest difference of efforts and reactions from the dense solution at an instant, by the
    greatest force, torques by the model length.
    """
    dense = dense_at(run, k, **how)
    found = dense.solve()
    assert found is not None
    reference = dense.reference
    reactions = reference.reactions(motion_at(run, k)[0], float(run.t[k]), found.lam)
    size, worst = run.system.length, [0.0]
    scale = 1e-300
    for joint in run.mechanism.joints:
        theirs = reactions[joint.name] + found.wrench.get(joint.name, np.zeros(3))
        ours = run.reaction(joint.name)
        own = np.array([ours.fx[k], ours.fy[k], ours.torque[k] / size])
        theirs = theirs / [1.0, 1.0, size]
        scale = max(scale, np.abs(theirs).max())
        worst.append(np.abs(own - theirs).max())
    for driver in run.mechanism.drivers:
        unit = size if driver.angular else 1.0
        theirs = -found.lam[reference.rows[driver.name]][0]
        worst.append(abs(run.effort(driver.name)[k] - theirs) / unit)
        scale = max(scale, abs(theirs) / unit)
    return max(worst) / scale
