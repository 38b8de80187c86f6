"""Motions that are led on step by step."""

import copy
from dataclasses import replace

import mbody
from mbody import gallery
from mbody.laws import ConstantSpeed, Harmonic
from tests.errors.models import four_bar
from tests.errors.results import batch


def led(**options):
    """A free four-bar."""
    return mbody.Simulator(gallery.load("free_fourbar"), **options)


def later():
    machine = four_bar()
    machine.simulation = mbody.SimulationSettings(1.0, release={"motor": 0.5})
    mbody.Simulator(machine)


def back(ask):
    def scenario():
        sim = led()
        sim.step(0.1)
        ask(sim)

    return scenario


def given(state):
    """A state that is set."""

    def scenario():
        sim = led()
        sim.state = state(sim)

    return scenario


def heavier(sim):
    return mbody.Simulator(
        mbody.assemble(sim.system.mechanism).with_values({"rocker.weight": 9.0})
    ).state


def with_more():
    machine = gallery.load("free_fourbar")
    machine.add(mbody.Gravity("wind", x=1.0))
    return mbody.Simulator(machine).state


def controlled():
    """The same four-bar with a controller."""
    machine = gallery.load("free_fourbar")
    machine.add(mbody.Input("u", 0.0), mbody.Controller("pd", lambda t: 0.0, "1 ms", sets=["u"]))
    return mbody.Simulator(machine)


def followed():
    """An input that follows a law of time."""
    machine = gallery.load("free_fourbar")
    machine.add(mbody.Input("u", Harmonic(0.0, 1.0, 2.0)))
    return mbody.Simulator(machine)


def assigned(simulator):
    def scenario():
        simulator().inputs["u"] = 1.0

    return scenario


def crane():
    """No position has the length of the rope after a while."""
    machine = mbody.Mechanism("crane", ground={"T": (0.0, 2.0)})
    machine.add(
        mbody.Body("boom", mass=1.0, points={"P": (1.0, 0.0)}, cg=(0.5, 0.0), guess=0.3),
        mbody.Revolute("O", "ground", "boom"),
        mbody.DistanceDriver("winch", "ground.T", "boom.P", ConstantSpeed(2.0, 0.5)),
    )
    mbody.Simulator(machine).reset({"boom.angle": 0.4}, t=5.0)


def many():
    """Twelve hundred discs on pins: more rows than dense matrices have."""
    machine = mbody.Mechanism("discs")
    for n in range(1200):
        machine.add(mbody.Body(f"d{n}", mass=1.0, guess=(float(n), 0.0, 0.0)))
        machine.add(mbody.Revolute(f"p{n}", mbody.Marker("ground", (float(n), 0.0)), f"d{n}"))
    return mbody.Simulator(machine)


def pulled_out():
    del open_input().inputs["u"]


def open_input():
    machine = gallery.load("free_fourbar")
    machine.add(mbody.Input("u", 0.0))
    return mbody.Simulator(machine)


def input_as(value):
    def scenario():
        open_input().inputs["u"] = value

    return scenario


SCENARIOS = {
    "a simulator that is copied": lambda: copy.copy(led()),
    "a batch that is led on": lambda: mbody.Simulator(batch().system),
    "a driver that is released later on": later,
    "a step of nothing": back(lambda sim: sim.step(0.0)),
    "a step that is no time": back(lambda sim: sim.step("3 m")),
    "a time that is over": back(lambda sim: sim.until(0.05)),
    "a state that is none": given(lambda sim: [0.0, 1.0]),
    "a state that is not whole": given(lambda sim: replace(sim.state, checkpoint=None)),
    "a state of another method": given(lambda sim: led(method="radau5").state),
    "a state of other numbers": given(heavier),
    "a state of other elements": given(lambda sim: with_more()),
    "a state of other controllers": given(lambda sim: controlled().state),
    "an input that follows its law": assigned(followed),
    "accelerations by inputs that are no numbers": back(lambda sim: sim.accelerations("much")),
    "a reset to what is no state": back(lambda sim: sim.reset([1.0])),
    "a reset to a state of other bodies": back(
        lambda sim: sim.reset(mbody.Simulator(gallery.load("double_pendulum")).state)
    ),
    "a reset of a body that there is not": back(lambda sim: sim.reset({"krank": {"angle": 1.0}})),
    "a reset of what a body has not": back(lambda sim: sim.reset({"crank.alpha": 1.0})),
    "a reset in metres": back(lambda sim: sim.reset({"crank.angle": "1 m"})),
    "a reset at a time when nothing closes": crane,
    "a reset by names of very many bodies": lambda: many().reset({"d1": {"angle": 1.0}}),
    "minimal coordinates of very many bodies": lambda: many().q_min,
    "a body that there is not": back(lambda sim: sim["krank"]),
    "a point that there is not": back(lambda sim: sim["crank.Z"]),
    "a measure that there is not": back(lambda sim: sim.measure("crank.colour")),
    "an input that there is not": back(lambda sim: sim.inputs["u"]),
    "an input that is taken away": pulled_out,
    "an input that is no number": input_as("much"),
    "an input that is not finite": input_as(float("nan")),
    "accelerations by too many inputs": back(lambda sim: sim.accelerations([1.0])),
}

