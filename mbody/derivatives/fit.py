"""Numbers of a mechanism from measured histories, by least squares."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from mbody.analysis.driven.driven import ANALYSES
from mbody.analysis.position.assembly_analysis import as_system
from mbody.core import tolerances as tol
from mbody.derivatives.fit_problem import FitProblem, series_of
from mbody.derivatives.named_numbers import checked_names, unit_of
from mbody.errors import ModelError, SolveError, brief
from mbody.model.element import listed
from mbody.model.mechanism import Mechanism
from mbody.model.numbers import dimension_named, number_in
from mbody.quantities.types import Number
from mbody.quantities.units import NUMBER
from mbody.solution.doubts import Doubt, Inherited, inherited
from mbody.summaries.text_table import Column, number, paragraph, table
from mbody.system.read_only import lock
from mbody.system.system import System

# -- Identifiable combinations of the unknowns -------------------------------------------------

Array = np.ndarray


@dataclass(frozen=True)
class OpenDirection:
    """A change of unknowns that changes no datum.

    Attributes
    ----------
    direction : dict
        By unknown how much it changes, the first by 1.
    sentence : str
    """

    direction: dict[str, float]
    sentence: str

    def __str__(self) -> str:
        return self.sentence


@dataclass(frozen=True)
class Combination:
    """A sum of unknowns that the data determine, where they do not determine each of them.

    Attributes
    ----------
    terms : dict
        By unknown its factor.
    value, deviation : float
    """

    terms: dict[str, float]
    value: float
    deviation: float

    def __str__(self) -> str:
        return _sum(self.terms)

    def rounded(self, values: Mapping[str, float]) -> float:
        """Its value, 0 where it is rounding beside the parts of the sum."""
        greatest = max(abs(factor * values[name]) for name, factor in self.terms.items())
        return 0.0 if abs(self.value) <= tol.FIT_DIRECTION_NONE * greatest else self.value


@dataclass(frozen=True, eq=False)
class Identified:
    """Identifiability of the unknowns: rank, covariance factor and undetermined directions.

    `rank`: How many combinations are determined.
    `inverse` (unknowns, unknowns): (JᵀJ)⁻¹, of the determined combinations alone where some are
      not.
    `open` (unknowns,): Which take part in a direction that is not determined.
    `pivots`: Unknowns that leave nothing open if they are held, one of each direction.
    `terms`: Combinations that are determined, of those that take part.
    """

    rank: int
    inverse: Array
    open: Array
    pivots: tuple[int, ...]
    undetermined: tuple[OpenDirection, ...]
    terms: tuple[dict[str, float], ...]


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
    for row, pivot in zip(null, pivots, strict=True):
        row = row / row[pivot]
        parts = {names[pivot]: 1.0} | {
            names[k]: float(row[k]) for k in np.flatnonzero(row).tolist() if k != pivot
        }
        found.append(OpenDirection(parts, _said(parts, units)))
    terms = []
    for k in np.flatnonzero(open_ones).tolist():
        if k not in pivots:
            others = {
                names[p]: -float(row[k] / row[p]) for p, row in zip(pivots, null, strict=True)
            }
            terms.append({names[k]: 1.0} | {n: f for n, f in others.items() if f})
    return Identified(rank, inverse, open_ones, tuple(pivots), tuple(found), tuple(terms))


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


# -- Fitted numbers, with their errors ---------------------------------------------------------


@dataclass(frozen=True, eq=False, repr=False)
class Fit(Inherited):
    """Numbers that fit measured histories best.

    Attributes
    ----------
    values, units : dict
        By the names of `by`.
    offsets : dict
        Unknown constants of columns, by ``"slider.x offset"``, of several runs by ``"slider.x
        offset, run 2"``.
    covariance : array (unknowns, unknowns)
        s² (JᵀJ)⁻¹ of values, then offsets; infinite variances of what is not determined, NaN
        beside them.
    deviations, intervals : dict
        Standard deviation, and (low, high) of the confidence, by unknown and offset; infinite where
        the data do not determine it.
    confidence : float
    undetermined : tuple of OpenDirection
        Changes of unknowns that change no datum; ``str`` says them.
    combinations : tuple of Combination
        Sums of those unknowns that the data do determine.
    residual : dict
        By column the root of the mean square of data less fit, in its unit.
    residuals : tuple of dict
        Of every run, by column, data less fit: arrays (instants,), NaN where nothing was measured.
    data, evaluations : int
        Data that were used, and analyses of each run.
    system : System
        With the values.
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

    def __post_init__(self) -> None:
        lock(self)

    def __getitem__(self, name: str) -> float:
        """The value of one number."""
        if name not in self.values:
            raise ModelError(
                f"the fit has no number {name!r} (there are: {listed(self.values)})", str(name)
            )
        return self.values[name]

    def data(self) -> dict[str, Any]:
        """Plain values of the result, ready for JSON; None for infinite values and NaN."""

        def finite(value: float) -> float | None:
            return float(value) if np.isfinite(value) else None

        return {
            "values": dict(self.values),
            "units": dict(self.units),
            "offsets": dict(self.offsets),
            "deviations": {k: finite(v) for k, v in self.deviations.items()},
            "intervals": {k: [finite(v) for v in pair] for k, pair in self.intervals.items()},
            "confidence": self.confidence,
            "covariance": [[finite(v) for v in row] for row in self.covariance],
            "undetermined": [
                {"direction": dict(one.direction), "sentence": one.sentence}
                for one in self.undetermined
            ],
            "combinations": [
                {"terms": dict(c.terms), "value": c.value, "deviation": finite(c.deviation)}
                for c in self.combinations
            ],
            "residual": dict(self.residual),
            "count": self.count,
            "evaluations": self.evaluations,
        }

    def __str__(self) -> str:
        whole = {**self.values, **self.offsets}
        keys = list(whole)
        units = [self.units[key] for key in keys]
        known = [np.isfinite(self.deviations[key]) for key in keys]

        def cells(values: list[float]) -> list[str]:
            return [number(v) if k else "open" for v, k in zip(values, known, strict=True)]

        rows = table(
            [
                Column("NUMBERS", keys, text=True),
                Column("value", [number(whole[key]) for key in keys]),
                Column("deviation", cells([self.deviations[key] for key in keys])),
                Column("low", cells([self.intervals[key][0] for key in keys])),
                Column("high", cells([self.intervals[key][1] for key in keys])),
                Column("unit", units, text=True),
            ]
        )
        combinations = table(
            [
                Column("DATA", list(self.residual), text=True),
                Column("residual", [number(value) for value in self.residual.values()]),
                Column("unit", [self.data_units[name] for name in self.residual], text=True),
            ]
        )
        head = f"{self.count} data; low and high of {100.0 * self.confidence:g} % confidence"
        lines = [self.model, "", *rows, "", *combinations, "", head]
        lines += [f"determined: {one} = {number(one.rounded(whole))}" for one in self.combinations]
        return "\n".join(
            [*lines, *(line for note in self.notes for line in paragraph(f"note: {note}"))]
        )

    def __repr__(self) -> str:
        parts = (f"{name} = {value:.6g}" for name, value in self.values.items())
        return f"Fit({', '.join(parts)})"


