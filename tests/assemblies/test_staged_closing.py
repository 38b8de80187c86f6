"""Designs far from the description: closed in stages, on its branch, failed ones as rows."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

import mbody
from mbody.errors import SolveError
from mbody.sweeps import together
from mbody.sweeps.job import EXPLAINED

TURN = 37


def shapes(count, seed, turning=True):
    """Random four-bars on a ground of length 1: crank, coupler, rocker, (count, 3). Those that turn
    have their crank shortest, by a margin: a change point has no branch.
    """
    rng, found = np.random.default_rng(seed), []
    while len(found) < count:
        r = np.array([rng.uniform(0.05, 0.9), *np.exp(rng.uniform(np.log(0.2), np.log(5.0), 2))])
        sizes = np.sort([1.0, *r])
        turns = r[0] == sizes[0] and sizes[0] + sizes[3] < sizes[1] + sizes[2] - 0.02
        near = min(abs(1.0 - r[0] - abs(r[1] - r[2])), abs(1.0 - r[0] - r[1] - r[2])) < 1e-3
        if turns if turning else not near:
            found.append(r)
    return np.array(found)


def swept(ratios, instants=TURN, crossed=False):
    machine = mbody.makers.four_bar(0.25, 0.75, 0.875, 1.0, start=0.0, crossed=crossed)
    names = ("crank.A.x", "coupler.B.x", "rocker.B.x")
    values = dict(zip(names, ratios.T, strict=True))
    measure = {"angle": "coupler.angle"}
    how = {"turn": "motor", "instants": instants} if instants > 1 else {"t": 0.0}
    return mbody.sweep(machine, together(values), "kinematics", measure, **how)


def coupler_angles(ratios, theta, crossed=False):
    """Freudenstein's closed form, as exp(iθ3)."""
    crank, coupler, rocker = (column[:, None] for column in ratios.T)
    way = 1.0 - crank * np.exp(1j * theta)
    size = np.abs(way)
    cosine = (coupler**2 + size**2 - rocker**2) / (2.0 * coupler * size)
    sign = -1.0 if crossed else 1.0
    return way / size * np.exp(1j * sign * np.arccos(cosine))


@pytest.mark.parametrize("crossed", [False, True])
def test_wide_shapes_close_on_the_branch_of_the_description(crossed):
    ratios = shapes(600, 3)
    found = swept(ratios, crossed=crossed)
    assert not found.failures and not found.doubts
    exact = coupler_angles(ratios, np.linspace(0.0, 2.0 * np.pi, TURN), crossed)
    # lanes accept corrections of 1e-12; near a change point (a margin of 0.02) they count 50 times
    assert np.abs(np.exp(1j * found["angle"]) - exact).max() < 1e-9


def test_designs_that_cannot_close_are_rows():
    ratios = shapes(300, 4, turning=False)
    found = swept(ratios, instants=1)
    crank, coupler, rocker = ratios.T
    closes = (np.abs(coupler - rocker) < 1.0 - crank) & (1.0 - crank < coupler + rocker)
    assert 40 < closes.sum() < 260
    assert_allclose(np.isfinite(found["angle"]), closes)
    assert set(found.failures) == set(np.flatnonzero(~closes).tolist())
    exact = coupler_angles(ratios[closes], np.zeros(1))[:, 0]
    assert np.abs(np.exp(1j * found["angle"][closes]) - exact).max() < 1e-9
    failed = sorted(found.failures)
    with pytest.raises(SolveError) as error:
        mbody.kinematics(found.design(failed[0]), 0.0)
    assert found.failures[failed[0]] == str(error.value)
    assert "of the way; analyse it alone to see the gap" in found.failures[failed[EXPLAINED]]


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore::mbody.errors.ModelWarning")
def test_a_six_bar_closes_as_by_many_small_steps():
    """Stages of the kernels against a design that is led there by hand, each from the last one."""
    system = mbody.assemble(mbody.gallery.load("watt_sixbar"))
    own = {n: v for n, v in system.values.items() if n.endswith((".x", ".y")) and ".cg" not in n}
    rng = np.random.default_rng(8)
    names = [name for name, value in own.items() if value]
    values = {n: own[n] * np.exp(rng.uniform(-0.45, 0.45, 40)) for n in names}
    measure = {body: f"{body}.angle" for body in system.bodies if body != "ground"}
    found = mbody.sweep(system, together(values), "kinematics", measure, t=0.0)
    compared = 0
    for design in range(40):
        guess, steps = None, 60
        try:
            for k in range(steps + 1):
                here = {n: own[n] + k / steps * (values[n][design] - own[n]) for n in names}
                run = mbody.kinematics(system.with_values(here), guess=guess)
                now = {body: float(run[body].angle[0]) for body in measure}
                if guess is not None and max(abs(now[b] - guess[b]) for b in now) > 0.3:
                    break  # so near to a singular position that these steps are too long
                guess = now
            else:
                compared += 1
                for body, angle in now.items():
                    assert abs(np.exp(1j * found[body][design]) - np.exp(1j * angle)) < 1e-9
        except SolveError:
            continue
    assert compared > 10
