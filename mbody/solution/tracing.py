"""Recorded numbers (`mbody.core.recorded_numbers`) as programs for the compiled core."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from mbody.core import recorded_numbers
from mbody.core.recorded_numbers import FUNCTIONS, Untraceable
from mbody.kernels.number_program import NumberProgram
from mbody.laws.kernels import OPERATIONS
from mbody.model.driver import AngleDriver, CoordinateDriver, DistanceDriver
from mbody.solution.histories import place

#: What the core evaluates where it has another name than NumPy's function.
NAMES = {
    "arcsin": "asin",
    "arccos": "acos",
    "arctan": "atan",
    "absolute": "abs",
    "add": "+",
    "subtract": "-",
    "multiply": "*",
    "divide": "/",
    "power": "^",
    "arctan2": "atan2",
    "minimum": "min",
    "maximum": "max",
}
CODES = {name: OPERATIONS.index(NAMES.get(name, name)) for name in FUNCTIONS}
#: What a rule requires of a number, as `mbody.model.element.number_field` names it: the lowest
#: value, and whether it is excluded.
LOWEST = {"positive": (0.0, 1), "not negative": (0.0, 0), "": (-1e300, 1)}


@dataclass(frozen=True)
class Rule:
    """The value that an input has at first, and what is required of it: "positive",
    "not negative" or nothing.
    """

    value: float
    sign: str = ""


class Recording(recorded_numbers.NumberRecording):
    """Operations on named inputs.

    >>> recording = Recording({"a": Rule(3.0), "b": Rule(4.0)})
    >>> a, b = recording.inputs["a"], recording.inputs["b"]
    >>> program = recording.program([np.sqrt(a * a + b * b)])
    >>> len(program.operations)
    4
    """

    def __init__(self, inputs: dict[str, Rule]) -> None:
        super().__init__(inputs)
        self.rules = list(inputs.values())

    def program(self, targets: Sequence[Any]) -> NumberProgram:
        """The program from the inputs to these numbers, traced ones or constants, with all that
        they need.
        """
        wanted = [self.place_of(target) for target in targets]
        count = len(self.rules)
        kept = [place for place in self.needed(targets) if place >= count]
        constants = [place for place in kept if self.made[place][0] == "constant"]
        steps = [place for place in kept if self.made[place][0] in CODES]
        order = [*range(count), *constants, *steps]
        slot = {place: n for n, place in enumerate(order)}
        slots = np.zeros(len(order))
        slots[:count] = [rule.value for rule in self.rules]
        slots[count : count + len(constants)] = [self.made[place][1] for place in constants]
        operations = np.zeros((len(steps), 4), dtype=np.int64)
        for row, step in zip(operations, steps, strict=True):
            name, first, *second = self.made[step]
            row[:] = CODES[name], slot[first], slot[(second or [first])[0]], slot[step]
        bounds = [LOWEST[rule.sign] for rule in self.rules]
        return NumberProgram(
            slots=slots,
            lowest=np.array([low for low, _ in bounds]),
            strict=np.array([strict for _, strict in bounds], dtype=np.int64),
            operations=operations,
            targets=np.array([slot[place] for place in wanted], dtype=np.int64),
        )


def of_what_is_read(program: NumberProgram) -> tuple[NumberProgram, np.ndarray]:
    """The program without the inputs that no operation reads; the numbers of those that are."""
    inputs, slots = len(program.lowest), len(program.slots)
    read = np.unique(np.concatenate([program.operations[:, 1:3].ravel(), program.targets]))
    read = read[read < inputs]
    kept = np.concatenate([read, np.arange(inputs, slots)])
    place = np.zeros(slots, dtype=np.int64)
    place[kept] = np.arange(len(kept))
    operations = program.operations.copy()
    operations[:, 1:] = place[operations[:, 1:]]
    short = NumberProgram(
        slots=program.slots[kept],
        lowest=program.lowest[read],
        strict=program.strict[read],
        operations=operations,
        targets=place[program.targets],
    )
    return short, read


# -- Driven coordinates from the motion of the bodies, in any kind of numbers ------------------


def driven_motion(result: Any, driver: Any) -> tuple[Any, Any, Any]:
    """Value, rate and acceleration of the coordinate of a driver: an angle, a distance, or a
    displacement along an axis of body i.
    """
    if isinstance(driver, AngleDriver):
        i, j = result[driver.relative_to], result[driver.body]
        return j.angle - i.angle, j.omega - i.omega, j.alpha - i.alpha
    if not isinstance(driver, DistanceDriver | CoordinateDriver):
        raise Untraceable(f"the motion of a {type(driver).__name__}")
    (x, y), (vx, vy), (ax, ay) = _separation(result, driver)
    if isinstance(driver, DistanceDriver):
        length = np.hypot(x, y)
        rate = (x * vx + y * vy) / length
        return length, rate, (vx * vx + vy * vy + x * ax + y * ay - rate * rate) / length
    body = result[driver.i.body]
    angle = body.angle + result.system.numbers.angle(driver, "i")
    c, s, w = np.cos(angle), np.sin(angle), body.omega
    along, across = c * x + s * y, c * y - s * x
    rate = c * vx + s * vy + w * across
    rotation = body.alpha * across - w * w * along + 2.0 * w * (c * vy - s * vx)
    return along, rate, c * ax + s * ay + rotation


def _separation(result: Any, element: Any) -> list[tuple[Any, Any]]:
    """The vector from the place on i to that on j, with both derivatives, world axes."""
    (ix, iy), (jx, jy) = (_motion(result, element, side) for side in "ij")
    return [(b - a, d - c) for a, b, c, d in zip(ix, jx, iy, jy, strict=True)]


def _motion(result: Any, element: Any, side: str) -> tuple[tuple[Any, ...], tuple[Any, ...]]:
    """x and y of a place, each with both derivatives."""
    body = result[getattr(element, side).body]
    x, y = place(result, element, side)
    px, py, w, alpha = x - body.x, y - body.y, body.omega, body.alpha
    return (
        (x, body.vx - w * py, body.ax - alpha * py - w * w * px),
        (y, body.vy + w * px, body.ay + alpha * px - w * w * py),
    )
