"""Files of a board: followed, in conflict, in journals; its doors, exports and pictures."""

import json
import os
import shlex
import struct
import subprocess
import sys
import threading
import time
import zipfile
import zlib

import pytest

import mbody
from mbody.edit.board_state import dxf_picture
from mbody.edit.session import EXPORTS, BoardSession
from tests.edit.test_board_server import FOURBAR, set_force
from tests.edit.test_board_server import served as served
from tests.exchange.test_exchange import FOUR_BAR

#: An edit of the force.
FORCE = {
    "act": "edit",
    "edit": {"do": "set", "path": ["loads", "F", "force"], "text": "9 N", "what": "F"},
}


def said(state):
    return [one["text"] for one in state["messages"]]


# -- the file from elsewhere ---------------------------------------------------------------------


def test_a_change_elsewhere_is_followed(served):
    rev, told = served.act("look")[1]["rev"], []
    waiting = threading.Thread(target=lambda: told.append(served.act("wait", rev=rev)[1]))
    waiting.start()
    changed = FOURBAR.replace("100 N", "55 N")
    (served.folder / "fourbar.toml").write_text(changed, "utf-8")
    waiting.join(10)
    assert told[0]["changed"] and told[0]["rev"] > rev
    state = served.act("look")[1]
    assert state["text"] == changed and state["saved"]
    assert served.act("undo")[1]["text"] == FOURBAR


def test_a_conflict_is_said_and_nothing_is_lost(served):
    file = served.folder / "fourbar.toml"
    mine = set_force(served, "120 N")[1]["text"]
    theirs = FOURBAR.replace("100 N", "55 N")
    file.write_text(theirs, "utf-8")
    state = served.act("look")[1]
    assert state["text"] == mine and any("changed on disk" in text for text in said(state))
    answer = served.act("save")[1]
    assert answer["conflict"] is True and "changed on disk" in answer["fault"]["sentence"]
    assert file.read_text("utf-8") == theirs
    other = served.act("save", file="mine.toml")[1]
    assert other["saved"] and (served.folder / "mine.toml").read_text("utf-8") == mine
    assert file.read_text("utf-8") == theirs


def test_a_journal_is_offered_by_the_next_start(served):
    mine = set_force(served, "120 N")[1]["text"]
    beside = BoardSession(served.folder, "fourbar.toml")
    state = beside.answer({"act": "look"})[1]
    assert state["text"] == FOURBAR and "in another board" in said(state)[0]
    assert (
        not state["journal"] and "in another board" in beside.answer(FORCE)[1]["fault"]["sentence"]
    )
    served.server.session.document.close()  # as a crash leaves it
    again = BoardSession(served.folder, "fourbar.toml")
    state = again.answer({"act": "look"})[1]
    assert state["journal"] and state["text"] == mine and not state["saved"]
    assert again.answer({"act": "undo"})[1]["text"] == FOURBAR
    assert (served.folder / "fourbar.toml").read_text("utf-8") == FOURBAR
    again.close()


def test_links_and_pipes_of_a_hostile_folder_lead_nowhere(served, tmp_path_factory):
    """What the board keeps beside a model goes over no link, and waits for no pipe."""
    outside, folder = tmp_path_factory.mktemp("outside"), served.folder
    (outside / "mine").write_text("mine")
    (folder / "fourbar.board.toml").symlink_to(outside / "mine")
    (folder / "fourbar.toml.journal").symlink_to(outside / "new")
    (folder / "fourbar-report.html").symlink_to(outside / "report")
    for name in ("views.board.toml", "scan.dxf", "pipe.toml"):
        os.mkfifo(folder / name)
    (folder / "views.toml").write_text(FOURBAR)
    assert served.act("camera", set={"x": 1, "y": 2, "unit": 3})[0] == 200
    assert set_force(served, "120 N")[1]["undo"] and served.act("save")[1]["saved"]
    for force in (False, True):
        assert "already" in served.act("job", do="report", force=force)[1]["fault"]["sentence"]
    underlay = {"file": "scan.dxf", "x": 0, "y": 0, "width": 1, "angle": 0, "opacity": 1}
    assert "no picture" in served.act("underlay", set=underlay)[1]["fault"]["sentence"]
    assert served.act("open", file="views.toml")[1]["views"] == {}
    assert served.act("open", file="pipe.toml")[1]["fault"]
    (folder / "views.toml").unlink()
    (folder / "views.toml").symlink_to(outside / "model.toml")
    assert "not below" in served.act("save", force=True)[1]["fault"]["sentence"]
    assert [file.read_text() for file in outside.iterdir()] == ["mine"]


