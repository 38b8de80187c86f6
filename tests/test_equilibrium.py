"""Rest positions, their stability and their curves, against closed forms and an oracle."""

import itertools
import json
import math

import numpy as np
import pytest
from numpy.testing import assert_allclose

from mbody import (
    AngleDriver,
    Body,
    CouplingTerm,
    Distance,
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
    from_toml,
    gallery,
    statics,
    to_toml,
)
from mbody.cli import main
from mbody.engineering import equilibrium_curve
from mbody.engines.oracle import Reference
from mbody.makers import makers
from mbody.model.body import Guess
from mbody.model.loads import CentrifugalField
from mbody.model.study import Question

pytestmark = pytest.mark.processor

UPRIGHT = Marker("ground", (0.0, 0.0), 0.5 * math.pi)
g = 9.81
#: Newton ends at rounding; angles are of order one.
ANGLE = 1e-11
#: Differences of fourth order with a step of 1e-3: 1e-12 of the forces, times a few.
STIFF = 1e-10


def pendulum(*more, inertia=0.0):
    """2 kg, half a metre below its pin."""
    machine = Mechanism("pendulum")
    body = Body("rod", mass=2.0, inertia=inertia, cg=(0.5, 0.0), guess=-1.5, spread="point")
    machine.add(body, Revolute("O", "ground", "rod"), Gravity("gravity", y=-g), *more)
    return machine


def angles(found, body):
    """Angles of a body [rad] at all rest positions, −π … π."""
    return [math.remainder(float(one[body].angle[0]), 2.0 * math.pi) for one in found]


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
        # told in leaders: both angles, each while the other stands still
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


def four_bar(*more):
    made = makers.four_bar(1.0, 3.0, 2.0, 3.5, masses=(1.0, 3.0, 2.0))
    machine = Mechanism("hanging four-bar", ground=made.ground.points)
    machine.add(*made.bodies, *made.joints, Gravity("gravity", y=-g), *more)
    return machine


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
    """The ram stands still there to first order, so nothing that moves has inertia.

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


def test_many_free_motions():
    """A chain of twelve links, each with its pin's load: the weight of all below it."""
    machine, end = Mechanism("chain"), "ground"
    for k in range(12):
        body = Body(f"b{k}", mass=1.0, inertia=0.01, cg=(0.1, 0.0), points={"E": (0.2, 0.0)})
        machine.add(body, Revolute(f"j{k}", end, f"b{k}"))
        end = f"b{k}.E"
    machine.add(Gravity("gravity", y=-g))
    hanging = equilibrium(machine, starts=[{f"b{k}": -1.2 for k in range(12)}]).stable[0]
    for k in range(12):
        assert_allclose(math.sin(float(hanging[f"b{k}"].angle[0])), -1.0, atol=1e-12)
        assert_allclose(hanging.reaction(f"j{k}").fy, (12 - k) * g, rtol=1e-11)
    # modes of the dense mass and stiffness matrices by hand, angles from the vertical
    n = np.arange(12)
    below = 12 - 1 - np.maximum(n[:, None], n[None, :])
    M = 0.04 * (below + 0.5) + np.diag(0.01 + 0.01 + 0.04 * (11 - n) - 0.04 * (11 - n + 0.5))
    K = np.diag(g * 0.2 * (11 - n + 0.5))
    squares = np.sort(np.linalg.eigvals(np.linalg.solve(M, K)).real)
    assert_allclose(hanging.frequencies, np.sqrt(squares), rtol=1e-8)


