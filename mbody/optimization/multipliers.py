"""What binds at an optimum, and what one unit more of it would bring."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mbody.optimization.design_evaluation import Evaluation
from mbody.optimization.nonlinear_program import Program

__all__ = ["Binding", "binding"]

#: What is nearer to its limit than this part of its size may bind: the least of these with which
#: the derivatives balance up to such a part, so that of neighbouring instants the nearest counts.
NEAR, BALANCED = (1e-7, 1e-6, 1e-5, 1e-4), 1e-3
#: A multiplier below this part of the greatest effect does not.
COUNTS = 1e-6

#: Where no derivative is greater, as the part by which the objective would change over a range, the
#: place is a smooth optimum: what is left is measured by this.
FLAT = 0.1


@dataclass(frozen=True)
class Binding:
    """One thing that binds.

    Attributes
    ----------
    limit : int
        Number of the limit; -1 of a bound, -2 of mobility.
    number, upper : int, bool
        Of a bound: which number, and whether it is the upper one.
    multiplier : float
        In units of the objective by units of the limit.
    instant : int
        Where it binds most; -1 where that is no instant.
    """

    limit: int
    multiplier: float
    instant: int = -1
    number: int = -1
    upper: bool = False


def binding(program: Program, at: Evaluation) -> tuple[list[Binding], float]:
    """What binds at a design, by Karush's, Kuhn's and Tucker's conditions: the derivatives of the
    objective as those of what binds, with multipliers that are not negative (non-negative least
    squares; Lawson and Hanson 1974). Also what is left of the objective's derivatives, as a part.
    """
    found = []
    for near in NEAR:
        found.append(_binding(program, at, near))
        if found[-1][1] <= BALANCED:
            break
    return min(found, key=lambda pair: pair[1])


def _binding(program: Program, at: Evaluation, near: float) -> tuple[list[Binding], float]:
    """The same with all that is so near to its limit."""
    from scipy.optimize import nnls

    width, sizes = program.width, program.sizes or []
    columns: list[np.ndarray] = []
    about: list[tuple[int, int, int, bool, float]] = []
    for n, (limit, size) in enumerate(zip(program.limits, sizes, strict=True)):
        rows = limit.rows(at)
        left = np.abs(rows.values) if limit.equal else rows.values
        for k in np.flatnonzero(left <= near * size):
            for sign in (1.0, -1.0) if limit.equal else (1.0,):
                columns.append(sign * rows.slopes[k] * width / size)
                about.append((n, int(rows.instants[k]), -1, False, sign * size))
    own, slope, instant = at.mobility()
    if own < program.mobile * (1.0 + near):
        columns.append(slope * width / program.mobile)
        about.append((-2, instant, -1, False, program.mobile))
    for j in range(len(width)):
        for upper, gap in ((False, at.x[j] - program.low[j]), (True, program.high[j] - at.x[j])):
            if gap <= near * 1e-2 * width[j]:
                columns.append((-1.0 if upper else 1.0) * np.eye(len(width))[j])
                about.append((-1, -1, j, upper, width[j]))
    rows = program.aim.rows(at)
    top = np.flatnonzero(rows.values >= rows.values.max() - near * program.scale)
    slopes = rows.slopes[top] * width / program.scale
    # weights of the instants that share the greatest value: their sum is 1
    heavy = 1e3 * max(1.0, float(np.abs(slopes).max(initial=0.0)))
    left = [np.append(-one, heavy) for one in slopes] + [np.append(one, 0.0) for one in columns]
    right = np.append(np.zeros(len(width)), heavy)
    found, _ = nnls(np.array(left).T, right, maxiter=100 * (len(left) + 10))
    weights, parts = found[: len(top)], found[len(top) :]
    pull = weights @ slopes
    rest = pull - (np.array(columns).T @ parts if columns else 0.0)
    greatest = max(float(np.abs(slopes).max(initial=0.0)), FLAT)
    return _joined(about, parts, program), float(np.abs(rest).max(initial=0.0)) / greatest


def _joined(
    about: Sequence[tuple[int, int, int, bool, float]], parts: np.ndarray, program: Program
) -> list[Binding]:
    """Multipliers of one limit at several instants added; those that pull, the greatest first."""
    found: dict[tuple[int, int, bool], list[tuple[float, int, float]]] = {}
    for (limit, instant, number, upper, size), part in zip(about, parts, strict=True):
        if part > COUNTS:
            own = found.setdefault((limit, number, upper), [])
            own.append((float(part), instant, program.scale / size))
    made = [
        (
            max(part for part, _, _ in rows),
            Binding(
                limit=limit,
                multiplier=sum(part * unit for part, _, unit in rows),
                instant=max(rows)[1],
                number=number,
                upper=upper,
            ),
        )
        for (limit, number, upper), rows in found.items()
    ]
    return [one for _, one in sorted(made, key=lambda pair: -pair[0])]
