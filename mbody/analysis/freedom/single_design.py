"""What analyses of free motions begin with: one design, some drivers released, one time."""

from __future__ import annotations

from collections.abc import Sequence

from mbody.analysis.driven.time_grid import time_grid
from mbody.analysis.position.assembly_analysis import as_system
from mbody.errors import ModelError
from mbody.model.mechanism import Mechanism
from mbody.quantities.types import PlainNumbers
from mbody.system.assembler import assemble
from mbody.system.other_numbers import with_numbers_of
from mbody.system.system import System

__all__ = ["released", "single_design", "single_time"]


def single_design(
    analysis: str, model: Mechanism | System, free: str | Sequence[str] = ()
) -> System:
    """The system of a model without some of its drivers, with the same numbers.

    Parameters
    ----------
    analysis : str
        Its name, for messages.
    free : str or sequence of str, optional
        Drivers that are released.

    Raises
    ------
    ModelError
        For a batch of designs, or a driver that is none.
    """
    system = released(as_system(model), free)
    if system.batch is not None:
        raise ModelError(f"{analysis} takes one design: choose one of the batch with design(n)")
    return system


def released(system: System, free: str | Sequence[str]) -> System:
    """The system without some of its drivers, with the same numbers."""
    names = tuple(free) if isinstance(free, (list, tuple, set)) else (free,)
    if not names:
        return system
    return with_numbers_of(assemble(system.mechanism.without(*names)), system.values)


def single_time(analysis: str, system: System, t: PlainNumbers) -> float:
    """The one time of an analysis.

    Raises
    ------
    ModelError
        For several times, or one that is not finite, or beyond a law.
    """
    times = time_grid(system, t, None, None, None).t
    if len(times) != 1:
        raise ModelError(f"{analysis} takes one time, not {len(times)}")
    return float(times[0])
