"""The stretches of a motion between changes of modes, as a run of `simulate` meets them."""

from __future__ import annotations

import copy
import functools
import itertools
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from typing import Any, NamedTuple

import numpy as np

from mbody.analysis.contact.unilateral import has_modes
from mbody.analysis.dynamics.active_modes import ActiveModes
from mbody.analysis.dynamics.integration import Integration
from mbody.analysis.dynamics.interruptions import Interruptions
from mbody.analysis.initial.initial_state import state_of
from mbody.core import tolerances as tol
from mbody.core.bundle import Bundle
from mbody.core.lanes import DualNumber
from mbody.kernels.advance import (
    BEGUN,
    COLLISION,
    DECIDED,
    FOUND,
    IMPACT,
    PASSED,
    SETTLING,
    UNBROKEN,
)
from mbody.kernels.complementarity import CONE, law_sizes
from mbody.kernels.contact_guards import LIFT, PARADOX, SHARE, SLIP
from mbody.kernels.contact_impacts import RESTED
from mbody.kernels.contact_modes import SEVERAL
from mbody.kernels.friction import ARMS
from mbody.kernels.layout import Layout
from mbody.kernels.mode_problem import ALL_NORMALS, ALL_ROWS
from mbody.kernels.step_state import TIME
from mbody.laws import Expression, Law, MeasuredFormula, Table
from mbody.laws.kernels import MAX, SIGN, STEP
from mbody.model.element import listed
from mbody.model.loads import Damper, Spring, TorsionDamper, TorsionSpring
from mbody.model.model_notes import with_changed
from mbody.solution.solution import Solution
from mbody.system.assembler import assemble
from mbody.system.system import System, with_numbers_of

# -- Jumps of formulas along a motion: zeros of the arguments of `sign` and `step` -------------
# Between two jumps each such function is held at the side on which its argument is, so that the
# motion is smooth there; where an argument is zero the derivatives change as at every change of
# modes (`mbody.derivatives.dual_walk`). Corners, of `abs`, `min` and `max`, leave forces as they
# are: they change nothing there.

Array = np.ndarray

#: Why there is no derivative while joints slide, and after an impact.
OPEN_FORCES = "no equation decides the forces of redundant joints on which friction depends"
OPEN_IMPULSES = "no equation decides the impulses on which friction of joints depends"


@dataclass(frozen=True)
class JumpGuard:
    """The argument of functions that jump where it is zero.

    `number`: Its place among the numbers of the formulas.
    `size`: Its greatest value along the motion.
    """

    number: int
    size: float


def arguments(layout: Layout) -> list[int]:
    """The places of all numbers of which there is a sign or a step."""
    steps = layout.formula_step
    jumping = np.isin(steps[:, 0], (SIGN, STEP)) if len(steps) else np.zeros(0, dtype=bool)
    return [int(place) for place in np.unique(steps[jumping, 1])] if jumping.any() else []


def without_functions(
    layout: Layout, sides: Mapping[int, float]
) -> tuple[Layout, dict[int, float]]:
    """The layout without the functions of these arguments, and what their values are on the sides,
    1 or −1, on which the arguments are, by place.
    """
    steps, values = layout.formula_step.copy(), dict[int, float]()
    for n, (code, a, _, place) in enumerate(layout.formula_step):
        if code in (SIGN, STEP) and int(a) in sides:
            side = sides[int(a)]
            values[int(place)] = side if code == SIGN else max(side, 0.0)
            # the greater one of a number and itself: a step that changes nothing
            steps[n] = MAX, a, a, a
    return layout.replaced(formula_step=steps), values


# -- Laws and loads that may jump along a motion, followed as formulas or not ------------------

#: Functions of formulas that jump.
JUMPING = re.compile(r"\b(?:sign|step)\s*\(")
#: Functions of formulas with corners, at which accelerations of what is driven jump.
CORNERED = re.compile(r"\b(?:sign|step|abs|min|max|clamp|deadband)\s*\(")
#: Loads whose own law is of a stretch, an angle or a rate that formulas of the instant have.
OF_STRETCH = (Spring, Damper, TorsionSpring, TorsionDamper)


