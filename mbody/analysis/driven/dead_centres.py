"""How far a driver can go from a closed position: the dead centres on both sides.

The motion is followed until it can no further. The joints alone leave one freedom there; along it
the driven coordinate x has a turning point, x′ = 0, which is found on the curve of closed
positions. x changes with the square of the distance to that point, so it is right to
rounding.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import islice
from typing import Any

import numpy as np

from mbody.analysis.position.assembly_analysis import as_system, check_determined, closed, drivers
from mbody.analysis.position.closed_position import ClosedPosition
from mbody.analysis.position.joint_curve import PACE, JointCurve, JointPoint
from mbody.core import tolerances as tol
from mbody.core.arclength import walk
from mbody.errors import ModelError, SolveError, brief
from mbody.kernels import continuation
from mbody.model.body import Guesses
from mbody.model.element import listed, takes_one_design
from mbody.model.mechanism import Mechanism
from mbody.solution.doubts import Inherited
from mbody.system.rank import jacobian
from mbody.system.system import System

#: Distance along a length, in model lengths, after which it is said to have no end.
LONGEST_TRAVEL = 1e3
#: Places on a path at which it is examined: a prime, so that none is where branches meet, a whole
#: part of a revolution away from the start.
STATIONS = 61
#: Rows up to which the end is found by dense matrices; beyond, the path's own end is given.
LARGEST = 300
#: Where branches meet in the turning point: degree of the polynomial through places before it, and
#: how many these are.
DEGREE, PLACES = 12, 60
#: Steps to the end, and their lengths.
ITERATIONS = 30
STEPS = PACE._replace(first=tol.PATH_STEP_FIRST, longest=tol.PATH_STEP_LONGEST)


@dataclass(frozen=True)
class Ends:
    """Where a driver is, and how far it can go without leaving its branch.

    `value`, `low`, `high`: [rad] or [length]; infinite where there is no end, of an angle within a
      turn.
    """

    value: float
    low: float
    high: float


class DeadCentre(SolveError):
    """A dead centre in the way, before it is known how far the driver can go at all."""

    def __init__(self, sentence: str, remedy: str, driver: Any, solution: Any) -> None:
        super().__init__(f"{sentence}; {remedy}", driver.name, solution)
        self.parts, self.driver = (sentence, remedy), driver


def with_ends(stop: DeadCentre, system: System, start: ClosedPosition) -> SolveError:
    """The sentence of a dead centre with those on both sides of the start."""
    sentence, remedy = stop.parts
    note = _range_note(system, start, stop.driver)
    return SolveError(f"{sentence}; {note}{remedy}", stop.element, stop.solution)


def _range_note(system: System, start: ClosedPosition, driver: Any) -> str:
    """From where to where the one driver can go; empty where that has no ends."""
    found = ends(system, start, driver) if len(system.drivers) == 1 else None
    if found is None or not np.isfinite([found.low, found.high]).all():
        return ""
    body = driver.bodies[1]
    if not driver.angular:
        unit = system.mechanism.units.length
        return f"'{body}' can move from {found.low:.10g} to {found.high:.10g} {unit}; "
    low, high = np.degrees([found.low, found.high])
    # the other name of the same place, where they are on both sides of the zero
    same = f" ({high - 360.0:.10g} deg)" if 0.0 < low <= 180.0 < high < 360.0 else ""
    return f"'{body}' can turn from {low:.10g} deg to {high:.10g} deg{same}; "


def ends(system: System, start: ClosedPosition, driver: Any) -> Ends:
    """Range of one driver from a closed position, the others fixed."""
    curve = _Curve(system, start, driver)
    return Ends(curve.value, curve.end(-1.0), curve.end(1.0))


class _Curve:
    """The closed positions that a driver goes through."""

    def __init__(self, system: System, start: ClosedPosition, driver: Any) -> None:
        self.system, self.start, self.driver = system, start, driver
        self.which = [d.name for d in system.drivers].index(driver.name)
        first = system.rows - len(system.drivers)
        self.size = system.coordinate_units
        self.unit = driver.unit(system.length)
        work = system.work()
        work.time[:], work.signal[:] = start.work.time, start.work.signal
        self.curve = JointCurve(system, work, driver)
        # the signals may be those of another instant: where the drivers are, the position says
        requested = np.array([float(start.work.signal[row, 0]) for _, row in drivers(system)])
        self.values = requested + jacobian(system, start.work)[0][first:]
        self.value = float(self.values[self.which])

    def end(self, sign: float) -> float:
        """The value beyond which it cannot go, in that direction."""
        if self.driver.angular:
            spans = [2.0 * math.pi]
        else:
            spans = [
                self.system.length * 10.0**k
                for k in range(1, round(math.log10(LONGEST_TRAVEL)) + 1)
            ]
        for span in spans:
            found = self._stop(sign * span)
            if found is not None:
                return found
        return sign * math.inf

    def _stop(self, change: float) -> float | None:
        """Place at which the driver stops on its way; None where it does not."""
        stopped, places = self._path(change)
        if self.system.rows > LARGEST:
            return stopped
        if stopped is None:
            return None
        sign = math.copysign(1.0, change)
        found = self._turning_point(places, sign)
        if found is None:
            found = self._extrapolated(stopped, sign)
        return stopped if found is None else found

    def _path(self, change: float) -> tuple[float | None, np.ndarray]:
        """Follow the motion by so much: where it stopped, None where it did not, and the positions
        on the way (places, coordinates).
        """
        system, L = self.system, self.system.runtime()
        n = system.coordinates
        work = system.work()
        work.q[:n], work.time[:] = self.start.work.q[:n, :1], self.start.work.time[:, :1]
        count, steps = len(self.values), np.arange(STATIONS + 1)
        given = np.zeros((len(steps), count, 3))
        given[:, :, 0] = self.values
        given[:, self.which, 0] += change * steps / STATIONS
        s = given[:, 0, 0].copy() if count == 1 else steps.astype(float)
        chords = np.zeros((len(steps), count))
        chords[:-1, self.which] = change / STATIONS
        position_norm = float(system.extent(work.q[:, 0]))
        path = continuation.DrivenPath(
            mode=continuation.BY_DRIVER if count == 1 else continuation.BY_INSTANT,
            s=s,
            t=np.full(len(steps), float(work.time[0, 0])),
            given=given,
            chords=chords,
            with_forces=False,
            at_rest=False,
            monitored=True,
            regularization=self.start.regularization,
            position_norm=1.0 + position_norm + abs(change) / self.unit,
        )
        path_output = continuation.PathOutput(
            output=np.empty((len(steps), system.record_rows, 1)),
            progress=np.zeros(continuation.PROGRESS),
            nearest=np.zeros(3),
            passed=np.empty((0, 1 + n)),
        )
        code = continuation.follow(L, work, path, path_output)
        q = path_output.output[: int(path_output.progress[continuation.INSTANTS]), :n, 0]
        if code == continuation.DONE:
            return None, q
        if code == continuation.LOST:
            return self.value, self.start.work.q[:n].T.copy()
        at = float(path_output.progress[continuation.REACHED])
        stopped = at if count == 1 else self.value + at * change / STATIONS
        return stopped, np.vstack([q, work.past[:n, 0]])

    # -- the turning point, in model lengths and radians

    def _turning_point(self, places: np.ndarray, sign: float) -> float | None:
        """The value at the turning point behind the last places of a path; None where there is none
        or branches meet before it.
        """
        for x in places[:-3:-1] / self.size:
            start = self._begin(x, sign)
            steps = walk(start, self._regular(), STEPS, self.curve.leaps) if start else ()
            for here, there, leapt in islice(steps, ITERATIONS):
                if leapt:
                    break
                if here.rate * there.rate <= 0.0:
                    found = self.curve.dead_centre(here, there)
                    if abs(found.rate) <= 1e3 * tol.PATH_DERIVATIVE_NONE:
                        return found.value
                    break
        return None

    def _regular(
        self, least: float = tol.SINGULAR_VALUE_NEAR_SINGULAR, sign: float = 0.0
    ) -> Callable[[JointPoint | None, np.ndarray, np.ndarray | None], JointPoint | None]:
        """Closes positions where branches do not meet and the value goes on in a direction."""

        def close(
            here: JointPoint | None, x: np.ndarray, ahead: np.ndarray | None
        ) -> JointPoint | None:
            there = self.curve.close(here, x, ahead)
            if there is None or there.regularity < least or there.rate * sign < 0.0:
                return None
            return there

        return close

    def _begin(self, x: np.ndarray, sign: float) -> JointPoint | None:
        """A point of the curve near x, the driver's value going in a direction from there."""
        found = self._regular()(None, x, None)
        return found.reversed() if found and sign < 0.0 else found

    def _extrapolated(self, stopped: float, sign: float) -> float | None:
        """x at a turning point in which branches meet, too: from the places before it, as a
        polynomial along the curve, beyond which the turning point is a small part of them away.
        """
        x = stopped - sign * min(tol.PATH_PLACE_BEFORE * self.unit, abs(stopped - self.value))
        start = self._begin(self._path(x - self.value)[1][-1] / self.size, sign)
        if start is None:
            return None
        # x falls with the square of the distance that is left
        stride = 2.0 * abs(stopped - x) / (self.unit * abs(start.rate)) / PLACES

        pace = STEPS._replace(first=stride, shortest=stride / PLACES, growth=1.0)
        before = self._regular(tol.SINGULAR_VALUE_REGULAR, sign)
        steps = islice(walk(start, before, pace), 3 * PLACES - 1)
        points = [start, *(there for _, there, _ in steps)]
        if len(points) < 2 * DEGREE:
            return None
        p = np.array([(point.x - start.x) @ start.along for point in points])
        fit = np.polynomial.Polynomial.fit(p, [point.value for point in points], DEGREE)
        roots = fit.deriv().roots()
        ahead = roots.real[(np.abs(roots.imag) < tol.ROOT_REAL) & (roots.real > p[-1])]
        if not ahead.size or ahead.min() - p[-1] > 0.2 * np.ptp(p):
            return None
        return float(fit(ahead.min()))


