"""Motions that begin where branches meet: second order decides, or a rate is required."""

import json
import math
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from mbody import (
    AngleDriver,
    Body,
    Gravity,
    Mechanism,
    Revolute,
    SolveError,
    Torque,
    gallery,
    simulate,
)
from mbody.analysis.dynamics.branch_passage import choose_branch
from mbody.analysis.initial.initial_state import state_of
from mbody.engineering import close_loops
from mbody.files.results import data
from mbody.laws import ConstantSpeed
from mbody.system.assembler import assemble
from tests.driven.test_change_points import three_cranks
from tests.support import folded

TIMES = np.linspace(0.0, 0.3, 31)
#: (lengths, masses, centres, gravity, rate of the crank)
PARALLELOGRAMS = [
    ((1.0, 2.0, 1.0, 2.0), (1.0, 2.0, 1.0), (0.5, 0.5, 0.5), 9.81, 6.0),
    ((0.7, 1.9, 0.7, 1.9), (1.3, 2.0, 0.4), (0.4, 0.6, 0.5), 9.81, -3.0),
    ((1.0, 2.0, 1.0, 2.0), (1.0, 2.0, 1.0), (0.5, 0.5, 0.5), 0.0, 6.0),
    ((1.5, 1.2, 1.5, 1.2), (1.0, 2.0, 3.0), (0.5, 0.4, 0.5), 9.81, 2.0),
    ((0.02, 0.05, 0.02, 0.05), (0.1, 0.2, 0.1), (0.5, 0.5, 0.5), 9.81, 30.0),
]
BRANCHES = {"parallel": folded.parallel, "antiparallel": folded.antiparallel}


def rates_on(angles, rate, theta=0.0):
    """Rates of crank, coupler and rocker."""
    coupler, rocker = angles(theta)
    return {"crank": rate, "coupler": rate * coupler[1], "rocker": rate * rocker[1]}


def assert_moves(run, body, theta, rate, alpha, times=TIMES):
    """1e-8 of the motion; first accelerations too, which limits and no steps give."""
    fast, top = np.abs(rate).max(), np.abs(alpha).max()
    assert_allclose(run[body].angle, theta, rtol=0, atol=1e-8)
    assert_allclose(run[body].omega, rate, rtol=0, atol=1e-8 * max(1.0, fast))
    # accelerations are those of states that are off by 1e-10 or so: where a branch passes another
    # singular position they change by 1e4 times that
    assert_allclose(run[body].alpha, alpha, rtol=0, atol=1e-5 * max(1.0, top))
    assert_allclose(run[body].alpha[0], alpha[0], rtol=0, atol=1e-8 * max(1.0, abs(alpha[0])))
    early = times < 0.05
    assert_allclose(run[body].alpha[early], alpha[early], rtol=0, atol=1e-8 * max(1.0, top))


@pytest.mark.parametrize("branch", BRANCHES)
@pytest.mark.parametrize("case", PARALLELOGRAMS, ids=lambda case: str(case[0][0]))
def test_a_parallelogram_on_either_branch(case, branch):
    lengths, masses, centres, gravity, rate = case
    angles = BRANCHES[branch](lengths)
    machine = folded.four_bar(lengths, masses, centres, gravity)
    rates = rates_on(angles, rate)
    start = {"crank": {"angle": 0.0, "omega": rate}, "coupler": {"omega": rates["coupler"]}}
    run = simulate(folded.asked(machine, start))
    truth = folded.linkage(angles, lengths, masses, centres, gravity)
    theta, omega, alpha = truth.motion(0.0, rate, TIMES)
    assert_moves(run, "crank", theta, omega, alpha)
    rocker = np.array([angles(one)[1][:2] for one in theta])
    assert np.abs(np.exp(1j * run["rocker"].angle) - np.exp(1j * rocker[:, 0])).max() < 1e-8
    assert_allclose(run["rocker"].omega, rocker[:, 1] * omega, rtol=0, atol=1e-7 * abs(rate))
    # forces that have no limit are missing at the first instant, and nothing else is in doubt
    assert {doubt.kind for doubt in run.doubts} <= {"incomplete"}
    size = max(run.energy.size, 1e-12)
    assert np.abs(run.energy.balance).max() < 1e-8 * size


