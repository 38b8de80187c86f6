"""The server of the drawing board: what it answers, to whom, and what of the disk it touches."""

import http.client
import json
import random
import socket
import threading

import pytest

from mbody.edit.session import MOST, BoardServer, BoardSession

FOURBAR = """\
# drawn by hand
units = "mm-N-s"
[ground]
points = { A = [0, 0], D = [100, 0] }
[bodies.crank]
points = { A = [0, 0], B = [30, 0] }  # the short one
guess = "60 deg"
[bodies.coupler]
points = { B = [0, 0], C = [80, 0] }
[bodies.rocker]
points = { D = [0, 0], C = [70, 0] }
guess = "80 deg"
[joints]
A = { revolute = ["ground.A", "crank.A"] }
B = { revolute = ["crank.B", "coupler.B"] }
C = { revolute = ["coupler.C", "rocker.C"] }
D = { revolute = ["ground.D", "rocker.D"] }
[drivers]
motor = { angle = "crank", law = { constant_speed = { value = 60, speed = "60 rpm" } } }
[loads]
F = { force = "100 N", at = "coupler.C", angle = 20 }
"""
PAGE = {"Content-Type": "application/json", "Sec-Fetch-Site": "same-origin"}


class Client:
    """What a page does, with headers and paths of one's own."""

    def __init__(self, server):
        self.host = f"127.0.0.1:{server.server_port}"
        self.below = f"/{server.token}/"

    def ask(self, method, path, body=None, headers=None):
        connection = http.client.HTTPConnection(self.host, timeout=40)
        connection.putrequest(method, path, skip_host=True, skip_accept_encoding=True)
        for key, value in ({"Host": self.host} | (headers or {})).items():
            if value is not None:
                connection.putheader(key, value)
        if body is not None and "Content-Length" not in (headers or {}):
            connection.putheader("Content-Length", str(len(body)))
        connection.endheaders(body)
        answer = connection.getresponse()
        content = answer.read()
        connection.close()
        return answer.status, content, answer.headers

    def act(self, act, **more):
        body = json.dumps({"act": act, **more}).encode()
        status, content, _ = self.ask("POST", f"{self.below}act", body, PAGE)
        return status, json.loads(content)


@pytest.fixture
def served(tmp_path):
    """A client of a board on a four-bar, in a folder of its own."""
    (tmp_path / "fourbar.toml").write_text(FOURBAR, "utf-8")
    server = BoardServer(BoardSession(tmp_path, "fourbar.toml"))
    ended = threading.Event()

    def mark():
        if ended.is_set():
            raise KeyboardInterrupt

    def run():
        with pytest.raises(KeyboardInterrupt):
            server.serve(mark, keep=True)

    thread = threading.Thread(target=run)
    thread.start()
    client = Client(server)
    client.folder, client.server = tmp_path, server
    yield client
    ended.set()
    thread.join(10)
    assert not thread.is_alive()


# -- who is answered ------------------------------------------------------------------------------

#: Requests that come from elsewhere: their headers, beside those of the page.
ELSEWHERE = {
    "another name of this machine": {"Host": "rebound.example"},
    "another port": {"Host": "127.0.0.1:1"},
    "no name": {"Host": None},
    "another page": {"Origin": "http://evil.example"},
    "a page of another port": {"Origin": "http://127.0.0.1:1"},
    "a page without an origin": {"Origin": "null"},
    "another site": {"Sec-Fetch-Site": "cross-site"},
    "another port of the site": {"Sec-Fetch-Site": "same-site"},
    "the bar of addresses": {"Sec-Fetch-Site": "none"},
    "a program that does not say from where": {"Sec-Fetch-Site": None},
}


@pytest.mark.parametrize("name", ELSEWHERE)
def test_what_comes_from_elsewhere_is_refused(served, name):
    headers = PAGE | ELSEWHERE[name]
    status, body, said = served.ask("POST", f"{served.below}act", b'{"act": "look"}', headers)
    assert (status, body, said["Connection"]) == (403, b"", "close")
    own = {"Origin": f"http://{served.host}"}
    assert served.ask("POST", f"{served.below}act", b'{"act": "look"}', PAGE | own)[0] == 200


@pytest.mark.parametrize("path", ["/", "/act", "/x/act", "{0}x/act", "http://a/{0}/act"])
def test_the_token_is_needed(served, path):
    asked = path.format(served.server.token)
    assert served.ask("POST", asked, b'{"act": "look"}', PAGE)[0] == 403
    assert served.ask("GET", asked, None, {})[0] == 403


