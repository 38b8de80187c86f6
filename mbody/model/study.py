"""What a description asks beside itself: at which instants, which quantities, which unknowns."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, TypeAlias

from mbody.errors import ModelError
from mbody.model.reductions import integrand, outermost
from mbody.quantities import Formula, FormulaError, parse_unit, read
from mbody.quantities.number import NotANumber, NotFinite, float_or_formula
from mbody.quantities.types import (
    Converted,
    Number,
    OptionalNumberField,
    default,
    default_made,
    required,
)

__all__ = [
    "Instants",
    "Measure",
    "Question",
    "Unknown",
    "Unknowns",
    "measure_named",
    "measures_without",
]

#: Values of time or of drivers by name: one or several of each.
PlacesLike: TypeAlias = "Mapping[str, Number | Sequence[Number]]"
Places: TypeAlias = "Converted[Mapping[str, tuple[float | Formula, ...]], PlacesLike]"
#: One unknown or several, by name, or by name with their start or their start, low, high and unit.
Options: TypeAlias = "Mapping[str, Number | None]"
Unknowns: TypeAlias = (
    "str | Unknown | Iterable[str | Unknown] | Mapping[str, Number | Options | None]"
)
TextsLike: TypeAlias = "str | Iterable[str]"
Texts: TypeAlias = "Converted[tuple[str, ...], TextsLike]"


@dataclass(frozen=True)
class Instants:
    """The instants that an analysis is to be made for, where nobody says otherwise.

    Parameters
    ----------
    at : mapping
        Either ``{"t": times}``, or values of drivers by the name of the driver or of the driven
        body: floats (angles in rad), text with units, or lists of them. Rates follow the law.
    over : str
        ``"turn"``: a whole turn of the one driver, at equal angles; or the name of the driver.
    instants : int, optional
        How many of the turn or turns, both ends included.
    turns : int
        How many turns `over` makes, such as 2 of a four-stroke engine.

    Raises
    ------
    ModelError
        For values that are no numbers, both `at` and `over`, or numbers of turns that are not
        whole.

    >>> Instants(over="turn", instants=73)
    Instants(at={}, over='turn', instants=73, turns=1)
    """

    at: Places = default_made(dict)
    over: str = ""
    instants: int | None = None
    turns: int = 1

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
        if (
            isinstance(self.turns, bool)
            or not isinstance(self.turns, int)
            or not 1 <= self.turns <= 1000
        ):
            raise ModelError(
                f"ask: turns must be a whole number from 1 to 1000, not {self.turns!r}"
            )
        if self.turns != 1 and not self.over:
            raise ModelError("ask: turns goes with over, which says whose they are")
        object.__setattr__(self, "at", {name: _row(name, v) for name, v in self.at.items()})


def _row(name: str, value: Any) -> tuple[float | Formula, ...]:
    """One or more values of time or a driver."""
    values = value if isinstance(value, (list, tuple)) else (value,)
    if not values:
        raise ModelError(f"ask: at.{name} is empty: give at least one value")
    try:
        return tuple(float_or_formula(part, None) for part in values)
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
        ``"motor.effort"``, ``"A.force"``, ``"rocker.angle"``. One number of all instants by
        ``peak(…)``, ``max(…)``, ``min(…)``, ``span(…)``, ``rms(…)`` and ``mean(…)`` over the
        motion (∫ x dt / T, on any grid of times), ``integral(…)`` over time, ``first(…)``,
        ``last(…)`` or ``at(…, instant)`` around the whole.
    unit : str, optional
        In which it is shown, by default that of the mechanism.

    >>> Measure("coupler.angle - rocker.angle", "deg").of
    'coupler.angle - rocker.angle'
    >>> Measure("peak(A.force)").by, Measure("peak(A.force)").history.of
    ('peak', 'A.force')
    """

    of: str
    unit: str = ""

    def __post_init__(self) -> None:
        for key in ("of", "unit"):
            if not isinstance(getattr(self, key), str):
                raise ModelError(f"measure: {key} must be text, not {getattr(self, key)!r}")
        try:
            read(outermost(self.of).of, None, curves=True)
            if self.unit:
                parse_unit(self.unit)
        except FormulaError as error:
            raise ModelError(f"measure: {error}") from None

    @property
    def by(self) -> str:
        """How its instants become one number, such as "peak"; empty where each has its own."""
        return outermost(self.of).by

    @property
    def instant(self) -> int:
        """The number of the instant, of ``at(…)``."""
        return outermost(self.of).instant

    @property
    def history(self) -> Measure:
        """The measure without its reduction; of an integral times 1 s, so that its unit fits."""
        by, of, _ = outermost(self.of)
        if not by:
            return self
        return Measure(integrand(of) if by == "integral" else of, self.unit)

    @property
    def names(self) -> frozenset[str]:
        """What its formula names.

        >>> sorted(Measure("peak(A.fx - B.fx)").names)
        ['A.fx', 'B.fx']
        """
        return frozenset(read(outermost(self.of).of, None, curves=True).names)


