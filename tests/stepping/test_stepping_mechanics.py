"""The mechanics of an instant as arrays: against the dense oracle, identities, and differences."""

import math

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.linalg import expm, solve_continuous_are

import mbody
from mbody import Body, Gravity, Mechanism, Revolute, Simulator, Spring, Torque, gallery
from mbody.engineering import linearize
from mbody.engines.oracle import Reference

NAMES = ("free_fourbar", "slider_crank", "norton_fourbar", "parallel_cranks", "vehicle")
NAMES += ("flyball_governor", "andrews_squeezer")
#: Both sides evaluate one formula, or solve one system of condition some hundreds, once.
ROUNDING = 1e-10


def some(name):
    """A simulator a little way into its motion."""
    sim = Simulator(gallery.load(name), rtol=1e-9)
    sim.until(0.01)
    return sim


def close(mine, theirs, part=ROUNDING):
    """Parts of the greatest; what rests has rounding of forces alone."""
    assert_allclose(mine, theirs, rtol=0, atol=part * max(0.1, np.abs(theirs).max(initial=0.0)))


@pytest.mark.parametrize("name", NAMES)
def test_arrays_against_the_oracle(name):
    """It reads the description, and has dense matrices of its own."""
    sim = some(name)
    oracle = Reference(sim.system.mechanism)
    q, v, t = sim.q, sim.v, sim.t
    close(sim.mass_matrix(), oracle.mass_matrix())
    G = oracle.phi_q(q, t)
    unit = np.abs(sim.jacobian()).max()
    assert_allclose(np.abs(sim.jacobian()), np.abs(G), rtol=0, atol=ROUNDING * unit)
    # rows may have the other sign there
    sign = np.sign((sim.jacobian() * G).sum(axis=1))
    gamma = oracle.gamma(q, v, t)
    assert_allclose(sim.gamma(), sign * gamma, rtol=0, atol=ROUNDING * np.abs(gamma).max())
    close(-sim.bias(), oracle.applied(q, v, t))
    drivers = [driver.name for driver in sim.system.drivers]
    a, lam = oracle.dynamics(q, v, t, drive=drivers)
    close(sim.accelerations(), a, 1e-8)
    close(sim.jacobian().T @ sim.multipliers(), G.T @ lam, 1e-8)


@pytest.mark.parametrize("name", NAMES)
def test_the_equations_of_motion_hold(name):
    sim = some(name)
    M, G, a = sim.mass_matrix(), sim.jacobian(), sim.accelerations()
    force = np.abs(M @ a).max() + np.abs(sim.bias()).max()
    left = M @ a + G.T @ sim.multipliers() + sim.bias()
    assert np.abs(left).max() < ROUNDING * force
    assert np.abs(G @ a - sim.gamma()).max() < ROUNDING * (np.abs(G).max() * np.abs(a).max() + 1.0)
    assert len(sim.row_names) == len(G)
    # of minimal coordinates
    N, P = sim.N, sim.minimal.P
    assert_allclose(P @ N, np.eye(len(P)), atol=1e-12)
    assert np.abs(G @ N).max(initial=0.0) <= 1e-9 * np.abs(G).max()
    own = sim.mass_matrix(minimal=True) @ sim.accelerations(minimal=True) + sim.bias(minimal=True)
    size = np.abs(N.T).max(initial=0.0) * force
    assert np.abs(own).max(initial=0.0) <= 1e-9 * size
    assert sim.q_min.shape == (len(P),)
    assert_allclose(sim.gravity(minimal=True), N.T @ sim.gravity(), atol=1e-12 * size)


def test_jacobian_and_gamma_against_differences():
    """Φ_q v = ν of a motion without drivers is zero at every instant: d/dt Φ_q v = −γ + Φ_q a."""
    sim = some("free_fourbar")
    G, v, a, gamma = sim.jacobian(), sim.v, sim.accelerations(), sim.gamma()
    h = 1e-5
    sim.step(h)
    later = sim.jacobian()
    # to first order in h, of the size of the third derivative
    change = (later - G) @ v / h
    assert_allclose(change, -gamma, rtol=0, atol=1e-3 * np.abs(gamma).max())
    assert np.abs(G @ v).max() < 1e-12 * np.abs(G).max() * np.abs(v).max()
    assert_allclose(G @ a, gamma, atol=1e-10 * np.abs(gamma).max())


