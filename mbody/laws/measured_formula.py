"""A law given by a formula of measured quantities of the instant: of positions, rates, inputs."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

from mbody.errors import ModelError
from mbody.laws.base import FormulaLaw, Law, finite
from mbody.laws.expression import Expression, PostfixProgram
from mbody.laws.kernels import OPERATIONS, FloatArray
from mbody.quantities.evaluate import Postfix, Scope, Valued, evaluate, has_units, joined
from mbody.quantities.formula import Formula
from mbody.quantities.parse import FormulaError, Plain, called, expanded, shown, text_of, walk
from mbody.quantities.units import Dimension

#: Most operations of one formula: longer ones are split into own parameters by their author.
MOST_OPERATIONS = 200
TIME = Postfix(("variable",), ("t",))


@dataclass(frozen=True, repr=False)
class MeasuredFormula(FormulaLaw):
    """A formula of quantities of the instant at which it is evaluated; made from text in a load or
    a state, such as ``"-k*(crank.angle - 30 deg) - c*crank.omega + u"``.

    It has a value in a motion only. Its numbers, "c0", "c1", …, are the parts of the formula
    without measured quantities.

    Parameters
    ----------
    text : str
        The formula as it was written.
    operations : tuple of str
        In postfix order, by their names in ``mbody.laws.kernels.OPERATIONS``.
    variables : tuple of str
        What the operations "variable" take, in their order: names of measured quantities, of
        inputs and auxiliary states, ``t``, or ``x``, what the element's law is of.
    constants : tuple of float
        What the operations with a constant take, in their order.

    Examples
    --------
    >>> import mbody
    >>> cart = mbody.Mechanism("cart")
    >>> cart.add(mbody.Body("cart", mass=1.0), mbody.Prismatic("rail", "ground", "cart"))
    >>> cart.add(mbody.Force("air", "cart", "2 N*s/m*cart.vx", angle="180 deg"))
    >>> cart["air"].value
    MeasuredFormula('2 N*s/m*cart.vx')
    """

    kind: ClassVar[str] = "measured"

    text: str
    operations: tuple[str, ...]
    variables: tuple[str, ...]
    constants: tuple[float, ...]

    def __post_init__(self) -> None:
        constants = tuple(
            finite(value, "MeasuredFormula", f"constants[{n}]")
            for n, value in enumerate(self.constants)
        )
        object.__setattr__(self, "constants", constants)

    def __repr__(self) -> str:
        return f"MeasuredFormula({self.text!r})"

    def laws_of_time(self, curves: Mapping[str, Any]) -> list[Law]:
        """Its largest parts that follow from t alone, and curves of t; `curves`: what it calls."""
        found: list[Law] = []
        parts: list[Postfix | None] = []

        def applied(name: str, *given: Any) -> Postfix | None:
            if name not in curves and None not in given:
                return joined(name, *given)
            found.extend([curves[name].law] if given == (TIME,) else [])
            parts.extend(given)
            return None

        measured = dict.fromkeys({*self.variables} - {"t"})
        parts.append(self.postfix().value(applied, curves, measured))
        for one in parts:
            if one is not None and one.variables:
                codes = tuple(map(OPERATIONS.index, one.operations))
                found.append(Expression(self.text, codes, one.constants))
        return found

    def postfix(self) -> Postfix:
        """Its program."""
        return Postfix(self.operations, self.variables, self.constants)

    def raw(self, xs: FloatArray) -> FloatArray:
        """It has no value of one number alone.

        Raises
        ------
        ModelError
            Always.
        """
        raise ModelError(
            f"'{self.text}' is a formula of measured quantities, which has values in a motion "
            "only: read from the result what the load does, as in run.load(name)"
        )


def compile_measured(
    formula: Formula,
    scope: Scope,
    quantities: Mapping[str, Dimension | None],
    dimension: Dimension | None,
) -> tuple[MeasuredFormula, dict[str, Formula]]:
    """The law of a formula of measured quantities.

    Parameters
    ----------
    formula : Formula
        As it was written.
    scope : Scope
        Unit system and parameters, each one number.
    quantities : mapping
        Dimension of every variable in it; None of one that is a plain number.
    dimension : Dimension or None
        Of the law's value; None for any.

    Returns
    -------
    law : MeasuredFormula
    numbers : dict
        The numbers of the law ("c0", …) that depend on parameters, each as a formula.

    Raises
    ------
    FormulaError
        For units that do not fit, an unknown name, a part that is not finite, or a formula that is
        too long.

    Notes
    -----
    A plain number, a parameter or an input without a unit is in the units of the mechanism,
    whatever it measures: where there is one, sums need not fit each other.

    Examples
    --------
    >>> from mbody.quantities import read
    >>> from mbody.quantities.units import DIMENSIONS
    >>> formula, measured = read("2 N*s/m*cart.vx", None), {"cart.vx": DIMENSIONS["velocity"]}
    >>> compile_measured(formula, Scope(), measured, DIMENSIONS["force"])[0]
    MeasuredFormula('2 N*s/m*cart.vx')
    """
    _check_units(formula, scope, quantities, dimension)
    program = PostfixProgram(frozenset(quantities))
    program.add(expanded(formula.tree))
    if len(program.operations) > MOST_OPERATIONS:
        raise FormulaError(
            f"{shown(formula.text)} has {len(program.operations)} operations, at most "
            f"{MOST_OPERATIONS} are possible: name parts of it as quantities, or use a table"
        )
    parts = [Formula(text_of(part), tree=part) for part in program.constants]
    law = MeasuredFormula(
        formula.text,
        tuple(program.operations),
        tuple(program.variables_used),
        tuple(part.value(scope) for part in parts),
    )
    known = scope.names.keys()
    return law, {f"c{n}": part for n, part in enumerate(parts) if part.names & known}


def _check_units(
    formula: Formula,
    scope: Scope,
    quantities: Mapping[str, Dimension | None],
    dimension: Dimension | None,
) -> None:
    """Refuse an unknown name, and units that do not fit where all numbers have units."""
    plain = {name: Valued(1.0) for name in quantities}
    named = formula.names | called(formula.tree)  # curves are called by name
    unknown = any(scope.names[n].dimension is None for n in named & scope.names.keys())
    unknown = unknown or any(isinstance(node, Plain) for node in walk(formula.tree))
    if unknown and not has_units(formula.tree, Scope(scope.system, {**scope.names, **plain})):
        evaluate(formula.tree, Scope(scope.system, {**scope.names, **plain}))
        return
    measured = {name: Valued(1.0, of) for name, of in quantities.items()}
    whole = Scope(scope.system, {**scope.names, **measured})
    try:
        found = evaluate(formula.tree, whole, with_units=True)
        (formula if dimension is None else formula.of(dimension)).scale(found)
    except FormulaError:
        used = named & whole.names.keys()
        if all(whole.names[name].dimension is not None for name in used):
            raise
        evaluate(formula.tree, whole, checked=False)
