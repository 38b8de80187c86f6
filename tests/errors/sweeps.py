"""Sweeps: which designs, what is measured, where the answers go."""

import contextlib
import shutil
import sys
import tempfile
from pathlib import Path
from types import SimpleNamespace
from unittest import mock

import mbody
from mbody.errors import SolveError
from mbody.files.saved import OPEN_SEAL
from mbody.model.simulation import Measure
from mbody.straight_line import programs
from mbody.sweeps import Normal, Uniform, latin_hypercube, monte_carlo, sobol, together
from tests.errors.command import said
from tests.errors.models import four_bar

CRANK = {"crank.A.x": [0.9, 1.1]}


def unbuilt(said):
    """A compiler of straight-line code that fails, with what it says last."""

    def go():
        failed = SimpleNamespace(returncode=1, stderr=said)
        with mock.patch.object(programs.subprocess, "run", lambda *_, **__: failed):
            programs.build(Path("code.so"), Path("code.none"), "host", {})

    return go


def sweep(parameters=CRANK, analysis="kinetostatics", measure="A.force", **options):
    return mbody.sweep(four_bar(), parameters, analysis, measure, **options)


def drawn(how):
    return sweep(monte_carlo({"crank.A.x": how}, 3))


def grid(values):
    return sweep({"crank.A.x": values})


def undriven():
    machine = four_bar()
    return mbody.sweep(machine.without("motor"), CRANK, measure="A.force")


def without_a_measure():
    return mbody.sweep(four_bar(), CRANK)


def reduced_again():
    machine = four_bar()
    machine.measures["pin"] = Measure("peak(A.force)")
    return mbody.sweep(machine, CRANK, measure="rms(pin)")


def of_a_batch():
    system = mbody.assemble(four_bar()).with_values({"crank.A.x": [0.9, 1.1]})
    return mbody.sweep(system, {"crank.mass": [1.0]}, measure="A.force")


def without(module, **options):
    with mock.patch.dict(sys.modules, {module: None}):
        return sweep(**options)


def without_pandas():
    found = sweep()
    with mock.patch.dict(sys.modules, {"pandas": None}):
        found.to_dataframe()


def cluster_that_is_silent():
    class Client:
        def __init__(self, *arguments, **options):
            raise OSError("timed out")

    with mock.patch.dict(sys.modules, {"distributed": SimpleNamespace(Client=Client)}):
        return sweep(scheduler="tcp://10.0.0.5:8786")


def with_arrow(folder, **options):
    """A folder that is looked at before anything is written to it."""
    arrow = SimpleNamespace(parquet=SimpleNamespace())
    found = {"pyarrow": arrow, "pyarrow.parquet": arrow.parquet}
    with mock.patch.dict(sys.modules, found):
        return sweep(to=folder, **options)


def in_a_file():
    with mock.patch("pathlib.Path.mkdir", side_effect=FileExistsError("File exists")):
        return with_arrow("results")


def with_manifest(text):
    """A sweep to a folder whose manifest is this."""
    with tempfile.TemporaryDirectory() as folder, contextlib.chdir(folder):
        Path("results").mkdir()
        Path("results", "sweep.json").write_text(text)
        return with_arrow("results")


def to_a_folder(meanwhile):
    """A sweep to a folder in which something happens before the first piece is written."""
    sweep()  # what it imports stays
    empty = mock.patch("mbody.sweeps.job.Store._content", lambda *_: OPEN_SEAL)
    begun = mock.patch("mbody.sweeps.job.Store._begin", meanwhile)
    with tempfile.TemporaryDirectory() as folder, contextlib.chdir(folder), empty, begun:
        kept = with_arrow("results")
        Path("results", "designs-000000000.parquet").unlink()
        return kept["A.force"]


def of_many_that_do_not_close():
    """What the last of many designs that do not close has as its reason: it is not searched for
    the smallest gap.
    """
    found = sweep({"crank.A.x": [30.0 + n for n in range(9)]})
    raise SolveError(found.failures[8])


def full(store, asked):
    shutil.rmtree(store.folder)