BAD = {
    "no JSON": (b"{", {}, 400),
    "a list": (b"[1]", {}, 400),
    "no number": (b'{"act": NaN}', {}, 400),
    "half a letter": (b'{"act": "\\ud800"}', {}, 400),
    "other bytes": (b"\xff", {}, 400),
    "deep": (b"[" * 100_000, {}, 400),
    "an act that there is not": (b'{"act": "_take"}', {}, 400),
    "another type": (b"{}", {"Content-Type": "text/plain"}, 415),
    "a form": (b"{}", {"Content-Type": "application/x-www-form-urlencoded"}, 415),
    "too much": (b"", {"Content-Length": str(MOST + 1)}, 413),
    "far too much": (b"", {"Content-Length": "9" * 30}, 413),
    "a negative length": (b"", {"Content-Length": "-1"}, 411),
    "pieces": (b"", {"Content-Length": "2", "Transfer-Encoding": "chunked"}, 411),
}


@pytest.mark.parametrize("name", BAD)
def test_what_is_no_request_is_refused(served, name):
    body, headers, expected = BAD[name]
    assert served.ask("POST", f"{served.below}act", body, PAGE | headers)[0] == expected
    assert served.act("look")[0] == 200


def test_other_methods_and_noise_are_refused_without_words(served):
    for method in ("PUT", "DELETE", "OPTIONS", "TRACE", "PATCH"):
        status, body, _ = served.ask(method, f"{served.below}act", b"{}", PAGE)
        assert status == 501 and not body
    with socket.create_connection(served.host.split(":"), timeout=10) as line:
        line.sendall(b"\x16\x03\x01 noise\r\n\r\n")
        assert served.server.token.encode() not in line.recv(4000)
    assert served.act("look")[0] == 200


@pytest.mark.parametrize(
    "name",
    [
        "../fourbar.toml",
        "%2e%2e/fourbar.toml",
        "viewer/../../page_data.py",
        "server.py",
        "/etc/passwd",
    ],
)
def test_no_path_of_a_request_reaches_the_disk(served, name):
    assert served.ask("GET", served.below + name, None, PAGE)[0] == 404


def test_answers_say_how_they_may_be_used(served):
    _, body, headers = served.ask("POST", f"{served.below}act", b'{"act": "look"}', PAGE)
    policy = headers["Content-Security-Policy"]
    assert "default-src 'none'" in policy and "frame-ancestors 'none'" in policy
    assert "unsafe-eval" not in policy and "script-src 'self';" in policy
    assert headers["Referrer-Policy"] == "no-referrer" and headers["Cache-Control"] == "no-store"
    assert headers["Cross-Origin-Opener-Policy"] == "same-origin"
    assert headers["Cross-Origin-Resource-Policy"] == "same-origin"
    assert headers["X-Content-Type-Options"] == "nosniff"
    assert json.loads(body)["text"] == FOURBAR


# -- the document ---------------------------------------------------------------------------------


def set_force(client, text, **more):
    edit = {"do": "set", "path": ["loads", "F", "force"], "text": text, "what": f"F = {text}"}
    return client.act("edit", edit=edit, **more)


def test_an_edit_undo_and_redo(served):
    first = served.act("look", unit=0.2)[1]
    _, after = set_force(served, "120 N", rev=first["rev"])
    assert after["text"] == FOURBAR.replace("100 N", "120 N") and not after["saved"]
    assert after["undo"] == "F = 120 N" and after["rev"] > first["rev"]
    ratio = after["run"]["reactions"]["A"]["fx"][0] / first["run"]["reactions"]["A"]["fx"][0]
    assert ratio == pytest.approx(1.2, rel=1e-12)
    assert served.act("undo", rev=after["rev"])[1]["text"] == FOURBAR
    again = served.act("redo")[1]
    assert (
        again["text"] == after["text"] and (served.folder / "fourbar.toml").read_text() == FOURBAR
    )


def test_an_edit_of_an_old_revision_gets_the_new_state(served):
    """Two tabs, one document."""
    rev = served.act("look")[1]["rev"]
    new = set_force(served, "120 N", rev=rev)[1]
    status, state = set_force(served, "80 N", rev=rev)
    assert status == 409 and state["rev"] == new["rev"] and state["text"] == new["text"]
    assert served.act("undo", rev=rev)[0] == 409


def test_another_tab_is_told(served):
    rev = served.act("look")[1]["rev"]
    told = []
    waiting = threading.Thread(target=lambda: told.append(served.act("wait", rev=rev)))
    waiting.start()
    new = set_force(served, "120 N", rev=rev)[1]
    waiting.join(10)
    assert told == [(200, {"rev": new["rev"], "changed": True})]


