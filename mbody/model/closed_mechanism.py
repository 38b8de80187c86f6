"""Copies of a mechanism that are closed to additions: what systems keep."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

from mbody.errors import ModelError
from mbody.laws import Constant
from mbody.model.contact import OneSided, Spot
from mbody.model.element import Element, Marker
from mbody.model.joints import Joint, Revolute
from mbody.model.mechanism import Mechanism
from mbody.model.primitives import Signal
from mbody.model.states import Described, State, measured_names
from mbody.model.stop import Stop
from mbody.quantities import Formula, FormulaError

if TYPE_CHECKING:
    from mbody.model.element import Numbers
    from mbody.quantities.units import UnitSystem


# -- Formulas that are compiled when a mechanism is closed, for they may measure all that it has


def compiled_state(machine: Described, state: State) -> tuple[State, dict[str, Formula]]:
    """An own state with its rate as a law, and what the numbers of that were made of."""
    names = state.rate.names if isinstance(state.rate, Formula) else frozenset[str]()
    try:
        quantities = measured_names(machine, names)
    except FormulaError as error:
        raise ModelError(f"'{state.name}': rate: {error}", state.name) from None
    return state.compiled(machine.parameters.scope(), quantities)


def compiled_stop(machine: Described, stop: Stop) -> tuple[Stop, dict[str, Formula]]:
    """A stop with its formula as a law, and what the numbers of that were made of."""
    try:
        quantities = measured_names(machine, stop.names(machine.measures))
    except FormulaError as error:
        raise ModelError(f"stop '{stop.name}': {error}", stop.name) from None
    return stop.compiled(machine.parameters.scope(), machine.measures, quantities)


def snapshot(machine: Mechanism, *, groups: bool = False) -> Mechanism:
    """The mechanism as it is now, closed to additions: what a system keeps; with single contacts in
    the place of their groups, unless these are to stay.
    """
    if machine.is_closed:
        return machine
    kept = machine if groups else _with_single_contacts(machine)
    elements, formulas = {one.name: one for one in kept}, dict(kept.formulas)
    for state in kept.described_states:
        elements[state.name], own = compiled_state(kept, state)
        formulas |= own
    for stop in (one for one in kept.contacts if isinstance(one, Stop)):
        elements[stop.name], own = compiled_stop(kept, stop)
        formulas |= own
    return kept.closed_with(elements.values(), formulas)


def _with_single_contacts(machine: Mechanism) -> Mechanism:
    """The mechanism with contacts in the place of their groups."""
    if not machine.groups:
        return machine
    gone = {group.name for group in machine.groups}
    rest = [one for one in machine if one.name not in gone]
    kept = machine.closed_with(rest, _without(machine, gone)).copied()
    for group in machine.groups:
        own = machine.described_group(group.name)
        kept.add(*own.contacts((*machine.bodies, machine.ground)))
    return kept


def without_contacts(machine: Mechanism) -> Mechanism:
    """The mechanism without contacts, ropes and groups of contacts, closed to additions."""
    gone = {one.name for one in (*machine.contacts, *machine.groups)}
    rest = [one for one in machine if one.name not in gone]
    return machine.closed_with(rest, _without(machine, gone))


def with_others(machine: Mechanism, gone: set[str], others: Iterable[Element]) -> Mechanism:
    """The mechanism with other elements, in the place of those of their names or else at the end,
    and without those that are gone, closed to additions; all numbers follow what they followed.
    """
    new = {one.name: one for one in others}
    old = {one.name: one for one in machine if one.name in new or one.name not in gone}
    return machine.closed_with((old | new).values())


def with_element(machine: Mechanism, element: Element) -> Mechanism:
    """The mechanism with another element in the place of the one of that name, closed to additions;
    its numbers follow no parameters.
    """
    elements = {one.name: one for one in machine} | {element.name: element}
    return machine.closed_with(elements.values(), _without(machine, {element.name}))


def _without(machine: Mechanism, gone: set[str]) -> dict[str, Formula]:
    """Formulas of the numbers, except those of some elements."""
    return {
        name: formula
        for name, formula in machine.formulas.items()
        if name.partition(".")[0] not in gone
    }


# -- A mechanism with other numbers in some of its elements ------------------------------------


def with_changed(machine: Mechanism, elements: Iterable[Element], keys: Iterable[str]) -> Mechanism:
    """The mechanism with other elements in the place of those of their names. Their numbers that
    begin with one of the keys, such as ``"mass"``, follow no formulas any more; others do.

    >>> from dataclasses import replace
    >>> from mbody import makers
    >>> machine = makers.four_bar(1, 3, 2, 3.5)
    >>> with_changed(machine, [replace(machine["crank"], mass=2.0)], ["mass"])["crank"].mass
    2.0
    """
    new = list(elements)
    made = with_others(machine, set(), new)
    changed = tuple(f"{element.name}.{key}" for element in new for key in keys)
    kept = {k: formula for k, formula in machine.formulas.items() if not k.startswith(changed)}
    made.formulas = kept if changed else dict(machine.formulas)
    return made.copied()


# -- Contacts of joints: limits and separation -------------------------------------------------
#
# In a system of `simulate` they stand beside the joint, or in its place.


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

    def every_spot(self, at: Numbers) -> list[Spot]:
        """The flanks of the joint."""
        return [_spot(flank) for flank in self.joint.flanks(at)]

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
        """None: its force is reported at the mass centre, and its rows have no arm of their own."""
        return {}

    def refuse(self, at: Numbers, unit: str) -> None:
        """Nothing: the joint does."""

    @property
    def _angular(self) -> bool:
        return "angle" in self.joint.coordinates

    def quantities(self) -> dict[str, str]:
        """Quantities of a contact; the normal reaction of a revolute joint's limit is a torque."""
        return super().quantities() | ({"contact": "torque"} if self._angular else {})

    def every_spot(self, at: Numbers) -> list[Spot]:
        """The free coordinate of the joint, less the limit."""
        limit = Signal(Constant(0.0), [at[f"{self.joint.name}.limits.{self.end}"]])
        row = replace(self.joint.free_row(at), signal=limit)
        return [Spot.row(row, 1.0 if self.end == "low" else -1.0)]

    @property
    def described_as(self) -> str:
        """The joint."""
        return self.joint.name

    def overlapping(
        self, depth: float, place: tuple[float, float], values: Mapping[str, Any], units: UnitSystem
    ) -> str:
        """Where the joint is, and its limit."""
        limit = float(values[f"{self.joint.name}.limits.{self.end}"])
        at = limit - depth if self.end == "low" else limit + depth
        unit = "deg" if self._angular else units.length
        at, limit = (math.degrees(one) if self._angular else one for one in (at, limit))
        return (
            f"joint '{self.joint.name}' begins at {at:.6g} {unit}, beyond its limit of {limit:.6g} "
            f"{unit} ('{self.joint.name}.limits.{self.end}'): begin within, or change the limit"
        )


def _spot(flank: Any) -> Spot:
    """A flank as a place where two bodies may touch."""
    found = Spot.row(flank.normal, flank.sign, flank.tangent)
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


# -- Moving points, which results show ---------------------------------------------------------


def moving_points(mechanism: Mechanism) -> list[str]:
    """Points of links that are not pinned to the ground, such as "coupler.P"; of a pin that on the
    first of its links.

    >>> import mbody
    >>> moving_points(mbody.makers.four_bar(1, 3, 2, 3.5))
    ['crank.A', 'coupler.B']
    """
    order = {name: n for n, name in enumerate(["ground", *(b.name for b in mechanism.bodies)])}
    again: set[str] = set()
    for joint in mechanism.joints:
        if isinstance(joint, Revolute):
            sides = sorted((joint.i, joint.j), key=lambda marker: order[marker.body])
            names = [f"{marker.body}.{marker.point}" for marker in sides]
            again |= set(names if sides[0].body == "ground" else names[1:])
    names = [f"{body.name}.{point}" for body in mechanism.bodies for point in body.points]
    return [name for name in names if name not in again]
