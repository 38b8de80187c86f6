"""The rows of two circles that touch, against complex steps and the velocities of their points."""

import numpy as np
import pytest

from mbody.model.joints import CONSTRAINTS

STEP = 1e-30


def side(q, v):
    """A body as physics takes it: (x, y, θ, cos θ, sin θ, vx, vy, ω)."""
    return (q[0], q[1], q[2], np.cos(q[2]), np.sin(q[2]), *v)


def row(kind, q, v, parameters, law=(0.0, 0.0, 0.0)):
    """Φ, Φ_q and γ of the one row."""
    physics = CONSTRAINTS[kind].function
    phi, blocks, _, gamma = physics(side(q[:3], v[:3]), side(q[3:], v[3:]), parameters, law)
    return phi[0], np.array([*blocks[:3], *blocks[6:9]]), gamma[0]


@pytest.fixture(params=range(5))
def pose(request):
    rng = np.random.default_rng(request.param)
    return rng.normal(size=6), rng.normal(size=6), rng.normal(size=4)


def test_clearance(pose):
    q, v, arms = pose
    parameters = (*arms, 0.0, 0.0, 0.0)
    _, block, gamma = row("clearance", q, v, parameters)
    ahead = row("clearance", q + 1j * STEP * v, v, parameters)
    assert ahead[0].imag / STEP == pytest.approx(block @ v, rel=1e-12)
    assert ahead[1].imag / STEP @ v == pytest.approx(-gamma, rel=1e-11)


def test_slipping(pose):
    """Its rate is n·ḋ − |d| (p₄ω_i + p₅ω_j); γ is what of its change has no acceleration."""
    q, v, arms = pose
    parameters = (*arms, 0.7, 0.3, 0.2)
    _, block, gamma = row("slipping", q, v, parameters)
    ahead = row("slipping", q + 1j * STEP * v, v, parameters)
    assert ahead[1].imag / STEP @ v == pytest.approx(-gamma, rel=1e-11)
    centres, rates = [], []
    for n in (0, 3):
        c, s = np.cos(q[n + 2]), np.sin(q[n + 2])
        a, b = arms[0 if n == 0 else 2], arms[1 if n == 0 else 3]
        x, y = c * a - s * b, s * a + c * b
        centres.append(np.array([q[n] + x, q[n + 1] + y]))
        rates.append(np.array([v[n] - v[n + 2] * y, v[n + 1] + v[n + 2] * x]))
    way = centres[1] - centres[0]
    apart = float(np.hypot(*way))
    across = np.array([-way[1], way[0]]) / apart
    slides = across @ (rates[1] - rates[0]) - apart * (0.7 * v[2] + 0.3 * v[5])
    assert block @ v == pytest.approx(slides, rel=1e-12)


@pytest.mark.parametrize("kind", ["clearance", "slipping"])
def test_coincident_centres_give_numbers(kind):
    zero = np.zeros(6)
    phi, block, gamma = row(kind, zero, np.ones(6), (0.0,) * 7)
    assert phi == 0.0
    assert np.isfinite(block).all()
    assert np.isfinite(gamma)
