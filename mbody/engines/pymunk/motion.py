"""A motion integrated by pymunk from the first instant of a run, with three step sizes."""

from __future__ import annotations

import functools
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from mbody.analysis.driven.free_body import coupled
from mbody.core import tolerances as tol
from mbody.core.tolerances import PYMUNK_ARTIFICIAL_MASS, PYMUNK_SETTLED, PYMUNK_STEP_LONGEST, TINY
from mbody.engines.balance import (
    CrosscheckResult,
    Inexpressible,
    Outline,
    not_as_rigid_contacts,
    outlines,
)
from mbody.engines.independent_reading import reading
from mbody.engines.motions_in_steps import Stepped, StepwiseCheck, by_newtons_law, first_of_several
from mbody.engines.pymunk.space import Space, SpaceStepper, inexpressible, of_system
from mbody.model.contact import Contact, Rope
from mbody.model.element import listed
from mbody.model.joints import Joint
from mbody.solution.solution import Solution
from mbody.system.system import System

# -- Forces by pymunk at single instants of a known motion, or at rest -------------------------

# -- Richardson extrapolation of a first-order method to step size 0, with an error estimate ---

Array = np.ndarray


def extrapolated(values: Sequence[Array]) -> tuple[Array, Array]:
    """The limit of results with the steps h, h/2, h/4 … and the change by the last correction.

    Repeated Richardson extrapolation: an error a h + b h² + c h³ … loses one power per level.

    L. F. Richardson, The approximate arithmetical solution by finite differences (1911).

    >>> found, spread = extrapolated([np.array(1.0 + h + h * h) for h in (0.4, 0.2, 0.1)])
    >>> round(float(found), 12), round(float(spread), 12)
    (1.0, 0.02)
    """
    level, before = list(values), values[-1]
    for power in range(1, len(values)):
        before = level[-1]
        level = [b + (b - a) / (2.0**power - 1.0) for a, b in pairwise(level)]
    return level[-1], np.abs(level[-1] - before)


def order(values: Sequence[Array]) -> float:
    """Observed order of results with h, h/2, h/4: log₂ of the ratio of their differences.

    >>> round(order([np.array(1.0 + h) for h in (0.4, 0.2, 0.1)]), 9)
    1.0
    """
    coarse, fine = (float(np.abs(b - a).max()) for a, b in pairwise(values))
    return math.log2(coarse / fine) if coarse > 0.0 and fine > 0.0 else math.nan


#: Number of step sizes: the remaining error is of order 4.
HALVES = 4
#: Step sizes of further sets relative to the first; for few instants there are more sets.
SETS, MORE_SETS, FEW_INSTANTS = (1.0, 0.8), (1.0, 0.9, 0.8, 0.7), 5
#: Sum of the absolute weights of the extrapolation.
WEIGHTS = 6.5
#: Steps from an instant on. The first ones have errors of the start, which does not fit pymunk.
STEPS = 5
#: Iterations of the solver, at first and at most.
FEW, MANY = 64, 65536
#: Greatest work, in iterations of one constraint (about 25 ns), beyond which fewer instants are
#: compared, but no fewer than two.
WORK = 1.2e8


@dataclass(frozen=True)
class Sizes:
    """Scales of a run, for steps, artificial masses and rounding.

    `rate`: Characteristic rate of the motion [1/time].
    `lump`: Artificial mass in place of zero [mass].
    `extent`: Greatest coordinate, with angles times the model length [length].
    `mass`: Greatest mass, artificial ones included [mass].
    """

    rate: float
    lump: float
    extent: float
    mass: float


@dataclass(frozen=True)
class InstantForces:
    """Results of pymunk at some instants of a run.

    `instants`: Of the run.
    `values`, `spread` (instants, numbers): Numbers as of `SpaceStepper.go`, extrapolated, and the
      error estimate of the extrapolation.
    `rounding`, `jitter`: Rounding error of forces [force], and of accelerations [length/time²].
    `parts`: Owners of the parts whose forces are in the values.
    `over`: Loads and joints with forces from mbody.
    """

    instants: list[int]
    values: Array
    spread: Array
    rounding: float
    jitter: float
    parts: tuple[str, ...]
    lumped: tuple[str, ...]
    over: tuple[str, ...]


