"""Friction in joints: coefficients that do not fit, and questions without an answer."""

import mbody
from tests.support.frictional import gear_pair, slider_crank

PLACES = ("crank.A", "rod.A")


def pin(**numbers):
    return lambda: mbody.Revolute("A", *PLACES, **numbers)


def guide(**numbers):
    return lambda: mbody.Prismatic("guide", *PLACES, **numbers)


def gear(**numbers):
    return lambda: mbody.Gear("mesh", *PLACES, radius_i=3.0, radius_j=1.0, **numbers)


def cam(**numbers):
    return lambda: mbody.CamFollower("cam", *PLACES, 1.0, friction=0.1, **numbers)


def changed(machine, **values):
    names = {name.replace("_", ".", 1): value for name, value in values.items()}
    return lambda: mbody.assemble(machine()).with_values(names)


def clutch(**numbers):
    return lambda: mbody.Clutch("clutch", *PLACES, torque=5.0, **numbers)


def belt(**numbers):
    own = {"tension": 400.0, "radius_i": 0.1, "radius_j": 0.25, "distance": 0.8, "friction": 0.3}
    return mbody.Belt("belt", *PLACES, **own | numbers)


def band(**numbers):
    own = {"force": 200.0, "radius": 0.15, "wrap": 4.0, "friction": 0.3, "lever": 0.5, "arm": 0.1}
    return mbody.BandBrake("band", *PLACES, **own | numbers)


def belted(element):
    machine = slider_crank()
    machine.add(element)
    return machine


def ring():
    return gear_pair(internal=True, efficiency=0.9)


def asked(question, machine=slider_crank, **how):
    return lambda: question(mbody.kinetostatics(machine(), **how))


SCENARIOS = {
    "a belt between pulleys of another design that touch": changed(
        lambda: belted(belt()), belt_distance=0.3
    ),
    "a band brake of another design that locks itself": changed(
        lambda: belted(band(helping_arm=0.02)), band_wrap=6.0
    ),
    "a clutch that holds less than it slips with": clutch(static=0.8),
    "a clutch with a Stribeck rate alone": clutch(stribeck=2.0),
    "a pin with a coefficient that has a unit": pin(friction="0.1 mm", pin_radius=0.01),
    "a pin with friction and without a radius": pin(friction=0.1),
    "a pin without a size": pin(friction=0.1, pin_radius=0.0),
    "a pin that holds and does not slide": pin(static=0.2, pin_radius=0.01),
    "a pin with a Stribeck speed and one coefficient": pin(
        friction=0.1, stribeck=0.2, pin_radius=0.01
    ),
    "a pin that is damped negatively": pin(viscous=-1.0),
    "a pin with a Stribeck speed of zero": pin(
        friction=0.1, static=0.2, stribeck=0.0, pin_radius=0.01
    ),
    "a slider with a height and no length": guide(friction=0.1, height=0.02),
    "a slot with a negative coefficient": lambda: mbody.PinSlot("slot", *PLACES, friction=-1.0),
    "a gear with friction and an efficiency": gear(efficiency=0.9, friction=0.1),
    "a gear that gives more than it gets": gear(efficiency=1.1),
    "a gear that gives nothing": gear(efficiency=0.0),
    "a gear with friction and without a pressure angle": gear(friction=0.1),
    "a gear with a module and without friction": gear(module=0.1),
    "a gear with an obtuse pressure angle": gear(pressure_angle=1.2),
    "a rack with a pressure angle of zero": lambda: mbody.RackPinion(
        "mesh", *PLACES, radius=1.0, pressure_angle=0.0
    ),
    "a wheel that is driven by what resists": lambda: mbody.Rolling(
        "road", *PLACES, radius=1.0, resistance=-0.1
    ),
    "a roller with friction and without a pin": cam(roller=0.1, base_radius=1.0),
    "a roller that is smaller than its pin": cam(roller=0.1, base_radius=1.0, pin_radius=0.2),
    "designs with a static coefficient below the kinetic one": changed(
        lambda: slider_crank(static=0.2), A_friction=[0.1, 0.3]
    ),
    "designs with an efficiency that a ring cannot have": changed(ring, mesh_efficiency=[0.9, 0.2]),
    "the friction of a joint that has none": asked(lambda run: run.mode("motor")),
    "the range of a force that there is not": asked(lambda run: run.range("nobody")),
    "an efficiency without an output": asked(lambda run: run.efficiency("nobody"), turn="motor"),
    "an efficiency of one instant": asked(lambda run: run.efficiency("load")),
    "an efficiency of kinematics": lambda: mbody.kinematics(slider_crank()).efficiency("load"),
    "an efficiency without a driver that gives work": asked(
        lambda run: run.efficiency("load"), lambda: slider_crank(mu=0.0), t=[0.05, 0.1, 0.2]
    ),
    "an efficiency of a batch": lambda: mbody.kinetostatics(
        mbody.assemble(slider_crank()).with_values({"A.friction": [0.1, 0.2]}), [0.0, 0.1]
    ).efficiency("load"),
}

