"""modelDescription.xml of a co-simulation unit, of FMI 2.0 and 3.0."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any
from xml.sax.saxutils import quoteattr

from mbody.image.si_units import SiUnit, si_unit
from mbody.quantities.units import Dimension

__all__ = ["INPUT", "OUTPUT", "PARAMETER", "STATE", "UnitFacts", "UnitVariable", "description"]

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

    Attributes
    ----------
    reference : int
        The number of its entry in the image.
    name, kind : str
        `kind`: PARAMETER, INPUT, OUTPUT or STATE.
    unit : str
        That of the model, in which `description` shows it; values are in SI.
    start : float or None
        In SI.
    text : str
        What it is, in words.
    """

    reference: int
    name: str
    kind: str
    unit: str = ""
    start: float | None = None
    text: str = ""


@dataclass(frozen=True)
class UnitFacts:
    """What the description says of a unit beside its variables.

    Attributes
    ----------
    name, identifier, text : str
        Of the model, of the binaries, and the note of the model.
    token : str
        guid, or instantiation token.
    digest, tool : str
        SHA-256 of the image; what has made it.
    first, last, step : float
        Times [s] of the motion of the description, and how far its instants are apart.
    tolerance : float
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
    """What the unit can do."""
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
        shown = found.setdefault(si.name, (si, {}))[1]
        name = _shown(one.unit)
        if name:
            shown[name] = si_unit(name).factor
    lines = ["  <UnitDefinitions>"]
    for name, (si, shown) in found.items():
        lines += [f"    <Unit name={quoteattr(name)}>", f"      <BaseUnit{_base(si.dimension)}/>"]
        for text, factor in shown.items():
            given = {"name": text, "factor": repr(1.0 / factor)}
            lines.append(f"      <DisplayUnit{_attributes(given)}/>")
        lines.append("    </Unit>")
    return [*lines, "  </UnitDefinitions>"]


def _shown(unit: str) -> str:
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
    si, shown = si_unit(one.unit), _shown(one.unit)
    found: dict[str, Any] = {} if one.start is None else {"start": repr(float(one.start))}
    if si.name:
        found["unit"] = si.name
        if shown:
            found["displayUnit"] = shown
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
    """The same by value references."""
    outputs = [one for one in variables if KINDS[one.kind][0] == "output"]
    lines = [f'    <Output valueReference="{one.reference}"/>' for one in outputs]
    return lines + [
        f'    <InitialUnknown valueReference="{one.reference}"/>'
        for one in outputs
        if one.kind == OUTPUT
    ]
