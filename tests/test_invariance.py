"""What must not matter does not: frames, handedness, units, names, order, sides, axes, idle bodies.

Every number of a description is rounded anew by such a change, by 1e-16 of itself, and Newton's
last correction, up to 1e-12 of the coordinates, falls elsewhere. The linkages magnify either by
some tens to some hundreds in accelerations and forces: 1e-9 of the greatest number of its sort.
"""

import dataclasses
import functools
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from mbody import (
    AngleDriver,
    Body,
    CoordinateDriver,
    Distance,
    DistanceDriver,
    Fixed,
    Force,
    Gravity,
    Mechanism,
    Revolute,
    Torque,
    kinetostatics,
    statics,
)
from mbody.laws import Harmonic, Polynomial
from mbody.makers import makers
from mbody.model.body import Guess
from mbody.model.element import Marker, Polar
from mbody.model.joints import Joint
from mbody.model.loads import Damper, Spring, TorsionDamper, TorsionSpring
from tests.linkages import random_linkage, times_within

LINKAGES = [
    (2, 3, ()),
    (0, 3, ("sliders",)),
    (1, 3, ("extras",)),
    (0, 3, ("sliders", "extras")),
    (1, 4, ("sliders",)),
]
INSTANTS = 6
SAME = 1e-9

linkages = st.sampled_from(LINKAGES)
seeds = st.integers(0, 10**6)
angles = st.floats(-math.pi, math.pi)
sizes = st.floats(-3.0, 3.0)
lightly = settings(max_examples=8)


@functools.cache
def original(linkage):
    """(mechanism, times, its run, its run at rest)."""
    seed, loops, kind = linkage
    machine, turn = random_linkage(seed, loops, **dict.fromkeys(kind, True))
    t = times_within(machine, turn, INSTANTS)
    return machine, t, kinetostatics(machine, t), statics(machine, t)


# -- answers by name, and how they change -----------------------------------------------------


def answers(run, names=lambda name: name):
    """{sort: {what: (instants,) or (instants, 2)}} of a run, names as the original has them."""
    found = {sort: {} for sort in ("place", "turn", "v", "w", "a", "alpha", "force", "torque")}
    for body in run:
        h, name = run[body], names(body)
        found["place"][name] = np.column_stack([h.x, h.y])
        found["v"][name] = np.column_stack([h.vx, h.vy])
        found["a"][name] = np.column_stack([h.ax, h.ay])
        found["turn"][name], found["w"][name], found["alpha"][name] = h.angle, h.omega, h.alpha
    for joint in run.mechanism.joints:
        part = run.reaction(joint.name)
        found["force"][names(joint.name)] = np.column_stack([part.fx, part.fy])
        found["torque"][names(joint.name)] = part.torque
    for driver in run.mechanism.drivers:
        found["torque"][names(driver.name)] = run.effort(driver.name)
    return found


def assert_same(found, wanted):
    for sort, parts in wanted.items():
        assert found[sort].keys() == parts.keys()
        top = max(np.abs(part).max() for part in parts.values())
        for name, part in parts.items():
            mine = found[sort][name]
            assert_allclose(mine, part, rtol=0, atol=SAME * top, err_msg=f"{sort} of {name}")


def rebuilt(machine, elements, **changes):
    """A mechanism of these elements."""
    more = {"units": machine.units, "g": machine.g, "ground": machine.ground.points} | changes
    copy = Mechanism(machine.name, **more)
    copy.add(*elements)
    return copy


def changed(element, marker):
    """A copy of an element with another marker for each of its own."""
    places = {key: marker(m) for key, m in element.places().items()}
    return dataclasses.replace(element, **places)


def pair(point):
    if isinstance(point, Polar):
        return np.array([point.r * math.cos(point.angle), point.r * math.sin(point.angle)])
    return np.array(point, dtype=float)


def rotation(angle):
    c, s = math.cos(angle), math.sin(angle)
    return np.array([[c, -s], [s, c]])


