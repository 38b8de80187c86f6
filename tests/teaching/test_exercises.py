"""Exercises: drawn with round numbers, buildable, the same for the same seed, and solved right."""

import math
import re

import numpy as np
import pytest

import mbody
from mbody.teaching import exercises, least_transmission, new_model

VARY = {"a": ("30 mm", "50 mm"), "c": ("70 mm", "90 mm")}


def made(kind):
    text = new_model(kind)
    return lambda values: mbody.from_toml(text, parameters=values)


def sheet(seed, count=6, vary=VARY, kind="fourbar"):
    return exercises(made(kind), vary, count, seed)


@pytest.mark.slow
def test_the_same_seed_makes_the_same_sheet():
    one, same, other = sheet(7), sheet(7), sheet(8)
    assert one.sheet("x") == same.sheet("x") and one.worked() == same.worked()
    assert one.sheet("x") != other.sheet("x")
    values = [(*e.values.items(), e.position) for e in one.exercises]
    assert len(set(values)) == 6


def test_numbers_are_round_and_within_bounds():
    for one in sheet(3).exercises:
        for (low, high), value in zip(VARY.values(), one.values.values(), strict=True):
            number, unit = value.split()
            assert unit == "mm" and float(number) % 2 == 0
            assert float(low.split()[0]) <= float(number) <= float(high.split()[0])
        assert float(one.position.rstrip("°")) % 5 == 0


def four_bar_angles(a, b, c, d, theta):
    """Open four-bar by the law of cosines, fixed pivots on the x axis: coupler and rocker [rad]."""
    ax, ay = a * math.cos(theta), a * math.sin(theta)
    diagonal = math.hypot(d - ax, -ay)
    direction = math.atan2(-ay, d - ax)
    at_a = math.acos((diagonal**2 + b**2 - c**2) / (2 * diagonal * b))
    coupler = direction + at_a
    bx, by = ax + b * math.cos(coupler), ay + b * math.sin(coupler)
    return coupler, math.atan2(by, bx - d)


def lengths(one):
    values = {name: float(value.split()[0]) for name, value in one.values.items()}
    return values["a"], 120.0, values["c"], 100.0


def test_designs_turn_in_one_circuit_and_transmit_well():
    """Grashof with the crank the shortest, and the closed form of the least transmission angle."""
    for one in sheet(5, 12).exercises:
        a, b, c, d = lengths(one)
        assert a == min(a, b, c, d) and 2 * (min(a, b, c, d) + max(a, b, c, d)) <= a + b + c + d
        angles = []
        for theta in np.linspace(0.0, 2.0 * np.pi, 721):
            square = a * a + d * d - 2 * a * d * math.cos(theta)
            angles.append(math.acos(abs(b * b + c * c - square) / (2 * b * c)))
        # the crank of the model begins at 60 deg: 73 instants are multiples of 5 deg
        assert one.transmission == pytest.approx(min(angles), abs=1e-9)
        assert one.transmission >= math.radians(30.0)


def test_the_key_has_the_angles_of_the_closed_form():
    found = sheet(2, 8)
    for one in found.exercises:
        theta = math.radians(float(one.position.rstrip("°")))
        coupler, rocker = four_bar_angles(*lengths(one), theta)
        for body, wanted in (("coupler", coupler), ("rocker", rocker)):
            angle = float(one.run[body].angle[0])
            assert math.remainder(angle - wanted, 2 * math.pi) == pytest.approx(0.0, abs=1e-9)
        assert one.solution.gap < 1e-9 and one.solution.residual < 1e-9
    key = found.worked()
    assert all(f"## {n}: Loop 1" in key for n in range(1, 9))
    # the angle of the coupler stands in the key as in the closed form
    text = f"{math.degrees(coupler):.4f}".rstrip("0")
    assert rf"\cos({text}^\circ)" in key


@pytest.mark.parametrize("degrees", [0, 60, 100, 180])
def test_the_transmission_of_a_four_bar(degrees):
    """cos μ = (b² + c² − a² − d² + 2 a d cos θ)/(2 b c), acute."""
    theta = math.radians(degrees)
    cosine = (9 + 4 - 1 - 3.5**2 + 7 * math.cos(theta)) / 12
    run = mbody.kinematics(mbody.makers.four_bar(1, 3, 2, 3.5, start=theta), [0.0])
    assert least_transmission(run) == pytest.approx(math.acos(abs(cosine)), abs=1e-9)


@pytest.mark.parametrize(
    ("kind", "vary"),
    [
        ("slidercrank", {"r": ("30", "50"), "force": ("300 N", "700 N")}),
        ("gears", {"r1": ("15", "25")}),
        ("cam", {"lift": ("10 mm", "20 mm")}),
        ("sixbar", {"f": ("78 mm", "84 mm")}),
    ],
)
def test_other_mechanisms(kind, vary):
    found = sheet(1, 2, vary, kind)
    text = found.sheet("figures")
    assert text.count("## Exercise ") == 2 and text.count("figures/exercise_") == 2
    for name in vary:
        assert re.search(rf"\| {name} \| [\d.]+ \w+", text), name
    assert all(max(e.solution.gap, e.solution.residual) < 1e-9 for e in found.exercises)
