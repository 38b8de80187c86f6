"""Tyres by the magic formula, against closed forms of quasi-static braking and SciPy's integrals of
the equations as the books write them.
"""

import functools
import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

import mbody
from mbody import Body, Gravity, Mechanism, Revolute, SimulationSettings, Spring, Torque, Tyre
from mbody.files.model import from_toml, to_toml

G = 9.81
RUBBER = {"friction": 0.9, "steepness": 10.0, "shape": 1.6, "curvature": 0.2, "relaxation": 0.3}
SPRING = {"radius": 0.3, "stiffness": 2e5, "damping": 2e3}
MASS, INERTIA = 300.0, 1.2


def magic(slip, load=1.0, rubber=RUBBER):
    """The force along the road, as the book has it."""
    b, c, e = (rubber[key] for key in ("steepness", "shape", "curvature"))
    steep = b * slip
    return rubber["friction"] * load * np.sin(c * np.arctan(steep - e * (steep - np.arctan(steep))))


def wheel(torque=0.0, slope=0.0, speed=20.0, spin=None, until=1.0, rtol=1e-11, **more):
    """A wheel that carries a mass, on a road along x; gravity leans against it by the slope."""
    machine = Mechanism("wheel", ground={"O": (0.0, 0.0)})
    height = SPRING["radius"] - MASS * G * math.cos(slope) / SPRING["stiffness"]
    machine.add(
        Body("wheel", mass=MASS, inertia=INERTIA, points={"O": (0.0, 0.0)}),
        Gravity("gravity", x=-G * math.sin(slope), y=-G * math.cos(slope)),
        Tyre("tyre", "ground.O", "wheel.O", **(RUBBER | SPRING | more)),
        Torque("brake", "wheel", value=torque),
    )
    start = {"x": 0.0, "y": height, "angle": 0.0, "vx": speed, "vy": 0.0}
    start["omega"] = -speed / height if spin is None else spin
    machine.simulation = SimulationSettings(until=until, rtol=rtol, start={"wheel": start})
    return machine


def by_scipy(machine, torque, slope, times, law=magic):
    """(x, y, θ, vx, vy, ω, κ) of such a wheel."""
    own = machine.simulation.start["wheel"]

    def rates(t, state):
        _, y, _, vx, vy, spin, slip = state
        load = max(2e5 * (0.3 - y) - 2e3 * vy, 0.0) if y < 0.3 else 0.0
        push = law(slip, load)
        pull = torque(t) if callable(torque) else torque
        return [
            *(vx, vy, spin),
            push / MASS - G * math.sin(slope),
            load / MASS - G * math.cos(slope),
            (pull + push * y) / INERTIA,
            -((vx + y * spin) + abs(vx) * slip) / 0.3,
        ]

    start = [own[key] for key in ("x", "y", "angle", "vx", "vy", "omega")] + [0.0]
    options = {"method": "DOP853", "rtol": 1e-11, "atol": 1e-11, "max_step": 0.01}
    return solve_ivp(rates, (0.0, times[-1]), start, t_eval=times, **options).y


@functools.cache
def braked(torque):
    machine = wheel(torque)
    return machine, mbody.simulate(machine)


@pytest.mark.parametrize("torque", [200.0, 750.0, -600.0])
def test_braked_and_driven_it_agrees_with_an_integral_of_its_equations(torque):
    machine, run = braked(torque)
    found = by_scipy(machine, torque, 0.0, run.t)
    assert run.status == "completed" and run.energy.error < 1e-9
    own = run["wheel"]
    for values, theirs in zip(
        (own.x, own.y, own.angle, own.vx, own.vy, own.omega, run.measure("tyre.slip")),
        found,
        strict=True,
    ):
        # both to 1e-11 a step; ω is the fastest, by J small beside m r²
        np.testing.assert_allclose(values, theirs, atol=1e-7 * max(1.0, np.abs(theirs).max()))


@pytest.mark.parametrize("torque", [200.0, 500.0])
def test_gentle_braking_is_quasi_static(torque):
    """In a steady state m a = F(κ), J ω̇ = T + F h with ω = −(1 + κ) v/h, and κ and v change slowly:
    F (1 + J (1 + κ)/(m h²)) = −T/h.
    """
    _, run = braked(torque)
    height = run.measure("tyre.height")[-1]
    load = MASS * G

    def lacks(slip):
        push = magic(slip, load)
        return push * (1.0 + INERTIA * (1.0 + slip) / (MASS * height**2)) + torque / height

    slip = brentq(lacks, -0.15, 0.0, xtol=1e-15)
    # what changes: κ̇ and v̇ over the time of the relaxation, σ/v
    assert run.measure("tyre.slip")[-1] == pytest.approx(slip, rel=2e-3)
    assert run["wheel"].ax[-1] == pytest.approx(magic(slip, load) / MASS, rel=2e-3)


