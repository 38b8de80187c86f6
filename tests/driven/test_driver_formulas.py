"""Drivers that follow formulas of inputs, auxiliary states and positions: against the same motion
by laws of time, the oracle, closed forms and virtual power.
"""

import numpy as np
import pytest
from numpy.testing import assert_allclose

import mbody
from tests.support.cases import first_fast

TIMES = np.linspace(0.0, 1.0, 21)
LEAD = "0.3 rad + 1.5 rad/s*t + 0.3 rad*sin(2 rad/s*t)"


def bodies():
    return (
        mbody.Body(
            "crank", mass=2.0, inertia=0.1, cg=(0.25, 0.02), points={"B": (0.5, 0.0)}, guess=0.3
        ),
        mbody.Body(
            "left", mass=3.0, inertia=0.3, cg=(0.9, 0.1), points={"C": (1.8, 0.0)}, guess=1.0
        ),
        mbody.Body(
            "right", mass=3.0, inertia=0.3, cg=(0.7, 0.1), points={"C": (1.5, 0.0)}, guess=2.0
        ),
        mbody.Body(
            "lever", mass=2.5, inertia=0.2, cg=(0.3, 0.0), points={"E": (0.6, 0.0)}, guess=1.2
        ),
    )


def five_bar(*more, **options):
    """Two cranks on the ground and two links between them: two drivers determine it."""
    machine = mbody.Mechanism("five-bar", ground={"A": (0.0, 0.0), "D": (2.0, 0.0)}, **options)
    machine.add(
        *bodies(),
        mbody.Revolute("A", "ground.A", "crank"),
        mbody.Revolute("B", "crank.B", "left"),
        mbody.Revolute("C", "left.C", "right.C"),
        mbody.Revolute("E", "lever.E", "right"),
        mbody.Revolute("D", "ground.D", "lever"),
        mbody.Gravity("gravity", x=1.0, y=-9.81),
        *more,
    )
    return machine


def positions(solution):
    names = ("crank", "left", "right", "lever")
    return {
        f"{name}.{key}": getattr(solution[name], key)
        for name in names
        for key in ("angle", "x", "y", "omega", "vx", "vy", "alpha", "ax", "ay")
    }


def assert_same(one, other, rtol=1e-12):
    """Both move alike, and with the same joint forces."""
    for key, value in positions(one).items():
        assert_allclose(positions(other)[key], value, rtol, rtol * 10.0, err_msg=key)
    if one.analysis != "kinematics":
        for name in "ABCDE":
            assert_allclose(other.reaction(name).fx, one.reaction(name).fx, rtol, 1e-10)
            assert_allclose(other.reaction(name).fy, one.reaction(name).fy, rtol, 1e-10)


# -- formulas of inputs and time -------------------------------------------------------------------


def by_time(angle):
    return five_bar(
        mbody.AngleDriver("first", "crank", LEAD), mbody.AngleDriver("second", "lever", angle)
    )


@pytest.mark.parametrize("analysis", [mbody.kinematics, mbody.kinetostatics, mbody.statics])
def test_an_input_that_is_a_formula_of_time(analysis):
    truth = by_time("1.2 rad + 0.2 rad*cos(3 rad/s*t)*(1 + 0.5*sin(2 rad/s*t))")
    machine = five_bar(
        mbody.Input("u", "0.2 rad*cos(3 rad/s*t)"),
        mbody.AngleDriver("first", "crank", LEAD),
        mbody.AngleDriver("second", "lever", "1.2 rad + u*(1 + 0.5*sin(2 rad/s*t))"),
    )
    one, other = analysis(truth, t=TIMES), analysis(machine, t=TIMES)
    assert_same(one, other)
    for ours, theirs in zip(other.driven("second"), one.driven("second"), strict=True):
        assert_allclose(ours, theirs, 1e-13, 1e-14)
    if analysis is mbody.kinetostatics:
        assert_allclose(other.effort("second"), one.effort("second"), 1e-11, 1e-11)
        assert other.checks.virtual_work < 1e-13


