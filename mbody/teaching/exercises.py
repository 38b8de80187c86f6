"""Exercises: designs with round numbers, a sheet of questions and a key with worked solutions."""

from __future__ import annotations

import dataclasses
import difflib
import json
import math
import os
import random
import re
import textwrap
import tomllib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from mbody.analysis.driven.driven import analyse_at, kinematics
from mbody.core.other_words import meant
from mbody.core.tolerances import ROUND_NUMBER_SLACK
from mbody.errors import ModelError, SolveError
from mbody.files.model import from_toml
from mbody.files.model.fields import field_of_law
from mbody.files.model.problems import LAWS, SECTIONS, also_written, written_fields
from mbody.files.model.schema import codec_of, described
from mbody.files.tables import writing
from mbody.laws import Law
from mbody.model.body import Body
from mbody.model.element import Element, listed, whole_number
from mbody.model.simulation import Instants
from mbody.quantities import FormulaError, Scope, read
from mbody.quantities.units import DIMENSIONS, NUMBER, unit_system
from mbody.reports.described import (
    Block,
    Chapter,
    Grid,
    Items,
    Picture,
    ReportDocument,
    Subject,
    Text,
    inputs,
)
from mbody.reports.writers import markdown
from mbody.summaries.text_table import WIDTH, Column, number, paragraph
from mbody.teaching.derivation import Derivation, derivation
from mbody.teaching.vector_loops import loops_of_instants
from mbody.views.drawing import draw
from mbody.views.labels import content_of

if TYPE_CHECKING:
    from mbody.model.mechanism import Mechanism
    from mbody.solution.solution import Solution


# -- Commented model files to begin with -------------------------------------------------------

FOLDER = Path(__file__).parent / "templates"

#: The lengths of each kind, by their names in its file and in the order in which they are given.
KINDS: dict[str, tuple[str, ...]] = {
    "fourbar": ("a", "b", "c", "d"),
    "slidercrank": ("r", "l", "offset"),
    "sixbar": ("a", "b", "c", "d", "e", "f", "g", "h"),
    "gears": ("r1", "r2", "r3", "r4"),
    "cam": ("base", "roller", "lift"),
    "pendulum": ("l",),
}


def new_model(kind: str, lengths: Sequence[str | float] = (), units: str = "") -> str:
    """The text of a commented model file.

    Parameters
    ----------
    kind : str
        One of `KINDS`; hyphens, underscores and capitals do not matter.
    lengths : sequence of str or float, optional
        Its lengths in the order of `KINDS`, such as crank, coupler, rocker and ground; a plain
        number is in the unit of the file. Without them those of the template count.
    units : str, optional
        The unit system of plain numbers and of the results, such as ``"in-lbf-s"``; by default that
        of the template.

    Raises
    ------
    ModelError
        For a kind or units that there are not, other than all lengths, and what is no length.

    Examples
    --------
    >>> import mbody
    >>> text = new_model("fourbar", [50, 120, 80, "11 cm"])
    >>> run = mbody.kinetostatics(mbody.from_toml(text))
    >>> round(float(run.point("crank.A").x[0]), 9), run.status
    (25.0, 'completed')
    """
    word = re.sub(r"[\s_-]", "", kind).lower()
    if word not in KINDS:
        close = difflib.get_close_matches(word[:60], KINDS, 1)
        hint = f"did you mean {close[0]}?" if close else f"there are: {listed(KINDS)}"
        raise ModelError(f"there is no model of the kind {kind[:60]!r}: {hint}")
    text = (FOLDER / f"{word}.toml").read_text(encoding="utf-8")
    if units:
        text = _with_units(text, units)
    names = KINDS[word]
    if lengths and len(lengths) != len(names):
        raise ModelError(
            f"'{word}' has {len(names)} lengths ({', '.join(names)} of its file), not "
            f"{len(lengths)}: give all of them"
        )
    for name, length in zip(names, lengths, strict=False):
        text = _with_length(text, name, str(length).strip())
    from_toml(text, name=word)
    return text


def _with_units(text: str, units: str) -> str:
    """The file in another unit system, in which measures are too: all of its numbers but 0 have
    units of their own.
    """
    text = re.sub(r'\{ of = ("[^"]*"), unit = "[^"]*" \}', r"\1", text)
    names = unit_system(units)
    symbols = ", ".join((names.length, names.force, names.time, names.mass))
    line = f'units = "{units}"'.ljust(34)
    return re.sub(
        r"^units = .*$",
        lambda _: f"{line} # plain numbers: {symbols}, and deg; or give the unit",
        text,
        count=1,
        flags=re.MULTILINE,
    )


def _unit(text: str) -> str:
    """Of plain lengths in a template."""
    found = re.search(r'^units = "(.*?)"', text, re.MULTILINE)
    assert found
    return f" {unit_system(found[1]).length}"


def _with_length(text: str, name: str, length: str) -> str:
    """The file with another value of a parameter; comments stay in their column."""
    if re.fullmatch(r"-?[\d.]+", length):
        length += _unit(text)
    try:
        size = read(length, DIMENSIONS["length"]).value(Scope())
    except FormulaError as error:
        raise ModelError(f"the length {name}: {error}") from None
    if name != "offset" and size <= 0.0:
        raise ModelError(f"the length {name} is {length}: it must be positive")
    found = re.search(rf'^{name} *= (".*?")( *)(?=#|$)', text, re.MULTILINE)
    assert found, name
    value = f'"{length}"'
    room = max(1, len(found[1]) + len(found[2]) - len(value)) if found[2] else 0
    return text[: found.start(1)] + value + " " * room + text[found.end(2) :]


# -- Reference of the kinds of elements: fields with units and meaning, and an example ---------

