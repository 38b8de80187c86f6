"""A page of the viewer in headless Chromium: keys, mouse, dark and light, print."""

import base64

import numpy as np

KEYS = {" ": "Space"}
CODES = {"Tab": 9, "ArrowRight": 39, "ArrowLeft": 37, " ": 32}

#: At 24 instants: the greatest part of one that another covers, and the part that is seen.
COVERED = """((of) => [...Array(24).keys()].map((n) => {
  const v = mbody.viewer;
  mbody.seek({ instant: Math.round(n / 24 * (v.main.count - 1)) });
  const seen = (e) => e.style.visibility !== "hidden" && e.style.display !== "none";
  const texts = of(v), boxes = texts.filter(seen).map((e) => e.getBoundingClientRect());
  // lines of text stand 14 px high, their boxes have room for accents
  const high = 14 * (texts[0]?.ownerSVGElement.getScreenCTM().a ?? 1);
  let worst = 0;
  boxes.forEach((a, i) => boxes.slice(0, i).forEach((b) => {
    const wide = Math.min(a.right, b.right) - Math.max(a.left, b.left);
    const tall = high - Math.abs(a.top + a.bottom - b.top - b.bottom) / 2;
    const part = wide * tall / high / Math.min(a.width, b.width);
    if (wide > 0 && tall > 0) worst = Math.max(worst, part);
  }));
  return [worst, boxes.length / texts.length];
}))"""
#: All names of a picture.
NAMES = """(v) => {{
  const {{ names, arrows }} = v.pictures[{n}].layers;
  return [...names.children, ...arrows.querySelectorAll("text")];
}}"""


class ViewerPage:
    """What a user does with a page; `browser` is that of `tests.support.browser`."""

    def __init__(self, browser):
        self.browser = browser
        self.read, self.wait = browser.value, browser.wait
        self.size(1280, 900)

    def open(self, file):
        """Load a page and wait for its viewer."""
        self.browser.open(file)
        self.wait("!!window.mbody")

    def call(self, method, **parameters):
        """A command of the protocol, to the page."""
        return self.browser.call(method, page=True, **parameters)

    @property
    def problems(self):
        """What the console says, but for the icon that Chromium asks for of a page without."""
        return [one for one in self.browser.problems if "favicon" not in str(one)]

    @property
    def requests(self):
        """What was loaded beside the page itself."""
        return self.browser.requests

    def key(self, key):
        """Press a key."""
        text = {"text": key} if len(key) == 1 else {}
        what = {"key": key, "code": KEYS.get(key, key if len(key) > 1 else f"Key{key.upper()}")}
        if key in CODES:
            what["windowsVirtualKeyCode"] = CODES[key]
        self.call("Input.dispatchKeyEvent", type="keyDown", **what, **text)
        self.call("Input.dispatchKeyEvent", type="keyUp", **what)

    def click(self, x, y):
        """Press and release the mouse at a place."""
        where = {"x": x, "y": y, "button": "left", "clickCount": 1}
        self.call("Input.dispatchMouseEvent", type="mousePressed", **where)
        self.call("Input.dispatchMouseEvent", type="mouseReleased", **where)

    def hover(self, x, y):
        """Move the mouse to a place."""
        self.call("Input.dispatchMouseEvent", type="mouseMoved", x=x, y=y)

    def dark(self, is_dark=True):
        """Prefer dark or light, as a system does."""
        value = {"name": "prefers-color-scheme", "value": "dark" if is_dark else "light"}
        self.call("Emulation.setEmulatedMedia", features=[value])
        name = "dark" if is_dark else "light"
        self.wait(f"!window.mbody || mbody.viewer.root.classList.contains('{name}')")

    def size(self, width, height):
        """Another window."""
        size = {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": False}
        self.call("Emulation.setDeviceMetricsOverride", **size)

    def covered(self, texts=None, picture=0):
        """Of names at 24 instants, the most that is covered of one, and the part that is seen."""
        return np.array(self.read(f"{COVERED}({texts or NAMES.format(n=picture)})")).T

    def picture(self):
        """What the page looks like, as PNG."""
        return base64.b64decode(self.call("Page.captureScreenshot", format="png")["data"])

    def pdf(self):
        """The page as it prints."""
        return base64.b64decode(self.call("Page.printToPDF", printBackground=True)["data"])
