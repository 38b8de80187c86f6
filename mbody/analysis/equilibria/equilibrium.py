"""The analysis `equilibrium`: where a mechanism with free motions rests, and whether it stays."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from mbody.analysis.contact.closed_contacts import with_closed_contacts
from mbody.analysis.driven.contacts import pulled
from mbody.analysis.driven.runner import Runner
from mbody.analysis.driven.time_grid import by_time
from mbody.analysis.equilibria.contact_reserve import ContactReserve
from mbody.analysis.equilibria.friction_bands import (
    Band,
    FrictionReserve,
    Reserve,
    RestBand,
    bands_of,
    holding_sentences,
)
from mbody.analysis.equilibria.lift_off import lifting
from mbody.analysis.equilibria.rest_positions import AtRestPositions
from mbody.analysis.equilibria.search import ZERO, Rest, RestSearch
from mbody.analysis.equilibria.sentences import Words
from mbody.analysis.freedom.free_motions import FreeMotion, free_motions, rates_of
from mbody.analysis.freedom.single_design import single_design, single_time
from mbody.analysis.position.assembly_analysis import closed
from mbody.analysis.position.tangent_space import Array, Manifold, Place
from mbody.errors import ModelError, SolveError, remedy
from mbody.model.body import Guesses
from mbody.model.mechanism import Mechanism
from mbody.model.remarks import kept_states, left_out, without_friction
from mbody.solution.contact_ranges import rubs_by_contacts_alone
from mbody.solution.doubts import doubted
from mbody.solution.heading import heading, unit_symbols
from mbody.solution.histories import BodyHistory, Reaction, Record
from mbody.solution.places import link_poses
from mbody.solution.solution import Solution
from mbody.system.rank import DENSE, too_large
from mbody.system.read_only import lock
from mbody.system.system import System

__all__ = ["Equilibria", "Equilibrium", "equilibrium", "search", "stability_of"]

#: Free motions up to which rest positions are sought; 30 take some ten seconds, and of 60 a descent
#: no longer ends.
FREE = 40
#: A part of the stiffness below which it counts as symmetric, or an eigenvalue as real.
UNEVEN = 1e-6


@dataclass(frozen=True, eq=False)
class Equilibrium:
    """One rest position.

    Attributes
    ----------
    solution : Solution
        Statics there: the position, every joint force, the effort of drivers that hold.
    stability : str
        ``"stable"``, ``"unstable"`` or ``"neutral"`` (no force to first order).
    stiffness : array (free, free)
        K = −∂f/∂q along the free motions, joint forces fixed: [torque/rad] or [force/length]
        by what the leaders do.
    motions : tuple of FreeMotion
        The free motions in whose rates it is given.
    frequencies : tuple of float
        Natural frequencies [rad/time] of a stable position whose free motions all have inertia,
        damping left out; empty for others.
    residual : float
        What drives it still, as a part of the greatest load, or of how fast the loads change.
    notes : tuple of str
        Sentences.
    """

    solution: Solution
    stability: str
    stiffness: Array
    motions: tuple[FreeMotion, ...]
    frequencies: tuple[float, ...]
    residual: float
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        lock(self)

    def __getitem__(self, body: str) -> BodyHistory:
        return self.solution[body]

    def reaction(self, joint: str, on: str | None = None) -> Reaction:
        """Force and torque of a joint, as `Solution.reaction`."""
        return self.solution.reaction(joint, on)

    def data(self, angle: str = "deg") -> dict[str, Any]:
        """The same as plain lists and texts, ready for JSON."""
        return {
            "stability": self.stability,
            "stiffness": self.stiffness.tolist(),
            "motions": [motion.data() for motion in self.motions],
            "frequencies": list(self.frequencies),
            "residual": self.residual,
            "notes": list(self.notes),
            "statics": self.solution.data(angle),
        }


@dataclass(frozen=True, eq=False)
class Equilibria(AtRestPositions[Equilibrium]):
    """The rest positions that were found, stable ones first; ``print`` shows them as a table.

    Attributes
    ----------
    positions : tuple of Equilibrium
        Stable ones first: those that need no friction.
    bands : tuple of RestBand
        Of one free motion with rough joints: positions at which friction holds, from end to end,
        in the order of the rest positions in them.
    status : str
        ``"completed"``, or ``"doubtful: …"`` with the first doubt.
    doubts : tuple of Doubt
        Why some rest positions may be missing.
    notes : tuple of str
        Sentences, those of the doubts among them.

    Examples
    --------
    >>> import mbody
    >>> swing = mbody.Mechanism("pendulum")
    >>> swing.add(mbody.Body("bob", mass=1.0, cg=(1.0, 0.0)), mbody.Revolute("O", "ground", "bob"))
    >>> swing.add(mbody.Gravity("gravity", y=-9.81))
    >>> [rest.stability for rest in mbody.equilibrium(swing)]
    ['stable', 'unstable']
    """

    bands: tuple[RestBand, ...] = ()

    @property
    def stable(self) -> tuple[Equilibrium, ...]:
        """Those to which it comes back by itself."""
        return tuple(one for one in self.positions if one.stability == "stable")

    def data(self, angle: str = "deg") -> dict[str, Any]:
        """Everything as a plain dict of numbers, text, lists and dicts, ready for JSON."""
        return {
            **heading(self.mechanism, "equilibrium", unit_symbols(self.units, angle), self),
            "t": self.t,
            "positions": [one.data(angle) for one in self.positions],
            **({"bands": [band.data() for band in self.bands]} if self.bands else {}),
        }


def equilibrium(
    model: Mechanism | System,
    *,
    free: str | Sequence[str] = (),
    starts: Guesses | Sequence[Guesses] = (),
    t: float = 0.0,
) -> Equilibria:
    """Rest positions of a mechanism with free motions, joint forces there, and their stability.

    Nᵀ f = 0 at a closed position, N spanning its free motions: springs, gravity, fields and other
    loads balance. Stable where the tangent stiffness −Nᵀ ∂(f − Φ_qᵀ λ)/∂q N is positive definite.

    Parameters
    ----------
    model : Mechanism or System
        With free motions; drivers, if there are any, hold what their laws say at t.
    free : str or sequence of str, optional
        Drivers that are released.
    starts : mapping or sequence of mappings, optional
        Further guesses to begin from: by body an angle [rad] or (x, y, angle) of the link axes.
    t : float
        Time at which the laws of drivers and loads are taken.

    Returns
    -------
    Equilibria
        Stable positions first, then the nearest to the start first.

    Raises
    ------
    ModelError
        For drivers, starts or times that are none, or a batch of designs.
    SolveError
        When the loops do not close, nothing is free, or no rest position is found: with the least
        force that is left, and where.

    Notes
    -----
    A single free motion is walked all round, or both ways as far as it goes. Between neighbouring
    places the drive is a cubic, by its values and slopes, within an error that is measured; steps
    are divided until each has a certain number of zeros, so that all positions on the curve of the
    start are found, stable or not. Where distances in the constraints pass zero, as of a weight
    that is drawn through its pulley, the walk turns over with them. The surface of two free motions
    is covered with charts, which are divided until each cell has one zero or none; around points
    where the ends of a spring meet, and its force jumps, the charts are polar. Positions on other
    circuits of assembly are found from `starts` on them. Of more free motions, up to 40, the search
    goes from a fixed spread of starts, and from each position that it finds on by turning over one
    leader after the other; it may miss some. Its cost grows by the cube of their number, and 30
    take ten seconds. What may be missing is reported by `doubts` of kind "incomplete".

    Examples
    --------
    >>> import mbody
    >>> machine = mbody.Mechanism("pendulum")
    >>> machine.add(mbody.Body("rod", mass=2.0, cg=(0.5, 0.0)))
    >>> machine.add(mbody.Revolute("O", "ground", "rod"))
    >>> machine.add(mbody.Gravity("gravity", y=-9.81))
    >>> for rest in equilibrium(machine):
    ...     print(rest.stability, round(float(np.degrees(rest["rod"].angle[0]))))
    stable -90
    unstable 90
    """
    system = single_design("equilibrium", model, free)
    time = single_time("equilibrium", system, t)
    chosen = with_closed_contacts(system, time, {}, free=1)
    _, *others = guesses(starts)
    found = search(chosen.system, [chosen.guess, *others], time)
    found.notes = [*chosen.notes, *found.notes]
    return found.equilibria()


def guesses(starts: Any) -> list[Guesses | None]:
    """The guesses to begin from, the description's own first."""
    given = [starts] if isinstance(starts, Mapping) else starts
    if not isinstance(given, (list, tuple)) or not all(isinstance(g, Mapping) for g in given):
        raise ModelError(
            f'starts must be guesses such as [{{"crank": 0.3}}, {{"crank": 2.0}}], not {starts!r}'
        )
    return [None, *given]


