"""A motion led on from Python at 1 kHz: the time of a step, and of a loop with a controller.

Of single steps the median and what 99 % of them stay below are given, of processor time less that
of reading the clock. MuJoCo makes the same steps: one of a millisecond, as its users do, and as
many shorter ones as give mbody's error, or the least that it reaches.
"""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable
from typing import Any

import numpy as np

import mbody
from benchmarks.frame import CLOCK, OURS, Row, Scope, available
from benchmarks.planar import GROUND, planar

__all__ = ["TITLE", "measure"]

TITLE = "Led on at 1 kHz: the free four-bar in steps of 1 ms, and with a PID controller in Python"
PERIOD, RTOL = 1e-3, 1e-6
#: A period as the loop gets it: number, angle and rate of the crank; gives the torque.
Control = Callable[[float, float], float]
#: Substeps of a period that are tried with MuJoCo.
SUBSTEPS = (1, 2, 5, 10, 20, 50, 100, 200)


def controlled() -> mbody.Mechanism:
    """The four-bar with a torque on its crank as an input."""
    machine = mbody.gallery.load("free_fourbar")
    machine.add(mbody.Input("u", "0 lbf*in"), mbody.Torque("motor", "crank", value="u"))
    return machine


def pid() -> Control:
    """A controller of ten lines, which leads the crank to 1.5 rad."""
    total = 0.0

    def control(angle: float, rate: float) -> float:
        nonlocal total
        error = 1.5 - angle
        total += PERIOD * error
        u = 400.0 * error + 300.0 * total - 25.0 * rate
        if u > 200.0:
            u = 200.0
        elif u < -200.0:
            u = -200.0
        return u

    return control


def loop(sim: mbody.Simulator, count: int) -> float:
    """So many periods; the angle of the crank at their end."""
    control, inputs = pid(), sim.inputs
    for _ in range(count):
        crank = sim["crank"]
        inputs["u"] = control(crank.angle, crank.omega)
        sim.step(PERIOD)
    return float(sim["crank"].angle)


def peer(substeps: int) -> tuple[Any, Any, int]:
    """MuJoCo's model with a period of so many steps, its state, the number of the crank's joint."""
    from benchmarks.peers.mujoco import model_of, start_of

    machine = planar(mbody.assemble(mbody.gallery.load("free_fourbar")))
    tree = machine.tree()
    model = model_of(machine, tree, PERIOD / substeps)
    crank = 0
    assert tree.parent[crank] == GROUND
    return model, start_of(machine, tree, model), int(model.joint(f"j{crank}").qposadr[0])


def peer_loop(substeps: int, count: int) -> float:
    """The same with MuJoCo."""
    import mujoco

    model, data, joint = peer(substeps)
    control = pid()
    for _ in range(count):
        u = control(float(data.qpos[joint]), float(data.qvel[joint]))
        data.qfrc_applied[joint] = u
        mujoco.mj_step(model, data, nstep=substeps)
    return float(data.qpos[joint])


def each(step: Callable[[], Any], count: int) -> tuple[float, float]:
    """Median seconds of a step, and what 99 % of them stay below, less those of the clock."""
    now = time.process_time_ns
    clock = min(-(now() - now()) for _ in range(1000))
    spent = []
    for _ in range(count):
        begin = now()
        step()
        spent.append(now() - begin - clock)
    return 1e-9 * statistics.median(spent), 1e-9 * float(np.percentile(spent, 99.0))


def steps(scope: Scope) -> list[Row]:
    """Single steps without a controller."""
    count = 1000 if scope.short else 10_000
    until = PERIOD * count
    machine = mbody.gallery.load("free_fourbar")
    exact = mbody.simulate(machine, until, rtol=1e-13, times=[until])["crank"].angle[-1]
    workload = "free_fourbar, one step of 1 ms"
    rows: list[Row] = []

    def row(name: str, median: float, most: float, angle: float, setting: str) -> None:
        first = rows[0].median_s if rows else median
        assert first is not None
        setting += f"; 99 % below {1e6 * most:.1f} µs"
        found = abs(angle - exact)
        rows.append(
            Row("control_loop", workload, name, found, median, count, median / first, None, setting)
        )
        scope.progress(f"  {workload}, {name}: {1e6 * median:.1f} µs, {setting}, error {found:.1e}")

    for method in ("dop853", "dopri5"):
        sim = mbody.Simulator(machine, rtol=RTOL, method=method)
        sim.step(PERIOD)
        sim.reset()
        # mypy does not infer the type of a lambda with a default
        median, most = each(lambda one=sim: one.step(PERIOD), count)  # type: ignore[misc]
        name = OURS if method == "dop853" else f"{OURS}, {method}"
        row(name, median, most, sim["crank"].angle, f"rtol {RTOL:g}")
    if not available("mujoco"):
        return rows
    import mujoco

    best = rows[0].error
    for substeps in SUBSTEPS:
        if PERIOD * substeps > 0.1 * PERIOD * SUBSTEPS[-1] and scope.short:
            break
        model, data, joint = peer(substeps)
        call = lambda m=model, d=data, n=substeps: mujoco.mj_step(m, d, nstep=n)  # noqa: E731
        median, most = each(call, count)
        angle = float(data.qpos[joint])
        reached = best is not None and abs(angle - exact) <= best
        if substeps in (1, SUBSTEPS[-1]) or reached:
            row("MuJoCo RK4", median, most, angle, f"{substeps} steps a period")
        if reached:
            break
    return rows


def loops(scope: Scope) -> list[Row]:
    """Whole periods with the controller."""
    count, workload = 1000 if scope.short else 5000, "PID at 1 kHz on the four-bar, a period"
    exact = loop(mbody.Simulator(controlled(), rtol=1e-13), count)
    found: dict[str, list[float]] = {}
    ends: dict[str, float] = {}
    sim = mbody.Simulator(controlled(), rtol=RTOL)
    tasks: dict[str, Callable[[], float]] = {OURS: lambda: loop(sim, count)}
    if available("mujoco"):
        for substeps in (1, 10):
            name = f"MuJoCo RK4, {substeps} steps a period"
            # mypy does not infer the type of a lambda with a default
            tasks[name] = lambda n=substeps: peer_loop(n, count)  # type: ignore[misc]
    for _ in range(1 if scope.short else scope.runs):
        for name, task in tasks.items():
            sim.reset()
            begin = CLOCK()
            ends[name] = task()
            found.setdefault(name, []).append((CLOCK() - begin) / count)
    rows = []
    for name, times in found.items():
        median = statistics.median(times)
        ratio = statistics.median(a / b for a, b in zip(times, found[OURS]))
        setting = f"real-time factor {PERIOD / median:.0f}"
        off = abs(ends[name] - exact)
        rows.append(
            Row("control_loop", workload, name, off, median, len(times), ratio, None, setting)
        )
        scope.progress(f"  {workload}, {name}: {1e6 * median:.1f} µs, {setting}, error {off:.1e}")
    return rows


def measure(scope: Scope) -> list[Row]:
    """Steps, then loops."""
    return [*steps(scope), *loops(scope)]
