"""Co-simulation units (FMI 2.0 and 3.0) of a model: its image, its description, the binaries."""

from __future__ import annotations

import hashlib
import io
import re
import struct
import zipfile
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from html import escape
from pathlib import Path
from typing import Any

from mbody._version import __version__
from mbody.analysis.position.assembly_analysis import as_system
from mbody.errors import ModelError, brief
from mbody.image.arena import INPUT as INPUT_ENTRY
from mbody.image.arena import MEASURE as MEASURE_ENTRY
from mbody.image.arena import NUMBER as NUMBER_ENTRY
from mbody.image.arena import STATE as STATE_ENTRY
from mbody.image.arena import ImageEntry
from mbody.image.fmu_binaries import Platform, fmu_binaries
from mbody.image.fmu_description import (
    INPUT,
    OUTPUT,
    PARAMETER,
    STATE,
    UnitFacts,
    UnitVariable,
    description,
)
from mbody.image.model_image import ModelImage, to_image
from mbody.image.si_units import si_unit
from mbody.model.mechanism import Mechanism
from mbody.system.system import System

__all__ = ["VERSIONS", "ModelFmu", "to_fmu"]

#: The versions of FMI.
VERSIONS = ("3.0", "2.0")
#: The image in the archive, and the time that all files there have: equal units are equal bytes.
IMAGE, WHEN = "resources/model.image", (1980, 1, 1, 0, 0, 0)
#: Numbers of the ground that move nothing.
OF_THE_GROUND = {f"ground.{key}" for key in ("mass", "weight", "inertia", "cg.x", "cg.y")}
#: Letters of the name of a binary.
LONGEST = 60


@dataclass(frozen=True)
class ModelFmu:
    """A unit of co-simulation.

    Attributes
    ----------
    content : bytes
        Of the .fmu file.
    description : str
        Its modelDescription.xml.
    variables : tuple of UnitVariable
        Parameters, inputs, outputs and states.
    notes : tuple of str
        What it lacks, in sentences.
    platforms : tuple of str
        For which machines it has binaries, as FMI 3.0 names them.
    """

    content: bytes
    description: str
    variables: tuple[UnitVariable, ...]
    notes: tuple[str, ...]
    platforms: tuple[str, ...]


def to_fmu(
    model: Mechanism | System,
    version: str = VERSIONS[0],
    *,
    name: str | None = None,
    binaries: Mapping[Platform, Path] | None = None,
) -> ModelFmu:
    """The free motion of a mechanism as a unit of co-simulation, which runs without Python.

    Parameters
    ----------
    model : Mechanism or System
    version : str
        Of FMI: "3.0" or "2.0".
    name : str, optional
        Of its binaries, letters, digits and _; by default that of the mechanism.
    binaries : mapping, optional
        The binary of every platform; by default those of `fmu_binaries`, which are built where
        they are missing (once).

    Returns
    -------
    ModelFmu
        Its variables have dotted names; all values are in SI, angles in rad.

    Raises
    ------
    ModelError
        For a version that there is not, users' Python, and a mechanism without a free motion that
        an image can make.

    Examples
    --------
    >>> from mbody import gallery
    >>> made = to_fmu(gallery.load("simple_pendulum"), "3.0", binaries={})
    >>> [one.name for one in made.variables if one.kind == "parameter"][:2]
    ['l', 'pendulum.mass']
    """
    if version not in VERSIONS:
        known = " or ".join(repr(one) for one in VERSIONS)
        raise ModelError(f"units are of FMI {known}, not {brief(version)}: give one of them")
    system = as_system(model)
    image = to_image(system, 2, ("free",))
    variables = tuple(_told_apart(_variables(system, image)))
    files = fmu_binaries() if binaries is None else binaries
    identifier = _identifier(system.mechanism.name if name is None else name)
    text = description(version, _facts(system, image, identifier), variables)
    places = {one: one.fmi_2 if version == "2.0" else one.fmi_3 for one in files}
    archive = io.BytesIO()
    with zipfile.ZipFile(archive, "w") as whole:
        _write(whole, "modelDescription.xml", text.encode())
        _write(whole, IMAGE, image.content)
        _write(whole, "documentation/index.html", _page(system, image, variables).encode())
        for one, file in files.items():
            if places[one]:
                suffix = file.suffix
                _write(whole, f"binaries/{places[one]}/{identifier}{suffix}", file.read_bytes())
    platforms = tuple(one.fmi_3 for one in files if places[one])
    return ModelFmu(archive.getvalue(), text, variables, tuple(image.notes), platforms)


