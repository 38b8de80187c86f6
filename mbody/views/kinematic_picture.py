"""A kinematic picture of one instant: instant centres, centrodes, curvature, and the polygons of
velocities and accelerations beside the mechanism.
"""

from __future__ import annotations

import itertools
import math
import re
import textwrap
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from mbody.core.tolerances import LENGTH_NONE, POINT_SAME, PRINTED_NONE, TINY
from mbody.engineering.instant_centres import (
    centrodes,
    inflection_circle,
    instant_centres,
    kennedy_lines,
    path_curvature,
)
from mbody.model.driver import Driver
from mbody.model.element import unknown_name
from mbody.model.mechanism import Mechanism
from mbody.summaries.text_table import force_floor, force_names
from mbody.views import acting
from mbody.views.acting import drawn_forces, driver_symbol, force_arrow, load_symbol, notation
from mbody.views.body_shapes import body_shapes, bounds, wheels
from mbody.views.free_bodies import PolygonContent, Side, polygon_contents
from mbody.views.joint_symbols import (
    are_lines,
    coupling_symbol,
    joint_symbol,
    link,
    link_label,
    link_lines,
    outward,
    points,
    with_symbols,
)
from mbody.views.labels import (
    DRIVER,
    FORCE,
    INK,
    LOAD,
    PAPER,
    PLATE,
    POLE,
    SIZE,
    SOFT,
    Label,
    Z,
    blank,
    styled,
    symbolic,
    together,
)
from mbody.views.shapes import Pose, direction, hull
from mbody.views.sketch import Sketch, captions, key_row, key_size, rounded, rounded_number

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from mbody.engineering.instant_centres import InstantCentre, InstantCentres
    from mbody.solution.solution import Solution


# -- Sketch of a mechanism, from the lowest layer to the labels --------------------------------

Array = np.ndarray

#: With more bodies than this only joints and loads are named.
NAMED = 24
#: How much worse a label is on an arrow than on another line.
ARROW = 8.0


@dataclass(frozen=True)
class ElementSelection:
    """Which elements of a mechanism are drawn.

    `only`: Bodies; all where there are none.
    """

    mechanism: Mechanism
    only: Sequence[str]

    def __post_init__(self) -> None:
        known = [body.name for body in self.mechanism.bodies]
        for name in self.only:
            if name not in known:
                raise unknown_name("moving body", name, known, use=" to draw")

    @property
    def bodies(self) -> list[str]:
        """Names of the bodies."""
        return list(self.only) or [body.name for body in self.mechanism.bodies]

    def between(self, elements: Any) -> list[Any]:
        """The elements that join only shown bodies and the ground, with one shown body at least."""
        if not self.only:
            return list(elements)
        own, found = {*self.only}, []
        for element in elements:
            ends = {element.i.body, element.j.body} if element.role == "joint" else element.bodies
            ends = {*ends}
            if ends & own and ends <= own | {"ground"}:
                found.append(element)
        return found


class LoadedPose(Pose):
    """An instant that is drawn with its forces: a driver's arrow is the direction in which its
    effort acts, which may be against its motion.
    """

    def rate(self, driver: str) -> float:
        """The effort of a driver; where it has none the rate."""
        return float(acting.drive_sense(self.run, driver, forces=True)[self.k])


class Faded(Sketch):
    """A sketch of another instant: links, pins and symbols, without ground and labels."""

    def support(self, place: Array, others: list[Array], name: str) -> None:
        """None: it is that of the instant in full."""

    def rail(self, start: Array, end: Array, name: str, margin: float = 0.0) -> None:
        """None, as `support`."""

    def ground(self, start: Any, end: Any, *, name: str = "") -> None:
        """None, as `support`."""

    def write(self) -> None:
        """None: labels are of the instant in full."""


def faded(sketch: Sketch, pose: Pose, selection: ElementSelection, part: float) -> None:
    """Draw another instant below, faded."""
    axes = sketch.axes
    before = {id(artist) for artist in axes.get_children()}
    ghost = Faded(axes, pose, sketch.unit, sketch.small)
    _links(ghost, selection)
    for artist in axes.get_children():
        if id(artist) not in before and artist.get_zorder() >= Z["ring"]:
            artist.set_alpha(part)
            artist.set_zorder(0.1 * artist.get_zorder())
            gid = artist.get_gid()
            artist.set_gid(f"at {pose.k}:{gid}" if gid else None)
    sketch.low, sketch.high = np.fmin(sketch.low, ghost.low), np.fmax(sketch.high, ghost.high)


def longest_force(poses: Sequence[Pose], forces: bool, selection: ElementSelection) -> float:
    """The greatest force of several instants, by which all their arrows are drawn."""
    rows = [row for pose in poses for row in _selected_forces(pose, forces, selection)]
    return max((float(np.hypot(*vector)) for _, _, vector, _, _ in rows), default=0.0)


