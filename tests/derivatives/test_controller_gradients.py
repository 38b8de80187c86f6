"""Gradients of motions with sampled controllers, against complex steps of what happens between
samples in closed form, and differences of plain motions.
"""

import math
from dataclasses import replace

import numpy as np
import pytest

import mbody
from mbody import (
    Body,
    Controller,
    Force,
    Input,
    Mechanism,
    Prismatic,
    SimulationSettings,
    Torque,
)
from tests.support.complex_reading import STEP

#: Gains, mass, first place and rate, value before the first sample, sample time, delay.
NUMBERS = {
    "kp": 40.0,
    "kd": 5.0,
    "slide.mass": 2.0,
    "start.slide.x": 0.3,
    "start.slide.vx": 0.1,
    "u.value": 0.5,
    "pd.every": 0.02,
    "pd.delay": 0.005,
}
UNTIL = 1.007
LAST = ["last(slide.x)", "last(slide.vx)"]


def pd(t, kp, kd, x, v):
    return -kp * x - kd * v


def pd_of_floats(t, kp, kd, x, v):
    return float(np.array([-kp, -kd], dtype=float) @ np.array([x, v], dtype=float))


class WithMemory:
    """The same and a sum over the samples."""

    def __init__(self, of=float):
        self.sum, self.of = 0.0, of

    def __call__(self, t, kp, kd, x, v):
        self.sum += self.of(x)
        return -kp * x - kd * v - 0.2 * self.sum


def slide(function, delay=NUMBERS["pd.delay"], until=UNTIL, **more):
    start = {"slide": {"x": 0.3, "vx": 0.1}}
    machine = Mechanism(
        "slide",
        parameters={"kp": "40 N/m", "kd": "5 N*s/m"},
        simulation=SimulationSettings(until, start, rtol=1e-12, instants=3),
    )
    machine.add(
        Body("slide", mass=2.0, inertia=1.0),
        Prismatic("guide", "ground", "slide"),
        Input("u", "0.5 N"),
        Force("push", "slide", "u", angle=0.0),
    )
    reads = ["kp", "kd", "slide.x", "slide.vx"]
    machine.add(Controller("pd", function, 0.02, reads, ["u"], delay=delay, **more))
    return machine


def stepped(function, numbers):
    """The last place and rate: the force is constant between the times at which it changes."""
    kp, kd, m, x, v, u, every, delay = numbers
    t, changes = 0.0 * every, []

    def until(end, x, v, t):
        h = end - t
        return x + v * h + 0.5 * u / m * h * h, v + u / m * h, end

    sample = 0
    while True:
        due = [(sample * every, None), *changes[:1]]
        when, value = min(due, key=lambda one: one[0].real)
        if when.real >= UNTIL:
            break
        x, v, t = until(when, x, v, t)
        if value is None:
            changes.append((when + delay, function(t, kp, kd, x, v)))
            sample += 1
        else:
            u = changes.pop(0)[1]
    x, v, _ = until(UNTIL, x, v, t)
    return np.array([x, v])


def exact(function, delay):
    """Derivatives by a complex step in each of the numbers."""
    rows = []
    for k in range(len(NUMBERS)):
        moved = np.array([*NUMBERS.values()], dtype=complex)
        moved[-1] = delay
        moved[k] += 1j * STEP
        rows.append(np.imag(stepped(function(), moved)) / STEP)
    return np.array(rows).T


CONTROLLERS = {
    "without memory": (lambda: pd, lambda: pd, False),
    "with memory": (lambda: WithMemory(lambda x: x), lambda: WithMemory(complex), False),
    "of floats": (lambda: pd_of_floats, lambda: pd, True),
    "of floats, with memory": (lambda: WithMemory(float), lambda: WithMemory(complex), True),
}


@pytest.mark.parametrize("delay", [0.0, 0.005])
@pytest.mark.parametrize("kind", CONTROLLERS)
def test_a_discrete_controller_of_a_mass(kind, delay):
    """By gains, mass, beginning, sample time and delay; of differences 9 figures."""
    function, complex_function, differenced = CONTROLLERS[kind]
    g = mbody.gradient(slide(function(), delay), LAST, [*NUMBERS], "simulate")
    wanted = exact(complex_function, delay)
    most = np.abs(wanted).max(axis=1, keepdims=True)
    # fifty samples, each located and integrated to 1e-12
    assert (np.abs(g.jacobian - wanted) / most).max() < (1e-9 if differenced else 1e-11)
    assert any("are differenced" in note for note in g.notes) == differenced
    assert len(g.notes) == differenced


def differences(machine, names, measures, part=1e-4):
    """Of order 4, of plain motions."""
    system, rows = mbody.assemble(machine), []

    def value(name, number):
        run = mbody.simulate(system.with_values({name: number}))
        return np.array([run.measure(one)[-1] for one in measures])

    for name in names:
        x = float(system.values[name])
        h = part * max(abs(x), 0.01)
        near = value(name, x + h) - value(name, x - h)
        rows.append((8 * near - value(name, x + 2 * h) + value(name, x - 2 * h)) / (12 * h))
    return np.array(rows).T