def with_formulas_of_the_instant(system: System) -> System:
    """The system in which laws of loads that jump are formulas of the instant, whose jumps are
    followed; the same where there are none.
    """
    replaced = []
    for load in system.mechanism.loads:
        made: dict[str, Any] = {}
        for name, law in _laws(load).items():
            of_time = load.__dataclass_fields__[name].metadata.get("of") == "time"
            known = of_time or isinstance(load, OF_STRETCH)
            if known and isinstance(law, Expression) and JUMPING.search(law.text):
                made[name] = MeasuredFormula(law.text, *law.postfix("t" if of_time else "x"))
        if made:
            replaced.append(replace(load, **made))
    if not replaced:
        return system
    return with_numbers_of(assemble(with_changed(system.mechanism, replaced, ())), system.values)


def _laws(element: Any) -> dict[str, Law]:
    """The laws of an element by field."""
    found = {part.name: getattr(element, part.name) for part in fields(element)}
    return {name: law for name, law in found.items() if isinstance(law, Law)}


def unfollowed_jumps(system: System, values: Mapping[str, Any]) -> dict[str, Array | bool]:
    """Why derivatives lack what a jump adds, and by which of the numbers: (numbers,), or all.
    `values`: of the description by dotted name, dual ones among them.

    A law of time jumps at a time of its own, which only its own numbers move.
    """
    machine, found = system.mechanism, dict[str, Array | bool]()
    for element in (*machine.inputs, *machine.drivers):
        for law in _laws(element).values():
            if not (isinstance(law, Expression) and CORNERED.search(law.text)):
                continue
            own = [x for name, x in values.items() if name.startswith(f"{element.name}.")]
            moving = [one.tangents != 0.0 for one in own if isinstance(one, DualNumber)]
            if moving:
                why = f"'{element.name}' jumps, or has a corner, at a time that they may move"
                found[why] = np.any(moving, axis=0)
    for load in machine.loads:
        for name, law in _laws(load).items():
            if load.__dataclass_fields__[name].metadata.get("of") == "time":
                continue
            jumps = isinstance(law, Expression) and JUMPING.search(law.text)
            if jumps or _holds(law):
                found[f"the law of '{load.name}' jumps, which is not followed"] = True
    # as they are written: what a formula calls has no other list
    written = repr((*machine.loads, *machine.states, *machine.drivers, *machine.quantities))
    for name, curve in machine.curves.items():
        if _holds(curve.law) and re.search(rf"\b{name}\s*\(", written):
            found[f"the curve '{name}' jumps, which is not followed"] = True
    return found


def _holds(law: Any) -> bool:
    return isinstance(law, Table) and law.interpolation == "hold"


class LostNumbers:
    """Numbers by which there is no derivative from some time on, or one for greater or smaller
    numbers alone.
    """

    def __init__(self, names: Sequence[str], first: float, why: Mapping[str, str]) -> None:
        self.names = list(names)
        self.why = {name: (first, one) for name, one in why.items()}
        self.sides: dict[str, tuple[float, str, str]] = {}
        self.remarks: dict[str, float] = {}

    @property
    def gone(self) -> Array:
        """Which of them these are, (names,)."""
        return np.array([name in self.why for name in self.names], dtype=bool)

    def lose(self, which: Array | bool, t: float, why: str) -> None:
        """There are no derivatives by some numbers, or by any, any more."""
        some = np.broadcast_to(which, len(self.names))
        for name, gone in zip(self.names, some, strict=True):
            if gone:
                self.why.setdefault(name, (t, why))

    def halve(self, which: Array, t: float, side: str, why: str) -> None:
        """There are derivatives for greater, or smaller, numbers alone from a time on."""
        for name, some in zip(self.names, which, strict=True):
            if some and self.sides.setdefault(name, (t, side, why))[1] != side:
                self.why.setdefault(name, (t, why))

    def remark(self, t: float, text: str) -> None:
        """What is to be said once."""
        self.remarks.setdefault(text, t)

    def go_on_from(self, before: LostNumbers) -> None:
        """With what is lost, and said, of the part of a motion before."""
        self.why = before.why | self.why
        self.sides, self.remarks = dict(before.sides), dict(before.remarks)

    def without(self, changes: Array, instants: Array) -> None:
        """NaN by these numbers in changes (instants, rows, names), at some instants."""
        gone = np.flatnonzero(self.gone)
        changes[np.ix_(instants, np.arange(changes.shape[1]), gone)] = np.nan

    def notes(self, unit: str) -> list[str]:
        """Sentences; times have the unit."""
        found = [f"at t = {t:.6g} {unit} {text}" for text, t in self.remarks.items()]
        for t, why in dict.fromkeys(self.why.values()):
            names = [name for name, one in self.why.items() if one == (t, why)]
            by = "" if len(names) == len(self.names) else f" by {listed(names)}"
            found.append(f"from t = {t:.6g} {unit} on there is no derivative{by}: {why}")
        sided = {name: one for name, one in self.sides.items() if name not in self.why}
        for t, side, why in dict.fromkeys(sided.values()):
            names = [name for name, one in sided.items() if one == (t, side, why)]
            found.append(
                f"from t = {t:.6g} {unit} on derivatives by {listed(names)} are those for {side} "
                f"numbers alone: {why}"
            )
        return found


