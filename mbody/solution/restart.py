"""What a motion needs to go on as if it had not been interrupted."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

__all__ = ["Restart", "Way"]

Array = np.ndarray


@dataclass(frozen=True)
class Way:
    """How a motion is followed: the method, its tolerances, the step of methods that have one."""

    method: str
    rtol: float
    atol: float
    step: float = 0.0


@dataclass(frozen=True, eq=False)
class Restart:
    """The state of the steps before the last one, which was cut to end in time.

    Attributes
    ----------
    way : Way
        How the motion was followed.
    scale, y, slope : arrays (2·coordinates + own states,)
        Sizes of the coordinates, the state, its slope.
    powers, gained : arrays (causes,)
        Powers there, and the work done since the last instant of the result (before it: negative).
    state : array
        See `mbody.kernels.step_state`.
    own : tuple of arrays
        What the method itself carries on.
    inputs : dict
        Values of the inputs that are kept between set times.
    sampled : tuple
        The controllers with their memories (`mbody.analysis.dynamics.interruptions`).
    met : array
        Singular positions that were met (`mbody.analysis.singular.nearby_singularity`).
    """

    way: Way
    scale: Array
    y: Array
    slope: Array
    powers: Array
    gained: Array
    state: Array
    own: tuple[Array, ...]
    inputs: dict[str, float] = field(default_factory=dict)
    sampled: tuple[Any, ...] = ()
    met: Array = field(default_factory=lambda: np.zeros(0))