def _selected_forces(pose: Pose, forces: bool, selection: ElementSelection) -> list[Any]:
    every = drawn_forces(pose, forces)
    if forces and pose.run.has_forces:
        every += acting.contact_forces(pose)
    if not selection.only:
        return every
    own = {joint.name for joint in selection.between(pose.mechanism.joints)}
    books = {force_names(pose.mechanism)[name][0] for name in own}
    more = selection.between((*pose.mechanism.loads, *pose.mechanism.contacts))
    return [row for row in every if row[0] in books | {one.name for one in more}]


def sketch_scale(
    poses: Sequence[Pose], selection: ElementSelection, tracks: list[Array], part: float
) -> tuple[float, float]:
    """Length of a point (1/72 in) in the units of the mechanism, and how much smaller symbols are
    where the links are short."""
    pose = poses[0]
    if selection.only:
        places = [node for one in poses for body in selection.bodies for node in one.nodes[body]]
        places += [one.centre(body) for one in poses for body in selection.bodies]
        corners = np.vstack([*places, *tracks])
    else:
        corners = np.vstack([*map(bounds, poses), *tracks])
    wide, high = corners.max(axis=0) - corners.min(axis=0)
    unit = max(wide / SIZE["width"], high / SIZE["height"]) / part
    if not unit > LENGTH_NONE * pose.system.length:
        unit = pose.system.length / SIZE["width"]
    joints = selection.between(pose.joints)
    lengths = [1.5 * radius for joint in joints for _, radius in wheels(joint, pose)]
    bodies = {*selection.bodies}
    for name, nodes in pose.nodes.items():
        if name in bodies and len(nodes) > 1:
            lengths.append(float(np.max(np.ptp(np.array(nodes), axis=0))))
    lengths = [length for length in lengths if length > unit]
    typical = float(np.median(lengths)) if lengths else 60.0 * unit
    return unit, min(1.0, max(0.3, typical / (55.0 * unit)))


def _driven(pose: Pose, driver: Driver) -> str:
    """The name of a driver with its effort."""
    angular, floor = driver.angular, force_floor(pose.run)
    effort = float(pose.run.effort(driver.name)[pose.k])
    if abs(effort) <= floor * (pose.system.length if angular else 1.0):
        effort = 0.0
    shown = rounded(effort, "torque" if angular else "force", pose.mechanism.shown)
    book = force_names(pose.mechanism)[driver.name][0]
    # where several share a pair of links their own names follow: once is enough
    between = "" if "," in book else f": {symbolic(book)}"
    return f"{symbolic(driver.name)}{between} = {shown}"


def sketch_mechanism(
    sketch: Sketch,
    forces: bool,
    tracks: dict[str, Array],
    selection: ElementSelection,
    longest: float | None = None,
    more: Callable[[Sketch], None] | None = None,
) -> tuple[float, float, str] | None:
    """Draw everything from the lowest layer to the labels, and `more` before these are placed;
    returns the scale of the arrows.
    """
    pose, mechanism = sketch.pose, sketch.pose.mechanism
    for name, track in tracks.items():
        dashes = (0, (5, 3))
        sketch.line(track, 0.9, SOFT, Z["path"], name=f"path:{name}", dashes=dashes, weight=0.5)
    lines = _links(sketch, selection, body_shapes)
    joints = selection.between(pose.joints)
    for coupling in selection.between(mechanism.couplings):
        coupling_symbol(coupling, sketch)
    sketch.lay()
    for load in () if sketch.kinematic else selection.between(mechanism.loads):
        load_symbol(load, sketch)
    for driver in selection.between(mechanism.drivers):
        driver_symbol(driver, sketch, _driven(pose, driver) if forces else symbolic(driver.name))
    rows = [] if sketch.kinematic else _selected_forces(pose, forces, selection)
    if longest is None:
        longest = max((float(np.hypot(*vector)) for _, _, vector, _, _ in rows), default=0.0)
    if longest > 0.0:
        sketch.force_scale = SIZE["arrow"] * sketch.unit / longest
    _friction_marks(sketch, forces and pose.run.has_forces, selection)
    for body in () if lines else selection.bodies:
        points(sketch, body)
    if len(joints) <= 2 * NAMED:
        _pin_labels(sketch)
    arrows = _arrows(sketch, rows, forces, longest)
    if len(selection.bodies) <= NAMED:
        for body in selection.bodies:
            link_label(sketch, body)
    if more is not None:
        more(sketch)
    sketch.write()
    return arrows


def _links(
    sketch: Sketch, selection: ElementSelection, shapes: Callable[[Sketch, str], None] | None = None
) -> bool:
    """Draw links, their shapes and joints; whether links are lines, since there are very many."""
    bodies, joints = selection.bodies, selection.between(sketch.pose.joints)
    lines = are_lines(sketch.pose, bodies, sketch.unit)
    if lines:
        link_lines(sketch, bodies)
        joints = with_symbols(joints)
    for order, body in enumerate(bodies):
        if not lines:
            link(sketch, body, order)
        if shapes is not None:
            shapes(sketch, body)
    if shapes is not None:
        shapes(sketch, "ground")
    for joint in joints:
        joint_symbol(joint, sketch)
    return lines


