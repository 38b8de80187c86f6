"""Loads by formulas of measured quantities, in single motions, lanes and other analyses."""

import re

import numpy as np
import pytest

import mbody
from mbody import (
    Body,
    Damper,
    Gravity,
    Input,
    Mechanism,
    Prismatic,
    Revolute,
    Spring,
    Torque,
    TorsionSpring,
    simulate,
)
from mbody.laws import MeasuredFormula
from mbody.model.body import Guess

pytestmark = pytest.mark.processor


def crank(**parameters):
    """A crank that turns freely about O."""
    machine = Mechanism("crank", parameters=parameters)
    machine.add(Body("crank", mass=1.0, inertia=0.1, cg=(0.2, 0.0), points={"P": (0.5, 0.1)}))
    machine.add(Revolute("O", "ground", "crank"))
    return machine


INERTIA = 0.1 + 1.0 * 0.2**2


def oscillation(k, c, rest, t):
    """Angle from rest at 0 of I θ″ = −k (θ − rest) − c θ′, weakly damped."""
    natural = np.sqrt(k / INERTIA)
    ratio = c / (2.0 * np.sqrt(k * INERTIA))
    damped = natural * np.sqrt(1.0 - ratio**2)
    fading = np.exp(-ratio * natural * t)
    wave = np.cos(damped * t) + ratio * natural / damped * np.sin(damped * t)
    return rest - rest * fading * wave


@pytest.mark.parametrize(
    ("text", "numbers"),
    [
        ("-k*(crank.angle - 30 deg) - c*crank.omega + u", {"k": 50.0, "c": 2.0}),
        ("-k*(crank.angle - 30 deg) - c*O.rate", {"k": "50 N*m/rad", "c": "2 N*m*s/rad"}),
        ("-50*(O.angle - pi/6) - 2*crank.omega + u", {}),
        ("50 N*m/rad*(30 deg - crank.angle) - 2 N*m*s*crank.omega/(1 rad)", {}),
        (
            "-c*crank.omega - k*(atan2(crank.P.y*5 - crank.P.x, crank.P.x*5 + crank.P.y) - 30 deg)",
            {"k": "50 N*m/rad", "c": "2 N*m*s/rad"},
        ),
    ],
)
def test_a_torque_by_a_formula_swings_as_the_closed_form(text, numbers):
    machine = crank(**numbers)
    machine.add(Input("u", "0 N*m"), Torque("motor", "crank", value=text))
    assert isinstance(machine["motor"].value, MeasuredFormula)
    run = simulate(machine, 1.0, rtol=1e-12)
    exact = oscillation(50.0, 2.0, np.pi / 6, run.t)
    # forty steps at 1e-12 each
    np.testing.assert_allclose(run["crank"].angle, exact, atol=1e-10)
    assert run.status == "completed"
    assert run.energy.error < 1e-9


def linkage():
    """A slider-crank with a rod beside it, all of whose quantities move."""
    machine = mbody.makers.slider_crank(0.1, 0.3, masses=(1.0, 0.8, 0.5)).without("motor")
    machine.add(Gravity("gravity", y=-9.81))
    return machine


def test_springs_by_formulas_are_the_elements():
    """The same spring, damper and torsion spring, as elements and as formulas."""
    own, formulas = linkage(), linkage()
    at = own["rod"].at(0.11, 0.04), own.ground.at(0.2, -0.3)
    own.add(Spring("spring", at[1], at[0], stiffness=400.0, free_length=0.2))
    own.add(Damper("damper", at[1], at[0], coefficient=7.0))
    own.add(TorsionSpring("torsion", "rod", by="crank", stiffness=3.0, free_angle=0.1))
    formulas.add(Spring("spring", at[1], at[0], law="400*x - 0*crank.angle", free_length=0.2))
    formulas.add(Damper("damper", at[1], at[0], law="7*spring.rate + 0*x"))
    formulas.add(
        TorsionSpring("torsion", "rod", by="crank", law="3*(rod.angle - crank.angle) - 3*0.1")
    )
    first, second = (simulate(one, 0.5, rtol=1e-11) for one in (own, formulas))
    for name in ("crank", "rod"):
        np.testing.assert_allclose(second[name].angle, first[name].angle, atol=2e-9)
    for load in ("spring", "damper", "torsion"):
        one, two = first.load(load), second.load(load)
        for key in ("fx", "fy", "torque"):
            size = np.abs(getattr(one, key)).max()
            np.testing.assert_allclose(
                getattr(two, key), getattr(one, key), atol=1e-7 * size + 1e-9
            )


