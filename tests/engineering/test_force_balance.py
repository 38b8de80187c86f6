"""Counterweights: closed forms, shaking forces by reactions, scans where something is left."""

import itertools
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

import mbody
from mbody import AngleDriver, Body, Fixed, Mechanism, PinSlot, Prismatic, Revolute
from mbody.engineering import force_balance, shaking_force
from mbody.laws import ConstantAcceleration, ConstantSpeed
from mbody.model.body import SecondMoments, SlenderRod
from mbody.model.model_notes import with_changed

CASES = {
    "norton_fourbar": ({"crank": "3 in", "rocker.O4": 5.0}, 4),
    "stephenson_sixbar": ({"crank": 40.0, "rocker": "6 cm", "output": 40.0}, 6),
    "watt_sixbar": ({"crank": 40.0, "rocker": 60.0, "output": 40.0}, 6),
    "slider_crank": ({"crank": 0.05, "rod": 0.1}, 4),
}


def unloaded(model):
    """The system of a model without the forces of its loads."""
    system = mbody.assemble(model)
    zero = {f"{load.name}.value": 0.0 for load in system.mechanism.loads}
    return system.with_values(zero)


def peak(model, **options):
    run = mbody.kinetostatics(unloaded(model), **options)
    return shaking_force(run).magnitude.max()


@pytest.mark.parametrize("name", CASES)
def test_the_shaking_force_vanishes(name):
    """By the reactions on the frame, at the law's speed and at one that changes otherwise."""
    on, conditions = CASES[name]
    machine = mbody.gallery.load(name)
    found = force_balance(machine, on)
    assert found.complete and found.reason == "" and found.conditions == conditions
    assert found.status == "completed"
    crank = np.linspace(0.0, 2.0 * np.pi, 73)
    motions = {"turn": True}, {"drive": {"motor": (crank, 3.0 + np.sin(crank), np.cos(2 * crank))}}
    for motion in motions:
        assert peak(found.mechanism, **motion) < 1e-12 * peak(machine, **motion)
    assert found.after.magnitude.max() < 1e-12 * found.before.magnitude.max()
    assert found.left < 1e-12


def test_berkof_and_lowen():
    """m₂ z₂ = −m₃ (1 − z₃/l₃) l₂ and m₄ z₄ = −m₃ (z₃/l₃) l₄, complex in link axes (1969)."""
    machine = mbody.gallery.load("norton_fourbar")
    found = {
        one.body: one for one in force_balance(machine, {"crank": 3, "rocker": 5}).counterweights
    }
    m2, m3, m4 = (weight / 386.0 for weight in (1.5, 7.7, 5.8))
    z2, z3, z4 = 3.0 * np.exp(1j * np.radians(30)), 9.0 * np.exp(1j * np.radians(45)), 5.0
    wanted = {
        "crank": -m3 * (1.0 - z3 / 15.0) * 5.0 - m2 * z2,
        "rocker": -m3 * (z3 / 15.0) * 10.0 - m4 * z4,
    }
    for name, moment in wanted.items():
        one = found[name]
        assert one.moment * np.exp(1j * one.angle) == pytest.approx(moment, rel=1e-12)
        assert one.mass == pytest.approx(abs(moment) / one.radius, rel=1e-12)
        assert one.x + 1j * one.y == pytest.approx(one.radius * moment / abs(moment), rel=1e-12)


