"""A headless browser for tests: Chromium, steered over a pipe in its own protocol."""

import fcntl
import itertools
import json
import os
import re
import shutil
import signal
import tempfile
import time
from contextlib import contextmanager
from pathlib import Path

__all__ = ["Browser", "browser", "chromium"]


def chromium():
    """The program, or None."""
    names = ("chromium", "chromium-browser", "google-chrome", "chrome")
    return next((found for name in names if (found := shutil.which(name))), None)


class Browser:
    """One page of a browser; `problems` are errors of its console, `requests` what it loaded."""

    def __init__(self, to, back):
        self._to, self._back, self._numbers = to, back, itertools.count(1)
        self._rest, self.events = b"", []
        target = self.call("Target.createTarget", url="about:blank")["targetId"]
        found = self.call("Target.attachToTarget", targetId=target, flatten=True)
        self._session = found["sessionId"]
        for domain in ("Page", "Runtime", "Network", "Log"):
            self.call(f"{domain}.enable", page=True)

    def call(self, method, page=False, **parameters):
        """One command of the protocol, of the page or of the browser; what it answers."""
        number = self._send(method, page, parameters)
        while True:
            found = self._next()
            if found.get("id") == number:
                assert "error" not in found, found["error"]
                return found["result"]
            self.events.append(found)
            if found.get("method") == "Page.javascriptDialogOpening":  # leave an unsaved page
                self._send("Page.handleJavaScriptDialog", True, {"accept": True})

    def _send(self, method, page, parameters):
        message = {"id": next(self._numbers), "method": method, "params": parameters}
        if page:
            message["sessionId"] = self._session
        os.write(self._to, json.dumps(message).encode() + b"\0")
        return message["id"]

    def _next(self):
        while b"\0" not in self._rest:
            part = os.read(self._back, 1 << 20)
            assert part, "the browser has ended"
            self._rest += part
        message, _, self._rest = self._rest.partition(b"\0")
        return json.loads(message)

    def open(self, file):
        """Load a file, or an address, and wait until it is there."""
        self.events.clear()
        url = file.resolve().as_uri() if isinstance(file, Path) else file
        self.call("Page.navigate", page=True, url=url)
        while not any(one.get("method") == "Page.loadEventFired" for one in self.events):
            self.events.append(self._next())

    def value(self, expression):
        """The value of an expression of JavaScript, promises waited for."""
        found = self.call(
            "Runtime.evaluate",
            page=True,
            expression=expression,
            awaitPromise=True,
            returnByValue=True,
        )
        if "exceptionDetails" in found:
            why = found["exceptionDetails"].get("exception", {}).get("description", "")
            raise AssertionError(re.sub(r"data:[\w/;,+=]{60,}", "data:…", why)[:2000])
        return found["result"].get("value")

    def wait(self, expression, seconds=60.0):
        """The value of an expression as soon as there is one."""
        until = time.monotonic() + seconds
        while time.monotonic() < until:
            found = self.value(expression)
            if found:
                return found
            time.sleep(0.05)
        raise AssertionError(f"{expression} had no value within {seconds} s: {self.problems}")

    @property
    def problems(self):
        """Errors and warnings of the console."""
        self.value("0")
        kinds = ("Runtime.exceptionThrown", "Log.entryAdded", "Runtime.consoleAPICalled")
        return [one["params"] for one in self.events if one.get("method") in kinds]

    @property
    def requests(self):
        """Addresses that the page loaded, beside itself and data within it."""
        self.value("0")
        sent = [one for one in self.events if one.get("method") == "Network.requestWillBeSent"]
        urls = [one["params"]["request"]["url"] for one in sent]
        return [url for url in urls if not url.startswith(("data:", "blob:", "file:"))]


@contextmanager
def browser(*options):
    """A browser with one empty page, for the block."""
    program = chromium()
    assert program is not None, "there is no chromium"
    (theirs, to), (back, ours) = os.pipe(), os.pipe()
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as profile:
        command = [program, "--headless=new", "--no-sandbox", "--disable-gpu", "--no-first-run"]
        command += [f"--user-data-dir={profile}", "--remote-debugging-pipe", *options]
        # the browser reads commands from its file 3 and answers to its file 4
        pair = [fcntl.fcntl(one, fcntl.F_DUPFD, 10) for one in (theirs, ours)]
        files = [(os.POSIX_SPAWN_OPEN, n, os.devnull, os.O_RDWR, 0) for n in range(3)]
        files += [(os.POSIX_SPAWN_DUP2, one, n) for one, n in zip(pair, (3, 4), strict=True)]
        process = os.posix_spawn(program, command, os.environ, file_actions=files)
        for one in (theirs, ours, *pair):
            os.close(one)
        try:
            yield Browser(to, back)
        finally:
            os.close(to)
            os.close(back)
            os.kill(process, signal.SIGTERM)
            os.waitpid(process, 0)