def kinematic(run: Solution, part: str) -> Array:
    """(instants, bodies, 3) of all bodies: "place", "rate" or "acceleration"."""
    names = {
        "place": ("x", "y", "angle"),
        "rate": ("vx", "vy", "omega"),
        "acceleration": ("ax", "ay", "alpha"),
    }
    bodies = [run[body.name] for body in run.mechanism.bodies]
    rows = [[getattr(body, key) for key in names[part]] for body in bodies]
    return np.moveaxis(np.array(rows), 2, 0)


def sizes_of(system: System, run: Solution) -> Sizes:
    """The scales of a run."""
    L = system.length
    unit = np.array([L, L, 1.0])
    extent = float(np.abs(kinematic(run, "place") / unit).max()) * L
    rates = kinematic(run, "rate") / unit
    changes = kinematic(run, "acceleration") / unit
    if run.analysis == "statics":
        changes = np.zeros_like(changes)
    rate = max(float(np.abs(rates).max()), float(np.sqrt(np.abs(changes).max())))
    own = reading(system).masses[:, 0]
    mean = float(own[own > 0.0].mean()) if own.any() else 0.0
    force = max(
        (float(run.reaction(j.name).magnitude.max()) for j in run.mechanism.joints), default=0.0
    )
    if not rate:
        rate = float(np.sqrt(force / (mean * L))) if mean and force else 1.0
    lump = mean
    if run.analysis != "simulate" or not mean:
        # in a driven motion inertia forces of an artificial mass must not be greater than the loads
        lump = force / (L * rate * rate) if force else mean or 1.0
        lump = min(lump, mean) if mean else lump
    return Sizes(rate, lump, max(extent, L), max(float(own.max()), lump))


def at_instants(system: System, run: Solution, instants: list[int]) -> InstantForces:
    """Forces, efforts and accelerations by pymunk, each instant by itself.

    From the positions and rates of the run a few steps are taken, with four step sizes; in the
    limit they remain at the instant. Drivers move by their values, rates and accelerations there.
    For a known motion, forces are linear in the artificial masses, so two of them determine
    the limit of zero; for a free motion three small ones are extrapolated. Where the solver needs
    many iterations, fewer of the instants are taken.
    """
    sizes = sizes_of(system, run)
    trial = _InstantTrial(system, run, sizes)
    h = PYMUNK_STEP_LONGEST / sizes.rate
    smallest = h / 2.0 ** (HALVES - 1)
    iterations = trial.settled(instants, smallest)
    most = max(2, int(WORK / max(trial.work(iterations), 1.0)))
    if len(instants) > most:
        instants = [
            instants[n] for n in np.linspace(0, len(instants) - 1, most).round().astype(int)
        ]
    trial.parts = SETS if len(instants) > FEW_INSTANTS else MORE_SETS
    values, spread, noise = [], [], []
    for k in instants:
        found = [trial.extrapolated(iterations, lump, k, h) for lump in trial.lumps]
        value, left = extrapolated([one[0] for one in found])
        if trial.linear:
            left = np.zeros_like(left)
        for n, one in enumerate(found):
            left = left + 2.0**n * one[1]
        noise.append(sum(2.0**n * one[2] for n, one in enumerate(found)))
        values.append(value)
        spread.append(left)
    # two sets may agree by chance, but not at most instants
    noises = np.array(noise)
    noises = np.maximum(noises, 2.0 * np.median(noises, axis=0))
    # a position is rounded and divided by h twice; the extrapolation adds several of them
    jitter = 30.0 * np.finfo(float).eps * sizes.extent / smallest**2
    space = trial.space(iterations, trial.lumps[-1])
    machine = system.mechanism
    over = (*(machine.loads[n].name for n in space.over), *trial.over)
    owners = tuple(part.owner for part in space.parts)
    return InstantForces(
        instants,
        np.array(values),
        spread=np.array(spread) + noises,
        rounding=jitter * sizes.mass,
        jitter=jitter,
        parts=owners,
        lumped=space.lumped,
        over=over,
    )