# -- An example of every kind of element and law, as a model file has it -----------------------

#: What the examples stand beside, in mm, N and s.
SURROUNDINGS = """\
units = "mm-N-s"
[ground]
points = { A = [0, 0], B = [300, 0], F = [0, -50] }
[ground.shapes]
floor = { line = { point = "F", angle = 0 } }
[bodies.arm]
mass = "2 kg"
points = { A = [0, 0], B = [100, 0] }
spread = "point"
[bodies.wheel]
mass = "1 kg"
points = { O = [0, 0] }
[bodies.wheel.shapes]
rim = { disc = "O", radius = 50 }
"""

#: A body, below the table [bodies].
BODY = """\
[bodies.arm]
mass    = "2 kg"
inertia = "0.01 kg*m^2"
cg      = [50, 0]
points  = { A = [0, 0], B = ["100 mm", 0] }
guess   = "30 deg\""""

#: Tables of a file that hold no kinds of elements: what for, and an example.
OTHER_TABLES: dict[str, tuple[str, str]] = {
    "output_units": (
        "the units in which results are shown",
        '[output_units]\ntorque = "N*m"\npower = "kW"\nspeed = "rpm"',
    ),
    "ground": ("points of the ground", '[ground]\npoints = { A = [0, 0], B = ["3 in", 0] }'),
    "parameters": ("numbers that formulas of the file use", '[parameters]\nr = "40 mm"'),
    "curves": (
        "functions by name, for formulas and laws",
        '[curves]\ngas = { x = ["0 mm", "10 mm"], y = ["5 bar", "1 bar"] }',
    ),
    "inputs": ("numbers that may change during a motion", '[inputs]\nu = "0 N*m"'),
    "states": (
        "first-order equations of your own, z′ = rate",
        '[states]\nz = { rate = "(u - z)/(10 ms)", start = "0 N*m", size = "1 N*m" }',
    ),
    "quantities": (
        "formulas that later formulas name",
        '[quantities]\nerror = "30 deg - arm.angle"',
    ),
    "measures": ("quantities that results have by name", '[measures]\nreach = "arm.B.x"'),
    "ask": ("the instants that the command analyses", '[ask]\nover = "motor"'),
    "simulate": (
        "how a free motion begins and how long it is",
        "[simulate]\nuntil = 2\nstart = { arm = { angle = 30, omega = 0 } }",
    ),
    "solve": (
        "questions: numbers that meet conditions",
        '[solve.torque]\nunknowns = ["motor.value"]\nconditions = ["arm.alpha = 0"]',
    ),
    "optimize": (
        "the best values of numbers",
        '[optimize.best]\nminimize = "peak(motor.effort)"\nby = { "arm.B.x" = [80, 120] }',
    ),
    "fit": ("numbers from measured histories", '[fit]\nby = ["arm.mass"]'),
    "report": ("chapters of the report", '[report]\nsections = ["sketch", "joints"]'),
}
#: Elements by section and kind: a line of the table of that section.
ELEMENTS: dict[tuple[str, str], str] = {
    ("joints", "revolute"): 'A = { revolute = ["ground.A", "arm.A"] }',
    ("joints", "prismatic"): (
        'guide = { prismatic = [{ body = "ground", point = "A", angle = 90 }, '
        '{ body = "arm", point = "A", angle = 90 }] }'
    ),
    ("joints", "fixed"): 'weld = { fixed = ["arm.B", "wheel.O"] }',
    ("joints", "distance"): 'rod = { distance = ["ground.B", "arm.B"], length = "220 mm" }',
    ("joints", "pin_slot"): (
        'slot = { pin_slot = [{ body = "ground", point = "A", angle = 45 }, "arm.B"] }'
    ),
    ("joints", "gear"): (
        'mesh = { gear = ["arm.A", "wheel.O"], radius_i = "40 mm", radius_j = "60 mm" }'
    ),
    ("joints", "rack_pinion"): 'mesh = { rack_pinion = ["arm.A", "wheel.O"], radius = "50 mm" }',
    ("joints", "rolling"): 'road = { rolling = ["ground.A", "wheel.O"], radius = "50 mm" }',
    ("joints", "cam_follower"): (
        'cam = { cam_follower = ["wheel.O", "arm.A"], base_radius = "40 mm", roller = "10 mm", '
        "profile = { harmonic = { mean = 10, amplitude = 10, frequency = 1 } } }"
    ),
    ("joints", "belt"): (
        'belt = { belt = ["ground.A", "wheel.O"], tension = "400 N", radius_i = "100 mm", '
        'radius_j = "50 mm", distance = "300 mm", friction = 0.3 }'
    ),
    ("joints", "band_brake"): (
        'brake = { band_brake = ["ground.A", "wheel.O"], force = "100 N", radius = "50 mm", '
        'wrap = "270 deg", friction = 0.3, lever = "300 mm", arm = "60 mm" }'
    ),
    ("joints", "clutch"): 'clutch = { clutch = ["arm.A", "wheel.O"], torque = "20 N*m" }',
    ("joints", "friction_force"): (
        'pad = { friction_force = ["ground.A", "arm.B"], force = "30 N" }'
    ),
    ("couplings", "angle"): (
        'chain = { angle = [{ factor = 2, angle = "wheel" }, { factor = -1, angle = "arm" }] }'
    ),
    ("couplings", "length"): (
        'rope = { length = [{ factor = 1, distance = ["ground.A", "arm.B"] }, '
        '{ factor = 2, distance = ["ground.B", "wheel.O"] }], value = "500 mm" }'
    ),
    ("drivers", "angle"): (
        'motor = { angle = "arm", law = { constant_speed = { value = 0, speed = "300 rpm" } } }'
    ),
    ("drivers", "distance"): (
        'cylinder = { distance = ["ground.B", "arm.B"], law = "220 mm + 10 mm/s*t" }'
    ),
    ("drivers", "coordinate"): (
        'feed = { coordinate = [{ body = "ground", point = "A", angle = 0 }, "wheel.O"], '
        'law = "10 mm/s*t" }'
    ),
    ("loads", "force"): 'push = { force = "120 N", at = "arm.B", angle = -90 }',
    ("loads", "torque"): 'load = { torque = "-3 N*m", body = "arm" }',
    ("loads", "gravity"): 'gravity = { gravity = [0, "-9.81 m/s^2"] }',
    ("loads", "spring"): (
        'spring = { spring = ["ground.B", "arm.B"], stiffness = "2 N/mm", free_length = "150 mm" }'
    ),
    ("loads", "damper"): 'damper = { damper = ["ground.B", "arm.B"], coefficient = "50 N*s/m" }',
    ("loads", "torsion_spring"): (
        'coil = { torsion_spring = "arm", stiffness = "5 N*m/rad", free_angle = "30 deg" }'
    ),
    ("loads", "torsion_damper"): (
        'drag = { torsion_damper = "arm", coefficient = "0.1 N*m*s/rad" }'
    ),
    ("loads", "actuator"): 'jack = { actuator = ["ground.B", "arm.B"], push = "200 N" }',
    ("loads", "centrifugal_field"): 'field = { centrifugal_field = "ground", speed = "200 rpm" }',
    ("loads", "piston_pressure"): (
        'gas = { piston_pressure = ["ground.A", "arm.A"], cycle = "wheel", '
        'head_area = "50 cm^2", head = "6 bar" }'
    ),
    ("loads", "reciprocating_cylinder"): (
        'air = { reciprocating_cylinder = ["ground.A", "arm.A"], area = "50 cm^2", near = "10 mm", '
        'far = "110 mm", clearance = "5 mm", suction = "0 bar", delivery = "5 bar", '
        'exponent = 1.3, ambient = "1 bar" }'
    ),
    ("loads", "dc_motor"): (
        'motor = { dc_motor = "wheel", voltage = "24 V", resistance = "0.5 ohm", '
        'inductance = "1 mH", constant = "0.05 N*m/A" }'
    ),
    ("loads", "induction_motor"): (
        'motor = { induction_motor = "wheel", breakdown_torque = "40 N*m", breakdown_slip = 0.2, '
        'synchronous = "1500 rpm" }'
    ),
    ("loads", "hydraulic_cylinder"): (
        'ram = { hydraulic_cylinder = ["ground.B", "arm.B"], bore = "50 mm", rod = "30 mm", '
        'closed = "150 mm", stroke = "200 mm", valve = 1, flow = "10 L/min", drop = "10 bar", '
        'supply = "100 bar", bulk_modulus = "1.4 GPa", dead_volume = "20 cm^3" }'
    ),
    ("loads", "tyre"): (
        'tyre = { tyre = ["ground.A", "wheel.O"], radius = "300 mm", stiffness = "200 N/mm", '
        'friction = 0.9, steepness = 10, shape = 1.6, relaxation = "150 mm" }'
    ),
    ("contacts", "contact"): (
        'floor = { contact = ["ground.floor", "wheel.rim"], friction = 0.3, restitution = 0.2 }'
    ),
    ("contacts", "between"): (
        'pile = { between = ["ground.floor", "wheel*.rim"], friction = 0.3 }'
    ),
    ("contacts", "rope"): 'rope = { rope = ["ground.B", "arm.B"], length = "250 mm" }',
    ("contacts", "freewheel"): 'ratchet = { freewheel = ["ground.A", "wheel.O"] }',
    ("contacts", "stop"): 'end = { stop = "60 deg - arm.angle", restitution = 0.1 }',
}

