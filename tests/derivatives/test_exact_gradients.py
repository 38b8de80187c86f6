"""Exact derivatives against a complex step through dense equations: a sample of `tests.gradients`,
and every joint and load with a form of its own.
"""

import numpy as np
import pytest

import mbody
from mbody import (
    AngleDriver,
    Body,
    Clutch,
    CoordinateDriver,
    Damper,
    FrictionForce,
    Marker,
    Mechanism,
    Prismatic,
    ReciprocatingCylinder,
    Revolute,
    Spring,
)
from mbody.derivatives.dual_solution import checked_names
from mbody.laws import SHAPES, Harmonic, Polynomial, Rise
from tests.gradients import ALLOWED, compared, linkage, machine
from tests.model.test_belts import braked, drive
from tests.support.cases import first_fast
from tests.support.complex_oracle import ComplexOracle
from tests.support.frictional import cam_drive, drawer, gear_pair, rack_and_pinion, slider_crank
from tests.support.odd_mechanisms import planetary, rack, wheel, yoke

SAMPLE = ("norton_fourbar", "cam_follower", "flyball_governor", "mud_pump", "toggle_press")


@pytest.mark.parametrize("model", SAMPLE)
def test_gallery(model):
    system = mbody.assemble(mbody.gallery.load(model))
    found = compared(system, "kinetostatics", [0.013], step=3)
    assert found.numbers > 10 and found.worst <= ALLOWED, found.where


@pytest.mark.parametrize("analysis", ["kinematics", "kinetostatics", "statics"])
@pytest.mark.parametrize("seed", [2, 5])
def test_random_linkages(seed, analysis):
    _, system, t = linkage(seed)
    found = compared(system, analysis, t[:1], step=7)
    assert found.numbers > 10 and found.worst <= ALLOWED, found.where


@pytest.mark.parametrize("seed", [6, 46, 171])
def test_random_machines(seed):
    """Elements of any kind: a belt's coupling, gears, slots; redundant rows in the last."""
    _, system, t = machine(seed)
    found = compared(system, "kinetostatics", t, step=9, shared=False)
    assert found.numbers > 5 and found.worst <= ALLOWED, found.where


def test_a_coupling_of_lengths():
    """A rope over a pulley: two distances and a way, whose sum does not change."""
    machine = Mechanism("a tackle", ground={"P": (0.0, 2.0), "Q": (3.0, 2.0)})
    machine.add(
        Body("arm", mass=1.0, inertia=0.2, cg=(0.5, 0.0), points={"E": (1.0, 0.1)}),
        Revolute("O", "ground", "arm"),
        Body("load", mass=3.0, inertia=0.1, guess=(3.0, 0.5, 0.0)),
        Prismatic("guide", Marker("ground", (3.0, 0.0), 0.5 * np.pi), "load"),
        mbody.LengthCoupling(
            "rope",
            [
                mbody.CouplingTerm(1.0, distance=("ground.P", "arm.E")),
                mbody.CouplingTerm(-2.0, coordinate=(Marker("ground", (3.0, 0.0), 1.5), "load")),
            ],
            value=0.6,
        ),
        mbody.Gravity("g", y=-9.81),
        AngleDriver("motor", "arm", Polynomial((0.3, 2.0, 1.0))),
    )
    found = compared(mbody.assemble(machine), "kinetostatics", [0.1])
    assert found.numbers > 10 and found.worst <= ALLOWED, found.where


def clutch():
    machine = Mechanism("a braked wheel", ground={"O": (0.0, 0.0)})
    machine.add(
        Body("wheel", mass=1.0, inertia=0.5),
        Revolute("pin", "ground.O", "wheel"),
        Clutch("brake", "ground.O", "wheel", torque=12.0, static=1.5, stribeck=2.0),
        AngleDriver("motor", "wheel", Polynomial((0.0, 3.0, 1.0))),
    )
    return machine


def packing():
    machine = slider_crank(0.0, masses=(1.0, 2.0, 3.0))
    machine.add(
        FrictionForce("packing", "ground", "slider", force=30.0, static=1.2, stribeck=0.3),
        Spring("spring", "ground", "rod.B", law=Polynomial([2.0, 20.0, 5.0]), free_length=0.1),
        Damper("damper", Marker("ground", (0.0, 0.2)), "slider", law=Harmonic(0.1, 2.0, 3.0)),
    )
    return machine


def compressor(**gas):
    machine = slider_crank(0.1, masses=(1.0, 2.0, 3.0), length=0.1)
    machine.add(
        ReciprocatingCylinder(
            "gas",
            "ground",
            "slider",
            area=0.02,
            opposite_area=0.015,
            near=0.25,
            far=0.15,
            clearance=0.01,
            delivery=4e5,
            **gas,
        )
    )
    return machine


def pushed(law):
    machine = Mechanism("a slide")
    machine.add(
        Body("slide", mass=2.0),
        Prismatic("guide", "ground", "slide"),
        CoordinateDriver("ram", "ground", "slide", law),
    )
    return machine


