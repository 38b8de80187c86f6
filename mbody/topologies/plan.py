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
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from mbody.core.tolerances import TINY
from mbody.errors import ModelError
from mbody.kernels.constraints import KINDS as PRIMITIVE_KINDS
from mbody.kernels.loop_closure import violation
from mbody.laws import Constant, ConstantSpeed
from mbody.model.body import Body
from mbody.model.driver import AngleDriver
from mbody.model.element import Element, listed
from mbody.model.joints import PinSlot, Revolute
from mbody.model.loads import Gravity
from mbody.model.mechanism import Mechanism
from mbody.model.primitives import ConstraintPrimitive, ForcePrimitive, Signal
from mbody.system.assembler import SPARE, Topology, assemble, index_lists
from mbody.system.pivoting import LARGEST, PivotChoices, choose_pivots
from mbody.system.system import RecordedLaw, System

# -- Linkages as arrays, many of different topology at once, without any element objects -------

#: What an array of linkages may contain.
NEEDED = ("joints", "links", "ground", "driver")
OPTIONAL = ("mass", "inertia", "cg", "slides", "directions")


@dataclass(frozen=True, eq=False)
class LinkageArrays:
    """Checked arrays; −1 and NaN where a linkage has no more of something.

    `joints` (linkages, joints, 2)
    `links` (linkages, links, places): The joints of each link; the driven link is one of them.
    `ground` (linkages, joints)
    `driver` (linkages, drivers): The driven links, −1 where there are fewer.
    `mass`, `inertia` (linkages, links)
    `cg` (linkages, links, 2)
    `slides` (linkages, slides, 2): Joint, and the link on which it slides, −1 for the ground; joint
      −1 where there is none.
    `directions` (linkages, slides)
    `failures`: What is wrong with a linkage, by its number.
    """

    joints: np.ndarray
    links: np.ndarray
    ground: np.ndarray
    driver: np.ndarray
    mass: np.ndarray
    inertia: np.ndarray
    cg: np.ndarray
    slides: np.ndarray
    directions: np.ndarray
    failures: dict[int, str]

    def __len__(self) -> int:
        return len(self.joints)


def linkage_arrays(arrays: Mapping[str, Any]) -> LinkageArrays:
    """The arrays of a user, checked."""
    if not isinstance(arrays, Mapping):
        raise ModelError(
            f"linkages takes a dict of arrays ({listed(NEEDED)}), not {type(arrays).__name__}"
        )
    unknown = [str(name) for name in arrays if name not in (*NEEDED, *OPTIONAL)]
    if unknown:
        raise ModelError(
            f"linkages know no array '{unknown[0]}' (there are: {listed((*NEEDED, *OPTIONAL))})"
        )
    missing = [name for name in NEEDED if name not in arrays]
    if missing:
        raise ModelError(f"the array '{missing[0]}' of the linkages is missing: give it")
    joints = _numbers("joints", arrays["joints"], (None, None, 2))
    count, nodes = joints.shape[:2]
    links = _integers("links", arrays["links"], (count, None, None))
    ground = _integers("ground", arrays["ground"], (count, None))
    driver = _driver(arrays["driver"], count)
    slides = _integers(
        "slides", arrays.get("slides", np.empty((count, 0, 2), np.int64)), (count, None, 2)
    )
    directions = _numbers(
        "directions", arrays.get("directions", np.zeros(slides.shape[:2])), slides.shape[:2]
    )
    fixed = np.zeros((count, nodes + 1), dtype=bool)
    np.put_along_axis(fixed, np.where((ground < 0) | (ground >= nodes), nodes, ground), True, 1)
    present = (links >= 0) & (links < nodes)
    # numbers that are none, or too large, are found where they are used
    with np.errstate(invalid="ignore", over="ignore"):
        mass, inertia, cg = _uniform(joints, links, present)
    found = {"mass": mass, "inertia": inertia, "cg": cg}
    for name, own in found.items():
        if name in arrays:
            found[name] = _numbers(name, arrays[name], own.shape)
    there = present.any(axis=2)
    for name in ("mass", "inertia"):
        found[name] = np.where(there, found[name], 0.0)
    found["cg"] = np.where(there[:, :, None], found["cg"], 0.0)
    made = LinkageArrays(
        joints,
        links,
        fixed[:, :nodes],
        driver,
        **found,
        slides=slides,
        directions=directions,
        failures={},
    )
    if count:
        _refuse(made, ground)
    return made


