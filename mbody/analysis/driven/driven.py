"""The analyses of driven motion: kinematics, kinetostatics and statics, by call and by request."""

from __future__ import annotations

import functools
import inspect
import math
import warnings
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np

from mbody.analysis.driven.path_following import PathEnded, Runner, through_change_points
from mbody.analysis.driven.time_grid import DriverValues, TimeGrid, by_time, check_timed, time_grid
from mbody.analysis.position.assembly_analysis import (
    ATTEMPTS,
    as_system,
    check_determined,
    closed,
)
from mbody.analysis.position.closed_position import ClosedPosition
from mbody.core import tolerances as tol
from mbody.errors import ModelError, ModelWarning, SolveError, angle_text, brief
from mbody.kernels.continuation import BY_DRIVER, BY_TIME
from mbody.laws import Law, times_of
from mbody.model.body import Guesses
from mbody.model.driver import Driver
from mbody.model.element import listed, unknown_name
from mbody.model.mechanism import Mechanism
from mbody.quantities import Formula, FormulaError
from mbody.quantities.formula import PlainNumbers
from mbody.quantities.units import DIMENSIONS
from mbody.solution.histories import Record, reported_certificate, with_fields
from mbody.solution.solution import Solution
from mbody.system.assembler import assemble
from mbody.system.system import System

if TYPE_CHECKING:
    from mbody.model.simulation import Instants

#: Travel of a driver [rad, length] that is not followed to see whether a position is meant.
LONGEST_TRAVEL = 1e3

Analysis = TypeVar("Analysis", bound=Callable[..., Solution])

#: What the docstrings of kinematics, kinetostatics and statics share.
SHARED = {
    "{parameters}": """
Parameters
----------
model : Mechanism or System
    Driven so that no freedom is left.
t : float or array (instants,), optional
    Times at which the laws of the drivers are taken, by default 0.
drive : mapping, optional
    Instead of laws: value, or (value, rate, acceleration), of drivers by name, floats or arrays
    (instants,), angles in rad. Drivers that are not named keep their laws.
turn : str or True, optional
    A whole turn of this driver (or driven body) from t = 0 on, at equal angles, both ends
    included, with the rates of its law.
instants : int, optional
    How many of a turn, by default 361, and 360 more for each further one.
turns : int, optional
    How many turns the driver makes, by default 1; 2 of a four-stroke engine.
guess : mapping, optional
    By body, instead of its own guess: angle [rad], or (x, y, angle) of the link axes. It
    chooses the branch; between instants the branch is followed.
assembly : str or int, optional
    In place of a guess the name or the number of one of the `assembly_modes` at the first
    instant, such as ``"open"``, ``"crossed"`` or 1.
""",
    "{raises}": """
Raises
------
ModelError
    For instants, drivers or guesses that do not fit the mechanism.
SolveError
    When loops do not close, the motion is not determined, a dead centre is in the way, or a
    function of the user failed. It carries what was computed before.
""",
}


def documented(analysis: Analysis) -> Analysis:
    """Put the shared sections into the docstring of a driven analysis."""
    if analysis.__doc__ is not None:
        text = inspect.cleandoc(analysis.__doc__)
        for place, section in SHARED.items():
            text = text.replace(place, section.strip())
        analysis.__doc__ = text
    return analysis


def driven(
    model: Mechanism | System,
    analysis: str,
    t: PlainNumbers | None = None,
    drive: DriverValues | None = None,
    turn: str | bool | None = None,
    instants: int | None = None,
    turns: int | None = None,
    guess: Guesses | None = None,
    assembly: str | int | None = None,
    before: int = 0,
    pose: np.ndarray | None = None,
) -> Solution:
    """Run a driven analysis: on lanes where there are many instants, else step by step. The first
    so many instants, `before` those requested, lead there and are left out. `pose`
    (3·bodies + 3,), instead of guesses: where the loops are nearly closed, the ground last.
    """
    system, failures = as_system(model), None
    check_timed(system)
    if system.batch is not None:
        from mbody.analysis.driven.batch import of_designs
        from mbody.analysis.position.design_results import DesignFailures

        failures = DesignFailures()
    grid = time_grid(system, t, drive, turn, instants, turns, failures)
    if assembly is not None and guess:
        raise ModelError("give a guess or an assembly, not both: each chooses the branch")

    def analysed(own: System) -> _DrivenDesign:
        nonlocal guess, assembly
        if assembly is not None:  # of the first design, on whose branch all are
            from mbody.analysis.assemblies.assembly_modes import chosen_assembly

            guess, assembly = chosen_assembly(own, _first_values(own, grid), assembly), None
        return _driven_design(own, guess, analysis, grid, before)

    if failures is None:
        one = analysed(system)
        return one.followed(one.closed(pose))
    return of_designs(system, analysed, pose, failures)


