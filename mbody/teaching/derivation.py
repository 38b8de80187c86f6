"""The equations of a mechanism at one instant: in symbols, then with numbers."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from mbody.errors import ModelError
from mbody.reports.blocks import (
    Block,
    Cells,
    Chapter,
    DisplayedEquations,
    Grid,
    Notice,
    ReportDocument,
    Text,
)
from mbody.reports.latex import latex
from mbody.reports.markdown import markdown
from mbody.sheets.names import REDUNDANT, ROUNDING, force_floor, swiftness
from mbody.sheets.text_table import number
from mbody.solution.checks import one_design, whole_instant
from mbody.solution.doubts import Inherited, inherited
from mbody.solution.solution import as_solution
from mbody.teaching.link_equations import LinkEquations, link_equations
from mbody.teaching.loop_equations import LoopEquations, loop_equations, vector_symbols
from mbody.teaching.notation import Equation, Line, Symbol
from mbody.teaching.plain_text import plain_text
from mbody.teaching.rate_conditions import Condition, conditions
from mbody.teaching.vector_loops import LoopVector, vector_loops

if TYPE_CHECKING:
    from mbody.solution.solution import Solution

__all__ = ["FORMS", "Derivation", "derivation", "derivation_as"]

#: What a derivation is written as.
FORMS = ("text", "markdown", "latex")
#: Labels before equations, in text and LaTeX.
_LABELS = {
    "x": ("x: ", r"x:\quad "),
    "y": ("y: ", r"y:\quad "),
    "ΣFx": ("ΣFx: ", r"\Sigma F_x:\quad "),
    "ΣFy": ("ΣFy: ", r"\Sigma F_y:\quad "),
    "ΣM": ("ΣM:  ", r"\Sigma M:\quad "),
    "rates": ("rates: ", r"\mathrm{rates:}\quad "),
    "accelerations": ("accelerations: ", r"\mathrm{accelerations:}\quad "),
}


@dataclass(frozen=True, kw_only=True, eq=False)
class Derivation(Inherited):
    """The equations of a mechanism at one instant, in symbols and with numbers.

    Attributes
    ----------
    loops : tuple of LoopEquations
        Of every closed chain: Σ r e^{iθ} = 0 and its derivatives.
    conditions : tuple of Condition
        Of gears, wheels, cams, couplings.
    links : tuple of LinkEquations
        Newton's and Euler's equations of every body; none where the analysis found no forces.
    gap : float
        The greatest residual of loops and conditions as a part of the greatest term.
    residual : float
        That of Newton's and Euler's equations.
    document : ReportDocument
        What is written.
    status, doubts, notes
        As of the result.

    Examples
    --------
    >>> import mbody
    >>> run = mbody.kinetostatics(mbody.gallery.load("norton_fourbar"))
    >>> found = mbody.teaching.derivation(run)
    >>> len(found.loops), len(found.links), found.residual < 1e-12
    (1, 3, True)
    """

    loops: tuple[LoopEquations, ...]
    conditions: tuple[Condition, ...]
    links: tuple[LinkEquations, ...]
    gap: float
    residual: float
    document: ReportDocument = field(repr=False)

    def text(self) -> str:
        """As plain text."""
        return plain_text(self.document)

    def markdown(self) -> str:
        """As Markdown, with equations in LaTeX between dollar signs."""
        return markdown(self.document, "")

    def latex(self) -> str:
        """As a whole document of LaTeX."""
        return latex(self.document, "")

    def __str__(self) -> str:
        return self.text()


def derivation_as(solution: Solution, form: str = "text", instant: int = 0) -> str:
    """The derivation of one instant as text.

    Parameters
    ----------
    solution : Solution
        Of one design.
    form : str
        "text", "markdown" or "latex".
    instant : int
        Which of its instants; negative ones count from the end.

    Raises
    ------
    ModelError
        For another form, and as `derivation`.

    Examples
    --------
    >>> import mbody
    >>> run = mbody.kinetostatics(mbody.gallery.load("norton_fourbar"))
    >>> "documentclass" in derivation_as(run, "latex")
    True
    """
    if form not in FORMS:
        raise ModelError(f"a derivation is written as {', '.join(FORMS)}, not as {form!r}")
    found = derivation(solution, instant)
    return {"text": found.text, "markdown": found.markdown, "latex": found.latex}[form]()


def derivation(solution: Solution, instant: int = 0) -> Derivation:
    """The equations of a mechanism at one instant: closure of loops, velocities, accelerations, and
    Newton's and Euler's equations of every body, each in symbols and with numbers.

    Parameters
    ----------
    solution : Solution
        Of one design; of kinematics without forces.
    instant : int
        Which of its instants; negative ones count from the end.

    Returns
    -------
    Derivation

    Raises
    ------
    ModelError
        For a batch, or an instant that there is not.

    Notes
    -----
    Names of forces are those of `Solution.equations`, which has the same equations as a matrix:
    R. L. Norton, Design of Machinery, chapters 4, 6, 7 and 11.

    Examples
    --------
    >>> import mbody
    >>> run = mbody.kinetostatics(mbody.makers.slider_crank(1, 3, masses=(1, 3, 2), speed=10.0))
    >>> found = derivation(run)
    >>> len(found.loops), len(found.links), max(found.gap, found.residual) < 1e-12
    (1, 3, True)
    """
    solution = as_solution(solution)
    one_design(solution, "a derivation is of one design")
    return _DerivationWriter(solution, whole_instant(solution, instant)).derivation()


class _DerivationWriter:
    """Collects the equations of one instant and sets them as a document."""

    def __init__(self, solution: Solution, instant: int) -> None:
        self.run, self.k, self.machine = solution, instant, solution.mechanism
        self.unit = self.machine.units.of
        # ω² and α have one scale: their unit of time apart, as in the residuals of rates
        swift = swiftness(solution)
        self.floor = ROUNDING * min(swift, float(np.sqrt(swift)))
        self.forces = force_floor(solution) if solution.has_forces else 0.0
        self.loops = [
            loop_equations(solution, loop, self.floor) for loop in vector_loops(solution, instant)
        ]
        self.conditions = conditions(solution, instant, self.floor)
        self.links = []
        if solution.has_forces:
            names = (body.name for body in self.machine.bodies)
            self.links = [link_equations(solution, name, instant, self.forces) for name in names]

    def derivation(self) -> Derivation:
        pairs = [
            pair
            for one in self.loops
            for pair in (one.positions, one.velocities, one.accelerations)
        ]
        pairs += [(row,) for one in self.conditions for row in one.equations]  # type: ignore[misc]  # one, not two
        newton = [row for one in self.links for row in one.equations[:2]]
        euler = [one.equations[2] for one in self.links]
        return Derivation(
            loops=tuple(self.loops),
            conditions=tuple(self.conditions),
            links=tuple(self.links),
            gap=max(map(_relative, pairs), default=0.0),
            residual=max(_relative(newton), _relative(euler)),
            document=self._document(),
            **inherited(self.run),
        )

    def _document(self) -> ReportDocument:
        units = self.machine.units
        about = [
            ("Analysis", f"{self.run.analysis} at t = {number(self.run.t[self.k])} {units.time}"),
            ("Units", f"{units.length}, {units.force}, {units.time}, {units.mass}; angles in deg"),
        ]
        if self.run.status != "completed":
            about.append(("Status", self.run.status))
        chapters = [Chapter("links", "Links", self._links())]
        if self.machine.drivers:
            chapters.append(Chapter("given", "Given motion", [self._given()]))
        for n, one in enumerate(self.loops, 1):
            chapters.append(Chapter(f"loop-{n}", f"Loop {n}", self._loop(one)))
        if self.conditions:
            blocks = [block for one in self.conditions for block in self._condition(one)]
            chapters.append(Chapter("conditions", "Wheels, cams and couplings", blocks))
        for link in self.links:
            title = f"Forces on {link.number} {link.body}"
            chapters.append(Chapter(f"link-{link.number}", title, self._forces(link)))
        if self.links:
            chapters.append(Chapter("unknowns", "Forces and torques", self._unknowns()))
        return ReportDocument(f"Derivation: {self.machine.name}", about, chapters)

    def _links(self) -> list[Block]:
        bodies, mass = [body.name for body in self.machine.bodies], self.run.system.mass[:, 0]
        numbers = [3 * self.run.system.bodies[name] for name in bodies]
        inertias = [number(mass[n + 2]) for n in numbers]
        return [
            Grid(
                "Numbers of the links, masses, and moments of inertia about the mass centres:",
                [
                    Cells("Link", ["1", *(str(n) for n in range(2, len(bodies) + 2))], text=True),
                    Cells("name", ["ground", *bodies], text=True),
                    Cells("m", ["", *(number(mass[n]) for n in numbers)], self.unit("mass")),
                    Cells("I", ["", *inertias], self.unit("inertia")),
                ],
            )
        ]

    def _given(self) -> Grid:
        rows = [
            [float(part[self.k]) for part in self.run.driven(driver.name)]
            for driver in self.machine.drivers
        ]
        time, length = self.unit("time"), self.unit("length")
        cells = []
        for driver, values in zip(self.machine.drivers, rows, strict=True):
            unit = "rad" if driver.angular else length
            shown = f"{number(values[0])} {length}"
            if driver.angular:
                shown = f"{number(np.degrees(values[0]))}°"
            rates = f"{number(values[1])} {unit}/{time}", f"{number(values[2])} {unit}/{time}²"
            cells.append((driver.name, driver.coordinate, shown, *rates))
        titles = ("Driver", "of", "value", "rate", "acceleration")
        columns = [
            Cells(title, column, text=title in titles[:2])
            for title, column in zip(titles, zip(*cells, strict=True), strict=True)
        ]
        return Grid("What drivers prescribe:", columns)

    def _loop(self, one: LoopEquations) -> list[Block]:
        pairs = zip(one.loop.bodies, one.loop.joints, strict=True)
        way = " ".join(f"{body} –{joint}–" for body, joint in pairs)
        blocks: list[Block] = [
            Text(f"{way} {one.loop.bodies[0]}. The vectors from joint to joint close:"),
            DisplayedEquations([one.vector.line()]),
            self._vectors(one),
        ]
        for words, pair in (
            ("Positions, along x and y:", one.positions),
            ("Velocities, their derivatives:", one.velocities),
            ("Accelerations, the derivatives of these:", one.accelerations),
        ):
            if any(row.left for row in pair):
                blocks += [Text(words), *_formulas(pair)]
        gaps = (_relative(pair) for pair in (one.positions, one.velocities, one.accelerations))
        left = ", ".join(_size(gap) for gap in gaps)
        return [*blocks, Text(f"Left over, as a part of the greatest term: {left}.")]

    def _vectors(self, one: LoopEquations) -> Grid:
        vectors = [vector for _, vector in one.loop.vectors]
        symbols = [vector_symbols(self.run, vector, self.floor) for vector in vectors]
        time = self.unit("time")

        def cells(found: Iterable[Symbol | None]) -> list[str]:
            return ["" if one is None else number(one.value) for one in found]

        speed, rate = f"{self.unit('length')}/{time}", f"rad/{time}"
        return Grid(
            "The vectors at this instant:",
            [
                Cells("Vector", [one.r.rich for one in symbols], text=True),
                Cells("is", [_kind(vector) for vector in vectors], text=True),
                Cells("length", cells(one.r for one in symbols), self.unit("length")),
                Cells("θ", [number(np.degrees(one.angle.value)) for one in symbols], "deg"),
                Cells("ω", cells(one.rate for one in symbols), rate),
                Cells("α", cells(one.second for one in symbols), f"{rate}²"),
                Cells("rate", cells(one.r_rate for one in symbols), speed),
                Cells("second", cells(one.r_second for one in symbols), f"{speed}²"),
            ],
        )

    def _condition(self, one: Condition) -> list[Block]:
        return [Text(one.words), *_formulas(one.equations)]

    def _forces(self, link: LinkEquations) -> list[Block]:
        arms = {
            symbol.text: symbol
            for row in link.equations
            for symbol in row.symbols
            if symbol.letter in "Rφ"
        }
        blocks: list[Block] = list(_formulas(link.equations))
        if arms:
            shown = [
                f"{one.rich} = {number(np.degrees(one.value))}°"
                if one.letter == "φ"
                else f"{one.rich} = {number(one.value)} {self.unit('length')}"
                for one in arms.values()
            ]
            kinds = {one.letter for one in arms.values()}
            words = ["Arms from the mass centre"] if "R" in kinds else []
            words += ["directions of guides"] if "φ" in kinds else []
            named = " and ".join(words)
            blocks.append(Text(f"{named[0].upper()}{named[1:]}: {', '.join(shown)}."))
        left = ", ".join(_size(row.residual) for row in link.equations)
        units = f"{self.unit('force')}, {self.unit('force')}, {self.unit('torque')}"
        return [*blocks, Text(f"Left over: {left} ({units}).")]

    def _unknowns(self) -> list[Block]:
        found = {
            symbol.text: symbol
            for link in self.links
            for row in link.equations
            for symbol in row.symbols
            if symbol.letter in "FNT"
        }
        meanings = {name: words for link in self.links for name, words in link.meanings.items()}
        rows = [(symbol, *meanings[name]) for name, symbol in found.items() if name in meanings]
        # the parts of one element together
        order = list(dict.fromkeys(cause for _, cause, _ in rows))
        rows.sort(key=lambda row: order.index(row[1]))
        torque, force = self.unit("torque"), self.unit("force")
        blocks: list[Block] = [
            Grid(
                "What joints, drivers and loads exert:",
                [
                    Cells("Symbol", [symbol.rich for symbol, *_ in rows], text=True),
                    Cells("value", [number(symbol.value) for symbol, *_ in rows]),
                    Cells(
                        "unit",
                        [torque if symbol.letter == "T" else force for symbol, *_ in rows],
                        text=True,
                    ),
                    Cells("", [words for *_, words in rows], text=True),
                ],
            )
        ]
        if self.run.regularization:
            part = f"{REDUNDANT:g}"
            blocks.append(
                Notice(
                    "note",
                    "redundant constraints leave some of these open; the values are those of least "
                    f"norm, and what is less than {part} of the greatest force is shown as 0",
                )
            )
        return blocks


def _relative(rows: Sequence[Equation]) -> float:
    """The greatest residual as a part of the greatest term."""
    size = max((row.size for row in rows), default=0.0)
    return max(row.residual for row in rows) / size if size else 0.0


def _size(value: float) -> str:
    return f"{value:.1e}" if value else "0"


def _kind(vector: LoopVector) -> str:
    where = {"slide": "along the guide", "offset": "radius", "rod": "rod"}
    return f"on {vector.body}" if vector.kind == "link" else where[vector.kind]


def _labelled(row: Equation, numbers: bool) -> Line:
    (text, tex), *others = row.line(numbers)
    label, tex_label = _LABELS[row.name]
    return [(label + text, f"{tex_label}{tex}"), *others]


def _formulas(rows: Sequence[Equation]) -> list[Block]:
    """Some equations in symbols, then with numbers."""
    return [
        DisplayedEquations([_labelled(row, numbers) for row in rows]) for numbers in (False, True)
    ]
