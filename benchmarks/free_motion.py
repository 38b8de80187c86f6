"""Free motion: error against time at several tolerances, and the cost of a slope by bodies.

``python -m benchmarks.free_motion``; errors are against the references of the validation cases,
times medians of several whole calls of `mbody.simulate`, start and Python included.
"""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable

import mbody
from mbody import Body, Gravity, Marker, Mechanism, Revolute, gallery
from validation import andrews, free_fourbar, iftomm_a02

RUNS = 7


def timed(call: Callable[[], mbody.Solution]) -> tuple[float, mbody.Solution]:
    """Median time [ms] of a call, and what it gives."""
    call()
    spent = []
    for _ in range(RUNS):
        begin = time.perf_counter()
        run = call()
        spent.append(1e3 * (time.perf_counter() - begin))
    return statistics.median(spent), run


def against_references() -> None:
    """Error at the last instant, time and steps."""
    cases: list[tuple[str, Callable[[mbody.Solution], float]]] = [
        ("free_fourbar", lambda run: abs(run["crank"].angle[-1] - free_fourbar.THETA)),
        (
            "andrews_squeezer",
            lambda run: float(max(abs(andrews.angles(run, -1) - andrews.ANGLES[0.03]))),
        ),
        ("n_windows_40", lambda run: abs(run["c0"].angle[-1] - iftomm_a02.THETA[40])),
    ]
    for name, error in cases:
        machine = gallery.load(name)
        system = mbody.assemble(machine)
        print(f"{name}: rtol, error [rad], time [ms], steps, evaluations")
        for rtol in (1e-6, 1e-8, 1e-10, 1e-12):
            spent, run = timed(
                lambda rtol=rtol, system=system: mbody.simulate(system, rtol=rtol, instants=2)
            )
            steps, slopes = (run.stats[key] for key in ("steps", "evaluations"))
            print(f"  {rtol:7.0e}  {error(run):8.1e}  {spent:8.2f}  {steps:5d}  {slopes:6d}")


def chain(count: int) -> Mechanism:
    """Links of 0.1 m in a row, let go level."""
    machine = Mechanism("chain")
    for n in range(count):
        machine.add(
            Body(f"b{n}", mass=0.1, inertia=0.1 * 0.01 / 12, cg=(0.05, 0.0), guess=0.0),
            Revolute(f"j{n}", Marker(f"b{n - 1}", (0.1, 0.0)) if n else "ground", f"b{n}"),
        )
    machine.add(Gravity("gravity", y=-9.81))
    return machine


def hub(count: int) -> Mechanism:
    """Links on a hub, in all directions."""
    machine = Mechanism("hub")
    machine.add(Body("hub", mass=1.0, inertia=1.0, guess=0.0), Revolute("O", "ground", "hub"))
    for n in range(count):
        place = mbody.polar(1.0, 6.283185307179586 * n / count)
        machine.add(
            Body(f"b{n}", mass=0.1, inertia=1e-3, cg=(0.1, 0.0)),
            Revolute(f"j{n}", Marker("hub", place), f"b{n}"),
        )
    machine.add(Gravity("gravity", y=-9.81))
    return machine


def by_bodies() -> None:
    """Time of one evaluation of the slopes, by the number of bodies."""
    print("bodies: time of an evaluation and body [µs]")
    for make, counts in ((chain, (10, 100, 1000, 10_000)), (hub, (100, 1000))):
        for count in counts:
            system = mbody.assemble(make(count))
            start = mbody.close_loops(system)
            spent, run = timed(
                lambda system=system, start=start: mbody.simulate(
                    system, 0.05, start=start, rtol=1e-8, instants=2
                )
            )
            each = 1e3 * spent / run.stats["evaluations"] / count
            print(f"  {make.__name__:6} {count:6d}  {each:7.3f}")


if __name__ == "__main__":
    against_references()
    by_bodies()
