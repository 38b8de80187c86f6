"""The verb `close_loops`: one consistent position, and velocities, from a rough guess."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from mbody.analysis.driven.time_grid import Drive, time_grid
from mbody.analysis.initial.initial_velocities import branch_rates, no_velocities
from mbody.analysis.initial.unsaid_rates import unsaid_rates
from mbody.analysis.position.assembly_analysis import as_system, closed, raise_user_error
from mbody.analysis.position.closed_position import ClosedPosition
from mbody.analysis.singular.branches import BESIDE
from mbody.analysis.singular.prescribed_values import Prescribed
from mbody.analysis.singular.singular_positions import SUSPECT, Singular, singular
from mbody.errors import ModelError
from mbody.kernels.layout import Work
from mbody.kernels.loop_closure import project
from mbody.model.body import Guesses
from mbody.model.mechanism import Mechanism
from mbody.model.numbers import number_in
from mbody.quantities.types import Number
from mbody.solution.histories import Record
from mbody.solution.solution import Solution
from mbody.system.rank import dense, dense_rates, rank_of, too_large
from mbody.system.system import System

__all__ = ["close_loops"]

#: A rate is met to this part of the greatest; bodies that a note names.
MET, NAMED = 1e-9, 3


def close_loops(
    model: Mechanism | System,
    t: float = 0.0,
    *,
    drive: Drive | None = None,
    guess: Guesses | None = None,
    rates: Mapping[str, Number] | None = None,
) -> Solution:
    """Close the loops from a rough guess: position analysis, initial assembly; velocities too.

    Free degrees of freedom stay as near to the guess as the loops allow (least weighted change).

    Parameters
    ----------
    model : Mechanism or System
        With or without drivers.
    t : float
        Time at which drivers and laws are taken.
    drive : mapping, optional
        Value, or (value, rate), of drivers by name instead of their laws.
    guess : mapping, optional
        By body, instead of its own guess: angle [rad], or (x, y, angle) of the link axes.
    rates : mapping, optional
        Angular velocity of bodies [rad/time]; where joints and drivers do not allow all of them,
        the nearest that they allow, and a note says so. What they leave open moves least.

    Returns
    -------
    Solution
        One instant with positions and velocities.

    Raises
    ------
    SolveError
        When the loops cannot close: with the smallest gap and where; when no velocities agree with
        the drivers.

    Examples
    --------
    >>> import mbody
    >>> run = close_loops(mbody.makers.four_bar(1, 3, 2, 3.5), drive={"motor": 1.0})
    >>> run.checks.constraint < 1e-12
    True
    """
    system = as_system(model)
    if system.batch is not None:
        raise ModelError("close_loops takes one design: choose one of the batch with design(n)")
    request = time_grid(system, t, drive, None, None)
    if len(request.s) != 1:
        raise ModelError("close_loops takes one instant: give one time and one value a driver")
    first = request.first(system)
    start = closed(system, float(request.t[0]), first, guess)
    work = start.work
    if rates is not None and not isinstance(rates, Mapping):
        raise ModelError(f'rates must be a dict such as {{"crank": 2.0}}, not {rates!r}')
    turning: dict[str, float] = {}
    for name, rate in (rates or {}).items():
        if name not in system.bodies or name == "ground":
            raise ModelError(f"there is no moving body {name!r} to give a rate", str(name))
        turning[name] = number_in(system.mechanism, rate, "angular velocity", name, "rate")
        if too_large(system):
            work.v[3 * system.bodies[name] + 2] = turning[name]
    if drive:
        for n, row in enumerate(system.layout.driver_row):
            work.signal[row + 1] = request.given[0, n, 1]
    project(system.runtime(), work, start.regularization)
    raise_user_error(system)
    here = _singular(system, start, float(request.t[0]), turning)
    if here is None:
        _check_velocities(system, work)
        notes = [*start.notes, *_turned(system, work, turning)]
        v = work.v[: system.coordinates, 0] / system.coordinate_units
        said = np.zeros((len(turning), len(v)))
        said[range(len(turning)), [3 * system.bodies[name] + 2 for name in turning]] = 1.0
        notes += unsaid_rates(system, work, v, said)
    else:
        prescribed = [Prescribed(name, "omega", rate) for name, rate in turning.items()]
        q = work.q[: system.coordinates, 0].copy()
        v, more = branch_rates(system, here, float(request.t[0]), q, prescribed)
        work.v[: len(v), 0] = v
        notes = [*start.notes, *more]
    n3 = system.coordinates
    block = np.zeros((1, system.page_rows, 1))
    block[0, :n3], block[0, n3 : 2 * n3] = work.q[:n3], work.v[:n3]
    return Solution(
        system=system,
        analysis="close_loops",
        t=request.t,
        record=Record([block], 1, batch=False),
        given=request.given if drive else None,
        regularization=start.regularization,
        notes=tuple(notes),
    )


def _singular(
    system: System, start: ClosedPosition, t: float, turning: Mapping[str, float]
) -> Singular | None:
    """The singular position that a start is at, where velocities depend on its branches."""
    work = start.work
    moving = any(turning.values()) or bool(np.abs(work.v[: system.coordinates]).max(initial=0.0))
    if not moving or not (start.regularization or start.ratio < SUSPECT):
        return None
    own = system.work()
    own.q[:], own.signal[:], own.time[:] = work.q, work.signal, work.time
    return singular(system, own, t, BESIDE)


def _turned(system: System, work: Work, rates: Mapping[str, float]) -> list[str]:
    """Add the free motion that turns bodies as they should; sentences where it cannot."""
    if not rates:
        return []
    columns = [3 * system.bodies[name] + 2 for name in rates]
    request = np.array(list(rates.values()))
    if not too_large(system):
        scale = system.coordinate_units
        motions = rank_of(dense(system, work)[1]).motions
        left = request - work.v[columns, 0]
        way = np.linalg.lstsq(motions[:, columns].T, left, rcond=1e-9)[0]
        work.v[: system.coordinates, 0] += scale * (way @ motions)
    found = work.v[columns, 0]
    unit = system.mechanism.units.of("angular velocity")
    parts = [
        f"'{name}' turns at {now:.6g} {unit}, not at {rate:.6g}"
        for name, rate, now in zip(rates, request, found, strict=True)
        if abs(now - rate) > MET * float(np.abs(request).max())
    ]
    if not parts:
        return []
    more = f", and {len(parts) - NAMED} more" if len(parts) > NAMED else ""
    return [
        f"rates: {', '.join(parts[:NAMED])}{more}: joints and drivers do not allow all that were "
        "requested; the nearest were taken"
    ]


def _check_velocities(system: System, work: Work) -> None:
    """Refuse velocities that the constraints do not allow, as of a driver at its dead centre."""
    if too_large(system) or not system.rows:
        return
    G = dense(system, work)[1]
    nu = dense_rates(system, work)
    v = work.v[: system.coordinates, 0] / system.coordinate_units
    rest = np.abs(G @ v - nu)
    if rest.max() > 1e-6 * max(np.abs(nu).max(), np.abs(v).max()):
        raise no_velocities(system, nu)
