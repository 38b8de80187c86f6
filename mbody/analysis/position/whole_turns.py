"""Whole turns of a first position: a guess chooses a branch, and not how often a body has turned.

An angle and the same angle a turn further are one direction, and a guess means a direction. Rows
that count whole turns (gears, racks, couplings, slides, drivers of an angle) and torsion springs
tell them apart, so these decide: rows before the loops are closed, springs at the closed position,
where each is taken within half a turn of its free angle. Whatever a driver or an exact start says
is kept as it is said.

The row of two wheels that mesh, n(ψ)·d = 0, is zero half a turn of ψ further as well, where other
teeth meet and the multiplier has the other sign. A wheel that only turns about its centre is turned
to where ψ points from one centre to the other, before the loops are closed and again at the closed
position: guesses of places may lie on the other side of where ψ is half a turn from its phase, and
steps near a singular position may be large.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from mbody.core.tolerances import FACTOR_CANCELS, POINT_SAME, SPRING_HALF_TURN
from mbody.model.constraint import Constraint, TurnRow
from mbody.model.element import Element, Numbers
from mbody.system.system import System

TURN = 2.0 * math.pi


class _TurningGroups:
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


class _Pose:
    """The guessed pose as elements read it."""

    def __init__(
        self, system: System, pose: np.ndarray, driver_values: Mapping[str, float], at: Numbers
    ) -> None:
        self.system, self.pose, self.given, self.at = system, pose, driver_values, at

    def angle(self, body: str) -> float:
        """Angle of a body [rad]."""
        return float(self.pose[3 * self.system.bodies[body] + 2])

    def place(self, element: Element, field: str) -> tuple[float, float]:
        """World place of an element's marker [length]."""
        x, y, angle = self.pose[3 * self.system.bodies[element.place(field).body] :][:3]
        ax, ay = (float(part) for part in self.at.arm(element, field))
        c, s = math.cos(angle), math.sin(angle)
        return float(x) + c * ax - s * ay, float(y) + s * ax + c * ay


def by_rows(
    system: System, pose: np.ndarray, driver_values: Mapping[str, float], at: Numbers
) -> None:
    """Give the bodies of a guessed pose (coordinates + 3,) the whole turns, in place, that come
    nearest to what rows between angles ask; `driver_values` by the name of the driver.
    """
    groups, read = _groups(system), _Pose(system, pose, driver_values, at)
    for element in _counting(system, groups):
        row = element.turn_row(at, read)
        if row is not None:
            _nearest(system, groups, pose, row)
        if element.meshes:
            _mesh(system, groups, read, element)


def other_teeth(
    system: System, pose: np.ndarray, driver_values: Mapping[str, float], at: Numbers
) -> bool:
    """Turn the wheels of a closed pose, in place, at which other teeth meet than the phase means;
    returns whether there were such.
    """
    if not any(joint.meshes for joint in system.mechanism.joints):
        return False
    groups, read, before = _groups(system), _Pose(system, pose, driver_values, at), pose.copy()
    for element in _counting(system, groups):
        if element.meshes:
            _mesh(system, groups, read, element)
    return not np.array_equal(pose, before)


def by_springs(system: System, poses: np.ndarray) -> None:
    """Take every torsion spring of closed poses (designs, coordinates + 3) within half a turn of
    its free angle, in place, where nothing else says how often its bodies have turned.
    """
    for groups, spring in _springs(system):
        twist = _twist(system, spring, poses)
        turns = np.round(twist / TURN)
        if groups.free(spring.body):
            _turn(system, groups, poses, spring.body, -TURN * turns)
        else:
            _turn(system, groups, poses, spring.by, TURN * turns)


def ambiguous(system: System, pose: np.ndarray, driver_values: Mapping[str, float]) -> list[str]:
    """A sentence for each torsion spring whose turn the position does not tell for sure."""
    found = []
    turned = [
        d.name for d in system.drivers if d.angular and abs(driver_values.get(d.name, 0.0)) > TURN
    ]
    for _, spring in _springs(system):
        twist = float(_twist(system, spring, pose[None])[0])
        if abs(twist) > math.pi - SPRING_HALF_TURN:
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


def _groups(system: System) -> _TurningGroups:
    return _TurningGroups([*(body.name for body in system.mechanism.bodies), "ground"])


def _counting(system: System, groups: _TurningGroups) -> Iterator[Constraint]:
    """Elements whose rows count turns, those that bind two bodies to one angle first; each joins
    its bodies once it has been looked at.
    """
    machine = system.mechanism
    joints = sorted(machine.joints, key=lambda joint: not joint.parallel)
    for element in (*machine.drivers, *joints, *machine.couplings):
        if element.counts_turns:
            yield element
            groups.join(*element.turn_bodies())


def _springs(system: System) -> Iterator[tuple[_TurningGroups, Any]]:
    """Torsion springs between bodies of which nothing says how often they have turned, each with
    the groups as the springs before it leave them.
    """
    springs: list[Any] = [load for load in system.mechanism.loads if load.by_angle and load.free]
    if not springs:
        return
    groups = _groups(system)
    for _ in _counting(system, groups):
        pass  # each joins its bodies
    for spring in springs:
        if groups.of[spring.body] is not groups.of[spring.by]:
            yield groups, spring
            groups.join(spring.body, spring.by)


def _twist(system: System, spring: Any, poses: np.ndarray) -> np.ndarray:
    """θ − θ₀ of a spring, (designs,)."""
    free = np.asarray(system.values[f"{spring.name}.{spring.free}"])
    angle = poses[:, 3 * system.bodies[spring.body] + 2]
    twist: np.ndarray = angle - poses[:, 3 * system.bodies[spring.by] + 2] - free
    return twist


def _turn(system: System, groups: _TurningGroups, poses: np.ndarray, name: str, angle: Any) -> None:
    """Turn a whole group by angles (designs,) [rad]."""
    for body in groups.of[name]:
        poses[:, 3 * system.bodies[body] + 2] += angle


def _nearest(system: System, groups: _TurningGroups, pose: np.ndarray, row: TurnRow) -> None:
    """Turn the last free group of a row so that least is left of it."""
    for name in reversed(row.factors):
        if groups.free(name):
            own = [c for body, c in row.factors.items() if body in groups.of[name]]
            factor = float(sum(own))
            if abs(factor) > FACTOR_CANCELS * sum(abs(float(c)) for c in own):
                turns = np.round(float(row.left) / (TURN * factor))
                _turn(system, groups, pose[None], name, -TURN * turns)
            return


def _mesh(system: System, groups: _TurningGroups, read: _Pose, pair: Constraint) -> None:
    """Turn the last free wheel of a pair whose ψ is nearer to the opposite direction."""
    row = pair.turn_row(read.at, read)
    if row is None or abs(float(row.left)) <= 0.25 * TURN:
        return
    for name in reversed(row.factors):
        whole = groups.of[name]
        factor = float(sum(c for body, c in row.factors.items() if body in whole))
        if factor and groups.free(name) and all(_is_wheel(system, read.at, one) for one in whole):
            _turn(system, groups, read.pose[None], name, -float(row.left) / factor)
            return


def _is_wheel(system: System, at: Numbers, body: str) -> bool:
    """Whether joints hold a body at one place only, about which it may turn in any position."""
    arms = []
    for joint in system.mechanism.joints:
        if body in joint.bodies and joint.rows:
            if not joint.lets_turn(body):
                return False
            side = "ij"[joint.bodies.index(body)]
            arms.append([float(part) for part in at.arm(joint, side)])
    return bool(np.ptp(arms, axis=0).max() <= POINT_SAME * system.length)
