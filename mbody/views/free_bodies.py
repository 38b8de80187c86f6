"""Free-body diagrams: every link alone, to scale, with its forces and its force polygon."""

from __future__ import annotations

import functools
import math
import re
import textwrap
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from mbody.analysis.driven.free_body import FreeBody, Member, free_body, member_forces
from mbody.core.tolerances import POINT_SAME, PRINTED_NONE, TINY
from mbody.engineering.instant_centres import MotionPolygon, acceleration_polygon, velocity_polygon
from mbody.errors import ModelError
from mbody.model.element import listed
from mbody.model.joints import PinSlot, Prismatic
from mbody.quantities.evaluate import place_in_turn
from mbody.solution.histories import check_forces, whole_instant
from mbody.views.acting import Acting, acting_on, clear_arc, free_radius, outward_from
from mbody.views.body_shapes import guide
from mbody.views.joint_symbols import lone_link, scale_of
from mbody.views.labels import (
    INK,
    PAPER,
    SIZE,
    SOFT,
    Label,
    Z,
    blank,
    drawable,
    extent,
    places_around,
    said_below,
    styled,
    symbolic,
    together,
)
from mbody.views.shapes import Pose, arc, direction, heading
from mbody.views.sketch import Sketch, key_size, rounded, rounded_number

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from mbody.solution.solution import Solution


# -- What velocity and acceleration polygons show, decided once for paper and page -------------

Array = np.ndarray

#: With more images than this their sides are not split.
MOST_SPLIT_IMAGES = 6


@dataclass
class Image:
    """One corner of the polygon.

    `at` (instants, 2): Velocity or acceleration.
    `names`: Points of the polygon that have it.
    `text`: Its label.
    """

    at: Array
    names: list[str]
    text: str = ""


@dataclass(frozen=True)
class Side:
    """A line between two images; `corner` (instants, 2), where it is split, ends its first part.

    `texts`: Of its parts.
    """

    ends: tuple[int, int]
    corner: Array | None = None
    texts: str = ""


@dataclass(frozen=True)
class PolygonContent:
    """The polygon of some instants.

    `greatest`: Velocity or acceleration; 0 where there is none.
    `images`: Those that differ at some instant, the pole first.
    `links`: Of every body that has several images these, by their places in the list.
    `parts`: Of bodies, the normal and tangential part of the difference of two points.
    `slides`: Of joints, what slides; of accelerations Coriolis's part first.
    """

    quantity: str
    greatest: float
    images: list[Image]
    links: dict[str, list[int]]
    parts: dict[str, Side]
    slides: dict[str, Side]


def polygon_contents(run: Solution) -> list[PolygonContent]:
    """The velocity and the acceleration polygon.

    >>> import mbody
    >>> run = mbody.kinematics(mbody.makers.four_bar(1, 3, 2, 3.5, speed=2.0), [0.0])
    >>> [image.text for image in polygon_contents(run)[1].images]
    ['$o_{a}$', '$a$', '$b$']
    """
    velocity, acceleration = velocity_polygon(run), acceleration_polygon(run)
    return [_content(run, velocity), _content(run, acceleration, velocity)]


def _content(
    run: Solution, found: MotionPolygon, velocity: MotionPolygon | None = None
) -> PolygonContent:
    vectors = {name: np.column_stack([x, found.y[name]]) for name, x in found.x.items()}
    sizes = np.array([np.hypot(*vector.T) for vector in vectors.values()])
    greatest = float(np.max(sizes, initial=0.0, where=np.isfinite(sizes)))
    images = [Image(np.zeros((len(run), 2)), [], f"$o_{{{found.quantity[0]}}}$")]
    number = {}
    for name, vector in vectors.items():
        away = (np.hypot(*(image.at - vector).T).max(initial=0.0) for image in images)
        # NaN, where there is no motion, is not away
        same = [n for n, most in enumerate(away) if not most > POINT_SAME * greatest]
        number[name] = same[0] if same else len(images)
        if not same:
            images.append(Image(vector, []))
        images[number[name]].names.append(name)
    _name(images, found, run)
    corners = {body: [number[name] for name in names] for body, names in found.links.items()}
    corners = {body: own for body, own in corners.items() if body != "ground" and len({*own}) > 1}
    few = velocity is not None and len(images) <= MOST_SPLIT_IMAGES + 1
    pairs = {body: own[:2] for body, own in corners.items() if few and own[0] != own[1]}
    slides = {
        joint: _slide(run, joint, pair, number, images, velocity)
        for joint, pair in found.joints.items()
        if len(pair) == 2 and number[pair[0]] != number[pair[1]]
    }
    return PolygonContent(
        found.quantity,
        greatest,
        images,
        {body: [*dict.fromkeys(own)] for body, own in corners.items()},
        {body: _parts(run, body, a, b, images) for body, (a, b) in pairs.items()},
        slides,
    )


