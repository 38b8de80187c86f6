"""What data determine of the unknowns of a fit, and what they leave open."""

from __future__ import annotations

import math
from collections.abc import Container, Mapping, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from typing import Any, TypeAlias

import numpy as np

from mbody.core import tolerances as tol
from mbody.derivatives.fit_problem import FitProblem
from mbody.errors import ModelError, SolveError
from mbody.summaries.text_table import number

# -- Identifiable combinations of the unknowns -------------------------------------------------

Array = np.ndarray
Bounds: TypeAlias = tuple[Array, Array]

#: Points of a family each way, at most.
FAMILY_POINTS = 24
#: Newton's steps that lead back to the data.
CORRECTIONS = 6


@dataclass(frozen=True)
class OpenDirection:
    """A change of unknowns that changes no datum.

    `direction`: By unknown how much it changes, the first by 1.
    """

    direction: dict[str, float]
    sentence: str

    def __str__(self) -> str:
        return self.sentence


@dataclass(frozen=True)
class Combination:
    """A sum of unknowns, or of products of them, that the data determine, where they do not
    determine each of them.

    `terms`: Factors, by unknown or by product, such as ``"arm.mass*arm.cg.x^2"``.
    `value`, `deviation`: Where a bound is in the way, that to which the data lead.
    `within`: By unknown (low, high): between them the numbers that fit equally well were followed,
      and the combination kept its value; empty where they could not be followed, so that it is of
      first order alone.
    `tangent`: Whether it leaves its interval outside of `within`, as a tangent of a curve does.
    """

    terms: dict[str, float]
    value: float
    deviation: float
    within: dict[str, tuple[float, float]] = field(default_factory=dict)
    tangent: bool = False

    def __str__(self) -> str:
        return _sum(self.terms)

    def at(self, values: Mapping[str, float]) -> float:
        """The sum for other numbers.

        >>> Combination({"m*x^2": 2.0, "b": 1.0}, 0.0, 0.0).at({"m": 3.0, "x": 2.0, "b": 1.0})
        25.0
        """
        return float(_valued(self.terms, values))

    def line(self, values: Mapping[str, float]) -> str:
        """What a summary says of it: 0 for a value that is rounding beside the parts of the sum."""
        parts = [_valued({name: factor}, values) for name, factor in self.terms.items()]
        none = abs(self.value) <= tol.FIT_DIRECTION_NONE * max(map(abs, parts))
        said = f"{self} = {number(0.0 if none else self.value)} ± {number(self.deviation)}"
        for name in list(self.within)[:1]:
            said += f", for {name} from {' to '.join(map(number, self.within[name]))}"
        if self.within and not self.tangent:
            return f"determined: {said}"
        return (
            f"determined {'near these numbers alone' if self.within else 'to first order'}: {said}"
        )


@dataclass(frozen=True, eq=False)
class Identified:
    """Identifiability of the unknowns: rank, covariance factor and undetermined directions.

    `rank`: How many combinations are determined.
    `inverse` (unknowns, unknowns): (JᵀJ)⁻¹, of the determined combinations alone where some are
      not.
    `open` (unknowns,): Which take part in a direction that is not determined.
    `pivots`: Unknowns that leave nothing open if they are held, one of each direction.
    `null` (directions, unknowns): The directions.
    """

    rank: int
    inverse: Array
    open: Array
    pivots: tuple[int, ...]
    undetermined: tuple[OpenDirection, ...]
    null: Array


