"""Residuals of a finished solution, and the breakdown of its forces by cause."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, NamedTuple, TypeAlias

import numpy as np

from mbody.core import tolerances as tol
from mbody.core.presentation import Presented, present
from mbody.errors import ModelError
from mbody.kernels.constraints import KINDS
from mbody.kernels.friction import DETERMINANT
from mbody.kernels.layout import PER_PRIMITIVE, Work, lost_masses
from mbody.model.element import Marker, listed
from mbody.solution.histories import (
    BranchDistance,
    Certificate,
    Checks,
    DesignReport,
    Reaction,
    Result,
    failed_designs,
    motion_at,
    motion_rows,
    one_design,
    reaction_torque,
    reported_certificate,
)
from mbody.system.system import Locked, System

if TYPE_CHECKING:
    from mbody.solution.doubts import Doubt


# -- Balances of a solution: its momentum, and the equations of its forces ---------------------

Array = np.ndarray
#: A place: a point by name, or x and y in world axes.
PlaceLike: TypeAlias = "Marker | str | Sequence[float] | np.ndarray[Any, Any]"


@dataclass(frozen=True, eq=False)
class Momentum(Locked):
    """Momentum of a motion: arrays (instants,), of a batch with a first axis of designs.

    `x`, `y`: Of all bodies together, Σ m v, world axes [force·time].
    `angular`: About the place, counter-clockwise [force·length·time].
    `mass`: Of all bodies.
    `centre`: Mass centre of all bodies; nan where none has mass.
    """

    x: Array
    y: Array
    angular: Array
    mass: Any
    centre: tuple[Array, Array]


def momentum(run: Result, about: PlaceLike = (0.0, 0.0)) -> Momentum:
    """Linear and angular momentum of all bodies of a solution (impulse, moment of momentum).

    p = Σ m v,  L = Σ [(r_G − o) × m v + I ω]

    Parameters
    ----------
    run : Result
        Of an analysis that finds velocities.
    about : (x, y), Marker or str, optional
        The place o that the angular momentum is about: one at rest, by default the
        origin; or a place on a body, such as ``"crank.A"``, where it is at each instant.

    Returns
    -------
    Momentum
        `x`, `y`, `angular`, and the `mass` and `centre` of all bodies.

    Raises
    ------
    ModelError
        For a place that is none.

    Notes
    -----
    About a place that moves, velocities are still those of the world. The ground does not count.

    Examples
    --------
    >>> import mbody
    >>> run = mbody.kinetostatics(mbody.makers.four_bar(1, 3, 2, 3.5, masses=(1, 3, 2), speed=10.0))
    >>> of_all = momentum(run)
    >>> x, y = of_all.centre
    >>> moved = momentum(run, about=(2.0, 0.0)).angular - of_all.angular
    >>> bool(abs(moved + 2.0 * of_all.y).max() < 1e-12)
    True
    """
    ox, oy = _reference_point(run, about)
    mass = run.system.mass[: run.system.coordinates]
    zero = np.zeros_like(run.record.take(0))
    x, y, angular, mx, my = (zero.copy() for _ in range(5))
    whole: Any = 0.0
    for name in run:
        body, b = run[name], run.system.bodies[name]
        own = mass[3 * b : 3 * b + 3]
        m, _, inertia = own[:, :, None] if run.system.batch is not None else own[:, 0]
        x += m * body.vx
        y += m * body.vy
        angular += m * ((body.x - ox) * body.vy - (body.y - oy) * body.vx) + inertia * body.omega
        mx += m * body.x
        my += m * body.y
        whole = whole + m
    with np.errstate(invalid="ignore"):
        centre = mx / whole, my / whole
    return Momentum(x, y, angular, whole, centre)


def _reference_point(run: Result, about: PlaceLike) -> tuple[Any, Any]:
    """Coordinates of the place: numbers, or arrays over the instants."""
    if isinstance(about, str | Marker):
        at = run.point(about)
        return at.x, at.y
    try:
        x, y = (float(part) for part in about)
    except (TypeError, ValueError):
        x = y = np.nan
    if not np.isfinite([x, y]).all():
        raise ModelError(f'about must be a place, such as (0.0, 0.0) or "crank.A", not {about!r}')
    return x, y


# -- The system of force equations of one instant, as arrays: Newton and Euler of every link ---


@dataclass(frozen=True, eq=False)
class Equations(Locked, Presented):
    """matrix · unknowns = right-hand side: Newton's and Euler's equations of every moving link.

    A row is Σ of what joints and drivers exert = m a − loads, moments about the mass centre. A
    column is what a unit of its unknown exerts on all links. ``print(run.equations())`` shows them.

    `rows`, `row_units`: ΣFx, ΣFy and ΣM of the links in the order of the description, and their
      units.
    `unknowns`, `units`, `meanings`: Names of the unknowns in the order of joints, couplings,
      drivers; their units; what each is.
    `matrix` (rows, unknowns): Square where constraints determine the motion and none is redundant.
    `rhs` (rows,): m a_Gx, m a_Gy and I_G α less what the loads exert.
    `values` (unknowns,): The solution: reactions and efforts.
    `rank`: Independent columns; where it is less than their number, values are not unique.

    Examples
    --------
    >>> import mbody
    >>> run = mbody.kinetostatics(mbody.makers.four_bar(1, 3, 2, 3.5, masses=(1, 3, 2), speed=10))
    >>> system = run.equations()
    >>> system.unknowns
    ('F12x', 'F12y', 'F32x', 'F32y', 'F43x', 'F43y', 'F14x', 'F14y', 'T12')
    >>> bool(np.allclose(np.linalg.solve(system.matrix, system.rhs), system.values))
    True
    """

    rows: tuple[str, ...]
    row_units: tuple[str, ...]
    unknowns: tuple[str, ...]
    units: tuple[str, ...]
    meanings: tuple[str, ...]
    matrix: Array
    rhs: Array
    values: Array
    rank: int
    heading: tuple[str, ...] = field(repr=False)

    declared = ("rows", "row_units", "unknowns", "units", "matrix", "rhs", "values")

    @property
    def residual(self) -> Array:
        """matrix · values − rhs, (rows,)."""
        return self.matrix @ self.values - self.rhs


class BranchPlace(NamedTuple):
    """Where a design on lanes came nearest to another branch: how near is found when it is asked.

    `closeness`: By which such places are compared, the greatest being nearest.
    `q`: The position (coordinates,).
    """

    closeness: float
    t: float
    q: np.ndarray

    def distance(self, system: System) -> BranchDistance:
        """The distance, with the numbers of the design."""
        from mbody.kernels.continuation import branch_distance

        work = system.work()
        work.q[: len(self.q), 0] = self.q
        least = branch_distance(system.runtime(), work, 0.0)
        return BranchDistance(max(least, 0.0) ** 0.5, self.t)


def residuals(solution: Result) -> np.ndarray:
    """(designs, instants, RESIDUALS), see `mbody.kernels.finished_instants`; of one design too. Of
    several connected parts those of each follow.
    """
    if solution.stepped is not None:  # of the equation of its steps
        return solution.stepped.residuals
    designs = range(solution.system.batch or 1)
    return np.array([_audited(solution, design) for design in designs])


def rounded_places(solution: Result, design: int) -> np.ndarray:
    """By how much the forces that are left over change where the places that were found are
    rounded in another way: (instants, parts) of one design.
    """
    if solution.stepped is not None:
        return np.zeros((len(solution.t), 1))
    system = solution.system
    n = system.coordinates
    norm = 1.0 + system.extent(_motion(solution, design))[:, None]
    left = _by_parts(system, solution.residuals[design])[0]
    # bodies that move alike strain nothing: each coordinate by another part
    parts = (np.cos(np.arange(n)), np.sin(1.0 + np.arange(n)))
    rounding = tol.POSITION_ROUNDING * norm * system.coordinate_units
    moved = [_by_parts(system, _audited(solution, design, rounding * part))[0] for part in parts]
    found: np.ndarray = np.abs(np.array(moved) - left).max(axis=0)
    return found


def _audited(solution: Result, design: int, moved: np.ndarray | None = None) -> np.ndarray:
    """The residuals of one design, where `moved` is added to its coordinates; a released driver
    constrains nothing from then on.
    """
    drivers, t = solution.system.mechanism.drivers, solution.t
    times = [solution.released.get(driver.name, np.inf) for driver in drivers]
    ends = sorted({time for time in times if time <= t.max(initial=-np.inf)})
    if not ends:
        return _audit(solution, design, moved=moved)[0]
    parts, first = np.empty((len(t), _width(solution.system))), 0
    for last, until in zip([*np.searchsorted(t, ends), len(t)], [None, *ends], strict=True):
        gone = () if until is None else np.flatnonzero(np.array(times) <= until)
        if last > first:
            parts[first:last] = _audit(solution, design, slice(first, last), gone, moved)[0]
        first = last
    return parts


def _width(system: System) -> int:
    """Columns of residuals."""
    from mbody.kernels.finished_instants import RESIDUALS

    return RESIDUALS + (2 * system.layout.bodies if len(system.parts) > 1 else 0)


def checks(solution: Result) -> Checks:
    """Residuals, relative, greatest of all instants, and the balance of energy; of a batch those of
    the worst design of those that did not fail.
    """
    from mbody.kernels.finished_instants import CONSTRAINT, FLOW, POWER

    if solution.record.batch:
        failed = failed_designs(solution.reports)
        every = range(solution.record.count)
        each = [checks(solution.design(n)) for n in every if n not in failed]
        residual = [(one.constraint, one.equilibrium, one.virtual_work) for one in each]
        balance = [one.energy for one in each if one.energy is not None]
        constraint, equilibrium, work = np.max(residual, axis=0).tolist()
        energy = float(np.max(balance)) if balance else None
        return Checks(constraint, equilibrium, work, energy, solution.branch)
    parts, account = solution.residuals, solution.energy
    constraints, power, flow = (parts[:, :, n] for n in (CONSTRAINT, POWER, FLOW))
    forces = solution.has_forces

    def relative(worst: np.ndarray, whole: np.ndarray) -> float:
        top = whole.max(axis=(0, 1), initial=0.0)
        most = np.abs(worst).max(axis=(0, 1), initial=0.0)
        return float(np.divide(most, top, out=np.zeros_like(most), where=top > 0.0).max())

    return Checks(
        constraint=float(constraints.max(initial=0.0)),
        equilibrium=relative(*_by_parts(solution.system, parts)) if forces else 0.0,
        virtual_work=relative(power[..., None], flow[..., None]) if forces else 0.0,
        energy=None if account is None else account.error,
        branch=solution.branch,
    )


def _by_parts(system: System, residuals: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Greatest part of f − M a − Gᵀλ and greatest term of it, of each connected part: (…, parts);
    of the equations of steps, which contacts join, altogether.
    """
    from mbody.kernels.finished_instants import LEFT, RESIDUALS, TERM

    first = np.array([LEFT])
    if residuals.shape[-1] > RESIDUALS:
        first = RESIDUALS + 2 * np.array(system.parts)
    return residuals[..., first], residuals[..., first + TERM - LEFT]


