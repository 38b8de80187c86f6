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
from tests.support.complex_events import derivatives

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


def closed_pendulums(p):
    """Ratios and phases of `pendulums` from its energies, (2 modes, 4 pairs, 2)."""
    m, k, c, b, reach, other = p
    arms, ends, masses = np.array([0.4, b]), np.array([reach, other]), np.array([m, 1.0])

    def driving(theta):
        """∂V/∂θ of weights and spring."""
        c, s = np.cos(theta), np.sin(theta)
        dx, dy = 0.9 + ends[1] * c[1] - ends[0] * c[0], ends[1] * s[1] - ends[0] * s[0]
        length = np.sqrt(dx * dx + dy * dy)
        pull = k * (length - 0.5) / length
        along = ends * (-dx * s + dy * c) * np.array([-1.0, 1.0])
        return masses * 9.81 * arms * c + pull * along

    def stiffness(theta):
        steps = 1e-30j * np.eye(2)
        return np.array([driving(theta + step).imag / 1e-30 for step in steps]).T

    theta = np.array([-1.5, -1.6])
    for _ in range(30):
        theta = theta - np.linalg.solve(stiffness(theta), driving(theta))
    mass = np.array([0.1, 0.05]) + masses * arms**2
    rates = np.block(
        [
            [np.zeros((2, 2)), np.eye(2)],
            [-stiffness(theta) / mass[:, None], -np.diag([0.0, c]) / mass[:, None]],
        ]
    )
    roots, vectors = np.linalg.eig(rates)
    modes = sorted(np.flatnonzero(roots.imag > 0.0), key=lambda n: abs(roots[n]))
    found = []
    for n in modes:
        first, second = vectors[:2, n]
        c2, (s1, s2) = np.cos(theta[1]), np.sin(theta)
        pairs = [
            (second, first),
            (-b * s2 * second, first),
            (other * c2 * second, -reach * s1 * first),
            (-other * s2 * second, second),
        ]
        ratios = [one / another for one, another in pairs]
        found.append(np.column_stack([np.abs(ratios), np.angle(ratios)]))
    return np.array(found)


def test_shapes_beside_the_energies():
    """With damping, so that phases are any, and bodies' ways that turn with the position."""
    names = ["bar.mass", "s.stiffness", "d.coefficient", "rod.cg.x", "bar.P.x", "rod.Q.x"]
    numbers = np.array([1.5, 8.0, 0.4, 0.3, 0.5, 0.6])
    pairs = ["rod.angle, bar.angle", "rod.x, bar.angle", "rod.Q.y, bar.P.x", "rod.Q.x, rod.angle"]
    measures = [
        f"{kind}({number}, {pair})"
        for number in (1, 2)
        for pair in pairs
        for kind in ("ratio", "phase")
    ]
    g = mbody.gradient(pendulums(), measures, names, "modes")
    values = closed_pendulums(numbers).reshape(-1)
    np.testing.assert_allclose(list(g.value.values()), values, rtol=1e-8, atol=1e-9)
    rows = []
    for step in np.diag(1e-3 * numbers):
        ends = [closed_pendulums(numbers + n * step).reshape(-1) for n in (-2, -1, 1, 2)]
        rows.append((8.0 * (ends[2] - ends[1]) - ends[3] + ends[0]) / (12.0 * step.sum()))
    # what numbers do, in parts of themselves: differences have 1e-10 of it, ours 1e-7
    ours, wanted = g.jacobian * numbers, np.array(rows).T * numbers
    assert np.abs(ours - wanted).max() < FIGURES * np.abs(wanted).max()


def double_pendulum(p):
    """Two point masses on two rods, m, n, a, b; the second rod has its points at its mass centre
    and halfway.
    """
    m, n, a, b = p
    machine = Mechanism("double pendulum")
    machine.add(
        Body("upper", mass=m, inertia=0.0, cg=(a, 0.0), points={"A": (a, 0.0)}, guess=-1.5),
        Body(
            "lower",
            mass=n,
            inertia=0.0,
            cg=(b, 0.0),
            points={"A": (0.0, 0.0), "B": (b, 0.0), "C": (0.5 * b, 0.0)},
            guess=-1.5,
        ),
        Revolute("O", "ground", "upper"),
        Revolute("A", "upper.A", "lower.A"),
        Gravity("g", y=-9.81),
    )
    return machine


