"""Cold start: what a fresh process takes to import, to help, and to its first answer."""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

from benchmarks.frame import OURS, Row, Scope, available, in_turn, timed

__all__ = ["TITLE", "measure"]

TITLE = "Fresh processes, Python's own start included; every kernel is on disk unless said"
ROOT = Path(__file__).parents[2]

FOURBAR = "mbody.gallery.load('norton_fourbar')"
ANSWERS = {
    OURS: f"import mbody; mbody.kinetostatics({FOURBAR}).effort('motor')",
    "Python with numba": "import numba",
    "Pinocchio": (
        "import pinocchio as p, numpy as n; m = p.Model();"
        "j = m.addJoint(0, p.JointModelRZ(), p.SE3.Identity(), 'j');"
        "m.appendBodyToJoint(j, p.Inertia.Random(), p.SE3.Identity());"
        "p.rnea(m, m.createData(), n.ones(1), n.ones(1), n.ones(1))"
    ),
    "MuJoCo": (
        "import mujoco as m; s = m.MjModel.from_xml_string('<mujoco><worldbody><body><joint/>"
        '<geom size="1"/></body></worldbody></mujoco>\'); m.mj_step(s, m.MjData(s))'
    ),
    "pymunk": (
        "import pymunk as p; s = p.Space(); b = p.Body(1, 1); s.add(b, p.PivotJoint("
        "s.static_body, b, (0, 0), (1, 0))); s.step(0.01)"
    ),
}
IMPORTS = {OURS: "import mbody", "Pinocchio": "import pinocchio"}
IMPORTS |= {"MuJoCo": "import mujoco", "pymunk": "import pymunk", "Python alone": ""}
NEEDS = {"Pinocchio": "pinocchio", "MuJoCo": "mujoco", "pymunk": "pymunk"}


def children() -> float:
    """Seconds of the processor that the processes had which were waited for; else of the wall."""
    try:
        import resource
    except ImportError:
        return time.perf_counter()
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def process(*words: str, **environment: str) -> Callable[[], None]:
    """A fresh interpreter."""
    settings = {**os.environ, "PYTHONPATH": str(ROOT), "MBODY_QUIET": "1", **environment}

    def run() -> None:
        subprocess.run(
            [sys.executable, *words], env=settings, check=True, capture_output=True, cwd=ROOT
        )

    return run


def measure(scope: Scope) -> list[Row]:
    """Import, help, first answer; in the full form the very first compile too."""
    rows = []
    for workload, codes in (("import", IMPORTS), ("first answer", ANSWERS)):
        there = {n: c for n, c in codes.items() if n not in NEEDS or available(NEEDS[n])}
        tasks = {name: process("-c", code) for name, code in there.items()}
        scope.progress(f"  {workload}")
        rows += in_turn("cold_start", workload, tasks, {}, scope, clock=children)
    helped = {OURS: process("-m", "mbody", "--help"), "pip": process("-m", "pip", "--help")}
    scope.progress("  --help")
    rows += in_turn("cold_start", "command --help", helped, {}, scope, clock=children)
    if not scope.short:
        scope.progress("  very first compile")
        label = "very first demo on a machine, all kernels of it compiled"
        seconds = timed(first_demo, children)[0]
        rows.append(Row("cold_start", label, OURS, None, seconds, 1, 1.0))
    return rows


def first_demo() -> None:
    """`mbody demo` with an empty cache."""
    with tempfile.TemporaryDirectory() as empty:
        process("-m", "mbody", "demo", MBODY_CACHE_DIR=empty, NUMBA_CACHE_DIR=empty)()