@pytest.mark.parametrize("branch", BRANCHES)
@pytest.mark.parametrize("offset", [1e-9, 1e-8, 1e-7, 1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 0.1, 0.5, 2.0])
def test_a_start_beside_the_line(branch, offset):
    """`offset` [deg]: positions that are closed to rounding do not determine rates there."""
    lengths, rate, theta = (1.0, 2.0, 1.0, 2.0), 6.0, math.radians(offset)
    angles = BRANCHES[branch](lengths)
    coupler, rocker = angles(theta)
    rates = rates_on(angles, rate, theta)
    machine = folded.four_bar(lengths, guess=(theta, coupler[0], rocker[0]))
    start = {
        "crank": {"angle": theta, "omega": rate},
        "coupler": {"angle": coupler[0], "omega": rates["coupler"]},
        "rocker": {"angle": rocker[0], "omega": rates["rocker"]},
    }
    run = simulate(folded.asked(machine, start))
    truth = folded.linkage(angles, lengths)
    theta, omega, alpha = truth.motion(theta, rate, TIMES)
    assert_allclose(run["crank"].angle, theta, rtol=0, atol=1e-8)
    assert_allclose(run["crank"].omega, omega, rtol=0, atol=1e-8 * np.abs(omega).max())
    assert_allclose(run["coupler"].omega[0], rates["coupler"], rtol=0, atol=1e-9)
    # beside the position the first acceleration is a polynomial's, continued to its beginning
    assert_allclose(run["crank"].alpha[0], alpha[0], rtol=0, atol=2e-7)
    assert {doubt.kind for doubt in run.doubts} <= {"incomplete"}


def test_a_kite_on_either_branch():
    lengths, rate = (1.0, 2.0, 2.0, 1.0), 6.0
    angles = folded.kite(lengths)
    machine = folded.four_bar(lengths)
    # the crank's rate alone decides: on the other branch the crank rests
    run = simulate(folded.asked(machine, {"crank": {"angle": 0.0, "omega": rate}}))
    truth = folded.linkage(angles, lengths)
    assert_moves(run, "crank", *truth.motion(0.0, rate, TIMES))
    start = {"crank": {"angle": 0.0, "omega": 0.0}, "rocker": {"omega": 5.0}}
    run = simulate(folded.asked(machine, start))
    # coupler and rocker are one pendulum about C: 3 kg, centres 1 and inertias m 2²/12 each
    pendulum = folded.Bodies(
        lambda phi: [(3.0, 1.0, folded.arm(1.0, (phi, 1.0, 0.0)), (phi, 1.0, 0.0))]
    )
    assert_moves(run, "rocker", *pendulum.motion(0.0, 5.0, TIMES))
    assert_allclose(run["crank"].angle, 0.0, rtol=0, atol=1e-9)
    with pytest.raises(SolveError, match=r"crank\.omega = 0 or 6\.66667 rad/s"):
        simulate(folded.asked(machine, {"crank": {"angle": 0.0}, "rocker": {"omega": 5.0}}))


@pytest.mark.parametrize(
    "turned", [(0,), (1,), (0, 0), (0, 1), (1, 0), (1, 0, 1), (0, 0, 0), (0, 0, 0, 0, 0)]
)
def test_windows_on_every_branch(turned):
    truth, ratios = folded.in_row(turned)
    rate = 2.0 / np.abs(ratios).max()
    start = {f"c{k}": {"angle": 0.0, "omega": rate * ratio} for k, ratio in enumerate(ratios)}
    run = simulate(folded.asked(folded.windows(len(turned)), start))
    assert_moves(run, "c0", *truth.motion(0.0, rate, TIMES))
    assert {doubt.kind for doubt in run.doubts} <= {"incomplete"}


@pytest.mark.parametrize("count", [1, 2, 3, 5])
def test_windows_of_which_one_rate_is_told(count):
    """Each window doubles the branches: by hand ω of the next post is ω, or −3 ω."""
    with pytest.raises(SolveError, match=f"{2**count} of them") as caught:
        start = {"c0": {"angle": 0.0, "omega": 1.0}}
        simulate(folded.asked(folded.windows(count), start))
    last = " or ".join(f"{(-3.0) ** n:g}" for n in range(count + 1))
    assert f"c{count}.omega = {last} rad/s" in str(caught.value)


