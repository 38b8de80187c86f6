"""The flywheel for a given fluctuation of speed."""

from __future__ import annotations

import math
import warnings
from dataclasses import dataclass, replace
from numbers import Real
from typing import Any

import numpy as np

from mbody.analysis.dynamics.simulate import simulate
from mbody.core.bracket import zero_between
from mbody.core.presentation import Presented
from mbody.core.tolerances import RATE_CONSTANT, RTOL_FINE
from mbody.engineering.fluctuation import Fluctuation, angle_driver, fluctuation, link_energy
from mbody.errors import ModelError, ModelWarning
from mbody.laws import Table
from mbody.model.closed_mechanism import with_changed
from mbody.model.element import Marker
from mbody.model.loads import Torque
from mbody.solution.declared_result import Heading, IncludedResult, Value
from mbody.solution.doubts import Inherited, inherited
from mbody.solution.histories import one_design
from mbody.solution.known_forces import inherits
from mbody.solution.solution import Solution, as_solution
from mbody.summaries.text_table import numbers

# -- Flywheel for a speed fluctuation, with its proof by the free motion -----------------------

Array = np.ndarray

#: Places between two instants at which the speed is computed.
BETWEEN = 8
#: Instants of a simulated cycle, a revolution of it.
INSTANTS = 720
#: Said in place of a fluctuation that is infinite.
STANDS = "the speed would reach zero"


@dataclass(frozen=True, eq=False)
class FlywheelProof(Inherited):
    """The free motion of the mechanism with its flywheel, under the mean torque.

    Attributes
    ----------
    coefficient : float
        (greatest − least)/mean of the simulated speed over the cycle.
    angle, speed : arrays (instants,)
        Of the driven body [rad], [rad/time].
    run : Solution

    Examples
    --------
    >>> import mbody
    >>> engine = mbody.makers.slider_crank(1, 4, masses=(0, 0, 1), speed=10.0)
    >>> found = mbody.engineering.size_flywheel(mbody.kinetostatics(engine, turn=True), 0.1)
    >>> bool(found.simulated().speed.max() > 10.0)
    True
    """

    coefficient: float
    angle: Array
    speed: Array
    run: Any


def _between(found: FlywheelSizing) -> tuple[float, float]:
    """Least and greatest speed."""
    speed = np.abs(found.speeds)
    return float(speed.min()), float(speed.max())


