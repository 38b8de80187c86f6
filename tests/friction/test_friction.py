"""Friction in joints against closed forms and against dense equations of every contact."""

import math

import numpy as np
import pytest

import mbody
from mbody import Force, Prismatic, Revolute, Torque
from mbody.laws import ConstantSpeed
from mbody.solution.contact_forces import pair_rates
from tests.support.frictional import (
    CRANK,
    FORCE,
    ROD,
    cam_drive,
    dense_at,
    difference,
    drawer,
    gear_pair,
    slider_crank,
    with_changes,
    with_friction,
)

MODEL = """
units = "SI"
[ground]
points = { O = [0, 0] }
[bodies.crank]
points = { O = [0, 0], A = ["50 mm", 0] }
guess = 10
[bodies.rod]
points = { A = [0, 0], B = [0.2, 0] }
[bodies.slider]
points = { B = [0, 0] }
[joints]
O = { revolute = ["ground.O", "crank.O"], friction = 0.1, pin_radius = "10 mm" }
A = { revolute = ["crank.A", "rod.A"], friction = 0.1, pin_radius = "10 mm" }
B = { revolute = ["rod.B", "slider.B"], friction = 0.1, pin_radius = "10 mm" }
guide = { prismatic = ["ground", "slider.B"], friction = 0.1 }
[drivers]
motor = { angle = "crank", law = { constant_speed = { value = 0, speed = "10 rad/s" } } }
[loads]
load = { force = 1000, at = "slider.B", angle = 180 }
"""

#: (angle of the crank in degrees, driving torque with and without friction): of the references.
BY_HAND = (
    (30.0, -27.693926263616955, -30.455447255899806),
    (120.0, -34.943752389438444, -37.75711065706264),
    (250.0, 46.01093642493345, 42.85153955720974),
)


def torque(machine, degrees, speed=10.0):
    run = mbody.kinetostatics(machine, drive={"motor": (math.radians(degrees), speed, 0.0)})
    return float(run.effort("motor")[0])


def by_circles(theta, mu, r, speed=1.0):
    """Driving torque of the massless slider-crank: the rod's force is tangent to the friction
    circles at A and B.
    """
    rho = mu * r / math.sqrt(1 + mu * mu)
    ax, ay = CRANK * math.cos(theta), CRANK * math.sin(theta)
    beta = math.asin(-ay / ROD)
    w_rod = -CRANK * math.cos(theta) * speed / (ROD * math.cos(beta))
    vx = -CRANK * math.sin(theta) * speed - ROD * math.sin(beta) * w_rod
    at_a, at_b, at_o = np.sign(w_rod - speed), np.sign(w_rod), np.sign(speed)
    psi = beta - math.asin((rho * at_a + rho * at_b) / ROD)
    Q = FORCE / (math.cos(psi) - mu * abs(math.sin(psi)) * np.sign(vx))
    qx, qy = Q * math.cos(psi), Q * math.sin(psi)
    return ax * qy - ay * qx - rho * Q * at_a + rho * Q * at_o


@pytest.mark.parametrize(("degrees", "value", "without"), BY_HAND)
def test_the_slider_crank_of_the_references(degrees, value, without):
    assert abs(torque(slider_crank(), degrees) - value) < 1e-12 * FORCE * CRANK
    assert abs(torque(slider_crank(mu=0.0), degrees) - without) < 1e-12 * FORCE * CRANK
    assert abs(torque(mbody.from_toml(MODEL), degrees) - value) < 1e-12 * FORCE * CRANK


def test_a_turn_by_friction_circles():
    run = mbody.kinetostatics(slider_crank(mu=0.3, radius=0.008), turn="motor", instants=73)
    for k in range(len(run)):
        wanted = by_circles(float(run["crank"].angle[k]), 0.3, 0.008)
        assert abs(run.effort("motor")[k] - wanted) < 1e-12 * FORCE * CRANK


def test_what_runs_fast_elsewhere_does_not_stop_friction():
    """A crank that creeps in its rough bearing, beside a wheel that turns 1e12 times as fast."""

    def efforts(*names):
        machine = mbody.Mechanism("two", ground={"crank": (0.0, 0.0), "wheel": (1.0, 0.0)})
        machine.add(mbody.Gravity("gravity", y=-9.81))
        speeds = {"crank": 1e-9, "wheel": 1e3}
        for name in names:
            at = {"friction": 0.2, "pin_radius": 0.01} if name == "crank" else {}
            machine.add(
                mbody.Body(name, mass=2.0, inertia=0.1, points={"A": (0.0, 0.0)}),
                Revolute(f"{name} pin", f"ground.{name}", f"{name}.A", **at),
                mbody.AngleDriver(f"{name} motor", name, ConstantSpeed(0.0, speeds[name])),
            )
        return mbody.kinetostatics(machine, t=[0.0]).effort("crank motor")[0]

    assert efforts("crank") == pytest.approx(2.0 * 9.81 * 0.2 / math.sqrt(1.04) * 0.01, rel=1e-12)
    assert efforts("crank", "wheel") == pytest.approx(efforts("crank"), rel=1e-12)


