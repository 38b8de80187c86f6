"""Mobility: Grübler's count and the truth, redundant rows by joint, free motions in words."""

import json
import math

import numpy as np
import pytest
from numpy.testing import assert_allclose

import mbody
from mbody import (
    AngleCoupling,
    AngleDriver,
    Body,
    CouplingTerm,
    Distance,
    Fixed,
    LengthCoupling,
    Marker,
    Mechanism,
    ModelError,
    Prismatic,
    Revolute,
    SolveError,
    mobility,
)
from mbody.engineering import close_loops
from mbody.engines.oracle import Reference
from mbody.makers import bar
from mbody.summaries.text_table import WIDTH
from tests.errors.test_errors import says
from tests.support.linkages import random_linkage
from tests.system.test_sizes import chain
from validation.grubler_paradox import build as three_cranks
from validation.norton_fourbar import build


def seen(report):
    """What holds of every report: a narrow sheet, data for JSON, and counts that agree."""
    text = str(report)
    assert all(len(line) <= WIDTH for line in text.splitlines()), max(text.splitlines(), key=len)
    assert all(line == line.rstrip() for line in text.splitlines())
    assert "nan" not in text
    data = json.loads(json.dumps(report.data()))
    assert data["driven"]["freedom"] == report.freedom
    for count, motions in (
        (report.of_joints, report.motions),
        (report.driven, report.driven_motions),
    ):
        assert count.gruebler == 3 * report.bodies - count.rows
        if motions is not None:
            assert count.freedom == count.gruebler + count.redundant == len(motions)
            assert len({motion.leader for motion in motions}) <= len(motions)
    return text


def without_drivers(machine):
    made = Mechanism(machine.name, ground=machine.ground.points, units=machine.units, g=machine.g)
    made.add(*machine.bodies, *machine.joints)
    return made


def rows(report):
    return report.of_joints.gruebler, report.of_joints.rank, report.of_joints.freedom


