"""pymunk as a cross-check: it agrees where we are right, and sees where we are not."""

import math

import numpy as np
import pytest

import mbody
import mbody.engines.pymunk as bridge
from mbody import (
    AngleDriver,
    Body,
    CoordinateDriver,
    Damper,
    DistanceDriver,
    Force,
    Gravity,
    Marker,
    Mechanism,
    PinSlot,
    Prismatic,
    Revolute,
    Rolling,
    Spring,
    Torque,
    TorsionSpring,
    gallery,
    makers,
)
from mbody.core.tolerances import COMPARISON_MARGIN_PYMUNK
from mbody.engineering import close_loops
from mbody.engines.pymunk import crosscheck_result
from mbody.engines.pymunk.motion import extrapolated, kinematic, trajectory
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
    free = Mechanism(machine.name, ground=machine.ground.points)
    free.add(*(element for element in machine if element.name != "motor"))
    free.add(Gravity("gravity", y=-9.81))
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
    machine = Mechanism("driven thrice")
    machine.add(
        Body("arm", mass=2.0, inertia=0.3, cg=(0.5, 0.1), points={"A": (1.0, 0.0)}, guess=0.3),
        Body("tip", mass=1.0, inertia=0.1, cg=(0.2, 0.0), points={"B": (0.6, 0.0)}, guess=1.0),
        Body("block", mass=3.0, inertia=0.2, guess=(3.0, -1.0, 0.4)),
        Body("boom", mass=1.5, inertia=0.4, cg=(0.4, 0.2), guess=(-2.0, 0.0, 0.5)),
        Revolute("O", "ground", "arm"),
        Revolute("A", "arm.A", "tip"),
        Prismatic("guide", Marker("ground", (2.5, -1.2), 0.4), "block"),
        Revolute("P", Marker("ground", (-2.0, 0.0)), "boom"),
        AngleDriver("shoulder", "arm", Harmonic(0.3, 0.4, 3.0)),
        AngleDriver("elbow", "tip", ConstantSpeed(0.7, 2.0), relative_to="arm"),
        CoordinateDriver(
            "push", Marker("ground", (2.5, -1.2), 0.4), "block", Harmonic(0.5, 0.2, 5.0)
        ),
        DistanceDriver(
            "lift",
            Marker("ground", (-1.0, -1.0)),
            Marker("boom", (0.9, 0.1)),
            ConstantSpeed(1.6, -0.4),
        ),
        Gravity("gravity", y=-9.81),
    )
    found = checked(mbody.kinetostatics(machine, np.linspace(0.0, 0.3, 4)))
    assert {"shoulder.effort", "elbow.effort", "push.effort", "lift.effort"} <= {
        r.quantity for r in found.rows
    }


def test_driver_values_without_a_law_agree():
    machine = makers.four_bar(1, 3, 2, 3.5, masses=(1, 3, 2))
    checked(mbody.kinetostatics(machine, drive={"motor": (np.linspace(0, 6, 5), 4.0, -7.0)}))


def test_rest_agrees_and_massless_links_leave_no_trace():
    found = checked(mbody.statics(gallery.load("static_fourbar")))
    assert any(
        "'crank', 'coupler', 'rocker' have small artificial masses" in note for note in found.notes
    )
    assert row(found, "hold.effort").expected < 1e-5


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


def test_a_damped_spring_is_as_its_closed_form_says():
    m, k, c, x0 = 2.0, 50.0, 3.0, 0.3
    machine = Mechanism("oscillator")
    machine.add(
        Body("block", mass=m, inertia=1.0, guess=(1.0 + x0, 0.0, 0.0)),
        Prismatic("rail", "ground", "block"),
        Spring("spring", "ground", "block", stiffness=k, free_length=1.0),
        Damper("damper", Marker("ground", (-1.0, 0.0)), "block", coefficient=c),
    )
    run = mbody.simulate(machine, 1.0, rtol=1e-11)
    found = checked(run)
    moved = trajectory(run.system, run)
    t, decay = run.t[moved.instants], c / (2.0 * m)
    omega = math.sqrt(k / m - decay**2)
    x = 1.0 + x0 * np.exp(-decay * t) * (np.cos(omega * t) + decay / omega * np.sin(omega * t))
    expected = row(found, "block.x").expected * np.abs(x).max()
    assert np.abs(moved.values[:, 0] - x).max() < expected < 1e-4


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


