"""Spanning tree of a mechanism: joints that connect each body to its parent, and cut joints."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from mbody.engines.independent_reading import reading
from mbody.model.driver import AngleDriver, CoordinateDriver, DistanceDriver
from mbody.model.element import Element
from mbody.model.joints import Distance, Fixed, Joint, PinSlot, Prismatic, Revolute
from mbody.solution.solution import Solution
from mbody.system.system import System

#: Joints that a tree can have, those that are cut last first.
KINDS: dict[type, str] = {Fixed: "fixed", Prismatic: "prismatic", Revolute: "revolute"}
#: Coordinates of a branch: an angle, a displacement, none, or (x, y, θ) of the mass centre.
FREEDOMS = {"revolute": 1, "prismatic": 1, "fixed": 0, "free": 3}


@dataclass(frozen=True)
class MarkerFrame:
    """A place [length] and a direction [rad] on a body, from its mass centre in link axes."""

    x: float
    y: float
    angle: float


@dataclass(frozen=True)
class Branch:
    """One joint of the tree, which connects a body to its parent.

    `body`, `parent`: Names; the parent may be ``"ground"``.
    `kind`: ``"revolute"``, ``"prismatic"``, ``"fixed"``, or ``"free"``: a floating body, whose
      coordinates are (x, y, θ) of its mass centre in the world.
    `joint`: None for a free body.
    `on_parent`, `on_body`: The joint's place and direction on both. A revolute joint turns from one
      direction to the other; a prismatic one slides along the direction, the same on both.
    `reversed`: Whether the parent is the joint's body j. The coordinate of a branch is that of the
      body from its parent: of a reversed prismatic joint it is the negative displacement of j along
      the guide.
    """

    body: str
    parent: str
    kind: str
    joint: Joint | None
    on_parent: MarkerFrame
    on_body: MarkerFrame
    reversed: bool = False

    @property
    def freedom(self) -> int:
        """Number of coordinates."""
        return FREEDOMS[self.kind]


@dataclass(frozen=True)
class Tree:
    """A spanning tree of the bodies.

    `branches`: One for each moving body, parents before children, depth first.
    `cuts`: Revolute, prismatic and fixed joints that close loops.
    `others`: Joints of other types, then couplings: constraints that are never in the tree.
    """

    branches: tuple[Branch, ...]
    cuts: tuple[Joint, ...]
    others: tuple[Element, ...]

    def branch(self, body: str) -> Branch:
        """The branch that connects a body to its parent."""
        return next(branch for branch in self.branches if branch.body == body)


def marker_frame(system: System, element: Element, field: str) -> MarkerFrame:
    """The frame of an element's marker (``"i"`` or ``"j"``), from the mass centre of its body."""
    at = reading(system)
    return MarkerFrame(*at.arm(element, field), at.angle(element, field))


def spanning_tree(system: System) -> Tree:
    """The bodies of a system of one design as a tree over its joints.

    Fixed and prismatic joints enter the tree first and are cut only in loops without others; then
    joints at massless bodies, so that these are between others where possible and carry the inertia
    of their children. A part that none of these joints connects to the ground gets a free branch at
    its heaviest body.

    Examples
    --------
    >>> import mbody
    >>> tree = spanning_tree(mbody.assemble(mbody.makers.four_bar(1, 3, 2, 3.5, masses=(1, 1, 1))))
    >>> [(branch.parent, branch.body) for branch in tree.branches]
    [('ground', 'crank'), ('crank', 'coupler'), ('coupler', 'rocker')]
    >>> [joint.name for joint in tree.cuts]
    ['O4']
    """
    machine = system.mechanism
    joints = [joint for joint in machine.joints if type(joint) in KINDS]
    order = {kind: n for n, kind in enumerate(KINDS)}
    inertia = {b.name: reading(system).mass(b.name) for b in machine.bodies}
    inertia["ground"] = 1.0, 1.0
    ranked = sorted(
        joints,
        key=lambda one: (order[type(one)], all(any(inertia[b]) for b in (one.i.body, one.j.body))),
    )
    part = {name: name for name in system.bodies}

    def root(name: str) -> str:
        while part[name] != name:
            name = part[name]
        return name

    tree: list[Joint] = []
    for joint in ranked:
        i, j = root(joint.i.body), root(joint.j.body)
        if i != j:
            part[i] = j
            tree.append(joint)
    kept = {joint.name for joint in tree}
    neighbours: dict[str, list[Joint]] = {name: [] for name in system.bodies}
    for joint in joints:
        if joint.name in kept:
            neighbours[joint.i.body].append(joint)
            neighbours[joint.j.body].append(joint)
    branches: list[Branch] = []
    reached = {"ground"}
    _add_children(system, "ground", neighbours, reached, branches)
    heaviest = sorted(machine.bodies, key=lambda b: inertia[b.name], reverse=True)
    for body in heaviest:
        if body.name not in reached:
            reached.add(body.name)
            nowhere = MarkerFrame(0.0, 0.0, 0.0)
            branches.append(Branch(body.name, "ground", "free", None, nowhere, nowhere))
            _add_children(system, body.name, neighbours, reached, branches)
    others = [joint for joint in machine.joints if type(joint) not in KINDS]
    cuts = tuple(joint for joint in joints if joint.name not in kept)
    return Tree(tuple(branches), cuts, (*others, *machine.couplings))


