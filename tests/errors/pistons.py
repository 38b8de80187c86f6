"""Pressures on pistons."""

import math

from mbody.laws import Cam, Rise, Table
from mbody.model.loads import PistonPressure, ReciprocatingCylinder

TURN = 2.0 * math.pi

#: Laws that do not say the pressure for a cycle.
CYCLES = {
    "a pressure table that ends too early": Table([0.0, 2.0, 5.25], [9.0, 4.0, 1.0]),
    "a pressure table of two turns": Table([0.0, 5.0, 2.0 * TURN], [9.0, 4.0, 1.0]),
    "a pressure table that repeats too early": Table([0.0, 2.0, 5.0], [9, 4, 9], periodic=True),
    "a pressure program that repeats too late": Cam(
        [Rise("3-4-5", 1.0, 0.0, 1.0), Rise("3-4-5", -1.0, 0.0, 1.0)], period=7.0
    ),
}

CYLINDER = {"area": 0.02, "near": 0.3, "far": 0.6, "clearance": 0.1, "delivery": 2e7}

#: What a cylinder with valves cannot be.
CYLINDERS = {
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
    "a pressure on nothing": lambda: PistonPressure("gas", "ground", "piston", "crank", head=5e5),
    **{name: lambda more=more: cylinder(more) for name, more in CYLINDERS.items()},
}

SENTENCES = r"""
a pressure table that ends too early | ModelError | gas | 'gas': the table of head covers 0 to 300.803 deg, the cycle of 'crank' needs 0 to 360 deg: 300.803 to 360 deg is missing; add points, or let it hold its last value, outside="hold"
a pressure table of two turns | ModelError | gas | 'gas': the table of head covers 0 to 720 deg, the cycle of 'crank' is one turn, 0 to 360 deg: leave out what is beyond; for a cycle of two turns, name a shaft that turns at half the speed
a pressure table that repeats too early | ModelError | gas | 'gas': head repeats every 286.479 deg, which does not go into the cycle of 360 deg of 'crank': give it a period of 360 deg, or a whole part of it
a pressure program that repeats too late | ModelError | gas | 'gas': head repeats every 401.07 deg, which does not go into the cycle of 360 deg of 'crank': give it a period of 360 deg, or a whole part of it
a pressure on nothing | ModelError | gas | 'gas' presses on no area: give head_area, rod_area or both
a cylinder of a liquid and a gas | ModelError | cylinder | 'cylinder' has both bulk_modulus and exponent: give one of them, of a liquid or of a gas
a cylinder without a stroke | ModelError | cylinder | 'cylinder' has no stroke: near and far are both 0.3: give the two dead centres of the piston along the line of stroke
a cylinder that delivers downwards | ModelError | cylinder | 'cylinder': delivery is 2e+07, suction 3e+07: the pressure of delivery must be the greater one
a liquid that is too soft | ModelError | cylinder | 'cylinder' never opens its delivery valve: a whole stroke raises the pressure from 0 to 1.38629e+06, less than delivery, 2e+07: give it a smaller clearance, or a greater bulk_modulus
a gas without an atmosphere | ModelError | cylinder | 'cylinder' never opens its delivery valve: a whole stroke raises the pressure from 0 to 0, less than delivery, 2e+07: give it a smaller clearance, a greater exponent, or ambient where it is missing
a cylinder without an area | ModelError | cylinder | 'cylinder': area is 0, it must be positive: give more than 0
a cylinder without a clearance | ModelError | cylinder | 'cylinder': clearance is 0, it must be positive: give more than 0
"""
