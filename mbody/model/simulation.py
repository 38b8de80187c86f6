"""Settings of `simulate`: how a motion begins, how long it lasts, and how it is integrated."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple, TypeAlias

import numpy as np

from mbody.core.tolerances import RTOL_DEFAULT
from mbody.errors import ModelError, brief
from mbody.model.element import whole_number
from mbody.quantities import Formula, FormulaError, parse_unit, read
from mbody.quantities.formula import (
    Converted,
    NotANumber,
    NotFinite,
    Number,
    NumberField,
    OptionalNumberField,
    default,
    default_made,
    float_or_formula,
    required,
)

# -- Studies in a description: instants, measured quantities, questions with unknowns ----------

# -- Reductions of a measured history to one number: peak, rms, integral and others ------------

Array = np.ndarray


def in_time(t: Array) -> bool:
    """Whether time goes one way over the instants t (…, instants), of every design, and passes.

    >>> in_time(np.array([0.0, 0.1, 0.1, 0.4])), in_time(np.zeros(3)), in_time(np.zeros(1))
    (True, False, False)
    """
    step = np.diff(t)
    passes = t[..., -1] != t[..., 0]
    return bool(np.all(passes) and (np.all(step >= 0.0) or np.all(step <= 0.0)))


def mean_weights(t: Array) -> Array:
    """Weights of the instants t (…, instants) in a mean over the motion; their sum is 1.

    By the trapezoidal rule over time. Where no time passes, as over positions of a driver that has
    no rate, steps from one instant to the next count the same.

    >>> mean_weights(np.array([0.0, 1.0, 4.0]))
    array([0.125, 0.5  , 0.375])
    >>> mean_weights(np.zeros(3))
    array([0.25, 0.5 , 0.25])
    """
    count = t.shape[-1]
    if count == 1:
        return np.ones(t.shape)
    over = t if in_time(t) else np.broadcast_to(np.arange(float(count)), t.shape)
    step = np.diff(over)
    none = np.zeros((*t.shape[:-1], 1))
    weights = np.concatenate([step, none], axis=-1) + np.concatenate([none, step], axis=-1)
    return np.asarray(weights / weights.sum(axis=-1, keepdims=True))


def mean_over(a: Array, t: Array) -> Array:
    """The mean of values (…, instants) over the motion, by `mean_weights`.

    >>> float(mean_over(np.array([0.0, 1.0, 4.0]), np.array([0.0, 1.0, 4.0])))  # ∫ t dt / 4
    2.0
    """
    return np.asarray((a * mean_weights(t)).sum(axis=-1))


#: Reductions of values at the instants t, in s, the last axis, to one number. Means are those over
#: the motion, so that no result depends on where a grid of times is fine. An integral is that
#: by the trapezoidal rule of what `integrand` makes, the quantity times 1 s.
REDUCTIONS: dict[str, Callable[[Array, Array], Array]] = {
    "max": lambda a, t: a.max(axis=-1),
    "min": lambda a, t: a.min(axis=-1),
    "peak": lambda a, t: np.abs(a).max(axis=-1),
    "span": lambda a, t: a.max(axis=-1) - a.min(axis=-1),
    "rms": lambda a, t: np.sqrt(mean_over(np.square(a), t)),
    "mean": mean_over,
    "integral": lambda a, t: np.trapezoid(a, t, axis=-1),
    "first": lambda a, t: a[..., 0],
    "last": lambda a, t: a[..., -1],
}

#: Those that depend on the times of the instants.
OVER_TIME = ("rms", "mean", "integral")


class Reduced(NamedTuple):
    """A formula in two parts.

    `by`: A name in `REDUCTIONS`, or "at"; empty where there is none.
    `of`: What is reduced.
    `instant`: Of "at".
    """

    by: str
    of: str
    instant: int = 0


def reduce_history(by: str, instant: int, history: Array, t: Array) -> Array:
    """A history (…, instants) at the times t, in s, reduced; as it is where `by` is empty.

    >>> float(reduce_history("span", 0, np.array([1.0, -2.0, 4.0]), np.arange(3.0)))
    6.0
    """
    if by == "at":
        return np.asarray(history[..., instant])
    check_times(by, t)
    return np.asarray(REDUCTIONS[by](history, t)) if by else history


def check_times(by: str, t: Array) -> None:
    """Refuse an integral over instants between which no time passes."""
    if by != "integral":
        return
    if t.shape[-1] < 2 or not (t[..., -1] > t[..., 0]).all() or (np.diff(t) < 0.0).any():
        raise ModelError(
            f"integral: no time passes over the instants, {t.shape[-1]} of them: give times, as t, "
            "or a turn of a driver that has a rate; mean(…) needs none"
        )


def integrand(formula: str) -> str:
    """The history of which an integral over time is the reduction: with the dimension that the
    integral has.

    >>> integrand("motor.power")
    '(motor.power)*(1 s)'
    """
    return f"({formula})*(1 s)"


def outermost(text: str) -> Reduced:
    """The reduction of a formula, the formula in it, and the instant of "at".

    Reduced(by='peak', of='A.force', instant=0)

    >>> outermost("peak(A.force)")
    Reduced(by='peak', of='A.force', instant=0)
    >>> outermost("max(A.fx, A.fy)").by
    ''
    """
    match = re.fullmatch(r"\s*(\w+)\s*\((.*)\)\s*", text, re.DOTALL)
    if match is None or match[1] not in (*REDUCTIONS, "at"):
        return Reduced("", text.strip())
    parts, depth, part = [], 0, ""
    for letter in match[2]:
        depth += {"(": 1, ")": -1}.get(letter, 0)
        if depth < 0:  # the last bracket closes another one
            return Reduced("", text.strip())
        if letter == "," and depth == 0:
            parts.append(part)
            part = ""
        else:
            part += letter
    parts = [one.strip() for one in (*parts, part)]
    if match[1] == "at":
        if len(parts) != 2 or not re.fullmatch(r"-?\d{1,9}", parts[1]):
            raise ModelError(
                f"{brief(text)}: at takes a quantity and the number of an instant, as in "
                "at(A.force, 0)"
            )
        return Reduced("at", parts[0], int(parts[1]))
    if len(parts) != 1:  # the greater of two quantities, at every instant
        return Reduced("", text.strip())
    return Reduced(match[1], parts[0])


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
        if self.instants is not None:
            instants = whole_number("ask: instants", self.instants, 2, 1_000_000)
            object.__setattr__(self, "instants", instants)
        if self.instants is not None and not self.over:
            raise ModelError("ask: instants goes with over; at says how many they are")
        object.__setattr__(self, "turns", whole_number("ask: turns", self.turns, 1, 1000))
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
        by, inner, _ = outermost(self.of)
        if not by:
            return self
        return Measure(integrand(inner) if by == "integral" else inner, self.unit)

    @property
    def names(self) -> frozenset[str]:
        """Names in the measure's formula.

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
        """Formula to be maximized or minimized; "" without one."""
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
    """Options of an unknown: its start, or several by name."""
    if not isinstance(options, Mapping):
        return {"start": options}
    known = ("start", "low", "high", "unit")
    strange = [key for key in options if key not in known]
    if strange:
        raise ModelError(
            f"unknown '{name}' has no '{strange[0]}' (it has: {', '.join(known)})", name
        )
    return options


