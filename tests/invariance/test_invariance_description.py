"""What must not matter does not: names, order, sides, axes of links, idle bodies."""

import dataclasses
import math

import numpy as np
from hypothesis import given, settings
from numpy.testing import assert_allclose

import mbody
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
    original,
    pair,
    rebuilt,
    rotation,
    seeds,
    shifted,
)
from tests.support.linkages import random_linkage, times_within

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
        if isinstance(e, mbody.Body) and e.name in axes:
            x, y, angle = axes[e.name]
            at = np.array([e.guess.x, e.guess.y]) + rotation(e.guess.angle) @ [x, y]
            return {
                "cg": point(e.name, e.cg),
                "points": {name: point(e.name, p) for name, p in e.points.items()},
                "guess": Guess(e.guess.angle + angle, *at.tolist()),
            }
        if isinstance(e, mbody.AngleDriver):
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
    for mine, its in ((mbody.kinetostatics(other, t), run), (mbody.statics(other, t), rest)):
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
        mbody.Body("idle", cg=tuple(rng.uniform(-1.0, 1.0, 2).tolist())),
        mbody.Fixed("idle weld", host.at(0.1, 0.2, angle=0.3), "idle"),
        mbody.Body("hung", cg=(0.3, 0.1), points={"end": (5.0, 0.0)}, guess=round(angle, 2)),
        mbody.Revolute("idle pin", pin, "hung"),
        mbody.Distance("idle rod", "hung.end", Marker("ground", tuple(far.tolist())), length=6.0),
    ]
    other = rebuilt(machine, [*machine, *idle])
    extra = {"idle", "hung", "idle weld", "idle pin", "idle rod"}
    for mine, its in ((mbody.kinetostatics(other, t), run), (mbody.statics(other, t), rest)):
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
    other = mbody.Mechanism(machine.name, ground=machine.ground.points, g=machine.g)
    for element in machine:
        places = {key: in_polar(marker) for key, marker in element.places().items()}
        other.add(dataclasses.replace(element, **places))
    assert any(isinstance(p.point, Polar) for e in other for p in e.places().values())
    t = times_within(machine, 0.5 * turn, 3)
    a, b = mbody.kinetostatics(machine, t=t), mbody.kinetostatics(other, t=t)
    peak = max(a.reaction(joint.name).magnitude.max() for joint in machine.joints)
    assert_allclose(b.effort("motor"), a.effort("motor"), atol=1e-9 * peak)
    for joint in machine.joints:
        for key in ("fx", "fy", "torque"):
            one, two = (getattr(run.reaction(joint.name), key) for run in (a, b))
            assert_allclose(two, one, atol=1e-9 * peak)
