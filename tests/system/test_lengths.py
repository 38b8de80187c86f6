"""Lengths of models and of their parts: no rounding remainder, no single far point, no origin."""

import math

import numpy as np
import pytest
from numpy.testing import assert_allclose

from mbody import Body, Contact, Mechanism, Revolute, SimulationSettings, Spring, assemble
from mbody.kernels.layout import inverse_masses


def lengths(*elements, ground=None, start=None, **options):
    made = Mechanism("lengths", ground=ground or {"O": (0.0, 0.0)}, **options)
    made.add(*elements)
    if start is not None:
        made.simulation = SimulationSettings(1.0, start)
    return assemble(made)


def rod(name="rod", length=0.8, **more):
    points = {"E": (length, 0.0)} | more
    return Body(name, mass=1.0, inertia=0.05, cg=(0.5 * length, 0.0), points=points)


@pytest.mark.parametrize("place", [1e-12, 3.0, 1e6])
def test_where_a_body_begins_is_no_length(place):
    ball = Body("ball", mass=2.0, inertia=0.08)
    assert lengths(ball, start={"ball": {"x": place, "y": 0.0, "angle": 0.0}}).length == 0.2


def test_a_rounding_remainder_is_none():
    off = 0.3 - (0.1 + 0.2)  # −5.6e-17
    body = Body("disc", mass=2.0, inertia=0.08, cg=(0.3, 0.0), points={"C": (0.1 + 0.2, 0.0)})
    assert off and lengths(body, Revolute("O", "ground.O", "disc.C")).length == 0.2


@pytest.mark.parametrize("off", [0.0, 1.1e-16, 1e-8, 1e-3])
def test_a_joint_all_but_at_the_mass_centre_makes_no_body_heavy(off):
    """A slider at the tip of a rod: masses that are there are not replaced."""
    slider = Body("slider", mass=0.9, inertia=0.001, cg=(off, 0.0))
    joints = Revolute("O", "ground.O", "rod"), Revolute("P", "rod.E", "slider")
    made = lengths(rod(), slider, *joints)
    assert_allclose(made.spans, [0.4, math.sqrt(0.001 / 0.9)])
    weights = inverse_masses(made.layout, made.mass, made.sizes)
    assert_allclose(weights[:6, 0], 1.0 / made.mass[:6, 0])


@pytest.mark.parametrize("far", [1e6, 3e8])
def test_one_far_point_is_none(far):
    body = rod(F=(far, 0.0))
    joints = Revolute("O", "ground.O", "rod"), Revolute("P", "rod.F", "other")
    assert lengths(body, rod("other"), *joints).length == 0.4


def test_ground_points_count_by_their_distances():
    wheel = Body("wheel", mass=0.0, inertia=0.0)
    pins = Revolute("A", "ground.A", "wheel"), Revolute("B", "ground.B", "wheel")
    found = lengths(wheel, *pins, ground={"A": (1e5, 0.0), "B": (1e5, 0.25)})
    assert_allclose(found.length, 0.25)


def test_a_disc_and_a_far_line():
    disc = Body(
        "disc", mass=1.0, points={"C": (0.0, 0.0)}, shapes={"rim": {"disc": "C", "radius": 3e-6}}
    )
    made = lengths(
        disc,
        Contact("touch", "ground.floor", "disc.rim"),
        ground={"far": (1e6, 0.0)},
        ground_shapes={"floor": {"line": {"point": "far"}}},
    )
    assert made.length == 3e-6


def test_each_part_has_its_own():
    tiny = Body("tiny", mass=1.0, inertia=1e-12, cg=(2e-6, 0.0))
    great = Body("great", mass=1.0, inertia=1e6, cg=(500.0, 0.0))
    made = lengths(tiny, great, *(Revolute(f"{n}O", "ground.O", n) for n in ("tiny", "great")))
    assert made.length == 500.0
    assert_allclose(made.lengths, [2e-6, 500.0])
    assert_allclose(made.coordinate_units, [2e-6, 2e-6, 1.0, 500.0, 500.0, 1.0])
    assert made.parts == (0, 1)


def test_powers_of_two_scale_all_of_them():
    def scaled(unit):
        body = Body("disc", mass=1.0, inertia=0.3 * unit**2, cg=(0.1 * unit, 0.0))
        spring = Spring("s", "ground.O", "disc", stiffness=1.0, free_length=0.7 * unit)
        return lengths(body, spring)

    one, other = scaled(1.0), scaled(2.0**-40)
    assert_allclose(other.sizes, one.sizes * 2.0**-40, rtol=0)
    assert np.isfinite(one.sizes).all()
