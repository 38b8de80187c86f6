"""The readable summaries of all other results: equilibria, modes, mobility, answers."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from mbody.core.tolerances import LENGTH_NONE, PRINTED_NONE, ROOT_REAL
from mbody.model.element import listed
from mbody.solution.measures import shown_values
from mbody.summaries.instant import measures
from mbody.summaries.text_table import (
    Column,
    certified,
    directions,
    even,
    force_floor,
    force_names,
    noted,
    number,
    numbers,
    paragraph,
    quantities,
    table,
    title,
)

if TYPE_CHECKING:
    from collections.abc import Sequence

    from mbody.analysis.assemblies.assembly_modes import AssemblyModes
    from mbody.analysis.assemblies.circuits import Circuit, Circuits, DeadCentres
    from mbody.analysis.equilibria.equilibrium import Equilibria, Equilibrium
    from mbody.analysis.equilibria.equilibrium_curve import EquilibriumCurve
    from mbody.analysis.freedom.mobility import Count, FreeMotion, Mobility
    from mbody.analysis.inverse.conditions import Answer, AnswerCase
    from mbody.analysis.linear.modes import Mode, Modes, ModesAt
    from mbody.model.coupling import Coupling
    from mbody.model.driver import Driver
    from mbody.model.mechanism import Mechanism
    from mbody.quantities.output_units import OutputUnits


#: Free motions and joints that are shown.
LISTED_JOINTS = 12
#: What holds in one direction only: one of it, several, and how it is counted.
ONE_SIDED = {
    "contacts": ("contact", "contacts", "open"),
    "ropes": ("rope", "ropes", "slack"),
    "stops": ("stop", "stops", "open"),
    "freewheels": ("freewheel", "freewheels", "free"),
    "limits": ("limit of a joint", "limits of joints", "open"),
    "joints": ("joint that can separate", "joints that can separate", "closed"),
}


def mobility_summary(report: Mobility) -> str:
    """A mobility report as text, at most 100 characters wide.

    >>> import mbody
    >>> report = mbody.mobility(mbody.makers.four_bar(1, 3, 2, 3.5))
    >>> print(mobility_summary(report).splitlines()[10])
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
    """Titles of the counted quantities, and the counts by the title of their column."""
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
    if len(words) > LISTED_JOINTS:
        words[LISTED_JOINTS:] = [f"{len(words) - LISTED_JOINTS} joints more"]
    rows = many(report.of_joints.redundant, "row")
    where = " at this position" if report.of_joints.singular else ""
    names = " or ".join([", ".join(words[:-1]), words[-1]])
    text = f"{rows} can be removed{where} and nothing is set free, from {names}"
    return ["", *paragraph(text, "REDUNDANT   ")]


def _one_sided(report: Mobility) -> list[str]:
    """Lines on one-sided constraints: how many of each kind, and which."""
    parts = []
    for kind, names in report.one_sided.items():
        one, several, counted = ONE_SIDED[kind]
        what = one if len(names) == 1 else several
        parts.append(f"{len(names)} {what}, counted as {counted}: {listed(names)}")
    return ["", *paragraph("; ".join(parts), "ONE-SIDED   ")] if parts else []


def _motions(title: str, motions: Sequence[FreeMotion]) -> list[str]:
    if not motions:
        return ["", f"{title}: none"]
    wide = len(str(min(LISTED_JOINTS, len(motions))))
    lines = ["", title, "─" * len(title)]
    for n, motion in enumerate(motions[:LISTED_JOINTS], 1):
        lines += paragraph(motion.words, f"{n:>{wide}}  ")
    if len(motions) > LISTED_JOINTS:
        lines.append(f"{'':>{wide}}  and {len(motions) - LISTED_JOINTS} more")
    return lines


# -- Summaries of assembly modes, circuits and dead centres ---------------------------------------

#: Modes that are shown.
LISTED_ASSEMBLY_MODES = 40


