"""Where contacts touch, which way they press and with what force, over a whole motion."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from mbody.core.tolerances import CONTACT_GAP_CLOSED_RESULT, FRICTION_STICKS, TINY
from mbody.model.contact import Arc, Contact, ContactCandidate, OneSided, Rope
from mbody.solution.histories import Place, moved, place

if TYPE_CHECKING:
    from mbody.solution.solution import Solution


Array = np.ndarray

#: Origin, the body whose angle they have, and where they point to.
Axes = tuple[Place, str, Place | None]


@dataclass(frozen=True, eq=False)
class ContactPointHistory:
    """One place where a contact may touch, over the instants of a motion.

    `contact`, `i`, `j`: Names of the contact, and of its two bodies.
    `place` (instants, 2): On the surface of j.
    `normal` (instants, 2): Unit vector from i to j.
    `force` (instants, 2): On j by i; zero where it is open.
    `gap` (instants,): Between the surfaces.
    `closed`, `touching` (instants,): The second one of whatever mode, with a force or without.
    `friction`, `static`: Coefficients of what slides and of what sticks.
    `mode`: Of its contact at every instant, "open" where this place is.
    `axes`: Axes in which place and normal do not change while it is closed: their origin, and the
      body whose angle they have, or the place to which they point.
    `round`: Whether a circle is in it.
    """

    contact: str
    i: str
    j: str
    place: Array
    normal: Array
    force: Array
    gap: Array
    closed: Array
    touching: Array
    friction: float
    static: float
    mode: list[str]
    axes: Axes | None
    round: bool

    @property
    def other(self) -> Array:
        """The nearest place on i: (instants, 2)."""
        return np.asarray(self.place - self.gap[:, None] * self.normal)


def contact_points_of(run: Solution, contact: Any) -> list[ContactPointHistory]:
    """The places where a contact may touch, of a motion in which its modes were decided; those of
    a rope are none.
    """
    if not isinstance(contact, Contact) or contact.name not in run.modes or run.stepped is not None:
        return []
    candidates = contact.candidates(run.system.numbers)
    return [_history(run, contact, candidates, n) for n in range(len(candidates))]


def contact_points_at(run: Solution, k: int, name: str) -> list[ContactPointHistory]:
    """Contact points of one contact, group or rope at one instant: the closed ones or, of an open
    contact, the nearest; of steps with impulses those in contact.
    """
    if run.stepped is not None:
        return _stepped(run, k, name)
    element: Any = run.mechanism[name]
    if isinstance(element, Rope):
        return _rope(run, k, element)
    own = [_instant(one, k) for one in contact_points_of(run, element)]
    closed = [one for one in own if one.closed[0]]
    if closed or not own:
        return closed
    return [min(own, key=lambda one: _away(one))]


def _rope(run: Solution, k: int, rope: Rope) -> list[ContactPointHistory]:
    """The end of a rope on j, where it is taut; its normal points along the pull."""
    if rope.name not in run.modes or run.mode(rope.name)[k] == "open":
        return []
    i, j = (np.column_stack(place(run, rope, side))[k] for side in "ij")
    own = run.reaction(rope.name)
    force = np.array([[own.fx[k], own.fy[k]]])
    normal = (i - j) / max(float(np.hypot(*(i - j))), TINY)
    zero, closed = np.zeros(1), np.ones(1, dtype=bool)
    ends = (rope.i.body, rope.j.body)
    return [
        ContactPointHistory(
            rope.name,
            *ends,
            j[None],
            normal[None],
            force,
            zero,
            closed,
            closed,
            0.0,
            0.0,
            ["stick"],
            None,
            False,
        )
    ]


def _away(one: ContactPointHistory) -> float:
    """Gap of a place; behind an edge it is none."""
    gap = float(one.gap[0])
    return gap if gap > 0.0 else np.inf


def _instant(one: ContactPointHistory, k: int) -> ContactPointHistory:
    arrays = {
        key: getattr(one, key)[k : k + 1]
        for key in ("place", "normal", "force", "gap", "closed", "touching")
    }
    fields = ("contact", "i", "j", "friction", "static", "axes", "round")
    return ContactPointHistory(
        **arrays, mode=[one.mode[k]], **{key: getattr(one, key) for key in fields}
    )


def _history(
    run: Solution, contact: OneSided, candidates: list[ContactCandidate], n: int
) -> ContactPointHistory:
    candidate = candidates[n]
    own: tuple[str, str] = contact.bodies  # type: ignore[assignment]  # a contact has two
    first, second = own[::-1] if candidate.swapped else own
    position = float(candidate.position[0]), float(candidate.position[1])
    tip: Place = (second, *position)
    if candidate.contour is not None:
        place, normal, gap, along, axes = _contour(run, candidate, first, tip)
    elif candidate.edge is None:
        place, normal, gap, along, axes = _round(run, candidate, first, tip)
    else:
        place, normal, gap, along, axes = _edge(run, candidate, first, tip)
    for arc in candidate.arcs:
        along = along & _on_arc(run, candidate, arc, normal, (first, second))
    if candidate.swapped:
        place, normal = place - gap[:, None] * normal, -normal
    force = np.zeros((len(run), 2))
    sides = run.system.primitives_of[contact.name]
    for e in (sides[n], *sides[len(candidates) + n : len(candidates) + n + 1]):
        force += np.column_stack([run.primitive_history(e, part) for part in (2, 3)])
    force = -force if candidate.swapped else force
    words = run.mode(contact.name)
    touching = (np.abs(gap) <= CONTACT_GAP_CLOSED_RESULT * run.system.length) & along
    closed = touching & np.array([word != "open" for word in words])
    mode = [word if shut else "open" for word, shut in zip(words, closed, strict=True)]
    mu, static = contact.coefficients(run.system.numbers)
    numbers = float(mu), float(static)
    return ContactPointHistory(
        contact.name,
        *own,
        place,
        normal,
        force,
        gap,
        closed,
        touching,
        *numbers,
        mode,
        axes,
        candidate.round,
    )


def _edge(
    run: Solution, candidate: ContactCandidate, first: str, tip: Place
) -> tuple[Array, Array, Array, Array, Axes]:
    """A corner or circle on a straight edge."""
    assert candidate.edge is not None
    (ax, ay), (ux, uy), length = candidate.edge
    begin = moved(run, (first, float(ax), float(ay)))
    angle = run[first].angle
    c, s = np.cos(angle), np.sin(angle)
    u = np.column_stack([c * ux - s * uy, s * ux + c * uy])
    normal = np.column_stack([-u[:, 1], u[:, 0]])
    centre, radius = moved(run, tip), float(candidate.edge_radius)
    away = centre - begin
    gap = (away * normal).sum(axis=1) - radius
    along_edge = (away * u).sum(axis=1)
    tolerance = CONTACT_GAP_CLOSED_RESULT * run.system.length
    endless = not np.isfinite(length)
    along = endless | ((along_edge >= -tolerance) & (along_edge <= float(length) + tolerance))
    return centre - radius * normal, normal, gap, along, (tip, first, None)


def _contour(
    run: Solution, candidate: ContactCandidate, first: str, tip: Place
) -> tuple[Array, Array, Array, Array, None]:
    """A point or circle on a curve."""
    assert candidate.contour is not None
    x, y = (float(part) for part in candidate.normal.parameters[:2])
    centre, angle = moved(run, tip), run[first].angle
    d = (centre - moved(run, (first, x, y))) @ (1.0, 1.0j) * np.exp(-1j * angle)
    D, s, phi, _ = candidate.contour.feet(np.column_stack([d.real, d.imag])).T
    normal = np.column_stack([-np.sin(phi + angle), np.cos(phi + angle)])
    radius = float(candidate.edge_radius)
    tolerance = CONTACT_GAP_CLOSED_RESULT * run.system.length
    within = (s >= -tolerance) & (s <= candidate.contour.length + tolerance)
    along = within | np.array(candidate.contour.closed)
    return centre - radius * normal, normal, D - radius, along, None


def _round(
    run: Solution, candidate: ContactCandidate, first: str, tip: Place
) -> tuple[Array, Array, Array, Array, Axes]:
    """Two circles, of which one may be hollow."""
    x, y = (float(part) for part in candidate.normal.parameters[:2])
    assert candidate.normal.signal is not None and candidate.tangent is not None
    distance = float(candidate.normal.signal.parameters[0])  # the sum of the radii
    ri = float(candidate.tangent.parameters[4]) * distance
    start: Place = (first, x, y)
    here, there = moved(run, start), moved(run, tip)
    separation = there - here
    length = np.hypot(*separation.T)
    d = separation / np.maximum(length, TINY)[:, None]
    gap = candidate.sign * (length - distance)
    normal = candidate.sign * d
    place = here + ri * d + gap[:, None] * normal
    always = np.ones(len(run), dtype=bool)
    return place, normal, gap, always, (start, "", tip)


def _on_arc(
    run: Solution, candidate: ContactCandidate, arc: Arc, normal: Array, bodies: tuple[str, str]
) -> Array:
    """Whether a place is on an arc, (instants,); `normal` from the first body to the second."""
    outwards = normal * (-1.0 if arc.ahead is None else arc.ahead * candidate.sign)
    angle = run[bodies[arc.second]].angle + float(arc.begin)
    half = 0.5 * float(arc.extent)
    past = np.arctan2(outwards[:, 1], outwards[:, 0]) - angle - half
    off = np.abs(np.remainder(past + np.pi, 2.0 * np.pi) - np.pi) - half
    return np.asarray(float(arc.radius) * off <= CONTACT_GAP_CLOSED_RESULT * run.system.length)


def _stepped(run: Solution, k: int, name: str) -> list[ContactPointHistory]:
    """Contact points at an instant of a motion by steps with impulses."""
    assert run.stepped is not None
    found = run.stepped.touching(k, name)
    x, y = found.force
    element: Any = run.mechanism[name]
    at = run.system.numbers
    mu = static = 0.0
    if not isinstance(element, Rope):
        mu = float(at[f"{name}.friction"])
        static = mu if element.static is None else float(at[f"{name}.static"])
    points = []
    for n in range(len(found)):
        normal = np.array([[found.nx[n], found.ny[n]]])
        edge = mu * found.normal[n] * FRICTION_STICKS
        slides = abs(found.tangential[n]) >= edge
        points.append(
            ContactPointHistory(
                name,
                found.i[n].partition(".")[0],
                found.j[n].partition(".")[0],
                np.array([[found.x[n], found.y[n]]]),
                normal,
                np.array([[x[n], y[n]]]),
                np.zeros(1),
                np.ones(1, dtype=bool),
                np.ones(1, dtype=bool),
                mu,
                static,
                ["slip+" if slides else "stick"],
                None,
                False,
            )
        )
    return points
