"""Derivatives: of what, by which numbers, where there are none."""

import mbody
from mbody import Mechanism, SimulationSettings, Torque
from mbody.derivatives.fit_problem import PreparedGradient
from tests.errors.command import said
from tests.errors.models import four_bar
from tests.support.frictional import slider_crank


def gradient(measure="A.force", by="crank.A.x", analysis="kinetostatics", **options):
    return mbody.gradient(four_bar(), measure, by, analysis, **options)


def with_parameters():
    """A four-bar one of whose lengths a formula makes."""
    machine = Mechanism("four-bar", parameters={"a": 0.5}, ground={"O2": (0, 0), "O4": (3.5, 0)})
    machine.add(
        mbody.Body("crank", points={"A": ("2*a", 0)}),
        mbody.Body("coupler", points={"B": (3.0, 0)}, guess="30 deg"),
        mbody.Body("rocker", points={"B": (2.0, 0)}, guess="80 deg"),
        mbody.Revolute("O2", "ground.O2", "crank"),
        mbody.Revolute("A", "crank.A", "coupler"),
        mbody.Revolute("B", "coupler.B", "rocker.B"),
        mbody.Revolute("O4", "ground.O4", "rocker"),
        mbody.AngleDriver("motor", "crank", mbody.laws.ConstantSpeed(0.5, 10.0)),
    )
    return machine


def batch():
    return mbody.assemble(four_bar()).with_values({"crank.A.x": [0.9, 1.1]})


def sensitivity(**options):
    run = mbody.kinetostatics(four_bar(), t=[0.0, 0.01])
    return run.sensitivity("A.force", **options)


def of_a_motion():
    run = mbody.simulate(mbody.gallery.load("simple_pendulum"), 0.1)
    return run.sensitivity("pendulum.angle")


def of_redundant_loops():
    """Three parallel cranks on one coupler: the third closes by its length alone."""
    machine = mbody.gallery.load("parallel_cranks")
    return mbody.gradient(machine, "motor.effort", "coupler.A2.x")


def hanging(**numbers):
    machine = Mechanism("a pendulum", **numbers)
    machine.add(
        mbody.Body("bob", mass=1.0, inertia=0.1, cg=(1.0, 0.0), guess=0.3),
        mbody.Revolute("O", "ground", "bob"),
        mbody.Gravity("gravity", y=-9.81),
    )
    return machine


def of_rates_left_out():
    """A block on an oblique guide of a cart of which the start says how fast it goes."""
    machine = Mechanism("wedge", ground={"O": (0, 0)})
    machine.add(
        mbody.Body("cart", mass=2.0, inertia=1.0, points={"O": (0, 0)}),
        mbody.Body("block", mass=1.0, inertia=1.0, points={"O": (0, 0)}),
        mbody.Prismatic("rail", "ground.O", "cart.O"),
        mbody.Prismatic(
            "guide", mbody.Marker("cart", (0, 0), 0.8), mbody.Marker("block", (0, 0), 0.8)
        ),
    )
    start = {"cart": {"x": 0, "vx": 1.0}, "block": {"x": 0.1}}
    machine.simulation = SimulationSettings(0.1, start, instants=2)
    return mbody.gradient(machine, "block.x", ["block.mass"], "simulate")


def of_a_stiff_motion():
    machine = hanging(simulation=SimulationSettings(1.0, {"bob": {"angle": 0.3}}, instants=2))
    machine.add(mbody.TorsionDamper("damper", "bob", coefficient=1e7))
    return mbody.gradient(machine, "last(bob.angle)", analysis="simulate", method="radau5")


def braked():
    return four_bar(Torque("brake", "rocker", value=1.0))


def with_friction():
    machine = Mechanism("a rough bar")
    machine.add(
        mbody.Body("bar", mass=1.0, cg=(0.4, 0.0)),
        mbody.Revolute("O", "ground", "bar", friction=0.3, pin_radius=0.05),
        mbody.Gravity("gravity", y=-9.81),
    )
    return machine


