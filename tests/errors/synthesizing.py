"""Synthesis: demands that are incomplete, contradict themselves, or that no mechanism meets."""

import contextlib
import tempfile
from pathlib import Path

import mbody
from mbody.synthesis import Atlas, cognates
from tests.errors.command import said
from tests.errors.derivatives import with_parameters
from tests.errors.models import four_bar

LINE = [(20.0, 20.0 + 5.0 * n) for n in range(6)]
PAIRS = [(0.7, 1.2), (1.0, 1.4), (1.5, 1.7)]
POSES = [(0, 0, 0), (1, 0.2, 0.1), (0.1, 2, -0.6), (3, -1, 0.9), (-2, 0.3, 0.4)]
#: Points to and fro, whose order no coupler curve has.
WILD = [(0, 0), (5, 1), (0, 0.1), (5, 1.1), (0, 0.2), (5, 1.2), (0, 0.3)]


def path(points=None, **options):
    few = {"search": 40, "starts": 2, "count": 1}
    return lambda: mbody.synthesize(path=LINE if points is None else points, **(few | options))


def function(pairs=None, **options):
    return lambda: mbody.synthesize(function=PAIRS if pairs is None else pairs, **options)


def table(text, *words):
    """The command with a table of that text."""

    def go():
        with tempfile.TemporaryDirectory() as folder, contextlib.chdir(folder):
            if text is not None:
                content = text if isinstance(text, bytes) else text.encode()
                Path("points.csv").write_bytes(content)
            said(["synthesize", "points.csv", *words])()

    return go


def with_atlas(content):
    """A path with a file of that content as its atlas."""

    def go():
        with tempfile.TemporaryDirectory() as folder, contextlib.chdir(folder):
            Path("atlas.npz").write_bytes(content)
            path([*LINE, LINE[0]], atlas="atlas.npz")()

    return go


def model(by=None, **options):
    bounds = {"crank.A.x": (0.8, 1.2)} if by is None else by
    few = {"path": LINE, "of": "coupler.B", "search": 10, "starts": 1}
    return lambda: mbody.synthesize(four_bar(), by=bounds, **(few | options))


def hoekens():
    return mbody.gallery.load("hoekens")


def by_relative_angle():
    """A four-bar whose coupler is turned against its crank."""
    machine = hoekens().without("motor")
    machine.add(mbody.AngleDriver("motor", "coupler", "-120 deg", relative_to="crank"))
    cognates(machine, "coupler.P")


def by_parameter():
    machine = with_parameters()
    return mbody.synthesize(machine, path=LINE, of="coupler.B", by={"crank.A.x": (1, 2)})


def without_turns():
    machine = mbody.gallery.load("scissor_lift")
    place = f"{machine.bodies[0].name}.origin"
    return mbody.synthesize(machine, path=LINE, of=place, by={"M": (1, 2)})


def without_driver():
    machine = mbody.gallery.load("simple_pendulum")
    return mbody.synthesize(machine, path=LINE, of="pendulum.origin", by={"pendulum.mass": (1, 2)})