def test_at_given_values_of_an_input():
    """Each operation with its derivatives, against laws of time with their own arithmetic."""
    texts = (
        "{u}^2 + 0.3*sqrt(1 + {u})",
        "0.4*exp(-{u}) + 0.2*log(2 + {u})",
        "0.3*tan({u}) - (0.2*asin(0.5*{u}) + 0.1*acos(0.4*{u}))/(1 rad)",
        "(0.5*atan({u}) + 0.2*atan2({u}, 1 + {u}))/(1 rad) + 0.2*hypot({u}, 0.5)",
        "0.5*min({u}, 0.3) + 0.2*max({u}, 0.2) + 0.3*abs({u} - 0.35)",
        "(1.5 + {u})^(0.5 + 0.2*{u}) - 1/(2 + {u})",
    )
    u = "(0.3 + 0.2*sin(3 rad/s*t))"
    for text in texts:
        truth = five_bar(
            mbody.AngleDriver("first", "crank", LEAD),
            mbody.AngleDriver("second", "lever", f"1 rad*(1 + 0.1*({text.format(u=u)}))"),
        )
        machine = five_bar(
            mbody.Input("u", u),
            mbody.AngleDriver("first", "crank", LEAD),
            mbody.AngleDriver("second", "lever", f"1 rad*(1 + 0.1*({text.format(u='u')}))"),
        )
        times = TIMES + 0.017
        one, other = mbody.kinematics(truth, t=times), mbody.kinematics(machine, t=times)
        assert_same(one, other, 1e-11)


@pytest.mark.parametrize("formula", ["abs({u})", "max({u}, 0)", "min({u}, -{u}) + 2*{u}^2"])
@pytest.mark.parametrize("u", ["(-t/(1 s))", "(sin(3 rad/s*t) - 2*t/(1 s))", "((t/(1 s))^2)"])
def test_at_a_corner_rates_are_those_to_the_right(formula, u):
    """As those of jets (`mbody.laws.kernels`), where the formula is one of time alone."""
    law, of_input = f"1.2 rad + 0.3 rad*({formula.format(u=u)})", mbody.Input("u", u)
    truth = mbody.kinematics(by_time(law), t=[0.0, 0.3]).driven("second")
    machine = five_bar(
        of_input,
        mbody.AngleDriver("first", "crank", LEAD),
        mbody.AngleDriver("second", "lever", f"1.2 rad + 0.3 rad*({formula.format(u='u')})"),
    )
    found = mbody.kinematics(machine, t=[0.0, 0.3]).driven("second")
    assert_allclose(found, truth, 1e-13, 1e-15)


def pendulum(law, *before):
    """A crank that a driver turns, and a rod that swings at its end."""
    machine = mbody.Mechanism("pendulum", ground={"A": (0.0, 0.0)})
    machine.add(
        mbody.Body("crank", mass=2.0, inertia=0.1, cg=(0.1, 0.0), points={"B": (0.4, 0.0)}),
        mbody.Body("rod", mass=1.0, inertia=0.02, cg=(0.3, 0.0), guess=-1.0),
        mbody.Revolute("A", "ground.A", "crank"),
        mbody.Revolute("B", "crank.B", "rod"),
        mbody.Gravity("gravity", y=-9.81),
        *before,
        mbody.AngleDriver("motor", "crank", law),
    )
    return machine


# -- auxiliary states
# ------------------------------------------------------------------------------------

LAG = (
    mbody.Input("u", "0 rad/s^2"),
    mbody.State("speed", rate="u - speed/(0.5 s)", start="0.5 rad/s"),
    mbody.State("way", rate="speed", start="0 rad"),
)