def measure_named(measures: Mapping[str, Measure], given: str | Measure) -> Measure:
    """A measure, one of some measures by its name, or the measure of a formula."""
    if isinstance(given, Measure):
        return given
    return (measures.get(given) if isinstance(given, str) else None) or Measure(given)


def measures_without(measures: Mapping[str, Measure], gone: set[str]) -> dict[str, Measure]:
    """Those of some measures that name none of the elements that are gone."""
    return {
        key: measure
        for key, measure in measures.items()
        if gone.isdisjoint(name.partition(".")[0] for name in measure.names)
    }


# -- Optimization tasks ------------------------------------------------------------------------


@dataclass(frozen=True)
class OptimizationTask:
    """Aims, numbers and limits of an optimization.

    The last time, of ``analysis="simulate"``.

    >>> OptimizationTask(minimize="peak(motor.effort)", by={"crank.A.x": (1, 2)}).minimize
    ('peak(motor.effort)',)
    """

    minimize: tuple[str, ...] = ()
    maximize: tuple[str, ...] = ()
    by: Mapping[str, Any] | None = None
    subject_to: tuple[str, ...] = ()
    analysis: str = "kinetostatics"
    over: str = ""
    instants: int | None = None
    turns: int | None = None
    until: Any = None
    start: Mapping[str, Any] | None = None
    starts: int | None = None
    seed: int | None = None
    points: int | None = None
    note: str = ""

    def __post_init__(self) -> None:
        for key in ("minimize", "maximize", "subject_to"):
            given = getattr(self, key)
            several = (given,) if isinstance(given, str) else tuple(given)
            for text in several:
                if not isinstance(text, str):
                    raise ModelError(f"optimization: {key} takes texts, not {brief(text)}")
            object.__setattr__(self, key, several)

    def arguments(self) -> dict[str, Any]:
        """The arguments of `mbody.optimize`."""
        found: dict[str, Any] = {
            "minimize": list(self.minimize) or None,
            "maximize": list(self.maximize) or None,
            "by": self.by,
            "subject_to": self.subject_to,
            "analysis": self.analysis,
            "start": self.start,
        }
        for key in ("starts", "seed", "points", "instants", "turns", "until"):
            if getattr(self, key) is not None:
                found[key] = getattr(self, key)
        if self.over:
            found["over"] = self.over
        return found


