"""Why a motion cannot begin, or go on, where it is: what has no value, no inertia, or no way on.

Each function examines one instant with dense matrices and memory of its own; a motion asks them
only at its beginning, and where it fails.
"""

from __future__ import annotations

from collections.abc import Collection

import numpy as np

from mbody.analysis.position.assembly_analysis import raise_user_error
from mbody.analysis.position.tangent_space import Array, Manifold, Place
from mbody.core import tolerances as tol
from mbody.errors import SolveError
from mbody.kernels.finished_instants import each_load
from mbody.kernels.layout import Work
from mbody.kernels.loop_closure import laws_of_time
from mbody.laws import Expression, MeasuredFormula
from mbody.model.element import listed
from mbody.model.states import measuring_forces
from mbody.system.rank import Rank, dense, rank_of
from mbody.system.system import System, too_large

#: How far, in radians and model lengths, and how fast in natural rates, such a motion is tried.
TRIED = 0.3
#: Joints that a sentence names.
MOST = 4


def valueless(system: System, work: Work, t: float, q: Array, v: Array) -> SolveError:
    """The sentence of a load that has no value at an instant: q, v (coordinates,)."""
    loads = system.mechanism.loads
    found = load_forces(system, work, t, q, v)
    bad = [
        load.name for load, force in zip(loads, found, strict=True) if not np.isfinite(force).all()
    ]
    name = bad[0] if bad else "?"
    why = "its law does not reach so far; extend it, or let it hold its last value"
    for law in vars(system.mechanism[name]).values() if bad else ():
        calls = isinstance(law, MeasuredFormula) and {*law.operations} & {*system.mechanism.curves}
        if isinstance(law, Expression | MeasuredFormula) and not calls:
            why = f"'{law.text}' has no finite value there; choose one that has, by max or min"
    unit = system.mechanism.units.time
    if system.has_loops and not set(bad) - set(measuring_forces(system.mechanism)):
        return SolveError(
            f"'{name}' follows accelerations or forces that follow from it in turn, and at t = "
            f"{t:.6g} {unit} this algebraic loop has no unique solution: by its factors a change "
            "of the load gives as great a change of its formula; change them",
            name,
        )
    return SolveError(f"load '{name}' has no value at t = {t:.6g} {unit}: {why}", name)


def undetermined(system: System, t: float, q: Array, v: Array) -> SolveError | None:
    """The sentence of a free motion whose accelerations nothing determines; else None.

    A body without mass that is free, or one without inertia about its mass centre that is free to
    turn, and that loads turn: here, or where it is rotated and turns a little. What nothing turns
    is left alone, as a ball that is a point.
    """
    bodies = system.mechanism.bodies
    own = system.mass[: system.coordinates, 0].reshape(-1, 3)
    if too_large(system) or own.all():
        return None
    work = _workspace_at(system, t, q)
    motions = rank_of(dense(system, work)[1], parts=system.coordinate_part).motions
    if not len(motions):
        return None
    scale = system.coordinate_units
    mass = system.mass[: system.coordinates, 0] * scale**2
    # by the heaviest body of each part: what nothing joins to it has no say
    heaviest = np.zeros_like(mass)
    np.maximum.at(heaviest, system.coordinate_part, mass)
    mass = mass / np.maximum(heaviest[system.coordinate_part], tol.TINY)
    inertia, shapes = np.linalg.eigh((motions * mass) @ motions.T)
    massless = shapes[:, inertia <= tol.INERTIA_NONE].T @ motions
    for motion in massless:
        body = bodies[int(np.abs(motion.reshape(-1, 3)).max(axis=1).argmax())]
        if body.massless:
            return SolveError(
                f"the motion of '{body.name}' is not determined: it is free and has no mass; give "
                "it mass and inertia, or guide it by a joint",
                body.name,
            )
        if _pushed(system, t, q, v, motion):
            return SolveError(
                f"the motion of '{body.name}' is not determined: it is free to turn, loads turn "
                "it, and it has no inertia; give it one, or hold its angle",
                body.name,
            )
    return None


def inertialess(system: System, t: float, q: Array) -> int:
    """Number of free motions that have no inertia at q (coordinates,), beside what replaces it."""
    own = system.mass[: system.coordinates, 0]
    if too_large(system) or own.all():
        return 0
    motions = rank_of(
        dense(system, _workspace_at(system, t, q))[1], parts=system.coordinate_part
    ).motions
    if not len(motions):
        return 0
    work, scale = system.work(masses=True), system.coordinate_units
    slots = 3 * system.layout.body_slot[:, None] + np.arange(3)
    share = work.share[system.layout.body_slot, 0][:, None]
    whole = 1.0 / (work.weight[slots, 0] * share)
    mass, lent = (motions * (own * scale**2)) @ motions.T, whole.ravel() - own
    lent = (motions * (lent * scale**2)) @ motions.T
    factor = np.linalg.cholesky(mass + lent)
    part = np.linalg.solve(factor, np.linalg.solve(factor, lent).T)
    return int((np.linalg.eigvalsh(0.5 * (part + part.T)) > tol.ARTIFICIAL_MASS_MOTION).sum())