def settled(result_of: Any, enough: float = PYMUNK_SETTLED, most: int = MANY) -> tuple[int, float]:
    """Number of iterations that is enough, and the relative change by twice as many."""
    count, last = FEW, result_of(FEW)
    while True:
        found = result_of(2 * count)
        top = max(float(np.abs(found).max(initial=0.0)), TINY)
        change = float(np.abs(found - last).max(initial=0.0)) / top
        if change <= enough or 2 * count >= most:
            return count if change <= enough else 2 * count, change
        count, last = 2 * count, found


class _InstantTrial:
    """Steps from single instants of a run."""

    def __init__(self, system: System, run: Solution, sizes: Sizes) -> None:
        self.system, self.run, self.sizes = system, run, sizes
        self.pose, self.vel = kinematic(run, "place"), kinematic(run, "rate")
        if run.analysis == "statics":
            self.vel = np.zeros_like(self.vel)
        states = [np.array(run.driven(d.name)) for d in run.mechanism.drivers]
        self.driven = np.array(states).reshape(len(states), 3, len(run))
        if run.analysis == "statics":
            self.driven[:, 1:] = 0.0
        self.over = tuple(one.element for one in inexpressible(system))
        self.spaces: dict[tuple[int, float], Space] = {}
        self.parts: tuple[float, ...] = SETS
        self.linear = run.analysis != "simulate"
        self.lumps: tuple[float, ...] = (1.0,)
        if self.space(FEW, 1.0).lumped:
            self.lumps = (
                (2.0, 1.0)
                if self.linear
                else tuple(PYMUNK_ARTIFICIAL_MASS / 2.0**n for n in range(3))
            )

    def space(self, iterations: int, lump: float) -> Space:
        key = (iterations, lump)
        if key not in self.spaces:
            self.spaces[key] = Space(self.system, lump * self.sizes.lump, iterations)
        return self.spaces[key]

    def steps(self, iterations: int, lump: float, k: int, h: float) -> Array:
        """The result of a few steps from instant k on."""
        value, rate, change = (part[:, None] for part in self.driven[:, :, k].T)
        stepper = SpaceStepper(
            self.space(iterations, lump),
            lambda times: value + rate * times + 0.5 * change * times**2,
            self._forces_of_ours(k),
            float(self.run.t[k]),
            float(self.run.t[-1]),
        )
        stepper.put(self.pose[k], self.vel[k])
        return stepper.go(0.0, h, STEPS)

    def settled(self, instants: list[int], h: float) -> int:
        """Iterations that are enough at some of the instants."""
        some = [instants[n] for n in sorted({0, *np.linspace(0, len(instants) - 1, 5).astype(int)})]
        forces = slice(3 * self.system.coordinates, None)
        return max(
            settled(lambda count, k=k: self.steps(count, self.lumps[-1], k, h)[forces])[0]
            for k in some
        )

    def work(self, iterations: int) -> float:
        """Iterations of one constraint that an instant needs, at least."""
        runs = len(self.parts) * HALVES + 2  # those of the check have twice the iterations
        parts = len(self.space(iterations, self.lumps[-1]).parts)
        return float(iterations * parts * STEPS * runs * len(self.lumps))

    def extrapolated(
        self, iterations: int, lump: float, k: int, h: float
    ) -> tuple[Array, Array, Array]:
        """The result extrapolated to step size 0, the errors of extrapolation and solver, and the
        spread between sets of steps by rounding, which a mechanism may amplify.
        """
        sets = [
            [self.steps(iterations, lump, k, part * h / 2.0**n) for n in range(HALVES)]
            for part in self.parts
        ]
        limits, lefts = (np.array(both) for both in zip(*map(extrapolated, sets), strict=True))
        more = self.steps(2 * iterations, lump, k, h / 2.0 ** (HALVES - 1))
        loose = WEIGHTS * np.abs(more - sets[0][-1])
        return limits.mean(axis=0), lefts[0] + loose, np.ptp(limits, axis=0)

    def _forces_of_ours(self, k: int) -> Array:
        """Forces of joints and couplings that pymunk does not have, on the bodies (bodies, 3)."""
        run, found = self.run, np.zeros((len(self.pose[k]) + 1, 3))
        for name in self.over:
            element: Any = run.mechanism[name]
            if not isinstance(element, Joint):
                if name in [c.name for c in run.mechanism.couplings]:
                    found[:-1] += coupled(run, name, k)
                continue
            px, py = (float(part[k]) for part in run.reaction_point(name))
            for body in (element.i.body, element.j.body):
                if body == "ground":
                    continue
                b, reaction = run.system.bodies[body], run.reaction(name, on=body)
                fx, fy, torque = (
                    float(part[k]) for part in (reaction.fx, reaction.fy, reaction.torque)
                )
                x, y = px - self.pose[k, b, 0], py - self.pose[k, b, 1]
                found[b] += fx, fy, torque + x * fy - y * fx
        return found[:-1]


