"""Reports: the same numbers as the result, in four formats, with what repeats them."""

import hashlib
import re
from html.parser import HTMLParser

import numpy as np
import pytest

import mbody
from mbody import ModelError, cli, from_toml, gallery, kinetostatics, report
from mbody.files.model import in_units, report_settings
from mbody.model.simulation import Instants
from mbody.reports.chapters import SECTIONS
from mbody.reports.described import Grid, Notice, typeset
from mbody.reports.writers import typst_text
from mbody.summaries.text_table import number
from tests.support.cases import first_fast
from tests.support.paths import ROOT

#: What takes seconds: other engines.
QUICK = [name for name in SECTIONS if name != "opinions"]


def grids(made, key):
    (chapter,) = (one for one in made.document.chapters if one.key == key)
    return {block.title: block for block in chapter.blocks if isinstance(block, Grid)}


def column(grid, title):
    return next(list(one.cells) for one in grid.columns if one.title == title)


@pytest.fixture(scope="module")
def pump():
    return report(gallery.load("mud_pump"), QUICK, command="mbody report mud_pump")


class Page(HTMLParser):
    """What a page has: ids, links, tags that are open, addresses."""

    VOID = frozenset({"meta", "link", "br", "img", "path", "use", "rect", "circle"})

    def __init__(self, text):
        super().__init__()
        self.ids, self.links, self.open, self.tags, self.addresses = [], [], [], [], []
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        self.tags.append(tag)
        for name, value in attrs:
            if name == "id":
                self.ids.append(value)
            if name in ("href", "xlink:href", "src"):
                self.links.append(value)
            if name in ("href", "src", "action", "xlink:href") and "//" in str(value):
                self.addresses.append(value)
        if tag not in self.VOID:
            self.open.append(tag)

    def handle_endtag(self, tag):
        if tag not in self.VOID:
            assert self.open.pop() == tag


# -- contents ---------------------------------------------------------------------------------


@first_fast("name", gallery.names(), 12)
def test_every_model_of_the_gallery(name):
    """Quick chapters of each; pictures are made once, in other tests."""
    made = report(
        gallery.load(name),
        [
            "summary",
            "inputs",
            "method",
            "mobility",
            "links",
            "joints",
            "loads",
            "checks",
            "references",
            "repeat",
        ],
    )
    keys = [chapter.key for chapter in made.document.chapters]
    assert keys[:4] == ["summary", "inputs", "method", "mobility"] and keys[-1] == "repeat"
    page = made.html()
    found = Page(page)
    assert not found.open and not found.addresses and "script" not in found.tags
    assert "nan" not in re.sub(r"<[^>]*>", " ", page).lower().split()


def test_the_numbers_are_those_of_the_result(pump):
    run, table = pump.run, grids(pump, "joints")["Forces of the joints"]
    assert len(run) == 361
    for joint, peak, crank in zip(
        column(table, "joint"), column(table, "peak"), column(table, "at crank"), strict=True
    ):
        size = run.reaction(joint).magnitude
        # six digits of the greatest of the column
        assert float(peak) == pytest.approx(size.max(), abs=0.5)
        degrees = np.degrees(run["crank"].angle[int(np.argmax(size))])
        assert float(crank) == pytest.approx(degrees, abs=0.006)
    efforts = grids(pump, "loads")["Efforts and measures"]
    row = column(efforts, "quantity").index("motor, T_{12}")
    effort = run.effort("motor")
    for title, value in (
        ("least", effort.min()),
        ("greatest", effort.max()),
        ("mean", np.trapezoid(effort, run.t) / np.ptp(run.t)),
    ):
        assert float(column(efforts, title)[row]) == pytest.approx(value, rel=1e-5)
    links = grids(pump, "links")["Motion of the links"]
    omega = [abs(float(cell)) for cell in column(links, "peak ω")]
    assert omega == pytest.approx([np.abs(run[b].omega).max() for b in run], abs=1e-4)


def test_balances_by_other_routes(pump):
    run = pump.run
    turning = grids(pump, "energy")["Turning moment of motor"]
    row = column(turning, "quantity").index("work of a cycle")
    work = float(column(turning, "value")[row])
    angle, effort = run["crank"].angle, run.effort("motor")
    assert work == pytest.approx(np.trapezoid(effort, angle), rel=1e-5)
    shaking = grids(pump, "shaking")["On the frame"]
    # the frame of the pump carries weights and what inertia of all links leaves
    mass = [run.system.mass[3 * n, 0] for n in range(5)]
    bodies = [run[b] for b in run]
    fx = sum(-m * b.ax for m, b in zip(mass, bodies, strict=True))
    fy = sum(-m * (b.ay + 386.0886) for m, b in zip(mass, bodies, strict=True))
    assert float(column(shaking, "peak")[0]) == pytest.approx(np.hypot(fx, fy).max(), rel=1e-5)


