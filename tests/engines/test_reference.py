"""The oracle itself, against results by hand: truth from outside before it judges the core."""

import math

import numpy as np
import pytest
from numpy.testing import assert_allclose

from mbody.engines.oracle import Reference
from mbody.laws import ConstantSpeed, Harmonic, Polynomial
from mbody.model.body import Body
from mbody.model.driver import AngleDriver, CoordinateDriver, DistanceDriver
from mbody.model.element import Marker, polar
from mbody.model.joints import CustomJoint, Distance, Fixed, Prismatic, Revolute
from mbody.model.loads import Force, Gravity
from mbody.model.mechanism import Mechanism
from mbody.quantities import deg, rpm
from tests.support.linkages import random_linkage
from validation.norton_fourbar import build, newton_euler

LINKAGES = (
    [(seed, loops, {}) for seed in range(2) for loops in (1, 3, 4)]
    + [(seed, 3, {"sliders": True}) for seed in range(3)]
    + [(0, 2, {"extras": True, "sliders": True})]
)


def differences(function, x, h):
    """Derivative of a function by an eighth-order central difference with step h."""
    weights = (4.0 / 5.0, -1.0 / 5.0, 4.0 / 105.0, -1.0 / 280.0)
    return sum(
        w * (function(x + k * h) - function(x - k * h)) / h for k, w in enumerate(weights, 1)
    )


def at_start(mechanism):
    oracle = Reference(mechanism)
    q = oracle.close(oracle.guess(), 0.0)
    v = oracle.velocities(q, 0.0)
    return oracle, q, v, oracle.accelerations(q, v, 0.0)


# -- Norton, Design of Machinery, example 11-3 ------------------------------------------------

# F12, F32, F43, F14 [lbf], T12 [lbf·in], recomputed in quadruple precision
EXACT = [-117.55959232776144, -107.4585265485302, 118.02591357128473, 100.17225711847838]
EXACT += [-1.3095628736696991, 87.40148615519001, -20.23782406161011, 77.6581310210478]
EXACT += [243.23759076122965]
# with the print's rounded masses; the print itself: −117.65 −107.84 118.13 100.34 −1.34 87.43 …
PRINTED = [-117.649667182627, -107.83960280687617, 118.12966718262699, 100.33960280687617]
PRINTED += [-1.3358182081513543, 87.43176490602082, -20.2314444630091, 77.70520866004091]
PRINTED += [243.22745658658891]


# on the crank, crank, coupler, rocker, where the description has the link as body i or j
NORTON_PINS = {"O2": 1.0, "A": -1.0, "B": -1.0, "O4": 1.0}


def norton_forces(oracle, q, v, a):
    """The nine unknowns of eq. 11.9."""
    forces = oracle.kinetostatics(q, v, a, 0.0)
    pins = [sign * forces["reactions"][name] for name, sign in NORTON_PINS.items()]
    assert_allclose([pin[2] for pin in pins], 0.0, atol=1e-10)
    return [*np.ravel([pin[:2] for pin in pins]), forces["efforts"]["motor"]]


@pytest.mark.parametrize(("masses", "wanted"), [("exact", EXACT), ("printed", PRINTED)])
def test_norton_by_hand_and_by_the_oracle(masses, wanted):
    motion = newton_euler.motion(math.radians(60.0), 25.0, -40.0)
    assert_allclose(newton_euler.forces(motion, masses)[:, 0], wanted, atol=1e-10, rtol=0)
    assert_allclose(norton_forces(*at_start(build(masses))), wanted, atol=1e-10, rtol=0)


def test_norton_whole_turn_by_hand_and_by_the_oracle():
    theta = math.radians(60.0) + np.linspace(0.0, 2.0 * math.pi, 13)
    by_hand = newton_euler.forces(newton_euler.motion(theta, 25.0, -40.0)).T
    oracle, q, *_ = at_start(build())
    for angle, wanted in zip(theta, by_hand):
        q = oracle.close(q, 0.0, {"motor": float(angle)})
        v = oracle.velocities(q, 0.0, {"motor": 25.0})
        found = norton_forces(oracle, q, v, oracle.accelerations(q, v, 0.0, {"motor": -40.0}))
        assert_allclose(found, wanted, atol=1e-10 * np.abs(wanted).max(), rtol=0)


