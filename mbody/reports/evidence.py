"""Chapters of evidence: checks, second opinions, references, and what repeats the report."""

from __future__ import annotations

import platform
from typing import TYPE_CHECKING

from mbody._version import __version__
from mbody.engines.opinion import Opinion
from mbody.errors import ModelError, SolveError
from mbody.reports.blocks import Block, Cells, FileText, Grid, Items, Notice, Text
from mbody.sheets.text_table import number

if TYPE_CHECKING:
    from mbody.reports.subject import Subject

__all__ = ["checks", "opinions", "references", "repeat"]

#: Quantities of an engine that are listed, those of the greatest difference first.
WORST = 3

ABOUT = {
    "balance": "sums forces and power over the whole mechanism",
    "oracle": "solves the textbook's dense equations of every link, without code of ours in common",
    "pinocchio": "Pinocchio, rigid-body dynamics of robots",
    "pymunk": "Pymunk, a physics engine of games, of low order",
    "mujoco": "MuJoCo, with soft constraints",
}

BOOKS = (
    "P. E. Nikravesh, Computer-Aided Analysis of Mechanical Systems, Prentice Hall 1988: "
    "coordinates, constraints, Lagrange multipliers.",
    "E. J. Haug, Computer-Aided Kinematics and Dynamics of Mechanical Systems, Allyn and Bacon "
    "1989: redundant constraints and singular positions.",
    "R. L. Norton, Design of Machinery, McGraw-Hill: notation F_{ij}, inverse dynamics, shaking "
    "forces.",
)
OF_MOTION = (
    "E. Hairer, S. P. Nørsett and G. Wanner, Solving Ordinary Differential Equations I and II, "
    "Springer: the integrators."
)


def checks(subject: Subject) -> list[Block]:
    """Residuals by routes that the analysis did not take; status, doubts and notes."""
    run = subject.run
    found = run.checks
    rows = [("closure of the joints, as a part of the model's length", found.constraint)]
    if run.has_forces:
        rows.append(("equilibrium of every link, of the greatest force", found.equilibrium))
        rows.append(("virtual work, of the greatest power", found.virtual_work))
    if found.energy is not None:
        rows.append(("balance of energy, of the greatest energy", found.energy))
    columns = [
        Cells("residual", [row[0] for row in rows], text=True),
        Cells("greatest of all instants", [f"{v:.1e}" if v else "0" for _, v in rows]),
    ]
    blocks: list[Block] = [Text(f"Status: **{run.status}**."), Grid("Residuals", columns)]
    if found.branch is not None:
        blocks.append(
            Text(
                "The least distance from a position at which branches meet was "
                f"{found.branch.least:.2g} (0 where they meet), at t = {number(found.branch.t)} "
                f"{subject.unit('time')}."
            )
        )
    messages = {doubt.message for doubt in run.doubts}
    blocks += [Notice("doubt", doubt.message) for doubt in run.doubts]
    blocks += [Notice("note", note) for note in run.notes if note not in messages]
    return blocks