SCENARIOS = {
    "a gradient of a rest position that there is not": lambda: mbody.gradient(
        hanging(), "bob.angle", "bob.mass", "equilibrium", position=9
    ),
    "a gradient of a rest by friction": lambda: mbody.gradient(
        with_friction(), "bar.angle", "bar.mass", "equilibrium"
    ),
    "a gradient of a mode that there is not": lambda: mbody.gradient(
        hanging(), "frequency(2)", "bob.mass", "modes"
    ),
    "a gradient of modes by what is no measure of them": lambda: mbody.gradient(
        hanging(), "bob.angle", "bob.mass", "modes"
    ),
    "a gradient of a shape of a body that there is not": lambda: mbody.gradient(
        hanging(), "ratio(1, bob.x, rod.x)", "bob.mass", "modes"
    ),
    "a gradient of a shape by an amplitude that is zero": lambda: mbody.gradient(
        hanging(), "ratio(1, bob.angle, bob.y)", "bob.mass", "modes"
    ),
    "a gradient of a shape of a point that there is not": lambda: mbody.gradient(
        hanging(), "ratio(1, bob.P.x, bob.angle)", "bob.mass", "modes"
    ),
    "a gradient of a motion that ends at an impact": lambda: mbody.gradient(
        mbody.gallery.load("bouncing_ball"),
        "last(ball.y)",
        "e",
        "simulate",
        until=0.45152364098573067 + 1e-14,
    ),
    "a gradient by one number twice": lambda: mbody.gradient(
        braked(), "A.force", ["brake", "brake.value"]
    ),
    "a gradient by nothing": lambda: gradient(by=[]),
    "a gradient by what is no list": lambda: gradient(by=3),
    "a gradient by what is no name": lambda: gradient(by=[3]),
    "a gradient by a parameter of a table": lambda: mbody.gradient(
        mbody.gallery.load("cam_follower"), "contact.force", "lift"
    ),
    "a gradient of a batch": lambda: mbody.gradient(batch(), "A.force", ["crank.mass"]),
    "a gradient of a loss by friction": lambda: mbody.gradient(
        slider_crank(), "A.loss", "crank.A.x"
    ),
    "a gradient of another analysis": lambda: gradient(analysis="sweep"),
    "a gradient of a motion in steps with impulses": lambda: mbody.gradient(
        mbody.gallery.load("pile_of_discs"), "last(c1.y)", analysis="simulate", until=0.01
    ),
    "a gradient of a motion that begins by guesses": lambda: mbody.gradient(
        hanging(), "last(bob.angle)", analysis="simulate", until=0.1
    ),
    "a gradient of rates that the start leaves out": of_rates_left_out,
    "a gradient of a motion with rates": lambda: mbody.gradient(
        hanging(), "last(bob.angle)", analysis="simulate", until=0.1, rates={"bob": 1.0}
    ),
    "a gradient of a stiff motion": of_a_stiff_motion,
    "a prepared gradient with too few numbers": lambda: PreparedGradient(
        mbody.assemble(four_bar()), "A.force", ["crank.A.x", "coupler.B.x"]
    ).at([1.0]),
    "a gradient of histories and numbers": lambda: gradient(
        ["A.force", "peak(B.force)"], t=[0.0, 0.01]
    ),
    "a gradient at an instant that there is not": lambda: gradient("at(A.force, 3)"),
    "a gradient by a length of redundant loops": of_redundant_loops,
    "a measure that a gradient has not": lambda: gradient()["B.force"],
    "a sensitivity of a history": sensitivity,
    "a sensitivity of a batch": lambda: mbody.kinetostatics(batch()).sensitivity("A.force"),
    "a sensitivity of a free motion": of_a_motion,
    "a sensitivity in the command by a number that there is not": said(
        ["sensitivity", "norton_fourbar", "A.force", "--by", "crank.z"]
    ),
}

