"""Pictures: what is drawn and plotted, and the files that it is written to."""

import functools
import sys
from unittest import mock

import numpy as np

from mbody import Body, Mechanism, kinematics, kinetostatics, simulate
from mbody.views import draw, plot, save
from mbody.views.free_bodies import draw_free_bodies
from mbody.views.plotting import hodograph, polar
from tests.errors.command import said
from tests.errors.models import crank_alone, four_bar
from tests.errors.results import batch, motion, run


def without_matplotlib():
    with mock.patch.dict(sys.modules, {"matplotlib": None, "matplotlib.style": None}):
        draw(run())


@functools.cache
def pair():
    return kinetostatics(four_bar(), t=[0.0, 0.1])


@functools.cache
def still():
    """A result of several instants at which nothing turns."""
    return kinetostatics(four_bar(), drive={"motor": np.array([1.0, 1.0])})


def loose():
    """A body that flies, without joints."""
    machine = Mechanism("a stone")
    machine.add(Body("stone", mass=1.0, inertia=1.0))
    return simulate(machine, 1.0, instants=3)


SCENARIOS = {
    "a picture without matplotlib": without_matplotlib,
    "a picture of a name": lambda: draw("hoekens"),
    "an instant that there is not": lambda: draw(run(), 3),
    "forces of kinematics": lambda: draw(motion(), forces=True),
    "forces of what nothing drives": lambda: draw(crank_alone(), forces=True),
    "a path of a point that is not there": lambda: draw(run(), paths=["coupler.P"]),
    "a plot of a batch": lambda: plot(batch(), "motor.effort"),
    "a plot of one instant": lambda: plot(run(), "motor.effort"),
    "a plot of nothing": lambda: plot(kinematics(four_bar(), t=[0.0, 0.1])),
    "free-body diagrams of nothing": lambda: draw_free_bodies(run(), []),
    "free-body diagrams of a body that is not there": lambda: draw_free_bodies(run(), ["rod"]),
    "very many free-body diagrams": said(["freebody", "n_windows_40", "-o", "a.svg"]),
    "free-body diagrams of a motion at a place": said(
        ["freebody", "mud_pump", "--to", "1", "--at", "crank=3", "-o", "a.svg"]
    ),
    "a drawing of no instant": lambda: draw(run(), []),
    "centres of two instants in a picture": lambda: draw(pair(), [0, 1], poles=True),
    "centres in a strip": said(["draw", "hoekens", "--poles", "--strip", "-o", "a.svg"]),
    "centres of a free motion in a mode": said(
        ["poles", "double_pendulum", "--to", "0.1", "--assembly", "open"]
    ),
    "a drawing of a body that is not there": lambda: draw(run(), only=["rod"]),
    "a plot over what is not there": lambda: plot(pair(), "A.force", x="crunk.angle"),
    "a plot with an unknown axis": lambda: plot(pair(), "A.force", log="z"),
    "a logarithm of what is negative": lambda: plot(pair(), "-A.force", log="y"),
    "a plot in a unit that does not fit": lambda: plot(pair(), "A.force [mm]"),
    "a polar diagram of a joint that is not there": lambda: polar(pair(), "C"),
    "a polar diagram of what does not turn": lambda: polar(still()),
    "a hodograph of one instant": lambda: hodograph(run(), "A"),
    "a hodograph of a batch": lambda: hodograph(batch(), "A"),
    "a hodograph without joints": lambda: hodograph(loose()),
    "very many positions": said(["draw", "hoekens", "--positions", "1000", "-o", "a.svg"]),
    "positions at places": said(
        ["draw", "hoekens", "--positions", "3", "--at", "crank=3", "-o", "a.svg"]
    ),
    "very many named positions": said(
        ["draw", "hoekens", "--at", f"crank={','.join(map(str, range(201)))}", "-o", "a.svg"]
    ),
    "two kinds of a figure": said(["plot", "hoekens", "height", "--polar", "A", "-o", "a.svg"]),
    "axes of a plot": said(["plot", "hoekens", "height", "--axes", "crank", "-o", "a.svg"]),
    "two numbers that differ in a plot": said(
        ["plot", "hoekens", "height", "--vary", "a=1,2", "--vary", "b=1,2", "-o", "a.svg"]
    ),
    "very many designs in a plot": said(
        ["plot", "mud_pump", "torque", "--vary", "speed=1:2:2000", "-o", "a.svg"]
    ),
    "a picture to a place that is none": lambda: save(draw(run()), 3),
    "a picture in a folder that is not there": lambda: save(draw(run()), "/nowhere/a.svg"),
}

