"""Gradients of motions that are replayed by the record of what happened in them: impacts of several
contact points, series of impacts that come to rest, contacts at their limits, forces that no
equation decides, drivers that jerk, ends of arcs. Against closed forms by complex steps, and
differences of motions with their own band.
"""

import math
from dataclasses import replace

import numpy as np
import pytest

import mbody
from mbody import (
    AngleDriver,
    Body,
    Contact,
    CoordinateDriver,
    Force,
    Gravity,
    Marker,
    Mechanism,
    Prismatic,
    Revolute,
    SimulationSettings,
    Torque,
)
from mbody.derivatives import free_instants
from mbody.laws import ConstantSpeed, Table
from tests.campaign.scenes import random_scene
from tests.contact.test_joint_impulses import rotor
from tests.contact.test_shared_forces import four_bar
from tests.derivatives.test_gradients_through_events import difference
from tests.support import contact_models as models

G = 9.81


def check_beside_differences(machine, measures, names, part=1e-5, **options):
    """The gradient is that of differences, within 1e-6 of the greatest and their band; no row and
    no column of the table is zero, so that none agrees by chance.
    """
    system = mbody.assemble(machine)
    how = {"rtol": 1e-12, **options}
    g = mbody.gradient(machine, measures, names, analysis="simulate", **how)

    def last(other):
        run = mbody.simulate(other, **how)
        return np.array([run.measure(text)[-1] for text in (one[5:-1] for one in measures)])

    assert np.isfinite(g.jacobian).all(), g.notes
    for k, name in enumerate(names):
        numeric, band = difference(system, last, name, part)
        size = np.abs(numeric).max()
        assert size > 1e3 * band.max(), name
        assert (np.abs(g.jacobian[:, k] - numeric) <= band + 1e-6 * size).all(), name
    return g


# -- Impacts that come to rest -----------------------------------------------------------------

HELD, FRICTION, BOUNCE, ALONG, HEIGHT = 0.25, 0.1, 0.6, 4.0, 0.6


def hopper(unit, mass, law, until):
    """What hops on a floor, held by a spring along it, and then slides."""
    ground = {"floor": {"line": {"point": "O"}}}
    machine = Mechanism("hopper", ground={"O": (0.0, 0.0)}, ground_shapes=ground)
    shapes = {"s": {"disc": "C", "radius": 0.1 * unit}}
    machine.add(
        Body("b", mass=mass, inertia=mass * unit**2, points={"C": (0.0, 0.0)}, shapes=shapes),
        Contact("k", "ground.floor", "b.s", friction=FRICTION, restitution=BOUNCE, law=law),
        AngleDriver("upright", "b", ConstantSpeed(0.0, 0.0)),
        Force("spring", "b.C", value=f"-{HELD * mass}*b.x"),
        Gravity("g", y=-G * unit),
    )
    start = {"b": {"x": 0.0, "y": HEIGHT * unit, "vx": ALONG * unit, "vy": 0.0}}
    machine.simulation = SimulationSettings(until=until, start=start, rtol=1e-11, instants=3)
    return machine


def hopped(numbers, until):
    """Its place and rate, and when it comes to rest after infinitely many flights."""
    mu, e, g, vx, y = numbers
    h, w = y - 0.1, math.sqrt(HELD)

    def goes(x, v, s, middle=0.0):
        c, d = np.cos(w * s), np.sin(w * s)
        return middle + (x - middle) * c + v / w * d, v * c - (x - middle) * w * d

    t, u = np.sqrt(2.0 * h / g), np.sqrt(2.0 * g * h)
    x, v = goes(0.0, vx, t)
    for _ in range(300):
        v, u = v - mu * (1.0 + e) * u, e * u
        x, v = goes(x, v, 2.0 * u / g)
        t = t + 2.0 * u / g
    return np.array([*goes(x, v, until - t, -mu * g / HELD), t])


