"""A guess chooses a branch: how many whole turns it names is of no effect on what comes out."""

import math

import numpy as np
import pytest

import mbody
from mbody.engineering import close_loops

TURN = 2.0 * math.pi
TURNS = (-3, -1, 1, 2)


def sprung_four_bar(guess: float, free: float = math.radians(70)) -> mbody.Mechanism:
    """Crank 1, coupler 3, rocker 2.5, ground 3.5, the rocker on a torsion spring."""
    machine = mbody.Mechanism("sprung", ground={"O2": (0, 0), "O4": (3.5, 0)})
    machine.add(
        mbody.Body("crank", mass=1.0, inertia=0.1, points={"A": (1.0, 0.0)}),
        mbody.Body(
            "coupler", mass=1.0, inertia=0.1, points={"B": (3.0, 0.0)}, guess=math.radians(30)
        ),
        mbody.Body("rocker", mass=1.0, inertia=0.1, points={"B": (2.5, 0.0)}, guess=guess),
        mbody.Revolute("O2", "ground.O2", "crank"),
        mbody.Revolute("A", "crank.A", "coupler"),
        mbody.Revolute("B", "coupler.B", "rocker.B"),
        mbody.Revolute("O4", "ground.O4", "rocker"),
        mbody.AngleDriver("motor", "crank", "60 deg"),
        mbody.TorsionSpring("spring", "rocker", stiffness=3.0, free_angle=free),
    )
    return machine


@pytest.mark.parametrize("turns", TURNS)
@pytest.mark.parametrize("analysis", ["kinetostatics", "statics"])
def test_a_spring_takes_the_turn_nearest_to_its_free_angle(turns, analysis):
    """By hand: the twist is the rocker's direction less the free angle, within half a turn, and the
    effort follows by virtual work from the rates of the rocker."""
    guess = math.radians(110)
    run = getattr(mbody, analysis)(sprung_four_bar(guess + TURN * turns))
    plain = getattr(mbody, analysis)(sprung_four_bar(guess))
    twist = math.remainder(float(run["rocker"].angle[0]) - math.radians(70), TURN)
    rates = mbody.kinematics(sprung_four_bar(guess), drive={"motor": (math.radians(60), 1.0)})
    by_work = 3.0 * twist * float(rates["rocker"].omega[0])
    # closing is exact to 1e-13 of an angle of a few turns
    assert run.effort("motor")[0] == pytest.approx(by_work, abs=1e-10)
    assert run["rocker"].angle[0] == pytest.approx(plain["rocker"].angle[0], abs=1e-11)
    assert not run.notes


def test_designs_of_a_batch_and_of_a_sweep_are_turned_one_by_one():
    system = mbody.assemble(sprung_four_bar(math.radians(110)))
    free = np.array([0.0, 4.0, 9.0, -7.0, 1.0])
    alone = [
        mbody.kinetostatics(system.with_values({"spring.free_angle": f})).effort("motor")[0]
        for f in free.tolist()
    ]
    batch = mbody.kinetostatics(system.with_values({"spring.free_angle": free}))
    # lanes and the scalar path differ by rounding
    np.testing.assert_allclose(batch.effort("motor")[:, 0], alone, atol=1e-9)
    found = mbody.sweep(system, {"spring.free_angle": free}, measure="first(motor.effort)", t=[0.0])
    np.testing.assert_allclose(found["first(motor.effort)"], alone, atol=1e-9)


def wound(
    guess: float = 0.0, simulation: mbody.SimulationSettings | None = None
) -> mbody.Mechanism:
    """A rod on a torsion spring of frequency 2 rad/s, without gravity."""
    machine = mbody.Mechanism("wound", simulation=simulation)
    machine.add(
        mbody.Body("rod", mass=1.0, inertia=0.5, guess=guess),
        mbody.Revolute("O", "ground", "rod"),
        mbody.TorsionSpring("spring", "rod", stiffness=2.0),
    )
    return machine


def test_turns_are_counted_on_along_a_motion_and_believed_where_they_are_said():
    """Closed form θ = θ₀ cos 2t: from an exact start of 3 turns, and 0.5 rad from a rough guess."""
    said = wound(simulation=mbody.SimulationSettings(1.0, {"rod": {"angle": 3 * TURN}}, rtol=1e-11))
    run = mbody.simulate(said, instants=11)
    np.testing.assert_allclose(run["rod"].angle, 3 * TURN * np.cos(2 * run.t), atol=1e-7)
    rough = mbody.simulate(wound(3 * TURN + 0.5), 1.0, rtol=1e-11, instants=11)
    np.testing.assert_allclose(rough["rod"].angle, 0.5 * np.cos(2 * rough.t), atol=1e-7)


def test_sweeps_of_free_motions_take_the_nearest_turn_of_every_design():
    free = np.array([0.0, 7.0, 3.0])
    found = mbody.sweep(
        wound(1.0),
        {"spring.free_angle": free},
        measure="last(rod.angle)",
        analysis="simulate",
        until=1.0,
    )
    start = free + [math.remainder(1.0 - f, TURN) for f in free]
    by_hand = free + (start - free) * math.cos(2.0)
    # the default tolerance of a step is 1e-8
    np.testing.assert_allclose(found["last(rod.angle)"], by_hand, atol=1e-6)


