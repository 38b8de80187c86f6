"""Read a model file: bytes with limits, then TOML or JSON, then the schema, then a mechanism.

Nothing in a file is executed, and no other file is opened than tables that it names below
its own folder.
"""

from __future__ import annotations

import json
import os
import re
import stat
import tomllib
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any

from mbody.analysis.driven.driven import check_instants
from mbody.errors import ModelError, brief
from mbody.files.model import study_tables
from mbody.files.model.fields import REFUSED, FileReading
from mbody.files.model.problems import (
    ENOUGH,
    SECTIONS,
    TEXT_ATTRIBUTE,
    TEXTS,
    KeyPath,
    Limits,
    Problem,
    limits_of,
    raise_all,
)
from mbody.files.model.schema import file_table
from mbody.model.body import Body
from mbody.model.element import Element, listed
from mbody.model.loads import Gravity
from mbody.model.mechanism import Mechanism
from mbody.model.model_notes import compiled_state, compiled_stop
from mbody.model.simulation import Instants, Measure, OptimizationTask, Question
from mbody.quantities import FormulaError, read
from mbody.quantities.evaluate import dimension_text
from mbody.quantities.formula import (
    Number,
    Parameters,
    parameter_value,
    plain_otherwise,
    with_unit_of,
)
from mbody.quantities.parse import MAX_CHARACTERS
from mbody.quantities.units import Dimension, UnitSystem, unit_system

# -- Ambiguities of a model file: plain numbers, and omitted entries ---------------------------


def suspect_values(data: Mapping[str, Any], mechanism: Mechanism) -> tuple[str, ...]:
    """Sentences about a file that was read, for the notes of its mechanism."""
    degrees = data.get("angle", "deg") == "deg"
    return (
        *_laws(data, mechanism, degrees),
        *_without_law(data, mechanism),
    )


def _tables(data: Mapping[str, Any], section: str) -> Iterator[tuple[str, Mapping[str, Any]]]:
    entries = data.get(section)
    if isinstance(entries, Mapping):
        yield from ((k, v) for k, v in entries.items() if isinstance(v, Mapping))


def _laws(data: Mapping[str, Any], mechanism: Mechanism, degrees: bool) -> Iterator[str]:
    """Polynomials of an angle whose coefficients are in degrees and in radians."""
    for name, entry in _tables(data, "drivers"):
        law = entry.get("law")
        given = law.get("polynomial") if isinstance(law, Mapping) else None
        if not (degrees and isinstance(given, list) and "angle" in entry):
            continue
        plain = [isinstance(c, (int, float)) and c != 0 for c in given]
        if len(plain) > 1 and plain[0] and any(plain[1:]):
            rate = next(c for c, own in zip(given[1:], plain[1:], strict=True) if own)
            yield (
                f"'{name}': of polynomial = {given} the first number is an angle, {given[0]:g} "
                f"deg, and the others are rates, as {rate:g} rad/{mechanism.units.time}: write "
                "them with their units"
            )


def _without_law(data: Mapping[str, Any], mechanism: Mechanism) -> Iterator[str]:
    """Drivers that do not move because they have no law."""
    instants = str(data.get("ask") or "")
    for name, entry in _tables(data, "drivers"):
        driver: Any = mechanism[name]
        if "law" in entry or driver.distances():
            continue
        if name in instants or driver.bodies[1] in instants:
            continue  # the file gives the positions at which it is analysed
        zero = "0 deg" if driver.angular else f"0 {mechanism.units.length}"
        yield (
            f"driver '{name}' has no law: it keeps '{driver.bodies[1]}' at {zero}; give "
            "a law, or the positions to analyse"
        )


# -- Mechanism of a checked model; every refusal is kept with its place ------------------------


