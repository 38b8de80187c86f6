"""Joints that separate and freewheels, against closed forms and independent computations."""

import math

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.optimize import brentq

import mbody
from mbody.analysis.contact.unilateral import Unilateral
from mbody.laws import Harmonic

G = 9.81


def cam(speed, **joint):
    """A flat-faced follower on an eccentric: y = r + a − a cos ωt, with a spring from above."""
    a, r, mass, k, preload = 0.01, 0.04, 0.5, 2000.0, 20.0
    lift = Harmonic(mean=a, amplitude=a, frequency=1.0, phase=-0.5 * math.pi)
    centre = mbody.Marker("cam", "O", 0.5 * math.pi)
    machine = mbody.Mechanism("cam", ground={"O": (0.0, 0.0), "S": (0.0, 1.0)})
    machine.add(
        mbody.Body("cam", mass=1.0, inertia=0.01, points={"O": (0.0, 0.0)}),
        mbody.Body(
            "tappet", mass=mass, inertia=0.01, points={"T": (0.0, 0.0)}, guess=(0.0, r, 0.0)
        ),
        mbody.Revolute("O", "ground.O", "cam.O"),
        mbody.Prismatic(
            "guide",
            mbody.Marker("ground", (0.0, 0.0), 0.5 * math.pi),
            mbody.Marker("tappet", "T", 0.5 * math.pi),
        ),
        mbody.CamFollower("face", centre, "tappet.T", lift, base_radius=r, flat=True, **joint),
        mbody.AngleDriver("motor", "cam", f"{speed} rad/s*t"),
        mbody.Spring("spring", "ground.S", "tappet.T", k, free_length=1.0 - r + preload / k),
        mbody.Gravity("gravity", y=-G),
    )
    # (m g + F₀ + k y′) of lift y′ = a (1 − cos ωt), against m a ω² cos ωt
    return machine, a, mass, k, preload


def test_a_follower_jumps_off_its_cam():
    """N = m g + F₀ + k a (1 − cos φ) + m a ω² cos φ: zero first at the top, where m a ω² = m g + F₀
    + 2 k a; above that speed earlier. Then it flies on its spring and lands.
    """
    _, a, mass, k, preload = cam(1.0)
    least = math.sqrt((mass * G + preload + 2.0 * k * a) / (mass * a))
    below, *_ = cam(0.999 * least, one_sided=True)
    turn = 2.0 * math.pi / least
    run = mbody.simulate(below, 1.5 * turn, rtol=1e-11)
    assert not run.events and set(run.mode("face")) == {"stick"}
    w = 1.2 * least
    above, *_ = cam(w, one_sided=True)
    run = mbody.simulate(above, 1.2 * 2.0 * math.pi / w, rtol=1e-12)
    off, lands = run.events[:2]
    phase = math.acos(-(mass * G + preload + k * a) / (mass * a * w * w - k * a))
    assert (off.name, off.contact) == ("open", "face")
    assert off.t == pytest.approx(phase / w, abs=1e-12)
    # y = y₀ + (c₁ cos Ωτ + c₂ sin Ωτ) about the equilibrium of spring and weight
    t1, own = phase / w, math.sqrt(k / mass)
    level = -(mass * G + preload) / k
    y1, v1 = a * (1.0 - math.cos(phase)), a * w * math.sin(phase)

    def gap(t):
        free = level + (y1 - level) * math.cos(own * (t - t1)) + v1 / own * math.sin(own * (t - t1))
        return free - a * (1.0 - math.cos(w * t))

    landing = brentq(gap, t1 + 0.1 * turn, t1 + turn, xtol=1e-15)
    assert lands.name == "impact" and lands.t == pytest.approx(landing, abs=1e-11)
    on = run.t < off.t
    c = np.cos(w * run.t[on])
    force = mass * G + preload + k * a * (1.0 - c) + mass * a * w * w * c
    assert run.contact("face")[on] == pytest.approx(force, rel=1e-9)
    assert run.energy.error < 1e-9
    # other analyses keep it, and say where it would pull
    notes = mbody.kinetostatics(above, turn=True).notes
    assert any("contact 'face' would have to pull 'tappet'" in note for note in notes)


