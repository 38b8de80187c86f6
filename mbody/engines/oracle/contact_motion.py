"""The oracle's motion with contacts: every combination of modes is tried, impacts too.

Between events the closed contacts have one mode each, and accelerations and forces are one dense
system of equations. Which modes follow an event is decided by trying all of them, open, stick, slip
either way: 4ᵐ systems of m contacts, of which those whose forces press, stay in their cones and
whose motions part or go against friction are right. An impact is the same with velocities.
Integration is by DOP853 of SciPy, with its own location of events.

Glocker: Set-Valued Force Laws (2001); Pfeiffer, Glocker (1996), 6 and 8.
"""

from __future__ import annotations

import functools
import itertools
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from mbody.core import tolerances as tol
from mbody.engines.balance import Comparison, CrosscheckResult
from mbody.engines.independent_reading import Jet
from mbody.engines.oracle.friction import has_friction
from mbody.engines.oracle.mechanics import Reference, formula_of_positions
from mbody.model.contact import Contact, OneSided, Rope
from mbody.model.element import Marker
from mbody.model.joint_limits import JointLimit, limits_of
from mbody.model.joints import Revolute
from mbody.model.mechanism import Mechanism
from mbody.model.states import names_measured
from mbody.model.stop import Stop
from mbody.model.touching_shapes import CurveShape, Disc, Line, Polygon, Ring, Segment, Vertex
from mbody.solution.contact_forces import acting_contacts
from mbody.solution.solution import Solution
from mbody.system.system import System

# -- The oracle's contacts: what may touch what, gaps, and rates across and along each place ---
# Read from the description: a shape is circles, of the radius 0 at points, or a straight line. All
# functions take complex coordinates, so that steps give derivatives.

#: A gap that is never closed.
NEVER_CLOSED = 1e9

Array = np.ndarray


@dataclass(frozen=True)
class OracleCandidate:
    """A place where two bodies may touch: a circle on one of them, and on the other a line that
    begins at a place with a direction (or ends at another place), a circle, or a ring.
    """

    name: str
    circle: Marker
    radius: float
    other: Marker
    kind: str  # "line", "segment", "circle", "ring", "rope", "stop"
    end: Marker | None = None
    second_size: float = 0.0  # radius of the other circle or ring, length of a rope
    friction: float = 0.0
    static: float = 0.0
    restitution: float = 0.0
    newton: bool = False
    forwards: bool = True  # whether the circle is on the contact's body j
    coordinate: Any = None  # of a stop or a limit: the gap as a function of all coordinates
    angular: bool = False  # whether that is an angle


def candidates_of(contact: Any) -> list[OracleCandidate]:
    """The places of a contact."""
    if isinstance(contact, Rope):
        size = float(contact.length)
        return [OracleCandidate(contact.name, contact.j, 0.0, contact.i, "rope", second_size=size)]
    if isinstance(contact, Stop | JointLimit):
        here = Marker("ground", (0.0, 0.0))
        how: dict[str, Any] = {"restitution": _rebound(contact)}
        how["coordinate"] = functools.partial(_coordinate, contact)
        how["angular"] = contact.quantities()["contact"] == "torque"
        return [OracleCandidate(contact.name, here, 0.0, here, "stop", **how)]
    if not isinstance(contact, Contact):
        what = type(contact).__name__
        raise NotImplementedError(f"'{contact.name}': it has no contact like a {what}")
    own: Any = contact
    mu = float(own.friction)
    more: dict[str, Any] = {
        "friction": mu,
        "static": mu if own.static is None else float(own.static),
        "restitution": float(own.restitution),
        "newton": contact.law == "newton",
    }
    sides = list(zip(contact.bodies, contact.shapes, strict=True))
    if any(isinstance(s, Disc | Ring) and s.begin is not None for s in contact.shapes):
        raise NotImplementedError(f"'{contact.name}': it has no arcs")
    if any(isinstance(s, CurveShape) for s in contact.shapes):
        raise NotImplementedError(f"'{contact.name}': it has no curves")
    for (one, shape), (other, flat) in (sides, sides[::-1]):
        more["forwards"] = one == contact.bodies[1]
        circles = _circles(one, shape)
        straight = isinstance(flat, Line | Segment)
        corners = isinstance(shape, Polygon | Segment)
        if circles and straight and not (corners and isinstance(flat, Segment)):
            place, kind, end = _straight(other, flat)
            return [
                OracleCandidate(contact.name, c, r, place, kind, end, **more) for c, r in circles
            ]
        if circles and isinstance(flat, Ring) and not corners:
            ((c, r),) = circles
            hole, size = Marker(other, flat.ring), float(flat.radius)
            return [OracleCandidate(contact.name, c, r, hole, "ring", second_size=size, **more)]
    rounds = [_circles(body, shape) for body, shape in sides if isinstance(shape, Disc | Vertex)]
    if len(rounds) == 2:
        ((i, ri),), ((j, rj),) = rounds
        more["forwards"] = True
        return [OracleCandidate(contact.name, j, rj, i, "circle", second_size=ri, **more)]
    raise NotImplementedError(f"'{contact.name}': it has no contacts of corners with edges")


def _rebound(contact: Stop | JointLimit) -> float:
    given: Any = contact if isinstance(contact, Stop) else contact.joint
    return float(given.restitution or 0.0)


def _coordinate(contact: Stop | JointLimit, reference: Reference, q: Any) -> Any:
    """What cannot fall below zero, at coordinates (3n + 3,) that are floats or jets."""
    if isinstance(contact, Stop):
        if contact.gap is None or "t" in names_measured(reference.mechanism, contact.gap.variables):
            raise NotImplementedError(f"'{contact.name}': it has no stop that moves by itself")
        return formula_of_positions(reference, contact.gap, q, 0.0, {})
    joint: Any = contact.joint
    angle_i, angle_j = (reference.pose(q, one.body)[2] for one in (joint.i, joint.j))
    direction = angle_i + joint.i.angle
    if isinstance(joint, Revolute):
        free = angle_j + joint.j.angle - direction
    else:
        (xi, yi), (xj, yj) = reference.place(q, joint.i), reference.place(q, joint.j)
        free = np.cos(direction) * (xj - xi) + np.sin(direction) * (yj - yi)
    low, high = joint.limits
    return free - float(low) if contact.end == "low" else float(high) - free


