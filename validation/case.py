"""A row of the validation table, the source that makes rows, and the cases found in this folder."""

from __future__ import annotations

import importlib
import pkgutil
from collections.abc import Callable
from dataclasses import dataclass
from decimal import Decimal
from typing import Any

import numpy as np

import validation

__all__ = ["EPS", "KEYS", "Row", "Source", "cases", "degrees", "rows_of"]

#: Relative spacing of double precision, 2.2e-16.
EPS = float(np.finfo(float).eps)

KEYS = ("case", "quantity", "ours", "reference", "error", "tolerance", "reason", "source", "passed")


@dataclass(frozen=True)
class Row:
    """One number of mbody beside the number that it must be.

    Attributes
    ----------
    case, quantity : str
        Name of the case and of what is compared.
    ours, reference : float
        [unit].
    error, tolerance : float
        [unit], or without unit where the reason begins with "relative".
    reason : str
        Why the tolerance is what it is.
    source : str
        Where the reference comes from.
    unit : str
        Of ours and reference.
    printed : str or None
        The reference as the source prints it.
    cause : str
        Where the print is wrong or truncated: why it is not what we get.
    """

    case: str
    quantity: str
    ours: float
    reference: float
    error: float
    tolerance: float
    reason: str
    source: str
    unit: str = ""
    printed: str | None = None
    cause: str = ""

    @property
    def passed(self) -> bool:
        """Whether the error is within the tolerance; never so for what is no number."""
        return bool(self.error <= self.tolerance)

    def record(self) -> dict[str, Any]:
        """The row as JSON has it: the cause, where there is one, is with the reason."""
        shown = {key: getattr(self, key) for key in KEYS}
        return shown | {"reason": "; ".join(filter(None, (self.reason, self.cause)))}


@dataclass(frozen=True)
class Source:
    """Where reference numbers of a case come from; it makes the rows."""

    case: str
    source: str

    def printed(
        self,
        quantity: str,
        ours: Any,
        text: str,
        unit: str = "",
        *,
        tolerance: float | None = None,
        reason: str = "one unit of the last digit printed",
        cause: str = "",
    ) -> Row:
        """A number as the source prints it; the tolerance is one unit of its last digit."""
        digits = Decimal(text)
        if tolerance is None:
            tolerance = 10.0 ** int(digits.as_tuple().exponent)
        return self._row(quantity, ours, float(digits), None, tolerance, reason, unit, cause, text)

    def absolute(
        self,
        quantity: str,
        ours: Any,
        reference: Any,
        tolerance: float,
        reason: str,
        unit: str = "",
        cause: str = "",
    ) -> Row:
        """|ours − reference| within a tolerance [unit]."""
        return self._row(quantity, ours, reference, None, tolerance, reason, unit, cause)

    def relative(
        self,
        quantity: str,
        ours: Any,
        reference: Any,
        tolerance: float,
        reason: str,
        unit: str = "",
        cause: str = "",
    ) -> Row:
        """|ours − reference| / |reference|; of histories, the greatest difference by the peak."""
        size = float(np.abs(reference).max())
        reason = f"relative; {reason}"
        return self._row(quantity, ours, reference, size, tolerance, reason, unit, cause)

    def _row(
        self,
        quantity: str,
        ours: Any,
        reference: Any,
        size: float | None,
        tolerance: float,
        reason: str,
        unit: str,
        cause: str,
        printed: str | None = None,
    ) -> Row:
        ours, reference = np.broadcast_arrays(np.asarray(ours, float), np.asarray(reference, float))
        apart = np.abs(ours - reference)
        error = float(apart.max()) / (1.0 if size is None else size)
        # of a history, show the place where it is worst
        at = int(np.argmax(np.where(np.isfinite(apart), apart, np.inf)))
        shown = float(ours.flat[at]), float(reference.flat[at])
        told = tolerance, reason, self.source, unit, printed, cause
        return Row(self.case, quantity, *shown, error, *told)


def cases() -> dict[str, Callable[[], list[Row]]]:
    """The rows of every case, to be called for, by the name of its folder."""
    names = sorted(m.name for m in pkgutil.iter_modules(validation.__path__) if m.ispkg)
    return {name: lambda name=name: rows_of(name) for name in names}  # type: ignore[misc]


def rows_of(case: str) -> list[Row]:
    """The rows of one case."""
    rows: list[Row] = importlib.import_module(f"validation.{case}").rows()
    return rows


def degrees(x: Any, y: Any) -> Any:
    """Direction of a vector, 0 … 360 [deg]."""
    return np.degrees(np.arctan2(y, x)) % 360.0
