"""Motors, actuators, tables of two variables, and curves that formulas call."""

import mbody
from mbody.files.model.other_units import in_units
from mbody.files.model.write import to_toml
from mbody.laws import Harmonic, Table, Table2

GRID = [[0.0, 1.0], [2.0, 3.0]]
SPEED = Table(["0 rpm", "600 rpm"], ["20 N*m", "15 N*m"], interpolation="linear")


def table(x=(0.0, 1.0), y=(0.0, 1.0), z=GRID, **more):
    return lambda: Table2(x, y, z, **more)


def curves(**given):
    return lambda: mbody.Mechanism("m", curves=given, parameters={"p": 1.0})


def wheel(*loads, **how):
    machine = mbody.Mechanism("a wheel", curves={"motor": SPEED}, **how)
    machine.add(
        mbody.Body("wheel", mass=1.0, inertia=0.02), mbody.Revolute("O", "ground", "wheel"), *loads
    )
    return machine


def drive(text):
    return lambda: wheel(mbody.Torque("drive", "wheel", value=text))


def dc(voltage="24 V", **more):
    numbers = {"resistance": 0.5, "inductance": 2e-3, "constant": 0.1} | more
    return lambda: wheel(mbody.DCMotor("motor", "wheel", voltage=voltage, **numbers))


def induction(**more):
    numbers = {"breakdown_torque": 60.0, "breakdown_slip": 0.2, "synchronous": "1500 rpm"} | more
    return lambda: wheel(mbody.InductionMotor("motor", "wheel", **numbers))


def press(**more):
    numbers = {
        "bore": 0.05, "rod": 0.028, "closed": 0.4, "stroke": 0.5, "flow": 7e-4, "drop": 5e5,
        "supply": 160e5, "bulk_modulus": 1.4e9, "dead_volume": 50e-6,
    } | more  # fmt: skip
    return lambda: mbody.HydraulicCylinder("lift", "ground.A", "slide", **numbers)


def too_fast():
    machine = wheel(mbody.Torque("drive", "wheel", value="motor(wheel.omega)"))
    return mbody.simulate(machine, 10.0)


def file(curve):
    return lambda: mbody.from_toml(f"[curves]\nmotor = {curve}\n[bodies.wheel]\nmass = 1\n")


def python_curve():
    return to_toml(mbody.Mechanism("m", curves={"wave": Harmonic(0.0, 1.0, 2.0, 0.0)}))


def plain_curve():
    return in_units(mbody.Mechanism("m", curves={"c": Table([0, 1], [0, 2])}), "in-lbf-s")


def pending_table():
    return Table2(["0 m", "1 m"], [0, 1], GRID)(0.5, 0.5)


def slow(**more):
    machine = mbody.Mechanism("a slide", ground={"O": (-1.0, 0.0)})
    machine.add(mbody.Body("slide", mass=2.0), mbody.Prismatic("guide", "ground", "slide"))
    return lambda: machine.add(mbody.Actuator("drive", "ground.O", "slide", 3.0, **more))


def tyre(road, **more):
    numbers = {"radius": 0.3, "stiffness": 2e5, "friction": 0.9, "steepness": 10.0}
    return lambda: mbody.Tyre("tyre", road, "wheel.O", relaxation=0.3, **(numbers | more))


