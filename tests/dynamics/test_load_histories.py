"""What loads do is a result: forces, lengths, angles and rates, against closed forms."""

import math
from dataclasses import dataclass

import numpy as np
import pytest

import mbody
from mbody import (
    AngleDriver,
    Body,
    Damper,
    Force,
    Gravity,
    Marker,
    Mechanism,
    ModelError,
    Revolute,
    Spring,
    Torque,
    TorsionDamper,
    TorsionSpring,
    makers,
)
from mbody.model.loads import CustomLoad
from mbody.model.simulation import Question

T = np.linspace(0.0, 1.0, 7)
ANGLE, OMEGA = 0.3 + 2.0 * T, 2.0
#: The end of a rod of 1 that turns so, seen from C = (0, 2).
DX, DY = np.cos(ANGLE), np.sin(ANGLE) - 2.0
LENGTH = np.hypot(DX, DY)
RATE = (-np.sin(ANGLE) * DX + np.cos(ANGLE) * DY) * OMEGA / LENGTH


@dataclass(frozen=True)
class Pull(CustomLoad):
    """A force of (3, 4) at the mass centre of j."""

    def physics(self, i, j, p, t):
        return 0.0, 0.0, 0.0, 3.0, 4.0, 0.0


def rod(**how):
    machine = Mechanism("rod", ground={"C": (0.0, 2.0)}, **how)
    machine.add(
        Body("rod", mass=2.0, cg=(0.4, 0.1), points={"P": (1.0, 0.0)}),
        Revolute("O", "ground", "rod"),
        AngleDriver("motor", "rod", "0.3 rad + 2 rad/s * t"),
        Spring("spring", "ground.C", "rod.P", stiffness=5.0, free_length=0.7, preload=2.0),
        Damper("damper", "rod.P", "ground.C", coefficient=3.0),
        TorsionSpring("twist", "rod", stiffness=4.0, free_angle=0.5),
        TorsionDamper("brake", "rod", coefficient=1.5),
        Force("push", "rod.P", 7.0, angle=0.4), Torque("turn", "rod", value=6.0),
        Gravity("weight", y=-10.0), Pull("pull", "ground", "rod"),
    )  # fmt: skip
    return machine


CLOSED = {
    "spring.length": LENGTH,
    "spring.rate": RATE,
    "spring.force": 2.0 + 5.0 * (LENGTH - 0.7),
    "spring.fx": -(2.0 + 5.0 * (LENGTH - 0.7)) * DX / LENGTH,
    "spring.fy": -(2.0 + 5.0 * (LENGTH - 0.7)) * DY / LENGTH,
    "damper.force": 3.0 * RATE,
    "damper.length": LENGTH,
    "damper.rate": RATE,
    "damper.fx": 3.0 * RATE * DX / LENGTH,  # on its body j, the ground
    "twist.torque": -4.0 * (ANGLE - 0.5),
    "twist.angle": ANGLE,
    "twist.rate": OMEGA + 0.0 * T,
    "brake.torque": -3.0 + 0.0 * T,
    "push.fx": 7.0 * math.cos(0.4) + 0.0 * T,
    "push.fy": 7.0 * math.sin(0.4) + 0.0 * T,
    "push.force": 7.0 + 0.0 * T,
    "push.torque": 0.0 * T,
    "turn.torque": 6.0 + 0.0 * T,
    "pull.force": 5.0 + 0.0 * T,
    # of the mass centre's force about the place of the load, the rod's origin
    "pull.torque": (0.4 * np.cos(ANGLE) - 0.1 * np.sin(ANGLE)) * 4.0
    - (0.4 * np.sin(ANGLE) + 0.1 * np.cos(ANGLE)) * 3.0,
    "rod.origin.x": 0.0 * T,
    "rod.origin.vy": 0.0 * T,
}


@pytest.mark.parametrize("name", CLOSED)
@pytest.mark.parametrize("analysis", ["kinetostatics", "kinematics"])
def test_measures_of_loads(name, analysis):
    run = getattr(mbody, analysis)(rod(), t=T)
    # some tens of roundings of numbers of size 20
    np.testing.assert_allclose(run.measure(name), CLOSED[name], atol=1e-13 * 30)


