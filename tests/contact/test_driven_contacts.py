"""Kinetostatics of bodies that slide and roll on each other: closed forms, joints of the same rows,
dense equations.
"""

import math

import numpy as np
import pytest

import mbody
from mbody.solution.contact_points import contact_points_at
from tests.support import driven_contacts as models

G = 9.81


@pytest.mark.parametrize("speed", [1.0, -1.0])
def test_a_box_is_drawn_along_an_incline(speed):
    """W (sin α ± μ cos α) + m a, and the shares of its corners by moments."""
    height, change = 0.1, 0.7
    machine = models.box(height=height)
    run = mbody.kinetostatics(machine, drive={"pull": (np.linspace(0.0, 0.2, 5), speed, change)})
    rubs, slope = 0.2 * math.copysign(1.0, speed), 0.5
    needed = 50.0 * (math.sin(slope) + rubs * math.cos(slope)) + 50.0 / G * change
    assert run.effort("pull") == pytest.approx(needed, abs=1e-12)
    assert run.mode("under") == ["slip+" if speed > 0.0 else "slip-"] * 5
    assert run.losses["under"] == pytest.approx(0.2 * 50.0 * math.cos(slope), abs=1e-12)
    # about the mass centre: the pull by its height, friction by that of the floor, both corners
    moment = needed * height + rubs * 50.0 * math.cos(slope) * 0.25
    for k in range(len(run)):
        lower, upper = corner_forces(run, k)
        assert 0.5 * (upper - lower) == pytest.approx(moment, abs=1e-12)
    assert run.friction.certified.all()
    assert mbody.crosscheck(machine, "balance,oracle", ours=run).agrees


def corner_forces(run, k):
    """Normal forces at the two corners of a box at an instant, the lower one first."""
    found = []
    for one in contact_points_at(run, k, "under"):
        along = float(one.place[0] @ [math.cos(0.5), math.sin(0.5)])
        found.append((along, float(one.force[0] @ one.normal[0])))
    return [force for _, force in sorted(found)]


def test_wheels_roll_where_nothing_else_turns_them():
    """A vehicle that is slowed down at its rear axle: by its inertia, loads by moments."""
    run = mbody.kinetostatics(models.vehicle())
    assert run.mode("back") == run.mode("ahead") == ["roll"]
    assert run["rear"].omega[0] == pytest.approx(-20.0 / 0.3, abs=1e-12)
    turning = 3.0 / 0.3  # of the wheels, counterclockwise
    needed = -3.0 * (1040.0 + 2.0 / 0.09)
    assert run.effort("along")[0] == pytest.approx(needed, abs=1e-9)
    assert run.reaction("back").fx[0] == pytest.approx(turning / 0.3, abs=1e-9)
    # moments about the foot of the rear wheel: Σ x N = Σ (x m g − y m a_x + I α) + y P
    ahead = (1000.0 * 1.1 + 20.0 * 2.5) * G + (1000.0 * 0.7 + 40.0 * 0.3) * 3.0
    ahead = (ahead + 2.0 * turning + 0.3 * needed) / 2.5
    assert run.contact("ahead")[0] == pytest.approx(ahead, abs=1e-9)
    assert run.contact("back")[0] == pytest.approx(1040.0 * G - ahead, abs=1e-9)
    assert mbody.crosscheck(models.vehicle(), "balance,oracle", ours=run).agrees


def test_a_wheel_that_would_slip_is_doubted():
    machine = models.vehicle(mu=0.3)
    machine.add(mbody.Torque("brake", "rear", "body", value=3000.0))
    run = mbody.kinetostatics(machine)
    (doubt,) = run.doubts
    assert (doubt.kind, doubt.elements) == ("contact", ("back",))
    needed = abs(run.reaction("back").fx[0]) / run.contact("back")[0]
    assert f"needs a coefficient of friction of {needed:.6g}, there is 0.3" in doubt.message


@pytest.mark.parametrize("mu", [0.0, 0.1, 0.3])
def test_discs_that_slide_on_each_other(mu):
    """An eccentric over a turn, by dense equations of its own geometry."""
    machine = models.eccentric(mu)
    run = mbody.kinetostatics(machine, turn="motor", instants=73)
    assert run.status == "completed"
    assert (run.contact("lifts") > 0.0).all()
    found = mbody.crosscheck(machine, "balance,oracle", ours=run)
    assert found.agrees, str(found)
    given = run.effort("motor") * 5.0
    lost = run.losses["lifts"][:-1].mean()
    # over a turn weights and inertia take nothing
    assert given[:-1].mean() == pytest.approx(lost, abs=1e-9 * np.abs(given).max())


@pytest.mark.parametrize("mu", [0.0, 0.15])
def test_a_contact_is_a_pin_in_a_slot_while_it_presses(mu):
    times = np.linspace(0.0, 0.7, 41)
    ours, theirs = (mbody.kinetostatics(models.yoke(joint, mu), times) for joint in (False, True))
    assert ours.status == "completed"
    for name in ("motor", "guide", "upright"):
        assert ours.effort(name) == pytest.approx(theirs.effort(name), abs=1e-11)
    one, other = ours.reaction("pin", on="yoke"), theirs.reaction("pin", on="yoke")
    assert one.fx == pytest.approx(other.fx, abs=1e-11)
    assert one.fy == pytest.approx(other.fy, abs=1e-11)
    if mu:
        assert ours.losses["pin"] == pytest.approx(theirs.losses["pin"], abs=1e-11)