def test_three_cranks_have_one_branch():
    """Redundant for good and singular: only a translation meets both conditions."""
    made = three_cranks(0.0)
    machine = Mechanism("three", ground=made.ground.points)
    machine.add(*made.bodies, *made.joints, Gravity("gravity", y=-folded.G))
    run = simulate(folded.asked(machine, {"c0": {"angle": 0.0, "omega": 4.0}}))
    # three rods of 1 kg about their ends, and 2 kg on a circle of radius 1
    one = (1.0, 1.0 / 12.0)
    truth = folded.Bodies(
        lambda angle: [
            *[(*one, folded.arm(0.5, (angle, 1.0, 0.0)), (angle, 1.0, 0.0))] * 3,
            (2.0, 0.0, folded.arm(1.0, (angle, 1.0, 0.0)), (0.0, 0.0, 0.0)),
        ]
    )
    for name in ("c0", "c1", "c2"):
        assert_moves(run, name, *truth.motion(0.0, 4.0, TIMES))
    assert_allclose(run["coupler"].angle, 0.0, rtol=0, atol=1e-9)
    with pytest.raises(SolveError, match=r"coupler\.omega can be 0 rad/s, not 1"):
        simulate(
            folded.asked(machine, {"c0": {"angle": 0.0, "omega": 4.0}, "coupler": {"omega": 1.0}})
        )


def test_rows_that_repeat_for_good_are_no_singular_start():
    machine = three_cranks(0.7)
    start = close_loops(machine)
    assert (
        start.regularization
        and choose_branch(start.system, start, state_of(start.system, start)) is None
    )


# -- what is refused ---------------------------------------------------------------------------

LENGTHS = (1.0, 2.0, 1.0, 2.0)
CRANK = {"crank": {"angle": 0.0, "omega": 6.0}}


# -- rest --------------------------------------------------------------------------------------


def least_constraint(loads, directions, mass):
    """Of directions u the one with the most aᵀMa, a = u (uᵀf)/(uᵀMu), and that a."""
    best = max(directions, key=lambda u: (u @ loads) ** 2 / (u @ mass @ u))
    return best * (best @ loads) / (best @ mass @ best)


@pytest.mark.parametrize("torques", [(0.0, 0.0), (5.0, -30.0), (0.0, -40.0), (3.0, 40.0)])
def test_rest_goes_out_with_the_least_constraint(torques):
    """By hand: of the rates (crank, rocker), mass matrix and torques of the flat linkage."""
    machine = folded.four_bar(LENGTHS)
    machine.add(
        *(Torque(f"T {n}", n, value=t) for n, t in zip(("crank", "rocker"), torques, strict=True))
    )
    # slow at first, so that its first part is as precise as 1e-9
    run = simulate(folded.asked(machine, {"crank": {"angle": 0.0}}, rtol=1e-9))
    # the coupler's centre goes at half the sum, and it turns at half the difference, of the rates
    mass = np.diag([1.0 / 3.0, 1.0 / 3.0])
    mass += 2.0 * 0.25 * np.ones((2, 2)) + 2.0 / 3.0 * np.array([[0.25, -0.25], [-0.25, 0.25]])
    loads = np.array(torques) - folded.G * (0.5 + 1.0)
    directions = [np.array([1.0, 1.0]), np.array([1.0, -3.0])]
    wanted = least_constraint(loads, directions, mass)
    assert_allclose([run["crank"].alpha[0], run["rocker"].alpha[0]], wanted, rtol=1e-10)
    assert {doubt.kind for doubt in run.doubts} - {"incomplete"} == {"singular"}
    assert run.status.startswith("doubtful: it begins in a singular position at t = 0 s, where 2")
    assert run.doubts[0].t == 0.0 and "crank" in run.doubts[0].elements
    # and it goes on along that branch: energy is kept
    assert np.abs(run.energy.balance).max() < 1e-7 * run.energy.size
    ratio = run["rocker"].omega[1] / run["crank"].omega[1]
    assert ratio == pytest.approx(wanted[1] / wanted[0], abs=0.05)


# -- forces ------------------------------------------------------------------------------------


def test_reactions_have_limits_where_nothing_pulls_off_the_branch():
    """The coupler of a parallelogram only goes in a circle: half of it hangs on either pin."""
    start = {**CRANK, "coupler": {"omega": 0.0}}
    run = simulate(folded.asked(folded.four_bar(LENGTHS), start))
    coupler, pin = run["coupler"], run.reaction("A")
    assert pin.on == "coupler"
    assert_allclose(pin.fx, coupler.ax, rtol=0, atol=1e-7)  # of 36 N: rounding is magnified 1e3
    assert_allclose(pin.fy, coupler.ay + folded.G, rtol=0, atol=1e-7)
    assert run.notes == ()


