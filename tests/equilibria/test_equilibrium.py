"""Rest positions and their stability, against closed forms and an oracle."""

import itertools
import math

import numpy as np
import pytest
from numpy.testing import assert_allclose

from mbody import (
    AngleDriver,
    Body,
    CouplingTerm,
    Force,
    Gravity,
    LengthCoupling,
    Marker,
    Mechanism,
    Prismatic,
    Revolute,
    SolveError,
    Spring,
    Torque,
    TorsionSpring,
    assemble,
    equilibrium,
    gallery,
    makers,
)
from mbody.engines.oracle import Reference
from tests.support.rest_examples import angles, four_bar, pendulum

pytestmark = pytest.mark.processor

UPRIGHT = Marker("ground", (0.0, 0.0), 0.5 * math.pi)
g = 9.81
#: Newton ends at rounding; angles are of order one.
ANGLE = 1e-11
#: Differences of fourth order with a step of 1e-3: 1e-12 of the forces, times a few.
STIFF = 1e-10


def test_a_pendulum():
    found = equilibrium(pendulum(inertia=0.3))
    assert [one.stability for one in found] == ["stable", "unstable"]
    assert_allclose(angles(found, "rod"), [-0.5 * math.pi, 0.5 * math.pi], atol=ANGLE)
    for one, sign in zip(found, (1.0, -1.0), strict=True):
        assert_allclose(one.stiffness, [[sign * 2.0 * g * 0.5]], rtol=STIFF)
        assert_allclose(one.reaction("O").fy, 2.0 * g, rtol=1e-12)
        assert one.residual < 1e-12
    assert found[0].frequencies == pytest.approx(
        [math.sqrt(2.0 * g * 0.5 / (0.5 + 0.3))], rel=STIFF
    )
    assert found[1].frequencies == ()
    assert found.stable == (found[0],)


def double(*more):
    """Two rods of half a metre, each 1 m long; 3 kg and 1 kg."""
    machine = Mechanism("double pendulum")
    machine.add(
        Body("a", mass=3.0, cg=(0.5, 0.0), points={"B": (1.0, 0.0)}, inertia=0.2, guess=0.3),
        Body("b", mass=1.0, cg=(0.5, 0.0), inertia=0.1, guess=0.7),
        Revolute("O", "ground", "a"),
        Revolute("B", "a.B", "b"),
        Gravity("gravity", y=-g),
        *more,
    )
    return machine


def test_two_free_motions():
    """All four; K is diagonal in both angles: (m_a/2 + m_b) g l and m_b g l/2 with their signs."""
    found = equilibrium(double())
    assert len(found) == 4
    for one in found:
        a, b = (round(math.sin(float(one[name].angle[0]))) for name in ("a", "b"))
        hand = np.diag([-a * (0.5 * 3.0 + 1.0) * g, -b * 0.5 * g])
        # in terms of the leaders: both angles, each while the other is fixed
        assert [motion.leader for motion in one.motions] == ["a", "b"]
        assert_allclose(one.stiffness, hand, atol=STIFF * 30.0)
        assert one.stability == ("stable" if (a, b) == (-1, -1) else "unstable")
    # modes against the mass matrix by hand
    M = np.array([[3.0 * 0.25 + 0.2 + 1.0, 0.5], [0.5, 0.25 + 0.1]])
    squares = np.linalg.eigvals(np.linalg.solve(M, np.diag([2.5 * g, 0.5 * g])))
    assert_allclose(found[0].frequencies, np.sqrt(np.sort(squares)), rtol=STIFF)


