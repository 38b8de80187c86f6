"""Synthesis of four-bars and slider-cranks: candidates for each demand, and their judgement."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from mbody.core import tolerances as tol
from mbody.core.searches import Searches
from mbody.core.tolerances import TINY
from mbody.errors import ModelError, brief
from mbody.files.tables import writing
from mbody.model.element import listed
from mbody.quantities.units import UnitSystem
from mbody.synthesis import guidance, judging
from mbody.synthesis.linkage_kinds import KINDS, Kind

# -- An atlas of coupler curves, searched by the shape of a curve whatever its place, size,
#    orientation and direction of travel -------------------------------------------------------
#
# A closed curve is sampled at equal steps of its length, as a complex function of it; place, size,
# direction and first point change only the phases and the common factor of its Fourier coefficients
# (C. T. Zahn, R. Z. Roskies, IEEE Trans. Computers C-21 (1972) 269-281; for linkages J. M. McCarthy
# and G. S. Soh, *Geometric Design of Linkages*, 2011). So their magnitudes, divided by their norm,
# are the curve's place in the atlas; the opposite direction exchanges those of positive and
# negative order.

#: Orders of Fourier coefficients on either side, and points of a curve.
ORDERS, POINTS = 8, 128
#: Positions of the crank at which a curve is computed.
INSTANTS = 180
#: Coupler points of one shape, and how far from A they are, in lengths of the carrier.
EACH, LARGEST_DISTANCE = 8, 1.5
#: Name and number of the form of the file.
FORM = "mbody atlas 1"


@dataclass(frozen=True, eq=False)
class Atlas:
    """Coupler curves of four-bars or slider-cranks whose crank turns round.

    Attributes
    ----------
    kind : str
    shapes : array (curves, ratios)
        Of four-bars crank, coupler and rocker in lengths of the ground; of slider-cranks crank and
        offset in lengths of the rod.
    senses : array (curves,)
        The sign with which the loop is closed, 1 or -1.
    points : array (curves,)
        P in the axes of the carrier, in its lengths, complex.
    descriptors : array (curves, 16)
        See the head of this file.

    Examples
    --------
    >>> found = Atlas.made("slider_crank", 40, seed=1)
    >>> found.shapes.shape, found.descriptors.shape
    ((40, 2), (40, 16))
    """

    kind: str
    shapes: np.ndarray
    senses: np.ndarray
    points: np.ndarray
    descriptors: np.ndarray

    def __len__(self) -> int:
        return len(self.senses)

    @classmethod
    def made(cls, kind: str = "four_bar", count: int = 4000, seed: int = 0) -> Atlas:
        """An atlas of `count` curves of random shapes, eight points on each.

        >>> len(Atlas.made(count=40, seed=1))
        40
        """
        if kind not in KINDS:
            raise ModelError(f"atlas: there is no kind {brief(kind)} (there are: {listed(KINDS)})")
        own, rng = KINDS[kind], np.random.default_rng(seed)
        each = -(-count // EACH)
        shapes = np.repeat(own.shapes(each, rng), EACH, axis=0)[:count]
        signs = rng.choice(np.array(own.signs), count)
        radius, angle = (
            LARGEST_DISTANCE * np.sqrt(rng.uniform(size=count)),
            rng.uniform(0.0, 2.0 * np.pi, count),
        )
        points = 0.5 + radius * np.exp(1j * angle)
        curves = np.array([_curve(own, *one) for one in zip(shapes, signs, points, strict=True)])
        descriptors = np.array([curve_descriptor(curve) for curve in curves])
        return cls(kind, shapes, signs, points, descriptors)

    def nearest(self, curve: Sequence[Any] | np.ndarray, count: int = 10) -> np.ndarray:
        """Numbers of the curves nearest to a closed one of points (x, y), the nearest first.

        >>> atlas = Atlas.made(count=40, seed=1)
        >>> circle = [(np.cos(a), np.sin(a)) for a in np.linspace(0.0, 6.0, 40)]
        >>> atlas.nearest(circle, 3).shape
        (3,)
        """
        table = np.asarray(curve, dtype=float)
        wanted = curve_descriptor(table[:, 0] + 1j * table[:, 1])
        both = np.stack([wanted, wanted[::-1]])
        away = np.linalg.norm(self.descriptors[:, None, :] - both, axis=2).min(axis=1)
        return np.argsort(away, kind="stable")[:count]

    def nearest_shapes(
        self, kind: Kind, points: np.ndarray, closed: bool, count: int
    ) -> list[tuple[float, np.ndarray]]:
        """The shapes of the nearest curves for each sign of closure.

        Raises
        ------
        ModelError
            For an atlas of another kind, and an open path.
        """
        if kind.name != self.kind:
            raise ModelError(f"synthesize: the atlas is of {self.kind}, not of {kind.name}")
        if not closed:
            raise ModelError(
                "synthesize: an atlas has closed curves: close the path by its first point, or "
                "search without an atlas"
            )
        nearest = self.nearest(np.column_stack([points.real, points.imag]), count)
        found = []
        for sign in kind.signs:
            own = nearest[self.senses[nearest] == sign]
            found.append((sign, np.unique(self.shapes[own], axis=0)))
        return found

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the atlas to a file of NumPy arrays."""
        with writing(path, binary=True) as file:
            np.savez_compressed(
                file,
                form=np.array(FORM),
                kind=np.array(self.kind),
                shapes=self.shapes,
                senses=self.senses,
                points=self.points,
                descriptors=self.descriptors,
            )

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> Atlas:
        """Read an atlas that `save` wrote.

        Raises
        ------
        ModelError
            For a file that cannot be read, or that is none.
        """
        try:
            with np.load(path, allow_pickle=False) as file:
                if str(file["form"]) == FORM and str(file["kind"]) in KINDS:
                    names = ("shapes", "senses", "points", "descriptors")
                    return cls(str(file["kind"]), *(file[name] for name in names))
        except OSError as error:
            raise ModelError(f"cannot read '{path}' ({error.strerror or 'no atlas'})") from None
        except (ValueError, KeyError, EOFError):
            pass
        raise ModelError(f"'{path}' is no atlas: make one by mbody atlas --to FILE")


