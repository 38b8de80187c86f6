"""Physics of a user's own element in plain Python, called on the element as its numbers are now."""

from __future__ import annotations

import copy
import dataclasses
from typing import Any

from mbody.laws import Law
from mbody.model.element import Element, Numbers

__all__ = ["OwnPhysics", "WithOwnPhysics", "is_plain_field", "plain_field"]


class OwnPhysics:
    """``physics(i, j, p, t)`` of an element whose own numbers come behind the parameters `p`.

    A system may be given other numbers than the element was made with (`with_values`, a sweep, a
    batch). They reach the kernels as parameters; here they become fields again, so that physics
    finds in ``self.k`` the number that is in force.

    Parameters
    ----------
    element : Element
        With a method `physics`.
    count : int
        Number of parameters that `physics` itself takes.
    """

    def __init__(self, element: Element, count: int) -> None:
        self.count, self.element = count, element
        self.fields = _own(element)
        self._values = [_value(element, *field) for field in self.fields]
        self._present: Any = element

    def numbers(self, at: Numbers) -> list[Any]:
        """The element's own numbers, floats or arrays over a batch."""
        return [at[_name(self.element, *field)] for field in self.fields]

    def __call__(self, i: Any, j: Any, p: Any, t: float) -> Any:
        """The physics with the numbers in `p`."""
        values = p[self.count :].tolist()
        if values != self._values:
            self._present, self._values = self._with(values), values
        return self._present.physics(i, j, p[: self.count], t)

    def _with(self, values: list[float]) -> Any:
        """The element with other numbers."""
        changes: dict[str, Any] = {}
        laws: dict[str, dict[str, float]] = {}
        for (field, key), value in zip(self.fields, values, strict=True):
            if key:
                laws.setdefault(field, {})[key] = value
            else:
                changes[field] = value
        for field, numbers in laws.items():
            changes[field] = getattr(self.element, field).with_numbers(numbers)
        try:
            return dataclasses.replace(self.element, **changes)
        except TypeError:  # a class that is made in another way
            made = copy.copy(self.element)
            for field, value in changes.items():
                object.__setattr__(made, field, value)
            return made


class WithOwnPhysics:
    """What an element between two places needs so that its ``physics(i, j, p, t)`` is called."""

    def parameters(self: Any, at: Numbers) -> list[Any]:
        """Numbers handed to `physics` as `p`; by default both arms, from the mass centres [length],
        and the directions of both markers [rad].
        """
        return [*at.arm(self, "i"), *at.arm(self, "j"), at.angle(self, "i"), at.angle(self, "j")]

    def _hook(self: Any, at: Numbers) -> tuple[list[Any], OwnPhysics]:
        """All numbers of the element as the kernels hand them on, and what they call."""
        parameters = list(self.parameters(at))
        physics = OwnPhysics(self, len(parameters))
        return [*parameters, *physics.numbers(at)], physics


def _own(element: Element) -> list[tuple[str, str]]:
    """Fields of numbers, and of laws with each of their numbers."""
    found = []
    for field in dataclasses.fields(element):
        value = getattr(element, field.name)
        if "dimension" in field.metadata and value is not None:
            found.append((field.name, ""))
        elif "law" in field.metadata and isinstance(value, Law):
            found += [(field.name, key) for key in value.numbers()]
    return found


def _value(element: Element, field: str, key: str) -> Any:
    value = getattr(element, field)
    return value.numbers()[key] if key else value


def _name(element: Element, field: str, key: str) -> str:
    """The dotted name of a number."""
    name = f"{element.name}.{field}"
    plain = not key or set(getattr(element, field).numbers()) == {"value"}
    return name if plain else f"{name}.{key}"


def is_plain_field(element: Element, field: str) -> bool:
    """Whether that is a number of a class of a user's own that was not declared as one."""
    own = {f.name: f for f in dataclasses.fields(element)}
    if field not in own or own[field].metadata:
        return False
    value = getattr(element, field)
    return isinstance(value, (int, float)) and not isinstance(value, bool)


def plain_field(element: Element, field: str) -> str:
    """The sentence for such a number that is to be changed."""
    kind, value = type(element).__name__, getattr(element, field)
    return (
        f"'{element.name}.{field}' cannot be changed: {kind} has it as a plain number; declare it "
        f'as {field}: float = mbody.number_field("force", {value!r}), with what it measures '
        'instead of "force"'
    )
