"""Files that are whole or not there: written under a name of their own, then renamed."""

from __future__ import annotations

import contextlib
import os
import time
import uuid
from pathlib import Path

__all__ = ["clear", "write_whole"]

#: Seconds after which a file that was begun is nobody's.
LEFT = 86_400.0
ENDING = ".part"


def write_whole(path: Path, content: bytes) -> None:
    """Write a file under a name that no other writer has, and put it in its place when it is whole.

    Raises
    ------
    OSError
        Where it cannot be written; nothing is left then.
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


def clear(folder: Path) -> None:
    """Remove what killed writers began a day ago and more."""
    for part in folder.glob(f"*{ENDING}"):
        with contextlib.suppress(OSError):
            if time.time() - part.stat().st_mtime > LEFT:
                part.unlink()
