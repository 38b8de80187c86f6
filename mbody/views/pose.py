"""One instant of a solution for drawings: places, directions, numbers."""

from __future__ import annotations

import functools
import math
from typing import TYPE_CHECKING, Any

import numpy as np

from mbody.laws import MeasuredFormula
from mbody.model.joint_contacts import JointContact
from mbody.model.joints import Joint, Revolute
from mbody.model.touching_shapes import middles_of_arcs
from mbody.solution.checks import whole_instant
from mbody.solution.formula_histories import formula_history
from mbody.solution.places import Place, reaction_point
from mbody.views.carriers import on

if TYPE_CHECKING:
    from mbody.model.element import Element
    from mbody.solution.histories import BodyHistory, PointHistory
    from mbody.solution.solution import Solution

__all__ = ["Pose", "heading"]

Array = np.ndarray


class Pose:
    """Places and angles at one instant.

    Parameters
    ----------
    run : Solution
        Of one design.
    instant : int
        Which of its instants.

    Raises
    ------
    ModelError
        For an instant outside the solution.
    """

    def __init__(self, run: Solution, instant: int) -> None:
        self.run, self.k = run, whole_instant(run, instant)
        self.mechanism, self.system = run.mechanism, run.system
        self._bodies: dict[str, BodyHistory] = {}
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

    def at_joint(self, place: Array, near: float) -> bool:
        """Whether a place is nearer to that of a joint than `near`."""
        ends = np.searchsorted(self.joint_places[:, 0], [place[0] - near, place[0] + near])
        apart = self.joint_places[slice(*ends.tolist())] - place
        return bool((np.hypot(apart[:, 0], apart[:, 1]) < near).any())

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

    def track(self, element: Element, field: str) -> Array:
        """Places (instants, 2) of an element's marker over the whole run."""
        body = self.body(element.places()[field].body)
        x, y = self.system.numbers.arm(element, field)
        c, s = np.cos(body.angle), np.sin(body.angle)
        return np.column_stack([body.x + c * x - s * y, body.y + s * x + c * y])

    def place(self, element: Element, field: str) -> Array:
        """The place of an element's marker."""
        return self._at(element.place(field).body, *self.system.numbers.arm(element, field))

    def _at(self, name: str, x: Any, y: Any) -> Array:
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
        x, y = on(body).kept(np.array([place]), self.run, self.k)[0]
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
                found[body.name].append(self._at(body.name, x - centre[0], y - centre[1]))
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
