"""Numbers as text: read and checked at once, evaluated with the units and parameters of a
mechanism.
"""

from __future__ import annotations

import dataclasses
import functools
import math
import operator
import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from fractions import Fraction
from graphlib import CycleError, TopologicalSorter
from numbers import Real
from types import NoneType
from typing import Any, Generic, Protocol, TypeAlias, TypeVar, cast

import numpy as np

from mbody.core.tolerances import PARAMETERS_EQUAL
from mbody.errors import ModelError, brief
from mbody.quantities.evaluate import (
    Scope,
    Valued,
    dimension_text,
    evaluate,
    has_units,
    parameters_read_as_units,
)
from mbody.quantities.parse import (
    FUNCTIONS,
    VARIABLES,
    FormulaError,
    Measured,
    Name,
    Negative,
    Node,
    Plain,
    called,
    parse,
    parse_unit,
    shown,
)
from mbody.quantities.units import (
    DIMENSIONS,
    NUMBER,
    SYMBOLS,
    Dimension,
    UnitSystem,
    dimension_of,
    of_quantity,
)

# -- Types of what numbers are given as, and of fields that take more than they return ---------
#
# Every number may be given as text with units. The field that takes it returns a float, so its type
# has two sides: `Converted` states both, as a descriptor does. Type checkers take the type of an
# argument from ``__set__`` and that of the attribute from ``__get__`` (PEP 681; mypy and pyright
# agree). At run time the fields are ordinary ones of a dataclass.

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


# -- The parameters of a mechanism: named numbers for formulas, some of them formulas of others

MAX_NAME = 40
RESERVED = {*FUNCTIONS, *VARIABLES, "pi"}


class Parameters(Mapping[str, "float | Formula"]):
    """Named numbers, each a float or a formula of the others, in any order.

    `given`: By name: a number, text such as ``"2*a"`` or ``"15 in"``, or a quantity.
    `system`: The units of the values.

    Raises
    ------
    ModelError
        For a name that cannot be used in a formula, a value that is not a number, or formulas that
        depend on each other in a circle.

    >>> from mbody.quantities.units import unit_system
    >>> Parameters({"a": 2.0, "b": "3*a"}, unit_system("SI")).scope().names["b"].value
    6.0
    """

    def __init__(self, given: Mapping[str, Any], system: UnitSystem) -> None:
        if not isinstance(given, Mapping):
            raise ModelError(f'parameters must be a dict such as {{"a": 2.0}}, not {given!r}')
        self.system = system
        #: Curves of the mechanism, which formulas call by name.
        self.curves: dict[str, Valued] = {}
        self._values = {name: parameter_value(name, value) for name, value in given.items()}
        self._order = self._ordered()
        self._base = self.scope()

    def __getitem__(self, name: str) -> float | Formula:
        return self._values[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._values)

    def __len__(self) -> int:
        return len(self._values)

    def used_by(self, formula: Formula) -> frozenset[str]:
        """The parameters that a formula uses."""
        return formula.names & self._values.keys()

    def scope(self, values: Mapping[str, Any] | None = None) -> Scope:
        """The values of the names: as described, or with other values of some parameters.

        `values`: By name, floats or arrays (batch,) in the unit system, angles that have a unit in
          rad.
        Raises ModelError where a formula of a parameter has no finite value.
        """
        if not values and hasattr(self, "_base"):
            return self._base
        found: dict[str, Valued] = {}
        scope = Scope(self.system, found)
        for name in self._order:
            own = self._values[name]
            try:
                made = evaluate(own.tree, scope) if isinstance(own, Formula) else Valued(own)
                if values and name in values:
                    made = Valued(values[name], made.dimension)
                elif isinstance(own, Formula):
                    made = Valued(own.value(scope), made.dimension)
            except FormulaError as error:
                raise ModelError(f"parameter '{name}': {error}", name) from None
            found[name] = made
        return Scope(self.system, {**found, **self.curves})

    def with_curves(self, curves: Mapping[str, Valued]) -> None:
        """Let formulas call these curves."""
        self.curves = dict(curves)
        self._base = Scope(self.system, {**self._base.names, **self.curves})

    def _ordered(self) -> list[str]:
        """The parameters in an order in which each follows those that it depends on."""
        needs = {
            name: sorted(self.used_by(own)) if isinstance(own, Formula) else []
            for name, own in self._values.items()
        }
        try:
            return list(TopologicalSorter(needs).static_order())
        except CycleError as error:
            ring = " → ".join(reversed(error.args[1][:6]))
            raise ModelError(
                f"the parameters {ring} depend on each other: give one of them a number",
                error.args[1][0],
            ) from None


