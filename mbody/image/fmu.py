"""Co-simulation units (FMI 2.0 and 3.0) of a model: its image, its description, the binaries."""

from __future__ import annotations

import hashlib
import io
import platform
import re
import struct
import sys
import tempfile
import zipfile
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from html import escape
from importlib.util import find_spec
from pathlib import Path
from typing import Any
from xml.sax.saxutils import quoteattr

from mbody._version import __version__
from mbody.analysis.position.assembly_analysis import as_system
from mbody.core.libraries import by_library
from mbody.core.native_builder import builder_command, builder_fails, place, progress
from mbody.core.selection import PACKAGE, STAMP_DIGITS, cache_folder, linker, source_hash
from mbody.errors import ModelError, brief
from mbody.image.arena import IMAGE_KERNELS, ImageEntry
from mbody.image.arena import INPUT as INPUT_ENTRY
from mbody.image.arena import MEASURE as MEASURE_ENTRY
from mbody.image.arena import NUMBER as NUMBER_ENTRY
from mbody.image.arena import STATE as STATE_ENTRY
from mbody.image.model_image import ModelImage, SiUnit, si_unit, to_image
from mbody.model.mechanism import Mechanism
from mbody.quantities.units import Dimension
from mbody.system.system import System

# -- The binaries of co-simulation units: those of the package, or built once on this machine --

#: Where the C files are, and those that make a unit of an image and the kernels.
SHELL = PACKAGE / "image" / "c"
SOURCES = ("mbody.c", "fmi2.c", "fmi3.c", "fmu.c")
#: What is read beside them.
HEADERS = ("mbody.h", "fmu.h")


@dataclass(frozen=True)
class Platform:
    """A kind of machine, as FMI names it.

    `target`: Of `mbody compile`.
    `file`: What the compiler names the binary.
    `fmi_2`, `fmi_3`: Its folder under binaries/; empty where the version has none.
    """

    target: str
    file: str
    fmi_2: str
    fmi_3: str


PLATFORMS = (
    Platform("x86-64-v2", "linux-x86-64-v2.fmu.so", "linux64", "x86_64-linux"),
    Platform("aarch64", "linux-aarch64.fmu.so", "", "aarch64-linux"),
    Platform("windows", "windows-x86-64-v3.fmu.dll", "win64", "x86_64-windows"),
    Platform("macos", "macos-arm64.fmu.dylib", "darwin64", "aarch64-darwin"),
)
#: What is made where nothing links for other machines: the kernels of this one.
OF_THIS_MACHINE = "host.fmu.so"


def fmu_binaries() -> Mapping[Platform, Path]:
    """The binaries by platform, built where neither the package nor the cache has them."""
    found = _binaries_in(PACKAGE / "core_libraries")
    if found:
        return found
    folder = cache_folder(_stamp())
    if folder is None:
        raise ModelError(
            "the binaries of co-simulation units have to be built, and no folder to keep them can "
            "be written: set MBODY_CACHE_DIR"
        )
    found = _binaries_in(folder)
    if not found:
        _build(folder)
        found = _binaries_in(folder)
    return found


def _binaries_in(folder: Path) -> dict[Platform, Path]:
    """Those of a folder that were made from the present sources; none without one of Linux on
    this machine's processor where they are made here.
    """
    sources = (source_hash() or "none").encode()
    found = {}
    for one in PLATFORMS:
        names = [one.file]
        if one is _this_platform():
            names.append(OF_THIS_MACHINE)
        for file in (folder / name for name in names):
            if one not in found and file.exists() and sources in file.read_bytes():
                found[one] = file
    return found


def _this_platform() -> Platform | None:
    """The platform of this machine, where binaries are built."""
    if not sys.platform.startswith("linux"):
        return None
    return PLATFORMS[1] if platform.machine() in ("aarch64", "arm64") else PLATFORMS[0]


def _stamp() -> str:
    """Of the sources of kernels and shell, the name of the folder that has their binaries."""
    digest = hashlib.sha256(f"fmu {source_hash() or ''}".encode())
    for name in (*SOURCES, *HEADERS):
        digest.update((SHELL / name).read_bytes())
    return digest.hexdigest()[:STAMP_DIGITS]


