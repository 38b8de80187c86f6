"""Tables of a solution: columns by name, a pandas DataFrame, a file of comma-separated values."""

from __future__ import annotations

import csv
import json
import math
import os
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from mbody.errors import ModelError, brief
from mbody.files.writing import writing
from mbody.model.closed_mechanism import moving_points
from mbody.model.contact import joined
from mbody.quantities.evaluate import degrees_of
from mbody.quantities.units import DIMENSIONS
from mbody.solution.contact_forces import acting_contacts
from mbody.solution.doubts import certificate
from mbody.solution.histories import auxiliary_history, one_design, reported_states
from mbody.solution.measures import found_by, measured, prescribed_rate

if TYPE_CHECKING:
    from mbody.solution.solution import Solution


# -- Measured histories from a file of comma-separated values with headings --------------------

MOST = 1_000_000  # rows


def measured_data(path: str | os.PathLike[str]) -> dict[str, np.ndarray]:
    """Columns by heading, (rows,) each; NaN where a cell is empty."""
    what = f"the data file {brief(str(path))}"
    try:
        with Path(path).open(encoding="utf-8-sig", newline="") as stream:
            rows = [row for row in csv.reader(stream) if any(map(str.strip, row))]
    except OSError as error:
        raise ModelError(f"{what} cannot be read: {error.strerror}") from None
    except (UnicodeDecodeError, csv.Error):
        raise ModelError(f"{what} is no text of comma-separated values") from None
    if len(rows) < 2 or len(rows) > MOST:
        raise ModelError(f"{what} has {len(rows)} rows: give headings and 1 to {MOST} rows of data")
    names = [cell.strip() for cell in rows[0]]
    if any(not name or _number(name) is not None for name in names):
        raise ModelError(
            f'{what} has no headings: its first row names what the columns are, such as "t" and '
            '"slider.x [mm]"'
        )
    twice = next((name for name in names if names.count(name) > 1), "")
    if twice:
        raise ModelError(f"{what} has two columns '{twice}': give each once")
    table = np.full((len(rows) - 1, len(names)), math.nan)
    for n, row in enumerate(rows[1:]):
        if len(row) > len(names):
            raise ModelError(f"{what}: row {n + 2} has {len(row)} cells, headings are {len(names)}")
        for k, cell in enumerate(row):
            value = _number(cell) if cell.strip() else math.nan
            if value is None:
                raise ModelError(
                    f"{what}: row {n + 2}, column '{names[k]}' is no number: {brief(cell)}"
                )
            table[n, k] = value
    return {name: table[:, k] for k, name in enumerate(names)}


def _number(text: str) -> float | None:
    try:
        return float(text)
    except ValueError:
        return None


# -- Friction results as plain lists: losses, modes, ranges, uniqueness, jams ------------------


def friction_data(solution: Solution) -> dict[str, Any]:
    """``{"losses", "modes", "ranges", "friction"}`` of mechanisms with frictional joints, else
    empty.

    A range of a reaction has (fx, fy, torque) of each instant; None stands for what is infinite.

    >>> import mbody
    >>> friction_data(mbody.kinetostatics(mbody.makers.four_bar(1, 3, 2, 3.5, speed=10.0)))
    {}
    """
    report = solution.friction
    if report is None:
        return {} if solution.shared is None else {"ranges": _ranges(solution)}
    certified = report.certified
    same = bool((certified == certified.flat[0]).all()) if certified.size else True
    found: dict[str, Any] = {
        "losses": {name: _list(power) for name, power in solution.losses.items()},
        "modes": {name: solution.mode(name) for name in solution.modes or solution.losses},
        "friction": {
            "certified": bool(certified.all()) if same else certified.tolist(),
            "jams": [jam._asdict() for jam in report.jams],
        },
    }
    if solution.analysis != "simulate" or solution.shared is not None:
        found["ranges"] = _ranges(solution)
    return found


