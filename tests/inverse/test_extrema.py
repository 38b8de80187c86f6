"""Greatest and least values over the whole range, against scans and closed forms."""

import json
import math
import re

import numpy as np
import pytest

import mbody
from mbody import AngleDriver, Body, Mechanism, Revolute, SolveError, Torque, cli, makers, solve_for
from mbody.model.simulation import Question, Unknown
from tests import extrema_scan
from tests.support.cases import first_fast
from tests.support.linkages import held_bar


def reviewed():
    return makers.four_bar(1, 3, 2.5, 3.5, masses=(1, 1, 1), speed=10.0)


@pytest.fixture(scope="module")
def turn():
    """Crank angles and efforts of one turn, 0.05 degrees apart."""
    run = mbody.kinetostatics(reviewed(), turn=True, instants=7201)
    return np.degrees(run["crank"].angle) % 360.0, run.effort("motor")


@pytest.mark.parametrize("bounded", [False, True])
def test_the_greatest_effort_of_a_part_of_a_turn(turn, bounded):
    """Between bounds it is at 301.3 degrees, not at a bound; given as side conditions or bounds."""
    angle, effort = turn
    inside = angle <= 350.0
    if bounded:
        asked = {"motor.value": {"low": "0 deg", "high": "350 deg"}}
        answer = solve_for(reviewed(), asked, greatest="motor.effort")
    else:
        sides = ["crank.angle >= 0 deg", "crank.angle <= 350 deg"]
        answer = solve_for(
            reviewed(), "motor.value", side_conditions=sides, greatest="motor.effort"
        )
    (found,) = answer.solutions
    assert answer.status == "completed" and answer.doubts == ()
    k = effort[inside].argmax()
    assert effort[inside][k] <= found.objective <= effort[inside][k] + 1e-3
    # a parabola leaves 1e-4 degrees of a step of 0.05
    assert found.unknowns["motor.value"] == pytest.approx(angle[inside][k], abs=0.03)
    assert found.binding == ()


def test_an_angle_comes_back_after_a_turn(turn):
    """Without bounds the whole turn is searched, and the place nearest to the start is given."""
    _, effort = turn
    greatest = solve_for(reviewed(), "motor.value", greatest="motor.effort")
    least = solve_for(reviewed(), "motor.value", least="motor.effort")
    assert greatest[0].objective == pytest.approx(effort.max(), abs=1e-3)
    assert least[0].objective == pytest.approx(effort.min(), abs=1e-3)
    for answer in (greatest, least):
        assert abs(answer[0].unknowns["motor.value"] - 60.0) <= 180.0 + 1e-9
        assert any("was searched from" in note for note in answer.notes)


@pytest.mark.slow
def test_a_length_between_side_conditions():
    """The design as it is meets them; the least force is that of a scan of the length."""
    sides = ["rocker.angle >= 60 deg", "rocker.angle <= 170 deg"]
    answer = solve_for(reviewed(), "rocker.B.x", side_conditions=sides, least="O4.force")
    (found,) = answer.solutions
    system, guess = mbody.assemble(reviewed()), {"coupler": 0.6, "rocker": 1.7}
    values = []
    for length in np.linspace(1.6, 3.4, 400):
        run = mbody.kinetostatics(system.with_values({"rocker.B.x": length}), guess=guess)
        guess = {name: float(run[name].angle[0]) for name in guess}
        if 60.0 <= math.degrees(guess["rocker"]) <= 170.0:
            values.append(float(run.reaction("O4").magnitude[0]))
    assert len(values) > 100 and not answer.doubts
    assert found.objective <= min(values) * (1.0 + 1e-12)
    again = mbody.kinetostatics(
        system.with_values({"rocker.B.x": found.unknowns["rocker.B.x"]}), guess=guess
    )
    assert float(again.reaction("O4").magnitude[0]) == pytest.approx(found.objective, rel=1e-9)


@first_fast("seed", range(40, 50), 1)
def test_against_a_scan(seed, monkeypatch):
    """Random machines, unknowns and measures; `python -m tests.extrema_scan` has more of them."""
    monkeypatch.setattr(extrema_scan, "PLACES", 241)
    kind, text, _ = extrema_scan.verdict(extrema_scan.case_of(seed))
    assert kind in ("agrees", "none, rightly", "refused", "doubted"), text


