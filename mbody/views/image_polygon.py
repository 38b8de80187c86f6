"""The velocity or acceleration polygon of a mechanism, drawn from its pole."""

from __future__ import annotations

import itertools
import math
import re
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from mbody.engineering.motion_polygons import MotionPolygon
from mbody.model.joints import PinSlot, Prismatic
from mbody.views.frame import nice, rounded_number
from mbody.views.guides import guide
from mbody.views.labels import Label, symbolic, together
from mbody.views.shapes import hull
from mbody.views.style import DRIVE, FORCE, INK, LOAD, PAPER, PLATE, SIZE, SOFT, Z

if TYPE_CHECKING:
    from mbody.views.pose import Pose
    from mbody.views.sketch import Sketch

__all__ = ["draw_polygon"]

Array = np.ndarray

#: Points: greatest length of a velocity or acceleration.
SIDE = 175.0
#: Images nearer than this part of the greatest are one; shorter sides in points are not drawn.
ONE, SHORT = 1e-9, 2.0
#: With more images than this their sides are not split.
MANY = 6
#: Dashes of components, and of what slides.
PARTS, SLIDING = (0, (2.5, 2.0)), (0, (6.0, 2.0))


@dataclass
class Image:
    """One corner of the polygon.

    Attributes
    ----------
    at : array (2,)
        Velocity or acceleration.
    names : list of str
        Points of the polygon that have it.
    text : str
        Its label.
    """

    at: Array
    names: list[str]
    text: str = ""


def draw_polygon(sketch: Sketch, found: MotionPolygon, pose: Pose) -> str:
    """Draw the polygon of an instant on a sketch in points; a sentence where nothing moves."""
    k = pose.k
    vectors = {name: np.array([x[k], found.y[name][k]]) for name, x in found.x.items()}
    greatest = max((float(np.hypot(*v)) for v in vectors.values()), default=0.0)
    letter = found.quantity[0]
    if not np.isfinite(greatest) or greatest == 0.0:
        return f"there is no {found.quantity} polygon: no point has one"
    scale = SIDE / greatest
    images = _images(vectors, greatest, scale)
    _named(images, found, pose)
    pole, others = images[0], images[1:]
    for image in sorted(others, key=lambda one: -float(np.hypot(*one.at))):
        sketch.arrow((0.0, 0.0), scale * image.at, FORCE, width=1.5, name=f"image:{image.names[0]}")
    few = len(others) <= MANY
    for body, names in found.links.items():
        _link_image(sketch, [_of(images, name) for name in names], scale, body)
        if few and letter == "a":
            _components(sketch, [_of(images, name) for name in names], scale, pose, body)
    for joint, pair in found.joints.items():
        ends = [_of(images, name) for name in pair]
        if len(ends) == 2 and ends[0] is not ends[1]:
            _sliding(sketch, ends, scale, pose, joint, letter)
    sketch.disc((0.0, 0.0), 2.2, PAPER, INK, 1.1, Z["arrow"] + 0.3, name="image:pole")
    middle = np.mean([scale * one.at for one in images], axis=0)
    sketch.label(f"$o_{{{letter}}}$", (0.0, 0.0), _away(-middle), 5.0, name=f"label:{pole.text}")
    for image in others:
        place = scale * image.at
        sketch.disc(place, 1.5, INK, INK, 0.4, Z["pin"], name=f"corner:{image.names[0]}")
        if image.text:
            sketch.label(image.text, place, _away(place - 0.4 * middle), 4.0)
    sketch.write()
    _key(sketch, found, pose, scale)
    return ""


def _away(vector: Array) -> float:
    return math.atan2(vector[1], vector[0]) if np.hypot(*vector) > 1e-9 else -0.75


def _images(vectors: dict[str, Array], greatest: float, scale: float) -> list[Image]:
    """Distinct corners, the pole first."""
    found = [Image(np.zeros(2), [])]
    for name, vector in vectors.items():
        for image in found:
            if float(np.hypot(*(image.at - vector))) <= ONE * greatest:
                image.names.append(name)
                break
        else:
            found.append(Image(vector, [name]))
    return found


def _of(images: list[Image], name: str) -> Image:
    return next(image for image in images if name in image.names)


