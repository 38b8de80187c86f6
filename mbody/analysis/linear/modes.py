"""`modes`: natural frequencies, damping and shapes of small motions about equilibria."""

from __future__ import annotations

import difflib
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from mbody.analysis.equilibria.equilibrium import AtEquilibria, Equilibrium, equilibrium
from mbody.analysis.linear.linearize import Linearization, linearize
from mbody.analysis.position.assembly_analysis import each_design
from mbody.analysis.position.tangent_space import Array
from mbody.core import tolerances as tol
from mbody.core.presentation import Presented
from mbody.errors import ModelError, SolveError, brief
from mbody.model.body import ORIGIN, Guesses
from mbody.model.element import Marker, listed
from mbody.model.mechanism import Mechanism
from mbody.solution.declared_result import Value
from mbody.solution.doubts import Inherited, inherited
from mbody.solution.solution import Solution
from mbody.system.system import Locked, System

# -- The quadratic eigenproblem of small motions, free motions without inertia among them ------
# F. Tisseur, K. Meerbergen: The quadratic eigenvalue problem, SIAM Review 43 (2001), 235-286.


def eigenvalues(M: Array, C: Array, K: Array) -> tuple[list[complex], list[Array], int] | None:
    """Roots s of (s² M + s C + K) u = 0, their vectors u, and how many motions have no inertia;
    None where every s is a root.
    """
    free = len(M)
    parts = [float(np.abs(part).max()) for part in (M, C, K)]
    inertia = np.linalg.eigvalsh(M)
    infinite = int((inertia <= tol.INERTIA_NONE * parts[0]).sum())
    # a unit of time in which the greatest numbers are one
    if parts[0] and parts[2]:
        fast = math.sqrt(parts[2] / parts[0])
    elif parts[1]:
        fast = parts[1] / parts[0] if parts[0] else parts[2] / parts[1]
    else:
        fast = 1.0
    fast = fast or 1.0
    whole = max(parts[0] * fast**2, parts[1] * fast, parts[2]) or 1.0
    M, C, K = M * fast**2 / whole, C * fast / whole, K / whole
    zero, one = np.zeros((free, free)), np.eye(free)
    still = np.linalg.svd(K)
    rigid = still[2][still[1] <= tol.SINGULAR_VALUE_ZERO * max(float(still[1].max()), tol.TINY)]
    damped = np.abs(C).max() > tol.INERTIA_NONE
    if damped:
        E, A = np.block([[one, zero], [zero, M]]), np.block([[zero, one], [-K, -C]])
        solved = _finite(E, A)
    else:
        solved = _finite(M, -K)
    if solved is None:
        return None
    roots, vectors = solved
    if not damped:
        squares, roots = roots, np.sqrt(roots.astype(complex))
        # flutter: the other two of four roots
        twins = np.abs(squares.imag) > tol.RATE_ROUNDING_EIGENVALUE_DOUBLE * np.abs(squares)
        roots = np.append(roots, -roots[twins])
        vectors = np.hstack([vectors, vectors[:, twins]])
    found, shapes = [0j] * len(rigid), [motion.astype(complex) for motion in rigid]
    for root, vector in zip(roots, vectors[:free].T, strict=True):
        size = abs(root)
        if len(rigid) and size < tol.RATE_NONE_MOTION:
            continue
        real = 0.0 if abs(root.real) <= tol.RATE_ROUNDING_EIGENVALUE * size else root.real
        imaginary = (
            0.0 if abs(root.imag) <= tol.RATE_ROUNDING_EIGENVALUE_DOUBLE * size else root.imag
        )
        if imaginary < 0.0:
            continue
        found.append(fast * complex(real, imaginary))
        shapes.append(vector.astype(complex))
    return found, shapes, infinite


