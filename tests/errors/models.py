"""The mechanisms that scenarios go wrong with."""

import math

import mbody
from mbody import makers
from mbody.laws import ConstantSpeed
from mbody.model.joints import CustomJoint
from mbody.model.loads import CustomLoad

CRANK, COUPLER, ROCKER, GROUND = LENGTHS = 1.0, 3.0, 2.0, 3.5


def four_bar(*more, motor=None, lengths=LENGTHS, **options):
    """A four-bar with another motor or none (False), and more elements."""
    made = makers.four_bar(*lengths, masses=(1.0, 3.0, 2.0), **{"speed": 1.0, **options})
    machine = mbody.Mechanism(made.name, ground=made.ground.points)
    machine.add(*(element for element in made if element.name != "motor"))
    if motor is not False:
        machine.add(motor or made["motor"])
    machine.add(*more)
    return machine


def by_rocker(start, speed=1.0):
    return four_bar(motor=mbody.AngleDriver("motor", "rocker", ConstantSpeed(start, speed)))


def by_law(law):
    return four_bar(motor=mbody.AngleDriver("motor", "crank", law))


def dead_centre(reach):
    """Angle of the rocker where crank and coupler are in line and span `reach`: law of cosines."""
    cosine = (GROUND**2 + ROCKER**2 - reach**2) / (2.0 * GROUND * ROCKER)
    return math.pi - math.acos(cosine)


STRETCHED, FOLDED = dead_centre(COUPLER + CRANK), dead_centre(COUPLER - CRANK)


def crank_alone():
    machine = mbody.Mechanism("m", ground={"O": (0.0, 0.0)})
    machine.add(mbody.Body("crank", points={"A": (1.0, 0.0)}))
    return machine


def tappet(profile, **contact):
    """A follower on its guide above a cam that a motor turns."""
    up = math.pi / 2.0
    machine = mbody.Mechanism("tappet", units="mm-N-s")
    machine.add(
        mbody.Body("shaft"),
        mbody.Body("tappet", mass=1e-3),
        mbody.Revolute("O", "ground", "shaft"),
        mbody.Prismatic(
            "guide", mbody.Marker("ground", (0.0, 0.0), up), mbody.Marker("tappet", (0.0, 0.0), up)
        ),
        mbody.CamFollower("contact", "shaft", "tappet", profile, **contact),
        mbody.AngleDriver("motor", "shaft", ConstantSpeed(0.0, 10.0)),
    )
    return machine


def chain(links, reach):
    """Bars of length 1 in a row, all guessed in one line, between two pins."""
    machine = mbody.Mechanism("chain", ground={"A": (0.0, 0.0), "Z": (reach, 0.0)})
    here = "ground.A"
    for n in range(links):
        machine.add(makers.bar(f"b{n}", 1.0, guess=0.0), mbody.Revolute(f"j{n}", here, f"b{n}.A"))
        here = f"b{n}.B"
    machine.add(mbody.Revolute("end", here, "ground.Z"))
    return machine


# -- a user's own code ------------------------------------------------------------------------


def no_oil(*_):
    raise ValueError("no oil")


class OwnLoad(CustomLoad):
    def physics(self, i, j, p, t):
        return ANSWER(i, j, p, t)


class OwnJoint(CustomJoint):
    rows = "l"

    def physics(self, i, j, p, t):
        return ANSWER(i, j, p, t)


ANSWER = no_oil


def with_own(kind, function):
    """A four-bar with a user's function: as a law or inside an element."""
    global ANSWER
    ANSWER = function
    if kind == "driver":
        return by_law(function)
    if kind == "load":
        return four_bar(mbody.Torque("own", "rocker", value=function))
    if kind == "spring":
        return four_bar(mbody.Spring("own", "ground.O2", "rocker.B", law=function))
    if kind == "custom load":
        return four_bar(OwnLoad("own", "ground.O2", "rocker.B"))
    machine = four_bar(mbody.Body("pin", mass=1.0))
    machine.add(OwnJoint("own", "rocker.B", "pin"))
    return machine
