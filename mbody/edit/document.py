"""A model file as a document: its text with a history without end, and what it gives."""

from __future__ import annotations

import contextlib
import errno
import hashlib
import json
import os
import sys
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path as FilePath
from typing import IO, Any

from mbody._version import __version__
from mbody.edit import places
from mbody.edit.edits import Editor
from mbody.edit.places import DrawingState as DrawingState
from mbody.edit.places import EditError
from mbody.edit.places import evaluate as evaluate
from mbody.errors import ModelError, SolveError, brief
from mbody.files.model.problems import Limits
from mbody.files.model.read import text_of
from mbody.files.tables import write_whole
from mbody.files.toml_spans import Path, Spans

#: What a journal may have: far more bytes than a model.
JOURNAL = Limits(size=200e6)
#: What some editors put before a text in UTF-8.
MARK = b"\xef\xbb\xbf"
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
        problems = tuple(getattr(error, "problems", ()))
        field = problems[0][1] if problems else ""
        path = getattr(error, "path", ()) or tuple(field.split(".") if field else ())
        sentence = problems[0][2] if len(problems) == 1 else str(error)
        if not isinstance(error, (ModelError, SolveError)):
            why = f"{type(error).__name__}: {brief(sentence, 200)}"
            sentence = f"this edit does not fit the file ({why})"
        return cls(sentence, getattr(error, "element", None) or "", path, problems)

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

    @classmethod
    def between(cls, what: str, old: str, new: str) -> Step:
        """The one piece in which two texts differ."""
        start = _common(old, new)
        end = _common(old[start:][::-1], new[start:][::-1])
        return cls(what, start, old[start : len(old) - end], new[start : len(new) - end])

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
        self.done, self.undone = list[Step](), list[Step]()
        self._kept = text if file is None or file.exists() else None
        self._mark = False
        self._journal: IO[bytes] | None = None  # while it is of this board
        self._spans: Spans | None = None
        self.state = evaluate("")
        self.state, self.fault = self._evaluated(text)

    @classmethod
    def open(cls, file: str | os.PathLike[str], start: str = "") -> Document:
        """The document of a file; one that is not there yet begins with a text.

        Raises ModelError where it cannot be read.
        """
        path = FilePath(file).resolve()
        found = path.exists()
        document = cls(text_of(path) if found else start, path.name, path.parent, path)
        document._mark = found and path.read_bytes().startswith(MARK)
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

    def apply(self, edit: Mapping[str, Any], *, journaled: bool = True) -> Fault | None:
        """Make an edit; the fault where it is refused, and then nothing has changed."""
        if self.fault is not None and edit.get("do") not in WITH_MISTAKES:
            return Fault(f"the text has a mistake to be mended first: {self.fault.sentence}")
        editor = Editor(self.text, self.state, self.name, self.folder, self.spans)
        try:
            editor.do(edit)
        except (ModelError, SolveError, *MISFITS) as error:
            return Fault.of(error)
        state, fault = self._evaluated(editor.text)
        # a text that is typed may have mistakes, and those of a file go one by one
        if fault is not None and self.fault is None and edit["do"] != "text":
            return fault
        if editor.text != self.text:
            step = Step.between(str(edit.get("what") or edit["do"]), self.text, editor.text)
            try:
                if journaled:
                    self._write({"step": asdict(step)})
            except EditError as error:
                return Fault.of(error)
            self.done.append(step)
            self.undone.clear()
            self.text, self.revision = editor.text, self.revision + 1
        self.remark, self.state, self.fault = editor.remark, state, fault
        return None

    def undo(self) -> str:
        """Take the last edit back; its words, empty where there is none."""
        return self._walk("undo", self.done, self.undone)

    def redo(self) -> str:
        """Make the edit again that was taken back last; its words."""
        return self._walk("redo", self.undone, self.done)

    def _walk(self, word: str, source: list[Step], target: list[Step]) -> str:
        if not source:
            return ""
        self._write({word: asdict(source[-1])})
        target.append(source.pop())
        self.text, self.revision = target[-1].of(self.text, word == "undo"), self.revision + 1
        self.remark, (self.state, self.fault) = "", self._evaluated(self.text)
        return target[-1].what

    def _evaluated(self, text: str) -> tuple[DrawingState, Fault | None]:
        """What a text gives; of one that is no mechanism the state of before, and the fault."""
        try:
            return evaluate(text, self.name, self.folder), None
        except (ModelError, SolveError, *MISFITS) as error:
            return self.state, Fault.of(error)

    # -- the file ----------------------------------------------------------------------------------

    @property
    def saved(self) -> bool:
        """Whether the file on disk has the text."""
        return self.text == self._kept

    def _on_disk(self) -> str | None:
        """The text of the file, None where there is none; what is no text has a sign of none."""
        try:
            return text_of(self.file) if self.file is not None else self._kept
        except ModelError:
            return "\0" if self.file is not None and os.path.lexists(self.file) else None

    def changed_on_disk(self) -> str:
        """What has become of the file since it was read or saved; empty where nothing has."""
        text = self._on_disk()
        if self.file is None or text == self._kept:
            return ""
        what = "been deleted" if text is None else "changed on disk"
        return f"'{self.file.name}' has {what} since it was read"

    def follow(self) -> bool:
        """Take up a change of the file from elsewhere, as one edit, where nothing here is unsaved;
        whether there was one.
        """
        text = self._on_disk() if self.saved else None
        if text in (None, "\0", self._kept):
            return False
        self.apply({"do": "text", "text": text, "what": "changed elsewhere"}, journaled=False)
        self._kept = text
        self.leave()
        return True

    def save(self, file: FilePath | None = None, *, force: bool = False) -> Fault | None:
        """Write the file, whole or not at all; the fault where it cannot be written, or has changed
        on disk and nobody has said that it shall be written over.
        """
        path = file or self.file
        if path is None:
            return Fault("the drawing has no file yet: give it a name")
        path = path.resolve()
        if path == self.file and not force and (words := self.changed_on_disk()):
            return Fault(f"{words}: save under another name, or write over it", conflict=True)
        try:
            mode = path.stat().st_mode if path.exists() else None
            if mode is not None and not mode & 0o222:
                raise PermissionError(errno.EACCES, "it is read-only")
            if self._journal is not None:  # so that a crash right after the writing leaves no edits
                with contextlib.suppress(EditError):
                    self._write({"saved": _digest(self.text)})
            write_whole(path, MARK * self._mark + self.text.encode())
            if mode is not None:
                path.chmod(mode)
        except OSError as error:
            return Fault(f"'{path.name}' cannot be written ({error.strerror}): save elsewhere")
        self.leave()
        self.file, self.folder, self.name, self._kept = path, path.parent, path.name, self.text
        return None

    # -- the journal -------------------------------------------------------------------------------

    @property
    def _journal_file(self) -> FilePath:
        assert self.file is not None
        return self.file.with_name(f"{self.file.name}.journal")

    @property
    def journal(self) -> bool:
        """Whether there is a journal of another board, now or of an earlier session, which
        `recover` takes up.
        """
        other = self.file is not None and self._journal is None
        return other and os.path.lexists(self._journal_file)

    def _open_journal(self) -> IO[bytes]:
        """The journal, of this board alone as long as it is open."""

        def opened(path: str, flags: int) -> int:  # a link may lead outside, a pipe waits
            safe = getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_NONBLOCK", 0)
            return os.open(path, flags | safe, 0o666)

        stream = open(self._journal_file, "ab", 0, opener=opened)  # noqa: SIM115
        try:
            if sys.platform != "win32":  # there two boards on one file are not told apart
                import fcntl

                fcntl.flock(stream, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            stream.close()
            raise EditError(
                f"'{self.name}' has unsaved edits in another board: save them there, then they are "
                "here as well"
            ) from None
        return stream

    def _write(self, entry: Mapping[str, Any]) -> None:
        """Append to the journal before the edit is answered."""
        if self.file is None:
            return
        if self._journal is not None and not os.fstat(self._journal.fileno()).st_nlink:
            self.close()  # somebody has removed it
        lines, size = [dict(entry)], 0
        try:
            if self._journal is not None:
                size = os.fstat(self._journal.fileno()).st_size
            else:
                if self.journal:  # nobody asked for it: it is kept under another name
                    with contextlib.suppress(OSError):  # a link, a folder
                        self._open_journal().close()
                    self._journal_file.rename(_unused(f"{self._journal_file}.old"))
                of = _digest(self._kept or "")
                head = {"mbody": __version__, "file": self.file.name, "of": of}
                lines.insert(0, head if self.saved else head | {"start": self.text})
                self._journal = self._open_journal()
            content = "".join(json.dumps(line) + "\n" for line in lines).encode()
            if self._journal.write(content) != len(content):
                raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        except OSError as error:
            if size and self._journal is not None:
                self._journal.truncate(size)
            else:
                self.leave()
            raise EditError(
                f"the journal '{self._journal_file.name}' cannot be written ({error.strerror}): "
                "free space or save elsewhere; the edit is not made"
            ) from None

    def leave(self) -> None:
        """Give up what is unsaved, with its journal."""
        if self._journal is not None:
            self._journal_file.unlink(missing_ok=True)
            self.close()

    def close(self) -> None:
        """Leave what is unsaved to the next board."""
        if self._journal is not None:
            self._journal = self._journal.close()

    def recover(self) -> Fault | None:
        """Take up the edits of an earlier session that were not saved; the fault where its journal
        is of another board or text, or damaged, and then nothing has changed.
        """
        if not self.journal:
            return Fault("there is no journal of an earlier session")
        name, done, undone = self._journal_file.name, list[Step](), list[Step]()
        with contextlib.ExitStack() as stack:
            try:
                stream = stack.enter_context(self._open_journal())
                whole = text_of(self._journal_file, JOURNAL).rpartition("\n")[0]
                head, *entries = map(json.loads, whole.split("\n"))
                text, here = str(head.get("start", self.text)), _digest(self._kept or "")
                if entries and entries[-1].get("saved") == here:  # then it ended
                    self._journal_file.unlink()
                    return None
                if head["of"] != here:
                    return Fault(
                        f"the journal '{name}' is of another text than '{self.name}' has now: put "
                        "that file back, or remove the journal"
                    )
                for word, given in (pair for one in entries for pair in one.items()):
                    if word == "saved":
                        continue
                    step = Step(**given)
                    source, target = (done, undone) if word == "undo" else (undone, done)
                    if word == "step":
                        undone.clear()
                    elif source:  # not of an edit that was saved before
                        source.pop()
                    target.append(step)
                    text = step.of(text, back=word == "undo")
                stream.truncate(len(whole) + 1)  # without what a crash cut
            except EditError as error:
                return Fault.of(error)
            except (OSError, ModelError, *MISFITS):
                return Fault(
                    f"the journal '{name}' is damaged and cannot be taken up: remove it; the file "
                    "is as it was saved"
                )
            self._journal = stream
            stack.pop_all()
        self.done, self.undone, self.text, self.revision = done, undone, text, self.revision + 1
        self.state, self.fault = self._evaluated(text)
        return None


def _unused(name: str) -> str:
    """A name of no file: this one, or with a number behind it."""
    every = (f"{name}{n or ''}" for n in range(9999))
    return next(one for one in every if not os.path.lexists(one))


def _digest(text: str) -> str:
    return hashlib.sha256(text.encode(errors="surrogatepass")).hexdigest()


def _common(one: str, other: str) -> int:
    """How many first characters of two texts are the same."""
    pairs = enumerate(zip(one, other, strict=False))
    return next((n for n, (a, b) in pairs if a != b), min(len(one), len(other)))