def _is_one_name(name: str) -> bool:
    """Whether a formula reads it as one name: Python also allows marks, as in a·b."""
    try:
        return len(name) <= MAX_NAME and parse(name) == Name(name)
    except FormulaError:
        return False


def parameter_value(name: Any, value: Any) -> float | Formula:
    """The value of a parameter, read; ModelError for an invalid name or number."""
    if not isinstance(name, str) or not name.isidentifier() or not _is_one_name(name):
        raise ModelError(
            f"{shown(str(name))} cannot name a parameter: a name begins with a letter, has "
            f"letters, digits and _, and at most {MAX_NAME} characters"
        )
    if name in RESERVED:
        raise ModelError(
            f"the name '{name}' is reserved for formulas: choose another name for the parameter",
            name,
        )
    return constant_or_formula(value, None, f"parameter '{name}'", name)


def plain_otherwise(name: str, own: Any, units: UnitSystem, angle: str = "deg") -> str:
    """A sentence for a plain number that replaces a parameter which is written in another unit
    than plain numbers have, as "90 rpm"; empty where there is no such unit.

    >>> from mbody.quantities.units import unit_system
    >>> plain_otherwise("h", "90 cm", unit_system("SI"))
    "plain numbers for 'h' are in m, and its own value is '90 cm': write cm if that is meant"
    >>> plain_otherwise("length", "2 m", unit_system("SI"))
    ''
    """
    text = own.text if isinstance(own, Formula) else own
    found = re.fullmatch(r"\s*[-+]?[\d.]+(?:[eE][-+]?\d+)?\s*(\S.*?)\s*", str(text))
    if found is None:
        return ""
    try:
        one = evaluate(parse_unit(found[1]), Scope(units))
    except FormulaError:
        return ""
    if one.dimension is None:
        return ""
    plain, size = units.unit(one.dimension), 1.0
    if one.dimension == DIMENSIONS["angle"] and angle == "deg":
        plain, size = SYMBOLS["deg"], math.pi / 180.0
    if math.isclose(one.value, size, rel_tol=PARAMETERS_EQUAL):
        return ""
    return (
        f"plain numbers for '{name}' are in {plain.symbol}, and its own value is '{text}': write "
        f"{found[1]} if that is meant"
    )


def with_unit_of(value: Any, dimension: Dimension, units: UnitSystem, angle: str) -> Any:
    """Another value of a parameter that has a dimension: a plain number gets the unit that plain
    numbers of that dimension have, as ``"0.25 m"`` for 0.25; anything else is unchanged.

    >>> from mbody.quantities.units import unit_system
    >>> with_unit_of("0.25", DIMENSIONS["length"], unit_system("SI"), "deg").text
    '0.25 m'
    """
    text = f"{value!r}" if isinstance(value, (int, float)) else value
    if not isinstance(text, str):
        return value
    formula = read(text, None)
    if formula.names or formula.has_units(Scope(units)):
        return value
    unit = units.unit(dimension)
    if dimension == DIMENSIONS["angle"]:
        unit = SYMBOLS[angle]
    text = f"{formula.text if formula.literal else f'({formula.text})'} {unit.symbol}"
    try:
        made = read(text, None)
        if evaluate(made.tree, Scope(units)).dimension == dimension:
            return made
    except FormulaError:  # the symbol of the unit cannot be read in a formula
        pass
    return Formula(text, None, tree=Measured(formula.tree, unit, ()))


# frequent mistakes: (what is written, what is meant), tried in this order
COMMON_MISTAKES = (
    ("lbs?|lbm", "lbf"),
    ("oz", "ozf"),
    ("kg", "kgf"),
    ("g", "kgf"),
    ("lbf", "lb"),
    ("kgf", "kg"),
    ("kgf", "N"),
    ("Hz", "rev/s"),
    ("rpm", "rev"),
    ("deg", "deg/s"),
    ("$", "/rad"),
    ("$", "/deg"),
    ("/(rad|deg)", ""),
    ("s", "s^2"),
    (r"s(\^|\*\*)2", "s"),
    ("m", "m/s"),
    ("m", "m/s^2"),
)