SENTENCES = r"""
a simulator that is copied | ModelError | - | a Simulator cannot be copied: make another one of the same system, and set its state to sim.state, which can be copied and pickled
a batch that is led on | ModelError | - | a Simulator takes one design: choose one of the batch with design(n)
a driver that is released later on | ModelError | motor | 'motor' is to be released at 0.5 s: a Simulator releases nothing later on; simulate until then, and give the result as start
a step of nothing | ModelError | - | step: dt is 0 s at t = 0.1 s: give a positive time; to go back, keep sim.state and set it again
a step that is no time | ModelError | simulator | 'simulator': dt: '3 m' is a length (m), where a time (s) is wanted
a time that is over | ModelError | - | until: t is 0.05 s, the motion is at 0.1 s already: give a later time; to go back, keep sim.state and set it again
a state that is none | ModelError | - | the state that is set must be one that sim.state gave, not [0.0, 1.0]
a state that is not whole | ModelError | - | the state that is set is not whole: take one of sim.state
a state of another method | ModelError | - | the state that is set goes by radau5 at rtol 1e-10, this simulator by dop853 at rtol 1e-10: reset(state) takes its positions and rates alone
a state of other numbers | ModelError | - | the state that is set has other accelerations than this mechanism: its numbers differ; reset(state) takes its positions and rates alone
a state of other elements | ModelError | - | the state that is set is of another mechanism, with other elements
a state of other controllers | ModelError | - | the state that is set is of another mechanism, with other controllers
an input that follows its law | ModelError | u | the input 'u' follows its law of time: declare it with a number to set it here
accelerations by inputs that are no numbers | ModelError | - | u must be numbers, or a dict by name, not 'much'
a reset to what is no state | ModelError | - | reset takes a state, or positions and rates by name such as {"crank": {"angle": 0.5, "omega": 2.0}}, not [1.0]
a reset to a state of other bodies | ModelError | - | the state to reset to is of another mechanism, of the bodies 'upper', 'lower'
a reset of a body that there is not | ModelError | krank | reset: there is no body 'krank' (there are: 'crank', 'coupler', 'rocker'); give positions and rates by name, such as {"crank": {"angle": 0.5, "omega": 2.0}}
a reset of what a body has not | ModelError | crank | reset: 'crank' has no 'alpha' to set (it has: angle, omega, x, vx, y, vy)
a reset in metres | ModelError | reset | 'reset': crank.angle: '1 m' is a length (m), where an angle (rad) is wanted
a reset at a time when nothing closes | SolveError | boom | reset: the loops of 'crane' do not close near boom.angle = 22.91831 deg at t = 5 s: give values that its joints allow
a reset by names of very many bodies | ModelError | - | reset: 'discs' has 2400 rows, too many for positions by name: set a state that a simulator had
minimal coordinates of very many bodies | SolveError | - | minimal coordinates of 'discs': 2400 rows of 3600 coordinates are too many for dense matrices; use the arrays of all coordinates
a body that there is not | ModelError | krank | there is no body 'krank' (there are: 'crank', 'coupler', 'rocker')
a point that there is not | ModelError | crank | body 'crank' has no point 'Z' (it has: 'O2', 'A')
a measure that there is not | ModelError | - | measure 'crank.colour': 'crank' has no 'colour' (it has: x, y, vx, vy, ax, ay, angle, omega, alpha)
an input that there is not | ModelError | u | there is no input 'u' (there are: none)
an input that is taken away | ModelError | u | the input 'u' belongs to the mechanism: set it to a number
an input that is no number | ModelError | inputs | 'inputs': u: there is no parameter 'much' (there are none)
an input that is not finite | ModelError | u | the input 'u' is nan: give a finite number
accelerations by too many inputs | ModelError | - | u has 1 numbers, the mechanism 0 inputs that can be set: give one each, or a dict by name
"""
