"""Dead centres of cylinders and of driven slides: closed forms, the walk along circuits, words."""

import json
import math

import numpy as np
import pytest

import mbody
from mbody import AngleDriver, Body, CoordinateDriver, DistanceDriver, Mechanism, Revolute
from mbody.cli import main
from mbody.files.model import to_toml

#: Newton ends at rounding; lengths are square roots of sums of a few squares.
CLOSE = 1e-9


def boom(length, foot, start):
    """A cylinder from the ground to the end of an arm."""
    machine = Mechanism("boom", ground={"O": (0.0, 0.0), "G": foot})
    machine.add(
        Body("boom", points={"O": (0.0, 0.0), "T": (length, 0.0)}, guess="80 deg"),
        Revolute("O", "ground.O", "boom.O"),
        DistanceDriver("cylinder", "ground.G", "boom.T", start),
    )
    return machine


@pytest.mark.parametrize("seed", range(8))
def test_a_cylinder_on_an_arm_ends_on_the_line_of_its_pins(seed):
    """At |b − l| and b + l, the distance b between its foot and the arm's pin."""
    rng = np.random.default_rng(seed)
    length, foot = rng.uniform(0.3, 2.0), tuple(rng.uniform(-2.0, 2.0, 2))
    b = math.hypot(*foot)
    found = mbody.dead_centres(boom(length, foot, math.hypot(b, length)))
    assert found.complete and found.full_turn is False and not found.angular
    np.testing.assert_allclose(found.values, [abs(b - length), b + length], rtol=CLOSE)
    walked = mbody.circuits(boom(length, foot, math.hypot(b, length)))
    assert walked.complete and len(walked) == 1 and walked[0].modes == (1, 2)
    np.testing.assert_allclose(walked[0].range, found.values, rtol=CLOSE)


@pytest.mark.parametrize("offset", [0.0, 0.4])
def test_a_driven_slider_ends_where_rod_and_crank_are_one_line(offset):
    """At ±√((l ± r)² − e²), on both sides of the crank."""
    machine = mbody.makers.slider_crank(1.0, 3.0, offset=offset).without("motor")
    machine.add(CoordinateDriver("push", "ground.O", "slider.B", 2.9))
    found = mbody.dead_centres(machine)
    ends = [math.sqrt((3.0 + sign) ** 2 - offset**2) for sign in (1.0, -1.0)]
    assert found.complete
    exact = [-ends[0], -ends[1], ends[1], ends[0]]
    np.testing.assert_allclose(found.values, exact, rtol=CLOSE)
    # the other circuit is never at this value: it is searched between its own dead centres
    walked = mbody.circuits(machine)
    assert walked.complete and [one.modes for one in walked] == [(1, 2), ()]
    np.testing.assert_allclose(walked[1].range, exact[:2], rtol=CLOSE)


def test_a_later_group_stops_the_cylinder():
    """An arm of 6 that a cylinder lifts is the crank of a four-bar of 6, 18, 12 on 8, which has its
    dead centres at 48.19 and 311.81 deg (acos(2/3)) and does not close between. Of the arm's own,
    on the line to the cylinder's foot, that at 149° closes, the other one at −31° does not.
    """
    machine = boom(6.0, (-5.0, 3.0), 9.5)
    four = Mechanism("boom and four-bar", ground={"O": (0.0, 0.0), "G": (-5.0, 3.0), "E": (8, 0)})
    four.add(
        *(one for one in machine if one.role != "ground"),
        Body("coupler", points={"T": (0.0, 0.0), "B": (18.0, 0.0)}, guess="20 deg"),
        Body("rocker", points={"E": (0.0, 0.0), "B": (12.0, 0.0)}, guess="60 deg"),
        Revolute("T", "boom.T", "coupler.T"),
        Revolute("B", "coupler.B", "rocker.B"),
        Revolute("E", "ground.E", "rocker.E"),
    )
    dead = math.acos(2.0 / 3.0)
    tips = [6.0 * complex(math.cos(x), math.sin(x)) for x in (dead, -dead)]
    found = mbody.dead_centres(four)
    exact = [abs(tip - complex(-5.0, 3.0)) for tip in tips]
    exact.append(6.0 - math.hypot(5.0, 3.0))
    assert found.complete
    np.testing.assert_allclose(found.values, sorted(exact), rtol=CLOSE)