def test_states_that_an_input_leads():
    """ω′ = u − 2 ω, φ′ = ω in closed form; the rod as of the same law of time."""
    machine = pendulum("0.2 rad + way", *LAG)
    run = mbody.simulate(machine, 2.0, instants=41, inputs={"u": "3 rad/s^2"}, rtol=1e-11)
    t = run.t
    omega = 1.5 - np.exp(-2.0 * t)
    angle = 0.2 + 1.5 * t - 0.5 * (1.0 - np.exp(-2.0 * t))
    assert_allclose(run["crank"].angle, angle, 1e-10)
    assert_allclose(run["crank"].omega, omega, 1e-10)
    assert_allclose(run["crank"].alpha, 2.0 * np.exp(-2.0 * t), 1e-8, 1e-9)
    for ours, theirs in zip(run.driven("motor"), (angle, omega), strict=False):
        assert_allclose(ours, theirs, 1e-10)
    text = "0.2 rad + 1.5 rad/s*t - 0.5 rad*(1 - exp(-2*t/(1 s)))"
    same = mbody.simulate(pendulum(text), 2.0, instants=41, rtol=1e-11)
    assert_allclose(run["rod"].angle, same["rod"].angle, 1e-8, 1e-9)
    assert_allclose(run.effort("motor"), same.effort("motor"), 1e-7, 1e-7)
    assert run.checks.virtual_work < 1e-12
    assert run.checks.energy < 1e-7


def test_an_acceleration_that_jumps_in_steps():
    """Set between steps, an input that the acceleration alone follows acts at once."""
    sim = mbody.Simulator(mbody.assemble(pendulum("0.2 rad + way", *LAG)), rtol=1e-10)
    omega, angle = 0.5, 0.2
    for k, u in enumerate((0.0, 4.0, -3.0)):
        sim.inputs["u"] = u
        sim.step(0.3)
        fall = np.exp(-0.6)
        angle += 0.5 * u * 0.3 + (omega - 0.5 * u) * (1.0 - fall) / 2.0
        omega = 0.5 * u + (omega - 0.5 * u) * fall
        assert_allclose(sim["crank"].omega, omega, 1e-9, err_msg=str(k))
        assert_allclose(sim["crank"].angle, angle, 1e-9, err_msg=str(k))


def test_many_motions_of_states():
    system = mbody.assemble(pendulum("0.2 rad + way", *LAG))
    sims = mbody.Simulators(system, 5)
    us = np.linspace(-2.0, 2.0, 5)
    sims.inputs["u"] = us
    sims.step(0.4)
    for k, u in enumerate(us):
        one = mbody.Simulator(system)
        one.inputs["u"] = u
        one.step(0.4)
        assert_allclose(sims["rod"].angle[k], one["rod"].angle, 1e-7)
        assert_allclose(sims["crank"].omega[k], one["crank"].omega, 1e-9)


# -- positions -------------------------------------------------------------------------------------

FOLLOWS = (
    "1.2 rad + 0.4 rad*sin(crank.angle)*cos(0.5*crank.angle) + 0.1 rad*(crank.angle/(1 rad))^2"
)
SAME = "(0.3 + 1.5*t/(1 s) + 0.3*sin(2 rad/s*t))"
BY_TIME = f"1 rad*(1.2 + 0.4*sin({SAME})*cos(0.5*{SAME}) + 0.1*{SAME}^2)"


def following(law=FOLLOWS, kind=mbody.AngleDriver, at=("lever",), **options):
    return five_bar(mbody.AngleDriver("first", "crank", LEAD), kind("second", *at, law), **options)


@pytest.mark.parametrize("analysis", [mbody.kinematics, mbody.kinetostatics, mbody.statics])
@pytest.mark.parametrize("count", [7, 81])
def test_an_angle_that_follows_another(analysis, count):
    """The motion and the joint forces are those by laws of time; the torque on the crank is the
    motor's and what the following driver takes from it.
    """
    times = np.linspace(0.0, 1.0, count)
    one, other = analysis(by_time(BY_TIME), t=times), analysis(following(), t=times)
    assert_same(one, other, 1e-11)
    if analysis is mbody.kinematics:
        return
    angle = other["crank"].angle
    slope = 0.4 * (np.cos(angle) * np.cos(0.5 * angle) - 0.5 * np.sin(angle) * np.sin(0.5 * angle))
    slope += 0.2 * angle
    second = one.effort("second")
    assert_allclose(other.effort("second"), second, 1e-10, 1e-10)
    assert_allclose(other.effort("first") - slope * second, one.effort("first"), 1e-10, 1e-10)
    assert other.checks.virtual_work < 1e-12
    if analysis is mbody.kinetostatics:
        # the following driver gives no power of its own
        assert_allclose(other.measure("second.power"), 0.0, atol=1e-12)
        assert_allclose(
            other.measure("first.power"),
            one.measure("first.power") + one.measure("second.power"),
            1e-10,
            1e-10,
        )
        for ours, theirs in zip(other.driven("second"), one.driven("second"), strict=True):
            assert_allclose(ours, theirs, 1e-11, 1e-12)