def assemblies_summary(found: AssemblyModes) -> str:
    """Assembly modes as text, at most 100 characters wide.

    >>> import mbody
    >>> modes = mbody.assembly_modes(mbody.makers.four_bar(40, 120, 80, 100), {"crank": "40 deg"})
    >>> print(assemblies_summary(modes).splitlines()[3])
    2 assembly modes at motor = 40 deg; it is proven that there are no more
    """
    return "\n".join(even([*_modes(found, None), *certified(found)]))


def circuits_summary(found: Circuits) -> str:
    """Assembly modes, circuits and dead centres as text."""
    units, lines = found.mechanism.shown, _modes(found.modes, found)
    dimension = "angle" if _angular(found.mechanism, found.driver) else "length"
    rows = [
        (
            f"circuit {one.number}",
            ", ".join(map(str, one.modes)) or "none here",
            " | ".join(", ".join(map(str, branch)) for branch in one.branches),
            _range(one, dimension, units),
        )
        for one in found
    ]
    if rows:
        titles = ("CIRCUIT", "modes", "branches", f"'{found.driver}'")
        columns = zip(*rows, strict=True)
        lines += ["", *table(Column(t, c, text=True) for t, c in zip(titles, columns, strict=True))]
    lines += ["", *paragraph(_dead_centres(found.dead_centres))]
    return "\n".join(even([*lines, *certified(found)]))


def closing_data(found: AssemblyModes) -> dict[str, int | float | bool | str | None]:
    """Number of modes and which one is used, ready for JSON."""
    used = None if found.used is None else found.used.name
    return {
        "count": len(found),
        "complete": found.complete,
        "within": found.within,
        "used": used,
    }


def closing_line(found: AssemblyModes) -> list[str]:
    """Number of modes and which one is used, in a sentence."""
    where = " and ".join(_value(name, value, found) for name, value in found.at.items())
    proof = "" if found.complete and found.within is None else ", and maybe in more"
    ways = many(len(found), "way")
    used = found.used
    chosen = ""
    if used is not None and (len(found) > 1 or proof):
        name = "" if used.name == str(used.number) else f" {used.name}"
        chosen = f"; the guesses choose {used.number}{name}"
    pronoun = "it" if len(found) == 1 else "them"
    text = f"it closes in {ways}{proof} at {where}{chosen}; mbody assemblies shows {pronoun}"
    return paragraph(text, "ASSEMBLIES   ")


def dead_centres_summary(found: DeadCentres) -> str:
    """Dead centres as text."""
    lines = title(found.mechanism.name, f"dead centres of '{found.driver}'", found.mechanism.shown)
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
    lines = title(machine.name, f"assemblies at {where}" if where else "assemblies", machine.shown)
    counted = f"{many(len(found), 'assembly mode')} at {where or 'rest'}"
    proof = "; it is proven that there are no more" if found.complete else ""
    if not len(found) and found.complete:
        proof = "; it is proven that the loops close nowhere there"
    if proof and found.within is not None:
        within = f"{machine.shown.converted(found.within, 'length'):.4g}"
        proof += f" within displacements of {within} {machine.shown.of('length')}"
    lines += ["", *paragraph(counted + proof), ""]
    modes = list(found)[:LISTED_ASSEMBLY_MODES]
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
    floor = LENGTH_NONE * max((abs(part) for place in places for part in place[:2]), default=1.0)
    columns.append(Column("LINK", [name for _ in modes for name in names], text=True))
    for k, axis in enumerate("xy"):
        values = [place[k] for place in places]
        columns += [quantities(axis, values, "length", machine.shown, floor)] if places else []
    if modes:
        columns.append(directions("angle", [place[2] for place in places], machine.shown))
        lines += table(columns)
    if len(found) > LISTED_ASSEMBLY_MODES:
        lines.append(f"and {len(found) - LISTED_ASSEMBLY_MODES} more")
    return lines


