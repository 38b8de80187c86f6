"""States of a user's own: first-order equations that are integrated with the motion."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Container, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from numbers import Real
from typing import Any, ClassVar, Protocol

from mbody.errors import ModelError, brief
from mbody.laws import Cam, Law, MeasuredFormula, Polynomial, as_law, compile_measured
from mbody.model.body import MOTION, ORIGIN, ROTATION
from mbody.model.driver import DRIVEN
from mbody.model.element import (
    STEADY,
    Element,
    LawLike,
    check_identifier,
    law_field,
    listed,
    number_field,
)
from mbody.quantities import FUNCTIONS, VARIABLES, Formula, FormulaError, Scope, Valued, evaluate
from mbody.quantities.evaluate import Postfix, joined
from mbody.quantities.formula import (
    Converted,
    Number,
    NumberField,
    constant_or_formula,
    default,
    number,
    read,
    required,
)
from mbody.quantities.units import DIMENSIONS, NUMBER, Dimension, dimension_of

# -- Named quantities: formulas of the present instant that later formulas name ----------------

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
    law: MeasuredFormula, machine: Any, law_of: Callable[[Quantity], Any]
) -> MeasuredFormula:
    """A formula with those of its quantities in the place of these. `law_of`: That of a quantity,
    with the numbers that are in force.
    """
    known: dict[str, Postfix] = {}
    for one in quantities_named(machine, law.variables):
        known[one.name] = law_of(one).postfix().value(joined, machine.curves, known)
    return MeasuredFormula(law.text, *law.postfix().value(joined, machine.curves, known))


# -- Inputs, named numbers that may change during a motion, and controllers that set them ------


@dataclass(frozen=True)
class Input(Element):
    """A named number that formulas use, and that may change while the mechanism moves.

    It is what a motor controller, a driver at the pedal or a file of measurements gives: a formula
    names it as it names a parameter, and `simulate`, a `Simulator` or a `Controller` change it.

    Parameters
    ----------
    name : str
        Unique in the mechanism; formulas name it.
    value : float, str, Law
        Its value where nobody gives another: a number with its unit, such as ``"0 N*m"``, by which
        its dimension is known, or a law of time.

    Examples
    --------
    >>> from mbody import Body, Mechanism, Revolute, Torque
    >>> machine = Mechanism("crank")
    >>> machine.add(Body("crank", mass=1.0, inertia=0.1), Revolute("O", "ground", "crank"))
    >>> machine.add(Input("u", "2 N*m"), Torque("motor", "crank", value="u - 0.1*crank.omega"))
    >>> machine.inputs[0].value
    Constant(value=2.0)
    """

    main: ClassVar[tuple[str, ...]] = ("value",)
    role: ClassVar[str] = "input"

    value: LawLike = law_field("number", 0.0)
    #: What it measures; None of a plain number. The mechanism that takes it finds it.
    dimension: Dimension | None = default(None)

    def _enter(self) -> None:
        check_identifier(self)
        super()._enter()

    def _law(self, field: dataclasses.Field[Any], value: Any) -> Law | Formula:
        if isinstance(value, Real) and not isinstance(value, bool):
            value = number(value, "number", self.name, field.name)
        try:
            return as_law(value)
        except ModelError as error:
            raise ModelError(f"'{self.name}': {field.name}: {error}", self.name) from None

    def measured(self, scope: Scope) -> Input:
        """The input with the dimension of its value, or that which another mechanism found."""
        try:
            found = dimension_given(self.value, scope)
            if found is None and self.dimension is not None:
                found = dimension_of(self.dimension)
            law: Any = self.value
            if isinstance(law, Law):
                law = law.dimensioned(found or NUMBER, DIMENSIONS["time"])
        except FormulaError as error:
            raise ModelError(f"'{self.name}': value: {error}", self.name) from None
        return dataclasses.replace(self, value=law, dimension=found)


def dimension_given(value: Any, scope: Scope) -> Dimension | None:
    """The dimension of a number or a law of time that was given as text; None where it has none.

    >>> from mbody.quantities import Scope
    >>> dimension_given(as_law("2 N*m"), Scope()) == DIMENSIONS["torque"]
    True
    """
    if isinstance(value, str):
        value = read(value, None)
    time = DIMENSIONS["time"]
    whole = dataclasses.replace(scope, names={**scope.names, "t": Valued(1.0, time)})
    for formula, power in _formulas(value):
        found = evaluate(formula.tree, whole).dimension
        if found is not None:
            return found / time**power
    return None


def _formulas(value: Any) -> Iterator[tuple[Formula, int]]:
    """Formulas among the numbers of a law that have its dimension times a power of time, with that
    power.
    """
    if isinstance(value, Formula):
        yield value, 0
    elif isinstance(value, Polynomial):
        yield from ((c, -n) for n, c in enumerate(value.coefficients) if isinstance(c, Formula))
    elif isinstance(value, Cam):
        for segment in value.segments:
            yield from _formulas(segment)
    elif isinstance(value, Law):
        for field in dataclasses.fields(value):
            own, powers = getattr(value, field.name), field.metadata.get("powers", (0, 0, 0))
            if powers[0] == 1 and not powers[2]:
                parts = own if isinstance(own, tuple) else (own,)
                yield from ((part, powers[1]) for part in parts if isinstance(part, Formula))


# -- Sampled controllers: Python that is called at a fixed rate and sets inputs ----------------


@dataclass(frozen=True)
class Controller(Element):
    """A sampled controller: reads measured quantities and sets inputs, once a sample.

    The function is called in the order of time, at the first instant and then every `every`, with a
    snapshot of what it reads; the inputs keep the values that it gives until the next sample. Steps
    of the integrator end at samples, so that the result does not depend on their lengths. Those
    that sample at the same instant are called in the order of the description: each reads the
    inputs as those before it have set them.

    Parameters
    ----------
    name : str
        Unique in the mechanism.
    function : callable
        ``function(t, *reads)``: the time and one float for each of `reads`; returns one float for
        the only input of `sets`, one for each of them in a row, or a mapping by name. An object
        with a ``__call__`` is copied when a motion begins, so that every motion begins with the
        memory that it has here, and its memory is kept with the result, for motions that go on.
    every : float or str
        The sample time, such as ``"1 ms"``.
    reads : sequence of str
        What is measured at a sample: formulas as of `Measure`, forces among them, in the units of
        the mechanism.
    sets : sequence of str
        Names of inputs.
    delay : float or str
        How long after the sample the inputs change, 0 for at once.

    Examples
    --------
    >>> from mbody import Body, Gravity, Input, Mechanism, Revolute, Torque, simulate
    >>> machine = Mechanism("arm")
    >>> machine.add(Body("arm", mass=1.0, cg=(0.5, 0.0), guess=0.0), Revolute("O", "ground", "arm"))
    >>> machine.add(Gravity("gravity", y=-9.81))
    >>> machine.add(Input("u", "0 N*m"), Torque("motor", "arm", value="u"))
    >>> def hold(t, angle, rate):
    ...     return 4.905 - 50.0 * angle - 10.0 * rate
    >>> machine.add(Controller("pd", hold, "1 ms", ["arm.angle", "arm.omega"], ["u"]))
    >>> run = simulate(machine, 1.0)
    >>> bool(abs(run["arm"].angle[-1]) < 1e-2)
    True
    """

    main: ClassVar[tuple[str, ...]] = ("every",)
    role: ClassVar[str] = "controller"

    function: Any = required()
    every: NumberField = number_field("time", dataclasses.MISSING, sign="positive")
    reads: Converted[tuple[str, ...], Sequence[str]] = default(())
    sets: Converted[tuple[str, ...], Sequence[str]] = default(())
    delay: NumberField = number_field("time", 0.0, sign="not negative")

    def _enter(self) -> None:
        if not callable(self.function) or isinstance(self.function, type):
            raise ModelError(
                f"'{self.name}': function must be a function of (t, *reads), not "
                f"{brief(self.function)}",
                self.name,
            )
        for field in ("reads", "sets"):
            given = getattr(self, field)
            given = (given,) if isinstance(given, str) else given
            if not isinstance(given, Sequence) or not all(isinstance(one, str) for one in given):
                raise ModelError(
                    f"'{self.name}': {field} must be a list of text, not {brief(given)}", self.name
                )
            object.__setattr__(self, field, tuple(given))
        if not self.sets:
            raise ModelError(
                f"'{self.name}' sets no input: name one or more, as in sets=[\"u\"]", self.name
            )
        super()._enter()


# -- Checks of what formulas name: inputs and states, and of what controllers set --------------


def check_formula_name(element: Element, parameters: Container[str]) -> None:
    """Refuse a name that formulas have for something else."""
    name, what = element.name, ""
    if name in parameters:
        what = "a parameter"
    elif name in (*FUNCTIONS, *VARIABLES, "pi"):
        what = "a function, a variable or pi"
    if what:
        raise ModelError(
            f"'{name}' is the name of {what} in formulas: choose another name for the "
            f"{element.role}",
            name,
        )


def check_sets(
    controller: Controller, inputs: Sequence[Input], others: Sequence[Controller]
) -> None:
    """Refuse a controller of inputs that are not there, or that another one sets."""
    known = [one.name for one in inputs]
    owners = {name: one.name for one in others for name in one.sets}
    for name in controller.sets:
        if name not in known:
            raise ModelError(
                f"'{controller.name}' sets {brief(name)}, which is no input (there are: "
                f"{listed(known)}): add Input(...) before it",
                controller.name,
            )
        if name in owners:
            raise ModelError(
                f"'{controller.name}' sets '{name}', which '{owners[name]}' sets already: give "
                "each controller inputs of its own, and add them in a formula",
                controller.name,
            )


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
