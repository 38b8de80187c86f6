"""Stops, coordinates that cannot fall below zero, and freewheels, clutches that hold one way."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, ClassVar

from mbody.errors import ModelError, brief
from mbody.laws import MeasuredFormula, compile_measured
from mbody.model.contact import ContactCandidate, OneSided, refuse_coefficients, restitutions
from mbody.model.element import InheritedPlace, number_field, place_field, two_bodies
from mbody.model.primitives import ConstraintPrimitive
from mbody.model.states import formula_dimension
from mbody.quantities import Formula, FormulaError, Scope, read
from mbody.quantities.evaluate import dimension_text
from mbody.quantities.formula import NumberField
from mbody.quantities.units import DIMENSIONS, Dimension

if TYPE_CHECKING:
    from mbody.model.element import Numbers
    from mbody.quantities.units import UnitSystem


#: What a stop may be made of.
COORDINATES = ("x", "y", "angle")
#: What its coordinate may be, with the letter of its row.
ROWS = {"length": "l", "angle": "a", "number": "l"}


@dataclass(frozen=True)
class Stop(OneSided):
    """A stop, buffer, wall: a coordinate that cannot fall below zero, a contact without friction.

    The coordinate g(q, t) ≥ 0 and the force λ ≥ 0 along it with g λ = 0. What strikes it rebounds
    by ġ⁺ = −e ġ⁻, comes to rest on it, and lifts off as soon as it would have to pull.

    Parameters
    ----------
    name : str
        Unique in the mechanism.
    of : str
        g, a length or an angle; a plain number counts as a length. A formula of x, y and angle of
        bodies and points, and of t where the stop moves, such as ``"ball.y - 20 mm"`` or ``"1 rad -
        arm.angle"``; or the name of a measure of the mechanism.
    restitution : float
        e of impacts, from 0 (no rebound) to 1 (no loss).

    Notes
    -----
    It acts in `simulate`, and in other analyses where it is met and nothing else determines the
    position, on all bodies that the formula measures: ``run.contact(name)`` is λ, a
    force, or a torque where g is an angle; ``run.mode(name)`` is "open" or "stick". The forces on
    the bodies are λ times the derivatives of g, so that there is no one reaction.

    Examples
    --------
    >>> Stop("floor", "ball.y - 20 mm", restitution=0.8).restitution
    0.8
    """

    main: ClassVar[tuple[str, ...]] = ("of",)

    of: str = ""
    restitution: NumberField = number_field("number", 0.0, sign="not negative")
    #: g as the kernels take it and the letter of its row; a mechanism that is closed has them.
    gap: MeasuredFormula | None = field(default=None, repr=False, metadata={"internal": True})
    row: str = field(default="l", repr=False, metadata={"internal": True})

    def _enter(self) -> None:
        super()._enter()
        if not isinstance(self.of, str) or not self.of.strip():
            raise ModelError(
                f"stop '{self.name}': of must be text such as \"ball.y - 20 mm\", not "
                f"{brief(self.of)}",
                self.name,
            )
        self._formula(self.of)

    def _check(self) -> None:
        super()._check()
        refuse_coefficients(self.name, 0.0, None, self.restitution)

    def refuse(self, at: Numbers, unit: str) -> None:
        """Refuse a restitution above one, of every design."""
        for value in restitutions(self.name, at):
            refuse_coefficients(self.name, 0.0, None, value)

    @property
    def bodies(self) -> tuple[str, ...]:
        """None by name: all that the formula measures."""
        return ()

    def numbers(self) -> dict[str, Any]:
        """The restitution and the numbers of the formula."""
        found = super().numbers()
        if self.gap is not None:
            found |= {f"{self.name}.gap.{key}": value for key, value in self.gap.numbers().items()}
        return found

    def quantities(self) -> dict[str, str]:
        """The pressing force."""
        return {"contact": "torque" if self.row == "a" else "force"}

    def _formula(self, text: str) -> Formula:
        try:
            return read(text, None, curves=True)
        except FormulaError as error:
            raise ModelError(f"stop '{self.name}': {error}", self.name) from None

    def names(self, measures: Mapping[str, Any]) -> frozenset[str]:
        """The names in its formula, or in that of the measure which it names."""
        return self._formula(self._text(measures)).names

    def _text(self, measures: Mapping[str, Any]) -> str:
        return measures[self.of].of if self.of in measures else self.of

    def compiled(
        self,
        scope: Scope,
        measures: Mapping[str, Any],
        quantities: Mapping[str, Dimension | None],
        read: frozenset[str],
    ) -> tuple[Stop, dict[str, Formula]]:
        """The stop with its formula as a law, and what the numbers of that were made of.

        Parameters
        ----------
        scope : Scope
            Units and parameters.
        measures : mapping
            The measures of the mechanism by name.
        quantities : mapping
            The dimension of each measured quantity in the formula.
        read : frozenset of str
            What it measures, also by named quantities.

        Raises
        ------
        ModelError
            For what is no coordinate, and units that do not fit.
        """
        formula = self._formula(self._text(measures))
        for name in sorted(read):
            if name.rpartition(".")[2] not in COORDINATES or "." not in name:
                raise ModelError(
                    f"stop '{self.name}': '{name}' is no coordinate: take x, y and angle of bodies "
                    "and points",
                    self.name,
                )
        if not read:
            raise ModelError(
                f"stop '{self.name}': '{self.of}' has no coordinate: name x, y or angle of a body "
                "or a point",
                self.name,
            )
        known = dict(quantities) | ({"t": DIMENSIONS["time"]} if "t" in formula.names else {})
        try:
            dimension = formula_dimension(formula, scope, known)
            law, numbers = compile_measured(formula, scope, known, dimension)
        except FormulaError as error:
            raise ModelError(f"stop '{self.name}': {error}", self.name) from None
        kinds = {DIMENSIONS[key]: letter for key, letter in ROWS.items()}
        if dimension is not None and dimension not in kinds:
            raise ModelError(
                f"stop '{self.name}': '{self.of}' is {dimension_text(dimension)}: give a length or "
                "an angle, as the square root of an area",
                self.name,
            )
        made = {f"{self.name}.gap.{key}": formula for key, formula in numbers.items()}
        row = "l" if dimension is None else kinds[dimension]
        return replace(self, gap=law, row=row), made

    def every_candidate(self, at: Numbers) -> list[ContactCandidate]:
        """The one coordinate."""
        row = ConstraintPrimitive(
            "formula", "ground", "ground", self.row, [], at.law(self, "gap"), active_set=True
        )
        return [ContactCandidate.row(row, 1.0)]

    def restitution_of(self, at: Numbers) -> float:
        """Restitution, from 0 to 1."""
        return at[f"{self.name}.restitution"]  # type: ignore[return-value]  # one design

    def overlapping(
        self, depth: float, place: tuple[float, float], values: Mapping[str, Any], units: UnitSystem
    ) -> str:
        """By how much it is below zero."""
        return (
            f"the motion begins beyond the stop '{self.name}': '{self.of}' is {-depth:.6g} "
            f"{units.of('angle' if self.row == 'a' else 'length')}; begin where it is not negative"
        )


# -- Freewheels: clutches that hold one way ----------------------------------------------------


@dataclass(frozen=True)
class Freewheel(OneSided):
    """Freewheel, one-way clutch, ratchet, backstop: body j may turn ahead of body i, not fall
    behind it.

    ω_j − ω_i ≥ 0 and the torque T ≥ 0 of i on j with T (ω_j − ω_i) = 0: it holds without play at
    whatever angle it is, and separates as soon as it would have to hold back. Pins keep the bodies
    in place. Where it is rotated the wrong way by an impact it holds without rebound.

    Parameters
    ----------
    name : str
        Unique in the mechanism.
    i, j : Marker or str
        Places on the two bodies, such as ``"ground.O"`` and ``"wheel.O"``; i drives j.
    clockwise : bool
        Whether ahead is clockwise.

    Notes
    -----
    It acts in `simulate`, where ``run.contact(name)`` is the torque and ``run.mode(name)`` "open"
    or "stick"; all other analyses leave it out, with a note.

    Examples
    --------
    >>> Freewheel("hub", "sprocket.O", "wheel.O").bodies
    ('sprocket', 'wheel')
    """

    main: ClassVar[tuple[str, ...]] = ("i", "j")

    i: InheritedPlace = place_field()
    j: InheritedPlace = place_field()
    clockwise: bool = False

    def _check(self) -> None:
        super()._check()
        two_bodies(self)
        if not isinstance(self.clockwise, bool):
            raise ModelError(
                f"'{self.name}': clockwise must be True or False, not {self.clockwise!r}", self.name
            )

    @property
    def bodies(self) -> tuple[str, str]:
        """(body of i, body of j)."""
        return self.i.body, self.j.body

    def quantities(self) -> dict[str, str]:
        """Quantities of a contact; the normal reaction is a torque."""
        return super().quantities() | {"contact": "torque"}

    def every_candidate(self, at: Numbers) -> list[ContactCandidate]:
        """The angle between the bodies, from where it holds."""
        row = ConstraintPrimitive("angle", *self.bodies, "a", [0.0], active_set=True)
        return [ContactCandidate.one_way(row, -1.0 if self.clockwise else 1.0)]

    def overlapping(
        self, depth: float, place: tuple[float, float], values: Mapping[str, Any], units: UnitSystem
    ) -> str:
        """Nowhere: any angle will do."""
        raise AssertionError(f"'{self.name}' has no angle that it must not have")
