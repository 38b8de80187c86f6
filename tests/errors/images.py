"""Images of models and units of co-simulation: what they cannot contain, words of the command, what
is built for them.
"""

import math
import tempfile
from pathlib import Path
from unittest import mock

import mbody
from mbody.image import arena, fmu
from mbody.image.fmu import to_fmu
from mbody.image.model_image import to_image
from mbody.laws import Function, Table
from tests.errors.command import said
from tests.errors.models import by_law, four_bar
from tests.support import folded


def free(**settings):
    """A four-bar without a motor, with other settings of its motion."""
    made = four_bar(motor=False)
    made.simulation = mbody.SimulationSettings(1.0, **settings)
    return made


def released():
    """Two cranks on one shaft, of which a driver moves the first until it is released."""
    made = mbody.Mechanism("released")
    for name in ("first", "second"):
        made.add(
            mbody.Body(name, mass=1.0, cg=(0.5, 0.0)), mbody.Revolute(f"O {name}", "ground", name)
        )
    made.add(mbody.AngleDriver("motor", "first"))
    made.simulation = mbody.SimulationSettings(1.0, release={"motor": 0.5})
    return made


FLOOR = {"line": {"point": "O"}}


def touching(bodies):
    """Bodies of 64 corners over a floor; a wheel without inertia on it, where there are none."""
    made = mbody.Mechanism("touching", ground={"O": (0.0, 0.0)}, ground_shapes={"floor": FLOOR})
    made.add(mbody.Gravity("weight", y=-9.81))
    turns = [2.0 * math.pi * n / 64 for n in range(64)]
    corners = {f"c{n}": (math.cos(turn), math.sin(turn)) for n, turn in enumerate(turns)}
    rim, start = {"rim": {"polygon": [*corners]}}, {}
    if not bodies:
        corners, rim = {"C": (0.0, 0.0)}, {"rim": {"disc": "C", "radius": 1.0}}
    for name in bodies or ("wheel",):
        mass = {"mass": 1.0, "inertia": 1.0 if bodies else 0.0}
        made.add(
            mbody.Body(name, points=corners, shapes=rim, guess=(0.0, 1.0, 0.0), **mass),
            mbody.Contact(f"{name} floor", "ground.floor", f"{name}.rim", friction=0.5),
        )
        start[name] = {"x": 0.0, "y": 1.0, "vx": 1.0}
    made.simulation = mbody.SimulationSettings(1.0, start)
    return made


def in_line():
    """A parallelogram with all links in line, where its branches meet."""
    rates = {"crank": {"omega": 6.0}, "coupler": {"omega": 0.0}}
    return folded.asked(folded.four_bar((1.0, 2.0, 1.0, 2.0)), rates)


def nowhere():
    """The core for browsers, where it is not kept and cannot be."""
    here = mock.patch.object(arena, "PACKAGE", Path("/no"))
    with here, mock.patch.object(arena, "cache_folder", lambda _: None):
        arena.browser_core()


def without_a_builder():
    with mock.patch.object(arena, "find_spec", lambda _: None):
        arena.build_browser_core(Path("/no"))


def by_a_builder_that_fails():
    words = ["sh", "-c", "echo no room left on the disk >&2; exit 1"], {}
    found = mock.patch.object(arena, "find_spec", lambda name: name)
    with found, mock.patch.object(arena, "builder_command", lambda *_: words):
        arena.build_browser_core(Path("/no"))


def with_input(value="0 N*m"):
    """A four-bar with a torque that follows an input."""
    made = four_bar(motor=False)
    made.add(mbody.Input("u", value), mbody.Torque("drive", "crank", value="u"))
    return made


