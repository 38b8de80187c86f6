"""Sampled controllers: Python that is called at a fixed rate and sets inputs."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar, TypeAlias

from mbody.errors import ModelError, brief
from mbody.model.element import Element, number_field
from mbody.quantities.types import Converted, NumberField, default, required

__all__ = ["Controller", "ControlFunction"]

#: Called with the time and what the controller reads; gives what it sets: one number, one for each
#: input in a row, or a mapping by name.
ControlFunction: TypeAlias = "Callable[..., float | Sequence[float] | Mapping[str, float]]"


@dataclass(frozen=True)
class Controller(Element):
    """A sampled controller: reads measured quantities and sets inputs, once a sample.

    The function is called in the order of time, at the first instant and then every `every`, with a
    snapshot of what it reads; the inputs keep the values that it gives until the next sample. Steps
    of the integrator end at samples, so that the result does not depend on their lengths. Those
    that sample at the same instant are called in the order of the description: each reads the
    inputs as those before it have set them.

    Parameters
    ----------
    name : str
        Unique in the mechanism.
    function : callable
        ``function(t, *reads)``: the time and one float for each of `reads`; returns one float for
        the only input of `sets`, one for each of them in a row, or a mapping by name. An object
        with a ``__call__`` is copied when a motion begins, so that every motion begins with the
        memory that it has here, and its memory is kept with the result, for motions that go on.
    every : float or str
        The sample time, such as ``"1 ms"``.
    reads : sequence of str
        What is measured at a sample: formulas as of `Measure`, forces among them, in the units of
        the mechanism.
    sets : sequence of str
        Names of inputs.
    delay : float or str
        How long after the sample the inputs change, 0 for at once.

    Examples
    --------
    >>> from mbody import Body, Gravity, Input, Mechanism, Revolute, Torque, simulate
    >>> machine = Mechanism("arm")
    >>> machine.add(Body("arm", mass=1.0, cg=(0.5, 0.0), guess=0.0), Revolute("O", "ground", "arm"))
    >>> machine.add(Gravity("gravity", y=-9.81))
    >>> machine.add(Input("u", "0 N*m"), Torque("motor", "arm", value="u"))
    >>> def hold(t, angle, rate):
    ...     return 4.905 - 50.0 * angle - 10.0 * rate
    >>> machine.add(Controller("pd", hold, "1 ms", ["arm.angle", "arm.omega"], ["u"]))
    >>> run = simulate(machine, 1.0)
    >>> bool(abs(run["arm"].angle[-1]) < 1e-2)
    True
    """

    main: ClassVar[tuple[str, ...]] = ("every",)
    role: ClassVar[str] = "controller"

    function: Any = required()
    every: NumberField = number_field("time", dataclasses.MISSING, sign="positive")
    reads: Converted[tuple[str, ...], Sequence[str]] = default(())
    sets: Converted[tuple[str, ...], Sequence[str]] = default(())
    delay: NumberField = number_field("time", 0.0, sign="not negative")

    def _enter(self) -> None:
        if not callable(self.function) or isinstance(self.function, type):
            raise ModelError(
                f"'{self.name}': function must be a function of (t, *reads), not "
                f"{brief(self.function)}",
                self.name,
            )
        for field in ("reads", "sets"):
            given = getattr(self, field)
            given = (given,) if isinstance(given, str) else given
            if not isinstance(given, Sequence) or not all(isinstance(one, str) for one in given):
                raise ModelError(
                    f"'{self.name}': {field} must be a list of text, not {brief(given)}", self.name
                )
            object.__setattr__(self, field, tuple(given))
        if not self.sets:
            raise ModelError(
                f"'{self.name}' sets no input: name one or more, as in sets=[\"u\"]", self.name
            )
        super()._enter()