def test_a_locked_wheel_slides_by_the_formula_at_slip_one():
    """Over relaxation lengths κ tends to −1, and the deceleration to g μ sin(C atan(…))."""
    machine = wheel(spin=0.0, until=0.5)
    machine.add(mbody.AngleDriver("lock", "wheel", 0.0))
    run = mbody.simulate(machine)
    assert run.measure("tyre.slip")[-1] == pytest.approx(-1.0, abs=1e-12)
    assert run["wheel"].ax[-1] == pytest.approx(magic(-1.0, G), rel=1e-9)
    assert run.load("tyre").fx[-1] == pytest.approx(magic(-1.0, MASS * G), rel=1e-9)
    # 1 − e^(−s/σ) while it begins, at a slip that follows the way
    k = 10
    assert run.measure("tyre.slip")[k] == pytest.approx(math.expm1(-run["wheel"].x[k] / 0.3), 1e-9)


def test_a_braked_wheel_holds_on_a_slope_without_creep():
    """At rest the tyre is a spring, B C μ F_N/σ for small deflections: κ is that of the weight, and
    nothing moves in 1000 s.
    """
    slope = 0.2
    hold = brentq(
        lambda slip: magic(slip, MASS * G * math.cos(slope)) - MASS * G * math.sin(slope), 0.0, 0.1
    )
    machine = wheel(slope=slope, speed=0.0, spin=0.0, until=1000.0, start=hold, rtol=1e-9)
    machine.add(mbody.AngleDriver("lock", "wheel", 0.0))
    run = mbody.simulate(machine)
    assert np.abs(run["wheel"].x).max() < 1e-8
    assert run.load("tyre").fx[-1] == pytest.approx(MASS * G * math.sin(slope), rel=1e-6)
    # from the free tyre it swings about that, against an integral of its equations
    swings = wheel(slope=slope, speed=0.0, spin=0.0, until=1.0)
    found = mbody.simulate(swings)
    theirs = by_scipy(swings, 0.0, slope, found.t)
    np.testing.assert_allclose(found["wheel"].x, theirs[0], atol=1e-8)


def test_it_leaves_the_road_and_comes_back():
    """Thrown up it has no force while it flies."""
    machine = wheel(speed=5.0)
    machine.simulation = SimulationSettings(
        until=0.7,
        rtol=1e-10,
        start={"wheel": {"x": 0, "y": 0.3, "angle": 0, "vx": 5, "vy": 3, "omega": 0}},
    )
    run = mbody.simulate(machine)
    flies = run["wheel"].y > 0.3 + 1e-6
    assert flies.any() and np.abs(run.load("tyre").fy[flies]).max() == 0.0
    np.testing.assert_allclose(run["wheel"].vx[flies & (run.t < 0.5)], 5.0, rtol=1e-12)
    assert (run.measure("tyre.load") >= 0.0).all()
    theirs = by_scipy(machine, 0.0, 0.0, run.t)
    # SciPy steps over the landing, where the load has a corner, within its own tolerance
    np.testing.assert_allclose(run["wheel"].omega, theirs[5], atol=1e-5)
    np.testing.assert_allclose(run["wheel"].y, theirs[1], atol=1e-7)


def test_the_road_leans_as_its_marker_says():
    """A road that leans, in gravity straight down, is a level one in gravity that leans."""
    slope = 0.3
    level = mbody.simulate(wheel(150.0, slope))
    text = to_toml(wheel(150.0, slope))
    machine = from_toml(text)
    assert machine == wheel(150.0, slope)
    leaning = Mechanism("leaning", ground={"O": (0.0, 0.0)})
    for element in machine:
        if element.name not in ("gravity", "tyre", "O", "ground"):
            leaning.add(element)
    road = mbody.Marker("ground", "O", slope)
    leaning.add(Gravity("gravity", y=-G), Tyre("tyre", road, "wheel.O", **RUBBER, **SPRING))
    own = machine.simulation.start["wheel"]
    c, s = math.cos(slope), math.sin(slope)
    start = {"x": -s * own["y"], "y": c * own["y"], "angle": 0.0, "omega": own["omega"]}
    start |= {"vx": c * own["vx"], "vy": s * own["vx"]}
    leaning.simulation = SimulationSettings(until=1.0, rtol=1e-11, start={"wheel": start})
    run = mbody.simulate(leaning)
    np.testing.assert_allclose(run.measure("tyre.slip"), level.measure("tyre.slip"), atol=1e-9)
    np.testing.assert_allclose(run.measure("tyre.speed"), level.measure("tyre.speed"), atol=1e-8)
    along = c * run.load("tyre").fx + s * run.load("tyre").fy
    np.testing.assert_allclose(along, level.load("tyre").fx, atol=1e-5)


