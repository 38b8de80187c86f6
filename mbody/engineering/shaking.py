"""The shaking force and moment of a mechanism on its frame."""

from __future__ import annotations

import functools
import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt

from mbody.analysis.driven.free_body import acting_on_several, coupled, driven
from mbody.core import tolerances as tol
from mbody.core.presentation import Presented
from mbody.core.tolerances import HARMONICS_FOLDED, HARMONICS_ORDER_SAME, HARMONICS_STEPS_EQUAL
from mbody.engineering.flywheel import angle_driver, check_repeats, counted, cycle_revolutions
from mbody.errors import ModelError, brief
from mbody.model.driver import Driver
from mbody.model.element import Marker, as_marker, unknown_name, whole_number
from mbody.model.numbers import number_in
from mbody.model.simulation import Measure
from mbody.quantities.formula import Number
from mbody.solution.checks import loaded
from mbody.solution.contact_forces import acting_contacts
from mbody.solution.declared_result import (
    ColumnTable,
    Heading,
    ItemTable,
    Sentence,
    Value,
    data_only,
)
from mbody.solution.doubts import Inherited, inherited
from mbody.solution.histories import one_design, reaction_torque
from mbody.solution.known_forces import inherits
from mbody.solution.solution import Solution, as_solution

# -- Harmonics of a quantity over whole cycles, by order of a driver ---------------------------

Array = np.ndarray

#: Orders are known up to this part of the number of instants: those above fold into them.
KNOWN = 4


class Orders(Inherited):
    """Base of what is known by orders of a driver."""

    orders: Array
    turns: int

    def place(self, order: float) -> int:
        """Which of the arrays' entries an order is.

        Raises
        ------
        ModelError
            For an order that there is not.
        """
        found = np.flatnonzero(np.abs(self.orders - order) < HARMONICS_ORDER_SAME)
        if not found.size:
            parts = f"multiples of 1/{self.turns}" if self.turns > 1 else "whole numbers"
            raise ModelError(
                f"there is no order {order:g} of a cycle of {counted(self.turns)}: orders are "
                f"{parts} up to {self.orders[-1]:g}"
            )
        return int(found[0])


@dataclass(frozen=True, eq=False)
class Harmonics(Orders):
    """A quantity over whole cycles as a sum of harmonics of the driver's angle θ.

    y(θ) = mean + Σ (cosine cos nθ + sine sin nθ),  n the orders;  each is
    amplitude · cos(nθ − phase).

    Attributes
    ----------
    orders : array (orders,)
        Multiples of the driver's speed; of a cycle of two revolutions in halves.
    cosine, sine, amplitude, phase : arrays (orders,)
        In the unit of the quantity; the phase in rad.
    mean : float
        The order 0.
    turns : int
        Of the cycle.
    folding : float
        How much an amplitude changes at most when every second instant is left out: an upper
        estimate of what higher orders add to these by the finite number of instants.
    status, doubts, notes
        As of `Inherited`: those of the result.

    >>> theta = np.linspace(0.0, 2.0 * np.pi, 73)
    >>> round(harmonics(theta, 3.0 * np.cos(2.0 * theta - 0.5)).of(2), 12)
    3.0
    """

    orders: Array
    cosine: Array
    sine: Array
    amplitude: Array
    phase: Array
    mean: float
    turns: int
    folding: float

    def of(self, order: float) -> float:
        """The amplitude of an order; cosine and sine are at `place(order)`.

        Raises
        ------
        ModelError
            For an order that there is not.
        """
        return float(self.amplitude[self.place(order)])


