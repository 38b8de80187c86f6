"""What elements hand to the assembler: constraints in pairs of rows, loads in single actions.

An element may be any number of atoms: a `Fixed` joint is a pin and an equal angle. The kernels know
only atoms, each of one kind of physics, so an element with new physics adds one kind and nothing
else.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from mbody.laws import Law

__all__ = ["Action", "Atom", "Signal"]


@dataclass(frozen=True)
class Signal:
    """A law as the kernels take it: which one, and its parameters (floats or arrays)."""

    law: Law
    parameters: list[Any]


@dataclass(frozen=True)
class Atom:
    """Up to two constraint rows between bodies `i` and `j`.

    Attributes
    ----------
    kind : str
        The physics, one of `mbody.core.rows.KINDS`.
    i, j : str
        Names of the two bodies.
    rows : str
        What each row measures, a letter a row: ``"l"`` a length, ``"a"`` an angle.
    parameters : list
        Numbers of the physics, floats or arrays over a batch.
    signal : Signal or None
        The law f(t) of the first row, if it has one.
    function : callable or None
        The user's own physics in plain Python, for kind ``"user"``.
    """

    kind: str
    i: str
    j: str
    rows: str
    parameters: list[Any]
    signal: Signal | None = None
    function: Callable[..., Any] | None = None


@dataclass(frozen=True)
class Action:
    """One load between bodies `i` and `j` (or on every body, for gravity).

    Attributes
    ----------
    kind : str
        The physics, one of `mbody.core.forces.KINDS`.
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
    """

    kind: str
    i: str
    j: str
    parameters: list[Any]
    signals: tuple[Signal, ...] = ()
    law: Signal | None = None
    function: Callable[..., Any] | None = None
