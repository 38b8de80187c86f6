"""Work is counted, not timed: no more of it than was accepted, and no memory in the step loop.

`python -m tests.work_counts` writes the table of accepted counts anew.
"""

import gc
import tracemalloc

import numba
import numpy as np
import pytest

import mbody
from mbody import gallery
from mbody.core.decorators import PLAIN
from mbody.core.selection import chosen, open_library, source_hash
from tests.support.cases import first_fast
from tests.work_counts import allocations, plain, table
from tests.work_counts.allocations import MATHEMATICS
from tests.work_counts.workloads import CALLS, MOTIONS, calls_from_python, made

compiled = pytest.mark.skipif(PLAIN, reason="kernels are plain Python")
ACCEPTED = table.accepted()


@pytest.fixture(scope="module")
def called():
    return plain.counts()


# -- counts -----------------------------------------------------------------------------------


@compiled
@pytest.mark.parametrize(
    ("section", "name", "count"),
    [pytest.param(*one, id=f"{one[0]}: {one[1]}") for one in table.workloads()],
)
def test_no_more_work_than_was_accepted(section, name, count):
    found = table.complaints(section, name, ACCEPTED[section].get(name, {}), count())
    assert not found, "\n".join(found)


@first_fast("name", [one.name for one in CALLS], 3)
def test_no_more_calls_within_kernels_than_were_accepted(called, name):
    found = table.complaints("calls", name, ACCEPTED["calls"].get(name, {}), called[name])
    assert not found, "\n".join(found)


def test_the_table_has_all_workloads_and_no_others():
    now = {}
    for section, name, _ in table.workloads():
        now.setdefault(section, set()).add(name)
    now["calls"] = {one.name for one in CALLS}
    found = [text for part in now for text in table.stale(ACCEPTED[part].keys(), now[part])]
    assert not found, "\n".join(found)
    assert now.keys() == ACCEPTED.keys()


@compiled
@pytest.mark.parametrize("workload", [one for one in CALLS if hasattr(one, "method")], ids=str)
def test_plain_python_does_what_compiled_code_does(called, workload):
    """Counts of calls hold for compiled code, as it takes the same steps."""
    for count, n in workload.run().stats.items():
        apart = abs(called[workload.name].get(count, 0) - n)
        assert apart <= table.allowance("calls", count, n), count


def test_a_slope_factors_once(called):
    """Off singular positions, beside the corrections of positions: of two motions of one mechanism,
    closed and begun alike, by methods with different numbers of slopes.
    """
    one, other = (called[workload.name] for workload in CALLS[:2])
    assert one["evaluations"] > 2 * other["evaluations"]
    factors = [run["factorisations"] - run["corrections"] for run in (one, other)]
    assert factors[0] - factors[1] == one["evaluations"] - other["evaluations"]


def test_a_change_of_counts_is_a_sentence():
    before = {"steps": 100, "evaluations": 1000, "calls of flow": 1, "tangents": 7}
    assert not table.complaints("motions", "a", before, before | {"evaluations": 1020})
    assert not table.complaints("motions", "a", before, before | {"steps": 98})
    (more,) = table.complaints("motions", "a", before, before | {"evaluations": 1021})
    assert more.startswith("a: evaluations 1021, more than the 1000 of before, +2.1 %; if that")
    assert "python -m tests.work_counts" in more
    (less,) = table.complaints("motions", "a", before, before | {"steps": 97})
    assert "steps 97, less than the 100" in less
    assert len(table.complaints("motions", "a", before, before | {"calls of flow": 2})) == 1
    assert len(table.complaints("motions", "a", before, before | {"calls of new": 1})) == 1
    assert len(table.complaints("symbolic", "a", {"blocks": 1000}, {"blocks": 1001})) == 1
    (gone,) = table.complaints("motions", "a", {"tangents": 7}, {})
    assert gone.startswith("a: tangents 0, less than the 7 of before")
    assert table.stale({"a"}, {"b"}) == [
        f"b: not in table.toml; {table.ACCEPT}",
        f"a: in table.toml, but not counted; {table.ACCEPT}",
    ]


def test_the_table_is_read_as_it_is_written():
    import tomllib

    assert tomllib.loads(table.written(ACCEPTED)) == ACCEPTED


# -- calls from Python ------------------------------------------------------------------------


@compiled
@pytest.mark.parametrize("instants", [(400, 4000), (20, 90)])
def test_python_calls_no_more_kernels_for_more_positions(instants):
    """On lanes, and on the scalar path, of a system of which nothing is planned yet."""
    counts = []
    for count in instants:
        system = mbody.assemble(gallery.load("norton_fourbar"))
        with calls_from_python() as calls:
            mbody.kinetostatics(system, turn=True, instants=count)
        counts.append(calls)
    assert counts[0] and counts[0] == counts[1]


@compiled
def test_a_step_with_other_inputs_is_one_call():
    """Their derivative is evaluated within the call, as it is before the step by a call of its own
    where the state is read between.
    """
    machine = gallery.load("double_pendulum")
    machine.add(mbody.Input("u", "0 N*m"), mbody.Torque("motor", "upper", value="u"))
    sims = [mbody.Simulator(machine) for _ in range(2)]
    for sim in sims:
        sim.step(1e-2)
        sim.inputs["u"] = 3.0
    assert sims[0].state.inputs[0] == 3.0  # evaluated by itself
    with calls_from_python() as calls:
        sims[1].step(1e-4)
    assert calls == {"unwatched_motion": 1}
    sims[0].step(1e-4)
    assert np.array_equal(sims[0].q, sims[1].q) and np.array_equal(sims[0].v, sims[1].v)


