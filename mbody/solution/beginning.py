"""How a motion began, and how it was followed: what it takes to follow it again."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from mbody.system.system import System

__all__ = ["Beginning"]


@dataclass(frozen=True, eq=False)
class Beginning:
    """How a motion of `simulate` began.

    Attributes
    ----------
    system : System
        With the histories of its inputs.
    start : Solution
        The one instant that it began with, and what it goes on from.
    request : MotionRequest
        Of `mbody.analysis.dynamics.options`: its instants, method, events and releases.
    first : float
        The time of its first instant.
    """

    system: System
    start: Any
    request: Any
    first: float
