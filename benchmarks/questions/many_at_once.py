"""Many motions led on at once: 4096 four-bars in steps of 1 ms, each with a torque of its own.

Times are of the processor, of both threads together: what one core needs for one step of one
motion. The torque of every motion changes with every step, as in reinforcement learning. The error
is that of 16 of the motions at the end, against a `Simulator` of the tightest tolerance; beside it
stand a `Simulator` of the same tolerance led on in a loop, and a vector environment with four
observations and a reward.
"""

from __future__ import annotations

import statistics
import time

import numpy as np

import mbody
from benchmarks.frame import OURS, Row, Scope, available
from benchmarks.questions.control_loop import controlled

__all__ = ["TITLE", "measure"]

TITLE = "Many at once: 4096 four-bars in steps of 1 ms, a torque each"
PERIOD, RTOL, CHECKED = 1e-3, 1e-6, 16
OBSERVED = ["crank.angle", "crank.omega", "rocker.angle", "rocker.omega"]


def torques(n: int, count: int) -> np.ndarray:
    """Of every step and motion."""
    return np.random.default_rng(0).uniform(-5.0, 5.0, (count, n))


def exact(u: np.ndarray) -> np.ndarray:
    """Crank angles of the first motions after torques u (steps, motions)."""
    sim, found = mbody.Simulator(controlled(), rtol=1e-13), []
    for k in range(CHECKED):
        sim.reset()
        for one in u[:, k].tolist():
            sim.inputs["u"] = one
            sim.step(PERIOD)
        found.append(sim["crank"].angle)
    return np.array(found)


def measure(scope: Scope) -> list[Row]:
    """Both methods on lanes, one motion after another, and an environment."""
    n, count = (1024, 20) if scope.short else (4096, 100)
    workload = f"{n} four-bars, a step of 1 ms of one"
    u, rows = torques(n, count), list[Row]()
    reference = exact(u)

    def row(name: str, times: list[float], angles: np.ndarray | None, setting: str) -> None:
        median = statistics.median(times)
        first = rows[0].median_s if rows else median
        assert first is not None
        off = None if angles is None else float(np.abs(angles[:CHECKED] - reference).max())
        rows.append(
            Row(
                "many_at_once",
                workload,
                name,
                off,
                median,
                len(times),
                median / first,
                None,
                setting,
            )
        )
        said = "" if off is None else f", error {off:.1e}"
        scope.progress(f"  {workload}, {name}: {1e6 * median:.2f} µs, {setting}{said}")

    system = mbody.assemble(controlled())
    for method in ("dopri5", "dop853"):
        sims = mbody.Simulators(system, n, rtol=RTOL, method=method)
        spent = []
        for one in u:
            begin = time.process_time()
            sims.inputs["u"] = one
            sims.step(PERIOD)
            spent.append((time.process_time() - begin) / n)
        row(f"{OURS}, {method}", spent, sims["crank"].angle, f"rtol {RTOL:g}")
    sim, spent = mbody.Simulator(system, rtol=RTOL, method="dopri5"), []
    angles = np.empty(CHECKED)
    for k in range(CHECKED):
        sim.reset()
        begin = time.process_time()
        for one in u[:, k].tolist():
            sim.inputs["u"] = one
            sim.step(PERIOD)
        spent.append((time.process_time() - begin) / count)
        angles[k] = sim["crank"].angle
    row(f"{OURS}, one after another, dopri5", spent, angles, f"rtol {RTOL:g}")
    if available("gymnasium"):
        vec = mbody.envs.make_vec(
            system,
            n,
            actions={"u": ("-5 lbf*in", "5 lbf*in")},
            observations=OBSERVED,
            reward="cos(crank.angle)",
            step=PERIOD,
            method="dopri5",
            rtol=RTOL,
        )
        vec.reset(seed=0)
        spent = []
        for one in u:
            begin = time.process_time()
            vec.step(one[:, None])
            spent.append((time.process_time() - begin) / n)
        row(f"{OURS}, vector environment, dopri5", spent, vec.sims["crank"].angle, f"rtol {RTOL:g}")
    return rows