def as_atlas(given: Any) -> Atlas:
    """An atlas from itself or from its file."""
    return given if isinstance(given, Atlas) else Atlas.load(given)


def curve_descriptor(curve: np.ndarray) -> np.ndarray:
    """Magnitudes of the Fourier coefficients of orders -8 to -1 and 1 to 8 of a closed curve of
    complex points, sampled at equal steps of its length, divided by their norm.
    """
    whole = np.append(curve, curve[0])
    length = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(whole)))])
    at = np.arange(POINTS) * (length[-1] / POINTS)
    even = np.interp(at, length, whole.real) + 1j * np.interp(at, length, whole.imag)
    sizes = np.abs(np.fft.fft(even))
    found = np.concatenate([sizes[-ORDERS:], sizes[1 : ORDERS + 1]])
    return found / max(float(np.linalg.norm(found)), TINY)


def _curve(kind: Kind, shape: np.ndarray, sign: float, point: complex) -> np.ndarray:
    """The path of P over a revolution."""
    s = np.arange(INSTANTS) * (2.0 * np.pi / INSTANTS)
    carrier = kind.curves(shape[None, :], sign, s)[0]
    length = shape[1] if kind.name == "four_bar" else 1.0
    return np.asarray(shape[0] * np.exp(1j * s) + length * point * carrier)


# -- Global search for paths: linkage shapes, each in its best place and timing ----------------
# A coupler curve is linear in three complex numbers, C = c + α E + β G: E = e^{is} is the direction
# of the crank, G that of the link that carries the point, both by the shape alone; α holds the size
# and the direction of the frame, β the point. So only the ratios of lengths are searched; for every
# shape and every timing the three numbers are the solution of a linear least-squares problem
# (variable projection: G. Golub, V. Pereyra, SIAM J. Numer. Anal. 10 (1973) 413-432).

#: How much of a revolution an open path without timing may take, in degrees.
SPANS = (20, 40, 60, 90, 120, 150, 180, 240, 300)
#: Of phases of open paths every third is tried.
STRIDE = 3
#: Numbers of one block of shapes, timings and points.
BLOCK = 2_000_000


@dataclass(frozen=True, eq=False)
class PathDemand:
    """Points of a path.

    `points` (points,): Complex.
    `timing` (points,): Angles of the crank, of which the differences count.
    `closed`: Whether the path returns to its first point, which is given once.
    `low`, `high`: Bounds of the numbers of the kind.
    """

    points: np.ndarray
    timing: np.ndarray | None
    closed: bool
    low: np.ndarray
    high: np.ndarray


@dataclass(frozen=True, eq=False)
class PlacedCurve:
    """A design: a row of numbers, crank angles in space at the points, sign of closure;
    its error.
    """

    error: float
    x: np.ndarray
    theta: np.ndarray
    sign: float


