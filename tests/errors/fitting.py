"""Fits of numbers to measured histories."""

import contextlib
import tempfile
from pathlib import Path

import mbody
from tests.errors.command import said
from tests.errors.derivatives import with_parameters
from tests.errors.models import four_bar

T = [0.0, 0.01, 0.02]


def data(**more):
    return {"t": T, "rocker.angle": [1.0, 1.1, 1.2], **more}


def fit(columns=None, by="crank.A.x", machine=None, **options):
    return mbody.fit(machine or four_bar(), data() if columns is None else columns, by, **options)


def file(text):
    """A fit of the columns of a file."""

    def run():
        with tempfile.TemporaryDirectory() as folder, contextlib.chdir(folder):
            Path("run.csv").write_text(text, encoding="latin-1")
            fit("run.csv")

    return run


def batch():
    system = mbody.assemble(four_bar()).with_values({"crank.A.x": [0.9, 1.1]})
    return mbody.fit(system, data(), "crank.mass")


def pendulum(columns, **options):
    return mbody.fit(mbody.gallery.load("simple_pendulum"), columns, "pendulum.mass", **options)


def fallen():
    """A motion that an event ends before the data do."""
    machine = mbody.gallery.load("simple_pendulum")
    end = mbody.Event("t - 0.5 s", stop=True)
    columns = {"t": [0.1, 0.2, 1.0], "pendulum.angle": [3.1, 3.0, 2.0]}
    return mbody.fit(machine, columns, "gravity.y", events=[end])


def of_a_table(text):
    """A file that says what is fitted."""
    return mbody.from_toml(mbody.to_toml(mbody.makers.slider_crank(0.1, 0.3)) + f"\n[fit]\n{text}")


SCENARIOS = {
    "a fit of a batch": batch,
    "a fit of one datum": lambda: fit(
        {"t": [0.0], "rocker.angle": [1.0]}, ["crank.A.x", "coupler.B.x"]
    ),
    "a fit of no number": lambda: fit(by=None),
    "a fit of a number that there is not": lambda: fit(by="crank.A.z"),
    "a fit of what a formula makes": lambda: fit(by="crank.A.x", machine=with_parameters()),
    "a fit of what changes nothing": lambda: fit(by="crank.mass"),
    "a fit with certainty": lambda: fit(confidence=1.0),
    "a fit by another analysis": lambda: fit(analysis="modes"),
    "no data": lambda: fit([]),
    "data that are none": lambda: fit(3.0),
    "data without instants": lambda: fit({"rocker.angle": [1.0, 1.1]}),
    "data without measures": lambda: fit({"t": T}),
    "columns of different lengths": lambda: fit(data(**{"coupler.angle": [1.0]})),
    "a column of words": lambda: fit(data(**{"coupler.angle": ["a", "b", "c"]})),
    "a column without end": lambda: fit(data(**{"coupler.angle": [1.0, float("inf"), 0.0]})),
    "a column of no quantity": lambda: fit(data(**{"wheel.angle": T})),
    "a column in another unit": lambda: fit({"t": T, "rocker.angle [mm]": T}),
    "instants in another unit": lambda: fit({"t [mm]": T, "rocker.angle": T}),
    "instants with gaps": lambda: fit({"t": [0.0, float("nan")], "rocker.angle": [1.0, 1.0]}),
    "a driver without its rate": lambda: fit(
        {"motor": T, "motor.acceleration": T, "rocker.angle": T}
    ),
    "runs of different columns": lambda: fit([data(), {"t": T, "coupler.angle": T}]),
    "a known number that there is not": lambda: fit(data(**{"crank.A.z": 1.0})),
    "an offset of no column": lambda: fit(offsets=["coupler.angle"]),
    "a deviation of nothing": lambda: fit(deviations={"rocker.angle": 0.0}),
    "a deviation of no column": lambda: fit(deviations={"rocker.angle": 0.1, "coupler.angle": 0.1}),
    "a bound alone": lambda: fit(by={"crank.A.x": 1.0}),
    "bounds beside the start": lambda: fit(by={"crank.A.x": (2.0, 3.0)}),
    "bounds of another unit": lambda: fit(by={"crank.A.x": ("1 kg", "2 kg")}),
    "times that go back": lambda: pendulum({"t": [0.2, 0.1], "pendulum.angle": [3.0, 3.1]}),
    "times after the end": fallen,
    "a data file without headings": file("0,1\n1,2\n"),
    "a data file of one row": file("t,rocker.angle\n"),
    "a data file of words": file("t,rocker.angle\n0,a\n"),
    "a data file with a column twice": file("t,t\n0,1\n"),
    "a data file with long rows": file("t,rocker.angle\n0,1,2\n"),
    "a data file in another script": file("t,rocker.angle\n0,\xe9\n"),
    "a data file that is not there": lambda: fit("none.csv"),
    "a number that a fit has not": lambda: fit(data())["coupler.B.x"],
    "a table of a fit with one bound": lambda: of_a_table('by = { "crank.A.x" = [0.1] }'),
    "a table of a fit of a number that there is not": lambda: of_a_table('by = ["crank.A.z"]'),
    "a fit without unknowns": said(["fit", "norton_fourbar", "none.csv"]),
}
