"""Formulas that measure accelerations, reactions and efforts: rates of states, algebraic loops."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import mbody
from mbody import (
    AngleDriver,
    Body,
    Force,
    Gravity,
    Marker,
    Mechanism,
    ModelError,
    Prismatic,
    Revolute,
    Simulator,
    SolveError,
    State,
    Torque,
    kinetostatics,
    simulate,
    statics,
    sweep,
)
from mbody.derivatives.gradient import gradient
from mbody.engineering import linearize
from tests.campaign.drawing import random_linkage

MASS, INERTIA, ARM, G = 2.0, 0.3, 0.5, 9.81
#: What the torque measures: by fx, fy and the acceleration of the tip.
BY_X, BY_Y, BY_TIP = 0.2, 0.05, 0.1


def pendulum(*more, loop=True, name="pendulum"):
    """A pendulum whose torque measures the force of its pin and the acceleration of its tip."""
    machine = Mechanism(name)
    points = {"p": (-ARM, 0.0), "tip": (0.4, 0.0)}
    machine.add(Body("arm", mass=MASS, inertia=INERTIA, points=points, guess=(ARM, 0.0, 0.0)))
    machine.add(Revolute("pin", "ground", "arm.p"), Gravity("g", y=-G), *more)
    if loop:
        law = f"{BY_X} m*pin.fx + {BY_Y} m*pin.fy + {BY_TIP} kg*m*arm.tip.ay"
        machine.add(Torque("t", "arm", value=law))
    machine.add(State("impulse", rate="pin.force", start="0 N*s"))
    machine.add(State("turned", rate="arm.alpha", start="0 rad/s"))
    return machine


def alpha(angle, omega, effort=0.0):
    """The angular acceleration in closed form; `effort`: a further torque."""
    s, c, square = np.sin(angle), np.cos(angle), omega * omega
    loop = -BY_X * MASS * ARM * s + (BY_Y * MASS * ARM + BY_TIP * (ARM + 0.4)) * c
    torque = -BY_X * MASS * ARM * square * c + BY_Y * MASS * (G - ARM * square * s)
    torque += effort - BY_TIP * (ARM + 0.4) * square * s - MASS * G * ARM * c
    return torque / (INERTIA + MASS * ARM**2 - loop)


def test_a_loop_and_rates_against_closed_forms():
    run = simulate(pendulum(), 0.4, instants=5, rtol=1e-10, atol=1e-12)
    angle, omega = run["arm"].angle, run["arm"].omega
    np.testing.assert_allclose(run["arm"].alpha, alpha(angle, omega), rtol=1e-12)

    def rates(_, y):
        a, s, c = alpha(y[0], y[1]), np.sin(y[0]), np.cos(y[0])
        force = MASS * np.array([-ARM * (a * s + y[1] ** 2 * c), ARM * (a * c - y[1] ** 2 * s) + G])
        return [y[1], a, np.hypot(*force)]

    found = solve_ivp(rates, (0, 0.4), [0, 0, 0], rtol=1e-12, atol=1e-13, t_eval=run.t).y
    np.testing.assert_allclose(angle, found[0], atol=1e-9)  # the tolerance of the run, ten times
    np.testing.assert_allclose(run.measure("impulse"), found[2], atol=1e-8)
    np.testing.assert_allclose(run.measure("turned"), omega, atol=1e-9)


def test_efforts_in_driven_motion_at_rest_and_simulated():
    machine = pendulum(AngleDriver("motor", "arm", "2*t"))
    machine.add(Torque("more", "arm", value="0.1*motor.effort"))
    run = kinetostatics(machine, [0.0, 0.1, 0.3])
    angle, omega = run["arm"].angle, run["arm"].omega
    # driven: α = 0 by the effort e and a tenth of it
    free, by_one = alpha(angle, omega), alpha(angle, omega, 1.0) - alpha(angle, omega)
    effort = -free / by_one / 1.1
    np.testing.assert_allclose(run.effort("motor"), effort, rtol=1e-12)
    np.testing.assert_allclose(run.load("more").torque, 0.1 * effort, rtol=1e-12)
    simulated = simulate(machine, 0.3, times=[0.0, 0.1, 0.3])
    np.testing.assert_allclose(simulated.effort("motor"), effort, rtol=1e-9)
    still = statics(machine).effort("motor")[0]
    assert still == pytest.approx(-alpha(0.0, 0.0) / (alpha(0.0, 0.0, 1.0) - alpha(0.0, 0.0)) / 1.1)
    by_mass = gradient(machine, "motor.effort", "arm.mass").jacobian.ravel()[0]
    ends = [
        kinetostatics(mbody.assemble(machine).with_values({"arm.mass": mass}), [0.0])
        for mass in (MASS + 1e-4, MASS - 1e-4)
    ]
    change = (ends[0].effort("motor")[0] - ends[1].effort("motor")[0]) / 2e-4
    assert by_mass == pytest.approx(change, rel=1e-7)  # the central difference's error


def carts(first, second="0.7 kg*a.ax"):
    """Two carts whose forces measure each other's acceleration."""
    machine = Mechanism("carts")
    for name, mass in (("a", 2.0), ("b", 3.0)):
        machine.add(Body(name, mass=mass), Prismatic(f"rail {name}", "ground", name))
    machine.add(Force("fa", "a", first), Force("fb", "b", second))
    return machine


