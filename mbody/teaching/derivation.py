"""The equations of a mechanism at one instant: in symbols, then with numbers."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from mbody.analysis.driven.free_body import Wrench, free_body
from mbody.core.tolerances import LENGTH_NONE, PRINTED_NONE, PRINTED_NONE_REDUNDANT
from mbody.errors import ModelError
from mbody.quantities.evaluate import place_in_turn
from mbody.reports.described import (
    Block,
    Chapter,
    DisplayedEquations,
    FileText,
    Grid,
    Items,
    Notice,
    Picture,
    ReportDocument,
    Text,
    parts_of,
)
from mbody.reports.writers import latex, markdown
from mbody.solution.doubts import Inherited, inherited
from mbody.solution.histories import one_design, whole_instant
from mbody.solution.known_forces import every_force
from mbody.solution.solution import as_solution
from mbody.summaries.text_table import (
    WIDTH,
    Column,
    acceleration_scale,
    force_floor,
    force_names,
    forces_on,
    number,
    paragraph,
    quantities,
    table,
)
from mbody.teaching.vector_loops import (
    Condition,
    Equation,
    Factor,
    Line,
    LoopEquations,
    LoopVector,
    Symbol,
    Term,
    conditions,
    loop_equations,
    vanishing,
    vector_loops,
    vector_symbols,
)

if TYPE_CHECKING:
    from mbody.solution.solution import Solution


# -- Newton's and Euler's equations of every body, in symbols with numbers ---------------------


@dataclass(frozen=True)
class LinkEquations:
    """Newton's and Euler's equations of one body.

    `number`: Of the link, the ground being 1.
    `equations`: ΣFx, ΣFy and ΣM about the mass centre.
    `meanings`: By symbol of a force or torque the element and what it is.
    """

    number: int
    body: str
    equations: tuple[Equation, Equation, Equation]
    meanings: dict[str, tuple[str, str]]


def link_equations(solution: Solution, body: str, instant: int, floor: float) -> LinkEquations:
    """The equations of one body: Σ of all that acts on it = m a, I α. `floor`: a force, or a torque
    by the model length.

    >>> import mbody
    >>> run = mbody.kinetostatics(mbody.makers.four_bar(1, 3, 2, 3.5, masses=(1, 1, 1), speed=2.0))
    >>> found = link_equations(run, "coupler", 0, 0.0)
    >>> for equation in found.equations:
    ...     print(*(text for text, _ in equation.line()))
    -F32x + F43x = m3 a3x
    -F32y + F43y = m3 a3y
    -R23x F32y + R23y F32x + R43x F43y - R43y F43x = I3 α3
    """
    return _Link(solution, body, instant, floor).equations()


class _Link:
    """Collects the terms of one body."""

    def __init__(self, solution: Solution, body: str, instant: int, floor: float) -> None:
        self.run, self.body, self.k = solution, body, instant
        self.machine, self.floor = solution.mechanism, floor
        self.number = 2 + [one.name for one in self.machine.bodies].index(body)
        self.whole, self.on = force_names(self.machine), forces_on(self.machine, body)
        self.driven = {self.whole[one.name][0] for one in self.machine.drivers if one.angular}
        self.sums: tuple[list[Term], list[Term], list[Term]] = ([], [], [])
        self.meanings: dict[str, tuple[str, str]] = {}
        at = solution[body]
        self.centre = float(at.x[instant]), float(at.y[instant])

    def equations(self) -> LinkEquations:
        angular = {driver.name for driver in self.machine.drivers if driver.angular}
        wrenches = free_body(self.run, self.body, self.k)
        touching = Counter(one.cause for one in wrenches if one.kind == "contact")
        counted: Counter[str] = Counter()
        for wrench in wrenches:
            if wrench.kind == "contact" and touching[wrench.cause] > 1:
                # a contact that touches at several places has a force at each
                counted[wrench.cause] += 1
                self._force(wrench, by_name=False, place=str(counted[wrench.cause]))
            elif wrench.kind == "joint":
                self._joint(wrench)
            elif wrench.kind == "driver" and wrench.cause in angular:
                self._torque(wrench, *self._named(wrench.cause))
            elif wrench.kind == "driver":
                self._force(wrench, by_name=True)
            elif wrench.kind != "inertia":
                self._force(wrench, by_name=False)
        lines = zip(("ΣFx", "ΣFy", "ΣM"), self.sums, self._right(), strict=True)
        x, y, m = (Equation(name, left, right) for name, left, right in lines)
        return LinkEquations(self.number, self.body, (x, y, m), self.meanings)

    def _right(self) -> Iterator[list[Term]]:
        if self.run.analysis == "statics":
            yield from ([], [], [])
            return
        index, at, b = str(self.number), self.run[self.body], self.run.system.bodies[self.body]
        mass, _, inertia = (float(part) for part in self.run.system.mass[3 * b : 3 * b + 3, 0])
        m, i = Symbol("m", (index,), mass), Symbol("I", (index,), inertia)
        for axis, values in (("x", at.ax), ("y", at.ay)):
            a = Symbol("a", (index + axis,), float(values[self.k]))
            yield [Term(1, [Factor(m), Factor(a)])]
        yield [Term(1, [Factor(i), Factor(Symbol("α", (index,), float(at.alpha[self.k])))])]

    def _named(self, element: str) -> tuple[tuple[str, ...], int]:
        """Index of an unknown as in `Solution.equations`, and its sign on this body."""
        name, on = self.whole[element]
        return _index(name), 1 if on == self.body else -1

    def _joint(self, wrench: Wrench) -> None:
        joint: Any = self.machine[wrench.cause]
        if joint.unknowns == ("N", "T") and not joint.has_friction:
            self._guided(wrench, joint)
        else:
            # of some joints the equations say whether they have a torque, of others its size does
            known = joint.unknowns and not joint.has_friction
            self._force(wrench, True, "T" in joint.unknowns if known else None)

    def _meaning(self, symbol: Symbol, wrench: Wrench, sign: int, what: str) -> None:
        """Records the meaning of an unknown on the body where it has its own sign."""
        if sign > 0:
            at = f"on {self.body} by {wrench.cause}, {what}"
            self.meanings[symbol.text] = (wrench.cause, at)

    def _moment_arms(self, wrench: Wrench, index: tuple[str, ...]) -> tuple[Symbol, Symbol]:
        x, y = (
            vanishing(place - centre, LENGTH_NONE * self.run.system.length)
            for place, centre in zip((wrench.x, wrench.y), self.centre, strict=True)
        )
        return Symbol("R", _along("x", index), x), Symbol("R", _along("y", index), y)

    def _guided(self, wrench: Wrench, joint: Any) -> None:
        """A slider: the force normal to its guide, and a torque."""
        index, sign = self._named(joint.name)
        guide = self.run[joint.i.body].angle[self.k] + self.run.system.numbers.angle(joint, "i")
        angle = Symbol("φ", (joint.name,), float(guide))
        size = -np.sin(angle.value) * wrench.fx + np.cos(angle.value) * wrench.fy
        force = Symbol("N", index, vanishing(sign * size, self.floor))
        x, y = self._moment_arms(wrench, self._seen(joint.name))
        cos, sin = Factor(angle, "cos"), Factor(angle, "sin")
        self.sums[0].append(Term(-sign, [Factor(force), sin]))
        self.sums[1].append(Term(sign, [Factor(force), cos]))
        if x.value or y.value:
            self.sums[2].append(Term(sign, [Factor(x), Factor(force), cos]))
            self.sums[2].append(Term(sign, [Factor(y), Factor(force), sin]))
        self._meaning(force, wrench, sign, "normal to the guide")
        self._torque(wrench, index, sign)

    def _seen(self, element: str) -> tuple[str, ...]:
        """Index of a moment arm on this body."""
        return _index(self.on[element])

    def _torque(self, wrench: Wrench, index: tuple[str, ...], sign: int) -> None:
        floor = self.floor * self.run.system.length
        torque = Symbol("T", index, vanishing(sign * wrench.torque, floor))
        self.sums[2].append(Term(sign, [Factor(torque)]))
        self._meaning(torque, wrench, sign, "torque")

    def _force(
        self, wrench: Wrench, by_name: bool, torque: bool | None = None, place: str = ""
    ) -> None:
        """Two components at their place, and a torque; without `torque` where it is not zero.
        `place`: the number of the place, of several.
        """
        element = wrench.cause
        if by_name:
            (index, sign), seen = self._named(element), self._seen(element)
        else:
            index, sign = (element + place, str(self.number)), 1
            seen = index
        x, y = self._moment_arms(wrench, seen)
        parts = []
        for axis, value in (("x", wrench.fx), ("y", wrench.fy)):
            parts.append(Symbol("F", _along(axis, index), vanishing(sign * value, self.floor)))
        # what is no joint has the components that it has; a joint has both
        nonzero = [by_name or bool(part.value) for part in parts]
        for n, part in enumerate(parts):
            if nonzero[n]:
                self.sums[n].append(Term(sign, [Factor(part)]))
                self._meaning(part, wrench, sign, f"along {'xy'[n]}")
        if x.value or y.value:
            if nonzero[1]:
                self.sums[2].append(Term(sign, [Factor(x), Factor(parts[1])]))
            if nonzero[0]:
                self.sums[2].append(Term(-sign, [Factor(y), Factor(parts[0])]))
        if torque is None:
            torque = abs(wrench.torque) > self.floor * self.run.system.length
        if torque:
            # a driver and the friction of a pin between the same links: the joint is named as well
            shared = by_name and f"T{index[0]}" in self.driven and len(index) == 1
            self._torque(wrench, (*index, element) if shared else index, sign)


def _along(axis: str, index: tuple[str, ...]) -> tuple[str, ...]:
    """The index of a component: the axis is behind the numbers of links, else by itself.

    >>> _along("x", ("14", "slot")), _along("y", ("spring", "3"))
    (('14x', 'slot'), ('spring', '3', 'y'))
    """
    if index[0][0] in "0123456789(":
        return (index[0] + axis, *index[1:])
    return (*index, axis)


def _index(name: str) -> tuple[str, ...]:
    """The index of a textbook name.

    >>> _index("F32"), _index("F14,slot"), _index("T(12,3),motor")
    (('32',), ('14', 'slot'), ('(12,3)', 'motor'))
    """
    found = re.fullmatch(r"[A-Z](\d\d|\(\d+,\d+\))(?:,(.*))?", name)
    assert found, name
    return (found[1], found[2]) if found[2] else (found[1],)


# -- A document as plain text for a terminal ---------------------------------------------------

INDENT = "   "


def plain_text(document: ReportDocument) -> str:
    """The text, at most 100 characters wide where a term of an equation is not wider.

    >>> from mbody.reports.described import Chapter, Text
    >>> chapter = Chapter("one", "Energy", [Text("F_{12} s")])
    >>> print(plain_text(ReportDocument("Work", [], [chapter])))
    Work
    <BLANKLINE>
    ENERGY
    <BLANKLINE>
    F12 s
    """
    lines = paragraph(_rich(document.title))
    for what, value in document.about:
        lines += paragraph(_rich(value), f"{_rich(what)}: ")
    for chapter in document.chapters:
        lines += ["", _rich(chapter.title).upper()]
        for block in chapter.blocks:
            lines += ["", *_block(block)]
    return "\n".join(lines)


def _block(block: Block) -> Iterator[str]:
    if isinstance(block, DisplayedEquations):
        for row in block.broken(WIDTH - len(INDENT)):
            yield INDENT + " ".join(text for text, _ in row)
    elif isinstance(block, Grid):
        if block.title:
            yield from paragraph(_rich(block.title))
        columns = (
            Column(_rich(one.title), [_rich(cell) for cell in one.cells], one.unit, text=one.text)
            for one in block.columns
        )
        yield from (INDENT + line for line in table(columns))
    elif isinstance(block, Items):
        for item in block.items:
            yield from paragraph(_rich(item), "- ")
    elif isinstance(block, Picture):
        yield from paragraph(_rich(block.caption), f"[{block.name}.svg] ")
    elif isinstance(block, FileText):
        yield from (INDENT + line for line in block.text.splitlines())
    else:
        mark = "NOTE   " if isinstance(block, Notice) else ""
        yield from paragraph(_rich(block.text), mark)


def _rich(text: str) -> str:
    return "".join(part + index for _, part, index in parts_of(text))


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
        """The derivation in plain text."""
        return plain_text(self.document)

    def markdown(self) -> str:
        """The derivation in Markdown, with equations in LaTeX between dollar signs."""
        return markdown(self.document, "")

    def latex(self) -> str:
        """The derivation as a complete LaTeX document."""
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
        acceleration = acceleration_scale(solution)
        self.floor = PRINTED_NONE * min(acceleration, float(np.sqrt(acceleration)))
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
            **inherited(self.run, of=[every_force]),
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
            chapters.append(Chapter("given", "Given motion", [self._given_motion()]))
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
        read = self.machine.shown  # beside the consistent units in which the equations are
        weighed = [
            quantities("mI"[k // 2], mass[[n + k for n in numbers]], dimension, read, before=[""])
            for k, dimension in ((0, "mass"), (2, "inertia"))
            if read.size(dimension) != 1.0
        ]
        return [
            Grid(
                "Numbers of the links, masses, and moments of inertia about the mass centres:",
                [
                    Column("Link", ["1", *(str(n) for n in range(2, len(bodies) + 2))], text=True),
                    Column("name", ["ground", *bodies], text=True),
                    Column("m", ["", *(number(mass[n]) for n in numbers)], self.unit("mass")),
                    Column("I", ["", *inertias], self.unit("inertia")),
                    *weighed,
                ],
            )
        ]

    def _given_motion(self) -> Grid:
        rows = [
            [float(part[self.k]) for part in self.run.driven(driver.name)]
            for driver in self.machine.drivers
        ]
        time, length = self.unit("time"), self.unit("length")
        cells = []
        for driver, values in zip(self.machine.drivers, rows, strict=True):
            unit = "rad" if driver.angular else length
            quantity = f"{number(values[0])} {length}"
            if driver.angular:
                quantity = f"{number(place_in_turn(values[0]))}°"
            rates = f"{number(values[1])} {unit}/{time}", f"{number(values[2])} {unit}/{time}²"
            cells.append((driver.name, driver.coordinate, quantity, *rates))
        titles = ("Driver", "of", "value", "rate", "acceleration")
        columns = [
            Column(title, column, text=title in titles[:2])
            for title, column in zip(titles, zip(*cells, strict=True), strict=True)
        ]
        return Grid("What drivers prescribe:", columns)

    def _loop(self, one: LoopEquations) -> list[Block]:
        pairs = zip(one.loop.bodies, one.loop.joints, strict=True)
        route = " ".join(f"{body} –{joint}–" for body, joint in pairs)
        blocks: list[Block] = [
            Text(f"{route} {one.loop.bodies[0]}. The vectors from joint to joint close:"),
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
                Column("Vector", [one.r.rich for one in symbols], text=True),
                Column("is", [_kind(vector) for vector in vectors], text=True),
                Column("length", cells(one.r for one in symbols), self.unit("length")),
                Column("θ", [number(np.degrees(one.angle.value)) for one in symbols], "deg"),
                Column("ω", cells(one.rate for one in symbols), rate),
                Column("α", cells(one.second for one in symbols), f"{rate}²"),
                Column("rate", cells(one.r_rate for one in symbols), speed),
                Column("second", cells(one.r_second for one in symbols), f"{speed}²"),
            ],
        )

    def _condition(self, one: Condition) -> list[Block]:
        return [Text(one.words), *_formulas(one.equations)]

    def _forces(self, link: LinkEquations) -> list[Block]:
        symbols = {
            symbol.text: symbol
            for row in link.equations
            for symbol in row.symbols
            if symbol.letter in "Rφ"
        }
        blocks: list[Block] = list(_formulas(link.equations))
        if symbols:
            rows = [
                f"{one.rich} = {number(np.degrees(one.value))}°"
                if one.letter == "φ"
                else f"{one.rich} = {number(one.value)} {self.unit('length')}"
                for one in symbols.values()
            ]
            kinds = {one.letter for one in symbols.values()}
            words = ["Arms from the mass centre"] if "R" in kinds else []
            words += ["directions of guides"] if "φ" in kinds else []
            named = " and ".join(words)
            blocks.append(Text(f"{named[0].upper()}{named[1:]}: {', '.join(rows)}."))
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
        kinds, read = {True: "torque", False: "force"}, self.machine.shown
        answers = [(symbol.value, kinds[symbol.letter == "T"]) for symbol, *_ in rows]
        blocks: list[Block] = [
            Grid(
                "What joints, drivers and loads exert:",
                [
                    Column("Symbol", [symbol.rich for symbol, *_ in rows], text=True),
                    Column("value", [number(read.converted(*one)) for one in answers]),
                    Column("unit", [read.of(kind) for _, kind in answers], text=True),
                    Column("", [words for *_, words in rows], text=True),
                ],
            )
        ]
        if not self.run.regularization:
            blocks += [Notice("note", one) for one in self.run.known_of(every_force)]
        else:
            part = f"{PRINTED_NONE_REDUNDANT:g}"
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
