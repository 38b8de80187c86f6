"""A law given by a formula, compiled to a postfix program."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from fractions import Fraction
from typing import Any, ClassVar

import numpy as np

from mbody.errors import ModelError
from mbody.laws.base import FormulaLaw, Law, finite, law_field, law_numbers, with_dimension
from mbody.laws.kernels import (
    CONSTANT,
    LOG,
    MAX_OPERATIONS,
    MAX_STACK,
    OPERATIONS,
    POWER_CONSTANT,
    FloatArray,
)
from mbody.quantities.evaluate import (
    Postfix,
    Scope,
    Valued,
    evaluate,
    literal_exponent,
    misplaced_variable,
)
from mbody.quantities.formula import Converted, Formula, NumberField, NumberRow, required
from mbody.quantities.parse import (
    Binary,
    Call,
    FormulaError,
    Measured,
    Name,
    Negative,
    Node,
    Plain,
    expanded,
    shown,
    text_of,
)
from mbody.quantities.units import DIMENSIONS, Dimension

# -- From the tree of a formula to operations in postfix order (`mbody.laws.postfix`) ----------

ONE = Plain(Fraction(1))


class PostfixProgram:
    """Operations in postfix order, the variables in the order in which they are taken, and the
    constants: the parts without a variable.
    """

    def __init__(self, variables: frozenset[str]) -> None:
        self.variables = variables
        self.operations: list[str] = []
        self.variables_used: list[str] = []
        self.constants: list[Node] = []

    def free(self, node: Node) -> bool:
        """Whether a node has none of the variables."""
        return not node.names & self.variables

    def put(self, operation: str, constant: Node | None = None) -> None:
        """Append an operation, with the constant that it takes."""
        self.operations.append(operation)
        if constant is not None:
            self.constants.append(constant)

    def add(self, node: Node) -> None:
        """Append the operations that put the value of a node on the stack."""
        if self.free(node):
            self.put("constant", node)
        else:
            self.varying(node)

    def varying(self, node: Node) -> None:
        """Append those of a node that has a variable."""
        match node:
            case Name(name=name):
                self.variables_used.append(name)
                self.put("variable")
            case Negative(of=below):
                self.add(below)
                self.put("negative")
            case Measured(of=below, unit=unit, symbols=symbols):
                self.add(below)
                self.put("* constant", Measured(ONE, unit, symbols))
            case Call(function=function, arguments=arguments):
                for argument in arguments:
                    self.add(argument)
                self.put(function)
            case Binary(operator=operator, a=a, b=b):
                self.binary(operator, a, b)

    def binary(self, operator: str, a: Node, b: Node) -> None:
        """Append those of an operation on two nodes, one of which has a variable."""
        if operator == "-" and self.free(b):
            operator, b = "+", Negative(b)
        elif operator == "-" and self.free(a):
            operator, a, b = "+", Negative(b), a
        elif operator in "+*" and self.free(a):
            a, b = b, a
        self.add(a)
        if self.free(b):
            self.put(f"{operator} constant", b)
        else:
            self.add(b)
            self.put(operator)


# -- Polynomial and harmonic laws --------------------------------------------------------------


@dataclass(frozen=True)
class _Ascending(Law):
    """Laws whose kernel parameters are ascending coefficients."""

    kind: ClassVar[str] = "polynomial"

    def turns(self, x: float) -> FloatArray:
        """Places after x where f′ may change its sign, followed by inf."""
        slope = np.polynomial.Polynomial(self.parameters(self.numbers())).trim().deriv()
        # real parts of complex roots too: a superfluous place does no harm, a missing one would
        places = np.unique(np.real(slope.roots()))
        return np.append(places[places > x], math.inf)


@dataclass(frozen=True)
class Constant(_Ascending):
    """f = value.

    >>> Constant(3.0).derivatives(1.0)
    (3.0, 0.0, 0.0)
    """

    value: NumberField = law_field(1)


@dataclass(frozen=True)
class ConstantSpeed(_Ascending):
    """Uniform motion, ramp: f = value + speed x.

    >>> ConstantSpeed(1.0, 2.0).derivatives(3.0)
    (7.0, 2.0, 0.0)
    """

    value: NumberField = law_field(1)
    speed: NumberField = law_field(1, -1)


@dataclass(frozen=True)
class ConstantAcceleration(_Ascending):
    """Uniformly accelerated motion: f = value + speed x + acceleration x²/2.

    >>> ConstantAcceleration(0.0, 25.0, -40.0).derivatives(0.5)
    (7.5, 5.0, -40.0)
    """

    value: NumberField = law_field(1)
    speed: NumberField = law_field(1, -1)
    acceleration: NumberField = law_field(1, -2)

    def parameters(self, numbers: Mapping[str, Any]) -> list[Any]:
        """[value, speed, acceleration/2]."""
        return [numbers["value"], numbers["speed"], 0.5 * numbers["acceleration"]]


@dataclass(frozen=True)
class Polynomial(_Ascending):
    """f = c0 + c1 x + c2 x² + …, coefficients in ascending powers; its numbers are "c0", "c1", ….

    >>> Polynomial([1.0, 0.0, 3.0]).derivatives(2.0)
    (13.0, 12.0, 6.0)
    """

    coefficients: Converted[tuple[float, ...], NumberRow] = required()

    def _read_numbers(self) -> None:
        values = law_numbers(self.coefficients, "Polynomial", "coefficients")
        object.__setattr__(self, "coefficients", values)

    def _check(self) -> None:
        if not len(self.coefficients):
            raise ModelError("Polynomial: coefficients is empty; give at least the constant term")

    def dimensioned(self, value: Dimension, argument: Dimension) -> Law:
        """A copy with the units of its text checked; every power of the argument has a dimension of
        its own.
        """
        if not self.pending:
            return self
        given = enumerate(self.coefficients)
        return Polynomial([with_dimension(c, value / argument**i, f"c{i}") for i, c in given])

    def numbers(self) -> dict[str, float]:
        """{"c0": …, "c1": …, …}."""
        return {f"c{i}": c for i, c in enumerate(self.coefficients)}

    def with_numbers(self, numbers: Mapping[str, Any]) -> Law:
        """The polynomial with these coefficients."""
        return Polynomial([numbers[f"c{i}"] for i in range(len(numbers))])

    def parameters(self, numbers: Mapping[str, Any]) -> list[Any]:
        """The coefficients in ascending powers."""
        return [numbers[f"c{i}"] for i in range(len(self.coefficients))]


@dataclass(frozen=True)
class Harmonic(Law):
    """Sinusoid, simple harmonic motion: f = mean + amplitude sin(frequency x + phase).

    Frequency in rad per unit of x, phase in rad.

    >>> Harmonic(1.0, 2.0, 10.0).derivatives(0.0)
    (1.0, 20.0, -0.0)
    """

    kind: ClassVar[str] = "harmonic"

    mean: NumberField = law_field(1)
    amplitude: NumberField = law_field(1)
    frequency: NumberField = law_field(0, -1, 1)
    phase: NumberField = law_field(angle=1, default=0.0)

    def turns(self, x: float) -> FloatArray:
        """The next two extremes."""
        if self.amplitude == 0.0 or self.frequency == 0.0:
            return np.array([math.inf])
        n = math.floor((self.frequency * x + self.phase) / math.pi - 0.5) + np.arange(-3, 5)
        places = np.sort(((n + 0.5) * math.pi - self.phase) / self.frequency)
        return np.asarray(places[places > x][:2])


ORDERS = ("value", "rate", "second derivative")
#: Steps end so many units in the last place before a jump, too.
BEFORE = 4


@dataclass(frozen=True, repr=False)
class Expression(FormulaLaw):
    """f = a formula of one variable, compiled to a small program; made by
    `mbody.laws.compile_formula`.

    f, f′ and f″ are exact to rounding. At a corner (of `abs`, `min`, `max`) the values are those to
    the right. Its numbers, "c0", "c1", …, are the parts of the formula that do not contain the
    variable.

    Parameters
    ----------
    text : str
        The formula as it was written.
    program : tuple of int
        Operations in postfix order, by their index in ``mbody.laws.kernels.OPERATIONS``: at most
        200, with at most 32 numbers on the stack.
    constants : tuple of float
        In the order in which the program takes them.

    Raises
    ------
    ModelError
        For an invalid program; later, where the formula has no finite value, or a requested
        derivative does not exist. The kernel returns NaN there.

    >>> Expression("10*sin(5*t)", (0, 3, 7, 3), (5.0, 10.0)).derivatives(0.0)
    (0.0, 50.0, 0.0)
    """

    kind: ClassVar[str] = "expression"

    text: str
    program: tuple[int, ...]
    constants: tuple[float, ...]

    def __post_init__(self) -> None:
        program = tuple(int(code) for code in self.program)
        constants = tuple(
            finite(value, "Expression", f"constants[{n}]") for n, value in enumerate(self.constants)
        )
        object.__setattr__(self, "program", program)
        object.__setattr__(self, "constants", constants)
        if not isinstance(self.text, str):
            raise ModelError(f"Expression: text must be the formula, not {self.text!r}")
        if not program or min(program) < 0 or max(program) >= len(OPERATIONS):
            raise ModelError(
                f"Expression: program must contain indices of operations, not {program}"
            )
        taken = sum(CONSTANT <= code <= POWER_CONSTANT for code in program)
        if taken != len(constants):
            raise ModelError(
                f"Expression: the program takes {taken} constants, there are {len(constants)}"
            )
        if len(program) > MAX_OPERATIONS or stack_depth(program) > MAX_STACK:
            raise ModelError(
                f"Expression: the program has {len(program)} operations and a stack of "
                f"{stack_depth(program)} numbers, at most {MAX_OPERATIONS} and {MAX_STACK} are "
                "possible"
            )

    def __repr__(self) -> str:
        return f"Expression({self.text!r})"

    @property
    def may_have_corners(self) -> bool:
        """Whether something in it makes corners or pulses."""
        from mbody.laws.steep_places import is_smooth

        return not is_smooth(self)

    def corners_between(self, first: float, last: float) -> FloatArray:
        """Corners, places just before a jump of the value, and extrema and inflections of pulses
        that are short beside the span.
        """
        from mbody.laws.steep_places import steep_places

        found = steep_places(self, first, last)
        before = found.jumps - BEFORE * np.spacing(np.abs(found.jumps))
        return np.unique(np.concatenate([found.kinks, found.jumps, before, found.pulses]))

    def rate_jumps(self, first: float, last: float) -> FloatArray:
        """Corners at which the value does not jump."""
        from mbody.laws.steep_places import steep_places

        return steep_places(self, first, last).kinks

    def postfix(self, variable: str = "t") -> Postfix:
        """Its program by names."""
        names = tuple(OPERATIONS[code] for code in self.program)
        return Postfix(names, (variable,) * names.count("variable"), self.constants)

    def table(self) -> FloatArray:
        """[length, operations of the program]."""
        return np.array([len(self.program), *self.program], dtype=float)

    def _check_values(self, xs: FloatArray, out: FloatArray) -> None:
        # a rate may be infinite, as that of sqrt(t) at 0: correct, but of no use for a driver
        bad = np.argwhere(np.isnan(out))
        if bad.size:
            at, order = bad[0]
            raise ModelError(
                f"'{self.text}' has no {ORDERS[order]} at {xs[at]:g}: evaluate it elsewhere, or "
                "choose a formula that has one there, for example with max or min"
            )


def stack_depth(program: tuple[int, ...]) -> int:
    """The largest number of values that a program has on its stack.

    >>> stack_depth((0, 0, 19))
    2
    """
    depth = deepest = 0
    for code in program:
        depth += 1 if code <= CONSTANT else -1 if code > LOG else 0
        deepest = max(deepest, depth)
        if depth < 1:
            raise ModelError("Expression: the program uses a number that is not on the stack")
    if depth != 1:
        raise ModelError(f"Expression: the program leaves {depth} numbers, not one")
    return deepest


# -- Law of a formula of one variable: a polynomial where possible, else postfix ---------------

MAX_DEGREE = 8  # of a formula that becomes a polynomial
ZERO = Plain(Fraction(0))
DEGREE = Binary("/", Name("pi"), Plain(Fraction(180)))


def compile_formula(
    formula: Formula, scope: Scope, argument: Dimension
) -> tuple[Law, dict[str, Formula]]:
    """The law of a formula of time (`t`) or of a stretch, an angle or a rate (`x`).

    Parameters
    ----------
    formula : Formula
        Its dimension is that of the law's values; the variable is in the units of the scope, angles
        in rad.
    scope : Scope
        Unit system and parameters, each one number.
    argument : Dimension
        Of the variable, which is `t` for a time and `x` for anything else.

    Returns
    -------
    law : Law
        A `Polynomial` up to degree 8, else an `Expression`.
    numbers : dict
        The numbers of the law ("c0", …) that depend on parameters, each as a formula that can be
        evaluated in any scope, also over arrays.

    Raises
    ------
    FormulaError
        For units that do not fit, an unknown name, a part that is not finite, or a
        formula of more than 200 operations or 32 numbers on the stack.

    Notes
    -----
    A product of sums, as ``(t - 2)*(t - 3)`` or ``(t - 2)^2``, is not expanded: expanded, it would
    lose digits near its zeros.

    >>> from mbody.quantities import read
    >>> text = "60 deg + 25 rad/s*t - 20 rad/s^2*t^2"
    >>> law, _ = compile_formula(read(text, DIMENSIONS["angle"]), Scope(), DIMENSIONS["time"])
    >>> law.derivatives(0.5)
    (8.547197551196598, 5.0, -40.0)
    >>> scope = Scope(names={"w": Valued(5.0)})
    >>> law, numbers = compile_formula(read("10*sin(w*t)", None), scope, DIMENSIONS["time"])
    >>> law, {name: number.text for name, number in numbers.items()}
    (Expression('10*sin(w*t)'), {'c0': 'w'})
    """
    variable = "t" if argument == DIMENSIONS["time"] else "x"
    other = "x" if variable == "t" else "t"
    if other in formula.names:
        raise FormulaError(misplaced_variable(other))
    whole = Scope(scope.system, {**scope.names, variable: Valued(1.0, argument)})
    tree = expanded(formula.tree)
    if formula.scale(evaluate(formula.tree, whole)) != 1.0:
        tree = Binary("*", tree, DEGREE)
    law: Law
    terms = _terms(tree, variable)
    if terms is not None:
        parts = _numbers([ZERO if term is None else term for term in terms])
        law = Polynomial([part.value(scope) for part in parts])
    else:
        program = PostfixProgram(frozenset((variable,)))
        program.add(tree)
        codes = tuple(OPERATIONS.index(operation) for operation in program.operations)
        if len(codes) > MAX_OPERATIONS or stack_depth(codes) > MAX_STACK:
            raise FormulaError(
                f"{shown(formula.text)} has {len(codes)} operations and a stack of "
                f"{stack_depth(codes)} numbers, at most {MAX_OPERATIONS} and {MAX_STACK} are "
                "possible: define parts of it as parameters"
            )
        parts = _numbers(program.constants)
        law = Expression(formula.text, codes, tuple(part.value(scope) for part in parts))
    names = scope.names.keys()
    return law, {f"c{n}": part for n, part in enumerate(parts) if part.names & names}


def _numbers(trees: list[Node]) -> list[Formula]:
    return [Formula(text_of(tree), tree=tree) for tree in trees]


# -- polynomials ----------------------------------------------------------------------------------


def _terms(node: Node, variable: str) -> list[Node | None] | None:
    """Coefficients in ascending powers of the variable, None for zeros.

    None where the formula is not a polynomial or would lose digits as one.
    """
    if node == Name(variable):
        return [None, ONE]
    if variable not in node.names:
        return [node]
    found: list[Node | None] | None = None
    match node:
        case Negative(of=below):
            found = _each(_terms(below, variable), Negative)
        case Measured(of=below, unit=unit, symbols=symbols):
            one = Measured(ONE, unit, symbols)
            found = _each(_terms(below, variable), lambda c: _times(c, one))
        case Binary(operator="^", a=a, b=b):
            found = _raised(_terms(a, variable), literal_exponent(b))
        case Binary(operator="/", a=a, b=b) if variable not in b.names:
            found = _each(_terms(a, variable), lambda c: Binary("/", c, b))
        case Binary(operator="*" | "+" | "-" as operator, a=a, b=b):
            left, right = _terms(a, variable), _terms(b, variable)
            if left is not None and right is not None:
                found = (_multiplied if operator == "*" else _added)(operator, left, right)
    return found if found is not None and len(found) <= MAX_DEGREE + 1 else None


def _each(
    terms: list[Node | None] | None, change: Callable[[Node], Node]
) -> list[Node | None] | None:
    if terms is None:
        return None
    return [None if term is None else change(term) for term in terms]


def _added(operator: str, a: list[Node | None], b: list[Node | None]) -> list[Node | None]:
    size = max(len(a), len(b))
    result: list[Node | None] = []
    for one, two in zip(_padded(a, size), _padded(b, size), strict=True):
        if one is None and two is not None and operator == "-":
            result.append(Negative(two))
        elif one is None or two is None:
            result.append(two if one is None else one)
        else:
            result.append(Binary(operator, one, two))
    return result


def _padded(terms: list[Node | None], size: int) -> list[Node | None]:
    return terms + [None] * (size - len(terms))


def _multiplied(_: str, a: list[Node | None], b: list[Node | None]) -> list[Node | None] | None:
    single = [terms for terms in (a, b) if sum(term is not None for term in terms) <= 1]
    if not single:
        return None
    result: list[Node | None] = [None] * (len(a) + len(b) - 1)
    for i, one in enumerate(a):
        for j, two in enumerate(b):
            if one is not None and two is not None:
                result[i + j] = _times(one, two)
    return result


def _raised(terms: list[Node | None] | None, power: Fraction | None) -> list[Node | None] | None:
    if terms is None or power is None or power.denominator != 1 or power < 0:
        return None
    if any(term is not None for term in terms[:-1]):
        return None
    top, n = terms[-1], int(power)
    assert top is not None  # the variable is in it
    raised: Node = top if top == ONE else Binary("^", top, Plain(power))
    return [*[None] * (n * (len(terms) - 1)), raised if n else ONE]


def _times(a: Node, b: Node) -> Node:
    return b if a == ONE else a if b == ONE else Binary("*", a, b)
