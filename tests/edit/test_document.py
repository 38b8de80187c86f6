"""The document of the drawing board: its history, its file, its journal."""

import json
import os
import random
import subprocess
import sys
import time

import pytest

import mbody
from mbody.edit.document import Document

LINK = {"do": "link", "at": [{"xy": [0, 0]}, {"xy": [20, 35]}], "what": "link drawn"}
START = '# mine\r\nunits = "mm-N-s"  # kept\r\n'


@pytest.fixture
def board(tmp_path):
    """A document of a file with three edits that are not saved."""
    file = tmp_path / "drawing.toml"
    file.write_bytes(START.encode())
    document = Document.open(file)
    for edit in (LINK, {"do": "ground", "place": "link1.A"}, {"do": "motor", "body": "link1"}):
        assert document.apply(edit) is None
    yield document
    document.close()


def test_half_drawn_is_an_ordinary_state():
    board = Document()
    assert board.fault is None and board.state.system is None and board.groups() == []
    assert board.apply({"do": "point", "body": "ground", "xy": [1, 2]}) is None
    assert board.state.place("ground.A") == (1, 2) and board.groups() == [["ground.A"]]
    assert board.apply({"do": "move", "place": "ground.A", "xy": [3, 4]}) is None
    assert board.state.place("ground.A") == (3, 4)
    assert board.apply(LINK) is None and board.state.mobility.freedom == 3
    assert board.apply({"do": "motor", "body": "link1"}) is None  # without a joint
    assert board.state.mobility.freedom == 2 and board.state.turn is None
    assert board.apply({"do": "motor", "body": "link1", "name": "second"}) is None
    assert board.state.mobility.driven.redundant == 1


def test_saved_and_opened_again(board, tmp_path):
    file = tmp_path / "drawing.toml"
    assert not board.saved and file.read_bytes() == START.encode()
    assert board.save() is None and board.saved
    assert file.read_bytes() == board.text.encode() and board.text.count(
        "\r\n"
    ) == board.text.count("\n")
    assert not (tmp_path / "drawing.toml.journal").exists()
    assert mbody.load(file)["link1"].points["B"] == (20.0, 35.0)
    os.chmod(file, 0o640)
    file.write_bytes(b"\xef\xbb\xbf" + board.text.encode())  # with the mark of an editor
    again = Document.open(file)
    assert again.apply({"do": "units", "units": "SI"}) is None and again.undo() and again.saved
    again.apply({"do": "torque", "body": "link1", "torque": "1 N*m"})
    assert again.save() is None
    assert file.read_bytes() == b"\xef\xbb\xbf" + again.text.encode()
    assert file.stat().st_mode & 0o777 == 0o640 and len([*tmp_path.iterdir()]) == 1


def test_a_file_that_is_edited_elsewhere(board, tmp_path):
    file = tmp_path / "drawing.toml"
    assert not board.changed_on_disk() and not board.follow()
    file.write_text("# elsewhere\n")
    assert board.changed_on_disk() and not board.follow()  # unsaved edits are not lost
    fault = board.save()
    assert fault.conflict and file.read_text() == "# elsewhere\n"
    assert board.save(tmp_path / "other.toml") is None and file.read_text() == "# elsewhere\n"
    (tmp_path / "other.toml").write_text(board.text + "# more\n")
    assert board.follow() and board.text.endswith("# more\n") and board.saved
    assert board.undo() == "changed elsewhere" and not board.saved
    (tmp_path / "other.toml").write_text("# theirs\n")
    assert board.save().conflict and board.save(force=True) is None and board.saved


def test_the_journal_of_a_crash_is_taken_up(board, tmp_path):
    board.undo()
    board.apply({"do": "torque", "body": "link1", "torque": "1 N*m", "what": "torque"})
    again = Document.open(tmp_path / "drawing.toml")  # of the next start
    assert again.journal and again.text == START
    with (tmp_path / "drawing.toml.journal").open("a") as stream:
        stream.write('{"step": {"what": "cut by the cra')
    assert "in another board" in again.recover().sentence and again.text == START
    board.close()
    assert again.recover() is None and again.text == board.text and not again.journal
    assert again.state.mobility.freedom == 1
    assert again.undo() == "torque" and again.undo() == "ground"
    assert again.redo() == "ground" and again.undo() and again.undo() and again.text == START
    again.close()
    third = Document.open(tmp_path / "drawing.toml")  # its own entries were appended to the journal
    assert third.recover() is None and third.text == START and len(third.undone) == 3


def test_two_boards_on_one_file(board, tmp_path):
    """One at a time has unsaved edits, and nothing of the other is lost."""
    file = tmp_path / "drawing.toml"
    other = Document.open(file)
    journal = (tmp_path / "drawing.toml.journal").read_bytes()
    assert "in another board" in other.apply(LINK).sentence
    assert other.save(force=True) is None and other.text == START and other.done == []
    assert (tmp_path / "drawing.toml.journal").read_bytes() == journal
    assert board.save() is None and other.follow() and other.text == board.text
    assert other.apply(LINK) is None and "in another board" in board.apply(LINK).sentence


def test_a_journal_that_nobody_asked_for_is_kept(board, tmp_path):
    mine = board.text
    for name in ("drawing.toml.journal.old", "drawing.toml.journal.old1"):
        board.close()
        board = Document.open(tmp_path / "drawing.toml")
        assert board.apply(LINK) is None
        assert (tmp_path / name).exists() and not board.journal
    board.close()
    (tmp_path / "drawing.toml.journal.old").replace(tmp_path / "drawing.toml.journal")
    again = Document.open(tmp_path / "drawing.toml")
    assert again.recover() is None and again.text == mine


