"""One topology as a graph of joints and links: its tree of pins, and the pins that close loops.

Links hang on a tree of pins that begins at the ground. Every other pin closes a loop.
"""

from __future__ import annotations

import functools
from dataclasses import dataclass

import numpy as np

__all__ = ["GROUND", "Graph", "graph_of"]

#: The link number of the ground.
GROUND = -1


@dataclass(frozen=True)
class Graph:
    """One topology: joints of each link, joints on the ground, the driven links, and of each slide
    its joint and the link that it is on.
    """

    joints: int
    links: tuple[tuple[int, ...], ...]
    fixed: tuple[int, ...]
    drivers: tuple[int, ...]
    slides: tuple[tuple[int, int], ...]

    @functools.cached_property
    def of_joint(self) -> list[list[int]]:
        """Of each joint the links that meet there, the ground first."""
        found: list[list[int]] = [[] for _ in range(self.joints)]
        for joint in self.fixed:
            found[joint].append(GROUND)
        for n, own in enumerate(self.links):
            for joint in own:
                found[joint].append(n)
        return found

    @functools.cached_property
    def edges(self) -> tuple[list[tuple[int, int, int]], list[tuple[int, int, int, int]]]:
        """Pins of the tree, (joint, link i, link j), and those that close loops, (joint, link i,
        link j, joint by which link i hangs).
        """
        tree, hangs, order = [], {GROUND: GROUND}, [GROUND]
        for link in order:
            at = self.fixed if link == GROUND else self.links[link]
            for joint in at:
                for other in self.of_joint[joint]:
                    if other not in hangs:
                        hangs[other] = joint
                        order.append(other)
                        tree.append((joint, link, other))
        depth = {link: n for n, link in enumerate(order)}
        pins: list[list[set[int]]] = [[] for _ in range(self.joints)]
        for k, i, j in tree:
            pins[k].append({i, j})
        closing = []
        for joint in range(self.joints):
            # links that pins of the tree hold together there, those nearest to the ground first
            parts = [{link} for link in self.of_joint[joint]]
            for pair in pins[joint]:
                joined = [part for part in parts if part & pair]
                parts = [part for part in parts if not part & pair] + [set().union(*joined)]
            roots = sorted(
                (min(part, key=lambda n: depth.get(n, 0)) for part in parts),
                key=lambda n: depth.get(n, 0),
            )
            closing += [(joint, i, roots[0], hangs.get(i, joint)) for i in roots[1:]]
        return tree, closing

    def first(self, joint: int) -> int:
        """The first link at a joint that is no ground."""
        return next(n for n in self.of_joint[joint] if n != GROUND)

    @property
    def surplus(self) -> int:
        """Coordinates less rows: zero where the drivers leave no freedom."""
        meeting = [len(own) for own in self.of_joint]
        rows = sum(2 * (m - 1) for m in meeting if m) + len(self.slides)
        rows += len(self.drivers)
        return 3 * len(self.links) - rows


def graph_of(table: bytes, shape: tuple[int, int, int, int, int]) -> Graph:
    """The graph of a row of a canonical table; shape: joints, links, places, drivers and slides."""
    joints, bars, places, drivers, slides = shape
    row = np.frombuffer(table, dtype=np.int16).tolist()
    own = [row[places * n : places * (n + 1)] for n in range(bars)]
    links = tuple(tuple(k for k in one if k >= 0) for one in own)
    rest = row[places * bars :]
    # joints that are not there are last
    fixed = tuple(k for k in range(joints) if rest[k])
    own_slides = joints + drivers
    pairs = zip(rest[own_slides : own_slides + slides], rest[own_slides + slides :], strict=True)
    return Graph(
        1 + max(k for one in links for k in one),
        tuple(one for one in links if one),
        fixed,
        tuple(link for link in rest[joints:own_slides] if link >= 0),
        tuple((k, on) for k, on in pairs if k >= 0),
    )