def _friction_marks(sketch: Sketch, forces: bool, selection: ElementSelection) -> None:
    """Marks of modes, with forces the cones and circles of friction too."""
    pose, mechanism = sketch.pose, sketch.pose.mechanism
    joints = selection.between(mechanism.joints)
    groups = () if selection.only else mechanism.groups
    for contact in (*selection.between(mechanism.contacts), *groups):
        acting.contact_symbol(contact, sketch, forces=forces)
    for joint in joints:
        acting.sticking_symbol(joint, sketch)
    if forces:
        sketch.enlarged = acting.circle_scale(pose, sketch.unit, joints)
        acting.friction_circles(sketch, joints, sketch.enlarged)
    sketch.modes = acting.drawn_modes(pose)


def _pin_labels(sketch: Sketch) -> None:
    """The names of pins, those at one place together."""
    joints = {joint.name: joint for joint in sketch.pose.joints}
    for place, names in sketch.pins:
        if not names:
            continue
        bodies = [side.body for name in names for side in (joints[name].i, joints[name].j)]
        text = together(names)
        wanted = outward(sketch, place, *bodies)
        gap = sketch.size("pin") + 2.5 * sketch.unit
        sketch.label(text, place, wanted, gap, italic=True, name=f"name:{names[0]}")
    # pins are first: loads and drivers have more free space
    sketch.labels.sort(key=lambda label: not label.name.startswith("name:"))


def _arrows(
    sketch: Sketch, selection: list[Any], forces: bool, greatest: float
) -> tuple[float, float, str] | None:
    """All forces at one scale: the length of a unit of force, the greatest one, and a colour."""
    sizes = [float(np.hypot(*vector)) for _, _, vector, _, _ in selection]
    if not greatest > 0.0:
        return None
    scale = sketch.force_scale
    pose, units = sketch.pose, sketch.pose.mechanism.shown
    books = {force_names(pose.mechanism)[one.name][0]: one for one in pose.mechanism.joints}
    touching = {one.name for one in (*pose.mechanism.contacts, *pose.mechanism.groups)}
    for (name, place, vector, color, _), size in zip(selection, sizes, strict=True):
        # of very many the arrows alone can be read
        text = (
            f"{notation(name)} = {rounded(size, 'force', units)}"
            if len(selection) <= 2 * NAMED
            else ""
        )
        if name in books and forces and pose.run.has_forces:
            # a pin that slides is touched by its reaction at the friction circle
            place = place + acting.line_of_action(pose.run, books[name], sketch.enlarged)[pose.k]
        begins = name in touching
        force_arrow(sketch, name, place, vector, color, text, scale, begins=begins)
    # a label on an arrow could be read as its name
    for line in sketch.axes.lines:
        if str(line.get_gid()).startswith("force:"):
            ends = np.asarray(line.get_xydata())[[0, -1]]
            sketch.places.stroke(ends, 1.5 * sketch.unit, ARROW)
    return scale, greatest, FORCE if forces else LOAD


# -- Instant centres in a drawing: marks, symbols, and the lines of Aronhold and Kennedy -------


#: How far from the mechanism a centre is drawn, as a part of its diagonal.
CENTRES_MARGIN = 0.75
#: With more centres than this only those that a joint or the ground has are drawn and have lines.
MANY = 15
#: With more places than this they have no symbols: these would cover each other.
MOST_SYMBOLS = 50
#: Centres at infinity, and such as are none, that are said below a picture.
SAID = 6
#: Length of the arrow to a centre at infinity [points].
ARROW_TO_INFINITY = 34.0


def book_symbol(text: str) -> str:
    """The symbol of a centre as in books.

    >>> book_symbol("I13")
    '$I_{13}$'
    """
    return f"${text[0]}_{{{text[1:]}}}$"