def opinions(subject: Subject) -> list[Block]:
    """What other engines find, each with a verdict in words."""
    try:
        found = subject.opinions
    except (ModelError, SolveError) as error:
        return [Notice("note", f"There is no second opinion: {error}")]
    blocks: list[Block] = [
        Text(
            f"The same mechanism was given to other engines, at {_instants(subject)}. A difference "
            "is expected where an engine is of low order or models a joint as soft; each quantity "
            "has its own limit."
        )
    ]
    names, versions, verdicts, worst = [], [], [], []
    for name, opinion in found.opinions.items():
        names.append(name)
        versions.append(ABOUT.get(name, opinion.engine))
        verdicts.append(_verdict(opinion))
        row = max(opinion.rows, key=lambda one: one.difference, default=None)
        worst.append(f"{row.difference:.1e} ({row.quantity})" if row is not None else "")
    columns = [
        Cells("engine", names, text=True),
        Cells("what it is", versions, text=True),
        Cells("verdict", verdicts, text=True),
        Cells("greatest difference", worst, text=True),
    ]
    blocks.append(Grid("Second opinions", columns))
    differ = [name for name, opinion in found.opinions.items() if not opinion.agrees]
    spoken = [name for name, opinion in found.opinions.items() if opinion.rows]
    if differ:
        blocks.append(Notice("doubt", f"{', '.join(differ)} differ from mbody: see their rows."))
    elif spoken:
        every = f"All {len(spoken)} engines agree" if len(spoken) > 1 else f"{spoken[0]} agrees"
        blocks.append(Notice("good", f"{every} with mbody in every quantity that they can model."))
    blocks.append(_rows(found.opinions))
    absent = [
        f"{name}: {one.element}: {one.why}"
        for name, opinion in found.opinions.items()
        for one in opinion.not_expressible
    ]
    if absent:
        blocks += [Text("Not checked:"), Items(absent[:20])]
    how = [
        note if note.startswith(name) else f"{name}: {note}"
        for name, opinion in found.opinions.items()
        for note in opinion.notes
    ]
    if how:
        blocks += [Text("How they were compared, and at which instants:"), Items(how)]
    return blocks


def _instants(subject: Subject) -> str:
    """At how many of its instants."""
    count, whole = len(subject.compared), len(subject.run)
    if count == whole:
        return "one instant" if whole == 1 else f"all {whole} instants"
    return f"{count} of the {whole} instants"


def _verdict(opinion: Opinion) -> str:
    if not opinion.rows:
        return "cannot model it"
    differ = sum(row.verdict != "agrees" for row in opinion.rows)
    if differ:
        return f"differs in {differ} of {len(opinion.rows)} quantities"
    return f"agrees in all {len(opinion.rows)} quantities"


def _rows(found: object) -> Grid:
    """The quantities that differ most, of every engine."""
    rows = []
    for name, opinion in found.items():  # type: ignore[attr-defined]  # a mapping
        ordered = sorted(
            opinion.rows,
            key=lambda row: row.difference / row.expected if row.expected else float("inf"),
            reverse=True,
        )
        rows += [(name, row) for row in ordered[:WORST]]
    columns = [
        Cells("engine", [name for name, _ in rows], text=True),
        Cells("quantity", [row.quantity for _, row in rows], text=True),
        Cells("mbody", [number(row.ours) for _, row in rows]),
        Cells("theirs", [number(row.theirs) for _, row in rows]),
        Cells("difference", [f"{row.difference:.1e}" for _, row in rows]),
        Cells("expected", [f"{row.expected:.1e}" for _, row in rows]),
        Cells("verdict", [row.verdict for _, row in rows], text=True),
    ]
    return Grid("The nearest to their limits", columns)


def references(subject: Subject) -> list[Block]:
    """Where the model comes from, and the books of the method."""
    books = [*BOOKS, OF_MOTION] if subject.run.analysis == "simulate" else list(BOOKS)
    source = subject.mechanism.source
    return [Items([f"Model: {source}.", *books] if source else books)]


def repeat(subject: Subject) -> list[Block]:
    """Version, digest and command, and the whole model."""
    rows = [
        ("mbody", __version__),
        ("Python", platform.python_version()),
        ("instants", str(len(subject.run))),
        ("model, SHA-256", subject.digest if subject.text else ""),
    ]
    if subject.command:
        rows.append(("command", f"`{subject.command}`"))
    rows = [row for row in rows if row[1]]
    columns = [
        Cells("", [name for name, _ in rows], text=True),
        Cells("value", [value for _, value in rows], text=True),
    ]
    blocks: list[Block] = [Grid("What made this report", columns)]
    if subject.text:
        blocks.append(
            Text("The model, whose text below has this digest: save it as a file to repeat all.")
        )
        blocks.append(FileText("model.toml", subject.text, "toml"))
    else:
        blocks.append(Notice("note", f"The model is no file: {subject.failed.get('text', '')}"))
    return blocks