@pytest.mark.parametrize("mu", [0.0, 0.1, 0.3, 0.49])
def test_a_drawer(mu):
    run = mbody.kinetostatics(drawer(mu))
    assert run.effort("pull")[0] == pytest.approx(10.0 / (1.0 - 2.0 * mu), rel=1e-12)
    assert run.friction.certified.all() and not run.friction.jams
    assert run.status == "completed"


def test_a_drawer_of_the_references_from_a_file():
    text = """
    units = "SI"
    [ground]
    points = { O = [0, 0] }
    [bodies.drawer]
    mass = 1
    points = { C = [0, 0], P = [0, 0.2] }
    [joints]
    guide = { prismatic = ["ground.O", "drawer.C"], friction = 0.3, length = "20 cm", height = 0 }
    [drivers.pull]
    coordinate = ["ground.O", "drawer.P"]
    law = { constant_speed = { value = 0, speed = 1 } }
    [loads]
    F = { force = 10, at = "drawer.C", angle = 180 }
    """
    run = mbody.kinetostatics(mbody.from_toml(text))
    assert run.effort("pull")[0] == pytest.approx(25.0, rel=1e-13)
    again = mbody.kinetostatics(mbody.from_toml(mbody.to_toml(run.mechanism)))
    assert again.effort("pull")[0] == run.effort("pull")[0]


@pytest.mark.parametrize("speed", [1.0, -1.0])
@pytest.mark.parametrize("height", [None, 0.05, 0.1])
def test_a_guide_with_two_rails(height, speed):
    machine = drawer(0.2, height=height, speed=speed)
    machine.add(
        Force("one", "drawer.P", 7.0, angle=np.radians(-70.0)),
        Force("two", "drawer.C", 3.0, angle=np.radians(130.0)),
    )
    assert difference(mbody.kinetostatics(machine), 0) < 1e-13


# -- against dense equations over a turn -------------------------------------------------------


def pump():
    """The six-bar pump of the gallery with friction in all joints."""

    def change(element):
        if isinstance(element, Revolute):
            return {"friction": 0.08, "pin_radius": 1.5}
        return {"friction": 0.1, "length": 8.0} if isinstance(element, Prismatic) else {}

    return with_changes(mbody.gallery.load("mud_pump_sixbar"), change)


def toggle_press():
    """A crank straightens two links that push a ram down against a force that rises."""
    ground = {"O": (0.0, 0.0), "C": (0.4, 0.5), "G": (0.4, 0.0)}
    machine = mbody.Mechanism("toggle press", units="SI", ground=ground)
    bar = mbody.makers.bar
    machine.add(
        bar("crank", 0.033, mass=2.0, ends=("O", "A"), guess="60 deg"),
        bar("rod", 0.43, mass=3.0, ends=("A", "B"), guess="35 deg"),
        bar("upper", 0.25, mass=4.0, ends=("C", "B"), guess="-110 deg"),
        bar("lower", 0.25, mass=4.0, ends=("B", "D"), guess="-65 deg"),
        mbody.Body("ram", mass=20.0, points={"D": (0.0, 0.0)}, guess=(0.4, 0.03, 0.0)),
        Revolute("O", "ground.O", "crank.O"),
        Revolute("A", "crank.A", "rod.A"),
        Revolute("B", "rod.B", "upper.B"),
        Revolute("C", "ground.C", "upper.C"),
        Revolute("E", "upper.B", "lower.B"),
        Revolute("D", "lower.D", "ram.D"),
        Prismatic(
            "guide", mbody.Marker("ground", "G", np.pi / 2.0), mbody.Marker("ram", "D", np.pi / 2.0)
        ),
        mbody.AngleDriver("motor", "crank", mbody.laws.ConstantSpeed(1.0, 8.0)),
        Force("load", "ram.D", 20e3, angle=np.pi / 2.0),
    )
    return with_friction(machine, 0.12, 0.02, 0.2)


