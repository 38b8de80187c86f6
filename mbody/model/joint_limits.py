"""Contacts that joints bring: stops at the ends of their travel, and what holds in one sense only.

In a system of `simulate` they stand beside the joint, or in its place.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

from mbody.errors import ModelError
from mbody.laws import Constant
from mbody.model.contact import ContactCandidate, OneSided
from mbody.model.element import Marker
from mbody.model.joints import Joint
from mbody.model.mechanism import Mechanism
from mbody.model.model_notes import with_others
from mbody.model.primitives import Signal

if TYPE_CHECKING:
    from mbody.model.element import Numbers
    from mbody.quantities.units import UnitSystem


@dataclass(frozen=True)
class JointContact(OneSided):
    """A joint that can separate, as a contact."""

    joint: Any = field(default=None, metadata={"internal": True})

    @property
    def described(self) -> str:
        """The joint."""
        return str(self.joint.name)

    @property
    def bodies(self) -> tuple[str, str]:
        """(body of i, body of j)."""
        return self.joint.i.body, self.joint.j.body

    def places(self) -> dict[str, Marker]:
        """Those of the joint."""
        own: dict[str, Marker] = self.joint.places()
        return own

    def place(self, field: str) -> Marker:
        """One of `places`."""
        return self.places()[field]

    def numbers(self) -> dict[str, Any]:
        """Those of the joint, in whose place it stands."""
        own: dict[str, Any] = self.joint.numbers()
        return own

    def refuse(self, at: Numbers, unit: str) -> None:
        """Refuses numbers that the joint refuses."""
        self.joint.refuse(at, unit)

    def coefficients(self, at: Numbers) -> tuple[float, float]:
        """Kinetic and static friction."""
        joint = self.joint
        if "friction" not in joint.__dataclass_fields__ or joint.friction is None:
            return 0.0, 0.0
        mu = at[f"{joint.name}.friction"]
        return mu, mu if joint.static is None else at[f"{joint.name}.static"]  # type: ignore[return-value]  # one design

    def every_candidate(self, at: Numbers) -> list[ContactCandidate]:
        """The flanks of the joint."""
        return [_candidate(flank) for flank in self.joint.flanks(at)]

    def overlapping(
        self, depth: float, place: tuple[float, float], values: Mapping[str, Any], units: UnitSystem
    ) -> str:
        """By how much its bodies overlap."""
        i, j = self.bodies
        return (
            f"'{i}' and '{j}' overlap by {depth:.6g} {units.length} in joint '{self.name}' at the "
            "beginning: begin with them apart, or touching"
        )

    def restitution_of(self, at: Numbers) -> float:
        """Restitution, from 0 to 1."""
        if self.joint.restitution is None:
            return 0.0
        return at[f"{self.joint.name}.restitution"]  # type: ignore[return-value]  # one design


@dataclass(frozen=True)
class JointLimit(JointContact):
    """One end of the travel of a joint."""

    end: str = "low"

    def numbers(self) -> dict[str, Any]:
        """None of its own: they are the joint's, beside which it stands."""
        return {}

    def places(self) -> dict[str, Marker]:
        """None: its force is reported at the mass centre, and its rows have no position of
        their own.
        """
        return {}

    def refuse(self, at: Numbers, unit: str) -> None:
        """Nothing: the joint does."""

    @property
    def _angular(self) -> bool:
        return "angle" in self.joint.coordinates

    def quantities(self) -> dict[str, str]:
        """Quantities of a contact; the normal reaction of a revolute joint's limit is a torque."""
        return super().quantities() | ({"contact": "torque"} if self._angular else {})

    def every_candidate(self, at: Numbers) -> list[ContactCandidate]:
        """The free coordinate of the joint, less the limit."""
        limit = Signal(Constant(0.0), [at[f"{self.joint.name}.limits.{self.end}"]])
        row = replace(self.joint.free_row(at), signal=limit)
        return [ContactCandidate.row(row, 1.0 if self.end == "low" else -1.0)]

    @property
    def described_as(self) -> str:
        """The joint."""
        return self.joint.name

    def overlapping(
        self, depth: float, place: tuple[float, float], values: Mapping[str, Any], units: UnitSystem
    ) -> str:
        """Place of the joint, and its limit."""
        limit = float(values[f"{self.joint.name}.limits.{self.end}"])
        at = limit - depth if self.end == "low" else limit + depth
        unit = "deg" if self._angular else units.length
        at, limit = (math.degrees(one) if self._angular else one for one in (at, limit))
        return (
            f"joint '{self.joint.name}' begins at {at:.6g} {unit}, beyond its limit of {limit:.6g} "
            f"{unit} ('{self.joint.name}.limits.{self.end}'): begin within, or change the limit"
        )


def _candidate(flank: Any) -> ContactCandidate:
    """A flank as a place where two bodies may touch."""
    found = ContactCandidate.row(flank.normal, flank.sign, flank.tangent)
    kind = "" if flank.tangent is None else flank.tangent.kind
    if kind == "slipping":
        return replace(found, round=True, solid="circle")
    return replace(found, round=kind == "rack")


def contacts_of(joint: Joint) -> list[OneSided]:
    """The contacts that a joint brings."""
    found: list[OneSided] = [JointContact(joint.name, joint)] if joint.can_separate else []
    return found + [JointLimit(f"{joint.name}_{end}", joint, end) for end in joint.limited]


def limits_of(machine: Mechanism) -> list[OneSided]:
    """The limits of the joints of a mechanism."""
    limits: list[OneSided] = [
        one for joint in machine.joints for one in contacts_of(joint) if isinstance(one, JointLimit)
    ]
    for one in limits:
        if one.name in machine:
            raise ModelError(
                f"the name '{one.name}' is that of a limit of '{one.described}': rename the "
                f"{type(machine[one.name]).__name__} of that name",
                one.name,
            )
    return limits


def with_joint_contacts(machine: Mechanism) -> Mechanism:
    """The mechanism with the contacts that its joints bring, closed to additions: limits beside
    them, what can separate in their place.
    """
    limits_of(machine)  # refuses names that are taken
    return with_others(machine, set(), [one for j in machine.joints for one in contacts_of(j)])


def as_described(machine: Mechanism) -> Mechanism:
    """The mechanism without the contacts that its joints bring, and with contacts that may open in
    the place of those that are closed for good.
    """
    limits = {one.name for one in machine.contacts if isinstance(one, JointLimit)}
    joints = [one.joint for one in machine.contacts if type(one) is JointContact]
    closed = [one for one in machine.contacts if one.closed and one.name not in limits]
    opened = [replace(one, closed=(), rolls_from=()) for one in closed]
    if not (limits or joints or opened):
        return machine
    return with_others(machine, limits, [*joints, *opened])
