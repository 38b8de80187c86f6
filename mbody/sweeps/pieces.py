"""Files that are whole or not there: written under a name of their own, sealed by a digest.

The seal of a piece is the SHA-256 of the sweep that it belongs to, of its place there, and of every
byte of the file but the seal itself. What was cut, changed, copied over another piece or made by
another sweep does not fit its seal, and Arrow never reads it.
"""

from __future__ import annotations

import contextlib
import hashlib
import os
import time
import uuid
from pathlib import Path

__all__ = ["OPEN_SEAL", "clear", "seal", "sealed", "write_whole"]

MARK = b"sha256:"
#: Where a seal will stand.
OPEN_SEAL = MARK + b"0" * 64
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


def seal(content: bytes, owner: str) -> bytes:
    """The same with its seal in the place of the last open one.

    Parameters
    ----------
    content : bytes
        Holds `OPEN_SEAL`.
    owner : str
        What it belongs to, and its place there.

    >>> whole = seal(b"numbers " + OPEN_SEAL, "sweep 0")
    >>> sealed(whole, "sweep 0"), sealed(whole, "sweep 1"), sealed(whole[:-1], "sweep 0")
    (True, False, False)
    """
    place = content.rindex(OPEN_SEAL) + len(MARK)
    made = _digest(content, owner)
    return content[:place] + made + content[place + len(made) :]


def sealed(content: bytes, owner: str) -> bool:
    """Whether a content is whole, unchanged, and of that owner."""
    place = content.rfind(MARK) + len(MARK)
    if place < len(MARK):
        return False
    given = content[place : place + 64]
    zeroed = content[:place] + b"0" * 64 + content[place + 64 :]
    return len(given) == 64 and given == _digest(zeroed, owner)


def _digest(content: bytes, owner: str) -> bytes:
    made = hashlib.sha256(owner.encode() + b"|")
    made.update(content)
    return made.hexdigest().encode()
