"""Measures against the histories that they name, and the instants that are asked for."""

import math

import numpy as np
import pytest
from numpy.testing import assert_allclose

import mbody
from mbody import (
    AngleDriver,
    Body,
    CoordinateDriver,
    DistanceDriver,
    Gravity,
    Measure,
    Mechanism,
    ModelError,
    Prismatic,
    Revolute,
    Spring,
    from_toml,
    kinematics,
    kinetostatics,
    polar,
    statics,
    to_toml,
)
from mbody.analysis.driven.requests import asked
from mbody.engineering import close_loops
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
from mbody.makers import makers
from mbody.model.study import Instants
from mbody.quantities.units import name_of
from mbody.solution.measures import measured
from tests.test_errors import says

ROUNDED = 2.3e-16
T = np.linspace(0.0, 0.4, 5)


def machine(**more):
    """A four-bar in inches, with a coupler point and parameters."""
    plain = makers.four_bar(1, 3, 2.5, 3.5, masses=(1, 2, 3), speed=4.0, units="in-lbf-s")
    made = Mechanism(
        "measured",
        units="in-lbf-s",
        ground=plain.ground.points,
        parameters={"l": "1 ft", "n": 2.0, "w": "4 rad/s"},
        **more,
    )
    coupler = Body(
        "coupler", mass=2.0, inertia=1.5, cg=(1.5, 0.2),
        points={"A": (0, 0), "B": (3, 0), "P": polar(2.0, 0.4)}, guess=plain["coupler"].guess,
    )  # fmt: skip
    made.add(plain["crank"], coupler, plain["rocker"], *plain.joints, *plain.drivers)
    made.add(Gravity("gravity", y=-386.0), Spring("s", "ground.O4", "coupler.P", stiffness=2.0))
    return made


RUN = kinetostatics(machine(), t=T)
IN = 0.0254
LBF = 4.4482216152605


def rates():
    return RUN.driven("motor")[1]


# -- measures ---------------------------------------------------------------------------------

HISTORIES = [
    *((f"crank.{key}", lambda k=key: getattr(RUN["crank"], k)) for key in
      ("x", "y", "angle", "vx", "vy", "omega", "ax", "ay", "alpha")),
    *((f"coupler.P.{key}", lambda k=key: getattr(RUN.point("coupler.P"), k)) for key in
      ("x", "y", "vx", "vy", "ax", "ay")),
    *((f"B.{key}", lambda k=key: getattr(RUN.reaction("B"), k)) for key in ("fx", "fy", "torque")),
    ("B.force", lambda: np.hypot(RUN.reaction("B").fx, RUN.reaction("B").fy)),
    ("ground.O4.x", lambda: np.full(5, 3.5)),
    ("ground.x", lambda: np.zeros(5)),
    ("motor.effort", lambda: RUN.effort("motor")),
    ("motor.rate", lambda: np.full(5, 4.0)),
    ("motor.power", lambda: RUN.effort("motor") * 4.0),
    ("t", lambda: T),
]  # fmt: skip
UNITS = {
    **dict.fromkeys(("x", "y"), ("length", "in")),
    **dict.fromkeys(("vx", "vy"), ("velocity", "in/s")),
    **dict.fromkeys(("ax", "ay"), ("acceleration", "in/s²")),
    **dict.fromkeys(("fx", "fy", "force"), ("force", "lbf")),
    **dict.fromkeys(("torque", "effort"), ("torque", "lbf·in")),
    **dict.fromkeys(("omega", "rate"), ("angular velocity", "rad/s")),
    "alpha": ("angular acceleration", "rad/s²"),
    "angle": ("angle", "rad"),
    "power": ("power", "lbf·in/s"),
    "t": ("time", "s"),
}


@pytest.mark.parametrize(("name", "history"), HISTORIES, ids=[name for name, _ in HISTORIES])
def test_every_history_has_its_name_and_unit(name, history):
    values, dimension, unit = measured(RUN, name)
    # the size of a force is the root of a sum of squares: three roundings where hypot has one
    np.testing.assert_allclose(values, history(), rtol=4e-16, atol=0.0)
    assert (name_of(dimension), unit) == UNITS[name.rpartition(".")[2]]
    assert values.shape == T.shape