def _build(folder: Path) -> None:
    """Build the binaries into a folder: with ziglang for all machines, else for this one."""
    zig = find_spec("ziglang") is not None
    here = _this_platform()
    missing = [] if find_spec("numba") else ["numba"]
    if not zig and (here is None or linker() is None):
        missing.append("ziglang")
    if missing:
        raise ModelError(
            "the binaries of co-simulation units are built by numba and a C compiler, not all of "
            f"which are installed: pip install {' '.join(missing)}"
        )
    targets = [one.target for one in PLATFORMS] if zig else ["host"]
    options = [word for target in targets[1:] for word in ("--also", target)]
    options += [word for name in SOURCES for word in ("--with", str(SHELL / name))]
    names = [place(kernel) for kernel in IMAGE_KERNELS]
    say = progress(
        "the binaries of co-simulation units", len(by_library(IMAGE_KERNELS)) + len(targets)
    )
    with tempfile.TemporaryDirectory(dir=folder) as made:
        out = Path(made)
        command, settings = builder_command(names, targets[0], out, "--whole", *options)
        last = builder_fails(command, settings, say)
        if last is not None:
            raise ModelError(
                f"the binaries of co-simulation units could not be built; the builder said:\n{last}"
            )
        for file in out.iterdir():
            file.replace(folder / file.name)


# -- modelDescription.xml of a co-simulation unit, of FMI 2.0 and 3.0 --------------------------

#: What a variable is.
PARAMETER, INPUT, OUTPUT, STATE = "parameter", "input", "output", "state"
#: Causality, variability and initial of each; a state is an output that begins at a given value.
KINDS = {
    PARAMETER: ("parameter", "tunable", "exact"),
    INPUT: ("input", "continuous", ""),
    OUTPUT: ("output", "continuous", "calculated"),
    STATE: ("output", "continuous", "exact"),
}
#: The value reference of the time: `mbody/image/c/fmu.c`.
TIME_REFERENCE = 2**31 - 1
#: Names that FMI calls structured; others are flat.
STRUCTURED = re.compile(r"[A-Za-z_][A-Za-z0-9_]*(\.[A-Za-z_][A-Za-z0-9_]*)*", re.ASCII)
LOGGED = ("logStatusWarning", "logStatusDiscard", "logStatusError")


@dataclass(frozen=True)
class UnitVariable:
    """A variable of a unit.

    `reference`: The number of its entry in the image.
    `name`, `kind`: `kind`: PARAMETER, INPUT, OUTPUT or STATE.
    `unit`: That of the model, in which `description` shows it; values are in SI.
    `start`: In SI.
    `text`: What it is, in words.
    """

    reference: int
    name: str
    kind: str
    unit: str = ""
    start: float | None = None
    text: str = ""


@dataclass(frozen=True)
class UnitFacts:
    """Facts of a unit's description beside its variables.

    `name`, `identifier`, `text`: Of the model, of the binaries, and the note of the model.
    `token`: guid, or instantiation token.
    `digest`, `tool`: SHA-256 of the image; what has made it.
    `first`, `last`, `step`: Times [s] of the motion of the description, and how far its instants
      are apart.
    """

    name: str
    identifier: str
    text: str
    token: str
    digest: str
    tool: str
    first: float
    last: float
    step: float
    tolerance: float


