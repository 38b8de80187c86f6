"""The tables of studies in a model file: [measures], [ask], [simulate], [solve], [optimize], [fit]
and [report].

What is no part of the description, which is the same with other tasks, is kept beside it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

from mbody.analysis.driven.driven import dimension_of_instants
from mbody.files.model.fields import (
    FLAG,
    REAL,
    TEXT,
    WHOLE,
    ByName,
    Codec,
    Form,
    Forms,
    Key,
    ListCodec,
    NamedNumbers,
    NumberCodec,
    NumberWriter,
    TableCodec,
    WordCodec,
    in_radians,
    quantity,
)
from mbody.model.mechanism import Mechanism
from mbody.model.numbers import resolve_number
from mbody.model.simulation import (
    METHODS,
    STATE,
    Event,
    OptimizationTask,
    SimulationSettings,
    Unknown,
)
from mbody.quantities.units import DIMENSIONS, NUMBER, Dimension


def _of_number(machine: Mechanism, name: str) -> Dimension:
    return resolve_number(machine, name)[1] or NUMBER


def _of_instants(machine: Mechanism, name: str) -> Dimension:
    return DIMENSIONS[dimension_of_instants(machine, name)]


AT = NamedNumbers(_of_instants, "several")
_TEXTS = ListCodec(TEXT, alone=True)
_TIME = NumberCodec(DIMENSIONS["time"])


class MeasureCodec(Forms):
    """A formula, or a table with its unit."""

    def write(self, to: NumberWriter, name: str, value: Any) -> Any:
        return {"of": value.of, "unit": value.unit} if value.unit else value.of


MEASURE = MeasureCodec(
    "must be a formula or { of = …, unit = … }",
    (
        Form((str,), TEXT),
        Form(
            (dict,),
            TableCodec(
                "MeasureIn",
                "A quantity to be measured, in a unit.",
                {"of": Key(TEXT, needed=True), "unit": Key(TEXT)},
            ),
        ),
    ),
)
ASK = TableCodec(
    "AskIn",
    "The instants that an analysis is made for, unless the command gives others.",
    {
        "at": Key(AT, default={}),
        "over": Key(TEXT, default=""),
        "instants": Key(WHOLE),
        "turns": Key(WHOLE, default=1),
    },
)


class Unknowns(Forms):
    """Unknowns of a question: names, or by name where the search begins, its bounds and unit."""

    def settled(self, value: Any, machine: Mechanism, angle: str) -> Any:
        if not isinstance(value, dict):
            return value
        return [
            Unknown(
                name,
                **{
                    key: in_radians(
                        own, angle == "deg" and _of_number(machine, name) == DIMENSIONS["angle"]
                    )
                    for key, own in given.items()
                },
            )
            for name, given in value.items()
        ]

    def write(self, to: NumberWriter, name: str, value: Any) -> Any:
        if all(replace(one, name="x") == Unknown("x") for one in value):
            return [one.name for one in value]
        return {one.name: self._unknown(to, one) for one in value}

    def _unknown(self, to: NumberWriter, unknown: Unknown) -> dict[str, Any]:
        bounds = {key: getattr(unknown, key) for key in ("start", "low", "high")}
        dimension = _of_number(to.mechanism, unknown.name)
        table = {k: to.wanted(v, dimension) for k, v in bounds.items() if v is not None}
        return {**table, "unit": unknown.unit} if unknown.unit else table


_UNKNOWN = TableCodec(
    "UnknownIn",
    "An unknown: where its search begins, its bounds, and the unit that it is shown in.",
    {
        "start": Key(NumberCodec()),
        "low": Key(NumberCodec()),
        "high": Key(NumberCodec()),
        "unit": Key(TEXT, default=""),
    },
)
UNKNOWNS = Unknowns(
    "must be a name, a list of names, or { name = { start = …, unit = … } }",
    (Form((str, list), _TEXTS), Form((dict,), ByName(_UNKNOWN, elements=False))),
)
SOLVE = TableCodec(
    "SolveIn",
    "A question: unknown numbers and the conditions that they are to meet.",
    {
        "unknowns": Key(UNKNOWNS, needed=True),
        "conditions": Key(_TEXTS, default=()),
        "side_conditions": Key(_TEXTS, default=()),
        "greatest": Key(TEXT, default=""),
        "least": Key(TEXT, default=""),
        "note": Key(TEXT, default=""),
        "analysis": Key(TEXT, default="kinetostatics"),
        "at": Key(NamedNumbers(_of_instants), default={}),
    },
)


class Start(TableCodec):
    """Initial values of a body, in the order that they were given in."""

    def write(self, to: NumberWriter, name: str, value: Any) -> Any:
        return {key: self.keys[key].codec.write(to, name, one) for key, one in value.items()}


class Events(ByName):
    """Zero crossings by name that are recorded, or end the motion."""

    table = TableCodec(
        "EventIn",
        "A zero crossing that is recorded, or ends the motion.",
        {
            "of": Key(TEXT, needed=True),
            "direction": Key(WHOLE, default=0),
            "stop": Key(FLAG, default=False),
        },
    )

    def settled(self, value: Any, machine: Mechanism, angle: str) -> Any:
        return [Event(name=name, **given) for name, given in value.items()]

    def write(self, to: NumberWriter, name: str, value: Any) -> Any:
        return {one.name: self.table.write(to, name, one) for one in value}


_START = Start(
    "StateIn",
    "Initial values of a body.",
    {key: Key(quantity(STATE[key])) for key in ("angle", "omega", "x", "vx", "y", "vy")},
)
_MOTION = SimulationSettings(1.0)
SIMULATE = TableCodec(
    "SimulateIn",
    "A motion: how it begins, and how long it goes on.",
    {
        "until": Key(_TIME, needed=True),
        "start": Key(ByName(_START, elements=False), default={}),
        "rtol": Key(REAL, default=_MOTION.rtol),
        "instants": Key(WHOLE, default=_MOTION.instants),
        "method": Key(WordCodec(METHODS), default=_MOTION.method),
        "step": Key(_TIME),
        "every": Key(_TIME),
        "release": Key(ByName(_TIME), default={}),
        "events": Key(Events(Events.table), default=()),
    },
)


class OneOrMore(ListCodec):
    """Texts, of which one alone is written without a list."""

    def write(self, to: NumberWriter, name: str, value: Any) -> Any:
        return value[0] if len(value) == 1 else [*value]


# -- Tables [optimize.NAME]: aims and limits of `mbody optimize` -------------------------------

#: Under which they are kept with the mechanism, so that copies of that have them too.
OPTIMIZATIONS_ATTRIBUTE = "optimization_tasks"
_AIMS = OneOrMore(TEXT, alone=True)
OPTIMIZE = TableCodec(
    "OptimizeIn",
    "Aims, numbers and limits of an optimization.",
    {
        "minimize": Key(_AIMS, "One aim, or two.", default=()),
        "maximize": Key(_AIMS, "One aim, or two.", default=()),
        "by": Key(NamedNumbers(_of_number, "pair"), "[low, high] by number.", needed=True),
        "subject_to": Key(_AIMS, "Limits such as 'peak(motor.effort) <= 20 N*m'.", default=()),
        "analysis": Key(
            TEXT,
            "Or kinematics, statics, simulate: a motion over time.",
            default="kinetostatics",
        ),
        "over": Key(TEXT, "'turn' or a driver; by default the instants of [ask].", default=""),
        "instants": Key(WHOLE),
        "turns": Key(WHOLE, "Turns of a cycle, with over."),
        "until": Key(_TIME, "The last time, of analysis = 'simulate'."),
        "start": Key(NamedNumbers(_of_number)),
        "starts": Key(WHOLE, "How many searches."),
        "seed": Key(WHOLE),
        "points": Key(WHOLE, "Designs of a Pareto front."),
        "note": Key(TEXT, default=""),
    },
)


def optimization_tasks(mechanism: Mechanism) -> Mapping[str, OptimizationTask]:
    """Optimizations in a mechanism's file, by name."""
    return vars(mechanism).get(OPTIMIZATIONS_ATTRIBUTE, {})


