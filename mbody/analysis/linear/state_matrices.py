"""State matrices of small changes, with inputs and measures: ẋ = A x + B u, z = C x + D u."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from mbody.analysis.freedom.free_motions import FreeMotion
from mbody.analysis.linear.about_motion import Moving
from mbody.errors import ModelError
from mbody.model.study import Measure, measure_named
from mbody.solution.doubts import Doubt, Inherited, inherited
from mbody.solution.measures import check_measure, measured
from mbody.system.driver_formulas import followed_inputs
from mbody.system.read_only import lock

__all__ = ["StateMatrices", "state_matrices"]

Array = np.ndarray


class Linear(Protocol):
    """What is needed of linear equations of second order; see `mbody.engineering.linearize`."""

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
        """See `Inherited`."""

    @property
    def doubts(self) -> tuple[Doubt, ...]:
        """See `Inherited`."""

    @property
    def notes(self) -> tuple[str, ...]:
        """See `Inherited`."""


@dataclass(frozen=True, eq=False)
class StateMatrices(Inherited):
    """The matrices of small changes of the first order, ẋ = A x + B u, z = C x + D u.

    Attributes
    ----------
    A : array (2·free + own states,) squared
        Units of a rate of the state by units of the state.
    B : array (2·free + own states, inputs)
    C : array (outputs, 2·free + own states)
        Units of the measure by units of the state.
    D : array (outputs, inputs)
    states : tuple of str
        What each number of x is: of the leader of each free motion its ``"angle"`` [rad], or
        ``"way"`` where it slides [length], then their rates, ``"omega"`` or ``"rate"``; then the
        mechanism's own states.
    inputs, outputs : tuple of str
        Names of the inputs; the measures.
    status, doubts, notes
        As of `Inherited`.
    """

    A: Array
    B: Array
    C: Array
    D: Array
    states: tuple[str, ...]
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]

    def __post_init__(self) -> None:
        lock(self)


def state_matrices(
    linear: Linear, measures: str | Measure | Sequence[str | Measure]
) -> StateMatrices:
    """See `mbody.engineering.linearize`."""
    wanted = [measures] if isinstance(measures, str | Measure) else list(measures)
    nearby, motions = linear.nearby(), linear.motions
    machine, free = nearby.system.mechanism, len(motions)
    owns, inputs = len(machine.states), [one.name for one in machine.inputs]
    for name, driver in followed_inputs(machine, nearby.system.numbers).items():
        raise ModelError(
            f"the input '{name}' is followed by driver '{driver}': the motion depends on its rate "
            "and its acceleration too, so that B and D do not describe it; make it a parameter, or "
            "let the driver follow states whose rates have the input",
            name,
        )
    of = [measure_named(machine.measures, one) for one in wanted]
    for one in of:
        check_measure(machine, one)

    def values(y: Array, w: Array, own: Array | None = None) -> Array:
        a, rates, run = nearby.instant(y, w, own)
        read = [measured(run, one)[0][-1] for one in of]
        return np.concatenate([a, rates, np.array(read, dtype=float).reshape(-1)])

    A = np.zeros((2 * free + owns,) * 2)
    A[: 2 * free, : 2 * free] = linear.state_matrix
    B = np.zeros((len(A), len(inputs)))
    C, D = np.zeros((len(of), len(A))), np.zeros((len(of), len(inputs)))
    if of or owns:
        moved = np.hstack(nearby.derivatives(values))
        A[2 * free :, : 2 * free] = moved[free : free + owns]
        C[:, : 2 * free] = moved[free + owns :]
    if owns or inputs:
        changed = nearby.by_own(lambda own: values(np.zeros(free), nearby.rate, own))
        A[free : 2 * free, 2 * free :] = changed[:free, :owns]
        A[2 * free :, 2 * free :] = changed[free : free + owns, :owns]
        B[free : 2 * free] = changed[:free, owns:]
        B[2 * free :] = changed[free : free + owns, owns:]
        C[:, 2 * free :], D[:] = changed[free + owns :, :owns], changed[free + owns :, owns:]
    names = [(m.leader, ("angle", "omega") if m.turns else ("way", "rate")) for m in motions]
    states = [f"{leader}.{keys[k]}" for k in range(2) for leader, keys in names]
    states += [one.name for one in machine.states]
    texts = tuple(one if isinstance(one, str) else one.of for one in wanted)
    return StateMatrices(A, B, C, D, tuple(states), tuple(inputs), texts, **inherited(linear))