def search(system: System, starts: Sequence[Guesses | None], t: float) -> _RestResults:
    """Look for rest positions from some guesses."""
    found, notes = None, []
    for guess in starts:
        start = closed(system, t, {}, guess)
        notes += [note for note in start.notes if note not in notes]
        if too_large(system):
            raise SolveError(
                f"equilibrium of '{system.mechanism.name}': {system.rows} rows of "
                f"{system.coordinates} coordinates are too many, it takes up to {DENSE} rows"
            )
        manifold = Manifold(system, start.work, t)
        here = manifold.place(start.work.q[: system.coordinates, 0].copy())
        if here is None:
            # a load without a value: statics says which, and why
            Runner(system, "statics").scalar(start, by_time(system, np.array([t])))
        assert here is not None
        if not len(here.motions):
            names = [driver.name for driver in system.drivers]
            how = remedy(python=f"free={names[:1]}", command=f"--free {names[0] if names else ''}")
            or_else = f", or release a driver, {how}" if names else ""
            raise SolveError(
                f"nothing is free in '{system.mechanism.name}': joints and drivers fix every body; "
                f"use statics{or_else}"
            )
        if len(here.motions) > FREE:
            raise SolveError(
                f"equilibrium of '{system.mechanism.name}': {len(here.motions)} free motions are "
                f"too many for its search, it takes up to {FREE}: hold some of them by drivers"
            )
        if found is None:
            reserve: Reserve
            if rubs_by_contacts_alone(system):
                reserve = ContactReserve(manifold)
            else:
                reserve = FrictionReserve(manifold, start.regularization)
            found = _RestResults(system, t, RestSearch(manifold), reserve)
        found.search.around(here)
    assert found is not None
    machine, own = system.mechanism, system.first_states[:, 0]
    values = {one.name: float(z) for one, z in zip(machine.states, own, strict=True)}
    notes = [*notes, *left_out(machine, "equilibrium")]
    notes += without_friction(machine, "equilibrium")
    found.notes = [*notes, *kept_states(machine, values, "equilibrium")]
    return found


