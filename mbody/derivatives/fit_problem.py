"""Data less fit of measured histories, with derivatives by the unknowns."""

from __future__ import annotations

import functools
import math
import os
import re
from collections.abc import Container, Mapping, Sequence
from dataclasses import dataclass, field, replace
from fractions import Fraction
from typing import Any, TypeAlias

import numpy as np

from mbody.analysis.driven.driven import requested_instants
from mbody.analysis.dynamics.simulate import simulate
from mbody.core import tolerances as tol
from mbody.core.tolerances import DIFFERENCE_STEP_NUMBERS, RTOL_FINE, TINY
from mbody.derivatives.driven_instants import DrivenInstants, misfitting
from mbody.derivatives.dual_solution import (
    DualRecord,
    DualWorkspace,
    checked_names,
    dual_solution,
    dual_values,
    natural_sizes,
    recorded_numbers,
    size_of_zero,
)
from mbody.derivatives.gradient import gradient
from mbody.derivatives.reduced_measures import (
    MeasureProgram,
    derived,
    instants_of,
    recorded_measure,
)
from mbody.errors import ModelError, SolveError, brief
from mbody.files.tables import measured_data
from mbody.model.element import listed, takes_one_design
from mbody.model.numbers import number_in
from mbody.model.simulation import Measure
from mbody.solution.measures import check_measure, measured
from mbody.solution.solution import Solution
from mbody.summaries.text_table import number
from mbody.sweeps.job import Measures, columns_of
from mbody.system.system import System

# -- What data determine of the unknowns of a fit, and what they leave open --------------------

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


# -- Measures and their derivatives for many sets of numbers, without assembling anew ----------


class PreparedGradient:
    """Measures of one system by some of its numbers, prepared for many sets of these.

    `system`: Of one design.
    `measure`, `by`, `analysis`: As of `mbody.gradient`.
    `**options`: The instants, as of `mbody.gradient`.

    `names`: Dotted names of the numbers, in the order of the arrays.
    `measures`: Names of the measures.
    `start` (names,): The numbers that the system has.
    `spaces`: Workspaces that are free.

    Examples
    --------
    >>> import mbody
    >>> system = mbody.assemble(mbody.gallery.load("norton_fourbar"))
    >>> prepared = PreparedGradient(system, "peak(A.force)", ["crank.A.x"], turn="motor")
    >>> design = prepared.at([5.25])
    >>> float(design.value[0].round(3)), float(design.jacobian[0, 0].round(3))
    (231.228, 325.526)
    """

    def __init__(
        self,
        system: System,
        measure: Measures | None,
        by: Sequence[str] | str | None,
        analysis: str = "kinetostatics",
        **options: Any,
    ) -> None:
        takes_one_design("gradient", system.batch)
        self.system = system
        self.given = checked_names(system, by)
        self.names = tuple(self.given.values())
        self.columns = columns_of(system.mechanism, measure, "gradient")
        self.measures = tuple(column.name for column in self.columns)
        self.start = np.array([float(system.values[name]) for name in self.names])
        self.wanted = requested_instants(system, analysis, options, "gradient")
        machine, parameters = system.mechanism, system.mechanism.parameters
        self._recorded = recorded_numbers(system)
        self._signs = {name: system.rule(name)[0] for name in self.names}
        self._programs: list[MeasureProgram | None] | None = None
        self._misfits: set[str] | None = None
        self.spaces: list[DualWorkspace] = []
        # what formulas make of the numbers, and what joints and contacts refuse, is Python
        self._plain = (
            self._recorded is None
            or not self._recorded.has(self.names)
            or any(name in parameters for name in self.names)
            or bool(machine.contacts or machine.groups)
        )

    def at(self, numbers: Any) -> DesignPoint:
        """The design of other numbers, (names,): its measures, and their derivatives when read.

        Raises ModelError for numbers that are refused.
        Raises SolveError as of the analysis, where the design does not close.
        """
        numbers = np.array(numbers, dtype=np.float64)
        if numbers.shape != self.start.shape:
            raise ModelError(
                f"gradient: {len(self.start)} numbers are needed, not an array of the shape "
                f"{numbers.shape}"
            )
        system, tangents = self._system_of(numbers)
        return DesignPoint(self, numbers, self.wanted.analysed(system), tangents)

    def programs(self, run: Solution, record: DualRecord) -> list[MeasureProgram | None]:
        """Of every measure its operations, recorded once."""
        if self._programs is None:
            self._programs = [
                recorded_measure(run, record, column.measure, self.names) for column in self.columns
            ]
        return self._programs

    def misfits(self, run: Solution, record: DualRecord) -> set[str]:
        """Numbers that alone would move wheels apart; which they are does not change."""
        if self._misfits is None:
            spaced = any(joint.spaced for joint in self.system.mechanism.joints)
            own = dual_values(run.system, self.names) if spaced else {}
            found = misfitting(dual_solution(run, own, record), self.names) if spaced else set()
            self._misfits = found
        return self._misfits

    def _system_of(self, numbers: np.ndarray) -> tuple[System, Any]:
        """The system with these numbers, and derivatives of the kernels' numbers where they came
        with them.
        """
        given = dict(zip(self.names, numbers.tolist(), strict=True))
        recorded = self._recorded
        allowed = all(map(self._allowed, given, given.values()))
        if recorded is None or self._plain or not allowed:
            return self.system.with_values(given), None
        values = {**self.system.values, **given}
        found, derivatives = recorded.evaluated(values, self.names)
        rows = len(self.system.par)
        system = replace(
            self.system,
            values=values,
            formulas={n: f for n, f in self.system.formulas.items() if n not in given},
            par=found[:rows, None],
            mass=found[rows:, None],
        )
        return system, (derivatives[:rows], derivatives[rows:])

    def _allowed(self, name: str, number: float) -> bool:
        """Whether a number is what its field requires; the sentence is that of `with_values`."""
        sign = self._signs[name]
        least = 0.0 if sign else -math.inf
        return math.isfinite(number) and number >= least and not (sign == "positive" and not number)


