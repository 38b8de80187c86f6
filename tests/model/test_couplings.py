"""Couplings against textbook answers, against gears that do the same, and against the oracle."""

import math

import numpy as np
import pytest

import mbody
from mbody.engines.oracle import Reference
from mbody.files.model import in_units
from mbody.laws import ConstantAcceleration, ConstantSpeed, Harmonic
from tests.support.agreement import assert_agrees
from tests.support.model_text import model_from, text_from
from tests.support.oracle_runs import accelerations

pytestmark = pytest.mark.processor

# closed loops leave 1e-13 of their size, forces the same times a condition below 10
CLOSE = 1e-12
UP = math.pi / 2.0


def differential(left=3.0, case=5.0):
    machine = mbody.Mechanism("differential")
    machine.add(
        *(mbody.Body(name, mass=1.0, inertia=0.2) for name in ("left", "right", "case")),
        *(mbody.Revolute(f"pin of {name}", "ground", name) for name in ("left", "right", "case")),
        mbody.AngleCoupling(
            "bevels",
            [
                mbody.CouplingTerm(1, angle="left"),
                mbody.CouplingTerm(1, angle="right"),
                mbody.CouplingTerm(-2, angle="case"),
            ],
        ),
        mbody.AngleDriver("motor", "case", ConstantSpeed(0.0, case)),
        mbody.AngleDriver("wheel", "left", ConstantSpeed(0.0, left)),
        mbody.Torque("load", "right", value=-7.0),
    )
    return machine


def test_a_differential_halves_the_torque_and_sums_the_speeds():
    run = mbody.kinetostatics(differential(), t=np.linspace(0.0, 2.0, 11))
    assert run["right"].omega == pytest.approx(2.0 * 5.0 - 3.0, rel=CLOSE)
    # both wheels take the same torque, half of the case's
    assert run.effort("bevels") == pytest.approx(7.0, rel=CLOSE)
    assert run.effort("wheel") == pytest.approx(-7.0, rel=CLOSE)
    assert run.effort("motor") == pytest.approx(14.0, rel=CLOSE)
    assert run.checks.virtual_work < 1e-14
    report = mbody.mobility(differential())
    assert (report.of_joints.freedom, report.freedom) == (2, 0)


def wheels(*between):
    """Two wheels of the radii 2 and 1, and what couples them."""
    machine = mbody.Mechanism("two wheels", ground={"A": (0.0, 0.0), "B": (3.0, 0.0)})
    machine.add(
        mbody.Body("a", mass=1.0, inertia=2.0),
        mbody.Body("b", mass=1.0, inertia=0.5),
        mbody.Revolute("A", "ground.A", "a"),
        mbody.Revolute("B", "ground.B", "b"),
        *between,
        mbody.AngleDriver("motor", "a", ConstantAcceleration(0.0, 3.0, 4.0)),
        mbody.Torque("load", "b", value=-3.0),
    )
    return machine


@pytest.mark.parametrize("crossed", [False, True])
def test_a_belt_turns_wheels_one_way_and_a_crossed_one_as_gears(crossed):
    sign = 1.0 if crossed else -1.0
    belt = mbody.LengthCoupling(
        "belt", [mbody.CouplingTerm(2.0, angle="a"), mbody.CouplingTerm(sign, angle="b")]
    )
    run = mbody.kinetostatics(wheels(belt), t=[0.0, 0.5])
    assert run["b"].omega == pytest.approx(-sign * 2.0 * run["a"].omega, rel=CLOSE)
    # the difference of the tensions, F = (I α + load)/r of the driven wheel
    assert run.effort("belt") == pytest.approx(sign * (0.5 * -sign * 8.0 + 3.0), rel=CLOSE)
    if crossed:
        gears = wheels(mbody.Gear("mesh", "a", "b", radius_i=2.0, radius_j=1.0))
        same = mbody.kinetostatics(gears, t=[0.0, 0.5])
        assert run.effort("motor") == pytest.approx(same.effort("motor"), rel=CLOSE)
        assert np.abs(run.effort("belt")) == pytest.approx(same.reaction("mesh").magnitude)


