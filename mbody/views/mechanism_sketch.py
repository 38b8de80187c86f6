"""What a drawing of a mechanism shows, and its sketch from the lowest layer to the labels."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from mbody.errors import ModelError, brief
from mbody.model.driver import Driver
from mbody.model.element import listed
from mbody.model.mechanism import Mechanism
from mbody.sheets.text_table import force_floor, force_names
from mbody.views.body_shapes import body_shapes, bounds, wheels
from mbody.views.frame import rounded_number
from mbody.views.friction_symbols import (
    circle_scale,
    contact_forces,
    contact_symbol,
    friction_circles,
    line_of_action,
    modes_shown,
    sticking_symbol,
)
from mbody.views.joint_symbols import coupling_symbol, joint_symbol, outward
from mbody.views.labels import symbolic, together
from mbody.views.links import are_lines, link, link_label, link_lines, points, with_symbols
from mbody.views.load_symbols import driver_symbol, force_arrow, forces_shown, load_symbol
from mbody.views.pose import Pose
from mbody.views.sketch import Sketch
from mbody.views.style import FORCE, LOAD, SIZE, SOFT, Z

Array = np.ndarray

#: With more bodies than this only joints and loads are named.
NAMED = 24
#: How much worse a label is on an arrow than on another line.
ARROW = 8.0


@dataclass(frozen=True)
class Shown:
    """Which elements of a mechanism are drawn.

    Attributes
    ----------
    mechanism : Mechanism
    only : sequence of str
        Bodies; all where there are none.
    """

    mechanism: Mechanism
    only: Sequence[str]

    def __post_init__(self) -> None:
        known = [body.name for body in self.mechanism.bodies]
        for name in self.only:
            if name not in known:
                raise ModelError(
                    f"there is no moving body {brief(name)} to draw (there are: {listed(known)})",
                    str(name),
                )

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
    """An instant that is drawn with its forces: a driver's arrow is the way that its effort acts,
    which may be against its motion.
    """

    def rate(self, driver: str) -> float:
        """The effort of a driver; where it has none the rate."""
        effort, floor = float(self.run.effort(driver)[self.k]), force_floor(self.run)
        angular = self.mechanism[driver].angular  # type: ignore[attr-defined]  # a driver
        floor *= self.system.length if angular else 1.0
        return effort if abs(effort) > floor else super().rate(driver)


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


def faded(sketch: Sketch, pose: Pose, shown: Shown, part: float) -> None:
    """Draw another instant below, faded."""
    axes = sketch.axes
    before = {id(artist) for artist in axes.get_children()}
    ghost = Faded(axes, pose, sketch.unit, sketch.small)
    _links(ghost, shown)
    for artist in axes.get_children():
        if id(artist) not in before and artist.get_zorder() >= Z["ring"]:
            artist.set_alpha(part)
            artist.set_zorder(0.1 * artist.get_zorder())
            gid = artist.get_gid()
            artist.set_gid(f"at {pose.k}:{gid}" if gid else None)
    sketch.low, sketch.high = np.fmin(sketch.low, ghost.low), np.fmax(sketch.high, ghost.high)


def longest_force(poses: Sequence[Pose], forces: bool, shown: Shown) -> float:
    """The greatest force of several instants, by which all their arrows are drawn."""
    rows = [row for pose in poses for row in _shown_forces(pose, forces, shown)]
    return max((float(np.hypot(*vector)) for _, _, vector, _, _ in rows), default=0.0)


def _shown_forces(pose: Pose, forces: bool, shown: Shown) -> list[Any]:
    every = forces_shown(pose, forces)
    if forces and pose.run.has_forces:
        every += contact_forces(pose)
    if not shown.only:
        return every
    own = {joint.name for joint in shown.between(pose.mechanism.joints)}
    books = {force_names(pose.mechanism)[name][0] for name in own}
    more = shown.between((*pose.mechanism.loads, *pose.mechanism.contacts))
    return [row for row in every if row[0] in books | {one.name for one in more}]


def sketch_scale(
    poses: Sequence[Pose], shown: Shown, tracks: list[Array], part: float
) -> tuple[float, float]:
    """Length of a point (1/72 in) in the units of the mechanism, and how much smaller symbols are
    where the links are short."""
    pose = poses[0]
    if shown.only:
        places = [node for one in poses for body in shown.bodies for node in one.nodes[body]]
        places += [one.centre(body) for one in poses for body in shown.bodies]
        corners = np.vstack([*places, *tracks])
    else:
        corners = np.vstack([*map(bounds, poses), *tracks])
    wide, high = corners.max(axis=0) - corners.min(axis=0)
    unit = max(wide / SIZE["width"], high / SIZE["height"]) / part
    if not unit > 1e-12 * pose.system.length:
        unit = pose.system.length / SIZE["width"]
    joints = shown.between(pose.joints)
    lengths = [1.5 * radius for joint in joints for _, radius in wheels(joint, pose)]
    bodies = {*shown.bodies}
    for name, nodes in pose.nodes.items():
        if name in bodies and len(nodes) > 1:
            lengths.append(float(np.max(np.ptp(np.array(nodes), axis=0))))
    lengths = [length for length in lengths if length > unit]
    typical = float(np.median(lengths)) if lengths else 60.0 * unit
    return unit, min(1.0, max(0.3, typical / (55.0 * unit)))


def _driven(pose: Pose, driver: Driver) -> str:
    """The name of a driver with its effort."""
    turns, floor = driver.angular, force_floor(pose.run)
    effort = float(pose.run.effort(driver.name)[pose.k])
    if abs(effort) <= floor * (pose.system.length if turns else 1.0):
        effort = 0.0
    unit = pose.mechanism.units.of("torque" if turns else "force")
    book = force_names(pose.mechanism)[driver.name][0]
    # where several share a pair of links their own names follow: once is enough
    between = "" if "," in book else f": {symbolic(book)}"
    return f"{symbolic(driver.name)}{between} = {rounded_number(effort)} {unit}"


def sketch_mechanism(
    sketch: Sketch,
    forces: bool,
    tracks: dict[str, Array],
    shown: Shown,
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
    lines = _links(sketch, shown, body_shapes)
    joints = shown.between(pose.joints)
    for coupling in shown.between(mechanism.couplings):
        coupling_symbol(coupling, sketch)
    sketch.lay()
    for load in () if sketch.kinematic else shown.between(mechanism.loads):
        load_symbol(load, sketch)
    for driver in shown.between(mechanism.drivers):
        driver_symbol(driver, sketch, _driven(pose, driver) if forces else symbolic(driver.name))
    rows = [] if sketch.kinematic else _shown_forces(pose, forces, shown)
    if longest is None:
        longest = max((float(np.hypot(*vector)) for _, _, vector, _, _ in rows), default=0.0)
    if longest > 0.0:
        sketch.force_scale = SIZE["arrow"] * sketch.unit / longest
    _rubbing(sketch, forces and pose.run.has_forces, shown)
    for body in () if lines else shown.bodies:
        points(sketch, body)
    if len(joints) <= 2 * NAMED:
        _pin_labels(sketch)
    arrows = _arrows(sketch, rows, forces, longest)
    if len(shown.bodies) <= NAMED:
        for body in shown.bodies:
            link_label(sketch, body)
    if more is not None:
        more(sketch)
    sketch.write()
    return arrows


def _links(
    sketch: Sketch, shown: Shown, shapes: Callable[[Sketch, str], None] | None = None
) -> bool:
    """Draw links, their shapes and joints; whether links are lines, since there are very many."""
    bodies, joints = shown.bodies, shown.between(sketch.pose.joints)
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


def _rubbing(sketch: Sketch, forces: bool, shown: Shown) -> None:
    """Marks of modes, with forces the cones and circles of friction too."""
    pose, mechanism = sketch.pose, sketch.pose.mechanism
    joints = shown.between(mechanism.joints)
    for contact in (*shown.between(mechanism.contacts), *(() if shown.only else mechanism.groups)):
        contact_symbol(contact, sketch, forces=forces)
    for joint in joints:
        sticking_symbol(joint, sketch)
    if forces:
        sketch.enlarged = circle_scale(pose, sketch.unit, joints)
        friction_circles(sketch, joints, sketch.enlarged)
    sketch.modes = modes_shown(pose)


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
    sketch: Sketch, shown: list[Any], forces: bool, greatest: float
) -> tuple[float, float, str] | None:
    """All forces at one scale: the length of a unit of force, the greatest one, and a colour."""
    sizes = [float(np.hypot(*vector)) for _, _, vector, _, _ in shown]
    if not greatest > 0.0:
        return None
    scale = sketch.force_scale
    unit = sketch.pose.mechanism.units.of("force")
    pose = sketch.pose
    books = {force_names(pose.mechanism)[one.name][0]: one for one in pose.mechanism.joints}
    touching = {one.name for one in (*pose.mechanism.contacts, *pose.mechanism.groups)}
    for (name, place, vector, color, _), size in zip(shown, sizes, strict=True):
        # of very many the arrows alone can be read
        text = (
            f"{symbolic(name)} = {rounded_number(size)} {unit}" if len(shown) <= 2 * NAMED else ""
        )
        if name in books and forces and pose.run.has_forces:
            # a pin that slides is touched by its reaction at the friction circle
            place = place + line_of_action(pose.run, books[name], sketch.enlarged)[pose.k]
        begins = name in touching
        force_arrow(sketch, name, place, vector, color, text, scale, begins=begins)
    # a label on an arrow could be read as its name
    for line in sketch.axes.lines:
        if str(line.get_gid()).startswith("force:"):
            ends = np.asarray(line.get_xydata())[[0, -1]]
            sketch.places.stroke(ends, 1.5 * sketch.unit, ARROW)
    return scale, greatest, FORCE if forces else LOAD
