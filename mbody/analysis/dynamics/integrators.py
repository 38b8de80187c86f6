"""Integrators of `simulate` by name: each a kernel with its coefficients and its own memory."""

from __future__ import annotations

import functools
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any, Protocol

import numpy as np

from mbody.core import tolerances as tol
from mbody.errors import ModelError, SolveError
from mbody.kernels.dense_output import FIRST, SECOND
from mbody.kernels.fixed_step import FixedStep, fixed_step
from mbody.kernels.methods import EVEN, EXPLICIT, IMPLICIT, Methods
from mbody.kernels.radau import LENGTH, Radau, radau
from mbody.kernels.runge_kutta import runge_kutta
from mbody.kernels.step_state import (
    BEST_CONDITIONING,
    CONDITIONING,
    JACOBIAN_VALID,
    KNOWN_UNTIL,
    MORE,
    NEAR_SINGULAR,
    NEXT,
    NOT_FINITE,
    PROGRESS,
    SHORTENED_UNTIL,
    SINGULAR_AHEAD,
    STEP_VANISHED,
    STEPS,
    TIME,
    Outputs,
    Stepping,
    Tolerances,
)
from mbody.kernels.tableaus import Explicit, order_5, order_8, radau_5, suzuki_4
from mbody.model.states import STEADY
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

Array = np.ndarray

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


def natural_size(system: System, dimension: Dimension | None) -> float:
    """One of lengths, masses and times of the model's own, and a second; 1 without a dimension."""
    if dimension is None:
        return 1.0
    size = system.length ** float(dimension.length) * system.heaviest ** float(dimension.mass)
    return float(size * system.mechanism.units.second ** float(dimension.time))


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


class Integrator(Protocol):
    """One method.

    `fixed`: Whether its steps are of one length.
    `rows`, `terms`: Derivatives and terms of polynomials that its `stepping` needs.
    `own`: What it carries on from step to step beyond that.
    `methods`: As the kernel of watched steps takes it.
    """

    fixed: bool
    rows: int
    terms: int
    own: tuple[Array, ...]

    @functools.cached_property
    def methods(self) -> Methods:
        """See above."""

    def slack(self, until: float) -> float:
        """How near to the last time a step is stretched to it."""

    def steps(self, motion: Motion, until: float, count: int, outputs: Outputs) -> int:
        """At most so many steps towards `until`; a code of `mbody.kernels.step_state`."""

    def explicitly(self, motion: Motion, take: Callable[[Motion, Methods], int]) -> int:
        """One explicit step, or one that was rejected: `take` makes it of the motion with memory
        for it, by that method.
        """

    def jumped(self, motion: Motion) -> None:
        """Inputs or velocities have jumped, and the derivative with them."""


class ExplicitSteps:
    """Runge–Kutta steps of adapted length."""

    fixed = False
    own: tuple[Array, ...] = ()

    def __init__(self, method: Explicit) -> None:
        self.method = method
        self.rows, self.terms = len(method.A), 3 + len(method.D)

    @functools.cached_property
    def methods(self) -> Methods:
        """As the kernel of watched steps takes it."""
        return Methods(kind=EXPLICIT, explicit=self.method, **_blank_memory())

    def slack(self, until: float) -> float:
        """Rounding."""
        return tol.TIME_END_ROUNDING * abs(until)

    def steps(self, motion: Motion, until: float, count: int, outputs: Outputs) -> int:
        """Explicit Runge-Kutta steps until a time, at most `count`; returns the kernel's code."""
        m = motion
        bundles = m.layout, m.work, self.method, m.stepping, m.tolerances, outputs
        return int(runge_kutta(*bundles, until, count))

    def explicitly(self, motion: Motion, take: Callable[[Motion, Methods], int]) -> int:
        """A step as any."""
        return take(motion, self.methods)

    def jumped(self, motion: Motion) -> None:
        """Nothing is carried on."""