def gears(**more):
    machine = mbody.Mechanism("gears", ground={"A": (0.0, 0.0), "B": (0.3, 0.0)})
    machine.add(
        mbody.Body("one", mass=1.0, inertia=0.02, points={"C": (0.0, 0.0)}),
        mbody.Body("two", mass=1.0, inertia=0.05, points={"C": (0.0, 0.0)}, guess=(0.3, 0.0, 0.0)),
        mbody.Revolute("A", "ground.A", "one.C"),
        mbody.Revolute("B", "ground.B", "two.C"),
        mbody.Gear("mesh", "one.C", "two.C", radius_i=0.1, radius_j=0.2, **more),
    )
    return machine


@pytest.mark.parametrize("e", [0.6, 1.0])
def test_teeth_hammer_in_their_play(e):
    """No load: s = r₁ω₁ + r₂ω₂ is −e times as much after each impact, and the play b is crossed in
    b/|s|, half of it at first.
    """
    b, w = 2e-4, 3.0
    machine = gears(backlash=b, restitution=e)
    machine.simulation = mbody.SimulationSettings(
        0.008, {"one": {"angle": 0.0, "omega": w}, "two": {"angle": 0.0, "omega": 0.0}}, rtol=1e-12
    )
    run = mbody.simulate(machine)
    slide, t, count = 0.1 * w, 0.5 * b / (0.1 * w), 0
    effective = 1.0 / (0.1**2 / 0.02 + 0.2**2 / 0.05)
    omegas = [w, 0.0]
    while t < 0.008:
        hit = run.events[count]
        assert hit.name == "impact" and hit.contact == "mesh"
        # located to 1e-16 of a place at that speed
        assert hit.t == pytest.approx(t, abs=1e-12)
        impulse = (1.0 + e) * slide * effective
        omegas = [omegas[0] - 0.1 * impulse / 0.02, omegas[1] - 0.2 * impulse / 0.05]
        after = [hit.after[name].omega[0] for name in ("one", "two")]
        assert after == pytest.approx(omegas, abs=1e-9)
        slide *= -e
        t, count = t + b / abs(slide), count + 1
    assert count >= 4 and count == len(run.events)
    arc = 0.1 * run["one"].angle + 0.2 * run["two"].angle
    # the row is the sine of the angle between tooth and line of centres: 1e-7 of the play
    assert np.abs(arc).max() <= 0.5 * b * (1.0 + 1e-6)
    assert run.energy.error < 1e-9


@pytest.mark.parametrize("holds", ["rope", "bar"])
def test_a_bob_that_is_swung_up_leaves_its_circle(holds):
    """v₀² = 4 g l: the string is slack at cos θ = −2/3, the bob flies a parabola until it is taut
    again, without rebound.
    """
    length = 0.5
    machine = mbody.Mechanism("bob", ground={"O": (0.0, 0.0)})
    machine.add(mbody.Body("bob", mass=0.7, inertia=0.1, points={"C": (0.0, 0.0)}))
    one = (
        mbody.Rope("string", "ground.O", "bob.C", length)
        if holds == "rope"
        else mbody.Distance("string", "ground.O", "bob.C", length, one_sided="pull")
    )
    machine.add(one, mbody.Gravity("gravity", y=-G))
    v0 = math.sqrt(4.0 * G * length)
    machine.simulation = mbody.SimulationSettings(
        1.0, {"bob": {"x": 0.0, "y": -length, "vx": v0}}, rtol=1e-12
    )
    run = mbody.simulate(machine)
    slack, taut = run.events[:2]
    angle = math.acos(-2.0 / 3.0)

    def rate(theta):
        return math.sqrt(v0 * v0 - 2.0 * G * length * (1.0 - math.cos(theta))) / length

    t1 = quad(lambda theta: 1.0 / rate(theta), 0.0, angle, epsabs=1e-13)[0]
    assert slack.name == "open" and slack.t == pytest.approx(t1, abs=1e-11)
    x, y = length * math.sin(angle), -length * math.cos(angle)
    speed = length * rate(angle)
    vx, vy = speed * math.cos(angle), speed * math.sin(angle)

    def out(t):
        return (x + vx * t) ** 2 + (y + vy * t - 0.5 * G * t * t) ** 2 - length**2

    t2 = t1 + brentq(out, 0.05, 1.0, xtol=1e-15)
    assert taut.name == "impact" and taut.t == pytest.approx(t2, abs=1e-10)
    at = taut.after["bob"]
    assert at.x[0] * at.vx[0] + at.y[0] * at.vy[0] == pytest.approx(0.0, abs=1e-10)
    assert run.energy.error < 1e-9