def test_a_mass_that_moves_nothing_is_listed():
    """The bob of a pendulum falls as fast whatever it weighs: only its pin's force shows that."""
    machine = Mechanism("pendulum")
    machine.add(
        Body("bob", mass=1.0, cg=(1.0, 0.0), guess=0.2),
        Revolute("O", "ground", "bob"),
        Gravity("gravity", y=-9.81),
    )
    system = mbody.assemble(machine)
    wrong = mbody.simulate(system.with_values({"bob.mass": 1.01}), 0.5, rtol=1e-11)
    found = crosscheck_result(system, wrong)
    blind = {r.quantity for r in found.rows if r.verdict == "agrees"}
    assert blind == {"bob.x", "bob.y", "bob.angle"}


def test_a_load_that_is_wrong_is_seen():
    machine = gallery.load("norton_fourbar")
    system = mbody.assemble(machine)
    wrong = mbody.kinetostatics(
        system.with_values({"T_4.value": 1.001 * system.values["T_4.value"]})
    )
    assert {"motor.effort"} <= {q for q, _, _ in differing(crosscheck_result(system, wrong))}


def test_a_chaotic_motion_is_cut():
    machine = gallery.load("n_windows_2")
    run = mbody.simulate(machine, 2.0)
    found = checked(run)
    assert any("shortened where" in note for note in found.notes)


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
    machine = Mechanism("braking", units="in-lbf-s", g=G)
    machine.add(
        Body(
            "chassis",
            weight=WEIGHT,
            inertia=1.0,
            points={"F": (FRONT, RADIUS - HEIGHT), "R": (-REAR, RADIUS - HEIGHT)},
            guess=(0.0, HEIGHT, 0.0),
        ),
        Body("front_wheel", guess=(FRONT, RADIUS, 0.0)),
        Body("rear_wheel", guess=(-REAR, RADIUS, 0.0)),
        Revolute("front_hub", "chassis.F", "front_wheel"),
        Revolute("rear_hub", "chassis.R", "rear_wheel"),
        Rolling("front_tyre", "ground", "front_wheel", radius=RADIUS, offset=FRONT),
        Rolling("rear_tyre", "ground", "rear_wheel", radius=RADIUS, offset=-REAR),
        Torque("front", "front_wheel", by="chassis", value=front * RADIUS),
        Torque("rear", "rear_wheel", by="chassis", value=rear * RADIUS),
        Gravity("gravity", y=-G),
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


@first_fast("axles", LIMITS, 2)
def test_locked_wheels_slide_with_the_limiting_deceleration(axles):
    """The limit comes out of Coulomb's friction in pymunk, which none of our equations know."""
    import pymunk

    machine, start = vehicle(0.0, 0.0)
    space = Space(mbody.assemble(machine), 1e-3, 20000)
    rates = kinematic(start, "rate")[0].copy()
    locked = ("front", "rear") if axles == "all" else (axles,)
    for part in space.parts:
        if part.kind == "contact" and part.owner.split("_")[0] in locked:
            for shape in part.native:
                shape.friction = math.sqrt(MU)
            space.space.add(pymunk.SimpleMotor(space.bodies[0], space.bodies[part.j], 0.0))
            rates[part.j, 2] = 0.0
    stepper = SpaceStepper(space, lambda times: np.zeros((0, len(times))))
    stepper.put(kinematic(start, "place")[0], rates)
    h = 1e-4
    stepper.go(0.0, h, 50)
    before = stepper.state()[1][0, 0]
    stepper.go(50 * h, h, 200)
    slowing = (before - stepper.state()[1][0, 0]) / (200 * h)
    # the artificial inertia of a wheel that turns, 2.7 blob·in², is 0.13 % of the mass · r²
    assert slowing / G == pytest.approx(LIMITS[axles] / WEIGHT, rel=2e-3)


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


def test_a_disc_rolls_down_a_slope():
    """With the acceleration ⅔ g sin α along it, pressing with m g cos α."""
    g, r, m, alpha = 9.81, 0.3, 2.0, 0.5
    machine = Mechanism("slope")
    across = (r * math.sin(alpha), r * math.cos(alpha))
    machine.add(
        Body("disc", mass=m, inertia=0.5 * m * r * r, guess=(*across, 0.0)),
        Rolling("touch", Marker("ground", (0.0, 0.0), -alpha), "disc", radius=r),
        Gravity("gravity", y=-g),
    )
    run = mbody.simulate(machine, 0.5, rtol=1e-11)
    found = checked(run)
    t = run.t[trajectory(run.system, run).instants[-1]]
    way = g * math.sin(alpha) * t * t / 3.0
    moved = trajectory(run.system, run)
    start = run["disc"].x[0]
    # the disc is pressed in by 1e-7 of its radius, which counts in its inertia over r²
    assert moved.values[-1, 0] - start == pytest.approx(way * math.cos(alpha), rel=1e-7)
    friction, press = m * g * math.sin(alpha) / 3.0, m * g * math.cos(alpha)
    force = row(found, "touch.fx").theirs, row(found, "touch.fy").theirs
    expected = (
        press * math.sin(alpha) - friction * math.cos(alpha),
        press * math.cos(alpha) + friction * math.sin(alpha),
    )
    assert force == pytest.approx(expected, rel=2e-7)


def test_a_wheel_on_a_wheel_is_taken_over():
    """Every force but that of the contact is compared, and how the disc is accelerated."""
    r, m, alpha = 0.3, 2.0, 0.5
    machine = Mechanism("wheels")
    machine.add(
        Body(
            "disc",
            mass=m,
            inertia=0.5 * m * r * r,
            guess=(1.3 * math.sin(alpha), 1.3 * math.cos(alpha), 0.0),
        ),
        Rolling("touch", "ground", "disc", radius=r, on_radius=1.0, phase=math.pi / 2 - alpha),
        Gravity("gravity", y=-9.81),
    )
    found = checked(mbody.simulate(machine, 0.2, rtol=1e-11))
    assert [one.element for one in found.not_expressible] == ["touch"]
    assert {"disc.ax", "disc.ay", "disc.alpha"} == {one.quantity for one in found.rows}


# -- parts ------------------------------------------------------------------------------------


def test_the_limit_takes_three_powers_away():
    values = [np.array([1.0 + h - 2.0 * h**2 + 3.0 * h**3]) for h in (0.4, 0.2, 0.1, 0.05)]
    found, spread = extrapolated(values)
    assert found[0] == pytest.approx(1.0, abs=1e-13)
    # the error of the level before is 3/2³ of … the cube of the step, far above that of the limit
    assert 1e-4 < spread[0] < 1e-1


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


def test_slots_and_springs_with_preload_agree():
    machine = Mechanism("yoke")
    machine.add(
        Body("crank", mass=1.0, inertia=0.1, cg=(0.2, 0.1), points={"A": (0.5, 0.0)}, guess=0.4),
        Body("yoke", mass=2.0, inertia=0.5, cg=(0.3, 0.1), guess=(0.5, 0.0, 0.0)),
        Revolute("O", "ground", "crank"),
        PinSlot("slot", Marker("yoke", (0.0, 0.0), math.pi / 2), "crank.A"),
        Prismatic("guide", Marker("ground", (0.0, -0.3)), Marker("yoke", (0.0, -0.3))),
        AngleDriver("motor", "crank", ConstantSpeed(0.4, 6.0)),
        Spring("spring", Marker("ground", (-1.0, 0.2)), "yoke", stiffness=30.0, preload=4.0),
        Spring("pull", Marker("ground", (2.0, 1.0)), "yoke", stiffness=0.0, preload=3.0),
        TorsionSpring("coil", "crank", stiffness=2.0, free_angle=0.3, preload=1.5),
        Force("push", "crank.A", 5.0, angle=1.0, follows=True),
    )
    found = checked(mbody.kinetostatics(machine, np.linspace(0.0, 1.0, 6)))
    assert any("'pull'" in note for note in found.notes)
    assert COMPARISON_MARGIN_PYMUNK > 1.0
