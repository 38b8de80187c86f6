"""Objectives and limits of an optimization, read from text, and as rows with derivatives."""

from __future__ import annotations

import re
from dataclasses import dataclass, replace

import numpy as np

from mbody.core.dual_number import DualNumber
from mbody.core.tolerances import TINY
from mbody.derivatives.reduced_measures import integral_derivative, mean_derivative
from mbody.errors import ModelError, brief
from mbody.model.mechanism import Mechanism
from mbody.model.study import Measure, check_times, mean_over
from mbody.optimization.design_evaluation import Evaluation
from mbody.solution.measures import check_measure, checked_sides
from mbody.sweeps.job import MeasuredColumn, columns_of

_SIGN = re.compile(r"<=|>=|==|[=<>≤≥]")
#: A reduction that is kept below a bound where every instant is, and one above.
GREATEST, SMALLEST = ("max", "peak"), ("min",)


@dataclass(frozen=True)
class AimRows:
    """Numbers with derivatives.

    `values` (rows,)
    `derivatives` (rows, numbers)
    `instants` (rows,): Which instant each is of; -1 where all count.
    """

    values: np.ndarray
    derivatives: np.ndarray
    instants: np.ndarray

    def times(self, factor: float) -> AimRows:
        """All multiplied by a number."""
        return AimRows(factor * self.values, factor * self.derivatives, self.instants)

    def minus(self, other: AimRows) -> AimRows:
        """The difference, of rows or of all with the one row of the other."""
        of_self = len(self.values) >= len(other.values)
        return AimRows(
            self.values - other.values,
            self.derivatives - other.derivatives,
            self.instants if of_self else other.instants,
        )


def _rows(column: MeasuredColumn, at: Evaluation, every: bool) -> AimRows:
    """A quantity in one row, or in a row an instant (two of ± where it is a peak)."""
    value, derivative = at.history(column.measure)
    count = np.arange(len(value))
    if not column.by and (value == value[0]).all() and (derivative == derivative[0]).all():
        return AimRows(value[:1], derivative[:1], np.array([-1]))  # the same at all instants
    if every and (not column.by or column.by in (*GREATEST, *SMALLEST)):
        rows = AimRows(value, derivative, count)
        if column.by != "peak":
            return rows
        both = np.concatenate
        return AimRows(both([value, -value]), both([derivative, -derivative]), both([count, count]))
    if column.by in (*GREATEST, *SMALLEST):
        size = {"peak": np.abs(value), "max": value, "min": -value}[column.by]
        k = int(size.argmax())
        sign = -1.0 if column.by == "peak" and value[k] < 0.0 else 1.0
        return AimRows(sign * value[[k]], sign * derivative[[k]], count[[k]])
    if column.by in ("first", "last", "at"):
        k = {"first": 0, "last": -1, "at": column.instant}[column.by]
        return AimRows(value[[k]], derivative[[k]], count[[k]])
    if column.by == "rms":
        square, t = np.square(value), _times(at)
        root = float(np.sqrt(mean_over(square, t.value)))
        derivative_of_root = mean_derivative(0.5 * square, value[:, None] * derivative, t) / max(
            root, TINY
        )
        return AimRows(np.array([root]), derivative_of_root[None], np.array([-1]))
    if column.by == "span":
        high, low = int(value.argmax()), int(value.argmin())
        return AimRows(
            value[[high]] - value[low], derivative[[high]] - derivative[low], np.array([-1])
        )
    if column.by == "integral":
        t = _times(at)
        check_times(column.by, t.value)
        row = integral_derivative(value, derivative, t)
        return AimRows(np.trapezoid(value, t.value, axis=0)[None], row[None], np.array([-1]))
    if column.by == "mean":
        t = _times(at)
        row = mean_derivative(value, derivative, t)
        return AimRows(mean_over(value, t.value)[None], row[None], np.array([-1]))
    return AimRows(value, derivative, count)


def _times(at: Evaluation) -> DualNumber:
    """The instants [s], with their derivatives where they move."""
    return DualNumber(*at.history(Measure("t", "s")))