# -- dragging ------------------------------------------------------------------------------------


def test_drags_change_no_file_and_forces_are_those_of_mbody(served):
    rev = served.act("look", unit=0.2)[1]["rev"]
    drag = {"do": "number", "path": ["loads", "F", "force"], "value": 150.0}
    found = served.act("drag", drag=drag)[1]["drag"]
    own = mbody.kinetostatics(mbody.from_toml(FOURBAR.replace("100 N", "150 N"))).data()
    for joint, force in found["run"]["reactions"].items():
        assert force["fx"] == pytest.approx(own["reactions"][joint]["fx"], rel=1e-9)
    drag = {"do": "point", "place": "crank.B", "to": [20.0, 30.0]}
    found = served.act("drag", drag=drag)[1]["drag"]
    assert found["reached"] == pytest.approx([20.0, 30.0], abs=1e-9)
    along = served.act("drag", drag=drag | {"along": True})[1]["drag"]["reached"]
    t = 20.0 * 0.5 + 30.0 * 0.75**0.5  # along the crank, which stands at 60 degrees
    assert along == pytest.approx([0.5 * t, 0.75**0.5 * t], abs=1e-9)
    for _ in range(100):  # shapes come now and then
        found = served.act("drag", drag=drag)[1]["drag"]
        if "shapes" in found:
            break
        time.sleep(0.05)
    assert found["shapes"] and found["points"]["crank"]["B"] != [30.0, 0.0]
    drag = {"do": "move", "body": "crank", "at": [30, 0], "to": [0.0, 99.0]}
    found = served.act("drag", drag=drag)[1]["drag"]
    assert found["drivers"]["motor"] != 60.0 and not found["home"]
    home = served.act("home")[1]["drag"]
    assert home["home"] and home["drivers"]["motor"] == pytest.approx(60.0)
    driven = served.act("drive", values={"motor": 75.0})[1]["drag"]
    assert driven["drivers"]["motor"] == pytest.approx(75.0)
    assert served.act("drop")[1] == {"rev": rev}
    state = served.act("look")[1]
    assert state["rev"] == rev and state["text"] == FOURBAR


# -- exports -------------------------------------------------------------------------------------


def export(served, **more):
    begun = served.act("job", **more)[1]
    if "fault" in begun:
        return begun
    for _ in range(600):
        found = served.act("job", id=begun["job"])[1]
        if found["done"] == 1.0:
            return found
        time.sleep(0.1)
    raise AssertionError("no end")


def same(a, b):
    """Whether two files say the same, but for the times that their formats have."""
    if a.suffix in (".xlsx", ".fmu"):
        with zipfile.ZipFile(a) as one, zipfile.ZipFile(b) as two:
            sheets = [n for n in one.namelist() if "core.xml" not in n and ".xml" in n]
            return [(n, len(one.read(n))) for n in sheets] == [
                (n, len(two.read(n))) for n in sheets
            ]
    if a.suffix == ".dxf":
        a, b = (one.read_text().partition("ENTITIES")[2].partition("OBJECTS")[0] for one in (a, b))
        return len(a) > 300 and a == b
    return a.read_bytes() == b.read_bytes()


EXPORTED = [
    "csv",
    *(pytest.param(do, marks=pytest.mark.slow) for do in EXPORTS if do not in ("csv", "fmu")),
]


