"""Named quantities against the formulas written out in their place."""

import numpy as np
import pytest

import mbody
from mbody import (
    AngleDriver,
    Body,
    Controller,
    Gravity,
    Input,
    Mechanism,
    Prismatic,
    Quantity,
    Revolute,
    Simulator,
    State,
    Stop,
    Torque,
    kinetostatics,
    simulate,
)
from mbody.derivatives.gradient import gradient
from mbody.laws import Table
from mbody.model.states import MOST_EXPANDED

#: The quantities of `arm` written out.
ERROR = "(target - arm.angle)"
PULL = f"(k*{ERROR} - 2 N*m*s/rad*arm.omega)"


def arm(named=True, k="40 N*m/rad"):
    """An arm that a controller in formulas holds; by named quantities, or written out."""
    machine = Mechanism("arm", parameters={"k": k, "target": "30 deg"})
    machine.add(Body("arm", mass=1.0, inertia=0.1, cg=(0.3, 0.0), guess=0.2))
    machine.add(Revolute("O", "ground", "arm"), Gravity("gravity", y=-9.81), Input("u", "1 N*m"))
    if named:
        machine.add(Quantity("error", ERROR), Quantity("pull", "k*error - 2 N*m*s/rad*arm.omega"))
    error, pull = ("error", "pull") if named else (ERROR, PULL)
    machine.add(State("z", error, start="0 rad*s"))
    machine.add(Torque("motor", "arm", value=f"{pull} + u + 3 N*m/rad/s*z + 0.1*{pull}"))
    machine.measures |= {"twice": mbody.model.simulation.Measure(f"2*{pull}")}
    return machine


def test_a_motion_is_that_of_the_formulas_written_out():
    named, plain = simulate(arm(), 1.0), simulate(arm(named=False), 1.0)
    np.testing.assert_allclose(named["arm"].angle, plain["arm"].angle, rtol=1e-13)
    for name, text in (("error", ERROR), ("pull", PULL), ("2*pull - u", f"2*{PULL} - u")):
        np.testing.assert_allclose(named.measure(name), plain.measure(text), atol=1e-12)
    assert np.array_equal(named.measure("twice"), 2.0 * named.measure("pull"))
    column = next(one for one in named.table() if one.owner == "pull")
    assert (column.role, column.unit) == ("quantity", "N·m")
    assert np.array_equal(column.values, named.measure("pull"))


def test_each_is_computed_once_in_a_formula():
    few = mbody.assemble(arm()).layout.formula_numbers
    many = arm()
    many.add(Torque("again", "arm", value="+".join(["pull"] * 50)))
    more = mbody.assemble(many).layout.formula_numbers
    assert more < few + 70


def test_drivers_follow_them_with_rates_and_accelerations():
    machine = mbody.makers.four_bar(1, 3, 2, 3.5, speed=2.0, masses=(1, 3, 2))
    other = mbody.makers.four_bar(1, 3, 2, 3.5, speed=2.0, masses=(1, 3, 2))
    for one in (machine, other):
        one.add(Body("wheel", mass=1.0, inertia=0.3), Revolute("P", "ground", "wheel"))
    machine.add(Quantity("lift", "2*(coupler.B.y - crank.A.y)"))
    machine.add(Quantity("turning", "1 rad/m*lift + 0.2 rad*sin(3 rad/s*t)"))
    machine.add(AngleDriver("follower", "wheel", "turning"))
    text = "1 rad/m*(2*(coupler.B.y - crank.A.y)) + 0.2 rad*sin(3 rad/s*t)"
    other.add(AngleDriver("follower", "wheel", text))
    found, wanted = (kinetostatics(one, np.linspace(0.0, 3.0, 7)) for one in (machine, other))
    for name in ("motor", "follower"):
        np.testing.assert_allclose(found.effort(name), wanted.effort(name), atol=1e-11)
    np.testing.assert_allclose(found["wheel"].alpha, wanted["wheel"].alpha, atol=1e-11)


def test_a_stop_may_be_one():
    ball = Mechanism("ball")
    ball.add(Body("ball", mass=1.0, inertia=1.0, guess=(0, 1, 0)), Gravity("gravity", y=-9.81))
    ball.add(Quantity("height", "ball.y - 20 mm"), Stop("floor", "height", restitution=0.5))
    until = np.sqrt(2 * 0.98 / 9.81)  # falls 0.98 m, rebounds at half the rate
    run = simulate(ball, 1.5 * until)
    rate = 0.5 * 9.81 * until - 9.81 * 0.5 * until
    np.testing.assert_allclose(run["ball"].vy[-1], rate, atol=1e-9)


def test_corners_of_laws_of_time_are_met_through_them():
    ramp = Table(
        ["0 s", "0.4 s", "0.41 s", "1 s"], ["0 N", "0 N", "5 N", "5 N"], interpolation="linear"
    )
    cart = Mechanism("cart", curves={"ramp": ramp})
    cart.add(Body("cart", mass=1.0, inertia=1.0), Prismatic("rail", "ground", "cart"))
    cart.add(Quantity("clock", "t"), Quantity("push", "ramp(clock)"))
    cart.add(mbody.Force("F", "cart", "push"))
    run = simulate(cart, 1.0)
    np.testing.assert_allclose(run["cart"].vx[-1], 5.0 * (0.59 + 0.005), rtol=1e-13)
    np.testing.assert_allclose(run.measure("push")[-1], 5.0)


