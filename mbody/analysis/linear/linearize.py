"""`linearize`: the linear equations of small motions about an equilibrium, or about a motion."""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Protocol

import numpy as np

from mbody.analysis.contact.unilateral import has_modes
from mbody.analysis.dynamics.integration import Integration
from mbody.analysis.dynamics.integrators import (
    REFINEMENTS,
    auxiliary_sizes,
    natural_size,
    stepping,
)
from mbody.analysis.dynamics.interruptions import without_hold
from mbody.analysis.equilibria.equilibrium import Equilibrium
from mbody.analysis.freedom.mobility import (
    FreeMotion,
    free_motions,
    leading,
    rates_of,
    released,
)
from mbody.analysis.position.assembly_analysis import (
    as_system,
    closed,
    each_design,
    raise_user_error,
)
from mbody.analysis.position.tangent_space import Array, Manifold, Place, massive
from mbody.core import tolerances as tol
from mbody.core.presentation import Presented
from mbody.errors import ModelError, SolveError
from mbody.kernels.layout import Work
from mbody.kernels.loop_closure import laws_of_time
from mbody.kernels.state_derivative import initial_derivative
from mbody.kernels.step_state import TIME
from mbody.model.mechanism import Mechanism
from mbody.model.model_notes import left_out, without_friction
from mbody.model.simulation import Measure, measure_named
from mbody.solution.declared_result import Value
from mbody.solution.doubts import Doubt, Inherited, inherited
from mbody.solution.energy import causes
from mbody.solution.histories import Record
from mbody.solution.measures import check_measure, measured
from mbody.solution.solution import IntegrationSettings, Solution
from mbody.system.formula_steps import driver_inputs
from mbody.system.rank import close_rows, dense, dense_rates, pseudo_inverse, rank_of
from mbody.system.system import System, driver_states, too_large

# -- Contact modes of an instant as constraints ------------------------------------------------

#: What is said of each mode.
WORDS = {
    "stick": "sticks",
    "roll": "rolls",
    "slip+": "slides",
    "slip-": "slides",
    "open": "is open",
}


class ActiveContacts:
    """The modes of an instant, as `simulate` decides them, and what they do to motions beside it:
    what is closed and what sticks is a constraint, what slides goes on in its direction.

    `names`: Mode of every contact and frictional joint.
    """

    def __init__(self, system: System, given: Solution, t: float, q: Array, v: Array) -> None:
        settings = IntegrationSettings("dop853", tol.RTOL_LINEARIZED, tol.RTOL_LINEARIZED)
        engine = Integration(system, given, settings)
        engine.begin(t, q, v, t + system.mechanism.units.second)
        assert engine.active is not None
        status = engine.active.begin()
        if status or any(event.name == "impact" for event in engine.occurred):
            unit = system.mechanism.units.time
            raise SolveError(
                f"linearize of '{system.mechanism.name}': something strikes at t = {t:.6g} {unit}, "
                "so that there are no linear equations; take an instant beside it"
            )
        self.names = engine.named_modes
        self.uni, self._work = engine.active.uni, engine.work
        self._on = np.flatnonzero(engine.active.on)
        self._unit = np.where(self.uni.angular, 1.0, 1.0 / system.length)[self._on]
        self._scale = system.coordinate_units

    @property
    def words(self) -> str:
        """Contact modes as a phrase, "name mode, …"."""
        return ", ".join(f"{name} {WORDS[mode]}" for name, mode in self.names.items())

    @property
    def note(self) -> str:
        """The state that small motions are about."""
        return f"about a state in which {self.words}"

    @property
    def sticking(self) -> bool:
        """Whether anything sticks."""
        return bool({"stick", "roll"} & set(self.names.values()))

    def enter(self, work: Work) -> None:
        """Set the modes in a workspace."""
        own = self._work
        work.on[:], work.pad[:], work.anchor[:] = own.on, own.pad, own.anchor
        work.regularization_weight[:] = own.regularization_weight
        work.slip_sign[:], work.par[:] = own.slip_sign, own.par

    def rows(self, work: Work) -> tuple[Array, Array, Array]:
        """Φ, Φ_q without units and ν of the rows that are on, at the position in a workspace into
        which the modes were entered.
        """
        work.v[:] = 0.0
        found = self.uni.read(work)
        phi = found.value[self._on] - work.anchor[self._on, 0]
        block = self._unit[:, None] * found.block[self._on] * self._scale
        return self._unit * phi, block, -self._unit * found.rate[self._on]