def test_a_strut_pushes_and_does_not_pull():
    """A mass on a strut from below, thrown up: it leaves at once and lands at 2 v/g, rebounds."""
    e, v = 0.4, 1.5
    machine = mbody.Mechanism("strut", ground={"O": (0.0, 0.0)})
    machine.add(
        mbody.Body("mass", mass=2.0, inertia=0.1, points={"C": (0.0, 0.0)}, guess=(0.0, 0.3, 0.0)),
        mbody.Prismatic(
            "guide",
            mbody.Marker("ground", "O", 0.5 * math.pi),
            mbody.Marker("mass", "C", 0.5 * math.pi),
        ),
        mbody.Distance("strut", "ground.O", "mass.C", 0.3, one_sided="push", restitution=e),
        mbody.Gravity("gravity", y=-G),
    )
    machine.simulation = mbody.SimulationSettings(1.0, {"mass": {"y": 0.3, "vy": v}}, rtol=1e-12)
    run = mbody.simulate(machine)
    assert run.events[0].t == pytest.approx(2.0 * v / G, abs=1e-12)
    assert run.events[0].after["mass"].vy[0] == pytest.approx(e * v, abs=1e-11)
    assert run.mode("strut")[-1] == "stick"
    assert run.contact("strut")[-1] == pytest.approx(2.0 * G, rel=1e-10)


@pytest.mark.parametrize("friction", [None, 0.0])
def test_a_pin_leaves_the_flank_that_carries_it(friction):
    """Shaken by a sin ωt it leaves where sin ωt = g/(a ω²), as a stone on a plate."""
    a, w = 0.2, 9.0
    machine = mbody.Mechanism("flank", ground={"O": (0.0, 0.0)})
    up = 0.5 * math.pi
    machine.add(
        mbody.Body("plate", mass=1.0, inertia=1.0, points={"P": (0.0, 0.0)}),
        mbody.Body("stone", mass=2.0, inertia=1.0, points={"C": (0.0, 0.0)}),
        mbody.Prismatic("rails", mbody.Marker("ground", "O", up), mbody.Marker("plate", "P", up)),
        mbody.Prismatic("guide", mbody.Marker("ground", "O", up), mbody.Marker("stone", "C", up)),
        mbody.PinSlot("flank", "plate.P", "stone.C", one_sided=True, friction=friction),
        mbody.CoordinateDriver(
            "shaker", mbody.Marker("ground", "O", up), "plate.P", f"{a} m*sin({w} rad/s*t)"
        ),
        mbody.Gravity("gravity", y=-G),
    )
    run = mbody.simulate(machine, 0.6, rtol=1e-11)
    leaves, lands = run.events[:2]
    t1 = math.asin(G / (a * w * w)) / w
    assert leaves.name == "open" and leaves.t == pytest.approx(t1, abs=1e-11)
    y, v = a * math.sin(w * t1), a * w * math.cos(w * t1)

    def gap(t):
        return y + v * (t - t1) - 0.5 * G * (t - t1) ** 2 - a * math.sin(w * t)

    landing = brentq(gap, t1 + 0.05, t1 + 0.5, xtol=1e-15)
    assert lands.name == "impact" and lands.t == pytest.approx(landing, abs=1e-10)
    assert run.energy.error < 1e-9


def bounces(c, e, start, until):
    """A particle in a circle of radius c: parabolas and reflections, event by event."""
    t, (x, y, vx, vy), found = 0.0, start, []
    while True:
        # |p + v τ − ½ g τ² k|² = c²: a quartic, whose least positive root it is
        poly = [
            0.25 * G * G,
            -G * vy,
            vx * vx + vy * vy - G * y,
            2.0 * (x * vx + y * vy),
            x * x + y * y - c * c,
        ]
        roots = np.roots(poly)
        real = roots[np.abs(roots.imag) < 1e-9 * np.abs(roots).max()].real
        later = real[real > 1e-9]
        if not len(later) or t + later.min() > until:
            return found
        tau = float(later.min())
        x, y, vy = x + vx * tau, y + vy * tau - 0.5 * G * tau * tau, vy - G * tau
        t += tau
        nx, ny = x / c, y / c
        out = vx * nx + vy * ny
        vx, vy = vx - (1.0 + e) * out * nx, vy - (1.0 + e) * out * ny
        found.append((t, vx, vy))


