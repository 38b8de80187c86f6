"""Gradients of frequencies, damping and stiffnesses: against closed forms by complex steps."""

import numpy as np
import pytest

import mbody
from mbody import (
    Body,
    Gravity,
    Mechanism,
    ModelError,
    Prismatic,
    Revolute,
    Spring,
    TorsionDamper,
    TorsionSpring,
)
from tests.complex_events import derivatives

#: Matrices have 1e-11 of the greatest load, over a step of 1e-3, and position of 1e-12.
FIGURES = 1e-7


def damped_pendulum():
    machine = Mechanism("pendulum")
    machine.add(
        Body("rod", mass=2.0, inertia=0.3, cg=(0.5, 0.0)),
        Revolute("O", "ground", "rod"),
        Gravity("g", y=-9.81),
        TorsionDamper("d", "rod", coefficient=0.4),
    )
    return machine


def test_a_damped_pendulum():
    """All that is measured of a mode, in closed form."""
    names = ["rod.mass", "rod.cg.x", "d.coefficient", "g.y", "rod.inertia"]
    numbers = [2.0, 0.5, 0.4, -9.81, 0.3]

    def closed(p):
        m, arm, c, g, inertia = p
        whole, k = inertia + m * arm * arm, -m * g * arm
        fast, slow = np.sqrt(k / whole), 0.5 * c / whole
        damped = np.sqrt(fast**2 - slow**2)
        return np.array([damped, fast, damped / (2.0 * np.pi), slow, slow / fast, k]), []

    measures = ["frequency(1)", "natural_frequency(1)", "hertz(1)", "decay_rate(1)"]
    measures = [*measures, "damping_ratio(1)", "stiffness(rod)"]
    g = mbody.gradient(damped_pendulum(), measures, names, "modes")
    exact, _ = derivatives(closed, numbers)
    assert list(g.value.values()) == pytest.approx(closed(numbers)[0], rel=1e-9)
    scale = np.abs(exact * numbers).max(axis=1, keepdims=True) / np.abs(numbers)
    assert (np.abs(g.jacobian - exact) / scale).max() < FIGURES
    assert g.units["frequency(1)"]["rod.mass"] == "rad/s/kg"
    assert g.units["stiffness(rod)"]["rod.mass"] == "N·m/rad/kg"


def test_a_position_that_moves():
    """k θ = m g l cos θ: the frequency moves with the position, too."""
    machine = Mechanism("bar")
    machine.add(
        Body("bar", mass=1.5, inertia=0.1, cg=(0.4, 0.0)),
        Revolute("O", "ground", "bar"),
        TorsionSpring("spring", "bar", stiffness=20.0),
        Gravity("g", y=-9.81),
    )
    g = mbody.gradient(machine, "frequency(1)", ["bar.mass", "spring.stiffness"], "modes")

    def closed(p):
        m, k = p
        angle = 0.0
        for _ in range(50):
            left = k * angle + m * 9.81 * 0.4 * np.cos(angle)
            angle = angle - left / (k - m * 9.81 * 0.4 * np.sin(angle))
        stiffness = k - m * 9.81 * 0.4 * np.sin(angle)
        return [np.sqrt(stiffness / (0.1 + m * 0.16))], []

    exact, _ = derivatives(closed, [1.5, 20.0])
    np.testing.assert_allclose(g.jacobian, exact, rtol=FIGURES)


def chain(second):
    """Two masses in a row, or two that know nothing of each other."""
    machine = Mechanism("chain", ground={"W": (-1.0, 0.0), "V": (-1.0, 1.0), "Y": (0.0, 1.0)})
    machine.add(
        Body("a", mass=2.0, inertia=1.0),
        Body("b", mass=second, inertia=1.0, guess=(0.0, 1.0, 0.0)),
        Prismatic("one", "ground", "a"),
        Prismatic("two", "ground.Y", "b"),
        Spring("s", "ground.W", "a", stiffness=50.0, free_length=1.0),
        Spring("t", "ground.V", "b", stiffness=50.0, free_length=1.0),
    )
    return machine


def test_two_modes_apart():
    g = mbody.gradient(
        chain(3.0), ["frequency(1)", "frequency(2)"], ["a.mass", "b.mass", "s.stiffness"], "modes"
    )
    exact = np.array([[0.0, -0.5 * 50.0**0.5 * 3.0**-1.5, 0.0], [0.0, 0.0, 0.0]])
    exact[1, 0] = -0.5 * 50.0**0.5 * 2.0**-1.5
    exact[1, 2] = 0.5 / (50.0 * 2.0) ** 0.5
    np.testing.assert_allclose(g.jacobian, exact, atol=FIGURES * np.abs(exact).max())


def test_equal_modes_have_none():
    g = mbody.gradient(chain(2.0), ["frequency(1)", "stiffness(a)"], "a.mass", "modes")
    assert np.isnan(g["frequency(1)"]["a.mass"]) and abs(g["stiffness(a)"]["a.mass"]) < 1e-6
    assert any("its root is not simple" in note for note in g.notes)


def test_what_is_refused():
    with pytest.raises(ModelError, match="there are modes 1 to 1"):
        mbody.gradient(damped_pendulum(), "frequency(2)", "rod.mass", "modes")
    with pytest.raises(ModelError, match=r"is no measure of modes: give .* stiffness\(rod\)"):
        mbody.gradient(damped_pendulum(), "rod.angle", "rod.mass", "modes")