def _ranges(solution: Solution) -> dict[str, Any]:
    """Of the efforts and reactions that joints at rest, or contacts, leave open."""
    efforts, reactions = {}, {}
    if solution.shared is None and not solution.resting:
        return {"efforts": {}, "reactions": {}}
    machine = solution.mechanism
    for one in (*machine.couplings, *machine.drivers):
        limits = solution.range(one.name)
        if not np.array_equal(limits.low, limits.high, equal_nan=True):
            efforts[one.name] = {"low": _list(limits.low), "high": _list(limits.high)}
    shared = solution.shared is not None
    for joint in (*machine.joints, *acting_contacts(solution)) if shared else joined(machine):
        limits = solution.range(joint.name)
        low, high = (
            np.stack([one.fx, one.fy, one.torque], axis=-1) for one in (limits.low, limits.high)
        )
        if not np.array_equal(low, high, equal_nan=True):
            reactions[joint.name] = {"low": _list(low), "high": _list(high)}
    return {"efforts": efforts, "reactions": reactions}


def _list(values: Any) -> list[Any]:
    """Numbers, None where there is none."""
    array = np.asarray(values, dtype=float) + 0.0
    plain = array.astype(object)
    plain[~np.isfinite(array)] = None
    return list(plain.tolist())


def friction_columns(solution: Solution) -> dict[str, np.ndarray]:
    """Losses by joint, and the limits of efforts that joints at rest leave open."""
    unit = solution.mechanism.units.of
    table = {f"{name}.loss [{unit('power')}]": loss for name, loss in solution.losses.items()}
    if solution.analysis == "simulate" or not solution.losses or not solution.resting:
        return table
    for one in (*solution.mechanism.couplings, *solution.mechanism.drivers):
        limits, effort = solution.range(one.name), unit(one.effort_dimension)
        if not np.array_equal(limits.low, limits.high, equal_nan=True):
            table[f"{one.name}.effort_low [{effort}]"] = limits.low
            table[f"{one.name}.effort_high [{effort}]"] = limits.high
    return table


MOTION = {
    "x": "length",
    "y": "length",
    "angle": "angle",
    "vx": "velocity",
    "vy": "velocity",
    "omega": "angular velocity",
    "ax": "acceleration",
    "ay": "acceleration",
    "alpha": "angular acceleration",
}


def columns(solution: Solution, angle: str = "rad") -> dict[str, np.ndarray]:
    """All histories of one motion by column name, each with its unit.

    Time first, then nine columns a body (mass centre and angle), three a joint (force and torque
    on its body j), one a coupling, an input, an auxiliary state and a measure, the effort, value,
    rate, acceleration and power of every driver, and six columns a point that moves (of a pin that
    on the first of its links); kinematics has no forces. Frictional joints have a column of their
    loss, drivers those of the limits of their effort where joints rest. Where forces are not
    determined, each joint, coupling and driver has a column ``"A.unique"``, 1 or 0.

    >>> import mbody
    >>> table = columns(mbody.kinetostatics(mbody.makers.four_bar(1, 3, 2, 3.5, speed=10.0)))
    >>> list(table)[:4]
    ['t [s]', 'crank.x [m]', 'crank.y [m]', 'crank.angle [rad]']
    """
    one_design(solution, "a table is of one design")
    mechanism = solution.mechanism
    unit = mechanism.units.of
    table = {f"t [{unit('time')}]": solution.t}
    for body in mechanism.bodies:
        history = solution[body.name]
        for key, dimension in MOTION.items():
            if "acceleration" in dimension and solution.analysis == "close_loops":
                continue  # it finds velocities, no accelerations
            values = getattr(history, key)
            if dimension == "angle" and angle == "deg":
                table[f"{body.name}.{key} [deg]"] = degrees_of(values)
            else:
                table[f"{body.name}.{key} [{unit(dimension)}]"] = values
    if not solution.has_forces:
        others = _signals(solution, angle) | _measures(solution, angle)
        return table | others | _driven(solution, angle) | _points(solution)
    unique = uniqueness(solution)
    for joint in mechanism.joints:
        reaction = solution.reaction(joint.name)
        table[f"{joint.name}.fx [{unit('force')}]"] = reaction.fx
        table[f"{joint.name}.fy [{unit('force')}]"] = reaction.fy
        table[f"{joint.name}.torque [{unit('torque')}]"] = reaction.torque
        table |= unique.get(joint.name, {})
    for contact in mechanism.contacts if solution.modes else ():
        if contact.bodies:
            reaction = solution.reaction(contact.name)
            table[f"{contact.name}.fx [{unit('force')}]"] = reaction.fx
            table[f"{contact.name}.fy [{unit('force')}]"] = reaction.fy
            table[f"{contact.name}.torque [{unit('torque')}]"] = reaction.torque
        pressing = unit(contact.quantities()["contact"])
        table[f"{contact.name}.contact [{pressing}]"] = solution.contact(contact.name)
    for each in (*mechanism.couplings, *mechanism.drivers):
        effort = unit(each.effort_dimension)
        table[f"{each.name}.effort [{effort}]"] = solution.effort(each.name)
        table |= unique.get(each.name, {})
    table |= friction_columns(solution)
    table |= _signals(solution, angle) | _measures(solution, angle) | _driven(solution, angle)
    for name, power in driving_powers(solution).items():
        table[f"{name}.power [{unit('power')}]"] = power
    return table | _points(solution)


