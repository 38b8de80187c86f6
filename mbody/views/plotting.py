"""Quantities over the cycle: one panel for each unit, above a common axis."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from mbody.core.tolerances import DRAWN_CONSTANT, DRAWN_SERIES_SAME
from mbody.errors import ModelError, brief
from mbody.model.driver import AngleDriver
from mbody.model.element import unknown_name
from mbody.model.simulation import Measure, measure_named
from mbody.quantities.units import Dimension, name_of
from mbody.solution.histories import check_forces, one_design
from mbody.solution.measures import found_by, shown_measure
from mbody.summaries.text_table import cut, force_names
from mbody.views.acting import notation
from mbody.views.labels import (
    CURVES,
    INK,
    PAPER,
    SIZE,
    SOFT,
    blank,
    drawable,
    extent,
    said_below,
    styled,
)
from mbody.views.shapes import one_way
from mbody.views.sketch import BAR, mode_bars, mode_key, mode_rows, rounded, rounded_number

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from mbody.engineering.internal_loads import InternalLoads
    from mbody.solution.solution import Solution


# -- Plots of vectors and of paths: polar diagrams and hodographs of forces, x–y paths of points

Array = np.ndarray

#: Inches: the longer side of the axes, margins, the title; points: marks of the driver's angle.
SIDE, LEFT, BELOW, ABOVE, RIGHT = 3.4, 0.72, 0.55, 0.62, 0.25
#: Degrees between the marks on a hodograph.
MARKS = 30.0
GRID = "#e3e7eb"


def polar(run: Solution, *joints: str) -> Figure:
    """Magnitudes of joint forces over the direction of the crank, as polar diagrams.

    >>> import mbody
    >>> run = mbody.kinetostatics(mbody.makers.four_bar(1, 3, 2, 3.5, masses=(1, 1, 1)), turn=True)
    >>> polar(run, "A", "B").axes[0].name
    'polar'
    """
    names = _checked(run, joints)
    driver = _angle_driver(run)
    angle = run.driven(driver.name)[0]
    with styled():
        figure = blank()
        wide, tall = _sized(figure, run, names, SIDE, SIDE)
        from matplotlib.ticker import MaxNLocator

        place = (LEFT / wide, BELOW / tall, SIDE / wide, SIDE / tall)
        axes: Any = figure.add_axes(place, projection="polar")
        for n, name in enumerate(names):
            color, dashes = CURVES[n % len(CURVES)]
            size = run.mechanism.shown.converted(run.reaction(name).magnitude, "force")
            axes.plot(angle, size, color=color, ls=dashes, lw=1.6, gid=f"polar:{name}")
        axes.set_rlabel_position(22.5)
        axes.yaxis.set_major_locator(MaxNLocator(4, prune="lower"))
        axes.yaxis.set_major_formatter(lambda value, _: rounded_number(value))
        axes.tick_params(colors=INK, labelsize=0.85 * SIZE["text"])
        axes.grid(True, color=GRID, lw=0.6)
        axes.spines["polar"].set_color(SOFT)
        axes.set_ylim(0.0)
        force = run.mechanism.shown.of("force")
        label = f"force [{force}] over the angle of {driver.body}"
        figure.text((LEFT + 0.5 * SIDE) / wide, 0.14 / tall, label, ha="center", color=INK)
        _legend(figure, run, names, wide, tall)
        return figure


def hodograph(run: Solution, *joints: str, axes: str = "ground") -> Figure:
    """The curves that the tips of joint forces describe, in world axes or in those of a link.

    F_ij is the force of link i on link j, as in the summary. Small marks are every 30 degrees of
    the driver, the circle is the first instant.

    >>> import mbody
    >>> run = mbody.kinetostatics(mbody.makers.four_bar(1, 3, 2, 3.5, masses=(1, 1, 1)), turn=True)
    >>> hodograph(run, "A", axes="crank").axes[0].get_xlabel()
    'along x of crank [N]'
    """
    names = _checked(run, joints)
    rotation = run[axes].angle
    c, s = np.cos(rotation), np.sin(rotation)
    book = force_names(run.mechanism)
    curves, units = [], run.mechanism.shown
    for name in names:
        force = run.reaction(name, book[name][1])
        tips = np.column_stack([c * force.fx + s * force.fy, c * force.fy - s * force.fx])
        curves.append(units.converted(tips, "force"))
    unit = units.of("force")
    relative = "" if axes == "ground" else f" of {axes}"
    labels = (f"along x{relative} [{unit}]", f"along y{relative} [{unit}]")
    return _curves(run, names, curves, labels, "hodograph", origin=True)


def path_plot(run: Solution, *points: str) -> Figure:
    """The paths of points, y over x with equal scales."""
    one_design(run, "a picture is of one design")
    _check_several(run)
    units = run.mechanism.shown
    places = [np.column_stack([p.x, p.y]) for p in map(run.point, points)]
    curves, unit = [units.converted(one, "length") for one in places], units.of("length")
    return _curves(run, list(points), curves, (f"x [{unit}]", f"y [{unit}]"), "path")


def _checked(run: Solution, joints: Sequence[str]) -> list[str]:
    """The joints, of a result that has forces over several instants."""
    check_forces(run, "plots of forces")
    _check_several(run)
    known = [joint.name for joint in run.mechanism.joints]
    for name in joints:
        if name not in known:
            raise unknown_name("joint", name, known)
    names = list(joints) or known
    if not names:
        raise ModelError(f"'{run.mechanism.name}' has no joint whose force could be plotted")
    return names


def _angle_driver(run: Solution) -> AngleDriver:
    """The driver over whose angle a polar diagram is."""
    for driver in run.mechanism.drivers:
        if isinstance(driver, AngleDriver) and np.ptp(run.driven(driver.name)[0]) > 0.0:
            return driver
    raise ModelError(
        "a polar diagram is over the angle of a driver, and none turns in this result: draw a "
        "hodograph, or analyse a turn"
    )


def _check_several(run: Solution) -> None:
    if len(run) < 2:
        raise ModelError("a curve needs several instants, this result has 1: analyse a turn")


def _curves(
    run: Solution,
    names: Sequence[str],
    curves: Sequence[Array],
    labels: tuple[str, str],
    kind: str,
    *,
    origin: bool = False,
) -> Figure:
    """Closed or open curves at equal scales."""
    every = np.vstack([*curves, *([np.zeros((1, 2))] if origin else [])])
    every = every[np.isfinite(every).all(axis=1)]
    low, high = every.min(axis=0), every.max(axis=0)
    span = np.maximum(high - low, 0.12 * float((high - low).max()) or 1.0)
    middle, span = 0.5 * (low + high), 1.1 * span
    side = SIDE / float(span.max()) * span
    with styled():
        figure = blank()
        wide, tall = _sized(figure, run, names, float(max(side[0], 1.6)), float(max(side[1], 1.3)))
        inner = np.array([max(side[0], 1.6), max(side[1], 1.3)])
        span = span * inner / side
        axes = figure.add_axes((LEFT / wide, BELOW / tall, inner[0] / wide, inner[1] / tall))
        _plain(axes)
        axes.set_xlim(middle[0] - 0.5 * span[0], middle[0] + 0.5 * span[0])
        axes.set_ylim(middle[1] - 0.5 * span[1], middle[1] + 0.5 * span[1])
        if origin:
            axes.axhline(0.0, color=SOFT, lw=0.8, zorder=1.5)
            axes.axvline(0.0, color=SOFT, lw=0.8, zorder=1.5)
        marks = _marks(run)
        for n, (name, curve) in enumerate(zip(names, curves, strict=True)):
            color, dashes = CURVES[n % len(CURVES)]
            axes.plot(*curve.T, color=color, ls=dashes, lw=1.5, gid=f"{kind}:{name}")
            axes.plot(*curve[marks].T, "o", color=color, ms=2.6, lw=0)
            axes.plot(*curve[:1].T, "o", mfc=PAPER, mec=color, ms=5.0, mew=1.2)
        axes.set_xlabel(labels[0], color=INK)
        axes.set_ylabel(labels[1], color=INK)
        _legend(figure, run, names, wide, tall)
        return figure


def _plain(axes: Axes) -> None:
    """The look of all our axes."""
    from matplotlib.ticker import MaxNLocator

    for side in ("top", "right"):
        axes.spines[side].set_visible(False)
    for side in ("left", "bottom"):
        axes.spines[side].set_color(SOFT)
    axes.tick_params(color=SOFT, labelcolor=INK, length=3.0)
    axes.grid(True, color=GRID, lw=0.6)
    axes.set_axisbelow(True)
    axes.xaxis.set_major_locator(MaxNLocator(6))
    axes.yaxis.set_major_locator(MaxNLocator(6))
    axes.ticklabel_format(scilimits=(-4, 5), useMathText=True)


def _marks(run: Solution) -> list[int]:
    """The instants nearest to every thirty degrees of the driver that turns."""
    for driver in run.mechanism.drivers:
        value = np.degrees(run.driven(driver.name)[0])
        if isinstance(driver, AngleDriver) and np.ptp(value) > MARKS and len(run) > 24:
            wanted = np.arange(math.ceil(value.min() / MARKS), value.max() / MARKS) * MARKS
            return [int(np.argmin(np.abs(value - at))) for at in wanted]
    return []


def _sized(
    figure: Figure, run: Solution, names: Sequence[str], inner: float, high: float
) -> tuple[float, float]:
    """Set the size of the figure [inches] with space for the legend on the right."""
    space = max(extent(text, SIZE["text"])[0] for text in _entries(run, names)) / 72.0 + 0.45
    title = extent(cut(run.mechanism.name, 72), SIZE["title"])[0] / 72.0 + 0.4
    wide = max(LEFT + inner + RIGHT + space, title)
    tall = max(BELOW + high + ABOVE, ABOVE + 0.24 * (len(names) + 2))
    figure.set_size_inches(wide, tall)
    return wide, tall


def _entries(run: Solution, names: Sequence[str]) -> list[str]:
    """Names of the curves: forces as books write them, with the joint, and their peak."""
    joints = {joint.name for joint in run.mechanism.joints}
    book, found = force_names(run.mechanism), []
    for name in names:
        if name in joints and run.has_forces:
            peak = float(np.nanmax(run.reaction(name).magnitude))
            plain = book[name][0].partition(",")[0] if "," in book[name][0] else book[name][0]
            symbol = notation(book[name][0] if "(" in book[name][0] else plain)
            found.append(f"{symbol} at {name}, peak {rounded(peak, 'force', run.mechanism.shown)}")
        else:
            found.append(name)
    return found


def _legend(figure: Figure, run: Solution, names: Sequence[str], wide: float, tall: float) -> None:
    """The title, and names with their lines on the right."""
    from matplotlib.lines import Line2D

    title = cut(run.mechanism.name, 72).replace("$", r"\$")
    look: dict[str, Any] = {"ha": "left", "va": "baseline"}
    look |= {"size": SIZE["title"], "color": INK, "gid": "title"}
    figure.text(0.2 / wide, (tall - 0.3) / tall, title, **look)
    entries = _entries(run, names)
    space = max(extent(text, SIZE["text"])[0] for text in entries) / 72.0
    left = wide - space - 0.12
    for n, text in enumerate(entries):
        y = (tall - ABOVE - 0.12 - 0.24 * n) / tall
        color, dashes = CURVES[n % len(CURVES)]
        style: Any = dashes
        line = Line2D([(left - 0.3) / wide, (left - 0.06) / wide], [y, y], color=color, lw=1.5)
        line.set_linestyle(style)
        figure.add_artist(line)
        figure.text(left / wide, y, drawable(text), color=INK, va="center", size=SIZE["text"])


#: Inches: the width of the axes, the height of one panel and of each of several, gaps and margins.
WIDE, ALONE, STACKED = 5.0, 2.9, 1.75
MARGIN_LEFT, MARGIN_BELOW, MARGIN_ABOVE, BETWEEN, MARGIN_RIGHT = 0.85, 0.55, 0.62, 0.22, 0.2
#: Inches for the key of the modes.
KEY = 0.27


#: Results that have a curve each; more are a band.
SEVERAL = 6
#: A quantity with its unit in brackets.
_UNIT = re.compile(r"(.+?)\s*\[([^\[\]]+)\]")


@dataclass(frozen=True)
class PlottedCurve:
    """One curve: its name, history in the unit that is shown, dimension and unit; of several
    results what it is `of`, its own places on the axis, and of a band the least and the greatest.
    """

    name: str
    values: Array
    dimension: Dimension
    unit: str
    of: str = ""
    x: Array | None = None
    band: tuple[Array, Array] | None = None


@dataclass(frozen=True)
class Abscissa:
    """Values and label of the common axis, and whether it is an angle in degrees."""

    values: Array
    label: str
    name: str = ""
    angular: bool = False


def plot(
    run: Solution | Sequence[Solution],
    *quantities: str,
    x: str = "",
    log: str = "",
    labels: Sequence[str] = (),
    modes: bool = True,
) -> Figure:
    """Quantities over the angle of the driver in degrees, over time, or over any other quantity.

    Quantities of one unit share a panel, in which each has its name at its right end; panels are
    stacked above one axis. Of several results every quantity has its panel, and every result its
    curve; more than `SEVERAL` are a band from the least to the greatest value, with the median.
    Events of a motion are vertical lines. Below the panels every contact and frictional joint has a
    bar that says when it is open, sticks, slides or rolls.

    Parameters
    ----------
    run : Solution, or list of Solution
        Of one design each, with several instants.
    *quantities : str
        Names of the mechanism's measures, or formulas of histories such as ``"motor.effort"``,
        ``"B.force"``, ``"coupler.P.y"``, with the wanted unit in brackets, as in ``"B.force
        [kN]"``; by default all measures, else all efforts.
    x : str
        What they are plotted over, in the same form; by default the angle of the driver, or time.
    log : str
        Axes of a logarithmic scale: ``"x"``, ``"y"``, ``"xy"``.
    labels : list of str
        Names of several results.
    modes : bool
        Whether one result with contacts or frictional joints has the bars of their modes, where it
        is not plotted over another quantity.

    Returns
    -------
    matplotlib.figure.Figure
        Every axis names its quantity and unit; angles are in degrees where no unit is given.

    Raises
    ------
    ModelError
        For an unknown quantity, a result of one instant, a batch, results of other instants than
        the first where they are many, values that a logarithmic axis cannot show, or without
        matplotlib.

    Notes
    -----
    The axis is the angle where one driver of an angle turns all the time in one direction and no
    other driver moves; else it is time, or the number of the instant where the time is constant.

    Examples
    --------
    >>> import mbody
    >>> run = mbody.kinetostatics(mbody.makers.four_bar(1, 3, 2, 3.5, speed=10.0), turn=True)
    >>> axes = mbody.plot(run, "motor.effort", "rocker.angle").axes
    >>> [panel.get_ylabel() for panel in axes], axes[1].get_xlabel()
    (['motor.effort [N·m]', 'rocker.angle [deg]'], 'angle of crank [deg]')
    """
    runs = [run] if not isinstance(run, Sequence) else list(run)
    for one in runs:
        one_design(one, "a picture is of one design")
        if len(one) < 2:
            raise ModelError(
                "a plot needs several instants, this result has 1: analyse a turn (turn=True), or "
                "times"
            )
    if log not in ("", "x", "y", "xy", "yx"):
        raise ModelError(f"a logarithmic axis is 'x', 'y' or 'xy', not {brief(log)}")
    first = runs[0]
    names = list(quantities or all_measures(first))
    abscissa = [_over(one, x) for one in runs]
    panels: list[list[PlottedCurve]] = []
    if len(runs) > 1:
        titles = [*labels, *(f"design {n}" for n in range(len(labels) + 1, len(runs) + 1))]
        for name in names:
            found = [curve_of(one, name) for one in runs]
            alike = all(_alike(abscissa[0].values, other.values) for other in abscissa)
            if len(runs) > SEVERAL and alike:
                panels.append([_band(found)])
            else:
                panels.append(
                    [
                        PlottedCurve(title, one.values, one.dimension, one.unit, name, xs.values)
                        for title, one, xs in zip(titles, found, abscissa, strict=False)
                    ]
                )
    else:
        together: dict[str, list[PlottedCurve]] = {}
        for curve in (curve_of(first, name) for name in names):
            together.setdefault(curve.unit, []).append(curve)
        panels = list(together.values())
    _check_log(log, panels, abscissa)
    bars = modes and len(runs) == 1 and not x and "x" not in log
    with styled():
        figure = _figure(first, panels, abscissa[0], log, [] if x else _events(first), bars=bars)
        return said_below(figure, *runs[:SEVERAL], of=[_quantity(name)[0] for name in names])


def plot_curves(run: Solution, panels: Sequence[list[PlottedCurve]]) -> Figure:
    """Curves that are known already, a panel for each list, over the axis of `plot`."""
    with styled():
        return _figure(run, panels, _abscissa(run), "", [])


def _alike(one: Array, other: Array) -> bool:
    """Whether two axes have the same places; laws of other speeds reach them to rounding."""
    return one.shape == other.shape and bool(
        np.allclose(one, other, rtol=DRAWN_SERIES_SAME, atol=DRAWN_SERIES_SAME)
    )


def all_measures(run: Solution) -> list[str]:
    """Quantities plotted by default: all measures, else all efforts."""
    machine = run.mechanism
    names = [name for name, measure in machine.measures.items() if found_by(run, measure)]
    if not names and run.has_forces:
        names = [f"{driver.name}.effort" for driver in machine.drivers]
    if not names and run.modes:
        names = [f"{contact.name}.contact" for contact in machine.contacts]
        names = names or [f"{name}.loss" for name in run.losses]
    if not names:
        raise ModelError(
            f"'{machine.name}' has no measures: name what is to be plotted, as in 'crank.omega'"
        )
    return names


def _quantity(name: str) -> tuple[str, str]:
    """A quantity, and the unit in brackets behind it."""
    in_unit = _UNIT.fullmatch(name.strip())
    return (in_unit[1].strip(), in_unit[2].strip()) if in_unit else (name, "")


def curve_of(run: Solution, name: str) -> PlottedCurve:
    """The history of a quantity, in the unit in brackets behind its name."""
    quantity_name, given = _quantity(name)
    measure = measure_named(run.mechanism.measures, quantity_name)
    if given:
        measure = Measure(measure.of, given)
    values, dimension, unit = shown_measure(run, measure)
    return PlottedCurve(
        quantity_name, np.where(np.isfinite(values), values, np.nan), dimension, unit
    )


def _band(curves: Sequence[PlottedCurve]) -> PlottedCurve:
    """The median of many curves, with the least and the greatest value beside it."""
    values = np.array([curve.values for curve in curves])
    first = curves[0]
    low, top = np.nanmin(values, axis=0), np.nanmax(values, axis=0)
    name = f"median of {len(curves)}"
    middle = np.nanmedian(values, axis=0)
    return PlottedCurve(name, middle, first.dimension, first.unit, first.name, None, (low, top))


def _check_log(
    log: str, panels: Sequence[Sequence[PlottedCurve]], abscissa: Sequence[Abscissa]
) -> None:
    """Refuse a logarithmic axis of what has no positive value."""
    rows = [(curve.of or curve.name, curve.values) for curves in panels for curve in curves]
    rows_by_axis = [("y", *row) for row in rows] + [("x", one.name, one.values) for one in abscissa]
    for axis, name, values in rows_by_axis:
        if axis in log and not np.any(values > 0.0):
            raise ModelError(
                f"'{name}' has no positive value, which a logarithmic axis needs: plot another "
                f"quantity, or leave '{axis}' linear"
            )


def _events(run: Solution) -> list[tuple[float, str]]:
    """Times of events, with their names."""
    if run.mechanism.drivers and run.analysis != "simulate":
        return []
    several = len({event.contact for event in run.events if event.contact}) > 1
    return [
        (
            float(run.mechanism.shown.converted(event.t, "time")),
            f"{event.contact}: {event.name}" if several and event.contact else event.name,
        )
        for event in run.events
    ]


def _over(run: Solution, x: str) -> Abscissa:
    """Abscissa of the curves."""
    if not x:
        return _abscissa(run)
    curve = curve_of(run, x)
    symbol = curve.unit
    return Abscissa(curve.values, _name(x if not symbol else f"{curve.name} [{symbol}]", 60), x)


def _abscissa(run: Solution) -> Abscissa:
    """The angle of the driver, time, or the number of the instant."""
    found, units = one_way(run), run.mechanism.shown
    if found is not None:
        driver, value = found
        if isinstance(driver, AngleDriver):
            unit = units.of("angle")
            label = f"{driver.coordinate} [{unit}]"
            shown = np.degrees(value) if unit == "deg" else units.converted(value, "angle")
            return Abscissa(shown, label, driver.body, unit == "deg")
    if np.ptp(run.t) == 0.0:
        return Abscissa(np.arange(float(len(run))), "instant", "instant")
    return Abscissa(units.converted(run.t, "time"), f"t [{units.of('time')}]", "t")


def _figure(
    run: Solution,
    panels: Sequence[list[PlottedCurve]],
    abscissa: Abscissa,
    log: str,
    events: Sequence[tuple[float, str]],
    *,
    bars: bool = False,
) -> Figure:
    """Panels of equal height, with space for the names on the right, above bars of modes."""
    figure, x = blank(), abscissa.values
    rows, left_out = mode_rows(run, x) if bars else ([], 0)
    below = MARGIN_BELOW + (BAR * len(rows) + BETWEEN + KEY if rows else 0.0)
    names = [curve.name for curves in panels if named(curves) for curve in curves]
    space = max((extent(_name(name), SIZE["text"])[0] for name in names), default=0.0) / 72.0
    high = ALONE if len(panels) == 1 else STACKED
    wide = MARGIN_LEFT + WIDE + MARGIN_RIGHT + (space + 0.1 if names else 0.0)
    tall = MARGIN_ABOVE + len(panels) * high + (len(panels) - 1) * BETWEEN + below
    figure.set_size_inches(wide, tall)
    first: Axes | None = None
    for n, curves in enumerate(panels):
        bottom = tall - MARGIN_ABOVE - (n + 1) * high - n * BETWEEN
        place = (MARGIN_LEFT / wide, bottom / tall, WIDE / wide, high / tall)
        axes = figure.add_axes(place, sharex=first)
        first = first or axes
        _panel(axes, curves, x, high, log)
        if abscissa.name == "t":
            _marked(axes, events, x, names_them=n == 0)
        axes.tick_params(labelbottom=n == len(panels) - 1 and not rows)
    if rows:
        assert first is not None
        size = (WIDE / wide, BAR * len(rows) / tall)
        axes = figure.add_axes(
            (MARGIN_LEFT / wide, (MARGIN_BELOW + KEY) / tall, *size), sharex=first
        )
        mode_bars(axes, rows, left_out)
        key = figure.add_axes(
            (MARGIN_LEFT / wide, 0.08 / tall, WIDE / wide, 0.17 / tall), label="modes"
        )
        mode_key(key, rows, WIDE)
    axes.set_xlabel(abscissa.label, color=INK)
    own = [curve.x for curves in panels for curve in curves if curve.x is not None]
    every = np.concatenate([x, *own])
    every = every[np.isfinite(every) & ((every > 0.0) | ("x" not in log))]
    if np.ptp(every) > 0.0:
        axes.set_xlim(float(every.min()), float(every.max()))
    if abscissa.angular and "x" not in log:
        from matplotlib.ticker import MultipleLocator

        span = float(np.ptp(x))
        steps = [step for step in (5, 10, 15, 30, 60, 90, 180) if span / step <= 8.0]
        if steps:
            axes.xaxis.set_major_locator(MultipleLocator(steps[0]))
    title = cut(run.mechanism.name, 72).replace("$", r"\$")
    look: dict[str, Any] = {"ha": "left", "va": "baseline"}
    up = (tall - 0.3) / tall
    figure.text(0.2 / wide, up, title, size=SIZE["title"], color=INK, gid="title", **look)
    return figure


def named(curves: Sequence[PlottedCurve]) -> bool:
    """Whether the curves of a panel need their names beside it."""
    return len(curves) > 1 or any(curve.of for curve in curves)


def _marked(axes: Axes, events: Sequence[tuple[float, str]], x: Array, *, names_them: bool) -> None:
    """Vertical lines at events, named above the first panel as far as there is space."""
    last, before, span = -np.inf, -np.inf, float(np.ptp(x))
    for t, name in sorted(events):
        # many in a short time, as of a ball that comes to rest, would be a grey area
        if not x.min() <= t <= x.max() or t - before < 0.012 * span:
            continue
        before = t
        axes.axvline(t, color=SOFT, lw=0.8, ls=(0, (3, 2)), zorder=1.4, gid=f"event:{name}")
        text = _name(name, 24)
        wide = extent(text, 0.85 * SIZE["text"])[0] / 72.0 / WIDE * span
        if names_them and t > last:
            look: dict[str, Any] = {"color": SOFT, "size": 0.85 * SIZE["text"], "va": "bottom"}
            at_end = t + wide > x.max()
            place = (t, 1.01)
            axes.text(
                *place,
                text,
                transform=axes.get_xaxis_transform(),
                **look,
                ha="right" if at_end else "left",
            )
            last = t + 1.1 * wide


def _panel(axes: Axes, curves: Sequence[PlottedCurve], x: Array, high: float, log: str) -> None:
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
        own = x if curve.x is None else curve.x
        if curve.band is not None:
            gid = f"band:{curve.of}"
            axes.fill_between(own, *curve.band, color=color, alpha=0.2, lw=0.0, gid=gid)
        gid = f"curve:{curve.of}:{curve.name}" if curve.of else f"curve:{curve.name}"
        axes.plot(own, curve.values, color=color, ls=dashes, lw=1.6, gid=gid)
    _steady(axes, curves)
    if "x" in log:
        axes.set_xscale("log")
    if "y" in log:
        axes.set_yscale("log")
    low, top = axes.get_ylim()
    if low < 0.0 < top and "y" not in log:
        axes.axhline(0.0, color=SOFT, lw=0.8, zorder=1.5)
    if "y" not in log:
        axes.ticklabel_format(axis="y", scilimits=(-4, 5), useMathText=True)
    axes.yaxis.set_label_coords(-0.66 / WIDE, 0.5)
    unit = f" [{curves[0].unit}]" if curves[0].unit else ""
    if curves[0].of:
        axes.set_ylabel(_name(curves[0].of, int(11 * high)) + unit, color=INK)
        _names(axes, curves, high)
        return
    if len(curves) == 1:
        axes.set_ylabel(_name(curves[0].name, int(11 * high)) + unit, color=INK)
        return
    dimensions = {curve.dimension for curve in curves}
    what = name_of(curves[0].dimension) if len(dimensions) == 1 else ""
    if not what and len(dimensions) == 1:
        what = _name(", ".join(curve.name for curve in curves), int(11 * high))
    axes.set_ylabel(f"{what}{unit}".strip(), color=INK)
    _names(axes, curves, high)


def _steady(axes: Axes, curves: Sequence[PlottedCurve]) -> None:
    """Limits around values that are constant but for rounding, which would fill the panel."""
    values = np.concatenate([curve.values for curve in curves])
    values = values[np.isfinite(values)]
    size = float(np.abs(values).max(initial=0.0))
    if values.size and size and float(np.ptp(values)) < DRAWN_CONSTANT * size:
        axes.set_ylim(*sorted((0.0, 1.25 * float(values[0]))))


def _names(axes: Axes, curves: Sequence[PlottedCurve], high: float) -> None:
    """The name of each curve at its end, moved apart where names would overlap."""
    low, top = axes.get_ylim()
    ends = []
    for curve in curves:
        known = curve.values[np.isfinite(curve.values)]
        end = known[-1] if known.size else low
        if axes.get_yscale() == "log":
            end = max(end, low)
            ends.append(float(np.log(end / low) / np.log(top / low)))
        else:
            ends.append((end - low) / (top - low))
    spacing = 1.25 * SIZE["text"] / 72.0 / high
    places = spread(ends, spacing)
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


def spread(wanted: Sequence[float], spacing: float) -> list[float]:
    """The numbers, moved as little as possible so that they are `spacing` from each other.

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
            if above - middle >= 0.5 * spacing * (len(others) + len(members)):
                break
            groups.pop()
            total = above * len(others) + middle * len(members)
            members = [*others, *members]
            middle = total / len(members)
        groups.append((middle, members))
    found = [0.0] * len(wanted)
    for middle, members in groups:
        for k, n in enumerate(members):
            found[n] = round(middle + spacing * (0.5 * (len(members) - 1) - k), 9)
    return found


