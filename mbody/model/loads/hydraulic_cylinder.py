"""A hydraulic cylinder with a valve: oil flows through orifices, its stiffness makes pressures."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

from mbody.errors import ModelError
from mbody.model.element import LawLike, NumberField, OptionalNumberField, law_field, number_field
from mbody.model.loads._base import BetweenPlaces
from mbody.model.own_equations import OwnState, equation, signal_of
from mbody.model.primitives import ForcePrimitive

if TYPE_CHECKING:
    from mbody.model.element import Numbers

__all__ = ["HydraulicCylinder"]

#: Part of the nominal pressure drop below which flow through an orifice is laminar, nearly linear.
LAMINAR = 0.001


@dataclass(frozen=True)
class HydraulicCylinder(BetweenPlaces):
    """Double-acting cylinder between two places, fed by a proportional four-way valve.

    Chamber a pushes the places apart, chamber b, on the side of the rod, pulls them together. The
    pressures are states of its own, "name.pressure_a" and "name.pressure_b":

        ṗ_a = β/(V + A_a x) · (Q_a − A_a ẋ − R_a),
        ṗ_b = β/(V + A_b (h − x)) · (Q_b + A_b ẋ − R_b),

    with the stroke x = distance − closed, the flow R of relief valves, and flows through orifices
    Q = u k √Δp: an opening u > 0 connects the supply with a and b with the tank, u < 0 the other
    way round.

    Parameters
    ----------
    name : str
        Unique in the mechanism.
    i, j : Marker or str
        The ends of barrel and rod.
    bore, rod : float
        Diameters of piston and rod [length].
    closed : float
        Distance of the places at stroke zero [length].
    stroke : float
        The greatest stroke, h [length]; the ends are not stops.
    valve : Law, float, str
        Opening u of the valve, −1 … 1 (it saturates there), as a function of time or a formula.
    flow, drop : float
        Nominal flow of the open valve [volume/time] at this drop of pressure across one edge
        [pressure]: k = flow/√drop.
    supply, tank : float
        Pressures of supply and tank [pressure].
    bulk_modulus : float
        Of the oil and its hoses, β [pressure].
    dead_volume : float
        Oil of each chamber at its least, V [volume].
    relief : float, optional
        Pressure at which each chamber's relief valve opens [pressure]; it passes the nominal flow
        at a tenth more.
    start_a, start_b : float
        Pressures at the first instant [pressure].

    Notes
    -----
    Below a thousandth of the nominal drop the flow is nearly linear in it, as in a laminar gap: so
    its slope stays finite where a drop changes its sign.

    Source: Merritt, Hydraulic Control Systems, chapters 3 and 6.

    Examples
    --------
    >>> HydraulicCylinder(
    ...     "lift", "ground.A", "boom.B", bore="50 mm", rod="28 mm", closed="0.5 m", stroke="0.4 m",
    ...     flow="40 l/min", drop="5 bar", supply="160 bar", bulk_modulus="1.4 GPa",
    ...     dead_volume="50 cm^3",
    ... ).bodies
    ('ground', 'boom')
    """

    main: ClassVar[tuple[str, ...]] = ("i", "j")
    along_line: ClassVar[bool] = True

    bore: NumberField = number_field("length", 0.0, sign="positive")
    rod: NumberField = number_field("length", 0.0, sign="not negative")
    closed: NumberField = number_field("length", 0.0, sign="positive")
    stroke: NumberField = number_field("length", 0.0, sign="positive")
    valve: LawLike = law_field("number", 0.0)
    flow: NumberField = number_field("volume flow", 0.0, sign="positive")
    drop: NumberField = number_field("pressure", 0.0, sign="positive")
    supply: NumberField = number_field("pressure", 0.0, sign="positive")
    tank: NumberField = number_field("pressure", 0.0, sign="not negative")
    bulk_modulus: NumberField = number_field("pressure", 0.0, sign="positive")
    dead_volume: NumberField = number_field("volume", 0.0, sign="positive")
    relief: OptionalNumberField = number_field("pressure", None, sign="positive")
    start_a: NumberField = number_field("pressure", 0.0, sign="not negative")
    start_b: NumberField = number_field("pressure", 0.0, sign="not negative")

    def _check(self) -> None:
        super()._check()
        if self.rod >= self.bore:
            raise ModelError(
                f"'{self.name}': rod is {self.rod:g} and bore {self.bore:g}: the rod must be "
                "thinner than the piston",
                self.name,
            )

    def own_states(self) -> tuple[OwnState, ...]:
        """The pressures of both chambers."""
        opening = "clamp(valve, -1, 1)"
        into, out = f"max({opening}, 0)", f"min({opening}, 0)"
        a, b = "pressure_a", "pressure_b"
        filled = f"{into}*{_orifice('supply', a)} + {out}*{_orifice(a, 'tank')}"
        other = f"-{into}*{_orifice(b, 'tank')} - {out}*{_orifice('supply', b)}"
        x = "(length - closed)"
        rates = {
            "a": f"bulk_modulus/(dead_volume + {AREA_A}*{x})"
            f"*(flow*({filled}) - {AREA_A}*rate - {self._relieved('a')})",
            "b": f"bulk_modulus/(dead_volume + {AREA_B}*(stroke - {x}))"
            f"*(flow*({other}) + {AREA_B}*rate - {self._relieved('b')})",
        }
        size = self.supply if isinstance(self.supply, float) else None
        return tuple(
            OwnState(
                f"{self.name}.pressure_{chamber}",
                equation(rate, self.name),
                "pressure",
                getattr(self, f"start_{chamber}"),
                f"{self.name}.start_{chamber}",
                size,
            )
            for chamber, rate in rates.items()
        )

    def _relieved(self, chamber: str) -> str:
        pressure = f"pressure_{chamber}"
        return "0" if self.relief is None else f"flow*10*max({pressure} - relief, 0)/relief"

    def actions(self, at: Numbers) -> list[ForcePrimitive]:
        """One action; parameters are both arms."""
        parameters = [*at.arm(self, "i"), *at.arm(self, "j"), 0.0, 0.0]
        tension = signal_of(equation(f"pressure_b*{AREA_B} - pressure_a*{AREA_A}", self.name))
        return [ForcePrimitive("stretch", self.i.body, self.j.body, parameters, law=tension)]


#: Areas of the piston in the chambers.
AREA_A = f"({math.pi / 4.0!r}*bore*bore)"
AREA_B = f"({math.pi / 4.0!r}*(bore*bore - rod*rod))"


def _orifice(first: str, second: str) -> str:
    """Flow from one pressure to another, as a part of the nominal flow: ±√(|Δp|/drop), smooth."""
    part = f"(({first} - {second})/drop)"
    return f"{part}/sqrt(sqrt({part}*{part} + {LAMINAR**2!r}))"