@pytest.mark.parametrize("law", ["newton", "poisson"])
@pytest.mark.parametrize(("unit", "mass"), [(1.0, 1.3), (1e-6, 1e6), (1e6, 1e-6)])
def test_what_hops_until_it_slides(unit, mass, law):
    """In closed form: place and rate after the rest, and when it comes."""
    numbers, until = [FRICTION, BOUNCE, G, ALONG, HEIGHT], 1.6
    exact = np.empty((3, 5))
    for k in range(5):
        moved = np.array(numbers, dtype=complex)
        moved[k] += 1e-30j
        exact[:, k] = hopped(moved, until).imag / 1e-30
    names = ["k.friction", "k.restitution", "g.y", "start.b.vx", "start.b.y"]
    machine = hopper(unit, mass, law, until)
    g = mbody.gradient(machine, ["last(b.x)", "last(b.vx)"], names, analysis="simulate")
    sizes = np.array([1.0, 1.0, -1.0, 1.0, 1.0])
    found = g.jacobian * sizes / [unit, unit, 1.0, 1.0, 1.0]
    # a flight that is left out has an effect of its square
    assert np.abs((found - exact[:2]) / np.abs(exact[:2]).max(axis=0)).max() < 1e-9
    (rest,) = (one for one in g.events if one.name == "rest")
    row = np.array([rest.by[name] for name in names]) * sizes * [1.0, 1.0, unit, unit, unit]
    np.testing.assert_allclose(row, exact[2], rtol=1e-4, atol=1e-6)
    assert rest.t == pytest.approx(hopped(np.array(numbers), until)[2], rel=1e-9)
    assert [note for note in g.notes if "come to rest there" in note]


def box(law, until, unit=1.0, tilted=True):
    """A box that is thrown on a slope."""
    ground = {"floor": {"line": {"point": "O", "angle": 0.1}}}
    machine = Mechanism("box", ground={"O": (0.0, 0.0)}, ground_shapes=ground)
    x, y = 0.3 * unit, 0.2 * unit
    points = {"a": (-x, -y), "b": (x, -y), "c": (x, y), "d": (-x, y)}
    shapes = {"s": {"polygon": list("abcd")}}
    cg = (0.03 * unit, -0.02 * unit)
    machine.add(
        Body("box", mass=2.0, inertia=0.1 * unit**2, cg=cg, points=points, shapes=shapes),
        Contact(
            "foot", "ground.floor", "box.s", friction=0.4, static=0.48, restitution=0.3, law=law
        ),
        Gravity("g", y=-G * unit),
    )
    start = {"x": 0.0, "y": 0.5, "angle": 0.1, "vx": 0.3, "vy": 0.0, "omega": 0.0}
    if tilted:
        start = {"x": -0.2, "y": 0.7, "angle": 0.5, "vx": 2.0, "vy": 0.3, "omega": -3.0}
    scaled = {key: one * (1.0 if key in ("angle", "omega") else unit) for key, one in start.items()}
    machine.simulation = SimulationSettings(until=until, start={"box": scaled}, instants=3)
    return machine


@pytest.mark.parametrize(("law", "unit"), [("newton", 1.0), ("poisson", 1e-6), ("poisson", 1e6)])
def test_a_box_that_tumbles_and_comes_to_rest(law, unit):
    """Two series of impacts, some of two corners at once with Coulomb's limits: through 45 changes
    of modes.
    """
    names = ["foot.friction", "foot.restitution"] if unit == 1.0 else ["box.inertia"]
    machine = box(law, 0.9, unit)
    g = check_beside_differences(machine, ["last(box.x)", "last(box.y)"], names, part=1e-6)
    assert sum(one.name == "rest" for one in g.events) == 2
    assert any("have some 4 figures" in note for note in g.notes)


@pytest.mark.slow
def test_a_box_that_falls_flat():
    """Corners strike together and stick by rows of which one is at its limit; another has room."""
    names = ["foot.friction", "foot.restitution", "box.inertia"]
    check_beside_differences(box("poisson", 0.435, tilted=False), ["last(box.x)"], names)