QUANTITIES = (
    "crank.x", "crank.vy", "rod.angle", "rod.omega", "rod.P.x", "rod.P.vy", "rod.origin.y",
    "A.angle", "A.rate", "guide.travel", "guide.rate", "ground.P.x", "t",
    "spring.length", "spring.rate",
)  # fmt: skip


@pytest.mark.parametrize("name", QUANTITIES)
def test_formulas_measure_what_results_do(name):
    """A torque whose value is the quantity is the measured history of the result."""
    machine = Mechanism("slider crank", ground={"P": (0.1, 0.2)})
    machine.add(
        Body("crank", mass=1.0, inertia=0.02, cg=(0.05, 0.01), points={"A": (0.1, 0.0)}, guess=0.7),
        Body("rod", mass=0.8, inertia=0.01, cg=(0.15, 0.02),
             points={"A": (0.0, 0.0), "B": (0.3, 0.0), "P": (0.2, 0.1)}, guess=-0.2),
        Body("piston", mass=0.5, inertia=0.01, guess=Guess(0.0, 0.37, 0.0)),
        Revolute("O", "ground", "crank"),
        Revolute("A", "crank.A", "rod.A"),
        Revolute("B", "rod.B", "piston"),
        Prismatic("guide", "ground", "piston"),
        Spring("spring", "ground.P", "rod.P", stiffness=30.0, free_length=0.1),
        Gravity("gravity", y=-9.81),
        Torque("probe", "crank", value=f"0.001*{name}"),
    )  # fmt: skip
    run = simulate(machine, 0.4, rtol=1e-9)
    found = run.load("probe").torque
    wanted = 0.001 * run.measure(name)
    assert np.ptp(wanted) > 0.0 or name == "ground.P.x"
    np.testing.assert_allclose(found, wanted, atol=1e-12 * np.abs(wanted).max())


def test_every_function_of_formulas_has_the_values_of_numpy():
    """Compiled operations, in one motion and on lanes, against NumPy on the measured angle."""
    texts = {
        "sin(a)*cos(a) - tan(a/3)": lambda a: np.sin(a) * np.cos(a) - np.tan(a / 3),
        "asin(a/9) + acos(a/9) + atan(a)": lambda a: (
            np.arcsin(a / 9) + np.arccos(a / 9) + np.arctan(a)
        ),
        "sqrt(abs(a)) + exp(a/5)/log(a + 9)": lambda a: (
            np.sqrt(np.abs(a)) + np.exp(a / 5) / np.log(a + 9)
        ),
        "min(a, 0.2) + max(a, 0.1) - hypot(a, 2)": lambda a: (
            np.minimum(a, 0.2) + np.maximum(a, 0.1) - np.hypot(a, 2)
        ),
        "atan2(a, 2) + a^3 - 2^a + (a + 9)^0.5 - 1/(a + 9)": lambda a: (
            np.arctan2(a, 2) + a**3 - 2**a + np.sqrt(a + 9) - 1 / (a + 9)
        ),
    }
    for text, function in texts.items():
        machine = crank(gain=1.0)
        value = re.sub(r"\ba\b", "crank.angle", f"0.01*gain*({text})")
        machine.add(Torque("motor", "crank", value=value))
        run = simulate(machine, 1.0, instants=5)
        np.testing.assert_allclose(
            run.load("motor").torque, 0.01 * function(run["crank"].angle), rtol=1e-13, atol=1e-16
        )


def test_stiff_formulas_take_implicit_steps():
    machine = crank()
    machine.add(Torque("motor", "crank", value="-1e5*(crank.omega - 3) - 10*crank.angle"))
    run = simulate(machine, 1.0, method="radau5", rtol=1e-8)
    # after the first instant ω follows from the balance: 1e5 (ω − 3) = −10 θ − I ω′
    angle, rate = run["crank"].angle[-1], run["crank"].omega[-1]
    assert rate == pytest.approx(3.0 - 1e-4 * angle, abs=1e-7)


def test_modes_and_linear_equations_know_formulas():
    machine = crank()
    machine.add(Torque("motor", "crank", value="-50*(crank.angle - 0.4) - 2*crank.omega"))
    rest = mbody.equilibrium(machine)[0]
    assert rest.solution["crank"].angle[-1] == pytest.approx(0.4, abs=1e-9)
    found = mbody.modes(machine, at=rest)
    natural = np.sqrt(50.0 / INERTIA)
    assert found[0].frequencies[0] == pytest.approx(
        natural * np.sqrt(1 - (2.0 / (2 * np.sqrt(50.0 * INERTIA))) ** 2), rel=1e-6
    )
