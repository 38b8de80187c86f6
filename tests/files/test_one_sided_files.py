"""One-sided joints and contacts in model files and in the summary of mobility."""

import json

import mbody
from mbody.laws import Harmonic
from mbody.makers import four_bar


def test_one_sided_joints_in_files():
    places = {"A": (0.0, 0.0), "B": (0.3, 0.0), "C": (0.0, 0.0)}
    machine = mbody.Mechanism("joints of all kinds", ground=places)
    lift = Harmonic(mean=0.01, amplitude=0.01, frequency=1.0, phase=0.2)
    machine.add(
        mbody.Body("one", mass=1.0, inertia=0.01, points={"C": (0.0, 0.0)}),
        mbody.Body("two", mass=1.0, inertia=0.02, points={"C": (0.0, 0.0)}),
        mbody.Body("tappet", mass=0.5, inertia=0.01, points={"T": (0.0, 0.0)}),
        mbody.Body("mass", mass=1.0, points={"C": (0.0, 0.0)}),
        mbody.Revolute("A", "ground.A", "one.C"),
        mbody.Revolute("B", "ground.B", "two.C"),
        mbody.Gear(
            "mesh", "one.C", "two.C", radius_i=0.1, radius_j=0.2, backlash=2e-4, restitution=0.5
        ),
        mbody.Freewheel("stop", "ground.A", "one.C", clockwise=True),
        mbody.Prismatic("guide", "ground.A", "tappet.T"),
        mbody.CamFollower(
            "face",
            mbody.Marker("one", "C"),
            "tappet.T",
            lift,
            base_radius=0.04,
            flat=True,
            one_sided=True,
            restitution=0.1,
        ),
        mbody.Distance("strut", "ground.C", "mass.C", 0.3, one_sided="push"),
        mbody.PinSlot("slot", "ground.C", "mass.C", clearance="1 mm"),
        mbody.Revolute(
            "pin", "ground.C", "mass.C", clearance="0.1 mm", friction=0.1, pin_radius=0.01
        ),
    )
    again = mbody.from_toml(mbody.to_toml(machine))
    assert again == machine
    fields = {
        "mesh": {"backlash": 2e-4, "restitution": 0.5},
        "face": {"one_sided": True, "restitution": 0.1},
        "strut": {"one_sided": "push"},
        "slot": {"clearance": 1e-3},
        "pin": {"clearance": 1e-4, "friction": 0.1, "pin_radius": 0.01},
    }
    for name, values in fields.items():
        for field, value in values.items():
            assert getattr(again[name], field) == value, (name, field)


def test_mobility_says_what_holds_in_one_direction():
    """Every kind by name, in the data and in the summary; nothing is said where there is none."""
    machine = mbody.Mechanism("all kinds", ground={"O": (0.0, 0.0), "P": (0.0, 1.0)})
    machine.add(
        mbody.Body("arm", points={"O": (0.0, 0.0), "A": (1.0, 0.0)}),
        mbody.Body("bob", points={"C": (0.0, 0.0)}, shapes={"rim": {"disc": "C", "radius": 0.1}}),
        mbody.Revolute("O", "ground.O", "arm.O", limits=(None, 2.0)),
        mbody.Distance("strut", "ground.P", "bob.C", 1.0, one_sided="push"),
        mbody.Rope("rope", "arm.A", "bob.C", length=2.0),
        mbody.Stop("table", "bob.y + 3 m"),
        mbody.Freewheel("hub", "ground.O", "arm.O"),
        mbody.Between("touch", "bob.rim", "arm.*"),
    )
    found = mbody.mobility(machine)
    kinds = {
        "contacts": ("touch_1", "touch_2"),
        "ropes": ("rope",),
        "stops": ("table",),
        "freewheels": ("hub",),
        "limits": ("O_high",),
        "joints": ("strut",),
    }
    assert found.one_sided == kinds
    assert json.loads(json.dumps(found.data()))["one_sided"] == {
        kind: list(names) for kind, names in kinds.items()
    }
    said = " ".join(str(found).split())
    assert "ONE-SIDED 2 contacts, counted as open: 'touch_1', 'touch_2'; 1 rope" in said
    assert "1 limit of a joint, counted as open: 'O_high'" in said
    assert "1 joint that can separate, counted as closed: 'strut'" in said
    # counted so: the strut's row is among the rows, and the pin's two, no more
    assert found.of_joints.rows == 3
    plain = mbody.mobility(four_bar(1.0, 3.0, 2.0, 3.5))
    assert plain.data()["one_sided"] == {} and "ONE-SIDED" not in str(plain)
