"""Exercises: designs with round numbers, a sheet of questions and a key with worked solutions."""

from __future__ import annotations

import math
import os
import random
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from mbody.analysis.driven.driven import analyse_at, kinematics
from mbody.core.tolerances import ROUND_NUMBER_SLACK
from mbody.errors import ModelError, SolveError
from mbody.files.writing import writing
from mbody.model.element import whole_number
from mbody.model.study import Instants
from mbody.reports.blocks import Block, Chapter, Grid, Items, Picture, ReportDocument, Text
from mbody.reports.described import inputs
from mbody.reports.subject import Subject
from mbody.reports.writers import markdown
from mbody.summaries.text_table import Column, number
from mbody.teaching.derivation import Derivation, derivation
from mbody.teaching.vector_loops import loops_of_instants
from mbody.views.drawing import draw
from mbody.views.style import content_of

if TYPE_CHECKING:
    from mbody.model.mechanism import Mechanism
    from mbody.solution.solution import Solution


#: Designs whose transmission angle is smaller somewhere in the cycle are not asked for [rad].
LEAST_TRANSMISSION = math.radians(30.0)
#: Draws for every exercise, before it is given up.
DRAWS = 200
#: Numbers between both bounds are multiples of a round step; there are at least so many steps.
STEPS = 10
#: Positions are multiples of so many degrees.
DEGREES = 5
#: Instants of a revolution at which a design must close.
REVOLUTION_INSTANTS = 73


@dataclass(frozen=True)
class Exercise:
    """One design at one position, solved.

    Attributes
    ----------
    values : dict
        What was drawn, by parameter, as text with its unit.
    position : str
        Where the driver stands, as "60°"; empty where the model gives the instant.
    run : Solution
        Of kinetostatics, of that position alone.
    transmission : float or None
        The least transmission angle of the cycle [rad], where a loop has one.

    Examples
    --------
    >>> import mbody
    >>> from mbody.teaching import new_model
    >>> make = lambda values: mbody.from_toml(new_model("fourbar"), parameters=values)
    >>> sheet = exercises(make, {"a": ("30 mm", "50 mm")}, 1, seed=7)
    >>> list(sheet.exercises[0].values)
    ['a']
    """

    values: dict[str, str]
    position: str
    run: Solution
    transmission: float | None

    @property
    def solution(self) -> Derivation:
        """All equations, in symbols and with numbers."""
        return derivation(self.run)


@dataclass(frozen=True)
class ExerciseSheet:
    """Exercises with their sheet and key.

    Attributes
    ----------
    exercises : tuple of Exercise
    questions, key : ReportDocument
        The sheet for students, with a figure to scale of each, and the worked key.

    Examples
    --------
    >>> import mbody
    >>> from mbody.teaching import new_model
    >>> make = lambda values: mbody.from_toml(new_model("fourbar"), parameters=values)
    >>> len(exercises(make, {"a": ("30 mm", "50 mm")}, 2, seed=7).exercises)
    2
    """

    exercises: tuple[Exercise, ...]
    questions: ReportDocument
    key: ReportDocument

    def sheet(self, folder: str) -> str:
        """The questions in Markdown; their figures are named in that folder."""
        return markdown(self.questions, folder)

    def worked(self) -> str:
        """The key in Markdown."""
        return markdown(self.key, "")

    def save_figures(self, folder: str | os.PathLike[str]) -> list[str]:
        """Write the figures as SVG into a folder, which is made; their paths.

        Raises
        ------
        ModelError
            Where they cannot be written.
        """
        try:
            Path(folder).mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise ModelError(
                f"cannot make the folder '{folder}' for the figures ({error.strerror})"
            ) from None
        files = []
        for picture in self.questions.pictures:
            files.append(str(Path(folder) / f"{picture.name}.svg"))
            with writing(files[-1], binary=True) as file:
                file.write(content_of(picture.figure, "svg"))
        return files