def _motion(solution: Result, design: int) -> np.ndarray:
    motion = motion_rows(solution)
    return motion[design] if solution.record.batch else motion


def loaded(solution: Result, instant: int, design: int = 0) -> Work:
    """A workspace at one instant of one design: its motion, its rows, and the sum of all loads on
    the coordinates in `force`.
    """
    return _audit(solution, design, slice(instant, instant + 1 or None))[1]


def each_load_of(solution: Result, instant: int) -> np.ndarray:
    """Force (x, y) at the mass centre and torque of every load on every body at one instant of one
    design: (loads, bodies, 3).
    """
    from mbody.kernels.finished_instants import each_load

    system, instants = solution.system, slice(instant, instant + 1 or None)
    output = np.empty((1, len(system.mechanism.loads), system.coordinates))
    which = np.arange(len(solution.t))[instants]
    motion = np.ascontiguousarray(motion_at(solution, which))
    each_load(system.runtime(), system.work(), motion, np.array(solution.t[instants]), output)
    return output[0].reshape(-1, len(system.mechanism.bodies), 3)


def _audit(
    solution: Result,
    design: int,
    instants: slice = slice(None),
    gone: Any = (),
    moved: np.ndarray | None = None,
    parts: np.ndarray | None = None,
) -> tuple[np.ndarray, Work]:
    """(instants, RESIDUALS …), see `mbody.kernels.finished_instants`, and the workspace as left.

    `parts` (bodies,): Of others than connected ones.
    `gone`: numbers of drivers whose rows are not looked at; `moved`: what is added to the
    coordinates of all instants.
    """
    from mbody.kernels.finished_instants import RESIDUALS, Finished, residuals_of

    system, t = solution.system, np.array(solution.t[instants])
    first, which = 3 * system.coordinates, np.arange(len(solution.t))[instants]
    rows = slice(first, first + PER_PRIMITIVE * len(system.owners))
    primitives = solution.record.at(rows, which, design)
    count = len(system.owners)
    lam = primitives.reshape(len(t), count, PER_PRIMITIVE)[:, :, :2].reshape(len(t), 2 * count)
    driven = [system.primitives_of[driver.name][0] for driver in system.mechanism.drivers]
    by_law = solution.given is None
    given = np.zeros((len(t), max(1, len(driven)), 3))
    if solution.given is not None:
        given = np.array(solution.given[instants])
    motion = np.ascontiguousarray(motion_at(solution, which, design))
    if moved is not None:
        motion[:, : system.coordinates] += moved
    width, layout = _width(system), system.runtime()
    if parts is not None:
        width, layout = RESIDUALS + 2 * len(parts), layout.replaced(body_part=parts)
    output, work = np.empty((len(t), width)), system.work(designs=design)
    work.regularization_weight[2 * system.layout.driver_node[np.asarray(gone, dtype=np.int64)]] = (
        0.0
    )
    found = Finished(
        motion=motion,
        t=t,
        lam=lam,
        driven=np.array(driven, dtype=np.int64),
        given=given,
        by_law=by_law,
        at_rest=solution.analysis == "statics",
    )
    residuals_of(layout, work, found, output)
    return output, work