# -- pendulum ---------------------------------------------------------------------------------


def pendulum(law=0.3, **more):
    machine = Mechanism("pendulum", ground={"O": (1.0, 2.0)})
    machine.add(
        Body("arm", mass=3.0, inertia=0.7, cg=polar(0.8, 0.5), points={"O": (0.1, -0.2)}),
        Revolute("O", "ground.O", "arm.O"),
        AngleDriver("motor", "arm", law),
        Gravity("gravity", y=-9.81),
    )
    return machine


def test_pendulum_driven_and_free():
    law = Harmonic(0.3, 0.9, 4.0, 0.2)
    oracle, q, v, a = at_start(pendulum(law))
    theta, w, alpha = law.derivatives(0.0)
    # the arm from the pin to the mass centre, in link axes and turned
    sx, sy = 0.8 * math.cos(0.5) - 0.1, 0.8 * math.sin(0.5) + 0.2
    c, s = math.cos(theta), math.sin(theta)
    px, py = c * sx - s * sy, s * sx + c * sy
    assert_allclose(q, [1.0 + px, 2.0 + py, theta])
    assert_allclose(v, [-w * py, w * px, w])
    ax, ay = -alpha * py - w * w * px, alpha * px - w * w * py
    assert_allclose(a, [ax, ay, alpha])
    forces = oracle.kinetostatics(q, v, a, 0.0)
    about_pin = 0.7 + 3.0 * (px * px + py * py)
    assert_allclose(forces["reactions"]["O"], [3.0 * ax, 3.0 * (ay + 9.81), 0.0], atol=1e-12)
    assert_allclose(forces["efforts"]["motor"], about_pin * alpha + 3.0 * 9.81 * px)
    free, lam = oracle.dynamics(q, v, 0.0)
    assert_allclose(free[2], -3.0 * 9.81 * px / about_pin)
    assert lam[oracle.rows["motor"]] == 0.0
    # a force through Force and one by the driver's effort are the same
    pushed, _ = oracle.dynamics(q, v, 0.0, efforts=forces["efforts"])
    assert_allclose(pushed, a, atol=1e-12)


@pytest.mark.parametrize("sides", [("ground.W", "beam.W"), ("beam.W", "ground.W")])
def test_cantilever(sides):
    """A beam welded to a wall: the reaction's torque is about the marker, on body j."""
    machine = Mechanism("cantilever", ground={"W": (2.0, 1.0)})
    machine.add(
        Body("beam", cg=(3.0, 3.0), points={"W": (0.5, 0.0), "tip": (2.5, 0.0)}),
        Fixed("weld", *sides),
        Force.components("push", "beam.tip", 3.0, -4.0),
    )
    oracle, q, v, a = at_start(machine)
    sign = 1.0 if sides[1] == "beam.W" else -1.0
    reaction = oracle.kinetostatics(q, v, a, 0.0)["reactions"]["weld"]
    assert_allclose(reaction, sign * np.array([-3.0, 4.0, 8.0]))


