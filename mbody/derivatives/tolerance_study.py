"""Bands of a measured quantity whose numbers scatter, by derivatives and by random designs."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from mbody.analysis.position.assembly_analysis import as_system
from mbody.derivatives.gradient import gradient
from mbody.derivatives.gradient_result import Gradient
from mbody.derivatives.named_numbers import checked_names, unit_of
from mbody.derivatives.tolerance_allocation import Allocation, allocated, limits
from mbody.derivatives.tolerance_bands import ToleranceBand, first_order, of_samples, second_order
from mbody.errors import ModelError, SolveError, brief
from mbody.model.mechanism import Mechanism
from mbody.model.study import Measure
from mbody.quantities.types import Number
from mbody.sheets.text_table import Column, number, paragraph, table
from mbody.sweeps.columns import MeasureLike, columns_of
from mbody.sweeps.run import sweep
from mbody.sweeps.samples import monte_carlo, scatter_of
from mbody.sweeps.tolerances import SIGMAS, Normal, Scatter
from mbody.system.system import System

__all__ = ["Contribution", "ToleranceStudy", "tolerances"]

NO_SECOND = "there is no second order: a design one deviation away fails: "
#: By name ± of a normal distribution, or a distribution, or (low, high) of a uniform one.
Scatters = Mapping[str, "Number | Scatter | tuple[Number, Number]"]


@dataclass(frozen=True)
class Contribution:
    """What one number does to the quantity.

    Attributes
    ----------
    tolerance : float
        ± of the number: three standard deviations of a normal distribution, else the half width.
    derivative : float
    unit : str
        Of the tolerance.
    share : float
        Of the variance to first order; all add up to 1.
    worst : float
        What the whole tolerance does, |derivative| · tolerance.
    """

    tolerance: float
    derivative: float
    unit: str
    share: float
    worst: float


@dataclass(frozen=True, repr=False)
class ToleranceStudy:
    """Bands of a measured quantity.

    Attributes
    ----------
    measure, unit : str
    value : float
        With every number at its mean.
    first, second, monte_carlo : ToleranceBand or None
        By the derivatives, by the second derivatives too, and by random designs; None where designs
        do not close, or without random designs.
    worst_case : tuple of float
        The least and greatest value if all numbers are at the ends of their tolerances, to first
        order; ± three standard deviations of normal ones.
    contributions : dict of Contribution
        By number, the greatest first.
    allocation : Allocation or None
        The loosest tolerances that keep the quantity in its band, where one was given.
    failures : int
        Random designs that could not be analysed.
    notes : tuple of str
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
    notes: tuple[str, ...] = field(default=())

    def data(self) -> dict[str, Any]:
        """As plain values, ready for JSON."""
        bands = {"first": self.first, "second": self.second, "monte_carlo": self.monte_carlo}
        return {
            "measure": self.measure,
            "unit": self.unit,
            "value": self.value,
            **{name: None if band is None else vars(band) for name, band in bands.items()},
            "worst_case": list(self.worst_case),
            "contributions": {name: dict(vars(one)) for name, one in self.contributions.items()},
            "allocation": None if self.allocation is None else self.allocation.data(),
            "failures": self.failures,
        }

    def __str__(self) -> str:
        rows = {"first order": self.first, "second order": self.second}
        if self.monte_carlo is not None:
            rows[f"{self.monte_carlo.count} random designs"] = self.monte_carlo
        bands = {name: band for name, band in rows.items() if band is not None}
        cells = {
            key: [number(getattr(band, key)) for band in bands.values()]
            for key in ("mean", "deviation", "low", "high")
        }
        low, high = self.worst_case
        worst = {"mean": "", "deviation": "", "low": number(low), "high": number(high)}
        names = [*bands, "worst case"]
        columns = [Column("BAND", names, text=True)]
        columns += [Column(key, [*column, worst[key]]) for key, column in cells.items()]
        parts = list(self.contributions.values())
        causes = [
            Column("CONTRIBUTIONS", list(self.contributions), text=True),
            Column("±", [number(one.tolerance) for one in parts]),
            Column("unit", [one.unit for one in parts], text=True),
            Column("derivative", [number(one.derivative) for one in parts]),
            Column("% of variance", [f"{100.0 * one.share:.1f}" for one in parts]),
        ]
        head = f"{self.measure} = {self.value:.6g} {self.unit}".rstrip()
        lines = [self.model, "", head, "", *table(columns), "", *table(causes)]
        if self.allocation is not None:
            lines += ["", *self.allocation.lines()]
        if self.failures:
            lines += ["", f"{self.failures} random designs could not be analysed"]
        return "\n".join(
            [*lines, *(line for note in self.notes for line in paragraph(f"note: {note}"))]
        )

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
    if system.batch is not None:
        raise ModelError("tolerances takes one design: choose one of the batch with design(n)")
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
        _refuse_below_zero(system, names[key], middle, _reach(how, width))
    centre = system.with_values({names[key]: middle for key, (_, middle, _) in spreads.items()})
    by = list(names.values())
    sigma = np.array([how.deviation_of(width) for how, _, width in spreads.values()])
    excess = np.array([how.excess for how, _, _ in spreads.values()])

    def slopes(of: System) -> Gradient:
        return gradient(of, {name: measure}, by, analysis, **options)

    found = slopes(centre)
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
        curvature = _curvature(centre, by, sigma, slopes)
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
    ends = {key: _reach(how, width) for key, (how, _, width) in spreads.items()}
    whole = float(np.abs(row) @ np.array(list(ends.values())))
    allocation = None
    if within is not None:
        band = limits(system, name, found.measured[name], within, value)
        allocation = allocated(system, names, spreads, row, value, band, cost)
        allocation = _proven(allocation, centre, measure, name, analysis, count, seed, options)
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
        notes=tuple(notes),
    )


