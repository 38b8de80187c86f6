"""What all linkages of one topology share: the system, its pivots, and where each number goes.

Links hang on a tree of pins that begins at the ground. Every other pin closes a loop; its two rows
are written in the axes of one of its links, along and across the line from the pin by which this
link hangs. There the link's angle has a coefficient of constant size across, and none along, so
that fixed pivots stay good however the links turn: in the axes of the ground every pivot of a link
that turns round vanishes somewhere.
"""

from __future__ import annotations

import functools
from dataclasses import dataclass, replace

import numpy as np

from mbody.kernels.loop_closure import violation
from mbody.system.pivoting import LARGEST, PivotChoices, choose_pivots
from mbody.system.system import System
from mbody.topologies.graph import Graph
from mbody.topologies.linkage_system import linkage_system

__all__ = ["TopologyPlan", "planned"]

#: Random positions by whose numbers pivots are chosen, and the seed of them.
SAMPLES, SEED = 100, 20


@dataclass(frozen=True, eq=False)
class TopologyPlan:
    """The plan of one topology.

    Attributes
    ----------
    graph : Graph
    system : System
        Without numbers; its model length is one.
    pivots : PivotChoices or None
        None where Φ_q is too large for them: each linkage goes the scalar path.
    pins : array of int (pins of the tree, 4)
        Its primitive, its joint, and its links i and j, `GROUND` or a number.
    closing : array of int (rows that close loops, 6)
        The same, the joint by which link i hangs, and whether it is the row across.
    slides : array of int (slides, 4)
        As the pins, in the order of the graph.
    drivers : array of int (drivers,)
        The primitive of each driver.
    """

    graph: Graph
    system: System
    pivots: PivotChoices | None
    pins: np.ndarray
    closing: np.ndarray
    slides: np.ndarray
    drivers: np.ndarray

    @functools.cached_property
    def pairs(self) -> np.ndarray:
        """Of all primitives between links, as of `pins`."""
        return np.concatenate([self.pins, self.closing[:, :4], self.slides])

    @functools.cached_property
    def places(self) -> np.ndarray:
        """Of each place of a link the link, and its number there: (2, places)."""
        found = [(n, p) for n, own in enumerate(self.graph.links) for p in range(len(own))]
        return np.array(found).T

    @functools.cached_property
    def sides(self) -> np.ndarray:
        """Joints at both ends of the sides of all links: (2, sides)."""
        found = [
            pair for own in self.graph.links for pair in zip(own, (*own[1:], own[0]), strict=True)
        ]
        return np.array(found).T

    @functools.cached_property
    def bodies(self) -> np.ndarray:
        """A link at each joint, as kernels count them: the ground is last."""
        found = np.full(self.graph.joints, len(self.graph.links))
        for n, own in enumerate(self.graph.links):
            found[list(own)] = n
        return found

    @functools.cached_property
    def force_at(self) -> np.ndarray:
        """Places that the force on link i and that on link j of each primitive belong to, or −1:
        (primitives, 2).
        """
        places = [(n, k) for n, own in enumerate(self.graph.links) for k in own]
        number = {place: n for n, place in enumerate(places)}
        found = np.full((len(self.system.owners), 2), -1, dtype=np.int64)
        for e, k, i, j in self.pairs.tolist():
            # the force of a slide on its guide is at no joint of it
            found[e] = number.get((i, k), -1), number[j, k]
        return found

    def arms(self, joints: np.ndarray, cg: np.ndarray) -> np.ndarray:
        """Joints (linkages, joints, 2) from the mass centres (linkages, links, 2) of `bodies`:
        (2·joints, linkages).
        """
        found = joints - _with_ground(cg)[:, self.bodies]
        return np.ascontiguousarray(found.reshape(len(joints), -1).T)

    def numbers(
        self,
        joints: np.ndarray,
        cg: np.ndarray,
        masses: np.ndarray,
        directions: np.ndarray,
        motion: np.ndarray,
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Parameters (parameters, linkages) and masses as kernels take them, and the positions
        (coordinates + 3, linkages) in which the linkages are given.

        Parameters
        ----------
        joints : array (linkages, joints, 2)
        cg : array (linkages, links, 2)
        masses : array (linkages, links, 2)
            Mass and inertia.
        directions : array (linkages, slides)
        motion : array (linkages, drivers + 2)
            The turn of each driver from τ = 0 to 1, the two parts of gravity.
        """
        L, count = self.system.layout, len(joints)
        centre = _with_ground(cg)
        par = np.zeros((len(self.system.par), count))
        # (linkages, …) to rows
        x, c = (np.ascontiguousarray(part.transpose(1, 2, 0)) for part in (joints, centre))
        e, joint, i, j = self.pairs.T
        first, two = L.primitive_par[e][:, None], np.arange(2)
        par[first + two], arm = x[joint] - c[i], x[joint] - c[j]
        par[first + 2 + two] = arm
        par[L.primitive_arm[e][:, None] + two] = arm
        first = L.primitive_par[self.slides[:, 0]] + 4
        par[first], par[first + 1] = -np.sin(directions.T), np.cos(directions.T)
        e, joint, _, _, hang, across = self.closing.T
        line = x[joint] - x[hang]
        line /= np.maximum(np.hypot(line[:, 0], line[:, 1]), 1e-300)[:, None]
        line[across == 1] = np.stack([-line[:, 1], line[:, 0]], axis=1)[across == 1]
        par[L.primitive_par[e][:, None] + 4 + two] = line
        for n, law in enumerate(L.law_par[L.primitive_signal[self.drivers] // 3].tolist()):
            par[law], par[law + 1] = 0.0, motion[:, n]
        weight = int(L.action_signal[0]) // 3
        par[L.law_par[weight]], par[L.law_par[weight + 1]] = motion[:, -2], motion[:, -1]
        mass = np.zeros((3 * L.bodies + 3, count))
        mass[0 : 3 * L.bodies : 3] = mass[1 : 3 * L.bodies : 3] = masses[..., 0].T
        mass[2 : 3 * L.bodies : 3] = masses[..., 1].T
        q = np.zeros((3 * L.bodies + 3, count))
        q[0 : 3 * L.bodies : 3], q[1 : 3 * L.bodies : 3] = cg[..., 0].T, cg[..., 1].T
        return par, mass, q


@functools.lru_cache(maxsize=50_000)
def planned(graph: Graph) -> TopologyPlan | str:
    """The plan of a topology, or in a sentence why there is none."""
    surplus = graph.surplus
    driver = "driver" if len(graph.drivers) == 1 else "drivers"
    if surplus > 0:
        freedoms = "degree" if surplus == 1 else "degrees"
        return f"with its {driver} it keeps {surplus} {freedoms} of freedom: it is no mechanism"
    if surplus < 0:
        often = "once" if surplus == -1 else f"{-surplus} times"
        return f"its {driver} and joints hold it {often} too often: it is no mechanism"
    made = linkage_system(graph)
    plan = TopologyPlan(
        graph, made.system, None, made.pins, made.closing, made.slides, made.drivers
    )
    if 3 * made.system.layout.slots > LARGEST:
        return plan
    pivots = _pivots(plan)
    if pivots is None:
        return f"with its {driver} fixed a part can still move while another is held twice"
    return replace(plan, pivots=pivots)


def _with_ground(cg: np.ndarray) -> np.ndarray:
    """Mass centres (linkages, links, 2) with that of the ground, the origin, behind them."""
    return np.concatenate([cg, np.zeros((len(cg), 1, 2))], axis=1)


def _pivots(plan: TopologyPlan) -> PivotChoices | None:
    """Pivots by random positions of random linkages of this topology."""
    graph, random = plan.graph, np.random.default_rng(SEED)
    bars = len(graph.links)
    joints = random.random((SAMPLES, graph.joints, 2))
    cg = random.random((SAMPLES, bars, 2))
    directions = random.uniform(0.0, np.pi, (SAMPLES, len(graph.slides)))
    par, _, q = plan.numbers(
        joints,
        cg,
        np.ones((SAMPLES, bars, 2)),
        directions,
        np.ones((SAMPLES, len(graph.drivers) + 2)),
    )
    works = plan.system.work(), plan.system.work()
    along = np.empty((SAMPLES, len(works[0].block)))
    for n, numbers in enumerate(zip(par.T, q.T, strict=True)):
        work = works[0 if n == 0 else 1]
        work.par[:, 0], work.q[:, 0] = numbers
        violation(plan.system.layout, work)
        along[n] = work.block[:, 0]
    return choose_pivots(plan.system.layout, *works, along[1:-1])
