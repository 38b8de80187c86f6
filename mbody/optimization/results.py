"""From the end of searches to what the user gets."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from mbody.optimization.aims_and_limits import Aim, Limit
from mbody.optimization.design_evaluation import Evaluation
from mbody.optimization.multi_start import Ended, MultiStart
from mbody.optimization.multipliers import Binding, binding
from mbody.optimization.nonlinear_program import FASTEST, Program
from mbody.optimization.optimum import Active, Optimum, ParetoPoint
from mbody.optimization.tolerance_band import tolerance_band
from mbody.solution.doubts import inherited
from mbody.solution.measures import measured

__all__ = ["optimum_of"]

#: Derivatives that are not balanced by what binds, as a part of the greatest, are said.
OPEN = 1e-2
MOBILE = "mobility: no body moves {} times as fast as in the description"


def optimum_of(
    search: MultiStart,
    ended: Ended,
    aim: Aim,
    limits: Sequence[Limit],
    loss: float,
    front: tuple[ParetoPoint, ...] = (),
    aims: Sequence[Aim] = (),
) -> Optimum:
    """The result of searches; of two `aims` with their front."""
    at, program, ranges = ended.best.at, ended.program, search.ranges
    run = at.run
    found, rest = binding(program, at)
    unit = measured(run, aim.column.measure)[2]
    active = tuple(_active(one, program, at, search, unit) for one in found)
    notes = list(ended.notes)
    if ended.starts > 1 and ended.agreeing == 1:
        notes.append(
            f"only one of {ended.starts} searches ended at this value, others at worse ones: more "
            "starts may find a better one"
        )
    if rest > OPEN and ended.status == "completed":
        notes.append(
            f"the search ended where the objective still falls by {rest:.1%} of its steepest way: "
            "it is near a place without derivatives, or stopped early"
        )
    goals = list(aims) or [aim]
    starting = search.evaluator(search.evaluator.present())
    begin = None if starting is None else tuple(one.value(starting) for one in goals)
    values = tuple(one.value(at) for one in goals)
    sizes = np.array([abs(value) for value in values] + list(program.sizes or []))
    band = tolerance_band(search.screen.about(at), at.x, (ranges.low, ranges.high), sizes, loss)
    words = [f"{'greatest' if one.greatest else 'least'} {one.text}" for one in goals]
    theirs = [measured(run, one.column.measure)[2] for one in goals]
    own = inherited(run, notes=tuple(notes))
    if ended.status != "completed" and own["status"] == "completed":
        own["status"] = ended.status
    given = ranges.given
    return Optimum(
        aim=", ".join(words),
        aims=tuple(zip(words, theirs, strict=True)),
        objective=values if aims else values[0],
        start_objective=begin if aims or begin is None else begin[0],
        values=dict(zip(given, at.x.tolist(), strict=True)),
        start_values=dict(zip(given, search.evaluator.present().tolist(), strict=True)),
        units={**dict(zip(given, ranges.units, strict=True)), "objective": ", ".join(theirs)},
        bounds={
            name: (float(low), float(high))
            for name, low, high in zip(given, ranges.low, ranges.high, strict=True)
        },
        constraints={limit.text: limit.margin(at) for limit in limits},
        active=active,
        starts=ended.starts,
        agreeing=ended.agreeing,
        evaluations=search.evaluator.count,
        band={
            name: (float(low), float(high)) for name, (low, high) in zip(given, band, strict=True)
        },
        loss=loss,
        pareto=front,
        run=run,
        **own,
    )


def _active(
    one: Binding, program: Program, at: Evaluation, search: MultiStart, unit: str
) -> Active:
    t = float(at.run.t[one.instant]) if one.instant >= 0 else None
    if one.limit == -2:
        return Active(MOBILE.format(f"{FASTEST:g}"), one.multiplier, unit, t)
    if one.limit == -1:
        ranges, sign = search.ranges, "<=" if one.upper else ">="
        own = ranges.units[one.number]
        bound = (ranges.high if one.upper else ranges.low)[one.number]
        text = f"{ranges.given[one.number]} {sign} {bound:.6g} {own}".rstrip()
        return Active(text, one.multiplier, _per(unit, own), None)
    limit = program.limits[one.limit]
    return Active(limit.text, one.multiplier, _per(unit, limit.unit), t)


def _per(unit: str, by: str) -> str:
    """Unit of a quotient."""
    if not by:
        return unit
    below = f"({by})" if any(letter in by for letter in "·/ ") else by
    return f"{unit or '1'}/{below}"
