"""Evaluation of a formula: a number, or an array over a batch, in one consistent unit system.

Units are checked where a formula has any. A formula without units contains only plain numbers, and
its value is in the unit that plain numbers of its field have.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from fractions import Fraction
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np

from mbody.errors import ModelError
from mbody.quantities.parse import (
    FUNCTIONS,
    VARIABLES,
    Binary,
    Call,
    FormulaError,
    Measured,
    Name,
    Negative,
    Node,
    Plain,
    parse_unit,
    text_of,
    units_of_powers,
    walk,
)
from mbody.quantities.units import (
    DIMENSIONS,
    NUMBER,
    SYMBOLS,
    Dimension,
    Unit,
    UnitSystem,
    name_of,
    pint_unit,
    unit_system,
)

# -- The operations and functions of formulas on numbers and arrays, by NumPy ------------------

#: Functions of one number, and of two, by their names in formulas.
OF_ONE: dict[str, Callable[[Any], Any]] = {
    "sin": np.sin,
    "cos": np.cos,
    "tan": np.tan,
    "asin": np.arcsin,
    "acos": np.arccos,
    "atan": np.arctan,
    "sqrt": np.sqrt,
    "abs": np.abs,
    "exp": np.exp,
    "log": np.log,
    "sign": np.sign,
    # NaN where x is; of functions that recorded and dual numbers know
    "step": lambda x: 1.0 + np.minimum(np.sign(x), 0.0),
}
OF_TWO: dict[str, Callable[[Any, Any], Any]] = {
    "atan2": np.arctan2,
    "hypot": np.hypot,
    "min": np.minimum,
    "max": np.maximum,
}
#: All functions, those that are written by others of them too.
COMPUTE: dict[str, Callable[..., Any]] = {
    **OF_ONE,
    **OF_TWO,
    "clamp": lambda x, low, high: np.maximum(np.minimum(x, high), low),
    "deadband": lambda x, width: x - np.maximum(np.minimum(x, width), -width),
}
#: Operations of compiled formulas (`mbody.laws.kernels`) on one number, and on two.
ONE: dict[str, Callable[[Any], Any]] = {"negative": np.negative, **OF_ONE}
TWO: dict[str, Callable[[Any, Any], Any]] = {
    "+": np.add,
    "-": np.subtract,
    "*": np.multiply,
    "/": np.divide,
    "^": np.power,
    **OF_TWO,
}
NONE: Mapping[str, Any] = MappingProxyType({})
#: Operations by the names of NumPy's functions.
BY_FUNCTION = {function.__name__: name for name, function in {**ONE, **TWO}.items()}


def postfix_value(
    operations: Iterable[str],
    constants: Iterable[Any],
    variables: Iterable[Any],
    applied: Callable[..., Any],
    curves: Mapping[str, Any] = NONE,
) -> Any:
    """The value of a program in postfix order, in numbers of any kind.

    `operations`: By their names in `mbody.laws.kernels.OPERATIONS`, and names of `curves`.
    `constants`, `variables`: Read in the order in which the program takes them.
    `applied`: What an operation or a curve, by its name, gives of its arguments.

    >>> postfix_value(("variable", "* constant", "negative"), [2.0], [3.0], by_numpy)
    np.float64(-6.0)
    """
    stack: list[Any] = []
    own, names = iter(constants), iter(variables)
    for name in operations:
        operation, _, constant = name.partition(" ")
        if name == "variable":
            stack.append(next(names))
        elif name == "constant":
            stack.append(next(own))
        elif constant:
            stack.append(applied(operation, stack.pop(), next(own)))
        elif name in ONE:
            stack.append(applied(name, stack.pop()))
        else:
            count = len(curves[name].takes) if name in curves else 2
            arguments = [stack.pop() for _ in range(count)][::-1]
            stack.append(applied(name, *arguments))
    return stack.pop()


class Postfix(NamedTuple):
    """A program in postfix order, or a part of one, as `postfix_value` takes it."""

    operations: tuple[str, ...]
    variables: tuple[str, ...] = ()
    constants: tuple[float, ...] = ()

    def value(self, applied: Callable[..., Any], curves: Any = NONE, known: Any = NONE) -> Any:
        """Its value of parts: constants, and variables or what is `known` of them by name."""
        constants = (Postfix(("constant",), (), (one,)) for one in self.constants)
        variables = (known.get(one, Postfix(("variable",), (one,))) for one in self.variables)
        return postfix_value(self.operations, constants, variables, applied, curves)


def joined(name: str, *parts: Postfix) -> Postfix:
    """The program of an operation on parts.

    >>> joined("*", Postfix(("variable",), ("t",)), Postfix(("constant",), (), (2.0,)))
    Postfix(operations=('variable', '* constant'), variables=('t',), constants=(2.0,))
    """
    if name in ("+", "*", "/", "^") and parts[1].operations == ("constant",):
        name, parts = f"{name} constant", (parts[0], parts[1]._replace(operations=()))
    operations, variables, constants = (sum(each, ()) for each in zip(*parts, strict=True))
    return Postfix((*operations, name), variables, constants)


def by_numpy(operation: str, *arguments: Any) -> Any:
    """What NumPy's function of an operation gives.

    >>> float(by_numpy("hypot", 3.0, 4.0))
    5.0
    """
    return numpy_function(operation)(*arguments)


def numpy_function(operation: str) -> Callable[..., Any]:
    """NumPy's function of an operation."""
    return ONE[operation] if operation in ONE else TWO[operation]


