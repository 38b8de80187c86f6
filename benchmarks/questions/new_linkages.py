"""Random linkages of many topologies: motion and all forces, beside positions of dyads alone."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

import mbody
from benchmarks.frame import OURS, Row, Scope, in_turn
from benchmarks.peers.dyads import dyad_positions
from mbody.topologies.dataset import random_linkages
from mbody.topologies.plan import planned

__all__ = ["TITLE", "measure"]

TITLE = (
    "Random linkages of dyads, a linkage of 200 positions, sixteen of each topology; the solver "
    "of dyads finds positions alone; error of the lengths of links as a part of the longest"
)
INSTANTS, GRAVITY = 200, (0.0, -9.81)
DYADS = "NumPy, dyad by dyad, positions alone"
NEW = f"{OURS}, every topology new"


def measure(scope: Scope) -> list[Row]:
    """8 and 20 joints."""
    rows = []
    for nodes, topologies in ((8, 8 if scope.short else 48), (20, 4 if scope.short else 16)):
        arrays = random_linkages(topologies, nodes, np.random.default_rng(nodes))
        rows += beside_dyads(arrays, scope)
    return rows


def beside_dyads(arrays: dict[str, np.ndarray], scope: Scope) -> list[Row]:
    """Rows of these linkages, times by their number."""
    count, nodes = arrays["joints"].shape[:2]
    links, fixed = arrays["links"].tolist(), arrays["ground"].tolist()

    def ours() -> np.ndarray:
        return mbody.linkages(arrays, instants=INSTANTS, gravity=GRAVITY).positions

    def new() -> np.ndarray:
        planned.cache_clear()
        return ours()

    def dyads() -> np.ndarray:
        linkages = zip(arrays["joints"], links, fixed, strict=True)
        return np.array([dyad_positions(*one, INSTANTS).swapaxes(0, 1) for one in linkages])

    tasks: dict[str, Callable[[], Any]] = {OURS: ours, NEW: new, DYADS: dyads}
    errors = {name: off_lengths(arrays, task()) for name, task in tasks.items()}
    workload = f"linkage of {nodes} joints ({len(links[0])} links), {INSTANTS} positions"
    return in_turn("new_linkages", workload, tasks, errors, scope, parts=count)


def off_lengths(arrays: dict[str, np.ndarray], found: np.ndarray) -> float:
    """The greatest difference of a link's length from that at the start, by the longest link."""
    worst = 0.0
    for joints, links, path in zip(arrays["joints"], arrays["links"], found, strict=True):
        i, j = links.T
        length = np.hypot(*(joints[j] - joints[i]).T)
        moved = path[:, j] - path[:, i]
        off = np.abs(np.hypot(moved[..., 0], moved[..., 1]) - length).max()
        worst = max(worst, float(off / length.max()))
    return worst