def _parts(run: Solution, body: str, first: int, second: int, images: list[Image]) -> Side:
    """The normal part and the tangential one: a = (iα − ω²) r."""
    w, alpha, start = run[body].omega, run[body].alpha, images[first].at
    rotation = 1j * alpha - w * w
    difference = (images[second].at - start) @ (1.0, 1j)
    r = difference / np.where(rotation == 0.0, np.inf, rotation)
    normal = -w * w * r
    return Side((first, second), start + np.column_stack([normal.real, normal.imag]), "nt")


def _slide(
    run: Solution,
    joint: str,
    pair: tuple[str, ...],
    number: dict[str, int],
    images: list[Image],
    velocity: MotionPolygon | None,
) -> Side:
    """From the image on the guide to that of what slides; the Coriolis acceleration is 2ω × v."""
    element = run.mechanism[joint]
    if not isinstance(element, Prismatic | PinSlot):
        return Side((number[pair[0]], number[pair[1]]))
    carrier, _, _ = guide(element)
    first, second = pair if element.i.body == carrier else pair[::-1]
    ends = number[first], number[second]
    if velocity is None or carrier == "ground":
        return Side(ends)
    vx, vy = velocity.between(first, second)
    part = 2.0 * run[carrier].omega * np.array([-vy, vx])
    return Side(ends, images[ends[0]].at + part.T, "C")


def _name(images: list[Image], found: MotionPolygon, run: Solution) -> None:
    """Letters of images: those of the pins, in small; with the number of the link where two
    bodies have different images at one place.
    """
    numbers = {
        name: n for n, name in enumerate(["ground", *(b.name for b in run.mechanism.bodies)], 1)
    }
    for image in images[1:]:
        pins = [joint for joint, pair in found.joints.items() if set(pair) <= set(image.names)]
        if not pins:
            pins = [name.partition(".")[2] for name in image.names if " at " not in name]
        if pins:
            image.text = together([_small(name) for name in dict.fromkeys(pins)])
            continue
        texts = []
        for name in image.names:
            body, _, joint = name.partition(" at ")
            there = _pin_there(found, run, joint, body) or joint
            texts.append(symbolic(f"{_small(there)}{numbers[body]}"))
        image.text = ", ".join(dict.fromkeys(texts))


def _pin_there(found: MotionPolygon, run: Solution, joint: str, body: str) -> str:
    """The pin at the place of a slide, which is on the other body of the slide."""
    if not isinstance(run.mechanism[joint], Prismatic | PinSlot):
        return ""
    (other,) = [name for name in found.joints[joint] if not name.startswith(f"{body} ")] or [""]
    for pin, pair in found.joints.items():
        owner = re.split(r"\.| at ", other)[0]
        mine = [name for name in pair if re.split(r"\.| at ", name)[0] == owner]
        same = all((found.x[one] == found.x[other]).all() for one in mine)
        if pin != joint and mine and same and pin[:1].isupper():
            return pin
    return ""


def _small(name: str) -> str:
    """The name of an image: that of the pin, a single letter in small.

    >>> _small("A"), _small("O2"), _small("guide")
    ('a', 'o2', 'guide')
    """
    return name.lower() if re.fullmatch(r"[A-Za-z][0-9]*", name) else name


# -- The force polygon of a free body: its forces tip to tail, back to the start ---------------


#: Points: a polygon that is narrower has its sides beside each other, so far apart.
FLAT, SIDE_SPACING = 5.0, 6.0
#: Strokes of d'Alembert's forces.
DASHES = (0, (4.0, 2.2))


def in_order(forces: Sequence[Acting]) -> list[Acting]:
    """By direction, counter-clockwise from the first: then the polygon is convex."""
    vectors = [force.force for force in forces if force.force is not None]
    if not vectors:
        return []
    first = heading(vectors[0])

    def rotation(force: Acting) -> float:
        # what differs by rounding from the first direction is not a rotation away
        return round((heading(force.force) - first) % math.tau, 9) % round(math.tau, 9)

    return sorted(forces, key=rotation)


