"""What the sheets of one instant and of many share: textbook names, heading, closing lines."""

from __future__ import annotations

import re
from collections import Counter
from typing import TYPE_CHECKING, Any

import numpy as np

from mbody.model.contact import Contact, Rope
from mbody.model.one_sided_constraint import joined
from mbody.sheets.text_table import Column, numbers, paragraph
from mbody.solution.contact_forces import acting_contacts

if TYPE_CHECKING:
    from collections.abc import Iterable

    from mbody.model.coupling import Coupling
    from mbody.model.driver import Driver
    from mbody.model.mechanism import Mechanism
    from mbody.quantities.units import UnitSystem
    from mbody.solution.event_record import EventRecord
    from mbody.solution.histories import Reaction
    from mbody.solution.solution import Solution

__all__ = [
    "joint_torque",
    "ABOUT",
    "ROUNDING",
    "certified",
    "closing",
    "everyday",
    "force_floor",
    "force_names",
    "forces_on",
    "heading",
    "link_names",
    "noted",
    "remark",
    "swiftness",
    "title",
    "torque_cells",
]

Array = np.ndarray

#: Below a table of joint forces that shows torques.
ABOUT = "torques about the joint's place on its body j"

#: Times of an event that a sheet shows.
SHOWN = 5
#: What is smaller than this part of the greatest of its kind is rounding, shown as 0.
ROUNDING = 1e-9
#: The same where forces are those of least norm, found among many by a softened solve.
REDUNDANT = 1e-7


def force_names(mechanism: Mechanism) -> dict[str, tuple[str, str]]:
    """Textbook names of joint forces and driver efforts: ground is 1, links 2, 3, … as described.

    F_ij is the force of link i on link j: of the ground on a link, else of the higher on the lower
    number. With ten links or more it is written F(12,3); where several joints or drivers share a
    pair of links their own name follows.

    Returns
    -------
    dict
        By joint and driver: its name, and the body that the force or torque acts on.

    Examples
    --------
    >>> import mbody
    >>> force_names(mbody.makers.four_bar(1, 3, 2, 3.5))["A"]
    ('F32', 'crank')
    """
    link = {name: n for n, name in enumerate(["ground", *(b.name for b in mechanism.bodies)], 1)}
    found: dict[str, tuple[str, str, bool]] = {}

    def pair(letter: str, by: str, on: str) -> str:
        between = f"{link[by]}{link[on]}" if len(link) < 10 else f"({link[by]},{link[on]})"
        return letter + between

    for joint in joined(mechanism):
        by, on = sorted(joint.bodies, key=lambda body: -link[body])
        if on == "ground":
            by, on = on, by
        found[joint.name] = (pair("F", by, on), on, False)
    for driver in mechanism.drivers:
        by, on = driver.bodies
        turns = driver.angular
        found[driver.name] = (pair("T" if turns else "F", by, on), on, not turns)
    times = Counter(name for name, _, _ in found.values())
    return {
        element: (f"{name},{element}" if named or times[name] > 1 else name, on)
        for element, (name, on, named) in found.items()
    }


def forces_on(mechanism: Mechanism, body: str) -> dict[str, str]:
    """Textbook names of the forces and efforts that joints and drivers have on one body.

    As `force_names`, but F_ij is always the force on this body: that on the other one has its
    numbers exchanged.

    Examples
    --------
    >>> import mbody
    >>> forces_on(mbody.makers.four_bar(1, 3, 2, 3.5), "coupler")
    {'A': 'F23', 'B': 'F43'}
    """
    ends = {joint.name: joint.bodies for joint in joined(mechanism)}
    ends |= {driver.name: driver.bodies for driver in mechanism.drivers}
    return {
        element: name if on == body else _exchanged(name)
        for element, (name, on) in force_names(mechanism).items()
        if body in ends[element]
    }


def _exchanged(name: str) -> str:
    """The name of the opposite force.

    >>> _exchanged("F32"), _exchanged("T(12,3),motor")
    ('F23', 'T(3,12),motor')
    """
    # as `force_names` writes them: two digits, or two numbers in brackets
    name = re.sub(r"^([A-Z])(\d)(\d)", r"\1\3\2", name)
    return re.sub(r"^([A-Z])\((\d+),(\d+)\)", r"\1(\3,\2)", name)


def everyday(system: UnitSystem, dimension: str, values: Array, floor: float = 0.0) -> list[Column]:
    """A column of the same values in kg or W, where the system has another unit of them."""
    found = system.everyday(dimension)
    if found is None:
        return []
    unit, ratio = found
    return [Column("", numbers(values * ratio, floor * ratio), unit)]


def heading(solution: Solution, when: str) -> list[str]:
    """Title; analysis, instants and units."""
    machine = solution.mechanism
    return title(machine.name, f"{solution.analysis} {when}", machine.units)


def title(mechanism: str, words: str, units: UnitSystem) -> list[str]:
    """Name of the mechanism; its analysis, and the units of all that follows."""
    symbols = ", ".join((units.length, units.force, units.time, units.mass))
    return [*paragraph(mechanism), *paragraph(f"{words}; units {units.name}: {symbols}")]


