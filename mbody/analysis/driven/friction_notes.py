"""What friction makes certain, leaves open or forbids in a result of a driven motion: jams are
doubts, all else notes.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from mbody.kernels.friction import REACHED_PART
from mbody.kernels.output import PER_PRIMITIVE
from mbody.model.element import listed
from mbody.solution.certificate import as_reported, changed
from mbody.solution.doubts import Doubt
from mbody.solution.rough_pairs import rough_pairs
from mbody.solution.solution import Solution

__all__ = ["with_friction_notes"]

Array = np.ndarray
#: Part of its band, and of the greatest, below which an effort is none.
NOTHING = 1e-9
#: Elements that a note names.
NAMED = 8


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
    said = as_reported(found)
    doubts = [*said.doubts]
    if report.jams:
        doubts.append(_jam(found, report.jams))
    notes = [*said.notes, *_not_unique(found), *_uncertain(found), *_resting(found)]
    notes += [one.message for one in doubts if one.message not in notes]
    return changed(found, doubts=tuple(doubts), notes=tuple(notes))


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
        count = len(found.t) * (found.record.count if found.record.batch else 1)
        where = f"at {len(jams)} of {count} instants, first {where}"
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
    rough = dict.fromkeys(pair.joint for pair in rough_pairs(found.system) if not pair.separable)
    names = [name for name in rough if open_parts is None or any(open_parts.get(name, (True,)))]
    if not names:
        return []
    which = listed(names, NAMED)
    return [
        f"friction in {which} is that of reactions which redundant rows leave open: it is not "
        "unique, and neither are efforts and losses"
    ]


def _uncertain(found: Solution) -> list[str]:
    """Where the condition of uniqueness does not hold, and it does not jam."""
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


def _resting(found: Solution) -> list[str]:
    """Which joints rest, and between what the efforts are."""
    rest = found.resting
    if not rest:
        return []
    if found.analysis == "statics":
        bands = (
            "friction holds at rest: efforts and reactions lie in bands, of which those without "
            "friction are given; run.range gives the bands"
        )
        return [bands, *_self_locking(found)]
    unit, at_once = found.mechanism.units.time, dict[bytes, list[str]]()
    for name, instants in rest.items():
        at_once.setdefault(instants.tobytes(), []).append(name)
    notes = []
    for names in at_once.values():
        instants = rest[names[0]]
        t = np.broadcast_to(found.t, instants.shape)[instants]
        where = f"at t = {t[0]:.6g} {unit}"
        if len(t) > 1:
            where = f"at {len(t)} instants, first {where}"
        rests, its = ("rests", "its") if len(names) == 1 else ("rest", "their")
        notes.append(
            f"{listed(names, NAMED)} {rests} {where}: {its} friction there is any up to its limit, "
            "and forces are given without it; run.range gives the limits of forces"
        )
    return notes


def _self_locking(found: Solution) -> list[str]:
    """Drivers that need no effort to hold a load."""
    notes = []
    for driver in found.mechanism.drivers:
        limits, plain = found.range(driver.name), found.effort(driver.name)
        band = np.where(np.isfinite(limits.high - limits.low), limits.high - limits.low, 0.0)
        size = NOTHING * np.maximum(band, np.abs(plain).max(initial=0.0))
        holds = (limits.low <= 0.0) & (limits.high >= 0.0) & (np.abs(plain) > size)
        count = int(holds.sum())
        if count:
            where = "" if holds.size == 1 else f" at {count} of {holds.size} instants"
            notes.append(f"self-locking: friction holds '{driver.name}' without an effort{where}")
    return notes
