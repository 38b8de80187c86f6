"""A mechanism of pins, and what touches a straight wall, as plain numbers: all peers are built from
them alike.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

import mbody

__all__ = ["Box", "Pin", "Planar", "Rim", "Spring", "Tree", "planar"]

GROUND = -1
Point = tuple[float, float]


class Pin(NamedTuple):
    """A place on i and a place on j coincide; each from the mass centre in the body's axes."""

    i: int
    j: int
    on_i: Point
    on_j: Point


class Spring(NamedTuple):
    """A straight spring between two places."""

    i: int
    j: int
    on_i: Point
    on_j: Point
    stiffness: float
    free_length: float


class Rim(NamedTuple):
    """A disc of a body, or a point of radius 0, that may touch the wall."""

    body: int
    place: Point
    radius: float
    friction: float
    restitution: float


class Box(NamedTuple):
    """A rectangle about the mass centre, that may touch the wall and the box before it; whatever it
    touches has the same friction, and no rebound.
    """

    body: int
    width: float
    height: float
    friction: float


class Tree(NamedTuple):
    """Bodies from the ground outwards, each on its parent by one pin, the pins that remain, and
    bodies without a way to the ground, from which others begin.
    """

    order: list[int]
    parent: dict[int, int]
    on_parent: dict[int, Point]
    on_own: dict[int, Point]
    loops: list[Pin]
    loose: list[int]


@dataclass
class Planar:
    """Mass, inertia, pose (x, y, θ) of the mass centre and its rates of bodies, and their pins.

    `twists`: Torsion springs (i, j, stiffness), relaxed where both angles are equal.
    `held`: Coordinates (body, number) that a guide keeps at zero.
    `wall`: A place of the ground's straight wall, and its normal.
    """

    mass: np.ndarray
    inertia: np.ndarray
    pose: np.ndarray
    rate: np.ndarray
    pins: list[Pin]
    gravity: float = 0.0
    springs: list[Spring] = field(default_factory=list)
    torques: list[tuple[int, float]] = field(default_factory=list)
    twists: list[tuple[int, int, float]] = field(default_factory=list)
    held: list[tuple[int, int]] = field(default_factory=list)
    rims: list[Rim] = field(default_factory=list)
    boxes: list[Box] = field(default_factory=list)
    wall: tuple[Point, Point] = ((0.0, 0.0), (0.0, 1.0))

    @property
    def bodies(self) -> int:
        """Number of moving bodies."""
        return len(self.mass)

    def tree(self) -> Tree:
        """Spanning tree of the shortest paths to the ground."""
        around: dict[int, list[int]] = {}
        for n, pin in enumerate(self.pins):
            around.setdefault(pin.i, []).append(n)
            around.setdefault(pin.j, []).append(n)
        tree = Tree([], {}, {}, {}, [], [])
        used: set[int] = set()

        def add(body: int, parent: int, on_parent: Point, on_own: Point) -> None:
            tree.order.append(body)
            tree.parent[body], tree.on_parent[body], tree.on_own[body] = parent, on_parent, on_own

        for root in (GROUND, *range(self.bodies)):
            if root in tree.parent:
                continue
            if root != GROUND:
                tree.loose.append(root)
                add(root, GROUND, (0.0, 0.0), (0.0, 0.0))
            front = deque([root])
            while front:
                here = front.popleft()
                for n in around.get(here, []):
                    i, j, on_i, on_j = self.pins[n]
                    if j == here:
                        i, j, on_i, on_j = j, i, on_j, on_i
                    if j == GROUND or j in tree.parent or n in used:
                        continue
                    used.add(n)
                    add(j, i, on_i, on_j)
                    front.append(j)
        tree.loops.extend(pin for n, pin in enumerate(self.pins) if n not in used)
        return tree._replace(order=depth_first(tree))

    def relative(self, tree: Tree) -> tuple[np.ndarray, np.ndarray]:
        """Angles and rates of the bodies against their parents, in the order of the tree."""
        angle, rate = np.append(self.pose[:, 2], 0.0), np.append(self.rate[:, 2], 0.0)
        order, parents = tree.order, [tree.parent[b] for b in tree.order]
        return angle[order] - angle[parents], rate[order] - rate[parents]

    def mass_at(self, rim: Rim) -> float:
        """What a push of the wall on a rim has to move at the start, pins and guides holding."""
        axes = np.eye(2)

        def row(body: int, place: Point, along: np.ndarray) -> np.ndarray:
            found = np.zeros(3 * self.bodies)
            if body != GROUND:
                c, s = np.cos(self.pose[body, 2]), np.sin(self.pose[body, 2])
                x, y = c * place[0] - s * place[1], s * place[0] + c * place[1]
                found[3 * body : 3 * body + 3] = *along, x * along[1] - y * along[0]
            return found

        normal = np.array(self.wall[1])
        push = row(rim.body, rim.place, normal)
        rows = [row(i, at_i, u) - row(j, at_j, u) for i, j, at_i, at_j in self.pins for u in axes]
        rows += [np.eye(3 * self.bodies)[3 * body + number] for body, number in self.held]
        free = 1.0 / np.column_stack([self.mass, self.mass, self.inertia]).ravel()
        moved = free * push
        if rows:
            held = np.array(rows)
            moved = moved - free * (
                held.T @ np.linalg.lstsq(held * free @ held.T, held @ moved, rcond=None)[0]
            )
        return float(1.0 / (push @ moved))


