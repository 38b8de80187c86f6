"""Impacts of closed contacts, and what overlaps at the beginning."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mbody.analysis.contact.contact_laws import ClosedContacts, impact_impulses
from mbody.analysis.contact.overlaps import Overlap, deepest_overlap
from mbody.analysis.contact.unilateral import Rows, Unilateral
from mbody.analysis.dynamics.rate_jumps import works_of_drivers
from mbody.errors import ModelError, SolveError
from mbody.kernels.layout import Work
from mbody.system.rank import dense, dense_rates, rank_of

__all__ = [
    "Impact",
    "arrest",
    "first_overlap",
    "refuse_led",
    "responses_to",
    "strike",
    "touch_rows",
]

Array = np.ndarray

#: The least inertia along a direction, as a part of the greatest, that is not for want of masses.
MASSLESS = 1e-14
#: A touch that moves so little by an impulse, as a part of what its body would, is led.
LED = 1e-9
#: Impulses of touches that depend on others to this part are shared.
DEPENDENT = 1e-12


@dataclass(frozen=True, eq=False)
class Impact:
    """An impact.

    Attributes
    ----------
    jump : array (coordinates,)
        By which the velocities change.
    before : array (touches,)
        Rates of the gaps before it, of those that were closed.
    gained : array (touches,)
        Kinetic energy by each, below zero where it took.
    moved : array (touches,)
        What the motion of each gave, of stops that move.
    driven : dict
        What drivers gave, by name, of those that lead bodies at that instant.
    """

    jump: Array
    before: Array
    gained: Array
    moved: Array
    driven: dict[str, float]


def responses_to(uni: Unilateral, work: Work, block: Array, sticking: Array | None = None) -> Array:
    """How velocities change by an impulse along each row: M⁻¹ blockᵀ, (coordinates, rows), as far
    as joints allow; `sticking` are further rows that hold, (rows, coordinates).

    N (Nᵀ M N)⁻¹ Nᵀ, N the free directions: bodies without mass are ordinary where joints guide
    them.
    """
    system, n = uni.system, block.shape[1]
    scale = system.coordinate_units
    G = dense(system, work)[1]
    if sticking is not None and len(sticking):
        size = np.linalg.norm(sticking * scale, axis=1, keepdims=True)
        G = np.vstack([G, sticking * scale / np.where(size > 0.0, size, 1.0)])
    motions = rank_of(G).motions if len(G) else np.eye(n)
    if not len(motions):
        return np.zeros((n, len(block)))
    inertia = (motions * (system.mass[:n, 0] * scale**2)) @ motions.T
    along = motions @ (block * scale).T
    if np.linalg.cond(inertia) < 1.0 / MASSLESS:
        way = np.linalg.solve(inertia, along)
    else:
        way = np.linalg.lstsq(inertia, along, rcond=MASSLESS)[0]
    return np.asarray(scale[:, None] * (motions.T @ way))


def touch_rows(uni: Unilateral, rows: Rows, closed: list[int]) -> tuple[Array, Array]:
    """Rows (2 m, coordinates) of the gaps and of sliding of some touches, and their rates."""
    n3 = rows.block.shape[1]
    found, rates = np.zeros((2 * len(closed), n3)), np.zeros(2 * len(closed))
    for k, number in enumerate(closed):
        touch = uni.touches[number]
        found[k] = touch.spot.sense * rows.block[touch.normal]
        rates[k] = touch.spot.sense * rows.rate[touch.normal]
        if touch.tangent >= 0:
            found[len(closed) + k] = rows.block[touch.tangent]
            rates[len(closed) + k] = rows.rate[touch.tangent]
    return found, rates


def strike(
    uni: Unilateral,
    work: Work,
    closed: list[int],
    *,
    still: bool = False,
    sticking: Array | None = None,
    without_collision: bool = False,
) -> Impact | None:
    """An impact of closed touches at the state in the workspace; None where it has no solution.

    Parameters
    ----------
    still : bool
        Without restitution.
    sticking : array (rows, coordinates), optional
        Rows of joints that go on to stick.
    without_collision : bool
        See `impact_impulses`.
    """
    W, rates = touch_rows(uni, uni.read(work), closed)
    touches = [uni.touches[k] for k in closed]
    Y = responses_to(uni, work, W, sticking)
    friction = np.array([one.friction for one in touches])
    contacts = ClosedContacts(W @ Y, friction, np.where(friction > 0.0, 0.0, 1.0))
    restitution = np.array([0.0 if still else one.restitution for one in touches])
    newton = np.array([one.law == "newton" for one in touches])
    impulse = impact_impulses(
        contacts, rates, restitution, newton, without_collision=without_collision
    )
    if impulse is None:
        return None
    jump, m = Y @ impulse, len(closed)
    mean = rates + 0.5 * (W @ jump)
    gained = impulse * mean
    moved = impulse * (W @ work.v[: W.shape[1], 0] - rates)
    left = uni.system.mass[: len(jump), 0] * jump - W.T @ impulse
    nu = dense_rates(uni.system, work)
    driven = works_of_drivers(uni.system, work, left, nu, sticking)
    return Impact(jump, rates[:m], gained[:m] + gained[m:], moved[:m], driven)


def refuse_led(uni: Unilateral, work: Work, hit: list[int]) -> None:
    """Refuse an impact of what drivers lead.

    Raises
    ------
    SolveError
        Where no velocity that is free changes the approach of a touch.
    """
    system = uni.system
    W = touch_rows(uni, uni.read(work), hit)[0][: len(hit)]
    sizes = np.linalg.norm(W * system.coordinate_units, axis=1)
    moved = np.linalg.norm(responses_to(uni, work, W) / system.coordinate_units[:, None], axis=0)
    usual = float(system.mass[: W.shape[1], 0].max()) * system.length**2
    for k, number in enumerate(hit):
        if not moved[k] * usual > LED * sizes[k]:
            name = uni.touches[number].name
            raise SolveError(
                f"nothing that strikes '{name}' is free to rebound: it follows drivers alone; take "
                "them off, or record when it is reached by an Event",
                name,
            )


def arrest(uni: Unilateral, work: Work, closed: list[int]) -> Impact:
    """The gaps of closed touches neither open nor close any more, nor does what stuck begin to
    slide: impulses of least norm where touches depend on each other.
    """
    W, rates = touch_rows(uni, uni.read(work), closed)
    m = len(closed)
    # what slides faster than it strikes goes on to
    stuck = [k for k in range(m, 2 * m) if abs(rates[k]) <= np.abs(rates[:m]).max()]
    rows = [*range(m), *stuck]
    Y = responses_to(uni, work, W[rows])
    impulse = np.linalg.lstsq(W[rows] @ Y, -rates[rows], rcond=DEPENDENT)[0]
    jump = Y @ impulse
    work_done = np.zeros(2 * m)
    work_done[rows] = impulse * (rates[rows] + 0.5 * (W[rows] @ jump))
    # what stops that move and drivers give is rounding by then
    return Impact(jump, rates[:m], work_done[:m] + work_done[m:], np.zeros(m), {})


def first_overlap(uni: Unilateral, work: Work, near: float) -> list[int]:
    """The touches that are closed at the beginning; refuses shapes that overlap.

    Raises
    ------
    ModelError
        With the names, by how much, and where.
    """
    rows = uni.read(work)
    found = deepest_overlap(uni, rows, work, near)
    if found is not None:
        raise _overlap(uni, work, found)
    within = uni.within_edges(rows, work, near, 0.0)
    return [n for n, gap in enumerate(uni.gaps(rows)) if abs(gap) <= near and within[n]]


def _overlap(uni: Unilateral, work: Work, found: Overlap) -> ModelError:
    machine = uni.system.mechanism
    j = uni.bodies[found.touch][1]
    x, y, angle = work.q[3 * j : 3 * j + 3, 0]
    ax, ay = (float(part) for part in uni.touches[found.touch].spot.arm)
    place = (
        float(x + np.cos(angle) * ax - np.sin(angle) * ay),
        float(y + np.sin(angle) * ax + np.cos(angle) * ay),
    )
    (one,) = (one for one in machine.contacts if one.name == found.contact)
    sentence = one.overlapping(found.depth, place, uni.system.values, machine.units)
    return ModelError(sentence, one.described_as)
