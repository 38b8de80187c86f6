"""Motions with contacts by engines of order 1 or less: what several lengths of steps tell.

Impacts and changes of sticking fall on ends of steps, so that errors go down with the length of
the step, but not smoothly: no extrapolation has a meaning, and two lengths may agree by chance. So
every length is three, a little apart; what the nine motions say differently is what such an engine
cannot tell.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any

import numpy as np

from mbody.analysis.dynamics.simulate import simulate
from mbody.core import tolerances as tol
from mbody.engines.balance import Inexpressible, Row
from mbody.errors import ModelError, SolveError
from mbody.model.contact import Contact
from mbody.model.model_notes import with_others
from mbody.solution.solution import Solution
from mbody.system.assembler import assemble
from mbody.system.system import System, with_numbers_of

Array = np.ndarray

#: Steps of the longest length over the whole motion, and instants that are compared, at most.
STEPS, SAMPLES = 1000, 40
#: Lengths of one group, in parts of the first; and of the groups, of which the last is the finest.
STEP_LENGTHS, GROUPS = (1.0, 0.83, 0.71), (1.0, 0.5, 0.25)
#: Times by which our result may be farther from that of the finest steps than those of all lengths
#: are from each other: the error is a third of that by order 1, the same by order ½.
MARGIN = {1.0: 1.5, 0.5: 3.0}


@dataclass(frozen=True)
class Stepped:
    """One motion in steps.

    `places` (instants, bodies, 3): x, y and angle of every body, in the units of the mechanism.
    `modes`: "open", "stick" or "slip" of every contact at the instants; empty where it is not
      certain.
    """

    places: Array
    modes: dict[str, list[str]]


class StepwiseCheck:
    """Compares our motion with one in steps."""

    def __init__(
        self, run: Solution, last: float, engine: str, *, order: float, time_tolerance: float
    ) -> None:
        self.run, self.engine, self.order, self.time_tolerance = run, engine, order, time_tolerance
        there = np.flatnonzero((run.t > run.t[0]) & (run.t <= last))
        picked = np.linspace(0, len(there) - 1, min(len(there), SAMPLES)).round().astype(int)
        self.instants = there[np.unique(picked)] if len(there) else there
        self.times = run.t[[0, *self.instants]]

    def counts(self, step: float) -> list[int]:
        """Steps from each instant to the next, of about that length [time]."""
        return [max(1, round(float(part) / step)) for part in np.diff(self.times)]

    def rows(
        self,
        integrate: Callable[[list[int]], Stepped],
        coarse: Callable[[list[int]], Stepped] | None = None,
    ) -> tuple[list[Row], list[Inexpressible], list[str]]:
        """Rows, what was not compared, and notes."""
        if not len(self.instants):
            why = f"{self.engine}: there is no instant that may be compared"
            return [], [Inexpressible("motion", why)], []
        longest = float(self.times[-1] - self.times[0]) / STEPS
        groups = [
            [integrate(self.counts(part * group * longest)) for part in STEP_LENGTHS]
            for group in GROUPS
        ]
        motions = [one for group in groups for one in group]
        motions += [coarse(self.counts(longest))] if coarse else []
        means = [np.mean([one.places for one in group], axis=0) for group in groups]
        rows, unseen = self._places(motions, means[-1])
        rows += self._modes(motions)
        changes = [float(np.abs(b - a).max()) for a, b in pairwise(means)]
        unit = self.run.mechanism.units.of("time")
        note = (
            f"a motion of {self.engine} over {self.times[-1] - self.times[0]:.4g} {unit} by steps "
            f"of {longest:.3g} {unit}, a half and a quarter of it, each length three times a "
            "little different: contacts begin and end with a step, so that results are of order 1"
        )
        if changes[0] > changes[1] > tol.COMPARISON_FLOOR * self.run.system.length:
            note += f" (observed: {math.log2(changes[0] / changes[1]):.2f})"
        return rows, unseen, [note]

    def _places(
        self, motions: list[Stepped], finest: Array
    ) -> tuple[list[Row], list[Inexpressible]]:
        """A row for each coordinate, where it is farthest in parts of what is expected."""
        bodies = self.run.mechanism.bodies
        size = self.run.system.length
        off = np.ptp([one.places for one in motions], axis=0)
        # an error goes on, and that of what begins with a step may come to some lengths only later
        off = np.maximum.accumulate(np.concatenate([off[1:], off[-1:]]), axis=0)
        rows, blind = [], []
        for kind, parts in (("place", (0, 1)), ("angle", (2,))):
            ours = {
                (b, part): getattr(self.run[body.name], key)[self.instants]
                for b, body in enumerate(bodies)
                for part, key in enumerate(("x", "y", "angle"))
                if part in parts
            }
            least = size if kind == "place" else 1.0
            top = max([least, *(float(np.abs(one).max()) for one in ours.values())])
            worst_of_kind = off[:, :, list(parts)].max(axis=(1, 2)) / top
            expected = MARGIN[self.order] * worst_of_kind + tol.COMPARISON_FLOOR
            seen = worst_of_kind <= tol.COMPARISON_BLIND
            for (b, part), mine in ours.items():
                name = f"{bodies[b].name}.{('x', 'y', 'angle')[part]}"
                if not seen.any():
                    blind.append(name)
                    continue
                difference = np.abs(mine - finest[:, b, part]) / top
                k = int(np.argmax(np.where(seen, difference / expected, -1.0)))
                pair = float(mine[k]), float(finest[k, b, part])
                why = f"its steps, of order {self.order:g}: how far those of all lengths are apart"
                rows.append(Row(name, *pair, float(difference[k]), float(expected[k]), why))
        most = f"{tol.COMPARISON_BLIND:.0%}"
        why = f"steps of {self.engine} of several lengths differ by more than {most}"
        return rows, [Inexpressible(name, why) for name in blind]

    def _modes(self, motions: list[Stepped]) -> list[Row]:
        """A row for each contact: at how many instants it is as all lengths of steps agree on."""
        rows = []
        span = float(self.times[-1] - self.times[0])
        for contact in self.run.mechanism.contacts:
            if contact.name not in motions[0].modes:
                continue
            theirs = list(zip(*(one.modes[contact.name] for one in motions), strict=True))
            changes = [float(self.run.t[0]), *(one.t for one in self.run.events if one.contact)]
            at_change = [
                any(abs(t - change) <= self.time_tolerance * span for change in changes)
                for t in self.times[1:].tolist()
            ]
            modes, press = self.run.mode(contact.name), self.run.contact(contact.name)
            ours = [plain_mode(modes[k]) for k in self.instants]
            # what touches without a force is open as much as closed
            unloaded = np.abs(press) <= tol.FORCE_NONE * np.abs(press).max()
            certain = [
                (mine, said[0])
                for mine, said, close, k in zip(ours, theirs, at_change, self.instants, strict=True)
                if len(set(said)) == 1 and said[0] and not close
                if mine == "open" or not unloaded[k]
            ]
            if not certain:
                continue
            # what is at its limit in one choice of forces sticks in another
            unique = self.run.reaction(contact.name).unique if contact.bodies else None
            touches = not all(unique or (True,)) or _smooth(contact)
            same = sum(_alike(*pair, touches) for pair in certain)
            all_of_them = len(certain)
            rows.append(
                Row(
                    f"{contact.name}: modes alike",
                    float(all_of_them),
                    float(same),
                    1.0 - same / all_of_them,
                    0.0,
                    "instants away from changes at which all lengths of steps say one mode",
                )
            )
        return rows


def plain_mode(mode: str) -> str:
    """Open, stick or slip."""
    return {"open": "open", "stick": "stick", "roll": "stick"}.get(mode, "slip")


def _smooth(contact: Any) -> bool:
    return not isinstance(contact, Contact) or contact.friction == 0.0


def _alike(ours: str, theirs: str, touches: bool) -> bool:
    """Whether two modes are one; what only `touches` without friction, or with friction that is not
    unique, has no more modes than open and closed.
    """
    return ours == theirs or (touches and "open" not in (ours, theirs))


def strikes(run: Solution, *, with_friction: bool = False) -> list[float]:
    """Times at which contacts with restitution, or friction too `with_friction`, are struck."""
    fields = ("restitution", "friction") if with_friction else ("restitution",)
    values = run.system.values
    those = {
        one.name
        for one in run.mechanism.contacts
        if isinstance(one, Contact) and any(values[f"{one.name}.{key}"] > 0.0 for key in fields)
    }
    return [one.t for one in run.events if one.name == "impact" and one.contact in those]


def first_of_several(run: Solution) -> float | None:
    """Times at which something first strikes with restitution while it, or what it strikes, touches
    others: which of them begins then depends on rounding, and the motion after it on which.
    """
    contacts = {one.name: one for one in run.mechanism.contacts}
    struck = set(strikes(run))
    for event in run.events:
        if event.t not in struck or event.contact not in contacts:
            continue
        before = int(np.searchsorted(run.t, event.t)) - 1
        own = set(contacts[event.contact].bodies) - {"ground"}
        for other in contacts.values():
            shares_body = other.name != event.contact and own & set(other.bodies)
            if shares_body and before >= 0 and run.mode(other.name)[before] != "open":
                return event.t
    return None


def by_newtons_law(system: System, run: Solution) -> float:
    """The last instant up to which our motion is the same if its impacts follow Newton's law."""
    bouncing = [
        one for one in system.mechanism.contacts if isinstance(one, Contact) and one.law != "newton"
    ]
    if not bouncing or not strikes(run):
        return float(run.t[-1])
    others = [replace(one, law="newton") for one in bouncing]
    other = with_numbers_of(assemble(with_others(system.mechanism, set(), others)), system.values)
    try:
        again = simulate(
            other,
            float(run.t[-1]),
            start=run.take([0]),
            times=run.t,
            rtol=tol.RTOL_COMPARISON_ROUGH,
            events=(),
        )
    except (ModelError, SolveError):
        return strikes(run)[0]
    difference = np.zeros(len(run))
    for body in run.mechanism.bodies:
        mine, theirs = run[body.name], again[body.name]
        for key, unit in (("x", system.length), ("y", system.length), ("angle", 1.0)):
            difference = np.maximum(
                difference, np.abs(getattr(mine, key) - getattr(theirs, key)) / unit
            )
    differs = np.flatnonzero(difference > tol.COMPARISON_IMPACTS_SAME)
    return float(run.t[differs[0] - 1]) if len(differs) else float(run.t[-1])
