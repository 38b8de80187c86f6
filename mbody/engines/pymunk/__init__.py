"""pymunk as a second opinion: a game engine, of the first order, that shares nothing with mbody.

Its steps are short ones of four or three sizes, and its word is the limit of what they say: so an
engine whose own errors are some parts in a thousand gives a verdict of some in a million.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mbody.engines.independent_reading import reading
from mbody.engines.opinion import Inexpressible, Opinion, Row
from mbody.engines.pymunk.instants import InstantForces, at_instants, kinematic
from mbody.engines.pymunk.motion import Trajectory, trajectory
from mbody.engines.pymunk.space import PRESSED, inexpressible
from mbody.errors import ModelError, SolveError
from mbody.model.element import listed
from mbody.model.joints import Fixed, Prismatic, Rolling
from mbody.solution.solution import Solution, as_solution
from mbody.system.system import System

__all__ = ["opinion"]

Array = np.ndarray

#: Instants of a driven motion whose forces are compared, at most.
INSTANTS = 19
#: How much more may differ than the last extrapolation changed.
MARGIN = 3.0
#: Below this part differences are those of rounding; and of a free motion, those of our own
#: tolerance, 1e-8 a step unless asked for less.
FLOOR, OURS = 1e-8, 1e-7
#: Where more than this part is open, pymunk sees nothing.
BLIND = 0.01
#: What is below this part of its kin is nothing but rounding.
NONE = 1e-9


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
    """Rows, what has none, and at how many instants something was not compared."""

    rows: list[Row]
    unseen: list[Inexpressible]
    blind: int


def opinion(system: System, run: Solution) -> Opinion:
    """What pymunk says of a result of kinetostatics, statics or simulate.

    Of a driven motion and of rest: forces, torques and efforts at instants of the run, each seen
    in a few short steps, and the motion itself, where laws give it. Of a free motion: the same
    along a motion of pymunk's own from the first instant on. Every number is extrapolated to steps
    of no length; impulses get their directions from the momenta of the bodies.

    Parameters
    ----------
    system : System
        What is built in pymunk.
    run : Solution
        What is checked, of one design.

    Returns
    -------
    Opinion
        With a row a number, what pymunk cannot express, and notes on how it was asked.

    Raises
    ------
    ModelError
        For a batch, or an analysis without forces.
    SolveError
        Where pymunk is not installed.

    Examples
    --------
    >>> import mbody
    >>> run = mbody.kinetostatics(mbody.makers.four_bar(1, 3, 2, 3.5, masses=(1, 3, 2), speed=10.0))
    >>> opinion(run.system, run).agrees
    True
    """
    run = as_solution(run)
    if system.batch is not None or run.record.batch:
        raise ModelError("pymunk checks one design: choose one of the batch with design(n)")
    if not run.has_forces:
        raise ModelError(
            f"{run.analysis} finds no forces for pymunk to check: use kinetostatics or simulate"
        )
    try:
        import pymunk
    except ImportError:
        raise SolveError("pymunk is not installed: pip install pymunk") from None
    missing = list(inexpressible(system))
    left_out = {one.element for one in missing}
    notes: list[str] = []
    rows: list[Row] = []
    free = run.analysis == "simulate"
    moved = None if left_out or _given(run) else trajectory(system, run)
    if not free or moved is None:
        found = at_instants(system, run, _instants(run))
        compared = _of_instants(run, found, left_out)
        rows, missing = compared.rows, missing + compared.unseen
        notes = _told_of_instants(run, found, compared.blind)
    if moved is not None and (free or len(run) > 1):
        compared = _of_motion(run, moved, free)
        rows, missing = rows + compared.rows, missing + compared.unseen
        told = _told_of_motion(run, moved, compared.blind)
        notes += [note for note in told if note not in notes]
    return Opinion(f"pymunk {pymunk.version}", tuple(rows), tuple(missing), tuple(notes))


def _given(run: Solution) -> bool:
    """Whether no motion over time is there to be followed."""
    return run.analysis == "statics" or run.given is not None or not np.ptp(run.t) > 0.0


def _instants(run: Solution) -> list[int]:
    """Instants of the run, evenly, not more than are compared."""
    picked = np.linspace(0, len(run) - 1, min(len(run), INSTANTS)).round()
    return [int(k) for k in picked]


# -- quantities -------------------------------------------------------------------------------


def _forces(
    run: Solution, where: InstantForces | Trajectory, left_out: set[str]
) -> list[_Quantity]:
    """Reactions and efforts that the model determines."""
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
            told = part < 2 or isinstance(joint, Fixed | Prismatic)
            if joint.name not in left_out and told and unique[part]:
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
    """The greatest of every kind; of what is nothing but rounding that of its kin, by a length."""
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
        if tops[one] <= NONE * tops[other] * by:
            tops[one] = tops[other] * by
    return {kind: top or 1.0 for kind, top in tops.items()}


def _rows(
    quantities: list[_Quantity], length: float, floors: dict[str, float], reason: str
) -> _Compared:
    """A row a quantity, at the instant at which the difference is the greatest of what is expected.

    What is expected at an instant is the same for all quantities of a kind, for that of a single
    one may vanish by chance.
    """
    tops, rows, unseen_ones = _tops(quantities, length), [], []
    blind = np.zeros(len(quantities[0].ours) if quantities else 0, dtype=bool)
    for one in quantities:
        top = tops[one.kind]
        left = np.max([other.spread for other in quantities if other.kind == one.kind], axis=0)
        floor = max(FLOOR, floors.get("loose", 0.0), floors.get(one.kind, 0.0) / top)
        expected = MARGIN * left / top + floor
        difference = np.abs(one.theirs - one.ours) / top
        unseen = ~(expected <= BLIND)
        blind |= unseen
        if unseen.all():
            why = "pymunk's steps do not converge on it: they leave more than 1 % open everywhere"
            unseen_ones.append(Inexpressible(one.name, why))
            continue
        worst = int(np.argmax(np.where(unseen, -1.0, difference / expected)))
        ours, theirs, far, may = (
            float(part[worst]) for part in (one.ours, one.theirs, difference, expected)
        )
        rows.append(Row(one.name, ours, theirs, far, may, reason))
    return _Compared(rows, unseen_ones, int(blind.sum()))


def _pressed(run: Solution, left_out: set[str]) -> float:
    """What wheels make that are greater than told, so that they touch: a part of the whole."""
    touching = [j for j in run.mechanism.joints if isinstance(j, Rolling)]
    return 2.0 * PRESSED if any(joint.name not in left_out for joint in touching) else 0.0


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
    reason = "what extrapolation to steps of no length leaves open, and rounding of short steps"
    return _rows(quantities, length, floors, reason)


def _of_motion(run: Solution, moved: Trajectory, free: bool) -> _Compared:
    quantities = _motions(run, moved, "place")
    if free:
        quantities += _forces(run, moved, set())
        if run.energy is not None:
            ours = run.energy.kinetic[moved.instants]
            n = run.system.coordinates
            momenta = reading(run.system).masses.ravel() * np.abs(moved.values[:, n : 2 * n])
            # of each rate by itself, since in the sum they may cancel by chance
            left = (momenta * moved.spread[:, n : 2 * n]).sum(axis=1)
            theirs = moved.values[:, -1]
            quantities.append(_Quantity("kinetic energy", "energy", ours, theirs, left))
    reason = "what extrapolation of a first-order motion to steps of no length leaves open"
    floors = {"loose": moved.loose + (OURS if free else 0.0) + _pressed(run, set())}
    return _rows(quantities, run.system.length, floors, reason)


# -- notes ------------------------------------------------------------------------------------


def _told_of(run: Solution, where: InstantForces | Trajectory, blind: int) -> list[str]:
    notes = []
    if blind:
        notes.append(
            f"at {blind} of {len(where.instants)} instants its steps leave more than {BLIND:.0%} "
            "open, as near singular positions: what is so is not compared there"
        )
    open_ones = [
        joint.name
        for joint in run.mechanism.joints
        if not all(run.reaction(joint.name).unique or (True,))
    ]
    if open_ones:
        notes.append(f"redundant joints leave open, and so not compared: {listed(open_ones)}")
    if where.lumped:
        notes.append(
            f"pymunk needs mass: {listed(where.lumped)} had stand-ins for mass or inertia, whose "
            "influence is extrapolated to none"
        )
    if where.over:
        notes.append(f"applied as mbody tells them, not checked: {listed(where.over)}")
    return notes


def _told_of_instants(run: Solution, found: InstantForces, blind: int) -> list[str]:
    count = len(found.instants)
    which = f"{count} of {len(run)} instants" if count < len(run) else "all instants"
    return [f"forces at {which}, each reached by a few short steps", *_told_of(run, found, blind)]


def _told_of_motion(run: Solution, moved: Trajectory, blind: int) -> list[str]:
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
            "the motion was cut where the step sizes no longer agreed, as where nearby motions "
            "part, or where short steps would be too many"
        )
    return [*notes, *_told_of(run, moved, blind)]
