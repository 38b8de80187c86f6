"""Assembly modes, circuits, dead centres and transmission."""

import functools

import mbody
from mbody import AngleDriver, Body, Contact, CoordinateDriver, Marker, Mechanism, Revolute
from mbody.views.drawing import draw_assemblies
from tests.errors.command import said
from tests.errors.models import four_bar
from tests.errors.results import batch


@functools.cache
def turn():
    return mbody.kinematics(four_bar(), turn=True, instants=13)


@functools.cache
def modes():
    return mbody.assembly_modes(four_bar())


def designs():
    return mbody.assemble(four_bar()).with_values({"crank.A.x": [1.0, 1.1]})


def two_motors():
    machine = four_bar(Body("wheel"), Revolute("W", "ground", "wheel"))
    machine.add(AngleDriver("fan", "wheel", 0.0))
    return machine


def shaft():
    """A wheel that a motor turns by itself."""
    machine = Mechanism("shaft")
    machine.add(Body("wheel"), Revolute("W", "ground", "wheel"), AngleDriver("fan", "wheel", 0.0))
    return mbody.kinematics(machine)


def fingers():
    """A crank beside the arm of a wheel, which a hand holds: nothing decides whether they touch."""
    tip = {"points": {"T": (1.0, 0.0)}, "shapes": {"tip": {"disc": "T", "radius": 0.1}}}
    machine = Mechanism("fingers", ground={"A": (0.0, 0.0), "B": (1.5, 0.0)})
    machine.add(
        Body("crank", **tip),
        Body("wheel", **tip),
        Revolute("A", "ground.A", "crank"),
        Revolute("B", "ground.B", "wheel"),
        Contact("touch", "crank.tip", "wheel.tip"),
        AngleDriver("motor", "crank", 0.0),
        AngleDriver("hand", "wheel", 3.0),
    )
    return mbody.kinematics(machine)


def table():
    """A body that drivers alone hold."""
    machine = Mechanism("table")
    machine.add(
        Body("plate"),
        CoordinateDriver("x", "ground", "plate", 0.0),
        CoordinateDriver("y", Marker("ground", (0.0, 0.0), angle="90 deg"), "plate", 0.0),
        AngleDriver("turn", "plate", 0.0),
    )
    return mbody.kinematics(machine)


def found(**options):
    return lambda: mbody.assembly_modes(four_bar(), **options)


def through(**options):
    return lambda: mbody.transmission(turn(), **options)


SCENARIOS = {
    "an assembly mode that there is not": lambda: mbody.kinematics(four_bar(), assembly="folded"),
    "an assembly mode that is no name": lambda: mbody.kinematics(four_bar(), assembly=1.5),
    "an assembly mode beside a guess": lambda: mbody.kinematics(
        four_bar(), assembly="open", guess={"rod": 1.0}
    ),
    "assemblies of a batch": lambda: mbody.assembly_modes(designs()),
    "assemblies at a number": found(drive=1.0),
    "assemblies at several values": found(drive={"motor": [1.0, 2.0]}),
    "assemblies at a driver that is not there": found(drive={"engine": 1.0}),
    "assemblies of what is free": lambda: mbody.assembly_modes(four_bar(motor=False)),
    "an assembly that is not there": lambda: modes()["opn"],
    "a picture of no assembly": lambda: draw_assemblies(
        mbody.assembly_modes(four_bar(lengths=(1.0, 2.5, 1.5, 5.4)))
    ),
    "assemblies of two positions": said(["assemblies", "norton_fourbar", "--at", "crank=60,70"]),
    "circuits of a batch": lambda: mbody.circuits(designs()),
    "dead centres of a batch": lambda: mbody.dead_centres(designs()),
    "dead centres of one of two motors": lambda: mbody.dead_centres(two_motors()),
    "a transmission of a batch": lambda: mbody.transmission(batch(), output="rocker"),
    "a transmission to nothing": through(output="piston"),
    "a transmission to a point that is not there": through(output="rocker.P"),
    "a transmission from nothing": through(driver="engine", output="rocker"),
    "a transmission from one of two motors": lambda: mbody.transmission(
        mbody.kinematics(two_motors()), output="rocker"
    ),
    "a transmission through another link's joint": through(output="rocker", joint="A"),
    "a transmission through two joints": through(output="coupler"),
    "a transmission through no joint": lambda: mbody.transmission(shaft(), output="wheel"),
    "a transmission by a contact that is open": lambda: mbody.transmission(
        fingers(), "motor", "wheel"
    ),
    "a transmission to a body without joints": lambda: mbody.transmission(
        table(), driver="x", output="plate"
    ),
}

SENTENCES = r"""
an assembly mode that there is not | ModelError | - | there is no assembly mode 'folded' where the drivers begin (there are: '1 crossed', '2 open'): choose one of these, or begin at another value of a driver
an assembly mode that is no name | ModelError | - | assembly is 1.5: give the name of a mode, such as "open", or its number
an assembly mode beside a guess | ModelError | - | give a guess or an assembly, not both: each chooses the branch
assemblies of a batch | ModelError | - | assembly_modes takes one design: choose one of the batch with design(n)
assemblies at a number | ModelError | - | drive must be a dict such as {"motor": 0.5}, not 1.0
assemblies at several values | ModelError | motor | 'motor': assembly_modes takes one value of a driver, not [1.0, 2.0]
assemblies at a driver that is not there | ModelError | engine | there is no driver 'engine' (there are: 'motor')
assemblies of what is free | SolveError | - | assembly_modes needs 0 free degrees of freedom, 'four-bar' has 1 degree left: add a driver, for example on 'crank'
an assembly that is not there | ModelError | opn | there is no mode 'opn' (there are: 'crossed', 'open')
a picture of no assembly | ModelError | - | 'four-bar' closes nowhere there: there is no assembly mode to draw
assemblies of two positions | UsageError | - | assemblies are those of one position: give --at one value
circuits of a batch | ModelError | - | circuits takes one design: choose one of the batch with design(n)
dead centres of a batch | ModelError | - | dead_centres takes one design: choose one of the batch with design(n)
dead centres of one of two motors | ModelError | - | 'four-bar' has 2 drivers ('motor', 'fan'): name the one that you mean
a transmission of a batch | ModelError | - | transmission is of one design, this is a batch of 2 designs: take one of them, run.design(n)
a transmission to nothing | ModelError | piston | there is no body 'piston' to be the output (there are: 'crank', 'coupler', 'rocker')
a transmission to a point that is not there | ModelError | rocker.P | 'rocker' has no point 'P'
a transmission from nothing | ModelError | engine | there is no driver 'engine' (there are: 'motor')
a transmission from one of two motors | ModelError | - | 'four-bar' has 2 drivers ('motor', 'fan'): name the one from which the motion is transmitted
a transmission through another link's joint | ModelError | A | 'A' is no joint of 'rocker' ('B', 'O4')
a transmission through two joints | ModelError | coupler | 'A', 'B' drive 'coupler': name the joint of which you want the transmission angle
a transmission through no joint | ModelError | wheel | no joint with a moving link drives 'wheel', so there is no transmission angle: for the ratios alone name one of its joints as the joint ('W')
a transmission by a contact that is open | ModelError | wheel | no joint with a moving link drives 'wheel', so there is no transmission angle: for the ratios alone name one of its joints as the joint ('B'); contacts drive it ('touch'): take a result of simulate, which closes and opens them
a transmission to a body without joints | ModelError | plate | 'plate' has no joint: the transmission angle is of the force in one
"""
