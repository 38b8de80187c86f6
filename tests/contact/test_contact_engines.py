"""Motions with contacts against pymunk and MuJoCo, within the order of their steps."""

import importlib
import math

import pytest

import mbody
from mbody.engines.crosscheck import ENGINES
from mbody.laws import ConstantSpeed
from tests.contact.test_contact_oracle import CASES, thrown
from tests.support.cases import first_fast

FLOOR = {"floor": {"line": {"point": "O"}}}


def result_of(machine, engine, ours=None):
    pytest.importorskip(engine)
    run = mbody.simulate(machine) if ours is None else ours
    return importlib.import_module(ENGINES[engine]).crosscheck_result(mbody.assemble(machine), run)


def differing(result):
    return {row.quantity for row in result.rows if row.verdict != "agrees"}


def described(name):
    text, how = CASES[name]
    machine = mbody.from_toml(text.replace("ALPHA", "0"))
    if how:
        machine.simulation = mbody.SimulationSettings(rtol=1e-12, **how)
    return machine


@pytest.mark.parametrize("engine", ["pymunk", "mujoco"])
@first_fast("name", CASES, 1)
def test_reference_cases(engine, name):
    machine = described(name)
    found = result_of(machine, engine)
    assert found.rows and not differing(found), str(found)
    assert not found.not_expressible
    places = [row for row in found.rows if "modes" not in row.quantity]
    modes = [row for row in found.rows if "modes" in row.quantity]
    assert len(places) == 3 * len(machine.bodies)
    assert len(modes) == len(machine.contacts)
    # it says something: a part in a hundred of the motion would be found
    assert max(row.expected for row in places) < 0.05
    assert all(row.ours >= 5 for row in modes)


@pytest.mark.slow
def test_bodies_that_a_joint_ties_touch_in_pymunk():
    """A slider on an upright guide of the ground falls on the ground, and slides on it."""
    machine = mbody.Mechanism(
        "post",
        ground={"O": (0.0, 0.0), "F": (0.3, 0.0)},
        ground_shapes={"floor": {"line": {"point": "O"}}},
    )
    machine.add(
        mbody.Body("post", mass=1.0, inertia=0.05, points={"M": (0.0, 0.0), "foot": (0.2, -0.4)}),
        mbody.PinSlot("guide", mbody.Marker("ground", "O", 1.5), "post.M"),
        mbody.Contact("floor", "ground.floor", "post.foot", friction=0.3),
        mbody.Gravity("gravity", y=-9.81),
    )
    machine.simulation = mbody.SimulationSettings(
        until=0.3, rtol=1e-12, start={"post": {"x": 0.45 / math.tan(1.5), "y": 0.45, "angle": 0.05}}
    )
    found = result_of(machine, "pymunk")
    assert found.rows and not differing(found), str(found)
    assert any(row.quantity == "floor: modes alike" and row.ours >= 5 for row in found.rows)


@pytest.mark.parametrize("seed", [0, 1, 2, 6])
def test_random_motions_by_pymunk(seed):
    """Discs, a rope and a box, static coefficients above kinetic ones, rebounds."""
    found = result_of(thrown(seed), "pymunk")
    assert found.rows and not differing(found), str(found)


def falling(friction=0.3):
    """A four-bar whose coupler strikes a floor, in inches and pounds."""
    machine = mbody.Mechanism(
        "falling four-bar",
        units="in-lbf-s",
        ground={"O": (0, -6), "P": (0, 0), "Q": (20, 0)},
        ground_shapes=FLOOR,
    )
    bar = {"mass": 0.02, "inertia": 0.3}
    machine.add(
        mbody.Body("crank", cg=(4, 0), points={"P": (0, 0), "A": (8, 0)}, guess="10 deg", **bar),
        mbody.Body(
            "coupler",
            cg=(9, 0),
            points={"A": (0, 0), "B": (18, 0), "E": (9, -7)},
            guess=(8, 0, 0),
            **bar,
        ),
        mbody.Body("rocker", cg=(4, 0), points={"Q": (0, 0), "B": (10, 0)}, guess="60 deg", **bar),
        mbody.Revolute("P", "ground.P", "crank.P"),
        mbody.Revolute("A", "crank.A", "coupler.A"),
        mbody.Revolute("B", "coupler.B", "rocker.B"),
        mbody.Revolute("Q", "ground.Q", "rocker.Q"),
        mbody.Gravity("gravity", y=-386.0),
        mbody.Contact("foot", "ground.floor", "coupler.E", friction=friction),
    )
    machine.simulation = mbody.SimulationSettings(until=0.4, rtol=1e-10)
    return machine


