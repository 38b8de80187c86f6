"""A mechanism of pins as plain numbers, from which the models of all peers are built alike."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

import mbody

__all__ = ["Pin", "Planar", "Spring", "Tree", "planar"]

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


class Tree(NamedTuple):
    """Bodies from the ground outwards, each on its parent by one pin, and the pins that remain."""

    order: list[int]
    parent: dict[int, int]
    on_parent: dict[int, Point]
    on_own: dict[int, Point]
    loops: list[Pin]


@dataclass
class Planar:
    """Mass, inertia, pose (x, y, θ) of the mass centre and its rates of bodies, and their pins."""

    mass: np.ndarray
    inertia: np.ndarray
    pose: np.ndarray
    rate: np.ndarray
    pins: list[Pin]
    gravity: float = 0.0
    springs: list[Spring] = field(default_factory=list)
    torques: list[tuple[int, float]] = field(default_factory=list)

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
        tree = Tree([], {}, {}, {}, [])
        used: set[int] = set()
        front = deque([GROUND])
        while front:
            here = front.popleft()
            for n in around.get(here, []):
                i, j, on_i, on_j = self.pins[n]
                if j == here:
                    i, j, on_i, on_j = j, i, on_j, on_i
                if j == GROUND or j in tree.parent or n in used:
                    continue
                used.add(n)
                tree.order.append(j)
                tree.parent[j], tree.on_parent[j], tree.on_own[j] = i, on_i, on_j
                front.append(j)
        tree.loops.extend(pin for n, pin in enumerate(self.pins) if n not in used)
        return tree._replace(order=depth_first(tree))

    def relative(self, tree: Tree) -> tuple[np.ndarray, np.ndarray]:
        """Angles and rates of the bodies against their parents, in the order of the tree."""
        angle, rate = np.append(self.pose[:, 2], 0.0), np.append(self.rate[:, 2], 0.0)
        order, parents = tree.order, [tree.parent[b] for b in tree.order]
        return angle[order] - angle[parents], rate[order] - rate[parents]


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

    masses = system.mass[: system.coordinates, 0].reshape(-1, 3)
    histories = [start[name] for name in names]
    made = Planar(
        mass=masses[:, 0],
        inertia=masses[:, 2],
        pose=np.array([[h.x[0], h.y[0], h.angle[0]] for h in histories]),
        rate=np.array([[h.vx[0], h.vy[0], h.omega[0]] for h in histories]),
        pins=[Pin(*ends(joint)) for joint in machine.joints],
    )
    for load in machine.loads:
        if isinstance(load, mbody.Gravity):
            made.gravity = float(values[f"{load.name}.y"])
        elif isinstance(load, mbody.Spring):
            stiffness, free = (values[f"{load.name}.{k}"] for k in ("stiffness", "free_length"))
            made.springs.append(Spring(*ends(load), float(stiffness), float(free)))
        elif isinstance(load, mbody.Torque):
            made.torques.append((index[load.body], float(values[f"{load.name}.value"])))
        else:
            raise TypeError(f"{load.name}: peers have no {type(load).__name__}")
    return made
