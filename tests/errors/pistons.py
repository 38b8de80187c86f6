"""Pressures on pistons."""

import math

from mbody.laws import Cam, Rise, Table
from mbody.model.loads import PistonPressure, ReciprocatingCylinder

TURN = 2.0 * math.pi

#: Laws that do not say the pressure for a cycle.
CYCLES = {
    "a pressure table that ends too early": Table([0.0, 2.0, 5.25], [9.0, 4.0, 1.0]),
    "a pressure table within the cycle": Table([0.25, 2.0, 6.0], [9.0, 4.0, 1.0]),
    "a pressure table of two turns": Table([0.0, 5.0, 2.0 * TURN], [9.0, 4.0, 1.0]),
    "a pressure table that repeats too early": Table([0.0, 2.0, 5.0], [9, 4, 9], periodic=True),
    "a pressure program that repeats too late": Cam(
        [Rise("3-4-5", 1.0, 0.0, 1.0), Rise("3-4-5", -1.0, 0.0, 1.0)], period=7.0
    ),
}

CYLINDER = {"area": 0.02, "near": 0.3, "far": 0.6, "clearance": 0.1, "delivery": 2e7}

#: What a cylinder with valves cannot be.
CYLINDERS = {
    "a cylinder of no liquid": {},
    "a cylinder of a liquid and a gas": {"bulk_modulus": 2e9, "exponent": 1.3},
    "a cylinder without a stroke": {"bulk_modulus": 2e9, "far": 0.3},
    "a cylinder that delivers downwards": {"bulk_modulus": 2e9, "suction": 3e7},
    "a liquid that is too soft": {"bulk_modulus": 1e6},
    "a gas without an atmosphere": {"exponent": 1.3},
    "a cylinder without an area": {"bulk_modulus": 2e9, "area": 0.0},
    "a cylinder without a clearance": {"bulk_modulus": 2e9, "clearance": 0.0},
}


def pressure(law):
    return PistonPressure("gas", "ground.head", "piston", "crank", 0.02, head=law)


def cylinder(changes):
    return ReciprocatingCylinder("cylinder", "ground.head", "piston", **{**CYLINDER, **changes})


SCENARIOS = {
    **{name: lambda law=law: pressure(law) for name, law in CYCLES.items()},
    "a pressure without a cycle": lambda: PistonPressure("gas", "ground", "piston"),
    "a pressure on nothing": lambda: PistonPressure("gas", "ground", "piston", "crank", head=5e5),
    "a piston in itself": lambda: PistonPressure("gas", "piston", "piston.P", "crank"),
    **{name: lambda more=more: cylinder(more) for name, more in CYLINDERS.items()},
}
