"""Free bodies are in equilibrium; members are named by the forces on them; contacts press."""

import math

import numpy as np
import pytest

import mbody
from mbody import (
    AngleDriver,
    Body,
    CoordinateDriver,
    Distance,
    Force,
    Gravity,
    Mechanism,
    Prismatic,
    Revolute,
    Rolling,
    Torque,
    free_body,
    gallery,
    member_forces,
)
from tests.support.linkages import random_linkage, times_within

#: Roundings of some hundred terms.
SMALL = 1e-11


def unbalanced(run, body, instant):
    """What the wrenches on a body sum to, forces and moment about the origin, and their size."""
    forces = free_body(run, body, instant)
    fx, fy = (sum(getattr(one, key) for one in forces) for key in ("fx", "fy"))
    moment = sum(one.torque + one.x * one.fy - one.y * one.fx for one in forces)
    size = max((one.force for one in forces), default=0.0)
    turning = max(abs(one.torque) + math.hypot(one.x, one.y) * one.force for one in forces)
    return max(abs(fx), abs(fy)), abs(moment), size, turning


@pytest.mark.parametrize("name", gallery.names())
def test_bodies_of_the_gallery_are_in_equilibrium(name):
    machine = gallery.load(name)
    if machine.ask is not None:
        run = mbody.kinetostatics(machine)
    else:
        run = mbody.simulate(machine, times=[0.0])
    for body in run.mechanism.bodies:
        force, moment, size, turning = unbalanced(run, body.name, 0)
        scale = max(size, turning / run.system.length, 1e-300)
        assert force <= SMALL * scale
        assert moment <= SMALL * scale * run.system.length * 10.0


@pytest.mark.parametrize("seed", range(12))
def test_bodies_of_random_linkages_are_in_equilibrium(seed):
    machine, turn = random_linkage(
        seed, loops=1 + seed % 3, sliders=bool(seed % 2), extras=seed > 5
    )
    run = mbody.kinetostatics(machine, t=times_within(machine, turn, 3))
    for body in machine.bodies:
        force, moment, size, turning = unbalanced(run, body.name, 2)
        scale = max(size, turning / run.system.length)
        assert force <= 1e-9 * scale  # as the random positions are conditioned
        assert moment <= 1e-9 * scale * run.system.length * 10.0


def test_a_driver_that_pulls():
    """A distance between two places and a cylinder: forces along it on both bodies."""
    machine = Mechanism("jack", ground={"O": (0.0, 0.0), "F": (1.0, 0.0)})
    machine.add(
        Body("boom", mass=10.0, cg=(1.0, 0.0), points={"J": (1.2, 0.0)}, guess=0.6),
        Revolute("O", "ground.O", "boom"),
        mbody.DistanceDriver("jack", "ground.F", "boom.J", 0.8),
        Gravity("gravity", y=-9.81),
    )
    run = mbody.statics(machine)
    jack = next(one for one in free_body(run, "boom") if one.cause == "jack")
    place = run.point("boom.J")
    along = np.array([place.x[0] - 1.0, place.y[0]]) / 0.8
    assert [jack.fx, jack.fy] == pytest.approx(run.effort("jack")[0] * along, rel=1e-12)
    assert (jack.x, jack.y) == pytest.approx((place.x[0], place.y[0]))
    assert jack.torque == pytest.approx(0.0, abs=1e-10)


# -- members ----------------------------------------------------------------------------------


def test_a_crane():
    """Jib on a tie rod: by the three-force construction, with numbers by hand."""
    crane = Mechanism("crane", ground={"A": (0.0, 0.0), "C": (0.0, 3.0)})
    crane.add(
        Body("jib", points={"B": (4.0, 0.0), "E": (5.0, 0.0)}, guess=0.0),
        Body("tie", points={"B": (5.0, 0.0)}, guess=-0.6),
        Revolute("A", "ground.A", "jib"),
        Revolute("C", "ground.C", "tie"),
        Revolute("B", "jib.B", "tie.B"),
        Force("load", "jib.E", 800.0, angle=-math.pi / 2.0),
    )
    jib, tie = member_forces(mbody.statics(crane))
    # moments about A: the tie's pull has the arm 4·3/5 = 2.4
    assert tie.kind == "two-force"
    assert tie.tension == pytest.approx(800.0 * 5.0 / 2.4, rel=1e-12)
    assert "pulled with 1666.67 N" in tie.words
    # the lines of the load (x = 5) and of the tie (y = 3 − 3/4 x)
    assert jib.kind == "three-force"
    assert jib.meeting == pytest.approx((5.0, -0.75), rel=1e-12)
    assert {one.cause for one in jib.forces} == {"A", "B", "load"}


def test_a_strut_is_pressed():
    prop = Mechanism("prop", ground={"A": (0.0, 0.0), "C": (4.0, -3.0)})
    prop.add(
        Body("beam", points={"B": (4.0, 0.0)}, guess=0.0),
        Body("strut", points={"B": (3.0, 0.0)}, guess=1.5),
        Revolute("A", "ground.A", "beam"),
        Revolute("C", "ground.C", "strut"),
        Revolute("B", "beam.B", "strut.B"),
        Force("load", mbody.Marker("beam", (2.0, 0.0)), 100.0, angle=-math.pi / 2.0),
    )
    beam, strut = member_forces(mbody.statics(prop))
    assert strut.tension == pytest.approx(-50.0, rel=1e-12)
    assert "pressed with 50 N" in strut.words
    # three parallel forces meet nowhere
    assert (beam.kind, beam.meeting) == ("three-force", None)
    assert beam.words.endswith("are parallel")