@dataclass(frozen=True)
class CentreSelection:
    """Which centres of an instant are drawn.

    `groups`: Those within the picture, the ones at one point together.
    `words`: What is said of those that are not.
    """

    centres: InstantCentres
    pose: Pose
    groups: list[list[InstantCentre]]
    words: list[str]

    @property
    def places(self) -> list[Array]:
        """One of each group."""
        return [self.place(group[0]) for group in self.groups]

    def place(self, one: InstantCentre) -> Array:
        """Place of a centre."""
        return np.array([one.x[self.pose.k], one.y[self.pose.k]])

    def mark(self, sketch: Sketch) -> None:
        """Draw the lines below, the centres and their symbols above."""
        self._lines(sketch)
        for group in self.groups:
            place = self.place(group[0])
            kept = [one for one in group if one.permanence != "instantaneous"]
            names = sorted((self.centres.symbol(one) for one in group), key=_number)
            text = ", ".join(book_symbol(name) for name in names)
            gid = f"pole:{names[0]}"
            if kept:
                sketch.disc(
                    place, 0.34 * sketch.size("pin"), POLE, POLE, 0.5, Z["pin"] + 0.2, name=gid
                )
            else:
                radius = max(0.62 * sketch.size("pin"), 2.0 * sketch.unit)
                sketch.disc(place, radius, POLE, PAPER, 0.9, Z["pin"] + 0.2, name=gid)
            if len(self.groups) > MOST_SYMBOLS:
                continue
            away = place - sketch.pose.middle
            wanted = (
                math.atan2(away[1], away[0]) if np.hypot(*away) > sketch.unit else 0.5 * math.pi
            )
            gap = (1.0 if kept else 0.7) * sketch.size("pin") + 3.0 * sketch.unit
            label = sketch.label(
                text, place, wanted, gap, rotation_cost=0.6, color=POLE, name=f"label:{gid}"
            )
            label.italic = False

    def _lines(self, sketch: Sketch) -> None:
        """Through each constructed centre the lines on which it is found."""
        in_view = {one.bodies for group in self.groups for one in group}
        thin = len(self.centres) > MANY
        drawn: list[tuple[Array, Array]] = []
        for line in kennedy_lines(self.centres, sketch.pose.mechanism, self.pose.k):
            if line.pair not in in_view or (thin and "ground" not in line.pair):
                continue
            ends = self._ends(line.pair, line.through, in_view, sketch)
            if ends is not None:
                _join(drawn, ends, sketch.unit)
        for n, ends in enumerate(drawn):
            dashes = (0, (7, 3))
            sketch.line(
                ends,
                0.75,
                POLE,
                Z["path"] + 0.05,
                dashes=dashes,
                weight=0.35,
                name=f"kennedy:{n + 1}",
            )

    def _ends(
        self,
        pair: tuple[str, str],
        through: tuple[tuple[str, str], tuple[str, str]],
        in_view: set[tuple[str, str]],
        sketch: Sketch,
    ) -> tuple[Array, Array] | None:
        """The part of a line between centres that are drawn, a little longer."""
        k = self.pose.k
        at = [self.place(self.centres[pair])]
        for other in through:
            one = self.centres[other]
            if one.kind[k] == "finite" and one.bodies in in_view:
                at.append(self.place(one))
            elif one.kind[k] == "infinite":
                at.append(
                    at[0] + ARROW_TO_INFINITY * sketch.unit * direction(float(one.direction[k]))
                )
        if len(at) < 2:
            return None
        whole = np.array(at)
        offsets = whole - whole[0]
        offset = offsets[int(np.argmax(np.hypot(*offsets.T)))]
        length = float(np.hypot(*offset))
        if length < sketch.unit:
            return None
        u = offset / length
        along = offsets @ u
        more = 9.0 * sketch.unit
        return whole[0] + (along.min() - more) * u, whole[0] + (along.max() + more) * u


def _place(pose: Pose, place: Any) -> str:
    """A place in brackets, in the unit of length that is shown."""
    units, floor = pose.mechanism.shown, PRINTED_NONE * pose.system.length
    parts = (float(units.converted(one if abs(one) > floor else 0.0, "length")) for one in place)
    return f"({', '.join(map(rounded_number, parts))})"


def _number(symbol: str) -> tuple[int, str]:
    return len(symbol), symbol


def _join(lines: list[tuple[Array, Array]], ends: tuple[Array, Array], unit: float) -> None:
    """Add a line; what lies on one line with it becomes one with it."""
    start, end = ends
    for old in list(lines):
        span = old[1] - old[0]
        u = span / max(float(np.hypot(*span)), TINY)
        n = np.array([-u[1], u[0]])
        off = max(abs(float((place - old[0]) @ n)) for place in (start, end))
        part = sorted([float((start - old[0]) @ u), float((end - old[0]) @ u)])
        length = float(np.hypot(*span))
        if off < unit and part[0] < length and part[1] > 0.0:
            start, end = old[0] + min(part[0], 0.0) * u, old[0] + max(part[1], length) * u
            lines[:] = [line for line in lines if line is not old]
    lines.append((start, end))


