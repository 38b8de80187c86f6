"""Memory by the number of bodies: what a model takes of a fresh process that has done a small one.

What loading libraries and kernels took for a moment would hide some megabytes of the models.
"""

from __future__ import annotations

import contextlib
import ctypes
import gc
import json
import re
import statistics
import subprocess
import sys
import time
from pathlib import Path

from benchmarks.frame import OURS, Row, Scope, available
from benchmarks.questions.cold_start import ROOT

__all__ = ["TITLE", "measure"]

TITLE = (
    "Memory of a model and a motion of 0.02 s: the greatest of a fresh process, beyond what it has "
    "after the same of a small model"
)
SIZES = {OURS: (1000, 10_000), "MuJoCo": (100, 1000), "Pinocchio": (50, 200)}
MODULES = {"MuJoCo": "mujoco", "Pinocchio": "pinocchio"}
SMALL = 3


def measure(scope: Scope) -> list[Row]:
    """mbody for every shape; the peers for chains."""
    rows = []
    for shape in ("chain", "ladder", "tree", "hub"):
        sizes = (1000,) if scope.short or shape == "hub" else SIZES[OURS]
        rows += [row for row in growth(OURS, shape, sizes, scope)]
    for name, module in MODULES.items():
        if available(module):
            rows += growth(name, "chain", SIZES[name][: 1 if scope.short else 2], scope)
    return [with_ratio(row, rows) for row in rows]


def growth(engine: str, shape: str, sizes: tuple[int, ...], scope: Scope) -> list[Row]:
    """A row a size, with the bytes that it takes a body."""
    runs = 1 if scope.short else 3
    rows = []
    for count in sizes:
        found = [fresh(engine, shape, count) for _ in range(runs)]
        size = statistics.median(peak for peak, _ in found) / count
        seconds = statistics.median(spent for _, spent in found)
        scope.progress(f"  {engine}, {shape} of {count}: {size:.0f} bytes a body")
        label = f"{shape} of {count}, bytes a body"
        rows.append(Row("memory", label, engine, None, seconds, runs, None, bytes=size))
    return rows


def with_ratio(row: Row, rows: list[Row]) -> Row:
    """Bytes a body against those of mbody in its chain of 1000."""
    ours = [r.bytes for r in rows if r.engine == OURS and r.workload.startswith("chain of 1000,")]
    values = {**row.__dict__, "ratio_to_mbody": row.bytes / ours[0]}
    return Row(**values)


def fresh(engine: str, shape: str, count: int) -> tuple[float, float]:
    """Bytes and seconds of building and moving a model, alone."""
    code = "import sys; from benchmarks.questions.memory import alone; alone(*sys.argv[1:])"
    run = subprocess.run(
        [sys.executable, "-c", code, engine, shape, str(count)],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=True,
    )
    return tuple(json.loads(run.stdout))


def alone(engine: str, shape: str, count: str) -> None:
    """What the fresh process does; it prints both numbers."""
    moved(engine, shape, SMALL)
    before, begin = at_rest(), time.perf_counter()
    moved(engine, shape, int(count))
    print(json.dumps([greatest() - before, time.perf_counter() - begin]))


def moved(engine: str, shape: str, count: int) -> None:
    """Build a model and move it."""
    if engine == OURS:
        import mbody
        from benchmarks import models

        mbody.simulate(models.SHAPES[shape](count), 0.02, rtol=1e-8, instants=2)
        return
    from benchmarks.peers.bare import chain

    machine = chain(count)
    if engine == "MuJoCo":
        import mujoco as engine_of_c

        from benchmarks.peers.mujoco import model_of, start_of

        tree = machine.tree()
        model = model_of(machine, tree, 1e-4)
        engine_of_c.mj_step(model, start_of(machine, tree, model), nstep=20)
    else:
        from benchmarks.peers.pinocchio import Pinocchio

        made = Pinocchio(machine)
        made.slope(0.0, made.start)


def at_rest() -> float:
    """The resident set [bytes] after what was freed is given back; `greatest` begins anew where
    Linux tells it.
    """
    gc.collect()
    with contextlib.suppress(OSError, AttributeError):
        ctypes.CDLL(None).malloc_trim(0)
    with contextlib.suppress(OSError):
        Path("/proc/self/clear_refs").write_text("5", "ascii")
    return greatest()


def greatest() -> float:
    """Greatest resident set so far [bytes]."""
    status = Path("/proc/self/status")
    if status.exists():  # what Linux tells as ru_maxrss begins with the parent's
        found = re.search(r"^VmHWM:\s+(\d+) kB$", status.read_text("utf-8"), re.MULTILINE)
        return 1024.0 * int(found[1])
    import resource

    unit = 1 if sys.platform == "darwin" else 1024
    return float(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * unit)