def build(given: dict[str, Any]) -> tuple[Mechanism | None, list[Problem]]:
    """The mechanism of a checked model, and what was refused on the way."""
    problems: list[Problem] = []
    ground = given.get("ground", {})
    heads = ("units", "g", "parameters", "curves", "source", "note")
    try:
        mechanism = Mechanism(
            given.get("name", "mechanism"),
            ground=ground.get("points"),
            ground_shapes=ground.get("shapes"),
            **{key: given[key] for key in heads if key in given},
        )
    except ModelError as error:
        return None, [_framed(given, error)]
    problems += _shown(given.get("output_units", {}), mechanism)
    missing: set[str] = set()
    waiting = dict(given.get("quantities", {}))
    coming = set(waiting).union(*(given.get(key, {}) for key in ("bodies", "states", *SECTIONS)))

    def add_ready() -> None:
        """Add the quantities that name nothing that is still to come."""
        for name, text in list(waiting.items()):
            if not (_owners(text) & coming) - {name} and name in waiting:
                from mbody.model.states import Quantity

                del waiting[name]
                add(("quantities", name), Quantity, {"formula": text})

    def add(path: KeyPath, cls: type[Element], fields: dict[str, Any]) -> None:
        entered(path, cls, fields)
        coming.discard(str(path[-1]))
        add_ready()

    def entered(path: KeyPath, cls: type[Element], fields: dict[str, Any]) -> None:
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
            if _names_one(fields, missing):
                missing.add(name)
                return
            text = _unnamed(str(error), name).removeprefix("formula: ")
            field, _, rest = text.partition(" ")
            key = field.removesuffix(":")  # of a file, but for "value", which the kind's word has
            own = key in fields and key != "value" and (key != field or rest.startswith("is "))
            problems.append(Problem((*path, key), rest) if own else Problem(path, text))
        missing.add(name)

    for name, value in given.get("inputs", {}).items():
        from mbody.model.states import Input

        add(("inputs", name), Input, {"value": value})
    add_ready()
    for name, body in given.get("bodies", {}).items():
        add(("bodies", name), Body, body)
    for name, state in given.get("states", {}).items():  # clutches, drivers and loads measure them
        from mbody.model.states import State

        add(("states", name), State, state)
    for section in SECTIONS:
        for name, (cls, arguments) in given.get(section, {}).items():
            add((section, name), cls, arguments)
    coming.clear()
    add_ready()
    if "gravity" in given:
        add(("gravity",), Gravity, given["gravity"])
    if not problems:
        problems += _formulas(mechanism, mechanism.described_states, compiled_state)
    problems += _studies(given, mechanism, missing)
    if not problems:
        problems += _formulas(mechanism, mechanism.stops, compiled_stop)
    return mechanism, problems


def _owners(formula: Any) -> set[str]:
    """What a formula names, without the quantities of it."""
    try:
        return {name.partition(".")[0] for name in read(str(formula), None, curves=True).names}
    except FormulaError:  # which is refused where it is added
        return set()


def _shown(given: dict[str, str], mechanism: Mechanism) -> list[Problem]:
    """Errors in units of results, which the mechanism is given."""
    problems = []
    for name, unit in given.items():
        try:
            mechanism.output_units = mechanism.output_units | {name: unit}
        except ModelError as error:
            text = str(error).removeprefix("output units: ").removeprefix(f"{name}: ")
            problems.append(Problem(("output_units", name), text))
    return problems


def _formulas(mechanism: Mechanism, elements: Iterable[Any], compiled: Any) -> list[Problem]:
    """Errors in rates of states and in stops, which may refer to anything in the file."""
    problems = []
    for one in elements:
        try:
            compiled(mechanism, one)
        except ModelError as error:
            state = one.role == "state"
            path = ("states", one.name, "rate") if state else ("contacts", one.name)
            text = _unnamed(str(error), one.name).removeprefix("rate: ")
            problems.append(Problem(path, text.removeprefix(f"stop '{one.name}': ")))
    return problems


def _framed(given: dict[str, Any], error: ModelError) -> Problem:
    """A problem of the mechanism itself, with the key that it comes from."""
    text, element = str(error), error.element
    message = text.removeprefix(f"'{element}': ")
    if element in given.get("curves", ()):
        return Problem(("curves", element), text.removeprefix(f"curve '{element}': "))
    if element in given.get("parameters", ()):
        return Problem(("parameters", element), text)
    for key, mark in (("units", "unit system"), ("g", ": g"), ("ground", "'ground'")):
        if mark in text:
            return Problem((key,), message)
    return Problem((), text)


