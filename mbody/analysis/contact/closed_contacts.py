"""Which contacts an analysis of driven motions, or statics, keeps closed.

What joints and drivers leave free is determined by what bodies lie on, ropes that are taut, stops
and limits that are met. At the first position those places that touch are taken as closed: their
normal rows are constraints, as of a joint, and have the friction of their contact. Where that
leaves a motion which one that is nearly closed determines, that one is closed too; and where wheels
are still free to slip, they roll.
"""

from __future__ import annotations

import contextlib
from collections import defaultdict
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from mbody.analysis.position.assembly_analysis import closed, set_driver_values
from mbody.core.tolerances import CONTACT_GAP_FAR, CONTACT_GAP_MEANT, CONTACT_GAP_NONE, ROWS_SAME
from mbody.errors import ModelError, SolveError
from mbody.kernels.layout import Work
from mbody.model.body import Guesses
from mbody.model.contact import Contact
from mbody.model.element import listed
from mbody.model.joint_limits import limits_of
from mbody.model.mechanism import Mechanism
from mbody.model.model_notes import with_others
from mbody.model.numbers import number_in
from mbody.model.simulation import STATE
from mbody.solution.solution import Solution
from mbody.system.assembler import assemble
from mbody.system.rank import dense, rank_of
from mbody.system.system import System, too_large, with_numbers_of

if TYPE_CHECKING:
    from mbody.analysis.contact.unilateral import ContactPoint

# -- Contacts closed at a position, and those that determine it --------------------------------

Array = np.ndarray


@dataclass(frozen=True)
class _Candidate:
    """A contact point that may be closed: its number, its gap in model lengths, its
    dimensionless row.
    """

    contact_point: int
    gap: float
    row: Array


