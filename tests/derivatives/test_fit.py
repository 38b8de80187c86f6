"""Numbers from measured histories: beside other least squares, coverage, what stays open."""

import csv
import json
import math

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import solve_ivp
from scipy.optimize import curve_fit, least_squares

import mbody
from mbody import AngleDriver, Body, Gravity, Mechanism, Revolute, TorsionDamper
from mbody.cli import main
from mbody.derivatives.fit_problem import determined, identified
from mbody.laws import ConstantSpeed
from tests import fit_coverage

G = 9.81
ANGLES = np.linspace(0.1, 6.3, 40)


def stroke(angle, r, length, zero=0.0):
    return r * np.cos(angle) + np.sqrt(length**2 - (r * np.sin(angle)) ** 2) + zero


def encoder(noise=1e-4, seed=0, zero=0.003):
    rng = np.random.default_rng(seed)
    x = stroke(ANGLES, 0.1, 0.3, zero) + noise * rng.normal(size=len(ANGLES))
    return {"motor [deg]": np.degrees(ANGLES), "slider.x [mm]": 1e3 * x}


def engine(r=0.103, length=0.295, **more):
    return mbody.makers.slider_crank(r, length, **more)


def fitted(data, by=("crank.A.x", "rod.B.x"), **options):
    options = {"analysis": "kinematics", "offsets": ["slider.x"], **options}
    return mbody.fit(engine(), data, list(by), **options)


# -- geometry -------------------------------------------------------------------------------------


def test_exact_data():
    found = fitted(encoder(noise=0.0))
    assert found["crank.A.x"] == pytest.approx(0.1, rel=1e-10)
    assert found["rod.B.x"] == pytest.approx(0.3, rel=1e-8)
    assert found.offsets["slider.x offset"] == pytest.approx(3.0, rel=1e-6)
    assert found.undetermined == () and found.status == "completed"
    assert found.system.values["rod.B.x"] == found["rod.B.x"]


@pytest.mark.parametrize(("unit", "factor"), [("N*m", 1.0), ("MN*m", 1e-6), ("mN*m", 1e3)])
def test_numbers_that_are_zero_are_determined(unit, factor):
    """Of no unit: the data say that there is neither an offset nor a brake."""
    machine = mbody.makers.four_bar(1, 3, 2, 3.5, masses=(1, 3, 2), speed=10.0)
    machine.add(mbody.Torque("brake", "rocker", value=0.0))
    run = mbody.kinetostatics(machine, turn="motor", instants=40)
    effort = f"motor.effort [{unit}]"
    data = {"motor": run["crank"].angle, "motor.rate": np.full(40, 10.0)}
    data[effort] = factor * run.effort("motor")
    begun = mbody.assemble(machine).with_values({"coupler.mass": 2.0})
    found = mbody.fit(begun, data, ["coupler.mass", "brake.value"], offsets=["motor.effort"])
    assert found["coupler.mass"] == pytest.approx(3.0, rel=1e-12)
    assert found.undetermined == () and not found.notes and found.evaluations < 12
    size = float(np.abs(data[effort]).max())
    assert abs(found.offsets["motor.effort offset"]) < 1e-12 * size
    assert found.deviations["motor.effort offset"] < 1e-12 * size


def test_covariance_and_values_beside_curve_fit():
    """Another program's least squares of the closed form, by differences."""
    data = encoder()
    found = fitted(data)
    best, covariance = curve_fit(
        lambda a, r, l, z: 1e3 * stroke(a, r, l) + z,
        ANGLES,
        data["slider.x [mm]"],
        p0=[0.103, 0.295, 0.0],
        xtol=1e-14,
        ftol=1e-14,
    )
    mine = [*found.values.values(), *found.offsets.values()]
    deviation = np.sqrt(np.diag(covariance))
    # both stop where the sum of squares no longer falls: within 1e-5 of a deviation
    assert np.abs((mine - best) / deviation).max() < 1e-4
    assert_allclose(found.covariance, covariance, rtol=1e-4, atol=1e-12 * covariance.max())
    assert [found.deviations[k] for k in found.deviations] == pytest.approx(deviation, rel=1e-4)
    low, high = found.intervals["rod.B.x"]
    # Student's t of 37 degrees of freedom
    assert (high - low) / 2.0 == pytest.approx(2.026192 * deviation[1], rel=1e-4)


