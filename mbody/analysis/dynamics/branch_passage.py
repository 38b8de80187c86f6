"""Passage of a free motion by singular positions: which branch it takes, notes and doubts."""

from __future__ import annotations

import numpy as np

from mbody.analysis.driven.diagnosis import inertialess
from mbody.analysis.singular.nearby_singularity import (
    Crossing,
    MetPosition,
    crossing_note,
    look_ahead,
)
from mbody.kernels.singularity_monitor import STAND_IN_PART
from mbody.kernels.step_state import (
    CROSSING_TIME,
    DECIDE_BELOW,
    KNOWN_UNTIL,
    LEAST_AT,
    LEAST_CONDITIONING,
    NEXT,
    SHORTENED_UNTIL,
    STAND_IN_ENERGY,
    STAND_IN_LIMIT,
    TIME,
)
from mbody.model.element import listed
from mbody.solution.doubts import Doubt
from mbody.solution.histories import BranchDistance
from mbody.system.system import System

__all__ = ["BranchPassage", "KnownCrossings"]

Array = np.ndarray
#: Change points ahead, those behind, doubts, singular positions that were met.
KnownCrossings = tuple[
    tuple[Crossing, ...], tuple[Crossing, ...], tuple[Doubt, ...], tuple[MetPosition, ...]
]

#: What lies ahead is first looked at when a step is this part of the one that was rejected, as the
#: kernel has it.
FIRST = 0.3
#: It is looked at again when the step is this part of that.
AGAIN = 0.1
#: A step of this part of the whole motion that may still meet one is made in doubt.
HOPELESS = 1e-9
#: A step over a change point may be so many times the one that was looked at; it is longer by
#: this part, for rounding.
FARTHER, LITTLE = 4.0, 1e-9
#: Inertia is looked at again where the energy of masses that replace missing ones has so
#: grown.
MORE_OF_IT = 10.0
#: A body takes part in a motion with this part of the fastest.
TAKES_PART = 0.1


class BranchPassage:
    """Decides for one motion; `state` is that of its steps."""

    def __init__(self, system: System, regularized: bool, state: Array, whole: float) -> None:
        self.system, self.regularized, self.state, self.whole = system, regularized, state, whole
        self.open: tuple[Crossing, ...] = ()
        self.crossings: tuple[Crossing, ...] = ()
        self.doubts: tuple[Doubt, ...] = ()
        self.met: tuple[MetPosition, ...] = ()
        state[KNOWN_UNTIL] = state[SHORTENED_UNTIL] = state[CROSSING_TIME] = -np.inf
        state[LEAST_CONDITIONING], state[STAND_IN_LIMIT] = np.inf, STAND_IN_PART
        self.first_position = np.zeros(0)

    @property
    def known(self) -> KnownCrossings:
        """What is known until now, to come back to."""
        return self.open, self.crossings, self.doubts, self.met

    @known.setter
    def known(self, given: KnownCrossings) -> None:
        self.open, self.crossings, self.doubts, self.met = given

    def decide(self, y: Array, derivative: Array) -> None:
        """How the next steps pass what is near, from the state y and its derivative (states,)."""
        state, n = self.state, self.system.coordinates
        t, step = float(state[TIME]), 2.0 * float(state[NEXT])
        now = y[:n], y[n : 2 * n], derivative[n : 2 * n]
        ahead = look_ahead(self.system, t, now, step / FIRST, self.regularized, self.met)
        self.met = ahead.met
        if ahead.clear:
            state[KNOWN_UNTIL], state[NEXT] = t, 0.99 * ahead.clear
        elif ahead.crossing is not None:
            at = ahead.crossing
            over = 2.0 * (at.t - t)
            state[KNOWN_UNTIL], state[CROSSING_TIME] = max(t, at.t + 0.5 * (at.t - t)), at.t
            state[NEXT] = over * (1.0 + LITTLE) if step < over < FARTHER * step else step
            self.open = (at,) if at.t > t else ()
        elif step < HOPELESS * self.whole:
            self._give_up(t, step, ahead.elements)
        elif ahead.bend < np.inf:
            state[SHORTENED_UNTIL] = ahead.bend + max(ahead.bend - t, step)
            state[DECIDE_BELOW] = 0.0
        else:
            state[DECIDE_BELOW] = AGAIN * step

    def _give_up(self, t: float, step: float, elements: tuple[str, ...]) -> None:
        unit = self.system.mechanism.units.time
        who = f" of {listed(elements, 4)}" if elements else ""
        self.state[KNOWN_UNTIL] = t + 100.0 * step
        self.doubts += (
            Doubt(
                "branch",
                f"from t = {t:.6g} {unit} on it is not certain on which branch the motion goes on: "
                f"rows{who} become dependent there; begin a little beside, or change a "
                "length by more than its rounding",
                t,
                elements,
            ),
        )

    def record_crossings(self, y: Array) -> None:
        """Record change points that were ahead and are behind at the state y."""
        t = float(self.state[TIME])
        if not self.open or t <= self.state[KNOWN_UNTIL]:
            return
        n = self.system.coordinates
        scale = self.system.coordinate_units
        for one in self.open:
            found = one.passed(t, y[:n] / scale, y[n : 2 * n] / scale)
            if found is not None:
                self.crossings += (found,)
        self.open = ()

    def check_inertia(self, y: Array) -> None:
        """See whether the inertia of the free motion vanishes at the state y, where masses that
        replace missing ones take much of the energy.
        """
        state, n = self.state, self.system.coordinates
        if state[STAND_IN_ENERGY] <= state[STAND_IN_LIMIT]:
            return
        t, state[STAND_IN_LIMIT] = float(state[TIME]), MORE_OF_IT * float(state[STAND_IN_ENERGY])
        always = inertialess(self.system, t, self.first_position)
        if inertialess(self.system, t, y[:n]) <= always:
            return
        state[STAND_IN_LIMIT] = np.inf
        names = _without_mass(self.system, y[n : 2 * n])
        who = f"{listed(names, 4)} {'has' if len(names) == 1 else 'have'} no mass"
        message = (
            f"at t = {t:.6g} {self.system.mechanism.units.time} the inertia of the free motion "
            f"vanishes, for {who}: how the motion goes on from there is not determined; give mass "
            "and inertia"
        )
        self.doubts += (Doubt("inertia", message, t, names),)

    def notes(self, last: float) -> tuple[str, ...]:
        """The sentence of the change points that were passed until `last`, if there are any."""
        found = [one for one in self.crossings if one.t <= last]
        return (crossing_note(found, self.system.mechanism.units.time),) if found else ()

    def least(self, last: float) -> BranchDistance | None:
        """How near the motion came to another branch."""
        found = [one for one in self.crossings if one.t <= last]
        if found:
            return BranchDistance(0.0, found[0].t)
        if not np.isfinite(self.state[LEAST_CONDITIONING]):
            return None
        return BranchDistance(
            float(np.sqrt(self.state[LEAST_CONDITIONING])), float(self.state[LEAST_AT])
        )


def _without_mass(system: System, v: Array) -> tuple[str, ...]:
    """Bodies without mass that move at the rates v (coordinates,), the fastest first."""
    scale = system.coordinate_units
    fast = np.abs(v / scale).reshape(-1, 3).max(axis=1)
    order = np.argsort(-fast)
    bodies = system.mechanism.bodies
    own = system.mass[: len(v), 0].reshape(-1, 3)
    return tuple(
        bodies[b].name for b in order if not own[b].any() and fast[b] > TAKES_PART * fast.max()
    )