def exercises(
    make: Callable[[Mapping[str, str]], Mechanism],
    vary: Mapping[str, tuple[str, str]],
    count: int = 1,
    seed: int = 0,
) -> ExerciseSheet:
    """Draw designs with round numbers that can be built, and ask for their motion and forces.

    A design is kept where its loops close, over the whole revolution if the driver of the first
    design makes one, and where no transmission angle is less than 30 deg.

    Parameters
    ----------
    make : callable
        The mechanism with other values of some parameters, by name as text.
    vary : mapping of name to (low, high)
        Bounds of what is drawn, as text: "4", "40 mm"; one unit for both.
    count : int
        How many.
    seed : int
        The same seed makes the same sheet.

    Raises
    ------
    ModelError
        For bounds that are no numbers or the wrong way round, a count that is not positive, and
        where too few of the drawn designs can be built.

    Examples
    --------
    >>> import mbody
    >>> from mbody.teaching import new_model
    >>> text = new_model("fourbar")
    >>> make = lambda values: mbody.from_toml(text, parameters=values)
    >>> sheet = exercises(make, {"a": ("30 mm", "50 mm"), "c": ("70 mm", "90 mm")}, 2, seed=7)
    >>> [one.values for one in sheet.exercises] == [
    ...     one.values for one in exercises(make, {"a": ("30 mm", "50 mm"),
    ...     "c": ("70 mm", "90 mm")}, 2, seed=7).exercises]
    True
    """
    count = whole_number("exercises: count", count)
    bounds = {name: _Bounds.of(name, *ends) for name, ends in vary.items()}
    if not bounds:
        raise ModelError("exercises: nothing differs between them: give a parameter to vary")
    draw_from, first = random.Random(seed), make({})
    revolves, seen, found = _revolves(first), set(), []
    cycles: dict[tuple[str, ...], Solution | None] = {}
    for _ in range(DRAWS * count):
        values = {name: one.drawn(draw_from) for name, one in bounds.items()}
        degrees = DEGREES * draw_from.randrange(360 // DEGREES)
        own = tuple(values.values())
        if (key := (*own, degrees) if revolves else own) in seen:
            continue
        seen.add(key)
        if own not in cycles:
            cycles[own] = _cycle(make(values), revolves)
        if (one := _built(cycles[own], values, degrees, revolves)) is not None:
            found.append(one)
        if len(found) == count:
            return ExerciseSheet(tuple(found), _questions(first, found), _key(first, found))
    raise ModelError(
        f"exercises: of {len(seen)} drawn designs {len(found)} can be built"
        f"{' and turned' if revolves else ''} with a transmission angle of at least 30 deg, "
        f"{count} are wanted: vary within other bounds"
    )


@dataclass(frozen=True)
class _Bounds:
    """Round numbers from one bound to the other."""

    low: float
    high: float
    step: float
    unit: str

    @classmethod
    def of(cls, name: str, low: str, high: str) -> _Bounds:
        ends = [
            re.fullmatch(r"\s*([-+]?[\d.]+(?:e[-+]?\d+)?)\s*(.*?)\s*", text) for text in (low, high)
        ]
        try:
            values = [float(end[1]) for end in ends if end]
        except ValueError:
            values = []
        units = {end[2] for end in ends if end and end[2]}
        if len(values) < 2 or len(units) > 1:
            raise ModelError(
                f"exercises: '{name}' must vary from one number to another of the same unit, as "
                f"in 40:60 or 40 mm:60 mm, not {low!r} to {high!r}",
                name,
            )
        if not values[0] < values[1]:
            raise ModelError(
                f"exercises: '{name}' varies from {low} to {high}: give the lower bound first", name
            )
        low_value, high_value = values
        unit = next(iter(units), "")
        return cls(low_value, high_value, _step(high_value - low_value), unit)

    def drawn(self, source: random.Random) -> str:
        """A multiple of the step between both bounds, with its unit."""
        first, last = (
            math.ceil(self.low / self.step - ROUND_NUMBER_SLACK),
            math.floor(self.high / self.step + ROUND_NUMBER_SLACK),
        )
        value = number(source.randint(first, last) * self.step)
        return f"{value} {self.unit}".strip()


def _step(span: float) -> float:
    """1, 2 or 5 times a power of ten, the greatest that divides a span into enough steps.

    >>> _step(20.0), _step(2.0)
    (2.0, 0.2)
    """
    size = 10.0 ** math.floor(math.log10(span / STEPS))
    return max(
        part * size
        for part in (1.0, 2.0, 5.0)
        if part * size * STEPS <= span * (1 + ROUND_NUMBER_SLACK)
    )


def _revolves(machine: Mechanism) -> bool:
    """Whether the driver of the first design makes whole revolutions."""
    if len(machine.drivers) != 1 or not machine.drivers[0].angular:
        return False
    try:
        kinematics(machine, turn=True, instants=REVOLUTION_INSTANTS)
    except (ModelError, SolveError):
        return False
    return True


def _cycle(machine: Mechanism, revolves: bool) -> Solution | None:
    """The revolution of a design, or its first instant, where it can be built."""
    try:
        if revolves:
            cycle = kinematics(machine, turn=True, instants=REVOLUTION_INSTANTS)
        else:
            cycle = analyse_at(machine, "kinetostatics", machine.ask).take([0])
    except SolveError:
        return None
    least = least_transmission(cycle)
    small = least is not None and least < LEAST_TRANSMISSION
    return None if small or cycle.doubts else cycle


def _built(
    cycle: Solution | None, values: dict[str, str], degrees: int, revolves: bool
) -> Exercise | None:
    """The exercise, where the design can be built."""
    if cycle is None:
        return None
    least = least_transmission(cycle)
    if not revolves:
        return Exercise(values, "", cycle, least)
    machine = cycle.mechanism
    body = machine.drivers[0].bodies[1]
    try:
        run = analyse_at(machine, "kinetostatics", Instants(at={body: [f"{degrees} deg"]}))
    except SolveError:
        return None
    return None if run.doubts else Exercise(values, f"{degrees}°", run, least)


def least_transmission(run: Solution) -> float | None:
    """The least transmission angle over the instants of a result [rad]: of loops of four links the
    acute angle between coupler and output link, or between the rod and the normal of the guide.

    Examples
    --------
    >>> import math, mbody
    >>> run = mbody.kinematics(mbody.makers.four_bar(1, 3, 2, 3.5, start=0.0))
    >>> cosine = (9 + 4 - 1 - 3.5**2 + 7) / 12
    >>> math.isclose(least_transmission(run), math.acos(cosine))
    True
    """
    driven = {driver.bodies[1] for driver in run.mechanism.drivers}
    found: list[float] = []
    for loops in loops_of_instants(run, range(len(run))):
        for loop in loops:
            ground = "ground" in loop.bodies
            if len(loop.bodies) != 4 or not ground or not driven & {*loop.bodies}:
                continue
            free = [
                vector
                for _, vector in loop.vectors
                if vector.kind == "link" and vector.body not in driven | {"ground"}
            ]
            slides = [vector for _, vector in loop.vectors if vector.kind == "slide"]
            if len(free) == 2 and not slides:
                found.append(_acute(free[0].angle - free[1].angle))
            elif len(free) == 1 and len(slides) == 1 and slides[0].body == "ground":
                found.append(_acute(free[0].angle - slides[0].angle - 0.5 * math.pi))
    return min(found) if found else None


def _acute(angle: float) -> float:
    """The acute angle of two lines."""
    return float(abs(np.arcsin(np.sin(angle))))


def _questions(first: Mechanism, found: list[Exercise]) -> ReportDocument:
    subject = Subject(found[0].run, [0], first)
    names = ", ".join(f"`{name}`" for name in found[0].values)
    same = f"All exercises have these numbers but for {names}, which each gives."
    given: list[Block] = [Text(same)]
    given += [_without(block, found[0].values) for block in inputs(subject)]
    chapters = [Chapter("given", "The mechanism", given)]
    for n, one in enumerate(found, 1):
        chapters.append(Chapter(f"exercise-{n}", f"Exercise {n}", _question(n, one)))
    return ReportDocument(f"Exercises: {first.name}", [("Exercises", str(len(found)))], chapters)


def _without(block: Block, values: Mapping[str, str]) -> Block:
    """A table of parameters without those that differ."""
    if not isinstance(block, Grid) or block.title != "Parameters":
        return block
    names = block.columns[0].cells
    kept = [n for n, name in enumerate(names) if name not in values]
    columns = [replace(one, cells=[one.cells[n] for n in kept]) for one in block.columns]
    return Grid(block.title, columns)


def _with_unit(one: Exercise, name: str, value: str) -> str:
    """A plain number with its unit, that of the model."""
    known = one.run.mechanism.parameters.scope().names.get(name)
    if not re.fullmatch(r"[-+\d.e]+", value) or known is None or known.dimension is None:
        return value
    return f"{value} {one.run.mechanism.units.of(known.dimension)}"


def _question(n: int, one: Exercise) -> list[Block]:
    machine = one.run.mechanism
    rows = [(name, _with_unit(one, name, value)) for name, value in one.values.items()]
    if one.position:
        rows.append((f"angle of {machine.drivers[0].bodies[1]}", one.position))
    asked = [
        "Write the closure of every loop and find the angles of all links.",
        "Find all angular velocities and accelerations.",
    ]
    if any(mass for mass in one.run.system.mass[:, 0]) or machine.loads:
        efforts = ", ".join(driver.name for driver in machine.drivers)
        asked.append(f"Find the forces in all joints, and what these must give: {efforts}.")
    figure = draw(one.run)
    return [
        Grid(
            "Given:",
            [
                Column("what", [name for name, _ in rows], text=True),
                Column("value", [value for _, value in rows]),
            ],
        ),
        Picture(f"exercise_{n}", figure, f"Exercise {n}, to scale."),
        Items(asked),
    ]


def _key(first: Mechanism, found: list[Exercise]) -> ReportDocument:
    chapters = []
    for n, one in enumerate(found, 1):
        worked = one.solution
        rows = [f"{name} = {_with_unit(one, name, value)}" for name, value in one.values.items()]
        if one.position:
            rows.append(f"angle of {first.drivers[0].bodies[1]} = {one.position}")
        words = f"{', '.join(rows)}."
        if one.transmission is not None:
            least = number(round(math.degrees(one.transmission), 2))
            words += f" The least transmission angle of the cycle is {least}°."
        left = f"{max(worked.gap, worked.residual):.1e}"
        words += f" What is left over is at most {left} of the greatest term."
        chapters.append(Chapter(f"exercise-{n}", f"Exercise {n}", [Text(words)]))
        chapters += [
            Chapter(f"{n}-{part.key}", f"{n}: {part.title}", part.blocks)
            for part in worked.document.chapters
        ]
    return ReportDocument(f"Key: {first.name}", [("Exercises", str(len(found)))], chapters)
