"""Orders of shaking force and moment, and the shafts that balance an order."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from mbody.engineering.cycles import check_repeats, cycle_turns
from mbody.engineering.fluctuation import angle_driver
from mbody.engineering.harmonics import complex_orders, driver_cycle, place_of
from mbody.engineering.shaking import shaking_force
from mbody.errors import ModelError
from mbody.model.element import Marker
from mbody.sheets.text_table import Column, number, numbers, table
from mbody.solution.doubts import Inherited, inherited
from mbody.solution.solution import Solution, as_solution
from mbody.system.read_only import lock

__all__ = ["BalanceShaft", "ShakingOrders", "balance_shafts", "shaking_orders"]

Array = np.ndarray

#: Of all forces on the frame and of all inertia forces, what is printed as zero and needs no shaft.
ROUNDING = 1e-9
#: Orders that are found unless the caller says how many.
ORDERS = 8.0
#: A rate that changes by more than this part of its mean is no constant speed.
STEADY = 1e-9


@dataclass(frozen=True, eq=False, repr=False)
class ShakingOrders(Inherited):
    """Shaking force and moment by order of the driver.

    The force of an order n is forward·e^{inθ} + backward·e^{−inθ}, fx + i fy: a vector that turns
    with the driver n times as fast, and one that turns against it.

    Attributes
    ----------
    orders : array (orders,)
        From 0, the mean, on.
    forward, backward : complex arrays (orders,)
        [force]; the mean is in `forward`.
    fx, fy, moment : arrays (orders,)
        Amplitudes [force], [force], [force·length].
    force : array (orders,)
        The greatest magnitude of the order's force, |forward| + |backward|.
    peak : tuple of 2 floats
        Of force and moment over the cycle.
    size : float
        Of all forces that the sums are made of: what is rounding is judged beside it [force].
    folding : float
        As of `Harmonics`, of the force.
    turns : int
    run : Solution

    Examples
    --------
    >>> import mbody
    >>> rotor = mbody.Mechanism("rotor")
    >>> rotor.add(mbody.Body("wheel", mass=2.0, cg=(0.1, 0.0)))
    >>> rotor.add(mbody.Revolute("O", "ground", "wheel"))
    >>> rotor.add(mbody.AngleDriver("motor", "wheel", mbody.laws.ConstantSpeed(0.0, 10.0)))
    >>> found = mbody.engineering.shaking_orders(mbody.kinetostatics(rotor, turn=True))
    >>> round(float(found.force[1]), 9)  # m e ω², which turns with the wheel
    20.0
    """

    orders: Array
    forward: Array
    backward: Array
    fx: Array
    fy: Array
    moment: Array
    force: Array
    peak: tuple[float, float]
    size: float
    folding: float
    turns: int
    run: Any

    def __post_init__(self) -> None:
        lock(self)

    def of(self, order: float) -> float:
        """The greatest magnitude of the force of an order [force].

        Raises
        ------
        ModelError
            For an order that there is not.
        """
        return float(self.force[self.place(order)])

    def place(self, order: float) -> int:
        """Which of the arrays' entries an order is.

        Raises
        ------
        ModelError
            For an order that there is not.
        """
        return place_of(order, self.orders, self.turns)

    def data(self) -> dict[str, Any]:
        """As plain values, ready for JSON; complex numbers as pairs."""
        pairs = {
            key: [[float(c.real), float(c.imag)] for c in getattr(self, key)]
            for key in ("forward", "backward")
        }
        rows = {k: getattr(self, k).tolist() for k in ("orders", "fx", "fy", "moment", "force")}
        return {
            **rows,
            **pairs,
            "peak": {"force": self.peak[0], "moment": self.peak[1]},
            "turns": self.turns,
        }

    def __str__(self) -> str:
        unit = self.run.mechanism.units
        floor = ROUNDING * self.size
        arm = floor * self.run.system.length
        shown = [
            k
            for k in range(len(self.orders))
            if self.force[k] > floor or self.moment[k] > arm or self.orders[k] in (1.0, 2.0)
        ]
        columns = [Column("ORDER", [f"{self.orders[k]:g}" for k in shown])]
        for title, values, least, of in (
            ("fx", self.fx, floor, unit.force),
            ("fy", self.fy, floor, unit.force),
            ("with it", np.abs(self.forward), floor, unit.force),
            ("against it", np.abs(self.backward), floor, unit.force),
            ("moment", self.moment, arm, unit.of("torque")),
        ):
            columns.append(Column(title, numbers(values[shown], least), of))
        force, moment = (
            part if part > least else 0.0
            for part, least in zip(self.peak, (floor, arm), strict=True)
        )
        peak = (
            f"greatest shaking force {number(force)} {unit.force}, moment {number(moment)} "
            f"{unit.of('torque')}"
        )
        return "\n".join([self.run.mechanism.name, "", *table(columns), "", peak])


@dataclass(frozen=True)
class BalanceShaft:
    """A shaft with an unbalance, which takes away a part of the shaking force.

    Attributes
    ----------
    order : float
        Its speed as a multiple of the driver's.
    sense : int
        1 with the driver, −1 against it.
    unbalance : float
        Mass times radius [mass·length].
    angle : float
        Direction of the unbalance from the world's x axis where the driver is at 0 [rad].
    force : float
        Its centrifugal force at the speed of the run [force].

    Examples
    --------
    >>> import mbody
    >>> engine = mbody.makers.slider_crank(1, 4, masses=(0, 0, 2), speed=10.0)
    >>> run = mbody.kinetostatics(engine, turn=True)
    >>> shaft = mbody.engineering.balance_shafts(run, [1])[0]
    >>> shaft.order, round(shaft.force, 9)
    (1.0, 100.0)
    """

    order: float
    sense: int
    unbalance: float
    angle: float
    force: float


def shaking_orders(
    run: Solution,
    about: Marker | str = "ground",
    driver: str | None = None,
    highest: float = ORDERS,
) -> ShakingOrders:
    """Shaking force and shaking moment by order of a driver: primary, secondary, … of an engine.

    Parameters
    ----------
    run : Solution
        Of kinetostatics, at equal angles over whole turns, both ends included; a four-stroke cycle
        has two (``turn=True, turns=2``) and half orders.
    about : Marker or str
        Place on the ground about which the moment is taken.
    driver : str, optional
        Name of the driver of an angle; by default the only one.
    highest : float
        The last order.

    Returns
    -------
    ShakingOrders

    Raises
    ------
    ModelError
        As of `shaking_force` and `harmonics`.

    Notes
    -----
    Any mechanism has orders; an engine in line is drawn with all its cylinders in one plane. What
    their distance along the shaft does is `rocking_couple`.

    Source: R. L. Norton, *Design of Machinery*, chapters 13 and 14.

    Examples
    --------
    >>> import mbody
    >>> engine = mbody.makers.slider_crank(1, 4, masses=(0, 0, 1), speed=1.0)
    >>> found = shaking_orders(mbody.kinetostatics(engine, turn=True))
    >>> found.fx[:3].round(6)
    array([0.      , 1.      , 0.254025])
    """
    run = as_solution(run)
    angle = driver_cycle(run, driver)
    shaking = shaking_force(run, about)
    turns = cycle_turns(angle, "a shaking order")
    force = np.asarray(shaking.fx + 1j * shaking.fy)
    size = _size(run)
    check_repeats(force.real, size, "shaking force (x)", "a shaking order")
    check_repeats(force.imag, size, "shaking force (y)", "a shaking order")
    check_repeats(shaking.moment, size * run.system.length, "shaking moment", "a shaking order")
    orders, both, folding = complex_orders(angle, force, turns, highest)
    count = (orders.size + 1) // 2
    forward, backward = both[:count], np.concatenate([[0.0], both[:0:-1][: count - 1]])
    x, y, moment = (
        _amplitudes(angle, part, turns, highest)
        for part in (force.real, force.imag, shaking.moment)
    )
    return ShakingOrders(
        orders[:count],
        forward,
        backward,
        x,
        y,
        moment,
        np.abs(forward) + np.abs(backward),
        (float(shaking.magnitude.max()), float(np.abs(shaking.moment).max())),
        size,
        folding,
        turns,
        run,
        **inherited(run),
    )


def _amplitudes(angle: Array, values: Array, turns: int, highest: float) -> Array:
    found = 2.0 * np.abs(complex_orders(angle, values, turns, highest)[1])
    found[0] *= 0.5
    return found


def _size(run: Solution) -> float:
    """The greatest of the inertia forces and joint forces, summed without their directions."""
    forces = [np.hypot(*run.inertia(body.name)[:2]) for body in run.mechanism.bodies]
    forces += [run.reaction(joint.name).magnitude for joint in run.mechanism.joints]
    return float(np.sum(forces, axis=0).max()) if forces else 0.0


def balance_shafts(
    run: Solution, orders: Sequence[float] = (1.0, 2.0), driver: str | None = None
) -> tuple[BalanceShaft, ...]:
    """Balance shafts for orders of the shaking force of any mechanism: Lanchester's shafts.

    The part c e^{inθ} of the force is taken away by a shaft that turns n times as fast, with
    m r (nω)² = |c| opposite to it; a part that turns against the driver by a shaft that does so.

    Parameters
    ----------
    run : Solution
        As of `shaking_orders`, at a constant speed of the driver.
    orders : sequence of float
        Which orders.
    driver : str, optional
        Name of the driver of an angle; by default the only one.

    Returns
    -------
    tuple of BalanceShaft
        None where an order has no force. Two at equal forces balance a force along one line; their
        resultant goes through the middle between their axes.

    Raises
    ------
    ModelError
        As of `shaking_orders`; at rest; for an order that there is not.

    Notes
    -----
    A shaft of order 1 in the sense of the driver is a counterweight on the driver's own shaft. All
    forces on the frame are counted, weights too, whose mean no shaft takes away.

    Source: R. L. Norton, *Design of Machinery*, section 14.7 (secondary balancing in the four-
    cylinder inline engine).

    Examples
    --------
    >>> import mbody
    >>> engine = mbody.makers.slider_crank(1, 4, masses=(0, 0, 2), speed=10.0)
    >>> for shaft in balance_shafts(mbody.kinetostatics(engine, turn=True), [1]):
    ...     print(shaft.sense, round(shaft.unbalance, 9))
    1 1.0
    -1 1.0
    """
    run = as_solution(run)
    name = angle_driver(run, driver)
    highest = max((float(order) for order in orders), default=1.0)
    found = shaking_orders(run, driver=name, highest=max(highest, 1.0))
    rate = np.asarray(run.driven(name)[1])
    speed = float(np.mean(rate))
    if not speed or np.ptp(rate) > STEADY * abs(speed):
        raise ModelError(
            f"balance shafts are for a constant speed, '{name}' has {rate.min():g} to "
            f"{rate.max():g} rad/s: give its law a constant speed",
            name,
        )
    shafts = []
    for order in orders:
        places = np.flatnonzero(np.abs(found.orders - order) < 1e-9)
        if not places.size or not order > 0:
            raise ModelError(
                f"there is no shaft of order {order:g}: orders of this cycle are multiples of "
                f"{1.0 / found.turns:g}, above 0"
            )
        for sense, parts in ((1, found.forward), (-1, found.backward)):
            part = complex(parts[places[0]])
            if abs(part) > ROUNDING * found.size:
                unbalance = abs(part) / (order * speed) ** 2
                angle = float(np.angle(-part))
                shafts.append(BalanceShaft(float(order), sense, unbalance, angle, abs(part)))
    return tuple(shafts)