def _circles(body: str, shape: Any) -> list[tuple[Marker, float]]:
    """Circles that touch a straight line: a disc, a point, corners."""
    if isinstance(shape, Disc):
        return [(Marker(body, shape.disc), float(shape.radius))]
    if isinstance(shape, Vertex):
        return [(Marker(body, shape.point), 0.0)]
    corners = {Segment: "segment", Polygon: "polygon"}.get(type(shape))
    return [(Marker(body, point), 0.0) for point in getattr(shape, corners)] if corners else []


def _straight(body: str, shape: Any) -> tuple[Marker, str, Marker | None]:
    if isinstance(shape, Line):
        return Marker(body, shape.point, float(shape.angle)), "line", None
    first, last = shape.segment
    return Marker(body, first), "segment", Marker(body, last)


class OracleContacts:
    """All places of a mechanism where bodies may touch; `length` is that of stops, which have no
    shapes.
    """

    def __init__(self, reference: Reference, contacts: Any, length: float = 1.0) -> None:
        self.reference, self.least_length = reference, length
        self.candidates = [
            candidate for contact in contacts for candidate in candidates_of(contact)
        ]

    def __len__(self) -> int:
        return len(self.candidates)

    def _frame(self, q: Any, candidate: OracleCandidate) -> tuple[Any, ...]:
        """Gap, normal from the other body to that of the circle, and the point of contact."""
        r = self.reference
        cx, cy = r.place(q, candidate.circle)
        ox, oy = r.place(q, candidate.other)
        dx, dy = cx - ox, cy - oy
        if candidate.kind in ("line", "segment"):
            if candidate.end is None:
                angle = r.pose(q, candidate.other.body)[2] + candidate.other.angle
                ux, uy = np.cos(angle), np.sin(angle)
            else:
                ex, ey = r.place(q, candidate.end)
                whole = np.sqrt((ex - ox) ** 2 + (ey - oy) ** 2)
                ux, uy = (ex - ox) / whole, (ey - oy) / whole
                along = dx * ux + dy * uy
                beyond = np.real(along) < 0.0 or np.real(along) > np.real(whole)
                if beyond and candidate.radius == 0.0:
                    return NEVER_CLOSED + 0.0 * dx, -uy, ux, cx, cy
                if beyond:
                    if np.real(along) > 0.0:
                        dx, dy = cx - ex, cy - ey
                    distance = np.sqrt(dx * dx + dy * dy)
                    nx, ny = dx / distance, dy / distance
                    return (
                        distance - candidate.radius,
                        nx,
                        ny,
                        cx - candidate.radius * nx,
                        cy - candidate.radius * ny,
                    )
            nx, ny = -uy, ux
            gap = nx * dx + ny * dy - candidate.radius
            return gap, nx, ny, cx - candidate.radius * nx, cy - candidate.radius * ny
        distance = np.sqrt(dx * dx + dy * dy)
        if candidate.kind == "circle":
            nx, ny = dx / distance, dy / distance
            gap = distance - candidate.radius - candidate.second_size
            return gap, nx, ny, cx - candidate.radius * nx, cy - candidate.radius * ny
        # within a ring, or on a rope: the normal points back
        if np.real(distance) == 0.0:
            return candidate.second_size - candidate.radius + 0.0 * dx, 1.0, 0.0, cx, cy
        nx, ny = -dx / distance, -dy / distance
        return (
            candidate.second_size - candidate.radius - distance,
            nx,
            ny,
            cx - candidate.radius * nx,
            cy - candidate.radius * ny,
        )

    def gaps(self, q: Array) -> Array:
        """Gaps (candidates,) at q (3n,)."""
        every = self.reference.with_ground(q)
        return np.array(
            [
                self._stop(candidate, q, np.zeros_like(q)).f
                if candidate.coordinate is not None
                else np.real(self._frame(every, candidate)[0])
                for candidate in self.candidates
            ],
            dtype=float,
        )

    def unit(self, candidate: OracleCandidate) -> float:
        """Of an angle the length, so that all gaps are lengths and all forces forces."""
        return self.least_length if candidate.angular else 1.0

    def _stop(self, candidate: OracleCandidate, q: Array, v: Array) -> Jet:
        """The coordinate of a stop along q + s v, with its derivatives by s."""
        line = [Jet(float(np.real(x)), float(np.real(x1))) for x, x1 in zip(q, v, strict=True)]
        every = np.array([*line, Jet(0.0), Jet(0.0), Jet(0.0)], dtype=object)
        found = self.unit(candidate) * candidate.coordinate(self.reference, every)
        return found if isinstance(found, Jet) else Jet(float(found))

    def rates(self, q: Array, v: Array, which: Sequence[int] | None = None) -> Array:
        """Rates of gaps, then of sliding (2 candidates, …), for velocities v (3n, …); of those
        contact candidates alone, or of all.
        """
        r = self.reference
        every, moves = r.with_ground(q), r.with_ground(v)
        across, along = [], []
        for candidate in self.candidates if which is None else [self.candidates[k] for k in which]:
            if candidate.coordinate is not None:
                columns = np.atleast_2d(v.T)
                rate = np.array([self._stop(candidate, q, column).f1 for column in columns])
                across.append(rate if v.ndim > 1 else rate[0])
                along.append(0.0 * across[-1])
                continue
            _, nx, ny, px, py = self._frame(every, candidate)
            ends = []
            for body in (candidate.circle.body, candidate.other.body):
                x, y, _ = r.pose(every, body)
                vx, vy, w = r.pose(moves, body)
                ends.append((vx - w * (py - y), vy + w * (px - x)))
            (ax, ay), (bx, by) = ends
            across.append(nx * (ax - bx) + ny * (ay - by))
            along.append(ny * (ax - bx) - nx * (ay - by))
        return np.array([*across, *along])

    def rows(self, q: Array, which: Sequence[int] | None = None) -> Array:
        """(2 candidates, 3n): rates are rows · v."""
        return self.rates(q, np.eye(len(q)), which).reshape(-1, len(q)).real

    def drift(self, q: Array, v: Array, which: Sequence[int] | None = None) -> Array:
        """Accelerations of the contacts at zero accelerations of the bodies, (2 points,)."""
        found = self.rates(q + 1j * tol.COMPLEX_STEP * v, v.astype(complex), which)
        drift = np.asarray(found.imag / tol.COMPLEX_STEP)
        for n, k in enumerate(range(len(self.candidates)) if which is None else which):
            if self.candidates[k].coordinate is not None:
                drift[n] = self._stop(self.candidates[k], q, v).f2
        return drift

    def length(self) -> float:
        """A length of the places: the greatest radius, or distance from a mass centre."""
        shapes = [one for one in self.candidates if one.coordinate is None]
        if not shapes:
            return self.least_length
        lengths = [math.hypot(*self.reference.arm(s.circle)) + s.radius for s in shapes]
        return max([*lengths, *(s.second_size for s in self.candidates)]) or 1.0


