"""Formulas of measured quantities, inputs, auxiliary states and controllers."""

import numpy as np

import mbody
from mbody.laws import Table
from mbody.model.simulation import Measure
from tests.errors.starting import chain


def arm(*more):
    """An arm that a torque turns, with further elements."""
    machine = mbody.Mechanism("arm", parameters={"k": "5 N*m/rad", "plain": 2.0})
    machine.add(mbody.Body("arm", mass=1.0, inertia=0.1, cg=(0.2, 0.0), points={"P": (0.4, 0.0)}))
    machine.add(mbody.Revolute("O", "ground", "arm"), mbody.Input("u", "0 N*m"))
    machine.add(*more, mbody.Torque("motor", "arm", value="u"))
    return machine


def looped(*more):
    """An arm whose torque measures the acceleration that it gives."""
    return arm(*more, mbody.Torque("spring", "arm", value="-0.1 kg*m^2*arm.alpha"))


def flat_with_a_loop():
    machine = chain(1, c0=6.0, c1=6.0)
    machine.add(mbody.Torque("push", "c0", value="-0.1 kg*m^2*c0.alpha"))
    return mbody.simulate(machine)


def torque(text):
    return lambda: arm(mbody.Torque("spring", "arm", value=text))


def controlled(function, **options):
    """A motion of an arm with a controller."""
    how = {"every": 0.1, "reads": ["arm.angle"], "sets": ["u"], **options}
    return lambda: mbody.simulate(arm(mbody.Controller("pid", function, **how)), 1.0)


def failing(t, angle):
    raise RuntimeError("no signal")


def symmetric():
    machine = arm(mbody.State("lag", rate="(u - lag)/(1 ms)", start="0 N*m"))
    return mbody.simulate(machine, 1.0, method="rattle4", step=1e-3)


def flat_with_a_controller():
    machine = chain(1, c0=6.0, c1=6.0)
    machine.add(mbody.Input("u", "0 N*m"), mbody.Torque("push", "c0", value="u"))
    reads = {"every": 0.1, "reads": ["c0.angle"], "sets": ["u"]}
    machine.add(mbody.Controller("pid", lambda t, angle: 0.0, **reads))
    return mbody.simulate(machine)


def steady_never():
    return mbody.simulate(arm(mbody.State("i", rate="1 + 0*i", start="steady")), 1.0)


def measured_twice():
    machine = arm(mbody.Quantity("q", "arm.angle"))
    machine.measures["q"] = Measure("arm.omega")
    return mbody.simulate(machine, 1.0)


def doubling(count):
    yield mbody.Quantity("q0", "arm.angle")
    for n in range(1, count):
        yield mbody.Quantity(f"q{n}", f"q{n - 1}*q{n - 1}")


def following_a_rate():
    yield mbody.Body("wheel", mass=1.0, inertia=0.1)
    yield mbody.Revolute("P", "ground", "wheel")
    yield mbody.Quantity("rate", "arm.omega*(1 s)")
    yield mbody.AngleDriver("d", "wheel", "rate")