def timings(
    points: np.ndarray, timing: np.ndarray | None, closed: bool, period: float = 2.0 * np.pi
) -> np.ndarray:
    """Timings that are tried, as instants of a revolution, (timings, points); they may exceed it,
    which may be another range of the driver.
    """
    count, whole = len(points), np.arange(INSTANTS)[:, None]
    if timing is not None:
        return whole + np.rint(timing / period * INSTANTS).astype(int)
    chords = np.abs(np.diff(points, append=points[:1]))
    if not closed:
        chords = chords[:-1]
    shares = [np.arange(count) / (count if closed else count - 1)]
    shares.append(np.concatenate([[0.0], np.cumsum(chords)])[:count] / chords.sum())
    spans = (360,) if closed else SPANS
    first = whole if closed else whole[::STRIDE]
    steps = [np.rint(span / 360 * INSTANTS * share) for span in spans for share in shares]
    rows = np.unique(np.array([sign * row for row in steps for sign in (1, -1)]), axis=0)
    return (first[:, None, :] + rows.astype(int)[None, :, :]).reshape(-1, count)


def best_shapes(
    kind: Kind, demand: PathDemand, shapes: Iterable[tuple[float, np.ndarray]], keep: int
) -> list[PlacedCurve]:
    """The best of some shapes, given for each sign of closure, by their errors and by how far their
    numbers are beyond the bounds.
    """
    order = timings(demand.points, demand.timing, demand.closed)
    s = np.arange(INSTANTS) * (2.0 * np.pi / INSTANTS)
    crank = np.exp(1j * s)[order % INSTANTS]
    block = max(1, BLOCK // order.size)
    found: list[tuple[float, PlacedCurve]] = []
    for sign, own in shapes:
        for low in range(0, len(own), block):
            part = own[low : low + block]
            carrier = kind.curves(part, sign, s)[:, order % INSTANTS]
            error, fit = _fitted(demand.points, crank, carrier)
            x, frame = kind.placed(part[:, None, :], s, fit)
            beyond = np.maximum(demand.low - x, 0.0) + np.maximum(x - demand.high, 0.0)
            score = error + np.square(beyond).sum(axis=-1)
            best = np.where(np.isfinite(score), score, np.inf).argmin(axis=1)
            for n, k in enumerate(best):
                theta = order[k] * (2.0 * np.pi / INSTANTS) + frame[n, k]
                one = PlacedCurve(float(error[n, k]), x[n, k], theta, sign)
                found.append((float(score[n, k]), one))
    found = [pair for pair in found if np.isfinite(pair[0])]
    found.sort(key=lambda pair: pair[0])
    return [one for _, one in found[:keep]]


def _fitted(
    points: np.ndarray, crank: np.ndarray, carrier: np.ndarray
) -> tuple[np.ndarray, tuple[np.ndarray, np.ndarray, np.ndarray]]:
    """Least squares of C = c + α E + β G for E (timings, points), G (shapes, timings, points): the
    sum of squared distances, and c, α, β, each (shapes, timings).
    """
    count = len(points)
    middle = points.mean()
    goal = points - middle
    e_mean, g_mean = crank.mean(axis=-1), carrier.mean(axis=-1)
    back = crank.conj()
    h11 = count - count * np.abs(e_mean) ** 2
    h22 = count - count * np.abs(g_mean) ** 2
    h12 = np.einsum("tn,dtn->dt", back, carrier) - count * e_mean.conj() * g_mean
    b1, b2 = back @ goal, carrier.conj() @ goal
    with np.errstate(all="ignore"):
        determinant = h11 * h22 - np.abs(h12) ** 2
        determinant[determinant < tol.SYNTHESIS_ANGLES_DISTINCT * count**2] = np.nan
        alpha = (h22 * b1 - h12 * b2) / determinant
        beta = (h11 * b2 - h12.conj() * b1) / determinant
        error = np.sum(np.abs(goal) ** 2) - (b1.conj() * alpha + b2.conj() * beta).real
    c = middle - alpha * e_mean - beta * g_mean
    return np.maximum(error, 0.0), (c, alpha, beta)


# -- Refinement of a path: least squares with exact derivatives, from a candidate of the search

EVALUATIONS = 200


def misses(kind: Kind, x: np.ndarray, theta: np.ndarray, sign: float, points: np.ndarray) -> Any:
    """P minus the points, complex (points,); NaN where the loop does not close."""
    carrier, _ = kind.poses(x, theta, sign)
    return _point(kind, x, np.exp(1j * theta), carrier) - points


def refined(kind: Kind, demand: PathDemand, start: PlacedCurve) -> PlacedCurve | None:
    """The nearest design whose sum of squared distances is least; None where the start does not
    close within the bounds.
    """
    found = _path_problem(kind, demand, start).least(EVALUATIONS)
    if found is None:
        return None
    x, theta = found[: len(kind.numbers)], _angles(kind, demand, found)
    off = misses(kind, x, theta, start.sign, demand.points)
    return PlacedCurve(float(np.square(np.abs(off)).sum()), x, theta, start.sign)


def _angles(kind: Kind, demand: PathDemand, y: np.ndarray) -> np.ndarray:
    """Crank angles at the points of a row of numbers and angles."""
    steps = np.zeros(1) if demand.timing is None else _steps(demand)
    return np.asarray(y[len(kind.numbers) :] + steps)


def _path_problem(kind: Kind, demand: PathDemand, start: PlacedCurve) -> judging.MissProblem:
    """The distances from the points by the numbers and the crank angles."""
    size = len(kind.numbers)
    # what is small in the gradient is so beside the path, whatever the unit
    extent = float(np.abs(demand.points - demand.points.mean()).max()) or 1.0
    free = demand.timing is None
    extra = start.theta if free else start.theta[:1]
    width = tol.BOUND_AT * np.minimum(demand.high - demand.low, 1.0)
    begin = np.concatenate([np.clip(start.x, demand.low + width, demand.high - width), extra])
    endless = np.full(len(extra), np.inf)

    def residual(y: np.ndarray) -> np.ndarray:
        theta = _angles(kind, demand, y)
        miss = misses(kind, y[:size], theta, start.sign, demand.points)
        return np.concatenate([miss.real, miss.imag]) / extent

    def jacobian(y: np.ndarray) -> np.ndarray:
        theta = _angles(kind, demand, y)
        return _jacobian(kind, y[:size], theta, start.sign, free) / extent

    def candidate(y: np.ndarray) -> LinkageCandidate | None:
        theta = _angles(kind, demand, y)
        off = np.abs(misses(kind, y[:size], theta, start.sign, demand.points))
        if not np.isfinite(off).all():
            return None
        made = PlacedCurve(float(np.square(off).sum()), y[:size], theta, start.sign)
        return _path_candidate(kind, demand, made, sought=False)

    return judging.MissProblem(
        residual,
        jacobian,
        begin,
        np.concatenate([demand.low, -endless]),
        np.concatenate([demand.high, endless]),
        size,
        candidate,
    )


def _path_candidate(
    kind: Kind, demand: PathDemand, one: PlacedCurve, *, sought: bool = True
) -> LinkageCandidate:
    """A design as a candidate; `sought`: whether designs near it that meet conditions may be."""
    signs = np.full(len(demand.points), one.sign)
    positions = judging.Positions(kind, one.x, one.theta, signs, fixed=demand.timing is not None)
    return LinkageCandidate(
        positions,
        np.abs(misses(kind, one.x, one.theta, one.sign, demand.points)),
        _by_points(kind, demand.points),
        with_cognate=True,
        problem=_path_problem(kind, demand, one) if sought else None,
    )


def _steps(demand: PathDemand) -> np.ndarray:
    """Crank angles after the first."""
    timing = np.asarray(demand.timing)
    return timing - timing[0]


def _point(kind: Kind, x: np.ndarray, crank: np.ndarray, carrier: np.ndarray) -> Any:
    point = complex(x[kind.point_number], x[kind.point_number + 1])
    return complex(x[0], x[1]) + x[kind.crank_number] * crank + point * carrier


def _jacobian(kind: Kind, x: np.ndarray, theta: np.ndarray, sign: float, free: bool) -> np.ndarray:
    """Derivatives of the misses by the numbers and by the first angle, or by all angles."""
    phi, by, by_angle = kind.direction(x, theta, sign)
    crank, carrier = np.exp(1j * theta), np.exp(1j * phi)
    point = complex(x[kind.point_number], x[kind.point_number + 1])
    whole = 1j * (point * carrier)[:, None] * by
    whole[:, 0] += 1.0
    whole[:, 1] += 1j
    whole[:, kind.crank_number] += crank
    whole[:, kind.point_number] += carrier
    whole[:, kind.point_number + 1] += 1j * carrier
    rotated = 1j * x[kind.crank_number] * crank + 1j * point * carrier * by_angle
    whole = np.column_stack([whole, np.diag(rotated) if free else rotated])
    return np.vstack([whole.real, whole.imag])


# -- Four-bars and slider-cranks as candidates: how they are followed and measured -------------


@dataclass(frozen=True, eq=False)
class LinkageCandidate:
    """A candidate of a kind in closed form.

    `misses` (points,): By the closed form.
    `measure`: The same of a result of the assembled mechanism.
    `zeros`: What is added to the given input and output of a function.
    `with_cognate`: Whether the other mechanism of the same path is wanted.
    `problem`: What its misses are the least of.
    """

    positions: judging.Positions
    misses: np.ndarray
    measure: Callable[[Any], np.ndarray]
    zeros: tuple[float, float] | None = None
    with_cognate: bool = False
    problem: judging.MissProblem | None = None

    @property
    def row(self) -> np.ndarray:
        """The numbers of the kind."""
        return self.positions.x

    @property
    def described(self) -> str:
        """Which links turn round, in words."""
        return self.positions.kind.described(self.positions.x)

    def revolves(self) -> bool:
        """Whether the crank turns round."""
        return self.positions.kind.revolves(self.positions.x)

    def follow(self, units: str, full_turn: bool) -> judging.DesignMotion:
        """Drive the crank through the points; a crank that turns round does in any case."""
        return judging.follow_design(self.positions, units)

    def motion(self, units: str, full_turn: bool) -> Any:
        """Of the assembled mechanism."""
        return self.follow(units, full_turn).motion

    def measured(self, run: Any) -> np.ndarray:
        """The misses of a result of the assembled mechanism."""
        return self.measure(run)

    def values(self, found: judging.DesignMotion) -> dict[str, float]:
        """The numbers by the names of the description."""
        kind = self.positions.kind
        values = {n: float(x) for n, x in zip(kind.numbers, self.positions.x, strict=True)}
        if self.zeros is not None:
            output = "output.zero.angle" if kind.name == "four_bar" else "output.zero.x"
            values = {k: v for k, v in values.items() if not k.startswith(f"{kind.carrier}.P")}
            return values | {"input.zero.angle": self.zeros[0], output: self.zeros[1]}
        if self.positions.plane is None:
            return values
        own = [f"{kind.carrier}.{point}.{axis}" for point in "AB" for axis in "xy"]
        others = {k: v for k, v in values.items() if not k.startswith(f"{kind.carrier}.")}
        return others | {name: float(found.system.values[name]) for name in own}

    def transmission(self, found: judging.DesignMotion) -> float:
        """Least transmission angle of the motion; NaN where it was not followed."""
        if found.motion is None:
            return math.nan
        return float(self.positions.kind.transmission(found.motion).min())

    def cognate(self) -> LinkageCandidate | None:
        """Roberts' cognate with the same rotation of the crank, where it is wanted and there is
        one.
        """
        at = self.positions
        other = at.kind.cognate(at.x, at.theta, at.signs[0]) if self.with_cognate else None
        if other is None:
            return None
        x, theta, sign = other
        same = replace(at, x=x, theta=theta, signs=np.full(len(theta), sign))
        if not np.isfinite(same.carriers).all():
            return None
        return replace(self, positions=same, with_cognate=False, problem=None)


@dataclass(frozen=True)
class Effort:
    """Numbers of designs that are tried and that are refined, and the seed of the random ones."""

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
    judge: judging.Judge,
    count: int,
    units: UnitSystem,
    atlas: Atlas | None = None,
) -> judging.DesignList:
    """Designs whose point P passes the points."""
    low, high = judging.bounds(kind, complex(points.mean()), judge.size, by, units)
    demand = PathDemand(points, timing, closed, low, high)
    if atlas is None:
        rng, each = np.random.default_rng(effort.seed), effort.search // len(kind.signs)
        shapes = [(sign, kind.shapes(max(each, 1), rng)) for sign in kind.signs]
    else:
        shapes = atlas.nearest_shapes(kind, points, closed, effort.search)
    tried = sum(len(own) for _, own in shapes)
    starts = best_shapes(kind, demand, shapes, effort.starts)
    searches = Searches(len(starts))
    found = list(searches.ends(starts, lambda start: refined(kind, demand, start)))
    found.sort(key=lambda one: one.error)
    exact = len(points) * (tol.SYNTHESIS_POINT_MET * judge.size) ** 2
    judge.take((_path_candidate(kind, demand, one) for one in found), count, exact)
    judge.require(f"{kind.name} passes the points without defects within the bounds")
    unknowns = len(low) + (len(points) if timing is None else 1)
    best = judge.best(count, exact)
    notes = (
        _continuum(2 * len(points), unknowns) if best[0].error <= exact else judge.off_point_notes()
    )
    notes += [searches.stopped] if searches.stopped else []
    return judging.DesignList(best, tried, effort.seed, notes)


