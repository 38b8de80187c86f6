"""A motor with its gear against what a driver asks of it: speed, peak torque, heat."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from mbody.core.presentation import Presented
from mbody.core.tolerances import LIMIT_EXCEEDED, RATE_NONE
from mbody.engineering.flywheel import angle_driver, link_energy
from mbody.errors import ModelError, brief
from mbody.model.element import listed
from mbody.model.loads import ReciprocatingCylinder
from mbody.model.numbers import number_in
from mbody.quantities.formula import Number
from mbody.solution.declared_result import Heading, Sentence, Value
from mbody.solution.doubts import Inherited, inherited
from mbody.solution.histories import one_design
from mbody.solution.known_forces import inherits
from mbody.solution.solution import Solution, as_solution
from mbody.summaries.text_table import numbers

# -- The indicator diagram of a cylinder, and the flow through its valves ----------------------

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


#: The rows of a motor's curve, and what they measure.
ROWS = {"speed": "angular velocity", "peak": "torque", "continuous": "torque"}


@dataclass(frozen=True)
class MotorCurve:
    """A motor as its data sheet has it.

    Parameters
    ----------
    speed : sequence of float or str
        Speeds of the curve, from 0 to the greatest that is allowed [rad/time].
    peak : sequence of float or str
        The greatest torque at these speeds [force·length]; straight lines between them.
    continuous : sequence of float or str
        The torque that may last, of which the motor grows as hot as it may.
    inertia : float or str
        Of its rotor [mass·length²].

    Examples
    --------
    >>> motor = MotorCurve(["0 rpm", "3000 rpm"], ["6 N*m", "6 N*m"], ["2 N*m", "1.6 N*m"])
    >>> motor.inertia
    0.0
    """

    speed: Sequence[Number]
    peak: Sequence[Number]
    continuous: Sequence[Number]
    inertia: Number = 0.0


@dataclass(frozen=True, eq=False, repr=False)
class MotorSizing(Inherited, Presented):
    """Torques and speeds required of a motor, and how much of its limits they use.

    Attributes
    ----------
    ratio : float
        Speed of the motor by that of the driven body.
    rms, peak : float
        Root of the mean square and greatest size of its torque [force·length]; the mean is over
        motion and rest.
    rms_speed, top_speed : float
        The same of its speed [rad/time], of the mean too.
    inertia_ratio : float
        Mean inertia that it feels from the load, by its own; infinite without one of its own.
    used : dict
        The share of each limit that is used: "speed" of the top speed, "peak" of the peak torque at
        the speed where it is nearest, "thermal" of the continuous torque at the rms speed.
    active : str
        The limit of which most is used.
    best_ratio : float
        With the least rms torque; infinite or zero where the torque falls all the way.
    speed, torque : arrays (instants,)
        Of the motor.
    run : Solution
    driver : str

    >>> import mbody
    >>> machine = mbody.makers.four_bar(1, 3, 2, 3.5, masses=(1, 3, 2), speed=9.0)
    >>> run = mbody.kinetostatics(machine, turn=True)
    >>> found = motor_sizing(run, MotorCurve([0.0, 300.0], [9.0, 9.0], [3.0, 2.0]), ratio=20.0)
    >>> round(found.top_speed, 6), found.rms < found.peak
    (180.0, True)
    """

    ratio: float
    rms: float
    peak: float
    rms_speed: float
    top_speed: float
    inertia_ratio: float
    used: dict[str, float]
    active: str
    best_ratio: float
    speed: Array
    torque: Array
    run: Any
    driver: str

    analysis_name = "motor"
    about_text = "driver '{0.driver}'"
    declared = (
        Heading("MOTOR"),
        Value("driver"),
        Value("ratio", "gear ratio"),
        Value("best_ratio", "ratio of least rms torque"),
        Value("rms", "rms torque, rest included", "torque"),
        Value("peak", "greatest torque", "torque"),
        Value("rms_speed", dimension="angular velocity"),
        Value("top_speed", "greatest speed", "angular velocity"),
        Value("inertia_ratio", "inertia of the load by the motor's own", missing="infinite"),
        Value("used", "{} limit used", "share"),
        Value("active"),
        Value("suffices"),
        Sentence(
            lambda found: (
                f"it {'suffices' if found.suffices else 'does not suffice'}: the "
                f"{found.active} limit is nearest"
            )
        ),
    )

    @property
    def suffices(self) -> bool:
        """Whether no limit is exceeded."""
        return self.used[self.active] <= 1.0

    def __repr__(self) -> str:
        return f"MotorSizing({numbers([self.used[self.active]])[0]} of its {self.active} limit)"


@inherits
def motor_sizing(
    run: Solution,
    motor: MotorCurve,
    driver: str | None = None,
    *,
    ratio: float | None = None,
    efficiency: float = 1.0,
    rest: Number = 0.0,
) -> MotorSizing:
    """A motor and a gear for a driver: rms and peak torque, inertia ratio, and the limit that is
    nearest.

    T = J i α + τ/(i η) where it drives, J i α + τ η/i where it is driven

    Parameters
    ----------
    run : Solution
        Of kinetostatics over the cycle of work.
    motor : MotorCurve
    driver : str, optional
        Name of the driver of an angle; by default the only one.
    ratio : float, optional
        Speed of the motor by that of the driver; by default that of the least rms torque, as far as
        the motor's top speed lets it be.
    efficiency : float
        Of the gear, η, above 0 and at most 1.
    rest : float or str
        How long the motor stands without torque after each cycle [time]: the duty cycle.

    Returns
    -------
    MotorSizing

    Raises
    ------
    ModelError
        For one instant, a batch, a motor that is none, a ratio at which the motor would turn faster
        than its curve goes, or a driver that does not move.

    Notes
    -----
    Heat goes with the square of the torque, and the motor's time constants are long beside a
    cycle: its rms torque is held against what it may give for ever at its rms speed. Without losses
    the least rms torque is at i* = √(rms τ/(J rms α)).

    Source: design of servo drives, such as M. Budinger et al., or any maker's catalogue.

    Examples
    --------
    >>> import mbody
    >>> machine = mbody.makers.four_bar(1, 3, 2, 3.5, masses=(1, 3, 2), speed=3.0)
    >>> run = mbody.kinetostatics(machine, turn=True)
    >>> motor = MotorCurve([0.0, 300.0], [9.0, 9.0], [3.0, 2.0], inertia=1e-4)
    >>> found = motor_sizing(run, motor, ratio=50.0)
    >>> found.active, found.suffices
    ('speed', True)
    """
    run = as_solution(run)
    if not run.has_forces:
        raise ModelError(f"{run.analysis} finds no torques: a motor is sized by kinetostatics")
    one_design(run, "a motor is sized for one design")
    name = angle_driver(run, driver)
    if len(run) < 2 or not np.ptp(run.t) > 0.0:
        raise ModelError(
            "a motor is sized over a cycle of time, this is one instant: analyse a turn, or "
            "several times"
        )
    if not 0.0 < float(efficiency) <= 1.0:
        raise ModelError(f"the efficiency of a gear is above 0 and at most 1, not {efficiency!r}")
    curve = _curve(run, motor)
    pause = number_in(run.mechanism, rest, "time", name, "rest")
    if not pause >= 0.0:
        raise ModelError(
            f"driver '{name}': the rest after a cycle is a time from 0 on, not {pause:g}", name
        )
    load = _Load(run, name, curve.inertia, float(efficiency), pause)
    top = float(np.abs(load.omega).max())
    if not top > 0.0:
        raise ModelError(f"driver '{name}' does not move: a motor is sized for a motion", name)
    best = load.best_ratio()
    limit = float(curve.speed[-1]) / top
    chosen = min(best, limit) if ratio is None else float(ratio)
    if not chosen > 0.0 or not math.isfinite(chosen):
        raise ModelError(
            f"driver '{name}': a gear ratio is above 0, not {chosen:g}: give one", name
        )
    if chosen > limit * (1.0 + LIMIT_EXCEEDED):
        unit = f"rad/{run.mechanism.units.time}"
        raise ModelError(
            f"with the ratio {chosen:g} the motor would turn at up to {chosen * top:.6g} {unit}, "
            f"its curve ends at {curve.speed[-1]:.6g} {unit}: the ratio is at most {limit:.6g}",
            name,
        )
    speed, torque = chosen * load.omega, load.torque(chosen)
    rms, rms_speed = load.rms(torque), load.rms(speed)
    at = np.abs(speed)
    used = {
        "speed": chosen * top / float(curve.speed[-1]),
        "peak": float((np.abs(torque) / np.interp(at, curve.speed, curve.peak)).max()),
        "thermal": rms / float(np.interp(rms_speed, curve.speed, curve.continuous)),
    }
    reflected = load.inertia / chosen**2
    return MotorSizing(
        chosen,
        rms,
        float(np.abs(torque).max()),
        rms_speed,
        chosen * top,
        reflected / curve.inertia if curve.inertia else math.inf,
        used,
        max(used, key=lambda key: used[key]),
        best,
        speed,
        torque,
        run,
        name,
        **inherited(run),
    )


@dataclass(frozen=True)
class _CurveNumbers:
    """A motor's curve in numbers."""

    speed: Array
    peak: Array
    continuous: Array
    inertia: float