def _reach(how: Scatter, width: float) -> float:
    """± of a number: three standard deviations of a normal distribution, else the half width."""
    return SIGMAS * how.deviation_of(width) if isinstance(how, Normal) else width


def _refuse_below_zero(system: System, name: str, middle: float, reach: float) -> None:
    """Refuse a tolerance that leads to a number that must not be."""
    if not system.rule(name)[0] or reach <= middle:
        return
    unit = unit_of(system.mechanism, name)
    raise ModelError(
        f"tolerances: '{name}' is {middle:g} ± {reach:g} {unit}".rstrip()
        + ", and it must not be negative: give it a tolerance below its mean",
        name,
    )


def _curvature(centre: System, by: list[str], sigma: np.ndarray, slopes: Any) -> np.ndarray:
    """Second derivatives by differences of exact gradients, over the width of the scatter."""
    rows = np.zeros((len(by), len(by)))
    for k, (name, step) in enumerate(zip(by, sigma, strict=True)):
        if step == 0.0:
            continue
        here = float(centre.values[name])
        ahead, behind = (
            slopes(centre.with_values({name: here + sign * step})).jacobian[0]
            for sign in (1.0, -1.0)
        )
        rows[k] = (ahead - behind) / (2.0 * step)
    used = np.outer(sigma > 0.0, sigma > 0.0)
    return np.where(used, 0.5 * (rows + rows.T), 0.0)


def _proven(
    allocation: Allocation,
    centre: System,
    measure: MeasureLike,
    name: str,
    analysis: str,
    count: int,
    seed: int,
    options: Mapping[str, Any],
) -> Allocation:
    """The allocation with the share of random designs that it keeps in the band."""
    if not count:
        return allocation
    loose = allocation.scatter()
    column = sweep(centre, monte_carlo(loose, count, seed), analysis, {name: measure}, **options)[
        name
    ]
    inside = (column >= allocation.low) & (column <= allocation.high)
    return allocation.tried(float(inside.mean()), count)
