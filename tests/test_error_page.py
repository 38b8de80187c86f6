"""docs/errors.md has every sentence of mbody: each is made to happen, none is left out."""

import ast
import re
from collections import Counter
from pathlib import Path

import pytest

from tests.errors import sites
from tests.errors.catalogue import SUBJECTS, everything, scenarios, told
from tests.errors.page import PAGE, page

#: Texts in functions that make errors, which are none of a sentence.
OTHERWISE = {
    "knife edge": "the word of a follower",
    "': no base radii: its follower is not on one guide or pin of the ground, or its cam does "
    "not turn about a fixed centre": "a note",
    "': no pressure angle: the follower cannot move": "a note",
    "': no base circle keeps the pressure angle within ": "of a note",
    " deg: change the guide, the arm or the lift": "of a note",
    " instants no closed contact makes '": "of a note",
    "': there is no ratio there": "of a note",
    "the position that is drawn": "of a note, as those that follow",
    "the diameter of holes": "of a note",
    "lengths are in mm": "a note",
    "wheels are pitch circles, without teeth": "a note",
    "bars are ": "of a note",
    " wide: the model does not say how wide": "of a note",
    "holes without a pin_radius have a diameter of ": "of a note",
    "the cognates have no masses and no loads": "a note",
    " linkages are written": "the status of a data set",
    " bytes, with binaries for ": "what the command has written",
    "mbody: building the binaries of co-simulation units (once) ...": "what the command does",
    "singular start": "the mark of one",
    "stopped: after ": "the status of the solution that the error carries",
    r" \(at (?:line (\d+), column \d+|end of document)\)$": "a pattern",
}
LONGEST = 600

each = pytest.mark.parametrize(
    "scenario",
    [pytest.param(one, id=f"{part.__name__[13:]}: {name}") for part, name, one in scenarios()],
)


@each
def test_every_scenario_ends_in_a_sentence(scenario):
    found = told(scenario)
    text = found.sentence
    assert text == text.strip() and "  " not in text.replace("\n  ", " ")
    assert not re.search(r"Traceback|object at 0x|/tmp|site-packages|\.py\b", text)
    assert re.search(r"([^\s.,;:]|\.\.\.)$", text) and text.isprintable() | ("\n" in text)
    assert "''" not in text.replace("not ''", "").replace("is '',", "")
    assert len(text) <= LONGEST or found.problems
    if found.kind != "ModelError":
        assert found.problems == ()
    if found.element is not None and "\n" not in text:
        name = found.element.partition(".")[0]
        assert name[:20] in text


def names(part):
    """The names of a subject's scenarios as they are written, before the last of a name wins."""
    tree = ast.parse(Path(part.__file__).read_text("utf-8"))
    tables = [
        node.value
        for node in tree.body
        if isinstance(node, ast.Assign) and ast.unparse(node.targets[0]) == "SCENARIOS"
    ]
    assert len(tables) == 1
    for key, value in zip(tables[0].keys, tables[0].values, strict=True):
        if key is None:
            yield from eval(compile(ast.Expression(value), part.__file__, "eval"), vars(part))
        else:
            yield key.value


@pytest.mark.parametrize("part", SUBJECTS, ids=lambda part: part.__name__[13:])
def test_no_scenario_hides_another(part):
    assert not [name for name, count in Counter(names(part)).items() if count > 1]


#: What the processor's rounding decides, and how often each is on the page: how many branches a
#: search met that ends before it is complete, at which step, of very many, the length of steps
#: vanished, and which of many designs, none of which will do, came nearest.
ROUNDED = {
    re.compile(r"^\S+ +the start of 'chain'.*\n +and at least .*\n(?: .*\n)*", re.M): 1,
    re.compile(r"at t = \S+ s the step\s+has"): 1,
    re.compile(r"(?<=nearest is off by )\S+ m at point \d(?=, with a defect of\s+branch)"): 2,
}


def steady(text):
    """The page without what rounding decides."""
    for part, count in ROUNDED.items():
        assert len(part.findall(text)) == count, part.pattern
        text = part.sub("", text)
    return text


def test_the_page_is_current():
    assert steady(PAGE.read_text("utf-8")) == steady(page()), "make errors writes the page anew"


def test_the_page_is_readable():
    text = PAGE.read_text("utf-8")
    assert max(map(len, text.splitlines())) <= 100
    assert all(line == line.rstrip() for line in text.splitlines())


def test_every_place_that_makes_an_error_is_reached():
    """Its sentence is in a message to a user; one that is made and thrown away is no proof."""
    reached = {
        (file, line) for t in everything() for file, line, text in t.made if text in t.sentence
    }
    missing = [
        str(site)
        for site in sites.sites()
        if not any((site.file, line) in reached for line in range(site.first, site.last + 1))
    ]
    assert len(sites.sites()) > 250
    assert not missing, f"no scenario in tests/errors reaches {missing}"


def test_every_piece_of_a_sentence_is_told():
    whole = "\n".join(t.sentence for t in everything())
    missing = [
        f"mbody/{file}:{line} {text!r}"
        for file, line, text in sites.pieces()
        if text.strip() not in whole and text not in OTHERWISE
    ]
    assert not missing, f"no scenario in tests/errors tells {missing}"


def test_what_is_left_out_is_there():
    texts = {text for _, _, text in sites.pieces()}
    assert set(OTHERWISE) <= texts