ANGLE = DIMENSIONS["angle"]
#: Quantities of which a rate by another one is written in words.
PER = ("length", "mass", "angle", "force", "torque", "power", "current", "voltage", "temperature")
LONG_NAME = 4  # letters of a unit of pint that is allowed without a number
TRIGONOMETRIC = ("sin", "cos", "tan")
#: Functions that give a plain number, whatever the units of their arguments.
PLAIN_FUNCTIONS = (*TRIGONOMETRIC, "sign", "step")
INVERSE = ("asin", "acos", "atan", "atan2")
SI = unit_system("SI")


@dataclass(frozen=True)
class Valued:
    """A value with its dimension, None for a plain number."""

    value: Any
    dimension: Dimension | None = None


@dataclass(frozen=True)
class Curve:
    """A function that a mechanism has by name, as formulas call it.

    `values`: Of one or two numbers or arrays; NaN where it has no value.
    `arguments`: Dimension of each number that it takes; None where it is not known.
    """

    values: Callable[..., Any]
    arguments: tuple[Dimension | None, ...]


@dataclass(frozen=True)
class Scope:
    """The unit system and the values of the names in a formula.

    `system`: The units of the values.
    `names`: Parameters and, if allowed, the variable.
    """

    system: UnitSystem = SI
    names: Mapping[str, Valued] = field(default_factory=dict)

    def unit(self, name: str) -> Unit | None:
        """The unit with that name, if it is one by itself; t is the variable, not a tonne. Only
        long names of pint's units are: ``b`` is more likely a missing parameter than a barn.
        """
        if name in self.names or name == "pi" or name in VARIABLES:
            return None
        return SYMBOLS.get(name) or (pint_unit(name) if len(name) >= LONG_NAME else None)


def dimension_text(dimension: Dimension) -> str:
    """A dimension in words, for error messages.

    >>> dimension_text(DIMENSIONS["mass"] / DIMENSIONS["length"])
    'a mass per length (kg/m)'
    """
    name = name_of(dimension)
    if name == "number":
        return "a plain number"
    symbol = SI.of(dimension)
    if not name:
        for key in ("length", "time", "angle", "current", "temperature"):
            above = name_of(dimension * DIMENSIONS[key])
            if above in PER:
                name = f"{above} per {key}"
                symbol = f"{SI.of(above)}/{SI.of(key)}"
                break
    if not name:
        return f"a quantity in {symbol}"
    article = "an" if name[0] in "aei" else "a"
    return f"{article} {name} ({symbol})"


def misplaced_variable(variable: str) -> str:
    """The error message for a variable outside the laws that have it."""
    where = "laws of time" if variable == "t" else "laws of a stretch, an angle or a rate"
    return f"'{variable}' is allowed only in {where}"


def has_units(node: Node, scope: Scope) -> bool:
    """Whether a formula has units, of its own or of its parameters.

    Arguments of sin, cos, tan, sign and step do not count: ``9*cos(45 deg)`` is a plain number.
    """
    for part in walk(node, except_in=PLAIN_FUNCTIONS):
        if isinstance(part, Measured):
            return True
        if isinstance(part, Call) and part.function in INVERSE:
            return True
        if isinstance(part, Call) and part.function not in COMPUTE:
            curve = scope.names.get(part.function)
            if curve is not None and curve.dimension is not None:
                return True
        if isinstance(part, Name):
            named = scope.names.get(part.name)
            if named is not None and part.name not in VARIABLES:
                if named.dimension is not None:
                    return True
            elif named is None and part.name != "pi" and scope.unit(part.name):
                return True
    return False


