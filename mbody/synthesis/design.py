"""What a synthesis finds: designs, each a mechanism that was followed through what it has to do."""

from __future__ import annotations

import math
import os
from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Any

from mbody.files.model import save
from mbody.model.mechanism import Mechanism
from mbody.quantities.units import unit_system
from mbody.sheets.text_table import Column, number, paragraph, table

__all__ = ["Design", "DesignList"]


@dataclass(frozen=True, eq=False, repr=False)
class Design:
    """One mechanism that was found.

    Attributes
    ----------
    mechanism : Mechanism
        With the instants of the demand as those that it asks for.
    values : dict
        The numbers that were found, by the names of the description; angles in rad. Of a function
        also its `zeros`, ``"input.zero.angle"`` and ``"output.zero.angle"`` or ``"output.zero.x"``.
    error : float
        Sum of squares of `misses`, of the mechanism as it was followed.
    misses : tuple of float
        Point by point: the distance from a point of the path [length], of the output from the
        function [rad or length], or the greatest distance of the pins of a pose [length].
    driven : list of float
        Values of the driver at the points, in the order in which they are passed: what ``drive``
        takes.
    defects : tuple of str
        In words what is wrong when the driver goes through the points: order, branch, circuit.
    order : bool
        Whether the driver passes the points one after the other in one direction.
    grashof : str
        Which links turn round, in words; empty of other mechanisms than four-bars and
        slider-cranks.
    transmission_min : float
        Least angle between coupler and rocker, or of the rod to the normal of the guide [rad]: of a
        whole turn where the crank turns round, else from the first point to the last; NaN where it
        is not known.
    margins : dict
        Of the conditions in `subject_to`, by how much each is met, in its unit.
    cognates : tuple of Design
        Other mechanisms of the same motion of the point with the same turn of the crank (Roberts).
    zeros : (float, float) or None
        Of a function: what the angles of the crank and the output of the mechanism have more than
        the given inputs and outputs.

    Examples
    --------
    >>> import mbody
    >>> machine = mbody.makers.slider_crank(1.0, 3.0)
    >>> Design(machine, {"crank.A.x": 1.0}, 0.25, (0.5,), [0.0])
    Design(slider-crank: error 0.25, no defects)
    """

    mechanism: Mechanism
    values: dict[str, float]
    error: float
    misses: tuple[float, ...]
    driven: list[float]
    defects: tuple[str, ...] = ()
    order: bool = True
    grashof: str = ""
    transmission_min: float = math.nan
    margins: dict[str, float] = field(default_factory=dict)
    cognates: tuple[Design, ...] = ()
    zeros: tuple[float, float] | None = None

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the mechanism to a model file; see `mbody.save`."""
        save(self.mechanism, path)

    def data(self, angle: str = "deg") -> dict[str, Any]:
        """As plain values, angles in ``"deg"`` or ``"rad"``."""
        turned = math.degrees if angle == "deg" else float
        values = {
            name: turned(value) if name.endswith(".angle") else value
            for name, value in self.values.items()
        }
        least = self.transmission_min
        return {
            "error": self.error,
            "values": values,
            "transmission_min": None if math.isnan(least) else turned(least),
            "defects": list(self.defects),
            "order": self.order,
            "grashof": self.grashof,
            "misses": list(self.misses),
            "margins": dict(self.margins),
            "cognates": [one.data(angle) for one in self.cognates],
        }

    def __repr__(self) -> str:
        words = [self.grashof] if self.grashof else []
        words += list(self.defects) or ["no defects"]
        return f"Design({self.mechanism.name}: error {self.error:.6g}, {', '.join(words)})"


class DesignList(list[Design]):
    """The designs of a synthesis, the best first.

    Attributes
    ----------
    searched : int
        How many designs were tried.
    seed : int
        Of the random ones.
    notes : tuple of str

    Examples
    --------
    >>> import mbody
    >>> one = Design(mbody.makers.slider_crank(1.0, 3.0), {"crank.A.x": 1.0}, 0.25, (0.5,), [0.0])
    >>> found = DesignList([one], searched=40, seed=1)
    >>> len(found), found.searched
    (1, 40)
    """

    def __init__(
        self, found: Iterable[Design], searched: int, seed: int, notes: Iterable[str] = ()
    ) -> None:
        super().__init__(found)
        self.searched, self.seed, self.notes = searched, seed, tuple(notes)

    def __str__(self) -> str:
        if not self:
            return "no design"
        names = list(self[0].values)
        units = unit_system(self[0].mechanism.units)
        rows = range(1, len(self) + 1)
        least = [math.degrees(one.transmission_min) for one in self]
        columns = [
            Column("DESIGN", [str(n) for n in rows], text=True),
            Column("error", [number(one.error) for one in self]),
            Column("transmission", ["" if x != x else f"{x:.1f}" for x in least], "deg"),
            Column("class", [one.grashof for one in self], text=True),
            Column("defects", ["; ".join(one.defects) for one in self], text=True),
        ]
        numbers = [Column("NUMBER", names, text=True)]
        numbers += [
            Column(str(n), [_shown(name, one.values[name]) for name in names])
            for n, one in zip(rows, self, strict=True)
        ]
        numbers.append(Column("unit", [_unit(name, units) for name in names], text=True))
        notes = [line for note in self.notes for line in paragraph(f"note: {note}")]
        tried = f"{self.searched} designs tried, seed {self.seed}"
        return "\n".join(
            [self[0].mechanism.name, tried, "", *table(columns), "", *table(numbers), *notes]
        )


def _shown(name: str, value: float) -> str:
    return number(math.degrees(value) if name.endswith(".angle") else value)


def _unit(name: str, units: Any) -> str:
    if name.endswith(".angle"):
        return "deg"
    return str(units.of("length")) if name.endswith((".x", ".y", "offset")) else ""
