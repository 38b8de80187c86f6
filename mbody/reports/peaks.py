"""Chapters of results in tables: what matters most, links, joints, drivers and measures."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from mbody.model.reductions import mean_over
from mbody.quantities.units import DIMENSIONS
from mbody.reports.blocks import ROWS, Block, Cells, Grid, Notice, Text, first_rows
from mbody.reports.subject import Subject, book
from mbody.sheets.names import ROUNDING, remark, swiftness
from mbody.sheets.text_table import angles, number, numbers, unit_text
from mbody.solution.measures import found_by, measured

__all__ = ["joints", "links", "loads", "summary"]

Array = np.ndarray


def where_columns(subject: Subject, instants: Sequence[int]) -> list[Cells]:
    """Columns that say where something is."""
    return [Cells(title, cells, unit) for title, cells, unit in subject.where(instants)]


def _where_there(subject: Subject, instants: Sequence[int], there: Sequence[bool]) -> list[Cells]:
    """The first of these columns; blank of what is zero, or the same, all the time."""
    return [
        Cells(
            title,
            [cell if is_there else "" for cell, is_there in zip(cells, there, strict=True)],
            unit,
        )
        for title, cells, unit in subject.where(instants)[:1]
    ]


def peak(values: Array) -> int:
    """The instant of the greatest amount, of what there is."""
    return int(np.argmax(np.nan_to_num(np.abs(values), nan=-1.0)))


# -- what matters most -------------------------------------------------------------------------


def summary(subject: Subject) -> list[Block]:
    """The greatest values with where they are, and whether the result is in doubt."""
    rows = [*_forces_of_all(subject), *_efforts(subject), *_motion(subject)]
    blocks: list[Block] = [_status(subject)]
    if rows:
        columns = [Cells("", [row[0] for row in rows], text=True)]
        columns += [Cells("value", [number(row[1]) for row in rows])]
        columns += [Cells("unit", [row[2] for row in rows], text=True)]
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
            best = (words, float(size[k]), subject.unit("force"), k)
    return [best] if best is not None and best[1] > subject.floor else []


def _efforts(subject: Subject) -> list[tuple[str, float, str, int]]:
    run, rows = subject.run, []
    for driver in subject.mechanism.drivers if subject.loaded else ():
        effort = run.effort(driver.name)
        kind = "torque" if driver.angular else "force"
        k = peak(effort)
        if abs(float(effort[k])) <= subject.floor_of(kind):
            continue
        rows.append((f"{kind} of {driver.name}", float(effort[k]), subject.unit(kind), k))
        power = run.measure(f"{driver.name}.power")
        if np.abs(power).max() > 0.0:
            k = peak(power)
            rows.append((f"power of {driver.name}", float(power[k]), subject.unit("power"), k))
    return rows


def _motion(subject: Subject) -> list[tuple[str, float, str, int]]:
    run = subject.run
    if run.analysis == "statics":
        return []
    rows, swift = [], swiftness(run)
    for what, keys, unit, floor in (
        ("speed of a mass centre", ("vx", "vy"), "velocity", np.sqrt(swift)),
        ("acceleration of a mass centre", ("ax", "ay"), "acceleration", swift),
    ):
        sizes = {
            body: np.hypot(*(getattr(run[body], key) for key in keys))
            for body in (one.name for one in subject.mechanism.bodies)
        }
        name = max(sizes, key=lambda body: float(np.nanmax(sizes[body])))
        k = peak(sizes[name])
        if float(sizes[name][k]) > ROUNDING * floor * run.system.length:
            words = f"greatest {what}, {name}"
            rows.append((words, float(sizes[name][k]), subject.unit(unit), k))
    return rows


# -- tables ------------------------------------------------------------------------------------


def links(subject: Subject) -> list[Block]:
    """The motion of every link: its range, and its peaks."""
    run, names = subject.run, [body.name for body in subject.mechanism.bodies]
    numbered = [f"{n} {name}" for n, name in enumerate(names, 2)]
    histories, swift = [run[name] for name in names], swiftness(subject.run)
    low = [f"{round(float(np.degrees(h.angle.min())), 3) + 0.0:.3f}" for h in histories]
    high = [f"{round(float(np.degrees(h.angle.max())), 3) + 0.0:.3f}" for h in histories]
    named = Cells("link", numbered, text=True)
    columns = [named]
    if subject.many:
        columns += [Cells("angle from", low, "deg"), Cells("to", high, "deg")]
    else:
        columns.append(Cells("angle", low, "deg"))
    if run.analysis == "statics":
        return first_rows(Grid("Links", columns))
    centres = [named] if subject.many else columns  # one table of all would be too wide
    word = "peak " if subject.many else ""
    for title, values, unit, floor in (
        ("ω", [h.omega for h in histories], "angular velocity", np.sqrt(swift)),
        ("α", [h.alpha for h in histories], "angular acceleration", swift),
        ("v_{G}", [np.hypot(h.vx, h.vy) for h in histories], "velocity", np.sqrt(swift)),
        ("a_{G}", [np.hypot(h.ax, h.ay) for h in histories], "acceleration", swift),
    ):
        reach = 1.0 if unit.startswith("angular") else run.system.length
        tops = [float(v[peak(v)]) for v in values]
        cells = numbers(tops, ROUNDING * floor * reach)
        own = columns if unit.startswith("angular") else centres
        own.append(Cells(f"{word}{title}", cells, subject.unit(unit)))
        if subject.many:
            there = [abs(top) > ROUNDING * floor * reach for top in tops]
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
        kept = set(np.argsort(-np.round(tops / max(tops.max(), 1e-300), 9), kind="stable")[:ROWS])
        found = [one for n, one in enumerate(found) if n in kept]
        note = f"The {ROWS} joints with the greatest forces, of {count}; the results have all."
    at = [peak(r.magnitude) for *_, r in found]
    fx, fy = (
        np.array([getattr(r, key)[k] for k, (*_, r) in zip(at, found)]) for key in ("fx", "fy")
    )
    torque = np.array([r.torque[peak(r.torque)] for *_, r in found])
    turning = subject.floor * run.system.length
    columns = [
        Cells("force", [book(name) for name, *_ in found], text=True),
        Cells("joint", [joint for _, joint, _ in found], text=True),
        Cells("i on j", [f"{r.by} on {r.on}" for *_, r in found], text=True),
        Cells(
            "peak" if subject.many else "force",
            numbers(np.hypot(fx, fy), subject.floor),
            subject.unit("force"),
        ),
        Cells("direction", angles(np.arctan2(fy, fx)), "deg"),
        *_where_there(subject, at, (np.hypot(fx, fy) > subject.floor).tolist()),
        Cells("F_{x} there", numbers(fx, subject.floor), subject.unit("force")),
        Cells("F_{y} there", numbers(fy, subject.floor), subject.unit("force")),
    ]
    if (np.abs(torque) > turning).any():
        columns.append(Cells("peak torque", numbers(torque, turning), subject.unit("torque")))
    columns.append(Cells("uniqueness", [remark(r) for *_, r in found], text=True))
    blocks: list[Block] = [Grid("Forces of the joints", columns)]
    blocks += [Text(note)] if note else []
    if (np.abs(torque) > turning).any():
        blocks.append(Text("Torques are about the joint's place on its body j."))
    return blocks


def loads(subject: Subject) -> list[Block]:
    """Efforts of the drivers and the measures of the model: least, greatest, mean, and where."""
    rows: list[tuple[str, Array, str, float]] = []
    run = subject.run
    if subject.loaded:
        for driver in (*subject.mechanism.drivers, *subject.mechanism.couplings):
            kind = "torque" if driver.angular else "force"
            floor = subject.floor * (run.system.length if driver.angular else 1.0)
            book_name = subject.names.get(driver.name, ("", ""))[0]
            named = f"{driver.name}, {book(book_name)}" if book_name else driver.name
            rows.append((named, run.effort(driver.name), subject.unit(kind), floor))
    for name, measure in subject.mechanism.measures.items():
        if found_by(run, measure):
            values, dimension, unit = measured(run, measure)
            if dimension == DIMENSIONS["angle"] and not measure.unit:
                values, unit = np.degrees(values), "deg"
            floor = ROUNDING * float(np.nanmax(np.abs(values), initial=0.0))
            for kind in ("force", "torque") if run.has_forces else ():
                own = dimension == DIMENSIONS[kind] and unit == subject.mechanism.units.of(kind)
                floor = max(floor, subject.floor_of(kind)) if own else floor
            rows.append((f"{name} (`{measure.of}`)", values, unit_text(unit), floor))
    if not rows:
        return []
    return [Grid("Efforts and measures", _extremes(subject, rows))]


def _extremes(subject: Subject, rows: Sequence[tuple[str, Array, str, float]]) -> list[Cells]:
    """Columns of least, greatest and mean values."""
    columns = [Cells("quantity", [row[0] for row in rows], text=True)]

    def cells(values: Sequence[Any]) -> list[str]:
        pairs = zip(values, rows, strict=True)
        return [number(0.0 if abs(v) <= row[3] else v) for v, row in pairs]

    clean = [np.where(np.isfinite(row[1]), row[1], np.nan) for row in rows]
    if not subject.many:
        columns.append(Cells("value", cells([v[0] for v in clean])))
    else:
        low, top = ([int(f(v)) for v in clean] for f in (np.nanargmin, np.nanargmax))
        columns.append(Cells("least", cells([v[k] for v, k in zip(clean, low, strict=True)])))
        vary = [
            float(np.ptp(v[np.isfinite(v)])) > row[3] for v, row in zip(clean, rows, strict=True)
        ]
        columns += _where_there(subject, low, vary)
        columns.append(Cells("greatest", cells([v[k] for v, k in zip(clean, top, strict=True)])))
        columns += _where_there(subject, top, vary)
        columns.append(Cells("mean", cells([_mean(subject, v) for v in clean])))
    columns.append(Cells("unit", [row[2] for row in rows], text=True))
    return columns


def _mean(subject: Subject, values: Array) -> float:
    """Over the motion, of the instants at which there is a value.

    What the trapezoidal rule cannot tell from zero where a history has corners is zero.
    """
    t, there = subject.run.t, np.isfinite(values)
    mean = float(mean_over(values[there], t[there])) if there.any() else np.nan
    error = float(np.nanmax(np.abs(values), initial=0.0)) / len(t) ** 2
    return mean if abs(mean) > error else 0.0