# -- Contacts in pymunk: the same shapes, and for each pair its own friction and restitution ---

#: Half the length of a line and its thickness, thickness of a segment, in model lengths.
LINE_HALF_LENGTH, THICK, BAR = 100.0, 10.0, 0.05
#: Collision type and category of the shapes of contacts, which touch nothing else.
TYPE, OWN = 1, 1 << 31
#: Part of an overlap that is left after a time of 1 [of the mechanism].
LEFT = 1e-4


def inexpressible_contacts(system: System) -> Iterator[Inexpressible]:
    """Contacts that pymunk cannot model."""
    yield from not_as_rigid_contacts(system.mechanism, "pymunk")
    at = reading(system)
    for one in system.mechanism.contacts:
        if isinstance(one, Contact):
            pair = outlines(at, one)
            if any(part.kind == "polygon" and not part.convex for part in pair):
                why = "pymunk's polygons have no corners that point inwards"
                yield Inexpressible(one.name, why)
            if all(part.kind == "disc" and not part.radius for part in pair):
                yield Inexpressible(one.name, "two points have no direction of contact in pymunk")


class TouchingShapes:
    """The contacts and ropes of a system in a pymunk space.

    `fast`: A velocity of the motion; far slower is at rest.

    `modes`: "open", "stick" or "slip" of every contact in the last step; empty where it is not
      certain.
    """

    def __init__(self, space: Space, fast: float) -> None:
        self.space, self.system, self.fast = space, space.system, fast
        self.at = reading(space.system)
        self._shapes: dict[tuple[str, str], Any] = {}
        self._pairs: dict[frozenset[Any], tuple[str, float, float, float]] = {}
        self.names = [one.name for one in self.system.mechanism.contacts]
        self.modes: dict[str, str] = {}
        self.begin()
        space.space.collision_bias = LEFT
        for one in self.system.mechanism.contacts:
            if isinstance(one, Rope):
                self._rope(one)
            elif isinstance(one, Contact):
                self._contact(one)
        space.space.on_collision(TYPE, TYPE, pre_solve=self._before, post_solve=self._after)

    def begin(self) -> None:
        """Before a step: nothing touches as long as nothing is said."""
        self.modes.update(dict.fromkeys(self.names, "open"))

    def _contact(self, one: Contact) -> None:
        mu = float(self.at[f"{one.name}.friction"])
        static = mu if one.static is None else float(self.at[f"{one.name}.static"])
        e = float(self.at[f"{one.name}.restitution"])
        sides = zip((one.i, one.j), outlines(self.at, one), strict=True)
        pair = frozenset(self._shape(place, outline) for place, outline in sides)
        self._pairs[pair] = one.name, mu, static, e

    def _shape(self, place: str, outline: Outline) -> Any:
        key = outline.body, place
        if key not in self._shapes:
            body = self.space.everything[self.system.bodies[outline.body]]
            made = self._native_shape(body, outline)
            made.collision_type = TYPE
            made.filter = self.space.pymunk.ShapeFilter(categories=OWN, mask=OWN)
            self.space.space.add(made)
            self._shapes[key] = made
        return self._shapes[key]

    def _native_shape(self, body: Any, outline: Outline) -> Any:
        native, size = self.space.pymunk, self.system.length
        if outline.kind == "disc":
            return native.Circle(body, outline.radius, outline.points[0])
        if outline.kind == "polygon":
            return native.Poly(body, list(outline.points))
        if outline.kind == "line":
            # a thick bar whose upper side is the line
            (x, y), c, s = (
                outline.points[0],
                math.cos(outline.direction),
                math.sin(outline.direction),
            )
            x, y = x + THICK * size * s, y - THICK * size * c
            half_length = LINE_HALF_LENGTH * size
            ends = (
                (x - half_length * c, y - half_length * s),
                (x + half_length * c, y + half_length * s),
            )
            return native.Segment(body, *ends, THICK * size)
        (ax, ay), (bx, by) = outline.points
        length = math.hypot(bx - ax, by - ay)
        nx, ny = BAR * size * (by - ay) / length, BAR * size * (ax - bx) / length
        return native.Poly(body, [(ax, ay), (bx, by), (bx + nx, by + ny), (ax + nx, ay + ny)])

    def _rope(self, one: Rope) -> None:
        native = self.space.pymunk
        index, everything = self.system.bodies, self.space.everything
        ends = (everything[index[one.i.body]], everything[index[one.j.body]])
        positions = [tuple(float(part) for part in self.at.arm(one, side)) for side in ("i", "j")]
        made = native.SlideJoint(*ends, *positions, 0.0, float(self.at[f"{one.name}.length"]))
        # a correction of what is too long would be a rebound
        made.error_bias, made.collide_bodies = 1.0, True
        made.post_solve = lambda joint, _: self._pulls(one.name, joint)
        self.space.space.add(made)

    def _pulls(self, name: str, joint: Any) -> None:
        if joint.impulse > 0.0:
            self.modes[name] = "stick"

    def _before(self, arbiter: Any, space: Any, data: Any) -> None:
        found = self._pairs.get(frozenset(arbiter.shapes))
        if found is None:
            arbiter.process_collision = False
            return
        _, mu, static, arbiter.restitution = found
        still = static > mu and self._slides(arbiter) <= tol.PYMUNK_SLIDING_REST * self.fast
        arbiter.friction = static if still else mu

    def _slides(self, arbiter: Any) -> float:
        """The greatest velocity along the shapes, at the points where they touch."""
        i, j = arbiter.bodies
        normal, found = arbiter.normal, 0.0
        for point in arbiter.contact_point_set.points:
            both = (body.velocity_at_world_point(point.point_a) for body in (i, j))
            one, other = both
            found = max(found, abs((one - other).cross(normal)))
        return found

    def _after(self, arbiter: Any, space: Any, data: Any) -> None:
        name, mu = self._pairs[frozenset(arbiter.shapes)][0], arbiter.friction
        impulse, normal = arbiter.total_impulse, arbiter.normal
        press, along = abs(impulse.dot(normal)), abs(impulse.cross(normal))
        if press > 0.0:
            sticks = along < tol.FRICTION_STICKS * mu * press
            # at the limit, but hardly sliding: where friction is not unique, or overlaps go back
            slow = self._slides(arbiter) <= tol.PYMUNK_SLIDING_SLOW * self.fast
            self.modes[name] = "stick" if sticks else "" if slow else "slip"


