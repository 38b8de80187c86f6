"""Straight-line code against the kernel that serves all topologies, and against the oracle."""

import functools
import gc
import weakref
from concurrent.futures import ThreadPoolExecutor
from types import SimpleNamespace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

import mbody
from mbody.analysis.driven import batch
from mbody.core import selection
from mbody.core.lanes import highest, larger, select_le, smaller
from mbody.core.recorded_numbers import NumberRecording, Untraceable
from mbody.errors import ModelWarning
from mbody.straight_line import programs
from mbody.sweeps import Uniform, latin_hypercube
from mbody.sweeps import job as jobs
from tests.support.cases import first_fast
from tests.support.sweep_designs import four_bar, same, scattered

pytestmark = pytest.mark.skipif(
    selection.machine_code_folder() is None, reason="nothing makes or keeps machine code here"
)

#: Forces of both are rounded otherwise, and predicted by three places: of their peak.
CLOSE = 2e-11


@pytest.fixture
def codes(monkeypatch):
    """What was looked for while sweeps are many from one design on."""
    found = []

    def spy(*described):
        found.append(programs.straight_line_code(*described))
        return found[-1]

    monkeypatch.setattr(batch, "straight_line_code", spy)
    monkeypatch.setattr(jobs, "STRAIGHT", 1)
    return found


def both(machine, names, measure, count=37, part=0.002, **options):
    """The sweep by the kernel, and by straight-line code."""
    system = mbody.assemble(machine)
    ranges = {name: Uniform(part * abs(system.values[name]) + 1e-6) for name in names}
    samples = latin_hypercube(ranges, count, seed=4)
    by_code = mbody.sweep(system, samples, measure=measure, threads=1, **options)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(jobs, "STRAIGHT", 10**12)
        by_kernel = mbody.sweep(system, samples, measure=measure, threads=1, **options)
    return by_kernel, by_code


def agree(by_kernel, by_code, close=CLOSE):
    assert by_kernel.failures == by_code.failures
    for name in by_kernel.names:
        expected = by_kernel[name]
        scale = np.abs(expected).max()
        assert_allclose(by_code[name], expected, rtol=0.0, atol=close * max(scale, 1e-9))


def gallery(name):
    return lambda: mbody.gallery.load(name)


FOUR_BAR = (
    "norton_fourbar",
    ("crank.A.x", "coupler.B.x", "rocker.weight"),
    {"pin": "B.force", "effort": "motor.effort", "rate": "rocker.omega", "x": "coupler.x"},
)
MACHINES = {
    "four-bar": FOUR_BAR,
    "two choices of pivots": (
        "watt_sixbar",
        ("crank.A.x", "rocker.B.x"),
        {"pin": "B.force", "effort": "motor.effort"},
    ),
    "gears": ("planetary_train", ("planet.mass",), {"pin": "P.force", "effort": "motor.effort"}),
    "springs and several groups": ("porter_governor", ("sleeve.mass",), {"effort": "theta.effort"}),
    "contacts of wheels": ("vehicle", ("chassis.weight",), {"front": "front_tyre.force"}),
}


@first_fast("of", MACHINES, 1)
def test_a_sweep_agrees_with_the_kernel_that_serves_all(codes, of):
    name, names, measure = MACHINES[of]
    agree(*both(mbody.gallery.load(name), names, measure))
    assert codes and all(codes)


@first_fast("analysis", ["kinematics", "statics"], 1)
def test_other_analyses(codes, analysis):
    name, names, measure = FOUR_BAR
    if analysis == "kinematics":
        measure = {"rate": "rocker.omega", "bend": "rocker.alpha", "x": "coupler.x"}
    agree(*both(mbody.gallery.load(name), names[:2], measure, analysis=analysis))
    assert all(codes)