def pushed():
    """A driven crank that pushes a block along a floor: a driver, a slot, a segment, a spring."""
    machine = mbody.Mechanism(
        "pusher", ground={"O": (0, 0), "C": (-0.3, 0.05)}, ground_shapes=FLOOR
    )
    light = {"mass": 0.5, "inertia": 0.01}
    corners = {"a": (-0.1, -0.05), "b": (0.1, -0.05), "c": (0.1, 0.05), "d": (-0.1, 0.05)}
    box = {"box": {"polygon": list(corners)}}
    machine.add(
        mbody.Body("crank", points={"C": (0, 0), "A": (0.1, 0)}, guess="90 deg", **light),
        mbody.Body("rod", points={"A": (0, 0), "B": (0.3, 0)}, guess=(-0.3, 0.15, -0.3), **light),
        mbody.Body("ram", points={"B": (0, 0), "T": (0.05, 0)}, guess=(0, 0.05, 0), **light),
        mbody.Body("block", mass=2.0, inertia=0.01, points=corners, shapes=box),
        mbody.Revolute("C", "ground.C", "crank.C"),
        mbody.Revolute("A", "crank.A", "rod.A"),
        mbody.Revolute("B", "rod.B", "ram.B"),
        mbody.Prismatic("guide", "ground.C", "ram.B"),
        mbody.AngleDriver("motor", "crank", ConstantSpeed("90 deg", -6.0)),
        mbody.Contact("push", "ram.T", "block.box", friction=0.2),
        mbody.Contact("base", "ground.floor", "block.box", friction=0.3),
        mbody.Gravity("gravity", y=-9.81),
    )
    start = {"block": {"x": 0.22, "y": 0.05, "angle": 0.0}}
    machine.simulation = mbody.SimulationSettings(until=0.5, rtol=1e-10, start=start)
    return machine


def smooth():
    return falling(friction=0.0)


@first_fast(
    ("make", "engine"),
    [(falling, "pymunk"), (falling, "mujoco"), (smooth, "mujoco"), (pushed, "pymunk")],
    1,
)
def test_linkages_that_strike(make, engine):
    machine = make()
    run = mbody.simulate(machine)
    assert any(event.name == "impact" for event in run.events)
    found = result_of(machine, engine, run)
    assert found.rows and not differing(found), str(found)


def test_impacts_that_steps_cannot_tell():
    """Of what strikes two at once steps find one impact after the other: not compared, and said."""
    machine = mbody.Mechanism("one disc at two", ground={"O": (0, 0)})
    start = {}
    for n, x in enumerate((0.0, 0.25, 0.45)):
        rim = {"rim": {"disc": "C", "radius": 0.1}}
        machine.add(mbody.Body(f"d{n}", mass=1.0, inertia=0.01, points={"C": (0, 0)}, shapes=rim))
        start[f"d{n}"] = {"x": x, "y": 0.0, "angle": 0.0, "vx": 0.5 if n == 0 else 0.0}
    machine.add(mbody.Contact("first", "d0.rim", "d1.rim", restitution=0.6))
    machine.add(mbody.Contact("second", "d1.rim", "d2.rim", restitution=0.6))
    machine.simulation = mbody.SimulationSettings(until=0.5, rtol=1e-10, start=start)
    found = result_of(machine, "pymunk")
    assert found.rows and not differing(found)
    assert any("one by one: compared up to t = 0.1" in note for note in found.notes)
    soft = result_of(machine, "mujoco")
    assert soft.rows and not differing(soft)
    assert any("up to the first impact" in note for note in soft.notes)


