"""Doubts and notes about contacts and friction of a driven motion: contacts that would have to
pull, ropes that would have to push, contacts that are kept closed, and jams.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from mbody.analysis.contact.closed_contacts import has_closed_contacts
from mbody.analysis.position.assembly_analysis import misfit
from mbody.core.tolerances import CONTACT_GAP_NONE, DISTANCE_MISFIT, FORCE_NONE, TINY
from mbody.kernels.friction import REACHED_PART
from mbody.kernels.layout import PER_PRIMITIVE
from mbody.model.contact import ContactCandidate, OneSided, Rope
from mbody.model.coupling import Coupling
from mbody.model.element import listed
from mbody.model.joints import Joint
from mbody.solution import contact_forces
from mbody.solution.doubts import Doubt
from mbody.solution.histories import column, ends, reported_certificate, with_fields
from mbody.solution.solution import Solution
from mbody.system.system import System

Array = np.ndarray

#: Parts of an interval in which a least force is sought.
CLOSER = 8


@dataclass(frozen=True, eq=False)
class OneSidedForce:
    """The force with which a contact or a rope holds, over further instants of a motion.

    `t`, `force`, `size` (instants,): Times; the force, negative where it would have to be of the
      other direction; its greatest component, by which rounding is judged.
    """

    t: Array
    force: Array
    size: Array


def extremes(forces: OneSidedForce, known: OneSidedForce | None) -> OneSidedForce:
    """Of forces, and those that are known, the least, the largest by size, and the first of wrong
    sign.
    """
    if known is not None:
        parts = ((known.t, forces.t), (known.force, forces.force), (known.size, forces.size))
        forces = OneSidedForce(*(np.concatenate(part) for part in parts))
    pulls = forces.force < -FORCE_NONE * forces.size.max()
    kept = np.unique([pulls.argmax(), forces.force.argmin(), forces.size.argmax()])
    return OneSidedForce(forces.t[kept], forces.force[kept], forces.size[kept])


def one_sided(system: System) -> list[Joint | Coupling | OneSided]:
    """Contacts of joints and those that are closed for good, and ropes: couplings of distances
    whose factors are all of one sign, with angles of drums. A belt of angles alone is stretched
    beforehand, and a displacement has no sign.
    """
    machine = system.mechanism
    found: list[Joint | Coupling | OneSided] = [
        joint for joint in machine.joints if type(joint).normal is not Joint.normal
    ]
    found += [one for one in machine.contacts if one.closed]
    return found + [one for one in machine.couplings if rope_factor(system, one)]


def rope_factor(system: System, coupling: Coupling) -> float:
    """The factor of a single part of a rope, of which the effort times it pushes; 0 of what is no
    rope.
    """
    parts = coupling.parts
    if not coupling.lengths or any(term.coordinate for term in parts):
        return 0.0
    names = [f"{coupling.name}.{n}.factor" for n, term in enumerate(parts) if term.distance]
    factors = [np.ravel(system.values[name]) for name in names]
    every = np.concatenate(factors) if factors else np.zeros(1)
    if (every > 0.0).all():
        return float(every.min())
    return float(every.max()) if (every < 0.0).all() else 0.0


def one_sided_force(solution: Solution, element: Any) -> OneSidedForce:
    """The force of a one-sided element at the instants of a solution."""
    if element.role == "coupling":
        pull = -rope_factor(solution.system, element) * solution.effort(element.name)
        return OneSidedForce(solution.t, pull, np.abs(pull))
    if element.role == "contact":
        press = contact_forces.least_pressing(solution, element)
        return OneSidedForce(solution.t, press, _greatest(solution))
    press = np.asarray(solution.contact(element.name))
    return OneSidedForce(solution.t, press, solution.reaction(element.name).magnitude)


def _greatest(solution: Solution) -> Array:
    """The greatest force of all closed contacts, by which rounding is judged: (instants,)."""
    closed = [one for one in solution.mechanism.contacts if one.closed]
    every = [np.abs(contact_forces.pressing_force(solution, one)) for one in closed]
    return np.asarray(np.max(every, axis=0))


def pulled(solution: Solution, between: Mapping[str, OneSidedForce] | None = None) -> list[str]:
    """A sentence for each contact that presses nowhere on the other body at some instant, and each
    rope that would have to push.

    Their rows keep them whatever their force; whether they would be kept is for its sign to say.
    `between`, by the names of the elements, are forces at further instants of one design.
    """
    if not solution.has_forces:
        return []
    found = []
    for element in one_sided(solution.system):
        history = one_sided_force(solution, element)
        pressing = history.force
        t, force, size = np.broadcast_to(history.t, pressing.shape), pressing, history.size
        if between is not None and element.name in between:
            more = between[element.name]
            t, force = np.append(t, more.t), np.append(force, more.force)
            size = np.append(size, more.size)
        floor = FORCE_NONE * float(np.fmax.reduce(size, axis=None, initial=0.0))
        if (force < -floor).any():
            found.append(_sentence(solution, element, t, force, floor))
    return found


def low_between(t: Array, force: Array) -> Array:
    """Times beside each least sample from which the force may fall below zero between samples. A
    parabola through three falls by an eighth of what the higher neighbour rises, at most; eight
    times that is examined.

    >>> low_between(np.arange(5.0), np.array([3.0, 1.0, 0.4, 1.0, 3.0]))[:3]
    array([1.125, 1.25 , 1.375])
    """
    left, middle, right = force[:-2], force[1:-1], force[2:]
    least = (middle <= left) & (middle <= right) & (middle < np.maximum(left, right) - middle)
    at = np.flatnonzero(least) + 1
    parts = np.arange(1, CLOSER) / CLOSER
    times = [t[k, None] + parts * (t[k + 1] - t[k])[:, None] for k in (at - 1, at)]
    return np.asarray(np.concatenate(times, axis=1).ravel())


def check_fits(solution: Solution) -> None:
    """Refuse wheels that do not fit at some instant."""
    for joint, found, wanted, misfits in _distances(solution):
        wrong = np.argwhere(misfits)
        if len(wrong):
            first = tuple(wrong[0].tolist())
            where = f" at t = {solution.t[first[-1]]:.6g} {solution.mechanism.units.time}"
            raise misfit(solution.system, joint, found[first], wanted[first], where)


def unfit(solution: Solution) -> np.ndarray:
    """Which designs of a batch have wheels that do not fit at some instant: (designs,)."""
    wrong = np.zeros(solution.record.count, dtype=bool)
    for _, _, _, misfits in _distances(solution):
        wrong |= misfits.any(axis=-1)
    return wrong


def _distances(solution: Solution) -> Iterator[tuple[Joint, np.ndarray, np.ndarray, np.ndarray]]:
    """Of every joint whose place others hold: its distance, what it should be, and whether it is
    far from that.
    """
    for joint in solution.mechanism.joints:
        if joint.spaced:
            found, wanted = np.broadcast_arrays(*joint.fit(*ends(solution, joint)))
            yield (
                joint,
                found,
                wanted,
                np.abs(found - wanted) > DISTANCE_MISFIT * solution.system.length,
            )


def _pressing(element: Joint | Coupling | OneSided) -> str:
    """The word for the normal reaction: a force, or a torque."""
    return element.quantities()["contact"] if isinstance(element, OneSided) else "force"


def _sentence(
    solution: Solution, element: Joint | Coupling | OneSided, t: Array, force: Array, floor: float
) -> str:
    """The sentence of a force of the wrong direction: the greatest, and the first instant of it."""
    units = solution.mechanism.units
    where = int(force.argmin())
    when = f"at t = {t[where]:.6g} {units.time}"
    pressing = one_sided_force(solution, element).force
    count = int((pressing < -floor).sum())
    if not count:
        when = f"between the instants, most {when}"
    elif pressing.size > 1:
        when = f"at {count} of {pressing.size} instants, most {when}"
    first = float(t[force < -floor].min())
    if first < float(t[where]):
        when = f"{when}, first at t = {first:.6g} {units.time}"
    size = f"{-float(force.min()):.6g} {units.of(_pressing(element))}"
    if element.role == "coupling" or isinstance(element, Rope):
        return (
            f"rope '{element.name}' would have to push with {size} {when}: it would be slack "
            "there; load it more, or take it off where it is slack"
        )
    if len(element.bodies) < 2:
        return (
            f"stop '{element.name}' would have to pull with {size} {when}: what it measures would "
            "leave it there; press it on harder"
        )
    i, j = element.bodies[:2]
    return (
        f"contact '{element.name}' would have to pull '{j}' with {size} {when}: '{j}' would leave "
        f"'{i}' there; press it on harder"
    )


# -- Contacts of a driven motion: modes, doubts and notes --------------------------------------

#: Contacts that a note names, and instants at which overlaps are looked for.
NAMED, LOOKED = 8, 721


def with_contact_report(found: Solution, notes: tuple[str, ...]) -> Solution:
    """The result with the modes of its contacts, `notes` of how they were chosen, and doubts where
    it is not what bodies that touch would do.
    """
    machine = found.mechanism
    if not machine.contacts:
        return found
    found = with_fields(found, modes=_modes(found))
    said = reported_certificate(found)
    doubts = [*_past_ends(found), *_past_arcs(found), *_slipping(found), *_overlapping(found)]
    return with_fields(found, doubts=(*said.doubts, *doubts), notes=(*said.notes, *notes))


def _modes(found: Solution) -> dict[str, list[str]]:
    """Modes of all contacts and frictional joints; none where no contact is closed."""
    if not has_closed_contacts(found.mechanism):
        return {}
    count = len(found)
    frictional = {pair.joint for _, pair in contact_forces.losing_pairs(found)}
    modes = {}
    for one in found.mechanism.contacts:
        word = "roll" if one.rolls else "stick"
        if not one.closed:
            modes[one.name] = ["open"] * count
        elif one.name in frictional:
            modes[one.name] = found.mode(one.name)
        else:
            modes[one.name] = [word] * count
    return modes | {name: found.mode(name) for name in found.losses if name not in modes}


def _past_ends(found: Solution) -> list[Doubt]:
    """Contacts that are kept closed beyond the end of their edge."""
    doubts = []
    for contact in (one for one in found.mechanism.contacts if one.closed):
        candidates = contact.candidates(found.system.numbers)
        distances = [
            _distance_past(found, contact, candidate)
            for candidate in candidates
            if _has_ends(candidate)
        ]
        past = np.max(distances, axis=0) if distances else np.zeros(1)
        if not (past > CONTACT_GAP_NONE * found.system.length).any():
            continue
        unit = found.mechanism.units.length
        t, where = _first(found, past > CONTACT_GAP_NONE * found.system.length)
        doubts.append(
            Doubt(
                "contact",
                f"contact '{contact.name}' is past the end of its edge by up to {past.max():.6g} "
                f"{unit} {where}: its bodies would not touch there; end the motion before, or "
                "follow it by simulate",
                t,
                (contact.name,),
            )
        )
    return doubts


def _past_arcs(found: Solution) -> list[Doubt]:
    """Contacts that are kept closed beyond the end of their arc or curve."""
    from mbody.solution.contact_points import contact_points_of

    doubts = []
    for contact in (one for one in found.mechanism.contacts if one.closed and found.modes):
        candidates = contact.candidates(found.system.numbers)
        points = zip(candidates, contact_points_of(found, contact), strict=False)
        off = [
            ~point.closed
            for candidate, point in points
            if candidate.ends and (candidate.arcs or candidate.contour is not None)
        ]
        if off and np.any(off):
            t, where = _first(found, np.any(off, axis=0))
            what = "arc" if any(one.arcs for one in candidates) else "curve"
            doubts.append(
                Doubt(
                    "contact",
                    f"contact '{contact.name}' is past the end of its {what} {where}: its bodies "
                    "would not touch there; end the motion before, or follow it by simulate",
                    t,
                    (contact.name,),
                )
            )
    return doubts


def _has_ends(candidate: ContactCandidate) -> bool:
    return candidate.edge is not None and bool(np.isfinite(candidate.edge[2]).all())


def _distance_past(found: Solution, contact: OneSided, candidate: ContactCandidate) -> Array:
    """Distance of a place past an end of its edge, negative within: (instants,), or (designs,
    instants).
    """
    assert candidate.edge is not None
    first, second = _bodies(contact, candidate)
    (ax, ay), (ux, uy), length = candidate.edge
    i, j = found[first], found[second]
    jx, jy = (column(part) for part in candidate.position)
    c, s = np.cos(j.angle), np.sin(j.angle)
    px, py = j.x + c * jx - s * jy - i.x, j.y + s * jx + c * jy - i.y
    c, s = np.cos(i.angle), np.sin(i.angle)
    along = column(ux) * (c * px + s * py - column(ax)) + column(uy) * (
        c * py - s * px - column(ay)
    )
    return np.asarray(np.maximum(-along, along - column(length)))


def _bodies(contact: OneSided, candidate: ContactCandidate) -> tuple[str, str]:
    """The two bodies of a row, in its order."""
    i, j = contact.bodies
    return (j, i) if candidate.swapped else (i, j)


def _slipping(found: Solution) -> list[Doubt]:
    """Wheels that roll by more friction than there is."""
    doubts = []
    for contact in (one for one in found.mechanism.contacts if one.rolls and found.has_forces):
        presses = contact_forces.pressing_forces(found, contact)
        rows = found.system.primitives_of[contact.name][len(presses) :]
        limit = column(contact.coefficients(found.system.numbers)[1])
        along = np.abs([found.primitive_history(e, 0) for e in rows])
        needed = np.max(along / np.maximum(presses, TINY + FORCE_NONE * along), axis=0)
        slips = needed > limit * (1.0 + FORCE_NONE)
        if slips.any():
            t, where = _first(found, slips)
            doubts.append(
                Doubt(
                    "contact",
                    f"contact '{contact.name}' is taken to roll, and would slip {where}: it needs "
                    f"a coefficient of friction of {np.max(needed):.6g}, there is "
                    f"{np.max(limit):.6g}; give it more, load it otherwise, or drive the wheel",
                    t,
                    (contact.name,),
                )
            )
    return doubts


def _overlapping(found: Solution) -> list[Doubt]:
    """Shapes of contacts that are left out and overlap."""
    from mbody.analysis.contact.unilateral import Unilateral, deepest_overlap

    system = found.system
    if all(one.closed for one in found.mechanism.contacts):
        return []
    uni, work, n = Unilateral(system), system.work(), system.coordinates
    looked = np.unique(np.linspace(0, len(found) - 1, LOOKED).astype(int))
    places, gap_tolerance = found.record.table(slice(0, n)), CONTACT_GAP_NONE * system.length
    worst: dict[str, tuple[float, float]] = {}
    for k in looked.tolist():
        work.q[:n, 0], work.time[:] = places[k], found.t[k]
        one = deepest_overlap(uni, uni.read(work), work, gap_tolerance)
        if one is not None:
            t, depth = worst.get(one.contact, (float(found.t[k]), 0.0))
            worst[one.contact] = t, max(depth, one.depth)
    if not worst:
        return []
    units, depths = found.mechanism.units, [depth for _, depth in worst.values()]
    t = min(t for t, _ in worst.values())
    return [
        Doubt(
            "contact",
            f"{listed(worst, NAMED)}: bodies overlap by up to {max(depths):.6g} {units.length}, "
            f"first at t = {t:.6g} {units.time}; {found.analysis} lets them pass through each "
            "other, simulate does not",
            t,
            tuple(worst),
        )
    ]


def _first(found: Solution, wrong: Array) -> tuple[float, str]:
    """The first instant of some, and where they are in words."""
    every = np.broadcast_to(wrong, np.broadcast_shapes(wrong.shape, found.t.shape))
    t = float(np.broadcast_to(found.t, every.shape)[every].min())
    unit = found.mechanism.units.time
    if every.size == 1:
        return t, f"at t = {t:.6g} {unit}"
    return t, f"at {int(every.sum())} of {every.size} instants, first at t = {t:.6g} {unit}"


# -- Friction of a driven motion: jams are doubts, all else notes ------------------------------

#: Elements that a note names.
LISTED = 8


def with_friction_notes(found: Solution) -> Solution:
    """The result with what is to be said of friction. Where the mechanism jams there are no forces:
    they are no numbers there.
    """
    rows = found.system.friction_rows
    if rows.start == rows.stop or not found.has_forces:
        return found
    _take_out(found, rows.start + REACHED_PART)
    report = found.friction
    assert report is not None
    said = reported_certificate(found)
    doubts = [*said.doubts]
    if report.jams:
        doubts.append(_jam(found, report.jams))
    notes = [*said.notes, *_not_unique(found), *_uncertain(found), *_sticking(found)]
    notes += [one.message for one in doubts if one.message not in notes]
    return with_fields(found, doubts=tuple(doubts), notes=tuple(notes))


def _take_out(found: Solution, row: int) -> None:
    """No forces where less than all friction could be reached."""
    first = 3 * found.system.coordinates
    last = first + PER_PRIMITIVE * len(found.system.owners)
    for block in found.record.blocks:
        jams = block[:, row, :] < 1.0
        if jams.any():
            forces = block[:, first:last, :]
            np.copyto(forces, np.nan, where=jams[:, None, :])


def _jam(found: Solution, jams: tuple[Any, ...]) -> Doubt:
    """From which coefficient on, where, and what to do."""
    worst = min(jams, key=lambda one: one.coefficient)
    first, unit = jams[0].t, found.mechanism.units.time
    where = f"at t = {first:.6g} {unit}"
    if len(jams) > 1:
        where = f"at {len(jams)} of {len(found.t)} instants, first {where}"
    joints = tuple(dict.fromkeys(one.joint for one in jams))
    closed = [one.name for one in found.mechanism.contacts if one.closed]
    or_else = f"; or what is kept closed opens, {listed(closed)}: see simulate" if closed else ""
    return Doubt(
        "incomplete",
        f"it jams {where}: no effort moves it against friction in '{worst.joint}', from a "
        f"coefficient of {worst.coefficient:.6g} on, others in proportion; there are no forces "
        f"then: take less friction, or guide and drive it nearer to its load{or_else}",
        first,
        joints,
    )


def _not_unique(found: Solution) -> list[str]:
    """Reactions that redundant rows leave open leave friction open."""
    open_parts = found.dependencies
    if not found.regularization:
        return []
    frictional = dict.fromkeys(
        pair.joint for pair in contact_forces.friction_pairs(found.system) if not pair.separable
    )
    names = [
        name for name in frictional if open_parts is None or any(open_parts.get(name, (True,)))
    ]
    if not names:
        return []
    which = listed(names, LISTED)
    return [
        f"friction in {which} is that of reactions which redundant rows leave open: it is not "
        "unique, and neither are efforts and losses"
    ]


def _uncertain(found: Solution) -> list[str]:
    """Notes of instants at which the condition of uniqueness does not hold, and it does not jam."""
    report = found.friction
    assert report is not None
    if report.certified.all():
        return []
    jammed = np.isin(found.t, [one.t for one in report.jams])
    open_at = ~report.certified & ~jammed
    count = int(open_at.sum())
    if not count:
        return []
    where = "" if open_at.size == 1 else f" at {count} of {open_at.size} instants"
    return [
        f"friction is not certain to have one solution{where}: that which follows from less and "
        "less friction is given"
    ]


def _sticking(found: Solution) -> list[str]:
    """Which joints rest, and between what the efforts are."""
    sticking = found.resting
    if not sticking:
        return []
    if found.analysis == "statics":
        bands = (
            "friction holds at rest: efforts and reactions lie in bands, of which those without "
            f"friction are given{_unless_pulls(found)}; run.range gives the bands"
        )
        return [bands, *_self_locking(found)]
    unit, at_once = found.mechanism.units.time, dict[bytes, list[str]]()
    for name, instants in sticking.items():
        at_once.setdefault(instants.tobytes(), []).append(name)
    notes = []
    for names in at_once.values():
        instants = sticking[names[0]]
        t = np.broadcast_to(found.t, instants.shape)[instants]
        where = f"at t = {t[0]:.6g} {unit}"
        if len(t) > 1:
            where = f"at {len(t)} instants, first {where}"
        verb, its = ("rests", "its") if len(names) == 1 else ("rest", "their")
        notes.append(
            f"{listed(names, LISTED)} {verb} {where}: {its} friction there is any up to its "
            f"limit, and forces are given without it{_unless_pulls(found)}; run.range gives the "
            "limits of forces"
        )
    return notes


def _unless_pulls(found: Solution) -> str:
    """Where forces are given with friction of what rests."""
    given = contact_forces.presses_by_friction(found.system)
    return ", but where a contact had to pull or a rope to push then" if given else ""


def _self_locking(found: Solution) -> list[str]:
    """Drivers that need no effort to hold a load."""
    notes = []
    for driver in found.mechanism.drivers:
        limits, plain = found.range(driver.name), found.effort(driver.name)
        band = np.where(np.isfinite(limits.high - limits.low), limits.high - limits.low, 0.0)
        size = FORCE_NONE * np.maximum(band, np.abs(plain).max(initial=0.0))
        holds = (limits.low <= 0.0) & (limits.high >= 0.0) & (np.abs(plain) > size)
        count = int(holds.sum())
        if count:
            where = "" if holds.size == 1 else f" at {count} of {holds.size} instants"
            notes.append(f"self-locking: friction holds '{driver.name}' without an effort{where}")
    return notes