#: Where a singular value is zero: exact derivatives, and differences.
ZERO = {True: tol.FIT_SINGULAR_VALUE, False: tol.FIT_SINGULAR_VALUE_DIFFERENCES}
#: Passes that find the deviations of several columns from their residuals.
PASSES = 12
#: How often what is held is chosen anew.
CHOICES = 4


@dataclass(frozen=True, eq=False)
class BestNumbers:
    """The least sum of squares.

    `numbers` (unknowns,): Values, then offsets.
    `sigma` (columns,): Deviations of the columns by which residuals are divided.
    `known`: What the data determine, by the derivatives there.
    """

    numbers: Array
    sigma: Array
    known: Identified
    settled: bool


def best_numbers(
    problem: FitProblem,
    units: Mapping[str, str],
    bounds: tuple[Array, Array],
    deviations: Mapping[str, float] | None,
) -> BestNumbers:
    """The best numbers. Where data leave directions open, one unknown of each is held as it is."""
    search = _ResidualSearch(problem, units, bounds)
    given = _deviations(problem, deviations)
    sigma = problem.ranges() if given is None else given
    numbers = np.concatenate([problem.start, np.zeros(len(problem.shifts))])
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
    return BestNumbers(numbers, sigma, known, search.settled)


class _ResidualSearch:
    """Least squares of one problem with different deviations of its columns."""

    def __init__(
        self, problem: FitProblem, units: Mapping[str, str], bounds: tuple[Array, Array]
    ) -> None:
        self.problem, self.units, self.bounds = problem, units, bounds
        self.settled = True

    def best(self, start: Array, sigma: Array) -> tuple[Array, Identified]:
        """The least from a start, and what is known there."""
        numbers, known = start, self._known(start, sigma)
        for _ in range(CHOICES):
            fixed = list(known.pivots)
            free = np.array([k for k in range(len(start)) if k not in fixed], dtype=int)
            if not len(free):
                raise ModelError(
                    f"fit: none of {listed(self.units)} changes any of the data: measure others"
                )
            numbers = self._least(numbers, sigma, free)
            known = self._known(numbers, sigma)
            if known.rank <= len(free):
                break
        return numbers, known

    def _known(self, numbers: Array, sigma: Array) -> Identified:
        system = self.problem.system
        first = np.concatenate([self.problem.start, np.zeros(len(self.problem.shifts))])
        sizes = np.maximum(np.abs(numbers), np.abs(first))
        sizes = np.where(sizes > 0.0, sizes, 1.0)
        lengths = np.array([unit == system.mechanism.units.length for unit in self.units.values()])
        sizes = np.where(lengths, np.maximum(sizes, system.length), sizes)
        jacobian = self.problem.jacobian(numbers, sigma)
        return identified(jacobian, list(self.units), self.units, sizes, ZERO[self.problem.exact])

    def _least(self, start: Array, sigma: Array, free: Array) -> Array:
        """The least by some of the unknowns, the others as they are."""
        from scipy.optimize import least_squares

        problem, bounds = self.problem, (self.bounds[0][free], self.bounds[1][free])
        # by what they change, so that no unit has a say in when the gradient is small
        effect = np.linalg.norm(problem.jacobian(start, sigma)[:, free], axis=0)
        unit = 1.0 / np.where(effect > 0.0, effect, 1.0)

        def whole(part: Array) -> Array:
            numbers = start.copy()
            numbers[free] = np.clip(unit * part, *bounds)
            return numbers

        def residual(part: Array) -> Array:
            try:
                return problem.residual(whole(part), sigma)
            except (SolveError, ModelError):
                # a design that does not close: the step becomes shorter
                return np.full(problem.count, np.inf)

        found = least_squares(
            residual,
            np.clip(start[free] / unit, bounds[0] / unit, bounds[1] / unit),
            lambda part: unit * problem.jacobian(whole(part), sigma)[:, free],
            bounds=(bounds[0] / unit, bounds[1] / unit),
            x_scale="jac",
            **{
                "ftol": tol.FIT_ENDS,
                "xtol": tol.FIT_ENDS,
                "gtol": tol.FIT_ENDS_GRADIENT,
                "max_nfev": 200,
            },
        )
        self.settled = bool(found.status != 0)
        return whole(found.x)


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
        The unknown numbers, as of `gradient`; or each with its bounds (low, high). Masses,
        stiffnesses and others that cannot be negative are bounded by 0.
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
    Σ ((d − m(p))/σ)² is made least by a method of Gauss and Newton with trust region and exact
    derivatives of the histories (`gradient`); where a free motion has none, as with impacts, these
    are central differences, which a note says. Covariance s² (JᵀJ)⁻¹ with s² the sum by its degrees
    of freedom; intervals by Student's distribution. They hold for independent noise; where a
    residual is correlated with the next one a note says so. What changes no datum is the null space
    of J; the sums of unknowns that are determined are the base parameters.

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
    if system.batch is not None:
        raise ModelError("fit takes one design: choose one of the batch with design(n)")
    if not 0.0 < confidence < 1.0:
        raise ModelError(f"fit: confidence is {confidence:g}, it must lie between 0 and 1")
    kind = _analysis(system, analysis)
    names, low, high = _unknowns(system, by)
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
    units = {given: unit_of(system.mechanism, name) for given, name in names.items()}
    units |= {key: problem.units[column] for key, (_, column) in problem.shifts.items()}
    best = best_numbers(problem, units, bounds, deviations)
    notes = _notes(problem, best, list(units), bounds)
    return _result(problem, names, units, best, confidence, notes)


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
    high = np.full(len(names), np.inf)
    for k, given in enumerate(names):
        bounds = by[given] if isinstance(by, Mapping) else None
        if bounds is None:
            continue
        if not isinstance(bounds, tuple | list) or len(bounds) != 2:
            raise ModelError(
                f"fit: bounds of '{given}' are a pair (low, high), not {brief(bounds)}", given
            )
        dimension = dimension_named(system.mechanism, names[given]) or NUMBER
        low[k], high[k] = (
            one if isinstance(one, float) and math.isinf(one) else
            number_in(system.mechanism, one, dimension, given, "bound") for one in bounds
        )  # fmt: skip
        value = float(system.values[names[given]])
        unit = unit_of(system.mechanism, names[given])
        if not low[k] <= value <= high[k] or low[k] == high[k]:
            raise ModelError(
                f"fit: '{given}' begins at {value:g} {unit}, which is not between its bounds "
                f"{low[k]:g} and {high[k]:g}: give low, then high, about the number of the model",
                given,
            )
    return names, low, high


