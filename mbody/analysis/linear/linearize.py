"""`linearize`: the linear equations of small motions about a rest position, or about a motion."""

from __future__ import annotations

import functools
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from mbody.analysis.equilibria.equilibrium import Equilibrium
from mbody.analysis.equilibria.search import ZERO
from mbody.analysis.freedom.free_motions import FreeMotion, free_motions, leading, rates_of
from mbody.analysis.freedom.single_design import single_design
from mbody.analysis.linear.about_motion import Moving
from mbody.analysis.linear.held_modes import held_modes
from mbody.analysis.linear.state_matrices import StateMatrices, state_matrices
from mbody.analysis.position.assembly_analysis import closed
from mbody.analysis.position.tangent_space import Array, Manifold, Place
from mbody.errors import ModelError, SolveError
from mbody.model.mechanism import Mechanism
from mbody.model.remarks import left_out, without_friction
from mbody.model.study import Measure
from mbody.solution.doubts import Inherited, inherited
from mbody.solution.heading import heading, unit_symbols
from mbody.solution.solution import Solution
from mbody.system.driver_formulas import followed_states
from mbody.system.rank import rank_of, too_large
from mbody.system.read_only import lock
from mbody.system.system import System

__all__ = ["Linearization", "linearize"]

#: Least step of the differences for damping, as a part of the natural rate.
SLOW = 1e-5
#: A load that jumps with the rate by more than this part of the greatest is reported.
JUMP = 1e-6
#: A drive below this part of the greatest load is none: rest positions are found to 1e-8 of it, but
#: one that is nearly singular moves by the root of rounding, and more, when it is closed again.
BALANCED, RESTING = 1e-7, 1e-4
#: A rate below this part of the natural one is none.
STILL = 1e-9
#: How far a position beside another is, in model lengths and radians.
BESIDE = 0.02
#: Part of the loads that differences of accelerations have as rounding.
ROUNDING = 1e-8
#: A loop that is open by more, in model lengths and radians, belongs to another mechanism.
FITS = 1e-6
#: A mass matrix whose least eigenvalue is below this part of the greatest has no inverse.
MASSLESS = 1e-12


