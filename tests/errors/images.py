"""Images of models: what they cannot contain, and words of the command."""

import math

from mbody import (
    AngleDriver,
    Body,
    Event,
    Mechanism,
    Revolute,
    SimulationSettings,
    assemble,
    gallery,
)
from mbody.image.model_image import to_image
from mbody.laws import Function
from tests import folded
from tests.errors.command import said
from tests.errors.models import by_law, four_bar


def free(**settings):
    """A four-bar without a motor, with other settings of its motion."""
    made = four_bar(motor=False)
    made.simulation = SimulationSettings(1.0, **settings)
    return made


def released():
    """Two cranks on one shaft, of which a driver moves the first until it is released."""
    made = Mechanism("released")
    for name in ("first", "second"):
        made.add(Body(name, mass=1.0, cg=(0.5, 0.0)), Revolute(f"O {name}", "ground", name))
    made.add(AngleDriver("motor", "first"))
    made.simulation = SimulationSettings(1.0, release={"motor": 0.5})
    return made


def in_line():
    """A parallelogram with all links in line, where its branches meet."""
    rates = {"crank": {"omega": 6.0}, "coupler": {"omega": 0.0}}
    return folded.asked(folded.four_bar((1.0, 2.0, 1.0, 2.0)), rates)


SCENARIOS = {
    "an image of a batch": lambda: to_image(
        assemble(four_bar()).with_values({"crank.mass": [1.0, 2.0]})
    ),
    "an image of a function in Python": lambda: to_image(by_law(Function(math.sin))),
    "an image of a ball that bounces": lambda: to_image(gallery.load("bouncing_ball")),
    "an image of a motion that ends": lambda: to_image(
        free(events=[Event("crank.omega", stop=True)])
    ),
    "an image of a driver that is released": lambda: to_image(released()),
    "an image of a motion that begins where branches meet": lambda: to_image(in_line()),
    "an image without a file": said(["export", "norton_fourbar", "--to", "image"]),
    "an image of many instants": said(
        ["export", "norton_fourbar", "--to", "image", "-o", "a.img", "--instants", "many"]
    ),
    "instants of a file of MuJoCo": said(
        ["export", "norton_fourbar", "--to", "mjcf", "--instants", "3"]
    ),
}
