"""A motion depends on what it is asked for alone: not on the motions of the system before it."""

import numpy as np
import pytest

import mbody
from mbody import State, assemble, gallery, simulate

#: Motions that pass change points, and others; how long.
MOTIONS = {"n_windows_2": 10.0, "n_windows_40": 3.0, "free_fourbar": 2.0, "cart_pole": 1.0}


def bits(run):
    return run.record.blocks[0].tobytes(), run.energy.balance.tobytes(), run.stats, run.notes


@pytest.mark.parametrize("name", MOTIONS)
def test_every_call_gives_the_same_bits(name):
    system = assemble(gallery.load(name))
    first, second = (simulate(system, MOTIONS[name]) for _ in range(2))
    fresh = simulate(assemble(gallery.load(name)), MOTIONS[name])
    assert bits(first) == bits(second) == bits(fresh)
    assert ("change point" in " ".join(first.notes)) == name.startswith("n_windows")


@pytest.mark.parametrize("saved", [False, True])
def test_a_motion_goes_on_with_what_it_has_met(saved, tmp_path):
    """Over ten change points, of which the first two were met before it goes on."""
    machine = gallery.load("n_windows_2")
    whole, first = simulate(machine, 10.0), simulate(machine, 2.0)
    assert len(first.restart.met)
    if saved:
        mbody.save_run(first, tmp_path / "run.npz")
        first = mbody.load_run(tmp_path / "run.npz")
    rest = simulate(machine, 10.0, start=first)
    rows = slice(0, whole.system.coordinates * 3)
    last = [run.record.table(rows)[-1] for run in (rest, whole)]
    np.testing.assert_array_equal(*last)


def test_a_simulator_set_back_passes_change_points_alike():
    sim = mbody.Simulator(gallery.load("n_windows_2"))
    sim.until(0.5)
    state = sim.state
    sim.until(3.0)
    first = sim.q.copy(), sim.v.copy()
    sim.state = state
    sim.until(3.0)
    np.testing.assert_array_equal(first, (sim.q, sim.v))


def test_change_points_with_auxiliary_states():
    """States that only watch: the motion passes its change points as without them."""
    machine = gallery.load("n_windows_2")
    plain = simulate(machine, 6.0)
    watched = gallery.load("n_windows_2")
    watched.add(
        State("turned", rate="c0.omega", start=0.0),
        State("lag", rate="(c0.angle - lag)/0.1", start="90 deg"),
    )
    run = simulate(watched, 6.0)
    assert run.status == plain.status
    assert [note[-60:] for note in run.notes] == [note[-60:] for note in plain.notes]
    np.testing.assert_allclose(run["c0"].angle, plain["c0"].angle, atol=1e-6)
    turned = run["c0"].angle - run["c0"].angle[0]
    np.testing.assert_allclose(run.measure("turned"), turned, atol=1e-7)
