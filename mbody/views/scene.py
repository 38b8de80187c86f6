"""A mechanism in motion as plain data: its shapes, and what carries them."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from mbody.core import tolerances as tol
from mbody.errors import ModelError, remedy
from mbody.solution.histories import one_design
from mbody.solution.solution import Solution
from mbody.views import acting
from mbody.views.acting import driver_symbol, load_symbol
from mbody.views.body_shapes import body_shapes, bounds, wheels
from mbody.views.joint_symbols import coupling_symbol, joint_symbol, link, places, points
from mbody.views.labels import INK, SIZE, symbolic, together
from mbody.views.shapes import GROUND_CARRIER, Carrier, Pose, direction, hull, on, unique
from mbody.views.sketch import KeptLabel, KeptShape, SceneSketch

# -- Places of names in a moving picture, free in most of the motion ---------------------------

Array = np.ndarray

#: With more bodies than this there are no names: they would hide the mechanism.
NAMED = 24
#: Directions of a name from its place, and instants at which they are tried.
AROUND, TRIED = 16, 9
#: Width of a letter, in parts of the height of the text.
LETTER = 0.55


def named(sketch: SceneSketch, shapes: Sequence[KeptShape]) -> list[KeptLabel]:
    """The names of pins, elements and links, each at its best place."""
    run = sketch.pose.run
    if len(run.mechanism.bodies) > NAMED:
        return []
    labels = [*_pins(sketch), *sketch.names]
    instants = sorted({round(k) for k in np.linspace(0, len(run) - 1, TRIED)})
    lines = _obstacles(run, shapes, instants, 0.35 * SIZE["text"] * sketch.unit)
    occupied: list[tuple[Array, Array]] = []
    for label in labels:
        _rotate_label(label, sketch, lines, occupied, instants)
    for body in run.mechanism.bodies:
        labels.append(_of_link(sketch, body.name, lines, occupied, instants))
    return labels


def _pins(sketch: SceneSketch) -> list[KeptLabel]:
    found = []
    for place, names, carrier in sketch.pinned:
        if names:
            anchor = carrier.kept(place[None], sketch.pose)
            outward = direction(0.5 * math.pi)
            gap = sketch.size("pin") + 1.5 * sketch.unit
            label = f"pin:{names[0]}"
            kept = KeptLabel(
                together(names), carrier, anchor, outward, gap, "pin", label, INK, True
            )
            found.append(kept)
    return found


def _dotted(line: Array, step: float) -> Array:
    """Points on a line, about a step apart."""
    parts = [line[:1]]
    for a, b in itertools.pairwise(line):
        if not np.isfinite(a + b).all():
            continue  # an interrupted line
        count = min(int(np.hypot(*(b - a)[-2:]) / step) + 1, 60) if len(a) == 2 else 5
        parts.append(a + (b - a) * (np.arange(1, count + 1) / count)[:, None])
    dotted = np.concatenate(parts)
    return np.asarray(dotted[np.isfinite(dotted).all(axis=1)])


def _obstacles(
    run: Solution, shapes: Sequence[KeptShape], instants: Sequence[int], step: float
) -> Array:
    """Points on every outline: (instants, points, 2)."""
    axes: dict[Carrier, tuple[Array, Array, Array]] = {}
    found = []
    for shape in shapes:
        if shape.kind == "circle" and len(shape.points) == 1:
            ring = np.array([direction(a) for a in np.linspace(0.0, math.tau, 33)])
            if shape.carrier.stretches:
                continue
            kept = shape.points + shape.radius * ring
        else:
            kept = shape.points
            if shape.kind == "polygon":
                kept = np.vstack([kept, kept[:1]])
            kept = _dotted(kept, step)
        if not len(kept):
            continue
        if shape.carrier not in axes:
            axes[shape.carrier] = shape.carrier.axes(run)
        own = axes[shape.carrier]
        found.append(np.array([shape.carrier.in_world(kept, own, k) for k in instants]))
    return np.concatenate(found, axis=1) if found else np.zeros((len(instants), 0, 2))


def _extent(sketch: SceneSketch, text: str) -> Array:
    """Half the width and height of a name, about."""
    letters = len(text.replace("$", "").replace("_", "").replace("{", "").replace("}", ""))
    size = SIZE["text"] * sketch.unit
    return 0.5 * np.array([LETTER * size * max(letters, 1) + 0.3 * size, 0.9 * size])


def _cost(
    middles: Array, half: Array, lines: Array, occupied: Sequence[tuple[Array, Array]]
) -> float:
    """Area that a name (instants, 2) would cover."""
    away = np.abs(lines - middles[:, None, :])
    inside = (away < half * 1.05).all(axis=2)
    total = 0.25 * float(inside.sum()) / len(middles)
    for other, size in occupied:
        over = (np.abs(other - middles) < half + size).all(axis=1)
        total += 20.0 * float(over.mean())
    return total


def _rotate_label(
    label: KeptLabel,
    sketch: SceneSketch,
    lines: Array,
    occupied: list[tuple[Array, Array]],
    instants: Sequence[int],
) -> None:
    """Rotate a name about its place to where it covers least."""
    axes = label.carrier.axes(sketch.pose.run)
    anchors = np.array([label.carrier.in_world(label.anchor, axes, k)[0] for k in instants])
    half = _extent(sketch, label.text)
    first, best = math.atan2(label.direction[1], label.direction[0]), np.inf
    chosen, at = label.direction, anchors
    for n in range(AROUND):
        angle = first + math.tau * n / AROUND
        u = direction(angle)
        distance = label.gap + min(
            half[0] / max(abs(u[0]), tol.DRAWN_DIRECTION_LEAST),
            half[1] / max(abs(u[1]), tol.DRAWN_DIRECTION_LEAST),
        )
        middles = anchors + distance * u
        cost = _cost(middles, half, lines, occupied) + 0.6 * (1.0 - math.cos(angle - first))
        if round(cost, 6) < best:
            best, chosen, at = round(cost, 6), u, middles
    label.direction = chosen
    occupied.append((at, half))


def _of_link(
    sketch: SceneSketch,
    body: str,
    lines: Array,
    occupied: list[tuple[Array, Array]],
    instants: Sequence[int],
) -> KeptLabel:
    """The name of a link beside one of its edges, which it turns with."""
    carrier, pose = on(body), sketch.pose
    nodes = unique(places(sketch, body), 0.5 * sketch.size("pin"))
    half = _extent(sketch, body)
    if len(nodes) < 2:
        place = np.array([nodes[0] if nodes else pose.centre(body)])
        anchor = carrier.kept(place, pose)
        gap = 0.9 * sketch.size("block")
        outward = direction(-0.5 * math.pi)
        label = KeptLabel(body, carrier, anchor, outward, gap, "link", f"link:{body}", INK)
        _rotate_label(label, sketch, lines, occupied, instants)
        return label
    corners = carrier.kept(hull(nodes, tol.DRAWN_OUTLINE * sketch.size("link")), pose)
    axes = carrier.axes(pose.run)
    gap = sketch.size("link") + 1.5 * sketch.unit
    options = []
    for a, b in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        u = (b - a) / max(float(np.hypot(*(b - a))), tol.TINY)
        for part in (0.5, 0.35, 0.65):
            options.append((a + part * (b - a), np.array([u[1], -u[0]]), abs(part - 0.5)))
    if len(corners) > 2:
        options.append((corners.mean(axis=0), np.zeros(2), -0.2))
    best, chosen = np.inf, options[0]
    at = np.zeros((len(instants), 2))
    for option in options:
        candidate, normal, cost = option
        middles = []
        for k in instants:
            place = carrier.in_world(candidate[None], axes, k)[0]
            n = carrier.in_world(normal[None], axes, k)[0] - axes[0][k]
            middles.append(place + n * (gap * normal.any() + float(half @ np.abs(n))))
        whole = _cost(np.array(middles), half, lines, occupied) + cost
        if round(whole, 6) < best:
            best, chosen, at = round(whole, 6), option, np.array(middles)
    occupied.append((at, half))
    return KeptLabel(
        body, carrier, chosen[0][None], chosen[1], gap, "link", f"link:{body}", INK, rotates=True
    )


#: Instants of a scene: more than a screen has columns, and four for each degree of a turn.
MOST = 1441
#: Numbers of a scene (instants by histories), as many as make a page of some 10 MB.
NUMBERS = 1_000_000
#: Fewest instants to which a motion is thinned.
FEWEST = 61
#: Instants at which the space that a motion needs is measured.
SAMPLES = 25
#: The same of a thousand bodies, of which some are always where the others will be.
FEW = 5


@dataclass
class Scene:
    """The geometry of a mechanism over time.

    `run`: The motion, thinned where it has more instants than a picture can show.
    `shapes`: From the lowest to the highest.
    `unit`: Length of a point (1/72 in) in the units of the mechanism.
    `low`, `high` (2,): Corners of the rectangle that the whole motion needs.
    `notes`: What was left out.
    `enlarged`: By how much friction circles are drawn larger than they are.
    """

    run: Solution
    shapes: list[KeptShape]
    labels: list[KeptLabel]
    unit: float
    small: float
    low: Array
    high: Array
    notes: list[str] = field(default_factory=list)
    enlarged: float = 1.0

    @property
    def carriers(self) -> list[Carrier]:
        """All carriers, each once."""
        carried = [*(one.carrier for one in self.shapes), *(one.carrier for one in self.labels)]
        return list(dict.fromkeys(carried))


def scene(run: Solution, *, moves: bool = True, span: float | None = None) -> Scene:
    """The shapes of a mechanism in the axes of what carries them; `span`: What the canvas shows,
    where that is not the space of the motion.

    >>> import mbody
    >>> machine = mbody.makers.four_bar(1, 3, 2, 3.5)
    >>> found = scene(mbody.kinematics(machine, turn=True))
    >>> {shape.look.name for shape in found.shapes} >= {"link:crank", "link:coupler", "pin:A"}
    True
    """
    one_design(run, "a view is of one design")
    if moves:
        _check_moves(run)
    thinned_run, notes = thinned(run)
    pose = Pose(thinned_run, 0)
    low, high, own = _space(thinned_run)
    if span is not None:
        low, high, own = np.zeros(2), np.full(2, span), np.full(2, span)
    unit, small = _scale(pose, low, high, own)
    sketch = sketched(pose, unit, small)
    shapes = sorted(sketch.record.shapes, key=lambda shape: shape.look.z)
    found = Scene(thinned_run, shapes, [], unit, small, low, high, notes, sketch.enlarged)
    if sketch.enlarged != 1.0:
        notes.append(f"friction circles are drawn {sketch.enlarged:g} times as large as they are")
    found.low, found.high = _bounds(found)
    found.labels = named(sketch, shapes)
    return found


def sketched(pose: Pose, unit: float, small: float) -> SceneSketch:
    """All shapes of a mechanism, in the order in which they are drawn."""
    sketch = SceneSketch(pose, unit, small)
    mechanism = pose.mechanism
    for order, body in enumerate(mechanism.bodies):
        link(sketch, body.name, order)
        body_shapes(sketch, body.name)
    body_shapes(sketch, "ground")
    for joint in pose.joints:
        joint_symbol(joint, sketch)
    for coupling in mechanism.couplings:
        coupling_symbol(coupling, sketch)
    sketch.lay()
    for load in mechanism.loads:
        load_symbol(load, sketch)
    for driver in mechanism.drivers:
        driver_symbol(driver, sketch, symbolic(driver.name))
    for contact in mechanism.contacts:
        acting.contact_symbol(contact, sketch)
    for joint in mechanism.joints:
        acting.sticking_symbol(joint, sketch)
    if pose.run.has_forces:
        sketch.enlarged = acting.circle_scale(pose, unit, mechanism.joints)
        acting.friction_circles(sketch, mechanism.joints, sketch.enlarged)
    for body in mechanism.bodies:
        points(sketch, body.name)
    return sketch


def _check_moves(run: Solution) -> None:
    """Refuse a result in which nothing moves."""
    size = run.system.length
    for body in run.mechanism.bodies:
        own = run[body.name]
        extent = max(float(np.ptp(own.x)), float(np.ptp(own.y)), size * float(np.ptp(own.angle)))
        if extent > tol.PRINTED_NONE * size:
            return
    count = "1 instant" if len(run) == 1 else f"{len(run)} instants"
    raise ModelError(
        f"nothing moves in this result of '{run.mechanism.name}' ({count}): "
        + remedy(
            python="analyse a turn (turn=True) or several times, or simulate; draw shows one "
            "position",
            command="give --over turn, --at NAME=VALUE,VALUE,… or --to TIME; mbody draw shows one "
            "position",
        )
    )


def thinned(run: Solution) -> tuple[Solution, list[str]]:
    """A run with as many instants as can be shown, and the sentences that say so.

    Events of free motion are kept, with the instants before and after them.
    """
    count = len(run)
    mechanism = run.mechanism
    width = 9 * len(mechanism.bodies) + 3 * len(mechanism.joints) + 3 * len(mechanism.loads) + 1
    most = max(FEWEST, min(MOST, NUMBERS // width))
    if count <= most:
        return run, []
    index = np.unique(np.round(np.linspace(0, count - 1, most)).astype(np.int64))
    events = np.searchsorted(run.t, [one.t for one in run.events])[: most // 4]
    at_events = np.clip(np.concatenate([events - 1, events, events + 1]), 0, count - 1)
    index = np.unique(np.concatenate([index, at_events.astype(np.int64)]))
    note = f"{len(index)} of {count} instants are shown, evenly chosen; results have them all"
    return run.take(index), [note]


def samples(run: Solution) -> list[int]:
    """Instants, evenly chosen, at which space is measured."""
    count = max(FEW, min(SAMPLES, 2000 // max(len(run.mechanism.bodies), 1)))
    return sorted({round(k) for k in np.linspace(0, len(run) - 1, count)})


def _space(run: Solution) -> tuple[Array, Array, Array]:
    """Corners of the rectangle of the whole motion, and the greatest extent of one instant."""
    corners = np.array([bounds(Pose(run, k)) for k in samples(run)])
    own = (corners[:, 1] - corners[:, 0]).max(axis=0)
    return corners[:, 0].min(axis=0), corners[:, 1].max(axis=0), own


def _scale(pose: Pose, low: Array, high: Array, own: Array) -> tuple[float, float]:
    """Length of a point (1/72 in), and how much smaller symbols are where links are short."""
    # a machine that travels far keeps symbols of its own size
    wide, tall = np.minimum(high - low, 3.0 * max(own.max(), tol.TINY))
    unit = max(wide / SIZE["width"], tall / SIZE["height"])
    if not unit > tol.LENGTH_NONE * pose.system.length:
        unit = pose.system.length / SIZE["width"]
    lengths = [1.5 * radius for joint in pose.joints for _, radius in wheels(joint, pose)]
    for name, nodes in pose.nodes.items():
        if name != "ground" and len(nodes) > 1:
            lengths.append(float(np.max(np.ptp(np.array(nodes), axis=0))))
    lengths = [length for length in lengths if length > unit]
    typical = float(np.median(lengths)) if lengths else 60.0 * unit
    return float(unit), min(1.0, max(0.3, typical / (55.0 * unit)))


def _bounds(found: Scene) -> tuple[Array, Array]:
    """Corners of the rectangle that all shapes need in the whole motion."""
    low, high = np.full(2, np.inf), np.full(2, -np.inf)
    axes = {carrier: carrier.axes(found.run) for carrier in found.carriers}
    for shape in found.shapes:
        carrier = shape.carrier
        for k in [0] if carrier == GROUND_CARRIER else samples(found.run):
            placed = carrier.in_world(shape.points, axes[carrier], k)
            low = np.fmin(low, np.nanmin(placed, axis=0) - shape.radius)
            high = np.fmax(high, np.nanmax(placed, axis=0) + shape.radius)
    if not np.isfinite(low).all():
        return found.low, found.high
    return low, high
