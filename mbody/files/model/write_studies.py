"""The studies of a mechanism as tables of a model file: measures, instants, questions."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any, Protocol

from mbody.analysis.driven.requests import dimension_of_instants
from mbody.model.event import Event
from mbody.model.mechanism import Mechanism
from mbody.model.numbers import meant
from mbody.model.simulation import STATE, SimulationSettings
from mbody.model.study import Question, Unknown
from mbody.quantities import Formula
from mbody.quantities.units import DIMENSIONS, NUMBER, Dimension

__all__ = ["StudyWriter", "questions", "requested_formulas"]

BOUNDS = ("start", "low", "high")


class StudyWriter(Protocol):
    """What studies and tasks need of the writer of a model file."""

    mechanism: Mechanism

    def wanted(self, value: Any, dimension: Dimension) -> Any:
        """A number as the file has it: a text where it has a formula or another unit."""


def requested_formulas(mechanism: Mechanism) -> Iterator[Formula]:
    """The texts among the numbers of questions, each with the dimension that it has there."""
    rows = [mechanism.ask.at] if mechanism.ask else []
    for at in (*rows, *(question.at for question in mechanism.questions.values())):
        for name, row in at.items():
            dimension = DIMENSIONS[dimension_of_instants(mechanism, name)]
            yield from (value.of(dimension) for value in row if isinstance(value, Formula))
    if mechanism.simulation is not None:
        for given in mechanism.simulation.start.values():
            for key, value in given.items():
                if isinstance(value, Formula):
                    yield value.of(DIMENSIONS[STATE[key]])
        motion = mechanism.simulation
        for time in (motion.until, motion.step, motion.every, *motion.release.values()):
            if isinstance(time, Formula):
                yield time.of(DIMENSIONS["time"])
    for question in mechanism.questions.values():
        for one in question.unknowns:
            values = [v for key in BOUNDS if isinstance(v := getattr(one, key), Formula)]
            dimension = meant(mechanism, one.name)[1] or NUMBER if values else NUMBER
            yield from (value.of(dimension) for value in values)


def questions(writer: StudyWriter) -> dict[str, Any]:
    """The tables [measures], [ask] and [solve]."""
    machine = writer.mechanism
    data: dict[str, Any] = {}
    if machine.measures:
        data["measures"] = {
            name: {"of": m.of, "unit": m.unit} if m.unit else m.of
            for name, m in machine.measures.items()
        }
    ask = machine.ask
    if ask is not None:
        table: dict[str, Any] = {}
        if ask.at:
            table["at"] = _at(writer, ask.at)
        if ask.over:
            table["over"] = ask.over
        if ask.instants is not None:
            table["instants"] = ask.instants
        if ask.turns != 1:
            table["turns"] = ask.turns
        data["ask"] = table
    simulation = machine.simulation
    if simulation is not None:
        data["simulate"] = {"until": writer.wanted(simulation.until, DIMENSIONS["time"])}
        if simulation.start:
            data["simulate"]["start"] = {
                body: {k: writer.wanted(v, DIMENSIONS[STATE[k]]) for k, v in given.items()}
                for body, given in simulation.start.items()
            }
        for key in ("rtol", "instants", "method"):
            if getattr(simulation, key) != getattr(SimulationSettings(1.0), key):
                data["simulate"][key] = getattr(simulation, key)
        time = DIMENSIONS["time"]
        for key in ("step", "every"):
            if getattr(simulation, key) is not None:
                data["simulate"][key] = writer.wanted(getattr(simulation, key), time)
        if simulation.release:
            times = {name: writer.wanted(t, time) for name, t in simulation.release.items()}
            data["simulate"]["release"] = times
        data["simulate"] |= _events(simulation.events)
    if machine.questions:
        data["solve"] = {name: _question(writer, q) for name, q in machine.questions.items()}
    return data


def _events(given: tuple[Event, ...]) -> dict[str, Any]:
    """The table of events, where there are any."""
    events = {}
    for one in given:
        plain = Event(one.of)
        keys = [k for k in ("direction", "stop") if getattr(one, k) != getattr(plain, k)]
        events[one.name] = {"of": one.of, **{key: getattr(one, key) for key in keys}}
    return {"events": events} if events else {}


def _at(writer: StudyWriter, at: Any) -> dict[str, Any]:
    """Values of time or drivers, one or more of each."""
    table = {}
    for name, row in at.items():
        dimension = DIMENSIONS[dimension_of_instants(writer.mechanism, name)]
        cells = [writer.wanted(value, dimension) for value in row]
        table[name] = cells if len(cells) > 1 else cells[0]
    return table


def _question(writer: StudyWriter, question: Question) -> dict[str, Any]:
    """A question, as short as possible."""
    names = [one.name for one in question.unknowns]
    plainly = all(replace(one, name="x") == Unknown("x") for one in question.unknowns)
    table: dict[str, Any] = {
        "unknowns": names
        if plainly
        else {one.name: _unknown(writer, one) for one in question.unknowns}
    }
    for key in ("conditions", "side_conditions"):
        if getattr(question, key):
            table[key] = list(getattr(question, key))
    for key in ("greatest", "least", "note"):
        if getattr(question, key):
            table[key] = getattr(question, key)
    if question.analysis != "kinetostatics":
        table["analysis"] = question.analysis
    if question.at:
        table["at"] = _at(writer, question.at)
    return table


def _unknown(writer: StudyWriter, unknown: Unknown) -> dict[str, Any]:
    """Where the search of an unknown begins, its bounds and its unit."""
    dimension = meant(writer.mechanism, unknown.name)[1] or NUMBER
    table = {
        key: writer.wanted(value, dimension)
        for key in BOUNDS
        if (value := getattr(unknown, key)) is not None
    }
    return {**table, "unit": unknown.unit} if unknown.unit else table
