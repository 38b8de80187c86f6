"""What holds in one sense only: contacts, ropes, stops, limits, and joints that separate."""

from __future__ import annotations

from mbody.model.contact import Contact, Rope
from mbody.model.freewheel import Freewheel
from mbody.model.joint_contacts import JointLimit, contacts_of
from mbody.model.mechanism import Mechanism
from mbody.model.stop import Stop

__all__ = ["one_sided"]

#: The kinds that have classes, by the word that heads their names.
KINDS = {"contacts": Contact, "ropes": Rope, "stops": Stop, "freewheels": Freewheel}


def one_sided(mechanism: Mechanism) -> dict[str, tuple[str, ...]]:
    """The names of all that holds in one sense only, by kind: "contacts", "ropes", "stops",
    "freewheels", "limits" of joints by their ends, and "joints" that can separate or have play.
    Kinds of which there is none are left out.

    >>> from mbody import Body, Revolute
    >>> door = Mechanism("door", ground={"O": (0, 0)})
    >>> door.add(Body("leaf", points={"O": (0, 0)}))
    >>> door.add(Revolute("hinge", "ground.O", "leaf.O", limits=(0.0, 1.9)))
    >>> one_sided(door)
    {'limits': ('hinge_low', 'hinge_high')}
    """
    found = {
        kind: tuple(one.name for one in mechanism.contacts if isinstance(one, of))
        for kind, of in KINDS.items()
    }
    brought = [one for joint in mechanism.joints for one in contacts_of(joint)]
    found["limits"] = tuple(one.name for one in brought if isinstance(one, JointLimit))
    found["joints"] = tuple(joint.name for joint in mechanism.joints if joint.can_separate)
    return {kind: names for kind, names in found.items() if names}