@inherits
def harmonics(
    run: Solution | npt.ArrayLike,
    of: str | Measure | npt.ArrayLike,
    driver: str | None = None,
    highest: float | None = None,
) -> Harmonics:
    """Harmonics by order of a driver: Fourier series, order analysis.

    y(θ) = mean + Σ (a_n cos nθ + b_n sin nθ), θ the angle of the driver itself, not from the first
    instant on.

    Parameters
    ----------
    run : Solution or array (instants,)
        At equal angles over one or more whole revolutions, both ends included, as of ``turn=True,
        turns=2``; or such angles [rad].
    of : str, Measure or array (instants,)
        A formula of measured quantities such as ``"O.fx"``, or values.
    driver : str, optional
        Name of the driver of an angle; by default the only one.
    highest : float, optional
        The last order; by default a quarter of the instants of a revolution.

    Returns
    -------
    Harmonics

    Raises
    ------
    ModelError
        For cycles that do not close, angles that are not in equal steps, or orders for which the
        instants do not suffice.

    Notes
    -----
    The sums over equal steps of a periodic function are exact but for orders above half of the
    instants, which fold into lower ones; `folding` estimates them by leaving out every second
    instant.

    Examples
    --------
    >>> import mbody
    >>> engine = mbody.makers.slider_crank(1, 4, masses=(0, 0, 1), speed=1.0)
    >>> found = harmonics(mbody.kinetostatics(engine, turn=True), "slider.ax")
    >>> [round(found.of(n), 6) for n in (1, 2, 3, 4)]
    [1.0, 0.254025, 0.0, 0.004098]
    """
    more: dict[str, Any] = {}
    if isinstance(run, Solution):
        angle = driver_cycle(run, driver)
        measured = isinstance(of, str | Measure)
        values = run.measure(of) if measured else np.asarray(of, dtype=float)  # type: ignore[arg-type]
        more = inherited(run)
        name = "quantity" if not isinstance(of, str) else f"value of {of}"
    else:
        angle, values, name = np.asarray(run, float), np.asarray(of, float), "quantity"
    if values.shape != angle.shape:
        raise ModelError(
            f"harmonics of {values.shape} values at {angle.shape} angles: give one value an instant"
        )
    revolutions = cycle_revolutions(angle, "a harmonic")
    check_repeats(values, float(np.abs(values).max()), name, "a harmonic")
    orders, found, folding = complex_orders(angle, values, revolutions, highest)
    parts = 2.0 * found[1:]
    notes = (*more.pop("notes", ()), *_notes(folding, float(np.abs(parts).max(initial=0.0))))
    return Harmonics(
        orders[1:],
        parts.real,
        -parts.imag,
        np.abs(parts),
        -np.angle(parts),
        float(found[0].real),
        revolutions,
        folding,
        notes=notes,
        **more,
    )


def _notes(folding: float, greatest: float) -> tuple[str, ...]:
    if folding <= HARMONICS_FOLDED * greatest:
        return ()
    return (
        f"harmonics: leaving out every second instant changes an amplitude by {folding:.2g}: "
        "take more instants",
    )


def driver_cycle(run: Solution, driver: str | None) -> Array:
    """The angles of a driver (instants,) of a result of one design."""
    run = as_solution(run)
    one_design(run, "harmonics are of one design")
    return np.asarray(run.driven(angle_driver(run, driver))[0], dtype=float)


def complex_orders(
    angle: Array, values: Array, revolutions: int, highest: float | None
) -> tuple[Array, Array, float]:
    """Orders n = 0, 1/turns, … and the c_n of Σ c_n exp(i n θ), of real values those of n ≥ 0,
    of complex ones (instants,) all, with the change by leaving out every second instant.
    """
    count = angle.size - 1
    equal = np.linspace(angle[0], angle[-1], angle.size)
    off = float(np.abs(angle - equal).max())
    if off > HARMONICS_STEPS_EQUAL * abs(equal[1] - equal[0]):
        raise ModelError(
            f"harmonics need equal steps of the driver's angle, these are off by up to "
            f"{np.degrees(off):.3g} deg: analyse with turn=True"
        )
    last = count // KNOWN if highest is None else round(highest * revolutions)
    if not 1 <= last <= count // KNOWN:
        raise ModelError(
            f"{count} instants of {counted(revolutions)} show orders up to "
            f"{count // KNOWN / revolutions:g}, not {1 if highest is None else highest:g}: "
            "take four instants a period or more"
        )
    sign = 1.0 if angle[-1] > angle[0] else -1.0
    orders = np.arange(last + 1) / revolutions
    if np.iscomplexobj(values):
        orders = np.concatenate([orders, -orders[:0:-1]])

    def sums(every: int) -> Array:
        row = values[:-1:every]
        whole = np.fft.fft(row) / row.size
        places = np.rint(sign * orders * revolutions).astype(int) % row.size
        return np.asarray(whole[places] * np.exp(-1j * orders * angle[0]))

    found = sums(1)
    folding = float(np.abs(found - sums(2)).max()) if count % 2 == 0 else 0.0
    return orders, found, 2.0 * folding


