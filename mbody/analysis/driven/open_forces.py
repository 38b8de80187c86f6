"""Forces of driven motions and of rest that no equation decides: closed contacts, ropes, friction.

Rows of closed contacts and ropes that depend on each other, and friction that holds at rest, leave
forces open. Reported are those without friction at rest and, of redundant rows, those with the
greatest least margin (`mbody.solution.shared_forces`); where a contact would have to pull then, and
friction can help, those with friction.
"""

from __future__ import annotations

import numpy as np

from mbody.analysis.contact.contact_tables import JointFriction
from mbody.analysis.driven.contact_report import rope_factor
from mbody.analysis.position.design_results import sound_designs
from mbody.core import tolerances as tol
from mbody.kernels.force_programs import PASSES
from mbody.kernels.friction import LASTING
from mbody.kernels.layout import PER_PRIMITIVE
from mbody.solution.checks import loaded
from mbody.solution.contact_forces import FrictionPair, friction_pairs, pressing_forces
from mbody.solution.doubts import doubted
from mbody.solution.histories import Record, failed_designs, with_fields
from mbody.solution.shared_forces import (
    BentLimit,
    ForceLimits,
    ForceSet,
    Lines,
    SharedResult,
    forces_of_designs,
    free_parts,
    inadmissible,
    moved_within,
    pressing_rows,
    primitive_numbers,
    reported,
)
from mbody.solution.solution import Solution
from mbody.system.rank import jacobian
from mbody.system.system import System, too_large

Array = np.ndarray


