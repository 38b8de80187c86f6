"""The server of the drawing board: one page, for this machine alone, with the session behind it.

A request is answered only if it has the token of the address, comes from the page itself and names
this server: another page in the same browser, another machine and another name of this one are
refused. No path of a request reaches the disk.
"""

from __future__ import annotations

import hmac
import json
import secrets
import threading
import time
from collections.abc import Callable
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from importlib import resources
from pathlib import Path
from typing import Any

from mbody.edit.session import BoardSession

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