SCENARIOS = {
    "straight-line code of a compiler that was stopped": unbuilt(""),
    "a sweep of no name": said(["sweep", "hoekens"]),
    "a sweep from here to there": said(["sweep", "hoekens", "--vary", "a=1:2"]),
    "a sweep of a name that is no formula": said(["sweep", "hoekens", "--vary", "a=1 +:2:3"]),
    "a sweep of nothing": lambda: sweep({}),
    "an integral over no time": lambda: sweep(
        measure="integral(A.force)", drive={"motor": [0.1, 0.2]}
    ),
    "a sweep of one number twice": lambda: mbody.sweep(
        four_bar(mbody.Torque("brake", "rocker", value=1.0)),
        {"brake": [1.0], "brake.value": [2.0]},
        measure="A.force",
    ),
    "a sweep of no values": lambda: grid([]),
    "a sweep of text that is no length": lambda: grid(["3 kg"]),
    "a sweep of lists that do not fit": lambda: sweep(
        together({"crank.A.x": [0.9, 1.1], "crank.mass": [1.0, 2.0, 3.0]})
    ),
    "a grid that is too large": lambda: sweep(
        {name: range(1, 1000) for name in ("crank.mass", "coupler.mass", "rocker.mass")}
    ),
    "draws that are no number": lambda: latin_hypercube({"crank.A.x": (0.9, 1.1)}, 2.5),
    "draws of no design": lambda: sobol({"crank.A.x": (0.9, 1.1)}, 0),
    "a draw of one value": lambda: drawn(1.0),
    "a scatter of less than nothing": lambda: drawn(Uniform(-0.1)),
    "a scatter without a width": lambda: Uniform(),
    "a scatter of two widths": lambda: Normal(tolerance=0.1, deviation=0.1),
    "a sweep that measures nothing": without_a_measure,
    "a sweep of a measure that is a number": lambda: sweep(measure=3),
    "a sweep of measures that are numbers": lambda: sweep(measure=[3]),
    "a sweep of a measure twice": lambda: sweep(measure=["A.force", "A.force"]),
    "a sweep of a reduced measure, reduced again": reduced_again,
    "a sweep at no instant": lambda: sweep(measure="at(A.force, 0.1)"),
    "a sweep at an instant that there is not": lambda: sweep(measure="at(A.force, 3)"),
    "a sweep by an unknown analysis": lambda: sweep(analysis="dynamics"),
    "a sweep by an option that there is not": lambda: sweep(until=3.0),
    "a sweep of a batch": of_a_batch,
    "a sweep of histories of free motions": lambda: sweep(analysis="simulate", until=1.0),
    "a sweep of no threads": lambda: sweep(threads=0),
    "a sweep without drivers": undriven,
    "a quantity that a sweep did not measure": lambda: sweep()["B.force"],
    "a parameter that a sweep did not have": lambda: sweep().parameter("crank.mass"),
    "a design that a sweep did not have": lambda: sweep().design(7),
    "a table of a sweep without pandas": without_pandas,
    "a sweep of many designs that do not close": of_many_that_do_not_close,
    "a sweep to a folder without pyarrow": lambda: without("pyarrow", to="results"),
    "a sweep to a folder that is a file": in_a_file,
    "a sweep to the folder of another": lambda: with_manifest("{}"),
    "a sweep to a folder with half a manifest": lambda: with_manifest("{"),
    "a sweep to a folder that goes away": lambda: to_a_folder(full),
    "a piece that goes away": lambda: to_a_folder(lambda store, asked: None),
    "a sweep of a measure with a name of the table": lambda: sweep(measure={"error": "A.force"}),
    "a sweep on a cluster without distributed": lambda: without(
        "distributed", scheduler="tcp://10.0.0.5:8786"
    ),
    "a sweep on a cluster that is not there": cluster_that_is_silent,
}