def numbered(law, change):
    """The same law with other numbers: change(name, number)."""
    return law.with_numbers({k: change(k, x) for k, x in law.numbers().items()})


def shifted(law, by):
    first = (
        "c0" if isinstance(law, Polynomial) else "mean" if isinstance(law, Harmonic) else "value"
    )
    return numbered(law, lambda name, x: x + by if name == first else x)


# -- another frame of the world ---------------------------------------------------------------


def moved(machine, turn, shift):
    """The whole machine turned about the world's origin, then shifted."""
    R = rotation(turn)

    def place(point):
        return tuple((R @ pair(point) + shift).tolist())

    def marker(m):
        if m.body != "ground":
            return m
        point = m.point if isinstance(m.point, str) else place(m.point)
        return Marker("ground", point, m.angle + turn)

    def fields(e):
        if isinstance(e, Body):
            x, y = place((e.guess.x, e.guess.y))
            return {"guess": Guess(angle=e.guess.angle + turn, x=x, y=y)}
        if isinstance(e, AngleDriver):
            return {"law": shifted(e.law, turn)} if e.relative_to == "ground" else {}
        if isinstance(e, TorsionSpring):
            sign = {"ground": -1.0}.get(e.body, 0.0) + {"ground": 1.0}.get(e.by, 0.0)
            return {"free_angle": e.free_angle + sign * turn}
        if isinstance(e, Force):
            return {} if e.follows else {"angle": e.angle + turn}
        if isinstance(e, Gravity):
            x, y = R @ [e.x.value, e.y.value]
            return {"x": float(x), "y": float(y)}
        return {}

    elements = [dataclasses.replace(changed(e, marker), **fields(e)) for e in machine]
    ground = {name: place(point) for name, point in machine.ground.points.items()}
    return rebuilt(machine, elements, ground=ground)


@given(linkages, angles, sizes, sizes)
@lightly
def test_rotated_and_translated(linkage, turn, dx, dy):
    machine, t, run, rest = original(linkage)
    R, shift = rotation(turn), np.array([dx, dy])
    other = moved(machine, turn, shift)
    for mine, its in ((kinetostatics(other, t), run), (statics(other, t), rest)):
        wanted = answers(its)
        for sort in ("place", "v", "a", "force"):
            wanted[sort] = {name: part @ R.T for name, part in wanted[sort].items()}
        wanted["place"] = {name: part + shift for name, part in wanted["place"].items()}
        wanted["turn"] = {name: part + turn for name, part in wanted["turn"].items()}
        assert_same(answers(mine), wanted)


# -- seen in a mirror -------------------------------------------------------------------------


def mirrored(machine):
    """y to −y: angles, torques and all that turns change their sign."""

    def point(p):
        return Polar(p.r, -p.angle) if isinstance(p, Polar) else (p[0], -p[1])

    def marker(m):
        return Marker(m.body, m.point if isinstance(m.point, str) else point(m.point), -m.angle)

    def negative(law):
        return numbered(law, lambda name, x: -x)

    def odd(law):
        """T(x) to −T(−x)."""
        return numbered(law, lambda name, x: x if int(name[1:]) % 2 else -x)

    def fields(e):
        if isinstance(e, Body):
            return {
                "cg": point(e.cg),
                "points": {name: point(p) for name, p in e.points.items()},
                "guess": Guess(angle=-e.guess.angle, x=e.guess.x, y=-e.guess.y),
            }
        if isinstance(e, AngleDriver):
            return {"law": negative(e.law)}
        if isinstance(e, Torque):
            return {"value": negative(e.value)}
        if isinstance(e, TorsionSpring) and e.law is None:
            return {"free_angle": -e.free_angle, "preload": -e.preload}
        if isinstance(e, TorsionSpring):
            return {"free_angle": -e.free_angle, "law": odd(e.law)}
        if isinstance(e, TorsionDamper) and e.law is not None:
            return {"law": odd(e.law)}
        if isinstance(e, Force):
            return {"angle": -e.angle}
        if isinstance(e, Gravity):
            return {"y": -e.y.value}
        return {}

    elements = [dataclasses.replace(changed(e, marker), **fields(e)) for e in machine]
    ground = {name: point(p) for name, p in machine.ground.points.items()}
    return rebuilt(machine, elements, ground=ground)


