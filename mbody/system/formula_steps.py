"""Formulas of measured quantities as steps for the kernels (`mbody.kernels.measured_formulas`).

A `StepList` records what is computed, each number once. Its steps name bodies, inputs and own
states; the assembler puts rows in the place of names. Numbers of the description that a formula
takes (its constants, body-fixed positions of points) become parameters.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np
from numpy.lib.mixins import NDArrayOperatorsMixin

from mbody.core.slopes import before, change
from mbody.errors import ModelError
from mbody.laws import Constant, Law, MeasuredFormula, Table
from mbody.laws.kernels import OPERATIONS, FloatArray, evaluate
from mbody.model.body import ORIGIN
from mbody.model.driver import AngleDriver, DistanceDriver
from mbody.model.element import AuxiliaryState, Element, Marker, Numbers, equation, signal_of
from mbody.model.mechanism import Mechanism
from mbody.model.primitives import FrictionPrimitive, Signal
from mbody.quantities.evaluate import BY_FUNCTION, by_numpy, numpy_function, postfix_value

if TYPE_CHECKING:
    from mbody.model.stop import Stop

CODES = {name: n for n, name in enumerate(OPERATIONS)}
#: What steps read of the rotation and of the place of a body, by key, and of a reaction.
TURNING = {"angle": "position", "omega": "velocity", "alpha": "acceleration"}
TRAVELLING = {"v": "velocity", "a": "acceleration"}
REACTIONS = {"fx": 2, "fy": 3, "torque": 4}
#: What is known when the equations of motion are solved.
OF_SOLUTION = ("acceleration", "reaction")


class Recorded(NDArrayOperatorsMixin):
    """A number of a list of steps; operators and NumPy's functions record further ones."""

    __slots__ = ("place", "steps")

    def __init__(self, steps: StepList, place: int) -> None:
        self.steps, self.place = steps, place

    def __array_ufunc__(self, ufunc: Any, method: str, *inputs: Any) -> Recorded:
        given = (one if isinstance(one, Recorded) else self.steps.number(one) for one in inputs)
        return self.steps.operation(BY_FUNCTION[ufunc.__name__], *given)


class StepList:
    """The steps of some formulas.

    `steps`: What each place is: ("position", body, axis), ("velocity", body, axis), ("turn", body,
      0 or 1), ("time",), ("parameter", n), ("signal", name of an input), ("own", name of a state),
      ("acceleration", body, axis), ("reaction", joint or driver, row of `keep_primitive`),
      or ("law", n, places of its arguments), or an operation with the places that it takes; as
      derivatives ("signal rate", input), ("signal acceleration", input), ("law rate", n, place) and
      ("law acceleration", n, place).
    `numbers`: The parameters, each a float or an array over a batch.
    `laws`: The laws that steps evaluate.
    `value`: The place of the value.
    """

    def __init__(self) -> None:
        self.value = -1
        self.steps: list[tuple[Any, ...]] = []
        self.numbers: list[Any] = []
        self.laws: list[Signal] = []
        self._known: dict[tuple[Any, ...], int] = {}
        #: Named quantities that are computed already.
        self.quantities: dict[str, Recorded] = {}

    def read(self, *what: Any) -> Recorded:
        """A number of the instant."""
        if what not in self._known:
            self._known[what] = len(self.steps)
            self.steps.append(what)
        return Recorded(self, self._known[what])

    def number(self, value: Any) -> Recorded:
        """A number of the description: the next parameter."""
        self.numbers.append(value)
        return self.read("parameter", len(self.numbers) - 1)

    def law(self, signal: Signal, *arguments: Recorded) -> Recorded:
        """Value of a law at a number, or at two."""
        self.laws.append(signal)
        return self.read("law", len(self.laws) - 1, *(one.place for one in arguments))

    def needed(self, goals: Iterable[int]) -> list[int]:
        """The places that some numbers are computed of, their own too, in order."""
        found: set[int] = set()
        open_places = list(goals)
        while open_places:
            place = open_places.pop()
            if place not in found:
                found.add(place)
                open_places += self.operands(place)
        return sorted(found)

    def operands(self, place: int) -> list[int]:
        """The places that a step takes."""
        kind, *arguments = self.steps[place]
        if kind.startswith("law"):
            return [int(one) for one in arguments[1:]]
        return [int(one) for one in arguments] if kind in CODES else []

    def operation(self, name: str, *operands: Recorded) -> Recorded:
        """Value of an operation."""
        return self.read(name, *(one.place for one in operands))


