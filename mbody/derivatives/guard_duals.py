"""What is zero where the modes of a motion change, in dual numbers.

The same quantities as of `mbody.analysis.dynamics.contact_guards`, each of one instant.
"""

from __future__ import annotations

import functools
from collections.abc import Mapping
from typing import Any

import numpy as np

from mbody.analysis.contact.unilateral import SENSES, Unilateral
from mbody.analysis.dynamics.located import Guard
from mbody.core.dual_number import DualNumber, value
from mbody.derivatives.dual_motion import DualInstant
from mbody.derivatives.formula_jumps import JumpGuard
from mbody.derivatives.mode_record import ModeStretch
from mbody.kernels.friction_laws import FRICTION_KINDS
from mbody.kernels.output import PER_PRIMITIVE
from mbody.model.contact_spots import Spot
from mbody.model.element import Numbers
from mbody.system.polar_points import polar_points

__all__ = ["GuardDuals"]

Array = np.ndarray

#: Gaps beyond this, in model lengths, are not what closes there.
NEAR = 1e-6


class GuardDuals:
    """The guards of one system.

    Parameters
    ----------
    uni : Unilateral
    numbers : mapping
        Of the description by dotted name, dual ones among them.
    """

    def __init__(self, uni: Unilateral, numbers: Mapping[str, Any]) -> None:
        self.uni, self.system = uni, uni.system
        contacts = {one.name: one for one in self.system.mechanism.contacts}
        self.numbers = numbers
        at: Any = numbers
        static = {name: one.coefficients(at)[1] for name, one in contacts.items()}
        #: Of every touch its static friction.
        self.static = [static[touch.name] for touch in uni.touches]

    def value(self, guard: Guard | JumpGuard, stretch: ModeStretch, now: DualInstant) -> Any:
        """The value of a guard, a dual number; None of one that has no derivatives here."""
        if isinstance(guard, JumpGuard):
            return now.formula[guard.number]
        touches = self.uni.touches
        if guard.kind == "close":
            found = touches[guard.number].spot.sense * now.value[touches[guard.number].normal]
            return None if self.behind(guard, now) else found
        if guard.kind == "lock":
            return touches[guard.number].spot.sense * now.rate[touches[guard.number].normal]
        if guard.kind == "open":
            return self._pressing(now.page, guard.number)
        if guard.kind in ("edge", "enter"):
            along = self._along(guard.number, now)
            return along if guard.kind == "edge" or along is None else -along
        if guard.kind == "stop":
            row, mode = self._sliding(stretch, guard.number)
            return SENSES[mode] * now.rate[row]
        if guard.kind == "slip" and guard.number < len(touches):
            group = stretch.groups.get(guard.number, [guard.number])
            most = sum(self.static[k] * self._pressing(now.page, k) for k in group)
            return most - abs(self._multiplier(now.page, touches[guard.number].tangent))
        if guard.kind == "slip":
            return self._reserve(guard.number - len(touches), now)
        return None

    def behind(self, guard: Guard | JumpGuard, now: DualInstant) -> bool:
        """Whether what has no gap to close only passes an end of the edge that it is behind."""
        if guard.kind != "close":
            return False
        touch = self.uni.touches[guard.number]
        gap = float(touch.spot.sense * value(now.value)[touch.normal])
        return gap < -NEAR * self.system.length

    def kind_of(self, guard: Guard | JumpGuard) -> bool:
        """Whether a guard follows from forces, not from positions and rates alone."""
        return guard.kind in ("open", "slip", "share", "paradox")

    @functools.cached_property
    def _spots(self) -> list[Spot]:
        """Of every touch where it is, by the numbers."""
        machine = self.system.mechanism
        at = Numbers(dict(self.numbers), polar_points(machine), machine.bodies)
        return [spot for contact in machine.contacts for spot in contact.spots(at)]

    def _along(self, number: int, now: DualInstant) -> Any:
        """How far a touch is from the nearer end of its edge, within it; None of arcs."""
        spot = self._spots[number]
        if spot.edge is None or spot.arcs:
            return None
        (ax, ay), (ux, uy), length = spot.edge
        (xi, yi, ti), (xj, yj, tj) = (self._pose(body, now) for body in self.uni.bodies[number])
        jx, jy = spot.arm
        px = xj + np.cos(tj) * jx - np.sin(tj) * jy - xi
        py = yj + np.sin(tj) * jx + np.cos(tj) * jy - yi
        x, y = np.cos(ti) * px + np.sin(ti) * py - ax, np.cos(ti) * py - np.sin(ti) * px - ay
        way = ux * x + uy * y
        return way if value(way) <= value(length - way) else length - way

    def _pose(self, body: int, now: DualInstant) -> tuple[Any, Any, Any]:
        """x, y and angle of a body; the ground is the last one."""
        if 3 * body >= self.system.coordinates:
            return 0.0, 0.0, 0.0
        return now.y[3 * body], now.y[3 * body + 1], now.y[3 * body + 2]

    def _sliding(self, stretch: ModeStretch, number: int) -> tuple[int, str]:
        touches = self.uni.touches
        if number < len(touches):
            return touches[number].tangent, stretch.modes[number]
        return self.uni.rough[number - len(touches)].tangent, stretch.pairs[number - len(touches)]

    def _multiplier(self, page: DualNumber, row: int) -> DualNumber:
        e = int(self.uni.layout.switched[row])
        return page[3 * self.system.coordinates + PER_PRIMITIVE * e]

    def _pressing(self, page: DualNumber, number: int) -> Any:
        touch = self.uni.touches[number]
        return -touch.spot.sense * self._multiplier(page, touch.normal)

    def _reserve(self, m: int, now: DualInstant) -> Any:
        """How much more friction a rough joint that sticks could have: of the nearer sense."""
        pair, L = self.uni.rough[m], self.uni.layout
        force = self._multiplier(now.page, pair.tangent)
        node = int(L.friction_node[pair.pair])
        first = 3 * self.system.coordinates
        first += PER_PRIMITIVE * int(np.flatnonzero(L.primitive_node == node)[0])
        x, y = now.page[first], now.page[first + 1]
        ahead = self._limit(pair.pair, now, x, y, 1.0) - force
        back = self._limit(pair.pair, now, x, y, -1.0) + force
        return ahead if value(ahead) <= value(back) else back

    def _limit(self, f: int, now: DualInstant, x: Any, y: Any, sense: float) -> Any:
        """Static friction of pair f by the multipliers of what presses it, as of
        `mbody.analysis.contact.joint_friction`.
        """
        L = self.uni.layout
        kind, o = FRICTION_KINDS[int(L.friction_kind[f])], int(L.friction_par[f])
        mu, one, two = now.par[o + 1], now.par[o + 4], now.par[o + 5]
        if kind in ("torque", "force"):
            given = mu * now.signal[int(L.friction_signal[f])]
            size = given * (1.0 + two * sense)
            return size if value(given) > 0.0 and value(size) > 0.0 else 0.0 * size
        if kind == "pin":
            return mu * one / np.sqrt(1.0 + mu * mu) * np.hypot(x, y)
        if kind == "couple":
            return mu * abs(x) + two * sense * x
        if kind == "follower":
            at = 12 * int(L.friction_node[f]) + 6
            push = np.sqrt(now.blocks[at] ** 2 + now.blocks[at + 1] ** 2)
            if value(one) <= 0.0:
                return mu * push * abs(x)
            sine = one * mu / np.sqrt(1.0 + mu * mu)
            return push * sine / np.sqrt(1.0 - sine * sine) * abs(x)
        size = mu * abs(x)
        if kind == "guide" and value(one) > 0.0:
            moment = y + 0.5 * mu * sense * two * x
            ends = 2.0 * mu / one * abs(moment)
            return ends if value(ends) > value(size) else size
        return size