@pytest.mark.parametrize(
    ("seed", "measure", "names"),
    [
        (24, "c.angle", ["c.mass", "floor c P0.restitution"]),
        (47, "a.x", ["gravity.y"]),
    ],
)
def test_random_scenes(seed, measure, names):
    """Rows of an impact that depend on each other, one at its limit, by Poisson's law; a rim
    without inertia that strikes.
    """
    scene = random_scene(seed)
    how = {"until": scene.until, "instants": 2}
    rough = scene.mechanism("scene")
    machine = Mechanism("scene", ground=rough.ground.points, ground_shapes=rough.ground.shapes)
    joints = [replace(one, friction=0.0, static=None) for one in rough.joints]
    machine.add(*rough.bodies, *joints, *rough.loads, *rough.contacts)
    machine.simulation = rough.simulation
    check_beside_differences(machine, [f"last({measure})"], names, **how)


def test_what_sticks_twice_beside_a_pin_that_slides_has_none():
    """Three links stick at a floor, a limit and two pins: their shares press the third one."""
    scene = random_scene(24)
    machine, how = scene.mechanism("scene"), {"until": scene.until, "instants": 2}
    g = mbody.gradient(machine, "last(c.angle)", ["c.mass"], analysis="simulate", **how)
    assert np.isnan(g.jacobian).all()
    why = "no equation decides the impulses on which friction of joints depends"
    assert any(why in note for note in g.notes)
    # nor the velocities of the third one
    assert any("has several outcomes" in one.message for one in g.doubts)


def test_an_impact_that_the_linear_equations_do_not_give_has_none(monkeypatch):
    stretches = free_instants.stretches_of

    def others(run):
        found = stretches(run)
        for one in found:
            one.strikes = tuple(
                replace(strike, after=1.001 * strike.after) for strike in one.strikes
            )
        return found

    monkeypatch.setattr(free_instants, "stretches_of", others)
    g = mbody.gradient(box("poisson", 0.5), "last(box.x)", ["box.mass"], analysis="simulate")
    assert np.isnan(g.jacobian).all()
    assert any("which contacts take part in the impact is not known" in note for note in g.notes)


# -- Contacts at their limits ------------------------------------------------------------------

DROP, RADIUS, INERTIA = 0.5, 0.1, 0.006


def skidding(mu, inertia=INERTIA, along=1.0):
    """A disc that strikes the floor while it moves along it."""
    ground = {"floor": {"line": {"point": "O"}}}
    machine = Mechanism("skids", ground={"O": (0.0, 0.0)}, ground_shapes=ground)
    shapes = {"s": {"disc": "C", "radius": RADIUS}}
    machine.add(
        Body("b", mass=1.0, inertia=inertia, points={"C": (0.0, 0.0)}, shapes=shapes),
        Contact("k", "ground.floor", "b.s", friction=mu, restitution=0.5, law="newton"),
        Gravity("g", y=-G),
    )
    start = {"x": 0.0, "y": RADIUS + DROP, "angle": 0.0, "vx": along, "vy": 0.0, "omega": 0.0}
    machine.simulation = SimulationSettings(0.5, {"b": start}, rtol=1e-12, instants=3)
    return machine


def test_a_contact_at_its_limit_has_derivatives_to_one_side():
    """With just as much friction as it takes to roll: differences to the side of those numbers with
    which it rolls are the derivative, those to the other side, where it slides on, are not.
    """
    # v/(1/m + r²/J) = μ m (1 + e) u
    mu = 1.0 / (1.0 + RADIUS**2 / INERTIA) / (1.5 * math.sqrt(2.0 * G * DROP))
    measures = ["last(b.vx)", "last(b.omega)"]
    names = ["k.friction", "b.inertia", "start.b.vx", "start.b.x"]
    g = mbody.gradient(skidding(mu), [*measures, "last(b.x)"], names, analysis="simulate")
    assert np.isfinite(g.jacobian).all()
    notes = " ".join(g.notes)
    assert "by 'k.friction' are those for greater numbers alone" in notes
    assert "by 'b.inertia', 'start.b.vx' are those for smaller numbers alone" in notes
    assert "start.b.x'" not in notes

    def last(*numbers):
        run = mbody.simulate(skidding(*numbers))
        return np.array([run["b"].vx[-1], run["b"].omega[-1]])

    h, at = 1e-5, np.array([mu, INERTIA, 1.0])
    here = last(*at)
    for k, side in enumerate([1.0, -1.0, -1.0]):
        step = side * h * at * (np.arange(3) == k)
        right = (4.0 * last(*(at + step)) - last(*(at + 2.0 * step)) - 3.0 * here) / 2.0
        wrong = here - last(*(at - step))
        right, wrong = right / step[k], wrong / step[k]
        size = np.abs([right, wrong]).max()
        assert np.abs(g.jacobian[:2, k] - right).max() < 1e-5 * size
        assert np.abs(g.jacobian[:2, k] - wrong).max() > 0.1 * size


