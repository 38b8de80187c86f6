"""One motion over time: the kernel's memory, its calls, what comes of them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from mbody.analysis.closure import SOFT, raise_user_error
from mbody.analysis.contacts import pulled
from mbody.analysis.instants import check_reach
from mbody.analysis.rank import dense, rank_of, too_large
from mbody.core.flow import DONE, MORE, begin, flow
from mbody.core.methods import order_8
from mbody.core.output import PER_ATOM
from mbody.energy import account
from mbody.errors import ModelError, SolveError
from mbody.events import Occurrence
from mbody.histories import Record
from mbody.solution import Solution
from mbody.system import System

__all__ = ["Course"]

Array = np.ndarray

#: Steps of one call of the kernel; between calls there is progress, and Ctrl-C is heard.
STEPS = 500
#: Loads whose work is accounted one by one.
ACCOUNTED = 64
#: A free motion with less than this part of the greatest inertia has none.
NO_INERTIA = 1e-12


class Course:
    """Integrates one system from a first state."""

    def __init__(self, system: System, start: Solution, rtol: float, atol: float) -> None:
        self.system, self.start = system, start
        self.rtol, self.atol = rtol, atol
        self.layout = system.runtime()
        self.work = system.work(masses=True)
        self.soft = start.soft if start.system is system else SOFT * bool(start.soft)
        # a small mass stands where there is none: corrections by the residual take it back
        self.regular = 2 if system.has_stand_ins or self.soft else 0
        loads = len(system.mechanism.loads)
        self.causes = (loads if loads <= ACCOUNTED else 1) or 1
        self.causes += len(system.mechanism.drivers)
        self.passes, self.method = max(2, self.regular), order_8()
        self.occurred: list[Occurrence] = []
        self.stops: list[str] = []

    def run(
        self,
        first: float,
        q: Array,
        v: Array,
        times: Array,
        progress: Callable[[float], None] | None,
    ) -> Solution:
        """The motion at the times."""
        self._begin(first, q, v, float(times[-1]))
        code, status = MORE, "completed"
        try:
            code, status = self._follow(times, progress)
        except KeyboardInterrupt:
            unit = self.system.mechanism.units.time
            status = f"stopped at t = {self.state[0]:.6g} {unit} by the user"
        found = self._solution(status)
        lost = np.flatnonzero(~np.isfinite(found.record.blocks[0][:, :, 0]).all(axis=1))
        if lost.size:  # an instant at which a load has no value, though the steps passed it
            self.state[0] = found.t[lost[0]]
            found = found.take(np.arange(lost[0]))
        if lost.size or code not in (DONE, MORE):
            raise self._stopped(found)
        return found

    def _begin(self, first: float, q: Array, v: Array, until: float) -> None:
        """The memory of the kernel with the first state, its slope and the first step."""
        n3 = self.system.coordinates
        self.first, self.until = first, until
        self.rows = 3 * n3 + PER_ATOM * len(self.system.owners)
        self.y, self.K = np.concatenate([q, v]), np.zeros((16, 2 * n3))
        self.P, self.state = np.zeros((16, self.causes)), np.zeros(13)
        self.room = np.zeros((5, 2 * n3)), np.zeros((7, 2 * n3)), np.zeros((7, self.causes))
        self.page = np.empty((self.rows, 1))
        self.state[0] = first
        if not self._slope():
            raise SolveError(
                f"the start does not fit '{self.system.mechanism.name}': its loops do not close "
                "near it; give a motion of this mechanism, or its own guesses"
            )
        self._check_determined()
        self._check_slope(self.K, first)
        self.scale = self._scale(v, self.K[0, n3:])
        self.state[1] = self._first_step(self.y, self.K[0], self.scale, until - first)

    def _slope(self) -> bool:
        """Project the state, take its slope and its page; whether the loops close."""
        begun = begin(
            *(self.layout, self.work, self.soft, self.passes),
            *(self.y, self.K, self.P, self.page, self.state),
        )
        raise_user_error(self.system)
        return bool(begun)

    def _flow(self, until: float, steps: int, times: Array, output: Array, gained: Array) -> int:
        """At most so many steps; see `mbody.core.flow`."""
        code = flow(
            *(self.layout, self.work, *self.method, self.soft, self.regular, self.passes),
            *(self.rtol, self.atol, self.scale, until, steps, self.y, self.K, self.P),
            *(*self.room, times, output, gained, self.state),
        )
        raise_user_error(self.system)
        return int(code)

    def _follow(self, times: Array, progress: Callable[[float], None] | None) -> tuple[int, str]:
        """The whole motion, its instants kept: the last code of the kernel, and the status."""
        self.times, self.output = times, np.empty((len(times), self.rows, 1))
        self.gained = np.zeros((len(times) + 1, self.causes))
        if times[0] <= self.first:
            self.output[0], self.state[6] = self.page, 1.0
        code = MORE
        while code == MORE:
            code = self._flow(self.until, STEPS, times, self.output, self.gained)
            if progress is not None:
                progress(float(self.state[0]))
        return code, "completed"

    def _kept(self) -> tuple[Array, Array, Array]:
        """Times, pages and work of the instants that are met."""
        met = int(self.state[6])
        return self.times[:met], self.output[:met], self.gained[:met]

    def _scale(self, v: Array, a: Array) -> Array:
        """Sizes of coordinates and rates, to which absolute errors are relative."""
        length = self.system.length
        unit = np.tile([length, length, 1.0], len(v) // 3)
        swift = max(
            float(np.abs(v / unit).max(initial=0.0)),
            float(np.sqrt(np.abs(a / unit).max(initial=0.0))),
        )
        return np.concatenate([unit, unit * (swift or 1.0)])

    def _first_step(self, y: Array, slope: Array, scale: Array, whole: float) -> float:
        """A rough first step (Hairer, Nørsett, Wanner, II.4)."""
        size = self.atol * scale + self.rtol * np.abs(y)
        d0, d1 = (float(np.sqrt(np.mean((part / size) ** 2))) for part in (y, slope))
        step = 0.01 * d0 / d1 if d0 > 1e-5 and d1 > 1e-5 else 1e-6 * whole
        return min(step, 0.1 * whole)

    def _check_determined(self) -> None:
        """Refuse a free motion of bodies without mass."""
        system = self.system
        if too_large(system) or not any(body.massless for body in system.mechanism.bodies):
            return
        motions = rank_of(dense(system, self.work)[1]).motions
        if not len(motions):
            return
        length = system.length
        mass = system.mass[: system.coordinates, 0] * np.tile(
            [length**2, length**2, 1.0], system.layout.bodies
        )
        inertia, shapes = np.linalg.eigh((motions * mass) @ motions.T)
        if inertia[0] < NO_INERTIA * max(float(mass.max()), 1e-300):
            moved = np.abs((shapes[:, 0] @ motions).reshape(-1, 3)).max(axis=1)
            name = system.mechanism.bodies[int(moved.argmax())].name
            raise SolveError(
                f"the motion of '{name}' is not determined: it is free and has no mass; give it "
                "mass and inertia, or guide it by a joint",
                name,
            )

    def _check_slope(self, K: Array, t: float) -> None:
        if np.isfinite(K[0]).all():
            return
        unit = self.system.mechanism.units.time
        raise SolveError(
            f"the accelerations at t = {t:.6g} {unit} are no numbers: a load or a law has no value "
            "there; choose laws that have one over the whole time"
        )

    def _stopped(self, found: Solution) -> SolveError:
        """The sentence of a motion that cannot be followed."""
        state = self.state
        unit = self.system.mechanism.units.time
        when = f"t = {state[0]:.6g} {unit}"
        parts = (0.0, 1e-9, 1e-6, 1e-3)
        beyond = np.array([state[0] + part * max(state[0], 1e-6) for part in parts])
        try:
            check_reach(self.system, beyond, {})
        except ModelError as error:
            why = f"the motion ends at {when}: {error}"
            return SolveError(why, error.element, found)
        return SolveError(
            f"the steps vanish at {when}: the loads jump there, grow without bound, or are too "
            "stiff; smooth them, or ask for less accuracy",
            solution=found,
        )

    def _solution(self, status: str) -> Solution:
        n, state = self.system.coordinates, self.state
        times, output, gained = self._kept()
        stats = {
            "steps": int(state[2]),
            "rejected": int(state[3]),
            "careful": int(state[4]),
            "evaluations": int(state[5]),
        }
        found = Solution(
            system=self.system,
            analysis="simulate",
            t=times,
            record=Record([output], len(times), batch=False),
            given=None,
            soft=self.soft,
            notes=self.start.notes if self.start.analysis == "close_loops" else (),
            status=status,
            stats=stats,
            energy=account(self.system, output[:, : 2 * n, 0], gained, self.stops),
            events=tuple(self.occurred),
        )
        return replace(found, notes=(*found.notes, *pulled(found)))