def test_an_instant_is_marked_in_its_turn():
    machine = gallery.load("norton_fourbar")
    made = report(machine, ["freebody"])
    captions = [one.caption for one in made.document.pictures]
    assert captions[0] == "Link 2, crank: crank at 60°, t = 0 s" and len(captions) == 3
    assert len(made.run) == 361
    named = report(machine, ["freebody"], at=Instants(at={"crank": ["60 deg", "90 deg"]}))
    assert len(named.document.pictures) == 6 and len(named.run) == 2


def test_doubts_are_seen():
    machine = gallery.load("bouncing_ball")
    run = mbody.simulate(machine, times=[0.0])
    from mbody.solution.doubts import Doubt, doubted

    run = doubted(run, [Doubt("energy", "the energy grows by 3 % from t = 1 s on", 1.0)])
    made = report(run, ["summary", "checks"])
    for chapter in made.document.chapters:
        notices = [block for block in chapter.blocks if isinstance(block, Notice)]
        assert [n.kind for n in notices if "the energy grows" in n.text] == ["doubt"]
    assert made.status.startswith("doubtful") and "the energy grows" in made.html()


def test_two_designs(tmp_path):
    first, second = gallery.load("mud_pump"), gallery.load("mud_pump", {"p_d": "100 bar"})
    made = report(first, ["comparison"], compare=second, labels=("150 bar", "100 bar"))
    table = grids(made, "comparison")["Two designs"]
    row = column(table, "quantity").index("peak torque of motor")
    values = [float(column(table, title)[row]) for title in ("150 bar", "100 bar")]
    for machine, value in zip((first, second), values, strict=True):
        effort = kinetostatics(machine, turn=True).effort("motor")
        assert value == pytest.approx(np.abs(effort).max(), rel=1e-5)
    change = 100.0 * (values[1] - values[0]) / values[0]
    assert float(column(table, "change")[row]) == pytest.approx(change, abs=0.06)
    assert [one.name for one in made.document.pictures] == ["comparison"]
    words = ["report", "mud_pump", "--compare", "p_d=100 bar", "--sections", "comparison"]
    assert cli.main([*words, "-o", str(tmp_path / "a.html")]) == 0
    assert "p_d=100 bar" in (tmp_path / "a.html").read_text("utf-8")


def test_it_can_be_repeated(pump):
    (chapter,) = (one for one in pump.document.chapters if one.key == "repeat")
    text = chapter.blocks[-1].text
    rows = grids(pump, "repeat")["What made this report"]
    values = dict(zip(column(rows, ""), column(rows, "value"), strict=True))
    assert values["model, SHA-256"] == hashlib.sha256(text.encode()).hexdigest()
    assert values["command"] == "`mbody report mud_pump`"
    assert values["mbody"] == mbody.__version__
    again = kinetostatics(from_toml(text), turn=True)
    assert np.array_equal(again.effort("motor"), pump.run.effort("motor"))


# -- sections ---------------------------------------------------------------------------------

TABLE = """
[report]
title    = "Pump, first draft"
author   = "A. Engineer"
sections = ["joints", "plots"]
plots    = ["motor.effort"]
"""


def test_the_file_chooses(tmp_path):
    text = gallery.path("norton_fourbar").read_text("utf-8") + TABLE
    machine = from_toml(text)
    made = report(machine)
    assert made.document.title == "Pump, first draft"
    assert ("by", "A. Engineer") in made.document.about
    assert [chapter.key for chapter in made.document.chapters] == ["joints", "plots"]
    assert [one.caption for one in made.document.pictures] == ["Chosen quantities: motor.effort"]
    # flags come before the file
    assert [c.key for c in report(machine, ["links"]).document.chapters] == ["links"]
    left = report(machine, without=["joints"])
    assert [chapter.key for chapter in left.document.chapters] == ["plots"]
    # it is written, read, converted and copied with the model
    again = from_toml(mbody.to_toml(machine))
    assert report_settings(again) == report_settings(machine) is not None
    assert report_settings(in_units(machine, "SI")) == report_settings(machine)
    assert report_settings(machine.copied()) == report_settings(machine)
    assert report_settings(gallery.load("norton_fourbar")) is None


def test_a_wrong_table_is_refused():
    text = gallery.path("norton_fourbar").read_text("utf-8")
    with pytest.raises(ModelError, match="report"):
        from_toml(text + "\n[report]\nsection = ['joints']\n")
    with pytest.raises(ModelError, match="did you mean 'joints'"):
        report(from_toml(text + "\n[report]\nsections = ['joint']\n"))


# -- formats ----------------------------------------------------------------------------------


