"""Base of every element of a mechanism: a name, checked numbers, points on bodies.

An element is a frozen dataclass. Its number fields are declared with `number_field`, so that they
are checked when it is made and can be changed by dotted name (``"crank.mass"``,
``"spring.stiffness"``) when a system is given other values.
"""

from __future__ import annotations

import copy
import dataclasses
import functools
import math
import operator
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from numbers import Real
from typing import Any, ClassVar, TypeAlias, TypeVar, cast

import numpy as np

from mbody.errors import ModelError, brief
from mbody.laws import Constant, Law, as_law, compile_formula, compile_measured
from mbody.laws.expression import PostfixProgram
from mbody.laws.kernels import FloatArray
from mbody.laws.measured_formula import MeasuredFormula
from mbody.model.primitives import Signal
from mbody.quantities import FUNCTIONS, Formula, FormulaError, Scope, evaluate, parse
from mbody.quantities.formula import (
    Converted,
    Number,
    NumberField,
    QuantityWithUnit,
    default,
    formulas_in,
    is_pending,
    number,
    required,
    substituted,
)
from mbody.quantities.parse import Binary, Call, Measured, Name, Negative, Node, called, expanded
from mbody.quantities.units import DIMENSIONS, Dimension, dimension_of

# -- Names of elements and of their points -----------------------------------------------------

LONGEST_NAME = 200


def check_name(name: Any, what: str) -> None:
    """Refuse what cannot be the name of an element."""
    if not isinstance(name, str) or not name.strip():
        raise ModelError(f"every {what} needs a name, not {name!r}")
    if len(name) > LONGEST_NAME:
        raise ModelError(
            f"the name '{name[:20]}…' has {len(name)} characters: give at most {LONGEST_NAME}",
            name[:LONGEST_NAME],
        )
    if not name.isprintable():
        raise ModelError(f"the name {name!r} has characters that cannot be printed: leave them out")
    if "." in name:
        raise ModelError(
            f"'{name}': a name may not hold a dot, which parts body and point: write "
            f"'{name.replace('.', '_')}'",
            name,
        )


#: The start of a state at which its rate vanishes.
STEADY = "steady"

# -- Equations that an element brings with it: states of its own, and laws made of its numbers -
# An element writes them as text, by the names of its own fields and states: a DC motor ``"constant
# * current"``. They become formulas of measured quantities, in which each of these names has the
# element's before it, as ``motor.current``.


@dataclass(frozen=True)
class AuxiliaryState:
    """A state that an element brings, integrated with the motion as a `State`.

    `name`: Dotted: ``"motor.current"``.
    `rate`: Its rate.
    `measure`: What it measures, a name of `DIMENSIONS`.
    `start`: At the first instant.
    `start_number`: The element's number that is the start, by dotted name; empty where it is always
      zero.
    `size`: A typical value, to which its absolute error is relative.
    `accounts`: Whether it only adds up, for the account of energy: nothing follows from it.
    """

    name: str
    rate: MeasuredFormula
    measure: str
    start: Any = 0.0
    start_number: str = ""
    size: float | None = None
    accounts: bool = False

    @property
    def dimension(self) -> Dimension:
        """Dimension of the state."""
        return DIMENSIONS[self.measure]


@dataclass(frozen=True)
class AccountedEnergy:
    """A part of the account of energy that an element names beside its work.

    `kind`: "work" (what it takes from outside), "lost" or "stored".
    `values` (instants,): Since the beginning, or in store.
    """

    kind: str
    values: np.ndarray[Any, Any]


@functools.lru_cache(maxsize=256)
def equation(text: str, owner: str) -> MeasuredFormula:
    """The formula of an element's own text, whose names are its own; numbers in it are plain.

    >>> equation("constant * current", "motor").variables
    ('motor.constant', 'motor.current')
    """
    tree = owned(expanded(parse(text)), owner)
    program = PostfixProgram(tree.names)
    program.add(tree)
    constants = tuple(float(evaluate(part, Scope()).value) for part in program.constants)
    return MeasuredFormula(
        text, tuple(program.operations), tuple(program.variables_used), constants
    )


def signal_of(law: MeasuredFormula) -> Signal:
    """A law made by `equation`, as the kernels take it."""
    return Signal(law, list(law.constants))


def owned(node: Node, owner: str) -> Node:
    """The tree with the owner's name before every name."""
    match node:
        case Name(name=name):
            return node if name == "t" else Name(f"{owner}.{name}")
        case Measured(of=below) | Negative(of=below):
            return replace(node, of=owned(below, owner))
        case Binary(a=a, b=b):
            return replace(node, a=owned(a, owner), b=owned(b, owner))
        case Call(function=function, arguments=arguments):
            return Call(function, tuple(owned(argument, owner) for argument in arguments))
    return node


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
PointLike: TypeAlias = "tuple[Number, Number] | list[Any] | FloatArray | QuantityWithUnit | Polar"


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
    return (number(x, "length", element, f"{field}.x"), number(y, "length", element, f"{field}.y"))


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
        f"'{element}': {field} must be a place such as crank.at('A') or \"crank.A\", not "
        f"{brief(value)}",
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


