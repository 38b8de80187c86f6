"""Linkages as arrays: shapes, types, graphs that are no mechanism, data sets of them."""

import contextlib
import json
import sys
import tempfile
from dataclasses import asdict
from pathlib import Path
from unittest import mock

import numpy as np

import mbody
from mbody.errors import SolveError
from mbody.topologies.dataset import LinkageSet, write_linkages
from tests.errors.command import said

FOUR_BAR = {
    "joints": [[(0, 0), (1, 0), (3, 2), (4, 0)]],
    "links": [[(0, 1), (1, 2), (2, 3)]],
    "ground": [(0, 3)],
    "driver": [0],
}


def linkages(options=None, **arrays):
    return mbody.linkages(FOUR_BAR | arrays, **({"instants": 11} | (options or {})))


def without(name):
    return mbody.linkages({key: part for key, part in FOUR_BAR.items() if key != name})


def reason(**arrays):
    """The sentence in the row of a linkage, as an error."""
    raise SolveError(linkages(**arrays).failures[0])


def small_memory(function, where):
    with mock.patch(where, lambda: 1e3):
        return function()


def data_set(folder=None, manifest=None, **options):
    """A data set in an empty folder, or one with this manifest."""
    with tempfile.TemporaryDirectory() as empty, contextlib.chdir(empty):
        Path("set").mkdir()
        if manifest is not None:
            Path("set", "_linkages.json").write_text(manifest)
        threads = options.pop("threads", 1)
        return write_linkages(
            folder or "set", LinkageSet(**({"count": 5, "instants": 5} | options)), threads=threads
        )


def without_arrow():
    with mock.patch.dict(sys.modules, {"pyarrow": None, "pyarrow.parquet": None}):
        return data_set()


def in_a_file():
    with mock.patch("pathlib.Path.mkdir", side_effect=FileExistsError("File exists")):
        return write_linkages("set", LinkageSet(5))


def fruitless():
    """No triad of so many turns the crank: none is drawn."""
    none = mock.patch(
        "mbody.topologies.dataset.random_linkages", lambda *_: {"joints": np.zeros((0, 8, 2))}
    )
    with none:
        return data_set()


SCENARIOS = {
    "linkages that are no dict": lambda: mbody.linkages([1, 2]),
    "linkages without joints": lambda: without("joints"),
    "linkages of an array that there is not": lambda: linkages(weights=[1.0]),
    "linkages of rows of different length": lambda: linkages(links=[[(0, 1), (1, 2, 3)]]),
    "linkages of joints without a y": lambda: linkages(joints=[[0.0, 1.0, 2.0, 3.0]]),
    "linkages of half joints": lambda: linkages(links=[[(0.5, 1), (1, 2), (2, 3)]]),
    "linkages that turn by nothing": lambda: linkages({"turn": 0.0}),
    "linkages with two turns for one driver": lambda: linkages({"turn": [[1.0, 2.0]]}),
    "a linkage that two drivers hold": lambda: reason(driver=[(0, 2)]),
    "linkages of two speeds for one": lambda: linkages({"speed": [1.0, 2.0]}),
    "linkages of no speed": lambda: linkages({"speed": float("nan")}),
    "linkages in a field without a direction": lambda: linkages({"gravity": 9.81}),
    "linkages that do not fit into memory": lambda: small_memory(
        linkages, "mbody.topologies.many_linkages.memory"
    ),
    "a linkage that is no mechanism": lambda: reason(ground=[(0, -1)]),
    "a linkage that moves and is held twice": lambda: reason(
        joints=[[(0, 0), (1, 0), (2, 0), (1, 1), (2, 1), (3, 3)]],
        links=[[(0, 1), (2, 3), (2, 4), (3, 4), (2, 5)]],
        ground=[(0, 2, 3, -1)],
    ),
    "a linkage that does not turn": lambda: reason(joints=[[(0, 0), (1, 0), (1.5, 0.5), (1.8, 0)]]),
    "a linkage without a joint": lambda: reason(links=[[(0, 1), (1, 2), (2, 9)]]),
    "a linkage of no length": lambda: reason(joints=[[(0, 0), (0, 0), (0, 0), (0, 0)]]),
    "random linkages of unknown groups": lambda: data_set(groups=("tetrads",)),
    "random linkages of no groups": lambda: data_set(groups=()),
    "random linkages of too few joints": lambda: data_set(groups=("triads",), nodes=5),
    "random linkages of triads that do not fit": lambda: data_set(groups=("triads",), nodes=7),
    "a data set that does not turn": lambda: data_set(turn=0.0),
    "a data set of more joints than memory": lambda: small_memory(
        data_set, "mbody.topologies.dataset.memory"
    ),
    "a data set without pyarrow": without_arrow,
    "a data set in a file": in_a_file,
    "a data set in the folder of another": lambda: data_set(
        manifest=json.dumps(asdict(LinkageSet(7)))
    ),
    "a data set with half a manifest": lambda: data_set(manifest="{"),
    "a data set of linkages that never turn": fruitless,
    "the third of two parts of a data set": said(["linkages", "--to", "set", "--part", "3/2"]),
    "a part of a data set that is a word": said(["linkages", "--to", "set", "--part", "half"]),
}