@dataclass(frozen=True)
class _DrivenDesign:
    """A driven analysis of one design at the instants of a grid, of which the first, `before` those
    requested, are left out; `notes` and `remedy` of its contacts, see `ClosedSystem`.
    """

    system: System
    guess: Guesses | None
    notes: tuple[str, ...]
    remedy: str
    analysis: str
    grid: TimeGrid
    before: int

    @functools.cached_property
    def runner(self) -> Runner:
        """The path of the motion."""
        return Runner(self.system, self.analysis)

    def closed(self, pose: np.ndarray | None, attempts: int = ATTEMPTS) -> ClosedPosition:
        """The first position, from the guesses or from a pose."""
        intended = None
        if not self.guess and pose is None:
            intended = functools.partial(_as_from_start, self.runner, self.grid)
        t, first = float(self.grid.t[0]), self.grid.first(self.system)
        return closed(self.system, t, first, self.guess, pose, intended, attempts)

    def followed(self, start: ClosedPosition) -> Solution:
        """The motion with its notes and doubts."""
        return self._finished(start, _follow(self.runner, start, self.grid, self.remedy))

    def reported(self, start: ClosedPosition, record: Record) -> Solution:
        """The notes and doubts of a motion that was followed."""
        return self._finished(start, self.runner.solution(start, self.grid, record))

    def _finished(self, start: ClosedPosition, found: Solution) -> Solution:
        if self.before:
            found = found.take(np.arange(self.before, len(found)))
        found = _with_reports(found, self.notes)
        pulling = self.runner.pulled(start, self.grid, found)
        if pulling:
            found = with_fields(found, notes=(*reported_certificate(found).notes, *pulling))
        return found


def _driven_design(
    system: System, guess: Guesses | None, analysis: str, grid: TimeGrid, before: int
) -> _DrivenDesign:
    """The analysis of a design with the contacts closed that determine it."""
    chosen: tuple[System, Guesses | None, tuple[str, ...], str] = system, guess, (), ""
    machine = system.mechanism
    if machine.contacts or any(joint.limited for joint in machine.joints):
        from mbody.analysis.contact.closed_contacts import with_closed_contacts

        chosen = with_closed_contacts(system, float(grid.t[0]), grid.first(system), guess)
    return _DrivenDesign(*chosen, analysis, grid, before)


def _with_reports(found: Solution, notes: tuple[str, ...]) -> Solution:
    """The result with what is to be said of its friction and its contacts, where it has such."""
    rows = found.system.friction_rows
    if rows.start == rows.stop and not found.mechanism.contacts:
        return found
    from mbody.analysis.driven.contact_report import with_contact_report, with_friction_notes
    from mbody.analysis.driven.open_forces import with_admissible_forces, with_pressing_forces

    found = with_admissible_forces(with_pressing_forces(with_friction_notes(found)))
    return with_contact_report(found, notes)


def _first_values(system: System, grid: TimeGrid) -> dict[str, float]:
    """Positions of the drivers of one design at the first instant."""
    laws = {
        driver.name: float(system.law_of(driver)(grid.t[0]))
        for driver in system.independent_drivers
    }
    return laws | grid.first(system)


