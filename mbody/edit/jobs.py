"""Exports of the board: each is a command of mbody, run as such beside the server, so that what it
writes is what the shown command writes, and the board stays fluent.
"""

from __future__ import annotations

import os
import secrets
import shlex
import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryFile
from typing import IO, TYPE_CHECKING, Any, NamedTuple

from mbody.errors import ModelError, brief

if TYPE_CHECKING:
    from mbody.edit.document import Document

#: By what is exported: the words of the command before and after the model, what the name of the
#: file has behind that of the model, and the ends that it may have.
EXPORTS: dict[str, tuple[str, str, str, tuple[str, ...]]] = {
    "report": ("report", "-o", "-report", (".html", ".pdf")),
    "page": ("view", "-o", "", (".html",)),
    "drawing": ("draw", "-o", "", (".svg", ".pdf", ".png")),
    "freebody": ("freebody", "-o", "-freebody", (".svg", ".pdf", ".png")),
    "film": ("animate", "-o", "", (".gif", ".mp4", ".webp", ".png")),
    "dxf": ("export", "--to dxf -o", "", (".dxf",)),
    "fmu": ("export", "--to fmu -o", "", (".fmu",)),
    "csv": ("", "--csv", "", (".csv",)),
    "xlsx": ("", "--xlsx", "", (".xlsx",)),
}
#: Signs of what a command has said that are kept.
LONGEST = 2_000


def as_word(path: str) -> str:
    """A path as a word of a command that is no option.

    >>> as_word("-o.toml"), as_word("press.toml")
    ('./-o.toml', 'press.toml')
    """
    return f"./{path}" if path.startswith("-") else path


def command_of(document: Document, word: str) -> str:
    """The command line that computes what the board shows."""
    name = word or f"{document.name.removesuffix('.toml')}.toml"
    return shlex.join(["mbody", *analysis_words(document, name)])


def analysis_words(document: Document, word: str) -> list[str]:
    """The words of the command that analyses a document."""
    state = document.state
    if state.turn is not None:
        return ["kinetostatics", word, "--over", "turn"]
    driven = state.mobility is not None and not state.mobility.freedom
    if state.mechanism.simulation is not None and not driven:
        return ["simulate", word]
    return ["kinetostatics" if driven else "check", word]


class ExportJob(NamedTuple):
    """One export: the words of its command, its file, its process and what that says."""

    words: list[str]
    file: Path
    process: subprocess.Popen[bytes]
    errors: IO[str]


class ExportJobs:
    """The exports of a session, which write below its folder and over nothing but their own."""

    def __init__(self, folder: Path) -> None:
        self.folder, self.jobs = folder, dict[str, ExportJob]()
        self.made: dict[Path, tuple[int, int]] = {}

    def start(self, do: str, document: Document, word: str, file: Path | None, force: bool) -> str:
        """Begin an export; its number."""
        if do not in EXPORTS:
            raise ModelError(f"the board exports no {brief(do)}: it exports {', '.join(EXPORTS)}")
        if not word:
            raise ModelError("the command reads a file, which the model has not yet: save it first")
        verb, option, behind, ends = EXPORTS[do]
        if file is None:
            file = self.folder / Path(word).with_name(f"{Path(word).stem}{behind}{ends[0]}")
        if file.suffix.lower() not in ends:
            raise ModelError(f"{brief(file.name)} must end in {' or '.join(ends)}")
        new = force or not file.exists() or self.made.get(file) == _stamp(file)
        if not new or file.is_symlink():
            raise ModelError(f"there is a file '{file.name}' already: choose another name")
        head = [verb, word] if verb else analysis_words(document, word)
        if not verb and head[0] == "check":
            raise ModelError("there are no results yet to write: drive all that is free")
        words = [*head, *option.split(), as_word(file.relative_to(self.folder).as_posix())]
        errors = TemporaryFile("w+", encoding="utf-8", errors="replace")  # noqa: SIM115
        process = subprocess.Popen(
            # nothing is imported from the folder, whose files may be anybody's
            [sys.executable, "-P", "-m", "mbody", *words],
            cwd=self.folder,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=errors,
            env=os.environ | {"PYTHONPATH": str(Path(__file__).parents[2])},
        )
        number = secrets.token_hex(8)
        self.jobs[number] = ExportJob(words, file, process, errors)
        return number

    def report(self, number: str) -> dict[str, Any]:
        """How far an export is."""
        job = self.jobs.get(number)
        if job is None:
            raise ModelError("there is no such export: the board was started anew, begin it again")
        status, command = job.process.poll(), shlex.join(["mbody", *job.words])
        if status is None:
            return {"done": 0.0, "command": command}
        # 1 is a result in doubt, which is written all the same
        if status in (0, 1) and job.file.exists():
            self.made[job.file] = _stamp(job.file)
            file = job.file.relative_to(self.folder).as_posix()
            return {"done": 1.0, "command": command, "file": file}
        job.errors.seek(0)
        *_, last = ["the command ended without a word", *job.errors.read().split("\n")[:-1]]
        sentence = last.removeprefix("mbody: ")[:LONGEST]
        return {"done": 1.0, "command": command, "fault": {"sentence": sentence}}

    def close(self) -> None:
        """End what is under way."""
        for job in self.jobs.values():
            job.process.terminate()
            job.errors.close()


def _stamp(file: Path) -> tuple[int, int]:
    found = file.stat()
    return found.st_mtime_ns, found.st_size
