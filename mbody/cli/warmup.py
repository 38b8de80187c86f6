"""`mbody warmup`: build or compile all kernels, once on a machine."""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Iterator
from typing import Any

__all__ = ["warmup"]


def warmup(args: Any = None) -> int:
    """Build what the chosen core needs; later runs load it."""
    from mbody.core.selection import chosen

    core = chosen()
    if core.name == "native" and core.library is None:
        return _build()
    if core.name == "numba":
        return _compile()
    print(f"nothing to build: {core.reason}")
    return 0


def _build() -> int:
    """Build all kernels that are missing, in as many processes as there are cores."""
    from mbody.cli.compile import all_kernels
    from mbody.core.native import build, missing

    start = time.perf_counter()
    all_kernels()
    wanted = missing()
    begun = iter(range(1, len(wanted) + 1))
    if wanted:
        build(
            wanted,
            os.cpu_count() or 1,
            lambda name: print(f"building {name}, {next(begun)} of {len(wanted)}", flush=True),
        )
    seconds = time.perf_counter() - start
    print(f"ready: {len(wanted)} kernels built in {seconds:.1f} s; later runs load them")
    return 0


def _compile() -> int:
    """Compile all kernels with numba by using every analysis on small models."""
    from mbody.core.decorators import compilations

    whole = time.perf_counter()
    for title, step in _steps():
        before, start = compilations(), time.perf_counter()
        print(f"{title} ...", end=" ", flush=True)
        step()
        seconds = time.perf_counter() - start
        print(f"{seconds:.1f} s, {compilations() - before} functions compiled", flush=True)
    seconds = time.perf_counter() - whole
    print(f"ready: {compilations()} functions compiled in {seconds:.1f} s; later runs load them")
    return 0


def _steps() -> Iterator[tuple[str, Callable[[], object]]]:
    from mbody.analysis.driven.free_body import free_body
    from mbody.analysis.driven.kinematics import kinematics
    from mbody.analysis.driven.kinetostatics import kinetostatics
    from mbody.analysis.driven.statics import statics
    from mbody.analysis.dynamics.simulate import simulate
    from mbody.analysis.equilibria.equilibrium import equilibrium
    from mbody.analysis.initial.close_loops import close_loops
    from mbody.analysis.linear.linearize import linearize
    from mbody.gallery import load
    from mbody.laws import Function
    from mbody.model.loads import Torque
    from mbody.sweeps import sweep
    from mbody.system.assembler import assemble

    model, swing = load("norton_fourbar"), load("simple_pendulum")
    times = [0.0, 0.01, 0.02]

    def batch() -> object:
        system = assemble(model).with_values({"crank.inertia": [0.4, 0.5, 0.6]})
        return kinetostatics(system, t=times).checks

    def designs() -> object:
        return sweep(model, {"crank.inertia": [0.4, 0.5]}, measure="motor.effort")

    def drifts() -> object:
        body = swing.bodies[0].name
        masses = {f"{body}.mass": [1.0, 2.0]}
        return sweep(swing, masses, "simulate", f"last({body}.angle)")

    def hooks() -> object:
        machine = load("norton_fourbar")
        machine.add(Torque("brake", "crank", value=Function(lambda t: 1.0 + t)))
        return kinetostatics(machine, t=times)

    yield "kinematics", lambda: kinematics(model, t=times)
    yield "kinetostatics", lambda: kinetostatics(model, t=times)
    yield "a whole turn", lambda: kinetostatics(model, turn=True, instants=400)
    yield "statics", lambda: statics(model)
    yield "loops", lambda: close_loops(model)
    yield "residuals", lambda: kinetostatics(model).checks
    yield "breakdown by cause", lambda: kinetostatics(model).breakdown("motor")
    yield "batches of designs", batch
    yield "sweeps", designs
    yield "functions of the user", hooks
    yield "free motion", lambda: simulate(swing)
    yield "free motions of designs", drifts
    yield "stiff motion", lambda: simulate(swing, method="radau5")
    yield "even steps", lambda: simulate(swing, method="rattle", step=0.01)
    yield "rest", lambda: equilibrium(swing)
    yield "small motions", lambda: linearize(swing, at=simulate(swing, 0.1))
    yield "free bodies", lambda: free_body(simulate(swing, 0.1), swing.bodies[0].name)