def test_impacts_by_another_law():
    """pymunk's follow Newton's law: a bar that strikes obliquely rebounds otherwise than by it."""
    machine = mbody.Mechanism("bar", ground={"O": (0, 0)}, ground_shapes=FLOOR)
    points = {"A": (-0.5, 0.0), "B": (0.5, 0.0)}
    machine.add(mbody.Body("bar", mass=1.0, inertia=1.0 / 12.0, points=points))
    machine.add(mbody.Contact("end", "ground.floor", "bar.A", friction=0.7, restitution=0.6))
    start = {"bar": {"x": 0.0, "y": 0.5, "angle": 0.8, "vx": -0.5, "vy": -2.0, "omega": 0.0}}
    machine.simulation = mbody.SimulationSettings(until=0.3, rtol=1e-10, start=start)
    run = mbody.simulate(machine)
    found = result_of(machine, "pymunk", run)
    assert found.rows and not differing(found)
    (note,) = [note for note in found.notes if "Newton's law" in note]
    struck = next(event.t for event in run.events if event.name == "impact")
    assert abs(float(note.partition("t = ")[2].partition(",")[0]) - struck) < 0.01


def small(*elements, shapes=None, **body):
    machine = mbody.Mechanism(
        "one", ground={"O": (0, 0)}, ground_shapes={**FLOOR, **(shapes or {})}
    )
    points = {"C": (0, 0), "A": (0.1, 0), "B": (0, 0.1), "D": (0.02, 0.02)}
    own = {"dart": {"polygon": ["C", "A", "D", "B"]}, "rim": {"disc": "C", "radius": 0.1}}
    whole = {"mass": 1.0, "inertia": 0.1, "guess": (0, 0.5, 0)} | body
    machine.add(mbody.Body("b", points=points, shapes=own, **whole), *elements)
    machine.add(mbody.Gravity("gravity", y=-9.81))
    machine.simulation = mbody.SimulationSettings(until=0.1)
    return machine


SENTENCES = {
    "a hollow circle": (
        lambda: small(
            mbody.Contact("hit", "ground.hole", "b.rim"),
            shapes={"hole": {"ring": "O", "radius": 2.0}},
        ),
        {
            "pymunk": "hit: pymunk has no hollow circle",
            "mujoco": "hit: MuJoCo has no hollow circle",
        },
    ),
    "a corner inwards": (
        lambda: small(mbody.Contact("hit", "ground.floor", "b.dart")),
        {"pymunk": "hit: pymunk's polygons have no corners that point inwards"},
    ),
    "a static coefficient": (
        lambda: small(mbody.Contact("hit", "ground.floor", "b.rim", friction=0.1, static=0.2)),
        {"mujoco": "hit: MuJoCo has one coefficient of friction"},
    ),
    "a stop": (
        lambda: small(mbody.Stop("hit", "b.y - 0.1 m")),
        {"pymunk": "hit: pymunk has no stop along", "mujoco": "hit: MuJoCo has no stop along"},
    ),
    "a limit": (
        lambda: small(
            mbody.Revolute("pin", "ground.O", "b.C", limits=(-0.1, 0.1)), guess=(0, 0, 0)
        ),
        {"pymunk": "pin: pymunk: it has limits", "mujoco": "pin: MuJoCo: it has limits"},
    ),
    "no inertia": (
        lambda: small(mbody.Contact("hit", "ground.floor", "b.C"), inertia=0.0),
        {"pymunk": "b: pymunk needs a mass and an inertia"},
    ),
}


@pytest.mark.parametrize("name", SENTENCES)
def test_what_they_cannot_is_said(name):
    make, wanted = SENTENCES[name]
    machine = make()
    run = mbody.simulate(machine)
    for engine, sentence in wanted.items():
        found = result_of(machine, engine, run)
        assert not found.rows
        said = [f"{one.element}: {one.why}" for one in found.not_expressible]
        assert any(one.startswith(sentence) for one in said), said


def test_steps_with_impulses_are_not_compared():
    machine = small(mbody.Contact("hit", "ground.floor", "b.rim"))
    run = mbody.simulate(machine, method="moreau", step=1e-3)
    for engine, found in mbody.crosscheck(machine, "pymunk", ours=run).opinions.items():
        if engine != "balance":
            assert not found.rows
            assert "errors of their own" in found.not_expressible[0].why