def drawn_poles(centres: InstantCentres, pose: Pose, corners: Array) -> CentreSelection:
    """Choose the centres that a picture shows. `corners` (2, 2)."""
    k, machine = pose.k, pose.mechanism
    middle = corners.mean(axis=0)
    size = np.ptp(corners, axis=0)
    half = 0.5 * size + CENTRES_MARGIN * float(np.hypot(*size))
    few = len(centres) <= MANY
    groups: list[list[InstantCentre]] = []
    left, outside = [], []
    for one in centres.pairs:
        if one.kind[k] != "finite":
            continue
        place = np.array([one.x[k], one.y[k]])
        if not (few or "ground" in one.bodies or one.permanence != "instantaneous"):
            left.append(one)
            continue
        if (np.abs(place - middle) > half).any():
            outside.append(f"{centres.symbol(one)} at {_place(pose, place)}")
            continue
        for group in groups:
            there = np.array([group[0].x[k], group[0].y[k]])
            same = POINT_SAME * (pose.system.length + math.hypot(*place))
            if math.dist(there, place) <= same:
                group.append(one)
                break
        else:
            groups.append([one])
    words = [text for text in centres.sentences(k) if "one point" not in text]
    if len(words) > SAID + 1:
        words.sort(key=lambda text: "against ground" not in text)
        remaining = (
            f"{len(words) - SAID} more centres are at infinity, or are none: mbody poles has them"
        )
        words = [*words[:SAID], remaining]
    words = [*centres.notes, *words]
    if outside:
        unit = machine.shown.of("length")
        words.append(f"outside this picture: {', '.join(outside)} {unit}")
    if left:
        words.append(
            f"{len(left)} more centres of moving links are not drawn: mbody poles has them all"
        )
    if len(groups) > MOST_SYMBOLS:
        words.append(f"centres at {len(groups)} places, too near for symbols: mbody poles has them")
    return CentreSelection(centres, pose, groups, words)


# -- Centrodes, inflection circles and circles of curvature in a drawing -----------------------

DASHES = (0, (8, 2, 1.5, 2))
#: Of a circle of curvature, how much is drawn to each side [rad], and of its radius at most in
#: parts of the picture.
ARC, LARGE = 0.9, 1.2


def mark_centrodes(sketch: Sketch, whole: Solution, body: str, corners: Array) -> None:
    """The fixed and the moving centrode of a body over a motion, as far as the picture reaches."""
    pose = sketch.pose
    found = centrodes(whole, body)
    rotation = np.exp(1j * pose.angle(body))
    moving = complex(*pose.centre(body)) + rotation * (found.moving_x + 1j * found.moving_y)
    fixed = found.fixed_x + 1j * found.fixed_y
    for name, curve, color in (("fixed", fixed, POLE), ("moving", moving, LOAD)):
        line = _within(np.column_stack([curve.real, curve.imag]), corners)
        if np.isfinite(line[:, 0]).sum() < 2:
            continue
        dashes = "-" if name == "fixed" else (0, (5, 2))
        sketch.line(
            line, 1.1, color, Z["path"] + 0.1, dashes=dashes, weight=0.0, name=f"{name}:{body}"
        )
        _avoided(sketch, line)
        inside = line[np.isfinite(line[:, 0])]
        end = inside[int(np.argmax(inside[:, 1]))]
        sketch.label(f"{name} centrode", end, 0.5 * math.pi, 3.0 * sketch.unit, color=color)


def mark_inflection(sketch: Sketch, body: str, corners: Array) -> str:
    """The inflection circle of a body as far as the picture reaches, with its instant centre P and
    its inflection pole J; a sentence about it.
    """
    k, run = sketch.pose.k, sketch.pose.run
    found = inflection_circle(run, body)
    pole = np.array([found.pole_x[k], found.pole_y[k]])
    other = np.array([found.x[k], found.y[k]])
    diameter = float(found.diameter[k])
    if not np.isfinite(diameter):
        return f"{body} does not turn there: its inflection circle is a line at infinity"
    size = rounded(diameter, "length", sketch.pose.mechanism.shown)
    words = f"inflection circle of {body}: diameter {size}"
    line = _within(_circle(0.5 * (pole + other), 0.5 * diameter), corners)
    if np.isfinite(line).any():
        sketch.line(
            line, 1.1, DRIVER, Z["path"] + 0.2, name=f"inflection:{body}", weight=0.0, dashes=DASHES
        )
        _avoided(sketch, line)
    dot = 0.5 * sketch.size("pin")
    for place, text in ((pole, "P"), (other, "J")):
        if ((place < corners[0]) | (place > corners[1])).any():
            what = "instant centre" if text == "P" else "inflection pole"
            words += f", the {what} at {_place(sketch.pose, place)}"
            continue
        sketch.disc(place, dot, DRIVER, DRIVER, 0.5, Z["pin"] + 0.3, name=f"{text}:{body}")
        away = place - 0.5 * (pole + other)
        sketch.label(
            f"${text}$", place, math.atan2(away[1], away[0]), dot + 3.0 * sketch.unit, color=DRIVER
        )
    return words


