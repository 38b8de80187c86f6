"""Pressures on the two faces of a piston, given over the cycle of a crank."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from mbody.core.decorators import inline
from mbody.core.lanes import value
from mbody.core.tolerances import TABLE_RANGE_MARGIN
from mbody.errors import ModelError
from mbody.laws import Cam, Table
from mbody.model.element import (
    BodyName,
    LawLike,
    Place,
    body_field,
    law_field,
    number_field,
    place_field,
    two_bodies,
)
from mbody.model.loads._base import Load
from mbody.model.primitives import ForcePrimitive, load_physics, turned
from mbody.quantities.formula import NumberField

if TYPE_CHECKING:
    from mbody.model.element import Numbers


TURN = 2.0 * math.pi


@dataclass(frozen=True)
class PistonPressure(Load):
    """Gas or liquid pressures on a double-acting piston: laws of the angle of a crank, the cycle.

    F = p_head(x) A_head − p_rod(x) A_rod on the piston, along the x axis of the marker on i, and
    the opposite on the cylinder;  x = θ_cycle + phase, within one turn, 0 ≤ x < 2π.

    Parameters
    ----------
    name : str
        Unique in the mechanism.
    i : Marker or str
        The cylinder: the marker's `angle` is the line of stroke, out of the head towards the rod.
    j : Marker or str
        The piston; both forces act on the line through it.
    cycle : str
        The body, such as the crank, whose angle from the ground's x axis the pressures follow. For
        a cycle of two turns name a shaft geared to half the speed.
    head_area, rod_area : float
        Areas of the faces at the head and at the rod [area].
    head, rod : Law, float or callable
        Gauge pressures [force/area] as functions of x [rad].
    phase : float
        Added to the angle [rad]: a second cylinder whose cycle is a quarter late has −π/2.

    Raises
    ------
    ModelError
        For a table that does not cover the cycle, a program that repeats in another rhythm, or no
        area at all.

    Notes
    -----
    A law may jump at the end of the turn, as where a valve opens there: a table that does not is
    smooth there only if it is `periodic`.

    Source: R. S. Khurmi and J. K. Gupta, *Theory of Machines*, chapter 15 (net load on the piston
    of a double-acting engine, p₁ A₁ − p₂ A₂).

    Examples
    --------
    >>> from mbody.laws import Table
    >>> head = Table([0.0, 2.0, 6.2831853072], [5.0, 1.0, 5.0], periodic=True)
    >>> PistonPressure("gas", "ground.head", "piston", "crank", 0.02, 0.017, head=head).bodies
    ('ground', 'ground', 'crank', 'piston')
    """

    main: ClassVar[tuple[str, ...]] = ("i", "j")

    i: Place = place_field()
    j: Place = place_field()
    cycle: BodyName = body_field()
    head_area: NumberField = number_field("area", 0.0, sign="not negative")
    rod_area: NumberField = number_field("area", 0.0, sign="not negative")
    head: LawLike = law_field("pressure", 0.0, of="angle")
    rod: LawLike = law_field("pressure", 0.0, of="angle")
    phase: NumberField = number_field("angle", 0.0)

    def _check(self) -> None:
        super()._check()
        two_bodies(self)
        if self.head_area == self.rod_area == 0.0:
            raise ModelError(
                f"'{self.name}' presses on no area: give head_area, rod_area or both", self.name
            )
        for side in ("head", "rod"):
            _check_cycle(self, side)

    @property
    def bodies(self) -> tuple[str, ...]:
        """(cylinder, what the angle is measured from, body of the cycle, piston)."""
        return self.i.body, "ground", self.cycle, self.j.body

    @property
    def angles_of(self) -> tuple[str, str]:
        """The two bodies whose axes it goes by, whatever places it has on them."""
        return "ground", self.cycle

    def actions(self, at: Numbers) -> list[ForcePrimitive]:
        """An action for each face; parameters are the arm on j, the direction in i, the area
        (positive where pressure pushes along it) and the phase.
        """
        name = self.name
        ends = self.i.body, self.j.body
        angle = at.angle(self, "i")
        place: list[Any] = [*at.arm(self, "j"), np.cos(angle), np.sin(angle)]
        phase = at[f"{name}.phase"]
        areas = at[f"{name}.head_area"], -at[f"{name}.rod_area"]
        return [
            ForcePrimitive(
                "pressure", *ends, [*place, area, phase], law=at.law(self, side), by=self.cycle
            )
            for side, area in zip(("head", "rod"), areas, strict=True)
        ]


def _check_cycle(load: PistonPressure, side: str) -> None:
    """Refuse a table or a program that does not define the pressure over one turn."""
    law = getattr(load, side)
    period = None
    if isinstance(law, Cam):
        period = float(law.period)
    elif isinstance(law, Table):
        first, last = float(law.x[0]), float(law.x[-1])
        if law.periodic:
            period = last - first
        else:
            _check_covers(load, side, first, last, law.outside)
    if period is None:
        return
    times = TURN / period
    if round(times) < 1 or abs(times - round(times)) > TABLE_RANGE_MARGIN * times:
        raise ModelError(
            f"'{load.name}': {side} repeats every {math.degrees(period):.6g} deg, which does not "
            f"go into the cycle of 360 deg of '{load.cycle}': give it a period of 360 deg, or a "
            "whole part of it",
            load.name,
        )


def _check_covers(load: PistonPressure, side: str, first: float, last: float, outside: str) -> None:
    """Refuse a table that ends within the cycle, or after it."""
    covers = f"'{load.name}': the table of {side} covers {_deg(first)} to {_deg(last)} deg, the"
    slack = TABLE_RANGE_MARGIN * TURN
    if first < -slack or last > TURN + slack:
        raise ModelError(
            f"{covers} cycle of '{load.cycle}' is one turn, 0 to 360 deg: leave out what is "
            "beyond; for a cycle of two turns, name a shaft that turns at half the speed",
            load.name,
        )
    ends = (0.0, first), (last, TURN)
    gaps = [f"{_deg(a)} to {_deg(b)} deg" for a, b in ends if b - a > slack]
    if gaps and outside == "error":
        raise ModelError(
            f"{covers} cycle of '{load.cycle}' needs 0 to 360 deg: {' and '.join(gaps)} "
            f"{'are' if len(gaps) > 1 else 'is'} missing; add points, or let it hold its last "
            'value, outside="hold"',
            load.name,
        )


def _deg(angle: float) -> str:
    return f"{math.degrees(angle):.6g}"


@load_physics("pressure", form="piston")
@inline
def piston(i, j, p):
    """(u, p_j, d): the line of stroke in the world, the arm on j, and the place on j seen from i.

    The force f on the piston is f u at p_j, its opposite on the cylinder has the moment −d × f u.
    """
    u = turned(i[3], i[4], p[2], p[3])
    arm = turned(j[3], j[4], p[0], p[1])
    return u, arm, (j[0] + arm[0] - i[0], j[1] + arm[1] - i[1])


@inline
def within_cycle(x):
    """x mod 2π, 0 ≤ x < 2π: rounding may make a whole turn of what is just below none."""
    r = x - TURN * np.floor(value(x / TURN))
    return 0.0 if r >= TURN else r