def _named(images: list[Image], found: MotionPolygon, pose: Pose) -> None:
    """Letters of images: those of the pins, in small; with the number of the link where two
    bodies have different images at one place.
    """
    numbers = {
        name: n for n, name in enumerate(["ground", *(b.name for b in pose.mechanism.bodies)], 1)
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
            there = _pin_there(found, pose, joint, body) or joint
            texts.append(symbolic(f"{_small(there)}{numbers[body]}"))
        image.text = ", ".join(dict.fromkeys(texts))


def _pin_there(found: MotionPolygon, pose: Pose, joint: str, body: str) -> str:
    """The pin at the place of a slide, which is on the other body of the slide."""
    if not isinstance(pose.mechanism[joint], Prismatic | PinSlot):
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


def _link_image(sketch: Sketch, corners: list[Image], scale: float, body: str) -> None:
    """The image of a link: a line or a plate, without sides from the pole."""
    own = list({id(one): one for one in corners}.values())
    places = [scale * one.at for one in own]
    if len(own) < 2 or body == "ground":
        return
    if len(own) > 2:
        outline = hull(places, 0.5)
        if len(outline) > 2:
            sketch.shape(outline, PLATE, INK, 0.9, Z["plate"], name=f"link:{body}", weight=0.7)
            return
    for a, b in itertools.pairwise(places):
        clear = min(float(np.hypot(*a)), float(np.hypot(*b))) > SHORT
        if clear and float(np.hypot(*(b - a))) > SHORT:
            sketch.line([a, b], 1.1, INK, Z["link"], name=f"link:{body}", weight=0.8)


def _components(sketch: Sketch, corners: list[Image], scale: float, pose: Pose, body: str) -> None:
    """The normal and the tangential part of the difference of two points of a link."""
    if body == "ground" or len(corners) < 2:
        return
    motion = pose.body(body)
    w, alpha = float(motion.omega[pose.k]), float(motion.alpha[pose.k])
    first, second = corners[:2]
    if first is second:
        return
    # difference of places from that of accelerations: a = (iα − ω²) r
    turning = complex(-w * w, alpha)
    r = complex(*(second.at - first.at)) / turning if turning else 0j
    normal, across = -w * w * r, 1j * alpha * r
    if min(abs(normal), abs(across)) * scale < SHORT:
        return
    start = scale * first.at
    corner = start + scale * np.array([normal.real, normal.imag])
    ends = [start, corner, scale * second.at]
    sketch.line(ends, 0.8, DRIVE, Z["link"] + 0.1, dashes=PARTS, name=f"parts:{body}", weight=0.5)
    for text, (a, b) in zip("nt", itertools.pairwise(ends), strict=True):
        middle = 0.5 * (np.asarray(a) + np.asarray(b))
        sketch.label(
            text,
            middle,
            _away(np.array([-(b - a)[1], (b - a)[0]])),
            2.0,
            color=DRIVE,
            size=0.8 * SIZE["text"],
            italic=True,
        )


def _sliding(
    sketch: Sketch, ends: list[Image], scale: float, pose: Pose, joint: str, letter: str
) -> None:
    """The line between the images of a slide; of accelerations with Coriolis's part."""
    a, b = (scale * one.at for one in ends)
    line = [a, b]
    element = pose.mechanism[joint]
    if letter == "a" and isinstance(element, Prismatic | PinSlot):
        carrier, _, _ = guide(element)
        first, second = (a, b) if element.i.body == carrier else (b, a)
        w = float(pose.body(carrier).omega[pose.k]) if carrier != "ground" else 0.0
        sliding = _relative(pose, element, carrier)
        part = 2.0 * w * scale * np.array([-sliding[1], sliding[0]])
        if float(np.hypot(*part)) > SHORT:
            line = [first, first + part, second]
            sketch.label(
                "C",
                first + 0.5 * part,
                _away(np.array([-part[1], part[0]])),
                2.0,
                color=LOAD,
                size=0.8 * SIZE["text"],
                italic=True,
            )
    sketch.line(line, 1.2, LOAD, Z["link"] + 0.2, dashes=SLIDING, name=f"sliding:{joint}")


def _relative(pose: Pose, joint: Prismatic | PinSlot, carrier: str) -> Array:
    """The velocity of sliding in the world's axes."""
    other = joint.j.body if joint.i.body == carrier else joint.i.body
    place = pose.reaction_point(joint)
    speeds = []
    for body in (carrier, other):
        if body == "ground":
            speeds.append(np.zeros(2))
            continue
        b = pose.body(body)
        away = place - pose.centre(body)
        w = float(b.omega[pose.k])
        speeds.append(np.array([b.vx[pose.k] - w * away[1], b.vy[pose.k] + w * away[0]]))
    return np.asarray(speeds[1] - speeds[0])


def _key(sketch: Sketch, found: MotionPolygon, pose: Pose, scale: float) -> None:
    """Title above, and the scale below."""
    units = pose.mechanism.units
    low, high = sketch.low.copy(), sketch.high.copy()
    value = nice(48.0 / scale)
    text = f"{rounded_number(value)} {units.of(found.quantity)}"
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
