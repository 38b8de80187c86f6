"""Measured quantities of every design, and the reductions from instants to one number."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np

from mbody.errors import ModelError, brief
from mbody.model.mechanism import Mechanism
from mbody.model.reductions import REDUCTIONS, Reduced, integrand, outermost, reduce_history
from mbody.model.study import Measure
from mbody.solution.measures import check_measure

__all__ = ["MeasuredColumn", "columns_of", "reduced"]

#: Columns that the table of a sweep always has.
TAKEN = ("design", "error")


@dataclass(frozen=True)
class MeasuredColumn:
    """One quantity of every design.

    Attributes
    ----------
    name : str
    measure : Measure
        Of the history.
    by : str
        Reduction to one number, of `REDUCTIONS` or "at"; empty where all instants are kept.
    instant : int
        Of "at".
    """

    name: str
    measure: Measure
    by: str = ""
    instant: int = 0


def reduced(column: MeasuredColumn, history: np.ndarray, t: np.ndarray) -> np.ndarray:
    """The column of a history (…, instants) at the times t, in s."""
    return reduce_history(column.by, column.instant, history, t)


#: A measured quantity, with its reduction to one number or without.
MeasureLike: TypeAlias = "str | Measure | tuple[str | Measure, str]"
#: One of them, or several, in a mapping by name.
Measures: TypeAlias = "MeasureLike | Iterable[MeasureLike] | Mapping[str, MeasureLike]"


def columns_of(
    mechanism: Mechanism, given: Measures | None, verb: str = "sweep"
) -> tuple[MeasuredColumn, ...]:
    """The requested quantities; by default the measures of the mechanism. Sentences begin with the
    verb.

    Raises
    ------
    ModelError
        For an unknown quantity.

    >>> import mbody
    >>> machine = mbody.makers.four_bar(1, 3, 2, 3.5)
    >>> [(c.name, c.by) for c in columns_of(machine, ["peak(A.force)", "rms(motor.effort)"])]
    [('peak(A.force)', 'peak'), ('rms(motor.effort)', 'rms')]
    """
    if given is None:
        given = list(mechanism.measures)
        if not given:
            raise ModelError(
                f'{verb}: name a measure, such as measure="peak(A.force)": '
                f"'{mechanism.name}' has no measures of its own"
            )
    if isinstance(given, str | Measure):
        given = [given]
    if isinstance(given, Mapping):
        found = [_column(mechanism, of, str(name), verb) for name, of in given.items()]
    elif isinstance(given, Iterable):
        found = [_column(mechanism, of, "", verb) for of in given]
    else:
        raise ModelError(f"{verb}: measure must be text, a list or a dict, not {brief(given)}")
    names = [column.name for column in found]
    if not names or len(set(names)) < len(names):
        raise ModelError(f"{verb}: measures [{', '.join(names)}]: give each once, at least one")
    if taken := next((name for name in names if name in TAKEN), ""):
        raise ModelError(
            f"{verb}: a measure cannot have the name '{taken}', which is a column of every "
            "table: choose another"
        )
    return tuple(found)


def _column(mechanism: Mechanism, of: Any, name: str, verb: str) -> MeasuredColumn:
    reduction, unit = "", ""
    if isinstance(of, tuple) and len(of) == 2 and of[1] in REDUCTIONS:
        of, reduction = of
    if isinstance(of, Measure):
        of, unit = of.of, of.unit
    if not isinstance(of, str):
        raise ModelError(
            f"{verb}: a measure is text, a Measure, or a pair of one and of "
            f"{', '.join(REDUCTIONS)}, not {brief(of)}"
        )
    by, inner, instant = (reduction, of.strip(), 0) if reduction else _outermost(of, verb)
    measure = mechanism.measures.get(inner) or Measure(inner, unit)
    if measure.by and by:
        raise ModelError(
            f"{verb}: '{inner}' is one number of all instants already, {measure.of}: leave "
            f"'{by}' out"
        )
    if measure.by:
        by, instant, measure = measure.by, measure.instant, measure.history
    elif by == "integral":
        check_measure(mechanism, Measure(measure.of))
        measure = Measure(integrand(measure.of), unit)
    check_measure(mechanism, measure)
    return MeasuredColumn(
        name or (f"{reduction}({inner})" if reduction else of.strip()), measure, by, instant
    )


def _outermost(text: str, verb: str) -> Reduced:
    """The reduction of a formula; errors begin with the verb."""
    try:
        return outermost(text)
    except ModelError as error:
        raise ModelError(f"{verb}: {error}") from None
