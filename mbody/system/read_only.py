"""Arrays and mappings that a result hands out: they can be read, and not changed by accident."""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Mapping
from typing import Any, NoReturn, cast

import numpy as np

#: What nobody can change.
_KEPT = frozenset({str, float, int, bool, type(None)})


class ReadOnly(dict[str, Any]):
    """A dict that cannot be changed; ``dict(it)`` is a copy that can.

    >>> ReadOnly({"crank.mass": 1.0})["crank.mass"] = 2.0
    Traceback (most recent call last):
    ...
    TypeError: it is read-only: make a copy by dict(...), or other numbers by with_values(...)
    """

    def _refuse(self, *_: Any, **__: Any) -> NoReturn:
        raise TypeError(
            "it is read-only: make a copy by dict(...), or other numbers by with_values(...)"
        )

    __setitem__ = __delitem__ = __ior__ = _refuse
    update = setdefault = pop = popitem = clear = _refuse

    def __reduce__(self) -> tuple[Any, ...]:
        return locked, (dict(self),)  # arrays forget in a file that they are locked


def locked(value: Any) -> Any:
    """A view of an array that cannot be written to, a tuple of such, a dict of such as `ReadOnly`;
    anything else unchanged.

    >>> a = np.zeros(3)
    >>> locked(a)[0] = 1.0
    Traceback (most recent call last):
    ...
    ValueError: assignment destination is read-only
    """
    if type(value) is float:  # most are
        return value
    if isinstance(value, np.ndarray):
        if not value.flags.writeable:
            return value
        view = value.view()
        view.flags.writeable = False
        return view
    if type(value) is tuple:
        for part in value:  # a loop, since most are a few strings or truth values
            if isinstance(part, np.ndarray):
                return tuple(locked(part) for part in value)
        return value
    if isinstance(value, Mapping) and not isinstance(value, ReadOnly):
        return ReadOnly({key: locked(part) for key, part in value.items()})
    return value


def lock(result: Any) -> None:
    """Lock every array and every dict among the fields of a frozen dataclass, in place."""
    for name in _names(cast(Any, type(result))):
        value = getattr(result, name)
        if type(value) in _KEPT or (type(value) is np.ndarray and not value.flags.writeable):
            continue
        safe = locked(value)
        if safe is not value:
            object.__setattr__(result, name, safe)


class Locked:
    """Base of frozen dataclasses whose arrays and dicts cannot be changed."""

    def __post_init__(self) -> None:
        lock(self)

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__dict__.update(state)
        lock(self)  # arrays forget in a file that they are locked


@functools.cache
def _names(kind: Any) -> tuple[str, ...]:
    """Of the fields of a dataclass: to list them takes longer than to lock them."""
    return tuple(field.name for field in dataclasses.fields(kind))
