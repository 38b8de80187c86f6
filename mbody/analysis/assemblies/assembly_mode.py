"""The modes in which a mechanism closes, as a result."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from mbody.core.presentation import present
from mbody.errors import ModelError, brief
from mbody.model.element import listed
from mbody.model.mechanism import Mechanism
from mbody.quantities.convert import short_degrees
from mbody.solution.doubts import Inherited
from mbody.solution.heading import heading, unit_symbols

__all__ = ["AssemblyMode", "AssemblyModes", "Unresolved"]


@dataclass(frozen=True, eq=False)
class AssemblyMode(Mapping[str, tuple[float, float, float]]):
    """One way in which a mechanism closes: of every body (x, y, angle) of its link axes, which is
    what `guess` of any analysis takes.

    Attributes
    ----------
    number : int
        From 1.
    name : str
        "open" or "crossed" of two links, joined where there are several; else the number.
    used : bool
        Whether analyses with the guesses of the description find this one.
    residual : float
        Greatest violation of the constraint rows, in model lengths and radians.
    pose : array (3·bodies + 3,)
        Coordinates of the mass centres, the ground last [length, rad].
    """

    number: int
    name: str
    used: bool
    residual: float
    pose: np.ndarray = field(repr=False)
    _places: Mapping[str, tuple[float, float, float]] = field(repr=False)

    def __getitem__(self, body: str) -> tuple[float, float, float]:
        return self._places[body]

    def __iter__(self) -> Iterator[str]:
        return iter(self._places)

    def __len__(self) -> int:
        return len(self._places)


@dataclass(frozen=True)
class Unresolved:
    """Part of the search that proved neither that there is a mode nor that there is none.

    Attributes
    ----------
    reason : str
        A sentence.
    bodies : tuple of str
        That it is about.
    width : float
        Of what is left open [rad], displacements as a part of the size of the loops.
    """

    reason: str
    bodies: tuple[str, ...]
    width: float

    def data(self) -> dict[str, Any]:
        """The same as plain values."""
        return {"reason": self.reason, "bodies": list(self.bodies), "width": self.width}


@dataclass(frozen=True, kw_only=True, eq=False)
class AssemblyModes(Inherited):
    """All ways in which a mechanism closes at given driver values; ``print`` shows them.

    ``len(modes)`` is their number; ``modes[0]`` the first, ``modes["open"]`` the one of that name.

    Attributes
    ----------
    mechanism : Mechanism
    at : dict
        Values of the drivers [rad or length].
    modes : tuple of AssemblyMode
    certificate : str
        "interval" where the search covers all positions, "multi-start" where Newton's method was
        started from random ones.
    complete : bool
        Whether it is proven that there are no more.
    unresolved : tuple of Unresolved
        Why it is not.
    groups : tuple of tuples of str
        Bodies of each Assur group, in the order of solution; empty without a certificate.
    boxes : int
        How many boxes the search examined.
    meshed : frozenset of int
        Indices of bodies that gears or couplings turn: their angles count up to turns of the teeth.
    """

    mechanism: Mechanism = field(repr=False)
    at: dict[str, float]
    modes: tuple[AssemblyMode, ...]
    certificate: str
    complete: bool
    unresolved: tuple[Unresolved, ...] = ()
    groups: tuple[tuple[str, ...], ...] = field(default=(), repr=False)
    boxes: int = 0
    meshed: frozenset[int] = field(default=frozenset(), repr=False)

    def __len__(self) -> int:
        return len(self.modes)

    def __iter__(self) -> Iterator[AssemblyMode]:
        return iter(self.modes)

    def __getitem__(self, which: int | str) -> AssemblyMode:
        if isinstance(which, str):
            for mode in self.modes:
                if mode.name == which:
                    return mode
            known = listed(mode.name for mode in self.modes) or "none"
            raise ModelError(f"there is no mode {brief(which)} (there are: {known})", which)
        return self.modes[which]

    @property
    def used(self) -> AssemblyMode | None:
        """The mode that analyses find from the guesses of the description; None where that is
        not among them.
        """
        return next((mode for mode in self.modes if mode.used), None)

    @property
    def poses(self) -> np.ndarray:
        """Coordinates of the mass centres, the ground last: (modes, 3·bodies + 3)."""
        size = 3 * len(self.mechanism.bodies) + 3
        return np.array([mode.pose for mode in self.modes]).reshape(len(self), size)

    def __str__(self) -> str:
        return str(present("sheet", self))

    def data(self, angle: str = "deg") -> dict[str, Any]:
        """Everything as plain values, ready for JSON; angles in `angle`, "deg" or "rad"."""
        turn = short_degrees if angle == "deg" else float
        angular = {d.name: d.angular for d in self.mechanism.drivers}
        head = heading(
            self.mechanism.name, "assemblies", unit_symbols(self.mechanism.units, angle), self
        )
        modes = [
            {
                "number": mode.number,
                "name": mode.name,
                "used": mode.used,
                "circuit": None,
                "branch": None,
                "residual": mode.residual,
                "bodies": {
                    name: {"x": x, "y": y, "angle": turn(float(a))}
                    for name, (x, y, a) in mode.items()
                },
            }
            for mode in self.modes
        ]
        at = {name: turn(float(v)) if angular[name] else v for name, v in self.at.items()}
        return head | {
            "at": at,
            "count": len(self),
            "complete": self.complete,
            "certificate": self.certificate,
            "modes": modes,
            "unresolved": [one.data() for one in self.unresolved],
            "boxes": self.boxes,
        }
