"""A short form of the campaign of statics and kinetostatics, and the linear program itself."""

import math

import numpy as np
import pytest
from numpy.testing import assert_allclose

import mbody
from tests.campaign.held import (
    HELD,
    Hand,
    Program,
    along,
    examine_held,
    faults_of_held,
    held,
    random_held,
)
from tests.campaign.scene_checks import Checks
from tests.campaign.scenes import Part, Scene, Touching
from tests.support.cases import first_fast

#: Seeds that jam (22, 39), or whose corners hang over the end of an edge, which the result says.
OPEN = (22, 26, 31, 39)
SEEDS = [seed for seed in range(80) if seed not in OPEN]


@first_fast("seed", SEEDS, 30)
@pytest.mark.processor
def test_forces_are_those_of_a_linear_program(seed):
    found = examine_held(seed)
    assert not (found.silent or found.doubted or found.refused), found.told


def ladder():
    """The ladder of docs/contact.md, whose band is known."""
    c, s = math.cos(1.0), math.sin(1.0)
    part = Part(
        "a", 200.0 / 9.80665, 1.0, {"P0": (-1.0, 0.0), "P1": (1.0, 0.0), "C": (0.0, 0.0)}, []
    )
    part.pose = [c, s, math.pi - 1.0]
    scene = Scene("groove", {"a": part}, {"O": (0.0, 0.0)}, gravity=9.80665)
    scene.lines = {"floor": ("O", 0.0), "wall": ("O", -0.5 * math.pi)}
    scene.touching = [
        Touching("foot", ("ground", "floor"), ("a", "P0"), 0.25, 0.25),
        Touching("top", ("ground", "wall"), ("a", "P1"), 0.15, 0.15),
    ]
    hand = Hand("hand", "a", "P0", 0.0)
    hand.value = along(scene, hand)
    return scene, hand


def test_the_program_has_the_band_of_a_ladder():
    scene, hand = ladder()
    run = mbody.statics(held(scene, [hand], "ladder"), t=[0.0])
    checks = Checks(scene, run)
    program = Program(checks, [hand], checks.states[0], False)
    band = program.band(program.effort("hand"))
    assert_allclose(band, [-123.7171, -10.7646], rtol=1e-5)
    # the same in the limit of no friction: W c/(2 s) at the wall
    for one in scene.touching:
        one.static = 0.0
    smooth = Program(checks, [hand], checks.states[0], False)
    assert_allclose(smooth.band(smooth.effort("hand")), [-100.0 / math.tan(1.0)] * 2, rtol=1e-9)


def test_what_balances_nothing_is_seen():
    """Pushed away from its floor, nothing holds it down; and no note is left to say so."""
    seed = next(s for s in SEEDS if random_held(s)[0].kind == "feet")
    scene, hands = random_held(seed)
    moving = any(hand.speed for hand in hands)
    analysis = mbody.kinetostatics if moving else mbody.statics
    run = analysis(held(scene, hands, "held"), t=[0.0])
    scene.down = (-scene.down[0], -scene.down[1])
    scene.pushes = {}
    (fault,) = faults_of_held(scene, hands, run, moving)
    assert fault.kind == "nothing balances"


def test_all_kinds_are_drawn():
    assert {random_held(seed)[0].kind for seed in range(40)} == set(HELD)
    assert np.isfinite([hand.value for seed in range(40) for hand in random_held(seed)[1]]).all()


@pytest.mark.parametrize("seed", [203, 316, 3056, 3070])
def test_a_ladder_near_jamming_presses_though_pulling_balances_too(seed):
    found = examine_held(seed)
    assert not (found.silent or found.doubted or found.refused), found.told


@pytest.mark.parametrize("seed", [4810059, 4810213])
def test_friction_of_what_rests_lets_a_stack_that_slides_press(seed, tmp_path):
    # the least forces pull at a corner; admissible ones press, whose friction is by N
    found = examine_held(seed)
    assert not (found.silent or found.doubted or found.refused), found.told
    scene, hands = random_held(seed)
    run = mbody.kinetostatics(held(scene, hands, "stack"), t=[0.0])
    mbody.save_run(run, tmp_path / "run.npz")
    for one in (run, mbody.load_run(tmp_path / "run.npz")):
        assert one.mode("b c") == ["stick"]
        assert (one.unique_effort("hand a"), one.unique_effort("hand b")) == (True, False)
    kept = mbody.load_run(tmp_path / "run.npz").range("hand b")
    assert_allclose([kept.low, kept.high], [run.range("hand b").low, run.range("hand b").high])
