"""Files that results are written to."""

from __future__ import annotations

import contextlib
import os
import uuid
from collections.abc import Iterator
from pathlib import Path
from typing import IO, Any

from mbody.errors import ModelError

#: End of a file that is not yet whole.
ENDING = ".part"
#: Ends of files that are no text.
SPREADSHEETS = (".xlsx", ".xls", ".xlsm", ".ods")


@contextlib.contextmanager
def writing(
    path: str | os.PathLike[str], *, binary: bool = False, mark: bool = False
) -> Iterator[IO[Any]]:
    """A file open for writing; one that exists is replaced. `mark`: Whether text begins with the
    mark of UTF-8, by which spreadsheets know it.
    """
    try:
        mode: dict[str, Any] = {"encoding": "utf-8-sig" if mark else "utf-8", "newline": ""}
        with Path(path).open("wb" if binary else "w", **({} if binary else mode)) as file:
            yield file
    except TypeError:
        raise ModelError(f"a path must be text or path-like, not {path!r}") from None
    except BrokenPipeError:
        raise  # who read it has gone, as of `--csv /dev/stdout | head`: there is nothing to mend
    except OSError as error:
        raise ModelError(
            f"cannot write '{path}' ({error.strerror}): choose a folder that exists and may be "
            "written to"
        ) from None


def write_whole(path: Path, content: bytes) -> None:
    """Write a file under a unique temporary name, and rename it when it is complete."""
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