def test_massless_links_and_springs():
    """A rod without mass, a spring and a torque: against a fine scan of the moment by hand."""
    machine = Mechanism("massless")
    machine.add(
        Body("rod", points={"B": (1.0, 0.0)}, guess=0.3),
        Revolute("O", "ground", "rod"),
        Spring("s", "rod.B", Marker("ground", (2.0, 1.0)), stiffness=10.0, free_length=0.5),
        Torque("T", "rod", value=1.0),
    )

    def moment(theta):
        dx, dy = 2.0 - np.cos(theta), 1.0 - np.sin(theta)
        length = np.hypot(dx, dy)
        return 10.0 * (length - 0.5) / length * (np.cos(theta) * dy - np.sin(theta) * dx) + 1.0

    found = equilibrium(machine)
    scan = np.linspace(-math.pi, math.pi, 100_001)
    crossed = scan[:-1][moment(scan)[:-1] * moment(scan)[1:] < 0.0]
    assert len(found) == len(crossed) == 2
    assert_allclose(np.sort(angles(found, "rod")), crossed, atol=1e-4)
    for one in found:
        theta = float(one["rod"].angle[0])
        assert abs(moment(theta)) < 1e-10
        step = 1e-5
        slope = (moment(theta + step) - moment(theta - step)) / (2.0 * step)
        # differences of second order with that step
        assert_allclose(one.stiffness, [[-slope]], rtol=1e-8)
        assert one.frequencies == ()


def test_a_closed_loop_against_its_height():
    """Rest positions are where the height of the mass centres is stationary; K is its curvature."""
    machine = four_bar()
    found = equilibrium(machine)
    oracle = Reference(machine)

    def potential(q):
        return g * sum(b.mass * q[3 * k + 1] for k, b in enumerate(machine.bodies))

    driven = Mechanism("driven", ground=machine.ground.points)
    driven.add(*machine.bodies, *machine.joints, AngleDriver("motor", "crank", 0.0))
    closer = Reference(driven)
    assert sorted(one.stability for one in found) == ["stable", "unstable"]
    for one in found:
        q = np.array([getattr(one[n], k)[0] for n in one.solution for k in ("x", "y", "angle")])
        heights = []
        step = 1e-3
        for n in (-2, -1, 0, 1, 2):
            near = closer.close(q, 0.0, {"motor": float(one["crank"].angle[0]) + n * step})
            heights.append(potential(near))
        a, b, c, d, e = heights
        slope = (8.0 * (d - b) - (e - a)) / (12.0 * step)
        curvature = (-a + 16.0 * b - 30.0 * c + 16.0 * d - e) / (12.0 * step * step)
        assert abs(slope) < 1e-8  # rounding of the heights over the step
        # rounding of the heights, 1e-15 of 60, over the square of the step
        assert_allclose(one.stiffness, [[curvature]], atol=1e-6)
        # joint forces: statics of the oracle, by least squares
        forces = oracle.kinetostatics(q, 0.0 * q, 0.0 * q, 0.0)
        assert forces["residual"] < 1e-10
        for joint in machine.joints:
            mine = one.reaction(joint.name)
            assert_allclose(
                [mine.fx[0], mine.fy[0]], forces["reactions"][joint.name][:2], atol=1e-9
            )


def test_a_step_of_many_bodies_is_as_long_as_one_of_few():
    """Forty windows on posts: the walk begins upright, goes all the way round, and meets hanging.

    41 posts and 40 beams of 1 kg: k = ± (41/2 + 40) g about one post; ω² = k/J, J = 41/3 + 40.
    """
    upright, hanging = sorted(
        equilibrium(gallery.load("n_windows_40")), key=lambda one: one.stability == "stable"
    )
    assert (upright.stability, hanging.stability) == ("unstable", "stable")
    for one, sign in ((upright, -1.0), (hanging, 1.0)):
        for n in (0, 17, 40):
            assert_allclose(math.sin(float(one[f"c{n}"].angle[0])), -sign, atol=1e-12)
        assert_allclose(one.stiffness, [[sign * 60.5 * g]], rtol=STIFF)
    assert hanging.frequencies == pytest.approx([math.sqrt(60.5 * g / (41 / 3 + 40))], rel=STIFF)


