"""What is to be said of the contacts of a driven motion: those that it keeps closed, whether they
stay on their edges and within their friction, and whether others overlap.
"""

from __future__ import annotations

import numpy as np

from mbody.analysis.contact.closed_contacts import has_closed_contacts
from mbody.analysis.contact.overlaps import deepest_overlap
from mbody.analysis.contact.unilateral import Unilateral
from mbody.model.contact_spots import Spot
from mbody.model.element import listed
from mbody.model.one_sided_constraint import OneSided
from mbody.solution.certificate import as_reported, changed
from mbody.solution.contact_forces import pressing_forces
from mbody.solution.doubts import Doubt
from mbody.solution.places import column
from mbody.solution.rough_pairs import losing_pairs
from mbody.solution.solution import Solution
from mbody.solution.touch_places import touches_of

__all__ = ["with_contact_report"]

Array = np.ndarray

#: A way past the end of an edge, or an overlap, that is none, in model lengths.
NONE = 1e-6
#: A part of the limit of friction that is rounding.
ROUNDING = 1e-9
#: Contacts that a note names, and instants at which overlaps are looked for.
NAMED, LOOKED = 8, 721


def with_contact_report(found: Solution, notes: tuple[str, ...]) -> Solution:
    """The result with the modes of its contacts, `notes` of how they were chosen, and doubts where
    it is not what bodies that touch would do.
    """
    machine = found.mechanism
    if not machine.contacts:
        return found
    if not found.record.batch:
        found = changed(found, modes=_modes(found))
    said = as_reported(found)
    doubts = [*_past_ends(found), *_past_arcs(found), *_slipping(found), *_overlapping(found)]
    return changed(found, doubts=(*said.doubts, *doubts), notes=(*said.notes, *notes))


def _modes(found: Solution) -> dict[str, list[str]]:
    """Modes of all contacts and rough joints; none where no contact is closed."""
    if not has_closed_contacts(found.mechanism):
        return {}
    count = len(found)
    rough = {pair.joint for _, pair in losing_pairs(found)}
    modes = {}
    for one in found.mechanism.contacts:
        word = "roll" if one.rolls else "stick"
        if not one.closed:
            modes[one.name] = ["open"] * count
        elif one.name in rough:
            modes[one.name] = found.mode(one.name)
        else:
            modes[one.name] = [word] * count
    return modes | {name: found.mode(name) for name in found.losses if name not in modes}


def _past_ends(found: Solution) -> list[Doubt]:
    """Contacts that are kept closed beyond the end of their edge."""
    doubts = []
    for contact in (one for one in found.mechanism.contacts if one.closed):
        spots = contact.spots(found.system.numbers)
        ways = [_way_past(found, contact, spot) for spot in spots if _has_ends(spot)]
        past = np.max(ways, axis=0) if ways else np.zeros(1)
        if not (past > NONE * found.system.length).any():
            continue
        unit = found.mechanism.units.length
        t, where = _first(found, past > NONE * found.system.length)
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
    """Contacts that are kept closed beyond the end of their arc, of one design."""
    doubts = []
    for contact in (one for one in found.mechanism.contacts if one.closed and found.modes):
        spots = contact.spots(found.system.numbers)
        touches = zip(spots, touches_of(found, contact), strict=False)
        off = [~touch.closed for spot, touch in touches if spot.arcs]
        if off and np.any(off):
            t, where = _first(found, np.any(off, axis=0))
            doubts.append(
                Doubt(
                    "contact",
                    f"contact '{contact.name}' is past the end of its arc {where}: its bodies "
                    "would not touch there; end the motion before, or follow it by simulate",
                    t,
                    (contact.name,),
                )
            )
    return doubts


def _has_ends(spot: Spot) -> bool:
    return spot.edge is not None and bool(np.isfinite(spot.edge[2]).all())


def _way_past(found: Solution, contact: OneSided, spot: Spot) -> Array:
    """How far a place is past an end of its edge, negative within: (instants,), or (designs,
    instants).
    """
    assert spot.edge is not None
    first, second = _bodies(contact, spot)
    (ax, ay), (ux, uy), length = spot.edge
    i, j = found[first], found[second]
    jx, jy = (column(part) for part in spot.arm)
    c, s = np.cos(j.angle), np.sin(j.angle)
    px, py = j.x + c * jx - s * jy - i.x, j.y + s * jx + c * jy - i.y
    c, s = np.cos(i.angle), np.sin(i.angle)
    along = column(ux) * (c * px + s * py - column(ax)) + column(uy) * (
        c * py - s * px - column(ay)
    )
    return np.asarray(np.maximum(-along, along - column(length)))


def _bodies(contact: OneSided, spot: Spot) -> tuple[str, str]:
    """The two bodies of a row, in its order."""
    i, j = contact.bodies
    return (j, i) if spot.swapped else (i, j)


def _slipping(found: Solution) -> list[Doubt]:
    """Wheels that roll by more friction than there is."""
    doubts = []
    for contact in (one for one in found.mechanism.contacts if one.rolls and found.has_forces):
        presses = pressing_forces(found, contact)
        rows = found.system.primitives_of[contact.name][len(presses) :]
        limit = column(contact.coefficients(found.system.numbers)[1])
        along = np.abs([found.primitive_history(e, 0) for e in rows])
        needed = np.max(along / np.maximum(presses, 1e-300 + ROUNDING * along), axis=0)
        slips = needed > limit * (1.0 + ROUNDING)
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
    """Shapes of contacts that are left out and overlap, of one design."""
    system = found.system
    if found.record.batch or all(one.closed for one in found.mechanism.contacts):
        return []
    uni, work, n = Unilateral(system), system.work(), system.coordinates
    looked = np.unique(np.linspace(0, len(found) - 1, LOOKED).astype(int))
    places, near = found.record.table(slice(0, n)), NONE * system.length
    worst: dict[str, tuple[float, float]] = {}
    for k in looked.tolist():
        work.q[:n, 0], work.time[:] = places[k], found.t[k]
        one = deepest_overlap(uni, uni.read(work), work, near)
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
