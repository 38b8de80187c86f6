"""Measures, and the instants that a mechanism or a command asks for."""

from mbody import AngleDriver
from mbody.analysis.driven.driven import analyse_at
from mbody.laws import ConstantAcceleration, ConstantSpeed
from mbody.model.simulation import Instants, Measure
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
    "a load": "brake.colour",
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


def loaded():
    from mbody import Gravity, Torque, kinetostatics

    brake, weight = Torque("brake", "rocker", value=1.0), Gravity("weight", y=-9.81)
    return kinetostatics(four_bar(brake, weight))


SCENARIOS = {
    "a measure that is no text": lambda: Measure(3),
    "a measure that is no formula": lambda: Measure("crank.x +"),
    **{f"measuring {name}": lambda of=of: loaded().measure(of) for name, of in MEASURES.items()},
    "a measure of an instant that there is not": lambda: run().measure("at(crank.x, 3)"),
    "a measure in nothing": lambda: run().measure(Measure("crank.x", "m*0")),
    **QUESTIONS,
    "t and a driver": ask(t=1.0, motor=2.0),
    "t of a stretch": ask(t="2*x"),
    "a driver that is not there": ask(engine=2.0),
    "a driver twice": ask(motor=1.0, crank=2.0),
    "values that are not as many": ask(two_drivers(0.5), motor=[1.0, 2.0], lever=[1.0, 2.0, 3.0]),
    "a driver in kilograms": ask(motor="3 kg"),
    "a value that its law does not reach": ask(
        by_law(ConstantAcceleration(0.0, 5.0, -40.0)), motor="90 deg"
    ),
    "a driver that rests": ask(two_drivers(0.5), lever=0.5),
    "two drivers that do not meet": ask(two_drivers(ConstantSpeed(0.0, 2.0)), motor=1.0, lever=1.0),
}

SENTENCES = r"""
a measure that is no text | ModelError | - | measure: of must be text, not 3
a measure that is no formula | ModelError | - | measure: 'crank.x +' ends where a number is expected
measuring a body that is not there | ModelError | - | measure 'rod.x': there is no body 'rod' (there are: 'ground', 'crank', 'coupler', 'rocker')
measuring a point that is not there | ModelError | - | measure 'coupler.P.y': 'coupler' has no point 'P' (it has: 'A', 'B')
measuring a quantity that a body has not | ModelError | - | measure 'crank.force': 'crank' has no 'force' (it has: x, y, vx, vy, ax, ay, angle, omega, alpha)
measuring a quantity that a point has not | ModelError | - | measure 'crank.A.angle': 'crank.A' has no 'angle' (it has: x, y, vx, vy, ax, ay)
measuring a quantity that a joint has not | ModelError | - | measure 'A.x': 'A' has no 'x' (it has: fx, fy, force, torque, angle, rate)
measuring a quantity that a driver has not | ModelError | - | measure 'motor.angle': 'motor' has no 'angle' (it has: effort, power, value, rate, acceleration)
measuring a load | ModelError | - | measure 'brake.colour': 'brake' has no 'colour' (it has: torque)
measuring gravity | ModelError | - | measure 'weight.fx': 'weight' acts on every body, it has no history of its own: measure what it does to a body from Python, run.load(name, on=body)
measuring a length and an angle | ModelError | - | measure 'crank.x + crank.angle': it adds a length (m) and an angle (rad)
measuring a body alone | ModelError | - | measure 'crank': 'crank' has many histories: name one, as in 'crank.x'
measuring a point of a joint | ModelError | - | measure 'A.P.x': there is no body 'A' (there are: 'ground', 'crank', 'coupler', 'rocker')
measuring no such name | ModelError | - | measure '2*quux7': there is no parameter 'quux7' (there are none), and a history is named by its element, as 'motor.effort'
a measure of an instant that there is not | ModelError | - | measure 'at(crank.x, 3)': there is no such instant, they are 0 to 0
a measure in nothing | ModelError | - | measure 'crank.x': 'm*0' is no unit
at that is no table | ModelError | - | ask: at must be a table such as {"t": 0.1}, not 5
at and over | ModelError | - | ask: give at or over, not both
over that is no name | ModelError | - | ask: over must be 'turn' or the name of a driver, not 3
instants without over | ModelError | - | ask: instants goes with over; at says how many they are
no values | ModelError | - | ask: at.t is empty: give at least one value
a value that is none | ModelError | t | ask: at.t: None is not a number: give a number, or text with units
a value that is nan | ModelError | t | ask: at.t is nan, it must be finite
a value that is no formula | ModelError | t | ask: at.t: '3 +' ends where a number is expected
t and a driver | ModelError | - | ask: give t or values of drivers, not both
t of a stretch | ModelError | t | 't': 'x' is allowed only in laws of a stretch, an angle or a rate
a driver that is not there | ModelError | engine | there is no driver 'engine' (there are: 'motor'), and t is time
a driver twice | ModelError | - | ask: 'motor', 'crank' are one driver: name it once
values that are not as many | ModelError | - | ask: there are 2 of 'motor' and 3 of 'lever': give as many values of each, or one
a driver in kilograms | ModelError | motor | 'motor': '3 kg' is a mass (kg), where an angle (rad) is wanted
a value that its law does not reach | ModelError | motor | driver 'motor' does not come there by its law: the law turns back at t = 0.125 where it has reached 0.3125 rad; it does not reach 1.5708 rad: request values before that, or change the law or the start
a driver that rests | ModelError | motor | ask: 'lever' rests while 'motor' moves: say where 'motor' is, or give t
two drivers that do not meet | ModelError | lever | by its law 'lever' is at 2 when 'motor' is where you want it: name one of them, or give t
"""