SCENARIOS = {
    "cognates of a batch": lambda: cognates(
        mbody.assemble(hoekens()).with_values({"crank.inertia": [1.0, 2.0]}), "coupler.P"
    ),
    "cognates of a point of the ground": lambda: cognates(hoekens(), "ground.O2"),
    "cognates of a point of the rocker": lambda: cognates(hoekens(), "rocker.B"),
    "cognates of a pin": lambda: cognates(hoekens(), "coupler.B"),
    "cognates without a motor on the ground": by_relative_angle,
    "a synthesis of a model that is none": lambda: mbody.synthesize("fourbar.toml", path=LINE),
    "a synthesis of a model and a kind": model(kind="four_bar"),
    "a synthesis of a model without a point": model(of=None),
    "a synthesis of a model by nothing": model(by={}),
    "a synthesis of a model by what a formula makes": by_parameter,
    "a synthesis of a model that makes no turns": without_turns,
    "a synthesis of a model without a driver": without_driver,
    "a synthesis of a model whose output is a force": lambda: mbody.synthesize(
        four_bar(), function=PAIRS, of="motor.effort", by={"crank.A.x": (0.8, 1.2)}
    ),
    "a synthesis of a model that reaches no point": model(tolerance="1 mm"),
    "a point without a model": path(of="coupler.P"),
    "a table of bytes": table(b"\xff\xfe\x00"),
    "an atlas of a kind that there is not": said(["atlas", "--to", "a.npz", "--kind", "six_bar"]),
    "an atlas that is not there": path([*LINE, LINE[0]], atlas="none.npz"),
    "an atlas that is none": with_atlas(b"no atlas"),
    "an atlas of another kind": path(
        [*LINE, LINE[0]], atlas=Atlas.made(count=8), kind="slider_crank"
    ),
    "an atlas for an open path": path(atlas=Atlas.made(count=8)),
    "an atlas of a function": function(atlas="none.npz"),
    "a synthesis of nothing": lambda: mbody.synthesize(),
    "a synthesis of a kind that there is not": path(kind="five_bar"),
    "a path that is no list": path("circle"),
    "a point of three numbers": path([(0, 0, 0), (1, 1), (2, 1)]),
    "a path of two points": path(LINE[:2]),
    "a closed path of two points": path([(0, 0), (1, 0), (0, 0)]),
    "a path of one place": path([(1, 1)] * 4),
    "a timing that is no list": path(timing=3),
    "a timing of other length": path(timing=[0.1, 0.2]),
    "a timing to and fro": path(timing=[0, 1, 2, 1, 2, 3]),
    "a timing of two turns": path(timing=[0, 2, 4, 6, 8, 10]),
    "a timing of poses": lambda: mbody.synthesize(poses=POSES, timing=[0, 1, 2, 3, 4]),
    "bounds that are no dict": path(by=["crank.A.x"]),
    "bounds of a number that there is not": path(by={"crank.B.x": (1, 2)}),
    "bounds that are no pair": path(by={"crank.A.x": 3}),
    "bounds in the wrong order": path(by={"crank.A.x": ("30 m", 20)}),
    "bounds of another dimension": path(by={"crank.A.x": (1, "2 kg")}),
    "bounds of a length below zero": path(by={"crank.A.x": (-2, -1)}),
    "bounds of a function": function(by={"crank.A.x": (1, 2)}),
    "bounds of a pin of a plane": lambda: mbody.synthesize(poses=POSES, by={"coupler.P.x": (0, 1)}),
    "a condition that is none": path(subject_to="coupler.P.y"),
    "a condition about a force of a linkage": path(subject_to="peak(motor.effort) <= 2 N*m"),
    "a path nobody reaches": path(WILD, defective=True, tolerance="1 mm"),
    "a tolerance of nothing": path(tolerance=0),
    "a function to and fro": function([(0, 0), (1, 1), (0.5, 0.3)]),
    "a ground of no length": function(ground=0),
    "six poses": lambda: mbody.synthesize(poses=[*POSES, (0, 1, 1)]),
    "poses of one angle": lambda: mbody.synthesize(poses=[(0, 0, 0), (1, 0, 0), (1, 1, 1)]),
    "poses that no four-bar takes": lambda: mbody.synthesize(poses=POSES),
    "a table that is not there": table(None),
    "an empty table": table("\n"),
    "a table of other columns": table("s,t\n1,2\n"),
    "a table of rows of other length": table("x,y\n1,2\n3\n"),
    "a table of a cell that is no number": table("x,y\n1,2\n3,+\n"),
    "a table of a cell that is a word": table("x,y\n1,2\n3,nan\n"),
    "a synthesis of a model in the command without a point": table(
        "x,y\n1,2\n3,4\n5,5\n", "--model", "hoekens"
    ),
    "bounds in the command without a colon": table("x,y\n1,2\n3,4\n5,5\n", "--by", "crank.A.x=3"),
    "bounds in the command that are no formula": table("x,y\n1,2\n", "--by", "crank.A.x=+:3"),
}

