"""All rest positions of one and of two free motions: scans, closed forms, and other processors."""

import json
import math
import os
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from mbody import (
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
    equilibrium,
    makers,
    to_toml,
)
from mbody.analysis.equilibria import search
from mbody.cli import main
from mbody.engineering import equilibrium_curve
from mbody.gallery import load
from mbody.model.loads import CentrifugalField
from tests import rest_scan
from tests.rest_scan import judge, summary
from tests.support.cases import first_fast
from tests.support.rest_linkages import FAMILIES
from validation.porter_governor import build as porter

UPRIGHT = Marker("ground", (0.0, 0.0), 0.5 * math.pi)
g = 9.81
#: Four-bars of which a position was missed by a walk in steps of 0.2 rad, two of them within a
#: step, and others as they come.
FOUR_BARS = [1368, 1420, 1467, *range(12)]
#: The same of two freedoms: one of which a spread of starts missed a position, and one each of the
#: three families.
SURFACES = [50, 0, 2, 4]
#: The same of which a position was missed: one above another that was found, on the other sheet of
#: a four-bar; beside a disc around which a spring turns, and within it; where a four-bar bends so
#: sharply that neighbours seemed nearer than they were.
HIDDEN = [112, 149, 110, 301]


def pendulum(*more, guess=-1.5, spread="point"):
    """2 kg, half a metre below its pin."""
    machine = Mechanism("pendulum")
    body = Body("rod", mass=2.0, inertia=0.0, cg=(0.5, 0.0), guess=guess, spread=spread)
    machine.add(body, Revolute("O", "ground", "rod"), Gravity("gravity", y=-g), *more)
    return machine


def upright(body, x=0.0):
    return Marker(body, (x, 0.0), 0.5 * math.pi)


def rope(masses=(2.0, 3.0), apart=2.0, height=2.0, *more):
    """Two guided weights on one rope of 4 m over two points: |y_a − h| + |y_b − h| = 4."""
    half = 0.5 * apart
    machine = Mechanism("rope", ground={"L": (-half, height), "R": (half, height)})
    machine.add(
        Body("a", mass=masses[0], guess=(-half, height - 2.0, 0.0)),
        Body("b", mass=masses[1], guess=(half, height - 2.0, 0.0)),
        Prismatic("left", upright("ground", -half), upright("a")),
        Prismatic("right", upright("ground", half), upright("b")),
        LengthCoupling(
            "rope",
            [
                CouplingTerm(1.0, distance=("ground.L", "a")),
                CouplingTerm(1.0, distance=("ground.R", "b")),
            ],
            4.0,
        ),
        Gravity("gravity", y=-g),
        *more,
    )
    return machine


# -- one free motion -----------------------------------------------------------------------------


def test_four_bars_agree_with_a_scan_of_their_energy():
    found = summary([judge(seed, 1) for seed in FOUR_BARS])
    assert found["agreed"] == len(FOUR_BARS) and not found["noted"], found


@pytest.mark.parametrize("part", [1e-2, 1e-4, 1e-6, 1e-8])
def test_two_positions_that_are_near_each_other(part):
    """m g l cos θ = T with T = (1 − part) m g l: two rests at θ = ± √(2 part) nearly."""
    found = equilibrium(pendulum(Torque("push", "rod", value=g * (1.0 - part))))
    lean = math.acos(1.0 - part)
    theta = [math.remainder(float(one["rod"].angle[0]), 2.0 * math.pi) for one in found]
    assert [one.stability for one in found] == ["stable", "unstable"]
    # the drive has rounding of 1e-15 and the slope √(2 part)
    assert_allclose(theta, [-lean, lean], atol=1e-14 / lean + 1e-12)
    assert found.doubts == ()
    with pytest.raises(SolveError, match="no rest position of 'pendulum' was met"):
        equilibrium(pendulum(Torque("push", "rod", value=g * (1.0 + part))))


def test_a_position_that_touches():
    """At T = m g l both are one, which is neutral."""
    (one,) = equilibrium(pendulum(Torque("push", "rod", value=g)))
    assert one.stability == "neutral"
    # a double root, to half the digits
    assert_allclose(math.remainder(float(one["rod"].angle[0]), 2.0 * math.pi), 0.0, atol=1e-5)