def record_formula(
    law: MeasuredFormula,
    constants: list[Any],
    machine: Mechanism,
    at: Numbers,
    argument: Element | None = None,
) -> StepList:
    """The steps of one formula.

    constants: its numbers as they are now, in their order; `argument`: the load whose own law it
    is, by which "x" is known.
    """
    steps = StepList()
    steps.value = _evaluated(steps, law, constants, machine, at, argument).place
    return steps


def _evaluated(
    steps: StepList,
    law: MeasuredFormula,
    constants: list[Any],
    machine: Mechanism,
    at: Numbers,
    argument: Element | None = None,
) -> Recorded:
    """The value of a formula."""

    def applied(name: str, *operands: Recorded) -> Recorded:
        curve = machine.curves.get(name)
        if curve is None:
            return steps.operation(name, *operands)
        return steps.law(Signal(curve.law, curve.parameters), *operands)

    variables = (_quantity(steps, name, machine, at, argument) for name in law.variables)
    numbers = map(steps.number, constants)
    found: Recorded = postfix_value(law.operations, numbers, variables, applied, machine.curves)
    return found


def _quantity(
    steps: StepList, name: str, machine: Mechanism, at: Numbers, argument: Element | None
) -> Recorded:
    """A variable of a formula, by its name."""
    if name == "t":
        return steps.read("time")
    if name == "x":
        assert argument is not None, "checked when the formula was compiled"
        return own_argument(steps, argument, at)
    if any(name == one.name for one in machine.inputs):
        return steps.read("signal", name)
    if any(name == one.name for one in machine.states):
        return steps.read("own", name)
    if "." not in name:
        from mbody.model.states import quantities_named

        for one in quantities_named(machine, (name,)):
            if one.name not in steps.quantities:
                own = at.law(one, "formula")
                steps.quantities[one.name] = _evaluated(
                    steps, one.formula, own.parameters, machine, at
                )
        return steps.quantities[name]
    owner, _, key = name.rpartition(".")
    element, _, point = owner.partition(".")
    owned: Any = machine[element]
    if owned.role == "body":
        return _of_body(steps, element, point, key, at)
    if owned.role == "load" and key in owned.__dataclass_fields__:
        return _number_or_law(steps, owned, key, machine, at)
    if owned.role == "load" and key in owned.outputs():
        whole = equation(owned.outputs()[key][0], element)
        return _evaluated(steps, whole, list(whole.constants), machine, at)
    rate = key in ("rate", "vx", "vy")
    if key in ("effort", "power"):
        effort = steps.number(-1.0) * steps.read("reaction", element, 0)
        return effort * driven_coordinate(steps, owned, at, True) if key == "power" else effort
    if key in REACTIONS and owned.role == "joint":
        return steps.read("reaction", element, REACTIONS[key])
    if key == "force" and owned.role == "joint":
        parts = (steps.read("reaction", element, REACTIONS[part]) for part in ("fx", "fy"))
        return steps.operation("hypot", *parts)
    if owned.role == "driver":
        return driven_coordinate(steps, owned, at, rate)
    if owned.role == "load" and owned.on_line:
        return _across_line(steps, owned, at, key)
    if owned.role == "load":
        if key == "angle" or owned.by_angle:
            return _relative_angle(steps, owned.by, owned.body, rate)
        return _stretched(steps, owned, at, rate)
    if "angle" in owned.coordinates:
        i, j = owned.bodies
        found = _relative_angle(steps, i, j, rate)
        if rate:
            return found
        return found + steps.number(at.angle(owned, "j") - at.angle(owned, "i"))
    return _travelled(steps, owned, at, rate)


