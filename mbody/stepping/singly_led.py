"""Motions among many that go on alone, by the steps of a single `Simulator`, and come back."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np

from mbody.analysis.contact.unilateral import has_modes
from mbody.analysis.driven.contacts import one_sided
from mbody.analysis.dynamics.batch_integration import TABLES
from mbody.analysis.dynamics.interruptions import tables_of_time
from mbody.errors import ModelError, SolveError
from mbody.kernels.runge_kutta_lanes_control import JUDGED_STEPS, JUDGED_TIME
from mbody.kernels.step_state import (
    BEST_CONDITIONING,
    FASTEST,
    KNOWN_UNTIL,
    NEAR_SINGULAR,
    NEXT,
    PROGRESS,
    REJECTED,
    SHORTENED_UNTIL,
    SMOOTH_COUNT,
    STEPS,
    STIFF_COUNT,
    TIME,
)
from mbody.stepping.lane_readings import LaneReadings
from mbody.stepping.simulator import Simulator
from mbody.stepping.simulator_state import SimulatorState
from mbody.system.system import System

__all__ = ["SinglyLed"]

Array = np.ndarray

#: Slots that a motion takes with it from the lanes to steps of its own.
TAKEN = [NEXT, STEPS, REJECTED, BEST_CONDITIONING, STIFF_COUNT, SMOOTH_COUNT, FASTEST]


class SinglyLed(LaneReadings):
    """What leads single motions on; all together are led on in `Simulators`."""

    #: The system as it was given; arguments of `Simulator`; simulators by design.
    _whole: System
    _how: dict[str, Any]
    _sims: dict[int, Simulator]
    #: Whether ordinary steps are taken on lanes.
    _on_lanes: bool
    #: States of the motions that are alone; why motions have ended or failed; doubts.
    _states: dict[int, SimulatorState]
    _reasons: dict[int, str]
    _doubts: dict[int, str]

    def _may_use_lanes(self, begun: SimulatorState) -> bool:
        """Whether ordinary steps of this mechanism, in this way, are those that lanes take."""
        system, carried = self.system, begun.carried
        assert carried is not None
        own = system.mechanism.simulation
        return not (
            carried.restart.way.method not in TABLES
            or carried.regularization
            or (own is not None and (own.events or own.release))
            or system.has_user_code
            or one_sided(system)
            or has_modes(system)
            or tables_of_time(system)
            or any(list(one.distances()) for one in system.mechanism.constraints)
        )

    def _sim(self, k: int) -> Simulator:
        """The simulator that leads motion k on where it goes alone; one for all of one design."""
        design = k if self._whole.batch is not None else 0
        found = self._sims.get(design)
        if found is None:
            try:
                found = Simulator(self._whole.design(design), **self._how)
            except (ModelError, SolveError) as error:
                if self._whole.batch is None:
                    raise
                raise type(error)(f"design {design}: {error}", error.element) from error
            self._sims[design] = found
        return found

    def _alone(self) -> Iterator[tuple[int, Simulator]]:
        for k, state in self._states.items():
            sim = self._sim(k)
            sim.state = state
            sim.inputs.set_all(self._inputs_of(k))
            yield k, sim

    def _inputs_of(self, k: int) -> Array:
        values = self._lanes.some(self._lanes.many.inputs, np.array([k]))[0]
        return np.array(values[: len(self._input_names)])

    def _sent_alone(self, k: int) -> Simulator:
        """The simulator of motion k, set to its present state."""
        sim, state, one = self._sim(k), self._states.get(k), np.array([k])
        if state is not None:
            sim.state = state
            sim.inputs.set_all(self._inputs_of(k))
            return sim
        lanes, n3 = self._lanes, self.system.coordinates
        y, slots = lanes.some(lanes.many.y, one)[0], lanes.some(lanes.many.state, one)[0]
        sim.reset(
            SimulatorState(
                t=float(slots[TIME]),
                q=y[:n3],
                v=y[n3 : 2 * n3],
                own=y[2 * n3 :],
                inputs=self._inputs_of(k),
                bodies=tuple(body.name for body in self.system.mechanism.bodies),
            )
        )
        found = sim.state
        if found.carried is not None and slots[STEPS]:
            # it goes on with the steps that it had
            restart = found.carried.restart
            state_slots = restart.state.copy()
            state_slots[TAKEN] = slots[TAKEN]
            scale = lanes.some(lanes.many.scale, one)[0]
            restart = replace(restart, state=state_slots, scale=scale)
            sim.state = replace(found, carried=replace(found.carried, restart=restart))
        return sim

    def _take_back(self, k: int, sim: Simulator) -> None:
        """What a motion has become alone; it goes back to the lanes where all is ordinary."""
        lanes, one, found = self._lanes, np.array([k]), sim.state
        many, carried = lanes.many, found.carried
        y = np.concatenate([found.q, found.v, found.own])[None]
        lanes.put_all(many.y, one, y)
        lanes.put(many.state, TIME, one, found.t)
        if carried is not None and carried.passage[2]:
            self._doubts.setdefault(k, carried.passage[2][0].message)
        if found.status != "completed":
            self._reasons[k] = found.status
        many.bad[k] = 1.0
        self._states[k] = found
        if carried is None or not self._on_lanes or k in self._reasons:
            return
        slots, t = carried.restart.state, found.t
        known = t <= slots[KNOWN_UNTIL] or t <= slots[SHORTENED_UNTIL] or carried.passage[0]
        if carried.regularization or slots[NEAR_SINGULAR] > 0.5 or known:
            return
        del self._states[k]
        many.bad[k] = 0.0
        lanes.put_all(many.derivative, one, carried.restart.slope[None])
        lanes.put_all(many.scale, one, carried.restart.scale[None])
        lanes.put_all(many.near, one, carried.near.reshape(1, -1)[:, : many.near.shape[1]])
        lanes.put_all(many.state, one, slots[None, :PROGRESS])
        lanes.put(many.state, JUDGED_STEPS, one, slots[STEPS])
        lanes.put(many.state, JUDGED_TIME, one, t)
        many.stale[k // many.stale.shape[1], k % many.stale.shape[1]] = 0.0