@dataclass(frozen=True, eq=False)
class Linearization(Inherited):
    """The linear equations of small motions: M ÿ + C ẏ + K y = F.

    y are small changes of what the leaders of the free motions do; all bodies follow as `motions`
    say.

    Attributes
    ----------
    about : str
        ``"rest"``, or ``"motion"`` where it moves or begins to.
    t : float
        Time.
    mass, damping, stiffness : arrays (free, free)
        M, C and K: forces or torques on the leaders, for accelerations, rates and ways of the
        leaders; these turn or slide as their motions say, [rad] or [length].
    drive : array (free,)
        F, what drives the leaders where y = 0: zero at rest.
    motions : tuple of FreeMotion
        The free motions: the leader of each, and the rates of all bodies for its unit rate.
    solution : Solution
        The instant.
    nearby : callable
        The motions near it, of which measures are taken.
    modes : dict
        What each contact and rough joint does, as of `Solution.mode`: those that stick are
        constraints, those that slide go on to; empty where the instant has none.
    status, doubts, notes
        As of `Inherited`: those of the instant, and what differences cannot show.
    """

    about: str
    t: float
    mass: Array
    damping: Array
    stiffness: Array
    drive: Array
    motions: tuple[FreeMotion, ...]
    solution: Solution = field(repr=False)
    nearby: Callable[[], Moving] = field(repr=False)
    modes: Mapping[str, str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        lock(self)

    @property
    def leaders(self) -> tuple[str, ...]:
        """The bodies whose motions y gives."""
        return tuple(motion.leader for motion in self.motions)

    @property
    def rates(self) -> Array:
        """(vx, vy, ω) of every body for unit rates of the leaders: (free, bodies, 3)."""
        return rates_of(self.solution.system, self.motions)

    @property
    def state_matrix(self) -> Array:
        """A (2·free, 2·free) of the first order: d/dt (y, ẏ) = A (y, ẏ) + (0, M⁻¹ F).

        Raises
        ------
        SolveError
            Where a free motion has no inertia, so that M has no inverse.
        """
        free = len(self.mass)
        if not massive(self.mass):
            raise SolveError(
                f"'{self.solution.mechanism.name}' has a free motion without inertia, so that it "
                "has no state matrix: use its mass, damping and stiffness, or modes"
            )
        below = -np.linalg.solve(self.mass, np.hstack([self.stiffness, self.damping]))
        return np.vstack([np.hstack([np.zeros((free, free)), np.eye(free)]), below])

    def state_matrices(
        self, measures: str | Measure | Sequence[str | Measure] = ()
    ) -> StateMatrices:
        """A, B, C, D of the first order: ẋ = A x + B u, z = C x + D u, of small changes x of
        what the leaders do and of its rates, u of inputs, z of measures.

        Parameters
        ----------
        measures : str, Measure, or a list of them
            The outputs, as of `Solution.measure`.

        Raises
        ------
        ModelError
            For a measure of what the mechanism has not.
        SolveError
            As `state_matrix`; and for measures at rest positions that drivers do not hold.

        Notes
        -----
        C is of differences of fourth order of the measures on Φ = 0 and Φ_q v = ν, with the forces
        of each instant: a part of 1e-10 of the measure's size.

        Examples
        --------
        >>> import mbody
        >>> machine = mbody.gallery.load("double_pendulum")
        >>> found = linearize(machine, at=mbody.equilibrium(machine)[0])
        >>> found.state_matrices("lower.angle - upper.angle").C.round(9) + 0.0
        array([[-1.,  1.,  0.,  0.]])
        """
        return state_matrices(self, measures)

    def data(self) -> dict[str, Any]:
        """The same as lists and texts, ready for JSON."""
        mechanism = self.solution.mechanism
        return {
            **heading(mechanism.name, "linearize", unit_symbols(mechanism.units), self),
            "about": self.about,
            "t": self.t,
            "mass": self.mass.tolist(),
            "damping": self.damping.tolist(),
            "stiffness": self.stiffness.tolist(),
            "drive": self.drive.tolist(),
            "motions": [motion.data() for motion in self.motions],
            **({"modes": dict(self.modes)} if self.modes else {}),
        }


def massive(mass: Array) -> bool:
    """Whether every free motion has inertia, whatever the units of the leaders."""
    size = np.sqrt(np.abs(np.diag(mass)))
    if not size.all():
        return False
    return bool(np.linalg.eigvalsh(mass / np.outer(size, size))[0] > MASSLESS)


def linearize(
    model: Mechanism | System,
    *,
    at: Equilibrium | Solution,
    free: str | Sequence[str] = (),
) -> Linearization:
    """Mass, damping and stiffness matrices of small motions (linearised equations of motion).

    M = N M Nᵀ, C = −N ∂f/∂v Nᵀ, K = −N ∂(f − Φ_qᵀ λ)/∂q Nᵀ with the rows of N the free motions:
    Φ_q Nᵀ = 0, each scaled to the unit rate of its leader.

    Parameters
    ----------
    model : Mechanism or System
        With free motions.
    at : Equilibrium or Solution
        A rest position of `equilibrium`, drivers holding what their laws say there; or the last
        instant of a motion, drivers following their laws.
    free : str or sequence of str, optional
        Drivers that are released.

    Returns
    -------
    Linearization
        M, C, K with the leaders in whose rates they are given, and the state matrix of the first
        order.

    Raises
    ------
    ModelError
        For a place that is none, or does not fit the mechanism; for a batch of designs.
    SolveError
        Where nothing is free, the position given as one of rest is none, or is singular in motion.

    Notes
    -----
    At rest ∂f/∂v and ∂f/∂q come from central differences of the loads, λ fixed: a part of 1e-11 of
    the greatest load. Loads that jump with the sign of a rate have no ∂f/∂v: a note says so.
    Where it moves, or is not balanced, −M⁻¹ K and −M⁻¹ C are differences of fourth order of the
    accelerations on Φ = 0 and Φ_q v = ν, with the angles of the leaders, or the ways that they
    slide, as coordinates; so C and K hold what rates and accelerations do too, and need not be
    symmetric. They hold for that instant: unless the motion is steady in these coordinates, their
    eigenvalues say nothing of stability.

    Examples
    --------
    >>> import mbody
    >>> machine = mbody.Mechanism("pendulum")
    >>> machine.add(mbody.Body("rod", mass=2.0, cg=(0.5, 0.0)))
    >>> machine.add(mbody.Revolute("O", "ground", "rod"))
    >>> machine.add(mbody.Gravity("gravity", y=-9.81))
    >>> found = linearize(machine, at=mbody.equilibrium(machine)[0])
    >>> found.leaders, round(float(found.mass[0, 0]), 9), round(float(found.stiffness[0, 0]), 9)
    (('rod',), 0.5, 9.81)
    """
    system = single_design("linearize", model, free)
    name = system.mechanism.name
    given, resting = _instant(at)
    if too_large(system):
        raise SolveError(
            f"linearize of '{name}': {system.rows} rows of {system.coordinates} coordinates are "
            "too many for dense matrices"
        )
    q, v = _state(system, given)
    t = float(given.t[-1])
    start = closed(system, t, {}, None, pose=np.append(q, np.zeros(3)))
    manifold = Manifold(system, start.work, t, _own_numbers(system, given))
    here = manifold.place(start.work.q[: system.coordinates, 0].copy())
    if here is None or manifold.apart(here.q, q) > FITS:
        raise ModelError(
            f"the instant that is given does not fit '{name}' at t = {t:.6g} "
            f"{system.mechanism.units.time}: its loops do not close there, or a load has no value; "
            "give a position of this mechanism"
        )
    held = held_modes(system, given, t, here.q, v)
    if held is not None:
        work = system.work()
        work.q[:], work.signal[:], work.time[:] = start.work.q, start.work.signal, t
        held.enter(work)
        free_ways = rank_of(np.vstack([here.rows, held.rows(work)[1]])).motions
        here = replace(here, motions=free_ways, drive=free_ways @ here.force)
    if not len(here.motions):
        why = "release a driver, with free"
        if held is not None and held.sticking:
            why = f"{held.words}; {why}"
        raise SolveError(f"nothing is free in '{name}', there are no small motions: {why}")
    motions = free_motions(system, np.append(here.q, np.zeros(3)), here.motions)
    top, mass = manifold.scale_of(here), manifold.mass(here.motions)
    balanced = here.size <= (RESTING if resting else BALANCED) * top
    branches = _branches(manifold, here)
    if resting and not (balanced or branches):
        raise SolveError(
            f"'{name}' does not rest where it is given: what drives it is {here.size / top:.2g} of "
            "the greatest load; look for rest positions of this very mechanism with equilibrium"
        )
    natural = float(np.sqrt(top / max(float(mass.max()), 1e-300))) or 1.0
    fast = max(float(np.abs(v / manifold.scale).max()), _driven(system, t, natural))
    ways = rates_of(system, motions).reshape(len(motions), -1) / manifold.scale
    basis = ways @ here.motions.T
    M = np.asarray(basis @ mass @ basis.T)
    rest = resting or (balanced and fast <= STILL * natural)
    notes: list[str] = []
    parts = leading(system, motions, ways)
    near = manifold, here, v, start.regularization, ways, parts, resting
    nearby = functools.partial(Moving, *near, held=held)
    if held is not None:
        found = nearby()
        C, K, drive = found.matrices(M)
        # drivers may go on: it is at rest where the leaders are
        slow = float(np.abs(found.rate).max()) <= STILL * natural
        rest = slow and float(np.abs(drive).max()) <= BALANCED * max(top, natural**2)
        C, K = (_rounded(part, top, by) for part, by in ((C, natural), (K, 1.0)))
    elif rest:
        C, K, notes = _at_rest(manifold, here, natural, top)
        C, K, drive = basis @ C @ basis.T, basis @ K @ basis.T, np.zeros(len(M))
    else:
        C, K, drive = nearby().matrices(M)
    notes += branches
    if held is None:
        notes += without_friction(system.mechanism, "linearize")
        notes += left_out(system.mechanism, "linearize")
    else:
        notes.append(held.note)
    about = "rest" if rest else "motion"
    said = inherited(given, notes=notes)
    names = {} if held is None else held.names
    return Linearization(about, t, M, C, K, drive, motions, given, nearby, names, **said)


def _rounded(matrix: Array, top: float, by: float) -> Array:
    """Without what is rounding of differences beside the loads."""
    return np.where(
        np.abs(matrix) > ROUNDING * max(top / by, float(np.abs(matrix).max())), matrix, 0.0
    )


def _instant(at: Any) -> tuple[Solution, bool]:
    """The instant, and whether it is one of rest, drivers holding."""
    if isinstance(at, Equilibrium):
        return at.solution, True
    if not isinstance(at, Solution):
        raise ModelError(
            f"at must be one rest position of equilibrium, or a Solution, not {type(at).__name__}"
        )
    if at.record.batch:
        raise ModelError("at is a batch of designs: give one, of system.design(n)")
    return at.take([len(at) - 1]), at.analysis == "statics"


def _own_numbers(system: System, given: Solution) -> Array | None:
    """Own states and inputs of an instant; None where it has none, or not found."""
    own = given.system.own_rows
    if (
        own.start == own.stop
        or own.stop - own.start != system.own_rows.stop - system.own_rows.start
    ):
        return None
    return np.asarray(given.record.table(own)[-1]) if given.has_forces else None


def _state(system: System, given: Solution) -> tuple[Array, Array]:
    """Positions and rates of the bodies of a system (coordinates,)."""
    names = [body.name for body in system.mechanism.bodies]
    if set(names) != {body.name for body in given.mechanism.bodies}:
        raise ModelError(
            f"'{given.mechanism.name}', of which an instant is given, has not the same bodies as "
            f"'{system.mechanism.name}'"
        )
    found = [given[name] for name in names]
    q = [part[-1] for body in found for part in (body.x, body.y, body.angle)]
    v = [part[-1] for body in found for part in (body.vx, body.vy, body.omega)]
    return np.array(q), np.array(v)


def _driven(system: System, t: float, natural: float) -> float:
    """How fast drivers move, or begin to, as a rate."""
    fast = 0.0
    timed = (d for d in system.leaders if not followed_states(d, system.mechanism, system.numbers))
    for driver in timed:
        _, rate, change = system.law_of(driver).derivatives(np.array([t]))
        unit = driver.unit(system.length)
        fast = max(fast, abs(float(rate[0])) / unit, abs(float(change[0])) / unit / natural)
    return fast


def _branches(manifold: Manifold, here: Place) -> list[str]:
    """A sentence where more is free than nearby."""
    beside = [manifold.moved(here, BESIDE * way) for way in here.motions]
    if all(p is None or len(p.motions) >= len(here.motions) for p in beside):
        return []
    return [
        "singular position: more is free here, to first order, than nearby; branches of the "
        "motion meet, and linear equations hold on none of them"
    ]


def _at_rest(
    manifold: Manifold, here: Place, natural: float, top: float
) -> tuple[Array, Array, list[str]]:
    """C and K along the orthonormal free motions, and sentences."""
    K = manifold.stiffness(here)
    u, sizes, vt = np.linalg.svd(K)
    # what is rounding beside the loads is none
    sizes[sizes <= ZERO * max(top, float(np.abs(K).max()))] = 0.0
    K = K if sizes.all() else (u * sizes) @ vt
    C, jump = np.zeros_like(K), 0.0
    for n, way in enumerate(here.motions):
        rate = SLOW * natural * manifold.scale * way
        f = [
            here.motions @ (manifold.force(here.q, k * rate) - manifold.force(here.q, -k * rate))
            for k in (1.0, 2.0, 4.0)
        ]
        one, two, four = (part / (2.0 * k * SLOW * natural) for part, k in zip(f, (1, 2, 4)))
        # c + J/h + q h at steps h, 2h and 4h: without what jumps, and what is square
        C[:, n] = 2.0 * one - 5.0 * two + 2.0 * four
        parts = 2.0 * (one - two) - (two - four)
        jump = max(jump, SLOW * natural * float(np.abs(parts).max()) / 0.75)
    notes = []
    if jump > JUMP * top:
        notes.append(
            "loads jump where rates change their sign, as friction and valves do: the jump is left "
            "out of the damping"
        )
    return C, K, notes
