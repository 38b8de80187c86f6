"""Settings of `simulate`: how a motion begins, how long it lasts, and how it is integrated."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from typing import Any, TypeAlias

from mbody.core.tolerances import RTOL_DEFAULT
from mbody.errors import ModelError, brief
from mbody.quantities import Formula, FormulaError, read
from mbody.quantities.formula import float_or_formula
from mbody.quantities.types import (
    Converted,
    Number,
    NumberField,
    OptionalNumberField,
    default,
    default_made,
    required,
)

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
