"""Images of mechanisms with every kind of driver and load, and numbers that Python decides by."""

import json

import numpy as np
import pytest

import mbody
from mbody.core import selection
from mbody.image.model_image import to_image
from mbody.laws import ConstantSpeed, Harmonic
from mbody.model.simulation import Measure
from mbody.solution.measures import quantity
from tests.support.linkages import random_linkage, times_within

pytestmark = pytest.mark.skipif(
    selection.chosen().name != "native", reason="an image runs on machine code"
)
if selection.chosen().name == "native":
    from tests.support.image_loader import Loaded

PARAMETERS = {"k": 20.0, "a": 0.4, "w": 3.0}


def arm(*more, joints=(), **options):
    """Two bars in a row, the second one from the first."""
    made = mbody.Mechanism("arm", ground={"C": (0.5, 0.8)}, parameters=PARAMETERS, **options)
    made.add(
        mbody.Body(
            "first", mass=2.0, inertia=0.1, cg=(0.5, 0.1), points={"A": (1.0, 0.0)}, guess=0.4
        ),
        mbody.Body(
            "second", mass=1.0, inertia=0.05, cg=(0.3, 0.0), points={"P": (0.7, 0.2)}, guess=1.1
        ),
        mbody.Revolute("O", "ground", "first"),
        *joints,
        mbody.Gravity("gravity", y=-9.81),
        *more,
    )
    return made


def turning(*more):
    return arm(*more, joints=(mbody.Revolute("A", "first.A", "second"),))


LOADS = (
    mbody.Spring("spring", "ground.C", "second.P", stiffness="k", free_length=0.2, preload=1.5),
    mbody.Spring("rubber", "first.A", "ground.C", law="3*x + 2*k*x^3"),
    mbody.Damper("damper", "second.P", "ground.C", coefficient=2.5),
    mbody.Damper("oil", "ground.C", "first.A", law="2*x/(1 + abs(x))"),
    mbody.TorsionSpring("coil", "second", "first", stiffness=4.0, free_angle=0.2, preload=0.3),
    mbody.TorsionDamper("drag", "second", "first", coefficient=0.4),
    mbody.Force("push", "second.P", "a*sin(w*t) + 2", angle=0.7),
    mbody.Force("jet", mbody.Marker("second", (0.1, 0.2), 0.3), 1.5, angle=0.2, follows=True),
    mbody.Torque("load", "first", value=Harmonic(1.0, 0.5, 2.0, 0.1)),
    mbody.Torque("between", "second", "first", value="min(t, 0.5)"),
)
#: Mechanisms with two drivers, of which one moves a body from another one that moves.
DRIVEN = {
    "two angles": lambda: turning(
        mbody.AngleDriver("shoulder", "first", ConstantSpeed(0.4, 1.0)),
        mbody.AngleDriver("elbow", "second", "0.7 + 0.3*sin(w*t)", relative_to="first"),
        *LOADS,
    ),
    "a slide on a bar": lambda: arm(
        mbody.AngleDriver("shoulder", "first", ConstantSpeed(0.4, 1.0)),
        mbody.CoordinateDriver(
            "slide", mbody.Marker("first", (0.1, 0.0), 0.5), "second.P", "0.6 + 0.2*t^2"
        ),
        *LOADS,
        joints=(mbody.Prismatic("guide", mbody.Marker("first", (0.1, 0.0), 0.5), "second"),),
    ),
    "a cylinder": lambda: turning(
        mbody.AngleDriver("shoulder", "first", ConstantSpeed(0.4, 1.0)),
        mbody.DistanceDriver("ram", "first", "second.P", "1.2 + 0.1*sin(w*t)"),
        *LOADS,
    ),
}
MEASURES = ("k*spring.length", "hypot(push.fx, push.fy)", "second.P.vx + first.A.vy", "t*w")


