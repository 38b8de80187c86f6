"""Inputs and own states in model files, histories for the command, motions followed again."""

import functools

import mbody
from mbody import Body, Controller, Input, Mechanism, Revolute, State, Torque
from mbody.files.model import from_toml, in_units, to_toml
from tests.errors.command import said
from tests.errors.results import batch

MODEL = """
[inputs]
u = %s

[bodies.arm]
mass = 1
inertia = 0.1

[joints]
O = { revolute = ["ground", "arm"] }

[states]
lag = { %s }

[loads]
motor = { torque = "%s", body = "arm" }
"""
GOOD = ('"0 N*m"', 'rate = "(u - lag)/(1 s)", start = "0 N*m"', "lag")

#: What stands in the place of one of the three parts.
TEXTS = {
    "an input that is a list": (0, "[1, 2]"),
    "an input that is no formula": (0, '"2 +"'),
    "an input of no parameter": (0, '"2*q"'),
    "an input by a table of two quantities": (
        0,
        '{ table = { x = [0, 1], y = ["1 N", "2 kg"] } }',
    ),
    "a state without a rate": (1, "start = 0"),
    "a rate that is a list": (1, "rate = [1]"),
    "a rate that is no formula": (1, 'rate = "lag +"'),
    "a rate of what there is not": (1, 'rate = "leg.angle"'),
    "a rate of another quantity": (1, 'rate = "2 m", start = "0 N*m"'),
    "a start that is no number": (1, 'rate = "u", start = "soon"'),
    "a word that a state has not": (1, 'rate = "u", begin = 2'),
    "a load of a state that is not there": (2, "leg"),
}


def made(part, text):
    parts = list(GOOD)
    parts[part] = text
    return from_toml(MODEL % tuple(parts))


def arm():
    machine = Mechanism("arm")
    machine.add(Body("arm", mass=1.0, inertia=0.1, cg=(0.2, 0.0)), Revolute("O", "ground", "arm"))
    machine.add(Input("u", "0 N*m"), Torque("motor", "arm", value="u - 2.0*arm.omega"))
    return machine


def with_controller():
    machine = arm()
    machine.add(Controller("pid", lambda t: 0.0, 0.1, [], ["u"]))
    return machine


@functools.cache
def motion():
    return mbody.simulate(arm(), 1.0)


def without_beginning():
    return mbody.load_run(saved()).at(0.5)


@functools.cache
def saved():
    import tempfile

    path = f"{tempfile.mkdtemp()}/run.npz"
    mbody.save_run(motion(), path)
    return path


def another():
    other = Mechanism("other")
    other.add(Body("arm", mass=2.0, inertia=0.1), Revolute("O", "ground", "arm"))
    other.add(Input("u", "0 N*m"), Torque("motor", "arm", value="u"))
    return motion().then(mbody.simulate(other, 2.0, start=motion()))


def elsewhere():
    late = mbody.simulate(arm(), 1.0, rates={"arm": 1.0})
    later = mbody.simulate(arm(), 2.0, start=late)
    return motion().then(later)


class Counting:
    """A controller whose memory is outside of it."""

    calls = 0

    def __call__(self, t):
        Counting.calls += 1
        return 0.1 * Counting.calls


def other_motion():
    machine = arm()
    machine.add(Controller("pid", Counting(), 0.1, [], ["u"]))
    return mbody.simulate(machine, 1.0).at(0.95)


def earlier_end():
    """Another time, a memory outside of the controller pushes the arm to where the motion ends."""
    begun = []

    def push(t):
        if t == 0.0:
            begun.append(t)
        return 50.0 * (len(begun) > 1)

    machine = arm()
    machine.add(Controller("push", push, 0.1, [], ["u"]))
    stop = mbody.Event("arm.angle - 0.5 rad", stop=True)
    return mbody.simulate(machine, 1.0, events=[stop]).at(0.95)


def released_and_measured():
    machine = mbody.makers.four_bar(1, 3, 2, 3.5, masses=(1, 3, 2), speed=4.0)
    machine.add(Torque("push", "rocker", value="-1 N*m*s/rad*motor.rate"))
    return mbody.simulate(machine, 1.0, release={"motor": 0.5})


def other_units_of_a_rate():
    machine = arm()
    machine.add(State("way", rate="arm.vx"))
    return in_units(machine, "in-lbf-s")


def without_xarray():
    import sys
    from unittest import mock

    with mock.patch.dict(sys.modules, {"xarray": None}):
        motion().to_xarray()


SCENARIOS = {
    **{name: functools.partial(made, *change) for name, change in TEXTS.items()},
    "a controller that is to be saved": lambda: to_toml(with_controller()),
    "plain numbers of a formula in other units": lambda: in_units(arm(), "in-lbf-s"),
    "a driver that is released and measured": released_and_measured,
    "a plain state in other units": other_units_of_a_rate,
    "a motion at a time after it": lambda: motion().at(2.0),
    "a motion that ends earlier another time": earlier_end,
    "a batch of motions again": lambda: batch().at(0.5),
    "a motion without instants joined": lambda: motion().take([]).then(motion()),
    "a motion at no time": lambda: motion().at([]),
    "a motion at what is no time": lambda: motion().at("soon"),
    "a motion again that was read from a file": without_beginning,
    "what is no motion again": lambda: mbody.kinematics(
        mbody.makers.four_bar(1, 3, 2, 3.5, speed=1.0)
    ).at(0.1),
    "a motion again with another controller": other_motion,
    "a motion that is joined to no motion": lambda: motion().then(3),
    "motions that leave a gap": lambda: motion().then(motion()),
    "motions of two mechanisms": another,
    "motions that are joined elsewhere": elsewhere,
    "a dataset without xarray": without_xarray,
    "a history without a value": said(["simulate", "free_fourbar", "--to", "1", "--input", "u"]),
    "a history of an input that is not there": said(
        ["simulate", "free_fourbar", "--to", "1", "--input", "u=1"]
    ),
    "a history in a file that is not there": said(
        ["simulate", "free_fourbar", "--to", "1", "--input", "u=@nowhere.csv"]
    ),
}
