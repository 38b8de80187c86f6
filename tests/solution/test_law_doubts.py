"""Doubts about laws: validity, derivatives that are none, loads that do not balance."""

import math

import numpy as np
import pytest

import mbody
from mbody import AngleDriver, Body, CustomLoad, Mechanism, Revolute
from mbody.laws import Function
from mbody.model.loads import PistonPressure


def arm(*more):
    machine = Mechanism("arm")
    machine.add(Body("arm", mass=1.0, inertia=0.1, cg=(0.2, 0.0)), Revolute("O", "ground", "arm"))
    machine.add(*more)
    return machine


def swing(rate=2.0, second=-4.0):
    """θ = sin 2t, with derivatives that may be wrong."""
    return Function(
        lambda t: math.sin(2 * t),
        lambda t: rate * math.cos(2 * t),
        lambda t: second * math.sin(2 * t),
    )


def driven(*numbers):
    return arm(AngleDriver("motor", "arm", swing(*numbers)))


ANALYSES = {
    "simulate": lambda model: mbody.simulate(model, 1.0, instants=11),
    "one instant": lambda model: mbody.kinetostatics(model, t=[0.3]),
    "instants": lambda model: mbody.kinetostatics(model, t=[0.1, 0.3, 0.5, 0.7]),
}


@pytest.mark.parametrize(
    ("analysis", "numbers", "what"),
    [
        ("simulate", (2.03,), "rate"),
        ("one instant", (2.03,), "rate"),
        *((one, (2.0, 1.0), "second derivative") for one in ANALYSES),
    ],
)
def test_a_given_derivative_that_is_none_is_doubted(analysis, numbers, what):
    run = ANALYSES[analysis](driven(*numbers))
    doubt = run.doubts[0]
    assert (doubt.kind, doubt.elements) == ("derivative", ("motor",))
    assert run.status.startswith("doubtful: 'motor': the " + what)
    n = 1 if what == "rate" else 2
    given, wanted = (
        size * (math.cos, math.sin)[n - 1](2 * doubt.t)
        for size in (numbers[n - 1], (2.0, -4.0)[n - 1])
    )
    unit = "rad/s" if n == 1 else "rad/s²"
    assert f"{given:.6g} {unit} at t = {doubt.t:.6g} s" in doubt.message
    assert f"differences of the function {wanted:.4g}"[:-1] in doubt.message


@pytest.mark.parametrize("analysis", ANALYSES)
def test_right_ones_are_not(analysis):
    assert ANALYSES[analysis](driven()).doubts == ()


@pytest.mark.parametrize("instants", [4, 361])
def test_a_motion_by_a_wrong_rate_ends_with_the_sentence(instants):
    with pytest.raises(mbody.SolveError, match=r"'motor': the rate .* differences") as caught:
        mbody.kinetostatics(driven(1.0), t=np.linspace(0.1, 0.7, instants))
    assert caught.value.element == "motor"


def test_of_a_cam_the_place_is_an_angle():
    """A lift of the angle, whose given rate is that of degrees."""
    lift = Function(
        lambda x: 0.01 * (1 - math.cos(x)), lambda x: 0.01 * math.sin(x) * math.pi / 180
    )
    machine = Mechanism("cam")
    machine.add(
        Body("cam", mass=1.0, inertia=0.1),
        Body("rod", mass=1.0, inertia=0.1, guess=(0.0, 0.06, 0.0)),
        Revolute("O", "ground", "cam"),
        mbody.Prismatic(
            "guide", *(mbody.Marker(b, (0, 0), angle="90 deg") for b in ("ground", "rod"))
        ),
        mbody.CamFollower("pair", "cam", "rod", lift, base_radius=0.05),
        AngleDriver("motor", "cam", "60 deg + 1 rad/s*t"),
    )
    doubts = mbody.kinetostatics(machine, t=[0.0]).doubts
    assert [(one.kind, one.elements, one.t) for one in doubts] == [("derivative", ("pair",), None)]
    assert "m/rad at x = " in doubts[0].message


class Push(CustomLoad):
    """A push on j alone."""

    def physics(self, i, j, p, t):
        return 0.0, 0.0, 0.0, 1.0, 0.0, 0.0


class Wind(Push):
    external = True


class Twisted(CustomLoad):
    """A force without its moment."""

    def physics(self, i, j, p, t):
        return -1.0, -2.0, 0.0, 1.0, 2.0, 0.0


class Pull(CustomLoad):
    """Between the mass centres, of any size and place."""

    def physics(self, i, j, p, t):
        fx, fy = 1e-9 * (i[0] - j[0]), 1e-9 * (i[1] - j[1])
        return -fx, -fy, 0.0, fx, fy, 0.0


def pair(load):
    machine = Mechanism("free pair")
    machine.add(
        Body("a", mass=1.0, inertia=0.1, points={"A": (1, 0)}, guess=(1e3, 2e3, 0.0)),
        Body("b", mass=1.0, inertia=0.1, points={"A": (0, 0)}, cg=(0.5, 0), guess="40 deg"),
        Revolute("A", "a.A", "b.A"),
        load,
    )
    return mbody.simulate(machine, 0.1)


@pytest.mark.parametrize("kind", [Push, Twisted])
def test_a_load_without_its_reaction_is_doubted(kind):
    """By the other route: what acts from inside changes no momentum."""
    run = pair(kind("load", "a.A", "b.A"))
    (doubt,) = run.doubts
    assert (doubt.kind, doubt.elements, doubt.t) == ("residual", ("load",), 0.0)
    momentum = run.momentum()
    assert abs(momentum.x[-1] - momentum.x[0]) + abs(np.ptp(momentum.angular)) > 1e-3