@pytest.mark.slow
def test_intervals_contain_the_truth():
    """120 of the trials of `python -m tests.fit_coverage`: within four standard errors of 95 %."""
    counts = fit_coverage.campaign(0, 120)
    assert counts["settled"] == 120
    error = math.sqrt(0.95 * 0.05 / 120)
    for name in fit_coverage.UNKNOWNS:
        assert abs(counts[name] / 120 - 0.95) < 4.0 * error


def test_gaps_and_several_runs():
    """NaN is no datum; each run has an offset of its own; two runs are one longer one."""
    one, two = encoder(seed=1), encoder(seed=2, zero=-0.001)
    one["slider.x [mm]"][3] = np.nan
    found = fitted([one, two])
    assert found.count == 79
    assert found.offsets["slider.x offset, run 1"] == pytest.approx(3.0, abs=4.0)
    gap = found.offsets["slider.x offset, run 1"] - found.offsets["slider.x offset, run 2"]
    # what both share falls out of the difference: noise 0.1 mm over √40
    assert gap == pytest.approx(4.0, abs=5.0 * 0.1 * math.sqrt(2.0 / 40.0))
    assert np.isnan(found.residuals[0]["slider.x"][3])
    assert fitted(one).deviations["rod.B.x"] > found.deviations["rod.B.x"]


# -- forces ---------------------------------------------------------------------------------------


def arm(mass=2.0, x=0.4, inertia=0.05, friction=None):
    machine = Mechanism("arm")
    rough = {} if friction is None else {"friction": friction, "pin_radius": 0.05}
    machine.add(
        Body("arm", mass=mass, cg=(x, 0.0), inertia=inertia),
        Revolute("O", "ground", "arm", **rough),
        AngleDriver("motor", "arm", ConstantSpeed(0.0, 1.0)),
        Gravity("g", y=-G),
    )
    return machine


def motion(seed=3, noise=0.02):
    rng = np.random.default_rng(seed)
    t = np.linspace(0.0, 3.0, 80)
    angle, rate, change = np.sin(2 * t), 2 * np.cos(2 * t), -4 * np.sin(2 * t)
    torque = (0.05 + 2.0 * 0.16) * change + 2.0 * G * 0.4 * np.cos(angle)
    torque = torque + noise * rng.normal(size=len(t))
    return {
        "motor": angle,
        "motor.rate": rate,
        "motor.acceleration": change,
        "motor.effort": torque,
    }