def evaluate(node: Node, scope: Scope, *, with_units: bool = False, checked: bool = True) -> Valued:
    """Value of a formula with its dimension; None for a plain number, unless `with_units`, and
    where units are not `checked`.

    Raises
    ------
    FormulaError
        For an unknown name, or units that do not fit together.
    """
    _check_names(node, scope)
    with_units = checked and (with_units or has_units(node, scope))
    with np.errstate(all="ignore"):  # callers check for values that are not finite
        value, dimension = _Evaluation(scope, with_units, checked, node).of(node)
    return Valued(value, dimension if with_units else None)


def _check_names(node: Node, scope: Scope) -> None:
    """Raise FormulaError where a symbol joined to a unit could also be a parameter.

    A symbol joined to a unit without a space is a unit. If a parameter of that name has the same
    dimension, the result would not show which one was meant.
    """
    for symbol, part in parameters_read_as_units(node, scope):
        unit = SYMBOLS.get(symbol)
        if unit is not None and scope.names[symbol].dimension == unit.dimension:
            raise FormulaError(
                f"'{symbol}' in '{part.unit.symbol}' is a unit, and a parameter of the "
                f"same dimension, {dimension_text(unit.dimension)}: write '* ({symbol})' for the "
                "parameter, or choose "
                "another name for it"
            )


def parameters_read_as_units(node: Node, scope: Scope) -> Iterator[tuple[str, Measured]]:
    """Symbols joined to units that are also names of parameters."""
    for part in walk(node):
        if isinstance(part, Measured):
            yield from ((s, part) for s in part.symbols[1:] if s in scope.names)