@pytest.mark.slow
def test_certified_ends_are_those_of_the_walk():
    """A cylinder at a point of a coupler, in a group of two loops: `complete` says that the curves,
    which are walked by their tangents, meet all certified dead centres and no other number of
    modes.
    """
    ground = {"O2": (0.0, 0.0), "O4": (3.5, 0.0), "G": (4.0, 4.0)}
    machine = Mechanism("four-bar with a cylinder", ground=ground)
    machine.add(
        Body("crank", points={"O2": (0.0, 0.0), "A": (1.0, 0.0)}, guess=0.9),
        Body("coupler", points={"A": (0.0, 0.0), "B": (3.0, 0.0), "P": (1.0, 1.5)}, guess=0.3),
        Body("rocker", points={"O4": (0.0, 0.0), "B": (2.0, 0.0)}, guess=1.5),
        Revolute("O2", "ground.O2", "crank.O2"),
        Revolute("A", "crank.A", "coupler.A"),
        Revolute("B", "coupler.B", "rocker.B"),
        Revolute("O4", "ground.O4", "rocker.O4"),
        DistanceDriver("cylinder", "ground.G", "coupler.P", 4.0),
    )
    found = mbody.circuits(machine)
    assert found.complete and len(found) == 2
    # by the crank, which turns all the way round: the greatest and least distance on each circuit
    turned = machine.without("cylinder")
    turned.add(AngleDriver("motor", "crank", 0.0))
    ends = []
    for mode in ("open", "crossed"):
        drive = {"motor": np.linspace(0.0, 2.0 * math.pi, 2001)}
        run = mbody.kinematics(turned, drive=drive, assembly=mode)
        place = run.point("coupler.P")
        distance = np.hypot(place.x - 4.0, place.y - 4.0)
        ends += [distance.min(), distance.max()]
    # of a parabola between samples: a step of 3e-3 rad squared, by an eighth
    np.testing.assert_allclose(found.dead_centres.values, np.sort(ends), atol=1e-5)


def test_the_command_has_lengths(capsys, tmp_path):
    path = tmp_path / "boom.toml"
    path.write_text(to_toml(boom(0.6, (1.0, 0.0), 0.9)))
    assert main(["assemblies", str(path)]) == 0
    text = capsys.readouterr().out
    assert "dead centres of 'cylinder': 0.4 m, 1.6 m; it is proven that there are no more" in text
    assert main(["assemblies", str(path), "--json"]) == 0
    data = json.loads(capsys.readouterr().out)
    assert [one["value"] for one in data["dead_centres"]] == pytest.approx([0.4, 1.6])
    summary = str(mbody.dead_centres(mbody.load(path)))
    assert "0.4 m   boom" in summary and "°" not in summary


@pytest.mark.slow
def test_a_leg_of_a_platform_ends_at_the_extrema_of_its_length():
    """The search of the 3-RPR runs out of boxes and says so; walks meet all that scanning the two
    coupler curves of the other legs finds.
    """
    legs, places = (14.98, 15.38, 12.0), {"A1": (0, 0), "A2": (15.91, 0), "A3": (0, 10)}
    d12, d13, d23 = 17.04, 20.84, 16.54
    bx = (d12**2 + d13**2 - d23**2) / (2 * d12)
    by = math.sqrt(d13**2 - bx**2)
    machine = Mechanism("3-RPR", ground=places)
    points = {"B1": (0, 0), "B2": (d12, 0), "B3": (bx, by)}
    machine.add(Body("platform", points=points, guess=(8.0, 10.0, 0.5)))
    for k, r in enumerate(legs, 1):
        machine.add(DistanceDriver(f"leg{k}", f"ground.A{k}", f"platform.B{k}", r))
    found = mbody.dead_centres(machine, driver="leg1")
    assert not found.complete and "the search ended after" in found.notes[0]
    b2 = 15.91 + legs[1] * np.exp(1j * np.linspace(-np.pi, np.pi, 40001))
    z, lengths = 10j - b2, []
    with np.errstate(invalid="ignore"):
        angle = np.arccos((abs(z) ** 2 + d23**2 - legs[2] ** 2) / (2 * abs(z) * d23))
    for s in (1, -1):
        b3 = b2 + d23 * np.exp(1j * (np.angle(z) + s * angle))
        y = abs(b2 + (b3 - b2) / (bx + 1j * by - d12) * -d12)
        step = np.diff(y)
        lengths += list(y[np.flatnonzero(step[1:] * step[:-1] < 0) + 1])
    # samples miss an extremum by the square of their distance, 1.6e-4
    np.testing.assert_allclose(found.values, np.sort(lengths), atol=1e-6)


def test_other_drivers_stand_where_they_are_held():
    """A frame that a second driver holds is the ground: 1, 3, 2, 3.5 is Grashof's, in any tilt."""
    for tilt in (0.0, 0.7):
        machine = Mechanism("four-bar", ground={"O": (0, 0)})
        machine.add(
            Body("frame", points={"Q": (3.5, 0)}, guess=tilt),
            Body("crank", points={"A": (1, 0)}),
            Body("coupler", points={"B": (3, 0)}, guess=tilt + 0.3),
            Body("rocker", points={"B": (2, 0)}, guess=tilt + 1.7),
            Revolute("P", "ground.O", "frame"),
            AngleDriver("hold", "frame", tilt),
            Revolute("O", "ground.O", "crank"),
            Revolute("A", "crank.A", "coupler"),
            Revolute("B", "coupler.B", "rocker.B"),
            Revolute("Q", "frame.Q", "rocker"),
            AngleDriver("motor", "crank", 1.0 + tilt),
        )
        found = mbody.circuits(machine, driver="motor")
        assert found.complete and len(found) == 2 and found.dead_centres.full_turn
        moved = mbody.circuits(machine, {"hold": 1.1}, driver="motor")
        assert moved.complete and len(moved) == 2