# -- the answer -----------------------------------------------------------------------------


def _result(
    problem: FitProblem,
    names: Mapping[str, str],
    units: dict[str, str],
    best: BestNumbers,
    confidence: float,
    notes: Sequence[str],
) -> Fit:
    from scipy.special import stdtrit

    numbers, known, keys = best.numbers, best.known, list(units)
    residual = problem.residual(numbers, best.sigma)
    free = problem.count - known.rank
    # without a degree of freedom nothing is known of the errors
    square = float(residual @ residual) / free if free else math.inf
    quantile = float(stdtrit(free, 0.5 * (1.0 + confidence))) if free else math.inf
    plain = known.inverse * square if free else np.full_like(known.inverse, np.inf)
    covariance = np.where(known.open[:, None] | known.open[None, :], np.nan, plain)
    np.fill_diagonal(covariance, np.where(known.open, np.inf, np.diag(plain)))
    deviation = np.sqrt(np.diag(covariance))
    wide = np.where(np.isfinite(deviation), quantile * deviation, np.inf) if free else deviation
    place = {key: k for k, key in enumerate(keys)}
    combinations = []
    for terms in known.terms:
        row = np.zeros(len(keys))
        row[[place[name] for name in terms]] = list(terms.values())
        variance = float(row @ plain @ row) if free else math.inf
        combinations.append(Combination(terms, float(row @ numbers), math.sqrt(variance)))
    squares, counts = problem.sizes(numbers)
    values = {given: float(numbers[k]) for k, given in enumerate(names)}
    own = () if best.settled else (Doubt("solver", UNSETTLED),)
    runs, measures = problem.results(numbers), problem.series[0].measures.values()
    of_runs = inherited(*runs, of=measures, notes=notes)
    heads = inherited(Inherited(doubts=own), *runs, notes=of_runs["notes"])
    return Fit(
        model=problem.system.mechanism.name,
        values=values,
        units=units,
        offsets={key: float(numbers[place[key]]) for key in problem.shifts},
        covariance=covariance,
        deviations={key: float(deviation[k]) for key, k in place.items()},
        intervals={
            key: (float(numbers[k] - wide[k]), float(numbers[k] + wide[k]))
            for key, k in place.items()
        },
        confidence=confidence,
        undetermined=known.undetermined,
        combinations=tuple(combinations),
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
        system=problem.system.with_values({names[given]: v for given, v in values.items()}),
        **heads,
    )