def driven_coordinate(steps: StepList, driver: Any, at: Numbers, rate: bool = False) -> Recorded:
    """The coordinate of a driver, or its rate."""
    if isinstance(driver, AngleDriver):
        i, j = driver.bodies
        return _relative_angle(steps, i, j, rate)
    if isinstance(driver, DistanceDriver):
        return _stretched(steps, driver, at, rate)
    return _travelled(steps, driver, at, rate)


def state_rate(steps: StepList, name: str, machine: Mechanism, at: Numbers) -> Recorded:
    """The rate of an auxiliary state."""
    one = next(state for state in machine.states if state.name == name)
    signal = signal_of(one.rate) if isinstance(one, AuxiliaryState) else at.law(one, "rate")
    if isinstance(signal.law, MeasuredFormula):
        return _evaluated(steps, signal.law, signal.parameters, machine, at)
    return steps.law(signal, steps.read("time"))


def _number_or_law(
    steps: StepList, load: Any, field: str, machine: Mechanism, at: Numbers
) -> Recorded:
    """A number of a load, or the value of a law that it has."""
    law = getattr(load, field)
    if not isinstance(law, Law) or isinstance(law, Constant):
        return steps.number(at[f"{load.name}.{field}"])
    signal = at.law(load, field)
    if isinstance(law, MeasuredFormula):
        return _evaluated(steps, law, signal.parameters, machine, at)
    return steps.law(signal, steps.read("time"))


def _of_body(steps: StepList, body: str, point: str, key: str, at: Numbers) -> Recorded:
    """Motion of a mass centre, or of a point of a body."""
    if key in TURNING:
        return steps.read(TURNING[key], body, 2)
    axis, kind = 0 if key.endswith("x") else 1, TRAVELLING.get(key[0], "position")
    if not point:
        return steps.read(kind, body, axis)
    marker = f"{body}.{point}"
    cx, cy = at.point(f"{body}.cg")
    at_origin = point == ORIGIN and not at.has_point(marker)
    x, y = (0.0, 0.0) if at_origin else at.point(marker)
    position = x - cx, y - cy
    if kind == "acceleration":
        return _accelerated(steps, body, position)[axis]
    place, velocity = _moving(steps, body, position)
    return velocity[axis] if kind == "velocity" else place[axis]


def _accelerated(
    steps: StepList, body: str, position: tuple[Any, Any]
) -> tuple[Recorded, Recorded]:
    """World acceleration of what is at `position` from the mass centre of a body."""
    px, py = _directed(steps, body, position)
    ax, ay, alpha = (steps.read("acceleration", body, axis) for axis in (0, 1, 2))
    w = steps.read("velocity", body, 2)
    return ax - alpha * py - w * w * px, ay + alpha * px - w * w * py


def _moving(
    steps: StepList, body: str, position: tuple[Any, Any]
) -> tuple[tuple[Recorded, Recorded], tuple[Recorded, Recorded]]:
    """World place and velocity of what is at `position` from the mass centre of a body."""
    px, py = _directed(steps, body, position)
    x, y = (steps.read("position", body, axis) for axis in (0, 1))
    vx, vy, w = (steps.read("velocity", body, axis) for axis in (0, 1, 2))
    return (x + px, y + py), (vx - w * py, vy + w * px)


def _directed(steps: StepList, body: str, vector: tuple[Any, Any]) -> tuple[Recorded, Recorded]:
    """A vector in link axes, in world axes."""
    a, b = (steps.number(part) for part in vector)
    c, s = steps.read("turn", body, 0), steps.read("turn", body, 1)
    return c * a - s * b, s * a + c * b


def _ends(
    steps: StepList, element: Any, at: Numbers
) -> tuple[tuple[Recorded, Recorded], tuple[Recorded, Recorded]]:
    """The vector from the place on i to that on j, and its rate, in world axes."""
    found = []
    for end in ("i", "j"):
        marker: Marker = element.place(end)
        found.append(_moving(steps, marker.body, at.arm(element, end)))
    (a, va), (b, vb) = found
    return (b[0] - a[0], b[1] - a[1]), (vb[0] - va[0], vb[1] - va[1])


def _stretched(steps: StepList, element: Any, at: Numbers, rate: bool) -> Recorded:
    """Distance of two places, or its rate."""
    (dx, dy), (vx, vy) = _ends(steps, element, at)
    length = steps.operation("hypot", dx, dy)
    return (dx * vx + dy * vy) / length if rate else length


