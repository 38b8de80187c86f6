"""Mechanisms with friction in their joints, and the same instants by dense equations."""

from dataclasses import replace

import numpy as np

import mbody
from mbody.engines.oracle.friction import DenseFriction
from mbody.engines.oracle.mechanics import Reference
from mbody.laws import ConstantSpeed, Harmonic

CRANK, ROD, FORCE = 0.05, 0.2, 1000.0
#: Forces that many times as great as without friction grow without bound.
GROWN = 100.0
#: Iterations of Newton's method from the solution of a step before: where it needs more, that step
#: is too long.
NEAR = 15


def with_changes(machine, change, name=None):
    """The same mechanism with other joints: `change` gives fields by joint, {} for no change."""
    copy = mbody.Mechanism(
        name or machine.name, units=machine.units, g=machine.g, ground=machine.ground.points
    )
    copy.add(*(replace(element, **change(element)) for element in machine))
    return copy


def with_friction(machine, mu=0.1, radius=0.01, length=None, **more):
    """Friction in all pins and slides."""

    def change(element):
        if isinstance(element, mbody.Revolute):
            return {"friction": mu, "pin_radius": radius, **more}
        if isinstance(element, mbody.Prismatic):
            return {"friction": mu, "length": length, **more}
        return {"friction": mu, **more} if isinstance(element, mbody.PinSlot) else {}

    return with_changes(machine, change)


def slider_crank(mu=0.1, radius=0.01, *, masses=(0.0, 0.0, 0.0), speed=10.0, length=None, **more):
    """That of the references: a force of 1000 N on the slider in −x, friction in all joints."""
    machine = mbody.makers.slider_crank(CRANK, ROD, masses=masses, start=0.1, speed=speed)
    machine.add(mbody.Force("load", "slider.B", FORCE, angle=np.pi))
    return with_friction(machine, mu, radius, length, **more)


def drawer(mu, length=0.2, height=None, speed=1.0, a=0.2, force=10.0):
    """Pulled at a distance a from its middle."""
    machine = mbody.Mechanism("drawer", units="SI", ground={"O": (0.0, 0.0)})
    machine.add(
        mbody.Body("drawer", mass=1.0, points={"C": (0.0, 0.0), "P": (0.0, a)}),
        mbody.Prismatic("guide", "ground.O", "drawer.C", friction=mu, length=length, height=height),
        mbody.CoordinateDriver("pull", "ground.O", "drawer.P", ConstantSpeed(0.0, speed)),
        mbody.Force("load", "drawer.C", force, angle=np.pi),
    )
    return machine


def gear_pair(internal=False, load=5.0, speed=3.0, carrier=0.0, **teeth):
    """Two wheels on a carrier that turns, too; the driven one has its weight off its centre."""
    apart = 2.0 if internal else 4.0
    machine = mbody.Mechanism("gears", units="SI", ground={"O": (0.0, 0.0)})
    machine.add(
        mbody.Body("carrier", mass=2.0, inertia=0.1, points={"O": (0.0, 0.0), "C": (apart, 0.0)}),
        mbody.Body("a", mass=1.0, inertia=0.3),
        mbody.Body("b", mass=1.5, inertia=0.2, points={"P": (0.5, 0.2)}),
        mbody.Revolute("O", "ground.O", "carrier.O"),
        mbody.Revolute("A", "carrier.O", "a"),
        mbody.Revolute("B", "carrier.C", "b", friction=0.1, pin_radius=0.1),
        mbody.Gear("mesh", "a", "b", radius_i=3.0, radius_j=1.0, internal=internal, **teeth),
        mbody.AngleDriver("motor", "a", ConstantSpeed(0.0, speed)),
        mbody.AngleDriver("hold", "carrier", ConstantSpeed(0.0, carrier)),
        mbody.Torque("load", "b", value=load),
        mbody.Force("push", "b.P", 3.0, angle=0.4),
    )
    return machine