def _notes(
    problem: FitProblem, best: BestNumbers, keys: Sequence[str], bounds: tuple[Array, Array]
) -> list[str]:
    """Notes on the fitted values: undetermined directions, bounds met, differencing."""
    numbers, known = best.numbers, best.known
    notes = [f"not determined: {one}" for one in known.undetermined]
    if not problem.exact:
        notes.append(DIFFERENCED)
    if problem.count == known.rank:
        notes.append("there are as many unknowns as data: nothing is left to judge errors by")
    for key, value, low, high in zip(keys, numbers, *bounds, strict=True):
        if min(value - low, high - value) <= tol.BOUND_AT * (abs(value) or 1.0):
            notes.append(f"'{key}' is at its bound: its interval is that of no bound")
    lefts = problem.histories(numbers)
    for k, (name, size) in enumerate(zip(problem.columns, problem.ranges(), strict=True)):
        rows = [left[k][mask[k]] for left, mask in zip(lefts, problem.masks, strict=True)]
        count, whole = sum(map(len, rows)), sum(float(row @ row) for row in rows)
        if count < FEW or whole <= count * (tol.FIT_RESIDUAL_ROUNDING * size) ** 2:
            continue
        shared = sum(float(row[1:] @ row[:-1]) for row in rows) / whole
        if abs(shared) * math.sqrt(count) > tol.FIT_CORRELATION_CHANCE:
            notes.append(
                f"what is left of '{name}' is no noise, each residual has {shared:.2f} of the one "
                "before: the model lacks something, and the intervals are too narrow"
            )
    return notes