def test_a_pin_with_play_strikes_its_hole():
    """Against parabolas and reflections, event by event; and the same as a disc in a ring."""
    c, e = 1e-2, 0.7
    start = (0.0, 0.0, 0.11, 0.05)
    state = {"x": 0.0, "y": 0.0, "angle": 0.0, "vx": start[2], "vy": start[3]}
    machine = mbody.Mechanism("play", ground={"O": (0.0, 0.0)})
    machine.add(
        mbody.Body("pin", mass=0.3, inertia=1e-4, points={"C": (0.0, 0.0)}),
        mbody.Revolute("hole", "ground.O", "pin.C", clearance=c, restitution=e),
        mbody.Gravity("gravity", y=-G),
    )
    machine.simulation = mbody.SimulationSettings(0.25, {"pin": state}, rtol=1e-12)
    run = mbody.simulate(machine)
    impacts = [one for one in run.events if one.name == "impact"]
    expected = bounces(c, e, start, 0.25)
    assert len(expected) >= 12 and len(impacts) >= 12
    for hit, (t, vx, vy) in zip(impacts[:12], expected[:12], strict=True):
        assert hit.t == pytest.approx(t, abs=1e-9)
        assert hit.after["pin"].vx[0] == pytest.approx(vx, abs=1e-7)
        assert hit.after["pin"].vy[0] == pytest.approx(vy, abs=1e-7)
    shapes = mbody.Mechanism(
        "play", ground={"O": (0.0, 0.0)}, ground_shapes={"bore": {"ring": "O", "radius": 0.03}}
    )
    shapes.add(
        mbody.Body(
            "pin",
            mass=0.3,
            inertia=1e-4,
            points={"C": (0.0, 0.0)},
            shapes={"rim": {"disc": "C", "radius": 0.02}},
        ),
        mbody.Contact("hole", "ground.bore", "pin.rim", restitution=e),
        mbody.Gravity("gravity", y=-G),
    )
    shapes.simulation = machine.simulation
    other = mbody.simulate(shapes)
    # impacts are too weak to count when the pin all but rests, by model lengths that differ
    times = [[one.t for one in found.events][:30] for found in (other, run)]
    assert len(times[0]) == len(times[1]) == 30
    assert times[0] == pytest.approx(times[1], abs=1e-9)


def test_a_slider_crank_with_play_keeps_within_it():
    """The pin of the piston stays in its hole, the energy closes, and without play in the limit the
    motion is that of the ideal engine: by a tenth of the clearance the difference is a tenth.
    """

    def engine(clearance):
        machine = mbody.Mechanism("engine", ground={"O": (0.0, 0.0)})
        machine.add(
            mbody.Body("crank", mass=1.0, inertia=0.05, points={"O": (0.0, 0.0), "A": (0.1, 0.0)}),
            mbody.Body(
                "rod",
                mass=0.5,
                inertia=0.005,
                cg=(0.15, 0.0),
                points={"A": (0, 0), "B": (0.4, 0)},
                guess=(0.1, 0.0, 0.0),
            ),
            mbody.Body(
                "piston", mass=0.8, inertia=0.001, points={"B": (0.0, 0.0)}, guess=(0.5, 0, 0)
            ),
            mbody.Revolute("O", "ground.O", "crank.O"),
            mbody.Revolute("A", "crank.A", "rod.A"),
            mbody.Revolute("B", "rod.B", "piston.B", clearance=clearance),
            mbody.Prismatic("guide", "ground.O", "piston.B"),
            mbody.AngleDriver("motor", "crank", "0.5 rad + 20 rad/s*t"),
        )
        return machine

    ideal = mbody.simulate(engine(None), 0.3, rtol=1e-9)
    apart = []
    for c in (1e-3, 1e-4):
        run = mbody.simulate(engine(c), 0.3, rtol=1e-9)
        assert run.status == "completed" and run.energy.error < 1e-8
        pin, hole = run.point("piston.B"), run.point("rod.B")
        play = np.hypot(pin.x - hole.x, pin.y - hole.y)
        assert play.max() <= c * (1.0 + 1e-6) and play.max() > 0.99 * c
        assert any(one.name == "impact" for one in run.events)
        apart.append(np.abs(run["piston"].x - ideal["piston"].x).max())
    assert apart[0] <= 1.2e-3 and apart[1] <= 1.2e-4


