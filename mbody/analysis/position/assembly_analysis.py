"""Closing the loops: the first position, the check that it determines the motion, the sentences."""

from __future__ import annotations

import functools
import math
import warnings
from collections.abc import Callable, Iterator, Mapping
from typing import Any, ParamSpec, TypeVar

import numpy as np

from mbody.analysis.position import closed_position
from mbody.analysis.position.closed_position import (
    SEARCHED,
    nearest_to_guesses,
    placed,
    violations,
    wrapped,
)
from mbody.core import tolerances as tol
from mbody.core.callbacks import failure
from mbody.errors import ModelError, ModelWarning, SolveError
from mbody.kernels.layout import Work
from mbody.kernels.loop_closure import close, laws_of_time
from mbody.model.body import Body, Guesses, as_guess
from mbody.model.element import listed
from mbody.model.joints import Joint
from mbody.model.mechanism import Mechanism
from mbody.system.assembler import assemble
from mbody.system.system import System, too_large

# -- Users' own physics, looked at where an analysis begins: purity, and derivatives of joints -

Array = np.ndarray
Hook = Callable[[Array, Array], None]
P = ParamSpec("P")
T = TypeVar("T")

#: Steps of differences, in radians, model lengths and units of time: a right derivative agrees with
#: one of them, whatever its scale.
STEPS = (1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7)
#: Positions that are tried; a derivative is wrong where it is at each of them.
PROBES = 3


def check_own(system: System, t: float, pose: Array) -> None:
    """Refuse functions that give another answer to the same question, and joints whose Φ_q, ν or γ
    are not those of their Φ; once for a topology. `pose` (coordinates + 3,).
    """
    if not system.has_user_code or "own physics" in system.plans:
        return
    rng = np.random.default_rng(0)
    with np.errstate(all="ignore"):
        for name, hook, questions, size in _functions(system, t, pose, rng):
            _check_pure(name, hook, questions, size)
        for e, (name, rows) in enumerate(system.functions[: len(system.owners)]):
            if rows is not None:
                _check_derivatives(_Joint(system, e, name, rows, t, pose), rng)
    system.plans["own physics"] = True


def _functions(
    system: System, t: float, pose: Array, rng: np.random.Generator
) -> Iterator[tuple[str, Hook, list[Array], int]]:
    """Every function with its name, some questions to it, and how many numbers it answers."""
    L, par = system.layout, system.par[:, 0]
    joints, loads = len(L.primitive_kind), len(L.action_kind)
    times = t, t + 1e-3, t + 0.37
    poses = pose, _perturbed(system, pose, rng), _perturbed(system, pose, rng)
    rates = [_rates(system, pose, rng) for _ in times]
    for n, (name, hook) in enumerate(system.functions):
        if hook is None:
            continue
        if n >= joints + loads:
            yield name, hook, [np.array([time]) for time in times], 3
            continue
        if n < joints:
            i, j, size = L.primitive_i[n], L.primitive_j[n], 18
            o, count = L.primitive_par[n], L.primitive_count[n]
        else:
            k = n - joints
            i, j, size = L.action_i[k], L.action_j[k], 6
            o, count = L.action_par[k], L.action_count[k]
        own = par[o : o + count]
        questions = [
            np.concatenate([[time], _side(q, v, i), _side(q, v, j), own])
            for time, q, v in zip(times, poses, rates, strict=True)
        ]
        yield name, hook, questions, size


