"""The flywheel for a given fluctuation of speed."""

from __future__ import annotations

import math
import warnings
from dataclasses import dataclass, replace
from numbers import Real
from typing import Any

import numpy as np
import numpy.typing as npt

from mbody.analysis.dynamics.simulate import simulate
from mbody.core import tolerances as tol
from mbody.core.bracket import zero_between
from mbody.core.presentation import Presented
from mbody.core.tolerances import RATE_CONSTANT, RTOL_FINE
from mbody.errors import ModelError, ModelWarning, brief
from mbody.laws import Table
from mbody.model.element import Marker, listed
from mbody.model.loads import Torque
from mbody.model.model_notes import with_changed
from mbody.solution.declared_result import Heading, IncludedResult, Value
from mbody.solution.doubts import Inherited, inherited
from mbody.solution.histories import one_design
from mbody.solution.known_forces import inherits
from mbody.solution.solution import Solution, as_solution
from mbody.summaries.text_table import numbers

# -- The turning moment over a cycle: its mean, and the fluctuation of energy ------------------

# -- Whole cycles of a driver: how many revolutions they are, and whether a quantity repeats -------

Array = np.ndarray


def cycle_revolutions(angle: Array, what: str) -> int:
    """Number of whole revolutions that the angles (instants,) [rad] make, both ends included."""
    steps = np.diff(angle)
    revolutions = abs(angle[-1] - angle[0]) / (2.0 * math.pi) if angle.size else 0.0
    one_way = angle.size > 2 and ((steps > 0.0).all() or (steps < 0.0).all())
    if (
        not one_way
        or round(revolutions) < 1
        or abs(revolutions - round(revolutions)) > tol.CYCLE_WHOLE_TURNS * revolutions
    ):
        raise ModelError(
            f"{what} needs whole turns in one direction, both ends included; these "
            f"{angle.size} instants are {360.0 * revolutions:.6g} deg: analyse with turn=True"
        )
    return round(revolutions)


def counted(revolutions: int) -> str:
    """A number of revolutions in words.

    >>> counted(1), counted(2)
    ('1 turn', '2 turns')
    """
    return "1 turn" if revolutions == 1 else f"{revolutions} turns"


def check_repeats(values: Array, size: float, name: str, what: str) -> None:
    """Refuse a quantity (instants,) that does not end as it began."""
    begin, end = values[0] + 0.0, values[-1] + 0.0  # without the sign of a zero
    if not abs(end - begin) <= tol.CYCLE_PERIODIC * size:
        raise ModelError(
            f"the {name} is {begin:.6g} at the beginning of the cycle and {end:.6g} at its "
            f"end: {what} needs a periodic cycle: give the driver a constant "
            "speed, and use whole cycles of the loads (turns=2 where they take two turns)"
        )


# -- The kinetic energy of all links, from their histories -------------------------------------


def link_energy(run: Solution) -> np.ndarray:
    """½ Σ (m v² + I ω²) at every instant (instants,), of a result of one design.

    >>> import mbody
    >>> machine = mbody.makers.four_bar(1, 3, 2, 3.5, masses=(3, 0, 0), speed=2.0)
    >>> link_energy(mbody.kinematics(machine)).round(12)  # a rod about its end: ½ (m l²/3) ω²
    array([2.])
    """
    bodies = run.mechanism.bodies
    rates = np.array([[run[b.name].vx, run[b.name].vy, run[b.name].omega] for b in bodies])
    places = np.array([run.system.bodies[body.name] for body in bodies])
    mass = np.asarray(run.system.mass[:, 0]).reshape(-1, 3)[places]
    return np.asarray(0.5 * np.einsum("bk,bkt->t", mass, rates**2))


def _rounding(found: Fluctuation) -> float:
    """Below which torque and work are none: all of them where the work is rounding."""
    return math.inf if math.isinf(found.energy_coefficient) else 0.0


