"""Pins in slots, gears, racks and rolling wheels against textbook answers."""

import math

import numpy as np
import pytest

import mbody
from mbody.engines.oracle import Reference
from mbody.errors import ModelWarning
from mbody.laws import ConstantSpeed
from tests.support.agreement import assert_agrees

# closed loops leave 1e-13 of their size, forces the same times a condition below 10
CLOSE = 1e-12


def train(sun=2.0, planet=1.0, speed=7.0, load=5.0):
    """Sun, planet on a carrier, fixed ring; the sun drives, a torque holds the carrier back."""
    arm = sun + planet
    machine = mbody.Mechanism("epicyclic train")
    machine.add(
        mbody.Body("sun", mass=3.0, inertia=0.4),
        mbody.Body("carrier", mass=1.0, inertia=0.2, cg=(0.5 * arm, 0.0), points={"P": (arm, 0.0)}),
        mbody.Body("planet", mass=0.7, inertia=0.1),
        mbody.Revolute("S", "ground", "sun"),
        mbody.Revolute("C", "ground", "carrier"),
        mbody.Revolute("P", "carrier.P", "planet"),
        mbody.Gear("inner", "sun", "planet", radius_i=sun, radius_j=planet),
        mbody.Gear(
            "outer", "ground", "planet", radius_i=arm + planet, radius_j=planet, internal=True
        ),
        mbody.AngleDriver("motor", "sun", ConstantSpeed(0.3, speed)),
        mbody.Torque("load", "carrier", value=-load),
    )
    return machine


def test_a_planetary_train_turns_by_williss_formula():
    sun, planet, speed, load = 2.0, 1.0, 7.0, 5.0
    ring = sun + 2.0 * planet
    run = mbody.kinetostatics(train(sun, planet, speed, load), t=np.linspace(0.0, 4.0, 201))
    # Willis: (ω_s − ω_c)/(0 − ω_c) = −r_r/r_s
    carrier = speed * sun / (sun + ring)
    assert run["carrier"].omega == pytest.approx(carrier, rel=CLOSE)
    assert run["planet"].omega == pytest.approx(carrier * (1.0 - ring / planet), rel=CLOSE)
    # at constant speeds the powers balance: T_s ω_s = load ω_c
    assert run.effort("motor") == pytest.approx(load * carrier / speed, rel=1e-11)
    # the planet turns uniformly: equal tooth forces on both sides, F = T_s/r_s
    for mesh in ("inner", "outer"):
        tooth = run.reaction(mesh)
        assert tooth.magnitude == pytest.approx(load * carrier / speed / sun, rel=1e-11)
        assert np.abs(tooth.torque).max() < 1e-11  # at the pitch point, where it has none
    # the tooth forces do not pull along the line of centres
    pin = run.point("carrier.P")
    along = run.reaction("inner").fx * pin.x + run.reaction("inner").fy * pin.y
    assert np.abs(along).max() < 1e-11 * load


def test_a_pair_on_fixed_centres_accelerates_its_inertias():
    machine = mbody.Mechanism("pair", ground={"A": (0.0, 0.0), "B": (3.0, 0.0)})
    machine.add(
        mbody.Body("a", mass=1.0, inertia=2.0),
        mbody.Body("b", mass=1.0, inertia=0.5),
        mbody.Revolute("A", "ground.A", "a"),
        mbody.Revolute("B", "ground.B", "b"),
        mbody.Gear("mesh", "a", "b", radius_i=2.0, radius_j=1.0),
        mbody.AngleDriver("motor", "a", mbody.laws.ConstantAcceleration(0.0, 3.0, 4.0)),
    )
    run = mbody.kinetostatics(machine, t=[0.0, 0.5, 1.0])
    assert run["b"].omega == pytest.approx(-2.0 * run["a"].omega, rel=CLOSE)
    # T = (I_a + I_b (r_a/r_b)²) α, tooth force I_b α_b / r_b
    assert run.effort("motor") == pytest.approx((2.0 + 0.5 * 4.0) * 4.0, rel=1e-11)
    assert run.reaction("mesh").magnitude == pytest.approx(0.5 * 8.0 / 1.0, rel=1e-11)


