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
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from mbody.edit.board_state import board_state, drag_state, modes_of, number_of
from mbody.edit.board_views import VIEWS, checked_view, picture_of, read_views, views_file
from mbody.edit.document import Document
from mbody.edit.dragging import Dragging
from mbody.edit.jobs import ExportJobs, as_word, command_of
from mbody.errors import ModelError, SolveError, at_the_command, brief
from mbody.files.model.toml_text import toml
from mbody.files.writing import writing

Answer = dict[str, Any]

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


class BoardSession:
    """A document with everything around it.

    `folder`: That in which the command was started; no file is read or written outside of it.
    `file`: Of the document; None of what was never saved.
    `word`: What the command calls the model, such as a name of the gallery.
    `views`: What is kept of the board beside the model: its camera, the picture below it.
    """

    def __init__(self, folder: Path, model: str | None = None) -> None:
        self.folder, self.lock = folder.resolve(), threading.Condition()
        self.jobs, self.past = ExportJobs(self.folder), 0
        self.notes: list[str] = []
        self.unit = 0.3
        self.document = Document(EMPTY, "model")
        self.file: Path | None = None
        self.dragging: Dragging | None = None
        self.scene, self.rows, self.due = dict[str, Any](), list[Answer](), 0.0
        self.views: dict[str, Any] = {}
        self.word, self.recovered = "", False
        if model is not None:
            self._begin(model)

    @property
    def revision(self) -> int:
        """Of the document, and of those before it."""
        return self.past + int(self.document.revision)

    def answer(self, asked: Mapping[str, Any]) -> tuple[int, Answer]:
        """Status and answer of a request: 409 with the state where it is of an old revision."""
        act = str(asked.get("act"))
        method: Callable[[Mapping[str, Any]], Answer] | None = self._acts().get(act)
        if method is None:
            return 400, {"rev": self.revision}
        with self.lock, at_the_command():
            try:
                unit = asked.get("unit")
                if isinstance(unit, (int, float)) and 0.0 < unit < math.inf:
                    self.unit = float(unit)
                old = asked.get("rev", self.revision) != self.revision
                if old and act in ("edit", "undo", "redo", "save", "open", "drag", "underlay"):
                    return 409, self._state()
                return 200, method(asked)
            except (ModelError, SolveError) as error:
                return 200, self._refused(str(error), error.element or "")
            except OSError as error:
                return 200, self._refused(f"this file cannot be used: {error.strerror}")
            except Exception as error:  # a request may have any keys, of any kinds
                why = f"{type(error).__name__}: {error}"
                print(f"mbody: the board could not do {brief(act)} ({why})", file=sys.stderr)
                return 400, self._refused(f"this request is not understood ({why})")

    def _acts(self) -> dict[str, Any]:
        names = "look edit undo redo save open drag drop home drive modes files job underlay camera"
        return {name: getattr(self, f"_{name}") for name in (*names.split(), "wait")}

    def _state(self, **more: Any) -> Answer:
        state = board_state(self.document, self.unit)
        self.scene, self.rows = state["scene"], state["rows"]
        state |= {
            "journal": self.recovered,
            "rev": self.revision,
            "file": self._named(),
            "views": self.views,
        }
        state["command"] = command_of(self.document, self.word)
        said = [*self.notes, *([self.document.remark] if self.document.remark else [])]
        if not self.document.saved and self.document.changed_on_disk():
            said.append(f"'{self._named()}' has changed on disk since it was read")
        notes = [{"element": "", "key": "", "text": text, "kind": "note"} for text in said]
        state["messages"] += notes
        return state | more

    def _refused(self, sentence: str, element: str = "", **more: Any) -> Answer:
        fault = {"sentence": sentence, "element": element, "path": [], "problems": []}
        return {"rev": self.revision, "fault": fault, **more}

    def _named(self) -> str:
        return "" if self.file is None else self.file.relative_to(self.folder).as_posix()

    # -- the document --------------------------------------------------------------------------

    def _changed(self) -> Answer:
        self.dragging = None
        self.lock.notify_all()
        return self._state()

    def _look(self, asked: Mapping[str, Any]) -> Answer:
        return self._state()

    def _edit(self, asked: Mapping[str, Any]) -> Answer:
        fault = self.document.apply(asked["edit"])
        if fault is not None:
            return {"rev": self.revision, "fault": fault.data()}
        return self._changed()

    def _undo(self, asked: Mapping[str, Any]) -> Answer:
        self.document.undo()
        return self._changed()

    def _redo(self, asked: Mapping[str, Any]) -> Answer:
        self.document.redo()
        return self._changed()

    def _save(self, asked: Mapping[str, Any]) -> Answer:
        file = self._inside(asked["file"], ".toml") if asked.get("file") else self.file
        if file is None:
            raise ModelError("the model has no file yet: give it a name, such as linkage.toml")
        force = asked.get("force") is True
        if file != self.file and file.exists() and not force:
            return self._refused(f"there is a file '{file.name}' already: choose another name")
        fault = self.document.save(file, force=force)
        if fault is not None:
            return {"rev": self.revision, "fault": fault.data(), "conflict": fault.conflict}
        self.file, self.word = file, as_word(self._name_of(file))
        self._keep_views()
        return self._changed() | {"saved": True}

    def _open(self, asked: Mapping[str, Any]) -> Answer:
        if not self.document.saved and asked.get("force") is not True:
            return self._refused("there are unsaved edits: save them first, or leave them")
        if asked.get("file"):
            file = self._inside(asked["file"], ".toml")
            if not file.is_file():
                raise ModelError(f"there is no file '{file.name}'")
            self._begin(str(file))
        elif asked.get("gallery"):
            name = str(asked["gallery"])
            self._take(Document(*gallery_text(name)), word=name)
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
            self._take(Document(*gallery_text(model)), word=model)
            return
        file = self._inside(model, ".toml")
        self._take(Document.open(file, EMPTY), file)

    def _import(self, file: Path) -> None:
        from mbody.exchange import import_model
        from mbody.files.model import to_toml

        made = import_model(file)
        self._take(Document(to_toml(made.mechanism), file.stem))
        self.notes = list(made.notes)

    def _take(self, document: Document, file: Path | None = None, word: str = "") -> None:
        self.past = self.revision + 1
        self.document.leave()
        if file is not None and file == self.file:
            document.forget()
        self.document, self.file, self.notes = document, file, []
        self.word = word if file is None else as_word(self._name_of(file))
        self.past -= int(document.revision)
        self.views = read_views(file)
        self.recovered = document.journal
        if self.recovered and (fault := document.recover()) is not None:
            self.recovered = False
            self.notes.append(fault.sentence)

    def _name_of(self, file: Path) -> str:
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

    def _drag(self, asked: Mapping[str, Any]) -> Answer:
        one, drag, reached = asked["drag"], self._dragging(), None
        if one["do"] == "move":
            drag.move(str(one["body"]), _pair(one["at"]), _pair(one["to"]))
        elif one["do"] == "number":
            drag.number(*number_of(self.document, self.rows, one["path"], float(one["value"])))
        else:
            group = next((g for g in self.document.groups() if one["place"] in g), None)
            if group is None:
                raise ModelError(f"there is no point {brief(one['place'])}")
            drag.point(group, _pair(one["to"]), self.document.handles(group))
            reached = drag.place(one["place"]).tolist()
        return self._dragged(drag, reached)

    def _dragging(self) -> Dragging:
        """The document at home, or as it has been dragged since its last edit."""
        if self.dragging is None:
            state = self.document.state
            if state.system is None or state.run is None or state.mobility is None:
                raise ModelError("there is nothing to drag yet: draw a link first")
            self.dragging = Dragging(state.system, state.run, state.mobility)
        return self.dragging

    def _dragged(self, drag: Dragging, reached: Any = None) -> Answer:
        """Shapes take longer than all else: they get a part of the time, poses every frame."""
        began = time.monotonic()
        before = self.scene if began >= self.due else None
        found = drag_state(drag, self.unit, before)
        if before is not None:
            now = time.monotonic()
            self.due = now + PAUSE * (now - began)
        return {"rev": self.revision, "drag": found | {"reached": reached}}

    def _drop(self, asked: Mapping[str, Any]) -> Answer:
        self.dragging = None
        return {"rev": self.revision}

    def _home(self, asked: Mapping[str, Any]) -> Answer:
        self.dragging = None
        return self._dragged(self._dragging())

    def _drive(self, asked: Mapping[str, Any]) -> Answer:
        drag = self._dragging()
        turning = {driver.name for driver in drag.machine.drivers if driver.angular}
        values = {str(name): float(value) for name, value in asked["values"].items()}
        drag.drive({n: math.radians(v) if n in turning else v for n, v in values.items()})
        return self._dragged(drag)

    def _modes(self, asked: Mapping[str, Any]) -> Answer:
        return {"rev": self.revision, **modes_of(self.document.state)}

    # -- files, exports ------------------------------------------------------------------------

    def _files(self, asked: Mapping[str, Any]) -> Answer:
        from mbody.teaching.new_model import KINDS

        every = itertools.islice(self.folder.rglob("*"), LOOKED)
        names = sorted(file.relative_to(self.folder).as_posix() for file in every)
        names = [name for name in names if not re.search(r"(^|/)\.", name)]
        found: Answer = {"rev": self.revision, "folder": self.folder.name, "new": list(KINDS)}
        for key, ends in ENDS.items():
            own = (name for name in names if name.lower().endswith(ends))
            found[key] = [name for name in own if not name.endswith(VIEWS)][:LISTED]
        return found | {"gallery": gallery_titles()}

    def _job(self, asked: Mapping[str, Any]) -> Answer:
        if "id" in asked:
            return {"rev": self.revision, **self.jobs.report(str(asked["id"]))}
        if not self.document.saved:
            return self._refused("the command reads the file: save the edits first")
        name = asked.get("file")
        file = self._inside(name) if name else None
        force = asked.get("force") is True
        made = self.jobs.start(str(asked["do"]), self.document, self.word, file, force=force)
        return {"rev": self.revision, "job": made}

    # -- views of the board --------------------------------------------------------------------

    def _underlay(self, asked: Mapping[str, Any]) -> Answer:
        if asked["set"] is None:
            self.views.pop("underlay", None)
        else:
            view = checked_view("underlay", asked["set"])
            file = self._inside(view["file"])
            picture_of(file)
            self.views["underlay"] = view | {"file": self._name_of(file)}
        self._keep_views()
        return self._state()

    def _camera(self, asked: Mapping[str, Any]) -> Answer:
        self.views["camera"] = checked_view("camera", asked["set"])
        self._keep_views()
        return {"rev": self.revision}

    def _keep_views(self) -> None:
        if self.file is not None and self.file.exists():
            with writing(views_file(self.file)) as stream:
                stream.write(toml(self.views))

    def picture(self) -> tuple[bytes, str] | None:
        """The picture below the drawing, and its type."""
        try:
            return picture_of(self._inside(self.views["underlay"]["file"]))
        except (ModelError, OSError, KeyError):
            return None

    # -- waiting -------------------------------------------------------------------------------

    def _wait(self, asked: Mapping[str, Any]) -> Answer:
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
            self.lock.notify_all()


def _pair(values: Any) -> tuple[float, float]:
    x, y = map(float, values)
    if not math.isfinite(x + y):
        raise ValueError("a place has two finite numbers")
    return x, y


def gallery_text(name: str) -> tuple[str, str, Path]:
    """Text, name and folder of a model of the gallery."""
    from mbody.files.model.read import text_of
    from mbody.gallery import path

    file = path(name)
    return text_of(file), name, file.parent


@functools.cache
def gallery_titles() -> list[dict[str, str]]:
    """The models of the gallery with their titles."""
    from mbody.gallery import names, path

    def title(name: str) -> str:
        return str(tomllib.loads(path(name).read_text("utf-8")).get("name", name))

    return [{"name": name, "title": title(name)} for name in names()]
