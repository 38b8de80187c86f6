"""The sources of all compiled code, and their hash: machine code of other sources is never run."""

from __future__ import annotations

import functools
import hashlib
from collections.abc import Iterator
from pathlib import Path

#: The sources that may contain a compiled function or a constant of one; a test checks the list.
COMPILED = (
    "compiler/*.py",
    "core/bundle.py",
    "core/callbacks.py",
    "core/decorators.py",
    "core/dual_number.py",
    "core/duals.py",
    "core/interface.py",
    "core/lanes.py",
    "core/tolerances.py",
    "kernels/*.py",
    "laws/*.py",
    "model/joints/*.py",
    "model/loads/*.py",
    "model/geometry.py",
    "model/primitives.py",
)

PACKAGE = Path(__file__).resolve().parents[1]


def sources() -> Iterator[Path]:
    """All sources of compiled functions, in a fixed order."""
    return iter(sorted(path for part in COMPILED for path in PACKAGE.glob(part)))


def fingerprint() -> tuple[tuple[str, int, int], ...]:
    """Names, times and sizes of the sources: changes when a file is edited."""
    found = []
    for path in sources():
        status = path.stat()
        found.append((str(path), status.st_mtime_ns, status.st_size))
    return tuple(found)


@functools.cache
def source_hash() -> str | None:
    """Hash of all sources as they were when this process first needed it, in hexadecimal.

    None where the sources cannot be read (a package without sources, or inside an archive).
    """
    digest = hashlib.sha256()
    count = 0
    try:
        for path in sources():
            content = path.read_bytes()
            name = path.relative_to(PACKAGE).as_posix()
            digest.update(f"{name}\0{len(content)}\0".encode())
            digest.update(content)
            count += 1
    except OSError:
        return None
    return digest.hexdigest() if count else None
