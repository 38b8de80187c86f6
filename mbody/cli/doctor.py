"""`mbody doctor`: what is installed, which core runs the kernels, and whether they work."""

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
    "pydantic": "model files",
    "pint": "units",
}
EXTRA = {
    "numba": "building kernels on this machine",
    "pin": "second opinion by Pinocchio",
    "pymunk": "second opinion by pymunk",
    "mujoco": "second opinion by MuJoCo",
    "pandas": "run.to_dataframe()",
    "matplotlib": "draw and plot",
    "scipy": "second opinion: trajectories",
}
#: Driving torque of the gallery's `norton_fourbar` [lbf·in], from the book's nine equations solved
#: in extended precision (`tests/test_doctor.py`), and how far a processor may round it, relative.
TORQUE, ROUNDING = 243.23759076122957, 1e-12


def doctor(args: Any) -> int:
    """Report what is installed; 1 if something needed is missing."""
    report = examine()
    if args.json:
        print(json.dumps(report, ensure_ascii=False))
    else:
        print(*lines(report), sep="\n")
    return 0 if report["ready"] else 1


def examine() -> dict[str, Any]:
    """Versions, the core of the kernels, and whether mbody is ready."""
    from mbody.core.selection import chosen
    from mbody.core.sources import source_hash

    core = chosen()
    needed = {name: _version(name) for name in NEEDED}
    checked = (
        kernel_check() if all(needed.values()) else _unchecked("not run: packages are missing")
    )
    ready = checked["agrees"] and sys.version_info >= (3, 11)
    found = {
        "python": platform.python_version(),
        "machine": f"{platform.system()} {platform.machine()}, {os.cpu_count()} cores",
        "needed": needed,
        "extra": {name: _version(name) for name in EXTRA},
        "core": core.name,
        "core_file": str(core.file) if core.file else None,
        "core_level": core.level,
        "core_hash": source_hash(),
        "core_reason": core.reason,
        "kernels": len(list(core.file.glob("*.so"))) if core.file and core.file.is_dir() else None,
        "kernel_check": checked,
        "ready": ready,
    }
    return _head(found) | found


def _head(found: dict[str, Any]) -> dict[str, Any]:
    """The first keys of the report; that mbody is not ready is a doubt about its results."""
    from mbody.solution.doubts import Doubt, Inherited, inherited
    from mbody.solution.heading import heading

    doubts = () if found["ready"] else (Doubt("solver", _remedy(found)),)
    whole = Inherited(**inherited(Inherited(doubts=doubts)))
    return heading(None, "doctor", {"torque": "lbf·in"}, whole)


def kernel_check() -> dict[str, Any]:
    """Run the kernels on a model of the gallery and compare one number: ``{"value", "expected",
    "agrees", "error"}``. The first run on a machine compiles them.
    """
    try:
        from mbody.analysis.driven.kinetostatics import kinetostatics
        from mbody.gallery import load

        value = float(kinetostatics(load("norton_fourbar")).effort("motor")[0])
    except Exception as error:  # whatever a package of another version raises
        return _unchecked(f"{type(error).__name__}: {error}")
    agrees = abs(value - TORQUE) <= ROUNDING * TORQUE
    return {"value": value, "expected": TORQUE, "agrees": agrees, "error": None}


def _unchecked(why: str) -> dict[str, Any]:
    return {"value": None, "expected": TORQUE, "agrees": False, "error": why}


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
    found.append(f"core        {report['core']}: {report['core_reason']}")
    if report["core_file"] is not None:
        kept = "" if report["kernels"] is None else f"{report['kernels']} kernels in "
        found.append(f"            {kept}{report['core_file']}, for {report['core_level']}")
    check = report["kernel_check"]
    if check["error"] is not None:
        found.append(f"            the kernels do not run: {check['error']}")
    else:
        verdict = "agrees with" if check["agrees"] else "IS NOT"
        found.append(
            f"            a torque of {check['value']:.12g} {verdict} {TORQUE:.12g} lbf·in"
        )
    found += ["", "ready" if report["ready"] else _remedy(report)]
    return found


def _remedy(report: dict[str, Any]) -> str:
    """What is wrong, and what helps."""
    if not all(report["needed"].values()):
        return "NOT READY: install what is missing"
    if report["kernel_check"]["error"] is not None:
        return (
            "NOT READY: the kernels do not run with these versions: install those of "
            "constraints.txt, delete the folder of kernels, or try MBODY_CORE=numba"
        )
    return "NOT READY: the kernels compute wrongly on this processor: please report this output"
