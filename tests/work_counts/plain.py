"""Calls of functions within kernels, counted where kernels are plain Python: `python -m` this.

Compiled code cannot be observed and should not count for a test's sake. The same source runs as
plain Python with MBODY_CORE=plain, and there each call can be counted.
"""

import json
import os
import subprocess
import sys

from tests.support.paths import ROOT

#: What is counted, by the name of the count: module and function.
COUNTED = {
    "factorisations": ("kernels.schur_ldl", "factor"),
    "solutions": ("kernels.schur_ldl", "solve"),
    "rows": ("kernels.constraints", "rows"),
    "loads": ("kernels.forces", "forces"),
    "corrections": ("kernels.constraints", "newton"),
    "LU on lanes": ("kernels.square_lu", "factor_square"),
    "solutions on lanes": ("kernels.square_lu", "solve_square"),
    "double solutions on lanes": ("kernels.square_lu", "solve_both"),
    "transposed solutions on lanes": ("kernels.square_lu", "solve_transposed"),
}


def counts():
    """{workload: {count: number}} of all of `CALLS`, from a process of its own."""
    settings = {**os.environ, "MBODY_CORE": "plain"}
    settings["PYTHONPATH"] = os.pathsep.join(filter(None, (str(ROOT), os.getenv("PYTHONPATH"))))
    done = subprocess.run(
        [sys.executable, "-m", "tests.work_counts.plain"],
        env=settings,
        cwd=ROOT,
        capture_output=True,
        text=True,
    )
    if done.returncode:
        raise RuntimeError(done.stderr)
    return json.loads(done.stdout)


def _watched():
    """Put a counter in place of each function of `COUNTED`, wherever it was imported to."""
    from tests.work_counts.workloads import modules

    list(modules())
    found = dict.fromkeys(COUNTED, 0)
    for count, (place, name) in COUNTED.items():
        home = sys.modules[f"mbody.{place}"]
        if not hasattr(home, name):
            sys.exit(f"mbody.{place} has no {name} any more: name what is counted in {__file__}")
        original = getattr(home, name)
        for module in list(sys.modules.values()):
            if module.__name__.startswith("mbody.") and getattr(module, name, None) is original:
                setattr(module, name, _counter(found, count, original))
    return found


def _counter(found, count, function):
    def call(*arguments):
        found[count] += 1
        return function(*arguments)

    return call


def _main():
    from tests.work_counts.workloads import CALLS

    found, told = _watched(), {}
    for workload in CALLS:
        found.update(dict.fromkeys(found, 0))
        run = workload.run()
        told[workload.name] = {count: n for count, n in found.items() if n}
        told[workload.name] |= {count: n for count, n in (run.stats or {}).items() if n}
    print(json.dumps(told))


if __name__ == "__main__":
    _main()
