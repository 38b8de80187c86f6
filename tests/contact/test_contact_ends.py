"""Where contact points are along edges and round arcs, against complex numbers in the plane."""

import cmath
import math

import numpy as np
import pytest

from mbody import Body, Contact, Mechanism
from mbody.analysis.contact.unilateral import Unilateral
from mbody.analysis.position.assembly_analysis import as_system


@pytest.fixture
def placed():
    """A box beside a post, and a rocker whose sole is an arc on a slanting floor."""
    corners = ["A", "B", "C", "D"]
    at = {"A": (0.0, 0.0), "B": (2.0, 0.0), "C": (2.0, 1.0), "D": (0.0, 1.0)}
    box = Body(
        "box",
        mass=1.0,
        inertia=1.0,
        cg=(1.2, 0.4),
        points=at,
        shapes={"hull": {"polygon": corners}},
    )
    sole = {"disc": "M", "radius": 0.5, "begin": -2.0, "end": -0.5}
    rocker = Body("rocker", mass=1.0, inertia=1.0, cg=(0.1, 0.2), points={"M": (0.4, 0.3)},
                  shapes={"sole": sole})  # fmt: skip
    machine = Mechanism(
        "placed",
        ground={"O": (0.0, 0.0), "P": (3.0, 1.0)},
        ground_shapes={"floor": {"segment": ["O", "P"]}},
    )
    machine.add(box, rocker, Contact("edge", "ground.floor", "box.hull"))
    machine.add(Contact("roll", "ground.floor", "rocker.sole"))
    system = as_system(machine)
    work = system.work(masses=True)
    rng = np.random.default_rng(3)
    work.q[: system.coordinates, 0] = rng.normal(size=system.coordinates)
    work.v[: system.coordinates, 0] = rng.normal(size=system.coordinates)
    return Unilateral(system), work


def in_plane(work, body, x, y):
    """A point of a body, from its mass centre, as a complex number."""
    px, py, angle = work.q[3 * body : 3 * body + 3, 0]
    return complex(px, py) + complex(x, y) * cmath.exp(1j * angle)


def test_ways_along_edges(placed):
    uni, work = placed
    rows, found = uni.read(work), 0
    for n, point in enumerate(uni.contact_points):
        edge = point.candidate.edge
        if edge is None or point.candidate.arcs:
            continue
        i, j = uni.bodies[n]
        (x, y), (ux, uy), length = edge
        begin = in_plane(work, i, x, y)
        end = in_plane(work, i, x + length * ux, y + length * uy)
        way = in_plane(work, j, *map(float, point.candidate.position)) - begin
        along = (way * (end - begin).conjugate()).real / abs(end - begin)
        assert rows.ends[n] == pytest.approx([along, abs(end - begin) - along], abs=1e-14)
        found += 1
    assert found >= 5


def test_ways_round_arcs(placed):
    """The arc begins at −2 rad in the axes of the rocker and has 1.5 rad; it touches the floor
    along the normal of the floor.
    """
    uni, work = placed
    rows, found = uni.read(work), 0
    down = -math.pi / 2.0 + math.atan2(1.0, 3.0)
    for n, point in enumerate(uni.contact_points):
        candidate = point.candidate
        if not candidate.arcs or candidate.edge is None:
            continue
        body = next(b for b in uni.bodies[n] if b < uni.layout.bodies)
        middle = cmath.exp(1j * (down - work.q[3 * body + 2, 0] + 1.25))
        past = 0.5 * (0.75 + cmath.phase(middle))
        assert rows.ends[n, 0] <= past + 1e-14 and rows.ends[n, 1] <= 0.75 - past + 1e-14
        assert any(np.isclose(rows.ends[n], [past, 0.75 - past], atol=1e-14))
        found += 1
    assert found >= 1


def test_rates_are_those_of_the_rows(placed):
    uni, work = placed
    n = uni.system.coordinates
    for record in np.random.default_rng(5).normal(size=(4, 2 * n)):
        work.q[:n, 0], work.v[:n, 0] = record[:n], record[n:]
        one = uni.read(work)
        assert one.rate == pytest.approx(one.block @ record[n:], abs=1e-13)
