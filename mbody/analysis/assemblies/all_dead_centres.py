"""The verb `dead_centres`: every dead centre of a driver, in all assembly modes, certified.

With the driver fixed, the position is determined group by group, and a dead centre is where the
Jacobian of one group is singular: f(α, s) = 0 for the groups up to it and ∂f/∂x n = 0 for its own
unknowns x, n ≠ 0, the driver's value unknown too. The groups after it must close there as well. In
∂f/∂α n the components of n multiply cosines of single angles, as displacements on slides do, so
that the search of assembly modes solves these rows too. n is scaled in patches, one component 1 and
no other beyond ±1. Where a slide turns with the only link of its group, as in a slotted lever, the
link's component is 1: then the products with the displacement are of two unknowns again.

Of a driver of a length the value x is the unknown: of a cylinder a displacement along its rod,
whose direction α is in no other row. ∂f/∂α n is −x n_α i e^{iα} then, in which x n_α is one
component, zero where n_α is, and x itself is not in these rows.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from mbody.analysis.assemblies.assembly_modes import driver_named
from mbody.analysis.assemblies.box_search import GroupRows, LoopRows, all_roots
from mbody.analysis.assemblies.linkage import (
    TOO_FEW,
    Group,
    Linkage,
    NotCovered,
    State,
    TooFewRows,
    assur_groups,
)
from mbody.analysis.position.assembly_analysis import check_determined, closed
from mbody.core.presentation import Presented
from mbody.core.tolerances import BOX_ROOTS_SAME, BOX_VECTOR_ROUNDING, BOX_WIDENING
from mbody.errors import ModelError
from mbody.model.driver import Driver
from mbody.model.element import listed
from mbody.model.mechanism import Mechanism
from mbody.quantities.evaluate import short_degrees
from mbody.solution.doubts import Doubt, Inherited, status_of
from mbody.system.system import System

#: Boxes that the search of all groups may examine.
MOST = 60_000
#: What is said of drivers and linkages that the search does not cover.
NO_PROOF = "there is no proof that there are no others"


@dataclass(frozen=True)
class SingularPosition:
    """One dead centre.

    `value`: Of the driver: of an angle 0 … 2π [rad], or of a length [length].
    `bodies`: Of the group whose links cannot go on.
    """

    driver: str
    value: float
    bodies: tuple[str, ...]


@dataclass(frozen=True, kw_only=True, eq=False)
class DeadCentres(Inherited, Presented):
    """All dead centres of one driver, in all assembly modes, in the order of its values.

    `complete`: Whether it is proven that there are no more.
    `full_turn`: Whether the driver turns all the way round in every mode: True where it is proven
      that there is no dead centre, False where there is one, None where nothing is proven, and of a
      length.
    `boxes`: How many boxes the search examined.
    `closes`: False where it is proven that the loops close at no value of the driver; it does not
      turn.
    """

    mechanism: Mechanism = field(repr=False)
    driver: str
    positions: tuple[SingularPosition, ...]
    complete: bool
    boxes: int = 0
    closes: bool = True

    @property
    def full_turn(self) -> bool | None:
        """Whether the driver turns all the way round in every mode."""
        if self.positions or not self.closes:
            return False
        return True if self.complete and self.angular else None

    @property
    def angular(self) -> bool:
        """Whether the driver drives an angle."""
        return any(d.angular for d in self.mechanism.drivers if d.name == self.driver)

    @property
    def values(self) -> np.ndarray:
        """Values of the driver [rad or length], each once, ascending."""
        found: list[float] = []
        greatest = max((abs(one.value) for one in self.positions), default=1.0)
        same = BOX_ROOTS_SAME if self.angular else BOX_ROOTS_SAME * greatest
        for one in self.positions:
            if not found or one.value - found[-1] > same:
                found.append(one.value)
        return np.array(found)

    def __len__(self) -> int:
        return len(self.positions)

    def __iter__(self) -> Iterator[SingularPosition]:
        return iter(self.positions)

    def data(self, angle: str | None = None) -> list[dict[str, Any]]:
        """Plain values, ready for JSON; angles in `angle`."""
        in_unit = short_degrees if angle != "rad" and self.angular else float
        return [
            {"driver": one.driver, "value": in_unit(one.value), "bodies": list(one.bodies)}
            for one in self.positions
        ]


def dead_centres_at(system: System, found: Driver, others: dict[str, float]) -> DeadCentres:
    """Those of a driver where others have these values, or stand where their laws begin."""
    try:
        return _all(system, found, others)
    except NotCovered as reason:
        why = str(reason)
    except TooFewRows:
        check_determined(system, closed(system, 0.0, others), "dead_centres")
        why = TOO_FEW
    return _result(system, found, [], f"{NO_PROOF}: {why}", 0)


def single_driver(system: System, name: str | None) -> Driver:
    """The driver of that name; without one the only one."""
    if name is not None:
        return driver_named(system, name)
    if len(system.independent_drivers) != 1:
        raise ModelError(
            f"'{system.mechanism.name}' has {len(system.independent_drivers)} drivers "
            f"({listed(d.name for d in system.independent_drivers) or 'none'}): name the one that "
            "you mean"
        )
    return system.independent_drivers[0]


def _all(system: System, driver: Driver, others: dict[str, float]) -> DeadCentres:
    if not driver.angular:
        return _all_of_length(system, driver, others)
    # the angle between two moving links is that of one as the other sees it
    linkage = Linkage(system, others, released=driver.name, base=driver.bodies[0])
    body = linkage.index[driver.bodies[1]]
    own = linkage.variable[body]
    groups = assur_groups(linkage, own)
    positions, boxes, reason = [], 0, ""
    for n, group in enumerate(groups):
        if not group.angles and not _slides(linkage, group):
            continue
        searched = _singular(linkage, groups, n, own, MOST - boxes)
        boxes, reason = boxes + searched.boxes, searched.reason or reason
        names = tuple(linkage.names[b] for b in group.bodies)
        for x, _ in searched.found:
            value = linkage.angle(body, {own: float(x[0])}) % (2.0 * math.pi)
            positions.append(SingularPosition(driver.name, value, names))
    closes = True
    if not positions and not reason:
        # without a dead centre as many modes close at every value of the driver as at this one
        closes, more = _closes_here(system, others)
        boxes += more
    return _result(system, driver, positions, reason, boxes, closes)


def _all_of_length(system: System, driver: Driver, others: dict[str, float]) -> DeadCentres:
    """Those of a driver of a length: of its group and of those after it. Those before it are where
    they are whatever its value.
    """
    linkage = Linkage(system, others, released=driver.name)
    groups = assur_groups(linkage)
    free = next(p for p, pair in enumerate(linkage.pairs) if pair.free)
    first = next(n for n, group in enumerate(groups) if free in group.pairs)
    rod = linkage.pairs[free].kind == "rod"
    positions, boxes, reason = [], 0, ""
    for n in range(first, len(groups)):
        group = groups[n]
        if reason:
            break
        if not group.angles and not _slides(linkage, group):
            continue
        searched = _singular(linkage, groups, n, -1, MOST - boxes)
        boxes, reason = boxes + searched.boxes, searched.reason or reason
        names = tuple(linkage.names[b] for b in group.bodies)
        for x, made in searched.found:
            value = float(x[made.rows.angles + made.free])
            if value > 0.0 or not rod:  # a rod rotated by half a revolution has a negative length
                positions.append(SingularPosition(driver.name, value, names))
    closes = True
    if not positions and not reason:
        closes, more = _closes_here(system, others)
        boxes += more
    return _result(system, driver, positions, reason, boxes, closes)


@dataclass(frozen=True, eq=False)
class _Searched:
    """Positions where the Jacobian of one group is singular, as unknowns with the rows that they
    are of; why there may be others, and the boxes that were examined.
    """

    found: list[tuple[np.ndarray, GroupRows]]
    reason: str
    boxes: int


def _singular(linkage: Linkage, groups: list[Group], n: int, own: int, most: int) -> _Searched:
    """Search the positions where group n is singular and those after it close."""
    found: list[tuple[np.ndarray, GroupRows]] = []
    seen: list[np.ndarray] = []
    boxes, reason = 0, ""
    for made, rows, displacement_bound in _patches(linkage, groups[: n + 1], own):
        whole = made.rows.unknowns
        roots = all_roots(rows, max(most - boxes, 1), displacement_bound)
        boxes += roots.boxes
        if not made.rows.bounded:
            reason = "slides in it may run as far as they like"
        if len(roots.low):
            reason = "positions stay open, as where branches cross (a change point)"
            if roots.boxes >= most:
                reason = f"the search ended after {roots.boxes} boxes"
            if own < 0:
                break  # nothing is proven any more, and families take long
        if len(rows.B) > rows.unknowns and len(roots.points):
            # a root with rows to spare need not be one where the driver turns back
            reason = "joints are redundant, and branches may cross"
            continue
        for x in roots.points:
            angles = x[: rows.angles]
            key = np.concatenate(
                [np.cos(angles), np.sin(angles), x[rows.angles : whole] / rows.scale]
            )
            within = np.abs(x[whole:]) <= 1.0 + BOX_VECTOR_ROUNDING
            if within.all() and not any(np.abs(key - k).max() < BOX_ROOTS_SAME for k in seen):
                seen.append(key)
                closes, more = _go_on(linkage, groups[n + 1 :], made.solved(x[:whole]))
                boxes += more
                if closes:
                    found.append((x, made))
    return _Searched(found, reason, boxes)


def _closes_here(system: System, others: dict[str, float]) -> tuple[bool, int]:
    """Whether the loops close where the drivers begin, others at these values, and the boxes that
    were examined.
    """
    fixed = Linkage(system, others)
    return _go_on(fixed, assur_groups(fixed), ({}, {fixed.bodies: 0j}))


def _go_on(linkage: Linkage, later: list[Group], state: State) -> tuple[bool, int]:
    """Whether the groups after a singular one close there, and the boxes that were examined; what
    stays open may close.
    """
    states, boxes = [state], 0
    for group in later:
        following = []
        for one in states:
            rows = GroupRows(linkage, group, one)
            found = all_roots(rows.rows, MOST)
            boxes += found.boxes
            if len(found.low):
                return True, boxes
            following += [rows.solved(x) for x in found.points]
        states = following
    return bool(states), boxes


def _slides(linkage: Linkage, group: Group) -> bool:
    return any(linkage.pairs[p].kind != "pin" for p in group.pairs)


def _patches(
    linkage: Linkage, groups: list[Group], own: int
) -> Iterator[tuple[GroupRows, LoopRows, np.ndarray]]:
    """The groups together, and patch by patch the rows of closing and of the singular Jacobian of
    the last of them, with the bounds of the displacements; components of n follow the unknowns of
    the groups.
    """
    pairs = tuple(p for group in groups for p in group.pairs)
    ends = np.cumsum([len(group.pairs) for group in groups]).tolist()
    whole = Group(
        bodies=tuple(b for group in groups for b in group.bodies),
        angles=(*((own,) if own >= 0 else ()), *(v for group in groups for v in group.angles)),
        pairs=pairs,
    )
    made = GroupRows(linkage, whole, ({}, {linkage.bodies: 0j}), tuple(ends))
    rows = made.rows
    if len(set(rows.angle_index.tolist())) < len(rows.angle_index):
        raise NotCovered("gears turn inside a loop")
    earlier = {v for group in groups[:-1] for v in group.angles} | {own}
    earlier |= {
        v for n, v in enumerate(made.names) if n >= len(whole.angles) and _early(made, v, groups)
    }
    rotating = [
        d for d in range(len(rows.angle_index)) if made.names[rows.angle_index[d]] not in earlier
    ]
    last = set(groups[-1].pairs)
    slides = [m for p, m in made.slide_of.items() if p in last]
    driven = [m for m, d in enumerate(rows.along) if d in rotating and m != made.free]
    rod = _free_rod(linkage, made, rotating)
    if driven and rod >= 0:
        raise NotCovered("a slide turns with its guide, in the group of the driver")
    if driven:
        if len(rotating) > 1 or slides != driven or len(driven) > 1:
            raise NotCovered("a slide turns with its guide, in a group of several links or slides")
        yield made, *_rotating_slide(rows, rotating[0], driven[0])
        return
    columns = [
        rows.scale * 1j * rows.Q[:, made.free] if d == rod else rows.ratio[d] * 1j * rows.P[:, d]
        for d in rotating
    ]
    columns += [rows.scale * rows.Q[:, m] for m in slides]
    along = [*rotating, *(rows.along[m] for m in slides)]
    kept = np.flatnonzero(np.abs(np.array(columns)).max(axis=0) > 0.0)
    if all(d < 0 for d in along):
        constant = np.array(columns).real
        if np.linalg.matrix_rank(constant) == len(columns):
            return  # the same Jacobian everywhere, which is regular
    for j in range(len(columns)):
        yield made, *_patch(rows, columns, along, kept, j)


def _patch(
    rows: LoopRows, columns: list[np.ndarray], along: list[int], kept: np.ndarray, j: int
) -> tuple[LoopRows, np.ndarray]:
    others = [k for k in range(len(columns)) if k != j]
    count, directions = len(kept), rows.P.shape[1]
    P = np.zeros((count, directions), dtype=complex)
    B = np.zeros(count)
    if along[j] >= 0:
        P[:, along[j]] = columns[j][kept]
    else:
        B = columns[j][kept].real
    Q = np.array([columns[k][kept] for k in others]).reshape(len(others), count).T
    size = rows.Q.shape[1]
    upper = np.concatenate([rows.Q, np.zeros((len(rows.B), len(others)))], axis=1)
    lower = np.concatenate([np.zeros((count, size)), Q], axis=1)
    made = rows.extended(
        np.concatenate([rows.P, P]),
        np.concatenate([upper, lower]),
        np.concatenate([rows.B, B]),
        [*rows.along, *(along[k] for k in others)],
    )
    displacement_bound = np.concatenate(
        [rows.displacement_bound, np.full(len(others), 1.0 + BOX_WIDENING)]
    )
    return made, displacement_bound


def _rotating_slide(rows: LoopRows, d: int, m: int) -> tuple[LoopRows, np.ndarray]:
    """The one patch of a slide that turns with the only link of the group: its direction alone
    cannot close, so that the link's component of n is 1. The loop bounds that of the slide.
    """
    guide = rows.Q[:, m]
    kept = np.flatnonzero((np.abs(rows.P[:, d]) > 0.0) | (np.abs(guide) > 0.0))
    coefficient, unit = float(np.abs(rows.P[:, d]).max()), float(np.abs(guide).max())
    most = (coefficient / unit + rows.displacement_bound[m]) * (1.0 + BOX_WIDENING)
    count, size = len(kept), rows.Q.shape[1]
    P = np.zeros((count, rows.P.shape[1]), dtype=complex)
    P[:, d] = rows.ratio[d] * 1j * rows.P[kept, d]
    lower = np.zeros((count, size + 1), dtype=complex)
    lower[:, m], lower[:, size] = rows.ratio[d] * 1j * guide[kept], most * guide[kept]
    upper = np.concatenate([rows.Q, np.zeros((len(rows.B), 1))], axis=1)
    made = rows.extended(
        np.concatenate([rows.P, P]),
        np.concatenate([upper, lower]),
        np.concatenate([rows.B, np.zeros(count)]),
        [*rows.along, d],
    )
    return made, np.concatenate([rows.displacement_bound, [1.0 + BOX_WIDENING]])


def _early(made: GroupRows, v: int, groups: list[Group]) -> bool:
    """Whether a rod's direction is found before the last group."""
    last = set(groups[-1].pairs)
    rods = [p for p, pair in enumerate(made.linkage.pairs) if pair.rod >= 0]
    return not any(made.linkage.variable[made.linkage.pairs[p].rod] == v for p in rods if p in last)