@pytest.mark.parametrize("do", EXPORTED)
def test_an_export_is_what_its_command_line_writes(served, do, tmp_path_factory):
    found = export(served, do=do)
    file = served.folder / found["file"]
    words = shlex.split(found["command"])
    assert words[0] == "mbody" and words[-1] == found["file"] and file.stat().st_size > 300
    kept = file.with_name(f"kept{file.suffix}")
    file.rename(kept)
    done = subprocess.run([sys.executable, "-m", *words], cwd=served.folder, capture_output=True)
    assert done.returncode == 0 and same(kept, file)


def test_exports_write_over_nothing_but_their_own(served):
    file = served.folder / "fourbar.csv"
    file.write_text("mine")
    refused = export(served, do="csv")
    assert "already" in refused["fault"]["sentence"] and file.read_text() == "mine"
    assert export(served, do="csv", force=True)["file"] == "fourbar.csv"
    assert export(served, do="csv")["file"] == "fourbar.csv"
    file.write_text("mine again")
    assert "already" in export(served, do="csv")["fault"]["sentence"]


def test_nothing_in_the_folder_is_run(served):
    """Neither modules beside the model, nor names of files that look like options."""
    for name in ("numpy", "mbody", "matplotlib", "sitecustomize"):
        (served.folder / f"{name}.py").write_text(f"open('ran-{name}', 'w'); raise SystemExit(3)")
    served.act("save", file="--help.toml")
    assert export(served, do="csv")["file"] == "--help.csv"
    assert (served.folder / "--help.csv").read_text().startswith("t [s]")
    assert not list(served.folder.glob("ran-*"))


# -- import and views ----------------------------------------------------------------------------


def test_files_of_other_programs_are_imported(served):
    (served.folder / "bars.pmks").write_text(FOUR_BAR)
    assert served.act("files")[1]["imports"] == ["bars.pmks"]
    state = served.act("open", **{"import": "bars.pmks"})[1]
    assert {"input", "coupler", "output"} <= state["bodies"].keys() and state["file"] == ""
    (served.folder / "bars.txt").write_text("no mechanism")
    assert served.act("open", **{"import": "bars.txt"})[1]["fault"]["sentence"]


def png():
    def chunk(name, data):
        body = name + data
        return struct.pack(">I", len(data)) + body + struct.pack(">I", zlib.crc32(body))

    head = chunk(b"IHDR", struct.pack(">IIBBBBB", 1, 1, 8, 0, 0, 0, 0))
    return (
        b"\x89PNG\r\n\x1a\n" + head + chunk(b"IDAT", zlib.compress(b"\0\0")) + chunk(b"IEND", b"")
    )


PLACE = {"x": 1, "y": 2, "width": 80, "angle": 0, "opacity": 0.4}


def test_a_picture_is_kept_beside_the_model(served):
    (served.folder / "scan.png").write_bytes(png())
    state = served.act("underlay", set={"file": "scan.png", **PLACE})[1]
    assert state["views"]["underlay"] == {"file": "scan.png", **PLACE}
    served.act("camera", set={"x": 3, "y": 4, "unit": 0.2})
    headers = {"Sec-Fetch-Site": "same-origin"}
    status, content, said = served.ask("GET", f"{served.below}underlay?scan.png", None, headers)
    assert (status, content, said["Content-Type"]) == (200, png(), "image/png")
    again = BoardSession(served.folder, "fourbar.toml").answer({"act": "look"})[1]
    assert again["views"] == {"camera": {"x": 3, "y": 4, "unit": 0.2}, **state["views"]}
    assert again["text"] == FOURBAR and served.act("files")[1]["models"] == ["fourbar.toml"]
    assert "underlay" not in served.act("underlay", set=None)[1]["views"]
    assert served.ask("GET", f"{served.below}underlay", None, headers)[0] == 404