P, CRANK, ROCKER = RUN.point("coupler.P"), RUN["crank"], RUN["rocker"]


@pytest.mark.parametrize(
    ("of", "unit", "expected"),
    [
        ("coupler.P.y - ground.O2.y", "", P.y),
        ("coupler.P.y - ground.O2.y", "mm", P.y * 25.4),
        ("hypot(coupler.P.x, coupler.P.y)", "", np.hypot(P.x, P.y)),
        ("sqrt(coupler.P.vx^2 + coupler.P.vy^2)", "ft/s", np.hypot(P.vx, P.vy) / 12),
        ("rocker.angle - crank.angle", "deg", np.degrees(ROCKER.angle - CRANK.angle)),
        ("rocker.angle - crank.angle", "", ROCKER.angle - CRANK.angle),
        ("crank.omega", "rpm", CRANK.omega * 30 / math.pi),
        ("motor.effort", "N m", RUN.effort("motor") * LBF * IN),
        ("motor.power", "W", RUN.effort("motor") * 4.0 * LBF * IN),
        ("motor.effort*motor.rate", "W", RUN.effort("motor") * 4.0 * LBF * IN),
        ("B.force/n", "kN", RUN.reaction("B").magnitude / 2 * LBF / 1000),
        ("max(abs(A.fx), abs(A.fy))", "", np.maximum(*map(abs, (RUN.reaction("A").fx,
                                                                RUN.reaction("A").fy)))),
        ("coupler.P.x/l", "", P.x / 12),
        ("coupler.P.x - l*sin(crank.angle)", "", P.x - 12 * np.sin(CRANK.angle)),
        ("crank.angle - w*t", "deg", np.full(5, 60.0)),
        ("coupler.P.x/t", "", None),
        ("t", "ms", T * 1000),
        ("1/t", "1/min", None),
        ("2*n", "", np.full(5, 4.0)),
        ("B.fx*coupler.P.y - B.fy*coupler.P.x", "J",
         (RUN.reaction("B").fx * P.y - RUN.reaction("B").fy * P.x) * LBF * IN),
    ],
)  # fmt: skip
def test_measures_are_arithmetic_of_histories(of, unit, expected):
    if expected is None:
        with np.errstate(all="ignore"):
            values, _, told = measured(RUN, Measure(of, unit))
        assert told in ("in/s", "1/min") and np.isfinite(values[1:]).all()
        return
    values, _, told = measured(RUN, Measure(of, unit))
    # one more rounding for the unit, a few where differences cancel
    scale = np.abs(expected).max()
    assert_allclose(values, expected, rtol=8 * ROUNDED, atol=16 * ROUNDED * scale)
    assert told == unit or not unit


@pytest.mark.parametrize(
    ("of", "unit", "words"),
    [
        ("cranck.x", "", "'cranck.x': there is no body 'cranck'"),
        ("coupler.Q.x", "", "'coupler' has no point 'Q' (it has: 'A', 'B', 'P')"),
        ("coupler.P.angle", "", "has no 'angle' (it has: x, y, vx, vy, ax, ay)"),
        ("crank.z", "", "has no 'z' (it has: x, y, vx"),
        ("B.x", "", "has no 'x' (it has: fx, fy, force, torque)"),
        ("motor.x", "", "has no 'x' (it has: effort, power, value, rate, acceleration)"),
        ("s.effort", "", "'s' has no 'effort' (it has: fx, fy, force, length, rate)"),
        ("gravity.y", "", "acts on every body, it has no history of its own"),
        ("B.P.x", "", "there is no body 'B'"),
        ("zzz", "", "there is no parameter 'zzz'"),
        ("crank.x + t", "", "it adds a length (m) and a time (s)"),
        ("crank.x + 1", "", "it adds a length (m) and a plain number"),
        ("t + 1", "", "it adds a time (s) and a plain number"),
        ("crank.x", "s", "it is a length (m), which 's' does not measure"),
        ("crank.omega", "Hz/s", "it is an angular velocity (rad/s), which 'Hz/s' does not"),
        ("exp(crank.x)", "", "'exp' takes a plain number, not a length"),
        ("sin(crank.x)", "", "'sin' takes an angle, not a length"),
    ],
)
def test_measures_that_do_not_serve(of, unit, words):
    with says(ModelError, f"measure {of!r}: ", words):
        measured(RUN, Measure(of, unit))