@pytest.mark.slow
@pytest.mark.parametrize("lanes", [4, 8])
def test_any_processor_s_number_of_lanes(codes, monkeypatch, tmp_path, lanes):
    """Eight lanes where registers hold four numbers, and four where they hold eight."""
    _, level = selection.machine_code_folder()
    monkeypatch.setattr(programs.selection, "machine_code_folder", lambda: (tmp_path, level))
    monkeypatch.setattr(programs, "build", functools.partial(programs.build, lanes=lanes))
    monkeypatch.setattr(programs, "_codes", {})
    name, names, measure = MACHINES["two choices of pivots"]
    agree(*both(mbody.gallery.load(name), names, measure, count=13))
    assert all(codes)
    same_motion(*motions(mbody.gallery.load(name), turn=True))
    made = [file.suffix for file in tmp_path.iterdir()]
    assert made == [".so", ".so"]


def test_designs_agree_with_the_path_of_one_design(codes):
    """Which solves by another factor, with steps of its own length."""
    names, measure = ("crank.A.x", "coupler.mass"), {"pin": "B.force", "effort": "motor.effort"}
    _, found = both(four_bar(), names, measure, count=11, turn="motor")
    system = mbody.assemble(four_bar())
    for design in (0, 7, 8, 10):
        own = {name: float(found.parameter(name)[design]) for name in names}
        run = mbody.kinetostatics(system.with_values(own), turn="motor")
        pin, effort = run.reaction("B").magnitude, run.effort("motor")
        assert_allclose(found["pin"][design], pin, rtol=1e-9)
        assert_allclose(found["effort"][design], effort, rtol=0.0, atol=1e-9 * np.abs(effort).max())


def test_values_of_the_driver_also_where_two_are_the_same(codes):
    """A step of length zero leaves the place before it useless for predictions."""
    name, names, measure = FOUR_BAR
    values = np.concatenate([np.linspace(0.2, 1.0, 9), [1.0, 1.0], np.linspace(1.1, 2.5, 12)])
    drive = {"motor": (values, 3.0, -2.0)}
    agree(*both(mbody.gallery.load(name), names, measure, drive=drive))
    assert all(codes)


@pytest.mark.parametrize("count", [1, 8, 17])
def test_any_number_of_designs(codes, count):
    name, names, measure = FOUR_BAR
    agree(*both(mbody.gallery.load(name), names, measure, count=count))
    assert all(codes)


def test_designs_that_cannot_turn_fail_as_they_do_alone(codes):
    system = mbody.assemble(four_bar())
    options = {"measure": {"pin": "peak(A.force)"}, "turn": "motor", "threads": 1}
    by_code = mbody.sweep(system, scattered(), **options)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(jobs, "STRAIGHT", 10**12)
        by_kernel = mbody.sweep(system, scattered(), **options)
    assert by_kernel.failures
    assert by_code.failures == by_kernel.failures
    assert_allclose(by_code["pin"], by_kernel["pin"], rtol=1e-11, equal_nan=True)
    assert all(codes)


def test_numbers_do_not_depend_on_how_a_batch_is_cut(codes, tmp_path):
    system = mbody.assemble(four_bar())
    options = {"measure": {"pin": "peak(A.force)"}, "turn": "motor"}
    one = mbody.sweep(system, scattered(), threads=1, **options)
    same(one, mbody.sweep(system, scattered(), threads=3, **options))
    same(one, mbody.sweep(system, scattered(), to=tmp_path / "sweep", **options))


# ---------------------------------------------------------------------------------------------
# One motion, of a system that is assembled with machine code of its own


def motions(machine, analysis=mbody.kinetostatics, **options):
    """The motion by the kernel, and by the code of its own."""
    systems = [mbody.assemble(machine, machine_code=own) for own in (False, True)]
    return [analysis(system, **options) for system in systems]


def same_motion(by_kernel, by_code, close=CLOSE):
    assert (by_kernel.status, by_kernel.notes) == (by_code.status, by_code.notes)
    assert_allclose(by_code.t, by_kernel.t, rtol=0.0, atol=0.0)
    n, last = by_kernel.system.coordinates, by_kernel.system.record_rows
    # positions, rates, accelerations, forces and torques, each by the greatest of all
    for part in (slice(0, n), slice(n, 2 * n), slice(2 * n, 3 * n), slice(3 * n, last)):
        expected, found = (run.record.table(part) for run in (by_kernel, by_code))
        size = np.abs(expected).max(initial=0.0)
        assert_allclose(found, expected, rtol=0.0, atol=close * size)


