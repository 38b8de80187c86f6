"""The energy of a hydraulic cylinder: supplied, throttled, relieved, stored in the oil."""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from mbody import Body, Damper, HydraulicCylinder, Mechanism, Prismatic, simulate
from tests.model.test_motors import OIL

pytestmark = pytest.mark.processor

#: Low enough to open.
RELIEF = 40e5


def press(valve="0.5*sin(6 rad/s*t)", **more):
    lift = HydraulicCylinder("lift", "ground.A", "slide", valve=valve, **OIL | more)
    machine = Mechanism("a press", ground={"A": (-0.5, 0.0)})
    machine.add(Body("slide", mass=200.0), Prismatic("guide", "ground", "slide"), lift)
    return machine


def powers(t, y, tank):
    """Rates of place, velocity, both pressures and the four energies, written down once more."""
    x, v, a, b = y[:4]
    supply, area_a = 160e5, math.pi / 4.0 * 0.05**2
    area_b = area_a - math.pi / 4.0 * 0.028**2
    u = 0.5 * math.sin(6.0 * t)

    def orifice(drop):
        part = drop / 5e5
        return OIL["flow"] * part / (part**2 + 1e-6) ** 0.25

    def relieved(p):
        return OIL["flow"] * 10.0 * max(p - RELIEF, 0.0) / RELIEF

    if u > 0.0:
        drawn, drained = u * orifice(supply - a), u * orifice(b - tank)
        into_a, into_b = drawn, -drained
        lost = drawn * (supply - a) + drained * (b - tank)
    else:
        drawn, drained = -u * orifice(supply - b), -u * orifice(a - tank)
        into_a, into_b = -drained, drawn
        lost = drawn * (supply - b) + drained * (a - tank)
    room_a, room_b = 50e-6 + area_a * (x + 0.1), 50e-6 + area_b * (0.4 - x)
    rise_a = 1.4e9 / room_a * (into_a - area_a * v - relieved(a))
    rise_b = 1.4e9 / room_b * (into_b + area_b * v - relieved(b))
    return (
        v,
        (a * area_a - b * area_b) / 200.0,
        rise_a,
        rise_b,
        supply * drawn - tank * (drained + relieved(a) + relieved(b)),
        lost,
        (a - tank) * relieved(a) + (b - tank) * relieved(b),
        (a * room_a * rise_a + b * room_b * rise_b) / 1.4e9,
    )


@pytest.mark.parametrize("method", ["dop853", "radau5"])
@pytest.mark.parametrize("tank", [0.0, 6e5])
def test_energies_of_the_oil(method, tank):
    """By SciPy on the same equations; the balance closes, and the work on the piston is what is
    left.
    """
    run = simulate(press(tank=tank, relief=RELIEF), 0.5, rtol=1e-10, instants=6, method=method)
    assert run.energy.error < 1e-8
    scale = np.array([0.1, 1.0, 1e7, 1e7, 1e3, 1e3, 1e3, 1e3])
    theirs = solve_ivp(
        powers, (0.0, 0.5), (0.0, 0.0, 20e5, 30e5, 0.0, 0.0, 0.0, 0.0), args=(tank,),
        method="DOP853", rtol=1e-11, atol=1e-12 * scale, t_eval=run.t,
    ).y  # fmt: skip
    by = run.energy.by
    whole = theirs[4].max()
    for key, row, sign in (("supplied", 4, 1), ("lost", 5, -1), ("relieved", 6, -1)):
        np.testing.assert_allclose(by[f"lift.{key}"], sign * theirs[row], atol=2e-7 * whole)
    np.testing.assert_allclose(by["lift.compressed"], -theirs[7], atol=2e-7 * whole)
    assert by["lift.relieved"][-1] < -1.0  # J: the valves do open
    kinetic = 100.0 * theirs[1] ** 2
    np.testing.assert_allclose(by["lift"], kinetic, atol=2e-7 * whole)
    np.testing.assert_array_equal(run.energy.work, by["lift.supplied"])
    np.testing.assert_allclose(run.energy.dissipated, -(by["lift.lost"] + by["lift.relieved"]))


def test_what_is_stored_in_oil_that_moves_little():
    """A piston that hardly moves: ½ V p²/β of both chambers."""
    machine = press(valve="0", start_a=0.0, start_b=40e5, relief=None)
    machine.add(Damper("brake", "ground.A", "slide", coefficient=1e9))
    run = simulate(machine, 0.2, rtol=1e-9, method="radau5")
    rooms = 50e-6 + np.array([0.1, 0.4]) * math.pi / 4.0 * np.array([0.05**2, 0.05**2 - 0.028**2])
    pressure = np.array([run.measure(f"lift.pressure_{chamber}") for chamber in "ab"])
    stored = 0.5 * (rooms[:, None] * pressure**2 / 1.4e9).sum(axis=0)
    # the valve leaks nothing; what the piston moves changes the rooms by a millionth
    np.testing.assert_allclose(
        -run.energy.by["lift.compressed"], stored - stored[0], rtol=1e-3, atol=1e-3
    )


def test_an_unloaded_valve_supplies_only_what_it_loses_in_the_end():
    """To and fro over whole periods against a damper: the supply pays for valve and damper."""
    machine = press()
    machine.add(Damper("work", "ground.A", "slide", coefficient=2e4))
    run = simulate(machine, 2.0 * math.pi / 6.0, rtol=1e-9, method="radau5")
    by = {name: part[-1] for name, part in run.energy.by.items()}
    spent = -(by["lift.lost"] + by["lift.relieved"] + by["lift.compressed"] + by["work"])
    kinetic = run.energy.kinetic[-1]
    assert by["lift.supplied"] == pytest.approx(spent + kinetic, rel=1e-7)
    assert by["work"] < -1.0
    assert by["lift.lost"] < by["work"]