@pytest.mark.parametrize("seed", range(6))
def test_a_slider_crank(seed):
    """The rod about the pin A, then the crank about O; the weights' own masses are carried."""
    rng = np.random.default_rng(seed)
    r, ms, mr, mk = rng.uniform(0.5, 2.0, 4)
    length, c, ck = 4.0 * r, rng.uniform(0.1, 3.0), rng.uniform(-0.5, 0.5)
    radii = rng.uniform(0.3, 1.5, 2)
    machine = Mechanism("engine")
    machine.add(
        Body("crank", mass=mk, cg=(ck, 0.0), inertia=0.1, points={"A": (r, 0)}),
        Body("rod", mass=mr, cg=(c, 0.0), inertia=0.2, points={"B": (length, 0)}),
        Body("slider", mass=ms),
        Revolute("O", "ground", "crank"),
        Revolute("A", "crank.A", "rod"),
        Revolute("B", "rod.B", "slider"),
        Prismatic("guide", "ground", "slider"),
        AngleDriver("motor", "crank", ConstantAcceleration(0.2, 9.0, -3.0)),
    )
    on = {"rod": radii[0], "crank": radii[1]}
    found = force_balance(machine, on)
    rod, crank = found.counterweights
    wanted = (ms * length + mr * c) / radii[0]
    assert rod.mass == pytest.approx(wanted, rel=1e-11)
    moment = (ms + mr + wanted) * r + mk * ck
    assert crank.mass == pytest.approx(abs(moment) / radii[1], rel=1e-11)
    assert np.cos(rod.angle) == pytest.approx(-1.0) and found.complete
    assert np.cos(crank.angle) == pytest.approx(-np.sign(moment))
    assert peak(found.mechanism, turn=True) < 1e-12 * peak(machine, turn=True)


def test_counterweights_are_those_of_bodies_of_their_own():
    """Points of mass, fixed to the links, need the same effort and the same reactions."""
    machine = mbody.gallery.load("norton_fourbar")
    found = force_balance(machine, {"crank": 3, "rocker": 5})
    apart = machine.copied()
    for one in found.counterweights:
        apart.add(
            Body(f"w_{one.body}", mass=one.mass),
            Fixed(f"f_{one.body}", mbody.Marker(one.body, (one.x, one.y)), f"w_{one.body}"),
        )
    whole, parts = (mbody.kinetostatics(m, turn=True) for m in (found.mechanism, apart))
    assert_allclose(whole.effort("motor"), parts.effort("motor"), rtol=1e-10, atol=1e-9)
    for joint in ("O2", "A", "B", "O4"):
        assert_allclose(whole.reaction(joint).fx, parts.reaction(joint).fx, rtol=1e-10, atol=1e-10)
    alone = unloaded(found.mechanism)
    moments = shaking_force(mbody.kinetostatics(alone, turn=True)).moment_inertia
    assert_allclose(found.after.moment, moments, rtol=1e-11, atol=1e-11)


# -- where something is left ----------------------------------------------------------------------


def crank_only(x, y):
    """The gallery's engine with a point of mass on the crank; rms of the shaking force."""
    machine = mbody.gallery.load("slider_crank")
    size = np.hypot(x, y)
    crank = replace(machine["crank"], mass=size / 0.3, cg=(0.3 * x / size, 0.3 * y / size))
    run = mbody.kinetostatics(unloaded(with_changed(machine, [crank], ["mass"])), turn=True)
    return float(np.sqrt((shaking_force(run).magnitude[:-1] ** 2).mean()))


def test_the_best_of_an_engine():
    """With the crank alone: least mean square beside every place near it, and said why."""
    found = force_balance(mbody.gallery.load("slider_crank"), {"crank": 0.3})
    (one,) = found.counterweights
    best = one.moment * np.array([np.cos(one.angle), np.sin(one.angle)])
    here = crank_only(*best)
    # r/l = 1/4: half of the reciprocating mass, by the Fourier series of its acceleration
    assert one.moment == pytest.approx(0.5 * 250.0 * 0.3, rel=2e-3)
    for dx, dy in itertools.product((-0.02, 0.0, 0.02), repeat=2):
        if dx or dy:
            assert crank_only(*(best + np.array([dx, dy]) * one.moment)) > here
    assert not found.complete and 0.5 < found.left < 0.8
    size = float(np.sqrt((found.before.magnitude[:-1] ** 2).mean()))
    assert found.left == pytest.approx(here / size, rel=1e-9)
    assert "'rod' too the balance is complete" in found.reason and found.reason in found.notes


def scotch_yoke(mass=3.0):
    machine = Mechanism("yoke")
    machine.add(
        Body("crank", mass=1.0, points={"A": (0.5, 0)}),
        Body("piston", mass=mass),
        Revolute("O", "ground", "crank"),
        Prismatic("guide", "ground", "piston"),
        PinSlot("slot", mbody.Marker("piston", (0.0, 0.0), np.pi / 2), "crank.A"),
        AngleDriver("motor", "crank", ConstantSpeed(0.0, 4.0)),
    )
    return machine


