"""The six-bar of the mud pump by hand: crank A–B, coupler B–C, bell-crank C–E–D, rod D–F, ram at F.

Points are complex numbers, x + iy, in inches; the crank turns at constant ω. Nothing here comes
from mbody.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

__all__ = ["AB", "BC", "DF", "EC", "ED", "Places", "SixBar"]

Array = np.ndarray

AB, BC, EC, ED, DF = 6.0, 18.0, 12.0, 5.0, 15.0
g = 9.80665 / 0.0254  # in/s²


class Places(NamedTuple):
    """Points over crank angles: arrays of complex numbers."""

    B: Array
    C: Array
    D: Array
    F: Array


@dataclass(frozen=True)
class SixBar:
    """AE and the height of the line of stroke [in]; the angle from EC to ED [rad]."""

    AE: float
    bend: float
    line: float

    def places(self, theta: Array) -> Places:
        """The branch with C above, the ram on the right."""
        B = AB * np.exp(1j * theta)
        way = B - self.AE
        along = 0.5 * (1.0 + (EC**2 - BC**2) / np.abs(way) ** 2)
        C = self.AE + way * (along - 1j * np.sqrt(EC**2 / np.abs(way) ** 2 - along**2))
        D = self.AE + (C - self.AE) * ED / EC * np.exp(1j * self.bend)
        F = D.real + np.sqrt(DF**2 - (D.imag - self.line) ** 2) + 1j * self.line
        return Places(B, C, D, F)

    def energy(self, p: Places, rate: Callable[[Array], Array]) -> Array:
        """Kinetic energy by ω² [lbf·in·s²]; `rate` differentiates by the crank angle."""
        E = self.AE
        moving = [  # weight, inertia about the mass centre, mass centre, direction
            (90.0, 7.0, (p.B + p.C) / 2.0, p.C - p.B),
            (150.0, 11.0, E + (p.C - E) * 3.0 / EC, p.C - E),
            (80.0, 5.0, p.D + (p.F - p.D) * 7.0 / DF, p.F - p.D),
            (200.0, 0.0, p.F, 1.0 + 0.0 * p.F),
        ]
        total = np.zeros(len(p.B))
        for weight, inertia, centre, direction in moving:
            turning = rate(np.unwrap(np.angle(direction)))
            speed = rate(centre.real) ** 2 + rate(centre.imag) ** 2
            total += 0.5 * (weight / g * speed + inertia * turning**2)
        return total