#: Iterations of the solver at every step, with joints, along which impacts go, many more; and the
#: part of them with which one more motion says what they leave.
ITERATIONS, WITH_JOINTS, FEWER = 100, 1000, 0.25


def contact_crosscheck(system: System, run: Solution, engine: str) -> CrosscheckResult:
    """Places at instants, and what every contact does, by steps of several lengths."""
    missing = [*inexpressible(system), *inexpressible_contacts(system)]
    trial = Space(system, 1.0, 1)
    missing += [
        Inexpressible(name, "pymunk needs a mass and an inertia of every body that strikes")
        for name in trial.lumped
    ]
    if missing:
        return CrosscheckResult(
            engine, (), tuple(missing), ("without these nothing can be compared",)
        )
    notes = []
    last = by_newtons_law(system, run)
    if last < run.t[-1]:
        notes.append(
            f"pymunk's impacts follow Newton's law: compared up to t = {last:.6g}, for with that "
            "law the motion would go on otherwise than with Poisson's"
        )
    several = first_of_several(run)
    if several is not None and several <= last:
        last = float(np.nextafter(several, -np.inf))
        notes = [
            "where several contacts strike at once with restitution, steps find them one by one: "
            f"compared up to t = {several:.6g}"
        ]
    adopted = trial.adopted
    if adopted:
        notes.append(f"applied with the values from mbody, not checked: {listed(adopted)}")
    check = StepwiseCheck(run, last, "pymunk", order=1.0, time_tolerance=0.01)
    iterations = WITH_JOINTS if trial.parts else ITERATIONS
    few = int(FEWER * iterations)
    rows, unseen, more = check.rows(
        functools.partial(_motion, system, run, check.times, iterations),
        functools.partial(_motion, system, run, check.times, few),
    )
    return CrosscheckResult(engine, tuple(rows), tuple(unseen), (*more, *notes), adopted)