#: Laws by kind, as the law of a motor.
LAW_EXAMPLES: dict[str, str] = {
    "constant": '{ constant = { value = "30 deg" } }',
    "constant_speed": '{ constant_speed = { value = 0, speed = "300 rpm" } }',
    "constant_acceleration": (
        '{ constant_acceleration = { value = 0, speed = "10 rad/s", acceleration = "2 rad/s^2" } }'
    ),
    "polynomial": "{ polynomial = [0, 1, 0.5] }",
    "harmonic": '{ harmonic = { mean = 0, amplitude = "30 deg", frequency = "2 rad/s" } }',
    "table": '{ table = { x = [0, "1 s", "2 s"], y = [0, "30 deg", "40 deg"] } }',
    "rise": ('{ rise = { shape = "cycloidal", height = "90 deg", start = 0, duration = "2 s" } }'),
    "cam": (
        '{ cam = { period = "4 s", segments = [{ rise = { shape = "3-4-5", height = "90 deg", '
        'start = 0, duration = "1 s" } }, { dwell = "1 s" }, { rise = { shape = "3-4-5", '
        'height = "-90 deg", start = 0, duration = "2 s" } }] } }'
    ),
}


@dataclass(frozen=True)
class FieldReference:
    """A field of an element.

    Attributes
    ----------
    name : str
    takes : str
        What is written there, with its unit.
    needed : bool
        Whether it must be given.
    default : str
        What counts without it, where that is a number or a word.
    meaning : str

    Examples
    --------
    >>> (spring,) = element_reference("spring")
    >>> spring.fields[0].name, spring.fields[0].needed
    ('i', True)
    """

    name: str
    takes: str
    needed: bool
    default: str
    meaning: str


