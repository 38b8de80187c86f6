"""Which kernels are one library of machine code."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any

#: Libraries of machine code, with the modules of their kernels: what kernels share is compiled once
#: in each. Those of a module that is not listed are one by themselves. In the order in which they
#: are built, in two processes by turns.
LIBRARIES = {
    "motion_lanes": "kernels.runge_kutta_lanes",
    "motion": "kernels.advance kernels.contact_guards kernels.contact_impacts "
    "kernels.force_programs kernels.image_calls kernels.methods kernels.mode_problem "
    "kernels.moreau kernels.runge_kutta kernels.state_derivative",
    "motion_duals": "kernels.motion_duals",
    "positions": "kernels.contact_rows kernels.continuation kernels.finished_instants "
    "kernels.forces kernels.held_forces kernels.loop_closure",
    "positions_lanes": "kernels.continuation_lanes",
    "numbers": "kernels.complementarity kernels.layout kernels.linear_program "
    "kernels.number_program kernels.square_lu laws.kernels laws.smooth_contour",
}


def by_library(functions: Iterable[Callable[..., Any]]) -> dict[str, list[Callable[..., Any]]]:
    """Kernels by the libraries that they are in, which are in the order of `LIBRARIES`."""
    homes = {module: name for name, modules in LIBRARIES.items() for module in modules.split()}
    found: dict[str, list[Callable[..., Any]]] = {name: [] for name in LIBRARIES}
    for function in functions:
        module = function.__module__.partition(".")[2]
        found.setdefault(homes.get(module, module), []).append(function)
    return {name: members for name, members in found.items() if members}