#: Bodies of a vehicle with their masses and inertias.
BODIES = (("car", 1200.0, 1800.0), ("F", 1.0, INERTIA), ("R", 1.0, INERTIA))


def test_a_vehicle_dives_by_its_tyres():
    """Newton and Euler for the whole vehicle, with the tyres' forces at the road."""
    machine = Mechanism("vehicle", ground={"O": (0.0, 0.0)})
    points = {"F": (1.2, -0.25), "R": (-1.4, -0.25)}
    machine.add(Body("car", mass=1200.0, inertia=1800.0, points=points, guess=(0, 0.55, 0)))
    for axle, x, torque in (("F", 1.2, 1100.0), ("R", -1.4, 600.0)):
        machine.add(
            Body(axle, inertia=INERTIA, mass=1.0, points={"O": (0.0, 0.0)}, guess=(x, 0.29, 0)),
            Revolute(f"hub_{axle}", f"car.{axle}", f"{axle}.O"),
            Tyre(f"tyre_{axle}", "ground.O", f"{axle}.O", **RUBBER, **SPRING),
            Torque(f"brake_{axle}", axle, value=torque, by="car"),
        )
    machine.add(Gravity("gravity", y=-G))
    start = {"car": {"x": 0.0, "y": 0.53, "angle": 0.0, "vx": 30.0, "vy": 0.0, "omega": 0.0}}
    start |= {axle: {"omega": -100.0, "angle": 0.0} for axle in "FR"}
    machine.simulation = SimulationSettings(until=2.5, rtol=1e-9, start=start)
    run = mbody.simulate(machine)
    assert run.status == "completed"
    parts = [(run[name], mass, inertia) for name, mass, inertia in BODIES]
    tyres = [run.load(f"tyre_{axle}") for axle in "FR"]
    loads = [run.measure(f"tyre_{axle}.load") for axle in "FR"]
    size = 1202.0 * G
    along = sum(m * body.ax for body, m, _ in parts)
    across = sum(m * (body.ay + G) for body, m, _ in parts)
    np.testing.assert_allclose(sum(one.fx for one in tyres), along, atol=1e-8 * size)
    np.testing.assert_allclose(sum(loads), across, atol=1e-8 * size)
    # forces of the tyres act on the road: moments about its origin have no part of those along it
    moments = sum(
        m * (body.x * (body.ay + G) - body.y * body.ax) + inertia * body.alpha
        for body, m, inertia in parts
    )
    theirs = sum(load * run[axle].x for load, axle in zip(loads, "FR", strict=True))
    np.testing.assert_allclose(theirs, moments, atol=1e-8 * size * np.abs(run["car"].x).max())
    # it dives: more on the front axle than at rest
    assert loads[0][-1] > 1.1 * 1200.0 * G * 1.4 / 2.6 and run["car"].vx[-1] < 30.0 - 2.5


def test_it_is_no_other_spring():
    """Across the road it is a spring: a wheel that neither turns nor goes on rests where a spring
    of that stiffness does.
    """
    run = mbody.simulate(wheel(speed=0.0, spin=0.0, until=0.1))
    machine = Mechanism("spring", ground={"O": (0.0, 0.0)})
    machine.add(
        Body("wheel", mass=MASS, inertia=INERTIA, points={"O": (0.0, 0.0)}),
        Gravity("gravity", y=-G),
        Spring("s", "ground.O", "wheel.O", stiffness=2e5, free_length=0.3),
    )
    machine.simulation = SimulationSettings(
        until=0.1, start={"wheel": {"x": 0, "y": run["wheel"].y[0]}}
    )
    np.testing.assert_allclose(mbody.simulate(machine)["wheel"].y, run["wheel"].y, atol=1e-9)


@pytest.mark.parametrize("part", [0.45, 0.6])
def test_a_wheel_that_sinks_through_its_road_is_doubted(part):
    """h = R − (m g/k)(1 − cos √(k/m) t) of a soft tyre: below the road where that is beyond R."""
    stiffness = MASS * G / (part * 0.3)
    own = {"stiffness": stiffness, "damping": 0.0, "speed": 0.0, "until": 0.5}
    machine = wheel(**own)
    machine.simulation.start["wheel"]["y"] = 0.3
    run = mbody.simulate(machine, 0.5, instants=5001)
    height = run.measure("tyre.height")
    assert height.min() == pytest.approx(0.3 * (1.0 - 2.0 * part), rel=1e-3)
    if part < 0.5:
        assert run.status == "completed"
        return
    (doubt,) = run.doubts
    assert (doubt.kind, doubt.elements) == ("validity", ("tyre",))
    t = math.acos(1.0 - 1.0 / part) / math.sqrt(stiffness / MASS)
    assert doubt.t == pytest.approx(t, abs=2e-4)
    assert "0.06 m below the road" in doubt.message