def test_what_was_saved_and_then_taken_back_is_in_the_journal(board, tmp_path):
    assert board.save() is None and board.undo() == "motor" and board.undo() == "ground"
    assert board.redo() == "ground" and board.apply(LINK) is None
    board.close()
    again = Document.open(tmp_path / "drawing.toml")
    assert again.recover() is None and again.text == board.text
    assert again.undo() == "link drawn"


def test_a_crash_right_after_the_file_was_written(board, tmp_path, monkeypatch):
    monkeypatch.setattr(Document, "leave", lambda own: None)
    assert board.save() is None
    board.close()
    monkeypatch.undo()
    again = Document.open(tmp_path / "drawing.toml")
    assert again.recover() is None and again.text == board.text and again.saved
    assert not again.done and not again.journal


def test_a_full_disk_refuses_and_keeps(board, tmp_path, monkeypatch):
    text, journal = board.text, (tmp_path / "drawing.toml.journal").read_bytes()

    class Full:
        """A file that takes half of what is written."""

        def __init__(self, file):
            self.file = file

        def __getattr__(self, name):
            return getattr(self.file, name)

        def write(self, content):
            return self.file.write(content[: len(content) // 2])

    stream = vars(board)["_journal"]
    vars(board)["_journal"] = Full(stream)
    assert "No space left" in board.apply(LINK).sentence and board.text == text
    with pytest.raises(mbody.ModelError, match="cannot be written"):
        board.undo()
    assert board.text == text and (tmp_path / "drawing.toml.journal").read_bytes() == journal
    vars(board)["_journal"] = stream
    assert board.undo() == "motor"
    board.close()
    again = Document.open(tmp_path / "drawing.toml")
    assert again.recover() is None and again.text == board.text


def test_files_that_cannot_be_written_are_said(board, tmp_path):
    file = tmp_path / "drawing.toml"
    file.chmod(0o444)
    assert "read-only" in board.save().sentence and file.read_bytes() == START.encode()
    file.unlink()
    assert "been deleted" in board.changed_on_disk() and not board.follow()
    assert board.save().conflict and not file.exists()
    file.mkdir()
    assert board.save().conflict
    assert "cannot be written" in board.save(force=True).sentence
    file.rmdir()
    (tmp_path / "drawing.toml.journal").unlink()  # the next edit begins another
    text = board.text
    assert board.apply(LINK) is None and board.save(force=True) is None
    assert file.read_bytes().decode() == board.text != text


@pytest.mark.parametrize(
    "spoil", ["stale", "text", "step", "kind", "undo", "binary", "start", "empty"]
)
def test_a_journal_that_does_not_fit_is_refused(board, tmp_path, spoil):
    file, journal = tmp_path / "drawing.toml", tmp_path / "drawing.toml.journal"
    board.close()
    lines = journal.read_text().split("\n")
    if spoil == "stale":
        file.write_bytes(START.encode() + b"# other\r\n")
    elif spoil == "binary":
        journal.write_bytes(b"\xff\xfe\x00\n")
    elif spoil == "empty":
        journal.write_text("")
    else:
        entry = {
            "text": '{"step": 3',
            "step": json.dumps({"step": {"what": "x", "at": 10**9, "old": "a", "new": "b"}}),
            "kind": "[1, 2]",
            "undo": '{"redo": true}',
            "start": json.dumps(json.loads(lines[0]) | {"start": "# mine"}),
        }[spoil]
        lines[0 if spoil == "start" else 2] = entry
        journal.write_text("\n".join(lines))
    again = Document.open(file)
    text = again.text
    fault = again.recover()
    assert "journal" in fault.sentence and again.text == text and again.journal
    assert again.done == [] and journal.exists()


def test_a_drawing_without_a_file_yet(tmp_path):
    board = Document.open(tmp_path / "new.toml", 'units = "mm-N-s"\n')
    assert board.apply(LINK) is None and not board.saved
    board.close()
    again = Document.open(tmp_path / "new.toml")
    assert again.recover() is None and again.text == board.text
    assert again.save() is None and mbody.load(tmp_path / "new.toml")["link1"]
    assert Document().save().sentence and Document().recover().sentence
    assert "cannot" in again.save(tmp_path / "none" / "x.toml").sentence


#: A board that edits, saves and takes back until it is killed, and says the text after each.
RESTLESS = """
import json, random, sys
from mbody.edit.document import Document
board, chance = Document.open("drawing.toml"), random.Random(int(sys.argv[1]))
assert not board.journal or board.recover() is None
print(json.dumps(board.text), flush=True)
while True:
    do = chance.choice(("undo", "redo", "save", "edit", "edit", "edit"))
    point = {"do": "point", "body": "ground", "xy": [chance.randint(0, 99), 0]}
    board.apply(point) if do == "edit" else getattr(board, do)()
    print(json.dumps(board.text), flush=True)
"""


@pytest.mark.slow
def test_nothing_is_lost_by_a_board_that_is_killed(tmp_path):
    chance, file = random.Random(9), tmp_path / "drawing.toml"
    file.write_bytes(START.encode())
    for n in range(5):
        command = [sys.executable, "-c", RESTLESS, str(n)]
        with subprocess.Popen(command, cwd=tmp_path, stdout=subprocess.PIPE) as board:
            first = board.stdout.readline()
            time.sleep(chance.uniform(0.0, 0.5))
            board.kill()
            said = (first + board.stdout.read()).decode().splitlines(keepends=True)
        *_, last = [json.loads(one) for one in said if one.endswith("\n")]
        again = Document.open(file)
        if again.journal:
            assert again.recover() is None
        now, expected = again.text.splitlines(), last.splitlines()
        lines = {*now} ^ {*expected}  # of what was under way, at most
        assert len(lines) <= 3, (now, expected)
        again.close()