@dataclass(frozen=True, eq=False)
class ShakingForce(Inherited):
    """Resultant on the frame, world axes: arrays (instants,).

    Attributes
    ----------
    fx, fy, moment : arrays (instants,)
        Sum of the forces of joints, couplings, drivers and loads on the frame; the moment is about
        the given place.
    fx_inertia, fy_inertia, moment_inertia : arrays (instants,)
        The same by d'Alembert, from the motion: inertia forces and loads of all bodies.

    Examples
    --------
    >>> import mbody
    >>> rotor = mbody.Mechanism("rotor", ground={"O": (0.0, 0.0)})
    >>> rotor.add(mbody.Body("wheel", mass=2.0, cg=(0.1, 0.0)))
    >>> rotor.add(mbody.Revolute("O", "ground.O", "wheel"))
    >>> rotor.add(mbody.AngleDriver("motor", "wheel", "10 rad/s*t"))
    >>> found = mbody.engineering.shaking_force(mbody.kinetostatics(rotor), "ground.O")
    >>> round(float(found.fx[0]), 9)  # m e ω²
    20.0
    """

    fx: Array
    fy: Array
    moment: Array
    fx_inertia: Array
    fy_inertia: Array
    moment_inertia: Array

    @property
    def magnitude(self) -> Array:
        """√(fx² + fy²)."""
        return np.hypot(self.fx, self.fy)

    @property
    def direction(self) -> Array:
        """Angle of the force from the world's x axis, 0 … 2π [rad]."""
        return np.mod(np.arctan2(self.fy, self.fx), 2.0 * np.pi)


@inherits
def shaking_force(run: Solution, about: Marker | str = "ground") -> ShakingForce:
    """Force and moment of a mechanism on its frame: shaking force, shaking moment.

    F = Σ reactions on the ground = Σ (−m a_G) + Σ loads from outside;  M about a place likewise.

    Parameters
    ----------
    run : Solution
        Of one design, with forces.
    about : Marker or str
        Place on the ground about which the moment is taken, such as ``"ground.O2"``; by default the
        origin.

    Returns
    -------
    ShakingForce
        By the reactions, and by the motion: two independent ways, apart from the loads.

    Raises
    ------
    ModelError
        For a run without forces, a batch, or a place on a moving body.

    Notes
    -----
    Loads between a body and the ground, as the pressure on a piston and its cylinder, cancel in the
    frame. Weights and forces from outside are part of it where there are any: for the force of
    inertia alone, analyse the mechanism without them.

    Source: R. L. Norton, *Design of Machinery*, section 11.8: F_s = F21 + F41, M_s = T21 + R × F41.

    Examples
    --------
    >>> import mbody
    >>> run = mbody.kinetostatics(mbody.makers.four_bar(1, 3, 2, 3.5, masses=(1, 3, 2), speed=9.0))
    >>> found = shaking_force(run, "ground.O2")
    >>> bool(abs(found.fx - found.fx_inertia)[0] < 1e-12 * found.magnitude[0])
    True
    """
    run = as_solution(run)
    if not run.has_forces:
        raise ModelError(f"{run.analysis} computes no forces: use kinetostatics")
    one_design(run, "the shaking force is of one design")
    marker = as_marker(about, "shaking force", "about")
    if marker.body != "ground":
        raise ModelError(
            f"the shaking moment is taken about a place on the ground, not on '{marker.body}': "
            'name one such as "ground.O2"'
        )
    place = run.point(marker)
    forces = np.array([loaded(run, k).force[:, 0].reshape(-1, 3) for k in range(len(run))])
    joints = _by_joints(run, place.x, place.y) + _about(forces[:, -1], -place.x, -place.y)
    motion = _about(forces[:, -1], -place.x, -place.y)
    for n, body in enumerate(run.mechanism.bodies):
        there, inertia = run[body.name], np.column_stack(run.inertia(body.name))
        motion = motion + _about(forces[:, n] + inertia, there.x - place.x, there.y - place.y)
    return ShakingForce(*joints.T, *motion.T, **inherited(run))