def test_a_screw_is_a_rack_of_the_radius_of_its_lead():
    lead, speed = 0.005, ConstantAcceleration(0.0, 20.0, 5.0)

    def press(transmission):
        machine = mbody.Mechanism("press", ground={"O": (0.0, lead / math.tau)})
        machine.add(
            mbody.Body("nut", mass=40.0),
            mbody.Body("screw", mass=1.0, inertia=1e-3),
            mbody.Revolute("O", "ground.O", "screw"),
            mbody.Prismatic("guide", "ground", "nut"),
            transmission,
            mbody.AngleDriver("motor", "screw", speed),
            mbody.Force("load", "nut", 5000.0, angle=math.pi),
        )
        return mbody.kinetostatics(machine, t=[0.0, 0.4])

    terms = [
        mbody.CouplingTerm(1.0, coordinate=("ground", "nut")),
        mbody.CouplingTerm(-lead / math.tau, angle="screw"),
    ]
    run = press(mbody.LengthCoupling("thread", terms))
    assert run["nut"].vx == pytest.approx(lead / math.tau * run["screw"].omega, rel=CLOSE)
    thrust = 5000.0 + 40.0 * lead / math.tau * 5.0
    assert run.effort("thread") == pytest.approx(thrust, rel=1e-10)
    torque = thrust * lead / math.tau + 1e-3 * 5.0
    assert run.effort("motor") == pytest.approx(torque, rel=1e-10)
    rack = press(mbody.RackPinion("teeth", "nut", "screw", radius=lead / math.tau))
    assert rack.effort("motor") == pytest.approx(torque, rel=1e-10)


def tackle(speed=0.5):
    """A rope from a hook at the top, round the sheave of a block, over a pulley, to the hand."""
    machine = mbody.Mechanism("tackle", ground={"top": (0.0, 5.0), "pulley": (2.0, 5.0)})
    up = mbody.Marker("ground", (0.0, 0.0), UP), mbody.Marker("block", (0.0, 0.0), UP)
    hand = mbody.Marker("ground", (2.0, 0.0), UP), mbody.Marker("hand", (0.0, 0.0), UP)
    machine.add(
        mbody.Body("block", mass=10.0, guess=(0.0, 1.0, 0.0)),
        mbody.Body("hand", mass=1.0, guess=(2.0, 3.0, 0.0)),
        mbody.Prismatic("left", *up),
        mbody.Prismatic("right", *hand),
        mbody.LengthCoupling(
            "rope",
            [
                mbody.CouplingTerm(2.0, distance=("ground.top", "block")),
                mbody.CouplingTerm(1.0, distance=("ground.pulley", "hand")),
            ],
            value=10.0,
        ),
        mbody.CoordinateDriver("pull", *hand, ConstantAcceleration(3.0, -speed, -0.6)),
        mbody.Gravity("gravity", y=-9.81),
    )
    return machine


def test_a_tackle_of_two_parts_halves_the_force_and_the_way():
    run = mbody.kinetostatics(tackle(), t=[0.0, 0.4])
    assert run["block"].y - 1.0 == pytest.approx(-0.5 * (run["hand"].y - 3.0), abs=CLOSE)
    # the rope pulls, so its effort is negative; two parts of it lift the block
    tension = 0.5 * 10.0 * (9.81 + 0.3)
    assert run.effort("rope") == pytest.approx(-tension, rel=1e-11)
    assert run.effort("pull") == pytest.approx(1.0 * (9.81 - 0.6) - tension, rel=1e-11)