def check_beside_differences(machine, names, measures, part=1e-4):
    g = mbody.gradient(machine, [f"last({one})" for one in measures], names, "simulate")
    found = differences(machine, names, measures, part)
    most = np.abs(found).max(axis=1, keepdims=True)
    # motions are exact to some 1e-12, differences of steps of 1e-4 or 1e-5 to 1e-8
    assert (np.abs(g.jacobian - found) / most).max() < 1e-7
    assert not g.notes


def test_a_four_bar_whose_controller_reads_forces():
    """A cascade that reads angle, rate, acceleration and the force in a joint."""
    machine = mbody.makers.four_bar(0.1, 0.3, 0.25, 0.35, masses=(0.5, 1.0, 0.8)).without("motor")
    machine.simulation = SimulationSettings(
        0.6, {"crank": {"angle": 0.3, "omega": 0.0}}, rtol=1e-12, instants=3
    )
    machine.add(Input("u", "0 N*m"), Torque("drive", "crank", value="u - 0.02*crank.omega"))
    reads = ["crank.angle", "crank.omega", "crank.alpha", "A.force", "drive.torque"]

    def cascade(t, angle, rate, change, force, torque):
        return 0.15 * (6.0 * (2.0 - angle) - rate) - 1e-3 * change + 1e-2 * force - 0.1 * torque

    machine.add(Controller("cascade", cascade, "37 ms", reads, ["u"]))
    names = ["crank.mass", "crank.A.x", "coupler.mass", "coupler.B.x", "rocker.B.x"]
    check_beside_differences(machine, names, ["crank.angle", "crank.omega", "crank.alpha", "A.fx"])


def test_two_controllers_of_a_ball_that_bounces():
    """Impacts between samples of one controller that reads what another has just set."""
    machine = mbody.gallery.load("bouncing_ball")
    machine.simulation = SimulationSettings(1.5, {"ball": {"y": 1.03}}, rtol=1e-12, instants=3)
    machine.add(
        Input("u", "0 N"), Input("w", "0 N"), Force("push", "ball", "u + w", angle="90 deg")
    )
    up = Controller("up", lambda t, y: 0.3 * (1.0 - y), "30 ms", ["ball.y"], ["u"])
    down = Controller("down", lambda t, u, v: -0.3 * u - 0.1 * v, 0.06, ["u", "ball.vy"], ["w"])
    machine.add(up, down)
    assert any(one.contact for one in mbody.simulate(machine).events)
    check_beside_differences(machine, ["e", "gravity.y"], ["ball.y", "ball.vy"], 1e-5)


def test_a_block_that_slips_and_is_pushed_by_samples():
    machine = mbody.gallery.load("stick_slip")
    machine.simulation = replace(machine.simulation, until=1.0, instants=3)
    machine.add(Input("u", "0 N"), Force("push", "block", "u", angle=0.0))
    reads = ["block.x", "block.vx", "rub.fx"]
    pushed = Controller("pd", lambda t, x, v, f: 0.1 - x - 3 * v + 0.01 * f, 0.13, reads, ["u"])
    machine.add(pushed)
    assert "slip" in {one.name for one in mbody.simulate(machine).events}
    check_beside_differences(machine, ["m", "mu", "mu_s"], ["block.x", "block.vx"], 1e-5)


def test_a_motion_that_goes_on():
    """What the motion before has left, the memory of its controller, is held; another rtol samples
    at the same times.
    """
    machine = slide(WithMemory(lambda x: x))
    before = mbody.simulate(machine, 0.503)
    g = mbody.gradient(machine, LAST, ["kp", "slide.mass"], "simulate", start=before)
    system, rows = mbody.assemble(machine), []
    for name, size in (("kp", 40.0), ("slide.mass", 2.0)):
        ends = []
        for k in (-1, 1):
            other = system.with_values({name: size * (1.0 + k * 1e-5)})
            run = mbody.simulate(other, start=before)
            ends.append(np.array([run["slide"].x[-1], run["slide"].vx[-1]]))
        rows.append((ends[1] - ends[0]) / (2e-5 * size))
    # differences of order 2
    np.testing.assert_allclose(g.jacobian, np.array(rows).T, rtol=1e-6)
    assert not g.notes


def test_where_there_is_none():
    """Of a controller that rounds what it reads, and of one that counts its calls."""

    def rounded(t, kp, kd, x, v):
        return -kp * round(x * 1e3) / 1e3 - kd * v

    g = mbody.gradient(slide(rounded), LAST, ["kp", "slide.mass"], "simulate")
    assert np.isnan(g.jacobian).all()
    assert any("differences of motions are others, as 'pd'" in note for note in g.notes)

    calls = []

    def impure(t, kp, kd, x, v):
        calls.append(t)
        return -kp * x - 1e-3 * len(calls) * v

    g = mbody.gradient(slide(impure), LAST, ["kp", "slide.mass"], "simulate")
    assert np.isnan(g.jacobian).all()
    assert any("followed again the motion is another: 'pd'" in note for note in g.notes)

    def root(t, kp, kd, x, v):
        return -kp * math.copysign(abs(x) ** 0.5, x) - kd * v

    g = mbody.gradient(slide(root), LAST, ["kp"], "simulate")
    assert any("are differenced" in note for note in g.notes)
