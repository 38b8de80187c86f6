"""Free motions in words: a readable basis of what constraints leave open, and a sentence of each.

Every motion of the basis has a leader, a body near the ground that turns (or slides) at unit rate
while the leaders of all others stand still.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from mbody.analysis.position.joint_places import place
from mbody.model.joints import Joint
from mbody.model.mechanism import Mechanism
from mbody.system.system import System

__all__ = ["FreeMotion", "components", "free_motions", "leading", "rates_of"]

Array = np.ndarray

#: A rate below this part of the greatest of a motion is none.
STILL = 1e-6
#: A coordinate leads where it has at least this part of the fastest one.
LEADS = 1e-2
#: Bodies that a sentence names.
NAMED = 5
#: A direction is called x or y within this [deg].
AXIS = 1e-4


@dataclass(frozen=True, eq=False)
class FreeMotion:
    """One free motion: how the bodies move when its leader turns or slides at unit rate.

    Attributes
    ----------
    leader : str
        The body whose rate is one: 1 rad/time, or 1 length/time where it does not turn.
    words : str
        The motion as a sentence.
    rates : dict
        (vx, vy, ω) of the mass centre of every moving body [length/time, rad/time].
    """

    leader: str
    words: str
    rates: dict[str, tuple[float, float, float]]

    @property
    def turns(self) -> bool:
        """Whether its leader turns; else it slides at unit rate."""
        return abs(self.rates[self.leader][2]) > 0.5

    def data(self) -> dict[str, Any]:
        """The same as a plain dict, ready for JSON."""
        rates = {body: list(rate) for body, rate in self.rates.items()}
        return {"leader": self.leader, "words": self.words, "rates": rates}


def rates_of(system: System, motions: Sequence[FreeMotion]) -> Array:
    """(vx, vy, ω) of every body for unit rates of the leaders: (free, bodies, 3)."""
    found = np.zeros((len(motions), system.layout.bodies, 3))
    for n, motion in enumerate(motions):
        for body, rate in motion.rates.items():
            found[n, system.bodies[body]] = rate
    return found


def leading(system: System, motions: Sequence[FreeMotion], ways: Array) -> Array:
    """What the leaders do as parts of the dimensionless coordinates: (free, coordinates)."""
    parts = np.zeros_like(ways)
    for n, motion in enumerate(motions):
        first = 3 * system.bodies[motion.leader]
        turns = motion.turns
        own = slice(first + 2, first + 3) if turns else slice(first, first + 2)
        parts[n, own] = ways[n, own]
    return np.asarray(np.linalg.solve(parts @ ways.T, parts))


def components(mechanism: Mechanism, couplings: int | None = None) -> list[list[str]]:
    """Bodies that joints and couplings, or the first so many of these, hold together, the ground
    and its part first; of each part those nearest to its first body first.
    """
    neighbours: dict[str, set[str]] = {"ground": set()}
    neighbours |= {body.name: set() for body in mechanism.bodies}
    for joint in mechanism.joints:
        neighbours[joint.i.body].add(joint.j.body)
        neighbours[joint.j.body].add(joint.i.body)
    for coupling in mechanism.couplings[:couplings]:
        for name in coupling.bodies:
            neighbours[name] |= set(coupling.bodies) - {name}
    place = {name: n for n, name in enumerate(neighbours)}
    found: list[list[str]] = []
    seen: set[str] = set()
    for first in neighbours:
        level = [] if first in seen else [first]
        if level:
            found.append([])
        while level:
            found[-1] += level
            seen.update(level)
            beside = set().union(*(neighbours[name] for name in level)) - seen
            level = sorted(beside, key=place.__getitem__)
    return found


def free_motions(system: System, q: Array, motions: Array) -> tuple[FreeMotion, ...]:
    """A readable basis of free motions.

    Parameters
    ----------
    q : array (coordinates + 3,)
        The position, the ground last.
    motions : array (free, coordinates)
        Any basis, lengths by the model length.
    """
    near = [name for part in components(system.mechanism) for name in part if name != "ground"]
    # what is driven leads, then what is near the ground
    driven = {body for driver in system.drivers for body in driver.bodies[1:]}
    order = sorted(near, key=lambda name: name not in driven)
    basis, leaders = _echelon(system, motions, order)
    scale = np.array([system.length, system.length, 1.0])
    joints: dict[str, list[Joint]] = {body.name: [] for body in system.mechanism.bodies}
    for joint in system.mechanism.joints:
        for name in {joint.i.body, joint.j.body} - {"ground"}:
            joints[name].append(joint)
    found = []
    for row, leader in zip(basis, leaders, strict=True):
        rates = row.reshape(-1, 3) * scale
        own = rates[system.bodies[leader]]
        turns = abs(row[3 * system.bodies[leader] + 2]) >= STILL
        unit = own[2] if turns else np.hypot(own[0], own[1])
        found.append(_Words(system, q, joints, rates / unit, leader).motion())
    return tuple(found)


def _echelon(system: System, motions: Array, order: Sequence[str]) -> tuple[Array, list[str]]:
    """Reduced rows: each has one coordinate that all others lack, of a body as near to the ground
    as can be, of it the angle first.
    """
    basis, left = motions.copy(), np.arange(len(motions))
    found: list[tuple[int, str]] = []
    columns = [3 * system.bodies[name] + k for name in order for k in (2, 0, 1)]
    names = [name for name in order for _ in range(3)]
    top = np.abs(basis).max(axis=1)
    # a row has its greatest number somewhere, so that every pass finds a leader or more
    while left.size:
        for name, c in zip(names, columns, strict=True):
            part = np.abs(basis[left, c]) / top[left]
            if part.max(initial=0.0) < LEADS:
                continue
            n = int(left[part.argmax()])
            basis[n] /= basis[n, c]
            others = np.arange(len(basis)) != n
            basis[others] -= np.outer(basis[others, c], basis[n])
            left = left[left != n]
            top[left] = np.abs(basis[left]).max(axis=1)
            found.append((n, name))
    found.sort(key=lambda pair: order.index(pair[1]))
    return basis[[n for n, _ in found]], [name for _, name in found]


class _Words:
    """Finds the words for one motion; rates (bodies, 3) with their units."""

    def __init__(
        self, system: System, q: Array, joints: dict[str, list[Joint]], rates: Array, leader: str
    ) -> None:
        self.system, self.q, self.joints, self.leader = system, q, joints, leader
        size = np.abs(rates / [system.length, system.length, 1.0]).max(axis=1)
        self.small = STILL * float(size.max())
        names = [body.name for body in system.mechanism.bodies]
        moving = [name for name, part in zip(names, size, strict=True) if part > self.small]
        moving.sort(key=lambda name: name != leader)
        self.rates = {name: rates[system.bodies[name]] for name in moving}
        self.units = system.mechanism.units

    def motion(self) -> FreeMotion:
        """The sentence: what turns, then what moves without turning; the leader first."""
        turning = [name for name in self.rates if self._turns(name)]
        parts = [self._turning(turning)] if turning else []
        glides = [self._glides(names) for names in self._together()]
        if len(glides) > NAMED:
            glides[NAMED:] = [f"{len(glides) - NAMED} groups more move without turning"]
        parts = [*parts, *glides] if self._turns(self.leader) else [*glides, *parts]
        rates = {name: (float(x), float(y), float(w)) for name, (x, y, w) in self.rates.items()}
        return FreeMotion(self.leader, "; ".join(parts), rates)

    def _together(self) -> list[list[str]]:
        """Bodies that do not turn, those with one velocity together."""
        found: list[list[str]] = []
        for name in self.rates:
            if self._turns(name):
                continue
            for group in found:
                apart = np.abs(self.rates[group[0]] - self.rates[name])[:2].max()
                alike = self._guided(group[0]) == self._guided(name)
                if alike and apart < self.small * self.system.length:
                    group.append(name)
                    break
            else:
                found.append([name])
        return found

    def _turns(self, name: str) -> bool:
        return abs(self.rates[name][2]) > self.small

    def _turning(self, names: list[str]) -> str:
        """Such as "crank turns about O2, rocker follows (crank 1 : rocker -0.2 rad/s)"."""
        ratios = [f"{name} {_number(self.rates[name][2])}" for name in names[:NAMED]]
        shown = " : ".join(ratios) + (" …" if len(names) > NAMED else "")
        first, *others = names
        if first != self.leader:
            words = f"{_listed(names)} {'turns' if not others else 'turn'}"
        else:
            words = f"{first} turns about {self._centre(first)}"
            if others:
                words += f", {_listed(others)} {'follows' if len(others) == 1 else 'follow'}"
        if not others:
            shown = _number(self.rates[first][2])
        return f"{words} ({shown} rad/{self.units.time})"

    def _centre(self, name: str) -> str:
        """A pin that does not move, else where the instantaneous centre is."""
        x, y = self.q[3 * self.system.bodies[name] :][:2]
        vx, vy, w = self.rates[name]
        touching = self.joints[name]
        near = STILL * self.system.length * 10.0
        for joint in touching:
            side = "i" if joint.i.body == name else "j"
            px, py = place(self.system, self.q, joint, side)
            speed = np.hypot(vx - w * (py - y), vy + w * (px - x))
            if joint.pin and speed < near * abs(w):
                return joint.name
        where = f"({_number(x - vy / w)}, {_number(y + vx / w)})"
        if np.hypot(vx, vy) < near * abs(w):
            where = f"its mass centre {where}"
        return f"{where} at this instant" if touching else where

    def _glides(self, names: list[str]) -> str:
        """Along which direction bodies move that do not turn."""
        vx, vy, _ = self.rates[names[0]]
        angle = float(np.degrees(np.arctan2(vy, vx))) % 180.0
        speed = float(np.hypot(vx, vy))
        along, sign = f"{angle:.4g}°", np.sign(vy)
        if min(angle, 180.0 - angle) < AXIS:
            along, sign = "x", np.sign(vx)
        elif abs(angle - 90.0) < AXIS:
            along = "y"
        rate = f"{_number(sign * speed)} {self.units.of('velocity')}"
        s = "s" if len(names) == 1 else ""
        if self._guided(names[0]):
            return f"{_listed(names)} slide{s} along {along} ({rate})"
        return f"{_listed(names)} move{s} along {along} without turning ({rate})"

    def _guided(self, name: str) -> bool:
        """Whether a body slides on one that does not move, or is free of joints."""
        touching = self.joints[name]
        return not touching or any(
            joint.slide
            and (joint.i.body if joint.j.body == name else joint.j.body) not in self.rates
            for joint in touching
        )


def _number(value: Any) -> str:
    return f"{round(float(value), 9) + 0.0:.4g}"


def _listed(names: list[str]) -> str:
    """Names as in "coupler and rocker"; of many the first."""
    if len(names) > NAMED:
        return f"{', '.join(names[: NAMED - 1])} and {len(names) - NAMED + 1} more"
    return " and ".join([", ".join(names[:-1]), names[-1]] if len(names) > 1 else names)