def test_a_bar_of_distance():
    """A `Distance` is a rod without mass and no body: the arm feels it along its line."""
    machine = Mechanism("swing", ground={"O": (0.0, 0.0), "C": (3.0, 0.0)})
    machine.add(
        Body("arm", points={"A": (1.0, 0.0)}, guess=0.5),
        Revolute("O", "ground.O", "arm"),
        Distance("rod", "ground.C", "arm.A", length=2.5),
        Torque("load", "arm", value=4.0),
    )
    (arm,) = member_forces(mbody.statics(machine))
    assert arm.kind == "two forces and a couple"


# -- contacts ---------------------------------------------------------------------------------


def on_the_road(push):
    """A wheel on a road, pressed down by its weight, and pushed up."""
    machine = Mechanism("wheel", ground={"O": (0.0, 0.0)})
    machine.add(
        Body("wheel", mass=2.0, inertia=0.1, guess=(0.0, 0.5, 0.0)),
        Rolling("road", "ground.O", "wheel", radius=0.5),
        CoordinateDriver("drive", "ground.O", "wheel", 0.0),
        Gravity("gravity", y=-10.0),
        Force("push", "wheel", push, angle=math.pi / 2.0),
    )
    return machine


def test_a_wheel_that_would_leave_the_road():
    run = mbody.statics(on_the_road(15.0))
    assert run.contact("road")[0] == pytest.approx(5.0, rel=1e-12)
    assert run.notes == ()
    run = mbody.statics(on_the_road(26.0))
    (note,) = run.notes
    assert note == (
        "contact 'road' would have to pull 'wheel' with 6 N at t = 0 s: 'wheel' would leave "
        "'ground' there; press it on harder"
    )
    growing = on_the_road(mbody.laws.ConstantSpeed(0.0, 1.0))
    run = mbody.kinetostatics(growing, t=np.linspace(0.0, 40.0, 9))
    (note,) = run.notes
    assert "with 20 N at 4 of 9 instants, most at t = 40 s" in note
    batch = mbody.assemble(on_the_road(1.0)).with_values({"push.value": [0.0, 30.0, 22.0]})
    one, other = mbody.statics(batch).notes
    assert one.startswith("design 1: contact 'road' would have to pull 'wheel' with 10 N at t = 0")
    assert other.startswith("design 2: contact 'road' would have to pull 'wheel' with 2 N at t = 0")


@pytest.mark.parametrize(
    ("internal", "radius", "side"), [(False, 0.2, 1.0), (True, 0.2, -1.0), (True, 0.8, -1.0)]
)
def test_a_wheel_on_a_wheel(internal, radius, side):
    """Pushed along the line of centres towards the other wheel it presses, away it pulls."""
    apart = abs(0.5 - radius) if internal else 0.5 + radius
    for push in (3.0, -3.0):
        machine = Mechanism("wheels", ground={"O": (0.0, 0.0)})
        machine.add(
            Body("arm", points={"C": (apart, 0.0)}),
            Body("wheel", guess=(apart, 0.0, 0.0)),
            Revolute("O", "ground.O", "arm"),
            mbody.PinSlot("C", "arm", "wheel"),
            Rolling("rim", "ground.O", "wheel", radius=radius, on_radius=0.5, internal=internal),
            AngleDriver("hold", "arm", 0.0),
            Force("push", "wheel", push),
        )
        run = mbody.statics(machine)
        # what presses outwards in the outer contact presses inwards in the inner one
        assert run.contact("rim")[0] == pytest.approx(-side * push, rel=1e-12)
        assert bool(run.notes) == (-side * push < 0.0)


def test_instants_are_counted_from_the_end_too():
    """The last one by -1, with a coupling's force of that instant; others that are not there."""
    machine = Mechanism("jack", ground={"O": (0.0, 2.0)})
    machine.add(
        Body("drum", mass=1.0, inertia=0.5),
        Body("block", mass=3.0, guess=(1.0, 0.0, 0.0)),
        Revolute("D", "ground", "drum"),
        Prismatic("guide", "ground", "block"),
        mbody.LengthCoupling(
            "rope",
            [
                mbody.CouplingTerm(1.0, distance=("ground.O", "block")),
                mbody.CouplingTerm(0.2, angle="drum"),
            ],
            3.0,
        ),
        AngleDriver("motor", "drum", mbody.laws.ConstantSpeed(0.0, 2.0)),
    )
    run = mbody.kinetostatics(machine, t=[0.0, 0.5, 1.0])
    assert free_body(run, "block", -1) == free_body(run, "block", 2) != free_body(run, "block", 0)
    force, _, size, _ = unbalanced(run, "block", -1)
    assert force < SMALL * size
    assert member_forces(run, -1) == member_forces(run, 2)
    for instant in (3, -4, 0.5, "1", True):
        with pytest.raises(mbody.ModelError, match="give a whole number, 0 to 2"):
            free_body(run, "block", instant)
