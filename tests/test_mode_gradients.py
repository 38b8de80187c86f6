"""Gradients of frequencies, damping and stiffnesses: against closed forms by complex steps."""

import numpy as np
import pytest

import mbody
from mbody import (
    Body,
    Damper,
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


def coupled(c=0.0):
    """Two masses in a row, coupled by a spring and a damper."""
    machine = Mechanism("row", ground={"W": (-1.0, 0.0), "Y": (1.0, 0.0)})
    machine.add(
        Body("a", mass=2.0, inertia=1.0),
        Body("b", mass=3.0, inertia=1.0, guess=(1.0, 0.0, 0.0)),
        Prismatic("one", "ground", "a"),
        Prismatic("two", "ground.Y", "b"),
        Spring("s", "ground.W", "a", stiffness=50.0, free_length=1.0),
        Spring("t", "a", "b", stiffness=30.0, free_length=1.0),
        Damper("d", "ground.W", "a", coefficient=c),
    )
    return machine


def test_ratios_of_amplitudes():
    """Of two masses in closed form: (k₁ + k₂ − ω² m₁)/k₂, one of them against the other."""

    def closed(p):
        m, n, k, h = p
        mean, rest = (k + h) / m + h / n, k * h / (m * n)
        slow = 0.5 * (mean - np.sqrt(mean * mean - 4.0 * rest))
        fast = mean - slow
        return np.array([(k + h - slow * m) / h, -(k + h - fast * m) / h]), []

    numbers, names = [2.0, 3.0, 50.0, 30.0], ["a.mass", "b.mass", "s.stiffness", "t.stiffness"]
    measures = ["ratio(1, b.x, a.x)", "ratio(2, b.x, a.x)", "phase(1, b.x, a.x)"]
    measures.append("phase(2, b.x, a.x)")
    g = mbody.gradient(coupled(), measures, names, "modes")
    exact, _ = derivatives(closed, numbers)
    np.testing.assert_allclose(list(g.value.values())[:2], closed(numbers)[0], rtol=1e-9)
    np.testing.assert_allclose(np.abs(list(g.value.values())[2:]), [0.0, np.pi], atol=1e-9)
    np.testing.assert_allclose(g.jacobian[:2], exact, atol=FIGURES * np.abs(exact).max())
    np.testing.assert_allclose(g.jacobian[2:], 0.0, atol=1e-9)
    assert g.units["ratio(1, b.x, a.x)"]["a.mass"] == "1/kg"


def shapes(machine, names, number, places, part=1e-4):
    """Ratio and phase of the plain shapes, and their differences."""
    system = mbody.assemble(machine)

    def found(values):
        mode = mbody.modes(system.with_values(values))[0][number - 1]
        a, b = (mode.shape[body][["x", "y", "angle"].index(of)] for body, of in places)
        return np.array([abs(a / b), np.angle(a / b)])

    rows = []
    for name in names:
        x = float(system.values[name])
        ends = {k: found({name: x * (1.0 + k * part)}) for k in (-2, -1, 1, 2)}
        rows.append((8.0 * (ends[1] - ends[-1]) - ends[2] + ends[-2]) / (12.0 * part * x))
    return found({}), np.array(rows).T


def pendulums():
    """Of two bars that hang beside each other by a spring, whose rest position moves."""
    machine = Mechanism("bars", ground={"V": (0.9, 0.0)})
    machine.add(
        Body("bar", mass=1.5, inertia=0.1, cg=(0.4, 0.0), points={"P": (0.5, 0.0)}, guess=-1.5),
        Body("rod", mass=1.0, inertia=0.05, cg=(0.3, 0.0), points={"Q": (0.6, 0.0)}, guess=-1.6),
        Revolute("O", "ground", "bar"),
        Revolute("V", "ground.V", "rod"),
        Spring("s", "bar.P", "rod.Q", stiffness=8.0, free_length=0.5),
        Gravity("g", y=-9.81),
        TorsionDamper("d", "rod", coefficient=0.4),
    )
    return machine


@pytest.mark.parametrize("number", [1, 2])
@pytest.mark.parametrize("places", [("rod.angle", "bar.angle"), ("rod.x", "bar.angle")])
def test_shapes_beside_differences(number, places):
    """With damping, so that phases are any, and bodies' ways that turn with the position."""
    names = ["bar.mass", "s.stiffness", "d.coefficient", "rod.cg.x"]
    measures = [f"{kind}({number}, {', '.join(places)})" for kind in ("ratio", "phase")]
    g = mbody.gradient(pendulums(), measures, names, "modes")
    values, wanted = shapes(pendulums(), names, number, [one.split(".") for one in places])
    np.testing.assert_allclose(list(g.value.values()), values, rtol=1e-8)
    # differences of both have some 8 figures
    most = np.abs(wanted).max(axis=1, keepdims=True)
    assert (np.abs(g.jacobian - wanted) / most).max() < 1e-6


def test_shapes_that_have_none():
    """Of amplitudes that are zero, and of a body that there is not."""
    g = mbody.gradient(chain(3.0), "ratio(1, a.x, b.x)", "a.mass", "modes")
    assert g.value["ratio(1, a.x, b.x)"] == 0.0 and np.isnan(g.jacobian).all()
    assert any("or an amplitude is zero" in note for note in g.notes)
    with pytest.raises(ModelError, match="divides by an amplitude that is zero: in mode 1"):
        mbody.gradient(chain(3.0), "ratio(1, b.x, a.x)", "a.mass", "modes")
    with pytest.raises(ModelError, match=r"amplitudes are of x, y .* such as a\.angle, not 'c\.x'"):
        mbody.gradient(chain(3.0), "ratio(1, b.x, c.x)", "a.mass", "modes")
    with pytest.raises(ModelError, match="there are modes 1 to 2"):
        mbody.gradient(chain(3.0), "phase(3, b.x, a.x)", "a.mass", "modes")