def freewheel(**more):
    machine = mbody.Mechanism("freewheel", ground={"O": (0.0, 0.0)})
    machine.add(
        mbody.Body("hub", mass=1.0, inertia=0.1, points={"O": (0.0, 0.0)}),
        mbody.Body("wheel", mass=1.0, inertia=0.4, points={"O": (0.0, 0.0)}),
        mbody.Revolute("A", "ground.O", "hub.O"),
        mbody.Revolute("B", "ground.O", "wheel.O"),
        mbody.Freewheel("clutch", "hub.O", "wheel.O", **more),
    )
    return machine


@pytest.mark.parametrize("clockwise", [False, True])
def test_a_freewheel_takes_along_and_lets_run_ahead(clockwise):
    """The hub takes the wheel along by an impact, as one body: I₁ω₁/(I₁ + I₂). Turned the other
    way nothing happens.
    """
    machine, way = freewheel(clockwise=clockwise), -1.0 if clockwise else 1.0
    for omega, common in ((3.0, 0.6), (-3.0, None)):
        start = {"hub": {"angle": 0.0, "omega": way * omega}, "wheel": {"angle": 0.0, "omega": 0.0}}
        machine.simulation = mbody.SimulationSettings(1.0, start)
        run = mbody.simulate(machine)
        ends = [way * run[name].omega[-1] for name in ("hub", "wheel")]
        expected = [omega, 0.0] if common is None else [common, common]
        assert ends == pytest.approx(expected, abs=1e-12)
        assert run.energy.error < 1e-12


def test_a_freewheel_winds_a_spring_up():
    """Hub at A (1 − cos ωt), a spring k on the wheel: T = I A ω² cos φ + k A (1 − cos φ) until
    cos φ = k/(k − I ω²); then the wheel swings on its spring until the hub is as fast again.
    """
    A, w, k, inertia = 0.3, 4.0, 1.1, 0.4
    machine = freewheel()
    machine.add(
        mbody.AngleDriver("motor", "hub", f"{A} rad*(1 - cos({w} rad/s*t))"),
        mbody.TorsionSpring("spring", "wheel", stiffness=k),
    )
    run = mbody.simulate(machine, 1.5, rtol=1e-12)
    off, on = run.events[:2]
    phase = math.acos(k / (k - inertia * w * w))
    t1 = phase / w
    assert (off.name, off.contact) == ("open", "clutch")
    assert off.t == pytest.approx(t1, abs=1e-12)
    engaged = run.t < off.t
    c = np.cos(w * run.t[engaged])
    torque = inertia * A * w * w * c + k * A * (1.0 - c)
    assert run.contact("clutch")[engaged] == pytest.approx(torque, abs=1e-10)
    own = math.sqrt(k / inertia)
    angle, rate = A * (1.0 - math.cos(phase)), A * w * math.sin(phase)

    def ahead(t):
        tau = own * (t - t1)
        swing = rate * math.cos(tau) - angle * own * math.sin(tau)
        return swing - A * w * math.sin(w * t)

    t2 = brentq(ahead, t1 + 0.05, t1 + 2.0, xtol=1e-15)
    assert on.name == "stick" and on.t == pytest.approx(t2, abs=1e-10)
    assert run.energy.error < 1e-9


def test_a_limit_of_a_joint_with_friction_has_none_of_its_own():
    """Two rods on rough pins, the second one at its limit: it ends, and its limit never pulls."""
    machine = mbody.Mechanism("rods", ground={"H": (0, 0)})
    rod = {"P0": (-0.5, 0), "P1": (0.5, 0)}
    machine.add(
        mbody.Body("a", mass=1.0, inertia=0.1, points=rod, guess=(0.5, 0, 0)),
        mbody.Body("b", mass=2.0, inertia=0.2, points=rod, guess=(1.5, 0, 0)),
        mbody.Revolute("A", "ground.H", "a.P0", friction=0.5, pin_radius=0.2),
        mbody.Revolute("B", "a.P1", "b.P0", friction=0.9, pin_radius=0.1, limits=(-0.3, 0.3)),
        mbody.Gravity("g", y=-9.81),
    )
    machine.simulation = mbody.SimulationSettings(until=3.0)
    run = mbody.simulate(machine, 3.0, instants=31)
    assert run.status == "completed" and len(run.events) < 60
    assert all(point.static == 0.0 for point in Unilateral(run.system).contact_points)
