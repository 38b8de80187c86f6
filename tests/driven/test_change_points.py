"""Instants at which branches meet: parallelograms driven through the line, redundant rows."""

import json
import math

import numpy as np
import pytest
from numpy.testing import assert_allclose

import mbody
from mbody import makers
from mbody.engines.oracle import Reference
from mbody.laws import ConstantSpeed

pytestmark = pytest.mark.processor

SPEED = 2.0
CRANK, BASE = 1.0, 3.0
MASSES = (1.0, 3.0, 1.5)


def parallelogram(start=0.0, speed=SPEED, masses=MASSES):
    return makers.four_bar(CRANK, BASE, CRANK, BASE, masses=masses, speed=speed, start=start)


def by_hand(angle, rate=SPEED):
    """Motion and reactions of a parallelogram without gravity at constant rate, (instants,) each.

    The coupler moves on a circle, its weightless half carried by either pin: its ends pull with
    half its centripetal force along the cranks. Each crank needs its own as well, and no torque.
    """
    u = np.stack([np.cos(angle), np.sin(angle)])
    m2, m3, m4 = MASSES
    half = -0.5 * m3 * CRANK * rate**2 * u
    return {
        "A": half,  # on the coupler by the crank
        "B": -half,  # on the rocker by the coupler
        "O2": half - 0.5 * m2 * CRANK * rate**2 * u,
        "O4": half - 0.5 * m4 * CRANK * rate**2 * u,
    }


def singular(angle):
    return np.abs(np.sin(angle)) < 1e-9


def tolerances(angle, rate=SPEED):
    """Of angles, rates, accelerations and forces at these angles of the crank, (instants,) each.

    Newton's last correction, up to 1e-12 of coordinates up to 10, is not carried into Φ_q: rates
    are off by that over its smallest singular value, here a fifth of |sin|; accelerations by its
    square and forces by its cube. On the line limits are interpolated with an error of 2e-12 from
    places 0.04 and more away, where it is that of those places.
    """
    small = np.where(singular(angle), 0.04, np.abs(np.sin(angle))) / 5.0
    rates = 1e-11 * rate / small
    forces = 1e-11 * MASSES[1] * rate**2 / small**3
    return 1e-12 / small, rates, rates * rate / small, np.maximum(forces, 1e-9)


def assert_near(found, wanted, tolerance):
    off = np.abs(found - wanted)
    assert (off <= tolerance).all(), (float((off / tolerance).max()), float(off.max()))


# instants of whole turns: some on the line, one to each side of it, all of them
TURNS = [13, 9, 5, 361, 3]


@pytest.mark.parametrize("instants", TURNS)
@pytest.mark.parametrize("start", [0.0, math.pi / 6.0, 0.5])
def test_parallelogram_kinematics(instants, start):
    run = mbody.kinematics(parallelogram(start), turn=True, instants=instants)
    angle = start + 2.0 * math.pi * np.linspace(0.0, 1.0, instants)
    meets = int(singular(angle).sum())
    note = f"{meets} of {instants} instants are change points, given as limits"
    assert (note in run.notes) == bool(meets)
    angles, rates, changes, _ = tolerances(angle)
    for name in ("crank", "rocker"):
        assert_near(run[name].angle, angle, angles)
        assert_near(run[name].omega, SPEED, rates)
        assert_near(run[name].alpha, 0.0, changes)
    coupler = run["coupler"]
    c, s = CRANK * np.cos(angle), CRANK * np.sin(angle)
    assert_near(coupler.angle, 0.0, angles)
    assert_near(coupler.x, c + 0.5 * BASE, BASE * angles)
    assert_near(coupler.y, s, BASE * angles)
    assert_near(coupler.ax, -(SPEED**2) * c, BASE * changes)
    assert_near(coupler.ay, -(SPEED**2) * s, BASE * changes)


