"""What elements hand to the assembler: constraints in pairs of rows, loads in single actions.

An element may be any number of primitives: a `Fixed` joint is a pin and an equal angle. The
kernels know
only primitives, each of one kind of physics, so an element with new physics adds one kind and
nothing
else.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from mbody.laws import Law

__all__ = ["ForcePrimitive", "ConstraintPrimitive", "Part", "Signal"]


@dataclass(frozen=True)
class Signal:
    """A law as the kernels take it: which one, and its parameters (floats or arrays)."""

    law: Law
    parameters: list[Any]


@dataclass(frozen=True)
class Part:
    """One coordinate in the sum of a coupling: its physics, and the bodies that it lies between.

    Its seven parameters, the factor first, stand among those of the primitive.
    """

    kind: str
    i: str
    j: str


@dataclass(frozen=True)
class ConstraintPrimitive:
    """Up to two constraint rows between bodies `i` and `j`.

    Attributes
    ----------
    kind : str
        The physics, one of `mbody.kernels.constraints.KINDS`.
    i, j : str
        Names of the two bodies.
    rows : str
        What each row measures, a letter a row: ``"l"`` a length, ``"a"`` an angle.
    parameters : list
        Numbers of the physics, floats or arrays over a batch.
    signal : Signal or None
        The law f(t) of the first row, if it has one.
    law : Signal or None
        A law of a direction that the position gives: an angle of one turn, 0 … 2π.
    function : callable or None
        The user's own physics in plain Python, for kind ``"user"``.
    parts : tuple of Part
        What a ``"sum"`` adds up, over more bodies than two.
    """

    kind: str
    i: str
    j: str
    rows: str
    parameters: list[Any]
    signal: Signal | None = None
    law: Signal | None = None
    function: Callable[..., Any] | None = None
    parts: tuple[Part, ...] = ()

    @property
    def bodies(self) -> tuple[str, ...]:
        """All bodies that the rows are about: i and j, then what else a sum moves."""
        more = (body for part in self.parts for body in (part.i, part.j) if body != "ground")
        return tuple(dict.fromkeys((self.i, self.j, *more)))


@dataclass(frozen=True)
class ForcePrimitive:
    """One load between bodies `i` and `j` (or on every body, for gravity and fields).

    Attributes
    ----------
    kind : str
        The physics, one of `mbody.kernels.forces.KINDS`.
    i, j : str
        Names of the two bodies; the action on `j` is the positive one.
    parameters : list
        Numbers of the physics, floats or arrays over a batch.
    signals : tuple of Signal
        Laws of time, up to two.
    law : Signal or None
        A law of the element's own state (stretch, rate).
    function : callable or None
        The user's own physics in plain Python, for kind ``"user"``.
    by : str
        Name of a third body, whose position the action follows without acting on it.
    """

    kind: str
    i: str
    j: str
    parameters: list[Any]
    signals: tuple[Signal, ...] = ()
    law: Signal | None = None
    function: Callable[..., Any] | None = None
    by: str = "ground"
