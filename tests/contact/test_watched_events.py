"""Events of users in the kernel of steps, against closed forms and the same motion step by step."""

import math

import numpy as np
import pytest

import mbody
from mbody import Body, Contact, Event, Gravity, Mechanism, SimulationSettings
from mbody.analysis.dynamics import active_modes
from mbody.analysis.dynamics.active_modes import ActiveModes
from mbody.analysis.dynamics.integration import Integration
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


@pytest.mark.parametrize("rtol", [1e-8, 1e-10])
def test_a_crossing_with_a_rest_between_is_one_whatever_rounding_says(rtol):
    """The sleeve turns by 1e-14 where its ends hold it: signs before and after, by samples."""
    model, times = mbody.gallery.load("woodpecker"), np.linspace(0.0, 0.3, 15001)
    run = mbody.simulate(model, 0.3, events=[Event("sleeve.omega")], times=times, rtol=rtol)
    rates = np.asarray(run.measure("sleeve.omega"))
    signs = np.sign(rates[np.abs(rates) > 1e-9])
    met = [one for one in run.events if one.name == "sleeve.omega"]
    assert len(met) == np.count_nonzero(np.diff(signs)) == 23


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