def active_contacts(
    system: System, given: Solution, t: float, q: Array, v: Array
) -> ActiveContacts | None:
    """The modes at the last instant of a motion in which they were decided; None of others."""
    if not given.modes or given.stepped is not None or not has_modes(system):
        return None
    if not math.isfinite(float(np.abs(q).max(initial=0.0))):
        return None
    return ActiveContacts(system, given, t, q, v)


# -- Accelerations near an instant of a motion, and their derivatives, by what the leaders do --

#: Steps of inputs and auxiliary states are lengthened by so much at most.
FARTHEST = 1e6


def _difference(function: Callable[[Array], Array], steps: Array) -> Array:
    """∂f/∂x at 0 by central differences of fourth order: (rows, steps)."""
    columns = []
    for step, offset in zip(steps, np.diag(steps), strict=True):
        inner = function(offset) - function(-offset)
        outer = function(2.0 * offset) - function(-2.0 * offset)
        columns.append((8.0 * inner - outer) / (12.0 * step))
    return np.array(columns).T


class Moving:
    """Accelerations of the leaders at coordinates y and rates w of theirs near those of an instant:
    with P their parts of the coordinates y = P (q − q₀) and w = P v, exactly. `still`: drivers hold
    their values. `contacts`: what is closed, sticks and slides.
    """

    def __init__(
        self,
        manifold: Manifold,
        here: Place,
        v: Array,
        regularization: float,
        directions: Array,
        parts: Array,
        still: bool = False,
        contacts: ActiveContacts | None = None,
    ) -> None:
        self.manifold, self.here, self.v, self.regularization = manifold, here, v, regularization
        self.system, self.directions, self.parts = manifold.system, directions, parts
        self.t = float(manifold.time[0])
        # drivers move here, unless they hold: their rates are those of their laws
        self.work = self.system.work()
        self.work.time[:] = self.t
        laws_of_time(self.system.runtime(), self.work)
        L, system = self.system.layout, self.system
        rows = np.append(system.input_rows, L.driver_row if still else []).astype(np.int64)
        self.runtime = without_hold(system.runtime(), {str(row): int(row) for row in rows})
        if still:
            for more in (1, 2):
                self.work.signal[L.driver_row + more] = 0.0
        self.whole = system.work(masses=True)
        self.whole.signal[:] = self.work.signal
        self.contacts = contacts
        if contacts is not None:
            for work in (self.work, self.whole):
                contacts.enter(work)
        self.memory = stepping(system.state_count, len(causes(system)), regularization)
        own = self.work.signal[system.input_rows, 0]
        self.own = (
            np.append(system.first_states[:, 0], own) if manifold.own is None else manifold.own
        )
        inputs = [natural_size(system, one.dimension) for one in system.mechanism.inputs]
        self.own_sizes = np.append(auxiliary_sizes(system), inputs)
        self.own = self.own[: len(self.own_sizes)]

    def matrices(self, mass: Array) -> tuple[Array, Array, Array]:
        """C, K and what drives the leaders; mass (free, free) is theirs."""
        by_coordinate, by_rate = self.derivatives(self.along)
        return -mass @ by_rate, -mass @ by_coordinate, mass @ self._first

    def derivatives(self, function: Callable[[Array, Array], Array]) -> tuple[Array, Array]:
        """∂f/∂y and ∂f/∂w (rows, free) of a function of coordinates and rates of the leaders."""
        still, rate = np.zeros(len(self.parts)), self.rate
        # where a body moves fast beside its leader, the leader's step is short
        steps = tol.DIFFERENCE_STEP_FOURTH_ORDER / np.abs(self.directions).max(axis=1)
        pull = np.abs(self._first @ self.directions).max(initial=0.0)
        v = self.v / self.manifold.scale
        velocity_scale = max(float(np.abs(v).max()), float(np.sqrt(pull))) or 1.0
        by_coordinate = _difference(lambda y: function(y, rate), steps)
        return by_coordinate, _difference(
            lambda w: function(still, rate + w), velocity_scale * steps
        )

    @functools.cached_property
    def rate(self) -> Array:
        """Rates of the leaders."""
        return np.asarray(self.parts @ (self.v / self.manifold.scale))

    @functools.cached_property
    def _first(self) -> Array:
        """Accelerations of the leaders."""
        return self.along(np.zeros(len(self.parts)), self.rate)

    def along(self, y: Array, w: Array) -> Array:
        """Accelerations of the leaders at their coordinates and rates."""
        return self.instant(y, w)[0]

    def instant(
        self, y: Array, w: Array, own: Array | None = None
    ) -> tuple[Array, Array, Solution]:
        """Accelerations of the leaders at their coordinates and rates, rates of auxiliary states,
        and the instant; `own`: auxiliary states, then inputs, by default those of the instant.
        """
        n, scale, L, S = self.system.coordinates, self.manifold.scale, self.runtime, self.memory
        q, G = self.position(y)
        nu = dense_rates(self.system, self.work)
        if self.contacts is not None:
            nu = np.append(nu, self.contacts.rows(self.work)[2])
        # rows that depend on others, as of redundant joints, have no say
        v = scale * (pseudo_inverse(np.vstack([G, self.parts])) @ np.append(nu, w))
        given = self.own if own is None else own
        S.y[:n], S.y[n : 2 * n], S.y[2 * n :] = q, v, given[: L.owns]
        self.whole.signal[self.system.input_rows, 0] = given[L.owns :]
        S.state[TIME] = self.t
        record = np.empty((self.system.record_rows, 1))
        initial_derivative(L, self.whole, S, REFINEMENTS, record)
        raise_user_error(self.system)
        run = Solution(
            self.system,
            "simulate",
            np.array([self.t]),
            Record([record[None]], 1, batch=False),
            None,
            regularization=self.regularization,
        )
        return self.parts @ (record[2 * n : 3 * n, 0] / scale), S.K[0, 2 * n :].copy(), run

    def by_own(self, function: Callable[[Array], Array]) -> Array:
        """∂f/∂(auxiliary states, inputs) (rows, …) of a function of them."""
        first = function(self.own)
        size, columns = float(np.abs(first).max(initial=0.0)), []
        for n, value in enumerate(self.own):
            step, offset = (
                tol.DIFFERENCE_STEP_FOURTH_ORDER * max(self.own_sizes[n], abs(float(value))),
                np.zeros(len(self.own)),
            )
            offset[n] = step
            derivative = float(np.abs(function(self.own + offset) - first).max(initial=0.0)) / step
            # where what it changes is small beside the others, a longer step is more exact
            offset[n] = (
                max(
                    step, min(tol.DIFFERENCE_STEP_FOURTH_ORDER * size / derivative, FARTHEST * step)
                )
                if derivative
                else step
            )
            inner = function(self.own + offset) - function(self.own - offset)
            outer = function(self.own + 2.0 * offset) - function(self.own - 2.0 * offset)
            columns.append((8.0 * inner - outer) / (12.0 * offset[n]))
        return np.array(columns).reshape(len(self.own), -1).T

    def position(self, y: Array) -> tuple[Array, Array]:
        """The closed position (coordinates,) at coordinates of the leaders, and Φ_q there."""
        scale, x = self.manifold.scale, self.here.q / self.manifold.scale

        def rows(x: Array) -> tuple[Array, Array]:
            phi, G = dense(self.system, self.work, x)
            if self.contacts is None:
                return phi, G
            more = self.contacts.rows(self.work)
            return np.append(phi, more[0]), np.vstack([G, more[1]])

        found = close_rows(rows, x + y @ self.directions, (self.parts, self.parts @ x + y))
        if not found.good:
            raise SolveError(
                f"the position of '{self.system.mechanism.name}' at t = {self.t:.6g} "
                f"{self.system.mechanism.units.time} is singular: branches of its motion meet, so "
                "that it has no linear equations; take an instant beside it"
            )
        return scale * found.x, found.G


