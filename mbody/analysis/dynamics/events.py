"""Motion over time with events: zero crossings are located.

Every step is sampled by its polynomial, values and rates; where a sample has another sign than the
one before, or a cubic between two of them reaches beyond zero, the step is run again from its
beginning to trial times until the crossing is closed in.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable
from dataclasses import dataclass, fields
from typing import Any, ClassVar

import numpy as np

from mbody.analysis.driven.contact_report import OneSidedForce, one_sided, one_sided_force
from mbody.analysis.dynamics.branch_passage import KnownCrossings
from mbody.analysis.dynamics.integration import AT_ONCE, Integration, StepTaker
from mbody.analysis.initial.initial_state import event_measure
from mbody.core import tolerances as tol
from mbody.kernels.step_state import DELIVERED, DONE, EVALUATIONS, MORE, NEXT, TIME, Outputs
from mbody.model.driver import DRIVEN
from mbody.model.simulation import Event
from mbody.model.study import Measure
from mbody.quantities import parse
from mbody.solution.histories import EventRecord, Record, reported_certificate, with_fields
from mbody.solution.measures import measured
from mbody.solution.solution import IntegrationSettings, Solution
from mbody.system.system import System

# -- Zero crossings between samples, by values and rates ---------------------------------------
# Two crossings between two samples leave no change of sign, but an extremum, and its place is where
# the rate changes its sign: a cubic through values and rates of both ends (Hermite's) tells it.

Array = np.ndarray
#: Times, values and rates of one quantity, ascending.
Samples = tuple[Array, Array, Array]

#: Rounds in which samples are added; places converge quadratically, so that few are used.
ROUNDS = 12


def extrema(h: Array, a: Array, b: Array, da: Array, db: Array) -> tuple[Array, Array]:
    """Where cubics are extreme within their intervals: parts of these (2, intervals), and the
    values there; NaN where there is none. `h`, `a`, `b`, `da`, `db` (intervals,): lengths, and
    values and rates at both ends.

    >>> x, value = extrema(*np.array([[2.0], [0.1], [0.1], [-1.0], [1.0]]))
    >>> x[:, 0], value[:, 0]
    (array([0.5, nan]), array([-0.4,  nan]))
    """
    with np.errstate(all="ignore"):
        p, q, d = h * da, h * db, b - a
        # the derivative p + 2 (3d − 2p − q) x + 3 (p + q − 2d) x², its roots by the stable formula
        half, square = 3.0 * d - 2.0 * p - q, 3.0 * (p + q - 2.0 * d)
        root = np.sqrt(half * half - square * p)
        w = -(half + np.copysign(root, half))
        x = np.array([w / square, p / w])
        x[0] = np.where(square == 0.0, np.nan, x[0])
        x[~((x > 0.0) & (x < 1.0))] = np.nan
        x = np.sort(x, axis=0)
        value = a + x * (p + x * (half + (square / 3.0) * x))
    return x, value


def _hidden(samples: Samples, tolerance: float, unsure: Any) -> tuple[Array, Array, Array]:
    """Extrema of cubics (2, …, intervals), as `extrema` has them, and which of them may hide a zero
    between two samples of the same sign, or two beside the one that the samples show.
    """
    t, g, r = samples
    h, a, b = np.diff(t), g[..., :-1], g[..., 1:]
    places, predicted = extrema(h, a, b, r[..., :-1], r[..., 1:])
    # what lies between both ends, on their side of zero, hides nothing
    low, high = np.minimum(a, b), np.maximum(a, b)
    deep = 1.0 - tol.EVENT_EXTREMUM_SHALLOW
    beyond = ((predicted < deep * low) & (low > 0.0) & (predicted < unsure)) | (
        (predicted > deep * high) & (high < 0.0) & (-predicted < unsure)
    )
    # of ends on both sides, what goes back across zero on its way
    back = (low <= 0.0) & (high >= 0.0) & ((predicted < low) | (predicted > high))
    inner = (
        (places > tol.EVENT_EXTREMUM_END)
        & (places < 1.0 - tol.EVENT_EXTREMUM_END)
        & (h > tolerance)
        & (beyond | back)
    )
    return places, predicted, inner


def may_be_zero(t: Array, g: Array, r: Array, tolerance: float) -> Array:
    """Which of many functions (functions,) have a zero, or an extremum that may hide one: times
    (instants,), values and rates (functions, instants), and `tolerance` as in `refined`.
    """
    hides = _hidden((t, g, r), tolerance, np.inf)[2].any(axis=(0, -1))
    return np.asarray(hides | _changes_sign(g).any(axis=-1))


def refined(
    sample: Callable[[Array], tuple[Array, Array]], samples: Samples, tolerance: float
) -> Samples:
    """Samples with extrema added, until no cubic between two of them reaches beyond zero without
    a sample there.
    """
    t, g, r = samples
    fresh = np.ones(len(t) - 1, dtype=bool)  # intervals that are still to be looked at
    unsure = np.full(len(t) - 1, np.inf)
    for _ in range(ROUNDS):
        places, predicted, inner = _hidden((t, g, r), tolerance, unsure)
        inner &= fresh
        if not inner.any():
            break
        row, column = np.nonzero(inner)
        times = t[column] + places[row, column] * np.diff(t)[column]
        values, rates = sample(times)
        error = np.abs(values - predicted[row, column])
        order = np.argsort(times, kind="stable")
        at = np.searchsorted(t, times[order])
        fresh = np.zeros(len(t) + len(times) - 1, dtype=bool)
        bound = np.zeros_like(fresh, dtype=float)
        t = np.insert(t, at, times[order])
        g = np.insert(g, at, values[order])
        r = np.insert(r, at, rates[order])
        for k, off in zip(at + np.arange(len(at)), error[order], strict=True):
            fresh[k - 1 : k + 1] = True
            bound[k - 1 : k + 1] = np.maximum(bound[k - 1 : k + 1], tol.EVENT_EXTREMUM_UNSURE * off)
        unsure = bound
    return t, g, r


def sign_changes(t: Array, g: Array) -> list[int]:
    """Numbers of the intervals whose ends lie on two sides of zero, or end at it."""
    return np.flatnonzero(_changes_sign(g)).tolist()


def _changes_sign(g: Array) -> Array:
    a, b = g[..., :-1], g[..., 1:]
    return np.asarray(((a > 0.0) & (b <= 0.0)) | ((a < 0.0) & (b >= 0.0)))


def bracketed_root(
    value: Callable[[float], float],
    left: tuple[float, float],
    right: tuple[float, float],
    tolerance: float,
) -> float:
    """A zero between two places of opposite signs, (x, value) each, to `tolerance`; never many more
    steps than bisection.

    Oliveira, Takahashi: An enhancement of the bisection method average performance preserving
    minmax optimality (2021), the method ITP.

    >>> round(bracketed_root(lambda x: x * x - 2.0, (1.0, -1.0), (2.0, 2.0), 1e-12), 11)
    1.41421356237
    """
    (a, fa), (b, fb) = left, right
    if fb == 0.0:
        return b
    tolerance = max(tolerance, 4.0 * math.ulp(max(abs(a), abs(b))))
    slack = tolerance * 2.0 ** (math.ceil(math.log2(max((b - a) / (2.0 * tolerance), 1.0))) + 1)
    blunt = 0.2 / (b - a)
    while b - a > 2.0 * tolerance:
        middle, half = 0.5 * (a + b), 0.5 * (b - a)
        straight = (b * fa - a * fb) / (fa - fb)
        sign, off = math.copysign(1.0, middle - straight), blunt * (b - a) ** 2
        x = straight + sign * off if off <= abs(middle - straight) else middle
        if abs(x - middle) > slack - half:
            x = middle - sign * (slack - half)
        here = value(x)
        if here == 0.0:
            return x
        if (here > 0.0) == (fa > 0.0):
            a, fa = x, here
        else:
            b, fb = x, here
        slack *= 0.5
    return min(max((b * fa - a * fb) / (fa - fb), a), b)


#: Part of what a function changes over a step by which a sample may be off the cubic through its
#: neighbours; how much faster than that change it may rise between two samples; and how many of the
#: samples may do so.
OFF_CUBIC, RISES, MANY = 0.3, 4.0, 0.1


def faster_than(t: Array, g: Array, r: Array) -> Array:
    """Which functions vary faster than their samples show, (functions,): values and rates
    (functions, times). At a jump two samples are off, which is no fast function.

    >>> t = np.linspace(0.0, 1.0, 9)
    >>> w = np.array([[3.0], [60.0], [16.0 * np.pi]])
    >>> faster_than(t, np.sin(w * t), w * np.cos(w * t))
    array([False,  True,  True])
    """
    before, after = t[1:-1] - t[:-2], t[2:] - t[1:-1]
    h = before + after
    x = before / h
    a, b = g[:, :-2], g[:, 2:]
    p, q = h * r[:, :-2] - (b - a), h * r[:, 2:] - (b - a)
    predicted = a + x * (b - a) + x * (1.0 - x) * ((1.0 - x) * p - x * q)
    change = np.ptp(g, axis=1)[:, None]
    off = np.abs(g[:, 1:-1] - predicted) > OFF_CUBIC * change
    rises = np.abs(r[:, 1:-1]) * np.minimum(before, after) > RISES * change
    return np.asarray((off | rises).sum(axis=1) > max(2.0, MANY * off.shape[1]))


# -- Quantities that events are of, and their rates, along a motion ----------------------------

#: Quantities of a motion that positions, velocities and accelerations carry on.
CARRIED = {"x", "y", "angle", "vx", "vy", "omega", *DRIVEN}


def motion_at(system: System, t: Array, records: Array) -> Solution:
    """Records (instants, rows, 1) of a motion as a solution."""
    return Solution(system, "simulate", t, Record([records], len(t), batch=False), None)


def values(system: System, measures: list[Measure], t: Array, records: Array) -> Array:
    """Measured quantities (measures, instants) of records (instants, rows, 1)."""
    run = motion_at(system, t, records)
    return np.array([measured(run, measure)[0] for measure in measures]).reshape(-1, len(t))


def has_exact_rates(measure: Measure) -> bool:
    """Whether a quantity is made of positions, velocities and laws of time alone."""
    names = parse(measure.of).names
    return all(name.rpartition(".")[2] in CARRIED for name in names if "." in name)


def rates(system: System, measures: list[Measure], t: Array, records: Array, step: float) -> Array:
    """Rates (measures, instants) of quantities that are `has_exact_rates`, `step` being the time
    between samples: central differences along velocities and accelerations.
    """
    n, moment = system.coordinates, tol.EVENT_RATE_STEP * step
    q, v, a = (records[:, k * n : (k + 1) * n] for k in range(3))
    shifted = np.concatenate([records, records])
    middle = q + 0.5 * moment * moment * a
    shifted[:, :n] = np.concatenate([middle + moment * v, middle - moment * v])
    shifted[:, n : 2 * n] = np.concatenate([v + moment * a, v - moment * a])
    times = np.concatenate([t + moment, t - moment])
    found = values(system, measures, times, shifted).reshape(len(measures), 2, -1)
    return np.asarray((found[:, 0] - found[:, 1]) / (2.0 * moment))


# -- Location of events along a motion, and checkpoints of steps -------------------------------


@dataclass(frozen=True, eq=False)
class StepStart:
    """State from which a step is repeated."""

    y: Array
    K: Array
    P: Array
    state: Array
    record: Array
    total: Array
    near: Array
    own: tuple[Array, ...]
    passage: KnownCrossings


@dataclass(frozen=True)
class Guard:
    """A function that stays positive as long as a mode of a contact holds.

    Attributes
    ----------
    kind : str
        "close", "lock", "open", "edge", "enter", "slip", "share", "stop" or "paradox".
    number : int
        Of what it guards.
    """

    kind: str
    number: int = 0
    direction: ClassVar[int] = -1
    stop: ClassVar[bool] = True


@dataclass(frozen=True, eq=False)
class LocatedZero:
    """A zero that was located, and the motion there."""

    t: float
    event: Event | Guard
    saved: StepStart


#: Samples of a step, and of the whole motion, at least.
OF_A_STEP, OF_ALL = 4, 400
#: Where these do not resolve what is watched they become so many times more, up to so many a step,
#: which is made shorter then.
FINER, MOST_OF_A_STEP = 4, 4**8
#: What is noted of contacts and ropes.
FORCES = tuple(part.name for part in fields(OneSidedForce))


class EventIntegration(Integration):
    """Integrates one system and locates events."""

    def __init__(
        self,
        system: System,
        start: Solution,
        settings: IntegrationSettings,
        events: tuple[Event, ...],
    ) -> None:
        super().__init__(system, start, settings)
        self.events = list(events)
        self.measures = [event_measure(system.mechanism, event) for event in self.events]
        #: What each of `stops` has gained by impacts, below zero.
        self.lost = np.zeros(len(self.stops))
        self.total = np.zeros(self.causes)
        carried = [has_exact_rates(measure) for measure in self.measures]
        self.carried = np.array(carried, dtype=bool)
        self.sided = one_sided(system)
        self.forces: dict[str, list[OneSidedForce]] = {one.name: [] for one in self.sided}
        #: Events that vary faster than they were looked at, and how far apart that was.
        self.missed: dict[str, float] = {}

    @property
    def guards(self) -> list[Guard]:
        """What is located besides, as guards of contacts are."""
        return []

    # -- the motion ---------------------------------------------------------------------------

    def _integrate(self, times: Array, progress: Callable[[float], None] | None) -> tuple[int, str]:
        self.wanted, self.instants = times, list[float]()
        self.records, self.works = list[Array](), list[Array]()
        if times[0] <= self.first:
            self._keep(self.first, self.record, self.total)
        self.total = self.initial_work.copy()
        self._begin()
        code, status = MORE, ""
        while code == MORE and not status:
            code, status = self._step()
            self._check_progress()
            if progress is not None:
                progress(float(self.state[TIME]))
        return (MORE if status else code), status or "completed"

    def _begin(self) -> None:
        """Before the first step, the first instant being kept."""

    def _kept_instants(self) -> tuple[Array, Array, Array]:
        count = len(self.instants)
        return (
            np.array(self.instants),
            np.array(self.records).reshape(count, self.rows, 1),
            np.array(self.works).reshape(count, self.causes + len(self.stops)),
        )

    def _keep_now(self) -> None:
        if self.instants:
            self.restart_point = None if self.stops else self._restart_state(self.total)
            self._keep(float(self.state[TIME]), self.record, self.total)

    def _keep(self, t: float, record: Array, work: Array) -> None:
        """Keep an instant; once, the last state of it."""
        if self.instants and self.instants[-1] == t:
            for kept in (self.instants, self.records, self.works):
                kept.pop()
        self.instants.append(t)
        self.records.append(record.copy())
        self.works.append(np.concatenate([work, self.lost]))

    def _save(self) -> StepStart:
        parts = (self.y, self.K[0], self.P[0], self.state, self.record, self.total, self.work.near)
        y, K, P, state, record, total, near = (part.copy() for part in parts)
        own = tuple(part.copy() for part in self.steps.own)
        return StepStart(y, K, P, state, record, total, near, own, self.passage.known)

    def _restore(self, saved: StepStart) -> None:
        """Go back, or ahead; the count of evaluations goes on."""
        evaluations = self.state[EVALUATIONS]
        self.y[:], self.K[0], self.P[0], self.state[:] = saved.y, saved.K, saved.P, saved.state
        self.record, self.total = saved.record.copy(), saved.total.copy()
        self.work.near[:], self.passage.known = saved.near, saved.passage
        for part, was in zip(self.steps.own, saved.own, strict=True):
            part[:] = was
        self.state[EVALUATIONS] = evaluations

    def _run(
        self, until: float, steps: int, times: Array, take: StepTaker | None = None
    ) -> tuple[int, Array, Array]:
        """Steps of the kernel: its code, records and work at the times; `take` as of `_advance`."""
        output = np.empty((len(times), self.rows, 1))
        work_done = np.zeros((len(times) + 1, self.causes))
        work_done[-1], self.state[DELIVERED] = self.total, 0.0
        outputs = Outputs(times=times, pages=output, work=work_done)
        code = self._advance(until, steps, outputs, take)
        self.total = work_done[-1].copy()
        return code, output, work_done

    def _step(self) -> tuple[int, str]:
        """One step, or one that was refused: the code of the kernel, and the status at an end."""
        state = self.state
        t = float(state[TIME])
        if t >= self.until:
            return DONE, ""
        if t >= self.target and (t := self._pass_set_time(t)) >= self.until:
            return DONE, ""
        saved, h = self._save(), float(state[NEXT])
        end = t + h
        if end >= self.target - self.steps.slack(self.target):  # as the kernel clips it
            h, end = self.target - t, self.target
        self.step = (t, end)
        first, last = np.searchsorted(self.wanted, [t, end], side="right")
        wanted = self.wanted[first:last]
        count = self._sample_count(h)
        while True:
            times = self._sample_times(t, h, count, wanted)
            times = np.append(t, np.unique(np.append(times[(times > t) & (times < end)], end)))
            marks = np.union1d(self._marks(times[1:], times), wanted)
            code, records, work_done = self._run(self.target, 1, marks)
            if state[TIME] == t:
                return code, ""
            self.record = records[-1].copy()
            after = self._save()
            found, rising = self._sampled(
                times, np.append(t, marks), np.concatenate([saved.record[None], records])
            )
            if h > 1.5 * (longest := self._longest_from(times[:2], found, rising)):
                self._restore(saved)
                state[NEXT] = longest
                return MORE, ""
            resolved = self._resolved(times, found, rising)
            if resolved and not self._varies_faster(times, found, rising, count):
                break
            self._restore(saved)
            count *= FINER
            if count > MOST_OF_A_STEP:
                state[NEXT] = h / FINER**2
                return MORE, ""
        crossings = self._crossings(saved, times, found, rising)
        together = max(tol.EVENT_TOGETHER * (end - t), tol.TIME_ROUNDING * abs(end))
        cut = _first_end(crossings, together)
        self._record_forces(np.append(t, marks), np.concatenate([saved.record[None], records]), cut)
        for n in np.flatnonzero(np.isin(marks, wanted)):
            if cut is None or marks[n] <= cut.t:
                self._keep(float(marks[n]), records[n], work_done[n])
        for one in crossings:
            if one.t <= self.first:  # reported by the motion that this one continues
                continue
            late = cut is not None and (one is cut or one.t > cut.t + together)
            if late or isinstance(one.event, Guard):
                continue
            if not self._is_known(one.event, one.t, together):
                self._record(one.event, one.t, one.saved.record)
        if cut is None:
            self._restore(after)
            at_end = times[:-3:-1], found[:, ::-1], rising[:, ::-1]
            state[NEXT] = min(state[NEXT], self._longest_from(*at_end))
            return code, ""
        self._restore(cut.saved)
        state[NEXT] = min(state[NEXT], h)
        if isinstance(cut.event, Guard):
            return MORE, self._passed(cut.event)
        self._record(cut.event, cut.t, self.record)
        return MORE, self._ended(f"'{cut.event.of}' is zero")

    def _is_known(self, event: Event, t: float, together: float) -> bool:
        """Whether a crossing was recorded beside the change of modes that ended the last step."""
        own = (one for one in self.occurred if one.name == event.name and not one.contact)
        return any(abs(one.t - t) <= together for one in own)

    def _pass_set_time(self, t: float) -> float:
        """Do what is due at a set time, or just after it where rates of drivers jump; the time from
        which it goes on.
        """
        self._interrupt(t)
        now = float(self.state[TIME])
        if now > t and now in self.wanted:
            self._keep(now, self.record, self.total)
        if now >= self.until:
            self.restart_point = self._restart_state(self.total)
        return now

    @property
    def _gained(self) -> Array:
        return self.total

    def _passed(self, guard: Guard) -> str:
        """Go on from where a guard is zero; a status where the motion ends there."""
        raise NotImplementedError

    def _sample_count(self, h: float) -> int:
        """Samples of a step of length h."""
        return max(OF_A_STEP, math.ceil(OF_ALL * h / (self.until - self.first)))

    def _sample_times(self, t: float, h: float, count: int, wanted: Array) -> Array:
        """Times at which a step from t on is sampled."""
        return np.concatenate([t + np.arange(1, count) / count * h, wanted])

    def _longest_from(self, times: Array, found: Array, rising: Array) -> float:
        """How long a step from the first of two times may be, by values and rates of all that is
        watched (events, …) there.
        """
        return math.inf

    def _resolved(self, times: Array, found: Array, rising: Array) -> bool:
        """Whether samples, values and rates (events, times), are near enough to each other."""
        return True

    def _varies_faster(self, times: Array, found: Array, rising: Array, count: int) -> bool:
        """Whether more samples are to be taken, as an event varies faster than these show; where
        there are as many as a step may have, that is noted.
        """
        events = len(self.events)
        if not events or len(times) < 3:
            return False
        fast = faster_than(times, found[:events], rising[:events])
        if not fast.any():
            return False
        if count <= max(FINER * OF_A_STEP, self._sample_count(times[-1] - times[0])):
            return True
        apart = float(np.diff(times).max())
        for n in np.flatnonzero(fast):
            name = self.events[n].name
            self.missed[name] = max(self.missed.get(name, 0.0), apart)
        return False

    def _solution(self, status: str) -> Solution:
        """With notes of events that vary faster than they were looked at."""
        found = super()._solution(status)
        if not self.missed:
            return found
        unit = self.system.mechanism.units.time
        notes = (
            f"event '{name}' varies faster than it was looked at, every {apart:.3g} {unit}: its "
            f"crossings are found up to some {0.5 / apart:.3g} in 1 {unit}, others may be missing; "
            "ask for a shorter motion, or for an event that varies less"
            for name, apart in self.missed.items()
        )
        return with_fields(found, notes=(*reported_certificate(found).notes, *notes))

    def _values(self, which: list[int], t: Array, records: Array) -> Array:
        """Values (events, instants) of some of the events."""
        return values(self.system, [self.measures[n] for n in which], t, records)

    def _record_forces(self, marks: Array, records: Array, cut: LocatedZero | None) -> None:
        """Record the forces of contacts and ropes over a step, within the output instants."""
        if not self.sided:
            return
        last = float(self.wanted[-1]) if cut is None else min(cut.t, float(self.wanted[-1]))
        inside = (marks >= self.wanted[0]) & (marks <= last)
        if not inside.any():
            return
        run = motion_at(self.system, marks[inside], records[inside])
        for one in self.sided:
            self.forces[one.name].append(one_sided_force(run, one))

    def _between(self) -> dict[str, OneSidedForce]:
        found = {}
        for name, parts in self.forces.items():
            if parts:
                whole = {k: np.concatenate([getattr(p, k) for p in parts]) for k in FORCES}
                found[name] = OneSidedForce(**whole)
        return found

    def _record(self, event: Event, t: float, record: Array) -> None:
        self.occurred.append(EventRecord(event.name, t, self._instant(t, record)))

    def _instant(self, t: float, instant: Array) -> Solution:
        """A record as a solution of one instant."""
        record = Record([instant[None].copy()], 1, batch=False)
        return Solution(
            self.system, "simulate", np.array([t]), record, None, regularization=self.regularization
        )

    def _ended(self, why: str) -> str:
        """Keep the last instant; the status of a motion that ends there."""
        t, self.restart_point = float(self.state[TIME]), None
        self._keep(t, self.record, self.total)
        return f"ended: at t = {t:.6g} {self.system.mechanism.units.time}, {why}"

    # -- zeros --------------------------------------------------------------------------------

    def _marks(self, wanted: Array, times: Array) -> Array:
        """`wanted` and, where a rate follows from two samples, others beside `times`."""
        if self.carried.all() and not self.guards:
            return wanted
        return np.unique(np.concatenate([wanted, self._second_samples(times)]))

    def _second_samples(self, times: Array) -> Array:
        """Times a little later than `times`, a little earlier than the end of the step."""
        last = self.step[1]
        little = tol.EVENT_SECOND_SAMPLE * (last - self.step[0]) / OF_A_STEP
        return np.where(times + little < last, times + little, times - little)

    def _sampled(self, times: Array, marks: Array, records: Array) -> tuple[Array, Array]:
        """Values and rates (events, times) by records at the marks, the times being among them."""
        at = np.searchsorted(marks, times)
        every = [*self.events, *self.guards]
        found = self._values(list(range(len(every))), marks, records)
        rising = np.empty((len(every), len(times)))
        carried = np.append(self.carried, np.zeros(len(self.guards), dtype=bool))
        if carried.any():
            measures = [self.measures[n] for n in np.flatnonzero(self.carried)]
            interval = (self.step[1] - self.step[0]) / OF_A_STEP
            rising[carried] = rates(self.system, measures, times, records[at], interval)
        if not carried.all():
            own = ~carried
            seconds = np.searchsorted(marks, self._second_samples(times))
            change = found[own][:, seconds] - found[own][:, at]
            interval = marks[seconds] - times
            rising[own] = change / np.where(interval == 0.0, 1.0, interval)
        return found[:, at], rising

    def _crossings(
        self, saved: StepStart, times: Array, found: Array, rising: Array
    ) -> list[LocatedZero]:
        """The zero crossings of a step up to the first that ends it, located, in the order of
        time.
        """
        brackets = []
        watched: list[Event | Guard] = [*self.events, *self.guards]
        tolerance = tol.EVENT_LOCATED * (self.step[1] - self.step[0])
        for k in np.flatnonzero(may_be_zero(times, found, rising, tolerance)).tolist():
            event = watched[k]
            again = functools.partial(self._again, saved, k)
            t, history, _ = refined(again, (times, found[k], rising[k]), tolerance)
            for n in sign_changes(t, history):
                left, right = ((float(t[m]), float(history[m])) for m in (n, n + 1))
                if event.direction * left[1] <= 0.0:
                    brackets.append((left, right, event))
        crossings, ends = [], math.inf
        for left, right, event in sorted(brackets, key=lambda one: one[0][0]):
            if left[0] > ends:
                break
            if not self._may_count(saved, event, np.array([left[0], right[0]])):
                continue
            one = self._located(saved, event, left, right)
            # what is zero but for rounding where the motion begins crosses nothing
            begins = not isinstance(event, Guard) and one.t <= self.first + tolerance
            if self._counts(one) and not begins:
                crossings.append(one)
                ends = min(ends, one.t) if event.stop else ends
        return sorted(crossings, key=lambda one: one.t)

    def _may_count(self, saved: StepStart, event: Event | Guard, times: Array) -> bool:
        """Whether a zero between two times can be an event."""
        return True

    def _counts(self, one: LocatedZero) -> bool:
        """Whether what is zero there is an event."""
        return True

    def _again(self, saved: StepStart, k: int, times: Array) -> tuple[Array, Array]:
        """Values and rates of one event at further times of a step."""
        order = np.argsort(times, kind="stable")
        marks = self._marks(times[order], times)
        self._restore(saved)
        _, records, _ = self._run(self.target, 1, marks)
        found, rising = self._sampled(times[order], marks, records)
        back = np.argsort(order, kind="stable")
        return found[k][back], rising[k][back]

    def _located(
        self,
        saved: StepStart,
        event: Event | Guard,
        left: tuple[float, float],
        right: tuple[float, float],
    ) -> LocatedZero:
        """The crossing between two times at which the value is known."""
        which = [*self.events, *self.guards].index(event)

        def value(t: float, within: bool) -> float:
            self._restore(saved)
            # steps of one length have another error where they are cut
            until, steps = (self.target, 1) if within else (t, AT_ONCE)
            code, records, _ = self._run(until, steps, np.array([t]))
            if code != DONE and not within:
                raise self._stopped(self._solution(""), code)
            self.record = records[-1].copy()
            return float(self._values([which], np.array([t]), records)[0, 0])

        tolerance = tol.EVENT_LOCATED * float(saved.state[NEXT])
        t = bracketed_root(lambda t: value(t, self.steps.fixed), left, right, tolerance)
        value(t, within=False)
        return LocatedZero(t, event, self._save())


def _first_end(crossings: list[LocatedZero], together: float) -> LocatedZero | None:
    """The first crossing that ends a step; an event that ends the motion comes before the change of
    modes that it meets, behind which it would begin at zero and be no crossing.
    """
    ends = [one for one in crossings if one.event.stop]
    if not ends:
        return None
    own = (one for one in ends if not isinstance(one.event, Guard))
    return next((one for one in own if one.t <= ends[0].t + together), ends[0])


# -- Forces that jump at set times, as of inputs and corners of tables: modes are decided anew -


class JumpIntegration(EventIntegration):
    """Looks at guards where forces have jumped: no sign change is found there."""

    #: The status of a motion that ended where forces jumped.
    ending = ""

    def settle_jump(self) -> str:
        """Decide the modes anew where forces have jumped beyond what the present ones allow; a
        status where the motion ends.
        """
        raise NotImplementedError

    def _interrupt(self, t: float) -> None:
        super()._interrupt(t)
        if self.guards and not self.ending:  # the first modes follow later
            self.ending = self.settle_jump()

    def _step(self) -> tuple[int, str]:
        if self.target <= (t := float(self.state[TIME])) < self.until:
            self._pass_set_time(t)
        return (MORE, self.ending) if self.ending else super()._step()
