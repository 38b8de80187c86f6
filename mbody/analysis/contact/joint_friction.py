"""The size of friction of a rough pair, for the multipliers of what presses it, with its slopes.

The same laws as of `mbody.kernels.friction_laws`, of one pair at one instant, for the static and
for the kinetic coefficient: decisions of modes need both.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from mbody.kernels.friction_laws import FRICTION_KINDS
from mbody.kernels.layout import Work
from mbody.system.system import System

__all__ = ["JointFriction"]


class JointFriction:
    """Friction of rough pair f at the position, rates and signals in a workspace.

    Parameters
    ----------
    system : System
    work : Work
        With the rows of that position.
    f : int
        Number of the pair.
    rate : float, optional
        Of sliding; by default the pair is at rest and has its static coefficient.
    """

    def __init__(self, system: System, work: Work, f: int, rate: float | None = None) -> None:
        L, o = system.layout, int(system.layout.friction_par[f])
        self.kind, self.node = FRICTION_KINDS[int(L.friction_kind[f])], int(L.friction_node[f])
        kinetic, static, speed = (float(part) for part in system.par[o : o + 3, 0])
        self.first, self.second = (float(part) for part in system.par[o + 4 : o + 6, 0])
        mu = kinetic
        if rate is None:
            mu = static
        elif speed > 0.0:
            mu += (static - kinetic) * math.exp(-((rate / speed) ** 2))
        self.mu, self.given = mu, 0.0
        if self.kind in ("torque", "force"):
            self.given = max(0.0, mu * float(work.signal[int(L.friction_signal[f]), 0]))
        if self.kind == "follower":
            at = 12 * self.node + 6
            self.mu = self._on_cam(float(np.hypot(*work.block[at : at + 2, 0])))

    @property
    def by_law(self) -> bool:
        """Whether its size follows a law alone."""
        return self.kind in ("torque", "force")

    def _on_cam(self, push: float) -> float:
        """Of a follower by its multiplier; `push`: the length of the part of its row that pushes.
        See `mbody.kernels.friction_laws.on_cam`.
        """
        if self.first <= 0.0:
            return self.mu * push
        sine = self.first * self.mu / math.sqrt(1.0 + self.mu**2)
        return push * sine / math.sqrt(1.0 - sine * sine)

    def size(self, x: Any, y: Any, sense: float) -> tuple[Any, Any, Any]:
        """φ by both multipliers, numbers or arrays, and its derivatives by them; `sense` of the
        sliding, or of that which would begin.
        """
        mu, zero = self.mu, 0.0 * (x + y)
        if self.by_law:
            # what helps itself in one sense, as a band brake does, has more in that one
            return max(0.0, self.given * (1.0 + self.second * sense)) + zero, zero, zero
        if self.kind == "pin":
            arm, whole = mu * self.first / math.sqrt(1.0 + mu * mu), np.hypot(x, y)
            per = np.where(whole > 0.0, arm / np.where(whole > 0.0, whole, 1.0), 0.0)
            return arm * whole, per * x, per * y
        uneven = self.second * sense if self.kind == "couple" else 0.0
        size, by_x, by_y = mu * np.abs(x) + uneven * x, mu * np.sign(x) + uneven, zero
        if self.kind == "guide" and self.first > 0.0:
            tilt = 0.5 * mu * sense * self.second
            moment, arm = y + tilt * x, 2.0 * mu / self.first
            ends, turn = arm * np.abs(moment) > size, arm * np.sign(moment)
            size = np.where(ends, arm * np.abs(moment), size)
            by_x, by_y = np.where(ends, turn * tilt, by_x), np.where(ends, turn, by_y)
        return size, by_x, by_y
