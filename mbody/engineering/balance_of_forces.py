"""Shaking forces, and counterweights with what they do to them."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from mbody.engineering.counterweights import Counterweight
from mbody.model.element import listed
from mbody.sheets.text_table import Column, number, numbers, paragraph, table
from mbody.solution.doubts import Inherited
from mbody.system.read_only import lock

__all__ = ["ForceBalance", "Shaking"]

Array = np.ndarray

#: A moment below this part of the greatest is printed as zero.
ROUNDING = 1e-12


@dataclass(frozen=True, eq=False)
class Shaking:
    """What the inertia forces of all links are together: arrays (instants,), world axes.

    Attributes
    ----------
    fx, fy : arrays
        Shaking force of inertia alone, Σ −m a_G [force].
    moment : array
        Shaking moment about the origin of the ground [force·length].
    """

    fx: Array
    fy: Array
    moment: Array

    def __post_init__(self) -> None:
        lock(self)

    @property
    def magnitude(self) -> Array:
        """√(fx² + fy²)."""
        return np.hypot(self.fx, self.fy)


@dataclass(frozen=True, eq=False, repr=False)
class ForceBalance(Inherited):
    """Counterweights, and what they do.

    Attributes
    ----------
    counterweights : tuple of Counterweight
        In the order of `on`.
    conditions : int
        How many conditions a complete balance is: the rank of the momentum of all links.
    complete : bool
        Whether the momentum vanishes in every position at every speed.
    left : float
        Shaking force that is left, root of the mean square, as a part of what it was.
    reason : str
        Why it is not complete; empty where it is.
    before, after : Shaking
        Shaking force and moment of inertia over the instants that were analysed.
    run : Solution
        The motion with counterweights.
    mechanism : Mechanism
        The description with counterweights as parts of the links.
    system : System
        The same with the numbers of the system that was given.

    Examples
    --------
    >>> import mbody
    >>> machine = mbody.gallery.load("norton_fourbar")
    >>> found = mbody.engineering.force_balance(machine, {"crank": "3 in", "rocker": "5 in"})
    >>> len(found.counterweights), bool(found.left < 1e-9)
    (2, True)
    """

    counterweights: tuple[Counterweight, ...] = ()
    conditions: int = 0
    complete: bool = False
    left: float = 0.0
    reason: str = ""
    before: Shaking = field(default_factory=lambda: Shaking(*np.zeros((3, 0))))
    after: Shaking = field(default_factory=lambda: Shaking(*np.zeros((3, 0))))
    run: Any = None
    mechanism: Any = None
    system: Any = None

    def data(self) -> dict[str, Any]:
        """As plain values, ready for JSON; angles in rad."""
        peaks = {
            name: {
                "force": float(one.magnitude.max(initial=0.0)),
                "moment": float(np.abs(one.moment).max(initial=0.0)),
            }
            for name, one in (("before", self.before), ("after", self.after))
        }
        return {
            "counterweights": [dict(vars(one)) for one in self.counterweights],
            "conditions": self.conditions,
            "complete": self.complete,
            "left": self.left,
            "reason": self.reason,
            "peaks": peaks,
        }

    def __str__(self) -> str:
        unit = self.mechanism.units
        weights = self.counterweights
        rows = table(
            [
                Column("COUNTERWEIGHT", [one.body for one in weights], text=True),
                Column("mass", numbers([one.mass for one in weights]), unit.mass),
                Column("from", [one.at for one in weights], text=True),
                Column("radius", numbers([one.radius for one in weights]), unit.length),
                Column("angle", [f"{np.degrees(one.angle):.3f}" for one in weights], "deg"),
                Column(
                    "moment",
                    numbers([one.moment for one in weights]),
                    f"{unit.mass}·{unit.length}",
                ),
            ]
        )
        peaks = self.data()["peaks"]
        parts = [peaks[when][what] for what in ("force", "moment") for when in ("before", "after")]
        # a moment is rounding beside what the forces would have at the size of the mechanism
        floor = ROUNDING * max(max(parts[2:]), parts[0] * self.system.length)
        parts[2:] = [part if part > floor else 0.0 for part in parts[2:]]
        shown = table(
            [
                Column("GREATEST", ["shaking force", "shaking moment"], text=True),
                Column("before", [number(parts[0]), number(parts[2])]),
                Column("after", [number(parts[1]), number(parts[3])]),
                Column("unit", [unit.force, unit.of("torque")], text=True),
            ]
        )
        head = f"{self.conditions} conditions; "
        head += "complete balance" if self.complete else f"{100.0 * self.left:.3g} % is left"
        notes = [line for note in self.notes for line in paragraph(f"note: {note}")]
        lines = [self.mechanism.name, "", *rows, "", *shown, "", head, *notes]
        return "\n".join(lines)

    def __repr__(self) -> str:
        how = "complete" if self.complete else f"{self.left:.3g} left"
        return f"ForceBalance({listed(one.body for one in self.counterweights)}: {how})"
