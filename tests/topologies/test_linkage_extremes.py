"""`mbody.linkages` where arrays are empty, very large or very small, or far from the origin."""

import numpy as np
import pytest

import mbody

FOUR_BAR = {
    "joints": [[(0.0, 0.0), (1.0, 0.0), (3.0, 2.0), (4.0, 0.0)]],
    "links": [[(0, 1), (1, 2), (2, 3)]],
    "ground": [(0, 3)],
    "driver": [0],
}
MOVED = (0.0, -9.81)


def test_no_linkages_have_no_results():
    found = mbody.linkages({name: np.array(part)[:0] for name, part in FOUR_BAR.items()})
    assert found.positions.shape == (0, 200, 4, 2) and found.forces.shape == (0, 200, 3, 2, 2)
    assert found.failures == {} and str(found).startswith("0 linkages of 0 topologies")


def test_one_joint_is_no_linkage():
    one = {"joints": [[(0, 0)]], "links": [[(0,)]], "ground": [(0,)], "driver": [0]}
    assert mbody.linkages(one, instants=5).failures == {0: "its links have no length"}


def test_far_from_the_origin_it_is_as_near():
    """These coordinates are exact there, so that all is the same to rounding of the place."""
    near = mbody.linkages(FOUR_BAR, instants=21, gravity=MOVED)
    place = np.array([2.0**30, -(2.0**29)])
    far = mbody.linkages(
        FOUR_BAR | {"joints": np.array(FOUR_BAR["joints"]) + place}, instants=21, gravity=MOVED
    )
    assert far.failures == {}
    assert np.array_equal(far.forces, near.forces) and np.array_equal(far.torque, near.torque)
    # of 1e9 the last figure is 1.2e-7
    assert np.abs(far.positions - place - near.positions).max() < 2e-7


@pytest.mark.parametrize(
    ("arrays", "motion"),
    [
        ({"mass": [[1e300] * 3]}, {}),
        ({}, {"speed": 1e200}),
        ({}, {"speed": 1e-200}),
        ({}, {"gravity": (0.0, 1e300)}),
        ({"joints": 1e-300 * np.array(FOUR_BAR["joints"])}, {}),
        ({"joints": 1e100 * np.array(FOUR_BAR["joints"])}, {}),
    ],
    ids=["mass", "fast", "slow", "gravity", "small", "large"],
)
@pytest.mark.filterwarnings("error")
def test_sizes_too_far_apart_are_a_reason(arrays, motion):
    two = {name: np.repeat(part, 2, axis=0) for name, part in (FOUR_BAR | arrays).items()}
    two["joints"] = np.array(two["joints"])
    if not motion:
        # the other one is as it should be
        two["joints"][1] = FOUR_BAR["joints"][0]
        if "mass" in two:
            two["mass"][1] = 1.0
    found = mbody.linkages(two, instants=5, **{"gravity": MOVED} | motion)
    assert found.failures[0].startswith("its lengths, masses, speed and gravity are too far apart")
    assert np.isnan(found.forces[0]).all()
    assert motion or np.isfinite(found.forces[1]).all()


def test_numbers_that_no_index_holds():
    """2⁶⁴ − 1 would be −1, no joint, as a signed number."""
    links = np.array([[(0, 1), (1, 2), (2, 2**64 - 1)]], dtype=np.uint64)
    found = mbody.linkages(FOUR_BAR | {"links": links}, instants=5)
    assert found.failures[0] == "a link, the ground or a slide names a joint that there is not"


@pytest.mark.parametrize("kind", [np.int8, np.int16, np.uint8, np.int32, np.uint64])
def test_indices_of_any_whole_type(kind):
    arrays = {name: np.array(part) for name, part in FOUR_BAR.items()}
    own = {name: arrays[name].astype(kind) for name in ("links", "ground", "driver")}
    found = mbody.linkages(arrays | own, instants=5, gravity=MOVED)
    assert np.array_equal(found.forces, mbody.linkages(FOUR_BAR, instants=5, gravity=MOVED).forces)