def test_base_parameters():
    """T = (I + m x²) α + m x g cos θ: of m, x and I two sums are determined, by linear least
    squares; the third direction is m, −x/m, x².
    """
    data = motion()
    found = mbody.fit(arm(1.8, 0.45, 0.06), data, ["arm.mass", "arm.cg.x", "arm.inertia"])
    m, x, inertia = found.values.values()
    linear = np.column_stack([data["motor.acceleration"], G * np.cos(data["motor"])])
    best, rest, *_ = np.linalg.lstsq(linear, data["motor.effort"])
    assert inertia + m * x * x == pytest.approx(best[0], rel=1e-9)
    assert m * x == pytest.approx(best[1], rel=1e-9)
    (one,) = found.undetermined
    wanted = {"arm.mass": 1.0, "arm.cg.x": -x / m, "arm.inertia": x * x}
    for name, part in one.direction.items():
        scale = one.direction["arm.mass"]
        assert part / scale == pytest.approx(wanted[name], rel=1e-6)
    assert "changes no datum" in str(one) and f"not determined: {one}" in found.notes
    assert all(low == -np.inf for low, _ in found.intervals.values())
    inverse = np.linalg.inv(linear.T @ linear) * rest[0] / 78.0
    first, second = found.combinations
    assert str(first) == "arm.mass*arm.cg.x" and not first.tangent
    assert str(second) == "arm.inertia + arm.mass*arm.cg.x^2" and not second.tangent
    truth = {"arm.mass": 2.0, "arm.cg.x": 0.4, "arm.inertia": 0.05}
    for one, value, k in ((first, 0.8, 1), (second, 0.37, 0)):
        assert one.value == pytest.approx(best[k], rel=1e-9)
        assert one.deviation == pytest.approx(math.sqrt(inverse[k, k]), rel=1e-6)
        assert one.at(truth) == pytest.approx(value)
        assert abs(one.value - value) < 3.0 * one.deviation
        # the family ends where the inertia is zero: m = (m x)²/J
        low, high = one.within["arm.mass"]
        assert low == pytest.approx(best[1] ** 2 / best[0], rel=1e-2) and high > 2.0
    assert "lie on a curve" in str(found.undetermined[0])
    assert f"determined: {first} = {first.value:.6g} ± " in str(found)


def test_a_number_that_changes_nothing():
    """The inertia of a shaft at constant speed: it stays as it was, and is named."""
    machine = engine(0.1, 0.3, masses=(0.5, 1.0, 2.0), speed=30.0)
    run = mbody.kinetostatics(machine, drive={"motor": (ANGLES, 30.0)})
    data = {"motor": ANGLES, "motor.rate": np.full(40, 30.0), "motor.effort": run.effort("motor")}
    start = mbody.assemble(machine).with_values({"slider.mass": 1.5})
    found = mbody.fit(start, data, ["slider.mass", "crank.inertia"])
    assert found["slider.mass"] == pytest.approx(2.0, rel=1e-9)
    assert found["crank.inertia"] == machine["crank"].inertia
    assert [str(one) for one in found.undetermined] == ["'crank.inertia' changes no datum"]
    assert np.isfinite(found.deviations["slider.mass"])
    assert found.deviations["crank.inertia"] == np.inf
    assert "open" in str(found)
    json.dumps(found.data(), allow_nan=False)


def test_friction():
    """The coefficient of a pin, from the torque of a motor; the equations have it implicitly."""
    data = motion()
    run = mbody.kinetostatics(
        arm(friction=0.2),
        drive={"motor": tuple(data[f"motor{k}"] for k in ("", ".rate", ".acceleration"))},
    )
    moving = np.abs(data["motor.rate"]) > 0.05
    data["motor.effort"] = np.where(moving, run.effort("motor"), np.nan)
    found = mbody.fit(arm(friction=0.1), data, ["O.friction", "arm.mass"])
    assert found["O.friction"] == pytest.approx(0.2, rel=1e-8)
    assert found["arm.mass"] == pytest.approx(2.0, rel=1e-9)


def test_sensors_of_different_noise():
    """Weights by the residuals of each column: those of the truth but for chance."""
    data, rng = motion(), np.random.default_rng(8)
    data["O.fx"] = -mbody.kinetostatics(
        arm(), drive={"motor": tuple(data[f"motor{k}"] for k in ("", ".rate", ".acceleration"))}
    ).reaction("O", on="ground").fx + 2.0 * rng.normal(size=80)
    found = mbody.fit(arm(1.8, 0.45), data, ["arm.mass", "arm.cg.x"])
    # a deviation of 80 residuals is known to 1/√160
    assert found.residual["motor.effort"] == pytest.approx(0.02, rel=4.0 / math.sqrt(160.0))
    assert found.residual["O.fx"] == pytest.approx(2.0, rel=4.0 / math.sqrt(160.0))
    given = mbody.fit(
        arm(1.8, 0.45),
        data,
        ["arm.mass", "arm.cg.x"],
        deviations={"motor.effort": 0.02, "O.fx": 2.0},
    )
    assert given.deviations["arm.mass"] == pytest.approx(found.deviations["arm.mass"], rel=0.5)


