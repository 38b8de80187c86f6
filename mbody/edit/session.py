"""What is behind the page: one document, its file, its views and its exports, asked by one request
at a time.
"""

from __future__ import annotations

import functools
import hmac
import itertools
import json
import math
import os
import re
import secrets
import shlex
import subprocess
import sys
import threading
import time
import tomllib
from collections.abc import Callable, Mapping
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from importlib import resources
from pathlib import Path
from tempfile import TemporaryFile
from typing import IO, Any, NamedTuple

from mbody.edit.board_state import (
    VIEWS,
    board_state,
    checked_view,
    drag_state,
    modes_of,
    number_of,
    picture_of,
    read_views,
    views_file,
)
from mbody.edit.document import Document, Fault
from mbody.edit.places import Dragging, group_of
from mbody.errors import ModelError, SolveError, at_the_command, brief
from mbody.files.model.read import text_of
from mbody.files.model.toml_text import toml
from mbody.files.tables import write_whole

# -- Exports of the board: each is a command of mbody, run as such beside the server, so that
#    what it writes is what the shown command writes, and the board stays fluent ---------------

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


Answer = dict[str, Any]

#: Files that are not listed: hidden ones, views of boards.
HIDDEN = re.compile(rf"(^|/)\.|{re.escape(VIEWS)}$")
#: Seconds that `wait` is held, and between two looks at the file.
HELD, LOOK_EVERY = 25.0, 0.4
#: Shapes of a drag are made anew after so many times as long as they took.
PAUSE = 2.0
#: Files of the folder that are looked through, and those that are listed.
LOOKED, LISTED = 5_000, 500
#: Ends of files to open, of other programs, and of pictures to draw over.
ENDS = {
    "models": (".toml",),
    "imports": (".pmks", ".linkage2", ".txt", ".json", ".xml", ".mjcf", ".urdf"),
    "pictures": (".png", ".jpg", ".jpeg", ".dxf"),
}
EMPTY = 'units = "mm-N-s"\n'
#: What changes or leaves a revision that a page must have seen.
CHANGES = ("edit", "undo", "redo", "save", "open", "drag", "underlay")


