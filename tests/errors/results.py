"""Results: what is asked of them, and where they are written to."""

import functools
import math
import sys
from unittest import mock

import mbody
from tests.errors.models import four_bar


@functools.cache
def run():
    return mbody.kinetostatics(four_bar())


@functools.cache
def motion():
    return mbody.kinematics(four_bar())


@functools.cache
def batch():
    system = mbody.assemble(four_bar()).with_values({"crank.mass": [1.0, 2.0]})
    return mbody.kinetostatics(system)


def belt():
    """A crank that a second wheel turns by a belt."""
    machine = four_bar(mbody.Body("wheel"), mbody.Revolute("W", "ground", "wheel"))
    terms = [mbody.CouplingTerm(0.2, angle="crank"), mbody.CouplingTerm(-0.1, angle="wheel")]
    machine.add(mbody.LengthCoupling("belt", terms))
    return mbody.kinetostatics(machine)


def welded(count):
    machine = mbody.Mechanism("welded")
    machine.add(*(mbody.Body(f"b{n}") for n in range(count)))
    machine.add(*(mbody.Fixed(f"w{n}", "ground", f"b{n}") for n in range(count)))
    return machine


def without_pandas():
    with mock.patch.dict(sys.modules, pandas=None):
        run().to_dataframe()


def without_pyarrow():
    with mock.patch.dict(sys.modules, {"pyarrow": None, "pyarrow.parquet": None}):
        run().to_parquet("run.parquet")


def without_openpyxl():
    with mock.patch.dict(sys.modules, openpyxl=None):
        run().to_xlsx("run.xlsx")


def on_a_small_sheet():
    with mock.patch("mbody.files.tables.MOST_ROWS", 1):
        run().to_xlsx("run.xlsx")


SCENARIOS = {
    "no side of a joint": lambda: run().reaction("A", on=2),
    "the reaction of a coupling": lambda: belt().reaction("belt"),
    "a pin that presses": lambda: run().contact("A"),
    "a driver that is not there": lambda: run().effort("engine"),
    "the motion of a driver that is not there": lambda: run().driven("motors"),
    "a point at nan": lambda: run().point(mbody.Marker("coupler", (math.nan, 0.0))),
    "causes of a body": lambda: run().breakdown("crank"),
    "causes of a list": lambda: run().breakdown(["A"]),
    "efforts of kinematics": lambda: motion().effort("motor"),
    "causes of kinematics": lambda: motion().breakdown("A"),
    "equations of kinematics": lambda: motion().equations(),
    "equations of very many links": lambda: mbody.statics(welded(501)).equations(),
    "causes of a batch": lambda: batch().breakdown("A"),
    "columns of a batch": lambda: batch().columns(),
    "data of a batch": lambda: batch().data(),
    "a column that is not there": lambda: motion().table()["A.fx"],
    "output units of no quantity": lambda: run().table({"colour": "red"}),
    "an output unit of another quantity": lambda: run().table({"mass": "N"}),
    "an output unit that is unknown": lambda: run().table({"mass": "kgs"}),
    "an output unit that is a number": lambda: run().table({"mass": 3}),
    "an output unit without a size": lambda: run().table({"mass": "kg*0"}),
    "output units that differ for one dimension": lambda: run().table(
        {"work": "J", "torque": "N*mm"}
    ),
    "output units of a mechanism as text": lambda: mbody.Mechanism("m", output_units="SI"),
    "free bodies of a mechanism": lambda: mbody.member_forces(four_bar()),  # type: ignore[arg-type]
    "free bodies of a batch": lambda: mbody.member_forces(batch()),
    "a load that is not there": lambda: run().load("spring"),
    "a load on another body": lambda: mbody.kinetostatics(
        four_bar(mbody.Spring("spring", "ground.O2", "rocker.B", stiffness=1.0))
    ).load("spring", on="crank"),
    "gravity on no body": lambda: mbody.kinetostatics(
        four_bar(mbody.Gravity("weight", y=-9.81))
    ).load("weight"),
    "where a driver of an angle acts": lambda: run().reaction_point("motor"),
    "a frame without pandas": without_pandas,
    "no path": lambda: run().to_csv(3),
    "a spreadsheet as text": lambda: run().to_csv("run.xlsx"),
    "a spreadsheet without openpyxl": without_openpyxl,
    "a table of Parquet without pyarrow": without_pyarrow,
    "a spreadsheet of too many instants": on_a_small_sheet,
}