def _as_from_start(runner: Runner, grid: TimeGrid, found: ClosedPosition) -> bool:
    """Whether a first position is that of the motion which begins at t = 0, where the description's
    guesses are; not where that cannot be decided.
    """
    system, drivers = runner.system, runner.system.drivers
    if not drivers or system.independent_drivers != drivers:
        return False
    try:
        begin = np.array([system.law_of(driver).derivatives(0.0) for driver in drivers])
        end = begin.copy()
        if grid.mode == BY_TIME:
            end[:, 0] = [system.law_of(driver)(grid.t[0]) for driver in drivers]
            path = by_time(system, np.array([0.0, grid.t[0]]))
        else:
            end[:, 0] = grid.given[0, :, 0]
            given = np.stack([begin, end])
            s = given[:, 0, 0] if grid.mode == BY_DRIVER else np.array([0.0, 1.0])
            path = TimeGrid(grid.mode, np.ascontiguousarray(s), np.zeros(2), given)
        if (np.abs(end - begin)[:, 0] > LONGEST_TRAVEL).any() or (end[:, 0] == begin[:, 0]).all():
            return False
        with warnings.catch_warnings():
            warnings.simplefilter("error", ModelWarning)
            start = closed(system, 0.0, {})
        q = Runner(system, runner.analysis).scalar(start, path, with_forces=False)[-1, :, 0]
    except (ModelError, SolveError, ModelWarning, PathEnded):
        return False
    n = system.coordinates
    off = (q[:n] - found.work.q[:n, 0]).reshape(-1, 3)
    rotation = np.abs(np.exp(1j * off[:, 2]) - 1.0).max()
    return bool(max(np.abs(off[:, :2]).max() / system.length, rotation) < tol.POSITION_SAME)


def _follow(runner: Runner, start: ClosedPosition, grid: TimeGrid, remedy: str) -> Solution:
    """The motion at all instants of the grid; `remedy`: what else may be done where something is
    free.
    """
    system = runner.system
    try:
        check_determined(system, start, runner.analysis, remedy)
    except SolveError as error:
        return through_change_points(runner, start, grid, {0}, error)
    try:
        return _single(runner, start, grid)
    except SolveError as stop:
        from mbody.analysis.driven.dead_centres import DeadCentre, with_ends

        if not isinstance(stop, DeadCentre):
            raise
        raise with_ends(stop, system, start) from None


def _single(runner: Runner, start: ClosedPosition, grid: TimeGrid) -> Solution:
    try:
        record = runner.record(start, grid)
    except PathEnded as stuck:
        error = runner.explain(stuck, start, grid)
        # an instant at which branches meet is reached as a limit, where the path goes on
        at_instant = abs(stuck.place - grid.s[stuck.done]) <= tol.PATH_STUCK_AT_INSTANT * np.ptp(
            grid.s
        )
        if not at_instant:
            raise error from None
        return through_change_points(runner, start, grid, {stuck.done}, error)
    return runner.solution(start, grid, record)


# -- Kinematics: positions, velocities and accelerations of a driven mechanism -----------------


@documented
def kinematics(
    model: Mechanism | System,
    t: PlainNumbers | None = None,
    *,
    drive: DriverValues | None = None,
    turn: str | bool | None = None,
    instants: int | None = None,
    turns: int | None = None,
    guess: Guesses | None = None,
    assembly: str | int | None = None,
) -> Solution:
    """Positions, velocities and accelerations of all bodies.

    Position, velocity and acceleration analysis: Φ = 0, Φ_q v = ν, Φ_q a = γ (Haug 1989).

    {parameters}

    Returns
    -------
    Solution
        Motion by name; no forces.

    {raises}

    Notes
    -----
    One Newton step and two solves an instant; the step between instants is halved until the
    branch is kept, however far apart they are.

    Examples
    --------
    >>> import mbody
    >>> run = mbody.kinematics(mbody.makers.four_bar(1, 3, 2, 3.5, speed=10.0), turn=True)
    >>> len(run)
    361
    """
    return driven(model, "kinematics", t, drive, turn, instants, turns, guess, assembly)


# -- Kinetostatics: all reactions and driver efforts of a given motion (inverse dynamics) ------


@documented
def kinetostatics(
    model: Mechanism | System,
    t: PlainNumbers | None = None,
    *,
    drive: DriverValues | None = None,
    turn: str | bool | None = None,
    instants: int | None = None,
    turns: int | None = None,
    guess: Guesses | None = None,
    assembly: str | int | None = None,
) -> Solution:
    """Motion, every joint force and every driver effort: inverse dynamics, dynamic force analysis.

    Φ_qᵀ λ = f − M a with the motion of the drivers given; d'Alembert's inertia forces −M a are
    among the loads (Norton, *Design of Machinery*, chapter 11).

    {parameters}

    Returns
    -------
    Solution
        Motion, reactions, efforts, inertia forces, breakdown by cause, residuals.

    {raises}

    Notes
    -----
    No mass is needed for it to be solvable: massless links are ordinary. Redundant rows give the
    reactions of least norm and mark those that are not unique.

    Examples
    --------
    >>> import mbody
    >>> machine = mbody.makers.four_bar(1, 3, 2, 3.5, masses=(1, 3, 2), speed=10.0)
    >>> run = mbody.kinetostatics(machine)
    >>> run.checks.virtual_work < 1e-12
    True
    """
    return driven(model, "kinetostatics", t, drive, turn, instants, turns, guess, assembly)


