"""Pages that can be followed: their files are written, their commands and programs run.

In a page of the site

* a block whose first line is ``# NAME``, with the ending of a model or a table, is that file;
* a ``sh`` block is run line by line in the folder of these files, where a line begins with
  ``mbody``; of other commands (make, git, python3) none may stand before an output;
* a ``python`` block is run in the one namespace of the page;
* a ``text`` block right below is what these print; a line ``…`` stands for lines that are left out.
"""

import contextlib
import io
import re
import shlex
from itertools import pairwise
from pathlib import Path

from mbody.cli import main
from tests.support.paths import ROOT

DOCS = ROOT / "docs"
#: Endings of files that a page may hold; a table has no colours, so that its block is `text`.
FILES = ("toml", "json", "csv")
LEFT_OUT = "…"


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
        exec(compile(code, "page", "exec"), namespace)
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


def follow(text, folder):
    """Do what a page says, in an empty folder: what it shows of it must be so. Returns how many
    outputs were compared."""
    namespace, compared = {"__name__": "page"}, 0
    with contextlib.chdir(folder):
        for (language, content), (kind, shown) in pairwise([*blocks(text), ("", "")]):
            head = content.partition("\n")[0]
            if head.startswith("# ") and head.endswith(tuple(f".{end}" for end in FILES)):
                Path(head[2:]).write_text(content, "utf-8")
                continue
            if language == "python":
                output = printed(content, namespace)
            elif language == "sh":
                output = "".join(map(said, commands(content)))
                if kind != "text":
                    continue
            else:
                continue
            if kind == "text":
                assert shown.strip(), content
                assert not missing_lines(output, shown), output
                compared += 1
            else:
                assert not output, f"prints, but nothing is shown:\n{output}"
    return compared


def commands(content):
    """The lines of a block that call mbody, without their comments, joined where they go on."""
    lines = content.replace("\\\n", " ").splitlines()
    return [line for line in lines if line.removeprefix(".venv/bin/").startswith("mbody ")]


def said(line):
    """What a command prints; it must succeed, unless its comment says how it ends: `# status 1`."""
    words = shlex.split(line, comments=True)
    with contextlib.redirect_stdout(io.StringIO()) as stream:
        status = main(words[1:])
    expected = int(line.rpartition("# status ")[2]) if "# status " in line else 0
    assert status == expected, line
    return stream.getvalue()


def missing_lines(output, shown):
    """What of the shown lines is not in the output, in this order, but for those left out."""
    parts, rest = [[]], output.rstrip().splitlines()
    for line in shown.rstrip().splitlines():
        if line.strip() == LEFT_OUT:
            parts.append([])
        else:
            parts[-1].append(line)
    if len(parts) == 1:
        return differences(output, shown) if len(rest) == len(parts[0]) else parts[0]
    at = 0
    for number, part in enumerate(parts):
        first = range(at, len(rest) - len(part) + 1)
        if number == 0:
            first = first[:1]
        elif number == len(parts) - 1:
            first = range(max(at, len(rest) - len(part)), len(rest) - len(part) + 1)
        for start in first:
            window = rest[start : start + len(part)]
            if all(map(_same, window, part)):
                at = start + len(part)
                break
        else:
            return part
    return []


def _same(mine, shown):
    """Whether two lines say the same, to the last digit or so."""
    return bool(mine.strip()) == bool(shown.strip()) and not differences(mine, shown)
