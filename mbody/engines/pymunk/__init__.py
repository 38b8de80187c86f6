"""Cross-check by pymunk: a game engine with a first-order integrator, independent of mbody.

It is run with four or three short step sizes, and the results are extrapolated to step size 0. So
an engine with errors of some parts in a thousand can check results to some parts in a million.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mbody.core import tolerances as tol
from mbody.engines.balance import CrosscheckResult, Inexpressible, Row
from mbody.engines.independent_reading import reading
from mbody.engines.pymunk.motion import (
    InstantForces,
    Trajectory,
    at_instants,
    contact_crosscheck,
    kinematic,
    trajectory,
)
from mbody.engines.pymunk.space import Space, inexpressible
from mbody.errors import ModelError, SolveError
from mbody.model.element import listed, takes_one_design
from mbody.model.joints import Fixed, Prismatic, Rolling
from mbody.solution.solution import Solution, as_solution
from mbody.system.system import System

__all__ = ["crosscheck_result"]

Array = np.ndarray

#: Instants of a driven motion whose forces are compared, at most.
INSTANTS = 19


@dataclass(frozen=True)
class _Quantity:
    """One number by both engines over some instants: arrays (instants,)."""

    name: str
    kind: str
    ours: Array
    theirs: Array
    spread: Array


@dataclass(frozen=True)
class _Compared:
    """Rows, quantities without a row, and the number of instants with something not compared."""

    rows: list[Row]
    unseen: list[Inexpressible]
    blind: int


def crosscheck_result(system: System, run: Solution) -> CrosscheckResult:
    """Cross-check by pymunk of a result of kinetostatics, statics or simulate.

    For a driven motion and at rest: forces, torques and efforts at instants of the run, each by a
    few short steps, and the motion itself if it has laws of time. For a free motion: the same along
    pymunk's own motion from the first instant on. Every number is extrapolated to step size 0; the
    directions of impulses follow from the momenta of the bodies.

    `system`: The system that pymunk models.
    `run`: The result to check, of one design.
    Returns a row for each number, the elements that pymunk cannot model, and notes.
    Raises ModelError for a batch, or an analysis without forces.
    Raises SolveError where pymunk is not installed.

    Examples
    --------
    >>> import mbody
    >>> run = mbody.kinetostatics(mbody.makers.four_bar(1, 3, 2, 3.5, masses=(1, 3, 2), speed=10.0))
    >>> crosscheck_result(run.system, run).agrees
    True
    """
    run = as_solution(run)
    takes_one_design("pymunk", system.batch or run.record.batch or None)
    if not run.has_forces:
        raise ModelError(
            f"{run.analysis} computes no forces for pymunk to check: use kinetostatics or simulate"
        )
    try:
        import pymunk
    except ImportError:
        raise SolveError("pymunk is not installed: pip install pymunk") from None
    if run.analysis == "simulate" and run.mechanism.contacts:
        return contact_crosscheck(system, run, f"pymunk {pymunk.version}")
    missing = list(inexpressible(system))
    left_out = {one.element for one in missing}
    notes: list[str] = []
    rows: list[Row] = []
    free = run.analysis == "simulate"
    moved = None if left_out or _without_time(run) else trajectory(system, run)
    if not free or moved is None:
        found = at_instants(system, run, _instants(run))
        compared = _of_instants(run, found, left_out)
        rows, missing = compared.rows, missing + compared.unseen
        notes = _notes_of_instants(run, found, compared.blind)
    if moved is not None and (free or len(run) > 1):
        compared = _of_motion(run, moved, free)
        rows, missing = rows + compared.rows, missing + compared.unseen
        more = _notes_of_motion(run, moved, compared.blind)
        notes += [note for note in more if note not in notes]
    adopted = (*Space(system, 1.0, 1).adopted, *sorted(left_out))
    engine = f"pymunk {pymunk.version}"
    return CrosscheckResult(engine, tuple(rows), tuple(missing), tuple(notes), adopted)


def _without_time(run: Solution) -> bool:
    """Whether the run has no motion over time."""
    return run.analysis == "statics" or run.given is not None or not np.ptp(run.t) > 0.0


def _instants(run: Solution) -> list[int]:
    """Instants of the run that are compared, evenly spaced."""
    picked = np.linspace(0, len(run) - 1, min(len(run), INSTANTS)).round()
    return [int(k) for k in picked]


# -- quantities -------------------------------------------------------------------------------


def _forces(
    run: Solution, where: InstantForces | Trajectory, left_out: set[str]
) -> list[_Quantity]:
    """Reactions and efforts that are unique."""
    k, owners = where.instants, np.array(where.parts)
    first = 3 * run.system.coordinates
    shape = (len(k), len(owners), 4)
    values, spread = (
        table[:, first : first + 4 * len(owners)].reshape(shape)
        for table in (where.values, where.spread)
    )

    def quantity(name: str, key: str, kind: str, ours: Array, part: int) -> _Quantity:
        mine = owners == name
        theirs, left = (table[:, mine, part].sum(axis=1) for table in (values, spread))
        return _Quantity(f"{name}.{key}", kind, ours[k], theirs, left)

    found = []
    for joint in run.mechanism.joints:
        reaction = run.reaction(joint.name)
        unique = reaction.unique or (True, True, True)
        for part, key in enumerate(("fx", "fy", "torque")):
            has_part = part < 2 or isinstance(joint, Fixed | Prismatic)
            if joint.name not in left_out and has_part and unique[part]:
                kind = "force" if part < 2 else "torque"
                found.append(quantity(joint.name, key, kind, getattr(reaction, key), part))
    for driver in run.mechanism.drivers:
        if driver.name not in left_out:
            kind = driver.effort_dimension
            found.append(quantity(driver.name, "effort", kind, run.effort(driver.name), 3))
    return found


def _motions(run: Solution, where: InstantForces | Trajectory, part: str) -> list[_Quantity]:
    """Places or accelerations of all bodies."""
    ours, n = kinematic(run, part)[where.instants], run.system.coordinates
    first = {"place": 0, "acceleration": 2 * n}[part]
    values, spread = (
        table[:, first : first + n].reshape(ours.shape) for table in (where.values, where.spread)
    )
    keys = {"place": ("x", "y", "angle"), "acceleration": ("ax", "ay", "alpha")}[part]
    kinds = {"place": ("length", "angle"), "acceleration": ("acceleration", "turning")}[part]
    return [
        _Quantity(
            f"{body.name}.{key}", kinds[m == 2], *(t[:, b, m] for t in (ours, values, spread))
        )
        for b, body in enumerate(run.mechanism.bodies)
        for m, key in enumerate(keys)
    ]


# -- rows -------------------------------------------------------------------------------------


def _tops(quantities: list[_Quantity], length: float) -> dict[str, float]:
    """The greatest value of every kind; where it is rounding, that of the related kind, by a
    length.
    """
    tops = {
        kind: max((float(np.abs(q.ours).max()) for q in quantities if q.kind == kind), default=0.0)
        for kind in ("force", "torque", "acceleration", "turning", "length", "angle", "energy")
    }
    for one, other, by in (
        ("torque", "force", length),
        ("force", "torque", 1.0 / length),
        ("turning", "acceleration", 1.0 / length),
        ("acceleration", "turning", length),
    ):
        if tops[one] <= tol.COMPARISON_VALUE_NONE * tops[other] * by:
            tops[one] = tops[other] * by
    return {kind: top or 1.0 for kind, top in tops.items()}


def _rows(
    quantities: list[_Quantity], length: float, floors: dict[str, float], reason: str
) -> _Compared:
    """A row for each quantity, at the instant of the greatest difference relative to the expected
    one.

    The expected difference at an instant is the same for all quantities of a kind, since that of a
    single one may vanish by chance.
    """
    tops, rows, unseen_ones = _tops(quantities, length), [], []
    blind = np.zeros(len(quantities[0].ours) if quantities else 0, dtype=bool)
    for one in quantities:
        top = tops[one.kind]
        left = np.max([other.spread for other in quantities if other.kind == one.kind], axis=0)
        floor = max(
            tol.COMPARISON_FLOOR_PYMUNK, floors.get("loose", 0.0), floors.get(one.kind, 0.0) / top
        )
        expected = tol.COMPARISON_MARGIN_PYMUNK * left / top + floor
        difference = np.abs(one.theirs - one.ours) / top
        unseen = ~(expected <= tol.COMPARISON_COARSE)
        blind |= unseen
        if unseen.all():
            why = "pymunk's steps do not converge: the error estimate is more than 1 % everywhere"
            unseen_ones.append(Inexpressible(one.name, why))
            continue
        worst = int(np.argmax(np.where(unseen, -1.0, difference / expected)))
        ours, theirs, gap, may = (
            float(part[worst]) for part in (one.ours, one.theirs, difference, expected)
        )
        rows.append(Row(one.name, ours, theirs, gap, may, reason))
    return _Compared(rows, unseen_ones, int(blind.sum()))


def _pressed(run: Solution, left_out: set[str]) -> float:
    """Error by wheels that are slightly enlarged so that they touch: relative."""
    touching = [j for j in run.mechanism.joints if isinstance(j, Rolling)]
    return (
        2.0 * tol.PYMUNK_WHEEL_PRESSED
        if any(joint.name not in left_out for joint in touching)
        else 0.0
    )


def _of_instants(run: Solution, found: InstantForces, left_out: set[str]) -> _Compared:
    quantities = _forces(run, found, left_out)
    if left_out:
        quantities += _motions(run, found, "acceleration")
    length = run.system.length
    floors = {
        "loose": _pressed(run, left_out),
        "force": found.rounding,
        "torque": found.rounding * length,
        "acceleration": found.jitter,
        "turning": found.jitter / length,
    }
    reason = "error of the extrapolation to step size 0, and rounding of short steps"
    return _rows(quantities, length, floors, reason)


def _of_motion(run: Solution, moved: Trajectory, free: bool) -> _Compared:
    quantities = _motions(run, moved, "place")
    if free:
        quantities += _forces(run, moved, set())
        if run.energy is not None:
            ours = run.energy.kinetic[moved.instants]
            n = run.system.coordinates
            momenta = reading(run.system).masses.ravel() * np.abs(moved.values[:, n : 2 * n])
            # for each rate separately, since in the sum they may cancel by chance
            left = (momenta * moved.spread[:, n : 2 * n]).sum(axis=1)
            theirs = moved.values[:, -1]
            quantities.append(_Quantity("kinetic energy", "energy", ours, theirs, left))
    reason = "error of the extrapolation of a first-order motion to step size 0"
    floors = {
        "loose": moved.loose + (tol.COMPARISON_OURS_PYMUNK if free else 0.0) + _pressed(run, set())
    }
    return _rows(quantities, run.system.length, floors, reason)


# -- notes ------------------------------------------------------------------------------------


def _notes_of(run: Solution, where: InstantForces | Trajectory, blind: int) -> list[str]:
    notes = []
    if blind:
        notes.append(
            f"at {blind} of {len(where.instants)} instants the extrapolation error is more than "
            f"{tol.COMPARISON_COARSE:.0%}, as near singular positions: these values are not "
            "compared"
        )
    open_ones = [
        joint.name
        for joint in run.mechanism.joints
        if not all(run.reaction(joint.name).unique or (True,))
    ]
    if open_ones:
        notes.append(
            f"not unique because of redundant joints, and so not compared: {listed(open_ones)}"
        )
    if where.lumped:
        notes.append(
            f"pymunk needs mass: {listed(where.lumped)} have small artificial masses or inertias, "
            "whose influence is extrapolated to zero"
        )
    if where.over:
        notes.append(f"applied with the values from mbody, not checked: {listed(where.over)}")
    return notes


def _notes_of_instants(run: Solution, found: InstantForces, blind: int) -> list[str]:
    count = len(found.instants)
    which = f"{count} of {len(run)} instants" if count < len(run) else "all instants"
    return [f"forces at {which}, each by a few short steps", *_notes_of(run, found, blind)]


def _notes_of_motion(run: Solution, moved: Trajectory, blind: int) -> list[str]:
    unit = run.mechanism.units.of("time")
    what = (
        f"a motion over {moved.horizon:.4g} {unit} in steps of {moved.step:.3g} {unit} and a half "
        f"and a quarter of it"
    )
    if np.isfinite(moved.order):
        what += f"; observed order {moved.order:.3f}"
    notes = [what]
    if moved.shortened:
        notes.append(
            "the motion was shortened where the step sizes no longer agreed, as where nearby "
            "motions diverge, or where too many short steps would be needed"
        )
    return [*notes, *_notes_of(run, moved, blind)]
