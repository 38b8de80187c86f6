"""A cylinder with self-acting valves: the pressures in it over the stroke of the piston."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from mbody.core.decorators import inline, njit
from mbody.core.lanes import larger, smaller
from mbody.errors import ModelError
from mbody.model.element import Place, number_field, place_field, two_bodies
from mbody.model.loads._base import Load
from mbody.model.primitives import ForcePrimitive, load_physics
from mbody.quantities.formula import NumberField, OptionalNumberField

if TYPE_CHECKING:
    from mbody.model.element import Numbers


@dataclass(frozen=True)
class ReciprocatingCylinder(Load):
    """Cylinder of a piston machine with self-acting valves, single- or double-acting: suction,
    compression, delivery, expansion; the indicator diagram of a liquid or a gas.

    A chamber of the volume A h, h = clearance + travel of the piston from its `near` dead centre,
    holds a liquid of bulk modulus K, or a gas, p Vⁿ = const; a valve opens where the pressure
    reaches that outside. With c the clearance and H = c + stroke,

    while h falls:  p = min(p_s + K ln(H/h), p_d),   gas  min((p_s + p₀)(H/h)ⁿ − p₀, p_d)
    while h grows:  p = max(p_d − K ln(h/c), p_s),   gas  max((p_d + p₀)(c/h)ⁿ − p₀, p_s)

    The force p A drives the piston from `near` to `far`, its opposite acts on the cylinder. In a
    double-acting cylinder the chamber on the other side is least at `far`.

    Parameters
    ----------
    name : str
        Unique in the mechanism.
    i : Marker or str
        The cylinder: the marker's `angle` is the line of stroke.
    j : Marker or str
        The piston; the force acts on the line through it.
    area : float
        Of the face of the piston [area].
    opposite_area : float, optional
        Of the other face, of a double-acting piston [area].
    near, far : float
        Coordinate of the place on j along the line of stroke from the place on i [length] at the
        dead centre where the chamber is least, and where it is greatest.
    clearance : float
        What is left of a chamber where it is least: its volume there by the area [length].
    suction, delivery : float
        Gauge pressures outside the two valves, p_s and p_d [force/area].
    bulk_modulus : float, optional
        K of a liquid [force/area].
    exponent : float, optional
        Instead, n of a gas: 1 isothermal, 1.4 adiabatic air.
    ambient : float
        p₀, what makes gauge pressures absolute, for a gas [force/area].

    Raises
    ------
    ModelError
        For both or neither of a liquid and a gas, no stroke, or valves that never open.

    Notes
    -----
    At rest a chamber counts as being compressed: in statics the piston works against delivery;
    of a double-acting cylinder both do. Beyond the dead centres pressures stay what they are there.
    Valves have no mass and no loss.

    Source: the bulk modulus is K = −V dp/dV; the diagram of suction, compression, delivery and
    expansion with clearance is that of R. S. Khurmi and J. K. Gupta, *A Textbook of Thermal
    Engineering*, chapter on reciprocating compressors.

    Examples
    --------
    >>> cylinder = ReciprocatingCylinder(
    ...     "cylinder", "ground", "piston", area=0.02, near=0.6, far=0.3, clearance=0.05,
    ...     delivery=2e7, bulk_modulus=2e9
    ... )
    >>> round(cylinder.pressure(0.6, 1.0) / 1e7, 6), cylinder.pressure(0.3, -1.0)
    (2.0, 0.0)
    """

    main: ClassVar[tuple[str, ...]] = ("i", "j")

    i: Place = place_field()
    j: Place = place_field()
    area: NumberField = number_field("area", 0.0, sign="positive")
    opposite_area: OptionalNumberField = number_field("area", None, sign="positive")
    near: NumberField = number_field("length", 0.0)
    far: NumberField = number_field("length", 0.0)
    clearance: NumberField = number_field("length", 0.0, sign="positive")
    suction: NumberField = number_field("pressure", 0.0)
    delivery: NumberField = number_field("pressure", 0.0)
    bulk_modulus: OptionalNumberField = number_field("pressure", None, sign="positive")
    exponent: OptionalNumberField = number_field("number", None, sign="positive")
    ambient: NumberField = number_field("pressure", 0.0, sign="not negative")

    def _check(self) -> None:
        super()._check()
        two_bodies(self)
        if (self.bulk_modulus is None) == (self.exponent is None):
            both = "both" if self.exponent is not None else "neither"
            joined = "and" if self.exponent is not None else "nor"
            raise ModelError(
                f"'{self.name}' has {both} bulk_modulus {joined} exponent: give one of them, of a "
                "liquid or of a gas",
                self.name,
            )
        if self.near == self.far:
            raise ModelError(
                f"'{self.name}' has no stroke: near and far are both {self.far:g}: give the two "
                "dead centres of the piston along the line of stroke",
                self.name,
            )
        if self.delivery <= self.suction:
            raise ModelError(
                f"'{self.name}': delivery is {self.delivery:g}, suction {self.suction:g}: the "
                "pressure of delivery must be the greater one",
                self.name,
            )
        # without its upper bound, the pressure at the end of the stroke
        most = self.pressure(self.near, self.near - self.far, shut=True)
        if not most >= self.delivery:
            remedy = "a smaller clearance, or a greater bulk_modulus"
            if self.bulk_modulus is None:
                remedy = "a smaller clearance, a greater exponent, or ambient where it is missing"
            raise ModelError(
                f"'{self.name}' never opens its delivery valve: a whole stroke raises the pressure "
                f"from {self.suction:g} to {most:g}, less than delivery, {self.delivery:g}: give "
                f"it {remedy}",
                self.name,
            )

    @property
    def bodies(self) -> tuple[str, str]:
        """(cylinder, piston)."""
        return self.i.body, self.j.body

    def pressure(
        self, coordinate: float, rate: float, *, opposite: bool = False, shut: bool = False
    ) -> float:
        """Gauge pressure [force/area] with the piston there and moving so along the line of stroke.

        Parameters
        ----------
        coordinate, rate : float
            Of the place on j along the line of stroke [length], [length/time].
        opposite : bool
            Whether in the chamber on the other side.
        shut : bool
            Whether the valves stay shut, so that the pressure has no bounds.
        """
        near, far = (self.far, self.near) if opposite else (self.near, self.far)
        direction = 1.0 if far > near else -1.0
        gas = self.bulk_modulus is None
        travelled, stroke = direction * (coordinate - near), abs(far - near)
        stiff = self.exponent if gas else self.bulk_modulus
        valves = self.suction, self.delivery
        law = stiff, float(gas), self.ambient
        found = charge(
            travelled, direction * rate, stroke, self.clearance, *valves, *law, float(not shut)
        )
        return float(found)

    def actions(self, at: Numbers) -> list[ForcePrimitive]:
        """An action for each chamber: as of `PistonPressure`, then what `charge` takes, counted
        from the mass centre of i.
        """
        name, gas = self.name, self.bulk_modulus is None
        angle, near, far = at.angle(self, "i"), at[f"{name}.near"], at[f"{name}.far"]
        ix, iy = at.arm(self, "i")
        ux, uy = np.cos(angle), np.sin(angle)
        origin, direction = ux * ix + uy * iy, np.sign(far - near)
        keys = ("clearance", "suction", "delivery", "exponent" if gas else "bulk_modulus")
        more: list[Any] = [np.abs(far - near), *(at[f"{name}.{key}"] for key in keys)]
        more += [float(gas), at[f"{name}.ambient"]]
        faces = [("area", near, direction), ("opposite_area", far, -direction)]
        return [
            ForcePrimitive(
                "chamber",
                *self.bodies,
                [*at.arm(self, "j"), ux, uy, s * at[f"{name}.{face}"], 0.0, origin + end, s, *more],
            )
            for face, end, s in faces
            if getattr(self, face) is not None
        ]


@load_physics("chamber", form="piston")
@inline
def travel(i, j, u, arm, d):
    """(s, ṡ) = u · d and its rate: d from the mass centre of i to the place on j."""
    vx = j[5] - j[7] * arm[1] - i[5] + i[7] * d[1]
    vy = j[6] + j[7] * arm[0] - i[6] - i[7] * d[0]
    return u[0] * d[0] + u[1] * d[1], u[0] * vx + u[1] * vy


@njit
def charge(travel, rate, stroke, clearance, suction, delivery, stiff, gas, ambient, valves):
    """Pressure where the piston has gone `travel` from the near dead centre, moving at `rate` from
    it.

    Growing: from p_d at h = c; else from p_s at h = H. A liquid: p + K ln(h₀/h); a gas:
    (p + p₀)(h₀/h)ⁿ − p₀.
    """
    h = clearance + smaller(larger(travel, 0.0), stroke)
    p, last = suction, clearance + stroke
    if rate > 0.0:
        p, last = delivery, clearance
    if gas > 0.0:
        p = (p + ambient) * np.power(last / h, stiff) - ambient
    else:
        p = p + stiff * np.log(last / h)
    return p if valves == 0.0 else smaller(larger(p, suction), delivery)