# -- edges ------------------------------------------------------------------------------------


def test_a_value_that_is_only_come_near_to():
    """The rocker turns as far as the shortest coupler lets it, where it points to the crank pin:
    there no velocity is determined. The value is that of the limit, and it is in doubt.
    """
    machine = makers.four_bar(1, 3, 2.5, 3.5)
    unknown = Unknown("coupler.B.x", low=0.5, high=5.0)
    answer = solve_for(machine, unknown, greatest="rocker.angle")
    limit = math.atan2(math.sin(math.pi / 3.0), math.cos(math.pi / 3.0) - 3.5)
    # trials end at pivots of 1e-10 of their diagonal, their square root from the limit
    assert answer[0].objective == pytest.approx(limit, abs=1e-4)
    (doubt,) = answer.doubts
    assert doubt.kind == "incomplete" and "only come near to" in doubt.message
    assert answer.status == f"doubtful: {doubt.message}" and doubt.message in answer.notes


def test_the_command_tells_a_doubt(capsys, tmp_path):
    machine = makers.four_bar(1, 3, 2.5, 3.5)
    machine.questions["most"] = Question(
        Unknown("coupler.B.x", low=0.5, high=5.0), greatest="rocker.angle"
    )
    path = tmp_path / "model.toml"
    mbody.save(machine, path)
    assert cli.main(["solve", str(path), "--json"]) == 1
    case = json.loads(capsys.readouterr().out)["cases"]["most"]
    assert case["status"].startswith("doubtful: ") and case["doubts"][0]["kind"] == "incomplete"
    assert case["doubts"][0]["message"] in case["notes"] and len(case["solutions"]) == 1
    assert cli.main(["solve", str(path)]) == 1
    assert "STATUS   doubtful: " in capsys.readouterr().out


def test_a_force_that_grows_without_bound():
    """Towards a dead centre an effort has no greatest value."""
    machine = makers.four_bar(2, 3, 1.5, 3.5, masses=(1, 1, 1), speed=5.0, start=0.5)
    with pytest.raises(SolveError, match="grows without bound where"):
        solve_for(machine, Unknown("motor.value", low=-0.5, high=3.0), greatest="A.force")


# -- bounds, kinks ----------------------------------------------------------------------------


def test_bounds_of_loads_bind():
    """Linear: the corners of the box, and of the box with a side condition."""
    box = [Unknown("P", low=-2.0, high=3.0), Unknown("Q", low=-1.0, high=5.0)]
    answer = solve_for(held_bar(), box, greatest="O.fy")
    assert answer.straight and answer[0].objective == pytest.approx(3.0, rel=1e-12)
    side = "hold.effort <= 2 N*m"  # P + 2 Q >= −2
    answer = solve_for(held_bar(), box, side_conditions=side, greatest="O.fy")
    assert answer[0].unknowns == pytest.approx({"P": -2.0, "Q": 0.0}, abs=1e-12)
    assert answer[0].binding == (side,)
    with pytest.raises(SolveError, match="beyond its bounds"):
        solve_for(held_bar(), Unknown("P", low=1.0, high=2.0), "hold.effort = 0")


@pytest.mark.parametrize("kink", [3.0, -40.0, 700.0])
def test_a_kink_is_found(kink):
    """|P − kink| is least at the kink, wherever probes of linearity look."""
    unknown = Unknown("P", low=-50.0, high=800.0)
    found = solve_for(held_bar(), unknown, least=f"abs(O.fy + {kink!r} N)")[0]
    assert found.objective == pytest.approx(0.0, abs=1e-6)
    assert found.unknowns["P"] == pytest.approx(kink, abs=1e-6)


def test_two_ranges_of_a_side_condition():
    """F = m r ω² above 50 N on both sides of rest: the better range wins, at its bound."""
    machine = Mechanism("mass")
    machine.add(
        Body("arm", mass=2.0, cg=(0.5, 0.0)),
        Revolute("O", "ground", "arm"),
        AngleDriver("motor", "arm", 0.0),
    )
    unknown = Unknown("motor.rate", low=-20.0, high=20.0)
    side = "O.force >= 50 N"
    edge = math.sqrt(50.0)
    least = solve_for(machine, unknown, side_conditions=side, least="abs(motor.rate + 1 rad/s)")
    assert least[0].unknowns["motor.rate"] == pytest.approx(-edge, rel=1e-12)
    assert least[0].objective == pytest.approx(edge - 1.0, rel=1e-12)
    assert least[0].binding == (side,)