SCENARIOS = {
    "a formula of a point that is not there": torque("-5 N*arm.Q.y"),
    "a formula of a point of a joint": torque("-k*O.P.angle"),
    "a formula of what there is not": torque("-k*arm.colour"),
    "a loop of forces that is not linear": lambda: mbody.simulate(torque("0.1 m*O.force")(), 1.0),
    "a loop beside friction": lambda: mbody.simulate(
        looped(mbody.Clutch("c", "ground", "arm", torque=1.0)), 1.0
    ),
    "a loop without a unique solution": lambda: mbody.simulate(
        arm(mbody.Torque("spring", "arm", value="0.14 kg*m^2*arm.alpha + 1 N*m")), 1.0
    ),
    "a loop that comes to no unique solution": lambda: mbody.simulate(
        arm(
            mbody.Torque(
                "spring", "arm", value="0.1 kg*m^2*(1 + arm.angle/(1 rad))*arm.alpha + 1 N*m"
            )
        ),
        9.0,
    ),
    "a loop at rest": lambda: mbody.equilibrium(looped()),
    "a loop with impulses": lambda: mbody.simulate(looped(), 1.0, method="moreau", step=1e-3),
    "a loop from a singular position": flat_with_a_loop,
    "a driver by a formula of forces": lambda: mbody.simulate(
        arm(
            mbody.Body("b"),
            mbody.Revolute("P", "ground", "b"),
            mbody.AngleDriver("d", "b", "1 rad/N*O.fx"),
        ),
        1.0,
    ),
    "a formula of another dimension": torque("-5 N*arm.P.y/(1 s)"),
    "a formula that is too long": torque("1 N*m*(" + "+".join(["sin(arm.angle)"] * 100) + ")"),
    "a rod by a formula of what moves": lambda: arm(
        mbody.Distance("rod", "ground", "arm.P", length="0.1 m + arm.P.y")
    ),
    "a law of one number outside of a motion": lambda: arm(
        mbody.Torque("spring", "arm", value="-k*arm.angle")
    )["spring"].value(0.5),
    "an input of the name of a parameter": lambda: arm(mbody.Input("k", 1.0)),
    "an input of the name of a function": lambda: arm(mbody.Input("sin", 1.0)),
    "an input of an unknown parameter": lambda: arm(mbody.Input("w", "2*q N")),
    "an input that is no law": lambda: mbody.Input("u", [1.0]),
    "a state that cannot be named": lambda: mbody.State("my state", rate="1"),
    "a state without a start": lambda: mbody.State("i", rate="1", start=None),
    "a state of no size": lambda: mbody.State("i", rate="1", size=0.0),
    "a state without a formula": lambda: mbody.State("i", rate=[1.0]),
    "a state by a formula that is none": lambda: mbody.State("i", rate="1 +"),
    "a state whose start is no number": lambda: arm(mbody.State("i", rate="1", start="2*q")),
    "a state of what is not there": lambda: mbody.simulate(
        arm(mbody.State("i", rate="leg.angle")), 1.0
    ),
    "a state of another dimension": lambda: mbody.simulate(
        arm(mbody.State("i", rate="arm.omega", start="0 m")), 1.0
    ),
    "a state with a method that has none": symmetric,
    "a controller from a singular position": flat_with_a_controller,
    "a state that is never steady": steady_never,
    "a table that holds its values, of a load": lambda: mbody.Torque(
        "t", "arm", value=Table([0.0, 1.0], [0.0, 1.0], interpolation="hold")
    ),
    "a quantity of the name of a measure": measured_twice,
    "a quantity of itself": lambda: arm(mbody.Quantity("q", "q + arm.angle")),
    "a quantity of the force of a spring": lambda: arm(
        mbody.Spring("s", "ground", "arm.P", stiffness=1.0), mbody.Quantity("q", "2*s.force")
    ),
    "quantities that multiply beyond bounds": lambda: arm(*doubling(16)),
    "a stop by a quantity that is no coordinate": lambda: mbody.simulate(
        arm(mbody.Quantity("rate", "arm.omega"), mbody.Stop("end", "rate")), 1.0
    ),
    "a driver by a quantity of a rate": lambda: mbody.simulate(arm(*following_a_rate()), 1.0),
    "a controller that is no function": lambda: mbody.Controller("pid", 3.0, 0.1, sets=["u"]),
    "a controller whose reads are no texts": lambda: mbody.Controller("pid", max, 0.1, [3], ["u"]),
    "a controller that sets nothing": lambda: mbody.Controller("pid", max, 0.1, ["arm.angle"]),
    "a controller of no sample time": lambda: mbody.Controller("pid", max, 0.0, sets=["u"]),
    "a controller of what is no input": lambda: arm(mbody.Controller("pid", max, 0.1, sets=["v"])),
    "two controllers of one input": lambda: arm(
        mbody.Controller("one", max, 0.1, sets=["u"]), mbody.Controller("two", max, 0.1, sets=["u"])
    ),
    "a controller of too many samples": controlled(lambda t, x: 0.0, every=1e-10),
    "a controller that raises": controlled(failing),
    "a controller that gives no number": controlled(lambda t, x: float("nan")),
    "a controller that gives words": controlled(lambda t, x: "up"),
    "a controller that gives too many numbers": controlled(lambda t, x: (0.0, 1.0)),
    "a controller that sets what it may not": controlled(lambda t, x: {"v": 0.0}),
    "inputs that are no table": lambda: mbody.simulate(arm(), 1.0, inputs=3.0),
    "a history of an input that a controller sets": lambda: mbody.simulate(
        arm(mbody.Controller("pid", lambda t: 0.0, 0.1, sets=["u"])), 1.0, inputs={"u": 1.0}
    ),
    "a history of one number": lambda: mbody.simulate(arm(), 1.0, inputs={"u": np.ones(1)}),
    "a history of another dimension": lambda: mbody.simulate(arm(), 1.0, inputs={"u": "1 m"}),
    "a history that goes back": lambda: mbody.simulate(arm(), 1.0, inputs={"u": ([1, 0], [0, 1])}),
}