SENTENCES = r"""
linkages that are no dict | ModelError | - | linkages takes a dict of arrays ('joints', 'links', 'ground', 'driver'), not list
linkages without joints | ModelError | - | the array 'joints' of the linkages is missing: give it
linkages of an array that there is not | ModelError | - | linkages know no array 'weights' (there are: 'joints', 'links', 'ground', 'driver', 'mass', 'inertia', 'cg', 'slides' and 1 more)
linkages of rows of different length | ModelError | - | 'links' of the linkages is no array: its rows differ in length
linkages of joints without a y | ModelError | - | 'joints' of the linkages has the shape (1, 4): give (any, any, 2)
linkages of half joints | ModelError | - | 'links' of the linkages has the type float64: give whole numbers
linkages that turn by nothing | ModelError | - | turn is 0: the driver must turn, give an angle [rad]
linkages with two turns for one driver | ModelError | - | turn must be a finite number, one for each of 1 linkages, or an array (1, 1), one for each driver
a linkage that two drivers hold | SolveError | - | its drivers and joints hold it once too often: it is no mechanism
linkages of two speeds for one | ModelError | - | speed must be a number, or one for each of 1 linkages
linkages of no speed | ModelError | - | speed must be finite
linkages in a field without a direction | ModelError | - | gravity must be a pair of numbers (x, y), not 9.81
linkages that do not fit into memory | ModelError | - | 1 linkages at 11 instants take 1.85e-06 GB, this machine has 1e-06 GB of memory: give fewer at a time, or write a data set
a linkage that is no mechanism | SolveError | - | with its driver it keeps 2 degrees of freedom: it is no mechanism
a linkage that moves and is held twice | SolveError | - | with its driver fixed a part can still move while another is held twice
a linkage that does not turn | SolveError | - | dead centre: its driver cannot turn it further (at 44.33 deg of its driver)
a linkage without a joint | SolveError | - | a link, the ground or a slide names a joint that there is not
a linkage of no length | SolveError | - | its links have no length
random linkages of unknown groups | ModelError | - | there are no groups 'tetrads' (there are: 'dyads', 'sliders', 'triads', 'assur')
random linkages of no groups | ModelError | - | name one or more groups: 'dyads', 'sliders', 'triads', 'assur'
random linkages of too few joints | ModelError | - | linkages of 'triads' have 6 joints or more, not 5: the crank and the ground have 3
random linkages of triads that do not fit | ModelError | - | triads alone make linkages of 6, 9, 12 … joints, not of 7
a data set that does not turn | ModelError | - | turn must be a number that is not 0, not 0.0
a data set of more joints than memory | ModelError | - | linkages of 8 joints at 5 instants take 0.00357 GB for 1088 at a time, this machine has 1e-06 GB of memory: ask for fewer joints or instants
a data set without pyarrow | ModelError | - | a data set needs pyarrow, which is not installed: pip install "mbody-planar[data]"
a data set in a file | ModelError | - | cannot write a data set to 'set' (File exists): choose a writable folder
a data set in the folder of another | ModelError | - | 'set' contains another data set, with another count: choose another folder, or delete this one
a data set with half a manifest | ModelError | - | 'set/_linkages.json' is damaged: delete it, and write the same data set again; files that belong to it are kept
a data set of linkages that never turn | ModelError | - | of 3205 random topologies of 8 joints none has a linkage that turns so far: ask for a smaller turn, or fewer joints
the third of two parts of a data set | ModelError | - | there is no part 3 of 2: give 1/2 to 2/2
a part of a data set that is a word | UsageError | - | --part takes numbers such as 3/16, not 'half'
"""