@dataclass(frozen=True, eq=False, repr=False)
class Fluctuation(Inherited, Presented):
    """The turning-moment diagram of a cycle, with mean torque and fluctuation of energy.

    Attributes
    ----------
    angle, torque, energy : arrays (instants,)
        Angle [rad]; torque [force·length]; ∫ (T − mean) dθ from the first instant on
        [force·length].
    mean : float
        Mean torque: the work of a cycle by its angle.
    work : float
        Of the cycle [force·length].
    least, greatest : float
        Extremes of the energy, at the crossings of torque and mean, also between instants.
    at_least, at_greatest : float
        Angles of them [rad].
    run : Solution or None
        Whose it is; None of a torque at given angles.
    status, doubts, notes
        As of `Inherited`: those of the result.

    Examples
    --------
    >>> import mbody
    >>> engine = mbody.makers.slider_crank(1, 4, masses=(0, 0, 1), speed=10.0)
    >>> found = mbody.engineering.fluctuation(mbody.kinetostatics(engine, turn=True))
    >>> bool(abs(found.greatest - found.least - found.fluctuation) < 1e-12)
    True
    """

    angle: Array
    torque: Array
    energy: Array
    mean: float
    work: float
    least: float
    greatest: float
    at_least: float
    at_greatest: float
    run: Any = None

    declared = (
        Heading("FLUCTUATION"),
        Value("mean_torque", "mean torque of the driver", "torque", "mean", floor=_rounding),
        Value("work", "work of a cycle", "torque", floor=_rounding),
        Value("energy_fluctuation", "greatest fluctuation of energy", "torque", "fluctuation"),
        Value("energy_coefficient", "as a part of the work"),
        Value("least_at", "energy least at", "angle", "at_least"),
        Value("greatest_at", "energy greatest at", "angle", "at_greatest"),
    )

    @property
    def fluctuation(self) -> float:
        """Greatest fluctuation of energy ΔE = E_max − E_min [force·length]."""
        return self.greatest - self.least

    @property
    def energy_coefficient(self) -> float:
        """Coefficient of fluctuation of energy, ΔE / work of a cycle; infinite without work, or
        with one that is rounding beside ΔE, or no more than what equal instants leave of a mean
        where the torque has corners.
        """
        none = abs(self.work) <= tol.WORK_CYCLE_ROUNDING * self.fluctuation
        if self.run is not None:
            none |= abs(self.mean) <= float(np.max(np.abs(self.torque))) / len(self.torque) ** 2
        return math.inf if none else self.fluctuation / abs(self.work)

    @property
    def torque_coefficient(self) -> float:
        """(T_max − T_min) / mean torque at the instants; infinite where the mean is zero."""
        return float(np.ptp(self.torque)) / abs(self.mean) if self.mean else math.inf

    def __repr__(self) -> str:
        return f"Fluctuation({self.fluctuation:.6g} about a mean torque of {self.mean:.6g})"


@inherits
def fluctuation(run: Solution, driver: str | None = None) -> Fluctuation:
    """Mean torque of a driver and the greatest fluctuation of energy about it: the turning-moment
    diagram of a cycle.

    ΔE = max E − min E,  E(θ) = ∫ (T − T_mean) dθ

    Parameters
    ----------
    run : Solution
        With forces, over one or more whole revolutions at a steady motion, both ends included.
    driver : str, optional
        Name of the driver of an angle; by default the only one.

    Returns
    -------
    Fluctuation
        Torques are those of the driver; energies are in its unit of torque.

    Raises
    ------
    ModelError
        For a run without whole revolutions, or one whose torque does not repeat.

    Notes
    -----
    The torque is taken as the periodic cubic spline through the instants, which is integrated and
    crossed with its mean exactly: the mean has the accuracy of a trapezoidal sum of a periodic
    function, the energy an error of order h⁴, at a nonsmooth point h², at a jump h times its
    height.

    Source: R. S. Khurmi and J. K. Gupta, *Theory of Machines*, chapter 16; R. L. Norton, *Design of
    Machinery*, section 11.11.

    Examples
    --------
    >>> import mbody
    >>> engine = mbody.makers.slider_crank(1, 4, masses=(0, 0, 1), speed=10.0)
    >>> found = fluctuation(mbody.kinetostatics(engine, turn=True))
    >>> abs(found.mean) < 1e-12 * found.fluctuation
    True
    """
    run = as_solution(run)
    name = angle_driver(run, driver)
    one_design(run, "a fluctuation is of one design")
    found = energy_fluctuation(run.driven(name)[0], run.effort(name))
    return replace(found, run=run, **inherited(run))


