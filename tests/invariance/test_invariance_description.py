"""What must not matter does not: names, order, sides, axes of links, idle bodies."""

import dataclasses
import math

import numpy as np
import pytest
from hypothesis import given, settings
from numpy.testing import assert_allclose

from mbody import (
    AngleDriver,
    Body,
    CoordinateDriver,
    Distance,
    DistanceDriver,
    Fixed,
    Mechanism,
    Revolute,
    kinetostatics,
    makers,
    statics,
)
from mbody.laws import Polynomial
from mbody.model.body import Guess
from mbody.model.element import Marker, Polar
from mbody.model.joints import Joint
from mbody.model.loads import TorsionSpring
from tests.support.invariance import (
    LINKAGES,
    SAME,
    answers,
    assert_same,
    changed,
    lightly,
    linkages,
    numbered,
    original,
    pair,
    rebuilt,
    rotation,
    seeds,
    shifted,
)
from tests.support.linkages import random_linkage, times_within


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
        # slides give their torque at the place on j, which is another one now
        whole = about_origin(run, joint, joint.j.body)
        other = about_origin(mine, mine.mechanism[joint.name], joint.j.body)
        assert_allclose(other, whole, rtol=0, atol=SAME * max(top, np.abs(whole).max()))
    assert_allclose(
        mine.effort("motor"), run.effort("motor"), rtol=0,
        atol=SAME * max(np.abs(part).max() for part in wanted["torque"].values()),
    )  # fmt: skip


@pytest.mark.parametrize("swapped", [False, True])
def test_drivers_of_lengths_swapped(swapped):
    """A cylinder has no first end; a ram measured from the slider runs backwards."""
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
    """{body: (x, y, angle)} of its new axes in its old ones: all that is said in them is said
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
