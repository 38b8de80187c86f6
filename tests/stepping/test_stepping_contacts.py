"""Simulators with contacts and frictional joints: the motion of `simulate`, its modes carried
along.
"""

import pickle

import numpy as np
import pytest

import mbody
from mbody.stepping import simulators
from tests.support.cases import first_fast

G = 9.81
FLOOR = {"floor": {"line": {"point": "O"}}}


def pushed(friction=0.5, **more):
    """A point of mass 1 on a floor, pushed by an input."""
    machine = mbody.Mechanism("pushed", ground={"O": (0, 0)}, ground_shapes=FLOOR)
    machine.add(
        mbody.Body("stone", mass=1.0, inertia=0.1, points={"C": (0, 0)}),
        mbody.Contact("floor", "ground.floor", "stone.C", friction=friction),
        mbody.Gravity("g", y=-G),
        mbody.Input("u", "0 N"),
        mbody.Force("push", "stone.C", "u", angle=0),
    )
    machine.simulation = mbody.SimulationSettings(
        until=1.0, start={"stone": {"x": 0.0, "y": 0.0}}, instants=11, **more
    )
    return machine


def wheel():
    machine = mbody.Mechanism(
        "wheel",
        ground={"A": (0.0, 0.0), "B": (3.0, 0.0)},
        ground_shapes={"top": {"segment": ("A", "B")}},
    )
    rim = {"rim": {"disc": "C", "radius": 0.2}}
    machine.add(
        mbody.Body("wheel", mass=3.0, inertia=0.06, points={"C": (0.0, 0.0)}, shapes=rim),
        mbody.Contact("road", "ground.top", "wheel.rim", friction=0.15),
        mbody.Gravity("g", y=-G),
    )
    start = {"wheel": {"x": 0.1, "y": 0.2, "vx": 2.0}}
    machine.simulation = mbody.SimulationSettings(until=0.8, start=start, rtol=1e-11, instants=41)
    return machine


def block():
    machine = mbody.Mechanism("block", ground={"O": (0, 0)}, ground_shapes=FLOOR)
    corners = {"A": (-0.1, -0.2), "B": (0.1, -0.2), "C": (0.1, 0.2), "D": (-0.1, 0.2)}
    machine.add(
        mbody.Body(
            "block",
            mass=2.0,
            inertia=2.0 * (0.04 + 0.16) / 12,
            points=corners,
            shapes={"box": {"polygon": [*corners]}},
        ),
        mbody.Contact("base", "ground.floor", "block.box", friction=0.6),
        mbody.Gravity("g", y=-G),
    )
    y = 0.1 * np.sin(0.3) + 0.2 * np.cos(0.3)
    start = {"block": {"x": 0.0, "y": y, "angle": 0.3}}
    machine.simulation = mbody.SimulationSettings(until=2.0, start=start, instants=41)
    return machine


def pendulum():
    machine = mbody.Mechanism("pendulum", ground={"O": (0.0, 0.0)})
    machine.add(
        mbody.Body("bob", mass=2.0, inertia=0.18, cg=(0.0, -0.4), points={"O": (0.0, 0.0)}),
        mbody.Revolute("O", "ground.O", "bob.O", friction=0.75, pin_radius=0.05),
        mbody.Gravity("g", y=-G),
    )
    start = {"bob": {"angle": 1.2}}
    machine.simulation = mbody.SimulationSettings(until=6.5, start=start, rtol=1e-11, instants=66)
    return machine


MACHINES = {"wheel": wheel, "block": block, "pendulum": pendulum}


@pytest.mark.parametrize("name", MACHINES)
def test_steps_are_those_of_simulate(name):
    machine = MACHINES[name]()
    run, sim = mbody.simulate(machine), mbody.Simulator(machine)
    body = machine.bodies[0].name
    element = next(iter(run.modes))
    for k, t in enumerate(run.t):
        sim.until(t)
        for key in ("x", "y", "angle"):
            # to the tolerance of both, which end their steps elsewhere
            assert getattr(sim[body], key) == pytest.approx(getattr(run[body], key)[k], abs=1e-6)
        assert sim.mode(element) == run.mode(element)[k], t
    assert [event.name for event in sim.events] == [event.name for event in run.events]
    times = [event.t for event in run.events]
    assert [event.t for event in sim.events] == pytest.approx(times, abs=1e-6)
    solution = sim.solution()
    assert solution.mode(element) == [run.mode(element)[0], run.mode(element)[-1]]
    assert solution.energy.error < 1e-6
    lost = run.energy.lost[element][-1]
    assert solution.energy.lost[element][-1] == pytest.approx(lost, rel=1e-5)


