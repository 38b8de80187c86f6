"""The site: every page has its place, every link its target, and no warning is left."""

import importlib.util
import re
import subprocess
import sys
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit

import pytest

import mbody
from mbody.cli.parser import verbs
from mbody.files.model.problems import LAWS, SECTIONS
from tests.support.paths import ROOT

DOCS = ROOT / "docs"
#: What a web address may be; those of the network are not opened.
ADDRESS = re.compile(r"https?://[\w.-]+\.[a-z]{2,}(?::\d+)?(?:/[^\s<>\"]*)?$")
TOCTREE = re.compile(r"^```\{toctree\}\n(.*?)^```$", re.DOTALL | re.MULTILINE)


def pages():
    """Pages and notebooks by their path in docs, without ending."""
    found = [path for end in ("md", "ipynb") for path in DOCS.rglob(f"*.{end}")]
    names = {path.relative_to(DOCS).with_suffix("").as_posix() for path in found}
    return {name for name in names if not name.startswith(("_build", "pictures"))}


def placed():
    """Every entry of a toctree."""
    entries = []
    for name in pages():
        path = DOCS / f"{name}.md"
        for block in TOCTREE.findall(path.read_text("utf-8") if path.exists() else ""):
            for line in filter(None, map(str.strip, block.splitlines())):
                if line.startswith(":"):
                    continue
                here = (path.parent / line).resolve().relative_to(DOCS).as_posix()
                matching = [page for page in pages() if Path(page).match(here)]
                entries += matching if "*" in line else [here]
    return entries


def test_every_page_is_in_one_toctree():
    entries = placed()
    left_out = sorted(pages() - {"index", *entries})
    assert not left_out, f"name these pages in a toctree, as of docs/howto/index.md: {left_out}"
    assert sorted(entries) == sorted(set(entries)), "a page has one place"
    assert not sorted(set(entries) - pages())


class Page(HTMLParser):
    """Links, pictures and anchors of a built page."""

    def __init__(self, path):
        super().__init__()
        self.links, self.anchors, self.loaded = [], set(), []
        self.feed(path.read_text("utf-8"))

    def handle_starttag(self, tag, attrs):
        given = dict(attrs)
        self.anchors |= {given[key] for key in ("id", "name") if given.get(key)}
        if tag == "a" and "href" in given:
            self.links.append(given["href"])
        for key in ("src", "srcset", "data", "poster"):
            if given.get(key):
                self.loaded.append(given[key])
        if tag == "link" and "href" in given:
            self.loaded.append(given["href"])


@pytest.fixture(scope="session")
def site(tmp_path_factory):
    """The site as `make docs` makes it, without films; notebooks are run by tests of their own."""
    for name in ("sphinx", "furo", "myst_nb"):
        if importlib.util.find_spec(name) is None:
            pytest.skip(f"{name} is not installed: make docs installs it")
    folder = tmp_path_factory.mktemp("site")
    command = [sys.executable, "-m", "sphinx", "-q", "-W", "--keep-going", "-b", "html"]
    command += ["-D", "films=0", "-D", "nb_execution_mode=off", "-d", str(folder / "doctrees")]
    command += [str(DOCS), str(folder / "html")]
    done = subprocess.run(command, capture_output=True, text=True, cwd=ROOT)
    assert done.returncode == 0, done.stderr[-4000:]
    return folder / "html"


@pytest.fixture(scope="session")
def built(site):
    return {path: Page(path) for path in sorted(site.rglob("*.html"))}


@pytest.mark.slow
@pytest.mark.xdist_group("site")
def test_every_link_has_its_target(site, built):
    wrong = []
    for path, page in built.items():
        for link in page.links:
            parts = urlsplit(link)
            if parts.scheme in ("http", "https"):
                if not ADDRESS.match(link):
                    wrong.append((path.name, link))
                continue
            target = path if not parts.path else (path.parent / unquote(parts.path)).resolve()
            anchors = built[target].anchors if target in built else set()
            if not target.exists() or (parts.fragment and unquote(parts.fragment) not in anchors):
                wrong.append((path.name, link))
    assert not wrong


@pytest.mark.slow
@pytest.mark.xdist_group("site")
def test_the_site_needs_no_network(site, built):
    for path, page in built.items():
        for loaded in page.loaded:
            assert not urlsplit(loaded).netloc, f"{path}: {loaded}"
            if not loaded.startswith("data:"):
                target = (path.parent / unquote(urlsplit(loaded).path)).resolve()
                assert target.exists(), f"{path}: {loaded}"
    outside = re.compile(r"@import[^;]*|url\(\s*[\"']?(?:https?:)?//[^)]*")
    for sheet in site.rglob("*.css"):
        assert not outside.findall(sheet.read_text("utf-8")), sheet


@pytest.mark.slow
@pytest.mark.xdist_group("site")
def test_the_reference_has_all(site):
    def text(*names):
        return "".join((site / "reference" / f"{name}.html").read_text("utf-8") for name in names)

    python = "".join(path.read_text("utf-8") for path in (site / "reference/python").glob("*.html"))
    for name in mbody.__all__:
        assert f'id="mbody.{name}"' in python, name
    for folder in (name for name, home in mbody._HOMES.items() if home == "mbody"):
        for name in getattr(mbody, folder).__all__:
            assert re.search(rf'id="mbody\.({folder}\.)?{name}"|<h2>{name}<', python), (
                folder,
                name,
            )
    for section, kinds in [*SECTIONS.items(), ("laws", LAWS)]:
        page = text(f"elements/{section}")
        for kind, cls in kinds.items():
            assert f"<h2>{cls.__name__}<" in page, (section, kind)
    commands = text("commands")
    for name in verbs():
        assert f"<h2>mbody {name}<" in commands, name


def test_the_citation_is_of_this_version():
    text = (ROOT / "CITATION.cff").read_text("utf-8")
    assert f"\nversion: {mbody.__version__}\n" in text