def _free_rod(linkage: Linkage, made: GroupRows, rotating: list[int]) -> int:
    """The direction of the rod whose length is the driver's value, where it turns with the last
    group; -1 for others.
    """
    d = made.rows.along[made.free] if made.free >= 0 else -1
    if d not in rotating:
        return -1
    (pair,) = (one for one in linkage.pairs if one.free)
    if pair.kind != "rod":
        raise NotCovered("the driver's guide turns in the group that it moves")
    if np.abs(made.rows.P[:, d]).max(initial=0.0) > 0.0 or made.rows.along.count(d) > 1:
        raise NotCovered("another link keeps the direction of the driver's rod")
    return d


def _result(
    system: System,
    driver: Driver,
    positions: list[SingularPosition],
    reason: str,
    boxes: int,
    closes: bool = True,
) -> DeadCentres:
    doubts = []
    if reason:
        message = f"dead centres of '{driver.name}' may be missing: {reason}"
        doubts.append(Doubt("incomplete", message, elements=(driver.name,)))
    return DeadCentres(
        mechanism=system.mechanism,
        driver=driver.name,
        positions=tuple(sorted(positions, key=lambda one: one.value)),
        complete=not reason,
        boxes=boxes,
        closes=closes,
        status=status_of("completed", doubts),
        doubts=tuple(doubts),
        notes=(*system.notes, *(doubt.message for doubt in doubts)),
    )
