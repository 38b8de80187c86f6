"""A model file as a document: its text with a history without end, and what it gives."""

from __future__ import annotations

import contextlib
import hashlib
import json
import os
import shutil
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path as FilePath
from typing import Any

from mbody._version import __version__
from mbody.edit import places
from mbody.edit.edits import Editor
from mbody.edit.places import DrawingState as DrawingState
from mbody.edit.places import evaluate as evaluate
from mbody.errors import ModelError, SolveError, brief
from mbody.files.model.read import text_of
from mbody.files.toml_spans import Path, Spans
from mbody.files.writing import writing

#: Bytes of a journal that are read.
JOURNAL_SIZE = 200_000_000
#: Edits of a text that is no mechanism.
WITH_MISTAKES = ("text", "set", "unset", "add", "delete", "rename")
#: What an edit may raise that does not fit its file or has arguments of other kinds.
MISFITS = (ValueError, TypeError, LookupError, AttributeError, ArithmeticError, RecursionError)


@dataclass(frozen=True)
class Fault:
    """Why an edit is refused or a text is no mechanism.

    `element`, `path`: At fault, as far as they are known; the key is the last of the path.
    `problems`: (line, field, sentence) of everything that is wrong in a text.
    `conflict`: Whether the file has changed on disk.
    """

    sentence: str
    element: str = ""
    path: Path = ()
    problems: tuple[tuple[int | None, str, str], ...] = ()
    conflict: bool = False

    @classmethod
    def of(cls, error: Exception) -> Fault:
        """That of an error."""
        problems: Any = getattr(error, "problems", ())
        field = problems[0][1] if problems else ""
        path = getattr(error, "path", ()) or tuple(field.split(".") if field else ())
        known = isinstance(error, (ModelError, SolveError))
        sentence = (
            str(error)
            if known
            else (
                "this edit does not fit the file "
                f"({type(error).__name__}: {brief(str(error), 200)})"
            )
        )
        one = problems[0][2] if len(problems) == 1 else sentence
        return cls(one, getattr(error, "element", None) or "", path, tuple(problems))

    def data(self) -> dict[str, Any]:
        """As JSON has it."""
        return asdict(self)


@dataclass(frozen=True)
class Step:
    """One edit: its words, and the piece of the text that it exchanged."""

    what: str
    at: int
    old: str
    new: str

    def of(self, text: str, back: bool = False) -> str:
        """A text with the edit, or before it; ValueError of one that it does not belong to."""
        old, new = (self.new, self.old) if back else (self.old, self.new)
        end = self.at + len(old)
        if self.at < 0 or text[self.at : end] != old:
            raise ValueError("of another text")
        return text[: self.at] + new + text[end:]


