"""Plan shared by all linkages of one topology: the system, its pivots, and the index of each
number.

Links hang on a tree of pins that begins at the ground. Every other pin closes a loop; its two rows
are written in the axes of one of its links, along and across the line from the pin by which this
link hangs. There the link's angle has a coefficient of constant size across, and none along, so
that fixed pivots stay good however the links turn: in the axes of the ground every pivot of a link
that turns round vanishes somewhere.
"""

from __future__ import annotations

import functools
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from mbody.core.tolerances import TINY
from mbody.kernels.constraints import KINDS as PRIMITIVE_KINDS
from mbody.kernels.forces import KINDS as ACTION_KINDS
from mbody.kernels.friction import BY_RATES
from mbody.kernels.layout import Layout
from mbody.kernels.loop_closure import violation
from mbody.laws import LAW_KINDS, Constant, ConstantSpeed
from mbody.model.driver import AngleDriver
from mbody.model.element import Element
from mbody.model.joints import PinSlot, Revolute
from mbody.model.mechanism import Mechanism
from mbody.system.assembler import connected_parts, eliminate, split
from mbody.system.pivoting import LARGEST, PivotChoices, choose_pivots
from mbody.system.system import System

# -- Topology as a graph of joints and links: tree of pins, pins that close loops --------------
# Links hang on a tree of pins that begins at the ground. Every other pin closes a loop.

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
    tail = row[places * bars :]
    # joints that are not there are last
    fixed = tuple(k for k in range(joints) if tail[k])
    own_slides = joints + drivers
    pairs = zip(tail[own_slides : own_slides + slides], tail[own_slides + slides :], strict=True)
    return Graph(
        1 + max(k for one in links for k in one),
        tuple(one for one in links if one),
        fixed,
        tuple(link for link in tail[joints:own_slides] if link >= 0),
        tuple((k, on) for k, on in pairs if k >= 0),
    )


# -- The system of a linkage from its graph alone, without the elements of a description -------
# It has the layout that `mbody.system.assembler.assemble` makes of the same joints described as
# elements (`tests/support/linkage_elements.py`), number for number: revolute joints, rows along a
# line, driven angles, gravity.

#: Numbers that the loops of kernels read beyond the parameters of the last action.
SPARE = 8
#: Parameters of each kind of primitive, and behind them the body-fixed position on j.
PARAMETERS = {"revolute": 4, "coordinate": 6, "angle": 1}
POSITION_ON_J = 2


@dataclass(frozen=True, eq=False)
class LinkageSystem:
    """A system, and which of its primitives are which.

    `system`: Numbers are zeros and unit masses; its model length is one, its description has no
      elements.
    `pins` (pins of the tree, 4): Its primitive, its joint, and its links i and j, `GROUND` or a
      number.
    `closing` (rows that close loops, 6): The same, the joint by which link i hangs, and whether it
      is the row across.
    `slides` (slides, 4): As the pins, in the order of the graph.
    `drivers` (drivers,): The primitive of each driver.
    """

    system: System
    pins: np.ndarray
    closing: np.ndarray
    slides: np.ndarray
    drivers: np.ndarray


