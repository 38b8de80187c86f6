"""Centrifugal loading of a plane that turns about an axis lying in it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar, NamedTuple

import numpy as np

from mbody.core.decorators import inline
from mbody.core.tolerances import INERTIA_DIGITS_TYPED, TINY
from mbody.errors import ModelError
from mbody.laws import Constant
from mbody.model.element import OptionalLaw, Place, law_field, number_field, place_field
from mbody.model.loads._base import Load
from mbody.model.primitives import ForcePrimitive, load_physics
from mbody.quantities.formula import NumberField

if TYPE_CHECKING:
    from mbody.model.element import Numbers
    from mbody.model.loads._base import LoadSummary


class Spindle(NamedTuple):
    """How a plane turns, arrays over instants: speed ω [rad/time], moment of inertia J about the
    axis [mass·length²], angular momentum H = J ω [mass·length²/time].
    """

    speed: Any
    inertia: Any
    momentum: Any


@dataclass(frozen=True)
class CentrifugalField(Load):
    """Centrifugal field of a spinning plane, as in a flyball machine: M a = f + ½ ω² ∂J/∂q.

    With n the unit normal to the axis and x = n · (r − r_axis), every mass element is pushed by
    ω² x n dm. On a body that is the force m ω² x_G n at the mass centre and the torque
    T = ½ ω² dI_nn/dθ, where I_nn = ∫ (n · ρ)² dm comes from the body's `spread` (the moment
    −ω² I_xy of the books). J = J₀ + Σ (m x_G² + I_nn).

    Parameters
    ----------
    name : str
        Unique in the mechanism.
    axis : Marker or str
        A place on the ground; the axis of turning is the x axis of the marker through it.
    speed : Law, float or callable, optional
        ω of the plane [rad/time] as a function of time, where something else sets it.
    momentum : Law, float or callable, optional
        Instead: the angular momentum H about the axis [mass·length²/time] of a spindle that is
        free to change its speed; ω = H/J at each position.
    inertia : float
        J₀ of the spindle itself about the axis [mass·length²].

    Raises
    ------
    ModelError
        When both or neither of speed and momentum are given, or the axis is not on the ground; when
        it is assembled with a massive body whose `spread` is missing or contradicts its inertia.

    Notes
    -----
    With constant H this is Routh's reduction, exact for a free spindle. Without any inertia about
    the axis (J = 0) a free spindle has no speed; it is then taken as zero.

    Examples
    --------
    >>> from mbody.model.element import Marker
    >>> upright = Marker("ground", (0.0, 0.0), np.pi / 2)
    >>> CentrifugalField("field", upright, speed=20.0).speed
    Constant(value=20.0)
    """

    main: ClassVar[tuple[str, ...]] = ("axis",)

    axis: Place = place_field("ground")
    speed: OptionalLaw = law_field("angular velocity", None)
    momentum: OptionalLaw = law_field("angular momentum", None)
    inertia: NumberField = number_field("inertia", 0.0, sign="not negative")
    conservative = True

    def _check(self) -> None:
        super()._check()
        if (self.speed is None) == (self.momentum is None):
            what = "neither" if self.speed is None else "both"
            joined = "nor" if self.speed is None else "and"
            raise ModelError(
                f"'{self.name}' has {what} speed {joined} momentum: give one of them", self.name
            )
        if self.axis.body != "ground":
            raise ModelError(
                f"'{self.name}': its axis is on '{self.axis.body}', which moves: the plane turns "
                "about an axis of the ground, give a place there",
                self.name,
            )

    @property
    def given(self) -> str:
        """The field that sets how the plane turns: "speed" or "momentum"."""
        return "momentum" if self.speed is None else "speed"

    @property
    def quadratic_in(self) -> str:
        """The speed, where it is constant."""
        return "speed" if isinstance(self.speed, Constant) else ""

    def line(self, summary: LoadSummary) -> str:
        """Speed or angular momentum, and the axis."""
        unit = summary.unit("angular velocity" if self.given == "speed" else "angular momentum")
        turning = f"{self.given} {summary.value(self, self.given)} {unit}"
        return f"{turning} about the axis in {self.axis}, on every mass"

    def actions(self, at: Numbers) -> list[ForcePrimitive]:
        """One action on all bodies: the axis, its normal, how ω is found, then (xx, yy, xy) of each
        body.
        """
        x, y = at.place(self, "axis")
        angle = at.angle(self, "axis")
        free = float(self.speed is None)
        parameters = [x, y, -np.sin(angle), np.cos(angle), free, at[f"{self.name}.inertia"]]
        for body in at.bodies:
            parameters += second_moments(at, body, self.name)
        return [
            ForcePrimitive("field", "ground", "ground", parameters, (at.law(self, self.given),))
        ]

    def spindle(self, run: Any) -> Spindle:
        """How the plane turns during a run: speed, moment of inertia and angular momentum.

        Parameters
        ----------
        run : Solution
            Of one design, of a mechanism with this load.
        """
        system = run.system
        if system.batch is not None:
            raise ModelError(
                f"the spindle of '{self.name}' is of one design, this is a batch of "
                f"{system.batch} designs: analyse one of them, system.design(n)",
                self.name,
            )
        # the physics as plain Python, on whole histories
        part: Any = getattr(centrifugal, "py_func", centrifugal)
        turning: Any = getattr(spin, "py_func", spin)
        *axis, free, whole = self.actions(system.numbers)[0].parameters[:6]
        for n, body in enumerate(system.numbers.bodies):
            pose, moments = run[body.name], second_moments(system.numbers, body, self.name)
            side = (pose.x, pose.y, 0.0, np.cos(pose.angle), np.sin(pose.angle))
            whole = whole + part(side, system.mass[3 * n, 0], axis, moments)[3]
        speed = turning(np.asarray(system.law_of(self, self.given)(run.t)), whole, free)
        return Spindle(speed, whole, whole * speed)


def second_moments(at: Numbers, body: Any, field: str) -> list[Any]:
    """∫x² dm, ∫y² dm, ∫xy dm of a body about its mass centre, link axes [mass·length²]."""
    name, spread = body.name, body.spread
    inertia = at[f"{name}.inertia"]
    mass = at[f"{name}.mass"] if body.weight is None else at[f"{name}.weight"]
    if not (np.any(mass) or np.any(inertia)):
        return [0.0, 0.0, 0.0]
    if spread is None:
        raise ModelError(
            f"'{field}' must know how the mass of '{name}' is spread in the plane: give "
            f"Body('{name}', spread=...) as \"point\", SlenderRod(angle) of a thin rod along that "
            "angle, or SecondMoments(xx, yy, xy)",
            name,
        )
    if spread == "point":
        if np.any(inertia):
            raise ModelError(
                f"'{name}': its spread is \"point\", but its inertia is {np.max(inertia):g}: give "
                "the inertia 0, or another spread",
                name,
            )
        return [0.0, 0.0, 0.0]
    if hasattr(spread, "angle"):
        angle = at[f"{name}.spread.angle"]
        c, s = np.cos(angle), np.sin(angle)
        return [inertia * c * c, inertia * s * s, inertia * c * s]
    xx, yy, xy = (at[f"{name}.spread.{key}"] for key in ("xx", "yy", "xy"))
    off = np.abs(xx + yy - inertia) > INERTIA_DIGITS_TYPED * np.maximum(np.abs(xx + yy), inertia)
    if np.any(off):
        which = int(np.argmax(off))
        both, own = (np.broadcast_to(v, np.shape(off)).flat[which] for v in (xx + yy, inertia))
        raise ModelError(
            f"'{name}': xx + yy of its spread is {both:.9g}, its inertia {own:.9g}: in the plane "
            "both are the same moment about the mass centre, change one of them",
            name,
        )
    return [xx, yy, xy]


@load_physics("field", form="spinning plane")
@inline
def centrifugal(j, m, p, moments):
    """(Fx, Fy, T)/ω² of one body and its part of J: m x n, ½ dI_nn/dθ, m x² + I_nn.

    n = (a, b) in link axes: I_nn = a² xx + 2ab xy + b² yy, and dn/dθ there is (b, −a).
    """
    nx, ny = p[2], p[3]
    xx, yy, xy = moments
    a, b = j[3] * nx + j[4] * ny, j[3] * ny - j[4] * nx
    x = nx * (j[0] - p[0]) + ny * (j[1] - p[1])
    twist = a * b * (xx - yy) + (b * b - a * a) * xy
    spread = a * a * xx + 2.0 * a * b * xy + b * b * yy
    return m * x * nx, m * x * ny, twist, m * x * x + spread


@inline
def spin(given, J, free):
    """ω: as given, or H/J of a free spindle; zero where there is no inertia."""
    return (1.0 - free) * given + free * given * J / (J * J + TINY)