@pytest.mark.parametrize("linkage", LINKAGES)
def test_mirrored(linkage):
    machine, t, run, rest = original(linkage)
    other = mirrored(machine)
    for mine, its in ((kinetostatics(other, t), run), (statics(other, t), rest)):
        wanted = answers(its)
        for sort, parts in wanted.items():
            flip = np.array([1.0, -1.0]) if sort in ("place", "v", "a", "force") else -1.0
            wanted[sort] = {name: part * flip for name, part in parts.items()}
        assert_same(answers(mine), wanted)


# -- in other units ---------------------------------------------------------------------------


def in_units(machine, units, length, force, time):
    """Numbers multiplied into other units: so many of the new ones make one of the old."""
    mass = force * time**2 / length

    def point(p):
        if isinstance(p, Polar):
            return Polar(length * p.r, p.angle)
        return (length * p[0], length * p[1])

    def marker(m):
        return Marker(m.body, m.point if isinstance(m.point, str) else point(m.point), m.angle)

    def law(given, value, argument):
        """f(x) in units of `value`, x in units of `argument`."""
        power = {"value": 0, "speed": 1, "acceleration": 2, "mean": 0, "amplitude": 0}

        def scaled(name, x):
            if name == "frequency":
                return x / argument
            if name == "phase":
                return x
            order = power.get(name)
            return x * value / argument ** (int(name[1:]) if order is None else order)

        return numbered(given, scaled)

    torque, speed = force * length, length / time

    def fields(e):
        if isinstance(e, Body):
            return {
                "cg": point(e.cg),
                "points": {name: point(p) for name, p in e.points.items()},
                "guess": Guess(e.guess.angle, length * e.guess.x, length * e.guess.y),
                "mass": None if e.mass is None else mass * e.mass,
                "weight": None if e.weight is None else force * e.weight,
                "inertia": mass * length**2 * e.inertia,
            }
        if isinstance(e, Distance):
            return {"length": length * e.length.value}
        if isinstance(e, AngleDriver):
            return {"law": law(e.law, 1.0, time)}
        if isinstance(e, Force):
            return {"value": law(e.value, force, time)}
        if isinstance(e, Torque):
            return {"value": law(e.value, torque, time)}
        if isinstance(e, Gravity):
            factor = length / time**2
            return {"x": factor * e.x.value, "y": factor * e.y.value}
        if isinstance(e, Spring):
            common = {"free_length": length * e.free_length, "preload": force * e.preload}
            if e.law is not None:
                return common | {"law": law(e.law, force, length)}
            return common | {"stiffness": force / length * e.stiffness}
        if isinstance(e, Damper):
            if e.law is not None:
                return {"law": law(e.law, force, speed)}
            return {"coefficient": force / speed * e.coefficient}
        if isinstance(e, TorsionSpring):
            if e.law is not None:
                return {"law": law(e.law, torque, 1.0)}
            return {"stiffness": torque * e.stiffness, "preload": torque * e.preload}
        if isinstance(e, TorsionDamper):
            if e.law is not None:
                return {"law": law(e.law, torque, 1.0 / time)}
            return {"coefficient": torque * time * e.coefficient}
        return {}

    elements = [dataclasses.replace(changed(e, marker), **fields(e)) for e in machine]
    ground = {name: point(p) for name, p in machine.ground.points.items()}
    return rebuilt(machine, elements, ground=ground, units=units, g=length / time**2 * machine.g)


UNITS = {
    "mm-N-s": (1e3, 1.0, 1.0),
    "in-lbf-s": (1.0 / 0.0254, 1.0 / 4.4482216152605, 1.0),
    "ft-lbf-s": (1.0 / 0.3048, 1.0 / 4.4482216152605, 1.0),
    "SI": (1e-4, 3e5, 60.0),  # no system that has a name: the equations do not care
}


