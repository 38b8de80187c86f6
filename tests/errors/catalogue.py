"""Scenarios and what comes of them: the error, what it is about, and where in mbody it was made."""

import contextlib
import functools
import importlib
import io
import re
import sys
import warnings
from dataclasses import dataclass
from pathlib import Path
from unittest import mock

from mbody.cli.streams import UsageError
from mbody.edit.places import EditError
from mbody.errors import ModelError, ModelWarning, SolveError
from mbody.quantities import FormulaError
from tests.support.paths import ROOT

PACKAGE = ROOT / "mbody"
#: The files of this folder that have scenarios.
SUBJECTS = tuple(
    importlib.import_module(f"tests.errors.{path.stem}")
    for path in sorted(Path(__file__).parent.glob("*.py"))
    if re.search(r"^SCENARIOS = ", path.read_text("utf-8"), re.MULTILINE)
)
SEPARATOR = " | "
KINDS = (ModelError, SolveError, UsageError, ModelWarning)


@dataclass(frozen=True)
class Told:
    """The message that a user reads.

    Attributes
    ----------
    kind, element, sentence : str
        Name of the class, name of the element or None, the text.
    problems : tuple
        Of a model file.
    made : tuple of (file, line, text)
        Where in mbody errors were made on the way, and what they said.
    """

    kind: str
    element: str | None
    sentence: str
    problems: tuple
    made: tuple

    @property
    def line(self):
        """What SENTENCES has of it, after the name of the scenario."""
        return SEPARATOR.join((self.kind, self.element or "-", self.sentence.replace("\n", "⏎")))


@contextlib.contextmanager
def recorded():
    """What is made of the errors of mbody while the block runs."""
    found = []

    def recording(original):
        def init(self, *arguments, **options):
            original(self, *arguments, **options)
            frame = sys._getframe(1)
            found.append((frame.f_code.co_filename, frame.f_lineno, str(self)))

        return init

    with contextlib.ExitStack() as stack:
        for kind in (*KINDS, FormulaError, EditError):
            stack.enter_context(mock.patch.object(kind, "__init__", recording(kind.__init__)))
        yield found


@functools.cache
def told(scenario):
    """Run a scenario; what it printed is thrown away."""
    nowhere = io.StringIO()
    quiet = contextlib.redirect_stdout(nowhere), contextlib.redirect_stderr(nowhere)
    with quiet[0], quiet[1], recorded() as made, warnings.catch_warnings(record=True) as warned:
        warnings.simplefilter("always")
        try:
            scenario()
        except (ModelError, SolveError, UsageError) as error:
            found = error
        else:
            (found,) = (w.message for w in warned if isinstance(w.message, ModelWarning))
    places = tuple(
        (Path(file).relative_to(PACKAGE).as_posix(), line, text)
        for file, line, text in made
        if Path(file).is_relative_to(PACKAGE)
    )
    element, problems = getattr(found, "element", None), getattr(found, "problems", ())
    return Told(type(found).__name__, element, str(found), problems, places)


@functools.cache
def expected(part):
    """The pattern of each scenario's line in the subject's SENTENCES."""
    lines = (line.partition(SEPARATOR) for line in part.SENTENCES.strip("\n").split("\n"))
    return {name: re.compile(re.escape(line).replace("…", ".*")) for name, _, line in lines}


def everything():
    """The messages of all scenarios."""
    return [told(one) for part in SUBJECTS for one in part.SCENARIOS.values()]
