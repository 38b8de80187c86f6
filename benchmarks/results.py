"""What was measured, as files: one by machine and commit, the rows beside the versions."""

from __future__ import annotations

import json
import os
import platform
import re
import subprocess
import time
from collections.abc import Iterable
from dataclasses import asdict
from importlib import metadata
from pathlib import Path
from typing import Any

from benchmarks.frame import Row

__all__ = ["FOLDER", "keep", "kept"]

FOLDER = Path(__file__).parent / "results"
PACKAGES = (
    "mbody",
    "numpy",
    "numba",
    "llvmlite",
    "scipy",
    "pin",
    "mujoco",
    "pymunk",
    "scikit-sundae",
    "drake",
    "exudyn",
)


def keep(rows: Iterable[Row], *, short: bool, folder: Path = FOLDER) -> Path:
    """Write the rows; questions of an earlier run of the same machine and commit stay."""
    said = about(short=short)
    folder.mkdir(parents=True, exist_ok=True)
    kind = "-short" if short else ""
    path = folder / f"{slug(said['machine'])}-{said['commit']}{kind}.json"
    fresh = [asdict(row) for row in rows]
    again = {row["question"] for row in fresh}
    if path.exists():
        before = json.loads(path.read_text("utf-8"))["rows"]
        fresh = [row for row in before if row["question"] not in again] + fresh
    path.write_text(json.dumps({**said, "rows": fresh}, indent=1) + "\n", "utf-8")
    return path


def kept(folder: Path = FOLDER) -> list[dict[str, Any]]:
    """All files, the newest first; the full form before the short one of the same commit."""
    found = [json.loads(path.read_text("utf-8")) for path in sorted(folder.glob("*.json"))]
    return sorted(found, key=lambda one: (one["short"], -one["at"]))


def about(*, short: bool) -> dict[str, Any]:
    """The machine, the commit, and the versions of all that took part."""
    versions = {}
    for name in PACKAGES:
        try:
            versions[name] = metadata.version(name)
        except metadata.PackageNotFoundError:
            continue
    return {
        "machine": machine(),
        "commit": commit(),
        "at": int(time.time()),
        "date": time.strftime("%Y-%m-%d"),
        "short": short,
        "python": platform.python_version(),
        "system": platform.system(),
        # of a quarter of an hour: what else ran beside it
        "load": round(os.getloadavg()[2], 1) if hasattr(os, "getloadavg") else None,
        "versions": versions,
    }


def machine() -> str:
    """The processor's name and how many cores there are."""
    name = platform.processor() or platform.machine()
    try:
        text = Path("/proc/cpuinfo").read_text("utf-8")
        found = re.search(r"^model name\s*:\s*(.+)$", text, re.MULTILINE)
        name = found.group(1) if found else name
    except OSError:
        pass
    plain = " ".join(re.sub(r"\(R\)|\(TM\)|CPU|Processor", "", name).split())
    return f"{plain}, {os.cpu_count()} cores"


def commit() -> str:
    """The commit of this folder, with a plus where it was changed since."""

    def git(*words: str) -> str:
        run = subprocess.run(
            ["git", *words], cwd=FOLDER.parents[1], capture_output=True, text=True, check=True
        )
        return run.stdout.strip()

    try:
        changed = git("status", "--porcelain", "--", "mbody")
        return git("rev-parse", "--short=9", "HEAD") + ("+" if changed else "")
    except (OSError, subprocess.CalledProcessError):
        return "unknown"


def slug(text: str) -> str:
    """Small letters, figures and hyphens."""
    return re.sub(r"[^a-z0-9]+", "-", text.lower()).strip("-")