def _about(force: Array, x: Array, y: Array) -> Array:
    """(Fx, Fy, T) (instants, 3) of a force at (x, y) from the reference place of the moment."""
    moment = force[:, 2] + x * force[:, 1] - y * force[:, 0]
    return np.column_stack([force[:, :2], moment])


def _by_joints(run: Solution, x: Array, y: Array) -> Array:
    """Forces of joints, couplings and drivers on the ground, (instants, 3), about (x, y)."""
    total = np.zeros((len(run), 3))
    for joint in run.mechanism.joints:
        ends = joint.i.body, joint.j.body
        if "ground" not in ends:
            continue
        force, place = run.reaction(joint.name, on="ground"), run.point(joint.j)
        torque = reaction_torque(run, joint, -force.fx, -force.fy, force.torque)
        at_place = np.column_stack([force.fx, force.fy, torque])
        total += _about(at_place, place.x - x, place.y - y)
    for contact in acting_contacts(run):
        if "ground" in contact.bodies:
            force = run.reaction(contact.name, on="ground")
            total += _about(np.column_stack([force.fx, force.fy, force.torque]), -x, -y)
    for element, bodies in acting_on_several(run):
        # internal forces have the sum zero: the ground has the opposite of the moving bodies
        if "ground" not in bodies:
            continue
        rows = np.array([coupled(run, element.name, k) for k in range(len(run))])
        for body in bodies:
            if body != "ground":
                part = rows[:, run.system.bodies[body]]
                total -= _about(part, run[body].x - x, run[body].y - y)
    for driver in run.system.independent_drivers:
        if "ground" in driver.bodies:
            total += _by_driver(run, driver, x, y)
    return total


def _by_driver(run: Solution, driver: Driver, x: Array, y: Array) -> Array:
    """Wrench of one driver on the ground, about (x, y)."""
    force = driven(run, driver.name) * (1.0 if driver.bodies[1] == "ground" else -1.0)
    if "j" not in driver.places():
        return force
    px, py = run.reaction_point(driver.name)
    return _about(force, px - x, py - y)


# -- The couple of shaking forces that act at different places along a shaft -------------------


@dataclass(frozen=True, eq=False)
class RockingCouple(Inherited):
    """A couple about axes in the plane: arrays (instants,), world axes.

    Attributes
    ----------
    x, y : arrays (instants,)
        About the x and the y axis [force·length].

    Examples
    --------
    >>> import mbody
    >>> engine = mbody.makers.slider_crank(1, 4, masses=(0, 0, 2), speed=10.0, start=0.0)
    >>> couple = mbody.engineering.rocking_couple(mbody.kinetostatics(engine), {"slider": 0.5})
    >>> round(float(abs(couple.x[0])), 9)
    0.0
    """

    x: Array
    y: Array

    @property
    def magnitude(self) -> Array:
        """√(x² + y²)."""
        return np.hypot(self.x, self.y)