def identified(
    jacobian: Array, names: Sequence[str], units: Mapping[str, str], sizes: Array, tolerance: float
) -> Identified:
    """The null space of J in words (base parameters of identification). `jacobian` (data,
    unknowns), `sizes` (unknowns,).
    """
    effect = np.linalg.norm(jacobian, axis=0) * sizes
    none = effect <= tolerance * effect.max(initial=0.0)
    lengths = np.where(none, 1.0, np.linalg.norm(jacobian, axis=0))
    scaled = np.where(none, 0.0, jacobian / lengths)
    _, values, directions = np.linalg.svd(scaled, full_matrices=True)
    rank = int((values > tolerance * max(values.max(initial=0.0), tol.TINY)).sum())
    kept = directions[:rank] / values[:rank, None]
    inverse = (kept.T @ kept) / np.outer(lengths, lengths)
    null, pivots = _reduced(directions[rank:])
    open_ones = (np.abs(null) > 0.0).any(axis=0)
    # from columns of length 1 to the units of the unknowns
    null = null / lengths
    found = []
    for n, (row, pivot) in enumerate(zip(null, pivots, strict=True)):
        null[n] = row = row / row[pivot]
        parts = {names[pivot]: 1.0} | {
            names[k]: float(row[k]) for k in np.flatnonzero(row).tolist() if k != pivot
        }
        found.append(OpenDirection(parts, _said(parts, units)))
    return Identified(rank, inverse, open_ones, tuple(pivots), tuple(found), null)


def determined(
    null: Array, pivots: Sequence[int], names: Sequence[str], wanted: Array
) -> tuple[dict[str, float], ...]:
    """Of each wanted coordinate that is no pivot the sum that no direction changes."""
    terms = []
    for k in np.flatnonzero(wanted).tolist():
        if k not in pivots:
            others = {
                names[p]: -float(row[k] / row[p]) for p, row in zip(pivots, null, strict=True)
            }
            terms.append({names[k]: 1.0} | {n: f for n, f in others.items() if f})
    return tuple(terms)


def _reduced(rows: Array) -> tuple[Array, list[int]]:
    """Sparse basis of a null space: each row has a pivot that the others lack."""
    rows, pivots = np.array(rows), []
    for n in range(len(rows)):
        left = np.abs(rows[n:])
        lead, pivot = divmod(int(np.argmax(left)), left.shape[1])
        rows[[n, n + lead]] = rows[[n + lead, n]]
        rows[n] /= rows[n, pivot]
        pivots.append(pivot)
        others = np.arange(len(rows)) != n
        rows[others] -= np.outer(rows[others, pivot], rows[n])
    return np.where(np.abs(rows) > tol.FIT_DIRECTION_NONE, rows, 0.0), pivots


def _said(parts: Mapping[str, float], units: Mapping[str, str]) -> str:
    if len(parts) == 1:
        return f"'{next(iter(parts))}' changes no datum"
    changes = [f"'{name}' by {number(by)} {units[name]}".rstrip() for name, by in parts.items()]
    return f"changing {', '.join(changes[:-1])} and {changes[-1]} changes no datum"


def _sum(terms: Mapping[str, float]) -> str:
    """Such as "a − 2 b"."""
    text = ""
    for name, factor in terms.items():
        sign = ("− " if factor < 0.0 else "+ ") if text else ("−" if factor < 0.0 else "")
        size = "" if abs(factor) == 1.0 else f"{number(abs(factor))} "
        text += f"{' ' if text else ''}{sign}{size}{name}"
    return text


def powers_of(term: str, keys: Container[str] = ()) -> dict[str, float]:
    """Unknowns of a product with their powers; one of the keys is itself.

    >>> powers_of("arm.mass*arm.cg.x^2")
    {'arm.mass': 1.0, 'arm.cg.x': 2.0}
    """
    if term in keys:
        return {term: 1.0}
    found = {}
    for part in term.split("*"):
        name, _, power = part.partition("^")
        found[name] = float(power.strip("()") or 1.0)
    return found


def _product(powers: Mapping[str, float], values: Mapping[str, Any]) -> Any:
    return math.prod(values[name] ** power for name, power in powers.items() if power)


def _term(powers: Mapping[str, float]) -> str:
    return "*".join(
        name if power == 1.0 else f"{name}^{power:g}" if power > 0.0 else f"{name}^({power:g})"
        for name, power in powers.items()
        if power
    )


# -- The family of numbers that fit equally well -----------------------------------------------