def _across_line(steps: StepList, load: Any, at: Numbers, key: str) -> Recorded:
    """The motion of the place on j beside the line through i: its height, the rate of that, its
    speed along the line, and the rate of j.
    """
    if key == "spin":
        return _relative_angle(steps, load.i.body, load.j.body, True)
    across = 0.0 if key == "speed" else 0.5 * np.pi
    return _travelled(steps, load, at, key != "height", across)


def _travelled(
    steps: StepList, element: Any, at: Numbers, rate: bool, rotation: float = 0.0
) -> Recorded:
    """Displacement of the place on j along the x axis of the marker on i, which may have a
    `rotation` before [rad], or its rate.
    """
    (dx, dy), (vx, vy) = _ends(steps, element, at)
    angle, body = at.angle(element, "i") + rotation, element.place("i").body
    ux, uy = _directed(steps, body, (np.cos(angle), np.sin(angle)))
    if not rate:
        return ux * dx + uy * dy
    w = steps.read("velocity", body, 2)
    return ux * vx + uy * vy + w * (ux * dy - uy * dx)


def _relative_angle(steps: StepList, i: str, j: str, rate: bool) -> Recorded:
    """Angle of body j from body i, or its rate."""
    kind = "velocity" if rate else "position"
    return steps.read(kind, j, 2) - steps.read(kind, i, 2)


def own_argument(steps: StepList, load: Any, at: Numbers) -> Recorded:
    """Argument of the law of a spring or a damper: stretch or rate, angle or rate."""
    rate = not load.free
    found = (
        _relative_angle(steps, load.by, load.body, rate)
        if load.by_angle
        else _stretched(steps, load, at, rate)
    )
    return found if rate else found - steps.number(at[f"{load.name}.{load.free}"])


# -- Derivatives of recorded formulas, as further steps ----------------------------------------
# Each step is differentiated by the chain rule where it was recorded (automatic differentiation,
# forward mode); what does not depend on the variable has no derivative, None, and costs no step.

#: A derivative; None where it is zero.
Derivative: TypeAlias = "Recorded | None"
#: The derivative of a number of the instant, by the step that reads it.
Rule: TypeAlias = "Callable[[StepList, tuple[Any, ...]], Derivative]"

#: What a step reads, not computes.
READ = ("position", "velocity", "turn", "time", "parameter", "signal", "own")
#: Operations that jump; beside their jumps nothing changes.
JUMPS = ("sign", "step")
#: An input and its derivatives by time, as its law gives them.
SIGNALS = ("signal", "signal rate", "signal acceleration")


class NotSmooth(ValueError):
    """A formula has no derivative; the operation is the argument."""


class Differentiated:
    """Derivatives of the steps of a list by one variable; `ahead`: At corners those to the right,
    else of one side, the same by all variables.
    """

    def __init__(self, steps: StepList, rule: Rule, ahead: bool = False) -> None:
        self.steps, self.rule, self.ahead = steps, rule, ahead
        self._known: dict[int, Derivative] = {}

    def of(self, one: Derivative) -> Derivative:
        """The derivative of a number."""
        if one is None:
            return None
        if one.place not in self._known:
            self._known[one.place] = self._derivative(one)
        return self._known[one.place]

    def _derivative(self, one: Recorded) -> Derivative:
        steps = self.steps
        name, *operands = steps.steps[one.place]
        if name in READ or name in SIGNALS:
            return self.rule(steps, steps.steps[one.place])
        if name.startswith("law"):
            return self._of_law(name, operands)
        given = [Recorded(steps, place) for place in operands]
        rates = [self.of(each) for each in given]
        if all(rate is None for rate in rates) or name in JUMPS:
            return None
        if self.ahead and name in ("abs", "min", "max"):
            return self._ahead(name, given, rates)
        found: Derivative = change(numpy_function(name).__name__, one, given, rates)
        return found

    def _ahead(self, name: str, given: list[Recorded], rates: list[Derivative]) -> Recorded:
        """The rate of one of two numbers, of equal ones of that which is the one soon."""
        a, da = given[0], rates[0] or self.steps.number(0.0)
        b, db = (given[1], rates[1] or self.steps.number(0.0)) if given[1:] else (-a, -da)
        first, second = (before(a, b), before(b, a))[:: 1 if name == "min" else -1]
        soon = self.steps.operation("min" if name == "min" else "max", da, db)
        found: Recorded = first * da + second * db + (1.0 - first - second) * soon
        return found

    def _of_law(self, name: str, operands: list[int]) -> Derivative:
        """A curve at a number: its derivatives are steps of their own."""
        n, *places = operands
        rates = [self.of(Recorded(self.steps, place)) for place in places]
        if all(rate is None for rate in rates):
            return None
        if len(places) == 2:
            raise NotSmooth("table of two variables")
        following = {"law": "law rate", "law rate": "law acceleration"}[name]
        found: Derivative = self.steps.read(following, n, places[0]) * rates[0]
        return found


