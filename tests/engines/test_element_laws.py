"""Every kind of load and of friction in motion: the oracle's own laws; what was compared."""

import math

import pytest

import mbody
from mbody.model.loads import Load
from tests.faults.moving import MOVING, turner
from tests.support.cases import first_fast


@first_fast("name", MOVING, 6)
def test_the_oracle_has_a_law_of_its_own(name):
    report = mbody.crosscheck(MOVING[name](), "oracle")
    assert report.agrees is True and not report.not_compared, str(report)
    # beyond what their laws hold for both are compared all the same
    assert {doubt.kind for doubt in report.doubts} <= {"validity"}


def test_a_motor_with_a_current_is_not_expressible_where_nothing_follows_it():
    made = turner(
        mbody.DCMotor("m", "r", voltage=12.0, resistance=0.5, inductance=1e-3, constant=0.1),
        mbody.TorsionDamper("d", "r", coefficient=0.003),
    )
    report = mbody.crosscheck(made)
    assert report.agrees is True
    for name in ("pymunk", "mujoco"):
        if name in report.opinions:
            (one,) = report.opinions[name].not_expressible
            assert one.element == "m" and "m.current" in one.why


# -- what was compared ----------------------------------------------------------------------------


class Mine(Load):
    """A load of the user's that the oracle has no equations of."""

    def actions(self, at):
        """None."""
        return []


def test_what_no_engine_compared_is_named_and_nothing_agrees():
    made = turner(Mine("own"))
    report = mbody.crosscheck(made, "oracle")
    assert report.agrees is None and report.status == "completed"
    assert report.not_compared == ("r", "O", "g", "own")
    assert report.data()["agrees"] is None and report.data()["not_compared"][0] == "r"
    assert any("no other engine compared 'r', 'O', 'g', 'own'" in note for note in report.notes)
    assert str(report).splitlines()[-1].startswith("VERDICT   nothing differs; not compared")


def ladder(force, mu=0.6, a=math.pi * 75 / 180):
    length, mass = 4.0, 10.0
    shapes = {
        "floor": {"line": {"point": "O"}},
        "wall": {"line": {"point": "O", "angle": -math.pi / 2}},
    }
    made = mbody.Mechanism("ladder", ground={"O": (0, 0)}, ground_shapes=shapes)
    ends = {"foot": (-length / 2, 0), "top": (length / 2, 0)}
    made.add(
        mbody.Body("ladder", mass=mass, inertia=mass * length**2 / 12, points=ends),
        mbody.Gravity("g", y=-9.81),
        mbody.Force("F", "ladder", force, angle=2.8),
        mbody.Contact("foot", "ground.floor", "ladder.foot", friction=mu),
        mbody.Contact("top", "ground.wall", "ladder.top", friction=mu),
    )
    place = {"x": length / 2 * math.cos(a), "y": length / 2 * math.sin(a), "angle": math.pi - a}
    made.simulation = mbody.SimulationSettings(until=0.2, start={"ladder": place})
    return made


def test_forces_that_are_not_unique_are_no_difference():
    """A ladder that stays: accelerations are compared, and forces as far as they are unique."""
    made = ladder(150.0)
    report = mbody.crosscheck(made, ours=mbody.simulate(made, 0.2, instants=3))
    assert report.agrees is True
    quantities = {row.quantity for row in report.opinions["oracle"].rows}
    assert "ladder.ax" in quantities and "foot.fx" not in quantities


@pytest.mark.parametrize("part", [1.1, -1.0])
def test_the_balance_asks_for_pressing_and_cones(part, monkeypatch):
    """Friction by a tenth beyond its cone, and a foot that pulls."""
    made = ladder(150.0)
    run = mbody.simulate(made, 0.2, instants=3)
    plain = type(run).reaction

    def scaled(self, name):
        found = plain(self, name)
        if name == "foot":
            size = part * 0.6 * found.fy / found.fx if part > 0 else 1.0
            object.__setattr__(found, "fx", size * found.fx)
        return found

    if part > 0:
        monkeypatch.setattr(type(run), "reaction", scaled)
    else:
        pulls = lambda self, name: -plain(self, name).fy  # noqa: E731
        monkeypatch.setattr(type(run), "contact", pulls)
    rows = mbody.crosscheck(made, "oracle", ours=run).opinions["balance"].rows
    names = {row.quantity for row in rows if row.verdict == "differs"}
    wanted = "foot: force within its friction cone" if part > 0 else "foot: presses"
    assert wanted in names