def test_the_same_in_batches_and_sweeps():
    both = {"spring.stiffness": [5.0, 9.0], "rod.P.x": [1.0, 1.0]}
    force = mbody.kinetostatics(mbody.assemble(rod()).with_values(both), t=T).measure(
        "spring.force"
    )
    np.testing.assert_allclose(force[0], CLOSED["spring.force"], atol=1e-12)
    np.testing.assert_allclose(force[1], 2.0 + 9.0 * (LENGTH - 0.7), atol=1e-12)
    made = makers.four_bar(1, 3, 2, 3.5, masses=(1, 3, 2), speed=10.0)
    made.add(Spring("spring", "ground", "rocker.B", stiffness=5.0))
    made.add(TorsionSpring("t", "rocker", stiffness=1.0))
    measures = ["peak(spring.force)", "last(spring.rate)", "first(t.torque)"]
    found = mbody.sweep(made, {"spring.stiffness": [5.0, 9.0]}, measure=measures, turn=True)
    for n, k in enumerate((5.0, 9.0)):
        one = mbody.kinetostatics(
            mbody.assemble(made).with_values({"spring.stiffness": k}), turn=True
        )
        spring, twist = one.load("spring"), one.load("t")
        wanted = np.abs(spring.force).max(), spring.rate[-1], twist.torque[0]
        np.testing.assert_allclose([found[m][n] for m in measures], wanted, rtol=1e-9)


def test_both_sides_and_all_bodies():
    run = mbody.kinetostatics(rod(), t=T)
    near, far = run.load("spring"), run.load("spring", on="ground")
    assert (near.on, near.by, far.on, far.by) == ("rod", "ground", "ground", "rod")
    np.testing.assert_allclose(far.fx, -near.fx)
    np.testing.assert_allclose(far.force, near.force)
    np.testing.assert_allclose(run.load("twist", on="ground").torque, -run.load("twist").torque)
    weight = run.load("weight", on="rod")
    np.testing.assert_allclose((weight.fx, weight.fy), (0.0 * T, -20.0 + 0.0 * T))
    for asked, words in (
        (("spring", "crank"), "has no history on 'crank'"),
        (("weight",), "acts on every body: name one"),
        (("springs",), "there is no load 'springs'"),
        (("pull", "ground"), "has no history on 'ground'"),
    ):
        with pytest.raises(ModelError, match=words):
            run.load(*asked)


def test_forces_of_a_free_motion_by_newton():
    """A mass on a spring and a damper: m a is what both do, at every instant."""
    machine = Mechanism("mass")
    machine.add(
        Body("m", mass=2.0, points={"P": (0.0, 0.0)}, guess=(1.3, 0.0, 0.0)),
        mbody.Prismatic("guide", "ground", "m"),
        Spring("s", Marker("ground", (-5.0, 0.0)), "m", stiffness=30.0, free_length=5.5),
        Damper("d", Marker("ground", (-5.0, 0.0)), "m", coefficient=0.8),
    )
    run = mbody.simulate(machine, 1.0)
    both = run.load("s").fx + run.load("d").fx
    np.testing.assert_allclose(2.0 * run["m"].ax, both, atol=1e-10)


def test_loads_in_data_and_events():
    run = mbody.kinetostatics(rod(), t=T)
    data = run.data()["loads"]
    assert set(data) == {"spring", "damper", "twist", "brake", "push", "turn", "pull"}
    assert set(data["spring"]) == {"on", "by", "fx", "fy", "force", "length", "rate"}
    np.testing.assert_allclose(data["twist"]["angle"], np.degrees(ANGLE))
    np.testing.assert_allclose(run.data("rad")["loads"]["twist"]["angle"], ANGLE)
    swing = Mechanism("swing")
    swing.add(
        Body("bob", mass=1.0, cg=(1.0, 0.0), guess=0.0), Revolute("O", "ground", "bob"),
        Gravity("g", y=-9.81), TorsionSpring("s", "bob", stiffness=2.0),
    )  # fmt: skip
    met = mbody.simulate(swing, 1.0, events=[mbody.Event("s.torque - 1 N*m", name="there")])
    assert [round(float(one.state.load("s").torque[0]), 9) for one in met.events][:1] == [1.0]


def test_a_models_own_question_by_its_name():
    machine = makers.four_bar(1, 3, 2, 3.5, masses=(1, 3, 2), speed=10.0)
    machine.add(Torque("brake", "rocker", value=1.0))
    machine.questions["hold"] = Question("brake", "motor.effort = 0")
    by_name = mbody.solve_for(machine, "hold")
    assert by_name[0].run.effort("motor")[0] == pytest.approx(0.0, abs=1e-9)
    in_words = mbody.solve_for(machine, "brake", "motor.effort = 0")
    assert by_name[0].unknowns == in_words[0].unknowns