def _finite(E: Array, A: Array) -> tuple[Array, Array] | None:
    """Finite roots and vectors of A z = s E z, E singular or not; None where every s is a root.

    Where uᵀ E = 0, uᵀ A z = 0 holds for every finite root: z is sought among those, and again,
    until E has an inverse there. Then no infinite root is left, of whatever order it was.
    """
    Z, zero = np.eye(len(A)), tol.INERTIA_NONE
    while len(A):
        u, sizes, _ = np.linalg.svd(E)
        rank = int((sizes > zero * max(float(sizes.max()), tol.TINY)).sum())
        if rank == len(A):
            roots, vectors = np.linalg.eig(np.linalg.solve(E, A))
            return roots, Z @ vectors
        fixed = u[:, rank:].T @ A
        _, parts, vt = np.linalg.svd(fixed)
        if not parts.min() > tol.SINGULAR_VALUE_ZERO:
            return None
        kept = vt[len(fixed) :].T
        E, A = u[:, :rank].T @ E @ kept, u[:, :rank].T @ A @ kept
        Z, zero = Z @ kept, tol.SINGULAR_VALUE_ZERO
    return np.zeros(0), Z


# -- Coordinates of a mode shape: angles of bodies, x and y of their points --------------------
# For unit rates of the leaders a body goes with (vx, vy, ω) at its mass centre, and a point at
# (rx, ry) from there with (vx − ω ry, vy + ω rx): the velocities of a small motion are those of a
# rigid body, and so are its amplitudes.

#: What moves of a body, and of a point.
KEYS = ("x", "y", "angle")


@dataclass(frozen=True)
class ModePlace:
    """A coordinate of a mechanism that has an amplitude.

    `point`: None of the mass centre, and of an angle.
    `key`: 0 of x, 1 of y, 2 of the angle.
    """

    body: str
    point: Marker | None
    key: int

    @property
    def turns(self) -> bool:
        """Whether it is an angle [rad]; else it is a length."""
        return self.key == 2


def mode_place(mechanism: Mechanism, given: object, where: str = "") -> ModePlace:
    """The coordinate of that name; sentences begin with `where`.

    ``"rod.angle"``; ``"rod.x"`` of the mass centre; ``"rod.P.y"`` of a point, ``"rod.origin.y"`` of
    where the axes of the link begin; ``"A.x"`` of a pin, by the name of the joint.
    """
    owner, _, key = given.rpartition(".") if isinstance(given, str) else ("", "", "")
    first, _, point = owner.partition(".")
    bodies = {"ground": mechanism.ground} | {one.name: one for one in mechanism.bodies}
    pins = {one.name: one.i for one in mechanism.joints if one.coincident}
    if first in bodies and not point and key in KEYS:
        return ModePlace(first, None, KEYS.index(key))
    if first in bodies and key in KEYS[:2] and point:
        if point in bodies[first].points:
            return ModePlace(first, Marker(first, point), KEYS.index(key))
        if point == ORIGIN:
            return ModePlace(first, Marker(first, (0.0, 0.0)), KEYS.index(key))
        close = difflib.get_close_matches(point, bodies[first].points, n=3)
        raise ModelError(
            f"{where}'{first}' has no point {brief(point)} (it has: "
            f"{listed(close or [*bodies[first].points, ORIGIN])})",
            first,
        )
    if owner in pins and key in KEYS[:2]:
        return ModePlace(pins[owner].body, pins[owner], KEYS.index(key))
    example = mechanism.bodies[0].name
    raise ModelError(
        f"{where}amplitudes are of the angle of a body, and of x and y of its mass centre or a "
        f"point, such as {example}.angle, {example}.x or {_pointed(mechanism)}, not {brief(given)} "
        f"(bodies: {listed(one.name for one in mechanism.bodies)})",
        str(given),
    )


def rates_at(solution: Solution, rates: Array, place: ModePlace) -> Array:
    """Rate of a coordinate at the last instant for unit rates of the leading bodies, (free,), from
    those of all bodies (free, bodies, 3).
    """
    if place.body == "ground":
        return np.zeros(len(rates))
    motion_rates = rates[:, solution.system.bodies[place.body]]
    if place.point is None:
        return np.asarray(motion_rates[:, place.key])
    centre, point = solution[place.body], solution.point(place.point)
    if place.key == 0:
        return np.asarray(
            motion_rates[:, 0] - motion_rates[:, 2] * float(point.y[-1] - centre.y[-1])
        )
    return np.asarray(motion_rates[:, 1] + motion_rates[:, 2] * float(point.x[-1] - centre.x[-1]))


def _pointed(mechanism: Mechanism) -> str:
    """x of a point that there is."""
    named = (f"{one.name}.{point}.x" for one in mechanism.bodies for point in one.points)
    return next(named, f"{mechanism.bodies[0].name}.origin.x")


