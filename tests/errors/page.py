"""The page of all sentences: docs/errors.md."""

import textwrap
from pathlib import Path

from tests.errors.catalogue import KINDS, SUBJECTS, told

PAGE = Path(__file__).parents[2] / "docs" / "errors.md"
WIDTH = 100
LONGEST = 20  # of a name
MOST = 5  # problems of one file
OPENING = """\
# Errors

Errors are sentences: what happened, to which element, with which number and unit, what to try. This
page has all of them, as they really happened: `make errors` runs a scenario for each and writes the
page, and a test does the same.

* `ModelError`, a `ValueError`: what was described or asked cannot be; raised by describing,
  assembling and asking. `SolveError`, a `RuntimeError`: an analysis could not give what was asked;
  `error.solution` is what was computed before, or None. `ModelWarning`, a `UserWarning`: the answer
  is good, but may not be what was meant.
* `error.element` is the name of the body, joint, driver, load, parameter or changed number that the
  sentence is about, or None. It stands before the sentences below.
* A model file is checked as a whole: `error.problems` holds (line, field, message) of everything
  that is wrong with it, and the text has a line of each.
* The command prints `mbody: ` and the sentence to stderr and ends with the status 1 for a
  `SolveError`, 2 for a `ModelError` or a `UsageError`, which is a command line that was not
  understood. With `--json` it prints data to stdout instead:

```json
{"error": {"kind": "ModelError", "element": "arm", "message": "…",
           "problems": [{"line": 2, "field": "bodies.arm.mass", "message": "…"}]}}
```
"""


def page():
    """The text of the page."""
    parts = [OPENING]
    for subject in SUBJECTS:
        parts.append(f"## {subject.__doc__.splitlines()[0].rstrip('.')}\n")
        found = dict.fromkeys(told(one) for one in subject.SCENARIOS.values())
        for kind in (kind.__name__ for kind in KINDS):
            entries = dict.fromkeys((t.element, t.sentence) for t in found if t.kind == kind)
            if entries:
                parts.append(f"`{kind}`\n")
                parts.append(f"```text\n{block(list(entries))}\n```\n")
    return "\n".join(parts)


def block(entries):
    """Two columns: the element and the sentence."""
    wide = max(len(element or "") for element, _ in entries)
    wide = min(wide, LONGEST) + 2 if wide else 0
    lines = []
    for element, sentence in entries:
        head, *rest = sentence.split("\n")
        name = element or ""
        name = name if len(name) <= LONGEST else f"{name[: LONGEST - 1]}…"
        lines += wrapped(head, f"{name:{wide}}", " " * (wide + 2))
        if len(rest) > MOST:
            rest = [*rest[:2], "…", rest[-1]]
        for line in rest:
            lines += wrapped(line.strip(), " " * (wide + 2), " " * (wide + 4))
    return "\n".join(lines)


def wrapped(text, first, then):
    return textwrap.wrap(
        text,
        WIDTH,
        initial_indent=first,
        subsequent_indent=then,
        break_long_words=False,
        break_on_hyphens=False,
    )
