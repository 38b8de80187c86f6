"""Cognates draw the same curve at the same time, and are of the class that theory wants."""

import json
import math

import numpy as np
import pytest

import mbody
from mbody import AngleDriver, Body, Marker, Mechanism, PinSlot, Prismatic, Revolute
from mbody.cli import main
from mbody.laws import ConstantSpeed
from mbody.synthesis import cognates


def four_bar(lengths, p, start, driven="crank", name="made"):
    a, b, c, d = lengths
    machine = Mechanism(name, ground={"O2": (0.3, -0.2), "O4": (0.3 + d, -0.2)})
    machine.add(
        Body("crank", points={"O2": (0, 0), "A": (a, 0)}),
        Body("coupler", points={"A": (0, 0), "B": (b, 0), "P": p}, guess=0.3),
        Body("rocker", points={"O4": (0, 0), "B": (c, 0)}, guess=1.4),
        Revolute("O2", "ground.O2", "crank.O2"),
        Revolute("A", "crank.A", "coupler.A"),
        Revolute("B", "coupler.B", "rocker.B"),
        Revolute("O4", "ground.O4", "rocker.O4"),
        AngleDriver("motor", driven, ConstantSpeed(start, 1.0)),
    )
    return machine


def slider_crank(offset, tilt, p, slot=False):
    machine = Mechanism("slider-crank", ground={"O": (0, 0), "G": (0.1, offset)})
    guide = Marker("ground", "G", angle=tilt)
    machine.add(
        Body("crank", points={"O": (0, 0), "A": (1, 0)}),
        Body("rod", points={"A": (0, 0), "B": (3, 0), "P": p}, guess=-0.2),
        Revolute("O", "ground.O", "crank.O"),
        Revolute("A", "crank.A", "rod.A"),
        AngleDriver("motor", "crank", ConstantSpeed("50 deg", 2.0)),
    )
    if slot:
        machine.add(PinSlot("guide", guide, "rod.B"))
    else:
        machine.add(
            Body("slider", points={"B": (0.2, -0.1)}, guess=tilt),
            Revolute("B", "rod.B", "slider.B"),
            Prismatic("guide", guide, "slider"),
        )
    return machine


def path(machine, point, times):
    run = mbody.kinematics(machine, times)
    at = run.point(point)
    return np.column_stack([at.x, at.y, at.vx, at.vy])


def compare(machine, point, times):
    """The greatest difference of places and velocities, as a part of the size of the curve."""
    first = path(machine, point, times)
    found = cognates(machine, point)
    size = np.abs(first).max()
    for one in found:
        assert np.abs(path(one.mechanism, "coupler.P", times) - first).max() < 1e-12 * size
    return found


@pytest.mark.parametrize(
    "lengths",
    [(1.0, 3.0, 2.0, 3.5), (3.0, 2.5, 3.2, 1.0), (2.0, 3.0, 1.0, 3.5), (3.0, 4.0, 5.0, 7.0)],
    ids=["crank-rocker", "double crank", "rocker-crank", "triple rocker"],
)
@pytest.mark.parametrize("p", [(1.0, 1.5), (4.0, -1.0), (1.2, 0.0)])
def test_four_bars_draw_the_same_curve(lengths, p):
    """Also of points on the line of the pins, λ real; what does not turn within its range."""
    turns = lengths[0] in (1.0, 3.0) and lengths != (3.0, 4.0, 5.0, 7.0)
    start = {2.0: 0.8, 3.0: 1.0}.get(lengths[0], 0.4)
    times = np.linspace(0.0, 2 * math.pi if turns else 0.3, 73)
    found = compare(four_bar(lengths, p, start), "coupler.P", times)
    assert len(found) == 2