SENTENCES = r"""
a belt between pulleys of another design that touch | ModelError | belt | 'belt': distance is 0.3 m, but pulleys of 0.1 and 0.25 m touch at 0.35 m: give more
a band brake of another design that locks itself | ModelError | band | 'band': self-locking: helping_arm = 0.02 times the ratio of tensions 6.05 is not less than arm = 0.1, so that the drum does not turn counterclockwise, whatever the force; give less than 0.01653
a clutch that holds less than it slips with | ModelError | clutch | 'clutch': static is 0.8 times what slips: what rests is not easier to move than what slides; give 1 or more
a clutch with a Stribeck rate alone | ModelError | clutch | 'clutch': a stribeck rate is how fast friction falls from what sticks to what slips: give static too, above 1, or leave it out
a pin with a coefficient that has a unit | ModelError | A | 'A': friction: '0.1 mm' is a length (m), where a plain number is wanted
a pin with friction and without a radius | ModelError | A | 'A': friction is 0.1, but the pin has no radius at which it acts: give pin_radius, as in pin_radius="10 mm"
a pin without a size | ModelError | A | 'A': pin_radius is 0, it must be positive: give more than 0
a pin that holds and does not slide | ModelError | A | 'A': static is 0.2, but there is no friction while it slides: give friction too, at most as much
a pin with a Stribeck speed and one coefficient | ModelError | A | 'A': a stribeck speed is how fast friction falls from static to friction: give both, or leave it out
a pin that is damped negatively | ModelError | A | 'A': viscous is -1, it must not be negative: give 0 or more
a pin with a Stribeck speed of zero | ModelError | A | 'A': stribeck is 0, it must be positive: give more than 0
a slider with a height and no length | ModelError | guide | 'guide': height is 0.02, but a slider without a length touches one rail at one place: give length too, or leave out height
a slot with a negative coefficient | ModelError | slot | 'slot': friction is -1, it must not be negative: give 0 or more
a gear with friction and an efficiency | ModelError | mesh | 'mesh': efficiency = 0.9 and friction = 0.1 both say what the teeth lose: give one of them
a gear that gives more than it gets | ModelError | mesh | 'mesh': efficiency is 1.1, teeth give no more than they get: give at most 1, as in 0.98
a gear that gives nothing | ModelError | mesh | 'mesh': efficiency is 0, it must be positive: give more than 0
a gear with friction and without a pressure angle | ModelError | mesh | 'mesh': friction of teeth is 0.1, but how far they slide follows from their pressure angle: give pressure_angle, as in "20 deg"
a gear with a module and without friction | ModelError | mesh | 'mesh': a module is how far teeth with friction slide on each other: give friction too, or leave out module
a gear with an obtuse pressure angle | ModelError | mesh | 'mesh': pressure_angle is 68.7549 deg, it must be less than 45 deg: most gears have "20 deg"
a rack with a pressure angle of zero | ModelError | mesh | 'mesh': pressure_angle is 0, it must be positive: give more than 0
a wheel that is driven by what resists | ModelError | road | 'road': resistance is -0.1, it must not be negative: give 0 or more
a roller with friction and without a pin | ModelError | cam | 'cam': friction is 0.1, but a roller of 0.1 rolls, and rubs on its pin: give pin_radius
a roller that is smaller than its pin | ModelError | cam | 'cam': pin_radius is 0.2, it must be less than the roller = 0.1 that turns on the pin: give less, or leave it out
designs with a static coefficient below the kinetic one | ModelError | A | 'A': friction is 0.3, more than static = 0.2: what rests is not easier to move than what slides; exchange them, or leave out static
designs with an efficiency that a ring cannot have | ModelError | mesh | 'mesh': efficiency is 0.2: with these radii the wheels turn too little against each other to lose more than leaves 0.3333: give more than that
the friction of a joint that has none | ModelError | motor | 'motor' is no joint with friction (there are: 'O', 'A', 'B', 'guide'): give it friction, as in friction=0.1
the range of a force that there is not | ModelError | nobody | there is no joint 'nobody' (there are: 'O', 'A', 'B', 'guide')
an efficiency without an output | ModelError | nobody | there is no load or driver 'nobody' (there are: 'load', 'motor'): name what the mechanism works against
an efficiency of one instant | ModelError | - | an efficiency is of a motion, this is one instant: analyse a turn, or several times
an efficiency of kinematics | ModelError | - | kinematics finds no forces, and no work: use kinetostatics
an efficiency without a driver that gives work | ModelError | - | the drivers of 'slider-crank' give no work over this motion: what gives it must be a driver, or take a part of the motion in which one drives
an efficiency of a batch | ModelError | - | an efficiency is of one design, this is a batch of 2 designs: take one of them, run.design(n)
"""
