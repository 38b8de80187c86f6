"""Planting a fault in a copy of the package, and asking the engines in a process of its own."""

from __future__ import annotations

import atexit
import functools
import importlib.util
import json
import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

from tests.faults.catalogue import Fault
from tests.faults.models import MODELS
from tests.support.paths import ROOT

__all__ = ["seen_by", "verdicts"]


ASK = """
import json, sys
import mbody
from tests.faults.models import MODELS
from tests.faults.moving import MOVING

engine, *models = sys.argv[1:]
found = {}
for model in models:
    if model in MODELS:
        made = MODELS[model]()
        run = mbody.kinetostatics(made, t=0.05)
    else:
        made, engine = MOVING[model](), "oracle"
        run = mbody.simulate(made)
    results = mbody.crosscheck(made, engine, ours=run).opinions
    found[model] = {name: one.agrees for name, one in results.items()}
print(json.dumps(found))
"""


def seen_by(fault: Fault) -> list[str]:
    """Names of the engines that differ where the fault is planted.

    Raises
    ------
    ValueError
        Where the text to be changed is not in the file exactly once, or what was planted
        keeps the engines from answering at all.
    """
    copy = _copy()
    file = copy / "mbody" / fault.file
    text = file.read_text("utf-8")
    if text.count(fault.right) != 1:
        raise ValueError(
            f"{fault.name}: {fault.right!r} stands {text.count(fault.right)} times in {fault.file}"
        )
    # bytecode is told from its source by time and size, which two faults may share
    Path(importlib.util.cache_from_source(str(file))).unlink(missing_ok=True)
    try:
        file.write_text(text.replace(fault.right, fault.wrong), "utf-8")
        found = _asked(copy, fault.model)[fault.model]
        return [name for name, agrees in found.items() if not agrees]
    finally:
        file.write_text(text, "utf-8")


@functools.cache
def _copy() -> Path:
    """A copy of the package for all faults, with its bytecode: no process translates all of it."""
    copy = Path(tempfile.mkdtemp())
    atexit.register(shutil.rmtree, copy, ignore_errors=True)
    half_written = shutil.ignore_patterns("*.pyc.*")
    for folder in (Path("mbody"), Path("tests", "faults")):
        shutil.copytree(ROOT / folder, copy / folder, ignore=half_written)
    (copy / "tests" / "__init__.py").touch()
    return copy


@functools.cache
def verdicts() -> dict[str, dict[str, bool]]:
    """Which engines agree on every mechanism with nothing planted: one process asks for all."""
    return _asked(ROOT, *MODELS)


def _asked(root: Path, *models: str) -> dict[str, dict[str, bool]]:
    # plain Python: nothing is compiled, and no cache is touched
    settings = os.environ | {"MBODY_CORE": "plain", "PYTHONPATH": str(root), "MBODY_QUIET": "1"}
    settings |= {"PYTHONDONTWRITEBYTECODE": "1"}
    done = subprocess.run(
        [sys.executable, "-c", ASK, "pinocchio", *models],
        cwd=root,
        env=settings,
        capture_output=True,
        text=True,
        check=False,
        timeout=300,
    )
    if done.returncode:
        raise ValueError(done.stderr[-600:])
    found: dict[str, dict[str, bool]] = json.loads(done.stdout)
    return found
