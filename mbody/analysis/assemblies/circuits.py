"""The verb `circuits`: which assembly modes the motion of the joints leads from one to another."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from itertools import islice, pairwise
from typing import Any

import numpy as np

from mbody.analysis.assemblies.assembly_modes import (
    AssemblyModes,
    assembly_modes,
    checked_driver_values,
    driver_named,
    same_pose,
)
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
from mbody.analysis.position.assembly_analysis import (
    as_system,
    check_determined,
    closed,
    set_driver_values,
)
from mbody.analysis.position.joint_curve import PACE, JointCurve
from mbody.core import arclength
from mbody.core import tolerances as tol
from mbody.core.presentation import Presented
from mbody.core.tolerances import BOX_ROOTS_SAME, BOX_VECTOR_ROUNDING, BOX_WIDENING
from mbody.errors import ModelError
from mbody.model.driver import Driver
from mbody.model.element import listed, takes_one_design
from mbody.model.mechanism import Mechanism
from mbody.quantities.evaluate import short_degrees
from mbody.quantities.formula import Number
from mbody.solution.declared_result import IncludedResult, ItemTable, Value
from mbody.solution.doubts import Doubt, Inherited, status_of
from mbody.system.system import System

# -- The verb `dead_centres`: every dead centre of a driver, in all assembly modes, certified --
#
# With the driver fixed, the position is determined group by group, and a dead centre is where the
# Jacobian of one group is singular: f(α, s) = 0 for the groups up to it and ∂f/∂x n = 0 for its own
# unknowns x, n ≠ 0, the driver's value unknown too. The groups after it must close there as well.
# In ∂f/∂α n the components of n multiply cosines of single angles, as displacements on slides do,
# so that the search of assembly modes solves these rows too. n is scaled in patches, one component
# 1 and no other beyond ±1. Where a slide turns with the only link of its group, as in a slotted
# lever, the link's component is 1: then the products with the displacement are of two unknowns
# again.
#
# Of a driver of a length the value x is the unknown: of a cylinder a displacement along its rod,
# whose direction α is in no other row. ∂f/∂α n is −x n_α i e^{iα} then, in which x n_α is one
# component, zero where n_α is, and x itself is not in these rows.

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
    """Those of a driver: of every group that its angle moves, or of the group that its length is in
    and those after it, as those before are where they are whatever it is.
    """
    value: Callable[[np.ndarray, GroupRows], float | None]
    if driver.angular:
        # the angle between two moving links is that of one as the other sees it
        linkage = Linkage(system, others, released=driver.name, base=driver.bodies[0])
        body = linkage.index[driver.bodies[1]]
        own, first = linkage.variable[body], 0
        groups = assur_groups(linkage, own)

        def value(x: np.ndarray, _: GroupRows) -> float | None:
            return linkage.angle(body, {own: float(x[0])}) % (2.0 * math.pi)
    else:
        linkage, own = Linkage(system, others, released=driver.name), -1
        groups = assur_groups(linkage)
        free = next(p for p, pair in enumerate(linkage.pairs) if pair.free)
        first = next(n for n, group in enumerate(groups) if free in group.pairs)
        rod = linkage.pairs[free].kind == "rod"

        def value(x: np.ndarray, made: GroupRows) -> float | None:
            length = float(x[made.rows.angles + made.free])
            # a rod rotated by half a revolution has a negative length
            return length if length > 0.0 or not rod else None

    positions, boxes, reason = [], 0, ""
    for n, group in enumerate(groups[first:], first):
        if reason and own < 0:
            break  # nothing is proven any more, and families take long
        if not group.angles and not _slides(linkage, group):
            continue
        searched = _singular(linkage, groups, n, own, MOST - boxes)
        boxes, reason = boxes + searched.boxes, searched.reason or reason
        names = tuple(linkage.names[b] for b in group.bodies)
        found = (value(x, made) for x, made in searched.found)
        positions += [SingularPosition(driver.name, at, names) for at in found if at is not None]
    closes = True
    if not positions and not reason:
        # without a dead centre as many modes close at every value of the driver as at this one
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


# -- Curve of positions with one driver released, walked step by step --------------------------

#: Steps of one walk.
STEPS = 20_000
#: How far a length may go, in model lengths.
LONGEST_TRAVEL = 100.0


@dataclass
class CircuitWalk:
    """One circuit, walked until it closes.

    `passed`: Value and mode, by their numbers, in the order in which they were passed.
    `stretches`: The same between dead centres.
    `dead_centres`: Values of the driver, unwrapped from the first value.
    `low`, `high`: How far the driver went.
    `advance`: By how much the driver's value has changed when the circuit closed.
    `leapt`: Whether it went straight on where branches meet, or come too near to be told apart.
    `trouble`: Why the walk ended before that; empty where it closed.
    """

    passed: list[tuple[int, int]] = field(default_factory=list)
    stretches: list[list[tuple[int, int]]] = field(default_factory=lambda: [[]])
    dead_centres: list[float] = field(default_factory=list)
    low: float = 0.0
    high: float = 0.0
    advance: float = 0.0
    leapt: bool = False
    trouble: str = ""


class CircuitCurve:
    """The curve that the joints leave with a driver released, walked to find its modes."""

    def __init__(
        self, system: System, driver: Driver, driver_values: dict[str, float], x: float
    ) -> None:
        work = system.work()
        set_driver_values(system, work, 0.0, {**driver_values, driver.name: x})
        self.curve = JointCurve(system, work, driver)
        self.period = 2.0 * math.pi if driver.angular else math.inf

    def walk(
        self,
        pose: np.ndarray,
        begin: tuple[int, int],
        values: list[float],
        mode_at: Callable[[int, np.ndarray], int | None],
        geared: bool = False,
    ) -> CircuitWalk:
        """Walk from a mode, the driver's value growing first, until it is passed again. `pose`
        (coordinates + 3,).
        """
        curve, found = self.curve, CircuitWalk(passed=[begin], stretches=[[begin]])
        start = curve.point(pose[: curve.n] / curve.system.coordinate_units)
        start = replace(start, value=self._known(start.value, values[begin[0]]))
        found.low = found.high = start.value
        steps = arclength.walk(start, curve.close, PACE, curve.leaps)
        for here, there, leapt in islice(steps, STEPS):
            found.leapt |= leapt
            reverses = here.rate * there.rate < 0.0
            path = [here, curve.dead_centre(here, there), there] if reverses else [here, there]
            for k, (one, other) in enumerate(pairwise(path)):
                if k:
                    found.dead_centres.append(one.value)
                    found.stretches.append([])
                found.low, found.high = min(found.low, one.value), max(found.high, one.value)
                for number, value in self._between(values, one.value, other.value):
                    part = (value - one.value) / (other.value - one.value)
                    q = curve.at_value(one.x + part * (other.x - one.x), value)
                    mode = mode_at(number, q)
                    if mode is None:
                        if geared:
                            continue
                        found.trouble = "the path leads through a position that is no known mode"
                        continue
                    found.passed.append((number, mode))
                    found.stretches[-1].append((number, mode))
                    if (number, mode) == begin and len(found.dead_centres) % 2 == 0:
                        found.low, found.high = min(found.low, value), max(found.high, value)
                        found.advance = value - start.value
                        return self._joined(found)
            travel = abs(there.value - start.value)
            if self.period == math.inf and travel > LONGEST_TRAVEL * curve.unit:
                found.trouble = "the driver can go on without end"
                return found
        found.trouble = "branches meet on the way (a change point)"
        if next(steps, None) is not None:
            found.trouble = f"the path does not close within {STEPS} steps"
        return found

    def _known(self, x: float, value: float) -> float:
        """The value of a mode where a position has it but for rounding, so that it is not passed
        once more at the start.
        """
        whole = 0.0 if self.period == math.inf else self.period * round((x - value) / self.period)
        small = tol.LOOP_CLOSURE_CORRECTION * self.curve.unit
        return value + whole if abs(x - value - whole) < small else x

    @staticmethod
    def _joined(found: CircuitWalk) -> CircuitWalk:
        """The last stretch goes on into the first."""
        if len(found.stretches) > 1:
            found.stretches[0] = found.stretches.pop() + found.stretches[0]
        return found

    def _between(self, values: list[float], low: float, high: float) -> list[tuple[int, float]]:
        """Values that lie between two of the driver, the first left out, in their order."""
        found = []
        for number, value in enumerate(values):
            periodic = [value]
            if self.period != math.inf:
                first, last = sorted(((low - value) / self.period, (high - value) / self.period))
                periodic = [
                    value + k * self.period for k in range(math.ceil(first), math.floor(last) + 1)
                ]
            for candidate in periodic:
                if candidate != low and (candidate - low) * (candidate - high) <= 0.0:
                    found.append((number, candidate))
        return sorted(found, key=lambda one: abs(one[1] - low))


REVOLUTION = 2.0 * math.pi


@dataclass(frozen=True)
class Circuit:
    """Positions that the motion of the joints joins.

    `number`: From 1.
    `modes`: Numbers of its assembly modes at the value of the driver; none where it never gets
      there.
    `branches`: The same between dead centres: modes that the driver alone leads from one to
      another.
    `full_turn`: Whether the driver turns all the way round on it; None of a length, or where it is
      open.
    `range`: Least and greatest value of the driver [rad or length], None where it turns round.
    `dead_centres`: Values of the driver [rad or length].
    """

    number: int
    modes: tuple[int, ...]
    branches: tuple[tuple[int, ...], ...]
    full_turn: bool | None
    range: tuple[float, float] | None
    dead_centres: tuple[float, ...]


@dataclass(frozen=True, kw_only=True, eq=False)
class Circuits(Inherited, Presented):
    """All circuits of a mechanism with one driver released.

    `modes`: At the driver's value.
    `dead_centres`: Of the driver in all modes, with their own certificate.
    `complete`: Whether it is proven that there are no more circuits: all dead centres and, between
      them, all modes are certified, and every one lies on a circuit that was walked until it
      closed.
    `within`: Displacements of slides up to which that holds [length]; None where it holds for all.
    """

    mechanism: Mechanism = field(repr=False)
    driver: str
    modes: AssemblyModes
    circuits: tuple[Circuit, ...]
    dead_centres: DeadCentres
    complete: bool
    within: float | None = None

    analysis_name = "assemblies"
    angle_unit = "deg"
    declared = (
        IncludedResult("modes"),
        ItemTable(
            "circuits",
            (
                "number modes full_turn",
                Value("range", "", lambda one: one["kind"]),
            ),
            value=lambda found: [{**vars(one), "kind": found.kind} for one in found.circuits],
        ),
        ItemTable(
            "dead_centres",
            (Value("driver"), Value("value", "", lambda one: one["kind"]), Value("circuit")),
            value=lambda found: [
                {"driver": found.driver, "value": x, "circuit": one.number, "kind": found.kind}
                for one in found.circuits
                for x in one.dead_centres
            ],
        ),
    )

    @property
    def kind(self) -> str:
        """What the driver gives."""
        driver: Any = self.mechanism[self.driver]
        return "angle" if driver.angular else "length"

    def __len__(self) -> int:
        return len(self.circuits)

    def __iter__(self) -> Iterator[Circuit]:
        return iter(self.circuits)

    def __getitem__(self, number: int) -> Circuit:
        return self.circuits[number]

    def of(self, mode: int) -> tuple[int | None, int | None]:
        """Numbers of the circuit and of the branch of a mode; branches are counted over all."""
        branch = 0
        for one in self.circuits:
            for modes in one.branches:
                branch += 1
                if mode in modes:
                    return one.number, branch
        return None, None

    def data(self, angle: str | None = None) -> dict[str, Any]:
        """The modes as data with circuits and dead centres, ready for JSON."""
        found: dict[str, Any] = super().data(angle)
        for mode in found["modes"]:
            mode["circuit"], mode["branch"] = self.of(mode["number"])
        return found


def dead_centres(model: Mechanism | System, driver: str | None = None) -> DeadCentres:
    """All dead centres of a driver, in all assembly modes, with a certificate.

    Where there is none, the driver turns all the way round in every mode, which is Grashof's
    condition for any linkage, proven.

    Parameters
    ----------
    model : Mechanism or System
        Driven so that no freedom is left: pins, rods, slides on guides of known direction, gears.
        Others are where their laws begin.
    driver : str, optional
        Name of the driver or of the driven body; where there is one driver, that one.

    Returns
    -------
    DeadCentres
        `complete` is False, with the reason as a note, where mode and slide move in a way that the
        search does not cover: gears inside loops or beside a driver between two moving links,
        slides that turn in groups of several links, drivers of coordinates on links of their own
        group, cams. What it has then are those that walks along the circuits meet.

    Raises
    ------
    ModelError
        For a driver that there is not, or a batch of designs.
    SolveError
        When the drivers do not determine the position.

    Notes
    -----
    Change points, where branches cross, are no isolated roots and stay open: `complete` is False.
    Cost: 20 ms for a four-bar, below a second for a six-bar.

    Examples
    --------
    A rocker of 6 on a ground of 8, with a coupler of 18 and a rocker of 12:

    >>> import math, mbody
    >>> found = mbody.dead_centres(mbody.makers.four_bar(6, 18, 12, 8, start=math.pi / 2))
    >>> [round(math.degrees(value), 6) for value in found.values], found.complete
    ([48.189685, 311.810315], True)
    >>> mbody.dead_centres(mbody.makers.four_bar(1, 3, 2, 3.5)).full_turn
    True
    """
    system = as_system(model)
    takes_one_design("dead_centres", system.batch)
    one = single_driver(system, driver)
    found = dead_centres_at(system, one, {})
    if found.complete:
        return found
    return circuits_of(system, one, {}, dead=found).dead_centres


def circuits(
    model: Mechanism | System,
    drive: Mapping[str, Number] | None = None,
    *,
    driver: str | None = None,
    used: np.ndarray | None = None,
) -> Circuits:
    """Circuits and branches: which assembly modes the motion of the joints joins.

    From every mode the curve of positions that the joints leave is walked until it closes. Modes
    that it passes are of one circuit; between two dead centres of the driver they are of one
    branch (Chase and Mirth 1993). Between the certified dead centres modes are searched as well, so
    that circuits which never reach the value given are found.

    Parameters
    ----------
    model : Mechanism or System
        Driven so that no freedom is left.
    drive : mapping, optional
        Values of drivers, as `assembly_modes` takes them.
    driver : str, optional
        The driver, or its body, that is released; where there is one driver, that one.
    used : array, optional
        As of `assembly_modes`.

    Returns
    -------
    Circuits

    Raises
    ------
    ModelError, SolveError
        As of `assembly_modes`.

    Notes
    -----
    Cost: 0.05 to 0.3 s a circuit of some ten bodies: a singular value decomposition each step.

    Examples
    --------
    A Grashof four-bar has two circuits, and either mode is one; of another one both modes are one
    circuit with two branches:

    >>> import math, mbody
    >>> [one.full_turn for one in mbody.circuits(mbody.makers.four_bar(1, 3, 2, 3.5))]
    [True, True]
    >>> triple = mbody.makers.four_bar(6, 18, 12, 8, start=math.pi / 2)
    >>> [(one.modes, len(one.branches)) for one in mbody.circuits(triple)]
    [((1, 2), 2)]
    """
    system = as_system(model)
    takes_one_design("circuits", system.batch)
    found = single_driver(system, driver)
    return circuits_of(system, found, checked_driver_values(system, drive), used)


def circuits_of(
    system: System,
    found: Driver,
    given: dict[str, float],
    used: np.ndarray | None = None,
    dead: DeadCentres | None = None,
) -> Circuits:
    """The circuits with that driver released, where its dead centres may be known."""
    modes = assembly_modes(system, given, used=used)
    value = modes.at[found.name]
    others = {name: x for name, x in modes.at.items() if name != found.name}
    dead = dead_centres_at(system, found, others) if dead is None else dead
    known, complete = [modes], modes.complete and dead.complete
    values = [value]
    for middle in _between(dead, value):
        there = assembly_modes(system, {**others, found.name: middle})
        known.append(there)
        values.append(middle)
        complete = complete and there.complete
    walks = _walks(system, CircuitCurve(system, found, others, value), values, known)
    made, notes = [], []
    for number, walk in enumerate(walks, 1):
        _settle(walk, dead)
        made.append(_circuit(number, walk, found.angular))
        if walk.trouble:
            complete = False
            notes.append(f"circuit {number} is not followed to its end: {walk.trouble}")
        elif walk.leapt:
            complete = False
            notes.append(f"circuit {number} goes through a change point, or very near to one")
    ends = [x for one in made for x in one.dead_centres]
    if dead.complete:
        same = _same(dead, tol.POSITION_SAME)
        missing = [
            x for x in dead.values if not any(_distance(dead, x, end) < same for end in ends)
        ]
        complete = complete and not missing
    doubts = list(modes.doubts)
    if not complete and not doubts:
        doubts.append(_incomplete(found.name, dead, notes))
    centres = dead if dead.complete else with_those_of_walks(dead, walks)
    return Circuits(
        mechanism=system.mechanism,
        driver=found.name,
        modes=modes,
        circuits=tuple(made),
        dead_centres=centres,
        complete=complete,
        within=min((one.within for one in known if one.within is not None), default=None),
        status=status_of("completed", doubts),
        doubts=tuple(doubts),
        notes=tuple(dict.fromkeys((*modes.notes, *notes, *(one.message for one in doubts)))),
    )


def with_those_of_walks(dead: DeadCentres, walks: list[CircuitWalk]) -> DeadCentres:
    """With those that whole walks have met, where it is not proven that there are no more."""
    same = _same(dead, tol.POSITION_SAME)
    values = [
        x % REVOLUTION if dead.angular else x
        for one in walks
        for x in one.dead_centres
        if not one.trouble and not any(_distance(dead, x, y) <= same for y in dead.values.tolist())
    ]
    more = [SingularPosition(dead.driver, x, ()) for x in values]
    whole = sorted([*dead.positions, *more], key=lambda one: one.value)
    return replace(dead, positions=tuple(whole))


def _settle(walk: CircuitWalk, dead: DeadCentres) -> None:
    """Certified values for those of a walk, which are rough where branches meet."""
    same = _same(dead, tol.DEAD_CENTRE_MATCH)

    def settled(x: float) -> float:
        candidates = [value for value in dead.values.tolist() if _distance(dead, x, value) < same]
        best = min(candidates, key=lambda value: _distance(dead, x, value), default=x)
        return x + math.remainder(best - x, REVOLUTION) if dead.angular else best

    walk.dead_centres = [settled(x) for x in walk.dead_centres]
    if walk.dead_centres:
        walk.low, walk.high = settled(walk.low), settled(walk.high)


def _distance(dead: DeadCentres, a: float, b: float) -> float:
    return abs(math.remainder(a - b, REVOLUTION) if dead.angular else a - b)


def _same(dead: DeadCentres, part: float) -> float:
    """A difference of values that is none: in rad, or that part of the greatest length."""
    return part if dead.angular else part * float(np.abs(dead.values).max(initial=0.0))


def _between(dead: DeadCentres, value: float) -> list[float]:
    """A value between every two neighbouring dead centres, but where the given one is."""
    if not dead.angular:
        return _between_lengths(dead.values.tolist(), value)
    if len(dead.values) < 2:
        return []
    ends = [*dead.values.tolist(), float(dead.values[0]) + REVOLUTION]
    found = []
    for low, high in pairwise(ends):
        here = low + (value - low) % REVOLUTION
        if not low < here < high:
            found.append(0.5 * (low + high))
    return found


def _between_lengths(values: list[float], value: float) -> list[float]:
    """Midpoints between successive lengths, which are not periodic: from 0 to the first too."""
    ends = [0.0, *(x for x in values if x > 0.0)]
    ends = [*(x for x in values if x <= 0.0), *ends]
    return [
        0.5 * (low + high) for low, high in pairwise(dict.fromkeys(ends)) if not low < value < high
    ]


def _incomplete(driver: str, dead: DeadCentres, notes: list[str]) -> Doubt:
    """The first reason why circuits may be missing."""
    reasons = [*notes, *dead.notes, "not all dead centres were met"]
    message = f"circuits may be missing: {reasons[0]}"
    return Doubt("incomplete", message, elements=(driver,))


def _walks(
    system: System, curve: CircuitCurve, values: list[float], known: list[AssemblyModes]
) -> list[CircuitWalk]:
    def mode_at(number: int, q: np.ndarray) -> int | None:
        pose = np.concatenate([q, np.zeros(3)])
        for mode in known[number]:
            if same_pose(system, pose, mode.pose, known[number].meshed):
                return mode.number
        return None

    geared = any(modes.meshed for modes in known)
    left = [(n, mode.number) for n, modes in enumerate(known) for mode in modes]
    found = []
    while left:
        number, mode = left[0]
        one = curve.walk(known[number][mode - 1].pose, (number, mode), values, mode_at, geared)
        found.append(one)
        passed = set(one.passed)
        left = [one for one in left if one not in passed]
    return found


def _circuit(number: int, walk: CircuitWalk, angular: bool) -> Circuit:
    modes = tuple(sorted({mode for value, mode in walk.passed if value == 0}))
    branches = [
        tuple(sorted({mode for value, mode in stretch if value == 0})) for stretch in walk.stretches
    ]
    full: bool | None = None
    if angular and not walk.trouble:
        full = not walk.dead_centres and abs(walk.advance) > 1.0
    return Circuit(
        number=number,
        modes=modes,
        branches=tuple(branch for branch in dict.fromkeys(branches) if branch),
        full_turn=full,
        range=None if full or walk.trouble else (walk.low, walk.high),
        dead_centres=tuple(sorted(walk.dead_centres)),
    )
