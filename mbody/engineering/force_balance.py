"""Counterweights that balance the inertia forces of a mechanism."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from mbody.analysis.driven.driven import analyse_with
from mbody.analysis.position.assembly_analysis import as_system
from mbody.core import tolerances as tol
from mbody.core.least_squares import least_squares, nonnegative
from mbody.core.presentation import Presented
from mbody.core.tolerances import FORCE_NONE_BALANCE, SINGULAR_VALUE_ZERO, SPRING_PUSHED
from mbody.errors import ModelError, brief
from mbody.model.body import Body, SecondMoments, SlenderRod
from mbody.model.element import Marker, as_marker, listed, takes_one_design, unknown_name
from mbody.model.loads import Spring, TorsionSpring
from mbody.model.mechanism import Mechanism
from mbody.model.model_notes import with_changed
from mbody.model.numbers import number_in
from mbody.solution.declared_result import Heading, ItemTable, Sentence, Value, data_only
from mbody.solution.doubts import Inherited, inherited
from mbody.solution.histories import PointHistory
from mbody.solution.measures import point_history
from mbody.solution.solution import Solution
from mbody.system.assembler import assemble
from mbody.system.system import Locked, System

# -- Springs that balance weights and other loads in all positions -----------------------------

Array = np.ndarray

STILL = " does not move: what it holds need not be balanced"


@dataclass(frozen=True, eq=False, repr=False)
class SpringBalance(Inherited, Presented):
    """Stiffnesses, and what they do.

    Attributes
    ----------
    stiffness : dict
        By name of the spring, [force/length] or of a torsion spring [force·length]; none is
        negative.
    complete : bool
        Whether no effort is left in any of the positions.
    left : float
        Effort that is left, root of the mean square, as a part of what it was without the springs.
    reason : str
        Why it is not complete; empty where it is.
    before, after : dict
        By driver that moves the effort that the loads need at rest, without and with the springs:
        arrays (instants,).
    run : Solution
        The positions with springs, of `statics`.
    mechanism : Mechanism
        The description with these springs.
    system : System
        The same with the numbers of the system that was given.

    Examples
    --------
    >>> import mbody
    >>> arm = mbody.Mechanism("arm", ground={"top": (0, 0.4)})
    >>> arm.add(mbody.Body("arm", mass=2.0, inertia=0, cg=(0.5, 0), points={"P": (0.3, 0)}))
    >>> arm.add(mbody.Revolute("O", "ground", "arm"), mbody.Gravity("g", y=-9.81))
    >>> arm.add(mbody.AngleDriver("hold", "arm", mbody.laws.ConstantSpeed(0.0, 1.0)))
    >>> spring = mbody.Spring("spring", "ground.top", "arm.P", stiffness=1.0, free_length=0)
    >>> found = mbody.engineering.spring_balance(arm, [spring], turn=True)
    >>> round(float(abs(found.before["hold"]).max()), 6), found.complete
    (9.81, True)
    """

    stiffness: dict[str, float] = field(default_factory=dict)
    complete: bool = False
    left: float = 0.0
    reason: str = ""
    before: dict[str, Array] = field(default_factory=dict)
    after: dict[str, Array] = field(default_factory=dict)
    run: Any = None
    mechanism: Any = None
    system: Any = None

    analysis_name = "balance"
    declared = (
        Heading("SPRING", "stiffness"),
        Value("stiffness", "{}", lambda found: found.dimensions),
        "complete left reason",
        Heading("GREATEST EFFORT"),
        Value(
            "peaks",
            "{}",
            lambda found: found.dimensions,
            floor=lambda found: (
                FORCE_NONE_BALANCE
                * max((one["before"] for one in found.peaks.values()), default=0.0)
            ),
            columns=(Value("before", "before"), Value("after", "after")),
        ),
        Sentence(
            lambda found: (
                "complete balance"
                if found.complete
                else f"{100.0 * found.left:.3g} % is left (rms)"
            )
        ),
    )

    @property
    def peaks(self) -> dict[str, dict[str, float]]:
        """The greatest effort of every driver before and after."""
        rows = {"before": self.before, "after": self.after}
        return {
            name: {when: float(np.abs(row[name]).max(initial=0.0)) for when, row in rows.items()}
            for name in self.before
        }

    @property
    def dimensions(self) -> dict[str, str]:
        """What the stiffness of every spring and the effort of every driver measures."""
        efforts = {one.name: one.angular for one in self.mechanism.drivers}
        springs = {name: isinstance(self.mechanism[name], Spring) for name in self.stiffness}
        return {name: "torque" if angular else "force" for name, angular in efforts.items()} | {
            name: "stiffness" if straight else "torsion stiffness"
            for name, straight in springs.items()
        }

    def __repr__(self) -> str:
        how = "complete" if self.complete else f"{self.left:.3g} left"
        return f"SpringBalance({listed(self.stiffness)}: {how})"


def spring_balance(
    model: Mechanism | System,
    springs: Sequence[str | Spring | TorsionSpring],
    against: Sequence[str] | None = None,
    **options: Any,
) -> SpringBalance:
    """Stiffnesses of springs that balance weights and other loads completely, or best: static
    balancing, gravity compensation.

    Parameters
    ----------
    model : Mechanism or System
        Driven, of one design; with a `Gravity`, or other loads that are to be balanced.
    springs : list
        Names of springs of the mechanism, or `Spring` and `TorsionSpring` elements to be added.
        Their places, free lengths (or angles) and preloads are kept, their stiffnesses are found.
    against : list of str, optional
        Names of the loads that are to be balanced; by default all others.
    **options
        The positions: ``t``, ``drive``, ``turn``, ``instants``, ``guess`` as of `statics`, or
        ``at``, ``over`` as of `Instants`; by default those of the mechanism.

    Returns
    -------
    SpringBalance
        Stiffnesses, efforts before and after, what is left, and the mechanism with the springs.

    Raises
    ------
    ModelError
        For a spring or a load that there is not, a spring with a law of its own, loads that need no
        effort, fewer positions than springs, and a batch.
    SolveError
        As of `statics`.

    Notes
    -----
    The effort of every driver at rest is linear in the stiffnesses: e = e₀ + Σ k_i e_i. That with
    the least mean square over the positions and k ≥ 0 is a problem of non-negative least squares
    (Lawson and Hanson); it is zero everywhere where the potential energy of loads and springs
    is the same in all positions. Efforts of drivers of lengths count by the model length.
    Friction is left out, and drivers that stand still in all positions.

    Source: J. L. Herder, *Energy-free systems*, thesis, Delft 2001: of an arm with a spring of no
    free length, k a b = m g l.

    Examples
    --------
    >>> import mbody
    >>> from math import pi
    >>> arm = mbody.Mechanism("arm", ground={"top": (0, 0.4)})
    >>> arm.add(
    ...     mbody.Body("arm", mass=2.0, inertia=0, cg=(0.5, 0), points={"P": (0.3, 0)}),
    ...     mbody.Revolute("O", "ground", "arm"),
    ...     mbody.AngleDriver("hold", "arm", mbody.laws.ConstantSpeed(0.0, 1.0)),
    ...     mbody.Gravity("g", y=-9.81),
    ... )
    >>> spring = mbody.Spring("spring", "ground.top", "arm.P", stiffness=1.0, free_length=0)
    >>> found = mbody.engineering.spring_balance(arm, [spring], turn=True)
    >>> round(found.stiffness["spring"], 9), found.complete
    (81.75, True)
    """
    described, names = _described(model, springs)
    system = _system(model, described)
    loads = _loads(system, names, against)
    empty = {f"{name}.stiffness": 0.0 for name in names}
    run = analyse_with(system.with_values(empty), "statics", options, "spring_balance")
    moving = [one for one in system.independent_drivers if np.ptp(run.driven(one.name)[0]) > 0.0]
    drivers = [one.name for one in moving]
    if len(run.t) * len(drivers) < len(names):
        raise ModelError(
            f"spring_balance: {len(names)} stiffnesses need at least as many efforts of drivers "
            f"that move, and there are {len(run.t) * len(drivers)}: analyse more positions, as "
            "with turn=True"
        )
    before = {name: _effort(run, name, [*loads, *names]) for name in drivers}
    sizes = [1.0 if getattr(one, "angular", False) else system.length for one in moving]
    present = _row(before, sizes)
    if not present.any():
        raise ModelError(
            f"spring_balance: without springs {listed(drivers)} needs no effort in these "
            "positions: there is nothing to balance"
        )
    columns = _columns(run, names, drivers, sizes, options)
    columns = _without_rounding(system, columns, names)
    found, notes = _solved(columns, present, names)
    still = [one.name for one in system.independent_drivers if one not in moving]
    if still:
        notes.append(listed(still) + STILL)
    stiffness = dict(zip(names, found, strict=True))
    made = with_changed(
        described,
        [replace(described[name], stiffness=k) for name, k in stiffness.items()],  # type: ignore[call-arg]
        ["stiffness"],
    )
    whole = system.with_values({f"{name}.stiffness": k for name, k in stiffness.items()})
    last = analyse_with(whole, "statics", options, "spring_balance")
    after = {name: _effort(last, name, [*loads, *names]) for name in drivers}
    left = float(np.linalg.norm(_row(after, sizes)) / np.linalg.norm(present))
    complete = left <= FORCE_NONE_BALANCE
    reason = "" if complete else _reason(left, stiffness, columns, present)
    return SpringBalance(
        stiffness=stiffness,
        complete=complete,
        left=left,
        reason=reason,
        before=before,
        after=after,
        run=last,
        mechanism=made,
        system=whole,
        **inherited(last, of=drivers, notes=[*notes, *([reason] if reason else [])]),
    )


# -- the question ------------------------------------------------------------------------------


def _described(
    model: Mechanism | System, springs: Sequence[str | Spring | TorsionSpring]
) -> tuple[Mechanism, list[str]]:
    """The description with the springs that are new, and the names of all that are meant."""
    machine = model if isinstance(model, Mechanism) else as_system(model).mechanism
    if isinstance(springs, str | Spring | TorsionSpring):
        springs = [springs]
    if not isinstance(springs, Sequence) or not springs:
        raise ModelError(
            'spring_balance: springs must be names such as ["spring"], or Spring elements, not '
            f"{brief(springs)}"
        )
    made, names = machine.copied(), []
    for one in springs:
        if isinstance(one, Spring | TorsionSpring):
            made.add(one)
            names.append(one.name)
        else:
            names.append(_known(machine, one))
    for name in names:
        if names.count(name) > 1:
            raise ModelError(f"spring_balance: '{name}' is given twice: give it once", name)
        if made[name].law is not None:  # type: ignore[attr-defined]
            raise ModelError(
                f"'{name}' has a law of its own, spring_balance finds stiffnesses: give it one in "
                "its place",
                name,
            )
    return made, names


def _known(machine: Mechanism, name: Any) -> str:
    there = [one.name for one in machine.loads if isinstance(one, Spring | TorsionSpring)]
    if name not in there:
        known = f"there are: {listed(there)}" if there else "there are none: give Spring elements"
        raise ModelError(f"spring_balance: there is no spring {brief(name)} ({known})", str(name))
    return str(name)


def _system(model: Mechanism | System, described: Mechanism) -> System:
    """The system of the description with the numbers that were given."""
    system = assemble(described)
    if isinstance(model, System):
        takes_one_design("spring_balance", model.batch)
        others = {k: v for k, v in model.values.items() if system.values[k] != v}
        system = system.with_values(others) if others else system
    return system


def _loads(system: System, springs: list[str], against: Sequence[str] | None) -> list[str]:
    """The loads that are to be balanced."""
    there = [one.name for one in system.mechanism.loads if one.name not in springs]
    if against is None:
        return there
    wanted = [against] if isinstance(against, str) else list(against)
    for name in wanted:
        if name not in there:
            raise unknown_name("spring_balance: load", name, there, use=" to balance")
    return wanted


# -- linear equations ----------------------------------------------------------------------------


def _effort(run: Solution, driver: str, loads: Sequence[str]) -> Array:
    """Effort of a driver due to some loads, (instants,)."""
    parts = run.breakdown(driver)
    return np.asarray(sum((parts[name] for name in loads), np.zeros(len(run.t))))


def _row(efforts: dict[str, Array], sizes: list[float]) -> Array:
    """Efforts of all drivers at all instants, of torques; the ends of a revolution count half."""
    weights = np.ones(len(next(iter(efforts.values()))))
    if len(weights) > 1:
        weights[[0, -1]] = np.sqrt(0.5)
    return np.concatenate(
        [weights * size * one for size, one in zip(sizes, efforts.values(), strict=True)]
    )


def _columns(
    run: Solution, names: list[str], drivers: list[str], sizes: list[float], options: Any
) -> Array:
    """Efforts by each spring at unit stiffness, without preload: (rows, springs)."""
    plain = {f"{name}.stiffness": 1.0 for name in names}
    plain |= {f"{name}.preload": 0.0 for name in names}
    one = analyse_with(run.system.with_values(plain), "statics", options, "spring_balance")
    return np.column_stack(
        [_row({d: _effort(one, d, [name]) for d in drivers}, sizes) for name in names]
    )


def _without_rounding(system: System, columns: Array, names: list[str]) -> Array:
    """The columns, zero of springs that act on no driver: that keep their lengths, or have none."""
    machine, rows = system.mechanism, len(columns)
    # a unit stiffness gives a torque of the square of a length at most, or of an angle
    size = [1.0 if isinstance(machine[n], TorsionSpring) else system.length**2 for n in names]
    acts = np.linalg.norm(columns, axis=0) > SINGULAR_VALUE_ZERO * np.sqrt(rows) * np.array(size)
    return np.where(acts, columns, 0.0)


def _solved(columns: Array, present: Array, names: list[str]) -> tuple[list[float], list[str]]:
    """Non-negative stiffnesses, and what is to be said of them."""
    sizes = np.linalg.norm(columns, axis=0)
    notes = [
        f"'{name}' acts on no driver: its stiffness is of no effect"
        for name, size in zip(names, sizes, strict=True)
        if not size
    ]
    scaled = columns / np.where(sizes > 0.0, sizes, 1.0)
    _, values, directions = np.linalg.svd(np.linalg.qr(scaled, mode="r"))
    alike = directions[int((values > SINGULAR_VALUE_ZERO * values.max()).sum()) :]
    several = [
        n
        for n in np.flatnonzero(sizes)
        if np.abs(alike[:, n]).max(initial=0.0) > SINGULAR_VALUE_ZERO
    ]
    if several:
        names = [names[n] for n in several]
        notes.append(f"other stiffnesses of {listed(names)} do as much: they act alike")
    return nonnegative(columns, -present).tolist(), notes


def _reason(left: float, stiffness: dict[str, float], columns: Array, present: Array) -> str:
    """Why something is left."""
    head = f"springs {listed(stiffness)} leave {100.0 * left:.3g} % of the effort (rms)"
    pushing = [name for name, k in stiffness.items() if k == 0.0]
    free = np.linalg.lstsq(columns, -present, rcond=SINGULAR_VALUE_ZERO)[0]
    residual = float(np.linalg.norm(present + columns @ free) / np.linalg.norm(present))
    if pushing and residual < SPRING_PUSHED * left:
        return (
            f"{head}: {listed(pushing)} would have to push, which would leave "
            f"{100.0 * residual:.3g} %: other places may do it"
        )
    return f"{head}: other places or free lengths may leave less"


# -- Counterweights: their momentum and inertia forces -----------------------------------------


#: Passes of Newton's method for the masses of the counterweights, which are not linear.
PASSES = 200


@dataclass(frozen=True)
class Counterweight:
    """A point mass on a link.

    `at`: From where its radius counts, such as ``"crank"`` (the link's origin) or ``"crank.O2"``.
    `radius`: [length]
    `angle`: Its direction from there in link axes [rad].
    `mass`: [mass]
    `x`, `y`: Its place in link axes [length].
    `moment`: First moment of mass, mass × radius [mass·length].
    """

    body: str
    at: str
    radius: float
    angle: float
    mass: float
    x: float
    y: float
    moment: float


# -- terms linear in masses and first moments --------------------------------------------------


def link_columns(run: Solution, quantity: str) -> Array:
    """Momentum ("v") or inertia force with opposite sign ("a") of links by m, m x, m y about their
    origins: (2 instants, 3 bodies).
    """
    columns = []
    for body in run.mechanism.bodies:
        columns += _moment_columns(
            run, body.name, run.point(Marker(body.name, (0.0, 0.0))), quantity
        )
    return np.array(columns).T


def counterweight_columns(run: Solution, places: Sequence[Marker], quantity: str) -> Array:
    """Columns of the momentum of point masses by their m, m x, m y about `places`, in link axes."""
    columns = []
    for place in places:
        columns += _moment_columns(run, place.body, run.point(place), quantity)
    return np.array(columns).T


def _moment_columns(run: Solution, body: str, place: PointHistory, quantity: str) -> list[Array]:
    history = run[body]
    c, s, w = np.cos(history.angle), np.sin(history.angle), history.omega
    if quantity == "v":
        along, across, x, y = np.zeros_like(w), w, place.vx, place.vy
    else:
        # ë = α k × e − ω² e of a unit vector e of the link
        along, across, x, y = -w * w, history.alpha, place.ax, place.ay
    by_x = along * c - across * s, along * s + across * c
    by_y = -along * s - across * c, along * c - across * s
    return [np.concatenate(pair) for pair in ((x, y), by_x, by_y)]


def weights_of_instants(blocks: int, instants: int) -> Array:
    """Roots of the weights of rows of columns: the first and the last instant, which are one
    position of a revolution, count half.
    """
    weights = np.ones(instants)
    weights[[0, -1]] = np.sqrt(0.5)
    return np.tile(weights, 2 * blocks)


def link_moments(system: System) -> Array:
    """m, m x, m y of every link about its origin, in link axes: (3 bodies,)."""
    found: list[float] = []
    for body in system.mechanism.bodies:
        mass = float(system.mass[3 * system.bodies[body.name], 0])
        x, y = (float(part) for part in system.numbers.point(f"{body.name}.cg"))
        found += [mass, mass * x, mass * y]
    return np.array(found)


# -- the best counterweights ---------------------------------------------------------------------


def best_moments(columns: Array, present: Array, radii: Array) -> Array:
    """First moments (counterweights, 2) with the least sum of squares of what is left. `columns`
    (rows, 3·counterweights), `present` (rows,), `radii` (counterweights,).

    Minimises |present + Σ (v |s|/r + U s)| over the moments s of all counterweights, of mass |s|/r;
    where several are as good, those of least masses.

    The equations are linear but for |s|, which counts only where the place moves: Newton's method
    on them, each pass a linear problem of least squares; from what it finds, where something is
    left, `least_squares` goes on to the least from there and from no masses.
    """
    # as many rows as there are unknowns have the same sums of squares
    small = np.asarray(np.linalg.qr(np.column_stack([columns, present]), mode="r"))
    v, ux, uy = (small[:, k:-1:3] for k in range(3))
    constant = small[:, -1]
    count = len(radii)

    def left(z: Array) -> Array:
        """z: moments by radius, that is masses with a direction, (counterweights, 2) in a row."""
        x, y = z.reshape(count, 2).T
        return np.asarray(constant + v @ np.hypot(x, y) + ux @ (radii * x) + uy @ (radii * y))

    def jacobian(z: Array) -> Array:
        x, y = z.reshape(count, 2).T
        size = np.hypot(x, y)
        size = np.where(size > 0.0, size, 1.0)
        parts = v * (x / size) + ux * radii, v * (y / size) + uy * radii
        return np.stack(parts, axis=-1).reshape(len(constant), 2 * count)

    z = np.zeros(2 * count)
    for _ in range(PASSES):
        derivatives = jacobian(z)
        new = np.linalg.lstsq(
            derivatives, derivatives @ z - left(z), rcond=tol.SINGULAR_VALUE_ZERO
        )[0]
        done = np.abs(new - z).max(initial=0.0) <= tol.LEAST_SQUARES_ENDS * np.abs(new).max(
            initial=0.0
        )
        z = new
        if done:
            break
    if np.abs(left(z)).max(initial=0.0) > tol.SINGULAR_VALUE_ZERO * np.abs(constant).max(
        initial=0.0
    ):
        ends = (least_squares(left, jacobian, start) for start in (z, np.zeros_like(z)))
        z = min(ends, key=lambda end: end.cost).x
    return z.reshape(count, 2) * radii[:, None]


# -- a mechanism that has them -------------------------------------------------------------------


def with_counterweights(
    machine: Mechanism, system: System, weights: Mapping[str, Sequence[Counterweight]]
) -> Mechanism:
    """The mechanism with counterweights (by body) as parts of its links; masses, mass centres and
    inertias of these are numbers then and follow no formulas.
    """
    bodies = [_loaded(machine, system, name, own) for name, own in weights.items()]
    return with_changed(machine, bodies, ("mass", "weight", "inertia", "cg.", "spread."))


def _loaded(
    machine: Mechanism, system: System, name: str, weights: Sequence[Counterweight]
) -> Body:
    """A link with point masses: mass, mass centre, and inertia by the parallel axis theorem."""
    body: Any = machine[name]
    first = 3 * system.bodies[name]
    mass, _, inertia = (float(part) for part in system.mass[first : first + 3, 0])
    own = tuple(float(part) for part in system.numbers.point(f"{name}.cg"))
    parts = np.array([(mass, *own), *((one.mass, one.x, one.y) for one in weights)])
    total = parts[:, 0].sum()
    cg = parts[:, 0] @ parts[:, 1:] / total
    away = parts[:, 1:] - cg
    xx, yy = parts[:, 0] @ away**2
    xy = parts[:, 0] @ (away[:, 0] * away[:, 1])
    changes: dict[str, Any] = {"cg": (float(cg[0]), float(cg[1]))}
    changes["inertia"] = inertia + float(xx + yy)
    heavy = {"mass": float(total)}
    if body.weight is not None:
        heavy = {"weight": float(total) * machine.g}
    spread = body.spread
    if spread is not None:
        px, py, pxy = _spread(spread, inertia)
        moments = px + float(xx), py + float(yy), pxy + float(xy)
        changes["spread"] = SecondMoments(*moments)
    return replace(body, **heavy, **changes)


def _spread(spread: str | SlenderRod | SecondMoments, inertia: float) -> tuple[Any, Any, Any]:
    """∫x² dm, ∫y² dm, ∫xy dm about the mass centre."""
    if isinstance(spread, SecondMoments):
        return spread.xx, spread.yy, spread.xy
    if isinstance(spread, SlenderRod):
        c, s = np.cos(spread.angle), np.sin(spread.angle)
        return inertia * c * c, inertia * s * s, inertia * c * s
    return 0.0, 0.0, 0.0


# -- Shaking forces without and with counterweights --------------------------------------------


@dataclass(frozen=True, eq=False)
class Shaking(Locked):
    """Resultant of the inertia forces of all links: arrays (instants,), world axes.

    `fx`, `fy`: Shaking force of inertia alone, Σ −m a_G [force].
    `moment`: Shaking moment about the origin of the ground [force·length].
    """

    fx: Array
    fy: Array
    moment: Array

    @property
    def magnitude(self) -> Array:
        """√(fx² + fy²)."""
        return np.hypot(self.fx, self.fy)


def _rounding(found: ForceBalance) -> tuple[float, float]:
    """Rounding beside the force before, and beside the moment that the forces would have at the
    size of the mechanism.
    """
    parts, force = found.peaks.values(), found.peaks["before"]["force"]
    moment = max(force * found.system.length, *(one["moment"] for one in parts))
    return tol.PRINTED_NONE_FINE * force, tol.PRINTED_NONE_FINE * moment


@dataclass(frozen=True, eq=False, repr=False)
class ForceBalance(Inherited, Presented):
    """Counterweights, and what they do.

    Attributes
    ----------
    counterweights : tuple of Counterweight
        In the order of `on`.
    conditions : int
        How many conditions a complete balance is: the rank of the momentum of all links.
    complete : bool
        Whether the momentum vanishes in every position at every speed.
    left : float
        Shaking force that is left, root of the mean square, as a part of what it was.
    reason : str
        Why it is not complete; empty where it is.
    before, after : Shaking
        Shaking force and moment of inertia over the instants that were analysed.
    run : Solution
        The motion with counterweights.
    mechanism : Mechanism
        The description with counterweights as parts of the links.
    system : System
        The same with the numbers of the system that was given.

    Examples
    --------
    >>> import mbody
    >>> machine = mbody.gallery.load("norton_fourbar")
    >>> found = mbody.engineering.force_balance(machine, {"crank": "3 in", "rocker": "5 in"})
    >>> len(found.counterweights), bool(found.left < 1e-9)
    (2, True)
    """

    counterweights: tuple[Counterweight, ...] = ()
    conditions: int = 0
    complete: bool = False
    left: float = 0.0
    reason: str = ""
    before: Shaking = field(default_factory=lambda: Shaking(*np.zeros((3, 0))))
    after: Shaking = field(default_factory=lambda: Shaking(*np.zeros((3, 0))))
    run: Any = None
    mechanism: Any = None
    system: Any = None

    analysis_name = "balance"
    declared = (
        ItemTable(
            "counterweights",
            (
                Value("body", "COUNTERWEIGHT", "text"),
                Value("mass", "mass", "mass"),
                Value("at", "from", "text"),
                Value("radius", "radius", "length"),
                Value("angle", "angle", "angle"),
                Value("moment", "moment", "mass·length"),
                *data_only("x", "y", dimension="length"),
            ),
        ),
        "conditions complete left reason",
        ItemTable(
            "peaks",
            (
                Value("force", "shaking force", "force", floor=lambda one: _rounding(one)[0]),
                Value("moment", "shaking moment", "torque", floor=lambda one: _rounding(one)[1]),
            ),
            "GREATEST",
        ),
        Sentence(
            lambda found: (
                f"{found.conditions} conditions; "
                + ("complete balance" if found.complete else f"{100.0 * found.left:.3g} % is left")
            )
        ),
    )

    @property
    def peaks(self) -> dict[str, dict[str, float]]:
        """The greatest shaking force and moment before and after."""
        return {
            name: {
                "force": float(one.magnitude.max(initial=0.0)),
                "moment": float(np.abs(one.moment).max(initial=0.0)),
            }
            for name, one in (("before", self.before), ("after", self.after))
        }

    def __repr__(self) -> str:
        how = "complete" if self.complete else f"{self.left:.3g} left"
        return f"ForceBalance({listed(one.body for one in self.counterweights)}: {how})"


AT_REST = (
    "the drivers have no speed in this motion: forces are those at unit rates, one driver after "
    "the other"
)
BALANCED = "the links balance each other already: no counterweight is needed"


def force_balance(model: Mechanism | System, on: Mapping[Any, Any], **options: Any) -> ForceBalance:
    """Counterweights that balance the inertia forces of a linkage completely, or best: balancing of
    shaking forces.

    Parameters
    ----------
    model : Mechanism or System
        Driven, of one design.
    on : mapping
        Which links get a counterweight, and how far from where: ``{"crank": "3 in"}`` from the
        origin of the link, ``{"rocker.O4": 5.0}`` from one of its points; floats [length] or text
        with units.
    **options
        The motion: ``t``, ``drive``, ``turn``, ``instants``, ``guess`` as of `kinematics`, or
        ``at``, ``over`` as of `Instants`; by default a turn of the one driver of an angle, else the
        instants of the mechanism.

    Returns
    -------
    ForceBalance
        Masses and directions, how many conditions there are, what is left and why; the shaking
        moment; the mechanism with counterweights.

    Raises
    ------
    ModelError
        For a link that there is not or that is the ground, a radius that is none, a batch, and one
        instant alone.
    SolveError
        As of `kinematics`.

    Notes
    -----
    The momentum of all links is linear in m, m x, m y of each: A p, one block of rows for each
    driver at unit rate. Where it vanishes in all positions there is no shaking force at any
    speed. The rank of A is the number of conditions: 4 of a four-bar. A counterweight adds m, m x,
    m y at its radius; its mass counts wherever its place moves. Where these counterweights cannot
    do it, those with the least mean square of the shaking force of this motion are given.
    Springs, weights and other loads are no part of it. The shaking moment has the inertias in
    it and is only reported.

    Source: R. S. Berkof and G. G. Lowen, *A new method for completely force balancing simple
    linkages*, J. Eng. Ind. 91 (1969) 21–26; F. R. Tepper and G. G. Lowen, *General theorems
    concerning full force balancing of planar linkages by internal mass redistribution*, J. Eng.
    Ind. 94 (1972) 789–796 (the way to the ground).

    Examples
    --------
    >>> import mbody
    >>> machine = mbody.gallery.load("norton_fourbar")
    >>> found = mbody.engineering.force_balance(machine, {"crank": "3 in", "rocker": "5 in"})
    >>> found.complete, found.conditions
    (True, 4)
    """
    system = as_system(model)
    takes_one_design("force_balance", system.batch)
    wanted = _wanted(system, on)
    run = _motion(system, options)
    for place in wanted:
        point_history(run, place)
    blocks = _unit_rates(run)
    present = link_moments(system)
    if not present.any():
        raise ModelError(
            f"'{system.mechanism.name}' has no link with mass: there is nothing to balance"
        )
    links = _rows(blocks, None, "v")
    conditions = _rank(links, system.length)
    places, radii = list(wanted), np.array(list(wanted.values()))
    columns = _rows(blocks, places, "v")
    # what is rounding beside the momenta of the links, taken one by one, is balanced already
    size = float(np.linalg.norm(links * present))
    momentum = links @ present
    if np.linalg.norm(momentum) <= tol.FORCE_NONE_BALANCE * size:
        momentum = 0.0 * momentum
    moments = best_moments(columns, momentum, radii)
    complete = (
        _residual_momentum(columns, moments, radii, momentum) <= tol.FORCE_NONE_BALANCE * size
    )
    before, notes = _shaking(run), []
    moving = float(np.abs(before.magnitude).max(initial=0.0)) > 0.0
    if not moving:
        notes.append(AT_REST)
    forces = [run] if moving else blocks
    if not complete:
        whole = _rows(forces, None, "a") @ present
        moments = best_moments(_rows(forces, places, "a"), whole, radii)
    weights = tuple(
        _counterweight(system, place, radius, moment)
        for place, radius, moment in zip(places, radii, moments, strict=True)
    )
    described = model if isinstance(model, Mechanism) else model.mechanism
    made = _balanced(described, system, weights)
    after = _same_motion(made[1], run)
    old, new = (
        [_shaking(one) for one in ((motion,) if moving else _unit_rates(motion))]
        for motion in (run, after)
    )
    left, reason = 0.0, ""
    if not momentum.any():
        notes.append(BALANCED)
    else:
        left = _size(new) / _size(old)
    if not complete:
        reason = _balance_reason(system, wanted, left, blocks, momentum)
    return ForceBalance(
        counterweights=weights,
        conditions=conditions,
        complete=complete,
        left=left,
        reason=reason,
        before=_joined(old),
        after=_joined(new),
        run=after,
        mechanism=made[0],
        system=made[1],
        **inherited(run, after, notes=[*notes, *([reason] if reason else [])]),
    )


# -- the question ------------------------------------------------------------------------------


def _wanted(system: System, on: Any) -> dict[Marker, float]:
    """Places from which counterweights are measured, with their radii."""
    if not isinstance(on, Mapping) or not on:
        raise ModelError(
            'force_balance: on must name links with radii, such as {"crank": "3 in"}, not '
            f"{brief(on)}"
        )
    found: dict[Marker, float] = {}
    names = [body.name for body in system.mechanism.bodies]
    for place, given in on.items():
        marker = as_marker(place, "force_balance", "on")
        if marker.body not in names:
            use = " for a counterweight"
            raise unknown_name("force_balance: link", marker.body, names, use=use)
        radius = number_in(system.mechanism, given, "length", marker.body, "radius")
        if radius <= 0.0:
            raise ModelError(
                f"the counterweight on '{marker}' has the radius {radius:g} "
                f"{system.mechanism.units.length}, it must be positive: its direction is found",
                marker.body,
            )
        if any(marker.body == other.body for other in found):
            raise ModelError(
                f"force_balance: '{marker.body}' has two counterweights: one does the work of both",
                marker.body,
            )
        found[marker] = radius
    return found


def _motion(system: System, options: Mapping[str, Any]) -> Solution:
    """The motion whose positions count."""
    given = dict(options)
    angular = [one for one in system.independent_drivers if getattr(one, "angular", False)]
    if not given and len(system.independent_drivers) == len(angular) == 1:
        given = {"turn": angular[0].name}
    run = analyse_with(system, "kinematics", given, "force_balance")
    if not system.independent_drivers:
        raise ModelError(
            f"'{system.mechanism.name}' has no driver: force_balance takes positions of a driven "
            "motion, add one"
        )
    if len(run.t) < 2:
        raise ModelError(
            'force_balance takes several positions: give over="turn", or drive with the values of '
            "the drivers"
        )
    return run


def _poses(run: Solution) -> dict[str, tuple[float, float, float]]:
    """Guesses of all bodies: where they are at the first instant."""
    places = {b.name: run.point(Marker(b.name, (0.0, 0.0))) for b in run.mechanism.bodies}
    return {
        name: (float(place.x[0]), float(place.y[0]), float(run[name].angle[0]))
        for name, place in places.items()
    }


def _unit_rates(run: Solution) -> list[Solution]:
    """Results at the positions of `run`, one for each driver, which alone moves at unit rate."""
    values = {
        one.name: np.asarray(run.driven(one.name)[0]) for one in run.system.independent_drivers
    }
    guess = _poses(run)
    found = []
    for moving in values:
        drive = {name: (v, 1.0 if name == moving else 0.0, 0.0) for name, v in values.items()}
        options = {"drive": drive, "guess": guess}
        found.append(analyse_with(run.system, "kinematics", options, "force_balance"))
    return found


def _same_motion(system: System, run: Solution) -> Solution:
    """The motion of `run` by another system."""
    drive = {one.name: run.driven(one.name) for one in run.system.independent_drivers}
    options = {"drive": drive, "guess": _poses(run)}
    return analyse_with(system, "kinematics", options, "force_balance")


# -- the result --------------------------------------------------------------------------------


def _rows(runs: list[Solution], places: list[Marker] | None, quantity: str) -> Array:
    """Columns of the links, or of counterweights at places, over the instants of several runs."""
    parts = [
        link_columns(run, quantity)
        if places is None
        else counterweight_columns(run, places, quantity)
        for run in runs
    ]
    return np.concatenate(parts) * weights_of_instants(len(runs), len(runs[0].t))[:, None]


def _rank(columns: Array, length: float) -> int:
    """The number of conditions: of masses and first moments by the model length."""
    scaled = columns / np.tile([length, 1.0, 1.0], columns.shape[1] // 3)
    sizes = np.linalg.svd(scaled, compute_uv=False)
    return int((sizes > tol.SINGULAR_VALUE_ZERO * sizes[0]).sum()) if sizes.size and sizes[0] else 0


def _residual_momentum(columns: Array, moments: Array, radii: Array, present: Array) -> float:
    """Norm of the momentum left by counterweights."""
    masses = np.hypot(*moments.T) / radii
    added = np.column_stack([masses, moments]).ravel()
    return float(np.linalg.norm(present + columns @ added))


def _shaking(run: Solution) -> Shaking:
    """By d'Alembert, from the motion."""
    total = np.zeros((3, len(run.t)))
    for body in run.mechanism.bodies:
        fx, fy, torque = run.inertia(body.name)
        place = run[body.name]
        total += np.array([fx, fy, torque + place.x * fy - place.y * fx])
    return Shaking(*total)


def _size(parts: list[Shaking]) -> float:
    """Root of the mean square of the force, weighted as the columns are."""
    squares = np.array([one.magnitude for one in parts]) ** 2
    squares[:, [0, -1]] *= 0.5
    return float(np.sqrt(squares.sum() / (squares.size - len(parts))))


def _joined(parts: list[Shaking]) -> Shaking:
    keys = ("fx", "fy", "moment")
    return Shaking(*[np.concatenate([getattr(one, key) for one in parts]) for key in keys])


def _counterweight(system: System, place: Marker, radius: float, moment: Array) -> Counterweight:
    size = float(np.hypot(*moment))
    angle = float(np.arctan2(moment[1], moment[0])) if size else 0.0
    x, y = _local(system, place)
    return Counterweight(
        body=place.body,
        at=str(place),
        radius=float(radius),
        angle=angle,
        mass=size / float(radius),
        x=x + float(radius * np.cos(angle)),
        y=y + float(radius * np.sin(angle)),
        moment=size,
    )


def _local(system: System, place: Marker) -> tuple[float, float]:
    """A place in the axes of its link."""
    if isinstance(place.point, str):
        x, y = system.numbers.point(f"{place.body}.{place.point}")
    elif isinstance(place.point, tuple):
        x, y = place.point
    else:
        polar = place.point
        x, y = polar.r * np.cos(polar.angle), polar.r * np.sin(polar.angle)
    return float(x), float(y)


def _balanced(
    described: Mechanism, system: System, weights: tuple[Counterweight, ...]
) -> tuple[Mechanism, System]:
    """Description and system with counterweights; other numbers are those of the system."""
    heavy = {one.body: [one] for one in weights if one.mass > 0.0}
    machine = with_counterweights(described, system, heavy)
    made = assemble(machine)
    others = {
        name: value
        for name, value in system.values.items()
        if name in made.values
        and made.values[name] != value
        and not (name.partition(".")[0] in heavy and _of_mass(name.partition(".")[2]))
    }
    return machine, made.with_values(others) if others else made


def _of_mass(key: str) -> bool:
    return key in ("mass", "weight", "inertia") or key.startswith(("cg.", "spread."))


def _balance_reason(
    system: System,
    wanted: Mapping[Marker, float],
    left: float,
    blocks: list[Solution],
    present: Array,
) -> str:
    """Why counterweights on these links leave something, and what would help."""
    here = listed(place.body for place in wanted)
    head = f"counterweights on {here} leave {100.0 * left:.3g} % of the shaking force (rms)"
    stuck = _without_pins(system)
    if stuck:
        verb = "has" if len(stuck) == 1 else "have"
        return (
            f"{head}: {listed(stuck)} {verb} no way to the ground through pins, so that "
            "counterweights on links balance only a part (contour theorem)"
        )
    named = {place.body for place in wanted}
    others = [body.name for body in system.mechanism.bodies if body.name not in named]
    radius = float(np.mean(list(wanted.values())))
    for name in others:
        if _would_do({**wanted, Marker(name, (0.0, 0.0)): radius}, blocks, present):
            return f"{head}: with one on '{name}' too the balance is complete"
    every = {**wanted, **{Marker(name, (0.0, 0.0)): radius for name in others}}
    if others and _would_do(every, blocks, present):
        return f"{head}: more links must have one, on all of them the balance is complete"
    return f"{head}: other links or radii may leave less"


def _would_do(wanted: Mapping[Marker, float], blocks: list[Solution], present: Array) -> bool:
    """Whether these counterweights balance completely."""
    places, radii = list(wanted), np.array(list(wanted.values()))
    columns = _rows(blocks, places, "v")
    moments = best_moments(columns, present, radii)
    return _residual_momentum(columns, moments, radii, present) <= tol.FORCE_NONE_BALANCE * float(
        np.linalg.norm(present)
    )


def _without_pins(system: System) -> list[str]:
    """Links with mass that no chain of pins connects with the ground."""
    reached, before = {"ground"}, 0
    pins = [one.bodies for one in system.mechanism.joints if one.coincident]
    while len(reached) > before:
        before = len(reached)
        for pair in pins:
            if reached & set(pair):
                reached |= set(pair)
    heavy = [b.name for b in system.mechanism.bodies if system.mass[3 * system.bodies[b.name], 0]]
    return [name for name in heavy if name not in reached]