class DesignPoint:
    """One design of a `PreparedGradient`.

    `numbers` (names,)
    `run`: The result of the analysis.
    `value` (measures,), or (measures, instants) of histories
    """

    def __init__(
        self, prepared: PreparedGradient, numbers: np.ndarray, run: Solution, tangents: Any
    ) -> None:
        self.prepared, self.numbers, self.run, self._tangents = prepared, numbers, run, tangents
        self._choices = [instants_of(run, column) for column in prepared.columns]
        self.value = np.array([choice.value for choice in self._choices])

    @functools.cached_property
    def jacobian(self) -> np.ndarray:
        """Derivatives of the measures by the numbers: (measures, names), or (measures, instants,
        names); NaN by numbers with which alone redundant loops do not close.

        Raises ModelError for a measure that has no derivatives.
        """
        prepared, choices = self.prepared, self._choices
        instants = DrivenInstants(
            self.run, prepared.names, prepared.wanted.revolving, self._tangents, prepared.spaces
        )
        deciding = [one.needed[:1] if one.single else one.needed for one in choices]
        # those of one measure are in order
        needed = deciding[0] if len(deciding) == 1 else np.unique(np.concatenate(deciding))
        record = instants.rows_at(needed, any(one.loads for one in choices))
        programs = prepared.programs(self.run, record)
        rows, whole = [], None
        for column, choice, program in zip(prepared.columns, choices, programs, strict=True):
            if choice.single and program is not None:
                first = choice.needed[0]
                place = 0 if needed[0] == first else int(np.searchsorted(needed, first))
                values = self.run.system.values
                found, row = program.evaluated(record, place, values, prepared.names)
                rows.append(-row if column.by == "peak" and found < 0.0 else row)
                continue
            if whole is None:
                own = dual_values(self.run.system, prepared.names)
                whole = dual_solution(self.run, own, record)
            only = replace(choice, needed=choice.needed[:1]) if choice.single else choice
            rows.append(derived(whole, needed, column, only).row)
        jacobian = np.array(rows)
        gone = instants.unclosed | prepared.misfits(self.run, record)
        without = [n for n, name in enumerate(prepared.names) if name in gone] if gone else []
        if without:
            jacobian[..., without] = np.nan
        return jacobian