@dataclass(frozen=True, eq=False)
class Mode(Locked, Presented):
    """One mode: all bodies move as Re(shape · exp(s t)).

    `eigenvalue`: s [rad/time]; of a pair the one with Im s > 0.
    `words`: What it does: ``"oscillates"``, ``"oscillates and decays"``, ``"decays"``, ``"grows"``,
      ``"oscillates and grows"`` (flutter), ``"free"`` (nothing drives it back).
    `amplitudes` (free,): Complex; of the leaders, in their order. The greatest, a length by the
      model length, is 1.
    `leader`: The body whose amplitude is 1 rad or 1 length.
    `shape`: Complex amplitudes (x, y, θ) of the mass centre and the angle of every body.
    `linear`: The small motions that it is one of.
    """

    eigenvalue: complex
    words: str
    amplitudes: Array = field(repr=False)
    leader: str
    shape: dict[str, Array] = field(repr=False)
    linear: Linearization = field(repr=False)

    declared = (
        "eigenvalue words natural_frequency frequency hertz damping_ratio",
        "decay_rate leader amplitudes shape",
    )

    def amplitude(self, place: str) -> complex:
        """The amplitude of a coordinate, [rad] or [length], at the scale of `amplitudes`.

        Parameters
        ----------
        place : str
            ``"rod.angle"``, ``"rod.x"`` of the mass centre, ``"rod.P.y"`` of a point, or ``"A.x"``
            of a pin, by the name of the joint.

        Raises
        ------
        ModelError
            For what has no amplitude.

        Notes
        -----
        A point at (rx, ry) from the mass centre has (x − θ ry, y + θ rx).

        Examples
        --------
        >>> import mbody
        >>> swing = mbody.Mechanism("pendulum")
        >>> swing.add(mbody.Body("bob", mass=1.0, inertia=0, cg=(1, 0), points={"P": (3, 0)}))
        >>> swing.add(mbody.Revolute("O", "ground", "bob"), mbody.Gravity("gravity", y=-9.81))
        >>> mode = mbody.modes(swing)[0][0]
        >>> abs(mode.amplitude("bob.P.x") / mode.amplitude("bob.angle"))
        3.0
        """
        solution = self.linear.solution
        where = mode_place(solution.mechanism, place)
        return complex(self.amplitudes @ rates_at(solution, self.linear.rates, where))

    @property
    def natural_frequency(self) -> float:
        """|s| [rad/time], of what oscillates; else zero."""
        return abs(self.eigenvalue) if self.eigenvalue.imag else 0.0

    @property
    def frequency(self) -> float:
        """Im s [rad/time], with its damping: zero of what does not oscillate."""
        return self.eigenvalue.imag

    @property
    def hertz(self) -> float:
        """Cycles in a unit of time, Im s/2π."""
        return self.eigenvalue.imag / (2.0 * math.pi)

    @property
    def damping_ratio(self) -> float:
        """ζ = −Re s/|s|: 0 without damping, 1 of what decays without oscillating; negative of what
        grows.
        """
        size = abs(self.eigenvalue)
        return -self.eigenvalue.real / size if size else 0.0

    @property
    def decay_rate(self) -> float:
        """−Re s [1/time]: amplitudes fall as exp(−decay_rate · t)."""
        return -self.eigenvalue.real + 0.0


def _position(found: ModesAt) -> dict[str, tuple[float, float, float]]:
    """(x, y, angle) of every body."""
    solution = found.linear.solution
    bodies = {name: solution[name] for name in solution}
    return {n: (float(b.x[-1]), float(b.y[-1]), float(b.angle[-1])) for n, b in bodies.items()}


