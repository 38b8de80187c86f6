"""Corners that meet: sliding over the end of an edge, joints of floors, steps, notches."""

import math

import numpy as np
import pytest

import mbody
from mbody import Body, Contact, Gravity, Mechanism, SimulationSettings
from mbody.analysis.dynamics import active_modes

G, MU = 9.81, 0.3
HALF = 0.2


def box() -> Body:
    corners = {"A": (-HALF, -HALF), "B": (HALF, -HALF), "C": (HALF, HALF), "D": (-HALF, HALF)}
    shapes = {"s": {"polygon": ("A", "B", "C", "D")}}
    return Body("box", mass=2.0, inertia=0.05, points=corners, shapes=shapes)


def sliding(ground, shapes, at, speed, until=0.4, restitution=0.0, several=False) -> mbody.Solution:
    """A box on the ground of a mechanism, which slides from `at` = (x, y)."""
    made = Mechanism("corners", ground=ground, ground_shapes=shapes)
    made.add(box(), Gravity("gravity", y=-G))
    made.add(
        *(
            Contact(f"on_{name}", f"ground.{name}", "box.s", friction=MU, restitution=restitution)
            for name in shapes
        )
    )
    start = {"box": {"x": at[0], "y": at[1], "vx": speed}}
    made.simulation = SimulationSettings(until=until, rtol=1e-11, start=start)
    run = mbody.simulate(made)
    doubts = [one.message for one in run.doubts]
    assert len(doubts) == several and all("has several outcomes" in one for one in doubts)
    assert run.t[-1] == until
    assert run.energy.error < 1e-9
    return run


@pytest.mark.processor
@pytest.mark.parametrize("way", [1.0, -1.0])
def test_a_box_slides_over_the_end_of_a_table_until_it_tips(way):
    """It tips where the pressure, μ h ahead of the mass centre, is at the end of the table."""
    ground, begin = {"A": (-1.0, 0.0), "B": (1.0, 0.0)}, 0.7
    run = sliding(ground, {"top": {"segment": ("A", "B")}}, (way * begin, HALF), way * 1.5)
    assert not [one for one in run.events if one.name == "impact"]
    passed = 1.0 - MU * HALF - begin
    # v² = v₀² − 2 μ g s
    tips = (1.5 - math.sqrt(1.5**2 - 2.0 * MU * G * passed)) / (MU * G)
    before = run.t < tips
    t = run.t[before]
    assert 20 < before.sum() < len(run.t)
    # places that steps at rtol 1e-11 find, and rounding
    assert (
        np.abs(run["box"].x[before] - way * (begin + 1.5 * t - 0.5 * MU * G * t * t)).max() < 1e-11
    )
    assert np.abs(run["box"].angle[before]).max() < 1e-11
    after = run.t > tips + 0.02
    assert (np.sign(run["box"].angle[after]) == -way).all()


@pytest.mark.processor
def test_a_step_of_the_floor_is_struck():
    """The floor goes on a millimetre higher: the box strikes it by its front. What holds its corner
    down, friction of the front or the floor, is open, and the floor's friction, as the box slides
    on, with it: rates differ by a part in a thousand, by enumeration too.
    """
    ground = {
        "A": (-1.0, 0.0),
        "B": (0.1, 0.0),
        "C": (0.1, 0.001),
        "D": (1.0, 0.001),
        "E": (1.0, -1.0),
        "F": (0.1, -1.0),
    }
    shapes = {"one": {"segment": ("A", "B")}, "two": {"polygon": ("B", "C", "D", "E", "F")}}
    run = sliding(ground, shapes, (-0.3, HALF), 1.5, until=0.3, several=True)
    impacts = [one for one in run.events if one.name == "impact"]
    way = 0.1 - HALF + 0.3
    struck = (1.5 - math.sqrt(1.5**2 - 2.0 * MU * G * way)) / (MU * G)
    assert impacts[0].contact == "on_two"
    assert abs(impacts[0].t - struck) < 1e-11


@pytest.mark.processor
def test_the_inside_of_a_corner_is_struck():
    """A corner that points inwards keeps both its edges apart from what comes along one of them."""
    ground = {
        "A": (-1.0, 0.0),
        "B": (0.1, 0.0),
        "C": (0.1, 1.0),
        "D": (1.0, 1.0),
        "E": (1.0, -1.0),
        "F": (-1.0, -1.0),
    }
    run = sliding(ground, {"notch": {"polygon": ("A", "B", "C", "D", "E", "F")}}, (-0.3, HALF), 1.5)
    way = 0.1 - HALF + 0.3
    struck = (1.5 - math.sqrt(1.5**2 - 2.0 * MU * G * way)) / (MU * G)
    first = next(one for one in run.events if one.name == "impact")
    assert abs(first.t - struck) < 1e-11
    assert run["box"].x.max() < 0.1 - HALF + 1e-9


def test_rows_that_are_off_leave_elimination_as_it_is(monkeypatch):
    """The same bits with the whole elimination, which works on zeros there."""
    ground = {"A": (-1.0, 0.0), "B": (0.1, 0.0), "C": (1.0, 0.0)}
    shapes = {"one": {"segment": ("A", "B")}, "two": {"segment": ("B", "C")}}
    runs = []
    for whole in (False, True):
        if whole:
            monkeypatch.setattr(active_modes, "without_nodes", lambda layout, off: layout)
        runs.append(sliding(ground, shapes, (-0.3, HALF), 1.5, until=0.6))
    one, two = runs
    assert (one["box"].x == two["box"].x).all()
    assert (one.contact("on_two") == two.contact("on_two")).all()