def force_polygon(sketch: Sketch, forces: Sequence[Acting], scale: float) -> float:
    """Draw the polygon, in points per unit of force; the gap that is left to the start [force].

    The last side begins where the one before it ends, as the numbers are: that it ends at the start
    is seen, not assumed.
    """
    ordered = in_order(forces)
    sides = np.array([force.force for force in ordered])
    corners = scale * np.vstack([np.zeros(2), np.cumsum(sides, axis=0)])
    flat, across = _flat(corners)
    # beside each other only those that are long enough to be seen
    seen = [n for n, side in enumerate(sides) if scale * float(np.hypot(*side)) >= 2.0]
    middle = corners.mean(axis=0)
    for n, force in enumerate(ordered):
        rank = seen.index(n) - 0.5 * (len(seen) - 1) if n in seen else 0.0
        shift = rank * SIDE_SPACING * across if flat else np.zeros(2)
        tail, tip = corners[n] + shift, corners[n + 1] + shift
        shaft = tip - tail
        length = float(np.hypot(*shaft))
        if length < 2.0:
            continue
        dashed_arrow(sketch, tail, tip, force, name=f"side:{force.gid}")
        n_side = np.array([shaft[1], -shaft[0]]) / length
        half = 0.5 * (tail + tip)
        out = n_side if float(n_side @ (half - middle)) >= 0.0 else -n_side
        if flat:
            out = _free_side(corners, seen, n, across)
        _label(sketch, force, tail, shaft, out)
    if not flat:
        sketch.disc(corners[0], 1.5, PAPER, weight=0.0)
    gap = corners[-1] - corners[0]
    sketch.write()
    return float(np.hypot(*gap)) / scale


def _label(sketch: Sketch, force: Acting, tail: Array, shaft: Array, out: Array) -> None:
    """The name of a side, outside the polygon."""
    label = Label(force.text, [], color=force.color, name=f"label:{force.gid}")
    width, height = sketch.places.measured(label)
    for side, cost in ((out, 0.0), (-out, 1.0)):
        for part in (0.5, 0.4, 0.6, 0.25, 0.75, 0.1, 0.9):
            for ring in range(4):
                distance = 2.0 + 8.0 * ring + 0.5 * (width * abs(side[0]) + height * abs(side[1]))
                x, y = tail + part * shaft + distance * side
                own = cost + 0.6 * ring + 0.5 * abs(part - 0.5)
                label.spots.append((float(x), float(y), own))
    sketch.labels.append(label)


def _free_side(corners: Array, seen: list[int], n: int, across: Array) -> Array:
    """The side of an arrow among parallel ones on which fewer lie beside its middle."""
    along = np.array([across[1], -across[0]])
    half = 0.5 * float((corners[n] + corners[n + 1]) @ along)
    crossings = {1.0: 0, -1.0: 0}
    for other in seen:
        ends = sorted(float(corners[k] @ along) for k in (other, other + 1))
        if other != n and ends[0] <= half <= ends[1]:
            crossings[1.0 if other > n else -1.0] += 1
    return across if crossings[1.0] < crossings[-1.0] or n == max(seen) else -across


def _flat(corners: Array) -> tuple[bool, Array]:
    """Whether all corners are nearly on one line, and the direction across it."""
    away = corners - corners[0]
    farthest = away[int(np.argmax(np.hypot(*away.T)))]
    length = float(np.hypot(*farthest))
    if length == 0.0:
        return True, np.array([0.0, 1.0])
    across = np.array([-farthest[1], farthest[0]]) / length
    return float(np.ptp(corners @ across)) < FLAT, across


def dashed_arrow(
    sketch: Sketch, tail: Array, tip: Array, force: Acting, *, name: str, width: float = 1.8
) -> None:
    """A straight arrow with a filled head, dashed for d'Alembert's forces."""
    shaft = tip - tail
    length = float(np.hypot(*shaft))
    if length < 1e-3 * sketch.unit:
        return
    u = shaft / length
    n, head = np.array([-u[1], u[0]]), min(8.0 * sketch.unit, 0.6 * length)
    dashes = DASHES if force.dashed else "-"
    end, z = tip - 0.8 * head * u, Z["arrow"]
    sketch.line([tail, end], width + 2.0, PAPER, z - 0.2, weight=0.0)
    sketch.line([tail, end], width, force.color, z, name=name, dashes=dashes, weight=2.0)
    corners = [tip, tip - head * u + 0.38 * head * n, tip - head * u - 0.38 * head * n]
    sketch.shape(corners, force.color, force.color, 0.4, z + 0.1, name=f"{name}.head", weight=2.0)


