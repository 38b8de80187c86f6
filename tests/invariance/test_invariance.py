"""What must not matter does not: frames of the world, handedness, units."""

import dataclasses
import math

import numpy as np
import pytest
from hypothesis import given

from mbody import (
    AngleDriver,
    Body,
    Distance,
    Force,
    Gravity,
    Mechanism,
    Torque,
    kinetostatics,
    statics,
)
from mbody.model.body import Guess
from mbody.model.element import Marker, Polar
from mbody.model.loads import Damper, Spring, TorsionDamper, TorsionSpring
from tests.support.invariance import (
    LINKAGES,
    angles,
    answers,
    assert_same,
    changed,
    lightly,
    linkages,
    numbered,
    original,
    pair,
    rebuilt,
    rotation,
    shifted,
    sizes,
)


def moved(machine, turn, shift):
    """The whole machine turned about the world's origin, then shifted."""
    R = rotation(turn)

    def place(point):
        return tuple((R @ pair(point) + shift).tolist())

    def marker(m):
        if m.body != "ground":
            return m
        point = m.point if isinstance(m.point, str) else place(m.point)
        return Marker("ground", point, m.angle + turn)

    def fields(e):
        if isinstance(e, Body):
            x, y = place((e.guess.x, e.guess.y))
            return {"guess": Guess(angle=e.guess.angle + turn, x=x, y=y)}
        if isinstance(e, AngleDriver):
            return {"law": shifted(e.law, turn)} if e.relative_to == "ground" else {}
        if isinstance(e, TorsionSpring):
            sign = {"ground": -1.0}.get(e.body, 0.0) + {"ground": 1.0}.get(e.by, 0.0)
            return {"free_angle": e.free_angle + sign * turn}
        if isinstance(e, Force):
            return {} if e.follows else {"angle": e.angle + turn}
        if isinstance(e, Gravity):
            x, y = R @ [e.x.value, e.y.value]
            return {"x": float(x), "y": float(y)}
        return {}

    elements = [dataclasses.replace(changed(e, marker), **fields(e)) for e in machine]
    ground = {name: place(point) for name, point in machine.ground.points.items()}
    return rebuilt(machine, elements, ground=ground)


@given(linkages, angles, sizes, sizes)
@lightly
def test_rotated_and_translated(linkage, turn, dx, dy):
    machine, t, run, rest = original(linkage)
    R, shift = rotation(turn), np.array([dx, dy])
    other = moved(machine, turn, shift)
    for mine, its in ((kinetostatics(other, t), run), (statics(other, t), rest)):
        wanted = answers(its)
        for sort in ("place", "v", "a", "force"):
            wanted[sort] = {name: part @ R.T for name, part in wanted[sort].items()}
        wanted["place"] = {name: part + shift for name, part in wanted["place"].items()}
        wanted["turn"] = {name: part + turn for name, part in wanted["turn"].items()}
        assert_same(answers(mine), wanted)


# -- seen in a mirror -------------------------------------------------------------------------


def mirrored(machine):
    """y to −y: angles, torques and all that turns change their sign."""

    def point(p):
        return Polar(p.r, -p.angle) if isinstance(p, Polar) else (p[0], -p[1])

    def marker(m):
        return Marker(m.body, m.point if isinstance(m.point, str) else point(m.point), -m.angle)

    def negative(law):
        return numbered(law, lambda name, x: -x)

    def odd(law):
        """T(x) to −T(−x)."""
        return numbered(law, lambda name, x: x if int(name[1:]) % 2 else -x)

    def fields(e):
        if isinstance(e, Body):
            return {
                "cg": point(e.cg),
                "points": {name: point(p) for name, p in e.points.items()},
                "guess": Guess(angle=-e.guess.angle, x=e.guess.x, y=-e.guess.y),
            }
        if isinstance(e, AngleDriver):
            return {"law": negative(e.law)}
        if isinstance(e, Torque):
            return {"value": negative(e.value)}
        if isinstance(e, TorsionSpring) and e.law is None:
            return {"free_angle": -e.free_angle, "preload": -e.preload}
        if isinstance(e, TorsionSpring):
            return {"free_angle": -e.free_angle, "law": odd(e.law)}
        if isinstance(e, TorsionDamper) and e.law is not None:
            return {"law": odd(e.law)}
        if isinstance(e, Force):
            return {"angle": -e.angle}
        if isinstance(e, Gravity):
            return {"y": -e.y.value}
        return {}

    elements = [dataclasses.replace(changed(e, marker), **fields(e)) for e in machine]
    ground = {name: point(p) for name, p in machine.ground.points.items()}
    return rebuilt(machine, elements, ground=ground)


