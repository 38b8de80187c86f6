"""Stepping: the motion of `simulate`, led on from outside; states that are set back."""

import copy
import pickle
import re

import numpy as np
import pytest
from numpy.testing import assert_allclose

import mbody
from mbody import Body, Mechanism, ModelError, Simulator, SolveError, gallery
from mbody.model.loads import CustomLoad
from tests.contact.test_one_sided import looping, lowered, told
from tests.support import folded
from tests.support.falling import G, ball

#: Loops, redundant joints, drivers, contacts, masses that are missing, stiff loads.
NAMES = (
    "andrews_squeezer",
    "cam_follower",
    "double_pendulum",
    "flyball_governor",
    "free_fourbar",
    "mud_pump_sixbar",
    "n_windows_2",
    "parallel_cranks",
    "peaucellier",
    "planetary_train",
    "scissor_lift",
    "vehicle",
)
METHODS = (("dop853", None), ("dopri5", None), ("radau5", None), ("rattle", 1e-3))
METHODS += (("rattle4", 1e-3), ("generalized-alpha", 1e-3))


def whole(sim):
    """Positions and rates."""
    return np.append(sim.q, sim.v)


def advanced(sim, count=50, dt=1e-3):
    for _ in range(count):
        sim.step(dt)
    return whole(sim)


@pytest.mark.parametrize("name", NAMES)
def test_until_gives_the_last_instant_of_simulate_bit_for_bit(name):
    machine = gallery.load(name)
    try:
        run = mbody.simulate(machine, 0.3, rtol=1e-6, times=[0.3])
    except (ModelError, SolveError) as error:
        with pytest.raises(type(error)) as raised:
            Simulator(machine, rtol=1e-6).until(0.3)
        assert str(raised.value) == str(error)
        return
    sim = Simulator(machine, rtol=1e-6)
    sim.until(0.3)
    pages = [one.record.table(slice(None))[-1] for one in (run, sim.solution())]
    assert np.array_equal(*pages)
    assert sim.status == run.status and set(run.notes) <= set(sim.notes)
    n = sim.system.coordinates
    # what is read without an evaluation is not projected once more: rounding of a position
    size = np.tile(sim.system.coordinate_units, 2) * (1.0 + np.abs(pages[0][: 2 * n]).max())
    assert (np.abs(whole(sim) - pages[0][: 2 * n]) < 1e-12 * size).all()


@pytest.mark.parametrize("method, step", METHODS)
@pytest.mark.parametrize("name", ["free_fourbar", "parallel_cranks"])
def test_every_method_is_that_of_simulate(name, method, step):
    machine = gallery.load(name)
    run = mbody.simulate(machine, 0.2, rtol=1e-6, method=method, step=step, times=[0.2])
    sim = Simulator(machine, rtol=1e-6, method=method, step=step)
    sim.until(0.2)
    assert np.array_equal(*(r.record.table(slice(None))[-1] for r in (run, sim.solution())))
    state = sim.state
    first = advanced(sim)
    sim.state = state
    assert np.array_equal(advanced(sim), first)


def test_any_partition_is_the_same_motion():
    """To a hundred times the tolerance: the errors of some hundred steps add up."""
    machine, tight = gallery.load("free_fourbar"), 1e-12
    run = mbody.simulate(machine, 1.0, rtol=tight, times=[1.0])
    last = run.record.table(slice(None))[-1]
    ends = np.sort(np.random.default_rng(5).uniform(0.0, 1.0, 300))
    for times in (np.linspace(0.0, 1.0, 1001)[1:], [*ends, 1.0], [0.5, 1.0]):
        sim = Simulator(machine, rtol=tight)
        for t in times:
            sim.until(float(t))
            assert sim.t == t
        found = whole(sim)
        assert_allclose(found, last[: len(found)], rtol=0, atol=1e-10 * np.abs(found).max())