#: The sums that must vanish, and the moments where none has an arm.
CLOSING = {
    "force": "ΣF = {} of the greatest force",
    "moment": "ΣM about G = {} of the greatest moment",
    "through": "ΣM about G = 0: all forces pass through G",
}


def closing_words(free: FreeBody, gap: float) -> list[str]:
    """The sums that must vanish, as parts of the greatest force and of its moment."""
    greatest = max((one.force for one in free), default=0.0)
    if not greatest:
        return []
    x0, y0 = free.solution[free.body].x[free.instant], free.solution[free.body].y[free.instant]
    moments = [one.torque + (one.x - x0) * one.fy - (one.y - y0) * one.fx for one in free]
    # a force through G has no moment: its distance says how large rounding may be
    parts = [abs(one.torque) + math.hypot(one.x - x0, one.y - y0) * one.force for one in free]
    moment_share = abs(math.fsum(moments)) / max(max(parts), TINY)
    force, moment = (rounded_number(float(f"{x:.1e}")) for x in (gap / greatest, moment_share))
    through = max(parts) <= PRINTED_NONE * greatest * free.solution.system.length
    return [
        CLOSING["force"].format(force),
        CLOSING["through" if through else "moment"].format(moment),
    ]


def arrow_scale(forces: Sequence[Acting], longest: float = SIZE["arrow"]) -> float:
    """Points per unit of force, so that the greatest is `longest`."""
    sizes = [float(np.hypot(*force.force)) for force in forces if force.force is not None]
    return longest / max(sizes) if sizes and max(sizes) > 0.0 else 0.0


#: Diagrams of one figure, so that it can be read.
MOST = 40
#: Points: longest arrow, longest side of a polygon, gap of columns, of rows, at the edge, a line.
ARROW, SIDE, GAP, BETWEEN, EDGE, LINE = 62.0, 96.0, 26.0, 22.0, 14.0, 13.5
#: Points: least width of a figure, so that sentences are not broken often.
LEAST = 430.0
#: A number in a sentence; names are between quotes.
NUMBER = re.compile(r"(?<![\w.'])-?\d+\.?\d*(?:e[-+]\d+)?\b(?!')")


@dataclass
class FreeBodyRow:
    """One link: its parts with their sizes in points, and the words above them."""

    parts: list[tuple[Any, Array, Array, float]]
    title: str
    words: str

    @property
    def sizes(self) -> list[tuple[float, float]]:
        """Width and height of the parts [points]."""
        return [tuple(((high - low) / unit).tolist()) for _, low, high, unit in self.parts]


def draw_free_body(free: FreeBody) -> Figure:
    """The diagram of one body; see `mbody.free_body`."""
    return draw_free_bodies(free.solution, [free.body], [free.instant])


def draw_free_bodies(
    run: Solution,
    bodies: Sequence[str] | None = None,
    instants: Sequence[int] = (0,),
    *,
    headed: bool = True,
) -> Figure:
    """Free-body diagrams, a row for each link: the link alone with all forces and torques, the
    force polygon at the same scale, and their numbers.

    >>> import mbody
    >>> run = mbody.kinetostatics(mbody.makers.four_bar(1, 3, 2, 3.5, masses=(1, 1, 1), speed=2.0))
    >>> len(draw_free_bodies(run, ["coupler"]).axes)
    3
    """
    check_forces(run, "free bodies")
    names = [body.name for body in run.mechanism.bodies] if bodies is None else list(bodies)
    instants = [whole_instant(run, k) for k in instants]
    if not names:
        known = listed(body.name for body in run.mechanism.bodies)
        raise ModelError(f"there is no body to cut free: name at least one (there are: {known})")
    count = len(names) * len(instants)
    if count > MOST:
        raise ModelError(
            f"a figure of {count} free-body diagrams cannot be read: choose at most {MOST}, by "
            f"bodies (there are: {listed(names, 12)}) or by instants"
        )
    with styled():
        figure, rows = blank(), []
        for k in instants:
            members = {member.body: member for member in member_forces(run, k)}
            pose = Pose(run, k)
            for n, name in enumerate(names):
                heading = f"{run.mechanism.name}: {when(run, k)}" if n == 0 and headed else ""
                free = free_body(run, name, k)
                rows.append((heading, _row(figure, pose, free, members[name])))
        _laid_out(figure, rows)
        shown = [functools.partial(_shown, names=names, instants=instants)]
        return said_below(figure, run, of=shown)