def rocking_couple(run: Solution, offsets: Mapping[str, Number]) -> RockingCouple:
    """Couple of the inertia forces of bodies in parallel planes, such as cylinders in line:
    pitching and yawing couple, rocking couple.

    M_x = −Σ z F_y,  M_y = Σ z F_x,  F = −m a_G of each body, z its distance along the shaft.

    Parameters
    ----------
    run : Solution
        Of kinetostatics, or of any analysis with accelerations, of one design.
    offsets : mapping
        By body, its place along the axis out of the plane [length], numbers or text with units;
        bodies that are not named are at 0.

    Returns
    -------
    RockingCouple

    Raises
    ------
    ModelError
        For a body that there is not, a value that is no length, or a batch.

    Notes
    -----
    Where the shaking force is not zero the couple depends on the plane of z = 0. Rods and other
    bodies of a cylinder are named as its piston is. A crankshaft is one body at one z: its own
    throws are taken as balanced.

    Source: R. L. Norton, *Design of Machinery*, section 14.2.

    Examples
    --------
    >>> import mbody
    >>> engine = mbody.makers.slider_crank(1, 4, masses=(0, 0, 2), speed=10.0, start=0.0)
    >>> run = mbody.kinetostatics(engine)
    >>> round(float(rocking_couple(run, {"slider": 0.5}).y[0]), 9)
    125.0
    """
    run = as_solution(run)
    one_design(run, "a rocking couple is of one design")
    known = [body.name for body in run.mechanism.bodies]
    total = np.zeros((2, len(run)))
    for body, given in offsets.items():
        if body not in known:
            raise unknown_name("moving body", body, known)
        z = number_in(run.mechanism, given, "length", body, "offset")
        fx, fy, _ = run.inertia(body)
        total += z * np.array([-fy, fx])
    return RockingCouple(*total, **inherited(run))


# -- Firing orders: at which angle of the crank each cylinder fires ----------------------------


def firing_angles(
    order: str | Sequence[int],
    cylinders: int | None = None,
    *,
    turns: int = 2,
    cranks: Mapping[int, float] | None = None,
    intervals: Sequence[float] | None = None,
) -> dict[int, float]:
    """Angles of the crankshaft at which the cylinders fire, by their firing order.

    A table of the pressure in one cylinder over its cycle, p(x), x = 0 where it fires, serves all:
    of cylinder n it is p(θ − angle n), as ``area*gas(crank.angle - phase3)`` in a model file.

    Parameters
    ----------
    order : str or sequence of int
        Such as ``"1-5-3-6-2-4"``.
    cylinders : int, optional
        How many there are; by default those of the order.
    turns : int
        Of a cycle: 2 of a four-stroke engine, 1 of a two-stroke one.
    cranks : mapping, optional
        By cylinder, how far its own dead centre at the top comes after that of the first cylinder
        [rad]: of engines in line the angle by which its crank lags. Then it is checked that every
        cylinder fires at a dead centre of its own.
    intervals : sequence of float, optional
        From each firing to the next [rad], as many as there are cylinders; by default equal.

    Returns
    -------
    dict
        By cylinder, in the order in which they fire: its angle after that of the first that fires
        [rad].

    Raises
    ------
    ModelError
        For an order that does not name each cylinder once, intervals that are not one cycle, or
        cranks that do not fit.

    Examples
    --------
    >>> found = firing_angles("1-3-4-2")
    >>> {n: round(math.degrees(angle)) for n, angle in found.items()}
    {1: 0, 3: 180, 4: 360, 2: 540}
    >>> turn = math.pi
    >>> firing_angles("1-3-4-2", cranks={1: 0.0, 2: turn, 3: turn, 4: 0.0}) == found
    True
    """
    row = _order(order)
    count = len(row) if cylinders is None else whole_number("cylinders", cylinders)
    missing = sorted(set(range(1, count + 1)) - set(row))
    strange = sorted(set(row) - set(range(1, count + 1)))
    twice = sorted({n for n in row if row.count(n) > 1})
    if missing or strange or twice:
        wrong = [
            f"cylinder {numbers[0]} {what}"
            for numbers, what in (
                (twice, "fires twice"),
                (strange, "is not there"),
                (missing, "does not fire"),
            )
            if numbers
        ]
        raise ModelError(
            f"the firing order {'-'.join(map(str, row))} does not fit {count} cylinders: "
            f"{', '.join(wrong)}; name each from 1 to {count} once"
        )
    cycle = 2.0 * math.pi * whole_number("turns", turns)
    steps = [cycle / count] * count if intervals is None else [float(one) for one in intervals]
    if len(steps) != count or abs(sum(steps) - cycle) > tol.CRANK_BESIDE_DEAD_CENTRE * cycle:
        raise ModelError(
            f"{len(steps)} intervals of {math.degrees(sum(steps)):.6g} deg in all do not make the "
            f"cycle of {count} cylinders, {360 * turns} deg: give one after each firing"
        )
    angles = [0.0]
    for step in steps[:-1]:
        angles.append(angles[-1] + step)
    found = dict(zip(row, angles, strict=True))
    if cranks is not None:
        _check_cranks(found, cranks)
    return found


