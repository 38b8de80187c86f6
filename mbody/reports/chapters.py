"""The template of a report: its chapters in order, each made by one function."""

from __future__ import annotations

import difflib
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

from mbody._version import __version__
from mbody.errors import ModelError, brief
from mbody.reports.balances import energy, shaking
from mbody.reports.blocks import Block, Chapter, ReportDocument
from mbody.reports.described import inputs, method, mobility, sketch
from mbody.reports.evidence import checks, opinions, references, repeat
from mbody.reports.figures import freebody, plots, polar
from mbody.reports.peaks import joints, links, loads, summary
from mbody.reports.rubbing import friction
from mbody.reports.two_designs import comparison

if TYPE_CHECKING:
    from mbody.reports.subject import Subject

__all__ = ["SECTIONS", "check_sections", "document"]

#: Every section by the name by which it is chosen: its title, and what makes it.
SECTIONS: dict[str, tuple[str, Callable[[Subject], list[Block]]]] = {
    "summary": ("Summary", summary),
    "comparison": ("Two designs", comparison),
    "sketch": ("Mechanism", sketch),
    "inputs": ("Inputs", inputs),
    "method": ("Assumptions and method", method),
    "mobility": ("Mobility and uniqueness", mobility),
    "links": ("Links", links),
    "joints": ("Joints", joints),
    "loads": ("Efforts and measures", loads),
    "plots": ("Over the cycle", plots),
    "polar": ("Forces as vectors", polar),
    "freebody": ("Free-body diagrams", freebody),
    "energy": ("Energy", energy),
    "friction": ("Friction", friction),
    "shaking": ("Shaking force", shaking),
    "checks": ("Checks", checks),
    "opinions": ("Second opinion", opinions),
    "references": ("References", references),
    "repeat": ("To repeat this report", repeat),
}


def check_sections(names: Sequence[str]) -> tuple[str, ...]:
    """The sections of a report, each once, in the given order.

    Raises
    ------
    ModelError
        For one that there is not.

    >>> check_sections(["sketch", "joints", "sketch"])
    ('sketch', 'joints')
    """
    for name in names:
        if name not in SECTIONS:
            close = difflib.get_close_matches(str(name)[:40], SECTIONS, 1)
            hint = f"did you mean '{close[0]}'? " if close else ""
            raise ModelError(
                f"a report has no section {brief(name)}: {hint}there are {', '.join(SECTIONS)}"
            )
    return tuple(dict.fromkeys(names))


def document(subject: Subject, names: Sequence[str], title: str, author: str) -> ReportDocument:
    """The document of a subject, chapters without content left out."""
    run, chapters = subject.run, []
    for name in names:
        heading, make = SECTIONS[name]
        if name == "plots":
            heading = f"Over the {subject.course}"
        blocks = make(subject)
        if blocks:
            chapters.append(Chapter(name, heading, blocks))
    lines = [("analysis", f"{run.analysis}, {len(run)} instant{'s' * subject.many}")]
    lines += [("by", author)] if author else []
    lines.append(("program", f"mbody {__version__}"))
    if subject.text:
        lines.append(("model, SHA-256", f"`{subject.digest[:16]}…`"))
    lines.append(("status", run.status))
    return ReportDocument(title or subject.mechanism.name, lines, chapters)
