"""Users' own joints and loads obey the contract and agree with the built-in ones."""

import math

import numpy as np
import pytest

import mbody
from mbody import AngleDriver, Body, Force, Mechanism, Prismatic, Revolute, Torque
from mbody.laws import ConstantSpeed
from mbody.testing import check_joint, check_load
from tests.support.own_elements import ON_GROUND, Attraction, Drag, I, J, OwnRevolute, PointOnLine


@pytest.mark.parametrize(
    "element",
    [
        PointOnLine("slot", I, J),
        PointOnLine("slot", ON_GROUND, J),
        PointOnLine("slot", J, ON_GROUND),
        OwnRevolute("pin", I, J),
    ],
    ids=str,
)
def test_own_joints(element):
    report = check_joint(element)
    assert report.worst < 1e-8
    assert report["pickle"].error == 0.0


def test_own_loads():
    drag, pull = check_load(Drag("drag", "ground", J)), check_load(Attraction("pull", I, J))
    assert max(drag.worst, pull.worst) < 1e-8
    assert drag["dissipation"].note == "it never gives power"
    assert drag["velocity"].note == "its forces depend on velocities"
    assert pull["conservative"].note == "it has a potential"
    assert drag["pickle"].error == pull["pickle"].error == 0.0


def test_a_class_without_a_name_is_not_pickled():
    class Local(OwnRevolute):
        pass

    report = check_joint(Local("pin", I, J), states=2)
    assert math.isnan(report["pickle"].error)
    assert "no name in a module" in report["pickle"].note
    report = check_load(Force("push", J, lambda t: 2.0 * t), states=2)
    assert math.isnan(report["pickle"].error)


def test_own_revolute_is_the_built_in_one():
    run, own = (
        mbody.kinetostatics(machine, t=np.linspace(0.0, 0.6, 30))
        for machine in (four_bar(Revolute), four_bar(OwnRevolute))
    )
    scale = np.abs(run.effort("motor")).max()
    assert np.abs(run.effort("motor") - own.effort("motor")).max() < 1e-11 * scale
    for a, b in zip(forces_at(run, "B"), forces_at(own, "B"), strict=True):
        assert np.abs(a - b).max() < 1e-11 * run.reaction("B").magnitude.max()


def four_bar(kind):
    plain = mbody.makers.four_bar(1.0, 3.0, 2.0, 3.5, masses=(1.0, 3.0, 2.0), speed=10.0)
    machine = Mechanism("four-bar", ground=plain.ground.points)
    for element in plain:
        swap = element.name == "B"
        machine.add(kind("B", element.i, element.j) if swap else element)
    return machine


def forces_at(run, joint):
    reaction = run.reaction(joint)
    return reaction.fx, reaction.fy, reaction.torque


def test_pin_in_a_slot_is_a_massless_block_on_a_guide():
    def quick_return(*parts):
        machine = Mechanism("quick return", ground={"O": (0.0, 1.5)})
        machine.add(
            mbody.makers.bar("crank", 1.0, mass=1.0, ends=("O", "A"), guess=0.3),
            mbody.makers.bar("lever", 3.0, mass=2.0, ends=("L", "E"), guess=1.2),
            Revolute("O", "ground.O", "crank.O"),
            Revolute("L", "ground", "lever.L"),
            AngleDriver("motor", "crank", ConstantSpeed(0.3, 4.0)),
            Torque("work", "lever", value=7.0),
            *parts,
        )
        return mbody.kinetostatics(machine, t=np.linspace(0.0, 1.5, 40))

    slot = quick_return(PointOnLine("slot", "lever.L", "crank.A"))
    block = quick_return(
        Body("block"), Revolute("pin", "crank.A", "block"), Prismatic("slot", "lever.L", "block")
    )
    a = 0.3 + 4.0 * slot.t
    lever = np.unwrap(np.arctan2(1.5 + np.sin(a), np.cos(a)))
    assert np.abs(slot["lever"].angle - lever).max() < 1e-12
    scale = np.abs(block.effort("motor")).max()
    assert np.abs(slot.effort("motor") - block.effort("motor")).max() < 1e-11 * scale
    size = block.reaction("slot").magnitude.max()
    for n in (0, 1):
        one, other = forces_at(slot, "slot")[n], forces_at(block, "slot")[n]
        assert np.abs(one - other).max() < 1e-11 * size
    assert slot.checks.virtual_work < 1e-12
