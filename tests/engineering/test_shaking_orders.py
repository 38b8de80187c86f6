"""Orders of shaking forces, balance shafts, couples and firing orders, against closed forms."""

import math

import numpy as np
import pytest
from numpy.testing import assert_allclose

import mbody
from mbody import AngleCoupling, AngleDriver, Body, CouplingTerm, Mechanism, Revolute, Torque
from mbody.engineering import (
    balance_shafts,
    firing_angles,
    harmonics,
    rocking_couple,
    shaking_force,
    shaking_orders,
)
from mbody.errors import ModelError
from mbody.laws import ConstantSpeed, Table
from tests.support.engines import engine

TURN = 2.0 * math.pi
#: m r ω² of the engines.
UNIT = 0.5 * 0.05 * 100.0**2
#: Forces of joints are known to 1e-13 of the greatest, which is some ten units here.
ROUNDED = 1e-11 * UNIT
#: m r ω² and orders 1, 2, 4, 6 of a piston, r/l = 0.25 (Fourier series, by extended precision).
QUARTER = {1: 1.0, 2: 0.2540250423069754, 4: -0.004098111172029359, 6: 7.437903279403012e-05}


def orders_of(machine, **more):
    return shaking_orders(mbody.kinetostatics(machine, turn=True, instants=145), **more)


# -- harmonics ------------------------------------------------------------------------------------


@pytest.mark.parametrize("sense", [1.0, -1.0])
@pytest.mark.parametrize("start", [0.0, 0.7])
def test_harmonics_are_of_the_angle_itself(sense, start):
    """Two turns: half orders, cosine and sine of the driver's own angle wherever it begins."""
    theta = start + sense * np.linspace(0.0, 2.0 * TURN, 129)
    values = 2.0 + 3.0 * np.cos(1.5 * theta) - 4.0 * np.sin(1.5 * theta) + np.sin(4.0 * theta)
    found = harmonics(theta, values)
    k = found.place(1.5)
    assert found.turns == 2 and found.mean == pytest.approx(2.0, abs=1e-13)
    assert (found.cosine[k], found.sine[k]) == pytest.approx((3.0, -4.0), abs=1e-12)
    assert found.of(1.5) == pytest.approx(5.0, abs=1e-12)
    assert found.phase[k] == pytest.approx(math.atan2(-4.0, 3.0), abs=1e-12)
    assert found.of(4) == pytest.approx(1.0, abs=1e-12)
    others = np.delete(found.amplitude, [k, found.place(4)])
    assert others.max() < 1e-12 and found.folding < 1e-12 and not found.notes


def test_what_folds_is_noted():
    """An order of half of the remaining instants folds when every second one is left out."""
    theta = np.linspace(0.0, TURN, 33)
    found = harmonics(theta, np.cos(theta) + 0.25 * np.cos(14.0 * theta))
    # 14 of 16 instants looks like 2, with the whole amplitude
    assert found.folding == pytest.approx(0.25, abs=1e-12)
    assert any("take more instants" in note for note in found.notes)


def test_a_four_stroke_torque_has_half_orders():
    """Torque given at order ½ over two turns; one turn is refused as a cycle."""
    machine = Mechanism("shaft")
    machine.add(
        Body("crank", mass=1.0, inertia=2.0),
        Revolute("O", "ground", "crank"),
        AngleDriver("motor", "crank", ConstantSpeed(0.0, 5.0)),
        Torque("load", "crank", value="3 N*m*cos(crank.angle/2) - 7 N*m"),
    )
    run = mbody.kinetostatics(machine, turn=True, turns=2)
    assert len(run) == 721
    found = harmonics(run, "motor.effort")
    assert found.mean == pytest.approx(7.0, rel=1e-13)
    assert found.of(0.5) == pytest.approx(3.0, rel=1e-12)
    with pytest.raises(ModelError, match=r"value of motor.effort is 4 at the beginning .* 10 at"):
        harmonics(mbody.kinetostatics(machine, turn=True), "motor.effort")
    assert mbody.engineering.fluctuation(run).work == pytest.approx(7.0 * 2.0 * TURN, rel=1e-12)


# -- engines --------------------------------------------------------------------------------------


