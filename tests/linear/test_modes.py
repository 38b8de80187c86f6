"""Small motions: modes, linear equations, momentum, against closed forms and other routes."""

import json
import math
from itertools import pairwise

import numpy as np
import pytest
from numpy.testing import assert_allclose

from mbody import (
    AngleDriver,
    Body,
    Damper,
    Force,
    Gravity,
    Mechanism,
    Prismatic,
    Revolute,
    SolveError,
    Spring,
    TorsionDamper,
    TorsionSpring,
    assemble,
    equilibrium,
    gallery,
    kinetostatics,
    makers,
    modes,
    simulate,
)
from mbody.cli import main
from mbody.engineering import close_loops, linearize, momentum
from mbody.files.model import in_units
from mbody.laws import ConstantSpeed
from tests.support.cases import first_fast

pytestmark = pytest.mark.processor

g = 9.81
#: Stiffness is good to 1e-12 of the forces; roots take it times a few.
CLOSE = 1e-11
#: Accelerations are good to 1e-13, their differences with a step of 1e-3 to 1e-10, times a few.
DIFFERENCES = 2e-9


def pendulum(*more, **own):
    """2 kg, half a metre below its pin."""
    machine = Mechanism("pendulum")
    own = {"mass": 2.0, "inertia": 0.3, "cg": (0.5, 0.0), "guess": -1.5} | own
    machine.add(Body("rod", **own), Revolute("O", "ground", "rod"), Gravity("gravity", y=-g), *more)
    return machine


def test_a_pendulum_hanging_and_upright():
    """ω = √(m g d/(I + m d²)); upright the same rate of growth."""
    hanging, upright = modes(pendulum())
    omega = math.sqrt(2.0 * g * 0.5 / (0.3 + 2.0 * 0.25))
    (mode,) = hanging
    assert (hanging.stability, mode.words) == ("stable", "oscillates")
    assert_allclose([mode.frequency, mode.natural_frequency], omega, rtol=CLOSE)
    assert_allclose(mode.hertz, omega / (2.0 * math.pi), rtol=CLOSE)
    assert mode.damping_ratio == 0.0 and mode.decay_rate == 0.0
    # 1 rad of the rod takes its mass centre half a metre to the right
    assert_allclose(mode.shape["rod"], [0.5, 0.0, 1.0], atol=1e-12)
    (mode,) = upright
    assert (upright.stability, mode.words) == ("unstable", "grows")
    assert_allclose(mode.decay_rate, -omega, rtol=CLOSE)
    assert mode.frequency == mode.natural_frequency == 0.0


@pytest.mark.parametrize("zeta", [0.05, 0.7, 1.0, 3.0])
def test_a_damped_oscillator(zeta):
    """s² + 2 ζ ω s + ω² = 0, below critical damping, at it and above."""
    mass, stiffness = 2.0, 50.0
    omega = math.sqrt(stiffness / mass)
    machine = Mechanism("oscillator", ground={"O": (-1.0, 0.0)})
    machine.add(
        Body("block", mass=mass),
        Prismatic("rail", "ground", "block"),
        Spring("spring", "ground.O", "block", stiffness=stiffness, free_length=0.8),
        Damper("damper", "ground.O", "block", coefficient=2.0 * zeta * mass * omega),
    )
    one = modes(machine, at=equilibrium(machine).stable[0])[0]
    assert one.stability == "stable"
    assert_allclose(one.linear.damping, [[2.0 * zeta * mass * omega]], rtol=CLOSE)
    if zeta < 1.0:
        (mode,) = one
        assert mode.words == "oscillates and decays"
        assert_allclose(mode.natural_frequency, omega, rtol=CLOSE)
        assert_allclose(mode.damping_ratio, zeta, rtol=CLOSE)
        assert_allclose(mode.frequency, omega * math.sqrt(1.0 - zeta**2), rtol=CLOSE)
        assert_allclose(mode.decay_rate, zeta * omega, rtol=CLOSE)
    else:
        assert [mode.words for mode in one] == ["decays", "decays"]
        width = math.sqrt(zeta**2 - 1.0)
        # a double root is found to the root of rounding
        error = 1e-6 if zeta == 1.0 else CLOSE
        slow, fast = omega * (zeta - width), omega * (zeta + width)
        assert_allclose([mode.decay_rate for mode in one], [slow, fast], rtol=error)


