"""What a motion needs to go on as if it had not been interrupted."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

__all__ = ["ModalState", "Restart", "Way"]

Array = np.ndarray


@dataclass(frozen=True)
class Way:
    """How a motion is followed: the method, its tolerances, the step of methods that have one."""

    method: str
    rtol: float
    atol: float
    step: float = 0.0


@dataclass(frozen=True)
class ModalState:
    """What a motion with contacts and rough joints goes on with, in numbers and words that a file
    can have.

    Attributes
    ----------
    modes, pairs : tuples of str
        Of the touches and of the rough joints.
    on, anchor : tuples of float
        Of the rows that can be on or off, whether they are and where sticking began.
    phases : tuple of float
        Of the rows along touches of two circles.
    groups : tuple of tuples of int
        Touches that stick by the row of the first of them.
    shared : tuple of tuples of int
        Those of `mbody.analysis.dynamics.shared_friction`; empty where there are none.
    closed, beyond : tuples of int
        Touches.
    fresh : tuple of (str, int, float)
        Guards that begin at zero.
    struck : tuple of (int, float)
        When touches were struck last.
    page : tuple of float
        What is kept of that instant, with which guards begin.
    lost : tuple of float
        Energy that impacts took since the last instant of the result (before it: negative).
    """

    modes: tuple[str, ...]
    pairs: tuple[str, ...]
    on: tuple[float, ...]
    anchor: tuple[float, ...]
    phases: tuple[float, ...]
    groups: tuple[tuple[int, ...], ...]
    shared: tuple[tuple[int, ...], ...]
    closed: tuple[int, ...]
    beyond: tuple[int, ...]
    fresh: tuple[tuple[str, int, float], ...]
    struck: tuple[tuple[int, float], ...]
    page: tuple[float, ...]
    lost: tuple[float, ...]


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
    modal : ModalState, optional
        Of a motion with contacts or rough joints.
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
    modal: ModalState | None = None
