"""Loads of bearings: their spectrum, and the equivalent load of their life."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from mbody.core.presentation import Presented
from mbody.errors import ModelError
from mbody.model.element import unknown_name
from mbody.model.joints import Revolute
from mbody.model.numbers import number_in
from mbody.quantities.types import Number
from mbody.solution.declared_result import Heading, ItemTable, Value
from mbody.solution.doubts import Inherited, inherited
from mbody.solution.histories import check_forces
from mbody.solution.known_forces import inherits
from mbody.solution.solution import Solution, as_solution

Array = np.ndarray

#: Exponents of life by the kind of bearing (ISO 281).
EXPONENTS = {"ball": 3.0, "roller": 10.0 / 3.0}
REVOLUTION = 2.0 * math.pi


def lasting(life: float | None, size: float) -> str | None:
    """A life in other units; None where it is not known."""
    if life is None:
        return None
    return f"{size * life:.5g}" if math.isfinite(life) else "endless"


@dataclass(frozen=True, eq=False)
class BearingLoad(Inherited, Presented):
    """The load of a bearing over a cycle.

    Attributes
    ----------
    force, speed : arrays (instants,)
        Magnitude of the joint's force [force]; speed of its two bodies against each other, without
        its sign [rad/time].
    equivalent : float
        Constant load with the same life: P = (∫ F^p |ω| dt / ∫ |ω| dt)^{1/p} [force].
    in_time : float
        The same by time in place of revolutions, (∫ F^p dt / T)^{1/p}.
    greatest, mean : float
        [force]
    revolutions : float
        Of the bearing in the cycle, to and fro counted alike.
    cycle : float
        How long the cycle is [time].
    exponent : float
        p.
    life : float or None
        L₁₀ in revolutions, 10⁶ (C/P)^p; None without the bearing's rating.
    time : float or None
        The same in units of time of the mechanism.

    >>> import mbody
    >>> machine = mbody.makers.four_bar(1, 3, 2, 3.5, masses=(1, 3, 2), speed=9.0)
    >>> run = mbody.kinetostatics(machine, turn=True)
    >>> found = bearing_load(run, "A", "roller")
    >>> float(found.force.max()) == found.greatest, found.life
    (True, None)
    """

    force: Array
    speed: Array
    equivalent: float
    in_time: float
    greatest: float
    mean: float
    revolutions: float
    cycle: float
    exponent: float
    life: float | None
    time: float | None
    t: Array

    declared = (
        Heading("BEARING LOAD"),
        Value("equivalent", "equivalent", "force"),
        Value("in_time", "by time", "force"),
        Value("greatest", "greatest", "force"),
        Value("mean", "mean", "force"),
        Value("revolutions", "turns a cycle"),
        Value("cycle", "", "time"),
        "exponent life",
        Value("", "life, 10⁶ rev", "text", lambda one: lasting(one.life, 1e-6)),
        Value("time", "", "time"),
    )

    def spectrum(self, classes: int = 10) -> list[tuple[float, float, float, float]]:
        """The load spectrum: of equal classes of force (from, to, share of revolutions, share of
        time).

        Raises
        ------
        ModelError
            For a number of classes that is none.
        """
        if isinstance(classes, bool) or not isinstance(classes, int) or not 1 <= classes <= 10_000:
            raise ModelError(f"a spectrum has 1 to 10000 classes, not {classes!r}")
        edges = np.linspace(0.0, self.greatest or 1.0, classes + 1)
        middle = 0.5 * (self.force[1:] + self.force[:-1])
        lasting = np.diff(self.t)
        rotations = 0.5 * (self.speed[1:] + self.speed[:-1]) * lasting
        shares = [
            np.histogram(middle, edges, weights=weights / (weights.sum() or 1.0))[0]
            for weights in (rotations, lasting)
        ]
        rows = zip(edges[:-1], edges[1:], *shares, strict=True)
        return [(float(a), float(b), float(r), float(s)) for a, b, r, s in rows]


def _spectrum_of(load: BearingLoad) -> Callable[[Any], Any]:
    return lambda found: load.spectrum(found.classes)


@dataclass(frozen=True, eq=False, repr=False)
class BearingLoads(Presented):
    """Loads of several bearings over one cycle; ``print`` shows them.

    Attributes
    ----------
    run : Solution
    loads : dict
        A `BearingLoad` by joint.
    classes : int
        Of the spectra in its data; of those in its text, if they are wanted there.
    spectra : bool
        Whether its text has them.
    """

    run: Any
    loads: dict[str, BearingLoad]
    classes: int = 10
    spectra: bool = False

    analysis_name = "bearings"

    @property
    def about_text(self) -> str:
        """How long the cycle is, and the exponent of life."""
        one = next(iter(self.loads.values()))
        unit = self.run.mechanism.units.time
        return f"bearings over {one.cycle:.6g} {unit}, exponent of life {one.exponent:.4g}"

    @property
    def declared(self) -> tuple[Any, ...]:
        """The bearings, and the spectra of each."""
        hour = self.run.mechanism.units.unit("time").factor / 3600.0
        hours = Value("", "life, h", "text", lambda one: lasting(one.time, hour))
        spectrum = Value(
            "spectrum", "", ("force", "force", "", ""), lambda one: one.spectrum(self.classes)
        )
        tables = [
            ItemTable(
                "",
                (
                    Value("", f"{name}: from", "force", lambda row: row[0]),
                    Value("", "to", "force", lambda row: row[1]),
                    Value("", "of revolutions", "share", lambda row: row[2]),
                    Value("", "of time", "share", lambda row: row[3]),
                ),
                value=_spectrum_of(one),
            )
            for name, one in self.loads.items()
            if self.spectra
        ]
        return ItemTable(
            "bearings", (*BearingLoad.declared, hours, spectrum), "BEARING", "loads"
        ), *tables

    status = property(lambda self: self.run.status)
    doubts = property(lambda self: self.run.doubts)
    notes = property(lambda self: self.run.notes)


@inherits
def bearing_load(
    run: Solution, joint: str, kind: str | float = "ball", rating: Number | None = None
) -> BearingLoad:
    """Equivalent load, load spectrum and life of the bearing in a revolute joint.

    P = (∫ F^p |ω| dt / ∫ |ω| dt)^{1/p},  L₁₀ = 10⁶ (C/P)^p revolutions

    Parameters
    ----------
    run : Solution
        With forces, over a cycle of time.
    joint : str
        A revolute joint.
    kind : "ball", "roller" or float
        p = 3, 10/3, or the exponent itself.
    rating : float or str, optional
        Basic dynamic load rating C of the bearing [force].

    Returns
    -------
    BearingLoad

    Raises
    ------
    ModelError
        For a joint that is no revolute, one instant, a kind or a rating that is none.

    Notes
    -----
    The load is the radial force of the plane. Integrals are trapezoidal sums over the instants,
    exact to high order over a periodic cycle at equal steps. Small oscillation, lubrication and
    axial loads are beyond the basic rating life.

    Source: ISO 281; ISO 76; SKF, *Rolling bearings*, mean load over duty intervals.

    Examples
    --------
    >>> import mbody
    >>> machine = mbody.makers.four_bar(1, 3, 2, 3.5, masses=(1, 3, 2), speed=9.0)
    >>> run = mbody.kinetostatics(machine, turn=True)
    >>> found = bearing_load(run, "A", "ball", rating=5000.0)
    >>> found.mean < found.equivalent < found.greatest
    True
    """
    run = as_solution(run)
    check_forces(run, "loads of bearings")
    revolutes = [one.name for one in run.mechanism.joints if isinstance(one, Revolute)]
    if joint not in revolutes:
        raise unknown_name("revolute joint", joint, revolutes)
    exponent = EXPONENTS.get(kind, 0.0) if isinstance(kind, str) else float(kind)
    if not 1.0 <= exponent <= 20.0:
        raise ModelError(
            f"bearing '{joint}' is 'ball', 'roller', or its exponent from 1 to 20, not {kind!r}",
            joint,
        )
    if len(run) < 2 or not np.ptp(run.t) > 0.0:
        raise ModelError(
            f"the load of bearing '{joint}' is of a cycle of time, this is one instant: analyse a "
            "turn, or several times",
            joint,
        )
    element: Any = run.mechanism[joint]
    force = np.asarray(run.reaction(joint).magnitude)
    rates = [
        np.zeros(len(run)) if body == "ground" else np.asarray(run[body].omega)
        for body in (element.i.body, element.j.body)
    ]
    speed = np.abs(rates[1] - rates[0])
    cycle = float(run.t[-1] - run.t[0])
    travel = float(np.trapezoid(speed, run.t))
    size = float(force.max())
    shares = (force / size) ** exponent if size else force
    in_time = size * (float(np.trapezoid(shares, run.t)) / cycle) ** (1.0 / exponent)
    equivalent = in_time
    if travel > 0.0:
        equivalent = size * (float(np.trapezoid(shares * speed, run.t)) / travel) ** (1 / exponent)
    life = time = None
    if rating is not None:
        capacity = number_in(run.mechanism, rating, "force", joint, "rating")
        if not capacity > 0.0:
            raise ModelError(f"the rating of bearing '{joint}' is above 0, not {capacity:g}", joint)
        life = 1e6 * (capacity / equivalent) ** exponent if equivalent else math.inf
        time = life * REVOLUTION * cycle / travel if travel else math.inf
    mean = float(np.trapezoid(force, run.t)) / cycle
    return BearingLoad(
        force,
        speed,
        equivalent,
        in_time,
        size,
        mean,
        travel / REVOLUTION,
        cycle,
        exponent,
        life,
        time,
        run.t,
        **inherited(run),
    )