SENTENCES = r"""
a formula of a point that is not there | ModelError | spring | 'spring': value: 'arm' has no point 'Q' (it has: 'P')
a formula of a point of a joint | ModelError | spring | 'spring': value: 'O' has no points: it is no body
a formula of what there is not | ModelError | spring | 'spring': value: 'arm' has no 'colour' to measure here (it has: 'x', 'y', 'vx', 'vy', 'ax', 'ay', 'angle', 'omega' and 1 more)
a loop of forces that is not linear | ModelError | spring | 'spring' follows accelerations or forces that follow from it in turn, by 'hypot' in '0.1 m*O.force': an algebraic loop is solved where it is linear, as in fx, fy, ax and alpha. Lead what it measures through a State, as State("felt", rate="(pin.fx - felt)/0.01 s", start="0 N"), and name that
a loop beside friction | ModelError | spring | 'spring' follows accelerations or forces that follow from it in turn: an algebraic loop is solved where all is linear, and the forces of 'c' are not. Lead what it measures through a State, as State("felt", rate="(pin.fx - felt)/0.01 s", start="0 N"), and name that
a loop without a unique solution | SolveError | spring | 'spring' follows accelerations or forces that follow from it in turn, and at t = 0 s this algebraic loop has no unique solution: by its factors a change of the load gives as great a change of its formula; change them
a loop that comes to no unique solution | SolveError | - | the steps vanish at t = 0.158533 s: the loads jump there, grow without bound, or are too stiff, or an algebraic loop has no unique solution; smooth them, or ask for less accuracy
a loop at rest | ModelError | spring | searches for rest positions know no algebraic loops: the formulas of 'spring' measure accelerations or forces that follow from them in turn; take simulate with 'dop853', kinetostatics or statics, or lead what is measured through a State
a loop with impulses | ModelError | spring | the method 'moreau' knows impulses of whole steps, and 'spring' measures accelerations or forces: take dop853
a loop from a singular position | ModelError | push | the motion begins at a singular position, where there are no accelerations yet that 'push' measures: begin a little beside it
a driver by a formula of forces | ModelError | d | 'd': law is '1 rad/N*O.fx', which follows accelerations or forces: these follow from the driven motion; measure positions, or use a Torque or a Force
a formula of another dimension | ModelError | spring | 'spring': value: '-5 N*arm.P.y/(1 s)' is a power (N·m/s), where a torque (N·m) is wanted
a formula that is too long | ModelError | spring | 'spring': value: '1 N*m*(sin(arm.angle)+sin(arm.angle)+sin(arm.angle)+sin(a...' has 300 operations, at most 200 are possible: name parts of it as quantities, or use a table
a rod by a formula of what moves | ModelError | rod | 'rod': length is '0.1 m + arm.P.y', a formula of 'arm.P.y', which a joint cannot follow: a load or a driver may; for coordinates that follow each other use a Coupling, a Gear, a Cam, a driver or a CustomJoint
a law of one number outside of a motion | ModelError | - | '-k*arm.angle' is a formula of measured quantities, which has values in a motion only: read from the result what the load does, as in run.load(name)
an input of the name of a parameter | ModelError | k | 'k' is the name of a parameter in formulas: choose another name for the input
an input of the name of a function | ModelError | sin | 'sin' is the name of a function, a variable or pi in formulas: choose another name for the input
an input of an unknown parameter | ModelError | w | 'w': value: there is no parameter 'q' (there are: 'k', 'plain')
an input that is no law | ModelError | u | 'u': value: a law must be a number, a law such as ConstantSpeed(0, 10), or a function of one number, not [1.0]; for points use Table(x, y)
a state that cannot be named | ModelError | my state | 'my state' cannot name a state: formulas name it, so it has letters, digits and _ only, and begins with a letter
a state without a start | ModelError | i | state 'i' has no start: give a number with its unit, or "steady" for the one at which its rate vanishes
a state of no size | ModelError | i | 'i': size is 0, it must be positive: give more than 0
a state without a formula | ModelError | i | 'i': rate must be a formula such as "target - crank.angle", not [1.0]
a state by a formula that is none | ModelError | i | 'i': rate: '1 +' ends where a number is expected
a state whose start is no number | ModelError | i | 'i': start: there is no parameter 'q' (there are: 'k', 'plain')
a state of what is not there | ModelError | i | 'i': rate: there is no 'leg' to measure 'leg.angle' of (there are: 'ground', 'arm', 'O', 'u', 'i', 'motor'): add it before, or correct the name
a state of another dimension | ModelError | i | 'i': rate: 'arm.omega' is an angular velocity (rad/s), where a velocity (m/s) is wanted
a state with a method that has none | ModelError | lag | the method 'rattle4' is of positions and velocities, whose steps it takes in two symmetric halves, and has none for equations of first order such as that of 'lag': take 'generalized-alpha' for steps of one length, or dop853, dopri5, radau5
a controller from a singular position | ModelError | pid | the motion begins at a singular position, where there are no accelerations yet for controllers such as 'pid' to sample: begin a little beside it
a state that is never steady | SolveError | i | no steady start is found for 'i': the rates do not vanish near the values tried; give start a number
a table that holds its values, of a load | ModelError | t | 't': value is a table that holds its values, which jump: give it to an Input, which formulas name, or choose another interpolation
a quantity of the name of a measure | ModelError | q | 'q' is a quantity and a measure: formulas name both, give one of them another name
a quantity of itself | ModelError | q | 'q': formula: 'q' names itself: a quantity names what was added before it; for a memory use a State
a quantity of the force of a spring | ModelError | q | 'q': formula: 's.force' is no quantity that formulas measure in the instant that they are evaluated at: measure others (of 's': 'length', 'rate', 'stiffness', 'free_length', 'preload'), or let a controller read it at its samples and set an Input
quantities that multiply beyond bounds | ModelError | q13 | 'q13': formula: with the quantities that it names it has 32765 operations, at most 20000 are possible: name a quantity once, or keep a State
a stop by a quantity that is no coordinate | ModelError | end | stop 'end': 'arm.omega' is no coordinate: take x, y and angle of bodies and points
a driver by a quantity of a rate | ModelError | d | 'd': law is 'rate', which measures a rate: a driver prescribes a position, and this would prescribe how positions change, which no position fulfils (a nonholonomic constraint). Follow positions, or use a Torque or a Force whose formula measures the rate
a controller that is no function | ModelError | pid | 'pid': function must be a function of (t, *reads), not 3.0
a controller whose reads are no texts | ModelError | pid | 'pid': reads must be a list of text, not [3]
a controller that sets nothing | ModelError | pid | 'pid' sets no input: name one or more, as in sets=["u"]
a controller of no sample time | ModelError | pid | 'pid': every is 0, it must be positive: give more than 0
a controller of what is no input | ModelError | pid | 'pid' sets 'v', which is no input (there are: 'u'): add Input(...) before it
two controllers of one input | ModelError | two | 'two' sets 'u', which 'one' sets already: give each controller inputs of its own, and add them in a formula
a controller of too many samples | ModelError | pid | controller 'pid' samples every 1e-10 s, that is 1e+10 times in this motion: give a longer sample time (at most 1e+08 samples)
a controller that raises | SolveError | pid | controller 'pid' at t = 0 s raised RuntimeError: no signal
a controller that gives no number | SolveError | pid | controller 'pid' at t = 0 s sets 'u' to nan, which is no finite number: look at what it computes
a controller that gives words | SolveError | pid | controller 'pid' at t = 0 s returned 'up', where numbers for u are wanted
a controller that gives too many numbers | SolveError | pid | controller 'pid' at t = 0 s returned 2 numbers, it sets 1: u
a controller that sets what it may not | SolveError | pid | controller 'pid' at t = 0 s sets 'v', which is not among what it sets (u)
inputs that are no table | ModelError | - | inputs must be a table such as {"u": 2.0}, not 3.0
a history of an input that a controller sets | ModelError | u | input 'u' is set by the controller 'pid': leave it out
a history of one number | ModelError | u | input 'u': a history is a row of at least two numbers, spread over the motion, or a pair (t, u) of rows, not of shape (1,)
a history of another dimension | ModelError | u | input 'u' is a torque (N·m), the history is a length (m): give it in a unit of the former
a history that goes back | ModelError | u | input 'u': x must increase from point to point, but x[1] = 0 follows x[0] = 1: sort the points and drop repeated ones
"""