def _curve(run: Solution, motor: MotorCurve) -> _CurveNumbers:
    """The numbers of a curve in the units of the mechanism."""
    if not isinstance(motor, MotorCurve):
        raise ModelError(f"a motor is MotorCurve(speed, peak, continuous), not {motor!r}")
    rows = {}
    for key, dimension in ROWS.items():
        values = getattr(motor, key)
        rows[key] = np.array(
            [number_in(run.mechanism, v, dimension, "motor", key) for v in values], dtype=float
        )
    sizes = {key: len(row) for key, row in rows.items()}
    if len(set(sizes.values())) > 1 or sizes["speed"] < 2:
        raise ModelError(
            f"a motor's curve has as many speeds as torques, two or more, not {sizes['speed']}, "
            f"{sizes['peak']} and {sizes['continuous']}"
        )
    speed = rows["speed"]
    if speed[0] != 0.0 or not (np.diff(speed) > 0.0).all():
        raise ModelError("the speeds of a motor's curve rise from 0 on: sort the points")
    if not min(rows["peak"].min(), rows["continuous"].min()) > 0.0:
        raise ModelError(
            "the torques of a motor's curve are above 0: end it at a speed where there is some"
        )
    inertia = number_in(run.mechanism, motor.inertia, "inertia", "motor", "inertia")
    if not inertia >= 0.0:
        raise ModelError(f"the inertia of a motor is not negative: {inertia:g}")
    return _CurveNumbers(speed, rows["peak"], rows["continuous"], inertia)