def press(**crank):
    """A ram that hangs on a crank of 0.2 m and a rod of 0.7 m, all others without mass."""
    machine = Mechanism("press")
    machine.add(
        Body("crank", points={"A": (0.2, 0.0)}, guess=-1.4, **crank),
        Body("rod", points={"B": (0.7, 0.0)}, guess=-1.6),
        Body("ram", mass=2.0, guess=(0.0, -0.9, 0.0)),
        Revolute("O", "ground", "crank"),
        Revolute("A", "crank.A", "rod"),
        Revolute("B", "rod.B", "ram"),
        Prismatic("guide", UPRIGHT, Marker("ram", (0.0, 0.0), 0.5 * math.pi)),
        Gravity("gravity", y=-g),
    )
    return machine


def test_a_massless_crank_at_its_dead_centre_has_no_frequency():
    """The ram is at rest there to first order, so nothing that moves has inertia.

    It hangs r cos θ + √(l² − r² sin² θ) below the pivot, θ from the vertical: K = m g (r + r²/l)
    below, −m g (r − r²/l) above.
    """
    below, above = equilibrium(press())
    assert (below.stability, above.stability) == ("stable", "unstable")
    assert_allclose(below.stiffness, [[2.0 * g * (0.2 + 0.04 / 0.7)]], rtol=STIFF)
    assert_allclose(above.stiffness, [[-2.0 * g * (0.2 - 0.04 / 0.7)]], rtol=STIFF)
    assert below.frequencies == ()
    omega = math.sqrt(float(below.stiffness[0, 0]) / 0.3)
    assert equilibrium(press(inertia=0.3))[0].frequencies == pytest.approx([omega], rel=STIFF)


def test_a_held_crank_leaves_the_rest_free():
    """A double pendulum whose first rod a driver holds: the second hangs, and the motor holds."""
    machine = double(AngleDriver("motor", "a", 0.4))
    found = equilibrium(machine)
    assert_allclose(angles(found, "b"), [-0.5 * math.pi, 0.5 * math.pi], atol=ANGLE)
    effort = found[0].solution.effort("motor")
    assert_allclose(effort, (0.5 * 3.0 + 1.0) * g * math.cos(0.4), rtol=1e-11)
    freed = equilibrium(machine, free="motor")
    assert len(freed) == 4


def test_redundant_rows():
    """Three parallel cranks: one freedom although Grübler counts none."""
    machine = gallery.load("parallel_cranks")
    found = equilibrium(machine, free="motor")
    stable = found.stable[0]
    assert_allclose(math.sin(float(stable["crank1"].angle[0])), -1.0, atol=ANGLE)
    # 3.5 kg at the cranks' ends, 1 m: the motor's torque in the gallery is 3.5 g cos θ
    assert_allclose(stable.stiffness, [[3.5 * g]], rtol=1e-9)


def test_numbers_of_a_system_go_along():
    system = assemble(gallery.load("porter_governor")).with_values({"M": 30.0})
    found = equilibrium(system.with_values({"field.speed": 20.0}), free=["theta"])
    lean = abs(float(found.stable[0]["arm_r"].angle[0]))
    assert math.cos(lean) == pytest.approx((6.0 + 30.0) / 6.0 * g / (400.0 * 0.3), rel=1e-10)


def test_neutral():
    machine = Mechanism("wheel")
    machine.add(Body("wheel", mass=2.0, inertia=1.0), Revolute("O", "ground", "wheel"))
    machine.add(Gravity("gravity", y=-g))
    (one,) = equilibrium(machine)
    assert one.stability == "neutral" and "row of rest positions" in one.notes[0]


@pytest.mark.slow
def test_a_row_of_rest_positions_is_told_once():
    """A pendulum on a trolley rests anywhere along the rail, hanging or standing."""
    machine = Mechanism("trolley")
    machine.add(
        Body("trolley", mass=3.0),
        Body("rod", mass=2.0, cg=(0.5, 0.0), guess=0.4),
        Prismatic("rail", "ground", "trolley"),
        Revolute("O", "trolley", "rod"),
        Gravity("gravity", y=-g),
    )
    found = equilibrium(machine)
    assert [one.stability for one in found] == ["neutral", "unstable"]
    assert all("row of rest positions" in one.notes[0] for one in found)