def for_function(
    kind: Kind,
    inputs: np.ndarray,
    outputs: np.ndarray,
    ground: float,
    effort: Effort,
    judge: judging.Judge,
    count: int,
) -> judging.DesignList:
    """Designs whose output has the given values where the crank has the given angles."""
    found = guidance.function_candidates(kind, inputs, outputs, ground)
    candidates = [_function_candidate(one) for one in found]
    exact = len(inputs) * (tol.SYNTHESIS_POINT_MET * judge.size) ** 2
    judge.take(candidates, max(count, len(candidates)) if len(inputs) <= 5 else count, exact)
    judge.require(f"{kind.name} has these outputs without defects")
    return judging.DesignList(judge.best(count, exact), len(found), effort.seed)


def for_poses(
    kind: Kind,
    where: np.ndarray,
    angle: np.ndarray,
    by: Mapping[str, Any] | None,
    effort: Effort,
    judge: judging.Judge,
    count: int,
    units: UnitSystem,
) -> judging.DesignList:
    """Designs whose coupler takes the poses."""
    own = f"{kind.carrier}."
    if wrong := [name for name in by or {} if str(name).startswith(own)]:
        raise ModelError(
            f"synthesize: by has {listed(wrong)}: of a plane that is guided the pins are found, "
            "bound the pivots and the other lengths"
        )
    size = guidance.motion_size(where, angle)
    low, high = judging.bounds(kind, complex(where.mean()), size, by, units)
    for n, name in enumerate(kind.numbers):
        if name.startswith(own) or (len(where) == 5 and name not in (by or {})):
            low[n], high[n] = -math.inf, math.inf
    rng = np.random.default_rng(effort.seed)
    found, tried = guidance.pose_candidates(kind, where, angle, (low, high), size, rng)
    exact = len(where) * (tol.SYNTHESIS_POINT_MET * judge.size) ** 2
    candidates = [_pose_candidate(one) for one in found]
    judge.take(candidates, len(candidates) if len(where) == 5 else count, -1.0)
    judge.require(f"{kind.name} takes the poses without defects within the bounds")
    notes = _continuum(len(where), 5 if kind.name == "four_bar" else 4)
    return judging.DesignList(judge.best(count, exact), tried, effort.seed, notes)


