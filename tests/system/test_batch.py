"""Batches: one topology with many sets of numbers."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from mbody import (
    AngleDriver,
    Force,
    Gravity,
    ModelError,
    SolveError,
    Torque,
    assemble,
    kinematics,
    kinetostatics,
    makers,
    statics,
    sweep,
)
from mbody.analysis.driven.path_following import Runner
from mbody.core.lanes import LANES
from mbody.laws import Polynomial
from mbody.system.rank import smallest_gap
from tests.support.batches import DESIGNS, TIMES, OneOf, four_bar, same, spread
from tests.support.frictional import with_changes


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


@pytest.mark.parametrize("analysis", [kinetostatics, statics, kinematics])
def test_designs_that_fail_take_nothing_from_the_others(analysis):
    values = spread()
    values["ground.O4.x"][[0, 21]] = 9.0  # the branch is that of the first that closes
    values["crank.A.x"][33] = 2.2  # stretched before a turn is made
    times, failed = np.linspace(0.0, 1.2, 25), [0, 21, 33]
    batch = assemble(four_bar()).with_values(values)
    run = analysis(batch, times)
    assert list(run.failures) == failed
    assert run.status == f"failed: 3 of {DESIGNS} designs, as design 0: {run.failures[0]}"
    assert run.failures[0].startswith("loops do not close")
    assert run.failures[33].startswith("dead centre at ")
    assert list(run.notes) == [f"designs 0, 21, 33: failed, as design 0: {run.failures[0]}"]
    assert "failed: 3 of 41 designs" in str(run) and "the designs that did not fail" in str(run)
    for n in failed:
        with pytest.raises(SolveError) as caught:
            run.design(n)
        with pytest.raises(SolveError) as alone:
            analysis(batch.design(n), times)
        assert (str(caught.value), caught.value.element) == (str(alone.value), alone.value.element)
        assert np.isnan(run.record.table(slice(None))[n]).all()
    sound = np.setdiff1d(np.arange(DESIGNS), failed)
    rest = assemble(four_bar()).with_values({name: row[sound] for name, row in values.items()})
    # other lanes beside them, and another first design
    assert run["rocker"].angle[sound] == pytest.approx(analysis(rest, times)["rocker"].angle)
    assert run.checks.constraint < 1e-13


def test_why_loops_stay_open_is_worked_out_for_those_that_are_read(monkeypatch):
    """The smallest gap takes a tenth of a second."""
    looked = []

    def counted(*given):
        looked.append(given)
        return smallest_gap(*given)

    monkeypatch.setattr("mbody.analysis.position.open_loops.smallest_gap", counted)
    values = spread()
    values["ground.O4.x"][8:] = np.linspace(9.0, 9.9, DESIGNS - 8)
    run = kinematics(assemble(four_bar()).with_values(values), [0.0, 0.1])
    assert run.status.endswith(run.notes[0].partition("as design 8: ")[2])
    of_one = len(looked)
    assert of_one == 5  # all joints, then each of four left open
    assert len(run.failures) == DESIGNS - 8
    assert len(looked) == of_one * (DESIGNS - 8)


def test_means_of_a_batch_are_of_the_designs_that_did_not_fail():
    """The line of the motor's mean and rms."""
    lines = []
    for lengths in ([3.0, 3.1], [3.0, 3.1, 9.0]):
        values = {"coupler.B.x": lengths}
        designs = assemble(makers.four_bar(1.0, 3.0, 2.0, 3.5, masses=(1, 3, 2), speed=5.0))
        text = str(kinetostatics(designs.with_values(values), TIMES))
        lines += [line for line in text.splitlines() if line.startswith("T12")]
    assert len(lines) == 2 and lines[0] == lines[1]


def test_designs_that_all_fail():
    batch = assemble(four_bar()).with_values({"ground.O4.x": [9.0, 9.5]})
    with pytest.raises(SolveError, match=r"^design 0 of the batch: loops do not close"):
        kinetostatics(batch, TIMES)


@pytest.mark.parametrize("name", ["brake.value", "motor.law"])
def test_a_design_whose_law_has_no_value_there(name):
    """The others go on, in a batch and in a sweep; each error is that of the design alone."""
    law = "sqrt(1 - t)"
    machine = makers.four_bar(1.0, 3.0, 2.0, 3.5, masses=(1, 3, 2), speed=5.0).without("motor")
    machine.add(AngleDriver("motor", "crank", law if name == "motor.law" else Polynomial([0, 5])))
    machine.add(Torque("brake", "rocker", value=law if name == "brake.value" else 1.0))
    system, reach = assemble(machine), {f"{name}.c0": [0.3, 1.0, 2.0, 0.4]}
    run = kinetostatics(system.with_values(reach), TIMES)
    swept = sweep(system, reach, measure="peak(A.force)", t=TIMES)
    assert list(run.failures) == [0, 3] and swept.failures == run.failures
    assert run.status.startswith("failed: 2 of 4 designs, as ") and run.status in swept.notes
    for n in (0, 3):
        with pytest.raises(ModelError) as alone:
            kinetostatics(system.with_values(reach).design(n), TIMES)
        assert run.failures[n] == str(alone.value)
    peaks = np.hypot(run.reaction("A").fx, run.reaction("A").fy).max(axis=1)
    assert peaks == pytest.approx(swept["peak(A.force)"], nan_ok=True)


def test_a_failed_design_has_no_mode_of_friction():
    machine = makers.four_bar(1.0, 3.0, 2.0, 3.5, masses=(1, 3, 2), speed=5.0)
    more = {"friction": 0.1, "pin_radius": 0.01}
    machine = with_changes(machine, lambda one: more if one.name == "A" else {})
    designs = assemble(machine).with_values({"coupler.B.x": [9.0, 3.0]})
    modes = kinetostatics(designs, [0.0, 0.1]).mode("A")
    assert modes[0] == ["", ""] and set(modes[1]) <= {"slip+", "slip-"}