# -- What happens in a motion, as the kernel that leads it says -------------------------------


class Guarded(NamedTuple):
    """A guard of `mbody.kernels.contact_guards`: its kind and owner, the direction of what slides,
    and what is rounding of one that began at zero.
    """

    kind: int
    owner: int = 0
    sense: float = 0.0
    fresh: float = 0.0

    @property
    def of_forces(self) -> bool:
        """Whether it follows from forces, not from positions and rates alone."""
        return self.kind in (LIFT, SLIP, SHARE, PARADOX)


class ImpactStage(NamedTuple):
    """One part of an impact, of rows of normals and then of tangents: which hold, and the
    directions in which others slide. `limit`: Rows that hold by neither an impulse nor a rate.
    `reaction` (rows, 2): What presses frictional joints. `undecided`: Whether no equation decides
    impulses on which their friction depends.
    """

    hold: Array
    slip: Array
    limit: Array
    reaction: Array
    undecided: bool


@dataclass(frozen=True, eq=False)
class Strike:
    """An impact.

    `owner` (rows,): The contact points of its rows, those of normals first, then joints.
    `normal` (rows,): Of tangents the row of their normal, of joints −2, of others −1.
    `pair` (rows,): Friction pairs of joints, else −1.
    `rebounds`: Whether restitution acts.
    `stages`: Compression, or all of it; expansion by Poisson's law.
    `held`: Rows of frictional joints that take their part.
    `after`: Velocities after it.
    """

    owner: Array
    normal: Array
    pair: Array
    rebounds: bool
    stages: tuple[ImpactStage, ...]
    held: Array
    after: Array


