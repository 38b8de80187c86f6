"""Cross-checks on motions with joints that separate and with tyres."""

import pytest

import mbody
from mbody import Body, Contact, Gravity, Mechanism, Rolling, SimulationSettings, Tyre, simulate
from mbody.engines.balance import crosscheck_result as balance


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


def two_discs_in_a_bowl():
    machine = Mechanism(
        "bowl", ground={"O": (0, 0)}, ground_shapes={"bowl": {"ring": "O", "radius": 1}}
    )
    for name, mass, inertia, radius in (("disc", 2.0, 0.04, 0.2), ("other", 1.0, 0.02, 0.1)):
        shapes = {"rim": {"disc": "C", "radius": radius}}
        machine.add(
            Body(name, mass=mass, inertia=inertia, points={"C": (0, 0)}, shapes=shapes),
            Contact(f"track_{name}", "ground.bowl", f"{name}.rim", friction=0.5),
        )
    machine.add(Contact("pair", "other.rim", "disc.rim", friction=0.5), Gravity("gravity", y=-9.81))
    start = {"disc": {"x": 0.3, "y": -0.7416}, "other": {"x": -0.3, "y": -0.8}}
    machine.simulation = SimulationSettings(until=0.5, start=start)
    return machine


@pytest.mark.parametrize("step", [1e-3, 1e-4])
def test_the_balance_of_steps_with_impulses_is_that_of_their_middle(step):
    """Bodies are at the end of a step, contacts act in its middle: moments differ by what bodies
    pass meanwhile, and by no more; another inertia is seen.
    """
    run = simulate(two_discs_in_a_bowl(), method="moreau", step=step)
    found = balance(run.system, run)
    moments = [row for row in found.rows if "torque" in row.quantity]
    assert len(moments) == 2 and all(row.difference <= row.expected for row in found.rows)
    assert any(row.difference > 1e-3 * row.expected for row in moments)
    # in half a step, at less than 2 m/s
    assert all(row.expected < step * 1.0 / run.system.length for row in moments)
    wrong = balance(run.system.with_values({"disc.inertia": 0.06}), run)
    assert [row.quantity for row in wrong.rows if not row.difference <= row.expected] == [
        "disc: sum of torque"
    ]