# -- states -----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "kept", [copy.copy, copy.deepcopy, lambda s: pickle.loads(pickle.dumps(s))]
)
def test_a_state_set_back_gives_the_same_bits(kept):
    for name in ("free_fourbar", "double_pendulum", "parallel_cranks"):
        sim = Simulator(gallery.load(name), rtol=1e-7)
        advanced(sim, 37)
        state = kept(sim.state)
        first = [advanced(sim, 1, dt) for dt in (1e-3, 0.05, 1e-4, 0.1)]
        sim.state = state
        assert sim.t == state.t and np.array_equal(sim.q, state.q)
        again = [advanced(sim, 1, dt) for dt in (1e-3, 0.05, 1e-4, 0.1)]
        assert np.array_equal(first, again)


def test_reading_does_not_change_the_motion():
    quiet, read = (Simulator(gallery.load("free_fourbar")) for _ in range(2))
    for _ in range(100):
        quiet.step(1e-3)
        read.step(1e-3)
        assert read.reaction("B").fx and read["crank"].alpha and read.accelerations().any()
        assert read.status == "completed" and read.state is not None
    assert np.array_equal(whole(quiet), whole(read))


def test_a_doubt_is_reported():
    """The motion begins where branches meet: its reactions have no limit there."""
    lengths, masses, centres = (1.0, 2.0, 1.0, 2.0), (1.0, 2.0, 1.0), (0.5, 0.5, 0.5)
    angles = folded.antiparallel(lengths)
    rate = 6.0
    start = {"crank": {"angle": 0.0, "omega": rate}, "coupler": {"omega": rate * angles(0.0)[0][1]}}
    machine = folded.asked(folded.four_bar(lengths, masses, centres, 9.81), start)
    run, sim = mbody.simulate(machine, 0.3), Simulator(machine)
    times = np.linspace(0.0, 0.3, 31)
    theta, omega, alpha = folded.linkage(angles, lengths, masses, centres, 9.81).motion(
        0.0, rate, times
    )
    assert sim["crank"].alpha == pytest.approx(alpha[0], abs=1e-8)
    for n, t in enumerate(times[1:], 1):
        sim.until(float(t))
        assert sim.t == t
        # as `simulate` is tested for
        assert sim["crank"].angle == pytest.approx(theta[n], abs=1e-8)
        assert sim["crank"].omega == pytest.approx(omega[n], abs=1e-7)
    assert sim.status == run.status and sim.status.startswith("doubtful: the reactions grow")
    assert any("passes a change point" in note for note in sim.notes)
    sim.reset()
    sim.step(0.01)
    assert sim["crank"].angle == pytest.approx(theta[1], abs=1e-8)


def on_a_spring(outside):
    """A block on a spring whose table it leaves on its way, and comes back to."""
    machine = Mechanism("block")
    table = mbody.laws.Table([-0.5, 0.0, 0.5], [-10.0, 0.0, 10.0], outside=outside)
    machine.add(
        Body("block", mass=1.0, guess=(1.2, 0.0, 0.0)),
        mbody.Prismatic("guide", "ground", "block"),
        mbody.Spring(
            "spring", mbody.Marker("ground", (-1.0, 0.0)), "block", law=table, free_length=1.6
        ),
    )
    return machine


@pytest.mark.parametrize("dt", [0.02, 1.4])
def test_a_table_that_is_left_on_the_way_is_a_doubt(dt):
    """Between two readings too, in one call or in many; not where it is not left."""
    sim = Simulator(on_a_spring("hold"))
    run = mbody.simulate(on_a_spring("hold"), 1.4)
    assert [one.kind for one in run.doubts] == ["extrapolation"]
    while sim.t < 1.4 - 1e-9:
        sim.step(dt)
    assert [one.kind for one in sim.doubts] == ["extrapolation"]
    assert sim.doubts[0].elements == ("spring",)
    assert sim.status.startswith("doubtful: 'spring': the table of its law")
    state = sim.state
    sim.reset({"block.x": 0.7})
    assert sim.status == "completed"
    for _ in range(100):
        sim.step(0.02)
    assert sim.status == "completed"
    sim.state = state
    assert sim.status.startswith("doubtful")


LOST = re.compile(r"'(\w+)'.*?(?:pull|push)")