def strike_of(active: ActiveModes, rebounds: bool) -> Strike:
    """The impact that the kernel has just resolved."""
    D, I = active.memory.problem[0], active.memory.impact
    n, m = int(D.count[ALL_ROWS]), int(D.count[ALL_NORMALS])
    velocities = slice(active.system.coordinates, 2 * active.system.coordinates)
    delassus, before = D.delassus[:n, :n].copy(), D.before[:n].copy()
    joints, mu = D.law[:n] != CONE, D.mu[:n]
    normal = np.where(np.arange(n) < m, -1, np.where(joints, -2, D.normal[:n]))
    newton = rebounds & (D.newton[:m] == 1)
    shifted, given = before.copy(), D.given_law[:m] * rebounds
    shifted[:m] += newton * D.restitution[:m] * np.minimum(before[:m], 0.0)
    expands = bool(given.any())
    more = D.more[:n] * expands
    forces = D.impulse[:n] - more
    forces[:m] -= given
    scale = 1.0 / np.sqrt(np.maximum(np.diag(delassus), tol.TINY))

    def stage(forces: Array, rates: Array, given: Array) -> ImpactStage:
        """Which rows hold by their impulses, and rates after them."""
        own, slow = forces / scale, np.abs(rates * scale)
        small = tol.CONTACT_IMPACT_UNKNOWN_NONE * np.abs(D.impulse[:n] / scale).max(initial=0.0)
        rests = slow <= tol.CONTACT_IMPACT_UNKNOWN_NONE * np.abs(before * scale).max(initial=0.0)
        whole = forces.copy()
        whole[:m] += given
        reaction = np.zeros((n, 2))
        reaction[joints] = D.by_force[:n, :, :n][joints] @ whole
        most = mu * whole[normal] * (normal >= 0)
        for r in np.flatnonzero(joints):
            size, (x, y) = np.empty((3, 1)), reaction[r][:, None]
            arm = D.arm[r, ARMS:] if forces[r] > 0.0 else D.arm[r, :ARMS]
            law_sizes(int(D.law[r]), np.ascontiguousarray(arm), x, y, size)
            most[r] = size[0, 0]
        presses = most[m:] / scale[m:] > small
        room = own.copy()
        room[m:] = most[m:] / scale[m:] - np.abs(own[m:])
        has_room, slip = room > small, np.zeros(n)
        hold = has_room | (rests & (np.append(np.ones(m, dtype=bool), presses) | (not rebounds)))
        # what no reaction presses has no friction
        hold[joints] &= most[joints] / scale[joints] > small
        whole, rows = scale[:, None] * delassus * scale, np.flatnonzero(hold)
        # of rows that depend on each other those at their limits are at these
        rows = rows[np.argsort(~has_room[rows], kind="stable")]
        kept = rows[in_order(whole[np.ix_(rows, rows)])]
        hold[:] = False
        hold[kept] = True
        slip[m:] = np.where(presses & ~hold[m:] & ~has_room[m:], -np.sign(own[m:]), 0.0)
        limit = rests & (room <= small) & rebounds
        # what other rows with room can take over has some
        others = np.setdiff1d(rows[room[rows] > small], kept)
        shared = np.linalg.solve(whole[np.ix_(kept, kept)], whole[np.ix_(kept, others)])
        limit[kept] &= ~(np.abs(shared) > tol.ROWS_DEPENDENT).any(axis=1)
        # what other rows with an impulse could take over presses what slides more or less
        gone = [r for r in rows if r not in kept and abs(own[r]) > small]
        parts = np.zeros((n, len(gone)))
        parts[gone, range(len(gone))] = scale[gone]
        taken = np.linalg.solve(whole[np.ix_(kept, kept)], whole[np.ix_(kept, gone)])
        parts[kept] = -scale[kept][:, None] * taken
        by = D.by_force[:n, :, :n][joints & (slip != 0.0)]
        moves = np.abs(by @ parts) > tol.ROWS_DEPENDENT * (np.abs(by) @ np.abs(parts))
        return ImpactStage(hold, slip, limit & hold, reaction, bool(moves.any()))

    stages = [stage(forces, shifted + delassus @ forces, np.zeros(m))]
    if expands:
        pushed = forces.copy()
        pushed[:m] += given
        stages.append(stage(more, shifted + delassus @ (pushed + more), given))
    held = [one.tangent for one, h in zip(active.uni.friction_joints, I.held, strict=True) if h]
    return Strike(
        owner=D.owner[:n].copy(),
        normal=normal,
        pair=np.where(joints, D.pair[:n], -1),
        rebounds=rebounds,
        stages=tuple(stages),
        held=np.array([] if rebounds else held, dtype=int),
        after=active.motion.y[velocities].copy(),
    )


def in_order(A: Array) -> list[int]:
    """Rows of a Gram matrix that do not depend on those before them, by Cholesky's method."""
    kept, L = list[int](), np.zeros_like(A)
    for r in range(len(A)):
        known = L[kept, : len(kept)]
        L[r, : len(kept)] = np.linalg.solve(known, A[kept, r])
        left = A[r, r] - L[r] @ L[r]
        if left > tol.ROWS_DEPENDENT * A[r, r]:
            L[r, len(kept)] = np.sqrt(left)
            kept.append(r)
    return kept


