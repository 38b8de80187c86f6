"""The tables of studies in a model file: [fit], [optimize], [report], read and written."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass, field, fields, replace
from typing import TYPE_CHECKING, Any, Protocol

from pydantic import Field

from mbody.analysis.driven.driven import dimension_of_instants
from mbody.errors import ModelError
from mbody.files.model.fields import Strict, number
from mbody.model.mechanism import Mechanism
from mbody.model.study import OptimizationTask, Question, Unknown
from mbody.quantities import Formula
from mbody.quantities.units import DIMENSIONS, NUMBER, Dimension

if TYPE_CHECKING:
    from mbody.model.simulation import Event

BOUNDS = ("start", "low", "high")


class StudyWriter(Protocol):
    """Interface of a model file's writer that studies and tasks need."""

    mechanism: Mechanism

    def wanted(self, value: Any, dimension: Dimension) -> Any:
        """A number as the file has it: a text where it has a formula or another unit."""


def requested_formulas(mechanism: Mechanism) -> Iterator[Formula]:
    """The texts among the numbers of questions, each with the dimension that it has there."""
    from mbody.model.numbers import resolve_number
    from mbody.model.simulation import STATE

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
            dimension = resolve_number(mechanism, one.name)[1] or NUMBER if values else NUMBER
            yield from (value.of(dimension) for value in values)


def questions(writer: StudyWriter) -> dict[str, Any]:
    """The tables [measures], [ask] and [solve]."""
    from mbody.model.simulation import STATE, SimulationSettings

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
            table["at"] = _instants_table(writer, ask.at)
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
    from mbody.model.simulation import Event

    events = {}
    for one in given:
        plain = Event(one.of)
        keys = [k for k in ("direction", "stop") if getattr(one, k) != getattr(plain, k)]
        events[one.name] = {"of": one.of, **{key: getattr(one, key) for key in keys}}
    return {"events": events} if events else {}


def _instants_table(writer: StudyWriter, at: Any) -> dict[str, Any]:
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
        table["at"] = _instants_table(writer, question.at)
    return table


def _unknown(writer: StudyWriter, unknown: Unknown) -> dict[str, Any]:
    """Start of the search of an unknown, its bounds and its unit."""
    from mbody.model.numbers import resolve_number

    dimension = resolve_number(writer.mechanism, unknown.name)[1] or NUMBER
    table = {
        key: writer.wanted(value, dimension)
        for key in BOUNDS
        if (value := getattr(unknown, key)) is not None
    }
    return {**table, "unit": unknown.unit} if unknown.unit else table


# -- Tables [optimize.NAME] of a model file: aims and limits of `mbody optimize` ---------------
# They are no part of the description, which is the same with other tasks: they are kept beside it.

#: Under which they are kept with the mechanism, so that copies of that have them too.
OPTIMIZATIONS_ATTRIBUTE = "optimization_tasks"
#: Fields with numbers of the mechanism.
NUMBERS = ("by", "start")


#: A number of the mechanism: plain, or text with units and parameters.
quantity: Any = number(None)
time: Any = number(DIMENSIONS["time"])


class OptimizeIn(Strict):
    """Aims, numbers and limits of an optimization."""

    minimize: str | list[str] = Field(default_factory=list, description="One aim, or two.")
    maximize: str | list[str] = Field(default_factory=list, description="One aim, or two.")
    by: dict[str, list[quantity]] = Field(description="[low, high] by number.")
    subject_to: str | list[str] = Field(
        default_factory=list, description="Limits such as 'peak(motor.effort) <= 20 N*m'."
    )
    analysis: str = Field(
        "kinetostatics", description="Or kinematics, statics, simulate: a motion over time."
    )
    over: str = Field("", description="'turn' or a driver; by default the instants of [ask].")
    instants: int | None = None
    turns: int | None = Field(None, description="Turns of a cycle, with over.")
    until: time = Field(None, description="The last time, of analysis = 'simulate'.")
    start: dict[str, quantity] | None = None
    starts: int | None = Field(None, description="How many searches.")
    seed: int | None = None
    points: int | None = Field(None, description="Designs of a Pareto front.")
    note: str = ""


