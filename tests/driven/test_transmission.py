"""Transmission: against the closed forms of textbooks, and against statics with the load alone."""

import math

import numpy as np
import pytest

import mbody
from mbody import Torque
from mbody.analysis.driven.transmission import grashof_class

A, B, C, D = LENGTHS = 1.0, 3.0, 2.0, 3.5


def turned(machine, instants=73):
    return mbody.kinematics(machine, turn=True, instants=instants)


def test_four_bar_by_the_law_of_cosines():
    """μ is the angle between coupler and rocker (Norton, Design of Machinery, section 4.10)."""
    run = turned(mbody.makers.four_bar(*LENGTHS, speed=2.0))
    found = mbody.transmission(run, output="rocker")
    diagonal = A * A + D * D - 2.0 * A * D * np.cos(run["crank"].angle)
    between = np.arccos((B * B + C * C - diagonal) / (2.0 * B * C))
    # an angle of 1e-12: loops close to 1e-13, and arcsin near 90 deg loses half of the digits
    assert np.abs(np.sin(found.angle) - np.sin(between)).max() < 1e-12
    assert found.pressure_angle == pytest.approx(0.5 * math.pi - found.angle)
    assert found.joint == "B"
    least = math.acos((B * B + C * C - (D + A) ** 2) / (2.0 * B * C))
    assert found.least.value == pytest.approx(math.pi - least, abs=1e-12)
    assert math.cos(found.least.driver) == pytest.approx(-1.0, abs=1e-10)
    ratio = run["rocker"].omega / run["crank"].omega
    assert found.velocity_ratio == pytest.approx(ratio, rel=1e-10, abs=1e-12)
    assert found.mechanical_advantage == pytest.approx(1.0 / ratio, rel=1e-8)


def test_the_least_angle_lies_between_instants():
    """Six instants a turn miss 180 deg; the search between them does not."""
    run = mbody.kinematics(mbody.makers.four_bar(*LENGTHS), drive={"motor": np.linspace(2, 4, 4)})
    found = mbody.transmission(run, output="rocker")
    assert found.least.driver == pytest.approx(math.pi, abs=1e-6)
    assert found.least.value < found.angle.min() - 1e-3


def test_slider_crank_by_the_angle_of_the_rod():
    """cos μ = a |sin θ|/l, with a least of acos(a/l) at 90 deg."""
    machine = mbody.makers.slider_crank(1.0, 3.0)
    run = turned(machine, 73)
    found = mbody.transmission(run, output="slider")
    inside = np.isfinite(found.angle)
    assert inside.sum() >= 71  # none where the slider turns back
    sine = np.abs(np.sin(run["crank"].angle)) / 3.0
    # the angle of force and guide
    assert np.cos(found.angle[inside]) == pytest.approx(sine[inside], abs=1e-9)
    assert found.least.value == pytest.approx(math.acos(1.0 / 3.0), abs=1e-10)


def test_forces_are_those_of_statics_with_the_load_alone():
    """The joint force index is the greatest force of `statics` under a unit torque."""
    plain = mbody.makers.four_bar(*LENGTHS, start=1.0)
    found = mbody.transmission(mbody.kinematics(plain), output="rocker")
    loaded = mbody.makers.four_bar(*LENGTHS, start=1.0)
    loaded.add(Torque("load", "rocker", value=1.0))
    run = mbody.statics(loaded)
    joints = [run.reaction(name) for name in ("O2", "A", "B", "O4")]
    most = max(math.hypot(float(one.fx[0]), float(one.fy[0])) for one in joints)
    assert found.joint_force_index[0] == pytest.approx(most, rel=1e-12)
    assert abs(run.effort("motor")[0]) == pytest.approx(abs(found.velocity_ratio[0]), rel=1e-12)


def test_a_cam_has_the_pressure_angle_of_its_profile():
    """tan α = s′/(r + s) of a radial roller follower, on the pitch curve."""
    machine = mbody.gallery.load("cam_follower")
    run = mbody.kinematics(machine, turn=True, instants=37)
    found = mbody.transmission(run, output="follower")
    lift = run["follower"].vy / run["shaft"].omega
    x, y = run.reaction_point("contact")
    assert found.joint == "contact"
    moving = np.isfinite(found.angle)
    tangent = np.abs(lift / (run["follower"].y - run["shaft"].y))
    assert np.tan(found.pressure_angle[moving]) == pytest.approx(tangent[moving], abs=1e-9)
    assert np.isfinite(x).all() and np.isfinite(y).all()


def test_dead_centres_of_driver_and_output():
    """At a dead centre of the driver the ratio is infinite; where the output turns back it is 0."""
    dead = math.acos(2 / 3)
    near = mbody.makers.four_bar(6, 18, 12, 8, start=dead + 1e-6)
    found = mbody.transmission(mbody.kinematics(near), output="rocker")
    assert abs(found.velocity_ratio[0]) > 100.0 and found.angle[0] < 1e-2
    # coupler and crank on a line
    reach = B + A
    theta = math.acos((reach**2 + D * D - C * C) / (2.0 * reach * D))
    still = mbody.makers.four_bar(*LENGTHS, start=theta)
    found = mbody.transmission(mbody.kinematics(still), output="rocker")
    assert abs(found.velocity_ratio[0]) < 1e-9
    assert abs(found.mechanical_advantage[0]) > 1e9


@pytest.mark.parametrize(
    ("lengths", "words"),
    [
        ((3.5, 1, 3, 2), "Grashof: crank-rocker"),
        ((1, 3, 2.5, 3.2), "Grashof: double crank"),
        ((5, 4, 2, 3.5), "Grashof: double rocker"),
        ((3.5, 2, 3, 1), "Grashof: rocker-crank"),
        ((8, 6, 18, 12), "not Grashof: triple rocker"),
        ((3, 1, 3, 1), "Grashof: change point"),
    ],
)
def test_grashof_agrees_with_the_proof(lengths, words):
    """The words, beside what `dead_centres` proves of the same lengths."""
    assert grashof_class(*lengths) == words
    ground, crank, coupler, rocker = lengths
    machine = mbody.makers.four_bar(crank, coupler, rocker, ground, start=1.0)
    proof = mbody.dead_centres(machine)
    if proof.complete:
        assert proof.full_turn == (words in ("Grashof: crank-rocker", "Grashof: double crank"))
    else:
        assert words == "Grashof: change point"
