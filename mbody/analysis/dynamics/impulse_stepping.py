"""Motion of many contacts: time stepping with impulses, ``method="moreau"`` of `simulate`.

The kernels are given a system of bodies, joints, drivers and loads alone; contacts, ropes and
groups are tables beside it (`mbody.analysis.contact.contact_tables`).
"""

from __future__ import annotations

import itertools
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from mbody.analysis.contact.contact_tables import (
    ClosedContacts,
    ContactTables,
    contact_tables,
    coupled_bodies,
)
from mbody.analysis.dynamics.integration import Integration, KeptInstants
from mbody.analysis.dynamics.integrators import REFINEMENTS, Integrator, even_steps
from mbody.analysis.dynamics.options import MotionRequest
from mbody.analysis.dynamics.restart import check_restart
from mbody.analysis.initial.initial_state import state_of
from mbody.analysis.position.assembly_analysis import raise_user_error
from mbody.core import tolerances as tol
from mbody.errors import ModelError
from mbody.kernels import finished_instants as instants
from mbody.kernels.contact_geometry import (
    BOUND,
    FOUND,
    MU,
    PRIMES,
    ContactWork,
    ImpulseSteps,
    InteriorWork,
)
from mbody.kernels.contact_impulses import NEEDED, WAITING
from mbody.kernels.layout import PER_PRIMITIVE, Layout, Work, inverse_masses
from mbody.kernels.moreau import (
    CONTACTS,
    CROWDED,
    DEEPEST,
    DEEPEST_PART,
    DELIVER,
    IMPULSE_SLOTS,
    ITERATIONS_DONE,
    KEEP,
    LAST,
    LEFT,
    LENGTH,
    LOST,
    NEARER,
    NOW,
    PAIRS,
    PART_AT,
    REACHED,
    SOUGHT,
    STEPS_DONE,
    SWEEPS_DONE,
    UNSOLVED,
    UNSOLVED_AT,
    UNSOLVED_COUNT,
    UNSOLVED_MOST,
    kept_instant,
    moreau,
)
from mbody.kernels.step_state import DELIVERED, DONE, NEXT, NOT_FINITE, STEPS, TIME
from mbody.model.contact import Contact, Rope, shape_names
from mbody.model.element import listed
from mbody.model.joint_limits import contacts_of
from mbody.model.mechanism import Mechanism
from mbody.model.model_notes import without_contacts
from mbody.model.states import measuring_forces
from mbody.solution.checks import residuals
from mbody.solution.doubts import Doubt
from mbody.solution.histories import Record, reported_certificate, with_fields
from mbody.solution.solution import IntegrationSettings, Restart, Solution
from mbody.solution.stepped_contacts import SteppedContacts
from mbody.system.assembler import assemble
from mbody.system.system import System, with_numbers_of

# -- Requests that steps with impulses refuse --------------------------------------------------


def refuse_what_does_not_fit(system: System, request: MotionRequest) -> None:
    """Refuse what this method does not do."""
    machine = system.mechanism
    if request.events:
        names = listed(event.name for event in request.events)
        raise ModelError(
            f"the method 'moreau' locates no events ({names}): take dop853, or leave them out"
        )
    shapeless = [one.described for one in machine.contacts if not isinstance(one, Contact | Rope)]
    shapeless += [joint.name for joint in machine.joints if contacts_of(joint)]
    if shapeless:
        raise ModelError(
            f"the method 'moreau' has contacts of shapes and ropes, no stops, limits and joints "
            f"that separate ({listed(dict.fromkeys(shapeless))}): take dop853",
            shapeless[0],
        )
    if system.measures_forces:
        name = measuring_forces(machine, states=True)[0]
        raise ModelError(
            f"the method 'moreau' knows impulses of whole steps, and '{name}' measures "
            "accelerations or forces: take dop853",
            name,
        )
    if request.release:
        raise ModelError(
            f"the method 'moreau' releases no drivers ({listed(request.release)}): take dop853"
        )
    frictional = [
        one.name for one in (*machine.joints, *machine.couplings) if one.frictions(system.numbers)
    ]
    if frictional:
        raise ModelError(
            f"the method 'moreau' has friction in contacts, not in joints ({listed(frictional)}): "
            "take dop853, or leave out the friction of joints",
            frictional[0],
        )


# -- Memory of steps with impulses: contacts, matrices of bodies, warm starts ------------------

Array = np.ndarray

#: Contacts for which there is memory at first.
ROOM = 64
#: What a contact has in `ContactWork`: width by name.
WIDTHS = {"who": 6, "old": 3, "geometry": 8, "effect": 6}