def test_many_free_motions_are_said_to_be_many():
    """Of n rods in a chain 2ⁿ positions rest: all of four, found by turning over one rod after the
    other; what may be missed of more is told, and so is a limit.
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


# -- rotating fields -----------------------------------------------------------------------------


def whirling(speed):
    return pendulum(CentrifugalField("field", UPRIGHT, speed=speed))


def test_a_pendulum_in_a_field():
    """Below √(g/l) it hangs, above cos θ = g/(ω² l); both with the stiffness of the book."""
    lifts = math.sqrt(g / 0.5)
    slow = equilibrium(whirling(3.0))
    assert len(slow) == 2
    assert f"lifts above {lifts:.6g} rad/s ({lifts * 30 / math.pi:.6g} rpm)" in slow[0].notes[0]
    assert "hangs as without the field" in slow[0].notes[0]
    fast = equilibrium(whirling(6.0))
    lean = math.acos(g / (36.0 * 0.5))
    assert [one.stability for one in fast] == ["stable", "stable", "unstable", "unstable"]
    assert sorted(angles(fast.stable, "rod")) == pytest.approx(
        [-0.5 * math.pi - lean, -0.5 * math.pi + lean], abs=ANGLE
    )
    hand = 2.0 * (g * 0.5 * math.cos(lean) - 36.0 * 0.25 * math.cos(2.0 * lean))
    assert_allclose(fast[0].stiffness, [[hand]], rtol=STIFF)
    assert not any("lifts" in note for one in fast for note in one.notes)


def test_a_free_spindle_is_stiffer():
    """With H held instead of ω the plane slows down as the mass goes out: K has one term more."""
    momentum, own = 9.0, 0.3
    machine = pendulum(CentrifugalField("field", UPRIGHT, momentum=momentum, inertia=own))
    found = equilibrium(machine)
    stable = found.stable[0]

    def energy(theta):  # from the vertical
        J = own + 2.0 * (0.5 * np.sin(theta)) ** 2
        return momentum**2 / (2.0 * J) - 2.0 * g * 0.5 * np.cos(theta)

    theta = float(stable["rod"].angle[0]) + 0.5 * math.pi
    h = 1e-3
    a, b, c, d, e = (energy(theta + n * h) for n in (-2, -1, 0, 1, 2))
    # differences of fourth order, h⁴ = 1e-12 of the derivatives
    assert abs(8.0 * (d - b) - (e - a)) / (12.0 * h) < 1e-8
    assert_allclose(stable.stiffness, (-a + 16 * b - 30 * c + 16 * d - e) / (12 * h * h), rtol=1e-7)


def test_both_sides_of_a_governor_hang_in_a_singular_position():
    """There each arm is free by itself to first order."""
    found = equilibrium(gallery.load("porter_governor", {"omega": "100 rpm"}), free="theta")
    hanging = found.stable[0]
    assert len(hanging.motions) == 2
    assert any(note.startswith("singular position") for note in hanging.notes)
    lifts = math.sqrt((6.0 + 18.0) / 6.0 * g / 0.3)
    assert any(f"lifts above {lifts:.6g} rad/s" in note for note in hanging.notes)
    # half the weight on each side; rows that depend on each other are solved softened, to 1e-7
    assert_allclose(hanging.reaction("O_l", on="arm_l").fy, 0.5 * 30.0 * g, rtol=1e-7)


# -- curves --------------------------------------------------------------------------------------


def test_a_curve_round_its_fold():
    """A pendulum under a torque gives way at m g l, and stands up on the way back."""
    machine = pendulum(Torque("push", "rod", value=0.0))
    curve = equilibrium_curve(machine, "push.value", (-20.0, 20.0), at=0.0)
    theta = curve["rod"].angle
    assert_allclose(curve.values, 2.0 * g * 0.5 * np.cos(theta), atol=1e-11)
    # quadratic in the error of the angle
    assert_allclose(curve.values[list(curve.folds)], [g, -g], rtol=1e-12)
    assert not curve.crossings
    below = np.sin(theta) < -1e-6
    assert (curve.stable == below).all()
    assert "closes on itself" in curve.notes[0]
    assert curve.unit == "N·m"
    # joint forces at every point
    assert_allclose(curve.reaction("O").fy, 2.0 * g, rtol=1e-11)
    assert_allclose(curve.reaction("O").fx, 0.0, atol=1e-11)


def truss(height=0.2, stiffness=1000.0):
    """Two springs that lean on each other: von Mises' truss."""
    machine = Mechanism("von Mises", ground={"A": (-1.0, 0.0), "B": (1.0, 0.0)})
    free_length = math.hypot(1.0, height)
    top = Marker("top", (0.0, 0.0), 0.5 * math.pi)
    machine.add(
        Body("top", guess=Guess(0.0, 0.0, height)),
        Prismatic("guide", UPRIGHT, top),
        Spring("a", "ground.A", "top", stiffness=stiffness, free_length=free_length),
        Spring("b", "ground.B", "top", stiffness=stiffness, free_length=free_length),
        Force("P", "top", 0.0, angle=-0.5 * math.pi),
    )
    return machine