SENTENCES = r"""
a gradient of a rest position that there is not | ModelError | - | gradient: there is no rest position 9 of 'a pendulum', they are 0 to 1
a gradient of a rest by friction | ModelError | - | gradient: 'a rough bar' rests by friction, at any place of a band: there is no one position to be differentiated; leave out the friction
a gradient of a mode that there is not | ModelError | frequency(2) | gradient: 'frequency(2)': there are modes 1 to 1
a gradient of modes by what is no measure of them | ModelError | bob.angle | gradient: 'bob.angle' is no measure of modes: give 'frequency', 'natural_frequency', 'hertz', 'decay_rate', 'damping_ratio' with the number of a mode, such as frequency(1), ratio(1, bob.x, bob.angle) or phase of two amplitudes, or stiffness(bob) of what leads a free motion: 'bob'
a gradient of a shape of a body that there is not | ModelError | rod.x | gradient: 'ratio(1, bob.x, rod.x)': amplitudes are of the angle of a body, and of x and y of its mass centre or a point, such as bob.angle, bob.x or bob.origin.x, not 'rod.x' (bodies: 'bob')
a gradient of a shape by an amplitude that is zero | ModelError | ratio(1, bob.angle, bob.y) | gradient: 'ratio(1, bob.angle, bob.y)' divides by an amplitude that is zero: in mode 1 it does not move; take another one
a gradient of a shape of a point that there is not | ModelError | bob | gradient: 'ratio(1, bob.P.x, bob.angle)': 'bob' has no point 'P' (it has: 'origin')
a gradient of a motion that ends at an impact | SolveError | - | the motion of 'Bouncing ball' ends, but for rounding, where something changes, at t = 0.451524 s, as by an impact: it has no derivatives there; move its end
a gradient by one number twice | ModelError | brake.value | gradient: 'brake.value' is given twice in by: give it once
a gradient by nothing | ModelError | - | gradient: by is empty: name at least one number, or leave it out
a gradient by what is no list | ModelError | - | gradient: by must be names such as ["crank.A.x"], not 3
a gradient by what is no name | ModelError | 3 | gradient: by must be names such as ["crank.A.x"], not 3
a gradient by a parameter of a table | ModelError | lift | parameter 'lift' is used in a table, a program, a guess or g of 'Cam and roller follower', which a system cannot change: there is no derivative by it; describe the mechanism with another value
a gradient of a batch | ModelError | - | gradient takes one design: choose one of the batch with design(n)
a gradient of a loss by friction | ModelError | - | 'A.loss' has no exact derivatives: compiled code computes it without derivatives; vary the numbers by sweep
a gradient of another analysis | ModelError | - | gradient: there is no analysis 'sweep' with derivatives (there are: 'kinematics', 'kinetostatics', 'statics', 'simulate', 'equilibrium', 'modes')
a gradient of a motion in steps with impulses | ModelError | - | gradient: a motion with impulses in place of located impacts, as that of 'Pile of discs that friction holds', is not differentiated: compare designs by sweep
a gradient of a motion that begins by guesses | ModelError | - | gradient: how the motion of 'a pendulum' begins is not determined: 1 of its coordinates follow from guesses, which are no numbers: prescribe as many as are free in the start of its simulation, or give start, a result
a gradient of rates that the start leaves out | ModelError | block | gradient: the start of 'wedge' leaves out block.vx = 0.5146 m/s, which masses decide: give vx in the start of 'block'
a gradient of a motion with rates | ModelError | - | gradient: derivatives of a motion with rates are not there: prescribe the start in the simulation of the mechanism, or give start, a result
a gradient of a stiff motion | SolveError | - | the derivatives of the motion of 'a pendulum' cannot be followed beyond t = 0.0140… s, it is stiff there: keep more instants, or take differences by sweep
a prepared gradient with too few numbers | ModelError | - | gradient: 2 numbers are needed, not an array of the shape (1,)
a gradient of histories and numbers | ModelError | - | gradient: 'A.force' is a history of 2 instants, 'peak(B.force)' one number: give each a reduction such as peak(…) or mean(…), or none
a gradient at an instant that there is not | ModelError | at(A.force, 3) | 'at(A.force, 3)': there is no such instant, they are 0 to 0
a gradient by a length of redundant loops | SolveError | coupler.A2.x | 'Parallel cranks: one crank too many' closes redundant loops, or has wheels that fit, only with the numbers that it has of 'coupler.A2.x': there is no derivative by one of them alone; vary those that fit together by a parameter
a measure that a gradient has not | ModelError | B.force | there is no measure 'B.force' here (there are: 'A.force')
a sensitivity of a history | ModelError | - | sensitivity: 'A.force' is a history of 2 instants: say how it becomes one number, such as peak(A.force)
a sensitivity of a batch | ModelError | - | sensitivity is of one design: analyse one of the batch, system.design(n)
a sensitivity of a free motion | ModelError | - | sensitivity is of kinematics, kinetostatics and statics, not of simulate
a sensitivity in the command by a number that there is not | ModelError | crank.z | there is no number 'crank.z' (there are: 'crank.A.y', 'crank.A.x', 'crank.cg.r', 'crank.O2.y', 'crank.O2.x', 'crank.weight')
"""
