"""Modes of a motion: what is open, sticks and slides, what is watched, and how kernels take it.

Between two changes every row of the active set keeps its state: what sticks and what is closed
is a constraint, what slides has friction from its real force. Guards are positive as long as that
holds: the gap of an open contact, the force of a closed one, the reserve of friction of one that
sticks, the rate of one that slides, det(I − φ′ B) of sliding friction. Where one of them falls to
zero the step is made up to there; impacts are resolved while a closed contact is approached,
then complementarity of accelerations decides how all go on (`mbody.kernels.advance`).
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from typing import Any, cast

import numpy as np

from mbody.analysis.contact.contact_tables import (
    arresting_impulses,
    layout_of_rows,
    without_nodes,
    work_of_rows,
)
from mbody.analysis.contact.unilateral import SLIP_SIGNS, Rows, unilateral_of
from mbody.analysis.dynamics.contact_log import ContactLog, fit_contacts, refuse_overlap
from mbody.analysis.dynamics.integrators import MODES, DecisionMemory, Motion
from mbody.analysis.dynamics.interruptions import (
    PythonEvents,
    has_exact_rates,
    solution_of_records,
    watched_by_program,
)
from mbody.analysis.dynamics.restart import GUARDS, ContactModes, is_known, set_active_set
from mbody.analysis.initial.initial_state import event_measure
from mbody.analysis.position.assembly_analysis import raise_user_error
from mbody.core import tolerances as tol
from mbody.kernels.advance import (
    CHANGED,
    COLLISION,
    DECIDED,
    FOUND,
    IMPACT,
    JUMPED,
    MEMORY,
    SETTLING,
    STARTING,
    STEPPING,
    STRIKES,
    TRIED_COLLISION,
    UNBROKEN,
    UnilateralMotion,
    advance_motion,
)
from mbody.kernels.contact_guards import KEPT_LOOKS, Guards, find_guards, present_guards
from mbody.kernels.contact_modes import MASSLESS, OPEN, SEVERAL
from mbody.kernels.force_programs import BENT, FORCES, LINES, open_forces_memory
from mbody.kernels.held_forces import held_force_table
from mbody.kernels.layout import Layout, Work
from mbody.kernels.loop_closure import laws_of_time
from mbody.kernels.number_program import run
from mbody.kernels.step_state import CROSSED, NEXT, TIME, TRIED_END, Outputs
from mbody.kernels.watched_events import APART, WatchedEvents
from mbody.model.element import listed
from mbody.model.simulation import Event
from mbody.solution.histories import EventRecord
from mbody.solution.measures import measured
from mbody.solution.shared_forces import ForceSet
from mbody.solution.solution import ActiveSet, ModalState

Array = np.ndarray


def blank_guards(active: ActiveModes, events: WatchedEvents) -> Guards:
    """Memory for the guards of a motion, and its events."""
    motion = active.motion
    points, owners = len(active.uni.contact_points), len(active.uni.every_body)
    looks = ("value", "rate", "gap", "past", "past_rate")
    most = 3 * points + owners + 2 + len(events.direction)
    return Guards(
        count=np.zeros(1, dtype=np.int64),
        kind=np.zeros(most, dtype=np.int64),
        owner=np.zeros(most, dtype=np.int64),
        **{name: np.zeros((KEPT_LOOKS, most)) for name in looks},
        fresh=np.zeros(most),
        seen=np.full(most, -1.0),
        slow=tol.RATE_NONE_FRICTION * active.speeds,
        ends=np.zeros((points, 2)),
        end_rates=np.zeros((points, 2)),
        arm=np.zeros(7),
        stage=np.zeros(len(motion.y)),
        known=np.zeros(1, dtype=np.int64),
        passed=np.zeros(1, dtype=np.int64),
        part=np.full(4, np.inf),
        event_value=np.zeros(len(events.direction)),
        event_rate=np.zeros(len(events.direction)),
        asked=np.zeros(4),
        page=np.zeros((motion.system.record_rows, 1)),
        sense=np.zeros(most),
        size=np.zeros(most),
        body_part=np.array(active.uni.parts, dtype=np.int64),
        length=np.array(motion.system.lengths, dtype=float),
        force_arm=active.uni.arms,
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


class ActiveModes:
    """The modes of one motion, and its events.

    `uni`: Its contact points and frictional joints.
    `memory`: What the kernels need that decide its modes.
    `guard_table`: What is watched.
    `log`: What happens at contacts and frictional joints.
    """

    #: Modes and admissible forces of the first instant; forces of the present one.
    first_modes: dict[str, str]
    first_forces: ForceSet | None = None
    present_forces: ForceSet | None = None

    def __init__(self, motion: Any, events: Sequence[Event], jumps: Sequence[int]) -> None:
        self.motion, self.system = motion, motion.system
        self.uni = unilateral_of(self.system)
        self.events = list(events)
        self.measures = [event_measure(self.system.mechanism, event) for event in self.events]
        #: Arguments of formulas that jump, by their places.
        self.jumps = tuple(jumps)
        self.carried = np.array([has_exact_rates(one) for one in self.measures], dtype=bool)
        self.probe = motion.work.copied()
        self.memory = DecisionMemory(self.uni)
        every = self.events, self.measures, self.carried, self.jumps
        self.by_python = PythonEvents(self, every)
        self.by_program = watched_by_program(self.system, every) or self.by_python.watched
        #: What the kernels work on, by which rows are on, and at present.
        self.motions: dict[bytes, tuple[Motion, UnilateralMotion]] = {}
        self.present: UnilateralMotion | None = None
        self.guard_table = blank_guards(self, self.by_program)
        #: What is counted at one instant, and when modes changed last.
        self.counts, self.changed = np.zeros(4, dtype=np.int64), np.array([-np.inf])
        #: What comes next: see `mbody.kernels.advance`.
        self.stage = np.zeros(1, dtype=np.int64)
        #: Called with the stage and the code of each call of the kernel.
        self.listener: Callable[[int, int], None] | None = None
        #: Which argument of formulas that jump is zero when.
        self.crossings: list[tuple[float, int]] = []
        #: The record with which a step begins, as it is kept for who goes on from there.
        self.initial_states = np.empty((0, 1))
        #: The least value of guards where the derivative was just evaluated, else not a number.
        self.least_guard = np.inf
        self.log = ContactLog(motion, self)

    @property
    def layout(self) -> Layout:
        """Layout with the rows of all that may act."""
        return cast(Layout, self.motion.layout)

    @property
    def work(self) -> Work:
        """Its workspace."""
        return cast(Work, self.motion.work)

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
    def on(self) -> Array:
        """Which rows are on."""
        return self.work.on[: len(self.uni), 0].copy()

    @property
    def guards(self) -> list[tuple[str, int]]:
        """What is watched: functions that stay positive as long as a mode of a contact holds, each
        with the number of what it guards.
        """
        G = self.guard_table
        numbers = zip(G.kind[: G.count[0]].tolist(), G.owner.tolist(), strict=False)
        return [(GUARDS[kind], owner) for kind, owner in numbers]

    def guards_again(self, fresh: Array) -> None:
        """Guards of modes that were set, with what is rounding of them."""
        G = self.guard_table
        G.slow[:] = tol.RATE_NONE_FRICTION * self.speeds
        if not find_guards(self.layout, self.work, self.uni.table, self.memory.modes, G):
            self.make_room()
        G.fresh[: len(fresh)], self.stage[0] = fresh, STEPPING

    def make_room(self) -> None:
        """More memory for rows of the problem, or forces that no equation decides."""
        G, most = self.guard_table, self.memory.rows_needed
        if most > len(self.memory.problem[0].c):
            self.memory.grow(2 * most)
            self.forget_motions()
        sizes = G.open.count[[FORCES, LINES, BENT]].tolist()
        have = len(G.open.force), len(G.open.line), len(G.open.bent)
        if any(size > there for size, there in zip(sizes, have, strict=True)):
            found = open_forces_memory(self.system.coordinates, *map(max, sizes, have))
            for name, bundle in zip(("open", "program"), found, strict=True):
                G.attach(name, bundle)

    def forget_motions(self) -> None:
        """What the kernels work on is to be made anew."""
        self.motions.clear()
        self.present = None

    def load(self) -> None:
        """The present state into the workspace."""
        n, y = self.system.coordinates, self.motion.y
        self.work.q[:n, 0], self.work.v[:n, 0] = y[:n], y[n : 2 * n]
        self.work.time[0, 0] = self.motion.state[TIME]

    @property
    def speeds(self) -> Array:
        """Velocity scales: the fastest motion of both bodies, in model lengths a time."""
        n = self.system.coordinates
        own = (self.motion.scale[n : 2 * n] / self.motion.scale[:n]).reshape(-1, 3).max(axis=1)
        return np.asarray(self.system.length * self.uni.greatest_of(own))

    def eliminate_rows_that_are_on(self) -> UnilateralMotion:
        """Steps leave out the blocks of rows that are off: what the kernels work on then."""
        pairs = len(self.layout.friction_kind)
        on, sliding = self.on != 0.0, self.work.slip_sign[:pairs, 0] != 0.0
        key = on.tobytes() + sliding.tobytes()
        if key not in self.motions:
            m = self._rows_that_are_on(on, sliding)
            D, P = self.memory.ready(self.motion, 0)
            found = UnilateralMotion(
                whole=self.layout,
                layout=m.layout,
                work=self.work,
                reduced=m.work,
                joints=self.joints[0],
                joint_work=self.joints[1],
                method=self.motion.steps.methods,
                stepping=self.motion.stepping,
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
        self.motion.motion, self.present = self.motions[key]
        return self.present

    def _rows_that_are_on(self, on: Array, sliding: Array) -> Motion:
        """What steps work on with these rows, and friction pairs that slide."""
        L, m = self.layout, self.motion.motion
        if not self.motion.steps.fixed and (found := self._without_rows(on, sliding)) is not None:
            return replace(m, layout=found[0], work=found[1])
        off = np.zeros(L.nodes, dtype=bool)
        off[L.primitive_node[L.active_set]] = ~on
        return replace(m, layout=without_nodes(L, off), work=self.work)

    @functools.cached_property
    def joints(self) -> tuple[Layout, Work]:
        """What impacts and forces of contact are found by: the rows of joints."""
        none = (np.zeros(count, dtype=bool) for count in (len(self.uni), len(self.uni.of_contacts)))
        return self._without_rows(*none) or (self.layout, self.work)

    def _without_rows(self, on: Array, sliding: Array) -> tuple[Layout, Work] | None:
        """Layout and workspace without rows of contacts that are off. Bodies that are split for the
        rows of all that may act are not for those that act: None where none are.
        """
        L, off = self.layout, np.zeros(len(self.layout.primitive_node), dtype=bool)
        off[L.active_set] = ~on
        off[L.active_set[L.friction_tangent[sliding | ~self.uni.of_contacts]]] = False
        alike = not (len(L.more) or len(L.part) or len(L.formula_step))
        if not (alike and L.slots > L.bodies and off.any()):
            return None
        layout = layout_of_rows(L, off)
        return layout, work_of_rows(self.system, layout, self.work, off)

    # -- events -------------------------------------------------------------------------------

    def values_at(self, t: float, record: Array) -> Array:
        """Values (events,) by a record (rows, 1), its forces admissible."""
        shown, E = self.log.shown(t, record).record, self.by_program
        if E is not self.by_python.watched:
            slots, count = E.program.slots, len(E.row)
            slots[:count], slots[count : count + int(E.timed[0])] = shown[E.row], t
            run(E.program)
            return np.asarray(slots[E.program.targets])
        found = solution_of_records(self.system, np.array([t]), shown[None, :, None])
        return np.array([measured(found, measure)[0][0] for measure in self.measures])

    def choose_events(self) -> None:
        """Python finds events that are of forces that no equation decides, as they are reported."""
        G = self.guard_table
        shared = bool(G.open_normal.any() or G.open_tangent.any()) and not self.carried.all()
        found = self.by_python.watched if shared else self.by_program
        if found is not G.events:
            found.saved[:], found.number[:] = G.events.saved, G.events.number
            G.attach("events", found)
            G.known[0] = min(G.known[0], 1)

    def look_at(self, t: float, record: Array) -> Rows:
        """The rows at a time and record (rows, 1), of which the probe has the position."""
        n, probe = self.system.coordinates, self.probe
        probe.signal[:] = self.work.signal
        probe.q[:n, 0], probe.v[:n, 0], probe.time[0, 0] = record[:n, 0], record[n : 2 * n, 0], t
        laws_of_time(self.layout, probe)
        return self.uni.read(probe)

    @property
    def stops(self) -> bool:
        """Whether the motion ends at the event that the kernel has located."""
        G = self.guard_table
        return bool(G.events.stops[G.passed[0] - G.count[0]])

    def greatest_arguments(self) -> dict[int, float]:
        """The greatest values of arguments of formulas that jump, by their places."""
        every = [self.by_program, *([self.by_python.watched] if self.events else [])]
        first = len(self.events)
        each = [
            max(one.greatest[n] for one in every) for n in range(first, first + len(self.jumps))
        ]
        return dict(zip(self.jumps, map(float, each), strict=True))

    def meet(self) -> str:
        """An event that the kernel has located: its record, and a status where the motion ends."""
        G, motion = self.guard_table, self.motion
        number, t = int(G.passed[0] - G.count[0]), float(motion.state[TRIED_END])
        h = float(G.events.saved[NEXT])
        together = max(tol.EVENT_TOGETHER * h, tol.TIME_ROUNDING * abs(t))
        # what is zero but for rounding where the motion begins crosses nothing
        begins = t <= motion.first + tol.EVENT_LOCATED * h
        if number >= len(self.events):
            if not begins:
                self.crossings.append((t, self.jumps[number - len(self.events)]))
            return ""
        event = self.events[number]
        if not (begins or is_known(motion.occurred, event, t, together)):
            at = self.log.instant(t, G.page.copy())
            motion.occurred.append(EventRecord(event.name, t, at))
        return str(motion.ended(f"'{event.of}' is zero")) if event.stop else ""

    # -- steps, and changes of modes ----------------------------------------------------------

    @property
    def beyond(self) -> bool:
        """Whether forces of other inputs are beyond the present modes: no step was tried."""
        return bool(self.stage[0] == CHANGED)

    def next(self, outputs: Outputs) -> int:
        """What happens next: see `mbody.kernels.advance`; memory grows as needed."""
        found, stage = self.present or self.eliminate_rows_that_are_on(), int(self.stage[0])
        while (code := advance_motion(found, outputs)) == MEMORY:
            self.make_room()
            found = self.eliminate_rows_that_are_on()
        if self.listener is not None:
            self.listener(stage, code)
        return int(code)

    def steps(
        self, until: float, count: int, outputs: Outputs, locates: bool, changed: bool
    ) -> int:
        """At most so many steps towards a time; `changed`: whether inputs are others than those of
        the present derivative. A code of the kernel.
        """
        G, self.least_guard, motion = self.guard_table, np.nan, self.motion
        if self.events:
            self.choose_events()
        if changed:
            self.stage[0] = CHANGED
        G.asked[:] = until, count, motion.swings, locates
        G.events.number[APART] = motion.apart
        if locates:
            self.initial_states = motion.record
        code = self.next(outputs)
        if G.events.handle[0] < 0:
            self.by_python.raise_failure()
        if locates and (code != CROSSED or self.stops):
            motion.record = self.initial_states = G.page.copy()
        return code

    def begin(self) -> str:
        """Decide the first modes, refusing what overlaps; a status where the motion ends there."""
        motion = self.motion
        if not motion.has_modes:
            self.guards_again(np.zeros(0))
            return ""
        self.load()
        if (fitted := fit_contacts(self.uni, self.work)) is not None:
            self.log.notes += [fitted] if fitted else []
            motion.y[: self.system.coordinates] = self.work.q[: self.system.coordinates, 0]
            motion.evaluate()
            self.load()
        refuse_overlap(self.uni, self.work)
        status = self.settle(STARTING, begins=True)
        return status or (self.settle(begins=True) if self.rolls_at_once() else "")

    def settle(self, stage: int = SETTLING, *, begins: bool = False) -> str:
        """Impacts while a closed contact is approached, then the modes that go on; a status where
        the motion ends.
        """
        self.stage[0] = stage
        self.counts[[STRIKES, TRIED_COLLISION]] = 0
        return self.go_on(begins=begins)

    def go_on(self, *, begins: bool = False) -> str:
        """What happens at this instant, up to steps in modes that go on; a status where the motion
        ends.
        """
        log, motion, first = self.log, self.motion, self.motion.record
        log.before = log.modes_now
        while True:
            code, before = self.next(motion.nothing), motion.record
            raise_user_error(self.system)
            if why := log.why_it_ends(code, first):
                return str(motion.ended(why))
            motion.record = self.guard_table.page.copy()
            if code == IMPACT:
                log.impact(before)
            elif code == COLLISION:
                log.collision(before)
            elif code == DECIDED:
                self.eliminate_rows_that_are_on()
                if self.counts[FOUND] == SEVERAL:
                    log.several(before)
            elif code == UNBROKEN:
                return ""
            else:
                self.begun()
                if not begins:
                    log.changes(first)
                return ""

    def begun(self) -> None:
        """Steps begin in the modes that were decided."""
        self.least_guard = np.nan
        self.motion.check_finite(float(self.motion.state[TIME]))
        self.log.check_modes()

    def settle_jump(self) -> str:
        """Decide the modes anew where forces have jumped, as those of inputs do, beyond what the
        present modes allow; a status where the motion ends there.
        """
        allowed = self.guard_table.known[0] and self.least_guard >= 0.0
        return "" if allowed or not self.motion.has_modes else self.settle(JUMPED)

    def look(self) -> None:
        """Look at the guards where the derivative was just evaluated."""
        G, m = self.guard_table, self.motion.motion
        G.known[0] = 0
        if self.motion.has_modes:
            self.least_guard = present_guards(m.layout, m.work, self.uni.table, G)

    def rolls_at_once(self) -> bool:
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
        stiff = self.memory.responses(self.motion, which, 1.0).delassus.diagonal()[:count].copy()
        soft = self.memory.responses(self.motion, which, MASSLESS)
        delassus, rates = soft.delassus[:count, :count], soft.before[:count]
        light = np.diag(delassus) > 2.0 * stiff
        light &= np.abs(rates) > tol.RATE_NONE_FRICTION * self.speeds[slides]
        if not light.any():
            self.motion.evaluate()
            return False
        stops = arresting_impulses(delassus[np.ix_(light, light)], rates[light])
        self.switch_off()
        self.motion.y[n : 2 * n] += stops @ soft.Y[:count][light]
        self.motion.evaluate()
        names = listed([points[k].name for k, some in zip(slides, light, strict=True) if some])
        self.log.notes.append(
            f"what slides at the beginning at {names} has no inertia to do so: it rolls at once"
        )
        return True

    def switch_off(self) -> None:
        """No contact acts, and no joint sticks: an impact moves what stuck, which then slips. What
        slides goes on to.
        """
        slip_signs = self.work.slip_sign[: len(self.layout.friction_kind), 0].copy()
        for point in self.uni.contact_points:
            if point.pair >= 0:
                slip_signs[point.pair] = 0.0
        self.uni.set_rows(self.work, np.zeros(len(self.uni)), slip_signs)
        self.eliminate_rows_that_are_on()

    def close_what_drivers_press(self) -> None:
        """Rates of drivers have jumped: what they do not move apart is closed."""
        self.load()
        M, count = self.memory.modes, len(self.uni.contact_points)
        apart = self.uni.approach(self.uni.read(self.work))
        apart = apart > tol.RATE_NONE_FRICTION * self.speeds[:count]
        M.closed[:] = (M.mode[:count] != OPEN) & ~apart
        self.log.jerked = True

    def fast_events(self) -> Iterator[str]:
        """Sentences on events that vary faster than they were looked at."""
        unit = self.system.mechanism.units.time
        for n, event in enumerate(self.events):
            apart = max(one.missed[n] for one in (self.by_program, self.by_python.watched))
            if apart > 0.0:
                yield (
                    f"event '{event.name}' varies faster than it was looked at, every {apart:.3g} "
                    f"{unit}: its crossings are found up to some {0.5 / apart:.3g} in 1 {unit}, "
                    "others may be missing; ask for a shorter motion, or for an event that varies "
                    "less"
                )

    # -- restarts and checkpoints --------------------------------------------------------------

    def forget(self) -> None:
        """Nothing touches, and no joint sticks."""
        G = self.guard_table
        self.memory.forget()
        G.open_normal[:] = G.open_tangent[:] = G.count[0] = 0
        self.log.lost[:], self.log.notes = 0.0, []
        self.changed[0], self.counts[:], self.stage[0] = -np.inf, 0, STEPPING
        self.work.anchor[:] = 0.0
        self.work.par[:] = self.probe.par
        none = np.zeros(len(self.uni)), np.zeros(len(self.layout.friction_kind))
        self.uni.set_rows(self.work, *none)
        self.eliminate_rows_that_are_on()

    def rows_of(self, work: Work) -> tuple[Array, ...]:
        """What modes set in a workspace."""
        return work.on, work.pad, work.regularization_weight, work.anchor, work.slip_sign, work.par

    def modal_state(self) -> ModalState:
        """The modes of a restart that ends at this instant."""
        M, G, struck = self.memory.modes, self.guard_table, self.memory.impact.struck
        shared = (np.flatnonzero(one).tolist() for one in (G.open_tangent, G.open_normal))
        fresh = dict(zip(self.guards, G.fresh.tolist(), strict=False))
        groups = dict[int, list[int]]()  # each begins with its leader
        for k, leader in enumerate(M.leader[: len(self.uni.contact_points)].tolist()):
            if leader >= 0:
                group = groups.setdefault(leader, [leader])
                if k != leader:
                    group.append(k)
        present = self.active_set()
        return ModalState(
            **vars(present),
            groups=tuple(map(tuple, groups.values())),
            shared=tuple(map(tuple, shared)),
            closed=tuple(np.flatnonzero(M.closed).tolist()),
            beyond=tuple(np.flatnonzero(M.beyond).tolist()),
            fresh=tuple((*one, least) for one, least in fresh.items() if least > 0.0),
            struck=tuple((k, when) for k, when in enumerate(struck.tolist()) if when > -np.inf),
            page=tuple(self.initial_states[:, 0].tolist()),
            lost=tuple(self.log.lost.tolist()),
            end=present,
        )

    def active_set(self) -> ActiveSet:
        """The present modes."""
        return ActiveSet(
            modes=tuple(self.modes),
            pairs=tuple(self.pairs),
            on=tuple(self.on.tolist()),
            anchor=tuple(self.work.anchor[: len(self.on), 0].tolist()),
            phases=tuple(float(self.work.par[row, 0]) for row in self.uni.phase_rows),
        )

    def set_modes(self, found: ActiveSet) -> None:
        """Set modes, with nothing else that a motion in them remembers."""
        self.memory.forget()
        self.memory.modes.mode[:] = [MODES.index(one) for one in (*found.modes, *found.pairs)]
        set_active_set(self.uni, self.work, found)
        self.eliminate_rows_that_are_on()

    def resume(self, found: ModalState) -> None:
        """Set the modes of a restart, but the guards."""
        M, G = self.memory.modes, self.guard_table
        self.set_modes(found)
        for group in found.groups:
            M.leader[list(group)] = group[0]
        M.closed[list(found.closed)] = M.beyond[list(found.beyond)] = 1
        for k, when in found.struck:
            self.memory.impact.struck[k] = when
        for table, owners in zip((G.open_tangent, G.open_normal), found.shared, strict=False):
            table[list(owners)] = 1

    def resume_guards(self, found: ModalState | None) -> None:
        """Guards of the modes of a restart, at its state."""
        self.guards_again(np.zeros(0))
        if found is None:
            return
        fresh = {(kind, number): least for kind, number, least in found.fresh}
        self.guards_again(np.array([fresh.get(one, 0.0) for one in self.guards]))

    def contact_modes(self) -> ContactModes:
        """The modes of a checkpoint."""
        return ContactModes(
            first=dict(self.first_modes),
            rows=tuple(part.copy() for part in self.rows_of(self.work)),
            tables=tuple(part.copy() for part in self.tables),
            notes=tuple(self.log.notes),
            lost=self.log.lost.copy(),
            forces=self.first_forces,
        )

    @property
    def tables(self) -> tuple[Array, ...]:
        """What a checkpoint has of modes and guards."""
        M, G, struck = self.memory.modes, self.guard_table, self.memory.impact.struck
        own = M.mode, M.leader, M.closed, M.beyond, struck, G.fresh, G.open_normal, G.open_tangent
        return *own, self.changed, self.counts

    def fits(self, given: ContactModes) -> bool:
        """Whether modes have the sizes of these."""
        mine = (*self.rows_of(self.work), *self.tables)
        return [one.shape for one in (*given.rows, *given.tables)] == [one.shape for one in mine]

    def take_modes(self, given: ContactModes) -> None:
        """Go on in the modes of a checkpoint."""
        self.first_modes, self.first_forces = dict(given.first), given.forces
        for part, was in zip(self.rows_of(self.work), given.rows, strict=True):
            part[:] = was
        for part, was in zip(self.tables, given.tables, strict=True):
            part[:] = was
        self.eliminate_rows_that_are_on()
        self.guards_again(self.guard_table.fresh)
        self.log.lost[:] = given.lost
        self.log.notes = list(given.notes)
