"""What steps with impulses do not do."""

from __future__ import annotations

from mbody.analysis.dynamics.options import MotionRequest
from mbody.errors import ModelError
from mbody.model.contact import Contact, Rope
from mbody.model.element import listed
from mbody.model.joint_contacts import contacts_of
from mbody.system.system import System

__all__ = ["refuse_what_does_not_fit"]


def refuse_what_does_not_fit(system: System, request: MotionRequest) -> None:
    """Refuse what this method does not do.

    Raises
    ------
    ModelError
    """
    machine = system.mechanism
    if request.events:
        names = listed(event.name for event in request.events)
        raise ModelError(
            f"the method 'moreau' locates no events ({names}): take dop853, or leave them out"
        )
    shapeless = [one.described for one in machine.contacts if not isinstance(one, Contact | Rope)]
    shapeless += [joint.name for joint in machine.joints if contacts_of(joint)]
    if shapeless:
        raise ModelError(
            f"the method 'moreau' has contacts of shapes and ropes, no stops, limits and joints "
            f"that separate ({listed(dict.fromkeys(shapeless))}): take dop853",
            shapeless[0],
        )
    if request.release:
        raise ModelError(
            f"the method 'moreau' releases no drivers ({listed(request.release)}): take dop853"
        )
    rough = [
        one.name for one in (*machine.joints, *machine.couplings) if one.frictions(system.numbers)
    ]
    if rough:
        raise ModelError(
            f"the method 'moreau' has friction in contacts, not in joints ({listed(rough)}): take "
            "dop853, or leave out the friction of joints",
            rough[0],
        )