def test_a_voltage_that_is_measured_may_be_named():
    cart = Mechanism("cart")
    cart.add(Body("cart", mass=1.0, inertia=1.0), Prismatic("rail", "ground", "cart"))
    cart.add(mbody.Force("F", "cart", Table([0.0, 1.0], [2.0, 4.0], interpolation="linear")))
    cart.add(Quantity("seen", "F.value + 1 N"), mbody.Force("G", "cart", "-0.5*seen"))
    run = simulate(cart, 1.0)
    np.testing.assert_allclose(run.measure("seen"), 3.0 + 2.0 * run.t)
    np.testing.assert_allclose(run["cart"].ax, 0.5 * (1.0 + 2.0 * run.t))


def test_simulators_controllers_and_gradients_read_them():
    sim, plain = Simulator(arm()), Simulator(arm(named=False))
    for one in (sim, plain):
        one.until(0.3)
    np.testing.assert_allclose(sim.measure("pull"), plain.measure(PULL), rtol=1e-12)
    seen = []
    machine = arm()
    machine.add(Controller("c", lambda t, e: seen.append(e) or 0.5, "0.1 s", ["error"], ["u"]))
    run = simulate(machine, 0.5)
    np.testing.assert_allclose(seen[0], np.radians(30) - 0.2, rtol=1e-12)
    sampled = np.interp(0.1 * np.arange(len(seen)), run.t, run.measure("error"))
    np.testing.assert_allclose(seen, sampled, atol=1e-9)
    runs = [simulate(one, 0.5) for one in (arm(), arm(named=False))]
    options = {"analysis": "simulate", "start": runs[0], "until": 0.7}
    named = gradient(arm(), "last(pull)", ["k"], **options)
    other = gradient(arm(named=False), f"last({PULL})", ["k"], **(options | {"start": runs[1]}))
    np.testing.assert_allclose(named.jacobian, other.jacobian, rtol=1e-9)


FILE = """
units = "SI"
[inputs]
u = "0 N*m"
[bodies]
arm = { mass = 1, inertia = 0.1 }
wheel = { mass = 1, inertia = 0.1 }
[joints]
O = { revolute = ["ground", "arm"] }
P = { revolute = ["ground", "wheel"] }
[quantities]
both  = "2*drive + error"
drive = "motor.rate"
error = "5 rad/s - arm.omega"
[drivers]
motor = { angle = "wheel", law = "1 rad/s*t" }
[loads]
T = { torque = "2 N*m*s/rad*both + u", body = "arm" }
"""


def test_files_have_them_in_any_order():
    machine = mbody.from_toml(FILE)
    again = mbody.from_toml(mbody.to_toml(machine))
    assert again == machine
    assert {one.name: one.formula.text for one in machine.quantities} == {
        "drive": "motor.rate", "error": "5 rad/s - arm.omega", "both": "2*drive + error",
    }  # fmt: skip
    other = mbody.from_toml(FILE.replace("both + u", "(2*motor.rate + 5 rad/s - arm.omega) + u"))
    found, wanted = simulate(machine, 1.0), simulate(other, 1.0)
    np.testing.assert_allclose(found["arm"].angle, wanted["arm"].angle, rtol=1e-13)
    inches = mbody.files.model.in_units(machine, "in-lbf-s")
    run = simulate(inches, 1.0)
    np.testing.assert_allclose(run["arm"].angle, wanted["arm"].angle, rtol=1e-7)


@pytest.mark.parametrize(
    ("old", "new", "problem"),
    [
        ('"motor.rate"', '"motr.rate"', "quantities.drive: there is no 'motr' to measure"),
        ('drive = "motor.rate"', "drive = []", "quantities.drive: must be"),
        ("error = ", "u = ", "quantities.u: the name 'u' is taken by a Input"),
        ("[drivers]", '[measures]\nboth = "arm.angle"\n[drivers]', "is a quantity and a measure"),
    ],
)
def test_problems_of_files_name_the_entry(old, new, problem):
    with pytest.raises(mbody.ModelError) as caught:
        mbody.from_toml(FILE.replace(old, new))
    assert problem in str(caught.value)


def test_long_chains_are_no_wall():
    machine = Mechanism("long")
    machine.add(Body("a", mass=1.0, inertia=1.0), Revolute("O", "ground", "a"))
    machine.add(Quantity("q0", "a.angle"))
    machine.add(*(Quantity(f"q{n}", f"q{n - 1} + 1 mrad") for n in range(1, 400)))
    machine.add(Torque("T", "a", value="1 N*m/rad*q399"))
    run = simulate(machine, 0.1)
    np.testing.assert_allclose(run["a"].alpha[0], 0.399, rtol=1e-12)
    assert MOST_EXPANDED > 2 * 400
