"""Which contacts an analysis of driven motions, or of rest, keeps closed.

What joints and drivers leave free is determined by what bodies lie on, ropes that are taut, stops
and limits that are met. At the first position those places that touch are taken as closed: their
normal rows are constraints, as of a joint, and rub with the friction of their contact. Where that
leaves a motion which one that is nearly closed determines, that one is closed too; and where wheels
are still free to slip, they roll.
"""

from __future__ import annotations

import contextlib
from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from mbody.analysis.contact.contact_choice import ContactChoice
from mbody.analysis.position.assembly_analysis import closed, set_drive
from mbody.errors import ModelError, SolveError
from mbody.kernels.layout import Work
from mbody.model.body import Guesses
from mbody.model.closed_mechanism import with_others
from mbody.model.element import listed
from mbody.model.joint_contacts import limits_of
from mbody.model.mechanism import Mechanism
from mbody.model.numbers import number_in
from mbody.model.simulation import STATE
from mbody.system.assembler import assemble
from mbody.system.other_numbers import with_numbers_of
from mbody.system.rank import too_large
from mbody.system.system import System

__all__ = [
    "ClosedSystem",
    "closed_notes",
    "has_closed_contacts",
    "reclosed",
    "with_closed_contacts",
]

Array = np.ndarray

#: Contacts that a note names.
NAMED = 8
#: What says where a body begins.
PLACES = ("x", "y", "angle")


def has_closed_contacts(mechanism: Mechanism) -> bool:
    """Whether some of its contacts are closed for good."""
    return any(one.closed for one in mechanism.contacts)


class ClosedSystem(NamedTuple):
    """A system whose contacts are closed where they determine its position.

    Attributes
    ----------
    system : System
    guess : mapping or None
        Guesses of bodies: those of its simulation's start, too, where contacts are closed.
    notes : tuple of str
        What is closed.
    remedy : str
        What contacts could do where something is still free.
    """

    system: System
    guess: Guesses | None
    notes: tuple[str, ...] = ()
    remedy: str = ""


def with_closed_contacts(
    system: System,
    t: float,
    drive: Mapping[str, float],
    guess: Guesses | None = None,
    *,
    free: int = 0,
) -> ClosedSystem:
    """The system with the contacts that determine its position closed, by the first design of a
    batch; the system itself where there are none, or where joints and drivers leave no more than
    `free` motions.

    Parameters
    ----------
    system : System
    t : float
        Time of the first position.
    drive : mapping
        Values of drivers by name, in place of those of their laws.
    guess : mapping, optional
        Guesses of bodies by name.
    free : int
        Motions that may be left: then what is only near stays open, and wheels may slip.
    """
    machine = system.mechanism
    limits = system.once("limits", lambda: limits_of(machine))
    if not (machine.contacts or limits) or too_large(system):
        return ClosedSystem(system, guess)
    begun: Guesses = {**_guesses_of_start(machine), **(guess or {})}
    if has_closed_contacts(machine):
        return ClosedSystem(system, begun, closed_notes(machine))
    whole = _kept(system, "whole", with_others(machine, set(), limits))
    choices = [ContactChoice(whole, work, free) for work in _positions(whole, t, drive, begun)]
    if not choices:
        return ClosedSystem(system, guess)  # whose analysis says why its loops do not close
    found = min(choices, key=lambda one: (max(one.left - free, 0), len(one.notes)))
    if not found.places:
        return ClosedSystem(system, guess, remedy=found.remedy)
    rolls_from = _rolls_from(whole, found, t, drive, begun)
    closing = with_others(machine, set(), found.elements(rolls_from))
    made = with_numbers_of(_kept(system, found.key, closing, rolls_from), system.values)
    notes = (*closed_notes(made.mechanism), *found.notes)
    return ClosedSystem(made, begun, notes, found.remedy)


def reclosed(
    system: System, closed: Mapping[str, tuple[tuple[int, ...], tuple[float, ...]]]
) -> System:
    """The system with the same contacts closed as those of another one: by name the numbers of
    their places, and where those that roll do so from.

    Raises
    ------
    LookupError
        For a contact, or a place of it, that there is not.
    """
    machine = system.mechanism
    known = {one.name: one for one in (*machine.contacts, *limits_of(machine))}
    made = [
        replace(known[name], closed=places, rolls_from=begun)
        for name, (places, begun) in closed.items()
    ]
    return with_numbers_of(assemble(with_others(machine, set(), made)), system.values)


def _positions(
    system: System, t: float, drive: Mapping[str, float], guess: Guesses
) -> Iterator[Work]:
    """Workspaces at the position with the drivers, which move bodies that nothing else holds, and
    where they are without; none where loops do not close.
    """
    try:
        yield closed(system, t, drive, guess).work
    except SolveError:
        return
    machine = system.mechanism
    without = with_others(machine, {driver.name for driver in machine.drivers}, ())
    work = system.work()
    set_drive(system, work, t, drive)
    with contextlib.suppress(ModelError, SolveError):  # what follows a driver is no help
        work.q[:] = closed(_kept(system, "joints", without), t, {}, guess).work.q
        yield work


def _rolls_from(
    system: System, found: ContactChoice, t: float, drive: Mapping[str, float], guess: Guesses
) -> dict[str, tuple[float, ...]]:
    """Where bodies that roll do so from, by contact: where they begin, at t = 0 by the laws of the
    drivers, so that it does not depend on the instants that are requested; where loops do not close
    so, the first position.
    """
    if not found.rolls:
        return {}
    work = found.work
    if t or drive:
        work = next(_positions(system, 0.0, {}, guess), work)
    of = {one.name: one.bodies for one in system.mechanism.contacts}

    def axes(body: str) -> tuple[float, float, float]:
        n = 3 * system.bodies[body]
        return system.numbers.link_axes(body, *work.q[n : n + 3, 0].tolist())

    return {name: (*axes(of[name][0]), *axes(of[name][1])) for name in sorted(found.rolls)}


def _kept(system: System, key: Any, machine: Mechanism, rolls_from: Any = None) -> System:
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
    rest = f", {listed(rolls, NAMED)} without slip" if rolls else ""
    return (
        f"{what} {listed(names, NAMED)} {are} taken as closed{rest}: joints and drivers alone "
        "leave their bodies free",
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