def test_classes_of_cognates():
    """Of a crank-rocker: a double rocker and a crank-rocker; of a triple rocker and of a double
    crank the same (Hunt, 7.6).
    """
    for lengths, classes in {
        (1.0, 3.0, 2.0, 3.5): ["Grashof: double rocker", "Grashof: crank-rocker"],
        (3.0, 2.5, 3.2, 1.0): ["Grashof: double crank", "Grashof: double crank"],
        (3.0, 4.0, 5.0, 7.0): ["not Grashof: triple rocker"] * 2,
    }.items():
        found = cognates(four_bar(lengths, (1.0, 1.5), 1.0), "coupler.P")
        assert [one.grashof for one in found] == classes
        # the same, decided by the certified search of dead centres of the link that turns
        for one in found:
            turning = mbody.dead_centres(one.mechanism).full_turn
            (driven,) = (driver.body for driver in one.mechanism.drivers)
            inversion = one.grashof.partition(": ")[2]
            round_ = {
                "crank-rocker": ("crank",),
                "double crank": ("crank", "coupler", "rocker"),
                "double rocker": ("coupler",),
            }.get(inversion, ())
            assert turning is (driven in round_), (lengths, one)


def test_lengths_by_similar_triangles():
    """Roberts' diagram: ground, crank, coupler and rocker of the first one times λ and 1 − λ."""
    found = cognates(four_bar((1.0, 3.0, 2.0, 3.5), (1.0, 1.5), 0.4), "coupler.P")
    ratio = complex(1.0, 1.5) / 3.0
    one, two = (list(each.lengths.values()) for each in found)
    assert one == pytest.approx([abs(ratio) * x for x in (3.5, 3.0, 1.0, 2.0)], rel=1e-14)
    assert two == pytest.approx([abs(1 - ratio) * x for x in (3.5, 1.0, 2.0, 3.0)], rel=1e-14)


@pytest.mark.parametrize("slot", [False, True])
@pytest.mark.parametrize("offset", [0.0, 0.4])
def test_slider_cranks_have_one(slot, offset):
    machine = slider_crank(offset, 0.3, (1.2, 0.8), slot)
    found = compare(machine, "rod.P", np.linspace(0.0, math.pi, 73))
    assert len(found) == 1 and not found[0].grashof


def test_driven_at_the_coupler_or_the_rocker():
    times = np.linspace(0.0, 0.2, 9)
    for driven in ("coupler", "rocker"):
        machine = four_bar(
            (1.0, 3.0, 2.0, 3.5), (1.0, 1.5), 0.3 if driven == "coupler" else 2.0, driven
        )
        assert len(compare(machine, "coupler.P", times)) == 2


def test_within_a_larger_mechanism():
    """The four-bar of Stephenson's six-bar; the others are left out, which a note says."""
    found = compare(mbody.gallery.load("stephenson_sixbar"), "coupler.P", np.linspace(0, 1.0, 31))
    assert any("without" in note and "output" in note for note in found.notes)


def test_what_has_no_cognates():
    machine = four_bar((1.0, 3.0, 2.0, 3.5), (3.0, 0.0), 0.4)
    with pytest.raises(mbody.ModelError, match="is at a pin, whose path is a circle"):
        cognates(machine, "coupler.P")
    with pytest.raises(mbody.ModelError, match="'rocker' is no coupler of a four-bar"):
        cognates(machine, "rocker.B")
    with pytest.raises(mbody.ModelError, match="is on the ground"):
        cognates(machine, "ground.O2")


def test_the_command(tmp_path, capsys):
    file = tmp_path / "cognate.toml"
    words = ["cognates", "hoekens", "--point", "coupler.P"]
    assert main([*words, "-o", str(file), "--json"]) == 0
    data = json.loads(capsys.readouterr().out)
    assert [one["file"] for one in data["cognates"]] == [
        str(file),
        str(tmp_path / "cognate-2.toml"),
    ]
    times = np.linspace(0.0, 0.5, 21)
    first = path(mbody.gallery.load("hoekens"), "coupler.P", times)
    for one in data["cognates"]:
        again = path(mbody.load(one["file"]), "coupler.P", times)
        assert np.abs(again - first).max() < 1e-11 * np.abs(first).max()
    assert main(words) == 0
    assert "links of cognate 1 turn as those of the first" in capsys.readouterr().out