def test_a_double_pendulum_by_hand():
    """The textbook's mass matrix and bias in both absolute angles."""
    machine = Mechanism("arm")
    (a, b), (m1, m2), (i1, i2), g = (0.7, 0.4), (2.0, 1.5), (0.2, 0.1), 9.81
    machine.add(
        Body("upper", mass=m1, inertia=i1, cg=(0.3, 0.0), points={"E": (a, 0.0)}, guess=0.4),
        Body("lower", mass=m2, inertia=i2, cg=(b, 0.0), guess=1.1),
        Revolute("shoulder", "ground", "upper"),
        Revolute("elbow", "upper.E", "lower"),
        Gravity("gravity", y=-g),
    )
    sim = Simulator(machine, rates={"upper": 1.3, "lower": -0.8}, rtol=1e-10)
    p, q = sim["upper"].angle, sim["lower"].angle
    u, w = sim["upper"].omega, sim["lower"].omega
    assert sim.minimal.leaders == ("upper", "lower")
    cross = m2 * a * b * math.cos(p - q)
    M = [[i1 + m1 * 0.3**2 + m2 * a**2, cross], [cross, i2 + m2 * b**2]]
    s = m2 * a * b * math.sin(p - q)
    gravity = [(m1 * 0.3 + m2 * a) * g * math.cos(p), m2 * g * b * math.cos(q)]
    bias = [s * w**2 + gravity[0], -s * u**2 + gravity[1]]
    assert_allclose(sim.q_min, [p, q], rtol=0, atol=1e-14)
    assert_allclose(sim.mass_matrix(minimal=True), M, rtol=1e-12)
    assert_allclose(sim.bias(minimal=True), bias, rtol=1e-11)
    assert_allclose(sim.gravity(minimal=True), -np.array(gravity), rtol=1e-12)
    assert_allclose(sim.accelerations(minimal=True), -np.linalg.solve(M, bias), rtol=1e-10)


# -- state matrices ---------------------------------------------------------------------------


def pendulum(angle=0.0, c=0.3):
    machine = Mechanism("pendulum")
    machine.add(
        Body("rod", mass=2.0, inertia=0.1, cg=(0.5, 0.0), points={"P": (1.0, 0.0)}, guess=angle),
        Revolute("O", "ground", "rod"),
        Gravity("gravity", y=-9.81),
        mbody.TorsionDamper("damper", "ground", "rod", c),
        Torque("motor", "rod", value=0.0),
    )
    return machine


def test_state_matrices_of_a_pendulum():
    """About its upright position, by hand: I α = m g c sin… − d ω."""
    own, drop, d = 0.1 + 2.0 * 0.25, 2.0 * 9.81 * 0.5, 0.3
    sim = Simulator(pendulum(math.pi / 2.0), rtol=1e-10)
    found = sim.state_matrices(["rod.P.x", "rod.omega", "O.fx"])
    assert found.states == ("rod.angle", "rod.omega") and found.inputs == ()
    assert_allclose(found.A, [[0.0, 1.0], [drop / own, -d / own]], atol=1e-9)
    assert found.B.shape == (2, 0) and found.D.shape == (3, 0)
    # O.fx = m ax of the mass centre, −c α sin θ at rest there
    fx = -2.0 * 0.5 * np.array([drop / own, -d / own])
    assert_allclose(found.C, [[-1.0, 0.0], [0.0, 1.0], fx], atol=1e-7)
    assert found.outputs == ("rod.P.x", "rod.omega", "O.fx")
    # the same code, at a rest position
    machine = pendulum(math.pi / 2.0)
    rest = max(mbody.equilibrium(machine), key=lambda one: one.solution.measure("rod.P.y")[0])
    linear = linearize(machine, at=rest)
    assert_allclose(linear.state_matrices("rod.P.x").A, found.A, atol=1e-8)
    assert_allclose(linear.state_matrices("rod.P.x").C, found.C[:1], atol=1e-9)
    assert_allclose(linear.state_matrix, found.A, atol=1e-8)