@dataclass(frozen=True, eq=False, repr=False)
class FlywheelSizing(Inherited, Presented):
    """A flywheel and what the speed does with it.

    Attributes
    ----------
    inertia : float
        Of the flywheel, to be added on the shaft of the driver [mass·length²].
    simple : float
        ΔE/(C_s ω²), the textbook's, which does not count what the links' energy changes.
    coefficient : float
        (greatest − least)/mean speed with this flywheel.
    without : float
        The same with no flywheel; infinite where the speed would reach zero.
    speed : float
        Mean speed [rad/time].
    angle, speeds : arrays (places,)
        Angle of the driver [rad] and its speed with the flywheel [rad/time], over the cycle.
    fluctuation : Fluctuation
        Of the torque at constant speed.
    run : Solution
        The motion at constant speed.
    driver : str

    Examples
    --------
    >>> import mbody
    >>> engine = mbody.makers.slider_crank(1, 4, masses=(0, 0, 1), speed=10.0)
    >>> found = mbody.engineering.size_flywheel(mbody.kinetostatics(engine, turn=True), 0.1)
    >>> round(found.coefficient, 6), found.driver
    (0.1, 'motor')
    """

    inertia: float
    simple: float
    coefficient: float
    without: float
    speed: float
    angle: Array
    speeds: Array
    fluctuation: Fluctuation
    run: Any
    driver: str

    analysis_name = "flywheel"
    about_text = "driver '{0.driver}'"
    declared = (
        Heading("FLYWHEEL"),
        Value("driver"),
        Value("", "mean speed", "angular velocity", lambda found: abs(found.speed)),
        Value("speed", dimension="angular velocity"),
        IncludedResult("fluctuation"),
        Value("without", "fluctuation of the speed without it", missing=STANDS),
        Value("coefficient", "fluctuation of the speed with it", missing=STANDS),
        Value("", "speed with it", "angular velocity", _between),
        Value("inertia", "inertia of the flywheel", "mass·length²"),
        Value("inertia_simple", "by ΔE/(C ω²)", "mass·length²", "simple"),
    )

    def simulated(self) -> FlywheelProof:
        """The free motion over one cycle, from the speed at the first instant, under the mean
        torque in place of the driver.

        Raises
        ------
        ModelError
            For a driver between two moving bodies.
        SolveError
            As of `simulate`.
        """
        driver: Any = self.run.mechanism[self.driver]
        if driver.relative_to != "ground":
            raise ModelError(
                f"'{self.driver}' turns '{driver.body}' against '{driver.relative_to}': a flywheel "
                "is simulated on a shaft that turns in the ground",
                self.driver,
            )
        machine = self.run.mechanism.without(self.driver)
        body = machine[driver.body]
        first = 3 * self.run.system.bodies[driver.body]
        whole = float(self.run.system.mass[first + 2, 0]) + self.inertia
        changes = [replace(body, inertia=whole, spread=None)]
        machine = with_changed(machine, changes, ("inertia", "spread.")).copied()
        machine.add(Torque(f"{self.driver}_mean", driver.body, value=self.fluctuation.mean))
        ratio = abs(float(self.speeds[0]) / self.speed)
        guess, rates = {}, {}
        for one in machine.bodies:
            at, place = self.run[one.name], self.run.point(Marker(one.name, (0.0, 0.0)))
            guess[one.name] = (float(place.x[0]), float(place.y[0]), float(at.angle[0]))
            rates[one.name] = float(at.omega[0]) * ratio
        period = float(np.trapezoid(1.0 / np.abs(self.speeds), np.abs(self.angle - self.angle[0])))
        revolutions = max(1, round(abs(self.angle[-1] - self.angle[0]) / (2.0 * math.pi)))
        count = INSTANTS * revolutions + 1
        run = simulate(machine, period, guess=guess, rates=rates, rtol=RTOL_FINE, instants=count)
        speed = np.asarray(run[driver.body].omega)
        return FlywheelProof(
            _spread(np.abs(speed)), run[driver.body].angle, speed, run, **inherited(run)
        )

    def __repr__(self) -> str:
        return f"FlywheelSizing({numbers([self.inertia])[0]} for {self.coefficient:.4g})"


def check_coefficient(coefficient: Any) -> float:
    """A coefficient of fluctuation of speed."""
    if (
        not isinstance(coefficient, Real)
        or isinstance(coefficient, bool)
        or not 0.0 < float(coefficient) < 2.0
    ):
        raise ModelError(
            f"the coefficient of fluctuation of speed is (ω_max − ω_min)/ω, between 0 and 2, not "
            f"{coefficient!r}: a common one is 0.02"
        )
    return float(coefficient)


