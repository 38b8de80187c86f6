"""Many cases of one test: looped in it where each takes no time, or the first of them and the rest
marked as slow.
"""

from __future__ import annotations

import functools
import inspect
from collections.abc import Callable, Iterable, Sequence
from typing import Any

import pytest

#: Failures that a looped test tells, at most.
TOLD = 20


def each(names: str | Sequence[str], cases: Iterable[Any]) -> Callable:
    """A test that takes all cases in turn, as `pytest.mark.parametrize` has them, and then tells
    which of them fail. Fixtures are those of the whole test.
    """
    keys = _keys(names)
    rows = [(_values(keys, case), _name(keys, case)) for case in cases]
    assert rows, "no case"

    def looped(test: Callable) -> Callable:
        @functools.wraps(test)
        def run(**fixtures: Any) -> None:
            failures = []
            for values, name in rows:
                try:
                    test(**dict(zip(keys, values, strict=True)), **fixtures)
                except pytest.skip.Exception:
                    continue
                except (Exception, pytest.fail.Exception) as error:
                    failures.append(f"[{name}] {type(error).__name__}: {error}")
                    last = error
            if failures:
                told = "\n".join(failures[:TOLD])
                raise AssertionError(f"{len(failures)} of {len(rows)} cases:\n{told}") from last

        taken = inspect.signature(test).parameters
        run.__signature__ = inspect.Signature([taken[key] for key in taken if key not in keys])
        return run

    return looped


def first_fast(
    names: str | Sequence[str], cases: Iterable[Any], fast: int, **more: Any
) -> pytest.MarkDecorator:
    """`pytest.mark.parametrize` with the mark `slow` on all cases but the first `fast`."""
    keys = _keys(names)
    rows = [
        case
        if number < fast
        else pytest.param(
            *_values(keys, case),
            marks=(*getattr(case, "marks", ()), pytest.mark.slow),
            id=getattr(case, "id", None) if _is_set(case) else None,
        )
        for number, case in enumerate(cases)
    ]
    assert len(rows) > fast, "none is slow"
    return pytest.mark.parametrize(names, rows, **more)


def _keys(names: str | Sequence[str]) -> list[str]:
    return [name.strip() for name in names.split(",")] if isinstance(names, str) else list(names)


def _is_set(case: Any) -> bool:
    return type(case) is type(pytest.param())


def _values(keys: list[str], case: Any) -> Sequence[Any]:
    if _is_set(case):
        return case.values
    return (case,) if len(keys) == 1 else tuple(case)


def _name(keys: list[str], case: Any) -> str:
    if _is_set(case) and case.id:
        return case.id
    return "-".join(getattr(value, "__name__", repr(value))[:60] for value in _values(keys, case))