def chain(n, m=0.5, k=200.0, *, ends=True):
    """Blocks on a rail with springs between them, and to walls at both ends."""
    machine = Mechanism("chain", ground={f"W{i}": (float(i), 0.0) for i in (0, n + 1)})
    for i in range(1, n + 1):
        machine.add(Body(f"b{i}", mass=m, guess=(float(i), 0.0, 0.0)))
        machine.add(Prismatic(f"rail{i}", "ground", f"b{i}"))
    places = ["ground.W0", *(f"b{i}" for i in range(1, n + 1)), f"ground.W{n + 1}"]
    pairs = list(pairwise(places))
    for i, (a, b) in enumerate(pairs if ends else pairs[1:-1]):
        machine.add(Spring(f"s{i}", a, b, stiffness=k, free_length=1.0))
    return machine


@first_fast("n", [1, 3, 5], 2)
def test_a_chain_of_masses(n):
    """ω_k = 2 √(k/m) sin(k π/(2 n + 2)), shapes sin(i k π/(n + 1)): Rayleigh."""
    machine = chain(n)
    rest = equilibrium(machine).stable[0]
    one = modes(machine, at=rest)[0]
    k = np.arange(1, n + 1)
    assert_allclose(
        one.frequencies,
        2.0 * math.sqrt(200.0 / 0.5) * np.sin(k * math.pi / (2 * n + 2)),
        rtol=CLOSE,
    )
    for mode, order in zip(one, k, strict=True):
        shape = np.sin(k * order * math.pi / (n + 1))
        mine = np.array([mode.shape[f"b{i}"][0] for i in k])
        assert_allclose(mine.imag, 0.0, atol=1e-12)
        mine, peak = mine.real, np.abs(mine).argmax()
        assert_allclose(mine / mine[peak], shape / shape[peak], atol=1e-8)


def test_a_chain_that_nothing_holds():
    """One mode without frequency, and √2 √(k/m) of two equal masses."""
    machine = chain(2, ends=False)
    # it rests where it starts, its spring unloaded
    one = modes(machine, at=simulate(machine, 0.1))[0]
    assert one.stability == "neutral"
    rigid, swing = one
    assert (rigid.words, swing.words) == ("free", "oscillates")
    assert rigid.eigenvalue == 0.0 and rigid.damping_ratio == 0.0
    assert_allclose(rigid.shape["b1"], rigid.shape["b2"], atol=1e-9)
    assert_allclose(swing.shape["b1"], -swing.shape["b2"], atol=1e-9)
    assert_allclose(swing.frequency, math.sqrt(2.0 * 200.0 / 0.5), rtol=CLOSE)


def double(*more, la=1.0, lb=1.0):
    """Two slender rods, 3 kg and 1 kg."""
    machine = Mechanism("double pendulum")
    machine.add(
        Body(
            "a",
            mass=3.0,
            cg=(0.5 * la, 0.0),
            points={"B": (la, 0.0)},
            inertia=3.0 * la**2 / 12.0,
            guess=0.3,
        ),
        Body("b", mass=1.0, cg=(0.5 * lb, 0.0), inertia=lb**2 / 12.0, guess=0.7),
        Revolute("O", "ground", "a"),
        Revolute("B", "a.B", "b"),
        Gravity("gravity", y=-g),
        *more,
    )
    return machine


def test_two_equal_rods():
    """ω² = (3 ± 6/√7) g/l of two equal slender rods: det(K − ω² M) = 0 by hand."""
    machine = Mechanism("rods")
    rod = {"mass": 1.0, "cg": (0.5, 0.0), "inertia": 1.0 / 12.0, "points": {"B": (1.0, 0.0)}}
    machine.add(
        Body("a", guess=-1.5, **rod),
        Body("b", guess=-1.6, **rod),
        Revolute("O", "ground", "a"),
        Revolute("B", "a.B", "b"),
        Gravity("gravity", y=-g),
    )
    one = modes(machine, at=equilibrium(machine).stable[0])[0]
    squares = np.array([3.0 - 6.0 / math.sqrt(7.0), 3.0 + 6.0 / math.sqrt(7.0)]) * g
    assert_allclose(one.frequencies**2, squares, rtol=10.0 * CLOSE)
    # the lower one in phase, the higher one against it: θ_b/θ_a = (2 √7 ∓ 1)/3 with their signs
    ratios = [(m.shape["b"][2] / m.shape["a"][2]).real for m in one]
    assert_allclose(ratios, [(2 * math.sqrt(7) - 1) / 3, -(2 * math.sqrt(7) + 1) / 3], rtol=1e-8)


