"""Base of results at several rest positions: a sequence with its time and its doubts."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Generic, TypeVar

from mbody.core.presentation import present
from mbody.quantities.units import UnitSystem
from mbody.solution.doubts import Inherited

__all__ = ["AtRestPositions"]

T = TypeVar("T")


@dataclass(frozen=True, eq=False)
class AtRestPositions(Inherited, Generic[T]):
    """What was found at each rest position; ``print`` shows it as tables.

    Attributes
    ----------
    mechanism : str
        Its name.
    units : UnitSystem
    t : float
        The time at which drivers and loads are taken.
    positions : tuple
        One entry a rest position.
    status, doubts, notes
        As of `Inherited`.
    """

    mechanism: str
    units: UnitSystem
    t: float
    positions: tuple[T, ...] = field(repr=False)

    def __len__(self) -> int:
        return len(self.positions)

    def __iter__(self) -> Iterator[T]:
        return iter(self.positions)

    def __getitem__(self, index: int) -> T:
        return self.positions[index]

    def _repr_html_(self) -> str:
        # what a notebook shows
        return str(present("notebook", self))

    def __str__(self) -> str:
        return str(present("sheet", self))