def linkage_system(graph: Graph) -> LinkageSystem:
    """The system of a topology whose coordinates are as many as its rows."""
    tree, closes = graph.edges
    pins = _table(tree, 3)
    closing = np.repeat(_table(closes, 4), 2, axis=0)
    across = np.tile([0, 1], len(closes))
    slides = _table([(k, on, graph.first(k)) for k, on in graph.slides], 3)
    counts = {
        "revolute": len(pins),
        "coordinate": len(closing) + len(slides),
        "angle": len(graph.drivers),
    }
    # kernels take primitives by their kinds
    kinds = sorted(counts, key=PRIMITIVE_KINDS.index)
    sizes = [counts[kind] for kind in kinds]
    first = dict(zip(kinds, np.cumsum([0, *sizes]).tolist(), strict=False))
    kind = np.repeat([PRIMITIVE_KINDS.index(name) for name in kinds], sizes)
    bodies = len(graph.links)
    sides = {
        "revolute": pins[:, 1:3],
        "coordinate": np.concatenate([closing[:, 1:3], slides[:, 1:3]]),
        "angle": np.array([(GROUND, link) for link in graph.drivers]).reshape(-1, 2),
    }
    ends = np.concatenate([sides[name] for name in kinds])
    ends[ends == GROUND] = bodies
    parameters = np.repeat([PARAMETERS[name] for name in kinds], sizes)
    layout, size = _layout(bodies, kind, ends, parameters, first["angle"], len(graph.drivers))
    mass = np.ones((3 * bodies + 3, 1))
    mass[3 * bodies :] = 0.0
    shared = _shared()
    rows = {"revolute": "ll", "coordinate": "l", "angle": "a"}
    number = np.arange(len(kind))
    at = {name: number[first[name] : first[name] + counts[name], None] for name in kinds}
    closing_rows = at["coordinate"][: len(closing)]
    return LinkageSystem(
        System(
            mechanism=shared["description"],
            layout=layout,
            values={},
            formulas={},
            par=np.zeros((size, 1)),
            mass=mass,
            batch=None,
            length=1.0,
            lengths=np.ones(bodies),
            spans=np.ones(bodies),
            heaviest=1.0,
            owners=tuple(shared[name] for name in kinds for _ in range(counts[name])),
            row_kinds=tuple(rows[name] for name in kinds for _ in range(counts[name])),
            signals=3 + len(graph.drivers),
            plans={},
            functions=(),
            _compile=_no_numbers,
            _columns=_no_numbers,
        ),
        np.hstack([at["revolute"], pins]),
        np.hstack([closing_rows, closing, across[:, None]]),
        np.hstack([at["coordinate"][len(closing) :], slides]),
        at["angle"][:, 0],
    )


def _layout(
    bodies: int,
    kind: np.ndarray,
    ends: np.ndarray,
    parameters: np.ndarray,
    driver: int,
    drivers: int,
) -> tuple[Layout, int]:
    """The index lists of kernels, and how many numbers they read, of primitives of these kinds
    between these bodies, (primitives, 2), with so many parameters; `driver` is the first driver.

    Laws are zero, those of the drivers, then both parts of gravity; one signal each.
    """
    slots = split(bodies, [(i, j) for i, j in ends.tolist()])
    plan = eliminate(slots)
    count, none = len(kind), np.zeros(0, dtype=np.int64)
    zeros, never = np.zeros(count, dtype=np.int64), np.full(count, -1)
    place = np.empty(len(plan.order), dtype=np.int64)
    place[plan.order] = np.arange(len(plan.order))
    node = place[:count]
    signal = zeros.copy()
    signal[driver : driver + drivers] = 3 * np.arange(1, drivers + 1)
    linear, constant = (
        (LAW_KINDS.index(one.kind), len(one.parameters(one.numbers())), one.table())
        for one in (ConstantSpeed(0.0, 1.0), Constant(0.0))
    )
    laws = [constant, *[linear] * drivers, constant, constant]
    sizes = np.concatenate([parameters + POSITION_ON_J, [size for _, size, _ in laws]])
    offset = np.concatenate([[0], np.cumsum(sizes)])
    # laws that vary come first
    timed = [*range(1, drivers + 1), 0, drivers + 1, drivers + 2]
    one = np.zeros(1, dtype=np.int64)
    driven = np.arange(driver, driver + drivers)
    ground = np.full(1, bodies)
    tables = [table for _, _, table in laws]
    starts = np.concatenate([[0], np.cumsum([len(table) for table in tables])])
    column = [3 * s for n in plan.order for s in slots.sides[n][:2]]
    return (
        Layout(
            bodies=bodies,
            slots=len(slots.body),
            nodes=len(slots.sides),
            **dict.fromkeys(
                ("owns", "formula_numbers", "driver_steps", "load_steps", "force_steps"), 0
            ),
            **dict.fromkeys(("active_set", "moving", "input_row", "loop_row"), none),
            **{f"friction_{key}": none for key in ("kind", "node", "tangent", "par", "signal")},
            primitive_kind=kind,
            primitive_i=ends[:, 0],
            primitive_j=ends[:, 1],
            primitive_par=offset[:count],
            primitive_count=parameters,
            primitive_arm=offset[1 : count + 1] - POSITION_ON_J,
            primitive_signal=signal,
            primitive_node=node,
            primitive_law=never,
            primitive_handle=never,
            written_node=node,
            slip_signs=BY_RATES,
            node_column=column,
            more=np.zeros((0, 2), dtype=np.int64),
            sum_start=np.zeros(count + 1, dtype=np.int64),
            part=np.zeros((0, 5), dtype=np.int64),
            **plan.lists(),
            slot_body=slots.body,
            body_slot=np.searchsorted(slots.body, np.arange(bodies)),
            body_part=connected_parts(bodies, ends.tolist()),
            law_kind=[kind for kind, _, _ in laws],
            law_par=offset[count:-1],
            law_count=sizes[count:],
            law_table=starts[:-1],
            law_handle=np.full(len(laws), -1),
            signal_law=timed,
            signal_row=3 * np.array(timed),
            varying=drivers,
            formula_step=np.zeros((0, 4), dtype=np.int64),
            primitive_steps=np.zeros((count, 3), dtype=np.int64),
            driver_row=signal[driven],
            driver_node=node[driven],
            driver_dependent=np.zeros(drivers, dtype=np.int64),
            action_kind=[ACTION_KINDS.index("gravity")],
            action_i=ground,
            action_j=ground,
            action_by=ground,
            action_par=offset[-1:],
            action_count=one,
            action_signal=[3 * (drivers + 1)],
            action_law=np.full(1, -1),
            action_handle=np.full(1, -1),
            action_cause=one,
            table=np.concatenate([*tables, np.zeros(1)]),
        ),
        int(offset[-1]) + SPARE,
    )