def _perturbed(system: System, pose: Array, rng: np.random.Generator) -> Array:
    """A pose not far away; the ground stays."""
    size = np.tile([system.length, system.length, 1.0], len(pose) // 3)
    size[-3:] = 0.0
    found: Array = pose + 0.1 * size * rng.normal(size=len(pose))
    return found


def _rates(system: System, pose: Array, rng: np.random.Generator) -> Array:
    """Rates of about a model length and a radian in the unit of time; the ground has none."""
    return _perturbed(system, np.zeros_like(pose), rng) * 10.0


def _side(q: Array, v: Array, body: int) -> Array:
    """(x, y, θ, cos θ, sin θ, vx, vy, ω) of a body."""
    x, y, angle = q[3 * body : 3 * body + 3]
    return np.array([x, y, angle, np.cos(angle), np.sin(angle), *v[3 * body : 3 * body + 3]])


def _answer(hook: Hook, question: Array, size: int) -> Array | None:
    """Values of a user's function, (size,); None where it cannot be evaluated."""
    found = np.zeros(size)
    try:
        hook(question.copy(), found)
    except Exception:  # whatever it is, the analysis says it where it is met
        return None
    return found


def _check_pure(name: str, hook: Hook, questions: list[Array], size: int) -> None:
    first, second = ([_answer(hook, q, size) for q in questions] for _ in range(2))
    for question, a, b in zip(questions, first, second, strict=True):
        if a is None or b is None:
            continue
        different = ~(np.abs(a - b) <= tol.USER_ANSWER_SAME * np.abs(a).max()) & np.isfinite(a)
        if different.any():
            n = int(different.argmax())
            raise ModelError(
                f"the function of '{name}' keeps a memory: called twice with the same arguments at "
                f"t = {question[0]:g} it returned {a[n]:g} and then {b[n]:g}; it is called several "
                "times an instant, and at times that go back: its result must depend on its "
                "arguments alone; for a memory use a State, for a sampled controller a Controller",
                name,
            )


class _Joint:
    """A user's joint at states of its two bodies."""

    def __init__(
        self, system: System, e: int, name: str, hook: Hook, t: float, pose: Array
    ) -> None:
        L = system.layout
        self.system, self.name, self.hook, self.t, self.pose = system, name, hook, t, pose
        self.rows = len(system.row_kinds[e])
        self.bodies = int(L.primitive_i[e]), int(L.primitive_j[e])
        o = L.primitive_par[e]
        self.own = system.par[o : o + L.primitive_count[e], 0]
        self.moving = [b for b in self.bodies if b < L.bodies]

    def at(self, t: float, q: Array, v: Array) -> tuple[Array, Array, Array, Array] | None:
        """Φ (rows,), Φ_q (rows, 3 · moving bodies), ν and γ."""
        i, j = self.bodies
        question = np.concatenate([[t], _side(q, v, i), _side(q, v, j), self.own])
        y = _answer(self.hook, question, 18)
        if y is None:
            return None
        blocks = y[2:14].reshape(2, 2, 3)
        sides = [blocks[n, : self.rows] for n, b in enumerate(self.bodies) if b in self.moving]
        n = self.rows
        return y[:n], np.concatenate(sides, axis=1), y[14 : 14 + n], y[16 : 16 + n]

    @property
    def columns(self) -> Array:
        """Coordinates of the moving bodies."""
        return np.concatenate([np.arange(3 * b, 3 * b + 3) for b in self.moving])


def _check_derivatives(joint: _Joint, rng: np.random.Generator) -> None:
    """Refuse a joint that is wrong at every place where it was looked at."""
    found = []
    for _ in range(PROBES):
        q, v = _perturbed(joint.system, joint.pose, rng), _rates(joint.system, joint.pose, rng)
        a = _rates(joint.system, joint.pose, rng)
        try:
            found.append(_wrong(joint, q, v, a))
        except _Unanswered:
            continue
    if len(found) < 2 or None in found:
        return
    what, row, given, wanted, by = found[0] or ("", 0, 0.0, 0.0, "")
    raise ModelError(
        f"the physics of '{joint.name}' gives {what} of row {row} as {given:.6g}, but {by} is "
        f"{wanted:.6g} by differences: correct it; mbody.testing.check_joint tries it further",
        joint.name,
    )


class _Unanswered(Exception):
    """The function could not be evaluated there."""


def _wrong(
    joint: _Joint, q: Array, v: Array, a: Array
) -> tuple[str, int, float, float, str] | None:
    """The first derivative at one state that is not that of Φ: what, row, given, wanted, by."""
    t, columns = joint.t, joint.columns
    unit = np.tile([joint.system.length, joint.system.length, 1.0], len(joint.moving))

    def evaluated(time: float, q: Array, v: Array) -> tuple[Array, Array, Array, Array]:
        answer = joint.at(time, q, v)
        if answer is None:
            raise _Unanswered
        return answer

    phi, G, nu, gamma = evaluated(t, q, v)
    size = np.maximum(np.abs(G * unit).max(axis=1), np.abs(phi))
    for m, column in enumerate(columns):
        move = np.zeros_like(q)
        move[column] = unit[m]

        def shifted(s: float, move: Array = move) -> Array:
            return evaluated(t, q + s * move, v)[0]

        derivatives = _derivatives(shifted)
        bad = _off(G[:, m] * unit[m], derivatives, size)
        if bad is not None:
            row, wanted = bad
            name = joint.system.mechanism.bodies[int(column) // 3].name
            partial = f"∂Φ/∂{'xyθ'[m % 3]} of '{name}'"
            return "Φ_q", row, float(G[row, m]), wanted / float(unit[m]), partial
    bad = _off(nu, _derivatives(lambda s: -evaluated(t + s, q, v)[0]), np.maximum(size, np.abs(nu)))
    if bad is not None:
        return "ν", bad[0], float(nu[bad[0]]), bad[1], "−∂Φ/∂t"

    def rate(s: float) -> Array:
        _, there, moved, _ = evaluated(t + s, q + s * v + 0.5 * s * s * a, v + s * a)
        left: Array = G @ a[columns] * s - there @ (v + s * a)[columns] + moved
        return left

    terms = np.abs(G * a[columns]), np.abs(G * v[columns]), np.abs(gamma)[:, None]
    bad = _off(gamma, _derivatives(rate), np.column_stack(terms).max(axis=1))
    if bad is not None:
        return "γ", bad[0], float(gamma[bad[0]]), bad[1], "Φ_q a − d²Φ/dt²"
    return None


def _derivatives(function: Callable[[float], Array]) -> list[Array]:
    """Central differences at 0, of every step."""
    return [(function(h) - function(-h)) / (2.0 * h) for h in STEPS]


def _off(given: Array, derivatives: list[Array], size: Any) -> tuple[int, float] | None:
    """The row, and what it should be, of a derivative that no step agrees with."""
    error = np.min([np.abs(one - given) for one in derivatives], axis=0)
    bad = np.flatnonzero(~(error <= tol.USER_DERIVATIVE_WRONG * np.maximum(size, tol.TINY)))
    if not bad.size:
        return None
    row = int(bad[0])
    return row, float(derivatives[2][row])


# -- Unused points of a description: often the trace of a missing joint ------------------------


def unused_points(mechanism: Mechanism) -> list[str]:
    """Names such as "ground.Q" of points that no element and no measure uses, those of the ground
    first.
    """
    elements = (mechanism.joints, mechanism.couplings, mechanism.drivers, mechanism.loads)
    used = {
        f"{marker.body}.{marker.point}"
        for some in elements
        for element in some
        for marker in element.places().values()
        if isinstance(marker.point, str)
    }
    for contact in mechanism.contacts:
        used |= contact.points()
    for measure in mechanism.measures.values():
        used |= {name.rpartition(".")[0] for name in measure.names}
    bodies = [mechanism.ground, *mechanism.bodies]
    names = [f"{body.name}.{point}" for body in bodies for point in body.points]
    return [name for name in names if name not in used]


# -- Joints that repeat each other but for a small error of lengths ----------------------------

#: How far beside a position the gap is looked at again; joints that are named.
OFFSET, NAMED = 0.1, 6


def refuse_near_redundant(system: System, work: Work, start: np.ndarray) -> None:
    """Refuse joints that repeat each other but for a small error of lengths: the loops then close
    at isolated positions only, where nothing moves, though a gap that small stays along a motion.
    `start` (coordinates + 3, 1).
    """
    size, drivers = system.coordinates, len(system.drivers)
    joints = system.rows - drivers
    if system.rows > SEARCHED or joints + max(1, drivers) <= size:
        return
    from mbody.system.rank import dense, rank_of, smallest_gap

    before = work.q.copy()
    work.q[:] = start
    scale = system.coordinate_units
    driven = np.arange(system.rows) >= joints
    try:
        if not np.isfinite(dense(system, work)[1]).all():  # a distance of 0
            return
        gap = np.abs(smallest_gap(system, work, driven)[:joints])
        if not tol.LOOP_GAP_ROUNDING < gap.max() < tol.LOOP_GAP_SLIGHT:
            return
        report = rank_of(dense(system, work)[1][:joints], tol.SINGULAR_VALUE_SLIGHT)
        if not report.redundant or report.free < max(1, drivers):
            return
        here, motion = work.q.copy(), report.motions[0]
        for sign in (1.0, -1.0):  # where links are only stretched the gap opens fast
            work.q[:size] = here[:size] + sign * OFFSET * (scale * motion)[:, None]
            shifted = np.abs(_least(system, work, joints))
            moved = float(np.abs((work.q[:size] - here[:size])[:, 0] / scale).max())
            if (
                moved < 0.3 * OFFSET * float(np.abs(motion).max())
                or shifted.max() > tol.LOOP_GAP_SLIGHT
            ):
                return
        part = np.abs(report.dependencies).max(axis=0)
    finally:
        work.q[:] = before
    names = dict.fromkeys(
        system.owners[system.row_table[0][n]][0].name
        for n in np.argsort(-part)
        if part[n] > tol.PARTICIPATION_CLOSED * part.max()
    )
    unit = system.mechanism.units.length
    most = float(gap.max()) * system.length
    raise SolveError(
        f"joints of '{system.mechanism.name}' nearly repeat each other "
        f"({listed(list(names), NAMED)}): all along the motion that they would allow a gap of "
        f"about {most:.2g} {unit} is left, so that the loops close at isolated positions only; "
        "make the lengths agree to all digits, or leave out the joint that is one too many",
        next(iter(names)),
    )


def _least(system: System, work: Work, joints: int) -> np.ndarray:
    """Move to the nearest position at which the joints, without drivers, are violated least."""
    from mbody.system.rank import close_rows, dense

    def rows(x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        phi, G = dense(system, work, x)
        return phi[:joints], G[:joints]

    start = work.q[: system.coordinates, 0] / system.coordinate_units
    # dependent rows are left alone, so that the free motion is, too
    return rows(close_rows(rows, start, zero=tol.SINGULAR_VALUE_SLIGHT).x)[0]


#: Starts that are tried, the guess first, before loops are said not to close.
ATTEMPTS = 60
#: Points that a sentence names.
LISTED = 3


def each_design(analysis: Callable[P, T]) -> Callable[P, T]:
    """An analysis of one design that takes batches too, each design by itself."""

    @functools.wraps(analysis)
    def of_all(*args: P.args, **options: P.kwargs) -> T:
        model = args[0] if args else options.get("model")
        if not isinstance(model, System) or model.batch is None:
            return analysis(*args, **options)
        from mbody.analysis.position.design_results import results_of_designs

        found: Any = results_of_designs(analysis, model, args[1:], options)
        return found

    return of_all


def as_system(model: Mechanism | System) -> System:
    """The system of a mechanism; a system as it is."""
    if isinstance(model, System):
        return model
    if isinstance(model, Mechanism):
        return assemble(model)
    raise ModelError(f"an analysis takes a Mechanism or a System, not {model!r}")


def raise_user_error(system: System) -> None:
    """Raise what a user's own function raised inside a kernel, with the name of its element."""
    for handle in system.user_handles():
        found = failure(handle)
        if found is not None:
            error = found[1]
            if not isinstance(error, Exception):
                raise error
            name = system.user_name(handle)
            what = f"{type(error).__name__}: {error}"
            if isinstance(error, ModelError):  # our own complaint about what a function gave
                what = str(error).removeprefix("Function: ")
            raise SolveError(f"the function of '{name}' failed: {what}", name) from error


def closed(
    system: System,
    t: float,
    driver_values: Mapping[str, float],
    guess: Guesses | None = None,
    pose: np.ndarray | None = None,
    intended: Callable[[closed_position.ClosedPosition], bool] | None = None,
    attempts: int = ATTEMPTS,
) -> closed_position.ClosedPosition:
    """Close the loops of one design at time t, given driver values winning over laws; from `pose`
    (coordinates,) if there is one, else from the guesses. Where these lie on another branch than
    the position found, `meant` may say that this one is meant all the same.

    Bodies without a guess take the angles at which those with one are nearest to theirs; where
    these do not decide, a note says so. Where the guess leads nowhere, other starts are tried, so
    many `attempts` in all, always the same ones: bodies without a guess at any angle, guessed ones
    ever further from their guess.
    """
    if guess is not None and not isinstance(guess, Mapping):
        raise ModelError(f'guess must be a dict such as {{"coupler": 0.3}}, not {guess!r}')
    if guess and "ground" in guess:
        raise ModelError("the ground does not move: a guess is for moving bodies", "ground")
    key = closed_position.position_key(system, t, driver_values, guess) if pose is None else None
    known = closed_position.kept_position(system, key)
    if known is not None:
        return known
    work = system.work()
    values = set_driver_values(system, work, t, driver_values)
    first = _guessed(system, guess, values) if pose is None else pose
    check_own(system, t, first)
    start = first[:, None].copy()
    for attempt in range(attempts):
        result = _from(system, work, start)
        if not attempt and result is None:
            near = drawn_together(system, work, first)
            if not np.array_equal(near, first):
                start = near[:, None]
                result = _from(system, work, start)
        if not attempt and (result is None or not result.regularization):
            refuse_near_redundant(system, work, start)
        if result is not None:
            break
        shaken = np.random.default_rng(attempt)
        start = _guessed(system, guess, values, shaken)[:, None]
    else:
        from mbody.analysis.position.open_loops import explain_gap

        # the smallest gap takes longer than all starts, and of many designs most are never read
        raise SolveError(lambda: explain_gap(system, work, first[:, None], t))
    if pose is not None:
        check_fit(system, work.q[:, 0])
        return result
    found = nearest_to_guesses(
        system, result, (first, start), guess, values, lambda q: _from(system, work, q)
    )
    check_fit(system, work.q[:, 0])
    first_found, found = found is result, _meshing(system, found, values)
    sure = True
    if first_found:
        sure = _say_branch(system, found, first[:, None], guess, intended)
    closed_position.by_springs(system, found.work.q.T)
    found.notes += closed_position.ambiguous(system, found.work.q[:, 0], values)
    if sure:
        closed_position.keep_position(system, key, found)
    return found


#: Moves that bring far bodies together, at most: lengths of rods are not linear in them.
DRAWN = 8


def drawn_together(system: System, work: Work, pose: np.ndarray) -> np.ndarray:
    """A first position (coordinates + 3,) with bodies that are far from where rows have them moved
    there, none of them turned: Newton's method, which turns them too, would take as many steps as
    they are lengths away.
    """
    from mbody.system.rank import dense

    if too_large(system) or not system.rows:
        return pose
    far = np.flatnonzero(~system.row_table[2])
    sliding = np.flatnonzero(np.arange(system.coordinates) % 3 != 2)
    work.q[:, 0] = pose
    for _ in range(DRAWN):
        phi, G = dense(system, work)
        if not np.isfinite(G).all() or np.abs(phi[far]).max(initial=0.0) <= tol.GUESS_FAR:
            break
        move = np.linalg.lstsq(G[:, sliding], -phi, rcond=tol.SINGULAR_VALUE_SLIGHT)[0]
        work.q[sliding, 0] += system.coordinate_units[sliding] * move
    return work.q[:, 0].copy()


def _meshing(
    system: System, found: closed_position.ClosedPosition, values: Mapping[str, float]
) -> closed_position.ClosedPosition:
    """The closed position at which those teeth of wheels meet that their phases mean."""
    pose = found.work.q[:, 0].copy()
    if not closed_position.other_teeth(system, pose, values, system.numbers):
        return found
    before = found.work.q.copy()
    again = _from(system, found.work, pose[:, None])
    if again is not None and not closed_position.other_teeth(
        system, again.work.q[:, 0].copy(), values, system.numbers
    ):
        again.notes += found.notes
        return again
    found.work.q[:] = before
    return found


def closed_near(
    system: System,
    t: float,
    guess: Guesses | None,
    driver_values: Mapping[str, float] | None = None,
) -> closed_position.ClosedPosition | None:
    """Close the loops of one design from the guesses alone: no other starts are tried, and a
    failure, None, is not explained. It is for searches, most of whose failures nobody reads.
    """
    work = system.work()
    values = set_driver_values(system, work, t, driver_values or {})
    result = _from(system, work, _guessed(system, guess, values)[:, None])
    if result is not None:
        check_fit(system, work.q[:, 0])
    return result


def _guessed(
    system: System,
    guess: Guesses | None,
    values: Mapping[str, float],
    shaken: np.random.Generator | None = None,
) -> np.ndarray:
    """A first pose by the guesses, each body rotated as rows between angles have it."""
    pose = placed(system, guess, values, shaken)
    closed_position.by_rows(system, pose, values, system.numbers)
    return pose


def check_fit(system: System, q: np.ndarray) -> None:
    """Refuse joints whose places others hold where they do not fit, as wheels too far apart."""
    spaced = [joint for joint in system.mechanism.joints if joint.spaced]
    for joint in spaced:
        separation = closed_position.place(system, q, joint, "j") - closed_position.place(
            system, q, joint, "i"
        )
        angles = (closed_position.direction(system, q, joint, side) for side in ("i", "j"))
        found, wanted = map(float, joint.fit(system.numbers, tuple(separation), *angles))
        if abs(found - wanted) > tol.DISTANCE_MISFIT * system.length:
            raise misfit(system, joint, found, wanted)


def misfit(
    system: System, joint: Joint, found: float, wanted: float, where: str = ""
) -> SolveError:
    """The sentence of a joint whose places others do not hold as far apart as it needs them."""
    what, remedy = joint.misfit(float(found), float(wanted), system.mechanism.units.length)
    return SolveError(f"'{joint.name}' does not fit: {what}{where}: {remedy}", joint.name)


def _from(system: System, work: Work, start: np.ndarray) -> closed_position.ClosedPosition | None:
    """Close from one pose, with the proximal term where rows turn out to be dependent."""
    for regularization in (0.0, tol.REDUNDANT_ROW_SOFTNESS):
        work.q[:] = start
        good, straight, ratio = close(
            system.runtime(), work, regularization, float(rounding(system, work.q[:, 0]))
        )
        raise_user_error(system)
        result = closed_position.ClosedPosition(work, regularization, ratio, straight=straight)
        if good and regularization == 0.0 and ratio >= tol.PIVOT_SUSPICIOUS:
            return result
        # dependent rows let Newton rest where a gap is smallest
        if not good or not violations(system, work).max(initial=0.0) < tol.LOOP_OPEN:
            continue
        if too_large(system):
            if regularization:
                return result
            continue
        from mbody.system.rank import dense, rank_of

        G = dense(system, work)[1]
        if not np.isfinite(G).all():  # a distance of 0 has no direction
            continue
        result.rank = rank_of(G)
        if bool(result.rank.redundant) == bool(regularization):
            return result
        if not result.rank.redundant:
            result.regularization = 0.0
            return result
    return None


def rounding(system: System, poses: np.ndarray) -> Any:
    """Size of a correction that is rounding of positions (…, coordinates + 3): (…)."""
    return tol.LOOP_CLOSURE_RESIDUAL * (1.0 + system.extent(poses))


def set_driver_values(
    system: System, work: Work, t: float, driver_values: Mapping[str, float]
) -> dict[str, float]:
    """Signals at time t; those in `driver_values` replace those of the laws. Returns the values of
    the drivers by name, but of those that follow positions.
    """
    work.time[:] = t
    laws_of_time(system.runtime(), work)
    raise_user_error(system)
    for driver, row in drivers(system):
        if driver.name in driver_values:
            work.signal[row] = driver_values[driver.name]
        if not np.isfinite(work.signal[row]).all():
            raise SolveError(
                f"the law of '{driver.name}' has no finite value at t = {t:g} "
                f"{system.mechanism.units.time}: begin elsewhere, or choose another law",
                driver.name,
            )
    found = {driver: float(work.signal[row, 0]) for driver, row in drivers(system)}
    return {driver.name: found[driver] for driver in system.independent_drivers}


def drivers(system: System) -> list[tuple[Any, int]]:
    """Drivers with the rows of their signals."""
    rows = system.layout.driver_row
    return list(zip(system.drivers, rows.tolist(), strict=True))


def _say_branch(
    system: System,
    result: closed_position.ClosedPosition,
    start: np.ndarray,
    guess: Guesses | None,
    intended: Callable[[closed_position.ClosedPosition], bool] | None,
) -> bool:
    """Warn where a guess and the position found lie on different sides of a singular position;
    returns whether the guess alone says that this position is meant.
    """
    size = 3 * system.layout.bodies
    guessed = [
        (n, body.name)
        for n, body in enumerate(system.mechanism.bodies)
        if (guess and body.name in guess) or body.guess.angle is not None
    ]
    if not guessed or system.rows != size or system.rows > 300 or result.regularization:
        return True
    found = result.work.q.copy()
    angle, name = max(
        (abs(wrapped(float(found[3 * n + 2, 0] - start[3 * n + 2, 0]))), name)
        for n, name in guessed
    )
    displacement, elsewhere = max(
        (
            (math.dist(found[3 * n : 3 * n + 2, 0], start[3 * n : 3 * n + 2, 0]), body.name)
            for n, body in enumerate(system.mechanism.bodies)
            if _guessed_place(body, guess)
        ),
        default=(0.0, name),
    )
    if result.straight and angle < tol.GUESS_NEAR and displacement < tol.GUESS_NEAR * system.length:
        return True
    from mbody.system.rank import dense

    here = np.linalg.slogdet(dense(system, result.work)[1])[0]
    result.work.q[:] = start
    there = np.linalg.slogdet(dense(system, result.work)[1])[0]
    result.work.q[:] = found
    if result.straight and here == there:
        return True
    if intended is not None and intended(result):
        return False
    distance = f"{np.degrees(angle):.1f} deg"
    if angle < tol.GUESS_NEAR:  # it is a place that is elsewhere
        name, distance = elsewhere, f"{displacement:.4g} {system.mechanism.units.length}"
    note = (
        f"the guess is on another branch than the position found: '{name}' came out {distance} "
        "from where the guess puts it; guess nearer to the branch that you want"
    )
    result.notes.append(note)
    warnings.warn(note, ModelWarning, stacklevel=5)
    return False


def _guessed_place(body: Body, guess: Guesses | None) -> bool:
    """Whether the guess of a body gives a place, not an angle alone."""
    own = as_guess(guess[body.name], body.name) if guess and body.name in guess else body.guess
    return own.x is not None


def check_determined(
    system: System, result: closed_position.ClosedPosition, what: str, remedy: str = ""
) -> None:
    """Refuse a position that the drivers do not determine; `remedy`: what else may be done."""
    regular = system.rows == system.coordinates and not result.regularization
    if regular and result.ratio > tol.PIVOT_SUSPICIOUS:
        return
    if too_large(system):
        if system.rows >= system.coordinates:
            return
        free = system.coordinates - system.rows
        raise SolveError(_too_few(system, what, free, None) + remedy)
    from mbody.system.rank import dense, rank_of

    G = dense(system, result.work)[1]
    report = result.rank = rank_of(G)
    names = [driver.name for driver in system.mechanism.drivers]
    joints = rank_of(G[: system.rows - len(names)])
    independent = report.rank - joints.rank
    if independent == len(names):
        if report.free:
            raise SolveError(_too_few(system, what, report.free, report.motions) + remedy)
        sizes = np.linalg.svd(G, compute_uv=False)
        if not names or sizes[system.coordinates - 1] > tol.SINGULAR_VALUE_DEAD_CENTRE * sizes[0]:
            return
    at_fault = len(names) - 1
    if independent < len(names):
        at_fault = _dependent_driver(G, system.rows - len(names))
    driver, row = drivers(system)[at_fault]
    value = float(result.work.signal[row, 0])
    if joints.free >= len(names):
        where = f"{value:.6g} {system.mechanism.units.length}"
        if driver.angular:
            where = f"{np.degrees(value):.4g} deg"
        body = _fastest(system, joints.motions) if joints.free else driver.bodies[1]
        raise SolveError(
            f"dead centre at {where} of '{driver.bodies[1]}': driver '{driver.name}' cannot drive "
            f"it through there; drive '{body}', or start elsewhere",
            driver.name,
        )
    raise SolveError(
        f"driver '{driver.name}' repeats what joints and other drivers already impose (rank "
        f"{report.rank} of {report.rows}): remove it",
        driver.name,
    )


def _too_few(system: System, what: str, free: int, motions: np.ndarray | None) -> str:
    body = system.mechanism.bodies[0].name if motions is None else _fastest(system, motions)
    freedom = "degree" if free == 1 else "degrees"
    left = f"'{system.mechanism.name}' has {free} {freedom} left"
    missing = unused_points(system.mechanism)
    missing = [name for name in missing if name.startswith("ground.")] or missing
    remedy = f"add a driver, for example on '{body}'"
    # without any driver one free motion is what a driver is for
    if missing and (free > 1 or system.drivers or missing[0].startswith("ground.")):
        s, them = ("s", "them") if len(missing) > 1 else ("", "it")
        remedy = f"nothing uses the point{s} {listed(missing, LISTED)}: join {them}, or {remedy}"
    return f"{what} needs 0 free degrees of freedom, {left}: {remedy}"


def _fastest(system: System, motions: np.ndarray) -> str:
    """Body that turns most in the free motions, or moves most where none turns."""
    rates = np.abs(motions[:, 2::3]).max(axis=0)
    if rates.max() < tol.RATE_NONE:
        rates = np.abs(motions).max(axis=0).reshape(-1, 3).max(axis=1)
    # the first of those nearly as fast as the fastest: usually the crank
    fast = np.flatnonzero(rates > 0.5 * rates.max())
    return system.mechanism.bodies[int(fast[0])].name


def _dependent_driver(G: np.ndarray, joints: int) -> int:
    """The last driver whose row depends on the rows before it."""
    from mbody.system.rank import rank_of

    ranks = [rank_of(G[: joints + n]).rank for n in range(len(G) - joints + 1)]
    return max(n for n in range(len(ranks) - 1) if ranks[n + 1] == ranks[n])