@dataclass(frozen=True)
class Formula:
    """A number as text, with the dimension of its field.

    `text`: As it was written.
    `dimension`: Of the field, None while that is not known.
    `angle`: "rad" or "deg": the unit of a plain number that is an angle.
    `argument`: Of a law: the dimension of its variable.
    `tree`: The parsed text.
    """

    text: str
    dimension: Dimension | None = None
    angle: str = "rad"
    argument: Dimension | None = None
    tree: Node = field(kw_only=True, repr=False, compare=False)

    @property
    def names(self) -> frozenset[str]:
        """Parameters, variables and units that it contains."""
        return self.tree.names - {"pi"}

    @property
    def variable(self) -> str:
        """The variable that it depends on, empty where there is none."""
        return next((name for name in VARIABLES if name in self.names), "")

    @property
    def literal(self) -> bool:
        """Whether it is one number with its unit, as in a table of data."""
        node = self.tree.of if isinstance(self.tree, Negative) else self.tree
        return isinstance(node, Plain) or (
            isinstance(node, Measured) and isinstance(node.of, Plain)
        )

    def has_units(self, scope: Scope) -> bool:
        """Whether it has units, of its own or of its parameters."""
        return has_units(self.tree, scope)

    def of(self, dimension: Dimension) -> Formula:
        """A copy for a field of another dimension."""
        return replace(self, dimension=dimension)

    def value(self, scope: Scope) -> Any:
        """A float, or an array over a batch, in the units of the scope, angles in rad.

        Raises FormulaError for an unknown name, units that do not fit, or a value that is not
        finite.
        """
        found = evaluate(self.tree, scope)
        value = found.value * self._scaled(found, scope)
        if not np.isfinite(value).all():
            bad = np.ravel(value)[~np.isfinite(np.ravel(value))][0]
            raise FormulaError(f"{shown(self.text)} evaluates to {bad}, it must be finite")
        return float(value) if isinstance(value, Real) else value

    def _scaled(self, found: Valued, scope: Scope) -> float:
        """The scale; an error also names units that have the name of a parameter."""
        try:
            return self.scale(found)
        except FormulaError as error:
            both = next(parameters_read_as_units(self.tree, scope), None)
            if both is None:
                raise
            raise FormulaError(
                f"{error}; '{both[0]}' in '{both[1].unit.symbol}' is the unit, since it is "
                f"joined to a unit without a space: write '* ({both[0]})' or '/ ({both[0]})' for "
                "the parameter"
            ) from None

    def scale(self, found: Valued) -> float:
        """The factor from a value of this formula to the value of the field: one, except for plain
        degrees.

        Raises FormulaError when the field has another dimension.
        """
        wanted, got = self.dimension, found.dimension
        if got is None or wanted is None:
            degrees = got is None and wanted == DIMENSIONS["angle"] and self.angle == "deg"
            return np.pi / 180.0 if degrees else 1.0
        exact = self.literal and not wanted.current
        if got == wanted or (not exact and got.mechanical == wanted.mechanical):
            return 1.0
        raise FormulaError(
            f"{shown(self.text)} is {dimension_text(got)}, where {dimension_text(wanted)} is "
            f"wanted{self._suggestion()}"
        )

    def _suggestion(self) -> str:
        """A guess of what was meant, as the end of an error message."""
        if not self.literal or self.dimension is None:
            return ""
        for pattern, instead in COMMON_MISTAKES:
            bounds = pattern if pattern[0] in "$/" else rf"(?<![\w])(?:{pattern})(?![\w^])"
            text = re.sub(bounds, instead, self.text.strip(), count=1)
            try:
                found = evaluate(parse(text), Scope())
            except FormulaError:
                continue
            if text != self.text.strip() and found.dimension == self.dimension:
                return f": did you mean {text!r}?"
        return ""