# -- Guards of contact modes for SciPy's integrators -------------------------------------------


class ModeGuard:
    """A function whose zero ends the modes, as the integrator takes it."""

    terminal, direction = True, -1.0
    next: tuple[int, str] = (0, "")
    #: What is added, so that what begins at zero, or by rounding below it, falls through zero.
    shift = 0.0

    def __init__(self, function: Any, *more: Any) -> None:
        self.function, self.more = function, more

    def __call__(self, t: float, y: Array) -> float:
        """Its value at a state."""
        return float(self.function(t, y, *self.more)) + self.shift

    def begin(self, t: float, y: Array, size: float) -> None:
        """Set the shift of what begins at a state, `size` being that of its terms."""
        value = self(t, y)
        self.shift = (
            tol.ORACLE_BEGINS_ABOVE * size - value
            if abs(value) <= tol.ORACLE_BEGINS_AT_ZERO * size
            else 0.0
        )


#: Steps of a motion at least, so that no gap closes and opens within one.
STEPS = 200
#: Closed contacts at once, of which all combinations are tried; events of one motion.
MOST_CLOSED, MOST_EVENTS = 6, 1000

OPEN, STICK, FORWARD, BACKWARD = "open", "stick", "slip+", "slip-"
SLIP_SIGN = {FORWARD: 1.0, BACKWARD: -1.0}


@dataclass(frozen=True)
class DenseEvent:
    """An instant at which modes change: impacts by name, or a change of modes alone."""

    t: float
    impact: tuple[str, ...]
    modes: tuple[str, ...]


