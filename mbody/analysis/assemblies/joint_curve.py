"""The curve of positions that the joints leave when one driver is released, walked step by step."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from mbody.analysis.position.assembly_analysis import set_drive
from mbody.model.driver import Driver
from mbody.system.rank import dense
from mbody.system.system import System

__all__ = ["JointCurve", "CircuitWalk"]

#: First and longest step, in model lengths and radians, and below what a step has failed.
FIRST, LONGEST, SHORTEST = 0.02, 0.2, 1e-9
#: Cosine between tangents, and way off the tangent as a part of the step, that a step may have.
STRAIGHT, AWAY = 0.985, 0.1
#: A correction that is rounding.
CLOSED = 1e-12
#: Halvings of an interval with a dead centre in it; steps of one walk.
HALVINGS, STEPS = 50, 20_000
#: How far a length may go, in model lengths.
FAR = 100.0


@dataclass
class CircuitWalk:
    """One circuit, walked until it closes.

    Attributes
    ----------
    passed : list of (int, int)
        Value and mode, by their numbers, in the order in which they were passed.
    stretches : list of list of (int, int)
        The same between dead centres.
    dead_centres : list of float
        Values of the driver, unwrapped from the first value.
    low, high : float
        How far the driver went.
    advance : float
        By how much the driver's value has changed when the circuit closed.
    trouble : str
        Why the walk ended before that; empty where it closed.
    """

    passed: list[tuple[int, int]] = field(default_factory=list)
    stretches: list[list[tuple[int, int]]] = field(default_factory=lambda: [[]])
    dead_centres: list[float] = field(default_factory=list)
    low: float = 0.0
    high: float = 0.0
    advance: float = 0.0
    trouble: str = ""


class JointCurve:
    """Positions without units of a system whose one driver is released."""

    def __init__(self, system: System, driver: Driver, drive: dict[str, float], x: float) -> None:
        self.system, self.work = system, system.work()
        set_drive(system, self.work, 0.0, {**drive, driver.name: x})
        self.n, self.x, self.unit = system.coordinates, x, driver.unit(system.length)
        self.period = 2.0 * math.pi if driver.angular else math.inf
        self.row = (
            system.rows - len(system.drivers) + [d.name for d in system.drivers].index(driver.name)
        )
        self.others = np.arange(system.rows) != self.row

    def _rows(self, q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        self.work.q[: self.n, 0] = q * self.system.coordinate_units
        phi, G = dense(self.system, self.work)
        return phi, G

    def value(self, q: np.ndarray) -> float:
        """The driver's value."""
        return self.x + float(self._rows(q)[0][self.row]) * self.unit

    def _tangent(self, G: np.ndarray, ahead: np.ndarray) -> np.ndarray:
        along = np.linalg.svd(G[self.others])[2][-1]
        return along if along @ ahead >= 0.0 else -along

    def _closed(self, q: np.ndarray) -> np.ndarray | None:
        for _ in range(8):
            phi, G = self._rows(q)
            step = np.linalg.lstsq(G[self.others], phi[self.others], rcond=None)[0]
            q = q - step
            if np.abs(step).max() < CLOSED * (1.0 + np.abs(q).max()):
                return q
        return None

    def walk(
        self,
        pose: np.ndarray,
        begin: tuple[int, int],
        values: list[float],
        mode_at: Callable[[int, np.ndarray], int | None],
        geared: bool = False,
    ) -> CircuitWalk:
        """Walk from a mode, the driver's value growing first, until it is passed again.

        Parameters
        ----------
        pose : array (coordinates + 3,)
        begin : (int, int)
            Number of its value among `values`, and of the mode there.
        values : list of float
            Where modes are known; of an angle they stand for all turns.
        mode_at : callable
            The mode of a position (coordinates,) at the value of that number.
        geared : bool
            Whether wheels turn by parts of turns, so that a position need not come again after one
            turn of the driver.
        """
        q = pose[: self.n] / self.system.coordinate_units
        G = self._rows(q)[1]
        found = CircuitWalk(passed=[begin], stretches=[[begin]])
        t = self._tangent(G, G[self.row])
        x = first = self._known(self.value(q), values[begin[0]])
        found.low = found.high = x
        step, steps = FIRST, 0
        while steps < STEPS:
            steps += 1
            new = self._closed(q + step * t)
            s = None if new is None else self._tangent(self._rows(new)[1], t)
            bad = new is None or s is None or s @ t < STRAIGHT
            if bad or np.linalg.norm(new - q - step * t) > AWAY * step:
                step *= 0.5
                if step < SHORTEST:
                    found.trouble = "branches meet on the way (a change point)"
                    return found
                continue
            assert new is not None and s is not None
            rate = float(self._rows(q)[1][self.row] @ t)
            turning = rate * float(self._rows(new)[1][self.row] @ s) < 0.0
            there = self.value(new)
            parts = [(q, new, x, there)]
            if turning:
                middle = self._turning(q, t, step, rate)
                end = self.value(middle)
                found.dead_centres.append(end)
                found.low, found.high = min(found.low, end), max(found.high, end)
                parts = [(q, middle, x, end), (middle, new, end, there)]
            for k, (a, b, low, high) in enumerate(parts):
                if k:
                    found.stretches.append([])
                for number, value in self._between(values, low, high):
                    mode = mode_at(number, self._at(a, b, low, high, value))
                    if mode is None:
                        if geared:
                            continue
                        found.trouble = "the way leads through a position that is no known mode"
                        continue
                    found.passed.append((number, mode))
                    found.stretches[-1].append((number, mode))
                    if (number, mode) == begin and len(found.dead_centres) % 2 == 0:
                        found.advance = value - first
                        return self._joined(found)
            q, t, x = new, s, there
            found.low, found.high = min(found.low, x), max(found.high, x)
            if self.period == math.inf and abs(x - first) > FAR * self.unit:
                found.trouble = "the driver can go on without end"
                return found
            step = min(1.3 * step, LONGEST)
        found.trouble = f"the way does not close within {STEPS} steps"
        return found

    def _known(self, x: float, value: float) -> float:
        """The value of a mode where a position has it but for rounding, so that it is not passed
        once more at the start.
        """
        turns = 0.0 if self.period == math.inf else self.period * round((x - value) / self.period)
        return value + turns if abs(x - value - turns) < CLOSED * self.unit else x

    @staticmethod
    def _joined(found: CircuitWalk) -> CircuitWalk:
        """The last stretch goes on into the first."""
        if len(found.stretches) > 1:
            found.stretches[0] = found.stretches.pop() + found.stretches[0]
        return found

    def _between(self, values: list[float], low: float, high: float) -> list[tuple[int, float]]:
        """Values that lie between two of the driver, the first left out, in their order."""
        found = []
        for number, value in enumerate(values):
            ways = [value]
            if self.period != math.inf:
                first, last = sorted(((low - value) / self.period, (high - value) / self.period))
                ways = [
                    value + k * self.period for k in range(math.ceil(first), math.floor(last) + 1)
                ]
            for way in ways:
                if way != low and (way - low) * (way - high) <= 0.0:
                    found.append((number, way))
        return sorted(found, key=lambda one: abs(one[1] - low))

    def _at(
        self, a: np.ndarray, b: np.ndarray, low: float, high: float, value: float
    ) -> np.ndarray:
        """The position at a value between two near positions, with the units of coordinates."""
        q = a + (b - a) * ((value - low) / (high - low))
        for _ in range(8):
            phi, G = self._rows(q)
            phi[self.row] -= (value - self.x) / self.unit
            step = np.linalg.lstsq(G, phi, rcond=None)[0]
            q = q - step
            if np.abs(step).max() < CLOSED * (1.0 + np.abs(q).max()):
                break
        return np.asarray(q * self.system.coordinate_units)

    def _turning(self, q: np.ndarray, t: np.ndarray, step: float, rate: float) -> np.ndarray:
        """The position between two at which the driver's value turns back."""
        low, high, middle = 0.0, step, q
        for _ in range(HALVINGS):
            way = 0.5 * (low + high)
            there = self._closed(q + way * t)
            if there is None:
                break
            middle, G = there, self._rows(there)[1]
            if float(G[self.row] @ self._tangent(G, t)) * rate > 0.0:
                low = way
            else:
                high = way
        return middle
