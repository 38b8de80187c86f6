"""What a check found: a report where all is well, a sentence where it is not."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from types import TracebackType
from typing import NoReturn

import numpy as np

from mbody.errors import SolveError
from mbody.model.element import Element

__all__ = ["Check", "Ledger", "Report", "slope"]

Array = np.ndarray

#: Steps of the differences, as parts of the bench's size and duration. The best of them counts: a
#: corner in a law's derivatives spoils the wide ones where it lies within them.
STEPS = (1e-3, 1e-5, 1e-7)


@dataclass(frozen=True)
class Check:
    """One line of a report.

    Attributes
    ----------
    name : str
        What was checked.
    error : float
        Greatest relative error of all states; NaN where it could not be checked.
    note : str
        Why it was not checked, or what was found.
    required : bool
        Whether a greater error than the tolerance would have failed the element.

    Examples
    --------
    >>> from mbody import Revolute
    >>> from mbody.testing import check_joint
    >>> check = check_joint(Revolute("A", "crank.A", "coupler.A"))["Φ_q"]
    >>> check.error < 1e-8, check.required
    (True, True)
    """

    name: str
    error: float
    note: str = ""
    required: bool = True

    def __str__(self) -> str:
        shown = "skipped" if math.isnan(self.error) else f"{self.error:.1e}"
        return f"{self.name:<24}{shown:<9}{self.note}".rstrip()


@dataclass(frozen=True)
class Report:
    """All checks that an element has passed.

    Attributes
    ----------
    element : str
        Type and name.
    states : int
        How many random states were tried.
    tolerance : float
        Greatest relative error that was allowed.
    checks : tuple of Check
        In the order of checking; ``report["Φ_q"]`` is one of them.

    Examples
    --------
    >>> from mbody import Revolute
    >>> from mbody.testing import check_joint
    >>> report = check_joint(Revolute("A", "crank.A", "coupler.A"))
    >>> report.worst < 1e-8, "Φ_q" in [check.name for check in report.checks]
    (True, True)
    """

    element: str
    states: int
    tolerance: float
    checks: tuple[Check, ...]

    def __getitem__(self, name: str) -> Check:
        return {check.name: check for check in self.checks}[name]

    @property
    def worst(self) -> float:
        """Greatest error of what is required."""
        errors = [check.error for check in self.checks if check.required]
        return float(np.nanmax([0.0, *errors]))

    def __str__(self) -> str:
        head = f"{self.element}: {self.states} states, tolerance {self.tolerance:.0e}"
        return "\n  ".join([head, *map(str, self.checks)])


class Ledger:
    """Collects errors; the first that is too great becomes an AssertionError.

    As a context it turns what the element itself raises into one, too.

    Attributes
    ----------
    where : str
        The state that is looked at, for the sentences.
    """

    def __init__(self, element: Element, states: int, tolerance: float) -> None:
        self.element, self.states, self.tolerance = element, states, tolerance
        self.name = f"{type(element).__name__} '{element.name}'"
        self.where = ""
        self._errors: dict[str, float] = {}
        self._notes: dict[str, str] = {}
        self._recorded: dict[str, tuple[str, str]] = {}

    def __enter__(self) -> Ledger:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, _: TracebackType | None
    ) -> None:
        if isinstance(error, SolveError):
            raise AssertionError(f"{self.name}: {error}{self.where}") from error

    def fail(self, sentence: str) -> NoReturn:
        """Raise the sentence, with the element's name and the state."""
        raise AssertionError(f"{self.name}: {sentence}{self.where}")

    def require(self, name: str, errors: Array | float, sentence: str, note: str = "") -> None:
        """Record relative errors, a number or (rows,); where one is too great, the sentence is
        raised, with the number of its row for ``{row}``.
        """
        errors = np.atleast_1d(np.asarray(errors, dtype=float))
        k = int(np.argmax(np.where(np.isnan(errors), np.inf, errors)))
        error = float(errors[k])
        if not error <= self.tolerance:
            words = sentence.replace("{row}", str(k))
            self.fail(f"{name}: {words} (relative error {error:.2g})")
        self._errors[name] = max(self._errors.get(name, 0.0), error)
        self._notes.setdefault(name, note)

    def record(self, name: str, error: float, good: str, bad: str) -> None:
        """Record what is noted but not required."""
        self._errors[name] = max(self._errors.get(name, 0.0), error)
        self._notes.setdefault(name, "")
        self._recorded[name] = good, bad

    def skip(self, name: str, reason: str) -> None:
        """Record why something could not be checked."""
        self._notes.setdefault(name, reason)

    def finite(self, values: Array, name: str) -> None:
        """Every number must be finite."""
        bad = "" if np.isfinite(values).all() else f"{name} has a number that is not finite"
        if bad:
            self.fail(f"finite: {bad}; does a law reach over `times` and `length`?")
        self.require("finite", 0.0, "")

    def differ(
        self,
        name: str,
        what: str,
        found: Array,
        function: Callable[[float], Array],
        size: Array,
        unit: float,
    ) -> None:
        """Compare `found` (rows,) with the slope of the function at 0; both are `unit` times what
        the sentence shows, and errors are parts of `size` (rows,).
        """
        least = np.full(len(found), np.inf)
        best = np.zeros(len(found))
        for step in STEPS:
            expected = slope(function, step)
            error = np.abs(found - expected) / np.maximum(size, 1e-300)
            best = np.where(error < least, expected, best)
            least = np.fmin(least, error)
            if least.max() <= 1e-2 * self.tolerance:
                break
        k = int(np.argmax(least))
        sizes = f"{found[k] / unit:.6g}, but differences of Φ give {what} = {best[k] / unit:.6g}"
        self.require(name, least, f"row {{row}} has {sizes}")

    def report(self) -> Report:
        """The report of an element that passed."""
        checks = []
        for name, note in self._notes.items():
            error = self._errors.get(name, math.nan)
            if name in self._recorded:
                note = self._recorded[name][error > self.tolerance]
            checks.append(Check(name, error, note, name not in self._recorded))
        return Report(self.name, self.states, self.tolerance, tuple(checks))


def slope(function: Callable[[float], Array], step: float) -> Array:
    """df/ds at s = 0 by central differences of sixth order."""
    ahead = [function(n * step) for n in (1, 2, 3)]
    back = [function(-n * step) for n in (1, 2, 3)]
    d1, d2, d3 = (f - b for f, b in zip(ahead, back, strict=True))
    return np.asarray((45.0 * d1 - 9.0 * d2 + d3) / (60.0 * step))
