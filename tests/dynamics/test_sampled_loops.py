"""Controllers of a cart with its pole and of a four-bar, against SciPy between samples.

The plants are written out once more here by hand: the cart and its pole by Lagrange's equations,
the four-bar reduced to its crank.
"""

import numpy as np
import pytest

import mbody
from mbody import Body, Controller, Force, Gravity, Input, Mechanism, Prismatic, Revolute, Torque

scipy_integrate = pytest.importorskip("scipy.integrate")
scipy_linalg = pytest.importorskip("scipy.linalg")

SAMPLE = 0.01
#: Of the cart, of the pole; half its length and its inertia; friction of the wheels; g.
CART, POLE, HALF, INERTIA, DRAG, G = 1.2, 0.3, 0.4, 0.02, 0.5, 9.81


def cart_pole(*more):
    machine = Mechanism("cart and pole")
    machine.add(
        Body("cart", mass=CART, points={"P": (0.0, 0.0)}),
        Body("pole", mass=POLE, inertia=INERTIA, cg=(HALF, 0.0), guess=1.4),
        Prismatic("rail", "ground", "cart"),
        Revolute("P", "cart.P", "pole"),
        Gravity("gravity", y=-G),
        Input("u", "0 N"),
        Force("push", "cart", value=f"u - {DRAG}*cart.vx"),
    )
    machine.add(*more)
    return machine


def cart_pole_rates(t, y, u):
    """(x, φ, x′, φ′): φ is the angle of the pole from the rail."""
    _, angle, v, w = y
    s, c = np.sin(angle), np.cos(angle)
    M = np.array([[CART + POLE, -POLE * HALF * s], [-POLE * HALF * s, INERTIA + POLE * HALF**2]])
    right = [u - DRAG * v + POLE * HALF * c * w * w, -POLE * G * HALF * c]
    return [v, w, *np.linalg.solve(M, right)]


def between_samples(rates, y, control, count):
    """The exact plant with the controller of each sample: states at the samples."""
    found = [np.array(y, dtype=float)]
    for k in range(count):
        u = control(k * SAMPLE, found[-1])
        step = scipy_integrate.solve_ivp(
            rates, (0.0, SAMPLE), found[-1], "DOP853", args=(u,), rtol=1e-13, atol=1e-14
        )
        found.append(step.y[:, -1])
    return np.array(found)


def gains():
    """Of the quadratic regulator about the upright pole, by the state matrices of a Simulator."""
    sim = mbody.Simulator(cart_pole(), guess={"pole": np.pi / 2})
    sim.reset({"pole": {"angle": np.pi / 2}, "cart": {"x": 0.0}})
    about = sim.state_matrices(measures=["cart.x", "pole.angle", "cart.vx", "pole.omega"])
    cost = about.C.T @ np.diag([10.0, 50.0, 1.0, 1.0]) @ about.C
    P = scipy_linalg.solve_continuous_are(about.A, about.B, cost, np.array([[0.1]]))
    # on measures in the place of states
    return (about.B.T @ P / 0.1 @ np.linalg.inv(about.C))[0]


@pytest.mark.parametrize("rtol", [1e-6, 1e-8, 1e-10])
def test_a_regulator_keeps_the_pole_upright(rtol):
    K = gains()

    def control(t, x, angle, v, w):
        return float(-K @ [x, angle - np.pi / 2, v, w])

    reads = ["cart.x", "pole.angle", "cart.vx", "pole.omega"]
    machine = cart_pole(Controller("lqr", control, SAMPLE, reads, ["u"]))
    start = mbody.Simulator(cart_pole())
    begin = [start["cart"].x, start["pole"].angle, 0.0, 0.0]
    run = mbody.simulate(machine, 3.0, rtol=rtol, every=SAMPLE)
    wanted = between_samples(cart_pole_rates, begin, lambda t, y: control(t, *y), 300)
    found = np.column_stack([run.measure(name) for name in reads])
    # the loop is stable, so that what each step adds fades
    np.testing.assert_allclose(found, wanted, atol=1e-9)
    assert abs(found[-1, 1] - np.pi / 2) < 0.02


# -- a four-bar ------------------------------------------------------------------------------------

LINKS = {"crank": 0.1, "coupler": 0.3, "rocker": 0.25, "ground": 0.35}
MASSES = {"crank": 0.5, "coupler": 1.0, "rocker": 0.8}


def four_bar(*more):
    machine = mbody.makers.four_bar(*LINKS.values(), masses=tuple(MASSES.values()))
    machine = machine.without("motor")
    machine.add(Input("u", "0 N*m"), Torque("drive", "crank", value="u - 0.02*crank.omega"))
    machine.add(*more)
    return machine


def reduced(theta):
    """Inertia of a four-bar of slender links reduced to its crank; takes complex angles."""
    a, b, c, d = LINKS.values()
    A, B = 2 * c * (-a * np.sin(theta)), 2 * c * (d - a * np.cos(theta))
    C = b * b - (a * a + c * c + d * d - 2 * a * d * np.cos(theta))
    gamma = 2 * np.arctan((A + np.sqrt(A * A + B * B - C * C)) / (B + C))
    x = d + c * np.cos(gamma) - a * np.cos(theta)
    y = c * np.sin(gamma) - a * np.sin(theta)
    beta = 2 * np.arctan(y / (x + b))
    turning = np.sin(beta - gamma)
    of_coupler = -a * np.sin(theta - gamma) / (b * turning)
    of_rocker = a * np.sin(beta - theta) / (c * turning)
    m = MASSES
    x1 = -a * np.sin(theta) - 0.5 * b * np.sin(beta) * of_coupler
    y1 = a * np.cos(theta) + 0.5 * b * np.cos(beta) * of_coupler
    return (
        m["crank"] * a * a / 3
        + m["coupler"] * (x1 * x1 + y1 * y1 + b * b / 12 * of_coupler**2)
        + m["rocker"] * c * c / 3 * of_rocker**2
    )


def four_bar_rates(t, y, u):
    theta, w = y
    change = reduced(theta + 1e-30j).imag / 1e-30
    return [w, (u - 0.02 * w - 0.5 * change * w * w) / reduced(theta)]


class Cascade:
    """Position, then speed, then the torque of a current that follows at once, with a memory."""

    def __init__(self):
        self.sum = 0.0

    def __call__(self, t, angle, rate):
        speed = 6.0 * (2.0 - angle)
        self.sum += SAMPLE * (speed - rate)
        return 0.15 * (speed - rate) + 0.4 * self.sum


@pytest.mark.parametrize("rtol", [1e-6, 1e-8, 1e-10])
def test_a_cascade_turns_the_crank_of_a_four_bar(rtol):
    machine = four_bar(
        Controller("cascade", Cascade(), SAMPLE, ["crank.angle", "crank.omega"], "u")
    )
    run = mbody.simulate(machine, 1.5, rtol=rtol, every=SAMPLE)
    begin = [run["crank"].angle[0], run["crank"].omega[0]]
    controller = Cascade()
    wanted = between_samples(four_bar_rates, begin, lambda t, y: controller(t, *y), 150)
    found = np.column_stack([run["crank"].angle, run["crank"].omega])
    np.testing.assert_allclose(found[:, 0], wanted[:, 0], atol=1e-9)
    np.testing.assert_allclose(found[:, 1], wanted[:, 1], atol=1e-8)
