"""Auxiliary states in implicit steps: closed solutions, orders, events, jumps, restarts, energy."""

import itertools
import math

import numpy as np
import pytest

import mbody
from mbody import (
    Body,
    Controller,
    DCMotor,
    Gravity,
    HydraulicCylinder,
    Input,
    Mechanism,
    Prismatic,
    Revolute,
    State,
    Torque,
    TorsionDamper,
    assemble,
    simulate,
)
from mbody.laws import Table
from tests.dynamics.test_auxiliary_states import crank, pid
from tests.dynamics.test_auxiliary_states import exact as exact_pid
from tests.model.test_motors import OIL, K, L, R, U, exact, history, motor, wheel

pytestmark = pytest.mark.processor

#: Methods of dense matrices, with the step of the one that has it.
IMPLICIT = {"radau5": {}, "generalized-alpha": {"step": 1e-3}}


# -- closed solutions -----------------------------------------------------------------------------


@pytest.mark.parametrize("rtol", [1e-6, 1e-8, 1e-10, 1e-12])
@pytest.mark.parametrize(
    ("ratio", "drag", "start"), [(1.0, 0.0, 0.0), (4.0, 0.03, 0.0), (-2.0, 0.01, 7.0)]
)
def test_a_dc_motor_at_its_tolerance(rtol, ratio, drag, start):
    """175 electric time constants: what has decayed no longer counts, between steps neither."""
    loads = [motor(ratio=ratio, start=start)]
    if drag:
        loads.append(TorsionDamper("drag", "wheel", coefficient=drag))
    run = simulate(wheel(*loads), 0.7, rtol=rtol, method="radau5")
    current, rate = exact(run.t, ratio, drag, start)
    # measured: 0.45 of the tolerance of the greatest current, and 0.6 of that of the rate
    assert np.abs(history(run, "motor.current") - current).max() < rtol * np.abs(current).max()
    assert np.abs(run["wheel"].omega - rate).max() < 2.0 * rtol * (1.0 + np.abs(rate).max())
    assert run.status == "completed"
    assert run.notes == ()


def errors_of_steps(machine, until, closed):
    """Errors of generalised-α with steps that are halved."""
    found = []
    for step in (4e-3, 2e-3, 1e-3):
        run = simulate(machine, until, method="generalized-alpha", step=step, instants=11)
        found.append(max(np.abs(a - b).max() for a, b in closed(run)))
    return found


def test_generalized_alpha_has_order_two_in_auxiliary_states():
    def closed(run):
        found = run["crank"].angle, run["crank"].omega, run.measure("integral")
        return zip(found, exact_pid(run.t).T, strict=True)

    first, second, third = errors_of_steps(pid(), 1.0, closed)
    assert 3.8 < first / second < 4.2
    assert 3.9 < second / third < 4.1


def test_an_auxiliary_state_that_is_stiff_and_drives_what_is_stiff():
    """A filter of 1 µs in front of a spring and a damper: the matrix exponential of the whole. The
    time constant is a millionth of the motion, which takes no more steps than without it.
    """
    k, c, lag = 400.0, 8.0, 1e-6
    machine = crank(
        State("force", rate=f"(-{k}*crank.angle - {c}*crank.omega + 3 - force)/{lag}", start=0.0),
        Torque("spring", "crank", value="force"),
    )
    inertia = 0.1 + 1.0 * 0.2**2
    A = np.array([[0, 1, 0], [0, 0, 1 / inertia], [-k / lag, -c / lag, -1 / lag]])
    rest = -np.linalg.solve(A, [0, 0, 3 / lag])
    run = simulate(machine, 1.0, method="radau5", rtol=1e-9, instants=11)
    # the fast mode by its eigenvalue; a matrix exponential of 1e6 loses six digits
    roots, vectors = np.linalg.eig(A)
    parts = np.linalg.solve(vectors, -rest)
    y = rest + (np.exp(np.outer(run.t, roots)) * parts @ vectors.T).real
    found = np.column_stack([run["crank"].angle, run["crank"].omega, run.measure("force")])
    assert np.abs(found - y)[1:, :2].max() < 3e-8
    assert np.abs(found - y)[1:, 2].max() < 3e-6
    assert run.stats["steps"] < 1000


def test_states_of_every_size_are_solved_for_together():
    """The same motion with its state in other units, by twelve orders of magnitude: pivots and
    errors count states in their sizes.
    """
    counts = []
    for size in (1e-6, 1.0, 1e6):
        machine = crank(
            State(
                "i",
                rate=f"{size!r}*(12 - 2*i/{size!r} - 0.5*crank.omega)/0.002",
                start=0.0,
                size=size,
            ),
            Torque("motor", "crank", value=f"0.5*i/{size!r}"),
        )
        run = simulate(machine, 1.0, method="radau5", rtol=1e-8)
        counts.append(run.stats["steps"])
        found = run["crank"].omega[-1], run.measure("i")[-1] / size
        A = np.array([[-1000.0, -250.0], [0.5 / 0.14, 0.0]])
        rest = -np.linalg.solve(A, [6000.0, 0.0])
        roots, vectors = np.linalg.eig(A)
        y = rest + vectors @ (np.exp(roots) * np.linalg.solve(vectors, -rest))
        np.testing.assert_allclose(found, y[::-1], atol=1e-6)
    assert max(counts) - min(counts) <= 1


