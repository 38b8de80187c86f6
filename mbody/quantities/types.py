"""Types of what numbers are given as, and of fields that take more than they return.

Every number may be given as text with units. The field that takes it returns a float, so its type
has two sides: `Converted` states both, as a descriptor does. Type checkers take the type of an
argument from ``__set__`` and that of the attribute from ``__get__`` (PEP 681; mypy and pyright
agree). At run time the fields are ordinary ones of a dataclass.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence
from typing import Any, Generic, Protocol, TypeAlias, TypeVar

import numpy as np

from mbody.quantities.formula import Formula

Read = TypeVar("Read", covariant=True)
Given = TypeVar("Given", contravariant=True)


class QuantityWithUnit(Protocol):
    """A number with a unit, as pint has them."""

    @property
    def magnitude(self) -> Any:
        """The number, or an array of them."""

    @property
    def dimensionality(self) -> Any:
        """Dimension by base quantities, as Pint has it."""


class Converted(Generic[Read, Given]):
    """Type of a field that takes what is `Given` and returns what is `Read`."""

    def __get__(self, instance: object, owner: Any = None) -> Read:
        raise NotImplementedError

    def __set__(self, instance: object, value: Given) -> None:
        raise NotImplementedError


#: A number in the units of the mechanism, text such as ``"1.5 lbf"`` or ``"2*a"``, or a quantity;
#: or text that has been read.
Number: TypeAlias = "float | str | np.floating[Any] | np.integer[Any] | QuantityWithUnit | Formula"
#: Several of them in a row.
NumberRow: TypeAlias = "Sequence[Number] | np.ndarray[Any, Any] | QuantityWithUnit"
#: A number in the units of the mechanism, without text.
PlainNumber: TypeAlias = "float | np.floating[Any] | np.integer[Any]"
#: One of them, or a row: instants, values of a driver, numbers of a batch.
PlainNumbers: TypeAlias = "PlainNumber | Sequence[PlainNumber] | np.ndarray[Any, Any]"
#: A field that takes any `Number` and returns a float. Until the element is added to a mechanism,
#: which has the units and the parameters, text is kept as a formula.
NumberField: TypeAlias = Converted[float, Number]
OptionalNumberField: TypeAlias = "Converted[float | None, Number | None]"


def default(value: Any, **metadata: Any) -> Any:
    """A `Converted` field with a default; type checkers would not take the plain value for one."""
    return dataclasses.field(default=value, metadata=metadata)


def default_made(maker: Callable[[], Any]) -> Any:
    """A `Converted` field whose default is made anew for every object."""
    return dataclasses.field(default_factory=maker)


def required() -> Any:
    """A `Converted` field without a default; mypy takes a field for a descriptor only where the
    class gives it a value.
    """
    return dataclasses.field()
