"""The indicator diagram of a cylinder, and the flow through its valves."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from mbody.core.presentation import Presented
from mbody.errors import ModelError, brief
from mbody.model.element import listed
from mbody.model.loads import ReciprocatingCylinder
from mbody.solution.declared_result import Heading, Value
from mbody.solution.doubts import Inherited, inherited
from mbody.solution.histories import one_design
from mbody.solution.solution import Solution, as_solution

Array = np.ndarray


def _extreme(key: str, of: Callable[[Array], Any]) -> Callable[[Any], float]:
    return lambda found: float(of(getattr(found, key)))


@dataclass(frozen=True, eq=False, repr=False)
class Indicator(Inherited, Presented):
    """Histories of a chamber: arrays (instants,).

    Attributes
    ----------
    volume, rate : arrays (instants,)
        Clearance included [length³], and its rate [length³/time].
    pressure : array (instants,)
        Gauge pressure [force/area].
    delivery, suction : arrays (instants,)
        Flow out through the valve of delivery and in through that of suction [length³/time]; zero
        while they are shut.
    power : array (instants,)
        −p V̇, the power of the piston on the fluid in the chamber [power].
    run : Solution
        Whose it is.

    Examples
    --------
    >>> import mbody
    >>> run = mbody.kinetostatics(mbody.gallery.load("mud_pump"), turn=True)
    >>> chart = mbody.engineering.indicator(run, "cylinder1")
    >>> chart.pressure.shape, bool((chart.delivery >= 0.0).all())
    ((361,), True)
    """

    volume: Array
    rate: Array
    pressure: Array
    delivery: Array
    suction: Array
    power: Array
    run: Any

    about_text = "a chamber at {0.span}"
    declared = (
        Heading("INDICATOR"),
        Value("least_volume", "least volume", "volume", _extreme("volume", np.min)),
        Value("greatest_volume", "greatest volume", "volume", _extreme("volume", np.max)),
        Value("least_pressure", "least pressure", "pressure", _extreme("pressure", np.min)),
        Value("greatest_pressure", "greatest pressure", "pressure", _extreme("pressure", np.max)),
        Value("delivered", "delivered", "volume", lambda found: found.over_time(found.delivery)),
        Value("taken_in", "taken in", "volume", lambda found: found.over_time(found.suction)),
        Value("work", "work on the fluid", "torque", lambda found: found.over_time(found.power)),
    )

    @property
    def span(self) -> str:
        """The instants."""
        t, unit = self.run.t, self.run.mechanism.units.time
        return f"t = {t[0]:.6g}" + (f" … {t[-1]:.6g} {unit}" if len(t) > 1 else f" {unit}")

    def over_time(self, rate: Array) -> float | None:
        """What a rate makes in all; None of one instant."""
        return float(np.trapezoid(rate, self.run.t)) if len(self.run) > 1 else None

    def __repr__(self) -> str:
        return f"Indicator({len(self.volume)} instants, up to {self.pressure.max():.6g})"


def indicator(run: Solution, cylinder: str, *, opposite: bool = False) -> Indicator:
    """Indicator diagram of a `ReciprocatingCylinder`: pressure, volume, flow through its valves.

    V = A h,  flow = −V̇ where p = p_delivery, V̇ where p = p_suction

    Parameters
    ----------
    run : Solution
        Of one design, from any analysis with velocities.
    cylinder : str
        Name of the load.
    opposite : bool
        Whether to use the chamber on the other side of a double-acting piston.

    Returns
    -------
    Indicator
        Histories at the instants of the run.

    Raises
    ------
    ModelError
        For a load of another type, a missing side, or a batch.

    Examples
    --------
    >>> import mbody
    >>> machine = mbody.makers.slider_crank(1, 4, speed=10.0)
    >>> machine.add(
    ...     ReciprocatingCylinder(
    ...         "cylinder", "ground", "slider.B", area=0.5, near=5.0, far=3.0, clearance=0.1,
    ...         delivery=2.0, bulk_modulus=100.0
    ...     )
    ... )
    >>> found = indicator(mbody.kinetostatics(machine, turn=True), "cylinder")
    >>> round(float(found.pressure.max()), 9), bool(found.delivery.max() > 0.0)
    (2.0, True)
    """
    run = as_solution(run)
    known = [load.name for load in run.mechanism.loads if isinstance(load, ReciprocatingCylinder)]
    if cylinder not in known:
        raise ModelError(
            f"there is no cylinder with valves {brief(cylinder)} (there are: {listed(known)})"
        )
    one_design(run, f"the diagram of '{cylinder}' is of one design", cylinder)
    load = run.mechanism[cylinder]
    assert isinstance(load, ReciprocatingCylinder)
    if opposite and load.opposite_area is None:
        raise ModelError(
            f"'{cylinder}' is single-acting, it has no opposite side: give it an opposite_area",
            cylinder,
        )
    values = run.system.values
    now: dict[str, Any] = {
        field.name: float(values[f"{cylinder}.{field.name}"])
        for field in dataclasses.fields(load)
        if "dimension" in field.metadata and getattr(load, field.name) is not None
    }
    load = dataclasses.replace(load, **now)
    first, second, body = run.point(load.i), run.point(load.j), run[load.i.body]
    angle = body.angle + run.system.numbers.angle(load, "i")
    ux, uy = np.cos(angle), np.sin(angle)
    dx, dy = second.x - first.x, second.y - first.y
    vx, vy = second.vx - first.vx, second.vy - first.vy
    place = ux * dx + uy * dy
    speed = ux * vx + uy * vy + body.omega * (ux * dy - uy * dx)
    head, crank_end = (load.far, load.near) if opposite else (load.near, load.far)
    area = float((load.opposite_area if opposite else load.area) or 0.0)
    sign = 1.0 if crank_end > head else -1.0
    volume = area * (load.clearance + sign * (place - head))
    rate = area * sign * speed
    pairs = zip(place.tolist(), speed.tolist(), strict=True)
    pressure = np.array([load.pressure(*pair, opposite=opposite) for pair in pairs])
    out = np.where((pressure >= load.delivery) & (rate < 0.0), -rate, 0.0)
    into = np.where((pressure <= load.suction) & (rate > 0.0), rate, 0.0)
    power = -pressure * rate
    return Indicator(volume, rate, pressure, out, into, power, run, **inherited(run))