@dataclass(frozen=True, eq=False)
class ModesAt(Inherited, Presented):
    """The modes at one equilibrium, slow ones first.

    `linear`: M, C, K and the leaders.
    `stability`: ``"unstable"`` where a mode grows, or a motion without inertia is driven away;
      ``"neutral"`` where one is free; else ``"stable"``.
    `modes`: One for each pair of complex eigenvalues, each real one, and each free motion that
      nothing drives back; of a growing one without damping not the decaying twin.
    `status`, `doubts`, `notes`: As of `Inherited`.
    """

    linear: Linearization
    stability: str
    modes: tuple[Mode, ...]

    declared = (
        "stability modes linear",
        Value("position", "", ("length", "length", "angle"), _position),
        "status doubts notes",
    )

    @property
    def frequencies(self) -> Array:
        """Im s [rad/time] of all modes that oscillate, in ascending order."""
        return np.sort([mode.frequency for mode in self.modes if mode.frequency])

    def __len__(self) -> int:
        return len(self.modes)

    def __iter__(self) -> Iterator[Mode]:
        return iter(self.modes)

    def __getitem__(self, index: int) -> Mode:
        return self.modes[index]


@dataclass(frozen=True, eq=False)
class Modes(AtEquilibria[ModesAt]):
    """The modes at one or several equilibria; ``print`` shows them as tables. Doubts of the
    positions are its own.

    Examples
    --------
    >>> import mbody
    >>> swing = mbody.Mechanism("pendulum")
    >>> swing.add(mbody.Body("bob", mass=1.0, cg=(1.0, 0.0)), mbody.Revolute("O", "ground", "bob"))
    >>> swing.add(mbody.Gravity("gravity", y=-9.81))
    >>> found = mbody.modes(swing)
    >>> round(float(found[0].frequencies[0]) ** 2, 9)  # g/l
    9.81
    """

    analysis_name = "modes"
    declared = ("t", "positions")


@each_design
def modes(
    model: Mechanism | System,
    *,
    at: Equilibrium | Solution | None = None,
    free: str | Sequence[str] = (),
    starts: Guesses | Sequence[Guesses] = (),
    t: float = 0.0,
) -> Modes:
    """Natural frequencies, damping ratios and mode shapes at equilibria (modal analysis).

    (s² M + s C + K) u = 0 with the matrices of `linearize`; every body moves as Re(u exp(s t)).

    Parameters
    ----------
    model : Mechanism or System
        With free motions; drivers, if there are any, hold what their laws say at t.
    at : Equilibrium or Solution, optional
        One equilibrium; by default all that `equilibrium` finds.
    free : str or sequence of str, optional
        Drivers that are released.
    starts, t : optional
        As of `equilibrium`; only without `at`.

    Returns
    -------
    Modes
        Of every position, stable ones first.

    Raises
    ------
    ModelError, SolveError
        As `equilibrium` and `linearize`; also where it moves, and where a free motion has neither
        inertia nor damper nor spring.

    Notes
    -----
    A free motion without inertia has an infinite frequency: it follows the others at once, by its
    springs, or as slowly as its dampers let it. Free motions that nothing drives back, rigid-body
    modes, have the frequency zero.

    Source: F. Tisseur, K. Meerbergen: The quadratic eigenvalue problem, SIAM Review 43 (2001).

    Examples
    --------
    >>> import mbody
    >>> machine = mbody.Mechanism("pendulum")
    >>> machine.add(mbody.Body("rod", mass=2.0, cg=(0.5, 0.0)))
    >>> machine.add(mbody.Revolute("O", "ground", "rod"))
    >>> machine.add(mbody.Gravity("gravity", y=-9.81))
    >>> hanging, upright = modes(machine)
    >>> round(hanging[0].frequency, 9), round((9.81 / 0.5) ** 0.5, 9)
    (4.429446918, 4.429446918)
    >>> upright.stability, upright[0].words
    ('unstable', 'grows')
    """
    linearized: list[Any] = []
    notes: tuple[str, ...] = ()
    if at is None:
        found = equilibrium(model, free=free, starts=starts, t=t)
        equilibria: tuple[Equilibrium | Solution, ...] = found.positions
        notes, linearized = found.notes, [found]
    else:
        if starts or t != 0.0:
            raise ModelError("at says the position and its time: leave out starts and t")
        equilibria = (at,)
    linear = [linearize(model, at=position, free=free) for position in equilibria]
    moving = [one for one in linear if one.about != "rest"]
    if moving:
        one = moving[0]
        machine = one.solution.mechanism
        raise SolveError(
            f"modes are of a rest position, but '{machine.name}' moves, or is not balanced, at "
            f"t = {one.t:.6g} {machine.units.time}: give one of equilibrium; linearize gives the "
            "state matrix of a motion"
        )
    positions = tuple(_modes_at(one) for one in linear)
    machine = linear[0].solution.mechanism
    said = inherited(*linearized, *positions, notes=notes)
    return Modes(machine.name, machine.units, linear[0].t, positions, **said)


