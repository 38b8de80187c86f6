"""Whether there is memory for a request: refused with its size before anything is begun."""

from __future__ import annotations

import contextlib
import os
from pathlib import Path

from mbody.errors import ModelError
from mbody.system.system import System

__all__ = ["check_room", "memory"]

#: Where Linux says how much memory a container may have.
LIMITS = (
    "/sys/fs/cgroup/memory.max",
    "/sys/fs/cgroup/memory/memory.limit_in_bytes",
)
#: Bytes of what is kept of a number, and of what else is made of an instant on the way.
NUMBER, BESIDE = 8, 200
#: Bytes that every process has that could load the kernels: to read the limits takes longer than a
#: short analysis.
SMALL = 16e6


def check_room(system: System, instants: int) -> None:
    """Refuse more instants than the memory of this machine can hold.

    Parameters
    ----------
    system : System
        Of one design, or a batch.
    instants : int

    Raises
    ------
    ModelError
        With the size that they would have.
    """
    rows = system.page_rows
    wanted = int(instants) * (NUMBER * rows * int(system.batch or 1) + BESIDE)
    if wanted < SMALL:
        return
    there = memory()
    if wanted > there:
        raise ModelError(
            f"{instants} instants of '{system.mechanism.name}' take {wanted / 1e9:.3g} GB, this "
            f"machine has {there / 1e9:.3g} GB of memory: ask for fewer of them"
        )


def memory() -> float:
    """Bytes of memory that a process may have here; infinite where nothing says it."""
    found = [float("inf")]
    with contextlib.suppress(AttributeError, ValueError, OSError):
        found.append(float(os.sysconf("SC_PAGE_SIZE")) * float(os.sysconf("SC_PHYS_PAGES")))
    for path in LIMITS:
        with contextlib.suppress(OSError, ValueError):  # "max" is no number
            found.append(float(Path(path).read_text("ascii")))
    return min(found)
