"""Motion of many contacts: time stepping with impulses, ``method="moreau"`` of `simulate`.

The kernels are given a system of bodies, joints, drivers and loads alone; contacts, ropes and
groups are tables beside it (`mbody.analysis.contact.contact_tables`).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from mbody.analysis.contact.contact_tables import ContactTables, contact_tables
from mbody.analysis.contact.step_by_lemke import impulses_by_lemke
from mbody.analysis.dynamics.impulse_limits import refuse_what_does_not_fit
from mbody.analysis.dynamics.impulse_memory import ImpulseMemory
from mbody.analysis.dynamics.impulse_notes import SWEEPS, judged_steps
from mbody.analysis.dynamics.initial_step import REFINEMENTS
from mbody.analysis.dynamics.integration import Integration
from mbody.analysis.dynamics.integrators import FixedSteps, Integrator
from mbody.analysis.dynamics.options import MotionRequest
from mbody.analysis.dynamics.restart_checks import check_restart
from mbody.analysis.initial.initial_state import state_of
from mbody.analysis.position.assembly_analysis import raise_user_error
from mbody.errors import ModelError
from mbody.kernels.contact_geometry import FOUND
from mbody.kernels.contact_shapes import ImpulseSteps
from mbody.kernels.moreau import (
    CHANGE,
    CONTACTS,
    CROWDED,
    DEEPEST_PART,
    DELIVER,
    ELSEWHERE,
    IMPULSE_SLOTS,
    ITERATIONS_DONE,
    KEEP,
    LAST,
    LENGTH,
    LOST,
    NEARER,
    NOW,
    NOWHERE,
    PAIRS,
    REACHED,
    SOLVED,
    STEPS_DONE,
    SWEEPS_DONE,
    UNSOLVED,
    kept_instant,
    moreau,
)
from mbody.kernels.output import PER_PRIMITIVE
from mbody.kernels.residuals import CONSTRAINT, LEFT, RESIDUALS
from mbody.kernels.step_state import DELIVERED, DONE, NEXT, NOT_FINITE, STEPS, TIME
from mbody.model.closed_mechanism import without_contacts
from mbody.solution.certificate import as_reported, changed
from mbody.solution.checks import residuals
from mbody.solution.histories import Record
from mbody.solution.restart import Restart, Way
from mbody.solution.solution import Solution
from mbody.solution.stepped_contacts import SteppedContacts
from mbody.system.assembler import assemble
from mbody.system.other_numbers import with_numbers_of
from mbody.system.system import System

__all__ = ["impulse_motion"]

Array = np.ndarray

#: Steps of one call of the kernel; between calls progress is shown and Ctrl-C takes effect.
AT_ONCE = 200
#: Contacts up to which a step whose impulses do not converge is solved by Lemke's method: of more
#: its table, of four rows a contact, would cost more than a hundred steps.
BY_LEMKE = 30
#: Overlap, as a part of the smaller shape, that is refused at the beginning.
OVERLAP = 0.05
#: Friction within this part of its limit slides.
SLIDES = 1e-9


def impulse_motion(
    system: System,
    start: Solution,
    state: tuple[float, Array, Array] | None,
    request: MotionRequest,
    progress: Callable[[float], None] | None,
    restart: Restart | None,
) -> Solution:
    """The motion from the last instant of `start`, or from `restart` on; as `integrate_phases`.

    Raises
    ------
    ModelError
        For events, stops and drivers that are to be released, and rough joints.
    """
    refuse_what_does_not_fit(system, request)
    first, q, v = state or state_of(system, start)
    motion = ImpulseIntegration(system, start, request.way)
    if restart is not None:
        check_restart(motion.system, restart, float(start.t[-1]))
    return motion.run(first, q, v, request.times, progress, restart)


class ImpulseIntegration(Integration):
    """Integrates one system with contacts by steps with impulses."""

    def __init__(self, system: System, start: Solution, way: Way) -> None:
        self.whole = system
        machine = system.mechanism
        bare = system
        if machine.contacts or machine.groups:
            bare = with_numbers_of(assemble(without_contacts(machine)), system.values)
        super().__init__(bare, start, way)
        self.tables: ContactTables = contact_tables(system)
        self.stops = list(self.tables.laws)
        self.memory = ImpulseMemory(bare, self.layout, self.work, len(self.tables.names))
        loads = np.zeros((self._load_causes() + 1, bare.coordinates))
        self.impulses = ImpulseSteps(
            length=way.step,
            tolerance=way.rtol,
            sweeps=SWEEPS,
            few=BY_LEMKE,
            regularization=self.regularization,
            refinements=REFINEMENTS if self.regularization else 0,
            y=self.y,
            last=np.zeros_like(self.y),
            change=np.zeros(bare.coordinates),
            loads=loads,
            work=np.zeros(self.causes + len(self.stops)),
            work_before=np.zeros(self.causes + len(self.stops)),
            residual=np.zeros(4),
            state=np.zeros(IMPULSE_SLOTS),
        )
        self.instants: list[float] = []
        self.pages: list[Array] = []
        self.works: list[Array] = []
        self.which: list[Array] = []
        self.numbers: list[Array] = []
        self.modes: list[list[str]] = []
        self.residuals: list[Array] = []
        self.by_lemke, self.started = 0, False

    def begin(
        self, first: float, q: Array, v: Array, until: float, own: Array | None = None
    ) -> None:
        """As of other methods, with the first step from there."""
        super().begin(first, q, v, until, own)
        self.impulses.state[NOW] = first

    @staticmethod
    def integrator(method: str, layout: Any, work: Any, step: float) -> Integrator:
        """None of the others: what they would carry on is not needed."""
        return FixedSteps(layout, 1, step, (1.0,))

    def _load_causes(self) -> int:
        return self.causes - len(self.system.drivers)

    def _pass_jump(self, corner: float) -> None:
        """The next step takes the new rates, with impulses of drivers and contacts."""
        self.state[TIME] = self.impulses.state[NOW] = corner

    # -- restarts -----------------------------------------------------------------------------

    def _restart_state(self, work_done: Array) -> Restart:
        """All that the next step depends on."""
        M = self.impulses
        found = super()._restart_state(np.zeros(self.causes))
        found.state[TIME], found.state[NEXT] = M.state[NOW], M.length
        contacts, pull, waiting = self.memory.kept()
        return replace(found, own=(contacts, pull, work_done.copy(), waiting))

    def _take(self, restart: Restart) -> None:
        """Set all that the next step depends on."""
        M, N = self.impulses, self.memory.interior
        contacts, pull, work, waiting = restart.own
        if (pull.shape, work.shape) != (N.old_pull.shape, M.work.shape):
            raise ModelError(
                f"the state that the motion of '{self.system.mechanism.name}' is to go on from is "
                "damaged: 'own' is of other sizes; simulate anew, from its beginning"
            )
        self.y[:] = restart.y
        M.state[NOW] = restart.state[TIME]
        self.memory.begin_with(contacts, pull, waiting)
        M.work[:] = work
        self.started = True

    def _restart(self, work_done: Array) -> Restart | None:
        """Where to continue, with the work since the last instant that was kept."""
        found = self.restart_point
        if found is None or not len(work_done):
            return None
        contacts, pull, work, waiting = found.own
        return replace(found, own=(contacts, pull, work - work_done[-1], waiting))

    # -- the motion ---------------------------------------------------------------------------

    def _integrate(self, times: Array, progress: Callable[[float], None] | None) -> tuple[int, str]:
        """The whole motion, its instants kept: the last code, and the status."""
        M = self.impulses
        self.times = times
        if self.first >= self.until:
            return self._beginning(times), "completed"
        code = KEEP
        while M.state[NOW] < self.until and code != LOST:
            met = len(self.instants)
            M.state[DELIVER] = times[met] if met < len(times) else np.inf
            code = self._steps()
            self.state[TIME], self.state[STEPS] = M.state[NOW], M.state[STEPS_DONE]
            if not self.started and M.state[STEPS_DONE]:
                self._check_start()
            self._deliver()
            if code == REACHED and self.target < self.until:
                self._interrupt(self.target)
                code = KEEP
            if progress is not None:
                progress(float(self.state[TIME]))
        return (NOT_FINITE if code == LOST else DONE), "completed"

    def _beginning(self, times: Array) -> int:
        """The first instant alone: of the first step, whose end is not kept."""
        self.target = self.first + self.impulses.length
        self.impulses.state[DELIVER] = times[0]
        code = self._steps()
        if not self.started and self.impulses.state[STEPS_DONE]:
            self._check_start()
        self._deliver()
        self.restart_point = None
        return NOT_FINITE if code == LOST else DONE

    def _steps(self) -> int:
        """Some steps towards the next set time; a code of `mbody.kernels.moreau`."""
        M, code = self.impulses, CROWDED
        while code in (CROWDED, UNSOLVED, LAST):
            contacts, interior = self.memory.contacts, self.memory.interior
            tables = self.layout, self.work, self.tables.shapes, contacts, interior, M
            code = int(moreau(*tables, self.target, AT_ONCE if self.started else 1))
            raise_user_error(self.system)
            if code == LAST:
                self.restart_point = self._restart_state(M.work)
            elif code == CROWDED:
                self.memory.extend()
            elif code == UNSOLVED:
                self._solve()
        return code

    def _solve(self) -> None:
        """The impulses of the step that is under way, by Lemke's method; where it finds none, as of
        many contacts.
        """
        state = self.impulses.state
        found = impulses_by_lemke(self.memory.contacts)
        state[SOLVED] = NOWHERE
        if found is not None:
            count = int(self.memory.contacts.counts[FOUND])
            self.memory.contacts.impulse[:count] = found
            state[SOLVED], state[CHANGE] = ELSEWHERE, 0.0
            self.by_lemke += 1

    def _check_start(self) -> None:
        """Refuse shapes that overlap at the beginning."""
        self.started = True
        state, B = self.impulses.state, self.memory.contacts
        if not state[DEEPEST_PART] > OVERLAP:
            return
        count = int(B.counts[FOUND])
        gaps = B.geometry[:count, 6]
        c = int(np.argmin(gaps))
        name = self.stops[int(B.who[c, 2])]
        i, j = (self._shape(int(k), name) for k in B.who[c, 3:5])
        unit, b = self.system.mechanism.units.length, 3 * int(B.who[c, 0])
        x, y = B.geometry[c, 2:4] + np.append(self.work.q[:, 0], np.zeros(3))[b : b + 2]
        raise ModelError(
            f"the shapes '{i}' and '{j}' of contact '{name}' overlap at the beginning by "
            f"{-gaps[c]:.3g} {unit}, at ({x:.6g}, {y:.6g}) {unit}: begin where they are apart, or "
            "touch",
            name,
        )

    def _shape(self, number: int, law: str) -> str:
        return self.tables.names[number] if number >= 0 else law

    def _deliver(self) -> None:
        """Keep the instants up to the present one."""
        M = self.impulses
        now, h = float(M.state[NOW]), float(M.state[LENGTH])
        if not M.state[STEPS_DONE]:
            return
        while len(self.instants) < len(self.times):
            t = float(self.times[len(self.instants)])
            if t > now + 1e-9 * M.length:
                return
            self._keep(min(t, now), t, h)

    def _keep(self, t: float, named: float, h: float) -> None:
        """Keep an instant within the last step."""
        M, B = self.impulses, self.memory.contacts
        page = np.empty((self.system.page_rows, 1))
        kept_instant(self.layout, self.work, B, M, t, page)
        part = min(1.0, max(0.0, (t - (float(M.state[NOW]) - h)) / h))
        self.instants.append(named)
        self.pages.append(page)
        self.works.append((1.0 - part) * M.work_before + part * M.work)
        count = int(B.counts[FOUND])
        acting = np.flatnonzero((B.impulse[:count] != 0.0).any(axis=1))
        who, geometry, force = B.who[acting], B.geometry[acting], B.impulse[acting] / h
        middle = np.append(M.last[: 3 * self.layout.bodies], np.zeros(3))
        middle[:-3] += 0.5 * h * M.last[3 * self.layout.bodies : 6 * self.layout.bodies]
        at = middle.reshape(-1, 3)[who[:, 1], :2] + geometry[:, 4:6]
        self.which.append(who[:, [2, 3, 4]])
        self.numbers.append(np.column_stack([at, geometry[:, :2], force, geometry[:, 6]]))
        self.modes.append(self._modes(acting, force))
        self.residuals.append(M.residual.copy())

    def _modes(self, acting: Array, force: Array) -> list[str]:
        """The mode of every contact and rope at the last step."""
        found = ["open"] * len(self.stops)
        B = self.memory.contacts
        for k, c in enumerate(acting):
            law = int(B.who[c, 2])
            limit = B.effect[c, 3] * force[k, 0]
            sliding = limit > 0.0 and abs(force[k, 1]) >= limit * (1.0 - SLIDES)
            mode = "stick" if not sliding else "slip-" if force[k, 1] > 0.0 else "slip+"
            order = ("open", "slip-", "slip+", "stick")
            found[law] = max((found[law], mode), key=order.index)
        return found

    def _keep_now(self) -> None:
        """Keep the instant that a motion has reached."""
        now = float(self.impulses.state[NOW])
        if not self.impulses.state[STEPS_DONE]:
            return
        self.restart_point = self._restart_state(self.impulses.work)
        if not self.instants or self.instants[-1] < now:
            self._keep(now, now, float(self.impulses.state[LENGTH]))

    def _kept(self) -> tuple[Array, Array, Array]:
        pages = np.array(self.pages).reshape(-1, self.system.page_rows, 1)
        works = np.array(self.works).reshape(len(pages), -1)
        self.state[DELIVERED] = len(pages)
        return np.array(self.instants), pages, works

    # -- the result ---------------------------------------------------------------------------

    def _solution(self, status: str) -> Solution:
        found = super()._solution(status)
        spans = [len(one) for one in self.which]
        stepped = SteppedContacts(
            laws=self.tables.laws,
            shapes=self.tables.names,
            first=np.concatenate([[0], np.cumsum(spans)]).astype(np.int64),
            which=np.concatenate([np.empty((0, 3), dtype=np.int64), *self.which]),
            numbers=np.concatenate([np.empty((0, 7)), *self.numbers]),
            residuals=self._residuals(found),
            nearer=float(self.impulses.state[NEARER]),
        )
        contacts = [one.name for one in self.whole.mechanism.contacts]
        modes = {name: [row[n] for row in self.modes] for n, name in enumerate(contacts)}
        state = self.impulses.state
        stats = {
            "steps": int(state[STEPS_DONE]),
            "sweeps": int(state[SWEEPS_DONE]),
            "pairs": int(state[PAIRS]),
            "contacts": int(state[CONTACTS]),
            "iterations": int(state[ITERATIONS_DONE]),
            "by_lemke": self.by_lemke,
        }
        notes, doubts = judged_steps(self.whole, self.impulses, self.way)
        pages = self._whole_pages(found, stepped)
        said = as_reported(found)
        return changed(
            found,
            system=self.whole,
            record=Record([pages], len(pages), batch=False),
            stepped=stepped,
            modes=modes,
            stats=stats,
            branch=None,
            notes=(*said.notes, *notes),
            doubts=(*said.doubts, *doubts),
        )

    def _residuals(self, found: Solution) -> Array:
        """Violations of constraints at the instants, and residuals of the equation of a step."""
        parts = np.zeros((1, len(found), RESIDUALS))
        if len(found):
            parts[0, :, CONSTRAINT] = residuals(found)[0, :, CONSTRAINT]
            parts[0, :, LEFT:] = self.residuals
        return parts

    def _whole_pages(self, found: Solution, stepped: SteppedContacts) -> Array:
        """The pages with rows for named contacts: a contact's whole force in those of its first
        place.
        """
        bare, whole = self.system, self.whole
        pages = found.record.blocks[0]
        if whole is bare:
            return pages
        n, made = 3 * bare.coordinates, np.zeros((len(pages), whole.page_rows, 1))
        made[:, :n] = pages[:, :n]
        for name, primitives in bare.primitives_of.items():
            for ours, theirs in zip(primitives, whole.primitives_of[name], strict=True):
                a, b = n + PER_PRIMITIVE * ours, n + PER_PRIMITIVE * theirs
                made[:, b : b + PER_PRIMITIVE] = pages[:, a : a + PER_PRIMITIVE]
        made[:, whole.own_rows] = pages[:, bare.own_rows]
        for contact in whole.mechanism.contacts:
            spot = contact.spots(whole.numbers)[0]
            o = n + PER_PRIMITIVE * whole.primitives_of[contact.name][0]
            second = contact.bodies[0 if spot.swapped else 1]
            fx, fy, torque = stepped.force(contact.name)
            sign = -1.0 if spot.swapped else 1.0
            x, y = self._torque_point(contact, second, pages)
            made[:, o, 0] = -spot.sense * stepped.pressing(contact.name)
            made[:, o + 2, 0], made[:, o + 3, 0] = sign * fx, sign * fy
            made[:, o + 4, 0] = sign * (torque - x * fy + y * fx)
        return made

    def _torque_point(self, contact: Any, body: str, pages: Array) -> tuple[Array, Array]:
        """Where torques are taken: the mass centre of a body, of a rope its end."""
        if body == "ground":
            q = np.zeros((len(pages), 3))
        else:
            b = 3 * self.system.bodies[body]
            q = pages[:, b : b + 3, 0]
        ax, ay = self.whole.numbers.arm(contact, "j") if "j" in contact.places() else (0.0, 0.0)
        c, s = np.cos(q[:, 2]), np.sin(q[:, 2])
        return q[:, 0] + c * ax - s * ay, q[:, 1] + s * ax + c * ay
