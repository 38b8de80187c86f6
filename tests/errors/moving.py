"""Moving pictures: pages and films, what they show, and the files that they are written to."""

import sys
from unittest import mock

from mbody import kinetostatics
from mbody.views import animate, view
from mbody.views.motions import motion as motion_of
from tests.errors.command import said
from tests.errors.models import four_bar
from tests.errors.results import batch, run


def turn():
    return kinetostatics(four_bar(), t=[0.0, 0.05, 0.1])


def without(name, path):
    def film():
        with mock.patch.dict(sys.modules, {name: None}):
            animate(turn(), path, duration=0.1)

    return film


SCENARIOS = {
    "a view of nothing that moves": lambda: view(run()),
    "a view of nothing that moves, at the command": said(
        ["view", "norton_fourbar", "--at", "t=0", "-o", "none.html"]
    ),
    "a live view of other numbers": said(
        ["view", "slider_crank", "--live", "--vary", "crank.A.x=1,2", "-o", "none.html"]
    ),
    "a view of an assembly that swings": said(
        ["view", "double_pendulum", "--assembly", "1", "-o", "none.html"]
    ),
    "a view of a batch": lambda: view(batch()),
    "a view of a name": lambda: view("hoekens"),
    "a view of no motion": lambda: view({}),
    "a view of too many designs": lambda: view({str(n): turn() for n in range(7)}),
    "a view that shows what there is not": lambda: view(turn(), show=["shadows"]),
    "a diagram of what is not there": lambda: view(turn(), plots=["Q.force"]),
    "a diagram of what is not there, where there are measures": said(
        ["view", "norton_fourbar", "--plot", "F99", "-o", "none.html"]
    ),
    "a moving path of a point that is not there": lambda: view(turn(), paths=["coupler.Q"]),
    "a page with another ending": lambda: view(turn()).save("turn.pdf"),
    "a page to a place that is none": lambda: view(turn()).save(3),
    "a page in a folder that is not there": lambda: view(turn()).save("/nowhere/turn.html"),
    "a time before the beginning": lambda: motion_of(four_bar(), to=-1.0),
    "a film with another ending": lambda: animate(turn(), "turn.avi"),
    "a film to a place that is none": lambda: animate(turn(), 3),
    "a film in a folder that is not there": lambda: animate(
        turn(), "/nowhere/turn.gif", duration=0.1
    ),
    "a film of no duration": lambda: animate(turn(), "turn.gif", duration=0.0),
    "a film of too many frames": lambda: animate(turn(), "turn.gif", duration=600.0),
    "a film too wide": lambda: animate(turn(), "turn.gif", width=100_000),
    "a film without pillow": without("PIL", "film.webp"),
    "a film without its coder": without("imageio_ffmpeg", "film.mp4"),
    "to and over": said(["view", "norton_fourbar", "--to", "1", "--over", "turn"]),
    "steps of a design in two units": said(["view", "mud_pump", "--vary", "r=5 in:6 cm:2"]),
    "a duration that is a word": said(["animate", "norton_fourbar", "--duration", "long"]),
}
