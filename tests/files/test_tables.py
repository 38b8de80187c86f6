"""Tables go between their points as requested, and say so where they are left."""

import math
import sys

import numpy as np
import pytest
from scipy.interpolate import CubicSpline, PchipInterpolator

import mbody
from mbody.laws import Table

STEP = [0.0, 0.2, 0.21, 0.6, 0.61, 1.0], [0.0, 0.0, 2000.0, 2000.0, 0.0, 0.0]
EPS = sys.float_info.epsilon


def points(count, seed):
    rng = np.random.default_rng(seed)
    return np.cumsum(rng.uniform(0.1, 2.0, count)), rng.normal(size=count)


# -- between the points ---------------------------------------------------------------------------


@pytest.mark.parametrize("count", [2, 3, 4, 9, 40])
@pytest.mark.parametrize("seed", range(4))
def test_each_interpolation_is_that_of_numpy_and_scipy(count, seed):
    x, y = points(count, seed)
    at = np.linspace(x[0], x[-1], 301)
    linear = Table(x, y, interpolation="linear")
    # some tens of roundings of numbers of size 3
    np.testing.assert_allclose(linear(at), np.interp(at, x, y), atol=64 * EPS)
    assert not linear.derivatives(at)[2].any()
    for kind, other in (("pchip", PchipInterpolator), ("spline", CubicSpline)):
        theirs = other(x, y)
        ours = Table(x, y, interpolation=kind).derivatives(at[1:-1])
        for order, value in enumerate(ours):
            size = np.abs(theirs(at, order)).max()
            off = np.abs(value - theirs(at[1:-1], order))
            # f″ of a cubic jumps at its points, where rounding decides the side
            near = np.abs(at[1:-1, None] - x).min(axis=1) < 1e-9
            assert off[~near].max() <= 1e-11 * max(size, 1.0), (kind, order)


@pytest.mark.parametrize("kind", ["linear", "pchip", "spline"])
@pytest.mark.parametrize("seed", range(3))
def test_a_periodic_table_repeats_with_its_derivatives(kind, seed):
    x, y = points(7, seed)
    y[-1] = y[0]
    table = Table(x, y, periodic=True, interpolation=kind)
    period = x[-1] - x[0]
    at = np.linspace(x[0], x[-1], 57)[1:-1]
    for shift in (-2, 1, 5):
        np.testing.assert_allclose(table(at + shift * period), table(at), atol=1e-12)
    before, after = table.derivatives(x[-1] - 1e-9)[1], table.derivatives(x[-1] + 1e-9)[1]
    if kind != "linear":  # f″ is at most some tens here
        assert before == pytest.approx(after, abs=1e-6)


@pytest.mark.parametrize("seed", range(20))
def test_no_default_of_a_load_overshoots(seed):
    x, y = points(12, seed)
    y = np.round(y)  # flat parts and jumps
    table = mbody.Force("F", "body", Table(x, y)).value
    assert table.interpolation == "pchip" and table.beyond() is None
    f = table(np.linspace(x[0], x[-1], 4001))
    assert f.min() >= y.min() - 1e-13 and f.max() <= y.max() + 1e-13
    for k in range(11):  # monotone between neighbours
        part = np.diff(table(np.linspace(x[k], x[k + 1], 101)[:-1]))
        assert (part * np.sign(y[k + 1] - y[k]) >= -1e-13).all()


def test_a_motion_is_smooth_and_a_load_within_its_points_by_default():
    table = Table(*STEP)
    smooth = [
        mbody.AngleDriver("d", "b", table).law,
        mbody.CoordinateDriver("d", "ground", "b", table).law,
        mbody.CamFollower("c", "a", "b", profile=table, base_radius=1.0).profile,
    ]
    within = [
        mbody.Force("F", "b", table).value,
        mbody.Spring("s", "ground", "b", law=table).law,
        mbody.Damper("s", "ground", "b", law=table).law,
        mbody.TorsionSpring("s", "b", law=table).law,
        mbody.TorsionDamper("s", "b", law=table).law,
        mbody.Gravity("g", y=table).y,
    ]
    assert {law.interpolation for law in smooth} == {"spline"}
    assert {law.interpolation for law in within} == {"pchip"}
    assert mbody.Force("F", "b", Table(*STEP, end="natural")).value.interpolation == "spline"
    assert (
        mbody.Force("F", "b", Table(*STEP, interpolation="linear")).value.interpolation == "linear"
    )