def noted(notes: Iterable[str]) -> list[str]:
    """A block of notes, each a paragraph; nothing where there are none."""
    lines = [line for note in notes for line in paragraph(note, "NOTE   ")]
    return ["", *lines] if lines else []


def closing(solution: Solution, residuals: bool = True) -> list[str]:
    """Residuals, the balance of energy, events, status, doubts and notes."""
    lines = []
    if residuals:
        checks = solution.checks
        found = {"constraint": checks.constraint}
        if solution.has_forces:
            found |= {"equilibrium": checks.equilibrium, "virtual work": checks.virtual_work}
        parts = [f"{name} {size:.1e}" if size else f"{name} 0" for name, size in found.items()]
        lines += ["", "RESIDUALS   " + "   ".join(parts) + "   (relative)"]
    if solution.energy is not None and solution.stats is not None:
        energy, stats = solution.energy, solution.stats
        counts = ", ".join(f"{count} {name}" for name, count in stats.items() if count)
        lines += ["", f"ENERGY   balance {energy.error:.1e} (relative)   {counts}"]
    if solution.events:
        lines += ["", *_events(solution)]
    return [*lines, *certified(solution)]


def certified(result: Any) -> list[str]:
    """The status of a result where it is not completed, all its doubts, and its notes."""
    doubts = [one.message for one in result.doubts]
    lines = []
    if doubts:
        lines = ["", *paragraph(f"doubtful: {doubts[0]}", "STATUS   ")]
        lines += [line for one in doubts[1:] for line in paragraph(one, "DOUBT   ")]
    elif result.status != "completed":
        lines = ["", *paragraph(result.status, "STATUS   ")]
    return [*lines, *noted(note for note in result.notes if note not in doubts)]


def _events(solution: Solution) -> list[str]:
    """How often each event occurred, and when, the first few times."""
    unit, lines = solution.mechanism.units.time, []
    for name in dict.fromkeys(_event_name(one) for one in solution.events):
        times = [one.t for one in solution.events if _event_name(one) == name]
        shown = ", ".join(f"{t:.6g}" for t in times[:SHOWN]) + (", …" if len(times) > SHOWN else "")
        many = f", {len(times)} times" if len(times) > 1 else ""
        lines += paragraph(f"{name} at t = {shown} {unit}{many}", "EVENT   ")
    return lines


def _event_name(event: EventRecord) -> str:
    """The name of an event; of a contact with its own."""
    return f"{event.name} of {event.contact}" if event.contact else event.name


def link_names(mechanism: Mechanism) -> list[str]:
    """Numbers and names of all links, the ground first."""
    names = ["ground", *(body.name for body in mechanism.bodies)]
    wide = len(str(len(names)))
    return [f"{n:>{wide}} {name}" for n, name in enumerate(names, 1)]


def swiftness(solution: Solution) -> float:
    """The greatest of ω², |α|, a/l, (v/l)², of all bodies: beside it smaller ones are rounding."""
    length, parts = solution.system.length, [0.0]
    for body in solution:
        h = solution[body]
        parts += [np.abs(h.alpha).max(), np.abs(h.omega).max() ** 2]
        parts += [np.hypot(h.ax, h.ay).max() / length, (np.hypot(h.vx, h.vy).max() / length) ** 2]
    return float(max(parts))


def force_floor(solution: Solution) -> float:
    """What is no more than rounding beside the greatest joint force or effort."""
    length, peak = solution.system.length, 0.0
    for joint in (*solution.mechanism.joints, *acting_contacts(solution)):
        peak = np.fmax(peak, np.fmax.reduce(solution.reaction(joint.name).magnitude, axis=None))
    machine = solution.mechanism
    elements: tuple[Driver | Coupling, ...] = (*machine.drivers, *machine.couplings)
    for element in elements:
        size = float(np.fmax.reduce(np.abs(solution.effort(element.name)), axis=None))
        peak = np.fmax(peak, size / length if element.angular else size)
    return float(peak) * (REDUNDANT if solution.regularization else ROUNDING)


def torque_cells(solution: Solution, torque: Array, floor: float) -> list[str]:
    """Torques at the joints as cells, blank where none is more than that rounding of forces."""
    floor *= solution.system.length
    if not (np.abs(torque) > floor).any():
        return [""] * len(torque)
    return numbers(torque, floor)


def joint_torque(mechanism: Mechanism, reaction: Reaction) -> Array:
    """The torque of a reaction as sheets show it: none of a contact, whose force acts at the place
    where it touches.
    """
    force_alone = isinstance(mechanism[reaction.joint], Contact | Rope)
    return np.asarray(0.0 * reaction.torque if force_alone else reaction.torque)


def remark(reaction: Reaction) -> str:
    """Which components of a reaction are not determined; empty if all are."""
    if reaction.unique is None:
        return "uniqueness unknown"
    pairs = zip(("x", "y", "T"), reaction.unique, strict=True)
    open_parts = [name for name, unique in pairs if not unique]
    return f"not unique: {', '.join(open_parts)}" if open_parts else ""
