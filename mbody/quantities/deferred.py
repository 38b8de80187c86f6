"""Deferred evaluation: find the formulas in a description and substitute their values."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterable, Iterator
from typing import Any

from mbody.quantities.formula import Formula

__all__ = ["formulas_in", "is_pending", "substituted"]


def formulas_in(value: Any, name: str = "") -> Iterator[tuple[str, Formula]]:
    """Every formula in a value (a number, a point, a law, an element), with its dotted name."""
    if isinstance(value, Formula):
        yield name, value
        return
    parts: Iterable[tuple[Any, Any]] = ()
    if isinstance(value, (tuple, list)):
        parts = enumerate(value)
    elif isinstance(value, dict):
        parts = value.items()
    elif dataclasses.is_dataclass(value) and not isinstance(value, type):
        parts = ((field.name, getattr(value, field.name)) for field in dataclasses.fields(value))
    for key, part in parts:
        if type(part) is float:
            continue  # the common case, so that long tables are searched fast
        yield from formulas_in(part, f"{name}.{key}")


def is_pending(value: Any) -> bool:
    """Whether a value contains formulas, which only a mechanism can evaluate."""
    return next(formulas_in(value), None) is not None


def substituted(value: Any, instead: Callable[[Formula], Any]) -> Any:
    """The value with every formula replaced by ``instead(formula)``; itself where it has none."""
    if isinstance(value, Formula):
        return instead(value)
    if isinstance(value, (tuple, list)):
        parts = [substituted(part, instead) for part in value]
        same = all(new is old for new, old in zip(parts, value, strict=True))
        return value if same else type(value)(parts)
    if isinstance(value, dict):
        pairs = {key: substituted(part, instead) for key, part in value.items()}
        return pairs if any(pairs[key] is not value[key] for key in pairs) else value
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        fields = {field.name: getattr(value, field.name) for field in dataclasses.fields(value)}
        made = {name: substituted(part, instead) for name, part in fields.items()}
        changed = {name: part for name, part in made.items() if part is not fields[name]}
        return dataclasses.replace(value, **changed) if changed else value
    return value