def test_a_hydraulic_cylinder_by_radau():
    """Oil stiffer than anything: against explicit steps of another method and tolerance."""
    lift = HydraulicCylinder("lift", "ground.A", "slide", valve="0.5*sin(6 rad/s*t)", **OIL)
    machine = Mechanism("a press", ground={"A": (-0.5, 0.0)})
    machine.add(Body("slide", mass=200.0), Prismatic("guide", "ground", "slide"), lift)
    run = simulate(machine, 0.5, rtol=1e-8, instants=26, method="radau5")
    other = simulate(machine, 0.5, rtol=1e-11, instants=26)
    np.testing.assert_allclose(run["slide"].x, other["slide"].x, atol=1e-7)
    np.testing.assert_allclose(run["slide"].vx, other["slide"].vx, atol=1e-5)
    for chamber in "ab":
        name = f"lift.pressure_{chamber}"
        np.testing.assert_allclose(history(run, name), history(other, name), atol=200.0)  # of 160e5


@pytest.mark.parametrize("method", IMPLICIT)
def test_loops_with_states(method):
    """A slider-crank with a motor: constraints and its current together."""
    machine = mbody.makers.slider_crank(0.1, 0.3, masses=(1.0, 0.8, 0.5)).without("motor")
    machine.add(
        State("current", rate="(12 - 2*current - 0.5*crank.omega)/0.002", start=0.0),
        Torque("motor", "crank", value="0.5*current"),
        Gravity("gravity", y=-9.81),
    )
    other = simulate(machine, 0.5, rtol=1e-11, instants=11)
    run = simulate(machine, 0.5, rtol=1e-9, instants=11, method=method, **IMPLICIT[method])
    near = 1e-6 if method == "radau5" else 2e-3
    np.testing.assert_allclose(run["crank"].angle, other["crank"].angle, atol=near)
    np.testing.assert_allclose(run.measure("current"), other.measure("current"), atol=10 * near)
    assert run.residuals[..., 0].max() < 1e-13  # the constraints


# -- set times and events -------------------------------------------------------------------------


def driven_current(*more):
    """A current alone, on a wheel that is nearly fixed, by an input."""
    machine = Mechanism("fixed")
    machine.add(*more)
    machine.add(Body("wheel", mass=1.0, inertia=1e9), Revolute("O", "ground", "wheel"))
    numbers = {"resistance": R, "inductance": L, "constant": K}
    machine.add(DCMotor("motor", "wheel", voltage="u", **numbers))
    return machine


def held_current(t, levels, every):
    """The current under voltages that are held, by the exponential of each interval."""
    times = np.arange(len(levels) + 1) * every
    at = [0.0]
    for level in levels:
        at.append(level / R + (at[-1] - level / R) * math.exp(-every * R / L))
    k = np.minimum((t / every + 1e-9).astype(int), len(levels) - 1)
    rest = np.array(levels)[k] / R
    return rest + (np.array(at)[k] - rest) * np.exp(-(t - times[k]) * R / L)


def test_inputs_that_jump_and_corners_of_tables():
    levels = [24.0, -5.0, 12.0, 0.0, 9.0]
    held = Table(np.arange(5) * 0.01, levels, interpolation="hold")
    machine = driven_current(Input("u", held, dimension="voltage"))
    run = simulate(machine, 0.05, method="radau5", rtol=1e-9, instants=51)
    expected = held_current(run.t, levels, 0.01)
    np.testing.assert_allclose(history(run, "motor.current"), expected, atol=2e-7)


def test_generalized_alpha_keeps_its_order_over_jumps():
    levels = [24.0, -5.0, 12.0, 0.0, 9.0]
    held = Table(np.arange(5) * 0.01, levels, interpolation="hold")
    machine = driven_current(Input("u", held, dimension="voltage"))
    found = []
    for step in (5e-4, 2.5e-4, 1.25e-4):
        run = simulate(machine, 0.05, method="generalized-alpha", step=step, instants=11)
        off = history(run, "motor.current") - held_current(run.t, levels, 0.01)
        found.append(np.abs(off).max())
    assert 3.5 < found[0] / found[1] < 4.6
    assert 3.8 < found[1] / found[2] < 4.3


def test_a_sampled_controller_with_a_current():
    """u = 2 (5 A − i) at each millisecond: the recursion by hand."""
    regulator = Controller(
        "regulator", lambda t, i: 2.0 * (5.0 - i), every="1 ms", reads=["motor.current"], sets=["u"]
    )
    machine = driven_current(Input("u", 0.0, dimension="voltage"), regulator)
    run = simulate(machine, 0.01, method="radau5", rtol=1e-10, instants=101)
    levels, current = [], 0.0
    for _ in range(10):
        levels.append(2.0 * (5.0 - current))
        rest = levels[-1] / R
        current = rest + (current - rest) * math.exp(-1e-3 * R / L)
    expected = held_current(run.t, levels, 1e-3)
    np.testing.assert_allclose(history(run, "motor.current"), expected, atol=1e-8)