# -- State matrices of small changes, with inputs and measures: ẋ = A x + B u, z = C x + D u ---


class Linear(Protocol):
    """Interface of linear equations of second order, M q̈ + C q̇ + K q = 0."""

    @property
    def state_matrix(self) -> Array:
        """A (2·free, 2·free)."""

    @property
    def motions(self) -> tuple[FreeMotion, ...]:
        """The free motions."""

    def nearby(self) -> Moving:
        """The motions near the instant."""

    @property
    def status(self) -> str:
        """Status of the result."""

    @property
    def doubts(self) -> tuple[Doubt, ...]:
        """Doubts about the result."""

    @property
    def notes(self) -> tuple[str, ...]:
        """Notes on the result."""


@dataclass(frozen=True, eq=False)
class StateMatrices(Inherited):
    """The matrices of small changes of the first order, ẋ = A x + B u, z = C x + D u.

    `A` (2·free + auxiliary states,) squared: Units of a rate of the state by units of the state.
    `B` (2·free + auxiliary states, inputs)
    `C` (outputs, 2·free + auxiliary states): Units of the measure by units of the state.
    `D` (outputs, inputs)
    `states`: What each number of x is: of the leader of each free motion its ``"angle"`` [rad], or
      ``"way"`` where it slides [length], then their rates, ``"omega"`` or ``"rate"``; then the
      mechanism's auxiliary states.
    `inputs`, `outputs`: Names of the inputs; the measures.
    `status`, `doubts`, `notes`: As of `Inherited`.
    """

    A: Array
    B: Array
    C: Array
    D: Array
    states: tuple[str, ...]
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]