def test_von_mises_truss_snaps_through():
    """P(y) = 2k (l₀/l − 1) y; folds where l³ = l₀, both ways."""
    start = {"top": (0.0, 0.2, 0.0)}
    curve = equilibrium_curve(truss(), "P.value", (-10.0, 10.0), at=0.0, start=start)
    y, l0 = curve["top"].y, math.hypot(1.0, 0.2)
    assert_allclose(curve.values, 2000.0 * (l0 / np.hypot(1.0, y) - 1.0) * y, atol=1e-9)
    at = math.sqrt(l0 ** (2.0 / 3.0) - 1.0)
    P = 2000.0 * (l0 ** (2.0 / 3.0) - 1.0) * at
    assert_allclose(curve.values[list(curve.folds)], [P, -P], rtol=1e-11)
    assert_allclose(y[list(curve.folds)], [at, -at], rtol=1e-6)  # flat there
    middle = (np.abs(y) < at - 1e-5).nonzero()[0]
    outside = (np.abs(y) > at + 1e-5).nonzero()[0]
    assert not curve.stable[middle].any() and curve.stable[outside].all()
    assert curve.values[-1] == 10.0


def test_a_curve_along_a_length_that_constraints_hold():
    """A rod's length changes: the position follows at once. A weight hangs on two strings."""
    machine = Mechanism("hanging", ground={"A": (-1.0, 0.0), "B": (1.0, 0.0)})
    machine.add(
        Body("weight", mass=2.0, inertia=0.0, guess=(0.3, -1.0, 0.0)),
        Distance("string", "ground.A", "weight", length=1.5),
        Spring("spring", "ground.B", "weight", stiffness=30.0, free_length=0.5),
        TorsionSpring("upright", "weight", stiffness=5.0),
        Gravity("gravity", y=-g),
    )
    curve = equilibrium_curve(machine, "string.length", (1.5, 2.5))
    x, y = curve["weight"].x, curve["weight"].y
    assert_allclose(np.hypot(x + 1.0, y), curve.values, rtol=1e-12)
    # balance across the string, by hand
    length = np.hypot(x - 1.0, y)
    pull = 30.0 * (length - 0.5) / length
    fx, fy = -pull * (x - 1.0), -pull * y - 2.0 * g
    assert_allclose(fx * y - fy * (x + 1.0), 0.0, atol=1e-9)
    # each point again by a search of its own
    system = assemble(machine).with_values({"string.length": float(curve.values[7])})
    again = equilibrium(system).stable[0]
    assert_allclose([again["weight"].x[0], again["weight"].y[0]], [x[7], y[7]], atol=1e-9)


def test_the_pitchfork_of_a_field():
    """ω₀ = √(g/l): the hanging branch crosses the one that leans, cos θ = g/(ω² l)."""
    lifts = math.sqrt(g / 0.5)
    hanging = equilibrium_curve(whirling(1.0), "field.speed", (0.0, 10.0))
    # between points at which the stiffness is still told from zero, by a straight line
    assert_allclose(hanging.values[list(hanging.crossings)], [lifts], rtol=1e-7)
    assert (hanging.stable == (hanging.values < lifts - 1e-6)).all()
    assert hanging.values[-1] == 10.0 and not hanging.folds
    lean = equilibrium_curve(whirling(1.0), "field.speed", (10.0, 0.0), start={"rod": -0.2})
    theta = lean["rod"].angle + 0.5 * math.pi
    assert_allclose(np.cos(theta) * lean.values**2, g / 0.5, rtol=1e-7)
    assert_allclose(lean.values[list(lean.crossings)], [lifts], rtol=1e-7)
    assert not lean.folds
    assert theta[0] > 1.0 and theta[-1] < -1.0  # through the crossing to the other side
    away = np.abs(theta) > 1e-3
    assert lean.stable[away].all()


