"""Measures, and the instants that a mechanism or a command asks for."""

from mbody import AngleDriver
from mbody.analysis.driven.driven import analyse_at
from mbody.laws import ConstantAcceleration, ConstantSpeed
from mbody.model.study import Instants, Measure
from tests.errors.models import by_law, four_bar
from tests.errors.results import run

#: What cannot be measured on a four-bar.
MEASURES = {
    "a body that is not there": "rod.x",
    "a point that is not there": "coupler.P.y",
    "a quantity that a body has not": "crank.force",
    "a quantity that a point has not": "crank.A.angle",
    "a quantity that a joint has not": "A.x",
    "a quantity that a driver has not": "motor.angle",
    "a load": "brake.value",
    "gravity": "weight.fx",
    "a length and an angle": "crank.x + crank.angle",
    "a body alone": "crank",
    "a point of a joint": "A.P.x",
    "no such name": "2*quux7",
}

QUESTIONS = {
    "at that is no table": lambda: Instants(at=5),
    "at and over": lambda: Instants(at={"t": 1.0}, over="turn"),
    "over that is no name": lambda: Instants(over=3),
    "one instant": lambda: Instants(over="turn", instants=1),
    "instants without over": lambda: Instants(instants=3),
    "no values": lambda: Instants(at={"t": []}),
    "a value that is none": lambda: Instants(at={"t": None}),
    "a value that is nan": lambda: Instants(at={"t": float("nan")}),
    "a value that is no formula": lambda: Instants(at={"t": "3 +"}),
}


def ask(machine=None, **at):
    return lambda: analyse_at(machine or four_bar(), "kinematics", Instants(at=at))


def two_drivers(law):
    """Two motors on a chain of two cranks."""
    machine = by_law(ConstantSpeed(0.0, 1.0))
    machine.add(*_arm(law))
    return machine


def _arm(law):
    from mbody import Body, Revolute

    pin = Revolute("C", "ground.O2", "arm")
    return Body("arm", mass=1.0), pin, AngleDriver("lever", "arm", law)


def stopped_at_the_top():
    """A free motion that is to stop where its greatest angle is zero."""
    from mbody import Event, gallery, simulate

    machine = gallery.load("simple_pendulum")
    machine.measures["highest"] = Measure("max(pendulum.angle)")
    return simulate(machine, 1.0, events=[Event("highest", name="top")])


def loaded():
    from mbody import Gravity, Torque, kinetostatics

    brake, weight = Torque("brake", "rocker", value=1.0), Gravity("weight", y=-9.81)
    return kinetostatics(four_bar(brake, weight))


SCENARIOS = {
    "a measure that is no text": lambda: Measure(3),
    "a measure that is no formula": lambda: Measure("crank.x +"),
    "a measure in no unit": lambda: Measure("crank.x", "parsnip"),
    **{f"measuring {name}": lambda of=of: loaded().measure(of) for name, of in MEASURES.items()},
    "a measure of an instant that there is not": lambda: run().measure("at(crank.x, 3)"),
    "a measure of an instant without its number": lambda: Measure("at(crank.x)"),
    "an event of one number of all instants": stopped_at_the_top,
    "a measure in nothing": lambda: run().measure(Measure("crank.x", "m*0")),
    "a measure in a wrong unit": lambda: run().measure(Measure("crank.x", "N")),
    **QUESTIONS,
    "t and a driver": ask(t=1.0, motor=2.0),
    "t of time": ask(t="2*t"),
    "t of a stretch": ask(t="2*x"),
    "a driver that is not there": ask(engine=2.0),
    "a turn of a driver that is not there": lambda: analyse_at(
        four_bar(), "kinematics", Instants(over="engine")
    ),
    "a driver twice": ask(motor=1.0, crank=2.0),
    "values that are not as many": ask(two_drivers(0.5), motor=[1.0, 2.0], lever=[1.0, 2.0, 3.0]),
    "a driver in kilograms": ask(motor="3 kg"),
    "a value that its law does not reach": ask(
        by_law(ConstantAcceleration(0.0, 5.0, -40.0)), motor="90 deg"
    ),
    "a driver that rests": ask(two_drivers(0.5), lever=0.5),
    "two drivers that do not meet": ask(two_drivers(ConstantSpeed(0.0, 2.0)), motor=1.0, lever=1.0),
}