def test_a_spring_whose_ends_meet_on_the_way():
    """l = 2 |sin θ/2|: rest at l = l₀ and opposite; where the ends meet the force jumps."""
    machine = Mechanism("ring")
    machine.add(
        Body("rod", mass=1.0, points={"T": (1.0, 0.0)}, guess=0.8),
        Revolute("O", "ground", "rod"),
        Spring("s", "rod.T", Marker("ground", (1.0, 0.0)), stiffness=50.0, free_length=0.5),
    )
    found = equilibrium(machine)
    theta = [math.remainder(float(one["rod"].angle[0]), 2.0 * math.pi) for one in found]
    lean = 2.0 * math.asin(0.25)
    assert_allclose(np.sort(np.abs(theta)), [lean, lean, math.pi], atol=1e-10)
    assert sorted(one.stability for one in found) == ["stable", "stable", "unstable"]
    assert found.doubts == ()


@pytest.mark.parametrize("stiffness", np.linspace(20.0, 115.0, 20))
def test_weights_on_a_rope_are_drawn_through_their_pulleys(stiffness):
    """On each side of the square |y_a − h| + |y_b − h| = 4 the energy is a parabola in the distance
    d of b, ∓ m_a g (4 − d) ± m_b g d + k/2 (d − 1)², with one rest if that lies on the side.
    """
    machine = rope()
    machine.add(Spring("spring", "ground.R", "b", stiffness=stiffness, free_length=1.0))
    hand = []
    for a, b in ((-1, -1), (-1, 1), (1, -1), (1, 1)):
        d = 1.0 + (2.0 * a - 3.0 * b) * g / stiffness
        if 0.0 < d < 4.0:
            hand.append((2.0 + a * (4.0 - d), 2.0 + b * d))
    found = equilibrium(machine)
    assert {one.stability for one in found} == {"stable"}
    mine = [(float(one["a"].y[0]), float(one["b"].y[0])) for one in found]
    assert_allclose(sorted(mine), sorted(hand), atol=1e-10)
    assert_allclose(mine[0], hand[0], atol=1e-10)  # the nearest to the guess
    assert sum("a prescribed distance is zero" in note for note in found.notes) == 4


@pytest.mark.parametrize(
    ("masses", "apart"), [((1.7, 2.6), 1.5), ((1.0, 2.0), 2.0), ((3.0, 0.5), 0.7)]
)
def test_a_rope_without_a_rest_position_says_where_it_is_driven(masses, apart):
    """The heavier weight draws the other one into its pulley."""
    with pytest.raises(SolveError, match=r"drive it from both sides to .* a distance is zero"):
        equilibrium(rope(masses, apart, 0.0))


def test_a_wound_spring_says_that_turns_further_on_are_not_sought():
    """k θ = −m g l cos θ: beyond θ = m g l/k nothing rests, and one turn ahead is searched."""
    soft = pendulum(TorsionSpring("spring", "rod", stiffness=0.2), guess=0.3)
    found = equilibrium(soft)
    (doubt,) = found.doubts
    assert doubt.kind == "incomplete" and "whole turns apart" in doubt.message
    assert doubt.elements == ("rod",)
    assert found.status == f"doubtful: {doubt.message}" and found.notes == (doubt.message,)
    assert found.data()["doubts"][0]["message"] == doubt.message
    stiff = equilibrium(pendulum(TorsionSpring("spring", "rod", stiffness=8.0), guess=0.3))
    assert stiff.doubts == () and stiff.status == "completed" and len(stiff) == 1


def test_a_block_on_a_long_rail():
    """Nothing is left out as far as a thousand model lengths, and a slope is run down."""
    machine = Mechanism("rail")
    machine.add(Body("block", mass=2.0), Prismatic("rail", "ground", "block"))
    machine.add(Spring("s", Marker("ground", (70.0, 1.0)), "block", 3.0, free_length=5.0))
    found = equilibrium(machine)
    x = sorted(float(one["block"].x[0]) for one in found)
    assert_allclose(x, [70.0 - math.sqrt(24.0), 70.0, 70.0 + math.sqrt(24.0)], atol=1e-9)
    assert found.doubts == ()