class Document:
    """The text of a model file with its history and its journal.

    `file`: On disk, where it has one; every edit is then in ``NAME.toml.journal`` beside it until
    it is saved.

    Attributes
    ----------
    text, revision : str, int
        As it would be saved now, and how many changes led there.
    state : DrawingState
        What the text gives; of a text that is no mechanism that of the last one that was.
    fault : Fault or None
        Why the text is no mechanism.
    remark : str
        What the last edit gave otherwise than asked.
    journal : bool
        Whether there is a journal of an earlier session, which `recover` takes up and `forget`
        removes.

    >>> board = Document()
    >>> board.apply({"do": "link", "at": [{"xy": [0, 0]}, {"xy": [20, 35]}], "what": "link drawn"})
    >>> board.state.place("link1.B"), board.undo(), board.text
    ((20.0, 35.0), 'link drawn', '')
    """

    def __init__(
        self,
        text: str = "",
        name: str = "model",
        folder: FilePath | None = None,
        file: FilePath | None = None,
    ) -> None:
        self.name, self.folder, self.file = name, folder, file
        self.text, self.revision, self.remark = text, 0, ""
        self.done: list[Step] = []
        self.undone: list[Step] = []
        self.fault: Fault | None = None
        self.state = evaluate("")
        self._kept = text if file is None or file.exists() else None
        self._mark = False
        self._journaled = False  # whether the journal is of this session
        self._spans: Spans | None = None
        self.journal = file is not None and self._journal_file.exists()
        self._evaluate()

    @classmethod
    def open(cls, file: str | os.PathLike[str], start: str = "") -> Document:
        """The document of a file; one that is not there yet begins with a text.

        Raises ModelError where it cannot be read.
        """
        path = FilePath(file).resolve()
        found = path.exists()
        document = cls(text_of(path) if found else start, path.name, path.parent, path)
        if found:
            with path.open("rb") as stream:
                document._mark = stream.read(3) == b"\xef\xbb\xbf"
        return document

    @property
    def spans(self) -> Spans:
        """Where everything of the text stands; of one that is no TOML, of the empty one."""
        if self._spans is None or self._spans.text is not self.text:
            try:
                self._spans = Spans(self.text)
            except (ValueError, RecursionError):
                self._spans = Spans("")
        return self._spans

    @property
    def tree(self) -> dict[str, Any]:
        """The tables of the text."""
        return self.spans.tree

    def groups(self) -> list[list[str]]:
        """Places that are one point of the drawing; none of a text that is no mechanism."""
        return [] if self.fault else places.pin_groups(self.tree)

    def handles(self, group: Sequence[str]) -> list[str]:
        """Parameters that move a point."""
        return places.handles(self.state, self.tree, group)

    def fixed(self, group: Sequence[str]) -> str:
        """Why a point cannot be moved; empty where it can."""
        return places.fixed(self.state, self.tree, group)

    # -- history -----------------------------------------------------------------------------------

    @property
    def undo_words(self) -> str:
        """The edit that `undo` takes back."""
        return self.done[-1].what if self.done else ""

    @property
    def redo_words(self) -> str:
        """The edit that `redo` makes again."""
        return self.undone[-1].what if self.undone else ""

    def apply(self, edit: Mapping[str, Any]) -> Fault | None:
        """Make an edit; the fault where it is refused, and then nothing has changed."""
        if self.fault is not None and edit.get("do") not in WITH_MISTAKES:
            return Fault(f"the text has a mistake to be mended first: {self.fault.sentence}")
        editor = Editor(self.text, self.state, self.name, self.folder)
        fault, state = None, self.state
        try:
            editor.do(edit)
            try:
                state = evaluate(editor.text, self.name, self.folder)
            except (ModelError, SolveError) as error:
                # a text that is typed may have mistakes, and those of a file go one by one
                if edit["do"] != "text" and self.fault is None:
                    raise
                fault = Fault.of(error)
        except (ModelError, SolveError, *MISFITS) as error:
            return Fault.of(error)
        self.remark = editor.remark
        if editor.text != self.text:
            step = _step(str(edit.get("what") or edit["do"]), self.text, editor.text)
            if (refused := self._write({"step": asdict(step)})) is not None:
                return refused
            self.done.append(step)
            self.undone.clear()
            self.text, self.revision = editor.text, self.revision + 1
        self.state, self.fault = state, fault
        return None

    def undo(self) -> str:
        """Take the last edit back; its words, empty where there is none."""
        return self._walk(self.done, self.undone, back=True)

    def redo(self) -> str:
        """Make the edit again that was taken back last; its words."""
        return self._walk(self.undone, self.done, back=False)

    def _walk(self, source: list[Step], target: list[Step], back: bool) -> str:
        if not source:
            return ""
        self._write({"undo" if back else "redo": True})
        step = source.pop()
        target.append(step)
        self.text, self.revision, self.remark = step.of(self.text, back), self.revision + 1, ""
        self._evaluate()
        return step.what

    def _evaluate(self) -> None:
        """What the text gives, or its fault."""
        self.fault = None
        try:
            self.state = evaluate(self.text, self.name, self.folder)
        except (ModelError, SolveError) as error:
            self.fault = Fault.of(error)

    # -- the file ----------------------------------------------------------------------------------

    @property
    def saved(self) -> bool:
        """Whether the file on disk has the text."""
        return self.text == self._kept

    def changed_on_disk(self) -> bool:
        """Whether the file has another text than when it was read or saved."""
        return self.file is not None and self._on_disk(self.file) != self._kept

    @staticmethod
    def _on_disk(file: FilePath) -> str | None:
        try:
            return text_of(file) if file.exists() else None
        except ModelError:
            return None

    def follow(self) -> bool:
        """Take up a change of the file from elsewhere, as one edit, where nothing here is unsaved;
        whether there was one.
        """
        if self.file is None or not self.saved or not self.changed_on_disk():
            return False
        text = self._on_disk(self.file)
        if text is None or self.apply({"do": "text", "text": text, "what": "changed elsewhere"}):
            return False
        self._kept = text
        self._drop_journal()
        return True

    def save(self, file: FilePath | None = None, *, force: bool = False) -> Fault | None:
        """Write the file, whole or not at all; the fault where it cannot be written, or has changed
        on disk and nobody has said that it shall be written over.
        """
        path = file or self.file
        if path is None:
            return Fault("the drawing has no file yet: give it a name")
        path = path.resolve()
        own = self.file is not None and path == self.file
        if own and not force and self.changed_on_disk():
            return Fault(
                f"'{path.name}' has changed on disk since it was read: save under another name, or "
                "write over it",
                conflict=True,
            )
        new = path.with_name(f"{path.name}.new")
        try:
            with writing(new, mark=self._mark) as stream:
                stream.write(self.text)
                stream.flush()
                os.fsync(stream.fileno())
            with contextlib.suppress(OSError):
                shutil.copymode(path, new)
            os.replace(new, path)
        except (ModelError, OSError) as error:
            with contextlib.suppress(OSError):
                new.unlink()
            why = str(error) if isinstance(error, ModelError) else f"{path.name}: {error.strerror}"
            return Fault(why)
        self._drop_journal()
        self.file, self.folder, self.name, self._kept = path, path.parent, path.name, self.text
        self.journal = False
        return None

    # -- the journal -------------------------------------------------------------------------------

    @property
    def _journal_file(self) -> FilePath:
        assert self.file is not None
        return self.file.with_name(f"{self.file.name}.journal")

    def _write(self, entry: Mapping[str, Any]) -> Fault | None:
        """Append to the journal before the edit is answered."""
        if self.file is None:
            return None
        lines = [dict(entry)]
        try:
            if not self._journaled:
                if self.journal:  # nobody asked for it: it is kept under another name
                    os.replace(self._journal_file, f"{self._journal_file}.old")
                head = {"mbody": __version__, "file": self.file.name, "of": _digest(self.text)}
                lines.insert(0, head if self.saved else head | {"start": self.text})
            with self._journal_file.open("a" if self._journaled else "w", encoding="utf-8") as file:
                file.writelines(json.dumps(line) + "\n" for line in lines)
        except OSError as error:
            return Fault(
                f"the journal '{self._journal_file.name}' cannot be written ({error.strerror}): "
                "free space or save elsewhere; the edit is not made"
            )
        self.journal, self._journaled = False, True
        return None

    def _drop_journal(self) -> None:
        if self._journaled:
            self._journal_file.unlink(missing_ok=True)
            self._journaled = False

    def leave(self) -> None:
        """Give up what is unsaved, with its journal."""
        self._drop_journal()

    def forget(self) -> None:
        """Remove the journal of an earlier session."""
        if self.journal:
            self._journal_file.unlink(missing_ok=True)
            self.journal = False

    def recover(self) -> Fault | None:
        """Take up the edits of an earlier session that were not saved; the fault where its journal
        is of another text or damaged, and then nothing has changed.
        """
        if not self.journal:
            return Fault("there is no journal of an earlier session")
        name, text, done, undone = self._journal_file.name, self.text, list[Step](), list[Step]()
        try:
            whole, entries = _entries(self._journal_file)
            head = entries.pop(0)
            text = str(head.get("start", text))
            if head["of"] != _digest(text) or ("start" in head and self._kept is not None):
                return Fault(
                    f"the journal '{name}' is of another text than '{self.name}' has now: put that "
                    "file back, or forget the journal"
                )
            for entry in entries:
                source, target = (done, undone) if "undo" in entry else (undone, done)
                if "step" in entry:
                    source = [Step(**entry["step"])]
                    undone.clear()
                target.append(source.pop())
                text = target[-1].of(text, back="undo" in entry)
            os.truncate(self._journal_file, whole)  # without what a crash cut
        except (OSError, *MISFITS):
            return Fault(
                f"the journal '{name}' is damaged and cannot be taken up: forget it; the file is "
                "as it was saved"
            )
        self.done, self.undone, self.text, self.revision = done, undone, text, self.revision + 1
        self.journal, self._journaled = False, True
        self._evaluate()
        return None


