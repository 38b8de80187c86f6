"""Readings of a motion at its present instant, by name."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, MutableMapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from mbody.analysis.driven.diagnosis import load_forces
from mbody.analysis.dynamics.integration import Integration
from mbody.analysis.dynamics.interruptions import solution_of_records
from mbody.analysis.dynamics.simulate import certified_motion
from mbody.analysis.freedom.mobility import free_motions, leading, rates_of
from mbody.analysis.linear.linearize import StateMatrices, linearize
from mbody.analysis.position.assembly_analysis import raise_user_error
from mbody.core.tolerances import SINGULAR_VALUE_ZERO
from mbody.errors import ModelError, SolveError, brief
from mbody.kernels.layout import PER_PRIMITIVE
from mbody.kernels.loop_closure import laws_of_time
from mbody.kernels.step_state import TIME
from mbody.model.body import ORIGIN
from mbody.model.element import as_marker, listed, unknown_name
from mbody.model.loads import Gravity
from mbody.model.simulation import Measure
from mbody.solution.doubts import Doubt
from mbody.solution.histories import EventRecord, Unique, with_fields
from mbody.solution.solution import IntegrationSettings, Solution
from mbody.solution.traced_instant import Present, Read
from mbody.system.rank import jacobian, rank_of
from mbody.system.system import System, too_large

# -- Inputs of a mechanism: named numbers that may change between steps ------------------------


def jumping(name: str, driver: str) -> ModelError:
    """Why an input that a driver follows cannot be set."""
    return ModelError(
        f"the input '{name}' cannot be set: the position or the rate of driver '{driver}' follows "
        "it and would jump, which takes an infinite effort. Give it a smooth history, or lead it "
        'through states: State("speed", rate="acceleration") and State("angle", '
        'rate="speed"), of which the driver follows the angle',
        name,
    )


class Inputs(MutableMapping[str, float]):
    """The present values of the inputs by name, in the units of the mechanism.

    `values`: Name and first value of each input that can be set.
    `changed`: Called with the number and the value of one that has changed.
    `others`: Of each input that cannot be set what sets it, and a function that gives its value.
    `number`: The number that a text or another value means for an input, by its name.
    `followed`: Inputs that the position or the rate of a driver follows, with its name: they keep
      their value.

    Examples
    --------
    >>> inputs = Inputs({"u": 0.0}, print)
    >>> inputs["u"] = 2.0
    0 2.0
    """

    def __init__(
        self,
        values: Mapping[str, float],
        on_change: Callable[[int, float], Any],
        others: Mapping[str, tuple[str, Callable[[], float]]] | None = None,
        number: Callable[[str, Any], float] = lambda name, value: float(value),
        drivers: Mapping[str, str] | None = None,
    ) -> None:
        self._drivers = dict(drivers or {})
        self.names = tuple(values)
        self._index = {name: n for n, name in enumerate(self.names)}
        self._values = [float(value) for value in values.values()]
        self._on_change, self._others, self._number = on_change, dict(others or {}), number

    def __getitem__(self, name: str) -> float:
        place = self._index.get(name)
        if place is not None:
            return self._values[place]
        if name in self._others:
            return float(self._others[name][1]())
        raise self._unknown(name)

    def __setitem__(self, name: str, value: Any) -> None:
        place = self._index.get(name)
        if place is None:
            if name in self._others:
                raise ModelError(f"the input '{name}' {self._others[name][0]}", name)
            raise self._unknown(name)
        if type(value) is not float:
            value = self._number(name, value)
        if not -math.inf < value < math.inf:
            raise ModelError(f"the input '{name}' is {value}: give a finite number", name)
        if value != self._values[place]:
            if name in self._drivers:
                raise jumping(name, self._drivers[name])
            self._values[place] = value
            self._on_change(place, value)

    def __delitem__(self, name: str) -> None:
        if name not in self:
            raise self._unknown(name)
        raise ModelError(f"the input '{name}' belongs to the mechanism: set it to a number", name)

    def __iter__(self) -> Iterator[str]:
        return iter((*self.names, *self._others))

    def __len__(self) -> int:
        return len(self.names) + len(self._others)

    def set_all(self, values: np.ndarray) -> None:
        """All that can be set (inputs,)."""
        for name, value in zip(self.names, values.tolist(), strict=True):
            self[name] = value

    def array(self, changes: Any = None) -> np.ndarray:
        """All that can be set (inputs,), some of them changed: an array of all, or values by name.

        Raises ModelError.
        """
        found = np.array(self._values, dtype=float)
        if changes is None:
            return found
        if isinstance(changes, Mapping):
            for name, value in changes.items():
                if name not in self._index:
                    raise self._unknown(name)
                found[self._index[name]] = self._number(name, value)
            return found
        try:
            row = np.asarray(changes, dtype=float).reshape(-1)
        except (TypeError, ValueError):
            raise ModelError(
                f"u must be numbers, or a dict by name, not {brief(changes)}"
            ) from None
        if row.shape != found.shape:
            raise ModelError(
                f"u has {row.size} numbers, the mechanism {found.size} inputs that can be set: "
                "give one each, or a dict by name"
            )
        return row

    def _unknown(self, name: Any) -> ModelError:
        return unknown_name("input", name, self)

    def __repr__(self) -> str:
        return f"Inputs({dict(self)})"


# -- Present motion of a body, a point and a joint: numbers made when they are read ------------


class BodyNow:
    """The present motion of one body: its mass centre and its angle.

    `x`, `y`, `vx`, `vy`, `ax`, `ay`: Mass centre, world axes [length, length/time, length/time²].
    `angle`, `omega`, `alpha`: Of the link's x axis [rad], and its rates.
    """

    __slots__ = ("_angle", "_first", "_instant_record", "_omega", "_rate", "_second", "_y", "name")

    def __init__(self, name: str, present: Present) -> None:
        n, b = present.system.coordinates, present.system.bodies[name]
        self.name, self._y, self._instant_record = name, present.y, present.record
        self._first, self._rate, self._second = 3 * b, n + 3 * b, 2 * n + 3 * b
        self._angle, self._omega = self._first + 2, self._rate + 2

    @property
    def x(self) -> float:
        """Mass centre [length]."""
        return self._y[self._first]

    @property
    def y(self) -> float:
        """Mass centre [length]."""
        return self._y[self._first + 1]

    @property
    def angle(self) -> float:
        """Angle of the link's x axis [rad]."""
        return self._y[self._angle]

    @property
    def vx(self) -> float:
        """Velocity of the mass centre [length/time]."""
        return self._y[self._rate]

    @property
    def vy(self) -> float:
        """Velocity of the mass centre [length/time]."""
        return self._y[self._rate + 1]

    @property
    def omega(self) -> float:
        """Angular velocity [rad/time]."""
        return self._y[self._omega]

    @property
    def ax(self) -> float:
        """Acceleration of the mass centre [length/time²]."""
        return self._instant_record()[self._second]

    @property
    def ay(self) -> float:
        """Acceleration of the mass centre [length/time²]."""
        return self._instant_record()[self._second + 1]

    @property
    def alpha(self) -> float:
        """Angular acceleration [rad/time²]."""
        return self._instant_record()[self._second + 2]

    def __repr__(self) -> str:
        return f"{self.name}: x {self.x:.6g}, y {self.y:.6g}, angle {self.angle:.6g} rad"