@pytest.mark.parametrize("kind", [CoordinateDriver, DistanceDriver])
def test_lift(kind):
    """A mass lifted along a guide at 90°: the effort is m (g + a), the guide holds the wind."""
    machine = Mechanism("lift")
    up = Marker("ground", (0.0, 0.0), deg(90.0))
    law = Polynomial([1.0, 2.0, 1.5])
    machine.add(
        Body("cage", mass=2.0, inertia=1.0),
        Prismatic("guide", up, Marker("cage", (0.0, 0.0), deg(90.0))),
        kind("winch", up, "cage", law),
        Gravity("gravity", y=-10.0),
        Force("wind", "cage", 7.0),
    )
    oracle = Reference(machine)
    q = oracle.close([0.1, 0.9, 0.1], 0.0)
    v = oracle.velocities(q, 0.0)
    a = oracle.accelerations(q, v, 0.0)
    assert_allclose([*q, *v, *a], [0, 1, 0, 0, 2, 0, 0, 3, 0], atol=1e-14)
    forces = oracle.kinetostatics(q, v, a, 0.0)
    assert_allclose(forces["efforts"]["winch"], 26.0)
    assert_allclose(forces["reactions"]["guide"], [-7.0, 0.0, 0.0], atol=1e-13)
    assert abs(oracle.residual_power(q, v, a, 0.0)) < 1e-13


# -- slider-cranks ----------------------------------------------------------------------------


def slider_crank(r, l, angle, speed, mass=0.0, push=0.0):
    """In-line; the crank pin A lies on the rod's side j, so "A" is the force on the rod."""
    machine = Mechanism("slider-crank")
    rod = -math.asin(r / l * math.sin(angle))
    machine.add(
        Body("crank", points={"A": (r, 0.0)}, guess=(0.0, 0.0, angle)),
        Body("rod", points={"B": (l, 0.0)}, guess=rod),
        Body("slider", mass=mass),
        Revolute("O", "ground", "crank"),
        Revolute("A", "crank.A", "rod"),
        Revolute("B", "rod.B", "slider"),
        Prismatic("guide", "ground", "slider"),
        AngleDriver("motor", "crank", ConstantSpeed(angle, speed)),
        Force("gas", "slider", -push),
    )
    return machine


def test_slider_crank_khurmi_15_7():
    """Khurmi, example 15.7: massless rod and crank, 250 kg at the slider, 60° and 250 rpm."""
    gas = 0.35e6 * math.pi / 4.0 * 0.5**2
    oracle, q, v, a = at_start(slider_crank(0.3, 1.2, deg(60.0), rpm(250.0), 250.0, gas))
    assert_allclose(gas, 68722.33929727672)
    forces = oracle.kinetostatics(q, v, a, 0.0)
    fx, fy, _ = forces["reactions"]["A"]
    assert_allclose(math.hypot(fx, fy), 50641.18069840082)
    assert_allclose(fx, 49440.03314215192)
    assert_allclose(math.atan2(fy, fx), q[5])  # a two-force member
    assert_allclose(np.abs(forces["reactions"]["guide"]), [0.0, 10964.137240613323, 0.0], atol=1e-9)
    assert_allclose(abs(forces["efforts"]["motor"]), 14489.51798560644)
    # the gas drives: torque × speed = force × speed of the slider, with inertia
    power = -forces["efforts"]["motor"] * v[2]
    assert_allclose(power, (-gas - 250.0 * a[6]) * v[6])


# -- derivatives ------------------------------------------------------------------------------


class Slot(CustomJoint):
    """A place on j stays on the x axis of i, which rises with time: n_i·d = 0.1 t²."""

    def physics(self, i, j, p, t):
        (ci, si), (cj, sj) = i[3:5], j[3:5]
        dx = j[0] + cj * p[2] - sj * p[3] - i[0] - ci * p[0] + si * p[1]
        dy = j[1] + sj * p[2] + cj * p[3] - i[1] - si * p[0] - ci * p[1]
        nx, ny = -np.sin(i[2] + p[4]), np.cos(i[2] + p[4])
        phi = nx * dx + ny * dy - 0.1 * t * t
        return (phi, 0.0), (0.0,) * 12, (0.0, 0.0), (0.0, 0.0)  # the oracle needs Φ alone


