"""Arrays of plain numbers in one sealed file: a zip of ``.npy`` members, as NumPy reads them.

The members are not compressed, so that none can be larger than the file that it comes in.
"""

from __future__ import annotations

import hashlib
import io
import os
import stat
import struct
import zipfile
from collections.abc import Iterable, Iterator, Mapping
from itertools import chain
from pathlib import Path
from typing import IO, Any

import numpy as np

# -- Seals: digests that a file carries of all its bytes, so that what was changed is never read
# The seal of a file is the SHA-256 of what it belongs to and of every byte of it but the seal
# itself. What was cut, changed, or copied to where it does not belong does not fit its seal.

MARK = b"sha256:"
SIGNS = 64
ZEROS = b"0" * SIGNS
#: Place of a seal.
OPEN_SEAL = MARK + ZEROS
#: Bytes that are read at once.
CHUNK = 1 << 20


def seal(content: bytes, owner: str) -> bytes:
    """Content with its seal in the place of the last open one.

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
    """Whether an open file ends with its own seal, checked in little memory."""
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


#: Kinds of numbers, and dimensions of arrays.
KINDS, DEEPEST = ("<f8", "|u1"), 4
#: What zipfile and NumPy raise of bytes that they did not write.
BROKEN = (
    zipfile.BadZipFile,
    NotImplementedError,
    ValueError,
    KeyError,
    TypeError,
    EOFError,
    RuntimeError,
    OverflowError,
    struct.error,
    SyntaxError,
    MemoryError,
)


class Unreadable(ValueError):
    """A file that cannot be read; the message says why."""


def packed(arrays: Mapping[str, np.ndarray], owner: str) -> bytes:
    """The bytes of a file of named arrays, with the seal of `owner` at its end.

    >>> raw = packed({"t": np.arange(3.0)}, "test")
    >>> raw[-71:-64]
    b'sha256:'
    """
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w", zipfile.ZIP_STORED) as file:
        for name, array in arrays.items():
            member = io.BytesIO()
            np.lib.format.write_array(member, np.ascontiguousarray(array), allow_pickle=False)
            file.writestr(zipfile.ZipInfo(f"{name}.npy"), member.getvalue())
        file.comment = OPEN_SEAL
    return seal(stream.getvalue(), owner)


def unpacked(path: Any, owner: str) -> dict[str, np.ndarray]:
    """The arrays of such a file, in no more memory than the file has bytes."""
    if not stat.S_ISREG(os.stat(path).st_mode):
        raise Unreadable("it is no ordinary file")
    with Path(path).open("rb") as file:
        if not sealed_at_the_end(file, owner):
            raise Unreadable("it was not written by save_run, or was cut or changed since")
        try:
            with zipfile.ZipFile(file) as members:
                return _members(members, file.seek(0, 2))
        except BROKEN as error:
            raise Unreadable(f"its parts cannot be read: {str(error)[:80]}") from None


def _members(file: zipfile.ZipFile, size: int) -> dict[str, np.ndarray]:
    infos = file.infolist()
    if sum(info.file_size for info in infos) > size:
        raise Unreadable("its parts are larger than the file")
    if any(info.compress_type != zipfile.ZIP_STORED for info in infos):
        raise Unreadable("its parts are compressed, which save_run does not do")
    names = [info.filename.removesuffix(".npy") for info in infos]
    if len(set(names)) < len(names):
        raise Unreadable("it has one part twice")
    return {name: _array(name, file.read(info)) for name, info in zip(names, infos, strict=True)}


def _array(name: str, raw: bytes) -> np.ndarray:
    """An array of plain numbers; its header claims no more than there is."""
    stream = io.BytesIO(raw)
    if np.lib.format.read_magic(stream) != (1, 0):
        raise Unreadable(f"the header of '{name[:40]}' is of another version")
    shape, by_columns, kind = np.lib.format.read_array_header_1_0(stream)
    body = raw[stream.tell() :]
    if kind.str not in KINDS or by_columns or len(shape) > DEEPEST or min(shape, default=0) < 0:
        raise Unreadable(f"'{name[:40]}' is no array of plain numbers")
    count = 1
    for part in shape:
        count *= part
    if count * kind.itemsize != len(body):
        raise Unreadable(f"'{name[:40]}' does not have the size of its header")
    if count == 0:
        return np.zeros(shape, dtype=kind)
    return np.frombuffer(body, dtype=kind).reshape(shape).copy()
