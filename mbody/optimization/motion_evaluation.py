"""One design followed over time with derivatives by its numbers, again and again."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from mbody.analysis.dynamics.simulate import simulate
from mbody.derivatives.released_motion import MotionInstants, motion_instants
from mbody.errors import ModelError, SolveError
from mbody.model.study import Measure
from mbody.optimization.design_evaluation import Evaluation
from mbody.solution.measures import measured
from mbody.solution.solution import Solution
from mbody.system.system import System

__all__ = ["MotionEvaluator"]


class _MotionEvaluation(Evaluation):
    """A motion with the derivatives of its histories."""

    def mobility(self) -> tuple[float, np.ndarray, int]:
        """No limit: what moves freely has no dead centre."""
        return 1.0, np.zeros(len(self.x)), 0


@dataclass(frozen=True, eq=False)
class _PlainMotion:
    """A motion without derivatives."""

    run: Solution

    def history(self, measure: Measure) -> tuple[np.ndarray, np.ndarray]:
        """A quantity, (instants,), and no derivatives."""
        value = np.reshape(measured(self.run, measure)[0], -1)
        return value, np.zeros((len(value), 0))


class MotionEvaluator:
    """Motions of the designs of one system that differ in some numbers.

    Parameters
    ----------
    system : System
    names : sequence of str
        Dotted names of the numbers.
    options : mapping
        Of `simulate`.

    Attributes
    ----------
    count : int
        How many designs were followed.
    instants : int
        Of the motion of the description; those of all designs, which do not end earlier.
    """

    def __init__(self, system: System, names: Sequence[str], options: Mapping[str, Any]) -> None:
        self.system, self.names, self.options = system, list(names), dict(options)
        self.count = 0
        self.instants = len(simulate(system, **self.options).t)

    def present(self) -> np.ndarray:
        """The numbers of the description: (numbers,)."""
        return np.array([float(self.system.values[name]) for name in self.names])

    def run(self, x: np.ndarray) -> Solution:
        """The motion of a design.

        Raises
        ------
        ModelError
            For numbers that the mechanism cannot have.
        SolveError
            As of `simulate`, and where the motion ends at another time than that of the
            description.
        """
        self.count += 1
        system = self.system.with_values(dict(zip(self.names, x.tolist(), strict=True)))
        run = simulate(system, **self.options)
        if len(run.t) != self.instants:
            unit = run.mechanism.units.time
            raise SolveError(
                f"the motion ends at t = {float(run.t[-1]):.6g} {unit} after {len(run.t)} "
                f"instants, that of the description has {self.instants}: leave out the event that "
                "ends it, or choose a shorter time"
            )
        return run

    def failure(self, x: np.ndarray) -> str:
        """Why a design cannot be followed with derivatives."""
        try:
            _, instants = self._derived(x)
        except (ModelError, SolveError) as error:
            return str(error)
        return "; ".join(instants.notes) or "the quantities have no finite value there"

    def plain(self, x: np.ndarray) -> _PlainMotion | None:
        """A design without derivatives; None where it cannot be followed."""
        try:
            return _PlainMotion(self.run(x))
        except (ModelError, SolveError):
            return None

    def __call__(self, x: np.ndarray) -> Evaluation | None:
        """A design with derivatives; None where it cannot be followed, or has none."""
        try:
            whole, instants = self._derived(x)
        except (ModelError, SolveError):
            return None
        if instants.lost.gone.any():  # after a change from which on there is no derivative
            return None
        return _MotionEvaluation(np.array(x), instants.run, whole, np.zeros(0))

    def _derived(self, x: np.ndarray) -> tuple[Any, MotionInstants]:
        """All instants in dual numbers, and what is known of their derivatives."""
        run = self.run(x)
        instants = motion_instants(run, self.names, False)
        whole = instants.at(np.arange(len(run.t)), bool(run.mechanism.loads))
        return whole, instants
