"""`mbody doctor`: what is installed, and where the compiled kernels are kept."""

from __future__ import annotations

import importlib.metadata
import json
import os
import platform
import sys
from typing import Any

__all__ = ["doctor"]

#: Packages by what they are for; the first group must be there.
NEEDED = {
    "numpy": "arrays",
    "numba": "compiled kernels",
    "pydantic": "model files",
    "pint": "units",
}
EXTRA = {
    "pin": "second opinion by Pinocchio",
    "pymunk": "second opinion by pymunk",
    "mujoco": "second opinion by MuJoCo",
    "pandas": "run.to_dataframe()",
    "matplotlib": "draw and plot",
    "scipy": "second opinion: trajectories",
}


def doctor(asked: Any) -> int:
    """Tell what there is; 1 where something needed is missing."""
    report = examine()
    if asked.json:
        print(json.dumps(report, ensure_ascii=False))
    else:
        print(*lines(report), sep="\n")
    return 0 if report["ready"] else 1


def examine() -> dict[str, Any]:
    """Versions, the cache of the kernels, and whether mbody is ready."""
    from mbody import __version__
    from mbody._cache import cache_folder

    needed = {name: _version(name) for name in NEEDED}
    folder = cache_folder()
    kept = sorted(folder.rglob("*.nbc")) if folder else []
    return {
        "mbody": __version__,
        "python": platform.python_version(),
        "machine": f"{platform.system()} {platform.machine()}, {os.cpu_count()} cores",
        "needed": needed,
        "extra": {name: _version(name) for name in EXTRA},
        "cache": str(folder) if folder else None,
        "kernels": len(kept),
        "jit": os.environ.get("NUMBA_DISABLE_JIT", "0") in ("", "0"),
        "ready": all(needed.values()) and sys.version_info >= (3, 11),
    }


def _version(package: str) -> str | None:
    try:
        return importlib.metadata.version(package)
    except importlib.metadata.PackageNotFoundError:
        return None


def lines(report: dict[str, Any]) -> list[str]:
    """The report for people."""
    found = [
        f"mbody       {report['mbody']}",
        f"Python      {report['python']}",
        f"machine     {report['machine']}",
        "",
    ]
    for name, purpose in NEEDED.items():
        version = report["needed"][name]
        found.append(f"{name:<12}{version or 'MISSING: pip install ' + name:<12}{purpose}")
    for name, purpose in EXTRA.items():
        version = report["extra"][name]
        found.append(f"{name:<12}{version or '–':<12}{purpose}")
    found.append("")
    if not report["jit"]:
        found.append("kernels     run as plain Python, for NUMBA_DISABLE_JIT is set")
    elif report["cache"] is None:
        found.append(
            "kernels     cannot be kept: no folder may be written to; every process compiles anew. "
            "Set NUMBA_CACHE_DIR to a folder of yours"
        )
    else:
        found.append(f"kernels     {report['kernels']} compiled, in {report['cache']}")
        if not report["kernels"]:
            found.append("            the first analysis compiles them; `mbody warmup` does it now")
    found += ["", "ready" if report["ready"] else "NOT READY: install what is missing"]
    return found