@dataclass(frozen=True)
class Unknown:
    """A number that is to be found.

    Parameters
    ----------
    name : str
        A changeable number by its dotted name (``"field.speed"``, ``"spring.preload"``), a load of
        one number (``"brake"`` for ``"brake.value"``), a parameter, or ``"motor.value"``,
        ``"motor.rate"``, ``"motor.acceleration"`` of a driver.
    start, low, high : float or str, optional
        Where the search begins, by default its present value, and between which bounds it stays.
    unit : str, optional
        In which it is given, by default that of the mechanism, and deg for angles.

    >>> Unknown("field.speed", low=0.0, unit="rpm").unit
    'rpm'
    """

    name: str
    start: OptionalNumberField = default(None)
    low: OptionalNumberField = default(None)
    high: OptionalNumberField = default(None)
    unit: str = ""

    def __post_init__(self) -> None:
        for key in ("name", "unit"):
            if not isinstance(getattr(self, key), str):
                raise ModelError(f"unknown: {key} must be text, not {getattr(self, key)!r}")
        if not self.name:
            raise ModelError("unknown: name is empty: name a number of the mechanism")
        for key in ("start", "low", "high"):
            value = getattr(self, key)
            if value is None:
                continue
            try:
                object.__setattr__(self, key, float_or_formula(value, None))
            except FormulaError as error:
                raise ModelError(f"unknown '{self.name}': {key}: {error}", self.name) from None
        try:
            if self.unit:
                parse_unit(self.unit)
        except FormulaError as error:
            raise ModelError(f"unknown '{self.name}': {error}", self.name) from None


@dataclass(frozen=True)
class Question:
    """Unknown numbers and the conditions that they are to meet.

    Parameters
    ----------
    unknowns : str, Unknown, or several of them
        What is to be found.
    conditions : str or several
        Equations between measured quantities: ``"motor.effort = 0"``, ``"road.fx = mu*road.fy"``.
    side_conditions : str or several
        Inequalities that hold as well: ``"road.fy >= 0"``, ``"abs(road.fx) <= mu*road.fy"``.
    greatest, least : str, optional
        A quantity that is to be as great, or as small, as the side conditions let it be. Then there
        are fewer conditions than unknowns, and side conditions bind.
    analysis : str
        "kinetostatics", or "statics" for rest.
    at : mapping
        The one instant, as of `Instants`; by default t = 0.
    note : str
        The question in words.

    >>> Question("brake", "wheel.alpha = 0").unknowns[0].name
    'brake'
    """

    unknowns: Converted[tuple[Unknown, ...], Unknowns] = required()
    conditions: Texts = default(())
    side_conditions: Texts = default(())
    greatest: str = ""
    least: str = ""
    analysis: str = "kinetostatics"
    at: Places = default_made(dict)
    note: str = ""

    def __post_init__(self) -> None:
        unknowns = [
            one if isinstance(one, Unknown) else Unknown(one) for one in _several(self.unknowns)
        ]
        names = [one.name for one in unknowns]
        if not names:
            raise ModelError("question: there is no unknown: name what is to be found")
        if len(set(names)) < len(names):
            raise ModelError(f"question: {', '.join(names)}: name each unknown once")
        object.__setattr__(self, "unknowns", tuple(unknowns))
        for key in ("conditions", "side_conditions"):
            found = tuple(_several(getattr(self, key)))
            for text in found:
                if not isinstance(text, str):
                    raise ModelError(f"question: {key} must be texts, not {text!r}")
            object.__setattr__(self, key, found)
        for key in ("greatest", "least", "analysis", "note"):
            if not isinstance(getattr(self, key), str):
                raise ModelError(f"question: {key} must be text, not {getattr(self, key)!r}")
        if self.greatest and self.least:
            raise ModelError("question: give greatest or least, not both")
        if self.analysis not in ("kinetostatics", "statics"):
            raise ModelError(
                f"question: analysis must be 'kinetostatics' or 'statics', not {self.analysis!r}"
            )
        ask = Instants(at=self.at)
        if any(len(row) > 1 for row in ask.at.values()):
            raise ModelError("question: at has several values: a question is of one instant")
        object.__setattr__(self, "at", ask.at)

    @property
    def objective(self) -> str:
        """What is to be greatest or least, empty where nothing is."""
        return self.greatest or self.least

    @property
    def names(self) -> set[str]:
        """Elements, measures and parameters that its unknowns and conditions speak of.

        >>> sorted(Question("brake", "2*motor.effort = M").names - {"2"})
        ['M', 'brake', 'motor']
        """
        texts = [one.name for one in self.unknowns]
        texts += [*self.conditions, *self.side_conditions, self.objective]
        return {word.partition(".")[0] for text in texts for word in re.findall(r"[\w.]+", text)}


def _several(value: Any) -> Iterable[Any]:
    """One thing or several, as several."""
    if isinstance(value, (str, Unknown)):
        return (value,)
    if isinstance(value, Mapping):
        return [Unknown(name, **_options(name, options)) for name, options in value.items()]
    if isinstance(value, Iterable):
        return value
    raise ModelError(f"question: {value!r} is neither text nor a list of texts")


def _options(name: str, options: Any) -> Mapping[str, Any]:
    """What is said of an unknown: its start, or several things by name."""
    if not isinstance(options, Mapping):
        return {"start": options}
    known = ("start", "low", "high", "unit")
    strange = [key for key in options if key not in known]
    if strange:
        raise ModelError(
            f"unknown '{name}' has no '{strange[0]}' (it has: {', '.join(known)})", name
        )
    return options


def measure_named(measures: Mapping[str, Measure], of: str | Measure) -> Measure:
    """A measure, one of some measures by its name, or the measure of a formula."""
    if isinstance(of, Measure):
        return of
    return (measures.get(of) if isinstance(of, str) else None) or Measure(of)


def measures_without(measures: Mapping[str, Measure], gone: set[str]) -> dict[str, Measure]:
    """Those of some measures that name none of the elements that are gone."""
    return {
        key: measure
        for key, measure in measures.items()
        if gone.isdisjoint(name.partition(".")[0] for name in measure.names)
    }