def test_a_rack_is_pushed_by_the_torque_over_the_radius():
    machine = mbody.Mechanism("rack", ground={"O": (0.0, 0.5)})
    machine.add(
        mbody.Body("rack", mass=4.0),
        mbody.Body("pinion", mass=1.0, inertia=0.3),
        mbody.Revolute("O", "ground.O", "pinion"),
        mbody.Prismatic("guide", "ground", "rack"),
        mbody.RackPinion("mesh", "rack", "pinion", radius=0.5),
        mbody.AngleDriver("motor", "pinion", mbody.laws.ConstantAcceleration(0.0, 2.0, 3.0)),
        mbody.Force("cut", "rack", 10.0, angle=math.pi),
    )
    run = mbody.kinetostatics(machine, t=[0.0, 0.7])
    # the pinion is above the rack and pushes it the way that its lowest point goes, +r ω
    assert run["rack"].vx == pytest.approx(0.5 * run["pinion"].omega, rel=CLOSE)
    push = 10.0 + 4.0 * 0.5 * 3.0
    assert run.effort("motor") == pytest.approx(0.5 * push + 0.3 * 3.0, rel=1e-11)
    tooth = run.reaction("mesh")  # on the pinion, by the rack
    assert tooth.fx == pytest.approx(-push, rel=1e-11) and np.abs(tooth.torque).max() < 1e-11


def test_a_wheel_rolls_down_a_slope_only_if_it_is_held():
    m, inertia, r, slope, g = 2.0, 0.3, 0.5, math.radians(20.0), 9.81
    machine = mbody.Mechanism("slope")
    machine.add(
        mbody.Body("wheel", mass=m, inertia=inertia),
        mbody.Rolling("road", mbody.Marker("ground", (0.0, 0.0), slope), "wheel", radius=r),
        mbody.CoordinateDriver(
            "pull", mbody.Marker("ground", (0.0, 0.0), slope), "wheel", ConstantSpeed(0.0, 1.5)
        ),
        mbody.Gravity("gravity", y=-g),
    )
    run = mbody.kinetostatics(machine, t=[0.0, 1.0])
    assert run["wheel"].omega == pytest.approx(-1.5 / r, rel=CLOSE)
    assert run.effort("pull") == pytest.approx(m * g * math.sin(slope), rel=1e-11)
    contact = run.reaction("road")
    normal = -contact.fx * math.sin(slope) + contact.fy * math.cos(slope)
    tangential = contact.fx * math.cos(slope) + contact.fy * math.sin(slope)
    assert normal == pytest.approx(m * g * math.cos(slope), rel=1e-11)
    assert run.contact("road") == pytest.approx(normal, rel=1e-11)
    assert np.abs(tangential).max() < 1e-11 * m * g  # at constant speed nothing holds the rim
    assert np.abs(contact.torque).max() < 1e-11
    # accelerated, the rim is retained by T = I α/r
    faster = mbody.kinetostatics(machine, drive={"pull": (0.0, 0.0, 2.0)}).reaction("road")
    tangential = faster.fx * math.cos(slope) + faster.fy * math.sin(slope)
    assert tangential == pytest.approx(-inertia * 2.0 / r**2, rel=1e-11)


def test_a_wheel_in_a_ring_is_cardans_straight_line():
    """A wheel of half the radius: every point of its rim goes along a straight line."""
    machine = mbody.Mechanism("Cardan circles")
    machine.add(
        mbody.Body("arm", points={"C": (1.0, 0.0)}),
        mbody.Body("wheel", points={"P": (1.0, 0.0)}),
        mbody.Revolute("O", "ground", "arm"),
        mbody.Revolute("C", "arm.C", "wheel"),
        mbody.Rolling("ring", "ground", "wheel", radius=1.0, on_radius=2.0, internal=True),
        mbody.AngleDriver("motor", "arm", ConstantSpeed(0.0, 1.0)),
    )
    run = mbody.kinematics(machine, t=np.linspace(0.0, 6.0, 61))
    assert run["wheel"].omega == pytest.approx(-1.0, rel=CLOSE)
    p = run.point("wheel.P")
    lie = np.linalg.svd(np.column_stack([p.x, p.y]), compute_uv=False)
    assert lie[1] < 1e-12 * lie[0]


@pytest.mark.parametrize(
    ("radius", "on_radius", "internal", "above"),
    [
        (1.0, 3.0, True, -2.0),  # in a ring, at its bottom
        (3.0, 1.0, True, -2.0),  # a ring that hangs on a wheel
        (1.0, 3.0, False, 4.0),  # a wheel on top of another
    ],
)
def test_a_contact_of_wheels_presses_with_the_weight(radius, on_radius, internal, above):
    """At rest where it touches below (or hangs from above) a wheel is carried by its contact."""
    machine = mbody.Mechanism("wheels")
    machine.add(
        mbody.Body("wheel", mass=2.0, inertia=0.3, guess=(0.0, above, 0.0)),
        mbody.Rolling(
            *("rim", "ground", "wheel", radius, on_radius, internal),
            phase=math.copysign(math.pi / 2.0, above),
        ),
        mbody.CoordinateDriver("hold", "ground", "wheel", 0.0),
        mbody.Gravity("gravity", y=-9.81),
    )
    run = mbody.statics(machine)
    assert run["wheel"].y[0] == pytest.approx(above)
    assert run.contact("rim")[0] == pytest.approx(2.0 * 9.81, rel=1e-9)