@pytest.mark.parametrize("units", UNITS)
@pytest.mark.parametrize("linkage", LINKAGES[::2])
def test_in_other_units(linkage, units):
    length, force, time = UNITS[units]
    machine, t, run, rest = original(linkage)
    other = in_units(machine, units, length, force, time)
    scale = {"place": length, "turn": 1.0, "v": length / time, "w": 1.0 / time, "force": force}
    scale |= {"a": length / time**2, "alpha": 1.0 / time**2, "torque": force * length}
    for mine, its in ((kinetostatics(other, time * t), run), (statics(other, time * t), rest)):
        wanted = {
            sort: {name: scale[sort] * part for name, part in parts.items()}
            for sort, parts in answers(its).items()
        }
        assert_same(answers(mine), wanted)
        assert mine.checks.constraint < 1e-13 and mine.checks.equilibrium < 1e-11


def test_the_names_of_units_are_those_of_their_numbers():
    """Standard gravity in every system is the same acceleration."""
    for units, (length, _, time) in UNITS.items():
        if units != "SI":
            assert math.isclose(Mechanism(units=units).g, 9.80665 * length / time**2)


# -- other names, another order, other sides --------------------------------------------------


@given(linkages, seeds)
@lightly
def test_relabelled_and_reordered(linkage, seed):
    machine, t, run, _ = original(linkage)
    rng = np.random.default_rng(seed)
    old = [e.name for e in machine]
    names = {"ground": "ground"} | {
        name: f"N{k}" for name, k in zip(old, rng.permutation(len(old)))
    }

    def marker(m):
        return Marker(
            names[m.body], f"_{m.point}" if isinstance(m.point, str) else m.point, m.angle
        )

    def named(e):
        more = {}
        if isinstance(e, Body):
            points = list(e.points.items())
            more["points"] = {
                f"_{points[k][0]}": points[k][1] for k in rng.permutation(len(points))
            }
        for field in ("body", "by", "relative_to"):
            if isinstance(getattr(e, field, None), str):
                more[field] = names[getattr(e, field)]
        return dataclasses.replace(changed(e, marker), name=names[e.name], **more)

    bodies = [named(e) for e in machine.bodies]
    others = [named(e) for e in machine if not isinstance(e, Body)]
    rng.shuffle(bodies)
    rng.shuffle(others)
    ground = {f"_{name}": point for name, point in machine.ground.points.items()}
    other = rebuilt(machine, bodies + others, ground=ground)
    back = {new: name for name, new in names.items()}
    mine = kinetostatics(other, t)
    assert_same(answers(mine, back.get), answers(run))
    for name, part in run.breakdown("motor").items():
        its = mine.breakdown(names["motor"])[names.get(name, name)]
        top = np.abs(run.effort("motor")).max()
        assert_allclose(its, part, rtol=0, atol=SAME * max(top, np.abs(part).max()))


def about_origin(run, joint, on):
    """Force and torque about the world's origin on that body."""
    part = run.reaction(joint.name, on=on)
    at = run.point(joint.j)
    return np.column_stack([part.fx, part.fy, part.torque + at.x * part.fy - at.y * part.fx])


@given(linkages, seeds)
@lightly
def test_sides_swapped(linkage, seed):
    """Each joint's reaction on a body is what it was; by default it is that on the other one."""
    machine, t, run, _ = original(linkage)
    rng = np.random.default_rng(seed)
    swap = {e.name for e in machine if "i" in e.places() and rng.random() < 0.6}
    elements = [dataclasses.replace(e, i=e.j, j=e.i) if e.name in swap else e for e in machine]
    mine = kinetostatics(rebuilt(machine, elements), t)
    wanted, found = answers(run), answers(mine)
    for sort in ("place", "turn", "v", "w", "a", "alpha"):
        assert_same({sort: found[sort]}, {sort: wanted[sort]})
    top = max(np.abs(part).max() for part in wanted["force"].values())
    for joint in machine.joints:
        swapped = joint.name in swap
        assert mine.reaction(joint.name).on == (joint.i.body if swapped else joint.j.body)
        sign = -1.0 if swapped else 1.0
        assert_allclose(
            found["force"][joint.name], sign * wanted["force"][joint.name], rtol=0, atol=SAME * top
        )
        # slides tell their torque at the place on j, which is another one now
        whole = about_origin(run, joint, joint.j.body)
        other = about_origin(mine, mine.mechanism[joint.name], joint.j.body)
        assert_allclose(other, whole, rtol=0, atol=SAME * max(top, np.abs(whole).max()))
    assert_allclose(
        mine.effort("motor"), run.effort("motor"), rtol=0,
        atol=SAME * max(np.abs(part).max() for part in wanted["torque"].values()),
    )  # fmt: skip