# -- Measured histories for a fit: columns of instants, of measured quantities, units ----------

#: Endings of the columns that say how a driver moves.
MOTION = ("", ".rate", ".acceleration")
DIMENSIONS = {
    True: ("angle", "angular velocity", "angular acceleration"),
    False: ("length", "velocity", "acceleration"),
}


@dataclass(frozen=True, eq=False)
class DataSeries:
    """The data of one run.

    `instants`: Arguments of the analysis: ``t``, or ``drive``.
    `measures`: By column.
    `values` (columns, instants): NaN where nothing was measured.
    `known`: Numbers that were others in this run.
    """

    instants: dict[str, Any]
    measures: dict[str, Measure]
    values: np.ndarray
    known: dict[str, float]


def series_of(system: System, given: Any, free: bool) -> list[DataSeries]:
    """The runs of the data; `free` where it is a motion over time, of `simulate`."""
    several = given if isinstance(given, Sequence) and not isinstance(given, str) else [given]
    if not several:
        raise ModelError("fit: there are no data: give columns by name, or a CSV file")
    found = [_data_series(system, one, free) for one in several]
    first = list(found[0].measures)
    for n, one in enumerate(found[1:], 2):
        if list(one.measures) != first:
            raise ModelError(
                f"fit: run {n} has the columns {listed(one.measures)}, run 1 {listed(first)}: give "
                "each the same, in the same order; NaN is no datum"
            )
    return found


def _data_series(system: System, given: Any, free: bool) -> DataSeries:
    if isinstance(given, str | os.PathLike):
        given = measured_data(given)
    if not isinstance(given, Mapping):
        raise ModelError(
            'fit: data are columns by name, such as {"t": […], "slider.x [mm]": […]}, or a CSV '
            f"file, not {brief(given)}"
        )
    known = {name: value for name, value in given.items() if np.ndim(value) == 0}
    columns = {name: _column(name, value) for name, value in given.items() if name not in known}
    sizes = {name: len(column) for name, column in columns.items()}
    if len(set(sizes.values())) > 1:
        text = ", ".join(f"{size} of '{name}'" for name, size in sizes.items())
        raise ModelError(f"fit: there are {text}: give as many values of each column")
    plain = {split_heading(name)[0]: name for name in columns}
    instants, used = _instants(system, columns, plain, free)
    measures, rows = {}, []
    for name, column in columns.items():
        quantity, unit = split_heading(name)
        if name in used:
            continue
        own = system.mechanism.measures.get(quantity)
        measures[quantity] = Measure(
            quantity if own is None else own.of, unit or (own.unit if own else "")
        )
        check_measure(system.mechanism, measures[quantity])
        rows.append(column)
    if not rows:
        raise ModelError("fit: the data have no measured column beside the instants")
    for name in known:
        system.with_values({name: known[name]})
    return DataSeries(instants, measures, np.array(rows), known)


def _column(name: Any, value: Any) -> np.ndarray:
    try:
        column = np.asarray(value, dtype=np.float64)
    except (TypeError, ValueError):
        column = np.zeros((0, 0))
    if column.ndim != 1 or not len(column):
        raise ModelError(f"fit: column {brief(name)} must be a row of numbers, not {brief(value)}")
    if np.isinf(column).any():
        raise ModelError(f"fit: column '{name}' has an infinite value: NaN is no datum", str(name))
    return column


def split_heading(name: str) -> tuple[str, str]:
    """Name and unit of a heading such as "slider.x [mm]"."""
    match = re.fullmatch(r"\s*(.*?)\s*(?:\[([^\]]*)\])?\s*", str(name))
    assert match is not None
    return match[1], match[2] or ""