SCENARIOS = {
    "a table of two variables without rows": table(z=3.0),
    "a table of two variables of one place": table(x=[0.0]),
    "a table of two variables that goes back": table(y=[1.0, 0.0]),
    "a table of two variables that lacks a row": table(x=[0.0, 1.0, 2.0]),
    "a table of two variables that lacks a number": table(z=[[0.0, 1.0], [2.0]]),
    "a table of two variables with another interpolation": table(interpolation="cubic"),
    "a table of two variables beyond its grid": lambda: Table2([0, 1], [0, 1], GRID)(0.5, 3.0),
    "a table of two variables with units outside of a mechanism": pending_table,
    "a table of two variables as a law": lambda: mbody.Torque("t", "wheel", value=table()()),
    "curves that are no dict": lambda: mbody.Mechanism("m", curves=3.0),
    "a curve that formulas cannot name": curves(**{"a b": SPEED}),
    "a curve with the name of a function": curves(sin=SPEED),
    "a curve that is a number": curves(c=3.0),
    "a curve of two dimensions": curves(c=Table(["0 s", "1 m"], [0, 1])),
    "a curve that goes back": curves(c=Table(["1 s", "0 s"], [0, 1])),
    "a curve that there is not": drive("moter(wheel.omega)"),
    "a curve of something else": drive("motor(wheel.angle)"),
    "a curve of two numbers too many": drive("motor(wheel.omega, 1)"),
    "a curve without a number": drive("motor"),
    "a motion beyond a curve": too_fast,
    "a curve of a file of two variables that repeats": file(
        "{ x = [0, 1], y = [0, 1], z = [[0, 1], [2, 3]], periodic = true }"
    ),
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

SENTENCES = r"""
a table of two variables without rows | ModelError | - | Table2: z must be rows of numbers, one for each x
a table of two variables of one place | ModelError | - | Table2: x needs at least 2 places, it has 1
a table of two variables that goes back | ModelError | - | Table2: y must increase from place to place, but y[1] = 0 follows y[0] = 1: sort the grid
a table of two variables that lacks a row | ModelError | - | Table2: z has 2 rows and x has 3 places: give a row of z for each x
a table of two variables that lacks a number | ModelError | - | Table2: z[1] has 1 numbers and y has 2 places: give a number for each y
a table of two variables with another interpolation | ModelError | - | Table2: interpolation must be one of linear, pchip, spline, not 'cubic'
a table of two variables beyond its grid | ModelError | - | Table2: the table covers x from 0 to 1 and y from 0 to 1, but (0.5, 3) was requested: add points, or choose outside="hold" or "line"
a table of two variables with units outside of a mechanism | ModelError | - | Table2: its numbers are text, which has a value only in a mechanism: give it to one as a curve
a table of two variables as a law | ModelError | t | 't': value: a Table2 has two variables: give it to the mechanism as one of its curves and call it in a formula, as in value = 'engine(crank.omega, throttle)'
curves that are no dict | ModelError | - | curves must be a dict such as {"torque": Table(…)}, not 3.0
a curve that formulas cannot name | ModelError | - | 'a b' cannot name a curve: formulas call it, so it has letters, digits and _ only, and begins with a letter
a curve with the name of a function | ModelError | sin | 'sin' means something else in formulas: choose another name for the curve
a curve that is a number | ModelError | c | the curve 'c' must be a Table, a Table2 or another law, not 3.0
a curve of two dimensions | ModelError | c | curve 'c': x: '1 m' is a length (m), where a time (s) is wanted
a curve that goes back | ModelError | c | curve 'c': Table: x must increase from point to point, but x[1] = 0 follows x[0] = 1: sort the points and drop repeated ones
a curve that there is not | ModelError | drive | 'drive': value: there is no function 'moter' (there are: sin, cos, tan, asin, acos, atan, sqrt, abs, exp, log, sign, step, atan2, hypot, min, max, deadband, clamp, and the curves motor)
a curve of something else | ModelError | drive | 'drive': value: the curve 'motor' is of an angular velocity (rad/s), not of an angle (rad)
a curve of two numbers too many | ModelError | drive | 'drive': value: the curve 'motor' takes one number, not 2
a curve without a number | ModelError | drive | 'drive': value: 'motor' is a curve: give it a number, as in 'motor(2)'
a motion beyond a curve | SolveError | - | the steps vanish at t = 0.0723024 s: the loads jump there, grow without bound, or are too stiff, or are beyond the points of the curves 'motor'; smooth them, or ask for less accuracy
a curve of a file of two variables that repeats | ModelError | motor | model: line 2: curves.motor: has z, of two variables, and periodic, which only one has: leave out
a curve that no file carries | ModelError | wave | the curve 'wave' is a Harmonic, which a model file does not carry: give it as a Table
a curve of plain numbers in other units | ModelError | c | the curve 'c' is of plain numbers, which cannot be taken to other units: give its numbers their units
a motor without resistance | ModelError | motor | 'motor': resistance is 0, it must be positive: give more than 0
a motor on amperes | ModelError | motor | 'motor': voltage: '3 A' is a current (A), where a voltage (V) is wanted
a motor whose voltage follows itself | ModelError | motor | 'motor': voltage: 'motor.voltage' depends on itself: measure what it follows from, or filter it with a state of your own
an induction motor without a field | ModelError | motor | 'motor': synchronous is 0, a motor needs a turning field: give its speed, such as "1500 rpm"
an induction motor with two changes to delta | ModelError | motor | 'motor' has both star_until and star_below: give the time or the speed at which it changes to delta
an actuator with a slew alone | ModelError | drive | 'drive' has slew, but no lag: give the time constant with which the applied force follows, such as lag = "5 ms"
a cylinder whose rod fills it | ModelError | lift | 'lift': rod is 0.06 and bore 0.05: the rod must be thinner than the piston
a tyre on a road that moves | ModelError | tyre | 'tyre': its road is on 'belt': a tyre takes a road that is fixed to the ground; for a road that moves give a Contact of a disc with a line
a tyre whose force turns round | ModelError | tyre | 'tyre': curvature is 1.5: above 1 the force changes its sign at great slip; give 1 or less
"""
