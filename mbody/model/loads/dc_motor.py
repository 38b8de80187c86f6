"""A direct-current motor on a body: voltage in, torque out, its current as a state of its own."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar

from mbody.model.element import (
    AccountedEnergy,
    AuxiliaryState,
    LawLike,
    equation,
    law_field,
    number_field,
    signal_of,
)
from mbody.model.loads._base import Turning
from mbody.model.primitives import ForcePrimitive
from mbody.quantities.formula import NumberField

if TYPE_CHECKING:
    from mbody.model.element import Numbers


@dataclass(frozen=True)
class DCMotor(Turning):
    """Direct-current motor with a gear: L di/dt = u − R i − k n ω, torque T = n k i.

    The current i is a state of its own, "motor.current", which begins at zero: a motor that is
    switched on at standstill draws the inrush u/R that its inductance lets through. ω is the rate
    of the body from the one that carries the motor, and n ω that of the rotor.

    Parameters
    ----------
    name : str
        Unique in the mechanism.
    body : str
        Name of the body that it turns.
    by : str
        The body that carries the motor, by default the ground.
    voltage : Law, float, str
        At the terminals [voltage], as a function of time or a formula of measured quantities.
    resistance : float
        Of the armature, R [resistance].
    inductance : float
        Of the armature, L [inductance].
    constant : float
        Torque by the current, k [torque/current]; it is also the voltage by the rate of the rotor,
        in V·s/rad.
    ratio : float
        Turns of the rotor for one of the body, n. Its losses are a damper of their own. The rotor
        is part of the body: its moment of inertia counts n² times there, where the motor is carried
        by the ground. On a moving body, give the rotor as a body of its own with a `Gear`.
    start : float
        The current at the first instant [current].

    Notes
    -----
    Measured as "motor.current", "motor.torque" and "motor.rate"; "motor.supplied" and "motor.lost"
    are the energies taken from the terminals, ∫ u i dt, and turned to heat, ∫ R i² dt. A motion
    accounts for them: ``run.energy.by`` has "motor.supplied", "motor.lost", and the energy of the
    magnetic field, ½ L i², as "motor.field".

    Source: Fitzgerald, Kingsley, Umans, Electric Machinery, chapter 7 (permanent-magnet motor).

    Examples
    --------
    >>> from mbody import Body, DCMotor, Mechanism, Revolute, simulate
    >>> machine = Mechanism("a flywheel")
    >>> machine.add(Body("wheel", mass=1.0, inertia=0.02), Revolute("O", "ground", "wheel"))
    >>> numbers = {"resistance": "0.5 ohm", "inductance": "2 mH", "constant": "0.1 N*m/A"}
    >>> machine.add(DCMotor("motor", "wheel", voltage="24 V", **numbers))
    >>> run = simulate(machine, 10.0)
    >>> round(float(run["wheel"].omega[-1]), 3)  # 24 V / 0.1 V·s at no load
    239.989
    """

    main: ClassVar[tuple[str, ...]] = ("body",)
    by_angle: ClassVar[bool] = True

    voltage: LawLike = law_field("voltage", 0.0)
    resistance: NumberField = number_field("resistance", 0.0, sign="positive")
    inductance: NumberField = number_field("inductance", 0.0, sign="positive")
    constant: NumberField = number_field("motor constant", 0.0, sign="positive")
    ratio: NumberField = number_field("number", 1.0)
    start: NumberField = number_field("current", 0.0)

    def auxiliary_states(self) -> tuple[AuxiliaryState, ...]:
        """The current, the energy supplied and the energy lost."""
        name = self.name
        rate = "(voltage - resistance*current - constant*ratio*rate)/inductance"
        return (
            AuxiliaryState(
                f"{name}.current", equation(rate, name), "current", self.start, f"{name}.start"
            ),
            AuxiliaryState(
                f"{name}.supplied", equation("voltage*current", name), "torque", accounts=True
            ),
            AuxiliaryState(
                f"{name}.lost",
                equation("resistance*current*current", name),
                "torque",
                accounts=True,
            ),
        )

    def energies(
        self, own: Mapping[str, Any], numbers: Mapping[str, Any]
    ) -> dict[str, AccountedEnergy]:
        """The energies supplied, lost and in the magnetic field."""
        first = numbers[f"{self.name}.start"]
        field = 0.5 * numbers[f"{self.name}.inductance"] * (own["current"] ** 2 - first**2)
        return {
            "supplied": AccountedEnergy("work", own["supplied"]),
            "lost": AccountedEnergy("lost", own["lost"]),
            "field": AccountedEnergy("stored", field),
        }

    def actions(self, at: Numbers) -> list[ForcePrimitive]:
        """A torque by the current."""
        torque = signal_of(equation("ratio*constant*current", self.name))
        return [ForcePrimitive("torque", self.by, self.body, [], (torque,))]
