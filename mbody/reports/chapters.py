"""The template of a report: its chapters in order, each made by one function."""

from __future__ import annotations

import platform
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from mbody._version import __version__
from mbody.core.other_words import meant
from mbody.core.tolerances import PRINTED_NONE, REPORT_SIZES_ALIKE, TINY
from mbody.engineering.flywheel import fluctuation, link_energy
from mbody.engineering.shaking import shaking_force
from mbody.engines.balance import CrosscheckResult
from mbody.errors import ModelError, SolveError, brief
from mbody.model.simulation import mean_over
from mbody.quantities.units import DIMENSIONS
from mbody.reports.described import (
    ROWS,
    Block,
    Chapter,
    FileText,
    Grid,
    Items,
    Notice,
    Picture,
    ReportDocument,
    Subject,
    Text,
    book,
    first_rows,
    inputs,
    method,
    mobility,
    sketch,
)
from mbody.solution.measures import shown_values
from mbody.summaries.text_table import (
    Column,
    UnitsOfText,
    acceleration_scale,
    directions,
    floor_of,
    number,
    numbers,
    rounding,
    turned,
    uniqueness_text,
    value_rows,
    with_unit,
)
from mbody.views.free_bodies import MOST, draw_free_bodies, when
from mbody.views.plotting import PlottedCurve, all_measures, hodograph, plot, plot_curves
from mbody.views.sketch import MODES, mode_rows

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from mbody.model.mechanism import Mechanism


# -- Chapters of figures: plots over the cycle, hodographs of forces, free-body diagrams -------

#: Panels of one figure; joints whose forces are plotted where nobody says which.
PANELS, FORCES = 4, 6
#: Inches that a title takes.
TITLE = 0.3
#: Links whose diagrams are shown where there are more.
LINKS = 12


def plots(subject: Subject) -> list[Block]:
    """Efforts, joint forces and measures over the cycle."""
    run = subject.run
    if not subject.many:
        return []
    groups: list[tuple[str, list[str]]] = []
    if subject.plots:
        groups = _panels("Chosen quantities", list(subject.plots))
    else:
        drivers = subject.mechanism.drivers if subject.loaded else ()
        efforts = [f"{driver.name}.effort" for driver in drivers]
        joints = [f"{name}.force" for name in greatest(subject)]
        if efforts or joints:
            groups = [("Efforts and joint forces", [*efforts[:3], *joints])]
        if subject.mechanism.measures:
            groups += _panels("Measures", all_measures(run))
        if not groups:
            bodies = [body.name for body in subject.mechanism.bodies][:3]
            groups = [
                ("Motion", [f"{body}.{key}" for key in ("angle", "omega") for body in bodies])
            ]
    return [
        # the bars of modes are below the first
        Picture(
            f"plot-{n}", untitled(plot(run, *names, modes=n == 1)), f"{title}: {', '.join(names)}"
        )
        for n, (title, names) in enumerate(groups, 1)
    ]


def untitled(figure: Figure) -> Figure:
    """A figure without its title, which every figure of a report would repeat."""
    titles = [text for text in figure.texts if text.get_gid() == "title"]
    if not titles:
        return figure
    wide, tall = figure.get_size_inches()
    ratio = tall / (tall - TITLE)
    for text in titles:
        text.remove()
    for axes in figure.axes:
        box = axes.get_position()
        axes.set_position((box.x0, ratio * box.y0, box.width, ratio * box.height))
    for text in figure.texts:
        text.set_y(ratio * text.get_position()[1])
    drawn: list[Any] = [*figure.lines, *figure.artists]
    for line in drawn:  # those of the legend
        line.set_ydata(ratio * np.asarray(line.get_ydata()))
    figure.set_size_inches(wide, tall - TITLE)
    return figure


def _panels(title: str, names: list[str]) -> list[tuple[str, list[str]]]:
    """Names in figures of a few panels."""
    most = 2 * PANELS
    return [(title, names[n : n + most]) for n in range(0, len(names), most)]


def greatest(subject: Subject) -> list[str]:
    """The joints of the greatest forces, one of those that are alike."""
    if not subject.run.has_forces:
        return []
    peaks: dict[str, float] = {}
    known: list[np.ndarray] = []
    for joint in subject.mechanism.joints:
        size = subject.run.reaction(joint.name).magnitude
        top = float(np.nanmax(size, initial=0.0))
        alike = any(
            np.allclose(size, other, rtol=REPORT_SIZES_ALIKE, atol=REPORT_SIZES_ALIKE * top)
            for other in known
        )
        if top > subject.floor and not alike:
            peaks[joint.name] = top
            known.append(size)
    return sorted(sorted(peaks, key=lambda name: -peaks[name])[:FORCES], key=list(peaks).index)