@pytest.mark.slow
def test_a_side_condition_of_rounding_excludes_nothing():
    """A crank of constant speed has an acceleration of rounding, of either sign."""
    engine = makers.slider_crank(0.7, 2.9, masses=(1, 2, 3), speed=9.0)
    for side in ("crank.alpha <= 0", "crank.alpha >= 0"):
        answer = solve_for(engine, "motor.value", side_conditions=side, greatest="guide.fy")
        plain = solve_for(engine, "motor.value", greatest="guide.fy")
        assert answer[0].objective == pytest.approx(plain[0].objective, rel=1e-9)


# -- several unknowns -------------------------------------------------------------------------


def arm():
    machine = Mechanism("arm")
    machine.add(
        Body("one", mass=1.0, points={"A": (1.0, 0.0)}),
        Body("two", mass=1.0, points={"P": (0.8, 0.0)}),
        Revolute("O", "ground", "one"),
        Revolute("A", "one.A", "two"),
        AngleDriver("shoulder", "one", 0.3),
        AngleDriver("elbow", "two", 0.4, relative_to="one"),
    )
    return machine


def test_two_angles():
    """The reach of an arm at a height: the law of Pythagoras."""
    answer = solve_for(
        arm(),
        ["shoulder.value", "elbow.value"],
        side_conditions="two.P.y >= 0.5 m",
        greatest="two.P.x",
    )
    assert answer[0].objective == pytest.approx(math.sqrt(1.8**2 - 0.25), rel=1e-8)


def test_two_loads_that_cancel():
    """P + Q = 0 leaves the pin nothing, and P + 2 Q >= 10 can be met."""
    found = solve_for(
        held_bar(),
        ["P", "Q"],
        side_conditions="hold.effort <= -10 N*m",  # P + 2 Q >= 10
        least="O.force*O.force",
    )
    assert found[0].objective == pytest.approx(0.0, abs=1e-8)


@pytest.mark.parametrize("added", ["", " + 1e9 N"])
def test_climbs_agree_whatever_is_added(added):
    """They end at several values, which 1e9 N more makes no more alike: two of them at the best,
    or fewer, as 1e9 N leaves seven figures less of it.
    """
    angle, length = {"low": 0.0, "high": 6.28}, {"low": 2.6, "high": 3.4}
    found = solve_for(
        makers.four_bar(1, 3, 2, 3.5, masses=(1, 3, 2), speed=10.0),
        {"motor.value": angle, "coupler.B.x": length},
        greatest=f"A.force{added}",
    )
    assert found[0].unknowns["motor.value"] == pytest.approx(180.6228, abs=1e-3)
    (doubt,) = found.doubts
    words = "may be a local one: of 13 climbs from different starts [1-3] end at this value"
    assert re.search(words, doubt.message)


@pytest.mark.slow
def test_what_may_be_local_is_in_doubt_or_greatest():
    """A landscape of several summits: the answer is the greatest, or it says that it may not be."""
    machine = arm()
    measure = "two.P.x*two.P.y + 0.3*one.A.x*(1 m)"
    answer = solve_for(machine, ["shoulder.value", "elbow.value"], greatest=measure)
    a, b = np.meshgrid(np.linspace(0, 2 * math.pi, 721), np.linspace(0, 2 * math.pi, 721))
    x, y = np.cos(a) + 0.8 * np.cos(a + b), np.sin(a) + 0.8 * np.sin(a + b)
    top = float((x * y + 0.3 * np.cos(a)).max())
    assert answer[0].objective >= top - 1e-9 or answer.doubts
    assert answer[0].objective <= top + 1e-3


def test_linear_questions_stay_linear():
    machine = makers.four_bar(1, 3, 2, 3.5, masses=(1, 3, 2), speed=10.0)
    machine.add(Torque("brake", "rocker", value=1.0))
    side = "abs(motor.effort) <= 9 N*m"
    answer = solve_for(machine, "brake", side_conditions=side, greatest="A.fx")
    assert answer.straight and answer[0].binding == (side,)