class _Evaluation:
    """Recursive evaluation of a tree: every value with its dimension."""

    def __init__(self, scope: Scope, with_units: bool, checked: bool, whole: Node) -> None:
        self.scope, self.with_units, self.checked, self.whole = scope, with_units, checked, whole

    def of(self, node: Node) -> tuple[Any, Dimension]:
        """Value and dimension of a node."""
        match node:
            case Plain(value=value):
                return _float(value), NUMBER
            case Name(name=name):
                return self.name(name)
            case Measured():
                return self.measure(node)
            case Negative(of=below):
                value, dimension = self.of(below)
                return -value, dimension
            case Binary(operator="^"):
                return self.power(node)
            case Binary(operator=operator, a=a, b=b):
                return self.binary(operator, self.of(a), self.of(b))
            case Call(function=function, arguments=(below,)) if function in PLAIN_FUNCTIONS:
                units = self.checked and has_units(below, self.scope)
                inside = _Evaluation(self.scope, units, self.checked, self.whole)
                return self.call(function, [inside.of(below)])
            case Call(function=function, arguments=arguments):
                return self.call(function, [self.of(argument) for argument in arguments])

    def name(self, name: str) -> tuple[Any, Dimension]:
        named = self.scope.names.get(name)
        if named is not None:
            plain = named.dimension is None or not self.with_units
            if isinstance(named.value, Curve):
                raise FormulaError(f"'{name}' is a curve: give it a number, as in '{name}(2)'")
            return named.value, NUMBER if plain else named.dimension or NUMBER
        if name == "pi":
            return np.pi, NUMBER
        unit = self.scope.unit(name)
        if unit is not None:
            return self.scaled(Fraction(1), unit), self._known(unit)
        if name in VARIABLES:
            raise FormulaError(misplaced_variable(name))
        numbers = [known for known in self._numbers() if "." not in known and known not in "tx"]
        known = ", ".join(map(repr, numbers[:12]))
        raise FormulaError(
            f"there is no parameter '{name[:60]}' "
            + (f"(there are: {known})" if known else "(there are none)")
        )

    def _numbers(self) -> list[str]:
        """The names that are numbers."""
        return [n for n, own in self.scope.names.items() if not isinstance(own.value, Curve)]

    def scaled(self, value: Any, unit: Unit) -> Any:
        """A value in `unit`, converted to the unit system of the scope; exact where possible."""
        ratio = unit.ratio / self.scope.system.unit(unit.dimension).ratio
        if isinstance(value, Fraction) and not unit.pi:
            return _float(value * ratio)
        value = _float(value) if isinstance(value, Fraction) else value
        own = Unit(unit.symbol, ratio, unit.pi, unit.dimension)
        return value * own.factor

    def measure(self, node: Measured) -> tuple[Any, Dimension]:
        if isinstance(node.of, Plain):
            return self.scaled(node.of.value, node.unit), self._known(node.unit)
        value, dimension = self.of(node.of)
        if dimension != NUMBER:
            raise FormulaError(
                f"the part before '{node.unit.symbol}' is {dimension_text(dimension)} already: "
                "leave the unit out"
            )
        return self.scaled(value, node.unit), self._known(node.unit)

    def _known(self, unit: Unit) -> Dimension:
        """The dimension of a unit; a plain number where units are not checked."""
        return unit.dimension if self.checked else NUMBER

    def binary(
        self, operator: str, a: tuple[Any, Dimension], b: tuple[Any, Dimension]
    ) -> tuple[Any, Dimension]:
        if operator == "*":
            return a[0] * b[0], a[1] * b[1]
        if operator == "/":
            return np.divide(a[0], b[0]), a[1] / b[1]
        self.alike("adds" if operator == "+" else "subtracts", a[1], b[1])
        found = a[1] if name_of(a[1]) else b[1]
        return (a[0] + b[0] if operator == "+" else a[0] - b[0]), found

    def alike(self, does: str, a: Dimension, b: Dimension) -> None:
        """Refuse what does not measure the same. A product has a radian as one: N·m·rad/s of a
        torque and a rate is a power; but two that have names, as a frequency and an angular
        velocity, differ.
        """
        product = a.mechanical == b.mechanical and not (name_of(a) and name_of(b))
        if a != b and not product:
            remedy = ""
            if NUMBER in (a, b):
                remedy = ": give every number its unit"
            raise FormulaError(f"it {does} {dimension_text(a)} and {dimension_text(b)}{remedy}")

    def power(self, node: Binary) -> tuple[Any, Dimension]:
        (base, dimension), (exponent, of_exponent) = self.of(node.a), self.of(node.b)
        if of_exponent != NUMBER:
            raise FormulaError(
                f"an exponent is {dimension_text(of_exponent)}, it must be a plain number"
                f"{self._suggestion()}"
            )
        if dimension != NUMBER:
            fixed = literal_exponent(node.b)
            if fixed is None:
                raise FormulaError(
                    f"the power of {dimension_text(dimension)} must be a literal number"
                )
            dimension = dimension**fixed
        # times 1.0: a power of whole numbers would be a whole number
        return np.power(np.multiply(base, 1.0), exponent), dimension

    def _suggestion(self) -> str:
        """Suggestion where an exponent has the unit of the whole power; "" without one."""
        whole = units_of_powers(self.whole)
        if whole == self.whole:  # a parameter has the unit
            return ""
        try:
            evaluate(whole, self.scope, checked=self.checked)
        except FormulaError:
            return ""
        return f"; a unit goes with the number before it: did you mean '{text_of(whole)}'?"

    def call(self, function: str, given: list[tuple[Any, Dimension]]) -> tuple[Any, Dimension]:
        values, dimensions = [v for v, _ in given], [d for _, d in given]
        if function not in COMPUTE:
            return self.curve(function, values, dimensions)
        first = dimensions[0]
        for other in dimensions[1:]:
            self.alike(f"gives '{function}'", first, other)
        if function in TRIGONOMETRIC:
            if first not in (NUMBER, ANGLE):
                raise FormulaError(f"'{function}' takes an angle, not {dimension_text(first)}")
            result = NUMBER
        elif function in PLAIN_FUNCTIONS:
            result = NUMBER
        elif function in ("asin", "acos", "atan", "exp", "log"):
            if first != NUMBER:
                raise FormulaError(
                    f"'{function}' takes a plain number, not {dimension_text(first)}"
                )
            result = ANGLE if function in INVERSE and self.checked else NUMBER
        elif function == "atan2":
            result = ANGLE if self.checked else NUMBER
        else:
            result = first ** Fraction(1, 2) if function == "sqrt" else first
        return COMPUTE[function](*values), result

    def curve(
        self, name: str, values: list[Any], dimensions: list[Dimension]
    ) -> tuple[Any, Dimension]:
        """Value and dimension of a curve of the mechanism."""
        named = self.scope.names.get(name)
        if named is None or not isinstance(named.value, Curve):
            curves = [n for n, v in self.scope.names.items() if isinstance(v.value, Curve)]
            raise FormulaError(
                f"there is no function {name[:40]!r} (there are: {', '.join(FUNCTIONS)}"
                + (f", and the curves {', '.join(curves[:12])})" if curves else ")")
            )
        wanted = named.value.arguments
        if len(values) != len(wanted):
            numbers = "one number" if len(wanted) == 1 else "two numbers"
            raise FormulaError(f"the curve '{name}' takes {numbers}, not {len(values)}")
        for found, want in zip(dimensions, wanted, strict=True):
            fits = want is None or found.mechanical == want.mechanical
            if self.with_units and self.checked and not fits:
                assert want is not None
                raise FormulaError(
                    f"the curve '{name}' is of {dimension_text(want)}, "
                    f"not of {dimension_text(found)}"
                )
        plain = named.dimension is None or not (self.with_units and self.checked)
        return named.value.values(*values), NUMBER if plain else named.dimension or NUMBER


