"""Guesses that are missing follow from those that are given, against circles that cross."""

import math
from dataclasses import replace

import numpy as np
import pytest

import mbody
from mbody import AngleDriver, Body, Gear, Mechanism, Revolute, gallery
from mbody.engineering import close_loops
from mbody.laws import ConstantSpeed
from mbody.model.model_notes import snapshot, with_element

FREE = ("bouncing_ball", "double_pendulum", "simple_pendulum", "sliding_ladder", "woodpecker")
FREE += ("geneva_drive",)  # by contact


def without_guesses(machine, names):
    """The same, with no guess on some bodies."""
    made = snapshot(machine)
    for name in names:
        made = with_element(made, replace(machine[name], guess=None))
    return made


def angles(run):
    return np.array([float(run[body.name].angle[0]) for body in run.mechanism.bodies])


def apart(one, two):
    """The greatest difference of two lists of angles, without whole turns."""
    return float(
        np.abs(np.remainder(np.subtract(one, two) + math.pi, 2.0 * math.pi) - math.pi).max()
    )


def four_bar(lengths, crank, coupler=None, rocker=None):
    a, b, c, d = lengths
    machine = Mechanism("four-bar", ground={"O4": (d, 0.0)})
    machine.add(
        Body("crank", points={"A": (a, 0.0)}),
        Body("coupler", points={"B": (b, 0.0)}, guess=coupler),
        Body("rocker", points={"B": (c, 0.0)}, guess=rocker),
        Revolute("O2", "ground", "crank"),
        Revolute("A", "crank.A", "coupler"),
        Revolute("B", "coupler.B", "rocker.B"),
        Revolute("O4", "ground.O4", "rocker"),
        AngleDriver("motor", "crank", crank),
    )
    return machine


def both_ways(lengths, crank):
    """Angles of coupler and rocker of both assemblies: two circles about A and O4 cross at B."""
    a, b, c, d = lengths
    start, end = np.array([a * math.cos(crank), a * math.sin(crank)]), np.array([d, 0.0])
    far = math.dist(start, end)
    if not abs(b - c) * 1.05 < far < 0.95 * (b + c):
        return None
    along = (b * b - c * c + far * far) / (2.0 * far)
    way = (end - start) / far
    side = math.sqrt(b * b - along * along) * np.array([-way[1], way[0]])
    found = []
    for sign in (1.0, -1.0):
        place = start + along * way + sign * side
        found.append([math.atan2(*(place - p)[::-1]) for p in (start, end)])
    return found


def cases(count):
    rng = np.random.default_rng(8)
    while count:
        lengths, crank = rng.uniform(0.5, 4.0, 4), float(rng.uniform(-math.pi, math.pi))
        ways = both_ways(lengths, crank)
        if ways is not None:
            count -= 1
            yield lengths, crank, ways, rng


@pytest.mark.slow
def test_one_guess_chooses_the_assembly():
    """Either link alone, up to 20 degrees off, where the other assembly is twice as far away."""
    asked = 0
    for lengths, crank, ways, rng in cases(60):
        for n, way in enumerate(ways):
            other = ways[1 - n]
            for k, name in enumerate(("coupler", "rocker")):
                off = float(rng.uniform(-1.0, 1.0)) * math.radians(20.0)
                if apart(way[k] + off, other[k]) < 2.0 * abs(off) + 0.1:
                    continue
                asked += 1
                machine = four_bar(lengths, crank, **{name: way[k] + off})
                run = close_loops(machine)
                assert apart(angles(run)[1:], way) < 1e-9
                # the forces follow the same assembly
                assert apart(angles(mbody.kinetostatics(machine))[1:], way) < 1e-9
    assert asked > 100


def test_no_guess_is_noted():
    """Both assemblies are as near to no guess at all: a note says where the other one is."""
    for lengths, crank, ways, _ in cases(10):
        run = mbody.kinetostatics(four_bar(lengths, crank))
        found = angles(run)[1:]
        assert min(apart(found, way) for way in ways) < 1e-9
        (note,) = run.notes
        assert "has no guess" in note and "a guess chooses" in note
        assert run.status == "completed"
        other = max(ways, key=lambda way: apart(found, way))
        said = {round(math.degrees(angle), 1) for angle in other}
        assert any(f"{angle:.1f} deg as well" in note for angle in said)
        assert (
            angles(mbody.kinetostatics(four_bar(lengths, crank))).tobytes() == angles(run).tobytes()
        )


