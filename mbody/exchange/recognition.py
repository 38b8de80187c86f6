"""Which format a file has: judged by what is in it, not by its name."""

from __future__ import annotations

import json
import os
import re
from pathlib import Path
from typing import Any, NoReturn
from xml.etree import ElementTree

from mbody.errors import ModelError
from mbody.exchange.imported import Imported, seen
from mbody.exchange.linkage2 import linkage2_from_xml
from mbody.exchange.planar_bodies import planar_bodies
from mbody.exchange.pylinkage import (
    is_pmks_json,
    is_pmks_text,
    is_pylinkage,
    pmks_from_json,
    pmks_from_text,
    pylinkage_from_json,
)
from mbody.files.model.read import text_of
from mbody.quantities.units import unit_system

# -- ASMT, the assemblies of FreeCAD and Ondsel: recognised, and refused with what they hold ---
# The format has no published description beside its parser, and its bodies are spatial.

_HEAD = re.compile(r"\s*(freeCAD|OndselSolver|Assembly)\b.*(\n|$)")
_PARTS = re.compile(r"^\s*(\w+(?:Joint|Motion|Force|Torque))\s*$", re.MULTILINE)


def refuse_asmt(text: str) -> NoReturn:
    """Refuse an assembly, with the kinds of its joints and motions."""
    kinds = list(dict.fromkeys(_PARTS.findall(text)))
    what = f" ({', '.join(kinds[:8])})" if kinds else ""
    raise ModelError(
        f"it is an assembly of FreeCAD (ASMT){what}, whose spatial joints are not read: export it "
        "as URDF or MJCF, or describe its plane in a model file"
    )


FORMATS = (
    "PMKS (text, address, .pmks), Linkage (.linkage2), pylinkage (JSON), MJCF and URDF (planar)"
)
#: Unit systems where a file has no units.
UNITS, SI = "mm-N-s", "SI"
DEEPEST = 100  # tables in tables, elements in elements


def import_model(file: str | os.PathLike[str], units: str | None = None) -> Imported:
    """A model from a file of another program.

    Parameters
    ----------
    file : str or Path
        A file of PMKS (lines of text, or ``.pmks``), Linkage (``.linkage2``), pylinkage (JSON),
        MuJoCo (MJCF), or a URDF; or an address of PMKS, ``"http://…?mech=…"``. What it is follows
        from what is in it.
    units : str, optional
        The unit system of the model. The numbers of files without units are read in it; without it
        in mm-N-s. Files of Linkage, MJCF and URDF have units: their lengths are converted, and
        without it they are in mm-N-s or in-lbf-s, and in SI.

    Returns
    -------
    Imported
        `mechanism`, `form` and `notes`: what was assumed, and what the file has and the model has
        not.

    Raises
    ------
    ModelError
        For a file that cannot be read, of another format, or with an element that would change the
        motion and has no counterpart; the element is named.

    Examples
    --------
    >>> address = "https://example.org/sim?mech=ground,crank,R,0,0|crank,rod,R,0,10"
    >>> import_model(address).mechanism
    Mechanism('PMKS': 2 bodies, 2 joints, 1 driver, 0 loads, mm-N-s)
    """
    if units is not None:
        unit_system(units)
    given = os.fspath(file)
    if re.match(r"https?:", str(given)):
        if "mech=" not in str(given):
            raise ModelError(
                f"the address {seen(given)} has no mechanism that is read: addresses of PMKS with "
                "mech=… are, those of PMKS+ (?0P…) and others are not; export a file there"
            )
        return pmks_from_text(str(given), "PMKS", units or UNITS)
    path = Path(given)
    try:
        return _imported(text_of(path), path, units)
    except RecursionError:
        raise ModelError(f"'{path.name}': its parts are nested too deep") from None
    except ModelError as error:
        if str(path.name) in str(error):
            raise
        raise ModelError(f"'{path.name}': {error}") from None


def other_program(file: str | os.PathLike[str]) -> str:
    """Whose file it seems to be, such as "Linkage"; empty where it is no file that is imported, or
    cannot be read.

    >>> other_program("no such file")
    ''
    """
    try:
        text = text_of(Path(file))
        start = text.lstrip()[:1]
        if start == "<":
            tag = ElementTree.fromstring(text).tag
            return {"linkage2": "Linkage", "mujoco": "MuJoCo", "robot": "URDF"}.get(tag, "")
        if start == "{":
            data: Any = json.loads(text)
            return "PMKS" if is_pmks_json(data) else "pylinkage" if is_pylinkage(data) else ""
        return "PMKS" if is_pmks_text(text) else ""
    except (ModelError, ElementTree.ParseError, ValueError, RecursionError):
        return ""


def _imported(text: str, path: Path, units: str | None) -> Imported:
    """The model of a text."""
    start = text.lstrip()[:1]
    if not start:
        raise ModelError("it is empty")
    if start == "<":
        return _from_xml(text, path, units)
    if start == "{":
        return _from_json(text, path.stem, units)
    if bool(_HEAD.match(text)) and "Assembly" in text[:2000]:
        refuse_asmt(text)
    if is_pmks_text(text):
        return pmks_from_text(text, path.stem, units or UNITS)
    raise ModelError(f"it is of no format that is read: {FORMATS}")


def _from_json(text: str, name: str, units: str | None) -> Imported:
    try:
        data: Any = json.loads(text)
    except ValueError as error:
        raise ModelError(f"it is no JSON: {error}") from None
    if is_pmks_json(data):
        return pmks_from_json(data, name, units or UNITS)
    if is_pylinkage(data):
        return pylinkage_from_json(data, name, units or UNITS)
    keys = ", ".join(map(seen, list(data)[:8]))
    its = f"its tables ({keys}) are" if keys else "it is"
    raise ModelError(f"{its} of no format that is read: {FORMATS}")


def _from_xml(text: str, path: Path, units: str | None) -> Imported:
    if re.search(r"<!\s*(DOCTYPE|ENTITY)", text):
        raise ModelError("it declares entities (<!DOCTYPE>), which are not read: leave them out")
    try:
        root = ElementTree.fromstring(text)
    except (ElementTree.ParseError, ValueError) as error:
        raise ModelError(f"it is no XML: {error}") from None
    if root.tag == "linkage2":
        return linkage2_from_xml(root, path.stem, units)
    if root.tag in ("mujoco", "robot"):
        return planar_bodies(path, root, units or SI)
    raise ModelError(f"its root element is <{root.tag}>: {FORMATS} are read")