@inherits
def size_flywheel(run: Solution, coefficient: float, driver: str | None = None) -> FlywheelSizing:
    """The flywheel for a coefficient of fluctuation of the speed of a driver, the energy of the
    moving links counted: exact flywheel calculation.

    ½ I ω² + K(θ) (ω/ω₀)² = const + ∫ (T_mean − T) dθ + K(θ),  K the energy of the links at ω₀

    Parameters
    ----------
    run : Solution
        Of kinetostatics at a constant speed over whole cycles, both ends included.
    coefficient : float
        (ω_max − ω_min)/ω, such as 0.02; ω is the mean of both.
    driver : str, optional
        Name of the driver of an angle, on whose shaft the flywheel is; by default the only one.

    Returns
    -------
    FlywheelSizing
        The inertia to add, 0 where the links themselves suffice; `simulated()` is the proof.

    Raises
    ------
    ModelError
        As of `fluctuation`, for a coefficient that is none, and for a speed that is not constant.

    Notes
    -----
    The driver's torque at constant speed has in it what the links' inertia takes; with the speed
    free, that energy goes with its square. Loads are taken as functions of the position: those
    that depend on the speed or on time are as at the mean speed. The mean torque stays on the shaft
    all the time, as of a motor, or as the load of an engine.

    `flywheel` is the textbook's ΔE/(C_s ω²), which leaves the links' energy out.

    Source: F. Wittenbauer, *Graphische Dynamik* (1923), the energy–mass diagram; R. S. Khurmi and
    J. K. Gupta, *Theory of Machines*, chapter 16.

    Examples
    --------
    >>> import mbody
    >>> engine = mbody.makers.slider_crank(1, 4, masses=(0, 0, 1), speed=10.0)
    >>> found = size_flywheel(mbody.kinetostatics(engine, turn=True), 0.1)
    >>> print(f"{found.inertia:.4f} {found.simple:.4f} {found.simulated().coefficient:.6f}")
    4.7955 5.3136 0.100000
    """
    run = as_solution(run)
    wanted = check_coefficient(coefficient)
    name = angle_driver(run, driver)
    one_design(run, "a flywheel is of one design")
    rate = np.asarray(run.driven(name)[1])
    speed = float(np.mean(rate))
    if speed == 0.0 or not math.isfinite(speed):
        raise ModelError(
            f"driver '{name}' has no speed, which a flywheel needs: give its law a speed", name
        )
    if np.ptp(rate) > RATE_CONSTANT * abs(speed):
        raise ModelError(
            f"a flywheel is sized at a constant speed, '{name}' has {rate.min():g} to "
            f"{rate.max():g} rad/s: give its law a constant speed",
            name,
        )
    found = fluctuation(run, name)
    angle, kinetic, gained = _over_cycle(run, found)
    without, _ = _coefficient(kinetic, gained, 0.0)
    inertia = 0.0
    if without > wanted:
        inertia = 2.0 * _least_energy(kinetic, gained, wanted, found.fluctuation) / speed**2
    reached, ratio = _coefficient(kinetic, gained, 0.5 * inertia * speed**2)
    more = inherited(run)
    more["notes"] = (*more.get("notes", ()), *_notes(without, wanted))
    return FlywheelSizing(
        inertia,
        found.fluctuation / (wanted * speed**2),
        reached,
        without,
        speed,
        angle,
        speed * ratio,
        found,
        run,
        name,
        **more,
    )


def _notes(without: float, wanted: float) -> tuple[str, ...]:
    if without > wanted:
        return ()
    return (f"the links alone keep the speed within {without:.3g}: no flywheel is needed",)


def _over_cycle(run: Solution, found: Fluctuation) -> tuple[Array, Array, Array]:
    """Angles between the instants too, the links' energy there at the constant speed, and what a
    mean torque has brought beyond that of the driver, the change of that energy with it.
    """
    kinetic = link_energy(run)
    angle = found.angle
    x = np.abs(angle - angle[0])
    fine = np.unique(
        np.concatenate([x[:-1] + part * np.diff(x) for part in np.linspace(0.0, 1.0, BETWEEN + 1)])
    )
    curves = [
        Table(x, np.append(row[:-1], row[0]), periodic=True)(np.minimum(fine, x[-1]))
        for row in (kinetic, kinetic - kinetic[0] - found.energy)
    ]
    sign = 1.0 if angle[-1] > angle[0] else -1.0
    return angle[0] + sign * fine, np.maximum(curves[0], 0.0), curves[1]