@pytest.mark.parametrize(
    ("of", "unit", "words"),
    [
        (3, "", "measure: of must be text, not 3"),
        ("t", 3, "measure: unit must be text, not 3"),
        ("t +", "", "ends where a number is wanted"),
        ("t", "nonsense", "there is no unit 'nonsense'"),
        ("", "", "it is empty"),
    ],
)
def test_what_is_no_measure(of, unit, words):
    with says(ModelError, "measure: ", words):
        Measure(of, unit)


def told(**measures):
    return kinetostatics(machine(measures=measures), t=T)


def test_data_are_the_histories():
    run = told(lift="coupler.P.y", turn="rocker.angle", torque=Measure("motor.effort", "N m"))
    for angle, size in (("deg", 180 / math.pi), ("rad", 1.0)):
        data = run.data(angle) if angle == "rad" else run.data()
        found = data["measures"]
        assert (
            found["lift"] == data["points"]["coupler.P"]["y"] == run.point("coupler.P").y.tolist()
        )
        assert found["turn"] == data["bodies"]["rocker"]["angle"]
        assert_allclose(found["turn"], run["rocker"].angle * size, rtol=ROUNDED)
        assert_allclose(found["torque"], run.effort("motor") * LBF * IN, rtol=4 * ROUNDED)
    # one with a unit keeps it
    run = told(turn=Measure("rocker.angle", "rad"))
    assert run.data()["measures"]["turn"] == run["rocker"].angle.tolist()


def test_forces_are_open_where_none_are_found():
    both = {"lift": "coupler.P.y", "torque": "motor.effort", "work": "motor.power*t", "r": "B.fx",
            "rate": "motor.rate"}  # fmt: skip
    run = kinematics(machine(measures=both), t=T)
    found = run.data()["measures"]
    assert [found[key] for key in ("torque", "work", "r")] == [None] * 3
    assert found["lift"] == run.point("coupler.P").y.tolist() and found["rate"] == [4.0] * 5
    with says(ModelError, "kinematics finds no forces"):
        measured(run, "motor.effort")
    assert "–" in next(line for line in str(run).splitlines() if line.startswith("torque"))


def test_sheets_show_them():
    run = told(lift="coupler.P.y", torque=Measure("motor.effort", "N m"), turn="crank.angle")
    text = str(run)
    lines = text[text.index("MEASURES") :].splitlines()
    assert lines[0].split() == ["MEASURES", "least", "greatest", "unit", "of"]
    rows = {line.split()[0]: line.split() for line in lines[2:5]}
    y, torque = run.point("coupler.P").y, run.effort("motor") * LBF * IN
    assert rows["lift"][1:] == [f"{y.min():.6g}", f"{y.max():.6g}", "in", "coupler.P.y"]
    assert rows["torque"][1:5] == [f"{torque.min():.6g}", f"{torque.max():.6g}", "N", "m"]
    assert rows["turn"][3] == "deg" and float(rows["turn"][1]) == pytest.approx(60.0, abs=1e-3)
    one = str(run.take(np.array([2])))
    assert "value" in one and f"{y[2]:.6g}" in one
    assert "MEASURES" not in str(RUN)
    assert "lift" in str(close_loops(machine(measures={"lift": "coupler.P.y"})))


def test_measures_follow_the_parameters_of_a_file():
    text = to_toml(machine(measures={"far": Measure("coupler.P.x/l", "")}))
    short, long = (from_toml(text, parameters={"l": length}) for length in ("6 in", "12 in"))
    a, b = (kinetostatics(m, t=T).data()["measures"]["far"] for m in (short, long))
    assert_allclose(a, 2 * np.array(b), rtol=2 * ROUNDED)


# -- the instants that are asked for ------------------------------------------------------------


def driven(law, **more):
    """A four-bar whose crank follows a law; a crank-rocker."""
    plain = makers.four_bar(1, 3, 2.5, 3.5, start=0.5, **more)
    made = Mechanism("m", ground=plain.ground.points)
    made.add(*plain.bodies, *plain.joints, AngleDriver("motor", "crank", law))
    return made