def _driver(value: Any, count: int) -> np.ndarray:
    """The driven links of each linkage, one or several."""
    one = np.ndim(value) == 1
    found = _integers("driver", value, (count,) if one else (count, None))
    return found[:, None] if one else found


def _numbers(name: str, value: Any, shape: tuple[int | None, ...]) -> np.ndarray:
    return _array(name, value, shape, "iuf").astype(np.float64)


def _integers(name: str, value: Any, shape: tuple[int | None, ...]) -> np.ndarray:
    found = _array(name, value, shape, "iu")
    if found.dtype == np.uint64:
        # what does not fit is a number too large as well
        found = np.minimum(found, np.uint64(np.iinfo(np.int64).max))
    return found.astype(np.int64)


def _array(name: str, value: Any, shape: tuple[int | None, ...], kinds: str) -> np.ndarray:
    """An array of numbers of that shape, None where any size is allowed."""
    try:
        found = np.asarray(value)
    except (TypeError, ValueError):
        raise ModelError(
            f"'{name}' of the linkages is no array: its rows differ in length"
        ) from None
    fits = found.ndim == len(shape)
    fits = fits and all(n in (None, m) for n, m in zip(shape, found.shape, strict=True))
    if not fits:
        wanted = ", ".join("any" if n is None else str(n) for n in shape)
        raise ModelError(f"'{name}' of the linkages has the shape {found.shape}: give ({wanted})")
    if found.dtype.kind not in kinds:
        what = "whole numbers" if kinds == "iu" else "numbers"
        raise ModelError(f"'{name}' of the linkages has the type {found.dtype}: give {what}")
    return found


