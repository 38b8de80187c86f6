"""The verb `assembly_modes`: every way in which a mechanism closes, with a certificate."""

from __future__ import annotations

import cmath
import math
from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass, field

import numpy as np

from mbody.analysis.assemblies.box_search import BoxRoots, GroupRows, all_roots
from mbody.analysis.assemblies.linkage import (
    TOO_FEW,
    Group,
    Linkage,
    NotCovered,
    Pair,
    State,
    TooFewRows,
    assur_groups,
)
from mbody.analysis.position import assembly_analysis
from mbody.analysis.position.closed_position import by_rows, placed
from mbody.core import tolerances as tol
from mbody.core.presentation import Presented
from mbody.errors import ModelError, SolveError, angle_text, brief
from mbody.kernels.loop_closure import close
from mbody.model.driver import Driver
from mbody.model.element import listed, takes_one_design, unknown_name, whole_number
from mbody.model.mechanism import Mechanism
from mbody.model.numbers import number_in
from mbody.quantities.formula import Number
from mbody.solution.declared_result import ItemTable, Value, data_only
from mbody.solution.doubts import Doubt, Inherited, status_of
from mbody.system.rank import dense
from mbody.system.system import System

# -- The modes in which a mechanism closes, as a result ----------------------------------------


@dataclass(frozen=True, eq=False)
class AssemblyMode(Mapping[str, tuple[float, float, float]]):
    """One way in which a mechanism closes: of every body (x, y, angle) of its link axes, which is
    what `guess` of any analysis takes.

    `number`: From 1.
    `name`: "open" or "crossed" of two links, joined where there are several; else the number.
    `used`: Whether analyses with the guesses of the description find this one.
    `residual`: Greatest violation of the constraint rows, in model lengths and radians.
    `pose` (3·bodies + 3,): Coordinates of the mass centres, the ground last [length, rad].
    """

    number: int
    name: str
    used: bool
    residual: float
    pose: np.ndarray = field(repr=False)
    _places: Mapping[str, tuple[float, float, float]] = field(repr=False)

    def __getitem__(self, body: str) -> tuple[float, float, float]:
        return self._places[body]

    def __iter__(self) -> Iterator[str]:
        return iter(self._places)

    def __len__(self) -> int:
        return len(self._places)


@dataclass(frozen=True)
class Unresolved(Presented):
    """Part of the search that proved neither that there is a mode nor that there is none.

    `reason`: A sentence.
    `bodies`: That it is about.
    `width`: Of what is left open [rad], displacements as a part of the size of the loops.
    """

    reason: str
    bodies: tuple[str, ...]
    width: float


def _driver_dimensions(found: AssemblyModes) -> dict[str, str]:
    return {d.name: "angle" if d.angular else "length" for d in found.mechanism.drivers}


@dataclass(frozen=True, kw_only=True, eq=False)
class AssemblyModes(Inherited, Presented):
    """All ways in which a mechanism closes at given driver values; ``print`` shows them.

    ``len(modes)`` is their number; ``modes[0]`` the first, ``modes["open"]`` the one of that name.

    `at`: Values of the drivers [rad or length].
    `certificate`: "interval" where the search covers all positions, "multi-start" where Newton's
      method was started from random ones.
    `complete`: Whether it is proven that there are no more, or none within `within`.
    `within`: Displacements of slides up to which the proof holds [length]; None where it holds for
      all.
    `unresolved`: Why it is not complete.
    `groups`: Bodies of each Assur group, in the order of solution; empty without a certificate.
    `boxes`: How many boxes the search examined.
    `meshed`: Indices of bodies that gears or couplings turn: their angles count up to rotations by
      teeth.
    """

    mechanism: Mechanism = field(repr=False)
    at: dict[str, float]
    modes: tuple[AssemblyMode, ...]
    certificate: str
    complete: bool
    within: float | None = None
    unresolved: tuple[Unresolved, ...] = ()
    groups: tuple[tuple[str, ...], ...] = field(default=(), repr=False)
    boxes: int = 0
    meshed: frozenset[int] = field(default=frozenset(), repr=False)

    analysis_name = "assemblies"
    angle_unit = "deg"
    declared = (
        Value("at", "", _driver_dimensions),
        Value("count", value=len),
        "complete within certificate",
        ItemTable(
            "modes",
            (
                "number name used",
                Value("circuit", value=lambda mode: None),
                Value("branch", value=lambda mode: None),
                Value("residual"),
                ItemTable(
                    "bodies",
                    (*data_only("x", "y", dimension="length"), Value("angle", "", "angle")),
                    value=lambda mode: {
                        body: dict(zip(("x", "y", "angle"), pose, strict=True))
                        for body, pose in mode.items()
                    },
                ),
            ),
        ),
        "unresolved boxes",
    )

    def __len__(self) -> int:
        return len(self.modes)

    def __iter__(self) -> Iterator[AssemblyMode]:
        return iter(self.modes)

    def __getitem__(self, which: int | str) -> AssemblyMode:
        if isinstance(which, str):
            for mode in self.modes:
                if mode.name == which:
                    return mode
            raise unknown_name("mode", which, self.modes)
        return self.modes[which]

    @property
    def used(self) -> AssemblyMode | None:
        """The mode that analyses find from the guesses of the description; None where that is
        not among them.
        """
        return next((mode for mode in self.modes if mode.used), None)

    @property
    def poses(self) -> np.ndarray:
        """Coordinates of the mass centres, the ground last: (modes, 3·bodies + 3)."""
        size = 3 * len(self.mechanism.bodies) + 3
        return np.array([mode.pose for mode in self.modes]).reshape(len(self), size)


