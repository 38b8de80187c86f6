"""The turning moment over a cycle: its mean, and the energy that comes and goes about it."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from mbody.errors import ModelError, brief
from mbody.laws import Table
from mbody.model.element import listed
from mbody.solution.doubts import Inherited, inherited
from mbody.solution.solution import Solution, as_solution
from mbody.system.read_only import lock

__all__ = ["Fluctuation", "energy_fluctuation", "fluctuation", "the_motor"]

Array = np.ndarray

#: Part of a turn by which the instants may miss whole turns.
WHOLE = 1e-9
#: Part of the greatest torque by which the cycle may end elsewhere than it began.
SAME = 1e-6


@dataclass(frozen=True, eq=False)
class Fluctuation(Inherited):
    """The turning-moment diagram of a cycle, and what follows from it.

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
        Extremes of the energy, at the crossings of torque and mean, between instants too.
    at_least, at_greatest : float
        Angles of them [rad].
    status, doubts, notes
        As of `Inherited`: those of the result.
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

    def __post_init__(self) -> None:
        lock(self)

    @property
    def fluctuation(self) -> float:
        """Greatest fluctuation of energy ΔE = E_max − E_min [force·length]."""
        return self.greatest - self.least

    @property
    def energy_coefficient(self) -> float:
        """Coefficient of fluctuation of energy, ΔE / work of a cycle; infinite without work."""
        return self.fluctuation / abs(self.work) if self.work else math.inf

    @property
    def torque_coefficient(self) -> float:
        """(T_max − T_min) / mean torque at the instants; infinite where the mean is none."""
        return float(np.ptp(self.torque)) / abs(self.mean) if self.mean else math.inf


def fluctuation(run: Solution, driver: str | None = None) -> Fluctuation:
    """Mean torque of a driver and the greatest fluctuation of energy about it: the turning-moment
    diagram of a cycle.

    ΔE = max E − min E,  E(θ) = ∫ (T − T_mean) dθ

    Parameters
    ----------
    run : Solution
        With forces, over one or more whole turns at a steady motion, both ends included.
    driver : str, optional
        Name of the driver of an angle; where there is one, that one.

    Returns
    -------
    Fluctuation
        Torques are those that the driver gives; times 1 of its unit of torque for energies.

    Raises
    ------
    ModelError
        For a run without whole turns, or one whose torque does not repeat.

    Notes
    -----
    The torque is taken as the periodic cubic spline through the instants, which is integrated and
    crossed with its mean exactly: the mean has the accuracy of a trapezoidal sum of a periodic
    function, the energy an error of order h⁴, at a kink h², at a jump h times its height.

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
    name = the_motor(run, driver)
    if run.system.batch is not None:
        raise ModelError(
            f"a fluctuation is of one design, this is a batch of {run.system.batch} designs: "
            "analyse one of them, system.design(n)"
        )
    found = energy_fluctuation(run.driven(name)[0], run.effort(name))
    return replace(found, **inherited(run))


def energy_fluctuation(angle: Any, torque: Any = None) -> Fluctuation:
    """The same of a torque given at angles: arrays (instants,), both ends of the cycle included.

    Parameters
    ----------
    angle : array_like (instants,)
        Ever increasing or ever decreasing over whole turns [rad]; or a result, whose `fluctuation`
        is given.
    torque : array_like (instants,)
        [force·length].

    Raises
    ------
    ModelError
        For angles that do not make whole turns, or a torque that does not repeat.

    >>> theta = np.linspace(0.0, 2.0 * np.pi, 721)
    >>> round(energy_fluctuation(theta, 5.0 + 3.0 * np.sin(2.0 * theta)).fluctuation, 6)
    3.0
    """
    if torque is None:
        if isinstance(angle, Solution):
            return fluctuation(angle)
        raise ModelError("energy_fluctuation takes angles and torques, or a result: give both")
    angle, torque = (np.asarray(part, dtype=float) for part in (angle, torque))
    way = _way(angle)
    ends = torque[0] + 0.0, torque[-1] + 0.0  # without the sign of a zero
    if not abs(ends[1] - ends[0]) <= SAME * np.abs(torque).max():
        raise ModelError(
            f"the torque is {ends[0]:.6g} at the beginning of the cycle and {ends[1]:.6g} at its "
            "end: a fluctuation is that of a cycle that repeats; let the driver have a constant "
            "speed, and take whole cycles of the loads"
        )
    x = np.abs(angle - angle[0])
    sense = 1.0 if angle[-1] > angle[0] else -1.0
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
    place, value = np.concatenate(places), sense * np.concatenate(values)
    low, high = int(value.argmin()), int(value.argmax())
    return Fluctuation(
        angle,
        torque,
        sense * energy,
        mean,
        sense * mean * way,
        float(value[low]),
        float(value[high]),
        float(angle[0] + sense * place[low]),
        float(angle[0] + sense * place[high]),
    )


def _way(angle: Array) -> float:
    """The angle [rad] of the whole cycle."""
    steps = np.diff(angle)
    turns = abs(angle[-1] - angle[0]) / (2.0 * math.pi) if angle.size else 0.0
    one_way = angle.size > 2 and ((steps > 0.0).all() or (steps < 0.0).all())
    if not one_way or round(turns) < 1 or abs(turns - round(turns)) > WHOLE * turns:
        raise ModelError(
            f"a fluctuation is that of whole turns in one sense, both ends included; these "
            f"{angle.size} instants make {360.0 * turns:.6g} deg: analyse with turn=True"
        )
    return float(2.0 * math.pi * round(turns))


def _may_cross(torque: Array, mean: float) -> Array:
    """Intervals whose neighbourhood lies on both sides of the mean."""
    above = np.concatenate([torque[-3:-1], torque, torque[1:3]]) >= mean
    windows = np.lib.stride_tricks.sliding_window_view(above, 6)[: torque.size - 1]
    return np.asarray(windows.any(axis=1) & ~windows.all(axis=1))


def _crossings(c: Array, h: float) -> Array:
    """Zeros of a cubic with ascending coefficients within 0 … h."""
    roots = np.roots(c[::-1])
    real = roots.real[np.abs(roots.imag) <= 1e-9 * (h + np.abs(roots.real))]
    return np.asarray(real[(real >= 0.0) & (real <= h)])


def the_motor(run: Solution, name: str | None) -> str:
    """The driver of an angle that is meant.

    Raises
    ------
    ModelError
        Where it is not clear, or there is none.
    """
    turning = [d.name for d in run.mechanism.drivers if d.angular]
    if name is None and len(turning) == 1:
        return turning[0]
    if name not in turning:
        what = "several drivers turn" if name is None else f"no driver {brief(name)} turns"
        raise ModelError(f"{what} a body here (there are: {listed(turning)}): name one of them")
    return str(name)