class ContactChoice:
    """Contacts closed at the position of a workspace, whose signals are set.

    `places`: By contact the numbers of its places that are closed.
    `rolls`: Contacts that roll.
    `notes`: What was not touching.
    """

    def __init__(self, system: System, work: Work, free: int) -> None:
        from mbody.analysis.contact.unilateral import Unilateral

        self.system, self.work, self.free = system, work, free
        self.places: dict[str, list[int]] = defaultdict(list)
        self.notes: list[str] = []
        self.rolls: set[str] = set()
        self.uni = Unilateral(system)
        self.rows = self.uni.read(work)
        self.G = dense(system, work)[1]
        if self._free_motions(self.G) <= free:
            return
        within = self.uni.within_edges(self.rows, work, CONTACT_GAP_MEANT * system.length, 0.0)
        gaps = self.uni.gaps(self.rows) / system.length
        candidates = [
            _Candidate(n, abs(float(gaps[n])), self._row(self.uni.contact_points[n].normal))
            for n in np.flatnonzero(
                within & ~self.uni.one_way & (np.abs(gaps) <= CONTACT_GAP_MEANT)
            ).tolist()
        ]
        candidates.sort(key=lambda one: one.gap)
        for one in candidates:
            tight = one.gap <= CONTACT_GAP_NONE
            if tight or not free:
                self._close(one, tight)
        for name in list(self.places):
            self._roll(name)

    def _free_motions(self, G: Array) -> int:
        """Number of motions that rows leave."""
        return rank_of(G).free

    def _row(self, number: int) -> Array:
        """One row of the active set, dimensionless."""
        unit = 1.0 if self.uni.angular[number] else 1.0 / self.system.length
        own = self.rows.block[number] / self.uni.units[number]
        return np.asarray(unit * own * self.system.coordinate_units)

    def _close(self, one: _Candidate, tight: bool) -> None:
        """Close a place; one that is only near where it takes a motion that nothing else takes."""
        size = float(np.linalg.norm(one.row))
        same = np.abs(np.abs(self.G @ one.row) - size * np.linalg.norm(self.G, axis=1))
        if (same <= ROWS_SAME * size).any():
            return  # the same row is there
        more = np.vstack([self.G, one.row])
        if not tight and self._free_motions(more) == self._free_motions(self.G):
            return
        self.G = more
        name = self.uni.contact_points[one.contact_point].name
        first = next(n for n, point in enumerate(self.uni.contact_points) if point.name == name)
        self.places[name].append(one.contact_point - first)
        if not tight:
            gap = one.gap * self.system.length
            unit = self.system.mechanism.units.length
            self.notes.append(
                f"contact '{name}' is {gap:.3g} {unit} open where the guess puts its bodies, and "
                "is closed: begin with them touching to choose yourself"
            )

    def _roll(self, name: str) -> None:
        """Let a wheel with friction roll where it could slip by a motion that nothing else
        takes.
        """
        own = [point for point in self.uni.contact_points if point.name == name]
        closed = [own[n] for n in self.places[name]]
        if self._free_motions(self.G) <= self.free or not all(map(_can_roll, closed)):
            return
        more = np.vstack([self.G, *(self._row(point.tangent) for point in closed)])
        if self._free_motions(self.G) - self._free_motions(more) == len(closed):
            self.G = more
            self.rolls.add(name)

    @property
    def left(self) -> int:
        """Number of motions that are left."""
        return self._free_motions(self.G)

    @property
    def remedy(self) -> str:
        """Hint naming the open contact nearest to closing, where degrees of freedom are left; empty
        without one.
        """
        if self.left <= self.free:
            return ""
        points, gaps = self.uni.contact_points, self.uni.gaps(self.rows)
        unit = self.system.mechanism.units.length
        for n in np.argsort(np.abs(gaps)).tolist():
            one, gap = points[n], abs(float(gaps[n]))
            if (
                one.name in self.places
                or self.uni.one_way[n]
                or gap > CONTACT_GAP_FAR * self.system.length
            ):
                continue
            size = gap / self.uni.unit_of(n)
            unit = "rad" if self.uni.angular[one.normal] else unit
            return f", or begin with '{one.name}' touching, which is {size:.4g} {unit} open"
        frictional = [name for name in self.places if self._has_friction(name)]
        if not frictional:
            return ""
        return (
            f", or follow it by simulate, which decides whether friction of {listed(frictional)} "
            "holds it"
        )

    def _has_friction(self, name: str) -> bool:
        own = [point for point in self.uni.contact_points if point.name == name]
        return name not in self.rolls and any(point.static > 0.0 for point in own)

    @property
    def key(self) -> tuple[tuple[str, tuple[int, ...], bool], ...]:
        """Names, contact points and rolling of the closed contacts, sorted: a key to compare
        choices by.
        """
        return tuple(
            (name, tuple(sorted(self.places[name])), name in self.rolls)
            for name in sorted(self.places)
        )

    def elements(self, rolls_from: Mapping[str, tuple[float, ...]]) -> list[Any]:
        """The contacts with what is closed of them; where those that roll do so from."""
        by_name = {one.name: one for one in self.system.mechanism.contacts}
        return [
            replace(by_name[name], closed=places, rolls_from=rolls_from[name] if rolls else ())
            for name, places, rolls in self.key
        ]


def _can_roll(point: ContactPoint) -> bool:
    return point.tangent >= 0 and point.candidate.round and point.friction > 0.0


#: Contacts that a note names.
NAMED = 8
#: What says where a body begins.
PLACES = ("x", "y", "angle")


def has_closed_contacts(mechanism: Mechanism) -> bool:
    """Whether some of its contacts are closed for good."""
    return any(one.closed for one in mechanism.contacts)


class ClosedSystem(NamedTuple):
    """A system whose contacts are closed where they determine its position.

    `guess`: Guesses of bodies: those of its simulation's start, too, where contacts are closed.
    `notes`: What is closed.
    `remedy`: What contacts could do where something is still free.
    """

    system: System
    guess: Guesses | None
    notes: tuple[str, ...] = ()
    remedy: str = ""


