"""Sentences about a search for rest positions: what it met, what it may miss, why it failed."""

from __future__ import annotations

import math

import numpy as np

from mbody.analysis.equilibria.doubt_reasons import (
    directionless_loads,
    jumping_loads,
    without_stiffness,
)
from mbody.analysis.equilibria.search import RestSearch
from mbody.analysis.freedom.free_motions import FreeMotion, free_motions, rates_of
from mbody.analysis.position.tangent_space import Place
from mbody.errors import SolveError
from mbody.solution.doubts import Doubt
from mbody.system.system import System

__all__ = ["Words"]

#: Free motions beyond which the spread of starts is thin.
FEW = 2
#: Why a walk or a cover ended, and what may be missing then.
MISSING = {
    "long": "the free motion was followed as far as {} and goes on: rest positions beyond may be "
    "missing; begin there with starts",
    "stuck": "the free motion could not be followed beyond {}: rest positions beyond may be "
    "missing; begin there with starts",
    "wound": "loads tell whole turns apart: sought up to {}, and half a turn back; rest positions "
    "beyond may be missing; begin there with starts",
    "odd": "an odd number of rest positions was found on the surface of positions around "
    "{}: one at least is missing; begin elsewhere with starts",
    "wide": "the two free motions were searched as far as {} and go on: rest positions beyond may "
    "be missing; begin there with starts",
    "turns": "loads tell whole turns apart: one turn was searched around {}; rest positions in "
    "others may be missing; begin there with starts",
    "unsure": "how many rest positions there are near {} is not certain{}: begin there with starts",
    "alternate": "stable and unstable positions do not alternate near {}: one may be missing; "
    "begin there with starts",
}


class Words:
    """Sentences about one search."""

    def __init__(self, system: System, search: RestSearch) -> None:
        self.system, self.search = system, search
        self.mechanism, self.manifold = system.mechanism, search.manifold

    def facts(self) -> list[str]:
        """What was passed, and what bounds the motion."""
        found = []
        for _, walk in self.search.walks:
            for place in walk.corners:
                where, _ = self.where(place)
                found.append(
                    f"at {where} a prescribed distance is zero: the motion is followed through it"
                )
            for place in walk.crossings:
                where, _ = self.where(place)
                found.append(
                    f"at {where} branches of the motion meet: only the one that goes on smoothly "
                    "was searched; begin on others with starts"
                )
        for why, place in self.search.ends:
            if why == "no value":
                where, _ = self.where(place)
                found.append(f"beyond {where} a load has no value: the search ends there")
        for place in self.search.jumps:
            where, _ = self.where(place)
            note = (
                f"at {where} loads jump and drive it back from both sides: it may stay there, but "
                "no forces balance"
            )
            if note not in found:  # along a crease neighbours read alike
                found.append(note)
        for place in self.search.lifts:
            where, _ = self.where(place)
            note = f"at {where} {self.meeting(place)}, and beside it they drive it away"
            if note not in found:
                found.append(note)
        return found

    def meeting(self, place: Place) -> str:
        """What is so where the ends of loads meet."""
        names = " and ".join(map(repr, directionless_loads(self.manifold, place)))
        return (
            f"the ends of {names} meet, where a force that does not vanish has no direction: no "
            "forces balance"
        )

    def doubts(self, free: int) -> list[Doubt]:
        """Why rest positions may be missing."""
        search, found = self.search, []
        if free > FEW:
            leaders = tuple(motion.leader for motion in self.motions_of(search.found[0].place))
            words = (
                f"{free} free motions: sought from a fixed spread of starts, and by turning over "
                "one leader after the other; further rest positions may be missed; begin near "
                "them with starts"
            )
            found.append(Doubt("incomplete", words, elements=leaders))
        why = [("unsure", place) for place in search.unsure]
        why += [pair for pair in search.ends if pair[0] in MISSING]
        why += [("alternate", place) for place in search.odd]
        for word, place in why:
            where, leader = self.where(place)
            reason, loads = self.reason(place) if word == "unsure" else ("", [])
            message = MISSING[word].format(where, reason)
            if all(message != doubt.message for doubt in found):
                found.append(Doubt("incomplete", message, elements=(leader, *loads)))
        return found

    def reason(self, place: Place) -> tuple[str, list[str]]:
        """Why no number of rest positions is certain near a place, and the loads that are at it."""
        loads = jumping_loads(self.manifold, place)
        if loads:
            forces = "the force of {} jumps" if len(loads) == 1 else "the forces of {} jump"
            return f", as {forces.format(' and '.join(map(repr, loads)))} there", loads
        if without_stiffness(self.manifold, place):
            return ", as nothing drives it back there to first order", []
        return "", []

    def motions_of(self, place: Place) -> tuple[FreeMotion, ...]:
        """The free motions at a place, with their leaders."""
        return free_motions(self.system, np.append(place.q, np.zeros(3)), place.motions)

    def where(self, place: Place, lead: FreeMotion | None = None) -> tuple[str, str]:
        """A place in words, by what a leader does, and that leader."""
        lead = self.motions_of(place)[0] if lead is None else lead
        b = self.system.bodies[lead.leader]
        pose = np.round(place.q[3 * b : 3 * b + 3] / self.manifold.scale[:3], 2) + 0.0
        if lead.turns:
            return f"{math.degrees(pose[2]):.0f} deg of '{lead.leader}'", lead.leader
        x, y = self.system.length * pose[:2]
        return f"({x:.3g}, {y:.3g}) {self.mechanism.units.length} of '{lead.leader}'", lead.leader

    def nothing(self) -> SolveError:
        """The sentence where no rest position was found."""
        name, units = self.mechanism.name, self.mechanism.units
        search = self.search
        away, least = search.ran_away, search.least
        if away is not None:
            far = (away.q / self.manifold.scale).reshape(-1, 3)[:, :2]
            body = self.mechanism.bodies[int(np.abs(far).max(axis=1).argmax())].name
            return SolveError(
                f"no rest position of '{name}': its loads drive '{body}' away without end; hold "
                "it, by a spring or a stop, or drive it",
                body,
            )
        if search.jumps:
            where, body = self.where(search.jumps[0])
            return SolveError(
                f"no rest position of '{name}': its loads drive it from both sides to {where}, "
                "where a distance is zero or a load jumps, so that no forces balance; put a stop "
                "there, or change its loads",
                body,
            )
        if search.lifts:
            where, body = self.where(search.lifts[0])
            return SolveError(
                f"no rest position of '{name}' was met: at {where} "
                f"{self.meeting(search.lifts[0])}; begin beside it with starts",
                body,
            )
        assert least is not None
        motions = self.motions_of(least)
        ways = [rates_of(self.system, [one]).reshape(-1) / self.manifold.scale for one in motions]
        left = [float(least.force @ way) for way in ways]
        # the leader that is driven most; a least drive is flat: more digits would be noise
        n = int(np.argmax(np.abs(left)))
        where, leader = self.where(least, motions[n])
        unit = units.of("torque") if motions[n].turns else units.of("force")
        return SolveError(
            f"no rest position of '{name}' was met: what drives it is least at {where}, where "
            f"{abs(left[n]):.3g} {unit} are left; begin elsewhere with starts, or change its loads",
            leader,
        )
