"""Candidates for functions and poses: linkages in closed form, as positions to be followed."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from mbody.synthesis.burmester import displaced, dyads, places, sliding_points
from mbody.synthesis.following import Positions
from mbody.synthesis.four_bars import FourBar
from mbody.synthesis.function_points import four_bars, slider_cranks
from mbody.synthesis.linkage_kinds import Kind
from mbody.synthesis.slider_cranks import SliderCrank

__all__ = [
    "GuidedDesign",
    "FunctionDesign",
    "function_candidates",
    "motion_size",
    "pose_candidates",
]

#: Circle points of three and four poses that are combined with one another.
PAIRS = 120
#: How far circle points of three poses are sought, in sizes of the motion.
SPREAD = 1.5
#: How far poles count, in sizes of the path of the origin.
POLES = 10.0
#: Candidates of a continuum that are followed, those of the greatest transmission angles.
BEST = 200
#: Relative distance of pivots or pins that are one.
SAME = 1e-6


@dataclass(frozen=True, eq=False)
class FunctionDesign:
    """A function with its zeros: the output at the given pairs in the axes of the design."""

    positions: Positions
    output: np.ndarray
    zeros: tuple[float, float]


@dataclass(frozen=True, eq=False)
class GuidedDesign:
    """A guidance: poses of the plane, in the axes of the plane itself."""

    positions: Positions
    where: np.ndarray
    angle: np.ndarray


def function_candidates(
    kind: Kind, inputs: np.ndarray, outputs: np.ndarray, ground: float
) -> list[FunctionDesign]:
    """All mechanisms in closed form of 3, 4 or 5 pairs, of more the best; a four-bar on a ground
    of the given length.
    """
    found = []
    if kind.name == "four_bar":
        for one in four_bars(inputs, outputs):
            theta, psi = inputs + one.input_zero, outputs + one.output_zero
            lengths = ground * np.array([one.crank, one.coupler, one.third])
            x = np.array([0.0, 0.0, ground, 0.0, *lengths, 0.0, 0.0])
            pin = ground + lengths[2] * np.exp(1j * psi) - lengths[0] * np.exp(1j * theta)
            found.append(_wanted(kind, x, theta, psi, pin, (one.input_zero, one.output_zero)))
        return found
    for one in slider_cranks(inputs, outputs):
        theta, travel = inputs + one.input_zero, outputs + one.output_zero
        x = np.array([0.0, 0.0, 0.0, one.third, one.crank, one.coupler, 0.0, 0.0])
        pin = travel + 1j * one.third - one.crank * np.exp(1j * theta)
        found.append(_wanted(kind, x, theta, travel, pin, (one.input_zero, one.output_zero)))
    return found


def _wanted(
    kind: Kind,
    x: np.ndarray,
    theta: np.ndarray,
    output: np.ndarray,
    pin: np.ndarray,
    zeros: tuple[float, float],
) -> FunctionDesign:
    """With the senses of closure that the pin, seen from the crank's end, has at the pairs."""
    senses = [kind.sense(x, angle, one) for angle, one in zip(theta, pin, strict=True)]
    return FunctionDesign(Positions(kind, x, theta, np.array(senses), fixed=True), output, zeros)


def pose_candidates(
    kind: Kind,
    where: np.ndarray,
    angle: np.ndarray,
    within: tuple[np.ndarray, np.ndarray],
    size: float,
    rng: np.random.Generator,
) -> tuple[list[GuidedDesign], int]:
    """Mechanisms that take the plane through the poses, within bounds: all of five poses, of fewer
    the best of a sample; and how many were tried.
    """
    moves, (low, high) = displaced(where, angle), within
    around = complex(where[0]) + SPREAD * size * (
        rng.normal(size=PAIRS) + 1j * rng.normal(size=PAIRS)
    )
    pairs = dyads(moves, around)
    pairs = np.array([pair for pair in pairs if _fits(pair, kind, low, high)]).reshape(-1, 2)
    if len(pairs) > PAIRS:
        pairs = pairs[np.sort(rng.permutation(len(pairs))[:PAIRS])]
    found: list[tuple[float, GuidedDesign]] = []
    tried = 0
    if kind.name == "four_bar":
        for first, second in itertools.permutations(pairs, 2):
            tried += 1
            found += _four_bar(first, second, where, angle)
    else:
        for point in sliding_points(moves, PAIRS):
            for pair in pairs:
                tried += 1
                found += _slider_crank(pair, point, where, angle)
    inside = [
        one
        for one in found
        if (one[1].positions.x >= low).all() and (one[1].positions.x <= high).all()
    ]
    inside.sort(key=lambda pair: -pair[0])
    return [one for _, one in inside[:BEST]], tried


