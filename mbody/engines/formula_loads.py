"""Loads and drivers by formulas, inputs, own states, friction in joints and contacts, which other
engines lack.
"""

from __future__ import annotations

import dataclasses

from mbody.engines.opinion import Inexpressible
from mbody.engines.oracle.friction import rubs
from mbody.laws import MeasuredFormula
from mbody.model.contact import Rope
from mbody.model.element import Element
from mbody.model.loads import Tyre
from mbody.model.mechanism import Mechanism

__all__ = [
    "contacts_without_counterpart",
    "follows_formula",
    "followed_states",
    "separating",
    "signals_of",
    "smooth_alone",
    "without_counterpart",
]


def follows_formula(element: Element) -> bool:
    """Whether one of its laws is a formula of measured quantities."""
    fields = dataclasses.fields(element)
    return any(isinstance(getattr(element, part.name), MeasuredFormula) for part in fields)


def without_counterpart(mechanism: Mechanism) -> tuple[Inexpressible, ...]:
    """What another engine's model of a mechanism has no counterpart of: loads and drivers by
    formulas, inputs, own states, controllers, friction in joints.

    >>> from mbody import makers
    >>> without_counterpart(makers.four_bar(1, 3, 2, 3.5))
    ()
    """
    loads = (one.name for one in (*mechanism.loads, *mechanism.drivers) if follows_formula(one))
    why = "its law is a formula of measured quantities"
    rough = (joint.name for joint in mechanism.joints if rubs(joint))
    found = [Inexpressible(name, why) for name in loads] + list(signals_of(mechanism))
    why = "its friction is of the real reaction"
    return (*found, *(Inexpressible(name, why) for name in rough))


def contacts_without_counterpart(mechanism: Mechanism) -> tuple[Inexpressible, ...]:
    """The contacts of a mechanism, for an engine that has none."""
    why = "it is a contact, whose impacts and sticking the oracle follows"
    touching = (*mechanism.contacts, *mechanism.groups)
    return tuple(Inexpressible(one.name, why) for one in touching)


def separating(mechanism: Mechanism) -> tuple[Inexpressible, ...]:
    """The joints that separate or meet limits in a motion, for an engine that has none."""
    why = "it separates, or has limits, at which the motion strikes"
    found = [one for one in mechanism.joints if one.can_separate or one.limited]
    return tuple(Inexpressible(one.name, why) for one in found)


def followed_states(mechanism: Mechanism) -> tuple[Inexpressible, ...]:
    """The tyres of a mechanism, whose slip no other engine follows over time."""
    tyres = [one for one in mechanism.loads if isinstance(one, Tyre)]
    return tuple(Inexpressible(one.name, "its slip is a state of its own") for one in tyres)


def signals_of(mechanism: Mechanism) -> tuple[Inexpressible, ...]:
    """The inputs, own states and controllers of a mechanism, as what another engine lacks."""
    found: list[Inexpressible] = []
    for what, elements in (
        ("an input", mechanism.inputs),
        ("a state of one's own", mechanism.described_states),
        ("a sampled controller", mechanism.controllers),
    ):
        found += [Inexpressible(one.name, f"it is {what}") for one in elements]
    return tuple(found)


def smooth_alone(mechanism: Mechanism) -> tuple[Inexpressible, ...]:
    """What elements do besides in a motion, and a file of smooth joints, always closed, does not:
    they touch, rub, separate, or meet limits.

    >>> from mbody import gallery
    >>> [one.element for one in smooth_alone(gallery.load("bouncing_ball"))]
    ['floor']
    """
    found = []
    for one in (*mechanism.contacts, *mechanism.groups):
        slack = isinstance(one, Rope)
        why = "it is a rope, without which places part" if slack else "bodies pass there"
        found.append(Inexpressible(one.name, why))
    for joint in mechanism.joints:
        besides = {
            "its friction": rubs(joint),
            "its limits": bool(joint.limited),
            "that it separates": joint.can_separate,
        }
        if lost := [what for what, has in besides.items() if has]:
            found.append(Inexpressible(joint.name, ", ".join(lost)))
    return tuple(found)