SENTENCES = r"""
no side of a joint | ModelError | A | joint 'A' joins 'crank' and 'coupler', not 2
the reaction of a coupling | ModelError | belt | 'belt' is a coupling of several bodies, it has no reaction between two: ask for its effort
a pin that presses | ModelError | A | 'A' is a Revolute, no contact that presses: ask for its reaction
a driver that is not there | ModelError | engine | there is no driver 'engine' (there are: 'motor')
the motion of a driver that is not there | ModelError | motors | there is no driver 'motors' (there are: 'motor')
a point at nan | ModelError | point | 'point': place.x is nan, it must be finite
causes of a body | ModelError | crank | 'crank' is neither a joint nor a driver (there are: 'O2', 'A', 'B', 'O4', 'motor')
causes of a list | ModelError | - | a breakdown is of a joint or a driver by name, not of ['A']
efforts of kinematics | ModelError | motor | kinematics finds no forces, as of 'motor': use kinetostatics
causes of kinematics | ModelError | A | kinematics finds no forces, as of 'A': use kinetostatics
equations of kinematics | ModelError | - | kinematics finds no forces: use kinetostatics or statics
equations of very many links | ModelError | - | 'welded' has 1503 unknowns, equations are written out for up to 1500: read reactions and efforts by name
causes of a batch | ModelError | A | the breakdown of 'A' is for one design, this is a batch of 2 designs: take one of them, run.design(n)
columns of a batch | ModelError | - | a table is of one design, this is a batch of 2 designs: take one of them, run.design(n)
data of a batch | ModelError | - | data are of one design, this is a batch of 2 designs: take one of them, run.design(n)
a column that is not there | ModelError | - | there is no column 'A.fx' (there are: 'A.angle', 'A.rate')
output units of no quantity | ModelError | - | output units: there is no quantity 'colour', name one as mass, torque, speed
an output unit of another quantity | ModelError | - | output units: 'N' measures a force (N), not mass: take one such as kg
an output unit that is unknown | ModelError | - | output units: mass: '1 kgs' is not a formula: there is no unit 'kgs', did you mean 'kg'?
an output unit that is a number | ModelError | - | output units: the unit of mass must be text, such as 'kg': 3
an output unit without a size | ModelError | - | output units: mass: 'kg*0' is no unit
output units that differ for one dimension | ModelError | - | output units: torque has the same dimension as another quantity that is in J: give both one unit
output units of a mechanism as text | ModelError | - | 'm': output_units names units by quantity, such as {'mass': 'kg'}, not 'SI'
free bodies of a mechanism | ModelError | - | this reads the result of an analysis, as kinetostatics gives it, not an object of the type Mechanism: analyse first
free bodies of a batch | ModelError | - | free bodies are of one design, this is a batch of 2 designs: take one of them, run.design(n)
a load that is not there | ModelError | spring | there is no load 'spring' (there are: none)
a load on another body | ModelError | spring | load 'spring' has no history on 'crank' (it has on: 'rocker')
gravity on no body | ModelError | weight | 'weight' acts on every body: name one, as in load('weight', on='crank')
where a driver of an angle acts | ModelError | motor | 'motor', of the type AngleDriver, acts at no place on a body j: ask for that of a joint, or of a driver of a length
a frame without pandas | ModelError | - | a DataFrame needs pandas, which is not installed: pip install pandas; columns() and to_csv() need nothing
no path | ModelError | - | a path must be text or path-like, not 3
a spreadsheet as text | ModelError | - | 'run.xlsx' is a file of a spreadsheet, and CSV is text: to_xlsx (--xlsx) writes that
a spreadsheet without openpyxl | ModelError | - | a spreadsheet needs openpyxl, which is not installed: pip install 'mbody-planar[xlsx]'; CSV needs nothing
a table of Parquet without pyarrow | ModelError | - | a table of Parquet needs pyarrow, which is not installed: pip install "mbody-planar[data]"; CSV needs nothing
a spreadsheet of too many instants | ModelError | - | a sheet has 0 rows, and the result 1 instants: write it as CSV, or keep fewer instants
"""