def _bodies(element: Element) -> set[str]:
    """The bodies that an element refers to."""
    own = {marker.body for marker in element.places().values()}
    return own.union(getattr(element, "bodies", ()))


def _unnamed(text: str, name: str) -> str:
    """The sentence without the name that is before it already."""
    return text.removeprefix(f"'{name}': ").removeprefix(f"'{name}' ")


#: How sentences about studies begin, which the key of the file says.
_ABOUT = {"simulate": "simulation: ", "solve": "question: ", "measures": "measure: "}


def _keep_study(given: dict[str, Any], machine: Mechanism, key: str, name: str) -> None:
    """Give a mechanism what a file says of one study; what is no part of the description, which is
    the same with other tasks, is kept beside it.
    """
    value = given[key][name] if name else given[key]
    fields = study_tables.STUDIES[key].settled(value, machine, given.get("angle", "deg"))
    if key == "measures":
        from mbody.solution.measures import check_measure

        measure = Measure(fields) if isinstance(fields, str) else Measure(**fields)
        for one in machine.quantities:
            one.refuse_measure((name,))
        machine.measures[name] = measure
        check_measure(machine, measure.history)
    elif key == "ask":
        machine.ask = Instants(**fields)
        check_instants(machine, machine.ask)
    elif key == "simulate":
        from mbody.analysis.initial.initial_state import check_simulation
        from mbody.model.simulation import SimulationSettings

        machine.simulation = SimulationSettings(**fields)
        check_simulation(machine, machine.simulation)
    elif key == "solve":
        from mbody.analysis.inverse.conditions import check_question

        machine.questions[name] = Question(**fields)
        check_question(machine, machine.questions[name])
    elif key == "optimize":
        kept = vars(machine).setdefault(study_tables.OPTIMIZATIONS_ATTRIBUTE, {})
        kept[name] = OptimizationTask(**fields)
    elif key == "fit":
        vars(machine)[study_tables.FIT_ATTRIBUTE] = study_tables.FitSettings(**fields)
    else:
        vars(machine)[study_tables.REPORT_ATTRIBUTE] = study_tables.ReportSettings(**fields)


def _names_one(given: Any, names: set[str]) -> bool:
    """Whether something in a file has one of the names in its text."""
    text = repr(given)
    return any(re.search(rf"(?<![\w-]){re.escape(one)}(?![\w-])", text) for one in names)


def _studies(given: dict[str, Any], mechanism: Mechanism, missing: set[str]) -> list[Problem]:
    """Errors in what is asked; of what names an element that is `missing` nothing is said."""
    problems: list[Problem] = []
    for key in study_tables.STUDIES:
        found = given.get(key)
        if found is None:
            continue
        for name in found if key in ("measures", "solve", "optimize") else ("",):
            if len(problems) >= ENOUGH:
                return problems
            try:
                _keep_study(given, mechanism, key, name)
            except ModelError as error:
                if _names_one(found[name] if name else found, missing):
                    continue
                text = str(error).removeprefix(_ABOUT.get(key, f"{key}: "))
                problems.append(Problem((key, name) if name else (key,), text))
    return problems


DEEPEST = 30  # tables in tables
LONGEST_KEY = 20  # parts of a dotted key
LONGEST_NUMBER = 2000  # bits of a whole number: more than a double can have

_SIGNS = re.compile(r"[-+*/^(,·−²³]")
ENDLESS = "a whole number has very many digits, more than a computer holds"

_PART = r"""(?:[\w-]++|"(?:[^"\\\n]++|\\.)*+"|'[^'\n]*+')"""
_KEYS = re.compile(
    rf"{TEXTS}|(?P<long>{_PART}(?:[ \t]*+\.[ \t]*+{_PART}){{{LONGEST_KEY}}})|{_PART}", re.DOTALL
)


class _Refused(ValueError):
    """An invalid file; the message follows its name."""


