"""The function `report`: the engineer's document of a mechanism, in four formats."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from mbody.errors import ModelError, brief
from mbody.files.model import ReportSettings, report_settings
from mbody.files.tables import writing
from mbody.model.mechanism import Mechanism
from mbody.model.simulation import Instants
from mbody.reports.chapters import SECTIONS, check_sections, document
from mbody.reports.described import ReportDocument, Subject, run_of
from mbody.reports.writers import check_typst, html_page, latex, markdown, pdf
from mbody.solution.doubts import Doubt
from mbody.solution.histories import check_forces, whole_instant
from mbody.solution.solution import Solution
from mbody.views.free_bodies import force_peak
from mbody.views.labels import content_of
from mbody.views.plotting import curve_of

FORMATS = (".html", ".md", ".tex", ".pdf")


@dataclass(frozen=True, repr=False)
class MechanismReport:
    """A report, to be saved or shown in a notebook.

    `document`: Its chapters as plain blocks.
    `run`: The result that it shows.
    """

    document: ReportDocument
    run: Solution

    def __repr__(self) -> str:
        count = len(self.document.chapters)
        return f"MechanismReport({self.document.title!r}: {count} chapters, {self.status})"

    @property
    def status(self) -> str:
        """That of the result."""
        return self.run.status

    @property
    def doubts(self) -> tuple[Doubt, ...]:
        """Those of the result."""
        return self.run.doubts

    @property
    def notes(self) -> tuple[str, ...]:
        """Those of the result."""
        return self.run.notes

    def html(self) -> str:
        """The page as text."""
        return html_page(self.document)

    def save(self, path: str | os.PathLike[str]) -> list[str]:
        """Write the report, in the format by the ending of the file.

        Parameters
        ----------
        path : str or path-like
            Ends in .html (one file), .md or .tex (with a folder of pictures beside it), or .pdf
            (needs the package typst). A file that exists is replaced.

        Returns
        -------
        list of str
            The files that were written, the report first.

        Raises
        ------
        ModelError
            For another ending, a place where no file can be written, or without typst.
        """
        ending = check_format(path)
        if ending == ".pdf":
            whole = pdf(self.document)
            with writing(path, binary=True) as file:
                file.write(whole)
            return [str(path)]
        if ending == ".html":
            with writing(path) as file:
                file.write(self.html())
            return [str(path)]
        own = Path(path)
        folder = own.with_name(f"{own.stem}_figures")
        write, kind = (markdown, "svg") if ending == ".md" else (latex, "pdf")
        with writing(path) as file:
            file.write(write(self.document, folder.name))
        files = [str(path)]
        try:
            folder.mkdir(exist_ok=True)
        except OSError as error:
            raise ModelError(
                f"cannot make the folder '{folder}' for the pictures ({error.strerror}): choose "
                "another name for the report"
            ) from None
        for picture in self.document.pictures:
            files.append(str(folder / f"{picture.name}.{kind}"))
            with writing(files[-1], binary=True) as file:
                file.write(content_of(picture.figure, kind))
        return files

    def _repr_html_(self) -> str:
        """The page in a frame of a notebook."""
        import html

        page = html.escape(self.html(), quote=True)
        look = "width:100%;height:720px;border:1px solid #c8d0d8"
        return f'<iframe srcdoc="{page}" style="{look}" title="report"></iframe>'


def check_format(path: Any) -> str:
    """The ending of a report's file.

    >>> check_format("pump.HTML")
    '.html'
    """
    try:
        ending = Path(path).suffix.lower()
    except TypeError:
        raise ModelError(f"a path must be text or path-like, not {path!r}") from None
    if ending not in FORMATS:
        raise ModelError(
            f"cannot write '{path}': a report is a file that ends in .html, .md, .tex or .pdf"
        )
    if ending == ".pdf":
        check_typst()
    return ending


def report(
    model: Mechanism | Solution,
    sections: Sequence[str] = (),
    *,
    without: Sequence[str] = (),
    at: Instants | None = None,
    to: Any = None,
    instants: Sequence[int] = (),
    title: str = "",
    author: str = "",
    plots: Sequence[str] = (),
    polar: Sequence[str] = (),
    against: str | Sequence[str] | None = None,
    compare: Mechanism | Solution | None = None,
    labels: Sequence[str] = ("this design", "other design"),
    command: str = "",
    assembly: str | int | None = None,
) -> MechanismReport:
    """The engineer's document of a mechanism: sketch, inputs, method, forces, checks, and more.

    Parameters
    ----------
    model : Mechanism or Solution
        A mechanism is analysed: its free motion where it has a table [simulate], else kinetostatics
        over its cycle.
    sections : list of str
        What it contains, in this order; by default what the model's table [report] says, else all
        of `mbody.reports.chapters.SECTIONS`.
    without : list of str
        Sections that are left out.
    at : Instants, optional
        The instants to analyse, by default those of the model.
    to : float or str, optional
        Until when free motion is followed.
    instants : list of int
        Instants of the result at which free-body diagrams are drawn; by default those that the
        model asks for, else that of the greatest joint force.
    title, author : str
        Of the document.
    plots, polar : list of str
        Quantities that are plotted, and joints whose forces are drawn as vectors.
    against : str or list of str, optional
        Engines of the cross-check, as of `crosscheck`.
    compare : Mechanism or Solution, optional
        Another design, which is analysed as this one; a chapter compares both.
    labels : pair of str
        What the two designs are called there.
    command : str
        That repeats the report.
    assembly : str or int, optional
        The assembly mode at the first instant, by its name or number, as of `kinetostatics`.

    Returns
    -------
    MechanismReport

    Raises
    ------
    ModelError
        For a section or a quantity that there is not, a model without anything to report, a result
        without forces, a batch; where matplotlib is not installed.
    SolveError
        As of the analysis.

    Examples
    --------
    >>> import mbody
    >>> made = report(mbody.makers.four_bar(1, 3, 2, 3.5, masses=(1, 1, 1)), ["joints", "checks"])
    >>> [chapter.title for chapter in made.document.chapters]
    ['Joints', 'Checks']
    """
    mechanism = model.mechanism if isinstance(model, Solution) else model
    kept = report_settings(mechanism) if isinstance(mechanism, Mechanism) else None
    own = kept or ReportSettings()
    chosen = check_sections(sections or own.sections or tuple(SECTIONS))
    left_out = check_sections(without or (() if sections else own.without))
    run, marked = _analysed(model, at, to, assembly)
    if instants:
        marked = [whole_instant(run, k) for k in instants]
    subject = Subject(
        run,
        marked,
        mechanism,
        plots=tuple(plots or own.plots),
        polar=tuple(polar or own.polar),
        against=against,
        command=command,
    )
    if compare is not None:
        second, at_second = _analysed(compare, at, to, assembly)
        described = compare.mechanism if isinstance(compare, Solution) else compare
        subject.label, other = labels
        subject.other = Subject(second, at_second, described, label=other)
    for name in subject.plots:
        curve_of(run, name)  # refused before anything is drawn
    names = [name for name in chosen if name not in left_out]
    made = document(subject, names, title or own.title, author or own.author)
    return MechanismReport(made, run)


def _analysed(
    model: Mechanism | Solution, at: Instants | None, to: Any, assembly: str | int | None
) -> tuple[Solution, list[int]]:
    """The result of a design, and the instants at which its links are drawn alone."""
    if isinstance(model, Solution):
        check_forces(model, "reports")
        if assembly is not None:
            raise ModelError(
                "a result has its assembly mode already: give the mechanism, or leave assembly out"
            )
        return model, [force_peak(model)]
    if not isinstance(model, Mechanism):
        raise ModelError(
            f"a report is of a mechanism or of what an analysis found, not of {brief(model)}"
        )
    return run_of(model, at, to, assembly)
