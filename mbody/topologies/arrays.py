"""Linkages as arrays, many of different topology at once, without any element objects."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from mbody.errors import ModelError
from mbody.model.element import listed

__all__ = ["LinkageArrays", "linkage_arrays"]

#: What an array of linkages may contain.
NEEDED = ("joints", "links", "ground", "driver")
OPTIONAL = ("mass", "inertia", "cg", "slides", "directions")


@dataclass(frozen=True, eq=False)
class LinkageArrays:
    """Checked arrays; −1 and NaN where a linkage has no more of something.

    Attributes
    ----------
    joints : array (linkages, joints, 2)
    links : array of int (linkages, links, places)
        The joints of each link; the driven link is one of them.
    ground : array of bool (linkages, joints)
    driver : array of int (linkages, drivers)
        The driven links, −1 where there are fewer.
    mass, inertia : arrays (linkages, links)
    cg : array (linkages, links, 2)
    slides : array of int (linkages, slides, 2)
        Joint, and the link on which it slides, −1 for the ground; joint −1 where there is none.
    directions : array (linkages, slides)
    reasons : dict
        What is wrong with a linkage, by its number.
    """

    joints: np.ndarray
    links: np.ndarray
    ground: np.ndarray
    driver: np.ndarray
    mass: np.ndarray
    inertia: np.ndarray
    cg: np.ndarray
    slides: np.ndarray
    directions: np.ndarray
    reasons: dict[int, str]

    def __len__(self) -> int:
        return len(self.joints)


def linkage_arrays(arrays: Mapping[str, Any]) -> LinkageArrays:
    """The arrays of a user, checked.

    Raises
    ------
    ModelError
        For an array that is missing, unknown, of a wrong shape or type. What is wrong with single
        linkages is among the `reasons`.
    """
    if not isinstance(arrays, Mapping):
        raise ModelError(
            f"linkages takes a dict of arrays ({listed(NEEDED)}), not {type(arrays).__name__}"
        )
    unknown = [str(name) for name in arrays if name not in (*NEEDED, *OPTIONAL)]
    if unknown:
        raise ModelError(
            f"linkages know no array '{unknown[0]}' (there are: {listed((*NEEDED, *OPTIONAL))})"
        )
    missing = [name for name in NEEDED if name not in arrays]
    if missing:
        raise ModelError(f"the array '{missing[0]}' of the linkages is missing: give it")
    joints = _numbers("joints", arrays["joints"], (None, None, 2))
    count, nodes = joints.shape[:2]
    links = _integers("links", arrays["links"], (count, None, None))
    ground = _integers("ground", arrays["ground"], (count, None))
    driver = _driver(arrays["driver"], count)
    slides = _integers(
        "slides", arrays.get("slides", np.empty((count, 0, 2), np.int64)), (count, None, 2)
    )
    directions = _numbers(
        "directions", arrays.get("directions", np.zeros(slides.shape[:2])), slides.shape[:2]
    )
    fixed = np.zeros((count, nodes + 1), dtype=bool)
    np.put_along_axis(fixed, np.where((ground < 0) | (ground >= nodes), nodes, ground), True, 1)
    present = (links >= 0) & (links < nodes)
    # numbers that are none, or too large, are found where they are used
    with np.errstate(invalid="ignore", over="ignore"):
        mass, inertia, cg = _uniform(joints, links, present)
    found = {"mass": mass, "inertia": inertia, "cg": cg}
    for name, own in found.items():
        if name in arrays:
            found[name] = _numbers(name, arrays[name], own.shape)
    there = present.any(axis=2)
    for name in ("mass", "inertia"):
        found[name] = np.where(there, found[name], 0.0)
    found["cg"] = np.where(there[:, :, None], found["cg"], 0.0)
    made = LinkageArrays(
        joints,
        links,
        fixed[:, :nodes],
        driver,
        **found,
        slides=slides,
        directions=directions,
        reasons={},
    )
    if count:
        _refuse(made, ground)
    return made


def _driver(value: Any, count: int) -> np.ndarray:
    """The driven links of each linkage, one or several."""
    one = np.ndim(value) == 1
    found = _integers("driver", value, (count,) if one else (count, None))
    return found[:, None] if one else found


def _numbers(name: str, value: Any, shape: tuple[int | None, ...]) -> np.ndarray:
    return _array(name, value, shape, "iuf").astype(np.float64)


def _integers(name: str, value: Any, shape: tuple[int | None, ...]) -> np.ndarray:
    found = _array(name, value, shape, "iu")
    if found.dtype == np.uint64:
        # what does not fit is a number too large as well
        found = np.minimum(found, np.uint64(np.iinfo(np.int64).max))
    return found.astype(np.int64)


def _array(name: str, value: Any, shape: tuple[int | None, ...], kinds: str) -> np.ndarray:
    """An array of numbers of that shape, None where any size is allowed."""
    try:
        found = np.asarray(value)
    except (TypeError, ValueError):
        raise ModelError(
            f"'{name}' of the linkages is no array: its rows differ in length"
        ) from None
    fits = found.ndim == len(shape)
    fits = fits and all(n in (None, m) for n, m in zip(shape, found.shape, strict=True))
    if not fits:
        wanted = ", ".join("any" if n is None else str(n) for n in shape)
        raise ModelError(f"'{name}' of the linkages has the shape {found.shape}: give ({wanted})")
    if found.dtype.kind not in kinds:
        what = "whole numbers" if kinds == "iu" else "numbers"
        raise ModelError(f"'{name}' of the linkages has the type {found.dtype}: give {what}")
    return found


def _uniform(
    joints: np.ndarray, links: np.ndarray, present: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Mass, inertia and mass centre of links of uniform bars of unit mass a length: one from each
    joint of a link to its next, of more than two joints closed to a polygon.
    """
    places = links.shape[2]
    rows = np.arange(len(joints))[:, None, None]
    own = np.where(present[..., None], joints[rows, np.where(present, links, 0)], 0.0)
    many = present.sum(axis=2)
    following = np.roll(own, -1, axis=2)
    last = np.arange(places) == many[:, :, None] - 1
    following = np.where(last[..., None], own[:, :, :1], following)
    bar = present & ~(last & (many[:, :, None] <= 2))
    length = np.where(bar, np.hypot(*np.moveaxis(following - own, -1, 0)), 0.0)
    mass = length.sum(axis=2)
    middle = 0.5 * (own + following)
    safe = np.where(mass > 0.0, mass, 1.0)[..., None]
    cg = (length[..., None] * middle).sum(axis=2) / safe
    off = middle - cg[:, :, None]
    inertia = (length * length * length / 12.0 + length * (off * off).sum(axis=3)).sum(axis=2)
    return mass, inertia, cg