def state_matrices(
    linear: Linear, measures: str | Measure | Sequence[str | Measure]
) -> StateMatrices:
    """A, B, C and D of linear equations, with inputs u and measures as outputs z."""
    wanted = [measures] if isinstance(measures, str | Measure) else list(measures)
    nearby, motions = linear.nearby(), linear.motions
    machine, free = nearby.system.mechanism, len(motions)
    owns, inputs = len(machine.states), [one.name for one in machine.inputs]
    for name, driver in driver_inputs(machine, nearby.system.numbers).items():
        raise ModelError(
            f"the input '{name}' is followed by driver '{driver}': the motion depends on its rate "
            "and its acceleration too, so that B and D do not describe it; make it a parameter, or "
            "let the driver follow states whose rates have the input",
            name,
        )
    observed = [measure_named(machine.measures, one) for one in wanted]
    for one in observed:
        check_measure(machine, one)

    def values(y: Array, w: Array, own: Array | None = None) -> Array:
        a, rates, run = nearby.instant(y, w, own)
        read = [measured(run, one)[0][-1] for one in observed]
        return np.concatenate([a, rates, np.array(read, dtype=float).reshape(-1)])

    A = np.zeros((2 * free + owns,) * 2)
    A[: 2 * free, : 2 * free] = linear.state_matrix
    B = np.zeros((len(A), len(inputs)))
    C, D = np.zeros((len(observed), len(A))), np.zeros((len(observed), len(inputs)))
    if observed or owns:
        moved = np.hstack(nearby.derivatives(values))
        A[2 * free :, : 2 * free] = moved[free : free + owns]
        C[:, : 2 * free] = moved[free + owns :]
    if owns or inputs:
        derivative = nearby.by_own(lambda own: values(np.zeros(free), nearby.rate, own))
        A[free : 2 * free, 2 * free :] = derivative[:free, :owns]
        A[2 * free :, 2 * free :] = derivative[free : free + owns, :owns]
        B[free : 2 * free] = derivative[:free, owns:]
        B[2 * free :] = derivative[free : free + owns, owns:]
        C[:, 2 * free :], D[:] = derivative[free + owns :, :owns], derivative[free + owns :, owns:]
    names = [(m.leader, ("angle", "omega") if m.turns else ("way", "rate")) for m in motions]
    states = [f"{leader}.{keys[k]}" for k in range(2) for leader, keys in names]
    states += [one.name for one in machine.states]
    texts = tuple(one if isinstance(one, str) else one.of for one in wanted)
    return StateMatrices(A, B, C, D, tuple(states), tuple(inputs), texts, **inherited(linear))


