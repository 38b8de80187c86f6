"""Integrators of `simulate` by name: each a kernel with its coefficients and its own memory."""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any, Protocol

import numpy as np

from mbody.analysis.contact.unilateral import Unilateral
from mbody.core import tolerances as tol
from mbody.errors import ModelError, SolveError
from mbody.kernels.complementarity import ContactProblem, problem_memory
from mbody.kernels.contact_impacts import STILL, impact_memory, strike_contacts, tangent_responses
from mbody.kernels.contact_modes import FORWARD, NONE, OPEN, modes_memory
from mbody.kernels.fixed_step import FixedStep
from mbody.kernels.layout import Layout, Work
from mbody.kernels.methods import EVEN, EXPLICIT, IMPLICIT, Methods
from mbody.kernels.mode_problem import ALL_ROWS, ContactDecision, decision_memory
from mbody.kernels.radau import Radau
from mbody.kernels.runge_kutta import FIRST, SECOND, Explicit, order_5, order_8, radau_5, suzuki_4
from mbody.kernels.step_state import (
    EVALUATIONS,
    JACOBIANS,
    NEAR_SINGULAR_STEPS,
    PROGRESS,
    REJECTED,
    STEPS,
    Stepping,
    Tolerances,
)
from mbody.model.element import STEADY
from mbody.model.states import measuring_forces
from mbody.quantities.units import Dimension
from mbody.solution.solution import IntegrationSettings, Solution
from mbody.system.system import System

# -- Scales of the coordinates, and the length of the first step -------------------------------
# Of one motion, or of many along a first axis.

#: Corrections by the residual where masses are stood in for, or rows are redundant, and of what is
#: kept.
REFINEMENTS = 2


def coordinate_sizes(system: System, v: np.ndarray, a: np.ndarray) -> np.ndarray:
    """Sizes of coordinates and rates, to which absolute errors are relative: (…, 2·coordinates).
    `v`, `a` (…, coordinates). The rates of each connected part have their own.
    """
    unit, part = system.coordinate_units, system.coordinate_part
    own = np.maximum(np.abs(v / unit), np.sqrt(np.abs(a / unit)))
    rate = np.zeros_like(own)
    np.maximum.at(np.moveaxis(rate, -1, 0), part, np.moveaxis(own, -1, 0))
    whole = rate.max(axis=-1, initial=0.0)[..., None]
    whole = np.where(whole == 0.0, 1.0 / system.mechanism.units.second, whole)
    # what hardly moves at the start may be moved by the others
    rate = np.where(rate > tol.RATE_NONE_MOTION * whole, rate, whole)[..., part]
    return np.concatenate([np.broadcast_to(unit, v.shape), rate * unit], axis=-1)


def first_step(
    settings: IntegrationSettings,
    y: np.ndarray,
    derivative: np.ndarray,
    scale: np.ndarray,
    whole: float,
) -> np.ndarray:
    """A rough first step (Hairer, Nørsett, Wanner, II.4): (…,). `y`, `derivative`, `scale` (…,
    2·coordinates).
    """
    size = settings.atol * scale + settings.rtol * np.abs(y)
    away = np.where(np.abs(y) > tol.STEP_FIRST_ORIGIN * scale, y, 0.0)
    d0, d1 = (np.sqrt(np.mean((part / size) ** 2, axis=-1)) for part in (away, derivative))
    with np.errstate(divide="ignore", invalid="ignore"):
        step = np.where(
            (d0 > tol.STEP_FIRST_SILENT) & (whole * d1 > tol.STEP_FIRST_SILENT),
            0.01 * d0 / d1,
            tol.STEP_FIRST_LITTLE * whole,
        )
    return np.minimum(step, 0.1 * whole)


# -- Auxiliary states in a motion: start, scales, methods that integrate them ------------------


#: Methods whose steps take no auxiliary states.
WITHOUT = ("rattle", "rattle4")
#: Newton iterations towards a steady start.
ITERATIONS = 30
#: Where it begins, in sizes of the states: where a rate is flat Newton's method cannot.
TRIED = (0.0, 1.0, -1.0, 10.0, -10.0, 0.1)


