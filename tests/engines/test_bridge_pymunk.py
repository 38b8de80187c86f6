"""pymunk as a cross-check: it agrees where we are right, and sees where we are not."""

import math

import numpy as np
import pytest

import mbody
import mbody.engines.pymunk as bridge
from mbody import gallery, makers
from mbody.engineering import close_loops
from mbody.engines.pymunk import crosscheck_result
from mbody.engines.pymunk.motion import kinematic, trajectory
from mbody.engines.pymunk.space import Space, SpaceStepper, of_system
from mbody.laws import ConstantSpeed, Harmonic
from tests.support.cases import first_fast
from tests.support.linkages import random_linkage, times_within

pytest.importorskip("pymunk")


def differing(found):
    return [(r.quantity, r.difference, r.expected) for r in found.rows if r.verdict != "agrees"]


def row(found, quantity):
    (one,) = [r for r in found.rows if r.quantity == quantity]
    return one


def checked(run):
    """The cross-check of a run, with not one row that differs."""
    found = crosscheck_result(run.system, run)
    assert found.rows and not differing(found)
    assert found.agrees
    return found


def free_slider_crank():
    machine = makers.slider_crank(1.0, 2.5, masses=(1.0, 2.0, 1.5))
    free = mbody.Mechanism(machine.name, ground=machine.ground.points)
    free.add(*(element for element in machine if element.name != "motor"))
    free.add(mbody.Gravity("gravity", y=-9.81))
    return free


# -- driven motions ---------------------------------------------------------------------------


@first_fast(
    ("name", "instants"), [("norton_fourbar", 6), ("slider_crank", 6), ("scissor_lift", 2)], 2
)
def test_forces_of_driven_mechanisms_agree(name, instants):
    run = mbody.kinetostatics(gallery.load(name), np.linspace(0.0, 0.05, instants))
    found = checked(run)
    asked = {f"{d.name}.effort" for d in run.mechanism.drivers}
    asked |= {f"{j.name}.{key}" for j in run.mechanism.joints for key in ("fx", "fy")}
    assert asked <= {r.quantity for r in found.rows}
    # a hundred times better than pymunk is known for, 0.03 % of the forces
    assert max(r.expected for r in found.rows) < 1e-5


@pytest.mark.parametrize("seed", [0, 5, 7])
def test_all_joints_and_loads_of_random_linkages_agree(seed):
    machine, turn = random_linkage(
        seed, loops=1 + seed % 3, sliders=bool(seed % 2), extras=seed > 5
    )
    checked(mbody.kinetostatics(machine, times_within(machine, turn, 2)))


def test_drivers_of_every_kind_agree():
    machine = mbody.Mechanism("driven thrice")
    machine.add(
        mbody.Body(
            "arm", mass=2.0, inertia=0.3, cg=(0.5, 0.1), points={"A": (1.0, 0.0)}, guess=0.3
        ),
        mbody.Body(
            "tip", mass=1.0, inertia=0.1, cg=(0.2, 0.0), points={"B": (0.6, 0.0)}, guess=1.0
        ),
        mbody.Body("block", mass=3.0, inertia=0.2, guess=(3.0, -1.0, 0.4)),
        mbody.Body("boom", mass=1.5, inertia=0.4, cg=(0.4, 0.2), guess=(-2.0, 0.0, 0.5)),
        mbody.Revolute("O", "ground", "arm"),
        mbody.Revolute("A", "arm.A", "tip"),
        mbody.Prismatic("guide", mbody.Marker("ground", (2.5, -1.2), 0.4), "block"),
        mbody.Revolute("P", mbody.Marker("ground", (-2.0, 0.0)), "boom"),
        mbody.AngleDriver("shoulder", "arm", Harmonic(0.3, 0.4, 3.0)),
        mbody.AngleDriver("elbow", "tip", ConstantSpeed(0.7, 2.0), relative_to="arm"),
        mbody.CoordinateDriver(
            "push", mbody.Marker("ground", (2.5, -1.2), 0.4), "block", Harmonic(0.5, 0.2, 5.0)
        ),
        mbody.DistanceDriver(
            "lift",
            mbody.Marker("ground", (-1.0, -1.0)),
            mbody.Marker("boom", (0.9, 0.1)),
            ConstantSpeed(1.6, -0.4),
        ),
        mbody.Gravity("gravity", y=-9.81),
    )
    found = checked(mbody.kinetostatics(machine, np.linspace(0.0, 0.3, 4)))
    assert {"shoulder.effort", "elbow.effort", "push.effort", "lift.effort"} <= {
        r.quantity for r in found.rows
    }