@pytest.mark.parametrize("instants", TURNS)
@pytest.mark.parametrize("start", [0.0, math.pi / 6.0])
def test_parallelogram_forces_without_gravity(instants, start):
    run = mbody.kinetostatics(parallelogram(start), turn=True, instants=instants)
    angle = start + 2.0 * math.pi * np.linspace(0.0, 1.0, instants)
    forces = tolerances(angle)[3]
    for name, (fx, fy) in by_hand(angle).items():
        part = run.reaction(name)
        assert_near(part.fx, fx, forces)
        assert_near(part.fy, fy, forces)
        assert_near(part.torque, 0.0, 1e-12)
    assert_near(run.effort("motor"), 0.0, forces)


def test_values_of_the_driver_through_the_line():
    angle = np.linspace(0.5, -3.5, 9)
    angle[1], angle[7] = 0.0, -math.pi
    rate = np.linspace(1.0, 5.0, 9)
    run = mbody.kinematics(parallelogram(0.5), drive={"motor": (angle, rate, 3.0)})
    assert "2 of 9 instants are change points, given as limits" in run.notes
    angles, rates, changes, _ = tolerances(angle, rate)
    assert_near(run["rocker"].angle, angle, angles)
    assert_near(run["rocker"].omega, rate, rates)
    assert_near(run["rocker"].alpha, 3.0, changes)


@pytest.mark.parametrize("analysis", [mbody.kinetostatics, mbody.statics])
@pytest.mark.parametrize("start", [0.0, 0.5])
def test_forces_that_have_no_limit(analysis, start):
    """The rocker's weight needs a moment, and there both links that could give it pull along it:
    nothing is reported of them at that instant, and all at others.
    """
    machine = parallelogram(start)
    machine.add(mbody.Gravity("gravity", y=-9.81))
    on_line = 0.5 * (math.pi - start)
    times = np.array([0.0, 0.2, 0.4, on_line, on_line + 0.05])
    run = analysis(machine, t=times)
    missing = [0, 3] if start == 0.0 else [3]
    for name in ("O2", "A", "B", "O4"):
        part = run.reaction(name)
        assert np.flatnonzero(np.isnan(part.fx)).tolist() == missing
    assert_allclose(run["rocker"].angle, run["crank"].angle, rtol=0, atol=1e-10)
    (doubt,) = run.doubts
    assert (doubt.kind, doubt.t) == ("incomplete", times[missing[0]])
    assert {"O2", "A", "B", "O4"} <= set(doubt.elements)
    assert doubt.message.startswith("forces grow without bound towards change points of 'four-bar'")
    assert "of 'crank': those of 'O2', 'A', 'B', 'O4'" in doubt.message
    assert run.status == f"doubtful: {doubt.message}" and doubt.message in run.notes
    assert run.checks.equilibrium < 1e-10
    # beside it all is what it is without that instant
    kept = np.setdiff1d(np.arange(len(times)), missing)
    alone = analysis(machine, t=times[kept], guess={"rocker": start + 2.0 * times[kept[0]]})
    assert not alone.doubts
    for name in ("O2", "A", "B", "O4"):
        for key in ("fx", "fy"):
            mine, other = (getattr(r.reaction(name), key) for r in (run, alone))
            assert_allclose(mine[kept], other, rtol=1e-6, atol=1e-6)
    assert_allclose(run.effort("motor")[kept], alone.effort("motor"), rtol=1e-7, atol=1e-7)
    # the summary has peaks of what there is, data have no number
    assert " nan" not in str(run)
    told = json.loads(json.dumps(run.data(), allow_nan=False))
    assert [k for k, v in enumerate(told["reactions"]["B"]["fx"]) if v is None] == missing


def test_a_whole_turn_of_forces_with_two_instants_that_have_none():
    machine = parallelogram(0.0)
    machine.add(mbody.Gravity("gravity", y=-9.81))
    run = mbody.kinetostatics(machine, turn=True)
    assert np.flatnonzero(np.isnan(run.reaction("B").fx)).tolist() == [0, 180, 360]
    assert [doubt.kind for doubt in run.doubts] == ["incomplete"]