class DrivenForces:
    """All forces of one instant, with their units: multipliers of rows, friction of what rests.

    `columns` (coordinates, forces), `forces` (forces,), `limits`: See `mbody.solution`.
    `pulls` (limits,): Which are of contacts and ropes.
    `known` (forces,): Those about which sliding friction is linear, by default the present ones.
    """

    def __init__(self, solution: Solution, instant: int, known: Array | None = None) -> None:
        system = self.system = solution.system
        self.work = loaded(solution, instant)
        self.primitive, self.number, _ = system.row_table
        first, self.count = 3 * system.coordinates, len(self.primitive)
        places = first + PER_PRIMITIVE * self.primitive + self.number
        (record,) = solution.record.at(slice(None), np.array([instant]))
        present = record[places]
        own = present if known is None else known[: self.count]
        self.pairs = friction_pairs(system)
        closed = {one.name for one in system.mechanism.contacts if one.closed}
        along, at_rest = self._along(), solution.pairs_at_rest[instant]
        rates = solution.rates_of_pairs[instant] if self.pairs else np.zeros((0, 3))
        self.resting = [n for n in range(len(self.pairs)) if at_rest[n]]
        self.sliding: list[tuple[FrictionPair, Array]] = []
        of_rows = -jacobian(system, self.work)[1].T
        for n, pair in enumerate(self.pairs):
            slip_sign = float(rates[n, 2])
            if pair.kind in LASTING:
                slip_sign = float(self.work.par[pair.parameter + 4, 0])
            if n in self.resting or not slip_sign:
                continue
            law = JointFriction(system, self.work, n, float(rates[n, 0]))
            pressing = self._pressing(law, self.count)
            x, y = pressing @ own
            _, by_x, by_y = law.size(x, y, slip_sign)
            if known is not None and pair.joint in closed:
                by_x = -law.mu * float(self.work.par[pair.parameter + 4, 0])  # by N, not |N|
            change = slip_sign * (by_x * pressing[0] + by_y * pressing[1])
            of_rows -= np.outer(along[n], change)
            self.sliding.append((pair, change))
        friction = [-record[first + PER_PRIMITIVE * self.pairs[n].primitive] for n in self.resting]
        self.columns = np.column_stack([of_rows, *(along[n] for n in self.resting)])
        self.forces = np.concatenate([present, friction])
        self.limits, self.pulls = self._limits()
        self.own = np.arange(len(self.forces)) >= self.count
        for line in self.limits.lines[self.pulls[: len(self.limits.lines)]]:
            self.own |= line != 0.0

    def _along(self) -> Array:
        """Rows along which pairs slide: (pairs, coordinates)."""
        L, block = self.system.layout, self.work.block[:, 0].reshape(-1, 3)
        found = np.zeros((len(self.pairs), self.system.coordinates + 3))
        for n, pair in enumerate(self.pairs):
            node, e = 4 * L.written_node[pair.primitive], pair.primitive
            for side, body in ((0, L.primitive_i[e]), (2, L.primitive_j[e])):
                found[n, 3 * body : 3 * body + 3] += block[node + side]
        return found[:, : self.system.coordinates]

    def _pressing(self, law: JointFriction, count: int) -> Array:
        """Both multipliers that press a pair, by the forces: (2, count)."""
        at = np.flatnonzero(self.system.layout.primitive_node[self.primitive] == law.node)
        found = np.zeros((2, count))
        found[self.number[at], at] = 1.0
        return found

    def _limits(self) -> tuple[ForceLimits, Array]:
        """Limits of contacts, ropes, and friction of what rests, whose owners are the elements by
        number: closed contacts, couplings, then pairs.
        """
        system, machine, lines = self.system, self.system.mechanism, Lines(len(self.forces))
        contacts, couplings = machine.contacts, machine.couplings
        for k, contact in enumerate(contacts):
            if contact.closed:
                own = system.primitives_of[contact.name]
                for candidate, e in zip(contact.candidates(system.numbers), own, strict=False):
                    lines.add((k, 0.0), {self._row(e): -candidate.sign})
        for k, rope in enumerate(couplings, start=len(contacts)):
            if factor := rope_factor(system, rope):
                e = system.primitives_of[rope.name][0]
                lines.add((k, 0.0), {self._row(e): float(np.sign(factor))})
        pulling = len(lines.owners)
        closed = {one.name for one in contacts if one.closed}
        first = len(contacts) + len(couplings)
        for place, n in enumerate(self.resting, start=self.count):
            self._limit(lines, first + n, place, n, self.pairs[n].joint in closed)
        limits = lines.made()
        return limits, np.arange(len(limits.every_owner())) < pulling

    def _row(self, e: int) -> int:
        return int(np.flatnonzero(self.primitive == e)[0])

    def _limit(self, lines: Lines, owner: int, place: int, n: int, contact: bool) -> None:
        pair, L = self.pairs[n], self.system.layout
        law = JointFriction(self.system, self.work, n)
        if contact:
            e = int(np.flatnonzero(L.primitive_node == law.node)[0])
            press = -float(self.work.par[pair.parameter + 4, 0]) * law.mu
            for sign in (1.0, -1.0):
                lines.add((owner, sign), {self._row(e): press, place: sign}, 0.0, float(law.mu > 0))
        elif law.by_law:
            values = [float(law.size(0.0, 0.0, sign)[0]) for sign in (1.0, -1.0)]
            whole = max(values)
            for sign, value in zip((1.0, -1.0), values, strict=True):
                parts = {place: sign / (whole or 1.0)}
                lines.add((owner, sign), parts, value / (whole or 1.0), float(whole > 0.0))
        else:
            turns = self.system.row_kinds[pair.primitive] == "a"
            length = law.first if law.kind == "pin" else self.system.length if turns else 1.0
            pressing = pressing_rows(self.system, law.node)
            lines.bent.append(BentLimit(owner, place, pressing, law.number, law.arm[:6], length))

    def multipliers(self, change: Array) -> Array:
        """Changes of the multipliers of all primitives, (primitives, 2, …), by those of forces."""
        found = np.zeros((len(self.system.owners), 2, *change.shape[1:]))
        found[self.primitive, self.number] = change[: self.count]
        for place, n in enumerate(self.resting, start=self.count):
            found[self.pairs[n].primitive, 0] = -change[place]
        for pair, by in self.sliding:
            found[pair.primitive, 0] = np.tensordot(by, change[: self.count], 1)
        return found

    def pressing(self, solution: Solution, instant: int) -> DrivenForces | None:
        """Forces of friction that goes by N of contacts, not by |N|; None unless all press."""
        rows, alike = slice(self.count), np.ones((len(self.columns), 1))
        alike[2::3] = 1.0 / self.system.length
        forces = self.forces.copy()
        load = (self.columns @ forces) * alike[:, 0]
        of_rows = (self.columns[:, rows] @ forces[rows]) * alike[:, 0]
        for _ in range(PASSES):
            other = DrivenForces(solution, instant, forces)
            columns = other.columns[:, rows] * alike
            scale = 1.0 / np.maximum(np.abs(columns).max(axis=0), tol.TINY)
            own = np.linalg.lstsq(columns * scale, of_rows, rcond=None)[0]
            moved = np.abs(own - forces[rows] / scale).max()
            forces[rows] = other.forces[rows] = scale * own
            if moved <= tol.CONTACT_FORCE_SETTLED * np.abs(own).max():
                break
        if not other.balances(forces, load, alike):
            return None
        # of redundant rows those that press best
        best = other.admissible()[0]
        if (best != other.forces).any():
            other = DrivenForces(solution, instant, best)
            other.forces = best
            if not other.balances(best, load, alike):
                return None
        pressing = self._pulling(best)
        pulls = pressing.min() < -tol.FORCES_ADMISSIBLE * np.abs(pressing).max()
        return None if pulls else other

    def balances(self, forces: Array, load: Array, alike: Array) -> bool:
        """Whether forces carry a load, both in like units; friction is linear in them."""
        left = np.abs((self.columns @ forces) * alike[:, 0] - load).max()
        return bool(left <= tol.FORCES_ADMISSIBLE * max(np.abs(forces).max(), tol.TINY))

    def of_rows(self) -> Array:
        """Multipliers of all primitives, (primitives, 2)."""
        return self.multipliers(self.forces)

    def admissible(self) -> tuple[Array, ForceSet | None]:
        """The forces that are reported, and all that are admissible; None where they are
        determined.
        """
        best, parts, margins = reported(self.columns, self.forces, self.own, self.limits)
        if not parts:
            return self.forces, None
        found, most = self.forces, max(part.size for part in parts)
        rests = np.arange(len(found)) < self.count
        if self.own[rests].any():
            # of redundant rows alone, without friction of what rests
            bare = Lines(self.count)
            for owner, line in zip(self.limits.owners, self.limits.lines, strict=True):
                if not owner[1]:
                    bare.add(owner, dict(enumerate(line[rests])))
            found = found.copy()
            found[rests] = reported(
                self.columns[:, rests], found[rests], self.own[rests], bare.made()
            )[0]
        if self._least(found) < -tol.FORCES_ADMISSIBLE * most:
            found = best if self._least(best) > self._least(found) else found
        free = np.hstack([part.free for part in parts])
        changes = primitive_numbers(self.system.layout, self.work, self.multipliers(free))
        changes = changes.reshape(-1, free.shape[1])
        rows = np.flatnonzero(np.abs(changes).max(axis=1) > 0.0)
        least = np.array([one.least for one in margins])
        worst = tuple(owner for one in margins if one.least < 0.0 for owner in one.active)
        return found, ForceSet(found, self.limits, tuple(parts), least, worst, rows, changes[rows])

    def _pulling(self, forces: Array) -> Array:
        """Forces of contacts and ropes."""
        return self.limits.at(forces)[self.pulls[: len(self.limits.lines)]]

    def _least(self, forces: Array) -> float:
        """The least force of a contact or a rope."""
        return float(self._pulling(forces).min(initial=0.0))