def test_what_rests_at_its_limit_has_derivatives_to_one_side():
    """A block that as much friction holds as pulls at it: less lets it slide."""

    def resting(friction=0.3, pull=0.3 * G):
        machine = Mechanism("rests", ground={"O": (0.0, 0.0)})
        machine.add(
            Body("b", mass=2.0, inertia=1.0, points={"C": (0.0, 0.0)}),
            Prismatic("k", "ground.O", "b.C", friction=friction),
            Gravity("g", x=pull, y=-G),
        )
        machine.simulation = SimulationSettings(0.5, {"b": {"x": 0.0, "vx": 0.0}}, instants=3)
        return machine

    names = ["k.friction", "g.x", "b.mass"]
    g = mbody.gradient(resting(), "last(b.x)", names, analysis="simulate")
    assert not g.jacobian.any()
    notes = " ".join(g.notes)
    assert "by 'k.friction' are those for greater numbers alone" in notes
    assert "by 'g.x' are those for smaller numbers alone" in notes and "b.mass" not in notes
    # below it: x = (p − μ g) t²/2
    h = 1e-4
    slid = [mbody.simulate(one)["b"].x[-1] for one in (resting(0.3 - h), resting(0.3 + h))]
    assert slid == pytest.approx([0.5 * h * G * 0.25, 0.0], abs=1e-12)
    free = mbody.gradient(resting(0.31), "last(b.x)", names, analysis="simulate")
    assert not any("numbers alone" in note for note in free.notes)


# -- Forces that no equation decides -----------------------------------------------------------


@pytest.mark.parametrize(("force", "until"), [("60 N + 40 N/s*t", 1.75), ("60 N - 40 N/s*t", 1.35)])
def test_what_two_contacts_hold_begins_to_slide(force, until):
    """A ladder that sticks at both ends slides where the greatest margin of its forces is zero."""
    text = models.LADDER[: models.LADDER.index("[simulate]")]
    machine = mbody.from_toml(text.replace("mass = 1", "mass = 20"))
    machine.add(Force("hold", "ladder.A", force, angle=math.pi))
    start = {"x": math.cos(1.0), "y": math.sin(1.0), "angle": math.pi - 1.0}
    machine.simulation = SimulationSettings(until, {"ladder": start}, instants=3)
    names = ["foot.friction", "top.friction", "ladder.mass"]
    measures = ["last(ladder.angle)", "last(ladder.omega)"]
    g = check_beside_differences(machine, measures, names)
    system, h = mbody.assemble(machine), 1e-6
    for k in range(2):
        (slips,) = (one for one in g.events if one.name == "slip" and one.contact == names[k][:-9])
        near = float(system.values[names[k]])
        ends = [
            mbody.simulate(system.with_values({names[k]: near + n * h}), rtol=1e-12).events[0].t
            for n in (-1, 1)
        ]
        assert slips.by[names[k]] == pytest.approx((ends[1] - ends[0]) / (2.0 * h), rel=1e-6)


