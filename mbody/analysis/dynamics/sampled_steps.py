"""A step of a motion looked at by samples, where no kernel locates what it meets.

The step is sampled by its polynomial, values and rates; where a sample has another sign than the
one before, or a cubic between two of them reaches beyond zero, the step is run again from its
beginning to trial times until the crossing is closed in.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from mbody.analysis.dynamics.branch_passage import KnownCrossings
from mbody.analysis.dynamics.integration import AT_ONCE, solution_of_records
from mbody.core import tolerances as tol
from mbody.kernels.step_state import DONE, MORE, NEXT, TIME
from mbody.model.driver import DRIVEN
from mbody.model.simulation import Event
from mbody.model.study import Measure
from mbody.quantities import parse
from mbody.solution.measures import measured
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


def values(system: System, measures: list[Measure], t: Array, records: Array) -> Array:
    """Measured quantities (measures, instants) of records (instants, rows, 1)."""
    run = solution_of_records(system, t, records)
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


class SampledSteps:
    """Steps of a motion that are sampled, and what is zero within them.

    `motion`: An `mbody.analysis.dynamics.contact_motion.EventIntegration`.
    `span`: Begin and end of the present step.
    `missed`: Events that vary faster than they were looked at, and how far apart that was.
    """

    def __init__(self, motion: Any) -> None:
        self.motion, self.missed = motion, dict[str, float]()
        self.span = (0.0, 0.0)

    def step(self) -> tuple[int, str]:
        """One step, or one that was refused: the code of the kernel, and the status at an end."""
        m, state = self.motion, self.motion.state
        t = float(state[TIME])
        if t >= m.until:
            return DONE, ""
        saved, h = m.save(), float(state[NEXT])
        end = t + h
        if end >= m.target - m.steps.slack(m.target):  # as the kernel clips it
            h, end = m.target - t, m.target
        self.span = (t, end)
        first, last = np.searchsorted(m.wanted, [t, end], side="right")
        wanted = m.wanted[first:last]
        count = self.count_of(h)
        while True:
            times = self._sample_times(t, h, count, wanted)
            times = np.append(t, np.unique(np.append(times[(times > t) & (times < end)], end)))
            marks = np.union1d(self._marks(times[1:], times), wanted)
            code, records, work_done = m.run_steps(m.target, 1, marks)
            if state[TIME] == t:
                return code, ""
            m.record = records[-1].copy()
            after = m.save()
            found, rising = self._sampled(
                times, np.append(t, marks), np.concatenate([saved.record[None], records])
            )
            if h > 1.5 * (longest := self._longest_from(times[:2], found, rising)):
                m.restore(saved)
                state[NEXT] = longest
                return MORE, ""
            resolved = self._resolved(times, found, rising)
            if resolved and not self._varies_faster(times, found, rising, count):
                break
            m.restore(saved)
            count *= FINER
            if count > MOST_OF_A_STEP:
                state[NEXT] = h / FINER**2
                return MORE, ""
        crossings = self._crossings(saved, times, found, rising)
        together = max(tol.EVENT_TOGETHER * (end - t), tol.TIME_ROUNDING * abs(end))
        cut = _first_end(crossings, together)
        ends = math.inf if cut is None else cut.t
        m.meet_forces(np.append(t, marks), np.concatenate([saved.record[None], records]), ends)
        for n in np.flatnonzero(np.isin(marks, wanted)):
            if marks[n] <= ends:
                m.keep(float(marks[n]), records[n], work_done[n])
        for one in crossings:
            if one.t <= m.first:  # reported by the motion that this one continues
                continue
            late = cut is not None and (one is cut or one.t > cut.t + together)
            if late or isinstance(one.event, Guard):
                continue
            if not m.is_known(one.event, one.t, together):
                m.record_event(one.event, one.t, one.saved.record)
        if cut is None:
            m.restore(after)
            at_end = times[:-3:-1], found[:, ::-1], rising[:, ::-1]
            state[NEXT] = min(state[NEXT], self._longest_from(*at_end))
            return code, ""
        m.restore(cut.saved)
        state[NEXT] = min(state[NEXT], h)
        if isinstance(cut.event, Guard):
            return MORE, m.passed(cut.event)
        m.record_event(cut.event, cut.t, m.record)
        return MORE, m.ended(f"'{cut.event.of}' is zero")

    @property
    def notes(self) -> tuple[str, ...]:
        """Sentences on events that vary faster than they were looked at."""
        unit = self.motion.system.mechanism.units.time
        return tuple(
            f"event '{name}' varies faster than it was looked at, every {apart:.3g} {unit}: its "
            f"crossings are found up to some {0.5 / apart:.3g} in 1 {unit}, others may be missing; "
            "ask for a shorter motion, or for an event that varies less"
            for name, apart in self.missed.items()
        )

    # -- samples ------------------------------------------------------------------------------

    def count_of(self, h: float) -> int:
        """Samples of a step of length h: of a motion with modes, but no events of users,
        independent of its end, so that one that goes on takes the same steps.
        """
        m = self.motion
        if m.has_modes and not m.events:
            return OF_A_STEP
        return max(OF_A_STEP, math.ceil(h / m.apart))

    def _sample_times(self, t: float, h: float, count: int, wanted: Array) -> Array:
        """Times at which a step from t on is sampled."""
        own = wanted[:0] if self.motion.has_modes and not self.motion.events else wanted
        return np.concatenate([t + np.arange(1, count) / count * h, own])

    def _marks(self, wanted: Array, times: Array) -> Array:
        """`wanted` and, where a rate follows from two samples, others beside `times`."""
        if self.motion.carried.all() and not self.motion.guards:
            return wanted
        return np.unique(np.concatenate([wanted, self._second_samples(times)]))

    def _second_samples(self, times: Array) -> Array:
        """Times a little later than `times`, a little earlier than the end of the step."""
        last = self.span[1]
        little = tol.EVENT_SECOND_SAMPLE * (last - self.span[0]) / OF_A_STEP
        return np.where(times + little < last, times + little, times - little)

    def _sampled(self, times: Array, marks: Array, records: Array) -> tuple[Array, Array]:
        """Values and rates (events, times) by records at the marks, the times being among them."""
        m, at = self.motion, np.searchsorted(marks, times)
        every = [*m.events, *m.guards]
        values = m.values_of(list(range(len(every))), marks, records)
        rising = np.empty((len(every), len(times)))
        carried = np.append(m.carried, np.zeros(len(m.guards), dtype=bool))
        if carried.any():
            measures = [m.measures[n] for n in np.flatnonzero(m.carried)]
            interval = (self.span[1] - self.span[0]) / OF_A_STEP
            rising[carried] = rates(m.system, measures, times, records[at], interval)
        if not carried.all():
            own = ~carried
            seconds = np.searchsorted(marks, self._second_samples(times))
            change = values[own][:, seconds] - values[own][:, at]
            interval = marks[seconds] - times
            rising[own] = change / np.where(interval == 0.0, 1.0, interval)
        found, least = values[:, at], m.rounding[:, None]
        # what began at zero is a little more than zero until it leaves that, as events at rest are
        rounding = (np.abs(found) <= least) & (least > 0.0)
        return np.where(rounding, least, found), np.where(rounding, 0.0, rising)

    def _longest_from(self, times: Array, found: Array, rising: Array) -> float:
        """How long a step from the first of two times may be, by values and rates of all that is
        watched (events, …) there: half the time to where det(I − φ′ B) would vanish, where forces
        have a pole, beyond which a step would see them with the other sign.
        """
        m = self.motion
        if not m.has_pole:
            return np.inf
        k = len(m.events) + m.guards.index(Guard("paradox"))
        here, there = found[k, :2]
        rate = (there - here) / (times[1] - times[0])
        if rate >= 0.0:  # as where the contact does not press at the other one
            rate = rising[k, 0]
        until = -float(here / rate) if here > 0.0 > rate else np.inf
        m.pole = float(times[0]) + until
        return 0.5 * until

    def _resolved(self, times: Array, found: Array, rising: Array) -> bool:
        """Whether cubics over two samples show the forces at the one between: loads may swing while
        nothing moves, so that steps know nothing of them.
        """
        m = self.motion
        which = [
            k
            for k, guard in enumerate(m.guards, start=len(m.events))
            if guard.kind in ("open", "slip", "share")
        ]
        g, r, h = found[which], rising[which], times[2:] - times[:-2]
        x = (times[1:-1] - times[:-2]) / h
        low, high, change = g[:, :-2], g[:, 2:], g[:, 2:] - g[:, :-2]
        p, q = h * r[:, :-2], h * r[:, 2:]
        interpolated = low + x * (p + x * (3.0 * change - 2.0 * p - q + x * (p + q - 2.0 * change)))
        error = np.abs(interpolated - g[:, 1:-1])
        distance = np.minimum(np.minimum(low, high), g[:, 1:-1])
        size = np.abs(g).max(axis=1, initial=0.0, keepdims=True)
        allowed = np.maximum(
            tol.CONTACT_RESERVE_UNSEEN * distance, tol.CONTACT_RESERVE_RESOLVED * size
        )
        # what is taken for a little more than zero jumps where it falls below that
        rounding = m.fresh_sizes[np.array(which, dtype=int) - len(m.events), None]
        shifted = (g == rounding) & (rounding > 0.0)
        shifted = shifted[:, :-2] | shifted[:, 1:-1] | shifted[:, 2:]
        return bool((shifted | (error <= allowed)).all())

    def _varies_faster(self, times: Array, found: Array, rising: Array, count: int) -> bool:
        """Whether more samples are to be taken, as an event varies faster than these show; where
        there are as many as a step may have, that is noted.
        """
        events = len(self.motion.events)
        if not events or len(times) < 3:
            return False
        fast = faster_than(times, found[:events], rising[:events])
        if not fast.any():
            return False
        if count <= max(FINER * OF_A_STEP, self.count_of(times[-1] - times[0])):
            return True
        apart = float(np.diff(times).max())
        for n in np.flatnonzero(fast):
            name = self.motion.events[n].name
            self.missed[name] = max(self.missed.get(name, 0.0), apart)
        return False

    # -- zeros --------------------------------------------------------------------------------

    def _crossings(
        self, saved: StepStart, times: Array, found: Array, rising: Array
    ) -> list[LocatedZero]:
        """The zero crossings of a step up to the first that ends it, located, in the order of
        time.
        """
        m, brackets = self.motion, []
        watched: list[Event | Guard] = [*m.events, *m.guards]
        tolerance = tol.EVENT_LOCATED * (self.span[1] - self.span[0])
        for k in np.flatnonzero(may_be_zero(times, found, rising, tolerance)).tolist():
            event = watched[k]
            again = functools.partial(self._again, saved, k)
            t, history, _ = refined(again, (times, found[k], rising[k]), tolerance)
            for n in sign_changes(t, history):
                left, right = ((float(t[e]), float(history[e])) for e in (n, n + 1))
                if event.direction * left[1] <= 0.0:
                    brackets.append((left, right, event))
        crossings, ends = [], math.inf
        for left, right, event in sorted(brackets, key=lambda one: one[0][0]):
            if left[0] > ends:
                break
            if not self._may_close(saved, event, np.array([left[0], right[0]])):
                continue
            one = self._located(saved, event, left, right)
            # what is zero but for rounding where the motion begins crosses nothing
            begins = not isinstance(event, Guard) and one.t <= m.first + tolerance
            if not begins and self._closes(one):
                crossings.append(one)
                ends = min(ends, one.t) if event.stop else ends
        return sorted(crossings, key=lambda one: one.t)

    def _may_close(self, saved: StepStart, event: Event | Guard, times: Array) -> bool:
        """False of a gap well behind an edge from one time to the other: it closes nothing."""
        if not isinstance(event, Guard) or event.kind != "close":
            return True
        m, later = self.motion, times[times > saved.state[TIME]]
        m.restore(saved)
        _, records, _ = m.run_steps(m.target, 1, later)
        before = np.broadcast_to(saved.record, (len(times) - len(later), *saved.record.shape))
        rows = [m.look_at(t, one) for t, one in zip(times, [*before, *records], strict=True)]
        gaps, closing = (
            np.array([part(one)[event.number] for one in rows])
            for part in (m.uni.gaps, m.uni.approach)
        )
        _, between = extrema(
            np.diff(times), *(one[k : k + 1] for one in (gaps, closing) for k in (0, 1))
        )
        nearest = max(gaps.max(), np.nan_to_num(between, nan=-np.inf).max())
        return bool(nearest >= min(-m.gap_tolerance, tol.CONTACT_EDGE_BEHIND * gaps.max()))

    def _closes(self, one: LocatedZero) -> bool:
        """Whether a gap that closes does so within the ends of its edge: what comes round an end
        from behind closes none, nor does what touches on its way and goes away by itself, as the
        end of an arc on which a disc slides.
        """
        if not isinstance(one.event, Guard) or one.event.kind != "close":
            return True
        m, number, record = self.motion, one.event.number, one.saved.record
        rows = m.look_at(one.t, record)
        if m.uni.gaps(rows)[number] < -m.gap_tolerance:
            return False
        pull = float(m.uni.pulls(rows, number, record[2 * m.system.coordinates :, 0]).sum())
        overlap = tol.GUARD_ROUNDING_GAP * m.system.length
        if 0.0 < m.uni.approach(rows)[number] ** 2 <= 2.0 * overlap * pull:
            return False
        within = m.uni.within_edges(
            rows, m.probe, m.gap_tolerance, tol.RATE_NONE_FRICTION * m.speeds
        )
        return bool(within[number])

    def _again(self, saved: StepStart, k: int, times: Array) -> tuple[Array, Array]:
        """Values and rates of one event at further times of a step."""
        order = np.argsort(times, kind="stable")
        marks = self._marks(times[order], times)
        self.motion.restore(saved)
        _, records, _ = self.motion.run_steps(self.motion.target, 1, marks)
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
        m = self.motion
        which = [*m.events, *m.guards].index(event)

        def value(t: float, within: bool) -> float:
            m.restore(saved)
            # steps of one length have another error where they are cut
            until, steps = (m.target, 1) if within else (t, AT_ONCE)
            code, records, _ = m.run_steps(until, steps, np.array([t]))
            if code != DONE and not within:
                raise m.stopped(m.solution(""), code)
            m.record = records[-1].copy()
            return float(m.values_of([which], np.array([t]), records)[0, 0])

        tolerance = tol.EVENT_LOCATED * float(saved.state[NEXT])
        t = bracketed_root(lambda t: value(t, m.steps.fixed), left, right, tolerance)
        value(t, within=False)
        return LocatedZero(t, event, m.save())


def _first_end(crossings: list[LocatedZero], together: float) -> LocatedZero | None:
    """The first crossing that ends a step; an event that ends the motion comes before the change of
    modes that it meets, behind which it would begin at zero and be no crossing.
    """
    ends = [one for one in crossings if one.event.stop]
    if not ends:
        return None
    own = (one for one in ends if not isinstance(one.event, Guard))
    return next((one for one in own if one.t <= ends[0].t + together), ends[0])
