"""Numbers and names as text in MJCF."""

from __future__ import annotations


def numbers(unit: float, *values: float) -> str:
    """Numbers times a unit, as text with all digits; rounding errors of the greatest become zero.

    >>> numbers(2.0, 0.5, -1.0, 1e-20)
    '1 -2 0'
    """
    least = 1e-16 * max(map(abs, values))
    kept = (value if abs(value) > least else 0.0 for value in values)
    return " ".join(repr(float(unit * value) + 0.0).removesuffix(".0") for value in kept)


def safe(body: str) -> str:
    """The name of a body in the file, where ``world`` is the ground's.

    >>> safe("crank"), safe("world")
    ('crank', 'world.body')
    """
    return "world.body" if body == "world" else body
