"""What a description says that is perhaps meant otherwise is among the notes."""

import math
import re

import numpy as np
import pytest

import mbody
from mbody import Body, Mechanism, Revolute, gallery, makers
from mbody.model.model_notes import model_notes

FILE = """
units = "{units}"
g = "9.81 m/s^2"
[bodies.arm]
{mass}
points  = {{ P = [1, 0] }}
[joints]
O = {{ revolute = ["ground", "arm"] }}
[drivers]
motor = {{ angle = "arm", law = {law} }}
[loads]
spring = {{ torsion_spring = "arm", law = {spring} }}
"""


def model(law='"25 rad/s * t"', mass="mass = 2\ninertia = 1", spring='"3 N*m/rad * x"', units="SI"):
    return mbody.from_toml(FILE.format(law=law, mass=mass, spring=spring, units=units))


def test_nothing_is_said_of_what_is_plain():
    assert model().file_notes == () and model_notes(model()) == ()
    assert not mbody.kinetostatics(model()).notes


@pytest.mark.parametrize("name", gallery.names())
def test_nothing_is_said_of_the_gallery(name):
    assert not model_notes(mbody.load(gallery.path(name)))


SWINGS = '{ table = { x = [-2000, 0, 1, 2000], y = [0, 0, 5, 5], interpolation = "spline" } }'
SAID = {
    "a formula in degrees": ({"law": '"30 + 25*t"'}, r"'motor': '30 \+ 25\*t' has no units"),
    "a formula with pi": ({"law": '"2*pi*t"'}, r"rate in deg/s: write units"),
    "a polynomial in both": (
        {"law": "{ polynomial = [30, 25] }"},
        r"the first number is an angle, 30 deg, and the others are rates, as 25 rad/s",
    ),
    "a law of an angle": (
        {"spring": '"4*x"'}, r"'spring': in '4\*x', which has no units, x is in rad",
    ),
    "no inertia": ({"mass": "mass = 2"}, "body 'arm' has a mass and no inertia"),
    "no inertia of a weight": ({"mass": "weight = 2"}, "body 'arm' has a weight and no inertia"),
    "a mass in blobs": (
        {"mass": "mass = 3\ninertia = 1", "units": "in-lbf-s"},
        "'arm' has a mass of 3 blob, which is 1158 lb",
    ),
    "a mass in tonnes": (
        {"mass": "mass = 3\ninertia = 1", "units": "mm-N-s"},
        "'arm' has a mass of 3 t, which is 3000 kg",
    ),
    "a spline that swings": (
        {"spring": SWINGS}, "leaves the range of its points, 0 N·m to 5 N·m: it goes to",
    ),
    "a driver in straight lines": (
        {"law": '{ table = { x = [0, 1, 2], y = [0, 30, 0], interpolation = "linear" } }'},
        "goes in straight lines, so that the rate jumps",
    ),
}  # fmt: skip


@pytest.mark.parametrize("kind", SAID)
def test_it_is_said_and_leaves_the_status(kind):
    changes, words = SAID[kind]
    machine = model(**changes)
    run = mbody.kinetostatics(machine, t=[0.0, 0.5])
    (note,) = run.notes
    assert re.search(words, note) and run.status == "completed"
    assert note in mbody.mobility(machine).notes
    assert note in " ".join(str(run).split()) and note in run.data()["notes"]


@pytest.mark.parametrize(
    "changes",
    [
        {"law": '"30 deg + 25 rad/s * t"'},
        {"law": '{ polynomial = ["30 deg", "25 rad/s"] }'},
        {"law": "{ polynomial = [0, 25] }"},
        {"law": "30"},
        {"mass": "mass = 2\ninertia = 0"},
        {"mass": 'mass = "3 blob"\ninertia = 1', "units": "in-lbf-s"},
        {"mass": "mass = 0.01\ninertia = 1", "units": "in-lbf-s"},
    ],
)
def test_it_is_not_said_where_it_is_clear(changes):
    assert not model_notes(model(**changes))


