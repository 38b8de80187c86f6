"""`Simulators`: many motions side by side that another program leads on."""

from __future__ import annotations

import functools
import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from mbody.analysis.contact.unilateral import has_modes
from mbody.analysis.driven.contact_report import one_sided
from mbody.analysis.dynamics.batch_integration import TABLES
from mbody.analysis.dynamics.interruptions import has_corners
from mbody.analysis.dynamics.options import tolerances
from mbody.analysis.initial.initial_state import with_start_drivers
from mbody.analysis.position.assembly_analysis import as_system, rounding
from mbody.analysis.position.closed_position import close_batch
from mbody.analysis.singular.singular_positions import Prescribed
from mbody.core import tolerances as tol
from mbody.errors import ModelError, SolveError, brief
from mbody.kernels.loop_closure import project_designs
from mbody.kernels.runge_kutta_lanes import MEAN_STEPS, MEAN_TIME, UNTIL
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
from mbody.model.body import Guesses
from mbody.model.element import whole_number
from mbody.model.mechanism import Mechanism
from mbody.model.numbers import number_in
from mbody.model.simulation import METHODS
from mbody.quantities.formula import Number
from mbody.quantities.units import DIMENSIONS
from mbody.solution.solution import IntegrationSettings, Solution
from mbody.stepping.lane_motion import LaneInputs, LaneMotion, LaneReadings, usable_cores
from mbody.stepping.simulator import (
    PLACES,
    Simulator,
    SimulatorState,
    nearest_state,
    prescribed_values,
)
from mbody.system.formula_steps import driver_inputs
from mbody.system.system import System

# -- States of many motions by positions and rates, on lanes or one by one ---------------------

Array = np.ndarray

#: Directions of places in x and y; angles have none.
DIRECTION = {"x": 0.0, "y": math.pi / 2.0}
PLACE = {"vx": "x", "vy": "y", "omega": "angle"}


def reset_states(
    system: System, which: Array, t: Array, base: Array, to: Mapping[str, Any]
) -> tuple[Array, Array]:
    """The states nearest to prescribed values, (states, rows), and how far each is from them.
    `which`, `t` (states,).
    """
    n, y = system.coordinates, base.copy()
    places, values = _prescribed(system, to, len(which))
    names = [state.name for state in system.mechanism.states]
    for row, name in enumerate(names):
        if isinstance(to, Mapping) and name in to:
            y[:, 2 * n + row] = _own_values(system, row, to[name], len(which))
    distance, left = np.zeros(len(which)), np.ones(len(which), dtype=bool)
    if system.batch is None and np.ptp(t) == 0.0:
        q, v, good = _on_lanes(system, float(t[0]), base[:, :n], places, values)
        y[good, :n], y[good, n : 2 * n] = q[good], v[good]
        left = ~good
    for k in np.flatnonzero(left).tolist():
        one = system.design(int(which[k])) if system.batch is not None else system
        given = [
            replace(given_place, value=float(values[m, k])) for m, given_place in enumerate(places)
        ]
        try:
            nearest = nearest_state(one, float(t[k]), base[k, :n], given)
        except (ModelError, SolveError) as error:
            raise type(error)(f"motion {which[k]}: {error}", error.element) from error
        y[k, :n], y[k, n : 2 * n], distance[k] = nearest.q, nearest.v, nearest.distance
    return y, distance


def _prescribed(system: System, to: Any, count: int) -> tuple[list[Prescribed], Array]:
    """Prescribed coordinates and their values, (prescribed, states)."""
    own = {state.name for state in system.mechanism.states}
    flat: dict[str, Any] = {}
    if not isinstance(to, Mapping):
        prescribed_values(system, to)
    for name, value in to.items():
        if isinstance(value, Mapping):
            flat |= {f"{name}.{key}": one for key, one in value.items()}
        elif name not in own:
            flat[name] = value
    places, rows = list[Prescribed](), list[Array]()
    for name, value in flat.items():
        numbers = _array(name, value, count)
        sample = value if numbers is None else float(numbers[0])
        (place,) = prescribed_values(system, {name: sample})
        places.append(place)
        rows.append(np.full(count, place.value) if numbers is None else numbers)
    return places, np.array(rows).reshape(len(places), count)


