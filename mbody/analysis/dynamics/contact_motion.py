"""Motion with contacts, ropes and frictional joints: smooth steps between located changes of modes.

Between two changes every row of the active set keeps its state: what sticks and what is closed
is a constraint, what slides has friction from its real force. Guards are positive as long as that
holds: the gap of an open contact, the force of a closed one, the reserve of friction of one that
sticks, the rate of one that slides, det(I − φ′ B) of sliding friction. Where one of them falls to
zero the step is run again up to there; impacts are resolved while a closed contact is approached,
then complementarity of accelerations decides how all go on (`contact_decision`).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from mbody.analysis.contact.friction_problem import arresting_impulses
from mbody.analysis.contact.unilateral import SLIP_SIGNS, Rows, Unilateral
from mbody.analysis.dynamics.contact_decision import (
    Impact,
    closed_points,
    decide,
    first_overlap,
    impact_of,
    lost_by_masses,
    refuse_driven_impact,
    strike,
)
from mbody.analysis.dynamics.contact_start import fit_contacts
from mbody.analysis.dynamics.events import (
    OF_A_STEP,
    Guard,
    JumpIntegration,
    LocatedZero,
    StepStart,
    extrema,
)
from mbody.analysis.dynamics.integration import AT_ONCE
from mbody.analysis.dynamics.integrators import ExplicitSteps
from mbody.analysis.dynamics.modal_motion import (
    MODES,
    DecisionMemory,
    ModalMotion,
    ModeTransition,
    SharedForces,
    refined_where_uneven,
)
from mbody.analysis.dynamics.restart import GUARDS, fresh_guards, set_active_set, shared_of
from mbody.analysis.dynamics.shared_friction import InstantModes, Reported, reported_instant
from mbody.core import tolerances as tol
from mbody.kernels.contact_guards import (
    LOOKS,
    Guards,
    find_guards,
    guard_history,
    guard_sizes,
    present_guards,
)
from mbody.kernels.contact_impacts import COLLISIONLESS, QUIET, RESTED, STILL, WEDGED
from mbody.kernels.contact_modes import MASSLESS
from mbody.kernels.friction import DETERMINANT, FRICTION_KINDS
from mbody.kernels.held_forces import no_held_forces
from mbody.kernels.layout import Layout
from mbody.kernels.loop_closure import laws_of_time
from mbody.kernels.step_state import (
    DELIVERED,
    DONE,
    JACOBIAN_VALID,
    MORE,
    NEAR_SINGULAR,
    NOT_FINITE,
    NOT_QUIET,
    STEP_VANISHED,
    TIME,
    ZERO,
    Outputs,
)
from mbody.kernels.watched_steps import watched_steps
from mbody.model.element import listed
from mbody.model.simulation import Event
from mbody.solution.doubts import Doubt, doubted
from mbody.solution.energy import causes, gain_of_jump, works_of_moving
from mbody.solution.histories import EventRecord, reported_certificate, with_fields
from mbody.solution.shared_forces import ForceSet, SharedResult, inadmissible
from mbody.solution.solution import IntegrationSettings, ModalState, Restart, Solution
from mbody.system.assembler import without_nodes
from mbody.system.system import System

# -- Guards of the modes of contacts and frictional joints, and their values -------------------

Array = np.ndarray


def blank_guards(motion: ModalMotion) -> Guards:
    """Memory for the guards of a motion."""
    points, owners = len(motion.uni.contact_points), len(motion.uni.every_body)
    most = 3 * points + owners + 2
    return Guards(
        count=np.zeros(1, dtype=np.int64),
        kind=np.zeros(most, dtype=np.int64),
        owner=np.zeros(most, dtype=np.int64),
        **{name: np.zeros((LOOKS, most)) for name in ("value", "rate", "gap", "past", "past_rate")},
        fresh=np.zeros(most),
        slow=tol.RATE_NONE_FRICTION * motion.speeds,
        ends=np.zeros((points, 2)),
        end_rates=np.zeros((points, 2)),
        arm=np.zeros(7),
        stage=np.zeros(len(motion.y)),
        known=np.zeros(1, dtype=np.int64),
        passed=np.zeros(1, dtype=np.int64),
        part=np.zeros(1),
        asked=np.zeros(4),
        page=np.zeros((motion.system.record_rows, 1)),
        sense=np.zeros(most),
        size=np.zeros(most),
        body_part=np.array(motion.uni.parts, dtype=np.int64),
        length=np.array(motion.system.lengths, dtype=float),
        force_arm=motion.uni.arms,
        force=np.zeros(owners),
        body_force=np.zeros(motion.layout.bodies + 1),
        part_force=np.zeros((motion.layout.bodies, 2)),
        leader=np.zeros(owners, dtype=np.int64),
        open_normal=np.zeros(owners, dtype=np.int64),
        open_tangent=np.zeros(owners, dtype=np.int64),
        held=no_held_forces(),
        **dict(zip(("open", "program"), motion.memory.open_forces(0, 0, 0, 0), strict=True)),
    )


def guards_of(motion: ModalMotion) -> list[Guard]:
    """Guards of the present modes: gaps, normal forces, friction reserves, sliding velocities."""
    points, M, G = len(motion.uni.contact_points), motion.memory.modes, motion.guard_table
    shared = motion.shared
    M.mode[:] = [MODES.index(one) for one in (*motion.modes, *motion.pairs)]
    for table in (G.open_normal, G.open_tangent, M.beyond):
        table[:] = 0
    M.leader[:] = -1
    for owner, group in motion.groups.items():
        M.leader[group] = owner
    M.leader[points:] = np.arange(points, len(M.leader))
    M.beyond[list(motion.beyond)] = 1
    if shared is not None:
        G.open_normal[list(shared.pressing)] = 1
        G.open_tangent[list(shared.members)] = 1
        shared.watch(motion)
    open_ones = shared.members | shared.pressing if shared is not None else frozenset[int]()
    G.slow[:] = tol.RATE_NONE_FRICTION * motion.speeds
    find_guards(motion.layout, motion.work, motion.uni.table, M, G, min(open_ones, default=-1))
    numbers = zip(G.kind[: G.count[0]].tolist(), G.owner.tolist(), strict=False)
    found = [Guard(GUARDS[kind], owner) for kind, owner in numbers]
    G.fresh[: len(found)] = [motion.fresh.get(guard, 0.0) for guard in found]
    return found


def guard_values(motion: ModalMotion, t: Array, records: Array) -> Array:
    """Values (guards, instants) by times and records (instants, rows, 1)."""
    G, probe = motion.guard_table, motion.probe
    found, flat = np.empty((len(G.kind), len(records))), np.ascontiguousarray(records[:, :, 0])
    probe.signal[:] = motion.work.signal
    table = motion.layout, probe, motion.uni.table, G
    guard_history(*table, np.ascontiguousarray(t), flat, found)
    return found[: len(motion.guards)]


# -- Integration between two changes of modes: active constraints, guards, restarts ------------


class ModalIntegration(JumpIntegration):
    """Integrates one system with rows of the active set, in given modes."""

    decides_modes = True

    def __init__(
        self,
        system: System,
        start: Solution,
        settings: IntegrationSettings,
        events: tuple[Event, ...],
    ) -> None:
        super().__init__(system, start, settings, events)
        self.uni = Unilateral(system)
        self.uni.regularization = self.regularization
        self.motion = refined_where_uneven(self.motion, self.uni)
        self.probe = self.work.copied()
        self.stops = [one.name for one in system.mechanism.contacts]
        self.lost = np.zeros(len(self.stops))
        self.work_names = causes(system)
        #: Where the work of stops that move is accounted.
        self.moving = {
            one.removesuffix(".moving"): self.work_names.index(one)
            for one in works_of_moving(system)
        }
        #: Modes of the contact points and of the frictional joints, and which rows are on.
        self.modes = ["open"] * len(self.uni.contact_points)
        self.pairs = ["slip+"] * len(self.uni.friction_joints)
        self.on = np.zeros(len(self.uni))
        #: When contacts were struck last, by the number of the contact point.
        self.struck: dict[int, float] = {}
        self.groups: dict[int, list[int]] = {}
        self.shared: SharedForces | None = None
        self.fresh: dict[Guard, float] = {}
        self.memory = DecisionMemory(self.uni)
        self.guard_table = blank_guards(self)
        #: The least value of them where the derivative was just evaluated, else not a number.
        self.least_guard = np.inf
        #: Whether loads follow laws of time, of which the length of steps says nothing.
        self.swings = self.layout.varying > 0 or system.has_user_code
        #: By which rows are on.
        self.layouts: dict[bytes, Layout] = {}
        #: Open contact points that have left their edge over its end.
        self.beyond: set[int] = set()
        self.last_change, self.changes = -np.inf, 0
        #: When det(I − φ′ B) of what slides would vanish, as the last step has it.
        self.pole = np.inf
        #: Whether rates of drivers have jumped.
        self.jerked = False
        self.transition = ModeTransition()
        self.kept_modes: list[dict[str, str]] = []
        #: All admissible forces of the kept instants, where they are not determined.
        self.kept_forces: list[ForceSet | None] = []
        #: Modes before those that are being decided; modes whose forces are determined.
        self.before: InstantModes | None = None
        self.determined = b""
        self.last_shown: tuple[bytes, Reported] | None = None
        self.contact_notes: list[str] = []
        #: What is said where no modes go on.
        self.none = "no accelerations are consistent"
        #: The state before the step that ends in time, and that which it went on from.
        self.before_end: Restart | None = None
        self.resumed: ModalState | None = None
        #: The record with which a step begins, as it is kept for who goes on from there.
        self.initial_states = np.empty((0, 1))

    @property
    def watches(self) -> bool:
        """Whether the kernel watches steps: it knows no events of users, nor implicit methods."""
        explicit = isinstance(self.steps, ExplicitSteps)
        return explicit and not (self.events or self.sided)

    def load(self) -> None:
        """The present state into the workspace."""
        n = self.system.coordinates
        self.work.q[:n, 0], self.work.v[:n, 0] = self.y[:n], self.y[n : 2 * n]
        self.work.time[0, 0] = self.state[TIME]

    def _keep(self, t: float, record: Array, work: Array) -> None:
        if self.instants and self.instants[-1] == t:
            self.kept_modes.pop()
            self.kept_forces.pop()
        shown = self.shown(t, record)
        super()._keep(t, shown.record[:, None], work)
        rows = self._look_at(t, record) if "redundant" in self.modes else None
        self.kept_modes.append(self.named_modes(rows=rows))
        self.kept_forces.append(shown.forces)

    @property
    def modes_now(self) -> InstantModes:
        """The present modes."""
        return InstantModes(self.modes, self.pairs, self.on)

    def shown(self, t: float, record: Array, modes: InstantModes | None = None) -> Reported:
        """A record (rows, 1) with admissible forces, of the present modes or of others."""
        modes, plain = modes or self.modes_now, Reported(record[:, 0], None)
        key = repr((modes.modes, modes.pairs)).encode() + modes.on.tobytes()
        if not modes.on.any() or key == self.determined:
            return plain
        n, numbers = self.system.coordinates, self.system.friction_rows.start
        place = key + record[: 2 * n].tobytes() + record[3 * n : numbers].tobytes()
        if self.last_shown is not None and self.last_shown[0] == place:
            known = self.last_shown[1]
            found = record[:, 0].copy()
            found[3 * n : numbers] = known.record[3 * n : numbers]
            return known._replace(record=found)
        rows = self._look_at(t, record)
        found_now = reported_instant(self.uni, self.probe, rows, record[:, 0], modes)
        if found_now.forces is None:
            self.determined = key
        else:
            self.last_shown = place, found_now
        return found_now

    def _present_record(self) -> Array:
        return self.shown(float(self.state[TIME]), self.record).record[:, None]

    def _instant(self, t: float, instant: Array, modes: InstantModes | None = None) -> Solution:
        shown = self.shown(t, instant, modes)
        found = super()._instant(t, shown.record[:, None])
        return with_fields(found, shared=self.shared_result(shown.forces))

    def shared_result(self, *forces: ForceSet | None) -> SharedResult | None:
        """Admissible forces of instants; None where all are determined."""
        if not any(one is not None for one in forces):
            return None
        names = [one.name for one in self.uni.contact_points]
        names += [one.name for one in self.uni.friction_joints]
        return SharedResult(forces, tuple(names))

    def named_modes(
        self,
        modes: list[str] | None = None,
        pairs: list[str] | None = None,
        rows: Rows | None = None,
    ) -> dict[str, str]:
        """The mode of every contact and frictional joint, by default the present one: of several
        contact points that which holds most. `rows`, by default at the present state.
        """
        modes, pairs = modes or self.modes, pairs or self.pairs
        found = {
            pair.name: mode for pair, mode in zip(self.uni.friction_joints, pairs, strict=True)
        }
        order = ("open", "redundant", "slip-", "slip+", "stick", "roll")
        for n, (point, one) in enumerate(zip(self.uni.contact_points, modes, strict=True)):
            mode = self._by_rate(n, rows) if one == "redundant" else one
            named = "roll" if mode == "stick" and point.candidate.round else mode
            if point.static == 0.0 and mode in SLIP_SIGNS:
                named = "slip+"  # smooth: its direction changes nothing
            if point.tangent < 0 and mode != "open":
                named = "stick"
            sticking = found.get(point.name, "open")
            found[point.name] = max((sticking, named), key=order.index)
        return {name: "stick" if mode == "redundant" else mode for name, mode in found.items()}

    def _by_rate(self, n: int, rows: Rows | None) -> str:
        """The mode of a redundant contact point that slides."""
        point = self.uni.contact_points[n]
        if point.tangent < 0:
            return "redundant"
        if rows is None:
            self.load()
            rows = self.uni.read(self.work)
        rate = float(rows.rate[point.tangent])
        if abs(rate) <= tol.RATE_NONE_FRICTION * self.speeds[n]:
            return "redundant"
        return "slip+" if rate > 0.0 else "slip-"

    @property
    def speeds(self) -> Array:
        """Velocity scales: the fastest motion of both bodies, in model lengths a time."""
        n = self.system.coordinates
        own = (self.scale[n : 2 * n] / self.scale[:n]).reshape(-1, 3).max(axis=1)
        return np.asarray(self.system.length * self.uni.greatest_of(own))

    @property
    def gap_tolerance(self) -> float:
        """Gaps up to this are none [length]."""
        return tol.CONTACT_GAP_CLOSED * self.system.length

    def take_modes(self) -> None:
        """The modes and rows that the kernels have set, evaluated."""
        M, count = self.memory.modes, len(self.uni.contact_points)
        every = [MODES[one] for one in M.mode.tolist()]
        self.modes, self.pairs, self.groups = every[:count], every[count:], {}
        for k, leader in enumerate(M.leader[:count].tolist()):
            if leader >= 0:
                self.groups.setdefault(leader, []).append(k)
        self.on = self.work.on[: len(self.uni), 0].copy()
        self.eliminate_rows_that_are_on()
        self.evaluate()

    def eliminate_rows_that_are_on(self) -> None:
        """Steps leave out the blocks of rows that are off."""
        key = self.on.tobytes()
        if key not in self.layouts:
            off = np.zeros(self.layout.nodes, dtype=bool)
            off[self.layout.primitive_node[self.layout.active_set]] = self.on == 0.0
            self.layouts[key] = without_nodes(self.layout, off)
        self.motion = replace(self.motion, layout=self.layouts[key])

    # -- guards -------------------------------------------------------------------------------

    def _values(self, which: list[int], t: Array, records: Array) -> Array:
        count = len(self.events)
        own = [n for n in which if n < count]
        found = np.empty((len(which), len(t)))
        if own:
            read = records
            if not self.carried[own].all():  # forces are in them
                each = zip(t, records, strict=True)
                read = np.array([self.shown(float(at), one).record[:, None] for at, one in each])
            found[: len(own)] = super()._values(own, t, read)
        if len(own) < len(which):
            chosen = [n - count for n in which if n >= count]
            found[len(own) :] = guard_values(self, t, records)[chosen]
        return found

    def _sampled(self, times: Array, marks: Array, records: Array) -> tuple[Array, Array]:
        found, rising = super()._sampled(times, marks, records)
        for k, guard in enumerate(self.guards, start=len(self.events)):
            if (least := self.fresh.get(guard)) is not None:
                rounding = np.abs(found[k]) <= least
                found[k] = np.where(rounding, least, found[k])
                rising[k] = np.where(rounding, 0.0, rising[k])
        return found, rising

    def _sample_count(self, h: float) -> int:
        """Of a motion without events of its own: independent of its end, so that one that goes on
        takes the same steps.
        """
        return super()._sample_count(h) if self.events else OF_A_STEP

    def _sample_times(self, t: float, h: float, count: int, wanted: Array) -> Array:
        return super()._sample_times(t, h, count, wanted if self.events else wanted[:0])

    def _longest_from(self, times: Array, found: Array, rising: Array) -> float:
        """Half the time to where det(I − φ′ B) would vanish: forces have a pole there, beyond which
        a step would see them with the other sign.
        """
        if Guard("paradox") not in self.guards:
            return np.inf
        k = len(self.events) + self.guards.index(Guard("paradox"))
        here, there = found[k, :2]
        rate = (there - here) / (times[1] - times[0])
        if rate >= 0.0:  # as where the contact does not press at the other one
            rate = rising[k, 0]
        until = -float(here / rate) if here > 0.0 > rate else np.inf
        self.pole = float(times[0]) + until
        return 0.5 * until

    def _resolved(self, times: Array, found: Array, rising: Array) -> bool:
        """Whether cubics over two samples show the forces at the one between: loads may swing while
        nothing moves, so that steps know nothing of them.
        """
        which = [
            k
            for k, guard in enumerate(self.guards, start=len(self.events))
            if guard.kind in ("open", "slip", "share")
        ]
        g, r, h = found[which], rising[which], times[2:] - times[:-2]
        x = (times[1:-1] - times[:-2]) / h
        low, high, change = g[:, :-2], g[:, 2:], g[:, 2:] - g[:, :-2]
        p, q = h * r[:, :-2], h * r[:, 2:]
        interpolated = low + x * (p + x * (3.0 * change - 2.0 * p - q + x * (p + q - 2.0 * change)))
        error = np.abs(interpolated - g[:, 1:-1])
        distance = np.minimum(np.minimum(low, high), g[:, 1:-1])
        size = np.abs(g).max(axis=1, initial=0.0, keepdims=True)
        allowed = np.maximum(
            tol.CONTACT_RESERVE_UNSEEN * distance, tol.CONTACT_RESERVE_RESOLVED * size
        )
        # what is taken for a little more than zero jumps where it falls below that
        rounding = [self.fresh.get(self.guards[k - len(self.events)], np.nan) for k in which]
        shifted = g == np.array(rounding).reshape(-1, 1)
        shifted = shifted[:, :-2] | shifted[:, 1:-1] | shifted[:, 2:]
        return bool((shifted | (error <= allowed)).all())

    def _may_count(self, saved: StepStart, event: Event | Guard, times: Array) -> bool:
        """False of a gap well behind an edge from one time to the other: it closes nothing."""
        if not isinstance(event, Guard) or event.kind != "close":
            return True
        later = times[times > saved.state[TIME]]
        self._restore(saved)
        _, records, _ = self._run(self.target, 1, later)
        before = np.broadcast_to(saved.record, (len(times) - len(later), *saved.record.shape))
        rows = [self._look_at(t, one) for t, one in zip(times, [*before, *records], strict=True)]
        gaps, rates = (
            np.array([part(one)[event.number] for one in rows])
            for part in (self.uni.gaps, self.uni.approach)
        )
        _, between = extrema(
            np.diff(times), *(one[k : k + 1] for one in (gaps, rates) for k in (0, 1))
        )
        nearest = max(gaps.max(), np.nan_to_num(between, nan=-np.inf).max())
        return bool(nearest >= min(-self.gap_tolerance, tol.CONTACT_EDGE_BEHIND * gaps.max()))

    def _counts(self, one: LocatedZero) -> bool:
        """Whether a gap that closes does so within the ends of its edge: what comes round an end
        from behind closes none, nor does what touches on its way and goes away by itself, as the
        end of an arc on which a disc slides.
        """
        if not isinstance(one.event, Guard) or one.event.kind != "close":
            return True
        number, record = one.event.number, one.saved.record
        rows = self._look_at(one.t, record)
        if self.uni.gaps(rows)[number] < -self.gap_tolerance:
            return False
        pull = float(self.uni.pulls(rows, number, record[2 * self.system.coordinates :, 0]).sum())
        overlap = tol.GUARD_ROUNDING_GAP * self.system.length
        if 0.0 < self.uni.approach(rows)[number] ** 2 <= 2.0 * overlap * pull:
            return False
        within = self.uni.within_edges(
            rows, self.probe, self.gap_tolerance, tol.RATE_NONE_FRICTION * self.speeds
        )
        return bool(within[number])

    def _look_at(self, t: float, record: Array) -> Rows:
        """The rows at a time and record (rows, 1), of which the probe has the position."""
        n, probe = self.system.coordinates, self.probe
        probe.signal[:] = self.work.signal
        probe.q[:n, 0], probe.v[:n, 0], probe.time[0, 0] = record[:n, 0], record[n : 2 * n, 0], t
        laws_of_time(self.layout, probe)
        return self.uni.read(probe)

    # -- restarts -----------------------------------------------------------------------------

    def _save(self) -> StepStart:
        self.initial_states = self.record
        return super()._save()

    def _restart_state(self, work_done: Array) -> Restart:
        """With the modes. The first one before the end counts: what happens in a step that ends
        there happens again, in the whole of it.
        """
        if self.before_end is None:
            self.before_end = replace(super()._restart_state(work_done), modal=self._modal_state())
        return self.before_end

    def _modal_state(self) -> ModalState:
        shared = self.shared
        parts = shared.parts if shared is not None else ()
        return ModalState(
            modes=tuple(self.modes),
            pairs=tuple(self.pairs),
            on=tuple(self.on.tolist()),
            anchor=tuple(self.work.anchor[: len(self.on), 0].tolist()),
            phases=tuple(float(self.work.par[row, 0]) for row in self.uni.phase_rows),
            groups=tuple(map(tuple, self.groups.values())),
            shared=parts,
            closed=tuple(sorted(self.transition.closed)),
            beyond=tuple(sorted(self.beyond)),
            fresh=tuple((one.kind, one.number, least) for one, least in self.fresh.items()),
            struck=tuple(self.struck.items()),
            page=tuple(self.initial_states[:, 0].tolist()),
            lost=tuple(self.lost.tolist()),
        )

    def _resume(self, restart: Restart) -> None:
        found = restart.modal
        assert found is not None
        self.modes, self.pairs = list(found.modes), list(found.pairs)
        self.on = set_active_set(self.uni, self.work, found)
        self.eliminate_rows_that_are_on()
        self.groups = {group[0]: list(group) for group in found.groups}
        self.shared, self.beyond = shared_of(found), set(found.beyond)
        self.transition = ModeTransition(set(found.closed))
        self.struck = dict(found.struck)
        # the first instant, with what is on
        self.evaluate()
        super()._resume(restart)
        self.fresh = fresh_guards(found)
        self.guards = guards_of(self)
        self.resumed = found

    def _restart(self, work_done: Array) -> Restart | None:
        """Where to continue, with what contacts took since the last instant, too."""
        found = super()._restart(work_done)
        if found is None or found.modal is None:
            return None
        lost = tuple((np.array(found.modal.lost) - work_done[-1, self.causes :]).tolist())
        return replace(found, modal=replace(found.modal, lost=lost))

    def _begin(self) -> None:
        """Takes over losses and record of the last instant of the motion that it continues."""
        if self.resumed is not None:
            self.lost = np.array(self.resumed.lost)
            self.record = np.array(self.resumed.page)[:, None]


#: Impacts, and changes of modes, at one instant, at most.
STRIKES, CHANGES = 500, 200
#: A guard begins at zero where it is less than this part of its size; until the modes change
#: again what is less than rounding of it is taken for a little more.
ROUNDING = {
    "close": tol.GUARD_ROUNDING_GAP,
    "edge": tol.GUARD_ROUNDING_GAP,
    "enter": tol.GUARD_ROUNDING_GAP,
    "stop": tol.GUARD_ROUNDING_STOP,
    "lock": tol.GUARD_ROUNDING_STOP,
}


class ContactIntegration(ModalIntegration):
    """Integrates one system with rows of the active set, and decides which are."""

    # -- the motion ---------------------------------------------------------------------------

    def _integrate(self, times: Array, progress: Callable[[float], None] | None) -> tuple[int, str]:
        if self.resumed is not None:
            return super()._integrate(times, progress)
        self.wanted, self.instants = times, list[float]()
        self.records, self.works = list[Array](), list[Array]()
        self.total = self.initial_work.copy()
        if status := self.begin_modes():
            return MORE, status
        return super()._integrate(times, progress)

    def begin_modes(self) -> str:
        """Decide the first modes, refusing what overlaps; a status where the motion ends there."""
        self.load()
        if (fitted := fit_contacts(self.uni, self.work)) is not None:
            self.contact_notes += [fitted] if fitted else []
            self.y[: self.system.coordinates] = self.work.q[: self.system.coordinates, 0]
            self.evaluate()
            self.load()
        touching = first_overlap(
            self.uni, self.work, tol.CONTACT_GAP_BEGINNING * self.system.length
        )
        approach = self.uni.approach(self.uni.read(self.work))
        # what moves apart is closed no longer
        self.transition = ModeTransition(
            {n for n in touching if approach[n] <= tol.RATE_NONE_FRICTION * self.speeds[n]}
        )
        status = self._settle(begins=True)
        return status or (self._settle(begins=True) if self._rolls_at_once() else "")

    def _rolls_at_once(self) -> bool:
        """Whether what slides by a motion without inertia is stopped: it takes no friction."""
        points, n = self.uni.contact_points, self.system.coordinates
        slides = [
            k
            for k, mode in enumerate(self.modes)
            if mode in SLIP_SIGNS and points[k].tangent >= 0 and points[k].friction > 0.0
        ]
        if not slides or self.system.mass[:n, 0].all():
            return False
        self.load()
        count, which = len(slides), np.array(slides)
        stiff = self.memory.responses(self, which, 1.0).delassus.diagonal()[:count].copy()
        soft = self.memory.responses(self, which, MASSLESS)
        delassus, rates = soft.delassus[:count, :count], soft.before[:count]
        light = np.diag(delassus) > 2.0 * stiff
        light &= np.abs(rates) > tol.RATE_NONE_FRICTION * self.speeds[slides]
        if not light.any():
            self.evaluate()
            return False
        stops = arresting_impulses(delassus[np.ix_(light, light)], rates[light])
        self._switch_off()
        self.y[n : 2 * n] += stops @ soft.Y[:count][light]
        self.evaluate()
        names = listed([points[k].name for k, some in zip(slides, light, strict=True) if some])
        self.contact_notes.append(
            f"what slides at the beginning at {names} has no inertia to do so: it rolls at once"
        )
        return True

    def _guarded(self) -> tuple[Array, list[float]]:
        found = guard_values(self, self.state[[TIME]], self.record[None])[:, 0]
        m, G = self.motion, self.guard_table
        guard_sizes(m.layout, m.work, m.stepping, self.uni.table, G, self.record)
        return found, G.size[: len(found)].tolist()

    def evaluate(self) -> bool:
        """With a look at the guards."""
        closes = super().evaluate()
        table = self.uni.table, self.guard_table
        self.least_guard = present_guards(self.motion.layout, self.work, *table)
        return closes

    def _broken(self) -> bool:
        if self.guard_table.known[0] and self.least_guard >= 0.0:
            return False
        return any(
            value < -tol.GUARD_ZERO * size for value, size in zip(*self._guarded(), strict=True)
        )

    def _settle_anew(self) -> str:
        self.transition = ModeTransition({n for n, mode in enumerate(self.modes) if mode != "open"})
        return self._settle()

    def _loosen(self) -> None:
        """A driver that jerks moves what touches by impacts, not by rows that hold."""
        self._switch_off()

    def _settle_jump(self) -> None:
        """Impacts of what the driver moves towards each other; what it moves apart opens."""
        self.load()
        approach, velocity_tolerance = (
            self.uni.approach(self.uni.read(self.work)),
            tol.RATE_NONE_FRICTION * self.speeds,
        )
        self.transition = ModeTransition(
            {
                n
                for n, mode in enumerate(self.modes)
                if mode != "open" and approach[n] <= velocity_tolerance[n]
            }
        )
        self.jerked = True
        self.ending = self._settle()

    def _restore(self, saved: StepStart) -> None:
        super()._restore(saved)
        self.guard_table.known[0] = 0

    def _if_quiet(self, until: float, count: int, outputs: Outputs) -> int:
        """At most so many steps towards a time, if they are quiet, and the record of where they
        end.
        """
        code = self._quietly(until, count, outputs, True)
        self.record = self.initial_states = self.guard_table.page.copy()
        return code

    def _quietly(self, until: float, count: int, outputs: Outputs, locates: bool) -> int:
        m, method = self.motion, self.steps.method
        bundles = m.layout, m.work, method, m.stepping, m.tolerances, outputs
        G, self.least_guard = self.guard_table, np.nan
        G.asked[:] = until, count, self.swings, locates
        return int(watched_steps(*bundles, self.uni.table, G))

    def _quiet_steps(self) -> int:
        """Steps towards the next set time as long as they are quiet, keeping the instants that they
        meet: a code of the kernel.
        """
        t = float(self.state[TIME])
        first, last = np.searchsorted(self.wanted, [t, self.target], side="right")
        marks = self.wanted[first:last]
        code, records, work = self._run(self.target, AT_ONCE, marks, self._if_quiet)
        for n in range(int(self.state[DELIVERED])):
            self._keep(float(marks[n]), records[n], work[n])
        return code

    def _step(self) -> tuple[int, str]:
        """Steps come up to where forces of what slides grow without bound, or vanish before."""
        t, code, status = float(self.state[TIME]), NOT_QUIET, ""
        if self.watches and not self.ending and t < min(self.target, self.until):
            code = self._quiet_steps()
            if code == ZERO:
                return MORE, self._passed(self.guards[self.guard_table.passed[0]])
            code = MORE if code == DONE and self.target < self.until else code
        if code == NOT_QUIET:
            self.guard_table.known[0] = 0
            code, status = super()._step()
        if status or Guard("paradox") not in self.guards:
            return code, status
        found = abs(self.record[self.system.friction_rows.start + DETERMINANT, 0])
        vanished = code in (STEP_VANISHED, NOT_FINITE) and found < tol.FRICTION_SINGULAR
        # what steps leave of the velocities decides closer by whether the contact still presses
        if vanished or found < tol.FRICTION_POLE * self.settings.rtol:
            t = float(self.state[TIME])
            return MORE, self._paradox(self.pole if np.isfinite(self.pole) else t)
        return code, status

    # -- changes of modes ---------------------------------------------------------------------

    def _passed(self, guard: Guard) -> str:
        """Go on from where a guard is zero."""
        t = float(self.state[TIME])
        self.changes = (
            self.changes + 1 if t - self.last_change <= tol.TIMES_SAME_MODES * abs(t) else 0
        )
        self.last_change = t
        if self.changes > CHANGES:
            return self._ended(
                f"contacts and friction change their modes without end, last {self._who(guard)}"
            )
        if guard.kind == "paradox":
            return self._paradox(t)
        transition, n = self.transition, guard.number
        if guard.kind in ("close", "lock"):
            transition.closed.add(n)
        elif guard.kind in ("open", "edge"):
            transition.opened = {n}
            if guard.kind == "edge":
                self.beyond.add(n)
        elif guard.kind == "enter":
            self.beyond.discard(n)
        elif guard.kind == "slip":
            transition.sliding = self._together(n, self._impending(n))
        elif guard.kind == "share" and self.shared is not None:
            self.load()
            reserve = self.shared.reserve(self, self.record[:, 0], self.work)
            for one, slip_sign in reserve.sliding.items():
                transition.sliding |= self._together(one, slip_sign)
            transition.opened = reserve.opened
        elif guard.kind == "stop":
            transition.stopped = {n}
        return self._settle()

    def _impending(self, n: int) -> float:
        """The direction in which what sticks would slide: that of its multiplier."""
        points = len(self.uni.contact_points)
        row = (
            self.uni.contact_points[n].tangent
            if n < points
            else self.uni.friction_joints[n - points].tangent
        )
        return float(np.sign(self.uni.multiplier(self.record[:, 0], row))) or 1.0

    def _together(self, n: int, slip_sign: float) -> dict[int, float]:
        """The directions in which all slides that sticks by the row of contact point or frictional
        joint n.
        """
        group = self.groups.get(n, [n])
        if len(group) == 1:
            return {n: slip_sign}
        self.load()
        rows, units = self.uni.read(self.work), self.system.coordinate_units**2
        own = rows.block[self.uni.contact_points[n].tangent] * units
        along = {k: own @ rows.block[self.uni.contact_points[k].tangent] for k in group}
        return {k: slip_sign * float(np.sign(part)) for k, part in along.items()}

    def _who(self, guard: Guard) -> str:
        points = self.uni.contact_points
        one = points[guard.number] if guard.number < len(points) else None
        return f"'{one.name if one else self.uni.friction_joints[guard.number - len(points)].name}'"

    def _settle(self, *, begins: bool = False) -> str:
        """Impacts while a closed contact is approached, then the modes that go on; a status where
        the motion ends.
        """
        before = list(self.modes), list(self.pairs)
        state_before = self.record.copy()
        self.before = InstantModes(*before, self.on.copy())
        for _ in range(STRIKES):
            found = self.memory.resolve(self, self.struck)
            if found == QUIET:
                break
            closed = np.flatnonzero(self.memory.modes.touches).tolist()
            if (status := self._impact(closed, found)) is not None:
                return status
        else:
            name = self.uni.contact_points[int(self.memory.impact.first[0])].name
            return self._ended(f"impacts at '{name}' do not end")
        if not self._go_on(None if begins else before, state_before):
            return self._without_collision(before)
        return ""

    def _go_on(self, before: tuple[list[str], list[str]] | None, record: Array) -> bool:
        """Set the modes that go on and record what changes; whether there are consistent ones.
        `before` and `record`: the modes, None at the beginning, and the record before.
        """
        verdict = decide(self)
        self.none = "no accelerations are consistent"
        if not verdict.complete:  # of so many contacts not every set of modes was tried
            self.none = "no consistent accelerations were found"
        if not verdict.consistent:
            return False
        if verdict.several:
            self._note_several(record)
        self._begin_anew()
        if before is not None:
            self._record_changes(before, record)
        return True

    def _begin_anew(self) -> None:
        """Steps begin at the modes that were decided."""
        state = self.state
        state[NEAR_SINGULAR] = state[JACOBIAN_VALID] = 0.0
        self.steps.jumped(self.motion)
        self.transition = ModeTransition({n for n, mode in enumerate(self.modes) if mode != "open"})
        self.guards = guards_of(self)
        self._check_finite(self.K, float(state[TIME]))
        found, sizes = self._guarded()
        # what begins below zero is zero from there on: it falls where it falls further
        self.fresh = {
            guard: max(
                ROUNDING.get(guard.kind, tol.GUARD_ROUNDING_FORCE) * size,
                -tol.GUARD_FALLING * float(value),
            )
            for guard, value, size in zip(self.guards, found, sizes, strict=True)
            if abs(value) <= tol.GUARD_ZERO * size
        }
        self.guard_table.fresh[: len(self.guards)] = [
            self.fresh.get(one, 0.0) for one in self.guards
        ]

    # -- impacts ------------------------------------------------------------------------------

    def _impact(self, closed: list[int], found: int) -> str | None:
        """Account for what the kernels have `found` of an impact of all closed contact points; a
        status where it has no solution.
        """
        n, t, I = self.system.coordinates, float(self.state[TIME]), self.memory.impact
        if found == WEDGED:
            hit = np.flatnonzero(I.hit).tolist()
            refuse_driven_impact(self, hit)
            return self._wedged(closed, hit)
        first, record = int(I.first[0]), self.record.copy()
        before = self.memory.modes.y[n : 2 * n].copy()
        self.struck[first] = t
        self.on = np.zeros(len(self.on))
        self.evaluate()
        impact, name = impact_of(self), self.uni.contact_points[first].name
        self._add_losses(impact, closed, before)
        impulses = self._impulses(impact, closed)
        kind = "rest" if found == RESTED else "impact"
        self._record_contact(kind, t + float(I.rested[0]), name, record, self.record, impulses)
        self.transition.closed -= set(closed)
        return None

    def _wedged(self, closed: list[int], hit: list[int]) -> str:
        """No velocities keep all that strikes apart: friction wedges what Newton's law throws back,
        or drivers lead it from two sides.
        """
        names = dict.fromkeys(self.uni.contact_points[k].name for k in hit)
        quoted = ", ".join(f"'{name}'" for name in names)
        self.load()
        if strike(self, closed, STILL) is not None:
            return self._ended(
                f"an impact at {quoted} has no solution: friction wedges what Newton's law of "
                'impact would throw back; Poisson\'s law (law = "poisson") or less friction has one'
            )
        return self._ended(
            f"an impact at {quoted} has no solution: what strikes is driven against both sides at "
            "once, as a pin that enters a slot without play; give it play, or begin within the slot"
        )

    def _add_losses(self, found: Impact, closed: list[int], before: Array) -> None:
        """The energy that an impact took of the contacts; what stops that move gave. `before`
        (coordinates,): velocities.
        """
        self._check_impact(found, closed, before)
        for k, gained, moved in zip(closed, found.gained, found.moved, strict=True):
            name = self.uni.contact_points[k].name
            self.lost[self.stops.index(name)] += gained
            if name in self.moving:
                self.total[self.moving[name]] += moved
        for name, given in found.driven.items():
            self.total[self.work_names.index(name)] += given

    def _check_impact(self, found: Impact, closed: list[int], before: Array) -> None:
        """A doubt where an impact gives energy, or more or less than its impulses do."""
        mass, t = self.system.mass[: len(before), 0], float(self.state[TIME])
        gained, rounding = gain_of_jump(mass, before, found.jump)
        given = np.array([*found.moved, *found.driven.values()])
        exchanged, taken, terms = found.energy.tolist()
        exchanged += float(np.abs(given).sum())
        gained -= float(given.sum())
        none = rounding + tol.ENERGY_IMPACT * exchanged + tol.ENERGY_IMPACT_ARTIFICIAL * abs(taken)
        off = abs(gained + taken - float(found.gained.sum())) > none
        off |= abs(taken) > none + tol.ENERGY_IMPACT_ARTIFICIAL * terms
        if not (off or gained > rounding + tol.ENERGY_IMPACT_GAIN * exchanged):
            return
        points = [self.uni.contact_points[k] for k in closed]
        names, units = tuple(dict.fromkeys(one.name for one in points)), self.system.mechanism.units
        energy = units.of("torque")
        where = f"at t = {t:.6g} {units.time} the impact of {listed(names)}"
        if off:
            message = (
                f"{where} changes the energy by {gained:.3g} {energy}, its impulses by "
                f"{found.gained.sum():.3g} {energy}: do not rely on the motion from there on, and "
                "look at bodies without mass or inertia"
            )
        else:
            newton = any(one.law == "newton" and one.friction > 0.0 for one in points)
            why = "restitutions that differ do so; make them equal"
            if newton:
                why = "Newton's law does so with friction (Kane's paradox); take law = \"poisson\""
            message = (
                f"{where} gives {gained:.3g} {energy}, of {exchanged:.3g} {energy} that its "
                f"impulses exchange: {why}"
            )
        self.passage.doubts += (Doubt("energy", message, t, names),)

    def _without_collision(self, before: tuple[list[str], list[str]]) -> str:
        """Painlevé's paradox: no accelerations are consistent, an impact without collision is."""
        n, t = self.system.coordinates, float(self.state[TIME])
        self.load()
        closed = closed_points(self)
        if not closed:
            return self._undecided()
        record, velocities = self.record.copy(), self.y[n : 2 * n].copy()
        if lost := lost_by_masses(self.uni, closed):
            return self._ended(lost)
        found = strike(self, closed, COLLISIONLESS)
        names = ", ".join(dict.fromkeys(f"'{self.uni.contact_points[k].name}'" for k in closed))
        self._record_contact(
            "inconsistent", t, self.uni.contact_points[closed[0]].name, record, record
        )
        if found is None:
            return self._ended(f"no accelerations and no impact are consistent at {names}")
        self._switch_off()
        self.y[n : 2 * n] = velocities + found.jump
        self.evaluate()
        self._add_losses(found, closed, velocities)
        name, impulses = self.uni.contact_points[closed[0]].name, self._impulses(found, closed)
        self._record_contact("impact", t, name, record, self.record, impulses)
        self.contact_notes.append(
            f"at t = {t:.6g} {self.system.mechanism.units.time} {self.none} with the friction at "
            f"{names} (Painlevé's paradox): an impact without collision followed"
        )
        self.transition = ModeTransition()
        self.load()
        if not self._go_on(before, record):
            return self._ended(f"{self.none} at {names}")
        return ""

    def _undecided(self) -> str:
        """No modes of frictional joints are consistent, and no contact can be struck."""
        names = ", ".join(f"'{one.name}'" for one in self.uni.friction_joints)
        name, record = self.uni.friction_joints[0].name, self.record
        self._record_contact("inconsistent", float(self.state[TIME]), name, record, record)
        return self._ended(f"{self.none} with the friction at {names}")

    def _note_several(self, record: Array) -> None:
        """Several accelerations are consistent: an event and a note."""
        t = float(self.state[TIME])
        who = [n for n in sorted(self.transition.closed)] or closed_points(self)
        names = [self.uni.contact_points[k].name for k in who] or [
            p.name for p in self.uni.friction_joints
        ]
        quoted = ", ".join(dict.fromkeys(f"'{name}'" for name in names))
        self._record_contact("indeterminate", t, names[0] if names else "", record, record)
        why = "Painlevé's paradox): that of the least contact force was taken"
        redundant = "redundant" in self.modes or any(
            mode == "stick" and not self.on[pair.tangent]
            for pair, mode in zip(self.uni.friction_joints, self.pairs, strict=True)
        )
        if redundant:
            why = "nothing decides the forces of what rests): one of them was taken"
        self.contact_notes.append(
            f"at t = {t:.6g} {self.system.mechanism.units.time} several accelerations are "
            f"consistent with the friction at {quoted} ({why}"
        )

    def _paradox(self, t: float) -> str:
        """The end of a motion whose forces have a pole at a time, which it has come up to."""
        sliding = [
            t.name
            for t, mode in zip(self.uni.contact_points, self.modes, strict=True)
            if mode in SLIP_SIGNS
        ] + [
            p.name
            for p, mode in zip(self.uni.friction_joints, self.pairs, strict=True)
            if mode in SLIP_SIGNS
        ]
        names = ", ".join(f"'{name}'" for name in dict.fromkeys(sliding))
        self._record_contact("paradox", t, sliding[0], self.record, self.record)
        return self._ended(
            f"the forces of what slides at {names} grow without bound (Painlevé's paradox)"
        )

    def _switch_off(self) -> None:
        """No contact acts, and no joint sticks: an impact moves what stuck, which then slips. What
        slides goes on to.
        """
        slip_signs = self.work.slip_sign[: len(self.layout.friction_kind), 0].copy()
        for point in self.uni.contact_points:
            if point.pair >= 0:
                slip_signs[point.pair] = 0.0
        self.on = np.zeros(len(self.on))
        self.uni.set_rows(self.work, self.on, slip_signs)

    # -- records -------------------------------------------------------------------------------

    def _impulses(self, found: Impact, closed: list[int]) -> dict[str, tuple[float, float]]:
        """Normal and tangential impulse of every contact that took part in an impact."""
        sums: dict[str, tuple[float, float]] = {}
        for k, normal, tangent in zip(closed, *found.impulses.reshape(2, -1), strict=True):
            before = sums.get(name := self.uni.contact_points[k].name, (0.0, 0.0))
            sums[name] = before[0] + float(normal), before[1] + float(tangent)
        return sums

    def _record_contact(
        self,
        kind: str,
        t: float,
        name: str,
        record: Array,
        after: Array,
        impulses: dict[str, tuple[float, float]] | None = None,
    ) -> None:
        now = float(self.state[TIME])
        if self.resumed is not None and now <= self.first:
            return  # reported by the motion that this one continues
        every = ((record, self.before), (after, None))
        states = [self._instant(now, *one) for one in every]
        self.occurred.append(EventRecord(kind, t, states[0], states[1], name, impulses or {}))

    def _record_changes(self, before: tuple[list[str], list[str]], record: Array) -> None:
        """Records mode changes of contacts that were closed before, and contacts that close without
        an impact.
        """
        points = self.uni.contact_points
        free = {points[n].name for n in np.flatnonzero(self.uni.one_way)}
        t, now = float(self.state[TIME]), self.named_modes()
        for name, old in self.named_modes(*before).items():
            new = now[name]
            if old == new or (old == "open" and name not in free):
                continue
            kind = "open" if new == "open" else "slip" if new in SLIP_SIGNS else "stick"
            self._record_contact(kind, t, name, record, self.record)

    def _solution(self, status: str) -> Solution:
        found = super()._solution(status)
        names = {name: [each[name] for each in self.kept_modes] for name in self.named_modes()}
        notes = (*reported_certificate(found).notes, *self.contact_notes)
        if self.jerked or any(event.name == "impact" for event in found.events):
            notes += self._without_impulse()
        shared = self.shared_result(*self.kept_forces)
        found = with_fields(found, notes=notes, modes=names, shared=shared)
        return doubted(found, inadmissible(found))

    def _without_impulse(self) -> tuple[str, ...]:
        """A note on the joints whose reactions have impulses in impacts, but whose friction has
        none.
        """
        kinds = self.system.layout.friction_kind
        names = [
            pair.name
            for pair in self.uni.friction_joints
            if FRICTION_KINDS[int(kinds[pair.pair])] not in ("torque", "force")
        ]
        if not names:
            return ()
        return (f"friction in {listed(names)} has no impulse of its own at impacts",)
