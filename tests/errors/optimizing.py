"""Optimization: of what, by which numbers, within which limits, and where there is no design."""

import contextlib
import tempfile
from pathlib import Path

import mbody
from mbody.model.simulation import OptimizationTask, SimulationSettings
from tests.errors.command import said
from tests.errors.models import by_law, four_bar
from tests.support.frictional import slider_crank


def optimize(minimize="peak(A.force)", by=None, machine=None, **options):
    by = {"crank.A.x": (0.8, 1.2)} if by is None else by
    options = {"over": "turn", "instants": 19, "starts": 1, **options}
    return mbody.optimize(machine or four_bar(), minimize=minimize, by=by, **options)


def of_a_batch():
    system = mbody.assemble(four_bar()).with_values({"crank.A.x": [0.9, 1.1]})
    return optimize(machine=system)


def in_the_command(*words):
    """The command with a model file of two tasks."""
    task = 'minimize = "peak(A.force)"\nby = { "crank.A.x" = [0.8, 1.2] }\n'
    text = mbody.to_toml(four_bar()) + f"\n[optimize.best]\n{task}\n[optimize.other]\n{task}"

    def go():
        with tempfile.TemporaryDirectory() as folder, contextlib.chdir(folder):
            Path("mine.toml").write_text(text)
            said(["optimize", "mine.toml", *words])()

    return go


def of_motions():
    """Motions that an event ends, all of them elsewhere than that of the description."""
    machine = mbody.Mechanism("oscillator", ground={"O": (0.0, 0.0)})
    machine.add(
        mbody.Body("block", mass=1.0, inertia=1.0, points={"P": (0.0, 0.0)}),
        mbody.Prismatic("guide", "ground.O", "block.P"),
        mbody.Spring("spring", "ground.O", "block.P", stiffness=6.0),
    )
    machine.simulation = SimulationSettings(
        0.6, {"block": {"x": 0.3}}, events=[mbody.Event("block.x", stop=True)]
    )
    mbody.optimize(
        machine,
        minimize="last(block.x)",
        by={"spring.stiffness": (10.0, 16.0)},
        analysis="simulate",
        starts=1,
    )


SCENARIOS = {
    "an optimization of a batch": of_a_batch,
    "an optimization of nothing": lambda: optimize(None),
    "an optimization of three aims": lambda: optimize(["A.force", "B.force", "O2.force"]),
    "an optimization of a history": lambda: optimize("A.force"),
    "an optimization at an instant that there is not": lambda: optimize("at(A.force, 30)"),
    "an optimization with one bound": lambda: optimize(by={"crank.A.x": 1.0}),
    "an optimization with reversed bounds": lambda: optimize(by={"crank.A.x": (1.2, "80 cm")}),
    "an optimization with a bound of another kind": lambda: optimize(
        by={"crank.A.x": ("1 N", "2 N")}
    ),
    "an optimization with an infinite bound": lambda: optimize(
        by={"crank.A.x": (1.0, float("inf"))}
    ),
    "an optimization with a negative mass": lambda: optimize(by={"crank.mass": (-1.0, 1.0)}),
    "an optimization with a start that is none": lambda: optimize(start=3),
    "an optimization with a start of another number": lambda: optimize(start={"rocker.B.x": 2.0}),
    "an optimization with a start beyond its bounds": lambda: optimize(start={"crank.A.x": 2.0}),
    "an optimization of another analysis": lambda: optimize(analysis="modes"),
    "an optimization of motions that end elsewhere": of_motions,
    "an optimization with an option that there is not": lambda: optimize(until=3.0),
    "an optimization with a limit that is no text": lambda: optimize(subject_to=[3]),
    "an optimization with a limit that is none": lambda: optimize(subject_to="B.force"),
    "an optimization with half a limit": lambda: optimize(subject_to="B.force <="),
    "an optimization with a history that equals a number": lambda: optimize(
        subject_to="B.force = 2 N"
    ),
    "an optimization that no number changes": lambda: optimize(
        "peak(rocker.angle)", by={"crank.mass": (1.0, 2.0)}
    ),
    "an optimization whose limits no design meets": lambda: optimize(
        subject_to="peak(A.force) <= 1 uN"
    ),
    "an optimization of what is no number": lambda: optimize("peak(log(-A.force/(1 N)))"),
    "an optimization of a loss by friction": lambda: optimize(
        "mean(A.loss)", {"A.friction": (0.05, 0.2)}, slider_crank()
    ),
    "the description of an optimum whose number no file has": lambda: (
        optimize(
            by={"crank.A.x": (0.8, 1.2), "motor.law.c0": (0.5, 1.0)},
            machine=by_law("0.5 + 2*t/(1 s) + 0.25*sin(3*t/(1 s))"),
        ).mechanism
    ),
    "an optimization without a design that closes": lambda: optimize(by={"crank.A.x": (30, 40)}),
    "an optimization of a name that there is not": lambda: mbody.optimize(four_bar(), "best"),
    "a task of optimization with an aim that is no text": lambda: OptimizationTask(minimize=[3]),
    "an optimization in the command that there is not": in_the_command("third"),
    "an optimization in the command without bounds": in_the_command("--minimize", "peak(A.force)"),
    "an optimization in the command without an aim": in_the_command("--starts", "3"),
    "an optimization in the command that the file has": in_the_command(
        "best", "--maximize", "peak(A.force)", "--by", "crank.A.x=0.8:1.2"
    ),
    "optimizations in the command to one file": in_the_command("--csv", "numbers.csv"),
    "an optimization in the command of a model without": said(["optimize", "norton_fourbar"]),
}