@dataclass(frozen=True)
class Aim:
    """A quantity that is to be least, or greatest."""

    text: str
    column: MeasuredColumn
    greatest: bool

    @property
    def each(self) -> bool:
        """Whether the worst of several instants decides: its rows are smooth, it is not."""
        return self.column.by in (SMALLEST if self.greatest else GREATEST)

    @property
    def squared(self) -> bool:
        """Whether it is a root of squares to be least, whose square bends as a quadratic does."""
        return self.column.by == "rms" and not self.greatest

    @property
    def sign(self) -> float:
        """By what it is multiplied to be least."""
        return -1.0 if self.greatest else 1.0

    def rows(self, at: Evaluation) -> AimRows:
        """AimRows of which the greatest is to be least."""
        return _rows(self.column, at, self.each).times(self.sign)

    def value(self, at: Evaluation) -> float:
        """The quantity itself."""
        return float(_rows(self.column, at, False).values[0])


@dataclass(frozen=True)
class Limit:
    """A constraint: left ≤ right, or left = right."""

    text: str
    left: MeasuredColumn
    right: MeasuredColumn
    equal: bool
    unit: str

    def rows(self, at: Evaluation) -> AimRows:
        """right − left: all rows are not to be negative, or are to be zero."""
        if self.equal:
            return _rows(self.right, at, False).minus(_rows(self.left, at, False))
        low = _rows(self.left, at, self.left.by in (*GREATEST, ""))
        high = _rows(self.right, at, self.right.by in (*SMALLEST, ""))
        if len(low.values) > 1 and len(high.values) > 1 and (self.left.by or self.right.by):
            low = _rows(self.left, at, False)
        return high.minus(low)

    def margin(self, at: Evaluation) -> float:
        """By how much it holds; negative where it is broken."""
        values = self.rows(at).values
        return -float(np.abs(values).max()) if self.equal else float(values.min())


def aim_of(mechanism: Mechanism, given: object, greatest: bool, instants: int) -> Aim:
    """Objective to be minimized or maximized."""
    (column,) = columns_of(mechanism, [given], "optimize")  # type: ignore[list-item]
    _check_instant(column, instants)
    if not column.by and instants > 1:
        verb = "maximize" if greatest else "minimize"
        raise ModelError(
            f"optimize: '{column.name}' is a history of {instants} instants: say what of it is to "
            f'be {"greatest" if greatest else "least"}, such as {verb}="peak({column.name})"'
        )
    return Aim(column.name, column, greatest)


def limit_of(mechanism: Mechanism, text: object, instants: int) -> Limit:
    """Constraint from text such as ``"peak(motor.effort) <= 20 N*m"``."""
    wanted = "a limit such as 'peak(motor.effort) <= 20 N*m'"
    if not isinstance(text, str):
        raise ModelError(f"optimize: subject_to takes texts, not {brief(text)}")
    signs = _SIGN.findall(text)
    if len(signs) != 1:
        raise ModelError(f"optimize: {brief(text, 100)} is not {wanted}")
    left, right = (part.strip() for part in text.split(signs[0]))
    if not left or not right:
        raise ModelError(f"optimize: {brief(text, 100)} is not {wanted}: a side of it is empty")
    if signs[0] in (">", ">=", "≥"):
        left, right = right, left
    columns = [_side(mechanism, side) for side in (left, right)]
    dimension = checked_sides(mechanism, text, *(one.measure.of for one in columns))
    equal = signs[0] in ("=", "==")
    for column in columns:
        _check_instant(column, instants)
        if equal and not column.by and instants > 1 and _moves(mechanism, column):
            raise ModelError(
                f"optimize: '{text}': '{column.name}' is a history of {instants} instants, which "
                f"cannot be equal to a number at all: name one, such as first({column.name})"
            )
    unit = mechanism.units.of(dimension)
    return Limit(text, columns[0], columns[1], equal, unit)


def _side(mechanism: Mechanism, text: str) -> MeasuredColumn:
    """A side of a limit, in the units of the mechanism."""
    (column,) = columns_of(mechanism, [text], "optimize")
    plain = Measure(column.measure.of)
    check_measure(mechanism, plain)
    return replace(column, measure=plain)


def _moves(mechanism: Mechanism, column: MeasuredColumn) -> bool:
    """Whether a quantity has more than constants in it."""
    words = set(re.findall(r"[A-Za-z_][\w.]*", column.measure.of))
    return any(word.partition(".")[0] in mechanism for word in words)


def _check_instant(column: MeasuredColumn, instants: int) -> None:
    if column.by == "at" and not -instants <= column.instant < instants:
        raise ModelError(
            f"optimize: '{column.name}': there is no such instant, they are 0 to {instants - 1}"
        )