class Evaluated(Protocol):
    """A motion at its first instant, whose derivative can be evaluated."""

    system: System
    start: Solution
    y: Array
    K: Array

    def evaluate(self) -> bool:
        """Derivative at the state; whether the loops close there."""


def refuse_auxiliary_states(system: System, method: str) -> None:
    """Refuse auxiliary states where they cannot be integrated."""
    machine = system.mechanism
    if method == "singular start" and machine.controllers:
        name = machine.controllers[0].name
        raise ModelError(
            f"the motion begins at a singular position, where there are no accelerations yet for "
            f"controllers such as '{name}' to sample: begin a little beside it",
            name,
        )
    if method == "singular start" and system.measures_forces:
        name = measuring_forces(machine, states=True)[0]
        raise ModelError(
            "the motion begins at a singular position, where there are no accelerations yet that "
            f"'{name}' measures: begin a little beside it",
            name,
        )
    if method in WITHOUT:
        system.refuse_loops(f"the method '{method}' knows")
    if not machine.states or method not in WITHOUT:
        return
    name = machine.states[0].name
    raise ModelError(
        f"the method '{method}' is of positions and velocities, whose steps it takes in two "
        f"symmetric halves, and has none for equations of first order such as that of '{name}': "
        "take 'generalized-alpha' for steps of one length, or dop853, dopri5, radau5",
        name,
    )


def first_auxiliary_states(system: System, start: Solution) -> Array:
    """Auxiliary states at the beginning: as a motion left them that is continued, else as
    described.
    """
    owns = system.layout.owns
    if owns and start.analysis == "simulate" and start.system.layout.owns == owns:
        return np.asarray(start.record.table(system.auxiliary_rows)[-1][:owns])
    return system.first_states[:, 0].copy()


def auxiliary_sizes(system: System) -> Array:
    """Sizes of auxiliary states, to which absolute errors are relative: as given, else the
    magnitude of the start, else one: of lengths, masses and times the model's own, and a second.
    """
    found = np.ones(system.layout.owns)
    for n, state in enumerate(system.mechanism.states):
        size = system.values.get(f"{state.name}.size", state.size)
        start = np.max(np.abs(system.first_states[n]), initial=0.0)
        if size is not None:
            found[n] = float(np.max(size))
        elif start > 0.0:
            found[n] = float(start)
        else:
            found[n] = natural_size(system, state.dimension)
    return found


def natural_size(system: System, dimension: Dimension | None, rate: float = 0.0) -> float:
    """One of lengths, masses and times of the model's own, where it has no rate a second; 1 without
    a dimension.
    """
    if dimension is None:
        return 1.0
    size = system.length ** float(dimension.length) * system.heaviest ** float(dimension.mass)
    time = 1.0 / rate if rate else system.mechanism.units.second
    return float(size * time ** float(dimension.time))


def find_steady(motion: Evaluated) -> bool:
    """Set the auxiliary states that begin where they are steady, by Newton's method on their rates;
    whether there are any. A motion that is continued keeps its own.
    """
    states = motion.system.mechanism.states
    wanted = [n for n, one in enumerate(states) if one.start == STEADY]
    if not wanted or motion.start.analysis == "simulate":
        return False
    rows = 2 * motion.system.coordinates + np.array(wanted)
    z, sizes = motion.y[rows], auxiliary_sizes(motion.system)[wanted]

    def rates(at: Array) -> Array:
        motion.y[rows] = at
        motion.evaluate()
        return motion.K[0, rows].copy()

    found = rates(z)
    first = np.abs(found).max()
    for part in TRIED:
        steady = _newton(rates, z + part * sizes, sizes, tol.STEP_STEADY_START * first)
        if steady is not None:
            motion.y[rows] = steady
            return True
    names = ", ".join(f"'{states[n].name}'" for n in wanted)
    raise SolveError(
        f"no steady start is found for {names}: the rates do not vanish near the values tried; "
        "give start a number",
        states[wanted[0]].name,
    )


