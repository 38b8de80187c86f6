"""Systems of batches: users' own loads, pickles, the same system in two threads."""

import pickle
import threading
from dataclasses import dataclass

import numpy as np
import pytest

from mbody import assemble, kinetostatics
from mbody.model.loads import CustomLoad
from tests.support.batches import TIMES, OneOf, four_bar, same, spread


@dataclass(frozen=True)
class Drag(CustomLoad):
    """A force against the velocity of j's mass centre."""

    def physics(self, i, j, p, t):
        fx, fy = -(0.5 + t) * j[5], -(0.5 + t) * j[6]
        return -fx, -fy, 0.0, fx, fy, 0.0


def dragging():
    machine = four_bar()
    machine.add(Drag("drag", "ground", "coupler"))
    return machine


def test_a_batch_with_a_load_in_python():
    batch = assemble(dragging()).with_values(spread(5))
    run = kinetostatics(batch, TIMES)
    for n in range(5):
        same(OneOf(run, n), kinetostatics(batch.design(n), TIMES))
    plain = kinetostatics(assemble(four_bar()).with_values(spread(5)), TIMES)
    assert np.abs(run.effort("motor") - plain.effort("motor")).max() > 1e-2


@pytest.mark.parametrize("make", [four_bar, dragging])
@pytest.mark.parametrize("batched", [False, True])
def test_systems_pickle(make, batched):
    system = assemble(make())
    if batched:
        system = system.with_values(spread(3))
    before = kinetostatics(system, TIMES)  # with the functions registered in this process
    copy = pickle.loads(pickle.dumps(system))
    assert copy.batch == system.batch and copy.mechanism.name == "four-bar"
    same(kinetostatics(copy, TIMES), before, exactly=True)
    again = copy.with_values({"crank.mass": 9.0})
    same(
        kinetostatics(again, TIMES),
        kinetostatics(system.with_values({"crank.mass": 9.0}), TIMES),
        exactly=True,
    )


@pytest.mark.parametrize("make", [four_bar, dragging])
def test_two_threads_on_one_system(make):
    system = assemble(make())
    times = [np.linspace(0.0, 1.2, 40 if make is dragging else 400), TIMES]
    wanted = [kinetostatics(system, t) for t in times]
    found = [[] for _ in times]
    together = threading.Barrier(2)

    def work(k):
        together.wait()
        for _ in range(8):
            found[k].append(kinetostatics(system, times[k]))

    threads = [threading.Thread(target=work, args=(k,)) for k in range(2)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    for k, runs in enumerate(found):
        assert len(runs) == 8
        for run in runs:
            same(run, wanted[k], exactly=True)
