"""The board in a browser, for tests of drawing and of the page."""

import os
from pathlib import Path

import pytest

from tests.support.board_page import EMPTY, BoardPage, served
from tests.support.browser import browser as started

#: An empty page, whatever was drawn before.
NEW = """fetch('act', { method: 'POST', headers: { 'Content-Type': 'application/json' },
  body: JSON.stringify({ act: 'open', new: '', force: true }) }).then(() => 0)"""


@pytest.fixture(scope="session")
def chrome():
    with started("--hide-scrollbars") as found:
        yield found


@pytest.fixture(scope="session")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("board")


@pytest.fixture(scope="session")
def address(folder):
    with served(folder) as found:
        yield found


@pytest.fixture(scope="session")
def pictures(tmp_path_factory):
    """Where pictures of what was drawn are kept, to be looked at."""
    return Path(os.environ.get("MBODY_PICTURES") or tmp_path_factory.mktemp("pictures"))


@pytest.fixture
def page(chrome, address):
    made = BoardPage(chrome, address)
    made.read(NEW)
    made.browser.open(address)
    made.wait("!!window.mbody?.board")
    made.idle()
    assert made.text == EMPTY
    yield made
    said = [one for one in made.problems if "beforeunload" not in str(one)]
    assert said == []