def _angular(machine: object, driver: str) -> bool:
    drivers = getattr(machine, "drivers", ())
    return any(one.name == driver and one.angular for one in drivers)


def _value(name: str, value: float, found: AssemblyModes) -> str:
    units = found.mechanism.shown
    dimension = "angle" if _angular(found.mechanism, name) else "length"
    shown = float(units.converted(value, dimension))
    return f"{name} = {round(shown, 9):.10g} {units.of(dimension)}"


def _range(one: Circuit, dimension: str, units: OutputUnits) -> str:
    if one.full_turn:
        return "turns all the way round"
    if one.range is None:
        return "not followed to its end"
    low, high = (units.converted(x, dimension) for x in one.range)
    return f"{low:.6g} to {high:.6g} {units.of(dimension)}"


def _dead_value(found: DeadCentres, value: float) -> str:
    units = found.mechanism.shown
    if found.angular and units.of("angle") == "deg":
        return f"{math.degrees(value):.6f}°"
    dimension = "angle" if found.angular else "length"
    return f"{units.converted(value, dimension):.9g} {units.of(dimension)}"


def _dead_centres(found: DeadCentres) -> str:
    if not found.closes:
        return f"it is proven that the loops close at no value of '{found.driver}'"
    if found.full_turn:
        none = f"'{found.driver}' has no dead centre in any mode"
        return f"{none}: it is proven that it turns all the way round"
    angular = found.angular
    texts = [_dead_value(found, value) for value in found.values.tolist()]
    proof = "; it is proven that there are no more" if found.complete else ""
    note = ""
    if angular and texts:
        note = f". '{found.driver}' does not turn all the way round in every mode"
    elif angular:
        note = ". Whether it turns all the way round in every mode is not proven"
    return f"dead centres of '{found.driver}': {', '.join(texts) or 'none was met'}{proof}{note}"


# -- The readable summary of equilibria: what ``print(mbody.equilibrium(machine))`` shows --------

#: Positions, links and joints that are shown.
LISTED_EQUILIBRIA = 12


def equilibrium_summary(found: Equilibria) -> str:
    """Equilibria as text, at most 100 characters wide.

    >>> import mbody
    >>> from mbody.engineering import equilibrium_curve
    >>> machine = mbody.Mechanism("pendulum")
    >>> machine.add(mbody.Body("rod", mass=2.0, cg=(0.5, 0.0)))
    >>> machine.add(mbody.Revolute("O", "ground", "rod"))
    >>> machine.add(mbody.Gravity("gravity", y=-9.81))
    >>> print(equilibrium_summary(mbody.equilibrium(machine)).splitlines()[6].split()[:3])
    ['1', 'stable', '9.81']
    """
    count = len(found)
    counted = f"{count} rest position{'' if count == 1 else 's'}"
    when = f"equilibrium at t = {number(found.t)} {found.units.time}: {counted}"
    listed_ones = list(found)[:LISTED_EQUILIBRIA]
    lines = title(found.mechanism, when, found.units)
    tables = [_positions, _links, _forces] if listed_ones else []
    for rows in (*(one(found, listed_ones) for one in tables), _bands(found)):
        lines += ["", *rows] if rows else []
    if count > LISTED_EQUILIBRIA:
        lines.append(f"and {count - LISTED_EQUILIBRIA} more")
    notes = [f"{n}: {note}" for n, one in enumerate(listed_ones, 1) for note in one.notes]
    return "\n".join(even([*lines, *noted([*notes, *found.notes])]))