# -- free motion ----------------------------------------------------------------------------------


def pendulum(inertia=0.02, damping=0.05):
    begun = mbody.SimulationSettings(until=4.0, start={"bob": {"angle": math.radians(-40.0)}})
    machine = Mechanism("pendulum", simulation=begun)
    machine.add(
        Body("bob", mass=1.5, cg=(0.5, 0.0), inertia=inertia, guess="-40 deg"),
        Revolute("O", "ground", "bob"),
        TorsionDamper("d", "ground", "bob", coefficient=damping),
        Gravity("g", y=-G),
    )
    return machine


def swing(t, inertia, damping):
    """By another integrator."""
    whole = inertia + 1.5 * 0.25

    def rates(_, y):
        return [y[1], (-damping * y[1] - 1.5 * G * 0.5 * np.cos(y[0])) / whole]

    begun = [math.radians(-40.0), 0.0]
    return solve_ivp(rates, (0.0, t[-1]), begun, t_eval=t, rtol=1e-11, atol=1e-12).y[0]


@pytest.mark.parametrize("differenced", [False, True])
def test_a_free_motion(differenced):
    """Beside curve_fit with another integrator; with a start whose derivatives are not there by
    differences, which a note says.
    """
    t = np.linspace(0.1, 4.0, 60)
    rng = np.random.default_rng(1)
    data = {"t": t, "bob.angle [deg]": np.degrees(swing(t, 0.05, 0.1)) + 0.2 * rng.normal(size=60)}
    options = {"guess": {"bob": "-40 deg"}} if differenced else {}
    found = mbody.fit(pendulum(), data, ["bob.inertia", "d.coefficient"], **options)
    best, covariance = curve_fit(
        lambda t, i, d: np.degrees(swing(t, i, d)), t, data["bob.angle [deg]"], p0=[0.04, 0.08]
    )
    deviation = np.sqrt(np.diag(covariance))
    assert np.abs((np.array(list(found.values.values())) - best) / deviation).max() < 1e-2
    # curve_fit differences by 1e-8 what solve_ivp integrates to 1e-11
    assert list(found.deviations.values()) == pytest.approx(deviation, rel=2e-2)
    assert any("differences" in note for note in found.notes) == differenced


# -- what is said ---------------------------------------------------------------------------------


def test_a_model_that_lacks_something():
    """With a rod that is held too long what is left is a curve, no noise."""
    found = fitted(encoder(noise=1e-6), ["crank.A.x"])
    assert any("is no noise" in note for note in found.notes)
    assert not any("is no noise" in note for note in fitted(encoder()).notes)


def test_bounds():
    """What data contradict is said, with where they lead; beside the fit without the bound."""
    found = mbody.fit(
        engine(), encoder(), {"crank.A.x": (0.102, "11 cm"), "rod.B.x": None}, "kinematics"
    )
    assert found["crank.A.x"] == pytest.approx(0.102, rel=1e-9)
    (note,) = (one for one in found.notes if "'crank.A.x' is at its bound" in one)
    assert "other starts" in note and "beyond 0.102" in note
    free = mbody.fit(engine(), encoder(), ["crank.A.x", "rod.B.x"], "kinematics")
    low, high = found.intervals["crank.A.x"]
    # by the derivatives at the bound, 2 % away
    assert 0.5 * (low + high) == pytest.approx(free["crank.A.x"], rel=1e-3)
    assert any("a bound is wrong, or the model lacks something" in one for one in found.notes)