@first_fast("name", MACHINES, 2)
def test_a_state_that_is_set_gives_the_same_bits(name):
    machine = MACHINES[name]()
    until, sim = machine.simulation.until, mbody.Simulator(machine)
    times = np.linspace(0.0, until, 24)[1:]
    passed, kept = [], None
    for n, t in enumerate(times):
        sim.until(float(t))
        passed.append(tuple(sim.q) + tuple(sim.v))
        if n == 8:
            kept = pickle.dumps(sim.state)
    for other in (sim, mbody.Simulator(machine)):
        other.state = pickle.loads(kept)
        for n, t in enumerate(times[9:], start=9):
            other.until(float(t))
            assert tuple(other.q) + tuple(other.v) == passed[n]


def test_inputs_break_what_sticks_and_let_it_stick_again():
    sim = mbody.Simulator(pushed())
    sim.step(0.5)
    assert sim.mode("floor") == "stick"
    sim.inputs["u"] = 4.9  # below μ m g = 4.905
    sim.step(0.5)
    assert (sim.mode("floor"), sim["stone"].vx) == ("stick", 0.0)
    assert sim.reaction("floor").fx == pytest.approx(-4.9, rel=1e-12)
    sim.inputs["u"] = 10.0
    sim.step(0.2)
    assert sim.mode("floor") == "slip+"
    v = 0.2 * (10.0 - 0.5 * G)
    assert sim["stone"].vx == pytest.approx(v, rel=1e-12)
    sim.inputs["u"] = 0.0
    sim.step(1.0)
    assert sim.mode("floor") == "stick"
    assert [event.name for event in sim.events] == ["slip", "stick"]
    assert sim.events[-1].t == pytest.approx(1.2 + v / (0.5 * G), rel=1e-11)


def test_a_controller_breaks_what_sticks_in_simulate():
    """The jump comes at a set time, between two steps: no guard passes zero there."""
    machine = pushed()
    machine.add(
        mbody.Controller(
            "hand", lambda t, x: 10.0 * (t > 0.35), every=0.1, reads=["stone.x"], sets=["u"]
        )
    )
    run = mbody.simulate(machine)
    (slip,) = run.events
    assert (slip.name, slip.t) == ("slip", pytest.approx(0.4, abs=1e-12))
    v = (10.0 - 0.5 * G) * np.maximum(run.t - 0.4, 0.0)
    assert run["stone"].vx == pytest.approx(v, abs=1e-11)


def test_a_block_that_rocks_comes_to_rest_whatever_its_steps():
    """Impacts follow each other ever sooner; as many are located as double numbers tell apart."""
    for count in (1, 20, 33):
        sim = mbody.Simulator(block())
        for n in range(count):
            sim.until(2.0 * (n + 1) / count)
        names = [event.name for event in sim.events]
        assert names[-1] == "rest" and names.count("rest") == 1
        assert len(names) < 100
        assert sim["block"].angle == pytest.approx(0.0, abs=1e-9)
        assert sim["block"].omega == pytest.approx(0.0, abs=1e-12)
        # what stood on a corner at first lies flat: all potential energy of the lean is lost
        first = 2.0 * G * (0.1 * np.sin(0.3) + 0.2 * np.cos(0.3) - 0.2)
        assert sim.solution().energy.lost["base"][-1] == pytest.approx(first, rel=1e-6)


def test_reset_decides_modes_anew_and_leaves_the_state_where_it_fails():
    sim = mbody.Simulator(wheel())
    sim.until(0.5)
    assert sim.mode("road") == "roll"
    sim.reset({"wheel": {"x": 0.3, "y": 0.5}})
    assert sim.mode("road") == "open"
    assert sim.contact("road") == 0.0
    sim.until(0.5)
    height = 0.5 - 0.5 * G * min(0.5, np.sqrt(2 * 0.3 / G)) ** 2
    assert sim["wheel"].y == pytest.approx(max(height, 0.2), abs=1e-9)
    before = tuple(sim.q)
    with pytest.raises(mbody.ModelError, match=r"overlap by 0\.05"):
        sim.reset({"wheel": {"x": 0.3, "y": 0.15}})
    assert tuple(sim.q) == before
    sim.reset()
    assert (sim.t, sim.mode("road")) == (0.0, "slip+")