def test_the_page_is_whole(pump):
    text = pump.html()
    page = Page(text)
    assert not page.open and len(page.ids) == len(set(page.ids))
    assert not page.addresses and not {"script", "img", "link", "iframe"} & set(page.tags)
    local = [link[1:] for link in page.links if link.startswith("#")]
    assert set(local) <= set(page.ids)
    assert {chapter.key for chapter in pump.document.chapters} <= set(local)
    assert text.count('role="img" aria-label="') == len(pump.document.pictures) > 9
    assert text.count("<caption>") == text.count("<table ") > 8
    # its colours follow the page
    assert "#26323f" not in text.split("</style>")[1]
    assert "prefers-color-scheme:dark" in text and "@media print" in text
    assert re.search(r"<html lang=\"en\">", text) and len(text) < 1_500_000


@pytest.mark.slow
def test_files_are_the_same_every_time(tmp_path):
    for ending in (".html", ".md", ".tex"):
        first, second = (
            report(gallery.load("slider_crank"), ["sketch", "joints", "plots"]) for _ in range(2)
        )
        files = first.save(tmp_path / f"a{ending}")
        kept = [(tmp_path / file).read_bytes() for file in files]
        second.save(tmp_path / f"a{ending}")
        assert kept == [(tmp_path / file).read_bytes() for file in files]


def test_markdown_names_its_pictures(pump, tmp_path):
    files = pump.save(tmp_path / "pump.md")
    text = (tmp_path / "pump.md").read_text("utf-8")
    named = re.findall(r"!\[[^\]]*\]\(([^)]+)\)", text)
    assert sorted(files[1:]) == sorted(str(tmp_path / name) for name in named)
    assert all((tmp_path / name).exists() for name in named)
    for block in re.findall(r"(?:^\|.*\n)+", text, re.M):
        widths = {len(re.findall(r"(?<!\\)\|", line)) for line in block.splitlines()}
        assert len(widths) == 1, block


def test_latex_is_balanced(pump, tmp_path):
    files = pump.save(tmp_path / "pump.tex")
    text = (tmp_path / "pump.tex").read_text("utf-8")
    assert [f for f in files[1:] if not f.endswith(".pdf")] == []
    stack = []
    for kind, name in re.findall(r"\\(begin|end)\{(\w+)\}", text):
        if kind == "begin":
            stack.append(name)
        else:
            assert stack.pop() == name
    assert not stack
    bare = re.sub(r"\\[{}\\]", "", text)
    assert bare.count("{") == bare.count("}")
    # every sign is one that a plain LaTeX knows
    assert not {sign for sign in text if ord(sign) > 255}
    for table in re.findall(r"\\toprule\n(.*?)\\bottomrule", text, re.DOTALL):
        rows = [row for row in table.split(r" \\") if row.strip() and "endhead" not in row]
        assert len({len(re.findall(r"(?<!\\)&", row)) for row in rows}) == 1, table


def test_a_pdf_by_typst(pump, tmp_path):
    pytest.importorskip("typst")
    pump.save(tmp_path / "pump.pdf")
    assert (tmp_path / "pump.pdf").read_bytes().startswith(b"%PDF")


def test_the_text_for_typst_is_balanced(pump):
    text = re.sub(r"\\.", "", re.sub(r'"(?:[^"\\]|\\.)*"', '""', typst_text(pump.document)))
    for begin, end in ("[]", "()", "{}"):
        assert text.count(begin) == text.count(end)
    assert text.count("#grid-table(") == sum(
        isinstance(block, Grid) for c in pump.document.chapters for block in c.blocks
    )


def test_numbers_are_typeset():
    for value in (-1.5e-9, 4.75354e6, -12.0, 0.0, 3.25):
        shown = typeset(number(value)).replace("−", "-")
        base, _, power = shown.partition("·10")
        lowered = power.translate(str.maketrans("⁻⁰¹²³⁴⁵⁶⁷⁸⁹", "-0123456789"))
        assert float(base) * 10.0 ** float(lowered or 0) == pytest.approx(value, rel=1e-5)


# -- the page about reports -------------------------------------------------------------------


def test_the_page_has_every_section_and_runs(tmp_path, monkeypatch):
    text = (ROOT / "docs" / "reports.md").read_text("utf-8")
    assert re.findall(r"^\| `(\w+)` \|", text, re.M) == list(SECTIONS)
    table = re.search(r"```toml\n(.*?)```", text, re.DOTALL)[1]
    machine = from_toml(gallery.path("mud_pump").read_text("utf-8") + table)
    assert report_settings(machine).plots == ("motor.effort [kN*m]", "O.force [kN]")
    assert report(machine, ["plots"]).document.pictures
    monkeypatch.chdir(tmp_path)
    for block in re.findall(r"```python\n(.*?)```", text, re.DOTALL):
        exec(compile(block, "docs/reports.md", "exec"), {})
    assert (tmp_path / "norton.html").exists()
