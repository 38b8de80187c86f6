"""What happens at contacts and frictional joints of a motion: events, works, notes and doubts."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Sequence
from typing import Any, NamedTuple

import numpy as np

from mbody.analysis.contact.unilateral import SLIP_SIGNS, Overlap, Unilateral, deepest_overlap
from mbody.analysis.dynamics.interruptions import solution_of_records
from mbody.core import tolerances as tol
from mbody.errors import ModelError, SolveError
from mbody.kernels import held_forces as kernels
from mbody.kernels.advance import (
    CHANGES_WITHOUT_END,
    FOUND,
    IMPACTS_WITHOUT_END,
    LOST,
    NO_COLLISION,
    NO_IMPACT,
    NO_MODES,
    POLE,
    TRIED_COLLISION,
)
from mbody.kernels.complementarity import CONE, law_sizes
from mbody.kernels.contact_guards import BEGIN, LIFT, SHARE, SLIP, STOP
from mbody.kernels.contact_impacts import RESTED
from mbody.kernels.friction import ARMS, FRICTION_KINDS
from mbody.kernels.layout import PER_PRIMITIVE, Work
from mbody.kernels.mode_problem import ALL_NORMALS, ALL_ROWS, TRIED, ContactDecision
from mbody.kernels.step_state import TIME
from mbody.kernels.watched_steps import POLE_TIME
from mbody.model.element import listed
from mbody.solution.doubts import Doubt
from mbody.solution.energy import causes, gain_of_jump, works_of_moving, works_of_pairs
from mbody.solution.histories import EventRecord, with_fields
from mbody.solution.shared_forces import (
    BentLimit,
    ForceLimits,
    ForceSet,
    Lines,
    SharedResult,
    open_forces,
    pressing_rows,
    primitive_numbers,
    reported,
)
from mbody.solution.solution import Solution
from mbody.system.rank import dense, shortest
from mbody.system.system import too_large

# -- Places of a start fitted to contacts: what touches within rounding of digits touches
#    exactly -----------------------------------------------------------------------------------

Array = np.ndarray

#: Corrections at most.
CORRECTIONS = 30


def fit_contacts(uni: Unilateral, work: Work) -> str | None:
    """Move the position in a workspace, as little as may be, to where no shapes overlap by rounding
    and what touches has no gap; joints stay closed. A sentence where that is more than rounding,
    "" where it is not; None where the position stays as it is.
    """
    system = uni.system
    n, scale = system.coordinates, system.coordinate_units
    before = work.q[:n, 0].copy()
    touching, overlaps = set[int](), dict[str, str]()
    for _ in range(CORRECTIONS):
        rows = uni.read(work)
        gaps = uni.gaps(rows)
        found = deepest_overlap(uni, rows, work, tol.CONTACT_GAP_BEGINNING * system.length)
        if found is not None:
            k = found.contact_point
            if not found.depth * uni.unit_of(k) <= tol.START_CHANGE_ALLOWED * system.length:
                break
            touching.add(k)
            size = f"{found.depth:.2g} {system.mechanism.units.length}"
            if uni.angular[uni.contact_points[k].normal]:
                size = f"{np.degrees(found.depth):.2g} deg"
            overlaps.setdefault(found.contact, f"'{found.contact}', where {size} overlapped")
        near = np.abs(gaps) <= tol.CONTACT_GAP_BEGINNING * system.length
        within = uni.within_edges(rows, work, tol.CONTACT_GAP_BEGINNING * system.length, 0.0)
        touching |= set(np.flatnonzero(near & within & ~uni.one_way).tolist())
        own = sorted(touching)
        off = np.abs(gaps[own]).max(initial=0.0) > tol.GUARD_ROUNDING_GAP * system.length
        if not off or too_large(system):
            break
        normals = [uni.contact_points[k].normal for k in own]
        phi, G = dense(system, work)
        J = np.vstack([G, rows.block[normals] * scale / system.length])
        left = np.append(phi, rows.value[normals] / system.length)
        step = shortest(J, -left, tol.SINGULAR_VALUE_NEAR_SINGULAR)
        work.q[:n, 0] += scale * step
        if np.abs(step).max() <= tol.GUARD_ROUNDING_GAP:
            break
    if np.array_equal(work.q[:n, 0], before):
        return None
    if not overlaps:
        return ""
    return f"the places of the start were fitted to contacts: {', '.join(overlaps.values())}"


def refuse_overlap(uni: Unilateral, work: Work) -> None:
    """Refuse shapes that overlap at the beginning."""
    gap_tolerance = tol.CONTACT_GAP_BEGINNING * uni.system.length
    found = deepest_overlap(uni, uni.read(work), work, gap_tolerance)
    if found is not None:
        raise _overlap(uni, work, found)


def _overlap(uni: Unilateral, work: Work, found: Overlap) -> ModelError:
    machine = uni.system.mechanism
    j = uni.bodies[found.contact_point][1]
    x, y, angle = work.q[3 * j : 3 * j + 3, 0]
    ax, ay = (float(part) for part in uni.contact_points[found.contact_point].candidate.position)
    place = (
        float(x + np.cos(angle) * ax - np.sin(angle) * ay),
        float(y + np.sin(angle) * ax + np.cos(angle) * ay),
    )
    (one,) = (one for one in machine.contacts if one.name == found.contact)
    sentence = one.overlapping(found.depth, place, uni.system.values, machine.units)
    return ModelError(sentence, one.described_as)


# -- Sticking with redundant constraints: forces of contacts and friction that no equation
#    decides -----------------------------------------------------------------------------------
#
# A wheel with its brake on that stands on the road, a ladder that sticks at both ends, a linkage at
# rest with several pins with friction: the accelerations follow, the forces do not. It goes on to
# stick as long as there are forces that keep every limit: the greatest least margin, see
# `mbody.solution.shared_forces`, is a guard of the motion, and the forces that have it are
# reported. Where it is zero the multipliers of the program are the motion that begins: what has
# none goes on to stick.


class InstantModes(NamedTuple):
    """Modes of an instant: of the contact points and frictional joints, and which rows are on."""

    modes: list[str]
    pairs: list[str]
    on: Array


class HeldForces:
    """All forces that hold at an instant, with their units: multipliers of joints, then N of closed
    contact points, then friction of those that stick and of the joints that stick.

    `columns` (coordinates, forces): Generalised forces by each, with the friction of what slides.
    `forces` (forces,): Present ones.
    `limits`: Normal forces and friction; owners are contact points and, after them, frictional
      joints.
    """

    def __init__(
        self,
        uni: Unilateral,
        pairs: Sequence[str],
        normals: Sequence[int],
        sticking: Sequence[int],
        joints: Sequence[int],
        slipping: dict[int, float],
    ) -> None:
        system, L, self.uni, self.layout = uni.system, uni.layout, uni, uni.layout
        self.slipping, self.normals = slipping, tuple(normals)
        rows = [uni.contact_points[k].tangent for k in sticking]
        rows += [uni.friction_joints[m].tangent for m in joints]
        self.primitive, self.number, _ = system.row_table
        first = len(self.primitive)  # of what is no joint's
        pair_slip = np.zeros(len(L.friction_kind))
        for one, mode in zip(uni.friction_joints, pairs, strict=True):
            pair_slip[one.pair] = SLIP_SIGNS.get(mode, 0.0)
        for f in filter(uni.separates_wheels, range(len(pair_slip))):
            pair_slip[f] = float(system.par[int(L.friction_par[f]) + 4, 0])
        pressed = [uni.friction_joints[m].pair for m in joints]
        by_law = [FRICTION_KINDS[int(L.friction_kind[f])] in ("torque", "force") for f in pressed]
        lines, bent = len(normals) + 2 * len(sticking) + 2 * sum(by_law), len(joints) - sum(by_law)
        forces = first + len(normals) + len(rows)
        self.size = 3 * L.bodies, forces, lines, bent
        whole = np.int64
        self.held = kernels.HeldForceTable(
            count=np.array([len(normals), len(sticking), len(joints)], whole),
            row=np.column_stack([self.primitive, self.number]),
            normal=np.array(self.normals, whole),
            slip=np.array([slipping.get(k, 0.0) for k in normals], float),
            leader=np.full(len(normals), -1, whole),
            stick=np.array(sticking, whole),
            joint=np.array(joints, whole),
            pair_slip=pair_slip,
            owner=np.zeros(lines + 2 * bent, whole),
            change=np.zeros((len(pair_slip), 2)),
            along=np.zeros(3 * L.bodies),
            arm=np.zeros(2 * ARMS + 1),
        )
        signs = [0.0] * len(normals) + [1.0, -1.0] * ((lines - len(normals)) // 2 + bent)
        self.signs = np.array(signs)
        self.own = np.arange(forces) >= first
        self.columns, self.forces = np.zeros((3 * L.bodies, forces)), np.zeros(forces)
        self.which, self.parts = self._parts(rows)
        #: Their numbers in a record, from the first of all.
        each = PER_PRIMITIVE * self.which[:, None] + np.arange(PER_PRIMITIVE)
        self.numbers = each.ravel()

    def read(self, work: Work, record: Array) -> ForceLimits:
        """The forces by a record (rows,) at the position and velocities in a workspace; their
        limits.
        """
        S, _ = open_forces(*self.size)
        kernels.hold_forces(self.uni.layout, work, self.uni.table, self.held, S, record)
        self.columns, self.forces = S.column.copy(), S.force.copy()
        bent = tuple(
            BentLimit(int(owner), int(one[0]), (int(one[1]), int(one[2])), int(one[3]), arm, size)
            for owner, one, arm, size in zip(
                self.held.owner[len(S.line) :: 2],
                S.bent,
                S.arm.copy(),
                S.length.tolist(),
                strict=True,
            )
        )
        own, relative = self.owners()[: len(S.line)], S.relative > 0
        return ForceLimits(own, S.line.copy(), S.given.copy(), relative, S.counts.copy(), bent)

    def owners(self) -> list[tuple[int, float]]:
        """Whose the limits are, and the sign of the sliding, 0 of normal forces."""
        return list(zip(self.held.owner.tolist(), self.signs.tolist(), strict=True))

    def multipliers(self, change: Array) -> Array:
        """Changes of the multipliers of the primitives `which`, (which, 2, …), by changes of the
        forces (forces, …), to first order in friction of joints that slides.
        """
        found = (self.parts @ change).reshape(len(self.which), 2, *change.shape[1:])
        for f in np.flatnonzero(self.held.change.any(axis=1)):
            e = np.searchsorted(self.which, self.layout.active_set[self.layout.friction_tangent[f]])
            rows = pressing_rows(self.uni.system, int(self.layout.friction_node[f]))
            for part, row in zip(self.held.change[f], rows, strict=True):
                if row >= 0:
                    found[e, 0] += part * change[row]
        return found

    def _parts(self, rows: Sequence[int]) -> tuple[Array, Array]:
        """The primitives with forces, (which,), and their multipliers by each of the forces,
        (2·which, forces): of joints, of contacts with the friction of those that slide, of `rows`.
        """
        uni, active, first = self.uni, self.layout.active_set, len(self.primitive)
        entries = list(zip(self.primitive, self.number, range(first), [1.0] * first, strict=True))
        for n, k in enumerate(self.normals, start=first):
            point = uni.contact_points[k]
            entries.append((active[point.normal], 0, n, -point.candidate.sign))
            if k in self.slipping:
                entries.append((active[point.tangent], 0, n, point.friction * self.slipping[k]))
        for n, row in enumerate(rows, start=first + len(self.normals)):
            entries.append((active[row], 0, n, -1.0))
        tangents = active[self.layout.friction_tangent[self.held.pair_slip != 0.0]]
        which = np.unique([*(one[0] for one in entries), *tangents.tolist()]).astype(np.int64)
        parts = np.zeros((len(which), 2, len(self.forces)))
        for primitive, number, n, sign in entries:
            parts[np.searchsorted(which, primitive), number, n] = sign
        return which, parts.reshape(2 * len(which), -1)


# -- What is reported --------------------------------------------------------------------------


class Reported(NamedTuple):
    """A record whose forces are admissible, and all that are; None where they are determined."""

    record: Array
    forces: ForceSet | None


class SharedForces:
    """What is reported where a motion has redundant constraints; what holds in some modes is kept.

    `uni`: What may touch, slide or stop.
    """

    def __init__(self, uni: Unilateral) -> None:
        self.uni = uni
        self._held = dict[tuple[str, ...], HeldForces | None]()

    def reported(self, work: Work, record: Array, modes: InstantModes) -> Reported:
        """The record (rows,) of an instant with those forces that keep their limits best, at the
        position in a workspace.
        """
        held = self._all_held(modes) if modes.on.any() else None
        if held is None:
            return Reported(record, None)
        limits, uni = held.read(work, record), self.uni
        forces, parts, margins = reported(held.columns, held.forces, held.own, limits)
        if not parts:
            return Reported(record, None)
        moved = np.column_stack([forces - held.forces, *(part.free for part in parts)])
        changes = primitive_numbers(uni.layout, work, held.multipliers(moved), held.which)
        changes = changes.reshape(-1, moved.shape[1])
        found = record.copy()
        found[3 * uni.system.coordinates + held.numbers] += changes[:, 0]
        touched = changes[:, 1:].any(axis=1)
        least = np.array([one.least for one in margins])
        worst = tuple(owner for one in margins if one.least < 0.0 for owner in one.active)
        rows, free = held.numbers[touched], changes[touched, 1:]
        every = ForceSet(forces, limits, tuple(parts), least, worst, rows, free)
        return Reported(found, every)

    def _all_held(self, modes: InstantModes) -> HeldForces | None:
        """Every closed contact point and what sticks; None where so few cannot depend on each
        other.
        """
        key = (*modes.modes, *modes.pairs)
        if key in self._held:
            return self._held[key]
        uni, points = self.uni, self.uni.contact_points
        normals = [n for n, mode in enumerate(modes.modes) if mode != "open"]
        joints = [m for m, mode in enumerate(modes.pairs) if mode == "stick"]
        # what joints guide may be held twice by one contact that sticks
        guided = bool(uni.system.rows) and any(modes.modes[n] == "stick" for n in normals)
        if len(normals) >= 2 or joints or guided:
            slipping = {
                k: SLIP_SIGNS[modes.modes[k]]
                for k in normals
                if modes.modes[k] in SLIP_SIGNS and points[k].tangent >= 0
            }
            sticking = [k for k in normals if modes.modes[k] == "stick" and points[k].static > 0.0]
            held = HeldForces(uni, modes.pairs, normals, sticking, joints, slipping)
        else:
            held = None
        self._held[key] = held
        return held


def admissible_impulses(D: ContactDecision, sums: Array) -> tuple[ForceSet, Array] | None:
    """All impulses of an impact that have the same velocities after it, and how some sums (sums,
    rows) of them change by their combinations, (sums, free); None where these are unique. What slid
    and has all of its friction against that slid until it stopped.
    """
    n, m = int(D.count[ALL_ROWS]), int(D.count[ALL_NORMALS])
    own = D.delassus.diagonal()[:n]
    acts, unit = own > 0.0, 1.0 / np.sqrt(np.where(own > 0.0, own, 1.0))
    S = unit[:, None] * D.delassus[:n, :n] * unit
    values, vectors = np.linalg.eigh(S)
    if values[0] > tol.ROWS_DEPENDENT:
        return None
    scaled = sums * unit
    none = tol.ROWS_DEPENDENT * np.abs(scaled).max(initial=0.0)
    if np.abs(scaled @ vectors[:, values <= tol.ROWS_DEPENDENT]).max(initial=0.0) <= none:
        return None
    g, before = D.impulse[:n] / unit, D.before[:n] * unit
    w, none = before + S @ g, tol.ROWS_DEPENDENT * np.abs(g).max()
    rests = np.abs(w) <= tol.ROWS_DEPENDENT * np.abs(before).max()
    presses = (np.arange(n) < m) & (g > none)
    limits, follows, size = np.zeros(n), np.diag(1.0 * (acts & (rests | presses))), np.empty((3, 1))
    for r in range(m, n):
        k, mu = int(D.normal[r]), 0.0
        if D.law[r] == CONE:
            mu = float(D.mu[r] * unit[k] / unit[r])
            limits[r] = mu * g[k]
        else:
            x, y = D.by_force[r, :, :n] @ D.impulse[:n]
            arm = D.arm[r, ARMS:] if g[r] > 0.0 else D.arm[r, :ARMS]
            law_sizes(int(D.law[r]), arm.copy(), np.array([x]), np.array([y]), size)
            limits[r] = size[0, 0] / unit[r]
        slid = before[r] * g[r] < 0.0 and abs(before[r]) > tol.ROWS_DEPENDENT * np.abs(before).max()
        free = limits[r] > none or (D.law[r] == CONE and follows[k, k] != 0.0)
        if not (rests[r] and free) or (slid and abs(g[r]) >= limits[r] - none):
            follows[r] = 0.0
            if D.law[r] == CONE:
                follows[r, k] = np.sign(g[r]) * mu * follows[k, k]
    used = np.flatnonzero(follows.diagonal())
    place, lines = {int(r): i for i, r in enumerate(used)}, Lines(len(used))
    for r, i in place.items():
        who = int(D.owner[r])
        if r < m:
            lines.add((who, 0.0), {i: 1.0})
        for sign in (1.0, -1.0) if r >= m else ():
            if D.law[r] == CONE and (k := int(D.normal[r])) in place:
                lines.add((who, sign), {i: sign, place[k]: float(D.mu[r] * unit[k] / unit[r])})
            else:
                lines.add((who, sign), {i: sign}, float(limits[r]))
    # as forces along one axis of a body for every row
    columns = np.zeros((3 * n, len(used)))
    columns[::3] = (S @ follows)[:, used]
    every, limits_of = np.ones(len(used), dtype=bool), lines.made()
    forces, parts, margins = reported(columns, g[used], every, limits_of)
    if not parts:
        return None
    moves = np.column_stack([part.free for part in parts])
    least = np.array([one.least for one in margins])
    found = ForceSet(forces, limits_of, tuple(parts), least, (), np.arange(len(used)), moves)
    changes = scaled @ follows[:, used] @ moves
    changes[np.abs(changes) <= tol.ROWS_DEPENDENT * np.abs(scaled).max()] = 0.0
    return found, changes


class ContactLog:
    """The modes of a motion by name, and the log of what changes them.

    `motion`, `active`: An `mbody.analysis.dynamics.integration.Integration`, and its modes.
    `notes`: Sentences on what happened.
    `lost`: Energy that impacts took of each contact that may strike.
    `before`: Modes before those that are being decided.
    `jerked`: Whether rates of drivers have jumped.
    """

    def __init__(self, motion: Any, active: Any) -> None:
        self.motion, self.active, system = motion, active, motion.system
        self.notes: list[str] = []
        self.sharing = SharedForces(active.uni)
        self.jerked, self.before = False, InstantModes([], [], np.zeros(0))
        self.stops = [one.name for one in system.mechanism.contacts]
        self.lost = np.zeros(len(self.stops))
        self.work_names = causes(system)
        #: Where the work of stops that move is accounted.
        self.moving = {
            one.removesuffix(".moving"): self.work_names.index(one)
            for one in works_of_moving(system)
        }
        #: Where the work of friction in joints is, by the number of the pair.
        self.rubbing = [self.work_names.index(one) for one in works_of_pairs(system)]
        #: Modes whose forces are determined; the last instant whose forces were not.
        self.determined: deque[bytes] = deque(maxlen=2)
        self.last_shown: tuple[bytes, Reported] | None = None
        #: Modes that were named last, by their numbers.
        self.last_named: tuple[bytes, dict[str, str]] = b"", {}

    # -- modes, and forces that are shared -----------------------------------------------------

    @property
    def modes_now(self) -> InstantModes:
        """The present modes."""
        active = self.active
        return InstantModes(active.modes, active.pairs, active.on)

    def shown(self, t: float, record: Array, modes: InstantModes | None = None) -> Reported:
        """A record (rows, 1) with admissible forces, of the present modes or of others."""
        m, plain = self.motion, Reported(record[:, 0], None)
        if not len(self.active.uni):
            return plain
        if modes is None:
            key, on = self.active.memory.modes.mode.tobytes(), self.active.on
        else:
            key, on = " ".join((*modes.modes, *modes.pairs)).encode(), modes.on
        key += on.tobytes()
        if not on.any() or key in self.determined:
            return plain
        n, numbers = m.system.coordinates, m.system.friction_rows.start
        place = key + record[: 2 * n].tobytes() + record[3 * n : numbers].tobytes()
        if self.last_shown is not None and self.last_shown[0] == place:
            known = self.last_shown[1]
            found = record[:, 0].copy()
            found[3 * n : numbers] = known.record[3 * n : numbers]
            return known._replace(record=found)
        self.active.look_at(t, record)
        modes = modes or self.modes_now
        found_now = self.sharing.reported(self.active.probe, record[:, 0], modes)
        if found_now.forces is None:
            self.determined.append(key)
        else:
            self.last_shown = place, found_now
        return found_now

    def shared_result(self, *forces: ForceSet | None) -> SharedResult | None:
        """Admissible forces of instants; None where all are determined."""
        if not any(one is not None for one in forces):
            return None
        return SharedResult(forces, tuple(self._owners))

    @property
    def _owners(self) -> list[str]:
        """Names of the contact points, and of the frictional joints after them."""
        uni = self.active.uni
        points = [one.name for one in uni.contact_points]
        return points + [one.name for one in uni.friction_joints]

    def instant(self, t: float, record: Array, modes: InstantModes | None = None) -> Solution:
        """A record (rows, 1) as a solution of one instant, of the present modes or of others."""
        m, shown = self.motion, self.shown(t, record, modes)
        records = shown.record[None, :, None].copy()
        found = solution_of_records(m.system, np.array([t]), records, m.regularization)
        shared = self.shared_result(shown.forces)
        return found if shared is None else with_fields(found, shared=shared)

    def named_modes(
        self, modes: list[str] | None = None, pairs: list[str] | None = None
    ) -> dict[str, str]:
        """The mode of every contact and frictional joint, by default the present one: of several
        contact points that which holds most.
        """
        active, uni = self.active, self.active.uni
        modes, pairs = modes or active.modes, pairs or active.pairs
        found = {pair.name: mode for pair, mode in zip(uni.friction_joints, pairs, strict=True)}
        every = ("open", "slip-", "slip+", "stick", "roll")
        order = {mode: n for n, mode in enumerate(every)}
        for point, mode in zip(uni.contact_points, modes, strict=True):
            named = "roll" if mode == "stick" and point.candidate.round else mode
            if point.static == 0.0 and mode in SLIP_SIGNS:
                named = "slip+"  # smooth: its direction changes nothing
            if point.tangent < 0 and mode != "open":
                named = "stick"
            sticking = found.get(point.name, "open")
            found[point.name] = max((sticking, named), key=order.__getitem__)
        return found

    @property
    def present_names(self) -> dict[str, str]:
        """The mode of every contact and frictional joint."""
        numbers = self.active.memory.modes.mode
        if (key := numbers.tobytes()) != self.last_named[0]:
            self.last_named = key, self.named_modes()
        return self.last_named[1]

    # -- ends ---------------------------------------------------------------------------------

    def why_it_ends(self, code: int, record: Array) -> str:
        """Why a motion ends, by what has happened; empty where it goes on. `record`: before all of
        what happened.
        """
        m = self.motion
        G, M, t = self.active.guard_table, self.active.memory.modes, float(m.state[TIME])
        if code == POLE:
            return self.pole(max(t, float(G.part[POLE_TIME])) if G.part[POLE_TIME] < np.inf else t)
        if code == CHANGES_WITHOUT_END:
            who = f"'{self._owners[int(G.owner[G.passed[0]])]}'"
            return f"contacts and friction change their modes without end, last {who}"
        if code == IMPACTS_WITHOUT_END:
            return (
                f"impacts at '{self._owners[int(self.active.memory.impact.first[0])]}' do not end"
            )
        touching = np.flatnonzero(M.touches).tolist()
        if code == NO_IMPACT:
            hit = np.flatnonzero(self.active.memory.impact.hit).tolist()
            refuse_driven_impact(self.active, hit)
            why = lost_by_masses(self.active.uni, touching, "impulses")
            return why or self._wedged(touching, hit)
        if code == LOST:
            return lost_by_masses(self.active.uni, touching)
        if code not in (NO_MODES, NO_COLLISION):
            return ""
        points, joints = self.active.uni.contact_points, self.active.uni.friction_joints
        names = dict.fromkeys(points[k].name for k in touching)
        if self.active.counts[TRIED_COLLISION] and code == NO_MODES:
            return f"{self._none} at {_quoted(names)}"
        name = next(iter(names), None) or joints[0].name
        self.record("inconsistent", t, name, record, record)
        if code == NO_COLLISION:
            beside, ratio = "", ratio_of_masses(self.active.uni, touching)
            if ratio > tol.MASSES_UNEVEN:
                beside = f", where masses differ by a factor of {ratio:.2g}, which costs digits"
            return f"no accelerations and no impact are consistent at {_quoted(names)}{beside}"
        friction = _quoted(one.name for one in joints)
        return f"{self._none} with the friction at {friction}"

    @property
    def _none(self) -> str:
        """What is said where no modes go on: of so many contacts not every set may be tried."""
        if self.active.memory.problem[0].count[TRIED]:
            return "no accelerations are consistent"
        return "no consistent accelerations were found"

    def _wedged(self, closed: list[int], hit: list[int]) -> str:
        """No velocities keep all that strikes apart: friction wedges what Newton's law throws back,
        or drivers lead it from two sides.
        """
        m = self.motion
        quoted = _quoted(self.active.uni.contact_points[k].name for k in hit)
        self.active.load()
        if self.active.memory.rests(m, closed):
            return (
                f"an impact at {quoted} has no solution: friction wedges what Newton's law of "
                'impact would throw back; Poisson\'s law (law = "poisson") or less friction has one'
            )
        return (
            f"an impact at {quoted} has no solution: what strikes is driven against both sides at "
            "once, as a pin that enters a slot without play; give it play, or begin within the slot"
        )

    @property
    def lost_zero(self) -> str:
        """Why a motion ends whose steps meet a zero of a guard at which none ends."""
        G, owners = self.active.guard_table, self._owners
        n = int(G.passed[0])
        who = f" at '{owners[int(G.owner[n])]}'" if owners and n >= 0 else ""
        return f"steps do not show what happens{who}: smooth loads that jump there"

    def pole(self, t: float) -> str:
        """Why a motion ends whose forces have a pole at a time, which it has come up to."""
        m = self.motion
        every = zip(self._owners, (*self.active.modes, *self.active.pairs), strict=True)
        sliding = [name for name, mode in every if mode in SLIP_SIGNS]
        self.record("paradox", t, sliding[0], m.record, m.record)
        names = _quoted(sliding)
        return f"the forces of what slides at {names} grow without bound (Painlevé's paradox)"

    # -- impacts ------------------------------------------------------------------------------

    def impact(self, record: Array) -> None:
        """An impact has happened; `record`: that before it."""
        m, I = self.motion, self.active.memory.impact
        self._add_losses()
        kind = "rest" if self.active.counts[FOUND] == RESTED else "impact"
        t, name = float(m.state[TIME]), self._owners[int(I.first[0])]
        self.record(kind, t + float(I.rested[0]), name, record, m.record, self._impulses())

    def collision(self, record: Array) -> None:
        """An impact without collision has happened; `record`: that before it."""
        m = self.motion
        t, M = float(m.state[TIME]), self.active.memory.modes
        names = [self.active.uni.contact_points[k].name for k in np.flatnonzero(M.touches)]
        self.record("inconsistent", t, names[0], record, record)
        self._add_losses()
        self.record("impact", t, names[0], record, m.record, self._impulses())
        self.notes.append(
            f"at t = {t:.6g} {m.system.mechanism.units.time} {self._none} with the friction at "
            f"{_quoted(names)} (Painlevé's paradox): an impact without collision followed"
        )

    def _add_losses(self) -> None:
        """Energy that an impact took of contacts; what stops that move, and drivers, gave."""
        m, I = self.motion, self.active.memory.impact
        self.check_impact()
        self.check_outcomes()
        for k in np.flatnonzero(self.active.memory.modes.touches).tolist():
            name = self.active.uni.contact_points[k].name
            self.lost[self.stops.index(name)] += I.gained[k]
            if name in self.moving:
                m.total[self.moving[name]] += I.moved[k]
        gained = I.gained[len(self.active.uni.contact_points) :].tolist()
        for joint, taken in zip(self.active.uni.friction_joints, gained, strict=True):
            m.total[self.rubbing[joint.pair]] += taken
        for one, given in zip(m.system.drivers, I.driven.tolist(), strict=True):
            m.total[self.work_names.index(one.name)] += given

    def check_impact(self) -> None:
        """A doubt where an impact gives energy, or more or less than its impulses do."""
        m, I = self.motion, self.active.memory.impact
        n, t = m.system.coordinates, float(m.state[TIME])
        closed = np.flatnonzero(self.active.memory.modes.touches)
        joints = I.gained[len(self.active.uni.contact_points) :]
        velocities = self.active.memory.modes.y[n : 2 * n]
        taken_away = float(I.gained[closed].sum() + joints.sum())
        gained, rounding = gain_of_jump(m.system.mass[:n, 0], velocities, I.jump)
        given = np.append(I.moved[closed], I.driven)
        exchanged, taken, terms = I.energy.tolist()
        exchanged += float(np.abs(given).sum())
        gained -= float(given.sum())
        none = rounding + tol.ENERGY_IMPACT * exchanged + tol.ENERGY_IMPACT_ARTIFICIAL * abs(taken)
        off = abs(gained + taken - taken_away) > none
        off |= abs(taken) > none + tol.ENERGY_IMPACT_ARTIFICIAL * terms
        if not (off or gained > rounding + tol.ENERGY_IMPACT_GAIN * exchanged):
            return
        points = [self.active.uni.contact_points[k] for k in closed]
        names, units = tuple(dict.fromkeys(one.name for one in points)), m.system.mechanism.units
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
        m.passage.doubts += (Doubt("energy", message, t, names),)

    def check_outcomes(self) -> None:
        """A doubt where velocities after an impact are not unique, of what hangs together with what
        strikes; impulses that are not leave the motion as it is.
        """
        m, I, D = self.motion, self.active.memory.impact, self.active.memory.problem[0]
        n, normals, t = int(D.count[ALL_ROWS]), int(D.count[ALL_NORMALS]), float(m.state[TIME])
        if D.outcomes[:n].max() <= 1:
            return
        struck = np.isin(D.part[:n], D.part[:normals][I.hit[D.owner[:normals]] == 1])
        several = struck & (D.outcomes[:n] > 1) & (D.owner[:n] >= 0)
        if not several.any():
            return
        names = tuple(dict.fromkeys(self._owners[k] for k in D.owner[:n][several].tolist()))
        message = (
            f"at t = {t:.6g} {m.system.mechanism.units.time} the impact at {listed(names)} has "
            "several outcomes: friction allows other velocities after it as well, and those of the "
            "least impulses were taken: do not rely on the motion from there on; less friction, or "
            "clearance that lets them strike one after the other, decides"
        )
        m.passage.doubts += (Doubt("contact", message, t, names),)

    def _shared_impulses(self) -> tuple[str, ...]:
        """Contacts whose impulses in an impact are not unique, which a note says."""
        D, points = self.active.memory.problem[0], len(self.active.uni.contact_points)
        n, m, sums = int(D.count[ALL_ROWS]), int(D.count[ALL_NORMALS]), dict[Any, Array]()
        if n < 2:
            return ()
        for r, k in enumerate(D.owner[:n].tolist()):
            if 0 <= k < points:
                sums.setdefault((self._owners[k], r < m), np.zeros(n))[r] = 1.0
        if (found := admissible_impulses(D, np.array(list(sums.values())))) is None:
            return ()
        forces, changes = found
        every = zip(sums, changes, strict=True)
        names = list(dict.fromkeys(one for (one, _), by in every if forces.unique(by) is False))
        note = f"the impulses of {listed(names)} in impacts are not unique: one of many is given"
        if names and note not in self.notes:
            self.notes.append(note)
        return tuple(names)

    def _impulses(self) -> dict[str, tuple[float, float]]:
        """Normal and tangential impulse of every contact that took part in an impact."""
        I, sums = self.active.memory.impact, dict[str, tuple[float, float]]()
        for k in np.flatnonzero(self.active.memory.modes.touches).tolist():
            before = sums.get(name := self._owners[k], (0.0, 0.0))
            sums[name] = before[0] + float(I.normal[k]), before[1] + float(I.tangential[k])
        return sums

    # -- changes of modes ---------------------------------------------------------------------

    def check_modes(self) -> None:
        """A doubt where modes begin beyond their own limits: a guard of them is below zero."""
        m, G = self.motion, self.active.guard_table
        kind, value = G.kind[: G.count[0]], G.value[BEGIN, : G.count[0]]
        off = np.isin(kind, (LIFT, SLIP, SHARE, STOP))
        off &= value < -tol.GUARD_BEYOND_ZERO * G.size[: G.count[0]]
        if not off.any():
            return
        names = tuple(dict.fromkeys(self._owners[k] for k in G.owner[: G.count[0]][off].tolist()))
        t, unit = float(m.state[TIME]), m.system.mechanism.units.time
        message = (
            f"at t = {t:.6g} {unit} what is decided of {listed(names)} is beyond its own limits, "
            "of pressing, friction or direction: do not rely on the motion from there on"
        )
        m.passage.doubts += (Doubt("contact", message, t, names),)

    def several(self, record: Array) -> None:
        """Several accelerations are consistent: an event and a note."""
        m = self.motion
        t, M = float(m.state[TIME]), self.active.memory.modes
        which = np.flatnonzero(M.closed if M.closed.any() else M.touches)
        names = [self.active.uni.contact_points[k].name for k in which]
        names = names or [one.name for one in self.active.uni.friction_joints]
        self.record("indeterminate", t, names[0] if names else "", record, record)
        why = "Painlevé's paradox): that of the least contact force was taken"
        on, points = m.work.on[:, 0], self.active.uni.contact_points
        redundant = any(
            mode != "open" and not on[point.normal]
            for point, mode in zip(points, self.active.modes, strict=True)
        ) or any(
            mode == "stick" and not on[pair.tangent]
            for pair, mode in zip(self.active.uni.friction_joints, self.active.pairs, strict=True)
        )
        if redundant:
            why = "nothing decides how loads are shared): one of them was taken"
        self.notes.append(
            f"at t = {t:.6g} {m.system.mechanism.units.time} several accelerations are "
            f"consistent with the friction at {_quoted(names)} ({why}"
        )

    def changes(self, record: Array) -> None:
        """Record mode changes of contacts that were closed before, and contacts that close without
        an impact; `record`: before these.
        """
        if self.before[:2] == self.modes_now[:2]:
            return
        points = self.active.uni.contact_points
        free = {points[n].name for n in np.flatnonzero(self.active.uni.one_way)}
        t, now = float(self.motion.state[TIME]), self.named_modes()
        for name, old in self.named_modes(self.before.modes, self.before.pairs).items():
            new = now[name]
            if old == new or (old == "open" and name not in free):
                continue
            kind = "open" if new == "open" else "slip" if new in SLIP_SIGNS else "stick"
            self.record(kind, t, name, record, self.motion.record)

    def record(
        self,
        kind: str,
        t: float,
        name: str,
        record: Array,
        after: Array,
        impulses: dict[str, tuple[float, float]] | None = None,
    ) -> None:
        """An event; `record`, `after`: those before and after it."""
        m = self.motion
        now = float(m.state[TIME])
        if m.resumed is not None and now <= m.first:
            return  # reported by the motion that this one continues
        every = ((record, self.before), (after, None))
        states = [self.instant(now, *one) for one in every]
        shared = self._shared_impulses() if impulses else ()
        m.occurred.append(
            EventRecord(kind, t, states[0], states[1], name, impulses or {}, shared=shared)
        )

    def notes_of(self) -> tuple[str, ...]:
        """Notes of a motion: also on the joints whose reactions have impulses where rates of
        drivers jump, but whose friction has none.
        """
        kinds = self.motion.system.layout.friction_kind
        names = [
            pair.name
            for pair in self.active.uni.friction_joints
            if FRICTION_KINDS[int(kinds[pair.pair])] not in ("torque", "force")
        ]
        if not (self.jerked and names):
            return tuple(self.notes)
        why = "has no impulse of its own where rates of drivers jump"
        return (*self.notes, f"friction in {listed(names)} {why}")


def _quoted(names: Iterable[str]) -> str:
    return ", ".join(f"'{name}'" for name in dict.fromkeys(names))


# -- Refusals ----------------------------------------------------------------------------------


def ratio_of_masses(uni: Unilateral, closed: list[int]) -> float:
    """The greatest ratio of masses that are joined to what touches at some contact points."""
    bodies = {int(b) for k in closed for b in uni.bodies[k] if b < uni.layout.bodies}
    return float(uni.unevenness[sorted(bodies)].max(initial=0.0))


def lost_by_masses(uni: Unilateral, closed: list[int], what: str = "accelerations") -> str:
    """Why rounding decides what goes on at closed contact points; empty where it does not."""
    ratio = ratio_of_masses(uni, closed)
    if ratio <= tol.MASSES_LOST:
        return ""
    names = listed(list(dict.fromkeys(uni.contact_points[k].name for k in closed)))
    return (
        f"the {what} at {names} are lost in rounding: masses that touch differ by a factor "
        f"of {ratio:.2g}, more than numbers carry; take masses that differ by less than "
        f"{tol.MASSES_LOST:.0e}"
    )


def refuse_driven_impact(active: Any, hit: list[int]) -> None:
    """Refuse an impact of what drivers lead, that has just been found to have no solution."""
    memory = active.memory
    D, place = memory.problem[0].delassus, memory.modes.place
    for number in hit:
        if not D[place[number], place[number]] > 0.0:
            name = active.uni.contact_points[number].name
            raise SolveError(
                f"nothing that strikes '{name}' is free to rebound: it follows drivers alone; take "
                "them off, or record when it is reached by an Event",
                name,
            )