# -- variables of differentiation --------------------------------------------------------------


def _of_time(
    steps: StepList, what: tuple[Any, ...], rate_of: Callable[[str], Derivative]
) -> Derivative:
    """Time itself, inputs and auxiliary states by time; numbers of the description stay."""
    kind = what[0]
    if kind == "time":
        return steps.number(1.0)
    if kind in SIGNALS[:2]:
        return steps.read(SIGNALS[SIGNALS.index(kind) + 1], what[1])
    return rate_of(what[1]) if kind == "own" else None


def by_time(rate_of: Callable[[str], Derivative]) -> Rule:
    """∂/∂t at a position that stands still; `rate_of` an auxiliary state records its rate."""
    return lambda steps, what: _of_time(steps, what, rate_of)


def along_motion(rate_of: Callable[[str], Derivative], accelerated: bool = False) -> Rule:
    """d/dt along a motion, whose velocities stay as they are unless it is accelerated."""

    def rule(steps: StepList, what: tuple[Any, ...]) -> Derivative:
        kind, *arguments = what
        if kind == "position":
            return steps.read("velocity", *arguments)
        if kind == "turn":
            return _pair_derivative(steps, *arguments) * steps.read("velocity", arguments[0], 2)
        if kind == "velocity" and accelerated:
            return steps.read("acceleration", *arguments)
        return _of_time(steps, what, rate_of)

    return rule


def by_coordinate(body: str, axis: int) -> Rule:
    """∂/∂x, ∂/∂y or ∂/∂θ of a body."""

    def rule(steps: StepList, what: tuple[Any, ...]) -> Derivative:
        if what == ("position", body, axis):
            return steps.number(1.0)
        if axis == 2 and what[:2] == ("turn", body):
            return _pair_derivative(steps, *what[1:])
        return None

    return rule


def _pair_derivative(steps: StepList, body: str, part: int) -> Recorded:
    """The derivative of a body's cos θ (part 0) or sin θ by θ."""
    if part:
        return steps.read("turn", body, 0)
    return steps.operation("negative", steps.read("turn", body, 1))


# -- Values of recorded formulas on arrays, by NumPy -------------------------------------------

#: Which of (f, f′, f″) of a curve a step is.
LAW_ORDERS = ("law", "law rate", "law acceleration")


def recorded_values(
    steps: StepList, goals: Sequence[int], read: Callable[..., Any], curve: Callable[..., Any]
) -> list[Any]:
    """The numbers at some places of a list of steps, of any kind.

    `read`: Gives a number of the instant, `curve` one of (f, f′, f″) of a law at its arguments.
    """
    known: dict[int, Any] = {}
    for place in steps.needed(goals):
        kind, *arguments = steps.steps[place]
        operands = [known[one] for one in steps.operands(place)]
        if kind == "parameter":
            known[place] = steps.numbers[arguments[0]]
        elif kind in LAW_ORDERS:
            known[place] = curve(steps.laws[arguments[0]], LAW_ORDERS.index(kind), operands)
        elif kind in CODES:
            known[place] = by_numpy(kind, *operands)
        else:
            known[place] = read(kind, *arguments)
    return [known[goal] for goal in goals]


