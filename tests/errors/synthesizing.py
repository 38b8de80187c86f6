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
    "a synthesis of a model by a number that there is not": model(by={"crank.Z.x": (1, 2)}),
    "a synthesis of a model by what a formula makes": by_parameter,
    "a synthesis of a model that makes no turns": without_turns,
    "a synthesis of a model without a driver": without_driver,
    "a synthesis of a model whose output is a force": lambda: mbody.synthesize(
        four_bar(), function=PAIRS, of="motor.effort", by={"crank.A.x": (0.8, 1.2)}
    ),
    "a synthesis of a model that reaches no point": model(tolerance="1 mm"),
    "a synthesis by a number that is not in the file": lambda: mbody.synthesize(
        with_parameters(), path=LINE, of="coupler.B", by={"coupler.mass": (1, 2)}
    ),
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
    "a synthesis of two demands": lambda: mbody.synthesize(path=LINE, poses=POSES),
    "a synthesis of a kind that there is not": path(kind="five_bar"),
    "a synthesis of no design": path(count=0),
    "a path that is no list": path("circle"),
    "a point of three numbers": path([(0, 0, 0), (1, 1), (2, 1)]),
    "a point that is no number": path([(0, 0), ("soon", 1), (2, 1)]),
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
    "a condition of another dimension": path(subject_to="min(coupler.P.y) >= 2 kg"),
    "a path that no coupler passes in order": path(WILD),
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
    "a count in the command that is no number": table("x,y\n1,2\n", "--count", "few"),
}
