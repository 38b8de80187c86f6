"""Reference of the kinds of elements: fields with units and meaning, and an example."""

from __future__ import annotations

import dataclasses
import difflib
import json
import re
import textwrap
import tomllib
from dataclasses import dataclass
from typing import Any

from mbody.core.other_words import meant
from mbody.errors import ModelError
from mbody.files.model.fields import field_of_law
from mbody.files.model.problems import LAWS, SECTIONS, also_written, written_fields
from mbody.files.model.schema import codec_of, described
from mbody.laws import Law
from mbody.model.body import Body
from mbody.model.element import Element, listed
from mbody.quantities.units import NUMBER
from mbody.summaries.text_table import WIDTH, paragraph

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
