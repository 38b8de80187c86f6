"""The readable sheet of an optimum: what ``print(mbody.optimize(machine, ...))`` shows."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from mbody.sheets.names import noted
from mbody.sheets.text_table import Column, even, number, paragraph, table

if TYPE_CHECKING:
    from mbody.optimization.optimum import Optimum

__all__ = ["sheet"]


def sheet(found: Optimum, name: str = "") -> str:
    """An optimum as text, at most 100 characters wide."""
    title = found.run.mechanism.name + (f": {name}" if name else "")
    lines = [*paragraph(title), "", *_aims(found), ""]
    names = list(found.values)
    band = [found.band[one] for one in names]
    lines += table(
        [
            Column("NUMBERS", names, text=True),
            Column("before", [number(found.start_values[one]) for one in names]),
            Column("optimum", [number(found.values[one]) for one in names]),
            Column("unit", [found.units[one] for one in names], text=True),
            Column(f"band from ({found.loss:.3g})", [number(low) for low, _ in band]),
            Column("to", [number(high) for _, high in band]),
        ]
    )
    if found.constraints:
        lines += ["", *_limits(found)]
    if found.active:
        lines += ["", *_active(found)]
    if found.pareto:
        lines += ["", *_front(found)]
    lines += [
        "",
        *paragraph(
            f"{found.agreeing} of {found.starts} searches ended "
            + ("at the ends of the front" if found.pareto else "here")
            + f"; {found.evaluations} analyses with derivatives"
        ),
    ]
    if found.status != "completed":
        lines += ["", *paragraph(found.status, "STATUS   ")]
    return "\n".join(even([*lines, *noted(found.notes)]))


def _aims(found: Optimum) -> list[str]:
    """What is least or greatest, before and after."""
    several = isinstance(found.objective, tuple)
    values = found.objective if several else (found.objective,)
    before: Any = found.start_objective if several else (found.start_objective,)
    if found.start_objective is None:
        before = (None,) * len(values)
    lines = []
    for (aim, unit), value, old in zip(found.aims, values, before, strict=True):
        text = f"{aim} = {number(value)} {unit}".rstrip()
        lines += paragraph(text + (f", before {number(old)}" if old is not None else ""))
    return lines


def _limits(found: Optimum) -> list[str]:
    texts = list(found.constraints)
    margins = ["0" if abs(m) < 1e-9 else number(m) for m in found.constraints.values()]
    return table([Column("LIMITS", texts, text=True), Column("margin", margins)])


def _active(found: Optimum) -> list[str]:
    time = found.run.mechanism.units.time
    return table(
        [
            Column("BINDS", [one.constraint for one in found.active], text=True),
            Column("per unit", [number(one.multiplier) for one in found.active]),
            Column("unit", [one.unit for one in found.active], text=True),
            Column("at t", ["–" if one.t is None else number(one.t) for one in found.active], time),
        ]
    )


def _front(found: Optimum) -> list[str]:
    own = [
        Column(aim, [number(one.objective[n]) for one in found.pareto], unit)
        for n, (aim, unit) in enumerate(found.aims)
    ]
    return table([Column("FRONT", [str(n) for n in range(len(found.pareto))], text=True), *own])