@pytest.mark.parametrize("method", IMPLICIT)
def test_events_of_states_and_motions_that_are_only_watched(method):
    """The current of a blocked motor passes 20 A where its exponential does; watching it changes
    no bit of the motion.
    """
    machine = driven_current(Input("u", 24.0, dimension="voltage"))
    how = {"method": method, **({"step": 1e-4} if method != "radau5" else {"rtol": 1e-10})}
    event = mbody.Event("motor.current - 20 A", direction=1)
    watched = simulate(machine, 0.02, events=[event], **how)
    plain = simulate(machine, 0.02, **how)
    expected = -L / R * math.log(1.0 - 20.0 * R / U)
    near = 1e-11 if method == "radau5" else 1e-6
    assert watched.events[0].t == pytest.approx(expected, abs=near)
    assert watched.record.blocks[0].tobytes() == plain.record.blocks[0].tobytes()


# -- going on -------------------------------------------------------------------------------------


@pytest.mark.parametrize("method", IMPLICIT)
def test_a_motion_with_states_goes_on_to_the_last_bit(method, tmp_path):
    # at rest the first step would follow from how long the motion is
    machine = wheel(motor(start=7.0))
    how = {"method": method, **({"rtol": 1e-9} if method == "radau5" else IMPLICIT[method])}
    first = simulate(machine, 0.237, **how)
    whole = simulate(machine, 0.5, **how)
    mbody.save_run(first, tmp_path / "run.npz")
    for one in (first, mbody.load_run(tmp_path / "run.npz")):
        rest = simulate(machine, 0.5, start=one, **how)
        assert history(rest, "motor.current")[-1] == history(whole, "motor.current")[-1]
        assert rest["wheel"].omega[-1] == whole["wheel"].omega[-1]


@pytest.mark.parametrize("method", IMPLICIT)
def test_a_simulator_steps_states(method):
    """Steps of 10 ms with another voltage each, against the exponential."""
    machine = driven_current(Input("u", 0.0, dimension="voltage"))
    how = {"rtol": 1e-10} if method == "radau5" else {"step": 1e-4}
    sim = mbody.Simulator(machine, method=method, **how)
    levels, found = [24.0, -5.0, 12.0, 0.0, 9.0], []
    for level in levels:
        sim.inputs["u"] = level
        sim.step(0.01)
        found.append(sim.measure("motor.current"))
        kept = sim.state
    expected = held_current(np.arange(1, 6) * 0.01 - 1e-12, levels, 0.01)
    np.testing.assert_allclose(found, expected, atol=1e-7 if method == "radau5" else 2e-3)
    sim.step(0.01)
    again = sim.measure("motor.current")
    sim.state = kept
    sim.step(0.01)
    assert sim.measure("motor.current") == again


# -- explicit steps that stability limits ---------------------------------------------------------


@pytest.mark.parametrize(("rtol", "most"), [(1e-6, 300), (1e-8, 300), (1e-10, 1000), (1e-12, 6000)])
def test_explicit_steps_at_the_limit_of_stability(rtol, most):
    """Between their ends too a motion is near its tolerance, and says where that was not easy.

    Measured over 10 motions a tolerance: up to 25 tolerances at 1e-8, 99 at 1e-10, 630 at 1e-12,
    which rounding decides; without the checks of instants and of the growth of steps 5754, 15 623
    and 73 363.
    """
    noted = 0
    for ratio, start in itertools.product((1.0, -2.0, 4.0), (0.0, 7.0)):
        run = simulate(wheel(motor(ratio=ratio, start=start)), 0.7, rtol=rtol)
        current, _ = exact(run.t, ratio, 0.0, start)
        off = np.abs(history(run, "motor.current") - current).max()
        assert off < most * rtol * np.abs(current).max()
        noted += any("stability" in note and "'radau5'" in note for note in run.notes)
    assert noted or rtol > 1e-9


def test_lanes_at_the_limit_of_stability():
    """Designs whose instants are doubtful go alone: their numbers are those of single motions."""
    values = np.linspace(0.3, 0.8, 21)
    machine = wheel(motor())
    measures = ["at(motor.current, 123)", "at(motor.current, 391)", "last(wheel.omega)"]
    how = {"until": 0.7, "rtol": 1e-10, "every": 0.001}
    found = mbody.sweep(
        machine, {"motor.resistance": values}, analysis="simulate", measure=measures, **how
    )
    for n, value in enumerate(values):
        one = simulate(assemble(machine).with_values({"motor.resistance": value}), **how)
        current = history(one, "motor.current")
        assert found[measures[0]][n] == pytest.approx(current[123], rel=1e-8)
        assert found[measures[1]][n] == pytest.approx(current[391], rel=1e-8)
        assert found[measures[2]][n] == pytest.approx(one["wheel"].omega[-1], rel=1e-8)
