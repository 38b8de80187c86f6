"""Description of an environment, without Gymnasium: a mechanism with actions, observations and
ends.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from mbody.errors import ModelError, brief
from mbody.model.element import unknown_name, whole_number
from mbody.model.mechanism import Mechanism
from mbody.model.numbers import number_in
from mbody.model.simulation import STATE, measure_named
from mbody.quantities.formula import range_given
from mbody.quantities.units import DIMENSIONS
from mbody.solution.measures import check_measure, checked_sides
from mbody.stepping.simulators import Simulators
from mbody.system.system import System

Array = np.ndarray
_SIGN = re.compile(r"<=|>=|[<>≤≥]")
_ZERO = re.compile(r"[-+]?0*\.?0*\Z")


@dataclass(frozen=True)
class Variable:
    """A number with its bounds: an action, an observation, or what differs between beginnings.

    `text` is what is measured, or the name of what is set.
    """

    name: str
    text: str
    low: float = -math.inf
    high: float = math.inf


@dataclass(frozen=True, eq=False)
class Task:
    """Description of an environment.

    `actions`, `observations`, `ranges`: Inputs that are set; what is measured; what begins at
      random within its bounds.
    `reward`: Measures with their weights.
    `ends`: Each end as it was written, and the measure that is positive there.
    `length`: Time of one step of the environment.
    `most`: Steps after which it is truncated.
    `options`: As of `Simulators`.
    """

    system: System
    actions: tuple[Variable, ...]
    observations: tuple[Variable, ...]
    ranges: tuple[Variable, ...]
    reward: tuple[tuple[str, float], ...]
    ends: tuple[tuple[str, str], ...]
    length: float
    most: int | None
    options: dict[str, Any]


def task(
    system: System,
    actions: Mapping[str, Any],
    observations: Any,
    reward: Any,
    step: Any,
    frame_skip: Any,
    terminated: Any,
    max_steps: Any,
    reset: Any,
    options: dict[str, Any],
) -> Task:
    """The task by what `make` takes."""
    machine = system.mechanism
    length = number_in(machine, step, "time", "envs.make", "step")
    if not 0.0 < length < math.inf:
        raise ModelError(
            f"envs.make: step is {length:g} {machine.units.time}: give a positive time"
        )
    frame_skip = whole_number("envs.make: frame_skip", frame_skip)
    if max_steps is not None:
        max_steps = whole_number("envs.make: max_steps", max_steps)
    if not isinstance(actions, Mapping) or not actions:
        raise ModelError(
            'envs.make: actions must be inputs with their bounds, such as {"u": ("-5 N*m", '
            f'"5 N*m")}}, not {brief(actions)}'
        )
    texts = [terminated] if isinstance(terminated, str) else list(terminated)
    return Task(
        system,
        tuple(_action(machine, name, bounds) for name, bounds in actions.items()),
        tuple(_observations(machine, observations)),
        tuple(_range(machine, name, bounds) for name, bounds in dict(reset or {}).items()),
        _reward(machine, reward),
        tuple((text, _end(machine, text)) for text in texts),
        length * frame_skip,
        max_steps,
        options,
    )


def _action(machine: Mechanism, name: str, given: Any) -> Variable:
    own = next((one for one in machine.inputs if one.name == name), None)
    if own is None:
        more = "; declare it, such as Input('u', '0 N*m')"
        raise unknown_name("envs.make: input", name, machine.inputs, use=" to act by", more=more)
    dimension = own.dimension or DIMENSIONS["number"]
    scope = machine.parameters.scope()
    return Variable(name, name, *range_given(given, dimension, scope, "envs.make", name))


def _observations(machine: Mechanism, given: Any) -> list[Variable]:
    """Texts, by a list or by name; with bounds as (text, low, high)."""
    if isinstance(given, Mapping):
        pairs = list(given.items())
    else:
        texts = [given] if isinstance(given, str) else list(given)
        pairs = [(one if isinstance(one, str) else one[0], one) for one in texts]
    found = []
    for name, one in pairs:
        text, *bounds = (one,) if isinstance(one, str) else one
        _checked(machine, text)
        pair: Any = bounds or (-math.inf, math.inf)
        scope = machine.parameters.scope()
        ends = range_given(pair, None, scope, "envs.make", name, endless=True)
        found.append(Variable(str(name), text, *ends))
    if not found:
        raise ModelError(
            'envs.make: observations must be measures such as ["crank.angle", "crank.omega"]: give '
            "at least one"
        )
    return found


def _range(machine: Mechanism, name: str, given: Any) -> Variable:
    """A random initial value: a position, a rate, or an auxiliary state."""
    key = name.rpartition(".")[2]
    dimension = DIMENSIONS[STATE[key]] if key in STATE else None
    for state in machine.states:
        if state.name == name:
            dimension = state.dimension or DIMENSIONS["number"]
    if dimension is None:
        raise ModelError(
            f"envs.make: reset has no {brief(name)}: give ranges of places and rates such as "
            '{"crank.angle": ("-5 deg", "5 deg")}, or of auxiliary states',
            name,
        )
    scope = machine.parameters.scope()
    return Variable(name, name, *range_given(given, dimension, scope, "envs.make", name))


def _reward(machine: Mechanism, given: Any) -> tuple[tuple[str, float], ...]:
    """A measure, or measures with their weights."""
    if isinstance(given, str):
        given = {given: 1.0}
    if not isinstance(given, Mapping) or not given:
        raise ModelError(
            'envs.make: reward must be a measure such as "cos(pole.angle)", or measures with '
            f'their weights such as {{"cart.x^2": -1.0}}, not {brief(given)}'
        )
    for text in given:
        _checked(machine, text)
    return tuple((text, float(weight)) for text, weight in given.items())


def _checked(machine: Mechanism, text: Any) -> None:
    check_measure(machine, measure_named(machine.measures, text))


def _end(machine: Mechanism, text: Any) -> str:
    """The measure that is positive where a relation holds."""
    parts = _SIGN.split(text) if isinstance(text, str) else []
    if len(parts) != 2:
        raise ModelError(
            'envs.make: terminated must be relations such as "abs(pole.angle) > 24 deg", not '
            f"{brief(text)}"
        )
    left, right = (one.strip() for one in parts)
    checked_sides(machine, text, left, right)
    sign = _SIGN.search(text)
    if sign is not None and sign[0] in "<=≤":
        left, right = right, left
    if _ZERO.match(right):
        return left
    return f"-({right})" if _ZERO.match(left) else f"({left}) - ({right})"


class Episodes:
    """Episodes of a task, many side by side.

    `rewards` (n,)
    `ended`, `truncated` (n,): After the last step.
    """

    def __init__(self, task: Task, n: int) -> None:
        self.task, self.sims = task, Simulators(task.system, n, **task.options)
        self.steps = np.zeros(n, dtype=int)
        self.cameras: dict[int, Any] = {}
        self.rewards = np.zeros(n)
        self.ended, self.truncated = np.zeros((2, n), dtype=bool)

    def begin(self, which: Array, generators: Sequence[np.random.Generator]) -> None:
        """Begin anew in some, each at a state that its generator draws."""
        for k in which.tolist():
            self.cameras.pop(k, None)
        ranges = self.task.ranges
        if ranges:
            low, high = (np.array([getattr(one, key) for one in ranges]) for key in ("low", "high"))
            drawn = np.array([rng.uniform(low, high) for rng in generators])
            to = {one.name: drawn[:, k] for k, one in enumerate(ranges)}
            self.sims.reset(which, to)
        else:
            self.sims.reset(which)
        self.steps[which] = 0
        self.rewards[which] = 0.0
        self.ended[which] = self.truncated[which] = False

    def step(self, actions: Array, which: Array | None = None) -> None:
        """One step by actions (n, actions), of all or of the motions of a mask (n,)."""
        sims, going = self.sims, np.ones(self.sims.n, dtype=bool) if which is None else which
        for column, one in enumerate(self.task.actions):
            values = np.clip(np.asarray(actions[:, column], dtype=float), one.low, one.high)
            sims.inputs[one.name] = np.where(going, values, sims.inputs[one.name])
        sims.until(sims.t + np.where(going, self.task.length, 0.0))
        self.steps[going] += 1
        self.rewards[:] = 0.0
        for text, weight in self.task.reward:
            self.rewards += np.where(going, weight * sims.measure(text), 0.0)
        self.ended = ~sims.ok
        for _, text in self.task.ends:
            self.ended |= sims.measure(text) > 0.0
        self.ended &= going
        self.truncated = np.zeros(sims.n, dtype=bool)
        if self.task.most is not None:
            self.truncated = going & (self.steps >= self.task.most)

    def picture(self, k: int) -> Array:
        """The present instant of motion k as an array (height, width, 3) of bytes."""
        if k not in self.cameras:
            from mbody.views.film_frames import Camera

            self.cameras[k] = Camera()
        picture: Array = self.cameras[k].picture(self.sims.present(k))
        return picture

    def observe(self) -> Array:
        """Observations (n, observations), within their bounds."""
        found = [
            np.clip(self.sims.measure(one.text), one.low, one.high)
            for one in self.task.observations
        ]
        return np.stack(found, axis=1).astype(np.float32)

    def failures(self) -> dict[int, str]:
        """Why motions failed, by their number."""
        failed = np.flatnonzero(~self.sims.ok).tolist()
        status = self.sims.status if failed else ()
        return {k: status[k] for k in failed}