def with_closed_contacts(
    system: System,
    t: float,
    driver_values: Mapping[str, float],
    guess: Guesses | None = None,
    *,
    free: int = 0,
) -> ClosedSystem:
    """The system with the contacts that determine its position closed, by the first design of a
    batch; the system itself where there are none, or where joints and drivers leave no more than
    `free` motions.
    """
    machine = system.mechanism
    limits = system.once("limits", lambda: limits_of(machine))
    if not (machine.contacts or limits) or too_large(system):
        return ClosedSystem(system, guess)
    begun: Guesses = {**_guesses_of_start(machine), **(guess or {})}
    if has_closed_contacts(machine):
        return ClosedSystem(system, begun, closed_notes(machine))
    whole = _system_of_topology(system, "whole", with_others(machine, set(), limits))
    choices = [
        ContactChoice(whole, work, free) for work in _positions(whole, t, driver_values, begun)
    ]
    if not choices:
        return ClosedSystem(system, guess)  # whose analysis says why its loops do not close
    found = min(choices, key=lambda one: (max(one.left - free, 0), len(one.notes)))
    if not found.places:
        return ClosedSystem(system, guess, remedy=found.remedy)
    rolls_from = _rolls_from(whole, found, t, driver_values, begun)
    closing = with_others(machine, set(), found.elements(rolls_from))
    made = with_numbers_of(
        _system_of_topology(system, found.key, closing, rolls_from), system.values
    )
    notes = (*closed_notes(made.mechanism), *found.notes)
    return ClosedSystem(made, begun, notes, found.remedy)


def reclosed(
    system: System, closed: Mapping[str, tuple[tuple[int, ...], tuple[float, ...]]]
) -> System:
    """The system with the same contacts closed as those of another one: by name the numbers of
    their places, and where those that roll do so from.
    """
    machine = system.mechanism
    known = {one.name: one for one in (*machine.contacts, *limits_of(machine))}
    made = [
        replace(known[name], closed=places, rolls_from=begun)
        for name, (places, begun) in closed.items()
    ]
    return with_numbers_of(assemble(with_others(machine, set(), made)), system.values)


def _positions(
    system: System, t: float, driver_values: Mapping[str, float], guess: Guesses
) -> Iterator[Work]:
    """Workspaces at the position with the drivers, which move bodies that nothing else holds, and
    where they are without; none where loops do not close.
    """
    try:
        yield closed(system, t, driver_values, guess).work
    except SolveError:
        return
    machine = system.mechanism
    without = with_others(machine, {driver.name for driver in machine.drivers}, ())
    work = system.work()
    set_driver_values(system, work, t, driver_values)
    with contextlib.suppress(ModelError, SolveError):  # what follows a driver is no help
        work.q[:] = closed(_system_of_topology(system, "joints", without), t, {}, guess).work.q
        yield work


def _rolls_from(
    system: System,
    found: ContactChoice,
    t: float,
    driver_values: Mapping[str, float],
    guess: Guesses,
) -> dict[str, tuple[float, ...]]:
    """Where bodies that roll do so from, by contact: where they begin, at t = 0 by the laws of the
    drivers, so that it does not depend on the instants that are requested; where loops do not close
    so, the first position.
    """
    if not found.rolls:
        return {}
    work = found.work
    if t or driver_values:
        work = next(_positions(system, 0.0, {}, guess), work)
    bodies_of = {one.name: one.bodies for one in system.mechanism.contacts}

    def axes(body: str) -> tuple[float, float, float]:
        n = 3 * system.bodies[body]
        return system.numbers.link_axes(body, *work.q[n : n + 3, 0].tolist())

    return {
        name: (*axes(bodies_of[name][0]), *axes(bodies_of[name][1])) for name in sorted(found.rolls)
    }


def _system_of_topology(
    system: System, key: Any, machine: Mechanism, rolls_from: Any = None
) -> System:
    """A system of another mechanism with the numbers of a system, or of the first of its designs;
    its topology is kept with that of the system, and with where bodies roll from the last one.
    """
    known = system.plans.setdefault("closed contacts", {})
    kept = known.get(key)
    if kept is None or kept[0] != rolls_from:
        kept = known[key] = rolls_from, assemble(machine)
    one = system if system.batch is None else system.design(0)
    return with_numbers_of(kept[1], one.values)


