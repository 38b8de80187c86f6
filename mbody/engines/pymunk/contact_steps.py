"""A motion with contacts by pymunk, compared with ours."""

from __future__ import annotations

import functools
import math
from collections.abc import Iterator
from itertools import pairwise
from typing import Any

import numpy as np

from mbody.engines.independent_reading import reading
from mbody.engines.motions_in_steps import Stepped, StepwiseCheck, by_newtons_law, first_of_several
from mbody.engines.opinion import Inexpressible, Opinion
from mbody.engines.pymunk.instants import kinematic
from mbody.engines.pymunk.space import Space, SpaceStepper, inexpressible, of_system
from mbody.engines.shape_outlines import Outline, not_as_rigid_contacts, outlines
from mbody.model.contact import Contact, Rope
from mbody.model.element import listed
from mbody.solution.solution import Solution
from mbody.system.system import System

# -- Contacts in pymunk: the same shapes, and for each pair its own friction and restitution ---

#: Half the length of a line and its thickness, thickness of a segment, in model lengths.
REACH, THICK, BAR = 100.0, 10.0, 0.05
#: Collision type and category of the shapes of contacts, which touch nothing else.
TYPE, OWN = 1, 1 << 31
#: Friction below this part of its limit sticks.
STICKS = 1.0 - 1e-6
#: Sliding slower than this part of the velocities of the motion is rest: the static coefficient.
STILL = 1e-6
#: At the limit of friction, but slower than this part of it, nothing is certain.
SLOW = 1e-3
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

    Parameters
    ----------
    space : Space
    fast : float
        A velocity of the motion; far slower is at rest.

    Attributes
    ----------
    modes : dict
        "open", "stick" or "slip" of every contact in the last step; empty where it is not certain.
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
            made = self._made(body, outline)
            made.collision_type = TYPE
            made.filter = self.space.pymunk.ShapeFilter(categories=OWN, mask=OWN)
            self.space.space.add(made)
            self._shapes[key] = made
        return self._shapes[key]

    def _made(self, body: Any, outline: Outline) -> Any:
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
            far = REACH * size
            ends = (x - far * c, y - far * s), (x + far * c, y + far * s)
            return native.Segment(body, *ends, THICK * size)
        (ax, ay), (bx, by) = outline.points
        length = math.hypot(bx - ax, by - ay)
        nx, ny = BAR * size * (by - ay) / length, BAR * size * (ax - bx) / length
        return native.Poly(body, [(ax, ay), (bx, by), (bx + nx, by + ny), (ax + nx, ay + ny)])

    def _rope(self, one: Rope) -> None:
        native = self.space.pymunk
        index, everything = self.system.bodies, self.space.everything
        ends = (everything[index[one.i.body]], everything[index[one.j.body]])
        arms = [tuple(float(part) for part in self.at.arm(one, side)) for side in ("i", "j")]
        made = native.SlideJoint(*ends, *arms, 0.0, float(self.at[f"{one.name}.length"]))
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
        still = static > mu and self._slides(arbiter) <= STILL * self.fast
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
            sticks = along < STICKS * mu * press
            # at the limit, but hardly sliding: where friction is not unique, or overlaps go back
            slow = self._slides(arbiter) <= SLOW * self.fast
            self.modes[name] = "stick" if sticks else "" if slow else "slip"


#: Iterations of the solver at every step, with joints, along which impacts go, many more; and the
#: part of them with which one more motion says what they leave.
ITERATIONS, WITH_JOINTS, FEWER = 100, 1000, 0.25


def contact_opinion(system: System, run: Solution, engine: str) -> Opinion:
    """Places at instants, and what every contact does, by steps of several lengths."""
    missing = [*inexpressible(system), *inexpressible_contacts(system)]
    trial = Space(system, 1.0, 1)
    missing += [
        Inexpressible(name, "pymunk needs a mass and an inertia of every body that strikes")
        for name in trial.lumped
    ]
    if missing:
        return Opinion(engine, (), tuple(missing), ("without these nothing can be compared",))
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
    if trial.over:
        names = listed([system.mechanism.loads[n].name for n in trial.over])
        notes.append(f"applied with the values from mbody, not checked: {names}")
    check = StepwiseCheck(run, last, "pymunk", order=1.0, near=0.01)
    iterations = WITH_JOINTS if trial.parts else ITERATIONS
    few = int(FEWER * iterations)
    rows, unseen, more = check.rows(
        functools.partial(_motion, system, run, check.times, iterations),
        functools.partial(_motion, system, run, check.times, few),
    )
    return Opinion(engine, tuple(rows), tuple(unseen), (*more, *notes))


def _motion(
    system: System, run: Solution, times: np.ndarray, iterations: int, counts: list[int]
) -> Stepped:
    """The motion with a number of steps between the instants."""
    space = Space(system, 1.0, iterations)
    rates = np.abs(kinematic(run, "rate")) * (1.0, 1.0, system.length)
    last = float(run.t[-1])
    # what stays where it is has the speed of a model length over the motion
    least = system.length / max(last - float(run.t[0]), 1e-300)
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