@pytest.mark.parametrize("load", [Wind("load", "a.A", "b.A"), Pull("load", "a.A", "b.A")])
def test_one_with_it_or_from_outside_is_not(load):
    assert pair(load).doubts == ()


@pytest.mark.parametrize("kind", [Push, Wind])
def test_what_acts_on_the_ground_may_be_left_out(kind):
    assert mbody.simulate(arm(kind("load", "ground", "arm")), 0.1).doubts == ()


RAM = """
[ground]
points = { O = [0, 0] }
[bodies]
load = { mass = MASS, inertia = 1, points = { C = [0, 0] }, guess = [0, START, 0] }
[joints]
g = { prismatic = [{ body = "ground", angle = 90 }, { body = "load", angle = 90 }] }
[loads.ram]
hydraulic_cylinder = ["ground.O", "load.C"]
bore = "40 mm"
rod = "20 mm"
closed = "0.6 m"
stroke = "0.4 m"
valve = "VALVE"
flow = "20 l/min"
drop = "10 bar"
supply = "150 bar"
bulk_modulus = "1.4 GPa"
dead_volume = "40 cm^3"
start_a = "2 bar"
start_b = "2 bar"
[gravity]
y = -9.81
"""


def ram(mass, start, valve="0", until=0.3):
    text = RAM.replace("MASS", str(mass)).replace("START", str(start)).replace("VALVE", valve)
    return mbody.simulate(mbody.from_toml(text), until, method="radau5")


def test_oil_under_vacuum_is_doubted():
    run = ram(600.0, -0.8)
    (doubt,) = run.doubts
    assert (doubt.kind, doubt.elements) == ("validity", ("ram",))
    pressure = run.measure("ram.pressure_a")
    assert doubt.t == run.t[pressure < -101325.0].min()
    assert f"{pressure.min():.4g} N/m²" in doubt.message
    assert ram(1.0, -0.8).doubts == ()


def test_a_cylinder_out_of_its_stroke_is_doubted():
    run = ram(1.0, 0.8, "1", until=0.25)
    (doubt,) = run.doubts
    assert (doubt.kind, doubt.elements) == ("validity", ("ram",))
    length = run.measure("ram.length")
    assert run.t[length < 1.0].max() < doubt.t <= run.t[length > 1.0].min()


def test_a_belt_that_would_push_is_doubted():
    sizes = {"radius_i": 0.1, "radius_j": 0.2, "distance": 0.8, "friction": 0.3}
    machine = Mechanism("drive", ground={"A": (0, 0), "B": (0.8, 0)})
    machine.add(
        Body("a", mass=1.0, inertia=0.1),
        Body("b", mass=1.0, inertia=0.1),
        Revolute("A", "ground.A", "a"),
        Revolute("B", "ground.B", "b"),
        mbody.Belt("belt", "a", "b", tension="10 N - 20 N/s*t", **sizes),
        AngleDriver("motor", "a", "1 rad/s*t"),
    )
    (doubt,) = mbody.simulate(machine, 1.0, instants=101).doubts
    assert (doubt.kind, doubt.elements) == ("validity", ("belt",))
    assert doubt.t == pytest.approx(0.51)
    assert "-10 N" in doubt.message


@pytest.mark.parametrize(("far", "doubted"), [(0.3, True), (0.2, False)])
def test_a_piston_beyond_its_dead_centres_is_doubted(far, doubted):
    machine = mbody.makers.slider_crank(0.1, 0.3, speed=10.0)
    machine.add(
        mbody.ReciprocatingCylinder(
            "pump", "ground", "slider.B", area=0.01, near=0.4, far=far,
            clearance=0.02, suction=0.0, delivery=1e6, bulk_modulus=2e9,
        ),
    )  # fmt: skip
    run = mbody.kinetostatics(machine, turn=True)
    assert [one.kind for one in run.doubts] == ["validity"] * doubted


@pytest.mark.parametrize(("least", "doubted"), [(-2e5, True), (-5e4, False)])
def test_a_gauge_pressure_below_nothing_is_doubted(least, doubted):
    machine = mbody.makers.slider_crank(0.1, 0.3, speed=10.0)
    machine.add(
        PistonPressure(
            "gas", "ground", "slider.B", cycle="crank", head_area=0.01,
            head=mbody.laws.Harmonic(0.0, least, 1.0),
        )
    )  # fmt: skip
    run = mbody.kinetostatics(machine, turn=True)
    assert [one.kind for one in run.doubts] == ["validity"] * doubted


@pytest.mark.parametrize("rate", [300.0, 200.0])
def test_of_a_spring_the_place_is_a_length(rate):
    law = Function(lambda x: 100.0 * x**3, lambda x: rate * x**2)
    machine = Mechanism("mass")
    machine.add(
        Body("b", mass=1.0, inertia=0.1, guess=(2.0, 0.0, 0.0)),
        mbody.Prismatic("guide", "ground", "b"),
        mbody.Spring("spring", "ground", "b", law=law, free_length=1.0),
    )
    doubts = mbody.simulate(machine, 1.0).doubts
    assert [(one.kind, one.elements) for one in doubts] == [("derivative", ("spring",))] * (
        rate == 200.0
    )
    assert all("N/m at x = " in one.message for one in doubts)