#: Of more names than these a sentence names some.
MOST_NAMES = 8


def whole_number(name: str, value: Any, least: int = 1, most: int | None = None) -> int:
    """A whole number within bounds.

    >>> whole_number("turns", 2, 1, 1000)
    2
    >>> whole_number("sweep: threads", 0)
    Traceback (most recent call last):
    mbody.errors.ModelError: sweep: threads must be a whole number from 1 on, not 0
    """
    try:
        number = least - 1 if isinstance(value, bool) else operator.index(value)
    except TypeError:
        number = least - 1
    if number < least or (most is not None and number > most):
        span = f"{least} on" if most is None else f"{least} to {most}"
        raise ModelError(f"{name} must be a whole number from {span}, not {brief(value)}")
    return number


def takes_one_design(verb: str, batch: int | None) -> None:
    """Refuse a system of several designs. `batch`: Their number, None of a single one.

    >>> takes_one_design("simulate", None)
    """
    if batch is not None:
        raise ModelError(f"{verb} takes one design: choose one of the batch with design(n)")


def unknown_name(
    what: str, name: Any, known: Iterable[Any], *, use: str = "", more: str = ""
) -> ModelError:
    """The error of a name that a mechanism or a result does not have; of many names that it has,
    those that are spelled most like it come first.

    `known`: Names, or what has them.
    `use`: What it is wanted for, as " to draw".
    `more`: The end of the sentence.

    >>> str(unknown_name("driver", "moter", ["motor", "pump"]))
    "there is no driver 'moter' (there are: 'motor', 'pump')"
    >>> str(unknown_name("sweep: pin", "pin", [f"P{n}" for n in range(20)] + ["pins"]))[:59]
    "sweep: there is no pin 'pin' (there are: 'pins', 'P0', 'P1'"
    """
    verb, colon, noun = what.rpartition(": ")
    names = [getattr(one, "name", one) for one in known]
    if len(names) > MOST_NAMES and isinstance(name, str):
        import difflib  # a first answer does not need it

        close = difflib.get_close_matches(name[:60], names, 3)
        names.sort(key=lambda one: close.index(one) if one in close else len(close))
    return ModelError(
        f"{verb}{colon}there is no {noun} {brief(name)}{use} (there are: {listed(names)}){more}",
        str(name),
    )


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
        result = number(value, field.metadata["dimension"], self.name, field.name)
        if not isinstance(result, Formula):
            _refuse_sign(self.name, field, result, f"{result:g}")
        return result

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
        dimension, argument = (dimension_of(field.metadata[key]) for key in ("law", "of"))
        if isinstance(value, Real) and not isinstance(value, bool):
            value = number(value, dimension, self.name, field.name)
        try:
            law = as_law(value, dimension, argument)
        except ModelError as error:
            raise ModelError(f"'{self.name}': {field.name}: {error}", self.name) from None
        if getattr(law, "interpolation", None) == "hold":
            raise ModelError(
                f"'{self.name}': {field.name} is a table that holds its values, which jump: give "
                "it to an Input, which formulas name, or choose another interpolation",
                self.name,
            )
        return law

    def auxiliary_states(self) -> tuple[AuxiliaryState, ...]:
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


def check_identifier(element: Element) -> None:
    """Refuse a name that no formula could have."""
    if not element.name.isidentifier():
        what = "an input" if element.role == "input" else f"a {element.role}"
        raise ModelError(
            f"'{element.name}' cannot name {what}: formulas name it, so it has letters, digits "
            "and _ only, and begins with a letter",
            element.name,
        )


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
        self, values: dict[str, Value], polar_points: frozenset[str], bodies: tuple[Any, ...] = ()
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


# -- An element as a mechanism takes it: floats instead of text, laws instead of formulas ------

TIME = DIMENSIONS["time"]

E = TypeVar("E", bound=Element)


#: Dimensions of those of the names in a formula that are measured in a motion.
MeasuredDimensions: TypeAlias = "Callable[[frozenset[str]], Mapping[str, Dimension | None]]"


def _refuse_sign(name: str, field: dataclasses.Field[Any], value: Any, said: str) -> None:
    """Refuse a number of an element that its field does not take. `said`: It as it was given."""
    sign = field.metadata.get("sign")
    if sign == "positive" and value <= 0.0:
        remedy = "it must be positive: give more than 0"
    elif sign == "not negative" and value < 0.0:
        remedy = "it must not be negative: give 0 or more"
    else:
        return
    raise ModelError(f"'{name}': {field.name} is {said}, {remedy}", name)


