"""Pictures of joints that separate in a motion: the same symbols as where they do not."""

import numpy as np
import pytest

import mbody
from mbody.views.page_data import scene_data
from mbody.views.scene import scene
from tests.support.picture_reader import artists

PLAY = {
    "gear": {"backlash": 2e-4},
    "rack": {"backlash": 2e-4},
    "road": {"one_sided": True, "friction": 0.5},
    "pin": {"clearance": 1e-3},
    "slot": {"clearance": 1e-3},
    "strut": {"one_sided": "push"},
}


def machine(separate):
    """A joint of each kind, all of which separate in a motion, or none."""
    more = PLAY if separate else {name: {} for name in PLAY}
    places = {"A": (0.0, 0.0), "B": (0.3, 0.0), "C": (0.0, 0.6), "D": (0.6, 0.6)}
    made = mbody.Mechanism("all kinds", ground=places)
    centre = {"C": (0.0, 0.0)}
    made.add(
        mbody.Body("one", mass=1.0, inertia=0.01, points=centre),
        mbody.Body("two", mass=1.0, inertia=0.02, points=centre),
        mbody.Body("rack", mass=1.0, inertia=0.02, points=centre, guess=(0.3, -0.2, 0.0)),
        mbody.Body("wheel", mass=1.0, inertia=0.02, points=centre, guess=(0.0, 0.7, 0.0)),
        mbody.Body(
            "bob", mass=1.0, inertia=0.02, points=centre | {"E": (0.3, 0.0)}, guess=(0.6, 0.6, 0)
        ),
        mbody.Body("block", mass=1.0, inertia=0.02, points=centre, guess=(0.3, 0.9, 0.0)),
        mbody.Body("load", mass=1.0, inertia=0.02, points=centre, guess=(-0.3, 0.3, 0.0)),
        mbody.Revolute("A", "ground.A", "one.C"),
        mbody.Revolute("B", "ground.B", "two.C"),
        mbody.Gear("gear", "one.C", "two.C", radius_i=0.1, radius_j=0.2, **more["gear"]),
        mbody.RackPinion("rack_pinion", "rack.C", "two.C", radius=0.2, **more["rack"]),
        mbody.Rolling("road", "ground.C", "wheel.C", radius=0.1, **more["road"]),
        mbody.Revolute("pin", "ground.D", "bob.C", **more["pin"]),
        mbody.PinSlot("slot", "ground.D", "block.C", **more["slot"]),
        mbody.Distance("strut", "ground.A", "load.C", 0.3 * 2.0**0.5, **more["strut"]),
        mbody.Gravity("gravity", y=-9.81),
    )
    return made


@pytest.fixture(scope="module")
def runs():
    found = {}
    for separate in (True, False):
        made = machine(separate)
        made.simulation = mbody.SimulationSettings(until=0.01, rtol=1e-8, instants=3)
        found[separate] = mbody.simulate(made)
    return found


def shapes(figure):
    """Extents of all named shapes and lines, in the units of the mechanism, by name."""
    found = {}
    for gid, artist in artists(figure).items():
        if hasattr(artist, "get_path"):
            own = getattr(artist, "get_patch_transform", lambda: None)()
            path = artist.get_path()
            found[gid] = (path if own is None else own.transform_path(path)).get_extents().extents
    return found


def test_joints_that_separate_look_as_those_that_do_not(runs):
    """Both begin alike: the wheels, the rack, the road, the pins and the bar are where they are."""
    one, other = (shapes(mbody.draw(runs[kind], 0)) for kind in (True, False))
    assert one.keys() == other.keys()
    for gid, box in other.items():
        np.testing.assert_allclose(one[gid], box, atol=1e-9, err_msg=gid)
    wheels = {"wheel:gear.i", "wheel:gear.j", "wheel:rack_pinion.j", "wheel:road.j"}
    assert wheels | {"rack:rack_pinion", "road:road", "rod:strut", "pin:pin"} <= one.keys()


def test_the_key_has_no_modes_that_nothing_shows(runs):
    assert set(runs[True].modes) == {"gear", "rack_pinion", "road", "pin", "slot", "strut"}
    texts = {text.get_text() for text in mbody.draw(runs[True], 0).axes[0].texts}
    assert not texts & {"open", "sticks", "rolls", "slides"}


def test_pages_and_films_have_them(runs):
    pages = [scene_data(scene(runs[kind]), []) for kind in (True, False)]
    names = [{str(shape.get("n", "")) for shape in page["shapes"]} for page in pages]
    assert names[0] >= names[1] and "wheel:gear.i" in names[0]