def _positions(found: Equilibria, listed_ones: list[Equilibrium]) -> list[str]:
    """Stability, stiffness and frequencies; of several free motions the least of each."""
    least = [_least(e.stiffness) for e in listed_ones]
    one = all(len(e.motions) == 1 for e in listed_ones)
    leaders = {e.motions[0].leader for e in listed_ones}
    angular = all(e.motions[0].turns for e in listed_ones)
    units = listed_ones[0].solution.mechanism.shown
    dimension = ("torsion stiffness" if angular else "stiffness") if one else "number"
    title = "stiffness" if one else "least stiffness"
    if one and len(leaders) == 1:
        title += f" of {leaders.pop()}"
    frequencies = [number(e.frequencies[0]) if e.frequencies else "" for e in listed_ones]
    columns = [
        Column("REST", [str(n) for n in range(1, len(listed_ones) + 1)], text=True, whole=True),
        Column("", [e.stability for e in listed_ones], text=True, whole=True),
        quantities(title, least, dimension, units),
        Column("frequency", frequencies, f"rad/{found.units.time}"),
        Column("residual", [f"{e.residual:.1e}" if e.residual else "0" for e in listed_ones]),
    ]
    return table(columns)


def _bands(found: Equilibria) -> list[str]:
    """Link axes of the leader at both ends of the bands in which friction holds."""
    rows = [
        (n, band, word, None if end is None else end[band.leader])
        for n, band in enumerate(found.bands[:LISTED_EQUILIBRIA], 1)
        for word, end in (("from", band.low), ("to", band.high))
        if not band.everywhere
    ]
    if not rows:
        return []
    poses = np.array([(np.nan,) * 3 if pose is None else pose for _, _, _, pose in rows])
    floor = PRINTED_NONE * float(np.nanmax(np.abs(poses[:, :2]), initial=0.0))
    ended = ~np.isnan(poses[:, 0])
    units = found[0].solution.mechanism.shown
    x, y = (quantities(key, part, "length", units, floor) for key, part in zip("xy", poses.T))
    turned = directions("angle", poses[:, 2], units)
    for column, none in ((x, ""), (y, ""), (turned, "no end")):
        column.cells = [text if end else none for text, end in zip(column.cells, ended)]
    inside = [", ".join(str(k + 1) for k in band.positions) for _, band, _, _ in rows]
    columns = [
        Column(
            "HELD", [band.leader if word == "from" else "" for _, band, word, _ in rows], text=True
        ),
        Column(
            "", [str(n) if word == "from" else "" for n, _, word, _ in rows], text=True, whole=True
        ),
        Column("", [word for _, _, word, _ in rows], text=True, whole=True),
        turned,
        x,
        y,
        Column(
            "rests",
            [text if row[2] == "from" else "" for text, row in zip(inside, rows, strict=True)],
            text=True,
        ),
    ]
    return table(columns)


def _least(stiffness: np.ndarray) -> float:
    """The least eigenvalue; what is rounding beside the greatest is none."""
    sizes = np.linalg.eigvalsh(0.5 * (stiffness + stiffness.T))
    least = float(sizes.min())
    return least if abs(least) > PRINTED_NONE * float(np.abs(sizes).max()) else 0.0


def _links(found: Equilibria, listed_ones: list[Equilibrium]) -> list[str]:
    """Mass centre and angle of every link at every equilibrium."""
    bodies = [body.name for body in listed_ones[0].solution.mechanism.bodies][:LISTED_EQUILIBRIA]
    rows = [(n, name, e[name]) for name in bodies for n, e in enumerate(listed_ones, 1)]
    first = listed_ones[0].solution
    units, floor = first.mechanism.shown, PRINTED_NONE * first.system.length
    columns = [
        Column("LINK", [name if n == 1 else "" for n, name, _ in rows], text=True),
        Column("at", [str(n) for n, _, _ in rows], whole=True),
        directions("angle", [part.angle[0] for _, _, part in rows], units),
        quantities("x of G", [part.x[0] for _, _, part in rows], "length", units, floor),
        quantities("y of G", [part.y[0] for _, _, part in rows], "length", units, floor),
    ]
    return table(columns)


