"""Commented model files to begin with."""

from __future__ import annotations

import difflib
import re
from collections.abc import Sequence
from pathlib import Path

from mbody.errors import ModelError
from mbody.files.model import from_toml
from mbody.model.element import listed
from mbody.quantities import FormulaError, Scope, read
from mbody.quantities.units import DIMENSIONS, unit_system

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
