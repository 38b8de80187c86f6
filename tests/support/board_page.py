"""The drawing board in headless Chromium: pointer, fingers and keys at places of the drawing."""

import base64
import json
import subprocess
import sys
from contextlib import contextmanager
from itertools import pairwise

#: The file of an empty page.
EMPTY = 'units = "mm-N-s"\n'
CODES = {
    "Tab": 9, "Enter": 13, "Escape": 27, " ": 32, "Home": 36, "ArrowLeft": 37, "ArrowUp": 38,
    "ArrowRight": 39, "ArrowDown": 40, "Delete": 46, "F2": 113,
}  # fmt: skip
#: Bits of the keys that are held.
HELD = {"alt": 1, "ctrl": 2, "shift": 8}


class BoardPage:
    """What a user does with the board; `browser` is that of `tests.support.browser`."""

    def __init__(self, browser, address):
        self.browser = browser
        self.read, self.wait = browser.value, browser.wait
        self.size(1280, 800)
        browser.open(address)
        self.wait("!!window.mbody?.board")
        self.idle()

    def call(self, method, **parameters):
        """A command of the protocol, to the page."""
        return self.browser.call(method, page=True, **parameters)

    @property
    def problems(self):
        """What the console says."""
        return self.browser.problems

    @property
    def text(self):
        """The file as it would be saved."""
        return self.read("mbody.board.text()")

    @property
    def run(self):
        """Data of the analysis at home."""
        return self.read("mbody.board.run()")

    @property
    def messages(self):
        """What is said of elements."""
        return self.read("mbody.board.messages()")

    def idle(self):
        """Wait until nothing is under way and the picture is drawn."""
        self.read("mbody.board.idle()")

    def size(self, wide, tall, touch=False):
        """Take a size of the window, of a phone with fingers."""
        metrics = {"width": wide, "height": tall, "deviceScaleFactor": 1, "mobile": touch}
        self.call("Emulation.setDeviceMetricsOverride", **metrics)
        self.call("Emulation.setTouchEmulationEnabled", enabled=touch, maxTouchPoints=2)
        # the page knows its size a frame later
        self.read("new Promise((f) => requestAnimationFrame(() => requestAnimationFrame(f)))")

    def dark(self, is_dark=True):
        """Prefer dark or light, as the system does."""
        value = "dark" if is_dark else "light"
        self.call(
            "Emulation.setEmulatedMedia",
            features=[{"name": "prefers-color-scheme", "value": value}],
        )

    def picture(self, file):
        """Keep a picture of the window."""
        data = self.call("Page.captureScreenshot", format="png")["data"]
        file.write_bytes(base64.b64decode(data))

    # -- keys -------------------------------------------------------------------------------------

    def key(self, key, *held):
        """Press a key, with others held."""
        bits = sum(HELD[one] for one in held)
        code = f"Key{key.upper()}" if len(key) == 1 and key.isalpha() else key
        what = {"key": key, "code": code, "modifiers": bits}
        number = CODES.get(key, ord(key.upper()) if len(key) == 1 else 0)
        what["windowsVirtualKeyCode"] = number
        plain = len(key) == 1 and not {"alt", "ctrl"} & set(held)
        text = {"text": key} if plain else {"text": "\r"} if key == "Enter" else {}
        self.call("Input.dispatchKeyEvent", type="keyDown", **what, **text)
        self.call("Input.dispatchKeyEvent", type="keyUp", **what)
        self.idle()

    def keys(self, *keys):
        """Press keys one after another."""
        for one in keys:
            self.key(one)

    def write(self, text):
        """Type a text into the field that has the focus."""
        self.call("Input.insertText", text=text)

    def fill(self, css, text):
        """Type over what stands in a field."""
        found = f"document.querySelector({json.dumps(css)})"
        self.read(f"((f) => {{ f.focus(); f.select(); return 0; }})({found})")
        self.write(text)

    # -- pointer ----------------------------------------------------------------------------------

    def at(self, place):
        """Pixels of a place of the drawing."""
        return self.read(f"mbody.board.screen({place[0]}, {place[1]})")

    def _mouse(self, kind, place, held=(), **more):
        x, y = self.at(place)
        bits = sum(HELD[one] for one in held)
        self.call("Input.dispatchMouseEvent", type=kind, x=x, y=y, modifiers=bits, **more)

    def hover(self, *place, held=()):
        """Move the mouse to a place of the drawing."""
        self._mouse("mouseMoved", place, held)
        self.idle()

    def click(self, *place, held=()):
        """Click a place of the drawing."""
        self.drag(place, held=held)

    def drag(self, *places, held=(), release=True):
        """Press at the first place, go through the others, and release at the last."""
        left = {"button": "left", "clickCount": 1}
        self._mouse("mouseMoved", places[0], held)
        self._mouse("mousePressed", places[0], held, **left)
        for before, place in pairwise(places):
            for part in (0.5, 1.0):
                there = [a + part * (b - a) for a, b in zip(before, place, strict=True)]
                self._mouse("mouseMoved", there, held, buttons=1)
                self.read("new Promise(requestAnimationFrame)")
        if release:
            self.release(*places[-1], held=held)

    def release(self, *place, held=()):
        """End a drag."""
        self._mouse("mouseReleased", place, held, button="left", clickCount=1)
        self.idle()

    def touch(self, kind, *pixels):
        """Fingers at pixels of the window: touchStart, touchMove or touchEnd."""
        points = [{"x": x, "y": y, "id": n} for n, (x, y) in enumerate(pixels)]
        self.call("Input.dispatchTouchEvent", type=kind, touchPoints=points)

    def tap(self, *place):
        """Touch a place of the drawing."""
        x, y = self.at(place)  # one command: its time does not depend on how busy the machine is
        self.call("Input.synthesizeTapGesture", x=x, y=y, duration=20, gestureSourceType="touch")
        self.idle()


@contextmanager
def served(folder, *arguments):
    """The address of a board that `mbody edit` serves from a folder, for the block."""
    command = [sys.executable, "-m", "mbody", "edit", *arguments, "--no-open"]
    made = subprocess.Popen(command, cwd=folder, stdout=subprocess.PIPE, text=True)
    try:
        yield made.stdout.readline().strip()
    finally:
        made.terminate()
        made.wait(30)
        made.stdout.close()
