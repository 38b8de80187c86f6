"""Events along a motion, against closed forms and other integrators."""

import json
import math

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import solve_ivp
from scipy.special import ellipk

import mbody
from mbody import (
    Body,
    CoordinateDriver,
    Event,
    Gravity,
    Marker,
    Mechanism,
    Prismatic,
    Revolute,
    SimulationSettings,
    Spring,
    Stop,
    cli,
    from_toml,
    gallery,
    simulate,
    to_toml,
)
from mbody.files.model import in_units
from tests.support.falling import ball

G = 9.81


# -- zero crossings ---------------------------------------------------------------------------


def test_an_event_is_where_the_closed_form_says():
    """Thrown up from 1 m at 3 m/s: through 1.2 m rising and falling, the top between."""
    machine = ball(vy=3.0)
    level = Event("ball.y - 1.2 m", name="level")
    up = Event("ball.y - 1.2 m", direction=1, name="up")
    down = Event("ball.y - 1.2 m", direction=-1, name="down")
    top = Event("ball.vy")
    run = simulate(machine, 1.0, events=[level, up, down, top])
    found = {}
    for one in run.events:
        found.setdefault(one.name, []).append(one.t)
    root = math.sqrt(9.0 - 2.0 * G * 0.2)
    # a parabola is met by the method of order 8 to rounding: some ten of 2.2e-16
    first, last = ((3.0 + side * root) / G for side in (-1.0, 1.0))
    assert found["level"] == pytest.approx([first, last], abs=1e-14)
    assert found["up"] == pytest.approx([first], abs=1e-14)
    assert found["down"] == pytest.approx([last], abs=1e-14)
    assert found["ball.vy"] == pytest.approx([3.0 / G], abs=1e-14)
    assert [one.t for one in run.events] == sorted(one.t for one in run.events)
    assert run.events[-1].state["ball"].y[0] == pytest.approx(1.2, abs=1e-14)
    assert run.status == "completed" and run.t[-1] == 1.0


def test_an_event_ends_the_motion():
    machine = ball()
    run = simulate(machine, 1.0, instants=11, events=[Event("ball.y", stop=True)])
    fall = math.sqrt(2.0 / G)
    assert run.t[-1] == pytest.approx(fall, abs=1e-14)
    assert len(run) == 6 and run["ball"].y[-1] == pytest.approx(0.0, abs=1e-14)
    assert run.status == "ended: at t = 0.451524 s, 'ball.y' is zero"
    on = simulate(machine, 1.0, start=run, instants=2)
    assert on["ball"].y[-1] == pytest.approx(1.0 - 0.5 * G, abs=1e-12)


def test_watching_does_not_change_the_motion():
    machine = gallery.load("free_fourbar")
    plain = simulate(machine, 1.0)
    events = [Event("crank.omega"), Event("A.fx"), Event("rocker.angle - 1.5 rad")]
    watched = simulate(machine, 1.0, events=events)
    assert {one.name for one in watched.events} >= {"A.fx"}
    assert (watched.record.blocks[0] == plain.record.blocks[0]).all()
    assert watched.stats["steps"] == plain.stats["steps"]
    assert (watched.energy.balance == plain.energy.balance).all()


def test_crossings_of_a_pendulum_beside_another_integrator():
    machine = gallery.load("simple_pendulum")
    run = simulate(machine, 10.0, rtol=1e-12, events=[Event("pendulum.omega", name="turning")])
    period = 2.36784194757623577  # from rest level to rest level again, by elliptic integrals
    turns = [one.t for one in run.events]
    # errors of steps of 1e-12 grow as t; the slope there is g/l
    assert turns == pytest.approx([0.5 * period * n for n in range(1, 9)], abs=1e-10)
    truth = solve_ivp(
        lambda t, y: [y[1], -G * math.cos(y[0])],
        (0.0, 3.0),
        [math.pi, 0.0],
        method="DOP853",
        rtol=1e-13,
        atol=1e-14,
        events=lambda t, y: math.sin(y[0]) + 0.5,
    )
    low = simulate(machine, 3.0, rtol=1e-12, events=[Event("pendulum.P.y + 0.5 m")])
    # scipy's polynomial between its steps is good to 1e-9
    assert [one.t for one in low.events] == pytest.approx(truth.t_events[0], abs=1e-8)


def test_forces_are_events_too():
    """A pin's force of a pendulum released level: F = 3 m g sin(depth), 1.5 m g at 30°."""
    machine = gallery.load("simple_pendulum")
    run = simulate(machine, 1.0, rtol=1e-11, events=[Event("O.force - 14.715 N", stop=True)])
    assert run["pendulum"].angle[-1] == pytest.approx(math.pi + math.pi / 6.0, abs=1e-9)


# -- files and the command --------------------------------------------------------------------