def _driven(solution: Solution, angle: str) -> dict[str, np.ndarray]:
    """Value, rate and acceleration of what every driver drives, at rest the value."""
    unit, table = solution.mechanism.units.of, {}
    for driver in solution.mechanism.drivers:
        for (key, dimension), values in zip(
            driver.motion.items(), solution.driven(driver.name), strict=True
        ):
            if dimension == "angle" and angle == "deg":
                table[f"{driver.name}.{key} [deg]"] = degrees_of(values)
            else:
                table[f"{driver.name}.{key} [{unit(dimension)}]"] = values
            if solution.analysis == "statics":
                break
    return table


#: Of a point, beside its place.
POINT = {key: MOTION[key] for key in ("x", "y", "vx", "vy", "ax", "ay")}


def _points(solution: Solution) -> dict[str, np.ndarray]:
    """Six columns a point that moves, of a pin one side; four where there are no accelerations."""
    unit, table = solution.mechanism.units.of, {}
    for name in moving_points(solution.mechanism):
        history = solution.point(name)
        for key, dimension in POINT.items():
            if dimension != "acceleration" or solution.analysis != "close_loops":
                table[f"{name}.{key} [{unit(dimension)}]"] = getattr(history, key)
    return table


def driving_powers(solution: Solution) -> dict[str, np.ndarray]:
    """The power of every driver; none at rest and without forces."""
    if not solution.has_forces or solution.analysis == "statics":
        return {}
    return {
        driver.name: solution.effort(driver.name) * prescribed_rate(solution, driver.name)
        for driver in solution.mechanism.drivers
    }


def own_column(solution: Solution, element: Any, angle: str = "rad") -> tuple[np.ndarray, str]:
    """The history of an input or an auxiliary state, and its unit, empty for a plain number."""
    values, dimension = auxiliary_history(solution, element.name), element.dimension
    if dimension == DIMENSIONS["angle"] and angle == "deg":
        return degrees_of(values), "deg"
    return values, "" if dimension is None else solution.mechanism.units.of(dimension)


def _signals(solution: Solution, angle: str) -> dict[str, np.ndarray]:
    """Inputs and auxiliary states."""
    found = {}
    for one in (*solution.mechanism.inputs, *reported_states(solution.mechanism)):
        values, unit = own_column(solution, one, angle)
        found[f"{one.name} [{unit}]" if unit else one.name] = values
    return found


