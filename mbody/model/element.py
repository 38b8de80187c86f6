"""What every element of a mechanism shares: a name, checked numbers, places on bodies.

An element is a frozen dataclass. Its number fields are declared with `number_field`, so that they
are checked when it is made and can be changed by dotted name (``"crank.mass"``,
``"spring.stiffness"``) when a system is given other values.
"""

from __future__ import annotations

import dataclasses
import functools
import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from numbers import Real
from typing import TYPE_CHECKING, Any, ClassVar, TypeAlias, cast

import numpy as np

from mbody.errors import ModelError
from mbody.laws import Law, as_law
from mbody.laws.base import FloatArray
from mbody.model.element_names import check_name
from mbody.model.primitives import Signal
from mbody.quantities import Formula
from mbody.quantities.deferred import is_pending
from mbody.quantities.number import number, one_number
from mbody.quantities.types import (
    Converted,
    Number,
    NumberField,
    OptionalNumberField,
    Quantity,
    default,
    required,
)
from mbody.quantities.units import dimension_of

if TYPE_CHECKING:
    from mbody.model.own_equations import OwnState

__all__ = [
    "Element",
    "BodyName",
    "InheritedPlace",
    "LawLike",
    "Marker",
    "NumberField",
    "Numbers",
    "OptionalNumberField",
    "OptionalLaw",
    "Place",
    "Point",
    "PointLike",
    "Polar",
    "as_body",
    "as_marker",
    "body_field",
    "law_field",
    "listed",
    "number",
    "number_field",
    "one_number",
    "place_field",
    "place_name",
    "point_numbers",
    "polar",
]

#: A field for a place: it takes a `Marker`, or text such as "crank.A", and returns a `Marker`.
Place: TypeAlias = "Converted[Marker, Marker | str]"
#: The same in a base class: of an inherited field of a frozen class mypy knows the type of the
#: argument only, and would take it for that of the attribute.
InheritedPlace: TypeAlias = Any
Limits: TypeAlias = "tuple[Number | None, Number | None] | list[Number | None]"
#: A field for the least and the greatest value of a coordinate: numbers, None for no end.
LimitsField: TypeAlias = "Converted[tuple[Any, Any] | None, Limits | None]"
#: A field for a law: it takes a number, a `Law` or a Python function, and returns a `Law`.
LawLike: TypeAlias = "Converted[Law, Number | Law | Callable[[float], float]]"
OptionalLaw: TypeAlias = "Converted[Law | None, Number | Law | Callable[[float], float] | None]"
#: A field for the name of a body: it takes the body too.
BodyName: TypeAlias = "Converted[str, str | Element]"
Value: TypeAlias = "float | np.ndarray[Any, np.dtype[np.float64]]"


@dataclass(frozen=True)
class Polar:
    """A point given as in textbooks: distance [length] and angle [rad] in the link's axes."""

    r: NumberField = required()
    angle: NumberField = required()


def polar(r: Number, angle: Number) -> Polar:
    """Point at distance `r` [length] and `angle` [rad] in the link's axes.

    >>> polar(2.0, 0.0)
    Polar(r=2.0, angle=0.0)
    """
    return Polar(r, angle)


#: The two ends of limits, as numbers are named by them: "A.limits.low".
ENDS = ("low", "high")
#: A point as an element keeps it, and what it is given as.
Point: TypeAlias = "tuple[float, float] | Polar"
PointLike: TypeAlias = "tuple[Number, Number] | list[Any] | FloatArray | Quantity | Polar"


def as_point(value: Any, element: str, field: str) -> Point:
    """A checked point: a pair (x, y) [length] or a `Polar`."""
    if isinstance(value, Polar):
        return Polar(
            number(value.r, "length", element, f"{field}.r"),
            number(value.angle, "angle", element, f"{field}.angle"),
        )
    try:
        x, y = value
    except (TypeError, ValueError):
        raise ModelError(
            f"'{element}': {field} must be a pair (x, y) or polar(r, angle), not {value!r}", element
        ) from None
    return (
        number(x, "length", element, f"{field}.x"),
        number(y, "length", element, f"{field}.y"),
    )


def point_numbers(point: Point, name: str) -> dict[str, Any]:
    """The two changeable numbers of a point, by dotted name."""
    if isinstance(point, Polar):
        return {f"{name}.r": point.r, f"{name}.angle": point.angle}
    return {f"{name}.x": point[0], f"{name}.y": point[1]}