def keep_task(mechanism: Mechanism, name: str, entry: Any, angle: str) -> None:
    """Keep what a file says of one optimization; plain angles are in the unit of the file."""
    given = {key: getattr(entry, key) for key in entry.model_fields_set}
    for varied, pair in given["by"].items():
        if len(pair) != 2:
            raise ModelError(f"by.{varied} must be [low, high], not of {len(pair)} values", varied)
    for key in NUMBERS:
        if given.get(key) is not None:
            given[key] = {n: in_radians(mechanism, n, v, angle) for n, v in given[key].items()}
    kept = vars(mechanism).setdefault(OPTIMIZATIONS_ATTRIBUTE, {})
    kept[name] = OptimizationTask(**given)


def in_radians(mechanism: Mechanism, name: str, value: Any, angle: str) -> Any:
    """Plain degrees as radians, where the number is an angle."""
    from mbody.model.numbers import resolve_number

    if isinstance(value, list):
        return tuple(in_radians(mechanism, name, part, angle) for part in value)
    degrees = resolve_number(mechanism, name)[1] == DIMENSIONS["angle"] and angle == "deg"
    return math.radians(value) if degrees and not isinstance(value, Formula) else value


def optimization_tasks(mechanism: Mechanism) -> Mapping[str, OptimizationTask]:
    """Optimizations in a mechanism's file, by name."""
    return vars(mechanism).get(OPTIMIZATIONS_ATTRIBUTE, {})


def task_formulas(mechanism: Mechanism) -> Iterator[Formula]:
    """The texts among their numbers, each with the dimension that it has there."""
    from mbody.model.numbers import resolve_number

    for task in optimization_tasks(mechanism).values():
        for key in NUMBERS:
            for name, value in (getattr(task, key) or {}).items():
                dimension = resolve_number(mechanism, name)[1] or NUMBER
                several = value if isinstance(value, tuple) else (value,)
                yield from (one.of(dimension) for one in several if isinstance(one, Formula))
        if isinstance(task.until, Formula):
            yield task.until.of(DIMENSIONS["time"])


def task_tables(writer: StudyWriter) -> dict[str, Any]:
    """The tables as a file has them, by name."""
    return {
        name: _table(writer, task) for name, task in optimization_tasks(writer.mechanism).items()
    }


def _table(writer: StudyWriter, task: OptimizationTask) -> dict[str, Any]:
    plain, table = OptimizationTask(), {}
    for one in fields(task):
        value = getattr(task, one.name)
        if value is None or value == getattr(plain, one.name):
            continue
        if one.name in NUMBERS:
            value = {name: written_number(writer, name, own) for name, own in value.items()}
        elif one.name == "until":
            value = writer.wanted(value, DIMENSIONS["time"])
        elif isinstance(value, tuple):
            value = list(value) if len(value) > 1 else value[0]
        table[one.name] = value
    return table


def written_number(writer: StudyWriter, name: str, value: Any) -> Any:
    """A number of the mechanism, or a pair of bounds, as a file has it."""
    from mbody.model.numbers import resolve_number

    dimension = resolve_number(writer.mechanism, name)[1] or NUMBER
    if isinstance(value, tuple):
        return [writer.wanted(part, dimension) for part in value]
    return writer.wanted(value, dimension)


# -- The table [fit] of a model file: which numbers `mbody fit` finds from measured histories --
# It is no part of the description, which is the same with other unknowns: it is kept beside it.

#: Under which it is kept with the mechanism, so that copies of that have it too.
FIT_ATTRIBUTE = "fit_settings"


class FitIn(Strict):
    """Which numbers `mbody fit` finds from data, and how."""

    by: list[str] | dict[str, list[quantity]] = Field(
        description="The unknown numbers; or [low, high] by number."
    )
    offsets: list[str] = Field(
        default_factory=list, description="Columns with an unknown constant, as of an encoder."
    )
    deviations: dict[str, float] = Field(
        default_factory=dict, description="Standard deviation of the noise by column, in its unit."
    )
    analysis: str = Field("", description="By default as the model is driven.")
    confidence: float | None = Field(None, description="Of the intervals; by default 0.95.")


@dataclass(frozen=True)
class FitSettings:
    """Default settings of a fit.

    `by`: The unknown numbers, or (low, high) by number.
    `confidence`: As of `mbody.fit`.
    """

    by: tuple[str, ...] | Mapping[str, Any]
    offsets: tuple[str, ...] = ()
    deviations: Mapping[str, float] = field(default_factory=dict)
    analysis: str | None = None
    confidence: float | None = None

    def arguments(self) -> dict[str, Any]:
        """The arguments of `mbody.fit` besides the data."""
        by = self.by if isinstance(self.by, Mapping) else list(self.by)
        found: dict[str, Any] = {"by": by, "offsets": list(self.offsets), "analysis": self.analysis}
        if self.deviations:
            found["deviations"] = dict(self.deviations)
        if self.confidence is not None:
            found["confidence"] = self.confidence
        return found