# -- The table [fit]: which numbers `mbody fit` finds from measured histories ------------------

#: Under which it is kept with the mechanism, so that copies of that have it too.
FIT_ATTRIBUTE = "fit_settings"


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


class FitNumbers(Forms):
    """Names of numbers, or bounds by name."""

    def settled(self, value: Any, machine: Mechanism, angle: str) -> Any:
        for name in value:
            resolve_number(machine, name)
        pairs = self.forms[1].codec
        return pairs.settled(value, machine, angle) if isinstance(value, dict) else value


FIT = TableCodec(
    "FitIn",
    "Which numbers `mbody fit` finds from data, and how.",
    {
        "by": Key(
            FitNumbers(
                "must be a list of names, or [low, high] by number",
                (
                    Form((list,), ListCodec(TEXT), (tuple,)),
                    Form((dict,), NamedNumbers(_of_number, "pair"), (Mapping,)),
                ),
            ),
            "The unknown numbers; or [low, high] by number.",
            needed=True,
            default=(),
        ),
        "offsets": Key(
            ListCodec(TEXT), "Columns with an unknown constant, as of an encoder.", default=()
        ),
        "deviations": Key(
            ByName(REAL, elements=False),
            "Standard deviation of the noise by column, in its unit.",
            default={},
        ),
        "analysis": Key(TEXT, "By default as the model is driven."),
        "confidence": Key(REAL, "Of the intervals; by default 0.95."),
    },
)