def scattered(count=6):
    """Wheels on an arm that turns, coupled all at once; a lever, a rope and a slide among them."""
    machine = mbody.Mechanism("coupled", ground={"O": (0.0, 0.0), "S": (-1.0, -1.0)})
    machine.add(
        mbody.Body("arm", mass=2.0, inertia=1.0, cg=(0.4, 0.1), points={"E": (2.0, 0.2)}),
        mbody.Revolute("O", "ground.O", "arm"),
        mbody.AngleDriver("swing", "arm", Harmonic(0.3, 0.5, 2.0)),
    )
    for n in range(count):
        name = f"w{n}"
        machine.add(
            mbody.Body(name, mass=0.5, inertia=0.1 + 0.02 * n, cg=(0.05, 0.02 * n)),
            mbody.Revolute(f"p{n}", mbody.Marker("arm", (0.3 * n, 0.1)), name),
            mbody.Torque(f"load {n}", name, value=1.0 - 0.7 * n),
        )
        if n < count - 1:
            law = ConstantAcceleration(0.1 * n, 1.0 + n, 0.3 * n)
            machine.add(mbody.AngleDriver(f"m{n}", name, law, relative_to="arm"))
    machine.add(
        mbody.Body("slide", mass=0.8, inertia=0.05, cg=(0.1, 0.05)),
        mbody.Prismatic(
            "guide", mbody.Marker("arm", (0.0, 1.5), 0.2), mbody.Marker("slide", (0.0, 0.0), 0.1)
        ),
        mbody.AngleCoupling(
            "all wheels",
            [
                mbody.CouplingTerm(
                    0.5 + 0.3 * n, angle=f"w{n}", relative_to="arm" if n % 2 else "ground"
                )
                for n in range(count)
            ],
            value=0.2,
        ),
        mbody.LengthCoupling(
            "rope",
            [
                mbody.CouplingTerm(
                    1.0, distance=(mbody.Marker("arm", "E"), mbody.Marker("slide", (0.2, 0.1)))
                ),
                mbody.CouplingTerm(0.7, distance=("ground.S", mbody.Marker("slide", (0.0, 0.3)))),
                mbody.CouplingTerm(
                    -0.4, coordinate=(mbody.Marker("ground", (0.1, 0.2), 0.5), "arm.E")
                ),
                mbody.CouplingTerm(0.05, angle="w0", relative_to="w1"),
            ],
            value=4.0,
        ),
        mbody.Gravity("gravity", x=1.0, y=-9.81),
    )
    return machine


@pytest.mark.parametrize("count", [3, 6, 9])  # with nine wheels the arm has more joints than a slot
def test_the_oracle_agrees_on_couplings_of_many_bodies(count):
    machine = scattered(count)
    oracle, t = Reference(machine), np.linspace(0.0, 1.2, 13)
    run = mbody.kinetostatics(machine, t=t)
    for k in (0, 5, 12):
        assert_agrees(oracle, run, k)
    assert run.checks.virtual_work < 1e-11
    assert run.checks.equilibrium < 1e-11
    parts = run.breakdown("rope")
    assert sum(parts.values()) == pytest.approx(run.effort("rope"), rel=1e-9)


def test_free_motion_is_the_oracles():
    """Forward dynamics of coupled wheels without motors, by one acceleration."""
    driven = scattered(4)
    run = mbody.kinetostatics(driven, t=[0.3])
    q, v = (
        np.ravel([[getattr(run[body.name], key)[0] for key in keys] for body in driven.bodies])
        for keys in (("x", "y", "angle"), ("vx", "vy", "omega"))
    )
    machine = mbody.Mechanism("free", ground=driven.ground.points)
    machine.add(*(element for element in driven if element not in driven.drivers))
    wanted, _ = Reference(machine).dynamics(q, v, 0.3)
    mine, _ = accelerations(mbody.assemble(machine), q, v, 0.3, 2)
    assert np.abs(mine - wanted).max() < 1e-9 * np.abs(wanted).max()


