"""Smooth curves as shapes: closed forms of beads and wheels, rows by differences, segments as the
limit, ends, files.
"""

from __future__ import annotations

import math

import numpy as np
import pytest

import mbody
from mbody import Body, Contact, Gravity, Mechanism, SimulationSettings
from mbody.analysis.contact.unilateral import Unilateral
from mbody.laws import Table
from mbody.laws.smooth_contour import contour_of
from mbody.system.assembler import assemble

G = 9.81


def on_curve(
    curves, *, radius=0.0, friction=0.0, start, until, solid=None, restitution=0.0, **more
):
    """A bead, or a wheel, of 2 kg on a curve of the ground."""
    names = tuple(curves)
    shape = {"curve": names[0] if len(names) == 1 else names, "point": "O"}
    machine = Mechanism(
        "curve", ground={"O": (0.0, 0.0)}, ground_shapes={"road": shape}, curves=curves
    )
    rim = {"rim": {"disc": "C", "radius": radius}} if radius else {}
    inertia = 0.5 * 2.0 * radius**2 if radius else 0.01
    place = "wheel.rim" if radius else "wheel.C"
    machine.add(
        Body("wheel", mass=2.0, inertia=inertia, points={"C": (0.0, 0.0)}, shapes=rim),
        Contact("road", "ground.road", place, friction=friction, restitution=restitution),
        Gravity("gravity", y=-G),
    )
    machine.simulation = SimulationSettings(until=until, rtol=1e-11, start={"wheel": start})
    return machine


def sine(count=161, amplitude=0.1, length=4.0):
    x = np.linspace(0.0, length, count)
    return Table(x, amplitude * np.cos(np.pi * x), interpolation="spline")


def test_bead_presses_by_gravity_and_curvature():
    road = sine()
    x, speed = 0.3, 0.4
    _, f1, _ = road.derivatives(x)
    u = np.array([1.0, f1]) / math.hypot(1.0, f1)
    start = {"x": x, "y": road(x), "vx": speed * u[0], "vy": speed * u[1]}
    run = mbody.simulate(on_curve({"road": road}, start=start, until=1.2), instants=60)
    assert run.status == "completed" and not run.events
    height, f1, f2 = road.derivatives(run["wheel"].x)
    np.testing.assert_allclose(run["wheel"].y, height, atol=1e-13)
    square = speed**2 + 2.0 * G * (road(x) - height)
    kappa, cosine = f2 / (1.0 + f1**2) ** 1.5, 1.0 / np.sqrt(1.0 + f1**2)
    np.testing.assert_allclose(run.contact("road"), 2.0 * (G * cosine + square * kappa), rtol=2e-9)


def test_wheel_rolls_on_the_parallel_curve():
    """Its centre goes along the curve at the distance of its radius, with 3/2 m v²/2."""
    road, radius = sine(), 0.2
    x = 0.35
    _, f1, _ = road.derivatives(x)
    n = np.array([-f1, 1.0]) / math.hypot(1.0, f1)
    start = {"x": x + radius * n[0], "y": road(x) + radius * n[1]}
    run = mbody.simulate(
        on_curve({"road": road}, radius=radius, friction=0.9, start=start, until=1.2), instants=60
    )
    assert set(run.mode("road")) == {"roll"} and not run.events
    wheel = run["wheel"]
    # the foot below each centre
    s = wheel.x.copy()
    for _ in range(60):
        f, f1, f2 = road.derivatives(s)
        g = s - wheel.x + (f - wheel.y) * f1
        s = s - g / (1.0 + f1**2 + (f - wheel.y) * f2)
    f, f1, f2 = road.derivatives(s)
    size = np.sqrt(1.0 + f1**2)
    np.testing.assert_allclose(np.hypot(wheel.x - s, wheel.y - f), radius, atol=1e-12)
    square = wheel.vx**2 + wheel.vy**2
    np.testing.assert_allclose(0.75 * square, G * (start["y"] - wheel.y), atol=1e-9)
    np.testing.assert_allclose(wheel.omega, -(wheel.vx + f1 * wheel.vy) / size / radius, atol=1e-10)
    kappa = f2 / size**3
    pressing = 2.0 * (G / size + square * kappa / (1.0 - kappa * radius))
    np.testing.assert_allclose(run.contact("road"), pressing, rtol=1e-8)
    # how far it rolled: the length of the curve, and by how much this turns
    along = np.linspace(x, s[-1], 20001)
    length = np.trapezoid(np.sqrt(1.0 + road.derivatives(along)[1] ** 2), along)
    turn = math.atan(f1[-1]) - math.atan(road.derivatives(x)[1])
    assert wheel.angle[-1] == pytest.approx(turn - length / radius, abs=1e-8)