def test_the_rule_of_plain_numbers():
    """A plain number is in the unit of its own field; a formula is one field as a whole."""
    at = 0.5
    for law, angle, rate in (
        ('"30 + 25*t"', math.radians(42.5), math.radians(25.0)),
        ("{ polynomial = [30, 25] }", math.radians(30.0) + 12.5, 25.0),
        ("{ constant_speed = { value = 30, speed = 25 } }", math.radians(30.0) + 12.5, 25.0),
        ('"30 deg + 25 rad/s * t"', math.radians(30.0) + 12.5, 25.0),
    ):
        run = mbody.kinematics(model(law), t=at)
        assert run["arm"].angle[0] == pytest.approx(angle, rel=1e-13)
        assert run["arm"].omega[0] == pytest.approx(rate, rel=1e-13)
    table = model(spring="{ table = { x = [-90, 90], y = [-4, 4] } }")["spring"].law
    np.testing.assert_allclose(table.x, [-math.pi / 2, math.pi / 2])


def test_a_link_without_length():
    machine = Mechanism("short", ground={"Q": (3.0, 0.0)})
    machine.add(
        Body("crank", points={"O": (1.0, 2.0), "A": (1.0, 2.0)}), Body("rod"),
        Revolute("O", "ground", "crank.O"), Revolute("A", "crank.A", "rod"),
    )  # fmt: skip
    (said,) = model_notes(machine)
    assert said.startswith("body 'crank' has no length: its joints 'O', 'A' are at one point")
    assert not model_notes(makers.four_bar(1, 3, 2, 3.5))


def test_of_many_bodies_there_is_one_note():
    """Of each sort one, with their number and the first names; of eight each has its own."""
    for count, notes in ((8, 16), (9, 2)):
        lines = ['units = "in-lbf-s"', "[ground]", "points = { O = [0, 0] }"]
        for n in range(count):
            lines += [f"[bodies.rod{n}]", "mass = 3", "points = { A = [0, 0], B = [0, 0] }"]
        lines.append("[joints]")
        for n in range(count):
            before = "ground.O" if n == 0 else f"rod{n - 1}.B"
            lines.append(f'J{n} = {{ revolute = ["{before}", "rod{n}.A"] }}')
        lines.append(f'E = {{ revolute = ["rod{count - 1}.B", "ground.O"] }}')
        made = mbody.from_toml("\n".join(lines))
        said = [one for one in model_notes(made) if "no length" in one or "a mass of" in one]
        said += [one for one in model_notes(made) if "have plain masses" in one]
        assert len(said) == notes
    assert said[0].startswith("9 bodies have no length ('rod0', ") and "and 1 more" in said[0]
    assert said[1].startswith("9 bodies have plain masses, which are in blob ('rod0', ")
    (inertia,) = (one for one in model_notes(made) if "no inertia" in one)
    assert inertia.startswith("9 bodies have a mass or weight and no inertia ('rod0', ")


@pytest.mark.parametrize(("points", "said"), [(7, True), (20_001, False)])
def test_a_spline_through_dense_points_does_not_leave_their_range(points, said):
    """Between the points next to an extremum of sin t, h apart, it goes beyond them by up to h²/8:
    of 20 001 points by 1e-8, of which six figures show nothing.
    """
    t = np.linspace(0.0, 6.0, points)
    machine = mbody.Mechanism("crank")
    machine.add(
        mbody.Body("crank", mass=1.0, inertia=0.1, points={"A": (0.3, 0.0)}),
        mbody.Revolute("O", "ground", "crank"),
        mbody.AngleDriver("motor", "crank", mbody.laws.Table(t, np.sin(t))),
    )
    notes = mbody.kinematics(machine, t=[0.0, 1.0]).notes
    assert any("leaves the range" in note for note in notes) == said