PLACES = {
    "of places": (
        mbody.AngleDriver,
        ("lever",),
        "1 rad + 0.3 rad*atan(crank.B.y/(2 m + crank.B.x))",
    ),
    "of a joint": (mbody.AngleDriver, ("lever",), "1.2 rad + 0.2*B.angle"),
    "of time and a place": (
        mbody.AngleDriver,
        ("lever",),
        "1.2 rad + 0.2 rad*sin(2 rad/s*t)*crank.B.x/(1 m)",
    ),
    "of an input and a place": (mbody.AngleDriver, ("lever",), "1.2 rad + u*crank.B.y/(1 m)"),
    "a distance": (mbody.DistanceDriver, ("crank.B", "lever.E"), "1.9 m + 0.1*crank.B.x"),
    "a displacement": (mbody.CoordinateDriver, ("ground.D", "lever.E"), "0.1 m + 0.3*crank.B.y"),
    "of its own coordinate": (
        mbody.AngleDriver,
        ("lever",),
        "0.9 rad + 0.2*lever.angle + 0.1*crank.angle",
    ),
    "of what it moves": (mbody.AngleDriver, ("lever",), "0.9 rad + 0.2*left.angle"),
}


@first_fast("name", PLACES, 4)
def test_positions_against_the_oracle(name):
    """The oracle reads the text by itself, with complex steps and jets for derivatives."""
    kind, at, law = PLACES[name]
    machine = five_bar(
        mbody.Input("u", "0.2 rad*cos(3 rad/s*t)"),
        mbody.AngleDriver("first", "crank", LEAD),
        kind("second", *at, law),
    )
    for run in (mbody.kinetostatics(machine, t=TIMES), mbody.simulate(machine, 1.0, times=TIMES)):
        checked = mbody.crosscheck(machine, ["oracle", "balance"], ours=run)
        assert checked.agrees, str(checked)
        assert checked.opinions["oracle"].rows and checked.opinions["balance"].rows
        assert run.checks.constraint < 1e-13
        assert run.checks.virtual_work < 1e-12


def swinging(law):
    """A free arm and another that a driver lets follow it."""
    machine = mbody.Mechanism("two arms", ground={"A": (0.0, 0.0), "D": (2.0, 0.0)})
    machine.add(
        mbody.Body("free", mass=2.0, inertia=0.1, cg=(0.3, 0.0), guess=-0.4),
        mbody.Body("other", mass=1.0, inertia=0.05, cg=(0.2, 0.0)),
        mbody.Revolute("A", "ground.A", "free"),
        mbody.Revolute("D", "ground.D", "other"),
        mbody.Gravity("gravity", y=-9.81),
        mbody.AngleDriver("link", "other", law),
    )
    return machine


@pytest.mark.parametrize("method", ["dop853", "dopri5", "radau5", "generalized-alpha", "rattle4"])
def test_a_free_motion_that_a_driver_couples(method):
    """L = ½ (J₁ + J₂ f′²) φ̇² − V, solved by SciPy; the driver does no work."""
    from scipy.integrate import solve_ivp

    machine = swinging("0.5*free.angle + 0.3 rad*sin(free.angle)")
    how = {"rtol": 1e-10} if method in ("dop853", "dopri5", "radau5") else {"step": 1e-3}
    run = mbody.simulate(machine, 1.5, method=method, instants=16, **how)

    def rates(_, y):
        p, w = y
        f1, f2 = 0.5 + 0.3 * np.cos(p), -0.3 * np.sin(p)
        f = 0.5 * p + 0.3 * np.sin(p)
        j1, j2 = 0.1 + 2.0 * 0.09, 0.05 + 0.04
        torque = -9.81 * (2.0 * 0.3 * np.cos(p) + 0.2 * np.cos(f) * f1)
        return [w, (torque - j2 * f1 * f2 * w * w) / (j1 + j2 * f1 * f1)]

    first = float(run["free"].angle[0])
    truth = solve_ivp(rates, (0.0, 1.5), [first, 0.0], "DOP853", run.t, rtol=1e-12, atol=1e-13)
    near = 1e-8 if "rtol" in how else 2e-5
    assert_allclose(run["free"].angle, truth.y[0], near, near)
    assert_allclose(run["free"].omega, truth.y[1], near, 10.0 * near)
    assert_allclose(run.measure("link.power"), 0.0, atol=1e-12)
    assert run.checks.energy < (1e-8 if "rtol" in how else 1e-4)


