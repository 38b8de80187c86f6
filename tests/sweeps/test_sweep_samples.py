"""The designs of a sweep: scatter, Latin hypercubes, seeds, lists that go together."""

import math

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy import stats

import mbody
from mbody.sweeps import (
    Normal,
    Triangular,
    Uniform,
    latin_hypercube,
    monte_carlo,
    sobol,
    together,
)
from mbody.sweeps.samples import drawn
from tests.support.sweep_designs import four_bar, slider_crank

# lanes accept a last correction of 1e-12; times the condition of the loops, below 10
LANE = 1e-11
CRANK, ROD, SPEED = 1.0, 3.0, 10.0


# -- the designs ------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("scatter", "of"),
    [
        (Normal(deviation=0.5), stats.norm(2.0, 0.5)),
        (Normal(tolerance=1.5), stats.norm(2.0, 0.5)),
        (Uniform(0.5), stats.uniform(1.5, 1.0)),
        (Triangular(0.5), stats.triang(0.5, 1.5, 1.0)),
    ],
)
def test_scatter_is_that_of_scipy(scatter, of):
    """The parts that a Sobol sequence draws, through SciPy's own inverse distributions."""
    system = mbody.assemble(four_bar())
    part = drawn(system, sobol({"rocker.B.x": (0.0, 1.0)}, 256, seed=2)).values[:, 0]
    found = drawn(system, sobol({"rocker.B.x": scatter}, 256, seed=2)).values[:, 0]
    # a part has an ulp of 1e-16, which the steepest of these, at 1/256², makes 1e-13
    assert_allclose(found, of.ppf(part), rtol=0, atol=1e-12)


def test_a_latin_hypercube_has_one_design_in_every_slice():
    system = mbody.assemble(four_bar())
    names = {"rocker.B.x": (1.0, 3.0), "crank.mass": (2.0, 4.0)}
    values = drawn(system, latin_hypercube(names, 50, seed=1)).values
    for column, low in zip(values.T, (1.0, 2.0), strict=True):
        assert_array_equal(np.sort(np.floor((column - low) / 2.0 * 50)), np.arange(50))


def test_seeds_say_the_designs():
    system = mbody.assemble(four_bar())
    for draw in (monte_carlo, sobol, latin_hypercube):
        same = [drawn(system, draw({"crank.mass": (1, 2)}, 20, seed=s)).values for s in (3, 3, 4)]
        assert_array_equal(same[0], same[1])
        assert (same[0] != same[2]).any()


def test_lists_go_together_and_text_has_units():
    found = mbody.sweep(
        slider_crank(),
        together({"crank.A.x": ["90 cm", 1.0], "motor.law.value": ["30 deg", 0.0]}),
        "kinematics",
        "rod.B.x",
    )
    assert list(found.axes) == ["design"]
    assert_allclose(found.parameter("crank.A.x"), [0.9, 1.0], rtol=1e-15)
    assert_allclose(found.parameter("motor.law.value"), [math.pi / 6.0, 0.0], rtol=1e-15)
    assert_allclose(found["rod.B.x"][1], CRANK + ROD, rtol=LANE)