def _forces(found: Equilibria, listed_ones: list[Equilibrium]) -> list[str]:
    """Joint forces, and efforts of the fixed drivers and of couplings."""
    mechanism = listed_ones[0].solution.mechanism
    names, units = force_names(mechanism), mechanism.shown
    floor = max(force_floor(e.solution) for e in listed_ones)
    cells: list[tuple[str, str, int, float, float]] = []
    for joint in mechanism.joints[:LISTED_EQUILIBRIA]:
        for n, e in enumerate(listed_ones, 1):
            force = e.reaction(joint.name, on=names[joint.name][1])
            labels = (names[joint.name][0], joint.name)
            cells.append((*labels, n, float(force.fx[0]), float(force.fy[0])))
    if not cells:
        return []
    lines = table(
        [
            Column("FORCE", [c[0] if c[2] == 1 else "" for c in cells], text=True, whole=True),
            Column("joint", [c[1] if c[2] == 1 else "" for c in cells], text=True),
            Column("at", [str(c[2]) for c in cells], whole=True),
            quantities("x", [c[3] for c in cells], "force", units, floor),
            quantities("y", [c[4] for c in cells], "force", units, floor),
            quantities("magnitude", [np.hypot(*c[3:]) for c in cells], "force", units, floor),
        ]
    )
    elements: tuple[Driver | Coupling, ...] = (*mechanism.drivers, *mechanism.couplings)
    for element in elements:
        efforts = [float(e.solution.effort(element.name)[0]) for e in listed_ones]
        what = element.effort_dimension
        row = ", ".join(number(one) for one in units.converted(np.array(efforts), what))
        lines += paragraph(f"{row} {units.of(what)}", f"effort of {element.name}   ")
    return lines


def curve_summary(curve: EquilibriumCurve) -> str:
    """A curve of equilibria as text: its ends, folds and crossings, and what lies between.

    >>> import mbody
    >>> from mbody.engineering import equilibrium_curve
    >>> machine = mbody.Mechanism("pendulum")
    >>> machine.add(mbody.Body("rod", mass=2.0, cg=(0.5, 0.0)))
    >>> machine.add(mbody.Revolute("O", "ground", "rod"))
    >>> machine.add(mbody.Gravity("gravity", y=-9.81), mbody.Torque("push", "rod", value=0.0))
    >>> curve = equilibrium_curve(machine, "push.value", (0.0, 20.0), points=60)
    >>> curve_summary(curve).splitlines()[0]
    'pendulum'
    """
    machine, last = curve.solution.mechanism, len(curve) - 1
    marks = {0: "begin", last: "end"}
    marks |= dict.fromkeys(curve.folds, "fold") | dict.fromkeys(curve.crossings, "crossing")
    stability_changes = [n for n in range(1, last) if curve.stability[n] != curve.stability[n - 1]]
    alone = {n for n in stability_changes if n not in marks and n - 1 not in marks}
    rows = sorted({*marks, *alone})[: 2 * LISTED_EQUILIBRIA]
    bodies = [body.name for body in machine.bodies][:6]
    onward = [curve.stability[min(n + 1, last)] for n in rows]
    columns = [
        Column("CURVE", [marks.get(n, "") for n in rows], text=True, whole=True),
        Column(curve.parameter, numbers(curve.values[rows]), curve.unit),
        Column("arclength", numbers(curve.arclength[rows])),
    ]
    columns += [column for name in bodies for column in _moving(curve, name, rows)]
    columns.append(Column("onward", onward, text=True, whole=True))
    about = f"rest positions along {curve.parameter}: {len(curve)} points"
    lines = [*title(machine.name, about, machine.shown), "", *table(columns)]
    return "\n".join(even([*lines, *noted(curve.notes)]))