def _motion(
    system: System, run: Solution, times: np.ndarray, iterations: int, counts: list[int]
) -> Stepped:
    """The motion with a number of steps between the instants."""
    space = Space(system, 1.0, iterations)
    rates = np.abs(kinematic(run, "rate")) * (1.0, 1.0, system.length)
    last = float(run.t[-1])
    # what stays where it is has the speed of a model length over the motion
    least = system.length / max(last - float(run.t[0]), tol.TINY)
    touching = TouchingShapes(space, max(float(rates.max()), least))
    stepper = SpaceStepper(space, functools.partial(of_system, run.system, last=last), last=last)
    stepper.put(kinematic(run, "place")[0], kinematic(run, "rate")[0])
    places, modes = [], []
    for (begin, end), count in zip(pairwise(times.tolist()), counts, strict=True):
        h = (end - begin) / count
        if count > 1:
            stepper.go(begin, h, count - 1)
        touching.begin()
        stepper.go(end - h, h, 1)
        places.append(stepper.state()[0])
        modes.append(dict(touching.modes))
    named = {name: [one[name] for one in modes] for name in touching.names}
    return Stepped(np.array(places), named)


#: Longest time of a motion that is compared [time].
HORIZON = 1.0
#: The fewest steps.
FEWEST = 400
#: Instants that are compared, at most.
SAMPLES = 10
#: Greatest work of all runs, in iterations of one constraint (about 16 ns); and the work of a step
#: itself, of a driver, and of applied loads.
STEP_WORK = 3e7
STEPPING, DRIVING, APPLYING = 200, 300, 3000
#: Range of observed orders in which the extrapolation is valid.
REGULAR = (0.8, 2.5)
#: Steps after which the number of iterations is checked.
BURST = 40
#: Sum of the weights of the extrapolation.
STEP_WEIGHTS = 5.0


