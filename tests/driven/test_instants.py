"""Instants requested by values of a driver, against its law."""

import math

import numpy as np
import pytest
from numpy.testing import assert_allclose

import mbody
from mbody import makers
from mbody.analysis.driven.driven import analyse_at
from mbody.laws import (
    Cam,
    ConstantAcceleration,
    ConstantSpeed,
    Dwell,
    Harmonic,
    Polynomial,
    Rise,
    Table,
)
from mbody.model.simulation import Instants
from tests.errors.test_errors import says

ROUNDED = 2.3e-16


def driven(law, **more):
    """A four-bar whose crank follows a law; a crank-rocker."""
    plain = makers.four_bar(1, 3, 2.5, 3.5, start=0.5, **more)
    made = mbody.Mechanism("m", ground=plain.ground.points)
    made.add(*plain.bodies, *plain.joints, mbody.AngleDriver("motor", "crank", law))
    return made


def at(law, values, name="crank"):
    return analyse_at(driven(law), "kinematics", Instants(at={name: values}))


SPEED, CHANGE = 25.0, -40.0  # turns back after 0.625 s and 7.8125 rad


@pytest.mark.parametrize("name", ["crank", "motor"])
def test_where_a_constant_acceleration_is(name):
    """t from the quadratic: ways of 0 … 2π from the beginning, in any order, in any unit."""
    wanted = np.array([2.0, 0.6, 6.7, 0.5, 0.4 + 2 * math.pi, 0.4, -1.0, 9.0])
    law = ConstantAcceleration(0.5, SPEED, CHANGE)
    run = at(law, wanted.tolist(), name)
    way = np.mod(wanted - 0.5, 2 * math.pi)
    way[3] = 0.0
    t = (SPEED - np.sqrt(SPEED**2 + 2 * CHANGE * way)) / -CHANGE
    # the closed form loses the digits of way against the speed: 30 roundings
    assert_allclose(run.t, t, atol=30 * ROUNDED)
    assert_allclose(run["crank"].angle, 0.5 + way, atol=1e-14)
    assert_allclose(run["crank"].omega, SPEED + CHANGE * t, rtol=1e-13)
    assert_allclose(run["crank"].alpha, CHANGE)
    texts = at(
        ConstantAcceleration(0.5, SPEED, CHANGE), [f"{v!r} rad" for v in wanted.tolist()], name
    )
    np.testing.assert_array_equal(texts.t, run.t)
    one = at(law, "114.59155902616465 deg", name)
    assert len(one) == 1 and one.t[0] == pytest.approx(t[0], rel=1e-14)


@pytest.mark.parametrize(
    ("law", "value", "t", "rate"),
    [
        # gently: f' = f'' = 0 at t = 0, or for a while; by the polynomials of each law
        (Rise("3-4-5", 1.0, 0.0, 2.0, 0.5), 1.0, 1.0, 1.875 / 2.0),
        (Rise("3-4-5", -1.0, 0.0, 2.0, 0.5), 0.0, 1.0, -1.875 / 2.0),
        (Rise("parabolic", 1.0, 3.0, 2.0, 0.5), 0.75, 3.0 + math.sqrt(0.5), math.sqrt(0.5)),
        (Rise("cycloidal", 1.0, 1.0, 2.0, 0.5), 1.0, 2.0, 1.0),
        (Polynomial([0.5, 0.0, 0.0, 1.0]), 1.5, 1.0, 3.0),
        (Polynomial([0.5, 0.0, 0.0, -1.0]), 0.0, 0.5 ** (1 / 3), -3 * 0.5 ** (2 / 3)),
        (lambda t: 0.5 + t**3, 1.5, 1.0, 3.0),
        ("0.5 + (1 - cos(t))^2", 1.5, math.pi / 2, 2.0),
        (Harmonic(0.5, 1.0, 2.0), 1.0, math.pi / 12, math.sqrt(3.0)),
        (Harmonic(0.5, 1.0, 2.0, math.pi), 0.0, math.pi / 12, -math.sqrt(3.0)),
        (Table([0, 1, 2, 3], [0.5, 1.5, 2.5, 3.5]), 2.0, 1.5, 1.0),
        (Cam([Dwell(1.0), Rise("3-4-5", 1.0, 0.0, 2.0, 0.5), Rise("3-4-5", -1.0, 0.0, 1.0)], 5.0),
         1.0, 2.0, 1.875 / 2.0),
    ],
)  # fmt: skip
def test_rates_follow_the_law(law, value, t, rate):
    run = at(law, value)
    # a Python function is differenced: to 1e-9 of its size
    loose = callable(law) and not isinstance(law, mbody.laws.Law)
    assert run.t[0] == pytest.approx(t, rel=1e-9 if loose else 1e-14)
    assert run["crank"].angle[0] == pytest.approx(value, abs=1e-9 if loose else 1e-14)
    assert run["crank"].omega[0] == pytest.approx(rate, rel=1e-6 if loose else 1e-13)


