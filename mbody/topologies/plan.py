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

from mbody.errors import ModelError
from mbody.kernels.loop_closure import violation
from mbody.laws import ConstantSpeed
from mbody.model.body import Body
from mbody.model.driver import AngleDriver
from mbody.model.element import Marker
from mbody.model.joints import PinSlot, Revolute
from mbody.model.loads import Gravity
from mbody.model.mechanism import Mechanism
from mbody.system.assembler import assemble
from mbody.system.pivoting import LARGEST, PivotChoices, choose_pivots
from mbody.system.system import System

__all__ = ["GROUND", "Graph", "TopologyPlan", "graph_of", "planned"]

#: The link number of the ground.
GROUND = -1
#: Random positions by whose numbers pivots are chosen, and the seed of them.
SAMPLES, SEED = 100, 20


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


@dataclass(frozen=True, eq=False)
class TopologyPlan:
    """The plan of one topology.

    Attributes
    ----------
    graph : Graph
    system : System
        With the numbers of an example; its model length is one.
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
        par = np.repeat(self.system.par[:, :1], count, axis=1)
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
    try:
        system = replace(assemble(_example(graph)), length=1.0)
    except ModelError as error:
        return str(error)
    names = {element.name: e for e, (element, _) in enumerate(system.owners)}
    tree, closing = graph.edges
    pins = [(names[f"R{n}"], *edge) for n, edge in enumerate(tree)]
    rows = [
        (names[f"C{n}_{across}"], *edge, across)
        for n, edge in enumerate(closing)
        for across in (0, 1)
    ]
    slides = [(names[f"S{n}"], k, on, _first(graph, k)) for n, (k, on) in enumerate(graph.slides)]
    plan = TopologyPlan(
        graph,
        system,
        None,
        np.array(pins, dtype=np.int64).reshape(-1, 4),
        np.array(rows, dtype=np.int64).reshape(-1, 6),
        np.array(slides, dtype=np.int64).reshape(-1, 4),
        np.array([names[f"D{n}"] for n in range(len(graph.drivers))], dtype=np.int64),
    )
    if 3 * system.layout.slots > LARGEST:
        return plan
    pivots = _pivots(plan)
    if pivots is None:
        return f"with its {driver} fixed a part can still move while another is held twice"
    return replace(plan, pivots=pivots)


def _with_ground(cg: np.ndarray) -> np.ndarray:
    """Mass centres (linkages, links, 2) with that of the ground, the origin, behind them."""
    return np.concatenate([cg, np.zeros((len(cg), 1, 2))], axis=1)


def _first(graph: Graph, joint: int) -> int:
    """The first link at a joint that is no ground."""
    return next(n for n in graph.of_joint[joint] if n != GROUND)


def _example(graph: Graph) -> Mechanism:
    """A mechanism of this topology; its numbers are replaced."""
    ground = {f"J{k}": (float(k), 1.0) for k in range(graph.joints)}
    made = Mechanism("linkage", units="SI", ground=ground)
    names = {GROUND: "ground"} | {n: f"L{n}" for n in range(len(graph.links))}
    for n, own in enumerate(graph.links):
        made.add(_link(names[n], own))
    tree, closing = graph.edges
    for n, (k, i, j) in enumerate(tree):
        made.add(_pin(f"R{n}", names[i], k, names[j]))
    slots = [(f"C{n}_{a}", i, k, j) for n, (k, i, j, _) in enumerate(closing) for a in (0, 1)]
    slots += [(f"S{n}", on, k, _first(graph, k)) for n, (k, on) in enumerate(graph.slides)]
    for name, i, k, j in slots:
        made.add(_slot(name, names[i], k, names[j]))
    for n, link in enumerate(graph.drivers):
        made.add(AngleDriver(f"D{n}", names[link], ConstantSpeed(0.0, 1.0)))
    made.add(Gravity("gravity", x=0.0, y=-1.0))
    return made


# topologies share most of their elements, which never change
@functools.lru_cache(maxsize=10_000)
def _link(name: str, own: tuple[int, ...]) -> Body:
    points = {f"J{k}": (float(k), 1.0) for k in own}
    return Body(name, mass=1.0, inertia=1.0, points=points, guess=(0.0, 0.0, 0.0))


@functools.lru_cache(maxsize=10_000)
def _pin(name: str, i: str, joint: int, j: str) -> Revolute:
    return Revolute(name, f"{i}.J{joint}", f"{j}.J{joint}")


@functools.lru_cache(maxsize=10_000)
def _slot(name: str, i: str, joint: int, j: str) -> PinSlot:
    return PinSlot(name, Marker(i, (1.0, 0.0)), f"{j}.J{joint}")


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
    works, along = (plan.system.work(), plan.system.work()), []
    for n in range(SAMPLES):
        work = works[0 if n == 0 else 1]
        work.par[:, 0], work.q[:, 0] = par[:, n], q[:, n]
        violation(plan.system.layout, work)
        along.append(work.block[:, 0].copy())
    return choose_pivots(plan.system.layout, *works, along[1:-1])