@dataclass(frozen=True, eq=False)
class Family:
    """Numbers that fit as well as the best ones, along directions that change no datum.

    `curves`: Of each way (points, unknowns), the best numbers first.
    `lost`: Directions, by their number, that change no datum to first order alone.
    `sizes` (unknowns,)
    `holds`: Part of its size by which what is constant may change.
    """

    curves: list[Array]
    lost: frozenset[int]
    sizes: Array
    holds: float

    def varied(self) -> Array:
        """Which unknowns change along it."""
        most = np.zeros(len(self.sizes))
        for curve in self.curves:
            most = np.maximum(most, np.abs(curve - curve[0]).max(axis=0))
        return most > self.holds * self.sizes

    def words(self, direction: int) -> str:
        """What the sentence of a direction needs besides: nothing where it is straight."""
        if direction in self.lost:
            return " to first order alone: farther on it does"
        first, last = self.curves[2 * direction : 2 * direction + 2]
        ways = (np.concatenate([first[:0:-1], last]) - last[0]) / self.sizes
        values = np.linalg.svd(ways, compute_uv=False)
        bent = len(values) > 1 and values[1] > self.holds * values[0]
        return " near these numbers: those that fit equally well lie on a curve" if bent else ""

    def constant(self, terms: Mapping[str, float], values: Mapping[str, float]) -> bool:
        """Whether a sum is the same everywhere, beside what sizes of the unknowns make of it."""
        least = self.holds * float(np.abs(_slopes(terms, values)) @ self.sizes)
        changes = [self._changes(curve, terms, list(values)).max() for curve in self.curves]
        return max(map(len, self.curves)) > 1 and max(changes) <= least

    def ends(
        self, terms: Mapping[str, float], keys: Sequence[str], off: float
    ) -> dict[str, tuple[float, float]]:
        """Between which numbers a sum changes by no more than that."""
        parts = []
        for curve in self.curves:
            changes = self._changes(curve, terms, keys)
            last = int(np.argmax(changes > off)) if (changes > off).any() else len(curve)
            parts.append(curve[:last])
            if last < len(curve):
                # a tangent leaves its curve with the square of the way
                low, end, high = np.sqrt([changes[last - 1], off, changes[last]])
                between = (end - low) / (high - low) * (curve[last] - curve[last - 1])
                parts.append((curve[last - 1] + between)[None, :])
        points = np.concatenate(parts)
        used = {name for term in terms for name in powers_of(term, keys)}
        rows = {key: points[:, k] for k, key in enumerate(keys) if key in used}
        return {key: (float(row.min()), float(row.max())) for key, row in rows.items()}

    @staticmethod
    def _changes(curve: Array, terms: Mapping[str, float], keys: Sequence[str]) -> Array:
        with np.errstate(divide="ignore", invalid="ignore"):
            values = _valued(terms, dict(zip(keys, curve.T, strict=True)))
        return np.asarray(np.abs(values - values[0]))


def followed(
    problem: FitProblem, numbers: Array, sigma: Array, known: Identified, within: Bounds
) -> Family:
    """The family of the best numbers, both ways along each of its directions and some between."""
    sizes = problem.number_sizes(numbers)
    rows = known.null / sizes
    ways = list(rows / np.abs(rows).max(axis=1, keepdims=True))
    if len(rows) > 1:
        # what is constant along each alone need not be so along all at once
        ways += list(np.random.default_rng(0).choice([-1.0, 1.0], (2, len(rows))) @ np.array(ways))
    curves, lost = [], set()
    for n, way in enumerate(ways):
        for sign in (1.0, -1.0):
            curve, changed = _curve(problem, numbers, sigma, within, sizes, sign * way)
            curves.append(curve)
            if n < len(rows) and changed and len(curve) == 1:
                lost.add(n)
    return Family(curves, frozenset(lost), sizes, tol.FIT_FAMILY_HOLDS[problem.exact])


