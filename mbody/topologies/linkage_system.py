"""The system of a linkage from its graph alone, without the elements of a description.

It has the layout that `mbody.system.assembler.assemble` makes of the same joints described as
elements (`tests/linkage_elements.py`), number for number: revolute joints, rows along a line,
driven angles, gravity.
"""

from __future__ import annotations

import functools
from dataclasses import dataclass
from typing import Any

import numpy as np

from mbody.kernels.constraints import KINDS as PRIMITIVE_KINDS
from mbody.kernels.forces import KINDS as ACTION_KINDS
from mbody.kernels.friction_laws import BY_RATES
from mbody.kernels.layout import Layout
from mbody.laws import LAW_KINDS, Constant, ConstantSpeed
from mbody.model.driver import AngleDriver
from mbody.model.element import Element
from mbody.model.joints import PinSlot, Revolute
from mbody.model.mechanism import Mechanism
from mbody.system.elimination_order import eliminate, split
from mbody.system.system import System
from mbody.topologies.graph import GROUND, Graph

__all__ = ["LinkageSystem", "linkage_system"]

#: Numbers that the loops of kernels read beyond the parameters of the last action.
SPARE = 8
#: Parameters of each kind of primitive, and behind them the arm on body j.
PARAMETERS = {"revolute": 4, "coordinate": 6, "angle": 1}
ARM = 2


@dataclass(frozen=True, eq=False)
class LinkageSystem:
    """A system, and which of its primitives are which.

    Attributes
    ----------
    system : System
        Numbers are zeros and unit masses; its model length is one, its description has no
        elements.
    pins : array of int (pins of the tree, 4)
        Its primitive, its joint, and its links i and j, `GROUND` or a number.
    closing : array of int (rows that close loops, 6)
        The same, the joint by which link i hangs, and whether it is the row across.
    slides : array of int (slides, 4)
        As the pins, in the order of the graph.
    drivers : array of int (drivers,)
        The primitive of each driver.
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
    sizes = np.concatenate([parameters + ARM, [size for _, size, _ in laws]])
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
            owns=0,
            formula_numbers=0,
            primitive_kind=kind,
            primitive_i=ends[:, 0],
            primitive_j=ends[:, 1],
            primitive_par=offset[:count],
            primitive_count=parameters,
            primitive_arm=offset[1 : count + 1] - ARM,
            primitive_signal=signal,
            primitive_node=node,
            primitive_law=never,
            primitive_handle=never,
            written_node=node,
            switched=none,
            friction_kind=none,
            friction_node=none,
            friction_tangent=none,
            friction_par=none,
            friction_signal=none,
            senses=BY_RATES,
            moving=none,
            node_column=column,
            more=np.zeros((0, 2), dtype=np.int64),
            sum_start=np.zeros(count + 1, dtype=np.int64),
            part=np.zeros((0, 5), dtype=np.int64),
            node_start=plan.node_start,
            block_row=plan.block_row,
            update=plan.update,
            form_block=plan.form_block,
            form_a=plan.form_a,
            form_b=plan.form_b,
            form_column=plan.form_column,
            form_more=plan.form_more,
            fill=plan.fill,
            slot_body=slots.body,
            body_slot=np.searchsorted(slots.body, np.arange(bodies)),
            law_kind=[kind for kind, _, _ in laws],
            law_par=offset[count:-1],
            law_count=sizes[count:],
            law_table=starts[:-1],
            law_handle=np.full(len(laws), -1),
            signal_law=timed,
            signal_row=3 * np.array(timed),
            varying=drivers,
            formula_step=np.zeros((0, 4), dtype=np.int64),
            driver_steps=0,
            primitive_steps=np.zeros((count, 3), dtype=np.int64),
            load_steps=0,
            input_row=none,
            driver_row=signal[driven],
            driver_node=node[driven],
            driver_follows=np.zeros(drivers, dtype=np.int64),
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