def _shown(run: Solution, names: Sequence[str], instants: Sequence[int]) -> list[Any]:
    """The forces on some bodies at some instants."""
    return [free_body(run, name, k) for k in instants for name in names]


def force_peak(run: Solution) -> int:
    """The instant of the greatest joint force, by which diagrams are chosen where nobody says.

    >>> import mbody
    >>> force_peak(mbody.kinetostatics(mbody.makers.four_bar(1, 3, 2, 3.5, masses=(1, 3, 2))))
    0
    """
    joints = [run.reaction(joint.name).magnitude for joint in run.mechanism.joints]
    if not joints:
        return 0
    return int(np.argmax(np.max(np.nan_to_num(np.array(joints), nan=0.0), axis=0)))


def when(run: Solution, instant: int) -> str:
    """The instant in words: where the drivers are, and the time.

    >>> import mbody
    >>> when(mbody.kinematics(mbody.makers.four_bar(1, 3, 2, 3.5, start=0.5, speed=1.0)), 0)
    'crank at 28.65°, t = 0 s'
    """
    words = []
    for driver in run.mechanism.drivers:
        value = float(run.driven(driver.name)[0][instant])
        if driver.angular:
            name = getattr(driver, "body", driver.name)
            words.append(f"{name} at {rounded_number(round(place_in_turn(value), 6) + 0.0)}°")
        else:
            words.append(f"{driver.name} at {rounded(value, 'length', run.mechanism.shown)}")
    time = f"t = {rounded(float(run.t[instant]), 'time', run.mechanism.shown)}"
    return ", ".join([*words[:3], time])


# -- one link ----------------------------------------------------------------------------------


def _row(figure: Figure, pose: Pose, free: FreeBody, member: Member) -> FreeBodyRow:
    """The diagram, the polygon and the table of a link."""
    acting = acting_on(free, pose)
    forces = [one for one in acting if one.force is not None]
    scale = arrow_scale(forces, ARROW)
    sketch = Sketch(_axes(figure), pose, *scale_of(pose, free.body))
    away = _diagram(sketch, free.body, acting, scale * sketch.unit, member)
    parts = [(sketch.axes, sketch.low, sketch.high, sketch.unit)]
    gap = 0.0
    if forces:
        polygon = Sketch(_axes(figure), pose, 1.0, 1.0)
        gap = _polygon(polygon, forces)
        parts.append((polygon.axes, polygon.low, polygon.high, 1.0))
    parts.append(_table(figure, pose, free, acting, gap, 2.0 / scale if scale else 0.0))
    number = 2 + [body.name for body in pose.mechanism.bodies].index(free.body)
    # of a general one the table says all
    words = member.words.replace(f"'{free.body}' ", "", 1) if member.kind != "general" else ""
    # as many digits as the table has
    words = NUMBER.sub(lambda found: rounded_number(float(found[0])), words)
    return FreeBodyRow(parts, f"{number}  {free.body}", f"{words}{away}")


def _polygon(sketch: Sketch, forces: Sequence[Acting]) -> float:
    """The polygon with the scale of its forces below; the gap that is left [force]."""
    scale = arrow_scale(forces, SIDE)
    gap = force_polygon(sketch, forces, scale)
    force, text = key_size(40.0 / scale, "force", sketch.pose.mechanism.shown)
    wide = scale * force + 4.0 + sketch.wide(text, 0.88 * SIZE["text"])
    x, y = 0.5 * float(sketch.low[0] + sketch.high[0] - wide), float(sketch.low[1]) - 14.0
    sketch.arrow((x, y), (x + scale * force, y), SOFT, width=1.4, name="key")
    end = _said(sketch, x + scale * force + 4.0, y, text)
    sketch.high = np.fmax(sketch.high, np.array([end, y]))
    sketch.low = np.fmin(sketch.low, np.array([x, y - 5.0]))
    return gap