def _keeps_rows(found: Solution) -> bool:
    """Whether a result keeps rows of its own."""
    return type(found.record) is Record


def with_pressing_forces(found: Solution) -> Solution:
    """The result with forces that press where contacts that slide were found to pull: those of
    friction μ N in place of μ |N|, where there are such. They are set in its record.
    """
    rough = {pair.joint for pair in friction_pairs(found.system)} if _keeps_rows(found) else set()
    sliding = [one for one in found.mechanism.contacts if one.closed and one.name in rough]
    if not (sliding and found.has_forces) or too_large(found.system):
        return found
    every = [force for one in sliding for force in pressing_forces(found, one)]
    changed = False
    for k in np.flatnonzero(np.min(every, axis=0) < 0.0).tolist():
        here = DrivenForces(found, k)
        there = here.pressing(found, k) if np.isfinite(here.forces).all() else None
        if there is not None:
            _set(found, k, here, there.of_rows() - here.of_rows())
            changed = True
    return with_fields(found) if changed else found


def _set(found: Solution, k: int, here: DrivenForces, change: Array) -> None:
    """Changes multipliers of all primitives, (primitives, 2), of an instant in the record."""
    first, block = 3 * found.system.coordinates, found.record.blocks[0]
    lane, place = divmod(k, len(block))
    moved = primitive_numbers(found.system.layout, here.work, change).ravel()
    block[place, first : first + len(moved), lane] += moved


