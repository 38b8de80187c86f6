"""Contacts and rough joints of an instant: rows of what is closed and sticks, senses of sliding."""

from __future__ import annotations

import math

import numpy as np

from mbody.analysis.contact.unilateral import has_modes
from mbody.analysis.dynamics.contact_motion import ContactIntegration
from mbody.errors import SolveError
from mbody.kernels.layout import Work
from mbody.solution.restart import Way
from mbody.solution.solution import Solution
from mbody.system.system import System

__all__ = ["WORDS", "HeldModes", "held_modes"]

Array = np.ndarray

#: What is said of each mode.
WORDS = {
    "stick": "sticks",
    "roll": "rolls",
    "slip+": "slides",
    "slip-": "slides",
    "open": "is open",
}


class HeldModes:
    """The modes of an instant, as `simulate` decides them, and what they do to motions beside it:
    what is closed and what sticks is a constraint, what slides goes on in its sense.

    Attributes
    ----------
    names : dict
        Mode of every contact and rough joint.
    """

    def __init__(self, system: System, given: Solution, t: float, q: Array, v: Array) -> None:
        way = Way("dop853", 1e-9, 1e-9)
        engine = ContactIntegration(system, given, way, ())
        engine.begin(t, q, v, t + 1.0)
        engine.wanted, engine.instants = np.array([t]), []
        engine.pages, engine.works = [], []
        status = engine.begin_modes()
        if status or any(event.name == "impact" for event in engine.occurred):
            unit = system.mechanism.units.time
            raise SolveError(
                f"linearize of '{system.mechanism.name}': something strikes at t = {t:.6g} {unit}, "
                "so that there are no linear equations; take an instant beside it"
            )
        self.names = engine.named_modes()
        self.uni, self._work = engine.uni, engine.work
        self._on = np.flatnonzero(engine.on)
        self._unit = np.where(self.uni.angular, 1.0, 1.0 / system.length)[self._on]
        self._scale = system.coordinate_units

    @property
    def words(self) -> str:
        """What each does, in a phrase."""
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
        work.sense[:], work.par[:] = own.sense, own.par

    def rows(self, work: Work) -> tuple[Array, Array, Array]:
        """Φ, Φ_q without units and ν of the rows that are on, at the position in a workspace into
        which the modes were entered.
        """
        work.v[:] = 0.0
        found = self.uni.read(work)
        phi = found.value[self._on] - work.anchor[self._on, 0]
        block = self._unit[:, None] * found.block[self._on] * self._scale
        return self._unit * phi, block, -self._unit * found.rate[self._on]


def held_modes(system: System, given: Solution, t: float, q: Array, v: Array) -> HeldModes | None:
    """The modes at the last instant of a motion in which they were decided; None of others."""
    if not given.modes or given.stepped is not None or not has_modes(system):
        return None
    if not math.isfinite(float(np.abs(q).max(initial=0.0))):
        return None
    return HeldModes(system, given, t, q, v)