class _Compiled:
    """Numbers of one history of results, each made when it is first read."""

    __slots__ = ("_functions", "_make", "name")

    def __init__(self, name: str, make: Callable[[str], Read]) -> None:
        self.name, self._make = name, make
        self._functions: dict[str, Read] = {}

    def _read(self, key: str) -> float:
        read = self._functions.get(key)
        if read is None:
            read = self._functions[key] = self._make(key)
        return read()


def _number(key: str, about: str) -> Any:
    """A number of a history, by its name there."""
    return property(lambda self: self._read(key), doc=about)


class PointNow(_Compiled):
    """The present motion of a point of a body.

    `x`, `y`, `vx`, `vy`, `ax`, `ay`: World axes [length, length/time, length/time²].
    """

    __slots__ = ()

    x: float = _number("x", "Place [length].")
    y: float = _number("y", "Place [length].")
    vx: float = _number("vx", "Velocity [length/time].")
    vy: float = _number("vy", "Velocity [length/time].")
    ax: float = _number("ax", "Acceleration [length/time²].")
    ay: float = _number("ay", "Acceleration [length/time²].")

    def __repr__(self) -> str:
        return f"{self.name}: x {self.x:.6g}, y {self.y:.6g}"


class ReactionNow(_Compiled):
    """The present force and torque on body `on` by body `by` at a joint, world axes.

    `fx`, `fy`, `torque`, `magnitude`: [force, force, force·length, force].
    `unique`: Whether each of fx, fy, torque is determined at present, as of `mbody.Reaction`.
    """

    __slots__ = ("_unique", "by", "on")

    def __init__(
        self,
        joint: str,
        on: str,
        by: str,
        unique: Callable[[], Unique],
        make: Callable[[str], Read],
    ) -> None:
        super().__init__(joint, make)
        self.on, self.by, self._unique = on, by, unique

    @property
    def unique(self) -> Unique:
        """Whether each component is determined."""
        return self._unique()

    fx: float = _number("fx", "Force [force].")
    fy: float = _number("fy", "Force [force].")
    torque: float = _number("torque", "Torque about the joint's place on body j [force·length].")

    @property
    def magnitude(self) -> float:
        """√(fx² + fy²) [force]."""
        return math.hypot(self.fx, self.fy)

    def __repr__(self) -> str:
        return f"{self.name} on {self.on}: fx {self.fx:.6g}, fy {self.fy:.6g}"


