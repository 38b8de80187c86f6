"""The README is true: its code runs and prints what it shows; docstrings likewise."""

import contextlib
import doctest
import importlib
import io
import pkgutil
import re
from itertools import pairwise

import pytest

import mbody
from tests.support.paths import ROOT

README = ROOT / "README.md"
NUMBER = re.compile(r"[-+]?\d+(?:\.\d+)?(?:[eE][-+]?\d+)?")
#: Residuals are rounding: their digits differ from machine to machine.
ROUNDING = 1e-9


def blocks(text):
    """(language, content) of every fenced block."""
    return re.findall(r"^```(\w+)\n(.*?)^```$", text, re.DOTALL | re.MULTILINE)


def steps(text):
    """Every block of Python with the output that is shown below it, None where there is none."""
    found = [*blocks(text), ("", "")]
    return [
        (code, shown if kind == "text" else None)
        for (language, code), (kind, shown) in pairwise(found)
        if language == "python"
    ]


def printed(code, namespace):
    with contextlib.redirect_stdout(io.StringIO()) as stream:
        exec(compile(code, str(README), "exec"), namespace)
    return stream.getvalue()


def same(mine, shown):
    """Two numbers as texts: within one unit of the last shown digit, or both rounding."""
    if abs(float(mine)) < ROUNDING and abs(float(shown)) < ROUNDING:
        return True
    digits = shown.lower().partition("e")[0].partition(".")[2]
    return abs(float(mine) - float(shown)) <= 1.01 * 10.0 ** -len(digits)


def differences(output, shown):
    """Lines that differ by more than the last digit of a number."""
    mine, theirs = output.rstrip().splitlines(), shown.rstrip().splitlines()
    assert len(mine) == len(theirs), output
    return [
        (ours, other)
        for ours, other in zip(mine, theirs, strict=True)
        if " ".join(NUMBER.sub("#", ours).split()) != " ".join(NUMBER.sub("#", other).split())
        or not all(map(same, NUMBER.findall(ours), NUMBER.findall(other)))
    ]


@pytest.mark.parametrize(
    ("page", "least"),
    [
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
        ("docs/teaching.md", 1),
        ("docs/assemblies.md", 3),
        ("docs/exchange.md", 1),
    ],
)
def test_the_code_of_a_page_prints_what_it_shows(page, least):
    namespace = {"__name__": "readme"}
    done = steps((ROOT / page).read_text("utf-8"))
    assert len(done) >= least
    for code, shown in done:
        output = printed(code, namespace)
        if shown is None:
            assert not output, f"prints, but nothing is shown:\n{output}"
        else:
            assert shown.strip(), code
            assert not differences(output, shown)


def test_the_tour_solves_the_book():
    """The described four-bar is Norton's: his torque and pin forces, with exact masses."""
    namespace = {"__name__": "readme"}
    printed(steps((ROOT / "docs/tutorial/tour.md").read_text("utf-8"))[0][0], namespace)
    run, book = namespace["run"], mbody.kinetostatics(mbody.gallery.load("norton_fourbar"))
    assert run.effort("motor") == pytest.approx(book.effort("motor"), rel=1e-12)
    for joint in ("O2", "A", "B", "O4"):
        assert run.reaction(joint).fx == pytest.approx(book.reaction(joint).fx, rel=1e-12)
        assert run.reaction(joint).fy == pytest.approx(book.reaction(joint).fy, rel=1e-12)


def test_the_readme_is_short():
    assert 100 <= README.read_text("utf-8").count("\n") <= 150


LINK = re.compile(r"\]\((?!http|#|\.\.\.)([^)#\s]+)(?:#[^)]*)?\)")
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


def test_the_comparison_sees_a_difference():
    assert not differences("F 12.3457 1e-16", "F  12.345  3e-17")
    assert differences("F 12.4", "F 12.2")
    assert differences("F 12.4", "G 12.4")


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


def test_the_models_of_the_page_load():
    page = (ROOT / "docs" / "model-files.md").read_text("utf-8")
    first, *_ = [content for language, content in blocks(page) if language == "toml"]
    run = mbody.kinetostatics(mbody.from_toml(first))
    assert run.effort("motor")[0] == pytest.approx(243.23759, rel=1e-4)  # P is rounded there