def _instants(
    system: System, columns: Mapping[str, np.ndarray], plain: Mapping[str, str], free: bool
) -> tuple[dict[str, Any], set[str]]:
    """Arguments that say the instants, and the columns that they are from."""
    drivers = {one.name: one for one in system.independent_drivers}
    if "t" in plain:
        t = _converted(system, columns, plain["t"], "time")
        if free and ((np.diff(t) <= 0.0).any() or t[0] < 0.0):
            raise ModelError(
                "fit: the times of a free motion must rise from 0 on: sort the data, or begin "
                "where the motion does"
            )
        return {"t": t}, {plain["t"]}
    if free or not drivers or not all(name in plain for name in drivers):
        wanted = f", or of all drivers: {listed(drivers)}" if drivers and not free else ""
        raise ModelError(
            f"fit: the data do not say their instants: give a column t{wanted} (there are: "
            f"{listed(columns)})"
        )
    drive, used = {}, set()
    for name, driver in drivers.items():
        kinds = DIMENSIONS[bool(getattr(driver, "angular", False))]
        there = [(f"{name}{end}", kind) for end, kind in zip(MOTION, kinds, strict=True)]
        parts = [
            _converted(system, columns, plain[key], kind) if key in plain else None
            for key, kind in there
        ]
        if parts[1] is None and parts[2] is not None:
            raise ModelError(
                f"fit: the data have '{name}.acceleration' and no '{name}.rate': give both", name
            )
        drive[name] = tuple(part for part in parts if part is not None)
        used |= {plain[key] for key, _ in there if key in plain}
    return {"drive": drive}, used


def _converted(
    system: System, columns: Mapping[str, np.ndarray], name: str, dimension: str
) -> np.ndarray:
    """A column that says instants, in the units of the mechanism."""
    key, unit = split_heading(name)
    column = columns[name]
    if not np.isfinite(column).all():
        raise ModelError(f"fit: column '{key}' says the instants and has gaps: leave them out", key)
    factor = number_in(system.mechanism, f"1 {unit}", dimension, key, "unit") if unit else 1.0
    return np.asarray(column * factor)


# -- Predicted histories of the measured quantities for other numbers --------------------------


class DrivenPrediction:
    """Histories of a driven analysis with exact derivatives."""

    exact = True
    #: The result with the last numbers.
    run: Solution

    def __init__(
        self,
        system: System,
        series: DataSeries,
        names: Sequence[str],
        analysis: str,
        options: Mapping[str, Any],
    ) -> None:
        own = system.with_values(series.known) if series.known else system
        self.shape = series.values.shape
        how = {**options, **series.instants}
        self.prepared = PreparedGradient(own, dict(series.measures), names, analysis, **how)

    def at(self, numbers: Array) -> tuple[Array, Any]:
        """Values (columns, instants), and what makes derivatives of them."""
        point = self.prepared.at(numbers)
        self.run = point.run
        return point.value.reshape(self.shape), point

    def jacobian(self, point: Any) -> Array:
        """Derivatives (columns, instants, numbers)."""
        return np.asarray(point.jacobian.reshape(*self.shape, -1))