def at(law, values, name="crank"):
    return asked(driven(law), "kinematics", Instants(at={name: values}))


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


def test_backwards():
    run = at(ConstantAcceleration(0.5, -SPEED, 0.0), [0.0, 0.4, 0.6])
    assert_allclose(run.t, np.array([0.5, 0.1, 2 * math.pi - 0.1]) / SPEED, atol=1e-15)
    # a law that begins at rest goes where its acceleration takes it
    run = at(ConstantAcceleration(0.5, 0.0, -2.0), 0.25)
    assert run.t[0] == pytest.approx(0.5, rel=1e-15)


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


@pytest.mark.parametrize(
    ("law", "value", "words"),
    [
        (
            ConstantAcceleration(0.5, 5.0, -40.0),
            3.0,
            "turns back at t = 0.125",
        ),
        (Harmonic(0.5, 0.3, 2.0), 1.0, "does not reach 1"),
        (Rise("3-4-5", 1.0, 0.0, 2.0, 0.5), 1.6, "does not reach"),
        (Table([0, 1, 2], [0.5, 1.0, 1.2]), 1.3, "1.3"),
        (Polynomial([0.5, 0.0, 1.0, -1.0]), 2.0, "turns back"),
    ],
)
def test_a_law_that_never_comes_there(law, value, words):
    with says(ModelError, "driver 'motor' does not come there by its law: ", words):
        at(law, value)


def arm(first, second):
    """Two bars, each driven by its own motor."""
    made = Mechanism("arm", parameters={"q": "30 deg"})
    made.add(Body("a", points={"P": (1.0, 0)}), Body("b"))
    made.add(Revolute("O", "ground", "a"), Revolute("P", "a.P", "b"))
    made.add(AngleDriver("m1", "a", first), AngleDriver("m2", "b", second))
    return made


MOVING, OTHER = ConstantSpeed(0.1, 1.0), ConstantSpeed(0.2, 2.0)


def of_arm(wanted, first=MOVING, second=OTHER):
    run = asked(arm(first, second), "kinematics", Instants(at=wanted))
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
        with says(ModelError, *words):
            of_arm(wanted)


def test_drivers_that_rest():
    """They are put where they are asked for; one that moves says when."""
    assert of_arm({"m1": [1.1, "q"]}, 0.1, 0.2)[1:] == ([1.1, math.radians(30)], [0.2, 0.2])
    assert of_arm({"m1": [1.1, 1.2], "b": 0.5}, 0.1, ConstantSpeed(0.2, 0.0))[2] == [0.5, 0.5]
    assert of_arm({"m1": 1.1, "m2": 0.2}, MOVING, 0.2)[0] == pytest.approx([1.0])
    with says(ModelError, "'m2' rests while 'm1' moves: say where 'm1' is, or give t"):
        of_arm({"m2": 0.5}, MOVING, 0.2)
    with says(ModelError, "by its law 'm2' is at 0.2 when 'm1'"):
        of_arm({"m1": 1.1, "m2": 0.3}, MOVING, 0.2)
    with says(ModelError, "there are 2 of 'm1' and 3 of 'm2'"):
        of_arm({"m1": [1.1, 1.2], "m2": [2.1, 1.0, 1.0]}, 0.1, 0.2)


def test_a_cylinder():
    """A DistanceDriver on an arm: the law of cosines says its angle, the law its time."""
    made = Mechanism("m", ground={"C": (3.0, 0.0)}, units="mm-N-s")
    made.add(Body("arm", points={"A": (2.0, 0.0)}, guess=1.0), Revolute("O", "ground", "arm"))
    made.add(DistanceDriver("cylinder", "ground.C", "arm.A", ConstantSpeed(2.0, 0.5)))
    run = asked(made, "kinetostatics", Instants(at={"cylinder": [2.5, "3 mm", 0.3e1]}))
    assert_allclose(run.t, [1.0, 2.0, 2.0], rtol=1e-14)
    length = np.array([2.5, 3.0, 3.0])
    assert_allclose(np.cos(run["arm"].angle), (4.0 + 9.0 - length**2) / 12.0, rtol=1e-13)
    assert_allclose(run["arm"].omega, length * 0.5 / (6.0 * np.sin(run["arm"].angle)), rtol=1e-12)
    with says(ModelError, "'cylinder': '3 deg' is an angle (rad), where a length"):
        asked(made, "kinematics", Instants(at={"cylinder": "3 deg"}))
    with says(ModelError, "'cylinder' does not come there by its law"):
        asked(made, "kinematics", Instants(at={"cylinder": 1.5}))