def literal_exponent(node: Node) -> Fraction | None:
    """An exponent that is a literal number such as 2, −1, 0.5, 1/2; None for any other."""
    match node:
        case Plain(value=value):
            return value if abs(value) <= 9 and value.denominator <= 12 else None
        case Negative(of=below):
            inner = literal_exponent(below)
            return None if inner is None else -inner
        case Binary(operator="/", a=Plain(value=a), b=Plain(value=b)) if b:
            return literal_exponent(Plain(a / b))
    return None


def _float(value: Fraction) -> float:
    try:
        return float(value)
    except OverflowError:
        return np.inf if value > 0 else -np.inf


# -- Conversion of values from one unit to another ---------------------------------------------


def short_degrees(value: float) -> float:
    """An angle [rad] in degrees, with the fewest digits that mean the same angle.

    >>> short_degrees(math.radians(60.0)), math.degrees(math.radians(60.0))
    (60.0, 59.99999999999999)
    """
    degrees = math.degrees(value)
    for digits in range(14):
        short = round(degrees, digits)
        if math.radians(short) == value:
            return short
    return degrees


def degrees_of(values: Any) -> np.ndarray:
    """Angles [rad] in degrees, to fifteen digits: what follows is the rounding of the conversion,
    which shows as 59.99999999999999.

    >>> degrees_of([math.radians(60.0), math.nan]).tolist()
    [60.0, nan]
    """
    degrees = np.degrees(np.asarray(values, dtype=float))
    sizes = np.abs(degrees)
    plain = (sizes > 1e-7) & (sizes < 1e12)  # 10^k is exact up to k = 22
    scale = 10.0 ** (14 - np.floor(np.log10(np.where(plain, sizes, 1.0))))
    return np.where(plain, np.rint(degrees * scale) / scale, degrees)


def place_in_turn(angle: float) -> float:
    """The place of an angle [rad] at one instant in degrees, at most a turn from zero.

    >>> [place_in_turn(math.radians(at)) for at in (378.0, 360.0, -30.0)]
    [18.0, 360.0, -30.0]
    """
    degrees = float(degrees_of(angle))
    return degrees if abs(degrees) <= 360.0 else math.fmod(degrees, 360.0)


def convert(values: Any, unit: str, to: str) -> Any:
    """Values in another unit: a float or an array of any shape.

    `values`: In `unit`.
    `unit`, `to`: Such as ``"lbf in"``, ``"N*m"``, ``"rev/min"``.
    Raises ModelError for an unknown unit, or two units of different dimensions.

    >>> round(convert(243.2375907612, "lbf in", "N m"), 6)
    27.482158
    """
    try:
        old, new = (evaluate(parse_unit(name), Scope()) for name in (unit, to))
        if old.dimension != new.dimension or old.dimension is None or new.dimension is None:
            kinds = [dimension_text(v.dimension) if v.dimension else "no unit" for v in (old, new)]
            raise FormulaError(f"'{unit}' is {kinds[0]}, '{to}' is {kinds[1]}")
        if not (0.0 < abs(old.value) < math.inf and 0.0 < abs(new.value) < math.inf):
            raise FormulaError(f"'{unit}' or '{to}' is not a unit")
        return values * (old.value / new.value)
    except FormulaError as error:
        raise ModelError(f"cannot convert: {error}") from None


def deg(angle: float) -> float:
    """Degrees to radians.

    >>> deg(180.0) == math.pi
    True
    """
    return math.radians(angle)


def rpm(speed: float) -> float:
    """Revolutions a minute to rad/s.

    >>> round(rpm(60.0), 6)
    6.283185
    """
    return speed * (math.pi / 30.0)