def test_a_link_without_pins_to_the_ground():
    """m r cos θ along the guide: a weight turns half of it away, and makes as much across."""
    found = force_balance(scotch_yoke(), {"crank": 0.2})
    (one,) = found.counterweights
    assert one.moment == pytest.approx(0.5 * 3.0 * 0.5, rel=1e-12)
    assert found.left == pytest.approx(np.sqrt(0.5), rel=1e-12)
    assert "'piston' has no way to the ground through pins" in found.reason
    assert found.conditions == 3


def test_two_drivers():
    """A five-bar: momenta by both rates vanish over a grid of positions."""
    machine = Mechanism("five-bar", ground={"O": (0, 0), "Q": (3, 0)})
    machine.add(
        Body("left", mass=1.0, cg=(0.4, 0.1), inertia=0.1, points={"A": (1.0, 0)}),
        Body("right", mass=1.2, cg=(0.5, 0.0), inertia=0.1, points={"C": (1.0, 0)}),
        Body("up", mass=0.7, cg=(1.0, 0.1), inertia=0.1, points={"B": (2.5, 0)}, guess="50 deg"),
        Body("down", mass=0.8, cg=(1.0, 0.0), inertia=0.1, points={"B": (2.5, 0)}, guess="130 deg"),
        Revolute("O", "ground.O", "left"),
        Revolute("A", "left.A", "up"),
        Revolute("B", "up.B", "down.B"),
        Revolute("C", "right.C", "down"),
        Revolute("Q", "ground.Q", "right"),
        AngleDriver("m1", "left", ConstantSpeed(1.5, 1.0)),
        AngleDriver("m2", "right", ConstantSpeed(1.2, -2.0)),
    )
    grid = np.array(list(itertools.product(np.linspace(1.0, 2.0, 6), np.linspace(1.0, 2.0, 6)))).T
    drive = {"m1": (grid[0], 1.0), "m2": (grid[1], -2.0)}
    found = force_balance(machine, {"left": 0.5, "right": 0.5, "up": 0.7}, drive=drive)
    assert found.complete
    other = {"m1": (grid[0], -3.0, 2.0), "m2": (grid[1], 1.0, 5.0)}
    assert peak(found.mechanism, drive=other) < 1e-12 * peak(machine, drive=other)
    assert not force_balance(machine, {"left": 0.5}, drive=drive).complete


# -- what stays -----------------------------------------------------------------------------------


@pytest.mark.parametrize("spread", ["point", SlenderRod(0.3), SecondMoments(0.3, 0.1, 0.05), None])
def test_the_spread_of_a_mass(spread):
    """In-plane second moments have the counterweight too: of two points, by their distance."""
    machine = scotch_yoke(0.0)
    inertia = {"point": 0.0}.get(spread, 0.4) if isinstance(spread, str) else 0.4
    crank = replace(machine["crank"], cg=(0.2, 0.1), inertia=inertia, spread=spread)
    found = force_balance(with_changed(machine, [crank], []), {"crank": 0.4})
    made, (one,) = found.mechanism["crank"], found.counterweights
    reduced = 1.0 * one.mass / (1.0 + one.mass)
    dx, dy = one.x - 0.2, one.y - 0.1
    assert made.inertia == pytest.approx(inertia + reduced * (dx * dx + dy * dy), rel=1e-12)
    if spread is None:
        assert made.spread is None
        return
    before = {"point": (0.0, 0.0)}.get(spread) if isinstance(spread, str) else None
    if isinstance(spread, SlenderRod):
        before = 0.4 * np.cos(0.3) ** 2, 0.4 * np.cos(0.3) * np.sin(0.3)
    before = before or (0.3, 0.05)
    assert made.spread.xx == pytest.approx(before[0] + reduced * dx * dx, rel=1e-12)
    assert made.spread.xy == pytest.approx(before[1] + reduced * dx * dy, rel=1e-12)
    assert made.spread.xx + made.spread.yy == pytest.approx(made.inertia, rel=1e-12)