def rack_and_pinion(load=5.0, speed=2.0, **teeth):
    """A pinion that drives a rack on a guide of two points."""
    machine = mbody.Mechanism("rack", units="SI", ground={"O": (0.0, 0.0), "C": (0.0, 0.8)})
    machine.add(
        mbody.Body("rack", mass=2.0, inertia=0.1),
        mbody.Body(
            "pinion", mass=1.5, inertia=0.2, points={"P": (0.5, 0.2)}, guess=(0.0, 0.8, 0.0)
        ),
        mbody.Prismatic("guide", "ground.O", "rack", friction=0.05, length=0.5),
        mbody.Revolute("B", "ground.C", "pinion", friction=0.1, pin_radius=0.1),
        mbody.RackPinion("mesh", "rack", "pinion", radius=0.8, **teeth),
        mbody.AngleDriver("motor", "pinion", ConstantSpeed(0.0, speed)),
        mbody.Force("load", "rack", load),
        mbody.Force("push", "pinion.P", 3.0, angle=0.4),
    )
    return machine


def cam_drive(kind, swinging=False, clockwise=False, **coefficients):
    """A knife edge, a roller or a flat face on a cam, on a guide or on an arm."""
    follower = {"roller": {"roller": 0.01}, "flat": {"flat": True}}.get(kind, {})
    places = {"O": (0.0, 0.0), "G": (0.005, 0.0), "P": (0.1, 0.02)}
    machine = mbody.Mechanism("cam", units="SI", ground=places)
    machine.add(mbody.Body("shaft", mass=1.0, inertia=0.01))
    if swinging:
        arm = {"O": (0.0, 0.0), "R": (-0.1, 0.03)}
        machine.add(
            mbody.Body("tappet", mass=0.5, inertia=0.001, points=arm, guess="5 deg"),
            mbody.Revolute("A", "ground.P", "tappet.O", friction=0.1, pin_radius=0.005),
        )
    else:
        up = np.pi / 2.0
        machine.add(
            mbody.Body("tappet", mass=0.5, points={"R": (0.0, 0.0)}, guess=(0.005, 0.06, 0.0)),
            mbody.Prismatic(
                "A",
                mbody.Marker("ground", "G", up),
                mbody.Marker("tappet", "R", up),
                friction=0.1,
                length=0.05,
                height=0.01,
            ),
        )
    tilt = np.radians(10.0) if swinging and kind == "flat" else 0.0
    lift = Harmonic(mean=0.01, amplitude=0.01, frequency=1.0, phase=0.3)
    machine.add(
        mbody.Revolute("O", "ground.O", "shaft", friction=0.1, pin_radius=0.01),
        mbody.CamFollower(
            "cam",
            "shaft",
            mbody.Marker("tappet", "R", tilt),
            lift,
            base_radius=0.04,
            clockwise=clockwise,
            **follower,
            **coefficients,
        ),
        mbody.AngleDriver("motor", "shaft", ConstantSpeed(0.0, -20.0 if clockwise else 20.0)),
        mbody.Force("load", "tappet.R", 500.0, angle=0.2 - np.pi / 2.0),
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


def followed_part(run, k, most=1.0, step=0.05, least=1e-11):
    """The part of friction up to which the dense solution can be followed from none, in steps, at
    an instant: Newton's method from the last solution, det of its matrix keeping its sign. Where
    forces grow without bound, 1/(p − part), p is found from the last two of them.
    """
    dense, part, sign = dense_at(run, k), 0.0, None
    z, passed = dense.start(), []
    while part < most and step > least:
        dense.part = min(most, part + step)
        found = dense.solve(z, NEAR)
        here = None
        if found is not None:
            new = np.concatenate([found.lam, found.own])
            here = np.linalg.slogdet(dense.jacobian(new)[1])[0]
            sign = here if sign is None else sign
        near = found is not None and np.abs(new - z).max() <= 0.5 * np.abs(new).max()
        if found is None or here != sign or not (near or part == 0.0):
            step *= 0.5
            continue
        part, z = min(most, part + step), new
        passed.append((part, float(np.abs(new).max())))
        step = min(2.0 * step, 0.05)
    if part < most and len(passed) > 1 and passed[-1][1] > GROWN * passed[0][1]:
        (before, small), (last, large) = passed[-2:]
        return (last * large - before * small) / (large - small)
    return part