SENTENCES = r"""
cognates of a batch | ModelError | - | cognates takes one design: choose one of the batch with design(n)
cognates of a point of the ground | ModelError | ground.O2 | cognates: 'ground.O2' is on the ground: name a point of a coupler
cognates of a point of the rocker | ModelError | rocker | cognates: 'rocker' is no coupler of a four-bar or slider-crank: it needs pins to two links that are pinned to the ground, or to one and to a slider; it has 0 and 0
cognates of a pin | ModelError | coupler.B | cognates: 'coupler.B' is at a pin, whose path is a circle or a line: name another point of 'coupler'
cognates without a motor on the ground | ModelError | - | cognates: 'Hoekens' linkage: a straight line from four bars' must be driven by one angle against the ground, of 'crank', 'coupler', 'rocker': the cognates have the same driver
a synthesis of a model that is none | ModelError | - | synthesize: model must be a Mechanism, not 'fourbar.toml'; load one by mbody.load
a synthesis of a model and a kind | ModelError | - | synthesize: 'kind' does not go with a model: leave it out
a synthesis of a model without a point | ModelError | - | synthesize: of must name the point of the path, such as "coupler.P", or the output, such as "rocker.angle", not None
a synthesis of a model by nothing | ModelError | - | synthesize: by must say which numbers of the model are sought, between which bounds: by={"crank.A.x": (low, high)}
a synthesis of a model by what a formula makes | ModelError | crank.A.x | synthesize: 'crank.A.x' is made by the formula '2*a': seek 'a', or give 'crank.A.x' a number of its own in the model
a synthesis of a model that makes no turns | ModelError | - | synthesize: driver 'cylinder' makes no turns: give its range, span=(low, high)
a synthesis of a model without a driver | ModelError | - | synthesize: 'Simple pendulum' has 0 drivers: one is needed
a synthesis of a model whose output is a force | ModelError | motor.effort | synthesize: 'motor.effort' is in N·m: the output of a function is an angle or a length
a synthesis of a model that reaches no point | SolveError | - | synthesize: no design of the mechanism passes all points without defects within the bounds; left out were 1 for order defects; the nearest is off by 46 m at point 6, with a defect of order: change the points or widen the bounds, try more designs (search), or keep those with defects (defective=True)
a point without a model | ModelError | - | synthesize: of and span go with a model: leave them out, or give it
a table of bytes | ModelError | - | cannot read 'points.csv' (it is no text)
an atlas of a kind that there is not | ModelError | - | atlas: there is no kind 'six_bar' (there are: 'four_bar', 'slider_crank')
an atlas that is not there | ModelError | - | cannot read 'none.npz' (No such file or directory)
an atlas that is none | ModelError | - | 'atlas.npz' is no atlas: make one by mbody atlas --to FILE
an atlas of another kind | ModelError | - | synthesize: the atlas is of four_bar, not of slider_crank
an atlas for an open path | ModelError | - | synthesize: an atlas has closed curves: close the path by its first point, or search without an atlas
an atlas of a function | ModelError | - | synthesize: atlas goes with path: leave it out
a synthesis of nothing | ModelError | - | synthesize: give one of path, function and poses
a synthesis of a kind that there is not | ModelError | - | synthesize: there is no kind 'five_bar' (there are: 'four_bar', 'slider_crank')
a path that is no list | ModelError | - | synthesize: path must be a list of rows (length, length), not 'circle'
a point of three numbers | ModelError | - | synthesize: row 1 of path must have 2 numbers (length, length), not (0, 0, 0)
a path of two points | ModelError | - | synthesize: path has 2 rows, fewer than 3: a continuum of mechanisms meets them; give at least 3
a closed path of two points | ModelError | - | synthesize: the closed path has 2 points, at least 3 are needed
a path of one place | ModelError | - | synthesize: all points of the path are one: give points apart
a timing that is no list | ModelError | - | synthesize: timing must be a list of values of the driver, not 3
a timing of other length | ModelError | - | synthesize: timing has 2 values for 6 points: give one for each
a timing to and fro | ModelError | - | synthesize: timing must rise or fall from point to point: the driver passes the points in their order
a timing of two turns | ModelError | - | synthesize: timing goes over 572.958 deg: after a turn, 360 deg, the path begins again
a timing of poses | ModelError | - | synthesize: timing goes with path: leave it out
bounds that are no dict | ModelError | - | synthesize: by must be a dict of bounds, not ['crank.A.x']
bounds of a number that there is not | ModelError | crank.B.x | synthesize: a four_bar has no number 'crank.B.x' (it has: 'ground.O2.x', 'ground.O2.y', 'ground.O4.x', 'ground.O4.y', 'crank.A.x', 'coupler.B.x', 'rocker.B.x', 'coupler.P.x', 'coupler.P.y')
bounds that are no pair | ModelError | crank.A.x | synthesize: 'crank.A.x' takes a pair (low, high), not 3
bounds in the wrong order | ModelError | crank.A.x | synthesize: 'crank.A.x' goes from 30 to 20 m: give low, then high
bounds of another dimension | ModelError | crank.A.x | synthesize: 'crank.A.x': '2 kg' is a mass (kg), where a length (m) is wanted
bounds of a length below zero | ModelError | crank.A.x | synthesize: 'crank.A.x' is the length of a link, its bounds must be positive, not -2 to -1
bounds of a function | ModelError | - | synthesize: by goes with path and poses: the lengths of a function generator follow from its pairs, its size from ground
bounds of a pin of a plane | ModelError | - | synthesize: by has 'coupler.P.x': of a plane that is guided the pins are found, bound the pivots and the other lengths
a condition that is none | ModelError | - | synthesize: a condition is such as "min(coupler.P.y) >= 20 mm", not 'coupler.P.y'
a condition about a force of a linkage | ModelError | - | synthesize: 'peak(motor.effort) <= 2 N*m' is about a force, and a four-bar that is sought by its lengths has neither masses nor loads: give a model that has them
a path nobody reaches | SolveError | - | synthesize: no four_bar passes the points without defects within the bounds; left out were 2 for misses beyond the tolerance; the nearest is off by … m at point …, with a defect of order: change the points or widen the bounds, try more designs (search), or keep those with defects (defective=True)
a tolerance of nothing | ModelError | - | synthesize: tolerance is 0, it must be positive
a function to and fro | ModelError | - | synthesize: the inputs of function must rise or fall from pair to pair: sort the pairs
a ground of no length | ModelError | - | synthesize: ground is 0, it must be positive
six poses | ModelError | - | synthesize: 6 poses: a four-bar passes 5 exactly and no more: leave some out, or give the path of a point
poses of one angle | ModelError | - | synthesize: two poses in succession have one angle: between them circle points are not determined; turn one of them slightly
poses that no four-bar takes | SolveError | - | synthesize: no four_bar takes the poses without defects within the bounds; left out were 2 for circuit defects; the nearest meets all points, with a defect of circuit: change the points or widen the bounds, try more designs (search), or keep those with defects (defective=True)
a table that is not there | ModelError | - | cannot read 'points.csv' (No such file or directory)
an empty table | ModelError | - | 'points.csv' is empty: give a row for each point
a table of other columns | ModelError | - | 'points.csv': the first row is 's, t': it must name the columns: x, y; x, y, timing; x, y, angle; or input, output, each maybe with a unit, as x [mm]
a table of rows of other length | ModelError | - | 'points.csv': row 3 has 1 cells, the columns are x, y
a table of a cell that is no number | ModelError | - | 'points.csv': row 3, y: '+' ends where a number is expected
a table of a cell that is a word | ModelError | - | 'points.csv': row 3, y: 'nan' is no number
a synthesis of a model in the command without a point | UsageError | - | --model needs --point NAME: the point of the path, as coupler.P, or the output, as rocker.angle
bounds in the command without a colon | UsageError | - | crank.A.x: bounds are LOW:HIGH, not '3'
bounds in the command that are no formula | ModelError | crank.A.x | crank.A.x: '+' ends where a number is expected
"""