# -- Events along a motion: zero crossings of measured quantities ------------------------------


@dataclass(frozen=True)
class Event:
    """Zero crossing of a measured quantity, found along a motion and recorded.

    Parameters
    ----------
    of : str
        What is to be zero: a formula of histories as of `Measure`, such as ``"crank.omega"``,
        ``"A.fy"`` or ``"ball.y - 0.5 m"``, or one of the mechanism's measures by its name.
    direction : int
        1 where it rises through zero only, −1 where it falls, 0 either way.
    stop : bool
        Whether the motion ends there.
    name : str
        By default `of`.

    Notes
    -----
    Watching does not change the motion, to the last bit, as long as it does not end it. A value
    that is zero within the rounding of what it is made of has no sign: what rests there crosses
    nothing, and what leaves it on the other side crosses once.

    Examples
    --------
    >>> Event("bob.omega", direction=-1).name
    'bob.omega'
    """

    of: str
    direction: int = 0
    stop: bool = False
    name: str = ""

    def __post_init__(self) -> None:
        _named(self)
        if self.direction not in (-1, 0, 1) or isinstance(self.direction, bool):
            raise ModelError(
                f"event '{self.name}': direction is {brief(self.direction)}: give 1 (rising), -1 "
                "(falling) or 0 (both)",
                self.name,
            )
        if not isinstance(self.stop, bool):
            raise ModelError(
                f"event '{self.name}': stop must be true or false, not {brief(self.stop)}",
                self.name,
            )


def _named(event: Event) -> None:
    """Refuse texts that are none, and formulas that cannot be read."""
    for key in ("of", "name"):
        if not isinstance(getattr(event, key), str):
            raise ModelError(f"event: {key} must be text, not {brief(getattr(event, key))}")
    try:
        read(event.of, None)
    except FormulaError as error:
        raise ModelError(f"event '{event.name or event.of}': {error}") from None
    object.__setattr__(event, "name", event.name or event.of)


def as_events(given: Any) -> tuple[Event, ...]:
    """Events as a tuple, each name once."""
    found = tuple(given) if isinstance(given, Iterable) and not isinstance(given, str) else (given,)
    for one in found:
        if not isinstance(one, Event):
            raise ModelError(f"events takes a list of Event, not {brief(one)}")
    names = [one.name for one in found]
    twice = sorted({name for name in names if names.count(name) > 1})
    if twice:
        raise ModelError(f"'{twice[0]}' names two events: give each its own name")
    return found


#: Methods whose steps adapt themselves, and those whose steps are of one length.
ADAPTIVE = ("dop853", "dopri5", "radau5")
EVEN = ("generalized-alpha", "rattle", "rattle4", "moreau")
METHODS = (*ADAPTIVE, *EVEN)
#: Methods whose steps end where contacts, stops and frictional joints change their modes.
WITH_MODES = (*ADAPTIVE, "generalized-alpha")
#: Instants of a motion that are kept, unless something says how many, or how far apart.
INSTANTS = 201
#: What may be said of a body at the beginning of a motion, with its dimension; x and y are the
#: origin of the link's axes.
STATE = {
    **{"angle": "angle", "omega": "angular velocity"},
    **{"x": "length", "vx": "velocity", "y": "length", "vy": "velocity"},
}