def test_ropes_pull_in_steps():
    machine = mbody.Mechanism("dog", ground={"O": (0.0, 1.0)})
    machine.add(
        mbody.Body("dog", mass=1.0, inertia=0.1, points={"collar": (0, 0)}),
        mbody.Rope("leash", "ground.O", "dog.collar", length=0.8),
        mbody.Gravity("g", y=-G),
    )
    machine.simulation = mbody.SimulationSettings(until=1.0, start={"dog": {"y": 0.5}})
    sim = mbody.Simulator(machine)
    assert (sim.mode("leash"), sim.contact("leash")) == ("open", 0.0)
    sim.until(1.0)
    assert sim.mode("leash") == "stick"
    assert sim.contact("leash") == pytest.approx(G, rel=1e-9)
    assert sim.events[0].t == pytest.approx(np.sqrt(2 * 0.3 / G), rel=1e-9)


@pytest.mark.parametrize("shared", [False, True])
def test_states_of_many_are_set_back_and_reset_one_by_one(shared, monkeypatch):
    """With a simulator for each, and with one for all of them: the same numbers."""
    if shared:
        monkeypatch.setattr(simulators, "MOST_APART", 2)
    sims = mbody.Simulators(pushed(), 3)
    sims.inputs["u"] = np.array([0.0, 6.0, 10.0])
    sims.step(0.1)
    before = sims.state
    sims.step(0.1)
    after = sims["stone"].x.copy(), sims["stone"].vx.copy()
    assert after[0][0] == 0.0 and after[0][1] > 0.0
    for back in (before, pickle.loads(pickle.dumps(before))):
        sims.state = back
        sims.step(0.1)
        assert np.array_equal([sims["stone"].x, sims["stone"].vx], after)
    sims.reset([1])
    assert sims.t == pytest.approx([0.2, 0.0, 0.2]) and sims["stone"].x[1] == 0.0
    sims.inputs["u"] = np.array([0.0, 6.0, 10.0])
    sims.step(np.array([0.1, 0.2, 0.1]))
    alone = 0.5 * 0.2**2 * (6.0 - 0.5 * G)
    assert sims["stone"].x[1] == pytest.approx(alone, rel=1e-9)
    with pytest.raises(mbody.ModelError):
        sims.reset([1], {"stone.nothing": 1.0})
    assert sims["stone"].x[1] == pytest.approx(alone, rel=1e-9)


def test_sweeps_of_motions_have_rows_for_designs_that_fail():
    """What slides at first rolls with v₀ m r²/(m r² + J), whatever its friction; a wheel that is
    too large overlaps the floor.
    """
    machine = mbody.Mechanism("thrown", ground={"O": (0, 0)}, ground_shapes=FLOOR)
    rim = {"rim": {"disc": "C", "radius": 0.2}}
    machine.add(
        mbody.Body("wheel", mass=1.0, inertia=0.1, points={"C": (0, 0)}, shapes=rim),
        mbody.Contact("floor", "ground.floor", "wheel.rim", friction=0.5),
        mbody.Gravity("g", y=-G),
    )
    start = {"wheel": {"x": 0.0, "y": 0.2, "vx": 1.0}}
    machine.simulation = mbody.SimulationSettings(until=1.0, start=start, instants=3, rtol=1e-11)
    found = mbody.sweep(
        machine,
        {"floor.friction": [0.1, 0.5], "wheel.rim.radius": [0.2, 0.25]},
        "simulate",
        ["last(wheel.vx)", "last(floor.contact)"],
    )
    rolls = 0.04 / (0.04 + 0.1)
    assert found["last(wheel.vx)"][:, 0] == pytest.approx(np.full(2, rolls), rel=1e-9)
    assert found["last(floor.contact)"][:, 0] == pytest.approx(np.full(2, G), rel=1e-9)
    assert np.isnan(found["last(wheel.vx)"][:, 1]).all()
    assert sorted(found.failures) == [1, 3]
    assert all("overlap by 0.05 m" in why for why in found.failures.values())
