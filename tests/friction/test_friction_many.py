"""Friction in batches, on lanes, in sweeps, in cross-checks, and in random linkages."""

import numpy as np
import pytest

import mbody
from mbody.kernels.friction import CERTIFICATE
from tests.frictional_linkages import PARTS, examined, frictional_linkage
from tests.support.frictional import (
    cam_drive,
    drawer,
    followed_part,
    gear_pair,
    slider_crank,
    with_friction,
)
from tests.support.linkages import random_linkage, times_within

HEAVY = {"masses": (1.0, 2.0, 3.0), "length": 0.06}
ANGLES = np.linspace(0.1, 6.2, 40)

MACHINES = {
    "slider-crank": lambda: slider_crank(static=0.2, stribeck=0.3, viscous=1.0, **HEAVY),
    "gears": lambda: gear_pair(carrier=0.7, efficiency=0.9, pressure_angle="20 deg"),
    "cam": lambda: cam_drive("roller", friction=0.2, pin_radius=0.004),
    "flat cam": lambda: cam_drive("flat", friction=0.2),
}


def forces(run):
    efforts = [run.effort(driver.name) for driver in run.mechanism.drivers]
    reactions = [run.reaction(joint.name) for joint in run.mechanism.joints]
    parts = [getattr(r, key) for r in reactions for key in ("fx", "fy", "torque")]
    return np.array([*efforts, *parts, *run.losses.values()])


@pytest.mark.parametrize("name", MACHINES)
def test_lanes_are_as_one_by_one(name):
    system = mbody.assemble(MACHINES[name]())
    t = np.linspace(0.0, 0.3, 200)
    run = mbody.kinetostatics(system, t)
    whole = forces(run)
    for k in (0, 17, 63, 128, 199):
        one = mbody.kinetostatics(system, float(t[k]))
        top = np.abs(whole).max(axis=1)
        assert (np.abs(forces(one)[:, 0] - whole[:, k]) <= 1e-11 * (top + top.max())).all()


def test_a_batch_is_as_its_designs():
    system = mbody.assemble(slider_crank(**HEAVY))
    values = {"A.friction": np.linspace(0.0, 0.4, 21), "guide.length": np.linspace(0.05, 0.09, 21)}
    drive = {"motor": (ANGLES, 10.0, 0.0)}
    batch = mbody.kinetostatics(system.with_values(values), drive=drive)
    assert batch.friction.certified.all() and batch.losses["A"].shape == (21, 40)
    for n in (0, 7, 20):
        own = {name: float(value[n]) for name, value in values.items()}
        one = mbody.kinetostatics(system.with_values(own), drive=drive)
        top = np.abs(one.effort("motor")).max()
        assert np.abs(batch.effort("motor")[n] - one.effort("motor")).max() < 1e-11 * top
        assert np.abs(batch.losses["A"][n] - one.losses["A"]).max() < 1e-11 * top * 10.0
        assert batch.mode("guide")[n] == one.mode("guide")
        limits, own_limits = batch.range("motor"), one.range("motor")
        assert limits.low[n] == pytest.approx(own_limits.low, rel=1e-10)


def test_designs_that_jam_are_told():
    """Beside designs on lanes: P = F/(1 − 2 μ a/ℓ) where there is one."""
    mu = np.array([0.1, 0.4, 0.49, 0.6, 0.9])
    system = mbody.assemble(drawer(0.1)).with_values({"guide.friction": mu})
    run = mbody.kinetostatics(system, [0.0, 0.5])
    pull = run.effort("pull")
    assert pull[:3, 0] == pytest.approx(10.0 / (1.0 - 2.0 * mu[:3]), rel=1e-11)
    assert np.isnan(pull[3:]).all()
    assert [jam.coefficient for jam in run.friction.jams] == pytest.approx([0.5] * 4, rel=1e-9)
    assert run.status.startswith("doubtful: designs 3, 4: it jams at 2 of 2 instants")
    assert run.design(2).status == "completed"
    assert run.design(3).status.startswith("doubtful: it jams at 2 of 2 instants")
    assert run.friction.certified.tolist() == [[True] * 2] * 3 + [[False] * 2] * 2


def test_the_certificate_of_a_design_is_its_own():
    """Whatever the friction of the designs beside it, of which some are not certain."""
    system = mbody.assemble(slider_crank(**HEAVY))
    row = system.friction_rows.start + CERTIFICATE
    drive = {"motor": (ANGLES, 10.0, 0.0)}
    found = []
    for others in (0.1, 0.9, 5.0):
        mu = np.full(16, others)
        mu[3] = 0.1
        run = mbody.kinetostatics(system.with_values({"guide.friction": mu}), drive=drive)
        found.append(run.record.take(row)[3])
        assert run.friction.certified[0].all() == (others < 5.0)
    assert np.array_equal(found[0], found[1]) and np.array_equal(found[0], found[2])
    assert 0.0 < found[0].max() < 1.0


@pytest.mark.parametrize("name", MACHINES)
def test_other_engines_agree_or_say_why_not(name):
    found = mbody.crosscheck(MACHINES[name](), ["pinocchio", "pymunk", "mujoco"])
    assert found.agrees, str(found)
    assert "friction is of the real reaction" in str(found)


# -- random linkages ----------------------------------------------------------------------------


#: Of every kind from the least to the greatest coefficient, with slides and without, of one loop
#: to three.
SEEDS = {"plain": (1, 11, 14, 15), "gear": (0, 7, 10, 22), "slot": (6, 8), "cam": (3, 16)}


@pytest.mark.slow
@pytest.mark.parametrize("kind", SEEDS)
def test_random_linkages(kind):
    """Friction that is certified is the only solution; what is followed is one; jams begin where
    the dense solution ends. `python -m tests.frictional_linkages` takes a thousand.
    """
    found = []
    for seed in SEEDS[kind]:
        linkage = frictional_linkage(seed)
        assert linkage.kind == kind
        found += examined(linkage, np.random.default_rng(seed))
    assert not [str(one) for one in found if one.wrong]
    assert len(found) == 3 * len(SEEDS[kind]) and {one.found for one in found} >= {"certified"}


@pytest.mark.slow
def test_a_path_of_one_factor_on_all_coefficients():
    """Pins and guides grow by different laws of the coefficient: followed by one factor on all
    sizes of friction instead this linkage would seem to jam at 0.37 of it, where a solution is.
    """
    machine, turn = random_linkage(22, 2, sliders=True)
    machine = with_friction(machine, 3.0, 0.5, 0.5)
    times = times_within(machine, turn, 5)
    run = mbody.kinetostatics(machine, times[[0, 2, 4]])
    parts = [jam.coefficient / 3.0 for jam in run.friction.jams]
    assert parts[1] == pytest.approx(0.519714, abs=1e-6)
    for k, part in enumerate(parts):
        assert part == pytest.approx(followed_part(run, k), rel=PARTS)


def test_forces_that_grow_without_bound():
    """Of this linkage friction has no fold, its forces go to infinity at the part at which it jams:
    continuation by arclength in forces and part together ends at 0.80002780690188, too.
    """
    run = frictional_linkage(817).run
    part = run.friction.jams[0].coefficient / 3.0
    assert part == pytest.approx(0.80002780690188, rel=PARTS)
    assert followed_part(run, 0) == pytest.approx(0.80002780690188, rel=PARTS)
