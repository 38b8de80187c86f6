"""Free motions of many designs of one topology: what all share, and their integration on lanes.

Designs go side by side, one a lane, each with its own steps, as `simulate` of it alone has them in
ordinary places. What a design gets does not depend on its neighbours, so the numbers do not depend
on how a batch is cut.

With designs that are driven (`mbody.analysis.driven.batch`) they share how loops close
and what comes back: rows, and whom to trust. All else is each one's own: driven designs are at the
same instant in all lanes and each group of lanes ends together, free ones have their own times and
a lane that is free takes the next design.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from mbody.analysis.contact.unilateral import has_modes
from mbody.analysis.driven.diagnosis import undetermined, weightless
from mbody.analysis.dynamics.integrators import (
    PATIENT,
    REFINEMENTS,
    auxiliary_sizes,
    coordinate_sizes,
    first_step,
)
from mbody.analysis.dynamics.interruptions import has_short_pulses
from mbody.analysis.dynamics.options import MotionRequest, last_time, motion_request, tolerances
from mbody.analysis.initial.initial_state import BatchStart, batch_start, initial_states
from mbody.core.lanes import LANES, aligned
from mbody.kernels.layout import artificial_masses, inverse_masses
from mbody.kernels.runge_kutta import Explicit, order_5, order_8
from mbody.kernels.runge_kutta_lanes import (
    CONTROLS,
    Batch,
    LaneWorkspace,
    initial_derivatives,
    runge_kutta_lanes,
)
from mbody.kernels.step_state import Tolerances
from mbody.model.element import STEADY
from mbody.system.system import System

Array = np.ndarray

#: Steps of all lanes in one call of the kernel; between calls Ctrl-C takes effect.
AT_ONCE = 500
#: Methods that lanes have.
TABLES = {"dop853": order_8, "dopri5": order_5}


@dataclass(frozen=True, eq=False)
class LaneMotions:
    """Start and settings that all free motions of a batch share.

    `start`: How they begin.
    `request`: How long they go on, how they are integrated, and which instants are kept.
    `light`: Whether some body has so little mass that another replaces it.
    """

    start: BatchStart
    request: MotionRequest
    light: bool


def lane_motions(
    system: System, names: tuple[str, ...], how: Mapping[str, Any]
) -> LaneMotions | None:
    """Start and settings shared by the designs of a system that differ in `names`; None where they
    go one by one: with other methods, events, released drivers, redundant joints, short pulses of
    time, or code of the user.
    """
    if (
        system.has_user_code
        or has_modes(system)
        or any(one.start == STEADY for one in system.mechanism.states)
    ):
        return None
    get = how.get
    last, errors = last_time(system, get("until")), tolerances(system, get("rtol"), get("atol"))
    start, first = batch_start(system, names, how)
    request = motion_request(
        system,
        float(first.t[-1]),
        last,
        errors,
        method=get("method"),
        step=get("step"),
        kept=(get("instants"), get("every"), get("times")),
        events=get("events"),
        release=get("release"),
    )
    if (
        request.settings.method not in TABLES
        or request.events
        or request.release
        or first.regularization
        or has_short_pulses(system, request.first, last)
    ):
        return None
    light = artificial_masses(system.layout, system.mass, system.sizes)
    return LaneMotions(start, request, bool(light.any()))


def integrate_lanes(
    system: System, motions: LaneMotions, values: Mapping[str, Array], wanted: Array
) -> tuple[Array, np.ndarray]:
    """Rows of all instants: (rows, designs, instants), and which designs can be trusted. `wanted`
    (rows,).
    """
    q, v, good = initial_states(motions.start, system, values)
    good &= artificial_masses(system.layout, system.mass, system.sizes) == motions.light
    good &= np.isfinite(q).all(axis=1) & np.isfinite(v).all(axis=1)
    for design in np.flatnonzero(good).tolist():
        good[design] = _moves(system, design, motions.request.first, q[design], v[design])
    rows = np.full((len(wanted), len(q), len(motions.request.times)), np.nan)
    which = np.flatnonzero(good)
    if len(which):
        own = np.broadcast_to(system.first_states, (system.layout.owns, len(q))).T
        first = np.hstack([q, v, own])[which]
        found, sound = _integrated(system, motions, which, first, wanted)
        rows[:, which], good[which] = found, sound
    return rows, good


def _moves(system: System, design: int, t: float, q: Array, v: Array) -> bool:
    """Whether masses determine the motion of a design."""
    if system.mass[: system.coordinates, design].all():
        return True
    one = system.design(design)
    return undetermined(one, t, q, v) is None and weightless(one) is None


def _integrated(
    system: System, motions: LaneMotions, which: Array, y: Array, wanted: Array
) -> tuple[Array, np.ndarray]:
    """Rows of the designs `which`, from their first states y, and which of them came to the end."""
    request, n, n3 = motions.request, len(which), system.coordinates
    settings, times, table = request.settings, request.times, TABLES[request.settings.method]()
    work, mass = system.work(LANES), system.mass[:, which]
    count = system.record_rows
    record = aligned(max(2, count), LANES)
    batch = Batch(
        par=system.par[:, which],
        mass=mass,
        weight=inverse_masses(system.layout, mass, system.sizes),
        y=y.T.copy(),
        derivative=np.empty((system.state_count, n)),
        scale=np.empty((system.state_count, n)),
        near=np.empty((max(1, system.layout.nodes), n)),
        step=np.empty(n),
        conditioning=np.empty(n),
        begin=request.first,
        times=times,
        rows=wanted,
        output=np.empty((len(wanted), n, len(times))),
        bad=np.zeros(n),
    )
    initial_derivatives(system.layout, work, REFINEMENTS, batch, record)
    if batch.bad.all():
        return batch.output, batch.bad == 0.0
    whole, derivative = float(times[-1]) - request.first, np.ascontiguousarray(batch.derivative.T)
    sizes = coordinate_sizes(system, y[:, n3 : 2 * n3], derivative[:, n3 : 2 * n3])
    own = np.broadcast_to(auxiliary_sizes(system)[:, None], (system.layout.owns, n))
    scale = np.hstack([sizes, own.T])
    batch.scale[:] = scale.T
    batch.step[:] = first_step(settings, np.ascontiguousarray(batch.y.T), derivative, scale, whole)
    lanes = _workspace(batch, table, record, int(np.flatnonzero(batch.bad == 0.0)[0]), work)
    tolerances = Tolerances(
        relative=settings.rtol,
        absolute=settings.atol,
        refinements=REFINEMENTS if motions.light else 0,
        full_refinements=REFINEMENTS,
        patience=PATIENT,
    )
    bundles = system.layout, work, table, tolerances, batch, lanes
    while not runge_kutta_lanes(*bundles, float(times[-1]), AT_ONCE):
        pass
    return batch.output, batch.bad == 0.0


def _workspace(
    batch: Batch, table: Explicit, record: Array, design: int, work: Any
) -> LaneWorkspace:
    """The lanes before they have designs: numbers of one of them in all."""
    n, terms = len(batch.y), 3 + len(table.D)
    designs = np.full(LANES + 1, -1)
    designs[-1] = 0
    lanes = LaneWorkspace(
        state=aligned(CONTROLS, LANES),
        design=designs,
        y=aligned(n, LANES),
        last=aligned(n, LANES),
        stage=aligned(n, LANES),
        end=aligned(n, LANES),
        scale=aligned(n, LANES),
        K=aligned(len(table.A) * n, LANES).reshape(-1, n, LANES),
        F=aligned(terms * n, LANES).reshape(-1, n, LANES),
        record=record,
    )
    for array, own in zip(
        (lanes.y, lanes.scale, lanes.K[0], work.par, work.mass, work.weight),
        (batch.y, batch.scale, batch.derivative, batch.par, batch.mass, batch.weight),
        strict=True,
    ):
        array[: len(own)] = own[:, design : design + 1]
    return lanes
