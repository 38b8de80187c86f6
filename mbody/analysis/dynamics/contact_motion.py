"""Motion with contacts, ropes and frictional joints: smooth steps between located changes of modes.

Between two changes every row of the active set keeps its state: what sticks and what is closed
is a constraint, what slides has friction from its real force. Guards are positive as long as that
holds: the gap of an open contact, the force of a closed one, the reserve of friction of one that
sticks, the rate of one that slides, det(I − φ′ B) of sliding friction. Where one of them falls to
zero the step is run again up to there; impacts are resolved while a closed contact is approached,
then complementarity of accelerations decides how all go on (`mbody.kernels.advance`).
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterable
from dataclasses import replace

import numpy as np

from mbody.analysis.contact.friction_problem import arresting_impulses
from mbody.analysis.contact.unilateral import SLIP_SIGNS, Rows, Unilateral
from mbody.analysis.dynamics.contact_start import fit_contacts, refuse_overlap
from mbody.analysis.dynamics.event_programs import watched_by_program
from mbody.analysis.dynamics.events import (
    OF_A_STEP,
    OF_ALL,
    Guard,
    JumpIntegration,
    LocatedZero,
    StepStart,
    extrema,
)
from mbody.analysis.dynamics.integration import AT_ONCE
from mbody.analysis.dynamics.integrators import Motion
from mbody.analysis.dynamics.modal_motion import (
    MODES,
    DecisionMemory,
    ModalMotion,
    refined_where_uneven,
)
from mbody.analysis.dynamics.restart import GUARDS, set_active_set
from mbody.analysis.dynamics.shared_friction import InstantModes, Reported, reported_instant
from mbody.analysis.position.assembly_analysis import raise_user_error
from mbody.core import tolerances as tol
from mbody.errors import SolveError
from mbody.kernels.advance import (
    CHANGES_WITHOUT_END,
    COLLISION,
    DECIDED,
    FOUND,
    IMPACT,
    IMPACTS_WITHOUT_END,
    JUMPED,
    LOST,
    MEMORY,
    NO_COLLISION,
    NO_IMPACT,
    NO_MODES,
    PASSED,
    POLE,
    SETTLING,
    STARTING,
    STEPPING,
    STRIKES,
    TRIED_COLLISION,
    UNBROKEN,
    UnilateralMotion,
    advance_motion,
)
from mbody.kernels.contact_guards import (
    KEPT_LOOKS,
    PARADOX,
    Guards,
    find_guards,
    guard_history,
    present_guards,
)
from mbody.kernels.contact_impacts import RESTED
from mbody.kernels.contact_modes import MASSLESS, OPEN, SEVERAL
from mbody.kernels.force_programs import BENT, FORCES, LINES, open_forces_memory
from mbody.kernels.friction import DETERMINANT, FRICTION_KINDS
from mbody.kernels.held_forces import held_force_table
from mbody.kernels.loop_closure import laws_of_time
from mbody.kernels.mode_problem import TRIED
from mbody.kernels.step_state import (
    CROSSED,
    DELIVERED,
    DONE,
    MORE,
    NEXT,
    NOT_FINITE,
    NOT_QUIET,
    STEP_VANISHED,
    TIME,
    TRIED_END,
    ZERO,
    Outputs,
)
from mbody.kernels.watched_events import APART, WatchedEvents
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


def blank_guards(motion: ModalMotion, events: WatchedEvents) -> Guards:
    """Memory for the guards of a motion, and its events."""
    points, owners = len(motion.uni.contact_points), len(motion.uni.every_body)
    looks = ("value", "rate", "gap", "past", "past_rate")
    most = 3 * points + owners + 2 + len(events.direction)
    return Guards(
        count=np.zeros(1, dtype=np.int64),
        kind=np.zeros(most, dtype=np.int64),
        owner=np.zeros(most, dtype=np.int64),
        **{name: np.zeros((KEPT_LOOKS, most)) for name in looks},
        fresh=np.zeros(most),
        slow=tol.RATE_NONE_FRICTION * motion.speeds,
        ends=np.zeros((points, 2)),
        end_rates=np.zeros((points, 2)),
        arm=np.zeros(7),
        stage=np.zeros(len(motion.y)),
        known=np.zeros(1, dtype=np.int64),
        passed=np.zeros(1, dtype=np.int64),
        part=np.zeros(2),
        event_value=np.zeros(len(events.direction)),
        event_rate=np.zeros(len(events.direction)),
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
        held=held_force_table(
            np.column_stack(motion.system.row_table[:2]),
            points,
            owners - points,
            len(motion.layout.friction_kind),
            len(motion.y),
        ),
        **dict(zip(("open", "program"), open_forces_memory(0, 0, 0, 0), strict=True)),
        events=events,
    )


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
        self.uni = Unilateral(system)
        super().__init__(system, start, settings, events)
        self.probe = self.work.copied()
        self.stops = [one.name for one in system.mechanism.contacts]
        self.lost = np.zeros(len(self.stops))
        self.work_names = causes(system)
        #: Where the work of stops that move is accounted.
        self.moving = {
            one.removesuffix(".moving"): self.work_names.index(one)
            for one in works_of_moving(system)
        }
        self.memory = DecisionMemory(self.uni)
        every = self.events, self.measures, self.carried.tolist()
        self.guard_table = blank_guards(self, watched_by_program(system, *every))
        #: What comes next, what is counted at one instant, and when modes changed last.
        self.stage, self.counts = np.zeros(1, dtype=np.int64), np.zeros(4, dtype=np.int64)
        #: Who is told what came next, and what has come of it: see `mbody.kernels.advance`.
        self.told: Callable[[int, int], None] | None = None
        self.changed = np.array([-np.inf])
        #: The least value of them where the derivative was just evaluated, else not a number.
        self.least_guard = np.inf
        #: Whether loads follow laws of time, of which the length of steps says nothing.
        self.swings = self.layout.varying > 0 or system.has_user_code
        #: When det(I − φ′ B) of what slides would vanish, as the last step has it.
        self.pole = np.inf
        #: Whether rates of drivers have jumped.
        self.jerked = False
        self.kept_modes: list[dict[str, str]] = []
        #: All admissible forces of the kept instants, where they are not determined.
        self.kept_forces: list[ForceSet | None] = []
        #: Modes before those that are being decided; modes whose forces are determined.
        self.before: InstantModes | None = None
        self.determined = b""
        self.last_shown: tuple[bytes, Reported] | None = None
        self.contact_notes: list[str] = []
        #: The state before the step that ends in time, and that which it went on from.
        self.before_end: Restart | None = None
        self.resumed: ModalState | None = None
        #: The record with which a step begins, as it is kept for who goes on from there.
        self.initial_states = np.empty((0, 1))

    def _motion(self) -> Motion:
        #: What the kernels work on: by which rows are on, and at present.
        self.motions: dict[bytes, tuple[Motion, UnilateralMotion]] = {}
        self.present: UnilateralMotion | None = None
        self.uni.regularization = self.regularization
        return refined_where_uneven(super()._motion(), self.uni)

    # -- modes, as the kernels have them -------------------------------------------------------

    @property
    def modes(self) -> list[str]:
        """Modes of the contact points."""
        return [MODES[one] for one in self.memory.modes.mode[: len(self.uni.contact_points)]]

    @property
    def pairs(self) -> list[str]:
        """Modes of the frictional joints."""
        return [MODES[one] for one in self.memory.modes.mode[len(self.uni.contact_points) :]]

    @property
    def groups(self) -> dict[int, list[int]]:
        """Contact points that stick by the row of one of them, by its number."""
        found: dict[int, list[int]] = {}
        for k, leader in enumerate(
            self.memory.modes.leader[: len(self.uni.contact_points)].tolist()
        ):
            if leader >= 0:
                found.setdefault(leader, []).append(k)
        return found

    @property
    def on(self) -> Array:
        """Which rows are on."""
        return self.work.on[: len(self.uni), 0].copy()

    @property
    def guards(self) -> list[Guard]:
        """What is watched."""
        G = self.guard_table
        numbers = zip(G.kind[: G.count[0]].tolist(), G.owner.tolist(), strict=False)
        return [Guard(GUARDS[kind], owner) for kind, owner in numbers]

    @property
    def fresh(self) -> dict[Guard, float]:
        """What is rounding of guards that began at zero."""
        found = zip(self.guards, self.guard_table.fresh.tolist(), strict=False)
        return {guard: least for guard, least in found if least > 0.0}

    def guards_again(self, fresh: Array) -> None:
        """Guards of modes that were set, with what is rounding of them."""
        G = self.guard_table
        G.slow[:] = tol.RATE_NONE_FRICTION * self.speeds
        if not find_guards(self.layout, self.work, self.uni.table, self.memory.modes, G):
            self._make_room()
        G.fresh[: len(fresh)], self.stage[0] = fresh, STEPPING

    @property
    def watches(self) -> bool:
        """Whether the kernel watches steps: it knows no events that no program evaluates or that
        are of forces that are shared.
        """
        if self.sided:
            return False
        if not self.events:
            return True
        G = self.guard_table
        known = len(G.events.direction) == len(self.events)
        shared = G.open_normal.any() or G.open_tangent.any()
        return bool(known and not (shared and not self.carried.all()))

    def _make_room(self) -> None:
        """More memory for rows of the problem, or forces that no equation decides."""
        G, most = self.guard_table, self.memory.rows_needed
        if most > len(self.memory.problem[0].c):
            self.memory.grow(2 * most)
            self.motions.clear()
            self.present = None
        sizes = G.open.count[[FORCES, LINES, BENT]].tolist()
        have = len(G.open.force), len(G.open.line), len(G.open.bent)
        if any(size > there for size, there in zip(sizes, have, strict=True)):
            found = open_forces_memory(self.system.coordinates, *map(max, sizes, have))
            for name, bundle in zip(("open", "program"), found, strict=True):
                G.attach(name, bundle)

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
        key = " ".join((*modes.modes, *modes.pairs)).encode() + modes.on.tobytes()
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

    def eliminate_rows_that_are_on(self) -> UnilateralMotion:
        """Steps leave out the blocks of rows that are off: what the kernels work on then."""
        key = self.work.on.tobytes()
        if key not in self.motions:
            off, m = np.zeros(self.layout.nodes, dtype=bool), self.motion
            off[self.layout.primitive_node[self.layout.active_set]] = self.on == 0.0
            D, P = self.memory.ready(self, 0)
            m = replace(m, layout=without_nodes(self.layout, off))
            found = UnilateralMotion(
                whole=self.layout,
                layout=m.layout,
                work=self.work,
                method=self.steps.methods,
                stepping=self.stepping,
                tolerances=m.tolerances,
                unilateral=self.uni.table,
                guards=self.guard_table,
                modes=self.memory.modes,
                decision=D,
                problem=P,
                impact=self.memory.impact,
                stage=self.stage,
                count=self.counts,
                changed=self.changed,
            )
            self.motions[key] = m, found
        self.motion, self.present = self.motions[key]
        return self.present

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
            found[len(own) :] = self._guard_values(t, records)[chosen]
        return found

    def _guard_values(self, t: Array, records: Array) -> Array:
        """Values (guards, instants) by times and records (instants, rows, 1)."""
        G, probe = self.guard_table, self.probe
        found, flat = np.empty((len(G.kind), len(records))), np.ascontiguousarray(records[:, :, 0])
        probe.signal[:] = self.work.signal
        table = self.layout, probe, self.uni.table, G
        guard_history(*table, np.ascontiguousarray(t), flat, found)
        return found[: G.count[0]]

    def _sampled(self, times: Array, marks: Array, records: Array) -> tuple[Array, Array]:
        found, rising = super()._sampled(times, marks, records)
        first, G = len(self.events), self.guard_table
        least = G.fresh[: G.count[0], None]
        own, rates = found[first:], rising[first:]
        rounding = (np.abs(own) <= least) & (least > 0.0)
        own[:], rates[:] = np.where(rounding, least, own), np.where(rounding, 0.0, rates)
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
        if not self.has_pole:
            return np.inf
        k = len(self.events) + self.guards.index(Guard("paradox"))
        here, there = found[k, :2]
        rate = (there - here) / (times[1] - times[0])
        if rate >= 0.0:  # as where the contact does not press at the other one
            rate = rising[k, 0]
        until = -float(here / rate) if here > 0.0 > rate else np.inf
        self.pole = float(times[0]) + until
        return 0.5 * until

    @property
    def has_pole(self) -> bool:
        """Whether what slides may have forces that grow without bound."""
        G = self.guard_table
        return bool((G.kind[: G.count[0]] == PARADOX).any())

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
        rounding = self.guard_table.fresh[np.array(which, dtype=int) - len(self.events), None]
        shifted = (g == rounding) & (rounding > 0.0)
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
        M, G, struck = self.memory.modes, self.guard_table, self.memory.impact.struck
        shared = (np.flatnonzero(one).tolist() for one in (G.open_tangent, G.open_normal))
        return ModalState(
            modes=tuple(self.modes),
            pairs=tuple(self.pairs),
            on=tuple(self.on.tolist()),
            anchor=tuple(self.work.anchor[: len(self.on), 0].tolist()),
            phases=tuple(float(self.work.par[row, 0]) for row in self.uni.phase_rows),
            groups=tuple(map(tuple, self.groups.values())),
            shared=tuple(map(tuple, shared)),
            closed=tuple(np.flatnonzero(M.closed).tolist()),
            beyond=tuple(np.flatnonzero(M.beyond).tolist()),
            fresh=tuple((one.kind, one.number, least) for one, least in self.fresh.items()),
            struck=tuple((k, when) for k, when in enumerate(struck.tolist()) if when > -np.inf),
            page=tuple(self.initial_states[:, 0].tolist()),
            lost=tuple(self.lost.tolist()),
        )

    def _resume(self, restart: Restart) -> None:
        found = restart.modal
        assert found is not None
        M, G = self.memory.modes, self.guard_table
        self.memory.forget()
        M.mode[:] = [MODES.index(one) for one in (*found.modes, *found.pairs)]
        for group in found.groups:
            M.leader[list(group)] = group[0]
        M.closed[list(found.closed)] = M.beyond[list(found.beyond)] = 1
        for k, when in found.struck:
            self.memory.impact.struck[k] = when
        set_active_set(self.uni, self.work, found)
        self.eliminate_rows_that_are_on()
        for table, owners in zip((G.open_tangent, G.open_normal), found.shared, strict=False):
            table[list(owners)] = 1
        # the first instant, with what is on
        self.evaluate()
        super()._resume(restart)
        self.guards_again(np.zeros(0))
        fresh = {Guard(kind, number): least for kind, number, least in found.fresh}
        self.guards_again(np.array([fresh.get(one, 0.0) for one in self.guards]))
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
        refuse_overlap(self.uni, self.work)
        status = self._settle(STARTING, begins=True)
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

    def evaluate(self) -> bool:
        """With a look at the guards."""
        closes = super().evaluate()
        table = self.uni.table, self.guard_table
        self.least_guard = present_guards(self.motion.layout, self.work, *table)
        return closes

    def settle_jump(self) -> str:
        """Decide the modes anew where forces have jumped, as those of inputs do, beyond what the
        present modes allow; a status where the motion ends there.
        """
        if self.guard_table.known[0] and self.least_guard >= 0.0:
            return ""
        return self._settle(JUMPED)

    def _loosen(self) -> None:
        """A driver that jerks moves what touches by impacts, not by rows that hold."""
        self._switch_off()

    def _settle_jump(self) -> None:
        """Impacts of what the driver moves towards each other; what it moves apart opens."""
        self.load()
        M, count = self.memory.modes, len(self.uni.contact_points)
        apart = self.uni.approach(self.uni.read(self.work))
        apart = apart > tol.RATE_NONE_FRICTION * self.speeds[:count]
        M.closed[:] = (M.mode[:count] != OPEN) & ~apart
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
        if code != CROSSED or self._event_met.stop:
            self.record = self.initial_states = self.guard_table.page.copy()
        return code

    def _quietly(self, until: float, count: int, outputs: Outputs, locates: bool) -> int:
        G, self.least_guard = self.guard_table, np.nan
        G.asked[:] = until, count, self.swings, locates
        G.events.number[APART] = (self.until - self.first) / OF_ALL
        return self._next(outputs)

    def _next(self, outputs: Outputs) -> int:
        """What happens next: see `mbody.kernels.advance`; memory grows as needed."""
        found, stage = self.present or self.eliminate_rows_that_are_on(), int(self.stage[0])
        while (code := advance_motion(found, outputs)) == MEMORY:
            self._make_room()
            found = self.eliminate_rows_that_are_on()
        if self.told is not None:
            self.told(stage, code)
        return int(code)

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
            if code == CROSSED:
                return MORE, self._meet(self._event_met)
            if code == ZERO:
                return MORE, self._passed(self.guards[self.guard_table.passed[0]])
            code = MORE if code == DONE and self.target < self.until else code
        if code == NOT_QUIET:
            self.guard_table.known[0] = 0
            code, status = super()._step()
            self.guard_table.events.seen[:] = -1.0
        if status or not self.has_pole:
            return code, status
        found = abs(self.record[self.system.friction_rows.start + DETERMINANT, 0])
        vanished = code in (STEP_VANISHED, NOT_FINITE) and found < tol.FRICTION_SINGULAR
        # what steps leave of the velocities decides closer by whether the contact still presses
        if vanished or found < tol.FRICTION_POLE * self.settings.rtol:
            t = float(self.state[TIME])
            return MORE, self._paradox(self.pole if np.isfinite(self.pole) else t)
        return code, status

    @property
    def _event_met(self) -> Event:
        """The event that the kernel has located."""
        G = self.guard_table
        return self.events[int(G.passed[0] - G.count[0])]

    def _meet(self, event: Event) -> str:
        """An event that the kernel has located: its record, and a status where the motion ends."""
        page, tried = self.guard_table.page, self.guard_table.events.saved
        t, h = float(self.state[TRIED_END]), float(tried[NEXT])
        together = max(tol.EVENT_TOGETHER * h, tol.TIME_ROUNDING * abs(t))
        # what is zero but for rounding where the motion begins crosses nothing
        begins = t <= self.first + tol.EVENT_LOCATED * h
        if not (begins or self._is_known(event, t, together)):
            self._record(event, t, page.copy())
        return self._ended(f"'{event.of}' is zero") if event.stop else ""

    # -- changes of modes ---------------------------------------------------------------------

    def _passed(self, guard: Guard) -> str:
        """Go on from where a guard is zero."""
        G = self.guard_table
        if self.stage[0] != PASSED:
            self.stage[0], G.passed[0] = PASSED, self.guards.index(guard)
            G.page[:] = self.record
        return self._go_on()

    def _settle(self, stage: int = SETTLING, *, begins: bool = False) -> str:
        """Impacts while a closed contact is approached, then the modes that go on; a status where
        the motion ends.
        """
        self.stage[0] = stage
        self.counts[[STRIKES, TRIED_COLLISION]] = 0
        return self._go_on(begins=begins)

    def _go_on(self, *, begins: bool = False) -> str:
        """What happens at this instant, up to steps in modes that go on; a status where the motion
        ends.
        """
        self.before, first = self.modes_now, self.record
        G = self.guard_table
        while True:
            code, before = self._next(self._nothing), self.record
            raise_user_error(self.system)
            status = self._why_it_ends(code, first)
            if status:
                return status
            self.record = G.page.copy()
            if code == IMPACT:
                self._impact(before)
            elif code == COLLISION:
                self._collided(before)
            elif code == DECIDED:
                self.eliminate_rows_that_are_on()
                if self.counts[FOUND] == SEVERAL:
                    self._note_several(first)
            elif code == UNBROKEN:
                return ""
            else:
                self._begun()
                if not begins:
                    self._record_changes(first)
                return ""

    @functools.cached_property
    def _nothing(self) -> Outputs:
        """No instants to be kept."""
        records, work = np.empty((0, self.rows, 1)), np.zeros((1, self.causes))
        return Outputs(times=np.empty(0), pages=records, work=work)

    def _begun(self) -> None:
        """Steps begin in the modes that were decided."""
        self.least_guard = np.nan
        self.steps.jumped(self.motion)
        self._check_finite(self.K, float(self.state[TIME]))

    def _why_it_ends(self, code: int, record: Array) -> str:
        """The status of a motion that ends, by what has happened; `record`: before all of it."""
        G, M, t = self.guard_table, self.memory.modes, float(self.state[TIME])
        if code == POLE:
            return self._paradox(t)
        if code == CHANGES_WITHOUT_END:
            who = self._who(int(G.owner[G.passed[0]]))
            return self._ended(f"contacts and friction change their modes without end, last {who}")
        if code == IMPACTS_WITHOUT_END:
            who = self._who(int(self.memory.impact.first[0]))
            return self._ended(f"impacts at {who} do not end")
        touching = np.flatnonzero(M.touches).tolist()
        if code == NO_IMPACT:
            hit = np.flatnonzero(self.memory.impact.hit).tolist()
            refuse_driven_impact(self, hit)
            return self._wedged(touching, hit)
        if code == LOST:
            return self._ended(lost_by_masses(self.uni, touching))
        if code not in (NO_MODES, NO_COLLISION):
            return ""
        points, joints = self.uni.contact_points, self.uni.friction_joints
        names = dict.fromkeys(points[k].name for k in touching)
        if self.counts[TRIED_COLLISION] and code == NO_MODES:
            return self._ended(f"{self._none} at {self._quoted(names)}")
        name = next(iter(names), None) or joints[0].name
        self._record_contact("inconsistent", t, name, record, record)
        if code == NO_COLLISION:
            why = f"no accelerations and no impact are consistent at {self._quoted(names)}"
            return self._ended(why)
        friction = self._quoted(one.name for one in joints)
        return self._ended(f"{self._none} with the friction at {friction}")

    @property
    def _none(self) -> str:
        """What is said where no modes go on: of so many contacts not every set may be tried."""
        if self.memory.problem[0].count[TRIED]:
            return "no accelerations are consistent"
        return "no consistent accelerations were found"

    @staticmethod
    def _quoted(names: Iterable[str]) -> str:
        return ", ".join(f"'{name}'" for name in dict.fromkeys(names))

    def _who(self, owner: int) -> str:
        names = [one.name for one in self.uni.contact_points]
        names += [one.name for one in self.uni.friction_joints]
        return f"'{names[owner]}'"

    # -- impacts ------------------------------------------------------------------------------

    def _impact(self, record: Array) -> None:
        """Account for the impact that has happened; `record`: that before it."""
        I = self.memory.impact
        first = int(I.first[0])
        self._add_losses()
        kind = "rest" if self.counts[FOUND] == RESTED else "impact"
        t, name = float(self.state[TIME]), self.uni.contact_points[first].name
        self._record_contact(
            kind, t + float(I.rested[0]), name, record, self.record, self._impulses()
        )

    def _collided(self, record: Array) -> None:
        """Account for an impact without collision; `record`: that before it."""
        t, M = float(self.state[TIME]), self.memory.modes
        names = [self.uni.contact_points[k].name for k in np.flatnonzero(M.touches)]
        self._record_contact("inconsistent", t, names[0], record, record)
        self._add_losses()
        self._record_contact("impact", t, names[0], record, self.record, self._impulses())
        self.contact_notes.append(
            f"at t = {t:.6g} {self.system.mechanism.units.time} {self._none} with the friction at "
            f"{self._quoted(names)} (Painlevé's paradox): an impact without collision followed"
        )

    def _wedged(self, closed: list[int], hit: list[int]) -> str:
        """No velocities keep all that strikes apart: friction wedges what Newton's law throws back,
        or drivers lead it from two sides.
        """
        quoted = self._quoted(self.uni.contact_points[k].name for k in hit)
        self.load()
        if self.memory.rests(self, closed):
            return self._ended(
                f"an impact at {quoted} has no solution: friction wedges what Newton's law of "
                'impact would throw back; Poisson\'s law (law = "poisson") or less friction has one'
            )
        return self._ended(
            f"an impact at {quoted} has no solution: what strikes is driven against both sides at "
            "once, as a pin that enters a slot without play; give it play, or begin within the slot"
        )

    def _add_losses(self) -> None:
        """Energy that an impact took of contacts; what stops that move, and drivers, gave."""
        I = self.memory.impact
        self._check_impact()
        for k in np.flatnonzero(self.memory.modes.touches).tolist():
            name = self.uni.contact_points[k].name
            self.lost[self.stops.index(name)] += I.gained[k]
            if name in self.moving:
                self.total[self.moving[name]] += I.moved[k]
        for one, given in zip(self.system.drivers, I.driven.tolist(), strict=True):
            self.total[self.work_names.index(one.name)] += given

    def _check_impact(self) -> None:
        """A doubt where an impact gives energy, or more or less than its impulses do."""
        I, n, t = self.memory.impact, self.system.coordinates, float(self.state[TIME])
        closed = np.flatnonzero(self.memory.modes.touches)
        velocities, taken_away = self.memory.modes.y[n : 2 * n], float(I.gained[closed].sum())
        gained, rounding = gain_of_jump(self.system.mass[:n, 0], velocities, I.jump)
        given = np.append(I.moved[closed], I.driven)
        exchanged, taken, terms = I.energy.tolist()
        exchanged += float(np.abs(given).sum())
        gained -= float(given.sum())
        none = rounding + tol.ENERGY_IMPACT * exchanged + tol.ENERGY_IMPACT_ARTIFICIAL * abs(taken)
        off = abs(gained + taken - taken_away) > none
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
                f"{taken_away:.3g} {energy}: do not rely on the motion from there on, and "
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

    def _note_several(self, record: Array) -> None:
        """Several accelerations are consistent: an event and a note."""
        t, M = float(self.state[TIME]), self.memory.modes
        which = np.flatnonzero(M.closed if M.closed.any() else M.touches)
        names = [self.uni.contact_points[k].name for k in which] or [
            p.name for p in self.uni.friction_joints
        ]
        quoted = self._quoted(names)
        self._record_contact("indeterminate", t, names[0] if names else "", record, record)
        why = "Painlevé's paradox): that of the least contact force was taken"
        redundant = "redundant" in self.modes or any(
            mode == "stick" and not self.work.on[pair.tangent, 0]
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
        self.uni.set_rows(self.work, np.zeros(len(self.uni)), slip_signs)

    # -- records -------------------------------------------------------------------------------

    def _impulses(self) -> dict[str, tuple[float, float]]:
        """Normal and tangential impulse of every contact that took part in an impact."""
        I, sums = self.memory.impact, dict[str, tuple[float, float]]()
        for k in np.flatnonzero(self.memory.modes.touches).tolist():
            before = sums.get(name := self.uni.contact_points[k].name, (0.0, 0.0))
            sums[name] = before[0] + float(I.normal[k]), before[1] + float(I.tangential[k])
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

    def _record_changes(self, record: Array) -> None:
        """Record mode changes of contacts that were closed before, and contacts that close without
        an impact; `record`: before these.
        """
        assert self.before is not None
        points = self.uni.contact_points
        free = {points[n].name for n in np.flatnonzero(self.uni.one_way)}
        t, now = float(self.state[TIME]), self.named_modes()
        for name, old in self.named_modes(self.before.modes, self.before.pairs).items():
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


# -- Refusals ----------------------------------------------------------------------------------


def ratio_of_masses(uni: Unilateral, closed: list[int]) -> float:
    """The greatest ratio of masses that are joined to what touches at some contact points."""
    bodies = {int(b) for k in closed for b in uni.bodies[k] if b < uni.layout.bodies}
    return float(uni.unevenness[sorted(bodies)].max(initial=0.0))


def lost_by_masses(uni: Unilateral, closed: list[int]) -> str:
    """Why rounding decides what goes on at closed contact points; empty where it does not."""
    ratio = ratio_of_masses(uni, closed)
    if ratio <= tol.MASSES_LOST:
        return ""
    names = listed(list(dict.fromkeys(uni.contact_points[k].name for k in closed)))
    return (
        f"the accelerations at {names} are lost in rounding: masses that touch differ by a factor "
        f"of {ratio:.2g}, more than numbers carry; take masses that differ by less than "
        f"{tol.MASSES_LOST:.0e}"
    )


def refuse_driven_impact(motion: ModalMotion, hit: list[int]) -> None:
    """Refuse an impact of what drivers lead, that has just been found to have no solution."""
    D, place = motion.memory.problem[0].delassus, motion.memory.modes.place
    for number in hit:
        if not D[place[number], place[number]] > 0.0:
            name = motion.uni.contact_points[number].name
            raise SolveError(
                f"nothing that strikes '{name}' is free to rebound: it follows drivers alone; take "
                "them off, or record when it is reached by an Event",
                name,
            )
