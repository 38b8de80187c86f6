"""Measures that are one number of all instants, of models and sweeps: peak, rms, span, others."""

import numpy as np
import pytest

import mbody
from mbody import Event, ModelError, gallery
from mbody.model.simulation import REDUCTIONS, Measure


def over_time(a, t):
    """The mean over time of the straight lines between the instants."""
    parts = zip(a, a[1:], t, t[1:], strict=False)
    return sum(0.5 * (x + y) * (v - u) for x, y, u, v in parts) / (t[-1] - t[0])


PLAIN = {
    "max": lambda a, t: max(a),
    "min": lambda a, t: min(a),
    "peak": lambda a, t: max(map(abs, a)),
    "span": lambda a, t: max(a) - min(a),
    "rms": lambda a, t: over_time([x * x for x in a], t) ** 0.5,
    "mean": lambda a, t: over_time(a, t),
    "first": lambda a, t: a[0],
    "last": lambda a, t: a[-1],
}


def machine(**measures):
    made = gallery.load("norton_fourbar")
    made.measures.clear()
    made.measures.update({name: Measure(*of) for name, of in measures.items()})
    return made


def test_every_reduction_is_that_of_the_history():
    assert {*PLAIN, "integral"} == set(REDUCTIONS)
    own = machine(**{by: (f"{by}(motor.effort)", "N*m") for by in PLAIN})
    run = mbody.kinetostatics(own, turn="motor", instants=37)
    history = (run.effort("motor") * 4.4482216152605 * 0.0254).tolist()
    for by, plain in PLAIN.items():
        found = run.measure(by)
        assert found.shape == (37,) and np.ptp(found) == 0.0
        # a sum of 37 numbers
        assert found[0] == pytest.approx(plain(history, run.t.tolist()), rel=1e-13, abs=1e-13)
    assert run.measure("at(motor.effort, 3)")[0] == run.effort("motor")[3]


def arm(units="SI", speed="2 rad/s"):
    made = mbody.Mechanism("arm", units=units)
    made.add(
        mbody.Body("arm", mass="3 kg", inertia="0.1 kg*m^2", cg=("0.5 m", 0.0)),
        mbody.Revolute("O", "ground", "arm"),
        mbody.AngleDriver("motor", "arm", mbody.laws.ConstantSpeed(0.0, speed)),
        mbody.Gravity("gravity", y="-10 m/s^2"),
    )
    return made


@pytest.mark.parametrize("units", ["SI", "mm-N-ms", "in-lbf-s", "cm-kN-min"])
def test_an_integral_over_time(units):
    """The work of a motor that lifts an arm at a constant rate, P = m g r ω cos ωt: m g r sin ωT,
    of which the trapezoidal rule has the part h/2 cot h/2, with the angle h between instants.
    """
    own = arm(units)
    own.measures["work"] = Measure("integral(motor.power)", "J")
    own.measures["heat"] = Measure("motor.power", "W")
    t = np.linspace(0.0, 0.6, 31) * own.units.second
    run = mbody.kinetostatics(own, t)
    half = 0.5 * 2.0 * 0.6 / 30
    exact = 3.0 * 10.0 * 0.5 * np.sin(1.2) * half / np.tan(half)
    # rounding of units and of a sum of 31 numbers
    assert run.measure("work")[0] == pytest.approx(exact, rel=1e-13)
    joule = float(own.units.unit("torque").ratio)
    assert run.measure("integral(motor.power)")[0] * joule == pytest.approx(exact, rel=1e-13)
    assert run.measure("integral(arm.omega)")[0] == pytest.approx(1.2, rel=1e-13)
    masses = {"arm.mass": ["3 kg", "6 kg"]}
    found = mbody.sweep(own, masses, measure=["work", "integral(heat)"], t=t)
    for name, unit in (("work", 1.0), ("integral(heat)", joule)):
        assert found[name] * unit == pytest.approx([exact, 2.0 * exact], rel=1e-13)
    assert found.units["work"] == "J"
    slope = mbody.gradient(own, "work", ["arm.mass", "arm.cg.x"], t=t)
    numbers = mbody.assemble(own).values
    logarithmic = slope.jacobian[0] * [numbers["arm.mass"], numbers["arm.cg.x"]]
    assert logarithmic == pytest.approx([exact, exact], rel=1e-12)