def test_reactions_without_a_limit_are_not_given():
    start = {**CRANK, "coupler": {"omega": -12.0}}
    run = simulate(folded.asked(folded.four_bar(LENGTHS), start))
    (doubt,) = run.doubts
    assert doubt.kind == "incomplete" and doubt.t == 0.0 and "A" in doubt.elements
    assert doubt.message.startswith("the reactions grow without bound towards the singular")
    pin = run.reaction("A").magnitude
    assert np.isnan(pin[0]) and np.isfinite(pin[1:]).all()
    told = data(run)["reactions"]["A"]["fx"]
    assert told[0] is None and math.isfinite(told[1])
    assert "NaN" not in json.dumps(data(run), allow_nan=False)
    assert "F12" in str(run)
    # they grow as one over the time: twice as near, twice as much
    near = simulate(folded.asked(folded.four_bar(LENGTHS), start, until=1e-4, instants=3))
    one, two = near.reaction("A").magnitude[1:]
    assert one / two == pytest.approx(2.0, rel=1e-2)


# -- ways to follow ----------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("method", "more", "tolerance"),
    [
        ("dopri5", {}, 1e-6),
        ("radau5", {}, 1e-6),
        ("generalized-alpha", {"step": 1e-3}, 1e-4),
        ("rattle4", {"step": 1e-3}, 1e-6),
    ],
)
def test_every_method_goes_out_along_the_branch(method, more, tolerance):
    """Tolerances: the errors that these methods have at their settings from any start."""
    angles = folded.parallel(LENGTHS)
    start = {**CRANK, "coupler": {"omega": 0.0}}
    machine = folded.asked(folded.four_bar(LENGTHS), start, rtol=1e-9)
    run = simulate(machine, method=method, **more)
    theta, _, alpha = folded.linkage(angles, LENGTHS).motion(0.0, 6.0, TIMES)
    assert_allclose(run["crank"].angle, theta, rtol=0, atol=tolerance)
    assert run["crank"].alpha[0] == pytest.approx(alpha[0], abs=1e-8)


@pytest.mark.parametrize("branch", BRANCHES)
def test_a_driver_in_a_singular_position(branch):
    """Kinematics by hand: the driver leads, the branch gives the rest."""
    angles = BRANCHES[branch](LENGTHS)
    machine = folded.four_bar(LENGTHS)
    machine.add(AngleDriver("motor", "crank", ConstantSpeed(0.0, 6.0)))
    rate = rates_on(angles, 6.0)["coupler"]
    run = simulate(folded.asked(machine, {"coupler": {"angle": 0.0, "omega": rate}}))
    assert_allclose(run["crank"].angle, 6.0 * TIMES, rtol=0, atol=1e-10)
    for name, place in (("coupler", 0), ("rocker", 1)):
        found = np.array([angles(6.0 * t)[place] for t in TIMES])
        assert np.abs(np.exp(1j * run[name].angle) - np.exp(1j * found[:, 0])).max() < 1e-8
        assert_allclose(run[name].alpha[0], 36.0 * found[0, 2], rtol=0, atol=1e-8)
    with pytest.raises(SolveError, match=r"follow the drivers: .*coupler\.omega = 0 or -12 rad/s"):
        simulate(folded.asked(machine, {}))
    with pytest.raises(SolveError, match=r"with the drivers, coupler\.omega can be 0 or -12 rad/s"):
        simulate(folded.asked(machine, {"coupler": {"angle": 0.0, "omega": 5.0}}))


def test_a_loose_pendulum_beside_does_not_disturb():
    """Another mechanism in the same model, with a free motion that has no rate: it rests."""
    machine = folded.four_bar(LENGTHS)
    machine.add(
        Body("bob", mass=1.0, inertia=0.1, cg=(0.5, 0.0), guess=0.3), Revolute("P", "ground", "bob")
    )
    start = {**CRANK, "coupler": {"omega": -12.0}}
    run = simulate(folded.asked(machine, start))
    truth = folded.linkage(folded.antiparallel(LENGTHS), LENGTHS)
    assert_moves(run, "crank", *truth.motion(0.0, 6.0, TIMES))
    assert abs(run["bob"].omega[0]) < 1e-12
    assert run["bob"].alpha[0] == pytest.approx(-9.81 * 0.5 * math.cos(0.3) / 0.35, rel=1e-9)