def step_values(
    steps: StepList, goals: Sequence[int], read: Callable[..., Any], shape: tuple[int, ...]
) -> list[FloatArray]:
    """The numbers at some places of a list of steps, each of that shape."""
    with np.errstate(all="ignore"):
        found = recorded_values(steps, goals, read, partial(_curve, shape))
    return [np.broadcast_to(np.asarray(one, dtype=float), shape) for one in found]


def _curve(shape: tuple[int, ...], signal: Signal, order: int, operands: list[Any]) -> FloatArray:
    """A curve, or a derivative of it, with the numbers that it has there."""
    law: Any = signal.law
    places = [
        np.ascontiguousarray(np.broadcast_to(one, shape), dtype=float).reshape(-1)
        for one in operands
    ]
    if len(places) == 2 or law.kind == "user":
        table = law.raw(*places)
    else:
        table = np.empty((places[0].size, 3))
        par = np.array(signal.parameters, dtype=float).reshape(-1, 1)
        evaluate(law.code, par, 0, len(par), 0, law.table(), 0, places[0], table)
    values: FloatArray = table[:, order].reshape(shape)
    return values


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
    law: Any = signal.law
    steps = record_formula(law, signal.parameters, machine, at)
    value = Recorded(steps, steps.value)

    def known(one: Recorded) -> Recorded:
        if measures_solution(steps, one.place):
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
    # of positions the gradient and the rates are of one side
    ahead = not _reads(steps, value, "position", "turn")
    along = Differentiated(steps, along_motion(rate_of), ahead)
    still = Differentiated(steps, by_time(steady_rate_of), ahead)
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
            bodies = _bodies_read(steps, phi, machine)
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


def _without_jumps(one: Recorded) -> Recorded:
    """The given number; NotSmooth where it depends on a jump."""
    for place in one.steps.needed([one.place]):
        if one.steps.steps[place][0] in JUMPS:
            raise NotSmooth(one.steps.steps[place][0])
    return one


def _reads(steps: StepList, one: Recorded | None, *kinds: str) -> bool:
    """Whether a number depends on something that is read of that kind."""
    if one is None:
        return False
    return any(steps.steps[place][0] in kinds for place in steps.needed([one.place]))


def _bodies_read(steps: StepList, phi: Recorded, machine: Mechanism) -> tuple[str, ...]:
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


# -- Algebraic loops: loads that measure what follows from them --------------------------------


def measures_solution(steps: StepList, *places: int) -> bool:
    """Whether some numbers measure accelerations or reactions."""
    return any(steps.steps[place][0] in OF_SOLUTION for place in steps.needed(places))


def _check_loop(owner: str, text: str, steps: StepList) -> None:
    """Refuse an algebraic loop that is not linear: a load whose formula is no straight function of
    the accelerations and reactions that it measures.
    """
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
                    f"'{kind}' in '{text}': an algebraic loop is solved where it "
                    "is linear, as in fx, fy, ax and alpha. " + LEAD_THROUGH,
                    owner,
                )


def check_loops(
    machine: Mechanism,
    loops: Sequence[tuple[str, Any]],
    pairs: Sequence[tuple[Element, FrictionPrimitive]],
) -> None:
    """Refuse algebraic loops that are not linear, and what is not linear beside them. loops: of
    each the name of its load and its recorded law.
    """
    for owner, law in loops:
        _check_loop(owner, law.law.text, law.steps)
    beside: list[Element] = [*machine.contacts, *machine.groups, *machine.stops]
    beside += [joint for joint in machine.joints if joint.can_separate or joint.limited]
    beside += [one for one, pair in pairs if pair.bends]
    if beside:
        owner = loops[0][0]
        raise ModelError(
            f"'{owner}' follows accelerations or forces that follow from it in turn: an algebraic "
            f"loop is solved where all is linear, and the forces of '{beside[0].name}' are not. "
            + LEAD_THROUGH,
            owner,
        )


#: The remedy of what an algebraic loop cannot be.
LEAD_THROUGH = (
    'Lead what it measures through a State, as State("felt", rate="(pin.fx - felt)/0.01 s", '
    'start="0 N"), and name that'
)