def by_hand(theta, omega):
    """Accelerations of the double pendulum by Lagrange's equations in both angles."""
    a, b = theta
    M = np.array([[2.0, 0.5 * np.cos(a - b)], [0.5 * np.cos(a - b), 1.0 / 3.0]])
    turning = 0.5 * np.sin(a - b) * np.array([-(omega[1] ** 2), omega[0] ** 2])
    weight = -g * np.array([2.5 * np.cos(a), 0.5 * np.cos(b)])
    return np.linalg.solve(M, turning + weight)


def test_a_double_pendulum_in_motion():
    """The state matrix against complex steps through Lagrange's equations."""
    machine = double()
    start = close_loops(machine, rates={"a": 1.0, "b": -2.0})
    found = linearize(machine, at=start)
    theta = np.array([start[name].angle[0] for name in "ab"])
    omega = np.array([start[name].omega[0] for name in "ab"])
    A = np.zeros((4, 4))
    A[:2, 2:] = np.eye(2)
    for n in range(4):
        step = np.zeros(4, complex)
        step[n] = 1e-30j
        A[2:, n] = by_hand(theta + step[:2], omega + step[2:]).imag / 1e-30
    assert found.about == "motion" and found.leaders == ("a", "b")
    size = np.abs(A).max()
    assert_allclose(found.state_matrix, A, atol=DIFFERENCES * size)
    pull = np.linalg.solve(found.mass, found.drive)
    assert_allclose(pull, by_hand(theta, omega), rtol=1e-10)


def test_at_rest_both_routes_agree():
    """M, C, K from the loads, and from accelerations on the manifold."""
    more = TorsionDamper("c", "a", "b", 0.3), TorsionSpring("k", "ground", "a", 20.0)
    machine = double(*more)
    rest = equilibrium(machine).stable[0]
    found = linearize(machine, at=rest)
    theta = {name: float(rest[name].angle[0]) for name in "ab"}
    # a drift that is a part 1e-7 of the natural rate is motion, and changes no matrix by more
    start = close_loops(machine, guess=theta, rates={"a": 1e-6, "b": 0.0})
    other = linearize(machine, at=start)
    assert (found.about, other.about) == ("rest", "motion")
    for mine, moving in zip(
        (found.mass, found.damping, found.stiffness),
        (other.mass, other.damping, other.stiffness),
        strict=True,
    ):
        assert_allclose(moving, mine, atol=1e-6 * np.abs(found.stiffness).max())
    assert_allclose(found.drive, 0.0)


def test_a_driver_that_turns():
    """A pendulum whose pin a crank carries round: the exact linear equation in that instant."""
    machine = Mechanism("carried")
    R, d, w = 0.4, 0.5, 3.0
    machine.add(
        Body("crank", mass=1.0, points={"A": (R, 0.0)}),
        Body("rod", mass=2.0, inertia=0.3, cg=(d, 0.0), guess=-1.2),
        Revolute("O", "ground", "crank"),
        Revolute("A", "crank.A", "rod"),
        AngleDriver("motor", "crank", ConstantSpeed(0.6, w)),
        Gravity("gravity", y=-g),
    )
    start = close_loops(machine, rates={"rod": 0.7})
    found = linearize(machine, at=start)
    theta = float(start["rod"].angle[0])
    # (I + m d²) θ̈ = m d (R w² sin(θ − ψ) − g cos θ), differentiated by θ
    stiffness = 2.0 * d * (R * w**2 * math.cos(theta - 0.6) - g * math.sin(theta))
    assert found.about == "motion"
    assert_allclose(found.mass, [[0.3 + 2.0 * d**2]], rtol=1e-12)
    assert_allclose(found.stiffness, [[stiffness]], atol=DIFFERENCES * 40.0)
    assert_allclose(found.damping, 0.0, atol=DIFFERENCES * 40.0)