class _RestResults:
    """Makes results of what a search found."""

    def __init__(
        self,
        system: System,
        t: float,
        search: RestSearch,
        reserve: Reserve,
    ) -> None:
        self.system, self.t, self.search, self.reserve = system, t, search, reserve
        self.mechanism, self.manifold = system.mechanism, search.manifold
        self.notes: list[str] = []

    def equilibria(self) -> Equilibria:
        """All rest positions."""
        rests, words = self.search.found, Words(self.system, self.search)
        own = self._bands()
        if not rests and not own:
            raise words.nothing()
        pairs = [(self.one(rest), rest) for rest in rests]
        order = {"stable": 0, "neutral": 1, "unstable": 2}
        pairs.sort(key=lambda pair: order[pair[0].stability])
        found = [one for one, _ in pairs]
        free = max((len(one.motions) for one in found), default=1)
        places = [rest.place for _, rest in pairs]
        bands = tuple(
            sorted(
                (self._band(band, own, places) for band in own),
                key=lambda band: band.positions or (len(found),),
            )
        )
        self.notes += [note for note in words.facts() if note not in self.notes]
        if self.search.walks:
            left = without_friction(self.mechanism, "equilibrium")
            self.notes = [note for note in self.notes if note not in left]
        self.notes += holding_sentences(self.mechanism, bands, bool(self.reserve))
        every = Equilibria(
            self.mechanism.name,
            self.mechanism.units,
            self.t,
            tuple(found),
            notes=tuple(self.notes),
            bands=bands,
        )
        return doubted(every, words.doubts(free))

    def _bands(self) -> list[Band]:
        """The bands of single free motions in which friction holds."""
        curves = {id(curve): curve for curve, _ in self.search.walks} if self.reserve else {}
        found = []
        for key, curve in curves.items():
            walks = [walk for one, walk in self.search.walks if id(one) == key]
            found += bands_of(curve, walks, self.reserve)
        return found

    def _band(self, band: Band, every: list[Band], places: list[Place]) -> RestBand:
        """A band in the poses of its ends; the numbers of the rest positions in it."""
        numbers = tuple(
            n
            for n, place in enumerate(places)
            if self.reserve.at(place) > ZERO * self.manifold.scale_of(place)
            and min(every, key=lambda one: self._apart(one, place)) is band
        )
        inside = band.inside[0]
        motion = free_motions(
            self.system, np.append(inside.place.q, np.zeros(3)), inside.place.motions
        )[0]
        b = 3 * self.system.bodies[motion.leader]
        ways = inside.along[b + 2 : b + 3] if motion.turns else inside.along[b : b + 2]
        ends = [
            None if node is None else self._pose(node.place) for node in (band.first, band.last)
        ]
        if ways[np.abs(ways).argmax()] < 0.0:
            ends.reverse()
        return RestBand(ends[0], ends[1], motion.leader, numbers)

    def _apart(self, band: Band, place: Place) -> float:
        """How far a place is from what is known of a band."""
        return min(self.manifold.apart(node.place.q, place.q) for node in band.inside)

    def _pose(self, place: Place) -> dict[str, tuple[float, float, float]]:
        """Link axes of every body."""
        return link_poses(self._statics(place))

    def _statics(self, place: Place) -> Solution:
        """Statics of a place that is balanced already, as a part of the greatest load: their sums
        may vanish.
        """
        start = closed(self.system, self.t, {}, None, pose=np.append(place.q, np.zeros(3)))
        instant = by_time(self.system, np.array([self.t]))
        runner = Runner(self.system, "statics", unbalanced=np.inf)
        record = Record([runner.scalar(start, instant)], 1, batch=False)
        return runner.solution(start, instant, record)

    def one(self, rest: Rest) -> Equilibrium:
        """One rest position with its forces and its stiffness."""
        place, system = rest.place, self.system
        motions = free_motions(system, np.append(place.q, np.zeros(3)), place.motions)
        word, frequencies, notes = stability_of(rest, self.manifold.mass(place.motions))
        if rest.row:
            notes.append("one of a row of rest positions: nothing drives it back along them")
        if rest.singular:
            notes.append(
                "singular position: more is free here, to first order, than nearby; branches of "
                "the motion meet"
            )
        if word == "stable":
            notes += lifting(self.manifold, rest)
        solution = self._statics(place)
        notes += pulled(solution)
        return Equilibrium(
            solution=solution,
            stability=word,
            stiffness=self.in_leaders(place, motions, rest.stiffness),
            motions=motions,
            frequencies=frequencies,
            residual=place.size / rest.top if rest.top else 0.0,
            notes=tuple(notes),
        )

    def in_leaders(self, place: Place, motions: Sequence[FreeMotion], K: Array) -> Array:
        """The stiffness for unit rates of the leaders."""
        rates = rates_of(self.system, motions).reshape(len(motions), -1)
        basis = rates / self.manifold.scale @ place.motions.T
        return np.asarray(basis @ K @ basis.T)