def resolved(
    element: E, scope: Scope, measured: MeasuredDimensions
) -> tuple[E, dict[str, Formula], set[str]]:
    """The element with floats for all its text, in the units of the scope; laws by formulas of
    what is `measured` in a motion.
    """
    if not element.pending:
        return element, {}, set()
    formulas: dict[str, Formula] = {}
    laws: dict[str, Law] = {}
    for field in dataclasses.fields(element):
        value = getattr(element, field.name)
        if isinstance(value, Constant) and isinstance(value.value, Formula):
            # without a variable of its own: perhaps of measured quantities
            value = value.value
        if isinstance(value, Formula) and "law" in field.metadata:
            name = f"{element.name}.{field.name}"
            try:
                quantities = measured(value.names)
                calls = called(value.tree) - FUNCTIONS.keys()
                if quantities or (calls and value.variable):
                    laws[field.name], numbers = _of_measured(
                        element, field, value, scope, quantities
                    )
                elif value.variable:
                    law_argument = value.argument or TIME
                    laws[field.name], numbers = compile_formula(value, scope, law_argument)
                else:
                    continue
            except FormulaError as error:
                raise ModelError(f"'{element.name}': {field.name}: {error}", element.name) from None
            formulas |= {f"{name}.{key}": formula for key, formula in numbers.items()}
            formulas[name] = value
    changes: dict[str, Any] = dict(laws)
    with_laws = dataclasses.replace(element, **changes) if laws else element
    named = {k: v for k, v in with_laws.numbers().items() if isinstance(v, Formula)}
    formulas |= named
    values: dict[int, Any] = {}
    for name, formula in named.items():
        try:
            values[id(formula)] = formula.value(scope)
        except FormulaError as error:
            field_name = name.removeprefix(f"{element.name}.")
            raise ModelError(f"'{element.name}': {field_name}: {error}", element.name) from None

    def value_of(formula: Formula) -> Any:
        known = values.get(id(formula))
        return formula.value(scope) if known is None else known

    parts: dict[str, Any] = {}
    for field in dataclasses.fields(element):
        value = getattr(with_laws, field.name)
        try:
            parts[field.name] = substituted(value, value_of)
        except FormulaError as error:
            raise ModelError(f"'{element.name}': {field.name}: {error}", element.name) from None
        if isinstance(value, Formula) and "dimension" in field.metadata:
            unit = scope.system.of(dimension_of(field.metadata["dimension"]))
            said = (
                value.text
                if value.literal
                else f"{brief(value.text)} = {parts[field.name]:g} {unit}"
            )
            _refuse_sign(element.name, field, parts[field.name], said)
    made = dataclasses.replace(with_laws, **parts)
    others = {k: f for k, f in formulas_in(with_laws, element.name) if id(f) not in values}
    fixed = set().union(*(formula.names for formula in others.values()))
    formulas |= others
    return made, formulas, fixed


def _of_measured(
    element: Element,
    field: dataclasses.Field[Any],
    formula: Formula,
    scope: Scope,
    quantities: Mapping[str, Dimension | None],
) -> tuple[Law, dict[str, Formula]]:
    """The law of a formula of measured quantities, where the element can follow one."""
    measured = next(iter(quantities), "t")
    if element.role not in ("load", "driver") and not element.follows_formulas:
        raise ModelError(
            f"'{element.name}': {field.name} is {brief(formula.text)}, a formula of '{measured}', "
            f"which a {element.role} cannot follow: a load or a driver may; for coordinates that "
            "follow each other use a Coupling, a Gear, a Cam, a driver or a CustomJoint",
            element.name,
        )
    own = f"{element.name}.{field.name}"
    if own in quantities:
        raise ModelError(
            f"'{element.name}': {field.name}: '{own}' depends on itself: measure what it follows "
            "from, or filter it with a state of your own",
            element.name,
        )
    names = dict(quantities)
    if "t" in formula.names:
        names["t"] = TIME
    if "x" in formula.names:
        names["x"] = dimension_of(field.metadata["of"])
    wanted = dimension_of(field.metadata["law"])
    return compile_measured(formula.of(wanted), scope, names, wanted)


# -- Physics of a user's own element, in plain Python ------------------------------------------


class OwnPhysics:
    """``physics(i, j, p, t)`` of an element whose own numbers come behind the parameters `p`.

    A system may be given other numbers than the element was made with (`with_values`, a sweep, a
    batch). They reach the kernels as parameters; here they become fields again, so that physics
    finds in ``self.k`` the number that is in force.
    """

    def __init__(self, element: Element, count: int) -> None:
        self.count, self.element = count, element
        self.fields = _named_numbers(element)
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
    """Mixin of elements between two points whose ``physics(i, j, p, t)`` the user gives."""

    def parameters(self: Any, at: Numbers) -> list[Any]:
        """Numbers handed to `physics` as `p`; by default both body-fixed positions, from the mass
        centres [length], and the directions of both markers [rad].
        """
        return [*at.arm(self, "i"), *at.arm(self, "j"), at.angle(self, "i"), at.angle(self, "j")]

    def _hook(self: Any, at: Numbers) -> tuple[list[Any], OwnPhysics]:
        """All numbers of the element as the kernels hand them on, and what they call."""
        parameters = list(self.parameters(at))
        physics = OwnPhysics(self, len(parameters))
        return [*parameters, *physics.numbers(at)], physics


def _named_numbers(element: Element) -> list[tuple[str, str]]:
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