class BoardSession:
    """A document with everything around it.

    `folder`: That in which the command was started; no file is read or written outside of it.
    `views`: What is kept of the board beside the model: its camera, the picture below it.
    """

    def __init__(self, folder: Path, model: str | None = None) -> None:
        self.folder, self.lock = folder.resolve(), threading.Condition()
        self.jobs, self.unit, self.past = ExportJobs(self.folder), 0.3, 0
        self.motions = False
        self.document = Document(EMPTY, "model")
        self.dragging: Dragging | None = None
        self.scene, self.rows, self.due = dict[str, Any](), list[Answer](), 0.0
        self.views, self.notes = dict[str, Any](), list[str]()
        self.gallery, self.recovered = "", False
        if model is not None:
            self._begin(model)

    @property
    def revision(self) -> int:
        """Of the document, and of those before it."""
        return self.past + int(self.document.revision)

    @property
    def file(self) -> str:
        """That of the document, from the folder; empty where it was never saved."""
        return self._named(self.document.file) if self.document.file else ""

    @property
    def word(self) -> str:
        """What the command calls the model: its file, or a name of the gallery."""
        return as_word(self.file) if self.file else self.gallery

    def answer(self, asked: Mapping[str, Any]) -> tuple[int, Answer]:
        """Status and answer of a request: 409 with the state where it is of an old revision."""
        act = str(asked.get("act"))
        method = getattr(self, f"_act_{act}", None)
        if method is None:
            return 400, {"rev": self.revision}
        with self.lock, at_the_command():
            try:
                unit = asked.get("unit")
                if isinstance(unit, (int, float)) and 0.0 < unit < math.inf:
                    self.unit = float(unit)
                self.motions = asked.get("motions", self.motions) is True
                if act in CHANGES and asked.get("rev", self.revision) != self.revision:
                    return 409, self._state()
                return 200, method(asked)
            except (ModelError, SolveError) as error:
                return 200, self._refused(Fault.of(error))
            except OSError as error:
                return 200, self._refused(Fault(f"this file cannot be used: {error.strerror}"))
            except Exception as error:  # a request may have any keys, of any kinds
                why = f"{type(error).__name__}: {error}"
                print(f"mbody: the board could not do {brief(act)} ({why})", file=sys.stderr)
                return 400, self._refused(Fault(f"this request is not understood ({why})"))

    def _refused(self, fault: Fault) -> Answer:
        return {"rev": self.revision, "fault": fault.data(), "conflict": fault.conflict}

    def _state(self) -> Answer:
        state = board_state(self.document, self.unit, self.motions)
        self.scene, self.rows = state["scene"], state["rows"]
        said = [*self.notes, self.document.remark, self.document.changed_on_disk()]
        state["messages"] += [
            {"element": "", "key": "", "text": text, "kind": "note"} for text in said if text
        ]
        own = {"rev": self.revision, "file": self.file, "journal": self.recovered}
        command = command_of(self.document, self.word)
        return state | own | {"views": self.views, "command": command}

    # -- the document --------------------------------------------------------------------------

    def _changed(self) -> Answer:
        self.dragging = None
        self.lock.notify_all()
        return self._state()

    def _act_look(self, asked: Mapping[str, Any]) -> Answer:
        return self._state()

    def _act_edit(self, asked: Mapping[str, Any]) -> Answer:
        fault = self.document.apply(asked["edit"])
        return self._refused(fault) if fault else self._changed()

    def _act_undo(self, asked: Mapping[str, Any]) -> Answer:
        self.document.undo()
        return self._changed()

    def _act_redo(self, asked: Mapping[str, Any]) -> Answer:
        self.document.redo()
        return self._changed()

    def _act_save(self, asked: Mapping[str, Any]) -> Answer:
        own, force = self.document.file, asked.get("force") is True
        if not (asked.get("file") or own):
            raise ModelError("the model has no file yet: give it a name, such as linkage.toml")
        file = self._inside(asked.get("file") or own, ".toml")
        if file != own and file.exists() and not force:
            raise ModelError(f"there is a file '{file.name}' already: choose another name")
        if (fault := self.document.save(file, force=force)) is not None:
            return self._refused(fault)
        self._keep_views()
        return self._changed() | {"saved": True}

    def _act_open(self, asked: Mapping[str, Any]) -> Answer:
        if not self.document.saved and asked.get("force") is not True:
            raise ModelError("there are unsaved edits: save them first, or leave them")
        if asked.get("file"):
            file = self._inside(asked["file"], ".toml")
            if not file.is_file():
                raise ModelError(f"there is no file '{file.name}'")
            self._take(Document.open(file))
        elif asked.get("gallery"):
            self._take_gallery(str(asked["gallery"]))
        elif asked.get("import"):
            self._import(self._inside(asked["import"]))
        else:
            from mbody.teaching.exercises import new_model

            kind = str(asked.get("new") or "")
            self._take(Document(new_model(kind) if kind else EMPTY, kind or "model"))
        return self._changed()

    def _begin(self, model: str) -> None:
        """Open a model file, one that is to be, or a model of the gallery."""
        from mbody.gallery import names

        if model in names() and not (self.folder / model).exists():
            self._take_gallery(model)
        else:
            self._take(Document.open(self._inside(model, ".toml"), EMPTY))

    def _take_gallery(self, name: str) -> None:
        from mbody.gallery import path

        file = path(name)
        self._take(Document(text_of(file), name, file.parent))
        self.gallery = name

    def _import(self, file: Path) -> None:
        from mbody.exchange import import_model
        from mbody.files.model import to_toml

        made = import_model(file)
        self._take(Document(to_toml(made.mechanism), file.stem))
        self.notes = list(made.notes)

    def _take(self, document: Document) -> None:
        self.past = self.revision + 1 - document.revision
        self.document.leave()
        self.document, self.notes, self.gallery = document, [], ""
        self.views, self.recovered = read_views(document.file), document.journal
        if self.recovered and (fault := document.recover()) is not None:
            self.notes = [fault.sentence]
        self.recovered &= not document.saved

    def _named(self, file: Path) -> str:
        return file.relative_to(self.folder).as_posix()

    def _inside(self, name: object, end: str = "") -> Path:
        """A file below the folder, links resolved."""
        try:
            whole = (self.folder / str(name)).resolve()
            inside = whole.is_relative_to(self.folder) and whole != self.folder
        except (OSError, ValueError, RuntimeError):
            inside = False
        if not inside:
            raise ModelError(
                f"{brief(str(name))} is not below '{self.folder.name}', the folder in which mbody "
                "edit was started: name a file there"
            )
        if end and (whole.suffix.lower() != end or whole.name.endswith(VIEWS)):
            raise ModelError(f"{brief(whole.name)} is no model file: its name must end in {end}")
        return whole

    # -- dragging ------------------------------------------------------------------------------

    def _act_drag(self, asked: Mapping[str, Any]) -> Answer:
        one, drag, reached = asked["drag"], self._dragging(), None
        if one["do"] == "move":
            drag.move(str(one["body"]), _pair(one["at"]), _pair(one["to"]))
        elif one["do"] == "number":
            drag.number(*number_of(self.document, self.rows, one["path"], float(one["value"])))
        else:
            place, to = str(one["place"]), _pair(one["to"])
            group = group_of(self.document.groups(), place)
            to = self.document.state.along(place, to) if one.get("along") else to
            drag.point(group, to, self.document.handles(group))
            reached = drag.now.place(place)
        return self._dragged(drag, reached)

    def _dragging(self) -> Dragging:
        """The document at home, or as it has been dragged since its last edit."""
        if self.dragging is None:
            self.dragging = Dragging(self.document.state)
        return self.dragging

    def _dragged(self, drag: Dragging, reached: Any = None) -> Answer:
        """Shapes take longer than all else: they get a part of the time, poses every frame."""
        began = time.monotonic()
        before = self.scene if began >= self.due else None
        found = drag_state(drag, self.unit, before, self.motions)
        if before is not None:
            now = time.monotonic()
            self.due = now + PAUSE * (now - began)
        return {"rev": self.revision, "drag": found | {"reached": reached}}

    def _act_drop(self, asked: Mapping[str, Any]) -> Answer:
        self.dragging = None
        return {"rev": self.revision}

    def _act_home(self, asked: Mapping[str, Any]) -> Answer:
        self.dragging = None
        return self._dragged(self._dragging())

    def _act_drive(self, asked: Mapping[str, Any]) -> Answer:
        drag = self._dragging()
        turning = {one.name for one in drag.drawn.mechanism.drivers if one.angular}
        values = {str(name): float(value) for name, value in asked["values"].items()}
        drag.drive({n: math.radians(v) if n in turning else v for n, v in values.items()})
        return self._dragged(drag)

    def _act_modes(self, asked: Mapping[str, Any]) -> Answer:
        return {"rev": self.revision, **modes_of(self.document.state)}

    def _act_forms(self, asked: Mapping[str, Any]) -> Answer:
        from mbody.edit.places import element_forms

        units, radians = self.document.state.mechanism.units, self.document.tree.get("angle")
        return {"rev": self.revision, "forms": element_forms(units, str(radians or "deg"))}

    # -- files, exports ------------------------------------------------------------------------

    def _act_files(self, asked: Mapping[str, Any]) -> Answer:
        from mbody.teaching.exercises import KINDS

        every = itertools.islice(self.folder.rglob("*"), LOOKED)
        names = sorted(name for name in map(self._named, every) if not HIDDEN.search(name))
        found: Answer = {"rev": self.revision, "folder": self.folder.name, "new": list(KINDS)}
        for key, ends in ENDS.items():
            found[key] = [name for name in names if name.lower().endswith(ends)][:LISTED]
        return found | {"gallery": gallery_titles()}

    def _act_job(self, asked: Mapping[str, Any]) -> Answer:
        if "id" in asked:
            return {"rev": self.revision, **self.jobs.report(str(asked["id"]))}
        if not self.document.saved:
            raise ModelError("the command reads the file: save the edits first")
        file = self._inside(asked["file"]) if asked.get("file") else None
        force = asked.get("force") is True
        made = self.jobs.start(str(asked["do"]), self.document, self.word, file, force=force)
        return {"rev": self.revision, "job": made}

    # -- views of the board --------------------------------------------------------------------

    def _act_underlay(self, asked: Mapping[str, Any]) -> Answer:
        self.views.pop("underlay", None)
        if asked["set"] is not None:
            view = checked_view("underlay", asked["set"])
            file = self._inside(view["file"])
            picture_of(file)
            self.views["underlay"] = view | {"file": self._named(file)}
        self._keep_views()
        return self._state()

    def _act_camera(self, asked: Mapping[str, Any]) -> Answer:
        self.views["camera"] = checked_view("camera", asked["set"])
        self._keep_views()
        return {"rev": self.revision}

    def _keep_views(self) -> None:
        file = self.document.file
        if file is not None and file.exists():
            write_whole(views_file(file), toml(self.views).encode())

    def picture(self) -> tuple[bytes, str] | None:
        """The picture below the drawing, and its type."""
        try:
            return picture_of(self._inside(self.views["underlay"]["file"]))
        except (ModelError, OSError, KeyError):
            return None

    # -- waiting -------------------------------------------------------------------------------

    def _act_wait(self, asked: Mapping[str, Any]) -> Answer:
        """Held until there is another revision: of an edit elsewhere, or of the file."""
        end = time.monotonic() + HELD
        while asked["rev"] == self.revision and time.monotonic() < end:
            if self.document.follow():
                self._changed()
                break
            self.lock.wait(LOOK_EVERY)
        new = asked["rev"] != self.revision
        return {"rev": self.revision, **({"changed": True} if new else {})}

    def close(self) -> None:
        """Wait until nothing is half done; exports that are under way end."""
        self.jobs.close()
        with self.lock:
            self.document.close()
            self.lock.notify_all()


