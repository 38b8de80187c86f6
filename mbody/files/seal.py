"""Seals: digests that a file carries of all its bytes, so that what was changed is never read.

The seal of a file is the SHA-256 of what it belongs to and of every byte of it but the seal itself.
What was cut, changed, or copied to where it does not belong does not fit its seal.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterable, Iterator
from itertools import chain
from typing import IO

__all__ = ["OPEN_SEAL", "seal", "sealed", "sealed_at_the_end"]

MARK = b"sha256:"
SIGNS = 64
ZEROS = b"0" * SIGNS
#: Place of a seal.
OPEN_SEAL = MARK + ZEROS
#: Bytes that are read at once.
CHUNK = 1 << 20


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
    return content[:place] + _digest([content], owner) + content[place + SIGNS :]


def sealed(content: bytes, owner: str) -> bool:
    """Whether a content is whole, unchanged, and of that owner."""
    place = content.rfind(MARK) + len(MARK)
    if place < len(MARK):
        return False
    before, given, after = content[:place], content[place : place + SIGNS], content[place + SIGNS :]
    return given == _digest([before, ZEROS, after], owner)


def sealed_at_the_end(file: IO[bytes], owner: str) -> bool:
    """The same of an open file whose seal is its last bytes, in little memory."""
    size = file.seek(0, 2) - SIGNS
    if size < len(MARK):
        return False
    file.seek(size - len(MARK))
    tail = file.read()
    if not tail.startswith(MARK):
        return False
    file.seek(0)
    return tail[len(MARK) :] == _digest(chain(_chunks(file, size), [ZEROS]), owner)


def _chunks(file: IO[bytes], size: int) -> Iterator[bytes]:
    while size > 0 and (part := file.read(min(size, CHUNK))):
        size -= len(part)
        yield part


def _digest(parts: Iterable[bytes], owner: str) -> bytes:
    made = hashlib.sha256(owner.encode() + b"|")
    for part in parts:
        made.update(part)
    return made.hexdigest().encode()