def place_name(name: str, point: Point) -> str:
    """Dotted name of the numbers of a place: a polar one has an angle beside the marker's own.

    >>> place_name("guide.i", polar(1.0, 0.5)), place_name("guide.i", (1.0, 0.5))
    ('guide.i.point', 'guide.i')
    """
    return f"{name}.point" if isinstance(point, Polar) else name


@dataclass(frozen=True)
class Marker:
    """A place on a body, with a direction.

    Parameters
    ----------
    body : str
        Name of the body (or ``"ground"``).
    point : str or pair or Polar
        A named point of the body, or coordinates [length] in the link's axes.
    angle : float
        Direction of the marker's own x axis in the link's axes [rad]; sliding joints and
        directed drivers use it.

    >>> Marker("ground", (0.0, 1.0), angle="30 deg").body
    'ground'
    """

    body: str
    point: Converted[str | Point, str | PointLike] = required()
    angle: NumberField = default(0.0)

    def __str__(self) -> str:
        return f"{self.body}.{self.point}" if isinstance(self.point, str) else self.body


def as_marker(value: Any, element: str, field: str) -> Marker:
    """A marker from a marker or from text such as ``"crank.A"`` (``"crank"`` is its origin)."""
    if isinstance(value, str):
        body, dot, name = value.partition(".")
        if not body or (dot and not name):
            raise ModelError(
                f"'{element}': {field} is {value!r}, it must name a body, or a body and one of its "
                'points: "crank" or "crank.A"',
                element,
            )
        return Marker(body, name or (0.0, 0.0))
    if isinstance(value, Marker) and isinstance(value.body, str):
        point = value.point
        if not isinstance(point, str):
            point = as_point(point, element, field)
        angle = number(value.angle, "angle", element, f"{field}.angle")
        return Marker(value.body, point, angle)
    raise ModelError(
        f"'{element}': {field} must be a place such as crank.at('A') or \"crank.A\", not {value!r}",
        element,
    )


def as_body(value: Any, element: str, field: str) -> str:
    """The name of a body, from the name or the body."""
    name = getattr(value, "name", value)
    if not isinstance(name, str) or not name:
        raise ModelError(f"'{element}': {field} must name a body, not {value!r}", element)
    return name


def listed(names: Iterable[str], most: int = 8) -> str:
    """Names as written in a sentence.

    >>> listed(["crank", "rod"])
    "'crank', 'rod'"
    >>> listed("abcdefghij")
    "'a', 'b', 'c', 'd', 'e', 'f', 'g', 'h' and 2 more"
    """
    quoted = [repr(name) for name in names]
    more = f" and {len(quoted) - most} more" if len(quoted) > most else ""
    return ", ".join(quoted[:most]) + more if quoted else "none"


def number_field(dimension: str, default: Any = dataclasses.MISSING, *, sign: str = "any") -> Any:
    """Dataclass field for one number of that dimension; `sign` may require "positive" or
    "not negative"; a default of None makes it optional.

    >>> number_field("length", 1.0, sign="positive").default
    1.0
    """
    return dataclasses.field(default=default, metadata={"dimension": dimension, "sign": sign})


def law_field(
    dimension: str, default: Any = dataclasses.MISSING, *, of: str = "time", sign: str = "any"
) -> Any:
    """Dataclass field for a law of time, or `of` another dimension: a number, a `Law`, a formula or
    a Python function; `sign` as of `number_field`, of the value of a law that is one number.
    """
    return dataclasses.field(default=default, metadata={"law": dimension, "of": of, "sign": sign})


def limits_field(dimension: str = "") -> Any:
    """Dataclass field for the least and the greatest value of a coordinate, a pair of numbers of
    that dimension or None; None of what has no limits.
    """
    return dataclasses.field(default=None, metadata={"limits": dimension})


def body_field(default: str = "") -> Any:
    """Dataclass field for the name of a body; it takes the body itself too."""
    return dataclasses.field(default=default, metadata={"body": True})


def place_field(default: Any = dataclasses.MISSING) -> Any:
    """Dataclass field for a marker (a place on a body)."""
    return dataclasses.field(default=default, metadata={"place": True})


@functools.cache
def _fields(kind: Any) -> tuple[dataclasses.Field[Any], ...]:
    """The fields of a class of elements that say what they are."""
    return tuple(field for field in dataclasses.fields(kind) if field.metadata)