Array = np.ndarray


class Readings:
    """Readings of the present instant; what steps is in `Simulator`."""

    system: System
    _integration: Integration
    _slots: memoryview
    #: The first part of a motion that leaves a singular position.
    _before: Solution | None = None
    _origin: tuple[float, Array, Array] | None = None
    _ended = ""
    _notes: tuple[str, ...] = ()
    #: Tables that were left.
    _beyond: tuple[Doubt, ...] = ()
    _settings: IntegrationSettings

    def _show(self, integration: Integration, settings: IntegrationSettings) -> None:
        """Read from this integration."""
        self._integration, self._settings = integration, settings
        y, slots, record = integration.y, integration.state, integration.present_record.reshape(-1)
        self._slots, self._present_record = memoryview(slots.data), memoryview(record.data)
        self._present = Present(self.system, memoryview(y.data), self._slots, self._instant_record)
        self._named: dict[str, BodyNow | PointNow] = {}
        self._values: dict[Any, Any] = {}
        self._measures: dict[Any, Read] = {}
        self._invalidate()

    def _invalidate(self) -> None:
        """Nothing that was evaluated holds any more."""
        self._record_valid = False
        self._certified: Solution | None = None

    @property
    def t(self) -> float:
        """Time."""
        return self._slots[TIME]

    @property
    def q(self) -> Array:
        """A copy of the coordinates (coordinates,): mass centre (x, y) [length] and angle [rad] of
        every body, in the order of the description.
        """
        return self._integration.y[: self.system.coordinates].copy()

    @property
    def v(self) -> Array:
        """A copy of their rates (coordinates,) [length/time, rad/time]."""
        n = self.system.coordinates
        return self._integration.y[n : 2 * n].copy()

    def __getitem__(self, name: str) -> Any:
        """The present motion of a body, ``sim["crank"]``, or of a point, ``sim["crank.A"]``."""
        try:
            return self._named[name]
        except KeyError:
            found = self._named[name] = self._motion_of(name)
            return found

    def _motion_of(self, name: str) -> BodyNow | PointNow:
        if isinstance(name, str) and name in self.system.bodies and name != "ground":
            return BodyNow(name, self._present)
        if not isinstance(name, str) or name.partition(".")[0] not in self.system.bodies:
            raise unknown_name("body", name, self.system.mechanism.bodies)
        body, _, own = name.partition(".")
        element: Any = self.system.mechanism[body] if body != "ground" else None
        at_origin = own == ORIGIN and (element is None or own not in element.points)
        marker = as_marker(body if at_origin else name, "point", "place")
        point = self._present.instant.point(marker)
        return PointNow(name, lambda key: self._present.read(getattr(point, key)))

    def reaction(self, joint: str, on: str | None = None) -> ReactionNow:
        """Present force and torque of a joint on body `on` (by default body j); see
        `mbody.Solution.reaction`.
        """
        key = "reaction", joint, on
        found = self._values.get(key)
        if found is None:
            found = self._values[key] = self._reaction(joint, on)
        return found

    def _reaction(self, joint: str, on: str | None) -> ReactionNow:
        own = self._present.instant.reaction(joint, on)

        def unique() -> Unique:
            if self._integration.regularization:
                return self.solution().reaction(joint, on).unique
            return self.present().reaction(joint, on).unique

        def make(key: str) -> Read:
            try:
                return self._present.read(getattr(own, key))
            except Exception:  # what no list of operations gives
                return lambda: float(getattr(self.present().reaction(joint, on), key)[-1])

        return ReactionNow(joint, own.on, own.by, unique, make)

    def mode(self, name: str) -> str:
        """Present mode of a contact, a rope or a frictional joint: "open", "stick", "slip+",
        "slip-" or "roll"; see `mbody.Solution.mode`.

        Raises
        ------
        ModelError
            For what has none.
        """
        engine = self._integration
        known = engine.named_modes
        if name not in known:
            raise ModelError(
                f"{brief(name)} is no contact, rope or joint with friction (there are: "
                f"{listed(known)}): give a joint friction, as in friction=0.1",
                str(name),
            )
        return known[name]

    def contact(self, name: str) -> float:
        """Present pressing force of a contact, or pull of a rope [force]."""
        return float(self.measure(f"{name}.contact"))

    def effort(self, name: str) -> float:
        """Present effort of a driver or a coupling [force·length, or force]."""
        key = "effort", name
        read = self._values.get(key)
        if read is None:
            read = self._values[key] = self._present.read(self._present.instant.effort(name))
        return float(read())

    def measure(self, of: str | Measure) -> float:
        """A measured quantity at present: one of the mechanism's measures by name, a `Measure`, or
        a formula such as ``"coupler.P.y - 2*rocker.angle"``; see `mbody.Solution.measure`.

        The formula is compiled when it is first read.
        """
        read = self._measures.get(of)
        if read is None:
            read = self._measures[of] = self._present.measure(of, self.present)
        return read()

    def _instant_record(self) -> memoryview:
        """Record of the present instant."""
        if not self._record_valid:
            self._integration.instant()
            self._record_valid = True
        return self._present_record

    def present(self) -> Solution:
        """The present instant as a result of `simulate`, without what the motion before it says."""
        instant = np.array(self._instant_record())[None, :, None]
        t, regular = np.array([self.t]), self._integration.regularization
        found = solution_of_records(self.system, t, instant, regular)
        shared = self._integration.open_forces
        return found if shared is None else with_fields(found, shared=shared)

    def solution(self) -> Solution:
        """The motion since it began or was reset as a result of `simulate`, of its first and its
        present instant: with energy, events, checks, status, doubts and notes; also to begin
        another motion or an analysis with.
        """
        if self._certified is None:
            if self._origin is not None and self._before is not None:
                found = self._before
            else:
                self._instant_record()
                found = self._integration.now(self._ended or "completed")
            self._certified = certified_motion(found, self._settings, self._beyond)
        return self._certified

    @property
    def status(self) -> str:
        """Whether all is well: "completed"; "ended: …" where an event or a stop ended the motion;
        "doubtful: …" with the first doubt.
        """
        doubts = self.doubts
        return f"doubtful: {doubts[0].message}" if doubts else (self._ended or "completed")

    @property
    def doubts(self) -> tuple[Doubt, ...]:
        """Doubts about the motion since it began or was reset."""
        before = () if self._before is None else self._before.doubts
        return tuple(dict.fromkeys((*before, *self.solution().doubts)))

    @property
    def notes(self) -> tuple[str, ...]:
        """Facts in sentences, the messages of the doubts among them."""
        before = () if self._before is None else self._before.notes
        return tuple(dict.fromkeys((*self._notes, *before, *self.solution().notes)))

    @property
    def events(self) -> tuple[EventRecord, ...]:
        """Events and impacts that were met, as of `Solution.events`."""
        return tuple(self._integration.occurred)