@pytest.mark.parametrize("dt", [1e-3, 0.2])
def test_a_contact_that_would_have_to_pull_is_a_note(dt):
    """As in simulate, between two readings too, in one call or in many."""
    for machine, size in (
        (looping(3.0), 0.0),
        (looping(6.5), 49.05 - 42.25 / 0.9),
        (lowered(0.15), 10.38),
    ):
        sim, run = Simulator(machine, rtol=1e-8), mbody.simulate(machine, 1.0, rtol=1e-8)
        while sim.t < 1.0 - 1e-9:
            sim.step(dt)
        pulled = [[n for n in one.notes if LOST.search(n)] for one in (sim, run)]
        assert len(pulled[0]) == len(pulled[1]) == (size > 0.0)
        if size:  # samples that are nearer to each other, or further apart, than those of simulate
            assert told(pulled[0])[0] == pytest.approx(size, rel=5e-3)
        before = sim.state
        sim.reset()
        assert not [note for note in sim.notes if LOST.search(note)]
        sim.state = before
        assert [n for n in sim.notes if LOST.search(n)] == pulled[0]


# -- ends and errors --------------------------------------------------------------------------


class Failing(CustomLoad):
    """Fails after a while."""

    def physics(self, i, j, p, t):
        """Nothing of use."""
        if t > 0.05:
            raise ZeroDivisionError("too late")
        return (0.0,) * 6


def test_a_step_that_fails_leaves_the_state_before_it():
    machine = gallery.load("simple_pendulum")
    machine.add(Failing("late", "ground", machine.bodies[0].name))
    sim = Simulator(machine)
    advanced(sim, 40)
    before, t = whole(sim), sim.t
    for ask in (lambda: sim.step(0.1), lambda: sim.until(3.0)):
        with pytest.raises(SolveError, match="the function of 'late' failed") as raised:
            ask()
        assert sim.t == t and np.array_equal(whole(sim), before)
        assert raised.value.element == "late" and raised.value.solution.t[-1] == t
    sim.step(1e-3)
    assert sim.t == t + 1e-3


def test_events_are_those_of_simulate():
    machine = ball(1.0, vy=2.0)
    start = machine.simulation.start
    events = [mbody.Event("ball.vy", name="top"), mbody.Event("ball.y - 0.3 m", name="mark")]
    machine.simulation = mbody.SimulationSettings(1.0, start, events=events)
    run, sim = mbody.simulate(machine, 2.0, rtol=1e-9), Simulator(machine, rtol=1e-9)
    while sim.t < 2.0:
        sim.until(min(2.0, sim.t + 0.0137))
    assert [one.name for one in sim.events] == [one.name for one in run.events]
    times = np.array([[one.t for one in found] for found in (sim.events, run.events)])
    assert np.abs(times[0] - times[1]).max() < 1e-9
    assert sim["ball"].y == pytest.approx(run["ball"].y[-1], abs=1e-8)


@pytest.mark.parametrize("dt", [1e-3, 0.9e-3, 0.7e-3])
def test_short_steps_miss_no_event(dt):
    """A ball that rises 0.1 µm above a mark for 0.3 ms, between the ends of a step or not."""
    machine = ball(1.0, vy=2.0)
    top = 1.0 + 2.0**2 / (2.0 * G) - 1e-7
    start = machine.simulation.start
    events = [mbody.Event(f"ball.y - {top!r} m", name="mark"), mbody.Event("ball.vy", name="top")]
    machine.simulation = mbody.SimulationSettings(1.0, start, events=events)
    sim = Simulator(machine)
    while sim.t < 0.4:
        sim.step(dt)
    half = np.sqrt(2.0 * 1e-7 / G)
    times = [2.0 / G - half, 2.0 / G, 2.0 / G + half]
    assert [one.name for one in sim.events] == ["mark", "top", "mark"]
    # heights are known to 1e-16 of 1 m, and pass the mark at 1.4 mm/s
    assert_allclose([one.t for one in sim.events], times, rtol=0, atol=1e-12)


