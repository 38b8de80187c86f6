"""The indicator diagram of a liquid between two valves, by hand: pressure, work, valve positions.

A chamber has the height h above its head, c where it is least, H = c + stroke where it is greatest.
Nothing here comes from mbody.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

__all__ = ["Liquid", "nodes", "reached"]

Array = np.ndarray

BAR = 1e5 * 0.0254**2 / 4.4482216152605  # lbf/in²
GAUSS = np.polynomial.legendre.leggauss(20)


class Liquid(NamedTuple):
    """Pressures of suction and delivery, bulk modulus [lbf/in²], clearance and stroke [in]."""

    suction: float
    delivery: float
    K: float
    c: float
    stroke: float

    @property
    def H(self) -> float:
        """Where the chamber is greatest."""
        return self.c + self.stroke

    @property
    def opens(self) -> tuple[float, float]:
        """h where the valves open: of delivery on the way in, of suction on the way out."""
        part = np.exp((self.delivery - self.suction) / self.K)
        return float(self.H / part), float(self.c * part)

    def pressure(self, h: Array, growing: Array) -> Array:
        """p, by the sense of the motion."""
        inwards = np.minimum(self.suction + self.K * np.log(self.H / h), self.delivery)
        outwards = np.maximum(self.delivery - self.K * np.log(h / self.c), self.suction)
        return np.where(growing, outwards, inwards)

    def work(self) -> float:
        """−∮ p dh by Gauss's rule in h between the valves' openings: what the piston gives, by the
        area.
        """
        out, into = self.opens
        total = 0.0
        for ends, growing in (((self.c, into, self.H), True), ((self.H, out, self.c), False)):
            h, weight = nodes(np.array(ends))
            total -= float(weight @ self.pressure(h, np.full(h.shape, growing)))
        return total

    def work_exact(self) -> float:
        """The same integrated in closed form."""
        out, into = self.opens
        ps, pd, K = self.suction, self.delivery, self.K
        squeeze = (ps + K) * (self.H - out) - K * out * np.log(self.H / out)
        spread = (pd + K) * (into - self.c) - K * into * np.log(into / self.c)
        return float(pd * (out - self.c) + squeeze - spread - ps * (self.H - into))


def nodes(ends: Array) -> tuple[Array, Array]:
    """Places and weights of Gauss's rule of 20 between each two of the ends."""
    half, middle = np.diff(ends) / 2.0, (ends[1:] + ends[:-1]) / 2.0
    x = middle[:, None] + half[:, None] * GAUSS[0]
    return x.ravel(), (half[:, None] * GAUSS[1]).ravel()


def reached(x: Callable[[float], Any], wanted: float, low: float, high: float) -> float:
    """Where a monotonic function has that value, by bisection to rounding."""
    rising = x(high) > x(low)
    while True:
        middle = 0.5 * (low + high)
        if middle in (low, high):
            return middle
        if (x(middle) < wanted) == rising:
            low = middle
        else:
            high = middle