def _write(archive: zipfile.ZipFile, name: str, content: bytes) -> None:
    """A file of the archive, whose bytes depend on nothing else."""
    entry = zipfile.ZipInfo(name, WHEN)
    entry.compress_type = zipfile.ZIP_DEFLATED
    entry.external_attr = (0o755 if name.startswith("binaries/") else 0o644) << 16
    archive.writestr(entry, content)


def _identifier(name: str) -> str:
    """A name of a C function made of another name.

    >>> _identifier("Mud pump: two cylinders"), _identifier("4bar")
    ('Mud_pump_two_cylinders', '_4bar')
    """
    plain = re.sub(r"[^A-Za-z0-9]+", "_", name).strip("_")[:LONGEST] or "model"
    return f"_{plain}" if plain[0].isdigit() else plain


def _variables(system: System, image: ModelImage) -> Iterable[UnitVariable]:
    """Every entry of the image that is a variable; of an own state and an input, one."""
    about = image.manifest
    taken = {*about["inputs"], *about["states"]}
    constants = {f"{name}.value" for name in about["inputs"]}
    of = {one["name"]: one["of"] for one in about["measures"]}
    for reference, entry in enumerate(image.entries):
        one, unit = entry.name, entry.unit
        if entry.kind == NUMBER_ENTRY:
            if one in constants or one in OF_THE_GROUND:
                continue
            start = _start(image, entry)
            yield UnitVariable(reference, one, PARAMETER, unit, start, _what(system, one))
        elif entry.kind == INPUT_ENTRY:
            yield UnitVariable(reference, one, INPUT, unit, _start(image, entry), "input")
        elif entry.kind == STATE_ENTRY:
            rate = f"own state, integrated with the motion: {_rate(system, one)}"
            yield UnitVariable(reference, one, STATE, unit, _start(image, entry), rate)
        elif entry.kind == MEASURE_ENTRY and one not in taken:
            text = "" if of[one] == one else of[one]
            yield UnitVariable(reference, one, OUTPUT, unit, None, text)


def _told_apart(variables: Iterable[UnitVariable]) -> Iterable[UnitVariable]:
    """The same with names that differ, as where a parameter and a measure have one name: the later
    one has its kind behind.
    """
    known: set[str] = {"time"}
    for one in variables:
        name = one.name if one.name not in known else f"{one.name}.{one.kind}"
        known.add(name)
        yield replace(one, name=name)


def _start(image: ModelImage, entry: ImageEntry) -> float:
    """The number of an entry, in SI, as the unit itself computes it."""
    (value,) = struct.unpack_from("<d", image.content, entry.offset)
    return float(value) * si_unit(entry.unit).factor


def _what(system: System, name: str) -> str:
    return "parameter of the model" if name in system.mechanism.parameters else ""


def _rate(system: System, name: str) -> str:
    rate: Any = next(one.rate for one in system.mechanism.states if one.name == name)
    return str(getattr(rate, "text", rate))


def _facts(system: System, image: ModelImage, identifier: str) -> UnitFacts:
    """What the description says of the model."""
    machine, free = system.mechanism, image.manifest["free"]
    (checksum,) = struct.unpack_from("<Q", image.content, 8 * 13)
    second = si_unit(machine.units.time).factor
    first, last = (second * t for t in free["times"])
    return UnitFacts(
        name=machine.name,
        identifier=identifier,
        text=getattr(machine, "note", "") or "",
        token=f"{{{checksum:016x}}}",
        digest=hashlib.sha256(image.content).hexdigest(),
        tool=f"mbody {__version__}",
        first=first,
        last=last,
        step=second * free["every"],
        tolerance=free["rtol"],
    )


def _page(system: System, image: ModelImage, variables: Iterable[UnitVariable]) -> str:
    """The documentation in the archive: variables and notes."""
    rows = "\n".join(
        f"<tr><td>{escape(one.name)}</td><td>{one.kind}</td>"
        f"<td>{escape(si_unit(one.unit).name)}</td>"
        f"<td>{'' if one.start is None else repr(one.start)}</td><td>{escape(one.text)}</td></tr>"
        for one in variables
    )
    notes = "\n".join(f"<li>{escape(note)}</li>" for note in image.notes)
    name = escape(system.mechanism.name)
    return (
        f'<!DOCTYPE html>\n<html lang="en"><head><meta charset="utf-8"><title>{name}</title>'
        f"</head>\n<body><h1>{name}</h1>\n<p>Made by mbody {__version__}. All values are in SI, "
        "angles in rad. Parameters may change at any communication point. Inputs keep their value "
        "during a step. A state may be set before the motion begins.</p>\n"
        f"<ul>{notes}</ul>\n<table><tr><th>variable</th><th>kind</th><th>unit</th><th>start</th>"
        f"<th>what</th></tr>\n{rows}\n</table></body></html>\n"
    )
