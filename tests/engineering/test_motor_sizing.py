"""Motors with gears and bearings with lives, against closed forms and reference values."""

import math

import numpy as np
import pytest

import mbody
from mbody import AngleDriver, Body, Force, Mechanism, Revolute, Torque
from mbody.engineering import MotorCurve, bearing_load, motor_sizing
from mbody.laws import ConstantSpeed

#: Plenty in every respect.
LARGE = MotorCurve([0.0, 1e4], [1e4, 1e4], [1e3, 1e3], inertia=0.02)


def shaft(law, *loads, inertia=0.0):
    machine = Mechanism("shaft")
    machine.add(
        Body("crank", mass=1.0, inertia=inertia),
        Revolute("O", "ground", "crank"),
        AngleDriver("motor", "crank", law),
        *loads,
    )
    return machine


def reference(count=2001):
    """τ = 10 + 4 sin t and α = 6 cos t over 2π: of a massless shaft the load is the effort."""
    law = "8 rad/s*t - 6 rad*cos(1 rad/s*t)"
    load = Torque("load", "crank", value="-10 N*m - 4 N*m*sin(1 rad/s*t)")
    return mbody.kinetostatics(shaft(law, load), t=np.linspace(0.0, 2.0 * math.pi, count))


def test_the_best_ratio():
    """i* = √(rms τ/(J rms α)) and the rms torque there: the reference digits."""
    found = motor_sizing(reference(), LARGE)
    assert found.best_ratio == pytest.approx(11.066819197003216, rel=1e-12)
    assert found.ratio == found.best_ratio
    assert found.rms == pytest.approx(1.3280183036403859, rel=1e-12)
    # 10² + 4²/2 and 6²/2, and beside it more torque
    assert found.best_ratio == pytest.approx(math.sqrt(math.sqrt(108.0 / 18.0) / 0.02), rel=1e-12)
    for factor in (0.9, 1.1):
        assert motor_sizing(reference(), LARGE, ratio=factor * found.ratio).rms > found.rms


def test_rest_and_losses():
    """Rest cools by the root of the duty; a gear's losses count when it drives."""
    run = reference()
    one = motor_sizing(run, LARGE, ratio=10.0)
    period = 2.0 * math.pi
    rested = motor_sizing(run, LARGE, ratio=10.0, rest=f"{3.0 * period} s")
    assert rested.rms == pytest.approx(one.rms / 2.0, rel=1e-12)
    assert rested.peak == one.peak
    lossy = motor_sizing(run, LARGE, ratio=10.0, efficiency=0.8)
    alpha, omega, t = run.driven("motor")[2], run.driven("motor")[1], run.t
    tau = 10.0 + 4.0 * np.sin(t)
    wanted = 0.02 * 10.0 * alpha + np.where(omega > 0.0, tau / 0.8, tau * 0.8) / 10.0
    assert np.abs(lossy.torque - wanted).max() < 1e-12
    assert (omega > 0.0).all()
    # back: the same loads pull the shaft, which is held by less
    pulled = shaft(ConstantSpeed(0.0, -5.0), Torque("load", "crank", value=-10.0))
    held = motor_sizing(mbody.kinetostatics(pulled, turn=True), LARGE, ratio=2.0, efficiency=0.8)
    assert held.torque == pytest.approx(np.full(361, 4.0), rel=1e-12)


def test_which_limit_is_nearest():
    """Each limit in turn, by a motor that lacks just that."""
    load = Torque("load", "crank", value=-12.0)
    run = mbody.kinetostatics(shaft(ConstantSpeed(0.0, 5.0), load), turn=True)
    by = {
        "speed": MotorCurve([0.0, 21.0], [90.0, 90.0], [40.0, 40.0]),
        "peak": MotorCurve([0.0, 100.0], [3.5, 3.5], [3.4, 3.4]),
        "thermal": MotorCurve([0.0, 100.0], [9.0, 9.0], [3.0, 2.0]),
    }
    wanted = {"speed": 20.0 / 21.0, "peak": 3.0 / 3.5, "thermal": 3.0 / 2.8}
    for active, motor in by.items():
        found = motor_sizing(run, motor, ratio=4.0)
        assert found.used[active] == pytest.approx(wanted[active], rel=1e-12)
        assert found.suffices == (wanted[active] <= 1.0)
        if active != "peak":
            assert found.active == active
    assert by["peak"] and motor_sizing(run, by["peak"], ratio=4.0).active == "thermal"
    short = MotorCurve([0.0, 100.0], [3.1, 3.1], [30.0, 30.0])
    assert motor_sizing(run, short, ratio=4.0).active == "peak"
    text = str(motor_sizing(run, by["thermal"], ratio=4.0))
    assert "it does not suffice: the thermal limit is nearest" in text
    # at a constant speed no ratio is best: the top speed binds
    free = motor_sizing(run, by["speed"])
    assert free.best_ratio == math.inf and free.ratio == pytest.approx(4.2, rel=1e-12)
    assert free.data()["best_ratio"] is None