def test_the_command_ends_with_1_where_positions_may_be_missing(tmp_path, capsys):
    machine, end = Mechanism("chain"), "ground"
    for n in range(3):
        machine.add(makers.bar(f"l{n}", 1.0, mass=1.0, ends=("A", "B"), guess=-1.2))
        machine.add(Revolute(f"j{n}", end, f"l{n}.A"))
        end = f"l{n}.B"
    machine.add(Gravity("gravity", y=-g))
    model = tmp_path / "chain.toml"
    model.write_text(to_toml(machine), encoding="utf-8")
    assert main(["equilibrium", str(model), "--json"]) == 1
    told = json.loads(capsys.readouterr().out)
    assert told["status"].startswith("doubtful: 3 free motions")
    assert [doubt["kind"] for doubt in told["doubts"]] == ["incomplete"]
    assert main(["equilibrium", "porter_governor", "--free", "theta", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["doubts"] == []


# -- two free motions ----------------------------------------------------------------------------


@pytest.mark.slow
def test_linkages_of_two_freedoms_agree_with_a_scan_of_their_energy():
    found = summary([judge(seed, 2) for seed in SURFACES])
    assert found["agreed"] == len(SURFACES) and not found["noted"], found


@pytest.mark.slow
@pytest.mark.parametrize("seed", HIDDEN)
def test_positions_that_charts_hid(seed):
    verdict = judge(seed, 2)
    assert not (verdict.missing or verdict.extra or verdict.error or verdict.noted), verdict


@pytest.mark.parametrize("seed", [2, 3])
def test_a_position_that_is_missing_is_reported_by_parity(monkeypatch, seed):
    """On a rail, whose surface has two borders that loads drive away from, and on a torus."""
    whole = search.surface_roots

    def with_one_less(cover, polish):
        roots = whole(cover, polish)
        return replace(roots, equilibria=roots.equilibria[:-1])

    machine = FAMILIES[2][seed % 3](np.random.default_rng([2, seed])).machine
    assert equilibrium(machine).doubts == ()
    monkeypatch.setattr(search, "surface_roots", with_one_less)
    for other in ("_try", "_relax"):  # which may find it too
        monkeypatch.setattr(search.EquilibriumSearch, other, lambda *_: None)
    (doubt,) = equilibrium(machine).doubts
    assert doubt.kind == "incomplete" and "odd number of rest positions" in doubt.message


def test_a_scan_says_how_far_it_came(monkeypatch, capsys):
    monkeypatch.setattr(rest_scan, "EVERY", 2)
    rest_scan.run(range(4), 1)
    assert capsys.readouterr().err.splitlines() == [
        "2 of 4: 0 disagree [], 0 noted",
        "4 of 4: 0 disagree [], 0 noted",
    ]


# -- crossings of branches -----------------------------------------------------------------------


def whirling(speed, *more):
    return pendulum(CentrifugalField("field", UPRIGHT, speed=speed), *more)


@first_fast("start", np.linspace(10.0, 6.5, 8), 3)
def test_a_pitchfork_is_told_and_placed_from_wherever_it_is_reached(start):
    """Along the branch that leans, ω turns round in the crossing as it does at a fold."""
    lean = equilibrium_curve(
        whirling(1.0), "field.speed", (float(start), 0.0), start={"rod": -0.2}, points=200
    )
    theta = lean["rod"].angle + 0.5 * math.pi
    assert not lean.folds and lean.kinds == ("pitchfork",)
    # ω² is quadratic in the angle there
    assert_allclose(lean.values[lean.crossings[0]], math.sqrt(g / 0.5), rtol=1e-12)
    assert_allclose(theta[lean.crossings[0]], 0.0, atol=1e-9)
    assert_allclose(np.cos(theta) * lean.values**2, g / 0.5, rtol=1e-11)
    assert_allclose(theta[-1], -theta[0], atol=1e-9)


@first_fast("torque", [1e-2, 1e-4, 1e-6], 1)
def test_a_perturbed_pitchfork_is_a_fold_on_one_branch_and_nothing_on_the_other(torque):
    """m g l sin φ − m l² ω² sin φ cos φ = T has no crossing, but a fold."""
    machine = whirling(1.0, Torque("push", "rod", value=torque))
    whole = equilibrium_curve(machine, "field.speed", (10.0, 0.0), start={"rod": -0.2})
    assert not whole.folds and not whole.crossings and whole.values[-1] == 0.0
    other = equilibrium_curve(machine, "field.speed", (10.0, 0.0), start={"rod": -math.pi + 0.2})
    assert not other.crossings and other.values[-1] == 10.0
    (fold,) = other.folds
    phi, omega = other["rod"].angle[fold] + 0.5 * math.pi, other.values[fold]
    # ∂/∂φ of both sides; ω is found to rounding, φ to half the digits
    assert_allclose(omega**2 * math.cos(2.0 * phi), g / 0.5 * math.cos(phi), rtol=1e-6)


@pytest.mark.parametrize("x", [-0.7, -1.0, -2.0])
def test_a_transcritical_point(x):
    """A slanting spring keeps a bar upright under a load: P = k x²/(1 + x²), on both branches."""
    machine = Mechanism("prop")
    length = math.hypot(x, 1.0)
    machine.add(
        Body("bar", mass=1.0, points={"T": (1.0, 0.0)}, guess=0.5 * math.pi),
        Revolute("O", "ground", "bar"),
        Spring("s", "bar.T", Marker("ground", (x, 0.0)), stiffness=100.0, free_length=length),
        Force("P", "bar.T", 0.0, angle=-0.5 * math.pi),
    )
    least = 100.0 * x * x / (1.0 + x * x)
    ways = {"bar": 0.5 * math.pi}, {"bar": 0.5 * math.pi + 0.3}
    for span, start in zip(((0.0, 2.0 * least), (2.0 * least, 0.0)), ways, strict=True):
        curve = equilibrium_curve(machine, "P.value", span, start=start)
        assert curve.kinds == ("transcritical",) and not curve.folds
        assert_allclose(curve.values[list(curve.crossings)], [least], rtol=1e-9)


def test_two_crossings_of_two_free_motions():
    """Rods in a field: the hanging position is left at both roots of det(K − ω² M) = 0."""
    machine = Mechanism("two rods")
    machine.add(
        Body("a", mass=3.0, cg=(1.0, 0.0), points={"B": (1.0, 0.0)}, spread="point", guess=-1.5),
        Body("b", mass=1.0, cg=(1.0, 0.0), spread="point", guess=-1.5),
        Revolute("O", "ground", "a"),
        Revolute("B", "a.B", "b"),
        Gravity("gravity", y=-g),
        CentrifugalField("field", UPRIGHT, speed=1.0),
    )
    start = {"a": -0.5 * math.pi, "b": -0.5 * math.pi}
    curve = equilibrium_curve(machine, "field.speed", (0.0, 10.0), start=start)
    squares = np.linalg.eigvals(np.linalg.solve([[4.0, 1.0], [1.0, 1.0]], np.diag([4.0 * g, g])))
    assert_allclose(curve.values[list(curve.crossings)], np.sqrt(np.sort(squares)), rtol=1e-10)
    assert curve.kinds == ("pitchfork", "pitchfork")
    assert curve.data()["kinds"] == ["pitchfork", "pitchfork"]


def governor(radius, sleeve=18.0, force=0.0):
    """Porter's, of 6 kg balls and 0.3 m arms: where it hangs, branches of its motion meet."""
    machine = porter(radius, sleeve=sleeve, held=False)
    machine.add(Force("push", "arm_r.B", force))
    return machine


@first_fast(
    ("radius", "sleeve", "span"),
    [
        (0.25, 18.0, (20.0, 5.0)),  # the branch that leans, through to the other side
        (0.29, 18.0, (20.0, 5.0)),
        (0.25, 18.0, (12.0, 5.0)),
        (0.25, 40.0, (25.0, 5.0)),
        (0.25, 0.0, (20.0, 4.0)),
        (0.02, 18.0, (5.0, 20.0)),  # the branch that hangs: two stiffnesses vanish at once
        (0.02, 18.0, (20.0, 5.0)),
    ],
    1,
)
def test_a_crossing_where_the_motion_branches_too(radius, sleeve, span):
    """ω² = (m + M) g / (m l): more is free there than nearby."""
    hangs = radius < 0.1
    start = {"arm_r": 0.0, "arm_l": 0.0, "link_r": 0.0, "link_l": 0.0} if hangs else None
    machine = governor(radius, sleeve)
    curve = equilibrium_curve(machine, "field.speed", span, start=start)
    lifts = math.sqrt((6.0 + sleeve) * g / (6.0 * 0.3))
    # a polynomial of eight points around it errs by 1e-11, corrections by 1e-12 over the slope
    assert_allclose(curve.values[list(curve.crossings)], [lifts], rtol=1e-10)
    assert curve.kinds == ("multiple",) and not curve.folds
    (n,) = curve.crossings
    assert abs(curve["arm_r"].angle[n]) < 1e-9
    leans = curve["arm_r"].angle[[0, -1]]
    assert np.abs(leans).max() < 1e-9 if hangs else leans[0] * leans[1] < -0.1
    # no crawling: steps are at most a tenth of a span, and only the last is cut
    assert np.diff(curve.arclength)[:-1].min() > 1e-3
    assert curve.status == "completed" and curve.doubts == ()


@first_fast("force", [1.0, 1e-3], 1)
def test_branches_that_a_small_force_parts_do_not_cross(force):
    """A push outwards: the branch on its side goes on to low speeds, and crosses nothing."""
    curve = equilibrium_curve(governor(0.25, force=force), "field.speed", (20.0, 5.0))
    assert not curve.crossings and not curve.folds
    assert (curve["arm_r"].angle > 0.0).all() and curve.values[-1] == 5.0
    # half the sleeve hangs on each arm: moments about the pivots of both arms
    theta, speed = curve["arm_r"].angle, curve.values
    moment = (
        2.0 * 6.0 * speed**2 * 0.3 * np.sin(theta) * np.cos(theta)
        + force * np.cos(theta)
        - 2.0 * 24.0 * g * np.sin(theta)
    )
    # at low speeds the arms hang within 3e-6 rad of a singular position: rows that are closed to
    # 1e-13 leave some 1e-11 rad between them, times the 470 N·m/rad of the sleeve
    assert_allclose(moment, 0.0, atol=1e-7)


def test_a_curve_that_ends_before_its_span_is_in_doubt():
    curve = equilibrium_curve(governor(0.25), "field.speed", (20.0, 5.0), points=5)
    (doubt,) = curve.doubts
    assert doubt.kind == "incomplete" and "5 points were not enough" in doubt.message
    assert curve.status == f"doubtful: {doubt.message}" and curve.notes == (doubt.message,)
    told = json.loads(json.dumps(curve.data(), allow_nan=False))
    assert (told["status"], told["notes"]) == (curve.status, list(curve.notes))
    assert told["doubts"] == [doubt.data()]
    assert doubt.message[:20] in str(curve)


# -- other processors ----------------------------------------------------------------------------

PROGRAM = """
import json
import numpy as np
from mbody import Spring, equilibrium
from mbody.engineering import equilibrium_curve
from mbody.gallery import load
from tests.support.rest_linkages import four_bar
from tests.equilibria.test_rest_positions import rope, whirling

told = []
for stiffness in (20.0, 55.0, 110.0):
    machine = rope()
    machine.add(Spring("spring", "ground.R", "b", stiffness=stiffness, free_length=1.0))
    told += [round(float(one["a"].y[0]), 8) for one in equilibrium(machine)]
found = equilibrium(four_bar(np.random.default_rng([1, 1368])).machine)
told += [(one.stability, round(float(one["crank"].angle[0]), 7)) for one in found]
lean = equilibrium_curve(whirling(1.0), "field.speed", (8.7931, 0.0), start={"rod": -0.2})
told += [lean.folds, lean.kinds, round(float(lean.values[lean.crossings[0]]), 9)]
print(json.dumps(told))
"""


@pytest.mark.slow
def test_the_same_on_every_processor():
    """Kernels of dense algebra for other processors round otherwise; null spaces turn with them."""
    told = set()
    for kind in ("Prescott", "Haswell"):
        own = {**os.environ, "OPENBLAS_CORETYPE": kind, "PYTHONPATH": os.pathsep.join(sys.path)}
        done = subprocess.run(
            [sys.executable, "-c", PROGRAM], capture_output=True, text=True, env=own, check=False
        )
        assert done.returncode == 0, done.stderr
        told.add(done.stdout)
    assert len(told) == 1


def test_reactions_at_a_singular_position_met_by_rounding_are_doubted():
    """Upright, the lift has more free motions than anywhere else: beside it, constraints that
    rounding leaves bear the platform by millions of times its weight.
    """
    found = equilibrium(load("scissor_lift"), free=["cylinder"])
    reactions = [float(np.max(one.reaction("weld").magnitude)) for one in found]
    pins = [float(np.max(one.reaction("M1").magnitude)) for one in found]
    vast = any(pin > 1e5 * weight for pin, weight in zip(pins, reactions, strict=True))
    said = any("in a singular position but for rounding" in one.message for one in found.doubts)
    assert said == vast
