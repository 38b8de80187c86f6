"""Values of options, read from their texts."""

from __future__ import annotations

from typing import Any

from mbody.cli.usage import UsageError
from mbody.errors import ModelError
from mbody.quantities.convert import short_degrees

__all__ = ["bounds", "in_degrees", "low_and_high", "whole_number"]


def in_degrees(angles: Any) -> Any:
    """An angle [rad], or a list of them, in degrees; None stays where there is none.

    >>> in_degrees([0.0, None])
    [0.0, None]
    """
    if isinstance(angles, list):
        return [in_degrees(one) for one in angles]
    return None if angles is None else short_degrees(angles)


def whole_number(option: str, text: str | None) -> Any:
    """A number without a sign; None where it is not given.

    >>> whole_number("--count", "30"), whole_number("--count", None)
    (30, None)
    """
    if text is None:
        return None
    if not (text.isascii() and text.isdigit()) or len(text) > 9:
        raise UsageError(f"{option} takes a whole number, not {text[:40]!r}")
    return int(text)


def low_and_high(option: str, text: str) -> tuple[str, str]:
    """Both parts of ``LOW:HIGH``.

    >>> low_and_high("--within", "3:5 N")
    ('3', '5 N')
    """
    low, sign, high = text.partition(":")
    if not sign:
        raise UsageError(f"{option}: bounds are LOW:HIGH, not {text[:60]!r}")
    return low.strip(), high.strip()


def bounds(option: str, text: str) -> tuple[Any, Any]:
    """Both parts as numbers or formulas; plain angles are in degrees.

    >>> [one.text for one in bounds("--span", "40:60 deg")]
    ['40', '60 deg']
    """
    from mbody.quantities import FormulaError, read

    low, high = low_and_high(option, text)
    try:
        return read(low, None, "deg"), read(high, None, "deg")
    except FormulaError as error:
        raise ModelError(f"{option}: {error}", option) from None
