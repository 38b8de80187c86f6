"""Kinetostatics of Norton's four-bar, a position: all reactions and the driving torque."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

import mbody
from benchmarks.frame import OURS, Row, Scope, available, in_turn
from benchmarks.peers.kinetostatic import given, links, mujoco_loop, pinocchio_loop
from validation.norton_fourbar import newton_euler

__all__ = ["TITLE", "measure"]

TITLE = (
    "Kinetostatics of Norton's four-bar, a position; mbody closes the loops itself, the others "
    "are given the kinematics; error of the torque as a part"
)
POSITIONS = 3600


def measure(scope: Scope) -> list[Row]:
    """NumPy's batched 9×9 of Norton's equation 11.9, a loop of 9×9, Pinocchio, MuJoCo."""
    system = mbody.assemble(mbody.gallery.load("norton_fourbar"))
    run = mbody.kinetostatics(system, turn="motor", instants=POSITIONS)
    crank = run["crank"]
    motion = newton_euler.motion(crank.angle, crank.omega, crank.alpha)
    reference = newton_euler.forces(motion)[8]
    joints = ("O2", "A", "B", "O4")
    own = mbody.assemble(system.mechanism, machine_code=True)

    def by(system: mbody.System) -> Callable[[], Any]:
        def ours() -> Any:
            found = mbody.kinetostatics(system, run.t)
            names = [found.reaction(name) for name in joints]
            return [(one.fx, one.fy) for one in names], found.effort("motor")

        return ours

    def by_hand() -> Any:
        return None, newton_euler.forces(motion)[8]

    tasks: dict[str, Callable[[], Any]] = {OURS: by(system), f"{OURS}, machine_code=True": by(own)}
    tasks |= {"NumPy, batched 9×9 by hand": by_hand}
    machine = links()
    moved = given(run, machine.tree())
    if available("pinocchio"):
        tasks["Pinocchio rnea, cut at B"] = pinocchio_loop(machine, moved)
    if available("mujoco"):
        tasks["MuJoCo mj_inverse, cut at B"] = mujoco_loop(machine, moved)
    size = np.abs(reference).max()
    errors = {
        name: float(np.abs(task()[1] - reference).max() / size) for name, task in tasks.items()
    }
    workload = f"norton_fourbar, one of {POSITIONS} positions, all reactions"
    return in_turn("positions", workload, tasks, errors, scope, parts=POSITIONS)
