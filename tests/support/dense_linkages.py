"""Linkages of bars by dense equations in the coordinates of their joints, and random ones of dyads.

Nothing here is of mbody: positions of dyads by triangles, rates and accelerations by the distances
differentiated, forces by Newton and Euler for every bar and the balance of every free joint.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

Array = np.ndarray


def random_dyads(
    count: int, nodes: int, seed: int, least: float = 0.03, turns: Sequence[float] = (2.0 * np.pi,)
) -> dict[str, Array]:
    """Linkages whose cranks turn by `turns`: joints 0 and 2 are fixed, 1 is the end of the first
    crank, 3 and 4 are a second one, and so on; each further joint is on two bars to random joints
    before it. `least`: of sin² at every joint.
    """
    random = np.random.default_rng(seed)
    found: list[tuple[Array, Array]] = []
    cranks = [(0, 1), *((2 * n + 1, 2 * n + 2) for n in range(1, len(turns)))]
    angles = np.linspace(0.0, 1.0, 90)[:, None] * np.array(turns)
    while len(found) < count:
        x = random.random((nodes, 2))
        links = list(cranks)
        for k in range(2 * len(turns) + 1, nodes):
            i, j = (int(n) for n in random.choice(k, 2, replace=False))
            links += [(i, k), (j, k)]
        if moved(x, links, angles, least) is not None:
            found.append((x, np.array(links)))
    driver = np.tile(np.arange(len(turns)), (count, 1))
    return {
        "joints": np.array([x for x, _ in found]),
        "links": np.array([links for _, links in found]),
        "ground": np.tile([0, 2, *(i for i, _ in cranks[1:])], (count, 1)),
        "driver": driver if len(turns) > 1 else driver[:, 0],
    }


def moved(x: Array, links, angles: Array, least: float = 0.0) -> Array | None:
    """Positions (angles, joints, 2) of dyads with the cranks turned, the first links, by angles
    (angles,) or (angles, cranks); None where one cannot close.
    """
    angles = angles.reshape(len(angles), -1)
    cranks = angles.shape[1]
    found = np.repeat(x[None], len(angles), axis=0)
    for (i, k), angle in zip(links[:cranks], angles.T, strict=True):
        crank, c, s = x[k] - x[i], np.cos(angle), np.sin(angle)
        found[:, k] = x[i] + np.stack([c * crank[0] - s * crank[1], s * crank[0] + c * crank[1]], 1)
    for (i, k), (j, _) in zip(links[cranks::2], links[cranks + 1 :: 2], strict=True):
        d = found[:, j] - found[:, i]
        square = (d * d).sum(axis=1)
        a, b = ((x[k] - x[i]) ** 2).sum(), ((x[k] - x[j]) ** 2).sum()
        along = (square + a - b) / (2.0 * square)
        across = a / square - along**2
        # sin² of the angle between the bars
        if not (across * square / b > least).all():
            return None
        e, f = x[j] - x[i], x[k] - x[i]
        across = np.sign(e[0] * f[1] - e[1] * f[0]) * np.sqrt(across)
        normal = np.stack([-d[:, 1], d[:, 0]], axis=1)
        found[:, k] = found[:, i] + along[:, None] * d + across[:, None] * normal
    return found


def forces_of(
    x: Array, links, fixed, speeds: Sequence[float], gravity: Array, masses: Array, inertias: Array
) -> tuple[Array, Array]:
    """Force on each bar at each of its ends (bars, 2, 2), and the torque on the first, the cranks,
    of these speeds, at the positions x of all joints; mass centres in the middle of the bars.
    """
    nodes, bars, cranks = len(x), len(links), len(speeds)
    moving = [k for _, k in links[:cranks]]
    free = [k for k in range(nodes) if k not in fixed and k not in moving]
    v, a = np.zeros((nodes, 2)), np.zeros((nodes, 2))
    for (i, k), speed in zip(links[:cranks], speeds, strict=True):
        crank = x[k] - x[i]
        v[k], a[k] = speed * np.array([-crank[1], crank[0]]), -(speed**2) * crank
    matrix = np.zeros((bars - cranks, 2 * len(free)))
    ends = [(p, q) for p, q in links[cranks:]]
    for n, (p, q) in enumerate(ends):
        d = x[q] - x[p]
        for k, sign in ((q, 1.0), (p, -1.0)):
            if k in free:
                matrix[n, 2 * free.index(k) : 2 * free.index(k) + 2] = sign * d
    rates = [-(x[q] - x[p]) @ (v[q] - v[p]) for p, q in ends]
    v[free] = np.linalg.solve(matrix, rates).reshape(-1, 2)
    bends = [-((v[q] - v[p]) @ (v[q] - v[p])) - (x[q] - x[p]) @ (a[q] - a[p]) for p, q in ends]
    a[free] = np.linalg.solve(matrix, bends).reshape(-1, 2)
    size = 4 * bars + cranks
    equations, right = np.zeros((size, size)), np.zeros(size)
    row = 0
    for n, (p, q) in enumerate(links):
        d = x[q] - x[p]
        square = d @ d
        e, f = a[q] - a[p], 0.5 * (a[p] + a[q])
        alpha = (d[0] * e[1] - d[1] * e[0]) / square
        for part in range(2):
            equations[row + part, [4 * n + part, 4 * n + 2 + part]] = 1.0
            right[row + part] = masses[n] * (f[part] - gravity[part])
        # moments about the middle
        equations[row + 2, 4 * n : 4 * n + 4] = 0.5 * np.array([d[1], -d[0], -d[1], d[0]])
        right[row + 2] = inertias[n] * alpha
        if n < cranks:
            equations[row + 2, 4 * bars + n] = 1.0
        row += 3
    for k in [*moving, *free]:
        for n, pair in enumerate(links):
            for end in range(2):
                if pair[end] == k:
                    equations[row, 4 * n + 2 * end] = 1.0
                    equations[row + 1, 4 * n + 2 * end + 1] = 1.0
        row += 2
    assert row == size
    found = np.linalg.solve(equations, right)
    return found[: 4 * bars].reshape(bars, 2, 2), found[4 * bars :]