def _array(name: str, value: Any, count: int) -> Array | None:
    """Values of an array; None of a single one."""
    if isinstance(value, str) or np.ndim(value) == 0:
        return None
    try:
        found = np.asarray(value, dtype=float)
    except (TypeError, ValueError):
        raise ModelError(f"reset: '{name}' must be numbers, not {brief(value)}", name) from None
    if found.shape != (count,):
        raise ModelError(
            f"reset: '{name}' has an array of shape {found.shape} for {count} motions: give one "
            "number, or one for each",
            name,
        )
    if not np.isfinite(found).all():
        raise ModelError(f"reset: '{name}' is not finite everywhere: give finite numbers", name)
    return found


def _own_values(system: System, row: int, value: Any, count: int) -> Any:
    state = system.mechanism.states[row]
    found = _array(state.name, value, count)
    if found is not None:
        return found
    dimension = state.dimension or DIMENSIONS["number"]
    return number_in(system.mechanism, value, dimension, "reset", state.name)


def _on_lanes(
    system: System, t: float, base: Array, given: list[Prescribed], values: Array
) -> tuple[Array, Array, np.ndarray]:
    """Positions and velocities, each (states, coordinates), and which of them are ordinary."""
    count, n = len(base), system.coordinates
    places = [m for m, one in enumerate(given) if one.key in PLACES]
    rates = [m for m, one in enumerate(given) if one.key not in PLACES]
    driven = _driven(system, tuple((given[m].body, given[m].key) for m in places))
    driven_rates = _driven(system, tuple((given[m].body, PLACE[given[m].key]) for m in rates))
    if driven is None or driven_rates is None:
        return base, base, np.zeros(count, dtype=bool)
    # elsewhere something has to be as near as possible, which is not for these kernels
    stationary = not rates and not system.drivers
    if driven.rows != n or not (stationary or driven_rates.rows == n):
        return base, base, np.zeros(count, dtype=bool)
    driven, driven_rates = _repeated(driven, count), _repeated(driven_rates, count)
    poses = np.hstack([base, np.zeros((count, 3))])
    own = len(system.drivers)
    first = np.full((count, own + len(places)), np.nan)
    start = np.array(
        [[given[m].at(system, q) * given[m].unit(system) for q in base] for m in places]
    )
    goal, good = values[places], np.ones(count, dtype=bool)
    steps = 1
    if places:
        units = np.array([given[m].unit(system) for m in places])[:, None]
        steps = max(
            1, math.ceil(float(np.abs((goal - start) / units).max()) / tol.POSITION_PRESCRIBED_STEP)
        )
    for k in range(1, steps + 1):
        if places:
            first[:, own:] = (goal if k == steps else start + k / steps * (goal - start)).T
        good &= close_batch(driven, t, first, poses, rounding(driven, poses), tol.PIVOT_SUSPECT)
    speeds = np.full((count, own + len(rates)), np.nan)
    speeds[:, own:] = values[rates].T
    v, off = np.empty((count, n)), np.empty(count)
    work = driven_rates.work()
    work.time[:] = t
    project_designs(driven_rates.layout, work, driven_rates.par, poses, speeds, v, off)
    good &= (
        np.isfinite(poses).all(axis=1) & np.isfinite(v).all(axis=1) & (off <= tol.VELOCITIES_AGREE)
    )
    return poses[:, :n], v, good


@functools.lru_cache(maxsize=8)
def _driven(system: System, places: tuple[tuple[str, str], ...]) -> System | None:
    """The system with a driver for each place; None where they cannot all be driven."""
    imposed = [
        (f"{body} {key} at the start", (body, key, DIRECTION.get(key, 0.0)), 0.0, 0.0)
        for body, key in places
    ]
    try:
        return with_start_drivers(system, imposed) if imposed else system
    except (ModelError, SolveError):
        return None


def _repeated(system: System, count: int) -> System:
    """A batch of so many equal designs."""
    par, mass = (np.repeat(numbers, count, axis=1) for numbers in (system.par, system.mass))
    return replace(system, par=par, mass=mass, batch=count)


#: Motions that each have a simulator of their own, at most, where none goes on lanes.
MOST_APART = 1024
#: Slots that a motion takes with it from the lanes to steps of its own.
TAKEN = [NEXT, STEPS, REJECTED, BEST_CONDITIONING, STIFF_COUNT, SMOOTH_COUNT, FASTEST]