@dataclass(frozen=True)
class ElementReference:
    """A kind of element, from its class: ``print`` shows it.

    Attributes
    ----------
    kind : str
        Its word in model files, such as "spring".
    section : str
        The table that it is in, such as "loads"; "laws" of laws, "bodies" of bodies.
    cls : type
    about : str
        The paragraphs of its docstring before the parameters.
    fields : tuple of FieldReference
    file : str
        An example as a model file has it.
    python : str
        The same in Python.
    quantities : dict
        What measures may read of it, with dimensions.

    Examples
    --------
    >>> (spring,) = element_reference("spring")
    >>> spring.section, spring.cls.__name__, spring.quantities["length"]
    ('loads', 'Spring', 'length')
    """

    kind: str
    section: str
    cls: type
    about: str
    fields: tuple[FieldReference, ...]
    file: str
    python: str
    quantities: dict[str, str]

    def __str__(self) -> str:
        lines = [f"{self.kind}: {self.cls.__name__}, in [{self.section}] of a model file", ""]
        if self.section == "laws":
            lines[0] = f"{self.kind}: {self.cls.__name__}, a law that fields of elements take"
        elif words := also_written(self.kind):
            lines[1:1] = paragraph(f"also written {', '.join(words)}", "  ")
        for part in self.about.split("\n\n"):
            # a formula that stands by itself keeps its line
            lines += [f"  {part.strip()}"] if part.startswith("  ") else paragraph(part)
            lines.append("")
        lines.append("FIELDS")
        together = self._together()
        for n, (names, field) in enumerate(together):
            ending = "" if field.needed else f"; {field.default or 'may be left out'}"
            lines += paragraph(f"{names}: {field.takes}{ending}", "  ")
            # what is said of several fields that follow each other is said once, below them
            if (
                field.meaning
                and together[n + 1 : n + 2]
                and (together[n + 1][1].meaning == field.meaning)
            ):
                continue
            lines += paragraph(field.meaning, " " * 6) if field.meaning else []
        lines += ["", "IN A MODEL FILE", *_example(self.file, "[")]
        lines += ["", "IN PYTHON", *_example(self.python, "([{")]
        if self.quantities:
            words = [f"{name} ({dimension})" for name, dimension in self.quantities.items()]
            lines += ["", *paragraph(", ".join(words), "MEASURES   ")]
        return "\n".join(lines)

    def _together(self) -> list[tuple[str, FieldReference]]:
        """The fields, those of one meaning that follow each other as one entry."""
        found: list[tuple[str, FieldReference]] = []
        for field in self.fields:
            if found and dataclasses.replace(field, name=found[-1][1].name) == found[-1][1]:
                found[-1] = (f"{found[-1][0]}, {field.name}", found[-1][1])
            else:
                found.append((field.name, field))
        return found


def _example(text: str, brackets: str) -> list[str]:
    """Indented lines of an example; long ones go on below within brackets of some kinds: a model
    file takes new lines within arrays alone.
    """
    return [f"  {part}" for line in text.splitlines() for part in _broken(line, brackets)]


def _broken(line: str, brackets: str) -> list[str]:
    """A line in parts of the width of a summary.

    >>> _broken("law = { table = [" + ", ".join("[10.0, 20.0]" for _ in range(7)) + "] }", "[")[1]
    '    [10.0, 20.0], [10.0, 20.0]] }'
    """
    pieces, piece, inside, quote = [], "", [], ""
    for letter in line:
        piece += letter
        if quote or letter in "\"'":
            quote = "" if letter == quote else quote or letter
            continue
        if letter in "([{":
            inside.append(letter)
        elif letter in ")]}" and inside:
            inside.pop()
        # of arrays in a list whole ones go below
        if letter in ",([{" and inside[-1:] and inside[-1] in brackets and inside.count("[") < 2:
            pieces.append(piece)
            piece = ""
    lines = [""]
    for part in (*pieces, piece):
        if lines[-1] and len(lines[-1] + part) > WIDTH - 2:
            lines.append("    " + part.lstrip())
        else:
            lines[-1] += part
    return [one.rstrip() for one in lines]


def element_reference(name: str) -> tuple[ElementReference, ...]:
    """The kinds of elements and laws of a name: several where it is a kind in several tables.

    Parameters
    ----------
    name : str
        The word of a model file, or the name of the class: "torsion_spring", "TorsionSpring".

    Raises
    ------
    ModelError
        Where there is none, with those that are nearly so called.

    Examples
    --------
    >>> (spring,) = element_reference("spring")
    >>> spring.fields[2].name, spring.fields[2].takes
    ('stiffness', 'a number, stiffness [N/m]')
    >>> [one.section for one in element_reference("distance")]
    ['joints', 'drivers']
    """
    known = _kinds()
    wanted = name.strip().lower().replace("-", "_")
    found = [
        (section, kind, cls)
        for section, kind, cls in known
        if wanted in (kind, cls.__name__.lower(), *also_written(kind))
    ]
    if not found:
        words = {
            word: kind
            for _, kind, cls in known
            for word in (kind, cls.__name__.lower(), *also_written(kind))
        }
        intended = meant(wanted, words, 1.0)
        close = difflib.get_close_matches(wanted[:60], words, 4, 0.5)
        similar = list(dict.fromkeys(words[w] for w in [intended, *close] if w))
        similar += [
            kind for _, kind, _ in known if wanted and wanted in kind and kind not in similar
        ]
        remedy = f"did you mean {listed(similar[:4])}?" if similar else "mbody explain lists them"
        raise ModelError(f"there is no element or law '{name[:60]}': {remedy}")
    return tuple(_reference(*one) for one in found)