# -- Statics: reactions and driver efforts at rest ---------------------------------------------


@documented
def statics(
    model: Mechanism | System,
    t: PlainNumbers | None = None,
    *,
    drive: DriverValues | None = None,
    turn: str | bool | None = None,
    instants: int | None = None,
    turns: int | None = None,
    guess: Guesses | None = None,
    assembly: str | int | None = None,
) -> Solution:
    """Every joint force and driver effort at rest: velocities and accelerations are zero.

    Φ_qᵀ λ = f; the drivers hold their positions, their efforts are what holding takes.

    {parameters}

    Returns
    -------
    Solution
        Positions, reactions, efforts, breakdown by load, residuals.

    {raises}

    Notes
    -----
    Laws of the drivers give positions only; loads see no velocity.

    Examples
    --------
    >>> import mbody
    >>> machine = mbody.makers.four_bar(1, 3, 2, 3.5)
    >>> machine.add(mbody.Torque("load", "rocker", value=10.0))
    >>> run = mbody.statics(machine, drive={"motor": 0.5})
    >>> bool(run.effort("motor")[0] != 0.0)
    True
    """
    return driven(model, "statics", t, drive, turn, instants, turns, guess, assembly)


# -- An analysis at the instants that a description or a command requests ----------------------

ANALYSES = {"kinematics": kinematics, "kinetostatics": kinetostatics, "statics": statics}


def analyse_at(
    mechanism: Mechanism,
    analysis: str,
    ask: Instants | None = None,
    assembly: str | int | None = None,
) -> Solution:
    """A driven analysis at requested instants.

    The motion is followed from t = 0, so that the guesses of the bodies, which say the branch at
    the beginning, hold for every instant.

    By default those of the mechanism, else t = 0.

    >>> import mbody
    >>> from mbody.model.simulation import Instants
    >>> machine = mbody.makers.four_bar(1, 3, 2, 3.5, start=0.5, speed=10.0)
    >>> run = analyse_at(machine, "kinematics", Instants(at={"crank": "90 deg"}))
    >>> round(float(np.degrees(run["crank"].angle[0])), 6)
    90.0
    """
    from mbody.model.simulation import Instants

    wanted = ask or mechanism.ask or Instants()
    return analyse_system_at(assemble(mechanism), analysis, wanted, assembly)


def analyse_system_at(
    system: System, analysis: str, ask: Instants, assembly: str | int | None = None
) -> Solution:
    """Driven analysis of a system with the parameter values it has, at the requested instants."""
    verb = ANALYSES[analysis]
    how, before = arguments_at(system, ask)
    if assembly is not None:
        return verb(system, **_from(how, before), assembly=assembly)
    if not before:
        return verb(system, **how)
    try:
        t, drive = how.get("t"), how.get("drive")
        return driven(system, analysis, t, drive, None, None, None, None, before=before)
    except SolveError:
        # where the beginning cannot be reached the instants may be taken by themselves
        return verb(system, **_from(how, before))


def _from(how: dict[str, Any], before: int) -> dict[str, Any]:
    """Arguments without the first instants, which lead to those requested."""
    if "t" in how:
        return {"t": how["t"][before:]}
    if "drive" in how:
        return {"drive": {name: values[before:] for name, values in how["drive"].items()}}
    return how


def arguments_at(system: System, ask: Instants) -> tuple[dict[str, Any], int]:
    """The arguments of an analysis, and how many instants it has before the requested ones."""
    if ask.over:
        turn = True if ask.over == "turn" else ask.over
        return {"turn": turn, "instants": ask.instants, "turns": ask.turns}, 0
    if not ask.at:
        return {}, 0
    wanted = _instants(system, ask)
    if "t" in wanted:
        return {"t": np.concatenate([[0.0], wanted["t"]])}, 1
    return {"drive": {d.name: _before(system, d, wanted) for d in system.independent_drivers}}, 1