def description(version: str, facts: UnitFacts, variables: Iterable[UnitVariable]) -> str:
    """The text of modelDescription.xml; `version` is "2.0" or "3.0".

    >>> facts = UnitFacts("a", "a", "", "{1}", "0", "mbody", 0.0, 1.0, 0.01, 1e-8)
    >>> 'fmiVersion="3.0"' in description("3.0", facts, [])
    True
    """
    own = list(variables)
    flat = not all(STRUCTURED.fullmatch(one.name) for one in own)
    head = {
        "fmiVersion": version,
        "modelName": facts.name,
        "guid" if version == "2.0" else "instantiationToken": facts.token,
        "description": facts.text,
        "version": facts.digest[:16],
        "generationTool": facts.tool,
        "variableNamingConvention": "flat" if flat else "structured",
    }
    times = {
        "startTime": repr(facts.first),
        "stopTime": repr(facts.last),
        "tolerance": repr(facts.tolerance),
        "stepSize": repr(facts.step),
    }
    two = version == "2.0"
    logged = [f'    <Category name="{name}"/>' for name in LOGGED]
    before = _notes("VendorAnnotations", "Tool", "name", facts) if two else []
    after = [] if two else _notes("Annotations", "Annotation", "type", facts)
    listed = list(_two(own) if two else _three(own))
    structure = list(_structure_two(own) if two else _structure_three(own))
    lines = [
        '<?xml version="1.0" encoding="UTF-8"?>',
        f"<fmiModelDescription{_attributes(head)}>",
        f"  <CoSimulation{_attributes(_abilities(version, facts.identifier))}/>",
        *_units(own),
        "  <LogCategories>",
        *logged,
        "  </LogCategories>",
        f"  <DefaultExperiment{_attributes(times)}/>",
        *before,
        "  <ModelVariables>",
        *listed,
        "  </ModelVariables>",
        "  <ModelStructure>",
        *structure,
        "  </ModelStructure>",
        *after,
        "</fmiModelDescription>",
    ]
    return "\n".join(lines) + "\n"


def _attributes(values: Mapping[str, Any]) -> str:
    """XML attributes; those without a value are left out."""
    return "".join(f" {key}={quoteattr(str(v))}" for key, v in values.items() if v != "")


def _abilities(version: str, identifier: str) -> dict[str, str]:
    """Capability flags of the unit, by attribute."""
    common = {
        "modelIdentifier": identifier,
        "needsExecutionTool": "false",
        "canHandleVariableCommunicationStepSize": "true",
        "canBeInstantiatedOnlyOncePerProcess": "false",
    }
    if version == "2.0":
        return common | {
            "canInterpolateInputs": "false",
            "maxOutputDerivativeOrder": "0",
            "canNotUseMemoryManagementFunctions": "true",
            "canGetAndSetFMUstate": "true",
            "canSerializeFMUstate": "true",
            "providesDirectionalDerivative": "false",
        }
    return common | {
        "canGetAndSetFMUState": "true",
        "canSerializeFMUState": "true",
        "providesDirectionalDerivatives": "false",
        "providesAdjointDerivatives": "false",
        "providesIntermediateUpdate": "false",
        "canReturnEarlyAfterIntermediateUpdate": "false",
        "hasEventMode": "true",
        "maxOutputDerivativeOrder": "0",
    }


def _notes(owner: str, element: str, key: str, facts: UnitFacts) -> list[str]:
    """The digest of the image, in the place for other tools' own words."""
    return [
        f"  <{owner}>",
        f'    <{element} {key}="org.mbody"><image sha256="{facts.digest}"/></{element}>',
        f"  </{owner}>",
    ]


# -- units ------------------------------------------------------------------------------------


def _units(variables: list[UnitVariable]) -> list[str]:
    """UnitDefinitions: the SI units, each with the model's own as units to be shown."""
    found: dict[str, tuple[SiUnit, dict[str, float]]] = {"s": (si_unit("s"), {})}
    for one in variables:
        si = si_unit(one.unit)
        if not si.name:
            continue
        display_units = found.setdefault(si.name, (si, {}))[1]
        name = _display_unit(one.unit)
        if name:
            display_units[name] = si_unit(name).factor
    lines = ["  <UnitDefinitions>"]
    for name, (si, display_units) in found.items():
        lines += [f"    <Unit name={quoteattr(name)}>", f"      <BaseUnit{_base(si.dimension)}/>"]
        for text, factor in display_units.items():
            given = {"name": text, "factor": repr(1.0 / factor)}
            lines.append(f"      <DisplayUnit{_attributes(given)}/>")
        lines.append("    </Unit>")
    return [*lines, "  </UnitDefinitions>"]


def _display_unit(unit: str) -> str:
    """In which unit a variable is shown: the model's own, angles in degrees; empty: in SI."""
    if unit == "rad":
        return "deg"
    return "" if si_unit(unit).factor == 1.0 else unit