def _axes(figure: Figure) -> Any:
    """Axes to draw on, placed later; an own label keeps matplotlib from taking two for one."""
    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0), label=f"part {len(figure.axes)}")
    axes.set_axis_off()
    return axes


def _diagram(
    sketch: Sketch, body: str, acting: Sequence[Acting], scale: float, member: Member
) -> str:
    """Draw a link with what acts on it; words about a point that is too far to be shown."""
    lone_link(sketch, body)
    size = max(90.0 * sketch.unit, float(np.hypot(*(sketch.high - sketch.low))))
    for one in acting:
        if one.force is not None:
            others = [other.place for other in acting if other.force is not None]
            _arrow(sketch, one, scale, others)
    away = _lines_of_action(sketch, member, size)
    for one in acting:
        if one.force is None:
            _torque_arrow(sketch, one, body)
    for place, names in sketch.pins:
        if names:
            sketch.label(", ".join(names), place, -0.75, sketch.size("pin") + 2.0 * sketch.unit)
            sketch.labels[-1].italic = True
    sketch.write()
    _key(sketch, acting, scale)
    return away


def _arrow(sketch: Sketch, one: Acting, scale: float, others: Sequence[Array]) -> None:
    """The arrow of a force, from its place or to it, on the side where less is drawn and where the
    places of other forces are not.
    """
    assert one.force is not None
    shaft = scale * one.force
    length = float(np.hypot(*shaft))
    if length < 2.0 * sketch.unit:
        return
    u = shaft / length
    clear = 1.5 * sketch.size("pin") * u
    ends = [
        (one.place + clear, one.place + clear + shaft),
        (one.place - clear - shaft, one.place - clear),
    ]
    costs = []
    for n, (tail, tip) in enumerate(ends):
        places = [tail + p * (tip - tail) for p in (0.1, 0.25, 0.4, 0.55, 0.7, 0.85, 1.0)]
        half = 8.0 * sketch.unit
        crowd = sketch.places.crowd(places, half)
        crowd += 40.0 * sum(_passes(tail, tip, other, 0.5 * half) for other in others)
        costs.append(round(crowd + 0.5 * n, 6))
    tail, tip = ends[int(np.argmin(costs))]
    dashed_arrow(sketch, tail, tip, one, name=f"force:{one.gid}")
    free = tip if int(np.argmin(costs)) == 0 else tail
    label = Label(one.text, [], color=one.color, name=f"label:{one.gid}")
    width, height = (sketch.unit * part for part in sketch.places.measured(label))
    wanted = heading(free - one.place)
    label.spots = places_around(free, (width, height), 3.0 * sketch.unit, wanted, 0.8)
    across = np.array([-u[1], u[0]])
    for side in (across, -across):
        distance = 2.5 * sketch.unit + 0.5 * (width * abs(side[0]) + height * abs(side[1]))
        for part in (0.5, 0.65, 0.35, 0.8):
            x, y = tail + part * (tip - tail) + distance * side
            label.spots.append((float(x), float(y), 0.25))
    sketch.labels.append(label)


def _passes(tail: Array, tip: Array, place: Array, clearance: float) -> bool:
    """Whether an arrow runs over a place."""
    shaft = tip - tail
    part = np.clip((place - tail) @ shaft / float(shaft @ shaft), 0.0, 1.0)
    return float(np.hypot(*(tail + part * shaft - place))) < clearance


def _torque_arrow(sketch: Sketch, one: Acting, body: str) -> None:
    """The arc of a torque, dashed of d'Alembert's."""
    radius = 0.9 * free_radius(sketch, one.place)
    wanted = outward_from(sketch, one.place, body)
    torque_sign = math.copysign(1.0, one.torque)
    choices = [
        (wanted + a, wanted + a + 2.6 * torque_sign)
        for a in (sign * n * math.pi / 12.0 for n in range(1, 12) for sign in (1.0, -1.0))
    ]
    first, last = clear_arc(sketch, one.place, radius, choices)
    if one.dashed:
        line = arc(one.place, radius, first, last - 0.28 * torque_sign)
        dashes: Any = (0, (4.0, 2.2))
        sketch.line(line, 1.6, one.color, Z["arrow"], name=f"torque:{one.gid}", dashes=dashes)
        tip = one.place + radius * direction(last)
        u = direction(last - 0.14 * torque_sign + 0.5 * math.pi * torque_sign)
        n, head = np.array([-u[1], u[0]]), 7.0 * sketch.unit
        corners = [tip, tip - head * u + 0.38 * head * n, tip - head * u - 0.38 * head * n]
        sketch.shape(corners, one.color, one.color, 0.4, Z["arrow"] + 0.1)
    else:
        name = f"torque:{one.gid}"
        sketch.curved(one.place, radius, first, last, one.color, name=name)
    gap = radius + 2.5 * sketch.unit
    look: dict[str, Any] = {"color": one.color, "name": f"label:{one.gid}"}
    sketch.label(one.text, one.place, 0.5 * (first + last), gap, **look)


