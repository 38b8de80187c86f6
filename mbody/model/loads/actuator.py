"""An actuator between two places: a force along their line, by a formula, with its limits."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

from mbody.errors import ModelError
from mbody.model.element import (
    AuxiliaryState,
    LawLike,
    equation,
    law_field,
    number_field,
    signal_of,
)
from mbody.model.loads._base import BetweenPlaces
from mbody.model.primitives import ForcePrimitive
from mbody.quantities.formula import OptionalNumberField

if TYPE_CHECKING:
    from mbody.model.element import Numbers


@dataclass(frozen=True)
class Actuator(BetweenPlaces):
    """A force along the line between two places that pushes them apart where it is positive.

    What is commanded passes a dead band, then a saturation, then a lag whose rate is limited; each
    is there where its number is given.

    Parameters
    ----------
    name : str
        Unique in the mechanism.
    i, j : Marker or str
        The two places.
    push : Law, float, str
        The commanded force [force], as a function of time or a formula of measured quantities.
    dead_band : float, optional
        Commands within ± this give nothing, others less by it [force].
    limit : float, optional
        The greatest force either way [force].
    lag : float, optional
        Time constant of the force that is applied [time]: then it is a state of its own,
        "name.applied", which begins at zero.
    slew : float, optional
        The greatest rate of the applied force either way [force/time]; it needs a lag.

    Examples
    --------
    >>> from mbody import Actuator, Body, Mechanism, Prismatic, simulate
    >>> machine = Mechanism("a slide", ground={"O": (-1.0, 0.0)})
    >>> machine.add(Body("slide", mass=2.0), Prismatic("guide", "ground", "slide"))
    >>> machine.add(Actuator("drive", "ground.O", "slide", push="-50 N/m*slide.x + 9 N", limit=4.0))
    >>> run = simulate(machine, 0.1)
    >>> round(float(run["slide"].ax[0]), 6)
    2.0
    """

    main: ClassVar[tuple[str, ...]] = ("i", "j")
    along_line: ClassVar[bool] = True

    push: LawLike = law_field("force", 0.0)
    dead_band: OptionalNumberField = number_field("force", None, sign="not negative")
    limit: OptionalNumberField = number_field("force", None, sign="positive")
    lag: OptionalNumberField = number_field("time", None, sign="positive")
    slew: OptionalNumberField = number_field("force rate", None, sign="positive")

    def _check(self) -> None:
        super()._check()
        if self.slew is not None and self.lag is None:
            raise ModelError(
                f"'{self.name}' has slew, but no lag: give the time constant with which the "
                'applied force follows, such as lag = "5 ms"',
                self.name,
            )

    @property
    def _target(self) -> str:
        """The force after dead band and saturation."""
        text = "push" if self.dead_band is None else "deadband(push, dead_band)"
        return text if self.limit is None else f"clamp({text}, -limit, limit)"

    def auxiliary_states(self) -> tuple[AuxiliaryState, ...]:
        """The applied force, where it lags."""
        if self.lag is None:
            return ()
        rate = f"({self._target} - applied)/lag"
        if self.slew is not None:
            rate = f"clamp({rate}, -slew, slew)"
        size = self.limit if isinstance(self.limit, float) else None
        return (
            AuxiliaryState(f"{self.name}.applied", equation(rate, self.name), "force", size=size),
        )

    def actions(self, at: Numbers) -> list[ForcePrimitive]:
        """One action; parameters are both arms."""
        text = f"-({self._target})" if self.lag is None else "-applied"
        parameters = [*at.arm(self, "i"), *at.arm(self, "j"), 0.0, 0.0]
        tension = signal_of(equation(text, self.name))
        return [ForcePrimitive("stretch", self.i.body, self.j.body, parameters, law=tension)]
