"""What a description asks beside itself: at which instants, and which quantities to measure."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from mbody.errors import ModelError
from mbody.formulas import Formula, FormulaError, parse_unit, read
from mbody.formulas.door import NotANumber, NotFinite, entered

__all__ = ["Ask", "Measure"]


@dataclass(frozen=True)
class Ask:
    """The instants that an analysis is to be made for, where nobody says otherwise.

    Parameters
    ----------
    at : mapping
        Either ``{"t": times}``, or values of drivers by the name of the driver or of the driven
        body: floats (angles in rad), text with units, or lists of them. Rates follow the law.
    over : str
        ``"turn"``: a whole turn of the one driver, at equal angles; or the name of the driver.
    instants : int, optional
        How many of the turn, both ends included.

    Raises
    ------
    ModelError
        For values that are no numbers, or both `at` and `over`.

    >>> Ask(over="turn", instants=73)
    Ask(at={}, over='turn', instants=73)
    """

    at: Mapping[str, Any] = field(default_factory=dict)
    over: str = ""
    instants: int | None = None

    def __post_init__(self) -> None:
        if not isinstance(self.at, Mapping):
            raise ModelError(f'ask: at must be a table such as {{"t": 0.1}}, not {self.at!r}')
        if not isinstance(self.over, str):
            raise ModelError(f"ask: over must be 'turn' or the name of a driver, not {self.over!r}")
        if self.at and self.over:
            raise ModelError("ask: give at or over, not both")
        if self.instants is not None and (
            isinstance(self.instants, bool)
            or not isinstance(self.instants, int)
            or not 2 <= self.instants <= 1_000_000
        ):
            raise ModelError(
                f"ask: instants must be a whole number from 2 to 1000000, not {self.instants!r}"
            )
        if self.instants is not None and not self.over:
            raise ModelError("ask: instants goes with over; at says how many they are")
        object.__setattr__(self, "at", {name: _row(name, v) for name, v in self.at.items()})


def _row(name: str, value: Any) -> tuple[float | Formula, ...]:
    """One or more values of time or a driver."""
    values = value if isinstance(value, (list, tuple)) else (value,)
    if not values:
        raise ModelError(f"ask: at.{name} is empty: give at least one value")
    try:
        return tuple(entered(part, None) for part in values)
    except NotANumber as error:
        raise ModelError(
            f"ask: at.{name}: {error}: give a number, or text with units", name
        ) from None
    except NotFinite as error:
        raise ModelError(f"ask: at.{name} is {error}, it must be finite", name) from None
    except FormulaError as error:
        raise ModelError(f"ask: at.{name}: {error}", name) from None


@dataclass(frozen=True)
class Measure:
    """A quantity to be measured on every result: a formula of its histories.

    Parameters
    ----------
    of : str
        Histories by name with the usual arithmetic: ``"coupler.P.y - ground.O2.y"``,
        ``"motor.effort"``, ``"A.force"``, ``"rocker.angle"``.
    unit : str, optional
        In which it is shown, by default that of the mechanism.

    >>> Measure("coupler.angle - rocker.angle", "deg").of
    'coupler.angle - rocker.angle'
    """

    of: str
    unit: str = ""

    def __post_init__(self) -> None:
        for key in ("of", "unit"):
            if not isinstance(getattr(self, key), str):
                raise ModelError(f"measure: {key} must be text, not {getattr(self, key)!r}")
        try:
            read(self.of, None)
            if self.unit:
                parse_unit(self.unit)
        except FormulaError as error:
            raise ModelError(f"measure: {error}") from None