def test_inline_four():
    """No primary force, four times the secondary one; its couple is none."""
    run = mbody.kinetostatics(engine([0.0, math.pi, math.pi, 0.0]), turn=True, instants=145)
    found = shaking_orders(run)
    assert found.fx[1] < ROUNDED
    assert found.fx[2] / UNIT == pytest.approx(4.0 * QUARTER[2], abs=1e-11)
    assert found.fx[2] / UNIT == pytest.approx(1.0161001692279017, abs=1e-11)
    assert found.fx[4] / UNIT == pytest.approx(0.016392444688117437, abs=1e-11)
    offsets = {
        f"piston{n}": z for n, z in zip(range(1, 5), (-0.15, -0.05, 0.05, 0.15), strict=True)
    }
    couple = rocking_couple(run, offsets)
    assert couple.magnitude.max() < ROUNDED


@pytest.mark.parametrize("rod", [0.0, 0.3])
def test_inline_six(rod):
    """Primary and secondary forces, and their couples about the middle, are none; of order 6 six
    times that of one cylinder. With the rods' masses the moment has no order 1 or 2 either.
    """
    throws = np.radians([0.0, 240.0, 120.0, 120.0, 240.0, 0.0])
    run = mbody.kinetostatics(engine(throws, rod=rod), turn=True, instants=145)
    found = shaking_orders(run)
    for order in (1, 2, 3, 4, 5):
        assert found.force[order] < ROUNDED
    if not rod:
        assert found.fx[6] / UNIT == pytest.approx(6.0 * QUARTER[6], abs=1e-11)
    assert max(found.moment[1], found.moment[2]) < ROUNDED * 0.2
    z = np.linspace(-0.25, 0.25, 6)
    bodies = [name for name in run if name != "crank"]
    couple = rocking_couple(run, {name: z[int(name[-1]) - 1] for name in bodies})
    # the planes of both halves are mirror images: each order of the couple is none
    assert couple.magnitude.max() < ROUNDED


def test_the_couple_of_three_in_line():
    """Throws at 120°, distance a: a primary couple of amplitude √3 m r ω² a."""
    run = mbody.kinetostatics(engine(np.radians([0, 120, 240])), turn=True, instants=145)
    a = 0.1
    couple = rocking_couple(run, {"piston1": "-100 mm", "piston3": a})
    primary = harmonics(run, couple.y).of(1)
    assert primary == pytest.approx(math.sqrt(3.0) * UNIT * a, rel=1e-11)
    secondary = harmonics(run, couple.y).of(2)
    assert secondary == pytest.approx(math.sqrt(3.0) * UNIT * a * QUARTER[2], rel=1e-11)
    assert shaking_orders(run).force[1] < ROUNDED


def test_v_twin_at_90_degrees():
    """The primary force is m r ω² and turns with the crank; the secondary one is √2 A₂ across."""
    banks = np.radians([45.0, 135.0])
    run = mbody.kinetostatics(engine([0.0, 0.0], banks=banks), turn=True, instants=145)
    found = shaking_orders(run)
    assert abs(found.forward[1]) / UNIT == pytest.approx(1.0, abs=1e-12)
    assert found.forward[1].imag == pytest.approx(0.0, abs=ROUNDED)  # along the throw
    assert abs(found.backward[1]) < ROUNDED
    assert found.fx[2] / UNIT == pytest.approx(math.sqrt(2.0) * QUARTER[2], abs=1e-11)
    assert found.fy[2] < ROUNDED
    (shaft,) = balance_shafts(run, [1])
    assert (shaft.sense, shaft.unbalance) == (1, pytest.approx(0.5 * 0.05, rel=1e-11))
    assert math.cos(shaft.angle) == pytest.approx(-1.0, abs=1e-12)


@pytest.mark.parametrize(("angle", "forward"), [(60.0, 0.5), (0.0, 1.0), (180.0, 1.0)])
def test_other_vees(angle, forward):
    """Primary force of a V of that angle on one pin: both parts turn, the backward one is
    m r ω² cos of the angle (Norton, 14.9)."""
    half = math.radians(angle) / 2.0
    found = orders_of(engine([0.0, 0.0], banks=[-half, half]))
    assert abs(found.forward[1]) / UNIT == pytest.approx(1.0, abs=1e-12)
    assert abs(found.backward[1]) / UNIT == pytest.approx(forward, abs=1e-12)


