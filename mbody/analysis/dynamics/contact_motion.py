"""Motion with contacts, ropes and frictional joints: smooth steps between located changes of modes.

Between two changes every row of the active set keeps its state: what sticks and what is closed
is a constraint, what slides has friction from its real force. Guards are positive as long as that
holds: the gap of an open contact, the force of a closed one, the reserve of friction of one that
sticks, the rate of one that slides, det(I − φ′ B) of sliding friction. Where one of them falls to
zero the step is made up to there; impacts are resolved while a closed contact is approached,
then complementarity of accelerations decides how all go on (`mbody.kernels.advance`).
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace

import numpy as np

from mbody.analysis.contact.active_layout import layout_of_rows, without_nodes, work_of_rows
from mbody.analysis.contact.friction_problem import arresting_impulses
from mbody.analysis.contact.systems_with_modes import has_modes
from mbody.analysis.contact.unilateral import SLIP_SIGNS, Rows, unilateral_of
from mbody.analysis.driven.contact_report import one_sided, one_sided_force
from mbody.analysis.dynamics.contact_log import ContactLog
from mbody.analysis.dynamics.contact_start import fit_contacts, refuse_overlap
from mbody.analysis.dynamics.event_programs import PythonEvents, has_exact_rates, watched_by_program
from mbody.analysis.dynamics.integration import (
    AT_ONCE,
    Checkpoint,
    ContactModes,
    Integration,
    KeptInstants,
    solution_of_records,
)
from mbody.analysis.dynamics.integrators import Motion
from mbody.analysis.dynamics.modal_motion import (
    MODES,
    DecisionMemory,
    ModalMotion,
    refined_where_uneven,
)
from mbody.analysis.dynamics.restart import GUARDS, set_active_set
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
from mbody.kernels.contact_guards import (
    COUNT,
    KEPT_LOOKS,
    Guards,
    find_guards,
    present_guards,
)
from mbody.kernels.contact_modes import MASSLESS, OPEN, SEVERAL
from mbody.kernels.force_programs import BENT, FORCES, LINES, open_forces_memory
from mbody.kernels.held_forces import held_force_table
from mbody.kernels.layout import Layout, Work
from mbody.kernels.loop_closure import laws_of_time
from mbody.kernels.methods import Methods
from mbody.kernels.number_program import run
from mbody.kernels.step_state import (
    CROSSED,
    DELIVERED,
    DONE,
    LAST_STEP_ALLOWED,
    MORE,
    NEXT,
    NOT_QUIET,
    SINGULAR_AHEAD,
    STEPS,
    TIME,
    TRIED_END,
    ZERO,
    Outputs,
)
from mbody.kernels.watched_events import APART, WatchedEvents
from mbody.model.element import listed
from mbody.model.simulation import Event
from mbody.solution.doubts import doubted
from mbody.solution.histories import EventRecord, reported_certificate, with_fields
from mbody.solution.measures import measured
from mbody.solution.shared_forces import ForceSet, SharedResult, inadmissible
from mbody.solution.solution import IntegrationSettings, ModalState, Restart, Solution
from mbody.system.system import System

Array = np.ndarray
#: Looks at a step at which forces are met, at least; looks at events in the whole motion, at least.
OF_A_STEP, OF_ALL = 4, 400


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
        seen=np.full(most, -1.0),
        slow=tol.RATE_NONE_FRICTION * motion.speeds,
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


class EventIntegration(Integration):
    """A motion with events: zeros of users' measures are located, and what is open, sticks and
    slides at contacts and frictional joints is decided at each change.
    """

    decides_modes = True
    #: Modes and admissible forces of the first instant; forces of the present one.
    first_modes: dict[str, str]
    first_forces: ForceSet | None = None
    present_forces: ForceSet | None = None

    def __init__(
        self,
        system: System,
        start: Solution,
        settings: IntegrationSettings,
        events: tuple[Event, ...],
        jumps: Sequence[int] = (),
    ) -> None:
        self.uni = unilateral_of(system)
        #: Whether something may open, stick or slide.
        self.has_modes = has_modes(system)
        super().__init__(system, start, settings)
        self.events = list(events)
        self.measures = [event_measure(system.mechanism, event) for event in self.events]
        #: Arguments of formulas that jump, by their places, and when which of them is zero.
        self.jumps, self.crossings = tuple(jumps), list[tuple[float, int]]()
        self.carried = np.array([has_exact_rates(one) for one in self.measures], dtype=bool)
        self.sided = one_sided(system)
        self.probe = self.work.copied()
        self.memory = DecisionMemory(self.uni)
        every = self.events, self.measures, self.carried, self.jumps
        self.by_python = PythonEvents(self, every)
        self.by_program = watched_by_program(system, every) or self.by_python.watched
        self.guard_table = blank_guards(self, self.by_program)
        #: What comes next, what is counted at one instant, and when modes changed last.
        self.stage, self.counts = np.zeros(1, dtype=np.int64), np.zeros(4, dtype=np.int64)
        #: Called with the stage and the code of each call of `mbody.kernels.advance`.
        self.listener: Callable[[int, int], None] | None = None
        self.changed = np.array([-np.inf])
        #: The least value of guards where the derivative was just evaluated, else not a number.
        self.least_guard = np.inf
        #: Whether loads follow laws of time, of which the length of steps says nothing.
        self.swings = self.layout.varying > 0 or system.has_user_code
        #: How far apart events are looked at, at most: of a call of one step at its ends.
        self.apart = math.inf
        #: Work of every cause since the beginning.
        self.total = np.zeros(self.causes)
        self.log = ContactLog(self)
        self.stops = self.log.stops
        #: Instants that are wanted, and those that are kept: time, record, works, modes, forces.
        self.wanted = np.empty(0)
        self.kept: list[tuple[float, Array, Array, dict[str, str], ForceSet | None]] = []
        #: The status of a motion that ended where forces jumped.
        self.ending = ""
        #: The state before the step that ends in time, and that which it went on from.
        self.before_end: Restart | None = None
        self.resumed: ModalState | None = None
        #: The record with which a step begins, as it is kept for who goes on from there.
        self.initial_states = np.empty((0, 1))
        #: Whether `record` is of an earlier instant.
        self.late = False

    def _begin_steps(self) -> None:
        """What swings while nothing moves says nothing of how long steps are: they begin with those
        that show it.
        """
        super()._begin_steps()
        if self.has_modes and self.swings and not self.steps.fixed:
            longest = (self.until - self.first) / OF_ALL
            self.state[NEXT] = min(self.state[NEXT], longest)

    def _motion(self) -> Motion:
        #: What the kernels work on: by which rows are on, and at present.
        self.motions: dict[bytes, tuple[Motion, UnilateralMotion]] = {}
        self.present: UnilateralMotion | None = None
        motion = super()._motion()
        return refined_where_uneven(motion, self.uni) if self.has_modes else motion

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
            self._make_room()
        G.fresh[: len(fresh)], self.stage[0] = fresh, STEPPING

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
        pairs = len(self.layout.friction_kind)
        on, sliding = self.on != 0.0, self.work.slip_sign[:pairs, 0] != 0.0
        key = on.tobytes() + sliding.tobytes()
        if key not in self.motions:
            m = self._rows_that_are_on(on, sliding)
            D, P = self.memory.ready(self, 0)
            found = UnilateralMotion(
                whole=self.layout,
                layout=m.layout,
                work=self.work,
                reduced=m.work,
                joints=self.joints[0],
                joint_work=self.joints[1],
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

    def _rows_that_are_on(self, on: Array, sliding: Array) -> Motion:
        """What steps work on with these rows, and friction pairs that slide."""
        L, m = self.layout, self.motion
        if not self.steps.fixed and (found := self._without_rows(on, sliding)) is not None:
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

    # -- values of events ---------------------------------------------------------------------

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

    def _choose_events(self) -> None:
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

    # -- the motion ---------------------------------------------------------------------------

    def _integrate(self, times: Array, progress: Callable[[float], None] | None) -> tuple[int, str]:
        self.wanted, self.kept = times, []
        self.apart = (self.until - self.first) / OF_ALL
        if self.resumed is None and (status := self.begin_modes()):
            return MORE, status
        if times[0] <= self.first:
            self.keep(self.first, self.record, self.total)
        self.total += self.initial_work
        if self.resumed is not None:
            self.log.lost[:] = self.resumed.lost
            self.record = np.array(self.resumed.page)[:, None]
        code, status = self._all_steps(progress)
        return code, status or "completed"

    def _all_steps(self, progress: Callable[[float], None] | None = None) -> tuple[int, str]:
        code, status = MORE, ""
        while code == MORE and not status:
            code, status = self._step()
            self._check_progress()
            if progress is not None:
                progress(float(self.state[TIME]))
        return (MORE if status else code), status

    def begin_modes(self) -> str:
        """Decide the first modes, refusing what overlaps; a status where the motion ends there."""
        if not self.has_modes:
            self.guards_again(np.zeros(0))
            self.steps.jumped(self.motion)
            return ""
        self.load()
        if (fitted := fit_contacts(self.uni, self.work)) is not None:
            self.log.notes += [fitted] if fitted else []
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
        self.log.notes.append(
            f"what slides at the beginning at {names} has no inertia to do so: it rolls at once"
        )
        return True

    def evaluate(self) -> bool:
        """With a look at the guards."""
        closes = super().evaluate()
        self.guard_table.known[0] = 0
        if self.has_modes:
            table = self.uni.table, self.guard_table
            self.least_guard = present_guards(self.motion.layout, self.motion.work, *table)
        return closes

    def _take_steps(self, until: float, count: int, outputs: Outputs) -> int:
        """At most so many steps towards a time, and the record of where they end."""
        self.initial_states = self.record
        code = self._quietly(until, count, outputs, True)
        if code != CROSSED or self._stops:
            self.record = self.initial_states = self.guard_table.page.copy()
        return code

    def _quietly(self, until: float, count: int, outputs: Outputs, locates: bool) -> int:
        G, self.least_guard = self.guard_table, np.nan
        if self.events:
            self._choose_events()
        G.asked[:] = until, count, self.swings, locates
        G.events.number[APART] = self.apart
        code = self._next(outputs)
        if code == SINGULAR_AHEAD:
            code = self.steps.explicitly(self.motion, functools.partial(self._explicit, outputs))
        if G.events.handle[0] < 0:
            self.by_python.raise_failure()
        return code

    def _explicit(self, outputs: Outputs, motion: Motion, method: Methods) -> int:
        """One explicit step near a singular position, which other methods do not pass."""
        self.guard_table.asked[COUNT] = 1
        found = self.eliminate_rows_that_are_on()
        return int(advance_motion(found.replaced(method=method, stepping=motion.stepping), outputs))

    def _next(self, outputs: Outputs) -> int:
        """What happens next: see `mbody.kernels.advance`; memory grows as needed."""
        found, stage = self.present or self.eliminate_rows_that_are_on(), int(self.stage[0])
        while (code := advance_motion(found, outputs)) == MEMORY:
            self._make_room()
            found = self.eliminate_rows_that_are_on()
        if self.listener is not None:
            self.listener(stage, code)
        return int(code)

    def _quiet_steps(self) -> int:
        """Steps towards the next set time as long as they are quiet, keeping the instants that they
        meet: a code of the kernel. Of what holds in one direction only the forces are met within
        each step.
        """
        t, h, count = float(self.state[TIME]), float(self.state[NEXT]), AT_ONCE
        first, last = np.searchsorted(self.wanted, [t, self.target], side="right")
        marks = wanted = self.wanted[first:last]
        if self.sided:
            count, parts = 1, OF_A_STEP
            if self.events or not self.has_modes:
                parts = max(parts, math.ceil(h / self.apart))
            within = t + np.arange(1, parts + 1) / parts * h
            marks = np.union1d(wanted, within[within < self.target])
        records, work = self._nothing.pages, np.zeros((len(marks) + 1, self.causes))
        if len(marks):
            records = np.empty((len(marks), self.rows, 1))
        work[-1], self.state[DELIVERED] = self.total, 0.0
        self.total = work[-1]  # also of steps before Python fails
        outputs = Outputs(times=marks, pages=records, work=work)
        code = self._advance(self.target, count, outputs)
        self.total = work[-1].copy()
        met = int(self.state[DELIVERED])
        self.meet_forces(marks[:met], records[:met])
        asked = np.isin(marks[:met], wanted) if self.sided else np.ones(met, dtype=bool)
        for n in np.flatnonzero(asked).tolist():
            self.keep(float(marks[n]), records[n], work[n])
        return code

    def _step(self) -> tuple[int, str]:
        """Steps up to what they meet."""
        t = float(self.state[TIME])
        if self.target <= t < self.until and not self.ending:
            t = self._pass_set_time(t)
        if self.ending or t >= self.until:
            return (MORE, self.ending) if self.ending else (DONE, "")
        code = self._quiet_steps()
        if code == CROSSED:
            return MORE, self._meet()
        if code == ZERO:
            return MORE, self._go_on()
        if code == NOT_QUIET:
            return MORE, self.ended(self.log.lost_zero)
        return MORE if code == DONE and self.target < self.until else code, ""

    def ended(self, why: str) -> str:
        """Keep the last instant; the status of a motion that ends there."""
        t, self.restart_point = float(self.state[TIME]), None
        self.keep(t, self.record, self.total)
        return f"ended: at t = {t:.6g} {self.system.mechanism.units.time}, {why}"

    # -- events -------------------------------------------------------------------------------

    @property
    def _stops(self) -> bool:
        """Whether the motion ends at the event that the kernel has located."""
        G = self.guard_table
        return bool(G.events.stops[G.passed[0] - G.count[0]])

    def _meet(self) -> str:
        """An event that the kernel has located: its record, and a status where the motion ends."""
        G = self.guard_table
        number, t = int(G.passed[0] - G.count[0]), float(self.state[TRIED_END])
        h = float(G.events.saved[NEXT])
        together = max(tol.EVENT_TOGETHER * h, tol.TIME_ROUNDING * abs(t))
        # what is zero but for rounding where the motion begins crosses nothing
        begins = t <= self.first + tol.EVENT_LOCATED * h
        if number >= len(self.events):
            if not begins:
                self.crossings.append((t, self.jumps[number - len(self.events)]))
            return ""
        event = self.events[number]
        if not (begins or self._is_known(event, t, together)):
            self.occurred.append(EventRecord(event.name, t, self.log.instant(t, G.page.copy())))
        return self.ended(f"'{event.of}' is zero") if event.stop else ""

    def greatest_arguments(self) -> dict[int, float]:
        """The greatest values of arguments of formulas that jump, by their places."""
        every = [self.by_program, *([self.by_python.watched] if self.events else [])]
        first = len(self.events)
        each = [
            max(one.greatest[n] for one in every) for n in range(first, first + len(self.jumps))
        ]
        return dict(zip(self.jumps, map(float, each), strict=True))

    def _is_known(self, event: Event, t: float, together: float) -> bool:
        """Whether a crossing was recorded beside the change of modes that ended the last step."""
        for one in reversed(self.occurred):
            if t - one.t > together:
                return False
            if one.name == event.name and not one.contact and one.t - t <= together:
                return True
        return False

    # -- changes of modes ---------------------------------------------------------------------

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
        log, G, first = self.log, self.guard_table, self.record
        log.before = log.modes_now
        while True:
            code, before = self._next(self._nothing), self.record
            raise_user_error(self.system)
            if why := log.why_it_ends(code, first):
                return self.ended(why)
            self.record = G.page.copy()
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
                self._begun()
                if not begins:
                    log.changes(first)
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
        self.log.check_modes()

    # -- set times ----------------------------------------------------------------------------

    def _interrupt(self, t: float) -> None:
        super()._interrupt(t)
        if self.guard_table.count[0] and not self.ending:  # the first modes follow later
            self.ending = self.settle_jump()

    def _pass_set_time(self, t: float) -> float:
        """Do what is due at a set time, or just after it where rates of drivers jump; the time from
        which it goes on.
        """
        self._interrupt(t)
        now = float(self.state[TIME])
        if now > t and now in self.wanted:
            self.keep(now, self.record, self.total)
        if now >= self.until:
            self.restart_point = self._restart_state(self.total)
        return now

    def settle_jump(self) -> str:
        """Decide the modes anew where forces have jumped, as those of inputs do, beyond what the
        present modes allow; a status where the motion ends there.
        """
        if not self.has_modes or (self.guard_table.known[0] and self.least_guard >= 0.0):
            return ""
        return self._settle(JUMPED)

    def _loosen(self) -> None:
        """A driver that jerks moves what touches by impacts, not by rows that hold."""
        if self.has_modes:
            self._switch_off()

    def _settle_jump(self) -> None:
        """Impacts of what the driver moves towards each other; what it moves apart opens."""
        if not self.has_modes:
            return
        self.load()
        M, count = self.memory.modes, len(self.uni.contact_points)
        apart = self.uni.approach(self.uni.read(self.work))
        apart = apart > tol.RATE_NONE_FRICTION * self.speeds[:count]
        M.closed[:] = (M.mode[:count] != OPEN) & ~apart
        self.log.jerked = True
        self.ending = self._settle()

    def _switch_off(self) -> None:
        """No contact acts, and no joint sticks: an impact moves what stuck, which then slips. What
        slides goes on to.
        """
        slip_signs = self.work.slip_sign[: len(self.layout.friction_kind), 0].copy()
        for point in self.uni.contact_points:
            if point.pair >= 0:
                slip_signs[point.pair] = 0.0
        self.uni.set_rows(self.work, np.zeros(len(self.uni)), slip_signs)
        self.eliminate_rows_that_are_on()

    # -- instants that are kept ---------------------------------------------------------------

    @property
    def _gained(self) -> Array:
        return self.total

    def keep(self, t: float, record: Array, work: Array) -> None:
        """Keep an instant; once, the last state of it."""
        if self.kept and self.kept[-1][0] == t:
            self.kept.pop()
        shown, works = self.log.shown(t, record), np.concatenate([work, self.log.lost])
        modes = self.log.present_names
        self.kept.append((t, shown.record[:, None].copy(), works, modes, shown.forces))

    def _kept_instants(self) -> KeptInstants:
        count = len(self.kept)
        t, records, works, modes, forces = zip(*self.kept, strict=True) if count else ((),) * 5
        return KeptInstants(
            t=np.array(t),
            records=np.array(records).reshape(count, self.rows, 1),
            works=np.array(works).reshape(count, self.causes + len(self.stops)),
            modes=modes,
            forces=forces,
        )

    def _keep_now(self) -> None:
        if not self.kept:
            return
        t = float(self.state[TIME])
        self.restart_point = None if self.stops else self._restart_state(self.total)
        self.evaluate()
        self.keep(t, self.record, self.total)
        self._forget_later_events(t)

    def _forget_later_events(self, t: float) -> None:
        """What lies in a step that is not made yet is met again."""
        self.occurred = [one for one in self.occurred if one.t <= t]
        self.guard_table.seen[:] = -1.0

    def meet_forces(self, marks: Array, records: Array) -> None:
        """Take forces of contacts and ropes over a step into their extremes, within the output
        instants.
        """
        if not self.sided:
            return
        inside = (marks >= self.wanted[0]) & (marks <= self.wanted[-1])
        if not inside.any():
            return
        run = solution_of_records(self.system, marks[inside], records[inside])
        for one in self.sided:
            self.meet(one.name, one_sided_force(run, one))

    def _present_record(self) -> Array:
        return self.log.shown(float(self.state[TIME]), self.record).record[:, None]

    def solution(self, status: str, kept: KeptInstants | None = None) -> Solution:
        """With modes, shared forces, and notes on contacts and events."""
        kept = kept or self._kept_instants()
        found = super().solution(status, kept)
        notes = reported_certificate(found).notes
        notes = (*notes, *self._fast_events(), *self.log.notes_of())
        names = {name: [each[name] for each in kept.modes] for name in self.log.named_modes()}
        shared = self.log.shared_result(*kept.forces)
        found = with_fields(found, notes=notes, modes=names, shared=shared)
        return doubted(found, inadmissible(found))

    def _fast_events(self) -> Iterator[str]:
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

    # -- one time after another ----------------------------------------------------------------

    def start_at(self, t: float, q: Array, v: Array, own: Array | None = None) -> None:
        """Begin anew, as a motion of `simulate` does; modes are decided anew."""
        super().start_at(t, q, v, own)
        self.ending = self.begin_modes()
        self.first_modes = self.log.named_modes()
        first = self.log.shown(t, self.record)
        self.reference, self.first_forces = first.record[:, None].copy(), first.forces

    def place_at(self, t: float, record: Array) -> None:
        """Show an instant (rows,) that no steps have led to, with all contacts open."""
        super().place_at(t, record)
        self.first_modes = self.log.named_modes()

    def _clear(self) -> None:
        """Nothing touches, and no joint sticks."""
        super()._clear()
        G = self.guard_table
        self.memory.forget()
        G.open_normal[:] = G.open_tangent[:] = G.count[0] = 0
        self.log.lost[:], self.log.notes, self.ending = 0.0, [], ""
        self.changed[0], self.counts[:] = -np.inf, 0
        self.total, self.occurred, self.kept, self.late = np.zeros(self.causes), [], [], False
        self.work.anchor[:] = 0.0
        self.work.par[:] = self.probe.par
        none = np.zeros(len(self.uni)), np.zeros(len(self.layout.friction_kind))
        self.uni.set_rows(self.work, *none)
        self.eliminate_rows_that_are_on()

    def advance_to(self, until: float, inputs_changed: bool = False) -> str:
        """Go on to exactly this time, event by event; see `Integration.advance_to`."""
        begins = not self.state.item(STEPS)
        if inputs_changed and begins:
            self.refresh()
        elif inputs_changed:
            self.stage[0] = CHANGED
        if self.ending:
            return self.ending
        if begins:
            self.until = until
            self._begin_steps()
        self.passage.whole, self.apart = until - self.first, math.inf
        if self._one_step(until):
            return ""
        # forces have jumped beyond the modes, or no step was tried
        if self.stage.item(0) == CHANGED:
            self.refresh()
        return self.ending or self._advance_in_steps(until)

    def _one_step(self, until: float) -> bool:
        """Go on by one step, if it reaches the end and is quiet."""
        state = self.state
        busy = self.guarded or self.closely or self.watched or self.sided
        if busy or state.item(TIME) + state.item(NEXT) < until:
            return False
        done, state[LAST_STEP_ALLOWED] = self.outputs.work[-1], 1.0
        done[:] = self.total
        code = self._quietly(until, 1, self.outputs, False)
        self.passage.record_crossings(self.y)
        self.passage.check_inertia(self.y)
        self.total[:], self.late = done, True
        return code in (MORE, DONE) and state.item(TIME) == until

    def _renew(self) -> None:
        """The record of the present instant."""
        if self.late:
            self.record, self.late = self.instant().copy(), False

    def _advance_in_steps(self, until: float) -> str:
        self._renew()
        return super()._advance_in_steps(until)

    def _steps_to_end(self) -> str:
        t, self.kept = float(self.state[TIME]), []
        if t + self.state[NEXT] < self.until:
            self.apart = (self.until - t) / OF_ALL
        self.wanted = self._instants() if self.closely else np.array([self.until])
        return super()._steps_to_end()

    def _watched_steps(self) -> str:
        status = self._steps_to_end()
        if self.kept:
            kept = self._kept_instants()
            self.samples = kept.t, kept.records
        return status

    def refresh(self) -> None:
        """The derivative anew, of inputs that have changed; changed forces may end sticking."""
        self.stage[0] = STEPPING
        super().refresh()
        self.late, self.ending = False, self.settle_jump()

    def instant(
        self, inputs: Array | None = None, input_values: Mapping[str, float] | None = None
    ) -> Array:
        """Record of the present instant, (rows, 1), in the present modes, its forces admissible."""
        probe = self._probe_memory[0]
        for part, own in zip(self._rows_of(probe), self._rows_of(self.work), strict=True):
            part[:] = own
        record = super().instant(inputs, input_values)
        shown = self.log.shown(float(self.state[TIME]), record)
        record[:, 0], self.present_forces = shown.record, shown.forces
        return record

    @property
    def named_modes(self) -> dict[str, str]:
        """Present modes of contacts and frictional joints, by name."""
        return self.log.named_modes()

    @property
    def open_forces(self) -> SharedResult | None:
        """Admissible forces of the present instant, which was evaluated; None where they are
        determined.
        """
        return self.log.shared_result(self.present_forces)

    def _ends(self, record: Array) -> KeptInstants:
        found = super()._ends(record)
        modes = self.first_modes, self.log.named_modes()
        forces = self.first_forces, self.present_forces
        count = len(found.t)
        return replace(found, modes=modes[:count], forces=forces[:count])

    def _works(self) -> Array:
        works = np.zeros((2, self.causes + len(self.stops)))
        works[1] = np.concatenate([self.total, self.log.lost])
        return works

    # -- restarts and checkpoints --------------------------------------------------------------

    def _restart_state(self, work_done: Array) -> Restart:
        """With the modes. The first one before the end counts: what happens in a step that ends
        there happens again, in the whole of it.
        """
        if not self.has_modes:
            return super()._restart_state(work_done)
        if self.before_end is None:
            self.before_end = replace(super()._restart_state(work_done), modal=self._modal_state())
        return self.before_end

    def _modal_state(self) -> ModalState:
        M, G, struck = self.memory.modes, self.guard_table, self.memory.impact.struck
        shared = (np.flatnonzero(one).tolist() for one in (G.open_tangent, G.open_normal))
        fresh = dict(zip(self.guards, G.fresh.tolist(), strict=False))
        groups = dict[int, list[int]]()  # each begins with its leader
        for k, leader in enumerate(M.leader[: len(self.uni.contact_points)].tolist()):
            if leader >= 0:
                group = groups.setdefault(leader, [leader])
                if k != leader:
                    group.append(k)
        return ModalState(
            modes=tuple(self.modes),
            pairs=tuple(self.pairs),
            on=tuple(self.on.tolist()),
            anchor=tuple(self.work.anchor[: len(self.on), 0].tolist()),
            phases=tuple(float(self.work.par[row, 0]) for row in self.uni.phase_rows),
            groups=tuple(map(tuple, groups.values())),
            shared=tuple(map(tuple, shared)),
            closed=tuple(np.flatnonzero(M.closed).tolist()),
            beyond=tuple(np.flatnonzero(M.beyond).tolist()),
            fresh=tuple((*one, least) for one, least in fresh.items() if least > 0.0),
            struck=tuple((k, when) for k, when in enumerate(struck.tolist()) if when > -np.inf),
            page=tuple(self.initial_states[:, 0].tolist()),
            lost=tuple(self.log.lost.tolist()),
        )

    def _resume(self, restart: Restart) -> None:
        if (found := restart.modal) is None:
            super()._resume(restart)
            self.guards_again(np.zeros(0))
            return
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
        fresh = {(kind, number): least for kind, number, least in found.fresh}
        self.guards_again(np.array([fresh.get(one, 0.0) for one in self.guards]))
        self.resumed = found

    def _restart(self, work_done: Array) -> Restart | None:
        """Where to continue, with what contacts took since the last instant, too."""
        found = super()._restart(work_done)
        if found is None or not self.has_modes:
            return found
        if found.modal is None:
            return None
        lost = tuple((np.array(found.modal.lost) - work_done[-1, self.causes :]).tolist())
        return replace(found, modal=replace(found.modal, lost=lost))

    def snapshot(self) -> Checkpoint:
        """A copy of all that the next step depends on, with the modes."""
        self._renew()
        self.before_end = None  # that of the present state
        return replace(super().snapshot(), modes=self._contact_modes())

    def go_on_from(self, given: Checkpoint) -> None:
        """Go on from there; later events are dropped."""
        super().go_on_from(given)
        self.late, self.kept = False, []
        self._forget_later_events(float(self.state[TIME]))
        assert given.modes is not None
        self._take_modes(given.modes)

    def _rows_of(self, work: Work) -> tuple[Array, ...]:
        return work.on, work.pad, work.regularization_weight, work.anchor, work.slip_sign, work.par

    def _contact_modes(self) -> ContactModes:
        return ContactModes(
            first=dict(self.first_modes),
            rows=tuple(part.copy() for part in self._rows_of(self.work)),
            tables=tuple(part.copy() for part in self._tables),
            notes=tuple(self.log.notes),
            lost=self.log.lost.copy(),
            forces=self.first_forces,
        )

    @property
    def _tables(self) -> tuple[Array, ...]:
        M, G, struck = self.memory.modes, self.guard_table, self.memory.impact.struck
        own = M.mode, M.leader, M.closed, M.beyond, struck, G.fresh, G.open_normal, G.open_tangent
        return *own, self.changed, self.counts

    def _take_modes(self, given: ContactModes) -> None:
        self.first_modes, self.first_forces = dict(given.first), given.forces
        for part, was in zip(self._rows_of(self.work), given.rows, strict=True):
            part[:] = was
        for part, was in zip(self._tables, given.tables, strict=True):
            part[:] = was
        self.eliminate_rows_that_are_on()
        self.guards_again(self.guard_table.fresh)
        self.log.lost[:] = given.lost
        self.log.notes, self.ending = list(given.notes), ""

    def unfit(self, given: Checkpoint, inputs: Array) -> str:
        """Reason why a checkpoint does not fit this motion; "" where it fits."""
        modes = given.modes
        mine = (*self._rows_of(self.work), *self._tables)
        if modes is None or [part.shape for part in (*modes.rows, *modes.tables)] != [
            part.shape for part in mine
        ]:
            return "is of another mechanism, with other contacts"
        before = self._contact_modes(), self.ending
        self._take_modes(modes)
        try:
            return super().unfit(given, inputs)
        finally:
            self._take_modes(before[0])
            self.ending = before[1]