@pytest.mark.parametrize("linkage", LINKAGES)
def test_mirrored(linkage):
    machine, t, run, rest = original(linkage)
    other = mirrored(machine)
    for mine, its in ((kinetostatics(other, t), run), (statics(other, t), rest)):
        wanted = answers(its)
        for sort, parts in wanted.items():
            flip = np.array([1.0, -1.0]) if sort in ("place", "v", "a", "force") else -1.0
            wanted[sort] = {name: part * flip for name, part in parts.items()}
        assert_same(answers(mine), wanted)


# -- in other units ---------------------------------------------------------------------------


def in_units(machine, units, length, force, time):
    """Numbers multiplied into other units: so many of the new ones make one of the old."""
    mass = force * time**2 / length

    def point(p):
        if isinstance(p, Polar):
            return Polar(length * p.r, p.angle)
        return (length * p[0], length * p[1])

    def marker(m):
        return Marker(m.body, m.point if isinstance(m.point, str) else point(m.point), m.angle)

    def law(given, value, argument):
        """f(x) in units of `value`, x in units of `argument`."""
        power = {"value": 0, "speed": 1, "acceleration": 2, "mean": 0, "amplitude": 0}

        def scaled(name, x):
            if name == "frequency":
                return x / argument
            if name == "phase":
                return x
            order = power.get(name)
            return x * value / argument ** (int(name[1:]) if order is None else order)

        return numbered(given, scaled)

    torque, speed = force * length, length / time

    def fields(e):
        if isinstance(e, Body):
            return {
                "cg": point(e.cg),
                "points": {name: point(p) for name, p in e.points.items()},
                "guess": Guess(e.guess.angle, length * e.guess.x, length * e.guess.y),
                "mass": None if e.mass is None else mass * e.mass,
                "weight": None if e.weight is None else force * e.weight,
                "inertia": mass * length**2 * e.inertia,
            }
        if isinstance(e, Distance):
            return {"length": length * e.length.value}
        if isinstance(e, AngleDriver):
            return {"law": law(e.law, 1.0, time)}
        if isinstance(e, Force):
            return {"value": law(e.value, force, time)}
        if isinstance(e, Torque):
            return {"value": law(e.value, torque, time)}
        if isinstance(e, Gravity):
            factor = length / time**2
            return {"x": factor * e.x.value, "y": factor * e.y.value}
        if isinstance(e, Spring):
            common = {"free_length": length * e.free_length, "preload": force * e.preload}
            if e.law is not None:
                return common | {"law": law(e.law, force, length)}
            return common | {"stiffness": force / length * e.stiffness}
        if isinstance(e, Damper):
            if e.law is not None:
                return {"law": law(e.law, force, speed)}
            return {"coefficient": force / speed * e.coefficient}
        if isinstance(e, TorsionSpring):
            if e.law is not None:
                return {"law": law(e.law, torque, 1.0)}
            return {"stiffness": torque * e.stiffness, "preload": torque * e.preload}
        if isinstance(e, TorsionDamper):
            if e.law is not None:
                return {"law": law(e.law, torque, 1.0 / time)}
            return {"coefficient": torque * time * e.coefficient}
        return {}

    elements = [dataclasses.replace(changed(e, marker), **fields(e)) for e in machine]
    ground = {name: point(p) for name, p in machine.ground.points.items()}
    return rebuilt(machine, elements, ground=ground, units=units, g=length / time**2 * machine.g)


UNITS = {
    "mm-N-s": (1e3, 1.0, 1.0),
    "in-lbf-s": (1.0 / 0.0254, 1.0 / 4.4482216152605, 1.0),
    "ft-lbf-s": (1.0 / 0.3048, 1.0 / 4.4482216152605, 1.0),
    "SI": (1e-4, 3e5, 60.0),  # no system that has a name: the equations do not care
}


@pytest.mark.parametrize("units", UNITS)
@pytest.mark.parametrize("linkage", LINKAGES[::2])
def test_in_other_units(linkage, units):
    length, force, time = UNITS[units]
    machine, t, run, rest = original(linkage)
    other = in_units(machine, units, length, force, time)
    scale = {"place": length, "turn": 1.0, "v": length / time, "w": 1.0 / time, "force": force}
    scale |= {"a": length / time**2, "alpha": 1.0 / time**2, "torque": force * length}
    for mine, its in ((kinetostatics(other, time * t), run), (statics(other, time * t), rest)):
        wanted = {
            sort: {name: scale[sort] * part for name, part in parts.items()}
            for sort, parts in answers(its).items()
        }
        assert_same(answers(mine), wanted)
        assert mine.checks.constraint < 1e-13 and mine.checks.equilibrium < 1e-11


def test_the_names_of_units_are_those_of_their_numbers():
    """Standard gravity in every system is the same acceleration."""
    for units, (length, _, time) in UNITS.items():
        if units != "SI":
            assert math.isclose(Mechanism(units=units).g, 9.80665 * length / time**2)
