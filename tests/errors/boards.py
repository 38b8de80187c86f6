"""The drawing board: files, pictures, drags and exports that it refuses."""

import tempfile
from pathlib import Path

from mbody.cli import command
from mbody.edit.session import BoardSession
from mbody.errors import ModelError

LOOSE = "[bodies.link1]\npoints = { A = [0, 0], B = [30, 0] }\n"
VIEW = {"x": 0, "y": 0, "width": 1, "angle": 0, "opacity": 1}


LONG = f"{'x' * 245}.toml"


def refused(*requests, text=LOOSE, beside=()):
    """The sentence of the last request, in a folder with one model; `beside`: requests of another
    board on it.
    """

    def scenario():
        with tempfile.TemporaryDirectory() as name:
            folder = Path(name) / "drawings"
            folder.mkdir()
            for file in ("link.toml", LONG):
                (folder / file).write_text(text)
            (folder / "note.dxf").write_text("none")
            with (folder / "scan.png").open("wb") as picture:
                picture.truncate(31_000_000)
            other = BoardSession(folder, "link.toml")
            session = BoardSession(folder, "link.toml")
            for board, asked in ((other, beside), (session, requests)):
                for request in asked:
                    _, answer = board.answer(request)
            session.close()
            other.close()
            raise ModelError(answer["fault"]["sentence"])

    return scenario


def at_the_command(*words):
    return lambda: command._run(["edit", "--no-open", *words])


EDIT = {"act": "edit", "edit": {"do": "mass", "body": "link1", "mass": "2 kg"}}
SCENARIOS = {
    "a drawing without a name": refused({"act": "open", "new": ""}, {"act": "save"}),
    "a name that is given": refused(
        {"act": "save", "file": "other.toml"}, {"act": "save", "file": "link.toml"}
    ),
    "a drawing that is not there": refused({"act": "open", "file": "none.toml"}),
    "edits that are not saved": refused(EDIT, {"act": "open", "new": "cam"}),
    "a file of another folder": refused({"act": "save", "file": "../out.toml"}),
    "a drawing of another end": refused({"act": "save", "file": "out.txt"}),
    "a point that is not there": refused(
        {"act": "drag", "drag": {"do": "point", "place": "link1.X", "to": [0, 0]}}
    ),
    "a drag on empty paper": refused({"act": "open", "new": ""}, {"act": "home"}),
    "a number that is none": refused(
        {"act": "drag", "drag": {"do": "number", "path": ["bodies", "link1", "name"], "value": 1}}
    ),
    "a picture that is none": refused({"act": "underlay", "set": {"file": "link.toml", **VIEW}}),
    "a picture too large": refused({"act": "underlay", "set": {"file": "scan.png", **VIEW}}),
    "an edit in two boards": refused(EDIT, beside=[EDIT]),
    "an edit without a journal": refused({"act": "open", "file": LONG}, EDIT),
    "a drawing without lines": refused({"act": "underlay", "set": {"file": "note.dxf", **VIEW}}),
    "no such export": refused({"act": "job", "do": "print"}),
    "an export of what is not saved": refused(EDIT, {"act": "job", "do": "report"}),
    "an export of no file": refused({"act": "open", "new": ""}, {"act": "job", "do": "csv"}),
    "an export of another end": refused({"act": "job", "do": "csv", "file": "link.toml"}),
    "an export over another": refused({"act": "job", "do": "dxf", "file": "note.dxf"}),
    "results of what is loose": refused({"act": "job", "do": "csv"}),
    "an export that is forgotten": refused({"act": "job", "id": "x"}),
    "a port beyond all": at_the_command("--port", "70000"),
}
SENTENCES = """
a drawing without a name | ModelError | - | the model has no file yet: give it a name, such as linkage.toml
a name that is given | ModelError | - | there is a file 'link.toml' already: choose another name
a drawing that is not there | ModelError | - | there is no file 'none.toml'
edits that are not saved | ModelError | - | there are unsaved edits: save them first, or leave them
a file of another folder | ModelError | - | '../out.toml' is not below 'drawings', the folder in which mbody edit was started: name a file there
a drawing of another end | ModelError | - | 'out.txt' is no model file: its name must end in .toml
a point that is not there | ModelError | - | there is no point 'link1.X'
a drag on empty paper | ModelError | - | there is nothing to drag yet: draw a link first
a number that is none | ModelError | - | 'link1.name' is no number that can be dragged: type another value
a picture that is none | ModelError | - | 'link.toml' is no picture: give one in PNG or JPEG, or a DXF
a picture too large | ModelError | - | 'scan.png' is no picture of at most 30 MB: make it smaller
an edit in two boards | ModelError | - | 'link.toml' has unsaved edits in another board: save them there, then they are here as well
an edit without a journal | ModelError | - | the journal 'xxxxx…' cannot be written (File name too long): free space or save elsewhere; the edit is not made
a drawing without lines | ModelError | - | 'note.dxf' has no lines that could be drawn: save it as DXF R12
no such export | ModelError | - | the board exports no 'print': it exports report, page, drawing, freebody, film, dxf, fmu, csv, xlsx
an export of what is not saved | ModelError | - | the command reads the file: save the edits first
an export of no file | ModelError | - | the command reads a file, which the model has not yet: save it first
an export of another end | ModelError | - | 'link.toml' must end in .csv
an export over another | ModelError | - | there is a file 'note.dxf' already: choose another name
results of what is loose | ModelError | - | there are no results yet to write: drive all that is free
an export that is forgotten | ModelError | - | there is no such export: the board was started anew, begin it again
a port beyond all | UsageError | - | port 70000 cannot be listened on (ports end at 65535): leave --port out
"""
