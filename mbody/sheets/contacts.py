"""The table of contacts, ropes and rough joints in sheets."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from mbody.sheets.names import force_floor
from mbody.sheets.text_table import Column, numbers, table

if TYPE_CHECKING:
    from mbody.solution.solution import Solution

__all__ = ["contacts"]


def contacts(solution: Solution) -> list[str]:
    """What every contact did: how often it struck, its mode at the end, its greatest force,
    what it took of the energy; of a driven motion its modes and the greatest force alone, of
    kinematics the modes.
    """
    modes = solution.modes
    if not modes or not len(solution):
        return []
    machine = solution.mechanism
    pressing = {one.name: one.quantities()["contact"] for one in machine.contacts}
    names, unit = list(modes), machine.units.of
    driven = solution.analysis != "simulate"
    if driven:  # its rough joints are in a table of their own
        names = [name for name in names if name in pressing]
    shown = [", ".join(dict.fromkeys(map(str, modes[n]))) for n in names]
    if not solution.has_forces:
        columns = [Column("CONTACTS", names, text=True)]
        return table([*columns, Column("", shown, text=True, whole=True)])
    floor = force_floor(solution)
    most = [float(np.abs(solution.contact(n)).max()) if n in pressing else 0.0 for n in names]
    strikes = [
        sum(one.contact == n and one.name in ("impact", "rest") for one in solution.events)
        for n in names
    ]
    lost = dict.fromkeys(names, 0.0)
    if solution.energy is not None:
        lost |= {n: float(part[-1]) for n, part in solution.energy.lost.items() if n in lost}
    kinds = [
        ("greatest press", "force", numbers(np.array(most), floor)),
        ("torque", "torque", numbers(np.array(most), floor * solution.system.length)),
    ]
    if "torque" not in pressing.values():
        kinds.pop()
    columns = [Column("CONTACTS", names, text=True)]
    if not driven:
        columns.append(Column("impacts", [str(n) if n else "" for n in strikes]))
    columns += [
        Column(title, _of_kind(cells, names, pressing, kind), unit(kind))
        for title, kind, cells in kinds
    ]
    if driven:
        return table([*columns, Column("", shown, text=True, whole=True)])
    columns += [
        Column("took", numbers(np.array([lost[n] for n in names])), unit("torque")),
        Column("at the end", [str(modes[n][-1]) for n in names], text=True),
        Column("between", [_between(solution, n) for n in names], text=True, whole=True),
    ]
    return table(columns)


def _of_kind(cells: list[str], names: list[str], pressing: dict[str, str], kind: str) -> list[str]:
    """The cells of what presses with that, a force or a torque."""
    return [
        cell if pressing.get(name, "force") == kind else ""
        for name, cell in zip(names, cells, strict=True)
    ]


def _between(solution: Solution, name: str) -> str:
    bodies = getattr(solution.mechanism[name], "bodies", ())
    return " and ".join(bodies)