# -- Range of a driver up to its dead centres --------------------------------------------------


@dataclass(frozen=True)
class DriverRange(Inherited):
    """How far a driver can go; ``low, high = driver_range(…)``, and ``print`` says it in words.

    `driver`, `body`: Names of the driver and of the body that it moves.
    `start`: Where the driver was [rad] or [length].
    `low`, `high`: The dead centres on both sides [rad] or [length]; infinite where there is none:
      an angle can then make whole revolutions.
    `unit`: Of lengths; empty for angles.
    `status`, `doubts`, `notes`: As of `Inherited`; notes on the branch that the guesses say.
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
        """Whether it meets no dead centre: an angle makes whole revolutions."""
        return math.isinf(self.low) and math.isinf(self.high)

    def __str__(self) -> str:
        verb = "move" if self.unit else "turn"
        if self.unlimited:
            whole = "without end" if self.unit else "all the way round"
            return f"'{self.body}' can {verb} {whole}"
        limits = [v if self.unit else math.degrees(v) for v in self]
        low, high = (f"{v:.10g} {self.unit or 'deg'}" for v in limits)
        ends = [f"from {low}"] * math.isfinite(limits[0]) + [f"to {high}"] * math.isfinite(
            limits[1]
        )
        return f"'{self.body}' can {verb} {' '.join(ends)}"


def driver_range(
    model: Mechanism | System,
    driver: str | None = None,
    *,
    t: float = 0.0,
    guess: Guesses | None = None,
) -> DriverRange:
    """How far a driver can go in both directions before a dead centre: its limits, toggle
    positions.

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
    takes_one_design("driver_range", system.batch)
    found = _driver(system, driver)
    if isinstance(t, bool) or not isinstance(t, (int, float)) or not math.isfinite(t):
        raise ModelError(f"driver_range takes one finite time, not {brief(t)}")
    start = closed(system, float(t), {}, guess)
    check_determined(system, start, "driver_range")
    limits = ends(system, start, found)
    unit = "" if found.angular else system.mechanism.units.length
    limits_of = (limits.value, limits.low, limits.high)
    return DriverRange(
        found.name, found.bodies[1], *limits_of, unit, notes=(*system.notes, *start.notes)
    )


def _driver(system: System, name: str | None) -> Any:
    """The driver of that name, or of the body of that name."""
    known = listed(d.name for d in system.independent_drivers)
    if name is None:
        if len(system.independent_drivers) != 1:
            raise ModelError(
                f"'{system.mechanism.name}' has {len(system.independent_drivers)} drivers "
                f"({known}): name the one whose range you want"
            )
        return system.independent_drivers[0]
    for driver in system.independent_drivers:
        if name in (driver.name, getattr(driver, "body", None)):
            return driver
    raise ModelError(f"there is no driver {brief(name)} (there are: {known})", str(name))