def _base(dimension: Dimension) -> str:
    """The powers of a dimension; FMI has whole ones only."""
    powers = {
        "kg": dimension.mass,
        "m": dimension.length,
        "s": dimension.time,
        "A": dimension.current,
        "K": dimension.temperature,
        "rad": dimension.angle,
    }
    return _attributes({k: int(p) for k, p in powers.items() if p and p.denominator == 1})


def _in_units(one: UnitVariable) -> dict[str, Any]:
    """Start and units of a variable."""
    si, display_unit = si_unit(one.unit), _display_unit(one.unit)
    found: dict[str, Any] = {} if one.start is None else {"start": repr(float(one.start))}
    if si.name:
        found["unit"] = si.name
        if display_unit:
            found["displayUnit"] = display_unit
    return found


# -- variables --------------------------------------------------------------------------------


def _named(one: UnitVariable) -> dict[str, Any]:
    causality, variability, initial = KINDS[one.kind]
    return {
        "name": one.name,
        "valueReference": one.reference,
        "description": one.text,
        "causality": causality,
        "variability": variability,
        "initial": initial,
    }


TIME = {
    "name": "time",
    "valueReference": TIME_REFERENCE,
    "causality": "independent",
    "variability": "continuous",
}


def _two(variables: list[UnitVariable]) -> list[str]:
    """Variables of FMI 2.0."""
    made = [(_named(one), _in_units(one)) for one in variables] + [(TIME, {"unit": "s"})]
    return [
        f"    <ScalarVariable{_attributes(named)}><Real{_attributes(units)}/></ScalarVariable>"
        for named, units in made
    ]


def _three(variables: list[UnitVariable]) -> list[str]:
    """Variables of FMI 3.0."""
    made = [_named(one) | _in_units(one) for one in variables] + [TIME | {"unit": "s"}]
    return [f"    <Float64{_attributes(one)}/>" for one in made]


def _structure_two(variables: list[UnitVariable]) -> list[str]:
    """Outputs, and those of them that are computed when the motion begins; by their places."""
    outputs = [n for n, one in enumerate(variables, 1) if KINDS[one.kind][0] == "output"]
    unknown = [n for n in outputs if variables[n - 1].kind == OUTPUT]
    lines: list[str] = []
    for owner, places in (("Outputs", outputs), ("InitialUnknowns", unknown)):
        if places:
            lines.append(f"    <{owner}>")
            lines += [f'      <Unknown index="{n}"/>' for n in places]
            lines.append(f"    </{owner}>")
    return lines


def _structure_three(variables: list[UnitVariable]) -> list[str]:
    """Lines of the model structure of FMI 3.0, by value references."""
    outputs = [one for one in variables if KINDS[one.kind][0] == "output"]
    lines = [f'    <Output valueReference="{one.reference}"/>' for one in outputs]
    return lines + [
        f'    <InitialUnknown valueReference="{one.reference}"/>'
        for one in outputs
        if one.kind == OUTPUT
    ]


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

    `content`: Of the .fmu file.
    `description`: Its modelDescription.xml.
    `variables`: Parameters, inputs, outputs and states.
    `notes`: What it lacks, in sentences.
    `platforms`: For which machines it has binaries, as FMI 3.0 names them.
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
    variables = tuple(_with_distinct_names(_variables(system, image)))
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
    """Every entry of the image that is a variable; of an auxiliary state and an input, one."""
    about = image.manifest
    signals = {*about["inputs"], *about["states"]}
    constants = {f"{name}.value" for name in about["inputs"]}
    measured = {one["name"]: one["of"] for one in about["measures"]}
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
            rate = f"auxiliary state, integrated with the motion: {_rate(system, one)}"
            yield UnitVariable(reference, one, STATE, unit, _start(image, entry), rate)
        elif entry.kind == MEASURE_ENTRY and one not in signals:
            text = "" if measured[one] == one else measured[one]
            yield UnitVariable(reference, one, OUTPUT, unit, None, text)


def _with_distinct_names(variables: Iterable[UnitVariable]) -> Iterable[UnitVariable]:
    """Variables with distinct names: where a parameter and a measure have one name, the later one
    has its kind appended.
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
    """Facts of the model for the unit's description."""
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
