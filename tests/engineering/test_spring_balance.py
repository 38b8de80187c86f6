"""Springs that balance loads: closed forms, potential energy, scans."""

import itertools

import numpy as np
import pytest
from numpy.testing import assert_allclose

import mbody
from mbody.engineering import spring_balance
from mbody.laws import Constant, ConstantSpeed

G = 9.81


def arm(*elements, mass=2.0, centre=0.5, driver=True):
    machine = mbody.Mechanism("arm", ground={"top": (0, 0.4), "side": (0.5, 0.2), "low": (0, -0.6)})
    machine.add(
        mbody.Body("arm", mass=mass, cg=(centre, 0.0), points={"P": (0.3, 0.0), "Q": (0.6, 0.1)}),
        mbody.Revolute("O", "ground", "arm"),
        mbody.Gravity("g", y=-G),
    )
    if driver:
        machine.add(mbody.AngleDriver("hold", "arm", ConstantSpeed(0.0, 1.0)))
    machine.add(*elements) if elements else None
    return machine


def spring(name="spring", at="ground.top", of="arm.P", **more):
    return mbody.Spring(name, at, of, stiffness=more.pop("stiffness", 1.0), **more)


def two_arms():
    """An upright that stays parallel carries the spring of the second arm."""
    machine = mbody.Mechanism("two arms", ground={"top": (0, 0.4)})
    machine.add(
        mbody.Body("upper", mass=2.0, cg=(0.3, 0), points={"A": (0.6, 0), "P": (0.25, 0)}),
        mbody.Body("upright", mass=0.1, cg=(0, 0.05), points={"S": (0, 0.3)}),
        mbody.Body("fore", mass=1.5, cg=(0.2, 0.0), points={"Q": (0.2, 0)}),
        mbody.Revolute("O", "ground", "upper"),
        mbody.Revolute("A", "upper.A", "fore"),
        mbody.Revolute("U", "upper.A", "upright"),
        mbody.AngleDriver("level", "upright", Constant(0.0)),
        mbody.AngleDriver("m1", "upper", ConstantSpeed(0.0, 1.0)),
        mbody.AngleDriver("m2", "fore", ConstantSpeed(0.3, 2.3)),
        mbody.Gravity("g", y=-G),
    )
    return machine


TWO = [spring("s1", "ground.top", "upper.P"), spring("s2", "upright.S", "fore.Q")]


def test_an_arm():
    """k a b = m g l (Herder 2001), and no effort is left at any angle."""
    found = spring_balance(arm(), [spring()], turn=True)
    assert found.stiffness["spring"] == pytest.approx(2.0 * G * 0.5 / (0.4 * 0.3), rel=1e-13)
    assert found.complete and found.reason == "" and found.left < 1e-12
    run = mbody.statics(found.mechanism, t=np.linspace(0.1, 6.0, 17))
    assert np.abs(run.effort("hold")).max() < 1e-13 * 2.0 * G
    assert found.before["hold"][0] == pytest.approx(2.0 * G * 0.5, rel=1e-13)


def test_the_potential_energy_is_constant():
    """m g y + Σ k l²/2 by places alone, of two arms with two springs."""
    t = np.linspace(0.0, 6.0, 41)
    found = spring_balance(two_arms(), TWO, t=t)
    k1, k2 = found.stiffness.values()
    assert k1 == pytest.approx((2.0 * 0.3 + 1.6 * 0.6) * G / (0.4 * 0.25), rel=1e-12)
    assert k2 == pytest.approx(1.5 * 0.2 * G / (0.3 * 0.2), rel=1e-12)
    run = mbody.kinematics(two_arms(), np.linspace(0.3, 9.0, 37))
    energy = G * sum(m * run[b].y for b, m in (("upper", 2.0), ("upright", 0.1), ("fore", 1.5)))
    gravity = np.ptp(energy)
    for k, one in zip((k1, k2), TWO, strict=True):
        a, b = run.point(one.i), run.point(one.j)
        energy = energy + 0.5 * k * ((a.x - b.x) ** 2 + (a.y - b.y) ** 2)
    assert np.ptp(energy) < 1e-13 * gravity
    assert any("'level' does not move" in note for note in found.notes)


def test_stiffnesses_are_found_again():
    """The loads of springs of known stiffness, with free length and preload, taken with less."""
    known = {"a": 40.0, "b": 25.0, "c": 7.0}
    torque = mbody.TorsionSpring("c", "ground", "arm", stiffness=known["c"], free_angle=0.4)
    lines = [
        spring("a", "ground.side", "arm.Q", stiffness=known["a"], free_length=0.2, preload=1.5),
        spring("b", "ground.low", "arm.P", stiffness=known["b"], free_length=0.3),
    ]
    machine = arm(*lines, torque)
    t = np.linspace(0.0, 2.0, 33)
    effort = mbody.statics(machine, t).effort("hold")
    # what the driver gave is a load that follows time, against which they are found again
    table = mbody.laws.Table(t, -effort)
    loaded = arm(*lines, torque)
    loaded.add(mbody.Torque("given", "arm", value=mbody.laws.Table(t, effort)))
    assert table is not None
    found = spring_balance(loaded, ["a", "b", "c"], t=t)
    assert found.complete
    for name, k in known.items():
        assert found.stiffness[name] == pytest.approx(k, rel=1e-9)
    assert found.mechanism["a"].preload == 1.5 and found.mechanism["a"].free_length == 0.2


