"""What a formula of the present instant may measure: names of quantities that need no forces."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, Protocol

from mbody.model.driver import DRIVEN
from mbody.model.element import Element, listed
from mbody.quantities import FormulaError
from mbody.quantities.units import Dimension, dimension_of

#: What can be measured of a body, with its dimension; of a point all but the angles.
MOTION = {
    **dict.fromkeys(("x", "y"), "length"),
    **dict.fromkeys(("vx", "vy"), "velocity"),
    **dict.fromkeys(("ax", "ay"), "acceleration"),
}
TURNING = {"angle": "angle", "omega": "angular velocity", "alpha": "angular acceleration"}
#: The origin of a link's axes, unless it has a point of that name.
ORIGIN = "origin"
#: Keys of quantities that follow from forces: they are known when the formula has been evaluated.
OF_FORCES = (
    "ax",
    "ay",
    "alpha",
    "acceleration",
    "effort",
    "power",
    "fx",
    "fy",
    "force",
    "torque",
    "loss",
    "contact",
)


class Described(Protocol):
    """A mechanism, as far as it has been described."""

    @property
    def inputs(self) -> Sequence[Any]:
        """Its inputs."""

    @property
    def states(self) -> Sequence[Any]:
        """Its own states."""

    @property
    def parameters(self) -> Any:
        """Its parameters."""

    @property
    def measures(self) -> Mapping[str, Any]:
        """Its measures."""

    def __getitem__(self, name: str) -> Element:
        """The element of that name."""

    def __contains__(self, name: object) -> bool:
        """Whether there is one."""

    def __iter__(self) -> Iterator[Element]:
        """All elements."""


def measured_names(machine: Described, names: frozenset[str]) -> dict[str, Dimension | None]:
    """Those of the names in a formula that are no numbers of the description, with the dimension
    of each: inputs, own states, and dotted names.
    """
    own = {one.name: one.dimension for one in machine.inputs}
    own |= {one.name: one.dimension for one in machine.states}
    found: dict[str, Dimension | None] = {}
    for name in sorted(names):
        if name in own:
            found[name] = own[name]
        elif "." in name:
            found[name] = state_quantity(machine, name)
    return found


def state_quantity(machine: Described, name: str) -> Dimension:
    """The dimension of a quantity of the present state, by its dotted name."""
    owner, _, key = name.rpartition(".")
    element, _, point = owner.partition(".")
    if element != "ground" and element not in machine:
        there = listed(["ground", *(one.name for one in machine)])
        raise FormulaError(
            f"there is no '{element}' to measure '{name}' of (there are: {there}): add it before, "
            "or correct the name"
        )
    known = _known(machine[element], point)
    if key in known:
        return dimension_of(known[key])
    if key in OF_FORCES:
        raise FormulaError(
            f"'{name}' follows from the forces of the same instant, which follow from this "
            f"formula: measure positions and rates (of '{owner}': {listed(known)}), or filter it "
            "with a state of your own"
        )
    raise FormulaError(f"'{owner}' has no '{key}' to measure here (it has: {listed(known)})")


def _known(element: Element, point: str) -> Mapping[str, str]:
    """Quantities of the present state that an element, or one of its points, has."""
    owned: object = element
    if element.role == "body":
        points: Mapping[str, object] = getattr(owned, "points", {})
        if point and point != ORIGIN and point not in points:
            raise FormulaError(
                f"'{element.name}' has no point '{point}' (it has: {listed(points)})"
            )
        whole = MOTION if point else MOTION | TURNING
        return {key: of for key, of in whole.items() if key not in OF_FORCES}
    if point:
        raise FormulaError(f"'{element.name}' has no points: it is no body")
    if element.role == "driver":
        return {key: element.quantities()[key] for key in DRIVEN[:2]}
    found = {key: of for key, of in element.quantities().items() if key not in OF_FORCES}
    if element.role != "load":
        return found
    load: Any = element
    made = {key: of for key, (_, of) in load.outputs().items()}
    states = {one.name.rpartition(".")[2]: one.measure for one in load.own_states()}
    return found | made | states | _described(element)


def _described(load: Element) -> dict[str, str]:
    """The numbers and the laws of time of a load, which do not follow from the motion."""
    found = {}
    for field in dataclasses.fields(load):
        meta, value = field.metadata, getattr(load, field.name)
        if "dimension" in meta and value is not None:
            found[field.name] = meta["dimension"]
        elif meta.get("of") == "time" and value is not None:
            found[field.name] = meta["law"]
    return found