def breakdown(solution: Result, name: str, on: str | None) -> dict[str, Any]:
    """Reactions or efforts that inertia and each load would have alone, by cause, and what the
    friction of the whole has in them.
    """
    from mbody.kernels.finished_instants import NO_FRICTION
    from mbody.kernels.finished_instants import breakdown as kernel
    from mbody.solution.contact_forces import tangent_forces

    system = solution.system
    one_design(solution, f"the breakdown of '{name}' is for one design", name)
    if not solution.has_forces:
        raise ModelError(
            f"{solution.analysis} finds no forces, as of '{name}': use kinetostatics", name
        )
    loads = system.mechanism.loads
    size = PER_PRIMITIVE * len(system.owners)
    sliding = tangent_forces(solution)
    frictional = sliding.shape[-1] > 0
    sliding = sliding if frictional else NO_FRICTION
    output = np.empty((len(solution.t), len(loads) + 1 + frictional, size, 1))
    kernel(
        system.runtime(),
        system.work(),
        solution.regularization,
        _motion(solution, 0),
        np.array(solution.t),
        len(loads),
        sliding,
        output,
    )
    causes = ["inertia", *(load.name for load in loads), *(["friction"] if frictional else [])]
    primitives = system.primitives_of.get(name)
    if primitives is None:
        known = listed(system.primitives_of)
        raise ModelError(f"'{name}' is neither a joint nor a driver (there are: {known})", name)
    element: Any = system.mechanism[name]
    if element.role not in ("joint", "contact"):
        row = PER_PRIMITIVE * primitives[0]
        return {cause: -output[:, n, row, 0] for n, cause in enumerate(causes)}
    whole = solution.reaction(name, on)
    return {
        cause: _alone(solution, element, whole, output[:, n, :, 0])
        for n, cause in enumerate(causes)
    }