def stability_of(rest: Rest, mass: Array) -> tuple[str, tuple[float, ...], list[str]]:
    """Word, natural frequencies and sentences of a rest position.

    Notes
    -----
    A symmetric stiffness is judged by its eigenvalues. One that is not, as of loads that follow a
    body, is judged by those of M⁻¹K, which show flutter too; where a free motion has no inertia,
    by its own.
    """
    K = rest.stiffness
    zero = ZERO * max(float(np.abs(K).max(initial=0.0)), rest.top)
    massive = bool(np.linalg.eigvalsh(mass).min() > 1e-12 * np.abs(mass).max())
    if np.abs(K - K.T).max() <= UNEVEN * float(np.abs(K).max()) + zero:
        sizes = np.linalg.eigvalsh(0.5 * (K + K.T))
        word = "neutral"
        if sizes.min() < -zero:
            word = "unstable"
        elif sizes.min() > zero:
            word = "stable"
        if word != "stable" or not massive:
            return word, (), []
        squares = np.linalg.eigvals(np.linalg.solve(mass, 0.5 * (K + K.T))).real
        return word, tuple(np.sqrt(np.sort(squares)).tolist()), []
    note = "its stiffness is not symmetric: the loads have no potential"
    roots = np.linalg.eigvals(np.linalg.solve(mass, K) if massive else K)
    top = float(np.abs(roots).max())
    if (np.abs(roots.imag) > UNEVEN * top).any() and massive:
        return "unstable", (), [f"{note}, and it flutters"]
    if not massive:
        note += "; a free motion has no inertia, so that only divergence is looked for, no flutter"
    if roots.real.min() < -UNEVEN * top:
        return "unstable", (), [note]
    if roots.real.min() <= UNEVEN * top:
        return "neutral", (), [note]
    frequencies = tuple(np.sqrt(np.sort(roots.real)).tolist()) if massive else ()
    return "stable", frequencies, [note]
