"""How large a model file may be: hostile ones are refused in bounded time, own ones are not."""

from __future__ import annotations

import math
import os
from dataclasses import dataclass, fields

from mbody.errors import ModelError, brief, remedy

__all__ = ["VARIABLE", "Limits", "limits_of"]

#: Raises the limits of all model files that a process reads, so many times.
VARIABLE = "MBODY_LIMITS"


@dataclass(frozen=True)
class Limits:
    """How large a model file may be that is read or written.

    The limits keep a hostile file from taking a machine's time; they let chains of more than 10 000
    links pass. Whoever knows a file can raise them.

    Parameters
    ----------
    size : float
        Bytes of the file.
    values : float
        Numbers, texts, lists and tables in all.
    operations : float
        Operators, brackets and commas of its formulas in all.

    Examples
    --------
    >>> Limits(size=50e6, values=5e6).size
    50000000.0
    >>> Limits().times(10).values
    3000000.0
    """

    size: float = 6e6
    values: float = 300e3
    operations: float = 150e3

    def __post_init__(self) -> None:
        for field in fields(self):
            value = getattr(self, field.name)
            sound = isinstance(value, int | float) and not isinstance(value, bool)
            if not sound or math.isnan(value) or value <= 0:
                raise ModelError(
                    f"limits: {field.name} must be a positive number, not {brief(value)}"
                )

    def times(self, factor: float) -> Limits:
        """All of them so many times."""
        return Limits(*(getattr(self, field.name) * factor for field in fields(self)))

    def over(self, what: str, **found: float) -> str | None:
        """The sentence of a file that has more than is allowed of one thing, else None.

        >>> Limits().over("it", size=20e6)  # doctest: +ELLIPSIS
        'it has more than 6 MB: raise the limits if you trust it, by limits=...'
        """
        for name, count in found.items():
            most = getattr(self, name)
            if count > most:
                factor = math.ceil(2 * count / getattr(Limits(), name))
                amount = f"{most / 1e6:g} MB" if name == "size" else f"{most:.0f} {WORDS[name]}"
                how = remedy(
                    python=f"by limits=mbody.files.model.Limits({name}={2 * count:.1g}) "
                    "of load and save",
                    command=f"by {VARIABLE}={factor:.0f} before the command",
                )
                return f"{what} has more than {amount}: raise the limits if you trust it, {how}"
        return None


WORDS = {"values": "values", "operations": "operations in its formulas"}


def limits_of(given: Limits | None) -> Limits:
    """The limits that are given, else those of the process.

    Raises
    ------
    ModelError
        For what is none, here or in the environment.
    """
    if given is None:
        text = os.environ.get(VARIABLE, "1")
        try:
            return Limits().times(float(text))
        except (ValueError, ModelError):
            raise ModelError(
                f"the environment variable {VARIABLE} must be a positive number, such as 10, not "
                f"{brief(text)}"
            ) from None
    if not isinstance(given, Limits):
        raise ModelError(
            f"limits must be mbody.files.model.Limits(size=..., values=...), not {brief(given)}"
        )
    return given