SENTENCES = r"""
straight-line code of a compiler that was stopped | ModelWarning | - | straight-line code could not be built (it ended with 1): analyses of this mechanism take about three times as long
a sweep of no name | UsageError | - | choose what differs between designs: --vary NAME=LOW:HIGH:COUNT
a sweep from here to there | UsageError | - | --vary takes LOW:HIGH:COUNT, or values with commas, not '1:2'
a sweep of a name that is no formula | ModelError | a | --vary a: '1 +' ends where a number is expected
a sweep of nothing | ModelError | - | sweep: parameters must be a dict of names such as {"crank.A.x": [1.0, 1.1]}, not {}
an integral over no time | ModelError | - | integral: no time passes over the instants, 2 of them: give times, as t, or a turn of a driver that has a rate; mean(…) needs none
a sweep of one number twice | ModelError | - | sweep: brake, brake.value: name each number once
a sweep of no values | ModelError | crank.A.x | sweep: 'crank.A.x' needs finite values, at least one
a sweep of text that is no length | ModelError | crank.A.x | sweep: 'crank.A.x': '3 kg' is a mass (kg), where a length (m) is wanted
a sweep of lists that do not fit | ModelError | - | sweep: there are 2 of 'crank.A.x' and 3 of 'crank.mass': give as many values of each
a grid that is too large | ModelError | - | sweep: the grid has 9.97e+08 designs, at most 1e+08 are possible: use fewer values, or random designs with sobol
draws that are no number | ModelError | - | latin hypercube: count must be a whole number from 1 to 100000000, not 2.5
draws of no design | ModelError | - | sobol: count must be a whole number from 1 to 100000000, not 0
a draw of one value | ModelError | crank.A.x | sweep: 'crank.A.x' needs (low, high), or a Normal, Uniform or Triangular distribution, not 1.0
a scatter of less than nothing | ModelError | crank.A.x | sweep: the width of 'crank.A.x' is -0.1: give 0 or more
a scatter without a width | ModelError | - | Uniform has no width: give tolerance
a scatter of two widths | ModelError | - | Normal takes one width: give either tolerance or deviation
a sweep that measures nothing | ModelError | - | sweep: name a measure, such as measure="peak(A.force)": 'four-bar' has no measures of its own
a sweep of a measure that is a number | ModelError | - | sweep: measure must be text, a list or a dict, not 3
a sweep of measures that are numbers | ModelError | - | sweep: a measure is text, a Measure, or a pair of one and of max, min, peak, span, rms, mean, integral, first, last, not 3
a sweep of a measure twice | ModelError | - | sweep: measures [A.force, A.force]: give each once, at least one
a sweep of a reduced measure, reduced again | ModelError | - | sweep: 'pin' is one number of all instants already, peak(A.force): leave 'rms' out
a sweep at no instant | ModelError | - | sweep: 'at(A.force, 0.1)': at takes a quantity and the number of an instant, as in at(A.force, 0)
a sweep at an instant that there is not | ModelError | - | sweep: 'at(A.force, 3)': there is no such instant, they are 0 to 0
a sweep by an unknown analysis | ModelError | - | sweep: there is no analysis 'dynamics' (there are: 'kinematics', 'kinetostatics', 'statics', 'simulate')
a sweep by an option that there is not | ModelError | - | sweep: kinetostatics takes no 'until' (it takes: t, drive, turn, instants, turns, guess, at, over)
a sweep of a batch | ModelError | - | sweep takes one design: its parameters make the others
a sweep of histories of free motions | ModelError | - | sweep: 'A.force' of a free motion is a history: say how it becomes one number, such as last(A.force)
a sweep of no threads | ModelError | - | threads must be a whole number from 1 on, not 0
a sweep without drivers | SolveError | - | kinetostatics needs 0 free degrees of freedom, 'four-bar' has 1 degree left: add a driver, for example on 'crank'
a quantity that a sweep did not measure | ModelError | B.force | the sweep has no 'B.force' (there are: 'A.force')
a parameter that a sweep did not have | ModelError | crank.mass | 'crank.mass' is not a parameter of the sweep (there are: 'crank.A.x')
a design that a sweep did not have | ModelError | - | there is no design 7: give 0 to 1
a table of a sweep without pandas | ModelError | - | a table of a sweep needs pandas, which is not installed: pip install pandas
a sweep of many designs that do not close | SolveError | - | loops do not close at t = 0 s: from the numbers of the description to those of this design they do for 12.8% of the way; analyse it alone to see the gap
a sweep to a folder without pyarrow | ModelError | - | a sweep to a folder needs pyarrow, which is not installed: pip install "mbody-planar[data]"
a sweep to a folder that is a file | ModelError | - | cannot write a sweep to 'results' (File exists): choose a writable folder
a sweep to the folder of another | ModelError | - | 'results' contains another sweep, with other model, parameters, samples, designs, analysis, instants, measures, piece, version: choose another folder, or delete this one
a sweep to a folder with half a manifest | ModelError | - | 'results/sweep.json' is damaged: delete it, and run the same sweep again; matching results are kept
a sweep to a folder that goes away | ModelError | - | cannot write a sweep to 'results' (No such file or directory): choose a writable folder
a piece that goes away | ModelError | - | 'results/designs-000000000.parquet' was changed or deleted since the sweep wrote it: run the same sweep again to compute what is missing
a sweep of a measure with a name of the table | ModelError | - | sweep: a measure cannot have the name 'error', which is a column of every table: choose another
a sweep on a cluster without distributed | ModelError | - | work on a cluster needs Dask's distributed, which is not installed: pip install "mbody-planar[cluster]"
a sweep on a cluster that is not there | SolveError | - | no scheduler can be reached at 'tcp://10.0.0.5:8786' (OSError): start one with 'dask scheduler', and workers that have mbody
"""