# -- memory -----------------------------------------------------------------------------------

#: Kernels that step, and what runs them through all instants of a motion, by how many steps.
FEW, MANY = 40, 400


def steps(method, count, until=0.4):
    """A motion of about so many steps, of which only the ends are kept."""
    machine = made("free_fourbar")
    if method in ("rattle4", "generalized-alpha"):
        return lambda: mbody.simulate(machine, until, method=method, step=until / count, instants=2)
    # all steps alike: the time is longer
    part = count / FEW
    return lambda: mbody.simulate(machine, part * until, method=method, rtol=1e-8, instants=2)


def positions(count):
    """A turn on the scalar path, whose instants are far apart, so that it takes more steps."""
    times = np.linspace(0.0, 0.1, 50) * count / FEW
    return lambda: mbody.kinetostatics(made("norton_fourbar"), t=times)


def lanes(count):
    return lambda: mbody.kinetostatics(made("norton_fourbar"), turn=True, instants=10 * count + 1)


def designs(count):
    values = np.linspace(0.4, 0.6, count)
    return lambda: mbody.sweep(
        gallery.load("norton_fourbar"), {"crank.inertia": values}, measure="peak(motor.effort)"
    )


STEPPING = {
    "unwatched_motion by dop853": lambda n: steps("dop853", n),
    "unwatched_motion by radau5": lambda n: steps("radau5", n),
    "unwatched_motion by rattle4": lambda n: steps("rattle4", n),
    "unwatched_motion by generalized-alpha": lambda n: steps("generalized-alpha", n),
    "follow": positions,
    "follow_lanes": lanes,
    "follow_designs": designs,
}


@pytest.fixture(scope="module")
def warm():
    """Every kernel that steps, compiled or loaded, and all that Python keeps of a first call."""
    for make in STEPPING.values():
        make(FEW)()


@pytest.mark.numba
@pytest.mark.parametrize("name", STEPPING)
def test_steps_allocate_nothing_by_numbas_runtime(warm, name):
    """What a call needs once is the same whatever the number of steps."""
    few, many = (allocations.counted(STEPPING[name](n)) for n in (FEW, MANY))
    assert few == many, f"{name}: {many - few} allocations more for {MANY} than for {FEW} steps"


@pytest.mark.skipif(chosen().name != "native", reason="no library tells")
def test_libraries_need_nothing_that_could_allocate(warm):
    """What the linker found nowhere in them is arithmetic of the C library."""
    files = sorted(chosen().file.glob("*.so")) if chosen().library is None else [chosen().file]
    assert files
    for file in files:
        strange = set(open_library(file, source_hash()).entries()["needs"]) - MATHEMATICS
        assert not strange, f"{file.name} calls {sorted(strange)}, which may take memory"


@pytest.mark.numba
def test_kernels_call_nothing_that_could_allocate(warm):
    """Whatever LLVM was given for them and what they call, with the arithmetic and the one door."""
    found = allocations.kernels()
    assert {name.partition(" ")[0] for name in STEPPING} <= found.keys()
    looked_at = 0
    for name, kernel in found.items():
        if not kernel.overloads:
            continue
        looked_at += 1
        strange = allocations.strangers(allocations.text_of(kernel))
        assert not strange, f"{name} calls {sorted(strange)}, which may take memory in each step"
    assert looked_at >= len({name.partition(" ")[0] for name in STEPPING})


@pytest.mark.numba
def test_an_allocation_would_be_seen():
    """A function that makes an array at each step is caught by both."""

    @numba.njit
    def careless(count):
        total = 0.0
        for n in range(count):
            total += np.empty(n + 3).sum()
        return total

    careless(1)
    assert allocations.counted(lambda: careless(100)) == 100
    assert "NRT_MemInfo_alloc_aligned" in " ".join(
        allocations.strangers(allocations.text_of(careless))
    )


def peak(task):
    """Greatest memory of Python and NumPy while a task runs, beyond that of before; bytes."""
    gc.collect()
    tracemalloc.start()
    try:
        before, _ = tracemalloc.get_traced_memory()
        kept = task()
        _, most = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    del kept
    return most - before


@compiled
@pytest.mark.parametrize("name", list(STEPPING)[:5])
def test_memory_does_not_grow_with_the_number_of_steps(warm, name):
    """Ten times as many steps, the same instants: as much memory, to a few objects of a call.

    An object that each step left would take 32 bytes of 360 steps at the least, 11 kB; what is
    allowed is a fifth of that.
    """
    few, many = (min(peak(STEPPING[name](n)) for _ in range(3)) for n in (FEW, MANY))
    assert abs(many - few) < 2_000, f"{name}: {few} bytes of {FEW} steps, {many} of {MANY}"


def test_workloads_have_different_names():
    names = [one.name for one in (*MOTIONS, *CALLS)]
    assert len(set(names)) == len(names)
