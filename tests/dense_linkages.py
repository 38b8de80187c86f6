"""Linkages of bars by dense equations in the coordinates of their joints, and random ones of dyads.

Nothing here is of mbody: positions of dyads by triangles, rates and accelerations by the distances
differentiated, forces by Newton and Euler for every bar and the balance of every free joint.
"""

from __future__ import annotations

import numpy as np

Array = np.ndarray


def random_dyads(count: int, nodes: int, seed: int, least: float = 0.03) -> dict[str, Array]:
    """Linkages whose crank turns fully: joints 0 and 2 are fixed, 1 is the end of the crank, each
    further joint is on two bars to random joints before it. `least`: of sin² at every joint.
    """
    random = np.random.default_rng(seed)
    found: list[tuple[Array, Array]] = []
    while len(found) < count:
        x = random.random((nodes, 2))
        links = [(0, 1)]
        for k in range(3, nodes):
            i, j = (int(n) for n in random.choice(k, 2, replace=False))
            links += [(i, k), (j, k)]
        if moved(x, links, np.linspace(0.0, 2.0 * np.pi, 90), least) is not None:
            found.append((x, np.array(links)))
    return {
        "joints": np.array([x for x, _ in found]),
        "links": np.array([links for _, links in found]),
        "ground": np.tile([0, 2], (count, 1)),
        "driver": np.zeros(count, dtype=int),
    }


def moved(x: Array, links, angles: Array, least: float = 0.0) -> Array | None:
    """Positions (angles, joints, 2) of dyads with the crank turned; None where one cannot close."""
    found = np.zeros((len(angles), len(x), 2))
    found[:, 0], found[:, 2] = x[0], x[2]
    crank = x[1] - x[0]
    c, s = np.cos(angles), np.sin(angles)
    found[:, 1] = x[0] + np.stack([c * crank[0] - s * crank[1], s * crank[0] + c * crank[1]], 1)
    for (i, k), (j, _) in zip(links[1::2], links[2::2], strict=True):
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
    x: Array, links, fixed, speed: float, gravity: Array, masses: Array, inertias: Array
) -> tuple[Array, float]:
    """Force on each bar at each of its ends (bars, 2, 2), and the torque on the first, the crank,
    at the positions x of all joints; mass centres in the middle of the bars.
    """
    nodes, bars = len(x), len(links)
    free = [k for k in range(nodes) if k not in fixed and k != 1]
    crank = x[1] - x[0]
    v, a = np.zeros((nodes, 2)), np.zeros((nodes, 2))
    v[1], a[1] = speed * np.array([-crank[1], crank[0]]), -(speed**2) * crank
    matrix = np.zeros((bars - 1, 2 * len(free)))
    ends = [(p, q) for p, q in links[1:]]
    for n, (p, q) in enumerate(ends):
        d = x[q] - x[p]
        for k, sign in ((q, 1.0), (p, -1.0)):
            if k in free:
                matrix[n, 2 * free.index(k) : 2 * free.index(k) + 2] = sign * d
    rates = [-(x[q] - x[p]) @ (v[q] - v[p]) for p, q in ends]
    v[free] = np.linalg.solve(matrix, rates).reshape(-1, 2)
    bends = [-((v[q] - v[p]) @ (v[q] - v[p])) - (x[q] - x[p]) @ (a[q] - a[p]) for p, q in ends]
    a[free] = np.linalg.solve(matrix, bends).reshape(-1, 2)
    size = 4 * bars + 1
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
        if n == 0:
            equations[row + 2, -1] = 1.0
        row += 3
    for k in [1, *free]:
        for n, pair in enumerate(links):
            for end in range(2):
                if pair[end] == k:
                    equations[row, 4 * n + 2 * end] = 1.0
                    equations[row + 1, 4 * n + 2 * end + 1] = 1.0
        row += 2
    assert row == size
    found = np.linalg.solve(equations, right)
    return found[:-1].reshape(bars, 2, 2), float(found[-1])
