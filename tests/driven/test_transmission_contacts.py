"""Transmission by contact: Genevas against the closed form of the wheel, cams against their own."""

import math

import numpy as np
import pytest

import mbody
from mbody import SimulationSettings
from mbody.engineering import cam_analysis
from tests.contact.test_geneva_contact import OMEGA, by_hand, drive
from tests.support.frictional import cam_drive

PLAY = 2e-3


@pytest.mark.parametrize("slots", [4, 6])
def test_a_geneva_by_the_closed_form(slots):
    """In a slot ẏ/ẋ is that of the flank which touches, at s from the wheel's axis the force has
    the arm √(s² − a²) with a half of the play, and μ = acos(a/s) at the pin's centre. The lock
    holds: 0.
    """
    machine, crank, enters = drive(slots, play=PLAY, gap=2e-4, drag=0.02)
    run = mbody.simulate(machine, math.tau / OMEGA, rtol=1e-9, instants=201)
    found = mbody.transmission(run, output="wheel")
    theta, seen = run["crank"].angle, 0
    names = {name.partition("_")[0] for name in found.joint.split(", ")}
    assert names == {"fore", "back"}
    within = np.abs(theta) < enters - 0.05
    for name, aside in (("back", 0.5 * PLAY), ("fore", -0.5 * PLAY)):
        group = [one.name for one in run.mechanism.contacts if one.name.startswith(f"{name}_")]
        shut = np.any([np.array(run.mode(one)) != "open" for one in group], axis=0) & within
        _, rate, _ = by_hand(crank, theta[shut], aside)
        s = np.sqrt(1.0 + crank**2 - 2.0 * crank * np.cos(theta[shut]))
        # positions are those of an integration at 1e-9
        np.testing.assert_allclose(found.velocity_ratio[shut], -rate, atol=1e-7)
        np.testing.assert_allclose(found.mechanical_advantage[shut], -1.0 / rate, rtol=1e-6)
        np.testing.assert_allclose(np.cos(found.angle[shut]), 0.5 * PLAY / s, atol=1e-7)
        arm = np.sqrt(s * s - 0.25 * PLAY**2)
        np.testing.assert_allclose(found.joint_force_index[shut], 1.0 / arm, rtol=1e-7)
        # one group alone has the same, and none where the other one leads
        alone = mbody.transmission(run, output="wheel", joint=name)
        np.testing.assert_array_equal(alone.angle[shut], found.angle[shut])
        assert np.isnan(alone.angle[within & ~shut]).all()
        seen += shut.sum()
    assert seen > 0.6 * within.sum()
    # about the closed form without play, R(cos θ − R)/(1 + R² − 2 R cos θ) (Norton)
    plain = crank * (np.cos(theta) - crank) / (1.0 + crank**2 - 2.0 * crank * np.cos(theta))
    there = within & np.isfinite(found.velocity_ratio)
    assert np.abs(found.velocity_ratio[there] + plain[there]).max() < 2.0 * PLAY
    dwell = (theta > enters + 0.3) & (theta < math.tau - enters - 0.3)
    held = dwell & np.isfinite(found.velocity_ratio)
    # where it is held: a wheel without load stands between the flanks of the lock
    assert (found.velocity_ratio[held] == 0.0).all() and np.isnan(found.angle[held]).all()
    assert np.isinf(found.mechanical_advantage[held]).all()
    loose = int(np.isnan(found.velocity_ratio).sum())
    assert bool(loose) == any(f"at {loose} of 201 instants" in note for note in found.notes)


def test_the_same_flank_in_kinematics():
    """Where a flank is closed for good the ratio is that of the wheel's own motion."""
    machine, crank, enters = drive(4, play=PLAY, gap=2e-4)
    machine = machine.without("motor")
    law = mbody.laws.ConstantSpeed(0.3 - enters, OMEGA)
    machine.add(mbody.AngleDriver("motor", "crank", law))
    angle, _, _ = by_hand(crank, 0.3 - enters, 0.5 * PLAY)
    own = {"angle": math.pi - 0.5 * math.pi - float(angle)}
    machine.simulation = SimulationSettings(until=0.1, start={"wheel": own})
    run = mbody.kinematics(machine, np.linspace(0.0, 0.4, 9))
    found = mbody.transmission(run, output="wheel")
    assert found.joint.startswith("back_")
    ratio = run["wheel"].omega / run["crank"].omega
    np.testing.assert_allclose(found.velocity_ratio, ratio, rtol=1e-9)
    rate = by_hand(crank, run["crank"].angle, 0.5 * PLAY)[1]
    np.testing.assert_allclose(found.velocity_ratio, -rate, rtol=1e-9)
    # between the instants, too: μ is least where the pin is nearest to the wheel's axis
    assert found.least.value <= found.angle.min()
    # a flat least value: sin μ = √(1 − a²/s²) to rounding
    assert found.least.driver == pytest.approx(0.0, abs=0.05)


def test_a_swinging_roller_has_the_pressure_angle_of_its_cam():
    """By the velocity of the roller's centre, as `cam_analysis` has it by another way."""
    run = mbody.kinematics(cam_drive("roller", swinging=True), turn=True, instants=73)
    found, cam = mbody.transmission(run, output="tappet"), cam_analysis(run)
    there = np.isfinite(found.angle)
    assert there.sum() > 60
    size = np.abs(cam.pressure_angle[there])
    np.testing.assert_allclose(np.sin(found.pressure_angle[there]), np.sin(size), atol=1e-9)
