"""Exports of the board: each is a command of mbody, run as such beside the server, so that what it
writes is what the shown command writes, and the board stays fluent.
"""

from __future__ import annotations

import os
import secrets
import shlex
import subprocess
import sys
import threading
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

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


@dataclass
class ExportJob:
    """One export: its words, its file, and how it ended."""

    words: list[str]
    file: Path
    process: subprocess.Popen[str] | None = None
    fault: str | None = None
    done: bool = False

    def follow(self) -> None:
        """Wait for the end."""
        assert self.process is not None
        _, said = self.process.communicate()
        lines = [line for line in said.strip().splitlines() if line]
        # 1 is a result in doubt, which is written all the same
        if self.process.returncode not in (0, 1) or not self.file.exists():
            last = lines[-1] if lines else "the command ended without a word"
            self.fault = last.removeprefix("mbody: ")[:LONGEST]
        self.done = True


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
        self._check(file, force)
        head = [verb, word] if verb else analysis_words(document, word)
        if not verb and head[0] == "check":
            raise ModelError("there are no results yet to write: drive all that is free")
        target = as_word(file.relative_to(self.folder).as_posix())
        job = ExportJob([*head, *option.split(), target], file)
        # nothing is imported from the folder, whose files may be anybody's
        job.process = subprocess.Popen(
            [sys.executable, "-P", "-m", "mbody", *job.words],
            cwd=self.folder,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
            text=True,
            env=os.environ | {"PYTHONPATH": str(Path(__file__).parents[2])},
        )
        number = secrets.token_hex(8)
        self.jobs[number] = job
        threading.Thread(target=job.follow, daemon=True).start()
        return number

    def _check(self, file: Path, force: bool) -> None:
        """Refuse to write over what an export of this session has not made."""
        if file.exists() and not force and self.made.get(file) != _stamp(file):
            raise ModelError(f"there is a file '{file.name}' already: choose another name")

    def report(self, number: str) -> dict[str, Any]:
        """How far an export is."""
        job = self.jobs.get(number)
        if job is None:
            raise ModelError("there is no such export: the board was started anew, begin it again")
        found: dict[str, Any] = {"command": shlex.join(["mbody", *job.words])}
        if not job.done:
            return found | {"done": 0.0}
        if job.fault is not None:
            return found | {"done": 1.0, "fault": {"sentence": job.fault}}
        self.made[job.file] = _stamp(job.file)
        return found | {"done": 1.0, "file": job.file.relative_to(self.folder).as_posix()}

    def close(self) -> None:
        """End what is under way."""
        for job in self.jobs.values():
            if job.process is not None and job.process.poll() is None:
                job.process.terminate()


def _stamp(file: Path) -> tuple[int, int]:
    found = file.stat()
    return found.st_mtime_ns, found.st_size
