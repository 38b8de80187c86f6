"""Bars of modes below a plot: what is open, sticks, slides or rolls, and when that changes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from mbody.sheets.text_table import cut
from mbody.views.labels import extent
from mbody.views.style import DRIVE, FORCE, INK, LOAD, PAPER, SIZE, SOFT

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from mbody.solution.solution import Solution

__all__ = ["BAR", "MODES", "ModeRow", "ModeSpan", "mode_bars", "mode_key", "mode_rows"]

Array = np.ndarray

#: What has more modes than this shows those that change most often.
MOST = 16
#: Inches from bar to bar, and the part of it that the bar fills.
BAR, FILLED = 0.21, 0.72
#: Letters of a name beside its bar.
LETTERS = 13
#: Nearer than this part of the axis two marks of events are one.
APART = 0.004

#: Words, fill, edge and hatching of each mode, in the order of the key; the hatching distinguishes
#: them without colours.
MODES: dict[str, tuple[str, str, str, str]] = {
    "open": ("open", PAPER, SOFT, ""),
    "stick": ("sticks", "#5b6875", INK, ""),
    "roll": ("rolls", "#a9d5c8", DRIVE, "ooo"),
    "slip+": ("slides +", "#cfe3f1", FORCE, "////"),
    "slip-": ("slides −", "#f7dcc6", LOAD, "\\\\\\\\"),
}


@dataclass(frozen=True)
class ModeSpan:
    """From where to where on the axis a mode lasts."""

    low: float
    high: float
    mode: str


@dataclass(frozen=True)
class ModeRow:
    """The modes of a contact or a rough joint over the axis.

    Attributes
    ----------
    name : str
    spans : tuple of ModeSpan
        Without gaps, from the first instant to the last.
    impacts : tuple of float
        Where it was struck.
    """

    name: str
    spans: tuple[ModeSpan, ...]
    impacts: tuple[float, ...] = ()


def mode_rows(run: Solution, x: Array | None = None) -> tuple[list[ModeRow], int]:
    """The modes of every contact and rough joint of a result, and how many are left out.

    A mode begins at the event that was located between two instants, else half way between them.

    Parameters
    ----------
    run : Solution
        Of one design, with several instants.
    x : array (instants,), optional
        The axis, which grows or falls; by default time.

    Examples
    --------
    >>> import mbody
    >>> machine = mbody.Mechanism("wheel")
    >>> machine.add(
    ...     mbody.Body("wheel", mass=2.0, cg=(0.1, 0.0)),
    ...     mbody.Revolute("O", "ground", "wheel", friction=0.1, pin_radius=0.01),
    ...     mbody.AngleDriver("motor", "wheel", mbody.laws.ConstantSpeed(0.0, 10.0)),
    ... )
    >>> [row.spans for row in mode_rows(mbody.kinetostatics(machine, t=[0.0, 1.0]))[0]]
    [(ModeSpan(low=0.0, high=1.0, mode='slip+'),)]
    """
    places = np.asarray(run.t if x is None else x, dtype=float)
    names = [] if run.analysis == "statics" else list(run.modes or run.losses)
    rows = [_row(run, name, places) for name in names]
    if len(rows) <= MOST:
        return rows, 0
    shown = sorted(range(len(rows)), key=lambda n: -len(rows[n].spans))[:MOST]
    return [rows[n] for n in sorted(shown)], len(rows) - MOST


def _row(run: Solution, name: str, x: Array) -> ModeRow:
    own = [event for event in run.events if event.contact == name]
    times = np.array(sorted(event.t for event in own))
    words, t = run.mode(name), run.t
    ends, modes = [float(x[0])], [words[0]]
    for k in range(len(words) - 1):
        if words[k + 1] == words[k]:
            continue
        between = times[(times >= t[k]) & (times <= t[k + 1])]
        part = (between[-1] - t[k]) / (t[k + 1] - t[k]) if between.size and t[k + 1] > t[k] else 0.5
        ends.append(float(x[k] + part * (x[k + 1] - x[k])))
        modes.append(words[k + 1])
    ends.append(float(x[-1]))
    pairs = zip(ends[:-1], ends[1:], modes, strict=True)
    spans = tuple(ModeSpan(low, high, mode) for low, high, mode in pairs)
    struck = [event.t for event in own if event.name in ("impact", "rest") and event.t <= t[-1]]
    return ModeRow(name, spans, tuple(float(v) for v in np.interp(struck, t, x)))


def mode_bars(axes: Axes, rows: Sequence[ModeRow], left_out: int = 0) -> None:
    """Draw bars from top to bottom, with the names beside them and a tick at every impact.

    Axes of a figure in the style of our pictures; its x axis is that of the panels above.
    """
    from matplotlib.patches import Rectangle

    axes.set_ylim(len(rows), 0.0)
    for n, row in enumerate(rows):
        for k, span in enumerate(row.spans):
            _, fill, edge, hatch = MODES[span.mode]
            low, high = sorted((span.low, span.high))
            look: dict[str, Any] = {"fc": fill, "ec": edge, "lw": 0.7, "hatch": hatch}
            if span.mode == "open":
                look |= {"ls": (0, (3, 2))}
            bar = Rectangle((low, n + 0.5 * (1.0 - FILLED)), high - low, FILLED, zorder=2.0, **look)
            bar.set_gid(f"mode:{row.name}:{k}:{span.mode}")
            axes.add_patch(bar)
        _impacts(axes, row, n)
    axes.set_yticks([n + 0.5 for n in range(len(rows))])
    axes.set_yticklabels([cut(row.name, LETTERS).replace("$", r"\$") for row in rows])
    axes.tick_params(axis="y", length=0.0, labelcolor=INK, pad=3.0)
    for side in ("top", "right", "left"):
        axes.spines[side].set_visible(False)
    axes.spines["bottom"].set_color(SOFT)
    if left_out:
        text = f"and {left_out} more, which change less often"
        look = {"size": 0.85 * SIZE["text"], "color": SOFT, "ha": "right", "va": "bottom"}
        axes.text(1.0, 1.02, text, transform=axes.transAxes, **look)


def _impacts(axes: Axes, row: ModeRow, n: int) -> None:
    """A triangle above the bar at every impact; those without number are some."""
    if not row.impacts:
        return
    ends = [row.spans[0].low, row.spans[-1].high]
    near = APART * abs(ends[1] - ends[0])
    shown: list[float] = []
    for x in sorted(row.impacts):
        if not shown or x - shown[-1] >= near:
            shown.append(x)
    axes.plot(
        shown,
        [n + 0.12] * len(shown),
        ls="none",
        marker="v",
        ms=3.6,
        mfc=INK,
        mec=PAPER,
        mew=0.4,
        zorder=4.0,
        clip_on=False,
        gid=f"impacts:{row.name}",
    )


def mode_key(axes: Axes, rows: Sequence[ModeRow], wide: float) -> None:
    """The key of the bars in axes of their own without a frame, `wide` inches; only of what is
    there.
    """
    from matplotlib.patches import Rectangle

    axes.set_axis_off()
    axes.set_xlim(0.0, wide)
    axes.set_ylim(0.0, 1.0)
    there = {span.mode for row in rows for span in row.spans}
    x, size = 0.0, 0.9 * SIZE["text"]
    text: dict[str, Any] = {"size": size, "color": INK, "va": "center_baseline"}
    for mode, (words, fill, edge, hatch) in MODES.items():
        if mode not in there:
            continue
        dashes: Any = (0, (3, 2)) if mode == "open" else "-"
        look: dict[str, Any] = {"fc": fill, "ec": edge, "lw": 0.7, "hatch": hatch, "ls": dashes}
        axes.add_patch(Rectangle((x, 0.15), 0.28, 0.7, gid=f"key:{mode}", **look))
        axes.text(x + 0.34, 0.5, words, **text)
        x += 0.34 + extent(words, size)[0] / 72.0 + 0.2
    if any(row.impacts for row in rows):
        axes.plot([x + 0.06], [0.5], ls="none", marker="v", ms=4.2, color=INK, gid="key:impact")
        axes.text(x + 0.16, 0.5, "impact", **text)