def test_saving_writes_the_text_and_a_name_only_once(served):
    set_force(served, "120 N")
    state = served.act("save")[1]
    assert state["saved"] and (served.folder / "fourbar.toml").read_text("utf-8") == state["text"]
    state = served.act("save", file="sub/../other.toml")[1]
    assert state["file"] == "other.toml" and (served.folder / "other.toml").exists()
    refused = served.act("save", file="fourbar.toml")[1]
    assert "already" in refused["fault"]["sentence"]


@pytest.mark.parametrize(
    "name",
    [
        *(
            "../out.toml",
            "/tmp/out.toml",
            "..\\..",
            ".",
            "",
            "a\0b.toml",
            "out.txt",
            "out.board.toml",
        ),
        *("link/out.toml", "x" * 5000 + ".toml", "%2e%2e/\n.toml/../../../out.toml"),
    ],
)
def test_nothing_is_written_outside_or_under_other_names(served, tmp_path_factory, name):
    outside = tmp_path_factory.mktemp("outside")
    (served.folder / "link").symlink_to(outside, target_is_directory=True)
    before = {file: file.read_bytes() for file in served.folder.iterdir() if file.is_file()}
    set_force(served, "120 N")
    for act in ("save", "open"):
        answer = served.act(act, file=name, force=True)[1]
        if name:
            assert answer["fault"]["sentence"], act
    assert not list(outside.iterdir()) and not (served.folder.parent / "out.toml").exists()
    if name:
        after = {file: file.read_bytes() for file in before}
        assert after == before


def test_revisions_go_on_over_documents(served):
    """An edit of a tab that still shows the document before is refused."""
    rev = set_force(served, "120 N")[1]["rev"]
    served.act("open", gallery="hoekens", force=True)
    assert set_force(served, "80 N", rev=rev)[0] == 409


def test_every_door_opens(served):
    listed = served.act("files")[1]
    assert listed["models"] == ["fourbar.toml"] and "cam" in listed["new"]
    assert {"name": "hoekens", "title": "Hoekens' straight-line linkage"} in listed[
        "gallery"
    ] or any(one["name"] == "hoekens" for one in listed["gallery"])
    for kind in (*listed["new"], ""):
        state = served.act("open", new=kind, force=True)[1]
        assert state["fault"] is None and state["file"] == "", kind
    assert "no model" in served.act("open", new="ladder", force=True)[1]["fault"]["sentence"]
    assert (
        "gallery has no model"
        in served.act("open", gallery="x", force=True)[1]["fault"]["sentence"]
    )


def test_any_request_has_an_answer(served):
    """Requests with keys and values of any kinds: each is answered as JSON, the board goes on."""
    chance = random.Random(46)
    values = [None, True, -1, 1e308, "", "crank.B", "F", "<b>", "x" * 300, [], [1, 2], {}, "../x"]
    values += [["loads", "F", "force"], {"do": "move"}, [[1]], {"motor": 1e9}, {"motor": "x"}]
    acts = "edit undo redo drag drop home drive modes files job underlay camera open save"
    kinds = "move point number all link join slider motor load mass set delete copy mode text"
    keys = "set body at to place path value values file gallery new import id do xy name text index"
    seen = set()
    for _ in range(200):
        act = chance.choice(acts.split())
        given = {key: chance.choice(values) for key in chance.sample(keys.split(), 5)}
        inner = given | {"do": chance.choice(kinds.split())}
        more = {act: inner} if act in ("edit", "drag") else given
        status, answer = served.act(act, **{"do": "none", **more} if act == "job" else more)
        seen.add((act, status))
        assert status in (200, 400) and answer["rev"] >= 0, (act, more)
    assert len(seen) > len(acts.split())
    assert served.act("open", file="fourbar.toml", force=True)[1]["text"]


def test_the_server_ends_when_its_page_has_gone(tmp_path, monkeypatch):
    monkeypatch.setattr("mbody.edit.session.ALONE", 0.6)
    server = BoardServer(BoardSession(tmp_path))
    thread = threading.Thread(target=server.serve, args=(lambda: None,))
    thread.start()
    thread.join(1.2)
    assert thread.is_alive()  # no page has come yet
    client = Client(server)
    assert client.act("look")[1]["free"]["say"].startswith("Empty page")
    assert client.ask("POST", "/other/act", b"{}", PAGE)[0] == 403
    thread.join(10)
    assert not thread.is_alive()
