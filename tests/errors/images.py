"""Images of models and units of co-simulation: what they cannot contain, words of the command, what
is built for them.
"""

import math
import tempfile
from pathlib import Path
from unittest import mock

from mbody import (
    AngleDriver,
    Body,
    Controller,
    Event,
    Input,
    Mechanism,
    Revolute,
    SimulationSettings,
    Torque,
    assemble,
    gallery,
)
from mbody.image import fmu, webassembly
from mbody.image.fmu import to_fmu
from mbody.image.model_image import to_image
from mbody.laws import Function, Table
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


def nowhere():
    """The core for browsers, where it is not kept and cannot be."""
    here = mock.patch.object(webassembly, "PACKAGE", Path("/no"))
    with here, mock.patch.object(webassembly, "cache_folder", lambda _: None):
        webassembly.browser_core()


def without_a_builder():
    with mock.patch.object(webassembly, "find_spec", lambda _: None):
        webassembly.build_browser_core(Path("/no"))


def by_a_builder_that_fails():
    words = ["sh", "-c", "echo no room left on the disk >&2; exit 1"], {}
    found = mock.patch.object(webassembly, "find_spec", lambda name: name)
    with found, mock.patch.object(webassembly, "builder_command", lambda *_: words):
        webassembly.build_browser_core(Path("/no"), quiet=True)


def with_input(value="0 N*m"):
    """A four-bar with a torque that follows an input."""
    made = four_bar(motor=False)
    made.add(Input("u", value), Torque("drive", "crank", value="u"))
    return made


def controlled():
    made = with_input()
    made.add(Controller("pid", lambda t, angle: -angle, 0.01, ["crank.angle"], ["u"]))
    return made


def binaries_nowhere():
    """The binaries of units, where they are not kept and cannot be."""
    here = mock.patch.object(fmu, "PACKAGE", Path("/no"))
    with here, mock.patch.object(fmu, "cache_folder", lambda _: None):
        fmu.fmu_binaries()


def binaries_without_a_builder():
    """Neither kept nor to be built."""
    with (
        mock.patch.object(fmu, "PACKAGE", Path("/no")),
        mock.patch.object(fmu, "cache_folder", lambda _: Path("/no")),
        mock.patch.object(fmu, "find_spec", lambda _: None),
        mock.patch.object(fmu, "_here", lambda: None),
    ):
        fmu.fmu_binaries()


def binaries_by_a_builder_that_fails():
    words = ["sh", "-c", "echo no room left on the disk >&2; exit 1"], {}
    with (
        tempfile.TemporaryDirectory() as folder,
        mock.patch.object(fmu, "PACKAGE", Path("/no")),
        mock.patch.object(fmu, "cache_folder", lambda _: Path(folder)),
        mock.patch.object(fmu, "find_spec", lambda name: name),
        mock.patch.object(fmu, "builder_command", lambda *_: words),
        mock.patch.dict("os.environ", {"MBODY_QUIET": "1"}),
    ):
        fmu.fmu_binaries()


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
    "an image of a controller in Python": lambda: to_image(controlled()),
    "an image of an input that holds the values of a table": lambda: to_image(
        with_input(Table([0.0, 1.0], [0.0, 1.0], interpolation="hold")), 2, ("free",)
    ),
    "a unit of a motion that ends": lambda: to_fmu(
        free(events=[Event("crank.omega", stop=True)]), binaries={}
    ),
    "a unit of another version": lambda: to_fmu(four_bar(motor=False), "1.0", binaries={}),
    "a unit without a file": said(["export", "simple_pendulum", "--to", "fmu"]),
    "instants of a unit": said(
        ["export", "simple_pendulum", "--to", "fmu", "-o", "a.fmu", "--instants", "3"]
    ),
    "a version of FMI of an image": said(
        ["export", "simple_pendulum", "--to", "image", "-o", "a.img", "--fmi", "2.0"]
    ),
    "binaries of units without a place": binaries_nowhere,
    "binaries of units without their builder": binaries_without_a_builder,
    "binaries of units that are not built": binaries_by_a_builder_that_fails,
    "a core for browsers without a place": nowhere,
    "a core for browsers without its builder": without_a_builder,
    "a core for browsers that is not built": by_a_builder_that_fails,
    "an image without a file": said(["export", "norton_fourbar", "--to", "image"]),
    "an image of many instants": said(
        ["export", "norton_fourbar", "--to", "image", "-o", "a.img", "--instants", "many"]
    ),
    "instants of a file of MuJoCo": said(
        ["export", "norton_fourbar", "--to", "mjcf", "--instants", "3"]
    ),
}