def _coefficient(kinetic: Array, gained: Array, flywheel_energy: float) -> tuple[float, Array]:
    """The coefficient of fluctuation with that energy of a flywheel at the mean speed, and the
    speed as a part of its mean; infinite where it would reach zero.
    """
    carried = flywheel_energy + kinetic
    if not carried.min() > 0.0:
        return math.inf, np.full(kinetic.shape, np.nan)

    def ratios(whole: float) -> Array:
        return np.sqrt(np.maximum(whole + gained, 0.0) / carried)

    def beyond(whole: float) -> float:
        s = ratios(whole)
        return 0.5 * (_top(s) - _top(-s)) - 1.0

    low = -float(gained.min())
    least = beyond(low)
    if least > 0.0:  # it stands still before the mean is as low as that
        return math.inf, np.full(kinetic.shape, np.nan)
    high = low + 2.0 * float(carried.max())
    while (most := beyond(high)) < 0.0:
        high *= 2.0
    s = ratios(zero_between(beyond, (low, high), (least, most)).above)
    return _top(s) + _top(-s), s


def _least_energy(kinetic: Array, gained: Array, wanted: float, size: float) -> float:
    """Energy of the flywheel at the mean speed with which the coefficient is as wanted."""

    def reserve(energy: float) -> float:
        return wanted - _coefficient(kinetic, gained, energy)[0]

    high = size / wanted
    while reserve(high) < 0.0:
        high *= 2.0
    return zero_between(reserve, (0.0, high), (reserve(0.0), reserve(high))).above


def _spread(values: Array) -> float:
    """(greatest − least)/mean of both, of a periodic row, extremes between its values too."""
    top, bottom = _top(values), -_top(-values)
    return 2.0 * (top - bottom) / (top + bottom)


def _top(values: Array) -> float:
    """The greatest value, by a parabola through the greatest of the row and its neighbours."""
    k = int(values.argmax())
    if not 0 < k < len(values) - 1:
        return float(values[k])
    a, b, c = (float(values[n]) for n in (k - 1, k, k + 1))
    second_difference = a - 2.0 * b + c
    return b - (c - a) ** 2 / (8.0 * second_difference) if second_difference < 0.0 else b


def flywheel(run: Solution, coefficient: float, driver: str | None = None) -> float:
    """Moment of inertia [mass·length²] for a given coefficient of fluctuation of speed of a
    driver: flywheel calculation.

    I = ΔE / (C_s ω²),  C_s = (ω_max − ω_min)/ω,  ω the mean speed

    Parameters
    ----------
    run : Solution
        With forces, over whole revolutions at a constant speed; see `fluctuation`.
    coefficient : float
        Coefficient of fluctuation of speed C_s, such as 0.02.
    driver : str, optional
        Name of the driver of an angle, on whose shaft the flywheel is.

    Returns
    -------
    float
        Of the flywheel alone, without the inertia already on that shaft. A result in doubt, or a
        torque that is not unique, causes a `ModelWarning`.

    Raises
    ------
    ModelError
        For an invalid coefficient, or a driver without speed.

    Notes
    -----
    The fluctuation of energy is that at the constant speed ω; the effect of the varying speed on
    the inertia forces of the links is neglected, which is of the order C_s; `size_flywheel` counts
    it.

    Source: R. S. Khurmi and J. K. Gupta, *Theory of Machines*, chapter 16, ΔE = I ω² C_s; R. L.
    Norton, *Design of Machinery*, section 11.11.

    Examples
    --------
    >>> import mbody
    >>> engine = mbody.makers.slider_crank(1, 4, masses=(0, 0, 1), speed=10.0)
    >>> run = mbody.kinetostatics(engine, turn=True)
    >>> round(flywheel(run, 0.02) / flywheel(run, 0.01), 9)
    0.5
    """
    coefficient = check_coefficient(coefficient)
    name = angle_driver(run, driver)
    speed = float(np.mean(run.driven(name)[1]))
    if speed == 0.0 or not math.isfinite(speed):
        raise ModelError(
            f"driver '{name}' has no speed, which a flywheel needs: give its law a speed", name
        )
    found = fluctuation(run, name)
    # a number has neither doubts nor notes
    doubts = [f"the motion for its size is doubtful: {one.message}" for one in found.doubts]
    for sentence in (*doubts, *found.notes)[:1]:
        warnings.warn(f"flywheel: {sentence}", ModelWarning, stacklevel=2)
    return found.fluctuation / (coefficient * speed**2)
