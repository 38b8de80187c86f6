"""The verb `circuits`: which assembly modes the motion of the joints leads from one to another."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from itertools import islice, pairwise
from typing import Any

import numpy as np

from mbody.analysis.assemblies.all_dead_centres import (
    DeadCentres,
    SingularPosition,
    dead_centres_at,
    single_driver,
)
from mbody.analysis.assemblies.assembly_modes import (
    AssemblyModes,
    assembly_modes,
    checked_driver_values,
    same_pose,
)
from mbody.analysis.position.assembly_analysis import as_system, set_driver_values
from mbody.analysis.position.joint_curve import PACE, JointCurve
from mbody.core import arclength
from mbody.core import tolerances as tol
from mbody.core.presentation import Presented
from mbody.model.driver import Driver
from mbody.model.element import takes_one_design
from mbody.model.mechanism import Mechanism
from mbody.quantities.types import Number
from mbody.solution.declared_result import IncludedResult, ItemTable, Value
from mbody.solution.doubts import Doubt, Inherited, status_of
from mbody.system.system import System

# -- Curve of positions with one driver released, walked step by step --------------------------

#: Steps of one walk.
STEPS = 20_000
#: Last step, singular values that are none, and steps of a position that is closed.
CLOSURE = tol.LOOP_CLOSURE_CORRECTION, tol.LEAST_SQUARES_RANK_SEARCH, 8
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
        self.curve = JointCurve(system, work, driver, CLOSURE)
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
