"""Pages of elements: what `mbody explain` knows of each, as tables."""

from __future__ import annotations

import dataclasses
import itertools

from mbody.files.model.problems import LAWS, SECTIONS
from mbody.teaching import ElementReference, FieldReference, element_reference

__all__ = ["text"]


def text(section: str) -> str:
    """All kinds of a table of model files, of "laws" or of "bodies"."""
    if section == "bodies":
        kinds = ["body"]
    else:
        kinds = list(LAWS if section == "laws" else SECTIONS[section])
    found = [one for kind in kinds for one in element_reference(kind) if one.section == section]
    return "\n\n".join(map(_entry, found))


def _entry(one: ElementReference) -> str:
    lines = [f"## {one.cls.__name__}", "", f"In model files: `{one.kind}`.", ""]
    for part in one.about.split("\n\n"):
        lines += [f"    {part.strip()}" if part.startswith("  ") else escaped(part), ""]
    if one.fields:
        lines += ["| field | takes | without it | meaning |", "|---|---|---|---|"]
    for names, field in _together(one.fields):
        rest = "needed" if field.needed else field.default or "left out"
        cells = (field.takes, rest, " ".join(field.meaning.split()))
        lines.append(f"| {names} | " + " | ".join(map(escaped, cells)) + " |")
    lines += ["", "```toml", one.file, "```", "", "```python", one.python, "```"]
    if one.quantities:
        words = ", ".join(f"`{name}` ({kind})" for name, kind in one.quantities.items())
        lines += ["", f"A result measures of it {words}."]
    return "\n".join(lines)


def escaped(words: str) -> str:
    """Words of a docstring as Markdown: what is between backticks is code, the rest is words."""
    parts = words.replace("``", "`").split("`")
    if not len(parts) % 2:  # an odd number of backticks is no code
        parts = [words.replace("`", "'")]
    for k in range(0, len(parts), 2):
        for sign in "\\*_[]<>|$":
            parts[k] = parts[k].replace(sign, f"\\{sign}")
    for k in range(1, len(parts), 2):
        parts[k] = "`" + parts[k].replace("|", "\\|") + "`"
    return "".join(parts)


def _together(fields: tuple[FieldReference, ...]) -> list[tuple[str, FieldReference]]:
    """The fields, those of one meaning that follow each other as one."""
    same = itertools.groupby(fields, lambda field: dataclasses.replace(field, name=""))
    return [(", ".join(f"`{one.name}`" for one in group), field) for field, group in same]