@pytest.mark.parametrize("start", [(1.8, 0.45, 0.06), (1.0, 0.7, 0.06), (1.0, 0.6, 0.1)])
def test_a_bound_is_freed(start):
    """m x = 0.8 and I + m x² = 0.37 ask for m > 1.73: m, which "changes no datum", is moved."""
    found = mbody.fit(arm(*start), motion(noise=0.0), ["arm.mass", "arm.cg.x", "arm.inertia"])
    m, x, inertia = found.values.values()
    assert m * x == pytest.approx(0.8, rel=1e-9)
    assert inertia + m * x * x == pytest.approx(0.37, rel=1e-9)
    assert [note[:14] for note in found.notes] == ["not determined"]


def test_intervals_at_a_bound():
    """A linear problem whose least lies beyond a bound of I: the interval of m is that of the least
    without it, and that of I is cut by it.
    """
    data = motion(noise=0.2)
    gravity = G * 0.4 * np.cos(data["motor"]) + 0.16 * data["motor.acceleration"]
    linear = np.column_stack([gravity, data["motor.acceleration"]])
    best, rest, *_ = np.linalg.lstsq(linear, data["motor.effort"])
    deviation = np.sqrt(np.diag(np.linalg.inv(linear.T @ linear)) * rest[0] / 78.0)
    bound = float(best[1] + 0.5 * deviation[1])
    machine = arm(inertia=bound + 0.1)
    found = mbody.fit(machine, data, {"arm.mass": None, "arm.inertia": (bound, 0.5 + bound)})
    assert found["arm.inertia"] == bound
    quantile = 1.9908471
    wanted = best[0] + quantile * deviation[0] * np.array([-1.0, 1.0])
    assert found.intervals["arm.mass"] == pytest.approx(wanted, rel=1e-7)
    high = best[1] + quantile * deviation[1]
    assert found.intervals["arm.inertia"] == pytest.approx((bound, high), rel=1e-7)
    assert any("0.5 deviations" in note for note in found.notes)


def levered(stiffness, k=90.0, r=0.25):
    """A torsion spring of a formula of parameters, with torques of one of 6 N·m/rad."""
    made = Mechanism("lever", parameters={"k": k, "r": r})
    made.add(
        Body("lever", mass=1.0),
        Revolute("O", "ground", "lever"),
        AngleDriver("motor", "lever", ConstantSpeed(0.0, 1.0)),
        mbody.TorsionSpring("s", "ground", "lever", stiffness=stiffness),
    )
    angle = np.linspace(-1.0, 1.0, 30)
    noise = 0.01 * np.random.default_rng(4).normal(size=30)
    return mbody.fit(made, {"motor": angle, "motor.effort": 6.0 * angle + noise}, ["k", "r"])


def test_a_product():
    """k r² is determined, for any r."""
    found = levered("k*r*r*1 N*m/rad")
    (one,) = found.combinations
    assert one.terms == {"k*r^2": 1.0} or one.terms == {"r^2*k": 1.0}
    assert abs(one.value - 6.0) < 3.0 * one.deviation and not one.tangent


def test_a_tangent_has_its_range():
    """Of k² + exp(r) no sum of products is known: its tangent holds where it is in its interval."""
    found = levered("(k*k/2000+exp(r))*1 N*m/rad")
    (one,) = found.combinations
    assert one.tangent and "near these numbers alone" in str(found)
    (low, high), k = one.within["k"], found["k"]
    assert low < k < high and high - low < 0.2 * k
    for end in (low, high):
        r = math.log(
            one.at({"k": 0.0, "r": 0.0}) + k * k / 2000 + math.exp(found["r"]) - end**2 / 2000
        )
        off = abs(one.at({"k": end, "r": r}) - one.value)
        assert off == pytest.approx(2.045230 * one.deviation, rel=0.05)


def weightless(y, inertia):
    """An arm with torques of I + 2 (0.16 + y²) = 0.55 kg m² alone."""
    machine = Mechanism("arm")
    machine.add(
        Body("arm", mass=2.0, cg=(0.4, y), inertia=inertia),
        Revolute("O", "ground", "arm"),
        AngleDriver("motor", "arm", ConstantSpeed(0.0, 1.0)),
    )
    data = motion()
    noise = 0.02 * np.random.default_rng(5).normal(size=80)
    data["motor.effort"] = 0.55 * data["motor.acceleration"] + noise
    return machine, data