def closed_notes(mechanism: Mechanism) -> tuple[str, ...]:
    """A sentence of the contacts that are closed for good."""
    names = [one.name for one in mechanism.contacts if one.closed]
    if not names:
        return ()
    rolls = [one.name for one in mechanism.contacts if one.rolls]
    what, are = ("contact", "is") if len(names) == 1 else ("contacts", "are")
    without_slip = f", {listed(rolls, NAMED)} without slip" if rolls else ""
    return (
        f"{what} {listed(names, NAMED)} {are} taken as closed{without_slip}: joints and drivers "
        "alone leave their bodies free",
    )


def _guesses_of_start(mechanism: Mechanism) -> dict[str, Any]:
    """Guesses by where the simulation of a mechanism begins, of link axes."""
    own = mechanism.simulation
    found: dict[str, Any] = {}
    for body in mechanism.bodies:
        start = {} if own is None else own.start.get(body.name, {})
        given = {key: x for key, x in start.items() if key in PLACES}
        numbers = {
            key: number_in(mechanism, x, STATE[key], "simulation", f"start.{body.name}.{key}")
            for key, x in given.items()
        }
        angle = numbers.get("angle", body.guess.angle)
        place = [numbers.get(key, getattr(body.guess, key)) for key in ("x", "y")]
        if given and place == [None, None]:
            found[body.name] = angle
        elif given:
            found[body.name] = (*(x or 0.0 for x in place), angle or 0.0)
    return found


# -- Instants of a motion at which the same contacts are closed, which are joints then ---------


@dataclass(frozen=True, eq=False)
class ContactPhase:
    """Instants at which the same contacts are closed.

    `system`: With these contacts closed for good, of the same bodies in the same order.
    `instants` (n,)
    `open`: Joints that are separated.
    """

    system: System
    instants: np.ndarray
    open: frozenset[str]


def contact_phases(run: Solution, *, touching: bool = False) -> list[ContactPhase]:
    """The instants of a result by what is closed, or by what is `touching` without a force, too;
    one of all where no contact opens or closes.

    >>> import mbody
    >>> run = mbody.kinematics(mbody.makers.four_bar(1, 3, 2, 3.5), turn=True, instants=5)
    >>> [phase.instants.tolist() for phase in contact_phases(run)]
    [[0, 1, 2, 3, 4]]
    """
    from mbody.solution.contact_points import contact_points_of

    machine = run.mechanism
    if not run.modes or run.stepped is not None or has_closed_contacts(machine):
        return [ContactPhase(run.system, np.arange(len(run)), frozenset())]
    places: list[tuple[str, int, np.ndarray]] = []
    for one in (*machine.contacts, *limits_of(machine)):
        if one.name not in run.modes:
            continue
        if isinstance(one, Contact):
            points = contact_points_of(run, one)
            own = [point.touching if touching else point.closed for point in points]
            places += [(one.name, n, shut) for n, shut in enumerate(own)]
        else:
            shut = np.array([word != "open" for word in run.mode(one.name)])
            places.append((one.name, 0, shut))
    parted = [
        (joint.name, np.array([word == "open" for word in run.mode(joint.name)]))
        for joint in machine.joints
        if joint.name in run.modes
    ]
    every = [row for _, _, row in places] + [row for _, row in parted]
    table = np.array(every, dtype=bool).reshape(len(every), len(run)).T
    found = []
    for kept in np.unique(table, axis=0):
        closed: dict[str, tuple[int, ...]] = {}
        for (name, n, _), is_shut in zip(places, kept, strict=False):
            if is_shut:
                closed[name] = (*closed.get(name, ()), n)
        open_names = (
            name for (name, _), off in zip(parted, kept[len(places) :], strict=True) if off
        )
        system = reclosed(run.system, {name: (own, ()) for name, own in closed.items()})
        instants = np.flatnonzero((table == kept).all(axis=1))
        found.append(ContactPhase(system, instants, frozenset(open_names)))
    return found