def test_a_start_that_rests_already():
    """The walk goes on from there."""
    assert len(equilibrium(pendulum(), starts=[{"rod": -0.5 * math.pi}])) == 2
    machine = Mechanism("standing")
    body = Body("rod", mass=2.0, cg=(0.5, 0.0), guess=0.5 * math.pi)
    machine.add(body, Revolute("O", "ground", "rod"), Gravity("gravity", y=-g))
    assert len(equilibrium(machine)) == 2


def test_springs_without_tension():
    """Where no load is left at rest, the residual is a part of the stiffness."""
    machine = Mechanism("floating")
    machine.add(Body("a", mass=1.0, inertia=1.0))
    machine.add(Spring("s", "ground", Marker("a", (0.1, 0.0)), stiffness=3.0))
    (one,) = equilibrium(machine)
    assert one.stability == "neutral"  # it turns about the end of the spring
    assert_allclose([one["a"].x[0], one["a"].y[0]], [-0.1, 0.0], atol=1e-8)


def test_turns_of_a_spring_are_told_apart():
    """k θ = m g l/2 … cos θ has a root each side of the top, one of them a turn further."""
    machine = Mechanism("wound")
    body = Body("rod", mass=2.0, cg=(0.5, 0.0), guess=0.3)
    spring = TorsionSpring("spring", "rod", stiffness=0.2)
    machine.add(body, Revolute("O", "ground", "rod"), Gravity("gravity", y=-g), spring)
    found = equilibrium(machine)
    theta = np.array([float(one["rod"].angle[0]) for one in found])
    assert_allclose(0.2 * theta, -g * np.cos(theta), atol=1e-10)
    assert len(found) == 3 and np.ptp(theta[[one.stability == "stable" for one in found]]) > 6.0


@pytest.mark.slow
def test_many_free_motions():
    """A chain of six links, each with its pin's load: the weight of all below it."""
    count, machine, end = 6, Mechanism("chain"), "ground"
    for k in range(count):
        body = Body(f"b{k}", mass=1.0, inertia=0.01, cg=(0.1, 0.0), points={"E": (0.2, 0.0)})
        machine.add(body, Revolute(f"j{k}", end, f"b{k}"))
        end = f"b{k}.E"
    machine.add(Gravity("gravity", y=-g))
    hanging = equilibrium(machine, starts=[{f"b{k}": -1.2 for k in range(count)}]).stable[0]
    for k in range(count):
        assert_allclose(math.sin(float(hanging[f"b{k}"].angle[0])), -1.0, atol=1e-12)
        assert_allclose(hanging.reaction(f"j{k}").fy, (count - k) * g, rtol=1e-11)
    # modes of the dense mass and stiffness matrices by hand, angles from the vertical
    n = np.arange(count)
    last = count - 1
    below = last - np.maximum(n[:, None], n[None, :])
    M = 0.04 * (below + 0.5) + np.diag(0.01 + 0.01 + 0.04 * (last - n) - 0.04 * (last - n + 0.5))
    K = np.diag(g * 0.2 * (last - n + 0.5))
    squares = np.sort(np.linalg.eigvals(np.linalg.solve(M, K)).real)
    assert_allclose(hanging.frequencies, np.sqrt(squares), rtol=1e-8)


