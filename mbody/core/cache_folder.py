"""The folder in which compiled kernels are kept, one for each version of the sources."""

from __future__ import annotations

import functools
import os
import shutil
import stat
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

_KEEP_SECONDS = 30 * 86400.0
#: Length of a stamp, the name of a folder, in hexadecimal digits.
STAMP_DIGITS = 32


def _writable(folder: Path) -> bool:
    """Make the folder and write a file in it: permission bits alone are not enough."""
    try:
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder) as file:
            file.write(b"mbody")
    except (OSError, ValueError):
        return False
    return True


def _owned(folder: Path) -> bool:
    """Whether an existing folder belongs to this user.

    Cache files are pickles and can run any code: those of another user are never opened.
    """
    if not hasattr(os, "getuid"):
        return True
    try:
        return folder.stat().st_uid == os.getuid()
    except OSError:
        return False


def _private_temporary() -> Path | None:
    """A folder in the temporary directory that belongs to this user and that only this user can
    enter.
    """
    user = str(os.getuid()) if hasattr(os, "getuid") else os.environ.get("USERNAME", "user")
    try:
        folder = Path(tempfile.gettempdir()) / f"mbody-{user}"
        folder.mkdir(mode=0o700, exist_ok=True)
        status = folder.lstat()
    except OSError:
        return None
    if not stat.S_ISDIR(status.st_mode):
        return None
    if hasattr(os, "getuid") and (status.st_uid != os.getuid() or status.st_mode & 0o077):
        return None
    return folder


def _candidates() -> Iterator[tuple[Path, bool]]:
    """Folders for the caches of all versions, best first, each with whether the user named it."""
    for name, suffix in (("MBODY_CACHE_DIR", ""), ("NUMBA_CACHE_DIR", "mbody")):
        value = os.environ.get(name)
        if value:
            yield Path(value).expanduser().absolute() / suffix, True
    home = os.environ.get("XDG_CACHE_HOME") or (
        os.environ.get("LOCALAPPDATA") if os.name == "nt" else None
    )
    try:
        cache = Path(home) if home else Path.home() / ".cache"
    except RuntimeError:  # no home directory is known
        pass
    else:
        if cache.is_absolute():
            yield cache / "mbody", False
    temporary = _private_temporary()
    if temporary is not None:
        yield temporary, False


@functools.cache
def cache_folder(stamp: str) -> Path | None:
    """The folder of compiled kernels with this stamp, or None if there is none.

    The first that can be written of ``$MBODY_CACHE_DIR/<stamp>``,
    ``$NUMBA_CACHE_DIR/mbody/<stamp>``, ``$XDG_CACHE_HOME/mbody/<stamp>`` (by default
    ``~/.cache``), and a private temporary folder.
    """
    for base, named in _candidates():
        folder = base / stamp
        if _writable(folder) and (named or _owned(folder)):
            _prune(base, folder)
            return folder
    return None


def _prune(base: Path, used: Path) -> None:
    """Mark a folder as used today and remove those of other versions that were not used for 30
    days.
    """
    now = time.time()
    try:
        if now - used.stat().st_mtime < 86400.0 and any(used.iterdir()):
            return  # done by an earlier process today
        os.utime(used)
        old = [
            entry
            for entry in base.iterdir()
            if len(entry.name) == STAMP_DIGITS
            and set(entry.name) <= set("0123456789abcdef")
            and entry != used
            and not entry.is_symlink()
            and now - entry.stat().st_mtime > _KEEP_SECONDS
        ]
    except OSError:
        return
    for folder in old:
        shutil.rmtree(folder, ignore_errors=True)