def test_two_folded_linkages_of_which_one_rests():
    """The rates of one determine its branch; the other goes out with the least constraint."""
    machine = folded.four_bar(LENGTHS)
    other = folded.four_bar(LENGTHS)
    both = Mechanism("both", ground=machine.ground.points)
    both.add(*(element for element in machine if element.name != "gravity"))
    for body in other.bodies:
        both.add(replace(body, name=f"{body.name}2"))
    both.add(
        Revolute("O2", "ground.O", "crank2"),
        Revolute("A2", "crank2.E", "coupler2"),
        Revolute("B2", "coupler2.E", "rocker2.E"),
        Revolute("C2", "ground.C", "rocker2"),
        Gravity("gravity", y=-folded.G),
    )
    start = {**CRANK, "coupler": {"omega": -12.0}, "crank2": {"angle": 0.0, "omega": 0.0}}
    start["coupler2"] = {"omega": 0.0}
    run = simulate(folded.asked(both, start, until=0.1, instants=3))
    times = np.linspace(0.0, 0.1, 3)
    truth = folded.linkage(folded.antiparallel(LENGTHS), LENGTHS).motion(0.0, 6.0, times)
    assert_allclose(run["crank"].angle, truth[0], rtol=0, atol=1e-8)
    fall = folded.linkage(folded.parallel(LENGTHS), LENGTHS).motion(0.0, 0.0, times)
    assert_allclose(run["crank2"].alpha[0], fall[2][0], rtol=1e-9)
    assert_allclose(run["crank2"].angle, fall[0], rtol=0, atol=1e-8)
    assert {doubt.kind for doubt in run.doubts} - {"incomplete"} == {"singular"}


def test_the_gallery_of_windows_flat_and_at_rest():
    """Rods as long as the bases: the branches are ω₀ = 0 or all alike; all fall together."""
    machine = gallery.load("n_windows_2")
    run = simulate(
        folded.asked(machine, {f"c{n}": {"angle": 0.0} for n in range(3)}, until=0.1, rtol=1e-9)
    )
    assert {doubt.kind for doubt in run.doubts} - {"incomplete"} == {"singular"}
    alphas = [run[f"c{n}"].alpha[0] for n in range(3)]
    assert_allclose(alphas, alphas[0], rtol=1e-10)
    assert np.abs(run.energy.balance).max() < 1e-7 * run.energy.size
    assert assemble(machine).rows == run.system.rows


# -- rough guesses -----------------------------------------------------------------------------


def guessed_aside(count):
    """Equal cranks side by side on one bar, guessed 40 deg beside the line in which they begin."""
    machine = Mechanism("cranks", ground={f"O{n}": (float(n), 0.0) for n in range(count)})
    rod = {"mass": 1.0, "inertia": 0.02, "cg": (0.15, 0.0), "guess": "40 deg"}
    machine.add(
        *(Body(f"c{n}", points={"O": (0, 0), "A": (0.3, 0)}, **rod) for n in range(count)),
        Body(
            "bar",
            mass=5.0,
            inertia=2.0,
            cg=(0.5 * (count - 1), 0.0),
            points={f"A{n}": (float(n), 0.0) for n in range(count)},
            guess=(0.2, 0.2, 0.0),
        ),
        *(Revolute(f"O{n}", f"ground.O{n}", f"c{n}.O") for n in range(count)),
        *(Revolute(f"A{n}", f"c{n}.A", f"bar.A{n}") for n in range(count)),
        Gravity("gravity", y=-9.81),
    )
    return machine


@pytest.mark.parametrize(
    ("count", "told"),
    [
        (2, {"c1": {"omega": 3.0}}),
        (2, {"c1": {"omega": -3.0 * 1.3 / 0.7}}),  # about the pole of the antiparallel crank
        (3, {}),
        (3, {"c2": {"omega": 3.0}}),
    ],
)
def test_a_rough_guess_leads_to_the_singular_position_itself(count, told):
    """Corrections from aside end some 1e-6 rad beside it, on a branch that rounding chooses and
    with a gap of 1e-12: valid rates were refused, and exact lengths said to differ.
    """
    start = {"c0": {"angle": 0.0, "omega": 3.0}, **told}
    run = simulate(folded.asked(guessed_aside(count), start))
    for n in range(count):
        assert run[f"c{n}"].angle[0] == pytest.approx(0.0, abs=1e-12)
    for body, rates in told.items():
        assert run[body].omega[0] == pytest.approx(rates["omega"], rel=1e-9)
    assert run.energy.error < 1e-6