@pytest.mark.parametrize("swapped", [False, True])
def test_drivers_of_lengths_swapped(swapped):
    """A cylinder does not ask which end is which; a ram measured from the slider runs backwards."""
    made = makers.slider_crank(1.0, 3.0, masses=(1.0, 2.0, 3.0))
    bodies = [e for e in made if e.name != "motor"]
    law = Polynomial([3.5, -1.0, 0.2])
    ram = CoordinateDriver("ram", "ground.O", "slider.B", law)
    rod = DistanceDriver("ram", "ground.O", "slider.B", law)
    if swapped:
        back = numbered(law, lambda name, x: -x)
        ram, rod = (
            CoordinateDriver("ram", "slider.B", "ground.O", back),
            DistanceDriver("ram", "slider.B", "ground.O", law),
        )
    t = np.linspace(0.0, 0.8, 5)
    plain = kinetostatics(
        rebuilt(made, [*bodies, CoordinateDriver("ram", "ground.O", "slider.B", law)]), t
    )
    for driver, sign in ((ram, -1.0 if swapped else 1.0), (rod, 1.0)):
        mine = kinetostatics(rebuilt(made, [*bodies, driver]), t)
        assert_allclose(mine.effort("ram"), sign * plain.effort("ram"), rtol=SAME)
        assert_allclose(mine["crank"].alpha, plain["crank"].alpha, rtol=SAME)


# -- other link axes --------------------------------------------------------------------------


def with_axes(machine, axes):
    """{body: (x, y, angle)} of its new axes in its old ones: all that is told in them is told
    anew."""

    def point(body, p):
        x, y, angle = axes[body]
        return tuple((rotation(-angle) @ (pair(p) - [x, y])).tolist())

    def marker(m):
        if m.body not in axes:
            return m
        place = m.point if isinstance(m.point, str) else point(m.body, m.point)
        return Marker(m.body, place, m.angle - axes[m.body][2])

    def turn(body):
        return axes[body][2] if body in axes else 0.0

    def fields(e):
        if isinstance(e, Body) and e.name in axes:
            x, y, angle = axes[e.name]
            at = np.array([e.guess.x, e.guess.y]) + rotation(e.guess.angle) @ [x, y]
            return {
                "cg": point(e.name, e.cg),
                "points": {name: point(e.name, p) for name, p in e.points.items()},
                "guess": Guess(e.guess.angle + angle, *at.tolist()),
            }
        if isinstance(e, AngleDriver):
            return {"law": shifted(e.law, turn(e.body) - turn(e.relative_to))}
        if isinstance(e, TorsionSpring):
            return {"free_angle": e.free_angle + turn(e.body) - turn(e.by)}
        return {}

    return rebuilt(machine, [dataclasses.replace(changed(e, marker), **fields(e)) for e in machine])


@given(linkages, seeds)
@lightly
def test_link_axes_redefined(linkage, seed):
    machine, t, run, rest = original(linkage)
    rng = np.random.default_rng(seed)
    axes = {
        body.name: (*rng.uniform(-1.0, 1.0, 2).tolist(), float(rng.uniform(-3.0, 3.0)))
        for body in machine.bodies
        if rng.random() < 0.6
    }
    other = with_axes(machine, axes)
    for mine, its in ((kinetostatics(other, t), run), (statics(other, t), rest)):
        wanted = answers(its)
        for name, (_, _, angle) in axes.items():
            wanted["turn"][name] = wanted["turn"][name] + angle
        assert_same(answers(mine), wanted)