def test_a_pin_in_a_slot_is_the_scotch_yoke():
    machine = mbody.Mechanism("Scotch yoke")
    machine.add(
        mbody.Body("crank", points={"A": (0.2, 0.0)}),
        mbody.Body("yoke", mass=3.0),
        mbody.Revolute("O", "ground", "crank"),
        mbody.Prismatic("guide", "ground", "yoke"),
        mbody.PinSlot("slot", mbody.Marker("yoke", (0.0, 0.0), math.pi / 2.0), "crank.A"),
        mbody.AngleDriver("motor", "crank", ConstantSpeed(0.4, 10.0)),
    )
    t = np.linspace(0.0, 0.6, 31)
    run = mbody.kinetostatics(machine, t=t)
    angle = 0.4 + 10.0 * t
    assert run["yoke"].x == pytest.approx(0.2 * np.cos(angle), abs=CLOSE)
    push = -3.0 * 0.2 * 100.0 * np.cos(angle)  # m a of the yoke
    assert run.reaction("slot", on="yoke").fx == pytest.approx(push, abs=1e-10)
    assert run.effort("motor") == pytest.approx(-0.2 * np.sin(angle) * push, abs=1e-10)


@pytest.mark.parametrize("analysis", [mbody.kinetostatics, mbody.statics])
def test_batches_of_radii(analysis):
    system = mbody.assemble(train())
    designs = system.with_values(
        {
            "inner.radius_i": [2.0, 1.0],
            "inner.radius_j": [1.0, 2.0],
            "outer.radius_i": [4.0, 5.0],
            "outer.radius_j": [1.0, 2.0],
        }
    )
    batch = analysis(designs, t=[0.0, 0.1])
    for n, (sun, planet) in enumerate([(2.0, 1.0), (1.0, 2.0)]):
        alone = analysis(train(sun, planet), t=[0.0, 0.1])
        for name in ("inner", "outer"):
            mine, other = batch.reaction(name), alone.reaction(name)
            assert mine.fx[n] == pytest.approx(other.fx, abs=1e-10)
            assert mine.torque[n] == pytest.approx(other.torque, abs=1e-10)


def everything_in_one_loop():
    """Gears turn a pin, the pin a slotted lever; the lever pulls a wheel by a rod along a road and
    turns a planet that rolls in a fixed ring; a rack runs beside.
    """
    # the pitch line of the rack is 0.5 from its guide, which goes through the centre of b
    guide = mbody.Marker("ground", "B", 0.1)
    machine = mbody.Mechanism(
        "mixed", ground={"A": (0.0, 0.0), "B": (3.0, 0.0), "C": (3.0, -4.0), "road": (0.0, 2.0)}
    )
    machine.add(
        mbody.Body("a", mass=2.0, inertia=1.5, cg=(0.1, 0.2)),
        mbody.Body("b", mass=1.0, inertia=0.4, points={"P": (0.6, 0.1)}, guess=-1.0),
        mbody.Body(
            "lever", mass=1.5, inertia=0.8, cg=(3.0, 0.1), points={"T": (7.0, 0.0)}, guess=1.38
        ),
        mbody.Body(
            "rod", mass=0.8, inertia=0.5, cg=(2.0, 0.0), points={"R": (4.0, 0.0)}, guess=3.17
        ),
        mbody.Body("wheel", mass=1.2, inertia=0.3, cg=(0.05, 0), points={"R": (0, 0)}, guess=-0.06),
        mbody.Body("rack", mass=0.9),
        mbody.Body("planet", mass=0.5, inertia=0.05, cg=(0.0, 0.1), guess=(4.1, -3.6, -1.2)),
        mbody.Revolute("A", "ground.A", "a"),
        mbody.Revolute("B", "ground.B", "b"),
        mbody.Gear("mesh", "a", "b", radius_i=2.0, radius_j=1.0, phase=0.2),
        mbody.Revolute("C", "ground.C", "lever"),
        mbody.PinSlot("slot", mbody.Marker("lever", (0.0, 0.1), 0.05), "b.P"),
        mbody.Revolute("T", "lever.T", "rod"),
        mbody.Revolute("R", "rod.R", "wheel.R"),
        mbody.Rolling(
            "road", mbody.Marker("ground", "road", 0.1), "wheel.R", radius=0.7, offset=0.3
        ),
        mbody.RackPinion("teeth", mbody.Marker("rack", (0.0, 0.5), math.pi), "b", radius=0.5),
        mbody.Prismatic("guide", guide, "rack"),
        mbody.Rolling("rim", "ground.C", "planet", radius=0.4, on_radius=1.5, internal=True),
        mbody.Gear("second", "lever", "planet", radius_i=0.7, radius_j=0.4),
        mbody.AngleDriver("motor", "a", mbody.laws.ConstantAcceleration(0.2, 1.5, 0.4)),
        mbody.Gravity("gravity", y=-9.81),
        mbody.Torque("load", "planet", value=2.0),
        mbody.Force("cut", "rack", 3.0, angle=0.4),
    )
    return machine


