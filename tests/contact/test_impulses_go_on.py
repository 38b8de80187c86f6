"""Motions by steps with impulses that go on: from a result, from a file, after Ctrl-C."""

import numpy as np
import pytest

import mbody
from tests.contact.test_many_contacts import stepped
from tests.support.cases import first_fast
from tests.support.piles import chain, pile


def onward(run, until, step, **options):
    return stepped(run.system, until, step, start=run, **options)


def same(later, whole, skip=1):
    """Whether the instants of `later`, but the first, are those of the whole motion to the bit."""
    at = np.searchsorted(whole.t, later.t[skip:])
    assert (whole.t[at] == later.t[skip:]).all()
    pairs = [(later.record.table(slice(None))[skip:], whole.record.table(slice(None))[at])]
    pairs += [(later.contact("floor")[skip:], whole.contact("floor")[at])]
    return all(np.array_equal(one, other) for one, other in pairs)


@first_fast(
    "machine, step, cut",
    [
        (pile(9, 0.9), 2e-3, 0.1),  # sweeps that are not tried after steps that did not converge
        (pile(9, 0.3), 2e-3, 0.1),
        (pile(3, 0.1), 1e-3, 0.0505),  # within a step
        # with steps by Lemke's method on both sides of the cut
        (chain(12, angle=0.2, height=0.02), 1e-3, 0.12),
        (chain(40, angle=0.05, height=0.02), 1e-3, 0.15),  # with rows of joints
    ],
    3,
)
def test_a_motion_goes_on_bit_for_bit(machine, step, cut, tmp_path):
    """Warm impulses included: the step that was cut is made anew in its whole length."""
    times = np.linspace(0.0, 2.0 * cut, 41)
    whole = stepped(machine, 2.0 * cut, step, times=times)
    first = stepped(machine, cut, step, times=times[:21])
    later = onward(first, 2.0 * cut, step, times=times[20:])
    assert same(later, whole)
    mbody.save_run(first, tmp_path / "first.npz")
    again = mbody.load_run(tmp_path / "first.npz")
    assert same(onward(again, 2.0 * cut, step, times=times[20:]), whole)
    # the work since the beginning of each part adds up
    lost = first.energy.lost["floor"][-1] + later.energy.lost["floor"][-1]
    assert lost == pytest.approx(whole.energy.lost["floor"][-1], rel=1e-9, abs=1e-12)


def test_what_was_interrupted_goes_on():
    def interrupt(reached):
        if reached > 0.05:
            raise KeyboardInterrupt

    times = np.linspace(0.0, 0.4, 401)
    run = stepped(pile(4, 0.2), 0.4, 1e-3, times=times, progress=interrupt)
    assert run.t[-1] < 0.4
    later = onward(run, 0.4, 1e-3, times=times[times >= run.t[-1]])
    whole = stepped(pile(4, 0.2), 0.4, 1e-3, times=times)
    assert same(later, whole)


def test_contacts_of_their_own_names_go_on_too():
    """Their friction is accounted by name, which the steps without their rows do not know."""
    machine = dropped()
    whole = mbody.simulate(machine, 0.2, method="moreau", step=1e-2)
    half = mbody.simulate(machine, 0.1, method="moreau", step=1e-2)
    later = mbody.simulate(machine, 0.2, start=half, method="moreau", step=1e-2)
    assert later["box"].y[-1] == whole["box"].y[-1]
    assert later["box"].vx[-1] == whole["box"].vx[-1]


def dropped() -> mbody.Mechanism:
    """A box thrown on a floor, with a contact that is no group."""
    made = mbody.Mechanism(
        "thrown", ground={"O": (0.0, 0.0)}, ground_shapes={"floor": {"line": {"point": "O"}}}
    )
    corners = {"A": (-0.1, -0.1), "B": (0.1, -0.1), "C": (0.1, 0.1), "D": (-0.1, 0.1)}
    box = {"s": {"polygon": ("A", "B", "C", "D")}}
    made.add(
        mbody.Body("box", mass=1.0, inertia=0.01, points=corners, shapes=box),
        mbody.Contact("foot", "ground.floor", "box.s", friction=0.3),
        mbody.Gravity("gravity", y=-9.81),
    )
    start = {"box": {"x": 0.0, "y": 0.11, "angle": 0.02, "vx": 0.5}}
    made.simulation = mbody.SimulationSettings(until=0.2, start=start)
    return made
