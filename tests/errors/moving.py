"""Moving pictures: pages and films, what they show, and the files that they are written to."""

import sys
from unittest import mock

from mbody import kinetostatics
from mbody.views import animate, view
from mbody.views.shapes import motion as motion_of
from tests.errors.command import said
from tests.errors.models import four_bar
from tests.errors.results import run


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
    "a view of a name": lambda: view("hoekens"),
    "a view of no motion": lambda: view({}),
    "a view of too many designs": lambda: view({str(n): turn() for n in range(7)}),
    "a view that shows what there is not": lambda: view(turn(), show=["shadows"]),
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
}

SENTENCES = r"""
a view of nothing that moves | ModelError | - | nothing moves in this result of 'four-bar' (1 instant): analyse a turn (turn=True) or several times, or simulate; draw shows one position
a view of nothing that moves, at the command | ModelError | - | nothing moves in this result of 'Four-bar: dynamic force analysis' (1 instant): give --over turn, --at NAME=VALUE,VALUE,… or --to TIME; mbody draw shows one position
a live view of other numbers | UsageError | - | --live solves the model file again: --vary takes its parameters, not 'crank.A.x'
a view of an assembly that swings | ModelError | - | an assembly mode is of driven analyses, and this is a free motion: leave it out, or choose instants
a view of a name | ModelError | - | a view is of a mechanism or of what an analysis found, not of an object of the type str
a view of no motion | ModelError | - | a view needs a motion, the mapping has none: give it one
a view of too many designs | ModelError | - | a view shows 6 designs at most, so that they can be told apart, not 7: choose some of them
a view that shows what there is not | ModelError | - | a view shows no 'shadows' (it can show: names, forces, velocities, accelerations, paths, centres, ghosts)
a diagram of what is not there, where there are measures | ModelError | - | measure 'F99': there is no parameter 'F99' (there are none), and a history is named by its element, as 'motor.effort'; measures of 'Four-bar: dynamic force analysis' are: F12, T12
a moving path of a point that is not there | ModelError | coupler | body 'coupler' has no point 'Q' (it has: 'A', 'B')
a page with another ending | ModelError | - | cannot write 'turn.pdf': a view is a file that ends in .html, or in .json for the web component
a page to a place that is none | ModelError | - | a path must be text or path-like, not 3
a page in a folder that is not there | ModelError | - | cannot write '/nowhere/turn.html' (No such file or directory): choose a folder that exists and may be written to
a time before the beginning | ModelError | - | the last time of a motion must be positive and finite, not -1 s: give a later one
a film with another ending | ModelError | - | cannot write 'turn.avi': a film is a file that ends in .gif, .webp, .apng, .svg or .mp4
a film to a place that is none | ModelError | - | a path must be text or path-like, not 3
a film in a folder that is not there | ModelError | - | cannot write '/nowhere/turn.gif' (No such file or directory): choose a folder that exists and may be written to
a film of no duration | ModelError | - | duration of a film must be a positive number (s), not 0.0
a film of too many frames | ModelError | - | a film of 600 s with 25 frames a second has 15000 frames, more than 3000: give a shorter duration, or a lower rate
a film too wide | ModelError | - | a film is 120 to 3840 pixels wide, not 100000: give another width
a film without pillow | ModelError | - | a film in .webp needs pillow, which is not installed: pip install pillow
a film without its coder | ModelError | - | a film in .mp4 needs imageio-ffmpeg, which is not installed: pip install imageio-ffmpeg; .webp and .gif need nothing more
to and over | UsageError | - | give --to, or --at or --over, not both
steps of a design in two units | UsageError | - | --vary r takes LOW:HIGH:COUNT, two numbers of one unit and a count from 2 to 1000000, as in 0:360:25, or values with commas, not '5 in:6 cm:2'
"""