def arm(first, second):
    """Two bars, each driven by its own motor."""
    made = mbody.Mechanism("arm", parameters={"q": "30 deg"})
    made.add(mbody.Body("a", points={"P": (1.0, 0)}), mbody.Body("b"))
    made.add(mbody.Revolute("O", "ground", "a"), mbody.Revolute("P", "a.P", "b"))
    made.add(mbody.AngleDriver("m1", "a", first), mbody.AngleDriver("m2", "b", second))
    return made


MOVING, OTHER = ConstantSpeed(0.1, 1.0), ConstantSpeed(0.2, 2.0)


def of_arm(wanted, first=MOVING, second=OTHER):
    run = analyse_at(arm(first, second), "kinematics", Instants(at=wanted))
    return run.t.tolist(), run["a"].angle.tolist(), run["b"].angle.tolist()


def test_two_drivers():
    t, a, b = of_arm({"m1": [1.1, 0.6]})
    assert_allclose([t, a, b], [[1.0, 0.5], [1.1, 0.6], [2.2, 1.2]], rtol=1e-14)
    assert_allclose(of_arm({"a": 1.1, "b": 2.2}), np.array([[1.0], [1.1], [2.2]]), rtol=1e-14)
    # at any turn: 8.2 rad after 4 s
    assert_allclose(of_arm({"m1": 4.1, "m2": 8.2 - 2 * math.pi})[0], [4.0], rtol=1e-14)
    for wanted, words in (
        ({"m1": 1.1, "m2": 2.1}, ("by its law 'm2' is at 2.2 when 'm1' is where",)),
        ({"m1": [1.1, 1.2], "m2": [2.1, 1.0, 1.0]}, ("there are 2 of 'm1' and 3 of 'm2'",)),
        ({"m1": 1.1, "a": 1.2}, ("'m1', 'a' are one driver: name it once",)),
        ({"m1": 1.1, "t": 2.0}, ("give t or values of drivers, not both",)),
        ({"m3": 1.1}, ("there is no driver 'm3' (there are: 'm1', 'm2')",)),
        ({"m1": "3 mm"}, ("'m1': '3 mm' is a length (m), where an angle",)),
        ({"t": "3 mm"}, ("'t': '3 mm' is a length (m), where a time",)),
        ({"m1": "zzz"}, ("'m1': there is no parameter 'zzz'",)),
    ):
        with says(mbody.ModelError, *words):
            of_arm(wanted)


