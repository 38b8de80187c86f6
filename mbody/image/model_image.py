"""The image of a model: the memory of its assembled mechanism with all calls of its analyses."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from mbody._version import __version__
from mbody.analysis.position.assembly_analysis import as_system
from mbody.core.sources import source_hash
from mbody.errors import ModelError, SolveError
from mbody.image.arena import FORMAT, INPUT, MEASURE, NUMBER, Arena, ImageEntry
from mbody.image.changeable import Changeable, changeable_numbers, input_numbers
from mbody.image.driven_calls import enter_driven
from mbody.image.free_calls import enter_free
from mbody.image.measured_quantities import MeasuredProgram, measured_quantities
from mbody.image.si_units import si_unit
from mbody.kernels.number_program import NumberProgram
from mbody.model.element import listed
from mbody.model.mechanism import Mechanism
from mbody.model.numbers import dimension_named
from mbody.system.system import System

__all__ = ["ModelImage", "to_image"]

#: What an image can do, and what puts it in.
ENTER = {"driven": enter_driven, "free": enter_free}
ANALYSES = tuple(ENTER)
#: Bases of units that the manifest names.
UNITS = ("length", "mass", "time", "angle", "force", "torque")


@dataclass(frozen=True)
class ModelImage:
    """An image.

    Attributes
    ----------
    content : bytes
        All of it, as `docs/images.md` describes it.
    manifest : dict
        What it says of itself.
    entries : tuple of ImageEntry
        What it offers by name, in order.
    """

    content: bytes
    manifest: dict[str, Any]
    entries: tuple[ImageEntry, ...] = ()

    @property
    def notes(self) -> list[str]:
        """What it lacks, in sentences."""
        found: list[str] = self.manifest["notes"]
        return found


def to_image(
    model: Mechanism | System,
    instants: int | None = None,
    analyses: Sequence[str] = ANALYSES,
) -> ModelImage:
    """The image of a mechanism, on which the compiled core runs without Python.

    Parameters
    ----------
    model : Mechanism or System
        Whose loops close; the position and all numbers are those of the description.
    instants : int, optional
        Of a turn, by default 361, and of a free motion, by default those of the description.
    analyses : sequence of str
        "driven", "free" or both: what the image shall do.

    Raises
    ------
    ModelError
        For a mechanism with users' Python, a batch of designs, and one that has neither a driven
        nor a free motion that an image can make.

    Examples
    --------
    >>> from mbody import makers
    >>> image = to_image(makers.four_bar(1, 3, 2, 3.5, masses=(1, 3, 2), speed=10.0))
    >>> image.manifest["analyses"], image.content[:8]
    (['driven', 'free'], b'mbodyimg')
    """
    system = as_system(model)
    name = system.mechanism.name
    if system.batch is not None:
        raise ModelError(
            f"an image has one design, '{name}' has {system.batch}: choose one with design(n)"
        )
    own = [element for element, function in system.functions if function is not None]
    if own:
        raise ModelError(
            f"'{own[0]}' has a function in Python, which an image runs without: give a formula or "
            "a table instead",
            own[0],
        )
    if system.mechanism.controllers:
        controller = system.mechanism.controllers[0]
        raise ModelError(
            f"'{controller.name}' is a controller in Python, which an image runs without: leave it "
            f"out, and let the program set {listed(controller.sets)}",
            controller.name,
        )
    changeable = changeable_numbers(system)
    numbers, measured = changeable.program(), measured_quantities(changeable)
    arena = Arena()
    for n, input_name in enumerate(changeable.rules):
        place = arena.put(numbers.slots) + 8 * n
        arena.entries.append(ImageEntry(NUMBER, place, 1, input_name, _unit(system, input_name)))
    for n, (one, unit) in enumerate(zip(measured.names, measured.units, strict=True)):
        arena.entries.append(ImageEntry(MEASURE, 0, n, one, unit))
    slots = list(changeable.rules)
    for number_name, input_name in input_numbers(system).items():
        if number_name in changeable.rules:
            place = arena.put(numbers.slots) + 8 * slots.index(number_name)
            unit = measured.units[measured.names.index(input_name)]
            arena.entries.append(ImageEntry(INPUT, place, 1, input_name, unit))
    rows = system.page_rows
    arena.word("page.rows", 0, rows)
    about: dict[str, Any] = {}
    notes = [*measured.notes, *_fits(system)]
    known = len(notes)
    for analysis in analyses:
        try:
            about[analysis] = ENTER[analysis](arena, system, numbers, measured, instants)
        except (ModelError, SolveError) as error:
            if len(analyses) == 1:
                raise
            notes.append(f"no {analysis} motion: {error}")
    if not about:
        raise ModelError(f"an image of '{name}' could do nothing; " + "; ".join(notes[known:]))
    factors = [si_unit(entry.unit).factor for entry in arena.entries]
    arena.array("si.factors", np.array(factors))
    arena.array("si.second", np.array([si_unit(system.mechanism.units.time).factor]))
    notes += about.get("free", {}).pop("notes", [])
    manifest = _manifest(system, changeable, measured, numbers) | {
        "analyses": list(about),
        **about,
        "rows": rows,
        "notes": notes,
    }
    sources = source_hash() or "00" * 32
    manifest["sources"] = sources
    content = arena.image(json.dumps(manifest, ensure_ascii=False).encode(), sources)
    return ModelImage(content, manifest, tuple(arena.entries))


def _fits(system: System) -> list[str]:
    """What is checked in Python when loops are closed, and not in an image."""
    spaced = [joint.name for joint in system.mechanism.joints if joint.spaced]
    if not spaced:
        return []
    return [
        f"where lengths are changed, whether {listed(spaced)} fit is not checked: their measure "
        "'misfit' must be zero"
    ]


def _unit(system: System, name: str) -> str:
    dimension = dimension_named(system.mechanism, name)
    return "" if dimension is None else system.mechanism.units.of(dimension)


def _manifest(
    system: System, changeable: Changeable, measured: MeasuredProgram, numbers: NumberProgram
) -> dict[str, Any]:
    """What an image says of itself, apart from its analyses."""
    machine = system.mechanism

    def number(name: str, follows: bool) -> dict[str, Any]:
        value, unit = float(system.values[name]), _unit(system, name)
        return {"name": name, "value": value, "unit": unit, "follows": follows}

    return {
        "format": FORMAT,
        "mbody": __version__,
        "model": machine.name,
        "title": machine.name,
        "system of units": machine.units.name,
        "units": {of: machine.units.of(of) for of in UNITS},
        "length": float(system.length),
        "numbers": [number(name, False) for name in changeable.rules]
        + [number(name, True) for name in changeable.follows],
        "not_changeable": changeable.not_changeable(),
        "measures": [
            {"name": name, "unit": unit, "of": of}
            for name, unit, of in zip(measured.names, measured.units, measured.of, strict=True)
        ],
        "inputs": list(input_numbers(system).values()),
        "states": [state.name for state in machine.states],
        "bodies": [body.name for body in machine.bodies],
        "drivers": [driver.name for driver in machine.drivers],
        "coordinates": system.coordinates,
        "primitives": [[element.name, part] for element, part in system.owners],
    }