@dataclass(frozen=True)
class Trajectory:
    """The result of a motion integrated by pymunk.

    `instants`: Of the run.
    `values`, `spread` (instants, numbers): Numbers as of `SpaceStepper.go`, then the kinetic
      energy, extrapolated, and the error estimate of the extrapolation.
    `order`: Observed, of the positions at the last instant; NaN where the step size has no effect.
    `horizon`: Time of the last instant after the first [time].
    `step`: The longest [time].
    `shortened`: Whether the motion was shortened, because the order was not observed or too many
      steps were needed.
    `loose`: Change by more iterations, relative to the greatest force.
    `parts`, `lumped`, `over`: As of `InstantForces`.
    """

    instants: list[int]
    values: Array
    spread: Array
    order: float
    horizon: float
    step: float
    shortened: bool
    loose: float
    parts: tuple[str, ...]
    lumped: tuple[str, ...]
    over: tuple[str, ...]


def trajectory(system: System, run: Solution) -> Trajectory | None:
    """The motion from the first instant of a run on; None where there is only one.

    It ends where three step sizes no longer converge with the expected order, since nearby motions
    diverge after that, or where too much work would be needed. Artificial masses are halved
    twice too, and extrapolated to zero.
    """
    end = _end(run)
    instants = _instants(run, end)
    if not instants:
        return None
    sizes = sizes_of(system, run.take([0, *range(1, instants[-1] + 1)]))
    trial = _MotionTrial(system, run, sizes)
    shortened = False
    while len(instants) > 1 and trial.step(instants) * sizes.rate > tol.COMPARISON_BLIND:
        end = 0.5 * (float(run.t[instants[-1]]) + float(run.t[0]))
        instants, shortened = _instants(run, end) or instants[:1], True
    while True:
        found, seen = trial.go(instants)
        n = system.coordinates
        places = [values[-1, :n] for values in seen]
        difference = float(np.abs(places[2] - places[1]).max()) / min(system.length, 1.0)
        seen_order = order(places)
        regular = difference < tol.COMPARISON_ROUNDING or REGULAR[0] <= seen_order <= REGULAR[1]
        if regular or len(instants) == 1:
            break
        end = 0.5 * (float(run.t[instants[-1]]) + float(run.t[0]))
        shorter = _instants(run, end)
        if not shorter or shorter[-1] >= instants[-1]:
            break
        instants, shortened = shorter, True
    value, spread = found
    # errors accumulate along a motion, and that of a single number may vanish by chance
    spread = np.maximum(spread, np.median(spread, axis=0))
    if run.analysis == "simulate":
        spread = np.maximum.accumulate(spread)
    space = trial.spaces[0]
    return Trajectory(
        instants,
        value,
        spread,
        order=float("nan") if difference < tol.COMPARISON_ROUNDING else seen_order,
        horizon=float(run.t[instants[-1]] - run.t[0]),
        step=trial.longest,
        shortened=shortened,
        loose=trial.loose,
        parts=tuple(part.owner for part in space.parts),
        lumped=space.lumped,
        over=tuple(system.mechanism.loads[n].name for n in space.over),
    )


def _end(run: Solution) -> float:
    """The last time that may be compared: before the first impact on a stop."""
    first = float(run.t[0])
    impacts = [one.t for one in run.events if one.after is not None]
    return min([first + HORIZON, float(run.t[-1]), *impacts])


def _instants(run: Solution, end: float) -> list[int]:
    """Instants of the run that are compared, after the first and not after the end."""
    there = np.flatnonzero((run.t > run.t[0]) & (run.t <= end + tol.COMPARISON_TIME_END * abs(end)))
    picked = np.linspace(0, len(there) - 1, min(len(there), SAMPLES)).round().astype(int)
    return [int(there[k]) for k in picked]


