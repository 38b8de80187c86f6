"""Tables of rows, and the page benchmarks/README.md, made of the files in benchmarks/results."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Sequence
from itertools import groupby
from pathlib import Path
from typing import Any

from benchmarks import pictures, results
from benchmarks.frame import OURS, Row
from benchmarks.questions import QUESTIONS
from benchmarks.targets import exponents, targets

__all__ = ["table", "write"]

PAGE = Path(__file__).parent / "README.md"
BEGIN, END = "<!-- tables: made by `python -m benchmarks --page` -->", "<!-- end of the tables -->"
LEVEL = re.compile(r"^(.+), error (\d+e-\d+)$")
EXACT = re.compile(r"^(.+), as exact as (.+) gets$")
SIZE = re.compile(r"^(\w+) of (\d+), one evaluation$")
#: Workloads of many of one kind, whose numbers multiply to how many.
EACH = (
    (re.compile(r"^(\d+) .+ × (\d+) positions"), "position"),
    (re.compile(r"^(\d+) free "), "motion"),
    (re.compile(r"^\w+ of (\d+), one evaluation in the core"), "body"),
)


def write(page: Path = PAGE, folder: Path = results.FOLDER) -> None:
    """Everything between the two marks of the page, and the pictures beside the results: of every
    machine the newest of each question, of the full form if there is one; earlier ones by name.
    """
    text = page.read_text("utf-8")
    head, rest = text.split(BEGIN)
    tail = rest.split(END)[1]
    said, names, shown = [], [], set()
    for one in results.kept(folder):
        rows = [row for row in one["rows"] if (one["machine"], row["question"]) not in shown]
        if rows:
            said.append(section({**one, "rows": rows}, folder))
            shown |= {(one["machine"], row["question"]) for row in rows}
        else:
            names.append(f"* {one['machine']}: commit {one['commit']}, {one['date']}")
    if names:
        said += ["## Earlier results, as files in `results`", "\n".join(names)]
    page.write_text(f"{head}{BEGIN}\n\n" + "\n\n".join(said) + f"\n\n{END}{tail}", "utf-8")


def section(kept: dict[str, Any], folder: Path) -> str:
    """One machine and commit, its questions in the order of the command."""
    rows = [Row(**row) for row in kept["rows"]]
    rows.sort(key=lambda row: QUESTIONS.index(row.question))
    form = ", short form" if kept["short"] else ""
    load = f", load {kept['load']:g}" if kept.get("load") is not None else ""
    versions = ", ".join(f"{name} {number}" for name, number in kept["versions"].items())
    parts = [
        f"## {kept['machine']}: commit {kept['commit']}, {kept['date']}{form}",
        f"{kept['system']}, Python {kept['python']}{load}; {versions}.",
    ]
    table_of_targets = targets(rows)
    if table_of_targets:
        parts += ["### Targets", markdown(["goal", "required", "measured", ""], table_of_targets)]
    beaten = wins(rows)
    if beaten:
        parts += ["### Where a peer wins", "\n".join(f"* {line}" for line in beaten)]
    for name, found in groupby(rows, lambda row: row.question):
        own = list(found)
        parts += [f"### {title(name)}", table(own)]
        stem = f"{results.slug(kept['machine'])}-{kept['commit'].strip('+')}"
        drawn = pictures.draw(name, own, folder / f"{stem}-{name}.svg")
        if drawn is not None:
            parts.append(f"![{name}](results/{drawn.name})")
    return "\n\n".join(parts)


def title(question: str) -> str:
    """The question's own title."""
    import importlib

    return str(importlib.import_module(f"benchmarks.questions.{question}").TITLE)


def wins(rows: Iterable[Row]) -> list[str]:
    """A sentence for each row in which a peer needs less time, or less memory, than mbody."""
    found = []
    for row in rows:
        ratio = row.ratio_to_mbody
        if row.engine.startswith((OURS, "Python")) or ratio is None or not 0.0 < ratio < 1.0:
            continue
        what = "memory" if row.bytes is not None else "time"
        error = f", error {row.error:.0e}" if row.error else ""
        found.append(f"{row.workload}: {row.engine} takes {ratio:.2f} of our {what}{error}")
    return found


def table(rows: Sequence[Row]) -> str:
    """The rows of one question, by its form: by errors, by sizes, or one below the other."""
    raced = [row for row in rows if LEVEL.match(row.workload) or EXACT.match(row.workload)]
    if raced:
        others = [row for row in rows if row not in raced]
        return "\n\n".join([by_errors(raced), *([table(others)] if others else [])])
    if all(SIZE.match(row.workload) for row in rows):
        return by_sizes(rows)
    lines = [
        [
            row.workload,
            row.engine,
            amount(row),
            each(row),
            error_text(row.error),
            ratio(row.ratio_to_mbody),
        ]
        for row in rows
    ]
    head = ["workload", "engine", "median", "each", "error", "by mbody"]
    if any(line[3] for line in lines):
        return markdown(head, lines)
    del head[3]
    return markdown(head, [line[:3] + line[4:] for line in lines])


