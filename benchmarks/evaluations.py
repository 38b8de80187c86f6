"""Nanoseconds an evaluation of free motion (accelerations and all multipliers), scalar.

A four-bar, chains of links and hubs (a body with many joints); per body for the long ones.

    python -m benchmarks.evaluations [--repeat 9]
"""

from __future__ import annotations

import argparse
import math
import statistics
import time

import numpy as np

import mbody
from mbody.core.motion import free_motion, repeat


def chain(links: int) -> mbody.Mechanism:
    """Links one after another, hanging from the ground."""
    machine = mbody.Mechanism(f"chain of {links}")
    bars = [mbody.makers.bar(f"b{n}", 1.0, mass=1.0, guess=0.1 * n) for n in range(links)]
    ends = ["ground", *(f"b{n}.B" for n in range(links - 1))]
    pins = [mbody.Revolute(f"j{n}", end, f"b{n}.A") for n, end in enumerate(ends)]
    machine.add(*bars, *pins, mbody.Gravity("gravity", y=-9.81))
    return machine


def hub(arms: int) -> mbody.Mechanism:
    """One body with a bar on each of many pins."""
    machine = mbody.Mechanism(f"hub of {arms}")
    angles = [2.0 * math.pi * n / arms for n in range(arms)]
    points = {f"P{n}": mbody.polar(1.0, angle) for n, angle in enumerate(angles)}
    machine.add(mbody.Body("hub", mass=5.0, inertia=2.0, points=points))
    machine.add(*(mbody.makers.bar(f"b{n}", 1.0, mass=1.0, guess=a) for n, a in enumerate(angles)))
    machine.add(mbody.Revolute("O", "ground", "hub"))
    machine.add(*(mbody.Revolute(f"j{n}", f"hub.P{n}", f"b{n}.A") for n in range(arms)))
    machine.add(mbody.Gravity("gravity", y=-9.81))
    return machine


def four_bar() -> mbody.Mechanism:
    """A four-bar without a motor."""
    machine = mbody.Mechanism("four-bar", ground={"O2": (0.0, 0.0), "O4": (3.5, 0.0)})
    driven = mbody.makers.four_bar(1.0, 3.0, 2.0, 3.5, masses=(1.0, 3.0, 2.0))
    machine.add(*driven.bodies, *driven.joints, mbody.Gravity("gravity", y=-9.81))
    return machine


def measure(machine: mbody.Mechanism, runs: int) -> float:
    """Median seconds an evaluation."""
    system = mbody.assemble(machine)
    start = mbody.close_loops(system)
    n = system.coordinates
    work = system.work(masses=True)
    work.q[:n, 0] = start.record.table(slice(0, n))[0]
    work.v[:n, 0] = np.random.default_rng(0).normal(size=n)
    free_motion(system.runtime(), work, 0.0, 0)
    times = max(5, 300_000 // system.coordinates // 3)
    found = []
    for _ in range(runs):
        begin = time.perf_counter()
        repeat(system.runtime(), work, times)
        found.append((time.perf_counter() - begin) / times)
    return statistics.median(found)


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--repeat", type=int, default=9)
    runs = parser.parse_args().repeat
    machines = [four_bar(), chain(10), chain(100), chain(1000), hub(100), hub(1000)]
    for machine in machines:
        seconds = measure(machine, runs)
        bodies = len(machine.bodies)
        per_body = seconds / bodies * 1e9
        print(f"  {machine.name:15s} {seconds * 1e9:12.0f} ns   {per_body:7.1f} ns a body")


if __name__ == "__main__":
    main()
