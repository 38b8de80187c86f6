"""Change points: instants at which branches meet, reached as limits from both sides.

There Φ_q loses rank although the motion goes on smoothly, as in a parallelogram whose links are all
in line. Such an instant is replaced by eight places around it, which are followed like any other
and interpolated from to the eighth order. Forces that have no limit are not given there, NaN, and
the result says so.
"""

from __future__ import annotations

import numpy as np

from mbody.analysis.driven.runner import PathEnded, Runner
from mbody.analysis.driven.time_grid import BY_DRIVER, BY_TIME, TimeGrid
from mbody.analysis.position.assembly_analysis import check_determined, closed
from mbody.analysis.position.closed_position import ClosedPosition
from mbody.errors import SolveError
from mbody.kernels.output import PER_PRIMITIVE
from mbody.solution.certificate import as_reported, changed
from mbody.solution.doubts import Doubt
from mbody.solution.histories import Record
from mbody.solution.solution import Solution

__all__ = ["through_change_points"]

#: The places, in steps; odd, so that none is the change point itself.
PLACES = np.array([-7.0, -5.0, -3.0, -1.0, 1.0, 3.0, 5.0, 7.0])
#: Lagrange's weights at zero.
WEIGHTS = np.array([-5.0, 49.0, -245.0, 1225.0, 1225.0, -245.0, 49.0, -5.0]) / 2048.0
#: Step in radians or model lengths of the driver: the interpolation's error is 0.3 · STEP⁸ of the
#: eighth derivative, 2e-12; rounding in forces is magnified by up to 1/STEP³.
STEP = 4e-2
#: Most change points in one sweep, and those that a sentence names.
MOST, NAMED = 32, 4


def through_change_points(
    runner: Runner, start: ClosedPosition, grid: TimeGrid, singular: set[int], error: SolveError
) -> Solution:
    """The whole sweep, with the `singular` instants taken as limits; `error` is raised where they
    turn out to be no change points."""
    if grid.mode not in (BY_TIME, BY_DRIVER) or runner.system.batch is not None:
        raise error
    while True:
        spread, places = _spread(runner, grid, singular, error)
        beginning = _beginning(runner, start, spread, error) if 0 in singular else start
        try:
            block = runner.scalar(beginning, spread)
            break
        except PathEnded as stuck:
            k = int(np.searchsorted(places, stuck.done, side="right")) - 1
            inside = k in singular
            off = abs(stuck.place - grid.s[k])
            if inside or len(singular) >= MOST or off > 1e-3 * np.ptp(grid.s):
                raise error from None
            singular = singular | {k}
            error = runner.explain(stuck, beginning, spread)
    merged = np.empty((len(grid.s), block.shape[1], 1))
    missing: dict[int, list[str]] = {}
    for k in range(len(grid.s)):
        if k in singular:
            around = block[places[k] : places[k] + len(PLACES)]
            merged[k] = np.tensordot(WEIGHTS, around, 1)
            primitives = _without_limit(runner, around, error)
            for e in primitives:
                first = 3 * runner.system.coordinates + PER_PRIMITIVE * e
                merged[k, first : first + PER_PRIMITIVE] = np.nan
            if primitives:
                missing[k] = list(
                    dict.fromkeys(runner.system.owners[e][0].name for e in primitives)
                )
        else:
            merged[k] = block[places[k]]
    found = runner.solution(beginning, grid, Record([merged], len(grid.s), batch=False))
    note = f"{len(singular)} of {len(grid.s)} instants are change points, given as limits"
    # what the residuals show is not computed yet: residuals know of no forces that are missing
    said = as_reported(found)
    doubts = (*said.doubts, *((_incomplete(runner, grid, missing),) if missing else ()))
    return changed(found, notes=(*said.notes, note), doubts=doubts)


def _incomplete(runner: Runner, grid: TimeGrid, missing: dict[int, list[str]]) -> Doubt:
    """What is said of forces that are not given, by instant the names of their elements."""
    names = list(dict.fromkeys(name for found in missing.values() for name in found))
    places = [runner.where(float(grid.s[k]), grid) for k in missing]
    listing = "; ".join(places[:NAMED])
    listing += f"; and {len(places) - NAMED} more" if len(places) > NAMED else ""
    return Doubt(
        "incomplete",
        f"forces grow without bound towards change points of '{runner.system.mechanism.name}' and "
        f"are not given there: at {listing}: those of "
        f"{', '.join(repr(name) for name in names)}",
        float(grid.t[min(missing)]),
        tuple(names),
    )


def _spread(
    runner: Runner, grid: TimeGrid, singular: set[int], error: SolveError
) -> tuple[TimeGrid, np.ndarray]:
    """The grid with eight places for each singular instant, and where each instant begins in it."""
    index: list[int] = []
    shift: list[float] = []
    places: list[int] = []
    for k in range(len(grid.s)):
        places.append(len(index))
        step = _step(runner, grid, k, error) if k in singular else 0.0
        offsets = PLACES * step if k in singular else np.zeros(1)
        index += [k] * len(offsets)
        shift += offsets.tolist()
    moved = grid.take(np.array(index))
    s = moved.s + np.array(shift)
    if grid.mode == BY_TIME:
        return TimeGrid(grid.mode, s, s, moved.given), np.array(places)
    moved.given[:, 0, 0] = s
    return TimeGrid(grid.mode, s, moved.t, moved.given), np.array(places)


def _step(runner: Runner, grid: TimeGrid, k: int, error: SolveError) -> float:
    """Change of the path parameter by which the fastest driver moves by STEP."""
    system = runner.system
    rates = [1.0] * len(system.leaders)
    if grid.mode == BY_TIME:
        rates = [abs(system.law_of(d).derivatives(grid.s[k])[1]) for d in system.leaders]
    units = [d.unit(system.length) for d in system.leaders]
    speed = max((r / u for r, u in zip(rates, units, strict=True)), default=0.0)
    if speed == 0.0:
        raise error
    return STEP / speed


def _beginning(
    runner: Runner, start: ClosedPosition, spread: TimeGrid, error: SolveError
) -> ClosedPosition:
    """A regular position at the first place, closed from the singular one."""
    system = runner.system
    pose = start.work.q[:, 0].copy()
    try:
        beginning = closed(system, float(spread.t[0]), spread.first(system), None, pose=pose)
        check_determined(system, beginning, runner.analysis)
    except SolveError:
        raise error from None
    beginning.notes[:] = start.notes
    return beginning


def _without_limit(runner: Runner, around: np.ndarray, error: SolveError) -> list[int]:
    """Primitives whose forces grow without bound towards the middle of the places.

    `error` is raised where the motion does.
    """
    near, far = np.abs(around[4] - around[3]), np.abs(around[5] - around[2])
    size = np.empty_like(near)
    n, primitives = runner.system.coordinates, len(runner.system.owners)
    # rounding is distinguished from growth by the greatest number of the same sort
    for rows in (slice(0, n), slice(n, 2 * n), slice(2 * n, 3 * n), slice(3 * n, None)):
        size[rows] = np.abs(around[:, rows]).max(initial=0.0)
    growing = (near > 0.8 * far + 1e-5 * size)[:, 0]
    if growing[: 3 * n].any():
        raise error
    return np.flatnonzero(
        growing[3 * n :][: PER_PRIMITIVE * primitives].reshape(-1, PER_PRIMITIVE).any(axis=1)
    ).tolist()