def _pair(values: Any) -> tuple[float, float]:
    x, y = map(float, values)
    if not math.isfinite(x + y):
        raise ValueError("a place has two finite numbers")
    return x, y


@functools.cache
def gallery_titles() -> list[dict[str, str]]:
    """The models of the gallery with their titles."""
    from mbody.gallery import names, path

    def title(name: str) -> str:
        return str(tomllib.loads(path(name).read_text("utf-8")).get("name", name))

    return [{"name": name, "title": title(name)} for name in names()]


# -- The server of the drawing board: one page, for this machine alone, with the session behind
#    it ----------------------------------------------------------------------------------------
#
# A request is answered only if it has the token of the address, comes from the page itself and
# names this server: another page in the same browser, another machine and another name of this one
# are refused. No path of a request reaches the disk.

#: Bytes of a request, and seconds without a page after which the server ends.
MOST, ALONE = 6_000_000, 60.0
#: Seconds between two looks at whether to end, and those that an idle connection stays open.
LOOK, IDLE = 0.25, 90
TYPES = {
    ".mjs": "text/javascript; charset=utf-8",
    ".css": "text/css; charset=utf-8",
    ".html": "text/html; charset=utf-8",
    ".svg": "image/svg+xml",
}
HEADERS = {
    "Content-Security-Policy": "default-src 'none'; script-src 'self'; "
    "style-src 'self' 'unsafe-inline'; connect-src 'self'; img-src 'self' data: blob:; "
    "frame-ancestors 'none'; base-uri 'none'; form-action 'none'",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Referrer-Policy": "no-referrer",
    "X-Content-Type-Options": "nosniff",
    "Cache-Control": "no-store",
}