def load(
    path: str | os.PathLike[str],
    parameters: Mapping[str, Number] | None = None,
    *,
    limits: Limits | None = None,
) -> Mechanism:
    """The mechanism of a model file, TOML or (by its ending) JSON.

    Parameters
    ----------
    path : str or Path
        Of the file.
    parameters : mapping, optional
        Other values for parameters of the file, numbers or text.
    limits : Limits, optional
        How large the file may be; by default 6 MB, or what ``MBODY_LIMITS`` makes of it.

    Raises
    ------
    ModelError
        When it cannot be read, or with every line that is wrong.

    Notes
    -----
    What `save` has written is read with the same limits. ``mbody schema`` prints what is allowed in
    a file.

    Examples
    --------
    >>> import mbody, pathlib, tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     file = pathlib.Path(folder, "mine.toml")
    ...     mbody.save(mbody.makers.slider_crank("40 mm", "120 mm"), file)
    ...     load(file).name
    'slider-crank'
    """
    file = Path(path)
    text = text_of(file, limits)
    is_json = file.suffix.lower() == ".json"
    return _mechanism_of(text, is_json, parameters, _short(file.name), file.parent, limits)


def from_toml(
    text: str,
    *,
    parameters: Mapping[str, Number] | None = None,
    name: str = "model",
    folder: Path | None = None,
    limits: Limits | None = None,
) -> Mechanism:
    """The mechanism of a model that is text in TOML.

    Parameters
    ----------
    text : str
        What a model file contains.
    parameters : mapping, optional
        Other values for parameters of the model.
    name : str
        What errors call it.
    folder : Path, optional
        Where tables that it names lie; without it none are read.
    limits : Limits, optional
        How large it may be.

    Raises
    ------
    ModelError
        With every line that is wrong.

    >>> machine = from_toml('''
    ... [bodies.arm]
    ... mass = "2 kg"
    ... [joints]
    ... O = { revolute = ["ground", "arm"] }
    ... ''')
    >>> machine["arm"].mass
    2.0
    """
    return _mechanism_of(text, False, parameters, name, folder, limits)


def from_json(
    text: str, *, name: str = "model", folder: Path | None = None, limits: Limits | None = None
) -> Mechanism:
    """The mechanism of a model that is text in JSON; parameters and errors as of `from_toml`."""
    return _mechanism_of(text, True, None, name, folder, limits)


def _mechanism_of(
    text: str,
    is_json: bool,
    parameters: Mapping[str, Number] | None,
    name: str,
    folder: Path | None,
    limits: Limits | None,
) -> Mechanism:
    if not isinstance(text, str):
        raise ModelError(f"{name}: a model is text, not {brief(text)}")
    most = limits_of(limits)
    if (sentence := most.over(f"{name}: it", size=len(text))) is not None:
        raise ModelError(sentence)
    data = _parsed(text, is_json, name, most)
    notes = _set_parameters(data, parameters, name) if parameters else []
    made = built(data, text, is_json=is_json, name=name, folder=folder)
    made.file_notes = (*notes, *suspect_values(data, made))
    if not is_json:
        vars(made)[TEXT_ATTRIBUTE] = text
    return made


def built(
    data: dict[str, Any],
    text: str = "",
    *,
    is_json: bool = False,
    name: str = "model",
    folder: Path | None = None,
) -> Mechanism:
    """The mechanism of tables that are read already; `text` is where they stood, for errors."""
    at = FileReading("rad" if data.get("angle") == "rad" else "deg", folder)
    found = file_table().read(data, (), at)
    if found is REFUSED:
        raise_all(at.problems, text, is_json, name, at.count)
    mechanism, problems = build(found)
    raise_all(problems, text, is_json, name)
    assert mechanism is not None  # else there was a problem
    return mechanism


