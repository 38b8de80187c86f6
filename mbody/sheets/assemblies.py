"""Sheets of assembly modes, circuits and dead centres."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from mbody.sheets.mobility import many
from mbody.sheets.names import certified, title
from mbody.sheets.text_table import Column, angles, even, numbers, paragraph, table

if TYPE_CHECKING:
    from mbody.analysis.assemblies.all_dead_centres import DeadCentres
    from mbody.analysis.assemblies.assembly_mode import AssemblyModes
    from mbody.analysis.assemblies.circuits import Circuit, Circuits

__all__ = ["circuits_sheet", "closing_data", "closing_line", "dead_centres_sheet", "sheet"]

#: Modes that are shown.
SHOWN = 40
#: Of the model length, what is printed as zero.
ROUNDING = 1e-12


def sheet(found: AssemblyModes) -> str:
    """Assembly modes as text, at most 100 characters wide.

    Examples
    --------
    >>> import mbody
    >>> modes = mbody.assembly_modes(mbody.makers.four_bar(40, 120, 80, 100), {"crank": "40 deg"})
    >>> print(sheet(modes).splitlines()[3])
    2 assembly modes at motor = 40 deg; it is proven that there are no more
    """
    return "\n".join(even([*_modes(found, None), *certified(found)]))


def circuits_sheet(found: Circuits) -> str:
    """Assembly modes, circuits and dead centres as text."""
    unit = found.mechanism.units.length
    lines = _modes(found.modes, found)
    angular = _angular(found.mechanism, found.driver)
    rows = [
        (
            f"circuit {one.number}",
            ", ".join(map(str, one.modes)) or "none here",
            " | ".join(", ".join(map(str, branch)) for branch in one.branches),
            _range(one, angular, unit),
        )
        for one in found
    ]
    if rows:
        titles = ("CIRCUIT", "modes", "branches", f"'{found.driver}'")
        columns = zip(*rows, strict=True)
        lines += ["", *table(Column(t, c, text=True) for t, c in zip(titles, columns, strict=True))]
    lines += ["", *paragraph(_dead_centres(found.dead_centres))]
    return "\n".join(even([*lines, *certified(found)]))


def closing_data(found: AssemblyModes) -> dict[str, int | bool | str | None]:
    """How many modes there are and which one is used, ready for JSON."""
    used = None if found.used is None else found.used.name
    return {"count": len(found), "complete": found.complete, "used": used}


def closing_line(found: AssemblyModes) -> list[str]:
    """How many modes there are and which one is used, in a sentence."""
    where = " and ".join(_value(name, value, found) for name, value in found.at.items())
    proof = "" if found.complete else ", and maybe in more"
    ways = many(len(found), "way")
    used = found.used
    chosen = ""
    if used is not None and (len(found) > 1 or not found.complete):
        name = "" if used.name == str(used.number) else f" {used.name}"
        chosen = f"; the guesses choose {used.number}{name}"
    shown = "it" if len(found) == 1 else "them"
    text = f"it closes in {ways}{proof} at {where}{chosen}; mbody assemblies shows {shown}"
    return paragraph(text, "ASSEMBLIES   ")


def dead_centres_sheet(found: DeadCentres) -> str:
    """Dead centres as text."""
    lines = title(found.mechanism.name, f"dead centres of '{found.driver}'", found.mechanism.units)
    lines += ["", *paragraph(_dead_centres(found))]
    if found.positions:
        values = [_dead_value(found, one.value) for one in found]
        groups = [", ".join(one.bodies) for one in found]
        columns = [Column("DEAD CENTRE", values), Column("of the links", groups, text=True)]
        lines += ["", *table(columns)]
    return "\n".join(even([*lines, *certified(found)]))


def _modes(found: AssemblyModes, circuits: Circuits | None) -> list[str]:
    machine = found.mechanism
    where = " and ".join(_value(name, value, found) for name, value in found.at.items())
    lines = title(machine.name, f"assemblies at {where}" if where else "assemblies", machine.units)
    counted = f"{many(len(found), 'assembly mode')} at {where or 'rest'}"
    proof = "; it is proven that there are no more" if found.complete else ""
    if not len(found) and found.complete:
        proof = "; it is proven that the loops close nowhere there"
    lines += ["", *paragraph(counted + proof), ""]
    modes = list(found)[:SHOWN]
    names = [body.name for body in machine.bodies]
    first = [n == 0 for _ in modes for n in range(len(names))]

    def once(cells: list[str]) -> list[str]:
        spread = [cell for cell in cells for _ in names]
        return [cell if here else "" for cell, here in zip(spread, first, strict=True)]

    columns = [Column("MODE", once([f"{mode.number} {mode.name}" for mode in modes]), text=True)]
    if circuits is not None:
        own = [circuits.of(mode.number)[0] for mode in modes]
        columns.append(Column("circuit", once(["" if n is None else str(n) for n in own])))
    columns.append(Column("", once(["used" if mode.used else "" for mode in modes]), text=True))
    places = [mode[name] for mode in modes for name in names]
    floor = ROUNDING * max((abs(part) for place in places for part in place[:2]), default=1.0)
    columns.append(Column("LINK", [name for _ in modes for name in names], text=True))
    for k, axis in enumerate("xy"):
        cells = numbers([place[k] for place in places], floor) if places else []
        columns.append(Column(axis, cells, machine.units.length))
    columns.append(Column("angle", angles([place[2] for place in places]) if places else [], "deg"))
    if modes:
        lines += table(columns)
    if len(found) > SHOWN:
        lines.append(f"and {len(found) - SHOWN} more")
    return lines


def _angular(machine: object, driver: str) -> bool:
    drivers = getattr(machine, "drivers", ())
    return any(one.name == driver and one.angular for one in drivers)


def _value(name: str, value: float, found: AssemblyModes) -> str:
    if _angular(found.mechanism, name):
        return f"{name} = {round(math.degrees(value), 9):.10g} deg"
    return f"{name} = {value:.10g} {found.mechanism.units.length}"


def _range(one: Circuit, angular: bool, unit: str) -> str:
    if one.full_turn:
        return "turns all the way round"
    if one.range is None:
        return "not followed to its end"
    low, high = (math.degrees(x) if angular else x for x in one.range)
    return f"{low:.6g} to {high:.6g} {'deg' if angular else unit}"


def _dead_value(found: DeadCentres, value: float) -> str:
    if found.angular:
        return f"{math.degrees(value):.6f}°"
    return f"{value:.9g} {found.mechanism.units.length}"


def _dead_centres(found: DeadCentres) -> str:
    if not found.closes:
        return f"it is proven that the loops close at no value of '{found.driver}'"
    if found.full_turn:
        none = f"'{found.driver}' has no dead centre in any mode"
        return f"{none}: it is proven that it turns all the way round"
    angular = found.angular
    shown = [_dead_value(found, value) for value in found.values.tolist()]
    proof = "; it is proven that there are no more" if found.complete else ""
    turns = ""
    if angular and shown:
        turns = f". '{found.driver}' does not turn all the way round in every mode"
    elif angular:
        turns = ". Whether it turns all the way round in every mode is not proven"
    return f"dead centres of '{found.driver}': {', '.join(shown) or 'none was met'}{proof}{turns}"
