"""Mechanisms without arms that are far smaller or greater than the unit of length: against closed
forms, the same at every size.
"""

import math

import numpy as np
import pytest
from numpy.testing import assert_allclose

import mbody

SIZES = [1e-9, 1e-6, 2e-3, 1.0, 40.0, 1e3, 1e6]


def oscillator(size, units="SI"):
    """A block on a spring of the free length 2, which begins at 3."""
    machine = mbody.Mechanism("block on a spring", units=units, ground={"O": (0.0, 0.0)})
    machine.add(
        mbody.Body("block", mass=1.7, points={"P": (0.0, 0.0)}, guess=(3.0 * size, 0.0, 0.0)),
        mbody.Prismatic("rail", "ground", "block"),
        mbody.Spring("spring", "ground.O", "block.P", stiffness=3.3, free_length=2.0 * size),
    )
    return machine


@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize("units", ["SI", "mm-N-s"])
def test_a_block_on_a_spring_swings_alike_at_every_size(size, units):
    rate = math.sqrt(3.3 / 1.7)
    run = mbody.simulate(oscillator(size, units), 7.0, rtol=1e-10)
    assert run.status == "completed"
    # steps of rtol 1e-10, some tens of them
    assert_allclose(run["block"].x / size, 2.0 + np.cos(rate * run.t), rtol=0.0, atol=1e-8)
    found = mbody.modes(oscillator(size, units))
    # by differences of the forces
    assert_allclose(found[0].frequencies, [rate], rtol=1e-8)


@pytest.mark.parametrize("size", SIZES)
def test_it_rests_on_both_sides_at_every_size(size):
    places = sorted(float(one["block"].x[0]) / size for one in mbody.equilibrium(oscillator(size)))
    assert_allclose(places, [-2.0, 2.0], rtol=1e-9)


@pytest.mark.parametrize("size", [1e-9, 1e-6, 1.0, 1e4])
def test_a_ball_bounces_alike_at_every_size(size):
    """From a height of 1 above the floor, with e = 0.7: it comes to rest after (1 + e)/(1 − e)
    times the time of its first fall.
    """
    e, gravity, radius = 0.7, 9.81, 0.1
    machine = mbody.Mechanism(
        "ball", ground={"O": (0.0, 0.0)}, ground_shapes={"floor": {"line": {"point": "O"}}}
    )
    machine.add(
        mbody.Body(
            "ball",
            mass=1.0,
            inertia=4e-3 * size**2,
            points={"C": (0.0, 0.0)},
            shapes={"rim": {"disc": "C", "radius": radius * size}},
        ),
        mbody.Contact("floor", "ground.floor", "ball.rim", restitution=e),
        mbody.Gravity("gravity", y=-gravity),
    )
    fall = math.sqrt(2.0 * size / gravity)
    start = {"ball": {"x": 0.0, "y": (1.0 + radius) * size, "angle": 0.0}}
    machine.simulation = mbody.SimulationSettings(until=8.0 * fall, rtol=1e-10, start=start)
    run = mbody.simulate(machine)
    assert run.status == "completed"
    assert_allclose(run.events[0].t, fall, rtol=1e-8)
    assert run.events[-1].name == "rest"
    # flights shorter than a two-millionth of a fall are summed as a series
    assert_allclose(run.events[-1].t, fall * (1.0 + e) / (1.0 - e), rtol=1e-8)
