"""Tyre on a road: its load by its spring, its longitudinal force by the magic formula."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from mbody.errors import ModelError
from mbody.model.element import AuxiliaryState, equation, number_field, signal_of
from mbody.model.loads._base import FORCES, BetweenPlaces
from mbody.model.primitives import ForcePrimitive
from mbody.quantities.formula import NumberField

if TYPE_CHECKING:
    from mbody.model.element import Numbers


#: The load: what the spring and the damper of the tyre press, never a pull.
LOAD = "max(stiffness*(radius - height) - damping*sinking, 0)*step(radius - height)"
#: Velocity of the tyre over the road where they touch.
SLIDING = "(speed + height*spin)"
#: What the magic formula takes of the slip.
STEEP = "steepness*slip"
MAGIC = f"sin(shape*atan({STEEP} - curvature*({STEEP} - atan({STEEP}))))"


@dataclass(frozen=True)
class Tyre(BetweenPlaces):
    """Tyre of a wheel on a straight road that is fixed to the ground: it is pressed by its own
    stiffness, and pushed along the road by the magic formula of Pacejka.

    With h the height of the wheel's centre above the road, v its velocity along it and ω the rate
    of the wheel, F_N = max(k (r − h) − c ḣ, 0) as long as h < r, and

        F = μ F_N sin(C atan(B κ − E (B κ − atan(B κ)))),    σ κ̇ = −(v + h ω) − |v| κ.

    κ, "tyre.slip", is a state of its own: at a constant speed it is the slip −(v + h ω)/|v|, −1 of
    a wheel that is locked, and follows it over the length σ, the relaxation length. At a standstill
    it is what the tyre is deflected, −∫ (v + h ω) dt/σ, so that the tyre holds a vehicle on a slope
    as a spring does, without creep, and a vehicle that has stopped swings on it.

    Parameters
    ----------
    name : str
        Unique in the mechanism.
    i : Marker or str
        A place of the road on the ground; the marker's x axis is the road, which is on its right.
    j : Marker or str
        The centre of the wheel.
    radius : float
        r, without load [length].
    stiffness : float
        k, of the tyre across the road [force/length].
    damping : float
        c, across the road [force·time/length].
    friction : float
        μ, the greatest force by the load.
    steepness, shape, curvature : float
        B, C and E. The slope at slip zero is B C μ F_N. With C < 1 the force has no peak; with E at
        most 1 it does not change its sign.
    relaxation : float
        σ [length], half of a wheel's radius to a whole one.
    start : float
        Slip at the first instant.

    Notes
    -----
    Measured as "tyre.slip", "tyre.load", "tyre.height", "tyre.speed", "tyre.sinking" and
    "tyre.spin". Its work passes as that of one load: what it takes is heat, and what its spring
    stores.

    Source: Pacejka, Tire and Vehicle Dynamics (2012), chapters 4 and 8; Bernard and Clover (1995)
    on low speeds.

    Examples
    --------
    >>> numbers = {"radius": 0.3, "stiffness": 2e5, "friction": 0.9, "relaxation": 0.3}
    >>> Tyre("tyre", "ground.O", "wheel.O", steepness=10.0, shape=1.6, **numbers).bodies
    ('ground', 'wheel')
    """

    main: ClassVar[tuple[str, ...]] = ("i", "j")
    on_line: ClassVar[bool] = True

    radius: NumberField = number_field("length", 0.0, sign="positive")
    stiffness: NumberField = number_field("stiffness", 0.0, sign="positive")
    damping: NumberField = number_field("damping", 0.0, sign="not negative")
    friction: NumberField = number_field("number", 0.0, sign="positive")
    steepness: NumberField = number_field("number", 0.0, sign="positive")
    shape: NumberField = number_field("number", 1.6, sign="positive")
    curvature: NumberField = number_field("number", 0.0)
    relaxation: NumberField = number_field("length", 0.0, sign="positive")
    start: NumberField = number_field("number", 0.0)

    def _check(self) -> None:
        super()._check()
        if self.i.body != "ground":
            raise ModelError(
                f"'{self.name}': its road is on '{self.i.body}': a tyre takes a road that is fixed "
                "to the ground; for a road that moves give a Contact of a disc with a line",
                self.name,
            )
        if self.curvature > 1.0:
            raise ModelError(
                f"'{self.name}': curvature is {self.curvature:g}: above 1 the force changes its "
                "sign at great slip; give 1 or less",
                self.name,
            )

    def quantities(self) -> dict[str, str]:
        """The force and its torque about the wheel's centre, and how the wheel goes."""
        motion = {"height": "length", "speed": "velocity", "sinking": "velocity"}
        return FORCES | {"torque": "torque"} | motion | {"spin": "angular velocity"}

    def auxiliary_states(self) -> tuple[AuxiliaryState, ...]:
        """The slip, which follows over the relaxation length."""
        rate = equation(f"-({SLIDING} + abs(speed)*slip)/relaxation", self.name)
        return (
            AuxiliaryState(f"{self.name}.slip", rate, "number", self.start, f"{self.name}.start"),
        )

    def outputs(self) -> dict[str, tuple[str, str]]:
        """Outputs of the load: the wheel load."""
        return {"load": (LOAD, "force")}

    def actions(self, at: Numbers) -> list[ForcePrimitive]:
        """The load and the force along the road at the centre, and the torque of the latter."""
        beta = at.angle(self, "i")
        along, across = (np.cos(beta), np.sin(beta)), (-np.sin(beta), np.cos(beta))
        texts = (LOAD, f"friction*{LOAD}*{MAGIC}", f"height*friction*{LOAD}*{MAGIC}")
        load, push, torque = (signal_of(equation(text, self.name)) for text in texts)
        arm, wheel = at.arm(self, "j"), self.j.body
        return [
            ForcePrimitive("force", "ground", wheel, [*arm, *across, 0.0], (load,)),
            ForcePrimitive("force", "ground", wheel, [*arm, *along, 0.0], (push,)),
            ForcePrimitive("torque", "ground", wheel, [], (torque,)),
        ]
