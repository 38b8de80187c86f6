"""Whole turns of a first position: a guess chooses a branch, and not how often a body has turned.

An angle and the same angle a turn further are one direction, and a guess means a direction. Rows
that count whole turns (gears, racks, couplings, slides, drivers of an angle) and torsion springs
tell them apart, so these decide: rows before the loops are closed, springs at the closed position,
where each is taken within half a turn of its free angle. Whatever a driver or an exact start says
is kept as it is said.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from mbody.model.driver import AngleDriver
from mbody.model.element import Element, Numbers
from mbody.model.joints import CustomJoint, Fixed, Gear, Prismatic, RackPinion, Rolling
from mbody.model.loads import TorsionSpring
from mbody.system.system import System

__all__ = ["ambiguous", "by_rows", "by_springs"]

TURN = 2.0 * math.pi
#: How near to half a turn from its free angle a spring is as much on either side [rad].
HALF = 1e-6


class _Groups:
    """Bodies that only turn together where a whole turn is counted."""

    def __init__(self, names: list[str]) -> None:
        self.of = {name: {name} for name in names}

    def join(self, *names: str) -> None:
        whole: set[str] = set().union(*(self.of[name] for name in names))
        for name in whole:
            self.of[name] = whole

    def free(self, name: str) -> bool:
        """Whether nothing says how often that body has turned."""
        return "ground" not in self.of[name]


@dataclass
class _Row:
    """A row that counts turns: factors of angles, and what they leave of it at a pose."""

    factors: dict[str, Any]
    left: Any


def by_rows(system: System, pose: np.ndarray, drive: Mapping[str, float], at: Numbers) -> None:
    """Give the bodies of a guessed pose (coordinates + 3,) the whole turns, in place, that come
    nearest to what rows between angles ask; `drive` are the values of the drivers.
    """
    groups = _groups(system)
    for element in _counting(system):
        row = _row(system, element, pose, drive, at)
        if row is not None:
            _nearest(system, groups, pose, row)
        groups.join(*_coupled(element))


def by_springs(system: System, poses: np.ndarray) -> None:
    """Take every torsion spring of closed poses (designs, coordinates + 3) within half a turn of
    its free angle, in place, where nothing else says how often its bodies have turned.
    """
    for groups, spring in _springs(system):
        twist = _twist(system, spring, poses)
        turns = np.round(twist / TURN)
        if groups.free(spring.body):
            _shift(system, groups, poses, spring.body, -turns)
        else:
            _shift(system, groups, poses, spring.by, turns)


def ambiguous(system: System, pose: np.ndarray, drive: Mapping[str, float]) -> list[str]:
    """A sentence for each torsion spring whose turn the position does not tell for sure."""
    found = []
    turned = [
        d.name
        for d in system.drivers
        if isinstance(d, AngleDriver) and abs(drive.get(d.name, 0.0)) > TURN
    ]
    for _, spring in _springs(system):
        twist = float(_twist(system, spring, pose[None])[0])
        if abs(twist) > math.pi - HALF:
            found.append(
                f"torsion spring '{spring.name}' is half a turn from its free angle, {twist:.6g} "
                "rad: whether it is wound up one way or the other is not certain; say the angle "
                "in simulate's start, or choose another free angle"
            )
        elif turned:
            found.append(
                f"torsion spring '{spring.name}' is taken within half a turn of its free angle, "
                f"at a twist of {math.degrees(twist):.6g} deg, though '{turned[0]}' has turned by "
                "more than a turn before: begin at t = 0 to have the turns counted"
            )
    return found


def _groups(system: System) -> _Groups:
    return _Groups([*(body.name for body in system.mechanism.bodies), "ground"])


def _counting(system: System) -> Iterator[Element]:
    """Elements whose rows count turns, those that bind two bodies to one angle first."""
    machine = system.mechanism
    yield from (d for d in machine.drivers if isinstance(d, AngleDriver))
    yield from (joint for joint in machine.joints if isinstance(joint, (Fixed, Prismatic)))
    wheels = (RackPinion, Rolling, Gear, CustomJoint)
    yield from (joint for joint in machine.joints if isinstance(joint, wheels))
    yield from machine.couplings


def _coupled(element: Any) -> list[str]:
    """The bodies whose angles the rows of an element bring together."""
    terms = getattr(element, "parts", None)
    if terms is None:
        if isinstance(element, AngleDriver):
            return list(element.bodies)
        return [element.i.body, element.j.body]
    return [body for term in terms if not term.ends for body in term.bodies] or ["ground"]


def _springs(system: System) -> Iterator[tuple[_Groups, TorsionSpring]]:
    """Torsion springs between bodies of which nothing says how often they have turned, each with
    the groups as the springs before it leave them.
    """
    springs = [load for load in system.mechanism.loads if isinstance(load, TorsionSpring)]
    if not springs:
        return
    groups = _groups(system)
    for element in _counting(system):
        groups.join(*_coupled(element))
    for spring in springs:
        if groups.of[spring.body] is not groups.of[spring.by]:
            yield groups, spring
            groups.join(spring.body, spring.by)


def _twist(system: System, spring: TorsionSpring, poses: np.ndarray) -> np.ndarray:
    """θ − θ₀ of a spring, (designs,)."""
    free = np.asarray(system.values[f"{spring.name}.free_angle"])
    angle = poses[:, 3 * system.bodies[spring.body] + 2]
    twist: np.ndarray = angle - poses[:, 3 * system.bodies[spring.by] + 2] - free
    return twist


def _shift(system: System, groups: _Groups, poses: np.ndarray, name: str, turns: Any) -> None:
    """Turn a whole group by whole turns, (designs,)."""
    for body in groups.of[name]:
        poses[:, 3 * system.bodies[body] + 2] += TURN * turns


def _nearest(system: System, groups: _Groups, pose: np.ndarray, row: _Row) -> None:
    """Turn the last free group of a row so that least is left of it."""
    for name in reversed(row.factors):
        if groups.free(name):
            own = [c for body, c in row.factors.items() if body in groups.of[name]]
            factor = float(sum(own))
            if abs(factor) > 1e-9 * sum(abs(float(c)) for c in own):
                turns = np.round(float(row.left) / (TURN * factor))
                _shift(system, groups, pose[None], name, -turns)
            return


def _row(
    system: System, element: Any, pose: np.ndarray, drive: Mapping[str, float], at: Numbers
) -> _Row | None:
    """The part of an element that counts turns, at a pose."""

    def angle(body: str) -> float:
        return float(pose[3 * system.bodies[body] + 2])

    if isinstance(element, AngleDriver):
        i, j = element.bodies
        if element.name not in drive:
            return None
        return _Row({i: -1.0, j: 1.0}, angle(j) - angle(i) - drive[element.name])
    if isinstance(element, CustomJoint):
        return None
    if getattr(element, "parts", None) is not None:
        return _sum(system, element, pose, at)
    i, j = element.i.body, element.j.body
    beta_i, beta_j = float(at.angle(element, "i")), float(at.angle(element, "j"))
    turned = angle(j) + beta_j - angle(i) - beta_i
    if isinstance(element, (Fixed, Prismatic)):
        return _Row({i: -1.0, j: 1.0}, turned)
    (ix, iy), (jx, jy) = (_end(system, element, side, pose, at) for side in "ij")
    if isinstance(element, RackPinion) or getattr(element, "on_radius", 0.0) is None:
        radius = float(at[f"{element.name}.radius"])
        line = angle(i) + beta_i
        along = math.cos(line) * (jx - ix) + math.sin(line) * (jy - iy)
        left = along + radius * turned - float(at[f"{element.name}.offset"])
        return _Row({i: -radius, j: radius}, left)
    ri, rj = (float(radius) for radius in element.radii(at))
    ci, cj = ri / (ri + rj), rj / (ri + rj)
    phase = float(at[f"{element.name}.phase"])
    direction = math.atan2(jy - iy, jx - ix)
    # the line of centres by less than half a turn from where it is when both wheels stand at 0
    direction = phase + math.remainder(direction - phase, TURN)
    left = ci * (angle(i) + beta_i) + cj * (angle(j) + beta_j) + phase - direction
    return _Row({i: ci, j: cj}, left)


def _sum(system: System, coupling: Any, pose: np.ndarray, at: Numbers) -> _Row:
    """A coupling: its terms of angles, and what they and the lengths leave of its value."""
    factors: dict[str, float] = {}
    left = -float(at[f"{coupling.name}.value"])
    for n, term in enumerate(coupling.parts):
        factor = float(at[f"{coupling.name}.{n}.factor"])
        i, j = term.bodies
        if not term.ends:
            for body, sign in ((i, -1.0), (j, 1.0)):
                factors[body] = factors.get(body, 0.0) + sign * factor
                left += sign * factor * float(pose[3 * system.bodies[body] + 2])
            continue
        (ix, iy), (jx, jy) = (_end(system, coupling, f"{n}.{side}", pose, at) for side in "ij")
        length = math.hypot(jx - ix, jy - iy)
        if term.coordinate:
            line = float(pose[3 * system.bodies[i] + 2]) + float(at.angle(coupling, f"{n}.i"))
            length = math.cos(line) * (jx - ix) + math.sin(line) * (jy - iy)
        left += factor * length
    return _Row(factors, left)


def _end(
    system: System, element: Element, side: str, pose: np.ndarray, at: Numbers
) -> tuple[float, float]:
    """World place of an end at a pose."""
    x, y, angle = pose[3 * system.bodies[element.place(side).body] :][:3]
    ax, ay = (float(part) for part in at.arm(element, side))
    c, s = math.cos(angle), math.sin(angle)
    return float(x) + c * ax - s * ay, float(y) + s * ax + c * ay
