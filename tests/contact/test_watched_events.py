"""Events of users in the kernel of steps, against closed forms and the same motion step by step."""

import math
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.interpolate import CubicHermiteSpline

import mbody
from mbody import Body, Contact, Event, Gravity, Mechanism, SimulationSettings
from mbody.analysis.dynamics import active_modes
from mbody.analysis.dynamics.active_modes import ActiveModes
from mbody.analysis.dynamics.integration import Integration
from mbody.kernels.contact_guards import BEGIN, END, EVENT, INSIDE, KEPT_LOOKS, node
from mbody.kernels.guard_zeros import NO_ZERO, UNCLEAR, first_zero
from mbody.kernels.step_state import NOT_QUIET

G, THROWN, RADIUS = 9.81, 3.0, 0.1


@pytest.fixture
def codes(monkeypatch):
    """What the kernel of steps has returned."""
    found, own = [], Integration._quiet_steps

    def steps(motion):
        found.append(int(own(motion)))
        return found[-1]

    monkeypatch.setattr(Integration, "_quiet_steps", steps)
    return found


def thrown(events, until=1.0):
    """A ball of radius 0.1 m thrown up at 3 m/s from 1 m over a floor on which it would bounce."""
    machine = Mechanism(
        "ball", ground={"O": (0.0, 0.0)}, ground_shapes={"floor": {"line": {"point": "O"}}}
    )
    disc = {"s": {"disc": "C", "radius": RADIUS}}
    machine.add(
        Body("ball", mass=2.0, inertia=0.1, points={"C": (0.0, 0.0)}, shapes=disc),
        Contact("bounce", "ground.floor", "ball.s", restitution=0.5),
        Gravity("g", y=-G),
    )
    start = {"ball": dict(x=0.0, y=1.0, angle=0.0, vx=0.0, vy=THROWN, omega=0.0)}
    machine.simulation = SimulationSettings(until=until, start=start, rtol=1e-10)
    return mbody.simulate(machine, until, events=events, instants=5)


def test_crossings_are_where_the_closed_form_says(codes):
    events = [
        Event("ball.y - 1.2 m", name="level"),
        Event("ball.y - 1.2 m", direction=1, name="up"),
        Event("ball.y - 1.2 m", direction=-1, name="down"),
        Event("ball.vy", name="top"),
        Event("ball.y*ball.vy", name="product"),
        Event("ball.ay + 9 m/s^2", name="never"),
    ]
    run = thrown(events, 0.7)  # crossings are located to 1e-12 of a step
    found = {}
    for one in run.events:
        found.setdefault(one.name, []).append(one.t)
    root = math.sqrt(THROWN**2 - 2.0 * G * 0.2)
    first, last = ((THROWN + side * root) / G for side in (-1.0, 1.0))
    assert found["level"] == pytest.approx([first, last], abs=1e-12)
    assert found["up"] == pytest.approx([first], abs=1e-12)
    assert found["down"] == pytest.approx([last], abs=1e-12)
    assert found["top"] == pytest.approx([THROWN / G], abs=1e-12)
    assert found["product"] == pytest.approx(found["top"], abs=1e-12)
    assert "never" not in found
    assert [one.t for one in run.events] == sorted(one.t for one in run.events)
    assert run.events[-1].state["ball"].y[0] == pytest.approx(1.2, abs=1e-12)
    assert NOT_QUIET not in codes


@pytest.mark.parametrize("depth", [1e-3, 1e-6, 1e-9])
def test_two_crossings_beside_an_extremum_are_found(codes, depth):
    """The ball passes a level a little below its highest place twice, and one above it never."""
    highest, time = 1.0 + THROWN**2 / (2.0 * G), math.sqrt(2.0 * depth / G)
    below = Event(f"ball.y - {highest - depth!r} m", name="below")
    above = Event(f"ball.y - {highest + depth!r} m", name="above")
    run = thrown([below, above], 0.7)
    assert [one.name for one in run.events] == ["below", "below"]
    times = [one.t for one in run.events]
    # located to 1e-12 of a step; the place is rounded to 1e-16, over the rate there
    assert times == pytest.approx(
        [THROWN / G - time, THROWN / G + time], abs=1e-15 / (G * time) + 1e-12
    )
    assert NOT_QUIET not in codes


def test_a_rate_that_an_impact_reverses_crosses_nothing_there(codes):
    """The velocity passes zero at the top of every flight, and jumps over it between."""
    run = thrown([Event("ball.vy", name="top")], 1.7)
    speed = math.sqrt(THROWN**2 + 2.0 * G * (1.0 - RADIUS))
    t, tops = (THROWN + speed) / G, [THROWN / G]
    for _ in range(3):
        speed *= 0.5
        tops.append(t + speed / G)
        t += 2.0 * speed / G
    assert [one.t for one in run.events if one.name == "top"] == pytest.approx(tops, abs=1e-12)
    assert all(one.name == "impact" for one in run.events if one.contact)
    assert NOT_QUIET not in codes


def test_an_event_ends_the_motion_before_the_impact_that_it_meets(codes):
    """At the place of the impact itself, and before: the first one that stops ends the motion."""
    fall = (THROWN + math.sqrt(THROWN**2 + 2.0 * G * (1.0 - RADIUS))) / G
    for level, stops in ((RADIUS, True), (RADIUS, False), (0.5, True)):
        run = thrown([Event(f"ball.y - {level} m", stop=stops, name="level")], 1.2)
        at = (THROWN + math.sqrt(THROWN**2 + 2.0 * G * (1.0 - level))) / G
        met = [one.t for one in run.events if one.name == "level"]
        assert met == pytest.approx([at], abs=1e-13)
        impacts = [one.t for one in run.events if one.name == "impact"]
        assert impacts == ([] if stops else pytest.approx([fall], abs=1e-13))
        if stops:
            assert run.t[-1] == met[0] and run.status.endswith(f"'ball.y - {level} m' is zero")
    assert NOT_QUIET not in codes