def test_text_in_a_table_chooses_as_numbers_do():
    machine = slide()
    machine.add(mbody.Force("F", "m", Table(["0 s", "0.5 s"], ["0 N", "3 N"])))
    assert machine["F"].value.interpolation == "pchip"


def test_beyond_finds_the_farthest_place():
    """Against a fine scan of the spline."""
    table = Table(*STEP)
    place, value = table.beyond()
    at = np.linspace(0.0, 1.0, 1_000_001)
    f = table(at)
    assert value == pytest.approx(f.min(), rel=1e-9)
    assert place == pytest.approx(at[f.argmin()], abs=1e-6)
    assert Table([0, 1, 2, 3], [0, 1, 2, 3]).beyond() is None


def slide(**how):
    machine = mbody.Mechanism("slide", **how)
    machine.add(mbody.Body("m", mass=1.0), mbody.Prismatic("guide", "ground", "m"))
    return machine


@pytest.mark.parametrize("kind", [None, "linear", "pchip", "spline"])
def test_an_analysis_takes_the_interpolation(tmp_path, kind):
    """On lanes, step by step, and from files with a CSV: the effort balances the load."""
    (tmp_path / "cut.csv").write_text("t,F\n" + "".join(f"{a},{b}\n" for a, b in zip(*STEP)))
    more = "" if kind is None else f', interpolation = "{kind}"'
    (tmp_path / "m.toml").write_text(
        'units = "SI"\n[bodies]\nm = { mass = 1 }\n[joints]\ng = { prismatic = ["ground", "m"] }\n'
        '[drivers]\nd = { coordinate = ["ground", "m"], law = 0 }\n'
        f'[loads]\nF = {{ force = {{ table = {{ file = "cut.csv"{more} }} }}, at = "m" }}\n',
        "utf-8",
    )
    machine = mbody.load(tmp_path / "m.toml")
    wanted = {"linear": lambda t: np.interp(t, *STEP), "spline": CubicSpline(*STEP)}.get(
        kind, PchipInterpolator(*STEP)
    )
    for count in (5, 601):
        run = mbody.kinetostatics(machine, t=np.linspace(0.0, 1.0, count))
        np.testing.assert_allclose(-run.effort("d"), wanted(run.t), atol=1e-7)
        noted = any("leaves the range" in note for note in run.notes)
        assert noted == (kind == "spline") and run.status == "completed"
    assert mbody.from_toml(mbody.to_toml(machine)) == machine


def test_linear_force_in_a_free_motion():
    """v(1) is the area below the straight lines."""
    machine = slide()
    machine.add(mbody.Force("F", "m", Table(*STEP, interpolation="linear")))
    # the steps do not end at the corners of the table: what lies within a step across one is met to
    # some hundred times rtol, as the steps happen to lie
    run = mbody.simulate(machine, 1.0, rtol=1e-12)
    area = np.trapezoid(STEP[1], STEP[0])
    assert run["m"].vx[-1] == pytest.approx(area, rel=1e-9)
    assert run.status == "completed"


# -- beyond the points ----------------------------------------------------------------------------


