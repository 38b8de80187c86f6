"""A scene and its numbers as the JSON of a page."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from typing import Any

import numpy as np

from mbody.core.tolerances import DRAWN_RETURNS, POINT_SAME, PRINTED_NONE
from mbody.errors import ModelError
from mbody.model.driver import AngleDriver
from mbody.model.loads import Force
from mbody.model.simulation import measure_named
from mbody.quantities.units import DIMENSIONS, name_of
from mbody.solution.declared_result import ResultColumn
from mbody.solution.histories import Place, moved
from mbody.solution.measures import shown_measure
from mbody.solution.result_table import shown_table
from mbody.solution.solution import Solution
from mbody.summaries.text_table import floor_of, force_names
from mbody.views.acting import contact_arrows, line_of_action, notation, sign_history
from mbody.views.labels import (
    DRIVER,
    FORCE,
    GROUND,
    INK,
    LINK,
    LOAD,
    PAPER,
    PLATE,
    SOFT,
    WHEEL,
    symbolic,
)
from mbody.views.scene import Scene, sketched
from mbody.views.shapes import Carrier, Pose, one_way
from mbody.views.sketch import KeptShape, mode_rows

Array = np.ndarray

#: What a colour of the paper is for; the page has a light and a dark one for each.
ROLES = {
    INK: "ink",
    LINK: "link",
    PLATE: "plate",
    WHEEL: "wheel",
    GROUND: "ground",
    SOFT: "soft",
    LOAD: "load",
    FORCE: "force",
    DRIVER: "drive",
    PAPER: "paper",
    "none": "none",
}
#: Digits of a history, counted from its peak: an error of 5e-8 of the peak, where the page promises
#: 1e-6, and a file a third shorter than with all digits.
KEPT = 8
#: Quantities of the page by the keys of its scripts.
KINDS = {
    "length": "length",
    "time": "time",
    "angle": "angle",
    "force": "force",
    "torque": "torque",
    "v": "velocity",
    "a": "acceleration",
    "omega": "angular velocity",
    "alpha": "angular acceleration",
    "power": "power",
}
#: The data of a page have angles in degrees.
DEGREE = math.pi / 180.0
#: Seconds of the units of time, for the speed at which a motion is played.
SECONDS = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "min": 60.0, "h": 3600.0}
#: With more points than this only mass centres move with arrows and paths.
POINTS = 60


def numbers(tree: Any) -> Any:
    """Data with every history rounded to a part of its peak, so that a page is short.

    >>> numbers({"x": [1.0, 0.333333333333], "n": 3})
    {'x': [1.0, 0.3333333], 'n': 3}
    """
    if isinstance(tree, dict):
        return {key: numbers(value) for key, value in tree.items()}
    if isinstance(tree, list) and tree and isinstance(tree[0], (float, type(None))):
        values = np.array(tree, dtype=float)
        finite = np.abs(values[np.isfinite(values)])
        peak = float(finite.max()) if finite.size else 0.0
        if not peak:
            return tree
        places = KEPT - 1 - math.floor(math.log10(peak))
        rounded = np.round(values, min(places, 300)) + 0.0
        return [None if v != v else v for v in rounded.tolist()]
    return tree


def text_runs(text: str) -> list[list[str]]:
    r"""A name with its indices as parts (text, "" or "sub").

    >>> text_runs(symbolic("O2")), text_runs("$A_{1,2}$"), text_runs("motor")
    ([['O', ''], ['2', 'sub']], [['A', ''], ['1,2', 'sub']], [['motor', '']])
    >>> text_runs(notation("F12,left"))
    [['F', ''], ['12,left', 'sub']]
    """
    found: list[list[str]] = []
    text = re.sub(r"\\mathrm\{([^}]*)\}", lambda inner: re.sub(r"\\(.)", r"\1", inner[1]), text)
    for part in re.split(r"(_\{[^}]*\})", re.sub(r"(?<!\\)\$", "", text)):
        if part.startswith("_{"):
            found.append([part[2:-1], "sub"])
        elif part:
            found.append([part.replace(r"\$", "$").replace(r"\omega", "ω"), ""])
    return found


def coupler_points(run: Solution) -> list[str]:
    """Named points that are at no joint: those whose paths are shown."""
    pose, found = Pose(run, 0), []
    for body in run.mechanism.bodies:
        for name in body.points:
            full = f"{body.name}.{name}"
            if not pose.at_joint(pose.point(full), DRAWN_RETURNS * run.system.length):
                found.append(full)
    return found


def scene_data(
    scene: Scene,
    plots: Sequence[str],
    paths: Sequence[str] | None = None,
    on: Sequence[str] | None = None,
) -> dict[str, Any]:
    """The scene as plain lists and texts."""
    run = scene.run
    machine, units = run.mechanism, run.mechanism.shown
    bodies = ["ground", *(body.name for body in machine.bodies)]
    carriers = {carrier: n for n, carrier in enumerate(scene.carriers)}
    movers = _movers(run, bodies, paths or ())
    return {
        "bodies": bodies,
        "unit": scene.unit,
        "second": SECONDS.get(machine.units.time, 1.0),
        "box": {"low": scene.low.tolist(), "high": scene.high.tolist()},
        **_drawn(scene.shapes, carriers, bodies, scene.unit),
        "labels": [_label(one, carriers) for one in scene.labels],
        "axis": axis(run),
        "forces": force_arrows(run, bodies, scene.enlarged),
        "movers": movers,
        "rates": run.analysis != "close_loops",
        "paths": list(_known_paths(run, paths)),
        "plots": [_plot(run, name) for name in plots],
        "measures": {
            one.name: _measure_unit(run, one) for one in shown_table(run) if one.role == "measure"
        },
        "driven": {driver.name: _driven(run, driver) for driver in machine.drivers},
        "turns": {driver.name: driver.angular for driver in machine.drivers}
        | {coupling.name: not coupling.lengths for coupling in machine.couplings},
        "units": {
            # the symbol, and how many of the data's units one of it is
            key: [units.of(name), units.size(name) / (DEGREE if name == "angle" else 1.0)]
            for key, name in KINDS.items()
        },
        "floors": _floors(run),
        **_sign_histories(scene),
        "modes": _modes(run),
        "notes": scene.notes,
        **({"on": list(on)} if on is not None else {}),
    }


def position_data(run: Solution, unit: float, instant: int = 0) -> dict[str, Any]:
    """The shapes of one position for a given length of a point, with the keys of `scene_data`, and
    half the width of a link.

    >>> import mbody
    >>> run = mbody.kinematics(mbody.makers.four_bar(1, 3, 2, 3.5))
    >>> found = position_data(run, 0.01)
    >>> found["bodies"], found["shapes"][0]["k"]
    (['ground', 'crank', 'coupler', 'rocker'], 'p')
    """
    sketch = sketched(Pose(run, instant), unit, 1.0)
    shapes = sorted(sketch.record.shapes, key=lambda shape: shape.look.z)
    bodies = ["ground", *(body.name for body in run.mechanism.bodies)]
    carriers = {one: n for n, one in enumerate(dict.fromkeys(part.carrier for part in shapes))}
    head = {"bodies": bodies, "unit": unit, "half": sketch.size("link")}
    return head | _drawn(shapes, carriers, bodies, unit)


def _drawn(
    shapes: Sequence[KeptShape], carriers: dict[Carrier, int], bodies: Sequence[str], unit: float
) -> dict[str, Any]:
    """Carriers and shapes, rounded to what a point of the length `unit` shows."""
    digits = max(0, 3 - math.floor(math.log10(unit)))
    return {
        "carriers": [_carrier(one, bodies) for one in carriers],
        "shapes": [_shape(one, carriers, digits) for one in shapes],
    }


def axis(run: Solution) -> dict[str, Any]:
    """Abscissa of the diagrams: the angle of the one driver that rotates, else time."""
    found = one_way(run)
    still = len(run) < 2 or np.ptp(run.t) == 0.0
    if found is not None:
        driver, value = found
        kind = "angle" if isinstance(driver, AngleDriver) else "length"
        if kind == "angle" or still:
            units = run.mechanism.shown
            values = np.asarray(units.converted(value, kind)).tolist()
            label = driver.coordinate if isinstance(driver, AngleDriver) else driver.name
            own = {"unit": units.of(kind), "size": units.size(kind)}
            return {"label": label, **own, "values": values}
    if still:
        return {"label": "instant", "unit": "", "values": list(range(1, len(run) + 1))}
    return {"label": "t", "unit": run.mechanism.shown.of("time"), "values": None}


def _measure_unit(run: Solution, column: ResultColumn) -> list[Any]:
    """The unit of a measure, how many of the data's units one of it is, and how many of the
    model's one of the data's is: data have angles in degrees.
    """
    if run.mechanism.measures[column.name].unit:
        return [column.unit, 1.0, 1.0]
    own = DEGREE if column.quantity == "angle" else 1.0
    return [column.unit, run.mechanism.shown.size(column.dimension) / own, own]


def _floors(run: Solution) -> dict[str, float]:
    """Rounding levels of forces and torques."""
    if not run.has_forces:
        return {}
    return {kind: floor_of(run, DIMENSIONS[kind]) for kind in ("force", "torque")}


def _place_data(place: Place, bodies: Sequence[str]) -> list[float]:
    name, x, y = place
    return [bodies.index(name), x, y]


def _carrier(one: Carrier, bodies: Sequence[str]) -> dict[str, Any]:
    if one.end is None:
        return {"s": _place_data(one.start, bodies), "t": bodies.index(one.rotates_with)}
    stretched: dict[str, Any] = {"x": 1} if one.stretches else {}
    return {"s": _place_data(one.start, bodies), "e": _place_data(one.end, bodies), **stretched}


def _flat(points: Array, digits: int) -> list[float | None]:
    rounded = np.round(points, digits) + 0.0
    return [None if v != v else v for v in rounded.reshape(-1).tolist()]


def _shape(one: Any, carriers: dict[Carrier, int], digits: int) -> dict[str, Any]:
    look = one.look
    dashes = [] if look.dashes == "-" else list(look.dashes[1])
    found = {
        "k": one.kind[0],
        "c": carriers[one.carrier],
        "p": _flat(one.points, digits),
        "w": look.width,
        "e": ROLES.get(look.edge, "ink") if look.width else "none",
        "f": ROLES.get(look.fill, "paper"),
        "d": dashes,
        "n": look.name.removesuffix(".head"),
    }
    found |= {"s": list(one.sign_condition)} if one.sign_condition else {}
    return found | ({"r": one.radius} if one.kind == "circle" else {})


def _label(one: Any, carriers: dict[Carrier, int]) -> dict[str, Any]:
    found = {
        "t": text_runs(one.text),
        "c": carriers[one.carrier],
        "a": one.anchor[0].tolist(),
        "u": np.round(one.direction, 4).tolist(),
        "g": one.gap,
        "e": ROLES.get(one.color, "ink"),
        "i": one.italic or one.text.startswith("$"),
    }
    return found | ({"turns": 1} if one.rotates else {})


def _sign_histories(scene: Scene) -> dict[str, Any]:
    """When marks are there whose quantity is no history of the result: 1 or −1 an instant."""
    quantities = dict.fromkeys(
        shape.sign_condition[0] for shape in scene.shapes if shape.sign_condition
    )
    # the page itself chooses between effort and rate of a drive
    own = [name for name in quantities if ":" in name and not name.startswith("drive:")]
    found = {name: sign_history(scene.run, name).astype(int).tolist() for name in own}
    return {"senses": found} if found else {}


def _modes(run: Solution) -> list[dict[str, Any]]:
    """The bars of modes below the diagrams, over their axis."""
    if len(run) < 2:
        return []
    own = axis(run)["values"]
    x = np.asarray(run.t if own is None else own, dtype=float)
    rows, left_out = mode_rows(run, x) if bool(np.ptp(x) > 0.0) else ([], 0)
    found: list[dict[str, Any]] = []
    for row in rows:
        spans = [[span.low, span.high, span.mode] for span in row.spans]
        found.append({"name": row.name, "spans": spans, "impacts": list(row.impacts)})
    if left_out:
        found.append({"left_out": left_out})
    return found


def force_arrows(
    run: Solution, bodies: Sequence[str], enlarged: float = 1.0
) -> list[dict[str, Any]]:
    """Forces that can be shown as arrows: of joints by the names of the books, and applied ones."""
    pose, found = Pose(run, 0), []
    for load in run.mechanism.loads:
        if isinstance(load, Force):
            at = {"at": _place_data(pose.site(load, "at"), bodies)}
            arrow = {"n": f"force:{load.name}", "of": load.name, "sign": 1, "load": 1}
            found.append({**arrow, "t": text_runs(symbolic(load.name)), **at})
    if not run.has_forces:
        return found
    names = force_names(run.mechanism)
    for joint in run.mechanism.joints:
        name, on = names[joint.name]
        sign = -1 if on == joint.i.body and on != joint.j.body else 1
        x, y = run.reaction_point(joint.name)
        site = pose.site(joint, "j")
        fixed = moved(run, site)
        where: dict[str, Any] = {"at": _place_data(site, bodies)}
        if max(np.abs(fixed[:, 0] - x).max(), np.abs(fixed[:, 1] - y).max()) > (
            POINT_SAME * run.system.length
        ):
            where["places"] = {"x": x.tolist(), "y": y.tolist()}  # a contact
        aside = line_of_action(run, joint, enlarged).T
        if aside.any():
            # where the arrow is drawn, at the friction circle; forces are about the pin
            where["drawn"] = {
                axis: numbers((part + more).tolist())
                for axis, part, more in zip("xy", (x, y), aside, strict=True)
            }
        text = text_runs(notation(name))
        found.append({"n": f"force:{name}", "of": joint.name, "sign": sign, "t": text, **where})
    for name, place, force in contact_arrows(run):
        keys = {"places": place, "own": force}
        parts = {
            key: {axis: numbers(own.tolist()) for axis, own in zip("xy", both.T, strict=True)}
            for key, both in keys.items()
        }
        text = text_runs(symbolic(name))
        found.append({"n": f"force:{name}", "of": name, "sign": 1, "t": text, **parts})
    return found


def _movers(run: Solution, bodies: Sequence[str], more: Sequence[str]) -> list[dict[str, Any]]:
    """Points and mass centres that move, those at one place once."""
    pose = Pose(run, 0)
    found: list[dict[str, Any]] = []
    seen: list[tuple[Array, Array]] = []
    size = run.system.length
    count = sum(len(body.points) for body in run.mechanism.bodies)
    named = [f"{body.name}.{name}" for body in run.mechanism.bodies for name in body.points]
    centres = [body.name for body in run.mechanism.bodies]
    k = len(run) // 3
    for name in [*coupler_points(run), *named, *centres] if count <= POINTS else [*more, *centres]:
        owner, _, point = name.partition(".")
        history = run.point(name) if point else run[owner]
        if max(np.ptp(history.x), np.ptp(history.y)) < PRINTED_NONE * size:
            continue
        ends = np.array([history.x[0], history.y[0]]), np.array([history.x[k], history.y[k]])
        tolerance = DRAWN_RETURNS * size
        if name not in more and any(
            np.hypot(*(ends[0] - a)) < tolerance and np.hypot(*(ends[1] - b)) < tolerance
            for a, b in seen
        ):
            continue
        if any(one["n"] == name for one in found):
            continue
        seen.append(ends)
        local = pose.fixed(owner, ends[0])
        found.append({"n": name, "at": _place_data(local, bodies)})
    return found


def _known_paths(run: Solution, paths: Sequence[str] | None) -> Sequence[str]:
    if paths is None:
        return coupler_points(run)
    for name in paths:
        if name not in run.system.bodies:
            run.point(name)
    return paths


def _driven(run: Solution, driver: Any) -> dict[str, list[float]]:
    value, rate, change = run.driven(driver.name)
    factor = math.degrees(1.0) if driver.angular else 1.0
    plain = {"value": value * factor, "rate": rate, "acceleration": change}
    return {key: numbers(np.asarray(own, dtype=float).tolist()) for key, own in plain.items()}


def _plot(run: Solution, name: str) -> dict[str, Any]:
    """The history of a diagram, in the unit that people read."""
    try:
        measure = measure_named(run.mechanism.measures, name)
        values, dimension, unit = shown_measure(run, measure)
    except ModelError as error:
        known = [*run.mechanism.measures]
        raise ModelError(
            f"{error}"
            + (f"; measures of '{run.mechanism.name}' are: {', '.join(known)}" if known else "")
        ) from None
    units, kind = run.mechanism.shown, name_of(dimension)
    if kind in _floors(run) and unit == units.of(kind):
        rounding = floor_of(run, dimension) / units.size(kind)
        values = values * float(np.nanmax(np.abs(values), initial=0.0) > rounding)
    plain = [v if math.isfinite(v) else None for v in np.asarray(values, dtype=float).tolist()]
    size = 1.0 if measure.unit else units.size(dimension)
    return {"name": name, "unit": unit, "size": size, "values": numbers(plain)}