@dataclass(eq=False)
class ModeStretch:
    """A motion between two changes of modes, or set times.

    `t`: When it begins.
    `strikes`: Impacts with which it begins, in their order.
    `y`, `derivative`: Its first state, after these, and the derivative there; None where the state
      before goes on.
    `on`, `anchor`, `phases`, `slip_sign`: Rows that are on, where sticking began, phases of the
      rows along two circles, directions of sliding.
    `modes`, `pairs`: Of contact points and of frictional joints.
    `leader`, `slow`, `force` (owners,): By whose row what sticks is held; rates that are none;
      sizes of forces where it begins.
    `guards`: What is watched in it.
    `shared`: Forces that no equation decides, limits and program, as of `Guards`: the bundles.
    `inputs`: Inputs that keep their values.
    `guard`: What is zero at the end; None of a set time and of the end of the motion.
    `lost`: Why there are no derivatives from here on; empty where there are.
    `rests`: Whether the impacts before it are those of which there are infinitely many.
    `jerked`: Whether rates of drivers have jumped, just after the end of the one before.
    `sides`: On which side arguments of jumps are, 1 or −1, by place: set by what follows the
      motion.
    `crossed`: The argument that was zero where it begins.
    `sizes`: The greatest values of arguments of jumps along the motion, by place.
    `sampled`: Whether controllers may have to sample, or inputs to be set, where it begins.
    """

    t: float
    strikes: tuple[Strike, ...] = ()
    y: Array | None = None
    derivative: Array | None = None
    on: Array = field(default_factory=lambda: np.zeros(0))
    anchor: Array = field(default_factory=lambda: np.zeros(0))
    phases: Array = field(default_factory=lambda: np.zeros(0))
    slip_sign: Array = field(default_factory=lambda: np.zeros(0))
    modes: tuple[str, ...] = ()
    pairs: tuple[str, ...] = ()
    leader: Array = field(default_factory=lambda: np.zeros(0, dtype=int))
    slow: Array = field(default_factory=lambda: np.zeros(0))
    force: Array = field(default_factory=lambda: np.zeros(0))
    guards: tuple[Guarded, ...] = ()
    shared: tuple[Bundle, ...] = ()
    inputs: dict[str, float] = field(default_factory=dict)
    end: float = np.inf
    guard: Guarded | JumpGuard | None = None
    lost: str = ""
    rests: bool = False
    jerked: bool = False
    sides: dict[int, float] = field(default_factory=dict)
    crossed: int | None = None
    sizes: dict[int, float] = field(default_factory=dict)
    sampled: bool = False

    def all_off(self) -> ModeStretch:
        """A stretch with no active constraint and no sliding, as rows are measured alone."""
        return replace(
            self, on=0.0 * self.on, anchor=0.0 * self.anchor, slip_sign=0.0 * self.slip_sign
        )

    def divided(self, t: float, **other: Any) -> ModeStretch:
        """What goes on of it from a time on, where it ends: with nothing that began it."""
        after = replace(self, t=t, strikes=(), y=None, derivative=None, lost="", **other)
        after.rests = after.jerked = False
        self.end, self.guard = t, None
        return after


class MotionRecord:
    """The stretches of a motion, as the kernel says that they begin and end."""

    def __init__(self, active: ActiveModes) -> None:
        self.active = active
        self.stretches: list[ModeStretch] = []
        active.listener = self.happened
        self._forget()

    def _forget(self) -> None:
        self.strikes: list[Strike] = []
        self.lost, self.rests, self.jerked, self.goes_on = "", False, False, False

    def happened(self, stage: int, code: int) -> None:
        """What came next in a motion, and what has come of it: see `mbody.kernels.advance`."""
        active, G = self.active, self.active.guard_table
        if code < IMPACT or code == UNBROKEN:
            return
        if stage == PASSED:
            n = int(G.passed[0])
            self.stretches[-1].guard = _guards_of(active)[n]
        elif stage == SETTLING and not self.goes_on:
            self.jerked = True
        self.goes_on = True
        rests = code == IMPACT and active.counts[FOUND] == RESTED
        self.rests |= rests
        if code in (IMPACT, COLLISION):
            self.strikes.append(strike_of(active, code == IMPACT and not rests))
            if any(one.undecided for one in self.strikes[-1].stages):
                self.lost = OPEN_IMPULSES
        elif code == DECIDED and active.counts[FOUND] == SEVERAL:
            self.lost = "several accelerations are consistent with the friction there"
        elif code == BEGUN:
            self._begin()

    def _begin(self) -> None:
        active, G, guards = self.active, self.active.guard_table, _guards_of(self.active)
        motion = active.motion
        t, count = float(motion.state[TIME]), len(active.uni)
        shares = any(one.kind == SHARE for one in guards)
        if self.stretches:
            self.stretches[-1].end = t
        self.stretches.append(
            ModeStretch(
                t,
                strikes=tuple(self.strikes),
                y=motion.y.copy(),
                derivative=motion.K[0].copy(),
                on=active.on,
                anchor=motion.work.anchor[:count, 0].copy(),
                phases=motion.work.par[active.uni.phase_rows, 0].copy(),
                slip_sign=motion.work.slip_sign[: len(motion.layout.friction_kind), 0].copy(),
                modes=tuple(active.modes),
                pairs=tuple(active.pairs),
                leader=G.leader.copy(),
                slow=G.slow.copy(),
                force=G.force.copy(),
                guards=guards,
                shared=copy.deepcopy((G.held, G.open, G.program)) if shares else (),
                inputs=motion.interruptions.inputs(),
                lost=self.lost,
                rests=self.rests,
                jerked=self.jerked and bool(self.stretches),
            )
        )
        self._forget()