def test_what_a_tangent_does_not_see():
    """At y = 0 the derivative by y is zero, and yet I + 2 y² = 0.23 is what data determine: both
    are open.
    """
    found = mbody.fit(*weightless(0.0, 0.3), ["arm.cg.y", "arm.inertia"])
    assert found["arm.inertia"] == pytest.approx(0.23, abs=0.01)
    assert np.isinf(list(found.deviations.values())).all()
    (one,) = found.combinations
    assert one.terms == pytest.approx({"arm.inertia": 1.0, "arm.cg.y^2": 2.0})
    assert abs(one.at({"arm.inertia": 0.05, "arm.cg.y": 0.3}) - one.value) < 3.0 * one.deviation


def test_data_beyond_a_table():
    """A motor that follows a table: data after its end are in doubt, as the analysis is."""
    machine = Mechanism("rotor")
    machine.add(
        Body("rotor", mass=1.0, points={"P": (0.2, 0.0)}),
        Revolute("O", "ground", "rotor"),
        AngleDriver(
            "motor", "rotor", mbody.laws.Table([0.0, 0.5, 1.0], [0.0, 1.0, 1.5], outside="line")
        ),
    )
    t = np.array([0.1, 0.5, 0.9, 1.4])
    found = mbody.fit(machine, {"t": t, "rotor.P.x": 0.1 + 0.0 * t}, "rotor.P.x", "kinematics")
    assert found.status.startswith("doubtful") and found.doubts[0].kind == "extrapolation"


def test_null_directions():
    """Of a matrix with known dependent columns: c = 2 a − b, and d has no effect."""
    rng = np.random.default_rng(0)
    a, b, e = rng.normal(size=(3, 50))
    jacobian = np.column_stack([a, b, 2.0 * a - b, 0.0 * a, e])
    names, units = list("abcde"), dict.fromkeys("abcde", "m")
    found = identified(jacobian, names, units, np.ones(5), 1e-9)
    assert found.rank == 3 and len(found.undetermined) == 2
    for one in found.undetermined:
        row = np.array([one.direction.get(name, 0.0) for name in names])
        assert np.abs(jacobian @ row).max() < 1e-12
    assert found.open.tolist() == [True, True, True, True, False]
    for terms in determined(found.null, found.pivots, names, found.open):
        row = np.array([terms.get(name, 0.0) for name in names])
        # a sum that is determined is a sum of rows of J
        assert jacobian.T @ np.linalg.lstsq(jacobian.T, row)[0] == pytest.approx(row, abs=1e-9)


#: What the file says of the fit of `engine`.
TABLE = """
[fit]
by         = { "crank.A.x" = ["9 cm", 0.12], "rod.B.x" = [0.25, 0.35] }
offsets    = ["slider.x"]
deviations = { "slider.x" = 0.1 }
analysis   = "kinematics"
confidence = 0.9
"""


def test_a_table_of_a_file(capsys, tmp_path):
    """The file says what is unknown; options come before it; it is written as it was read."""
    data = encoder()
    with (tmp_path / "run.csv").open("w", newline="") as stream:
        rows = csv.writer(stream)
        rows.writerow(data)
        rows.writerows(zip(*data.values(), strict=True))
    machine = mbody.from_toml(mbody.to_toml(engine()) + TABLE)
    model = tmp_path / "engine.toml"
    mbody.save(machine, model)
    assert TABLE.strip() in model.read_text()
    words = ["fit", str(model), str(tmp_path / "run.csv"), "--json"]
    assert main(words) == 0
    got = json.loads(capsys.readouterr().out)
    by = {"crank.A.x": (0.09, 0.12), "rod.B.x": (0.25, 0.35)}
    found = mbody.fit(
        engine(),
        data,
        by,
        "kinematics",
        offsets=["slider.x"],
        deviations={"slider.x": 0.1},
        confidence=0.9,
    )
    assert got["values"]["crank.A.x"] == pytest.approx(found["crank.A.x"], rel=1e-12)
    assert got["intervals"]["rod.B.x"] == pytest.approx(found.intervals["rod.B.x"], rel=1e-9)
    assert main([*words, "--by", "crank.A.x"]) == 0
    assert "rod.B.x" not in json.loads(capsys.readouterr().out)["values"]


