"""What drivers follow: formulas of time, inputs, own states and positions, with their derivatives.

A driver prescribes Φ = c − f = 0 for its coordinate c. Of time, inputs and own states alone, f has
the derivatives ḟ and f̈ by time, and nothing else changes. Where f measures positions, Φ is a
constraint of all their bodies:

    Φ_q = c_q − f_q,    ν = −Φ_t = ∂f/∂t,    γ = −d²Φ/dt² at a = 0,

so that Φ_q v = ν and Φ_q a = γ; its multiplier acts on every body that f measures, and its power is
that of ν alone. An own state of f changes at its rate, which may measure positions, not rates.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from mbody.errors import ModelError
from mbody.laws import MeasuredFormula, Table
from mbody.model.element import Element, Numbers
from mbody.model.mechanism import Mechanism
from mbody.model.primitives import Signal
from mbody.system.formula_derivatives import (
    JUMPS,
    Differentiated,
    NotSmooth,
    along_motion,
    by_coordinate,
    by_time,
)
from mbody.system.formula_steps import (
    Recorded,
    StepList,
    driven_coordinate,
    record_formula,
    state_rate,
)

__all__ = ["DriverFormula", "followed_inputs", "followed_states", "recorded_driver"]


@dataclass(frozen=True)
class DriverFormula:
    """The formula of one driver, recorded.

    Attributes
    ----------
    steps : StepList
    value, rate, acceleration : int
        The places of f and its derivatives by time; where it follows positions, of f, ν and γ.
    follows : tuple of str
        The moving bodies whose positions Φ has; none where f has no positions.
    phi : int
        The place of Φ, where f has positions.
    gradient : dict
        The places of Φ_q by body and axis, zero ones too.
    inputs : frozenset of str
        Inputs on which f or its rate depends: they must not jump.
    states : frozenset of str
        Own states on which it depends.
    explicit : bool
        Whether f changes while all bodies rest.
    """

    steps: StepList
    value: int
    rate: int
    acceleration: int
    follows: tuple[str, ...] = ()
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
    """Record the formula that a driver follows.

    Raises
    ------
    ModelError
        For a formula that measures rates, jumps, or has a corner without a second derivative, and
        for inputs that jump.
    """
    law: Any = signal.law
    steps = record_formula(law, signal.parameters, machine, at)
    value = Recorded(steps, steps.value)

    def rate_of(state: str) -> Recorded:
        return state_rate(steps, state, machine, at)

    def steady_rate_of(state: str) -> Recorded:
        # a rate that jumps would be one of the driver
        return _without_jumps(rate_of(state))

    def zero_or(one: Recorded | None) -> Recorded:
        return steps.number(0.0) if one is None else one

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
                follows=bodies,
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


def followed_inputs(machine: Mechanism, at: Numbers) -> dict[str, str]:
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


def followed_states(driver: Element, machine: Mechanism, at: Numbers) -> tuple[str, ...]:
    """Own states that a driver follows."""
    own: Any = driver
    if not isinstance(own.law, MeasuredFormula):
        return ()
    signal = at.law(driver, "law")
    return tuple(sorted(recorded_driver(driver, signal, machine, at).states))


def _without_jumps(one: Recorded) -> Recorded:
    """The same number.

    Raises
    ------
    NotSmooth
        Where a step that it needs jumps.
    """
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
        held = isinstance(one.value, Table) and one.value.interpolation == "hold"
        if not held and one.name not in setting:
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
