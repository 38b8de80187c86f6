"""Errors are sentences: what happened, to which element, with which number, what to try."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar, copy_context
from functools import partial
from typing import Any, NoReturn

__all__ = [
    "ModelError", "ModelWarning", "SolveError", "angle_text", "at_the_command", "brief", "remedy",
]  # fmt: skip

#: Whether the user reads a sentence at the command, not in Python.
_AT_THE_COMMAND = ContextVar("at_the_command", default=False)


class ModelError(ValueError):
    """The description cannot be a mechanism, or cannot begin to move; raised while describing and
    assembling, and where a motion begins.

    Attributes
    ----------
    element : str or None
        Name of the body, joint, driver or load that the sentence is about.
    problems : tuple
        Of a model file: (line or None, field, sentence) of everything that is wrong with it.

    Examples
    --------
    >>> import mbody
    >>> try:
    ...     mbody.Body("rod", mass=-1.0)
    ... except ModelError as error:
    ...     print(error)
    'rod': mass is -1, it must not be negative: give 0 or more
    """

    def __init__(self, message: str, element: str | None = None) -> None:
        super().__init__(message)
        self.element = element
        self.problems: tuple[tuple[int | None, str, str], ...] = ()


class SolveError(RuntimeError):
    """An analysis could not give the requested result.

    Attributes
    ----------
    element : str or None
        Name of the element that the sentence is about.
    solution : Solution or None
        What was computed before the stop; its last instant is the last good one.

    Examples
    --------
    >>> import mbody
    >>> try:
    ...     mbody.kinematics(mbody.makers.four_bar(1.0, 2.5, 1.5, 5.4))
    ... except SolveError as error:
    ...     print(str(error)[:43], error.solution)
    loops do not close at t = 0 s: the smallest None
    """

    element: str | None

    def __init__(
        self,
        message: str | Callable[[], NoReturn],
        element: str | None = None,
        solution: Any = None,
    ) -> None:
        super().__init__(message)
        self.solution = solution
        if isinstance(message, str):
            self.element = element
        else:  # it raises the error whose sentence this one says, once that is read
            self._explain = partial(copy_context().run, message)

    def _read(self) -> None:
        explain = vars(self).get("_explain")
        if explain is not None:
            try:
                explain()
            except SolveError as error:
                self.args, self.element = error.args, error.element
            del self._explain

    def __getattribute__(self, name: str) -> Any:
        if name in ("args", "element"):
            self._read()
        return super().__getattribute__(name)

    def __str__(self) -> str:
        self._read()
        return super().__str__()

    def __repr__(self) -> str:
        self._read()
        return super().__repr__()

    def __reduce__(self) -> str | tuple[Any, ...]:
        self._read()
        return super().__reduce__()


class ModelWarning(UserWarning):
    """The answer is good, but it may not be what was meant; the sentence says why."""


def brief(value: Any, most: int = 60) -> str:
    """A value for a sentence, cut where it is long.

    >>> brief("crank")
    "'crank'"
    >>> brief("a" * 100, 10)
    "'aaaaaa..."
    """
    if isinstance(value, (str, bytes)):
        value = value[: most + 1]
    try:
        text = repr(value)
    except Exception:  # a whole number of very many digits, or what has no name for itself
        text = f"<{type(value).__name__}>"
    return text if len(text) <= most else text[: most - 3] + "..."


@contextmanager
def at_the_command() -> Iterator[None]:
    """Within, the remedies of sentences are words of the command and of model files."""
    mark = _AT_THE_COMMAND.set(True)
    try:
        yield
    finally:
        _AT_THE_COMMAND.reset(mark)


def angle_text(value: float) -> str:
    """An angle [rad] in the unit of the interface that the user works with.

    >>> angle_text(1.5707963267948966)
    '1.5708 rad'
    >>> with at_the_command():
    ...     angle_text(1.5707963267948966)
    '90 deg'
    """
    return remedy(python=f"{value:g} rad", command=f"{math.degrees(value):g} deg")


def remedy(*, python: str, command: str) -> str:
    """The remedy in the words of the interface that the user works with.

    `python`: With names of arguments; angles in radians.
    `command`: With options of the command and keys of model files; angles in degrees.

    >>> remedy(python="give until", command="give --to TIME")
    'give until'
    >>> with at_the_command():
    ...     remedy(python="give until", command="give --to TIME")
    'give --to TIME'
    """
    return command if _AT_THE_COMMAND.get() else python
