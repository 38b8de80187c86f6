"""Batches: one topology with many sets of numbers."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from mbody import (
    Force,
    Gravity,
    ModelError,
    SolveError,
    assemble,
    kinematics,
    kinetostatics,
    makers,
    statics,
)
from mbody.analysis.driven.path_following import Runner
from mbody.core.lanes import LANES
from tests.support.batches import DESIGNS, TIMES, OneOf, four_bar, same, spread


def test_a_batch_keeps_its_length():
    batch = assemble(four_bar()).with_values({"crank.mass": np.ones(3)})
    with pytest.raises(ModelError, match=r"'crank\.A\.x' has 2 values, others have 3"):
        batch.with_values({"crank.A.x": [1.0, 1.1]})
    assert batch.with_values({"crank.A.x": 0.9}).batch == 3


@pytest.mark.parametrize("analysis", [kinetostatics, statics, kinematics])
def test_a_batch_is_each_design_alone(analysis):
    batch = assemble(four_bar()).with_values(spread())
    assert batch.batch == DESIGNS >= 40
    run = analysis(batch, TIMES)
    assert run["crank"].angle.shape == (DESIGNS, len(TIMES))
    assert len(run.record.blocks) == 3 and run.status == "completed"
    for n in range(DESIGNS):
        same(OneOf(run, n), analysis(batch.design(n), TIMES))
    if analysis is kinetostatics:
        assert run.checks.equilibrium < 1e-11 and run.checks.virtual_work < 1e-11
        fx, fy, torque = run.inertia("coupler")
        alone = kinetostatics(batch.design(-1), TIMES)
        for part, wanted in zip((fx, fy, torque), alone.inertia("coupler")):
            assert_allclose(part[-1], wanted, rtol=0, atol=1e-11 * np.abs(wanted).max())


@pytest.mark.parametrize("count", [1, LANES - 1, LANES, LANES + 1])
def test_batches_that_do_not_fill_the_lanes(count):
    batch = assemble(four_bar()).with_values(spread(count))
    run = kinetostatics(batch, TIMES)
    assert run.effort("motor").shape == (count, len(TIMES))
    for n in {0, count // 2, count - 1}:
        same(OneOf(run, n), kinetostatics(batch.design(n), TIMES))


def test_points_of_a_batch():
    batch = assemble(four_bar()).with_values(spread())
    run = kinetostatics(batch, TIMES)
    for place in ("coupler.P", "crank.A", "rocker.B"):
        whole = run.point(place)
        assert whole.x.shape == (DESIGNS, len(TIMES))
        for n in (0, 20, DESIGNS - 1):
            alone = kinetostatics(batch.design(n), TIMES).point(place)
            for field in ("x", "y", "vx", "vy", "ax", "ay"):
                wanted = getattr(alone, field)
                atol = 1e-11 * max(1.0, np.abs(wanted).max())
                assert_allclose(getattr(whole, field)[n], wanted, rtol=0, atol=atol)


def lengths():
    """Designs of which some want steps smaller than the requested ones."""
    # crank + base − coupler − rocker: with 0.003 left the rocker whips round
    reach = np.full(DESIGNS, 3.5)
    reach[[5, 2 * LANES + 3]] = 3.997
    return {"ground.O4.x": reach, "crank.mass": np.linspace(1.0, 2.0, DESIGNS)}


def test_designs_that_fall_to_the_scalar_path(monkeypatch):
    """One quick design in each of two groups of lanes: steps must be halved there alone."""
    made, whole = [], Runner.scalar

    def counted(runner, start, asked, **more):
        made.append(float(start.work.par[:, 0].sum()))
        return whole(runner, start, asked, **more)

    batch = assemble(four_bar()).with_values(lengths())
    times = np.linspace(0.0, 1.2, 31)
    monkeypatch.setattr(Runner, "scalar", counted)
    run = kinetostatics(batch, times)
    monkeypatch.undo()
    assert made == [float(batch.par[:, n].sum()) for n in (5, 2 * LANES + 3)]
    for n in (4, 5, 6, 2 * LANES + 3):
        alone = kinetostatics(batch.design(n), times)
        fine = kinetostatics(batch.design(n), np.linspace(0.0, 1.2, 601))
        same(OneOf(run, n), alone)
        # the branch is kept
        assert_allclose(alone["rocker"].angle, fine["rocker"].angle[::20], rtol=0, atol=1e-11)


# of a slider-crank on the x axis: arms, offsets and directions that are zero in its description
ZEROS = {
    "slider.B.x": 0.2,
    "slider.cg.y": 0.3,
    "slider.cg.x": -0.2,
    "guide.i.angle": 0.2,
    "guide.j.angle": 0.1,
    "ground.guide.y": 0.1,
    "ground.O.y": -0.1,
    "crank.A.y": 0.2,
    "crank.cg.y": 0.2,
    "rod.A.y": 0.1,
}


def slider_crank():
    machine = makers.slider_crank(1.0, 3.0, masses=(1.0, 2.0, 3.0), speed=5.0)
    machine.add(Gravity("gravity", y=-9.81), Force("push", "slider.B", -20.0, angle=0.2))
    return machine


@pytest.mark.parametrize("name", ZEROS)
def test_a_number_that_was_zero(name):
    """What a topology learned from its first numbers must hold for all others."""
    system, times = assemble(slider_crank()), np.linspace(0.0, 1.3, 10 * LANES + 1)
    assert float(system.values[name]) == 0.0
    kinetostatics(system, times)  # it learns
    changed = system.with_values({name: ZEROS[name]})
    run = kinetostatics(changed, times)
    assert run.checks.constraint < 1e-13 and run.checks.equilibrium < 1e-11
    few = kinetostatics(assemble(slider_crank()).with_values({name: ZEROS[name]}), times[::LANES])
    same(Sampled(run, LANES), few)
    batch = system.with_values({name: np.linspace(0.0, ZEROS[name], 5)})
    run = kinetostatics(batch, times[::LANES])
    assert run.checks.constraint < 1e-13 and run.checks.equilibrium < 1e-11
    for n in range(5):
        same(OneOf(run, n), kinetostatics(batch.design(n), times[::LANES]))


class Sampled(OneOf):
    """Some instants of a run of one design."""

    def __init__(self, run, every):
        super().__init__(run, slice(None, None, every))
        self.t = run.t[self.n]

    def part(self, history):
        parts = {k: v[self.n] if isinstance(v, np.ndarray) else v for k, v in vars(history).items()}
        return type("part", (), parts)()


def test_a_design_that_cannot_close_is_named():
    values = spread()
    values["ground.O4.x"][21] = 9.0
    with pytest.raises(SolveError, match=r"^design 21 of the batch: loops do not") as caught:
        kinetostatics(assemble(four_bar()).with_values(values), TIMES)
    assert caught.value.element in ("A", "B")


def test_a_design_that_meets_a_dead_centre_is_named():
    values = {"crank.A.x": np.linspace(1.0, 1.2, DESIGNS)}
    values["crank.A.x"][33] = 2.2  # stretched before a turn is made
    with pytest.raises(SolveError, match=r"^design 33 of the batch: dead centre at .*'motor'"):
        kinetostatics(assemble(four_bar()).with_values(values), np.linspace(0.0, 1.2, 25))
