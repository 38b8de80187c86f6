"""Corners and pulses of formulas: enclosures hold, places are right, motions see them."""

import math

import numpy as np
import pytest

import mbody
from mbody import Body, Mechanism, Revolute, Torque
from mbody.laws import Expression, Function, compile_formula
from mbody.laws.steep_places import enclosed, steep_places
from mbody.quantities import FormulaError, Scope, read
from mbody.quantities.units import DIMENSIONS


def law(text):
    """A formula of t without units."""
    whole = text.replace("T", "(t/(1 s))")
    return compile_formula(read(whole, None), Scope(), DIMENSIONS["time"])[0]


ONE = (
    "sin",
    "cos",
    "tan",
    "exp",
    "sqrt",
    "log",
    "atan",
    "asin",
    "acos",
    "abs",
    "sign",
    "step",
    "-",
)
TWO = ("({}) + ({})", "({}) - ({})", "({})*({})", "({})/({})", "min({}, {})", "max({}, {})")
TWO += ("hypot({}, {})", "atan2({}, {})", "({})^2", "({})^3", "abs({})^2.5", "({})^(-1)")


def formula(rng, depth):
    """A random formula of T."""
    if depth == 0 or rng.random() < 0.15:
        return str(rng.choice(["T", f"({rng.uniform(-3, 3):.3f}*T + {rng.uniform(-1, 1):.3f})"]))
    if rng.random() < 0.5:
        return f"{rng.choice(ONE)}({formula(rng, depth - 1)})"
    return str(rng.choice(TWO)).format(formula(rng, depth - 1), formula(rng, depth - 1))


def test_enclosures_hold_values_and_rates():
    seen = 0
    for seed in range(150):
        rng = np.random.default_rng(seed)
        try:
            made = law(formula(rng, 3))
        except FormulaError:  # angles of atan and plain numbers
            continue
        if not isinstance(made, Expression):
            continue
        left = rng.uniform(-2.0, 2.0, 20)
        ends = np.array([left, left + 10.0 ** rng.uniform(-4.0, 0.5, 20)])
        with np.errstate(all="ignore"):
            value, rate, _ = enclosed(made, ends)
            for part in rng.uniform(0.0, 1.0, 30):
                f, g, _ = made.raw(ends[0] + part * (ends[1] - ends[0])).T
                for (low, high), met in ((value, f), (rate, g)):
                    size = 1e-9 * np.maximum(np.abs(met), 1.0)
                    known = np.isfinite(f) & np.isfinite(met)
                    inside = (low - size <= met) & (met <= high + size)
                    assert inside[known].all(), (seed, made.text)
                    seen += known.sum()
    assert seen > 50_000


PLACES = {
    "clamp((T - 0.5)/1e-4, 0, 1)*clamp((0.5005 - T)/1e-4, 0, 1)": [0.5, 0.5001, 0.5004, 0.5005],
    "abs(sin(30*T))": np.arange(1, 10) * math.pi / 30,
    "min(max(T - 0.2, 0), max(0.3 - T, 0))": [0.2, 0.25, 0.3],
    "3*max(sin(100*T) - 0.999, 0)": np.sort(
        [(n * 2 * math.pi + s) / 100 for n in range(16) for s in
         (math.asin(0.999), math.pi - math.asin(0.999))]
    ),
    "deadband(T - 0.4, 0.1)": [0.3, 0.5],
    "max(T, T)": [],
    "sin(30*T)": [],
}  # fmt: skip


@pytest.mark.parametrize("text", PLACES)
def test_corners_are_located(text):
    found = steep_places(law(text), 0.0, 1.0)
    np.testing.assert_allclose(found.kinks, PLACES[text], rtol=1e-14)
    assert not found.jumps.size


def test_jumps_are_told_from_corners():
    found = steep_places(law("3*step(T - 0.3)*step(0.3004 - T) + abs(T - 0.7)"), 0.0, 1.0)
    np.testing.assert_allclose(found.jumps, [0.3, 0.3004], rtol=1e-14)
    np.testing.assert_allclose(found.kinks, [0.7], rtol=1e-14)


@pytest.mark.parametrize("width", [1e-2, 1e-4, 1e-8])
@pytest.mark.parametrize("size", [1e-9, 1.0, 1e9])
def test_pulses_are_located(width, size):
    """Extrema at the middle, inflections where the second derivative of the text is zero."""
    pulses = {
        "exp(-((T - 0.377)/W)^2)": math.sqrt(0.5),
        "1/(1 + ((T - 0.377)/W)^2)": math.sqrt(1.0 / 3.0),
        "2/(exp((T - 0.377)/W) + exp(-(T - 0.377)/W))": math.asinh(1.0),
    }
    for text, inflection in pulses.items():
        whole = f"{size!r}*{text.replace('W', repr(width))}"
        found = steep_places(law(whole), 0.0, 1.0).pulses
        near = found[np.abs(found - 0.377) < 5.0 * width]
        wanted = 0.377 + width * inflection * np.array([-1.0, 0.0, 1.0])
        np.testing.assert_allclose(near, wanted, atol=1e-5 * width + 1e-15)