def _newton(rates: Callable[[Array], Array], z: Array, sizes: Array, small: float) -> Array | None:
    """State at which rates vanish, by Newton's method from z; None where it does not converge."""
    found = rates(z)
    for _ in range(ITERATIONS):
        if np.abs(found).max() <= small:
            return z
        derivatives = np.empty((len(z), len(z)))
        for n in range(len(z)):
            moved = z.copy()
            moved[n] += tol.DIFFERENCE_STEP_FORWARD * max(abs(z[n]), sizes[n])
            derivatives[:, n] = (rates(moved) - found) / (moved[n] - z[n])
        if not np.isfinite(derivatives).all() or np.linalg.matrix_rank(derivatives) < len(z):
            return None
        z = z - np.linalg.solve(derivatives, found)
        found = rates(z)
    return None


def unresolved_states(run: Solution) -> tuple[str, ...]:
    """Notes on auxiliary states that stay far below the size by which their error is controlled."""
    notes = []
    system, owns = run.system, run.system.layout.owns
    if not owns or not len(run):
        return ()
    records = run.record.table(system.auxiliary_rows)
    for n, state in enumerate(system.mechanism.states):
        given = state.size is not None
        most, size = float(np.abs(records[:, n]).max()), float(auxiliary_sizes(system)[n])
        if not given and 0.0 < most < tol.STATE_SIZE_SMALL * size:
            unit = "" if state.dimension is None else system.mechanism.units.of(state.dimension)
            notes.append(
                f"state '{state.name}' stays below {most:.3g} {unit}".rstrip()
                + f", its error is controlled as a part of {size:.3g} {unit}".rstrip()
                + ": give it a typical value as size"
            )
    return tuple(notes)


def step_counts(state: Array) -> dict[str, int]:
    """The counts of the steps of a motion."""
    places = {"steps": STEPS, "rejected": REJECTED, "careful": NEAR_SINGULAR_STEPS}
    places |= {"evaluations": EVALUATIONS} | ({"tangents": JACOBIANS} if state[JACOBIANS] else {})
    return {name: int(state[place]) for name, place in places.items()}


def limited_instants(count: int) -> tuple[str, ...]:
    """The note of steps that stability limits, where it shows between their ends."""
    if not count:
        return ()
    when = "an instant" if count == 1 else f"{count} instants"
    return (
        f"stability, not the tolerance, limits the explicit steps: what they interpolate was in "
        f"error by more than ten tolerances at {when}, which got steps of their own; some hundred "
        "tolerances may be left of it, with the method 'radau5' none",
    )


#: Steps of one explicit run that stiffness may cost.
PATIENT = 300_000
#: Spectral radius of generalised-α at infinite frequency.
RADIUS = 0.9
#: Parts of a step of one length at which it is sampled: its ends, and the nodes of its polynomial.
SAMPLED = np.array([0.0, FIRST, SECOND, 1.0])
#: Bodies of which an implicit method takes dense matrices, at most.
DENSE = 300


def stepping(
    states: int, causes: int, regularization: float, rows: int = 1, terms: int = 1
) -> Stepping:
    """Memory of a motion of so many states, coordinates, their rates and own ones, with so many
    derivatives (`rows`) and terms of its polynomials.
    """
    n = states
    # in the order of the fields: five states, errors, K, P, F, G and the slots
    arrays = ((n,),) * 5
    tables = ((2, n), (rows, n), (rows, causes), (terms, n), (terms, causes), (PROGRESS,))
    found = Stepping.zeros((*arrays, *tables), regularization=regularization)
    found.scale[:] = 1.0
    return found


@dataclass(eq=False)
class Motion:
    """All that the steps of a motion work on: the bundles of the kernels."""

    layout: Any
    work: Any
    stepping: Stepping
    tolerances: Tolerances


class Integrator:
    """One method, with its memory.

    `methods`: As the kernel takes it.
    `fixed`: Whether its steps are of one length.
    `rows`, `terms`: Derivatives and terms of polynomials that its `stepping` needs.
    `own`: What it carries on from step to step beyond that.
    """

    def __init__(self, methods: Methods) -> None:
        self.methods, self.fixed = methods, methods.kind == EVEN
        # explicit steps pass singular positions also of other methods
        explicit = methods.explicit
        self.rows, self.terms = len(explicit.A), 3 + len(explicit.D)
        self.own: tuple[Array, ...] = ()
        if methods.kind == IMPLICIT:
            self.own = methods.implicit.past, methods.implicit.J
        elif self.fixed:
            m = methods.even
            self.own = m.acceleration, m.multipliers, m.J

    def jumped(self) -> None:
        """Inputs or velocities have jumped, and the derivative with them: the acceleration of the
        algorithm begins anew.
        """
        self.methods.even.acceleration[:] = np.nan