def _moving(curve: EquilibriumCurve, name: str, rows: list[int]) -> list[Column]:
    """The angle of a link, or of one that does not turn the coordinates that change."""
    history, units = curve[name], curve.solution.mechanism.shown
    length = curve.solution.system.length
    if np.ptp(history.angle) > PRINTED_NONE:
        return [directions(name, history.angle[rows], units)]
    parts = {"x": history.x, "y": history.y}
    return [
        quantities(f"{key} of {name}", part[rows], "length", units, PRINTED_NONE * length)
        for key, part in parts.items()
        if np.ptp(part) > PRINTED_NONE * length
    ]


# -- The readable summary of modes: what ``print(mbody.modes(machine))`` shows -------------------

#: Positions, modes of each, and leaders of a mode that are shown.
LISTED_MODES, MODES, LEADERS = 6, 20, 4


def modes_summary(found: Modes) -> str:
    """Modes as text, at most 100 characters wide.

    >>> import mbody
    >>> machine = mbody.Mechanism("pendulum")
    >>> machine.add(mbody.Body("rod", mass=2.0, cg=(0.5, 0.0)))
    >>> machine.add(mbody.Revolute("O", "ground", "rod"))
    >>> machine.add(mbody.Gravity("gravity", y=-9.81))
    >>> print(modes_summary(mbody.modes(machine)).splitlines()[7].split()[:4])
    ['1', 'oscillates', '4.42945', '0.704968']
    """
    count = len(found)
    counted = f"{count} rest position{'' if count == 1 else 's'}"
    when = f"modes at t = {number(found.t)} {found.units.time}: {counted}"
    lines = title(found.mechanism, when, found.units)
    for n, one in enumerate(list(found)[:LISTED_MODES], 1):
        lines += ["", *paragraph(f"{one.stability}, at {_where(one)}", f"REST {n}   ")]
        lines += _table(found, one)
        lines += [line for note in one.notes for line in paragraph(note, "NOTE   ")]
    if count > LISTED_MODES:
        lines.append(f"and {count - LISTED_MODES} more")
    return "\n".join(even([*lines, *certified(found)]))


def _where(one: ModesAt) -> str:
    """The position by its leaders: their angles, or places of what slides."""
    solution, words = one.linear.solution, list[str]()
    units = solution.mechanism.shown
    leaders = {motion.leader: motion for motion in reversed(one.linear.motions)}
    motions = sorted(leaders.values(), key=one.linear.motions.index)
    for motion in motions[:LEADERS]:
        body, name = solution[motion.leader], motion.leader
        if motion.turns:
            degrees = round(float(np.degrees(body.angle[-1])) % 360.0, 3) % 360.0
            words.append(f"{name} {degrees:.3f}°")
        else:
            floor = PRINTED_NONE * solution.system.length
            x, y = (0.0 if abs(part[-1]) <= floor else float(part[-1]) for part in (body.x, body.y))
            at = (number(units.converted(part, "length")) for part in (x, y))
            words.append(f"{name} ({', '.join(at)}) {units.of('length')}")
    more = len(motions) - LEADERS
    return ", ".join(words) + (f" and {more} more" if more > 0 else "")


def _table(found: Modes, one: ModesAt) -> list[str]:
    modes = one.modes[:MODES]
    if not modes:
        return ["no mode: nothing that is free has inertia"]
    time = found.units.time
    cycles = "Hz" if time == "s" else f"1/{time}"
    frequencies, oscillates = [m.frequency for m in modes], [bool(m.frequency) for m in modes]
    swinging = [
        cell if on else "" for cell, on in zip(numbers(frequencies), oscillates, strict=True)
    ]
    hertz = [m.hertz for m in modes]
    often = [cell if on else "" for cell, on in zip(numbers(hertz), oscillates, strict=True)]
    damped = any(m.damping_ratio and m.frequency for m in modes)
    ratios = [number(m.damping_ratio) if m.frequency else "" for m in modes]
    decaying = [m.decay_rate for m in modes]
    rates = [cell if x else "" for cell, x in zip(numbers(decaying), decaying, strict=True)]
    columns = [
        Column("MODE", [str(n) for n in range(1, len(modes) + 1)], text=True, whole=True),
        Column("", [m.words for m in modes], text=True, whole=True),
        Column("frequency", swinging, f"rad/{time}"),
        Column("", often, cycles),
        Column("damping ratio", ratios if damped else [""] * len(modes)),
        Column("decay rate", rates, f"1/{time}"),
        Column("shape", [_shape(one, m) for m in modes], text=True),
    ]
    lines = table(columns)
    return [*lines, f"and {len(one) - MODES} more"] if len(one) > MODES else lines


