"""Numbers of a mechanism from measured histories, by least squares."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from mbody.analysis.driven.driven import ANALYSES
from mbody.analysis.position.assembly_analysis import as_system
from mbody.core import tolerances as tol
from mbody.core.least_squares import LeastSquares, least_squares
from mbody.core.presentation import Presented
from mbody.core.searches import Searches, latin
from mbody.derivatives.dual_solution import checked_names, unit_of
from mbody.derivatives.fit_problem import (
    Array,
    Bounds,
    Combination,
    FitProblem,
    Identified,
    OpenDirection,
    combinations,
    followed,
    identified,
    series_of,
)
from mbody.errors import ModelError, SolveError, brief
from mbody.model.element import listed, takes_one_design
from mbody.model.mechanism import Mechanism
from mbody.model.numbers import dimension_named
from mbody.quantities.formula import Number, range_given
from mbody.solution.declared_result import ColumnTable, Sentence, Value
from mbody.solution.doubts import Doubt, Inherited, inherited
from mbody.summaries.text_table import number
from mbody.system.system import System


@dataclass(frozen=True, eq=False, repr=False)
class Fit(Inherited, Presented):
    """Numbers that fit measured histories best.

    `values`, `units`: By the names of `by`.
    `offsets`: Unknown constants of columns, by ``"slider.x offset"``, of several runs by
      ``"slider.x offset, run 2"``.
    `covariance` (unknowns, unknowns): s² (JᵀJ)⁻¹ of values, then offsets; infinite variances of
      what is not determined, NaN beside them; zeros of what equal bounds hold.
    `deviations`, `intervals`: Standard deviation, and (low, high) of the confidence, by unknown and
      offset; infinite where the data do not determine it.
    `undetermined`: Changes of unknowns that change no datum; ``str`` says them.
    `combinations`: Sums and products of those unknowns that the data do determine.
    `residual`: By column the root of the mean square of data less fit, in its unit.
    `residuals`: Of every run, by column, data less fit: arrays (instants,), NaN where nothing was
      measured.
    `data`, `evaluations`: Data that were used, and analyses of each run.
    `system`: With the values.
    """

    model: str = ""
    values: dict[str, float] = field(default_factory=dict)
    units: dict[str, str] = field(default_factory=dict)
    offsets: dict[str, float] = field(default_factory=dict)
    covariance: np.ndarray = field(default_factory=lambda: np.zeros((0, 0)))
    deviations: dict[str, float] = field(default_factory=dict)
    intervals: dict[str, tuple[float, float]] = field(default_factory=dict)
    confidence: float = 0.95
    undetermined: tuple[OpenDirection, ...] = ()
    combinations: tuple[Combination, ...] = ()
    residual: dict[str, float] = field(default_factory=dict)
    residuals: tuple[dict[str, np.ndarray], ...] = ()
    data_units: dict[str, str] = field(default_factory=dict)
    count: int = 0
    evaluations: int = 0
    system: Any = None

    declared = (
        "values units offsets deviations intervals confidence",
        "covariance undetermined combinations",
        ColumnTable(
            (
                Value("", "value", "each", lambda found: {**found.values, **found.offsets}),
                Value("", "deviation", "each", "deviations", missing="open"),
                Value("", "low", "each", lambda found: found.interval_ends(0), missing="open"),
                Value("", "high", "each", lambda found: found.interval_ends(1), missing="open"),
                Value("", "unit", "text", "units"),
            ),
            "NUMBERS",
        ),
        ColumnTable(
            (Value("residual", "residual", "each"), Value("", "unit", "text", "data_units")),
            "DATA",
        ),
        "count evaluations",
        Sentence(
            lambda found: (
                f"{found.count} data; low and high of {100.0 * found.confidence:g} % confidence"
            )
        ),
        Sentence(
            lambda found: [
                one.line({**found.values, **found.offsets}) for one in found.combinations
            ]
        ),
    )

    def interval_ends(self, end: int) -> dict[str, float]:
        """Lower (0) or upper (1) ends of the intervals."""
        return {name: pair[end] for name, pair in self.intervals.items()}

    def __getitem__(self, name: str) -> float:
        """The value of one number."""
        if name not in self.values:
            raise ModelError(
                f"the fit has no number {name!r} (there are: {listed(self.values)})", str(name)
            )
        return self.values[name]

    def __repr__(self) -> str:
        parts = (f"{name} = {value:.6g}" for name, value in self.values.items())
        return f"Fit({', '.join(parts)})"


#: Passes that find the deviations of several columns from their residuals.
PASSES = 12
#: How often what is held is chosen anew.
CHOICES = 4
#: Analyses of a search.
ANALYSES_MOST = 200
#: Starts by chance, analyses from each at most, and how many that end alike are enough.
STARTS, ELSEWHERE, AGREE = 12, 50, 3


@dataclass(frozen=True, eq=False)
class BestNumbers:
    """The least sum of squares.

    `numbers` (unknowns,): Values, then offsets.
    `sigma` (columns,): Deviations of the columns by which residuals are divided.
    `known`: What the data determine, by the derivatives there.
    `pulled` (unknowns,): By how much the sum of squares would be less beyond bounds, to first
      order: how far the unknowns would move; zeros where no bound is in the way.
    `searches`: From other starts.
    `units`: By unknown.
    """

    numbers: Array
    sigma: Array
    known: Identified
    settled: bool
    pulled: Array
    searches: Searches
    units: Mapping[str, str]


def best_numbers(
    problem: FitProblem,
    units: Mapping[str, str],
    bounds: Bounds,
    deviations: Mapping[str, float] | None,
) -> BestNumbers:
    """The best numbers. Where data leave directions open, one unknown of each is held as it is; a
    search that ends at a bound, or leaves residuals that are no noise, begins elsewhere too.
    """
    search = _ResidualSearch(problem, units, bounds)
    given = _deviations(problem, deviations)
    numbers = np.concatenate([problem.start, np.zeros(len(problem.shifts))])
    numbers, sigma, known = _weighted(search, numbers, given)
    pulled = search.pulled(numbers, sigma, known)
    if pulled.any() or correlations(problem, numbers):
        other = search.elsewhere(numbers, sigma, known)
        if other is not None:
            numbers, sigma, known = _weighted(search, other, given)
            pulled = search.pulled(numbers, sigma, known)
    return BestNumbers(numbers, sigma, known, search.settled, pulled, search.searches, units)


def _weighted(
    search: _ResidualSearch, numbers: Array, given: Array | None
) -> tuple[Array, Array, Identified]:
    """The best numbers from a start, with the deviations of the columns, given or of residuals."""
    problem = search.problem
    sigma = problem.ranges() if given is None else given
    numbers, known = search.best(numbers, sigma)
    if given is None and len(problem.columns) > 1:
        for _ in range(PASSES):
            squares, counts = problem.sizes(numbers)
            # each column bears its part of the unknowns
            free = np.maximum(counts * (1.0 - known.rank / problem.count), 1.0)
            new = np.maximum(np.sqrt(squares / free), tol.FIT_DEVIATION_LEAST * problem.ranges())
            done = np.abs(new / sigma - 1.0).max() <= tol.FIT_DEVIATIONS_SETTLED
            sigma = new
            numbers, known = search.best(numbers, sigma)
            if done:
                break
    return numbers, sigma, known


class _ResidualSearch:
    """Least squares of one problem with different deviations of its columns."""

    def __init__(self, problem: FitProblem, units: Mapping[str, str], bounds: Bounds) -> None:
        self.problem, self.units, self.bounds = problem, units, bounds
        self.settled = True
        #: From other starts.
        self.searches = Searches(0, known=True)

    def best(self, start: Array, sigma: Array) -> tuple[Array, Identified]:
        """The least from a start, and what is known there."""
        numbers, known = start, self._known(start, sigma)
        if not known.rank:
            # perhaps a place where derivatives vanish, such as a middle
            numbers, known = self._effective(start, sigma, known)
        for _ in range(CHOICES):
            fixed = list(known.pivots)
            end = self._least(numbers, sigma, fixed, ANALYSES_MOST)
            numbers, self.settled = end.x, end.settled
            known = self._known(numbers, sigma)
            if known.rank <= len(start) - len(fixed):
                break
        return numbers, known

    def _effective(self, start: Array, sigma: Array, known: Identified) -> tuple[Array, Identified]:
        """A start from where the data change."""
        for other in self._starts(start, known):
            try:
                there = self._known(other, sigma)
            except (ModelError, SolveError):
                continue
            if there.rank:
                return other, there
        raise ModelError(
            f"fit: none of {listed(self.units)} changes any of the data: measure others"
        )

    def pulled(self, numbers: Array, sigma: Array, known: Identified) -> Array:
        """How far beyond their bounds the unknowns would move, by the derivatives here."""
        jacobian = self.problem.jacobian(numbers, sigma)
        left = self.problem.residual(numbers, sigma)
        slope = jacobian.T @ left
        near = tol.FIT_BOUND_NEAR * self.problem.number_sizes(numbers)
        low, high = self.bounds
        at = ((numbers - low <= near) & (slope > 0.0)) | ((high - numbers <= near) & (slope < 0.0))
        move = -known.inverse @ slope
        rounding = tol.FIT_RESIDUAL_ROUNDING * self.problem.data_size(sigma)
        gain = float(np.square(jacobian @ move).sum())
        counts = gain > tol.FIT_IMPROVES * float(left @ left) and gain > rounding**2
        return move if at.any() and counts else np.zeros_like(move)

    def elsewhere(self, numbers: Array, sigma: Array, known: Identified) -> Array | None:
        """Better numbers from other starts, or none: with nothing held from here, from both ways
        along what is not determined, and from places by chance.
        """
        left = self.problem.residual(numbers, sigma)
        least, better, agree = float(left @ left), None, 0
        self.searches = Searches(1 + 2 * len(known.null) + STARTS, known=True)

        def search(start: Array) -> LeastSquares | None:
            try:
                return self._least(start, sigma, [], ELSEWHERE)
            except (ModelError, SolveError):
                return None

        for end in self.searches.ends(self._starts(numbers, known), search):
            if end.cost < least * (1.0 - tol.FIT_IMPROVES):
                least, better, agree = end.cost, end.x, 0
                if not self.pulled(end.x, sigma, known).any() and not correlations(
                    self.problem, end.x
                ):
                    break
            elif end.cost <= least * (1.0 + tol.FIT_AGREES):
                agree += 1
                if agree == AGREE:
                    break
        return better

    def _starts(self, numbers: Array, known: Identified) -> Iterator[Array]:
        problem, (low, high) = self.problem, self.bounds
        sizes = problem.number_sizes(numbers)
        yield numbers
        for row in known.null:
            way = row / np.abs(row / sizes).max()
            yield from (np.clip(numbers + part * way, low, high) for part in (0.5, -0.5))
        first = np.concatenate([problem.start, numbers[len(problem.start) :]])
        bounded = np.isfinite(low) & np.isfinite(high)
        base = np.where(bounded, low, 0.0)
        wide = np.where(bounded, high, 0.0) - base
        for part, chance in latin(STARTS, 2 * len(numbers), 0).reshape(STARTS, 2, -1):
            sign = np.where(chance < 0.25, -1.0, 1.0)
            free = np.where(
                first == 0.0, sizes * (2.0 * part - 1.0), sign * first * 4.0 ** (2.0 * part - 1.0)
            )
            free = np.where(free < low, -free, free)
            yield np.clip(np.where(bounded, base + part * wide, free), low, high)

    def _known(self, numbers: Array, sigma: Array) -> Identified:
        jacobian, sizes = self.problem.jacobian(numbers, sigma), self.problem.number_sizes(numbers)
        return identified(
            jacobian,
            list(self.units),
            self.units,
            sizes,
            tol.FIT_SINGULAR_VALUE[self.problem.exact],
        )

    def _least(self, start: Array, sigma: Array, fixed: list[int], most: int) -> LeastSquares:
        """The least by the unknowns that are not fixed as they are, by so many steps."""
        problem, (low, high) = self.problem, (one.copy() for one in self.bounds)
        low[fixed] = high[fixed] = np.clip(start, *self.bounds)[fixed]
        return least_squares(
            lambda x: problem.residual(x, sigma),
            lambda x: problem.jacobian(x, sigma),
            start,
            (low, high),
            most=most,
            ends=tol.FIT_ENDS,
            size=problem.data_size(sigma),
        )


def correlations(problem: FitProblem, numbers: Array) -> dict[str, float]:
    """Of columns whose residuals are no noise the correlation of each with the one before."""
    lefts, found = problem.histories(numbers), {}
    for k, (name, size) in enumerate(zip(problem.columns, problem.ranges(), strict=True)):
        rows = [left[k][mask[k]] for left, mask in zip(lefts, problem.masks, strict=True)]
        count, whole = sum(map(len, rows)), sum(float(row @ row) for row in rows)
        if count < FEW or whole <= count * (tol.FIT_RESIDUAL_ROUNDING * size) ** 2:
            continue
        shared = sum(float(row[1:] @ row[:-1]) for row in rows) / whole
        if abs(shared) * math.sqrt(count) > tol.FIT_CORRELATION_CHANCE:
            found[name] = shared
    return found


def _deviations(problem: FitProblem, given: Mapping[str, float] | None) -> Array | None:
    if given is None:
        return None
    given = {problem.column(name, "a deviation"): value for name, value in given.items()}
    for name in problem.columns:
        value = given.get(name)
        if (
            isinstance(value, bool)
            or not isinstance(value, int | float)
            or not 0.0 < value < math.inf
        ):
            raise ModelError(
                f"fit: the deviation of '{name}' is {brief(value)}: give each column a positive "
                "number",
                name,
            )
    return np.array([float(given[name]) for name in problem.columns])


UNSETTLED = (
    "the least squares have not settled after 200 analyses: begin nearer, or look for fewer numbers"
)
DIFFERENCED = (
    "derivatives of this motion are differences of simulate: deviations have some 5 figures"
)
#: Fewer residuals are not examined.
FEW = 20


def fit(
    model: Mechanism | System,
    data: Any,
    by: Sequence[str] | Mapping[str, tuple[Number, Number] | None] | str,
    analysis: str | None = None,
    *,
    offsets: Sequence[str] = (),
    deviations: Mapping[str, float] | None = None,
    confidence: float = 0.95,
    **options: Any,
) -> Fit:
    """Numbers of the description from measured histories: parameter identification, calibration.

    Parameters
    ----------
    model : Mechanism or System
        Of one design; its own numbers are the start.
    data : mapping, path or list of them
        Of each run columns by name: the instants, ``"t"`` or the positions of all drivers by name
        (with ``"motor.rate"``, ``"motor.acceleration"``), and measured quantities such as
        ``"slider.x [mm]"``, formulas of histories or measures of the mechanism, with a unit in
        brackets or in that of the mechanism. NaN is no datum. A single number in place of a column
        is the value of a number in this run, such as ``"load.mass": 2.0``. A path is that of a CSV
        file with headings.
    by : list of str or mapping
        The unknown numbers, as of `gradient`; or each with its bounds (low, high); equal ones hold
        it there. Masses, stiffnesses and others that cannot be negative are bounded by 0.
    analysis : str, optional
        "kinematics", "kinetostatics", "statics" or "simulate"; by default "kinetostatics" where the
        drivers leave no freedom, else "simulate".
    offsets : list of str
        Columns that have an unknown constant added, one in each run, as an encoder has.
    deviations : mapping, optional
        Standard deviations of the noise of the columns, in their units, by which they are weighted.
        By default those of several columns are found from their residuals.
    confidence : float
        Of the intervals.
    **options
        Of the analysis besides its instants, such as ``guess``, ``rates``, ``rtol``.

    Returns
    -------
    Fit
        Values with covariance and intervals; what the data leave open, in words; residuals.

    Raises
    ------
    ModelError
        For fewer data than unknowns, names, units and columns that do not fit, a number that a
        formula makes, and no unknown that changes any datum.
    SolveError
        As of the analysis, with the numbers of the start.

    Notes
    -----
    Σ ((d − m(p))/σ)² is made least by the method of Levenberg and Marquardt with exact
    derivatives of the histories (`gradient`); where a free motion has none, as with impacts, these
    are central differences, which a note says. Covariance s² (JᵀJ)⁻¹ with s² the sum by its degrees
    of freedom; intervals by Student's distribution, within the bounds. They hold for independent
    noise; where a residual is correlated with the next one a note says so. A search that ends at a
    bound, or leaves such residuals, begins elsewhere too: with nothing held, and by chance. If the
    bound remains, intervals are about the numbers to which the data lead beyond it, by the
    derivatives. What changes no datum is the null space of J. The numbers that fit equally well are
    followed from there by Newton's method, and combinations are determined that are the same all
    along: moments m, m x, m y, I + m (x² + y²) of bodies with other unknowns in a sum (the base
    parameters), products, else tangents with the range where they hold.

    Source: G. A. F. Seber and C. J. Wild, *Nonlinear Regression*, Wiley 1989, chapters 2 and 5; M.
    Gautier and W. Khalil, *Direct calculation of minimum set of inertial parameters of serial
    robots*, IEEE Trans. Robotics and Automation 6 (1990) 368–373 (base parameters).

    Examples
    --------
    >>> import mbody
    >>> machine = mbody.makers.slider_crank(0.1, 0.3)
    >>> crank = np.linspace(0.0, 6.0, 50)
    >>> run = mbody.kinematics(machine, drive={"motor": crank})
    >>> data = {"motor": crank, "slider.x [mm]": 1e3 * run["slider"].x}
    >>> start = mbody.makers.slider_crank(0.11, 0.28)
    >>> found = mbody.fit(start, data, ["crank.A.x", "rod.B.x"], "kinematics")
    >>> [round(value, 9) for value in found.values.values()]
    [0.1, 0.3]
    """
    system = as_system(model)
    takes_one_design("fit", system.batch)
    if not 0.0 < confidence < 1.0:
        raise ModelError(f"fit: confidence is {confidence:g}, it must lie between 0 and 1")
    kind = _analysis(system, analysis)
    names, low, high = _unknowns(system, by)
    held = {given: float(low[k]) for k, given in enumerate(names) if low[k] == high[k]}
    given_units = {given: unit_of(system.mechanism, name) for given, name in names.items()}
    if held:
        system = system.with_values({names[given]: value for given, value in held.items()})
        names = {given: name for given, name in names.items() if given not in held}
        low, high = low[low < high], high[low < high]
    if not names:
        raise ModelError(
            f"fit: equal bounds hold {listed(held)}, and nothing is left to find: give one a range"
        )
    series = series_of(system, data, kind == "simulate")
    problem = FitProblem(system, series, names, kind, offsets, options)
    unknowns = len(names) + len(problem.shifts)
    if problem.count < unknowns:
        raise ModelError(
            f"fit: {problem.count} data cannot determine {unknowns} "
            f"{'unknown' if unknowns == 1 else 'unknowns'}: measure more, or look for fewer"
        )
    endless = np.full(len(problem.shifts), np.inf)
    bounds = np.concatenate([low, -endless]), np.concatenate([high, endless])
    shifts = {key: problem.units[column] for key, (_, column) in problem.shifts.items()}
    units = {given: given_units[given] for given in names} | shifts
    best = best_numbers(problem, units, bounds, deviations)
    return _result(problem, given_units | shifts, best, bounds, held, confidence)


# -- the question ------------------------------------------------------------------------------


def _analysis(system: System, given: str | None) -> str:
    if given is None:
        return "kinetostatics" if system.rows >= system.coordinates else "simulate"
    if given not in (*ANALYSES, "simulate"):
        raise ModelError(
            f"fit: there is no analysis {brief(given)} (there are: "
            f"{listed([*ANALYSES, 'simulate'])})"
        )
    return given


def _unknowns(system: System, by: Any) -> tuple[dict[str, str], Array, Array]:
    """Dotted names by given ones, and their bounds."""
    names = checked_names(system, list(by) if isinstance(by, Mapping) else by, "fit")
    if by is None:
        raise ModelError('fit: name the unknown numbers, such as by=["crank.A.x"]')
    low = np.array([0.0 if system.rule(name)[0] else -np.inf for name in names.values()])
    high, machine = np.full(len(names), np.inf), system.mechanism
    for k, given in enumerate(names):
        bounds = by[given] if isinstance(by, Mapping) else None
        if bounds is None:
            continue
        dimension, scope = dimension_named(machine, names[given]), machine.parameters.scope()
        low[k], high[k] = range_given(
            bounds, dimension, scope, "fit", given, equal=True, endless=True
        )
        if low[k] < high[k] and system.rule(names[given])[0]:
            low[k] = max(low[k], 0.0)
        value = float(system.values[names[given]])
        unit = unit_of(machine, names[given])
        if not low[k] <= value <= high[k] and low[k] != high[k]:
            raise ModelError(
                f"fit: '{given}' begins at {value:g} {unit}, which is not between its bounds "
                f"{low[k]:g} and {high[k]:g}: give low, then high, about the number of the model",
                given,
            )
    return names, low, high


# -- the answer -----------------------------------------------------------------------------


def _result(
    problem: FitProblem,
    units: dict[str, str],
    best: BestNumbers,
    bounds: Bounds,
    held: Mapping[str, float],
    confidence: float,
) -> Fit:
    """`units`: of the unknowns and of what is held, in the order of the answer."""
    from scipy.special import stdtrit

    numbers, known, keys = best.numbers, best.known, list(best.units)
    residual = problem.residual(numbers, best.sigma)
    free = problem.count - known.rank
    # what the sum of squares would be without the bounds that are in the way
    move = best.pulled
    least = float(residual @ residual)
    if move.any():
        least -= float(np.square(problem.jacobian(numbers, best.sigma) @ move).sum())
    # without a degree of freedom nothing is known of the errors
    square = max(least, 0.0) / free if free else math.inf
    quantile = float(stdtrit(free, 0.5 * (1.0 + confidence))) if free else math.inf
    plain = known.inverse * square if free else np.full_like(known.inverse, np.inf)
    undetermined, open_ones = known.undetermined, known.open
    found: tuple[Combination, ...] = ()
    if len(known.null):
        family = followed(problem, numbers, best.sigma, known, bounds)
        open_ones = known.open | family.varied()
        found = combinations(problem, known, family, keys, numbers, plain, quantile, move)
        undetermined = tuple(
            replace(one, sentence=one.sentence + family.words(n))
            for n, one in enumerate(undetermined)
        )
    deviation = np.where(open_ones, np.inf, np.sqrt(np.diag(plain)))
    wide = np.where(np.isfinite(deviation), quantile * deviation, np.inf) if free else deviation
    ends = np.array([numbers + move - wide, numbers + move + wide])
    inside = np.clip(ends, *bounds)
    # what bounds exclude cannot be, unless the data contradict them
    ends = np.where((inside[0] < inside[1]) & ~open_ones, inside, ends)
    place = {key: k for k, key in enumerate(keys)}
    rows = [place[key] for key in units if key in place]
    covariance = np.where(open_ones[:, None] | open_ones[None, :], np.nan, plain)
    np.fill_diagonal(covariance, np.where(open_ones, np.inf, np.diag(plain)))
    whole = np.zeros((len(units), len(units)))
    among = [n for n, key in enumerate(units) if key in place]
    whole[np.ix_(among, among)] = covariance[np.ix_(rows, rows)]
    squares, counts = problem.sizes(numbers)
    values = {**held, **{key: float(numbers[k]) for key, k in place.items()}}
    shifts = problem.shifts
    own = () if best.settled else (Doubt("solver", UNSETTLED),)
    notes = [f"not determined: {one}" for one in undetermined]
    notes += _notes(problem, best, bounds, deviation)
    runs, measures = problem.results(numbers), problem.series[0].measures.values()
    of_runs = inherited(*runs, of=measures, notes=notes)
    heads = inherited(Inherited(doubts=own), *runs, notes=of_runs["notes"])
    return Fit(
        model=problem.system.mechanism.name,
        values={key: values[key] for key in units if key not in shifts},
        units=units,
        offsets={key: values[key] for key in shifts},
        covariance=whole,
        deviations={key: float(deviation[place[key]]) if key in place else 0.0 for key in units},
        intervals={
            key: (float(ends[0, place[key]]), float(ends[1, place[key]]))
            if key in place
            else (held[key], held[key])
            for key in units
        },
        confidence=confidence,
        undetermined=undetermined,
        combinations=found,
        residual={
            name: float(np.sqrt(s / c)) if c else math.nan
            for name, s, c in zip(problem.columns, squares, counts, strict=True)
        },
        residuals=tuple(
            dict(zip(problem.columns, left, strict=True)) for left in problem.histories(numbers)
        ),
        data_units=problem.units,
        count=problem.count,
        evaluations=problem.evaluations,
        system=problem.system.with_values(
            {name: float(numbers[k]) for k, name in enumerate(problem.names)}
        ),
        **heads,
    )


def _notes(
    problem: FitProblem, best: BestNumbers, bounds: Bounds, deviation: Array
) -> Iterator[str]:
    """Notes on the fitted values: differencing, bounds met, residuals that are no noise."""
    if not problem.exact:
        yield DIFFERENCED
    if problem.count == best.known.rank:
        yield "there are as many unknowns as data: nothing is left to judge errors by"
    numbers, sizes = best.numbers, problem.number_sizes(best.numbers)
    others = best.searches.done
    tried = f", from {others} other starts too" if others else ""
    if best.searches.stopped:
        yield best.searches.stopped
    beyond = False
    for k, (key, low, high) in enumerate(zip(best.units, *bounds, strict=True)):
        bound = low if numbers[k] - low < high - numbers[k] else high
        lead, unit = numbers[k] + best.pulled[k], best.units[key]
        at = abs(numbers[k] - bound) <= tol.FIT_BOUND_NEAR * sizes[k]
        if not at or (lead == numbers[k] and not math.isfinite(deviation[k])):
            continue
        said = f"'{key}' is at its bound" + (tried if best.pulled.any() else "")
        if best.pulled.any() and not low <= lead <= high and math.isfinite(deviation[k]):
            off = abs(lead - bound) / deviation[k] if deviation[k] else math.inf
            beyond |= off > tol.FIT_BOUND_CHANCE
            said += f": data lead to {number(lead)} ± {number(deviation[k])} {unit}".rstrip()
            said += f" beyond {number(bound)}: {number(off)} deviations"
        yield said
    for name, shared in correlations(problem, numbers).items():
        yield (
            f"what is left of '{name}' is no noise, each residual has {shared:.2f} of the one "
            f"before{tried}: {'a bound is wrong, or ' if beyond else ''}the model lacks something, "
            "and the intervals are too narrow"
        )