def weightless(system: System) -> SolveError | None:
    """The sentence of a mechanism without any mass; None where there is one."""
    if system.mass[: system.coordinates, 0].any() or not system.mechanism.bodies:
        return None
    return SolveError(
        f"no body of '{system.mechanism.name}' has mass, so that no loads set it in motion: give "
        "masses, or follow its drivers by kinetostatics"
    )


def _pushed(system: System, t: float, q: Array, v: Array, motion: Array) -> bool:
    """Whether loads drive a motion without inertia, here or a little along it."""
    places, scale, work = [(q, v)], system.coordinate_units, system.work()
    if not system.user_handles():  # users' functions may know no such places
        whole = load_forces(system, work, t, q, v).sum(axis=0) * scale
        mass = float((system.mass[: system.coordinates, 0] * scale**2).max())
        rate = TRIED * np.sqrt(np.abs(whole).max() / mass) if mass else 0.0
        places += [
            (q + sign * TRIED * scale * motion, v + sign * rate * scale * motion)
            for sign in (1.0, -1.0)
        ]
    for place, rates in places:
        forces = load_forces(system, work, t, place, rates) * scale
        if np.abs(forces @ motion).max(initial=0.0) > tol.FORCE_NONE * np.abs(forces).max(
            initial=0.0
        ):
            return True
    return False


def stuck(system: System, t: float, q: Array) -> SolveError | None:
    """The sentence of a motion that a driver leads into a dead centre; None where its rows are far
    from depending on each other, or no driver has a part in that.
    """
    if too_large(system) or not system.drivers:
        return None
    G = dense(system, _workspace_at(system, t, q))[1]
    if not np.isfinite(G).all():
        return None
    u, sizes, _ = np.linalg.svd(G)
    if len(sizes) < len(G) or sizes[-1] > tol.SINGULAR_VALUE_DIAGNOSIS * sizes[0]:
        return None
    part = np.abs(u[:, len(sizes) - 1])
    order = np.argsort(-part)[: int((part > tol.PARTICIPATION * part.max()).sum())]
    taking = dict.fromkeys(system.owners[system.row_table[0][n]][0].name for n in order)
    driving = [driver for driver in system.drivers if driver.name in taking]
    if not driving:
        return None
    joints = [name for name in taking if name not in {driver.name for driver in driving}]
    driver, body = driving[0].name, driving[0].bodies[-1]
    return SolveError(
        f"the motion cannot go on at t = {t:.6g} {system.mechanism.units.time}: '{driver}' leads "
        f"'{body}' into a dead centre, where rates and forces at {listed(joints, MOST)} grow "
        "without bound; stop it before, or drive another body",
        driver,
    )


def branching(system: System, t: float, q: Array, v: Array) -> tuple[str, ...]:
    """A sentence where a motion begins at rest in a position from which branches go out, and its
    loads set it in motion; else none.

    At rest a position in which more is free to first order than nearby has no one motion: the one
    that follows the accelerations of least force is one of several.
    """
    if too_large(system):
        return ()
    manifold = Manifold(system, _workspace_at(system, t, q), t)
    here = manifold.place(q)
    if here is None or not len(here.motions):
        return ()
    top = manifold.largest(q)
    natural = np.sqrt(top / float((system.mass[: len(q), 0] * manifold.scale**2).max()))
    if (
        np.abs(v / manifold.scale).max() > tol.RATE_NONE * natural
        or here.size <= tol.FORCE_NONE * top
    ):
        return ()
    nearby = _nearby(manifold, here)
    if nearby >= len(here.motions):
        return ()
    return (
        f"it begins at rest in a singular position: {len(here.motions)} motions are free there to "
        f"first order, {nearby} nearby; branches meet, and the loads do not determine which one "
        "is taken: this is one of them; give it a rate, or begin a little beside",
    )


def adjusted(system: System, given: Array, found: Array, whole: float = np.inf) -> tuple[str, ...]:
    """A sentence where positions and rates that were given (2·coordinates,) had to be changed so
    that the constraints hold; else none. `whole`: how long the motion goes on.
    """
    names = [body.name for body in system.mechanism.bodies]
    n, units = system.coordinates, system.mechanism.units
    moved, rates = ((found - given) / np.tile(system.coordinate_units, 2)).reshape(2, -1, 3)
    least_velocity = tol.START_MOTION_ROUNDING / (tol.START_CHANGE_REPORTED * (whole or np.inf))
    velocity_scale = max(float(np.abs(given[n:] / system.coordinate_units).max()), least_velocity)
    parts = []
    if (distances := np.hypot(moved[:, 0], moved[:, 1])).max() > tol.START_CHANGE_REPORTED:
        distance = system.length * distances.max()
        parts.append(
            f"'{names[int(distances.argmax())]}' was moved by {distance:.3g} {units.length}"
        )
    if (rotation := np.abs(moved[:, 2])).max() > tol.START_CHANGE_REPORTED:
        angle = np.degrees(rotation.max())
        parts.append(f"'{names[int(rotation.argmax())]}' was turned by {angle:.3g} deg")
    if np.abs(rates).max() > tol.START_CHANGE_REPORTED * velocity_scale:
        b, k = divmod(int(np.abs(rates).argmax()), 3)
        before, after = (float(part[n + 3 * b + k]) for part in (given, found))
        rate, unit = ("vx", "vy", "omega")[k], units.of("velocity" if k < 2 else "angular velocity")
        parts.append(f"{rate} of '{names[b]}' is {after:.6g} {unit}, not {before:.6g}")
    if not parts:
        return ()
    return (f"the start was changed so that joints and drivers hold: {', '.join(parts)}",)