def reference_overview(table: str = "") -> str:
    """All kinds with the first sentence of each, by the tables of model files; those of one table,
    or an example of what it holds where it has no kinds; "" where there is no such table.

    Examples
    --------
    >>> reference_overview().splitlines()[0]
    '[bodies]'
    >>> print(reference_overview("input").splitlines()[0])
    [inputs]: numbers that may change during a motion
    """
    lines, last = [], ""
    if table:
        if any(table.lower() in (kind, cls.__name__.lower()) for _, kind, cls in _kinds()):
            return ""
        table = meant(table, ["bodies", *OTHER_TABLES, *SECTIONS, "laws"], 0.9) or ""
        if table in OTHER_TABLES:
            about, example = OTHER_TABLES[table]
            return f"[{table}]: {about}\n\n{example}\n\ndocs/model-files.md has all its words"
        if not table:
            return ""
    wide = max(len(kind) for _, kind, _ in _kinds()) + 2
    for section, kind, cls in _kinds():
        if table and section != table:
            continue
        if section != last:
            lines += ["", f"[{section}]" if section != "laws" else "laws, in fields that take one"]
        last = section
        words = " ".join(_about(cls).split("\n\n")[0].split())
        lines += textwrap.wrap(
            f"{kind:<{wide}}{words}", WIDTH, initial_indent="  ", subsequent_indent=" " * (wide + 2)
        )
    return "\n".join(
        [*lines[1:], "", "mbody explain NAME shows one with its fields and an example"]
    )


def _kinds() -> list[tuple[str, str, type]]:
    found: list[tuple[str, str, type]] = [("bodies", "body", Body)]
    found += [(s, kind, cls) for s, kinds in SECTIONS.items() for kind, cls in kinds.items()]
    return [*found, *(("laws", kind, cls) for kind, cls in LAWS.items())]


def _about(cls: type) -> str:
    """The paragraphs of a docstring before its sections, lines joined but of formulas."""
    text = textwrap.dedent("    " + (cls.__doc__ or ""))
    head = re.split(r"\n[A-Z][a-z]+\n-----", text)[0].split("\n>>>")[0]
    parts = [part for part in head.split("\n\n") if part.strip()]
    return "\n\n".join(part if part.startswith("  ") else " ".join(part.split()) for part in parts)


def _reference(section: str, kind: str, cls: type) -> ElementReference:
    if section == "laws":
        file = f"law = {LAW_EXAMPLES[kind]}"
        python = _value(tomllib.loads(file)["law"])
        return ElementReference(kind, section, cls, _about(cls), _law_fields(cls), file, python, {})
    if section == "bodies":
        data = tomllib.loads(BODY)["bodies"]
        (name,) = data
        python = _call(cls, [name], data[name])
        return ElementReference(kind, section, cls, _about(cls), _fields(cls), BODY, python, {})
    line = ELEMENTS[section, kind]
    ((name, entry),) = tomllib.loads(line).items()
    first = entry.pop(kind)
    main = [first] if len(_main(cls)) == 1 else first
    given = dict(zip(_main(cls), main, strict=True)) | entry
    python = _call(cls, [name], given)
    return ElementReference(
        kind,
        section,
        cls,
        _about(cls),
        _fields(cls),
        file=_in_file(section, line),
        python=python,
        quantities=_quantities(cls),
    )


def _in_file(section: str, line: str) -> str:
    """An element in its table; a long one as a table of its own, a field a line."""
    if len(line) <= WIDTH - 2:
        return f"[{section}]\n{line}"
    name, _, entry = line.partition(" = ")
    fields, depth = [""], 0
    for sign in entry.strip()[1:-1].strip():
        depth += {"[": 1, "{": 1, "]": -1, "}": -1}.get(sign, 0)
        if sign == "," and not depth:
            fields.append("")
        else:
            fields[-1] += sign
    return "\n".join([f"[{section}.{name}]", *(field.strip() for field in fields)])


def _main(cls: type) -> tuple[str, ...]:
    assert issubclass(cls, Element)
    return cls.main


def _quantities(cls: type) -> dict[str, str]:
    """Dimensions of what a result has of such an element, where the class says it."""
    try:
        return dict(cls.quantities(object.__new__(cls)))  # type: ignore[attr-defined]  # of elements
    except AttributeError:  # of what goes by its own fields
        return {}


def _fields(cls: type) -> tuple[FieldReference, ...]:
    assert issubclass(cls, Element)
    meanings = described(cls)
    own = written_fields(cls)
    main = [field for name in cls.main for field in own if field.name == name]
    others = [field for field in own if field not in main]
    return tuple(
        _field(field, field in main, meanings.get(field.name, "")) for field in [*main, *others]
    )


def _field(field: dataclasses.Field[Any], main: bool, meaning: str) -> FieldReference:
    meta, default = field.metadata, field.default
    missing = default is dataclasses.MISSING
    made = field.default_factory is not dataclasses.MISSING
    zero = default in (0.0, "", ()) and not isinstance(default, bool)
    needed = main or (missing and not made) or (zero and meta.get("sign") == "positive")
    default_text = ""
    if not zero and isinstance(default, (float, str, bool)):
        default_text = (
            f"by default {str(default).lower() if isinstance(default, bool) else default}"
        )
    elif zero and not needed and ("dimension" in meta or "law" in meta):
        default_text = "by default 0"
    return FieldReference(field.name, codec_of(field).takes(), needed, default_text, meaning)


def _law_fields(cls: type) -> tuple[FieldReference, ...]:
    assert issubclass(cls, Law)
    meanings = described(cls)
    found = []
    for field in dataclasses.fields(cls):
        powers = field.metadata.get("powers")
        if powers:
            takes = f"a number, {_by_powers(*powers)}"
        else:
            takes = field_of_law(cls, field, NUMBER, NUMBER).takes()
        missing = field.default is dataclasses.MISSING
        default = "" if missing or field.default is None else f"by default {field.default}"
        meaning = meanings.get(field.name, "")
        found.append(FieldReference(field.name, takes, missing, default, meaning))
    return tuple(found)