def test_a_slide():
    made = Mechanism("m")
    made.add(Body("block", mass=1.0), Prismatic("guide", "ground", "block"))
    made.add(CoordinateDriver("screw", "ground", "block", ConstantAcceleration(0.0, 0.0, 2.0)))
    run = asked(made, "kinetostatics", Instants(at={"screw": ["4 m", "100 cm"]}))
    assert_allclose([run.t, run["block"].vx], [[2.0, 1.0], [4.0, 2.0]], rtol=1e-14)
    assert_allclose(run.effort("screw"), 2.0, rtol=1e-14)


@pytest.mark.parametrize("analysis", ["kinematics", "kinetostatics", "statics"])
def test_times_are_taken_as_they_are_asked_for(analysis):
    made = driven(ConstantSpeed(0.5, 2.0))
    run = asked(made, analysis, Instants(at={"t": [0.3, "100 ms", 0.3, "-0.2 s", 0]}))
    assert run.t.tolist() == [0.3, 0.1, 0.3, -0.2, 0.0]
    assert_allclose(run["crank"].angle, 0.5 + 2.0 * run.t, rtol=1e-14)
    verb = {"kinematics": kinematics, "kinetostatics": kinetostatics, "statics": statics}[analysis]
    for n, t in enumerate(run.t):
        alone = verb(made, t=[0.0, t]) if t else verb(made)
        # another way there: closed to 1e-12 both times
        assert_allclose(run["rocker"].angle[n], alone["rocker"].angle[-1], atol=1e-11)


def test_over_a_turn():
    made = driven(ConstantSpeed(0.5, 2.0))
    for over in ("turn", "motor"):
        run = asked(made, "kinematics", Instants(over=over, instants=9))
        assert_allclose(run["crank"].angle, 0.5 + np.linspace(0, 2 * math.pi, 9), atol=1e-13)
    made.ask = Instants(over="turn", instants=5)
    assert len(asked(made, "kinematics")) == 5
    assert asked(driven(ConstantSpeed(0.5, 2.0)), "kinematics").t.tolist() == [0.0]
    with says(ModelError, "there is no driver 'crunk'"):
        asked(made, "kinematics", Instants(at={"crunk": 1.0}))


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
    run = asked(driven(law, crossed=crossed), "kinematics", Instants(at={"crank": wanted}))
    expected = by_circles(np.array(wanted), side)
    apart = np.remainder(run["rocker"].angle - expected + math.pi, 2 * math.pi) - math.pi
    assert_allclose(apart, 0.0, atol=1e-11)  # a sweep's last correction and the loops' condition


@pytest.mark.parametrize(
    ("fields", "words"),
    [
        ({"at": 3}, 'at must be a table such as {"t": 0.1}, not 3'),
        ({"at": {"t": []}}, "at.t is empty"),
        ({"at": {"t": [None]}}, "at.t: None is no number"),
        ({"at": {"t": math.nan}}, "at.t is nan, it must be finite"),
        ({"at": {"t": "1 +"}}, "at.t: '1 +' ends where"),
        ({"at": {"t": 1}, "over": "turn"}, "give at or over, not both"),
        ({"over": 3}, "over must be 'turn' or the name of a driver"),
        ({"over": "turn", "instants": 1}, "instants must be a whole number from 2"),
        ({"over": "turn", "instants": True}, "instants must be a whole number"),
        ({"over": "turn", "instants": 9.0}, "instants must be a whole number"),
        ({"instants": 9}, "instants goes with over"),
    ],
)
def test_what_is_no_question(fields, words):
    with says(ModelError, "ask: ", words):
        Instants(**fields)


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
        made = from_toml(f"{head}{text}\n[ask]\n{table}")
        assert_allclose(asked(made, "kinematics")["crank"].angle, expected, rtol=1e-13)
        again = from_toml(to_toml(made))
        assert again == made
        np.testing.assert_array_equal(asked(again, "kinematics").t, asked(made, "kinematics").t)