def test_a_sweep_of_designs_that_follow():
    """Numbers of the formula differ from design to design, on lanes and one by one."""
    law = "1.2 rad + gain*sin(crank.angle) + 0.1*crank.angle"
    machine = following(law, parameters={"gain": "0.4 rad"})
    gains = np.linspace(0.1, 0.5, 9)
    system = mbody.assemble(machine)
    many = mbody.kinetostatics(system.with_values({"gain": gains}), t=TIMES)
    for k in (0, 4, 8):
        one = mbody.kinetostatics(system.with_values({"gain": gains[k]}), t=TIMES)
        assert_allclose(many.effort("first")[k], one.effort("first"), 1e-10, 1e-10)
        assert_allclose(many.measure("second.power")[k], 0.0, atol=1e-11)
        assert_allclose(many.driven("second")[0][k], one.driven("second")[0], 1e-12)


def test_free_bodies_with_a_driver_of_positions():
    """Every link is in equilibrium with what the driver does to it, the crank too."""
    run = mbody.kinetostatics(following(), t=TIMES)
    names = set()
    for body in ("crank", "left", "right", "lever"):
        forces = mbody.free_body(run, body, 3)
        names |= {(one.cause, body) for one in forces}
        x, y = run[body].x[3], run[body].y[3]
        total = np.zeros(3)
        for one in forces:
            moment = (one.x - x) * one.fy - (one.y - y) * one.fx + one.torque
            total += one.fx, one.fy, moment
        assert_allclose(total, 0.0, atol=1e-11)
    assert {("second", "crank"), ("second", "lever")} <= names


def test_what_a_release_leaves():
    """Released, a driver that follows positions has no effort, and the rest moves freely."""
    machine = following()
    run = mbody.simulate(machine, 0.4, instants=9, release={"second": 0.2})
    assert np.all(run.effort("second")[run.t > 0.2] == 0.0)
    held = mbody.simulate(machine, 0.2, instants=5)
    assert_allclose(run["left"].angle[:5], held["left"].angle, 1e-9)
    assert run.checks.energy < 1e-6


def test_small_motions_of_a_free_arm_that_another_follows():
    """ω² = V″/(J₁ + J₂ f′²) at both rest positions, and V′ = 0 there."""
    machine = swinging("0.5*free.angle + 0.3 rad*sin(free.angle)")

    def potential(p):
        return 9.81 * (0.6 * np.sin(p) + 0.2 * np.sin(0.5 * p + 0.3 * np.sin(p)))

    for rest in mbody.equilibrium(machine):
        linear = mbody.engineering.linearize(machine, at=rest)
        p, h = float(rest.solution["free"].angle[0]), 1e-3
        values = potential(p + h * np.arange(-2, 3))
        slope = values @ np.array([1.0, -8.0, 0.0, 8.0, -1.0]) / (12.0 * h)
        bend = values @ np.array([-1.0, 16.0, -30.0, 16.0, -1.0]) / (12.0 * h * h)
        mass = 0.28 + 0.09 * (0.5 + 0.3 * np.cos(p)) ** 2
        assert abs(slope) < 1e-9
        found = float(linear.stiffness[0, 0] / linear.mass[0, 0])
        assert found == pytest.approx(bend / mass, rel=1e-6)