# -- Names of assembly modes: open and crossed of two links and a slider, else numbers ---------
# Two links between known pins, P on the driver's side and Q, are *open* where their common pin lies
# to the left of the line from P to Q, else *crossed*: of a four-bar with the ground's pivots from
# left to right these are the open and the crossed circuit of textbooks (Norton, *Design of
# Machinery*, chapter 4). A link and a slider are *open* where the slider is on the positive side of
# the guide's x axis, seen from the known pin. A mode of several groups joins their names.

NAMES = {True: "open", False: "crossed"}


def mode_names(
    linkage: Linkage, groups: list[Group], choices: list[tuple[int, ...]], poses: np.ndarray
) -> list[str]:
    """A name for each pose (modes, coordinates + 3); `choices` are its roots of every group."""
    free = [n for n, group in enumerate(groups) if group.angles or any(c[n] for c in choices)]
    distances = _distances(linkage)
    found = []
    for choice, pose in zip(choices, poses, strict=True):
        parts = []
        for n in free:
            side = _side(linkage, groups[n], pose, distances)
            parts.append(str(choice[n] + 1) if side is None else NAMES[side])
        found.append("-".join(parts) or "1")
    return found if len(set(found)) == len(found) else [str(n + 1) for n in range(len(found))]


def _side(linkage: Linkage, group: Group, pose: np.ndarray, distances: list[float]) -> bool | None:
    """Whether a group of two links, or of a link and a slider, is open."""
    pairs = [linkage.pairs[p] for p in group.pairs]
    slides = [pair for pair in pairs if pair.kind == "slide"]
    outer: list[tuple[float, int, complex]] = []
    inner: complex | None = None
    for pair in pairs:
        inside = [b for b in (pair.i, pair.j) if b in group.bodies]
        i, j = _world(pose, pair.i, pair.position_i), _world(pose, pair.j, pair.position_j)
        if pair.kind == "pin" and len(inside) == 2:
            inner = i
        elif pair.kind != "slide" and len(inside) == 1:
            known = pair.j if pair.i in group.bodies else pair.i
            outer.append((distances[known], known, j if known == pair.j else i))
            if pair.kind == "rod":
                inner = i if known == pair.j else j
        elif pair.kind == "rod":
            return None
    if inner is None or len(pairs) > 3:
        return None
    if len(outer) == 2 and not slides:
        (_, _, p), (_, _, q) = sorted(outer, key=lambda one: one[:2])
        return bool(((q - p).conjugate() * (inner - p)).imag > 0.0)
    if len(outer) == 1 and len(slides) == 1 and _keeps_direction(linkage, group, slides[0]):
        slide = slides[0]
        along = -1j * slide.axis * cmath.exp(1j * float(pose[3 * slide.i + 2]))
        return bool((along.conjugate() * (inner - outer[0][2])).real > 0.0)
    return None


def _keeps_direction(linkage: Linkage, group: Group, slide: Pair) -> bool:
    return all(linkage.variable[b] not in group.angles for b in (slide.i, slide.j))