def test_state_matrices_against_steps():
    """At rest a small deviation goes as exp(A t): differences of whole motions."""
    machine = pendulum(-math.pi / 2.0)
    sim = Simulator(machine, rtol=1e-12)
    matrices = sim.state_matrices(["rod.P.x"])
    h, little = 0.1, 1e-4
    columns, outputs = [], []
    for key in ("angle", "omega"):
        ends, read = [], []
        for sign in (1.0, -1.0):
            first = {"angle": -math.pi / 2.0, "omega": 0.0}
            first[key] += sign * little
            assert sim.reset({"rod": first}) < 1e-12
            read.append(sim.measure("rod.P.x"))
            sim.step(h)
            ends.append([sim["rod"].angle, sim["rod"].omega])
        columns.append((np.array(ends[0]) - ends[1]) / (2.0 * little))
        outputs.append((read[0] - read[1]) / (2.0 * little))
    # central differences: the square of the deviation
    assert_allclose(np.array(columns).T, expm(matrices.A * h), atol=1e-7)
    assert_allclose(matrices.C[0], outputs, atol=1e-7)


def test_state_matrices_in_motion_against_steps():
    """Of a moving four-bar: x(h) = (1 + h A + …) x by steps of two lengths, extrapolated."""
    sim = some("free_fourbar")
    sim.until(0.2)
    found = sim.state_matrices(["rocker.angle", "coupler.B.vx", "B.fx"])
    base, little = sim.state, 1e-5
    t, angle, omega = sim.t, sim["crank"].angle, sim["crank"].omega

    def change(h):
        columns, outputs = [], []
        for key in ("angle", "omega"):
            ends, read = [], []
            for sign in (1.0, -1.0):
                first = {"angle": angle, "omega": omega}
                first[key] += sign * little
                sim.reset({"crank": first}, t=t)
                read.append([sim.measure(one) for one in found.outputs])
                sim.step(h)
                ends.append([sim["crank"].angle, sim["crank"].omega])
            columns.append((np.array(ends[0]) - ends[1]) / (2.0 * little))
            outputs.append((np.array(read[0]) - read[1]) / (2.0 * little))
        return (np.array(columns).T - np.eye(2)) / h, np.array(outputs).T

    (one, C), (half, _) = change(2e-3), change(1e-3)
    sim.state = base
    size = np.abs(found.A).max()
    assert_allclose(2.0 * half - one, found.A, rtol=0, atol=1e-3 * size)
    assert_allclose(found.C, C, rtol=1e-6, atol=1e-6 * np.abs(C).max())


def test_measures_of_a_slider_and_a_spring():
    """m ẍ = −k x: the leader slides, its way is the state."""
    machine = Mechanism("slide")
    machine.add(
        Body("block", mass=2.0, guess=(1.0, 0.0, 0.0)),
        mbody.Prismatic("guide", "ground", "block"),
        Spring("spring", mbody.Marker("ground", (-3.0, 0.0)), "block", 8.0, free_length=4.0),
    )
    found = Simulator(machine).state_matrices(["block.x", "block.ax", "spring.force"])
    assert found.states == ("block.way", "block.rate")
    assert_allclose(found.A, [[0.0, 1.0], [-4.0, 0.0]], atol=1e-8)
    assert_allclose(found.C, [[1.0, 0.0], [-4.0, 0.0], [8.0, 0.0]], atol=1e-7)


