"""Results as data: one form for every analysis, the same in Python, JSON and on the command line.

``{"mbody", "model", "analysis", "units", "status", "doubts", "notes", "t", "bodies", "points",
"reactions", "efforts", "powers", "unique_efforts", "loads", "inputs", "states", "losses", "modes",
"ranges", "friction", "measures", "checks"}``, of which "inputs" and "states" are those of
mechanisms that have some, and "losses" to "friction" of mechanisms with friction in joints. Every
list has one entry an instant; a measure that is one number of all instants has it at each. x and y
of a body are its mass centre. Reactions act on body j by body i, in world axes, at the joint's
place on j. omega and alpha are in rad and the time unit always, angles in the unit that "units"
says.
"""

from __future__ import annotations

import json
import math
import os
from typing import TYPE_CHECKING, Any

import numpy as np

from mbody.analysis.inverse.conditions import Answer, AnswerCase
from mbody.files.tables import as_list, friction_data, writing
from mbody.quantities.output_units import OutputUnits
from mbody.solution.declared_result import ResultColumn, ResultTable, declared_data
from mbody.solution.doubts import certificate, heading
from mbody.solution.histories import EventRecord, one_design
from mbody.solution.result_table import result_table

if TYPE_CHECKING:
    from mbody.solution.solution import Solution


def data(solution: Solution, angle: str | None = None) -> dict[str, Any]:
    """A solution of one design as plain lists and texts.

    >>> import mbody
    >>> run = mbody.kinetostatics(mbody.makers.four_bar(1, 3, 2, 3.5, speed=10.0))
    >>> round(data(run)["bodies"]["crank"]["angle"][0], 9)
    60.0
    """
    return data_in(solution, solution.mechanism.data_units.with_angle(angle, "deg"))


def in_units_of_the_model(solution: Solution) -> dict[str, Any]:
    """As `data`, with no other unit than degrees: what a page draws."""
    return data_in(solution, OutputUnits(solution.mechanism.units).having({"angle": "deg"}))


def data_in(solution: Solution, units: OutputUnits) -> dict[str, Any]:
    """A solution of one design as plain lists and texts, in units."""
    one_design(solution, "data are of one design")
    machine, forces = solution.mechanism, solution.has_forces
    points = [f"{body.name}.{point}" for body in machine.bodies for point in body.points]
    table = result_table(solution, units, points)
    giving = table.by_owner("coupling", "effort") | table.by_owner("driver", "effort")
    powers, measures = table.by_owner("driver", "power"), table.by_owner("measure")
    return {
        **heading(machine.name, solution.analysis, units.symbols(), solution),
        "t": as_list(table["t"].values),
        "bodies": _histories(table.by_owner("body")),
        "points": _histories(table.by_owner("point")),
        "reactions": _reactions(solution, table),
        "efforts": {name: as_list(one["effort"].values) for name, one in giving.items()},
        "powers": {name: as_list(one["power"].values) for name, one in powers.items()},
        "unique_efforts": {name: one["effort"].unique for name, one in giving.items()},
        "loads": _loads(solution, table),
        **_signals(solution, table),
        **friction_data(solution, table, units),
        "measures": {
            name: as_list(measures[name][""].values) if name in measures else None
            for name in machine.measures
        },
        "checks": {
            "constraint": _number(solution.checks.constraint),
            "equilibrium": _number(solution.checks.equilibrium) if forces else None,
            "virtual_work": _number(solution.checks.virtual_work) if forces else None,
            "energy": _number(solution.checks.energy),
            "branch": _branch(solution, units),
        },
        **_motion(solution, units),
    }


def _histories(columns: dict[str, dict[str, ResultColumn]]) -> dict[str, Any]:
    """Of every owner its histories by key."""
    return {
        owner: {key: as_list(one.values) for key, one in own.items()}
        for owner, own in columns.items()
    }


def _branch(solution: Solution, units: OutputUnits) -> dict[str, float] | None:
    """How near the motion came to another branch, and when; None where none was followed."""
    found = solution.branch
    return None if found is None else {"least": float(found.least), "t": _time(found.t, units)}


def _motion(solution: Solution, units: OutputUnits) -> dict[str, Any]:
    """Counts of the steps, the account of energy and what occurred, of a motion over time."""
    plain: dict[str, Any] = {}
    if solution.stats is not None:
        plain["stats"] = dict(solution.stats)
    if solution.energy is not None:
        plain["energy"] = energy = declared_data(solution.energy, units, "torque")
        if not energy["lost"]:
            del energy["lost"]
    if solution.analysis == "simulate":
        plain["events"] = [_event(one, units) for one in solution.events]
    if solution.modes:
        plain["modes"] = {name: list(words) for name, words in solution.modes.items()}
        plain["contacts"] = {
            one.name: as_list(
                units.converted(solution.contact(one.name), one.quantities()["contact"])
            )
            for one in solution.mechanism.contacts
        }
    return plain


def _event(one: EventRecord, units: OutputUnits) -> dict[str, Any]:
    """An event as data; of a contact with its name, of an impact with its impulses, and of which
    contacts these are shared.
    """
    plain = {"name": one.name, "t": _time(one.t, units)}
    plain |= {"contact": one.contact} if one.contact else {}
    impulses = {name: list(parts) for name, parts in one.impulses.items()}
    plain |= {"impulses": impulses} if impulses else {}
    return plain | ({"shared": list(one.shared)} if one.shared else {})