def test_a_four_bar_swings_as_its_mode_says():
    """After one period of the mode a small swing, followed over time, is where it began."""
    machine = gallery.load("free_fourbar")
    rest = equilibrium(machine).stable[0]
    mode = modes(machine, at=rest)[0][0]
    small, guess = 1e-4, {}
    for name in rest.solution:
        body = rest[name]
        guess[name] = float(body.angle[0])
    start = close_loops(machine, guess=guess, rates={mode.leader: small * mode.frequency})
    period = 2.0 * math.pi / mode.frequency
    run = simulate(machine, period, start=start, rtol=1e-12, instants=2)
    angle, rate = run[mode.leader].angle, run[mode.leader].omega
    began = start[mode.leader]
    # the period of a swing depends on the square of its size, 1e-8, times a few
    assert_allclose(angle[-1] - began.angle[0], 0.0, atol=1e-6 * small)
    assert_allclose(rate[-1], began.omega[0], rtol=1e-6)


def test_massless_parts_follow():
    """A massless block between two springs in series: ω² = k₁ k₂/((k₁ + k₂) m), and no second."""
    machine = Mechanism("series", ground={"O": (0.0, 0.0)})
    machine.add(
        Body("knot", guess=(1.0, 0.0, 0.0)),
        Body("block", mass=2.0, guess=(2.0, 0.0, 0.0)),
        Prismatic("rail1", "ground", "knot"),
        Prismatic("rail2", "ground", "block"),
        Spring("s1", "ground.O", "knot", stiffness=30.0, free_length=1.0),
        Spring("s2", "knot", "block", stiffness=70.0, free_length=1.0),
    )
    rest = equilibrium(machine).stable[0]
    one = modes(machine, at=rest)[0]
    (mode,) = one
    assert_allclose(mode.frequency, math.sqrt(30.0 * 70.0 / (100.0 * 2.0)), rtol=CLOSE)
    assert_allclose(mode.shape["knot"][0], 70.0 / 100.0, rtol=1e-9)
    assert any("without inertia" in note for note in one.notes)
    # a dashpot on the knot: (m s² + k₂) (c s + k₁ + k₂) = k₂²
    machine.add(Damper("c", "ground.O", "knot", coefficient=5.0))
    one = modes(machine, at=rest)[0]  # a dashpot moves no rest
    cubic = np.roots([2.0 * 5.0, 2.0 * 100.0, 70.0 * 5.0, 30.0 * 70.0])
    mine = [m.eigenvalue for m in one]
    wanted = [root for root in cubic if root.imag >= 0.0]
    assert_allclose(sorted(mine, key=abs), sorted(wanted, key=abs), rtol=CLOSE)


def test_a_column_that_flutters():
    """Ziegler's double pendulum: masses 2m and m at l and 2l, both springs k; it flutters where
    P l/k lies between 7/2 − √2 and 7/2 + √2 (Ziegler 1952).
    """
    for part, word in ((0.98, "stable"), (1.02, "unstable")):
        load = part * (3.5 - math.sqrt(2.0))
        machine = Mechanism("column")
        machine.add(
            Body("a", mass=2.0, cg=(1.0, 0.0), points={"B": (1.0, 0.0)}),
            Body("b", mass=1.0, cg=(1.0, 0.0)),
            Revolute("O", "ground", "a"),
            Revolute("B", "a.B", "b"),
            TorsionSpring("k1", "ground", "a", 1.0),
            TorsionSpring("k2", "a", "b", 1.0),
            Force("P", "b", load, angle=math.pi, follows=True),
        )
        start = close_loops(machine)
        one = modes(machine, at=start)[0]
        assert one.stability == word
        if word == "unstable":
            assert one[0].words == "oscillates and decays"
            assert one[1].words == "oscillates and grows"
        c = 3.5 - load
        # 2 s⁴ + (7 − 2 P) s² + 1 = 0 in units of k/(m l²)
        roots = np.roots([2.0, 0.0, 2.0 * c, 0.0, 1.0])
        wanted = sorted(
            (z for z in roots if z.imag > 0.0), key=lambda z: (round(abs(z), 9), z.real)
        )
        # two frequencies that meet: an error counts more than three times
        assert_allclose([m.eigenvalue for m in one], wanted, atol=10.0 * CLOSE)


