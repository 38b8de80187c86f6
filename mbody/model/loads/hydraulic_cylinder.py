"""A hydraulic cylinder with a valve: oil flows through orifices, its stiffness makes pressures."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar

from mbody.errors import ModelError
from mbody.model.element import (
    AccountedEnergy,
    AuxiliaryState,
    LawLike,
    equation,
    law_field,
    number_field,
    signal_of,
)
from mbody.model.loads._base import BetweenPlaces
from mbody.model.primitives import ForcePrimitive
from mbody.quantities.formula import NumberField, OptionalNumberField

if TYPE_CHECKING:
    from mbody.model.element import Numbers


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

    A motion accounts for the energy of the oil: ``run.energy.by`` has "lift.supplied", what the
    flow from the supply brings and that to the tank takes, ∫ (p_s Q_s − p_t Q_t) dt; "lift.lost",
    what the edges of the valve throttle, ∫ Σ Q Δp dt; "lift.relieved", the same of the relief
    valves; and "lift.compressed", what the oil takes to be compressed, ∫ Σ p V/β dp. The rest is
    the work on the piston, "lift".

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

    def auxiliary_states(self) -> tuple[AuxiliaryState, ...]:
        """The pressures of both chambers, and the energies of the oil."""
        x, gain_a, gain_b = "(length - closed)", self._gain("a"), self._gain("b")
        rates = {
            "a": f"bulk_modulus/(dead_volume + {AREA_A}*{x})*{gain_a}",
            "b": f"bulk_modulus/(dead_volume + {AREA_B}*(stroke - {x}))*{gain_b}",
        }
        size = self.supply if isinstance(self.supply, float) else None
        pressures = tuple(
            AuxiliaryState(
                f"{self.name}.pressure_{chamber}",
                equation(rate, self.name),
                "pressure",
                getattr(self, f"start_{chamber}"),
                f"{self.name}.start_{chamber}",
                size,
            )
            for chamber, rate in rates.items()
        )
        energies = tuple(
            AuxiliaryState(
                f"{self.name}.{key}", equation(power, self.name), "torque", accounts=True
            )
            for key, power in self._powers().items()
        )
        return (*pressures, *energies)

    def _gain(self, chamber: str) -> str:
        """Flow into a chamber less the volume that its piston makes, as a formula."""
        if chamber == "a":
            flow = f"{INTO}*{_orifice('supply', A)} + {OUT}*{_orifice(A, 'tank')}"
            return f"(flow*({flow}) - {AREA_A}*rate - {self._relieved('a')})"
        flow = f"-{INTO}*{_orifice(B, 'tank')} - {OUT}*{_orifice('supply', B)}"
        return f"(flow*({flow}) + {AREA_B}*rate - {self._relieved('b')})"

    def _powers(self) -> dict[str, str]:
        """Powers of the oil by what is accounted."""
        edges = (
            (INTO, "supply", A),
            (INTO, B, "tank"),
            (f"(-{OUT})", "supply", B),
            (f"(-{OUT})", A, "tank"),
        )
        flows = [f"{u}*{_orifice(*ends)}" for u, *ends in edges]
        drops = [f"({first} - {second})" for _, first, second in edges]
        relief = f"({self._relieved('a')} + {self._relieved('b')})"
        return {
            "supplied": f"flow*(supply*({flows[0]} + {flows[2]}) - tank*({flows[1]} + {flows[3]}))"
            f" - tank*{relief}",
            "lost": f"flow*({' + '.join(f'{d}*{q}' for d, q in zip(drops, flows, strict=True))})",
            "relieved": f"({A} - tank)*{self._relieved('a')} + ({B} - tank)*{self._relieved('b')}",
            "compressed": f"{A}*{self._gain('a')} + {B}*{self._gain('b')}",
        }

    def energies(
        self, own: Mapping[str, Any], numbers: Mapping[str, Any]
    ) -> dict[str, AccountedEnergy]:
        """The energies supplied, lost in the valve and by relief, and stored in the oil."""
        kinds = {"supplied": "work", "lost": "lost", "relieved": "lost", "compressed": "stored"}
        return {key: AccountedEnergy(kind, own[key]) for key, kind in kinds.items()}

    def _relieved(self, chamber: str) -> str:
        pressure = f"pressure_{chamber}"
        return "0" if self.relief is None else f"flow*10*max({pressure} - relief, 0)/relief"

    def actions(self, at: Numbers) -> list[ForcePrimitive]:
        """One action; parameters are both arms."""
        parameters = [*at.arm(self, "i"), *at.arm(self, "j"), 0.0, 0.0]
        tension = signal_of(equation(f"pressure_b*{AREA_B} - pressure_a*{AREA_A}", self.name))
        return [ForcePrimitive("stretch", self.i.body, self.j.body, parameters, law=tension)]


#: Both ways of the valve's opening, and the pressures.
INTO, OUT = "max(clamp(valve, -1, 1), 0)", "min(clamp(valve, -1, 1), 0)"
A, B = "pressure_a", "pressure_b"
#: Areas of the piston in the chambers.
AREA_A = f"({math.pi / 4.0!r}*bore*bore)"
AREA_B = f"({math.pi / 4.0!r}*(bore*bore - rod*rod))"


def _orifice(first: str, second: str) -> str:
    """Flow from one pressure to another, as a part of the nominal flow: ±√(|Δp|/drop), smooth."""
    part = f"(({first} - {second})/drop)"
    return f"{part}/sqrt(sqrt({part}*{part} + {LAMINAR**2!r}))"