def test_derivatives():
    """Of W (sin α + μ cos α) by μ and W; the hand is led along a direction that does not turn."""
    names = ["under.friction", "box.weight"]
    drive = {"pull": ([0.1], [1.0], [0.0])}
    measures = {"pull": "pull.effort", "floor": "under.contact"}
    g = mbody.gradient(models.box(height=0.1), measures, names, drive=drive)
    c, s = math.cos(0.5), math.sin(0.5)
    assert g.jacobian[0].ravel() == pytest.approx([50.0 * c, s + 0.2 * c], abs=1e-11)
    assert g.jacobian[1].ravel() == pytest.approx([0.0, c], abs=1e-11)


def test_past_the_end_of_an_edge():
    machine = models.sledge()
    assert mbody.kinetostatics(machine, np.linspace(0.0, 0.5, 6)).status == "completed"
    run = mbody.kinetostatics(machine, np.linspace(0.0, 1.0, 11))
    (doubt,) = run.doubts
    assert doubt.kind == "contact"
    assert doubt.t == pytest.approx(0.6)
    assert "past the end of its edge by up to 0.5 m" in doubt.message


def test_bodies_that_pass_through_each_other_are_doubted():
    """A contact that determines nothing is left out, and what overlaps is named."""
    run = mbody.kinetostatics(models.crank_over_a_floor(), turn="motor")
    (doubt,) = run.doubts
    assert doubt.elements == ("tip",)
    assert "overlap by up to 0.3 m" in doubt.message
    assert any("left out of kinetostatics" in note for note in run.notes)
    assert dict(run.losses) == {}


def test_equations_and_breakdown_have_contacts():
    run = mbody.kinetostatics(models.box(height=0.1), drive={"pull": ([0.0], [1.0], [0.5])})
    system = run.equations()
    assert system.unknowns == ("N1,under", "N2,under", "F12,pull")
    assert np.abs(system.residual).max() < 1e-12
    assert "N1,under" in str(system)
    whole, parts = run.reaction("under"), run.breakdown("under")
    assert set(parts) == {"inertia", "gravity", "friction"}
    for key in ("fx", "fy", "torque"):
        total = sum(getattr(part, key) for part in parts.values())
        assert total == pytest.approx(getattr(whole, key), abs=1e-12)
    text = run.derivation()
    assert "F(under1,2,x)" in text
    assert "F(under2,2,x)" in text


def test_a_wheel_rolls_on_a_line_from_where_it_begins(tmp_path):
    turned = models.rolling_disc(models.LINE, 1.0, 0.2, 0.3)
    turned.add(mbody.AngleDriver("motor", "disc", "0.3 rad + 0.5 rad/s*t"))
    run = mbody.kinetostatics(turned, t=[0.0, 2.0])
    assert run["disc"].x == pytest.approx([1.0, 1.0 - 0.2 * 1.0], abs=1e-12)
    late = mbody.kinetostatics(turned, t=[2.0])  # whatever the instants that are requested
    assert late["disc"].x == pytest.approx([1.0 - 0.2 * 1.0], abs=1e-12)
    mbody.save_run(run, tmp_path / "run.npz")
    again = mbody.load_run(tmp_path / "run.npz")
    assert again.mechanism["road"].rolls_from == run.mechanism["road"].rolls_from
    led = models.rolling_disc(models.LINE, 1.0, 0.2, 0.3)
    led.add(mbody.CoordinateDriver("hand", "ground.O", "disc.C", "1 m + 0.1 m/s*t"))
    run = mbody.kinetostatics(led, t=[0.0, 1.0])
    assert run["disc"].angle == pytest.approx([0.3, 0.3 - 0.1 / 0.2], abs=1e-12)


@pytest.mark.parametrize("shape", [models.LINE, models.RING])
def test_derivatives_where_a_wheel_rolls(shape):
    """By the radius: of r φ about the place where it begins, of a ring by (R − r) and its angle."""
    first = math.radians(-50.0)
    ring = shape is models.RING
    x, y = (0.8 * math.cos(first), 0.8 * math.sin(first)) if ring else (1.0, 0.2)
    machine = models.rolling_disc(shape, x, y, 0.0)
    machine.add(mbody.AngleDriver("motor", "disc", "0.5 rad/s*t"))
    g = mbody.gradient(machine, "at(disc.x, 1)", ["disc.rim.radius"], t=[0.0, 1.0])
    turned, r = 0.5, 0.2
    if ring:  # x = (1 − r) cos(first − r φ/(1 − r))
        way = first - r * turned / (1.0 - r)
        expected = -math.cos(way) + math.sin(way) * turned / (1.0 - r)
    else:
        expected = -turned
    assert g.jacobian.ravel() == pytest.approx([expected], abs=1e-9)