def _by_points(kind: Kind, points: np.ndarray) -> Any:
    x, y = f"{kind.carrier}.P.x", f"{kind.carrier}.P.y"
    return lambda run: np.abs(run.measure(x) + 1j * run.measure(y) - points)


def _function_candidate(one: guidance.FunctionDesign) -> LinkageCandidate:
    positions, angular = one.positions, one.positions.kind.name == "four_bar"
    at = zip(positions.theta, positions.signs, strict=True)
    closed = [positions.kind.poses(positions.x, np.array([a]), s)[1][0] for a, s in at]
    output = np.angle(closed) if angular else np.array(closed)

    def off(values: np.ndarray) -> np.ndarray:
        difference = values - one.output
        return np.abs(np.mod(difference + np.pi, 2.0 * np.pi) - np.pi if angular else difference)

    def measured(run: Any) -> np.ndarray:
        # the guide of the slider is the x axis, its crank turns about the origin
        return off(run["rocker"].angle if angular else run.measure("slider.B.x"))

    return LinkageCandidate(positions, off(output), measured, zeros=one.zeros)


def _pose_candidate(one: guidance.GuidedDesign) -> LinkageCandidate:
    positions, name = one.positions, one.positions.kind.carrier
    crank = np.exp(1j * positions.theta) * positions.x[positions.kind.crank_number]
    pin = complex(positions.x[0], positions.x[1]) + crank
    axes = np.exp(1j * one.angle)
    own = ((pin - one.where) / axes)[0], positions.x[5] * np.exp(-1j * (positions.plane or 0.0))

    def off(where: np.ndarray, angle: np.ndarray) -> np.ndarray:
        rotation = np.exp(1j * angle)
        first = where + own[0] * rotation - one.where - own[0] * axes
        return np.maximum(np.abs(first), np.abs(first + own[1] * (rotation - axes)))

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
