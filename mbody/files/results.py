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
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from mbody.analysis.inverse.conditions import Answer, AnswerCase
from mbody.files.tables import driving_powers, friction_data, own_column
from mbody.files.writing import writing
from mbody.quantities.evaluate import degrees_of
from mbody.quantities.units import DIMENSIONS
from mbody.solution.contact_forces import acting_contacts
from mbody.solution.doubts import certificate, heading, unit_symbols
from mbody.solution.histories import EventRecord, one_design, reported_states
from mbody.solution.measures import found_by, measured

if TYPE_CHECKING:
    from mbody.solution.solution import Solution


BODY = ("x", "y", "angle", "vx", "vy", "omega", "ax", "ay", "alpha")
POINT = ("x", "y", "vx", "vy", "ax", "ay")


def data(solution: Solution, angle: str = "deg") -> dict[str, Any]:
    """A solution of one design as plain lists and texts.

    >>> import mbody
    >>> run = mbody.kinetostatics(mbody.makers.four_bar(1, 3, 2, 3.5, speed=10.0))
    >>> round(data(run)["bodies"]["crank"]["angle"][0], 9)
    60.0
    """
    one_design(solution, "data are of one design")
    machine = solution.mechanism
    units = machine.units
    in_unit = degrees_of if angle == "deg" else np.asarray
    # closing the loops finds velocities, but no accelerations
    found = 6 if solution.analysis == "close_loops" else 9
    keys, at_points = BODY[:found], POINT[: found - found // 3]
    giving = (*machine.couplings, *machine.drivers) if solution.has_forces else ()
    measures = {name: _measure(solution, m, in_unit) for name, m in machine.measures.items()}
    return {
        **heading(machine.name, solution.analysis, unit_symbols(units, angle), solution),
        "t": _list(solution.t),
        "bodies": {
            body.name: {
                key: _list(in_unit(history.angle) if key == "angle" else getattr(history, key))
                for history in [solution[body.name]]
                for key in keys
            }
            for body in machine.bodies
        },
        "points": {
            f"{body.name}.{point}": _fields(solution.point(f"{body.name}.{point}"), at_points)
            for body in machine.bodies
            for point in body.points
        },
        "reactions": _reactions(solution),
        "efforts": {each.name: _list(solution.effort(each.name)) for each in giving},
        "powers": {name: _list(one) for name, one in driving_powers(solution).items()},
        "unique_efforts": {each.name: solution.unique_effort(each.name) for each in giving},
        "loads": _loads(solution, in_unit),
        **_signals(solution, angle),
        **friction_data(solution),
        "measures": measures,
        "checks": {
            "constraint": _number(solution.checks.constraint),
            "equilibrium": _number(solution.checks.equilibrium) if solution.has_forces else None,
            "virtual_work": _number(solution.checks.virtual_work) if solution.has_forces else None,
            "energy": _number(solution.checks.energy),
            "branch": _branch(solution),
        },
        **_motion(solution),
    }


def _branch(solution: Solution) -> dict[str, float] | None:
    """How near the motion came to another branch, and when; None where none was followed."""
    found = solution.branch
    return None if found is None else {"least": float(found.least), "t": float(found.t)}


def _motion(solution: Solution) -> dict[str, Any]:
    """Counts of the steps, the account of energy and what occurred, of a motion over time."""
    plain: dict[str, Any] = {}
    if solution.stats is not None:
        plain["stats"] = dict(solution.stats)
    if solution.energy is not None:
        plain["energy"] = solution.energy.data()
    if solution.analysis == "simulate":
        plain["events"] = [_event(one) for one in solution.events]
    if solution.modes:
        plain["modes"] = {name: list(words) for name, words in solution.modes.items()}
        plain["contacts"] = {
            one.name: _list(solution.contact(one.name)) for one in solution.mechanism.contacts
        }
    return plain


def _event(one: EventRecord) -> dict[str, Any]:
    """An event as data; of a contact with its name, of an impact with its impulses."""
    plain = {"name": one.name, "t": float(one.t)}
    plain |= {"contact": one.contact} if one.contact else {}
    impulses = {name: list(parts) for name, parts in one.impulses.items()}
    return plain | ({"impulses": impulses} if impulses else {})


def _list(values: Any) -> list[Any]:
    """Numbers of a history; None where there is none, as of forces that have no limit."""
    array = np.asarray(values, dtype=float) + 0.0
    plain = array.astype(object)
    plain[~np.isfinite(array)] = None
    return list(plain.tolist())


def _number(value: float | None) -> float | None:
    """JSON has no NaN: None stands for a number that there is not, as at a division by zero."""
    return None if value is None or not math.isfinite(value) else float(value)


def _fields(history: Any, keys: tuple[str, ...]) -> dict[str, list[Any]]:
    return {key: _list(getattr(history, key)) for key in keys}


def _reactions(solution: Solution) -> dict[str, Any]:
    if not solution.has_forces:
        return {}
    found = {}
    machine = solution.mechanism
    for joint in (*machine.joints, *acting_contacts(solution)):
        reaction = solution.reaction(joint.name)
        sides = {"i": reaction.by, "j": reaction.on}
        unique = {"unique": list(reaction.unique or (None, None, None))}
        found[joint.name] = {**sides, **_fields(reaction, ("fx", "fy", "torque")), **unique}
    return found


def _loads(solution: Solution, in_unit: Callable[[Any], np.ndarray]) -> dict[str, Any]:
    """Forces of loads, and what springs and dampers go by; not of what acts on every body."""
    found = {}
    for load in solution.mechanism.loads:
        keys = tuple(load.quantities())
        if keys:
            history = solution.load(load.name)
            own = _fields(history, keys)
            if "angle" in own:
                own["angle"] = _list(in_unit(history.angle))
            found[load.name] = {"on": history.on, "by": history.by, **own}
    return found


def _signals(solution: Solution, angle: str) -> dict[str, Any]:
    """Histories of inputs and of auxiliary states, with their units, where there are some."""
    machine = solution.mechanism
    own = {"inputs": machine.inputs, "states": reported_states(machine)}
    return {
        key: {
            one.name: {"unit": unit, "values": _list(values)}
            for one in elements
            for values, unit in [own_column(solution, one, angle)]
        }
        for key, elements in own.items()
        if elements
    }


def _measure(
    solution: Solution, measure: Any, in_unit: Callable[[Any], np.ndarray]
) -> list[float | None] | None:
    """History of a measure; None where it needs forces, which the analysis does not find."""
    if not found_by(solution, measure):
        return None
    values, dimension, _ = measured(solution, measure)
    plain_angle = dimension == DIMENSIONS["angle"] and not measure.unit
    return _list(in_unit(values) if plain_angle else values)


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


def answer_data(answer: Answer, angle: str = "deg") -> dict[str, Any]:
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


def _data(found: AnswerCase, angle: str) -> dict[str, Any]:
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