def zoo():
    """Every joint and driver between two bodies; it need not close."""
    machine = Mechanism("zoo", ground={"G": (0.3, -0.4)})
    law = Harmonic(1.0, 0.5, 3.0, 0.1)
    i, j = Marker("a", "I", 0.3), Marker("b", polar(0.9, 2.0), -0.7)
    machine.add(
        Body("a", mass=1.0, inertia=0.2, cg=(0.1, 0.2), points={"I": (0.4, -0.3)}),
        Body("b", weight=20.0, inertia=0.3, cg=polar(0.4, -1.0)),
        Revolute("revolute", i, j),
        Prismatic("prismatic", i, j),
        Fixed("fixed", j, i),
        Distance("distance", "ground.G", j, length=2.0),
        Slot("slot", j, i),
        AngleDriver("angle", "a", law, relative_to="b"),
        DistanceDriver("cylinder", i, j, law),
        CoordinateDriver("slider", j, i, law),
    )
    return Reference(machine)


def test_derivatives_of_every_element():
    oracle, rng = zoo(), np.random.default_rng(4)
    q, v, t = rng.uniform(-2.0, 2.0, 6), rng.uniform(-2.0, 2.0, 6), 0.7

    def along(s):
        return oracle.phi(q + s * v, t + s)

    def rate(s):
        x = q + s * v
        return oracle.phi_q(x, t + s) @ v - oracle.nu(x, t + s)

    assert_allclose(oracle.phi_q(q, t) @ v - oracle.nu(q, t), differences(along, 0.0, 1e-2), 1e-9)
    assert_allclose(-oracle.gamma(q, v, t), differences(rate, 0.0, 1e-2), rtol=1e-9)
    nu = oracle.nu(q, t)
    law = Harmonic(1.0, 0.5, 3.0, 0.1)
    assert_allclose(nu[-3:], law.derivatives(t)[1])
    assert_allclose(nu[oracle.rows["slot"]], 0.2 * t)
    # a rigid motion of everything changes no length and no angle, but turns the gap of a pin
    rigid = np.array([0.3, -0.2, 0.0] * 2) + np.ravel([[-y, x, 1.0] for x, y, _ in q.reshape(2, 3)])
    moved = oracle.phi_q(q, t) @ rigid
    phi, pin, weld = oracle.phi(q, t), oracle.rows["revolute"], oracle.rows["fixed"]
    assert_allclose(moved[pin], [-phi[pin][1], phi[pin][0]])
    assert_allclose(moved[weld], [-phi[weld][1], phi[weld][0], 0.0], atol=1e-14)
    assert abs(moved[oracle.rows["distance"]][0]) > 0.1  # its other end is on the ground
    for name in ("prismatic", "slot", "angle", "cylinder", "slider"):
        assert_allclose(moved[oracle.rows[name]], 0.0, atol=1e-14)


# -- loads ------------------------------------------------------------------------------------


def length(oracle, q):
    return math.dist(oracle.point(q, Marker("a", "I")), oracle.point(q, Marker("b", "J")))


# -- random linkages --------------------------------------------------------------------------


@pytest.mark.parametrize(("seed", "loops", "more"), LINKAGES)
def test_random_linkages_balance(seed, loops, more):
    mechanism, turn = random_linkage(seed, loops, **more)
    extra = 2 if more.get("extras") else 0
    assert len(mechanism.bodies) + 1 == 2 + 2 * loops + extra
    oracle, q, v, a = at_start(mechanism)
    assert oracle.m == 3 * oracle.n
    assert np.abs(q - oracle.guess()).max() < 0.4
    forces = oracle.kinetostatics(q, v, a, 0.0)
    size = max(np.abs(reaction).max() for reaction in forces["reactions"].values())
    assert forces["residual"] < 1e-12 * size
    assert abs(oracle.residual_power(q, v, a, 0.0)) < 1e-12 * size * np.abs(v).max()
    # the effort of the motor, put into forward dynamics, gives the same motion
    same, lam = oracle.dynamics(q, v, 0.0, efforts=forces["efforts"])
    assert_allclose(same, a, atol=1e-9 * np.abs(a).max())
    joints = slice(0, oracle.rows["motor"].start)
    assert_allclose(lam[joints], forces["lam"][joints], atol=1e-9 * size)
    assert 0.4 <= turn <= 2.0 * math.pi