@dataclass(frozen=True, eq=False)
class Linearization(Inherited, Presented):
    """The linear equations of small motions: M ÿ + C ẏ + K y = F.

    y are small changes of what the leaders of the free motions do; all bodies follow as `motions`
    say.

    `about`: ``"rest"``, or ``"motion"`` where it moves or begins to.
    `t`: Time.
    `mass`, `damping`, `stiffness` (free, free): M, C and K: forces or torques on the leaders, for
      accelerations, rates and displacements of the leaders; these turn or slide as their motions
      say, [rad] or [length].
    `drive` (free,): F, what drives the leaders where y = 0: zero at rest.
    `motions`: The free motions: the leader of each, and the rates of all bodies for its unit rate.
    `solution`: The instant.
    `nearby`: The motions near it, of which measures are taken.
    `modes`: What each contact and frictional joint does, as of `Solution.mode`: those that stick
      are constraints, those that slide go on to; empty where the instant has none.
    `status`, `doubts`, `notes`: As of `Inherited`: those of the instant, and what differences
      cannot show.
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

    analysis_name = "linearize"
    declared = (
        "about t mass damping stiffness drive motions",
        Value("modes", value=lambda found: found.modes or ...),
    )

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
            As `state_matrix`; and for measures at equilibria that drivers do not hold.

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


@each_design
def linearize(
    model: Mechanism | System, *, at: Equilibrium | Solution, free: str | Sequence[str] = ()
) -> Linearization:
    """Mass, damping and stiffness matrices of small motions (linearised equations of motion).

    M = N M Nᵀ, C = −N ∂f/∂v Nᵀ, K = −N ∂(f − Φ_qᵀ λ)/∂q Nᵀ with the rows of N the free motions:
    Φ_q Nᵀ = 0, each scaled to the unit rate of its leader.

    Parameters
    ----------
    model : Mechanism or System
        With free motions.
    at : Equilibrium or Solution
        An equilibrium of `equilibrium`, drivers holding what their laws say there; or the last
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
        For a place that is none, or does not fit the mechanism.
    SolveError
        Where nothing is free, the position given as an equilibrium is none, or is singular in
        motion.

    Notes
    -----
    At rest ∂f/∂v and ∂f/∂q come from central differences of the loads, λ fixed: a part of 1e-11 of
    the greatest load. Loads that jump with the sign of a rate have no ∂f/∂v: a note says so.
    Where it moves, or is not balanced, −M⁻¹ K and −M⁻¹ C are differences of fourth order of the
    accelerations on Φ = 0 and Φ_q v = ν, with the angles of the leaders, or the distances that they
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
    system = released(as_system(model), free)
    name = system.mechanism.name
    given, given_equilibrium = _instant(at)
    if too_large(system):
        raise SolveError(
            f"linearize of '{name}': {system.rows} rows of {system.coordinates} coordinates are "
            "too many for dense matrices"
        )
    q, v = _state(system, given)
    t = float(given.t[-1])
    start = closed(system, t, {}, None, pose=np.append(q, np.zeros(3)))
    own, weighted = _own_numbers(system, given), not has_modes(system)
    manifold = Manifold(system, start.work, t, own, weighted=weighted)
    here = manifold.place(start.work.q[: system.coordinates, 0].copy())
    if here is None or manifold.distance(here.q, q) > tol.LOOP_OPEN_FIXED:
        raise ModelError(
            f"the instant that is given does not fit '{name}' at t = {t:.6g} "
            f"{system.mechanism.units.time}: its loops do not close there, or a load has no value; "
            "give a position of this mechanism"
        )
    contacts = active_contacts(system, given, t, here.q, v)
    if contacts is not None:
        work = system.work()
        work.q[:], work.signal[:], work.time[:] = start.work.q, start.work.signal, t
        contacts.enter(work)
        free_directions = rank_of(
            np.vstack([here.rows, contacts.rows(work)[1]]), parts=system.coordinate_part
        ).motions
        here = replace(here, motions=free_directions, residual=free_directions @ here.force)
    if not len(here.motions):
        why = "release a driver, with free"
        if contacts is not None and contacts.sticking:
            why = f"{contacts.words}; {why}"
        raise SolveError(f"nothing is free in '{name}', there are no small motions: {why}")
    motions = free_motions(system, np.append(here.q, np.zeros(3)), here.motions)
    top, mass = manifold.scale_of(here), manifold.mass(here.motions)
    balanced = (
        here.size
        <= (tol.EQUILIBRIUM_RESTING if given_equilibrium else tol.EQUILIBRIUM_BALANCED_GIVEN) * top
    )
    branches = _branches(manifold, here)
    if given_equilibrium and not (balanced or branches):
        raise SolveError(
            f"'{name}' does not rest where it is given: what drives it is {here.size / top:.2g} of "
            "the greatest load; look for rest positions of this very mechanism with equilibrium"
        )
    natural = float(np.sqrt(top / max(float(mass.max()), tol.TINY))) or 1.0
    fast = max(float(np.abs(v / manifold.scale).max()), _driven(system, t, natural))
    directions = rates_of(system, motions).reshape(len(motions), -1) / manifold.scale
    basis = directions @ here.motions.T
    # forces and masses of each leader as they are
    units = 1.0 / manifold.weight[[system.bodies[motion.leader] for motion in motions], None]
    M = units * np.asarray(basis @ mass @ basis.T)
    about_equilibrium = given_equilibrium or (balanced and fast <= tol.RATE_NONE * natural)
    notes: list[str] = []
    parts = leading(system, motions, directions)
    common = manifold, here, v, start.regularization, directions, parts, given_equilibrium
    nearby = functools.partial(Moving, *common, contacts=contacts)
    if contacts is not None:
        found = nearby()
        C, K, drive = found.matrices(M)
        # drivers may go on: it is at rest where the leaders are
        leaders_stationary = float(np.abs(found.rate).max()) <= tol.RATE_NONE * natural
        about_equilibrium = leaders_stationary and float(
            np.abs(drive).max()
        ) <= tol.EQUILIBRIUM_BALANCED_GIVEN * max(top, natural**2)
        C, K = (_rounded(part, top, by) for part, by in ((C, natural), (K, 1.0)))
    elif about_equilibrium:
        C, K, notes = _about_equilibrium(manifold, here, natural, top)
        C, K = (units * np.asarray(basis @ part @ basis.T) for part in (C, K))
        drive = np.zeros(len(M))
    else:
        C, K, drive = nearby().matrices(M)
    notes += branches
    if contacts is None:
        notes += without_friction(system.mechanism, "linearize")
        notes += left_out(system.mechanism, "linearize")
    else:
        notes.append(contacts.note)
    about = "rest" if about_equilibrium else "motion"
    said = inherited(given, notes=notes)
    names = {} if contacts is None else contacts.names
    return Linearization(about, t, M, C, K, drive, motions, given, nearby, names, **said)


