"""Inputs and auxiliary states in model files, histories for the command, motions followed again."""

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
    "an input by a table of two quantities": (0, '{ table = { x = [0, 1], y = ["1 N", "2 kg"] } }'),
    "a rate of another quantity": (1, 'rate = "2 m", start = "0 N*m"'),
    "a start that is no number": (1, 'rate = "u", start = "soon"'),
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
    "a plain state in other units": other_units_of_a_rate,
    "a motion at a time after it": lambda: motion().at(2.0),
    "a motion that ends earlier another time": earlier_end,
    "a batch of motions again": lambda: batch().at(0.5),
    "a motion without instants joined": lambda: motion().take([]).then(motion()),
    "a batch of motions joined with one": lambda: mbody.simulate(
        mbody.assemble(arm()).with_values({"arm.mass": [1.0, 2.0]}), 1.0
    ).then(motion()),
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
    "a history of an input that is not there": said(
        ["simulate", "free_fourbar", "--to", "1", "--input", "u=1"]
    ),
    "a history in a file that is not there": said(
        ["simulate", "free_fourbar", "--to", "1", "--input", "u=@nowhere.csv"]
    ),
}

SENTENCES = r"""
an input by a table of two quantities | ModelError | u | model: line 3: inputs.u: value: y: '2 kg' is a mass (kg), where a force (N) is wanted: did you mean '2 kgf'?
a rate of another quantity | ModelError | lag | model: line 13: states.lag.rate: '2 m' is a length (m), where a power (N·m/s) is wanted
a start that is no number | ModelError | lag | model: line 13: states.lag.start: there is no parameter 'soon' (there are none)
a controller that is to be saved | ModelError | pid | 'pid' is a Controller, Python code of your own, which a model file does not carry
plain numbers of a formula in other units | ModelError | motor | 'motor': the formula 'u - 2.0*arm.omega' has plain numbers, which cannot be taken to other units: give its numbers, and the inputs and states that it names, their units
a plain state in other units | ModelError | way | 'way': the formula 'arm.vx' has plain numbers, which cannot be taken to other units: give its numbers, and the inputs and states that it names, their units
a motion at a time after it | ModelError | - | at takes times of the motion, from 0 to 1 s: 2 s is not among them
a motion that ends earlier another time | SolveError | - | the motion from t = 0, followed again, ends before 0.95 s: controllers or loads in Python that are not functions of what they are given make another motion
a batch of motions again | ModelError | - | a motion is followed again for one design, this is a batch of 2 designs: take one of them, run.design(n)
a motion without instants joined | ModelError | - | then joins motions that have instants: one of them has none
a batch of motions joined with one | ModelError | - | then joins motions of as many designs, not of 2, 1: of a batch that of all designs, of run.design(n) its own
a motion at no time | ModelError | - | at takes times of the motion, from 0 to 1 s: none is given
a motion at what is no time | ModelError | - | at takes times, in s, not 'soon'
a motion again that was read from a file | ModelError | - | how this motion began is not known, as of one that was read from a file: simulate the mechanism again, with times= or every=
what is no motion again | ModelError | - | at follows a motion of simulate again, this is a result of kinematics: give its instants to the analysis, as in t=[0.1, 0.2]
a motion again with another controller | SolveError | - | the motion, followed again, is at t = 0.945 s apart from what was kept, by 0.34 of its size: controllers or loads in Python that are not functions of what they are given make another motion
a motion that is joined to no motion | ModelError | - | then joins motions of simulate, not a result of int: simulate it with start=run
motions that leave a gap | ModelError | - | a motion begins at t = 0 s, the one before ends at 1 s: simulate it with start=run, and keep its first instant
motions of two mechanisms | ModelError | - | 'other' is not the mechanism of the motion before, or has other numbers: join motions of one system, whose inputs alone may differ
motions that are joined elsewhere | ModelError | - | a motion begins at t = 1 s in another position or at other rates, 0.035 of their size apart: simulate it with start=run, and keep its first instant
a dataset without xarray | ModelError | - | a Dataset needs xarray, which is not installed: pip install xarray; columns() and to_npz() need nothing
a history of an input that is not there | ModelError | u | there is no input 'u' (there are: none)
a history in a file that is not there | ModelError | u | --input u: there is no file 'nowhere.csv'
"""