def moves(machine, motion):
    """The rates of a motion keep every row of the joints, by the oracle's Φ_q."""
    q = close_loops(machine)
    oracle = Reference(without_drivers(machine))
    n3 = 3 * len(machine.bodies)
    v = np.zeros((n3 // 3, 3))
    for name, rate in motion.rates.items():
        v[oracle.index[name]] = rate
    G = oracle.phi_q(q.record.table(slice(0, n3))[0], 0.0)
    assert np.abs(G @ v.reshape(-1)).max() < 1e-9 * np.abs(v).max()


# -- mechanisms of textbooks ------------------------------------------------------------------


def test_a_driven_four_bar():
    report = mobility(build())
    text = seen(report)
    assert (report.bodies, report.joints, report.drivers, report.loops) == (3, 4, 1, 1)
    assert rows(report) == (1, 8, 1)
    assert report.freedom == 0 and report.driven_motions == () and report.redundant == {}
    assert "FREE MOTIONS, drivers fixed: none" in text
    (motion,) = report.motions
    run = mbody.kinematics(build())
    ratio = [run[name].omega[0] / run["crank"].omega[0] for name in ("coupler", "rocker")]
    assert motion.leader == "crank"
    assert [motion.rates[name][2] for name in ("coupler", "rocker")] == pytest.approx(ratio)
    assert motion.words == (
        "crank turns about O2, coupler and rocker follow "
        f"(crank 1 : coupler {ratio[0]:.4g} : rocker {ratio[1]:.4g} rad/s)"
    )
    moves(build(), motion)
    assert not report.notes


def test_a_four_bar_without_a_driver():
    report = mobility(without_drivers(build()))
    text = seen(report)
    assert (report.freedom, report.drivers) == (1, 0)
    assert report.driven_motions == report.motions
    assert "drivers fixed" not in text and "FREE MOTIONS\n" in text


def test_the_driven_link_leads():
    """The motor of a four-bar on its rocker makes the rocker the leader."""
    machine = without_drivers(build())
    machine.add(AngleDriver("motor", "rocker", 1.8))
    assert mobility(machine).motions[0].words.startswith("rocker turns about O4, crank and coupler")


def test_a_slider_crank():
    machine = mbody.makers.slider_crank(1.0, 3.0)
    report = mobility(machine)
    seen(report)
    (motion,) = report.motions
    # velocity of the slider at 60° by hand: −a sin θ (1 + a cos θ / √(l² − a² sin² θ))
    s, c = math.sin(math.pi / 3.0), 0.5
    speed = -s * (1.0 + c / math.sqrt(9.0 - s * s))
    assert motion.rates["slider"][:2] == pytest.approx((speed, 0.0), abs=1e-9)
    assert motion.words == (
        f"crank turns about O, rod follows (crank 1 : rod {-c / math.sqrt(9.0 - s * s):.4g} rad/s)"
        f"; slider slides along x ({speed:.4g} m/s)"
    )
    moves(machine, motion)


def test_a_five_bar_has_two_motions():
    machine = Mechanism("five-bar", ground={"O": (0.0, 0.0), "Q": (2.0, 0.0)})
    machine.add(
        *(bar(n, x, guess=y) for n, x, y in (("a", 1.0, 2.0), ("b", 1.5, 0.7), ("c", 1.5, 2.4))),
        bar("d", 1.0, guess=1.0),
        Revolute("O", "ground.O", "a.A"),
        Revolute("A", "a.B", "b.A"),
        Revolute("B", "b.B", "c.B"),
        Revolute("C", "c.A", "d.B"),
        Revolute("Q", "d.A", "ground.Q"),
    )
    report = mobility(machine)
    seen(report)
    assert rows(report) == (2, 10, 2) and report.loops == 1
    first, second = report.motions
    assert first.words.startswith("a turns about O, b and c follow")
    assert second.words.startswith("d turns about Q, b and c follow")
    assert "d" not in first.rates and "a" not in second.rates
    for motion in report.motions:
        moves(machine, motion)


def test_three_parallel_cranks_move_against_gruebler():
    report = mobility(three_cranks())
    text = seen(report)
    assert rows(report) == (0, 11, 1) and report.freedom == 0
    assert report.loops == 2
    assert report.redundant == {f"{x}{k}": 1 for k in (1, 2, 3) for x in "OA"}
    assert not report.of_joints.singular and not report.notes
    assert "1 row can be removed and nothing is set free, from O1, A1, O2, A2, O3 or A3" in text
    (motion,) = report.motions
    assert "crank1 turns about O1, crank2 and crank3 follow" in motion.words
    # the coupler goes on a circle: at 60° across the cranks, along 150°
    assert "coupler moves along 150° without turning (1 m/s)" in motion.words
    moves(three_cranks(), motion)


def test_what_can_be_removed_can_be():
    """Without the pin that holds the middle crank twice a row, what is left still has freedom 1."""
    machine = without_drivers(three_cranks())
    kept = Mechanism("kept", ground=machine.ground.points)
    kept.add(*machine.bodies, *(j for j in machine.joints if j.name != "A2"))
    middle = next(b for b in machine.bodies if b.name == "crank2")
    place = middle.at(1.0, 0.0)
    # one row in place of the two of the pin: along the coupler
    kept.add(Distance("A2", "coupler.A1", place, length=2.0))
    assert mobility(kept).of_joints.freedom == 1
    assert mobility(kept).redundant == {}


def test_a_loose_body():
    machine = Mechanism("loose")
    machine.add(Body("b", mass=1.0, cg=(0.3, 0.2)))
    report = mobility(machine)
    seen(report)
    assert rows(report) == (3, 0, 3) and report.loops == 0
    assert [motion.words for motion in report.motions] == [
        "b turns about its mass centre (0.3, 0.2) (1 rad/s)",
        "b slides along x (1 m/s)",
        "b slides along y (1 m/s)",
    ]
    assert report.notes == ("not joined to the ground: 'b'",)


@pytest.mark.slow
def test_many_loose_parts_are_one_note():
    machine = Mechanism("heap")
    for n in range(300):
        machine.add(Body(f"b{n}", mass=1.0, inertia=1.0))
    (note,) = mobility(machine).notes
    assert note.startswith("300 parts are not joined to the ground, those of 'b0', 'b1', ")
    assert "and 292 more: join a body of each to the ground" in note


def test_loops_of_parts_that_are_not_joined():
    """Two four-bars, one of them floating: joints − bodies, and one more for each loose part."""
    machine = without_drivers(mbody.makers.four_bar(1, 3, 2, 3.5))
    first = mbody.makers.four_bar(1, 3, 2, 3.5)
    base = Body("base", points={"O2": (0.0, 0.0), "O4": (3.5, 0.0)}, guess=(5.0, 0.0, 0.0))
    machine.add(base)
    for body in first.bodies:
        machine.add(Body(f"{body.name}2", points=body.points, guess=body.guess))
    for joint in first.joints:
        ends = ["base" if m.body == "ground" else f"{m.body}2" for m in (joint.i, joint.j)]
        places = [Marker(e, m.point) for e, m in zip(ends, (joint.i, joint.j), strict=True)]
        machine.add(Revolute(f"{joint.name}2", *places))
    report = mobility(machine)
    seen(report)
    assert report.loops == 2 and report.of_joints.freedom == 1 + 4
    assert "not joined to the ground: 'base', 'crank2', 'rocker2', 'coupler2'" in report.notes


def coupled(*couplings):
    """Two wheels on pins, a block that nothing but a rope may hold, and what couples them."""
    machine = Mechanism("hoist", ground={"A": (0.0, 0.0), "B": (3.0, 0.0), "hook": (1.0, 4.0)})
    machine.add(
        *(Body(name, mass=1.0, inertia=1.0) for name in "ab"),
        Body("block", mass=2.0, guess=(1.0, -2.0, 0.0)),
        *(Revolute(name.upper(), f"ground.{name.upper()}", name) for name in "ab"),
        *couplings,
    )
    return mobility(machine)


def test_couplings_join_bodies_and_close_loops():
    """A rope holds a block and closes nothing; a belt, and a second one, close a loop each."""
    falls = CouplingTerm(2.0, distance=("ground.hook", "block"))
    rope = LengthCoupling("rope", [falls, CouplingTerm(0.5, angle="a")], 12.0)
    belts = [
        AngleCoupling(f"belt{n}", [CouplingTerm(1.0, angle="a"), CouplingTerm(-1.0, angle="b")])
        for n in (1, 2)
    ]
    assert coupled().notes == coupled(belts[0]).notes == ("not joined to the ground: 'block'",)
    for couplings, loops, freedom in (((), 0, 5), (belts[:1], 1, 4), ([rope], 0, 4)):
        report = coupled(*couplings)
        assert (report.loops, report.of_joints.freedom) == (loops, freedom)
    report = coupled(*belts, rope)
    assert (report.loops, report.couplings, report.of_joints.freedom) == (2, 3, 3)
    assert report.notes == () and set(report.redundant) == {"belt1", "belt2"}
    assert "2 joints, 3 couplings, 0 drivers, 2 independent loops" in seen(report)


def test_a_double_pendulum():
    machine = Mechanism("double pendulum", ground={"O": (0.0, 0.0)})
    machine.add(
        bar("upper", 1.0, guess=0.0),
        bar("lower", 1.0, guess=1.0),
        Revolute("O", "ground.O", "upper.A"),
        Revolute("A", "upper.B", "lower.A"),
    )
    report = mobility(machine)
    seen(report)
    assert rows(report) == (2, 4, 2) and report.loops == 0
    assert [motion.words for motion in report.motions] == [
        "upper turns about O (1 rad/s); lower moves along y without turning (1 m/s)",
        "lower turns about A (1 rad/s)",
    ]


def test_a_plate_on_rods_turns_about_no_joint():
    machine = Mechanism("plate", ground={"A": (0.0, 0.0), "B": (2.0, 0.0)})
    plate = Body("plate", points={"P": (0.0, 0.0), "Q": (1.0, 0.0)}, guess=(0.5, 2.0, 0.0))
    machine.add(
        plate,
        Distance("left", "ground.A", "plate.P", length=math.hypot(0.5, 2.0)),
        Distance("right", "ground.B", "plate.Q", length=math.hypot(0.5, 2.0)),
    )
    report = mobility(machine)
    seen(report)
    # the rods meet at (1, 4), by symmetry
    assert report.motions[0].words == "plate turns about (1, 4) at this instant (1 rad/s)"


# -- redundant and singular -------------------------------------------------------------------


def test_two_guides_share_two_rows():
    up = math.pi / 3.0
    machine = Mechanism("lift", ground={"A": (0.0, 0.0), "B": (1.0, 0.0)})
    lift = Body("lift", points={"A": (0.0, 0.0), "B": (1.0, 0.0)})
    machine.add(lift)
    for name, point in (("left", "A"), ("right", "B")):
        ground = machine.ground.at(point, angle=up)
        machine.add(Prismatic(name, ground, lift.at(point, angle=up)))
    report = mobility(machine)
    text = seen(report)
    assert rows(report) == (-1, 2, 1) and report.loops == 1
    assert report.redundant == {"left": 2, "right": 2}
    assert "2 rows can be removed" in text and "left (up to 2) or right (up to 2)" in text
    assert report.motions[0].words == "lift slides along 60° (1 m/s)"


def test_an_overconstrained_structure():
    """A triangle of three bars on two ground pins, and one more bar across it."""
    machine = Mechanism("truss", ground={"A": (0.0, 0.0), "B": (2.0, 0.0), "C": (1.0, 0.0)})
    place = {"A": (0.0, 0.0), "B": (2.0, 0.0), "C": (1.0, 0.0)}
    apex = Body("apex", guess=(1.0, 2.0, 0.0))
    machine.add(apex, Fixed("seat", Marker("ground", (1.0, 2.0)), "apex"))
    for name, (x, y) in place.items():
        machine.add(Distance(f"rod {name}", f"ground.{name}", "apex", math.hypot(1.0 - x, 2.0 - y)))
    report = mobility(machine)
    seen(report)
    assert rows(report) == (-3, 3, 0)
    assert report.of_joints.redundant == 3 and report.motions == ()
    # the weld's x and y can go: two rods hold them; its torque cannot
    assert report.redundant == {"seat": 2, "rod A": 1, "rod B": 1, "rod C": 1}


def test_a_change_point():
    report = mobility(mbody.makers.four_bar(1, 3, 1, 3, start=0.0))
    text = seen(report)
    assert report.of_joints.singular and rows(report) == (1, 7, 2)
    assert report.of_joints.rank_nearby == 8
    assert any("change point" in note and "7 here and 8 nearby" in note for note in report.notes)
    assert "at this position" in text


def test_away_from_the_change_point_it_is_none():
    report = mobility(mbody.makers.four_bar(1, 3, 1, 3, start=0.4))
    assert not report.of_joints.singular and report.redundant == {} and not report.notes


def dead_centre():
    """Crank 1 and coupler 3 in line, the rocker drives: law of cosines."""
    at = math.pi - math.acos((3.5**2 + 2.0**2 - 4.0**2) / (2.0 * 3.5 * 2.0))
    lean = math.asin(2.0 * math.sin(at) / 4.0)
    machine = without_drivers(mbody.makers.four_bar(1, 3, 2, 3.5))
    machine.add(AngleDriver("motor", "rocker", at))
    return machine, {"crank": lean, "coupler": lean, "rocker": at}


def test_a_dead_centre():
    machine, guess = dead_centre()
    report = mobility(machine, guess=guess)
    seen(report)
    assert report.driven.singular and not report.of_joints.singular
    assert (report.driven.rank, report.driven.rank_nearby) == (8, 9) and report.freedom == 1
    assert any("dead centre" in note and "'motor'" in note for note in report.notes)
    assert report.driven_motions[0].words.startswith("crank turns about O2, coupler follows")
    assert "rocker" not in report.driven_motions[0].rates


def test_a_shaky_structure():
    machine = Mechanism("toggle", ground={"O": (0.0, 0.0), "Q": (2.0, 0.0)})
    machine.add(
        bar("a", 1.0, guess=0.0),
        bar("b", 1.0, guess=0.0),
        Revolute("O", "ground.O", "a.A"),
        Revolute("A", "a.B", "b.A"),
        Revolute("Q", "b.B", "ground.Q"),
    )
    report = mobility(machine)
    seen(report)
    assert rows(report) == (0, 5, 1)
    assert any("infinitesimal" in note for note in report.notes)


def test_a_driver_that_repeats():
    machine = Mechanism("welded")
    machine.add(Body("b"), Fixed("weld", "ground", "b"), AngleDriver("motor", "b", 0.0))
    report = mobility(machine)
    seen(report)
    assert (report.driven.redundant, report.of_joints.redundant) == (1, 0)
    assert any("'motor'" in note and "remove 1" in note for note in report.notes)


@pytest.mark.parametrize("seed", [3, 11])
def test_random_linkages_have_one_freedom(seed):
    machine, _ = random_linkage(seed, 3, sliders=True, extras=True)
    report = mobility(machine)
    seen(report)
    assert (report.of_joints.freedom, report.freedom) == (1, 0)
    assert report.redundant == {} and report.motions[0].leader == "L1"
    moves(machine, report.motions[0])
    # the rates are those of kinematics at unit speed
    run = mbody.kinematics(machine)
    for name, rate in report.motions[0].rates.items():
        h = run[name]
        assert_allclose(
            np.array([h.vx[0], h.vy[0], h.omega[0]]) / run["L1"].omega[0], rate, atol=1e-8
        )


# -- sizes and bad input ----------------------------------------------------------------------


def test_a_long_chain():
    report = mobility(chain(60))
    seen(report)
    assert rows(report) == (60, 120, 60)
    assert report.motions[0].words.startswith("b0 turns about j0 (1 rad/s); b1, b2, b3, b4 and 55")
    assert report.motions[-1].words == "b59 turns about j59 (1 rad/s)"


def test_what_cannot_be_analysed():
    with says(ModelError, "takes a Mechanism or a System, not 3"):
        mobility(3)
    with says(ModelError, "t is nan"):
        mobility(build(), math.nan)
    with says(ModelError, "one time, not 2"):
        mobility(build(), [0.0, 1.0])
    with says(ModelError, "no element 'rod'"):
        mobility(build(), guess={"rod": 1.0})
    with says(SolveError, "loops do not close", "smallest gap"):
        mobility(mbody.makers.four_bar(1, 1, 1, 4))


@pytest.mark.parametrize(("second", "law"), [("angle", 0.5), ("angle", 0.7), ("none", 0.0)])
def test_drivers_without_a_joint(second, law):
    """A drawing that has a motor before its first pin: x, y stay free, a second motor repeats."""
    machine = Mechanism("a link and motors")
    machine.add(Body("link", points={"A": (0.0, 0.0), "B": (1.0, 0.0)}))
    machine.add(AngleDriver("m", "link", 0.5))
    if second == "none":
        report = mobility(machine)
        assert (report.freedom, report.of_joints.freedom) == (2, 3)
        return
    machine.add(AngleDriver("n", "link", law))
    if law == 0.5:
        report = mobility(machine)
        assert (report.freedom, report.driven.redundant, report.of_joints.freedom) == (2, 1, 3)
        assert "remove 1 of them" in seen(report)
    else:
        with says(SolveError, "driver 'n'", "0.7 rad"):
            mobility(machine)