def _curve(
    problem: FitProblem, numbers: Array, sigma: Array, within: Bounds, sizes: Array, way: Array
) -> tuple[Array, bool]:
    """Newton's method from steps each twice the one before, until most unknowns that take part have
    changed by their sizes, to a bound, or to where designs do not close: (points, unknowns), and
    whether it ends because data change. `way` is by the sizes.
    """
    exact = problem.exact
    first = problem.residual(numbers, sigma)
    allowed = tol.FIT_FAMILY_DATA[exact] * problem.data_size(sigma)
    points, step = [numbers], tol.FIT_FAMILY_STEP[exact]
    takes_part = way != 0.0
    while len(points) <= FAMILY_POINTS:
        here = points[-1]
        if (np.abs(here - numbers) >= sizes)[takes_part].mean() > 0.5:
            break
        try:
            null = _null(problem.jacobian(here, sigma) * sizes, exact)
            way = null.T @ (null @ way)
            if not np.abs(way).max(initial=0.0):
                break
            way = way / np.abs(way).max()
            reach = _reach(here, sizes * way, within)
            ahead = here + min(step, reach) * sizes * way
            ahead, change = _corrected(problem, np.clip(ahead, *within), sigma, first, sizes)
        except (ModelError, SolveError):
            break
        changed = change > allowed
        if changed or (ahead < within[0]).any() or (ahead > within[1]).any():
            if (step := step / 4.0) < tol.FIT_FAMILY_STEP[exact]:
                return np.array(points), changed
            continue
        points.append(ahead)
        if reach <= step:
            break
        step *= 2.0
    return np.array(points), False


def _null(scaled: Array, exact: bool) -> Array:
    """Orthonormal directions that change no datum, (directions, unknowns)."""
    _, values, directions = np.linalg.svd(scaled, full_matrices=True)
    return directions[
        int(
            (values > tol.FIT_SINGULAR_VALUE[exact] * max(values.max(initial=0.0), tol.TINY)).sum()
        ) :
    ]


def _reach(here: Array, way: Array, within: Bounds) -> float:
    """How far it is to the first bound."""
    with np.errstate(divide="ignore", invalid="ignore"):
        far = np.where(way > 0.0, (within[1] - here) / way, (within[0] - here) / way)
    return float(np.where(way == 0.0, np.inf, far).min())


def _corrected(
    problem: FitProblem, numbers: Array, sigma: Array, wanted: Array, sizes: Array
) -> tuple[Array, float]:
    """The nearest numbers with these residuals, and how far the residuals are off."""
    change = problem.residual(numbers, sigma) - wanted
    for _ in range(CORRECTIONS):
        scaled = problem.jacobian(numbers, sigma) * sizes
        move = np.linalg.lstsq(scaled, -change, rcond=tol.FIT_SINGULAR_VALUE[problem.exact])[0]
        numbers = numbers + sizes * move
        change = problem.residual(numbers, sigma) - wanted
        if np.abs(move).max() <= tol.FIT_FAMILY_DATA[problem.exact]:
            break
    return numbers, float(np.linalg.norm(change))


def combinations(
    problem: FitProblem,
    known: Identified,
    family: Family,
    keys: Sequence[str],
    numbers: Array,
    covariance: Array,
    quantile: float,
    move: Array,
) -> tuple[Combination, ...]:
    """What is determined of the unknowns that change along the family: sums, moments of bodies or
    products that are the same all along it; where there are too few of them, tangents.
    """
    values = dict(zip(keys, numbers.tolist(), strict=True))
    open_ones = known.open | family.varied()
    straight = determined(known.null, known.pivots, keys, open_ones)
    # those first whose factors are no fitted numbers
    others = [*_moments(problem, known, family, values), *_products(known, values)]
    there = [terms for terms in (*others, *straight) if family.constant(terms, values)]
    rows = [row / row.max() for row in np.diag(family.sizes)[~open_ones]]
    found: list[Combination] = []
    for n, terms in enumerate([*there, *straight]):
        slopes = _slopes(terms, values)
        row = slopes * family.sizes
        rows.append(row / np.linalg.norm(row))
        if len(rows) > known.rank:
            break
        if np.linalg.svd(np.array(rows), compute_uv=False)[-1] <= tol.FIT_DIRECTION_NONE:
            rows.pop()
            continue
        variance = float(slopes @ covariance @ slopes)
        deviation = math.sqrt(max(variance, 0.0)) if math.isfinite(variance) else math.inf
        tangent = n >= len(there)
        off = quantile * deviation if tangent else math.inf
        within = {} if family.lost else family.ends(terms, keys, off)
        value = float(_valued(terms, values) + slopes @ move)
        found.append(Combination(terms, value, deviation, within, tangent))
    return tuple(found)


