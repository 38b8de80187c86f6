"""Deferred evaluation: find the formulas in a description and substitute their values."""

from __future__ import annotations

import dataclasses
import functools
import operator
from collections.abc import Callable, Iterable, Iterator
from types import NoneType
from typing import Any, cast

from mbody.quantities.formula import Formula

__all__ = ["formulas_in", "is_pending", "substituted"]

#: What has no parts, and is no formula.
_PLAIN = frozenset({float, int, bool, str, NoneType})


@functools.cache
def _field_names(kind: Any) -> tuple[str, ...]:
    """Names of the fields of a dataclass; of another class none."""
    return tuple(f.name for f in dataclasses.fields(kind)) if dataclasses.is_dataclass(kind) else ()


@functools.cache
def _parts_of(kind: Any) -> Callable[[Any], tuple[Any, ...]]:
    """What gives the values of all fields of a dataclass; of another class none."""
    names = _field_names(kind)
    if len(names) > 1:
        return operator.attrgetter(*names)
    return lambda value: tuple(getattr(value, name) for name in names)


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
    else:
        parts = ((field, getattr(value, field)) for field in _field_names(cast(Any, type(value))))
    for key, part in parts:
        if type(part) not in _PLAIN:  # so that long tables are searched fast
            yield from formulas_in(part, f"{name}.{key}")


def is_pending(value: Any) -> bool:
    """Whether a value contains formulas, which only a mechanism can evaluate."""
    if type(value) in _PLAIN:
        return False
    if isinstance(value, Formula):
        return True
    parts: Iterable[Any]
    if isinstance(value, (tuple, list)):
        parts = value
    elif isinstance(value, dict):
        parts = value.values()
    else:
        parts = _parts_of(cast(Any, type(value)))(value)
    # no call for a plain number: there are hundreds in a description
    return any(type(part) not in _PLAIN and is_pending(part) for part in parts)


def substituted(value: Any, instead: Callable[[Formula], Any]) -> Any:
    """The value with every formula replaced by ``instead(formula)``; itself where it has none."""
    if type(value) in _PLAIN:
        return value
    if isinstance(value, Formula):
        return instead(value)
    if isinstance(value, (tuple, list)):
        parts = [substituted(part, instead) for part in value]
        same = all(new is old for new, old in zip(parts, value, strict=True))
        return value if same else type(value)(parts)
    if isinstance(value, dict):
        pairs = {key: substituted(part, instead) for key, part in value.items()}
        return pairs if any(pairs[key] is not value[key] for key in pairs) else value
    names = _field_names(cast(Any, type(value)))
    if names:
        fields = {field: getattr(value, field) for field in names}
        made = {name: substituted(part, instead) for name, part in fields.items()}
        changed = {name: part for name, part in made.items() if part is not fields[name]}
        return dataclasses.replace(value, **changed) if changed else value
    return value