@pytest.mark.parametrize("speed", [100.0, -100.0])
def test_shafts_take_their_orders_away(speed):
    """Shafts built as bodies that are geared to the crank: their orders are gone, others stay."""
    machine = engine([0.0, 0.0, 2.1], banks=[0.3, 1.2, 1.0], speed=speed, start=0.4)
    run = mbody.kinetostatics(machine, turn=True, instants=145)
    shafts = balance_shafts(run, [1, 2])
    assert len(shafts) == 4
    with_shafts = machine.copied()
    for n, one in enumerate(shafts):
        ratio = one.order * one.sense
        place = {"cg": (one.unbalance / 2.0, 0.0), "guess": one.angle + ratio * 0.4}
        with_shafts.add(
            Body(f"shaft{n}", mass=2.0, **place),
            Revolute(f"S{n}", "ground.O", f"shaft{n}"),
            AngleCoupling(
                f"gear{n}",
                [CouplingTerm(1.0, angle=f"shaft{n}"), CouplingTerm(-ratio, angle="crank")],
                one.angle,
            ),
        )
    before, after = shaking_orders(run), orders_of(with_shafts)
    assert before.force[1] > 0.1 * UNIT and before.force[2] > 0.1 * UNIT
    assert after.force[1] < 10.0 * ROUNDED and after.force[2] < 10.0 * ROUNDED
    assert_allclose(after.force[3:], before.force[3:], rtol=0, atol=10.0 * ROUNDED)


def test_the_sum_of_the_orders_is_the_force():
    run = mbody.kinetostatics(engine([0.0, 1.0], banks=[0.2, 1.1], start=0.3), turn=True)
    found = shaking_orders(run, highest=60)
    theta = run.driven("motor")[0][:, None]
    turning = np.exp(1j * found.orders * theta)
    back = np.exp(-1j * found.orders * theta)
    total = (found.forward * turning + found.backward * back).sum(axis=1)
    shaking = shaking_force(run)
    # r/l = 1/4: orders fall as (λ/2)ⁿ, the sixtieth is below rounding
    assert_allclose(total, shaking.fx + 1j * shaking.fy, rtol=0, atol=ROUNDED)


# -- firing orders and phases ---------------------------------------------------------------------


def test_firing_angles():
    found = firing_angles("1-5-3-6-2-4", 6)
    assert list(found) == [1, 5, 3, 6, 2, 4]
    assert_allclose(np.degrees(list(found.values())), np.arange(6) * 120.0, atol=1e-12)
    lags = dict(zip(range(1, 7), np.radians([0, 240, 120, 120, 240, 0]), strict=True))
    # of 1-5-3-6-2-4 the cranks that come to the top after 120 deg are those of 2 and 5
    lags = {n: {2: 120, 5: 120, 3: 240, 4: 240}.get(n, 0) for n in lags}
    assert firing_angles("1-5-3-6-2-4", cranks={n: math.radians(a) for n, a in lags.items()})
    assert firing_angles([2, 1], turns=1) == {2: 0.0, 1: pytest.approx(math.pi)}
    twin = firing_angles("1-2", intervals=np.radians([270.0, 450.0]))
    assert math.degrees(twin[2]) == pytest.approx(270.0)


def test_phases_of_a_table():
    """One table serves all cylinders, shifted: each torque is the first one's, later."""
    gas = Table(
        np.linspace(0.0, 2.0 * TURN, 25),
        [*np.sin(np.arange(24.0)) + 2.0, 2.0],
        periodic=True,
        interpolation="spline",
    )
    machine = Mechanism("two", curves={"gas": gas})
    phases = firing_angles("1-2")
    machine.add(
        Body("crank", mass=1.0, inertia=1.0),
        Revolute("O", "ground", "crank"),
        AngleDriver("motor", "crank", ConstantSpeed(0.0, 7.0)),
    )
    for n, phase in phases.items():
        machine.add(Torque(f"gas{n}", "crank", value=f"gas(crank.angle - {phase!r})"))
    run = mbody.kinetostatics(machine, turn=True, turns=2, instants=145)
    one, two = (run.load(f"gas{n}", on="crank").torque for n in (1, 2))
    assert_allclose(two[72:], one[:73], rtol=0, atol=1e-12)
    assert_allclose(two[:73], one[72:], rtol=0, atol=1e-12)
    assert_allclose(one, gas(run["crank"].angle), rtol=0, atol=1e-12)
    assert_allclose(run.effort("motor"), -(one + two), rtol=0, atol=1e-12)