def read(
    value: Any, dimension: Dimension | None, angle: str = "rad", *, curves: bool = False
) -> Formula:
    """A formula from text or from a quantity of pint; `curves` as of `parse`.

    Raises FormulaError for text that is not a formula, or whose units do not fit the field.

    >>> read("1.5 lbf", DIMENSIONS["force"]).value(Scope())
    6.67233242289075
    """
    if isinstance(value, Formula):
        if dimension is None or value.dimension == dimension:
            return value
        return verified(value.of(dimension))
    if isinstance(value, str):
        text = value.strip()
        return verified(Formula(text, dimension, angle, tree=parse(text, curves=curves)))
    unit = of_quantity(value)
    if unit is None:
        raise FormulaError(
            f"{shown(str(value))} is not a quantity of length, mass, time, angle, current or "
            "absolute temperature (K)"
        )
    tree = Plain(unit.ratio) if unit.dimension == NUMBER else Measured(_ONE, unit, ())
    return verified(Formula(str(value), dimension, angle, tree=tree))


_ONE = Plain(Fraction(1))


def verified(formula: Formula) -> Formula:
    """The formula; one without names is evaluated at once, to raise its errors early."""
    curves = called(formula.tree) - FUNCTIONS.keys()
    if formula.dimension is not None and not formula.names and not curves:
        formula.value(Scope())
    return formula


# -- Deferred evaluation: find the formulas in a description and substitute their values -------


#: What has no parts, and is no formula.
class LeftOut(float):
    """A number that nobody gave: the one that stands for it.

    >>> LeftOut(0.0) == 0.0
    True
    """


_PLAIN = frozenset({float, LeftOut, int, bool, str, NoneType})


@functools.cache
def _field_names(kind: Any) -> tuple[str, ...]:
    """Names of the fields of a dataclass; of another class none."""
    return tuple(f.name for f in dataclasses.fields(kind)) if dataclasses.is_dataclass(kind) else ()


@functools.cache
def _parts_of(kind: Any) -> Callable[[Any], tuple[Any, ...]]:
    """Getter of the values of all fields of a dataclass; of another class one that gives none."""
    names = _field_names(kind)
    if len(names) > 1:
        return operator.attrgetter(*names)
    return lambda value: tuple(getattr(value, name) for name in names)


def formulas_in(value: Any, name: str = "") -> Iterator[tuple[str, Formula]]:
    """Every formula in a value (a number, a point, a law, an element), with its dotted name."""
    if isinstance(value, Formula):
        yield name, value
        return
    parts: Iterable[tuple[Any, Any]] = ()
    if isinstance(value, (tuple, list)):
        parts = enumerate(value)
    elif isinstance(value, dict):
        parts = value.items()
    else:
        parts = ((field, getattr(value, field)) for field in _field_names(cast(Any, type(value))))
    for key, part in parts:
        if type(part) not in _PLAIN:  # so that long tables are searched fast
            yield from formulas_in(part, f"{name}.{key}")


def is_pending(value: Any) -> bool:
    """Whether a value contains formulas, which only a mechanism can evaluate."""
    if type(value) in _PLAIN:
        return False
    if isinstance(value, Formula):
        return True
    parts: Iterable[Any]
    if isinstance(value, (tuple, list)):
        parts = value
    elif isinstance(value, dict):
        parts = value.values()
    else:
        parts = _parts_of(cast(Any, type(value)))(value)
    # no call for a plain number: there are hundreds in a description
    return any(type(part) not in _PLAIN and is_pending(part) for part in parts)


def substituted(value: Any, instead: Callable[[Formula], Any]) -> Any:
    """The value with every formula replaced by ``instead(formula)``; itself where it has none."""
    if type(value) in _PLAIN:
        return value
    if isinstance(value, Formula):
        return instead(value)
    if isinstance(value, (tuple, list)):
        parts = [substituted(part, instead) for part in value]
        same = all(new is old for new, old in zip(parts, value, strict=True))
        return value if same else type(value)(parts)
    if isinstance(value, dict):
        pairs = {key: substituted(part, instead) for key, part in value.items()}
        return pairs if any(pairs[key] is not value[key] for key in pairs) else value
    names = _field_names(cast(Any, type(value)))
    if names:
        fields = {field: getattr(value, field) for field in names}
        made = {name: substituted(part, instead) for name, part in fields.items()}
        differing = {name: part for name, part in made.items() if part is not fields[name]}
        return dataclasses.replace(value, **differing) if differing else value
    return value