def _names(one: ModesAt) -> list[str]:
    """The leaders, and what they do where one leads several motions."""
    names = list(one.linear.leaders)
    for n, motion in enumerate(one.linear.motions):
        if one.linear.leaders.count(motion.leader) > 1:
            x, y, rotation = np.abs(motion.rates[motion.leader])
            names[n] = f"{'θ' if rotation > 0.5 else 'x' if x > y else 'y'} of {motion.leader}"
    return names


def _shape(one: ModesAt, mode: Mode) -> str:
    """Leaders with their parts, such as "a 1 : b -1.41"; where they lag, their phases."""
    parts = []
    for name, part in list(zip(_names(one), mode.amplitudes, strict=True))[:LEADERS]:
        if abs(part.imag) <= ROOT_REAL:
            parts.append(f"{name} {round(float(part.real), 6) + 0.0:.3g}")
        else:
            degrees = float(np.degrees(np.angle(part)))
            parts.append(f"{name} {abs(part):.3g} @ {degrees:.0f}°")
    return " : ".join(parts) + (" …" if len(mode.amplitudes) > LEADERS else "")


# -- The readable summary of answers: what ``print(mbody.solve_for(machine, ...))`` shows --------


def answers_summary(answer: Answer, name: str = "") -> str:
    """An answer as text, at most 100 characters wide.

    >>> import mbody
    >>> machine = mbody.makers.four_bar(1, 3, 2, 3.5, masses=(1, 3, 2), speed=10.0)
    >>> machine.add(mbody.Torque("brake", "rocker", value=1.0))
    >>> answer = mbody.solve_for(machine, "brake", "motor.effort = 0")
    >>> print(answers_summary(answer).splitlines()[2])
    conditions: motor.effort = 0
    """
    question = answer.question
    lines = paragraph(f"{answer.mechanism.name}{': ' + name if name else ''}")
    if question.note:
        lines += paragraph(question.note)
    lines += ["", *_requested(answer)]
    for n, found in enumerate(answer.solutions, start=1):
        title = "UNKNOWNS" if len(answer) == 1 else f"SOLUTION {n}"
        lines += ["", *_answer_lines(found, title)]
    if answer.doubts:
        lines += ["", *paragraph(answer.status, "STATUS   ")]
    return "\n".join(even([*lines, *noted(answer.notes)]))


def _requested(answer: Answer) -> list[str]:
    question = answer.question
    lines = []
    if question.objective:
        word = "greatest" if question.greatest else "least"
        lines += paragraph(f"{word}: {question.objective}")
    if question.conditions:
        lines += paragraph("conditions: " + ",  ".join(question.conditions))
    if question.side_conditions:
        lines += paragraph("side conditions: " + ",  ".join(question.side_conditions))
    return lines


def _answer_lines(found: AnswerCase, title: str) -> list[str]:
    """The unknowns, what binds, the forces of the joints and the measures."""
    names, run = list(found.unknowns), found.run
    lines = table(
        [
            Column(title, names, text=True),
            Column("value", [number(found.unknowns[name]) for name in names]),
            Column("unit", [found.units[name] for name in names], text=True),
        ]
    )
    if found.binding:
        lines += paragraph("binds: " + ",  ".join(found.binding))
    lines += ["", *_joints(found)] if run.mechanism.joints else []
    own = measures(run)
    lines += ["", *own] if own else []
    return [*lines, "", f"RESIDUAL   {found.residual:.1e}   (of the conditions, relative)"]