def test_what_pymunk_has_not_is_named_and_taken_over():
    run = mbody.kinetostatics(gallery.load("planetary_train"), turn="motor", instants=5)
    found = checked(run)
    assert {one.element for one in found.not_expressible} == {"inner", "outer"}
    assert any("'inner', 'outer'" in note for note in found.notes)
    # what moves freely then must be accelerated as we say
    assert "planet.ax" in {r.quantity for r in found.rows}


def test_near_singular_positions_are_told_and_not_compared():
    found = crosscheck_result(*_governor())
    assert found.agrees and any("near singular" in note for note in found.notes)


def _governor():
    run = mbody.kinetostatics(gallery.load("porter_governor"), turn=True, instants=25)
    return run.system, run


# -- free motions -----------------------------------------------------------------------------


@first_fast("what", ["four-bar", "slider-crank"], 1)
def test_free_motion_is_of_first_order_and_its_limit_is_ours(what):
    machine = gallery.load("free_fourbar") if what == "four-bar" else free_slider_crank()
    run = mbody.simulate(machine, 1.0, rtol=1e-11)
    found = checked(run)
    moved = trajectory(run.system, run)
    assert moved.horizon == pytest.approx(1.0) and not moved.shortened
    assert abs(moved.order - 1.0) < 0.15
    # after 1 s, by Richardson's limit
    n = run.system.coordinates
    theirs = moved.values[-1, :n].reshape(-1, 3)
    assert np.abs(theirs - kinematic(run, "place")[-1])[:, 2].max() < 1e-4
    angles = [r for r in found.rows if r.quantity.endswith(".angle")]
    assert len(angles) == 3 and max(r.expected for r in angles) < 1e-4
    assert {"A.fx", "A.fy", "kinetic energy"} <= {r.quantity for r in found.rows}


@first_fast("what", ["four-bar", "slider-crank"], 1)
def test_a_mass_that_is_wrong_by_a_hundredth_is_seen(what):
    """Of every body whose mass moves the trajectory by more than three times what is expected;
    there is none that it cannot see but those whose mass moves nothing."""
    machine = gallery.load("free_fourbar") if what == "four-bar" else free_slider_crank()
    system = mbody.assemble(machine)
    true = mbody.simulate(system, 0.6, rtol=1e-11)
    band = max(
        r.expected for r in crosscheck_result(system, true).rows if r.quantity.endswith(".angle")
    )
    blind = []
    for body in machine.bodies:
        key = "weight" if body.mass is None else "mass"
        name = f"{body.name}.{key}"
        wrong = mbody.simulate(
            system.with_values({name: 1.01 * system.values[name]}), 0.6, rtol=1e-11
        )
        angles = kinematic(true, "place")[:, :, 2]
        moves = np.abs(kinematic(wrong, "place")[:, :, 2] - angles).max() / np.abs(angles).max()
        if moves <= 3.0 * band:
            blind.append(body.name)
            continue
        found = crosscheck_result(system, wrong)
        assert not found.agrees
        seen = {r.quantity for r in found.rows if r.verdict == "differs"}
        assert seen & {f"{b.name}.angle" for b in machine.bodies}
    assert blind == []


def test_stops_of_formulas_are_not_followed():
    run = mbody.simulate(gallery.load("bouncing_ball"))
    found = crosscheck_result(run.system, run)
    assert not found.rows and [one.element for one in found.not_expressible] == ["floor"]


# -- the vehicle ------------------------------------------------------------------------------

G, WEIGHT, FRONT, REAR, HEIGHT, RADIUS, MU = 386.4, 4000.0, 40.0, 50.0, 25.0, 14.5, 0.8
BASE = FRONT + REAR
#: Limiting braking forces: on the axles that brake F = μ N, and N = W (b or c)/l ± F h/l.
LIMITS = {
    "front": MU * WEIGHT * REAR / (BASE - MU * HEIGHT),
    "rear": MU * WEIGHT * FRONT / (BASE + MU * HEIGHT),
    "all": MU * WEIGHT,
}