def by_own_code(run):
    """Whether a result is one of the code of its own: it keeps rows by instants."""
    (block,) = run.record.blocks
    return block.strides[0] < block.strides[1]


@pytest.mark.parametrize("count", [96, 97, *range(112, 128, 3), 129, 130, 361])
def test_any_number_of_instants_of_a_motion(count):
    """Pieces of any length: pages of eight instants that are full, begun, or not there at all."""
    by_kernel, by_code = motions(four_bar(), turn=True, instants=count)
    same_motion(by_kernel, by_code)
    assert by_own_code(by_code)


@pytest.mark.slow
def test_motions_in_turn_leave_each_other_as_they_were():
    """What a call borrows is given back, and takes other times, analyses and lengths."""
    system = mbody.assemble(four_bar(), machine_code=True)
    ends = [0.2, 0.6, 0.2, 0.4]
    analyses = [mbody.kinetostatics, mbody.kinematics, mbody.kinetostatics, mbody.statics]

    def all_of_them():
        return [
            one(system, np.linspace(0.0, end, count))
            for count in (100, 200)
            for one, end in zip(analyses, ends, strict=True)
        ]

    first = all_of_them()
    kept = [run.record.table(slice(None)).copy() for run in first]
    for run, before, again in zip(first, kept, all_of_them(), strict=True):
        assert_array_equal(run.record.table(slice(None)), before)
        assert_array_equal(again.record.table(slice(None)), before)


def test_threads_do_not_share_what_a_call_borrows():
    system = mbody.assemble(four_bar(), machine_code=True)
    times = [np.linspace(0.0, end, 1500) for end in np.linspace(0.2, 0.6, 24)]
    alone = [mbody.kinetostatics(system, t).effort("motor").copy() for t in times]
    with ThreadPoolExecutor(4) as threads:
        together = threads.map(lambda t: mbody.kinetostatics(system, t).effort("motor"), times)
        for expected, found in zip(alone, together, strict=True):
            assert_array_equal(found, expected)


@pytest.mark.parametrize("own", [False, True])
def test_a_system_is_freed_with_what_its_calls_borrow(own):
    system = mbody.assemble(four_bar(), machine_code=own)
    mbody.kinetostatics(system, np.linspace(0.0, 0.3, 200))
    gone = weakref.ref(system)
    del system
    gc.collect()
    assert gone() is None


@first_fast("of", MACHINES, 2)
def test_a_motion_agrees_with_the_kernel_that_serves_all(of):
    name = MACHINES[of][0]
    how = {"turn": True, "instants": 721}
    if name == "vehicle":
        how = {"t": np.linspace(0.0, 1.0, 300)}
    by_kernel, by_code = motions(mbody.gallery.load(name), **how)
    same_motion(by_kernel, by_code)
    assert by_own_code(by_code) and not by_own_code(by_kernel)
    assert by_code.branch.least == pytest.approx(by_kernel.branch.least, rel=1e-9)


def test_designs_of_a_batch_and_other_numbers_by_own_code():
    by_kernel, by_code = (mbody.assemble(four_bar(), machine_code=own) for own in (False, True))
    values = {"crank.A.x": np.linspace(0.9, 1.1, 5)}
    one, other = (
        mbody.kinetostatics(system.with_values(values), np.linspace(0.0, 0.6, 100))
        for system in (by_kernel, by_code)
    )
    peak = np.abs(one.reaction("A").fx).max()
    assert_allclose(other.reaction("A").fx, one.reaction("A").fx, rtol=0.0, atol=CLOSE * peak)


