"""The table [fit] of a model file: which numbers `mbody fit` finds from measured histories.

It is no part of the description, which is the same with other unknowns: it is kept beside it.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

from pydantic import Field

from mbody.errors import ModelError
from mbody.files.model.fields import Strict
from mbody.files.model.optimize_table import in_radians, quantity, written_number
from mbody.files.model.write_studies import StudyWriter
from mbody.model.mechanism import Mechanism
from mbody.model.numbers import meant
from mbody.quantities import Formula
from mbody.quantities.units import NUMBER

__all__ = ["FitIn", "FitSettings", "fit_formulas", "fit_settings", "fit_table", "keep_fit"]

#: Under which it is kept with the mechanism, so that copies of that have it too.
KEPT = "fit_settings"


class FitIn(Strict):
    """Which numbers `mbody fit` finds from data, and how."""

    by: list[str] | dict[str, list[quantity]] = Field(
        description="The unknown numbers; or [low, high] by number."
    )
    offsets: list[str] = Field(
        default_factory=list, description="Columns with an unknown constant, as of an encoder."
    )
    deviations: dict[str, float] = Field(
        default_factory=dict, description="Standard deviation of the noise by column, in its unit."
    )
    analysis: str = Field("", description="By default as the model is driven.")
    confidence: float | None = Field(None, description="Of the intervals; by default 0.95.")


@dataclass(frozen=True)
class FitSettings:
    """What is found from data, where nobody says otherwise.

    Attributes
    ----------
    by : tuple of str or mapping
        The unknown numbers, or (low, high) by number.
    offsets : tuple of str
    deviations : mapping
    analysis : str or None
    confidence : float or None
        As of `mbody.fit`.
    """

    by: tuple[str, ...] | Mapping[str, Any]
    offsets: tuple[str, ...] = ()
    deviations: Mapping[str, float] = field(default_factory=dict)
    analysis: str | None = None
    confidence: float | None = None

    def arguments(self) -> dict[str, Any]:
        """The arguments of `mbody.fit` besides the data."""
        by = self.by if isinstance(self.by, Mapping) else list(self.by)
        found: dict[str, Any] = {"by": by, "offsets": list(self.offsets), "analysis": self.analysis}
        if self.deviations:
            found["deviations"] = dict(self.deviations)
        if self.confidence is not None:
            found["confidence"] = self.confidence
        return found


def keep_fit(mechanism: Mechanism, given: FitIn | None, angle: str) -> None:
    """Keep what a file says of a fit; plain angles are in the unit of the file.

    Raises
    ------
    ModelError
        For numbers that the mechanism does not have, and bounds that are no pair.
    """
    if given is None:
        return
    for number in given.by:
        meant(mechanism, number)
    by: Any = tuple(given.by)
    if isinstance(given.by, Mapping):
        for number, pair in given.by.items():
            if len(pair) != 2:
                raise ModelError(
                    f"by.{number} must be [low, high], not of {len(pair)} values", number
                )
        by = {name: in_radians(mechanism, name, pair, angle) for name, pair in given.by.items()}
    vars(mechanism)[KEPT] = FitSettings(
        by, tuple(given.offsets), given.deviations, given.analysis or None, given.confidence
    )


def fit_settings(mechanism: Mechanism) -> FitSettings | None:
    """What a file said of a fit of a mechanism; None where it said nothing."""
    return vars(mechanism).get(KEPT)


def fit_formulas(mechanism: Mechanism) -> Iterator[Formula]:
    """The texts among the bounds, each with the dimension that it has there."""
    kept = fit_settings(mechanism)
    if kept is not None and isinstance(kept.by, Mapping):
        for name, pair in kept.by.items():
            dimension = meant(mechanism, name)[1] or NUMBER
            yield from (one.of(dimension) for one in pair if isinstance(one, Formula))


def fit_table(writer: StudyWriter) -> dict[str, Any]:
    """The table as a file has it; empty where there is none."""
    kept = fit_settings(writer.mechanism)
    if kept is None:
        return {}
    by: Any = list(kept.by)
    if isinstance(kept.by, Mapping):
        by = {name: written_number(writer, name, pair) for name, pair in kept.by.items()}
    pairs = {
        "by": by,
        "offsets": list(kept.offsets),
        "deviations": dict(kept.deviations),
        "analysis": kept.analysis,
        "confidence": kept.confidence,
    }
    return {key: value for key, value in pairs.items() if value}