SENTENCES = r"""
a picture without matplotlib | ModelError | - | a picture needs matplotlib, which is not installed: pip install matplotlib
a picture of a name | ModelError | - | a picture is of a mechanism or of what an analysis found, not of 'hoekens'
an instant that there is not | ModelError | - | there is no instant 3: give a whole number, 0 to 0
forces of kinematics | ModelError | O2 | kinematics finds no forces, as of 'O2': use kinetostatics
forces of what nothing drives | SolveError | - | kinetostatics needs 0 free degrees of freedom, 'm' has 3 degrees left: nothing uses the point 'ground.O': join it, or add a driver, for example on 'crank'
a path of a point that is not there | ModelError | coupler | body 'coupler' has no point 'P' (it has: 'A', 'B')
a plot of a batch | ModelError | - | a picture is of one design, this is a batch of 2 designs: take one of them, run.design(n)
a plot of one instant | ModelError | - | a plot needs several instants, this result has 1: analyse a turn (turn=True), or times
a plot of nothing | ModelError | - | 'four-bar' has no measures: name what is to be plotted, as in 'crank.omega'
free-body diagrams of nothing | ModelError | - | there is no body to cut free: name at least one (there are: 'crank', 'coupler', 'rocker')
free-body diagrams of a body that is not there | ModelError | rod | there is no moving body 'rod' (there are: 'crank', 'coupler', 'rocker')
very many free-body diagrams | ModelError | - | a figure of 81 free-body diagrams cannot be read: choose at most 40, by bodies (there are: 'c0', 'c1', 'c2', 'c3', 'c4', 'c5', 'c6', 'c7', 'c8', 'c9', 'c10', 'c11' and 69 more) or by instants
free-body diagrams of a motion at a place | UsageError | - | --to follows the free motion, --at and --over are driven: give one
a drawing of no instant | ModelError | - | a picture needs an instant, 0 to 0: give at least one
centres of two instants in a picture | ModelError | - | a picture with instant centres, polygons or curvature shows one instant of all links, without forces: draw the others in a picture of their own
centres in a strip | UsageError | - | --poles, --polygons and the like draw one instant: name it with --at, or with --to the end of a free motion
centres of a free motion in a mode | UsageError | - | --assembly is of driven analyses: this is a free motion
a drawing of a body that is not there | ModelError | rod | there is no moving body 'rod' to draw (there are: 'crank', 'coupler', 'rocker')
a plot over what is not there | ModelError | - | measure 'crunk.angle': there is no body 'crunk' (there are: 'ground', 'crank', 'coupler', 'rocker')
a plot with an unknown axis | ModelError | - | a logarithmic axis is 'x', 'y' or 'xy', not 'z'
a logarithm of what is negative | ModelError | - | '-A.force' has no positive value, which a logarithmic axis needs: plot another quantity, or leave 'y' linear
a plot in a unit that does not fit | ModelError | - | measure 'A.force': it is a force (N), which 'mm' does not measure
a polar diagram of a joint that is not there | ModelError | C | there is no joint 'C' (there are: 'O2', 'A', 'B', 'O4')
a polar diagram of what does not turn | ModelError | - | a polar diagram is over the angle of a driver, and none turns in this result: draw a hodograph, or analyse a turn
a hodograph of one instant | ModelError | - | a curve needs several instants, this result has 1: analyse a turn
a hodograph of a batch | ModelError | - | plots of forces are of one design, this is a batch of 2 designs: take one of them, run.design(n)
a hodograph without joints | ModelError | - | 'a stone' has no joint whose force could be plotted
very many positions | UsageError | - | --positions takes a whole number, 1 to 200, not '1000'
positions at places | UsageError | - | --positions are equal steps of the motion, --at names places: give one
very many named positions | UsageError | - | a picture shows at most 200 positions, not 201
two kinds of a figure | UsageError | - | a figure is of one kind: give --polar alone
axes of a plot | UsageError | - | --axes goes with --hodograph
two numbers that differ in a plot | UsageError | - | --vary takes one number in a plot: its designs are curves
very many designs in a plot | UsageError | - | a plot shows at most 1000 designs, not 2000
a picture to a place that is none | ModelError | - | a path must be text or path-like, not 3
a picture in a folder that is not there | ModelError | - | cannot write '/nowhere/a.svg' (No such file or directory): choose a folder that exists and may be written to
"""