def polar(subject: Subject) -> list[Block]:
    """The tips of joint forces in world axes, and in those of the crank."""
    run = subject.run
    names = list(subject.polar) or greatest(subject)
    if not subject.many or not names:
        return []
    blocks: list[Block] = [
        Text(
            "The curve of the tip of each force over the cycle: how far and in which direction it "
            "loads its bearing. Dots are 30 degrees of the driver apart, the circle is the first "
            "instant."
        ),
        Picture("forces-world", untitled(hodograph(run, *names)), "Joint forces in world axes"),
    ]
    for driver in subject.mechanism.drivers[:1]:
        body = getattr(driver, "body", None)
        own = [name for name in names if body in _ends(subject, name)]
        if body is not None and own:
            figure = untitled(hodograph(run, *own, axes=body))
            caption = f"Forces on {body}, in its own axes: where its journals are loaded"
            blocks.append(Picture("forces-link", figure, caption))
    return blocks


def _ends(subject: Subject, joint: str) -> set[str]:
    element = next(one for one in subject.mechanism.joints if one.name == joint)
    return {element.i.body, element.j.body}


def freebody(subject: Subject) -> list[Block]:
    """Every link alone, at the chosen instants."""
    run = subject.run
    if not subject.marked or not (subject.loaded or run.analysis == "simulate"):
        return []
    bodies = [body.name for body in subject.mechanism.bodies]
    listed = bodies[:LINKS]
    blocks: list[Block] = [
        Text(
            "Every link alone, to scale; d'Alembert's forces −m·a_{G} and torques −I·α are dashed. "
            "Beside it its force polygon, which closes."
        )
    ]
    if len(bodies) > len(listed):
        blocks.append(Text(f"The first {len(listed)} of {len(bodies)} links are shown."))
    for k in subject.marked[: max(1, MOST // len(listed))]:
        for n, body in enumerate(listed, 2):
            figure = draw_free_bodies(run, [body], [k], headed=False)
            caption = f"Link {n}, {body}: {when(run, k)}"
            blocks.append(Picture(f"freebody-{k}-{body}", figure, caption))
    return blocks


# -- Chapters of results in tables: what matters most, links, joints, drivers and measures -----

Array = np.ndarray


def where_columns(subject: Subject, instants: Sequence[int]) -> list[Column]:
    """Columns that say where something is."""
    return [Column(title, cells, unit) for title, cells, unit in subject.where(instants)]


def _where_there(subject: Subject, instants: Sequence[int], there: Sequence[bool]) -> list[Column]:
    """The first of these columns; blank of what is zero, or the same, all the time."""
    return [
        Column(
            title,
            [cell if is_there else "" for cell, is_there in zip(cells, there, strict=True)],
            unit,
        )
        for title, cells, unit in subject.where(instants)[:1]
    ]


def peak(values: Array) -> int:
    """The instant of the greatest amount, of what there is."""
    return int(np.argmax(np.nan_to_num(np.abs(values), nan=-1.0)))


# -- main results ------------------------------------------------------------------------------


def summary(subject: Subject) -> list[Block]:
    """The greatest values with where they are, and whether the result is in doubt."""
    rows = [*_forces_of_all(subject), *_efforts(subject), *_motion(subject)]
    blocks: list[Block] = [_status(subject)]
    if rows:
        columns = [Column("", [row[0] for row in rows], text=True)]
        columns += [Column("value", [number(subject.shown(*row[1:3])) for row in rows])]
        columns += [Column("unit", [subject.unit(row[2]) for row in rows], text=True)]
        columns += where_columns(subject, [row[3] for row in rows])
        title = f"Greatest amounts of the {subject.course}" if subject.many else "Greatest amounts"
        blocks.append(Grid(title, columns))
    note = subject.mechanism.note
    return [*blocks, Text(note)] if note else blocks


def _status(subject: Subject) -> Notice:
    run = subject.run
    count = f"{len(run)} instants" if subject.many else "one instant"
    if run.doubts:
        return Notice("doubt", f"The result is in doubt: {run.doubts[0].message}")
    ended = "" if run.status == "completed" else f" ({run.status})"
    what = "Free motion" if run.analysis == "simulate" else run.analysis.capitalize()
    return Notice("good", f"{what}, {count}: completed without doubt{ended}.")


def _forces_of_all(subject: Subject) -> list[tuple[str, float, str, int]]:
    best: tuple[str, float, str, int] | None = None
    for joint in subject.mechanism.joints:
        name, on = subject.names[joint.name]
        size = subject.run.reaction(joint.name, on).magnitude
        k = peak(size)
        if best is None or float(size[k]) > best[1]:
            words = f"greatest joint force, {book(name)} at {joint.name}"
            best = (words, float(size[k]), "force", k)
    return [best] if best is not None and best[1] > subject.floor else []


def _efforts(subject: Subject) -> list[tuple[str, float, str, int]]:
    run, rows = subject.run, []
    for driver in subject.mechanism.drivers if subject.loaded else ():
        effort = run.effort(driver.name)
        kind = "torque" if driver.angular else "force"
        k = peak(effort)
        if abs(float(effort[k])) <= floor_of(run, DIMENSIONS[kind]):
            continue
        rows.append((f"{kind} of {driver.name}", float(effort[k]), kind, k))
        power = run.measure(f"{driver.name}.power")
        if np.abs(power).max() > 0.0:
            k = peak(power)
            rows.append((f"power of {driver.name}", float(power[k]), "power", k))
    return rows


def _motion(subject: Subject) -> list[tuple[str, float, str, int]]:
    run = subject.run
    if run.analysis == "statics":
        return []
    rows, scale = [], acceleration_scale(run)
    for what, keys, unit, floor in (
        ("speed of a mass centre", ("vx", "vy"), "velocity", np.sqrt(scale)),
        ("acceleration of a mass centre", ("ax", "ay"), "acceleration", scale),
    ):
        sizes = {
            body: np.hypot(*(getattr(run[body], key) for key in keys))
            for body in (one.name for one in subject.mechanism.bodies)
        }
        name = max(sizes, key=lambda body: float(np.nanmax(sizes[body])))
        k = peak(sizes[name])
        if float(sizes[name][k]) > PRINTED_NONE * floor * run.system.length:
            words = f"greatest {what}, {name}"
            rows.append((words, float(sizes[name][k]), unit, k))
    return rows


# -- tables ------------------------------------------------------------------------------------


def links(subject: Subject) -> list[Block]:
    """The motion of every link: its range, and its peaks."""
    run, names = subject.run, [body.name for body in subject.mechanism.bodies]
    numbered = [f"{n} {name}" for n, name in enumerate(names, 2)]
    histories, acceleration = [run[name] for name in names], acceleration_scale(subject.run)
    low, high = ([float(f(h.angle)) for h in histories] for f in (np.min, np.max))
    named = Column("link", numbered, text=True)
    columns = [named]
    if subject.many:
        columns.append(turned("angle from", low, subject.units))
        columns.append(turned("to", high, subject.units))
    else:
        columns.append(turned("angle", low, subject.units))
    if run.analysis == "statics":
        return first_rows(Grid("Links", columns))
    centres = [named] if subject.many else columns  # one table of all would be too wide
    word = "peak " if subject.many else ""
    for title, values, unit, floor in (
        ("ω", [h.omega for h in histories], "angular velocity", np.sqrt(acceleration)),
        ("α", [h.alpha for h in histories], "angular acceleration", acceleration),
        ("v_{G}", [np.hypot(h.vx, h.vy) for h in histories], "velocity", np.sqrt(acceleration)),
        ("a_{G}", [np.hypot(h.ax, h.ay) for h in histories], "acceleration", acceleration),
    ):
        scale = 1.0 if unit.startswith("angular") else run.system.length
        tops = [float(v[peak(v)]) for v in values]
        own = columns if unit.startswith("angular") else centres
        own.append(subject.column(f"{word}{title}", tops, unit, PRINTED_NONE * floor * scale))
        if subject.many:
            there = [abs(top) > PRINTED_NONE * floor * scale for top in tops]
            own += _where_there(subject, [peak(v) for v in values], there)
    found = first_rows(Grid("Motion of the links", columns))
    return found + first_rows(Grid("Motion of the mass centres", centres)) * subject.many


def joints(subject: Subject) -> list[Block]:
    """The peak force of every joint, with direction, components, torque and uniqueness."""
    run, found = subject.run, []
    if subject.run.has_forces and not subject.loaded and subject.mechanism.joints:
        words = "All forces are zero: no link has a mass, and no load acts."
        return [Notice("note", words)]
    for joint in subject.mechanism.joints:
        name, on = subject.names[joint.name]
        found.append((name, joint.name, run.reaction(joint.name, on)))
    if not found or not run.has_forces:
        return []
    note, count = "", len(found)
    if count > ROWS:
        tops = np.array([r.magnitude[peak(r.magnitude)] for *_, r in found])
        kept = set(np.argsort(-np.round(tops / max(tops.max(), TINY), 9), kind="stable")[:ROWS])
        found = [one for n, one in enumerate(found) if n in kept]
        note = f"The {ROWS} joints with the greatest forces, of {count}; the results have all."
    at = [peak(r.magnitude) for *_, r in found]
    fx, fy = (
        np.array([getattr(r, key)[k] for k, (*_, r) in zip(at, found)]) for key in ("fx", "fy")
    )
    torque = np.array([r.torque[peak(r.torque)] for *_, r in found])
    torque_floor = subject.floor * run.system.length
    columns = [
        Column("force", [book(name) for name, *_ in found], text=True),
        Column("joint", [joint for _, joint, _ in found], text=True),
        Column("i on j", [f"{r.by} on {r.on}" for *_, r in found], text=True),
        subject.column(
            "peak" if subject.many else "force", np.hypot(fx, fy), "force", subject.floor
        ),
        directions("direction", np.arctan2(fy, fx), subject.units),
        *_where_there(subject, at, (np.hypot(fx, fy) > subject.floor).tolist()),
        subject.column("F_{x} there", fx, "force", subject.floor),
        subject.column("F_{y} there", fy, "force", subject.floor),
    ]
    if (np.abs(torque) > torque_floor).any():
        columns.append(subject.column("peak torque", torque, "torque", torque_floor))
    columns.append(Column("uniqueness", [uniqueness_text(r) for *_, r in found], text=True))
    blocks: list[Block] = [Grid("Forces of the joints", columns)]
    blocks += [Text(note)] if note else []
    if (np.abs(torque) > torque_floor).any():
        blocks.append(Text("Torques are about the joint's place on its body j."))
    return blocks


def loads(subject: Subject) -> list[Block]:
    """Efforts of the drivers and the measures of the model: least, greatest, mean, and where."""
    rows: list[tuple[str, Array, str, float]] = []
    run, found = subject.run, subject.table
    if subject.loaded:
        for driver in (*subject.mechanism.drivers, *subject.mechanism.couplings):
            book_name = subject.names.get(driver.name, ("", ""))[0]
            named = f"{driver.name}, {book(book_name)}" if book_name else driver.name
            effort = found[f"{driver.name}.effort"]
            rows.append((named, effort.values, effort.unit, rounding(run, effort)))
    for one in found:
        if one.role != "measure":
            continue
        floor = PRINTED_NONE * float(np.nanmax(np.abs(one.values), initial=0.0))
        if one.unit == subject.unit(one.quantity) and one.quantity in ("force", "torque"):
            floor = max(floor, rounding(run, one))
        of = subject.mechanism.measures[one.name].of
        rows.append((f"{one.name} (`{of}`)", one.values, one.unit, floor))
    if not rows:
        return []
    return [Grid("Efforts and measures", _extremes(subject, rows))]


def _extremes(subject: Subject, rows: Sequence[tuple[str, Array, str, float]]) -> list[Column]:
    """Columns of least, greatest and mean values."""
    columns = [Column("quantity", [row[0] for row in rows], text=True)]

    def cells(values: Sequence[Any]) -> list[str]:
        pairs = zip(values, rows, strict=True)
        return [number(0.0 if abs(v) <= row[3] else v) for v, row in pairs]

    clean = [np.where(np.isfinite(row[1]), row[1], np.nan) for row in rows]
    if not subject.many:
        columns.append(Column("value", cells([v[0] for v in clean])))
    else:
        low, top = ([int(f(v)) for v in clean] for f in (np.nanargmin, np.nanargmax))
        columns.append(Column("least", cells([v[k] for v, k in zip(clean, low, strict=True)])))
        vary = [
            float(np.ptp(v[np.isfinite(v)])) > row[3] for v, row in zip(clean, rows, strict=True)
        ]
        columns += _where_there(subject, low, vary)
        columns.append(Column("greatest", cells([v[k] for v, k in zip(clean, top, strict=True)])))
        columns += _where_there(subject, top, vary)
        columns.append(Column("mean", cells([_mean(subject, v) for v in clean])))
    columns.append(Column("unit", [row[2] for row in rows], text=True))
    return columns


def _mean(subject: Subject, values: Array) -> float:
    """Over the motion, of the instants at which there is a value.

    What the trapezoidal rule cannot tell from zero where a history has corners is zero.
    """
    t, there = subject.run.t, np.isfinite(values)
    mean = float(mean_over(values[there], t[there])) if there.any() else np.nan
    error = float(np.nanmax(np.abs(values), initial=0.0)) / len(t) ** 2
    return mean if abs(mean) > error else 0.0


# -- Chapters of balances: energy over the cycle, and the shaking force on the frame -----------


def energy(subject: Subject) -> list[Block]:
    """Of a motion the balance of energy; of a cycle the work, and its fluctuation."""
    run = subject.run
    if not subject.many or run.analysis == "statics":
        return []
    if run.energy is not None:
        own = run.energy
        rows = {
            "kinetic": own.kinetic,
            "potential": own.potential,
            "work of drivers and loads": own.work,
            "dissipated": own.dissipated,
        }
        moving = {name: values for name, values in rows.items() if np.ptp(values) > 0.0}
        curves = [_curve(subject, name, values) for name, values in moving.items()]
        if not curves:
            return []
        error = f"{own.error:.1e}" if own.error else "0"
        return [
            Picture("energy", untitled(plot_curves(run, [curves])), "Energy over time"),
            Text(
                f"Kinetic + potential + dissipated − work stays the same to {error} of the "
                f"greatest energy, {with_unit(own.size, 'torque', subject.units)}."
            ),
        ]
    curves = [_curve(subject, "kinetic", link_energy(run))]
    blocks: list[Block] = []
    for driver in subject.mechanism.drivers if subject.loaded else ():
        if not driver.angular or not np.ptp(run.driven(driver.name)[0]) > 0.0:
            continue
        try:
            found = fluctuation(run, driver.name)
        except ModelError:  # of part of a revolution, or of a cycle that does not close
            continue
        curves.append(_curve(subject, f"fed by {driver.name} less its mean", found.energy))
        rows_of = value_rows(found, UnitsOfText(subject.units))
        titles = ("quantity", "value", "unit")
        columns = [
            Column(title, [row[n] for row in rows_of], text=n != 1)
            for n, title in enumerate(titles)
        ]
        blocks.append(Grid(f"Turning moment of {driver.name}", columns))
    if not any(np.ptp(curve.values) > 0.0 for curve in curves):
        return blocks
    return [
        Picture("energy", untitled(plot_curves(run, [curves])), "Energy over the cycle"),
        *blocks,
    ]


def _curve(
    subject: Subject, name: str, values: Array, kind: str = "torque", of: str = "energy"
) -> PlottedCurve:
    """A history in units of the model as a curve."""
    shown = subject.units.converted(values, kind)
    return PlottedCurve(name, shown, DIMENSIONS[kind], subject.unit(kind), of=of)


def shaking(subject: Subject) -> list[Block]:
    """Chapter on the shaking force and moment, computed in two ways."""
    run = subject.run
    if not run.has_forces or not subject.mechanism.joints:
        return []
    found = shaking_force(run)
    size = found.magnitude
    greatest = float(np.nanmax(size))
    moment = float(np.nanmax(np.abs(found.moment)))
    if greatest <= subject.floor and moment <= subject.floor * run.system.length:
        return []
    has_moment = moment > subject.floor * run.system.length
    at = [peak(size), *([peak(found.moment)] * has_moment)]
    rows = [(greatest, "force"), *((float(found.moment[k]), "torque") for k in at[1:])]
    differ = np.hypot(found.fx - found.fx_inertia, found.fy - found.fy_inertia)
    columns = [
        Column(
            "quantity",
            ["shaking force", *(["shaking moment about the origin"] * has_moment)],
            text=True,
        ),
        Column("peak", [number(subject.shown(*row)) for row in rows]),
        Column("unit", [subject.unit(kind) for _, kind in rows], text=True),
        *where_columns(subject, at),
    ]
    part = float(np.nanmax(differ)) / (greatest or 1.0)
    blocks: list[Block] = [
        Text(
            "The resultant of all joints, drivers and loads on the frame. Weights and forces from "
            "outside are part of it."
        ),
        Grid("On the frame", columns),
        Text(
            "By the reactions, and by the inertia forces of all links: both ways agree to "
            f"{numbers([part])[0] if part >= 1e-3 else f'{part:.1e}'} of the peak."
        ),
    ]
    if subject.many:
        parts = {"along x": found.fx, "along y": found.fy, "magnitude": size}
        of = "force on the frame"
        panels = [[_curve(subject, name, own, "force", of) for name, own in parts.items()]]
        panels += [[_curve(subject, "moment", found.moment, of="")]] * has_moment
        caption = "Shaking force and shaking moment" if has_moment else "Shaking force"
        blocks.append(Picture("shaking", untitled(plot_curves(run, panels)), caption))
    return blocks


# -- The chapter of friction: what joints lose, where they stick, and where the mechanism jams --


def friction(subject: Subject) -> list[Block]:
    """Modes, losses by joint and contact, their curves, and the bands of efforts at rest."""
    run = subject.run
    blocks: list[Block] = _modes(subject)
    if not run.has_forces or not run.losses:
        return blocks
    if run.analysis != "statics":
        blocks += _losses(subject)
    report = run.friction
    if report is not None and run.analysis != "simulate":
        certified = int(np.sum(report.certified))
        blocks.append(
            Text(
                f"Friction is certain to have one solution at {certified} of "
                f"{report.certified.size} instants."
            )
        )
        if report.jams:
            worst = min(report.jams, key=lambda one: one.coefficient)
            blocks.append(
                Text(
                    f"The mechanism jams at {len(report.jams)} instants, from a coefficient of "
                    f"{number(worst.coefficient)} in {worst.joint} on."
                )
            )
        blocks += _bands(subject)
    return blocks


def _modes(subject: Subject) -> list[Block]:
    """How long each contact and frictional joint is in each mode of a motion, how often it
    changes.
    """
    run = subject.run
    if run.analysis != "simulate" or not run.modes or not subject.many:
        return []
    rows, left_out = mode_rows(run)
    whole = max(float(run.t[-1] - run.t[0]), TINY)
    there = [mode for mode in MODES if any(s.mode == mode for row in rows for s in row.spans)]
    columns = [Column("contact or joint", [row.name for row in rows], text=True)]
    for mode in there:
        parts = [sum(s.high - s.low for s in row.spans if s.mode == mode) / whole for row in rows]
        columns.append(Column(MODES[mode][0], [f"{100 * part:.1f}" for part in parts], "%"))
    columns.append(Column("changes", [str(len(row.spans) - 1) for row in rows]))
    if any(row.impacts for row in rows):
        columns.append(Column("impacts", [str(len(row.impacts)) for row in rows]))
    if run.energy is not None:
        lost = [float(run.energy.lost[row.name][-1]) for row in rows]
        columns.append(subject.column("energy lost", lost, "torque"))
    found: list[Block] = [Grid("Modes, in parts of the motion", columns)]
    if left_out:
        found.append(Text(f"{left_out} more change less often and are left out."))
    return found


def _losses(subject: Subject) -> list[Block]:
    run = subject.run
    names = list(run.losses)
    losses = np.array([np.nan_to_num(run.losses[name]) for name in names])
    columns = [Column(_kind(subject, names), names, text=True)]
    if not subject.many:
        columns.append(subject.column("loss", losses[:, 0], "power"))
        return [Grid(_title(subject, names), columns)]
    if run.energy is not None:
        # what sticks slides by rounding only
        least = PRINTED_NONE * float(run.energy.kinetic.max()) / max(float(np.ptp(run.t)), TINY)
        losses = np.where(losses.max(axis=1, keepdims=True) > least, losses, 0.0)
        if not losses.any():
            return []
    columns.append(subject.column("greatest", losses.max(axis=1), "power"))
    if run.energy is None:
        work = np.trapezoid(losses, run.t, axis=1)
        columns.append(subject.column("work lost", work, "torque"))
    curves = [
        _curve(subject, name, loss, "power", "power lost")
        for name, loss in zip(names, losses, strict=True)
        if np.ptp(loss) > 0.0
    ]
    found: list[Block] = [Grid(_title(subject, names), columns)]
    if curves:
        found.append(Picture("friction", untitled(plot_curves(run, [curves])), "Power lost"))
    return found


def _kind(subject: Subject, names: list[str]) -> str:
    """Word for the elements of a table of losses: joint, contact, or both."""
    contacts = {one.name for one in subject.mechanism.contacts}
    kinds = [
        word for word, there in (("joint", set(names) - contacts), ("contact", contacts)) if there
    ]
    return " or ".join(kinds)


def _title(subject: Subject, names: list[str]) -> str:
    return f"Power lost by sliding, by {_kind(subject, names)}"


def _bands(subject: Subject) -> list[Block]:
    """Drivers whose effort is open where joints stick."""
    run = subject.run
    rows = []
    for driver in subject.mechanism.drivers if run.resting else ():
        limits = run.range(driver.name)
        for k in np.flatnonzero(limits.low != limits.high):
            kind = driver.effort_dimension
            ends = [_end(subject.shown(one[k], kind)) for one in (limits.low, limits.high)]
            at = number(subject.shown(run.t[k], "time"))
            rows.append((driver.name, at, *ends, subject.unit(kind)))
    if not rows:
        return []
    names, times, lows, highs, units = zip(*rows, strict=True)
    columns = [
        Column("driver", list(names), text=True),
        Column("at t", list(times), subject.unit("time")),
        Column("from", list(lows)),
        Column("to", list(highs)),
        Column("unit", list(units), text=True),
    ]
    return [Grid("Efforts where joints rest", columns)]


def _end(value: float) -> str:
    if np.isfinite(value):
        return number(value)
    return "−∞" if value < 0.0 else "∞"


# -- The chapter that compares two designs: the same quantities of both, and their curves
#    together ----------------------------------------------------------------------------------


def comparison(subject: Subject) -> list[Block]:
    """Peaks of both designs with the change, and curves of efforts and forces."""
    other = subject.other
    if other is None:
        return []
    here, there = amounts(subject), amounts(other)
    names = [name for name in here if name in there and here[name][1] == there[name][1]]
    pairs = [(here[name][0], there[name][0]) for name in names]
    columns = [
        Column("quantity", names, text=True),
        Column(subject.label or "this design", [number(a) for a, _ in pairs]),
        Column(other.label or "other design", [number(b) for _, b in pairs]),
        Column("change", [_change(a, b) for a, b in pairs], "%"),
        Column("unit", [here[name][1] for name in names], text=True),
    ]
    blocks: list[Block] = [
        Text(f"This design beside another one, {other.label or other.mechanism.name}."),
        Grid("Two designs", columns),
    ]
    efforts = [f"{driver.name}.effort" for driver in subject.mechanism.drivers[:2]]
    known = {joint.name for joint in other.mechanism.joints}
    drawn = [name for name in efforts if name.partition(".")[0] in _drivers(other)]
    drawn += [f"{name}.force" for name in greatest(subject)[:2] if name in known]
    if subject.many and other.many and drawn and subject.loaded:
        labels = [subject.label or "this design", other.label or "other design"]
        figure = untitled(plot([subject.run, other.run], *drawn, labels=labels))
        blocks.append(Picture("comparison", figure, f"Both designs: {', '.join(drawn)}"))
    return blocks


def _drivers(subject: Subject) -> set[str]:
    return {driver.name for driver in subject.mechanism.drivers}


def _change(here: float, there: float) -> str:
    """From this design to the other, in percent."""
    if not here:
        return ""
    part = round(100.0 * (there - here) / abs(here), 1)
    return f"{part:+.1f}" if part else "0.0"


def amounts(subject: Subject) -> dict[str, tuple[float, str]]:
    """Compared quantities with their units: peaks of forces and efforts, extremes of measures."""
    found = {}
    if subject.loaded:
        for joint, own in subject.table.by_owner("joint", "force").items():
            if (size := float(np.nanmax(own["force"].values))) > rounding(
                subject.run, own["force"]
            ):
                found[f"peak force at {joint}"] = (size, own["force"].unit)
        for driver, own in subject.table.by_owner("driver", "effort", "power").items():
            for key, one in own.items():
                top = float(np.nanmax(np.abs(one.values)))
                if key == "effort" or top:
                    word = one.quantity if key == "effort" else key
                    found[f"peak {word} of {driver}"] = (top, one.unit)
    for one in subject.table:
        if one.role != "measure":
            continue
        top = float(np.nanmax(np.abs(one.values)))
        for word, extreme in (("least", np.nanmin), ("greatest", np.nanmax)):
            value = float(extreme(one.values))
            value = 0.0 if abs(value) <= PRINTED_NONE * top else value
            found[f"{one.name}, {word}"] = (value, one.unit)
    return found


# -- Chapters of evidence: checks, cross-checks, references, and what repeats the report ----

#: Quantities of an engine that are listed, those of the greatest difference first.
WORST = 3

ABOUT = {
    "balance": "sums forces and power over the whole mechanism",
    "oracle": "solves the textbook's dense equations of every link, without code of ours in common",
    "pinocchio": "Pinocchio, rigid-body dynamics of robots",
    "pymunk": "Pymunk, a physics engine of games, of low order",
    "mujoco": "MuJoCo, with soft constraints",
}

BOOKS = (
    "P. E. Nikravesh, Computer-Aided Analysis of Mechanical Systems, Prentice Hall 1988: "
    "coordinates, constraints, Lagrange multipliers.",
    "E. J. Haug, Computer-Aided Kinematics and Dynamics of Mechanical Systems, Allyn and Bacon "
    "1989: redundant constraints and singular positions.",
    "R. L. Norton, Design of Machinery, McGraw-Hill: notation F_{ij}, inverse dynamics, shaking "
    "forces.",
)
OF_MOTION = (
    "E. Hairer, S. P. Nørsett and G. Wanner, Solving Ordinary Differential Equations I and II, "
    "Springer: the integrators."
)


def checks(subject: Subject) -> list[Block]:
    """Residuals by routes that the analysis did not take; status, doubts and notes."""
    run = subject.run
    found = run.checks
    rows = [("closure of the joints, as a part of the model's length", found.constraint)]
    if run.has_forces:
        rows.append(("equilibrium of every link, of the greatest force", found.equilibrium))
        rows.append(("virtual work, of the greatest power", found.virtual_work))
    if found.energy is not None:
        rows.append(("balance of energy, of the greatest energy", found.energy))
    columns = [
        Column("residual", [row[0] for row in rows], text=True),
        Column("greatest of all instants", [f"{v:.1e}" if v else "0" for _, v in rows]),
    ]
    blocks: list[Block] = [Text(f"Status: **{run.status}**."), Grid("Residuals", columns)]
    if found.branch is not None:
        blocks.append(
            Text(
                "The least distance from a position at which branches meet was "
                f"{found.branch.least:.2g} (0 where they meet), at t = "
                f"{with_unit(found.branch.t, 'time', subject.units)}."
            )
        )
    sentences = {doubt.message for doubt in run.doubts}
    blocks += [Notice("doubt", doubt.message) for doubt in run.doubts]
    blocks += [Notice("note", note) for note in run.notes if note not in sentences]
    return blocks


def crosschecks(subject: Subject) -> list[Block]:
    """Chapter on the results of other engines, each with a verdict in words."""
    try:
        found = subject.crosscheck
    except (ModelError, SolveError) as error:
        return [Notice("note", f"There is no cross-check: {error}")]
    blocks: list[Block] = [
        Text(
            f"The same mechanism was given to other engines, at {_instants(subject)}. A difference "
            "is expected where an engine is of low order or models a joint as soft; each quantity "
            "has its own limit."
        )
    ]
    names, versions, verdicts, worst = [], [], [], []
    for name, result in found.opinions.items():
        names.append(name)
        versions.append(ABOUT.get(name, result.engine))
        verdicts.append(_verdict(result))
        row = max(result.rows, key=lambda one: one.difference, default=None)
        worst.append(f"{row.difference:.1e} ({row.quantity})" if row is not None else "")
    columns = [
        Column("engine", names, text=True),
        Column("what it is", versions, text=True),
        Column("verdict", verdicts, text=True),
        Column("greatest difference", worst, text=True),
    ]
    blocks.append(Grid("Cross-checks", columns))
    differ = [name for name, result in found.opinions.items() if not result.agrees]
    spoken = [name for name, result in found.opinions.items() if result.rows]
    if differ:
        blocks.append(Notice("doubt", f"{', '.join(differ)} differ from mbody: see their rows."))
    elif spoken:
        every = f"All {len(spoken)} engines agree" if len(spoken) > 1 else f"{spoken[0]} agrees"
        blocks.append(Notice("good", f"{every} with mbody in every quantity that they can model."))
    if found.agrees is None:
        left = ", ".join(found.not_compared)
        blocks.append(Notice("note", f"No engine with formulas of its own compared {left}."))
    blocks.append(_rows(found.opinions, subject.mechanism))
    absent = [
        f"{name}: {one.element}: {one.why}"
        for name, result in found.opinions.items()
        for one in result.not_expressible
    ]
    if absent:
        blocks += [Text("Not checked:"), Items(absent[:20])]
    how = [
        note if note.startswith(name) else f"{name}: {note}"
        for name, result in found.opinions.items()
        for note in result.notes
    ]
    if how:
        blocks += [Text("How they were compared, and at which instants:"), Items(how)]
    return blocks


def _instants(subject: Subject) -> str:
    """At how many of its instants."""
    count, whole = len(subject.compared), len(subject.run)
    if count == whole:
        return "one instant" if whole == 1 else f"all {whole} instants"
    return f"{count} of the {whole} instants"


def _verdict(result: CrosscheckResult) -> str:
    if not result.rows:
        return "cannot model it"
    differ = sum(row.verdict != "agrees" for row in result.rows)
    if differ:
        return f"differs in {differ} of {len(result.rows)} quantities"
    return f"agrees in all {len(result.rows)} quantities"


def _rows(found: object, machine: Mechanism) -> Grid:
    """The quantities that differ most, of every engine."""
    rows = []
    for name, result in found.items():  # type: ignore[attr-defined]  # a mapping
        ordered = sorted(
            result.rows,
            key=lambda row: row.difference / row.expected if row.expected else float("inf"),
            reverse=True,
        )
        rows += [(name, row) for row in ordered[:WORST]]
    shown = [shown_values(machine, row.quantity, row.ours, row.theirs) for _, row in rows]
    columns = [
        Column("engine", [name for name, _ in rows], text=True),
        Column("quantity", [row.quantity for _, row in rows], text=True),
        Column("mbody", [number(ours) for (ours, _), _ in shown]),
        Column("theirs", [number(theirs) for (_, theirs), _ in shown]),
        Column("unit", [unit for _, unit in shown], text=True),
        Column("difference", [f"{row.difference:.1e}" for _, row in rows]),
        Column("expected", [f"{row.expected:.1e}" for _, row in rows]),
        Column("verdict", [row.verdict for _, row in rows], text=True),
    ]
    return Grid("The nearest to their limits", columns)


def references(subject: Subject) -> list[Block]:
    """Origin of the model, and the books of the method."""
    books = [*BOOKS, OF_MOTION] if subject.run.analysis == "simulate" else list(BOOKS)
    source = subject.mechanism.source
    return [Items([f"Model: {source}.", *books] if source else books)]


def repeat(subject: Subject) -> list[Block]:
    """Version, digest and command, and the whole model."""
    rows = [
        ("mbody", __version__),
        ("Python", platform.python_version()),
        ("instants", str(len(subject.run))),
        ("model, SHA-256", subject.digest if subject.text else ""),
    ]
    if subject.command:
        rows.append(("command", f"`{subject.command}`"))
    rows = [row for row in rows if row[1]]
    columns = [
        Column("", [name for name, _ in rows], text=True),
        Column("value", [value for _, value in rows], text=True),
    ]
    blocks: list[Block] = [Grid("What made this report", columns)]
    if subject.text:
        blocks.append(
            Text("The model, whose text below has this digest: save it as a file to repeat all.")
        )
        blocks.append(FileText("model.toml", subject.text, "toml"))
    else:
        blocks.append(Notice("note", f"The model is no file: {subject.failed.get('text', '')}"))
    return blocks


#: Every section by the name by which it is chosen: its title, and what makes it.
SECTIONS: dict[str, tuple[str, Callable[[Subject], list[Block]]]] = {
    "summary": ("Summary", summary),
    "comparison": ("Two designs", comparison),
    "sketch": ("Mechanism", sketch),
    "inputs": ("Inputs", inputs),
    "method": ("Assumptions and method", method),
    "mobility": ("Mobility and uniqueness", mobility),
    "links": ("Links", links),
    "joints": ("Joints", joints),
    "loads": ("Efforts and measures", loads),
    "plots": ("Over the cycle", plots),
    "polar": ("Forces as vectors", polar),
    "freebody": ("Free-body diagrams", freebody),
    "energy": ("Energy", energy),
    "friction": ("Friction", friction),
    "shaking": ("Shaking force", shaking),
    "checks": ("Checks", checks),
    "opinions": ("Cross-check", crosschecks),
    "references": ("References", references),
    "repeat": ("To repeat this report", repeat),
}


def check_sections(names: Sequence[str]) -> tuple[str, ...]:
    """The sections of a report, each once, in the given order.

    >>> check_sections(["sketch", "joints", "sketch"])
    ('sketch', 'joints')
    """
    for name in names:
        if name not in SECTIONS:
            close = meant(name, SECTIONS)
            hint = f"did you mean '{close}'? " if close else ""
            raise ModelError(
                f"a report has no section {brief(name)}: {hint}there are {', '.join(SECTIONS)}"
            )
    return tuple(dict.fromkeys(names))


def document(subject: Subject, names: Sequence[str], title: str, author: str) -> ReportDocument:
    """The document of a subject, chapters without content left out."""
    run, chapters = subject.run, []
    for name in names:
        heading, make = SECTIONS[name]
        if name == "plots":
            heading = f"Over the {subject.course}"
        blocks = make(subject)
        if blocks:
            chapters.append(Chapter(name, heading, blocks))
    lines = [("analysis", f"{run.analysis}, {len(run)} instant{'s' * subject.many}")]
    lines += [("by", author)] if author else []
    lines.append(("program", f"mbody {__version__}"))
    if subject.text:
        lines.append(("model, SHA-256", f"`{subject.digest[:16]}…`"))
    lines.append(("status", run.status))
    return ReportDocument(title or subject.mechanism.name, lines, chapters)