def controlled():
    made = with_input()
    made.add(mbody.Controller("pid", lambda t, angle: -angle, 0.01, ["crank.angle"], ["u"]))
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
        mock.patch.object(fmu, "_this_platform", lambda: None),
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
        mbody.assemble(four_bar()).with_values({"crank.mass": [1.0, 2.0]})
    ),
    "an image of a function in Python": lambda: to_image(by_law(Function(math.sin))),
    "an image of too many contacts": lambda: to_image(touching("abcde")),
    "an image of a wheel without inertia": lambda: to_image(touching("")),
    "an image of a driver that is released": lambda: to_image(released()),
    "an image of a motion that begins where branches meet": lambda: to_image(in_line()),
    "an image of a controller in Python": lambda: to_image(controlled()),
    "an image of an input that holds the values of a table": lambda: to_image(
        with_input(Table([0.0, 1.0], [0.0, 1.0], interpolation="hold")), 2, ("free",)
    ),
    "a unit of a motion that ends": lambda: to_fmu(
        free(events=[mbody.Event("crank.omega", stop=True)]), binaries={}
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

SENTENCES = r"""
an image of a batch | ModelError | - | an image has one design, 'four-bar' has 2: choose one with design(n)
an image of a function in Python | ModelError | motor | 'motor' has a function in Python, which an image runs without: give a formula or a table instead
an image of too many contacts | ModelError | - | an image of 'touching' could do nothing; no driven motion: kinetostatics needs 0 free degrees of freedom, 'touching' has 15 degrees left: add a driver, for example on 'a'; no free motion: 'touching' has 320 places that may touch, too many for an image: leave out contacts that never close
an image of a wheel without inertia | ModelError | - | an image of 'touching' could do nothing; no driven motion: kinetostatics needs 0 free degrees of freedom, 'touching' has 3 degrees left: add a driver, for example on 'wheel'; no free motion: an image cannot begin the motion of 'touching': what slides at the beginning at 'wheel floor' has no inertia to do so: it rolls at once
an image of a driver that is released | ModelError | - | an image of 'released' could do nothing; no driven motion: kinetostatics needs 0 free degrees of freedom, 'released' has 1 degree left: add a driver, for example on 'second'; no free motion: driver 'motor' is released, which an image cannot do: leave the release out
an image of a motion that begins where branches meet | ModelError | - | an image of 'folded' could do nothing; no driven motion: kinetostatics needs 0 free degrees of freedom, 'folded' has 2 degrees left: add a driver, for example on 'crank'; no free motion: 'folded' begins where branches meet, at a singular position, which an image cannot leave: begin elsewhere
an image of a controller in Python | ModelError | pid | 'pid' is a controller in Python, which an image runs without: leave it out, and let the program set 'u'
an image of an input that holds the values of a table | ModelError | u | input 'u' follows a table that holds its values, which an image cannot: give it a number, and let the program set it
a unit of a motion that ends | ModelError | - | 'crank.omega' ends the motion, which an image cannot do: leave it out
a unit of another version | ModelError | - | units are of FMI '3.0' or '2.0', not '1.0': give one of them
a unit without a file | UsageError | - | a unit is binary, it cannot be printed: name its file with -o FILE
instants of a unit | UsageError | - | --instants goes with --to image: a unit has no instants
a version of FMI of an image | UsageError | - | --fmi goes with --to fmu, not with --to image: leave it out
binaries of units without a place | ModelError | - | the binaries of co-simulation units have to be built, and no folder to keep them can be written: set MBODY_CACHE_DIR
binaries of units without their builder | ModelError | - | the binaries of co-simulation units are built by numba and a C compiler, not all of which are installed: pip install numba ziglang
binaries of units that are not built | ModelError | - | the binaries of co-simulation units could not be built; the builder said:⏎no room left on the disk
a core for browsers without a place | ModelError | - | the core for browsers has to be built, and no folder to keep it can be written: set MBODY_CACHE_DIR
a core for browsers without its builder | ModelError | - | the core for browsers is built by numba and ziglang, not all of which are installed: pip install numba ziglang
a core for browsers that is not built | ModelError | - | the core for browsers could not be built; the builder said:⏎no room left on the disk
an image without a file | UsageError | - | an image is binary, it cannot be printed: name its file with -o FILE
an image of many instants | UsageError | - | --instants takes a whole number, not 'many'
instants of a file of MuJoCo | UsageError | - | --instants goes with --to image: a file of MuJoCo has no instants
"""
