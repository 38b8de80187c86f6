"""Synthesis of four-bars and slider-cranks: candidates for each demand, and their judgement."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from mbody.errors import ModelError
from mbody.model.element import listed
from mbody.quantities.units import UnitSystem
from mbody.synthesis.atlas import Atlas
from mbody.synthesis.curve_search import PathDemand, best_shapes
from mbody.synthesis.demands import bounds
from mbody.synthesis.design import DesignList
from mbody.synthesis.following import Positions
from mbody.synthesis.guidance import (
    FunctionDesign,
    GuidedDesign,
    function_candidates,
    motion_size,
    pose_candidates,
)
from mbody.synthesis.judging import EXACT, Judge
from mbody.synthesis.linkage_candidates import LinkageCandidate
from mbody.synthesis.linkage_kinds import Kind
from mbody.synthesis.path_refinement import misses, refined

__all__ = ["Effort", "for_function", "for_path", "for_poses"]


@dataclass(frozen=True)
class Effort:
    """How many designs are tried, how many of them refined, and the seed of the random ones."""

    search: int
    starts: int
    seed: int


def for_path(
    kind: Kind,
    points: np.ndarray,
    closed: bool,
    timing: np.ndarray | None,
    by: Mapping[str, Any] | None,
    effort: Effort,
    judge: Judge,
    count: int,
    units: UnitSystem,
    atlas: Atlas | None = None,
) -> DesignList:
    """Designs whose point P passes the points."""
    low, high = bounds(kind, complex(points.mean()), judge.size, by, units)
    demand = PathDemand(points, timing, closed, low, high)
    if atlas is None:
        rng, each = np.random.default_rng(effort.seed), effort.search // len(kind.senses)
        shapes = [(sense, kind.shapes(max(each, 1), rng)) for sense in kind.senses]
    else:
        shapes = atlas.nearest_shapes(kind, points, closed, effort.search)
    tried = sum(len(own) for _, own in shapes)
    starts = best_shapes(kind, demand, shapes, effort.starts)
    found = [one for one in (refined(kind, demand, start) for start in starts) if one]
    found.sort(key=lambda one: one.error)
    exact = len(points) * (EXACT * judge.size) ** 2
    candidates = []
    for one in found:
        senses = np.full(len(points), one.sense)
        positions = Positions(kind, one.x, one.theta, senses, fixed=timing is not None)
        off = np.abs(misses(kind, one.x, one.theta, one.sense, points))
        candidates.append(
            LinkageCandidate(positions, off, _by_points(kind, points), with_cognate=True)
        )
    judge.take(candidates, count, exact)
    judge.require(f"{kind.name} passes the points without defects within the bounds")
    unknowns = len(low) + (len(points) if timing is None else 1)
    best = judge.best(count, exact)
    notes = _continuum(2 * len(points), unknowns) if best[0].error <= exact else judge.far()
    return DesignList(best, tried, effort.seed, notes)


def for_function(
    kind: Kind,
    inputs: np.ndarray,
    outputs: np.ndarray,
    ground: float,
    effort: Effort,
    judge: Judge,
    count: int,
) -> DesignList:
    """Designs whose output has the given values where the crank has the given angles."""
    found = function_candidates(kind, inputs, outputs, ground)
    candidates = [_function_candidate(one) for one in found]
    exact = len(inputs) * (EXACT * judge.size) ** 2
    judge.take(candidates, max(count, len(candidates)) if len(inputs) <= 5 else count, exact)
    judge.require(f"{kind.name} has these outputs without defects")
    return DesignList(judge.best(count, exact), len(found), effort.seed)


def for_poses(
    kind: Kind,
    where: np.ndarray,
    angle: np.ndarray,
    by: Mapping[str, Any] | None,
    effort: Effort,
    judge: Judge,
    count: int,
    units: UnitSystem,
) -> DesignList:
    """Designs whose coupler takes the poses."""
    own = f"{kind.carrier}."
    if wrong := [name for name in by or {} if str(name).startswith(own)]:
        raise ModelError(
            f"synthesize: by has {listed(wrong)}: of a plane that is guided the pins are found, "
            "bound the pivots and the other lengths"
        )
    size = motion_size(where, angle)
    low, high = bounds(kind, complex(where.mean()), size, by, units)
    for n, name in enumerate(kind.numbers):
        if name.startswith(own) or (len(where) == 5 and name not in (by or {})):
            low[n], high[n] = -math.inf, math.inf
    rng = np.random.default_rng(effort.seed)
    found, tried = pose_candidates(kind, where, angle, (low, high), size, rng)
    exact = len(where) * (EXACT * judge.size) ** 2
    candidates = [_pose_candidate(one) for one in found]
    judge.take(candidates, len(candidates) if len(where) == 5 else count, -1.0)
    judge.require(f"{kind.name} takes the poses without defects within the bounds")
    notes = _continuum(len(where), 5 if kind.name == "four_bar" else 4)
    return DesignList(judge.best(count, exact), tried, effort.seed, notes)


def _by_points(kind: Kind, points: np.ndarray) -> Any:
    x, y = f"{kind.carrier}.P.x", f"{kind.carrier}.P.y"
    return lambda run: np.abs(run.measure(x) + 1j * run.measure(y) - points)


def _function_candidate(one: FunctionDesign) -> LinkageCandidate:
    positions, angular = one.positions, one.positions.kind.name == "four_bar"
    at = zip(positions.theta, positions.senses, strict=True)
    closed = [positions.kind.poses(positions.x, np.array([a]), s)[1][0] for a, s in at]
    output = np.angle(closed) if angular else np.array(closed)

    def off(values: np.ndarray) -> np.ndarray:
        turn = values - one.output
        return np.abs(np.mod(turn + np.pi, 2.0 * np.pi) - np.pi if angular else turn)

    def measured(run: Any) -> np.ndarray:
        # the guide of the slider is the x axis, its crank turns about the origin
        return off(run["rocker"].angle if angular else run.measure("slider.B.x"))

    return LinkageCandidate(positions, off(output), measured, zeros=one.zeros)


def _pose_candidate(one: GuidedDesign) -> LinkageCandidate:
    positions, name = one.positions, one.positions.kind.carrier
    crank = np.exp(1j * positions.theta) * positions.x[positions.kind.crank_number]
    pin = complex(positions.x[0], positions.x[1]) + crank
    axes = np.exp(1j * one.angle)
    own = ((pin - one.where) / axes)[0], positions.x[5] * np.exp(-1j * (positions.plane or 0.0))

    def off(where: np.ndarray, angle: np.ndarray) -> np.ndarray:
        turned = np.exp(1j * angle)
        first = where + own[0] * turned - one.where - own[0] * axes
        return np.maximum(np.abs(first), np.abs(first + own[1] * (turned - axes)))

    def measured(run: Any) -> np.ndarray:
        place = run.measure(f"{name}.P.x") + 1j * run.measure(f"{name}.P.y")
        return off(place, run[name].angle)

    found = positions.carriers
    return LinkageCandidate(positions, off(pin - own[0] * found, np.angle(found)), measured)


def _continuum(equations: int, unknowns: int) -> list[str]:
    if equations >= unknowns:
        return []
    return [
        "fewer points than unknowns: a continuum of designs meets them exactly, of which these are "
        "some, by their transmission angles"
    ]