def test_the_oracle_agrees_on_all_of_them_in_one_loop():
    machine = everything_in_one_loop()
    oracle = Reference(machine)
    t = np.linspace(0.0, 2.0, 21)
    run = mbody.kinetostatics(machine, t=t)
    for k in (0, 7, 20):
        forces = assert_agrees(oracle, run, k)
        assert run.effort("motor")[k] == pytest.approx(forces["efforts"]["motor"], rel=1e-9)
    assert run.checks.virtual_work < 1e-11


def test_a_guess_elsewhere_on_the_rim_is_told_by_how_far():
    """The phase puts the wheel at 0 deg of the ring, a guess at its bottom: √2 · 0.8 m away."""
    machine = mbody.Mechanism("ring")
    machine.add(
        mbody.Body("w", mass=1.0, guess=(0.0, -0.8, 0.0)),
        mbody.Rolling("rim", "ground", "w", radius=0.2, on_radius=1.0, internal=True),
        mbody.AngleDriver("motor", "w", 0.0),
    )
    with pytest.warns(ModelWarning, match=r"'w' came out 1\.131 m from where the guess"):
        assert mbody.kinematics(machine)["w"].x == pytest.approx(0.8)


@pytest.mark.parametrize("seed", range(40))
def test_guesses_across_half_a_turn_from_the_phase(seed):
    """A wheel on the left of the other one, in the phase 0: the guesses of its place and those of
    the closed position lie on both sides of where the line of centres jumps by a turn.
    """
    rng = np.random.default_rng(seed)
    ri, rj = rng.uniform(0.2, 1.0, 2)
    below, guessed = rng.uniform(-0.05, 0.05, 2)
    start, apart = rng.uniform(-3.0, 3.0), ri + rj
    direction = math.atan2(-math.sin(below), -math.cos(below))
    angle = (direction * apart - ri * start) / rj + rng.uniform(-0.05, 0.05)
    machine = mbody.Mechanism(
        "pair",
        ground={"A": (0, 0), "B": (apart * math.cos(direction), apart * math.sin(direction))},
    )
    machine.add(
        mbody.Body("one", mass=1.0, guess=start),
        mbody.Body("two", mass=1.0, inertia=1.0, guess=(-apart, guessed, angle)),
        mbody.Revolute("A", "ground.A", "one"),
        mbody.Revolute("B", "ground.B", "two"),
        mbody.Gear("mesh", "one", "two", radius_i=ri, radius_j=rj),
        mbody.AngleDriver("motor", "one", start),
    )
    two = mbody.kinematics(machine, t=0.0)["two"].angle[0]
    # near the guess, and ψ = (R_i θ_i + R_j θ_j)/(R_i + R_j) along the line of centres
    assert abs(np.exp(1j * two) - np.exp(1j * angle)) < 0.06
    assert abs((ri * start + rj * two) / apart - direction) < 1e-12


@pytest.mark.parametrize("ring_first", [True, False])
def test_losses_of_a_train_with_a_fixed_ring(ring_first):
    """T_sun (1 + 2.5 η₁ η₂) = T_arm: seen from the arm the sun drives the ring by both meshes. The
    ring is the ground, on either side of the pair; no wheel alone can be turned to other teeth.
    """
    ring = ("ground", "planet", 75.0, 15.0) if ring_first else ("planet", "ground", 15.0, 75.0)
    i, j, radius_i, radius_j = ring
    machine = mbody.Mechanism("train", units="mm-N-s", ground={"O": (0, 0)})
    machine.add(
        mbody.Body("sun", guess=0.0),
        mbody.Body("arm", points={"P": (60, 0)}, guess=0.0),
        mbody.Body("planet", guess=(60, 0, 0.0)),
        mbody.Revolute("sun_pin", "ground.O", "sun"),
        mbody.Revolute("arm_pin", "ground.O", "arm"),
        mbody.Revolute("planet_pin", "arm.P", "planet"),
        mbody.Gear("first", "sun", "planet", radius_i=40, radius_j=20, efficiency=0.98),
        mbody.Gear(
            "second", i, j, radius_i=radius_i, radius_j=radius_j, internal=True, efficiency=0.97
        ),
        mbody.Torque("load", "arm", value=-30000.0),
        mbody.AngleDriver("motor", "sun", ConstantSpeed(0.0, 10.0)),
    )
    effort = mbody.kinetostatics(machine, t=[0.0, 0.1]).effort("motor")
    assert effort == pytest.approx(30000.0 / (1.0 + 2.5 * 0.98 * 0.97), rel=1e-12)