def vehicle(front, rear, speed=600.0):
    """A vehicle whose axles brake with these forces at the road; wheels without mass."""
    machine = mbody.Mechanism("braking", units="in-lbf-s", g=G)
    machine.add(
        mbody.Body(
            "chassis",
            weight=WEIGHT,
            inertia=1.0,
            points={"F": (FRONT, RADIUS - HEIGHT), "R": (-REAR, RADIUS - HEIGHT)},
            guess=(0.0, HEIGHT, 0.0),
        ),
        mbody.Body("front_wheel", guess=(FRONT, RADIUS, 0.0)),
        mbody.Body("rear_wheel", guess=(-REAR, RADIUS, 0.0)),
        mbody.Revolute("front_hub", "chassis.F", "front_wheel"),
        mbody.Revolute("rear_hub", "chassis.R", "rear_wheel"),
        mbody.Rolling("front_tyre", "ground", "front_wheel", radius=RADIUS, offset=FRONT),
        mbody.Rolling("rear_tyre", "ground", "rear_wheel", radius=RADIUS, offset=-REAR),
        mbody.Torque("front", "front_wheel", by="chassis", value=front * RADIUS),
        mbody.Torque("rear", "rear_wheel", by="chassis", value=rear * RADIUS),
        mbody.Gravity("gravity", y=-G),
    )
    rates = {"front_wheel": -speed / RADIUS, "rear_wheel": -speed / RADIUS}
    return machine, close_loops(machine, rates=rates)


@pytest.mark.slow
@pytest.mark.parametrize("axles", LIMITS)
def test_a_braking_vehicle_agrees_with_the_closed_form_and_with_ours(axles, monkeypatch):
    force, seen = LIMITS[axles], []
    monkeypatch.setattr(
        bridge, "trajectory", lambda *asked: seen.append(trajectory(*asked)) or seen[0]
    )
    front = force * {"front": 1.0, "rear": 0.0, "all": (REAR + MU * HEIGHT) / BASE}[axles]
    machine, start = vehicle(front, force - front)
    run = mbody.simulate(machine, 0.1, start=start, instants=5)
    found = checked(run)
    theirs = {r.quantity: (r.theirs, r.expected) for r in found.rows}
    # load transfer: moments about the other axle's point of contact
    loads = {
        "front_tyre.fy": (WEIGHT * REAR + force * HEIGHT) / BASE,
        "rear_tyre.fy": (WEIGHT * FRONT - force * HEIGHT) / BASE,
        "front_tyre.fx": -front,
        "rear_tyre.fx": front - force,
    }
    for name, value in loads.items():
        assert abs(theirs[name][0] - value) <= theirs[name][1] * WEIGHT
    (moved,) = seen
    t = run.t[moved.instants]
    way = float(start["chassis"].vx[0]) * t - 0.5 * force / WEIGHT * G * t**2
    assert np.abs(moved.values[:, 0] - way).max() <= theirs["chassis.x"][1] * HEIGHT + 1e-12


@pytest.mark.parametrize("axle", ["front", "rear"])
def test_the_vehicle_of_the_gallery_brakes_as_the_book_says(axle):
    """With the limiting torque and deceleration nothing else is needed to drive the motion."""
    force = LIMITS[axle]
    system = mbody.assemble(gallery.load("vehicle")).with_values({axle: -force * RADIUS})
    run = mbody.kinetostatics(system, drive={"motion": (0.0, 500.0, -force / WEIGHT * G)})
    found = checked(run)
    told = {r.quantity: r.theirs for r in found.rows}
    band = found.rows[0].expected * WEIGHT
    assert abs(told["motion.effort"]) <= band
    assert abs(told[f"{axle}_tyre.fx"] + force) <= band
    # the tyre that is about to slide presses with F/μ
    assert abs(told[f"{axle}_tyre.fy"] - force / MU) <= band


# -- parts ------------------------------------------------------------------------------------


@pytest.mark.parametrize("seed", [0, 3, 7])
def test_impulses_from_momenta_have_the_sizes_that_pymunk_tells(seed):
    machine, _ = random_linkage(seed, loops=2, sliders=bool(seed % 2), extras=True)
    run = mbody.kinetostatics(machine)
    space = Space(run.system, 1.0, 20000)
    stepper = SpaceStepper(space, lambda times: of_system(run.system, times, 1.0))
    stepper.put(kinematic(run, "place")[0], kinematic(run, "rate")[0])
    h = 1e-3
    told = stepper.go(0.0, h, 5)[3 * run.system.coordinates :].reshape(-1, 4)
    sizes = [
        abs(one[3]) if part.kind in ("slot", "rod", "turn") else math.hypot(one[0], one[1])
        for part, one in zip(space.parts, told, strict=True)
    ]
    theirs = [part.native.impulse / h for part in space.parts]
    np.testing.assert_allclose(sizes, theirs, rtol=0.0, atol=1e-9 * max(theirs))