def test_a_block_in_oil():
    """Nothing but a dashpot: one motion stays where it is, one decays with c/m."""
    machine = Mechanism("oil", ground={"O": (-1.0, 0.0)})
    machine.add(Body("block", mass=2.0), Prismatic("rail", "ground", "block"))
    machine.add(Damper("c", "ground.O", "block", coefficient=5.0))
    (one,) = modes(machine)
    assert one.stability == "neutral"
    assert [mode.words for mode in one] == ["free", "decays"]
    assert_allclose(one[1].decay_rate, 2.5, rtol=CLOSE)
    assert one[1].damping_ratio == 1.0 and one[1].frequency == 0.0


@pytest.mark.parametrize(
    ("law", "damping", "told"),
    [
        (lambda v: 5.0 * v, 5.0, 0),
        (lambda v: 3.0 * v * abs(v) + 2.0 * v, 2.0, 0),
        (lambda v: 2.0 * ((v > 0.0) - (v < 0.0)) + 5.0 * v, 5.0, 1),
    ],
)
def test_drag_and_friction(law, damping, told):
    """The damping of c v + q v |v| + μ sign v is c; the jump is noted."""
    machine = Mechanism("drag", ground={"O": (-1.0, 0.0)})
    machine.add(Body("block", mass=2.0), Prismatic("rail", "ground", "block"))
    machine.add(Spring("s", "ground.O", "block", stiffness=50.0, free_length=1.0))
    machine.add(Damper("c", "ground.O", "block", law=law))
    found = linearize(machine, at=close_loops(machine))
    # a jump of 2 N, rounded to 2e-16 of it, over steps of 5e-5 m/s
    assert_allclose(found.damping, [[damping]], rtol=1e-10)
    assert sum("jump" in note for note in found.notes) == told


def test_a_dead_centre_has_no_inertia():
    """A massless crank at its dead centre does not move the slider: nothing swings."""
    machine = gallery.load("slider_crank")
    drivers = [driver.name for driver in machine.drivers]
    found, rests = modes(machine, free=drivers), equilibrium(machine, free=drivers)
    # the gas drives the slider into one of them and out of the other
    assert [one.stability for one in found] == [one.stability for one in rests]
    assert [one.stability for one in found] == ["stable", "unstable"]
    for one in found:
        assert not len(one) and any("without inertia" in note for note in one.notes)


def test_units_have_no_say():
    """Millimetres and tonnes, though the leader slides: the same frequencies, M and K in units."""
    machine = gallery.load("porter_governor")
    other = in_units(machine, "mm-N-s")
    one, two = (modes(m, free="theta")[0] for m in (machine, other))
    assert one.linear.leaders == ("sleeve",)
    # the speed of the field, 12.57 rad/s, is rounded once more
    assert_allclose(two.frequencies, one.frequencies, rtol=CLOSE)
    assert_allclose(two.linear.mass * 1e3, one.linear.mass, rtol=1e-11)
    assert_allclose(two.linear.stiffness * 1e3, one.linear.stiffness, rtol=CLOSE)


def test_singular_positions_are_told():
    """Where all arms of the machine lie in its axis, arms and links part."""
    found = modes(gallery.load("porter_governor"), free="theta")
    notes = [[note for note in one.notes if "singular" in note] for one in found]
    assert [len(part) for part in notes] == [0, 0, 1, 1]


# -- momentum ---------------------------------------------------------------------------------