def test_a_motion_ends_at_its_event():
    machine = ball(1.0)
    sim_settings = machine.simulation
    machine.simulation = mbody.SimulationSettings(
        sim_settings.until,
        sim_settings.start,
        events=[mbody.Event("ball.y", stop=True, name="ground")],
    )
    sim = Simulator(machine)
    state = sim.state
    sim.until(3.0)
    fall = np.sqrt(2.0 / G)
    assert sim.t == pytest.approx(fall, abs=1e-12)
    assert sim.status == f"ended: at t = {fall:.6g} s, 'ball.y' is zero"
    assert [one.name for one in sim.events] == ["ground"]
    with pytest.raises(SolveError, match=r"has ended: at t = .* set an earlier state"):
        sim.step(0.1)
    sim.state = state
    assert sim.status == "completed" and sim.events == ()
    sim.step(0.1)
    assert sim.t == 0.1


def test_drivers_follow_their_laws_and_are_released_at_the_start():
    machine = gallery.load("norton_fourbar")
    driver = machine.drivers[0].name
    run, sim = mbody.simulate(machine, 0.1, times=[0.1]), Simulator(machine)
    sim.until(0.1)
    assert sim.effort(driver) == run.effort(driver)[-1]
    machine.simulation = mbody.SimulationSettings(1.0, release={driver: 0.0})
    free = mbody.simulate(machine, 0.1, times=[0.1])
    sim = Simulator(machine)
    sim.until(0.1)
    assert sim.solution()["crank"].angle[-1] == free["crank"].angle[-1]


# -- readings ---------------------------------------------------------------------------------


READ = ("free_fourbar", "slider_crank", "vehicle", "cam_follower", "parallel_cranks", "mud_pump")


@pytest.mark.parametrize("name", READ)
def test_readings_are_those_of_results(name):
    machine = gallery.load(name)
    sim = Simulator(machine, rtol=1e-8)
    sim.until(0.05)
    run = sim.solution()

    def same(mine, theirs, size=1.0):
        # by other functions of the same numbers: their rounding, of what is read before the last
        # projection
        assert mine == pytest.approx(theirs, abs=1e-11 * max(1.0, abs(theirs), size))

    for body in machine.bodies:
        for key in ("x", "y", "angle", "vx", "vy", "omega", "ax", "ay", "alpha"):
            same(getattr(sim[body.name], key), getattr(run[body.name], key)[-1])
        for point in body.points:
            for key in ("x", "y", "vx", "vy", "ax", "ay"):
                theirs = getattr(run.point(f"{body.name}.{point}"), key)[-1]
                same(getattr(sim[f"{body.name}.{point}"], key), theirs)
    for joint in machine.joints:
        theirs, mine = run.reaction(joint.name), sim.reaction(joint.name)
        size = float(theirs.magnitude[-1])
        for key in ("fx", "fy", "torque", "magnitude"):
            same(getattr(mine, key), getattr(theirs, key)[-1], size)
        assert (mine.on, mine.by, mine.unique) == (theirs.on, theirs.by, theirs.unique)
    for measure in machine.measures:
        same(sim.measure(measure), run.measure(measure)[-1])
    for load in machine.loads:
        for key in load.quantities():
            same(sim.measure(f"{load.name}.{key}"), run.measure(f"{load.name}.{key}")[-1])
    for driver in machine.drivers:
        same(sim.effort(driver.name), run.effort(driver.name)[-1])


@pytest.mark.parametrize(
    "text",
    [
        "coupler.B.x - 2*crank.A.y",
        "sqrt(coupler.x^2 + coupler.y^2) + 3 in",
        "max(crank.angle, rocker.angle) - min(1, t/1 s)*abs(rocker.omega)*1 s",
        "atan2(B.fy, B.fx) - crank.angle*sin(crank.angle)",
        "0.5*7.7 lbf/(386 in/s^2)*(coupler.vx^2 + coupler.vy^2)",
        "hypot(crank.ax, crank.ay)",
        "sqrt(-1)*t",
        "crank.angle/(t - t)",
    ],
)
def test_measures_are_compiled(text):
    sim = Simulator(gallery.load("free_fourbar"))
    for _ in range(5):
        sim.step(0.01)
        with np.errstate(all="ignore"):
            expected = float(sim.solution().measure(text)[-1])
        assert sim.measure(text) == pytest.approx(expected, rel=1e-12, abs=1e-11, nan_ok=True)
        assert type(sim.measure(text)) is float
