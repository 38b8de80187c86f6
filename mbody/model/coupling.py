"""Couplings: a weighted sum of coordinates of any number of bodies keeps its value."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, ClassVar, TypeAlias

import numpy as np

from mbody.errors import ModelError
from mbody.model.driver import Constraint, TurnRow
from mbody.model.element import (
    BodyName,
    Element,
    Marker,
    as_body,
    as_marker,
    number_field,
    place_name,
    point_numbers,
)
from mbody.model.primitives import ConstraintPrimitive, Part
from mbody.quantities.formula import Converted, NumberField, default, number, required

if TYPE_CHECKING:
    from mbody.model.driver import PoseReader
    from mbody.model.element import Numbers


#: The two places of a length: markers, once a coupling has read them.
Pair: TypeAlias = (
    "Converted[tuple[Marker, Marker] | None, tuple[Marker | str, Marker | str] | None]"
)
Terms: TypeAlias = "Converted[tuple[CouplingTerm, ...], Sequence[CouplingTerm]]"
#: What a term may be.
KINDS = ("angle", "distance", "coordinate")


@dataclass(frozen=True)
class CouplingTerm:
    """One coordinate of a coupling with its factor: an angle, a distance or a displacement.

    Parameters
    ----------
    factor : float
        What the coordinate is multiplied by; of an angle among lengths a length [length/rad], as
        the radius of a drum, else a number.
    angle : str, optional
        The body whose angle it is.
    relative_to : str
        The body that the angle is measured from.
    distance : pair of Marker or str, optional
        The two places (i, j) whose distance it is.
    coordinate : pair of Marker or str, optional
        The places (i, j): the displacement of j along the x axis of the marker on i.

    >>> CouplingTerm(2.0, angle="drum").factor
    2.0
    """

    factor: NumberField = required()
    angle: Converted[str | None, str | Element | None] = default(None)
    relative_to: BodyName = default("ground")
    distance: Pair = default(None)
    coordinate: Pair = default(None)

    @property
    def ends(self) -> tuple[Marker, Marker] | None:
        """The two places of a length."""
        return self.distance or self.coordinate

    @property
    def bodies(self) -> tuple[str, str]:
        """The body that the coordinate is measured from, and the other."""
        if self.ends:
            return self.ends[0].body, self.ends[1].body
        return self.relative_to, str(self.angle)


@dataclass(frozen=True)
class Coupling(Constraint):
    """Base of couplings: Φ = Σ factor · coordinate − value = 0, one row over all their bodies.

    It does no work. Its effort times a rate of the value would be the power that it gives.
    """

    main: ClassVar[tuple[str, ...]] = ("terms",)
    role: ClassVar[str] = "coupling"
    counts_turns: ClassVar[bool] = True
    #: Whether the terms may be lengths.
    lengths: ClassVar[bool] = True

    @property
    def parts(self) -> tuple[CouplingTerm, ...]:
        """The terms."""
        found: tuple[CouplingTerm, ...] = self.terms  # type: ignore[attr-defined]  # every kind's own field
        return found

    def _enter(self) -> None:
        super()._enter()
        given: Any = getattr(self, "terms", ())
        if isinstance(given, (CouplingTerm, str)) or not isinstance(given, Sequence) or not given:
            raise ModelError(
                f"'{self.name}': terms must be a list of CouplingTerm, not {given!r}", self.name
            )
        terms = tuple(self._entered(n, term) for n, term in enumerate(given))
        object.__setattr__(self, "terms", terms)

    def _entered(self, n: int, term: Any) -> CouplingTerm:
        """A term with numbers and places in the one form that they have inside."""
        which = f"terms[{n}]"
        if not isinstance(term, CouplingTerm):
            raise ModelError(
                f"'{self.name}': {which} must be a CouplingTerm, not {term!r}", self.name
            )
        if not self.lengths and term.ends:
            raise ModelError(
                f"'{self.name}': {which} is a length, but this couples angles: use a "
                "LengthCoupling, which takes both",
                self.name,
            )
        kinds = [key for key in KINDS if getattr(term, key) is not None]
        if len(kinds) != 1:
            raise ModelError(
                f"'{self.name}': {which} must be one of {', '.join(KINDS)}; it is "
                f"{' and '.join(kinds) or 'none of them'}",
                self.name,
            )
        factor = number(term.factor, self.factor_of(term), self.name, f"{which}.factor")
        changes: dict[str, Any] = {"factor": factor}
        if term.ends:
            changes[kinds[0]] = self._pair(term.ends, which)
        else:
            changes["angle"] = as_body(term.angle, self.name, f"{which}.angle")
            base = as_body(term.relative_to, self.name, f"{which}.relative_to")
            changes["relative_to"] = base
        made = replace(term, **changes)
        if made.bodies[0] == made.bodies[1]:
            raise ModelError(
                f"'{self.name}': {which} measures '{made.bodies[0]}' from itself: name two bodies",
                self.name,
            )
        return made

    def _pair(self, ends: Any, which: str) -> tuple[Marker, Marker]:
        try:
            i, j = ends
        except (TypeError, ValueError):
            raise ModelError(
                f"'{self.name}': {which} needs two places (i, j), not {ends!r}", self.name
            ) from None
        return as_marker(i, self.name, f"{which}.i"), as_marker(j, self.name, f"{which}.j")

    def factor_of(self, term: CouplingTerm) -> str:
        """Dimension of the factor of a term."""
        return "length" if self.lengths and not term.ends else "number"

    @property
    def bodies(self) -> tuple[str, ...]:
        """Names of all bodies that it couples, the ground included where it is measured from."""
        return tuple(dict.fromkeys(body for term in self.parts for body in term.bodies))

    def places(self) -> dict[str, Marker]:
        """The markers of its lengths, as ``"0.i"`` of the first term."""
        return {
            f"{n}.{side}": marker
            for n, term in enumerate(self.parts)
            for side, marker in zip("ij", term.ends or (), strict=False)
        }

    def place(self, field: str) -> Marker:
        """One of `places`."""
        return self.places()[field]

    def numbers(self) -> dict[str, Any]:
        """The value, and of every term the factor (``"belt.0.factor"``) and its places."""
        result = super().numbers()
        for n, term in enumerate(self.parts):
            result[f"{self.name}.{n}.factor"] = term.factor
        for key, marker in self.places().items():
            name = f"{self.name}.{key}"
            result[f"{name}.angle"] = marker.angle
            if not isinstance(marker.point, str):
                result |= point_numbers(marker.point, place_name(name, marker.point))
        return result

    def quantities(self) -> dict[str, str]:
        """The effort."""
        return {"effort": self.effort_dimension}

    def distances(self) -> tuple[tuple[str, str], ...]:
        """Those of its terms that are one."""
        return tuple((f"{n}.i", f"{n}.j") for n, term in enumerate(self.parts) if term.distance)

    def turn_bodies(self) -> tuple[str, ...]:
        """Those of its terms of angles; the ground where it has none."""
        return tuple(b for t in self.parts if not t.ends for b in t.bodies) or ("ground",)

    def turn_row(self, at: Numbers, pose: PoseReader) -> TurnRow:
        """Its terms of angles, and what they and the lengths leave of its value."""
        factors: dict[str, float] = {}
        left = -float(at[f"{self.name}.value"])
        for n, term in enumerate(self.parts):
            factor = float(at[f"{self.name}.{n}.factor"])
            i, j = term.bodies
            if not term.ends:
                for body, sign in ((i, -1.0), (j, 1.0)):
                    factors[body] = factors.get(body, 0.0) + sign * factor
                    left += sign * factor * pose.angle(body)
                continue
            (ix, iy), (jx, jy) = (pose.place(self, f"{n}.{side}") for side in "ij")
            length = math.hypot(jx - ix, jy - iy)
            if term.coordinate:
                line = pose.angle(i) + float(at.angle(self, f"{n}.i"))
                length = math.cos(line) * (jx - ix) + math.sin(line) * (jy - iy)
            left += factor * length
        return TurnRow(factors, left)

    def primitives(self, at: Numbers) -> list[ConstraintPrimitive]:
        """One row; parameters are the value, then seven of every term."""
        parameters = [at[f"{self.name}.value"]]
        parts = []
        for n, term in enumerate(self.parts):
            own = [at[f"{self.name}.{n}.factor"]]
            kind = "angle"
            if term.ends:
                kind = "distance" if term.distance else "coordinate"
                beta = at.angle(self, f"{n}.i")
                own += [*at.arm(self, f"{n}.i"), *at.arm(self, f"{n}.j")]
                own += [np.cos(beta), np.sin(beta)]
            parameters += [*own, *[0.0] * (7 - len(own))]
            parts.append(Part(kind, *term.bodies))
        moving = [body for body in self.bodies if body != "ground"]
        i, j = (*moving, "ground")[:2]
        return [ConstraintPrimitive("sum", i, j, self.rows, parameters, parts=tuple(parts))]


@dataclass(frozen=True)
class AngleCoupling(Coupling):
    """Chain, toothed belt, differential, geared shafts: Σ factor · angle = value, over any number
    of bodies.

    The effort is the torque by which the coupling turns a body of the factor 1; a body of the
    factor c gets c times as much.

    Parameters
    ----------
    name : str
        Unique in the mechanism.
    terms : list of CouplingTerm
        Angles, each with its factor.
    value : float
        What their sum is [rad].

    Examples
    --------
    Both wheels of a differential turn as much as twice its case:

    >>> wheels = [CouplingTerm(1, angle="left"), CouplingTerm(1, angle="right")]
    >>> AngleCoupling("differential", [*wheels, CouplingTerm(-2, angle="case")]).bodies
    ('ground', 'left', 'right', 'case')
    """

    terms: Terms = default((), terms="angle")
    value: NumberField = number_field("angle", 0.0)
    rows: ClassVar[str] = "a"
    lengths: ClassVar[bool] = False


@dataclass(frozen=True)
class LengthCoupling(Coupling):
    """Belt, rope over pulleys, tackle, screw, rack: Σ factor · coordinate = value, over any number
    of lengths, and of angles whose factors are radii.

    The effort is a force: a rope whose length is the sum pulls with the negative effort.

    Parameters
    ----------
    name : str
        Unique in the mechanism.
    terms : list of CouplingTerm
        Distances, displacements and angles, each with its factor; that of an angle is a length.
    value : float
        What their sum is [length].

    Examples
    --------
    An open belt on wheels of the radii 2 and 1, and a rope of 5 that carries a block on two parts:

    >>> belt = LengthCoupling("belt", [CouplingTerm(2.0, angle="a"), CouplingTerm(-1.0, angle="b")])
    >>> falls = CouplingTerm(2.0, distance=("ground.A", "block.B"))
    >>> LengthCoupling("rope", [falls, CouplingTerm(1.0, distance=("ground.A", "hand"))], 5.0).rows
    'l'
    """

    terms: Terms = default((), terms="length")
    value: NumberField = number_field("length", 0.0)