def _table(rows: list[Any], width: int) -> np.ndarray:
    return np.array(rows, dtype=np.int64).reshape(-1, width)


@functools.cache
def _shared() -> dict[str, Any]:
    """A description without elements, and an element of each kind that stands for all of it."""

    def of(element: Element) -> tuple[Element, int]:
        return element, 0

    return {
        "description": Mechanism("linkage").closed_with(()),
        "revolute": of(Revolute("pin", "ground", "link")),
        "coordinate": of(PinSlot("row", "ground", "link")),
        "angle": of(AngleDriver("driver", "link", ConstantSpeed(0.0, 1.0))),
    }


def _no_numbers(values: dict[str, Any]) -> Any:
    """Of a description without elements: its numbers come with each linkage."""
    raise TypeError("the numbers of a linkage have no names")


#: Random positions by whose numbers pivots are chosen, and the seed of them.
SAMPLES, SEED = 100, 20


@dataclass(frozen=True, eq=False)
class TopologyPlan:
    """The plan of one topology.

    `system`: Without numbers; its model length is one.
    `pivots`: None where Φ_q is too large for them: each linkage goes the scalar path.
    `pins` (pins of the tree, 4): Its primitive, its joint, and its links i and j, `GROUND` or a
      number.
    `closing` (rows that close loops, 6): The same, the joint by which link i hangs, and whether it
      is the row across.
    `slides` (slides, 4): As the pins, in the order of the graph.
    `drivers` (drivers,): The primitive of each driver.
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

    def body_fixed_positions(self, joints: np.ndarray, cg: np.ndarray) -> np.ndarray:
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
        (coordinates + 3, linkages) in which the linkages are given. `joints` (linkages, joints, 2),
        `cg`, `masses` (linkages, links, 2), `directions` (linkages, slides), `motion` (linkages,
        drivers + 2).

        The rotation of each driver from τ = 0 to 1, the two parts of gravity.
        """
        L, count = self.system.layout, len(joints)
        centre = _with_ground(cg)
        par = np.zeros((len(self.system.par), count))
        # (linkages, …) to rows
        x, c = (np.ascontiguousarray(part.transpose(1, 2, 0)) for part in (joints, centre))
        e, joint, i, j = self.pairs.T
        first, two = L.primitive_par[e][:, None], np.arange(2)
        par[first + two], on_j = x[joint] - c[i], x[joint] - c[j]
        par[first + 2 + two] = on_j
        par[L.primitive_arm[e][:, None] + two] = on_j
        first = L.primitive_par[self.slides[:, 0]] + 4
        par[first], par[first + 1] = -np.sin(directions.T), np.cos(directions.T)
        e, joint, _, _, hang, across = self.closing.T
        line = x[joint] - x[hang]
        line /= np.maximum(np.hypot(line[:, 0], line[:, 1]), TINY)[:, None]
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
