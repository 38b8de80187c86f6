"""Which reactions redundant constraints leave open (Wojtyra 2005; Wojtyra and Frączek 2013)."""

from __future__ import annotations

import numpy as np

from mbody.analysis.mobility import Mobility, rows_of
from mbody.system import System

__all__ = ["open_reactions"]

#: A part of a dependency below this is rounding.
SMALL = 1e-7


def open_reactions(system: System, report: Mobility | None) -> dict[str, list[bool]] | None:
    """For every joint, whether fx, fy and the torque are open; None without a rank report.

    Multipliers may be changed by any combination of the dependencies without changing the motion;
    a reaction is determined where no such change reaches it.
    """
    if report is None:
        return None
    result = {}
    table = rows_of(system)
    for joint in system.mechanism.joints:
        atoms = system.atoms_of[joint.name]
        touched = {
            kind: any(
                np.abs(report.dependencies[:, n]).max(initial=0.0) > SMALL
                for n, (e, _, letter) in enumerate(table)
                if e in atoms and letter == kind
            )
            for kind in "la"
        }
        result[joint.name] = _components(system, joint.name, report, touched)
    return result


def _components(
    system: System, joint: str, report: Mobility, touched: dict[str, bool]
) -> list[bool]:
    """World components: those of a pin by its own rows, of other joints all that a row reaches."""
    atoms = system.atoms_of[joint]
    table = rows_of(system)
    rows = [n for n, (e, _, letter) in enumerate(table) if e in atoms and letter == "l"]
    if len(rows) == 2:
        fx, fy = (bool(np.abs(report.dependencies[:, n]).max(initial=0.0) > SMALL) for n in rows)
        return [fx, fy, touched["a"]]
    return [touched["l"], touched["l"], touched["a"]]