def _alone(solution: Result, joint: Any, whole: Reaction, rows: np.ndarray) -> Reaction:
    """The part of a whole reaction that is in these rows."""
    from mbody.solution.contact_forces import contact_wrench

    if joint.role == "contact":
        wrench = contact_wrench(
            solution, joint, whole.on, lambda e, n: rows[:, PER_PRIMITIVE * e + n]
        )
        return Reaction(joint.name, whole.on, whole.by, *wrench, whole.unique)
    sign = 1.0 if whole.on == joint.j.body else -1.0
    primitives = solution.system.primitives_of[joint.name]
    parts = [
        np.sum([rows[:, PER_PRIMITIVE * e + n] for e in primitives], axis=0) for n in (2, 3, 4)
    ]
    fx, fy, torque = (sign * part for part in parts)
    torque = reaction_torque(solution, joint, fx, fy, torque)
    return Reaction(joint.name, whole.on, whole.by, fx, fy, torque, whole.unique)


# -- Certificate of a result: status, doubts and notes, from report and residuals --------------
# Residuals cost a third of the kinetostatics of a revolution. They are computed when `status`,
# `doubts` or `notes` is first read, so a user who reads numbers alone does not pay for them.


def certificate_of(solution: Result) -> Certificate:
    """The report of the analysis, and what the residuals add to it."""
    from mbody.solution.doubts import joined_doubts, joined_notes, status_of

    said = reported_certificate(solution)
    described = solution.system.notes
    if solution.record.batch:
        reports = solution.reports or (DesignReport(),) * solution.record.count
        each = [_design_certificate(solution, one, n) for n, one in enumerate(reports)]
        own = [
            one if isinstance(one, Exception) else [said for said in notes if said not in described]
            for one, (_, notes) in zip(reports, each, strict=True)
        ]
        every = (*said.notes, *described, *joined_notes(own))
        doubts = joined_doubts([one for one, _ in each])
        return Certificate(status_of(said.status, doubts), doubts, tuple(dict.fromkeys(every)))
    doubts, _ = _own_certificate(solution, said, 0)
    if solution.system.measures_forces:
        # copies with other forces read the certificate as it is so far
        solution.__dict__["certificate"] = Certificate(said.status, doubts, said.notes)
        doubts = (*doubts, *present("followed_forces", solution))
    added = [doubt.message for doubt in doubts if doubt.message not in said.notes]
    if solution.analysis == "simulate" and solution.shared is not None:
        added += present("open_forces_note", solution)
    described = tuple(note for note in described if note not in said.notes)
    return Certificate(status_of(said.status, doubts), doubts, (*said.notes, *described, *added))


