"""Which reactions redundant constraints leave open (Wojtyra 2005; Wojtyra and Frączek 2013)."""

from __future__ import annotations

import numpy as np

from mbody.model.element import listed
from mbody.system.rank import Rank, dense, rank_of, too_large
from mbody.system.system import System

__all__ = ["open_along", "open_note", "open_reactions"]

#: A part of a dependency below this is rounding.
SMALL = 1e-7
#: Elements that a note names.
NAMED = 8


def open_reactions(system: System, report: Rank | None) -> dict[str, list[bool]] | None:
    """For every joint and closed contact, whether fx, fy and the torque are open, for every driver
    and coupling whether its effort is; None without a rank report.

    Multipliers may be changed by any combination of the dependencies without changing the motion;
    a reaction is determined where no such change reaches it.
    """
    if report is None:
        return None
    touched = np.abs(report.dependencies).max(axis=0, initial=0.0) > SMALL
    primitive, _, is_angle = system.row_table
    result = {}
    for joint in system.mechanism.joints:
        own = np.isin(primitive, system.primitives_of[joint.name])
        lengths, angles = touched[own & ~is_angle], touched[own & is_angle]
        # the two rows of a pin are its world components; other rows reach both
        fx, fy = (lengths[0], lengths[1]) if joint.coincident else (lengths.any(),) * 2
        result[joint.name] = [bool(fx), bool(fy), bool(angles.any())]
    for contact in (one for one in system.mechanism.contacts if one.closed):
        own = np.isin(primitive, system.primitives_of[contact.name])
        result[contact.name] = [bool(touched[own].any())] * 3
    for element in (*system.mechanism.drivers, *system.mechanism.couplings):
        own = np.isin(primitive, system.primitives_of[element.name])
        result[element.name] = [bool(touched[own].any())]
    return result


def open_along(system: System, q: np.ndarray) -> dict[str, list[bool]] | None:
    """The same at the one of some positions (instants, coordinates) at which the dependencies are
    fewest: a singular position has more of them.
    """
    if too_large(system) or not len(q):
        return None
    work, reports = system.work(), []
    for k in {0, len(q) // 2, len(q) - 1}:
        work.q[: q.shape[1], 0] = q[k]
        G = dense(system, work)[1]
        if np.isfinite(G).all():
            reports.append(rank_of(G))
    best = min(reports, key=lambda report: report.redundant, default=None)
    return open_reactions(system, best)


def open_note(found: dict[str, list[bool]] | None) -> tuple[str, ...]:
    """A sentence that names what redundant rows leave open; none where everything is determined."""
    if found is None:
        return ("rows are redundant; which reactions are unique was not looked at",)
    reactions = [name for name, parts in found.items() if len(parts) > 1 and any(parts)]
    efforts = [name for name, parts in found.items() if len(parts) == 1 and any(parts)]
    dependent = [f"the reactions of {listed(reactions, NAMED)}"] if reactions else []
    dependent += [f"the efforts of {listed(efforts, NAMED)}"] if efforts else []
    if not dependent:
        return ()
    return (
        f"rows are redundant: {' and '.join(dependent)} are not unique, those of least norm are "
        "given; take off what repeats, or give it play",
    )