MACHINES = {
    "slider-crank": lambda: slider_crank(masses=(1.0, 2.0, 3.0), length=0.06),
    "slider-crank by Stribeck": lambda: slider_crank(
        masses=(1.0, 2.0, 3.0), length=0.06, static=0.2, stribeck=0.3, viscous=2.0
    ),
    "six-bar pump": pump,
    "toggle press": toggle_press,
}


@pytest.mark.parametrize("name", MACHINES)
def test_a_turn_against_dense_equations(name):
    machine = MACHINES[name]()
    run = mbody.kinetostatics(machine, turn="motor" if "motor" in machine else True, instants=41)
    assert run.friction.certified.all() and run.status == "completed", run.status
    assert max(difference(run, k) for k in range(len(run))) < 1e-12


@pytest.mark.parametrize("name", MACHINES)
def test_power_balances(name):
    machine = MACHINES[name]()
    run = mbody.kinetostatics(machine, turn="motor" if "motor" in machine else True, instants=91)
    assert run.checks.virtual_work < 1e-13
    for k in (0, 37, 80):
        losses = dense_at(run, k).solve().losses
        top = max(losses.values())
        for joint, loss in losses.items():
            assert abs(run.losses[joint][k] - loss) < 1e-11 * top
            assert loss >= 0.0


@pytest.mark.parametrize("name", MACHINES)
def test_causes_sum_to_the_whole(name):
    machine = MACHINES[name]()
    driver = machine.drivers[0].name
    run = mbody.kinetostatics(machine, turn=driver, instants=19)
    parts = run.breakdown(driver)
    assert list(parts)[-1] == "friction"
    top = np.abs(run.effort(driver)).max()
    assert np.abs(sum(parts.values()) - run.effort(driver)).max() < 1e-11 * top
    for joint in machine.joints:
        whole = run.reaction(joint.name)
        for key in ("fx", "fy", "torque"):
            total = sum(getattr(part, key) for part in run.breakdown(joint.name).values())
            size = whole.magnitude.max() * (run.system.length if key == "torque" else 1.0)
            assert np.abs(total - getattr(whole, key)).max() < 1e-10 * size


# -- teeth, cams, wheels -----------------------------------------------------------------------


@pytest.mark.parametrize("load", [5.0, -5.0])
@pytest.mark.parametrize("internal", [False, True])
def test_what_the_teeth_give(internal, load):
    machine = gear_pair(internal, load, efficiency=0.9)
    smooth = with_changes(machine, lambda one: {"friction": None} if one.name == "B" else {})
    smooth = with_changes(smooth, lambda one: {"value": 0.0} if one.name == "push" else {})
    run = mbody.kinetostatics(smooth)
    given = float(run.effort("motor")[0] * 3.0)
    taken = float(-load * run["b"].omega[0])
    ratio = taken / given if given > 0.0 else given / taken
    assert ratio == pytest.approx(0.9, rel=1e-13)


@pytest.mark.parametrize("swapped", [False, True])
@pytest.mark.parametrize("direction", [0.0, 2.0, math.pi, -2.5])
@pytest.mark.parametrize("internal", [False, True])
def test_what_teeth_give_wherever_the_other_wheel_is(internal, direction, swapped):
    """Which wheel drives decides how much is lost; with wheels of 1 and 5 by several per cent."""
    apart = 4.0 if internal else 6.0
    c, s = math.cos(direction), math.sin(direction)
    machine = mbody.Mechanism("pair", ground={"A": (0, 0), "B": (apart * c, apart * s)})
    wheels = (("a", 1.0), ("b", 5.0))
    (i, ri), (j, rj) = wheels[::-1] if swapped else wheels
    machine.add(
        mbody.Body("a"),
        mbody.Body("b"),
        mbody.Revolute("A", "ground.A", "a"),
        mbody.Revolute("B", "ground.B", "b"),
        mbody.Gear("mesh", i, j, radius_i=ri, radius_j=rj, internal=internal, efficiency=0.9),
        mbody.AngleDriver("motor", "a", mbody.laws.ConstantSpeed(0.0, 2.0)),
        mbody.Torque("load", "b", value=-100.0),
    )
    run = mbody.kinetostatics(machine)
    powers = float(run.effort("motor")[0]) * 2.0, 100.0 * float(run["b"].omega[0])
    assert abs(min(powers, key=abs) / max(powers, key=abs)) == pytest.approx(0.9, rel=1e-12)
    # the oracle closes on that half turn of the wheels on which the phase is meant
    assert mbody.crosscheck(machine, "oracle", ours=run).agrees


