"""Pictures: what is drawn and plotted, and the files that it is written to."""

import sys
from unittest import mock

from mbody import kinematics
from mbody.views import draw, plot, save
from mbody.views.free_bodies import draw_free_bodies
from tests.errors.command import said
from tests.errors.models import crank_alone, four_bar
from tests.errors.results import batch, motion, run


def without_matplotlib():
    with mock.patch.dict(sys.modules, {"matplotlib": None, "matplotlib.style": None}):
        draw(run())


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
    "a picture to a place that is none": lambda: save(draw(run()), 3),
    "a picture in a folder that is not there": lambda: save(draw(run()), "/nowhere/a.svg"),
    "a picture in a format that is not there": said(["draw", "hoekens", "-o", "hoekens.gif"]),
    "a plot in a format that is not there": said(["plot", "hoekens", "height", "-o", "hoekens"]),
    "a picture without a file": said(["draw", "hoekens"]),
}
