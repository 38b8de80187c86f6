"""What velocity and acceleration polygons show, decided once for paper and page."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from mbody.core.tolerances import POINT_SAME
from mbody.engineering.motion_polygons import MotionPolygon, acceleration_polygon, velocity_polygon
from mbody.model.joints import PinSlot, Prismatic
from mbody.views.body_shapes import guide
from mbody.views.labels import symbolic, together

if TYPE_CHECKING:
    from mbody.solution.solution import Solution

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