#: By body the numbers of its beginning, by name.
Start: TypeAlias = "Converted[dict[str, dict[str, Any]], Mapping[str, Mapping[str, Number]]]"


@dataclass(frozen=True)
class SimulationSettings:
    """Settings of a motion: how it begins, and how long it lasts.

    Parameters
    ----------
    until : float or str
        The last time.
    start : mapping
        By body what is exactly so at the beginning, as ``{"crank": {"angle": "60 deg"}}``: of x, y
        (the origin of the link's axes), angle, and their rates vx, vy, omega. What is not said is
        as near to the guesses as the loops let it be, and at rest.
    rtol : float
        Error of a step, as a part of each coordinate.
    method : str
        One of `METHODS`; see `simulate`.
    step : float or str, optional
        Length of the steps of methods that have one.
    instants : int
        How many are kept.
    every : float or str, optional
        Or how far they are apart.
    events : list of Event
        What is recorded where it crosses zero.
    release : mapping
        When drivers are released, by name; until then they follow their laws.

    >>> SimulationSettings(2.0, {"bob": {"angle": 0.5}}).start
    {'bob': {'angle': 0.5}}
    """

    until: NumberField = required()
    start: Start = default_made(dict)
    rtol: float = RTOL_DEFAULT
    instants: int = INSTANTS
    events: Converted[tuple[Event, ...], Event | Iterable[Event]] = default(())
    method: str = METHODS[0]
    step: OptionalNumberField = default(None)
    release: Converted[dict[str, float], Mapping[str, Number]] = default_made(dict)
    every: OptionalNumberField = default(None)

    def __post_init__(self) -> None:
        if not isinstance(self.start, Mapping):
            raise ModelError(
                f'simulation: start must be a table such as {{"crank": {{"angle": 0.5}}}}, not '
                f"{self.start!r}"
            )
        object.__setattr__(self, "until", _entered(self.until, "until"))
        made: dict[str, dict[str, Any]] = {}
        for body, given in self.start.items():
            if not isinstance(given, Mapping) or not given:
                raise ModelError(
                    f"simulation: start.{body} must be a table of {', '.join(STATE)}, not {given!r}"
                )
            strange = [key for key in given if key not in STATE]
            if strange:
                raise ModelError(
                    f"simulation: start.{body} has no '{strange[0]}' (it has: {', '.join(STATE)})"
                )
            made[body] = {k: _entered(v, f"start.{body}.{k}") for k, v in given.items()}
        object.__setattr__(self, "start", made)
        object.__setattr__(self, "events", as_events(self.events))
        check_method(self.method)
        if self.step is not None:
            object.__setattr__(self, "step", _entered(self.step, "step"))
        if self.every is not None:
            object.__setattr__(self, "every", _entered(self.every, "every"))
            if self.instants != INSTANTS:
                raise ModelError("simulation: give instants or every, not both")
        if not isinstance(self.release, Mapping):
            raise ModelError(
                f'simulation: release must be a table such as {{"motor": 2.0}}, not '
                f"{self.release!r}"
            )
        times = {name: _entered(t, f"release.{name}") for name, t in self.release.items()}
        object.__setattr__(self, "release", times)

    def without(self, gone: set[str]) -> SimulationSettings:
        """A copy without entries for elements that are gone."""
        kept = [
            event
            for event in self.events
            if gone.isdisjoint(
                name.partition(".")[0] for name in read(event.of, None, curves=True).names
            )
        ]
        times = {name: t for name, t in self.release.items() if name not in gone}
        return replace(self, events=kept, release=times)


def check_method(method: Any) -> None:
    """Refuse a method that there is not."""
    if method not in METHODS:
        raise ModelError(f"there is no method {method!r} (there are: {', '.join(METHODS)})")


def _entered(value: Any, name: str) -> float | Formula:
    """A number of a simulation."""
    try:
        return float_or_formula(value, None)
    except FormulaError as error:
        raise ModelError(f"simulation: {name}: {error}") from None
