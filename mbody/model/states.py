"""States of a user's own: first-order equations that are integrated with the motion."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar, Protocol

from mbody.errors import ModelError, brief
from mbody.laws import Law, MeasuredFormula, compile_measured
from mbody.model.body import MOTION, ORIGIN, ROTATION
from mbody.model.driver import DRIVEN
from mbody.model.element import STEADY, Element, check_identifier, listed
from mbody.quantities import Formula, FormulaError, Scope, Valued, evaluate
from mbody.quantities.formula import constant_or_formula, read
from mbody.quantities.types import Converted, Number, default, required
from mbody.quantities.units import DIMENSIONS, Dimension, dimension_of

# -- Quantities that formulas of the present instant may measure -------------------------------

#: Keys of quantities that are known when the equations of motion are solved.
OF_FORCES = (
    "ax", "ay", "alpha", "acceleration", "effort", "power", "fx", "fy", "force", "torque", "loss",
    "contact",
)  # fmt: skip


class Described(Protocol):
    """A mechanism, as far as it has been described."""

    @property
    def inputs(self) -> Sequence[Any]:
        """Its inputs."""

    @property
    def states(self) -> Sequence[Any]:
        """Its auxiliary states."""

    @property
    def quantities(self) -> Sequence[Any]:
        """Its named quantities."""

    @property
    def parameters(self) -> Any:
        """Its parameters."""

    @property
    def measures(self) -> Mapping[str, Any]:
        """Its measures."""

    def __getitem__(self, name: str) -> Element:
        """The element of that name."""

    def __contains__(self, name: object) -> bool:
        """Whether there is one."""

    def __iter__(self) -> Iterator[Element]:
        """All elements."""


def measured_names(machine: Described, names: frozenset[str]) -> dict[str, Dimension | None]:
    """Those of the names in a formula that are no numbers of the description, with the dimension
    of each: inputs, auxiliary states, named quantities, and dotted names.
    """
    own = {
        one.name: one.dimension for one in (*machine.inputs, *machine.states, *machine.quantities)
    }
    found: dict[str, Dimension | None] = {}
    for name in sorted(names):
        if name in own:
            found[name] = own[name]
        elif "." in name:
            found[name] = state_quantity(machine, name)
    return found


def state_quantity(machine: Described, name: str) -> Dimension:
    """The dimension of a quantity of the present state, by its dotted name."""
    owner, _, key = name.rpartition(".")
    element, _, point = owner.partition(".")
    if element != "ground" and element not in machine:
        there = listed(["ground", *(one.name for one in machine)])
        raise FormulaError(
            f"there is no '{element}' to measure '{name}' of (there are: {there}): add it before, "
            "or correct the name"
        )
    known = _known(machine[element], point)
    if key in known:
        return dimension_of(known[key])
    if key in OF_FORCES:
        raise FormulaError(
            f"'{name}' is no quantity that formulas measure in the instant that they are evaluated "
            f"at: measure others (of '{owner}': {listed(known)}), or let a controller read it at "
            "its samples and set an Input"
        )
    raise FormulaError(f"'{owner}' has no '{key}' to measure here (it has: {listed(known)})")


def _known(element: Element, point: str) -> Mapping[str, str]:
    """Quantities of the present state that an element, or one of its points, has."""
    owned: object = element
    if element.role == "body":
        points: Mapping[str, object] = getattr(owned, "points", {})
        if point and point != ORIGIN and point not in points:
            raise FormulaError(
                f"'{element.name}' has no point '{point}' (it has: {listed(points)})"
            )
        return MOTION if point else MOTION | ROTATION
    if point:
        raise FormulaError(f"'{element.name}' has no points: it is no body")
    if element.role == "driver":
        return {key: element.quantities()[key] for key in (*DRIVEN[:2], "effort", "power")}
    kept = _reaction(element) if element.role == "joint" else ()
    found = {
        key: dimension
        for key, dimension in element.quantities().items()
        if key not in OF_FORCES or key in kept
    }
    if element.role != "load":
        return found
    load: Any = element
    made = {key: dimension for key, (_, dimension) in load.outputs().items()}
    states = {one.name.rpartition(".")[2]: one.measure for one in load.auxiliary_states()}
    return found | made | states | _described(element)


def _reaction(joint: Any) -> tuple[str, ...]:
    """What of a joint's reaction formulas measure: of what may open, which contacts stand for in
    `simulate`, nothing; no torque about a place that moves on the body.
    """
    from mbody.model.joints import Joint

    if joint.can_separate:
        return ()
    force = ("fx", "fy", "force")
    return (*force, "torque") if type(joint).reaction_point is Joint.reaction_point else force


def _described(load: Element) -> dict[str, str]:
    """The numbers and the laws of time of a load, which do not follow from the motion."""
    found = {}
    for field in dataclasses.fields(load):
        meta, value = field.metadata, getattr(load, field.name)
        if "dimension" in meta and value is not None:
            found[field.name] = meta["dimension"]
        elif meta.get("of") == "time" and value is not None:
            found[field.name] = meta["law"]
    return found


# -- Formulas that an element has as text: states and named quantities -------------------------


def formula_given(element: Element, field: str, example: str) -> Formula | Law:
    """The formula of a field as it was given, read."""
    given = getattr(element, field)
    if isinstance(given, MeasuredFormula | Formula):
        return given
    text = f"{given!r}" if isinstance(given, float | int) else given
    if not isinstance(text, str):
        raise ModelError(
            f"'{element.name}': {field} must be a formula such as \"{example}\", not "
            f"{brief(given)}",
            element.name,
        )
    try:
        return read(text, None, curves=True)
    except FormulaError as error:
        raise ModelError(f"'{element.name}': {field}: {error}", element.name) from None


def compiled_formula(
    element: Element,
    field: str,
    scope: Scope,
    quantities: Mapping[str, Dimension | None],
    wanted: Dimension | None,
) -> tuple[Any, dict[str, Formula]]:
    """The formula of a field as a law, and what it and its numbers were made of; nothing of one
    that is a law.
    """
    given = getattr(element, field)
    if not isinstance(given, Formula):
        return given, {}
    names = dict(quantities) | ({"t": DIMENSIONS["time"]} if "t" in given.names else {})
    try:
        law, numbers = compile_measured(given, scope, names, wanted)
    except FormulaError as error:
        raise ModelError(f"'{element.name}': {field}: {error}", element.name) from None
    own = f"{element.name}.{field}"
    return law, {f"{own}.{key}": formula for key, formula in numbers.items()} | {own: given}


def formula_dimension(
    formula: Formula, scope: Scope, quantities: Mapping[str, Dimension | None]
) -> Dimension | None:
    """Dimension of a formula; None where plain numbers leave it open."""
    measured = {name: Valued(1.0, dimension) for name, dimension in quantities.items()}
    whole = Scope(scope.system, {**scope.names, **measured})
    plain = any(scope.names[n].dimension is None for n in formula.names & scope.names.keys())
    try:
        return evaluate(formula.tree, whole, with_units=True).dimension
    except FormulaError:
        if plain:
            return None
        raise


# -- States of one's own -----------------------------------------------------------------------


@dataclass(frozen=True)
class State(Element):
    """A state of one's own, z with ż = rate: an integrator, a filter, a current, a temperature.

    It is integrated with the motion, at its tolerance. Formulas name it as they name an input.

    Parameters
    ----------
    name : str
        Unique in the mechanism; formulas name it.
    rate : str
        A formula of measured quantities, inputs, states, parameters and ``t``, such as
        ``"target - crank.angle"``; plain numbers are in the units of the mechanism. It may measure
        accelerations, reactions and efforts of the instant; impulses of impacts are none.
    start : float, str
        Its value at the first instant, with its unit, by which its dimension is known; ``"steady"``
        chooses the value at which the rate vanishes.
    size : float, optional
        A typical value, to which the absolute error is relative; by default the magnitude of the
        start, or where that is zero one, in units of the model's length, its greatest mass and 1 s.

    Examples
    --------
    >>> from mbody import Body, Mechanism, Revolute, Torque
    >>> machine = Mechanism("crank")
    >>> machine.add(Body("crank", mass=1.0, inertia=0.1), Revolute("O", "ground", "crank"))
    >>> machine.add(State("integral", rate="30 deg - crank.angle", start="0 rad*s"))
    >>> law = "4 N*m/rad/s*integral - 2 N*m*s/rad*crank.omega"
    >>> machine.add(Torque("motor", "crank", value=law))
    >>> machine.states[0].name
    'integral'
    """

    main: ClassVar[tuple[str, ...]] = ("rate",)
    role: ClassVar[str] = "state"

    rate: Converted[Any, str] = required()
    start: Converted[Any, Number] = default(0.0)
    size: Converted[Any, Number | None] = default(None)
    #: What it measures; None of a plain number. The mechanism that takes it finds it.
    dimension: Dimension | None = default(None)

    def _enter(self) -> None:
        check_identifier(self)
        if self.start is None:
            raise ModelError(
                f"state '{self.name}' has no start: give a number with its unit, or \"{STEADY}\" "
                "for the one at which its rate vanishes",
                self.name,
            )
        for field, given in (("start", self.start), ("size", self.size)):
            if given is not None and not (field == "start" and given == STEADY):
                value = constant_or_formula(given, None, f"'{self.name}': {field}", self.name)
                object.__setattr__(self, field, value)
        object.__setattr__(self, "rate", formula_given(self, "rate", "target - crank.angle"))
        if isinstance(self.size, float) and self.size <= 0.0:
            raise ModelError(
                f"'{self.name}': size is {self.size:g}, it must be positive: give more than 0",
                self.name,
            )

    @property
    def start_number(self) -> str:
        """The dotted name of its start among the numbers of a system."""
        return f"{self.name}.start"

    def numbers(self) -> dict[str, Any]:
        """Its start, its size and the numbers of its rate."""
        found: dict[str, Any] = {}
        if self.start != STEADY:
            found[f"{self.name}.start"] = self.start
        if self.size is not None:
            found[f"{self.name}.size"] = self.size
        if isinstance(self.rate, Law):
            found |= {f"{self.name}.rate.{key}": v for key, v in self.rate.numbers().items()}
        return found

    def entered(self, scope: Scope) -> tuple[State, dict[str, Formula]]:
        """The state with floats for its start and size, and what they were made of; its rate is
        compiled when all is there that it may measure.
        """
        from mbody.model.inputs import dimension_given

        changes: dict[str, Any] = {}
        made: dict[str, Formula] = {}
        for field in ("start", "size"):
            given = getattr(self, field)
            if isinstance(given, Formula):
                try:
                    changes[field] = given.value(scope)
                    changes.setdefault("dimension", dimension_given(given, scope))
                except FormulaError as error:
                    raise ModelError(f"'{self.name}': {field}: {error}", self.name) from None
                made[f"{self.name}.{field}"] = given
        return dataclasses.replace(self, **changes), made

    def compiled(
        self, scope: Scope, quantities: Mapping[str, Dimension | None]
    ) -> tuple[State, dict[str, Formula]]:
        """The state with its rate as a law, and what its numbers were made of.

        quantities: the dimension of each measured quantity in the rate.
        """
        wanted = None if self.dimension is None else self.dimension / DIMENSIONS["time"]
        law, made = compiled_formula(self, "rate", scope, quantities, wanted)
        return dataclasses.replace(self, rate=law), made


def rate_names(state: State) -> frozenset[str]:
    """The names in the formula of a rate."""
    rate: Any = state.rate
    return frozenset(rate.variables if isinstance(rate, MeasuredFormula) else rate.names)


def check_unmeasured(
    elements: Iterable[Element], formulas: Mapping[str, Formula], gone: set[str]
) -> None:
    """Refuse to release drivers that formulas of loads and states measure."""
    names: dict[str, frozenset[str]] = {}
    for name, formula in formulas.items():
        owner = name.partition(".")[0]
        names[owner] = names.get(owner, frozenset()) | formula.names
    for element in elements:
        found = names.get(element.name, frozenset())
        found |= rate_names(element) if isinstance(element, State) else frozenset()
        owners = {name.partition(".")[0] for name in found if "." in name}
        for driver in sorted(owners & gone):
            raise ModelError(
                f"driver '{driver}' cannot be released, '{element.name}' measures it: measure the "
                "body that it drives, or a joint",
                element.name,
            )
