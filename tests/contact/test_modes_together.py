"""Contacts and frictional joints that are decided together, and forces that no equation decides."""

import math

import numpy as np
import pytest

import mbody
from mbody import Body, Contact, Force, Gravity, Mechanism, Revolute
from tests.coulomb_enumeration import compare, follow
from tests.dynamics.test_braking_vehicle import MODEL, braked
from tests.support.cases import first_fast
from tests.support.coulomb_linkages import linkage
from tests.support.frictional import with_friction

G = 9.81


@first_fast("seed", [*range(300, 324), 327, 596], 2)
def test_modes_are_those_of_enumeration(seed):
    """Random linkages at random states: every jam, every other solution, all accelerations."""
    rng = np.random.default_rng(seed)
    found = compare(linkage(rng), rng)
    assert found.agrees, found


@pytest.mark.parametrize("seed", [205, 209, 215, 224, 235, 237, 240, 244])
def test_motions_are_those_of_enumeration(seed):
    """The same at instants of motions that stick, slip and open."""
    rng = np.random.default_rng(seed)
    found = follow(linkage(rng), rng, 0.4)
    assert found.status == "completed" and found.events and found.holding > 0
    assert found.difference < 1e-9, found


def brake(drum_torque, push=100.0, friction=0.2, mu=0.5):
    """A shoe on the lever of a drum at rest; the lever's pin is rough."""
    machine = Mechanism("shoe brake", ground={"O": (0.0, 0.0), "A": (-0.3, 0.14)})
    rim = {"rim": {"disc": "O", "radius": 0.1}}
    points = {"A": (0.0, 0.0), "S": (0.3, -0.04), "B": (0.6, 0.0)}
    machine.add(
        Body("drum", mass=5.0, inertia=0.05, points={"O": (0, 0)}, shapes=rim, guess="0 deg"),
        Body("lever", mass=0.1, inertia=1e-3, points=points, guess=(0.0, 0.14, 0.0)),
        Revolute("O", "ground.O", "drum.O"),
        Revolute("A", "ground.A", "lever.A", friction=friction, pin_radius=0.02),
        Force("push", "lever.B", push, angle=-math.pi / 2.0),
        mbody.Torque("load", "drum", value=drum_torque),
        Contact("shoe", "drum.rim", "lever.S", friction=mu),
    )
    return machine


def test_a_rough_pin_beside_a_shoe_at_rest():
    """The pin could carry a part of the moment; the brake holds, and nothing moves."""
    run = mbody.simulate(brake(5.0), 0.1, instants=5)
    assert run.status == "completed"
    assert not run.events and all("not unique" in note for note in run.notes)
    assert set(run.mode("shoe")) == {"roll"}
    assert set(run.mode("A")) == {"stick"}
    assert float(np.abs(run["drum"].alpha).max()) < 1e-9


def test_a_rough_pin_beside_a_shoe_that_slides():
    """The drum turns: any force of the shoe between two limits is consistent, by the moment of the
    pin, and that without it is taken. It is said.
    """
    run = mbody.simulate(brake(0.0, mu=0.3), 0.05, rates={"drum": 30.0, "lever": 0.0}, instants=6)
    assert run.events[0].name == "indeterminate"
    assert "nothing decides how loads are shared" in run.notes[0]
    pressed = 100.0 * 0.6 / (0.3 - 0.3 * 0.04)
    assert run.contact("shoe")[0] == pytest.approx(pressed, rel=1e-9)


def test_what_several_accelerations_follow_is_the_state_after_impacts():
    """Two discs meet as the drum begins to turn: the event has the velocities that go on."""
    machine, rim = brake(0.0, mu=0.3), {"rim": {"disc": "C", "radius": 0.1}}
    machine.add(
        *(Body(k, mass=1.0, inertia=1.0, points={"C": (0, 0)}, shapes=rim) for k in ("i", "j")),
        Contact("hit", "i.rim", "j.rim"),
    )
    start = {"drum": {"omega": 30.0}, "lever": {"omega": 0.0}}
    start |= {"i": {"x": 5.0, "y": 0.0, "vx": 1.0}, "j": {"x": 5.2, "y": 0.0, "vx": 0.0}}
    machine.simulation = mbody.SimulationSettings(until=0.01, start=start)
    hit, several = mbody.simulate(machine, 0.01).events
    assert (hit.name, several.name) == ("impact", "indeterminate")
    assert hit.after["i"].vx[0] == pytest.approx(0.5, abs=1e-15)
    assert several.state["i"].vx[0] == several.after["i"].vx[0] == hit.after["i"].vx[0]


def free_slider_crank(mu, start=0.1):
    """Four frictional joints, one free motion."""
    led = with_friction(
        mbody.makers.slider_crank(0.05, 0.2, masses=(1.0, 2.0, 3.0), start=start), mu, 0.02
    )
    machine = Mechanism("slider-crank", units=led.units, ground=led.ground.points)
    machine.add(*(one for one in led if not isinstance(one, mbody.AngleDriver)))
    machine.add(Gravity("gravity", y=-G))
    return machine


