"""Motions with contacts against the dense oracle, which tries all modes."""

import numpy as np
import pytest

import mbody
from mbody import Body, Contact, Gravity, Mechanism, Rope, SimulationSettings, from_toml
from tests.support import contact_models as models
from tests.support.cases import first_fast

#: Reference cases, and what their motions begin with where the file does not say it.
CASES = {
    "block up an incline": (models.INCLINE, {}),
    "sliding to rolling": (models.DISC, {}),
    "thrown disc": (models.THROWN, {}),
    "ladder": (models.LADDER, {}),
    "oscillator": (models.OSCILLATOR, {}),
    "bouncing ball": (models.BALL, {"until": 1.2}),
    "rocking block": (
        models.BLOCK,
        {"until": 0.7, "start": {"block": {"x": 0.0, "y": 0.41, "angle": 0.05}}},
    ),
}


def result_of(machine):
    """What the oracle says of a motion."""
    run = mbody.simulate(machine)
    return run, mbody.crosscheck(machine, [], ours=run)


def worst(found):
    return max(row.difference for row in found.opinions["oracle"].rows)


@first_fast("name", CASES, 2)
def test_reference_cases(name):
    text, how = CASES[name]
    machine = from_toml(text.replace("ALPHA", "0"))
    if how:
        machine.simulation = SimulationSettings(rtol=1e-12, **how)
    run, found = result_of(machine)
    assert found.agrees, str(found)
    assert found.opinions["oracle"].rows, str(found)
    assert worst(found) < 1e-9
    kinds = {row.quantity.partition(": ")[2] for row in found.opinions["oracle"].rows}
    assert {event.name for event in run.events if event.t > 0.0} - {"rest"} <= kinds


def thrown(seed):
    """A disc, a box or a point, thrown at a floor and a wall, or another disc, or on a rope."""
    rng = np.random.default_rng([seed, 7])
    u = rng.uniform
    mu = float(u(0.0, 0.6))
    law = {
        "friction": mu,
        "static": mu * float(rng.choice([1.0, 1.3])),
        "restitution": float(rng.choice([0.0, 0.4, 0.8])),
        "law": str(rng.choice(["poisson", "newton"])),
    }
    kind = str(rng.choice(["disc", "box", "point", "discs", "rope"]))
    machine = Mechanism(
        f"{kind} {seed}",
        ground={"O": (0.0, 0.0), "W": (1.0, 0.0)},
        ground_shapes={
            "floor": {"line": {"point": "O", "angle": float(u(-0.4, 0.4))}},
            "wall": {"line": {"point": "W", "angle": 0.5 * np.pi}},
        },
    )
    corners = {"A": (-0.1, -0.2), "B": (0.1, -0.2), "C": (0.1, 0.2), "D": (-0.1, 0.2)}
    shape = {"polygon": list(corners)} if kind == "box" else {"disc": "M", "radius": 0.15}
    points = {"M": (0.0, 0.0), **corners}
    part = "M" if kind == "point" else "skin"
    start = {"one": {"x": 0.0, "y": 0.8, "angle": float(u(-1, 1)), "vx": float(u(-1, 2))}}
    start["one"] |= {"vy": float(u(-2, 0)), "omega": float(u(-5, 5))}
    inertia = 0.02
    machine.add(Body("one", mass=1.0, inertia=inertia, points=points, shapes={"skin": shape}))
    machine.add(Contact("floor", "ground.floor", f"one.{part}", **law))
    machine.add(Contact("wall", "ground.wall", f"one.{part}", **law))
    if kind == "discs":
        machine.add(Body("two", mass=0.6, inertia=0.01, points=points, shapes={"skin": shape}))
        machine.add(Contact("floor2", "ground.floor", "two.skin", **law))
        machine.add(Contact("both", "one.skin", "two.skin", **law))
        start["two"] = {"x": 0.1, "y": 1.3, "angle": 0.0, "vx": 0.0, "vy": -3.0, "omega": 0.0}
    if kind == "rope":
        machine.add(Rope("leash", "ground.O", "one.M", length=1.1))
    machine.add(Gravity("gravity", y=-9.81))
    machine.simulation = SimulationSettings(until=0.6, rtol=1e-12, start=start)
    return machine


#: Every kind of body, both laws of impacts, every restitution, with static friction and without.
THROWN = [1, 2, 4, 5, 7, 8, 9, 11]


@first_fast("seed", THROWN, 2)
def test_random_motions(seed):
    _, found = result_of(thrown(seed))
    assert found.agrees, str(found)
    assert found.opinions["oracle"].rows, str(found)
    assert worst(found) < 1e-8


def test_another_coefficient_is_found():
    """The oracle reads the description: a result of other friction differs."""
    machine = from_toml(models.DISC)
    other = mbody.assemble(machine).with_values({"road.friction": 0.151})
    found = mbody.crosscheck(machine, [], ours=mbody.simulate(other))
    rows = {row.quantity: row.verdict for row in found.opinions["oracle"].rows}
    assert rows["road: stick"] == rows["wheel.x"] == "differs"
    assert found.status.startswith("doubtful")


@pytest.mark.slow
def test_what_has_no_counterpart_is_said():
    """An engine without such contacts; and a load by a formula, which the oracle has."""
    machine = from_toml(models.DISC)
    found = mbody.crosscheck(machine, "pinocchio")
    assert [one.element for one in found.opinions["pinocchio"].not_expressible] == ["road"]
    machine.add(mbody.Torque("turn", "wheel", value="0.001*wheel.omega"))
    again = mbody.crosscheck(machine, [])
    assert again.agrees, str(again)
