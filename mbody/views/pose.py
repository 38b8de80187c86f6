"""One instant of a solution for drawings: places, directions, numbers."""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from mbody.core.tolerances import TINY
from mbody.laws import MeasuredFormula
from mbody.model.joint_limits import JointContact
from mbody.model.joints import Joint, Revolute
from mbody.model.touching_shapes import middles_of_arcs
from mbody.solution.histories import Place, moved, reaction_point, whole_instant
from mbody.solution.measures import formula_history

if TYPE_CHECKING:
    from mbody.model.element import Element
    from mbody.solution.histories import BodyHistory, PointHistory
    from mbody.solution.solution import Solution


# -- Carriers of shapes: a body, a point that keeps a direction, the line of two points --------
# A shape is kept in the axes of its carrier, so that the motion of the carriers is the motion of
# the picture.

Array = np.ndarray


@dataclass(frozen=True)
class Carrier:
    """Axes that shapes are kept in.

    `start`: Origin of the axes.
    `rotates_with`: The body whose angle the axes have; "" where they point from `start` to `end`.
    `end`: Of what reaches from one place to another.
    `stretches`: Whether the shapes become longer with the distance, as a spring: a point has then
      three numbers, the part of the distance, and how far along and across the line from there.
    `lead`: Length at both ends that does not stretch.
    """

    start: Place = ("ground", 0.0, 0.0)
    rotates_with: str = "ground"
    end: Place | None = None
    stretches: bool = False
    lead: float = 0.0

    def kept(self, points: Array, pose: Pose) -> Array:
        """World points (n, 2) of an instant in these axes: (n, 2), or (n, 3) of what stretches."""
        origin, u, length = (part[pose.k] for part in pose.axes(self))
        away = points - origin
        along, across = away @ u, away @ np.array([-u[1], u[0]])
        if not self.stretches:
            return np.array([along, across]).T
        part = (along - self.lead) / max(float(length) - 2.0 * self.lead, TINY)
        part = np.clip(part, 0.0, 1.0)
        return np.column_stack([part, along - part * length, across])

    def in_world(self, kept: Array, axes: tuple[Array, Array, Array], k: int) -> Array:
        """World points (n, 2) of an instant, of points in these axes."""
        origin, u, length = (part[k] for part in axes)
        along, across = kept[:, -2], kept[:, -1]
        if self.stretches:
            along = along + kept[:, 0] * length
        return np.asarray(origin + np.outer(along, u) + np.outer(across, (-u[1], u[0])))

    def axes(self, run: Any) -> tuple[Array, Array, Array]:
        """Origin (instants, 2), direction (instants, 2) and length (instants,) of the axes."""
        origin = moved(run, self.start)
        if self.end is None:
            angle = run[self.rotates_with].angle
            return origin, np.column_stack([np.cos(angle), np.sin(angle)]), np.ones(len(run))
        separation = moved(run, self.end) - origin
        length = np.hypot(*separation.T)
        return origin, separation / np.maximum(length, TINY)[:, None], length


GROUND_CARRIER = Carrier()


def on(body: str) -> Carrier:
    """The axes of a body."""
    return Carrier((body, 0.0, 0.0), body)


def placed(place: Place, rotates_with: str = "ground") -> Carrier:
    """Axes at a place of one body with the angle of another."""
    return Carrier(place, rotates_with)


def between(start: Place, end: Place, *, stretches: bool = True, lead: float = 0.0) -> Carrier:
    """The line from one place to another."""
    return Carrier(start, "", end, stretches, lead)