def admissible_forces(found: Solution, *, few: bool = False) -> SharedResult | None:
    """All admissible forces of the instants at which forces are open, or of a `few` of them; the
    record gets those that are reported. None where all are determined.
    """
    system = found.system
    if not found.has_forces or not _keeps_rows(found) or too_large(system):
        return None
    places = _examined(found, few)
    if not len(places):
        return None
    sets: list[ForceSet | None] = [None] * len(found.t)
    for k in places.tolist():
        here = DrivenForces(found, k)
        if not np.isfinite(here.forces).all():
            continue  # it jams
        forces, sets[k] = here.admissible()
        change = here.multipliers(forces - here.forces)
        if change.any():
            _set(found, k, here, change)
    if not any(one is not None for one in sets):
        return None
    machine = system.mechanism
    names = [one.name for one in (*machine.contacts, *machine.couplings)]
    names += [pair.joint for pair in friction_pairs(system)]
    return SharedResult(tuple(sets), tuple(names))


def move_forces(run: Solution, other: Solution) -> None:
    """Set other forces of a driven motion that no equation excludes in the record of `other`."""
    if run.record.batch:
        for one, theirs in zip(sound_designs(run), sound_designs(other), strict=True):
            move_forces(one, theirs)
        return
    every, pattern = [], run.pairs_at_rest
    for k in _examined(run, few=False, redundant=True).tolist():
        here = DrivenForces(run, k)
        own = np.ones(len(here.forces), dtype=bool)
        parts = free_parts(here.columns, here.forces, own, here.limits)
        if parts and np.isfinite(here.forces).all():
            free = np.hstack([part.free for part in parts])
            every.append((pattern[k].tobytes(), free.shape[1], k, here, parts, free))
    least = dict[bytes, int]()
    for key, count, *_ in every:
        least[key] = min(count, least.get(key, count))
    for key, count, k, here, parts, free in every:
        if count == least[key]:  # at singular positions there are more
            change = free @ moved_within(parts, here.limits, here.forces)
            _set(other, k, here, here.multipliers(change))


def reported_row(run: Solution, k: int, system: System, row: Array) -> Array | None:
    """A row (rows,) of a system at instant k of a result, where the same joints rest, with the
    forces that are reported; None where all are determined.
    """
    given = None if run.given is None else run.given[[k]]
    block = row[None, : system.record_rows, None].copy()
    alone = with_fields(
        run, system=system, t=run.t[[k]], record=Record([block], 1, batch=False), given=given
    )
    alone.__dict__["pairs_at_rest"] = run.pairs_at_rest[[k]]
    here = DrivenForces(alone, 0)
    forces, every = here.admissible()
    if every is None:
        return None
    _set(alone, 0, here, here.multipliers(forces - here.forces))
    return np.asarray(block[0, :, 0])


def _examined(found: Solution, few: bool, redundant: bool = False) -> Array:
    """Instants at which forces may be open. A `few`: the first, the middle and the last at which
    the same joints rest, by which rows depend on each other.
    `redundant`: Rows of joints alone count, too.
    """
    system, machine = found.system, found.system.mechanism
    sided = any(one.closed for one in machine.contacts)
    sided = sided or any(rope_factor(system, one) for one in machine.couplings)
    at_rest = found.pairs_at_rest
    every = bool(found.regularization and (sided or redundant))
    places = np.arange(len(at_rest)) if every else np.flatnonzero(at_rest.any(axis=1))
    if not few or not len(places):
        return places
    _, which = np.unique(at_rest[places], axis=0, return_inverse=True)
    some = [np.flatnonzero(which == n)[[0, -1]] for n in range(int(which.max()) + 1)]
    some += [np.flatnonzero(which == n)[[(which == n).sum() // 2]] for n in range(len(some))]
    return places[np.unique(np.concatenate(some))]


def with_admissible_forces(found: Solution) -> Solution:
    """The result with admissible forces of its closed contacts, and a doubt where there are none.
    Of friction of joints alone, nothing else being redundant, they are looked at when they are
    read.
    """
    if not any(one.closed for one in found.mechanism.contacts) and not found.regularization:
        return found
    shared = admissible_forces(found)
    if shared is None:
        return found
    found = with_fields(found, shared=shared)
    return doubted(found, inadmissible(found))


def open_forces(found: Solution) -> SharedResult | None:
    """What `Solution.open_forces` has of a driven motion whose joints rest: which rows depend on
    each other is the same at nearly all instants.
    """
    if found.record.batch:
        failed = failed_designs(found.reports)
        every = range(found.record.count)
        each = [None if n in failed else open_forces(found.design(n)) for n in every]
        return forces_of_designs(each, len(found.t))
    return admissible_forces(found, few=True)
