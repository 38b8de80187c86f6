"""Pages are true: their code runs and prints what it shows; docstrings likewise."""

import doctest
import importlib
import io
import pkgutil
import re

import pytest

import mbody
from tests.support.pages import blocks, differences, printed, steps
from tests.support.paths import ROOT

README = ROOT / "README.md"
#: Pages whose Python prints what they show, and how many blocks they have at least.
PROGRAMS = [
    ("docs/units-and-signs.md", 1),
    ("docs/control.md", 4),
    ("docs/motors.md", 4),
    ("docs/friction.md", 6),
    ("docs/many_contacts.md", 3),
    ("docs/centres.md", 1),
    ("docs/balancing.md", 3),
    ("docs/engines.md", 4),
    ("docs/cams.md", 3),
    ("docs/tolerances.md", 2),
    ("docs/identification.md", 2),
    ("docs/teaching.md", 3),
    ("docs/assemblies.md", 3),
    ("docs/exchange.md", 1),
    ("docs/contact.md", 8),
    ("docs/environments.md", 3),
    ("docs/linkages.md", 4),
    ("docs/stepping.md", 5),
    ("docs/synthesis.md", 5),
]
#: What pages need that is not everywhere.
NEEDS = {"docs/environments.md": "gymnasium", "docs/linkages.md": "pyarrow"}


@pytest.mark.parametrize(("page", "least"), PROGRAMS)
def test_the_code_of_a_page_prints_what_it_shows(page, least, tmp_path, monkeypatch):
    if page in NEEDS:
        pytest.importorskip(NEEDS[page])
    monkeypatch.chdir(tmp_path)
    namespace = {"__name__": "page"}
    done = steps((ROOT / page).read_text("utf-8"))
    assert len(done) >= least
    for code, shown in done:
        output = printed(code, namespace)
        if shown is None:
            assert not output, f"prints, but nothing is shown:\n{output}"
        else:
            assert shown.strip(), code
            assert not differences(output, shown), output
    if page == "docs/synthesis.md":
        assert mbody.load("design.toml").name == "four-bar"


def test_the_file_of_the_page_on_contact_is_a_model():
    """Its ladder begins at rest, slides, and leaves the wall before it lies."""
    page = (ROOT / "docs" / "contact.md").read_text("utf-8")
    (text,) = [content for language, content in blocks(page) if language == "toml"]
    run = mbody.simulate(mbody.from_toml(text))
    assert run.status == "completed"
    assert [(one.name, one.contact) for one in run.events] == [("open", "top")]
    assert run.energy.error < 1e-9


def test_the_tour_solves_the_book():
    """The described four-bar is Norton's: his torque and pin forces, with exact masses."""
    namespace = {"__name__": "readme"}
    printed(steps((ROOT / "docs/tutorial/tour.md").read_text("utf-8"))[0][0], namespace)
    run, book = namespace["run"], mbody.kinetostatics(mbody.gallery.load("norton_fourbar"))
    assert run.effort("motor") == pytest.approx(book.effort("motor"), rel=1e-12)
    for joint in ("O2", "A", "B", "O4"):
        assert run.reaction(joint).fx == pytest.approx(book.reaction(joint).fx, rel=1e-12)
        assert run.reaction(joint).fy == pytest.approx(book.reaction(joint).fy, rel=1e-12)


PAGES = [README, ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").rglob("*.md"))]


def test_pages_link_to_files_that_exist():
    """In the repository too, where no site has been built."""
    missing = [
        (page.relative_to(ROOT).as_posix(), target)
        for page in PAGES
        if "_build" not in page.parts
        for target in re.findall(
            r"\]\((?!http|#|\.\.\.)([^)#\s]+)(?:#[^)]*)?\)", page.read_text("utf-8")
        )
        if not (page.parent / target).exists()
    ]
    assert not missing


def modules():
    names = [info.name for info in pkgutil.walk_packages(mbody.__path__, "mbody.")]
    # what hatchling runs imports hatchling, which is installed where wheels are built
    left_out = ("__main__", "wheel_hook")
    return ["mbody", *(name for name in names if not name.endswith(left_out))]


@pytest.mark.parametrize("folder", sorted({".".join(name.split(".")[:2]) for name in modules()}))
def test_docstrings(folder):
    """The examples of all modules of a folder, or of a file beside the folders."""
    failures = []
    for name in modules():
        if name != folder and not (name.startswith(f"{folder}.") and folder != "mbody"):
            continue
        runner = doctest.DocTestRunner()
        for test in doctest.DocTestFinder(exclude_empty=True).find(
            importlib.import_module(name), name
        ):
            said = io.StringIO()
            if runner.run(test, out=said.write).failed:
                failures.append(said.getvalue())
    assert not failures, "\n".join(failures)


def test_the_model_of_the_readme_is_the_gallerys():
    [text] = [
        content for language, content in blocks(README.read_text("utf-8")) if language == "toml"
    ]
    shown = mbody.from_toml(text)
    run, book = map(mbody.kinetostatics, (shown, mbody.gallery.load("norton_fourbar")))
    assert run.effort("motor")[0] == pytest.approx(243.23759076122965, rel=1e-12)
    for joint in ("O2", "A", "B", "O4"):
        assert run.reaction(joint).magnitude == pytest.approx(
            book.reaction(joint).magnitude, rel=1e-12
        )