def test_forces_that_have_a_limit_under_load():
    """A torque on the crank and the weight of the crank alone go to motor and ground."""
    machine = parallelogram(masses=(1.0, 0.0, 0.0))
    machine.add(mbody.Gravity("gravity", y=-9.81), mbody.Torque("load", "crank", value=5.0))
    run = mbody.kinetostatics(machine, turn=True, instants=13)
    angle = 2.0 * math.pi * np.linspace(0.0, 1.0, 13)
    c, s = np.cos(angle), np.sin(angle)
    assert_allclose(run.effort("motor"), 0.5 * 9.81 * c - 5.0, rtol=0, atol=1e-8)
    assert_allclose(run.reaction("O2").fx, -0.5 * SPEED**2 * c, rtol=0, atol=1e-8)
    assert_allclose(run.reaction("O2").fy, 9.81 - 0.5 * SPEED**2 * s, rtol=0, atol=1e-8)
    assert np.abs(run.reaction("B").magnitude).max() < 1e-8


def test_through_the_line_against_the_oracle():
    """Off the line everything is as the oracle has it, however the line was passed."""
    machine = parallelogram(0.5)
    machine.add(mbody.Gravity("gravity", y=-9.81), mbody.Force("push", "coupler.B", 8.0, angle=0.7))
    run = mbody.kinetostatics(machine, turn=True, instants=13)
    (note,) = run.notes  # no instant is on the line
    assert "goes on smoothly through 2 change points" in note and not run.doubts
    oracle = Reference(machine)
    for k, t in enumerate(map(float, run.t)):
        angle = 0.5 + SPEED * t
        q = oracle.close(in_line(angle), t)
        v = oracle.velocities(q, t)
        found = oracle.kinetostatics(q, v, oracle.accelerations(q, v, t), t)
        top = max(np.abs(part).max() for part in found["reactions"].values())
        for name, wanted in found["reactions"].items():
            part = run.reaction(name)
            mine = [part.fx[k], part.fy[k], part.torque[k]]
            assert_allclose(mine, wanted, rtol=0, atol=1e-10 * top)
        assert abs(run.effort("motor")[k] - found["efforts"]["motor"]) < 1e-10 * top


def in_line(angle):
    """Mass centres (x, y, θ) of a parallelogram."""
    c, s = math.cos(angle), math.sin(angle)
    coupler = [c + 0.5 * BASE, s, 0.0]
    return np.array([0.5 * c, 0.5 * s, angle, *coupler, BASE + 0.5 * c, 0.5 * s, angle])


# -- redundant rows: three equal cranks -------------------------------------------------------


def three_cranks(start=0.7, mass=1.0):
    machine = mbody.Mechanism("three cranks", ground={f"P{k}": (2.0 * k, 0.0) for k in range(3)})
    machine.add(
        *(makers.bar(f"c{k}", 1.0, mass=mass, guess=start) for k in range(3)),
        mbody.Body(
            "coupler",
            mass=2.0,
            inertia=1.0,
            cg=(2.0, 0.0),
            points={f"Q{k}": (2.0 * k, 0.0) for k in range(3)},
            guess=0.0,
        ),
        *(mbody.Revolute(f"O{k}", f"ground.P{k}", f"c{k}.A") for k in range(3)),
        *(mbody.Revolute(f"A{k}", f"c{k}.B", f"coupler.Q{k}") for k in range(3)),
        mbody.AngleDriver("motor", "c0", ConstantSpeed(start, 3.0)),
    )
    return machine


def three_in_line(angle):
    c, s = math.cos(angle), math.sin(angle)
    cranks = [x for k in range(3) for x in (2.0 * k + 0.5 * c, 0.5 * s, angle)]
    return np.array([*cranks, 2.0 + c, s, 0.0])


