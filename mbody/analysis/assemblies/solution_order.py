"""Assur groups: what must be solved at one time, in the order in which it can be solved.

A perfect matching of rows and unknowns directs the graph of both, and the groups are its strong
components: they do not depend on the matching (Sljoka, Shai and Whiteley 2011). Where there are
more rows than unknowns, whatever a row to spare can be exchanged with is one group (the
overdetermined part of Dulmage and Mendelsohn), for it is not known beforehand which row to omit.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mbody.analysis.assemblies.linkage import Linkage

__all__ = ["TOO_FEW", "Group", "TooFewRows", "assur_groups"]

#: Why such linkages are searched without a certificate.
TOO_FEW = "its joints are too few for its links"


class TooFewRows(Exception):
    """LoopRows that cannot determine all unknowns, whatever their numbers are."""


@dataclass(frozen=True)
class Group:
    """Bodies whose places, and angles, the pairs determine together.

    Attributes
    ----------
    bodies : tuple of int
    angles : tuple of int
        Unknown angles, by the names of `Linkage.variable`.
    pairs : tuple of int
    """

    bodies: tuple[int, ...]
    angles: tuple[int, ...]
    pairs: tuple[int, ...]


def assur_groups(linkage: Linkage, known: int = -1) -> list[Group]:
    """The groups of a linkage, in the order of solution, one angle taken as known.

    Raises
    ------
    TooFewRows
        Where rows are too few for the unknowns.
    """
    from scipy.sparse import csr_matrix
    from scipy.sparse.csgraph import maximum_bipartite_matching

    names, rows = _pattern(linkage, known)
    if not names:
        return []
    pattern = np.zeros((len(rows), len(names)), dtype=np.int8)
    for r, (_, columns) in enumerate(rows):
        pattern[r, columns] = 1
    match = maximum_bipartite_matching(csr_matrix(pattern), perm_type="column")
    matched = np.flatnonzero(match >= 0)
    if len(matched) < len(names):
        raise TooFewRows
    graph = np.zeros((len(names), len(names)), dtype=np.int8)
    graph[match[matched]] |= pattern[matched]
    spare = np.flatnonzero(match < 0)
    if spare.size:
        _join(graph, _exchangeable(pattern, match, spare))
    # x and y of a body, and both rows of a pin, are solved at one time
    for n in range(0, 2 * linkage.bodies, 2):
        _join(graph, np.array([n, n + 1]))
    for k, (p, _) in enumerate(rows[1:], 1):
        if rows[k - 1][0] == p and match[k] >= 0 and match[k - 1] >= 0:
            _join(graph, match[k - 1 : k + 1])
    return _ordered(linkage, names, rows, pattern, match, graph)


def _pattern(
    linkage: Linkage, known: int
) -> tuple[list[tuple[str, int]], list[tuple[int, list[int]]]]:
    """Names of the unknowns, and of every row its pair and the unknowns in it."""
    angles = sorted({v for v in linkage.variable if v not in (-1, known)})
    names = [(axis, b) for b in range(linkage.bodies) for axis in "xy"]
    names += [("angle", v) for v in angles if _turns(linkage, v)]
    column = {name: k for k, name in enumerate(names)}
    rows = []
    for p, pair in enumerate(linkage.pairs):
        ends = [b for b in (pair.i, pair.j) if b < linkage.bodies]
        turning = {linkage.variable[b] for b in ends} - {-1, known}
        angular = [column["angle", v] for v in sorted(turning)]
        for axes in ("x", "y") if pair.kind == "pin" else ("xy",):
            places = [column[axis, b] for b in ends for axis in axes]
            rows.append((p, [*places, *angular]))
    return names, rows


def _turns(linkage: Linkage, v: int) -> list[int]:
    """Bodies that turn with an unknown angle; a rod's own direction is no unknown of the count."""
    return [b for b in range(linkage.bodies) if linkage.variable[b] == v]


def _exchangeable(pattern: np.ndarray, match: np.ndarray, spare: np.ndarray) -> np.ndarray:
    """Unknowns of all rows that an alternating path leads to from a row to spare."""
    from scipy.sparse import csr_matrix
    from scipy.sparse.csgraph import breadth_first_order

    count = len(match)
    owner = {int(c): r for r, c in enumerate(match) if c >= 0}
    after = np.zeros((count, count), dtype=np.int8)
    for r in range(count):
        for c in np.flatnonzero(pattern[r]):
            after[r, owner[int(c)]] = 1
    graph = csr_matrix(after)
    reached = {int(k) for r in spare for k in breadth_first_order(graph, int(r))[0]}
    return np.flatnonzero(pattern[sorted(reached)].any(axis=0))


def _join(graph: np.ndarray, columns: np.ndarray) -> None:
    """Make unknowns one component."""
    graph[columns, np.roll(columns, 1)] = 1


def _ordered(
    linkage: Linkage,
    names: list[tuple[str, int]],
    rows: list[tuple[int, list[int]]],
    pattern: np.ndarray,
    match: np.ndarray,
    graph: np.ndarray,
) -> list[Group]:
    from scipy.sparse import csr_matrix
    from scipy.sparse.csgraph import connected_components

    count, label = connected_components(csr_matrix(graph), connection="strong")
    needs: dict[int, set[int]] = {k: set() for k in range(count)}
    for a, b in zip(*np.nonzero(graph), strict=True):
        if label[a] != label[b]:
            needs[int(label[a])].add(int(label[b]))
    order: list[int] = []
    while len(order) < count:
        order += [k for k in needs if k not in order and needs[k] <= set(order)]
    place = {k: n for n, k in enumerate(order)}
    # a pair belongs where the last of its unknowns is found
    of: dict[int, int] = {}
    for r, (p, _) in enumerate(rows):
        last = max((place[int(label[c])] for c in np.flatnonzero(pattern[r])), default=0)
        of[p] = max(of.get(p, 0), last)
    found = []
    for n, k in enumerate(order):
        own = [names[c] for c in np.flatnonzero(label == k)]
        found.append(
            Group(
                bodies=tuple(sorted({b for axis, b in own if axis == "x"})),
                angles=tuple(v for axis, v in own if axis == "angle"),
                pairs=tuple(sorted(p for p, where in of.items() if where == n)),
            )
        )
    return found