def _modes_at(linear: Linearization) -> ModesAt:
    """Solve the eigenproblem at one position."""
    system = linear.solution.system
    scale = system.coordinate_units
    rates = linear.rates.reshape(len(linear.motions), -1) / scale
    # orthonormal motions, so that no unit of a leader has a say in what is small
    triangle = np.linalg.qr(rates.T, mode="r")
    inverse = np.linalg.inv(triangle)
    M, C, K = (inverse.T @ X @ inverse for X in (linear.mass, linear.damping, linear.stiffness))
    least = 0.0
    if np.abs(K - K.T).max() <= tol.MATRIX_SYMMETRIC * np.abs(K).max():
        K = 0.5 * (K + K.T)
        least = float(np.linalg.eigvalsh(K)[0])
    # an eigenproblem each of what nothing joins: lists of roots, vectors, and how many are infinite
    whole = rates.reshape(len(M), -1, 3)
    group = system.groups[np.abs(whole).max(axis=2).argmax(axis=1)]
    solved: tuple[list[complex], list[Array], int] | None = [], [], 0
    for which in (np.flatnonzero(group == one) for one in np.unique(group)):
        own = eigenvalues(*(X[np.ix_(which, which)] for X in (M, C, K)))
        if own is None or solved is None:
            solved = None
            continue
        shapes = [np.zeros(len(M), dtype=complex) for _ in own[1]]
        for shape, part in zip(shapes, own[1], strict=True):
            shape[which] = part
        solved = [*solved[0], *own[0]], [*solved[1], *shapes], solved[2] + own[2]
    if solved is None:
        parts = [X / (np.abs(X).max() or 1.0) for X in (M, C, K)]
        null = np.linalg.svd(np.vstack(parts))[2][-1]
        raise _undetermined(system, np.abs((inverse @ null @ rates).reshape(-1, 3)).max(axis=1))
    roots, shapes, infinite = solved
    lengths = system.lengths[[system.bodies[name] for name in linear.leaders]]
    unit = np.where([motion.turns for motion in linear.motions], 1.0, lengths)
    found = []
    for root, shape in zip(roots, shapes, strict=True):
        amplitudes = inverse @ shape
        n = int(np.abs(amplitudes / unit).argmax())
        amplitudes = amplitudes / amplitudes[n]
        bodies = np.tensordot(amplitudes, linear.rates, 1)
        of_all = {name: bodies[system.bodies[name]] for name in linear.solution}
        found.append(Mode(root, _words(root), amplitudes, linear.leaders[n], of_all, linear))
    # the two of a flutter are equally fast but for rounding
    found.sort(key=lambda mode: (float(f"{abs(mode.eigenvalue):.9g}"), mode.eigenvalue.real))
    words = {mode.words for mode in found}
    stability = "neutral" if "free" in words else "stable"
    # what has no inertia leaves at once where its stiffness is negative: no mode shows it
    if words & {"grows", "oscillates and grows"} or least < -tol.MATRIX_SYMMETRIC * np.abs(K).max():
        stability = "unstable"
    notes = list(linear.notes)
    if infinite:
        notes.append(
            f"{infinite} of {len(M)} free motions without inertia: "
            f"{'it follows' if infinite == 1 else 'they follow'} the others by springs and dampers"
        )
    return ModesAt(linear, stability, tuple(found), **inherited(linear, notes=notes))


def _undetermined(system: System, moved: Array) -> SolveError:
    """The sentence of a free motion that nothing determines; moved (bodies,)."""
    name = system.mechanism.bodies[int(moved.argmax())].name
    return SolveError(
        f"modes: the motion of '{name}' is not determined: it is free, and has neither inertia, "
        "nor a damper, nor a spring; give it one, or guide it by a joint",
        name,
    )


def _words(root: complex) -> str:
    if root == 0.0:
        return "free"
    if not root.imag:
        return "decays" if root.real < 0.0 else "grows"
    if not root.real:
        return "oscillates"
    return "oscillates and decays" if root.real < 0.0 else "oscillates and grows"
