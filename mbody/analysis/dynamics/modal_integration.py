"""What a motion with contacts and rough joints is between two changes of modes: rows that are on,
guards that are watched, and what it goes on with where it was interrupted.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from mbody.analysis.contact.unilateral import SENSES, Rows, Touch, Unilateral
from mbody.analysis.dynamics.contact_decision import STILL
from mbody.analysis.dynamics.contact_guards import guard_values, guards_of
from mbody.analysis.dynamics.events import OF_A_STEP
from mbody.analysis.dynamics.jumping_forces import JumpIntegration
from mbody.analysis.dynamics.located import Guard, LocatedZero, Saved
from mbody.analysis.dynamics.modal_motion import Closing, SharedForces
from mbody.analysis.dynamics.modal_restart import fresh_guards, set_switched, shared_of
from mbody.analysis.dynamics.zero_crossings import extrema
from mbody.kernels.layout import Layout
from mbody.kernels.loop_closure import laws_of_time
from mbody.kernels.step_state import TIME
from mbody.model.event import Event
from mbody.solution.energy import causes, works_of_moving
from mbody.solution.restart import ModalState, Restart, Way
from mbody.solution.solution import Solution
from mbody.system.partial_elimination import without_nodes
from mbody.system.system import System

__all__ = ["ModalIntegration"]

Array = np.ndarray

#: Nearer than this, in model lengths, is closed.
NEAR = 1e-10
#: What cubics of reserves do not show, as a part of the least of them near by, or of the greatest.
UNSEEN, RESOLVED = 0.25, 1e-3
#: What is behind an edge comes to it where a cubic shows that it comes nearer than this part of how
#: far behind it is at an end.
BEHIND = 0.5


class ModalIntegration(JumpIntegration):
    """Integrates one system with rows that can be on or off, in given modes."""

    decides_modes = True

    def __init__(
        self, system: System, start: Solution, way: Way, events: tuple[Event, ...]
    ) -> None:
        super().__init__(system, start, way, events)
        self.uni = Unilateral(system)
        self.probe = self.work.copied()
        self.stops = [one.name for one in system.mechanism.contacts]
        self.lost = np.zeros(len(self.stops))
        self.work_names = causes(system)
        #: Where the work of stops that move is accounted.
        self.moving = {
            one.removesuffix(".moving"): self.work_names.index(one)
            for one in works_of_moving(system)
        }
        #: Modes of the touches and of the rough joints, and which rows are on.
        self.modes = ["open"] * len(self.uni.touches)
        self.pairs = ["slip+"] * len(self.uni.rough)
        self.on = np.zeros(len(self.uni))
        #: When contacts were struck last, by the number of the touch.
        self.struck: dict[int, float] = {}
        self.groups: dict[int, list[int]] = {}
        self.shared: SharedForces | None = None
        self.fresh: dict[Guard, float] = {}
        #: By which rows are on.
        self.layouts: dict[bytes, Layout] = {}
        #: Open touches that have left their edge over its end.
        self.beyond: set[int] = set()
        self.changed_at, self.changes = -np.inf, 0
        #: Whether rates of drivers have jumped.
        self.jerked = False
        self.closing = Closing()
        self.kept_modes: list[dict[str, str]] = []
        self.contact_notes: list[str] = []
        #: What is said where no modes go on.
        self.none = "no accelerations are consistent"
        #: The state before the step that ends in time, and that which it went on from.
        self.before_end: Restart | None = None
        self.resumed: ModalState | None = None
        #: The page with which a step begins, as it is kept for who goes on from there.
        self.begun = np.empty((0, 1))

    def load(self) -> None:
        """The present state into the workspace."""
        n = self.system.coordinates
        self.work.q[:n, 0], self.work.v[:n, 0] = self.y[:n], self.y[n : 2 * n]
        self.work.time[0, 0] = self.state[TIME]

    def _keep(self, t: float, page: Array, work: Array) -> None:
        if self.instants and self.instants[-1] == t:
            self.kept_modes.pop()
        super()._keep(t, page, work)
        self.kept_modes.append(self.named_modes())

    def named_modes(
        self, modes: list[str] | None = None, pairs: list[str] | None = None
    ) -> dict[str, str]:
        """The mode of every contact and rough joint, by default the present one: of several
        touches that which holds most.
        """
        modes, pairs = modes or self.modes, pairs or self.pairs
        found = {pair.name: mode for pair, mode in zip(self.uni.rough, pairs, strict=True)}
        order = ("open", "idle", "slip-", "slip+", "stick", "roll")
        for touch, mode in zip(self.uni.touches, modes, strict=True):
            named = "roll" if mode == "stick" and touch.spot.round else mode
            if touch.static == 0.0 and mode in SENSES:
                named = "slip+"  # smooth: its sense changes nothing
            if touch.tangent < 0 and mode != "open":
                named = "stick"
            held = found.get(touch.name, "open")
            found[touch.name] = max((held, named), key=order.index)
        return {name: "stick" if mode == "idle" else mode for name, mode in found.items()}

    @property
    def speed(self) -> float:
        """The swiftest motion in model lengths a time."""
        n = self.system.coordinates
        return float((self.scale[n : 2 * n] / self.scale[:n]).max()) * self.system.length

    @property
    def near(self) -> float:
        """Gaps up to this are none [length]."""
        return NEAR * self.system.length

    def set_modes(self, modes: list[str], pairs: list[str], on: Array, held: Array) -> None:
        """Set the modes of touches and rough joints; which of their rows are on: `on` (touches, 2),
        and `held` (rough joints,) of those that stick.
        """
        uni, work = self.uni, self.work
        rows = np.zeros(len(uni))
        senses = np.zeros(len(self.layout.friction_kind))
        self.modes, self.pairs = list(modes), list(pairs)
        self.load()
        found = uni.read(work)
        off = uni.turned_from(work)
        for n, (touch, mode) in enumerate(zip(uni.touches, modes, strict=True)):
            if mode == "open":
                continue
            if not on[n, 0]:
                self.modes[n] = "idle"
                continue
            rows[touch.normal] = 1.0
            if uni.one_way[n] and not self.on[touch.normal]:
                work.anchor[touch.normal, 0] = found.value[touch.normal] / uni.unit_of(n)
            if mode in SENSES and touch.pair >= 0:
                senses[touch.pair] = SENSES[mode]
            if on[n, 1]:
                rows[touch.tangent] = 1.0
                if not self.on[touch.tangent]:
                    self._anchor(n, touch, found, off)
        for pair, mode, holds in zip(uni.rough, pairs, held, strict=True):
            if mode in SENSES:
                senses[pair.pair] = SENSES[mode]
            if mode in SENSES or not holds:
                continue
            rows[pair.tangent] = 1.0
            if not self.on[pair.tangent]:
                work.anchor[pair.tangent, 0] = found.value[pair.tangent]
        self.on = rows
        uni.set_rows(work, rows, senses)
        self.eliminate_rows_that_are_on()

    def eliminate_rows_that_are_on(self) -> None:
        """Steps leave out the blocks of rows that are off."""
        key = self.on.tobytes()
        if key not in self.layouts:
            off = np.zeros(self.layout.nodes, dtype=bool)
            off[self.layout.primitive_node[self.layout.switched]] = self.on == 0.0
            self.layouts[key] = without_nodes(self.layout, off)
        self.motion = replace(self.motion, layout=self.layouts[key])

    def _anchor(self, n: int, touch: Touch, rows: Rows, off: Array) -> None:
        """Sticking begins where the touch is."""
        if touch.spot.solid == "circle":
            self.uni.turn_phase(self.work, n, float(off[n]))
        else:
            self.work.anchor[touch.tangent, 0] = rows.value[touch.tangent]

    # -- guards -------------------------------------------------------------------------------

    def _values(self, which: list[int], t: Array, pages: Array) -> Array:
        count = len(self.events)
        own = [n for n in which if n < count]
        found = np.empty((len(which), len(t)))
        if own:
            found[: len(own)] = super()._values(own, t, pages)
        if len(own) < len(which):
            chosen = [self.guards[n - count] for n in which if n >= count]
            found[len(own) :] = guard_values(self, t, pages, chosen)
        return found

    def _sampled(self, times: Array, marks: Array, pages: Array) -> tuple[Array, Array]:
        found, rising = super()._sampled(times, marks, pages)
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
        shown = low + x * (p + x * (3.0 * change - 2.0 * p - q + x * (p + q - 2.0 * change)))
        error = np.abs(shown - g[:, 1:-1])
        far = np.minimum(np.minimum(low, high), g[:, 1:-1])
        size = np.abs(g).max(axis=1, initial=0.0, keepdims=True)
        return bool((error <= np.maximum(UNSEEN * far, RESOLVED * size)).all())

    def _may_count(self, saved: Saved, event: Event | Guard, times: Array) -> bool:
        """What is well behind an edge from one time to the other closes no gap between them."""
        if not isinstance(event, Guard) or event.kind != "close":
            return True
        later = times[times > saved.state[TIME]]
        self._restore(saved)
        _, pages, _ = self._run(self.target, 1, later)
        before = np.broadcast_to(saved.page, (len(times) - len(later), *saved.page.shape))
        rows = [self._look_at(t, one) for t, one in zip(times, [*before, *pages], strict=True)]
        gaps, rates = (
            np.array([part(one)[event.number] for one in rows])
            for part in (self.uni.gaps, self.uni.approach)
        )
        _, between = extrema(
            np.diff(times), *(one[k : k + 1] for one in (gaps, rates) for k in (0, 1))
        )
        nearest = max(gaps.max(), np.nan_to_num(between, nan=-np.inf).max())
        return bool(nearest >= min(-self.near, BEHIND * gaps.max()))

    def _counts(self, one: LocatedZero) -> bool:
        """Whether a gap that closes does so within the ends of its edge: what comes round an end
        from behind closes none.
        """
        if not isinstance(one.event, Guard) or one.event.kind != "close":
            return True
        rows = self._look_at(one.t, one.saved.page)
        if self.uni.gaps(rows)[one.event.number] < -self.near:
            return False
        within = self.uni.within_edges(rows, self.probe, self.near, STILL * self.speed)
        return bool(within[one.event.number])

    def _look_at(self, t: float, page: Array) -> Rows:
        """The rows at a time and page (rows, 1), of which the probe has the position."""
        n, probe = self.system.coordinates, self.probe
        probe.q[:n, 0], probe.v[:n, 0], probe.time[0, 0] = page[:n, 0], page[n : 2 * n, 0], t
        laws_of_time(self.layout, probe)
        return self.uni.read(probe)

    # -- restarts -----------------------------------------------------------------------------

    def _save(self) -> Saved:
        self.begun = self.page
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
            closed=tuple(sorted(self.closing.closed)),
            beyond=tuple(sorted(self.beyond)),
            fresh=tuple((one.kind, one.number, least) for one, least in self.fresh.items()),
            struck=tuple(self.struck.items()),
            page=tuple(self.begun[:, 0].tolist()),
            lost=tuple(self.lost.tolist()),
        )

    def _resume(self, restart: Restart) -> None:
        found = restart.modal
        assert found is not None
        self.modes, self.pairs = list(found.modes), list(found.pairs)
        self.on = set_switched(self.uni, self.work, found)
        self.eliminate_rows_that_are_on()
        self.groups = {group[0]: list(group) for group in found.groups}
        self.shared, self.fresh = shared_of(found), fresh_guards(found)
        self.closing, self.beyond = Closing(set(found.closed)), set(found.beyond)
        self.struck = dict(found.struck)
        # the first instant, with what is on
        self.evaluate()
        super()._resume(restart)
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
        """What the motion that this one continues took before its last instant it takes again."""
        if self.resumed is not None:
            self.lost = np.array(self.resumed.lost)
            self.page = np.array(self.resumed.page)[:, None]