def test_bead_leaves_a_round_hill_where_gravity_no_longer_bends_its_way():
    """At v² = g R cos α, cos α = (2 + v₀²/(g R))/3; a spline has the curvature to h²/12."""
    u, radius, speed = np.linspace(-2.0, 2.0, 321), 0.7, 0.9
    curves = {
        "hx": Table(u, radius * np.sin(u), interpolation="spline"),
        "hy": Table(u, radius * np.cos(u), interpolation="spline"),
    }
    start = {"x": 0.0, "y": radius, "vx": speed}
    run = mbody.simulate(on_curve(curves, start=start, until=0.7))
    (event,) = run.events
    assert event.name == "open"
    state = event.state["wheel"]
    cosine = (2.0 + speed**2 / (G * radius)) / 3.0
    assert state.y / radius == pytest.approx(cosine, rel=1.3e-5)
    assert state.vx**2 + state.vy**2 == pytest.approx(G * radius * cosine, rel=1.3e-5)


@pytest.mark.parametrize("amplitude", [0.3, 1.2, 2.4])
def test_cycloid_is_isochronous(amplitude):
    a, angles = 0.25, np.linspace(-3.0, 3.0, 241)
    curves = {
        "cx": Table(angles, a * (angles + np.sin(angles)), interpolation="spline"),
        "cy": Table(angles, a * (1.0 - np.cos(angles)), interpolation="spline"),
    }
    start = {"x": curves["cx"](amplitude), "y": curves["cy"](amplitude)}
    quarter = math.pi * math.sqrt(a / G)
    run = mbody.simulate(on_curve(curves, start=start, until=2.0 * quarter), instants=3)
    assert not run.events
    assert abs(run["wheel"].x[1]) < 2e-8
    assert run["wheel"].x[2] == pytest.approx(-start["x"], abs=2e-8)


def _machine(closed=False):
    """A curve on a body that turns and moves, and a wheel."""
    t = np.linspace(0.0, (2.0 if closed else 1.7) * np.pi, 41)
    x, y = 0.8 * np.cos(t), -0.5 * np.sin(t)
    if closed:
        x[-1], y[-1] = x[0], y[0]
    tables = [Table(t, part, interpolation="spline", periodic=closed) for part in (x, y)]
    machine = Mechanism(
        "cam", ground={"O": (0.0, 0.0)}, curves=dict(zip("ab", tables, strict=True))
    )
    shape = {"curve": ("a", "b"), "point": "P"}
    machine.add(
        Body(
            "cam",
            mass=2.0,
            inertia=0.3,
            cg=(0.1, -0.2),
            points={"P": (0.3, 0.1)},
            shapes={"rim": shape},
        ),
        Body(
            "wheel",
            mass=1.0,
            inertia=0.1,
            cg=(0.05, 0.02),
            points={"C": (0.1, 0.0)},
            shapes={"rim": {"disc": "C", "radius": 0.15}},
        ),
        Contact("track", "wheel.rim", "cam.rim", friction=0.4),
    )
    return machine


@pytest.mark.parametrize("closed", [False, True])
def test_rows_agree_with_differences(closed):
    system = assemble(_machine(closed))
    uni, work = Unilateral(system), system.work()
    point = uni.contact_points[0]
    rng = np.random.default_rng(3)
    h = 1e-5
    for _ in range(5):
        q, v = rng.normal(size=(2, 6))
        q[3:5] = q[:2] + rng.uniform(0.7, 1.0) * np.array([math.cos(q[5]), math.sin(q[5])])

        def read(step, q=q, v=v):
            work.q[:6, 0], work.v[:6, 0] = q + step * v, v
            return uni.read(work)

        back, here, ahead = (read(step) for step in (-h, 0.0, h))
        np.testing.assert_allclose(here.rate, here.block @ v, atol=1e-12)
        slope = (ahead.value - back.value) / (2.0 * h)
        assert slope[point.normal] == pytest.approx(here.rate[point.normal], abs=1e-7)
        # γ is what is left of the second derivative at constant rates
        bend = (ahead.rate - back.rate) / (2.0 * h)
        np.testing.assert_allclose(bend[:2], -here.gamma[:2], rtol=1e-5, atol=1e-6)


def test_foot_is_the_nearest_of_all_places():
    machine = _machine()
    contour = contour_of(("a", "b"), tuple(one.law for one in machine.curves.values()))
    places = np.random.default_rng(1).uniform(-2.0, 2.0, (200, 2))
    along, directions = contour.places(400)
    D, s, phi, _ = contour.feet(places).T
    for n, place in enumerate(places):
        distances = np.hypot(*(along - place).T)
        k = int(distances.argmin())
        if 0 < k < len(along) - 1:
            assert abs(D[n]) == pytest.approx(distances[k], abs=1e-5)
            cross = directions[k, 0] * math.sin(phi[n]) - directions[k, 1] * math.cos(phi[n])
            assert abs(cross) < 0.02 and 0.0 <= s[n] <= contour.length


