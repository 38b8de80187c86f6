"""Loads of value 0 change nothing, and a motion without any force begins: powers are rounded, and
no error of a step is measured against that rounding.
"""

import dataclasses
import math

import pytest

import mbody
from mbody import (
    Body,
    Contact,
    Damper,
    Force,
    Gravity,
    Input,
    Mechanism,
    SimulationSettings,
    Spring,
    Torque,
    simulate,
)

SILENT = {
    "none": lambda: (),
    "force": lambda: (Force("zero", "ladder", 0.0, angle=0.0),),
    "torque": lambda: (Torque("zero", body="ladder", value=0.0),),
    "spring": lambda: (Spring("zero", "ground.O", "ladder.top", 0.0, 0.1),),
    "damper": lambda: (Damper("zero", "ground.O", "ladder.top", 0.0),),
    "input": lambda: (Input("u", "0 N"), Force("zero", "ladder.top", "u", angle=0.3)),
}


def ladder(length: float, mass: float, *more) -> Mechanism:
    """A ladder at 70° against a wall, friction 0.5 at both ends: tan 20° < 0.5 holds it."""
    angle = math.radians(70.0)
    made = Mechanism(
        "ladder",
        ground={"O": (0, 0)},
        ground_shapes={
            "floor": {"line": {"point": "O"}},
            "wall": {"line": {"point": "O", "angle": -math.pi / 2}},
        },
    )
    half = length / 2
    points = {"foot": (-half, 0), "top": (half, 0)}
    made.add(
        Body("ladder", mass=mass, inertia=mass * length**2 / 12, points=points),
        Gravity("g", y=-9.81),
        Contact("foot", "ground.floor", "ladder.foot", friction=0.5),
        Contact("top", "ground.wall", "ladder.top", friction=0.5),
        *more,
    )
    place = {"x": half * math.cos(angle), "y": half * math.sin(angle), "angle": math.pi - angle}
    made.simulation = SimulationSettings(until=1.0, start={"ladder": place})
    return made


@pytest.mark.parametrize("method", ["dop853", "dopri5", "radau5"])
@pytest.mark.parametrize("length, mass", [(4.0, 10.0), (4e-3, 1e-6), (40.0, 1e6)])
@pytest.mark.parametrize("what", SILENT)
def test_a_ladder_at_rest_stays_so_beside_a_load_of_value_0(what, length, mass, method):
    run = simulate(ladder(length, mass, *SILENT[what]()), 0.2, instants=3, method=method)
    assert run.status == "completed" and not run.doubts
    assert {run.mode("foot")[-1], run.mode("top")[-1]} == {"stick"}
    assert abs(run["ladder"].angle[-1] - run["ladder"].angle[0]) < 1e-12


@pytest.mark.parametrize("method", ["dop853", "dopri5"])
@pytest.mark.parametrize("play, radius", [("0.2 mm", "10 mm"), ("0.05 mm", "4 mm")])
@pytest.mark.parametrize("pin", ["A", "B"])
def test_a_rough_pin_with_play_begins_where_no_force_acts(pin, play, radius, method):
    plain = mbody.makers.slider_crank(
        "50 mm", "150 mm", masses=("0.2 kg", "0.3 kg", "0.5 kg"), speed=60.0
    )
    rough = {"clearance": play, "pin_radius": radius, "restitution": 0.5, "friction": 0.1}
    parts = [dataclasses.replace(e, **rough) if e.name == pin else e for e in plain]
    made = mbody.Mechanism("play", units=plain.units, ground=dict(plain.ground.points))
    made.add(*parts)
    run = simulate(made, 0.008, method=method, instants=9)
    other = simulate(made, 0.008, method="radau5", instants=9)
    assert run.status == other.status == "completed"
    # it flies until its first impact, which both methods meet at the same time
    struck = [next(e.t for e in each.events if e.name == "impact") for each in (run, other)]
    assert struck[0] == pytest.approx(struck[1], rel=1e-6)