def _lines_of_action(sketch: Sketch, member: Member, size: float) -> str:
    """The common line of two forces, or the three lines that meet; words where that is far away."""
    look: dict[str, Any] = {"dashes": (0, (9, 2.5, 2, 2.5)), "weight": 0.3}
    if member.kind == "two-force":
        a, b = (np.array(force.line) for force in member.forces)
        u = np.array([member.forces[0].fx, member.forces[0].fy]) / member.forces[0].force
        along = sorted([(a - a) @ u, (b - a) @ u])
        more = 26.0 * sketch.unit
        ends = [a + (along[0] - more) * u, a + (along[1] + more) * u]
        sketch.line(ends, 0.7, SOFT, Z["path"] - 0.1, name="action", **look)
        return ""
    if member.kind != "three-force" or member.meeting is None:
        return ""
    meeting = np.array(member.meeting)
    middle = 0.5 * (sketch.low + sketch.high)
    if float(np.hypot(*(meeting - middle))) > 1.3 * size:
        return ", outside this diagram"
    for force in member.forces:
        start = np.array([force.x, force.y])
        on_line = np.array(force.line)
        u = np.array([force.fx, force.fy]) / force.force
        # the foot of the place on the line: they differ where a torque acts beside the force
        start = on_line + float((start - on_line) @ u) * u
        line = meeting - start
        length = float(np.hypot(*line))
        if length > sketch.unit:
            end = meeting + 10.0 * sketch.unit * line / length
            sketch.line([start, end], 0.7, SOFT, Z["path"] - 0.1, name="action", **look)
    sketch.disc(meeting, 1.6 * sketch.unit, SOFT, SOFT, 0.4, Z["pin"], name="meeting")
    sketch.label("$M$", meeting, 0.8, 3.0 * sketch.unit, color=SOFT)
    return ""


def _key(sketch: Sketch, acting: Sequence[Acting], scale: float) -> None:
    """A bar of a length, and an arrow of a force."""
    unit, units = sketch.unit, sketch.pose.mechanism.shown
    x, y = float(sketch.low[0]), float(sketch.low[1]) - 16.0 * unit
    tick = 2.5 * unit
    length, text = key_size(48.0 * unit, "length", units)
    bar = [(x, y + tick), (x, y - tick), (x, y), (x + length, y), (x + length, y + tick)]
    sketch.line([*bar, (x + length, y - tick)], 1.0, SOFT, Z["text"], name="scale", weight=0.0)
    x = _said(sketch, x + length + 4.0 * unit, y, text)
    if scale:
        force, text = key_size(48.0 * unit / scale, "force", units)
        x += 12.0 * unit
        sketch.arrow((x, y), (x + scale * force, y), SOFT, width=1.4, name="key")
        x = _said(sketch, x + scale * force + 4.0 * unit, y, text)
    sketch.high = np.fmax(sketch.high, np.array([x, y]))
    sketch.low = np.fmin(sketch.low, np.array([x, y - 5.0 * unit]))


def _said(sketch: Sketch, x: float, y: float, text: str) -> float:
    """A text of the key; returns its right end."""
    label = Label(text, [], size=0.88 * SIZE["text"], color=SOFT)
    sketch.text((x, y), label, ha="left", va="center_baseline")
    return x + sketch.wide(text, label.size)


# -- numbers -----------------------------------------------------------------------------------