def _guards_of(active: ActiveModes) -> tuple[Guarded, ...]:
    G = active.guard_table
    tables = (one[: G.count[0]].tolist() for one in (G.kind, G.owner, G.sense, G.fresh))
    return tuple(itertools.starmap(Guarded, zip(*tables, strict=True)))


# -- The stretches of a motion -----------------------------------------------------------------


def stretches_of(run: Solution) -> list[ModeStretch]:
    """The stretches of a motion of `simulate`."""
    (initial,) = run.initial_states
    system, settings, events = initial.system, initial.request.settings, initial.request.events
    t, q, v = state_of(system, initial.start)
    times = initial.request.times
    going_on = initial.start.restart
    carried = None if going_on is None else (going_on.inputs, going_on.sampled)
    found, jumps = [ModeStretch(t)], arguments(system.layout)
    watch: Integration | None = None
    if has_modes(system) or jumps:
        watch = Integration(system, initial.start, settings, events, jumps)
        watch.located = watch.has_modes
        active = watch.active
        record = MotionRecord(active) if active is not None and watch.has_modes else None
        watch.run(t, q, v, times[times <= run.t[-1]], None, carried=carried)
        found = found if record is None else record.stretches
    found[-1].end = float(run.t[-1])
    _divide_at_set_times(found, run, t, carried)
    if watch is not None and watch.active is not None:
        _divide_at_jumps(found, watch.active.crossings, watch.active.greatest_arguments())
    return found


def _part_at(stretches: list[ModeStretch], t: float) -> int | None:
    """The stretch that a time divides."""
    return next((k for k, one in enumerate(stretches) if one.t < t <= one.end), None)


def _divide_at_jumps(
    stretches: list[ModeStretch], crossings: list[tuple[float, int]], greatest: dict[int, float]
) -> None:
    """Part the stretches where arguments of jumps are zero; `greatest`: their sizes, by place."""
    for t, place in sorted(crossings):
        if (k := _part_at(stretches, t)) is not None:
            end, guard, one = stretches[k].end, stretches[k].guard, stretches[k]
            after = one.divided(t, crossed=place, sampled=False, inputs=dict(one.inputs))
            after.end, after.guard = end, guard
            one.guard = JumpGuard(place, greatest[place])
            stretches.insert(k + 1, after)
    for one in stretches:
        one.sizes = dict(greatest)


def _divide_at_set_times(
    stretches: list[ModeStretch], run: Solution, first: float, carried: Any
) -> None:
    """Part the stretches at set times; what controllers set there is left open."""
    last = float(run.t[-1])
    times = Interruptions(run.system, run.system.work(), first, last, located=True)
    if carried is not None:
        times.restore(*carried)
    for state in times.sampled:
        state.function = functools.partial(_nothing, len(state.controller.sets))
    due = t = first
    while due < last:
        times.at(t, lambda *_: [])
        k = next((k for k, one in enumerate(stretches) if one.t >= t), len(stretches))
        if k == len(stretches) or stretches[k].t > t:
            before = stretches[k - 1]
            stretches.insert(k, before.divided(t, end=before.end, guard=before.guard))
        stretches[k].sampled = True
        if stretches[k].jerked:
            stretches[k - 1].end = due
        for after in stretches[k:]:
            after.inputs = times.inputs()
        due = times.next(t)
        jump = times.jump_after(due)
        t = due if jump is None else jump


def _nothing(count: int, *_: float) -> list[float]:
    """In the place of a controller."""
    return [0.0] * count