@pytest.mark.parametrize("unit", [1e-9, 1e9])
def test_mechanisms_of_any_size(unit):
    """Exact data of a slider-crank of nanometres and one of gigametres; 1e-12 is rounding."""
    run = mbody.kinematics(engine(0.1 * unit, 0.3 * unit), drive={"motor": ANGLES})
    data = {"motor": ANGLES, "slider.x": run["slider"].x}
    found = mbody.fit(
        engine(0.11 * unit, 0.28 * unit), data, ["crank.A.x", "rod.B.x"], "kinematics"
    )
    assert found["crank.A.x"] / unit == pytest.approx(0.1, rel=1e-12)
    assert found["rod.B.x"] / unit == pytest.approx(0.3, rel=1e-12)


def test_columns_by_their_headings():
    """Offsets and deviations are named as measured quantities or as headings."""
    plain = fitted(encoder(), deviations={"slider.x": 0.2})
    headed = fitted(encoder(), offsets=["slider.x [mm]"], deviations={"slider.x [mm]": 0.2})
    assert headed.values == plain.values and headed.offsets == plain.offsets
    with pytest.raises(mbody.ModelError, match="no column 'crank' with a deviation"):
        fitted(encoder(), deviations={"crank": 0.2})


@pytest.mark.parametrize("seed", range(6))
def test_random_bounds_beside_many_starts(seed):
    """Arms whose mass, place and inertia are sought within random bounds: no start of the closed
    form ends lower, and what is said to be determined is so at the truth.
    """
    rng = np.random.default_rng([7, seed])
    truth = np.array([rng.uniform(0.5, 3.0), rng.uniform(0.2, 0.6), rng.uniform(0.0, 0.2)])
    low = truth * rng.choice([0.0, 0.9], 3)
    high = np.where(rng.random(3) < 0.5, np.inf, truth * 1.3 + 1e-3)
    t = np.linspace(0.0, 3.0, 40)
    turned, change = np.sin(2 * t), -4 * np.sin(2 * t)

    def torque(p):
        m, x, inertia = p
        return (inertia + m * x * x) * change + m * G * x * np.cos(turned)

    effort = torque(truth) + 0.01 * rng.normal(size=40)
    data = {"motor": turned, "motor.rate": 2 * np.cos(2 * t), "motor.acceleration": change}
    names = ["arm.mass", "arm.cg.x", "arm.inertia"]
    start = np.clip(truth * rng.uniform(0.6, 1.6, 3), low + 1e-4, high - 1e-4)
    by = {name: (float(a), float(b)) for name, a, b in zip(names, low, high, strict=True)}
    found = mbody.fit(arm(*start), data | {"motor.effort": effort}, by)
    starts = (np.clip(truth * rng.uniform(0.1, 3.0, 3), low, high) for _ in range(6))
    ends = [
        least_squares(lambda p: torque(p) - effort, p, bounds=(low, high), x_scale="jac")
        for p in starts
    ]
    least = 2.0 * min(end.cost for end in ends)
    assert 40.0 * found.residual["motor.effort"] ** 2 <= least * (1.0 + 1e-6)
    values = dict(zip(names, truth.tolist(), strict=True))
    for one in found.combinations:
        inside = all(a <= values[name] <= b for name, (a, b) in one.within.items())
        assert not inside or abs(one.at(values) - one.value) < 4.0 * one.deviation
