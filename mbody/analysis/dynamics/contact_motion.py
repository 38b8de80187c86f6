"""Motion with contacts, ropes and rough joints: smooth steps between located changes of modes.

Between two changes every row that can be on or off keeps its state: what sticks and what is closed
is a constraint, what slides has friction from its real force. Guards are positive as long as that
holds: the gap of an open contact, the force of a closed one, the reserve of friction of one that
sticks, the rate of one that slides, det(I − φ′ B) of sliding friction. Where one of them falls to
zero the step is run again up to there; impacts are resolved while a closed contact is approached,
then complementarity of accelerations decides how all go on (`contact_decision`).
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from mbody.analysis.contact.unilateral import SENSES
from mbody.analysis.dynamics import contact_impacts
from mbody.analysis.dynamics.contact_decision import STILL, decide, near_touches
from mbody.analysis.dynamics.contact_guards import guard_sizes, guard_values, guards_of
from mbody.analysis.dynamics.contact_impacts import Impact, first_overlap, refuse_led, strike
from mbody.analysis.dynamics.jumping_forces import AT_ZERO
from mbody.analysis.dynamics.located import Guard
from mbody.analysis.dynamics.modal_integration import ModalIntegration
from mbody.analysis.dynamics.modal_motion import Closing
from mbody.kernels.friction import DETERMINANT
from mbody.kernels.friction_laws import FRICTION_KINDS
from mbody.kernels.step_state import (
    JACOBIAN_VALID,
    MORE,
    NEAR_SINGULAR,
    NEXT,
    NOT_FINITE,
    STEP_VANISHED,
    TIME,
)
from mbody.model.element import listed
from mbody.solution.certificate import as_reported, changed
from mbody.solution.event_record import EventRecord
from mbody.solution.solution import Solution

__all__ = ["ContactIntegration"]

Array = np.ndarray

#: What touches at the beginning may be so far apart, or overlap so much, in model lengths.
TOUCHES = 1e-9
#: A flight shorter than this, in parts of the time in which what is pulled back goes a model
#: length, is none: impacts have come to rest.
SHORTEST = 2e-6
#: Impacts at one instant, at most; changes of modes within this part of the motion.
STRIKES, CHANGES, AT_ONCE = 500, 200, 1e-14
#: det(I − φ′ B) of sliding friction below this, where steps vanish, is zero.
SINGULAR = 1e-3
#: The first step after a rebound is this much longer than the flight.
FLIGHT = 1.2
#: A guard begins at zero where it is less than this part of its size; until the modes change
#: again what is less than rounding of it is taken for a little more.
ROUNDING = {"close": 1e-14, "edge": 1e-14, "enter": 1e-14, "stop": 1e-13, "lock": 1e-13}
FORCES = 1e-12
#: What begins below zero may be so many times as far below it until it counts as falling.
BELOW = 1.5


class ContactIntegration(ModalIntegration):
    """Integrates one system with rows that can be on or off, and decides which are."""

    # -- the motion ---------------------------------------------------------------------------

    def _integrate(self, times: Array, progress: Callable[[float], None] | None) -> tuple[int, str]:
        if self.resumed is not None:
            return super()._integrate(times, progress)
        self.wanted, self.instants = times, list[float]()
        self.pages, self.works = list[Array](), list[Array]()
        self.total = self.initial_work.copy()
        if status := self.begin_modes():
            return MORE, status
        return super()._integrate(times, progress)

    def begin_modes(self) -> str:
        """Decide the first modes, refusing what overlaps; a status where the motion ends there."""
        self.load()
        touching = first_overlap(self.uni, self.work, TOUCHES * self.system.length)
        approach = self.uni.approach(self.uni.read(self.work))
        # what moves apart is closed no longer
        self.closing = Closing({n for n in touching if approach[n] <= STILL * self.speed})
        return self._settle(begins=True)

    def _guarded(self) -> tuple[Array, list[float]]:
        found = guard_values(self, self.state[[TIME]], self.page[None], self.guards)[:, 0]
        return found, guard_sizes(self)

    def _broken(self) -> bool:
        return any(value < -AT_ZERO * size for value, size in zip(*self._guarded(), strict=True))

    def _settle_anew(self) -> str:
        self.closing = Closing({n for n, mode in enumerate(self.modes) if mode != "open"})
        return self._settle()

    def _loosen(self) -> None:
        """A driver that jerks moves what touches by impacts, not by rows that hold."""
        self._switch_off()

    def _settle_jump(self) -> None:
        """Impacts of what the driver moves towards each other; what it moves apart opens."""
        self.load()
        approach, slow = self.uni.approach(self.uni.read(self.work)), STILL * self.speed
        self.closing = Closing(
            {n for n, mode in enumerate(self.modes) if mode != "open" and approach[n] <= slow}
        )
        self.jerked = True
        self.ending = self._settle()

    def _step(self) -> tuple[int, str]:
        """Where forces of what slides grow without bound the steps vanish before that is met."""
        code, status = super()._step()
        if code in (STEP_VANISHED, NOT_FINITE) and Guard("paradox") in self.guards:
            found = self.page[self.system.friction_rows.start + DETERMINANT, 0]
            if abs(found) < SINGULAR:
                return MORE, self._paradox()
        return code, status

    # -- changes of modes ---------------------------------------------------------------------

    def _passed(self, guard: Guard) -> str:
        """Go on from where a guard is zero."""
        t = float(self.state[TIME])
        self.changes = self.changes + 1 if t - self.changed_at <= AT_ONCE * abs(t) else 0
        self.changed_at = t
        if self.changes > CHANGES:
            return self._ended(
                f"contacts and friction change their modes without end, last {self._who(guard)}"
            )
        if guard.kind == "paradox":
            return self._paradox()
        closing, n = self.closing, guard.number
        if guard.kind in ("close", "lock"):
            closing.closed.add(n)
        elif guard.kind in ("open", "edge"):
            closing.opened = {n}
            if guard.kind == "edge":
                self.beyond.add(n)
        elif guard.kind == "enter":
            self.beyond.discard(n)
        elif guard.kind == "slip":
            closing.sliding = self._together(n, self._impending(n))
        elif guard.kind == "share" and self.shared is not None:
            self.load()
            reserve = self.shared.reserve(self, self.page[:, 0], self.work)
            for one, sense in reserve.sliding.items():
                closing.sliding |= self._together(one, sense)
            closing.opened = reserve.opened
        elif guard.kind == "stop":
            closing.stopped = {n}
        return self._settle()

    def _impending(self, n: int) -> float:
        """The sense in which what sticks would slide: that of its multiplier."""
        touches = len(self.uni.touches)
        row = self.uni.touches[n].tangent if n < touches else self.uni.rough[n - touches].tangent
        return float(np.sign(self.uni.multiplier(self.page[:, 0], row))) or 1.0

    def _together(self, n: int, sense: float) -> dict[int, float]:
        """The senses in which all slides that sticks by the row of touch or rough joint n."""
        group = self.groups.get(n, [n])
        if len(group) == 1:
            return {n: sense}
        self.load()
        rows, units = self.uni.read(self.work), self.system.coordinate_units**2
        own = rows.block[self.uni.touches[n].tangent] * units
        along = {k: own @ rows.block[self.uni.touches[k].tangent] for k in group}
        return {k: sense * float(np.sign(part)) for k, part in along.items()}

    def _who(self, guard: Guard) -> str:
        touches = self.uni.touches
        one = touches[guard.number] if guard.number < len(touches) else None
        return f"'{one.name if one else self.uni.rough[guard.number - len(touches)].name}'"

    def _settle(self, *, begins: bool = False) -> str:
        """Impacts while a closed contact is approached, then the modes that go on; a status where
        the motion ends.
        """
        before = list(self.modes), list(self.pairs)
        state_before = self.page.copy()
        for _ in range(STRIKES):
            self.load()
            rows = self.uni.read(self.work)
            closed = near_touches(self, rows)
            speed = self.speed
            hit = [n for n in closed if self.uni.approach(rows)[n] < -STILL * speed]
            if not hit:
                break
            if (status := self._impact(closed, hit)) is not None:
                return status
        else:
            return self._ended(f"impacts at '{self.uni.touches[hit[0]].name}' do not end")
        if not self._go_on(None if begins else before, state_before):
            return self._without_collision(before)
        return ""

    def _go_on(self, before: tuple[list[str], list[str]] | None, page: Array) -> bool:
        """Set the modes that go on and record what changes; whether there are consistent ones.
        `before` and `page`: the modes, None at the beginning, and the page before.
        """
        verdict = decide(self)
        self.none = "no accelerations are consistent"
        if not verdict.complete:  # of so many contacts not every set of modes was tried
            self.none = "no consistent accelerations were found"
        if not verdict.consistent:
            return False
        if verdict.several:
            self._note_several(page)
        self._begin_anew()
        if before is not None:
            self._record_changes(before, page)
        return True

    def _begin_anew(self) -> None:
        """Steps begin at the modes that were decided."""
        state = self.state
        state[NEAR_SINGULAR] = state[JACOBIAN_VALID] = 0.0
        self.steps.jumped(self.motion)
        self.closing = Closing({n for n, mode in enumerate(self.modes) if mode != "open"})
        self.guards = guards_of(self)
        self._check_finite(self.K, float(state[TIME]))
        found, sizes = self._guarded()
        # what begins below zero is zero from there on: it falls where it falls further
        self.fresh = {
            guard: max(ROUNDING.get(guard.kind, FORCES) * size, -BELOW * float(value))
            for guard, value, size in zip(self.guards, found, sizes, strict=True)
            if abs(value) <= AT_ZERO * size
        }

    # -- impacts ------------------------------------------------------------------------------

    def _impact(self, closed: list[int], hit: list[int]) -> str | None:
        """One impact of all closed contacts; a status where it has no solution."""
        n, t = self.system.coordinates, float(self.state[TIME])
        before, page = self.y[n : 2 * n].copy(), self.page.copy()
        found = strike(self.uni, self.work, closed)
        if found is None:
            refuse_led(self.uni, self.work, hit)
            return self._wedged(hit)
        rates = dict(zip(closed, found.before, strict=True))
        first = min(hit, key=rates.__getitem__)
        kind, when = "impact", t
        sticking = [pair.tangent for pair in self.uni.rough if self.on[pair.tangent]]
        stuck = self.uni.read(self.work).block[sticking].copy()
        self._switch_off()
        self.y[n : 2 * n] = before + found.jump
        self.evaluate()
        self.load()
        rows = self.uni.read(self.work)
        touch = self.uni.touches[first]
        up = self.uni.approach(rows)[first]
        row = touch.normal
        pull = touch.spot.sense * float(rows.block[row] @ self.K[0, n : 2 * n] - rows.gamma[row])
        flies = up > STILL * self.speed and pull < 0.0
        flight = -2.0 * up / pull if flies else 0.0
        short = SHORTEST * np.sqrt(self.system.length / max(abs(pull), 1e-300))
        # what joints that slip and stick again throw back comes sooner each time, too
        again = t - self.struck.get(first, -np.inf) < short
        soon = again and len(stuck) > 0
        self.struck[first] = t
        # what rocks from one place to another strikes ever sooner without a flight
        rocks = again and not (flies or soon) and len(closed) > 1
        if rocks or soon or (flies and flight < short):
            last = flight / (1.0 - touch.restitution) if flies and not soon else 0.0
            kind, when = "rest", t + last
            self.y[n : 2 * n] = before
            self.load()
            if rocks:
                found = contact_impacts.arrest(self.uni, self.work, closed)
            else:
                fixed = stuck if soon else None
                found = strike(self.uni, self.work, closed, still=True, sticking=fixed)
            if found is None:
                return self._wedged(hit)
            self.y[n : 2 * n] = before + found.jump
            self.evaluate()
        elif flies:
            self.state[NEXT] = min(self.state[NEXT], FLIGHT * flight)
        self._add_losses(found, closed)
        self._record_contact(kind, when, touch.name, page, self.page)
        self.closing.closed -= set(closed)
        return None

    def _wedged(self, hit: list[int]) -> str:
        """No velocities keep all that strikes apart: drivers lead it from two sides."""
        names = dict.fromkeys(self.uni.touches[k].name for k in hit)
        shown = ", ".join(f"'{name}'" for name in names)
        return self._ended(
            f"an impact at {shown} has no solution: what strikes is driven against both sides at "
            "once, as a pin that enters a slot without play; give it play, or begin within the slot"
        )

    def _add_losses(self, found: Impact, closed: list[int]) -> None:
        """The energy that an impact took of the contacts; what stops that move gave."""
        for k, gained, moved in zip(closed, found.gained, found.moved, strict=True):
            name = self.uni.touches[k].name
            self.lost[self.stops.index(name)] += gained
            if name in self.moving:
                self.total[self.moving[name]] += moved
        for name, given in found.driven.items():
            self.total[self.work_names.index(name)] += given

    def _without_collision(self, before: tuple[list[str], list[str]]) -> str:
        """Painlevé's paradox: no accelerations are consistent, an impact without collision is."""
        n, t = self.system.coordinates, float(self.state[TIME])
        self.load()
        closed = near_touches(self, self.uni.read(self.work))
        if not closed:
            return self._undecided()
        page, velocities = self.page.copy(), self.y[n : 2 * n].copy()
        found = strike(self.uni, self.work, closed, without_collision=True)
        names = ", ".join(dict.fromkeys(f"'{self.uni.touches[k].name}'" for k in closed))
        self._record_contact("inconsistent", t, self.uni.touches[closed[0]].name, page, page)
        if found is None:
            return self._ended(f"no accelerations and no impact are consistent at {names}")
        self._switch_off()
        self.y[n : 2 * n] = velocities + found.jump
        self.evaluate()
        self._add_losses(found, closed)
        self._record_contact("impact", t, self.uni.touches[closed[0]].name, page, self.page)
        self.contact_notes.append(
            f"at t = {t:.6g} {self.system.mechanism.units.time} {self.none} with the friction at "
            f"{names} (Painlevé's paradox): an impact without collision followed"
        )
        self.closing = Closing()
        self.load()
        if not self._go_on(before, page):
            return self._ended(f"{self.none} at {names}")
        return ""

    def _undecided(self) -> str:
        """No modes of rough joints are consistent, and no contact can be struck."""
        names = ", ".join(f"'{one.name}'" for one in self.uni.rough)
        name, page = self.uni.rough[0].name, self.page
        self._record_contact("inconsistent", float(self.state[TIME]), name, page, page)
        return self._ended(f"{self.none} with the friction at {names}")

    def _note_several(self, page: Array) -> None:
        """Several accelerations are consistent: an event and a note."""
        t = float(self.state[TIME])
        who = [n for n in sorted(self.closing.closed)] or near_touches(
            self, self.uni.read(self.work)
        )
        names = [self.uni.touches[k].name for k in who] or [p.name for p in self.uni.rough]
        shown = ", ".join(dict.fromkeys(f"'{name}'" for name in names))
        self._record_contact("indeterminate", t, names[0] if names else "", page, page)
        why = "Painlevé's paradox): that of the least contact force was taken"
        idle = "idle" in self.modes or any(
            mode == "stick" and not self.on[pair.tangent]
            for pair, mode in zip(self.uni.rough, self.pairs, strict=True)
        )
        if idle:
            why = "nothing decides the forces of what rests): one of them was taken"
        self.contact_notes.append(
            f"at t = {t:.6g} {self.system.mechanism.units.time} several accelerations are "
            f"consistent with the friction at {shown} ({why}"
        )

    def _paradox(self) -> str:
        sliding = [
            t.name for t, mode in zip(self.uni.touches, self.modes, strict=True) if mode in SENSES
        ] + [p.name for p, mode in zip(self.uni.rough, self.pairs, strict=True) if mode in SENSES]
        names = ", ".join(f"'{name}'" for name in dict.fromkeys(sliding))
        self._record_contact("paradox", float(self.state[TIME]), sliding[0], self.page, self.page)
        return self._ended(
            f"the forces of what slides at {names} grow without bound (Painlevé's paradox)"
        )

    def _switch_off(self) -> None:
        """No contact acts, and no joint sticks: an impact moves what stuck, which then slips. What
        slides goes on to.
        """
        senses = self.work.sense[: len(self.layout.friction_kind), 0].copy()
        for touch in self.uni.touches:
            if touch.pair >= 0:
                senses[touch.pair] = 0.0
        self.on = np.zeros(len(self.on))
        self.uni.set_rows(self.work, self.on, senses)

    # -- what is recorded ---------------------------------------------------------------------

    def _record_contact(self, kind: str, t: float, name: str, page: Array, after: Array) -> None:
        now = float(self.state[TIME])
        if self.resumed is not None and now <= self.first:
            return  # reported by the motion that this one continues
        states = [self._instant(now, one) for one in (page, after)]
        self.occurred.append(EventRecord(kind, t, states[0], states[1], name))

    def _record_changes(self, before: tuple[list[str], list[str]], page: Array) -> None:
        """What was closed before and has another mode now; what takes hold without an impact."""
        touches = self.uni.touches
        free = {touches[n].name for n in np.flatnonzero(self.uni.one_way)}
        t, now = float(self.state[TIME]), self.named_modes()
        for name, old in self.named_modes(*before).items():
            new = now[name]
            if old == new or (old == "open" and name not in free):
                continue
            kind = "open" if new == "open" else "slip" if new in SENSES else "stick"
            self._record_contact(kind, t, name, page, self.page)

    def _solution(self, status: str) -> Solution:
        found = super()._solution(status)
        names = {name: [each[name] for each in self.kept_modes] for name in self.named_modes()}
        notes = (*as_reported(found).notes, *self.contact_notes)
        if self.jerked or any(event.name == "impact" for event in found.events):
            notes += self._without_impulse()
        return changed(found, notes=notes, modes=names)

    def _without_impulse(self) -> tuple[str, ...]:
        """A note on the joints whose reactions have impulses in impacts, but whose friction has
        none.
        """
        kinds = self.system.layout.friction_kind
        names = [
            pair.name
            for pair in self.uni.rough
            if FRICTION_KINDS[int(kinds[pair.pair])] not in ("torque", "force")
        ]
        if not names:
            return ()
        return (f"friction in {listed(names)} has no impulse of its own at impacts",)