SENTENCES = r"""
an optimization of a batch | ModelError | - | optimize takes one design: choose one of the batch with design(n)
an optimization of nothing | ModelError | - | optimize: say what is to be least or greatest, such as minimize="peak(motor.effort)"
an optimization of three aims | ModelError | - | optimize: there are 3 aims: give one, or two for their Pareto front, and make limits of the others by subject_to
an optimization of a history | ModelError | - | optimize: 'A.force' is a history of 19 instants: say what of it is to be least, such as minimize="peak(A.force)"
an optimization at an instant that there is not | ModelError | - | optimize: 'at(A.force, 30)': there is no such instant, they are 0 to 18
an optimization with one bound | ModelError | crank.A.x | optimize: 'crank.A.x' takes a pair (low, high), not 1.0
an optimization with reversed bounds | ModelError | crank.A.x | optimize: 'crank.A.x' goes from 1.2 to 0.8 m: give low, then high
an optimization with a bound of another kind | ModelError | crank.A.x | optimize: 'crank.A.x': '1 N' is a force (N), where a length (m) is wanted
an optimization with an infinite bound | ModelError | crank.A.x | optimize: 'crank.A.x' is inf, it must be finite
an optimization with a negative mass | ModelError | crank.mass | optimize: 'crank.mass' goes from -1 kg, it must not be negative: give a greater lowest value
an optimization with a start that is none | ModelError | - | optimize: start must be a dict of numbers, not 3
an optimization with a start of another number | ModelError | rocker.B.x | optimize: start has 'rocker.B.x', which by does not vary (it varies: 'crank.A.x')
an optimization with a start beyond its bounds | ModelError | crank.A.x | optimize: start of 'crank.A.x' is 2, beyond its bounds 0.8 to 1.2
an optimization of another analysis | ModelError | - | optimize: there is no analysis 'modes' with derivatives (there are: 'kinematics', 'kinetostatics', 'statics', 'simulate')
an optimization of motions that end elsewhere | SolveError | - | optimize: none of 4 designs within the bounds can be analysed at all instants with derivatives; at the start: the motion ends at t = 0.496729 s after 167 instants, that of the description has 201: leave out the event that ends it, or choose a shorter time; give other bounds
an optimization with an option that there is not | ModelError | - | optimize: kinetostatics has no option 'until' (there are: t, drive, turn, instants, turns, guess, at, over)
an optimization with a limit that is no text | ModelError | - | optimize: subject_to takes texts, not 3
an optimization with a limit that is none | ModelError | - | optimize: 'B.force' is not a limit such as 'peak(motor.effort) <= 20 N*m'
an optimization with half a limit | ModelError | - | optimize: 'B.force <=' is not a limit such as 'peak(motor.effort) <= 20 N*m': a side of it is empty
an optimization with a history that equals a number | ModelError | - | optimize: 'B.force = 2 N': 'B.force' is a history of 19 instants, which cannot be equal to a number at all: name one, such as first(B.force)
an optimization that no number changes | ModelError | - | optimize: none of 'crank.mass' changes 'peak(rocker.angle)': its derivatives are zero; vary other numbers, or choose another aim
an optimization whose limits no design meets | SolveError | - | optimize: no design within the bounds meets all limits: 'peak(A.force) <= 1 uN' is missed by 3.874 N at the nearest, crank.A.x = 0.8: give it more, or widen the bounds
an optimization of what is no number | SolveError | - | optimize: none of 256 designs within the bounds can be analysed at all instants with derivatives; at the start: the quantities have no finite value there; give other bounds
an optimization of a loss by friction | ModelError | - | optimize: 'A.loss' has no exact derivatives: compiled code computes it without derivatives; choose another quantity, or vary the numbers by sweep
the description of an optimum whose number no file has | ModelError | motor.law.c0 | the model file of 'four-bar' has no number of its own for 'motor.law.c0': name a parameter for it; run.system has the numbers of the design
an optimization without a design that closes | SolveError | - | optimize: none of 256 designs within the bounds can be analysed at all instants with derivatives; at the start: loops do not close at t = 0 s: the smallest gap is 23.41 m at 'A' (between 'crank' and 'coupler'): check lengths, or give a better guess; give other bounds
an optimization of a name that there is not | ModelError | best | 'four-bar' has no optimization 'best' (it has: none)
a task of optimization with an aim that is no text | ModelError | - | optimization: minimize takes texts, not 3
an optimization in the command that there is not | ModelError | third | 'four-bar' has no optimization 'third' (it has: 'best', 'other')
an optimization in the command without bounds | UsageError | - | choose the numbers that may change: --by NAME=LOW:HIGH
an optimization in the command without an aim | UsageError | - | --starts needs --minimize or --maximize: what is to be best
an optimization in the command that the file has | UsageError | - | --minimize and --maximize make a task of their own: leave out 'best'
optimizations in the command to one file | ModelError | - | 'four-bar' has 2 optimizations ('best', 'other'): name the one that is to be written
an optimization in the command of a model without | ModelError | - | 'Four-bar: dynamic force analysis' has nothing to optimize: give --minimize and --by, or its file a table [optimize.NAME] with minimize, by and subject_to
"""
