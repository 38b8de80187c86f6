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
    "instants in another unit": lambda: fit({"t [mm]": T, "rocker.angle": T}),
    "instants with gaps": lambda: fit({"t": [0.0, float("nan")], "rocker.angle": [1.0, 1.0]}),
    "a driver without its rate": lambda: fit(
        {"motor": T, "motor.acceleration": T, "rocker.angle": T}
    ),
    "runs of different columns": lambda: fit([data(), {"t": T, "coupler.angle": T}]),
    "a known number that there is not": lambda: fit(data(**{"crank.A.z": 1.0})),
    "an offset of no column": lambda: fit(offsets=["coupler.angle"]),
    "a deviation of nothing": lambda: fit(deviations={"rocker.angle": 0.0}),
    "a bound alone": lambda: fit(by={"crank.A.x": 1.0}),
    "bounds beside the start": lambda: fit(by={"crank.A.x": (2.0, 3.0)}),
    "bounds that hold everything": lambda: fit(by={"crank.A.x": (2.0, 2.0)}),
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

SENTENCES = r"""
a fit of a batch | ModelError | - | fit takes one design: choose one of the batch with design(n)
a fit of one datum | ModelError | - | fit: 1 data cannot determine 2 unknowns: measure more, or look for fewer
a fit of no number | ModelError | - | fit: name the unknown numbers, such as by=["crank.A.x"]
a fit of what a formula makes | ModelError | crank.A.x | 'crank.A.x' is made by the formula '2*a': name 'a' instead, or give 'crank.A.x' a number of its own by with_values
a fit of what changes nothing | ModelError | - | fit: none of 'crank.mass' changes any of the data: measure others
a fit with certainty | ModelError | - | fit: confidence is 1, it must lie between 0 and 1
a fit by another analysis | ModelError | - | fit: there is no analysis 'modes' (there are: 'kinematics', 'kinetostatics', 'statics', 'simulate')
no data | ModelError | - | fit: there are no data: give columns by name, or a CSV file
data that are none | ModelError | - | fit: data are columns by name, such as {"t": […], "slider.x [mm]": […]}, or a CSV file, not 3.0
data without instants | ModelError | - | fit: the data do not say their instants: give a column t, or of all drivers: 'motor' (there are: 'rocker.angle')
data without measures | ModelError | - | fit: the data have no measured column beside the instants
columns of different lengths | ModelError | - | fit: there are 3 of 't', 3 of 'rocker.angle', 1 of 'coupler.angle': give as many values of each column
a column of words | ModelError | - | fit: column 'coupler.angle' must be a row of numbers, not ['a', 'b', 'c']
a column without end | ModelError | coupler.angle | fit: column 'coupler.angle' has an infinite value: NaN is no datum
instants in another unit | ModelError | t | 't': unit: '1 mm' is a length (m), where a time (s) is wanted
instants with gaps | ModelError | t | fit: column 't' says the instants and has gaps: leave them out
a driver without its rate | ModelError | motor | fit: the data have 'motor.acceleration' and no 'motor.rate': give both
runs of different columns | ModelError | - | fit: run 2 has the columns 'coupler.angle', run 1 'rocker.angle': give each the same, in the same order; NaN is no datum
a known number that there is not | ModelError | crank.A.z | there is no number 'crank.A.z' to change (there are: 'crank.mass', 'crank.inertia', 'crank.cg.x', 'crank.cg.y', 'crank.O2.x', 'crank.O2.y', 'crank.A.x', 'crank.A.y')
an offset of no column | ModelError | coupler.angle | fit: there is no column 'coupler.angle' with an offset (there are: 'rocker.angle')
a deviation of nothing | ModelError | rocker.angle | fit: the deviation of 'rocker.angle' is 0.0: give each column a positive number
a bound alone | ModelError | crank.A.x | fit: 'crank.A.x' takes a pair (low, high), not 1.0
bounds beside the start | ModelError | crank.A.x | fit: 'crank.A.x' begins at 1 m, which is not between its bounds 2 and 3: give low, then high, about the number of the model
bounds that hold everything | ModelError | - | fit: equal bounds hold 'crank.A.x', and nothing is left to find: give one a range
bounds of another unit | ModelError | crank.A.x | fit: 'crank.A.x': '1 kg' is a mass (kg), where a length (m) is wanted
times that go back | ModelError | - | fit: the times of a free motion must rise from 0 on: sort the data, or begin where the motion does
times after the end | SolveError | - | fit: the motion is ended: at t = 0.5 s, 't - 0.5 s' is zero, at t = 0.5 s, data go on to 1 s: leave out those that come later
a data file without headings | ModelError | - | the data file 'run.csv' has no headings: its first row names what the columns are, such as "t" and "slider.x [mm]"
a data file of one row | ModelError | - | the data file 'run.csv' has 1 rows: give headings and 1 to 1000000 rows of data
a data file of words | ModelError | - | the data file 'run.csv': row 2, column 'rocker.angle' is no number: 'a'
a data file with a column twice | ModelError | - | the data file 'run.csv' has two columns 't': give each once
a data file with long rows | ModelError | - | the data file 'run.csv': row 2 has 3 cells, headings are 2
a data file in another script | ModelError | - | the data file 'run.csv' is no text of comma-separated values
a data file that is not there | ModelError | - | the data file 'none.csv' cannot be read: No such file or directory
a number that a fit has not | ModelError | coupler.B.x | the fit has no number 'coupler.B.x' (there are: 'crank.A.x')
a table of a fit with one bound | ModelError | - | model: line 34: fit: by.crank.A.x must be [low, high], not of 1 values
a table of a fit of a number that there is not | ModelError | - | model: line 34: fit: there is no number 'crank.A.z' to find (there are: 'crank.mass', 'crank.inertia', 'crank.cg.x', 'crank.cg.y', 'crank.O.x', 'crank.O.y', 'crank.A.x', 'crank.A.y')
a fit without unknowns | UsageError | - | choose the unknown numbers: --by NAMES, or by = [...] in a table [fit] of the file
"""