def _world(pose: np.ndarray, body: int, position: complex) -> complex:
    x, y, angle = (float(part) for part in pose[3 * body : 3 * body + 3])
    return complex(x, y) + position * cmath.exp(1j * angle)


def _distances(linkage: Linkage) -> list[float]:
    """Number of pairs that lead from a driven body to every other one, the ground left out."""
    found = [np.inf] * (linkage.bodies + 1)
    names = {name: n for n, name in enumerate(linkage.names)}
    here = {names[d.bodies[1]] for d in linkage.system.drivers} - {linkage.bodies}
    step = 0.0
    while here:
        for b in here:
            found[b] = step
        step += 1.0
        neighbours = {
            b for pair in linkage.pairs for b in (pair.i, pair.j) if {pair.i, pair.j} & here
        }
        here = {b for b in neighbours if b < linkage.bodies and found[b] == np.inf}
    return found


# -- Assembly modes by Newton's method from many random poses: for what has no certificate -----
# The poses are always the same ones, so that results are. Modes may be missing.

#: Poses that are tried.
STARTS = 240


def modes_by_random_starts(system: System, driver_values: dict[str, float], t: float) -> np.ndarray:
    """Poses (modes, coordinates + 3) that were found, in the order of their numbers."""
    work = system.work()
    values = assembly_analysis.set_driver_values(system, work, t, driver_values)
    bodies = [body.name for body in system.mechanism.bodies]
    found: list[np.ndarray] = []
    for n in range(STARTS):
        random = np.random.default_rng(n)
        guess = {name: float(random.uniform(-np.pi, np.pi)) for name in bodies}
        start = placed(system, guess, values)
        if n % 2:  # slides anywhere
            off = random.normal(size=len(start)) * system.length
            off[2::3] = 0.0
            off[-3:] = 0.0
            start = start + off
        work.q[:, 0] = start
        good, _, _ = close(
            system.runtime(),
            work,
            0.0,
            tol.LOOP_CLOSURE_RESIDUAL * (1.0 + float(system.extent(start))),
        )
        assembly_analysis.raise_user_error(system)
        if not good or not np.isfinite(work.q).all():
            continue
        if np.abs(dense(system, work)[0]).max(initial=0.0) > tol.LOOP_OPEN_SEARCH:
            continue
        pose = work.q[:, 0].copy()
        if not any(same_pose(system, pose, other) for other in found):
            found.append(pose)
    return np.array(found).reshape(len(found), system.coordinates + 3)


def same_pose(
    system: System, one: np.ndarray, other: np.ndarray, meshed: Collection[int] = ()
) -> bool:
    """Whether two poses are one, whole revolutions aside; angles of `meshed` bodies do not
    count.
    """
    n = system.coordinates
    difference = (one - other)[:n] / system.coordinate_units
    difference[2::3] = np.remainder(difference[2::3] + np.pi, 2.0 * np.pi) - np.pi
    for body in meshed:
        if 3 * body + 2 < n:
            difference[3 * body + 2] = 0.0
    return bool(np.abs(difference).max(initial=0.0) < tol.POSITION_SAME)


#: Boxes that a search may examine: some ten seconds.
MOST = 60_000


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
    counted up to whole revolutions, and up to the teeth in which wheels mesh. Displacements are
    bounded by the loops; where the guides of several turn and may become parallel they are searched
    to four times the size of the loops, which a note says.
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
    system = assembly_analysis.as_system(model)
    takes_one_design("assembly_modes", system.batch)
    most = whole_number("most", most)
    given = checked_driver_values(system, drive)
    values = assembly_analysis.set_driver_values(system, system.work(), 0.0, given)
    try:
        linkage = Linkage(system, given)
        search = _GroupSearch(linkage, assur_groups(linkage), most)
        search.run()
    except NotCovered as reason:
        return _by_starts(system, given, values, str(reason), used)
    except TooFewRows:
        assembly_analysis.check_determined(
            system, assembly_analysis.closed(system, 0.0, given), "assembly_modes"
        )
        return _by_starts(system, given, values, TOO_FEW, used)
    return search.result(given, values, used)


def driver_named(system: System, name: str) -> Driver:
    """The driver of that name, or the one that drives the body of that name."""
    for driver in system.independent_drivers:
        if name in (driver.name, getattr(driver, "body", None)):
            return driver
    raise unknown_name("driver", name, system.independent_drivers)