@pytest.mark.parametrize("text", ["5*sin(30*T)", "exp(-T)", "abs(sin(1e6*T))", "T/(1 + T)", "T^3"])
def test_what_is_smooth_or_fast_everywhere_has_none(text):
    assert not law(text).corners_between(0.0, 1.0).size


def wheel(value, **how):
    machine = Mechanism("wheel", **how)
    machine.add(
        Body("b", mass=1.0, inertia=0.1),
        Revolute("O", "ground", "b"),
        Torque("T", "b", value=value),
    )
    return machine


#: Torques with their impulses in N·m·s over a second.
PULSES = {
    "1000 N*m*exp(-((t - 0.377 s)/(0.1 ms))^2)": 0.1 * math.sqrt(math.pi),
    "200 N*m*clamp((t - 0.5 s)/(1e-4 s), 0, 1)*clamp((0.5005 s - t)/(1e-4 s), 0, 1)": 0.08,
    "50 N*m*step(t - 0.3 s)*step(0.3004 s - t)": 0.02,
    "10 N*m/(1 + ((t - 0.7 s)/(1 us))^2)": 1e-5 * (math.atan(3e5) + math.atan(7e5)),
    "3 N*m*sin(2 rad/s*t) + 500 N*m*max(0, 1 - abs(t - 0.2 s)/(20 us))": (
        1.5 * (1.0 - math.cos(2.0)) + 0.01
    ),
    "0.1 N*m*s/rad*b.omega*0 + 50 N*m*step(t - 0.3 s)*step(0.3004 s - t)": 0.02,
}


@pytest.mark.parametrize("text", PULSES)
def test_a_motion_sees_pulses(text):
    """By the other route: the impulse, by hand."""
    run = mbody.simulate(wheel(text), 1.0)
    assert run["b"].omega[-1] == pytest.approx(PULSES[text] / 0.1, rel=1e-6)
    assert run.status == "completed"
    simulator = mbody.Simulator(wheel(text))
    simulator.until(1.0)
    assert simulator["b"].omega == pytest.approx(PULSES[text] / 0.1, rel=1e-6)


def test_an_auxiliary_state_sees_them():
    machine = wheel("0 N*m")
    rate = "1000*exp(-((t - 0.377 s)/(0.1 ms))^2)/(1 s)"
    machine.add(mbody.State("z", rate=rate, start="0"))
    run = mbody.simulate(machine, 1.0)
    assert run.measure("z")[-1] == pytest.approx(0.1 * math.sqrt(math.pi), rel=1e-6)


def test_of_a_driver_the_rate_jumps_at_corners():
    """The work of the impulses is accounted, as at the points of a table."""
    machine = Mechanism("arm")
    machine.add(
        Body("b", mass=1.0, inertia=0.1, cg=(0.2, 0.0)),
        Revolute("O", "ground", "b"),
        mbody.AngleDriver("d", "b", "20 deg*max(0, sin(6 rad/s*t))"),
    )
    run = mbody.simulate(machine, 1.0)
    assert run.status == "completed"
    assert np.abs(run.energy.balance).max() < 1e-7 * run.energy.size


def test_a_driver_whose_law_jumps_is_doubted():
    machine = Mechanism("arm")
    machine.add(
        Body("b", mass=1.0, inertia=0.1, cg=(0.2, 0.0)),
        Revolute("O", "ground", "b"),
        mbody.AngleDriver("d", "b", "0.1 rad*step(t - 0.5 s)"),
    )
    (doubt,) = mbody.simulate(machine, 1.0).doubts
    assert (doubt.kind, doubt.elements, doubt.t) == ("validity", ("d",), 0.5)
    assert "jumps by 0.1 rad at t = 0.5 s" in doubt.message


def short(t):
    return 100.0 if 0.3 < t < 0.3004 else 0.0


def test_of_a_python_function_the_gap_is_noted():
    run = mbody.simulate(wheel(Function(short)), 1.0)
    (note,) = run.notes
    gap = float(note.partition("up to ")[2].partition(" s ")[0])
    assert 4e-4 < gap < 1.0 and "'T'" in note
    assert run["b"].omega[-1] == 0.0


def test_with_its_corners_it_is_seen():
    corners = [0.3, math.nextafter(0.3, 1.0), 0.3004]
    run = mbody.simulate(wheel(Function(short, corners=corners)), 1.0)
    assert run.notes == ()
    assert run["b"].omega[-1] == pytest.approx(0.4, rel=1e-6)
    assert mbody.simulate(wheel(Function(math.sin, corners=[])), 1.0).notes == ()
