"""Motors, actuators, tables of two variables, and curves that formulas call."""

from mbody import (
    Actuator,
    Body,
    DCMotor,
    HydraulicCylinder,
    InductionMotor,
    Mechanism,
    Prismatic,
    Revolute,
    Torque,
    Tyre,
    from_toml,
    simulate,
)
from mbody.files.model.other_units import in_units
from mbody.files.model.write import to_toml
from mbody.laws import Harmonic, Table, Table2

GRID = [[0.0, 1.0], [2.0, 3.0]]
SPEED = Table(["0 rpm", "600 rpm"], ["20 N*m", "15 N*m"], interpolation="linear")


def table(x=(0.0, 1.0), y=(0.0, 1.0), z=GRID, **more):
    return lambda: Table2(x, y, z, **more)


def curves(**given):
    return lambda: Mechanism("m", curves=given, parameters={"p": 1.0})


def wheel(*loads, **how):
    machine = Mechanism("a wheel", curves={"motor": SPEED}, **how)
    machine.add(Body("wheel", mass=1.0, inertia=0.02), Revolute("O", "ground", "wheel"), *loads)
    return machine


def drive(text):
    return lambda: wheel(Torque("drive", "wheel", value=text))


def dc(voltage="24 V", **more):
    numbers = {"resistance": 0.5, "inductance": 2e-3, "constant": 0.1} | more
    return lambda: wheel(DCMotor("motor", "wheel", voltage=voltage, **numbers))


def induction(**more):
    numbers = {"breakdown_torque": 60.0, "breakdown_slip": 0.2, "synchronous": "1500 rpm"} | more
    return lambda: wheel(InductionMotor("motor", "wheel", **numbers))


def press(**more):
    numbers = {
        "bore": 0.05, "rod": 0.028, "closed": 0.4, "stroke": 0.5, "flow": 7e-4, "drop": 5e5,
        "supply": 160e5, "bulk_modulus": 1.4e9, "dead_volume": 50e-6,
    } | more  # fmt: skip
    return lambda: HydraulicCylinder("lift", "ground.A", "slide", **numbers)


def too_fast():
    machine = wheel(Torque("drive", "wheel", value="motor(wheel.omega)"))
    return simulate(machine, 10.0)


def file(curve):
    return lambda: from_toml(f"[curves]\nmotor = {curve}\n[bodies.wheel]\nmass = 1\n")


def python_curve():
    return to_toml(Mechanism("m", curves={"wave": Harmonic(0.0, 1.0, 2.0, 0.0)}))


def plain_curve():
    return in_units(Mechanism("m", curves={"c": Table([0, 1], [0, 2])}), "in-lbf-s")


def pending_table():
    return Table2(["0 m", "1 m"], [0, 1], GRID)(0.5, 0.5)


def slow(**more):
    machine = Mechanism("a slide", ground={"O": (-1.0, 0.0)})
    machine.add(Body("slide", mass=2.0), Prismatic("guide", "ground", "slide"))
    return lambda: machine.add(Actuator("drive", "ground.O", "slide", 3.0, **more))


def tyre(road, **more):
    numbers = {"radius": 0.3, "stiffness": 2e5, "friction": 0.9, "steepness": 10.0}
    return lambda: Tyre("tyre", road, "wheel.O", relaxation=0.3, **(numbers | more))


SCENARIOS = {
    "a table of two variables without rows": table(z=3.0),
    "a table of two variables of one row of numbers": table(z=[0.0, 1.0]),
    "a table of two variables of one place": table(x=[0.0]),
    "a table of two variables that goes back": table(y=[1.0, 0.0]),
    "a table of two variables that lacks a row": table(x=[0.0, 1.0, 2.0]),
    "a table of two variables that lacks a number": table(z=[[0.0, 1.0], [2.0]]),
    "a table of two variables with another interpolation": table(interpolation="cubic"),
    "a table of two variables beyond its grid": lambda: Table2([0, 1], [0, 1], GRID)(0.5, 3.0),
    "a table of two variables with units outside of a mechanism": pending_table,
    "a table of two variables as a law": lambda: Torque("t", "wheel", value=table()()),
    "curves that are no dict": lambda: Mechanism("m", curves=3.0),
    "a curve that formulas cannot name": curves(**{"a b": SPEED}),
    "a curve with the name of a function": curves(sin=SPEED),
    "a curve with the name of a parameter": curves(p=SPEED),
    "a curve that is a number": curves(c=3.0),
    "a curve of two dimensions": curves(c=Table(["0 s", "1 m"], [0, 1])),
    "a curve that goes back": curves(c=Table(["1 s", "0 s"], [0, 1])),
    "a curve that there is not": drive("moter(wheel.omega)"),
    "a curve of something else": drive("motor(wheel.angle)"),
    "a curve of two numbers too many": drive("motor(wheel.omega, 1)"),
    "a curve without a number": drive("motor"),
    "a motion beyond a curve": too_fast,
    "a curve of a file that has none of both": file("{ x = [0, 1] }"),
    "a curve of a file that has both": file('{ x = [0, 1], y = [0, 1], file = "c.csv" }'),
    "a curve of a file of two variables that repeats": file(
        "{ x = [0, 1], y = [0, 1], z = [[0, 1], [2, 3]], periodic = true }"
    ),
    "a curve of a file that is no table": file("3"),
    "a curve that no file carries": python_curve,
    "a curve of plain numbers in other units": plain_curve,
    "a motor without resistance": dc(resistance=0.0),
    "a motor on amperes": dc("3 A"),
    "a motor whose voltage follows itself": dc("2*motor.voltage"),
    "an induction motor without a field": induction(synchronous=0.0),
    "an induction motor with two changes to delta": induction(star_until=1.0, star_below=9.0),
    "an actuator with a slew alone": slow(slew=10.0),
    "a cylinder whose rod fills it": press(rod=0.06),
    "a tyre on a road that moves": tyre("belt.O"),
    "a tyre whose force turns round": tyre("ground.O", curvature=1.5),
}
