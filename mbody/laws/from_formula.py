"""From a formula of one variable to a law: a polynomial where possible, else a postfix program."""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction

from mbody.laws.base import Law
from mbody.laws.elementary import Polynomial
from mbody.laws.expression import Expression, stack_depth
from mbody.laws.postfix import MAX_OPERATIONS, MAX_STACK, OPERATIONS
from mbody.laws.postfix_program import PostfixProgram
from mbody.quantities.evaluate import Scope, Valued, evaluate, literal_exponent, misplaced_variable
from mbody.quantities.expansions import expanded
from mbody.quantities.formula import Formula
from mbody.quantities.parse import FormulaError, shown
from mbody.quantities.text import text_of
from mbody.quantities.tree import Binary, Measured, Name, Negative, Node, Plain
from mbody.quantities.units import DIMENSIONS, Dimension

__all__ = ["compile_formula"]

MAX_DEGREE = 8  # of a formula that becomes a polynomial
ZERO, ONE = Plain(Fraction(0)), Plain(Fraction(1))
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