def _time(t: float, units: OutputUnits) -> float:
    return float(units.converted(t, "time"))


def _number(value: float | None) -> float | None:
    """JSON has no NaN: None stands for a number that there is not, as at a division by zero."""
    return None if value is None or not math.isfinite(value) else float(value)


def _reactions(solution: Solution, table: ResultTable) -> dict[str, Any]:
    keys = ("fx", "fy", "torque")
    found = {}
    for role in ("joint", "contact"):
        for name, own in table.by_owner(role, *keys).items():
            reaction = solution.reaction(name)
            found[name] = {
                "i": reaction.by,
                "j": reaction.on,
                **{key: as_list(own[key].values) for key in keys},
                "unique": list(reaction.unique or (None, None, None)),
            }
    return found


def _loads(solution: Solution, table: ResultTable) -> dict[str, Any]:
    """Forces of loads, and what springs and dampers go by; not of what acts on every body."""
    found = {}
    for name, own in _histories(table.by_owner("load")).items():
        history = solution.load(name)
        found[name] = {"on": history.on, "by": history.by, **own}
    return found


def _signals(solution: Solution, table: ResultTable) -> dict[str, Any]:
    """Histories of inputs and of auxiliary states, with their units, where there are some."""
    return {
        key: {
            name: {"unit": one[""].unit, "values": as_list(one[""].values)}
            for name, one in own.items()
        }
        for key, role in (("inputs", "input"), ("states", "state"), ("quantities", "quantity"))
        if (own := table.by_owner(role))
    }


def error_data(error: Exception) -> dict[str, Any]:
    """An error as data: ``{"error": {"kind", "element", "message"}}``, and the problems of a file.

    >>> from mbody import ModelError
    >>> error_data(ModelError("no such thing", "crank"))["error"]["element"]
    'crank'
    """
    plain: dict[str, Any] = {
        "kind": type(error).__name__,
        "element": getattr(error, "element", None),
        "message": str(error),
    }
    problems = getattr(error, "problems", ())
    if problems:
        keys = ("line", "field", "message")
        plain["problems"] = [dict(zip(keys, problem, strict=True)) for problem in problems]
    return {"error": plain}


def write_json(solution: Solution, path: str | os.PathLike[str]) -> None:
    """Write a solution as JSON."""
    text = json.dumps(data(solution), ensure_ascii=False, allow_nan=False)
    with writing(path) as file:
        file.write(text + "\n")


def write_npz(solution: Solution, path: str | os.PathLike[str]) -> None:
    """Write the columns of a solution as arrays by name; "columns" holds the names with units,
    "certificate" status, doubts and notes as JSON.

    >>> import mbody, pathlib, tempfile
    >>> run = mbody.kinematics(mbody.makers.four_bar(1, 3, 2, 3.5, speed=10.0))
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = pathlib.Path(folder, "run.npz")
    ...     write_npz(run, path)
    ...     with np.load(path) as file:
    ...         round(float(file["crank.omega"][0]), 9)
    10.0
    """
    table = solution.columns()
    arrays: dict[str, Any] = {name.partition(" [")[0]: values for name, values in table.items()}
    said = json.dumps(certificate(solution), ensure_ascii=False)
    with writing(path, binary=True) as file:
        np.savez_compressed(
            file, columns=np.array(list(table)), certificate=np.array(said), **arrays
        )


# -- Answers of inverse problems as data -------------------------------------------------------

#: Histories of one instant that are given as numbers.
AT_THE_INSTANT = ("bodies", "reactions", "efforts", "measures")


def answer_data(answer: Answer, angle: str | None = None) -> dict[str, Any]:
    """An answer as plain dicts: ``{"solutions": [{"unknowns", "units", "conditions",
    "side_conditions", "binding", "residual", "bodies", "reactions", "efforts", "measures"}],
    "status", "doubts", "notes"}``.

    >>> import mbody
    >>> machine = mbody.makers.four_bar(1, 3, 2, 3.5, masses=(1, 3, 2), speed=10.0)
    >>> plain = answer_data(mbody.solve_for(machine, "motor.acceleration", "motor.effort = 0"))
    >>> list(plain["solutions"][0]["unknowns"])
    ['motor.acceleration']
    """
    plain: dict[str, Any] = {
        "solutions": [_data(found, angle) for found in answer.solutions],
        "status": answer.status,
        "doubts": [doubt.data() for doubt in answer.doubts],
        "notes": list(answer.notes),
    }
    if answer.question.note:
        plain["note"] = answer.question.note
    if answer.question.objective:
        key = "greatest" if answer.question.greatest else "least"
        plain[key] = answer.question.objective
    return plain


def _data(found: AnswerCase, angle: str | None) -> dict[str, Any]:
    """One solution; every history is of one instant, and a number."""
    whole = data(found.run, angle)
    plain: dict[str, Any] = {
        "unknowns": found.unknowns,
        "units": found.units,
        "conditions": found.conditions,
        "side_conditions": found.side_conditions,
        "binding": list(found.binding),
        "residual": found.residual,
    }
    if found.objective is not None:
        plain["objective"] = found.objective
    plain["t"] = whole["t"][0]
    return plain | {key: _last(whole[key]) for key in AT_THE_INSTANT}


def _last(value: Any) -> Any:
    """Lists of one instant as its numbers."""
    if isinstance(value, dict):
        return {key: _last(part) for key, part in value.items()}
    return value[-1] if isinstance(value, list) else value