@pytest.mark.parametrize("own", [0.0, 0.5, 2.0])  # by 2 kg the first pivot is zero
def test_loops_through_each_other(own):
    run = simulate(carts(f"1 N + {own} kg*a.ax + 0.5 kg*b.ax"), 0.1, instants=2)
    M = np.array([[2.0 - own, -0.5], [-0.7, 3.0]])
    expected = np.linalg.solve(M, [1.0, 0.0])
    np.testing.assert_allclose([run["a"].ax[0], run["b"].ax[0]], expected, rtol=1e-13)


def test_a_loop_without_a_unique_solution_says_so():
    with pytest.raises(SolveError, match=r"'fa' follows .* this algebraic loop has no unique"):
        simulate(carts("1 N + 2 kg*a.ax"), 0.1)
    with pytest.raises(SolveError, match="or an algebraic loop has no unique solution"):
        simulate(carts("1 N + (1 kg + 1 kg/m*a.x)*a.ax"), 10.0)


@pytest.mark.parametrize(
    "seed", [*range(4), *(pytest.param(n, marks=pytest.mark.slow) for n in range(4, 60))]
)
def test_random_linkages_are_consistent(seed):
    """The loads are what their formulas give, and every body is balanced with them."""
    of, rng = random_linkage(seed, margin=0.3, loops=1 + seed % 3), np.random.default_rng(seed)
    machine = of.mechanism("random")
    joints = [one.name for one in machine.joints if type(one) in (Revolute, Prismatic)]
    bodies, drivers = [one.name for one in machine.bodies], [one.name for one in machine.drivers]
    parts: list[dict[str, float]] = []
    for n in range(2):
        names = [f"{rng.choice(joints)}.fx", f"{rng.choice(joints)}.fy"]
        names += [f"{rng.choice(bodies)}.ax", f"{rng.choice(bodies)}.alpha"]
        parts.append({name: float(rng.uniform(-0.1, 0.1)) for name in names})
        own = f"0.1*sin(t)*{drivers[n % len(drivers)]}.effort"
        law = " + ".join([*(f"({f})*{name}" for name, f in parts[n].items()), own, "2"])
        machine.add(Torque(f"loop{n}", str(rng.choice(bodies)), value=law))
    driven = kinetostatics(machine, of.span * np.array([0.0, 0.1, 0.3, 0.7]))
    for run in (driven, simulate(machine, 0.2 * of.span, instants=4)):
        top = max(np.abs(run.measure(name)).max() for terms in parts for name in terms) + 1.0
        for n, terms in enumerate(parts):
            by_effort = 0.1 * np.sin(run.t) * run.effort(drivers[n % len(drivers)])
            law = sum(f * run.measure(name) for name, f in terms.items()) + by_effort + 2.0
            given = np.broadcast_to(run.load(f"loop{n}").torque, run.t.shape)
            # forces of redundant rows are found to the proximal term's half of the digits
            part = 1e-7 if run.regularization else 1e-9
            np.testing.assert_allclose(given, law, atol=part * top)
        assert not [one for one in run.doubts if one.kind == "residual"]