@pytest.mark.parametrize("seed", [3, 15])
def test_pins_that_stick_begin_to_slide(seed):
    """Of four rough pins, whose limits bend; stick and slip of some of them before and after."""
    machine, _ = four_bar(seed)
    machine.add(Torque("push", "crank", value="60 N*m*(t - 1.5 s)/(1 s)"))
    start = mbody.simulate(machine, 1.5, instants=2)
    how = {"until": 2.2, "start": start, "instants": 3}
    names = ["coupler.mass", "O.friction", "A.pin_radius"]
    measures = ["last(crank.angle)", "last(crank.omega)"]
    g = check_beside_differences(machine, measures, names, **how)
    times = [one.t for one in g.events if one.name == "slip"]
    assert any(times.count(t) == 4 for t in times)


# -- Painlevé, drivers that jerk, ends of arcs -------------------------------------------------


def table(speed, until):
    """A slab that is jerked upwards, or to the side, under a box."""
    machine = Mechanism("table", ground={"O": (0.0, 0.0)})
    points = {"a": (-0.3, -0.2), "b": (0.3, -0.2), "c": (0.3, 0.2), "d": (-0.3, 0.2)}
    upwards = Marker("ground", (0.0, 0.0), 0.5 * math.pi if speed > 0.0 else 0.0)
    law = Table((0.0, 0.4, 1.5), (0.0, 0.2, 0.2 + 1.1 * speed), interpolation="linear")
    slab = {"top": {"line": {"point": "T"}}}
    machine.add(
        Body("slab", mass=2.0, inertia=1.0, points={"T": (0.0, 0.0)}, shapes=slab),
        Prismatic("track", upwards, Marker("slab", (0.0, 0.0), upwards.angle)),
        CoordinateDriver("motor", upwards, "slab", law),
        Body("b", mass=1.0, inertia=0.1, points=points, shapes={"s": {"polygon": list("abcd")}}),
        Contact("k", "slab.top", "b.s", friction=0.3, restitution=0.3),
        Gravity("g", y=-G),
    )
    start = {"x": 0.0, "y": 0.2, "angle": 0.0, "vx": 0.8, "vy": 0.5 * (speed > 0.0), "omega": 0.0}
    machine.simulation = SimulationSettings(until, {"b": start}, instants=5)
    return machine


@pytest.mark.parametrize(("speed", "names"), [(1.0, ["k.friction", "g.y"]), (-0.6, ["k.friction"])])
def test_a_driver_that_jerks_what_touches(speed, names):
    """Thrown up by it; or left to slide."""
    check_beside_differences(table(speed, 0.45), ["last(b.x)", "last(b.vx)"], names)


def test_a_disc_that_slides_off_an_arc():
    """The end of an arc: when it is passed, and where the disc falls to."""
    ground = {"disc": "O", "radius": 1.0, "begin": math.pi / 3.0, "end": 2.0 * math.pi / 3.0}
    machine = Mechanism("arc", ground={"O": (0.0, 0.0)}, ground_shapes={"hill": ground})
    shapes = {"r": {"disc": "C", "radius": 0.2}}
    machine.add(
        Body("d", mass=1.0, inertia=0.02, points={"C": (0.0, 0.0)}, shapes=shapes),
        Contact("k", "ground.hill", "d.r", friction=0.05),
        Gravity("g", y=-G),
    )
    c, s = math.cos(0.2), math.sin(0.2)
    start = {"x": 1.2 * s, "y": 1.2 * c, "angle": 0.0, "vx": 0.6 * c, "vy": -0.6 * s, "omega": 0.0}
    machine.simulation = SimulationSettings(0.9, {"d": start}, instants=3)
    g = check_beside_differences(machine, ["last(d.x)", "last(d.y)"], ["k.friction", "g.y"])
    (end,) = g.events
    assert end.name == "open"
    system, h = mbody.assemble(machine), 1e-5
    ends = [
        mbody.simulate(system.with_values({"g.y": -G + n * h}), rtol=1e-12).events[0].t
        for n in (-1, 1)
    ]
    assert end.by["g.y"] == pytest.approx((ends[1] - ends[0]) / (2.0 * h), rel=1e-6)


