"""Harmonics of a quantity over whole cycles, by order of a driver."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from mbody.core.tolerances import HARMONICS_FOLDED, HARMONICS_ORDER_SAME, HARMONICS_STEPS_EQUAL
from mbody.engineering.fluctuation import angle_driver, check_repeats, counted, cycle_revolutions
from mbody.errors import ModelError
from mbody.model.study import Measure
from mbody.solution.doubts import Inherited, inherited
from mbody.solution.histories import one_design
from mbody.solution.known_forces import inherits
from mbody.solution.solution import Solution, as_solution

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