def fit_settings(mechanism: Mechanism) -> FitSettings | None:
    """Settings of a fit in a mechanism's file; None without any."""
    return vars(mechanism).get(FIT_ATTRIBUTE)


# -- The table [report]: what a report contains ------------------------------------------------

REPORT = TableCodec(
    "ReportIn",
    "Contents of `mbody report`.",
    {
        "title": Key(TEXT, "Title of the document; by default that of the model.", default=""),
        "author": Key(TEXT, "Who made it, below the title.", default=""),
        "sections": Key(ListCodec(TEXT), "The sections in order.", default=()),
        "without": Key(ListCodec(TEXT), "Sections that are left out.", default=()),
        "plots": Key(ListCodec(TEXT), "Quantities that are plotted.", default=()),
        "polar": Key(ListCodec(TEXT), "Joints, their forces as vectors.", default=()),
    },
)
#: Under which it is kept with the mechanism, so that copies of that have it too.
REPORT_ATTRIBUTE = "report_settings"


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


def report_settings(mechanism: Mechanism) -> ReportSettings | None:
    """Settings of the report in a mechanism's file; None without any."""
    return vars(mechanism).get(REPORT_ATTRIBUTE)


# -- All of them -------------------------------------------------------------------------------


#: By key of the file.
STUDIES: dict[str, Codec] = {
    "measures": MEASURE,
    "ask": ASK,
    "simulate": SIMULATE,
    "solve": SOLVE,
    "optimize": OPTIMIZE,
    "fit": FIT,
    "report": REPORT,
}


def tables_of_studies(to: NumberWriter) -> dict[str, Any]:
    """The tables of all studies of a mechanism, as a file has them."""
    machine = to.mechanism
    tables: dict[str, Any] = {}
    for key, found in (
        ("measures", machine.measures),
        ("ask", machine.ask),
        ("simulate", machine.simulation),
        ("solve", machine.questions),
        ("optimize", optimization_tasks(machine)),
        ("fit", fit_settings(machine)),
        ("report", report_settings(machine)),
    ):
        codec = STUDIES[key]
        if isinstance(found, Mapping):
            tables[key] = {name: codec.write(to, "", one) for name, one in found.items()}
        elif found is not None:
            tables[key] = codec.write(to, "", found)
    return {key: table for key, table in tables.items() if table or key == "ask"}