def uniqueness(solution: Solution) -> dict[str, dict[str, np.ndarray]]:
    """By joint, driver and coupling the column that shows whether its force is determined, 1, or
    not, 0, NaN where it was not looked at; empty where all of them are.
    """
    machine = solution.mechanism
    determined: dict[str, Any] = {}
    for joint in machine.joints:
        parts = solution.reaction(joint.name).unique
        determined[joint.name] = None if parts is None else all(parts)
    for each in (*machine.couplings, *machine.drivers):
        determined[each.name] = solution.unique_effort(each.name)
    if all(determined.values()):
        return {}
    size = len(solution)
    return {
        name: {f"{name}.unique": np.full(size, np.nan if one is None else float(one))}
        for name, one in determined.items()
    }


def _measures(solution: Solution, angle: str) -> dict[str, np.ndarray]:
    """The measured quantities of the mechanism, in their own units where they have some."""
    found = {}
    for name, measure in solution.mechanism.measures.items():
        if not found_by(solution, measure):
            continue
        values, dimension, unit = measured(solution, measure)
        if dimension == DIMENSIONS["angle"] and not measure.unit and angle == "deg":
            values, unit = degrees_of(values), "deg"
        found[f"{name} [{unit}]" if unit else name] = values
    return found


def dataframe(solution: Solution) -> Any:
    """The columns as a pandas DataFrame, a row an instant.

    >>> import mbody
    >>> run = mbody.kinematics(mbody.makers.four_bar(1, 3, 2, 3.5, speed=10.0), turn=True)
    >>> dataframe(run).shape
    (361, 43)
    """
    table = columns(solution)
    try:
        import pandas  # type: ignore[import-untyped, unused-ignore]
    except ImportError:
        raise ModelError(
            "a DataFrame needs pandas, which is not installed: pip install pandas; "
            "columns() and to_csv() need nothing"
        ) from None
    frame = pandas.DataFrame(table)
    frame.attrs |= certificate(solution)
    return frame


def dataset(solution: Solution) -> Any:
    """The columns as a Dataset of xarray over the coordinate ``t``."""
    table = columns(solution)
    try:
        import xarray  # type: ignore[import-not-found, unused-ignore]
    except ImportError:
        raise ModelError(
            "a Dataset needs xarray, which is not installed: pip install xarray; "
            "columns() and to_npz() need nothing"
        ) from None
    parts = {}
    for column, values in table.items():
        name, _, unit = column.partition(" [")
        parts[name] = ("t", np.array(values), {"units": unit.removesuffix("]")} if unit else {})
    said = certificate(solution)
    attributes = {
        "model": solution.mechanism.name,
        "analysis": solution.analysis,
        "status": said["status"],
        "doubts": json.dumps(said["doubts"], ensure_ascii=False),
        "notes": list(said["notes"]),
    }
    return xarray.Dataset(parts, coords={"t": parts.pop("t")}, attrs=attributes)


def write_csv(
    solution: Solution, path: str | os.PathLike[str], angle: str = "rad", excel: bool = False
) -> None:
    """Write the columns as comma-separated values, UTF-8, one header line, a line an instant; for
    spreadsheets with the mark of UTF-8.

    Every number is written with as many digits as bring back the same number.

    >>> import mbody, pathlib, tempfile
    >>> run = mbody.kinematics(mbody.makers.four_bar(1, 3, 2, 3.5, speed=10.0))
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = pathlib.Path(folder, "run.csv")
    ...     write_csv(run, path)
    ...     path.read_text("utf-8")[:24]
    't [s],crank.x [m],crank.'
    """
    columns(solution)  # refuses what has no columns before a file is touched
    with writing(path, mark=excel) as file:
        print_csv(solution, file, angle)


def print_csv(solution: Solution, stream: Any, angle: str = "rad") -> None:
    """Writes a result as CSV to a stream of text."""
    table = columns(solution, angle)
    writer = csv.writer(stream, lineterminator="\n")
    writer.writerow(table)
    # floats as repr gives them: the shortest exact text
    writer.writerows(np.column_stack(list(table.values())).tolist())