def test_the_inertia_ratio():
    """A shaft of 0.5 through 10 at a motor of 0.001: 5 times its own."""
    run = mbody.kinetostatics(shaft(ConstantSpeed(0.0, 5.0), inertia=0.5), turn=True)
    motor = MotorCurve([0.0, "1000 rpm"], [9.0, 9.0], [3.0, 2.0], inertia="0.001 kg*m^2")
    assert motor_sizing(run, motor, ratio=10.0).inertia_ratio == pytest.approx(5.0, rel=1e-12)


# -- bearings -------------------------------------------------------------------------------------


def turned(law, force):
    machine = shaft(law, Force("F", "crank", force, angle=0.3))
    return mbody.kinetostatics(machine, turn=True, instants=2881)


@pytest.mark.parametrize(("kind", "p"), [("ball", 3.0), ("roller", 10.0 / 3.0), (4.0, 4.0)])
def test_the_equivalent_load(kind, p):
    """F = 5 + 3 cos θ at a constant speed: ⟨F^p⟩^{1/p} by quadrature; of a constant one itself."""
    found = bearing_load(turned(ConstantSpeed(0.0, 4.0), "5 N + 3 N*cos(crank.angle)"), "O", kind)
    theta = np.linspace(0.0, 2.0 * math.pi, 20001)[:-1]
    closed = np.mean((5.0 + 3.0 * np.cos(theta)) ** p) ** (1.0 / p)
    assert found.equivalent == pytest.approx(closed, rel=1e-12)
    assert found.in_time == pytest.approx(closed, rel=1e-12)
    assert found.mean == pytest.approx(5.0, rel=1e-12)
    assert (found.greatest, found.revolutions) == pytest.approx((8.0, 1.0), rel=1e-12)
    if p == 3.0:  # ⟨(a + b cos)³⟩ = a³ + 3/2 a b²
        assert found.equivalent**3 == pytest.approx(125.0 + 1.5 * 5.0 * 9.0, rel=1e-12)
    still = bearing_load(turned(ConstantSpeed(0.0, 4.0), 7.0), "O", kind)
    assert still.equivalent == pytest.approx(7.0, rel=1e-12)


def test_the_life():
    """L₁₀ = 10⁶ (C/P)³ revolutions; half the load lasts eight times as long."""
    run = turned(ConstantSpeed(0.0, 4.0), 7.0)
    found = bearing_load(run, "O", "ball", rating="0.7 kN")
    assert found.life == pytest.approx(1e12, rel=1e-11)
    assert found.time == pytest.approx(1e12 * 2.0 * math.pi / 4.0, rel=1e-11)
    half = bearing_load(turned(ConstantSpeed(0.0, 4.0), 3.5), "O", "ball", rating=700.0)
    assert half.life == pytest.approx(8.0 * found.life, rel=1e-11)


def test_revolutions_weigh():
    """A force while the shaft hardly turns counts in time, and little by revolutions."""
    law = "1 rad*sin(1 rad/s*t)"
    machine = shaft(law, Force("F", "crank", "1 N + 9 N*abs(sin(1 rad/s*t))^8"))
    run = mbody.kinetostatics(machine, t=np.linspace(0.0, 2.0 * math.pi, 4001))
    found = bearing_load(run, "O")
    t = np.linspace(0.0, 2.0 * math.pi, 400001)
    force, speed = 1.0 + 9.0 * np.sin(t) ** 8, np.abs(np.cos(t))
    by_turns = (np.trapezoid(force**3 * speed, t) / np.trapezoid(speed, t)) ** (1.0 / 3.0)
    # |cos| has corners: trapezoids are off by h²
    assert found.equivalent == pytest.approx(by_turns, rel=1e-5)
    assert found.in_time > 1.2 * found.equivalent
    assert found.revolutions == pytest.approx(4.0 / (2.0 * math.pi), rel=1e-6)


def test_the_spectrum():
    """Classes of force with their shares: half of a cosine is above its mean."""
    found = bearing_load(turned(ConstantSpeed(0.0, 4.0), "5 N + 3 N*cos(crank.angle)"), "O")
    rows = found.spectrum(8)
    assert sum(row[2] for row in rows) == pytest.approx(1.0, rel=1e-12)
    assert [row[2] for row in rows] == pytest.approx([row[3] for row in rows], rel=1e-9)
    assert rows[0][2] == rows[1][2] == 0.0  # never below 2
    assert sum(row[2] for row in rows[5:]) == pytest.approx(0.5, abs=2.0 / 2880)
    # from 7 to 8: cos above 2/3
    assert rows[7][2] == pytest.approx(math.acos(2.0 / 3.0) / math.pi, abs=2.0 / 2880)