def _order(order: str | Sequence[int]) -> list[int]:
    """The cylinders as they follow each other."""
    if isinstance(order, str):
        words = [word for word in re.split(r"[-–,\s]+", order.strip()) if word]
        if not words or not all(word.isascii() and word.isdigit() for word in words):
            raise ModelError(
                f"a firing order is numbers of cylinders such as '1-3-4-2', not {brief(order)}"
            )
        return [int(word) for word in words]
    row = list(order)
    if not row or not all(isinstance(n, int) and not isinstance(n, bool) for n in row):
        raise ModelError(f"a firing order is whole numbers such as [1, 3, 4, 2], not {row!r}")
    return row


def _check_cranks(found: Mapping[int, float], cranks: Mapping[int, float]) -> None:
    """Refuse a cylinder that would fire away from its dead centre."""
    if set(cranks) != set(found):
        raise ModelError(
            f"there are cranks of the cylinders {', '.join(map(str, sorted(cranks)))}, and the "
            f"firing order has {', '.join(map(str, sorted(found)))}: give one a cylinder"
        )
    first = next(iter(found))
    for n, angle in found.items():
        own = float(cranks[n]) - float(cranks[first])
        off = math.remainder(angle - own, 2.0 * math.pi)
        if abs(off) > tol.CRANK_BESIDE_DEAD_CENTRE * 2.0 * math.pi:
            raise ModelError(
                f"cylinder {n} fires {math.degrees(angle):.6g} deg after cylinder {first}, where "
                f"its piston is {math.degrees(abs(off)):.6g} deg of the crank away from the dead "
                "centre: choose another firing order, or give the intervals"
            )


# -- Orders of shaking force and moment, and the shafts that balance an order ------------------

#: Orders that are found unless the caller says how many.
ORDERS = 8.0


def _rounding_force(found: ShakingOrders) -> float:
    return tol.FORCE_NONE * found.size


def _rounding_moment(found: ShakingOrders) -> float:
    return _rounding_force(found) * float(found.run.system.length)


_force = functools.partial(Value, dimension="force", floor=_rounding_force)


def _present_orders(found: ShakingOrders) -> list[int]:
    """The first two orders, and those with more than rounding."""
    force = found.force > _rounding_force(found)
    there = force | (found.moment > _rounding_moment(found)) | np.isin(found.orders, (1.0, 2.0))
    return np.flatnonzero(there).tolist()