def test_every_executor_gives_the_same():
    machine = pendulum()
    alone = [
        simulate(mbody.assemble(machine).with_values({"arm.mass": m}), 0.1) for m in (1.0, 3.0)
    ]
    together = sweep(
        machine, {"arm.mass": [1.0, 3.0]}, analysis="simulate", until=0.1, measure="max(impulse)"
    )
    wanted = [one.measure("impulse").max() for one in alone]
    np.testing.assert_allclose(together["max(impulse)"], wanted, rtol=1e-8)  # of the steps
    sim = Simulator(machine)
    sim.step(0.1)
    run = simulate(machine, 0.1)
    for name in ("impulse", "pin.fx", "t.torque"):
        assert sim.measure(name) == pytest.approx(run.measure(name)[-1], rel=1e-7)
    led = pendulum(AngleDriver("motor", "arm", "0.5*t"))
    how = {"release": {"motor": 0.0}, "rtol": 1e-11, "atol": 1e-12, "instants": 2}
    exact = gradient(led, "impulse", "arm.mass", analysis="simulate", until=0.1, **how)
    ends = [
        simulate(mbody.assemble(led).with_values({"arm.mass": mass}), 0.1, **how)
        for mass in (MASS + 1e-4, MASS - 1e-4)
    ]
    change = (ends[0].measure("impulse")[-1] - ends[1].measure("impulse")[-1]) / 2e-4
    assert exact.jacobian.ravel()[-1] == pytest.approx(change, rel=1e-6)  # of the difference
    found = linearize(machine, at=run.at(0.1))
    angle, omega, h = run["arm"].angle[-1], run["arm"].omega[-1], 1e-5
    by_angle = (alpha(angle + h, omega) - alpha(angle - h, omega)) / (2 * h)
    assert -found.stiffness[0, 0] / found.mass[0, 0] == pytest.approx(by_angle, rel=1e-6)


def test_a_loop_in_balance_has_exact_derivatives():
    """What the loop gives is rounding there, beside forces that balance."""
    machine = Mechanism("balanced", parameters={"p": "0 N*m"})
    arm = Body("arm", mass=MASS, inertia=INERTIA, points={"p": (-ARM, 0.0)}, guess=(0.4, 0.2, 0.5))
    machine.add(arm, Revolute("pin", "ground", "arm.p"), Gravity("g", y=-G))
    machine.add(AngleDriver("motor", "arm", "30 deg"))
    machine.add(Torque("hold", "arm", value=MASS * G * ARM * np.cos(np.pi / 6)))
    machine.add(Torque("t", "arm", value="p - 0.4 kg*m^2*arm.alpha"))
    how = {"release": {"motor": 0.0}, "rtol": 1e-10, "atol": 1e-12, "instants": 2}
    found = gradient(machine, "arm.omega", "p", analysis="simulate", until=0.05, **how)
    ends = [
        simulate(mbody.assemble(machine).with_values({"p": p}), 0.05, **how)["arm"].omega[-1]
        for p in (1e-4, -1e-4)
    ]
    assert found.jacobian.ravel()[-1] == pytest.approx((ends[0] - ends[1]) / 2e-4, rel=1e-7)


def test_forces_that_are_not_unique_are_doubted():
    door = Mechanism("door")
    door.add(Body("door", mass=3.0, inertia=1.0, points={"a": (0, 0.5), "b": (0, -0.5)}))
    door.add(Prismatic("upper", "ground", "door.a"), Gravity("g", y=-G))
    door.add(Prismatic("lower", Marker("ground", (0.0, -1.0)), "door.b"))
    door.add(State("sum", rate="upper.fy + lower.fy", start="0 N*s"))
    assert simulate(door, 0.1).doubts == ()
    door.add(State("one", rate="upper.fy", start="0 N*s"))
    (doubt,) = simulate(door, 0.1).doubts
    assert doubt.elements == ("one",) and "not unique" in doubt.message


def test_what_is_not_linear_is_named():
    for law, word in (("0.1*pin.force*(1 m)", "hypot"), ("abs(pin.fx)*(1 m)", "abs")):
        machine = pendulum(loop=False)
        machine.add(Torque("t", "arm", value=law))
        with pytest.raises(ModelError, match=rf"by '{word}' in .* algebraic loop"):
            simulate(machine, 0.1)
