"""The readable sheet of a mobility report: what ``print(mbody.mobility(machine))`` shows."""

from __future__ import annotations

from typing import TYPE_CHECKING

from mbody.model.element import listed
from mbody.sheets.names import noted, title
from mbody.sheets.text_table import Column, even, number, paragraph, table

if TYPE_CHECKING:
    from collections.abc import Sequence

    from mbody.analysis.freedom.free_motions import FreeMotion
    from mbody.analysis.freedom.mobility import Count, Mobility

__all__ = ["constituents", "counts", "many", "sheet"]

#: Free motions and joints that are shown.
SHOWN = 12
#: What holds in one sense only: one of it, several, and how it is counted.
ONE_SIDED = {
    "contacts": ("contact", "contacts", "open"),
    "ropes": ("rope", "ropes", "slack"),
    "stops": ("stop", "stops", "open"),
    "freewheels": ("freewheel", "freewheels", "free"),
    "limits": ("limit of a joint", "limits of joints", "open"),
    "joints": ("joint that can separate", "joints that can separate", "closed"),
}


def sheet(report: Mobility) -> str:
    """A mobility report as text, at most 100 characters wide.

    Examples
    --------
    >>> import mbody
    >>> print(sheet(mbody.mobility(mbody.makers.four_bar(1, 3, 2, 3.5))).splitlines()[10])
    degrees of freedom: coordinates - rank              1               0
    """
    when = f"mobility at t = {number(report.t)} {report.units.time}"
    lines = [*title(report.mechanism, when, report.units), "", *_counts(report)]
    lines += _redundant(report)
    lines += _one_sided(report)
    if report.drivers:
        lines += _motions("FREE MOTIONS, drivers fixed", report.driven_motions)
        lines += _motions("FREE MOTIONS without the drivers", report.motions)
    else:
        lines += _motions("FREE MOTIONS", report.motions)
    return "\n".join(even([*lines, *noted(report.notes)]))


def counts(report: Mobility) -> tuple[list[str], dict[str, list[str]]]:
    """What is counted, and the counts by the title of their column."""
    titles = [
        "coordinates, 3 a link",
        "rows of constraints",
        "Grübler: coordinates - rows",
        "rank of the rows",
        "redundant rows: rows - rank",
        "degrees of freedom: coordinates - rank",
    ]

    def cells(count: Count) -> list[str]:
        rank, spare, free = count.rank, count.redundant, count.freedom
        values = (3 * report.bodies, count.rows, count.gruebler, rank, spare, free)
        return [str(value) for value in values]

    columns = {"joints alone": cells(report.of_joints)}
    if report.drivers:
        columns["drivers fixed"] = cells(report.driven)
    return titles, columns


def constituents(report: Mobility) -> str:
    """Links, joints, couplings, drivers and loops in a line."""
    parts = [many(report.bodies, "moving link"), many(report.joints, "joint")]
    if report.couplings:
        parts.append(many(report.couplings, "coupling"))
    parts += [many(report.drivers, "driver"), many(report.loops, "independent loop")]
    return ", ".join(parts)


def _counts(report: Mobility) -> list[str]:
    """Parts beside the two counts."""
    titles, found = counts(report)
    columns = [Column("MOBILITY", titles, text=True, whole=True)]
    columns += [Column(title, cells) for title, cells in found.items()]
    return [*table(columns), constituents(report)]


def many(count: int, what: str) -> str:
    """A number of things.

    >>> many(1, "driver"), many(2, "joint")
    ('1 driver', '2 joints')
    """
    return f"{count} {what}{'' if count == 1 else 's'}"


def _redundant(report: Mobility) -> list[str]:
    """Joints whose rows can be spared."""
    if not report.redundant:
        return []
    most = max(report.redundant.values())
    words = [
        name if most == 1 else f"{name} (up to {count})" for name, count in report.redundant.items()
    ]
    if len(words) > SHOWN:
        words[SHOWN:] = [f"{len(words) - SHOWN} joints more"]
    rows = many(report.of_joints.redundant, "row")
    where = " at this position" if report.of_joints.singular else ""
    names = " or ".join([", ".join(words[:-1]), words[-1]])
    text = f"{rows} can be removed{where} and nothing is set free, from {names}"
    return ["", *paragraph(text, "REDUNDANT   ")]


def _one_sided(report: Mobility) -> list[str]:
    """What holds in one sense only: how many of each kind, and which."""
    parts = []
    for kind, names in report.one_sided.items():
        one, several, counted = ONE_SIDED[kind]
        what = one if len(names) == 1 else several
        parts.append(f"{len(names)} {what}, counted as {counted}: {listed(names)}")
    return ["", *paragraph("; ".join(parts), "ONE-SIDED   ")] if parts else []


def _motions(title: str, motions: Sequence[FreeMotion]) -> list[str]:
    if not motions:
        return ["", f"{title}: none"]
    wide = len(str(min(SHOWN, len(motions))))
    lines = ["", title, "─" * len(title)]
    for n, motion in enumerate(motions[:SHOWN], 1):
        lines += paragraph(motion.words, f"{n:>{wide}}  ")
    if len(motions) > SHOWN:
        lines.append(f"{'':>{wide}}  and {len(motions) - SHOWN} more")
    return lines
