"""Plots of vectors and of paths: polar diagrams and hodographs of forces, x–y paths of points."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from mbody.errors import ModelError
from mbody.model.driver import AngleDriver
from mbody.model.element import unknown_name
from mbody.solution.histories import check_forces, one_design
from mbody.summaries.text_table import cut, force_names
from mbody.views.acting import notation
from mbody.views.frame import rounded, rounded_number
from mbody.views.labels import drawable, extent
from mbody.views.style import CURVES, INK, PAPER, SIZE, SOFT, blank, styled

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from mbody.solution.solution import Solution


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
