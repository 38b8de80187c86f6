"""The reach of a driver: how far it can go before a dead centre stops it."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from mbody.analysis.driven.dead_centres import ends
from mbody.analysis.position.assembly_analysis import as_system, check_determined, closed
from mbody.errors import ModelError, brief
from mbody.model.body import Guesses
from mbody.model.element import listed
from mbody.model.mechanism import Mechanism
from mbody.solution.doubts import Inherited
from mbody.system.system import System

__all__ = ["DriverRange", "driver_range"]


@dataclass(frozen=True)
class DriverRange(Inherited):
    """How far a driver can go; ``low, high = driver_range(…)``, and ``print`` says it in words.

    Attributes
    ----------
    driver, body : str
        Names of the driver and of the body that it moves.
    start : float
        Where the driver was [rad] or [length].
    low, high : float
        The dead centres on both sides [rad] or [length]; infinite where there is none: an angle
        can then make whole turns.
    unit : str
        Of lengths; empty for angles.
    status, doubts, notes
        As of `Inherited`; notes on the branch that the guesses say.
    """

    driver: str
    body: str
    start: float
    low: float
    high: float
    unit: str = ""

    def __iter__(self) -> Iterator[float]:
        yield self.low
        yield self.high

    @property
    def unlimited(self) -> bool:
        """Whether it meets no dead centre: an angle makes whole turns."""
        return math.isinf(self.low) and math.isinf(self.high)

    def __str__(self) -> str:
        verb = "move" if self.unit else "turn"
        if self.unlimited:
            whole = "without end" if self.unit else "all the way round"
            return f"'{self.body}' can {verb} {whole}"
        shown = [v if self.unit else math.degrees(v) for v in self]
        low, high = (f"{v:.10g} {self.unit or 'deg'}" for v in shown)
        ends = [f"from {low}"] * math.isfinite(shown[0]) + [f"to {high}"] * math.isfinite(shown[1])
        return f"'{self.body}' can {verb} {' '.join(ends)}"


def driver_range(
    model: Mechanism | System,
    driver: str | None = None,
    *,
    t: float = 0.0,
    guess: Guesses | None = None,
) -> DriverRange:
    """How far a driver can go in both senses before a dead centre: its limits, toggle positions.

    At a dead centre the driven coordinate x turns back along the curve of closed positions: with τ
    the one motion that the joints leave, Φ_q τ = 0, the rate x_q τ vanishes there.

    Parameters
    ----------
    model : Mechanism or System
        Driven so that no freedom is left.
    driver : str, optional
        Name of the driver or of the driven body; where there is one driver, that one.
    t : float
        Time at which the drivers begin; others than this one are fixed there.
    guess : mapping, optional
        By body, instead of its own guess: angle [rad], or (x, y, angle) of the link axes.

    Returns
    -------
    DriverRange
        (low, high) [rad] or [length] on the branch that the guesses say.

    Raises
    ------
    ModelError
        For a driver that there is not, or a batch of designs.
    SolveError
        When the loops do not close at the start, or the motion is not determined there.

    Notes
    -----
    An angle is followed for a turn each way, a length for 1000 times the size of the mechanism.
    Cost: a singular value decomposition of Φ_q for each of some ten steps to either end.

    Source: E. J. Haug, *Computer-Aided Kinematics and Dynamics of Mechanical Systems*, chapter 3
    (lock-up configurations).

    Examples
    --------
    A crank of 6 that a coupler of 18 and a rocker of 12 let swing only, on a ground of 8:

    >>> import math, mbody
    >>> low, high = driver_range(mbody.makers.four_bar(6, 18, 12, 8, start=math.pi / 2))
    >>> round(math.degrees(low), 9) == round(math.degrees(math.acos(2 / 3)), 9)
    True
    """
    system = as_system(model)
    if system.batch is not None:
        raise ModelError("driver_range takes one design: choose one of the batch with design(n)")
    found = _driver(system, driver)
    if isinstance(t, bool) or not isinstance(t, (int, float)) or not math.isfinite(t):
        raise ModelError(f"driver_range takes one finite time, not {brief(t)}")
    start = closed(system, float(t), {}, guess)
    check_determined(system, start, "driver_range")
    limits = ends(system, start, found)
    unit = "" if found.angular else system.mechanism.units.length
    limits_of = (limits.value, limits.low, limits.high)
    return DriverRange(found.name, found.bodies[1], *limits_of, unit, notes=tuple(start.notes))


def _driver(system: System, name: str | None) -> Any:
    """The driver of that name, or of the body of that name."""
    known = listed(d.name for d in system.leaders)
    if name is None:
        if len(system.leaders) != 1:
            raise ModelError(
                f"'{system.mechanism.name}' has {len(system.leaders)} drivers ({known}): "
                "name the one whose reach you want"
            )
        return system.leaders[0]
    for driver in system.leaders:
        if name in (driver.name, getattr(driver, "body", None)):
            return driver
    raise ModelError(f"there is no driver {brief(name)} (there are: {known})", str(name))