@pytest.mark.slow
def test_many_free_motions_are_said_to_be_many():
    """Of n rods in a chain 2ⁿ positions rest: all of four, found by turning over one rod after the
    other; what may be missed of more is noted, and so is a limit.
    """

    def chain(count):
        machine = Mechanism("chain")
        place = "ground"
        for n in range(count):
            machine.add(makers.bar(f"l{n}", 1.0, mass=1.0, ends=("A", "B"), guess=-1.2))
            machine.add(Revolute(f"j{n}", place, f"l{n}.A"))
            place = f"l{n}.B"
        machine.add(Gravity("gravity", y=-g))
        return machine

    four = equilibrium(chain(4))
    ways = {
        tuple(round(math.sin(float(one[f"l{n}"].angle[0])), 9) for n in range(4)) for one in four
    }
    assert ways == set(itertools.product((-1.0, 1.0), repeat=4)) and len(four) == 16
    assert [one.stability for one in four].count("stable") == 1
    (note,) = four.notes
    assert note.startswith("4 free motions:") and "may be missed" in note
    assert equilibrium(chain(2)).notes == ()
    with pytest.raises(SolveError, match=r"41 free motions are too many .*, it takes up to 40"):
        equilibrium(chain(41))


def test_forces_that_follow_have_no_potential():
    """Beck's column of two rods: under a following thrust it does not buckle, it flutters.

    Two rods of length 1 with masses m at their ends, springs k at both joints, thrust P along the
    second: stable up to the flutter load of Ziegler's column with masses (2, 1): (7/2 − √2) k/l.
    """

    def column(thrust):
        machine = Mechanism("Ziegler")
        machine.add(
            Body("a", mass=2.0, cg=(1.0, 0.0), points={"B": (1.0, 0.0)}, guess=0.0),
            Body("b", mass=1.0, cg=(1.0, 0.0), points={"E": (1.0, 0.0)}, guess=0.0),
            Revolute("O", "ground", "a"),
            Revolute("B", "a.B", "b"),
            TorsionSpring("k1", "a", stiffness=1.0),
            TorsionSpring("k2", "b", by="a", stiffness=1.0),
            Force("P", "b.E", thrust, angle=math.pi, follows=True),
        )
        found = equilibrium(machine)
        straight = [one for one in found if max(abs(a) for n in "ab" for a in one[n].angle) < 1e-6]
        assert len(straight) == 1
        return straight[0]

    flutter = 3.5 - math.sqrt(2.0)
    below, above = column(0.999 * flutter), column(1.001 * flutter)
    assert below.stability == "stable" and above.stability == "unstable"
    assert "flutters" in above.notes[0] and "not symmetric" in below.notes[0]
    # by hand: the stiffness in absolute angles
    P = 0.999 * flutter
    assert_allclose(below.stiffness, [[2.0 - P, P - 1.0], [-1.0, 1.0]], atol=1e-9)


def test_a_coupling_is_told_and_sets_what_is_rounding():
    """Two weights on one rope, balanced by a spring: T = m g, and guides that carry nothing."""

    def upright(body, x=0.0):
        return Marker(body, (x, 0.0), 0.5 * math.pi)

    machine = Mechanism("balance", ground={"L": (-1.0, 2.0), "R": (1.0, 2.0)})
    machine.add(
        Body("a", mass=2.0, guess=(-1.0, 0.0, 0.0)),
        Body("b", mass=3.0, guess=(1.0, 0.0, 0.0)),
        Prismatic("left", upright("ground", -1.0), upright("a")),
        Prismatic("right", upright("ground", 1.0), upright("b")),
        LengthCoupling(
            "rope",
            [
                CouplingTerm(1.0, distance=("ground.L", "a")),
                CouplingTerm(1.0, distance=("ground.R", "b")),
            ],
            4.0,
        ),
        Gravity("gravity", y=-g),
        Spring("spring", "ground.R", "b", stiffness=40.0, free_length=1.0),
    )
    found = equilibrium(machine)
    low = found[0]
    assert_allclose(low.solution.effort("rope"), -2.0 * g, rtol=1e-12)
    assert_allclose(2.0 - low["b"].y - 1.0, g / 40.0, rtol=1e-12)
    text = str(found)
    assert "effort of rope   -19.62, " in text and "e-1" not in text.partition("FORCE")[2]
