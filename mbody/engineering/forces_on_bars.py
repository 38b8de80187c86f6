"""Where along a bar the forces on a link act."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from typing import Any

import numpy as np

from mbody.analysis.driven.free_body import Wrench, free_body
from mbody.errors import ModelError
from mbody.model.body import Body
from mbody.model.element import Marker, listed
from mbody.model.joints import Revolute
from mbody.model.loads import Gravity
from mbody.solution.solution import Solution

__all__ = ["Bar", "BarForces", "bar_of", "forces_on"]

Array = np.ndarray

#: Places that are this near, as a part of the size of the mechanism, are one.
SAME = 1e-9


@dataclass(frozen=True)
class Bar:
    """The line of a bar in link axes, from its first point to its second.

    Attributes
    ----------
    along : tuple of 2 str
        Its points.
    x, y : float
        Its beginning [length].
    cos, sin : float
        Its direction.
    length : float
    """

    along: tuple[str, str]
    x: float
    y: float
    cos: float
    sin: float
    length: float

    def coordinates(self, x: Any, y: Any) -> tuple[Any, Any]:
        """Along and across the bar, of a place in link axes."""
        dx, dy = x - self.x, y - self.y
        return self.cos * dx + self.sin * dy, self.cos * dy - self.sin * dx

    def components(self, angle: Array, fx: Array, fy: Array) -> tuple[Array, Array]:
        """Along and across the bar, of vectors in world axes, at angles of the link."""
        c, s = np.cos(angle), np.sin(angle)
        ux, uy = c * self.cos - s * self.sin, s * self.cos + c * self.sin
        return ux * fx + uy * fy, ux * fy - uy * fx


@dataclass(frozen=True, eq=False)
class BarForces:
    """The forces on a bar but for its weight and inertia: arrays (instants, forces).

    Attributes
    ----------
    causes : tuple of str
    place : array
        Along the bar, where they act or where the rigid arm to them begins [length].
    axial, across : array
        Forces along and across the bar.
    couple : array
        About that place of the bar.
    weight : array (instants, 2)
        By gravity, along and across the bar.
    """

    causes: tuple[str, ...]
    place: Array
    axial: Array
    across: Array
    couple: Array
    weight: Array


def bar_of(run: Solution, body: str, along: Any = None) -> Bar:
    """The bar of a link: along two of its points, by default those of its section, else the places
    of its two joints.

    Raises
    ------
    ModelError
        For a body that there is not, points that are not there or are one place, and a link whose
        joints do not say which line it is.
    """
    known = [one.name for one in run.mechanism.bodies]
    if body not in known:
        raise ModelError(f"there is no moving body {body!r} (there are: {listed(known)})", body)
    link: Any = run.mechanism[body]
    line = tuple(along or ()) if not isinstance(along, str) else tuple(along.split(","))
    if not line and link.section is not None:
        line = link.section.along
    line = line or _ends(run, link)
    if len(line) != 2 or not set(line) <= set(link.points):
        raise ModelError(
            f"'{body}' is a bar along two of its points (there are: {listed(link.points)}), not "
            f"{listed(line)}",
            body,
        )
    at = run.system.numbers
    (ax, ay), (bx, by) = (map(float, at.point(f"{body}.{name}")) for name in line)
    length = float(np.hypot(bx - ax, by - ay))
    if not length > SAME * run.system.length:
        raise ModelError(
            f"'{line[0]}' and '{line[1]}' of '{body}' are one place: a bar goes along two", body
        )
    return Bar((line[0], line[1]), ax, ay, (bx - ax) / length, (by - ay) / length, length)


def _ends(run: Solution, link: Body) -> tuple[str, ...]:
    """Names of the points at which a link has its joints, one a place.

    Raises
    ------
    ModelError
        Where there are not two.
    """
    at = run.system.numbers
    found: dict[str, tuple[float, float]] = {}
    centre = at.point(f"{link.name}.cg")
    for joint in run.mechanism.joints:
        for key, place in (("i", joint.i), ("j", joint.j)):
            if place.body == link.name:
                x, y = (float(c + arm) for c, arm in zip(centre, at.arm(joint, key), strict=True))
                names = [
                    name
                    for name in link.points
                    if _apart((x, y), at.point(f"{link.name}.{name}")) <= SAME * run.system.length
                ]
                for name in names[:1]:
                    found.setdefault(name, (x, y))
    if len(found) != 2:
        raise ModelError(
            f"the direction of the bar '{link.name}' is open: it has joints at "
            f"{listed(found) if found else 'no named point'}; say along which two points it "
            'goes, such as section = { rectangle = ["20 mm", "8 mm"], along = ["A", "B"] }',
            link.name,
        )
    return tuple(found)


def _apart(a: Any, b: Any) -> float:
    return float(np.hypot(a[0] - b[0], a[1] - b[1]))


def forces_on(run: Solution, body: str, bar: Bar) -> BarForces:
    """All forces on a link at all instants, moved to its bar."""
    rows = [free_body(run, body, k) for k in range(len(run))]
    history = run[body]
    gravity = {load.name for load in run.mechanism.loads if isinstance(load, Gravity)}
    causes = list(
        dict.fromkeys(
            (w.cause, w.kind, n)
            for row in rows
            for w, n in _numbered(row)
            if w.kind != "inertia" and w.cause not in gravity
        )
    )
    index = {key: k for k, key in enumerate(causes)}
    shape = len(run), len(causes)
    x, y, fx, fy, torque = (np.zeros(shape) for _ in range(5))
    weight = np.zeros((len(run), 2))
    x[:], y[:] = history.x[:, None], history.y[:, None]
    for k, row in enumerate(rows):
        for w, n in _numbered(row):
            if w.cause in gravity:
                weight[k] += w.fx, w.fy
            elif w.kind != "inertia":
                m = index[w.cause, w.kind, n]
                x[k, m], y[k, m], fx[k, m], fy[k, m] = w.x, w.y, w.fx, w.fy
                torque[k, m] = w.torque
    for m, (cause, kind, _) in enumerate(causes):
        if kind in ("load", "driver", "coupling"):
            px, py = _acting_at(run, body, cause)
            torque[:, m] += (x[:, m] - px) * fy[:, m] - (y[:, m] - py) * fx[:, m]
            x[:, m], y[:, m] = px, py
    # places in link axes, then along the bar
    c, s = np.cos(history.angle)[:, None], np.sin(history.angle)[:, None]
    origin = run.point(Marker(body, (0.0, 0.0)))
    dx, dy = x - origin.x[:, None], y - origin.y[:, None]
    place, off = bar.coordinates(c * dx + s * dy, c * dy - s * dx)
    axial, across = bar.components(history.angle[:, None], fx, fy)
    down = np.stack(bar.components(history.angle, *weight.T), axis=-1)
    return BarForces(
        tuple(cause for cause, _, _ in causes), place, axial, across, torque - off * axial, down
    )


def _numbered(row: Any) -> list[tuple[Wrench, int]]:
    """Forces with how many of the same cause came before: a contact may have several."""
    count: dict[str, int] = {}
    found = []
    for w in row:
        found.append((w, count.get(w.cause, 0)))
        count[w.cause] = found[-1][1] + 1
    return found


def _acting_at(run: Solution, body: str, name: str) -> tuple[Array, Array]:
    """Where a load or a driver acts on a body, world axes: at its place there; a couple at the pin
    that joins its two bodies; else at the mass centre.
    """
    element: Any = run.mechanism[name]
    own = [
        value
        for field in dataclasses.fields(element)
        if isinstance(value := getattr(element, field.name), Marker) and value.body == body
    ]
    if len(own) == 1:
        at = run.point(own[0])
        return at.x, at.y
    others = set(element.bodies) - {body} or {"ground"}
    for joint in run.mechanism.joints:
        ends = {joint.i.body: joint.i, joint.j.body: joint.j}
        if isinstance(joint, Revolute) and body in ends and others & ends.keys():
            at = run.point(ends[body])
            return at.x, at.y
    return run[body].x, run[body].y
