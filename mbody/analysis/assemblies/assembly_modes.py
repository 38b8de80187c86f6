"""The verb `assembly_modes`: every way in which a mechanism closes, with a certificate."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping

import numpy as np

from mbody.analysis.assemblies.assembly_mode import AssemblyMode, AssemblyModes, Unresolved
from mbody.analysis.assemblies.box_search import NARROW, BoxRoots, all_roots
from mbody.analysis.assemblies.linkage import Linkage, NotCovered, State
from mbody.analysis.assemblies.loop_rows import GroupRows
from mbody.analysis.assemblies.mode_names import mode_names
from mbody.analysis.assemblies.random_starts import modes_by_random_starts, same_pose
from mbody.analysis.assemblies.solution_order import TOO_FEW, Group, TooFewRows, assur_groups
from mbody.analysis.position.assembly_analysis import (
    as_system,
    check_determined,
    check_fit,
    closed,
    set_drive,
)
from mbody.analysis.position.whole_turns import by_rows
from mbody.errors import ModelError, SolveError, angle_text, brief
from mbody.model.driver import Driver
from mbody.model.element import listed
from mbody.model.mechanism import Mechanism
from mbody.model.numbers import number_in
from mbody.quantities.types import Number
from mbody.solution.doubts import Doubt, status_of
from mbody.system.rank import dense
from mbody.system.system import System

__all__ = ["MOST", "assembly_modes", "driver_named", "driver_values"]

#: Boxes that a search may examine: some ten seconds.
MOST = 60_000
#: Boxes whose middles are nearer than this are about one position [rad].
TOGETHER = 1e-3
#: Angles of boxes that spread more than this are those of a family [rad].
SPREAD = 0.1
#: A residual above this, in model lengths and radians, is no closed position.
OPEN = 1e-8


def assembly_modes(
    model: Mechanism | System,
    drive: Mapping[str, Number] | None = None,
    *,
    most: int = MOST,
    used: np.ndarray | None = None,
) -> AssemblyModes:
    """All assembly modes: every way in which the loops close while the drivers are fixed.

    Pins, slides, pins in slots, rods, cylinders, gears on carriers, couplings of angles and
    redundant joints are searched with a certificate: boxes of angles are excluded, or proven to
    have one mode and no other by Krawczyk's operator. Cams, wheels on lines, own joints and
    couplings of lengths are searched from random starts, and `certificate` says so.

    Parameters
    ----------
    model : Mechanism or System
        Driven so that no freedom is left.
    drive : mapping, optional
        Value [rad or length] of drivers, by the name of the driver or of its body; text has its
        own unit (``"60 deg"``). The others are where their laws begin.
    most : int
        Boxes that the search may examine before it leaves the rest open.
    used : array (coordinates + 3,), optional
        The position that counts as used, in place of the one that the guesses lead to.

    Returns
    -------
    AssemblyModes
        Each mode serves as `guess` of any analysis.

    Raises
    ------
    ModelError
        For a batch of designs, or a driver that there is not.
    SolveError
        When the drivers do not determine the position, or wheels do not fit.

    Notes
    -----
    Assur groups are solved one after the other, each mode of one beginning the next; a mode is
    counted up to whole turns, and up to the teeth in which wheels mesh. Displacements are bounded
    by the loops; where the guides of several turn and may become parallel they are searched to four
    times the size of the loops, which a note says.
    Cost: some 10 ms for a four-bar, 30 ms for a six-bar, below a second for four loops.

    Source: S. M. Rump, *Verification methods*, Acta Numerica 19 (2010); A. Sljoka, O. Shai,
    W. Whiteley, ASME DETC2011-48340.

    Examples
    --------
    >>> import mbody
    >>> machine = mbody.makers.four_bar(40, 120, 80, 100)
    >>> modes = mbody.assembly_modes(machine, {"crank": "40 deg"})
    >>> [mode.name for mode in modes], modes.complete
    (['crossed', 'open'], True)
    >>> run = mbody.kinematics(machine, drive={"motor": 0.69813170}, guess=modes["open"])
    >>> round(float(np.degrees(run["rocker"].angle[0])), 4)
    57.3249
    """
    system = as_system(model)
    if system.batch is not None:
        raise ModelError("assembly_modes takes one design: choose one of the batch with design(n)")
    if isinstance(most, bool) or not isinstance(most, int) or most < 1:
        raise ModelError(f"most is {brief(most)}: give a whole number of boxes, 1 or more")
    given = driver_values(system, drive)
    values = set_drive(system, system.work(), 0.0, given)
    try:
        linkage = Linkage(system, given)
        search = _GroupSearch(linkage, assur_groups(linkage), most)
        search.run()
    except NotCovered as reason:
        return _by_starts(system, given, values, str(reason), used)
    except TooFewRows:
        check_determined(system, closed(system, 0.0, given), "assembly_modes")
        return _by_starts(system, given, values, TOO_FEW, used)
    return search.result(given, values, used)


def driver_named(system: System, name: str) -> Driver:
    """The driver of that name, or the one that drives the body of that name.

    Raises
    ------
    ModelError
        When there is none, or where it follows positions.
    """
    for driver in system.leaders:
        if name in (driver.name, getattr(driver, "body", None)):
            return driver
    known = listed(d.name for d in system.leaders) or "none"
    raise ModelError(f"there is no driver {brief(name)} (there are: {known})", str(name))


def driver_values(system: System, drive: Mapping[str, Number] | None) -> dict[str, float]:
    """Values of drivers by name, from what a user gives."""
    if drive is not None and not isinstance(drive, Mapping):
        raise ModelError(f'drive must be a dict such as {{"motor": 0.5}}, not {brief(drive)}')
    found = {}
    for name, value in (drive or {}).items():
        driver = driver_named(system, name)
        dimension = driver.motion["value"]
        if isinstance(value, (tuple, list, np.ndarray)):
            raise ModelError(
                f"'{name}': assembly_modes takes one value of a driver, not {brief(value)}", name
            )
        found[driver.name] = number_in(system.mechanism, value, dimension, name, "value")
    return found


class _GroupSearch:
    """The groups of one linkage, solved one after the other."""

    def __init__(self, linkage: Linkage, groups: list[Group], most: int) -> None:
        self.linkage, self.groups, self.most = linkage, groups, most
        self.states: list[State] = [({}, {linkage.bodies: 0j})]
        self.choices: list[tuple[int, ...]] = [()]
        self.unresolved: list[Unresolved] = []
        self.boxes = 0
        #: Displacements that are searched where none is the greatest possible, by group.
        self.limits: dict[Group, float] = {}

    def run(self) -> None:
        for group in self.groups:
            states, choices = [], []
            for state, choice in zip(self.states, self.choices, strict=True):
                rows = GroupRows(self.linkage, group, state)
                found = all_roots(rows.rows, max(self.most - self.boxes, 1))
                self.boxes += found.boxes
                if not rows.rows.bounded:
                    least = min(self.limits.get(group, math.inf), float(rows.rows.reach.min()))
                    self.limits[group] = least
                if len(found.low):
                    self._leave_open(rows, found)
                order = np.lexsort(found.points.T[::-1]) if found.points.size else [0]
                for n, k in enumerate(order[: len(found.points)]):
                    states.append(rows.solved(found.points[k]))
                    choices.append((*choice, n))
            self.states, self.choices = states, choices

    def _leave_open(self, rows: GroupRows, found: BoxRoots) -> None:
        names = self.linkage.names
        group = tuple(names[b] for b in rows.group.bodies)
        middle = 0.5 * (found.low + found.high)
        width = float((found.high - found.low).max())
        if found.spent:
            reason = f"the search stopped after {self.most} boxes: allow it more with most"
            self.unresolved.append(Unresolved(reason, group, width))
            return
        angles = rows.rows.angles
        spread = np.ptp(np.unwrap(np.sort(middle[:, :angles], axis=0), axis=0), axis=0)
        if width >= NARROW / 100.0:
            turning = {rows.names[k] for k in np.flatnonzero(spread > SPREAD)}
            bodies = tuple(
                names[b] for b in rows.group.bodies if self.linkage.variable[b] in turning
            )
            bodies = bodies or group
            reason = (
                f"a family: {listed(bodies)} {'is' if len(bodies) == 1 else 'are'} free to move "
                "in positions where links fold onto each other, or lie parallel"
            )
            self.unresolved.append(Unresolved(reason, bodies, float(spread.max(initial=0.0))))
            return
        for place in _clusters(middle):
            near = np.abs(middle - place).max(1) < TOGETHER
            low, high = found.low[near].min(0), found.high[near].max(0)
            reason = f"modes meet at {self._where()}: a dead centre, or nearer to one than 1e-12"
            self.unresolved.append(Unresolved(reason, group, float((high - low).max())))

    def _where(self) -> str:
        parts = []
        for driver in self.linkage.system.leaders:
            value = self.linkage.drive[driver.name]
            unit = self.linkage.system.mechanism.units.length
            shown = angle_text(value) if driver.angular else f"{value:.10g} {unit}"
            parts.append(f"'{driver.name}' = {shown}")
        return " and ".join(parts) or "this position"

    def result(
        self, given: dict[str, float], values: dict[str, float], used: np.ndarray | None
    ) -> AssemblyModes:
        """The modes in the order of their angles, checked by the rows of the engine."""
        linkage, system = self.linkage, self.linkage.system
        poses = linkage.poses(self.states)
        names = mode_names(linkage, self.groups, self.choices, poses)
        for pose in poses:
            by_rows(system, pose, values, system.numbers)
        if len(poses):
            check_fit(system, poses[0], 0)
        meshed = linkage.meshed
        residuals = _residuals(system, given, poses)
        for residual, name in zip(residuals, names, strict=True):
            if residual > OPEN:
                self.unresolved.append(
                    Unresolved(
                        f"mode {name} misses the constraint rows by {residual:.2g}", (), residual
                    )
                )
        notes = []
        if meshed:
            wheels = listed(linkage.names[b] for b in sorted(meshed))
            notes.append(f"which teeth of {wheels} mesh is not counted as another mode")
        for group, limit in self.limits.items():
            sliding = listed(linkage.names[b] for b in group.bodies)
            length = system.mechanism.units.length
            notes.append(f"displacements of {sliding} are searched up to {limit:.4g} {length}")
        return _made(
            system,
            values,
            poses,
            names,
            residuals,
            # where nothing closes, looking for what the guesses lead to takes longest
            _position_used(system, given, used) if len(poses) else None,
            meshed=meshed,
            certificate="interval",
            unresolved=tuple(self.unresolved),
            groups=tuple(tuple(linkage.names[b] for b in group.bodies) for group in self.groups),
            boxes=self.boxes,
            notes=notes,
        )


def _clusters(points: np.ndarray) -> list[np.ndarray]:
    found: list[np.ndarray] = []
    for point in points:
        if not any(np.abs(point - other).max() < TOGETHER for other in found):
            found.append(point)
    return found


def _by_starts(
    system: System,
    given: dict[str, float],
    values: dict[str, float],
    reason: str,
    used: np.ndarray | None,
) -> AssemblyModes:
    poses = modes_by_random_starts(system, given, 0.0)
    first = _position_used(system, given, used)
    if first is not None and not any(same_pose(system, first, pose) for pose in poses):
        poses = np.concatenate([poses, first[None]])
    left = Unresolved(f"random starts do not prove that there are no more: {reason}", (), math.pi)
    names = [str(n + 1) for n in range(len(poses))]
    residuals = _residuals(system, given, poses)
    return _made(
        system,
        values,
        poses,
        names,
        residuals,
        first,
        certificate="multi-start",
        unresolved=(left,),
    )


def _residuals(system: System, given: dict[str, float], poses: np.ndarray) -> list[float]:
    """Greatest violation of the rows of the engine at each pose, in model lengths and radians."""
    work = system.work()
    set_drive(system, work, 0.0, given)
    found = []
    for pose in poses:
        work.q[:, 0] = pose
        found.append(float(np.abs(dense(system, work)[0]).max(initial=0.0)))
    return found


def _position_used(
    system: System, given: dict[str, float], used: np.ndarray | None
) -> np.ndarray | None:
    """Where the guesses of the description lead; None where that closes nowhere."""
    if used is not None:
        return used
    try:
        found = closed(system, 0.0, given, meant=lambda _: True)
    except SolveError:
        return None
    return np.array(found.work.q[:, 0])


def _made(
    system: System,
    values: dict[str, float],
    poses: np.ndarray,
    names: list[str],
    residuals: list[float],
    used: np.ndarray | None,
    *,
    certificate: str,
    unresolved: tuple[Unresolved, ...],
    meshed: Collection[int] = (),
    groups: tuple[tuple[str, ...], ...] = (),
    boxes: int = 0,
    notes: list[str] | None = None,
) -> AssemblyModes:
    modes = []
    for n, (pose, name, residual) in enumerate(zip(poses, names, residuals, strict=True)):
        same = used is not None and same_pose(system, pose, used, meshed)
        modes.append(AssemblyMode(n + 1, name, same, residual, pose, _places(system, pose)))
    doubts = []
    if unresolved:
        more = f"; {len(unresolved) - 1} more" if len(unresolved) > 1 else ""
        message = f"assembly modes may be missing: {unresolved[0].reason}{more}"
        doubts.append(Doubt("incomplete", message, elements=unresolved[0].bodies))
    return AssemblyModes(
        mechanism=system.mechanism,
        at=values,
        modes=tuple(modes),
        certificate=certificate,
        complete=not unresolved,
        unresolved=unresolved,
        groups=groups,
        boxes=boxes,
        meshed=frozenset(meshed),
        status=status_of("completed", doubts),
        doubts=tuple(doubts),
        notes=(*(notes or ()), *(doubt.message for doubt in doubts)),
    )


def _places(system: System, pose: np.ndarray) -> dict[str, tuple[float, float, float]]:
    """Link axes of every body by the coordinates of its mass centre."""
    return {
        body.name: system.numbers.link_axes(body.name, *pose[3 * n : 3 * n + 3].tolist())
        for n, body in enumerate(system.mechanism.bodies)
    }