def _add_children(
    system: System,
    start: str,
    neighbours: dict[str, list[Joint]],
    reached: set[str],
    branches: list[Branch],
) -> None:
    """Add the bodies that joints connect to a body of the tree, each followed by its children."""
    pending = [(joint, start) for joint in reversed(neighbours[start])]
    while pending:
        joint, parent = pending.pop()
        swapped = joint.j.body == parent
        body = joint.i.body if swapped else joint.j.body
        if body in reached:
            continue
        reached.add(body)
        i, j = marker_frame(system, joint, "i"), marker_frame(system, joint, "j")
        ends = (j, i) if swapped else (i, j)
        branches.append(Branch(body, parent, KINDS[type(joint)], joint, *ends, swapped))
        pending += [(further, body) for further in reversed(neighbours[body])]


def tree_motion(tree: Tree, run: Solution) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Coordinates of the tree, rates and accelerations (instants, freedoms), from a run.

    The columns follow the order of the branches. The run may be of another system with the same
    names and places.
    """
    parts: list[list[Any]] = [[], [], []]
    for branch in tree.branches:
        body, parent = run[branch.body], run[branch.parent]
        if branch.kind == "free":
            columns = (
                (body.x, body.y, body.angle),
                (body.vx, body.vy, body.omega),
                (body.ax, body.ay, body.alpha),
            )
            for part, found in zip(parts, columns, strict=True):
                part += found
        elif branch.kind == "revolute":
            offset = branch.on_body.angle - branch.on_parent.angle
            parts[0].append(body.angle - parent.angle + offset)
            parts[1].append(body.omega - parent.omega)
            parts[2].append(body.alpha - parent.alpha)
        elif branch.kind == "prismatic":
            for part, found in zip(parts, _displacement(branch, run), strict=True):
                part.append(found)
    blank = np.zeros((0, len(run)))
    q, v, a = ((np.array(part) if part else blank).T.copy() for part in parts)
    return q, v, a


def _displacement(branch: Branch, run: Solution) -> tuple[Any, Any, Any]:
    """Displacement, speed and acceleration of a slider along the direction on its parent.

    s = u·d;  ṡ = u·ḋ + ω (k×u)·d;  s̈ = u·d̈ + 2ω (k×u)·ḋ + α (k×u)·d − ω² u·d.
    """
    body, parent = run[branch.body], run[branch.parent]
    ends = [
        _point_motion(pose, at) for pose, at in ((parent, branch.on_parent), (body, branch.on_body))
    ]
    (dx, dy), (dvx, dvy), (dax, day) = (
        tuple(at_j - at_i for at_i, at_j in zip(a, b, strict=True))
        for a, b in zip(*ends, strict=True)
    )
    direction = parent.angle + branch.on_parent.angle
    ux, uy = np.cos(direction), np.sin(direction)
    w, alpha = parent.omega, parent.alpha
    along, across = ux * dx + uy * dy, ux * dy - uy * dx
    speed = ux * dvx + uy * dvy + w * across
    change = ux * dax + uy * day + 2.0 * w * (ux * dvy - uy * dvx) + alpha * across
    return along, speed, change - w * w * along


def _point_motion(
    pose: Any, at: MarkerFrame
) -> tuple[tuple[Any, Any], tuple[Any, Any], tuple[Any, Any]]:
    """Place, velocity and acceleration of a place on a body."""
    c, s = np.cos(pose.angle), np.sin(pose.angle)
    px, py = c * at.x - s * at.y, s * at.x + c * at.y
    w, alpha = pose.omega, pose.alpha
    return (
        (pose.x + px, pose.y + py),
        (pose.vx - w * py, pose.vy + w * px),
        (pose.ax - alpha * py - w * w * px, pose.ay + alpha * px - w * w * py),
    )


# -- Constraint rows of cut joints and drivers, by the kinematics of another engine ------------
# A row constrains n·d, with n fixed in body i or along d, or an angle. Its force n on j acts at the
# place on j, the opposite on i at the same place. The Jacobian is the generalised force of n. With
# p the place on j, and of body i the point that is there:  Φ̇ = n·v_rel,  Φ̈ = n·(a_rel − 2 ω_i ×
# v_rel).

Array = np.ndarray

#: Joints that have rows of this kind.
CUT_JOINTS = (Revolute, Prismatic, Fixed, Distance, PinSlot)


@dataclass(frozen=True)
class ConstraintRow:
    """One row: its force direction, value, rate, acceleration and Jacobian.

    `i`, `j`: The bodies.
    `place` (2,)
    `force` (2,): On j at the place, of a unit multiplier.
    `value`, `rate`, `change`: The constrained quantity and its derivatives.
    `jacobian` (n,)
    """

    i: str
    j: str
    place: Array
    force: Array
    torque: float
    value: float
    rate: float
    change: float
    jacobian: Array


def constraint_rows(system: System, element: Element, bodies: Any) -> list[ConstraintRow]:
    """The rows of a joint or a driver."""
    if isinstance(element, AngleDriver):
        return [_angle(element.relative_to, element.body, bodies, 0.0)]
    one: Any = element
    i, j = marker_frame(system, element, "i"), marker_frame(system, element, "j")
    row = _PointPair(one.i.body, one.j.body, i, j, bodies)
    direction = bodies[one.i.body].angle + i.angle
    along = np.array([math.cos(direction), math.sin(direction)])
    across = np.array([-along[1], along[0]])
    angle_row = _angle(one.i.body, one.j.body, bodies, j.angle - i.angle)
    if isinstance(element, Revolute):
        return [row.fixed(np.array([1.0, 0.0])), row.fixed(np.array([0.0, 1.0]))]
    if isinstance(element, Fixed):
        return [row.fixed(np.array([1.0, 0.0])), row.fixed(np.array([0.0, 1.0])), angle_row]
    if isinstance(element, Prismatic):
        return [row.fixed(across), angle_row]
    if isinstance(element, PinSlot):
        return [row.fixed(across)]
    if isinstance(element, CoordinateDriver):
        return [row.fixed(along)]
    assert isinstance(element, Distance | DistanceDriver)
    return [row.distance()]


def _angle(i: str, j: str, bodies: Any, more: float) -> ConstraintRow:
    """θ_j − θ_i + `more`, within −π … π."""
    a, b = bodies[i], bodies[j]
    jacobian = b.jacobian[2] - a.jacobian[2]
    rate, change = b.velocity[2] - a.velocity[2], b.acceleration[2] - a.acceleration[2]
    rotation = math.remainder(b.angle - a.angle + more, 2.0 * math.pi)
    return ConstraintRow(
        i, j, b.place, np.zeros(2), 1.0, rotation, float(rate), float(change), jacobian
    )


class _PointPair:
    """Rows between two places."""

    def __init__(self, i: str, j: str, at_i: MarkerFrame, at_j: MarkerFrame, bodies: Any) -> None:
        self.i, self.j, self.a, self.b = i, j, bodies[i], bodies[j]
        self.place_on_i = self.a.place + self.a.relative_position(at_i)
        self.place = self.b.place + self.b.relative_position(at_j)
        self.d = self.place - self.place_on_i
        # the point of body i that coincides with the place on j
        relative = self.place - self.a.place, self.place - self.b.place
        self.v = self.b.velocity_at(relative[1]) - self.a.velocity_at(relative[0])
        aa, ab = self.a.acceleration_at(relative[0]), self.b.acceleration_at(relative[1])
        w = self.a.velocity[2]
        self.acceleration = ab - aa - 2.0 * w * np.array([-self.v[1], self.v[0]])

    def fixed(self, n: Array) -> ConstraintRow:
        """n·d, n fixed in i."""
        return self._row(n, float(n @ self.d), float(n @ self.acceleration))

    def distance(self) -> ConstraintRow:
        """|d|: its second derivative contains the square of the transverse velocity."""
        length = math.hypot(*self.d)
        n = self.d / length
        across = float(n[0] * self.v[1] - n[1] * self.v[0])
        return self._row(n, length, float(n @ self.acceleration) + across * across / length)

    def _row(self, n: Array, value: float, change: float) -> ConstraintRow:
        jacobian = self.b.generalized_force(n, 0.0, self.place)
        jacobian = jacobian - self.a.generalized_force(n, 0.0, self.place)
        return ConstraintRow(
            self.i, self.j, self.place, n, 0.0, value, float(n @ self.v), change, jacobian
        )