def energy_fluctuation(
    angle: npt.ArrayLike | Solution, torque: npt.ArrayLike | None = None
) -> Fluctuation:
    """Fluctuation of energy of a torque at given angles: arrays (instants,), both ends included; or
    of a result, as `fluctuation`.

    Parameters
    ----------
    angle : array_like (instants,)
        Monotonic over whole revolutions [rad]; or a result, whose `fluctuation` is returned.
    torque : array_like (instants,)
        [force·length].

    Raises
    ------
    ModelError
        For angles that do not make whole revolutions, or a torque that does not repeat.

    >>> theta = np.linspace(0.0, 2.0 * np.pi, 721)
    >>> round(energy_fluctuation(theta, 5.0 + 3.0 * np.sin(2.0 * theta)).fluctuation, 6)
    3.0
    """
    if torque is None:
        if isinstance(angle, Solution):
            return fluctuation(angle)
        raise ModelError("energy_fluctuation takes angles and torques, or a result: give both")
    angle, torque = (np.asarray(part, dtype=float) for part in (angle, torque))
    whole_angle = 2.0 * math.pi * cycle_revolutions(angle, "a fluctuation")
    check_repeats(torque, float(np.abs(torque).max()), "torque", "a fluctuation")
    x = np.abs(angle - angle[0])
    sign = 1.0 if angle[-1] > angle[0] else -1.0
    spline = Table(x, np.append(torque[:-1], torque[0]), periodic=True)
    knots = x.size
    c = spline.table()[2 + knots :].reshape(-1, 4)
    h = np.diff(x)
    pieces = h * (c[:, 0] + h * (c[:, 1] / 2 + h * (c[:, 2] / 3 + h * c[:, 3] / 4)))
    mean = float(pieces.sum() / x[-1])
    energy = np.concatenate([[0.0], np.cumsum(pieces - mean * h)])
    energy[-1] = 0.0
    places, values = [x], [energy]
    for k in np.flatnonzero(_may_cross(torque, mean)):
        inside = _crossings(c[k] - [mean, 0.0, 0.0, 0.0], h[k])
        a, b, d, e = c[k]
        places.append(x[k] + inside)
        values.append(
            energy[k] + inside * (a - mean + inside * (b / 2 + inside * (d / 3 + inside * e / 4)))
        )
    place, value = np.concatenate(places), sign * np.concatenate(values)
    low, high = int(value.argmin()), int(value.argmax())
    return Fluctuation(
        angle,
        torque,
        sign * energy,
        mean,
        sign * mean * whole_angle,
        float(value[low]),
        float(value[high]),
        float(angle[0] + sign * place[low]),
        float(angle[0] + sign * place[high]),
    )


def _may_cross(torque: Array, mean: float) -> Array:
    """Intervals with values on both sides of the mean nearby."""
    above = np.concatenate([torque[-3:-1], torque, torque[1:3]]) >= mean
    windows = np.lib.stride_tricks.sliding_window_view(above, 6)[: torque.size - 1]
    return np.asarray(windows.any(axis=1) & ~windows.all(axis=1))


def _crossings(c: Array, h: float) -> Array:
    """Zeros of a cubic with ascending coefficients within 0 … h."""
    roots = np.roots(c[::-1])
    real = roots.real[np.abs(roots.imag) <= tol.ROOT_REAL_FINE * (h + np.abs(roots.real))]
    return np.asarray(real[(real >= 0.0) & (real <= h)])


def angle_driver(run: Solution, name: str | None) -> str:
    """The name of the driver of an angle."""
    angular = [d.name for d in run.mechanism.drivers if d.angular]
    if name is None and len(angular) == 1:
        return angular[0]
    if name not in angular:
        what = "several drivers turn" if name is None else f"no driver {brief(name)} turns"
        raise ModelError(f"{what} a body here (there are: {listed(angular)}): name one of them")
    return str(name)


# -- Flywheel for a speed fluctuation, with its proof by the free motion -----------------------


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
