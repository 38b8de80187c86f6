"""Rises and cams against their published accelerations and peaks."""

import math

import numpy as np
import pytest
from scipy.integrate import quad

from mbody.laws import SHAPES, Constant, Rise
from tests.support.law_examples import CAM

PI = math.pi


def published_acceleration(shape, u):
    """s″ of a unit rise as Norton's handbook prints it, each part by itself."""
    if shape == "cycloidal":
        return 2 * PI * math.sin(2 * PI * u)
    if shape == "harmonic":
        return PI**2 / 2 * math.cos(PI * u)
    if shape == "3-4-5":
        return 60 * u - 180 * u**2 + 120 * u**3
    if shape == "4-5-6-7":
        return 420 * u**2 - 1680 * u**3 + 2100 * u**4 - 840 * u**5
    if shape == "parabolic":
        return 4.0 if u < 0.5 else -4.0
    if shape == "modified-trapezoidal":
        peak = 4.888124
        if u < 1 / 8:
            return peak * math.sin(4 * PI * u)
        if u < 3 / 8:
            return peak
        if u < 5 / 8:
            return peak * math.cos(4 * PI * (u - 3 / 8))
        if u < 7 / 8:
            return -peak
        return -peak * math.cos(4 * PI * (u - 7 / 8))
    peak = 5.527957
    if u < 1 / 8:
        return peak * math.sin(4 * PI * u)
    if u < 7 / 8:
        return peak * math.cos(4 * PI / 3 * (u - 1 / 8))
    return -peak * math.cos(4 * PI * (u - 7 / 8))


@pytest.mark.parametrize("shape", SHAPES)
def test_rise_is_the_integral_of_the_published_acceleration(shape):
    rise = Rise(shape, 1.0, 0.0, 1.0)
    joins = [1 / 8, 3 / 8, 1 / 2, 5 / 8, 7 / 8]
    for u in (0.05, 0.2, 0.3, 0.45, 0.6, 0.8, 0.95):
        f, f1, f2 = rise.derivatives(u)
        inner = [j for j in joins if j < u]
        a = published_acceleration(shape, u)
        v = quad(lambda w: published_acceleration(shape, w), 0, u, points=inner or None)[0]
        s = quad(
            lambda w, u=u: (u - w) * published_acceleration(shape, w), 0, u, points=inner or None
        )[0]
        assert (f, f1, f2) == pytest.approx((s, v, a), abs=2e-6)  # 7 printed digits


@pytest.mark.parametrize("shape", SHAPES)
def test_joins_of_a_rise_are_smooth(shape):
    rise = Rise(shape, 2.0, 1.0, 0.5, base=3.0)
    ends = () if shape in ("harmonic", "parabolic") else (0.0, 1.0)
    middle = () if shape == "parabolic" else (0.5,)
    for u in (*ends, 1 / 8, 3 / 8, *middle, 5 / 8, 7 / 8):
        x = 1.0 + 0.5 * u
        left, right = rise.derivatives(x - 1e-9), rise.derivatives(x + 1e-9)
        # over 2e-9 f'' moves by less than 2e-9 × (peak jerk 70 h/β³)
        assert left == pytest.approx(right, abs=2e-9 * 70 * 2.0 / 0.5**3)
    assert rise.derivatives(0.999) == (3.0, 0.0, 0.0)
    assert rise.derivatives(1.5) == (5.0, 0.0, 0.0)
    assert rise(1.25) == pytest.approx(4.0, abs=1e-15)
    u = np.linspace(0.0, 1.0, 101)  # mirror image: s(1 − u) = 1 − s(u)
    np.testing.assert_allclose(rise(1 + u / 2) + rise(1.5 - u / 2), 8.0, atol=1e-14)


def test_at_a_jump_the_value_to_the_right_is_given():
    rise = Rise("parabolic", 1.0, 0.0, 1.0)
    assert [rise.derivatives(x)[2] for x in (-1e-9, 0.0, 0.5, 1.0)] == [0.0, 4.0, -4.0, 0.0]


def test_a_cam_is_its_rises_one_after_another():
    t = np.linspace(0.0, 1.0, 21)
    parts = [  # where they really begin, and on which level
        (t, Rise("cycloidal", 3.0, 0.0, 1.0, -1.0)),
        (1.0 + t / 2, Constant(2.0)),
        (1.5 + t / 2, Rise("modified-sine", -1.0, 1.5, 0.5, 2.0)),
        (2.0 + t / 4, Constant(1.0)),
        (2.25 + t, Rise("4-5-6-7", -2.0, 2.25, 1.0, 1.0)),
        (3.25 + 0.7499 * t, Constant(-1.0)),
    ]
    for x, alone in parts:
        for turn in (-2, 0, 5):
            for found, expected in zip(
                CAM.derivatives(x + 4.0 * turn), alone.derivatives(x), strict=True
            ):
                np.testing.assert_allclose(found, expected, atol=1e-12)
    assert CAM(4.0) == CAM(0.0) == -1.0
    assert CAM(np.nextafter(4.0, 0.0)) == -1.0
