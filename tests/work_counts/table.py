"""The table of counts that were accepted, and how counts of today are compared with it."""

import tomllib
from pathlib import Path

from tests.work_counts import plain
from tests.work_counts.workloads import (
    MOTIONS,
    SQUARE,
    SYMBOLIC,
    calls_from_python,
    square,
    symbolic,
)

TABLE = Path(__file__).with_name("table.toml")
#: Other processors and versions of numba fuse other products into sums, so that last digits differ.
#: Seventeen runs of each motion, their tolerances different in the thirteenth digit, took the same
#: steps; two by RATTLE were up to 0.6 % apart in evaluations, at singular positions.
ROUNDED = 0.02
#: Corrections by the residual end where it is rounding: of turns of three mechanisms, with lengths
#: that differ in the thirteenth digit, 6 % apart at most. Of few counts two are more than that.
BY_RESIDUAL, FEW = 0.10, 2
ACCEPT = (
    "if that is meant, `python -m tests.work_counts` writes the table anew; the reason belongs "
    "into the commit"
)
OPENING = """\
# Work of fixed workloads: `python -m tests.work_counts` writes this table, a test compares it with
# what is counted then. Motions: steps, evaluations and so on of `run.stats`, and calls of compiled
# functions from Python. Calls: of functions within kernels. Symbolic: sizes of the elimination of
# S = G W⁻¹ Gᵀ. Square: of the LU of Φ_q with fixed pivots.
"""


def motion(workload):
    """Counts of a compiled motion."""
    with calls_from_python() as calls:
        found = {name: n for name, n in workload.run().stats.items() if n}
    return found | {f"calls of {name}": n for name, n in sorted(calls.items())}


def workloads():
    """(section, name, what counts it) of all workloads but those counted in plain Python."""
    yield from (("motions", w.name, lambda w=w: motion(w)) for w in MOTIONS)
    yield from (("symbolic", name, lambda n=name: symbolic(n)) for name in SYMBOLIC)
    yield from (("square", name, lambda n=name: square(n)) for name in SQUARE)


def accepted():
    """{section: {workload: {count: number}}} as it was written."""
    return tomllib.loads(TABLE.read_text("utf-8"))


def counted():
    """The same, counted now."""
    found = {}
    for section, name, count in workloads():
        found.setdefault(section, {})[name] = count()
    found["calls"] = plain.counts()
    return found


def written(counts):
    """The text of a table."""
    lines = [OPENING]
    for section, entries in counts.items():
        for name, numbers in entries.items():
            lines.append(f'[{section}."{name}"]')
            lines += [f"{_key(count)} = {n}" for count, n in numbers.items()]
            lines.append("")
    return "\n".join(lines)


def _key(count):
    return count if count.isidentifier() else f'"{count}"'


def allowance(section, count, before):
    """By how much a count may differ."""
    if section == "symbolic" or (section == "motions" and count.startswith("calls of")):
        # lists of names and integers; a kernel is called once for so many steps
        return max(0.0, ROUNDED * before) if section == "motions" else 0.0
    if count.startswith("solutions") and section == "calls":
        return max(FEW, BY_RESIDUAL * before)
    return max(FEW if section != "square" else 0.0, ROUNDED * before)


def complaints(section, name, before, now):
    """A sentence for each count of a workload that has changed by more than is allowed."""
    found = []
    for count in dict.fromkeys([*before, *now]):
        old, new = before.get(count, 0), now.get(count, 0)
        if abs(new - old) > allowance(section, count, old):
            more = "more" if new > old else "less"
            part = f", {100 * (new - old) / old:+.1f} %" if old else ""
            found.append(f"{name}: {count} {new}, {more} than the {old} of before{part}; {ACCEPT}")
    return found


def stale(before, now):
    """Sentences of workloads that the table lacks, and of those that it has and nobody counts."""
    return [
        *(f"{name}: not in {TABLE.name}; {ACCEPT}" for name in now if name not in before),
        *(f"{name}: in {TABLE.name}, but not counted; {ACCEPT}" for name in before - now),
    ]
