"""Sampled controllers and histories of inputs, against exact solutions between samples."""

import numpy as np
import pytest

import mbody
from mbody import Body, Controller, Input, Mechanism, Prismatic, Revolute, Torque, simulate
from mbody.laws import Table
from tests.support.linear_systems import discrete

pytestmark = pytest.mark.processor

INERTIA, DAMPING, SAMPLE = 0.14, 0.3, 0.01


class Pid:
    """With a memory."""

    def __init__(self):
        self.sum = 0.0
        self.calls = []

    def __call__(self, t, angle, rate):
        self.calls.append(t)
        error = 0.5 - angle
        self.sum += error * SAMPLE
        return 5.0 * error + 8.0 * self.sum - 0.5 * rate


def arm(*more):
    machine = Mechanism("arm")
    machine.add(Body("arm", mass=1.0, inertia=0.1, cg=(0.2, 0.0)), Revolute("O", "ground", "arm"))
    machine.add(Input("u", "0 N*m"))
    machine.add(Torque("motor", "arm", value="u - 0.3 N*m*s/rad*arm.omega"), *more)
    return machine


def controlled(**options):
    return arm(Controller("pid", Pid(), "10 ms", ["arm.angle", "arm.omega"], ["u"], **options))


def exact(count, delay=0):
    """States at the samples, by the exact step of the linear plant; `delay` in samples."""
    A = np.array([[0.0, 1.0], [0.0, -DAMPING / INERTIA]])
    step, gain = discrete(A, np.array([[0.0], [1.0 / INERTIA]]), SAMPLE)
    x, pid, found, queue = np.zeros(2), Pid(), [np.zeros(2)], [0.0] * delay
    for k in range(count):
        queue.append(pid(k * SAMPLE, *x))
        x = step @ x + gain[:, 0] * queue.pop(0)
        found.append(x)
    return np.array(found)


@pytest.mark.parametrize("rtol", [1e-4, 1e-6, 1e-8, 1e-10])
def test_the_result_does_not_depend_on_the_tolerance(rtol):
    run = simulate(controlled(), 1.0, rtol=rtol, every=SAMPLE)
    wanted = exact(100)
    np.testing.assert_allclose(run["arm"].angle, wanted[:, 0], atol=1e-11)
    np.testing.assert_allclose(run["arm"].omega, wanted[:, 1], atol=1e-11)
    assert run.status == "completed"


def test_samples_come_in_order_once_each():
    pid = Pid()
    machine = arm(Controller("pid", pid, "10 ms", ["arm.angle", "arm.omega"], ["u"]))
    seen = []

    def record(t, *reads):
        seen.append(t)
        return 0.0

    machine = arm(Controller("record", record, "10 ms", ["arm.angle"], ["u"]))
    simulate(machine, 0.1)
    np.testing.assert_allclose(seen, np.arange(10) * SAMPLE, atol=1e-15)
    assert pid.calls == []


def test_a_delay_of_two_samples():
    run = simulate(controlled(delay="20 ms"), 0.5, every=SAMPLE)
    np.testing.assert_allclose(run["arm"].angle, exact(50, 2)[:, 0], atol=1e-11)


def test_a_delay_within_a_sample():
    """Half a sample late: the plant takes two half steps."""
    A = np.array([[0.0, 1.0], [0.0, -DAMPING / INERTIA]])
    step, gain = discrete(A, np.array([[0.0], [1.0 / INERTIA]]), 0.5 * SAMPLE)
    x, pid, before = np.zeros(2), Pid(), 0.0
    for k in range(40):
        now = pid(k * SAMPLE, *x)
        for u in (before, now):
            x = step @ x + gain[:, 0] * u
        before = now
    run = simulate(controlled(delay="5 ms"), 0.4)
    assert run["arm"].angle[-1] == pytest.approx(x[0], abs=1e-11)


@pytest.mark.parametrize("cut", [0.2, 0.205, 0.3333])
def test_motions_go_on_with_the_memory_of_the_controller(cut):
    machine = controlled()
    first = simulate(machine, cut)
    rest, whole = simulate(machine, 0.6, start=first), simulate(machine, 0.6)
    assert rest["arm"].angle[-1] == whole["arm"].angle[-1]
    # the same beginning again: what went on has changed nothing
    again = simulate(machine, 0.6, start=first)
    assert again["arm"].angle[-1] == rest["arm"].angle[-1]


def test_events_and_controllers_together():
    run = simulate(controlled(), 1.0, events=[mbody.Event("arm.angle - 0.3 rad")])
    plain = simulate(controlled(), 1.0)
    np.testing.assert_allclose(run["arm"].angle, plain["arm"].angle, atol=1e-12)
    assert run.events[0].state["arm"].angle[-1] == pytest.approx(0.3, abs=1e-12)