class _WithPassages:
    """Steps of a kernel, and explicit ones near singular positions, which it does not pass."""

    #: Its name in `Methods`, and its kind there.
    named: tuple[str, int]
    method: Any

    def __init__(self) -> None:
        self.explicit = ExplicitSteps(order_8())
        self.inner: Stepping | None = None

    @functools.cached_property
    def methods(self) -> Methods:
        """As the kernel of watched steps takes it."""
        name, kind = self.named
        memory = _blank_memory() | {name: self.method}
        return Methods(kind=kind, explicit=self.explicit.method, **memory)

    def kernel(self, motion: Motion, until: float, count: int, outputs: Outputs) -> Any:
        """Steps until a singular position, at most."""
        raise NotImplementedError

    def forget(self, motion: Motion) -> None:
        """After explicit steps: what was carried on is of before them."""
        raise NotImplementedError

    def steps(self, motion: Motion, until: float, count: int, outputs: Outputs) -> int:
        """Steps until a time, at most `count`, with short steps near singular positions; returns
        the kernel's code.
        """
        state, code = motion.stepping.state, MORE
        while count > 0 and code == MORE:
            done, t = state[STEPS], state[TIME]
            near_singular = (
                state[NEAR_SINGULAR] or t <= state[KNOWN_UNTIL] or t < state[SHORTENED_UNTIL]
            )
            best = state[BEST_CONDITIONING]
            if state[CONDITIONING] >= tol.CONDITIONING_NEAR_SINGULAR * best and not near_singular:
                code = int(self.kernel(motion, until, count, outputs))
                nearly = (
                    state[CONDITIONING] < tol.CONDITIONING_INTO_SINGULAR * state[BEST_CONDITIONING]
                )
                failed = code in (STEP_VANISHED, NOT_FINITE)
                if code != SINGULAR_AHEAD and not (nearly and failed):
                    return code
            code = self.explicitly(
                motion, lambda inner, _: self.explicit.steps(inner, until, 1, outputs)
            )
            count -= 1 + int(state[STEPS] - done)
        return code

    def explicitly(self, motion: Motion, take: Callable[[Motion, Methods], int]) -> int:
        """One explicit step, or one that was rejected, as of `Integrator`."""
        outer = motion.stepping
        if self.inner is None:
            rows, terms = self.explicit.rows, self.explicit.terms
            width, causes = len(outer.y), outer.P.shape[1]
            self.inner = outer.replaced(
                K=np.zeros((rows, width)),
                P=np.zeros((rows, causes)),
                F=np.zeros((terms, width)),
                G=np.zeros((terms, causes)),
            )
        inner, t = self.inner, outer.state[TIME]
        inner.K[0], inner.P[0] = outer.K[0], outer.P[0]
        # the layout is that of the rows that are on at present
        code = take(replace(motion, stepping=inner), self.explicit.methods)
        if outer.state[TIME] > t:
            outer.K[0], outer.P[0] = inner.K[0], inner.P[0]
            self.forget(motion)
        return code


class RadauSteps(_WithPassages):
    """Implicit steps of adapted length."""

    fixed, rows, terms = False, 4, 3
    named = "implicit", IMPLICIT

    def __init__(self, coordinates: int, owns: int) -> None:
        super().__init__()
        self.method = radau_memory(coordinates, owns)
        self.own: tuple[Array, ...] = self.method.past, self.method.J

    def slack(self, until: float) -> float:
        """Rounding."""
        return tol.TIME_END_ROUNDING * abs(until)

    def kernel(self, motion: Motion, until: float, count: int, outputs: Outputs) -> Any:
        """Implicit steps of Radau IIA, by `mbody.kernels.radau`."""
        m = motion
        bundles = m.layout, m.work, self.method, m.stepping, m.tolerances, outputs
        return radau(*bundles, until, count)

    def jumped(self, motion: Motion) -> None:
        """Newton's method ends where it does from any polynomial, by any Jacobian."""

    def forget(self, motion: Motion) -> None:
        """No polynomial to begin from, no Jacobian."""
        self.method.past[LENGTH, 0] = motion.stepping.state[JACOBIAN_VALID] = 0.0


class FixedSteps(_WithPassages):
    """Steps of one length: RATTLE in parts, or generalised-α without."""

    fixed, rows, terms = True, 4, 5
    named = "even", EVEN

    def __init__(self, layout: Any, blocks: int, step: float, parts: Any) -> None:
        super().__init__()
        self.coordinates = 3 * layout.bodies
        sizes = self.coordinates, layout.owns, 2 * layout.nodes, blocks
        self.method = m = fixed_memory(*sizes, step, parts)
        self.own: tuple[Array, ...] = m.acceleration, m.multipliers, m.J

    def slack(self, until: float) -> float:
        """A last step that were as short would be lost in rounding."""
        return tol.TIMES_SAME_SAMPLE * float(self.method.length)

    def kernel(self, motion: Motion, until: float, count: int, outputs: Outputs) -> Any:
        """Steps of equal length, by `mbody.kernels.fixed_step`."""
        m, hat = motion, self.method.acceleration
        if np.isnan(hat).any():
            hat[:] = m.stepping.K[0, self.coordinates :]
        bundles = m.layout, m.work, self.method, m.stepping, m.tolerances, outputs
        return fixed_step(*bundles, until, count)

    def jumped(self, motion: Motion) -> None:
        """The acceleration of the algorithm begins anew."""
        hat = self.method.acceleration
        hat[:] = motion.stepping.K[0, self.coordinates :]

    def forget(self, motion: Motion) -> None:
        """The acceleration of the algorithm begins anew, and so does the length."""
        S, hat = motion.stepping, self.method.acceleration
        hat[:] = S.K[0, self.coordinates :]
        S.state[JACOBIAN_VALID] = 0.0
        weak = S.state[CONDITIONING] < tol.CONDITIONING_NEAR_SINGULAR * S.state[BEST_CONDITIONING]
        if not (weak or S.state[NEAR_SINGULAR]):
            S.state[NEXT] = self.method.length


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


def _blank_memory() -> dict[str, Any]:
    """No memory for methods of other kinds."""
    return {"implicit": radau_memory(0, 0), "even": fixed_memory(0, 0, 0, 0, 0.0, ())}


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
        return ExplicitSteps(order_8() if method == "dop853" else order_5())
    if method == "radau5":
        return RadauSteps(3 * layout.bodies, layout.owns)
    parts = {"generalized-alpha": (), "rattle": (1.0,), "rattle4": suzuki_4()}[method]
    return FixedSteps(layout, len(work.block), step, parts)
