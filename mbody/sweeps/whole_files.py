"""Atomic files: written under a temporary name, then renamed."""

from __future__ import annotations

import contextlib
import os
import time
import uuid
from pathlib import Path

__all__ = ["remove_abandoned", "write_whole"]

#: Age in seconds of a temporary file whose writer was killed.
LEFT = 86_400.0
ENDING = ".part"


def write_whole(path: Path, content: bytes) -> None:
    """Write a file under a unique temporary name, and rename it when it is complete.

    Raises
    ------
    OSError
        Where it cannot be written; no file remains then.
    """
    part = path.with_name(f"{path.stem}-{uuid.uuid4().hex}{ENDING}")
    try:
        with part.open("xb") as file:
            file.write(content)
            file.flush()
            os.fsync(file.fileno())
        part.replace(path)
    except BaseException:
        with contextlib.suppress(OSError):
            part.unlink()
        raise


def remove_abandoned(folder: Path) -> None:
    """Remove temporary files of killed writers that are older than a day."""
    for part in folder.glob(f"*{ENDING}"):
        with contextlib.suppress(OSError):
            if time.time() - part.stat().st_mtime > LEFT:
                part.unlink()