def test_a_cylinder():
    """A DistanceDriver on an arm: the law of cosines says its angle, the law its time."""
    made = mbody.Mechanism("m", ground={"C": (3.0, 0.0)}, units="mm-N-s")
    made.add(
        mbody.Body("arm", points={"A": (2.0, 0.0)}, guess=1.0), mbody.Revolute("O", "ground", "arm")
    )
    made.add(mbody.DistanceDriver("cylinder", "ground.C", "arm.A", ConstantSpeed(2.0, 0.5)))
    run = analyse_at(made, "kinetostatics", Instants(at={"cylinder": [2.5, "3 mm", 0.3e1]}))
    assert_allclose(run.t, [1.0, 2.0, 2.0], rtol=1e-14)
    length = np.array([2.5, 3.0, 3.0])
    assert_allclose(np.cos(run["arm"].angle), (4.0 + 9.0 - length**2) / 12.0, rtol=1e-13)
    assert_allclose(run["arm"].omega, length * 0.5 / (6.0 * np.sin(run["arm"].angle)), rtol=1e-12)
    with says(mbody.ModelError, "'cylinder': '3 deg' is an angle (rad), where a length"):
        analyse_at(made, "kinematics", Instants(at={"cylinder": "3 deg"}))
    with says(mbody.ModelError, "'cylinder' does not come there by its law"):
        analyse_at(made, "kinematics", Instants(at={"cylinder": 1.5}))


@pytest.mark.parametrize("analysis", ["kinematics", "kinetostatics", "statics"])
def test_times_are_taken_as_they_are_asked_for(analysis):
    made = driven(ConstantSpeed(0.5, 2.0))
    run = analyse_at(made, analysis, Instants(at={"t": [0.3, "100 ms", 0.3, "-0.2 s", 0]}))
    assert run.t.tolist() == [0.3, 0.1, 0.3, -0.2, 0.0]
    assert_allclose(run["crank"].angle, 0.5 + 2.0 * run.t, rtol=1e-14)
    verb = {
        "kinematics": mbody.kinematics,
        "kinetostatics": mbody.kinetostatics,
        "statics": mbody.statics,
    }[analysis]
    for n, t in enumerate(run.t):
        alone = verb(made, t=[0.0, t]) if t else verb(made)
        # another way there: closed to 1e-12 both times
        assert_allclose(run["rocker"].angle[n], alone["rocker"].angle[-1], atol=1e-11)


def by_circles(theta, side):
    """The rocker's angle where its circle meets the coupler's, left or right of the diagonal."""
    a = np.exp(1j * theta)
    way = 3.5 - a
    along = 0.5 * (1.0 + (3.0**2 - 2.5**2) / abs(way) ** 2)
    b = a + way * (along + 1j * side * np.sqrt(9.0 / abs(way) ** 2 - along**2))
    return np.angle(b - 3.5)


@pytest.mark.parametrize(("crossed", "side"), [(False, 1), (True, -1)])
@pytest.mark.parametrize("law", [ConstantSpeed(0.5, 2.0), 0.5], ids=["moving", "resting"])
def test_the_branch_is_followed_from_the_beginning(crossed, side, law):
    """Guesses say the branch at t = 0; half a turn on they would say another."""
    wanted = [3.5, 5.9, 1.0, 4.2, 2.2]
    run = analyse_at(driven(law, crossed=crossed), "kinematics", Instants(at={"crank": wanted}))
    expected = by_circles(np.array(wanted), side)
    apart = np.remainder(run["rocker"].angle - expected + math.pi, 2 * math.pi) - math.pi
    assert_allclose(apart, 0.0, atol=1e-11)  # a sweep's last correction and the loops' condition


def test_questions_of_a_file():
    text = (
        '[bodies.crank]\n[joints]\nO = { revolute = ["ground", "crank"] }\n[drivers.motor]\n'
        'angle = "crank"\nlaw = { constant_speed = { value = "0.5 rad", speed = 2 } }\n'
    )
    for head, table, expected in (
        ("", 'at = { crank = [40, "1 rad"] }', [math.radians(40), 1.0]),
        ('angle = "rad"\n', 'at = { motor = [0.7, "40 deg"] }', [0.7, math.radians(40)]),
        ("", 'at = { t = ["50 ms", 0.1] }', [0.6, 0.7]),
    ):
        made = mbody.from_toml(f"{head}{text}\n[ask]\n{table}")
        assert_allclose(analyse_at(made, "kinematics")["crank"].angle, expected, rtol=1e-13)
        again = mbody.from_toml(mbody.to_toml(made))
        assert again == made
        np.testing.assert_array_equal(
            analyse_at(again, "kinematics").t, analyse_at(made, "kinematics").t
        )