def joint_rows(layout: Layout) -> list[list[tuple[int, int]]]:
    """Of every row of joints its moving bodies, and where the numbers of each are among blocks."""
    sides: list[list[tuple[int, int]]] = [[] for _ in range(2 * layout.nodes)]
    for k in range(layout.nodes):
        for side in range(2):
            column = int(layout.node_column[2 * k + side])
            for row in range(2):
                sides[2 * k + row].append((column, 12 * k + 6 * side + 3 * row))
    for n, (k, column) in enumerate(layout.more):
        sides[2 * int(k)].append((int(column), 12 * layout.nodes + 6 * n))
    bodies = [*layout.slot_body, layout.bodies]
    found = [[(int(bodies[column // 3]), block) for column, block in row] for row in sides]
    # welds of the slots of one body are no rows of bodies
    return [
        [one for one in row if one[0] < layout.bodies] if len({body for body, _ in row}) > 1 else []
        for row in found
    ]


class ImpulseMemory:
    """Memory for contacts and for the interior-point method, as much as there is need for."""

    def __init__(self, system: System, layout: Layout, work: Work, shapes: int) -> None:
        self.layout, self.shapes = layout, shapes
        self.room = ROOM
        self.coupled = {system.bodies[name] for name in coupled_bodies(system.mechanism)}
        masses = inverse_masses(layout, system.mass, system.sizes)[:, 0]
        #: Inverse masses, zero of the ground.
        self.inverse = np.zeros(3 * layout.bodies + 3)
        for b in range(layout.bodies):
            s = int(layout.body_slot[b])
            share = float(work.share[s, 0])
            self.inverse[3 * b : 3 * b + 3] = masses[3 * s : 3 * s + 3] * share
        self.contacts = self._contacts()
        self.interior = self._interior(0)

    def kept(self) -> tuple[Array, Array, Array]:
        """Warm start of the next step: contacts (shapes, feature, impulses), impulses of joints,
        and for how many steps sweeps are not tried.
        """
        B, N = self.contacts, self.interior
        which = np.unique(B.old_slot[B.old_slot >= 0])
        waiting = np.array([float(N.count[WAITING])])
        return np.column_stack([B.old[which], B.old_impulse[which]]), N.old_pull.copy(), waiting

    def begin_with(self, contacts: Array, pull: Array, waiting: Array) -> None:
        """Begin the next step with what was `kept`."""
        while self.room < len(contacts):
            self.room *= 2
        self.contacts, self.interior = self._contacts(), self._interior(0)
        self.recall(contacts[:, :3].astype(np.int64), contacts[:, 3:])
        # a step that needs no interior-point method leaves what joints take as it was
        self.interior.pull[:] = self.interior.old_pull[:] = pull
        self.interior.count[WAITING] = int(waiting[0])

    def _contacts(self) -> ContactWork:
        """Memory for contacts."""
        L, shapes, most = self.layout, self.shapes, self.room
        bodies, n = L.bodies, 3 * L.bodies + 3
        is_tied = np.zeros(bodies + 1, dtype=np.int64)
        is_tied[list(self.coupled)] = 1
        wide = {name: np.zeros((most, width)) for name, width in WIDTHS.items()}
        names = ("impulse", "kept", "ahead", "rate", "old_impulse")
        places = 1 << (4 * most - 1).bit_length()
        return ContactWork(
            who=wide["who"].astype(np.int64),
            geometry=wide["geometry"],
            effect=wide["effect"],
            **{name: np.zeros((most, 2)) for name in names},
            shift=np.zeros(most),
            is_tied=is_tied,
            inverse=self.inverse,
            **{name: np.zeros(n) for name in ("velocity", "free", "start", "moved")},
            row_rate=np.zeros(2 * max(1, L.nodes)),
            row_impulse=np.zeros(2 * max(1, L.nodes)),
            old=wide["old"].astype(np.int64),
            old_slot=np.full(places, -1),
            place=np.zeros((max(1, shapes), 2)),
            margin=np.zeros(max(1, shapes)),
            turning=np.zeros(max(1, shapes)),
            cell=np.zeros((max(1, shapes), 2), dtype=np.int64),
            following=np.full(max(1, shapes), -1),
            bucket=np.full(1 << (2 * max(4, shapes) - 1).bit_length(), -1),
            progress=np.zeros(4),
            counts=np.zeros(3, dtype=np.int64),
        )

    def _interior(self, numbers: int) -> InteriorWork:
        """Memory for the interior-point method, with a matrix of so many numbers."""
        L, most = self.layout, self.room
        rows = joint_rows(L)
        pairs = {
            (min(i, j), max(i, j))
            for row in rows
            for (i, _), (j, _) in itertools.combinations(row, 2)
            if i != j
        }
        parts = [part for row in rows for part in row]
        sides = ("dual", "slack", "dual_step", "slack_step", "target", "lack")
        return InteriorWork(
            matrix=np.zeros(numbers),
            **{name: np.zeros(L.bodies, dtype=np.int64) for name in ("place", "order", "first")},
            **{name: np.zeros(L.bodies + 1, dtype=np.int64) for name in ("offset", "start")},
            neighbour=np.zeros(2 * (most + len(pairs)), dtype=np.int64),
            tied=np.array(sorted(pairs), dtype=np.int64).reshape(-1, 2),
            row_start=np.concatenate([[0], np.cumsum([len(row) for row in rows])]).astype(np.int64),
            row_body=np.array([body for body, _ in parts], dtype=np.int64),
            row_block=np.array([block for _, block in parts], dtype=np.int64),
            **{name: np.zeros(len(rows)) for name in ("stiffness", "pull", "old_pull", "rate")},
            **{name: np.zeros((most, 2)) for name in sides},
            **{name: np.zeros(3 * L.bodies + 3) for name in ("rest", "step")},
            sorted=np.zeros(3 * L.bodies),
            count=np.zeros(2, dtype=np.int64),
        )

    def extend(self) -> None:
        """More memory, with the impulses of the step before."""
        old, before = self.contacts, self.interior
        needed = int(before.count[NEEDED])
        if needed > len(before.matrix):
            self.interior = self._interior(needed + needed // 2)
            self._go_on_from(before)
            return
        self.room *= 2
        self.contacts = self._contacts()
        self.interior = self._interior(len(before.matrix))
        self._go_on_from(before)
        kept = np.unique(old.old_slot[old.old_slot >= 0])
        self.recall(old.old[kept], old.old_impulse[kept])

    def impulses_by_modes(self, work: Work) -> Array | None:
        """(P_N, P_T) of all contacts of the step that is under way, by the problem that decides
        modes; None where no solution is found.
        """
        B, N = self.contacts, self.interior
        count = int(B.counts[FOUND])
        which = np.flatnonzero(np.isfinite(B.effect[:count, BOUND]))
        g, who, m = B.geometry[which], B.who[which], len(which)
        W, found = np.zeros((2 * m, len(B.inverse))), np.zeros((count, 2))
        for k, (nx, ny) in enumerate(((g[:, 0], g[:, 1]), (g[:, 1], -g[:, 0]))):
            for side, sign in ((0, -1.0), (1, 1.0)):
                rx, ry = g[:, 2 + 2 * side], g[:, 3 + 2 * side]
                for n, part in enumerate((nx, ny, rx * ny - ry * nx)):
                    W[k * m + np.arange(m), 3 * who[:, side] + n] += sign * part
        # less what joints take
        G = np.zeros((len(N.row_start) - 1, len(B.inverse)))
        row = np.repeat(np.arange(len(G)), np.diff(N.row_start))
        for n in range(3):
            G[row, 3 * N.row_body + n] = work.block[N.row_block + n, 0]
        # of size one, whatever their units are
        sizes = np.sqrt((G**2 * B.inverse).sum(axis=1))
        G = G[sizes > 0.0] / sizes[sizes > 0.0, None]
        Y = B.inverse[:, None] * W.T
        Y -= B.inverse[:, None] * G.T @ np.linalg.pinv(G * B.inverse @ G.T) @ (G @ Y)
        before = W @ B.free
        before[:m] += B.effect[which, BOUND]
        impulses = ClosedContacts(W @ Y, B.effect[which, MU]).solve(before, np.zeros(m))
        if impulses is None:
            return None
        found[which] = impulses.reshape(2, m).T
        return found

    def _go_on_from(self, before: InteriorWork) -> None:
        """Copies the warm start of the interior-point method from the memory before."""
        new = self.interior
        new.pull[:], new.old_pull[:], new.count[:] = before.pull, before.old_pull, before.count

    def recall(self, old: Array, impulses: Array) -> None:
        """Begin the next step with contacts (shapes, feature) and their impulses."""
        B = self.contacts
        B.old[: len(old)], B.old_impulse[: len(old)] = old, impulses
        mask = len(B.old_slot) - 1
        B.old_slot[:] = -1
        for n, one in enumerate(old):
            k = int(np.bitwise_xor.reduce(one * np.array(PRIMES))) & mask
            while B.old_slot[k] >= 0:
                k = (k + 1) & mask
            B.old_slot[k] = n


# -- Notes and doubts of a motion by steps with impulses ---------------------------------------

#: Contacts at once up to which a motion by events is the better one.
FEW = 12


def step_findings(
    whole: System, motion: ImpulseSteps, settings: IntegrationSettings
) -> tuple[list[str], list[Doubt]]:
    """Notes and doubts about the steps: iterations, penetration, residuals."""
    state, units = motion.state, whole.mechanism.units
    machine, notes, doubts = whole.mechanism, list[str](), list[Doubt]()
    steps = int(state[STEPS_DONE])
    sweeps, iterations = (state[n] / max(steps, 1) for n in (SWEEPS_DONE, ITERATIONS_DONE))
    effort = f"{sweeps:.3g} sweeps"
    if iterations:
        effort += f" and {iterations:.3g} iterations of the interior-point method"
    notes.append(
        f"steps of {settings.step:g} {units.time} with impulses, of order one: up to "
        f"{int(state[CONTACTS])} contacts at once, {effort} a step, impulses to "
        f"{settings.rtol:.0e} of the greatest; shapes overlap by at most "
        f"{max(state[DEEPEST], 0.0):.2g} {units.length}, {100 * max(state[DEEPEST_PART], 0.0):.2g}"
        " % of the smaller"
    )
    if state[NEARER] > 0.0:
        notes.append(
            "of many contacts one that slides comes nearer, or leaves, by what its sliding changes "
            f"in a step: by at most {100 * state[NEARER]:.2g} % of the smaller shape"
        )
    if (machine.contacts or machine.groups) and state[CONTACTS] <= FEW:
        notes.append(
            f"of so few contacts ({int(state[CONTACTS])} at once) dop853 finds the motion to its "
            "tolerance, with each impact and each change between sticking and sliding located"
        )
    if state[CONTACTS]:
        notes.append(
            "whether forces are unique while something touches was not examined: impulses that "
            "keep all limits are given, others may balance the bodies as well"
        )
    bouncing = [
        one.name
        for one in (*machine.contacts, *machine.groups)
        if getattr(one, "law", "newton") == "poisson" and getattr(one, "restitution", 0.0)
    ]
    if bouncing:
        notes.append(
            f"impacts of {listed(bouncing)} follow Newton's law of restitution: steps with "
            "impulses know no compression and expansion"
        )
    if state[UNSOLVED_COUNT]:
        t, part = float(state[UNSOLVED_AT]), float(state[UNSOLVED_MOST])
        message = (
            f"the impulses of {int(state[UNSOLVED_COUNT])} of {steps} steps are not found to "
            f"{settings.rtol:.0e}, first at t = {t:.6g} {units.time}: of the velocities that they "
            f"change {part:.1e} is left"
        )
        if part > tol.CONTACT_IMPULSES_UNCERTAIN:
            doubts.append(Doubt("solver", f"{message}; take shorter steps", t))
        else:
            notes.append(message)
    if state[DEEPEST_PART] > tol.CONTACT_OVERLAP_DEEP:
        t, part = float(state[PART_AT]), 100 * float(state[DEEPEST_PART])
        doubts.append(
            Doubt(
                "contact",
                f"shapes overlap by {part:.2g} % of the smaller one at t = {t:.6g} {units.time}, "
                f"more than {100 * tol.CONTACT_OVERLAP_DEEP:g} %: take shorter steps",
                t,
            )
        )
    return notes, doubts


def connected_laws(machine: Mechanism) -> list[list[str]]:
    """Names of contacts, ropes and groups by bodies that these and joints connect."""
    known = shape_names((*machine.bodies, machine.ground))
    bodies = {one.name: set(one.bodies) for one in machine.contacts}
    for group in machine.groups:
        shapes = itertools.chain(*group.sides(known))
        bodies[group.name] = {shape.partition(".")[0] for shape in shapes}
    pairs: list[tuple[list[str], set[str]]] = [([name], own) for name, own in bodies.items()]
    pairs += [([], set(one.bodies)) for one in (*machine.joints, *machine.couplings)]
    parts: list[tuple[list[str], set[str]]] = []
    for names, own in pairs:
        moving = own - {"ground"}
        joined = [part for part in parts if part[1] & moving]
        names = [*itertools.chain(*(part[0] for part in joined)), *names]
        parts = [part for part in parts if not part[1] & moving]
        parts.append((names, moving.union(*(part[1] for part in joined))))
    return [names for names, _ in parts if names]


def energy_gains(machine: Mechanism, found: Solution, rounding: float) -> list[Doubt]:
    """A doubt for connected bodies whose contacts have given energy between kept instants, more
    than errors of their impulses do, `rounding`.
    """
    energy, doubts = found.energy, list[Doubt]()
    if energy is None or not len(found):
        return []
    parts = connected_laws(machine)
    rounding += tol.CONTACT_GAIN_NONE * energy.size
    works = [np.sum([energy.by[name] for name in names], axis=0) for names in parts]
    for names, whole in zip(parts, works, strict=True):
        gained = whole - np.minimum.accumulate(whole)
        allowed = tol.CONTACT_IMPULSES_UNCERTAIN * float(np.abs(whole).max()) + rounding
        beyond = np.flatnonzero(gained > allowed)
        if len(beyond):
            t, unit = float(found.t[beyond[0]]), machine.units.of("torque")
            message = (
                f"the contacts {listed(names)} give up to {gained.max():.3g} {unit}, from t = "
                f"{t:.6g} {machine.units.time} on: Newton's law of restitution does so with "
                "friction (Kane's paradox); give them less restitution"
            )
            doubts.append(Doubt("energy", message, t, tuple(names)))
    return doubts


#: Steps of one call of the kernel; between calls progress is shown and Ctrl-C takes effect.
AT_ONCE = 200


def impulse_motion(
    system: System,
    start: Solution,
    state: tuple[float, Array, Array] | None,
    request: MotionRequest,
    progress: Callable[[float], None] | None,
    restart: Restart | None,
) -> Solution:
    """The motion from the last instant of `start`, or from `restart` on; as `integrate_phases`."""
    refuse_what_does_not_fit(system, request)
    first, q, v = state or state_of(system, start)
    motion = ImpulseIntegration(system, start, request.settings)
    if restart is not None:
        check_restart(motion.system, restart, float(start.t[-1]))
    return motion.run(first, q, v, request.times, progress, restart)


class ImpulseIntegration(Integration):
    """Integrates one system with contacts by steps with impulses."""

    def __init__(self, system: System, start: Solution, settings: IntegrationSettings) -> None:
        self.whole = system
        machine = system.mechanism
        bare = system
        if machine.contacts or machine.groups:
            bare = with_numbers_of(assemble(without_contacts(machine)), system.values)
        super().__init__(bare, start, settings)
        self.tables: ContactTables = contact_tables(system)
        self.stops = list(self.tables.laws)
        self.memory = ImpulseMemory(bare, self.layout, self.work, len(self.tables.names))
        loads = np.zeros((self._load_causes() + 1, bare.coordinates))
        self.impulses = ImpulseSteps(
            length=settings.step,
            tolerance=settings.rtol,
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
        self.records: list[Array] = []
        self.works: list[Array] = []
        self.which: list[Array] = []
        self.numbers: list[Array] = []
        self.modes: list[list[str]] = []
        self.residuals: list[Array] = []
        self.by_modes, self.started = 0, False

    def begin(
        self, first: float, q: Array, v: Array, until: float, own: Array | None = None
    ) -> None:
        """Starts the motion at time `first`, from which the first step is counted."""
        super().begin(first, q, v, until, own)
        self.impulses.state[NOW] = first

    @staticmethod
    def integrator(method: str, layout: Any, work: Any, step: float) -> Integrator:
        """None of the others: what they would carry on is not needed."""
        return even_steps(layout, 1, step, (1.0,))

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

    def _integrate(self, progress: Callable[[float], None] | None) -> tuple[int, str]:
        """The whole motion, its instants kept: the last code, and the status."""
        M, times = self.impulses, self.wanted
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
                found = self.memory.impulses_by_modes(self.work)
                M.state[SOUGHT] = 1.0
                if found is not None:
                    contacts.impulse[: len(found)], M.state[LEFT] = found, 0.0
                    self.by_modes += 1
        return code

    def _check_start(self) -> None:
        """Refuse shapes that overlap at the beginning."""
        self.started = True
        state, B = self.impulses.state, self.memory.contacts
        if not state[DEEPEST_PART] > tol.CONTACT_OVERLAP_DEEP:
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
        while len(self.instants) < len(self.wanted):
            t = float(self.wanted[len(self.instants)])
            if t > now + tol.TIMES_SAME_SAMPLE * M.length:
                return
            self._keep(min(t, now), t, h)

    def _keep(self, t: float, named: float, h: float) -> None:
        """Keep an instant within the last step."""
        M, B = self.impulses, self.memory.contacts
        record = np.empty((self.system.record_rows, 1))
        kept_instant(self.layout, self.work, B, M, t, record)
        part = min(1.0, max(0.0, (t - (float(M.state[NOW]) - h)) / h))
        self.instants.append(named)
        self.records.append(record)
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
            limit = B.effect[c, MU] * force[k, 0]
            sliding = limit > 0.0 and abs(force[k, 1]) >= limit * (1.0 - tol.FRICTION_AT_LIMIT)
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

    def _kept_instants(self) -> KeptInstants:
        records = np.array(self.records).reshape(-1, self.system.record_rows, 1)
        works = np.array(self.works).reshape(len(records), -1)
        self.state[DELIVERED] = len(records)
        return KeptInstants(np.array(self.instants), records, works)

    # -- the result ---------------------------------------------------------------------------

    def solution(self, status: str, kept: KeptInstants | None = None) -> Solution:
        """With the contacts of the steps."""
        found = super().solution(status, kept)
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
            "by_lemke": self.by_modes,
        }
        notes, doubts = step_findings(self.whole, self.impulses, self.settings)
        force = float(np.abs(stepped.numbers[:, 4:6]).max(initial=0.0))
        doubts += energy_gains(
            self.whole.mechanism,
            found,
            max(self.settings.rtol, tol.CONTACT_GAIN_NONE) * force * self.system.length,
        )
        records = self._whole_records(found, stepped)
        said = reported_certificate(found)
        return with_fields(
            found,
            system=self.whole,
            record=Record([records], len(records), batch=False),
            stepped=stepped,
            modes=modes,
            stats=stats,
            branch=None,
            notes=(*said.notes, *notes),
            doubts=(*said.doubts, *doubts),
        )

    def _residuals(self, found: Solution) -> Array:
        """Violations of constraints at the instants, and residuals of the equation of a step."""
        parts = np.zeros((1, len(found), instants.RESIDUALS))
        if len(found):
            own = instants.CONSTRAINT
            parts[0, :, own] = residuals(found)[0, :, own]
            parts[0, :, instants.LEFT :] = self.residuals
        return parts

    def _whole_records(self, found: Solution, stepped: SteppedContacts) -> Array:
        """The records with rows for named contacts: a contact's whole force in those of its first
        place.
        """
        bare, whole = self.system, self.whole
        records = found.record.blocks[0]
        if whole is bare:
            return records
        n, made = 3 * bare.coordinates, np.zeros((len(records), whole.record_rows, 1))
        made[:, :n] = records[:, :n]
        for name, primitives in bare.primitives_of.items():
            for ours, theirs in zip(primitives, whole.primitives_of[name], strict=True):
                a, b = n + PER_PRIMITIVE * ours, n + PER_PRIMITIVE * theirs
                made[:, b : b + PER_PRIMITIVE] = records[:, a : a + PER_PRIMITIVE]
        made[:, whole.auxiliary_rows] = records[:, bare.auxiliary_rows]
        for contact in whole.mechanism.contacts:
            candidate = contact.candidates(whole.numbers)[0]
            o = n + PER_PRIMITIVE * whole.primitives_of[contact.name][0]
            second = contact.bodies[0 if candidate.swapped else 1]
            fx, fy, torque = stepped.force(contact.name)
            sign = -1.0 if candidate.swapped else 1.0
            x, y = self._torque_point(contact, second, records)
            made[:, o, 0] = -candidate.sign * stepped.pressing(contact.name)
            made[:, o + 2, 0], made[:, o + 3, 0] = sign * fx, sign * fy
            made[:, o + 4, 0] = sign * (torque - x * fy + y * fx)
        return made

    def _torque_point(self, contact: Any, body: str, records: Array) -> tuple[Array, Array]:
        """Where torques are taken: the mass centre of a body, of a rope its end."""
        if body == "ground":
            q = np.zeros((len(records), 3))
        else:
            b = 3 * self.system.bodies[body]
            q = records[:, b : b + 3, 0]
        ax, ay = self.whole.numbers.arm(contact, "j") if "j" in contact.places() else (0.0, 0.0)
        c, s = np.cos(q[:, 2]), np.sin(q[:, 2])
        return q[:, 0] + c * ax - s * ay, q[:, 1] + s * ax + c * ay