class _MotionTrial:
    """Runs of pymunk from the first instant on."""

    def __init__(self, system: System, run: Solution, sizes: Sizes) -> None:
        self.system, self.run, self.sizes = system, run, sizes
        self.pose, self.vel = kinematic(run, "place")[0], kinematic(run, "rate")[0]
        free = Space(system, sizes.lump, 1)
        moving = run.analysis == "simulate" and bool(free.lumped)
        self.lumps = (
            tuple(tol.PYMUNK_ARTIFICIAL_MASS * sizes.lump / 2**n for n in range(3))
            if moving
            else (sizes.lump,)
        )
        h = tol.PYMUNK_STEP_LONGEST / sizes.rate
        # the smallest artificial mass needs the most iterations
        most = min(MANY, int(STEP_WORK / (BURST * max(len(free.parts), 1))))
        self.iterations, self.loose = settled(
            lambda count: self._burst(count, h), tol.PYMUNK_SETTLED_MOTION, most
        )
        self.spaces = [Space(system, lump, self.iterations) for lump in self.lumps]
        self.longest = h

    def _stepper(self, space: Space) -> SpaceStepper:
        last = float(self.run.t[-1])
        targets = functools.partial(of_system, self.run.system, last=last)
        stepper = SpaceStepper(space, targets, last=last)
        stepper.put(self.pose, self.vel)
        return stepper

    def _burst(self, iterations: int, h: float) -> Array:
        """Forces after some steps; each step starts with the impulses of the one before."""
        stepper = self._stepper(Space(self.system, self.lumps[-1], iterations))
        return stepper.go(float(self.run.t[0]), h, BURST)[3 * self.system.coordinates :]

    def _work(self) -> float:
        """Work of a step."""
        space = self.spaces[0]
        work = STEPPING + DRIVING * len(space.motors) + self.iterations * len(space.parts)
        return work + (APPLYING if self._stepper(space).pushed else 0)

    def step(self, instants: list[int]) -> float:
        """The longest step for a motion up to the last instant [time], by the greatest work."""
        span = float(self.run.t[instants[-1]] - self.run.t[0])
        wanted = max(FEWEST, span * self.sizes.rate / tol.PYMUNK_STEP_LONGEST)
        most = STEP_WORK / (7.0 * self._work() * len(self.spaces))
        return span / max(min(wanted, most), 4.0 * len(instants))

    def go(self, instants: list[int]) -> tuple[tuple[Array, Array], list[Array]]:
        """The limit with its spread, and the results of the three step sizes with the first
        artificial mass.
        """
        times = self.run.t[[0, *instants]]
        self.longest = self.step(instants)
        loose = self._settle(times)
        sets = [[self._once(space, times, n) for n in (1, 2, 4)] for space in self.spaces]
        limits = [extrapolated(seen) for seen in sets]
        value, spread = limits[0]
        if len(limits) > 1:
            value, more = extrapolated([one[0] for one in limits])
            spread = limits[-1][1] + more
        return (value, spread + STEP_WEIGHTS * loose), sets[0]

    def _settle(self, times: Array) -> Array:
        """Set the iterations that the whole motion needs; returns the change by four times as many
        (instants, numbers).
        """
        space, n = self.spaces[-1], self.system.coordinates
        found = self._once(space, times, 1)
        while True:
            space.space.iterations = 4 * self.iterations
            more = self._once(space, times, 1)
            change = np.abs(more - found)
            if change[:, :n].max() <= tol.PYMUNK_SETTLED_MOTION * min(self.sizes.extent, 1.0):
                break
            steps = float(times[-1] - times[0]) / self.longest
            # the next trial needs sixteen times as many as the start of this one
            if 16.0 * self._work() * steps > STEP_WORK:
                break
            self.iterations, found = 4 * self.iterations, more
        for one in self.spaces:
            one.space.iterations = self.iterations
        return np.asarray(change)

    def _once(self, space: Space, times: Array, finer: int) -> Array:
        """(instants, numbers) of one motion."""
        stepper, rows = self._stepper(space), []
        own = reading(self.system).masses.ravel()
        n = self.system.coordinates
        for begin, end in zip(times[:-1].tolist(), times[1:].tolist(), strict=True):
            steps = max(1, round((end - begin) / self.longest)) * finer
            result = stepper.go(begin, (end - begin) / steps, steps)
            rows.append(np.append(result, 0.5 * own @ result[n : 2 * n] ** 2))
        return np.array(rows)
