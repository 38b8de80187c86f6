"""Building libraries of kernels, by processes of their own."""

from __future__ import annotations

import contextlib
import itertools
import os
import sys
from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from typing import IO, Any

from mbody.core import registered, selection
from mbody.core.interface import KERNELS
from mbody.core.libraries import LIBRARIES, by_library
from mbody.core.selection import PACKAGE, source_hash

#: Number of kernels built in this process.
built = 0


def build(
    functions: list[Callable[..., Any]],
    processes: int = 1,
    say: Callable[[str], None] | None = None,
) -> None:
    """Build the libraries of some kernels for this machine, in processes of their own.

    `say` gets the name of each library when it is begun; without it one line on stderr names all.
    """
    global built
    from concurrent.futures import ThreadPoolExecutor

    wanted = by_library(functions)
    for name in wanted:
        for module in LIBRARIES.get(name, "").split():
            import_module(f"{PACKAGE.name}.{module}")
    libraries = [one for name, one in by_library(KERNELS.values()).items() if name in wanted]
    if say is None and (tell := _stderr()):
        what = ", ".join(repr(name) for name in wanted)
        tell(f"building kernels of {what} for this machine (once) ...")
    count = min(processes, len(libraries))
    shares = [list(itertools.chain(*libraries[n::count])) for n in range(count)]
    with ThreadPoolExecutor(count) as pool:
        list(pool.map(lambda share: _build(share, say), shares))
    built += sum(map(len, shares))


def _stderr() -> Callable[[str], None] | None:
    """Prints a line of mbody on stderr; None where MBODY_QUIET is set."""
    if os.environ.get("MBODY_QUIET", "0") not in ("", "0") or sys.stderr is None:
        return None

    def tell(text: str) -> None:
        with contextlib.suppress(OSError, ValueError):
            print(f"mbody: {text}", file=sys.stderr, flush=True)

    return tell


def builder_command(
    names: list[str], target: str, folder: Path, *options: str
) -> tuple[list[str], dict[str, str]]:
    """The program that builds kernels (``module:name``) into a folder, and its environment."""
    path = os.pathsep.join(filter(None, [str(PACKAGE.parent), os.environ.get("PYTHONPATH", "")]))
    settings = os.environ | {"MBODY_CORE": "numba", "MBODY_QUIET": "1", "PYTHONPATH": path}
    command = [sys.executable, "-m", registered.builder, "--target", target, *options]
    command += ["--out", str(folder), "--sources", source_hash() or "", *names]
    return command, settings


def place(function: Callable[..., Any]) -> str:
    """Where the builder finds a kernel."""
    return f"{function.__module__}:{function.__name__}"


def run_builder(
    command: list[str],
    settings: dict[str, str],
    say: Callable[[str], None] | None = None,
    errors: IO[str] | None = None,
) -> int:
    """Run the builder: its exit status. `say` gets each name when that part is begun; what it says
    of errors goes to a file, by default to where those of this process go.
    """
    import subprocess

    with subprocess.Popen(
        command,
        env=settings,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=errors,
        text=True,
    ) as process:
        assert process.stdout is not None
        try:
            for line in process.stdout:
                if say is not None:
                    say(line.strip())
        except BaseException:
            process.kill()
            raise
    return process.returncode


def builder_fails(
    command: list[str], settings: dict[str, str], say: Callable[[str], None] | None, most: int = 6
) -> str | None:
    """Run the builder: None, or the last lines of its errors where it could not build."""
    import tempfile

    # a file, not a pipe: a full one would stop the builder while its names are read
    with tempfile.TemporaryFile("w+", encoding="utf-8") as said:
        if not run_builder(command, settings, say, said):
            return None
        said.seek(0)
        return "\n".join(said.read().strip().splitlines()[-most:])


def progress(what: str, count: int) -> Callable[[str], None] | None:
    """Announce on stderr that something is built, in so many steps; gives what names the step that
    is under way, as "building positions, 4 of 7". None where MBODY_QUIET is set.
    """
    tell = _stderr()
    if tell is None:
        return None
    tell(f"building {what} (once) ...")
    begun = itertools.count(1)
    return lambda name: tell(f"building {name}, {next(begun)} of {count}")


def _build(functions: list[Callable[..., Any]], say: Callable[[str], None] | None) -> None:
    choice = selection.chosen()
    assert choice.file is not None and choice.level is not None
    names = [place(function) for function in functions]
    command, settings = builder_command(names, choice.level, choice.file)
    last = builder_fails(command, settings, say, 12)
    if last is not None:
        raise RuntimeError(
            f"the machine code of {', '.join(names)} could not be built; MBODY_CORE=numba does "
            f"without it. The builder said:\n{last}"
        )