@functools.cache
def _number_fields(kind: Any) -> tuple[tuple[str, str], ...]:
    """Of those that hold changeable numbers the name, and what they hold."""
    kinds = ("dimension", "limits", "law", "place")
    return tuple((field.name, k) for field in _fields(kind) for k in kinds if k in field.metadata)


@functools.cache
def _places(kind: Any) -> tuple[str, ...]:
    """Names of those that hold markers."""
    return tuple(field.name for field in _fields(kind) if "place" in field.metadata)


@dataclass(frozen=True)
class Element:
    """Base of all elements: checks its own fields when it is made.

    `main` names the fields that come first where an element is written on one line, as in
    ``{ revolute = ["ground.O2", "crank.O2"] }``.
    """

    main: ClassVar[tuple[str, ...]] = ()
    #: What it is in a mechanism: "body", "joint", "coupling", "driver" or "load".
    role: ClassVar[str] = ""
    #: Whether its laws may be formulas of measured quantities though it is no load.
    follows_formulas: ClassVar[bool] = False

    name: str

    def __post_init__(self) -> None:
        check_name(self.name, type(self).__name__)
        self._enter()
        if not self.pending:
            self._check()

    @functools.cached_property
    def pending(self) -> bool:
        """Whether numbers of it are text, which the mechanism turns into floats when it is added;
        it is checked as a whole then.
        """
        return is_pending(self)

    def _enter(self) -> None:
        """Let every field in: numbers, laws and places in the one form that they have inside."""
        for field in _fields(cast(Any, type(self))):
            value = getattr(self, field.name)
            if value is None and field.default is None:
                continue
            if "dimension" in field.metadata:
                value = self._checked(field, value)
            elif "limits" in field.metadata:
                value = self._limits(field, value)
            elif "law" in field.metadata:
                value = self._law(field, value)
            elif "place" in field.metadata:
                value = as_marker(value, self.name, field.name)
            elif "body" in field.metadata:
                value = as_body(value, self.name, field.name)
            else:
                continue
            object.__setattr__(self, field.name, value)

    def _check(self) -> None:
        """Refuse fields that do not fit together; all numbers are floats here."""

    def _checked(self, field: dataclasses.Field[Any], value: Any) -> float | Formula:
        dimension, sign = field.metadata["dimension"], field.metadata["sign"]
        result = number(value, dimension, self.name, field.name)
        if isinstance(result, Formula):
            return result
        if sign == "positive" and result <= 0.0:
            remedy = "it must be positive: give more than 0"
        elif sign == "not negative" and result < 0.0:
            remedy = "it must not be negative: give 0 or more"
        else:
            return result
        raise ModelError(f"'{self.name}': {field.name} is {result:g}, {remedy}", self.name)

    def _limits(self, field: dataclasses.Field[Any], value: Any) -> tuple[Any, Any]:
        """The least and the greatest value of a coordinate, None where there is none."""
        try:
            low, high = value
        except (TypeError, ValueError):
            raise ModelError(
                f"'{self.name}': {field.name} must be a pair (low, high), None for none, not "
                f"{value!r}",
                self.name,
            ) from None
        if low is None and high is None:
            raise ModelError(
                f"'{self.name}': {field.name} has neither end: give one, or leave it out", self.name
            )
        ends = zip(ENDS, (low, high), strict=True)
        low, high = (
            None
            if one is None
            else number(one, field.metadata["limits"], self.name, f"{field.name}.{end}")
            for end, one in ends
        )
        return low, high

    def _law(self, field: dataclasses.Field[Any], value: Any) -> Law | Formula:
        dimension, of = (dimension_of(field.metadata[key]) for key in ("law", "of"))
        if isinstance(value, Real) and not isinstance(value, bool):
            value = number(value, dimension, self.name, field.name)
        try:
            law = as_law(value, dimension, of)
        except ModelError as error:
            raise ModelError(f"'{self.name}': {field.name}: {error}", self.name) from None
        if getattr(law, "interpolation", None) == "hold":
            raise ModelError(
                f"'{self.name}': {field.name} is a table that holds its values, which jump: give "
                "it to an Input, which formulas name, or choose another interpolation",
                self.name,
            )
        return law

    def own_states(self) -> tuple[OwnState, ...]:
        """The states that it brings, which are integrated with the motion."""
        return ()

    def quantities(self) -> dict[str, str]:
        """The histories that a result has of it by its name, with the dimension of each."""
        return {}

    def places(self) -> dict[str, Marker]:
        """The element's markers by field name."""
        return {name: getattr(self, name) for name in _places(cast(Any, type(self)))}

    def place(self, field: str) -> Marker:
        """One of `places`."""
        return cast(Marker, getattr(self, field))

    def numbers(self) -> dict[str, Any]:
        """All changeable numbers of the element by dotted name; formulas while it is pending."""
        result: dict[str, Any] = {}
        for key, kind in _number_fields(cast(Any, type(self))):
            value, name = getattr(self, key), f"{self.name}.{key}"
            if value is None:
                continue
            if kind == "dimension":
                result[name] = value
            elif kind == "limits":
                ends = zip(ENDS, value, strict=True)
                result |= {f"{name}.{end}": one for end, one in ends if one is not None}
            elif kind == "place":
                result[f"{name}.angle"] = value.angle
                if not isinstance(value.point, str):
                    result |= point_numbers(value.point, place_name(name, value.point))
            elif isinstance(value, Law):
                own = value.numbers()
                plain = set(own) == {"value"}
                result |= {name if plain else f"{name}.{k}": v for k, v in own.items()}
        return result