def text_of(file: Path, limits: Limits | None = None) -> str:
    """The text of an ordinary file of bounded size."""
    name, most = _short(str(file)), limits_of(limits)
    try:
        kind, size = os.stat(file).st_mode, os.stat(file).st_size
        raw = b""
        if stat.S_ISREG(kind) and size <= most.size:
            with file.open("rb") as stream:
                raw = stream.read(size + 1)
    except FileNotFoundError:
        raise ModelError(f"there is no file '{name}'") from None
    except PermissionError:
        raise ModelError(f"the file '{name}' may not be read: change its permissions") from None
    except (OSError, ValueError) as error:
        why = getattr(error, "strerror", None) or "no file has such a name"
        raise ModelError(f"the file '{name}' cannot be read: {why}") from None
    if stat.S_ISDIR(kind):
        raise ModelError(f"'{name}' is a folder: name a model file in it")
    if not stat.S_ISREG(kind):
        raise ModelError(f"'{name}' is no ordinary file: give a model file")
    if (sentence := most.over(f"'{name}'", size=max(size, len(raw)))) is not None:
        raise ModelError(sentence)
    try:
        return raw.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise ModelError(
            f"'{name}' is no text: byte {error.start + 1} is not UTF-8; models are TOML or JSON, "
            "files of other programs that `mbody import` reads are text too: save it as UTF-8"
        ) from None


def _short(name: str) -> str:
    """A name for a sentence; what cannot be printed is written out."""
    name = name if name.isprintable() else repr(name)[1:-1]
    name = name if len(name) <= 80 else f"…{name[-77:]}"
    return name.encode(errors="backslashreplace").decode()


def _parsed(text: str, is_json: bool, name: str, limits: Limits) -> dict[str, Any]:
    """The tables of a text."""
    kind = "JSON" if is_json else "TOML"
    try:
        if is_json:
            data = json.loads(text, object_pairs_hook=_unique, parse_constant=_refused)
        else:
            _check_keys(text)
            data = tomllib.loads(text)
        if not isinstance(data, dict):
            raise _Refused(f"a model is a table, not {type(data).__name__}")
        _check_size(data, limits)
    except RecursionError:
        raise ModelError(f"{name}: tables are nested too deep: at most {DEEPEST}") from None
    except (tomllib.TOMLDecodeError, json.JSONDecodeError) as error:
        raise ModelError(f"{name}: it is no {kind}: {_where(error, text)}") from None
    except _Refused as error:
        raise ModelError(f"{name}: {error}") from None
    except ValueError:  # Python's own limit of digits
        raise ModelError(f"{name}: {ENDLESS}") from None
    return data


#: A number and a unit without quotes, as ``speed = 120 rpm``.
_BARE_UNIT = re.compile(r"[=\[,]\s*([-+]?\d[\d.eE+-]*\s*[^\W\d_][\w/*^·²]*)\s*(?=$|[,}\]])")


def _where(error: ValueError, source: str) -> str:
    """The sentence of a parser, with the line first, and what is often meant there."""
    if isinstance(error, json.JSONDecodeError):
        return f"line {error.lineno}: {error.msg[0].lower()}{error.msg[1:]}"
    text = str(error)
    match = re.search(r" \(at (?:line (\d+), column \d+|end of document)\)$", text)
    if match is None:
        return text[:200]
    place = f"line {match[1]}" if match[1] else "at its end"
    reason = text[: match.start()][:160]
    line = source.splitlines()[int(match[1]) - 1] if match[1] else ""
    key = line.partition("=")[0].strip()[:60]
    plain = re.sub(r"""(["']).*?\1|#.*""", "", line)
    if bare := _BARE_UNIT.search(plain):
        return f'{place}: a number with a unit stands in quotes: "{bare[1][:60]}"'
    if re.fullmatch(r"[^=]*=\s*[-+]?\d+,\d+\s*", plain):
        return f"{place}: a number has no comma: decimals stand behind a point, as in 0.5"
    if "overwrite" in reason or "declare" in reason:
        return f"{place}: '{key}' is there a second time, or its table was closed: keep one of them"
    return f"{place}: {reason[0].lower()}{reason[1:]}"


def _check_keys(text: str) -> None:
    """Refuse keys of very many parts, on which a parser of TOML would spend its time."""
    if any(match["long"] for match in _KEYS.finditer(text)):
        raise _Refused(f"a dotted key has more than {LONGEST_KEY} parts")


