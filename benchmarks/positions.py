"""Microseconds a position: kinetostatics of Norton's four-bar against NumPy written for it by hand.

Both give all reactions and the driving torque at 3600 crank positions. NumPy solves the batched 9×9
of Norton's equation 11.9 with the kinematics given; mbody closes the loops itself. Both run in
turn in one process; medians are printed, with the greatest difference of the answers.

    python -m benchmarks.positions [--repeat 15]
"""

from __future__ import annotations

import argparse
import statistics
import time
from collections.abc import Callable
from typing import Any

import numpy as np

import mbody
from validation.norton_fourbar import newton_euler

POSITIONS = 3600


def main() -> None:
    """Time both in turn and print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--repeat", type=int, default=15)
    repeat = parser.parse_args().repeat
    system = mbody.assemble(mbody.gallery.load("norton_fourbar"))
    run = mbody.kinetostatics(system, turn="motor", instants=POSITIONS)
    crank = run["crank"]
    motion = newton_euler.motion(crank.angle, crank.omega, crank.alpha)

    def ours() -> Any:
        found = mbody.kinetostatics(system, run.t)
        return [*(_reaction(found, name) for name in ("O2", "A", "B", "O4")), found.effort("motor")]

    def by_hand() -> Any:
        return newton_euler.forces(motion)

    tasks: dict[str, Callable[[], Any]] = {"mbody, loops closed": ours, "NumPy 9x9, given": by_hand}
    times: dict[str, list[float]] = {name: [] for name in tasks}
    for _ in range(repeat + 1):
        for name, task in tasks.items():
            begin = time.perf_counter()
            task()
            times[name].append(time.perf_counter() - begin)
    print(f"{POSITIONS} positions, all reactions and the torque; medians of {repeat} runs in turn")
    for name, values in times.items():
        print(f"  {name:22s} {statistics.median(values[1:]) / POSITIONS * 1e6:8.3f} us/position")
    ratio = statistics.median(
        a / b for a, b in zip(*(values[1:] for values in times.values()), strict=True)
    )
    print(f"  ratio {ratio:.3f} (a fifth is 0.2)")
    torque, reference = run.effort("motor"), by_hand()[8]
    print(f"  torques differ by {np.abs(torque - reference).max() / np.abs(reference).max():.1e}")


def _reaction(run: mbody.Solution, name: str) -> tuple[Any, Any]:
    found = run.reaction(name)
    return found.fx, found.fy


if __name__ == "__main__":
    main()
