"""The state of a simulator: immutable, to be kept, copied, pickled and set back."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from mbody.solution.doubts import Doubt
from mbody.stepping.stepwise import Carried
from mbody.system.read_only import lock

__all__ = ["SimulatorState"]

Array = np.ndarray


@dataclass(frozen=True, eq=False)
class SimulatorState:
    """The state of a motion at one instant.

    Set back in a `Simulator` of the same mechanism and method, the same steps give the same bits.

    Attributes
    ----------
    t : float
        Time.
    q, v : arrays (coordinates,)
        Mass centre (x, y) and angle of every body, in the order of the description, and their
        rates [length, length, rad; a unit of time].
    own : array (states,)
        The mechanism's own states.
    inputs : array (inputs,)
        Values of the inputs.
    bodies : tuple of str
        The bodies of q and v.
    status : str
        As of `Simulator.status`, doubts aside.
    beyond : tuple of Doubt
        Tables that the motion left.
    """

    t: float
    q: Array
    v: Array
    own: Array
    inputs: Array
    bodies: tuple[str, ...]
    status: str = "completed"
    beyond: tuple[Doubt, ...] = field(default=(), repr=False)
    #: What the integrator carries on, and where a motion that leaves a singular position began.
    carried: Carried | None = field(default=None, repr=False)
    origin: tuple[float, Array, Array] | None = field(default=None, repr=False)

    def __post_init__(self) -> None:
        lock(self)

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__dict__.update(state)
        lock(self)  # arrays forget in a file that they are locked