def _unique(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    found: dict[str, Any] = {}
    for key, value in pairs:
        if key in found:
            raise _Refused(f"the key '{_short(key)}' is given twice in one table: keep one")
        found[key] = value
    return found


def _refused(word: str) -> Any:
    raise _Refused(f"{word} is no number of a model: numbers must be finite")


def _check_size(data: dict[str, Any], limits: Limits) -> None:
    """Refuse tables in tables without end, very many values, and values that nothing can hold."""
    count, signs = 1, 0
    level: list[Any] = [data]
    for _ in range(DEEPEST):
        below: list[Any] = []
        _signs_of(key for table in level if isinstance(table, dict) for key in table)
        for table in level:
            below += table.values() if isinstance(table, dict) else table
        count += len(below)
        signs += _signs_of(value for value in below if isinstance(value, str))
        if any(isinstance(v, int) and v.bit_length() > LONGEST_NUMBER for v in below):
            raise _Refused(ENDLESS)
        level = [value for value in below if isinstance(value, (dict, list))]
    if level:
        raise _Refused(f"tables are nested too deep: at most {DEEPEST}")
    # all is counted first, so that the limits that the sentence names are enough
    if (sentence := limits.over("it", values=count, operations=signs)) is not None:
        raise _Refused(sentence)


def _signs_of(texts: Iterable[str]) -> int:
    """How many signs of formulas texts have; halves of characters, which JSON can write and nothing
    can print, are refused.
    """
    every = list(texts)
    try:
        # all at once: a large model has hundreds of thousands
        "".join(every).encode()
    except UnicodeEncodeError:
        half = next(text for text in every if not _is_encodable(text))
        raise _Refused(f"the text {brief(half)} holds half a character") from None
    return len(_SIGNS.findall("".join(text for text in every if len(text) <= MAX_CHARACTERS)))


def _is_encodable(text: str) -> bool:
    """Whether a text has whole characters only."""
    try:
        text.encode()
    except UnicodeEncodeError:
        return False
    return True


def check_size(data: dict[str, Any], size: int, limits: Limits, name: str) -> None:
    """Refuse what `load` would refuse for its size, before it is written."""
    sentence = limits.over(f"'{name}'", size=size)
    try:
        _check_size(data, limits)
    except _Refused as error:
        sentence = f"'{name}': {error}"
    if sentence is not None:
        raise ModelError(f"{sentence}; else the file could be written but not read")


def _set_parameters(data: dict[str, Any], parameters: Mapping[str, Any], name: str) -> list[str]:
    """Put other values in the place of parameters of the model; a plain number for one that has a
    unit is in the file's unit of what that measures, and a note says so where the file has it in
    another.
    """
    notes = []
    table = data.get("parameters")
    known = table if isinstance(table, dict) else {}
    before, units = _dimensions(data)
    for key, value in parameters.items():
        if key not in known:
            there = f"there are: {listed(known, 12)}" if known else "there are none"
            hint = ""
            if "." in str(key):
                hint = ": numbers of elements are changed by sweep and optimize"
            raise ModelError(
                f"{name}: there is no parameter '{_short(str(key))}' ({there}){hint}", key
            )
        try:
            parameter_value(key, value)
        except ModelError as error:
            raise ModelError(f"{name}: {error}", key) from None
        dimension = before.get(key)
        if dimension is not None:
            angle = str(data.get("angle", "deg"))
            with_unit = with_unit_of(value, dimension, units, angle)
            if with_unit is not value and value not in (0, "0"):
                notes.append(plain_otherwise(key, known[key], units, angle))
            value = with_unit
        known[key] = value
    after, _ = _dimensions(data)
    for key in parameters:
        if key in before and key in after and before[key] != after[key]:
            raise ModelError(
                f"{name}: parameter '{key}' is {dimension_text(before[key])}, and "
                f"{brief(known[key])} is {dimension_text(after[key])}: give what measures the same",
                key,
            )
    return [one for one in notes if one]


def _dimensions(data: Mapping[str, Any]) -> tuple[dict[str, Dimension], UnitSystem]:
    """Dimensions of the parameters that have units, as the file has them; what is wrong in it is
    reason where it is read.
    """
    try:
        units = unit_system(data.get("units", "SI"))
        names = Parameters(data["parameters"], units).scope().names
    except (ModelError, KeyError):
        return {}, unit_system("SI")
    return {name: v.dimension for name, v in names.items() if v.dimension is not None}, units