def _table(
    figure: Figure, pose: Pose, free: FreeBody, acting: Sequence[Acting], gap: float, least: float
) -> tuple[Any, Array, Array, float]:
    """Names and values of everything that acts, and how well they close; forces below `least` have
    no arrow.
    """
    axes, units = _axes(figure), pose.mechanism.shown
    rows = []
    for one in acting:
        size, torque = one.value(units)
        where = one.where
        if one.force is not None and float(np.hypot(*one.force)) < least:
            where += " (not drawn)"
        rows.append((one.text, size, torque, one.color, where))
    if not rows:
        rows = [("no forces", "", "", SOFT, "")]
    columns = [max(extent(row[k], SIZE["text"])[0] for row in rows) for k in (0, 1, 2, 4)]
    starts = np.cumsum([0.0, columns[0] + 12.0, columns[1] + 8.0, columns[2] + 10.0])
    y = 0.0
    for text, size, torque, color, at in rows:
        y -= LINE
        put = {"size": SIZE["text"], "va": "baseline"}
        axes.text(0.0, y, drawable(text), color=color, **put)
        axes.text(starts[1] + columns[1], y, drawable(size), color=INK, ha="right", **put)
        axes.text(starts[2] + columns[2], y, torque, color=INK, ha="right", **put)
        axes.text(starts[3], y, at, color=SOFT, style="italic", **put)
    wide = starts[3] + columns[3]
    y -= 0.4 * LINE
    for text in closing_words(free, gap):
        y -= 0.95 * LINE
        axes.text(0.0, y, text, color=SOFT, size=0.88 * SIZE["text"], va="baseline")
        wide = max(wide, extent(text, 0.88 * SIZE["text"])[0])
    return axes, np.array([0.0, y - 4.0]), np.array([wide, 0.0]), 1.0


# -- the whole ---------------------------------------------------------------------------------


def _laid_out(figure: Figure, rows: Sequence[tuple[str, FreeBodyRow]]) -> None:
    """Place the parts of all rows in columns, with their words above."""
    columns = max(len(row.parts) for _, row in rows)
    widths = np.zeros(columns)
    for _, row in rows:
        shift = columns - len(row.parts)  # without a polygon the table stays on the right
        for n, (wide, _) in enumerate(row.sizes):
            place = n if n == 0 else n + shift
            widths[place] = max(widths[place], wide)
    total = max(LEAST, float(widths.sum()) + GAP * (columns - 1)) + 2.0 * EDGE
    letters = int((total - 2.0 * EDGE) / (0.47 * SIZE["text"]))
    blocks, high = [], EDGE
    for title, row in rows:
        heads = textwrap.wrap(title, int(letters / 1.2)) if title else []
        words = textwrap.wrap(row.words, letters)
        tall = max(height for _, height in row.sizes)
        above = (18.0 * len(heads) + 6.0 if heads else 0.0) + 16.0 + 12.5 * len(words) + 8.0
        blocks.append((heads, words, row, tall, above))
        high += above + tall + BETWEEN
    high += EDGE - BETWEEN
    figure.set_size_inches(total / 72.0, high / 72.0)
    y = high - EDGE

    def write(text: str, size: float, color: str, down: float, **more: Any) -> None:
        nonlocal y
        y -= down
        figure.text(
            EDGE / total, y / high, text.replace("$", r"\$"), size=size, color=color, **more
        )

    for heads, words, row, tall, _ in blocks:
        for text in heads:
            write(text, SIZE["title"], INK, 18.0)
        y -= 6.0 if heads else 0.0
        write(row.title, 1.08 * SIZE["text"], INK, 16.0, weight="bold")
        for text in words:
            write(text, SIZE["text"], SOFT, 12.5)
        y -= 8.0
        x, shift = EDGE, columns - len(row.parts)
        spare = (total - 2.0 * EDGE - float(widths.sum()) - GAP * (columns - 1)) / columns
        for n, ((axes, low, top, _), (wide, tall_part)) in enumerate(
            zip(row.parts, row.sizes, strict=True)
        ):
            place = n if n == 0 else n + shift
            left = x + float(widths[:place].sum()) + (GAP + max(spare, 0.0)) * place
            inset = 0.5 * (widths[place] - wide) if place < columns - 1 else 0.0
            bottom = y - 0.5 * (tall + tall_part)
            axes.set_position(
                ((left + inset) / total, bottom / high, wide / total, tall_part / high)
            )
            axes.set_xlim(low[0], top[0])
            axes.set_ylim(low[1], top[1])
        y -= tall + BETWEEN
        if row is not blocks[-1][2]:
            line = y + 0.5 * BETWEEN
            from matplotlib.lines import Line2D

            rule = Line2D([EDGE / total, 1 - EDGE / total], [line / high] * 2, lw=0.6, color=SOFT)
            rule.set_alpha(0.5)
            figure.add_artist(rule)