@pytest.mark.parametrize("way", ["measure", "sweep", "gradient", "optimize", "summary"])
def test_means_are_over_the_motion_whatever_the_grid(way):
    """P = m g r ω cos ωt on a grid that is a hundred times as fine at one end: the mean is
    m g r sin(ωT)/T, the root mean square m g r ω √(½ + sin(2ωT)/(4 ωT)).
    """
    own, end, speed = arm(), 0.6, 2.0
    u = np.linspace(0.0, 1.0, 2001)
    t = end * (0.01 * u + 0.99 * u**2)
    mean = 15.0 * np.sin(speed * end) / end
    rms = 15.0 * speed * np.sqrt(0.5 + np.sin(2.0 * speed * end) / (4.0 * speed * end))
    if way == "measure":
        run = mbody.kinetostatics(own, t)
        found = [run.measure(f"{by}(motor.power)")[0] for by in ("mean", "rms")]
        equal = run.measure("motor.power").mean()
        assert abs(equal - mean) > 0.05 * mean  # what equal weights would give
    elif way == "sweep":
        measures = {"mean": "mean(motor.power)", "rms": "rms(motor.power)"}
        study = mbody.sweep(own, {"arm.mass": ["3 kg", "6 kg"]}, measure=measures, t=t)
        found = [study["mean"][0], study["rms"][0]]
        assert study["mean"][1] == pytest.approx(2.0 * found[0], rel=1e-12)
    elif way == "gradient":
        # both are in proportion to the mass
        measures = ["mean(motor.power)", "rms(motor.power)"]
        slope = mbody.gradient(own, measures, "arm.mass", t=t)
        found = [3.0 * slope[name]["arm.mass"] for name in measures]
    elif way == "optimize":
        # the mass with which the mean is a given one
        found = []
        for by, exact in (("mean", mean), ("rms", rms)):
            best = mbody.optimize(
                own,
                maximize=f"{by}(motor.power)",
                by={"arm.mass": ("1 kg", "9 kg")},
                subject_to=f"{by}(motor.power) <= {2.0 * float(exact)} W",
                t=t,
            )
            found.append(exact * best.values["arm.mass"] / 6.0)
    else:
        text = str(mbody.kinetostatics(own, t)).partition("TORQUES")[2]
        line = next(line for line in text.splitlines() if " motor " in line)
        # torques, to the six digits of a summary
        cells = [float(cell) for cell in line.split()[2:6]]
        assert cells[2:] == pytest.approx([mean / speed, rms / speed], rel=2e-5)
        return
    # the error of the rule, (ω h)²/12 with steps of at most 6e-4 s, is 1.2e-7
    assert found == pytest.approx([mean, rms], rel=1e-6)


def test_means_of_a_turn_whose_time_moves():
    """Over a turn the mean angle is that of its ends whatever the speed, the mean power against a
    damper c ω²: derivatives by ω are 0 and 2 c ω, and those of root mean squares.
    """
    own = arm(speed="2 rad/s")
    own.add(mbody.TorsionDamper("oil", "arm", coefficient="0.25 N*m*s/rad"))
    measures = ["mean(arm.angle)", "rms(arm.angle)", "mean(oil.torque)", "rms(oil.torque)"]
    found = mbody.gradient(own, measures, "motor.law.speed", turn="motor", instants=61)
    slopes = [found[name]["motor.law.speed"] for name in measures]
    # torque ±c ω; sums of 61 numbers
    assert np.abs(slopes) == pytest.approx([0.0, 0.0, 0.25, 0.25], abs=1e-12)


def test_an_integral_over_a_turn_whose_time_moves():
    """Work against a damper, c ω² T of a turn T = 2π/ω: its derivative by ω is 2π c."""
    own = arm(speed="2 rad/s")
    own.add(mbody.TorsionDamper("oil", "arm", coefficient="0.25 N*m*s/rad"))
    names = ["motor.law.speed", "oil.coefficient"]
    found = mbody.gradient(own, "integral(motor.power)", names, turn="motor", instants=61)
    exact = [2.0 * np.pi * 0.25, 4.0 * np.pi]
    assert found.value["integral(motor.power)"] == pytest.approx(np.pi, rel=1e-12)
    np.testing.assert_allclose(found.jacobian[0], exact, rtol=1e-11)
    designs = mbody.sweep(
        own,
        {"motor.law.speed": [1.0, 2.0, 3.0]},
        measure="integral(motor.power)",
        turn="motor",
        instants=61,
    )
    by_speed = 2.0 * np.pi * 0.25 * np.array([1.0, 2.0, 3.0])
    np.testing.assert_allclose(designs["integral(motor.power)"], by_speed, rtol=1e-11)