def depth_first(tree: Tree) -> list[int]:
    """The same bodies, every branch in one piece, which Pinocchio's recursions take for granted."""
    children: dict[int, list[int]] = {}
    for body in reversed(tree.order):
        children.setdefault(tree.parent[body], []).append(body)
    found, waiting = [], list(children.get(GROUND, []))
    while waiting:
        found.append(waiting.pop())
        waiting.extend(children.get(found[-1], []))
    return found


def absolute(tree: Tree, relative: np.ndarray) -> np.ndarray:
    """Angles, or rates, of the bodies in their own order from those against the parents."""
    found = np.zeros(len(tree.order) + 1)
    for body, value in zip(tree.order, relative):
        found[body] = found[tree.parent[body]] + value
    return found[:-1]


def planar(system: mbody.System) -> Planar:
    """The numbers of an assembled mechanism where its own `simulate` begins."""
    start = mbody.simulate(system, 1e-9, instants=2).take([0])
    machine = system.mechanism
    index = {**system.bodies, "ground": GROUND}
    values, numbers = system.values, system.numbers
    names = [body.name for body in machine.bodies]

    def ends(element: Any) -> tuple[int, int, Point, Point]:
        arms = [tuple(map(float, numbers.arm(element, side))) for side in ("i", "j")]
        return index[element.i.body], index[element.j.body], arms[0], arms[1]

    def point_of(body: str, point: str) -> Point:
        (x, y), (cx, cy) = numbers.point(f"{body}.{point}"), numbers.point(f"{body}.cg")
        return float(x - cx), float(y - cy)

    masses = system.mass[: system.coordinates, 0].reshape(-1, 3)
    histories = [start[name] for name in names]
    made = Planar(
        mass=masses[:, 0],
        inertia=masses[:, 2],
        pose=np.array([[h.x[0], h.y[0], h.angle[0]] for h in histories]),
        rate=np.array([[h.vx[0], h.vy[0], h.omega[0]] for h in histories]),
        pins=[Pin(*ends(one)) for one in machine.joints if isinstance(one, mbody.Revolute)],
    )
    for joint in machine.joints:
        if isinstance(joint, (mbody.PinSlot, mbody.Prismatic)):
            upright = abs(float(numbers.angle(joint, "i")) - 0.5 * np.pi) < 1e-12
            i, j, on_i, on_j = ends(joint)
            assert i == GROUND and on_i == on_j == (0.0, 0.0) and upright
            made.held += [(j, 0), (j, 2)] if isinstance(joint, mbody.Prismatic) else [(j, 0)]
    for contact in machine.contacts:
        line, shape = contact.shapes
        if hasattr(shape, "polygon"):
            continue  # boxes are the caller's
        angle, name = float(line.angle), contact.j.partition(".")[0]
        made.wall = point_of("ground", line.point), (-float(np.sin(angle)), float(np.cos(angle)))
        radius = float(getattr(shape, "radius", 0.0))
        place = point_of(name, shape.disc if radius else shape.point)
        law = [float(values[f"{contact.name}.{key}"]) for key in ("friction", "restitution")]
        made.rims.append(Rim(index[name], place, radius, *law))
    for load in machine.loads:
        if isinstance(load, mbody.Gravity):
            made.gravity = float(values[f"{load.name}.y"])
        elif isinstance(load, mbody.Spring):
            stiffness, free = (values[f"{load.name}.{k}"] for k in ("stiffness", "free_length"))
            made.springs.append(Spring(*ends(load), float(stiffness), float(free)))
        elif isinstance(load, mbody.Torque):
            made.torques.append((index[load.body], float(values[f"{load.name}.value"])))
        elif isinstance(load, mbody.TorsionSpring):
            twist = index[load.by], index[load.body], float(values[f"{load.name}.stiffness"])
            made.twists.append(twist)
        else:
            raise TypeError(f"{load.name}: peers have no {type(load).__name__}")
    return made
