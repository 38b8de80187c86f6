"""Pictures of the rows: time against error, and time against the number of bodies."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from benchmarks.frame import Row

__all__ = ["draw"]

LEVEL = re.compile(r"^(.+), (?:error \d+e-\d+|as exact as .+ gets)$")
SIZE = re.compile(r"^(\w+) of (\d+), one evaluation$")
MARKS = "osD^v<>pX*"


def draw(question: str, rows: Sequence[Row], path: Path) -> Path | None:
    """An SVG file, or None where there is nothing to draw or no matplotlib."""
    panels = points(rows)
    try:
        import matplotlib
        from matplotlib.figure import Figure
    except ImportError:
        return None
    if not panels:
        return None
    with matplotlib.rc_context({"svg.hashsalt": question, "font.size": 8}):
        # one panel leaves its legend room at the side, several below
        alone = len(panels) == 1
        size = (7.6, 3.6) if alone else (4.2 * len(panels), 3.6)
        figure: Any = Figure(figsize=size, layout="constrained")
        engines = list(dict.fromkeys(name for panel in panels.values() for name in panel))
        every = figure.subplots(1, len(panels), squeeze=False, sharey=True)[0]
        for axes, (name, panel) in zip(every, panels.items()):
            sized = bool(SIZE.match(f"{rows[0].workload}"))
            for engine, found in panel.items():
                n = engines.index(engine)
                axes.loglog(
                    *zip(*sorted(found)),
                    f"{MARKS[n % len(MARKS)]}-",
                    color=f"C{n % 10}",
                    linewidth=2.0 if engine == "mbody" else 1.0,
                    markersize=4,
                    label=engine,
                )
            axes.set_title(name)
            axes.set_xlabel("bodies" if sized else "error")
            if axes is every[0]:
                axes.set_ylabel("an evaluation [s]" if sized else "time [s]")
            axes.grid(alpha=0.3)
        handles = dict(
            pair[::-1] for axes in figure.axes for pair in zip(*axes.get_legend_handles_labels())
        )
        # rows of the legend are alike, and no wider than the panels
        lines = math.ceil(len(handles) / (2 * len(panels)))
        columns = 1 if alone else math.ceil(len(handles) / lines)
        where = "outside right center" if alone else "outside lower center"
        figure.legend(handles.values(), handles.keys(), loc=where, ncols=columns, fontsize=8)
        path.parent.mkdir(parents=True, exist_ok=True)
        figure.savefig(path, metadata={"Date": None})
    return path


def points(rows: Sequence[Row]) -> dict[str, dict[str, set[tuple[float, float]]]]:
    """(error or bodies, seconds) by panel and engine."""
    found: dict[str, dict[str, set[tuple[float, float]]]] = {}
    for row in rows:
        level, size = LEVEL.match(row.workload), SIZE.match(row.workload)
        if row.median_s is None or row.median_s <= 0.0:
            continue
        if size:
            found.setdefault(size[1], {}).setdefault(row.engine, set()).add(
                (float(size[2]), row.median_s)
            )
        elif level and row.error:
            found.setdefault(level[1], {}).setdefault(row.engine, set()).add(
                (row.error, row.median_s)
            )
    return found