def test_a_coupling_that_repeats_a_gear_is_redundant():
    machine = wheels(
        mbody.Gear("mesh", "a", "b", radius_i=2.0, radius_j=1.0),
        mbody.AngleCoupling(
            "chain", [mbody.CouplingTerm(2.0, angle="a"), mbody.CouplingTerm(1.0, angle="b")]
        ),
    )
    report = mbody.mobility(machine)
    assert (
        report.redundant == {"A": 1, "B": 1, "mesh": 1, "chain": 1}
        or report.redundant["chain"] == 1
    )
    run = mbody.kinetostatics(machine, t=[0.0, 0.5])
    alone = mbody.kinetostatics(
        wheels(mbody.Gear("mesh", "a", "b", radius_i=2.0, radius_j=1.0)), t=[0.0, 0.5]
    )
    assert run.effort("motor") == pytest.approx(alone.effort("motor"), rel=1e-7)


def test_files_keep_couplings():
    machine = scattered()
    for as_json in (False, True):
        assert model_from(text_from(machine, as_json), as_json) == machine
    text = """
    units = "mm-N-s"
    parameters = { r = "30 mm", n = 2 }
    [bodies.drum]
    mass = "1 kg"
    [bodies.block]
    mass = "2 kg"
    guess = { x = 0, y = -500 }
    [joints]
    O = { revolute = ["ground", "drum"] }
    guide = { prismatic = [{ body = "ground", angle = 90 }, { body = "block", angle = 90 }] }
    [couplings.rope]
    length = [{ factor = "n", distance = ["ground", "block"] }, { factor = "r", angle = "drum" }]
    value = "1 m"
    [drivers.motor]
    angle = "drum"
    law = { constant_speed = { value = 0, speed = 2 } }
    [gravity]
    y = "-10 m/s^2"
    """
    winch = mbody.from_toml(text)
    run = mbody.kinetostatics(winch)
    assert run.effort("rope")[0] == pytest.approx(-10.0)
    assert run["block"].vy[0] == pytest.approx(30.0)  # shorter by r ω over two parts: 30 mm/s
    assert mbody.from_toml(mbody.to_toml(winch)) == winch
    faster = mbody.kinetostatics(mbody.assemble(winch).with_values(r=60.0))
    assert faster["block"].vy[0] == pytest.approx(60.0)
    inches = mbody.kinetostatics(in_units(winch, "in-lbf-s"))
    assert inches["block"].vy[0] * 25.4 == pytest.approx(30.0)
    chain = "[couplings]\nchain = { angle = [{ factor = 1, angle = 'a' }], value = 30 }\n"
    plain = mbody.from_toml("[bodies.a]\n[joints]\nO = { revolute = ['ground', 'a'] }\n" + chain)
    assert plain["chain"].value == pytest.approx(math.radians(30.0))
    assert mbody.kinetostatics(plain)["a"].angle[0] == pytest.approx(math.radians(30.0))


def test_a_pin_on_a_slot_driven_by_a_chain():
    """A coupling within a closed loop: the crank turns half as fast as the motor's wheel."""
    machine = mbody.Mechanism("chain and slot", ground={"O": (0.0, 0.0), "L": (1.0, 0.0)})
    machine.add(
        mbody.Body("wheel"),
        mbody.Body("crank", points={"P": (0.4, 0.0)}),
        mbody.Body("lever", mass=1.0, inertia=0.3, guess=math.pi),
        mbody.Revolute("W", "ground", "wheel"),
        mbody.Revolute("O", "ground.O", "crank"),
        mbody.Revolute("L", "ground.L", "lever"),
        mbody.PinSlot("slot", "lever", "crank.P"),
        mbody.AngleCoupling(
            "chain",
            [mbody.CouplingTerm(2.0, angle="crank"), mbody.CouplingTerm(-1.0, angle="wheel")],
        ),
        mbody.AngleDriver("motor", "wheel", ConstantSpeed(0.2, 6.0)),
    )
    run = mbody.kinetostatics(machine, turn=True, instants=121)
    assert run["crank"].omega == pytest.approx(3.0, rel=1e-11)
    power = 0.3 * run["lever"].alpha * run["lever"].omega
    assert run.effort("motor") * 6.0 == pytest.approx(power, abs=1e-9)
    assert run.effort("chain") * -6.0 == pytest.approx(-power, abs=1e-9)
