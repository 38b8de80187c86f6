"""Steps of all formulas of measured quantities as one table for the kernels."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from mbody.errors import ModelError
from mbody.kernels import constraints
from mbody.kernels.layout import PER_PRIMITIVE
from mbody.laws import Law, MeasuredFormula, Table
from mbody.laws.kernels import OPERATIONS, FloatArray
from mbody.model.element import Element, Numbers
from mbody.model.mechanism import Mechanism
from mbody.model.primitives import Signal

if TYPE_CHECKING:
    from mbody.model.stop import Stop
    from mbody.system.formula_steps import Recorded, StepList

# -- Formulas of drivers in time, inputs, auxiliary states and positions -----------------------
# A driver prescribes Φ = c − f = 0 for its coordinate c. Of time, inputs and auxiliary states
# alone, f has the derivatives ḟ and f̈ by time, and nothing else changes. Where f measures
# positions, Φ is a constraint of all their bodies:
#
#     Φ_q = c_q − f_q,    ν = −Φ_t = ∂f/∂t,    γ = −d²Φ/dt² at a = 0,
#
# so that Φ_q v = ν and Φ_q a = γ; its multiplier acts on every body that f measures, and its power
# is that of ν alone. An auxiliary state of f changes at its rate, which may measure positions, not
# rates.


@dataclass(frozen=True)
class DriverFormula:
    """The formula of one driver, recorded.

    `value`, `rate`, `acceleration`: The places of f and its derivatives by time; where it follows
      positions, of f, ν and γ.
    `measured_bodies`: The moving bodies whose positions Φ has; none where f has no positions.
    `phi`: The place of Φ, where f has positions.
    `gradient`: The places of Φ_q by body and axis, zero ones too.
    `inputs`: Inputs on which f or its rate depends: they must not jump.
    `states`: Auxiliary states on which it depends.
    `explicit`: Whether f changes while all bodies rest.
    """

    steps: StepList
    value: int
    rate: int
    acceleration: int
    measured_bodies: tuple[str, ...] = ()
    phi: int = -1
    gradient: dict[tuple[str, int], int] = field(default_factory=dict)
    inputs: frozenset[str] = frozenset()
    states: frozenset[str] = frozenset()
    explicit: bool = True

    @property
    def signals(self) -> frozenset[str]:
        """Inputs whose derivatives it may need."""
        return frozenset(what[1] for what in self.steps.steps if what[0].startswith("signal"))


def recorded_driver(
    driver: Element, signal: Signal, machine: Mechanism, at: Numbers
) -> DriverFormula:
    """Record the formula that a driver follows."""
    from mbody.system.formula_steps import (
        Differentiated,
        NotSmooth,
        Recorded,
        along_motion,
        by_coordinate,
        by_time,
        driven_coordinate,
        record_formula,
        state_rate,
    )

    law: Any = signal.law
    steps = record_formula(law, signal.parameters, machine, at)
    value = Recorded(steps, steps.value)

    def known(one: Recorded) -> Recorded:
        if _measures_solution(steps, one.place):
            raise ModelError(
                f"'{driver.name}': law is '{law.text}', which follows accelerations or forces: "
                "these follow from the driven motion; measure positions, or use a Torque or a "
                "Force",
                driver.name,
            )
        return one

    def rate_of(state: str) -> Recorded:
        return known(state_rate(steps, state, machine, at))

    def steady_rate_of(state: str) -> Recorded:
        # a rate that jumps would be one of the driver
        return _without_jumps(rate_of(state))

    def zero_or(one: Recorded | None) -> Recorded:
        return steps.number(0.0) if one is None else one

    known(value)
    along = Differentiated(steps, along_motion(rate_of))
    still = Differentiated(steps, by_time(steady_rate_of))
    try:
        rate = still.of(_without_jumps(value))
        _check_rates(steps, value, rate, driver, law)
        if not any(_reads(steps, one, "position", "turn") for one in (value, rate)):
            acceleration = zero_or(along.of(rate))
            found = DriverFormula(steps, value.place, zero_or(rate).place, acceleration.place)
        else:
            phi = driven_coordinate(steps, driver, at) - value
            second = along.of(along.of(phi))
            gamma = steps.number(0.0) if second is None else steps.number(-1.0) * second
            bodies = _moving(steps, phi, machine)
            gradient = {}
            for body in bodies:
                for axis in range(3):
                    by = Differentiated(steps, by_coordinate(body, axis))
                    gradient[body, axis] = zero_or(by.of(phi)).place
            found = DriverFormula(
                steps,
                value.place,
                zero_or(rate).place,
                gamma.place,
                measured_bodies=bodies,
                phi=phi.place,
                gradient=gradient,
                explicit=rate is not None,
            )
    except NotSmooth as error:
        raise _not_smooth(driver, law, str(error)) from None
    prescribed = [value.place, *([] if rate is None else [rate.place])]
    named = [steps.steps[place] for place in steps.needed(prescribed)]
    inputs = frozenset(str(what[1]) for what in named if what[0].startswith("signal"))
    _check_jumps(driver, law, machine, inputs)
    states = frozenset(str(what[1]) for what in named if what[0] == "own")
    return DriverFormula(**{**found.__dict__, "inputs": inputs, "states": states})


def driver_inputs(machine: Mechanism, at: Numbers) -> dict[str, str]:
    """Inputs that must not jump, since the position or the rate of a driver follows them, with the
    driver's name.
    """
    found: dict[str, str] = {}
    for driver in machine.drivers:
        signal = at.law(driver, "law")
        if isinstance(signal.law, MeasuredFormula):
            named = recorded_driver(driver, signal, machine, at).inputs
            found |= dict.fromkeys(sorted(named), driver.name)
    return found


def driver_states(driver: Element, machine: Mechanism, at: Numbers) -> tuple[str, ...]:
    """Auxiliary states that a driver follows."""
    own: Any = driver
    if not isinstance(own.law, MeasuredFormula):
        return ()
    signal = at.law(driver, "law")
    return tuple(sorted(recorded_driver(driver, signal, machine, at).states))


def _without_jumps(one: Recorded) -> Recorded:
    """The given number; NotSmooth where it depends on a jump."""
    from mbody.system.formula_steps import JUMPS, NotSmooth

    for place in one.steps.needed([one.place]):
        if one.steps.steps[place][0] in JUMPS:
            raise NotSmooth(one.steps.steps[place][0])
    return one


def _reads(steps: StepList, one: Recorded | None, *kinds: str) -> bool:
    """Whether a number depends on something that is read of that kind."""
    if one is None:
        return False
    return any(steps.steps[place][0] in kinds for place in steps.needed([one.place]))


def _moving(steps: StepList, phi: Recorded, machine: Mechanism) -> tuple[str, ...]:
    """The moving bodies on whose positions a number depends, in the order of the description."""
    read = [steps.steps[place] for place in steps.needed([phi.place])]
    named = {what[1] for what in read if what[0] in ("position", "turn")}
    return tuple(body.name for body in machine.bodies if body.name in named)


def _check_rates(
    steps: StepList, value: Recorded, rate: Recorded | None, driver: Element, law: Any
) -> None:
    """Refuse a formula of rates, and one of states whose rates are."""
    if _reads(steps, value, "velocity"):
        what = f"law is '{law.text}', which measures a rate"
    elif _reads(steps, rate, "velocity"):
        what = f"law is '{law.text}', which follows a state whose rate measures rates of bodies"
    else:
        return
    raise ModelError(
        f"'{driver.name}': {what}: a driver prescribes a position, and this would prescribe how "
        "positions change, which no position fulfils (a nonholonomic constraint). Follow "
        "positions, or use a Torque or a Force whose formula measures the rate",
        driver.name,
    )


def _not_smooth(driver: Element, law: Any, operation: str) -> ModelError:
    """Why a driver cannot follow a formula that is not smooth."""
    if operation in ("sign", "step"):
        what, remedy = f"jumps at '{operation}'", "use smooth functions such as sin or atan"
    else:
        what = f"calls a {operation}, which has no second derivative"
        remedy = "call Tables of one variable, or write a formula"
    return ModelError(
        f"'{driver.name}': law is '{law.text}', which {what}: its driver needs the rate and the "
        f"acceleration of what it follows; {remedy}",
        driver.name,
    )


def _check_jumps(driver: Element, law: Any, machine: Mechanism, inputs: frozenset[str]) -> None:
    """Refuse inputs that jump between samples."""
    setting = {name: one.name for one in machine.controllers for name in one.sets}
    for one in machine.inputs:
        if one.name not in inputs:
            continue
        is_hold_table = isinstance(one.value, Table) and one.value.interpolation == "hold"
        if not is_hold_table and one.name not in setting:
            continue
        why = "has a history that holds its values"
        if one.name in setting:
            why = f"is set by the controller '{setting[one.name]}'"
        raise ModelError(
            f"'{driver.name}': law is '{law.text}', but the input '{one.name}' {why}, so that the "
            "driven position or its rate would jump, which takes an infinite effort: lead it "
            'through states, as State("speed", rate=...) and State("angle", rate="speed"), '
            "or give a smooth history",
            driver.name,
        )


# -- Coordinates of stops with their derivatives, as rows over the bodies that they measure ----
# Of a coordinate g(q, t) the row is Φ = g, with Φ_q = g_q, ν = −∂g/∂t and γ = −d²g/dt² at a = 0.


def recorded_stop(stop: Stop, machine: Mechanism, at: Numbers) -> DriverFormula:
    """The coordinate of a stop, recorded."""
    from mbody.system.formula_steps import (
        Differentiated,
        NotSmooth,
        Recorded,
        along_motion,
        by_coordinate,
        by_time,
        record_formula,
    )

    signal = at.law(stop, "gap")
    steps = record_formula(signal.law, signal.parameters, machine, at)  # type: ignore[arg-type]
    gap = Recorded(steps, steps.value)
    read = {steps.steps[place] for place in steps.needed([gap.place])}
    named = {str(what[1]) for what in read if what[0] in ("position", "turn")}
    bodies = tuple(body.name for body in machine.bodies if body.name in named)

    def none(state: str) -> Recorded:
        raise AssertionError(stop.name, state)  # refused when it was described

    def zero_or(one: Recorded | None, factor: float) -> int:
        if one is None:
            return steps.number(0.0).place
        return (steps.number(factor) * one).place

    along, still = Differentiated(steps, along_motion(none)), Differentiated(steps, by_time(none))
    try:
        rate = still.of(gap)
        second = along.of(along.of(gap))
        gradient = {
            (body, axis): zero_or(Differentiated(steps, by_coordinate(body, axis)).of(gap), 1.0)
            for body in bodies
            for axis in range(3)
        }
    except NotSmooth as error:
        raise ModelError(
            f"stop '{stop.name}': '{stop.of}' has no second derivative by its {error}: use smooth "
            "functions, or Tables of one variable",
            stop.name,
        ) from None
    return DriverFormula(
        steps,
        gap.place,
        zero_or(rate, -1.0),
        zero_or(second, -1.0),
        measured_bodies=bodies,
        phi=gap.place,
        gradient=gradient,
        explicit=rate is not None,
    )


# -- Formula of a driver as a law of time, by NumPy --------------------------------------------


@dataclass(frozen=True, eq=False, repr=False)
class ComposedLaw(Law):
    """The formula of a driver with the laws of its inputs: a function of time."""

    kind: ClassVar[str] = "measured"

    text: str
    formula: DriverFormula
    inputs: Mapping[str, Law]

    def __repr__(self) -> str:
        return repr(self.text)

    def numbers(self) -> dict[str, float]:
        """None: they belong to the formula."""
        return {}

    def raw(self, xs: FloatArray) -> FloatArray:
        """f, f′, f″, (N, 3), at times (N,)."""
        from mbody.system.formula_steps import SIGNALS, step_values

        formula = self.formula
        signals = {name: law.raw(xs) for name, law in self.inputs.items()}

        def read(kind: str, *arguments: str) -> FloatArray:
            if kind == "time":
                return xs
            column: FloatArray = signals[arguments[0]][:, SIGNALS.index(kind)]
            return column

        goals = (formula.value, formula.rate, formula.acceleration)
        return np.stack(step_values(formula.steps, goals, read, xs.shape), axis=1)


def driven_law(driver: Element, mechanism: Mechanism, at: Numbers) -> Law:
    """The law of a driver that follows a formula of time and inputs."""
    signal = at.law(driver, "law")
    formula = recorded_driver(driver, signal, mechanism, at)
    text = getattr(signal.law, "text", "")
    if formula.measured_bodies or formula.states:
        what = "positions" if formula.measured_bodies else "auxiliary states"
        raise ModelError(
            f"'{driver.name}' follows {what}, '{text}', which time alone does not give: give "
            "times, or values of the drivers that follow time",
            driver.name,
        )
    inputs = {}
    for one in mechanism.inputs:
        if one.name in formula.signals:
            own = one.value.numbers()
            name = f"{one.name}.value"
            plain = set(own) == {"value"}
            inputs[one.name] = one.value.with_numbers(
                {key: at[name if plain else f"{name}.{key}"] for key in own}
            )
    return ComposedLaw(text, formula, inputs)


CODES = {name: n for n, name in enumerate(OPERATIONS)}
#: Curves and their derivatives, in the order of the codes.
LAWS = ("law", "law rate", "law acceleration")


@dataclass(frozen=True)
class RecordedLaw:
    """A law with its parameters, and the steps of one that is a formula of measured quantities."""

    signal: Signal
    steps: StepList | None = None
    #: Whether its rate and its second derivative count: of rows, not of forces.
    derivatives: bool = False
    #: What a driver follows, if that is a formula of measured quantities.
    driven: DriverFormula | None = None

    @property
    def law(self) -> Law:
        """The law."""
        return self.signal.law

    @property
    def laws(self) -> list[Signal]:
        """The laws that its steps evaluate."""
        steps = self.steps if self.driven is None else self.driven.steps
        return [] if steps is None else steps.laws

    @property
    def parameters(self) -> list[Any]:
        """Its parameters, each a float or an array over a batch."""
        steps = self.steps if self.driven is None else self.driven.steps
        return self.signal.parameters if steps is None else steps.numbers

    @property
    def of_solution(self) -> bool:
        """Whether it measures accelerations or reactions."""
        return self.steps is not None and _measures_solution(self.steps, self.steps.value)

    @property
    def timed(self) -> bool:
        """Whether it is a law of time, which the kernels evaluate as a function of one number."""
        return self.steps is None and self.driven is None


def _measures_solution(steps: StepList, *places: int) -> bool:
    """Whether some numbers measure accelerations or reactions."""
    from mbody.system.formula_steps import OF_SOLUTION

    return any(steps.steps[place][0] in OF_SOLUTION for place in steps.needed(places))


def check_loop(owner: str, law: RecordedLaw) -> None:
    """Refuse an algebraic loop that is not linear: a load whose formula is no straight function of
    the accelerations and reactions that it measures.
    """
    from mbody.system.formula_steps import OF_SOLUTION

    steps: Any = law.steps
    follows: set[int] = set()
    for place in steps.needed([steps.value]):
        kind, *_ = steps.steps[place]
        of = [one in follows for one in steps.operands(place)]
        if kind in OF_SOLUTION:
            follows.add(place)
        elif any(of):
            follows.add(place)
            straight = kind in ("+", "-", "negative") or (kind == "*" and not all(of))
            if not (straight or (kind == "/" and not of[1])):
                raise ModelError(
                    f"'{owner}' follows accelerations or forces that follow from it in turn, by "
                    f"'{kind}' in '{law.signal.law.text}': an algebraic loop is solved where it "
                    "is linear, as in fx, fy, ax and alpha. " + LEAD_THROUGH,
                    owner,
                )


#: The remedy of what an algebraic loop cannot be.
LEAD_THROUGH = (
    'Lead what it measures through a State, as State("felt", rate="(pin.fx - felt)/0.01 s", '
    'start="0 N"), and name that'
)


def recorded(
    signal: Signal, machine: Mechanism, at: Numbers, argument: Element | None = None
) -> RecordedLaw:
    """A law of a load or a state; `argument`: the load whose own law it is."""
    if not isinstance(signal.law, MeasuredFormula):
        return RecordedLaw(signal)
    from mbody.system.formula_steps import record_formula

    return RecordedLaw(signal, record_formula(signal.law, signal.parameters, machine, at, argument))


def driver_law(signal: Signal, driver: Element, machine: Mechanism, at: Numbers) -> RecordedLaw:
    """Law that a driver follows, or the coordinate of a stop."""
    if not isinstance(signal.law, MeasuredFormula):
        return RecordedLaw(signal, derivatives=True)
    from mbody.model.stop import Stop

    if isinstance(driver, Stop):
        return RecordedLaw(signal, driven=recorded_stop(driver, machine, at))
    return RecordedLaw(signal, driven=recorded_driver(driver, signal, machine, at))


def following(mechanism: Mechanism, at: Numbers) -> dict[str, tuple[str, ...]]:
    """Stops, and drivers that follow positions, with the moving bodies of their rows."""
    found = {one.name: recorded_stop(one, mechanism, at).measured_bodies for one in mechanism.stops}
    for driver in mechanism.drivers:
        driven = driver_law(at.law(driver, "law"), driver, mechanism, at).driven
        if driven is not None and driven.measured_bodies:
            found[driver.name] = driven.measured_bodies
    return found


class FormulaRows:
    """The table of `mbody.kernels.constraints`, filled formula by formula; what two of them
    read or compute alike is there once.
    """

    def __init__(
        self,
        bodies: Mapping[str, int],
        inputs: Mapping[str, int],
        states: Sequence[str],
        primitives: Mapping[str, Sequence[int]],
    ) -> None:
        self.bodies, self.inputs, self.states = bodies, inputs, list(states)
        self.primitives = primitives
        self.rows: list[tuple[int, int, int, int]] = []
        self.count = 0
        self._known: dict[tuple[int, int, int], int] = {}

    def add(
        self,
        law: RecordedLaw,
        first: int,
        *,
        laws: int = 0,
        signal: int | None = None,
        rate: int | None = None,
    ) -> None:
        """Append a formula whose parameters begin at row `first`, and where its value goes; of any
        other law nothing. laws: number of the first of the laws that it evaluates.
        """
        steps = law.steps
        if steps is None:
            return
        if signal is not None:
            self._recorded(steps, first, laws, [(constraints.TO_SIGNAL, steps.value, signal)])
        if rate is not None:
            self._recorded(steps, first, laws, [(constraints.TO_RATE, steps.value, rate)])

    def add_signal(self, law: RecordedLaw, first: int, laws: int, signal: int) -> None:
        """Append what a driver follows of time, inputs and auxiliary states: its value, rate and
        acceleration.
        """
        if law.driven is None or law.driven.measured_bodies:
            return
        driven = law.driven
        numbers = (driven.value, driven.rate, driven.acceleration)
        goals = [(constraints.TO_SIGNAL, number, signal + n) for n, number in enumerate(numbers)]
        self._recorded(driven.steps, first, laws, goals)
        self._known.clear()  # inputs may be set before the loads are evaluated

    def add_rows(
        self,
        driven: DriverFormula,
        first: int,
        laws: int,
        signal: int,
        row: int,
        blocks: Mapping[str, int],
    ) -> tuple[int, int, int]:
        """Append the row of a driver that follows positions; where its steps begin, where those of
        γ do, and where they end. row: that of Φ; blocks: where those of its bodies begin.
        """
        begin = len(self.rows)
        goals = [
            (constraints.TO_SIGNAL, driven.value, signal),
            (constraints.TO_SIGNAL, driven.rate, signal + 1),
        ]
        goals += [(constraints.TO_PHI, driven.phi, row), (constraints.TO_NU, driven.rate, row)]
        goals += [
            (constraints.TO_BLOCK, number, blocks[body] + axis)
            for (body, axis), number in driven.gradient.items()
        ]
        self._recorded(driven.steps, first, laws, goals)
        self._known.clear()
        middle = len(self.rows)
        self._recorded(
            driven.steps, first, laws, [(constraints.TO_GAMMA, driven.acceleration, row)]
        )
        self._known.clear()
        return begin, middle, len(self.rows)

    def _recorded(
        self, steps: StepList, first: int, laws: int, goals: Sequence[tuple[int, int, int]]
    ) -> None:
        """Append the steps that some numbers need, then where these go: (code, place, row)."""
        needed = steps.needed([number for _, number, _ in goals])
        places: dict[int, int] = {}
        for place in needed:
            what = steps.steps[place]
            if what[0] == "reaction":
                places[place] = self._reaction(what[1], what[2])
                continue
            if what[0].startswith("law"):
                code, a, b = self._law(what, laws, places)
            else:
                code, a, b = self._read(what, int(first)) or self._operation(what, places)
            places[place] = self._row_of(code, a, b)
        for code, number, row in goals:
            self.rows.append((code, places[number], 0, row))

    def _reaction(self, name: str, part: int) -> int:
        """Place of a part of the reaction of a joint, the sum of those of its primitives; of a
        driver of the multiplier of its own.
        """
        first, *more = [PER_PRIMITIVE * e + part for e in self.primitives[name]]
        found = self._row_of(constraints.REACTION, first, 0)
        for row in more if part > 1 else ():
            other = self._row_of(constraints.REACTION, row, 0)
            found = self._row_of(CODES["+"], found, other)
        return found

    def table(self) -> np.ndarray:
        """(steps, 4)."""
        return np.array(self.rows, dtype=np.int64).reshape(-1, 4)

    def _row_of(self, code: int, a: int, b: int) -> int:
        """Place of a number, recorded if it was not yet."""
        if (code, a, b) not in self._known:
            self._known[code, a, b] = self.count
            self.rows.append((code, a, b, self.count))
            self.count += 1
        return self._known[code, a, b]

    def _read(self, what: tuple[Any, ...], first: int) -> tuple[int, int, int] | None:
        """Code and row of a number of the instant; None of an operation."""
        from mbody.system.formula_steps import SIGNALS

        kind, *arguments = what
        if kind == "position":
            return constraints.POSITION, 3 * self.bodies[arguments[0]] + arguments[1], 0
        if kind == "velocity":
            return constraints.VELOCITY, 3 * self.bodies[arguments[0]] + arguments[1], 0
        if kind == "acceleration":
            return constraints.ACCELERATION, 3 * self.bodies[arguments[0]] + arguments[1], 0
        if kind == "turn":
            return constraints.TURN, 2 * self.bodies[arguments[0]] + arguments[1], 0
        if kind == "time":
            return constraints.TIME, 0, 0
        if kind == "parameter":
            return constraints.PARAMETER, first + arguments[0], 0
        if kind in SIGNALS:
            return constraints.SIGNAL, self.inputs[arguments[0]] + SIGNALS.index(kind), 0
        if kind == "own":
            return constraints.OWN, self.states.index(arguments[0]), 0
        return None

    def _law(
        self, what: tuple[Any, ...], laws: int, places: Mapping[int, int]
    ) -> tuple[int, int, int]:
        """A law at a number, or a derivative of it, or a table of two variables at two."""
        kind, n, *operands = what
        inputs = [places[one] for one in operands]
        if len(inputs) == 1:
            return constraints.LAW + LAWS.index(kind), inputs[0], laws + n
        return constraints.SURFACE + laws + n, inputs[0], inputs[1]

    def _operation(self, what: tuple[Any, ...], places: Mapping[int, int]) -> tuple[int, int, int]:
        """An operation on numbers whose places are known; one of one number takes it twice."""
        name, *operands = what
        inputs = [places[one] for one in operands]
        return CODES[name], inputs[0], inputs[-1]