def test_teeth_press_their_bearings_apart():
    for internal, way in ((False, 1.0), (True, -1.0)):
        plain, pressed = (
            mbody.kinetostatics(gear_pair(internal, **teeth))
            for teeth in ({}, {"pressure_angle": "20 deg"})
        )
        force = abs(float(plain.reaction("mesh").fy[0]))
        mesh = pressed.reaction("mesh")
        # off by the friction of the bearing B, which the radial force changes
        own = abs(float(mesh.fy[0]))
        assert own == pytest.approx(force, rel=0.05)
        assert float(mesh.fx[0]) == pytest.approx(way * own * math.tan(math.radians(20.0)))


def test_a_planetary_train():
    """Sun drives, the ring stands, the carrier is driven: η = (1 − i₀ η₀)/(1 − i₀), i₀ = −3, η₀ the
    product of both meshes (Müller, Umlaufgetriebe).
    """
    machine = mbody.Mechanism("train", units="SI", ground={"O": (0.0, 0.0)})
    machine.add(
        mbody.Body("sun"),
        mbody.Body("planet"),
        mbody.Body("carrier", points={"O": (0.0, 0.0), "P": (2.0, 0.0)}),
        Revolute("S", "ground.O", "sun"),
        Revolute("C", "ground.O", "carrier.O"),
        Revolute("P", "carrier.P", "planet"),
        mbody.Gear("sp", "sun", "planet", radius_i=1.0, radius_j=1.0, efficiency=0.97),
        mbody.Gear(
            "pr", "ground", "planet", radius_i=3.0, radius_j=1.0, internal=True, efficiency=0.95
        ),
        mbody.AngleDriver("motor", "sun", mbody.laws.ConstantSpeed(0.0, 8.0)),
        Torque("load", "carrier", value=-40.0),
    )
    run = mbody.kinetostatics(machine)
    assert run["carrier"].omega[0] == pytest.approx(2.0)
    eta = 80.0 / float(run.effort("motor")[0] * 8.0)
    assert eta == pytest.approx((1.0 + 3.0 * 0.97 * 0.95) / 4.0, rel=1e-12)


@pytest.mark.parametrize("clockwise", [False, True])
@pytest.mark.parametrize("swinging", [False, True])
@pytest.mark.parametrize("kind", ["knife", "roller", "flat"])
def test_cams(kind, swinging, clockwise):
    how = {"friction": 0.2, "static": 0.3, "stribeck": 0.5}
    if kind == "roller":
        how["pin_radius"] = 0.004
    machine = cam_drive(kind, swinging, clockwise, **how)
    run = mbody.kinetostatics(machine, turn="motor", instants=9)
    assert max(difference(run, k) for k in range(len(run))) < 1e-12
    assert run.checks.virtual_work < 1e-12 and (run.losses["cam"] > 0.0).all()


def test_rolling_takes_a_torque():
    """A wheel that carries W: the force that rolls it is W f/r."""
    machine = mbody.Mechanism("wheel", units="SI", ground={"O": (0.0, 0.0)})
    machine.add(
        mbody.Body("wheel", guess=(0.0, 0.3, 0.0)),
        mbody.Rolling("road", "ground", "wheel", radius=0.3, resistance=0.002),
        mbody.CoordinateDriver("pull", "ground.O", "wheel", mbody.laws.ConstantSpeed(0.0, 2.0)),
        Force("weight", "wheel", 900.0, angle=-np.pi / 2.0),
    )
    run = mbody.kinetostatics(machine)
    assert run.effort("pull")[0] == pytest.approx(900.0 * 0.002 / 0.3, rel=1e-13)
    assert run.losses["road"][0] == pytest.approx(2.0 * 900.0 * 0.002 / 0.3, rel=1e-13)
    assert difference(run, 0) < 1e-13


@pytest.mark.parametrize("clockwise", [False, True])
@pytest.mark.parametrize("swinging", [False, True])
@pytest.mark.parametrize("kind", ["knife", "roller", "flat"])
def test_rates_of_slipping_are_differentiated(kind, swinging, clockwise):
    """γ of what slips on cams, guides and pins, against differences of its rate in time."""
    how = {"friction": 0.2, "pin_radius": 0.004} if kind == "roller" else {"friction": 0.2}
    step = 1e-5
    middle = np.array([0.11, 0.23, 0.37, 0.52])
    times = np.sort(np.concatenate([middle - step, middle, middle + step]))
    rates = pair_rates(mbody.kinetostatics(cam_drive(kind, swinging, clockwise, **how), t=times))
    found = (rates[2::3, :, 0] - rates[0::3, :, 0]) / (2.0 * step)
    # what differences of the second order leave: step² of the third derivative, 20 rad/s cubed
    np.testing.assert_allclose(rates[1::3, :, 1], found, atol=1e-7 * np.abs(found).max())