def each(row: Row) -> str:
    """Of workloads that are many of one kind, the time of one."""
    for pattern, name in EACH:
        match = pattern.match(row.workload)
        if match and row.median_s is not None and row.bytes is None:
            return f"{seconds(row.median_s / math.prod(map(int, match.groups())))} a {name}"
    return ""


def by_errors(rows: Sequence[Row]) -> str:
    """A table a workload, engines by the required errors; below, the least errors of the others."""
    cells: dict[str, dict[str, dict[str, Row]]] = {}
    exact: list[str] = []
    ours: dict[str, Row] = {}
    for row in rows:
        level, least = LEVEL.match(row.workload), EXACT.match(row.workload)
        if level:
            cells.setdefault(level[1], {}).setdefault(row.engine, {})[level[2]] = row
        elif least and row.engine == OURS:
            ours[row.workload] = row
        elif least and row.median_s is not None:
            beside = ours.get(row.workload)
            more = ""
            if beside is not None:
                more = f"; mbody {seconds(beside.median_s)} to {error_text(beside.error)}"
                more += f", {ratio(row.ratio_to_mbody)}"
            exact.append(
                f"{row.engine} gets to {error_text(row.error)} in {seconds(row.median_s)}{more}."
            )
    parts = []
    for workload, engines in cells.items():
        levels = list(next(iter(engines.values())))
        lines = [[name, *(cell(of[level]) for level in levels)] for name, of in engines.items()]
        parts.append(markdown([workload, *(f"error {level}" for level in levels)], lines))
    return "\n\n".join([*parts, *(["\n".join(f"* {line}" for line in exact)] if exact else [])])


def cell(row: Row) -> str:
    """Time, ratio and the error that was found."""
    if row.median_s is None:
        return f"not reached ({error_text(row.error)})"
    by = "" if row.engine == OURS else f", {ratio(row.ratio_to_mbody)}"
    return f"{seconds(row.median_s)}{by} ({error_text(row.error)})"


def by_sizes(rows: Sequence[Row]) -> str:
    """Microseconds an evaluation and body by the number of bodies, and the exponent."""
    sizes = sorted({int(SIZE.match(row.workload)[2]) for row in rows})
    fits = exponents(rows)
    found: dict[tuple[str, str], dict[int, Row]] = {}
    for row in rows:
        shape, size = SIZE.match(row.workload).groups()
        found.setdefault((shape, row.engine), {})[int(size)] = row
    lines = []
    for (shape, engine), of in found.items():
        values = [f"{1e6 * of[n].median_s:.4g}" if n in of else "" for n in sizes]
        worst = max(row.error or 0.0 for row in of.values())
        fit = fits.get((shape, engine), math.nan)
        lines.append([shape, engine, *values, f"{fit:.2f}", error_text(worst)])
    head = ["shape", "engine", *(f"{n} [µs]" for n in sizes), "exponent", "worst error"]
    return markdown(head, lines)


def amount(row: Row) -> str:
    """Bytes where the question is of memory, else the median."""
    if row.bytes is not None:
        size, unit = (2**10, "KiB") if "bytes a body" in row.workload else (2**20, "MiB")
        return f"{row.bytes / size:.3g} {unit}"
    return seconds(row.median_s)


def seconds(value: float | None) -> str:
    """With the unit that fits."""
    if value is None:
        return "–"
    for unit, size in (("s", 1.0), ("ms", 1e-3), ("µs", 1e-6)):
        if abs(value) >= size:
            return f"{value / size:.3g} {unit}"
    return f"{value / 1e-9:.3g} ns"


def error_text(error: float | None) -> str:
    """One figure behind the point."""
    return "–" if error is None else f"{error:.1e}"


def ratio(value: float | None) -> str:
    """Times mbody's."""
    return "–" if value is None else f"{value:.3g}×"


def markdown(head: Sequence[str], lines: Iterable[Sequence[str]]) -> str:
    """A table whose columns stand one below the other."""
    texts = [list(head), *([str(part) for part in line] for line in lines)]
    wide = [max(len(text) for text in column) for column in zip(*texts)]
    rows = ["| " + " | ".join(t.ljust(w) for t, w in zip(line, wide)) + " |" for line in texts]
    return "\n".join([rows[0], "|" + "|".join("-" * (w + 2) for w in wide) + "|", *rows[1:]])
