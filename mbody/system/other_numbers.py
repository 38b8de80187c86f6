"""A system with the numbers of another one."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from mbody.system.system import System

__all__ = ["with_numbers_of"]


def with_numbers_of(system: System, values: Mapping[str, Any]) -> System:
    """The system with other numbers, of those that it has; parameters first, so that what is made
    of them follows, and is not fixed by hand.
    """
    for own in (system.mechanism.parameters, system.values):
        changed = {
            name: values[name]
            for name in own
            if name in values and (np.ndim(values[name]) or system.values.get(name) != values[name])
        }
        system = system.with_values(changed) if changed else system
    return system