@dataclass(frozen=True, eq=False, repr=False)
class ShakingOrders(Orders, Presented):
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
    shafts : tuple of BalanceShaft, optional
        Those that are to be shown with it.

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
    size: float = field(metadata={"scale": True})
    folding: float
    turns: int
    run: Any
    shafts: tuple[BalanceShaft, ...] | None = None

    analysis_name = "shaking"
    declared = (
        ColumnTable(
            (
                Value("orders", "ORDER"),
                _force("fx", "fx"),
                _force("fy", "fy"),
                _force("", "with it", value=lambda found: np.abs(found.forward)),
                _force("", "against it", value=lambda found: np.abs(found.backward)),
                Value("moment", "moment", "torque", floor=_rounding_moment),
                *data_only("force", "forward", "backward", dimension="force"),
            ),
            kept=_present_orders,
        ),
        Heading("GREATEST"),
        Value(
            "peak",
            {"force": "shaking force", "moment": "shaking moment"},
            {"force": "force", "moment": "torque"},
            lambda found: dict(zip(("force", "moment"), found.peak, strict=True)),
            floor=lambda one: {"force": _rounding_force(one), "moment": _rounding_moment(one)},
        ),
        Value("turns"),
        ItemTable(
            "shafts",
            (
                Value("order", "SHAFT"),
                Value("", "turns", "text", lambda one: ("against it", "with it")[one.sense > 0]),
                Value("sense"),
                Value("unbalance", "m·r", "mass·length"),
                Value("", "angle", "angle", lambda one: one.angle % (2.0 * math.pi)),
                Value("angle", "", "angle"),
                Value("force", "force", "force"),
            ),
            value=lambda found: found.shafts or (),
        ),
        Sentence(
            lambda found: (
                "no balance shaft is needed for these orders" if found.shafts == () else ""
            )
        ),
    )

    def of(self, order: float) -> float:
        """The greatest magnitude of the force of an order [force].

        Raises
        ------
        ModelError
            For an order that there is not.
        """
        return float(self.force[self.place(order)])


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


@inherits
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
    revolutions = cycle_revolutions(angle, "a shaking order")
    force = np.asarray(shaking.fx + 1j * shaking.fy)
    size = _size(run)
    check_repeats(force.real, size, "shaking force (x)", "a shaking order")
    check_repeats(force.imag, size, "shaking force (y)", "a shaking order")
    check_repeats(shaking.moment, size * run.system.length, "shaking moment", "a shaking order")
    orders, both, folding = complex_orders(angle, force, revolutions, highest)
    count = (orders.size + 1) // 2
    forward, backward = both[:count], np.concatenate([[0.0], both[:0:-1][: count - 1]])
    x, y, moment = (
        _amplitudes(angle, part, revolutions, highest)
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
        revolutions,
        run,
        **inherited(run),
    )


def _amplitudes(angle: Array, values: Array, revolutions: int, highest: float) -> Array:
    found = 2.0 * np.abs(complex_orders(angle, values, revolutions, highest)[1])
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
    A shaft of order 1 in the direction of the driver is a counterweight on the driver's own shaft.
    All forces on the frame are counted, weights too, whose mean no shaft takes away.

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
    if not speed or np.ptp(rate) > tol.RATE_CONSTANT * abs(speed):
        raise ModelError(
            f"balance shafts are for a constant speed, '{name}' has {rate.min():g} to "
            f"{rate.max():g} rad/s: give its law a constant speed",
            name,
        )
    shafts = []
    for order in orders:
        places = np.flatnonzero(np.abs(found.orders - order) < tol.HARMONICS_ORDER_SAME)
        if not places.size or not order > 0:
            raise ModelError(
                f"there is no shaft of order {order:g}: orders of this cycle are multiples of "
                f"{1.0 / found.turns:g}, above 0"
            )
        for sense, parts in ((1, found.forward), (-1, found.backward)):
            part = complex(parts[places[0]])
            if abs(part) > tol.FORCE_NONE * found.size:
                unbalance = abs(part) / (order * speed) ** 2
                angle = float(np.angle(-part))
                shafts.append(BalanceShaft(float(order), sense, unbalance, angle, abs(part)))
    return tuple(shafts)