# -- idle bodies ------------------------------------------------------------------------------


@given(linkages, seeds)
@lightly
def test_an_idle_body_without_mass(linkage, seed):
    """Welded on, or hung from a link by a pin and from the ground by a rod: nothing feels it."""
    machine, t, run, rest = original(linkage)
    rng = np.random.default_rng(seed)
    host = machine.bodies[rng.integers(len(machine.bodies))]
    pin = host.at(-0.2, 0.3)
    # links stay within 3 of the origin: a bar of 5 and a rod of 6 from there are never stretched
    far = np.array([7.0, 0.0])
    at = run.point(pin)
    dx, dy = far - [at.x[0], at.y[0]]
    d = math.hypot(dx, dy)
    angle = math.atan2(dy, dx) + math.acos((25.0 + d * d - 36.0) / (10.0 * d))
    idle = [
        Body("idle", cg=tuple(rng.uniform(-1.0, 1.0, 2).tolist())),
        Fixed("idle weld", host.at(0.1, 0.2, angle=0.3), "idle"),
        Body("hung", cg=(0.3, 0.1), points={"end": (5.0, 0.0)}, guess=round(angle, 2)),
        Revolute("idle pin", pin, "hung"),
        Distance("idle rod", "hung.end", Marker("ground", tuple(far.tolist())), length=6.0),
    ]
    other = rebuilt(machine, [*machine, *idle])
    extra = {"idle", "hung", "idle weld", "idle pin", "idle rod"}
    for mine, its in ((kinetostatics(other, t), run), (statics(other, t), rest)):
        found, wanted = answers(mine), answers(its)
        tops = {
            sort: max(np.abs(p).max() for p in parts.values()) for sort, parts in wanted.items()
        }
        for sort in ("force", "torque"):
            for name in extra & found[sort].keys():
                assert np.abs(found[sort][name]).max() <= SAME * tops[sort], name
        kept = {
            sort: {name: part for name, part in parts.items() if name not in extra}
            for sort, parts in found.items()
        }
        assert_same(kept, wanted)


def test_joints_are_all_changed():
    """The linkages have every kind of joint and of load, so that nothing above is idle."""
    kinds = set()
    for linkage in LINKAGES:
        machine = original(linkage)[0]
        kinds |= {type(e) for e in (*machine.joints, *machine.loads)}
    assert len({k for k in kinds if issubclass(k, Joint)}) == 4 and len(kinds) == 4 + 7


def in_polar(marker):
    """A marker with its coordinates, if it has any, as distance and angle."""
    if isinstance(marker.point, (str, Polar)):
        return marker
    x, y = marker.point
    return dataclasses.replace(marker, point=Polar(math.hypot(x, y), math.atan2(y, x)))


@given(linkages)
@settings(max_examples=8)
def test_places_by_distance_and_angle(linkage):
    """A place in polar coordinates beside the marker's own direction, of joints and of loads."""
    machine, turn = random_linkage(*linkage[:2], sliders=True, extras=True)
    other = Mechanism(machine.name, ground=machine.ground.points, g=machine.g)
    for element in machine:
        places = {key: in_polar(marker) for key, marker in element.places().items()}
        other.add(dataclasses.replace(element, **places))
    assert any(isinstance(p.point, Polar) for e in other for p in e.places().values())
    t = times_within(machine, 0.5 * turn, 3)
    a, b = kinetostatics(machine, t=t), kinetostatics(other, t=t)
    peak = max(a.reaction(joint.name).magnitude.max() for joint in machine.joints)
    assert_allclose(b.effort("motor"), a.effort("motor"), atol=1e-9 * peak)
    for joint in machine.joints:
        for key in ("fx", "fy", "torque"):
            one, two = (getattr(run.reaction(joint.name), key) for run in (a, b))
            assert_allclose(two, one, atol=1e-9 * peak)