#: Of motions that all go alone: lanes make no steps of theirs.
UNKNOWN = IntegrationSettings("dopri5", 1e-6, 1e-6)
#: Arrays of the lanes that say all of their states.
ROWS = ("y", "derivative", "scale", "near", "state", "inputs")
KEPT = (*ROWS, "stale", "bad")


@dataclass(frozen=True, eq=False)
class SimulatorsState:
    """The states of many motions at one time: to be kept, copied, pickled and set back.

    Set back, the same steps give the same bits.
    """

    arrays: dict[str, Array]
    alone: dict[int, SimulatorState]
    reasons: dict[int, str]
    doubts: dict[int, str]
    bodies: tuple[str, ...]


class Simulators(LaneReadings):
    """n motions of one mechanism side by side, each with its state and its inputs.

    Each takes the steps that a `Simulator` of it alone takes, many in one operation of the
    processor. What a motion gets does not depend on the others, nor on the number of threads: its
    numbers are those of ``n = 1`` to the last bit, and those of a `Simulator` to rounding. A motion
    that meets anything out of the ordinary, a singular position near by or steps that vanish, goes
    on alone and comes back; mechanisms with contacts, events, redundant joints, laws of time in
    tables or code of the user go alone always, up to 1024 of them each in a simulator of its own,
    and so do other methods than ``"dop853"`` and ``"dopri5"``.

    Parameters
    ----------
    model : Mechanism or System
        A system of a batch gives every motion a design of its own.
    n : int, optional
        How many; of a batch as many as it has designs.
    method : str, optional
        By default that of the description's `simulation`; in the place of ``"dop853"``
        ``"dopri5"`` where rtol is 1e-6 or more: short steps take two thirds of the time then.
    rtol, atol, step, start, guess, rates
        As of `Simulator`.
    threads : int, optional
        At most so many work at a time, by default one for each processor.

    Attributes
    ----------
    inputs : mapping
        The inputs by name, arrays (n,); what is set, a number or an array, acts from now on.

    Raises
    ------
    ModelError, SolveError
        As `Simulator`; and for controllers, which are functions of one motion.

    Examples
    --------
    >>> import mbody
    >>> import numpy as np
    >>> machine = mbody.gallery.load("double_pendulum")
    >>> machine.add(mbody.Input("u", "0 N*m"), mbody.Torque("motor", "upper", value="u"))
    >>> sims = mbody.Simulators(machine, 3, rtol=1e-8)
    >>> sims.inputs["u"] = np.array([-1.0, 0.0, 1.0])
    >>> sims.step(1e-2)
    >>> np.argsort(sims["upper"].omega)
    array([0, 1, 2])
    >>> off = sims.reset([2])
    >>> sims.t
    array([0.01, 0.01, 0.  ])
    """

    def __init__(
        self,
        model: Mechanism | System,
        n: int | None = None,
        *,
        method: str | None = None,
        rtol: float | None = None,
        atol: float | None = None,
        step: Number | None = None,
        start: Solution | None = None,
        guess: Guesses | None = None,
        rates: Mapping[str, Number] | None = None,
        threads: int | None = None,
    ) -> None:
        whole = as_system(model)
        self.n = _count(whole, n)
        if whole.mechanism.controllers:
            name = whole.mechanism.controllers[0].name
            raise ModelError(
                f"the controller '{name}' is a function of one motion: Simulators take none; read "
                "what it reads and set its inputs between steps",
                name,
            )
        own = whole.mechanism.simulation
        usual = method is None and (own is None or own.method == METHODS[0])
        if usual and tolerances(whole, rtol, atol)[0] >= tol.RTOL_LOOSE:
            method = "dopri5"
        self._how: dict[str, Any] = {"method": method, "rtol": rtol, "atol": atol, "step": step}
        self._how |= {"start": start, "guess": guess, "rates": rates}
        self._whole, self._sims, self._apart = whole, dict[int, Simulator](), False
        first = self._sim(0)
        begun = first.state
        self.system = whole if whole.batch is not None else first.system
        names, rows = first.inputs.names, self.system.input_rows
        places = {one.name: int(row) for one, row in zip(whole.mechanism.inputs, rows, strict=True)}
        self._input_names = names
        #: Whether ordinary steps are taken on lanes.
        self._on_lanes = begun.checkpoint is not None and self._may_use_lanes(begun)
        #: Whether each motion has a simulator of its own.
        self._apart = not self._on_lanes and self.n <= MOST_APART
        settings = begun.checkpoint.restart.settings if begun.checkpoint is not None else UNKNOWN
        self._lanes = LaneMotion(
            self.system, self.n, settings, {name: places[name] for name in names}, _threads(threads)
        )
        self._measures = {}
        #: The states of the motions that are alone, None where their own simulators have them; why
        #: motions have ended or failed; doubts.
        self._states: dict[int, SimulatorState | None] = {}
        self._reasons: dict[int, str] = {}
        self._doubts: dict[int, str] = {}
        others = {
            name: "follows its law of time: declare it with a number to set it here"
            for name in places
            if name not in names
        }
        drivers = driver_inputs(self.system.mechanism, self.system.numbers)
        self.inputs = LaneInputs(
            names, self._lanes, others, self._number, self._invalidate, drivers
        )
        self._begin_all()

    def _number(self, name: str, value: Any) -> float:
        machine = self.system.mechanism
        own = next(one for one in machine.inputs if one.name == name)
        return number_in(machine, value, own.dimension or DIMENSIONS["number"], "inputs", name)

    def _invalidate(self) -> None:
        """Invalidates readings after a change of state or inputs."""
        self._record_valid = False

    # -- starts --------------------------------------------------------------------------------

    def _begin_all(self) -> None:
        lanes = self._lanes
        shared = self._whole.batch is None
        begun = [self._sim(k).state for k in range(1 if shared else self.n)]
        y = np.array([np.concatenate([one.q, one.v, one.own]) for one in begun])
        t = np.array([one.t for one in begun])
        which = np.arange(self.n)
        values = np.array([one.inputs for one in begun])
        if len(self._input_names):
            lanes.put_all(
                lanes.many.inputs, which, np.broadcast_to(values, (self.n, values.shape[1]))
            )
        self._begin(which, np.broadcast_to(t, self.n), np.broadcast_to(y, (self.n, y.shape[1])))
        lanes.fill()
        self._first = self.state

    def _begin(self, which: Array, t: Array, y: Array) -> None:
        """Begin anew in some motions, with their present inputs."""
        lanes, many = self._lanes, self._lanes.many
        for k in which.tolist():
            for by_state in (self._states, self._reasons, self._doubts):
                by_state.pop(k, None)
        self._invalidate()
        if self._on_lanes:
            lanes.begin(which, t, y)
            slots = lanes.some(many.state, which)
            left = which[
                (many.bad[which] > 0.0) | ~(slots[:, BEST_CONDITIONING] > tol.PIVOT_SUSPECT)
            ]
        else:
            lanes.put_all(many.y, which, y)
            lanes.put(many.state, TIME, which, t)
            left = which
        lanes.put(many.state, UNTIL, which, t)
        for k in left.tolist():
            lanes.put(many.state, STEPS, np.array([k]), 0.0)
            self._take_back(k, self._sent_alone(k))

    # -- steps --------------------------------------------------------------------------------

    def step(self, dt: Number | Array) -> None:
        """Lead every motion on by `dt`, each to exactly ``t + dt``.

        A motion that fails stays at its last good step; `status` says why, `ok` is False, and later
        calls leave it as it is until it is reset. So does one that an event has ended.

        Parameters
        ----------
        dt : float, str, or array (n,)
            Positive [time].

        Raises
        ------
        ModelError
            For a time that is not positive.
        """
        self._advance_to(self.t + self._times(dt, "step: dt"), "step: dt")

    def until(self, t: Number | Array) -> None:
        """Lead every motion on to exactly the time `t`, one or (n,); those that are there stay.

        Raises
        ------
        ModelError
            For a time before that of a motion that goes on.
        """
        self._advance_to(self._times(t, "until: t"), "until: t")

    def _times(self, value: Any, name: str) -> Array:
        if isinstance(value, str | int | float) or np.ndim(value) == 0:
            value = number_in(self.system.mechanism, value, "time", "simulators", name)
        try:
            return np.broadcast_to(np.asarray(value, dtype=float), (self.n,))
        except (TypeError, ValueError):
            raise ModelError(
                f"{name} takes one time or an array of {self.n}, not {brief(value)}"
            ) from None

    def _advance_to(self, until: Array, name: str) -> None:
        now, ok = self.t, self.ok
        step = name.startswith("step")
        wrong = ok & ~(((until > now) if step else (until >= now)) & (until < math.inf))
        if wrong.any():
            k, unit = int(np.flatnonzero(wrong)[0]), self.system.mechanism.units.time
            raise ModelError(
                f"{name} leads motion {k} from {now[k]:g} to {until[k]:g} {unit}: give "
                "a later time; to go back, keep sims.state and set it again, or reset it"
            )
        lanes, many = self._lanes, self._lanes.many
        targets = np.where(ok, until, now)
        lanes.put(many.state, UNTIL, np.arange(self.n), targets)
        self._invalidate()
        if self._on_lanes:
            lanes.go_on()
        for k in np.flatnonzero((self.t < targets) & (many.bad[: self.n] > 0.0)).tolist():
            try:
                sim = self._sent_alone(k)
                sim.until(float(targets[k]))
            except SolveError as error:
                self._reasons[k] = f"failed: {error}"
                continue
            self._take_back(k, sim)

    # -- motions that go on alone, by the steps of a single `Simulator`, and come back ---------

    def _may_use_lanes(self, begun: SimulatorState) -> bool:
        """Whether ordinary steps of this mechanism, by this method, are those that lanes take."""
        system, checkpoint = self.system, begun.checkpoint
        assert checkpoint is not None
        own = system.mechanism.simulation
        return not (
            checkpoint.restart.settings.method not in TABLES
            or checkpoint.regularization
            or (own is not None and (own.events or own.release))
            or system.has_user_code
            or one_sided(system)
            or has_modes(system)
            or has_corners(system)
            or any(list(one.distances()) for one in system.mechanism.constraints)
        )

    def _sim(self, k: int) -> Simulator:
        """The simulator that leads motion k on where it goes alone: its own, or one for all of one
        design.
        """
        which = k if self._apart or self._whole.batch is not None else 0
        found = self._sims.get(which)
        if found is None:
            several = self._whole.batch is not None
            try:
                found = Simulator(self._whole.design(k if several else 0), **self._how)
            except (ModelError, SolveError) as error:
                if not several:
                    raise
                raise type(error)(f"design {k}: {error}", error.element) from error
            self._sims[which] = found
        return found

    def _alone(self) -> Iterator[tuple[int, Simulator]]:
        for k, state in self._states.items():
            yield k, self._set_to(k, state)

    def _set_to(self, k: int, state: SimulatorState | None) -> Simulator:
        """The simulator of motion k, at this state or at that which it has, with the inputs of the
        motion.
        """
        sim, inputs = self._sim(k), self._inputs_of(k)
        if state is not None:
            sim.state = state
        if not np.array_equal(sim.inputs.array(), inputs):
            sim.inputs.set_all(inputs)
        return sim

    def _state_of(self, k: int) -> SimulatorState:
        """The state of a motion that is alone."""
        return self._states[k] or self._sim(k).state

    def _give_state(self, k: int, state: SimulatorState) -> None:
        """Let a motion be alone, at this state."""
        if self._apart:
            self._sim(k).state = state
        self._states[k] = None if self._apart else state

    def _inputs_of(self, k: int) -> Array:
        values = self._lanes.some(self._lanes.many.inputs, np.array([k]))[0]
        return np.array(values[: len(self._input_names)])

    def _sent_alone(self, k: int) -> Simulator:
        """The simulator of motion k, set to its present state."""
        if k in self._states:
            return self._set_to(k, self._states[k])
        sim, one = self._sim(k), np.array([k])
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
        if found.checkpoint is not None and slots[STEPS]:
            # it goes on with the steps that it had
            restart = found.checkpoint.restart
            state_slots = restart.state.copy()
            state_slots[TAKEN] = slots[TAKEN]
            scale = lanes.some(lanes.many.scale, one)[0]
            restart = replace(restart, state=state_slots, scale=scale)
            sim.state = replace(found, checkpoint=replace(found.checkpoint, restart=restart))
        return sim

    def _take_back(self, k: int, sim: Simulator) -> None:
        """Returns a single motion's state; it goes back to the lanes where nothing forbids it."""
        if self._apart:
            self._take_from_own(k, sim)
            return
        lanes, one, found = self._lanes, np.array([k]), sim.state
        many, checkpoint = lanes.many, found.checkpoint
        y = np.concatenate([found.q, found.v, found.own])[None]
        lanes.put_all(many.y, one, y)
        lanes.put(many.state, TIME, one, found.t)
        if checkpoint is not None and checkpoint.passage[2]:
            self._doubts.setdefault(k, checkpoint.passage[2][0].message)
        if found.status != "completed":
            self._reasons[k] = found.status
        many.bad[k] = 1.0
        self._states[k] = found
        if checkpoint is None or not self._on_lanes or k in self._reasons:
            return
        slots, t = checkpoint.restart.state, found.t
        known = t <= slots[KNOWN_UNTIL] or t <= slots[SHORTENED_UNTIL] or checkpoint.passage[0]
        if checkpoint.regularization or slots[NEAR_SINGULAR] > 0.5 or known:
            return
        del self._states[k]
        many.bad[k] = 0.0
        lanes.put_all(many.derivative, one, checkpoint.restart.slope[None])
        lanes.put_all(many.scale, one, checkpoint.restart.scale[None])
        lanes.put_all(many.near, one, checkpoint.near.reshape(1, -1)[:, : many.near.shape[1]])
        lanes.put_all(many.state, one, slots[None, :PROGRESS])
        lanes.put(many.state, MEAN_STEPS, one, slots[STEPS])
        lanes.put(many.state, MEAN_TIME, one, t)
        many.stale[k // many.stale.shape[1], k % many.stale.shape[1]] = 0.0

    def _take_from_own(self, k: int, sim: Simulator) -> None:
        """Place and time of a motion whose own simulator keeps its state."""
        lanes, (t, y, ended, doubts) = self._lanes, sim.reached
        lanes.put_all(lanes.many.y, np.array([k]), y[None])
        lanes.put(lanes.many.state, TIME, np.array([k]), t)
        if doubts:
            self._doubts.setdefault(k, doubts[0].message)
        if ended:
            self._reasons[k] = ended
        lanes.many.bad[k], self._states[k] = 1.0, None

    # -- status --------------------------------------------------------------------------------

    @property
    def ok(self) -> Array:
        """Which motions go on, (n,) bool: those that neither failed nor ended."""
        found = np.ones(self.n, dtype=bool)
        found[list(self._reasons)] = False
        return found

    @property
    def status(self) -> tuple[str, ...]:
        """Of each motion "completed"; "failed: …" with the reason; "ended: …" by an event;
        "doubtful: …" where it passed a singular position in doubt.

        Energy is not accounted for here: a `Simulator` does.
        """
        found = ["completed"] * self.n
        for k, why in self._doubts.items():
            found[k] = f"doubtful: {why}"
        for k, why in self._reasons.items():
            found[k] = why
        return tuple(found)

    @property
    def state(self) -> SimulatorsState:
        """All states, to be kept and set back."""
        many = self._lanes.many
        return SimulatorsState(
            arrays={name: getattr(many, name).copy() for name in KEPT},
            alone={k: self._state_of(k) for k in self._states},
            reasons=dict(self._reasons),
            doubts=dict(self._doubts),
            bodies=tuple(body.name for body in self.system.mechanism.bodies),
        )

    @state.setter
    def state(self, given: SimulatorsState) -> None:
        many = self._lanes.many
        bodies = tuple(body.name for body in self.system.mechanism.bodies)
        if not isinstance(given, SimulatorsState) or given.bodies != bodies:
            raise ModelError(
                f"the state that is set must be one that sims.state gave, of the same mechanism, "
                f"not {brief(given)}"
            )
        if given.arrays["y"].shape != many.y.shape:
            raise ModelError(
                f"the state that is set is of other motions: these are {self.n}; take one of their "
                "own"
            )
        for name in KEPT:
            getattr(many, name)[:] = given.arrays[name]
        self._states, self._reasons = {}, dict(given.reasons)
        self._doubts = dict(given.doubts)
        for k, one in given.alone.items():
            self._give_state(k, one)
        self._invalidate()

    def reset(
        self, which: Any = None, to: Mapping[str, Any] | None = None, *, t: Number | None = None
    ) -> Array:
        """Begin anew in some motions: at the first state, or at positions and rates by name.

        Parameters
        ----------
        which : array, optional
            A mask (n,) of bool, or numbers of motions; by default all.
        to : mapping, optional
            Values by name as of `Simulator.reset`, ``{"crank.angle": 0.5}``, each one number or an
            array with one for each motion of `which`; and of auxiliary states. All else is as near
            to the first position as the loops allow, and moves least.
        t : float or str, optional
            Time, by default the first one.

        Returns
        -------
        array (motions of `which`,)
            How far each is from what was given, as of `Simulator.reset`: 0 where it fits.

        Raises
        ------
        ModelError
            For names that there are not, and what is no number.
        SolveError
            Where the loops do not close near there; all states are then as they were.
        """
        chosen = self._chosen(which)
        lanes, many = self._lanes, self._lanes.many
        width = many.stale.shape[1]
        places = chosen // width, chosen % width
        rows = {name: lanes.some(getattr(many, name), chosen) for name in ROWS}
        flags = many.stale[places], many.bad[chosen]
        alone = {k: self._state_of(k) for k in self._states}
        kept = dict(self._reasons), dict(self._doubts)
        try:
            return self._reset(chosen, to, t)
        except Exception:
            for name, values in rows.items():
                lanes.put_all(getattr(many, name), chosen, values)
            many.stale[places], many.bad[chosen] = flags
            self._states, (self._reasons, self._doubts) = {}, kept
            for k, one in alone.items():
                self._give_state(k, one)
            self._invalidate()
            raise

    def _reset(self, which: Array, to: Any, t: Any) -> Array:
        lanes, many, first = self._lanes, self._lanes.many, self._first
        distance = np.zeros(len(which))
        if not len(which):
            return distance
        if to is None and t is None:
            width = many.stale.shape[1]
            for name in ROWS:
                lanes.put_all(getattr(many, name), which, lanes.some(first.arrays[name], which))
            many.stale[which // width, which % width] = 0.0
            many.bad[which] = first.arrays["bad"][which]
            for k in which.tolist():
                self._states.pop(k, None)
                self._doubts.pop(k, None)
                self._reasons.pop(k, None)
                if k in first.alone:
                    self._give_state(k, first.alone[k])
                if k in first.doubts:
                    self._doubts[k] = first.doubts[k]
            self._invalidate()
            return distance
        base = lanes.some(first.arrays["y"], which)
        when = lanes.some(first.arrays["state"], which)[:, TIME]
        if t is not None:
            when = np.full(len(which), self._times(t, "reset: t")[0])
        y, distance = reset_states(self.system, which, when, base, {} if to is None else to)
        lanes.put_all(many.inputs, which, lanes.some(first.arrays["inputs"], which))
        self._begin(which, when, y)
        return distance

    def _chosen(self, which: Any) -> Array:
        """Numbers of the motions that a mask or numbers mean."""
        if which is None:
            return np.arange(self.n)
        given = np.atleast_1d(np.asarray(which))
        if given.dtype == bool and given.shape == (self.n,):
            return np.flatnonzero(given)
        whole = given.size == 0 or np.issubdtype(given.dtype, np.integer)
        if not whole or given.ndim != 1 or given.dtype == bool:
            raise ModelError(
                f"reset takes a mask of {self.n} bool or numbers of motions, not {brief(which)}; "
                "positions by name are its second argument"
            )
        found = np.unique(given.astype(int))
        if len(found) != given.size or (found.size and not 0 <= found[0] <= found[-1] < self.n):
            raise ModelError(
                f"reset: motions {brief(which)} must be different numbers from 0 to {self.n - 1}"
            )
        return np.asarray(given, dtype=int)

    def present(self, k: int) -> Solution:
        """The present instant of motion k as a result of `simulate`, to draw it, or to begin
        another analysis with.
        """
        return self._sent_alone(k).present()

    def __len__(self) -> int:
        return self.n

    def __repr__(self) -> str:
        return f"Simulators({self.system.mechanism.name!r}, {self.n} motions)"


def _count(system: System, n: Any) -> int:
    """Number of motions."""
    if n is None and system.batch is not None:
        return int(system.batch)
    n = whole_number("Simulators: n", n)
    if system.batch is not None and n != system.batch:
        raise ModelError(
            f"Simulators: n is {n}, the system has {system.batch} designs, one for each motion: "
            "leave n out"
        )
    return n


def _threads(given: Any) -> int:
    return usable_cores() if given is None else whole_number("Simulators: threads", given)