def _design_certificate(
    solution: Result, said: Any, design: int
) -> tuple[tuple[Doubt, ...], tuple[str, ...]]:
    """Doubts and notes of a design of a batch; of one that failed none."""
    if isinstance(said, Exception):
        return (), ()
    if isinstance(said, DesignReport) and not solution.system.measures_forces:
        return _own_certificate(solution, said, design)
    own = solution.design(design)
    return own.doubts, own.notes


def _own_certificate(
    solution: Result, said: Certificate | DesignReport, design: int
) -> tuple[tuple[Doubt, ...], tuple[str, ...]]:
    """Doubts of one design, and its notes with their sentences, by what was said of it and by its
    residuals.
    """
    doubts = said.doubts
    if not any(doubt.kind == "residual" for doubt in doubts):
        incomplete = any(doubt.kind == "incomplete" for doubt in doubts)
        doubts = (*doubts, *residual_doubts(solution, design, incomplete))
    added = (doubt.message for doubt in doubts if doubt.message not in said.notes)
    return doubts, (*said.notes, *added)


def residual_doubts(solution: Result, design: int = 0, incomplete: bool = False) -> list[Doubt]:
    """A doubt for each sort of residual of a design that rounding and condition do not explain;
    what is no number is in doubt, unless the forces are said to be `incomplete`.
    """
    parts = solution.residuals
    if not parts.size:
        return []
    doubts = []
    for what, size, limit in _limits(solution, parts[design], design, incomplete):
        wrong = np.flatnonzero(~(size <= limit))
        if wrong.size:
            doubts.append(_doubt(solution, what, size, wrong))
    return doubts