def _nearby(manifold: Manifold, here: Place) -> int:
    """Least number of motions that are free beside a place."""
    adjacent = [manifold.moved(here, tol.POSITION_BESIDE * motion) for motion in here.motions]
    return min((len(p.motions) for p in adjacent if p is not None), default=len(here.motions))


def _workspace_at(system: System, t: float, q: Array) -> Work:
    """A workspace at an instant, its signals set."""
    work = system.work()
    work.time[:] = t
    laws_of_time(system.runtime(), work)
    raise_user_error(system)
    work.q[: len(q), 0] = q
    return work


def load_forces(
    system: System, work: Work, t: float, q: Array, v: Array, own: Array | None = None
) -> Array:
    """Each load alone on the coordinates: (loads, coordinates); `own`: auxiliary states, then
    inputs, by default those at the beginning.
    """
    found = np.empty((1, len(system.mechanism.loads), system.coordinates))
    more = np.zeros(0) if own is None else own
    motion = np.concatenate([q, v, np.zeros(len(q)), more])[None]
    each_load(system.runtime(), work, motion, np.array([t]), found)
    raise_user_error(system)
    return np.asarray(found[0])


# -- Undetermined reactions of redundant constraints (Wojtyra 2005; Wojtyra and Frączek 2013) --

#: Elements that a note names.
NAMED = 8


def open_reactions(system: System, report: Rank | None) -> dict[str, list[bool]] | None:
    """For every joint and closed contact, whether fx, fy and the torque are open, for every driver
    and coupling whether its effort is; None without a rank report.

    Multipliers may be changed by any combination of the dependencies without changing the motion;
    a reaction is determined where no such change reaches it.
    """
    if report is None:
        return None
    touched = (
        np.abs(report.dependencies).max(axis=0, initial=0.0) > tol.PARTICIPATION_NONE_DIAGNOSIS
    )
    primitive, _, is_angle = system.row_table
    result = {}
    for joint in system.mechanism.joints:
        own = np.isin(primitive, system.primitives_of[joint.name])
        lengths, angles = touched[own & ~is_angle], touched[own & is_angle]
        # the two rows of a pin are its world components; other rows reach both
        fx, fy = (lengths[0], lengths[1]) if joint.coincident else (lengths.any(),) * 2
        result[joint.name] = [bool(fx), bool(fy), bool(angles.any())]
    for contact in (one for one in system.mechanism.contacts if one.closed):
        own = np.isin(primitive, system.primitives_of[contact.name])
        result[contact.name] = [bool(touched[own].any())] * 3
    for element in (*system.mechanism.drivers, *system.mechanism.couplings):
        own = np.isin(primitive, system.primitives_of[element.name])
        result[element.name] = [bool(touched[own].any())]
    return result


def open_along(system: System, q: np.ndarray) -> dict[str, list[bool]] | None:
    """Undetermined reactions along a motion q (instants, coordinates), from the instant with the
    fewest dependent constraints: a singular position has more of them.
    """
    if too_large(system) or not len(q):
        return None
    work, reports = system.work(), []
    for k in {0, len(q) // 2, len(q) - 1}:
        work.q[: q.shape[1], 0] = q[k]
        G = dense(system, work)[1]
        if np.isfinite(G).all():
            reports.append(rank_of(G))
    best = min(reports, key=lambda report: report.redundant, default=None)
    return open_reactions(system, best)


def open_note(
    found: dict[str, list[bool]] | None, contacts: Collection[str] = ()
) -> tuple[str, ...]:
    """A sentence that names what redundant rows leave open; none where everything is determined.
    `contacts`: Names of closed contacts.
    """
    if found is None:
        return ("rows are redundant; which reactions are unique was not looked at",)
    reactions = [name for name, parts in found.items() if len(parts) > 1 and any(parts)]
    efforts = [name for name, parts in found.items() if len(parts) == 1 and any(parts)]
    dependent = [f"the reactions of {listed(reactions, NAMED)}"] if reactions else []
    dependent += [f"the efforts of {listed(efforts, NAMED)}"] if efforts else []
    if not dependent:
        return ()
    given = "those of least norm are given"
    if not set(contacts).isdisjoint(reactions):
        given += ", of contacts those farthest from opening"
    return (
        f"rows are redundant: {' and '.join(dependent)} are not unique, {given}; take off what "
        "repeats, or give it play",
    )