def test_an_integral_of_a_motion_that_an_event_ends():
    """∫ω dt of a falling pendulum up to an angle is that angle, whenever it gets there: its
    derivatives vanish as the instants become many, while those of the time do not.
    """
    end = Event("bob.angle + 1 rad", stop=True, name="there")
    settings = mbody.SimulationSettings(
        3.0, {"bob": {"angle": 0.0, "omega": 0.0}}, rtol=1e-12, instants=3001, events=[end]
    )
    own = mbody.Mechanism("pendulum", simulation=settings)
    own.add(
        mbody.Body("bob", mass=1.3, inertia=0.2, cg=(0.7, 0.0)),
        mbody.Revolute("O", "ground", "bob"),
        mbody.Gravity("gravity", y=-9.81),
    )
    names = ["bob.inertia", "gravity.y"]
    measures = ["integral(bob.omega)", "last(t)", "integral(bob.angle)"]
    found = mbody.gradient(own, measures, names, analysis="simulate")
    # the trapezoidal rule at steps of 1 ms: 1e-6 of the greatest rate of the integrand
    assert found.value["integral(bob.omega)"] == pytest.approx(-1.0, abs=2e-6)
    np.testing.assert_allclose(found.jacobian[0], 0.0, atol=2e-6)
    assert (np.abs(found.jacobian[1]) > 1e-2).all()
    system = mbody.assemble(own)
    for k, name in enumerate(names):
        start, ends = float(system.values[name]), []
        step = 1e-4 * abs(start)
        for way in (-2.0, -1.0, 1.0, 2.0):
            other = system.with_values({name: start + way * step})
            ends.append(mbody.simulate(other).measure("integral(bob.angle)")[0])
        numeric = (8.0 * (ends[2] - ends[1]) - (ends[3] - ends[0])) / (12.0 * step)
        # four places; motions to 1e-12 over steps of 1e-4
        assert found.jacobian[2, k] == pytest.approx(numeric, rel=1e-7)


def test_a_limit_of_an_integral():
    """The least torque against a damper with so much work over a turn: at the bound of the work."""
    own = arm(speed="2 rad/s")
    own.add(mbody.TorsionDamper("oil", "arm", coefficient="0.25 N*m*s/rad"))
    found = mbody.optimize(
        own,
        maximize="mean(motor.effort)",
        by={"oil.coefficient": (0.1, 0.5)},
        subject_to=["integral(motor.power) <= 4 J"],
        over="motor",
        instants=61,
        starts=3,
    )
    # 2π c ω = 4; the limits of the search hold to 1e-6
    assert found.values["oil.coefficient"] == pytest.approx(1.0 / np.pi, rel=1e-6)


def test_sweeps_take_them_by_name():
    own = machine(pin=("peak(A.force)", "N"), swing=("span(rocker.angle)", "deg"))
    lengths = {"rocker.B.x": [9.5, 10.5]}
    by_name = mbody.sweep(own, lengths, over="motor", instants=37)
    by_text = mbody.sweep(
        own,
        lengths,
        measure={
            "pin": Measure("peak(A.force)", "N"),
            "swing": Measure("span(rocker.angle)", "deg"),
        },
        over="motor",
        instants=37,
    )
    for name in ("pin", "swing"):
        assert by_name[name].shape == (2,)
        assert np.array_equal(by_name[name], by_text[name])
    with pytest.raises(ModelError, match="'pin' is one number of all instants already"):
        mbody.sweep(own, lengths, measure="rms(pin)", over="motor")


def test_the_gradient_of_a_span_is_that_of_differences():
    own = gallery.load("norton_fourbar")
    found = mbody.gradient(own, "span(coupler.P.y)", ["crank.A.x", "rocker.B.x"], turn="motor")
    system = mbody.assemble(own)
    for k, name in enumerate(("crank.A.x", "rocker.B.x")):
        start, step = float(system.values[name]), 1e-5
        ends = [
            mbody.kinetostatics(system.with_values({name: start + s * step}), turn="motor").measure(
                "span(coupler.P.y)"
            )[0]
            for s in (1, -1)
        ]
        # central differences: error of the order step² and rounding 1e-14/step
        slope = (ends[0] - ends[1]) / (2 * step)
        assert np.ravel(found.jacobian)[k] == pytest.approx(slope, rel=1e-7)


def test_an_aim_and_a_limit_may_be_a_span():
    found = mbody.optimize(
        gallery.load("norton_fourbar"),
        minimize="peak(motor.effort)",
        by={"rocker.B.x": (9.0, 11.0)},
        subject_to=["span(rocker.angle) <= 1 rad"],
        over="motor",
        instants=73,
        starts=1,
    )
    length = found.values["rocker.B.x"]
    system = mbody.assemble(gallery.load("norton_fourbar")).with_values({"rocker.B.x": length})
    run = mbody.kinetostatics(system, turn="motor", instants=73)
    # the limits of the search hold to 1e-6
    assert np.ptp(run["rocker"].angle) <= 1 + 1e-6