def page_files() -> dict[str, Path]:
    """The only files that are served, by their names in addresses."""
    page = Path(str(resources.files("mbody.edit"))) / "page"
    viewer = Path(str(resources.files("mbody.views"))) / "viewer"
    found = {file.name: file for file in page.glob("*") if file.suffix in TYPES}
    found |= {f"viewer/{file.name}": file for file in viewer.glob("*") if file.suffix in TYPES}
    return found | {"": page / "board.html"}


class BoardHandler(BaseHTTPRequestHandler):
    """Answers one connection."""

    protocol_version = "HTTP/1.1"
    server: BoardServer
    disable_nagle_algorithm = True
    wbufsize = -1
    timeout = IDLE
    name = ""

    def do_GET(self) -> None:
        """A file of the page, or the picture below the drawing."""
        if not self._allowed():
            return self._send(403)
        if self.name == "underlay":
            picture = self.server.session.picture()
            return self._send(200, *picture) if picture else self._send(404)
        file = self.server.files.get(self.name)
        if file is None or not file.is_file():
            return self._send(404)
        self._send(200, file.read_bytes(), TYPES[file.suffix])

    def do_POST(self) -> None:
        """An act of the protocol."""
        if not self._allowed():
            return self._send(403)
        size = self.headers.get("Content-Length", "")
        if self.name != "act":
            return self._send(404)
        if self.headers.get_content_type() != "application/json":
            return self._send(415)
        if not (size.isascii() and size.isdigit()) or self.headers.get("Transfer-Encoding"):
            return self._send(411)
        if len(size) > 8 or int(size) > MOST:
            return self._send(413)
        try:
            asked = json.loads(self.rfile.read(int(size)).decode("utf-8"))
            json.dumps(asked, ensure_ascii=False, allow_nan=False).encode("utf-8")
        except (ValueError, RecursionError):
            return self._send(400)
        if not isinstance(asked, dict):
            return self._send(400)
        status, answer = self.server.answer(asked)
        text = json.dumps(answer, ensure_ascii=False, allow_nan=False, separators=(",", ":"))
        self._send(status, text.encode("utf-8", "replace"), "application/json")

    def _allowed(self) -> bool:
        """Whether a request has the token and comes from the page; sets the name below the token.

        A page's own requests have the site "same-origin"; only the page itself may be opened from
        outside, by its address. Browsers that do not say the site say the origin.
        """
        address, own = self.path.partition("?")[0], self.server.own_hosts
        token, slash, name = address.removeprefix("/").partition("/")
        self.name = name if slash else "/"
        right = hmac.compare_digest(token.encode(), self.server.token.encode())
        host, origin = self.headers.get_all("Host", []), self.headers.get_all("Origin", [])
        reading, site = self.command == "GET", self.headers.get("Sec-Fetch-Site")
        from_page = site == "same-origin" or (site == "none" and reading and not self.name)
        from_page = from_page or (site is None and (reading or bool(origin)))
        known = len(host) == 1 and host[0].lower() in own
        return (
            right and known and from_page and all(o in {f"http://{h}" for h in own} for o in origin)
        )

    def send_error(self, code: int, message: str | None = None, explain: str | None = None) -> None:
        """What is no request is refused like the rest, without words."""
        self._send(code)

    def _send(self, status: int, body: bytes = b"", kind: str = "text/plain") -> None:
        """An answer in one write; what is refused closes the connection."""
        more = {"Content-Type": kind}
        if status >= 400 and status != 409:
            self.close_connection, more = True, more | {"Connection": "close"}
        self.send_response_only(status)
        for key, value in {**HEADERS, **more, "Content-Length": str(len(body))}.items():
            self.send_header(key, value)
        self.end_headers()
        self.wfile.write(body)
        self.wfile.flush()

    def log_message(self, *parts: object) -> None:
        """Nothing: addresses have the token."""