def test_inputs_and_auxiliary_states_in_state_matrices():
    """A driven pendulum with an integrator, by hand: I α = u + 2 z − m g c cos θ − 0.3 ω."""
    machine = pendulum(0.4)
    machine.add(
        mbody.Input("u", "1 N*m"),
        mbody.Input("bias", "0 N*m"),
        mbody.State("z", rate="1 rad - rod.angle - 0.5*z/(1 s)", start="0.2 rad*s"),
        Torque("drive", "rod", value="u*(1 + sin(rod.angle)) + 2 N*m/rad/s*z - bias"),
    )
    own, drop, d = 0.1 + 2.0 * 0.25, 2.0 * 9.81 * 0.5, 0.3
    sim = Simulator(machine, rates={"rod": 0.7}, rtol=1e-9)
    sim.inputs["u"] = 3.0
    sim.until(0.05)
    found = sim.state_matrices(["rod.alpha", "u", "z", "O.fy"])
    angle = sim["rod"].angle
    row = [(drop * math.sin(angle) + 3.0 * math.cos(angle)) / own, -d / own, 2.0 / own]
    assert found.states == ("rod.angle", "rod.omega", "z") and found.inputs == ("u", "bias")
    assert_allclose(found.A, [[0.0, 1.0, 0.0], row, [-1.0, 0.0, -0.5]], atol=1e-8)
    B = [[0.0, 0.0], [(1.0 + math.sin(angle)) / own, -1.0 / own], [0.0, 0.0]]
    assert_allclose(found.B, B, atol=1e-9)
    assert_allclose(found.C[0], row, atol=1e-8)
    assert_allclose(found.C[1:3], [[0.0, 0.0, 0.0], [0.0, 0.0, 1.0]], atol=1e-9)
    assert_allclose(found.D[:3], [B[1], [1.0, 0.0], [0.0, 0.0]], atol=1e-9)
    # O.fy = m ay + m g, and ay changes by c cos θ α
    assert_allclose(found.D[3], 2.0 * 0.5 * math.cos(angle) * np.array(B[1]), atol=1e-8)


def test_a_regulator_from_state_matrices():
    """LQR of a cart-pole: the eigenvalues of A − B K are what the steps show."""
    machine = Mechanism("cart pole")
    M, m, c, inertia, g = 1.0, 0.2, 0.3, 0.01, 9.81
    machine.add(
        Body("cart", mass=M, guess=(0.0, 0.0, 0.0)),
        Body("pole", mass=m, inertia=inertia, cg=(c, 0.0), guess=(0.0, 0.0, math.pi / 2.0)),
        mbody.Prismatic("rail", "ground", "cart"),
        Revolute("pin", "cart", "pole"),
        Gravity("gravity", y=-g),
        mbody.Input("u", "0 N"),
        mbody.Force("motor", "cart", value="u"),
    )
    sim = Simulator(machine, rtol=1e-10)
    found = sim.state_matrices(["cart.x", "pole.angle"])
    assert found.states == ("cart.way", "pole.angle", "cart.rate", "pole.omega")
    # the textbook's linear equations about the upright pole; its angle is from the x axis
    H = np.array([[M + m, -m * c], [-m * c, inertia + m * c * c]])
    K = np.array([[0.0, 0.0], [0.0, m * g * c]])
    assert_allclose(found.A[2:, :2], np.linalg.solve(H, K), atol=1e-8)
    assert_allclose(found.B[2:, 0], np.linalg.solve(H, [1.0, 0.0]), atol=1e-9)
    P = solve_continuous_are(found.A, found.B, np.diag([10.0, 10.0, 1.0, 1.0]), np.eye(1))
    gain = found.B.T @ P
    expected = expm((found.A - found.B @ gain) * 0.5)
    little = 1e-5
    sim.reset({"pole.angle": math.pi / 2.0 + little})
    h = 1e-4
    for _ in range(5000):
        lean = sim["pole"].angle - math.pi / 2.0
        x = [sim["cart"].x, lean, sim["cart"].vx, sim["pole"].omega]
        sim.inputs["u"] = -float(gain[0] @ x)
        sim.step(h)
    lean = sim["pole"].angle - math.pi / 2.0
    x = np.array([sim["cart"].x, lean, sim["cart"].vx, sim["pole"].omega]) / little
    # held for a tenth of a millisecond instead of following at once: to first order in that
    assert_allclose(x, expected[:, 1], atol=5e-3 * np.abs(expected[:, 1]).max())