def _by_powers(value: int, argument: int, angle: int) -> str:
    """The unit of a number of a law in words.

    >>> _by_powers(1, -1, 0), _by_powers(0, -1, 1)
    ('value/argument', 'angle/argument')
    """
    powers = (("value", value), ("argument", argument), ("angle", angle))
    top = "·".join(name if n == 1 else f"{name}²" for name, n in powers if n > 0) or "1"
    below = "·".join(name if n == -1 else f"{name}²" for name, n in powers if n < 0)
    return f"{top}/{below}" if below else top


def _call(cls: type, names: list[str], given: dict[str, Any]) -> str:
    """Python that makes an element of what a model file says of it."""
    assert issubclass(cls, Element)
    angles = {
        field.name
        for field in dataclasses.fields(cls)
        if field.metadata.get("dimension") == "angle" or field.name == "guess"
    }
    parts = [json.dumps(name) for name in names]
    first = []
    for field in written_fields(cls):
        if field.name not in given or not (field.name in _main(cls) or "place" in field.metadata):
            break
        first.append(field.name)
    parts += [_value(given[name], name in angles) for name in first]
    parts += [
        f"{name}={_value(value, name in angles)}"
        for name, value in given.items()
        if name not in first
    ]
    line = f"{cls.__name__}({', '.join(parts)})"
    if len(line) <= WIDTH - 2:
        return line
    return "\n".join([f"{cls.__name__}(", *(f"    {part}," for part in parts), ")"])


def _value(value: Any, angle: bool = False) -> str:
    """A value of a model file as Python; plain angles of files are in degrees."""
    if isinstance(value, bool):
        return str(value)
    if isinstance(value, (int, float)):
        return f'"{value} deg"' if angle and value else repr(value)
    if isinstance(value, list):
        return f"[{', '.join(_value(part) for part in value)}]"
    if not isinstance(value, dict):
        return json.dumps(value, ensure_ascii=False)
    if "body" in value and "point" in value:
        place = json.dumps(value["body"]), _value(value["point"])
        return f"Marker({', '.join(place)}, angle={_value(value['angle'], True)})"
    if "factor" in value:
        parts = [f"{key}={_value(part)}" for key, part in value.items() if key != "factor"]
        return f"CouplingTerm({value['factor']}, {', '.join(parts)})"
    (kind,) = value if len(value) == 1 else (None,)
    if kind in LAWS:
        return _law(kind, value[kind])
    if kind == "dwell":
        return f"laws.Dwell({_value(value[kind])})"
    parts = [f"{json.dumps(key)}: {_value(part)}" for key, part in value.items()]
    return f"{{{', '.join(parts)}}}"


def _law(kind: str, given: Any) -> str:
    name = f"laws.{LAWS[kind].__name__}"
    if not isinstance(given, dict):
        return f"{name}({_value(given)})"
    return f"{name}({', '.join(f'{key}={_value(part)}' for key, part in given.items())})"


#: Designs whose transmission angle is smaller somewhere in the cycle are not asked for [rad].
LEAST_TRANSMISSION = math.radians(30.0)
#: Draws for every exercise, before it is given up.
DRAWS = 200
#: Numbers between both bounds are multiples of a round step; there are at least so many steps.
STEPS = 10
#: Positions are multiples of so many degrees.
DEGREES = 5
#: Instants of a revolution at which a design must close.
REVOLUTION_INSTANTS = 73


@dataclass(frozen=True)
class Exercise:
    """One design at one position, solved.

    Attributes
    ----------
    values : dict
        What was drawn, by parameter, as text with its unit.
    position : str
        Where the driver stands, as "60°"; empty where the model gives the instant.
    run : Solution
        Of kinetostatics, of that position alone.
    transmission : float or None
        The least transmission angle of the cycle [rad], where a loop has one.

    Examples
    --------
    >>> import mbody
    >>> from mbody.teaching import new_model
    >>> make = lambda values: mbody.from_toml(new_model("fourbar"), parameters=values)
    >>> sheet = exercises(make, {"a": ("30 mm", "50 mm")}, 1, seed=7)
    >>> list(sheet.exercises[0].values)
    ['a']
    """

    values: dict[str, str]
    position: str
    run: Solution
    transmission: float | None

    @property
    def solution(self) -> Derivation:
        """All equations, in symbols and with numbers."""
        return derivation(self.run)


@dataclass(frozen=True)
class ExerciseSheet:
    """Exercises with their sheet and key.

    Attributes
    ----------
    exercises : tuple of Exercise
    questions, key : ReportDocument
        The sheet for students, with a figure to scale of each, and the worked key.

    Examples
    --------
    >>> import mbody
    >>> from mbody.teaching import new_model
    >>> make = lambda values: mbody.from_toml(new_model("fourbar"), parameters=values)
    >>> len(exercises(make, {"a": ("30 mm", "50 mm")}, 2, seed=7).exercises)
    2
    """

    exercises: tuple[Exercise, ...]
    questions: ReportDocument
    key: ReportDocument

    def sheet(self, folder: str) -> str:
        """The questions in Markdown; their figures are named in that folder."""
        return markdown(self.questions, folder)

    def worked(self) -> str:
        """The key in Markdown."""
        return markdown(self.key, "")

    def save_figures(self, folder: str | os.PathLike[str]) -> list[str]:
        """Write the figures as SVG into a folder, which is made; their paths.

        Raises
        ------
        ModelError
            Where they cannot be written.
        """
        try:
            Path(folder).mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise ModelError(
                f"cannot make the folder '{folder}' for the figures ({error.strerror})"
            ) from None
        files = []
        for picture in self.questions.pictures:
            files.append(str(Path(folder) / f"{picture.name}.svg"))
            with writing(files[-1], binary=True) as file:
                file.write(content_of(picture.figure, "svg"))
        return files