EVENTS = {
    "woodpecker": (0.05, ["sleeve.omega", "bird.omega", "sleeve.vy + 0.1 m/s", "bird.ay"]),
    "double_pendulum": (3.0, ["upper.omega", "lower.ax", "upper.angle - lower.angle"]),
    "sliding_ladder": (1.0, ["ladder.omega - 1 rad/s", "ladder.ay + 3 m/s^2", "ladder.y - 0.5 m"]),
}


@pytest.mark.parametrize("name", EVENTS)
def test_events_by_programs_are_those_that_python_finds(name, monkeypatch):
    until, of = EVENTS[name]
    model = mbody.gallery.load(name)
    events = [Event(one, direction=(0, 1, -1)[n % 3]) for n, one in enumerate(of)]
    runs = [mbody.simulate(model, until, events=events, instants=9, rtol=1e-10)]
    plain = mbody.simulate(model, until, events=[], instants=9, rtol=1e-10)
    monkeypatch.setattr(active_modes, "watched_by_program", lambda *_: None)
    runs.append(mbody.simulate(model, until, events=events, instants=9, rtol=1e-10))
    fast, slow = ([(e.name, e.contact, e.t) for e in run.events] for run in runs)
    assert [one[:2] for one in fast] == [one[:2] for one in slow]
    assert any(not one[1] for one in fast)
    times = np.array([[one[2] for one in each] for each in (fast, slow)])
    assert np.abs(times[0] - times[1]).max() <= 1e-8 * until
    # watching does not change the motion, but for 1e-12 of a step by which zeros are located, which
    # chains of impacts enlarge
    table = slice(0, 2 * plain.system.coordinates)
    found, expected = (run.record.table(table) for run in (runs[0], plain))
    assert np.abs(found - expected).max() <= 1e-7 * np.abs(expected).max()


@pytest.mark.parametrize("rtol", [1e-8, 1e-10])
def test_a_crossing_with_a_rest_between_is_one_whatever_rounding_says(rtol):
    """The sleeve turns by 1e-14 where its ends hold it: signs before and after, by samples."""
    model, times = mbody.gallery.load("woodpecker"), np.linspace(0.0, 0.3, 15001)
    run = mbody.simulate(model, 0.3, events=[Event("sleeve.omega")], times=times, rtol=rtol)
    rates = np.asarray(run.measure("sleeve.omega"))
    signs = np.sign(rates[np.abs(rates) > 1e-9])
    met = [one for one in run.events if one.name == "sleeve.omega"]
    assert len(met) == np.count_nonzero(np.diff(signs)) == 23


def looked_at(value, rate):
    """What `first_zero` reads of one event, by the values and rates of its five looks."""
    places = np.zeros((KEPT_LOOKS, 1))
    values, rates = places.copy(), places.copy()
    values[: len(value), 0], rates[: len(rate), 0] = value, rate
    events = SimpleNamespace(
        number=np.array([1.0, 0.0, 1.0, 0.0, 0.1, 0.1]),
        stops=np.array([0]),
        side=np.zeros((3, 1)),
    )
    return SimpleNamespace(
        kind=np.array([EVENT]), owner=np.array([0]), value=values, rate=rates, gap=values,
        past=np.full((KEPT_LOOKS, 1), -math.inf), past_rate=places, fresh=np.zeros(1),
        sense=np.zeros(1), seen=-np.ones(1), events=events, count=np.array([0]),
    )  # fmt: skip


def test_every_search_for_a_zero_ends_at_one_of_the_cubics():
    """Values of any size, many of them none: beside the cubics by SciPy."""
    rng, found = np.random.default_rng(1), 0
    for _ in range(300):
        size, h = 10.0 ** rng.integers(-60, 1), 10.0 ** rng.integers(-8, 2)
        value = size * rng.normal(size=5) * (rng.random(5) < 0.6)
        rate = size * 10.0 ** rng.integers(-3, 3) * rng.normal(size=5) * (rng.random(5) < 0.7)
        x = first_zero(looked_at(value, rate), 0, h, 0.0)
        if x in (NO_ZERO, UNCLEAR):
            continue
        order = [BEGIN, INSIDE, INSIDE + 1, INSIDE + 2, END]
        cubics = CubicHermiteSpline([node(k) for k in order], value[order], h * rate[order])
        near = np.abs(cubics(np.linspace(x - 1e-9, x + 1e-9, 3)))
        assert near.min() <= 1e-6 * np.abs(cubics(np.linspace(0.0, 1.0, 200))).max()
        found += 1
    assert found > 10


@pytest.mark.parametrize("error", [ZeroDivisionError, KeyboardInterrupt])
def test_what_python_raises_at_an_event_ends_the_steps(error, monkeypatch):
    """The error itself; an interrupt ends the motion with what is known."""
    monkeypatch.setattr(active_modes, "watched_by_program", lambda *_: None)
    own = ActiveModes.values_at

    def values(motion, t, record):
        if t > 0.2:
            raise error
        return own(motion, t, record)

    monkeypatch.setattr(ActiveModes, "values_at", values)
    if error is KeyboardInterrupt:
        run = thrown([Event("ball.vy")])
        assert run.status.startswith("stopped") and run.t[-1] <= 0.2
    else:
        with pytest.raises(ZeroDivisionError):
            thrown([Event("ball.vy")])