def checked_driver_values(system: System, drive: Mapping[str, Number] | None) -> dict[str, float]:
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
                    least = min(
                        self.limits.get(group, math.inf), float(rows.rows.displacement_bound.min())
                    )
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
        if width >= tol.BOX_WIDTH_NARROW / 100.0:
            rotating = {rows.names[k] for k in np.flatnonzero(spread > tol.BOX_FAMILY_SPREAD)}
            bodies = tuple(
                names[b] for b in rows.group.bodies if self.linkage.variable[b] in rotating
            )
            bodies = bodies or group
            reason = (
                f"a family: {listed(bodies)} {'is' if len(bodies) == 1 else 'are'} free to move "
                "in positions where links fold onto each other, or lie parallel"
            )
            self.unresolved.append(Unresolved(reason, bodies, float(spread.max(initial=0.0))))
            return
        for place in _clusters(middle):
            same = np.abs(middle - place).max(1) < tol.BOX_MIDDLES_SAME
            low, high = found.low[same].min(0), found.high[same].max(0)
            reason = f"modes meet at {self._where()}: a dead centre, or nearer to one than 1e-12"
            self.unresolved.append(Unresolved(reason, group, float((high - low).max())))

    def _where(self) -> str:
        parts = []
        for driver in self.linkage.system.independent_drivers:
            value = self.linkage.driver_values[driver.name]
            unit = self.linkage.system.mechanism.units.length
            text = angle_text(value) if driver.angular else f"{value:.10g} {unit}"
            parts.append(f"'{driver.name}' = {text}")
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
            assembly_analysis.check_fit(system, poses[0])
        meshed = linkage.meshed
        residuals = _residuals(system, given, poses)
        for residual, name in zip(residuals, names, strict=True):
            if residual > tol.LOOP_OPEN:
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
            notes.append(
                f"displacements of {sliding} have no bound and are searched up to {limit:.4g} "
                f"{length}: what is proven holds within"
            )
        return _result(
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
            within=min(self.limits.values(), default=None),
        )


def _clusters(points: np.ndarray) -> list[np.ndarray]:
    found: list[np.ndarray] = []
    for point in points:
        if not any(np.abs(point - other).max() < tol.BOX_MIDDLES_SAME for other in found):
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
    return _result(
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
    assembly_analysis.set_driver_values(system, work, 0.0, given)
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
        found = assembly_analysis.closed(system, 0.0, given, intended=lambda _: True)
    except SolveError:
        return None
    return np.array(found.work.q[:, 0])


def _result(
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
    within: float | None = None,
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
        within=within,
        unresolved=unresolved,
        groups=groups,
        boxes=boxes,
        meshed=frozenset(meshed),
        status=status_of("completed", doubts),
        doubts=tuple(doubts),
        notes=(*system.notes, *(notes or ()), *(doubt.message for doubt in doubts)),
    )


def _places(system: System, pose: np.ndarray) -> dict[str, tuple[float, float, float]]:
    """Link axes of every body by the coordinates of its mass centre."""
    return {
        body.name: system.numbers.link_axes(body.name, *pose[3 * n : 3 * n + 3].tolist())
        for n, body in enumerate(system.mechanism.bodies)
    }


# -- The assembly mode that the option `assembly` of an analysis names -------------------------


def chosen_assembly(
    system: System, driver_values: Mapping[str, float], which: str | int
) -> AssemblyMode:
    """One of the assembly modes at these values of the drivers, by its name or number.

    >>> from mbody import assemble, makers
    >>> machine = assemble(makers.four_bar(40, 120, 80, 100))
    >>> chosen_assembly(machine, {"motor": 0.7}, "open").number
    2
    """
    if isinstance(which, bool) or not isinstance(which, str | int):
        raise ModelError(
            f'assembly is {brief(which)}: give the name of a mode, such as "open", or its number'
        )
    modes = assembly_modes(system, driver_values)
    for mode in modes:
        if which in (mode.name, mode.number):
            return mode
    known = listed(f"{mode.number} {mode.name}".rstrip() for mode in modes)
    raise ModelError(
        f"there is no assembly mode {which!r} where the drivers begin (there are: {known}): choose "
        "one of these, or begin at another value of a driver"
    )