@pytest.mark.parametrize("turns", TURNS)
def test_rest_positions_do_not_depend_on_the_turns_of_a_guess(turns):
    def rests(guess):
        machine = wound(guess)
        machine.add(mbody.Gravity("gravity", y=-9.81))
        return [rest["rod"].angle[0] for rest in mbody.equilibrium(machine)]

    np.testing.assert_allclose(rests(0.4 + TURN * turns), rests(0.4), atol=1e-9)


def test_a_spring_after_turns_of_a_driver_is_noted():
    machine = mbody.Mechanism("late")
    machine.add(
        mbody.Body("crank"),
        mbody.Body("arm", mass=1.0, cg=(1.0, 0.0)),
        mbody.Revolute("O", "ground", "crank"),
        mbody.Revolute("P", "crank", "arm"),
        mbody.AngleDriver("motor", "crank", "10 rad/s * t"),
        mbody.AngleDriver("held", "arm", 0.3),
        mbody.TorsionSpring("s", "arm", by="crank", stiffness=1.0),
    )
    # both bodies are driven: their angles are what the laws say, three turns apart
    assert mbody.kinetostatics(machine, t=2.0).load("s").angle[0] == pytest.approx(0.3 - 20.0)
    free = machine.without("held")
    report = mbody.mobility(free, t=2.0)
    assert any("begin at t = 0" in note for note in report.notes)
    assert not any("begin at t = 0" in note for note in mbody.mobility(free).notes)


# -- rows that count turns ------------------------------------------------------------------------


def chained_five_bar(turns: int) -> mbody.Mechanism:
    """Two cranks by a chain of ratio 1, two couplers between them."""
    machine = mbody.Mechanism("chained", ground={"O": (0, 0), "Q": (3, 0)})
    link = {"A": (1.0, 0.0)}
    machine.add(
        mbody.Body("one", points=link),
        mbody.Body("two", points=link, guess=math.radians(75) + TURN * turns),
        mbody.Body("left", points={"P": (2.5, 0.0)}, guess=math.radians(50)),
        mbody.Body("right", points={"P": (2.5, 0.0)}, guess=math.radians(130) - TURN * turns),
        mbody.Revolute("O", "ground.O", "one"),
        mbody.Revolute("Q", "ground.Q", "two"),
        mbody.Revolute("A", "one.A", "left"),
        mbody.Revolute("B", "two.A", "right"),
        mbody.Revolute("P", "left.P", "right.P"),
        mbody.AngleDriver("motor", "one", "60 deg"),
        mbody.AngleCoupling(
            "chain", [mbody.CouplingTerm(1, angle="one"), mbody.CouplingTerm(-1, angle="two")]
        ),
    )
    return machine


@pytest.mark.parametrize("turns", TURNS)
def test_a_chain_does_not_turn_a_guess_back(turns):
    """By hand: cranks parallel at 60°, so that the couplers form an equilateral triangle."""
    run = mbody.kinematics(chained_five_bar(turns))
    assert run["two"].angle[0] == pytest.approx(math.radians(60), abs=1e-12)
    height = math.sqrt(2.5**2 - 1.5**2)
    assert run.point("left.P").y[0] == pytest.approx(math.sin(math.radians(60)) + height, abs=1e-12)


def geared(turns: int) -> mbody.Mechanism:
    machine = mbody.Mechanism("geared", ground={"Q": (5.0, 0)})
    machine.add(
        mbody.Body("a"),
        mbody.Body("b", points={"P": (1.0, 0.0)}, guess=-1.0 + TURN * turns),
        mbody.Revolute("O", "ground", "a"),
        mbody.Revolute("Q", "ground.Q", "b"),
        mbody.AngleDriver("motor", "a", 0.6),
        mbody.Gear("mesh", "a", "b", radius_i=3.0, radius_j=2.0),
    )
    return machine


@pytest.mark.parametrize("turns", TURNS)
def test_wheels_mesh_as_they_stand_at_0_however_a_guess_is_turned(turns):
    """3 θ_a + 2 θ_b = 0 when both are at 0 in the phase 0."""
    run = mbody.kinematics(geared(turns))
    assert run["b"].angle[0] == pytest.approx(-0.9, abs=1e-12)


@pytest.mark.parametrize("turns", TURNS)
def test_a_rack_and_a_winch_do_not_turn_a_guess_back(turns):
    machine = mbody.Mechanism("rack", ground={"C": (0.0, 1.0)})
    guess = -0.5 + TURN * turns
    machine.add(
        mbody.Body("rack", mass=1.0),
        mbody.Body("pinion", guess=guess),
        mbody.Body("drum", guess=2.0 - TURN * turns),
        mbody.Prismatic("guide", "ground", "rack"),
        mbody.Revolute("C", "ground.C", "pinion"),
        mbody.Revolute("D", mbody.Marker("ground", (9.0, 0.0)), "drum"),
        mbody.RackPinion("mesh", "rack", "pinion", radius=1.0),
        mbody.LengthCoupling(
            "rope",
            [
                mbody.CouplingTerm(1.0, coordinate=("ground", "rack")),
                mbody.CouplingTerm(-0.5, angle="drum"),
            ],
            -0.8,
        ),
    )
    run = close_loops(machine)
    plain = run["pinion"].angle[0], run["drum"].angle[0]
    # Φ of both by hand; the turns stay those of the motion of the rack, which began near 0
    assert run.point("rack").x[0] == pytest.approx(plain[0], abs=1e-12)
    assert run.point("rack").x[0] + 0.8 == pytest.approx(0.5 * plain[1], abs=1e-12)
    assert abs(run.point("rack").x[0]) < 1.0
