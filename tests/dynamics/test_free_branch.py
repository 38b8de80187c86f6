"""Free motion keeps its branch, or says so; energy and inertia that do not support a motion."""

import math

import numpy as np
import pytest

import mbody
from mbody import gallery
from mbody.sweeps import Uniform, monte_carlo
from tests import near_folded
from tests.support import folded
from tests.support.cases import first_fast

MARGINS = (1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8)


@first_fast("method", ["dop853", "dopri5", "radau5"], 2)
@pytest.mark.parametrize("rtol", [1e-4, 1e-6, 1e-8])
def test_near_parallelograms_keep_their_side(method, rtol):
    # the side of the dyad is the branch in closed form; the crank is shorter by the margin
    for margin in MARGINS:
        made = near_folded.machine((1.0 - margin, 3.0, 1.0, 3.0), 1, 1.0, 6.0, gravity=False)
        run = mbody.simulate(made, method=method, rtol=rtol, instants=501)
        assert (near_folded.sides(run) == 1).all()
        assert not run.doubts
        # errors of a step add up over some hundred steps, in a bend more than elsewhere
        assert np.abs(run.energy.balance).max() < max(2e3 * rtol, 1e-12) * run.energy.size
        assert 0.0 < run.checks.branch.least < 3.0 * math.sqrt(2.0 * margin)


@pytest.mark.parametrize("method", ["rattle", "rattle4", "generalized-alpha"])
def test_steps_of_one_length_keep_their_side(method):
    for margin in (1e-3, 1e-5, 1e-7):
        made = near_folded.machine((1.0 - margin, 3.0, 1.0, 3.0), 1, 1.0, 6.0, gravity=False)
        run = mbody.simulate(made, 3.0, method=method, step=1e-3, instants=201)
        assert (near_folded.sides(run) == 1).all() or run.doubts


def test_random_linkages_keep_their_side():
    found = near_folded.survey(60, seed=5)
    assert not sum(number for (_, how), number in found.items() if how == "LEFT")
    assert sum(number for (_, how), number in found.items() if how == "right") >= 57


def test_lanes_keep_their_side():
    # designs differ in their masses alone, so that one closed form is that of all
    a, b, c, d = 1.0 - 1e-6, 3.0, 1.0, 3.0
    made = near_folded.machine((a, b, c, d), 1, 1.0, 6.0, gravity=True)
    samples = monte_carlo({"crank.inertia": Uniform(0.05), "rocker.mass": Uniform(0.5)}, 24, seed=3)
    at = range(0, 101, 4)
    names = [f"at({body}.angle, {k})" for k in at for body in ("crank", "coupler")]
    found = mbody.sweep(made, samples, "simulate", names, until=4.0, instants=101, rtol=1e-6)
    for k in at:
        crank, coupler = found[f"at(crank.angle, {k})"], found[f"at(coupler.angle, {k})"]
        x, y = a * np.cos(crank), a * np.sin(crank)
        side = (d - x) * b * np.sin(coupler) + y * b * np.cos(coupler)
        assert (side > 0.0).all()


@pytest.mark.parametrize("name", ["n_windows_2"])
def test_change_points_are_passed_with_a_note(name):
    run = mbody.simulate(gallery.load(name), instants=4001)
    assert run.status == "completed"
    assert not run.doubts
    (note,) = run.notes
    assert "passes change points" in note
    # twice a turn all links are in line; the cranks are at 0 or 180 degrees there
    branch = run.checks.branch
    assert branch.least == 0.0
    crank = np.interp(branch.t, run.t, run[run.mechanism.bodies[0].name].angle)
    # a straight line between instants 2.5 ms apart is off by a h² / 8
    assert abs(math.sin(crank)) < 1e-4


def test_a_parallelogram_crosses_through_its_fold():
    # at constant speed, without gravity: the coupler stays parallel on the smooth continuation
    made = near_folded.machine((1.0, 3.0, 1.0, 3.0), 1, 1.0, 6.0, gravity=False)
    run = mbody.simulate(made, 1.2)
    assert not run.doubts
    assert np.abs(np.sin(run["coupler"].angle)).max() < 1e-6
    fold = (math.pi - 1.0) / 6.0
    assert run.checks.branch.least == 0.0
    assert run.checks.branch.t == pytest.approx(fold, abs=1e-6)
    assert f"at t = {fold:.5}"[:11] in run.notes[0]


@pytest.mark.parametrize("rtol", [1e-12, 1e-13])
@pytest.mark.parametrize("angle", [0.5, 0.8, 1.0, 1.3, 1.6])
def test_change_points_are_passed_at_errors_near_rounding(angle, rtol):
    lengths = (1.0, 2.0, 1.0, 2.0)
    branch = folded.antiparallel(lengths)
    coupler, rocker = branch(angle)
    machine = folded.four_bar(lengths, guess=(angle, coupler[0], rocker[0]))
    start = {"crank": {"angle": angle, "omega": 10.0}}
    run = mbody.simulate(folded.asked(machine, start, until=0.4, rtol=rtol))
    assert not run.doubts and run.checks.branch.least == 0.0
    theta, _, _ = folded.linkage(branch, lengths).motion(angle, 10.0, run.t)
    # scipy's own steps are at 1e-13; near the position rounding is magnified some hundred times
    np.testing.assert_allclose(run["crank"].angle, theta, rtol=0, atol=1e-10)


# -- energy -----------------------------------------------------------------------------------


def test_energy_out_of_proportion_is_a_doubt():
    machine = gallery.load("double_pendulum")
    run = mbody.simulate(machine, method="rattle", step=0.05)
    assert run.status.startswith("doubtful: the balance of energy")
    assert [doubt.kind for doubt in run.doubts] == ["energy"]
    assert run.doubts[0].t <= run.t[-1]
    assert not mbody.simulate(machine, method="rattle", step=0.002).doubts


@pytest.mark.parametrize("rtol", [1e-3, 1e-6, 1e-9, 1e-12])
@pytest.mark.parametrize("name", ["double_pendulum", "free_fourbar", "simple_pendulum"])
def test_ordinary_motions_are_not_in_doubt(name, rtol):
    for method in ("dop853", "dopri5"):
        run = mbody.simulate(gallery.load(name), 3.0, method=method, rtol=rtol)
        assert run.doubts == ()


# -- inertia ----------------------------------------------------------------------------------


def lever(inertia):
    """The quick return, its motor released; inertia of the crank in kg·m²."""
    machine = gallery.load("quick_return")
    # t·mm² of the gallery's units
    system = mbody.assemble(machine).with_values({"crank.inertia": 1e3 * inertia})
    return mbody.simulate(system, 0.5, release={"motor": 0.05})


def test_vanishing_inertia_is_a_doubt():
    run = lever(0.0)
    (doubt,) = run.doubts
    assert doubt.kind == "inertia"
    assert "crank" in doubt.elements
    assert 0.05 < doubt.t < 0.5