class FreePrediction:
    """Histories of `simulate`, with exact derivatives where there are, else differences."""

    #: The result with the last numbers.
    run: Solution

    def __init__(
        self, system: System, series: DataSeries, names: Sequence[str], options: Mapping[str, Any]
    ) -> None:
        self.system = system.with_values(series.known) if series.known else system
        self.names, self.measures = list(names), dict(series.measures)
        self.shape = series.values.shape
        t = series.instants["t"]
        # a motion has its beginning, whether it was measured or not
        self.first = 0 if t[0] == 0.0 else 1
        times = t if self.first == 0 else np.concatenate([[0.0], t])
        self.options = {"rtol": RTOL_FINE, **options, "until": float(t[-1]), "times": times}
        self.sizes = np.array(
            [
                abs(float(self.system.values[name])) or size_of_zero(self.system, name)
                for name in self.names
            ]
        )
        try:
            self.exact = bool(np.isfinite(self._gradient(self.system)).all())
        except (ModelError, SolveError):
            # methods and beginnings whose motions have no derivatives
            self.exact = False
        self.least = np.array([0.0 if self.system.rule(n)[0] else -np.inf for n in self.names])

    def at(self, numbers: Array) -> tuple[Array, Any]:
        """Values (columns, instants), and where they are."""
        return self._histories(numbers[None, :])[:, 0], numbers

    def jacobian(self, numbers: Any) -> Array:
        """Derivatives (columns, instants, numbers)."""
        if self.exact:
            values = dict(zip(self.names, numbers.tolist(), strict=True))
            found = self._gradient(self.system.with_values(values))
            # NaN where changes of modes have no derivative
            if np.isfinite(found).all():
                return found
        return self._differences(numbers)

    def _gradient(self, system: System) -> Array:
        found = gradient(system, self.measures, self.names, "simulate", **self.options).jacobian
        return np.asarray(found.reshape(len(self.measures), -1, len(self.names))[:, self.first :])

    def _differences(self, numbers: Array) -> Array:
        """By two differences each; where a number may not be less, to one side, of second order
        too.
        """
        count = len(numbers)
        steps = DIFFERENCE_STEP_NUMBERS * np.maximum(np.abs(numbers), self.sizes)
        one_sided = numbers - steps < self.least
        low = np.where(one_sided, 2.0, -1.0)
        here = np.repeat(numbers[None, :], 2 * count + 1, axis=0)
        for k in range(count):
            here[2 * k, k] += steps[k]
            here[2 * k + 1, k] += low[k] * steps[k]
        found = self._histories(here)
        middle = found[:, -1]
        parts = []
        for k in range(count):
            ahead, other = found[:, 2 * k], found[:, 2 * k + 1]
            if one_sided[k]:
                parts.append((4.0 * ahead - other - 3.0 * middle) / (2.0 * steps[k]))
            else:
                parts.append((ahead - other) / (2.0 * steps[k]))
        return np.stack(parts, axis=-1)

    def _histories(self, designs: Array) -> Array:
        """(columns, designs, instants)."""
        found = np.empty((len(self.measures), len(designs), *self.shape[1:]))
        for n, design in enumerate(designs.tolist()):
            system = self.system.with_values(dict(zip(self.names, design, strict=True)))
            self.run = run = simulate(system, **self.options)
            if run.t[-1] < self.options["until"]:
                unit = run.mechanism.units.time
                raise SolveError(
                    f"fit: the motion is {run.status}, at t = {run.t[-1]:.6g} {unit}, data go on "
                    f"to {self.options['until']:.6g} {unit}: leave out those that come later"
                )
            for row, measure in zip(found, self.measures.values(), strict=True):
                row[n] = measured(run, measure)[0][self.first :]
        return found


