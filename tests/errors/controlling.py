"""Formulas of measured quantities, inputs, own states and controllers."""

import numpy as np

from mbody import (
    Body,
    Controller,
    Distance,
    Force,
    Input,
    Mechanism,
    Revolute,
    Spring,
    State,
    Torque,
    simulate,
)
from mbody.laws import Table
from tests.errors.models import four_bar
from tests.errors.starting import chain


def arm(*more):
    """An arm that a torque turns, with further elements."""
    machine = Mechanism("arm", parameters={"k": "5 N*m/rad", "plain": 2.0})
    machine.add(Body("arm", mass=1.0, inertia=0.1, cg=(0.2, 0.0), points={"P": (0.4, 0.0)}))
    machine.add(Revolute("O", "ground", "arm"), Input("u", "0 N*m"))
    machine.add(*more, Torque("motor", "arm", value="u"))
    return machine


def torque(text):
    return lambda: arm(Torque("spring", "arm", value=text))


def controlled(function, **options):
    """A motion of an arm with a controller."""
    how = {"every": 0.1, "reads": ["arm.angle"], "sets": ["u"], **options}
    return lambda: simulate(arm(Controller("pid", function, **how)), 1.0)


def failing(t, angle):
    raise RuntimeError("no signal")


def symmetric():
    machine = arm(State("lag", rate="(u - lag)/(1 ms)", start="0 N*m"))
    return simulate(machine, 1.0, method="rattle4", step=1e-3)


def flat_with_a_controller():
    machine = chain(1, c0=6.0, c1=6.0)
    machine.add(Input("u", "0 N*m"), Torque("push", "c0", value="u"))
    reads = {"every": 0.1, "reads": ["c0.angle"], "sets": ["u"]}
    machine.add(Controller("pid", lambda t, angle: 0.0, **reads))
    return simulate(machine)


def steady_never():
    return simulate(arm(State("i", rate="1 + 0*i", start="steady")), 1.0)


SCENARIOS = {
    "a formula of a body that is not there": torque("-k*leg.angle"),
    "a formula of a point that is not there": torque("-5 N*arm.Q.y"),
    "a formula of a point of a joint": torque("-k*O.P.angle"),
    "a formula of what there is not": torque("-k*arm.colour"),
    "a formula of forces of the same instant": torque("0.1 m*O.force"),
    "a formula of accelerations": torque("-1 kg*m^2*arm.alpha"),
    "a formula of another dimension": torque("-5 N*arm.P.y/(1 s)"),
    "a formula that is too long": torque("1 N*m*(" + "+".join(["sin(arm.angle)"] * 100) + ")"),
    "a rod by a formula of what moves": lambda: arm(
        Distance("rod", "ground", "arm.P", length="0.1 m + arm.P.y")
    ),
    "a law of one number outside of a motion": lambda: arm(
        Torque("spring", "arm", value="-k*arm.angle")
    )["spring"].value(0.5),
    "an input that cannot be named": lambda: Input("speed set", 1.0),
    "an input of the name of a parameter": lambda: arm(Input("k", 1.0)),
    "an input of the name of a function": lambda: arm(Input("sin", 1.0)),
    "an input of an unknown parameter": lambda: arm(Input("w", "2*q N")),
    "an input that is no law": lambda: Input("u", [1.0]),
    "a state that cannot be named": lambda: State("my state", rate="1"),
    "a state without a start": lambda: State("i", rate="1", start=None),
    "a state of no size": lambda: State("i", rate="1", size=0.0),
    "a state without a formula": lambda: State("i", rate=[1.0]),
    "a state by a formula that is none": lambda: State("i", rate="1 +"),
    "a state whose start is no number": lambda: arm(State("i", rate="1", start="2*q")),
    "a state of what is not there": lambda: simulate(arm(State("i", rate="leg.angle")), 1.0),
    "a state of another dimension": lambda: simulate(
        arm(State("i", rate="arm.omega", start="0 m")), 1.0
    ),
    "a state with a method that has none": symmetric,
    "a controller from a singular position": flat_with_a_controller,
    "a state that is never steady": steady_never,
    "a table that holds its values, of a load": lambda: Torque(
        "t", "arm", value=Table([0.0, 1.0], [0.0, 1.0], interpolation="hold")
    ),
    "a controller that is no function": lambda: Controller("pid", 3.0, 0.1, sets=["u"]),
    "a controller whose reads are no texts": lambda: Controller("pid", max, 0.1, [3], ["u"]),
    "a controller that sets nothing": lambda: Controller("pid", max, 0.1, ["arm.angle"]),
    "a controller of no sample time": lambda: Controller("pid", max, 0.0, sets=["u"]),
    "a controller of what is no input": lambda: arm(Controller("pid", max, 0.1, sets=["v"])),
    "two controllers of one input": lambda: arm(
        Controller("one", max, 0.1, sets=["u"]), Controller("two", max, 0.1, sets=["u"])
    ),
    "a controller of too many samples": controlled(lambda t, x: 0.0, every=1e-10),
    "a controller that raises": controlled(failing),
    "a controller that gives no number": controlled(lambda t, x: float("nan")),
    "a controller that gives words": controlled(lambda t, x: "up"),
    "a controller that gives too many numbers": controlled(lambda t, x: (0.0, 1.0)),
    "a controller that sets what it may not": controlled(lambda t, x: {"v": 0.0}),
    "a controller that reads what is not there": controlled(lambda t, x: 0.0, reads=["leg.angle"]),
    "inputs that are no table": lambda: simulate(arm(), 1.0, inputs=3.0),
    "a history of what is no input": lambda: simulate(arm(), 1.0, inputs={"v": 1.0}),
    "a history of an input that a controller sets": lambda: simulate(
        arm(Controller("pid", lambda t: 0.0, 0.1, sets=["u"])), 1.0, inputs={"u": 1.0}
    ),
    "a history of one number": lambda: simulate(arm(), 1.0, inputs={"u": np.ones(1)}),
    "a history of another dimension": lambda: simulate(arm(), 1.0, inputs={"u": "1 m"}),
    "a history that goes back": lambda: simulate(arm(), 1.0, inputs={"u": ([1, 0], [0, 1])}),
    "a spring by a formula of forces": lambda: four_bar().add(
        Spring("s", "ground.O2", "coupler.B", law="2*A.fx")
    ),
    "a force by a formula of what is not there": lambda: arm(Force("f", "arm.P", value="leg.x")),
}