def test_what_is_no_picture_of_the_folder_is_refused(served, tmp_path_factory):
    secret = tmp_path_factory.mktemp("other") / "secret.png"
    secret.write_bytes(png())
    (served.folder / "link.png").symlink_to(secret)
    (served.folder / "page.png").write_text("<svg onload='alert(1)'/>")
    (served.folder / "page.svg").write_text("<svg xmlns='http://www.w3.org/2000/svg'/>")
    for name in ("link.png", "page.png", "page.svg", "none.png", str(secret), "fourbar.toml"):
        assert served.act("underlay", set={"file": name, **PLACE})[1]["fault"]["sentence"], name
    assert served.act("underlay", set={"file": "page.png"})[0] == 400
    # also where a file that was checked is exchanged, or another program has written the views
    views = "[underlay]\nfile = '../x.png'\nx = 0\ny = 0\nwidth = 1\nangle = 0\nopacity = 1\n"
    (served.folder / "fourbar.board.toml").write_text(views)
    served.act("open", file="fourbar.toml")
    (served.folder.parent / "x.png").write_bytes(png())
    headers = {"Sec-Fetch-Site": "same-origin"}
    assert served.ask("GET", f"{served.below}underlay", None, headers)[0] == 404


def test_a_dxf_is_drawn_as_lines(served):
    ezdxf = pytest.importorskip("ezdxf")
    drawing = ezdxf.new()
    drawing.modelspace().add_line((0, 0), (40, 20))
    drawing.modelspace().add_circle((10, 10), 5)
    drawing.modelspace().add_text("<script>")
    drawing.saveas(served.folder / "part.dxf")
    small, vast = ezdxf.new(), ezdxf.new()
    small.modelspace().add_circle((0, 0), 0.05)  # in metres
    vast.modelspace().add_circle((0, 0), 1e13)
    for name, one in (("small.dxf", small), ("vast.dxf", vast)):
        one.saveas(served.folder / name)
        assert dxf_picture(served.folder / name).count(b"L") == 128
    served.act("underlay", set={"file": "part.dxf", **PLACE})
    headers = {"Sec-Fetch-Site": "same-origin"}
    status, content, said = served.ask("GET", f"{served.below}underlay", None, headers)
    assert status == 200 and said["Content-Type"] == "image/svg+xml"
    assert content.startswith(b"<svg") and b"script" not in content and b"M0 0L40 -20" in content
    (served.folder / "bad.dxf").write_text("no drawing")
    refused = served.act("underlay", set={"file": "bad.dxf", **PLACE})[1]
    assert "no lines" in refused["fault"]["sentence"]


# -- the command ---------------------------------------------------------------------------------


def test_the_command_prints_the_address_and_ends_quietly(tmp_path):
    import http.client
    import signal

    (tmp_path / "fourbar.toml").write_text(FOURBAR, "utf-8")
    words = [sys.executable, "-m", "mbody", "edit", "fourbar.toml", "--no-open"]
    process = subprocess.Popen(
        words,
        cwd=tmp_path,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        # a shell that runs something in the background ignores Ctrl-C for it
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
    )
    address = process.stdout.readline().strip()
    host, token = address.removeprefix("http://").split("/")[:2]
    assert host.startswith("127.0.0.1:") and len(token) >= 24 and address.endswith("/")
    connection = http.client.HTTPConnection(host, timeout=30)
    edit = {"do": "set", "path": ["loads", "F", "force"], "text": "7 N", "what": "F"}
    headers = {"Content-Type": "application/json", "Sec-Fetch-Site": "same-origin"}
    connection.request("POST", f"/{token}/act", json.dumps({"act": "edit", "edit": edit}), headers)
    assert json.loads(connection.getresponse().read())["undo"] == "F"
    process.send_signal(signal.SIGINT)
    out, err = process.communicate(timeout=30)
    assert (process.returncode, out, err) == (0, "", "")
    assert (tmp_path / "fourbar.toml.journal").exists()
    assert (tmp_path / "fourbar.toml").read_text("utf-8") == FOURBAR
    connection.close()