# -- Numbers of a description, as they are entered: floats, text with units, quantities of pint


class NotANumber(FormulaError):
    """The value is neither a number nor text."""


class NotFinite(FormulaError):
    """The value is infinite or NaN."""


def float_or_formula(value: Any, dimension: Dimension | None) -> float | Formula:
    """A finite float, or a formula for text or a quantity of pint."""
    if type(value) in (float, LeftOut) and math.isfinite(value):
        return value
    if isinstance(value, Real) and not isinstance(value, bool):
        try:
            result = float(value)
        except OverflowError:
            result = math.inf
        if not math.isfinite(result):
            raise NotFinite(f"{result}")
        return result
    if isinstance(value, (str, Formula)) or hasattr(value, "dimensionality"):
        return read(value, dimension)
    raise NotANumber(f"{brief(value)} is not a number")


def number(value: Any, dimension: str | Dimension, element: str, field: str) -> Any:
    """One number of an element: a finite float in the mechanism's unit system, or a formula."""
    kind = f" ({dimension})" if isinstance(dimension, str) else ""
    return constant_or_formula(
        value, dimension_of(dimension), f"'{element}': {field}", element, kind
    )


def constant_or_formula(
    value: Any, dimension: Dimension | None, what: str, element: str, kind: str = ""
) -> float | Formula:
    """One number that does not change with time; `what` begins the error message."""
    try:
        result = float_or_formula(value, dimension)
    except NotANumber:
        raise ModelError(f"{what} must be a number{kind}, not {brief(value)}", element) from None
    except NotFinite as error:
        raise ModelError(f"{what} is {error}, it must be finite", element) from None
    except FormulaError as error:
        raise ModelError(f"{what}: {error}", element) from None
    if isinstance(result, Formula) and result.variable:
        raise ModelError(
            f"{what} is {brief(result.text)}, but only a law may change with '{result.variable}'",
            element,
        )
    return result


def one_number(value: Any, dimension: str, element: str, field: str) -> float:
    """A plain number, for places without a mechanism that has units and parameters."""
    result = number(value, dimension, element, field)
    if isinstance(result, Formula):
        raise ModelError(
            f"'{element}': {field} must be a plain number here, not {brief(result.text)}", element
        )
    return result


def value_given(
    value: Any, dimension: Dimension | None, scope: Scope, verb: str, name: str
) -> float:
    """One value that a call gives to a number, in the units of the scope; sentences begin with the
    verb.

    >>> value_given("2 kN", DIMENSIONS["force"], Scope(), "sweep", "push.value")
    2000.0
    """
    try:
        made = float_or_formula(value, None)
        if isinstance(made, Formula):
            made = (made if dimension is None else made.of(dimension)).value(scope)
        return float(made)
    except NotFinite as error:
        raise ModelError(f"{verb}: '{name}' is {error}, it must be finite", name) from None
    except FormulaError as error:
        raise ModelError(f"{verb}: '{name}': {error}", name) from None


def range_given(
    pair: Any,
    dimension: Dimension | None,
    scope: Scope,
    verb: str,
    name: str,
    *,
    equal: bool = False,
    endless: bool = False,
) -> tuple[float, float]:
    """The lowest and the greatest value that a call gives to a number, as of `value_given`; maybe
    equal, or infinite.
    """
    if isinstance(pair, str) or not hasattr(pair, "__len__") or len(pair) != 2:
        raise ModelError(f"{verb}: '{name}' takes a pair (low, high), not {brief(pair)}", name)
    low, high = (
        one
        if endless and isinstance(one, float) and math.isinf(one)
        else value_given(one, dimension, scope, verb, name)
        for one in pair
    )
    if not (low < high or (equal and low == high)):
        unit = scope.system.of(dimension) if dimension else ""
        said = f"{verb}: '{name}' goes from {low:g} to {high:g} {unit}".rstrip()
        raise ModelError(f"{said}: give low, then high", name)
    return low, high


def evaluated(given: Any, scope: Scope, element: str, field: str) -> Any:
    """A number, or a value made of numbers, with floats in the place of its formulas."""
    try:
        return substituted(given, lambda formula: formula.value(scope))
    except FormulaError as error:
        raise ModelError(f"'{element}': {field}: {error}", element) from None