class Pose:
    """Places and angles at one instant."""

    def __init__(self, run: Solution, instant: int) -> None:
        self.run, self.k = run, whole_instant(run, instant)
        self.mechanism, self.system = run.mechanism, run.system
        self._bodies: dict[str, BodyHistory] = {}
        self._axes: dict[Carrier, tuple[Array, Array, Array]] = {}
        self.t = float(run.t[self.k])

    @functools.cached_property
    def joints(self) -> tuple[Joint, ...]:
        """All joints; those that can separate are contacts of the system of a motion."""
        parted = [
            one.joint
            for one in self.mechanism.contacts
            if isinstance(one, JointContact) and one.name == one.joint.name
        ]
        return (*self.mechanism.joints, *parted)

    @functools.cached_property
    def joint_places(self) -> Array:
        """The places of all joints on both their bodies (places, 2), from the left to the right."""
        found = [self.place(joint, side) for joint in self.joints for side in "ij"]
        places = np.array(found).reshape(-1, 2)
        return np.asarray(places[np.argsort(places[:, 0], kind="stable")])

    def at_joint(self, place: Array, clearance: float) -> bool:
        """Whether a place is nearer to that of a joint than `clearance`."""
        ends = np.searchsorted(
            self.joint_places[:, 0], [place[0] - clearance, place[0] + clearance]
        )
        offsets = self.joint_places[slice(*ends.tolist())] - place
        return bool((np.hypot(offsets[:, 0], offsets[:, 1]) < clearance).any())

    def centre(self, body: str) -> Array:
        """The mass centre of a body."""
        history = self.body(body)
        return np.array([history.x[self.k], history.y[self.k]])

    def angle(self, body: str) -> float:
        """The angle of a body's x axis [rad]."""
        return float(self.body(body).angle[self.k])

    def body(self, name: str) -> BodyHistory:
        """The motion of a body, read from the run once."""
        if name not in self._bodies:
            self._bodies[name] = self.run[name]
        return self._bodies[name]

    def axes(self, carrier: Carrier) -> tuple[Array, Array, Array]:
        """The axes of a carrier over the run, read once."""
        if carrier not in self._axes:
            self._axes[carrier] = carrier.axes(self.run)
        return self._axes[carrier]

    def track(self, element: Element, field: str) -> Array:
        """Places (instants, 2) of an element's marker over the whole run."""
        body = self.body(element.places()[field].body)
        x, y = self.system.numbers.arm(element, field)
        c, s = np.cos(body.angle), np.sin(body.angle)
        return np.column_stack([body.x + c * x - s * y, body.y + s * x + c * y])

    def place(self, element: Element, field: str) -> Array:
        """The place of an element's marker."""
        return self._world_point(
            element.place(field).body, *self.system.numbers.arm(element, field)
        )

    def _world_point(self, name: str, x: Any, y: Any) -> Array:
        """A place (x, y) from the mass centre of a body, in its axes."""
        body, k = self.body(name), self.k
        angle = float(body.angle[k])
        c, s = math.cos(angle), math.sin(angle)
        return np.array([body.x[k] + c * x - s * y, body.y[k] + s * x + c * y])

    def site(self, element: Element, field: str) -> Place:
        """The place of an element's marker on its body."""
        x, y = self.system.numbers.arm(element, field)
        return element.places()[field].body, float(x), float(y)

    def fixed(self, body: str, place: Any) -> Place:
        """A place of this instant on a body."""
        x, y = on(body).kept(np.array([place]), self)[0]
        return body, float(x), float(y)

    def direction(self, element: Element, field: str) -> float:
        """The direction of a marker's x axis [rad]."""
        marker = element.places()[field]
        return self.angle(marker.body) + float(self.system.numbers.angle(element, field))

    def point(self, name: str) -> Array:
        """A named point, such as ``"coupler.P"``."""
        history: PointHistory = self.run.point(name)
        return np.array([history.x[self.k], history.y[self.k]])

    def number(self, element: Element, field: str) -> float:
        """A number of an element, with the values that the system has."""
        return float(self.system.values[f"{element.name}.{field}"])

    def law(self, element: Element, field: str) -> float:
        """The value of one of an element's laws of time, or of a formula of measured quantities."""
        law = getattr(element, field)
        if isinstance(law, MeasuredFormula):
            return float(formula_history(self.run, law, f"{element.name}.{field}")[self.k])
        return float(self.system.law_of(element, field).derivatives(self.t)[0])

    def rate(self, driver: str) -> float:
        """The rate of a driven coordinate."""
        return float(self.run.driven(driver)[1][self.k])

    def mass(self, body: str) -> float:
        """The mass of a body."""
        return float(self.system.mass[3 * self.system.bodies[body], 0])

    def reaction_point(self, joint: Joint) -> Array:
        """The reaction point of a joint: a point of contact, or the place on j."""
        return np.array([float(part[self.k]) for part in reaction_point(self.run, joint)])

    def pivot(self, by: str, body: str) -> Array:
        """The centre of rotation of a body: its pin on the other body, on the ground, any pin, or
        its mass centre.
        """
        pins = [joint for joint in self.joints if isinstance(joint, Revolute)]
        pins = [joint for joint in pins if body in (joint.i.body, joint.j.body)]
        for other in (by, "ground", ""):
            for joint in pins:
                if not other or other in (joint.i.body, joint.j.body):
                    return self.place(joint, "j")
        return self.centre(body)

    @functools.cached_property
    def joints_of(self) -> dict[str, list[Joint]]:
        """The joints of each body."""
        found: dict[str, list[Joint]] = {}
        for joint in self.joints:
            for body in {joint.i.body, joint.j.body}:
                found.setdefault(body, []).append(joint)
        return found

    @functools.cached_property
    def nodes(self) -> dict[str, list[Array]]:
        """Places on each body: of joints, drivers and loads, and its points."""
        found: dict[str, list[Array]] = {name: [] for name in self.system.bodies}
        for element in self.mechanism:
            for field, marker in element.places().items():
                found[marker.body].append(self.place(element, field))
        for body in self.mechanism.bodies:
            off = middles_of_arcs(body.shapes)
            at, centre = self.system.numbers.point, self.system.numbers.point(f"{body.name}.cg")
            for name in (one for one in body.points if one not in off):
                x, y = at(f"{body.name}.{name}")
                found[body.name].append(self._world_point(body.name, x - centre[0], y - centre[1]))
        return found

    @property
    def middle(self) -> Array:
        """The middle of all moving bodies' nodes."""
        names = [body.name for body in self.mechanism.bodies]
        places = [np.mean(self.nodes[n] or [self.centre(n)], axis=0) for n in names]
        return np.mean(places, axis=0) if places else np.zeros(2)


def heading(vector: Any) -> float:
    """The direction of a vector [rad]."""
    return math.atan2(vector[1], vector[0])