def test_momentum_of_two_bodies():
    """Free bodies: sums by hand, and their rest in free flight; the spring between is no matter."""
    machine = Mechanism("two")
    machine.add(
        Body("a", mass=2.0, inertia=0.3, guess=(0.0, 0.0, 0.0)),
        Body("b", mass=3.0, inertia=0.7, guess=(1.0, 0.5, 0.4), points={"P": (0.2, 0.1)}),
        Spring("s", "a", "b.P", stiffness=40.0, free_length=0.7),
    )
    start = close_loops(machine, rates={"a": 2.0, "b": -1.0})
    run = simulate(machine, 3.0, start=start, rtol=1e-11)
    mine = run.momentum()
    # integration to 1e-11 a step, some hundred steps, of momenta of order one
    for part in (mine.x, mine.y, mine.angular):
        assert_allclose(part, part[0], atol=1e-8)
    b = run["b"]
    assert_allclose(mine.mass, 5.0)
    hand = 2.0 * run["a"].vx + 3.0 * b.vx
    assert_allclose(mine.x, hand, atol=1e-12)
    moment = sum(
        m * (h.x * h.vy - h.y * h.vx) + inertia * h.omega
        for h, m, inertia in ((run["a"], 2.0, 0.3), (b, 3.0, 0.7))
    )
    assert_allclose(mine.angular, moment, atol=1e-12)
    about = momentum(run, about="b.P")
    place = run.point("b.P")
    assert_allclose(about.angular, moment - place.x * mine.y + place.y * mine.x, atol=1e-12)
    x, y = mine.centre
    assert_allclose(
        np.array([x, y]),
        (2.0 * np.array([run["a"].x, run["a"].y]) + 3.0 * np.array([b.x, b.y])) / 5.0,
        atol=1e-12,
    )


def test_momentum_changes_as_the_ground_pushes():
    """ṗ is the sum of what the ground does; L̇ about a pin is the moment of it, and the effort."""
    machine = makers.four_bar(1.0, 3.0, 2.0, 3.5, masses=(1.0, 3.0, 2.0), speed=10.0)
    t = np.linspace(0.0, 0.2, 2001)
    run = kinetostatics(machine, t=t)
    mine = run.momentum(about="ground.O4")
    joints = [j for j in machine.joints if j.i.body == "ground"]
    fx = sum(run.reaction(j.name).fx for j in joints)
    fy = sum(run.reaction(j.name).fy for j in joints)
    # differences of second order with a step of 1e-4 s at 10 rad/s: (10 · 1e-4)²/6, of the peak
    inner = slice(1, -1)
    moment = run.effort("motor") - 3.5 * run.reaction("O2").fy
    for whole, force in ((mine.x, fx), (mine.y, fy), (mine.angular, moment)):
        slope = np.gradient(whole, t)
        assert_allclose(slope[inner], force[inner], atol=2e-5 * np.abs(force).max())


def test_momentum_of_a_batch():
    machine = makers.four_bar(1.0, 3.0, 2.0, 3.5, masses=(1.0, 3.0, 2.0), speed=10.0)
    system, t = assemble(machine).with_values({"rocker.mass": [2.0, 4.0]}), [0.0, 0.1]
    both = kinetostatics(system, t=t).momentum(about=(1.0, 0.0))
    for n in range(2):
        alone = kinetostatics(system.design(n), t=t).momentum(about=(1.0, 0.0))
        for name in ("x", "y", "angular"):
            assert_allclose(getattr(both, name)[n], getattr(alone, name), rtol=1e-12, atol=1e-12)
        assert_allclose(both.mass[n], alone.mass)


# -- forms ------------------------------------------------------------------------------------


def test_the_command(capsys):
    assert main(["modes", "porter_governor", "--free", "theta", "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    found = modes(gallery.load("porter_governor"), free="theta")
    assert told == json.loads(json.dumps(found.data()))
    assert main(["modes", "porter_governor", "--free", "theta"]) == 0
    text = capsys.readouterr().out
    assert text == f"{found}\n"
    assert max(map(len, text.splitlines())) <= 100
    assert f"{found[0][0].frequency:.5f}" in text


def test_a_state_matrix_wants_inertia():
    machine = Mechanism("massless")
    machine.add(Body("rod", points={"B": (1.0, 0.0)}), Revolute("O", "ground", "rod"))
    machine.add(TorsionSpring("k", "ground", "rod", 3.0), TorsionDamper("c", "ground", "rod", 2.0))
    one = modes(machine)[0]
    (mode,) = one
    assert mode.words == "decays"
    assert_allclose(mode.decay_rate, 1.5, rtol=CLOSE)
    with pytest.raises(SolveError, match="without inertia"):
        _ = one.linear.state_matrix