@pytest.mark.parametrize("outside", ["hold", "line"])
@pytest.mark.parametrize("analysis", ["kinetostatics", "simulate"])
def test_a_result_beyond_a_table_of_time_is_doubtful(outside, analysis):
    machine = slide()
    machine.add(mbody.Force("F", "m", Table([0.0, 0.5], [0.0, 3.0], outside=outside)))
    if analysis == "simulate":
        within, beyond = (mbody.simulate(machine, t) for t in (0.5, 0.8))
    else:
        machine.add(mbody.CoordinateDriver("d", "ground", "m", 0.0))
        within, beyond = (mbody.kinetostatics(machine, t=[0.0, t]) for t in (0.5, 0.8))
    assert within.status == "completed" and not within.doubts
    (doubt,) = beyond.doubts
    assert doubt.kind == "extrapolation" and doubt.elements == ("F",)
    assert beyond.status.startswith("doubtful: 'F': the table of its value covers 0 to 0.5 s")
    assert "0 to 0.8 s" in doubt.message
    assert doubt.t == pytest.approx(0.5 if analysis == "simulate" else 0.8)


LAWS = {
    "spring": lambda law: mbody.Spring("s", "ground.C", "bob.P", free_length=1.0, law=law),
    "damper": lambda law: mbody.Damper("s", "ground.C", "bob.P", law=law),
    "torsion spring": lambda law: mbody.TorsionSpring("s", "bob", free_angle=0.2, law=law),
    "torsion damper": lambda law: mbody.TorsionDamper("s", "bob", law=law),
}


@pytest.mark.parametrize("kind", LAWS)
@pytest.mark.parametrize("batch", [False, True])
def test_what_a_law_goes_by_is_watched(kind, batch):
    """The argument by hand: a bob at the end of a rod of 1 that turns as 0.5 t², C at (0, 2)."""
    t = np.linspace(0.0, 2.0, 9)
    angle, omega = 0.5 * t**2, t
    apart = np.sqrt(1.0 + 4.0 - 4.0 * np.sin(angle))
    x = {
        "spring": apart - 1.0,
        "damper": -2.0 * np.cos(angle) * omega / apart,
        "torsion spring": angle - 0.2,
        "torsion damper": omega,
    }[kind]

    def run(low, high):
        machine = mbody.Mechanism("bob", ground={"C": (0.0, 2.0)})
        law = Table([low, 0.5 * (low + high), high], [1.0, 2.0, 3.0], outside="line")
        machine.add(
            mbody.Body("bob", mass=1.0, points={"P": (1.0, 0.0)}),
            mbody.Revolute("O", "ground", "bob"),
            mbody.AngleDriver("motor", "bob", "0.5 rad/s^2 * t^2"),
            LAWS[kind](law),
        )
        system = mbody.assemble(machine)
        if batch:
            system = system.with_values({"bob.mass": [1.0, 2.0]})
        return mbody.kinetostatics(system, t=t)

    span = np.ptp(x)
    assert not run(x.min() - 1e-6 * span, x.max() + 1e-6 * span).doubts
    for low, high in ((x.min() + 0.01 * span, x.max() + 1.0), (x.min() - 1.0, x.max() - 0.01)):
        (doubt,) = run(low, high).doubts
        assert doubt.kind == "extrapolation"
        assert doubt.t == pytest.approx(t[(x < low) | (x > high)].min())


def test_an_excursion_between_kept_instants_is_seen():
    """A bob that swings to ±1 rad, kept at its zero crossings alone."""
    machine = mbody.Mechanism("swing")
    machine.add(
        mbody.Body("bob", mass=1.0, inertia=1.0, guess=0.0),
        mbody.Revolute("O", "ground", "bob"),
        mbody.TorsionSpring(
            "s", "bob", law=Table([-0.9, 0.0, 0.9], [-0.9, 0.0, 0.9], outside="line")
        ),
    )
    run = mbody.simulate(machine, 2 * math.pi, rates={"bob": 1.0}, instants=5)
    assert [doubt.kind for doubt in run.doubts] == ["extrapolation"]


def test_a_table_that_is_left_without_leave_is_still_refused():
    machine = slide()
    machine.add(
        mbody.Force("F", "m", Table([0.0, 0.5], [0.0, 3.0])),
        mbody.CoordinateDriver("d", "ground", "m", 0.0),
    )
    with pytest.raises((mbody.ModelError, mbody.SolveError), match="F"):
        mbody.kinetostatics(machine, t=[0.0, 0.8])