@dataclass
class DenseContactMotion:
    """The motion of one mechanism with contacts.

    `reference`: Of the mechanism without its contacts.
    `drivers`: names of drivers that act
    `rtol`: Tolerance of the integrator.
    `events`: What has happened, the decision at the first instant included.
    """

    reference: Reference
    contacts: OracleContacts
    drivers: tuple[str, ...] = ()
    rtol: float = tol.RTOL_COMPARISON
    events: list[DenseEvent] = field(default_factory=list)
    #: Forces at the instants asked for, by their number; and why the motion ended before the last.
    acting: dict[int, dict[str, Array]] = field(default_factory=dict)
    failed: str = ""
    #: What was closed, and its modes, as decided last: all that have the same accelerations.
    decided: tuple[int, ...] = ()
    alternatives: list[tuple[str, ...]] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.mass = self.reference.mass_matrix()
        self.rows = self.reference.active_rows(self.drivers)
        self.size = self.contacts.length()
        self.velocity_scale = 0.0

    # -- one instant -----------------------------------------------------------------------------

    def _solve(
        self, constrained: Array, forces: Array, right: Array, target: Array
    ) -> tuple[Array, Array] | None:
        """x and λ from M x = right + forcesᵀ λ and the rows constrained · x = target, by least
        squares; None where that has no solution.
        """
        size = len(right)
        matrix = np.zeros((size + len(constrained), size + len(constrained)))
        matrix[:size, :size], matrix[:size, size:] = self.mass, -forces.T
        matrix[size:, :size] = constrained
        whole = np.concatenate([right, target])
        found = np.linalg.lstsq(matrix, whole, rcond=tol.LEAST_SQUARES_RANK_FINE)[0]
        off = np.abs(matrix @ found - whole).max(initial=0.0)
        if off > tol.ORACLE_EQUATIONS_LEFT * max(tol.TINY, np.abs(whole).max(initial=0.0)):
            return None
        return found[:size], found[size:]

    def _combined(
        self, q: Array, closed: Sequence[int], modes: Sequence[str], mu: Array, joints: Array
    ) -> tuple[Array, Array]:
        """Rows that are constrained, and along which the forces of their multipliers act."""
        W, m = self.contacts.rows(q, closed), len(closed)
        constrained, forces = [joints], [joints]
        for n, (k, mode) in enumerate(zip(closed, modes, strict=True)):
            if mode == OPEN:
                continue
            constrained.append(W[n : n + 1])
            slides = SLIP_SIGN.get(mode, 0.0) * mu[k]
            forces.append(W[n : n + 1] - slides * W[m + n : m + n + 1])
        for n, (k, mode) in enumerate(zip(closed, modes, strict=True)):
            if mode == STICK and mu[k] > 0.0:
                constrained.append(W[m + n : m + n + 1])
                forces.append(W[m + n : m + n + 1])
        return np.concatenate(constrained), np.concatenate(forces)

    def _forces(
        self, closed: Sequence[int], modes: Sequence[str], mu: Array, lam: Array
    ) -> tuple[Array, Array]:
        """(λ_N, λ_T) of all places, from the multipliers."""
        m, n = len(self.contacts), len(self.rows)
        normal, along = np.zeros(m), np.zeros(m)
        for k, mode in zip(closed, modes, strict=True):
            if mode != OPEN:
                normal[k], n = lam[n], n + 1
                along[k] = -SLIP_SIGN.get(mode, 0.0) * mu[k] * normal[k]
        for k, mode in zip(closed, modes, strict=True):
            if mode == STICK and mu[k] > 0.0:
                along[k], n = lam[n], n + 1
        return normal, along

    def accelerations(
        self, t: float, q: Array, v: Array, closed: Sequence[int], modes: Sequence[str], mu: Array
    ) -> tuple[Array, Array, Array] | None:
        """Accelerations, pressing forces and friction of closed contacts with given modes."""
        found = self._multipliers(t, q, v, closed, modes, mu)
        if found is None:
            return None
        return found[0], *self._forces(closed, modes, mu, found[1])

    def _multipliers(
        self, t: float, q: Array, v: Array, closed: Sequence[int], modes: Sequence[str], mu: Array
    ) -> tuple[Array, Array, Array] | None:
        """Accelerations, multipliers, and the rows along which these act."""
        r = self.reference
        joints = r.phi_q(q, t)[self.rows]
        constrained, forces = self._combined(q, closed, modes, mu, joints)
        drift, m = self.contacts.drift(q, v, closed), len(closed)
        known = [n for n, mode in enumerate(modes) if mode != OPEN]
        known += [m + n for n, k in enumerate(closed) if modes[n] == STICK and mu[k] > 0.0]
        target = np.concatenate([r.gamma(q, v, t)[self.rows], -drift[known]])
        found = self._solve(constrained, forces, r.applied(q, v, t), target)
        return None if found is None else (*found, forces)

    def forces(
        self, t: float, q: Array, v: Array, closed: Sequence[int], modes: Sequence[str]
    ) -> dict[str, Array] | None:
        """Accelerations as "", and by name what acts on body j of joints and contacts, and efforts;
        of what is not unique NaN.
        """
        mu = self._sliding(modes, closed)
        found = self._multipliers(t, q, v, closed, modes, mu)
        if found is None:
            return None
        a, lam, forces = found
        _, sizes, vt = np.linalg.svd(forces.T)
        rank = int((sizes > tol.LEAST_SQUARES_RANK * sizes.max(initial=0.0)).sum())
        # the multipliers, and those that have no effect
        first, *others = (
            self._named(t, q, closed, modes, mu, column) for column in np.vstack([lam, vt[rank:]])
        )
        for other in others:
            for name, part in other.items():
                first[name] = np.where(np.abs(part) < tol.ORACLE_FORCE_UNIQUE, first[name], np.nan)
        return first | {"": a}

    def _named(
        self, t: float, q: Array, closed: Sequence[int], modes: Sequence[str], mu: Array, lam: Array
    ) -> dict[str, Array]:
        """Wrenches of joints (Fx, Fy, T), forces of contacts (Fx, Fy), efforts, by multipliers."""
        r, whole = self.reference, np.zeros(self.reference.m)
        whole[self.rows] = -lam[: len(self.rows)]  # as contacts do, rows of joints push by +λ here
        found: dict[str, Any] = r.reactions(q, t, whole)
        found |= {name: -whole[r.rows[name]] for name in self.drivers}
        normal, along = self._forces(closed, modes, mu, lam)
        every = r.with_ground(q)
        for k, one in enumerate(self.contacts.candidates):
            if one.coordinate is not None:
                found[one.name] = np.array([normal[k] * self.contacts.unit(one)])
                continue
            _, nx, ny, _, _ = self.contacts._frame(every, one)
            force = np.array(
                [normal[k] * nx + along[k] * ny, normal[k] * ny - along[k] * nx], dtype=float
            )
            found[one.name] = found.get(one.name, 0.0) + (force if one.forwards else -force)
        return found

    def _mu(self, which: str) -> Array:
        return np.array([getattr(candidate, which) for candidate in self.contacts.candidates])

    def _choices(self, k: int, along: float, fast: float) -> tuple[str, ...]:
        if self.contacts.candidates[k].static == 0.0:
            return STICK, OPEN  # without friction sticking is touching
        if abs(along) > tol.ORACLE_VELOCITY_NONE * fast:
            return (FORWARD if along > 0.0 else BACKWARD), OPEN
        return STICK, FORWARD, BACKWARD, OPEN

    def decide(
        self, t: float, q: Array, v: Array, closed: Sequence[int], ended: Mapping[int, str]
    ) -> tuple[str, ...]:
        """The modes with which closed contacts that neither approach nor part go on; where rounding
        leaves several, that which `ended` names for a contact whose mode has come to its end.
        """
        self._few(closed)
        W, m = self.contacts.rows(q), len(self.contacts)
        rates, fast = W @ v, self._fast(v)
        drift = self.contacts.drift(q, v)
        choices = [
            sorted(self._choices(k, float(rates[m + k]), fast), key=lambda one: one != ended.get(k))
            for k in closed
        ]
        still = np.array([abs(rates[m + k]) <= tol.ORACLE_VELOCITY_NONE * fast for k in range(m)])
        mu = np.where(still, self._mu("static"), self._mu("friction"))
        free = self._freely(t, q, v)
        right: list[tuple[Array, float, tuple[str, ...]]] = []
        for modes in itertools.product(*choices):
            found = self.accelerations(t, q, v, closed, modes, mu)
            if found is None:
                continue
            a, normal, along = found
            change = W @ a + drift
            size = max(float(np.abs(change).max(initial=0.0)), free, tol.TINY) * tol.ORACLE_NONE
            press = max(float(np.abs(normal).max(initial=0.0)), tol.TINY) * tol.ORACLE_NONE
            if all(
                self._fits(k, mode, change, normal, along, mu, size, press, bool(still[k]))
                for k, mode in zip(closed, modes, strict=True)
            ):
                right.append((a, float(normal.sum()), modes))
        if not right:
            raise NotImplementedError(f"no accelerations at t = {t:.6g} fulfil Coulomb's law")
        first = right[0]
        # where all is at rest, what loads alone would give
        top = max(free, *(float(np.abs(a).max()) for a, *_ in right)) or 1.0
        if any(np.abs(a - first[0]).max() > tol.ORACLE_ACCELERATIONS_SAME * top for a, *_ in right):
            raise NotImplementedError(f"accelerations at t = {t:.6g} are not unique")
        self.alternatives = [modes for *_, modes in right]
        return first[2]

    def _fits(
        self,
        k: int,
        mode: str,
        change: Array,
        normal: Array,
        along: Array,
        mu: Array,
        size: float,
        press: float,
        still: bool,
    ) -> bool:
        if mode == OPEN:
            return bool(change[k] >= -size)
        if normal[k] < -press:
            return False
        if mode == STICK:
            return bool(abs(along[k]) <= mu[k] * normal[k] + press)
        m = len(self.contacts)
        return not still or bool(SLIP_SIGN[mode] * change[m + k] >= -size)

    def _freely(self, t: float, q: Array, v: Array) -> float:
        """The greatest acceleration by loads alone, of what has mass."""
        own = np.diag(self.mass)
        heavy = own > 0.0
        return float(np.abs(self.reference.applied(q, v, t)[heavy] / own[heavy]).max(initial=0.0))

    def _few(self, closed: Sequence[int]) -> None:
        if len(closed) > MOST_CLOSED:
            raise NotImplementedError(f"it tries all modes of at most {MOST_CLOSED} contacts")

    def _fast(self, v: Array) -> float:
        """The greatest velocity so far, or of a fall by the length of the places."""
        reference = np.tile([1.0, 1.0, self.size], len(v) // 3)
        self.velocity_scale = max(
            self.velocity_scale, float(np.abs(v * reference).max(initial=0.0))
        )
        return self.velocity_scale

    # -- impacts ---------------------------------------------------------------------------------

    def strike(self, t: float, q: Array, v: Array, closed: Sequence[int], plastic: bool) -> Array:
        """Velocities after an impact of closed contacts, compression then expansion."""
        self._few(closed)
        e = np.zeros(len(self.contacts)) if plastic else self._mu("restitution")
        newton = np.array([candidate.newton for candidate in self.contacts.candidates])
        before = (self.contacts.rows(q) @ v)[: len(e)]
        shift = np.where(newton, e * np.minimum(before, 0.0), 0.0)
        after, impulse = self._phase(t, q, v, closed, shift, np.zeros(len(e)))
        least = np.where(newton, 0.0, e) * impulse
        if not least.any():
            return after
        return self._phase(t, q, after, closed, shift, least)[0]

    def _phase(
        self, t: float, q: Array, v: Array, closed: Sequence[int], shift: Array, least: Array
    ) -> tuple[Array, Array]:
        """Velocities and normal impulses after one phase, in which each contact has an impulse of
        at least `least`, more only where its rate plus `shift` is zero.
        """
        r, m, mu = self.reference, len(self.contacts), self._mu("friction")
        W, joints = self.contacts.rows(q), r.phi_q(q, t)[self.rows]
        still = np.zeros(len(joints))
        fast, push = self._fast(v), float(np.abs(self.mass @ v).max(initial=0.0)) or 1.0
        kept = joints @ v
        for modes in itertools.product((STICK, FORWARD, BACKWARD, OPEN), repeat=len(closed)):
            for choice in self._sticking_choices(closed, modes, mu):
                # rows: rates that are known; columns: impulses, of which `least` acts in any case
                constrained, forces, target = [joints], [joints], [kept + still]
                fixed = np.zeros(len(v))
                for k, mode in zip(closed, modes, strict=True):
                    n, s = W[k : k + 1], W[m + k : m + k + 1]
                    row = n - SLIP_SIGN.get(mode, SLIP_SIGN.get(choice.get(k, ""), 0.0)) * mu[k] * s
                    fixed += least[k] * row[0]
                    if mode != OPEN:
                        constrained.append(n)
                        forces.append(row)
                        target.append(np.array([-shift[k]]))
                for k, mode in zip(closed, modes, strict=True):
                    if mu[k] > 0.0 and (mode == STICK or choice.get(k) == STICK):
                        constrained.append(W[m + k : m + k + 1])
                        forces.append(W[m + k : m + k + 1])
                        target.append(np.zeros(1))
                found = self._solve(
                    np.concatenate(constrained),
                    np.concatenate(forces),
                    self.mass @ v + fixed,
                    np.concatenate(target),
                )
                if found is None:
                    continue
                after, lam = found
                normal, along = least.copy(), np.zeros(m)
                at = len(joints)
                for k, mode in zip(closed, modes, strict=True):
                    if mode != OPEN:
                        normal[k], at = normal[k] + lam[at], at + 1
                for k, mode in zip(closed, modes, strict=True):
                    if mu[k] > 0.0 and (mode == STICK or choice.get(k) == STICK):
                        along[k], at = lam[at], at + 1
                rates = W @ after
                if self._strikes(
                    closed, modes, choice, rates, shift, normal, least, along, mu, fast, push
                ):
                    return after, normal
        raise NotImplementedError(f"no impulses at t = {t:.6g} fulfil the law of impact")

    def _sticking_choices(
        self, closed: Sequence[int], modes: Sequence[str], mu: Array
    ) -> Iterator[dict[int, str]]:
        """Friction of contacts that get no more than the least impulse, which may stick or slip."""
        which = [k for k, mode in zip(closed, modes, strict=True) if mode == OPEN and mu[k] > 0.0]
        for choice in itertools.product((STICK, FORWARD, BACKWARD), repeat=len(which)):
            yield dict(zip(which, choice, strict=True))

    def _strikes(
        self,
        closed: Sequence[int],
        modes: Sequence[str],
        choice: dict[int, str],
        rates: Array,
        shift: Array,
        normal: Array,
        least: Array,
        along: Array,
        mu: Array,
        fast: float,
        push: float,
    ) -> bool:
        m = len(self.contacts)
        for k, mode in zip(closed, modes, strict=True):
            if mode == OPEN and rates[k] + shift[k] < -tol.ORACLE_VELOCITY_NONE * fast:
                return False
            if normal[k] - least[k] < -tol.ORACLE_NONE * push:
                return False
            how = choice.get(k, mode)
            if how == STICK and abs(along[k]) > mu[k] * normal[k] + tol.ORACLE_NONE * push:
                return False
            if (
                how in SLIP_SIGN
                and mu[k] > 0.0
                and SLIP_SIGN[how] * rates[m + k] < -tol.ORACLE_VELOCITY_NONE * fast
            ):
                return False
        return True

    # -- the motion ------------------------------------------------------------------------------

    def motion(self, q: Array, v: Array, times: Array) -> tuple[Array, Array]:
        """Coordinates and velocities (instants, 3n) at ascending times, from the first on."""
        found = np.full((len(times), 2 * len(q)), np.nan)
        self._follow(q, v, np.asarray(times, float), 0, found)
        return found[:, : len(q)], found[:, len(q) :]

    def motion_while_found(self, q: Array, v: Array, times: Array, first: int) -> Array:
        """Coordinates (instants, 3n) from the instant of number `first` on; NaN before it, and from
        where the motion `failed` on.
        """
        found = np.full((len(times), 2 * len(q)), np.nan)
        try:
            self._follow(q, v, np.asarray(times, float), first, found)
        except NotImplementedError as error:
            self.failed = str(error)
        return found[:, : len(q)]

    def _follow(self, q: Array, v: Array, wanted: Array, first: int, found: Array) -> None:
        from scipy.integrate import solve_ivp

        t, end, n = float(wanted[first]), float(wanted[-1]), len(q)
        ended: dict[int, str] = {}
        self.velocity_scale = float(np.sqrt(self._freely(t, q, v) * self.size))
        at = int(np.searchsorted(wanted, t, side="right"))
        found[first:at] = np.concatenate([q, v])
        begun = first
        while t < end or begun < at:
            if len(self.events) > MOST_EVENTS:
                raise NotImplementedError(f"more than {MOST_EVENTS} events")
            q, v, closed, modes = self._transition(t, q, v, ended)
            unique = self._note_alternatives(range(begun, at), t, q, v)
            if not t < end:
                break
            if not unique:
                raise NotImplementedError(f"what sticks at t = {t:.6g} has no unique forces")
            guards = self._guards(t, q, v, closed, modes)
            span = solve_ivp(
                functools.partial(self._derivative, closed=closed, modes=modes),
                (t, end),
                np.concatenate([q, v]),
                method="DOP853",
                rtol=self.rtol,
                atol=0.1 * self.rtol * self.size,
                events=guards,
                max_step=(float(wanted[-1]) - float(wanted[0])) / STEPS,
                t_eval=wanted[at:],  # polynomials of the other steps are left out
            )
            if not span.success:
                raise NotImplementedError(f"its integrator ends after t = {t:.6g}")
            for t_k, y in zip(span.t, np.asarray(span.y).T, strict=True):
                found[at] = y
                self._note_forces(at, float(t_k), y[:n], y[n:], closed, modes)
                at += 1
            begun = at
            if span.status == 0:
                break
            ((t, y),) = (
                (float(when[-1]), states[-1])
                for when, states in zip(span.t_events, span.y_events, strict=True)
                if len(when)
            )
            q, v = y[:n], y[n:]
            ended = dict(
                guard.next
                for guard, when in zip(guards, span.t_events, strict=True)
                if len(when) and guard.next[1]
            )

    def _note_alternatives(self, instants: Sequence[int], t: float, q: Array, v: Array) -> bool:
        """Note the forces of instants at which modes were decided; whether friction of all that may
        stick is unique at every place.
        """
        found = [self.forces(t, q, v, self.decided, modes) for modes in self.alternatives]
        first, *others = [one for one in found if one is not None]
        size = max(float(np.nanmax(np.abs(one), initial=0.0)) for one in first.values())
        for other in others:
            for name in first.keys() - {""}:
                same = np.abs(other[name] - first[name]) <= tol.ORACLE_ACCELERATIONS_SAME * size
                first[name] = np.where(same, first[name], np.nan)
        self.acting |= {k: first for k in instants}
        # what sticks in one of them might stick with all others that press
        by_place = list(zip(*self.alternatives, strict=True))
        if not any(STICK in some for some in by_place):
            return True
        modes = [OPEN if set(some) == {OPEN} else STICK for some in by_place]
        fast, rates = self._fast(v), self.contacts.rows(q) @ v
        for n, k in enumerate(self.decided):
            slides = rates[len(self.contacts) + k]
            if modes[n] == STICK and abs(slides) > tol.ORACLE_VELOCITY_NONE * fast:
                modes[n] = FORWARD if slides > 0.0 else BACKWARD
        joints = self.reference.phi_q(q, t)[self.rows]
        mu = self._sliding(modes, self.decided)
        _, rows = self._combined(q, self.decided, modes, mu, joints)
        _, sizes, vt = np.linalg.svd(rows.T)
        free = vt[int((sizes > tol.LEAST_SQUARES_RANK * sizes.max(initial=0.0)).sum()) :]
        sticking = sum(
            mode == STICK and mu[k] > 0.0 for k, mode in zip(self.decided, modes, strict=True)
        )
        alone = np.abs(free[:, len(rows) - sticking :]).max(initial=0.0)
        return bool(alone < tol.ORACLE_FORCE_UNIQUE)

    def _note_forces(
        self, k: int, t: float, q: Array, v: Array, closed: Sequence[int], modes: Sequence[str]
    ) -> None:
        forces = self.forces(t, q, v, closed, modes)
        if forces is not None:
            self.acting[k] = forces

    def _transition(
        self, t: float, q: Array, v: Array, ended: Mapping[int, str]
    ) -> tuple[Array, Array, tuple[int, ...], tuple[str, ...]]:
        """Impacts until nothing approaches, then the modes of what is closed."""
        struck: list[str] = []
        for attempt in range(20):
            gaps, rates = self.contacts.gaps(q), self.contacts.rows(q) @ v
            pressing = [k for k in range(len(gaps)) if gaps[k] <= tol.ORACLE_NONE * self.size]
            fast = self._fast(v)
            hits = [k for k in pressing if rates[k] < -tol.ORACLE_VELOCITY_NONE * fast]
            if not hits:
                break
            struck += [self.contacts.candidates[k].name for k in hits]
            v = self.strike(t, q, v, pressing, self._last_flight(q, v, pressing) or attempt > 10)
        closed = tuple(k for k in pressing if rates[k] <= tol.ORACLE_VELOCITY_NONE * fast)
        modes = self.decide(t, q, v, closed, ended)
        self.decided = closed
        lasting = tuple(k for k, mode in zip(closed, modes, strict=True) if mode != OPEN)
        kept = tuple(mode for mode in modes if mode != OPEN)
        every = [OPEN] * len(self.contacts)
        for k, mode in zip(lasting, kept, strict=True):
            every[k] = mode
        self.events.append(DenseEvent(t, tuple(struck), tuple(every)))
        return q, v, lasting, kept

    def _last_flight(self, q: Array, v: Array, pressing: Sequence[int]) -> bool:
        """Whether rebounds are so slow that all that follow are one instant."""
        e, rates = self._mu("restitution"), self.contacts.rows(q) @ v
        free = self._freely(0.0, q, v) or 1.0
        rebound = max((-e[k] * rates[k] for k in pressing), default=0.0)
        return bool(
            2.0 * rebound / free
            < tol.CONTACT_FLIGHT_SHORTEST_ORACLE * np.sqrt(2.0 * self.size / free)
        )

    def _derivative(self, t: float, y: Array, closed: Sequence[int], modes: Sequence[str]) -> Array:
        n = len(y) // 2
        found = self.accelerations(t, y[:n], y[n:], closed, modes, self._sliding(modes, closed))
        if found is None:
            raise NotImplementedError(f"no accelerations at t = {t:.6g}")
        return np.concatenate([y[n:], found[0]])

    def _sliding(self, modes: Sequence[str], closed: Sequence[int]) -> Array:
        """Kinetic coefficients, static ones of what sticks."""
        mu = self._mu("friction")
        for k, mode in zip(closed, modes, strict=True):
            if mode == STICK:
                mu[k] = self.contacts.candidates[k].static
        return mu

    def _guards(
        self, t: float, q: Array, v: Array, closed: Sequence[int], modes: Sequence[str]
    ) -> list[ModeGuard]:
        """Functions whose zeros end the modes that begin at t."""
        n, m = 3 * self.reference.n, len(self.contacts)
        mu = self._sliding(modes, closed)

        last: dict[bytes, tuple[Array, Array, Array]] = {}

        def forces(t: float, y: Array) -> tuple[Array, Array, Array]:
            key = np.append(y, t).tobytes()  # all guards are read at the same places
            if key not in last:
                found = self.accelerations(t, y[:n], y[n:], closed, modes, mu)
                assert found is not None
                last.clear()
                last[key] = found
            return last[key]

        guards: list[ModeGuard] = []

        def add(guard: ModeGuard, k: int, following: str = "") -> None:
            guard.next = k, following
            guards.append(guard)

        # what parts begins with a gap that counts as one, or its first zero would be the start
        first = self.contacts.gaps(q)
        beyond = np.where(
            first <= tol.ORACLE_NONE * self.size,
            tol.ORACLE_GAP_PARTED * self.size - first,
            0.0,
        )

        def gap(t: float, y: Array, k: int) -> float:
            return float(self.contacts.gaps(y[:n])[k] + max(0.0, beyond[k]))

        def pressing(t: float, y: Array, k: int) -> float:
            return float(forces(t, y)[1][k])

        def reserve(t: float, y: Array, k: int, sign: float) -> float:
            _, normal, along = forces(t, y)
            return float(mu[k] * normal[k] - sign * along[k])

        def sliding(t: float, y: Array, k: int, slip_sign: float) -> float:
            return float(slip_sign * self.contacts.rates(y[:n], y[n:])[m + k])

        for k in range(m):
            if k not in closed:
                add(ModeGuard(gap, k), k)
        for k, mode in zip(closed, modes, strict=True):
            add(ModeGuard(pressing, k), k, OPEN)
            if mode == STICK and mu[k] > 0.0:
                # friction at its limit forwards: it begins to slide backwards
                add(ModeGuard(reserve, k, 1.0), k, BACKWARD)
                add(ModeGuard(reserve, k, -1.0), k, FORWARD)
            elif mode in SLIP_SIGN:
                add(ModeGuard(sliding, k, SLIP_SIGN[mode]), k)
        y = np.concatenate([q, v])
        for guard in guards:
            if guard.function in (pressing, reserve):
                guard.begin(t, y, float(np.abs(np.append(*forces(t, y)[1:])).max()))
        return guards


# -- The cross-check by the oracle of a motion with contacts ---------------------------------------

#: Events that the oracle may leave out: what is decided at the first instant, and where infinitely
#: many impacts end.
UNTIMED = ("rest", "indeterminate", "inconsistent", "paradox")


def contact_crosscheck(system: System, run: Solution) -> CrosscheckResult:
    """Positions at all instants, and the instants of the events."""
    machine = system.mechanism
    if any(joint.can_separate for joint in machine.joints):
        raise NotImplementedError("it has no joints that separate")
    if any(has_friction(joint) for joint in machine.joints):
        raise NotImplementedError("it has no friction of joints in motions over time")
    if machine.states or machine.inputs or machine.controllers:
        raise NotImplementedError("it follows contacts without auxiliary states and controllers")
    if machine.simulation is not None and machine.simulation.release:
        raise NotImplementedError("it follows contacts without drivers that are released")
    own = own_tolerance(run)
    sharp = _Motions(system, run, tol.RTOL_COMPARISON)
    coarse = _Motions(system, run, max(own, 10.0 * tol.RTOL_COMPARISON))
    there = np.flatnonzero(np.isfinite(sharp.places).all(axis=1))
    there = there[np.isfinite(coarse.places[there]).all(axis=1)]
    if not len(there) and not sharp.acting:
        raise NotImplementedError(sharp.why)
    comparison = Comparison()
    comparison.size("place", system.length)
    comparison.size("angle", 1.0)
    differences: dict[str, Array] = {}

    def compare(kind: str, name: str, ours: Any, theirs: Array, rough: Array) -> None:
        comparison.add(kind, name, ours, theirs)
        off = np.abs(rough - theirs)
        differences[kind] = np.maximum(differences.get(kind, 0.0), off)

    for n, body in enumerate(machine.bodies):
        for part, key in enumerate(("x", "y", "angle")):
            kind, ours = "angle" if key == "angle" else "place", getattr(run[body.name], key)
            c = 3 * n + part
            pair = sharp.places[there, c], coarse.places[there, c]
            compare(kind, f"{body.name}.{key}", ours[there], *pair)
    _compare_forces(run, sharp, coarse, compare)
    comparison.size("torque", system.length * comparison.top("force"))
    comparison.size("acceleration", sharp.freely)
    comparison.size("turned", comparison.top("acceleration") / system.length)
    # an error that has come in once may grow and stays; the least is that of a step of ours
    least = tol.COMPARISON_LEAST_ORACLE + tol.COMPARISON_MARGIN_ORACLE * own
    limits: dict[str, Array | float] = {
        kind: least
        + tol.COMPARISON_MARGIN_ORACLE * np.maximum.accumulate(off) / (comparison.top(kind) or 1.0)
        for kind, off in differences.items()
    }
    times = sharp.times
    for event in run.events:
        if event.contact and event.name not in UNTIMED and sharp.follows(event.t):
            nearest = float(times[np.abs(times - event.t).argmin()]) if len(times) else math.nan
            comparison.add("instant", f"{event.contact}: {event.name}", event.t, nearest)
    span = float(run.t[-1] - run.t[0])
    comparison.size("instant", span)
    late = coarse.times
    shift = max((float(np.abs(late - one).min()) for one in times), default=0.0) if len(late) else 0
    limits["instant"] = tol.COMPARISON_LEAST_ORACLE + tol.COMPARISON_MARGIN_ORACLE * shift / (
        comparison.top("instant") or 1.0
    )
    kinds = comparison.kinds
    why = f"error of a motion of the tolerance {own:g}, as the oracle has it with that"
    rows = comparison.rows({kind: limits[kind] for kind in kinds}, dict.fromkeys(kinds, why))
    notes = [f"all modes of the contacts were tried at {len(times) + 1} instants"]
    if sharp.why:
        left = len(run) - len(there)
        notes.append(f"the motion is not compared at {left} of {len(run)} instants: {sharp.why}")
    return CrosscheckResult("oracle", tuple(rows), (), tuple(notes))


def every_contact(machine: Mechanism) -> list[OneSided]:
    """The contacts of a mechanism, and the limits of its joints."""
    found = list(machine.contacts)
    names = {one.name for one in found}
    return found + [one for one in limits_of(machine) if one.name not in names]


def own_tolerance(run: Solution) -> float:
    """The tolerance of the steps of a motion."""
    if run.restart is not None:
        return run.restart.settings.rtol
    simulation = run.mechanism.simulation
    return tol.RTOL_DEFAULT if simulation is None else simulation.rtol


#: Into how many parts a motion that is not found is divided: the oracle begins again in each.
MOST_BEGINNINGS = 25


class _Motions:
    """The oracle's motion from the first instant on, and again from our state after each instant
    from which it does not go on.

    `places` (instants, 3n): NaN at instants that it did not reach by a motion of its own.
    `acting`: Forces by the number of the instant. `times`: When modes change.
    `freely`: Greatest acceleration by loads alone. `why`: Why it ended first.
    """

    def __init__(self, system: System, run: Solution, rtol: float) -> None:
        reference = Reference(system.mechanism)
        contacts = OracleContacts(reference, every_contact(system.mechanism), system.length)
        drivers = tuple(driver.name for driver in system.drivers)
        self.run, self.why, times = run, "", []
        self.spans: list[tuple[float, float]] = []
        self.freely = 0.0
        self.acting: dict[int, dict[str, Array]] = {}
        self.places = np.full((len(run), 3 * reference.n), np.nan)
        first, count = 0, 0
        while first < len(run) and count < 2 * MOST_BEGINNINGS:
            dense = DenseContactMotion(reference, contacts, drivers, rtol)
            q, v = self._state(first)
            self.freely = max(self.freely, dense._freely(float(run.t[first]), q, v))
            found = dense.motion_while_found(q, v, run.t, first)
            reached = np.flatnonzero(np.isfinite(found).all(axis=1))
            last = int(reached[-1]) if len(reached) else first
            # what begins again compares nothing there but forces
            own = reached[reached > first] if first else reached[reached >= (not dense.events)]
            self.places[own] = found[own]
            self.acting |= dense.acting
            begin, end = float(run.t[first]), float(run.t[last])
            self.spans.append((begin, end))
            times += [one.t for one in dense.events if begin < one.t <= end]
            self.why = self.why or dense.failed
            first, count = self._next(last, first, dense.failed), count + 1
        self.times = np.array(times)

    def _state(self, k: int) -> tuple[Array, Array]:
        bodies = [self.run[body.name] for body in self.run.mechanism.bodies]
        q, v = (
            np.array([float(getattr(body, key)[k]) for body in bodies for key in keys])
            for keys in (("x", "y", "angle"), ("vx", "vy", "omega"))
        )
        return q, v

    def _next(self, last: int, first: int, failed: str) -> int:
        """The instant to begin at again: the last that was reached, or where none was one behind
        our next event, and not far away.
        """
        if not failed:
            return len(self.run)
        if last > first:
            return last
        t, stride = self.run.t, max(1, len(self.run) // MOST_BEGINNINGS)
        event = min((one.t for one in self.run.events if one.t > t[first]), default=math.inf)
        behind = int(np.searchsorted(t, event, side="right"))
        return max(first + 1, min(behind, first + stride))

    def follows(self, t: float) -> bool:
        """Whether a motion of its own goes over an instant."""
        return any(begin < t <= end for begin, end in self.spans)


def _compare_forces(run: Solution, sharp: _Motions, coarse: _Motions, compare: Any) -> None:
    """Forces of contacts and joints, and efforts, at instants away from those of the events."""
    span = float(run.t[-1] - run.t[0])
    changes = np.array([*(one.t for one in run.events), *sharp.times, math.inf])
    near = tol.ORACLE_EVENT_NEAR * span
    at = [
        k
        for k in sorted(sharp.acting.keys() & coarse.acting.keys())
        if np.abs(changes - run.t[k]).min() > near
    ]
    if not at:
        return
    bodies = run.mechanism.bodies
    pair = [np.array([one.acting[k][""] for k in at]) for one in (sharp, coarse)]
    for n, body in enumerate(bodies):
        for part, key in enumerate(("ax", "ay", "alpha")):
            kind, c = ("turned" if part == 2 else "acceleration"), 3 * n + part
            ours = getattr(run[body.name], key)[at]
            compare(kind, f"{body.name}.{key}", ours, *(one[:, c] for one in pair))
    plain = [one for one in run.mechanism.contacts if isinstance(one, Stop | JointLimit)]
    shapes = [one for one in acting_contacts(run) if one not in plain]
    elements: list[Any] = [*run.mechanism.joints, *shapes]
    for element in elements:
        ours = run.reaction(element.name)
        unique = ours.unique if ours.unique is not None else (True, True, True)
        table = [np.array([one.acting[k][element.name] for k in at]) for one in (sharp, coarse)]
        for part, key in enumerate(("fx", "fy", "torque")[: table[0].shape[1]]):
            theirs, rough = (one[:, part] for one in table)
            if unique[part] and np.isfinite(theirs).all() and np.isfinite(rough).all():
                kind = "torque" if part == 2 else "force"
                compare(kind, f"{element.name}.{key}", getattr(ours, key)[at], theirs, rough)
    for stop in plain:
        pair = [np.array([one.acting[k][stop.name][0] for k in at]) for one in (sharp, coarse)]
        if np.isfinite(pair).all():
            kind = "torque" if stop.quantities()["contact"] == "torque" else "force"
            compare(kind, f"{stop.name}.contact", run.contact(stop.name)[at], *pair)
    for driver in run.system.drivers:
        pair = [np.array([one.acting[k][driver.name][0] for k in at]) for one in (sharp, coarse)]
        if np.isfinite(pair).all():
            ours = run.effort(driver.name)[at]
            compare(driver.effort_dimension, f"{driver.name}.effort", ours, *pair)
