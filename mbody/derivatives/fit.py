"""Numbers of a mechanism from measured histories, by least squares."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from mbody.analysis.driven.requests import ANALYSES
from mbody.analysis.position.assembly_analysis import as_system
from mbody.derivatives.data_series import series_of
from mbody.derivatives.fit_problem import FitProblem
from mbody.derivatives.fitted import Fit
from mbody.derivatives.identifiability import Combination
from mbody.derivatives.least_residuals import BestNumbers, best_numbers
from mbody.derivatives.named_numbers import checked_names, unit_of
from mbody.errors import ModelError, brief
from mbody.model.element import listed
from mbody.model.mechanism import Mechanism
from mbody.model.numbers import dimension_named, number_in
from mbody.quantities.types import Number
from mbody.quantities.units import NUMBER
from mbody.solution.doubts import Doubt, Inherited, inherited
from mbody.system.system import System

__all__ = ["fit"]

Array = np.ndarray

UNSETTLED = (
    "the least squares have not settled after 200 analyses: begin nearer, or look for fewer numbers"
)
DIFFERENCED = (
    "derivatives of this motion are differences of simulate: deviations have some 5 figures"
)
#: A value that is this near to its bound, as a part, is at it.
AT_BOUND = 1e-9
#: Residuals below this part of the greatest datum are rounding, and fewer are not judged.
ROUNDING, FEW = 1e-9, 20
#: Standard errors of the correlation of a residual with the next one that are no chance.
CHANCE = 4.0


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


# -- what is asked -----------------------------------------------------------------------------


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
    reach = float(stdtrit(free, 0.5 * (1.0 + confidence))) if free else math.inf
    plain = known.inverse * square if free else np.full_like(known.inverse, np.inf)
    covariance = np.where(known.open[:, None] | known.open[None, :], np.nan, plain)
    np.fill_diagonal(covariance, np.where(known.open, np.inf, np.diag(plain)))
    deviation = np.sqrt(np.diag(covariance))
    wide = np.where(np.isfinite(deviation), reach * deviation, np.inf) if free else deviation
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
    heads = inherited(Inherited(doubts=own), *problem.results(numbers), notes=notes)
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
    """What is to be said of the answer."""
    numbers, known = best.numbers, best.known
    notes = [f"not determined: {one}" for one in known.undetermined]
    if not problem.exact:
        notes.append(DIFFERENCED)
    if problem.count == known.rank:
        notes.append("there are as many unknowns as data: nothing is left to judge errors by")
    for key, value, low, high in zip(keys, numbers, *bounds, strict=True):
        if min(value - low, high - value) <= AT_BOUND * (abs(value) or 1.0):
            notes.append(f"'{key}' is at its bound: its interval is that of no bound")
    lefts = problem.histories(numbers)
    for k, (name, size) in enumerate(zip(problem.columns, problem.ranges(), strict=True)):
        rows = [left[k][mask[k]] for left, mask in zip(lefts, problem.masks, strict=True)]
        count, whole = sum(map(len, rows)), sum(float(row @ row) for row in rows)
        if count < FEW or whole <= count * (ROUNDING * size) ** 2:
            continue
        shared = sum(float(row[1:] @ row[:-1]) for row in rows) / whole
        if abs(shared) * math.sqrt(count) > CHANCE:
            notes.append(
                f"what is left of '{name}' is no noise, each residual has {shared:.2f} of the one "
                "before: the model lacks something, and the intervals are too narrow"
            )
    return notes
