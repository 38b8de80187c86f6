"""Read a model file: bytes with limits, then TOML or JSON, then the schema, then a mechanism.

Nothing that a file says is executed, and no other file is opened than tables that it names below
its own folder.
"""

from __future__ import annotations

import json
import os
import re
import stat
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pydantic

from mbody.elements import listed
from mbody.errors import ModelError
from mbody.formulas.parameters import let_in
from mbody.io.model.build import build
from mbody.io.model.fields import Context
from mbody.io.model.report import raise_all, sentences
from mbody.io.model.schema import json_schema, model
from mbody.mechanism import Mechanism

__all__ = ["LARGEST", "built", "load", "from_text", "text_of"]

LARGEST = 1_000_000  # bytes of a model file
DEEPEST = 30  # tables in tables
LONGEST_KEY = 20  # parts of a dotted key


def load(path: str | os.PathLike[str], parameters: Mapping[str, Any] | None = None) -> Mechanism:
    """The mechanism of a model file, TOML or (by its ending) JSON.

    Parameters
    ----------
    path : str or Path
        Of the file.
    parameters : mapping, optional
        Other values for parameters of the file, numbers or text.

    Raises
    ------
    ModelError
        When it cannot be read, or with every line that is wrong.

    Notes
    -----
    Files of at most 1 MB are read. ``mbody schema`` prints what may stand in them.
    """
    file = Path(path)
    text = text_of(file)
    is_json = file.suffix.lower() == ".json"
    return from_text(
        text, is_json=is_json, parameters=parameters, name=_short(file.name), folder=file.parent
    )


def from_text(
    text: str,
    *,
    is_json: bool = False,
    parameters: Mapping[str, Any] | None = None,
    name: str = "model",
    folder: Path | None = None,
) -> Mechanism:
    """The mechanism of a model that is text.

    Parameters
    ----------
    text : str
        TOML, or JSON.
    is_json : bool
        Which of them.
    parameters : mapping, optional
        Other values for parameters of the model.
    name : str
        What errors call it.
    folder : Path, optional
        Where tables that it names lie; without it none are read.

    Raises
    ------
    ModelError
        With every line that is wrong.

    >>> machine = from_text('''
    ... [bodies.arm]
    ... mass = "2 kg"
    ... [joints]
    ... O = { revolute = ["ground", "arm"] }
    ... ''')
    >>> machine["arm"].mass
    2.0
    """
    if len(text) > LARGEST:
        raise ModelError(
            f"{name}: it has more than {LARGEST // 1_000_000} MB, which no model needs"
        )
    data = _parsed(text, is_json, name)
    if parameters:
        _set(data, parameters, name)
    return built(data, text, is_json=is_json, name=name, folder=folder)


def built(
    data: dict[str, Any],
    text: str = "",
    *,
    is_json: bool = False,
    name: str = "model",
    folder: Path | None = None,
) -> Mechanism:
    """The mechanism of tables that are read already; `text` is where they stood, for errors.

    Raises
    ------
    ModelError
        With everything that is wrong.
    """
    context = Context("rad" if data.get("angle") == "rad" else "deg", folder)
    try:
        given = model().model_validate(data, context=context)
    except pydantic.ValidationError as error:
        found = error.errors(include_url=False)
        raise_all(sentences(found, json_schema(), data), text, is_json, name)
    mechanism, problems = build(given)
    raise_all(problems, text, is_json, name)
    assert mechanism is not None  # else there was a problem
    return mechanism


def text_of(file: Path) -> str:
    """The text of an ordinary file of bounded size.

    Raises
    ------
    ModelError
        When it cannot be read, is too large, or no text.
    """
    name = _short(str(file))
    try:
        kind = os.stat(file).st_mode
        raw = b""
        if stat.S_ISREG(kind):
            with file.open("rb") as stream:
                raw = stream.read(LARGEST + 1)
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
    if len(raw) > LARGEST:
        raise ModelError(f"'{name}' has more than {LARGEST // 1_000_000} MB, which no model needs")
    try:
        return raw.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise ModelError(
            f"'{name}' is no text: byte {error.start + 1} is not UTF-8; models are TOML or JSON"
        ) from None


def _short(name: str) -> str:
    name = name if name.isprintable() else repr(name)[1:-1]
    return name if len(name) <= 80 else f"…{name[-77:]}"


def _parsed(text: str, is_json: bool, name: str) -> dict[str, Any]:
    """The tables of a text."""
    kind = "JSON" if is_json else "TOML"
    try:
        if is_json:
            data = json.loads(text, object_pairs_hook=_unique, parse_constant=_refused)
        else:
            _check_keys(text)
            data = tomllib.loads(text)
    except RecursionError:
        raise ModelError(f"{name}: tables are nested too deep: at most {DEEPEST}") from None
    except (tomllib.TOMLDecodeError, json.JSONDecodeError) as error:
        raise ModelError(f"{name}: it is no {kind}: {_where(error)}") from None
    except ValueError as error:
        raise ModelError(f"{name}: {error}") from None
    if not isinstance(data, dict):
        raise ModelError(f"{name}: a model is a table, not {type(data).__name__}")
    if _deeper(data, DEEPEST):
        raise ModelError(f"{name}: tables are nested too deep: at most {DEEPEST}")
    return data


def _where(error: ValueError) -> str:
    """The sentence of a parser, with the line first."""
    if isinstance(error, json.JSONDecodeError):
        return f"line {error.lineno}: {error.msg[0].lower()}{error.msg[1:]}"
    text = str(error)
    match = re.search(r" \(at (?:line (\d+), column \d+|end of document)\)$", text)
    if match is None:
        return text[:200]
    place = f"line {match[1]}" if match[1] else "at its end"
    told = text[: match.start()][:160]
    return f"{place}: {told[0].lower()}{told[1:]}"


def _check_keys(text: str) -> None:
    """Refuse keys of very many parts, on which a parser of TOML would spend its time."""
    # possessive, and only from where a part begins: the time grows with the length alone
    part = r"(?:(?<![\w-])[\w-]++|\"[^\"\n]*+\"|'[^'\n]*+')"
    if re.search(rf"{part}(?:[ \t]*+\.[ \t]*+{part}){{{LONGEST_KEY}}}", text):
        raise ValueError(f"a dotted key has more than {LONGEST_KEY} parts")


def _unique(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    found: dict[str, Any] = {}
    for key, value in pairs:
        if key in found:
            raise ValueError(f"the key '{_short(key)}' stands twice in one table: keep one")
        found[key] = value
    return found


def _refused(word: str) -> Any:
    raise ValueError(f"{word} is no number of a model: numbers must be finite")


def _deeper(value: Any, levels: int) -> bool:
    """Whether tables and lists are nested deeper than that."""
    if not isinstance(value, (dict, list)):
        return False
    if levels == 0:
        return True
    below = value.values() if isinstance(value, dict) else value
    return any(_deeper(part, levels - 1) for part in below)


def _set(data: dict[str, Any], parameters: Mapping[str, Any], name: str) -> None:
    """Put other values in the place of parameters of the model."""
    table = data.get("parameters")
    known = table if isinstance(table, dict) else {}
    for key, value in parameters.items():
        if key not in known:
            there = f"there are: {listed(known, 12)}" if known else "there are none"
            raise ModelError(f"{name}: there is no parameter '{_short(str(key))}' ({there})", key)
        try:
            let_in(key, value)
        except ModelError as error:
            raise ModelError(f"{name}: {error}", key) from None
        known[key] = value