# -- The mechanics of one instant as arrays: masses, constraints, loads, minimal coordinates ---
# All coordinates are those of the bodies in the order of the description, (x, y) of the mass centre
# and the angle of each: with the masses M, the constraints Φ(q, t) = 0 and the loads f,
#
#     M a + Φ_qᵀ λ + h = 0,   h = −f,   Φ_q a = γ.
#
# Minimal coordinates are what the leaders of the free motions do (their angles, or the distances
# that they slide), v = N v_min at drivers that rest; the leaders are those of
# `mbody.engineering.linearize`.


@dataclass(frozen=True, eq=False)
class Minimal:
    """Minimal coordinates at an instant.

    `leaders`: The bodies whose motions they are.
    `N` (coordinates, free): Rates of all coordinates for unit rates of the leaders.
    `P` (free, coordinates): The leaders' parts of the coordinates: q_min = P q, v_min = P v, P N =
      1.
    """

    leaders: tuple[str, ...]
    N: Array
    P: Array


class InstantMechanics:
    """The arrays of one instant. `q`, `v` (coordinates,), `own` (auxiliary states + inputs,)."""

    def __init__(self, system: System, t: float, q: Array, v: Array, own: Array) -> None:
        self.system, self.t, self.q, self.v, self.own = system, t, q, v, own
        n = system.coordinates
        work = self.work = system.work()
        work.time[:] = t
        laws_of_time(system.runtime(), work)
        work.q[:n, 0], work.v[:n, 0] = q, v
        self.phi, self.jacobian = jacobian(system, work)
        raise_user_error(system)
        primitive, row, _ = system.row_table
        self._row = 2 * system.layout.primitive_node[primitive] + row

    @property
    def mass(self) -> Array:
        """M (coordinates, coordinates), diagonal: mass, mass and inertia about the mass centre of
        every body.
        """
        return np.diag(self.system.mass[: self.system.coordinates, 0])

    @property
    def gamma(self) -> Array:
        """γ (rows,): what Φ_q a must be."""
        return np.asarray(self.work.gamma[self._row, 0])

    def loads(self, gravity: bool = False) -> Array:
        """Sum of all loads, or of gravity alone, on the coordinates: (coordinates,)."""
        every = load_forces(self.system, self.system.work(), self.t, self.q, self.v, self.own)
        if gravity:
            loads = self.system.mechanism.loads
            every = every[[isinstance(load, Gravity) for load in loads]]
        return np.asarray(every.sum(axis=0))

    def minimal(self) -> Minimal:
        """Minimal coordinates."""
        system = self.system
        if too_large(system):
            raise SolveError(
                f"minimal coordinates of '{system.mechanism.name}': {system.rows} rows of "
                f"{system.coordinates} coordinates are too many for dense matrices; use the arrays "
                "of all coordinates"
            )
        scale = system.coordinate_units
        G = system.row_units[:, None] * self.jacobian * scale
        motions = free_motions(
            system, np.append(self.q, np.zeros(3)), rank_of(G, parts=system.coordinate_part).motions
        )
        rates = rates_of(system, motions).reshape(len(motions), system.coordinates)
        parts = leading(system, motions, rates / scale) if len(motions) else rates
        return Minimal(tuple(motion.leader for motion in motions), rates.T, parts / scale)

    def reduced_bias(self, own: Minimal) -> Array:
        """h_min (free,) of Nᵀ M N a_min + h_min = 0: loads, and what velocities and drivers do.

        Accelerations are a = N a_min + c with P c = 0 and Φ_q c = γ.
        """
        G = np.vstack([self.jacobian, own.P])
        c = np.linalg.lstsq(
            G, np.append(self.gamma, np.zeros(len(own.P))), rcond=SINGULAR_VALUE_ZERO
        )[0]
        return np.asarray(own.N.T @ (self.mass @ c - self.loads()))


