"""Measures against the histories that they name."""

import math

import numpy as np
import pytest
from numpy.testing import assert_allclose

from mbody import (
    Body,
    Gravity,
    Mechanism,
    ModelError,
    Spring,
    from_toml,
    gradient,
    kinematics,
    kinetostatics,
    makers,
    statics,
    to_toml,
)
from mbody.makers import polar
from mbody.model.simulation import Measure
from mbody.quantities.units import name_of
from mbody.solution.measures import measured
from tests.errors.test_errors import says

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
    assert told.replace("·", " ") == unit or not unit


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
        # degrees are written to fifteen digits, at worst half of 1e-14
        digits = ROUNDED if angle == "rad" else 5e-15
        assert_allclose(found["turn"], run["rocker"].angle * size, rtol=digits)
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


def test_measures_follow_the_parameters_of_a_file():
    text = to_toml(machine(measures={"far": Measure("coupler.P.x/l", "")}))
    short, long = (from_toml(text, parameters={"l": length}) for length in ("6 in", "12 in"))
    a, b = (kinetostatics(m, t=T).data()["measures"]["far"] for m in (short, long))
    assert_allclose(a, 2 * np.array(b), rtol=2 * ROUNDED)


def test_at_rest_a_driver_has_no_rate_and_gives_no_power():
    """A law may say how fast a driver begins; in statics it holds, as the bodies do."""
    rest = statics(machine(), t=T)
    for name in ("motor.power", "motor.rate", "motor.acceleration", "crank.omega"):
        assert rest.measure(name).tolist() == [0.0] * len(T), name
    assert_allclose(
        rest.measure("motor.value"), kinetostatics(machine(), t=T).measure("motor.value")
    )
    assert np.abs(rest.measure("motor.effort")).max() > 1.0
    found = gradient(machine(), ["motor.power", "motor.effort"], ["crank.A.x"], analysis="statics")
    assert found.value["motor.power"] == 0.0 and found["motor.power"]["crank.A.x"] == 0.0