class FitProblem:
    """Residuals of all runs, with their derivatives."""

    def __init__(
        self,
        system: System,
        series: Sequence[DataSeries],
        names: Mapping[str, str],
        analysis: str,
        offsets: Sequence[str],
        options: Mapping[str, Any],
    ) -> None:
        self.system, self.series = system, series
        self.names = own = list(names.values())
        self.runs: list[Any] = [
            FreePrediction(system, one, own, options)
            if analysis == "simulate"
            else DrivenPrediction(system, one, own, analysis, options)
            for one in series
        ]
        self.exact = all(run.exact for run in self.runs)
        self.start = np.array([float(system.values[name]) for name in own])
        self.columns = list(series[0].measures)
        self.units = {
            name: check_measure(system.mechanism, one) for name, one in series[0].measures.items()
        }
        self.masks = [np.isfinite(one.values) for one in series]
        self.count = sum(int(mask.sum()) for mask in self.masks)
        self.shifts = self._shifts(offsets)
        self.evaluations = 0
        self._last: tuple[bytes, list[Any]] | None = None

    def column(self, given: Any, what: str) -> str:
        """The name of a column that is named by it or by its heading, "slider.x [mm]"; what is
        given of it, such as "an offset", is in the sentence where there is no such column.
        """
        for name in (split_heading(given)[0] if isinstance(given, str) else given, given):
            if name in self.columns:
                return str(name)
        raise ModelError(
            f"fit: there is no column {brief(given)} with {what} (there are: "
            f"{listed(self.columns)})",
            str(given),
        )

    def _shifts(self, offsets: Sequence[str]) -> dict[str, tuple[int, str]]:
        """Names of the offsets, and the run and column of each."""
        given = [offsets] if isinstance(offsets, str) else list(offsets)
        wanted = [self.column(name, "an offset") for name in given]
        several = len(self.series) > 1
        return {
            _shift(name, n + 1 if several else 0): (n, name)
            for name in wanted
            for n in range(len(self.series))
        }

    def _predictions(self, numbers: Array) -> list[Any]:
        """Histories of all runs, and what makes their derivatives; those of the last numbers are
        kept.
        """
        key = numbers.tobytes()
        if self._last is None or self._last[0] != key:
            own = numbers[: len(self.start)]
            self._last = key, [run.at(own) for run in self.runs]
            self.evaluations += 1
        return self._last[1]

    def results(self, numbers: Array) -> list[Solution]:
        """The results of all runs."""
        for run in self.runs:
            run.at(numbers[: len(self.start)])
        return [run.run for run in self.runs]

    def histories(self, numbers: Array) -> list[Array]:
        """Data less fit of every run, (columns, instants)."""
        found = []
        for n, (values, _) in enumerate(self._predictions(numbers)):
            values = values.copy()
            for k, (run, name) in enumerate(self.shifts.values()):
                if run == n:
                    values[self.columns.index(name)] += numbers[len(self.start) + k]
            found.append(self.series[n].values - values)
        return found

    def residual(self, numbers: Array, sigma: Array) -> Array:
        """Fit less data by the deviations of the columns, all in a row."""
        parts = [
            (-left / sigma[:, None])[mask]
            for left, mask in zip(self.histories(numbers), self.masks, strict=True)
        ]
        return np.concatenate(parts)

    def jacobian(self, numbers: Array, sigma: Array) -> Array:
        """Its derivatives, (data, unknowns)."""
        rows = []
        for n, (_, point) in enumerate(self._predictions(numbers)):
            own = self.runs[n].jacobian(point)
            shifts = np.zeros((*own.shape[:2], len(self.shifts)))
            for k, (run, name) in enumerate(self.shifts.values()):
                if run == n:
                    shifts[self.columns.index(name), :, k] = 1.0
            whole = np.concatenate([own, shifts], axis=-1) / sigma[:, None, None]
            rows.append(whole[self.masks[n]])
        return np.concatenate(rows)

    def sizes(self, numbers: Array) -> tuple[Array, Array]:
        """Sum of squares and number of the residuals of each column."""
        squares, counts = np.zeros(len(self.columns)), np.zeros(len(self.columns))
        for left, mask in zip(self.histories(numbers), self.masks, strict=True):
            squares += np.square(np.where(mask, left, 0.0)).sum(axis=1)
            counts += mask.sum(axis=1)
        return squares, counts

    def number_sizes(self, numbers: Array) -> Array:
        """Sizes of the unknowns: that of the start at least, and what `least_sizes` says."""
        return np.maximum(np.abs(numbers), self.least_sizes)

    @functools.cached_property
    def least_sizes(self) -> Array:
        """Of lengths that of the mechanism at least, of what begins at zero a natural one, of
        offsets the range of their data.
        """
        own = natural_sizes(self.system, self.names)
        ranges = dict(zip(self.columns, self.ranges(), strict=True))
        return np.array([*own, *(ranges[column] for _, column in self.shifts.values())])

    def data_size(self, sigma: Array) -> float:
        """Norm of all data by the deviations of the columns."""
        parts = [
            (one.values / sigma[:, None])[mask]
            for one, mask in zip(self.series, self.masks, strict=True)
        ]
        return float(np.linalg.norm(np.concatenate(parts)))

    def ranges(self) -> Array:
        """Range of the data of each column."""
        rows = [
            np.concatenate([one.values[k] for one in self.series]) for k in range(len(self.columns))
        ]
        return np.array([max(np.nanmax(np.abs(row)), TINY) for row in rows])


def _shift(column: str, run: int) -> str:
    """The name of an offset, of the one run or of several."""
    return f"{column} offset, run {run}" if run else f"{column} offset"