@pytest.mark.parametrize("size", [1.0, 1e-6, 1e4])
@pytest.mark.parametrize("number", [1, 2])
def test_points_of_a_double_pendulum(number, size):
    """Of points between the mass centres in closed form, for links of any size."""

    def closed(p):
        m, n, a, b, reach = p
        # (K − s M) θ = 0, K = g diag((m + n) a, n b), M = ((m + n) a², n a b; n a b, n b²)
        two, one, zero = m * n * a * a * b * b, -(m + n) * n * 9.81 * a * b * (a + b), m + n
        zero = zero * n * 9.81**2 * a * b
        root = np.sqrt(one * one - 4.0 * two * zero)
        s = (-one - root if number == 1 else -one + root) / (2.0 * two)
        ratio = (9.81 - s * a) * (m + n) / (s * n * b)  # of the angles, the second by the first
        # of a point of the lower rod by the pin, and of the angles; sizes
        signs = [1.0, 1.0] if number == 1 else [-1.0, -1.0]
        tip = 1.0 + reach * ratio / a
        signs[0] = 1.0 if tip.real > 0.0 else -1.0
        return np.array([signs[0] * tip, signs[1] * ratio]), []

    p = [1.3, 0.7, 2.0 * size, 1.4 * size]
    names = ["upper.mass", "lower.mass", "lower.C.x"]
    measures = [f"ratio({number}, lower.C.x, A.x)", f"ratio({number}, lower.angle, upper.angle)"]
    g = mbody.gradient(double_pendulum(p), measures, names, "modes")
    exact, _ = derivatives(closed, [*p, 0.5 * p[3]])
    exact = exact[:, [0, 1, 4]]
    np.testing.assert_allclose(list(g.value.values()), closed([*p, 0.5 * p[3]])[0], rtol=1e-8)
    sizes = np.array([1.3, 0.7, 0.5 * p[3]])
    scale = np.abs(exact * sizes).max()
    assert (np.abs(g.jacobian - exact) * sizes).max() < FIGURES * scale
    assert g.units[measures[0]]["lower.C.x"] == "1/m"


def test_amplitudes_of_points():
    """Those of a rigid body: of the mass centre, the pin and the ground."""
    for mode in mbody.modes(double_pendulum([1.3, 0.7, 2.0, 1.4]))[0]:
        upper, lower = (mode.amplitude(f"{name}.angle") for name in ("upper", "lower"))
        assert mode.amplitude("A.x") == pytest.approx(2.0 * upper, rel=1e-9)
        assert mode.amplitude("lower.A.x") == pytest.approx(2.0 * upper, rel=1e-9)
        assert mode.amplitude("lower.B.x") == pytest.approx(2.0 * upper + 1.4 * lower, rel=1e-9)
        assert mode.amplitude("lower.x") == pytest.approx(mode.shape["lower"][0], rel=1e-15)
        assert mode.amplitude("lower.origin.x") == pytest.approx(2.0 * upper, rel=1e-9)
        assert abs(mode.amplitude("lower.B.y")) < 1e-6
        assert mode.amplitude("ground.x") == 0.0 == mode.amplitude("O.y")
    with pytest.raises(ModelError, match=r"'lower' has no point 'D' \(it has: 'A', 'B', 'C'"):
        mode.amplitude("lower.D.x")
    with pytest.raises(ModelError, match=r"such as upper\.angle, upper\.x or upper\.A\.x, not 3"):
        mode.amplitude(3)
    with pytest.raises(ModelError, match=r"not 'lower\.C\.angle'"):
        mode.amplitude("lower.C.angle")


@pytest.mark.slow
def test_shapes_that_have_none():
    """Of amplitudes that are zero, and of a body that there is not."""
    g = mbody.gradient(chain(3.0), "ratio(1, a.x, b.x)", "a.mass", "modes")
    assert g.value["ratio(1, a.x, b.x)"] == 0.0 and np.isnan(g.jacobian).all()
    assert any("or an amplitude is zero" in note for note in g.notes)
    with pytest.raises(ModelError, match="divides by an amplitude that is zero: in mode 1"):
        mbody.gradient(chain(3.0), "ratio(1, b.x, a.x)", "a.mass", "modes")
    with pytest.raises(ModelError, match=r"amplitudes are of .* such as a\.angle, .* not 'c\.x'"):
        mbody.gradient(chain(3.0), "ratio(1, b.x, c.x)", "a.mass", "modes")
    with pytest.raises(ModelError, match="there are modes 1 to 2"):
        mbody.gradient(chain(3.0), "phase(3, b.x, a.x)", "a.mass", "modes")