def _moments(
    problem: FitProblem, known: Identified, family: Family, values: Mapping[str, float]
) -> list[dict[str, float]]:
    """Sums of m, m x, m y and I + m (x² + y²) of bodies, of which forces are linear, and of the
    other unknowns, that no direction changes.
    """
    keys, given = list(values), problem.system.values
    own = dict(zip(problem.names, keys, strict=False))
    made: list[dict[str, float]] = [{key: 1.0} for key in keys]
    for k, name in enumerate(problem.names):
        body, _, part = name.partition(".")
        mass = own.get(f"{body}.mass")
        if part in ("cg.x", "cg.y") and mass is not None:
            made[k] = {f"{mass}*{keys[k]}": 1.0}
        for axis in ("cg.x", "cg.y") if part == "inertia" else ():
            factors = [*([] if mass is None else [mass])]
            factor = float(given.get(f"{body}.mass", 0.0)) if mass is None else 1.0
            if (place := own.get(f"{body}.{axis}")) is None:
                factor *= float(given.get(f"{body}.{axis}", 0.0)) ** 2
            else:
                factors.append(f"{place}^2")
            if factors and factor:
                term = "*".join(factors)
                made[k][term] = made[k].get(term, 0.0) + factor
    matrix = np.array([_slopes(terms, values) for terms in made])
    scale = np.abs(matrix) @ family.sizes
    scale = np.where(scale > 0.0, scale, 1.0)
    null, pivots = _reduced(known.null @ matrix.T / scale)
    wanted = np.ones(len(keys), dtype=bool)
    found = []
    for one in determined(null * scale, pivots, [str(k) for k in range(len(keys))], wanted):
        whole: dict[str, float] = {}
        for row, share in one.items():
            for product, own_part in made[int(row)].items():
                whole[product] = whole.get(product, 0.0) + share * own_part
        found.append({term: part for term, part in whole.items() if part})
    return found


def _products(known: Identified, values: Mapping[str, float]) -> list[dict[str, float]]:
    """Products of powers that no direction changes, of small whole numbers where they are."""
    numbers, found = np.array(list(values.values())), []
    if (numbers[known.open] == 0.0).any() or any("*" in k or "^" in k for k in values):
        return []
    null, pivots = _reduced(known.null / np.where(known.open, numbers, 1.0))
    for one in determined(null, pivots, list(values), known.open):
        near = {name: Fraction(power).limit_denominator(12) for name, power in one.items()}
        common = math.lcm(*(part.denominator for part in near.values()))
        powers = {name: float(common * part) for name, part in near.items()}
        found.append({_term(powers): 1.0})
    return found


def _valued(terms: Mapping[str, float], values: Mapping[str, Any]) -> Any:
    """A sum of products for numbers, or rows of them."""
    return sum(factor * _product(powers_of(term, values), values) for term, factor in terms.items())


def _slopes(terms: Mapping[str, float], values: Mapping[str, float]) -> Array:
    """Derivatives of such a sum by the unknowns."""
    row = dict.fromkeys(values, 0.0)
    for term, factor in terms.items():
        powers = powers_of(term, values)
        for name, power in powers.items():
            lower = {**powers, name: power - 1.0}
            row[name] += factor * power * _product(lower, values)
    return np.array(list(row.values()))
