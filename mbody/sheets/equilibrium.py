"""The readable sheet of rest positions: what ``print(mbody.equilibrium(machine))`` shows."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from mbody.sheets.names import ROUNDING, force_floor, force_names, noted, title
from mbody.sheets.text_table import Column, angles, even, number, numbers, paragraph, table

if TYPE_CHECKING:
    from mbody.analysis.equilibria.equilibrium import Equilibria, Equilibrium
    from mbody.analysis.equilibria.equilibrium_curve import EquilibriumCurve
    from mbody.model.coupling import Coupling
    from mbody.model.driver import Driver

__all__ = ["curve_sheet", "sheet"]

#: Positions, links and joints that are shown.
SHOWN = 12


def sheet(found: Equilibria) -> str:
    """Rest positions as text, at most 100 characters wide.

    Examples
    --------
    >>> import mbody
    >>> from mbody.engineering import equilibrium_curve
    >>> machine = mbody.Mechanism("pendulum")
    >>> machine.add(mbody.Body("rod", mass=2.0, cg=(0.5, 0.0)))
    >>> machine.add(mbody.Revolute("O", "ground", "rod"))
    >>> machine.add(mbody.Gravity("gravity", y=-9.81))
    >>> print(sheet(mbody.equilibrium(machine)).splitlines()[6].split()[:3])
    ['1', 'stable', '9.81']
    """
    count = len(found)
    counted = f"{count} rest position{'' if count == 1 else 's'}"
    when = f"equilibrium at t = {number(found.t)} {found.units.time}: {counted}"
    shown = list(found)[:SHOWN]
    lines = title(found.mechanism, when, found.units)
    tables = [_positions, _links, _forces] if shown else []
    for rows in (*(one(found, shown) for one in tables), _bands(found)):
        lines += ["", *rows] if rows else []
    if count > SHOWN:
        lines.append(f"and {count - SHOWN} more")
    notes = [f"{n}: {note}" for n, one in enumerate(shown, 1) for note in one.notes]
    return "\n".join(even([*lines, *noted([*notes, *found.notes])]))


def _positions(found: Equilibria, shown: list[Equilibrium]) -> list[str]:
    """Stability, stiffness and frequencies; of several free motions the least of each."""
    least = [_least(e.stiffness) for e in shown]
    one = all(len(e.motions) == 1 for e in shown)
    leaders = {e.motions[0].leader for e in shown}
    turns = all(e.motions[0].turns for e in shown)
    unit = found.units.of("torsion stiffness" if turns else "stiffness") if one else ""
    title = "stiffness" if one else "least stiffness"
    if one and len(leaders) == 1:
        title += f" of {leaders.pop()}"
    frequencies = [number(e.frequencies[0]) if e.frequencies else "" for e in shown]
    columns = [
        Column("REST", [str(n) for n in range(1, len(shown) + 1)], text=True, whole=True),
        Column("", [e.stability for e in shown], text=True, whole=True),
        Column(title, numbers(least), unit),
        Column("frequency", frequencies, f"rad/{found.units.time}"),
        Column("residual", [f"{e.residual:.1e}" if e.residual else "0" for e in shown]),
    ]
    return table(columns)


def _bands(found: Equilibria) -> list[str]:
    """Link axes of the leader at both ends of the bands in which friction holds."""
    rows = [
        (n, band, word, None if end is None else end[band.leader])
        for n, band in enumerate(found.bands[:SHOWN], 1)
        for word, end in (("from", band.low), ("to", band.high))
        if not band.everywhere
    ]
    if not rows:
        return []
    poses = np.array([(np.nan,) * 3 if pose is None else pose for _, _, _, pose in rows])
    floor = ROUNDING * float(np.nanmax(np.abs(poses[:, :2]), initial=0.0))
    ended = ~np.isnan(poses[:, 0])
    places = [
        [text if end else "" for text, end in zip(numbers(part, floor), ended)]
        for part in poses[:, :2].T
    ]
    turned = [angles([angle])[0] if end else "no end" for angle, end in zip(poses[:, 2], ended)]
    inside = [", ".join(str(k + 1) for k in band.positions) for _, band, _, _ in rows]
    columns = [
        Column(
            "HELD", [band.leader if word == "from" else "" for _, band, word, _ in rows], text=True
        ),
        Column(
            "", [str(n) if word == "from" else "" for n, _, word, _ in rows], text=True, whole=True
        ),
        Column("", [word for _, _, word, _ in rows], text=True, whole=True),
        Column("angle", turned, "deg"),
        Column("x", places[0], found.units.length),
        Column("y", places[1], found.units.length),
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
    return least if abs(least) > ROUNDING * float(np.abs(sizes).max()) else 0.0


def _links(found: Equilibria, shown: list[Equilibrium]) -> list[str]:
    """Mass centre and angle of every link at every rest position."""
    bodies = [body.name for body in shown[0].solution.mechanism.bodies][:SHOWN]
    rows = [(n, name, e[name]) for name in bodies for n, e in enumerate(shown, 1)]
    unit, floor = found.units.length, ROUNDING * shown[0].solution.system.length
    columns = [
        Column("LINK", [name if n == 1 else "" for n, name, _ in rows], text=True),
        Column("at", [str(n) for n, _, _ in rows], whole=True),
        Column("angle", [angles(part.angle)[0] for _, _, part in rows], "deg"),
        Column("x of G", numbers([part.x[0] for _, _, part in rows], floor), unit),
        Column("y of G", numbers([part.y[0] for _, _, part in rows], floor), unit),
    ]
    return table(columns)


def _forces(found: Equilibria, shown: list[Equilibrium]) -> list[str]:
    """Joint forces, and efforts of the fixed drivers and of couplings."""
    mechanism = shown[0].solution.mechanism
    names, unit = force_names(mechanism), found.units.of
    floor = max(force_floor(e.solution) for e in shown)
    cells: list[tuple[str, str, int, float, float]] = []
    for joint in mechanism.joints[:SHOWN]:
        for n, e in enumerate(shown, 1):
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
            Column("x", numbers([c[3] for c in cells], floor), unit("force")),
            Column("y", numbers([c[4] for c in cells], floor), unit("force")),
            Column("magnitude", numbers([np.hypot(*c[3:]) for c in cells], floor), unit("force")),
        ]
    )
    elements: tuple[Driver | Coupling, ...] = (*mechanism.drivers, *mechanism.couplings)
    for element in elements:
        efforts = [float(e.solution.effort(element.name)[0]) for e in shown]
        what = unit(element.effort_dimension)
        row = ", ".join(number(effort) for effort in efforts)
        lines += paragraph(f"{row} {what}", f"effort of {element.name}   ")
    return lines


def curve_sheet(curve: EquilibriumCurve) -> str:
    """A curve of rest positions as text: its ends, folds and crossings, and what lies between.

    Examples
    --------
    >>> import mbody
    >>> from mbody.engineering import equilibrium_curve
    >>> machine = mbody.Mechanism("pendulum")
    >>> machine.add(mbody.Body("rod", mass=2.0, cg=(0.5, 0.0)))
    >>> machine.add(mbody.Revolute("O", "ground", "rod"))
    >>> machine.add(mbody.Gravity("gravity", y=-9.81), mbody.Torque("push", "rod", value=0.0))
    >>> curve = equilibrium_curve(machine, "push.value", (0.0, 20.0), points=60)
    >>> curve_sheet(curve).splitlines()[0]
    'pendulum'
    """
    machine, last = curve.solution.mechanism, len(curve) - 1
    marks = {0: "begin", last: "end"}
    marks |= dict.fromkeys(curve.folds, "fold") | dict.fromkeys(curve.crossings, "crossing")
    changed = [n for n in range(1, last) if curve.stability[n] != curve.stability[n - 1]]
    alone = {n for n in changed if n not in marks and n - 1 not in marks}
    rows = sorted({*marks, *alone})[: 2 * SHOWN]
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
    lines = [*title(machine.name, about, machine.units), "", *table(columns)]
    return "\n".join(even([*lines, *noted(curve.notes)]))


def _moving(curve: EquilibriumCurve, name: str, rows: list[int]) -> list[Column]:
    """The angle of a link, or of one that does not turn the coordinates that change."""
    history, unit = curve[name], curve.solution.mechanism.units.length
    length = curve.solution.system.length
    if np.ptp(history.angle) > ROUNDING:
        return [Column(name, angles(history.angle[rows]), "deg")]
    parts = {"x": history.x, "y": history.y}
    return [
        Column(f"{key} of {name}", numbers(part[rows], ROUNDING * length), unit)
        for key, part in parts.items()
        if np.ptp(part) > ROUNDING * length
    ]