ELEMENTS = {
    "pins and slides that rub": slider_crank(0.1, masses=(1.0, 2.0, 3.0), viscous=0.2),
    "a Stribeck curve": slider_crank(
        0.1, masses=(1.0, 2.0, 3.0), static=0.2, stribeck=0.05, length=0.1
    ),
    "a drawer": drawer(0.1),
    "a drawer with rails": drawer(0.1, height=0.05),
    "teeth with an efficiency": gear_pair(efficiency=0.9),
    "teeth that rub": gear_pair(friction=0.1, pressure_angle="20 deg"),
    "teeth of a ring": gear_pair(internal=True, friction=0.1, pressure_angle="20 deg", module=0.1),
    "a rack that rubs": rack_and_pinion(friction=0.1, pressure_angle="20 deg"),
    "a rack with an efficiency": rack_and_pinion(efficiency=0.8),
    "a roller on a pin": cam_drive("roller", friction=0.1, pin_radius=0.004),
    "a knife edge": cam_drive("knife", friction=0.1),
    "a flat face that swings": cam_drive("flat", swinging=True, friction=0.1),
    "a roller that swings": cam_drive("roller", swinging=True, clockwise=True),
    "a flat face": cam_drive("flat", clockwise=True, friction=0.1),
    "a clutch": clutch(),
    "a packing, laws of loads": packing(),
    "a gas": compressor(exponent=1.3, ambient=1e5),
    "a liquid": compressor(bulk_modulus=2e6),
    "a band brake": braked(5.0, 0.02),
    "a band brake the other way": braked(-5.0, 0.02, static=1.3, stribeck=4.0),
    "an open belt": drive(rates={"motor": 30.0, "fan": 1.0}, rough=True),
    "a crossed belt": drive(crossed=True, rates={"motor": -3.0, "fan": 20.0}),
    "a planetary gear": planetary(),
    "a rack": rack(),
    "a rolling wheel": wheel(),
    "a Scotch yoke": yoke(),
    **{f"a rise {shape}": pushed(Rise(shape, 2.0, 0.01, 0.1, 1.5)) for shape in SHAPES},
    "a harmonic law": pushed(Harmonic(1.0, 2.0, 3.0, 0.4)),
}


@first_fast("name", ELEMENTS, 12)
def test_elements(name):
    system = mbody.assemble(ELEMENTS[name])
    names = None
    if "belt" in name:  # its distance is a number of its own, to which the centres must fit
        every = checked_names(system, None)
        names = [one for one in every if not one.endswith((".distance", ".x", ".y"))]
    found = compared(system, "kinetostatics", [0.013, 0.031], names, in_turn=True)
    assert found.numbers and found.worst <= ALLOWED, found.where


def test_wheels_that_would_no_longer_fit_have_no_derivative():
    system = mbody.assemble(planetary())
    found = mbody.gradient(system, "mesh.force", ["arm.C.x", "load"], t=[0.0])
    slopes = found["mesh.force"]
    assert np.isnan(slopes["arm.C.x"]) and np.isfinite(slopes["load"])
    assert any("wheels that fit" in note for note in found.notes)


@pytest.mark.parametrize(
    ("model", "measure", "place"),
    [("parallel_cranks", "motor.effort", 120), ("toggle_press", "knee.effort", 292)],
)
def test_limits_and_jams_have_no_derivative(model, measure, place):
    """At a change point values are limits, where a mechanism jams there are none: other instants of
    the same result have derivatives as before.
    """
    machine = mbody.gallery.load(model)
    (body, *_) = machine.bodies
    name, driver = f"{body.name}.mass", machine.drivers[0].name
    name = "M" if name in mbody.assemble(machine).formulas else name
    for reduced in (f"peak({measure})", f"at({measure}, {place})", f"mean({measure})"):
        found = mbody.gradient(machine, reduced, name, turn=driver)
        assert np.isnan(found[reduced][name])
        assert any("has no derivative at t = " in note for note in found.notes)
        assert not any("its row is zero" in note for note in found.notes)
    history = mbody.gradient(machine, measure, name, turn=driver)[measure][name]
    assert np.isnan(history[place]) and np.isfinite(history[place - 2])
    alone = mbody.gradient(machine, f"at({measure}, {place - 2})", name, turn=driver)
    assert alone[f"at({measure}, {place - 2})"][name] == history[place - 2]
    assert not any("has no derivative at" in note for note in alone.notes)


def test_the_dense_equations_have_the_forces_of_the_analysis():
    """The oracle finds the motion and the forces that the analysis does."""
    system = mbody.assemble(gear_pair(efficiency=0.9))
    run = mbody.kinetostatics(system, t=[0.2])
    q = run.record.table(slice(0, system.coordinates))[0]
    truth = ComplexOracle(system, "mesh.phase", 0.2).solve(q)
    effort = run.effort("motor")[0]
    assert truth["efforts"]["motor"].real == pytest.approx(effort, rel=1e-12)
    force = run.reaction("mesh")
    np.testing.assert_allclose(
        truth["reactions"]["mesh"].real, [force.fx[0], force.fy[0], force.torque[0]], rtol=1e-11
    )