def _rounded(matrix: Array, top: float, by: float) -> Array:
    """Without what is rounding of differences beside the loads."""
    return np.where(
        np.abs(matrix) > tol.DIFFERENCE_ROUNDING * max(top / by, float(np.abs(matrix).max())),
        matrix,
        0.0,
    )


def _instant(at: Any) -> tuple[Solution, bool]:
    """The instant, and whether it is an equilibrium, drivers holding."""
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
    """Auxiliary states and inputs of an instant; None where it has none, or not found."""
    own = given.system.auxiliary_rows
    if (
        own.start == own.stop
        or own.stop - own.start != system.auxiliary_rows.stop - system.auxiliary_rows.start
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
    timed = (
        d
        for d in system.independent_drivers
        if not driver_states(d, system.mechanism, system.numbers)
    )
    for driver in timed:
        _, rate, change = system.law_of(driver).derivatives(np.array([t]))
        unit = driver.unit(system.length)
        fast = max(fast, abs(float(rate[0])) / unit, abs(float(change[0])) / unit / natural)
    return fast


def _branches(manifold: Manifold, here: Place) -> list[str]:
    """A sentence where more is free than nearby."""
    adjacent = [manifold.moved(here, tol.POSITION_BESIDE * direction) for direction in here.motions]
    if all(p is None or len(p.motions) >= len(here.motions) for p in adjacent):
        return []
    return [
        "singular position: more is free here, to first order, than nearby; branches of the "
        "motion meet, and linear equations hold on none of them"
    ]


def _about_equilibrium(
    manifold: Manifold, here: Place, natural: float, top: float
) -> tuple[Array, Array, list[str]]:
    """C and K along the orthonormal free motions, and sentences."""
    K = manifold.stiffness(here)
    u, sizes, vt = np.linalg.svd(K)
    # what is rounding beside the loads is none
    sizes[sizes <= tol.STIFFNESS_ZERO * max(top, float(np.abs(K).max()))] = 0.0
    K = K if sizes.all() else (u * sizes) @ vt
    C, jump = np.zeros_like(K), 0.0
    for n, direction in enumerate(here.motions):
        rate = tol.DIFFERENCE_STEP_DAMPING * natural * manifold.scale * direction
        f = [
            here.motions @ (manifold.force(here.q, k * rate) - manifold.force(here.q, -k * rate))
            for k in (1.0, 2.0, 4.0)
        ]
        one, two, four = (
            part / (2.0 * k * tol.DIFFERENCE_STEP_DAMPING * natural)
            for part, k in zip(f, (1, 2, 4))
        )
        # c + J/h + q h at steps h, 2h and 4h: without what jumps, and what is square
        C[:, n] = 2.0 * one - 5.0 * two + 2.0 * four
        parts = 2.0 * (one - two) - (two - four)
        jump = max(jump, tol.DIFFERENCE_STEP_DAMPING * natural * float(np.abs(parts).max()) / 0.75)
    notes = []
    if jump > tol.LOAD_JUMP_RATE * top:
        notes.append(
            "loads jump where rates change their sign, as friction and valves do: the jump is left "
            "out of the damping"
        )
    return C, K, notes