def _joints(found: AnswerCase) -> list[str]:
    run = found.run
    units = run.mechanism.shown
    reactions = [run.reaction(joint.name) for joint in run.mechanism.joints]
    x, y = (np.array([getattr(r, key)[-1] for r in reactions]) for key in ("fx", "fy"))
    floor = PRINTED_NONE * float(np.hypot(x, y).max(initial=0.0))
    return table(
        [
            Column("FORCES", [r.joint for r in reactions], text=True),
            quantities("x", x, "force", units, floor),
            quantities("y", y, "force", units, floor),
            Column("i on j", [f"{r.by} on {r.on}" for r in reactions], text=True),
        ]
    )


# -- The readable summary of a cross-check: what ``print(mbody.crosscheck(machine))`` shows ------

#: Quantities of an engine that are shown, where some differ and where all agree: the worst first.
LISTED_QUANTITIES, LISTED_IF_ALL_AGREE = 16, 8


def crosscheck_summary(report: Any) -> str:
    """A cross-check as text, at most 100 characters wide."""
    run = report.run
    instants = f"{len(run)} instants" if len(run) > 1 else "1 instant"
    about = f"cross-check of {run.analysis}, {instants}"
    lines = title(run.mechanism.name, about, run.mechanism.shown)
    for name, result in report.opinions.items():
        lines += ["", *_engine_lines(name, result, run.mechanism)]
    verdict = "all agree"
    if report.agrees is None:
        verdict = f"nothing differs; not compared by another engine: {listed(report.not_compared)}"
    elif not report.agrees:
        verdict = "THEY DIFFER"
    doubts = [line for one in report.run.doubts for line in paragraph(one.message, "DOUBT   ")]
    return "\n".join(even([*lines, "", *doubts, *paragraph(verdict, "VERDICT   ")]))


def _engine_lines(name: str, result: Any, machine: Mechanism) -> list[str]:
    """One engine: its quantities, what it cannot express, how it was used."""
    rows = sorted(result.rows, key=_relative_difference, reverse=True)
    differ = [row for row in rows if row.verdict != "agrees"]
    most = LISTED_QUANTITIES if differ else LISTED_IF_ALL_AGREE
    lines = _quantity_table(result.engine, rows[:most], machine)
    more = len(rows) - most
    summary = f"DIFFERS in {len(differ)} of" if differ else "agrees in"
    summary += f" {len(rows)} quantities"
    summary += f" ({more} not shown, nearer than these)" if more > 0 else ""
    lines += paragraph(summary if rows else "nothing to compare", f"{name}: ")
    for reason in dict.fromkeys(row.reason for row in rows):
        lines += paragraph(reason, "expected: ")
    for one in result.not_expressible:
        lines += paragraph(one.why, f"not expressible: {one.element}: ")
    return [*lines, *noted(result.notes)]


def _relative_difference(row: Any) -> float:
    """The difference as a part of what is expected."""
    return float(row.difference / row.expected) if row.expected else float("inf")


def _quantity_table(engine: str, rows: Sequence[Any], machine: Mechanism) -> list[str]:
    if not rows:
        return [engine]
    shown = [shown_values(machine, row.quantity, row.ours, row.theirs) for row in rows]
    return table(
        [
            Column(engine.upper(), [row.quantity for row in rows], text=True),
            Column("ours", [number(ours) for (ours, _), _ in shown]),
            Column("theirs", [number(theirs) for (_, theirs), _ in shown]),
            Column("unit", [unit for _, unit in shown], text=True, whole=True),
            Column("difference", [f"{row.difference:.1e}" for row in rows]),
            Column("expected", [f"{row.expected:.1e}" for row in rows]),
            Column("verdict", [row.verdict for row in rows], text=True, whole=True),
        ]
    )
