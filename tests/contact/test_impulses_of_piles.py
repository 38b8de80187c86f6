"""Impulses of hundreds of contacts converge, whatever the friction; what falls comes to rest."""

import math

import numpy as np
import pytest
from scipy.optimize import nnls

import mbody
from tests.contact.test_many_contacts import stepped
from tests.contact.test_one_impulse_step import disc_rows
from tests.support.piles import RADIUS, G, chain, pile, poured

PARTS = ("vx", "vy", "omega")


def least_distance(M, free, C, c):
    """The u nearest to `free` in the measure of M, diagonal, with C u ≥ c: by non-negative least
    squares. Lawson, Hanson: Solving Least Squares Problems (1974), 23.
    """
    root, aim = np.sqrt(M), np.append(np.zeros(len(M)), 1.0)
    E = np.vstack([(C / root).T, c - C @ free])
    z, left = nnls(E, aim, maxiter=100 * len(c))
    assert left > 0.0
    rest = E @ z - aim
    return free - rest[:-1] / rest[-1] / root


@pytest.mark.parametrize("friction", [0.2, 0.5, 0.9])
def test_one_step_of_a_pile_is_the_nearest_motion_that_its_cones_allow(friction):
    """66 discs from rest, the top one pushed: velocities solve a convex problem, whatever the
    impulses, which are not unique. What slides has not slid before.
    """
    h, machine = 2e-3, pile(11, friction)
    machine.add(mbody.Force("push", "d65.C", 20.0))
    run = stepped(machine, h, h, rtol=1e-10, instants=2)
    assert run.status == "completed"
    assert run.stats["iterations"] > 0
    q = np.array([[run[name].x[0], run[name].y[0], 0.0] for name in run])
    W, gap = disc_rows(q, 0.02 * RADIUS)
    m, free = len(gap), np.tile([0.0, -G * h, 0.0], len(q))
    free[-3] += 20.0 * h
    C = np.vstack([W[:m] + friction * W[m:], W[:m] - friction * W[m:]])
    M = np.tile([1.0, 1.0, 0.5 * RADIUS**2], len(q))
    after = least_distance(M, free, C, np.tile(-np.maximum(gap, 0.0) / h, 2))
    found = np.array([getattr(run[name], part)[-1] for name in run for part in PARTS])
    # impulses of at most 1 N s; what is left of them is 1e-10 as a rule and 1e-8 where the method
    # stalls, on 1 kg, or on half of that at the rim
    rim = np.tile([1.0, 1.0, RADIUS], len(q))
    assert np.abs(rim * (found - after)).max() < 1e-7
    assert np.abs(after).max() > 1e-3


@pytest.mark.parametrize("friction", [0.3, 0.9])
def test_every_contact_of_a_pile_that_collapses_obeys_coulomb(friction):
    """190 discs, by the velocities of bodies and the forces of places alone."""
    h, steps = 2e-3, 100
    run = stepped(pile(19, friction), steps * h, h, rtol=1e-6, instants=steps + 1)
    assert run.status == "completed"
    q, v, u = (
        np.array([[getattr(run[name], part)[n] for part in parts] for name in run] + [[0.0] * 3])
        for n, parts in ((-2, ("x", "y", "angle")), (-2, PARTS), (-1, PARTS))
    )
    middle, number = q + 0.5 * h * v, {name: n for n, name in enumerate([*run, "ground"])}
    places = run.stepped.touching(steps)
    i, j = (np.array([number[s.partition(".")[0]] for s in one]) for one in (places.i, places.j))

    def velocity(b):
        x, y = places.x - middle[b, 0], places.y - middle[b, 1]
        return np.array([u[b, 0] - u[b, 2] * y, u[b, 1] + u[b, 2] * x])

    dx, dy = velocity(j) - velocity(i)
    normal = dx * places.nx + dy * places.ny
    along = dx * places.ny - dy * places.nx
    p, t = places.normal, places.tangential
    most = p.max()
    assert len(p) > 200
    assert p.min() >= 0.0
    # rates to what the impulses, to 1e-6 of the greatest, give discs of 1 kg; tenfold for what all
    # neighbours of a disc leave together
    rounding = 10 * 1e-6 * most * h
    assert (np.abs(t) - friction * p).max() < 1e-12 * most
    sticks = np.abs(t) < friction * p * (1.0 - 1e-6)
    assert np.abs(along[sticks]).max(initial=0.0) < rounding
    assert (along * t)[~sticks].max(initial=0.0) <= rounding * most
    assert sticks.any() and not sticks.all()
    # what presses closes its gap, but for what sliding has changed
    assert np.abs(normal + np.maximum(places.gap, 0.0) / h).max() * h <= (
        run.stepped.nearer * RADIUS + rounding * h
    )


def test_a_chain_of_a_hundred_links_falls_on_a_floor_and_rests():
    machine = chain(100, angle=0.0, height=0.3)
    run = stepped(machine, 2.0, 2e-3, instants=21, rtol=1e-6)
    assert run.status == "completed"
    weight = 100 * 0.1 * G
    # impulses to 1e-6 of the greatest: what presses a point, and moves a link in a step
    assert run.contact("floor")[-1] == pytest.approx(weight, rel=1e-5)
    speeds = [abs(getattr(run[name], part)[-1]) for name in run for part in PARTS]
    assert max(speeds) < 1e-6
    assert run.checks.constraint < 1e-12
    # the energy of the fall is lost, and to nothing but impacts and friction
    fallen = -np.trapezoid(np.array([run[name].vy for name in run]).sum(axis=0), run.t) * 0.1 * G
    assert run.energy.lost["floor"][-1] == pytest.approx(fallen, rel=5e-2)
    assert run.energy.error < 5e-3


@pytest.mark.slow
def test_two_hundred_discs_between_walls_come_to_rest():
    """All that is pressed at two places or more rests; a disc that lies on the floor alone may roll
    on, as nothing resists its rolling.
    """
    machine = poured(200)
    run = stepped(machine, 4.0, 2e-3, instants=41, rtol=1e-6)
    assert run.status == "completed"
    weight = sum(body.mass for body in machine.bodies) * G
    carried = sum(run.reaction(name).fy[-1] for name in ("floor", "left", "right"))
    # each of 200 discs to 1e-6 of the greatest force, which is less than the weight of all
    assert carried == pytest.approx(weight, rel=2e-4)
    last = run.stepped.touching(len(run) - 1)
    held = [shape.partition(".")[0] for one in (last.i, last.j) for shape in one]
    speeds = {b: math.hypot(run[b].vx[-1], run[b].vy[-1]) for b in run if held.count(b) > 1}
    assert len(speeds) > 190
    # a step of 2 ms with all of the weight off by 1e-6
    assert max(speeds.values()) < 1e-6 * weight * 2e-3 / 0.49
    mass = np.array([body.mass for body in machine.bodies])
    kinetic = [
        0.5 * (mass * np.array([run[b].vx[n] ** 2 + run[b].vy[n] ** 2 for b in run])).sum()
        for n in range(len(run))
    ]
    assert kinetic[-1] < 1e-5 * max(kinetic)
    assert run.energy.error < 5e-3
