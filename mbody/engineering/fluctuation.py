"""The turning moment over a cycle: its mean, and the fluctuation of energy."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import numpy.typing as npt

from mbody.core import tolerances as tol
from mbody.core.presentation import Presented
from mbody.errors import ModelError, brief
from mbody.laws import Table
from mbody.model.element import listed
from mbody.solution.declared_result import Heading, Value
from mbody.solution.doubts import Inherited, inherited
from mbody.solution.histories import one_design
from mbody.solution.known_forces import inherits
from mbody.solution.solution import Solution, as_solution

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
