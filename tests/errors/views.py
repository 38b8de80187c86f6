"""Pictures: what is drawn and plotted, and the files that it is written to."""

import functools
import sys
from unittest import mock

import numpy as np

from mbody import Body, Mechanism, kinematics, kinetostatics, simulate
from mbody.views import draw, plot, save
from mbody.views.free_bodies import draw_free_bodies
from mbody.views.polar import hodograph, polar
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
    "a picture of a batch": lambda: draw(batch()),
    "a picture of a name": lambda: draw("hoekens"),
    "an instant that there is not": lambda: draw(run(), 3),
    "an instant that is text": lambda: draw(run(), "0"),
    "forces of kinematics": lambda: draw(motion(), forces=True),
    "forces of what nothing drives": lambda: draw(crank_alone(), forces=True),
    "a path of a point that is not there": lambda: draw(run(), paths=["coupler.P"]),
    "a plot of a batch": lambda: plot(batch(), "motor.effort"),
    "a plot of one instant": lambda: plot(run(), "motor.effort"),
    "a plot of nothing": lambda: plot(kinematics(four_bar(), t=[0.0, 0.1])),
    "a plot of what is not there": lambda: plot(kinematics(four_bar(), t=[0.0, 0.1]), "C.force"),
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
    "a picture in a format that is not there": said(["draw", "hoekens", "-o", "hoekens.gif"]),
    "a plot in a format that is not there": said(["plot", "hoekens", "height", "-o", "hoekens"]),
    "a picture without a file": said(["draw", "hoekens"]),
}