def keep_fit(mechanism: Mechanism, given: FitIn | None, angle: str) -> None:
    """Keep what a file says of a fit; plain angles are in the unit of the file."""
    if given is None:
        return
    from mbody.model.numbers import resolve_number

    for name in given.by:
        resolve_number(mechanism, name)
    by: Any = tuple(given.by)
    if isinstance(given.by, Mapping):
        for name, pair in given.by.items():
            if len(pair) != 2:
                raise ModelError(f"by.{name} must be [low, high], not of {len(pair)} values", name)
        by = {name: in_radians(mechanism, name, pair, angle) for name, pair in given.by.items()}
    vars(mechanism)[FIT_ATTRIBUTE] = FitSettings(
        by, tuple(given.offsets), given.deviations, given.analysis or None, given.confidence
    )


def fit_settings(mechanism: Mechanism) -> FitSettings | None:
    """Settings of a fit in a mechanism's file; None without any."""
    return vars(mechanism).get(FIT_ATTRIBUTE)


def fit_formulas(mechanism: Mechanism) -> Iterator[Formula]:
    """The texts among the bounds, each with the dimension that it has there."""
    from mbody.model.numbers import resolve_number

    kept = fit_settings(mechanism)
    if kept is not None and isinstance(kept.by, Mapping):
        for name, pair in kept.by.items():
            dimension = resolve_number(mechanism, name)[1] or NUMBER
            yield from (one.of(dimension) for one in pair if isinstance(one, Formula))


def fit_table(writer: StudyWriter) -> dict[str, Any]:
    """The table as a file has it; empty where there is none."""
    kept = fit_settings(writer.mechanism)
    if kept is None:
        return {}
    by: Any = list(kept.by)
    if isinstance(kept.by, Mapping):
        by = {name: written_number(writer, name, pair) for name, pair in kept.by.items()}
    pairs = {
        "by": by,
        "offsets": list(kept.offsets),
        "deviations": dict(kept.deviations),
        "analysis": kept.analysis,
        "confidence": kept.confidence,
    }
    return {key: value for key, value in pairs.items() if value}


# -- The table [report] of a model file: what its report contains ------------------------------
# It is no part of the description, which is the same with another report: it is kept beside it.


class ReportIn(Strict):
    """Contents of `mbody report`."""

    title: str = Field("", description="Title of the document; by default that of the model.")
    author: str = Field("", description="Who made it, below the title.")
    sections: list[str] = Field(default_factory=list, description="The sections in order.")
    without: list[str] = Field(default_factory=list, description="Sections that are left out.")
    plots: list[str] = Field(default_factory=list, description="Quantities that are plotted.")
    polar: list[str] = Field(default_factory=list, description="Joints, their forces as vectors.")


@dataclass(frozen=True)
class ReportSettings:
    """Default contents of a report.

    `sections`, `without`: Names of sections, in order, and of those that are left out.
    `plots`, `polar`: Quantities that are plotted; joints whose forces are drawn as vectors.
    """

    title: str = ""
    author: str = ""
    sections: tuple[str, ...] = ()
    without: tuple[str, ...] = ()
    plots: tuple[str, ...] = ()
    polar: tuple[str, ...] = ()


#: Under which it is kept with the mechanism, so that copies of that have it too.
REPORT_ATTRIBUTE = "report_settings"


def keep_settings(mechanism: Mechanism, given: ReportIn | None) -> None:
    """Keep what a file says of the report of a mechanism."""
    if given is not None:
        lists = {
            key: tuple(getattr(given, key)) for key in ("sections", "without", "plots", "polar")
        }
        vars(mechanism)[REPORT_ATTRIBUTE] = ReportSettings(given.title, given.author, **lists)


def report_settings(mechanism: Mechanism) -> ReportSettings | None:
    """Settings of the report in a mechanism's file; None without any."""
    return vars(mechanism).get(REPORT_ATTRIBUTE)


def settings_table(mechanism: Mechanism) -> dict[str, Any]:
    """The table as a file has it; empty where there is none."""
    kept = report_settings(mechanism)
    pairs = asdict(kept).items() if kept is not None else ()
    return {
        key: list(value) if isinstance(value, tuple) else value for key, value in pairs if value
    }
