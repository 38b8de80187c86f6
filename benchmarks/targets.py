"""Targets of mbody, compared with the measured rows; a goal without rows is left out."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Sequence
from typing import NamedTuple

import numpy as np

from benchmarks.frame import OURS, Row

__all__ = ["exponents", "targets"]

SIZE = re.compile(r"^(\w+) of (\d+), one evaluation$")
PIN = "Pinocchio + DOP853"


class Goal(NamedTuple):
    """A sentence, the bound, whether it is the least or the most, and how it is found."""

    title: str
    bound: float
    least: bool
    unit: str
    find: Callable[[Sequence[Row]], float | None]


def exponents(rows: Iterable[Row]) -> dict[tuple[str, str], float]:
    """Slope of log time over log bodies, from all sizes there are, by shape and engine."""
    found: dict[tuple[str, str], list[tuple[int, float]]] = {}
    for row in rows:
        match = SIZE.match(row.workload)
        if match and row.median_s is not None and row.median_s > 0.0:
            key = (match[1], row.engine)
            found.setdefault(key, []).append((int(match[2]), row.median_s))
    return {
        key: float(np.polyfit(*np.log(np.array(points)).T, 1)[0])
        for key, points in found.items()
        if len(points) > 1
    }


def pick(rows: Sequence[Row], workload: str, engine: str) -> Row | None:
    """The row of a workload, by its beginning."""
    for row in rows:
        if row.workload.startswith(workload) and row.engine == engine:
            return row
    return None


def times(workload: str, engine: str) -> Callable[[Sequence[Row]], float | None]:
    """Ratio to mbody."""

    def find(rows: Sequence[Row]) -> float | None:
        row = pick(rows, workload, engine)
        return None if row is None else row.ratio_to_mbody

    return find


def given(workload: str, engine: str) -> Callable[[Sequence[Row]], float | None]:
    """Medians of an engine and of mbody, both of which are given the start."""

    def find(rows: Sequence[Row]) -> float | None:
        theirs, ours = pick(rows, workload, engine), pick(rows, workload, f"{OURS}, start given")
        if theirs is None or ours is None or theirs.median_s is None or ours.median_s is None:
            return None
        return theirs.median_s / ours.median_s

    return find


def median(workload: str, size: float) -> Callable[[Sequence[Row]], float | None]:
    """Seconds of mbody in units of `size`."""

    def find(rows: Sequence[Row]) -> float | None:
        row = pick(rows, workload, OURS)
        return None if row is None or row.median_s is None else row.median_s / size

    return find


def error(workload: str) -> Callable[[Sequence[Row]], float | None]:
    """Error of mbody."""

    def find(rows: Sequence[Row]) -> float | None:
        row = pick(rows, workload, OURS)
        return None if row is None else row.error

    return find


def least(workload: str, engine: str) -> Callable[[Sequence[Row]], float | None]:
    """Ratio to mbody of the fastest of the engines whose names begin so."""

    def find(rows: Sequence[Row]) -> float | None:
        found = [
            row.ratio_to_mbody
            for row in rows
            if row.workload.startswith(workload)
            and row.engine.startswith(engine)
            and row.ratio_to_mbody is not None
        ]
        return min(found, default=None)

    return find


def memory_of(workload: str, size: float) -> Callable[[Sequence[Row]], float | None]:
    """Bytes of mbody in units of `size`."""

    def find(rows: Sequence[Row]) -> float | None:
        row = pick(rows, workload, OURS)
        return None if row is None or row.bytes is None else row.bytes / size

    return find


def growth(shape: str) -> Callable[[Sequence[Row]], float | None]:
    """Exponent of mbody, where it was measured up to 10 000 bodies."""

    def find(rows: Sequence[Row]) -> float | None:
        if pick(rows, f"{shape} of 10000, one evaluation", OURS) is None:
            return None
        return exponents(rows).get((shape, OURS))

    return find


def hub_by_chain(rows: Sequence[Row]) -> float | None:
    """Time of an evaluation of a hub of 1000 by that of a chain of 1000."""
    hub, chain = (pick(rows, f"{n} of 1000, one evaluation", OURS) for n in ("hub", "chain"))
    return None if hub is None or chain is None else hub.median_s / chain.median_s


def hub_memory(rows: Sequence[Row]) -> float | None:
    """Bytes of a hub of 1000 by those of a chain of 1000."""
    hub, chain = (pick(rows, f"{n} of 1000, bytes", OURS) for n in ("hub", "chain"))
    return None if hub is None or chain is None else hub.bytes / chain.bytes


def chain_memory(rows: Sequence[Row]) -> float | None:
    """Bytes a body of 10 000 by those of 1000: 1 is linear."""
    many, few = (pick(rows, f"chain of {n}, bytes", OURS) for n in (10_000, 1000))
    return None if many is None or few is None else many.bytes / few.bytes


def numba_beside(rows: Sequence[Row]) -> float | None:
    """Seconds of the first answer beyond Python with numba."""
    ours, base = (pick(rows, "first answer", n) for n in (OURS, "Python with numba"))
    return None if ours is None or base is None else ours.median_s - base.median_s


def per_link(rows: Sequence[Row]) -> float | None:
    """Microseconds a link of one evaluation in the core."""
    row = pick(rows, "chain of 1000, one evaluation in the core", OURS)
    return None if row is None else row.median_s * 1e3


def goals() -> list[Goal]:
    """All of them, in the order of the questions."""
    four, andrews, windows = "free_fourbar to 10 s", "andrews_squeezer to 0.03 s", "n_windows_40"
    turned, drawn = "10000 four-bars × 360 positions", "100000 slider-cranks × 360 positions"
    kept = "100000 slider-cranks, memory"
    linear = [
        Goal(f"exponent of {shape}s, 10 to 10 000 bodies", 1.05, False, "", growth(shape))
        for shape in ("chain", "ladder", "tree")
    ]
    both = [
        Goal(f"{title}, start given to both", bound, True, "×", given(workload, PIN))
        for title, bound, workload in (
            ("four-bar to 1e-6", 15, f"{four}, error 1e-06"),
            ("four-bar to 1e-9", 15, f"{four}, error 1e-09"),
            ("Andrews to 1e-9", 7, f"{andrews}, error 1e-09"),
        )
    ]
    return [
        Goal(
            f"four-bar to 1e-6: {PIN} by mbody", 15, True, "×", times(f"{four}, error 1e-06", PIN)
        ),
        Goal(
            f"four-bar to 1e-9: {PIN} by mbody", 15, True, "×", times(f"{four}, error 1e-09", PIN)
        ),
        Goal("four-bar to 1e-6", 3.0, False, " ms", median(f"{four}, error 1e-06", 1e-3)),
        Goal(
            f"Andrews to 1e-9: {PIN} by mbody", 7, True, "×", times(f"{andrews}, error 1e-09", PIN)
        ),
        Goal("Andrews to 1e-9", 1.5, False, " ms", median(f"{andrews}, error 1e-09", 1e-3)),
        Goal(
            "40 windows, as exact as MuJoCo's RK4 gets: it by mbody",
            10,
            True,
            "×",
            times(f"{windows} to 10 s, as exact as MuJoCo RK4", "MuJoCo RK4"),
        ),
        *both,
        *linear,
        Goal(
            "a step of 1 ms of the four-bar",
            15,
            False,
            " µs",
            median("free_fourbar, one step", 1e-6),
        ),
        Goal(
            "a period of 1 ms with a PID in Python", 20, False, " µs", median("PID at 1 kHz", 1e-6)
        ),
        Goal("hub of 1000 by chain of 1000, time", 3, False, "×", hub_by_chain),
        Goal("hub of 1000 by chain of 1000, memory", 3, False, "×", hub_memory),
        Goal("memory a body, chain of 10 000 by 1000", 1.2, False, "×", chain_memory),
        Goal("chain of 1000 for 1 s: energy lost", 1e-7, False, "", error("chain of 1000 for 1 s")),
        Goal("chain of 1000: an evaluation a link, core", 0.06, False, " µs", per_link),
        Goal(
            "a position, all reactions", 0.1, False, " µs", median("norton_fourbar, one of", 1e-6)
        ),
        Goal(
            "a linkage of 8 joints, 200 positions, all forces",
            0.2,
            False,
            " ms",
            median("linkage of 8 joints", 1e-3),
        ),
        Goal("10⁴ four-bars × 360, two threads", 0.3, False, " s", median(turned, 1.0)),
        Goal("the same, the goal beyond", 0.12, False, " s", median(turned, 1.0)),
        Goal(
            "the same: all reactions by hand in NumPy, one thread, by mbody",
            1,
            True,
            "×",
            times(turned, "NumPy by hand, all pins and the torque"),
        ),
        Goal(
            "the same: the fastest NumPy by hand by mbody",
            1,
            True,
            "×",
            least(turned, "NumPy by hand"),
        ),
        Goal("10⁵ slider-cranks × 360, 9 tolerances", 10, False, " s", median(drawn, 1.0)),
        Goal("their memory beyond the import", 300, False, " MB", memory_of(kept, 1e6)),
        Goal("import mbody", 0.4, False, " s", median("import", 1.0)),
        Goal("mbody --help", 0.3, False, " s", median("command --help", 1.0)),
        Goal("first answer beyond Python with numba", 1.0, False, " s", numba_beside),
        Goal("very first demo", 20.0, False, " s", median("very first demo", 1.0)),
    ]


def targets(rows: Sequence[Row]) -> list[list[str]]:
    """Lines of a table: goal, required value, measured value, and whether it is met."""
    lines = []
    for goal in goals():
        value = goal.find(rows)
        if value is None:
            continue
        met = value >= goal.bound if goal.least else value <= goal.bound
        sign = "≥" if goal.least else "≤"
        bound, found = (f"{number:.3g}{goal.unit}" for number in (goal.bound, value))
        lines.append([goal.title, f"{sign} {bound}", found, "met" if met else "missed"])
    return lines
