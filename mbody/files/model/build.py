"""A checked model becomes a mechanism, element by element; every refusal is kept with its place."""

from __future__ import annotations

import functools
import math
from typing import Any, cast

from mbody.analysis.driven.requests import check_instants, dimension_of_instants
from mbody.analysis.initial.initial_state import check_simulation
from mbody.analysis.inverse.conditions import check_question
from mbody.errors import ModelError
from mbody.files.model.fit_table import keep_fit
from mbody.files.model.kinds import SECTIONS
from mbody.files.model.optimize_table import keep_task
from mbody.files.model.problems import ENOUGH, Path, Problem
from mbody.files.model.report_table import keep_settings
from mbody.model.body import Body
from mbody.model.compiled_formulas import compiled_state, compiled_stop
from mbody.model.element import Element
from mbody.model.event import Event
from mbody.model.inputs import Input
from mbody.model.loads import Gravity
from mbody.model.mechanism import Mechanism
from mbody.model.numbers import meant
from mbody.model.simulation import SimulationSettings
from mbody.model.states import State
from mbody.model.stop import Stop
from mbody.model.study import Instants, Measure, Question, Unknown
from mbody.quantities.units import DIMENSIONS
from mbody.solution.measures import check_measure

__all__ = ["build"]


def build(given: Any) -> tuple[Mechanism | None, list[Problem]]:
    """The mechanism of a validated model, and what was refused on the way.

    Returns
    -------
    mechanism : Mechanism or None
        None where not even its frame could be made.
    problems : list of Problem
    """
    problems: list[Problem] = []
    try:
        mechanism = Mechanism(
            given.name,
            units=given.units,
            g=given.g,
            ground=given.ground.points if given.ground else None,
            ground_shapes=given.ground.shapes if given.ground else None,
            parameters=given.parameters,
            curves=given.curves,
            source=given.source,
            note=given.note,
        )
    except ModelError as error:
        return None, [_framed(given, error)]
    missing: set[str] = set()

    def add(path: Path, cls: type[Element], fields: dict[str, Any]) -> None:
        name = str(path[-1])
        if len(problems) >= ENOUGH:
            return
        try:
            element = cls(name=name, **fields)
            # what refers to an element that was refused is not to blame
            if missing.isdisjoint(_bodies(element)):
                mechanism.add(element)
                return
        except ModelError as error:
            problems.append(Problem(path, _unnamed(str(error), name)))
        missing.add(name)

    for name, value in given.inputs.items():
        add(("inputs", name), Input, {"value": value})
    for name, body in given.bodies.items():
        add(("bodies", name), Body, _set(body))
    for name, state in given.states.items():  # clutches, drivers and loads measure them
        add(("states", name), State, _set(state))
    for section, kinds in SECTIONS.items():
        for name, entry in getattr(given, section).items():
            own = _keys(cast(Any, type(entry)))
            kind = next(kind for kind in kinds if kind in own)
            add((section, name), kinds[kind], _arguments(kind, kinds[kind], entry))
    if given.gravity is not None:
        add(("gravity",), Gravity, _set(given.gravity))
    problems += _rates(mechanism) if not problems else []
    problems += _questions(given, mechanism)
    problems += _stops(mechanism) if not problems else []
    keep_settings(mechanism, given.report)
    return mechanism, problems


def _rates(mechanism: Mechanism) -> list[Problem]:
    """What is wrong with the rates of own states, which may measure anything in the file."""
    problems = []
    for state in mechanism.described_states:
        try:
            compiled_state(mechanism, state)
        except ModelError as error:
            path = ("states", state.name, "rate")
            problems.append(Problem(path, _unnamed(str(error), state.name).removeprefix("rate: ")))
    return problems


def _stops(mechanism: Mechanism) -> list[Problem]:
    """What is wrong with the formulas of stops, which may be measures."""
    problems = []
    for stop in (one for one in mechanism.contacts if isinstance(one, Stop)):
        try:
            compiled_stop(mechanism, stop)
        except ModelError as error:
            problems.append(
                Problem(("contacts", stop.name), str(error).removeprefix(f"stop '{stop.name}': "))
            )
    return problems


def _framed(given: Any, error: ModelError) -> Problem:
    """A problem of the mechanism itself, with the key that it comes from."""
    text = str(error)
    message = text.removeprefix(f"'{error.element}': ")
    if error.element in given.curves:
        return Problem(("curves", error.element), text.removeprefix(f"curve '{error.element}': "))
    if error.element in given.parameters:
        return Problem(("parameters", error.element), text)
    for key, mark in (("units", "unit system"), ("g", ": g"), ("ground", "'ground'")):
        if mark in text:
            return Problem((key,), message)
    return Problem((), text)


