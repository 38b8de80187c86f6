"""An induction motor on a body, by Kloss's curve of torque by slip; direct or star–delta start."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

from mbody.errors import ModelError
from mbody.model.element import equation, number_field, signal_of
from mbody.model.loads._base import Turning
from mbody.model.primitives import ForcePrimitive
from mbody.quantities.formula import NumberField, OptionalNumberField

if TYPE_CHECKING:
    from mbody.model.element import Numbers


#: Torque and line current in star, as parts of those in delta: the voltage of a winding is 1/√3.
STAR = "(1/3)"


@dataclass(frozen=True)
class InductionMotor(Turning):
    """Three-phase induction motor with a gear: T = n · 2 T_b/(s/s_b + s_b/s), s = 1 − n ω/ω_s.

    It runs up from standstill by its own torque, T = n · 2 T_b s_b/(1 + s_b²) there, and brakes
    above the synchronous speed.

    Parameters
    ----------
    name : str
        Unique in the mechanism.
    body : str
        Name of the body that it turns.
    by : str
        The body that carries the motor, by default the ground.
    breakdown_torque : float
        The greatest torque of the rotor, T_b [torque].
    breakdown_slip : float
        The slip at which it is reached, s_b, usually 0.1 to 0.3.
    synchronous : float
        Speed of the field, ω_s [angular velocity]; below zero, the motor turns clockwise.
    ratio : float
        Turns of the rotor for one of the body, n. The rotor is part of the body: its moment of
        inertia counts n² times there, where the motor is carried by the ground.
    star_until : float, optional
        Star–delta start by time: until then [time] torque and line current are a third.
    star_below : float, optional
        Star–delta start by speed: so they are while the rotor turns slower than this [angular
        velocity, its magnitude].
    starting_current : float, optional
        Line current at standstill in delta, I₁ [current]; then "motor.current" is measured, by the
        same equivalent circuit: I = I₁ |s| √((1 + s_b²)/(s² + s_b²)).

    Notes
    -----
    Kloss's curve is that of an equivalent circuit without resistance of the stator, and of currents
    that have settled: transients of a few periods of the mains are left out. The change to delta is
    a jump of the torque.

    Source: M. Kloss, Archiv für Elektrotechnik 5 (1916) 59; Fitzgerald, Kingsley, Umans, Electric
    Machinery, chapter 6.

    Examples
    --------
    >>> from mbody import Body, InductionMotor, Mechanism, Revolute, simulate
    >>> machine = Mechanism("a fan")
    >>> machine.add(Body("fan", mass=1.0, inertia=0.5), Revolute("O", "ground", "fan"))
    >>> numbers = {"breakdown_torque": "60 N*m", "breakdown_slip": 0.2, "synchronous": "1500 rpm"}
    >>> machine.add(InductionMotor("motor", "fan", **numbers))
    >>> run = simulate(machine, 10.0)
    >>> round(float(run["fan"].omega[-1]) * 30 / 3.141592653589793, 3)
    1500.0
    """

    main: ClassVar[tuple[str, ...]] = ("body",)
    by_angle: ClassVar[bool] = True

    breakdown_torque: NumberField = number_field("torque", 0.0, sign="positive")
    breakdown_slip: NumberField = number_field("number", 0.0, sign="positive")
    synchronous: NumberField = number_field("angular velocity", 0.0)
    ratio: NumberField = number_field("number", 1.0)
    star_until: OptionalNumberField = number_field("time", None)
    star_below: OptionalNumberField = number_field("angular velocity", None, sign="positive")
    starting_current: OptionalNumberField = number_field("current", None, sign="positive")

    def _check(self) -> None:
        super()._check()
        if self.synchronous == 0.0:
            raise ModelError(
                f"'{self.name}': synchronous is 0, a motor needs a turning field: give its speed, "
                'such as "1500 rpm"',
                self.name,
            )
        if self.star_until is not None and self.star_below is not None:
            raise ModelError(
                f"'{self.name}' has both star_until and star_below: give the time or the speed at "
                "which it changes to delta",
                self.name,
            )

    def outputs(self) -> dict[str, tuple[str, str]]:
        """The slip, and the line current where that at standstill is known."""
        found = {"slip": (self._slip, "number")}
        if self.starting_current is not None:
            square = f"({self._slip}*{self._slip} + breakdown_slip*breakdown_slip)"
            part = f"sqrt((1 + breakdown_slip*breakdown_slip)/{square})"
            current = f"starting_current*abs({self._slip})*{part}*{self._torque_fraction}"
            found["current"] = (current, "current")
        return found

    @property
    def _slip(self) -> str:
        return "(1 - ratio*rate/synchronous)"

    @property
    def _torque_fraction(self) -> str:
        """Fraction of torque and current, as a formula: 1 in delta, 1/3 in star."""
        if self.star_until is not None:
            return f"({STAR} + (1 - {STAR})*step(t - star_until))"
        if self.star_below is not None:
            return f"({STAR} + (1 - {STAR})*step(abs(ratio*rate) - star_below))"
        return "1"

    def actions(self, at: Numbers) -> list[ForcePrimitive]:
        """A torque by Kloss's curve, without a division by the slip."""
        s = self._slip
        kloss = f"2*breakdown_torque*breakdown_slip*{s}/({s}*{s} + breakdown_slip*breakdown_slip)"
        text = f"ratio*sign(synchronous)*{kloss}*{self._torque_fraction}"
        torque = signal_of(equation(text, self.name))
        return [ForcePrimitive("torque", self.by, self.body, [], (torque,))]
