"""What axe-core finds on the page of a browser. It is that of the package axe-core-python, or the
file that `MBODY_AXE` names: `npm pack axe-core`, unpacked, `MBODY_AXE=package/axe.min.js pytest …`.
"""

import functools
import importlib.util
import json
import os
from pathlib import Path

import pytest

RUN = """axe.run(document, { resultTypes: ['violations'] }).then((found) => JSON.stringify(
found.violations.map((one) => [one.id, one.nodes.slice(0, 3).map((n) => n.html.slice(0, 200))])))"""


@functools.cache
def axe():
    """The program as text."""
    if not (file := os.environ.get("MBODY_AXE")):
        package = importlib.util.find_spec("axe_core_python")
        if package is None:
            pytest.skip("there is no axe-core: install the package axe-core-python")
        file = Path(package.origin).with_name("axe.min.js")
    return Path(file).read_text("utf-8")


def violations(browser):
    """Rules that the page breaks, with the elements."""
    if not browser.value("'axe' in window"):
        browser.value(f"{axe()}; 0")
    browser.value("new Promise((done) => setTimeout(done, 200))")  # colours change in 0.12 s
    return json.loads(browser.value(RUN))