@pytest.mark.slow
def test_a_linkage_of_rough_pins_comes_to_rest():
    """At rest three rows of four are redundant: it stays as long as some forces keep it."""
    run = mbody.simulate(free_slider_crank(0.4), 1.0, rtol=1e-9)
    assert run.status == "completed"
    assert {run.mode(name)[-1] for name in ("O", "A", "B", "guide")} == {"stick"}
    assert float(np.abs(run["slider"].vx[-1])) < 1e-12
    assert run.energy.error < 1e-8
    lost = sum(part[-1] for part in run.energy.lost.values())
    assert float(lost) == pytest.approx(float(run.energy.dissipated[-1]), rel=1e-9)


@pytest.mark.slow
def test_it_begins_to_move_where_no_forces_keep_it():
    """A force that rises: where the band of statics ends."""
    machine = free_slider_crank(0.8, start=1.0)
    text = mbody.to_toml(machine)
    machine = mbody.from_toml(text)
    machine.add(Force("push", "slider.B", "-50 N/s*t"))
    run = mbody.simulate(machine, 1.2, rtol=1e-9)
    start = next(float(one.t) for one in run.events if one.name == "slip")

    held = mbody.from_toml(text)
    held.add(Force("push", "slider.B", -50.0 * start))
    held.add(mbody.AngleDriver("hold", "crank", float(run["crank"].angle[0])))
    band = mbody.statics(held).range("hold")
    ends = np.array([band.low[0], band.high[0]])
    assert np.abs(ends).min() < 1e-7 * np.abs(ends).max()


def test_a_vehicle_that_stops_is_no_paradox():
    """Wheels and brakes stick: the forces are not unique, the accelerations are."""
    run = braked(4.0, 45000.0, 45000.0)
    assert run.status == "completed"
    assert not {one.name for one in run.events} & {"indeterminate", "inconsistent"}
    assert not any("several" in note for note in run.notes)
    assert abs(float(run["chassis"].vx[-1])) < 1e-9


@pytest.mark.parametrize(("slope", "holds"), [(0.6, True), (0.67, True), (0.68, False)])
def test_a_parked_vehicle_needs_both_axles(slope, holds):
    """Its front axle alone would not hold it; beyond tan⁻¹ 0.8 = 0.675 rad it slides."""
    text = MODEL.replace('y = "-g"', f'y = "-g*cos({slope} rad)"\nx = "-g*sin({slope} rad)"')
    machine = mbody.from_toml(text.replace("88 ft/s*t", "0 ft"))
    brakes = {"front": 60000.0, "rear": 60000.0}
    rest = dict.fromkeys(("front_wheel", "rear_wheel", "chassis"), 0.0)
    run = mbody.simulate(machine, 0.2, inputs=brakes, release={"motion": 0.0}, rates=rest)
    assert run.status == "completed"
    assert not run.events
    slides = 386.4 * (math.sin(slope) - 0.8 * math.cos(slope))
    np.testing.assert_allclose(run["chassis"].ax, -max(slides, 0.0), atol=1e-8)
    assert (run.mode("front_tyre")[-1] == run.mode("rear_tyre")[-1] == "roll") == holds


def lifted(boxes, width):
    """Boxes of 1 kg and their weight of 10 N, lifted by 20 N from where a body that passes is at
    1.2345 m, within some widths [m]; each stands on two feet, on which it never tips.
    """
    machine = Mechanism(
        "lift", ground={"O": (0, 0)}, ground_shapes={"floor": {"line": {"point": "O"}}}
    )
    machine.add(Body("s", mass=1.0, inertia=1.0), Gravity("g", y=-10.0))
    start = {"s": {"x": 0.0, "y": 50.0, "angle": 0.0, "vx": 1.7, "vy": 0.0, "omega": 0.0}}
    for k in range(boxes):
        feet = {"A": (-0.5, -0.25), "B": (0.5, -0.25)}
        machine.add(Body(f"b{k}", mass=1.0, inertia=0.1, points=feet, guess=(3.0 * k, 0.25, 0)))
        machine.add(
            *(Contact(f"b{k}{f}", "ground.floor", f"b{k}.{f}", friction=0.5) for f in feet),
            Force(
                f"f{k}", f"b{k}", f"20 N/(1 + exp((1.2345 m - s.x)/({width} m)))", angle="90 deg"
            ),
        )
    machine.simulation = mbody.SimulationSettings(2.0, start=start, rtol=1e-9)
    return machine


@pytest.mark.parametrize(
    ("boxes", "width"), [(1, 10.0), (1, 0.3), (2, 10.0), (2, 1e-3), (2, 1e-5), (2, 1e-18)]
)
def test_feet_that_lift_at_one_instant(boxes, width):
    """Guards of all feet, of pressing and of friction, are zero together, and jump together."""
    run = mbody.simulate(lifted(boxes, width), 2.0, instants=3)
    time, lifts = width / 1.7, 1.2345 / 1.7
    assert run.status == "completed"
    assert {one.contact for one in run.events if one.name == "open"} == {
        f"b{k}{f}" for k in range(boxes) for f in "AB"
    }
    assert max(abs(one.t - lifts) for one in run.events) < 1e-9
    # v̇ = 10 tanh(u/2), u = (t − t₀)/τ, is 20 τ log cosh(u/2) after t₀
    u = (2.0 - lifts) / time
    log = 0.5 * u + math.log1p(math.exp(-u)) - math.log(2.0)
    for k in range(boxes):
        assert run[f"b{k}"].vy[-1] == pytest.approx(20.0 * time * log, rel=1e-7)
        assert abs(run[f"b{k}"].omega[-1]) < 1e-9
