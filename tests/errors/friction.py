"""Friction in joints: coefficients that do not fit, and questions without an answer."""

from mbody import (
    BandBrake,
    Belt,
    CamFollower,
    Clutch,
    Gear,
    PinSlot,
    Prismatic,
    RackPinion,
    Revolute,
    Rolling,
    assemble,
    from_toml,
    kinematics,
    kinetostatics,
)
from tests.rough import drawer, gear_pair, slider_crank

PLACES = ("crank.A", "rod.A")


def pin(**numbers):
    return lambda: Revolute("A", *PLACES, **numbers)


def guide(**numbers):
    return lambda: Prismatic("guide", *PLACES, **numbers)


def gear(**numbers):
    return lambda: Gear("mesh", *PLACES, radius_i=3.0, radius_j=1.0, **numbers)


def cam(**numbers):
    return lambda: CamFollower("cam", *PLACES, 1.0, friction=0.1, **numbers)


def changed(machine, **values):
    names = {name.replace("_", ".", 1): value for name, value in values.items()}
    return lambda: assemble(machine()).with_values(names)


def clutch(**numbers):
    return lambda: Clutch("clutch", *PLACES, torque=5.0, **numbers)


def belt(**numbers):
    own = {"tension": 400.0, "radius_i": 0.1, "radius_j": 0.25, "distance": 0.8, "friction": 0.3}
    return Belt("belt", *PLACES, **own | numbers)


def band(**numbers):
    own = {"force": 200.0, "radius": 0.15, "wrap": 4.0, "friction": 0.3, "lever": 0.5, "arm": 0.1}
    return BandBrake("band", *PLACES, **own | numbers)


def belted(element):
    machine = slider_crank()
    machine.add(element)
    return machine


def clutched():
    machine = slider_crank()
    machine.add(Clutch("clutch", "ground", "crank", torque=5.0, static=1.2))
    return machine


def ring():
    return gear_pair(internal=True, efficiency=0.9)


def asked(question, machine=slider_crank, **how):
    return lambda: question(kinetostatics(machine(), **how))


FILE = """
[bodies.arm]
mass = 1
points = { O = [0, 0] }
[joints]
O = { revolute = ["ground", "arm.O"], friction = 0.1 }
"""

SCENARIOS = {
    "a belt between pulleys that touch": lambda: belt(distance=0.3),
    "a belt between pulleys of another design that touch": changed(
        lambda: belted(belt()), belt_distance=0.3
    ),
    "a belt that is neither crossed nor open": lambda: belt(crossed="yes"),
    "a band brake that locks itself": lambda: band(helping_arm=0.05),
    "a band brake of another design that locks itself": changed(
        lambda: belted(band(helping_arm=0.02)), band_wrap=6.0
    ),
    "a clutch that holds less than it slips with": clutch(static=0.8),
    "a clutch with a Stribeck rate alone": clutch(stribeck=2.0),
    "a clutch of a design that holds less": changed(clutched, clutch_static=0.5),
    "a pin with a negative coefficient": pin(friction=-0.1, pin_radius=0.01),
    "a pin with a coefficient that has a unit": pin(friction="0.1 mm", pin_radius=0.01),
    "a pin with friction and without a radius": pin(friction=0.1),
    "a pin of a file with friction and without a radius": lambda: from_toml(FILE),
    "a pin without a size": pin(friction=0.1, pin_radius=0.0),
    "a pin that is easier to start than to keep turning": pin(
        friction=0.3, static=0.2, pin_radius=0.01
    ),
    "a pin that holds and does not slide": pin(static=0.2, pin_radius=0.01),
    "a pin with a Stribeck speed and one coefficient": pin(
        friction=0.1, stribeck=0.2, pin_radius=0.01
    ),
    "a pin that is damped negatively": pin(viscous=-1.0),
    "a pin with a Stribeck speed of zero": pin(
        friction=0.1, static=0.2, stribeck=0.0, pin_radius=0.01
    ),
    "a slider with a height and no length": guide(friction=0.1, height=0.02),
    "a slider with a negative length": guide(friction=0.1, length=-0.02),
    "a slot with a negative coefficient": lambda: PinSlot("slot", *PLACES, friction=-1.0),
    "a gear with friction and an efficiency": gear(efficiency=0.9, friction=0.1),
    "a gear that gives more than it gets": gear(efficiency=1.1),
    "a gear that gives nothing": gear(efficiency=0.0),
    "a gear with friction and without a pressure angle": gear(friction=0.1),
    "a gear with a module and without friction": gear(module=0.1),
    "a gear with an obtuse pressure angle": gear(pressure_angle=1.2),
    "a rack with a pressure angle of zero": lambda: RackPinion(
        "mesh", *PLACES, radius=1.0, pressure_angle=0.0
    ),
    "a wheel that is driven by what resists": lambda: Rolling(
        "road", *PLACES, radius=1.0, resistance=-0.1
    ),
    "a roller with friction and without a pin": cam(roller=0.1, base_radius=1.0),
    "a roller that is smaller than its pin": cam(roller=0.1, base_radius=1.0, pin_radius=0.2),
    "designs with a static coefficient below the kinetic one": changed(
        lambda: slider_crank(static=0.2), A_friction=[0.1, 0.3]
    ),
    "designs with an efficiency above one": changed(ring, mesh_efficiency=[0.9, 1.2]),
    "designs with an efficiency that a ring cannot have": changed(ring, mesh_efficiency=[0.9, 0.2]),
    "the friction of a joint that has none": asked(lambda run: run.mode("motor")),
    "the range of a force that there is not": asked(lambda run: run.range("nobody")),
    "an efficiency without an output": asked(lambda run: run.efficiency("nobody"), turn="motor"),
    "an efficiency of one instant": asked(lambda run: run.efficiency("load")),
    "an efficiency of kinematics": lambda: kinematics(slider_crank()).efficiency("load"),
    "an efficiency without a driver that gives work": asked(
        lambda run: run.efficiency("load"), lambda: slider_crank(mu=0.0), t=[0.05, 0.1, 0.2]
    ),
    "an efficiency of a batch": lambda: kinetostatics(
        assemble(slider_crank()).with_values({"A.friction": [0.1, 0.2]}), [0.0, 0.1]
    ).efficiency("load"),
    "a drawer with an unknown load": lambda: kinetostatics(drawer(0.1), [0.0, 1.0]).efficiency(
        output="push"
    ),
}