def motion_size(where: np.ndarray, angle: np.ndarray) -> float:
    """How large a motion is: how far the origin comes from its mean place, or the poles of the
    displacements from it, but at most some times as far.
    """
    extent = float(np.abs(where - where.mean()).max())
    r, t = displaced(where, angle)
    with np.errstate(all="ignore"):
        poles = np.abs(t / (1.0 - r) - where.mean())
    far = float(poles[np.isfinite(poles)].max(initial=0.0))
    return max(extent, min(far, POLES * extent), 1e-300)


def _fits(pair: np.ndarray, kind: Kind, low: np.ndarray, high: np.ndarray) -> bool:
    """Whether the centre point may be one of the pivots."""
    x, y = pair[1].real, pair[1].imag
    pivots = (0, 2) if kind.name == "four_bar" else (0,)
    return bool(np.isfinite(pair).all()) and any(
        low[k] <= x <= high[k] and low[k + 1] <= y <= high[k + 1] for k in pivots
    )


def _four_bar(
    crank: np.ndarray, rocker: np.ndarray, where: np.ndarray, angle: np.ndarray
) -> Iterator[tuple[float, GuidedDesign]]:
    """The four-bar of two pairs, with its least transmission angle at the poses."""
    moves = displaced(where, angle)
    kind = FourBar()
    a, b = places(crank[0], moves), places(rocker[0], moves)
    o2, o4 = crank[1], rocker[1]
    r2, r3, r4 = abs(a[0] - o2), abs(b[0] - a[0]), abs(b[0] - o4)
    if min(r2, r3, r4, abs(o4 - o2)) <= SAME * max(r2, r3, r4, abs(o4 - o2)):
        return
    point = (where[0] - a[0]) * r3 / (b[0] - a[0])
    x = np.array([o2.real, o2.imag, o4.real, o4.imag, r2, r3, r4, point.real, point.imag])
    across = np.abs(((b - a) * np.conj(b - o4)).imag) / (r3 * r4)
    yield _guided(kind, x, a, b, where, angle, float(across.min()))


def _slider_crank(
    pair: np.ndarray, sliding: complex, where: np.ndarray, angle: np.ndarray
) -> Iterator[tuple[float, GuidedDesign]]:
    """The slider-crank of a pair and a point on a line."""
    moves = displaced(where, angle)
    kind = SliderCrank()
    a, b = places(pair[0], moves), places(sliding, moves)
    o, farthest = pair[1], int(np.abs(b - b[0]).argmax())
    r2, r3, along = abs(a[0] - o), abs(b[0] - a[0]), b[farthest] - b[0]
    if min(r2, r3, abs(along)) <= SAME * max(r2, r3, abs(along)):
        return
    guide = along / abs(along)
    if ((b[0] - a[0]) * np.conj(guide)).real < 0.0:
        guide = -guide
    offset = float(((b[0] - o) * np.conj(guide)).imag)
    point = (where[0] - a[0]) * r3 / (b[0] - a[0])
    numbers = [o.real, o.imag, float(np.angle(guide)), offset, r2, r3, point.real, point.imag]
    across = np.abs(((b - a) * np.conj(guide)).real) / r3
    yield _guided(kind, np.array(numbers), a, b, where, angle, float(across.min()))


def _guided(
    kind: Kind,
    x: np.ndarray,
    a: np.ndarray,
    b: np.ndarray,
    where: np.ndarray,
    angle: np.ndarray,
    transmission: float,
) -> tuple[float, GuidedDesign]:
    theta = np.angle(a - complex(x[0], x[1]))
    coupler = b - a
    senses = [kind.sense(x, at, one) for at, one in zip(theta, coupler, strict=True)]
    plane = math.remainder(float(angle[0] - np.angle(coupler[0])), 2.0 * math.pi)
    positions = Positions(kind, x, theta, np.array(senses), plane=plane)
    return transmission, GuidedDesign(positions, where, angle)
