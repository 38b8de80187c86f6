"""Bands of a measured quantity whose numbers scatter, by derivatives and by random designs."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any, TypeAlias

import numpy as np

from mbody.analysis.position.assembly_analysis import as_system
from mbody.core import tolerances as tol
from mbody.core.bracket import last_place
from mbody.core.presentation import Presented
from mbody.derivatives.dual_solution import checked_names, influential, number_sizes, unit_of
from mbody.derivatives.gradient import Gradient, gradient
from mbody.errors import ModelError, SolveError, brief
from mbody.model.element import listed, takes_one_design
from mbody.model.mechanism import Mechanism
from mbody.model.simulation import Measure
from mbody.quantities import (
    Formula,
    FormulaError,
    Scope,
    dimension_text,
    evaluate,
    parse,
    parse_unit,
)
from mbody.quantities.formula import Number, float_or_formula
from mbody.quantities.units import NUMBER
from mbody.solution.declared_result import (
    ColumnTable,
    IncludedResult,
    ItemTable,
    Sentence,
    Value,
)
from mbody.solution.doubts import Inherited, inherited
from mbody.solution.known_forces import without_notes
from mbody.sweeps.job import MeasureLike, columns_of
from mbody.sweeps.run import sweep
from mbody.sweeps.samples import (
    SIGMAS,
    Normal,
    Samples,
    Scatter,
    Uniform,
    monte_carlo,
    scatter_of,
    together,
)
from mbody.system.system import System

# -- Mean, deviation and band of a quantity, by its derivatives and from a sample --------------

Array = np.ndarray

#: The part of the values below the band of 99.73 %.
BELOW = 0.0013498980316300933


@dataclass(frozen=True)
class ToleranceBand:
    """Where a quantity is.

    `mean`, `deviation`: Mean and standard deviation.
    `low`, `high`: 99.73 % of the values are between them.
    `count`: Designs of a sample, else 0.
    """

    mean: float
    deviation: float
    low: float
    high: float
    count: int = 0


def first_order(value: float, row: Array, sigma: Array) -> ToleranceBand:
    """Mean m, variance Σ (m_i σ_i)², band ± 3 σ.

    >>> first_order(1.0, np.array([3.0, 4.0]), np.array([1.0, 1.0]))
    ToleranceBand(mean=1.0, deviation=5.0, low=-14.0, high=16.0, count=0)
    """
    deviation = float(np.linalg.norm(row * sigma))
    centre = float(value)
    return ToleranceBand(
        centre, deviation, centre - SIGMAS * deviation, centre + SIGMAS * deviation
    )


def second_order(
    value: float, row: Array, curvature: Array, sigma: Array, excess: Array
) -> ToleranceBand:
    """Moments of m + Σ b_i x_i + ½ Σ H_ij x_i x_j with independent symmetric x of mean 0.

    With b and H by standard deviations and the excess e: mean m + ½ tr H; variance |b|² + ½ tr H²
    + ¼ Σ H_ii² e_i; third cumulant 3 bᵀH b + (3/2) Σ b_i² H_ii e_i + tr H³; fourth
    Σ b_i⁴ e_i + 12 bᵀH²b + 3 tr H⁴, both without the excess of terms in H alone. The band is that
    of a normal distribution bent by skewness and excess (Cornish and Fisher 1938).

    >>> band = second_order(0.0, np.array([0.0]), np.array([[2.0]]), np.ones(1), np.zeros(1))
    >>> round(band.mean, 12), round(band.deviation**2, 12)   # x² of a normal x
    (1.0, 2.0)
    """
    b, h = row * sigma, curvature * np.outer(sigma, sigma)
    own = np.diag(h)
    mean = float(value) + 0.5 * float(np.trace(h))
    variance = float(b @ b + 0.5 * np.sum(h * h) + 0.25 * np.sum(own**2 * excess))
    third = 3.0 * float(b @ h @ b) + 1.5 * float(np.sum(b**2 * own * excess))
    third += float(np.trace(h @ h @ h))
    deviation = float(np.sqrt(max(variance, 0.0)))
    if not deviation:
        return ToleranceBand(mean, 0.0, mean, mean)
    fourth = float(b**4 @ excess) + 12.0 * float(b @ h @ h @ b) + 3.0 * float(np.sum((h @ h) ** 2))
    skewness, heavy = third / deviation**3, fourth / deviation**4
    low, high = (mean + deviation * _bent(z, skewness, heavy) for z in (-SIGMAS, SIGMAS))
    return ToleranceBand(mean, deviation, low, high)


def _bent(z: float, g: float, e: float) -> float:
    """z + (z² − 1) g/6 + (z³ − 3z) e/24 − (2z³ − 5z) g²/36."""
    return (
        z
        + (z * z - 1.0) * g / 6.0
        + (z**3 - 3.0 * z) * e / 24.0
        - (2.0 * z**3 - 5.0 * z) * g * g / 36.0
    )


def of_samples(values: Array) -> ToleranceBand:
    """Of random designs: the quantiles of 0.135 and 99.865 %."""
    low, high = np.quantile(values, (BELOW, 1.0 - BELOW))
    return ToleranceBand(
        float(values.mean()), float(values.std(ddof=1)), float(low), float(high), len(values)
    )


# -- The loosest tolerances that keep a quantity in its band -----------------------------------


@dataclass(frozen=True)
class Allocation(Presented):
    """Tolerances of least cost Σ c/t with the quantity in its band.

    `low`, `high`: The band.
    `tolerance`: By number ±, as its distribution has it: 99.73 % of the values are in the band, to
      first order; less where a number alone leaves the band, or random designs do. Infinite where
      the number changes nothing.
    `worst_case`: The same where the quantity is in its band with all numbers at the ends at once.
    `varied`: By number that changes nothing the ± over which that was tried, in the random designs
      too.
    `inside`: The part of random designs with `tolerance` that is in the band.
    `count`: How many these are.
    """

    low: float
    high: float
    tolerance: dict[str, float]
    worst_case: dict[str, float]
    units: dict[str, str]
    varied: dict[str, float] = field(default_factory=dict)
    inside: float | None = None
    count: int = 0
    _spreads: Mapping[str, tuple[Scatter, float, float]] = field(
        default_factory=dict, repr=False, compare=False
    )

    declared = (
        "low high",
        ColumnTable(
            (
                Value("tolerance", "±", "each", missing="any"),
                Value("worst_case", "± worst case", "each", missing="any"),
                Value("units", "unit", "text"),
            ),
            "LOOSEST FOR {0.low:g} … {0.high:g}",
        ),
        "varied inside count",
        Sentence(
            lambda found: (
                found.varied
                and "any: tried over "
                + ", ".join(
                    f"{k} ± {v:.6g} {found.units[k]}".rstrip() for k, v in found.varied.items()
                )
            )
        ),
        Sentence(
            lambda found: (
                ""
                if found.inside is None
                else f"{100.0 * found.inside:.2f} % of {found.count} random designs are in it"
            )
        ),
    )

    def scatter(self) -> dict[str, Scatter]:
        """Distributions with these tolerances about their means; what changes nothing is uniform
        over what was tried.
        """
        return {
            name: _with(self._spreads[name], wide)
            if np.isfinite(wide)
            else Uniform(self.varied[name], mean=self._spreads[name][1])
            for name, wide in self.tolerance.items()
        }

    def smaller(self, factor: float) -> Allocation:
        """A copy with all tolerances times a factor."""
        return replace(self, tolerance={k: factor * v for k, v in self.tolerance.items()})

    def tried(self, inside: float, count: int) -> Allocation:
        """A copy with the share of random designs inside the band, of `count` tried."""
        return replace(self, inside=inside, count=count)


def _with(spread: tuple[Scatter, float, float], tolerance: float) -> Scatter:
    how, middle, _ = spread
    if isinstance(how, Normal):
        return Normal(tolerance=tolerance, mean=middle)
    return replace(how, tolerance=tolerance, mean=middle)


def limits(system: System, name: str, unit: str, within: Any, value: float) -> tuple[float, float]:
    """The band, in the unit of the quantity."""
    if not isinstance(within, tuple | list) or len(within) != 2:
        raise ModelError(f"tolerances: within is a pair (low, high), not {brief(within)}")
    try:
        low, high = (_limit(system, one, unit) for one in within)
    except FormulaError as error:
        raise ModelError(f"tolerances: within: {error}") from None
    if not low < high:
        raise ModelError(
            f"tolerances: the band goes from {low:g} to {high:g} {unit}".rstrip()
            + ": give its lowest value, then its greatest"
        )
    if not low < value < high:
        raise ModelError(
            f"tolerances: '{name}' is {value:.6g} {unit} at the means, which is not between "
            f"{low:g} and {high:g}: move the design or the band",
            name,
        )
    return low, high


def _limit(system: System, given: Any, unit: str) -> float:
    """An end of the band from a number, or from text with units."""
    made = float_or_formula(given, None)
    if not isinstance(made, Formula):
        return float(made)
    scope = Scope(system.mechanism.units, {})
    found = evaluate(parse(made.text), scope)
    if found.dimension is None:
        return float(found.value)
    one = evaluate(parse_unit(unit), scope) if unit else None
    if found.dimension != (NUMBER if one is None else one.dimension):
        raise FormulaError(
            f"{made.text!r} is {dimension_text(found.dimension)}, the quantity is in {unit or '1'}"
        )
    return float(found.value / (1.0 if one is None else one.value))


def allocated(
    system: System,
    names: Mapping[str, str],
    spreads: Mapping[str, tuple[Scatter, float, float]],
    row: np.ndarray,
    value: float,
    band: tuple[float, float],
    cost: Mapping[str, float] | None,
    tried: Trial,
) -> Allocation:
    """The tolerances of least cost Σ c/t, by Lagrange's multipliers, none greater than that by
    which its number alone leaves the band.

    Statistically Σ (m_i r_i t_i)² = T²/9 with the deviation r t of a distribution, so that t is in
    proportion to ∛(c/(m r)²); in the worst case Σ |m_i| t_i = T, and t to √(c/|m|). T is the
    distance to the nearer end of the band. `system` has the means; `tried` analyses others.
    """
    half = min(value - band[0], band[1] - value)
    costs = np.array([_cost(name, spreads[name], cost) for name in names])
    if cost is not None:
        unknown = [name for name in cost if name not in names]
        if unknown:
            raise ModelError(
                f"tolerances: cost of '{unknown[0]}', which does not scatter (these do: "
                f"{listed(names)})",
                str(unknown[0]),
            )
    derivative = np.abs(row)
    counts = influential(system, list(names.values()), np.asarray(value), row)
    ratio = np.array([_ratio(how) for how, _, _ in spreads.values()])
    loose, worst = np.full(len(costs), np.inf), np.full(len(costs), np.inf)
    if counts.any():
        effect = derivative[counts] * ratio[counts]
        parts = np.cbrt(costs[counts] / effect**2)
        loose[counts] = parts * half / (SIGMAS * np.linalg.norm(effect * parts))
        parts = np.sqrt(costs[counts] / derivative[counts])
        worst[counts] = parts * half / float(derivative[counts] @ parts)
    varied = {}
    for k, (name, own) in enumerate(names.items()):
        widest = _widest(system, own, spreads[name])
        # to first order a number may leave the band by a little, else by nothing
        first = max(loose[k], worst[k])
        off = (tol.TOLERANCE_FIRST_ORDER if counts[k] else tol.QUANTITY_ROUNDING) * half
        wider = (band[0] - off, band[1] + off)
        alone, acts = _alone(name, spreads[name][1], min(widest, first), value, wider, tried)
        if not counts[k] and not acts:
            varied[name] = widest
        elif alone < first:
            loose[k], worst[k] = min(loose[k], alone), min(worst[k], alone)
    if len(varied) == len(names):
        raise ModelError(
            f"tolerances: none of {listed(names)} changes the quantity: any tolerance will do"
        )
    return Allocation(
        low=band[0],
        high=band[1],
        tolerance=dict(zip(names, loose.tolist(), strict=True)),
        worst_case=dict(zip(names, worst.tolist(), strict=True)),
        units={name: unit_of(system.mechanism, own) for name, own in names.items()},
        varied=varied,
        _spreads=dict(spreads),
    )


#: The quantity for values by name, (designs,): NaN of designs that cannot be analysed.
Trial: TypeAlias = Callable[[Samples], Array]
#: Tolerances of one number that are tried, each √2 times the one before.
TRIED = 40
#: Designs at the ends of tolerances that are tried, and halvings of an interval.
CORNERS, HALVINGS = 729, 6
#: Random designs by which a factor of tolerances is found, and what is tried below it.
FEW_DESIGNS, FACTOR_LESS = 2000, 0.97


def _widest(system: System, name: str, spread: tuple[Scatter, float, float]) -> float:
    """The greatest ± of a number that is tried: half a turn, what leaves it positive (by a normal
    distribution too), else its own size, of lengths that of the mechanism at least.
    """
    how, middle, width = spread
    if system.rule(name)[0]:
        return 0.5 * middle if isinstance(how, Normal) else middle
    if unit_of(system.mechanism, name) == "rad":
        return float(np.pi)
    size = float(number_sizes(system, [name])[0])
    return size or tol.TOLERANCE_WIDEST * (width or 1.0)


def _alone(
    name: str, middle: float, widest: float, value: float, band: tuple[float, float], tried: Trial
) -> tuple[float, bool]:
    """The greatest tolerance by which one number alone keeps the quantity in its band, up to the
    widest, and whether it changes the quantity at all.
    """
    if not widest:
        return 0.0, False
    wide = widest * 2.0 ** (-0.5 * np.arange(TRIED)[::-1])
    acts, rounding = False, tol.QUANTITY_ROUNDING * max(abs(value), band[1] - band[0])
    for _ in range(2):
        column = tried(together({name: np.concatenate([middle - wide, middle + wide])}))
        acts |= not bool((np.abs(column - value) <= rounding).all())
        inside = ((column >= band[0]) & (column <= band[1])).reshape(2, -1).all(axis=0)
        if inside.all():
            return float(wide[-1]), acts
        first = int(np.argmin(inside))
        wide = np.linspace(wide[first - 1] if first else 0.0, wide[first], TRIED)
    return float(wide[max(first - 1, 0)]), acts


def _ends_inside(made: Allocation, part: float, tried: Trial) -> bool:
    """Whether the quantity is in its band with numbers at ends of the worst case and at means."""
    acting = [name for name, wide in made.worst_case.items() if np.isfinite(wide)]
    if 3 ** len(acting) <= CORNERS:
        signs = np.array(list(itertools.product((-1.0, 0.0, 1.0), repeat=len(acting))))
    else:
        signs = np.random.default_rng(0).choice([-1.0, 0.0, 1.0], (CORNERS, len(acting)))
    rows = {
        name: made._spreads[name][1] + part * made.worst_case[name] * signs[:, k]
        for k, name in enumerate(acting)
    }
    slack = tol.QUANTITY_ROUNDING * (made.high - made.low)
    column = tried(together(rows))
    return bool(((column >= made.low - slack) & (column <= made.high + slack)).all())


def _factor(holds: Callable[[float], bool]) -> float:
    """The greatest factor up to 1 with which something holds."""
    low = 1.0
    while not holds(low) and low > tol.TINY:
        low *= 0.5
    return last_place(holds, low, min(1.0, 2.0 * low), low * 0.5**HALVINGS)


def _ratio(how: Scatter) -> float:
    """Standard deviation by tolerance."""
    return 1.0 / SIGMAS if isinstance(how, Normal) else how.deviation_of(1.0)


def _cost(
    name: str, spread: tuple[Scatter, float, float], cost: Mapping[str, float] | None
) -> float:
    how, _, width = spread
    own = SIGMAS * how.deviation_of(width) if isinstance(how, Normal) else width
    given = own if cost is None else cost.get(name, own)
    if not own and (cost is None or name not in cost):
        raise ModelError(
            f"tolerances: '{name}' has the tolerance 0, which says nothing of what another costs: "
            "give its cost, or leave it out of scatter",
            name,
        )
    if isinstance(given, bool) or not isinstance(given, int | float) or not 0.0 < given < np.inf:
        raise ModelError(
            f"tolerances: the cost of '{name}' is {brief(given)}: give a positive number", name
        )
    return float(given)


NO_SECOND = "there is no second order: a design one deviation away fails: "
#: By name ± of a normal distribution, or a distribution, or (low, high) of a uniform one.
Scatters = Mapping[str, "Number | Scatter | tuple[Number, Number]"]


@dataclass(frozen=True)
class Contribution:
    """Contribution of one tolerance to the variation of the measure.

    `tolerance`: ± of the number: three standard deviations of a normal distribution, else the half
      width.
    `unit`: Of the tolerance.
    `share`: Of the variance to first order; all add up to 1.
    `worst`: What the whole tolerance does, |derivative| · tolerance.
    """

    tolerance: float
    derivative: float
    unit: str
    share: float
    worst: float


@dataclass(frozen=True, eq=False, repr=False)
class ToleranceStudy(Inherited, Presented):
    """Bands of a measured quantity.

    `value`: With every number at its mean.
    `first`, `second`, `monte_carlo`: By the derivatives, by the second derivatives too, and by
      random designs; None where designs do not close, or without random designs.
    `worst_case`: The least and greatest value if all numbers are at the ends of their tolerances,
      to first order; ± three standard deviations of normal ones.
    `contributions`: By number, the greatest first.
    `allocation`: The loosest tolerances that keep the quantity in its band, where one was given.
    `failures`: Random designs that could not be analysed.
    `status`, `doubts`, `notes`: Of the analysis at the means; notes of the derivatives and of the
      random designs, too.
    """

    model: str
    measure: str
    unit: str
    value: float
    first: ToleranceBand
    second: ToleranceBand | None
    monte_carlo: ToleranceBand | None
    worst_case: tuple[float, float]
    contributions: dict[str, Contribution]
    allocation: Allocation | None = None
    failures: int = 0

    declared = (
        "measure unit value first second monte_carlo worst_case",
        Sentence(lambda found: f"{found.measure} = {found.value:.6g} {found.unit}".rstrip()),
        ItemTable(
            "",
            (
                Value("", "mean", value="mean", missing=""),
                Value("", "deviation", value="deviation", missing=""),
                Value("", "low", value="low"),
                Value("", "high", value="high"),
            ),
            "BAND",
            lambda found: found.bands,
        ),
        ItemTable(
            "contributions",
            (
                Value("tolerance", "±", "each"),
                Value("unit", "unit", "text"),
                Value("derivative", "derivative", "each"),
                Value("share", "of variance", "share"),
                Value("worst"),
            ),
            "CONTRIBUTIONS",
        ),
        IncludedResult("allocation", "allocation"),
        Value("failures"),
        Sentence(
            lambda found: (
                f"{found.failures} random designs could not be analysed" if found.failures else ""
            )
        ),
    )

    @property
    def bands(self) -> dict[str, Any]:
        """All bands by how they were found."""
        low, high = self.worst_case
        found = {"first order": self.first, "second order": self.second}
        if self.monte_carlo is not None:
            found[f"{self.monte_carlo.count} random designs"] = self.monte_carlo
        known: dict[str, Any] = {name: band for name, band in found.items() if band is not None}
        return known | {"worst case": {"mean": None, "deviation": None, "low": low, "high": high}}

    def __repr__(self) -> str:
        return (
            f"ToleranceStudy({self.measure}: {self.first.mean:.6g} ± "
            f"{3.0 * self.first.deviation:.3g} {self.unit})"
        )


def tolerances(
    model: Mechanism | System,
    measure: MeasureLike,
    scatter: Scatters,
    analysis: str = "kinetostatics",
    *,
    count: int = 10_000,
    seed: int = 0,
    within: tuple[Number, Number] | None = None,
    cost: Mapping[str, float] | None = None,
    **options: Any,
) -> ToleranceStudy:
    """The band of a measured quantity when numbers of the description scatter: tolerance analysis
    and tolerance allocation.

    Parameters
    ----------
    model : Mechanism or System
        Of one design.
    measure : str or Measure
        That becomes one number, such as ``"peak(A.force)"``; as of `gradient`.
    scatter : mapping
        By the name of the number: ± of a normal distribution (three standard deviations) as a float
        or text with a unit, or `mbody.sweeps.Normal`, `Uniform`, `Triangular`, or (low, high) of a
        uniform one. Numbers scatter independently.
    analysis : str
        "kinetostatics", "kinematics" or "statics".
    count, seed : int
        Random designs, 0 for none.
    within : pair, optional
        The band (low, high) in which the quantity must stay, in its unit: the loosest tolerances
        that keep it there are found.
    cost : mapping, optional
        What a tolerance costs: c/tolerance of each number; by default c is its own tolerance now,
        so that all numbers are as difficult as now.
    **options
        The instants, as of `gradient`.

    Returns
    -------
    ToleranceStudy
        Bands of 99.73 % to first order, second order and of random designs; contributions;
        allocation.

    Raises
    ------
    ModelError
        For a number that there is not or that a formula makes, a negative width, a history that is
        not one number, a band that does not contain the quantity.
    SolveError
        As of the analysis.

    Notes
    -----
    First order: σ² = Σ (∂m/∂p σ_p)², mean m(p̄), band ± 3 σ. Second order: H by central differences
    of exact gradients, one standard deviation to each side; mean + ½ Σ H_ii σ_i²; variance and
    third moment of the quadratic form; band by the expansion of Cornish and Fisher with skewness
    and excess, which a uniform distribution has. Random designs: quantiles of 0.135 and 99.865 %.
    Allocation is to first order; no tolerance is greater than that by which its number alone leaves
    the band, and all are less by a factor where random designs are not as often in it.

    Source: D. H. Evans, *Statistical tolerancing: the state of the art*, J. Quality Technology 6
    (1974) 188–195 and 7 (1975) 1–12; allocation by Lagrange multipliers: K. W. Chase, W. H.
    Greenwood, *Design issues in mechanical tolerance analysis*, Manufacturing Review 1 (1988).

    Examples
    --------
    >>> import mbody
    >>> machine = mbody.gallery.load("norton_fourbar")
    >>> scatter = {"crank.A.x": 0.01, "rocker.B.x": "0.5 mm"}
    >>> found = mbody.tolerances(machine, "peak(A.force)", scatter, turn="motor", count=0)
    >>> list(found.contributions)
    ['rocker.B.x', 'crank.A.x']
    """
    system = as_system(model)
    takes_one_design("tolerances", system.batch)
    if not isinstance(measure, str | Measure | tuple):
        raise ModelError(f"tolerances: measure must be one quantity, not {brief(measure)}")
    ((name),) = (column.name for column in columns_of(system.mechanism, [measure], "tolerances"))
    if not isinstance(scatter, Mapping) or not scatter:
        raise ModelError(
            'tolerances: scatter must be a dict such as {"crank.A.x": "0.1 mm"}, not '
            f"{brief(scatter)}"
        )
    if isinstance(count, bool) or not isinstance(count, int) or count < 0 or count == 1:
        raise ModelError(
            f"tolerances: count must be a whole number of random designs from 2 on, or 0, not "
            f"{brief(count)}"
        )
    names = checked_names(system, list(scatter), "tolerances")
    given = {
        key: how if isinstance(how, Scatter | tuple | list) else Normal(how)
        for key, how in scatter.items()
    }
    spreads = {key: scatter_of(system, names[key], how, "tolerances") for key, how in given.items()}
    for key, (how, middle, width) in spreads.items():
        _refuse_below_zero(system, names[key], middle, _half_range(how, width))
    centre = system.with_values({names[key]: middle for key, (_, middle, _) in spreads.items()})
    by = list(names.values())
    sigma = np.array([how.deviation_of(width) for how, _, width in spreads.values()])
    excess = np.array([how.excess for how, _, _ in spreads.values()])

    def derivatives(design: System) -> Gradient:
        return gradient(design, {name: measure}, by, analysis, **options)

    found = derivatives(centre)
    value = found.value[name]
    if np.ndim(value):
        raise ModelError(
            f"tolerances: '{name}' is a history of {len(value)} instants: say how it becomes one "
            f"number, such as peak({name})",
            name,
        )
    row = found.jacobian[0]
    notes = list(found.notes)
    first = first_order(value, row, sigma)
    second = None
    try:
        with without_notes():
            curvature = _curvature(centre, by, sigma, derivatives)
        second = second_order(value, row, curvature, sigma, excess)
    except SolveError as error:
        notes.append(NO_SECOND + str(error))
    drawn, failures = None, 0
    if count:
        random = sweep(
            centre, monte_carlo(given, count, seed), analysis, {name: measure}, **options
        )
        column = random[name]
        failures = len(random.failures)
        if np.isfinite(column).sum() > 1:
            drawn = of_samples(column[np.isfinite(column)])
        notes += [one for one in random.notes if one not in notes][:3]
    ends = {key: _half_range(how, width) for key, (how, _, width) in spreads.items()}
    whole = float(np.abs(row) @ np.array(list(ends.values())))
    allocation = None
    if within is not None:
        band = limits(system, name, found.measured[name], within, value)

        def tried(samples: Samples) -> Array:
            return sweep(centre, samples, analysis, {name: measure}, **options)[name]

        allocation = allocated(centre, names, spreads, row, value, band, cost, tried)
        allocation = _proven(allocation, tried, count, seed)
    variance = np.square(row * sigma)
    total = float(variance.sum())
    contributions = {
        key: Contribution(
            tolerance=ends[key],
            derivative=float(row[k]),
            unit=unit_of(system.mechanism, names[key]),
            share=float(variance[k]) / total if total else 0.0,
            worst=float(abs(row[k])) * ends[key],
        )
        for k, key in enumerate(names)
    }
    order = sorted(contributions, key=lambda key: contributions[key].share, reverse=True)
    return ToleranceStudy(
        model=system.mechanism.name,
        measure=name,
        unit=found.measured[name],
        value=float(value),
        first=first,
        second=second,
        monte_carlo=drawn,
        worst_case=(float(value) - whole, float(value) + whole),
        contributions={key: contributions[key] for key in order},
        allocation=allocation,
        failures=failures,
        **inherited(found, notes=notes),
    )


def _half_range(how: Scatter, width: float) -> float:
    """± of a number: three standard deviations of a normal distribution, else the half width."""
    return SIGMAS * how.deviation_of(width) if isinstance(how, Normal) else width


def _refuse_below_zero(system: System, name: str, middle: float, half_range: float) -> None:
    """Refuse a tolerance that leads to a number that must not be."""
    if not system.rule(name)[0] or half_range <= middle:
        return
    unit = unit_of(system.mechanism, name)
    raise ModelError(
        f"tolerances: '{name}' is {middle:g} ± {half_range:g} {unit}".rstrip()
        + ", and it must not be negative: give it a tolerance below its mean",
        name,
    )


def _curvature(centre: System, by: list[str], sigma: np.ndarray, derivatives: Any) -> np.ndarray:
    """Second derivatives by differences of exact gradients, over the width of the scatter."""
    rows = np.zeros((len(by), len(by)))
    for k, (name, step) in enumerate(zip(by, sigma, strict=True)):
        if step == 0.0:
            continue
        here = float(centre.values[name])
        ahead, behind = (
            derivatives(centre.with_values({name: here + sign * step})).jacobian[0]
            for sign in (1.0, -1.0)
        )
        rows[k] = (ahead - behind) / (2.0 * step)
    used = np.outer(sigma > 0.0, sigma > 0.0)
    return np.where(used, 0.5 * (rows + rows.T), 0.0)


def _proven(allocation: Allocation, tried: Trial, count: int, seed: int) -> Allocation:
    """The allocation with the share of random designs that it keeps in the band, all tolerances
    less by one factor where that is no 99.73 %; those of the worst case where ends are beyond.
    """
    if not count:
        return allocation

    def inside(made: Allocation, designs: int = count) -> float:
        column = tried(monte_carlo(made.scatter(), designs, seed))
        return float(((column >= made.low) & (column <= made.high)).mean())

    least = 1.0 - 2.0 * BELOW
    share = inside(allocation)
    # by no more than chance less
    if share < least - SIGMAS * math.sqrt(2.0 * BELOW / count):
        few = min(count, FEW_DESIGNS)
        factor = _factor(lambda part: inside(allocation.smaller(part), few) >= least)
        while (share := inside(allocation.smaller(factor))) < least and factor > tol.TINY:
            factor *= FACTOR_LESS
        allocation = allocation.smaller(factor)
    part = _factor(lambda part: _ends_inside(allocation, part, tried))
    worst = {name: part * wide for name, wide in allocation.worst_case.items()}
    allocation = replace(allocation, worst_case=worst)
    return allocation.tried(share, count)