def test_the_best_where_something_is_left():
    """Beside a scan of stiffnesses: least mean square of the effort, none below zero."""
    springs = [
        spring("a", "ground.side", "arm.Q", free_length=0.3),
        spring("b", "ground.low", "arm.P"),
    ]
    t = np.linspace(0.0, 2.0, 21)
    found = spring_balance(arm(), springs, t=t)
    assert not found.complete and found.stiffness["b"] == 0.0 < found.stiffness["a"]
    assert "'b' would have to push" in found.reason and found.reason in found.notes
    weights = np.ones(21)
    weights[[0, -1]] = 0.5

    def rms(ka, kb):
        system = mbody.assemble(arm(*springs))
        system = system.with_values({"a.stiffness": ka, "b.stiffness": kb})
        effort = mbody.statics(system, t).effort("hold")
        return float(np.sqrt((weights * effort**2).sum()))

    best = rms(found.stiffness["a"], 0.0)
    assert best / rms(0.0, 0.0) == pytest.approx(found.left, rel=1e-9)
    for factor, kb in itertools.product((0.97, 1.0, 1.03), (0.0, 0.5)):
        if factor != 1.0 or kb:
            assert rms(factor * found.stiffness["a"], kb) > best


def test_a_slide_and_a_turn_count_alike():
    """Drivers of a length and of an angle: a hanging mass on a slide, and an arm beside."""
    machine = arm()
    machine.add(
        mbody.Body("block", mass=4.0),
        mbody.Prismatic("guide", mbody.Marker("ground", (2.0, 0.0), np.pi / 2), "block"),
        mbody.CoordinateDriver(
            "lift", mbody.Marker("ground", (2.0, 0.0), np.pi / 2), "block", ConstantSpeed(0.0, 0.3)
        ),
    )
    far = mbody.Marker("ground", (2.0, 1.0))
    springs = [spring(), spring("hang", far, "block", preload=4.0 * G)]
    found = spring_balance(machine, springs, t=np.linspace(0.0, 3.0, 31))
    # a constant tension holds the block: a stiffness would only disturb
    assert found.complete and found.stiffness["hang"] == pytest.approx(0.0, abs=1e-9)
    assert found.stiffness["spring"] == pytest.approx(81.75, rel=1e-12)
    assert set(found.after) == {"hold", "lift"}


def test_against_some_loads():
    """A torque that works is none of it."""
    machine = arm(mbody.Torque("work", "arm", value=-3.0))
    found = spring_balance(machine, [spring()], against=["g"], turn=True)
    assert found.complete and found.stiffness["spring"] == pytest.approx(81.75, rel=1e-12)
    run = mbody.statics(found.mechanism, turn=True)
    assert_allclose(run.effort("hold"), 3.0, rtol=1e-12)
    assert not spring_balance(machine, [spring()], turn=True).complete


@pytest.mark.parametrize("unit", [1.0, 1e-6])
def test_a_spring_that_acts_on_nothing(unit):
    """Between two pins that do not move apart; beside it one of its own does as without it."""
    arm = mbody.Mechanism("arm", ground={"top": (0.0, 0.4 * unit)})
    points = {"O": (0.0, 0.0), "P": (0.3 * unit, 0.0)}
    arm.add(
        mbody.Body("arm", mass=2.0, cg=(0.5 * unit, 0.0), points=points),
        mbody.Revolute("O", "ground", "arm"),
        mbody.AngleDriver("hold", "arm", mbody.laws.ConstantSpeed(0.0, 1.0)),
        mbody.Gravity("g", y=-9.81),
    )
    still = mbody.Spring("still", "ground.top", "arm.O", stiffness=1.0, free_length=0.1 * unit)
    found = spring_balance(arm, [still], turn=True)
    assert found.stiffness == {"still": 0.0} and found.left == pytest.approx(1.0)
    assert any("'still' acts on no driver" in note for note in found.notes)
    useful = mbody.Spring("useful", "ground.top", "arm.P", stiffness=1.0)
    found = spring_balance(arm, [still, useful], turn=True)
    # k a b = m g l
    assert found.stiffness["useful"] == pytest.approx(2.0 * 9.81 * 0.5 / (0.3 * 0.4) / unit)
    assert found.stiffness["still"] == 0.0 and found.complete