def test_a_mechanism_without_such_code_goes_by_the_kernel():
    by_kernel, by_code = motions(mbody.gallery.load("mud_pump"), turn=True)
    assert_array_equal(by_code.effort("motor"), by_kernel.effort("motor"))


def test_a_dead_centre_is_said_as_by_the_kernel():
    said = []
    for own in (False, True):
        system = mbody.assemble(mbody.makers.four_bar(1, 3, 2, 2.5, speed=10.0), machine_code=own)
        longer = system.with_values({"crank.A.x": 2.2})
        with pytest.raises(mbody.SolveError) as stop:
            mbody.kinetostatics(longer, turn=True)
        said.append(str(stop.value))
    assert said[0] == said[1] and "dead centre" in said[0]


# ---------------------------------------------------------------------------------------------
# Where there is none


@pytest.fixture
def fresh(monkeypatch, tmp_path):
    """A folder of its own, and nothing made yet."""
    monkeypatch.setattr(programs, "_codes", {})
    found = selection.machine_code_folder()
    monkeypatch.setattr(selection, "machine_code_folder", lambda: (tmp_path, found[1]))
    return tmp_path


def test_where_a_kernel_decides_by_numbers_it_serves(codes, fresh):
    """The pressure in the cylinder has branches."""
    by_kernel, by_code = both(
        mbody.gallery.load("mud_pump"), ("rod1.mass",), {"effort": "motor.effort"}
    )
    assert codes == [None]
    assert_array_equal(by_code["effort"], by_kernel["effort"])
    (note,) = fresh.iterdir()
    assert note.suffix == ".none"
    # which is remembered
    programs._codes.clear()
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(programs.subprocess, "run", None)
        both(mbody.gallery.load("mud_pump"), ("rod1.mass",), {"effort": "motor.effort"})
    assert codes == [None, None]


@pytest.mark.slow
def test_a_damaged_file_is_made_again(codes, fresh):
    name, names, measure = FOUR_BAR
    agree(*both(mbody.gallery.load(name), names, measure))
    (file,) = fresh.iterdir()
    half = file.read_bytes()[:1000]
    file.unlink()  # this process has the whole one open
    file.write_bytes(half)
    programs._codes.clear()
    agree(*both(mbody.gallery.load(name), names, measure))
    assert all(codes) and len(codes) == 2


def test_a_builder_that_fails_is_said_and_the_kernel_serves(codes, fresh, monkeypatch):
    name, names, measure = FOUR_BAR
    failed = SimpleNamespace(returncode=1, stderr="...\nMemoryError", stdout="")
    monkeypatch.setattr(programs.subprocess, "run", lambda *_, **__: failed)
    with pytest.warns(ModelWarning, match=r"could not be built \(MemoryError\)"):
        by_kernel, by_code = both(mbody.gallery.load(name), names, measure)
    assert_array_equal(by_code["pin"], by_kernel["pin"])


def test_without_a_folder_the_kernel_serves(codes, monkeypatch):
    monkeypatch.setattr(programs, "_codes", {})
    monkeypatch.setattr(selection, "machine_code_folder", lambda: None)
    name, names, measure = FOUR_BAR
    by_kernel, by_code = both(mbody.gallery.load(name), names, measure)
    assert codes == [None]
    assert_array_equal(by_code["pin"], by_kernel["pin"])


# ---------------------------------------------------------------------------------------------
# Recorded numbers


def test_functions_of_lanes_are_recorded():
    recording = NumberRecording(["a", "b"])
    a, b = recording.inputs["a"], recording.inputs["b"]
    made = [recording.made[recording.place_of(x)] for x in (smaller(a, b), larger(a, 2.0))]
    assert [name for name, *_ in made] == ["minimum", "maximum"]
    assert recording.made[recording.place_of(select_le(a, b, 1.0, a))][0] == "select_le"
    assert recording.value_of(select_le(1.0, 2.0, recording.constant(3.0), a)) == 3.0
    assert select_le(a, b, b, b).place == b.place
    with pytest.raises(Untraceable, match="all lanes"):
        highest(a)
