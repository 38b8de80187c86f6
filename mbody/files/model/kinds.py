"""Which elements a model file knows, and the words that it has for them.

Taken from the classes themselves, so that a new joint, load or law appears in files, in the schema
and in the messages as soon as it is written.
"""

from __future__ import annotations

import dataclasses
import functools
import re
from typing import Any

from mbody import laws
from mbody.model import contact, coupling, driver, freewheel, joints, loads, stop
from mbody.model.element import Element
from mbody.model.one_sided_constraint import OneSided

__all__ = ["LAWS", "SECTIONS", "kind_of", "section_of", "written_fields"]


def _word(name: str) -> str:
    """``TorsionSpring`` → ``torsion_spring``, ``DCMotor`` → ``dc_motor``."""
    return re.sub(r"(?<=[a-z0-9])(?=[A-Z])|(?<=[A-Z])(?=[A-Z][a-z])", "_", name).lower()


def _elements(module: Any, base: type[Element], ending: str = "") -> dict[str, type[Element]]:
    """Classes of elements by their word, in its alphabetical order."""
    classes = [cls for cls in vars(module).values() if isinstance(cls, type)]
    found = {
        _word(cls.__name__.removesuffix(ending)): cls
        for cls in classes
        if issubclass(cls, base) and cls is not base and not cls.__name__.startswith("Custom")
    }
    return dict(sorted(found.items()))


#: Kinds of elements by section of a file.
SECTIONS: dict[str, dict[str, type[Element]]] = {
    "joints": _elements(joints, joints.Joint),
    "couplings": _elements(coupling, coupling.Coupling, "Coupling"),
    "drivers": _elements(driver, driver.Driver, "Driver"),
    "loads": _elements(loads, loads.Load),
    "contacts": {
        word: cls
        for module in (contact, freewheel, stop)
        for word, cls in _elements(module, OneSided).items()
    },
}

#: Laws by their word: those of `mbody.laws`, less what is no table of numbers in a file.
LAWS: dict[str, type[laws.Law]] = {
    _word(cls.__name__): cls
    for cls in map(vars(laws).get, dict.fromkeys([*laws.__all__, *vars(laws)]))
    if isinstance(cls, type)
    and issubclass(cls, laws.Law)
    and cls not in (laws.Law, laws.Expression, laws.Function, laws.MeasuredFormula, laws.Table2)
}


def written_fields(cls: type[Element]) -> list[dataclasses.Field[Any]]:
    """The fields of a class of elements that a file has, less its name."""
    every = dataclasses.fields(cls)
    return [one for one in every if one.name != "name" and not one.metadata.get("internal")]


@functools.lru_cache
def _words() -> dict[type, tuple[str, str]]:
    return {cls: (s, kind) for s, kinds in SECTIONS.items() for kind, cls in kinds.items()}


def kind_of(element: Element) -> str | None:
    """The word for an element's kind; None where files have none."""
    return _words().get(type(element), ("", None))[1]


def section_of(element: Element) -> str:
    """The section of an element."""
    return _words()[type(element)][0]