def test_files_and_the_command(capsys):
    machine = gallery.load("bouncing_ball")
    assert from_toml(to_toml(machine)) == machine
    other = from_toml(to_toml(machine).replace("direction = -1", "direction = 1"))
    assert other != machine
    changed = simulate(mbody.assemble(machine).with_values(e=0.5), 1.0)
    assert changed.events[0].after["ball"].vy[0] == pytest.approx(0.5 * math.sqrt(2.0 * G))
    softer = gallery.load("bouncing_ball", {"e": 0.5})
    assert softer != machine
    metric = simulate(in_units(machine, "mm-N-s"), 1.0)
    assert metric.events[1].state["ball"].y[0] == pytest.approx(640.0 + 30.0, abs=1e-7)
    assert cli.main(["simulate", "bouncing_ball", "--to", "2", "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    names = [one["name"] for one in told["events"]]
    assert names == ["impact", "top", "impact", "top", "impact", "top"]
    assert {one["contact"] for one in told["events"] if "contact" in one} == {"floor"}
    assert told["events"][0]["t"] == pytest.approx(math.sqrt(2.0 / 9.81), abs=1e-12)
    assert cli.main(["simulate", "bouncing_ball"]) == 0
    out = capsys.readouterr().out
    assert "EVENT   impact of floor at t = 0.451524, 1.17396" in out
    assert "EVENT   rest of floor at t = 4.06371 s" in out
    assert set(simulate(machine, 1.0).energy.by) == {"gravity", "floor"}


def test_drivers_that_go_take_their_events_along():
    machine = mbody.makers.four_bar(1, 3, 2, 3.5, masses=(1, 3, 2), speed=5.0)
    watched = [Event("motor.power"), Event("crank.omega")]
    machine.simulation = SimulationSettings(1.0, events=watched)
    assert machine.without("motor").simulation.events == (watched[1],)


# -- crossings that lie close together --------------------------------------------------------


def oscillator(speed=1.0):
    """x = 0.1 v sin 10 t."""
    machine = Mechanism("oscillator")
    machine.add(
        Body("b", mass=1.0, inertia=1.0, guess=(0.0, 0.0, 0.0)),
        Prismatic("guide", "ground", "b"),
        Spring("spring", Marker("ground", (-5.0, 0.0)), "b", stiffness=100.0, free_length=5.0),
    )
    machine.simulation = SimulationSettings(1.0, {"b": {"x": 0.0, "vx": speed}})
    return machine


def sines(part, last, sign=0):
    """When sin 10 t crosses a level, up to `last`."""
    up = math.asin(part)
    turns = 2.0 * math.pi * np.arange(int(10.0 * last / (2.0 * math.pi)) + 2)
    rising, falling = (up + turns) / 10.0, (math.pi - up + turns) / 10.0
    every = {0: np.concatenate([rising, falling]), 1: rising, -1: falling}[sign]
    return np.sort(every[(every > 0.0) & (every <= last)])


@pytest.mark.parametrize(
    ("method", "rtol", "parts"),
    [
        ("dop853", 1e-6, [0.0, 0.9, 0.99, 0.999]),
        ("dop853", 1e-8, [0.5, 0.999, 0.9999, 0.99999]),
        ("dop853", 1e-10, [0.9, 0.999, 0.999999]),
        ("dopri5", 1e-8, [0.9, 0.9999]),
        ("radau5", 1e-7, [0.999]),
    ],
)
def test_no_two_crossings_pass_between_samples(method, rtol, parts):
    """x − 0.0999 of x = 0.1 sin 10 t lies above zero for 9 ms of every 628 ms."""
    last = 4.0
    levels = [Event(f"b.x - {0.1 * part!r} m", name=f"{part}") for part in parts]
    run = simulate(
        oscillator(), last, instants=2, rtol=rtol, atol=1e-3 * rtol, method=method, events=levels
    )
    for part in parts:
        found = [one.t for one in run.events if one.name == f"{part}"]
        truth = sines(part, last)
        assert len(found) == len(truth)
        # the error of the motion, some rtol a radian, over the rate at the crossing
        close = 50.0 * rtol * last / max(math.sqrt(1.0 - part * part), 1e-3)
        assert found == pytest.approx(truth, abs=close)


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize("of", ["b.x - 0.0999 m", "b.vx - 0.999 m/s", "b.ax - 9.99 m/s^2"])
def test_directions_of_near_crossings(of, sign):
    """Of a place and a rate by what the motion says, of an acceleration by two samples."""
    run = simulate(oscillator(), 9.0, instants=2, events=[Event(of, direction=sign)])
    shift = {"x": 0.0, "vx": -0.05 * math.pi, "ax": -0.1 * math.pi}[of[2:4].strip()]
    truth = sines(0.999, 10.0, sign) + shift
    assert [one.t for one in run.events] == pytest.approx(
        truth[(truth > 0.0) & (truth <= 9.0)], abs=1e-5
    )


def test_forces_cross_close_together():
    """The pin of a pendulum that swings by 0.1 rad carries m g (3 cos φ − 2 cos 0.1)."""
    machine = gallery.load("simple_pendulum")
    machine.simulation = SimulationSettings(1.0, {"pendulum": {"angle": 1.5 * math.pi + 0.1}})
    run = simulate(machine, 8.0, rtol=1e-10, instants=20001)
    force = run.reaction("O").magnitude
    level = float(force.max() - 1e-4 * np.ptp(force))
    event = Event(f"O.force - {level!r} N")
    found = simulate(machine, 8.0, rtol=1e-10, instants=2, events=[event]).events
    assert len(found) == (np.diff(np.sign(force - level)) != 0.0).sum() > 8


def test_a_stop_that_is_grazed_is_struck():
    """x ≤ 0.0999 is reached a quarter of a turn on but for 4.5 mrad, at 44.7 mm/s."""
    for rtol in (1e-6, 1e-8, 1e-11):
        machine = oscillator()
        machine.add(Stop("wall", "0.0999 m - b.x", restitution=1.0))
        run = simulate(machine, 0.2, rtol=rtol, instants=2)
        assert [(one.name, one.contact) for one in run.events] == [("impact", "wall")]
        first = math.asin(0.999) / 10.0
        assert run.events[0].t == pytest.approx(first, abs=1e3 * rtol)
        assert run.events[0].after["b"].vx[0] == pytest.approx(
            -math.cos(10.0 * first), abs=1e4 * rtol
        )


@pytest.mark.parametrize("stop", [False, True])
def test_what_is_zero_but_for_rounding_at_the_beginning_is_no_crossing(stop):
    """A pendulum on a cart that moves evenly, released without a rate: that is 4e-17 there, on the
    side from which it falls. It vanishes next after half a period, of the complete integral K.
    """
    arm, mass, inertia, lean = 0.5, 2.0, 0.03, 0.4
    machine = Mechanism("pendulum on a cart")
    machine.add(
        Body("cart", mass=1.0),
        Body("bob", mass=mass, inertia=inertia, cg=(0.0, -arm), points={"P": (0.0, 0.0)}),
        Prismatic("rail", "ground", "cart"),
        Revolute("pin", "cart", "bob.P"),
        Gravity("gravity", y=-9.81),
        CoordinateDriver("push", "ground", "cart", "0.1*t"),
    )
    start = {"bob": {"angle": lean, "omega": 0.0}}
    machine.simulation = SimulationSettings(until=1.0, rtol=1e-11, start=start)
    run = simulate(machine, events=[Event("bob.omega", stop=stop)])
    rate = math.sqrt(mass * 9.81 * arm / (inertia + mass * arm**2))
    half = 2.0 * ellipk(math.sin(lean / 2.0) ** 2) / rate
    # steps of rtol 1e-11
    assert_allclose([event.t for event in run.events], [half], rtol=1e-9)


def test_a_part_of_a_motion_has_the_events_of_that_part():
    """Also one that is followed again: events after its last instant are not among its own."""
    run = simulate(gallery.load("bouncing_ball"))
    assert len(run.take(np.arange(len(run))).events) == len(run.events) > 100
    fall = math.sqrt(2.0 / 9.81)  # of 1 m
    assert run.at([0.1, 0.9 * fall]).events == ()
    assert [event.name for event in run.at([0.1, 1.1 * fall]).events] == ["impact"]
    k = int(np.searchsorted(run.t, 1.1 * fall))
    assert len(run.take(np.arange(k + 1)).events) == sum(e.t <= run.t[k] for e in run.events)


# -- events that vary fast --------------------------------------------------------------------


def turning(of, **how):
    """A wheel that turns by one radian a second."""
    machine = Mechanism("wheel")
    machine.add(Body("b", mass=1.0, inertia=0.1), Revolute("O", "ground", "b"))
    return simulate(machine, 1.0, rates={"b": 1.0}, events=[Event(of, name="fast", **how)])


@pytest.mark.parametrize(("w", "noted"), [(30, False), (1500, False), (1e5, True)])
def test_what_varies_faster_than_it_is_looked_at_is_noted(w, noted):
    run = turning(f"2 + sin({w}*b.angle)")
    notes = [one for one in run.notes if "event 'fast' varies faster" in one]
    assert len(notes) == noted and run.events == ()
    if noted:
        apart = float(notes[0].partition("every ")[2].partition(" s:")[0])
        assert w * apart > 1.9  # rad between two samples
        most = float(notes[0].partition("up to some ")[2].partition(" in 1 s")[0])
        assert most == pytest.approx(0.5 / apart, rel=1e-2)  # of digits that are written


@pytest.mark.parametrize("of", ["2 + abs(sin(3*b.angle))", "1.5 + sign(sin(20*b.angle))"])
def test_what_bends_or_jumps_is_not(of):
    assert turning(of).notes == ()


def test_the_first_of_fast_crossings_is_located():
    """θ = t: between two of the samples that are taken at first there are two periods."""
    run = turning("sin(5000*b.angle)", stop=True)
    assert run.t[-1] == pytest.approx(math.pi / 5000, rel=1e-9)