def exercises(
    make: Callable[[Mapping[str, str]], Mechanism],
    vary: Mapping[str, tuple[str, str]],
    count: int = 1,
    seed: int = 0,
) -> ExerciseSheet:
    """Draw designs with round numbers that can be built, and ask for their motion and forces.

    A design is kept where its loops close, over the whole revolution if the driver of the first
    design makes one, and where no transmission angle is less than 30 deg.

    Parameters
    ----------
    make : callable
        The mechanism with other values of some parameters, by name as text.
    vary : mapping of name to (low, high)
        Bounds of what is drawn, as text: "4", "40 mm"; one unit for both.
    count : int
        How many.
    seed : int
        The same seed makes the same sheet.

    Raises
    ------
    ModelError
        For bounds that are no numbers or the wrong way round, a count that is not positive, and
        where too few of the drawn designs can be built.

    Examples
    --------
    >>> import mbody
    >>> from mbody.teaching import new_model
    >>> text = new_model("fourbar")
    >>> make = lambda values: mbody.from_toml(text, parameters=values)
    >>> sheet = exercises(make, {"a": ("30 mm", "50 mm"), "c": ("70 mm", "90 mm")}, 2, seed=7)
    >>> [one.values for one in sheet.exercises] == [
    ...     one.values for one in exercises(make, {"a": ("30 mm", "50 mm"),
    ...     "c": ("70 mm", "90 mm")}, 2, seed=7).exercises]
    True
    """
    count = whole_number("exercises: count", count)
    bounds = {name: _Bounds.of(name, *ends) for name, ends in vary.items()}
    if not bounds:
        raise ModelError("exercises: nothing differs between them: give a parameter to vary")
    draw_from, first = random.Random(seed), make({})
    revolves, seen, found = _revolves(first), set(), []
    cycles: dict[tuple[str, ...], Solution | None] = {}
    for _ in range(DRAWS * count):
        values = {name: one.drawn(draw_from) for name, one in bounds.items()}
        degrees = DEGREES * draw_from.randrange(360 // DEGREES)
        own = tuple(values.values())
        if (key := (*own, degrees) if revolves else own) in seen:
            continue
        seen.add(key)
        if own not in cycles:
            cycles[own] = _cycle(make(values), revolves)
        if (one := _built(cycles[own], values, degrees, revolves)) is not None:
            found.append(one)
        if len(found) == count:
            return ExerciseSheet(tuple(found), _questions(first, found), _key(first, found))
    raise ModelError(
        f"exercises: of {len(seen)} drawn designs {len(found)} can be built"
        f"{' and turned' if revolves else ''} with a transmission angle of at least 30 deg, "
        f"{count} are wanted: vary within other bounds"
    )


@dataclass(frozen=True)
class _Bounds:
    """Round numbers from one bound to the other."""

    low: float
    high: float
    step: float
    unit: str

    @classmethod
    def of(cls, name: str, low: str, high: str) -> _Bounds:
        ends = [
            re.fullmatch(r"\s*([-+]?[\d.]+(?:e[-+]?\d+)?)\s*(.*?)\s*", text) for text in (low, high)
        ]
        try:
            values = [float(end[1]) for end in ends if end]
        except ValueError:
            values = []
        units = {end[2] for end in ends if end and end[2]}
        if len(values) < 2 or len(units) > 1:
            raise ModelError(
                f"exercises: '{name}' must vary from one number to another of the same unit, as "
                f"in 40:60 or 40 mm:60 mm, not {low!r} to {high!r}",
                name,
            )
        if not values[0] < values[1]:
            raise ModelError(
                f"exercises: '{name}' varies from {low} to {high}: give the lower bound first", name
            )
        low_value, high_value = values
        unit = next(iter(units), "")
        return cls(low_value, high_value, _step(high_value - low_value), unit)

    def drawn(self, source: random.Random) -> str:
        """A multiple of the step between both bounds, with its unit."""
        first, last = (
            math.ceil(self.low / self.step - ROUND_NUMBER_SLACK),
            math.floor(self.high / self.step + ROUND_NUMBER_SLACK),
        )
        value = number(source.randint(first, last) * self.step)
        return f"{value} {self.unit}".strip()


def _step(span: float) -> float:
    """1, 2 or 5 times a power of ten, the greatest that divides a span into enough steps.

    >>> _step(20.0), _step(2.0)
    (2.0, 0.2)
    """
    size = 10.0 ** math.floor(math.log10(span / STEPS))
    return max(
        part * size
        for part in (1.0, 2.0, 5.0)
        if part * size * STEPS <= span * (1 + ROUND_NUMBER_SLACK)
    )


def _revolves(machine: Mechanism) -> bool:
    """Whether the driver of the first design makes whole revolutions."""
    if len(machine.drivers) != 1 or not machine.drivers[0].angular:
        return False
    try:
        kinematics(machine, turn=True, instants=REVOLUTION_INSTANTS)
    except (ModelError, SolveError):
        return False
    return True


def _cycle(machine: Mechanism, revolves: bool) -> Solution | None:
    """The revolution of a design, or its first instant, where it can be built."""
    try:
        if revolves:
            cycle = kinematics(machine, turn=True, instants=REVOLUTION_INSTANTS)
        else:
            cycle = analyse_at(machine, "kinetostatics", machine.ask).take([0])
    except SolveError:
        return None
    least = least_transmission(cycle)
    small = least is not None and least < LEAST_TRANSMISSION
    return None if small or cycle.doubts else cycle


def _built(
    cycle: Solution | None, values: dict[str, str], degrees: int, revolves: bool
) -> Exercise | None:
    """The exercise, where the design can be built."""
    if cycle is None:
        return None
    least = least_transmission(cycle)
    if not revolves:
        return Exercise(values, "", cycle, least)
    machine = cycle.mechanism
    body = machine.drivers[0].bodies[1]
    try:
        run = analyse_at(machine, "kinetostatics", Instants(at={body: [f"{degrees} deg"]}))
    except SolveError:
        return None
    return None if run.doubts else Exercise(values, f"{degrees}°", run, least)


def least_transmission(run: Solution) -> float | None:
    """The least transmission angle over the instants of a result [rad]: of loops of four links the
    acute angle between coupler and output link, or between the rod and the normal of the guide.

    Examples
    --------
    >>> import math, mbody
    >>> run = mbody.kinematics(mbody.makers.four_bar(1, 3, 2, 3.5, start=0.0))
    >>> cosine = (9 + 4 - 1 - 3.5**2 + 7) / 12
    >>> math.isclose(least_transmission(run), math.acos(cosine))
    True
    """
    driven = {driver.bodies[1] for driver in run.mechanism.drivers}
    found: list[float] = []
    for loops in loops_of_instants(run, range(len(run))):
        for loop in loops:
            ground = "ground" in loop.bodies
            if len(loop.bodies) != 4 or not ground or not driven & {*loop.bodies}:
                continue
            free = [
                vector
                for _, vector in loop.vectors
                if vector.kind == "link" and vector.body not in driven | {"ground"}
            ]
            slides = [vector for _, vector in loop.vectors if vector.kind == "slide"]
            if len(free) == 2 and not slides:
                found.append(_acute(free[0].angle - free[1].angle))
            elif len(free) == 1 and len(slides) == 1 and slides[0].body == "ground":
                found.append(_acute(free[0].angle - slides[0].angle - 0.5 * math.pi))
    return min(found) if found else None


def _acute(angle: float) -> float:
    """The acute angle of two lines."""
    return float(abs(np.arcsin(np.sin(angle))))


def _questions(first: Mechanism, found: list[Exercise]) -> ReportDocument:
    subject = Subject(found[0].run, [0], first)
    names = ", ".join(f"`{name}`" for name in found[0].values)
    same = f"All exercises have these numbers but for {names}, which each gives."
    given: list[Block] = [Text(same)]
    given += [_without(block, found[0].values) for block in inputs(subject)]
    chapters = [Chapter("given", "The mechanism", given)]
    for n, one in enumerate(found, 1):
        chapters.append(Chapter(f"exercise-{n}", f"Exercise {n}", _question(n, one)))
    return ReportDocument(f"Exercises: {first.name}", [("Exercises", str(len(found)))], chapters)


def _without(block: Block, values: Mapping[str, str]) -> Block:
    """A table of parameters without those that differ."""
    if not isinstance(block, Grid) or block.title != "Parameters":
        return block
    names = block.columns[0].cells
    kept = [n for n, name in enumerate(names) if name not in values]
    columns = [replace(one, cells=[one.cells[n] for n in kept]) for one in block.columns]
    return Grid(block.title, columns)


def _with_unit(one: Exercise, name: str, value: str) -> str:
    """A plain number with its unit, that of the model."""
    known = one.run.mechanism.parameters.scope().names.get(name)
    if not re.fullmatch(r"[-+\d.e]+", value) or known is None or known.dimension is None:
        return value
    return f"{value} {one.run.mechanism.units.of(known.dimension)}"


def _question(n: int, one: Exercise) -> list[Block]:
    machine = one.run.mechanism
    rows = [(name, _with_unit(one, name, value)) for name, value in one.values.items()]
    if one.position:
        rows.append((f"angle of {machine.drivers[0].bodies[1]}", one.position))
    asked = [
        "Write the closure of every loop and find the angles of all links.",
        "Find all angular velocities and accelerations.",
    ]
    if any(mass for mass in one.run.system.mass[:, 0]) or machine.loads:
        efforts = ", ".join(driver.name for driver in machine.drivers)
        asked.append(f"Find the forces in all joints, and what these must give: {efforts}.")
    figure = draw(one.run)
    return [
        Grid(
            "Given:",
            [
                Column("what", [name for name, _ in rows], text=True),
                Column("value", [value for _, value in rows]),
            ],
        ),
        Picture(f"exercise_{n}", figure, f"Exercise {n}, to scale."),
        Items(asked),
    ]


def _key(first: Mechanism, found: list[Exercise]) -> ReportDocument:
    chapters = []
    for n, one in enumerate(found, 1):
        worked = one.solution
        rows = [f"{name} = {_with_unit(one, name, value)}" for name, value in one.values.items()]
        if one.position:
            rows.append(f"angle of {first.drivers[0].bodies[1]} = {one.position}")
        words = f"{', '.join(rows)}."
        if one.transmission is not None:
            least = number(round(math.degrees(one.transmission), 2))
            words += f" The least transmission angle of the cycle is {least}°."
        left = f"{max(worked.gap, worked.residual):.1e}"
        words += f" What is left over is at most {left} of the greatest term."
        chapters.append(Chapter(f"exercise-{n}", f"Exercise {n}", [Text(words)]))
        chapters += [
            Chapter(f"{n}-{part.key}", f"{n}: {part.title}", part.blocks)
            for part in worked.document.chapters
        ]
    return ReportDocument(f"Key: {first.name}", [("Exercises", str(len(found)))], chapters)
