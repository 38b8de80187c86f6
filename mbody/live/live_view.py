"""A view that solves its model again: the core for browsers, the image and the rules of shapes."""

from __future__ import annotations

import base64
import gzip
import re
from functools import cache
from importlib import resources
from typing import Any

from mbody.errors import ModelError, SolveError
from mbody.image.changeable import Changeable, changeable_numbers
from mbody.image.model_image import to_image
from mbody.image.webassembly import MODULE, browser_core
from mbody.kernels.layout import PER_PRIMITIVE
from mbody.live.file_numbers import CutFile, file_numbers
from mbody.live.shape_places import shape_places
from mbody.model.numbers import dimension_named
from mbody.quantities.units import DIMENSIONS
from mbody.solution.contact_forces import rough_pairs
from mbody.solution.solution import Solution
from mbody.system.system import System
from mbody.views.page import Viewer, runs_of, view
from mbody.views.page_data import scene_data
from mbody.views.scene import scene

#: Dimensions of numbers that shapes follow, or do not.
SHAPES = (DIMENSIONS["length"], DIMENSIONS["angle"])
#: The files of the live part, each after those that it imports.
PARTS = ("live_shapes", "live_motion", "live_model", "live")
#: Words of the names of masses.
MASSES = ("mass", "weight", "inertia")


def live_view(model: Any, **options: Any) -> Viewer:
    """A page as of `view` that solves its first motion again while the reader drags and changes.

    The page contains the core for browsers and the image of the model, packed, about 250 kB.

    Parameters
    ----------
    model, **options
        As of `view`.

    Raises
    ------
    ModelError
        As of `view`, and where the core for browsers cannot be built, or the model has no image.

    Examples
    --------
    >>> import mbody
    >>> live_view(mbody.gallery.load("norton_fourbar"))  # doctest: +SKIP
    Viewer('Four-bar: dynamic force analysis': kinetostatics, 361 instants)
    """
    runs = runs_of(model)
    page = view(runs, **options)
    part = live_part(next(iter(runs.values())))
    page.add("live", part, live_module())
    return page


def live_part(run: Solution) -> dict[str, Any]:
    """What a live page needs beside what a recorded one has."""
    found = scene(run)
    system = run.system
    image = to_image(system, len(found.run))
    changeable = changeable_numbers(system)
    try:
        text = file_numbers(system.mechanism, list(changeable.rules))
        why = ""
    except ModelError as error:
        text, why = CutFile(), str(error)
    names = [name for one in text.numbers for name in one.factors]
    places: dict[str, Any] = {}
    try:
        followed = shape_places(found, scene_data(found, []), changeable, names)
        places = {"program": followed.program, "rules": followed.rules}
        unmoved = followed.unmoved
    except (ModelError, SolveError) as error:
        unmoved = {name: str(error) for name in names if _shapes(system, name)}
    return {
        "core": _packed(browser_core().read_bytes()),
        "image": _packed(image.content),
        "places": places,
        "text": text.parts,
        "numbers": [
            {
                "value": one.value,
                "factors": one.factors,
                "unit": one.unit or _unit(image.manifest, one.factors),
                "group": _group(system, next(iter(one.factors))),
                "why": next((unmoved[name] for name in one.factors if name in unmoved), ""),
                "moves": any(_shapes(system, name) for name in one.factors),
                "sign": _sign(changeable, one.factors),
            }
            for one in text.numbers
        ],
        "fixed": _fixed(image.manifest, names),
        "rubs": _rubs(run),
        "why": why,
    }


def _rubs(run: Solution) -> dict[str, int]:
    """By rough joint the row of the page of an instant that has the multiplier of its friction,
    whose sign is that of the sliding; of what the kinetostatics of a page solves.
    """
    first = 3 * run.system.coordinates
    found: dict[str, int] = {}
    for pair in rough_pairs(run.system) if not run.modes else ():
        if pair.loses:
            found.setdefault(pair.joint, first + PER_PRIMITIVE * pair.primitive)
    return found


def _packed(content: bytes) -> str:
    return base64.b64encode(gzip.compress(content, 9, mtime=0)).decode()


def _shapes(system: System, name: str) -> bool:
    dimension = dimension_named(system.mechanism, name)
    return dimension in SHAPES or dimension is None


def _unit(manifest: dict[str, Any], factors: dict[str, float]) -> str:
    """The unit of a number that stands alone: that of the model, degrees of angles."""
    name, factor = next(iter(factors.items()))
    unit = next((str(one["unit"]) for one in manifest["numbers"] if one["name"] == name), "")
    return "deg" if unit == "rad" and factor != 1.0 else unit


def _group(system: System, name: str) -> str:
    if "." not in name:
        return "parameters"
    owner, _, key = name.partition(".")
    if key in MASSES:
        return "masses"
    machine = system.mechanism
    if any(one.name == owner for one in machine.drivers):
        return "drivers"
    if any(one.name == owner for one in machine.loads):
        return "loads"
    return "lengths and places"


def _sign(changeable: Changeable, factors: dict[str, float]) -> str:
    signs = [changeable.rules[name].sign for name in factors]
    return next((sign for sign in signs if sign), "")


def _fixed(manifest: dict[str, Any], names: list[str]) -> dict[str, str]:
    """Numbers that no image can change, with the reason; those that follow from others not."""
    follows = {one["name"] for one in manifest["numbers"] if one["follows"]}
    fixed = manifest["not_changeable"]
    return {name: why for name, why in fixed.items() if name not in follows}


@cache
def live_module() -> str:
    """The core's module and that of live pages, as the end of the viewer's module."""
    folder = resources.files(__package__)
    live = "\n".join((folder / f"{name}.mjs").read_text("utf-8") for name in PARTS)
    parts = []
    for name, text in (("mbodyCore", MODULE.read_text("utf-8")), ("mbodyLive", live)):
        exported = re.findall(r"^export (?:class|const|function) (\w+)", text, re.M)
        plain = re.sub(r"^export |^import .*?;\n", "", text, flags=re.M)
        names = ", ".join(exported)
        parts.append(f"const {name} = (() => {{\n{plain}\nreturn {{ {names} }};\n}})();")
    parts.append("mbodyLive.begin(Viewer, mbodyCore);")
    return "\n".join(parts)