def _limits(
    solution: Result, parts: Array, design: int, incomplete: bool
) -> Iterator[tuple[str, Array, Array | float]]:
    """Residuals (instants,) in words, and what rounding and condition explain of each."""
    from mbody.kernels.finished_instants import CONSTRAINT, FLOW, POWER

    system = solution.system
    constraint, power, flow = (parts[:, n] for n in (CONSTRAINT, POWER, FLOW))
    n = system.coordinates
    records = solution.record.at(slice(None), np.arange(len(solution.t)), design)
    norm = 1.0 + system.extent(records)
    known = np.isfinite(records[:, : 3 * n]).all(axis=1)
    constraint = np.where(known, constraint, np.nan)
    yield (
        "the constraints are violated by {} (model lengths, rad)",
        constraint,
        tol.LOOP_OPEN_CHECK * norm,
    )
    if not solution.has_forces:
        return
    known &= np.isfinite(records).all(axis=1)
    # forces that are reported as missing are in no balance
    unknown = 0.0 if incomplete else np.nan
    left, term = _by_parts(system, parts)
    tops, flowing = (
        np.nanmax(np.abs(term), axis=0, initial=0.0),
        float(np.nanmax(np.abs(flow), initial=0.0)),
    )
    top, tops = float(tops.max(initial=0.0)), np.where(tops > 0.0, tops, 1.0)
    share = np.where(known[:, None], left / tops, unknown)
    own_part = np.zeros(n // 3, dtype=np.int64)
    if len(tops) > 1:
        own_part[:] = np.searchsorted(system.parts, system.layout.body_part)
    carried = np.where(known[:, None], _carried(system, records, own_part, len(tops)) / tops, 0.0)
    rounding = np.full(len(records), tol.BALANCE_LEFT)
    if len(system.layout.friction_kind):
        # the friction of what slides is known to rounding by the determinant that it follows from
        found = np.abs(records[:, system.friction_rows.start + DETERMINANT])
        rounding = rounding + tol.BALANCE_ROUNDING_FRICTION / np.where(found > 0.0, found, 1.0)
    limits = rounding[:, None] + tol.BALANCE_ROUNDING_SINGULAR * carried**2
    if (share > limits).any():
        # at rest on springs of their free lengths all forces are rounding of places
        limits = np.maximum(limits, rounded_places(solution, design) / tops)
    yield from _lost(solution, design, records, known)
    worst = int((share / limits).max(axis=0, initial=0.0).argmax())
    on = f" on '{system.mechanism.bodies[system.parts[worst]].name}'" if len(tops) > 1 else ""
    yield f"{{}} of the forces{on} are out of balance", share[:, worst], limits[:, worst]
    # a joint of the user that moves by itself gives power of which nothing is known
    own = (system.layout.primitive_kind == KINDS.index("user")).any()
    if not own and flowing > tol.RATE_NONE_MECHANISM * top * system.length * _pace(system, top):
        power = np.where(known, np.abs(power) / (flowing or 1.0), unknown)
        yield "{} of the power is out of balance", power, rounding


def _pace(system: System, top: float) -> float:
    """How fast forces of that size would set the masses going [1/time]; none without masses."""
    whole = float(system.mass[: system.coordinates : 3].sum(axis=0).max(initial=0.0))
    return float(np.sqrt(top / (whole * system.length))) if whole else 0.0


def _lost(
    solution: Result, design: int, records: Array, known: Array
) -> Iterator[tuple[str, Array, float]]:
    """The forces of bodies whose own masses are lost beside what they join: refinement balances
    what these pass on, not what moves by itself.
    """
    from mbody.kernels.finished_instants import RESIDUALS

    system = solution.system
    column = design if system.batch is not None else 0
    lost = lost_masses(system.layout, system.mass[:, [column]], system.sizes)[:, 0]
    if not lost.any() or solution.stepped is not None:
        return
    every = np.arange(system.layout.bodies)
    found = _audit(solution, design, parts=every)[0]
    left, term = found[:, RESIDUALS::2], found[:, RESIDUALS + 1 :: 2]
    passed = _carried(system, records, every, len(every))
    for b in np.flatnonzero(lost).tolist():
        top = float(np.nanmax(np.maximum(term[:, b], passed[:, b]), initial=0.0)) or 1.0
        share = np.where(known, left[:, b] / top, 0.0)
        name = system.mechanism.bodies[b].name
        what = (
            f"{{}} of the forces on '{name}', whose mass is lost beside others, are out of balance"
        )
        yield what, share, tol.BALANCE_LEFT


def _carried(system: System, records: Array, part: Array, parts: int) -> Array:
    """The greatest force of a joint or driver on each part at every instant, torques by the length
    of what is joined: (instants, parts). `part` (bodies,): The number of that of each body.
    """
    L, lengths = system.layout, np.append(system.lengths, system.length)
    primitives = records[:, 3 * system.coordinates :][:, : PER_PRIMITIVE * len(system.owners)]
    forces = np.abs(primitives.reshape(len(records), -1, PER_PRIMITIVE)[:, :, 2:])
    forces[:, :, 2] /= lengths[np.minimum(L.primitive_i, L.primitive_j)]
    greatest, of_body = forces.max(axis=2, initial=0.0), np.append(part, parts)
    found = np.zeros((parts + 1, len(records)))
    for side in (L.primitive_i, L.primitive_j):
        np.maximum.at(found, of_body[side], greatest.T)
    return found[:parts].T


def _doubt(solution: Result, what: str, size: Array, wrong: Array) -> Doubt:
    """The doubt of one residual from its first instant on."""
    from mbody.solution.doubts import Doubt

    t, unit = float(solution.t[wrong[0]]), solution.mechanism.units.time
    bad = size[wrong]
    worst = f"{bad.max():.2g}" if np.isfinite(bad).all() else "an unknown part"
    many = f"at {len(wrong)} of {len(size)} instants, first " if len(size) > 1 else ""
    return Doubt(
        "residual",
        f"{what.format(worst)} {many}at t = {t:.6g} {unit}, more than rounding explains: do "
        "not rely on the numbers there; check what is near a singular position, and the elements "
        "written in Python",
        t,
    )