def mark_curvature(sketch: Sketch, point: str, corners: Array) -> str:
    """The circle of curvature of the path of a point, and its radius; a sentence about it."""
    k, run = sketch.pose.k, sketch.pose.run
    found = path_curvature(run, point)
    place = sketch.pose.point(point)
    radius, curvature = float(found.radius[k]), float(found.curvature[k])
    if not np.isfinite(curvature):
        return f"{point} stands still: its path has a cusp, or ends, there"
    if not np.isfinite(found.centre_x[k]):
        return f"the path of {point} is straight there (a point of inflection, or a line)"
    size = rounded(radius, "length", sketch.pose.mechanism.shown)
    words = f"path of {point}: radius of curvature {size}"
    centre = np.array([found.centre_x[k], found.centre_y[k]])
    wide = float(np.hypot(*(corners[1] - corners[0])))
    about = math.atan2(*(place - centre)[::-1])
    half_angle = min(ARC, 0.25 * wide / radius)
    angles = np.linspace(about - half_angle, about + half_angle, 61)
    line = centre + radius * np.column_stack([np.cos(angles), np.sin(angles)])
    sketch.line(line, 1.3, LOAD, Z["path"] + 0.3, name=f"curvature:{point}", weight=0.5)
    if radius > LARGE * wide:
        return f"{words}, its centre outside this picture"
    sketch.line(
        [place, centre],
        0.8,
        SOFT,
        Z["path"] + 0.2,
        dashes=(0, (3, 2)),
        weight=0.3,
        name=f"radius:{point}",
    )
    sketch.disc(
        centre, 0.45 * sketch.size("pin"), LOAD, LOAD, 0.4, Z["pin"] + 0.1, name=f"centre:{point}"
    )
    away = centre - place
    name = symbolic(point.partition(".")[2] or point).strip("$")
    text = f"$C_{{{name}}}$" if len(name) == 1 else f"centre of {point}"
    sketch.label(text, centre, math.atan2(away[1], away[0]), 4.0 * sketch.unit, color=LOAD)
    return words


def _circle(centre: Array, radius: float) -> Array:
    """A circle in steps that stay fine where only a part of a large one is seen."""
    angles = np.linspace(0.0, 2.0 * math.pi, 2881)
    return np.asarray(centre + radius * np.column_stack([np.cos(angles), np.sin(angles)]))


def _within(line: Array, corners: Array) -> Array:
    """A line without what lies outside a rectangle."""
    outside = ((line < corners[0]) | (line > corners[1])).any(axis=1)
    return np.where(outside[:, None], np.nan, line)