def two_bodies(element: Element) -> None:
    """Refuse an element whose two places are on one body."""
    i, j = element.places()["i"], element.places()["j"]
    if i.body == j.body:
        raise ModelError(
            f"'{element.name}' would join '{i.body}' to itself: give places on two bodies",
            element.name,
        )


class Numbers:
    """Numbers by dotted name, each a float or an array over a batch axis, as elements read them.

    Lengths that reach the kernels are relative to mass centres, so the shift from the user's link
    axes happens here, once, for one set of numbers and for a batch alike.
    """

    def __init__(
        self,
        values: dict[str, Value],
        polar_points: frozenset[str],
        bodies: tuple[Any, ...] = (),
    ) -> None:
        self._values = values
        self._polar = polar_points
        self._arms: dict[tuple[str, str], tuple[Value, Value]] = {}
        #: The moving bodies, for loads that act on all of them.
        self.bodies = bodies

    def __getitem__(self, name: str) -> Value:
        return self._values[name]

    def has_point(self, name: str) -> bool:
        """Whether there is a point of that dotted name."""
        return name in self._polar or f"{name}.x" in self._values

    def point(self, name: str) -> tuple[Value, Value]:
        """(x, y) [length] of the point of that dotted name, in link axes."""
        if name in self._polar:
            r, angle = self._values[f"{name}.r"], self._values[f"{name}.angle"]
            return r * np.cos(angle), r * np.sin(angle)
        return self._values[f"{name}.x"], self._values[f"{name}.y"]

    def link_axes(self, body: str, x: float, y: float, angle: float) -> tuple[float, float, float]:
        """x, y [length] and angle [rad] of a body's link axes, by its mass centre and its angle."""
        cx, cy = (float(part) for part in self.point(f"{body}.cg"))
        c, s = math.cos(angle), math.sin(angle)
        return x - c * cx + s * cy, y - s * cx - c * cy, angle

    def place(self, element: Element, field: str) -> tuple[Value, Value]:
        """(x, y) [length] of a marker in link axes."""
        marker = element.place(field)
        if isinstance(marker.point, str):
            return self.point(f"{marker.body}.{marker.point}")
        return self.point(place_name(f"{element.name}.{field}", marker.point))

    def arm(self, element: Element, field: str) -> tuple[Value, Value]:
        """(x, y) [length] from the mass centre of the marker's body to the marker, in link axes."""
        found = self._arms.get((element.name, field))
        if found is None:
            x, y = self.place(element, field)
            cx, cy = self.point(f"{element.place(field).body}.cg")
            found = self._arms[element.name, field] = x - cx, y - cy
        return found

    def angle(self, element: Element, field: str) -> Value:
        """Direction [rad] of a marker's x axis in link axes."""
        return self._values[f"{element.name}.{field}.angle"]

    def law(self, element: Element, field: str) -> Signal:
        """One of the element's laws with its parameters."""
        value: Law = getattr(element, field)
        own = value.numbers()
        name = f"{element.name}.{field}"
        plain = set(own) == {"value"}
        numbers = {k: self[name if plain else f"{name}.{k}"] for k in own}
        return Signal(value, list(value.parameters(numbers)))