def test_a_curve_from_a_rest_position():
    machine = whirling(6.0)
    start = next(one for one in equilibrium(machine) if one.stability == "stable")
    curve = equilibrium_curve(machine, "field.speed", (6.0, 8.0), start=start)
    assert_allclose(curve["rod"].angle[0], start["rod"].angle[0], atol=ANGLE)
    assert curve.values[-1] == 8.0
    assert (np.diff(curve.arclength) > 0.0).all()


def test_points_that_are_not_enough():
    machine = pendulum(Torque("push", "rod", value=0.0))
    curve = equilibrium_curve(machine, "push.value", (0.0, 20.0), points=5)
    assert len(curve) == 5 and "5 points were not enough" in curve.notes[0]


# -- telling -------------------------------------------------------------------------------------


def test_the_tables_fit_and_tell():
    found = equilibrium(gallery.load("flyball_governor"), free="theta")
    curve = equilibrium_curve(
        gallery.load("flyball_governor"), "omega", (230.0, 0.0), free=["theta"]
    )
    for text in (str(found), str(curve)):
        assert max(map(len, text.splitlines())) <= 100
        assert all(line == line.rstrip() for line in text.splitlines())
    assert "6 rest positions" in str(found) and "stiffness" in str(found)
    assert "begin" in str(curve) and "rad/s" in str(curve)


def test_data_are_json():
    found = equilibrium(pendulum())
    told = json.loads(json.dumps(found.data(), allow_nan=False))
    assert [one["stability"] for one in told["positions"]] == ["stable", "unstable"]
    assert told["positions"][0]["statics"]["bodies"]["rod"]["angle"][0] == pytest.approx(-90.0)
    curve = equilibrium_curve(whirling(1.0), "field.speed", (0.0, 10.0))
    assert json.loads(json.dumps(curve.data(), allow_nan=False))["crossings"] == list(
        curve.crossings
    )


def test_the_command(capsys):
    assert main(["equilibrium", "porter_governor", "--free", "theta", "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    lean = max(abs(p["statics"]["bodies"]["arm_r"]["angle"][0]) for p in told["positions"][:1])
    # (1 + M/m) g = l ω² cos θ at 120 rpm
    cosine = 4.0 * g / (0.3 * (4.0 * math.pi) ** 2)
    assert lean == pytest.approx(math.degrees(math.acos(cosine)), rel=1e-9)
    assert (
        main(["equilibrium", "porter_governor", "--free", "theta", "--set", "omega=5 rad/s"]) == 0
    )
    assert "lifts above 11.4368 rad/s" in capsys.readouterr().out
    assert main(["equilibrium", "porter_governor"]) == 1
    assert "nothing is free" in capsys.readouterr().err
    assert main(["equilibrium", "porter_governor", "--free", "motor"]) == 2
    assert main(["equilibrium", "porter_governor", "--free", "theta", "--t", "3 m"]) == 2


def test_without_leaves_the_description_alone():
    machine = gallery.load("porter_governor")
    freed = machine.without("theta")
    assert len(machine.drivers) == 1 and not freed.drivers
    assert "theta.law.value" in machine.formulas or "theta.law" in machine.formulas
    assert not any(name.startswith("theta.") for name in freed.formulas)
    assert not freed.questions and gallery.load("porter_governor").questions
    system = assemble(machine)
    assert not system.mechanism.without("theta").drivers
    with pytest.raises(SolveError, match="needs 0 free degrees of freedom"):
        statics(freed)


def test_questions_of_a_driver_go_with_it():
    """What is left can be written and read; a question that does not speak of the driver stays."""
    for name in gallery.names():
        machine = gallery.load(name)
        for driver in machine.drivers:
            freed = machine.without(driver.name)
            assert from_toml(to_toml(freed)) == freed, name
    machine = four_bar(AngleDriver("motor", "crank", 0.5), AngleDriver("second", "rocker", 1.0))
    for key, condition, at in (
        ("motor", "motor.effort = 0", {}),
        ("load", "load.effort = 0", {"motor": 0.3}),
        ("body", "A.fx = 0", {"crank": 0.3}),
        ("other", "A.fx = B.fx", {"second": 0.3}),
    ):
        machine.questions[key] = Question("gravity.y", condition, at=at)
    assert list(machine.without("motor").questions) == ["other"]


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