class _Load:
    """Torque and speed that a driver requires of its motor, over time."""

    def __init__(
        self, run: Solution, name: str, inertia: float, efficiency: float, pause: float
    ) -> None:
        _, omega, alpha = (np.asarray(part, dtype=float) for part in run.driven(name))
        self.t, self.omega, self.alpha = run.t, omega, alpha
        self.effort = np.asarray(run.effort(name), dtype=float)
        self.own, self.efficiency = inertia, efficiency
        self.whole = float(run.t[-1] - run.t[0]) + pause
        # kinetic energy at unit rate, twice: the inertia that the driver feels
        still = np.abs(omega) > RATE_NONE * np.abs(omega).max(initial=0.0)
        felt = 2.0 * link_energy(run)[still] / omega[still] ** 2
        self.inertia = float(felt.mean()) if felt.size else 0.0

    def torque(self, ratio: float) -> Array:
        """Of the motor: the gear's losses are its own where it drives, else the load's."""
        driving = self.effort * self.omega >= 0.0
        through = np.where(driving, 1.0 / self.efficiency, self.efficiency)
        return np.asarray(self.own * ratio * self.alpha + self.effort * through / ratio)

    def rms(self, values: Array) -> float:
        """Root of the mean square over motion and rest."""
        return math.sqrt(float(np.trapezoid(values**2, self.t)) / self.whole)

    def best_ratio(self) -> float:
        """With the least rms torque: J² i² ⟨α²⟩ + 2 J ⟨α τ⟩ + ⟨τ²⟩/i²."""
        carried = self.rms(self.torque(1.0) - self.own * self.alpha)
        rotor = self.own * self.rms(self.alpha)
        return math.sqrt(carried / rotor) if rotor > 0.0 else math.inf