@pytest.mark.parametrize("analysis", [mbody.kinetostatics, mbody.statics])
def test_three_cranks(analysis):
    machine = three_cranks()
    machine.add(
        mbody.Gravity("gravity", y=-9.81), mbody.Force("push", "coupler.Q2", 6.0, angle=0.3)
    )
    system = mbody.assemble(machine)
    assert system.rows == system.coordinates + 1
    run = analysis(system, turn=True, instants=13)
    angle = 0.7 + 3.0 * run.t
    oracle, moving = Reference(machine), analysis is mbody.kinetostatics
    flags = {name: np.ones(3, bool) for name in oracle.rows if name != "motor"}
    for k, t in enumerate(map(float, run.t)):
        q = oracle.close(three_in_line(angle[k]), t)
        v = oracle.velocities(q, t) if moving else np.zeros(12)
        a = oracle.accelerations(q, v, t) if moving else np.zeros(12)
        for body in range(4):
            history = run[list(run)[body]]
            mine = [history.x[k], history.y[k], history.angle[k]]
            assert_allclose(mine, q[3 * body : 3 * body + 3], rtol=0, atol=1e-12)
            mine = [history.ax[k], history.ay[k], history.alpha[k]]
            # the proximal term of redundant rows is corrected away
            assert_allclose(mine, a[3 * body : 3 * body + 3], rtol=0, atol=1e-10)
        found = oracle.kinetostatics(q, v, a, t)
        assert found["residual"] < 1e-10
        top = max(np.abs(part).max() for part in found["reactions"].values())
        for name, unique in found["unique"].items():
            flags[name] &= unique
            part = run.reaction(name)
            mine = np.array([part.fx[k], part.fy[k], part.torque[k]])
            # where a reaction is determined there is one answer; the rest is a choice of norm
            where = np.array(part.unique)
            assert_allclose(mine[where], found["reactions"][name][where], rtol=0, atol=1e-10 * top)
        # the motor is no part of the redundancy
        assert abs(run.effort("motor")[k] - found["efforts"]["motor"]) < 1e-10 * top
    assert run.checks.equilibrium < 1e-11 and run.checks.virtual_work < 1e-11
    # of the pins only the torques, which are none, are determined at every instant
    for name, wanted in flags.items():
        assert run.reaction(name).unique == tuple(wanted.tolist()), name


def test_a_redundant_rod_leaves_the_rest_unique():
    """A second rod beside a link: what is elsewhere stays determined, and is what it was."""
    plain = makers.four_bar(1.0, 3.0, 2.0, 3.5, masses=(1.0, 2.0, 3.0), speed=5.0)
    plain.add(mbody.Gravity("gravity", y=-9.81))
    doubled = makers.four_bar(1.0, 3.0, 2.0, 3.5, masses=(1.0, 2.0, 3.0), speed=5.0)
    doubled.add(
        mbody.Gravity("gravity", y=-9.81),
        mbody.Body(
            "twin", points={"A": (0.0, 0.0), "B": (3.0, 0.0)}, guess=doubled["coupler"].guess
        ),
        mbody.Revolute("twin A", "crank.A", "twin.A"),
        mbody.Revolute("twin B", "twin.B", "rocker.B"),
    )
    t = np.linspace(0.0, 1.0, 9)
    one, two = mbody.kinetostatics(plain, t), mbody.kinetostatics(doubled, t)
    for name in ("O2", "O4"):
        a, b = one.reaction(name), two.reaction(name)
        assert b.unique == (True, True, True)
        top = a.magnitude.max()
        assert_allclose([b.fx, b.fy], [a.fx, a.fy], rtol=0, atol=1e-10 * top)
    assert_allclose(two.effort("motor"), one.effort("motor"), rtol=0, atol=1e-10 * top)
    for name in ("A", "B", "twin A", "twin B"):
        assert two.reaction(name).unique == (False, False, True)
    # the rods share what one of them carried
    for k, (near, twin) in enumerate((("A", "twin A"), ("B", "twin B"))):
        both = two.reaction(near).fx + two.reaction(twin).fx
        assert_allclose(both, one.reaction(("A", "B")[k]).fx, rtol=0, atol=1e-10 * top)
        both = two.reaction(near).fy + two.reaction(twin).fy
        assert_allclose(both, one.reaction(("A", "B")[k]).fy, rtol=0, atol=1e-10 * top)
