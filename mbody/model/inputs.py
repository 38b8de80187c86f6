"""Inputs, named numbers that may change during a motion, and controllers that set them."""

from __future__ import annotations

import dataclasses
from collections.abc import Container, Iterator, Sequence
from dataclasses import dataclass
from numbers import Real
from typing import Any, ClassVar

from mbody.errors import ModelError, brief
from mbody.laws import Cam, Law, Polynomial, as_law
from mbody.model.element import (
    Element,
    LawLike,
    check_identifier,
    law_field,
    listed,
    number_field,
)
from mbody.quantities import FUNCTIONS, VARIABLES, Formula, FormulaError, Scope, Valued, evaluate
from mbody.quantities.formula import number, read
from mbody.quantities.types import Converted, NumberField, default, required
from mbody.quantities.units import DIMENSIONS, NUMBER, Dimension, dimension_of


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
