"""Named quantities: formulas of the present instant that later formulas name."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

from mbody.errors import ModelError
from mbody.laws import Law, MeasuredFormula
from mbody.model.element import Element, check_identifier
from mbody.model.states import (
    OF_FORCES,
    Described,
    compiled_formula,
    formula_dimension,
    formula_given,
    measured_names,
)
from mbody.quantities import Formula, FormulaError, Scope
from mbody.quantities.types import Converted, default, required
from mbody.quantities.units import DIMENSIONS, Dimension

#: Most operations of a quantity with those of all that it names.
MOST_EXPANDED = 20_000


@dataclass(frozen=True)
class Quantity(Element):
    """A named quantity of the instant: a formula that later formulas name.

    Loads, drivers, states, stops, conditions, controllers and measures may name it, and quantities
    that are added after it. It is computed once in each formula that names it, however often.

    Parameters
    ----------
    name : str
        Unique in the mechanism; formulas name it.
    formula : str
        A formula of measured positions and rates, inputs, states, parameters, ``t`` and quantities
        that were added before, such as ``"crank.angle - target"``. Its dimension follows from it;
        plain numbers are in the units of the mechanism.

    Examples
    --------
    >>> from mbody import Body, Mechanism, Revolute, Torque
    >>> machine = Mechanism("crank")
    >>> machine.add(Body("crank", mass=1.0, inertia=0.1), Revolute("O", "ground", "crank"))
    >>> machine.add(Quantity("error", "30 deg - crank.angle"))
    >>> law = "4 N*m/rad*error - 2 N*m*s/rad*crank.omega"
    >>> machine.add(Torque("motor", "crank", value=law))
    >>> machine.quantities[0].name
    'error'
    """

    main: ClassVar[tuple[str, ...]] = ("formula",)
    role: ClassVar[str] = "quantity"

    formula: Converted[Any, str] = required()
    #: What it measures; None of a plain number. The mechanism that takes it finds it.
    dimension: Dimension | None = default(None)

    def _enter(self) -> None:
        check_identifier(self)
        object.__setattr__(self, "formula", formula_given(self, "formula", "crank.angle - target"))

    def numbers(self) -> dict[str, Any]:
        """The numbers of its formula."""
        if not isinstance(self.formula, Law):
            return {}
        return {f"{self.name}.formula.{key}": v for key, v in self.formula.numbers().items()}

    def refuse_measure(self, measures: Iterable[str]) -> None:
        """Refuse a measure of its name."""
        if self.name in measures:
            raise ModelError(
                f"'{self.name}' is a quantity and a measure: formulas name both, give one of them "
                "another name",
                self.name,
            )

    def compiled(self, machine: Described, scope: Scope) -> tuple[Quantity, dict[str, Formula]]:
        """The quantity with its formula as a law, and what the numbers of that were made of."""
        given: Any = self.formula
        if not isinstance(given, Formula):
            return self, {}
        if self.name in given.names:
            raise ModelError(
                f"'{self.name}': formula: '{self.name}' names itself: a quantity names what was "
                "added before it; for a memory use a State",
                self.name,
            )
        try:
            known = measured_names(machine, given.names)
            law, made = compiled_formula(self, "formula", scope, known, None)
            times = {"t": DIMENSIONS["time"]} if "t" in given.names else {}
            dimension = formula_dimension(given, scope, known | times)
        except FormulaError as error:
            raise ModelError(f"'{self.name}': formula: {error}", self.name) from None
        sizes: dict[str, int] = {}
        for one in quantities_named(machine, law.variables):
            sizes[one.name] = _size(one.formula, sizes)
        count = _size(law, sizes)
        if count > MOST_EXPANDED:
            raise ModelError(
                f"'{self.name}': formula: with the quantities that it names it has {count} "
                f"operations, at most {MOST_EXPANDED} are possible: name a quantity once, or keep "
                "a State",
                self.name,
            )
        return dataclasses.replace(self, formula=law, dimension=dimension), made


def _size(law: Any, sizes: Mapping[str, int]) -> int:
    return len(law.operations) + sum(sizes.get(name, 0) for name in law.variables)


def quantities_named(machine: Described, names: Iterable[str]) -> list[Quantity]:
    """The named quantities that a formula needs, each after those that it names."""
    needed, found = set(names), list[Quantity]()
    for one in reversed(machine.quantities):
        if one.name in needed and isinstance(one.formula, MeasuredFormula):
            found.append(one)
            needed |= set(one.formula.variables)
    return found[::-1]


def names_measured(machine: Described, names: Iterable[str]) -> frozenset[str]:
    """The names in a formula, with those of its quantities in the place of these."""
    whole, found = set(names), quantities_named(machine, names)
    for one in found:
        whole |= set(one.formula.variables)
    return frozenset(whole - {one.name for one in found})


def measuring_forces(machine: Any, *, states: bool = False) -> list[str]:
    """Names of the loads, and of the `states`, whose formulas measure accelerations, reactions or
    efforts.
    """

    def of_solution(name: str) -> bool:
        owner, _, key = name.rpartition(".")
        whose = machine[owner.partition(".")[0]].role if owner else ""
        return key in OF_FORCES and whose in ("body", "joint", "driver")

    elements = (*machine.loads, *(machine.described_states if states else ()))
    laws = {
        one.name: [law for law in vars(one).values() if isinstance(law, MeasuredFormula)]
        for one in elements
    }
    return [
        name
        for name, own in laws.items()
        if any(of_solution(one) for law in own for one in names_measured(machine, law.variables))
    ]


def expanded(
    law: MeasuredFormula, machine: Described, law_of: Callable[[Quantity], Any]
) -> MeasuredFormula:
    """A formula with those of its quantities in the place of these. `law_of`: That of a quantity,
    with the numbers that are in force.
    """
    known: dict[str, MeasuredFormula] = {}
    for one in quantities_named(machine, law.variables):
        known[one.name] = _spliced(law_of(one), known)
    return _spliced(law, known)


def _spliced(law: MeasuredFormula, known: Mapping[str, MeasuredFormula]) -> MeasuredFormula:
    if not known.keys() & set(law.variables):
        return law
    operations, variables, constants = list[str](), list[str](), list[float]()
    names, own = iter(law.variables), iter(law.constants)
    for operation in law.operations:
        name = next(names) if operation == "variable" else ""
        if name in known:
            operations += known[name].operations
            variables += known[name].variables
            constants += known[name].constants
            continue
        operations.append(operation)
        variables += [name] if name else []
        constants += [next(own)] if operation.endswith("constant") else []
    return MeasuredFormula(law.text, tuple(operations), tuple(variables), tuple(constants))
