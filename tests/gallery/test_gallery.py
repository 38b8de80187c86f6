"""The gallery: every model reads, comes back from a file, and runs."""

import itertools
import re
import shlex

import pytest

from mbody import gallery
from mbody.cli.command import parsed
from mbody.files.model import from_toml, to_toml
from mbody.quantities import read
from tests.support.gallery_runs import run
from tests.support.model_text import model_from, text_from
from tests.support.paths import ROOT

pytestmark = pytest.mark.processor

ROUNDING = 1e-13  # some hundred roundings of 2.2e-16: positions of one loop, closed to rounding
# a sweep accepts a last correction of 1e-12 of the size; times the condition of the loops, below 10
SWEEP = 1e-11


NAMES = (
    *("andrews_squeezer", "bouncing_ball", "braking_vehicle", "cam_follower", "cart_pole"),
    *("double_pendulum", "flyball_governor", "free_fourbar", "geneva_drive"),
    *(
        "hoekens",
        "inline_six",
        "mud_pump",
        "mud_pump_motor",
        "mud_pump_sixbar",
        "mud_pump_sixbar_as_scanned",
    ),
    "n_windows_2",
    *("n_windows_40", "norton_fourbar", "norton_fourbar_printed", "parallel_cranks"),
    *("peaucellier", "pile_of_discs", "planetary_train", "porter_governor", "quick_return"),
    *("rolling_ball", "rotating_mass"),
    *("scissor_lift", "simple_pendulum", "slider_crank", "sliding_ladder", "static_fourbar"),
    *("stephenson_sixbar", "stick_slip"),
    *("toggle_press", "v_twin", "vehicle", "watt_sixbar", "woodpecker"),
)


#: Lines of the models that do not go on a page of 66: cylinders have ten numbers each.
PAGES = {"n_windows_40": 230, "andrews_squeezer": 90, "mud_pump": 90, "mud_pump_sixbar": 80}
PAGES["mud_pump_motor"] = 95  # the pump's bodies and the motor's numbers
PAGES["braking_vehicle"] = 85  # bodies, brakes and tyres of two axles
PAGES["pile_of_discs"] = 75  # six bodies
PAGES["inline_six"] = 95  # rods, pistons and three joints of six cylinders
PAGES["geneva_drive"] = 95  # the corners of a wheel of four slots


@pytest.mark.parametrize("name", NAMES)
def test_a_page_that_reads_well(name):
    lines = gallery.path(name).read_text("utf-8").splitlines()
    described = list(itertools.takewhile(lambda line: not line.startswith("[solve."), lines))
    assert len(described) <= PAGES.get(name, 66)  # a page; then its questions
    assert max(map(len, lines)) <= 100
    assert all(line == line.rstrip() and "\t" not in line for line in lines)
    machine = gallery.load(name)
    assert machine.name and machine.source and machine.note and machine.measures
    assert (machine.ask is None) != (machine.simulation is None)


@pytest.mark.parametrize("name", NAMES)
def test_comes_back_from_a_file(name):
    machine = gallery.load(name)
    assert from_toml(to_toml(machine)) == machine
    assert model_from(text_from(machine, True), True) == machine


@pytest.mark.parametrize("name", NAMES)
def test_runs_as_it_asks(name):
    checks = run(name).checks
    # relative to the size, the greatest term and the peak power: see the two tolerances above;
    # in the pressure of a liquid rounding of a position is K/p, 220, × size/clearance as much
    stiff = 220.0 * 33.0 / 3.0 if name in ("mud_pump", "mud_pump_sixbar") else 1.0
    assert checks.constraint < ROUNDING
    assert checks.equilibrium < ROUNDING * max(1.0, stiff / 100.0)
    assert checks.virtual_work < SWEEP


@pytest.mark.parametrize("name", NAMES)
def test_measures_name_what_is_there(name):
    machine = gallery.load(name)
    for measure in machine.measures.values():
        for dotted in read(measure.of, None).names - machine.parameters.keys():
            first, *middle, last = dotted.split(".")
            assert first in machine
            assert all(point in machine[first].points for point in middle)
            known = {"x", "y", "vx", "ax", "angle", "force", "effort", "fx", "fy", "acceleration"}
            known |= {"omega", "torque", "current", "resistance", "contact", "vy"}
            assert last in known


def test_a_file_keeps_the_formulas_of_its_cam():
    """A parameter is in the cam of the cutting force, and still does when written anew."""
    written, other = to_toml(gallery.load("quick_return")), {"period": "3 s"}
    slower = from_toml(written, parameters=other)
    assert slower == gallery.load("quick_return", other)
    assert [load for load in slower.loads if getattr(load.value, "period", 0.0) == 3.0]


def test_the_page_shows_every_model_once():
    """docs/gallery.md: a picture, and a command that is understood."""
    page = (ROOT / "docs" / "gallery.md").read_text("utf-8")
    shown = re.findall(r"!\[(\w+)\]\(pictures/\1\.svg\)", page)
    assert tuple(sorted(shown)) == gallery.names()
    commands = re.findall(r"\*\*(\w+)\*\* · [^|]*<br>`mbody ([^`]*)`", page)
    assert [name for name, _ in commands] == shown
    for name, command in commands:
        assert name in shlex.split(command)
        parsed(shlex.split(command))