def _refuse(made: LinkageArrays, ground: np.ndarray) -> None:
    """Note what is wrong with single linkages."""
    count, nodes = made.joints.shape[:2]
    links = made.links
    used = (links >= 0) & (links < nodes)
    touched = np.zeros((count, nodes + 1), dtype=bool)
    at = np.where(used, links, nodes).reshape(count, -1)
    np.put_along_axis(touched, at, True, 1)
    there = used.any(axis=2)
    bodies = there.sum(axis=1)
    sorted_places = np.sort(np.where(used, links, -1), axis=2)
    twice = ((np.diff(sorted_places, axis=2) == 0) & (sorted_places[..., 1:] >= 0)).any(axis=(1, 2))
    slid = made.slides[..., 0]
    beyond = ((links >= nodes) | (links < -1)).any(axis=(1, 2))
    beyond |= ((ground >= nodes) | (ground < -1)).any(axis=1)
    beyond |= ((slid >= nodes) | (slid < -1)).any(axis=1)
    driver = np.clip(made.driver, 0, max(links.shape[1] - 1, 0))
    driven = (made.driver >= 0) & (made.driver < links.shape[1])
    if links.shape[1]:
        driven &= there[np.arange(count)[:, None], driver]
    # the first is there, and behind it those that are there come first
    driven |= (made.driver == -1) & (np.arange(made.driver.shape[1]) > 0)
    ends = (made.driver[:, :-1] == -1) & (made.driver[:, 1:] != -1)
    driven = driven.all(axis=1) & ~ends.any(axis=1) & (made.driver.shape[1] > 0)
    sorted_drivers = np.sort(made.driver, axis=1)
    again = (np.diff(sorted_drivers, axis=1) == 0) & (sorted_drivers[:, 1:] >= 0)
    guide = np.clip(made.slides[..., 1], 0, max(links.shape[1] - 1, 0))
    no_guide = np.zeros(count, dtype=bool)
    if made.slides.shape[1] and links.shape[1]:
        no_guide = (
            (slid >= 0)
            & (made.slides[..., 1] >= 0)
            & ~(there[np.arange(count)[:, None], guide] & (made.slides[..., 1] < links.shape[1]))
        ).any(axis=1)
    free = (slid >= 0) & ~touched[np.arange(count)[:, None], np.where(slid < 0, nodes, slid)]
    own = np.zeros(count, dtype=bool)
    if made.slides.shape[1] and links.shape[1]:
        on = links[np.arange(count)[:, None], guide]
        same = (on == slid[:, :, None]).any(axis=2) & (made.slides[..., 1] >= 0)
        own = (same & (slid >= 0)).any(axis=1)
    finite = np.where(touched[:, :nodes, None], np.isfinite(made.joints), True).all(axis=(1, 2))
    masses = np.isfinite(made.mass) & np.isfinite(made.inertia) & np.isfinite(made.cg).all(axis=2)
    light = (made.mass < 0.0).any(axis=1) | (made.inertia < 0.0).any(axis=1)
    finite &= masses.all(axis=1) & np.where(slid >= 0, np.isfinite(made.directions), True).all(1)
    wrong = (
        (beyond, "a link, the ground or a slide names a joint that there is not"),
        (bodies == 0, "it has no links"),
        (twice, "a link names a joint twice"),
        (~driven, "the driver names a link that there is not"),
        (again.any(axis=1), "two drivers turn one link"),
        (no_guide, "a slide is on a link that there is not"),
        (free.any(axis=1), "a joint that slides belongs to no link"),
        (own, "a joint slides on a link that it belongs to"),
        (~finite, "a joint, a mass or a direction is not a finite number"),
        (light, "a mass or an inertia is negative"),
    )
    for which, sentence in wrong:
        for n in np.flatnonzero(which).tolist():
            made.reasons.setdefault(n, sentence)