def _uniform(
    joints: np.ndarray, links: np.ndarray, present: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Mass, inertia and mass centre of links of uniform bars of unit mass a length: one from each
    joint of a link to its next, of more than two joints closed to a polygon.
    """
    places = links.shape[2]
    rows = np.arange(len(joints))[:, None, None]
    own = np.where(present[..., None], joints[rows, np.where(present, links, 0)], 0.0)
    many = present.sum(axis=2)
    following = np.roll(own, -1, axis=2)
    last = np.arange(places) == many[:, :, None] - 1
    following = np.where(last[..., None], own[:, :, :1], following)
    bar = present & ~(last & (many[:, :, None] <= 2))
    length = np.where(bar, np.hypot(*np.moveaxis(following - own, -1, 0)), 0.0)
    mass = length.sum(axis=2)
    middle = 0.5 * (own + following)
    safe = np.where(mass > 0.0, mass, 1.0)[..., None]
    cg = (length[..., None] * middle).sum(axis=2) / safe
    off = middle - cg[:, :, None]
    inertia = (length * length * length / 12.0 + length * (off * off).sum(axis=3)).sum(axis=2)
    return mass, inertia, cg


def _refuse(made: LinkageArrays, ground: np.ndarray) -> None:
    """Note what is wrong with single linkages."""
    count, nodes = made.joints.shape[:2]
    links = made.links
    used = (links >= 0) & (links < nodes)
    touched = np.zeros((count, nodes + 1), dtype=bool)
    at = np.where(used, links, nodes).reshape(count, -1)
    np.put_along_axis(touched, at, True, 1)
    there = used.any(axis=2)
    bodies = there.sum(axis=1)
    sorted_places = np.sort(np.where(used, links, -1), axis=2)
    twice = ((np.diff(sorted_places, axis=2) == 0) & (sorted_places[..., 1:] >= 0)).any(axis=(1, 2))
    slid = made.slides[..., 0]
    beyond = ((links >= nodes) | (links < -1)).any(axis=(1, 2))
    beyond |= ((ground >= nodes) | (ground < -1)).any(axis=1)
    beyond |= ((slid >= nodes) | (slid < -1)).any(axis=1)
    driver = np.clip(made.driver, 0, max(links.shape[1] - 1, 0))
    driven = (made.driver >= 0) & (made.driver < links.shape[1])
    if links.shape[1]:
        driven &= there[np.arange(count)[:, None], driver]
    # the first is there, and behind it those that are there come first
    driven |= (made.driver == -1) & (np.arange(made.driver.shape[1]) > 0)
    ends = (made.driver[:, :-1] == -1) & (made.driver[:, 1:] != -1)
    driven = driven.all(axis=1) & ~ends.any(axis=1) & (made.driver.shape[1] > 0)
    sorted_drivers = np.sort(made.driver, axis=1)
    again = (np.diff(sorted_drivers, axis=1) == 0) & (sorted_drivers[:, 1:] >= 0)
    guide = np.clip(made.slides[..., 1], 0, max(links.shape[1] - 1, 0))
    no_guide = np.zeros(count, dtype=bool)
    if made.slides.shape[1] and links.shape[1]:
        no_guide = (
            (slid >= 0)
            & (made.slides[..., 1] >= 0)
            & ~(there[np.arange(count)[:, None], guide] & (made.slides[..., 1] < links.shape[1]))
        ).any(axis=1)
    free = (slid >= 0) & ~touched[np.arange(count)[:, None], np.where(slid < 0, nodes, slid)]
    own = np.zeros(count, dtype=bool)
    if made.slides.shape[1] and links.shape[1]:
        on = links[np.arange(count)[:, None], guide]
        same = (on == slid[:, :, None]).any(axis=2) & (made.slides[..., 1] >= 0)
        own = (same & (slid >= 0)).any(axis=1)
    finite = np.where(touched[:, :nodes, None], np.isfinite(made.joints), True).all(axis=(1, 2))
    masses = np.isfinite(made.mass) & np.isfinite(made.inertia) & np.isfinite(made.cg).all(axis=2)
    light = (made.mass < 0.0).any(axis=1) | (made.inertia < 0.0).any(axis=1)
    finite &= masses.all(axis=1) & np.where(slid >= 0, np.isfinite(made.directions), True).all(1)
    wrong = (
        (beyond, "a link, the ground or a slide names a joint that there is not"),
        (bodies == 0, "it has no links"),
        (twice, "a link names a joint twice"),
        (~driven, "the driver names a link that there is not"),
        (again.any(axis=1), "two drivers turn one link"),
        (no_guide, "a slide is on a link that there is not"),
        (free.any(axis=1), "a joint that slides belongs to no link"),
        (own, "a joint slides on a link that it belongs to"),
        (~finite, "a joint, a mass or a direction is not a finite number"),
        (light, "a mass or an inertia is negative"),
    )
    for which, sentence in wrong:
        for n in np.flatnonzero(which).tolist():
            made.failures.setdefault(n, sentence)


# -- Canonical order of the joints and links of many linkages: equal graphs become equal rows --
# Colours of joints and links are refined by those of their neighbours (Weisfeiler and Leman); where
# joints share a colour the first of them gets one of its own, and all are refined again. Two equal
# graphs could be missed only where that choice matters and the refinement does not show it: then
# they are planned twice, and nothing else.

Words = np.ndarray


@dataclass(frozen=True, eq=False)
class CanonicalOrder:
    """The order of each linkage.

    `joints` (linkages, joints): Joint of the description at each canonical place; those that are
      not there are last.
    `links` (linkages, links)
    `places` (linkages, links, places): Place of the description at each canonical place of each
      canonical link.
    `slides` (linkages, slides)
    `table` (linkages, numbers): The graph in that order; equal rows are equal topologies.
    """

    joints: np.ndarray
    links: np.ndarray
    places: np.ndarray
    slides: np.ndarray
    table: np.ndarray


def canonical_order(made: LinkageArrays) -> CanonicalOrder:
    """The canonical order of every linkage; those of one numbering are ordered once."""
    count = len(made)
    parts = [made.links, made.ground, made.driver, made.slides]
    rows = np.concatenate([part.reshape(count, -1) for part in parts], axis=1)
    _, first, number = np.unique(row_bytes(rows), return_index=True, return_inverse=True)
    found = _order(made.links[first], made.ground[first], made.driver[first], made.slides[first])
    return CanonicalOrder(*(part[number] for part in found))


def row_bytes(table: np.ndarray) -> np.ndarray:
    """Rows of a table as one number of many bytes each, to be compared."""
    table = np.ascontiguousarray(table)
    return table.view(np.dtype((np.void, table.itemsize * table.shape[1]))).reshape(-1)


def _order(
    described: np.ndarray, ground: np.ndarray, driver: np.ndarray, slides: np.ndarray
) -> tuple[np.ndarray, ...]:
    """The parts of a canonical order, of the parts of so many descriptions."""
    count, nodes = ground.shape
    bars, places = described.shape[1:]
    flat = described.reshape(count, -1)
    used = (flat >= 0) & (flat < nodes)
    at = np.where(used, flat, nodes)
    owner = np.repeat(np.arange(bars), places)
    slid = slides[..., 0]
    slid = np.where((slid >= 0) & (slid < nodes), slid, nodes)
    guide = np.where(slid < nodes, slides[..., 1], -1)
    guide = np.where((guide >= -1) & (guide < bars), guide, -1)
    there = np.zeros((count, nodes + 1), dtype=bool)
    np.put_along_axis(there, at, True, 1)
    there[:, nodes] = False
    fixed = np.zeros((count, nodes + 1), dtype=bool)
    fixed[:, :nodes] = ground & there[:, :nodes]
    whole = used.reshape(count, bars, places).any(axis=2)
    # by the number of its driver, from one on
    own_driver = np.zeros((count, bars), dtype=np.int64)
    for which in range(driver.shape[1]):
        driven = np.arange(bars) == driver[:, which, None]
        own_driver = np.where(driven, which + 1, own_driver)
    joint = _mixed(fixed.astype(np.uint64) + np.uint64(2) * there)
    joint[:, nodes] = 0
    link = _mixed(own_driver.astype(np.uint64) + np.uint64(2) * whole + np.uint64(7))
    # those in which joints may still share a colour
    open_rows = np.arange(count)
    while open_rows.size:
        n = open_rows
        fresh, finer = _refined(joint[n], link[n], at[n], slid[n], guide[n], owner)
        joint[n], link[n] = fresh, finer
        order = np.argsort(fresh[:, :nodes], axis=1, kind="stable")
        ranked = np.take_along_axis(fresh[:, :nodes], order, axis=1)
        same = ranked[:, 1:] == ranked[:, :-1]
        same &= np.take_along_axis(there[open_rows], order[:, 1:], axis=1)
        tied = np.flatnonzero(same.any(axis=1))
        if not tied.size:
            break
        # the first of joints that share a colour gets one of its own
        first = order[tied, same[tied].argmax(axis=1)]
        open_rows = open_rows[tied]
        joint[open_rows, first] = _mixed(joint[open_rows, first] + np.uint64(99))
    joint_order = np.lexsort((joint[:, :nodes], ~there[:, :nodes]))
    link_order = np.lexsort((link, ~whole))
    slide_key = _slide_colours(joint, link, slid, guide)
    slide_order = np.lexsort((slide_key, slid == nodes))
    place = _inverse(joint_order, nodes)
    new_link = _inverse(link_order, bars)
    links = np.where(used, np.take_along_axis(place, np.where(used, flat, 0), axis=1), nodes)
    links = links.reshape(count, bars, places)
    links = np.take_along_axis(links, link_order[:, :, None], axis=1)
    place_order = np.argsort(links, axis=2, kind="stable")
    links = np.take_along_axis(links, place_order, axis=2)
    own = np.where(slid < nodes, np.take_along_axis(place, np.minimum(slid, nodes - 1), axis=1), -1)
    on = np.where(guide >= 0, np.take_along_axis(new_link, np.maximum(guide, 0), axis=1), -1)
    table = np.concatenate(
        [
            np.where(links == nodes, -1, links).reshape(count, -1),
            np.take_along_axis(fixed, joint_order, axis=1),
            np.where(
                driver < 0, -1, np.take_along_axis(new_link, np.clip(driver, 0, bars - 1), axis=1)
            ),
            np.take_along_axis(own, slide_order, axis=1),
            np.take_along_axis(on, slide_order, axis=1),
        ],
        axis=1,
    ).astype(np.int16)
    return joint_order, link_order, place_order, slide_order, table


def _refined(
    joint: Words,
    link: Words,
    at: np.ndarray,
    slid: np.ndarray,
    guide: np.ndarray,
    owner: np.ndarray,
) -> tuple[Words, Words]:
    """Colours by those of all neighbours, as often as a graph of so many joints is wide."""
    count, nodes, bars = len(joint), joint.shape[1] - 1, link.shape[1]
    places, row = at.shape[1] // bars, np.arange(count)[:, None]
    for _ in range(nodes // 2 + 1):
        own = (_mixed(joint[row, at]) * (at < nodes)).reshape(count, bars, places)
        link = _mixed(link + np.uint64(3) * own.sum(axis=2, dtype=np.uint64))
        grown = joint.copy()
        np.add.at(grown, (row, at), _mixed(link[:, owner] + np.uint64(5)))
        if slid.shape[1]:
            key = _slide_colours(joint, link, slid, guide)
            np.add.at(grown, (row, slid), key)
            on = np.zeros((count, bars + 1), dtype=np.uint64)
            np.add.at(on, (row, np.where(guide >= 0, guide, bars)), key)
            link = _mixed(link + on[:, :bars])
        grown[:, nodes] = 0
        joint = _mixed(grown)
        joint[:, nodes] = 0
    return joint, link


def _slide_colours(joint: Words, link: Words, slid: np.ndarray, guide: np.ndarray) -> Words:
    """Colours of slides by their joints and the links that they are on."""
    row = np.arange(len(joint))[:, None]
    on = np.where(guide >= 0, link[row, np.maximum(guide, 0)], np.uint64(11))
    return _mixed(joint[row, slid] + np.uint64(13) * _mixed(on))


def _mixed(words: np.ndarray) -> Words:
    """Words that look like chance (the finisher of SplitMix64, Steele, Lea & Flood 2014)."""
    z = words.astype(np.uint64) + np.uint64(0x9E3779B97F4A7C15)
    z = (z ^ (z >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    z = (z ^ (z >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return z ^ (z >> np.uint64(31))


def _inverse(order: np.ndarray, size: int) -> np.ndarray:
    """Place of each number of permutations (linkages, size)."""
    found = np.empty_like(order)
    np.put_along_axis(found, order, np.broadcast_to(np.arange(size), order.shape), 1)
    return found


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
    bodies = len(graph.links)
    sides = {
        "revolute": pins[:, 1:3].tolist(),
        "coordinate": [*closing[:, 1:3].tolist(), *slides[:, 1:3].tolist()],
        "angle": [(GROUND, link) for link in graph.drivers],
    }
    names = [*map(str, range(bodies)), "ground"]
    description, constraints, gravity = _shared()
    owners: list[tuple[Element, int]] = []
    primitives: list[ConstraintPrimitive] = []
    at = {}
    # kernels take primitives by their kinds
    for kind in sorted(sides, key=PRIMITIVE_KINDS.index):
        element, one = constraints[kind]
        at[kind] = len(owners) + np.arange(len(sides[kind]))[:, None]
        owners += [(element, 0)] * len(sides[kind])
        primitives += [
            ConstraintPrimitive(kind, names[i], names[j], one.rows, one.parameters, one.signal)
            for i, j in sides[kind]
        ]
    driven = at["angle"][:, 0]
    laws = [Signal(Constant(0.0), [0.0])]
    laws += [one.signal for one in primitives if one.signal is not None]
    layout, signals = index_lists(
        Topology(
            {name: n for n, name in enumerate(names)},
            owners,
            primitives,
            driven.tolist(),
            [gravity],
            [0],
            [RecordedLaw(law) for law in (*laws, *gravity.signals)],
        )
    )
    mass = np.ones((3 * bodies + 3, 1))
    mass[3 * bodies :] = 0.0
    closing_rows = at["coordinate"][: len(closing)]
    return LinkageSystem(
        System(
            mechanism=description,
            layout=layout,
            values={},
            formulas={},
            par=np.zeros((int(layout.action_par[-1]) + SPARE, 1)),
            mass=mass,
            batch=None,
            length=1.0,
            lengths=np.ones(bodies),
            spans=np.ones(bodies),
            heaviest=1.0,
            owners=tuple(owners),
            row_kinds=tuple(primitive.rows for primitive in primitives),
            signals=signals,
            plans={},
            functions=(),
            _compile=_no_numbers,
            _columns=_no_numbers,
        ),
        np.hstack([at["revolute"], pins]),
        np.hstack([closing_rows, closing, across[:, None]]),
        np.hstack([at["coordinate"][len(closing) :], slides]),
        driven,
    )


def _table(rows: list[Any], width: int) -> np.ndarray:
    return np.array(rows, dtype=np.int64).reshape(-1, width)


@functools.cache
def _shared() -> tuple[Mechanism, dict[str, tuple[Element, ConstraintPrimitive]], ForcePrimitive]:
    """A description without elements; by its kind an element that stands for all such, with its
    primitive; gravity.
    """
    one = Mechanism("linkage")
    one.add(Body("link", mass=1.0, inertia=1.0), Revolute("pin", "ground", "link"))
    one.add(PinSlot("row", "ground", "link"))
    one.add(AngleDriver("driver", "link", ConstantSpeed(0.0, 1.0)), Gravity("gravity"))
    made = assemble(one)
    at = made.numbers
    constraints: dict[str, tuple[Element, ConstraintPrimitive]] = {}
    for element in made.mechanism.constraints:
        primitive = element.primitives(at)[0]
        constraints[primitive.kind] = element, primitive
    return one.closed_with(()), constraints, made.mechanism.loads[0].actions(at)[0]


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
