"""Second opinions on motions with joints that separate and with tyres."""

import pytest

import mbody
from mbody import Body, Gravity, Mechanism, Rolling, SimulationSettings, Tyre


def wheel(element, **start):
    machine = Mechanism("wheel", ground={"O": (0.0, 0.0)})
    machine.add(
        Body("wheel", mass=3.0, inertia=0.1, points={"C": (0.0, 0.0)}),
        element,
        Gravity("gravity", y=-9.81),
    )
    machine.simulation = SimulationSettings(until=0.4, start={"wheel": start})
    return machine


def by_name(machine):
    report = mbody.crosscheck(machine)
    return report, report.opinions


def test_a_wheel_that_falls_slips_and_rolls():
    """Its contact stands in the place of the joint: bodies balance with its force."""
    road = Rolling("road", "ground.O", "wheel.C", radius=0.3, one_sided=True, friction=0.8)
    report, found = by_name(wheel(road, x=0.0, y=0.4, angle=0.0, omega=0.0, vx=5.0))
    assert report.run.status == "completed"
    assert len(found["balance"].rows) >= 4 and found["balance"].agrees
    for name in ("pinocchio", "pymunk", "mujoco"):
        assert {one.element for one in found[name].not_expressible} == {"road"}, name


@pytest.mark.parametrize("name", ["pymunk", "mujoco"])
def test_no_other_engine_follows_the_slip_of_a_tyre(name):
    tyre = Tyre(
        "tyre",
        "ground.O",
        "wheel.C",
        radius=0.3,
        stiffness=2e5,
        friction=0.9,
        steepness=10.0,
        relaxation=0.3,
    )
    report, found = by_name(wheel(tyre, x=0.0, y=0.2998, angle=0.0, omega=0.0, vx=5.0))
    assert report.run.status == "completed"
    assert [one.element for one in found[name].not_expressible] == ["tyre"]