def dimension_of_instants(mechanism: Mechanism, name: str) -> str:
    """The dimension of the values that are requested by that name: of t, of a driver."""
    if name == "t":
        return "time"
    return "angle" if _driver(mechanism, name).angular else "length"


def check_instants(mechanism: Mechanism, ask: Instants) -> None:
    """Refuse a question that no analysis of the mechanism could answer."""
    for name, row in ask.at.items():
        if name == "t" and len(ask.at) > 1:
            raise ModelError("ask: give t or values of drivers, not both")
        _values(mechanism, name, row)
    drivers = [_driver(mechanism, name).name for name in ask.at if name != "t"]
    if len(set(drivers)) < len(drivers):
        raise ModelError(f"ask: {listed(ask.at)} are one driver: name it once")
    counts = {name: len(row) for name, row in ask.at.items() if len(row) > 1}
    if len(set(counts.values())) > 1:
        counted = " and ".join(f"{count} of '{name}'" for name, count in counts.items())
        raise ModelError(f"ask: there are {counted}: give as many values of each, or one")
    if ask.over not in ("", "turn"):
        _driver(mechanism, ask.over)


def _before(system: System, driver: Driver, wanted: dict[str, np.ndarray]) -> np.ndarray:
    """Values of a driver, its own beginning first."""
    begin = float(system.law_of(driver)(0.0))
    count = max(len(values) for values in wanted.values())
    values = np.broadcast_to(wanted.get(driver.name, np.array([begin])), count)
    return np.concatenate([[begin], values])


def _instants(system: System, ask: Instants) -> dict[str, np.ndarray]:
    """Times, or values of drivers that rest, by name."""
    mechanism = system.mechanism
    check_instants(mechanism, ask)
    if "t" in ask.at:
        return {"t": _values(mechanism, "t", ask.at["t"])}
    wanted: dict[str, np.ndarray] = {}
    for name, row in ask.at.items():
        wanted[_driver(mechanism, name).name] = _values(mechanism, name, row)
    moving = [d for d in system.independent_drivers if not _never_moves(system, d)]
    named = [d for d in moving if d.name in wanted]
    if not moving:
        return wanted
    if not named:
        raise ModelError(
            f"ask: '{next(iter(wanted))}' rests while '{moving[0].name}' moves: say where "
            f"'{moving[0].name}' is, or give t",
            moving[0].name,
        )
    times = _times(system, named[0], wanted[named[0].name])
    times = np.broadcast_to(times, max(len(values) for values in wanted.values()))
    for driver in system.independent_drivers:
        if driver.name in wanted and driver is not named[0]:
            _check_meets(system, driver, wanted[driver.name], named[0], times)
    return {"t": times}


def _never_moves(system: System, driver: Driver) -> bool:
    """Whether a driver never moves; a law that begins with a dwell, or gently, does."""
    law = system.law_of(driver)
    return law.kind == "polynomial" and not any(law.parameters(law.numbers())[1:])


def _driver(mechanism: Mechanism, name: str) -> Driver:
    """The driver of that name, or the one that drives the body of that name."""
    found = [d for d in mechanism.drivers if name in (d.name, getattr(d, "body", None))]
    if not found:
        raise unknown_name("driver", name, mechanism.drivers, more=", and t is time")
    return found[0]


def _values(mechanism: Mechanism, name: str, row: Any) -> np.ndarray:
    wanted = DIMENSIONS[dimension_of_instants(mechanism, name)]
    scope = mechanism.parameters.scope()
    try:
        return np.array([v.of(wanted).value(scope) if isinstance(v, Formula) else v for v in row])
    except FormulaError as error:
        raise ModelError(f"'{name}': {error}", name) from None


def _times(system: System, driver: Driver, values: np.ndarray) -> np.ndarray:
    """Times at which the law of a driver takes values: an angle at the first turn that has it, and
    angles in a row from the beginning of the law or later at their own turns, as 360 deg after 0.
    """
    law = system.law_of(driver)
    if not driver.angular:
        return np.array([_time(law, driver, [value]) for value in values])
    begin, rate, change = law.derivatives(0.0)
    # where the law begins too gently its derivatives do not show the direction
    sign = math.copysign(1.0, rate or change or 1.0)
    travels = sign * (values - begin)
    if len(travels) > 1 and travels[0] > -tol.LAW_TURN_ROUNDING and (np.diff(travels) > 0.0).all():
        travels = np.maximum(travels, 0.0)
        travels += _further(travels[0]) - travels[0]
        return np.array([_time(law, driver, [begin + sign * travel]) for travel in travels])
    signs = (sign, -sign)
    places = [[begin + s * _further(s * (value - begin)) for s in signs] for value in values]
    return np.array([_time(law, driver, both) for both in places])


