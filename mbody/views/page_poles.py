"""Instant centres, centrodes and polygons of a page, as histories."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from mbody.engineering.instant_centres import InstantCentre, InstantCentres, instant_centres
from mbody.engineering.motion_polygons import MotionPolygon, acceleration_polygon, velocity_polygon
from mbody.errors import SolveError
from mbody.solution.solution import Solution
from mbody.views.labels import symbolic
from mbody.views.page_data import text_runs
from mbody.views.scene import Scene

__all__ = ["poles_data"]

Array = np.ndarray

#: With more bodies than this, or more numbers, a page has no centres and no polygons.
BODIES, NUMBERS = 12, 200_000
#: Further from the middle of the motion than so many times its size a centre is left out.
FAR = 6.0
#: Digits of the greatest velocity of a polygon: a tenth of a pixel has four.
DIGITS = 5


def poles_data(scene: Scene) -> dict[str, Any] | None:
    """The instant centres of all pairs of bodies, with the centrodes of those that wander, and the
    velocity and acceleration polygons; None of statics, of one instant and of many bodies.

    Parameters
    ----------
    scene : Scene

    Returns
    -------
    dict
        ``centres``: a list of {"t", "kind", "of", "x", "y"}, names, permanence, the two bodies by
        number, and places; with {"on", "u", "v"} the moving centrode against the ground in the
        axes of a body. ``polygons``: by quantity {"points", "links", "slides"}.

    Examples
    --------
    >>> import mbody
    >>> from mbody.views.scene import scene
    >>> made = scene(mbody.kinematics(mbody.makers.four_bar(1, 3, 2, 3.5), turn=True))
    >>> len(poles_data(made)["centres"])
    6
    """
    run = scene.run
    count = len(run.mechanism.bodies)
    pairs = count * (count + 1) // 2
    if run.analysis in ("statics", "close_loops") or len(run) < 2 or count > BODIES:
        return None
    if 2 * pairs * len(run) > NUMBERS:
        return None
    try:
        found = instant_centres(run)
        polygons = [velocity_polygon(run), acceleration_polygon(run)]
    except SolveError:
        return None
    places = max(0, 3 - math.floor(math.log10(scene.unit)))
    low, high = np.asarray(scene.low, dtype=float), np.asarray(scene.high, dtype=float)
    middle, far = 0.5 * (low + high), FAR * float(np.hypot(*(high - low)))
    centres = [_centre(run, found, one, middle, far, places) for one in found.pairs]
    return {
        "centres": [one for one in centres if one is not None],
        "polygons": {one.quantity: _polygon(one) for one in polygons},
    }


def _centre(
    run: Solution,
    found: InstantCentres,
    one: InstantCentre,
    middle: Array,
    far: float,
    places: int,
) -> dict[str, Any] | None:
    """A centre that is somewhere near; None of one that never is."""
    x, y = np.array(one.x), np.array(one.y)
    with np.errstate(invalid="ignore"):
        away = ~(np.hypot(x - middle[0], y - middle[1]) <= far)
    if away.all():
        return None
    x[away] = y[away] = np.nan
    bodies = [found.bodies.index(name) for name in one.bodies]
    name = found.symbol(one)
    data: dict[str, Any] = {
        "t": text_runs(f"$I_{{{name[1:]}}}$"),
        "kind": one.permanence,
        "of": list(one.bodies),
        "x": _rounded(x, places),
        "y": _rounded(y, places),
    }
    if one.permanence == "instantaneous" and "ground" in one.bodies:
        moving = next(name for name in one.bodies if name != "ground")
        body = run[moving]
        own = ((x - body.x) + 1j * (y - body.y)) * np.exp(-1j * body.angle)
        data |= {
            "on": max(bodies),
            "u": _rounded(own.real, places),
            "v": _rounded(own.imag, places),
        }
    return data


def _polygon(found: MotionPolygon) -> dict[str, Any]:
    """Images with their names, those of links, and what slides between two images."""
    names = list(found.x)
    sizes = np.array([np.hypot(found.x[name], found.y[name]) for name in names])
    finite = sizes[np.isfinite(sizes)]
    peak = float(finite.max()) if finite.size else 0.0
    places = DIGITS - 1 - math.floor(math.log10(peak)) if peak > 0.0 else 0
    number = {name: n for n, name in enumerate(names)}
    points = [
        {
            "t": text_runs(symbolic(name.rpartition(".")[2].rpartition(" at ")[2])),
            "n": name,
            "x": _rounded(found.x[name], places),
            "y": _rounded(found.y[name], places),
        }
        for name in names
    ]
    links = {body: [number[name] for name in own] for body, own in found.links.items()}
    slides = [
        [number[name] for name in pair]
        for pair in found.joints.values()
        if len(pair) == 2
        and any(
            np.abs(table[pair[0]] - table[pair[1]]).max(initial=0.0) > 1e-9 * peak
            for table in (found.x, found.y)
        )
    ]
    return {"points": points, "links": links, "slides": slides}


def _rounded(values: Array, places: int) -> list[float | None]:
    rounded = np.round(np.asarray(values, dtype=float), min(places, 300)) + 0.0
    return [None if v != v else v for v in rounded.tolist()]
