"""Quantities over the cycle: one panel for each unit, above a common axis."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from mbody.errors import ModelError
from mbody.model.driver import AngleDriver
from mbody.quantities.units import DIMENSIONS, Dimension, name_of
from mbody.sheets.text_table import cut
from mbody.solution.checks import one_design
from mbody.solution.measures import found_by, measured
from mbody.views.backend import blank, styled
from mbody.views.labels import extent
from mbody.views.style import CURVES, INK, PAPER, SIZE, SOFT

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from mbody.solution.solution import Solution

__all__ = ["plot"]

Array = np.ndarray

#: Inches: the width of the axes, the height of one panel and of each of several, gaps and margins.
WIDE, ALONE, STACKED = 5.0, 2.9, 1.75
LEFT, BELOW, ABOVE, BETWEEN, RIGHT = 0.85, 0.55, 0.62, 0.22, 0.2


@dataclass(frozen=True)
class PlottedCurve:
    """One quantity: its name, history, dimension and unit."""

    name: str
    values: Array
    dimension: Dimension
    unit: str


def plot(run: Solution, *quantities: str) -> Figure:
    """Quantities over the angle of the driver in degrees, or over time: diagrams of a cycle.

    Quantities of one unit share a panel, in which each has its name at its right end; panels are
    stacked above one axis.

    Parameters
    ----------
    run : Solution
        Of one design, with several instants.
    *quantities : str
        Names of the mechanism's measures, or formulas of histories such as ``"motor.effort"``,
        ``"B.force"``, ``"coupler.P.y"``; by default all measures, else all efforts.

    Returns
    -------
    matplotlib.figure.Figure
        Every axis names its quantity and unit; angles are in degrees where no unit is given.

    Raises
    ------
    ModelError
        For an unknown quantity, a result of one instant, a batch, or without matplotlib.

    Notes
    -----
    The axis is the angle where one driver of an angle turns all the time in one sense and no other
    driver moves; else it is time, or the number of the instant where the time is constant.

    Examples
    --------
    >>> import mbody
    >>> run = mbody.kinetostatics(mbody.makers.four_bar(1, 3, 2, 3.5, speed=10.0), turn=True)
    >>> axes = mbody.plot(run, "motor.effort", "rocker.angle").axes
    >>> [panel.get_ylabel() for panel in axes], axes[1].get_xlabel()
    (['motor.effort [N·m]', 'rocker.angle [deg]'], 'angle of crank [deg]')
    """
    one_design(run, "a picture is of one design")
    if len(run) < 2:
        raise ModelError(
            "a plot needs several instants, this result has 1: analyse a turn (turn=True), or times"
        )
    curves = [_curve(run, name) for name in quantities or _all(run)]
    panels: dict[str, list[PlottedCurve]] = {}
    for curve in curves:
        panels.setdefault(curve.unit, []).append(curve)
    x, label, turns = _abscissa(run)
    with styled():
        return _figure(run, list(panels.values()), x, label, turns)


def _all(run: Solution) -> list[str]:
    """The default quantities."""
    machine = run.mechanism
    names = [name for name, measure in machine.measures.items() if found_by(run, measure)]
    if not names and run.has_forces:
        names = [f"{driver.name}.effort" for driver in machine.drivers]
    if not names:
        raise ModelError(
            f"'{machine.name}' has no measures: name what is to be plotted, as in 'crank.omega'"
        )
    return names


def _curve(run: Solution, name: str) -> PlottedCurve:
    measure = run.mechanism.measures.get(name, name)
    values, dimension, unit = measured(run, measure)
    if dimension == DIMENSIONS["angle"] and not getattr(measure, "unit", ""):
        values, unit = np.degrees(values), "deg"
    return PlottedCurve(name, np.where(np.isfinite(values), values, np.nan), dimension, unit)


def _abscissa(run: Solution) -> tuple[Array, str, bool]:
    """Values and name of the axis, and whether it is an angle."""
    moving = []
    for driver in run.mechanism.drivers:
        value = run.driven(driver.name)[0]
        if np.ptp(value) > 0.0:
            moving.append((driver, value))
    if len(moving) == 1:
        driver, value = moving[0]
        steps = np.diff(value)
        if isinstance(driver, AngleDriver) and (np.all(steps > 0.0) or np.all(steps < 0.0)):
            rest = "" if driver.relative_to == "ground" else f" from {driver.relative_to}"
            return np.degrees(value), f"angle of {driver.body}{rest} [deg]", True
    if np.ptp(run.t) == 0.0:
        return np.arange(float(len(run))), "instant", False
    return run.t, f"t [{run.mechanism.units.of('time')}]", False


def _figure(
    run: Solution, panels: Sequence[list[PlottedCurve]], x: Array, label: str, turns: bool
) -> Figure:
    """Panels of equal height, with space for the names on the right."""
    figure = blank()
    names = [curve.name for curves in panels if len(curves) > 1 for curve in curves]
    space = max((extent(_name(name), SIZE["text"])[0] for name in names), default=0.0) / 72.0
    high = ALONE if len(panels) == 1 else STACKED
    wide = LEFT + WIDE + RIGHT + (space + 0.1 if names else 0.0)
    tall = ABOVE + len(panels) * high + (len(panels) - 1) * BETWEEN + BELOW
    figure.set_size_inches(wide, tall)
    first: Axes | None = None
    for n, curves in enumerate(panels):
        bottom = tall - ABOVE - (n + 1) * high - n * BETWEEN
        place = (LEFT / wide, bottom / tall, WIDE / wide, high / tall)
        axes = figure.add_axes(place, sharex=first)
        first = first or axes
        _panel(axes, curves, x, high)
        axes.tick_params(labelbottom=n == len(panels) - 1)
    axes.set_xlabel(label, color=INK)
    axes.set_xlim(float(x.min()), float(x.max()))
    if turns:
        from matplotlib.ticker import MultipleLocator

        span = float(np.ptp(x))
        steps = [step for step in (5, 10, 15, 30, 60, 90, 180) if span / step <= 8.0]
        if steps:
            axes.xaxis.set_major_locator(MultipleLocator(steps[0]))
    title = cut(run.mechanism.name, 72).replace("$", r"\$")
    look: dict[str, Any] = {"ha": "left", "va": "baseline"}
    up = (tall - 0.3) / tall
    figure.text(0.2 / wide, up, title, size=SIZE["title"], color=INK, **look)
    figure.canvas.draw()
    return figure


def _panel(axes: Axes, curves: Sequence[PlottedCurve], x: Array, high: float) -> None:
    """Curves of one unit."""
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)
    for side in ("left", "bottom"):
        axes.spines[side].set_color(SOFT)
    axes.tick_params(color=SOFT, labelcolor=INK, length=3.0)
    axes.grid(True, color="#e3e7eb", lw=0.6)
    axes.set_axisbelow(True)
    for n, curve in enumerate(curves):
        color, dashes = CURVES[n % len(CURVES)]
        axes.plot(x, curve.values, color=color, ls=dashes, lw=1.6, gid=f"curve:{curve.name}")
    low, top = axes.get_ylim()
    if low < 0.0 < top:
        axes.axhline(0.0, color=SOFT, lw=0.8, zorder=1.5)
    axes.ticklabel_format(axis="y", scilimits=(-4, 5), useMathText=True)
    axes.yaxis.set_label_coords(-0.66 / WIDE, 0.5)
    symbol = curves[0].unit.replace("*", "·")
    unit = f" [{symbol}]" if symbol else ""
    if len(curves) == 1:
        axes.set_ylabel(_name(curves[0].name, int(11 * high)) + unit, color=INK)
        return
    dimensions = {curve.dimension for curve in curves}
    what = name_of(curves[0].dimension) if len(dimensions) == 1 else ""
    if not what and len(dimensions) == 1:
        what = _name(", ".join(curve.name for curve in curves), int(11 * high))
    axes.set_ylabel(f"{what}{unit}".strip(), color=INK)
    _names(axes, curves, high)


def _names(axes: Axes, curves: Sequence[PlottedCurve], high: float) -> None:
    """The name of each curve at its end, moved apart where names would overlap."""
    low, top = axes.get_ylim()
    ends = []
    for curve in curves:
        known = curve.values[np.isfinite(curve.values)]
        ends.append(((known[-1] if known.size else low) - low) / (top - low))
    apart = 1.25 * SIZE["text"] / 72.0 / high
    places = spread(ends, apart)
    for n, (curve, place) in enumerate(zip(curves, places, strict=True)):
        axes.text(
            1.015,
            place,
            _name(curve.name),
            transform=axes.transAxes,
            color=CURVES[n % len(CURVES)][0],
            va="center",
            gid=f"name:{curve.name}",
            bbox={"fc": PAPER, "ec": "none", "pad": 0.3},
        )


def spread(wanted: Sequence[float], apart: float) -> list[float]:
    """The numbers, moved as little as possible so that they are `apart` from each other.

    >>> spread([0.5, 0.5, 0.0], 0.2)
    [0.6, 0.4, 0.0]
    """
    order = sorted(range(len(wanted)), key=lambda n: wanted[n], reverse=True)
    groups: list[tuple[float, list[int]]] = []
    for n in order:
        middle, members = float(wanted[n]), [n]
        # a group takes in the one above as long as they would overlap
        while groups:
            above, others = groups[-1]
            if above - middle >= 0.5 * apart * (len(others) + len(members)):
                break
            groups.pop()
            total = above * len(others) + middle * len(members)
            members = [*others, *members]
            middle = total / len(members)
        groups.append((middle, members))
    found = [0.0] * len(wanted)
    for middle, members in groups:
        for k, n in enumerate(members):
            found[n] = round(middle + apart * (0.5 * (len(members) - 1) - k), 9)
    return found


def _name(text: str, longest: int = 28) -> str:
    return cut(text, max(longest, 12)).replace("$", r"\$")