def radau_memory(coordinates: int, owns: int) -> Radau:
    """The implicit method with memory for so many coordinates and auxiliary states."""
    n, states = coordinates + owns, 2 * coordinates + owns
    return Radau(
        **radau_5()._asdict(),
        Z=np.zeros((3, states)),
        X=np.zeros((3, states)),
        xc=np.zeros((2, states), dtype=complex),
        past=np.zeros((4, states)),
        J=np.zeros((n, states)),
        matrix=np.zeros((n, n)),
        complex_matrix=np.zeros((n, n), dtype=complex),
        exchanges=np.zeros((2, n), dtype=np.int64),
    )


def fixed_memory(
    coordinates: int, owns: int, rows: int, blocks: int, step: float, parts: Sequence[float]
) -> FixedStep:
    """A method of steps of one length with memory for so many coordinates, auxiliary states and
    rows.
    """
    composition, unknowns = np.asarray(parts, dtype=float), coordinates + owns
    # RATTLE has no matrices
    n, states = (1, 2) if len(composition) else (unknowns, unknowns + coordinates)
    return FixedStep(
        length=step,
        composition=composition,
        spectral_radius=RADIUS,
        samples=SAMPLED,
        # not known before the first derivative
        acceleration=np.full(unknowns, np.nan),
        end_acceleration=np.zeros(unknowns),
        multipliers=np.zeros(rows),
        end_multipliers=np.zeros(rows),
        blocks=np.zeros(blocks),
        J=np.zeros((n, states)),
        matrix=np.zeros((n, n)),
        exchanges=np.zeros(n, dtype=np.int64),
    )


@functools.cache
def _blank(kind: int) -> Any:
    """No memory for a method of another kind."""
    return radau_memory(0, 0) if kind == IMPLICIT else fixed_memory(0, 0, 0, 0, 0.0, ())


@functools.cache
def explicit_steps(method: str) -> Integrator:
    """Runge–Kutta steps of adapted length, which carry nothing on: one for all motions."""
    return Integrator(_methods(EXPLICIT, order_8() if method == "dop853" else order_5()))


def even_steps(layout: Any, blocks: int, step: float, parts: Sequence[float]) -> Integrator:
    """Steps of one length: RATTLE in parts, or generalised-α without."""
    sizes = 3 * layout.bodies, layout.owns, 2 * layout.nodes, blocks
    return Integrator(_methods(EVEN, order_8(), fixed_memory(*sizes, step, parts)))


def _methods(kind: int, explicit: Explicit, memory: Any = None) -> Methods:
    return Methods(
        kind=kind,
        explicit=explicit,
        implicit=memory if kind == IMPLICIT else _blank(IMPLICIT),
        even=memory if kind == EVEN else _blank(EVEN),
        tried=np.array([kind], dtype=np.int64),
    )


def integrator(method: str, layout: Any, work: Any, step: float) -> Integrator:
    """The method of that name (one of `METHODS`); `step` is the length of steps that have one."""
    if method in ("radau5", "generalized-alpha") and layout.bodies > DENSE:
        raise ModelError(
            f"the method '{method}' takes dense matrices, of at most {DENSE} bodies, not of "
            f"{layout.bodies}: take dop853, or rattle4 for long runs"
        )
    if method == "moreau":
        raise ModelError(
            "the method 'moreau' steps whole motions, in simulate: take another one where a "
            "program leads the motion on"
        )
    if method in ("dop853", "dopri5"):
        return explicit_steps(method)
    if method == "radau5":
        memory = radau_memory(3 * layout.bodies, layout.owns)
        return Integrator(_methods(IMPLICIT, order_8(), memory))
    parts: Any = () if method == "generalized-alpha" else (1.0,)
    parts = suzuki_4() if method == "rattle4" else parts
    return even_steps(layout, len(work.block), step, parts)


# -- Interface of a motion with contacts or frictional joints to the decision of modes and
#    guards ------------------------------------------------------------------------------------