# -- Friction of joints at impacts -------------------------------------------------------------


@pytest.mark.parametrize("law", ["poisson", "newton"])
def test_friction_in_a_pin_that_lands(law):
    """By ρ m Δv/J, of which complex steps give the derivatives."""
    machine = rotor(1.0, 1.0, law=law)
    names = ["pin.friction", "rotor.mass", "rotor.inertia", "hit.restitution", "gravity.y"]

    def after(friction, mass, inertia, restitution, pull):
        rho = 0.04 * friction / np.sqrt(1.0 + friction**2)
        change = (1.0 + restitution) * np.sqrt(-2.0 * pull)
        return 40.0 - rho * mass * change / inertia

    g = mbody.gradient(machine, ["last(rotor.omega)"], names, analysis="simulate", rtol=1e-12)
    numbers = np.array([0.5, 2.0, 0.05, 0.5, -G])
    steps = numbers + 1e-30j * np.eye(5)
    expected = [after(*one).imag / 1e-30 for one in steps]
    assert g.jacobian[0] == pytest.approx(expected, rel=1e-8)


def repeated(machine, *joints, extra=()):
    """The machine with more joints, and its start as a result, as redundant rows ask for."""
    how = machine.simulation
    machine.add(*extra, *joints)
    start = mbody.simulate(machine, 1e-3, instants=2)
    return machine, {"until": how.until, "instants": 2, "start": start}


@pytest.mark.parametrize("which", ["guide", "wheel"])
def test_friction_by_forces_that_redundant_rows_leave_alone(which):
    """A guide twice, and a wheel beside it on two pins, leave the rotor's pin its impulse."""
    up, at = math.pi / 2.0, Marker("ground", (5.0, 0.0))
    machine = rotor(1.0, 1.0)
    if which == "guide":
        ends = (Marker("ground", (0.0, 0.0), up), Marker("carrier", (0.0, 0.0), up))
        machine, how = repeated(machine, Prismatic("guide 2", *ends))
    else:
        wheel = Body("wheel", mass=1.0, inertia=1.0, points={"C": (0.0, 0.0)})
        pins = [Revolute(name, at, "wheel.C") for name in ("first", "second")]
        machine, how = repeated(machine, *pins, extra=[wheel])
    names = ["pin.friction", "rotor.mass", "hit.restitution"]
    check_beside_differences(machine, ["last(rotor.omega)"], names, **how)


@pytest.mark.parametrize("friction", [0.0, 0.2])
def test_friction_by_forces_that_redundant_rows_share_has_none(friction, monkeypatch):
    """Of two pins at one place, where a pendulum swings, and at an impact."""
    twin = {"friction": friction, "pin_radius": 0.02} if friction else {}
    swing = Mechanism("swing", ground={"O": (0.0, 0.0)})
    swing.add(
        Body("rod", mass=2.0, inertia=0.3, points={"O": (-0.8, 0.0)}),
        Revolute("pin", "ground.O", "rod.O", friction=0.3, pin_radius=0.05),
        Gravity("gravity", y=-G),
    )
    swing.simulation = SimulationSettings(0.2, {"rod": {"angle": 0.0, "omega": 1.0}})
    swing, how = repeated(swing, Revolute("pin 2", "ground.O", "rod.O", **twin))
    g = mbody.gradient(swing, "last(rod.omega)", ["rod.mass"], analysis="simulate", **how)
    assert np.isnan(g.jacobian).all()
    assert any("no equation decides the forces of redundant joints" in note for note in g.notes)
    # at an impact by itself, as of a pin that did not slide before
    monkeypatch.setattr(free_instants, "slides_by_open_forces", lambda *_: False)
    machine, how = repeated(rotor(1.0, 1.0), Revolute("pin 2", "carrier.P", "rotor.P", **twin))
    g = mbody.gradient(machine, "last(rotor.omega)", ["rotor.mass"], analysis="simulate", **how)
    assert np.isnan(g.jacobian).all()
    assert any("no equation decides the impulses" in note for note in g.notes)