def _avoided(sketch: Sketch, line: Array) -> None:
    """Let labels keep clear of a line with gaps."""
    for a, b in itertools.pairwise(line[:: max(1, len(line) // 360)]):
        if np.isfinite([a, b]).all():
            sketch.places.stroke(np.array([a, b]), 0.5 * sketch.unit, 0.4)


# -- The velocity or acceleration polygon of a mechanism, drawn from its pole ------------------

#: Points: greatest length of a velocity or acceleration.
SIDE = 175.0
#: Shorter sides of polygons, in points, are not drawn.
SHORT = 2.0
#: Dashes of components, and of what slides.
PARTS, SLIDING = (0, (2.5, 2.0)), (0, (6.0, 2.0))


def draw_polygon(sketch: Sketch, found: PolygonContent, pose: Pose) -> str:
    """Draw the polygon of an instant on a sketch in points; a sentence where nothing moves."""
    if not found.greatest > 0.0:
        return f"there is no {found.quantity} polygon: no point has one"
    scale = SIDE / found.greatest
    places = [scale * image.at[pose.k] for image in found.images]
    pole, *others = zip(found.images, places, strict=True)
    for image, place in sorted(others, key=lambda one: -float(np.hypot(*one[1]))):
        sketch.arrow((0.0, 0.0), place, FORCE, width=1.5, name=f"image:{image.names[0]}")
    for body, corners in found.links.items():
        _link_image(sketch, [places[n] for n in corners], body)
    for body, side in found.parts.items():
        line = _split(side, places, scale, pose)
        if min(math.dist(a, b) for a, b in itertools.pairwise(line)) >= SHORT:
            look: dict[str, Any] = {"dashes": PARTS, "name": f"parts:{body}", "weight": 0.5}
            sketch.line(line, 0.8, DRIVER, Z["link"] + 0.1, **look)
            _part_labels(sketch, line, side.texts, DRIVER)
    for joint, side in found.slides.items():
        line = _split(side, places, scale, pose)
        if side.texts and math.dist(*line[:2]) > SHORT:
            _part_labels(sketch, line, side.texts, LOAD)
        look = {"dashes": SLIDING, "name": f"sliding:{joint}"}
        sketch.line(line, 1.2, LOAD, Z["link"] + 0.2, **look)
    sketch.disc((0.0, 0.0), 2.2, PAPER, INK, 1.1, Z["arrow"] + 0.3, name="image:pole")
    middle = np.mean(places, axis=0)
    sketch.label(pole[0].text, (0.0, 0.0), _away(-middle), 5.0, name="label:pole")
    for image, place in others:
        sketch.disc(place, 1.5, INK, INK, 0.4, Z["pin"], name=f"corner:{image.names[0]}")
        if image.text:
            sketch.label(image.text, place, _away(place - 0.4 * middle), 4.0)
    sketch.write()
    _key(sketch, found, pose, scale)
    return ""


def _away(vector: Array) -> float:
    return math.atan2(vector[1], vector[0]) if np.hypot(*vector) > PRINTED_NONE else -0.75


def _split(side: Side, places: Sequence[Array], scale: float, pose: Pose) -> list[Array]:
    """A side with its corner, where it has one that is seen."""
    first, second = (places[n] for n in side.ends)
    if side.corner is None:
        return [first, second]
    return [first, scale * side.corner[pose.k], second]


def _part_labels(sketch: Sketch, line: Sequence[Array], texts: str, color: str) -> None:
    """The letters of the parts of a side, beside them."""
    look: dict[str, Any] = {"color": color, "size": 0.8 * SIZE["text"], "italic": True}
    for text, (a, b) in zip(texts, itertools.pairwise(line), strict=False):
        wanted = _away(np.array([a[1] - b[1], b[0] - a[0]]))
        sketch.label(text, 0.5 * (a + b), wanted, 2.0, **look)


def _link_image(sketch: Sketch, places: list[Array], body: str) -> None:
    """The image of a link: a line or a plate, without sides from the pole."""
    if len(places) > 2:
        outline = hull(places, 0.5)
        if len(outline) > 2:
            sketch.shape(outline, PLATE, INK, 0.9, Z["plate"], name=f"link:{body}", weight=0.7)
            return
    for a, b in itertools.pairwise(places):
        clear = min(float(np.hypot(*a)), float(np.hypot(*b))) > SHORT
        if clear and float(np.hypot(*(b - a))) > SHORT:
            sketch.line([a, b], 1.1, INK, Z["link"], name=f"link:{body}", weight=0.8)


def _key(sketch: Sketch, found: PolygonContent, pose: Pose, scale: float) -> None:
    """Title above, and the scale below."""
    low, high = sketch.low.copy(), sketch.high.copy()
    value, text = key_size(48.0 / scale, found.quantity, pose.mechanism.shown)
    y = float(low[1]) - 14.0
    x = float(low[0])
    sketch.arrow((x, y), (x + scale * value, y), SOFT, width=1.4, name="key")
    label = Label(text, [], size=0.9 * SIZE["text"], color=SOFT)
    sketch.text((x + scale * value + 4.0, y), label, ha="left", va="center_baseline")
    end = x + scale * value + 4.0 + sketch.wide(text, label.size)
    title = Label(f"{found.quantity} polygon", [], size=SIZE["text"], color=INK)
    top = float(high[1]) + 10.0
    sketch.text((x, top), title, ha="left", va="baseline")
    end = max(end, x + sketch.wide(title.text, title.size))
    sketch.high = np.fmax(high, np.array([end, top + 9.0]))
    sketch.low = np.fmin(low, np.array([x, y - 6.0]))


#: Points: gaps between the parts, the edge, a line of words, and how many letters one has at most.
GAP, EDGE, LINE = 30.0, 14.0, 12.5
#: How far curves are drawn beyond the mechanism, as a part of its size.
MARGIN = 0.5
#: Least width of the words.
LEAST = 340.0


@dataclass(frozen=True)
class KinematicMarks:
    """Kinematic constructions drawn into and beside a mechanism.

    `poles`, `polygons`: All instant centres; the polygons of velocities and accelerations.
    `centrodes`, `inflection`: Bodies.
    `curvature`: Points.
    """

    poles: bool = False
    polygons: bool = False
    centrodes: Sequence[str] = ()
    inflection: Sequence[str] = ()
    curvature: Sequence[str] = ()

    def __bool__(self) -> bool:
        return bool(
            self.poles or self.polygons or self.centrodes or self.inflection or self.curvature
        )


class _KinematicSketch(Sketch):
    kinematic = True


def kinematic_picture(
    run: Solution, instant: int, marks: KinematicMarks, tracks: dict[str, Array], whole: Solution
) -> Figure:
    """Draw one instant. `tracks` (points, 2)."""
    run = run.take([instant])
    pose, selection = Pose(run, 0), ElementSelection(run.mechanism, ())
    corners = bounds(pose)
    centres = instant_centres(run) if marks.poles else None
    poles = None if centres is None else drawn_poles(centres, pose, corners)
    extent = np.array(poles.places) if poles is not None else np.empty((0, 2))
    wide = np.ptp(corners, axis=0).max()
    frame = np.vstack([corners, extent]) if len(extent) else corners
    window = np.array([frame.min(axis=0) - MARGIN * wide, frame.max(axis=0) + MARGIN * wide])
    with styled():
        figure = blank()
        lines = [*tracks.values(), *([extent] if len(extent) else [])]
        scale = sketch_scale([pose], selection, lines, 1.0)
        sketch = _KinematicSketch(_add_axes(figure), pose, *scale)
        words: list[str] = []

        def more(drawn: Sketch) -> None:
            words.extend(_marked(drawn, marks, poles, whole, window))

        sketch_mechanism(sketch, False, tracks, selection, more=more)
        parts = [(sketch.axes, sketch.low, sketch.high, sketch.unit)]
        if marks.polygons:
            for found in polygon_contents(run):
                polygon = Sketch(_add_axes(figure), pose, 1.0, 1.0)
                said = draw_polygon(polygon, found, pose)
                if said:
                    words.append(said)
                    polygon.axes.remove()
                else:
                    parts.append((polygon.axes, polygon.low, polygon.high, 1.0))
        _laid_out(figure, sketch, parts, words)
    return figure


def _marked(
    sketch: Sketch,
    marks: KinematicMarks,
    poles: CentreSelection | None,
    whole: Solution,
    window: Array,
) -> list[str]:
    words = []
    for body in marks.centrodes:
        mark_centrodes(sketch, whole, body, window)
    for body in marks.inflection:
        words.append(mark_inflection(sketch, body, window))
    for point in marks.curvature:
        words.append(mark_curvature(sketch, point, window))
    if poles is not None:
        poles.mark(sketch)
        words += [_numbers(sketch.pose), *poles.words]
    return words


def _numbers(pose: Pose) -> str:
    """Which link has which number."""
    names = ["ground", *(body.name for body in pose.mechanism.bodies)]
    return "links: " + ", ".join(f"{n} {name}" for n, name in enumerate(names, 1))


def _add_axes(figure: Figure) -> Any:
    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0), label=f"part {len(figure.axes)}")
    axes.set_axis_off()
    return axes


def _laid_out(
    figure: Figure,
    sketch: Sketch,
    parts: Sequence[tuple[Any, Array, Array, float]],
    words: Sequence[str],
) -> None:
    """The mechanism on the left, polygons beside it where both fit one below the other, words
    below all.
    """
    sizes = [(high - low) / unit for _, low, high, unit in parts]
    main, others = sizes[0], sizes[1:]
    stacked = len(others) == 2 and sum(size[1] for size in others) + GAP <= 1.25 * max(
        main[1], 250.0
    )
    columns = [[1, 2]] if stacked else [[n] for n in range(1, len(parts))]
    wide = main[0] + sum(GAP + max(sizes[n][0] for n in column) for column in columns)
    tall = max([main[1], *(sum(sizes[n][1] for n in c) + GAP * (len(c) - 1) for c in columns)])
    heading, instant = captions(sketch)
    wide = max(wide, LEAST, sketch.wide(heading, SIZE["title"]) / sketch.unit)
    letters = int(wide / (0.44 * SIZE["text"]))
    signed = [re.sub(r"(?<![\w.])-(?=\d)", "−", sentence) for sentence in words]
    text = [part for sentence in signed for part in textwrap.wrap(sentence, letters)]
    key = 30.0
    whole = np.array([wide, tall + 40.0 + key + LINE * len(text)]) + 2.0 * EDGE
    figure.set_size_inches(*(whole / 72.0))
    left: dict[str, Any] = {"ha": "left", "va": "baseline"}
    y = whole[1] - EDGE - SIZE["title"]
    x0 = EDGE / whole[0]
    clean = heading.replace("$", r"\$")
    figure.text(x0, y / whole[1], clean, size=SIZE["title"], color=INK, **left)
    y -= 14.0
    figure.text(x0, y / whole[1], instant, size=0.9 * SIZE["text"], color=SOFT, **left)
    top = y - 12.0
    _placed(parts[0], EDGE, top - 0.5 * (tall + main[1]), whole)
    x = EDGE + main[0]
    for column in columns:
        x += GAP
        down = top
        spare = (tall - sum(sizes[n][1] for n in column) - GAP * (len(column) - 1)) / 2.0
        down -= max(spare, 0.0)
        for n in column:
            down -= sizes[n][1]
            _placed(parts[n], x, down, whole)
            down -= GAP
        x += max(sizes[n][0] for n in column)
    foot = top - tall - key
    axes = figure.add_axes((x0, foot / whole[1], 1.0 - x0, key / whole[1]), label="key")
    axes.set_axis_off()
    axes.set_xlim(0.0, (whole[0] - EDGE) * sketch.unit)
    axes.set_ylim(0.0, key * sketch.unit)
    key_row(sketch, axes, 0.45 * key * sketch.unit, main[0] * sketch.unit, None)
    y = foot
    for line in text:
        y -= LINE
        clean = line.replace("$", r"\$")
        look = {"size": 0.92 * SIZE["text"], "color": SOFT, "zorder": Z["text"], **left}
        figure.text(x0, (y + 3.0) / whole[1], clean, **look)


def _placed(part: tuple[Any, Array, Array, float], x: float, y: float, whole: Array) -> None:
    """Put axes at a place of the figure [points], in their scale."""
    axes, low, high, unit = part
    wide, tall = (high - low) / unit
    axes.set_position((x / whole[0], y / whole[1], wide / whole[0], tall / whole[1]))
    axes.set_xlim(low[0], high[0])
    axes.set_ylim(low[1], high[1])