Array = np.ndarray


#: Modes by their numbers in the kernels.
MODES = ("open", "stick", "slip+", "slip-")
#: Rows of the problem for which there is memory at first.
FEW_ROWS = 16


class DecisionMemory:
    """What the kernels need that decide the modes of a motion.

    `modes`: Modes, and what an event has decided.
    `problem`: The problem of closed contacts and frictional joints.
    `impact`: An impact.
    """

    def __init__(self, uni: Unilateral) -> None:
        L, self.uni = uni.layout, uni
        counts = len(uni.contact_points), len(uni.friction_joints), 3 * L.bodies
        self.modes = modes_memory(*counts, L.nodes, uni.system.state_count)
        self.impact = impact_memory(L, *counts[:2])
        points = uni.contact_points
        self.impact.restitution[:] = [one.restitution for one in points]
        self.impact.newton[:] = [one.law == "newton" for one in points]
        self.grow(FEW_ROWS)
        self.forget()

    def grow(self, n: int) -> None:
        """Memory for so many rows."""
        L = self.uni.layout
        self.problem = decision_memory(n, 3 * L.bodies, L.nodes), problem_memory(n)

    def ready(self, motion: ModalMotion, rows: int) -> tuple[ContactDecision, ContactProblem]:
        """The problem, for so many rows, with the numbers of the factor of the joints."""
        if rows > len(self.problem[0].c):
            self.grow(2 * rows)
        D, T = self.problem[0], motion.motion.tolerances
        D.regularization[0] = motion.regularization
        D.refinements[:] = T.refinements, T.full_refinements
        return self.problem

    @property
    def rows_needed(self) -> int:
        """How many rows the problem has, at most, that there was no memory for."""
        return int(self.problem[0].count[ALL_ROWS])

    def forget(self) -> None:
        """All contact points are open, and all frictional joints slip; nothing was struck."""
        points, M = len(self.uni.contact_points), self.modes
        M.mode[:points], M.mode[points:], M.leader[:] = OPEN, FORWARD, -1
        M.leader[points:] = np.arange(points, len(M.leader))
        for table in (M.closed, M.opened, M.beyond, M.stopped, M.begun):
            table[:] = 0
        self.impact.struck[:] = -np.inf

    def rests(self, motion: ModalMotion, closed: list[int]) -> bool:
        """Whether closed contact points can be struck without restitution."""
        M, I = self.modes, self.impact
        M.touches[:], I.held[:] = 0, 0
        M.touches[closed] = 1
        bundles = motion.layout, motion.work, self.uni.table, M
        return int(strike_contacts(*bundles, *self.ready(motion, 0), I, STILL)) != NONE

    def responses(self, motion: ModalMotion, points: Array, softer: float) -> ContactDecision:
        """Responses to the tangents of contact points, motions without mass being `softer`."""
        D, _ = self.ready(motion, len(points))
        which = np.ascontiguousarray(points, dtype=np.int64)
        bundles = motion.layout, motion.work, self.uni.table, D, self.impact
        tangent_responses(*bundles, which, softer)
        return D


class ModalMotion(Protocol):
    """A motion with rows of the active set.

    `work`: The workspace of its steps.
    `regularization`: The proximal term of redundant rows.
    `motion`: Bundles of the kernels of steps.
    """

    layout: Layout
    work: Work
    motion: Motion
    regularization: float


#: Refinements of accelerations, at most.
MOST_REFINEMENTS = 32


def refined_where_uneven(motion: Motion, uni: Unilateral) -> Motion:
    """A motion of the kernels with refinements for masses that differ: forces on the heavy cancel
    on the light.
    """
    tolerances, uneven = motion.tolerances, uni.unevenness.max(initial=0.0)
    if uneven <= tol.MASSES_UNEVEN:
        return motion
    count, left = MOST_REFINEMENTS, tol.REFINEMENT_LEAVES * uneven
    if left < 1.0:
        count = min(count, math.ceil(math.log(tol.MACHINE_EPSILON) / math.log(left)))
    most = max(tolerances.full_refinements, count)
    exact = tolerances.replaced(refinements=most, full_refinements=most)
    return replace(motion, tolerances=exact)