def test_a_cascade_of_two_controllers_and_a_mapping():
    """The outer one sets the speed, the inner one the torque, ten times as often."""
    machine = Mechanism("arm")
    machine.add(Body("arm", mass=1.0, inertia=0.1, cg=(0.2, 0.0)), Revolute("O", "ground", "arm"))
    machine.add(Input("u", "0 N*m"), Input("speed", "0 rad/s"))
    machine.add(Torque("motor", "arm", value="u - 0.3 N*m*s/rad*arm.omega"))
    machine.add(
        Controller("outer", lambda t, a: {"speed": 4.0 * (0.5 - a)}, 0.1, ["arm.angle"], ["speed"]),
        Controller("inner", lambda t, v, w: 3.0 * (v - w), 0.01, ["speed", "arm.omega"], ["u"]),
    )
    run = simulate(machine, 1.0)
    A = np.array([[0.0, 1.0], [0.0, -DAMPING / INERTIA]])
    step, gain = discrete(A, np.array([[0.0], [1.0 / INERTIA]]), SAMPLE)
    x = np.zeros(2)
    for k in range(100):
        if k % 10 == 0:
            speed = 4.0 * (0.5 - x[0])
        x = step @ x + gain[:, 0] * 3.0 * (speed - x[1])
    assert run["arm"].angle[-1] == pytest.approx(x[0], abs=1e-11)


def test_controllers_read_forces():
    forces = []

    def record(t, force):
        forces.append(force)
        return 0.1

    machine = arm(Controller("record", record, "50 ms", ["O.force"], ["u"]))
    run = simulate(machine, 0.2, every="50 ms")
    # what a controller reads is of before it sets its input: the first one differs
    np.testing.assert_allclose(forces[1:], run.measure("O.force")[1:4], atol=1e-9)


def test_a_driven_and_released_mechanism_keeps_its_samples():
    machine = Mechanism("two")
    machine.add(Body("arm", mass=1.0, inertia=0.1, cg=(0.2, 0.0)), Revolute("O", "ground", "arm"))
    machine.add(Body("cart", mass=2.0), Prismatic("guide", "ground", "cart"))
    machine.add(mbody.CoordinateDriver("push", "ground", "cart", "0.1*t"))
    machine.add(Input("u", "0 N*m"), Torque("motor", "arm", value="u"))
    seen = []
    machine.add(Controller("c", lambda t, x: seen.append(t) or 1.0, 0.03, ["arm.angle"], ["u"]))
    simulate(machine, 0.2, release={"push": 0.1})
    np.testing.assert_allclose(seen, np.arange(7) * 0.03, atol=1e-12)


# -- histories ------------------------------------------------------------------------------------


def free_arm():
    machine = Mechanism("arm")
    machine.add(Body("arm", mass=1.0, inertia=0.1, cg=(0.2, 0.0)), Revolute("O", "ground", "arm"))
    machine.add(Input("u", "0 N*m"), Torque("motor", "arm", value="u"))
    return machine


POINTS = np.linspace(0.0, 1.0, 11)
VALUES = np.cos(9.0 * POINTS)


def integrated(kind):
    """Angle at the end for u joined by lines, or held."""
    angle = rate = 0.0
    for k in range(10):
        a, b = VALUES[k] / INERTIA, VALUES[k + 1 if kind == "linear" else k] / INERTIA
        angle += 0.1 * rate + 0.01 * (a / 3.0 + b / 6.0)
        rate += 0.05 * (a + b)
    return angle


@pytest.mark.parametrize("rtol", [1e-6, 1e-10])
@pytest.mark.parametrize(
    ("history", "wanted"),
    [
        ("2 N*m", 1.0 / INERTIA),
        (2.0, 1.0 / INERTIA),
        ("2 N*m*sin(3 rad/s*t)", 2.0 / INERTIA * (1.0 / 3.0 - np.sin(3.0) / 9.0)),
        (lambda t: 2.0 * np.sin(3.0 * t), 2.0 / INERTIA * (1.0 / 3.0 - np.sin(3.0) / 9.0)),
        ((POINTS, VALUES), integrated("linear")),
        (VALUES, integrated("linear")),
        (Table(POINTS, VALUES, interpolation="hold", outside="hold"), integrated("hold")),
    ],
)
def test_histories_of_inputs(history, wanted, rtol):
    run = simulate(free_arm(), 1.0, inputs={"u": history}, rtol=rtol)
    # corners and jumps cost no accuracy: steps end there
    assert run["arm"].angle[-1] == pytest.approx(wanted, abs=20 * rtol * abs(wanted))
    assert run.energy.error < 100 * rtol
    assert run.status == "completed"


def test_a_table_of_a_load_with_corners_costs_no_accuracy():
    machine = Mechanism("arm")
    machine.add(Body("arm", mass=1.0, inertia=0.1, cg=(0.2, 0.0)), Revolute("O", "ground", "arm"))
    machine.add(Torque("motor", "arm", value=Table(POINTS, VALUES, interpolation="linear")))
    for rtol in (1e-6, 1e-9):
        run = simulate(machine, 1.0, rtol=rtol)
        wanted = integrated("linear")
        assert run["arm"].angle[-1] == pytest.approx(wanted, abs=20 * rtol * abs(wanted))
