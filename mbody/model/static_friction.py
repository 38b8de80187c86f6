"""What sticks holds at least as much as what slides."""

from __future__ import annotations

from typing import Any

import numpy as np

from mbody.errors import ModelError


def refuse_static(name: str, kinetic: float, static: float) -> None:
    """Refuse a static coefficient below the kinetic one."""
    if static < kinetic:
        raise ModelError(
            f"'{name}': friction is {kinetic:g}, more than static = {static:g}: what rests is not "
            "easier to move than what slides; exchange them, or leave out static",
            name,
        )


def refuse_static_of_designs(name: str, kinetic: Any, static: Any) -> None:
    """The same of every design: numbers, or arrays (batch,)."""
    for one, other in zip(*map(np.ravel, np.broadcast_arrays(kinetic, static)), strict=True):
        refuse_static(name, float(one), float(other))
