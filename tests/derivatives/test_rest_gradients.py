"""Gradients of rest positions: against closed forms and complex steps."""

import numpy as np
import pytest

import mbody
from mbody import (
    Body,
    Gravity,
    Marker,
    Mechanism,
    Prismatic,
    Revolute,
    Spring,
)
from tests.support.complex_events import derivatives


def rods():
    """Two rods that hang, drawn by a spring."""
    machine = Mechanism("two rods", ground={"W": (1.5, 0.3)})
    machine.add(
        Body("a", mass=2.0, inertia=0.1, cg=(0.5, 0.0), points={"P": (1.0, 0.0)}),
        Body("b", mass=1.0, inertia=0.05, cg=(0.3, 0.05), points={"S": (0.8, 0.1)}),
        Revolute("O", "ground", "a"),
        Revolute("P", "a.P", "b"),
        Gravity("g", y=-9.81),
        Spring("s", "ground.W", "b.S", stiffness=30.0, free_length=0.4),
    )
    return machine


def sledge():
    machine = Mechanism("sledge", ground={"W": (-1.0, 0.2)})
    machine.add(
        Body("k", mass=2.0, points={"C": (0.0, 0.0)}),
        Prismatic("guide", Marker("ground", (0.0, 0.0), 0.3), "k.C"),
        Gravity("g", y=-9.81),
        Spring("s", "ground.W", "k.C", stiffness=200.0, free_length=1.2),
    )
    return machine


RODS = {"a.mass": 2.0, "a.P.x": 1.0, "s.stiffness": 30.0, "b.cg.x": 0.3, "g.y": -9.81}
RODS["s.free_length"] = 0.4


def balanced(numbers, angles):
    """Both angles of the rods and the force of the spring, from where the gradient of the potential
    energy vanishes: Newton's method in complex numbers.
    """
    m, P, k, cg, g, free = numbers

    def pull(angles):
        c, s = np.cos(angles), np.sin(angles)
        first = np.array([-P * s[0], P * c[0]])
        second = np.array([-0.8 * s[1] - 0.1 * c[1], 0.8 * c[1] - 0.1 * s[1]])
        x = P * c[0] + 0.8 * c[1] - 0.1 * s[1] - 1.5
        y = P * s[0] + 0.8 * s[1] + 0.1 * c[1] - 0.3
        length = np.sqrt(x * x + y * y)
        force = k * (length - free)
        way = force / length * np.array([x, y])
        one = -g * (0.5 * m + P) * c[0] + way @ first
        return np.array([one, -g * (cg * c[1] - 0.05 * s[1]) + way @ second]), force

    for _ in range(30):
        here = pull(angles)[0]
        slopes = [(pull(angles + 1e-7 * row)[0] - here) / 1e-7 for row in np.eye(2)]
        angles = angles - np.linalg.solve(np.array(slopes).T, here)
    return np.append(angles, pull(angles)[1]), []


@pytest.mark.parametrize("position", [0, 1])
def test_two_free_motions(position):
    """A stable position and an unstable one, against a complex step."""
    measures = ["a.angle", "b.angle", "s.force"]
    g = mbody.gradient(rods(), measures, list(RODS), analysis="equilibrium", position=position)
    angles = np.array([g.value["a.angle"], g.value["b.angle"]], dtype=complex)
    exact, _ = derivatives(lambda p: balanced(p, angles), list(RODS.values()))
    sign = np.sign(g.value["s.force"] * balanced(list(RODS.values()), angles)[0][2].real)
    exact[2] *= sign
    scale = np.abs(exact).max(axis=0)
    # the position is found to 1e-9 of what drives it
    assert (np.abs(g.jacobian - exact) / scale).max() < 1e-8


def test_a_sledge():
    """In closed form along its guide: the spring against a part of the weight."""
    names = ["k.mass", "s.stiffness", "s.free_length"]
    g = mbody.gradient(sledge(), ["k.x", "k.y"], names, analysis="equilibrium")
    way = g.value["k.x"] / np.cos(0.3)

    def along(numbers):
        m, k, free = numbers
        s = way + 0.0j
        for _ in range(30):

            def drive(s):
                x, y = s * np.cos(0.3) + 1.0, s * np.sin(0.3) - 0.2
                length = np.sqrt(x * x + y * y)
                pull = k * (length - free) / length
                return -m * 9.81 * np.sin(0.3) - pull * (x * np.cos(0.3) + y * np.sin(0.3))

            s = s - drive(s) * 1e-7 / (drive(s + 1e-7) - drive(s))
        return np.array([s * np.cos(0.3), s * np.sin(0.3)]), []

    exact, _ = derivatives(along, [2.0, 200.0, 1.2])
    np.testing.assert_allclose(g.jacobian, exact, rtol=1e-8)


def test_a_neutral_position_has_none():
    """A wheel that rests anywhere."""
    machine = Mechanism("wheel")
    machine.add(Body("wheel", mass=1.0, inertia=1.0), Revolute("O", "ground", "wheel"))
    machine.add(Gravity("g", y=-9.81))
    g = mbody.gradient(machine, "wheel.angle", ["wheel.mass"], analysis="equilibrium")
    assert np.isnan(g.jacobian).all()
    assert any("neutral" in note for note in g.notes)
