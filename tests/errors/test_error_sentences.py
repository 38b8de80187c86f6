"""Every sentence of mbody is made to happen, says what it should, and none is left out."""

import ast
import re
from collections import Counter
from pathlib import Path

import pytest

from tests.errors import sites
from tests.errors.catalogue import SUBJECTS, everything, expected, told

#: Texts in functions that make errors, which are none of a sentence.
OTHERWISE = {
    "not mirrored are ": "a remark of an edit that is made",
    ": add them": "of that remark",
    "the command ended without a word": "of an export that is killed",
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
    " linkages are written": "the status of a data set",
    " bytes, with binaries for ": "what the command has written",
    "' came to ": "of a note",
    ", not to ": "of a note",
    ": its joints and parameters let it no nearer": "of a note",
    "singular start": "the mark of one",
    "no optimum:": "the head of what the command prints",
    "none of the numbers changes '": "of a note",
    "' changes neither the aim nor a limit where searches began: that its value is best is not "
    "shown": "of a note",
    " strike and open by turns": "of tests.campaign.test_scenes",
    "take less restitution there, or the method 'moreau'": "the same",
    "stopped: after ": "the status of the solution that the error carries",
    r"argument (?:\S+/)?(\S+): (takes .*)": "a pattern",
    "the following arguments are required: (.*)": "a pattern",
    r" \(at (?:line (\d+), column \d+|end of document)\)$": "a pattern",
}
LONGEST = 600

subjects = pytest.mark.parametrize("part", SUBJECTS, ids=lambda part: part.__name__[13:])


@subjects
def test_every_scenario_says_its_sentence(part):
    """A wrong line is printed as it should stand in the subject's SENTENCES."""
    assert list(part.SCENARIOS) == list(expected(part))
    wrong = [
        f"{name} | {told(scenario).line}"
        for name, scenario in part.SCENARIOS.items()
        if not expected(part)[name].fullmatch(told(scenario).line)
    ]
    assert not wrong, "\n".join(wrong)


@pytest.mark.slow
@subjects
def test_sentences_are_sentences(part):
    """One name of an element, no traces of the program, no longer than one reads."""
    for name, scenario in part.SCENARIOS.items():
        found = told(scenario)
        text = found.sentence
        assert text == text.strip() and "  " not in text.replace("\n  ", " "), name
        assert not re.search(r"Traceback|object at 0x|/tmp|site-packages|\.py\b", text), name
        assert re.search(r"([^\s.,;:]|\.\.\.)$", text) and text.isprintable() | ("\n" in text), name
        assert "''" not in text.replace("not ''", "").replace("is '',", ""), name
        assert len(text) <= LONGEST or found.problems, name
        if found.kind != "ModelError":
            assert found.problems == (), name
        if found.element is not None and "\n" not in text:
            element = found.element.partition(".")[0]
            assert element[:20] in text, name


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


@subjects
def test_no_scenario_hides_another(part):
    assert not [name for name, count in Counter(names(part)).items() if count > 1]


@pytest.mark.slow
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


@pytest.mark.slow
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