class MechanicsNow(Readings):
    """Arrays of the present instant; what steps is in `Simulator`."""

    inputs: Inputs

    def mass_matrix(self, *, minimal: bool = False) -> Array:
        """M (coordinates, coordinates) [mass, mass, mass·length²], diagonal; of minimal coordinates
        Nᵀ M N (free, free), with the units of the leaders.
        """
        here = self._mechanics()
        if not minimal:
            return here.mass
        N = here.minimal().N
        return np.asarray(N.T @ here.mass @ N)

    def jacobian(self) -> Array:
        """Φ_q (rows, coordinates): the rows of joints, couplings and drivers in the order of
        `row_names`, of lengths [1, 1, length] or angles [1/length, 1/length, 1].
        """
        return self._mechanics().jacobian

    def gamma(self) -> Array:
        """γ (rows,) of Φ_q a = γ: what velocities and drivers make of the constraints
        [length/time², or rad/time²].
        """
        return self._mechanics().gamma

    def bias(self, *, minimal: bool = False) -> Array:
        """h (coordinates,) of M a + Φ_qᵀ λ + h = 0: the loads, negative [force, force,
        force·length]; of minimal coordinates h_min (free,) of Nᵀ M N a_min + h_min = 0, with what
        velocities and drivers do.
        """
        here = self._mechanics()
        return here.reduced_bias(here.minimal()) if minimal else -here.loads()

    def gravity(self, *, minimal: bool = False) -> Array:
        """Gravity on the coordinates (coordinates,) [force, force, force·length]; of minimal
        coordinates Nᵀ of it (free,).
        """
        here = self._mechanics()
        force = here.loads(gravity=True)
        return np.asarray(here.minimal().N.T @ force) if minimal else force

    def accelerations(
        self,
        u: Mapping[str, float] | Sequence[float] | Array | None = None,
        *,
        minimal: bool = False,
    ) -> Array:
        """Accelerations (coordinates,) [length/time², rad/time²]; of minimal coordinates (free,).

        Parameters
        ----------
        u : mapping or array (inputs,), optional
            Inputs in place of the present ones, for this evaluation alone.
        """
        n = self.system.coordinates
        record = self._instant_record()
        if u is not None:
            record = memoryview(self._integration.instant(self.inputs.array(u)).reshape(-1).data)
            self._record_valid = False
        a = np.array(record[2 * n : 3 * n])
        return np.asarray(self._mechanics().minimal().P @ a) if minimal else a

    def multipliers(self) -> Array:
        """λ (rows,), in the order of `row_names`, of M a + Φ_qᵀ λ + h = 0 [force, or force·length].
        Redundant rows share theirs by the least norm.
        """
        primitive, row, _ = self.system.row_table
        first = 3 * self.system.coordinates
        return np.array(self._instant_record())[first + PER_PRIMITIVE * primitive + row]

    @property
    def row_names(self) -> tuple[str, ...]:
        """The element of every row of the constraints: joints, couplings, drivers."""
        primitives = self.system.row_table[0]
        return tuple(self.system.owners[e][0].name for e in primitives)

    @property
    def minimal(self) -> Minimal:
        """Minimal coordinates at present: their leaders, N (coordinates, free) and P (free,
        coordinates).
        """
        return self._mechanics().minimal()

    @property
    def q_min(self) -> Array:
        """Minimal coordinates (free,): angles [rad] of the leaders that turn, and of others the
        distances along which they slide now [length].
        """
        return np.asarray(self.minimal.P @ self.q)

    @property
    def N(self) -> Array:
        """Rates of all coordinates for unit rates of the minimal ones: (coordinates, free)."""
        return self.minimal.N

    def state_matrices(
        self, measures: str | Measure | Sequence[str | Measure] = ()
    ) -> StateMatrices:
        """A, B, C, D of small changes about the present state: ẋ = A x + B u, y = C x + D u.

        x are small changes of the minimal coordinates and their rates, y those of measures; see
        `mbody.engineering.linearize`, whose code it is.
        """
        return linearize(self.system, at=self.solution()).state_matrices(measures)

    def _mechanics(self) -> InstantMechanics:
        own = np.array(self._instant_record())[self.system.auxiliary_rows]
        return InstantMechanics(self.system, self.t, self.q, self.v, own)