def _name(text: str, longest: int = 28) -> str:
    return cut(text, max(longest, 12)).replace("$", r"\$")


# -- Diagrams of axial force, shear force, bending moment and stress along a link --------------

#: Inches.
WIDTH, PANEL, MARGIN = 6.4, 1.5, 0.9


def internal_diagram(found: InternalLoads, instant: int | None = None) -> Figure:
    """Diagrams of what a link carries inside: N, V, M, and the equivalent stress of its section.

    >>> import mbody
    >>> machine = mbody.makers.four_bar(1, 3, 2, 3.5, masses=(1, 3, 2), speed=9.0)
    >>> run = mbody.kinetostatics(machine, turn=True, instants=25)
    >>> len(internal_diagram(mbody.engineering.internal_loads(run, "coupler")).axes)
    3
    """
    unit = found.run.mechanism.units
    rows: list[tuple[str, Any, str]] = [
        ("axial force", found.axial, unit.force),
        ("shear force", found.shear, unit.force),
        ("bending moment", found.bending, unit.of("torque")),
    ]
    if found.section is not None:
        rows.append(("equivalent stress", found.stress().equivalent, unit.of("pressure")))
    greatest = np.abs(found.bending).max(axis=1)
    k = int(greatest.argmax()) if instant is None else range(len(found.axial))[instant]
    with styled():
        figure = blank()
        figure.set_size_inches(WIDTH, PANEL * len(rows) + MARGIN)
        panels = figure.subplots(len(rows), 1, sharex=True, squeeze=False)[:, 0]
        s = found.place
        for n, (axes, (title, values, dimension)) in enumerate(zip(panels, rows, strict=True)):
            color = CURVES[n % len(CURVES)][0]
            if len(values) > 1:
                low, high = values.min(axis=0), values.max(axis=0)
                axes.fill_between(s, low, high, color=color, alpha=0.15, linewidth=0.0)
            axes.plot(s, values[k], color=color, linewidth=1.6)
            axes.axhline(0.0, color=INK, linewidth=0.7)
            axes.set_ylabel(f"{title}\n{dimension}")
            axes.grid(color=SOFT, alpha=0.35, linewidth=0.5)
            axes.spines[["top", "right"]].set_visible(False)
        panels[-1].set_xlabel(f"from {found.along[0]} to {found.along[1]}, {unit.length}")
        at = f"t = {found.run.t[k]:.6g} {unit.time}"
        shaded = "" if len(found.axial) == 1 else "; shaded: all instants"
        panels[0].set_title(f"{found.body}: {at}{shaded}")
        figure.tight_layout()
        return said_below(figure, notes=found.notes)