def _time(law: Law, driver: Driver, places: list[float]) -> float:
    """Time at which the law of a driver is first at one of some places, in their order."""
    why: ModelError | None = None
    for place in places:
        try:
            write = angle_text if driver.angular else "{:g}".format
            return float(times_of(law, [place], 0.0, write)[0])
        except ModelError as error:
            why = why or error
    raise ModelError(f"driver '{driver.name}' does not come there by its law: {why}", driver.name)


def _further(travel: float) -> float:
    """Remainder of an angle [rad] by whole revolutions, 0 … 2π."""
    further = math.fmod(travel, 2.0 * math.pi)
    further += 2.0 * math.pi if further < -tol.LAW_TURN_ROUNDING else 0.0
    return 0.0 if 2.0 * math.pi - further < tol.LAW_TURN_ROUNDING else max(further, 0.0)


def _check_meets(
    system: System, driver: Driver, values: np.ndarray, independent: Driver, times: np.ndarray
) -> None:
    """Refuse values of a second driver that its law does not have at the times of the first."""
    there = system.law_of(driver)(times)
    difference = there - values
    if driver.angular:  # at any turn
        difference = np.remainder(difference + math.pi, 2.0 * math.pi) - math.pi
    size = driver.unit(system.length) + np.abs(there).max()
    if np.abs(difference).max() > tol.LOOP_DRIVER_OTHER_POSITION * size:
        raise ModelError(
            f"by its law '{driver.name}' is at {there[0]:g} when '{independent.name}' is where you "
            "want it: name one of them, or give t",
            driver.name,
        )


# -- The instants that a function which analyses is called with, as options of the analysis ----

#: Those of an analysis, then those of `Instants`.
KNOWN = ("t", "drive", "turn", "instants", "turns", "guess", "at", "over")


@dataclass(frozen=True)
class RequestedInstants:
    """A driven analysis and its instants.

    `options`: Arguments of the analysis; not used where `ask` is given.
    `revolving`: The driver whose turn it is; empty where none turns.
    """

    analysis: str
    options: Mapping[str, Any]
    ask: Instants | None
    revolving: str

    def analysed(self, system: System) -> Solution:
        """The result of a system."""
        if self.ask is not None:
            return analyse_system_at(system, self.analysis, self.ask)
        return ANALYSES[self.analysis](system, **self.options)


def requested_instants(
    system: System, analysis: str, options: Mapping[str, Any], verb: str, others: Sequence[str] = ()
) -> RequestedInstants:
    """Instants and options of an analysis as requested; by default the mechanism's own instants.
    Messages begin with the verb; `others`: further analyses that it accepts.
    """
    from mbody.model.simulation import Instants

    if analysis not in ANALYSES:
        raise ModelError(
            f"{verb}: there is no analysis {brief(analysis)} with derivatives (there are: "
            f"{listed([*ANALYSES, *others])})"
        )
    for name in options:
        if name not in KNOWN:
            raise ModelError(f"{verb}: there is no option {name!r} (there are: {listed(KNOWN)})")
    ask = None
    if not options or "at" in options or "over" in options:
        ask = Instants(**options) if options else system.mechanism.ask or Instants()
    turn = options.get("turn") if ask is None else ask.over
    return RequestedInstants(analysis, options, ask, revolving_driver(system, turn))


def analyse_with(system: System, analysis: str, options: Mapping[str, Any], verb: str) -> Solution:
    """The result at the instants that `requested_instants` finds in the options."""
    return requested_instants(system, analysis, options, verb).analysed(system)


def revolving_driver(system: System, turn: Any) -> str:
    """The driver whose turn it is, by its own name or that of its body, or `True` or "turn" for the
    first; empty where none turns.
    """
    if not turn:
        return ""
    if turn is True or turn == "turn":
        return str(system.drivers[0].name) if system.drivers else ""
    found = [d for d in system.drivers if turn in (d.name, getattr(d, "body", None))]
    return str(found[0].name) if found else ""
