"""The assembly mode that the option `assembly` of an analysis names."""

from __future__ import annotations

from collections.abc import Mapping

from mbody.analysis.assemblies.assembly_mode import AssemblyMode
from mbody.analysis.assemblies.assembly_modes import assembly_modes
from mbody.errors import ModelError, brief
from mbody.model.element import listed
from mbody.system.system import System

__all__ = ["chosen_assembly"]


def chosen_assembly(system: System, drive: Mapping[str, float], which: str | int) -> AssemblyMode:
    """One of the assembly modes at these values of the drivers, by its name or number.

    Raises
    ------
    ModelError
        Where there is no such mode, or for a batch of designs.
    SolveError
        As of `assembly_modes`.

    Examples
    --------
    >>> from mbody import assemble, makers
    >>> machine = assemble(makers.four_bar(40, 120, 80, 100))
    >>> chosen_assembly(machine, {"motor": 0.7}, "open").number
    2
    """
    if isinstance(which, bool) or not isinstance(which, str | int):
        raise ModelError(
            f'assembly is {brief(which)}: give the name of a mode, such as "open", or its number'
        )
    if system.batch is not None:
        raise ModelError(
            f"assembly={which!r} is of one design: give a batch the guess of a mode, guess=modes[0]"
        )
    modes = assembly_modes(system, drive)
    for mode in modes:
        if which in (mode.name, mode.number):
            return mode
    known = listed(f"{mode.number} {mode.name}".rstrip() for mode in modes)
    raise ModelError(
        f"there is no assembly mode {which!r} where the drivers begin (there are: {known}): choose "
        "one of these, or begin at another value of a driver"
    )
