"""Users' own joints and loads obey the contract and agree with the built-in ones."""

import numpy as np
import pytest

import mbody
from mbody import AngleDriver, Body, Mechanism, Prismatic, Revolute, Torque
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
