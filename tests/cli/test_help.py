"""Help: what fits a screen, and that every argument of Python has its option, or a reason."""

import inspect
import re
import shlex
import subprocess
import sys
from importlib import import_module

import pytest

from mbody import cli
from mbody.cli.command import parsed
from mbody.cli.help_pages import documentation, help_of, overview, pairs, text_of
from mbody.cli.parser import verbs
from tests.support.paths import ROOT

VERBS = pytest.mark.parametrize("verb", verbs().values(), ids=list(verbs()))


def fits(text):
    lines = text.splitlines()
    return len(lines) <= 40 and max(map(len, lines)) <= 100


def test_all_verbs_fit_a_screen():
    text = overview()
    assert fits(text)
    words = re.findall(r"[a-z]+", text)
    assert all(words.count(name) for name in verbs())


@VERBS
def test_a_verb_fits_a_screen_and_says_every_option(verb, monkeypatch):
    monkeypatch.setenv("COLUMNS", "140")
    text = help_of(verb)
    assert fits(text)
    for option in verb.options:
        assert text_of(option, verb), option.names
        assert re.search(rf"(^|[ ,]){re.escape(option.names[-1])}\b", text) or option.value in text


@VERBS
def test_every_argument_of_python_has_an_option_or_a_reason(verb):
    """And what stands for arguments of Python is one of them."""
    known = set()
    for path, name, options, reason in pairs(verb):
        assert options or reason, f"{path}({name}=) has no option in `mbody {verb.name}`"
        known.add(name)
    for option in verb.options:
        own = option.settings.get("dest", option.names[0])
        if not option.title and option.python != (own,):
            assert known.intersection(option.python), option.names


@VERBS
def test_examples_are_understood(verb, capsys):
    for example in verb.examples:
        found = parsed(shlex.split(example.partition(" > ")[0]))
        assert found.command == verb.name and found.answer == verb.answer


def test_signatures_are_those_that_python_sees():
    """What is read of sources is what `inspect` says of the functions."""
    for path in {path for verb in verbs().values() for path in verb.functions}:
        module, _, name = path.rpartition(".")
        if module.rpartition(".")[2][:1].isupper():
            module, _, owner = module.rpartition(".")
            function = getattr(getattr(import_module(f"mbody.{module}"), owner), name)
        else:
            function = getattr(import_module(f"mbody.{module}"), name)
        assert set(documentation(path).defaults) == set(inspect.signature(function).parameters), (
            path
        )


@pytest.mark.parametrize("words", [["sweep", "-h"], ["sweep", "x", "--help"], ["help", "sweep"]])
def test_help_of_a_verb(words, capsys):
    assert cli.main(words) == 0
    assert capsys.readouterr().out.startswith("usage: mbody sweep MODEL [options]\n")


def test_help_loads_nothing_that_computes():
    code = (
        "import sys; from mbody.cli import main; main(['sweep', '--help']);"
        "print(*sys.modules, file=sys.stderr)"
    )
    done = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True)
    loaded = done.stderr.split()
    heavy = ("numpy", "mbody.sweeps", "mbody.analysis", "mbody.model")
    assert "mbody.cli.help_pages" in loaded and not [name for name in loaded if name in heavy]