class BoardServer(ThreadingHTTPServer):
    """Serves a session on this machine alone, until its page has gone or it is told to end."""

    daemon_threads, request_queue_size = True, 128

    def __init__(self, session: BoardSession, port: int = 0) -> None:
        super().__init__(("127.0.0.1", port), BoardHandler)
        self.session, self.token = session, secrets.token_urlsafe(18)
        self.files = page_files()
        self.own_hosts = {f"{name}:{self.server_port}" for name in ("127.0.0.1", "localhost")}
        self.timeout, self.active, self.last = LOOK, 0, 0.0
        self._counting = threading.Lock()

    @property
    def address(self) -> str:
        """The address of the page."""
        return f"http://127.0.0.1:{self.server_port}/{self.token}/"

    def answer(self, asked: dict[str, Any]) -> tuple[int, dict[str, Any]]:
        """That of the session; meanwhile there is a page."""
        with self._counting:
            self.active += 1
        try:
            return self.session.answer(asked)
        finally:
            with self._counting:
                self.active, self.last = self.active - 1, time.monotonic()

    def serve(self, mark: Callable[[], None], *, keep: bool = False) -> None:
        """Answer until a minute after the page has gone; `mark` is called again and again and may
        end it by an exception. Nothing is left half done.
        """
        try:
            while keep or not self.last or self.active or time.monotonic() - self.last < ALONE:
                self.handle_request()
                mark()
        finally:
            self.server_close()
            self.session.close()

    def handle_error(self, request: Any, client_address: Any) -> None:
        """A connection that broke is no matter."""