def test_ellipse_has_its_length_and_turns_once():
    contour = assemble(_machine(True)).mechanism.contacts[0].shapes[1].law
    t = np.linspace(0.0, 2.0 * np.pi, 4001)[:-1]
    length = np.hypot(0.8 * np.sin(t), 0.5 * np.cos(t)).mean() * 2.0 * np.pi
    assert contour.length == pytest.approx(length, rel=1e-5)
    assert contour.pieces[-1, 10] - contour.pieces[0, 10] == pytest.approx(-2.0 * np.pi, abs=0.25)


def test_straight_curve_is_a_segment_with_its_ends():
    """A wheel rolls off the end of a table, and falls about its corner."""
    start = {"x": 0.7, "y": 0.2, "vx": 0.6, "angle": 0.0, "omega": -1.0}

    rim = {"rim": {"disc": "C", "radius": 0.2}}

    def followed(shape, curves):
        machine = Mechanism(
            "table",
            ground={"A": (0.0, 0.0), "B": (1.0, 0.0)},
            ground_shapes={"top": shape},
            curves=curves,
        )
        machine.add(
            Body("wheel", mass=3.0, inertia=0.06, points={"C": (0.0, 0.0)}, shapes=rim),
            Contact("road", "ground.top", "wheel.rim", friction=0.3),
            Gravity("gravity", y=-G),
        )
        machine.simulation = SimulationSettings(until=0.9, rtol=1e-11, start={"wheel": start})
        return mbody.simulate(machine)

    straight = Table(np.linspace(0.0, 1.0, 7), np.zeros(7), interpolation="spline")
    one = followed({"segment": ("A", "B")}, {})
    two = followed({"curve": "flat", "point": "A"}, {"flat": straight})
    assert [e.name for e in one.events] == [e.name for e in two.events] and len(one.events) > 2
    np.testing.assert_allclose([e.t for e in two.events], [e.t for e in one.events], atol=1e-9)
    for key in ("x", "y", "angle"):
        np.testing.assert_allclose(
            getattr(two["wheel"], key), getattr(one["wheel"], key), atol=1e-8
        )


def test_fine_segments_come_to_the_curve():
    """The loss of a wheel without rebound at the corners of a street vanishes with their angles."""
    road, radius = sine(), 0.2
    start = {"x": 2.0, "y": road(2.0) + radius, "vx": 0.5, "angle": 0.0, "omega": -2.5}

    def followed(pieces):
        x = np.linspace(1.5, 2.5, pieces + 1)
        points = {f"P{n}": (float(a), float(road(a))) for n, a in enumerate(x)}
        machine = Mechanism(
            "street",
            ground=points,
            ground_shapes={f"s{n}": {"segment": (f"P{n}", f"P{n + 1}")} for n in range(pieces)},
        )
        rim = {"rim": {"disc": "C", "radius": radius}}
        machine.add(
            Body("wheel", mass=2.0, inertia=0.04, points={"C": (0.0, 0.0)}, shapes=rim),
            *(Contact(f"c{n}", f"ground.s{n}", "wheel.rim", friction=0.8) for n in range(pieces)),
            Gravity("gravity", y=-G),
        )
        machine.simulation = SimulationSettings(until=0.4, rtol=1e-9, start={"wheel": start})
        return mbody.simulate(machine, instants=2)["wheel"].x[-1]

    smooth = mbody.simulate(
        on_curve({"road": road}, radius=radius, friction=0.8, start=start, until=0.4), instants=2
    )["wheel"].x[-1]
    coarse, fine = abs(followed(8) - smooth), abs(followed(16) - smooth)
    assert fine < 0.75 * coarse and fine < 0.03 * abs(smooth - 2.0)


def test_driven_wheel_rolls_on_a_curve():
    """Its centre is led along; where it is and how it turns follow, and so does the force."""
    road, radius = sine(), 0.2
    start = {"x": 0.4, "y": 0.2 + road(0.4), "angle": 0.0}
    machine = on_curve({"road": road}, radius=radius, friction=0.9, start=start, until=1.0)
    machine.add(mbody.CoordinateDriver("hand", "ground.O", "wheel.C", law="0.4 + 0.5*t"))
    run = mbody.kinetostatics(machine, np.linspace(0.0, 1.0, 41))
    wheel = run["wheel"]
    foot = machine["road"].shapes[0].law.feet(np.column_stack([wheel.x, wheel.y]))
    np.testing.assert_allclose(foot[:, 0], radius, atol=1e-12)
    rolled = foot[:, 1] - radius * foot[:, 2] + radius * wheel.angle
    np.testing.assert_allclose(rolled, rolled[0], atol=1e-10)
    assert set(run.mode("road")) == {"roll"}
    # power: what the hand gives raises and speeds up
    t, effort = run.t, run.effort("hand")
    energy = 9.81 * 2.0 * wheel.y + wheel.vx**2 + wheel.vy**2 + 0.5 * 0.04 * wheel.omega**2
    work = np.array([0.5 * 0.5 * (effort[1:] + effort[:-1]) @ np.diff(t)])
    assert energy[-1] - energy[0] == pytest.approx(work[0], rel=0.02)
