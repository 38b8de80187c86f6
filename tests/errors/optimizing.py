"""Optimization: of what, by which numbers, within which limits, and where there is no design."""

import contextlib
import tempfile
from pathlib import Path

import mbody
from mbody import Mechanism
from mbody.model.simulation import SimulationSettings
from mbody.model.study import OptimizationTask
from tests.errors.command import said
from tests.errors.derivatives import with_parameters
from tests.errors.models import four_bar
from tests.rough import slider_crank


def optimize(minimize="peak(A.force)", by=None, machine=None, **options):
    by = {"crank.A.x": (0.8, 1.2)} if by is None else by
    options = {"over": "turn", "instants": 19, "starts": 1, **options}
    return mbody.optimize(machine or four_bar(), minimize=minimize, by=by, **options)


def of_a_batch():
    system = mbody.assemble(four_bar()).with_values({"crank.A.x": [0.9, 1.1]})
    return optimize(machine=system)


def of_a_file(table):
    """A file with one task."""
    return mbody.from_toml(mbody.to_toml(four_bar()) + f"\n[optimize.best]\n{table}\n")


def in_the_command(*words):
    """The command with a model file of two tasks."""
    task = 'minimize = "peak(A.force)"\nby = { "crank.A.x" = [0.8, 1.2] }\n'
    text = mbody.to_toml(four_bar()) + f"\n[optimize.best]\n{task}\n[optimize.other]\n{task}"

    def go():
        with tempfile.TemporaryDirectory() as folder, contextlib.chdir(folder):
            Path("mine.toml").write_text(text)
            said(["optimize", "mine.toml", *words])()

    return go


def of_one_parameter():
    """The best of two lengths that a file makes of one parameter, as a description."""
    machine = Mechanism("crank", parameters={"a": 0.5}, ground={"O": (0, 0)})
    machine.add(
        mbody.Body("crank", mass=1.0, cg=("a", 0), points={"A": ("2*a", 0)}),
        mbody.Revolute("O", "ground.O", "crank"),
        mbody.Force("load", "crank.A", 100.0),
        mbody.AngleDriver("motor", "crank", mbody.laws.ConstantSpeed(0.5, 10.0)),
    )
    system = mbody.assemble(machine).with_values({"crank.A.x": 1.0, "crank.cg.x": 0.5})
    by = {"crank.A.x": (0.8, 1.2), "crank.cg.x": (0.1, 0.2)}
    return optimize("peak(O.force)", by, system).mechanism


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
    "an optimization without bounds": lambda: optimize(by=3),
    "an optimization with one bound": lambda: optimize(by={"crank.A.x": 1.0}),
    "an optimization with reversed bounds": lambda: optimize(by={"crank.A.x": (1.2, "80 cm")}),
    "an optimization with a bound of another kind": lambda: optimize(
        by={"crank.A.x": ("1 N", "2 N")}
    ),
    "an optimization with an infinite bound": lambda: optimize(
        by={"crank.A.x": (1.0, float("inf"))}
    ),
    "an optimization with a negative mass": lambda: optimize(by={"crank.mass": (-1.0, 1.0)}),
    "an optimization by a number that there is not": lambda: optimize(by={"crank.A.z": (1, 2)}),
    "an optimization by a number that a formula makes": lambda: optimize(machine=with_parameters()),
    "an optimization with a start that is none": lambda: optimize(start=3),
    "an optimization with a start of another number": lambda: optimize(start={"rocker.B.x": 2.0}),
    "an optimization with a start beyond its bounds": lambda: optimize(start={"crank.A.x": 2.0}),
    "an optimization with no starts": lambda: optimize(starts=0),
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
        optimize(by={"crank.A.x": (0.8, 1.2), "A.j.angle": (0.0, 1.0)}).mechanism
    ),
    "the description of an optimum of two numbers by one parameter": of_one_parameter,
    "an optimization without a design that closes": lambda: optimize(by={"crank.A.x": (30, 40)}),
    "an optimization of a name that there is not": lambda: mbody.optimize(four_bar(), "best"),
    "an optimization of a file by a number that there is not": lambda: of_a_file(
        'minimize = "peak(A.force)"\nby = { "crunk.A.x" = [1, 2] }'
    ),
    "an optimization of a file with one bound": lambda: of_a_file(
        'minimize = "peak(A.force)"\nby = { "crank.A.x" = [1] }'
    ),
    "an optimization of a file without numbers": lambda: of_a_file('minimize = "peak(A.force)"'),
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