def _step(what: str, old: str, new: str) -> Step:
    """The one piece in which two texts differ."""
    start = _common(old, new)
    most = min(len(old), len(new)) - start
    end = _common(old[::-1][:most], new[::-1][:most])
    return Step(what, start, old[start : len(old) - end], new[start : len(new) - end])


def _digest(text: str) -> str:
    return hashlib.sha256(text.encode(errors="surrogatepass")).hexdigest()


def _entries(file: FilePath) -> tuple[int, list[dict[str, Any]]]:
    """Lines of a journal, and the bytes that they are; one that a crash cut was never answered."""
    if not file.is_file() or file.stat().st_size > JOURNAL_SIZE:
        raise ValueError("no journal")
    raw = file.read_bytes()
    whole = raw.rfind(b"\n") + 1
    entries = [json.loads(line) for line in raw[:whole].decode().split("\n")[:-1]]
    if not all(isinstance(entry, dict) for entry in entries):
        raise ValueError("no entry")
    return whole, entries


def _common(one: str, other: str) -> int:
    """How many first characters of two texts are the same."""
    low, high = 0, min(len(one), len(other)) + 1
    while high - low > 1:
        middle = (low + high) // 2
        low, high = (middle, high) if one[:middle] == other[:middle] else (low, middle)
    return low
