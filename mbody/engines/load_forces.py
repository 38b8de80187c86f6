"""Loads as another engine's own kinematics make them: force laws written once more."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from mbody.engines.independent_reading import reading
from mbody.engines.spanning_tree import frame
from mbody.model.loads import (
    Damper,
    Force,
    Gravity,
    Load,
    Spring,
    Torque,
    TorsionDamper,
    TorsionSpring,
)
from mbody.system.system import System

__all__ = ["NATIVE", "gravity_of", "wrenches"]

Array = np.ndarray

#: Loads whose forces are made here, from laws and positions; gravity is the engine's own.
NATIVE = (Force, Torque, Spring, Damper, TorsionSpring, TorsionDamper)


def gravity_of(system: System, t: float) -> Array:
    """The acceleration of all gravity at a time (2,)."""
    found, at = np.zeros(2), reading(system)
    for load in system.mechanism.loads:
        if type(load) is Gravity:
            found += at.law(load, "x")(t), at.law(load, "y")(t)
    return found


def wrenches(system: System, load: Load, bodies: Any, t: float) -> dict[str, Array]:
    """Force and torque about the mass centres (3,) of one load of `NATIVE`, by body.

    `bodies` are poses by name, with ``place``, ``angle``, ``turns`` (the angle with whole turns),
    ``velocity``, ``arm``, ``moving`` and ``wrench``.
    """
    found: dict[str, Array] = {}

    def push(body: str, force: Any, torque: float, at: Any) -> None:
        found[body] = found.get(body, np.zeros(3)) + bodies[body].wrench(force, torque, at)

    if isinstance(load, Force):
        at = frame(system, load, "at")
        pose = bodies[load.at.body]
        angle = float(reading(system)[f"{load.name}.angle"])
        if load.follows:
            angle += pose.angle + at.angle
        size = float(reading(system).law(load, "value")(t))
        force = size * np.array([math.cos(angle), math.sin(angle)])
        push(load.at.body, force, 0.0, pose.place + pose.arm(at))
    elif isinstance(load, Spring | Damper):
        ends = [frame(system, load, side) for side in ("i", "j")]
        poses = [bodies[marker.body] for marker in (load.i, load.j)]
        places = [pose.place + pose.arm(at) for pose, at in zip(poses, ends, strict=True)]
        rates = [pose.moving(pose.arm(at))[0] for pose, at in zip(poses, ends, strict=True)]
        d = places[1] - places[0]
        length = math.hypot(*d)
        u = d / length if length else np.zeros(2)
        tension = _tension(system, load, length, float(u @ (rates[1] - rates[0])))
        push(load.i.body, tension * u, 0.0, places[0])
        push(load.j.body, -tension * u, 0.0, places[1])
    elif isinstance(load, Torque | TorsionSpring | TorsionDamper):
        a, b = bodies[load.by], bodies[load.body]
        torque = _torque(system, load, b.turns - a.turns, b.velocity[2] - a.velocity[2], t)
        push(load.body, np.zeros(2), torque, b.place)
        push(load.by, np.zeros(2), -torque, a.place)
    found.pop("ground", None)
    return found


def _tension(system: System, load: Any, length: float, rate: float) -> float:
    """What pulls two places together."""
    values, name = reading(system).values, load.name
    if isinstance(load, Damper):
        if load.law is None:
            return float(values[f"{name}.coefficient"]) * rate
        return float(reading(system).law(load)(rate))
    stretch = length - float(values[f"{name}.free_length"])
    if load.law is None:
        return float(values[f"{name}.preload"]) + float(values[f"{name}.stiffness"]) * stretch
    return float(reading(system).law(load)(stretch))


def _torque(system: System, load: Any, angle: float, rate: float, t: float) -> float:
    """What turns the body."""
    values, name = reading(system).values, load.name
    if isinstance(load, Torque):
        return float(reading(system).law(load, "value")(t))
    if isinstance(load, TorsionDamper):
        if load.law is None:
            return -float(values[f"{name}.coefficient"]) * rate
        return -float(reading(system).law(load)(rate))
    turned = angle - float(values[f"{name}.free_angle"])
    if load.law is None:
        return -float(values[f"{name}.preload"]) - float(values[f"{name}.stiffness"]) * turned
    return -float(reading(system).law(load)(turned))
