"""Random linkages: a crank, then one Assur group after another on joints that there are.

Groups leave a linkage its one degree of freedom (Assur 1914). Dyads are two bars and a new joint;
sliders one bar to a new joint on a line of the ground or of a link; triads a link with three new
joints, a bar at each. Dyads and sliders are drawn until they close over the whole turn, by their
triangles; whether a triad does is for the analysis to say.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from mbody.errors import ModelError
from mbody.model.element import listed

__all__ = ["ALIKE", "GROUPS", "check_groups", "random_linkages", "shape_of"]

GROUPS = ("dyads", "sliders", "triads")
#: Joints of the crank and the ground before any group.
FIRST = 3
#: Angles of the crank at which a group must close, and the least sin² of a dyad's angle there, and
#: of the angle between the bar of a slider and the normal of its line the least cos².
ANGLES, LEAST = 73, 0.01
#: Places that are tried for a new joint.
TRIES = 12
#: Linkages of each topology that are drawn.
ALIKE = 16
#: How often a group is a slider, and a linkage has a triad.
SLIDERS, TRIADS = 0.25, 0.5

#: Positions (linkages, angles, 2) of a new joint, and whether it closes (linkages,).
Placed = tuple[np.ndarray, np.ndarray]


def check_groups(groups: tuple[str, ...], nodes: int) -> None:
    """Refuse groups that are not known, or of which no linkage of so many joints can be made.

    Raises
    ------
    ModelError
    """
    for name in groups:
        if name not in GROUPS:
            raise ModelError(f"there are no groups {name!r} (there are: {listed(GROUPS)})")
    if not groups:
        raise ModelError(f"name one or more groups: {listed(GROUPS)}")
    least = FIRST + (3 if groups == ("triads",) else 1)
    if nodes < least:
        raise ModelError(
            f"linkages of {listed(groups)} have {least} joints or more, not {nodes}: the crank and "
            f"the ground have {FIRST}"
        )
    if groups == ("triads",) and nodes % 3:
        raise ModelError(f"triads alone make linkages of 6, 9, 12 … joints, not of {nodes}")


def shape_of(nodes: int, groups: tuple[str, ...]) -> tuple[int, int, int]:
    """Most links, places of a link and slides of linkages of so many joints."""
    added = nodes - FIRST
    bars = 1 + (2 * added if "dyads" in groups else added + added // 3)
    return bars, 3 if "triads" in groups else 2, added if "sliders" in groups else 0


@dataclass
class _Batch:
    """Linkages of one topology that grow, joint by joint."""

    joints: np.ndarray
    path: np.ndarray
    links: list[tuple[int, ...]] = field(default_factory=lambda: [(0, 1)])
    slides: list[tuple[int, int]] = field(default_factory=list)
    directions: list[np.ndarray] = field(default_factory=list)

    def keep(self, good: np.ndarray) -> None:
        """Only these linkages."""
        self.joints, self.path = self.joints[good], self.path[good]
        self.directions = [one[good] for one in self.directions]


def random_linkages(
    topologies: int,
    nodes: int,
    random: np.random.Generator,
    groups: tuple[str, ...] = ("dyads",),
    turn: float = 2.0 * np.pi,
) -> dict[str, np.ndarray]:
    """Arrays for `mbody.linkages`: so many random topologies, up to 16 linkages of each.

    Parameters
    ----------
    topologies, nodes : int
        How many; joints of each.
    random : numpy.random.Generator
    groups : tuple of str
        "dyads", "sliders", "triads": which are drawn.
    turn : float
        The turn of the crank [rad] over which dyads and sliders must close.

    Returns
    -------
    dict of arrays
        Joints within a box of about one length, some of them outside after the first three.
        Joints 0 and 2 are on the ground, link 0 is the crank.
    """
    check_groups(groups, nodes)
    made = [_batch(nodes, random, groups, turn) for _ in range(topologies)]
    bars, places, slides = shape_of(nodes, groups)
    parts: dict[str, list[np.ndarray]] = {"joints": [], "links": [], "slides": [], "directions": []}
    for one in made:
        count = len(one.joints)
        links = np.full((bars, places), -1)
        for n, link in enumerate(one.links):
            links[n, : len(link)] = link
        on = np.full((slides, 2), -1)
        along = np.zeros((count, slides))
        for n, pair in enumerate(one.slides):
            on[n], along[:, n] = pair, one.directions[n]
        parts["joints"].append(one.joints)
        parts["links"].append(np.tile(links, (count, 1, 1)))
        parts["slides"].append(np.tile(on, (count, 1, 1)))
        parts["directions"].append(along)
    found = {name: np.concatenate(own) for name, own in parts.items()}
    count = len(found["joints"])
    return found | {"ground": np.tile([0, 2], (count, 1)), "driver": np.zeros(count, dtype=int)}


def _batch(nodes: int, random: np.random.Generator, groups: tuple[str, ...], turn: float) -> _Batch:
    """Linkages of one random topology; few or none where they seldom close."""
    angles = np.linspace(0.0, turn, ANGLES)
    joints = np.zeros((ALIKE, nodes, 2))
    joints[:, :FIRST] = random.random((ALIKE, FIRST, 2))
    path = np.zeros((ALIKE, nodes, ANGLES, 2))
    path[:, 0], path[:, 2] = joints[:, 0, None], joints[:, 2, None]
    crank = joints[:, 1] - joints[:, 0]
    path[:, 1] = joints[:, 0, None] + _turned(crank[:, None], angles)
    batch = _Batch(joints, path)
    triad = "triads" in groups and nodes >= FIRST + 3
    triad &= groups == ("triads",) or random.random() < TRIADS
    closed = ["dyads" in groups, "sliders" in groups]
    k = FIRST
    while k < nodes:
        left = nodes - k
        if triad and (left == 3 or not any(closed)):
            _add_triad(batch, k, random)
            k += 3
            continue
        if closed[1] and (not closed[0] or random.random() < SLIDERS):
            _add_slider(batch, k, random)
        else:
            _add_dyad(batch, k, random)
        k += 1
    return batch


def _turned(v: np.ndarray, angles: np.ndarray) -> np.ndarray:
    """Vectors (…, 2) turned by angles."""
    c, s = np.cos(angles), np.sin(angles)
    return np.stack([c * v[..., 0] - s * v[..., 1], s * v[..., 0] + c * v[..., 1]], axis=-1)


def _pair(below: int, random: np.random.Generator) -> tuple[int, int]:
    i, j = random.choice(below, 2, replace=False).tolist()
    return int(i), int(j)


def _place(
    batch: _Batch,
    k: int,
    random: np.random.Generator,
    placed: Callable[[np.ndarray, np.ndarray], Placed],
) -> np.ndarray:
    """Draw joint k of every linkage until it closes; linkages for which it never does are left
    out. placed: its path, of linkages and its first positions. Gives which stay.
    """
    good = np.zeros(len(batch.joints), dtype=bool)
    for _ in range(TRIES):
        rest = np.flatnonzero(~good)
        if not rest.size:
            break
        x = random.random((len(rest), 2))
        path, closes = placed(rest, x)
        batch.joints[rest[closes], k] = x[closes]
        batch.path[rest[closes], k] = path[closes]
        good[rest[closes]] = True
    return good


def _add_dyad(batch: _Batch, k: int, random: np.random.Generator) -> None:
    """Joint k on bars to two joints before it."""
    i, j = _pair(k, random)

    def placed(rest: np.ndarray, x: np.ndarray) -> Placed:
        start, end = batch.path[rest, i], batch.path[rest, j]
        d = end - start
        square = np.maximum((d * d).sum(axis=2), 1e-12)
        own, other = x - batch.joints[rest, i], x - batch.joints[rest, j]
        a, b = (own * own).sum(axis=1)[:, None], (other * other).sum(axis=1)[:, None]
        along = (square + a - b) / (2.0 * square)
        across = a / square - along**2
        first = batch.joints[rest, j] - batch.joints[rest, i]
        side = np.sign(first[:, 0] * own[:, 1] - first[:, 1] * own[:, 0])[:, None]
        height = side * np.sqrt(np.maximum(across, 0.0))
        normal = np.stack([-d[..., 1], d[..., 0]], axis=2)
        path = start + along[..., None] * d + height[..., None] * normal
        # sin² of the angle between the bars
        return path, (across * square * square > LEAST * a * b).all(axis=1)

    good = _place(batch, k, random, placed)
    batch.links += [(i, k), (j, k)]
    batch.keep(good)


def _add_slider(batch: _Batch, k: int, random: np.random.Generator) -> None:
    """Joint k on a bar to a joint before it, on a line of the ground or of a bar."""
    i = int(random.integers(0, k))
    bars = [n for n, link in enumerate(batch.links) if i not in link]
    on = -1 if not bars or random.random() < 0.5 else int(random.choice(bars))
    directions = random.uniform(0.0, np.pi, len(batch.joints))

    def placed(rest: np.ndarray, x: np.ndarray) -> Placed:
        start = batch.path[rest, i]
        angle = np.broadcast_to(directions[rest, None], start.shape[:2])
        through = np.broadcast_to(x[:, None], start.shape)
        if on >= 0:
            p, q = batch.links[on][:2]
            line = batch.path[rest, q] - batch.path[rest, p]
            begun = line[:, 0]
            turned = np.arctan2(line[..., 1], line[..., 0])
            turned = turned - np.arctan2(begun[:, 1], begun[:, 0])[:, None]
            angle = angle + turned
            through = batch.path[rest, p] + _turned((x - batch.joints[rest, p])[:, None], turned)
        u = np.stack([np.cos(angle), np.sin(angle)], axis=2)
        d = through - start
        length = ((x - batch.joints[rest, i]) ** 2).sum(axis=1)[:, None]
        far = d[..., 0] * u[..., 1] - d[..., 1] * u[..., 0]
        left = length - far**2
        middle = (d * u).sum(axis=2)
        sign = np.sign(middle[:, :1])
        travel = sign * np.sqrt(np.maximum(left, 0.0)) - middle
        path = through + travel[..., None] * u
        return path, (left > LEAST * length).all(axis=1) & (sign[:, 0] != 0.0)

    good = _place(batch, k, random, placed)
    batch.links.append((i, k))
    batch.slides.append((k, on))
    batch.directions.append(directions)
    batch.keep(good)


def _add_triad(batch: _Batch, k: int, random: np.random.Generator) -> None:
    """Joints k to k + 2 on one link, each on a bar to a joint before it."""
    ends = random.choice(k, 3, replace=False).tolist()
    batch.joints[:, k : k + 3] = random.random((len(batch.joints), 3, 2))
    # the paths are not known here: further groups may not stand on a triad
    batch.links += [(k, k + 1, k + 2), *((int(end), k + n) for n, end in enumerate(ends))]