@pytest.mark.parametrize("name", DRIVEN)
def test_loads_and_drivers_have_the_histories_of_results(name):
    machine = DRIVEN[name]()
    for n, of in enumerate(MEASURES):
        machine.measures[f"own{n}"] = Measure(of)
    system = mbody.assemble(machine)
    made = to_image(system, 31)
    assert not made.notes
    image = Loaded(made.content)
    new = {"k": 25.0, "w": 2.5, "first.A.x": 1.05, "second.P.y": 0.25, "push.angle": 0.6}
    for values in ({}, new):
        assert image.set(values, "driven") == -1 and image.close()
        assert image.call("turn") == 0
        pages, measured = image.output("turn")
        run = mbody.kinetostatics(system.with_values(values), image["turn.t"].copy())
        wanted = run.record.table(slice(None))
        # the first position is closed from another one: rounding, and its condition
        assert np.allclose(pages, wanted, rtol=0.0, atol=1e-11 * np.abs(wanted).max())
        for key, found in measured.items():
            history = run.measure(key)
            size = max(1.0, np.abs(history).max())
            assert np.abs(found - history).max() < 1e-10 * size, key
    assert {"spring.force", "coil.torque", "load.torque", "jet.fx", "own2"} <= measured.keys()


def test_two_drivers_are_dragged_along_a_chord():
    system = mbody.assemble(DRIVEN["two angles"]())
    image = Loaded(to_image(system, 31).content)
    assert image.manifest["driven"]["path parameters"]["step"] == "instant"
    begin = image["step.given"].reshape(2, 2, 3)[0, :, 0].copy()
    end = begin + np.array([0.3, -0.4])
    image["step.given"].reshape(2, 2, 3)[1] = [[end[0], 1.0, 2.0], [end[1], -3.0, 0.5]]
    image["step.chords"].reshape(2, 2)[0] = end - begin
    assert image.call("step") == 0
    drive = {"shoulder": (end[0], 1.0, 2.0), "elbow": (end[1], -3.0, 0.5)}
    wanted = mbody.kinetostatics(system, drive=drive).record.table(slice(None))[0]
    found = image.output("step")[0][1]
    assert np.allclose(found, wanted, rtol=0.0, atol=1e-12 * np.abs(wanted).max())


def test_a_free_motion_of_all_loads():
    machine = turning(*LOADS)
    machine.simulation = mbody.SimulationSettings(2.0, rtol=1e-10, instants=21)
    made = to_image(machine)
    image = Loaded(made.content)
    assert made.manifest["analyses"] == ["free"] and image.run() == 0
    run = mbody.simulate(machine)
    wanted = run.record.table(slice(0, 12))
    # until the corner of min(t, 0.5), at which only simulate ends a step: then as errors grow
    assert np.allclose(image.output("run")[0][:5, :12], wanted[:5], rtol=0.0, atol=1e-11)
    assert np.allclose(image.output("run")[0][:, :12], wanted, rtol=0.0, atol=100 * 1e-10)
    assert any("corners and pulses" in note for note in made.notes)
    measured = image.output("run")[1]
    for key in ("spring.force", "oil.rate", "drag.torque", "O.force", "load.torque"):
        assert np.allclose(measured[key], run.measure(key), rtol=0.0, atol=1e-6), key


def test_numbers_that_python_decides_by_are_constants():
    machine = turning(mbody.AngleDriver("shoulder", "first"), mbody.AngleDriver("elbow", "second"))
    made = to_image(machine, 5).manifest
    assert not made["not_changeable"]
    machine = mbody.gallery.load("flyball_governor")
    fixed = to_image(machine, 5).manifest["not_changeable"]
    assert "'field' needs its value before an image is made" in fixed["link_l.mass"]
    assert "numpy" in fixed["link_l.mass"]


def test_the_manifest_can_be_read_by_any_program():
    image = Loaded(to_image(mbody.gallery.load("mud_pump"), 5).content)
    assert json.loads(json.dumps(image.manifest)) == image.manifest
    assert image.manifest["units"]["length"] == "in" and image.units["r"] == "in"
    assert any("cylinder1.force" in note for note in image.manifest["notes"])


@pytest.mark.parametrize("seed", range(6))
def test_random_linkages_with_every_load(seed):
    """Names with spaces, sliders, welds, laws of springs: bits of the scalar path."""
    machine, turn = random_linkage(seed, 2 + seed % 2, sliders=True, extras=seed > 2)
    system = mbody.assemble(machine)
    image = Loaded(to_image(system, 9).content)
    t = image["turn.t"][:] = times_within(machine, turn, 9)
    assert image.call("turn") == 0
    run = mbody.kinetostatics(system, t)
    pages, measured = image.output("turn")
    wanted = run.record.table(slice(None))
    assert np.array_equal(pages, wanted)
    for key in measured:
        if "." in key:
            history = quantity(run, *key.rsplit(".", 1))[0]
            size = max(np.abs(history).max(), 1e-3 * np.abs(wanted).max())
            assert np.abs(measured[key] - history).max() < 1e-12 * size, key
