"""What is behind the page: one document, its file, its views and its exports, asked by one request
at a time.
"""

from __future__ import annotations

import functools
import itertools
import math
import re
import sys
import threading
import time
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from mbody.edit.board_state import board_state, drag_state, modes_of, number_of
from mbody.edit.board_views import VIEWS, checked_view, picture_of, read_views, views_file
from mbody.edit.document import Document, Fault
from mbody.edit.dragging import Dragging
from mbody.edit.jobs import ExportJobs, as_word, command_of
from mbody.edit.places import group_of
from mbody.errors import ModelError, SolveError, at_the_command, brief
from mbody.files.model.read import text_of
from mbody.files.model.toml_text import toml
from mbody.files.writing import write_whole

Answer = dict[str, Any]

#: Files that are not listed: hidden ones, views of boards.
HIDDEN = re.compile(rf"(^|/)\.|{re.escape(VIEWS)}$")
#: Seconds that `wait` is held, and between two looks at the file.
HELD, LOOK = 25.0, 0.4
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
            from mbody.teaching.new_model import new_model

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
        from mbody.edit.element_forms import element_forms

        units, radians = self.document.state.mechanism.units, self.document.tree.get("angle")
        return {"rev": self.revision, "forms": element_forms(units, str(radians or "deg"))}

    # -- files, exports ------------------------------------------------------------------------

    def _act_files(self, asked: Mapping[str, Any]) -> Answer:
        from mbody.teaching.new_model import KINDS

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
            self.lock.wait(LOOK)
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