def _bodies(element: Element) -> set[str]:
    """The bodies that an element refers to."""
    own = {marker.body for marker in element.places().values()}
    return own.union(getattr(element, "bodies", ()))


def _set(entry: Any) -> dict[str, Any]:
    """The fields that a file gives; the others keep their defaults."""
    given = entry.model_fields_set
    return {
        name: value
        for name in _keys(cast(Any, type(entry)))
        if name in given and (value := getattr(entry, name)) is not None
    }


@functools.cache
def _keys(table: Any) -> tuple[str, ...]:
    """The keys that a table of a file may have."""
    return tuple(table.model_fields)


def _arguments(kind: str, cls: type[Element], entry: Any) -> dict[str, Any]:
    """Arguments of an element from its table."""
    fields = _set(entry)
    main = fields.pop(kind)
    return {**dict(zip(cls.main, main if len(cls.main) > 1 else (main,), strict=True)), **fields}


def _unnamed(text: str, name: str) -> str:
    """The sentence without the name that is before it already."""
    return text.removeprefix(f"'{name}': ").removeprefix(f"'{name}' ")


def _row(mechanism: Mechanism, name: str, value: Any, angle: str) -> Any:
    """Requested values; plain angles are in the unit of the file."""
    if isinstance(value, list):
        return [_row(mechanism, name, part, angle) for part in value]
    degrees = angle == "deg" and dimension_of_instants(mechanism, name) == "angle"
    return math.radians(value) if degrees and isinstance(value, float) else value


def _questions(given: Any, mechanism: Mechanism) -> list[Problem]:
    problems: list[Problem] = []
    for name, entry in given.measures.items():
        if len(problems) >= ENOUGH:
            break
        try:
            measure = Measure(entry) if isinstance(entry, str) else Measure(entry.of, entry.unit)
            mechanism.measures[name] = measure
            check_measure(mechanism, measure.history)
        except ModelError as error:
            problems.append(Problem(("measures", name), str(error).removeprefix("measure: ")))
    if given.ask is not None:
        try:
            fields = _set(given.ask)
            given_rows = fields.get("at", {}).items()
            rows = {name: _row(mechanism, name, row, given.angle) for name, row in given_rows}
            mechanism.ask = Instants(**{**fields, "at": rows})
            check_instants(mechanism, mechanism.ask)
        except ModelError as error:
            problems.append(Problem(("ask",), str(error).removeprefix("ask: ")))
    if given.simulate is not None:
        try:
            entry = given.simulate
            start = {body: _set(state) for body, state in entry.start.items()}
            events = [Event(name=name, **_set(one)) for name, one in entry.events.items()]
            mechanism.simulation = SimulationSettings(
                until=entry.until,
                start=start,
                rtol=entry.rtol,
                instants=entry.instants,
                events=events,
                method=entry.method,
                step=entry.step,
                release=entry.release,
                every=entry.every,
            )
            check_simulation(mechanism, mechanism.simulation)
        except ModelError as error:
            problems.append(Problem(("simulate",), str(error).removeprefix("simulation: ")))
    for name, entry in given.solve.items():
        if len(problems) >= ENOUGH:
            break
        try:
            question = _question(mechanism, entry, given.angle)
            mechanism.questions[name] = question
            check_question(mechanism, question)
        except ModelError as error:
            problems.append(Problem(("solve", name), str(error).removeprefix("question: ")))
    for name, entry in given.optimize.items():
        try:
            keep_task(mechanism, name, entry, given.angle)
        except ModelError as error:
            problems.append(Problem(("optimize", name), str(error)))
    try:
        keep_fit(mechanism, given.fit, given.angle)
    except ModelError as error:
        problems.append(Problem(("fit",), str(error)))
    return problems


def _question(mechanism: Mechanism, entry: Any, angle: str) -> Question:
    """A question of a file; plain angles are in the unit of the file."""
    fields = _set(entry)
    if isinstance(fields["unknowns"], dict):
        fields["unknowns"] = [
            Unknown(name, **_turned(mechanism, name, _set(one), angle))
            for name, one in fields["unknowns"].items()
        ]
    at = fields.get("at", {}).items()
    fields["at"] = {name: _row(mechanism, name, value, angle) for name, value in at}
    return Question(**fields)


def _turned(mechanism: Mechanism, name: str, options: dict[str, Any], angle: str) -> dict[str, Any]:
    """The same with plain degrees as radians, where the unknown is an angle."""
    if angle != "deg" or meant(mechanism, name)[1] != DIMENSIONS["angle"]:
        return options
    return {k: math.radians(v) if isinstance(v, float) else v for k, v in options.items()}