def test_whole_guesses_have_no_note():
    for lengths, crank, ways, _ in cases(5):
        for coupler, rocker in ways:
            run = mbody.kinetostatics(four_bar(lengths, crank, coupler + 0.1, rocker - 0.1))
            assert run.notes == () and apart(angles(run)[1:], (coupler, rocker)) < 1e-9


def models():
    small = [name for name in gallery.names() if name != "n_windows_40"]
    return [name for name in small if name not in FREE]


@pytest.mark.parametrize("name", models())
def test_gallery_without_guesses(name):
    """The same assembly, or a note; of a free motion, which has no one position, close by."""
    machine = gallery.load(name)
    full = close_loops(machine)
    assert not any("has no guess" in note for note in full.notes)
    guessed = [body.name for body in machine.bodies if body.guess.angle is not None]
    parts = [[one] for one in guessed]
    if len(guessed) > 1 and name != "n_windows_2":  # without any guess it lies flat, and closed
        parts.append(guessed)
    for names in parts:
        run = close_loops(without_guesses(machine, names))
        assert run.checks.constraint < 1e-9
        noted = any("has no guess" in note for note in run.notes)
        off = apart(angles(run), angles(full))
        near = 1e-6 if machine.drivers else math.radians(3.0)
        assert off < near or noted, (names, math.degrees(off))


def test_places_of_a_drawing_need_no_guess():
    """Points in world coordinates of one closed position: the links begin where they are drawn."""
    machine = Mechanism("drawn", ground={"O4": (3.5, 0.0)})
    a, b = (0.5, math.sqrt(0.75)), (3.1, 1.9)
    machine.add(
        Body("crank", points={"A": a}),
        Body("coupler", points={"A": a, "B": b}),
        Body("rocker", points={"O4": (3.5, 0.0), "B": b}),
        Revolute("O2", "ground", "crank"),
        Revolute("A", "crank.A", "coupler.A"),
        Revolute("B", "coupler.B", "rocker.B"),
        Revolute("O4", "ground.O4", "rocker.O4"),
        AngleDriver("motor", "crank", ConstantSpeed(0.0, 2.0)),
    )
    run = mbody.kinetostatics(machine)
    assert run.notes == () and np.abs(angles(run)).max() < 1e-14
    assert run.point("coupler.B").x[0] == pytest.approx(3.1, abs=1e-14)


def gear_train(*, off=0.0, linked=False):
    """A driven pinion and a wheel of twice its radius, whose mass centre is `off` its axis."""
    machine = Mechanism("train", ground={"A": (0.0, 0.0), "B": (0.3, 0.0), "C": (1.2, 0.0)})
    machine.add(
        Body("pinion", points={"A": (0.0, 0.0)}),
        Body("wheel", cg=(off, 0.0), points={"B": (0.0, 0.0), "P": (0.15, 0.0)}),
        Revolute("A", "ground.A", "pinion.A"),
        Revolute("B", "ground.B", "wheel.B"),
        Gear("mesh", "pinion.A", "wheel.B", 0.1, 0.2),
        AngleDriver("motor", "pinion", ConstantSpeed(1.0, 2.0)),
    )
    if linked:
        machine.add(
            Body("rod", points={"P": (0.0, 0.0), "Q": (0.8, 0.0)}),
            Body("rocker", points={"C": (0.0, 0.0), "Q": (0.6, 0.0)}, guess="100 deg"),
            Revolute("P", "wheel.P", "rod.P"),
            Revolute("Q", "rod.Q", "rocker.Q"),
            Revolute("C", "ground.C", "rocker.C"),
        )
    return machine


def test_other_teeth_are_no_other_assembly():
    """A wheel that only turns meshes with other teeth: no note. One has a note whose weight, or a
    rod, would be elsewhere.
    """
    assert mbody.kinematics(gear_train()).notes == ()
    for machine in (gear_train(off=0.05), gear_train(linked=True)):
        (note,) = mbody.kinematics(machine).notes
        assert "has no guess" in note and "a guess chooses" in note
