"""The verb `circuits`: which assembly modes the motion of the joints leads from one to another."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any

import numpy as np

from mbody.analysis.assemblies.all_dead_centres import (
    DeadCentres,
    SingularPosition,
    dead_centres,
    single_driver,
)
from mbody.analysis.assemblies.assembly_mode import AssemblyModes
from mbody.analysis.assemblies.assembly_modes import assembly_modes, driver_values
from mbody.analysis.assemblies.joint_curve import CircuitWalk, JointCurve
from mbody.analysis.assemblies.random_starts import same_pose
from mbody.analysis.position.assembly_analysis import as_system
from mbody.core.presentation import present
from mbody.errors import ModelError
from mbody.model.mechanism import Mechanism
from mbody.quantities.convert import short_degrees
from mbody.quantities.types import Number
from mbody.solution.doubts import Doubt, Inherited, status_of
from mbody.system.system import System

__all__ = ["Circuit", "Circuits", "circuits"]

#: Dead centres nearer than this are one [rad].
ONE = 1e-6
#: How far a dead centre that was met on a walk may be from a certified one [rad].
ROUGH = 1e-3
TURN = 2.0 * math.pi


@dataclass(frozen=True)
class Circuit:
    """Positions that the motion of the joints joins.

    Attributes
    ----------
    number : int
        From 1.
    modes : tuple of int
        Numbers of its assembly modes at the value of the driver; none where it never gets there.
    branches : tuple of tuples of int
        The same between dead centres: modes that the driver alone leads from one to another.
    full_turn : bool or None
        Whether the driver turns all the way round on it; None of a length, or where it is open.
    range : (float, float) or None
        Least and greatest value of the driver [rad or length], None where it turns round.
    dead_centres : tuple of float
        Values of the driver [rad or length].
    """

    number: int
    modes: tuple[int, ...]
    branches: tuple[tuple[int, ...], ...]
    full_turn: bool | None
    range: tuple[float, float] | None
    dead_centres: tuple[float, ...]


@dataclass(frozen=True, kw_only=True, eq=False)
class Circuits(Inherited):
    """All circuits of a mechanism with one driver released.

    Attributes
    ----------
    mechanism : Mechanism
    driver : str
    modes : AssemblyModes
        At the driver's value.
    circuits : tuple of Circuit
    dead_centres : DeadCentres
        Of the driver in all modes, with their own certificate.
    complete : bool
        Whether it is proven that there are no more circuits: all dead centres and, between them,
        all modes are certified, and every one lies on a circuit that was walked until it closed.
    """

    mechanism: Mechanism = field(repr=False)
    driver: str
    modes: AssemblyModes
    circuits: tuple[Circuit, ...]
    dead_centres: DeadCentres
    complete: bool

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

    def __str__(self) -> str:
        return str(present("sheet", self))

    def data(self, angle: str = "deg") -> dict[str, Any]:
        """The modes as data with circuits and dead centres, ready for JSON."""
        angular = self.mechanism[self.driver].angular  # type: ignore[attr-defined]  # a driver
        turn = short_degrees if angular and angle == "deg" else float
        found = self.modes.data(angle)
        for mode in found["modes"]:
            mode["circuit"], mode["branch"] = self.of(mode["number"])
        dead = [
            {"driver": self.driver, "value": turn(value), "circuit": one.number}
            for one in self.circuits
            for value in one.dead_centres
        ]
        own = [
            {
                "number": one.number,
                "modes": list(one.modes),
                "full_turn": one.full_turn,
                "range": one.range and [turn(value) for value in one.range],
            }
            for one in self.circuits
        ]
        head = {name: found[name] for name in ("mbody", "model", "analysis", "units")}
        doubts = [one.data() for one in self.doubts]
        head |= {"status": self.status, "doubts": doubts, "notes": list(self.notes)}
        rest = {name: value for name, value in found.items() if name not in head}
        return head | rest | {"circuits": own, "dead_centres": dead}


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
    if system.batch is not None:
        raise ModelError("circuits takes one design: choose one of the batch with design(n)")
    found = single_driver(system, driver)
    given = driver_values(system, drive)
    modes = assembly_modes(system, given, used=used)
    value = modes.at[found.name]
    others = {name: x for name, x in modes.at.items() if name != found.name}
    dead = dead_centres(system, found.name) if not others else None
    known, complete = [modes], modes.complete and dead is not None and dead.complete
    values = [value]
    for middle in _between(dead, value):
        there = assembly_modes(system, {**others, found.name: middle})
        known.append(there)
        values.append(middle)
        complete = complete and there.complete
    walks = _walks(system, JointCurve(system, found, others, value), values, known)
    made, notes = [], []
    for number, walk in enumerate(walks, 1):
        if dead is not None:
            _settle(walk, dead)
        made.append(_circuit(number, walk, found.angular))
        if walk.trouble:
            complete = False
            notes.append(_not_followed(number, walk.trouble))
    ends = [x for one in made for x in one.dead_centres]
    if dead is not None and dead.complete:
        same = _same(dead, ONE)
        missing = [x for x in dead.values if not any(_apart(dead, x, end) < same for end in ends)]
        complete = complete and not missing
    doubts = list(modes.doubts)
    if not complete and not doubts:
        doubts.append(_incomplete(found.name, dead, notes))
    shown = dead_centres_of_walks(system, found.name, made) if dead is None else dead
    return Circuits(
        mechanism=system.mechanism,
        driver=found.name,
        modes=modes,
        circuits=tuple(made),
        dead_centres=shown,
        complete=complete,
        status=status_of("completed", doubts),
        doubts=tuple(doubts),
        notes=tuple(dict.fromkeys((*modes.notes, *notes, *(one.message for one in doubts)))),
    )


def dead_centres_of_walks(system: System, driver: str, made: list[Circuit]) -> DeadCentres:
    """Those that were met on the way, where none are certified."""
    values = sorted(x for one in made for x in one.dead_centres)
    return DeadCentres(
        mechanism=system.mechanism,
        driver=driver,
        positions=tuple(SingularPosition(driver, x, ()) for x in values),
        complete=False,
    )


def _settle(walk: CircuitWalk, dead: DeadCentres) -> None:
    """Certified values for those of a walk, which are rough where branches meet."""
    same = _same(dead, ROUGH)

    def settled(x: float) -> float:
        near = [value for value in dead.values.tolist() if _apart(dead, x, value) < same]
        best = min(near, key=lambda value: _apart(dead, x, value), default=x)
        return x + math.remainder(best - x, TURN) if dead.angular else best

    walk.dead_centres = [settled(x) for x in walk.dead_centres]
    if walk.dead_centres:
        walk.low, walk.high = settled(walk.low), settled(walk.high)


def _apart(dead: DeadCentres, a: float, b: float) -> float:
    return abs(math.remainder(a - b, TURN) if dead.angular else a - b)


def _same(dead: DeadCentres, part: float) -> float:
    """A difference of values that is none: in rad, or that part of the greatest length."""
    return part if dead.angular else part * float(np.abs(dead.values).max(initial=0.0))


def _between(dead: DeadCentres | None, value: float) -> list[float]:
    """A value between every two neighbouring dead centres, but where the given one is."""
    if dead is None:
        return []
    if not dead.angular:
        return _between_lengths(dead.values.tolist(), value)
    if len(dead.values) < 2:
        return []
    ends = [*dead.values.tolist(), float(dead.values[0]) + TURN]
    found = []
    for low, high in pairwise(ends):
        here = low + (value - low) % TURN
        if not low < here < high:
            found.append(0.5 * (low + high))
    return found


def _between_lengths(values: list[float], value: float) -> list[float]:
    """The same of lengths, which do not come back: from 0 to the first one, too."""
    ends = [0.0, *(x for x in values if x > 0.0)]
    ends = [*(x for x in values if x <= 0.0), *ends]
    return [
        0.5 * (low + high) for low, high in pairwise(dict.fromkeys(ends)) if not low < value < high
    ]


def _not_followed(number: int, trouble: str) -> str:
    return f"circuit {number} is not followed to its end: {trouble}"


def _incomplete(driver: str, dead: DeadCentres | None, notes: list[str]) -> Doubt:
    """The first reason why circuits may be missing."""
    why = ["several drivers move"] if dead is None else list(dead.notes)
    message = f"circuits may be missing: {[*notes, *why, 'not all dead centres were met'][0]}"
    return Doubt("incomplete", message, elements=(driver,))


def _walks(
    system: System, curve: JointCurve, values: list[float], known: list[AssemblyModes]
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
        walk = curve.walk(known[number][mode - 1].pose, (number, mode), values, mode_at, geared)
        found.append(walk)
        passed = set(walk.passed)
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
